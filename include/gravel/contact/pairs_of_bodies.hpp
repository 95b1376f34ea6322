#pragma once

/// \file
/// Which pairs of a list a body is in.

#include <gravel/core/check.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/spatial/pair.hpp>

#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <vector>

namespace gravel::detail {

/// Of a list sorted by ids: pairs in which a body is the first follow each other in it, so that only those in
/// which it is the second are listed once more. Four bytes a pair and eight a body.
class PairsOfBodies {
 public:
  /// O(bodies + pairs). \throws std::invalid_argument for 2^32 - 1 pairs or more
  void find(std::size_t bodies, std::span<const Pair> pairs) {
    if (pairs.size() >= std::numeric_limits<std::uint32_t>::max()) {
      refuse("number of pairs that may meet", std::to_string(pairs.size()), "below 2^32 - 1");
    }
    const auto count = static_cast<std::uint32_t>(pairs.size());
    first_.clear();  // bodies() are none until there is room for all
    start_.assign(bodies + 1, 0);
    for (const Pair& pair : pairs) {
      ++start_[pair.second];
    }
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    resizeAnew(asSecond_, count);
    first_.assign(bodies, count);
    for (std::uint32_t k = count; k-- > 0;) {
      first_[pairs[k].first] = k;
      asSecond_[--start_[pairs[k].second]] = k;
    }
  }

  /// It is of no use any more.
  void forget() {
    release(first_);
    release(start_);
    release(asSecond_);
  }

  /// Of the last list.
  std::size_t bodies() const { return first_.size(); }

  /// Calls f(k) for the places in the list of all pairs of a body, in their order, until it says true.
  /// \return whether it did
  template <class F>
  bool any(std::uint32_t body, std::span<const Pair> pairs, F&& f) const {
    for (std::uint32_t place = start_[body]; place < start_[body + 1]; ++place) {
      if (f(asSecond_[place])) {
        return true;
      }
    }
    for (std::uint32_t k = first_[body]; k < pairs.size() && pairs[k].first == body; ++k) {
      if (f(k)) {
        return true;
      }
    }
    return false;
  }

 private:
  std::vector<std::uint32_t> first_;     ///< by body: the first pair in which it is the first
  std::vector<std::uint32_t> start_;     ///< by body, and the end
  std::vector<std::uint32_t> asSecond_;  ///< from there on: pairs in which it is the second
};

}  // namespace gravel::detail
