#pragma once

/// \file
/// Which bodies of a contact problem hang together.

#include <gravel/core/disjoint_sets.hpp>
#include <gravel/core/memory.hpp>

#include <limits>
#include <span>

namespace gravel::detail {

/// Movable bodies joined by contacts, whether these push or not: so islands stay while the contacts do,
/// though in a heap at rest some always come to push and others cease. What does not move joins nobody.
/// Islands of few contacts are numbered in the order of their first ones, and bundled: each of them is solved
/// to an end of its own, and a bundle of them fills lanes and is worth a thread.
class SolverIslands {
 public:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  /// Contacts of a small island: so many are given more than the fewest sweeps (sweepsOfLooks()).
  static constexpr std::uint32_t fewRows = 200;

  /// O(bodies + rows). \param rows  `slot1` and `slot2` of each \param movable  by slot, of which the last is
  /// that of boundaries
  template <class Row>
  void find(std::span<const Row> rows, std::span<const std::uint8_t> movable) {
    slots_.begin(movable.size());
    areFree_ = true;
    for (const Row& row : rows) {
      if (movable[row.slot1] != 0 && movable[row.slot2] != 0) {
        slots_.join(row.slot1, row.slot2);
      } else {
        areFree_ = false;
      }
    }
    slots_.end();
  }

  /// Finds those of at least 2 rows and at most fewRows, none of whose rows might lack a colour.
  /// O(bodies + rows). \param degree  by slot, of its rows if it is movable, or else 0
  /// \param colours  that there are
  template <class Row>
  void bundle(std::span<const Row> rows, std::span<const std::uint32_t> degree, std::size_t colours) {
    numbers_.assign(slots_.size(), 0);
    firsts_.clear();
    bundles_.clear();
    const auto rootOf = [&](const Row& row) { return of(degree[row.slot1] > 0 ? row.slot1 : row.slot2); };
    for (const Row& row : rows) {
      std::uint32_t& count = numbers_[rootOf(row)];
      const std::uint32_t both = degree[row.slot1] + degree[row.slot2];
      // Of a body that no other moves with, all but this one row may have taken colours: both - 1.
      count = both == 0 || both > colours || count > fewRows ? none : count + 1;
    }
    std::uint32_t rowsOfLast = fewRows;
    constexpr std::uint32_t numbered = none / 2;  // and above: no count, but a number
    for (const Row& row : rows) {
      std::uint32_t& number = numbers_[rootOf(row)];
      if (number < 2 || number > fewRows) {
        continue;  // lone, large, or numbered
      }
      if (rowsOfLast >= fewRows) {
        rowsOfLast = 0;
        firsts_.push_back(static_cast<std::uint32_t>(bundles_.size()));
      }
      rowsOfLast += number;
      bundles_.push_back(static_cast<std::uint32_t>(firsts_.size() - 1));
      number = numbered + static_cast<std::uint32_t>(bundles_.size() - 1);
    }
    for (std::uint32_t& number : numbers_) {
      number = number >= numbered && number != none ? number - numbered : none;
    }
  }

  /// numberOf() is of no use any more.
  void forgetNumbers() { giveBack(numbers_); }

  /// The smallest slot in the island of a slot: slots are numbered by ids, the same whatever the indices.
  std::uint32_t of(std::uint32_t slot) const { return slots_.of(slot); }
  /// Of the slots, with the one of boundaries.
  std::size_t size() const { return slots_.size(); }
  /// Nothing is touched that stands still, or moves as it is told: every island falls as one.
  bool areFree() const { return areFree_; }

  /// Of the small island of a movable slot; `none` if it is not small.
  std::uint32_t numberOf(std::uint32_t slot) const { return numbers_[of(slot)]; }
  std::size_t bundles() const { return firsts_.size(); }
  std::uint32_t bundleOf(std::uint32_t number) const { return bundles_[number]; }
  /// Numbers of the islands of a bundle: from the first one on.
  std::uint32_t firstOf(std::size_t bundle) const {
    return bundle < firsts_.size() ? firsts_[bundle] : static_cast<std::uint32_t>(bundles_.size());
  }

 private:
  DisjointSets slots_;
  bool areFree_ = false;
  std::vector<std::uint32_t> numbers_;  ///< by the slot that stands for the island
  std::vector<std::uint32_t> bundles_;  ///< by number
  std::vector<std::uint32_t> firsts_;   ///< number, by bundle
};

}  // namespace gravel::detail
