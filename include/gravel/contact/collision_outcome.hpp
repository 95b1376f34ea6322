#pragma once

/// \file
/// What a user decides of a collision: bounce, merge, or velocities of his own.

#include <gravel/bodies/body.hpp>
#include <gravel/contact/impulses.hpp>
#include <gravel/contact/material.hpp>
#include <gravel/core/callback.hpp>
#include <gravel/core/check.hpp>

#include <utility>
#include <vector>

namespace gravel {

/// Two bodies each, the smaller id first.
using BodyPairs = std::vector<std::pair<BodyId, BodyId>>;

/// Two bodies at the moment at which they hit each other.
template <Real Scalar>
struct Collision {
  /// One of the two. Velocities are those of the blow, not of the step's start.
  struct Partner {
    BodyId id;
    Scalar mass;    ///< [kg]
    Scalar radius;  ///< [m]
    bool fixed;
    MaterialId material;
    Vector3<Scalar> velocity;         ///< [m s^-1]
    Vector3<Scalar> angularVelocity;  ///< [rad s^-1]
  };
  Scalar time;                       ///< [s] of the space
  Partner first;                     ///< of the smaller id
  Partner second;                    ///< of the larger id
  Vector3<Scalar> normal;            ///< unit vector from the first to the second
  Vector3<Scalar> relativeVelocity;  ///< [m s^-1] of the second's centre, of the image that is hit
  Material<Scalar> material;         ///< of the pair, mixed
  Scalar impactSpeed;                ///< [m s^-1] > 0: approach along the normal

  /// Sine of the angle between the line of centres and the relative velocity: 0 head-on, 1 grazing. It is the
  /// impact parameter over the sum of the radii.
  Scalar sineOfAngle() const {
    const Scalar speed = detail::safeNorm(relativeVelocity);
    return speed > Scalar(0)
               ? Scalar(detail::safeNorm(Vector3<Scalar>(relativeVelocity.cross(normal))) / speed)
               : Scalar(0);
  }
};

enum class CollisionKind : std::uint8_t { Bounce, Merge, Velocities };

/// What shall come of a collision.
template <Real Scalar>
struct CollisionOutcome {
  CollisionKind kind = CollisionKind::Bounce;
  /// With CollisionKind::Velocities: of the two bodies after the blow. Those of a fixed body count nothing.
  /// Two that still approach each other fly on to the end of the step, where they bounce as the materials
  /// say.
  Vector3<Scalar> velocity1 = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));
  Vector3<Scalar> velocity2 = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));
  Vector3<Scalar> angularVelocity1 = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));
  Vector3<Scalar> angularVelocity2 = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));

  /// As the materials say.
  static CollisionOutcome bounce() { return {}; }
  /// The two stick to each other, and become one body at the end of the step, see `merged()`.
  static CollisionOutcome merge() { return {.kind = CollisionKind::Merge}; }
  static CollisionOutcome velocities(const Vector3<Scalar>& v1, const Vector3<Scalar>& w1,
                                     const Vector3<Scalar>& v2, const Vector3<Scalar>& w2) {
    return {CollisionKind::Velocities, v1, v2, w1, w2};
  }
};

/// The user's own outcome of the collisions of two bodies. It is called from one thread, once for each impact
/// in the order in which they are dealt, and must not change the space, which refuses that. Contacts that
/// rest are no collisions. What it throws, or a velocity that is not finite (std::invalid_argument), ends the
/// step half way: bodies have moved then, and the time has not.
template <Real Scalar>
using CollisionHook = Callback<CollisionOutcome<Scalar>(const Collision<Scalar>&)>;

/// A hook: those that meet at less than `factor` times their mutual escape speed sqrt(2 G (m1 + m2)/(r1 +
/// r2)) merge, others bounce.
template <Real Scalar>
CollisionHook<Scalar> mergeBelowEscapeSpeed(const Scalar& G, const Scalar& factor = Scalar(1)) {
  return [G, factor](const Collision<Scalar>& hit) {
    const Scalar escape_sq =
        Scalar(2) * G * (hit.first.mass + hit.second.mass) / (hit.first.radius + hit.second.radius);
    return hit.relativeVelocity.squaredNorm() < factor * factor * escape_sq
               ? CollisionOutcome<Scalar>::merge()
               : CollisionOutcome<Scalar>::bounce();
  };
}

