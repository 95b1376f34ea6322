#pragma once

/// \file
/// Pairs that come to a list because blows send bodies elsewhere.

#include <gravel/contact/pairs_of_bodies.hpp>

#include <array>
#include <limits>
#include <span>
#include <vector>

namespace gravel::detail {

/// Each once, however often the same body is sent elsewhere: else a block of n that bounces as a whole has
/// n^2 of them after n blows, of which each is looked at after the next one. Eight bytes a body and sixteen a
/// pair once there are any.
class LatePairs {
 public:
  void clear() {
    clearSpare(pairs_);
    clearSpare(before_);
    last_.clear();
    marks_.clear();
  }
  /// They are of no use any more, but for all().
  void end() {
    giveBack(found_);
    giveBack(before_);
    giveBack(last_);
    giveBack(marks_);
  }

  /// \param find  `find(out)`: appends pairs of `body`
  /// \param pairs, known  the list, in which they may be
  template <class Find>
  void add(std::uint32_t body, std::span<const Pair> pairs, const PairsOfBodies& known, Find&& find) {
    found_.clear();
    find(found_);
    if (found_.empty()) {
      return;
    }
    if (last_.empty()) {
      last_.assign(known.bodies(), none);
      marks_.assign(known.bodies(), none);
    }
    const auto mark = [&](const Pair& pair) { marks_[pair.first == body ? pair.second : pair.first] = body; };
    known.any(body, pairs, [&](std::uint32_t k) { return mark(pairs[k]), false; });
    each(body, mark);
    for (const Pair& pair : found_) {
      if (marks_[pair.first == body ? pair.second : pair.first] != body) {
        pairs_.push_back(pair);
        before_.push_back({last_[pair.first], last_[pair.second]});
        last_[pair.first] = last_[pair.second] = static_cast<std::uint32_t>(pairs_.size() - 1);
      }
    }
  }

  /// Of a body.
  template <class F>
  void each(std::uint32_t body, F&& f) const {
    std::uint32_t k = last_.empty() ? none : last_[body];
    while (k != none) {
      f(pairs_[k]);
      k = before_[k][pairs_[k].first == body ? 0 : 1];
    }
  }

  const std::vector<Pair>& all() const { return pairs_; }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  std::vector<Pair> pairs_;
  std::vector<std::array<std::uint32_t, 2>>
      before_;                        ///< by pair: the one before of its first and second body
  std::vector<std::uint32_t> last_;   ///< by body
  std::vector<std::uint32_t> marks_;  ///< by body: whose partner it was last seen as
  std::vector<Pair> found_;
};

}  // namespace gravel::detail
