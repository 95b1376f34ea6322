#pragma once

/// \file
/// Which contacts a sweep may pass over.

#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/core/types.hpp>

#include <cstdint>
#include <utility>
#include <vector>

namespace gravel::detail {

/// Keeps how far every body has moved, in velocity or place, while sweeps go over the contacts, and how far
/// the two of a contact had when it was right. While they have moved by no more than `still` since, the
/// contact is wrong by no more than that. Rows that share no movable body may be entered at the same time.
template <Real S>
class RowWatch {
 public:
  /// \param still of the ways of both bodies together; below it a row is passed over
  void begin(std::size_t slots, std::size_t rows, const S& still) {
    still_ = still;
    resizeSparingly(ways_, slots);
    // By all threads, since each goes on with its own part.
    parallelFor(slots, 2048, [&](std::size_t slot) { ways_[slot] = S(0); });
    resizeSparingly(then_, rows);
    holds_ = false;
  }
  /// Forgets all of it.
  void end() {
    holds_ = false;
    giveBack(ways_);
    giveBack(then_);
  }
  /// Goes on with other rows being right enough.
  void goOn(const S& still) { still_ = still; }

  const S& still() const { return still_; }

  /// \param way >= 0, at least how far the body moved; by contacts never called for what nothing moves
  void move(std::size_t slot, const S& way) { ways_[slot] += way; }

  /// Row k, between these two, is right now.
  void enter(std::size_t k, std::uint32_t slot1, std::uint32_t slot2) {
    then_[k] = ways_[slot1] + ways_[slot2];
  }
  /// Row k is right where nothing has moved yet, or else stale whatever moves.
  void enterFirst(std::size_t k, bool isRight) { then_[k] = isRight ? S(0) : S(-1); }

  bool isStale(std::size_t k, std::uint32_t slot1, std::uint32_t slot2) const {
    return isStale(k, slot1, slot2, still_);
  }
  /// Of contacts that are right to something else.
  bool isStale(std::size_t k, std::uint32_t slot1, std::uint32_t slot2, const S& still) const {
    return then_[k] < S(0) || ways_[slot1] + ways_[slot2] > then_[k] + still;
  }

  /// Whether every row was right when it was entered, and every move since is known: what comes next may
  /// begin by passing rows over.
  bool holds() const { return holds_; }
  void setHolds(bool holds) { holds_ = holds; }

  /// For a restart.
  const std::vector<S>& ways() const { return ways_; }
  const std::vector<S>& then() const { return then_; }
  void restore(const S& still, std::vector<S> ways, std::vector<S> then) {
    still_ = still;
    ways_ = std::move(ways);
    then_ = std::move(then);
    holds_ = true;
  }

 private:
  S still_ = S(0);
  std::vector<S> ways_;  ///< by slot
  std::vector<S> then_;  ///< by row: of its two when it was right; -1 if it never was
  bool holds_ = false;
};

}  // namespace gravel::detail