namespace detail {

/// What the hook says of a collision.
/// \throws std::invalid_argument unless the velocities that bodies are to have are finite
template <Real Scalar>
CollisionOutcome<Scalar> outcomeOf(const CollisionHook<Scalar>& hook, const Collision<Scalar>& hit) {
  CollisionOutcome<Scalar> outcome = hook(hit);
  if (outcome.kind > CollisionKind::Velocities) {
    refuse("kind of a collision's outcome", std::to_string(static_cast<int>(outcome.kind)),
           "a value of its enumeration");
  }
  const auto require = [](const char* what, const typename Collision<Scalar>::Partner& side,
                          const Vector3<Scalar>& v) {
    if (!side.fixed && !isFinite(v)) {
      refuse(what + std::to_string(toInteger(side.id)), formatVector(v), "finite");
    }
  };
  if (outcome.kind == CollisionKind::Velocities) {
    require("velocity from the collision hook for body ", hit.first, outcome.velocity1);
    require("velocity from the collision hook for body ", hit.second, outcome.velocity2);
    require("angular velocity from the collision hook for body ", hit.first, outcome.angularVelocity1);
    require("angular velocity from the collision hook for body ", hit.second, outcome.angularVelocity2);
  }
  return outcome;
}

/// The cube root of 1 <= x <= 2 by Newton's method, for any scalar.
template <Real Scalar>
Scalar cubeRoot(const Scalar& x) {
  Scalar y = Scalar(1) + (x - Scalar(1)) / Scalar(3.5);
  for (int step = 0; step < 6; ++step) {  // 1e-2, 1e-4, … 1e-64
    y -= (y - x / (y * y)) / Scalar(3);
  }
  return y;
}

/// As merged(), of bodies with the factors k = I/(m r^2): those are in range where I is not.
/// \return the one without an inertia, and its factor
template <Real Scalar>
std::pair<Body<Scalar>, Scalar> mergedByFactors(const Body<Scalar>& a, const Scalar& k_a,
                                                const Body<Scalar>& b, const Scalar& k_b,
                                                const Vector3<Scalar>& r_ab, const Vector3<Scalar>& v_ab,
                                                const Vector3<Scalar>& turn) {
  const MassShares<Scalar> share = massShares<Scalar>(a.mass, true, b.mass, true);  // by inverse mass
  // Relative to the larger radius, that cubes stay in range.
  const Scalar larger = std::max<Scalar>(a.radius, b.radius);
  const Scalar ratio = larger > Scalar(0) ? Scalar(std::min<Scalar>(a.radius, b.radius) / larger) : Scalar(0);
  Body<Scalar> one = a;
  one.mass = a.mass + b.mass;
  one.radius = larger * cubeRoot<Scalar>(Scalar(1) + ratio * ratio * ratio);
  one.inertia.reset();
  const Scalar k = k_a == k_b ? k_a : Scalar(share.second * k_a + share.first * k_b);
  if (a.fixed) {
    return {one, k};
  }
  // a's share of the motion of b: m_b / (m_a + m_b) is a's share by inverse mass.
  one.position = a.position + share.first * r_ab;
  one.velocity = a.velocity + share.first * v_ab;
  if (!(one.radius > Scalar(0))) {
    return {one, k};
  }
  // Angular momentum over m r^2 of the one, which itself leaves the range of a float.
  const auto spinOf = [&](const Body<Scalar>& body, const Scalar& factor, const Scalar& shareOfMass) {
    const Scalar x = body.radius / one.radius;
    return Vector3<Scalar>((shareOfMass * factor * x * x) * Vector3<Scalar>(body.angularVelocity + turn));
  };
  const Vector3<Scalar> arm = r_ab / one.radius;
  const Vector3<Scalar> orbit =
      share.first * share.second * arm.cross(Vector3<Scalar>(v_ab / one.radius + turn.cross(arm)));
  const Vector3<Scalar> angular = spinOf(a, k_a, share.second) + spinOf(b, k_b, share.first) + orbit;
  if (k > Scalar(0)) {
    one.angularVelocity = angular / k - turn;
  }
  return {one, k};
}

}  // namespace detail

/// One body in place of two: mass, momentum, angular momentum (spin takes up that of the orbit), centre of
/// mass and volume are kept. Material and orientation are those of `a`, and so is its place if a is fixed.
/// Its factor of inertia I/(m r^2) is the mean of the two by mass.
/// \param a,b movable bodies with mass, or a fixed one as `a`
/// \param r_ab [m] from a to b, as the nearest image stands
/// \param v_ab [m s^-1] velocity of that image of b relative to a
/// \param turn [rad s^-1] of the frame that velocities and spins are those in. Angular momentum is kept where
///        nothing turns: two at rest in the frame become a smaller body, which turns faster than it.
template <Real Scalar>
Body<Scalar> merged(const Body<Scalar>& a, const Body<Scalar>& b, const Vector3<Scalar>& r_ab,
                    const Vector3<Scalar>& v_ab,
                    const Vector3<Scalar>& turn = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0))) {
  auto [one, k] = detail::mergedByFactors<Scalar>(a, detail::inertiaFactor(a), b, detail::inertiaFactor(b),
                                                  r_ab, v_ab, turn);
  if ((a.inertia || b.inertia) && one.mass > Scalar(0) && one.radius > Scalar(0)) {
    one.inertia = k * one.mass * one.radius * one.radius;
  }
  return one;
}

}  // namespace gravel
