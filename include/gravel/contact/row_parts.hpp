#pragma once

/// \file
/// Rows of a colouring cut into parts, for passes over all of them.

#include <gravel/core/parallel.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gravel::detail {

/// Rows [begin, end).
struct RowPart {
  std::uint32_t begin;
  std::uint32_t end;
};

/// Parts of up to `partSize` rows of one group (a colour, all blocks, the lone ones, the overflow), those
/// first that stand first in their groups. So a thread that takes its share of the parts has about the rows,
/// and the bodies, that it has when colours are shared between threads one by one, and they stay in its
/// cache.
class RowParts {
 public:
  static constexpr std::size_t partSize = 128;
  static constexpr std::size_t fewRows = 4 * partSize;  ///< not worth the threads

  void begin() {
    parts_.clear();
    shared_ = false;
  }
  /// Some rows of the group of rows [from, to). Groups that are not shared are the calling thread's: it
  /// begins with them.
  void add(const RowPart& rows, std::size_t from, std::size_t to, bool isShared) {
    shared_ = shared_ || isShared;
    const Chunks chunks(rows.end - rows.begin, partSize);
    for (std::size_t c = 0; c < chunks.count(); ++c) {
      const RowPart part{static_cast<std::uint32_t>(rows.begin + chunks.begin(c)),
                         static_cast<std::uint32_t>(rows.begin + chunks.end(c))};
      const double middle = 0.5 * (static_cast<double>(part.begin) + static_cast<double>(part.end));
      all_.emplace_back(
          isShared ? (middle - static_cast<double>(from)) / static_cast<double>(to - from) : 0.0, part);
    }
  }
  /// The group of rows [from, to), shared where they are many.
  void addGroup(std::size_t from, std::size_t to, bool mayShare = true) {
    add({static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to)}, from, to,
        mayShare && to - from >= fewRows);
  }
  void end() {
    std::stable_sort(all_.begin(), all_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& part : all_) {
      parts_.push_back(part.second);
    }
    all_ = {};
  }

  std::span<const RowPart> parts() const { return parts_; }
  /// How many parts are worth a task: all of them where threads share no group of rows.
  std::size_t ofTask() const { return shared_ ? 1 : std::max<std::size_t>(1, parts_.size()); }

 private:
  std::vector<RowPart> parts_;
  bool shared_ = false;                          ///< any group is shared between threads
  std::vector<std::pair<double, RowPart>> all_;  ///< with where its middle stands in its group, 0 … 1
};

}  // namespace gravel::detail
