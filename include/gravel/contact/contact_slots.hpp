#pragma once

/// \file
/// The bodies that take part in contacts, numbered without gaps.

#include <gravel/contact/contact_facts.hpp>
#include <gravel/core/check.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>

#include <algorithm>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace gravel::detail {

/// A contact between slots.
struct SlotRow {
  std::uint32_t contact;  ///< index in the list
  std::uint32_t slot1;
  std::uint32_t slot2;
};

/// Slots: the bodies that take part, numbered from 0 in the order of ids; the last one, `staticSlot()`,
/// stands for boundaries.
class ContactSlots {
 public:
  /// Finds slots, and puts them in the place of the bodies in these rows, which stand in the order of keys.
  /// O(contacts), and O(bodies) once for the largest number of them; with a sort of those bodies that are
  /// first in no contact where others take part than before.
  /// \throws std::invalid_argument for rows out of order
  template <ContactBodies B>
  void number(std::vector<SlotRow>& rows, const B& bodies) {
    const auto requireOrder = [&](auto&& placeOf) {
      const auto isWrong = [&](std::size_t k) { return k > 0 && placeOf(k) < placeOf(k - 1); };
      if (const std::size_t wrong = firstOf(rows.size(), isWrong); wrong < rows.size()) {
        refuse("place of a contact", std::to_string(wrong), "that in the order of keys");
      }
    };
    if (!findDegrees(rows, bodies)) {
      requireOrder([&](std::size_t k) { return bodies.ids()[rows[k].slot1]; });
      numberAnew(rows, bodies);
      findDegrees(rows, bodies);
    }
    parallelFor(rows.size(), chunk, [&](std::size_t k) {
      SlotRow& row = rows[k];
      row.slot1 = slotOfBody_[row.slot1];
      row.slot2 = row.slot2 == staticPartner ? staticSlot() : slotOfBody_[row.slot2];
    });
    requireOrder([&](std::size_t k) { return rows[k].slot1; });
  }

  /// degree() is of no use any more.
  void forgetDegrees() { giveBack(degree_); }

  /// Body of each slot.
  std::span<const std::uint32_t> bodies() const { return bodyOfSlot_; }
  std::uint32_t staticSlot() const { return static_cast<std::uint32_t>(bodyOfSlot_.size()); }
  /// By slot, with that of boundaries: 1 for what contacts can move.
  std::span<const std::uint8_t> movable() const { return movable_; }
  /// By slot, in how many contacts a movable body is; 0 of others.
  std::span<const std::uint32_t> degree() const { return degree_; }
  /// Slot of a body; staticSlot() if it has none.
  std::uint32_t of(std::uint32_t body) const {
    const std::uint32_t slot = body < slotOfBody_.size() ? slotOfBody_[body] : none;
    return slot == none ? staticSlot() : slot;
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t chunk = 4096;

  /// The least k below n of which it is true; n if there is none.
  template <class F>
  static std::size_t firstOf(std::size_t n, F&& isTrue) {
    return orderedMin(n, chunk, n, [&](std::size_t k) { return isTrue(k) ? k : n; });
  }

  /// Who is movable, and of how many contacts. Those who take part are mostly those of before.
  /// \param rows  of bodies
  /// \return whether the slots are theirs, in the order of the ids that they have now
  template <class B>
  bool findDegrees(std::span<const SlotRow> rows, const B& bodies) {
    auto&& ids = bodies.ids();
    const std::uint32_t slots = staticSlot();
    const auto isWrong = [&](std::size_t slot) {
      const std::uint32_t body = bodyOfSlot_[slot];
      const std::uint32_t before = bodyOfSlot_[slot > 0 ? slot - 1 : 0];  // may be gone as well
      return body >= bodies.size() || before >= bodies.size() || ids[body] < ids[before];
    };
    if (slotOfBody_.size() < bodies.size() || firstOf(slots, isWrong) < slots) {
      return false;
    }
    degree_.assign(slots + std::size_t{1}, 0);
    for (const SlotRow& row : rows) {
      const std::uint32_t slot1 = slotOfBody_[row.slot1];
      const std::uint32_t slot2 = row.slot2 == staticPartner ? slots : slotOfBody_[row.slot2];
      if (slot1 == none || slot2 == none) {
        return false;
      }
      ++degree_[slot1];
      ++degree_[slot2];
    }
    if (firstOf(slots, [&](std::size_t slot) { return degree_[slot] == 0; }) < slots) {
      return false;
    }
    movable_.resize(slots + std::size_t{1});
    parallelFor(movable_.size(), chunk, [&](std::size_t slot) {
      movable_[slot] = slot < slots && isMovable(bodies, bodyOfSlot_[slot]) ? 1 : 0;
      degree_[slot] *= movable_[slot];
    });
    return true;
  }

  /// Contacts come in the order of their first keys, so that only those bodies that are first in none need to
  /// be sorted.
  template <class B>
  void numberAnew(std::span<const SlotRow> rows, const B& bodies) {
    for (const std::uint32_t body : bodyOfSlot_) {
      slotOfBody_[body] = none;
    }
    bodyOfSlot_.clear();
    slotOfBody_.resize(std::max(slotOfBody_.size(), bodies.size()), none);
    bodyOfSlot_.reserve(bodies.size());
    const auto take = [&](std::uint32_t body) {
      if (slotOfBody_[body] == none) {
        slotOfBody_[body] = 0;
        bodyOfSlot_.push_back(body);
      }
    };
    for (const SlotRow& row : rows) {
      take(row.slot1);
    }
    const auto firsts = static_cast<std::ptrdiff_t>(bodyOfSlot_.size());
    for (const SlotRow& row : rows) {
      if (row.slot2 != staticPartner) {
        take(row.slot2);
      }
    }
    auto&& ids = bodies.ids();
    const auto before = [&](std::uint32_t a, std::uint32_t b) { return ids[a] < ids[b]; };
    std::sort(bodyOfSlot_.begin() + firsts, bodyOfSlot_.end(), before);
    std::inplace_merge(bodyOfSlot_.begin(), bodyOfSlot_.begin() + firsts, bodyOfSlot_.end(), before);
    for (std::uint32_t slot = 0; slot < staticSlot(); ++slot) {
      slotOfBody_[bodyOfSlot_[slot]] = slot;
    }
  }

  std::vector<std::uint32_t> bodyOfSlot_;
  std::vector<std::uint32_t> slotOfBody_;
  std::vector<std::uint8_t> movable_;
  std::vector<std::uint32_t> degree_;
};

}  // namespace gravel::detail
