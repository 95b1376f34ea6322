#pragma once

/// \file
/// What is known of bodies that rest together and are asleep.

#include <gravel/bodies/bodies.hpp>
#include <gravel/contact/contact_solver.hpp>

namespace gravel {

/// A body as it was when its island came to rest; another value of it wakes it.
template <Real Scalar>
struct RestingBody {
  std::uint64_t id;
  std::uint64_t material;
  Vector3<Scalar> position;
  Vector3<Scalar> acceleration;
  Vector3<Scalar> angularAcceleration;
  Scalar mass;
  Scalar radius;
  std::uint32_t index = 0;  ///< where it stood when last looked for

  template <class Proxy>
  static RestingBody of(const Proxy& body) {
    return {toInteger(body.id()),
            static_cast<std::uint64_t>(body.material()),
            body.position(),
            body.acceleration(),
            body.angularAcceleration(),
            body.mass(),
            body.radius(),
            static_cast<std::uint32_t>(body.index())};
  }

  /// Whether nobody moved it or made another body of it.
  template <class Proxy>
  bool holds(const Proxy& body) const {
    return position == Vector3<Scalar>(body.position()) && mass == Scalar(body.mass()) &&
           radius == Scalar(body.radius()) && material == static_cast<std::uint64_t>(body.material());
  }
};

enum class IslandState : std::uint64_t {
  Tired,   ///< at rest for long enough: asleep from the next step on, if nothing happens before
  Asleep,  ///< not kicked, not drifted, not solved
  Waking,  ///< awake from the next step on
};

/// Movable bodies that touch each other, what they lean on, and the contacts that hold them.
template <Real Scalar>
struct SleepingIsland {
  IslandState state = IslandState::Tired;
  Scalar span = Scalar(0);    ///< [s] step over which `impulses` acted
  Scalar solved = Scalar(0);  ///< [s] step of the solve that `memory` is of
  Scalar fall = Scalar(0);    ///< [m s^-2] mean |a| by mass
  std::vector<RestingBody<Scalar>> members;
  std::vector<RestingBody<Scalar>> supports;  ///< fixed ones
  ContactList<Scalar> contacts;               ///< sorted by keys
  std::vector<ContactImpulse<Scalar>> impulses;
  std::vector<StoredImpulse<Scalar>> memory;  ///< what a solver goes on from
};

namespace detail {

template <Real Scalar>
ContactImpulse<Scalar> times(const ContactImpulse<Scalar>& j, const Scalar& factor) {
  return {factor * j.normal, factor * j.tangential, factor * j.turning, j.impact};
}

template <Real Scalar, class Layout>
std::optional<std::size_t> placeOf(const Bodies<Scalar, Layout>& bodies, const RestingBody<Scalar>& known) {
  if (known.index < bodies.size() && bodies.ids()[known.index] == known.id) {
    return known.index;
  }
  return bodies.find(BodyId{known.id});
}

/// The contact by today's indices.
template <Real Scalar, class Layout>
Contact<Scalar> present(const Bodies<Scalar, Layout>& bodies, Contact<Scalar> c) {
  c.first = static_cast<std::uint32_t>(bodies.indexOf(BodyId{c.key1}));
  if (c.second != staticPartner) {
    c.second = static_cast<std::uint32_t>(bodies.indexOf(BodyId{c.key2}));
  }
  return c;
}

/// Whether all bodies of it are there, and as they were.
template <Real Scalar, class Layout>
bool asItWas(const Bodies<Scalar, Layout>& bodies, const SleepingIsland<Scalar>& island) {
  const bool asleep = island.state != IslandState::Tired;
  const auto member = [&](const RestingBody<Scalar>& known) {
    const auto i = placeOf(bodies, known);
    if (!i || !known.holds(bodies[*i]) || bodies[*i].isFixed() || bodies[*i].isAsleep() != asleep) {
      return false;
    }
    return !asleep || (Vector3<Scalar>(bodies[*i].velocity()) == Vector3<Scalar>::Zero() &&
                       Vector3<Scalar>(bodies[*i].angularVelocity()) == Vector3<Scalar>::Zero());
  };
  const auto support = [&](const RestingBody<Scalar>& known) {
    const auto i = placeOf(bodies, known);
    return i && known.holds(bodies[*i]) && !detail::isMovable(bodies, *i);
  };
  return std::all_of(island.members.begin(), island.members.end(), member) &&
         std::all_of(island.supports.begin(), island.supports.end(), support);
}

/// Whether the acceleration of one of its bodies, at the centre or by spin at the surface, is another one by
/// `most` [m s^-2], or by a 64th of the island's mean.
template <Real Scalar, class Layout>
bool isPulledOtherwise(const Bodies<Scalar, Layout>& bodies, const SleepingIsland<Scalar>& island,
                       const Scalar& most) {
  const Scalar limit = std::min<Scalar>(most, Scalar(island.fall / Scalar(64)));
  for (const RestingBody<Scalar>& known : island.members) {
    if (const auto i = placeOf(bodies, known)) {
      const auto body = bodies[*i];
      const Vector3<Scalar> da = body.acceleration() - known.acceleration;
      const Vector3<Scalar> dw = (body.angularAcceleration() - known.angularAcceleration) * known.radius;
      if (da.squaredNorm() > limit * limit || dw.squaredNorm() > limit * limit) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace detail

}  // namespace gravel
