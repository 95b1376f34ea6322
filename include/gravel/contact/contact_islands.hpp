#pragma once

/// \file
/// Which bodies hang together by contacts.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/contact_bodies.hpp>
#include <gravel/core/disjoint_sets.hpp>

#include <span>

namespace gravel {

/// Movable bodies that contacts join, directly or through other movable ones; what does not move joins
/// nobody. An island is named by the smallest index in it, so that neither the order of contacts nor threads
/// have a say.
class ContactIslands {
 public:
  /// O(bodies + contacts).
  /// \param contacts `first` and `second` of each: contacts, or their names
  template <class C, ContactBodies B>
  void find(std::span<const C> contacts, const B& bodies) {
    sets_.begin(bodies.size());
    for (const C& c : contacts) {
      if (c.second != staticPartner && detail::isMovable(bodies, c.first) &&
          detail::isMovable(bodies, c.second)) {
        sets_.join(c.first, c.second);
      }
    }
    sets_.end();
  }

  /// The smallest index of a body in the island of body i.
  std::uint32_t of(std::size_t i) const { return sets_.of(i); }

 private:
  detail::DisjointSets sets_;
};

}  // namespace gravel
