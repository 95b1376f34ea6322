#pragma once

/// \file
/// Which bodies of a contact problem hang together.

#include <gravel/contact/contact_coloring.hpp>
#include <gravel/core/disjoint_sets.hpp>

namespace gravel::detail {

/// Movable bodies joined by contacts, whether these push or not: so islands stay while the contacts do,
/// though in a heap at rest some always come to push and others cease. What does not move joins nobody.
class SolverIslands {
 public:
  /// O(bodies + contacts). \param contacts  those of the colouring
  template <Real S>
  void find(std::span<const Contact<S>> contacts, const ContactColoring& colouring) {
    slots_.begin(colouring.bodies().size() + 1);
    areFree_ = true;
    for (const Contact<S>& c : contacts) {  // not its rows: neighbours here are so in memory, too
      const std::uint32_t slot1 = colouring.slotOf(c.first);
      const std::uint32_t slot2 = colouring.slotOf(c.second);
      if (colouring.movable(slot1) && colouring.movable(slot2)) {
        slots_.join(slot1, slot2);
      } else {
        areFree_ = false;
      }
    }
    slots_.end();
  }

  /// The smallest slot in the island of a slot: slots are numbered by ids, the same whatever the indices.
  std::uint32_t of(std::uint32_t slot) const { return slots_.of(slot); }
  /// Of the slots, with the one of boundaries.
  std::size_t size() const { return slots_.size(); }
  /// Nothing is touched that stands still, or moves as it is told: every island falls as one.
  bool areFree() const { return areFree_; }

 private:
  DisjointSets slots_;
  bool areFree_ = false;
};

}  // namespace gravel::detail
