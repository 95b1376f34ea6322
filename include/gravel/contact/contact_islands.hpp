#pragma once

/// \file
/// Which bodies hang together by contacts.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/contact_bodies.hpp>

#include <numeric>
#include <span>

namespace gravel {

/// Movable bodies that contacts join, directly or through other movable ones; what does not move joins
/// nobody. An island is named by the smallest index in it, so that neither the order of contacts nor threads
/// have a say.
class ContactIslands {
 public:
  /// O(bodies + contacts), but for a factor that grows slower than any logarithm.
  /// \param contacts `first` and `second` of each: contacts, or their names
  template <class C, ContactBodies B>
  void find(std::span<const C> contacts, const B& bodies) {
    parent_.resize(bodies.size());
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
    for (const C& c : contacts) {
      if (c.second != staticPartner && detail::isMovable(bodies, c.first) &&
          detail::isMovable(bodies, c.second)) {
        const std::uint32_t a = rootOf(c.first);
        const std::uint32_t b = rootOf(c.second);
        parent_[std::max(a, b)] = std::min(a, b);
      }
    }
    for (std::uint32_t& parent : parent_) {
      parent = parent_[parent];  // parents come before their children
    }
  }

  /// The smallest index of a body in the island of body i.
  std::uint32_t of(std::size_t i) const { return parent_[i]; }

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

}  // namespace gravel
