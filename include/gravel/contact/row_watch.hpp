#pragma once

/// \file
/// Which contacts a sweep may pass over.

#include <gravel/core/types.hpp>

#include <cstdint>
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
    ways_.assign(slots, S(0));
    then_.resize(rows);
  }

  const S& still() const { return still_; }

  /// \param way >= 0, at least how far the body moved; never called for what nothing moves
  void move(std::uint32_t slot, const S& way) { ways_[slot] += way; }

  /// Row k, between these two, is right now.
  void enter(std::size_t k, std::uint32_t slot1, std::uint32_t slot2) {
    then_[k] = ways_[slot1] + ways_[slot2];
  }
  /// Nothing has moved yet; row k is right, or else stale.
  void enterFirst(std::size_t k, bool isRight) { then_[k] = isRight ? S(0) : S(-1) - still_; }

  bool isStale(std::size_t k, std::uint32_t slot1, std::uint32_t slot2) const {
    return ways_[slot1] + ways_[slot2] > then_[k] + still_;
  }

 private:
  S still_ = S(0);
  std::vector<S> ways_;  ///< by slot
  std::vector<S> then_;  ///< by row: of its two when it was right
};

}  // namespace gravel::detail
