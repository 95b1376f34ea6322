#pragma once

/// \file
/// How rows slipped and turned before the kick, of those where that lasts.

#include <gravel/contact/solver_rows.hpp>
#include <gravel/core/memory.hpp>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace gravel::detail {

/// How a row slipped and turned across n before the kick, if that lasts: if it is more than so many times
/// what a step does to it.
template <Real S>
struct RowBefore {
  std::uint32_t row = 0;
  Vector3<S> slip = Vector3<S>::Zero();
  Vector3<S> turn = Vector3<S>::Zero();
  static S lasting() { return S(2); }
};

/// What some rows ask for, and how those of them that last were before, in any order.
template <Real S>
struct RowsTaken {
  RowNeeds<S> needs;
  std::vector<RowBefore<S>> before;
  RowsTaken& operator+=(const RowsTaken& other) {
    needs += other.needs;
    before.insert(before.end(), other.before.begin(), other.before.end());
    return *this;
  }
  /// Of a row that lasts, one of the few that were taken up last.
  RowBefore<S>& of(std::size_t row) {
    return *std::find_if(before.rbegin(), before.rend(), [row](const auto& b) { return b.row == row; });
  }
};

/// All of them by row, with room for those alone that last: in a heap few do.
template <Real S>
class RowsBefore {
 public:
  /// \param rows  how many there are
  void set(std::size_t rows, std::vector<RowBefore<S>>&& all) {
    all_ = std::move(all);
    resizeAnew(place_, all_.empty() ? 0 : rows);
    for (std::size_t place = 0; place < all_.size(); ++place) {
      place_[all_[place].row] = static_cast<std::uint32_t>(place);
    }
  }
  bool empty() const { return all_.empty(); }
  /// Of one that lasts.
  const RowBefore<S>& of(std::size_t row) const { return all_[place_[row]]; }
  /// They are of no use any more.
  void forget() {
    release(all_);
    giveBack(place_);
  }

 private:
  std::vector<RowBefore<S>> all_;
  std::vector<std::uint32_t> place_;  ///< by row
};

}  // namespace gravel::detail
