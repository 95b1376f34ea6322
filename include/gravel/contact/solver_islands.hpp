#pragma once

/// \file
/// Which bodies of a contact problem hang together.

#include <gravel/contact/contact_coloring.hpp>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace gravel::detail {

/// Movable bodies joined by contacts, whether these push or not: so islands stay while the contacts do,
/// though in a heap at rest some always come to push and others cease. What does not move joins nobody.
class SolverIslands {
 public:
  /// O(bodies + contacts), but for a factor that grows slower than any logarithm.
  void find(const ContactColoring& colouring) {
    ofSlot_.resize(colouring.bodies().size() + 1);
    std::iota(ofSlot_.begin(), ofSlot_.end(), 0U);
    areFree_ = true;
    for (const ContactColoring::Row& row : colouring.rowsByContact()) {  // neighbours in memory too
      if (colouring.movable(row.slot1) && colouring.movable(row.slot2)) {
        join(row.slot1, row.slot2);
      } else {
        areFree_ = false;
      }
    }
    for (std::uint32_t& parent : ofSlot_) {  // a parent comes before its children
      parent = ofSlot_[parent];
    }
  }

  /// The smallest slot in the island of a slot: slots are numbered by ids, the same whatever the indices.
  std::uint32_t of(std::uint32_t slot) const { return ofSlot_[slot]; }
  /// Of the slots, with the one of boundaries.
  std::size_t size() const { return ofSlot_.size(); }
  /// Nothing is touched that stands still, or moves as it is told: every island falls as one.
  bool areFree() const { return areFree_; }

 private:
  std::uint32_t rootOf(std::uint32_t i) {
    while (ofSlot_[i] != i) {
      ofSlot_[i] = ofSlot_[ofSlot_[i]];
      i = ofSlot_[i];
    }
    return i;
  }

  void join(std::uint32_t i, std::uint32_t j) {
    if (ofSlot_[i] == ofSlot_[j]) {
      return;
    }
    i = rootOf(i);
    j = rootOf(j);
    ofSlot_[std::max(i, j)] = std::min(i, j);
  }

  std::vector<std::uint32_t> ofSlot_;
  bool areFree_ = false;
};

}  // namespace gravel::detail
