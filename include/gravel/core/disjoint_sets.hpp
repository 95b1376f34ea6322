#pragma once

/// \file
/// Numbers 0, 1, … in sets that grow together (union-find).

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace gravel::detail {

/// A set is named by the smallest number in it, so that the order in which sets were joined has no say.
/// All of it is O(numbers + joins), but for a factor that grows slower than any logarithm. Keeps its memory.
class DisjointSets {
 public:
  /// Each number alone.
  void begin(std::size_t count) {
    parent_.resize(count);
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  void join(std::uint32_t i, std::uint32_t j) {
    if (parent_[i] != parent_[j]) {
      i = rootOf(i);
      j = rootOf(j);
      parent_[std::max(i, j)] = std::min(i, j);
    }
  }
  /// Before the first of().
  void end() {
    for (std::uint32_t& parent : parent_) {
      parent = parent_[parent];  // parents come before their children
    }
  }

  /// The smallest number in the set of i.
  std::uint32_t of(std::size_t i) const { return parent_[i]; }
  /// Of the numbers.
  std::size_t size() const { return parent_.size(); }

 private:
  std::uint32_t rootOf(std::uint32_t i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];
      i = parent_[i];
    }
    return i;
  }

  std::vector<std::uint32_t> parent_;
};

}  // namespace gravel::detail
