#pragma once

/// \file
/// What has to be known of all contacts of a step together, before they are moved apart and solved.

#include <gravel/contact/contact_bodies.hpp>
#include <gravel/contact/contact_list.hpp>
#include <gravel/core/check.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/spatial/pair.hpp>

#include <algorithm>
#include <span>
#include <string>

namespace gravel {

/// What occurs among the contacts of a step.
struct ContactKinds {
  bool rub = false;     ///< friction
  bool grip = false;    ///< more of it at rest than in a slide
  bool turn = false;    ///< resistance to rolling or spinning
  bool spring = false;  ///< tangential restitution
  bool drift = false;   ///< a second side that moves on by itself

  template <Real S>
  void include(const ContactSurface<S>& surface) {
    rub = rub || surface.material.staticFriction > S(0);
    grip = grip || surface.material.staticFriction > surface.material.kineticFriction;
    turn = turn || surface.material.rollingFriction > S(0) || surface.material.spinningFriction > S(0);
    spring = spring || surface.material.tangentialRestitution > S(0);
    drift = drift || !detail::equalIsSame<S> || !(surface.drift == Vector3<S>::Zero());
  }
  ContactKinds& operator+=(const ContactKinds& other) {
    rub = rub || other.rub;
    grip = grip || other.grip;
    turn = turn || other.turn;
    spring = spring || other.spring;
    drift = drift || other.drift;
    return *this;
  }
};

/// Found by who makes the contacts, while each is at hand, or by of().
template <Real S>
struct ContactFacts {
  ContactKinds kinds;
  S overlap = S(0);                 ///< [m] the largest
  S radius = detail::highest<S>();  ///< [m] the smallest
  std::size_t others = 0;           ///< that are not those of before, in their places

  /// All but its kind. \param r the smaller of its radii  \param before its name is the one of before
  void include(const Contact<S>& c, const S& r, bool before) {
    overlap = std::max<S>(overlap, S(-c.gap));
    radius = std::min<S>(radius, r);
    others += before ? 0 : 1;
  }
  ContactFacts& operator+=(const ContactFacts& more) {
    kinds += more.kinds;
    overlap = std::max<S>(overlap, more.overlap);
    radius = std::min<S>(radius, more.radius);
    others += more.others;
    return *this;
  }

  /// \param before names of contacts, in the same order
  /// \throws std::invalid_argument for a contact of a body that is not there, or of a body with itself, or
  ///         without a surface
  template <ContactBodies B>
  static ContactFacts of(const ContactView<S>& contacts, const B& bodies,
                         std::span<const ContactName> before = {});
};

namespace detail {

/// \throws std::invalid_argument for a contact of a body that is not among `count`, or of a body with itself
template <Real S>
void requireBodies(const Contact<S>& c, std::size_t count) {
  const bool known = c.first < count && (c.second < count || c.second == staticPartner);
  if (!known || c.first == c.second) {
    refuse("body of a contact", std::to_string(c.first) + ", " + std::to_string(c.second),
           "two bodies, below " + std::to_string(count) + ", or a boundary");
  }
}

/// \throws std::invalid_argument
[[noreturn, gnu::noinline]] inline void refusePair(Pair pair, std::size_t count) {
  refuse("pair of bodies", std::to_string(pair.first) + ", " + std::to_string(pair.second),
         "two bodies, below " + std::to_string(count));
}

/// \throws std::invalid_argument for a pair of a body that is not among `count`, or of a body with itself
[[gnu::always_inline]] inline void requireBodies(Pair pair, std::size_t count) {
  if (pair.first >= count || pair.second >= count || pair.first == pair.second) {
    refusePair(pair, count);
  }
}

/// \throws std::invalid_argument for a contact without a surface
template <Real S>
void requireSurface(const Contact<S>& c, std::size_t count) {
  if (c.surface >= count) {
    refuse("surface of a contact", std::to_string(c.surface),
           "below the number of surfaces, " + std::to_string(count));
  }
}

/// Of two radii the smaller one that is not zero.
template <Real S>
S smallerRadius(const S& r1, const S& r2) {
  return r1 > S(0) && r2 > S(0) ? std::min<S>(r1, r2) : std::max<S>(r1, r2);
}

/// The same of a contact.
template <Real S, ContactBodies B>
S smallerRadius(const Contact<S>& c, const B& bodies) {
  const S r1 = bodies.radii()[c.first];
  return c.second == staticPartner ? r1 : smallerRadius<S>(r1, S(bodies.radii()[c.second]));
}

/// Whether contact k of a list has the name that stands there in another one.
template <Real S>
[[gnu::always_inline]] inline bool isNamed(std::span<const ContactName> names, std::size_t k,
                                           const Contact<S>& c) {
  return k < names.size() && names[k] == ContactName::of(c);
}

}  // namespace detail

template <Real S>
template <ContactBodies B>
ContactFacts<S> ContactFacts<S>::of(const ContactView<S>& contacts, const B& bodies,
                                    std::span<const ContactName> before) {
  detail::requireWhole(bodies);
  return orderedSum(contacts.size(), 512, ContactFacts{}, [&](std::size_t begin, std::size_t end) {
    ContactFacts part;
    for (std::size_t k = begin; k < end; ++k) {
      const Contact<S>& c = contacts[k];
      detail::requireBodies(c, bodies.size());
      detail::requireSurface(c, contacts.surfaces.size());
      part.kinds.include(contacts.surface(c));
      part.include(c, detail::smallerRadius(c, bodies), detail::isNamed(before, k, c));
    }
    return part;
  });
}

}  // namespace gravel
