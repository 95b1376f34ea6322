#pragma once

/// \file
/// What impacts inside a step are found and dealt among: bodies on their courses, walls, and what is held.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/contact_bodies.hpp>
#include <gravel/contact/impact_histories.hpp>
#include <gravel/spatial/domain.hpp>

#include <span>

namespace gravel {

/// No body leans on another.
struct NoSupport {};

namespace detail {

/// \tparam Support  `support(i)` [m s^-2]: what the contacts that hold body i add to its acceleration. What
/// rests on something would else be seen to rise by g h/2 at the start of a step and to sink at its end: a
/// ball on it would be thrown up for ever. `support.any(i)`: the same also of contacts that stop it.
/// `support.fall(i)` [m s^-2]: against what they hold it, and `support.carried(i)`, of WayAhead, a part of
/// it.
template <class S, class B, class Course, class Support = NoSupport>
struct ImpactScene {
  B& bodies;
  const Domain<S>& domain;
  MaterialView<S> materials;
  std::span<const HalfSpace<S>> walls;
  std::span<const ContactName> held;
  const ImpactSettings<S>& settings;
  Course& course;
  const Support& support;
  const ImpactHistories<S>* histories = nullptr;

  /// Mean velocity of the drift, and accelerations; none of what nothing moves.
  Vector3<S> velocity(std::uint32_t i) const {
    return isMovable(bodies, i) ? Vector3<S>(course.velocity(bodies, i)) : Vector3<S>(Vector3<S>::Zero());
  }
  Vector3<S> acceleration(std::uint32_t i) const { return freeAcceleration(i) + supportOf(i); }
  /// Nothing holds what a blow has lifted off.
  Vector3<S> supportOf(std::uint32_t i) const {
    if constexpr (!std::is_same_v<Support, NoSupport>) {
      if (isMovable(bodies, i) && !isFree(i)) {
        return support(i);
      }
    }
    return Vector3<S>::Zero();
  }
  bool isFree(std::uint32_t i) const { return histories != nullptr && histories->of(i).free; }
  /// By which a body falls that nothing holds.
  Vector3<S> freeAcceleration(std::uint32_t i) const {
    return isMovable(bodies, i) ? Vector3<S>(course.acceleration(bodies, i)) : Vector3<S>(Vector3<S>::Zero());
  }
  /// The size of that [m s^-2], from what it leans on: see ProblemBodies::fallOf().
  S fallOf(std::uint32_t i) const {
    if constexpr (!std::is_same_v<Support, NoSupport>) {
      return isMovable(bodies, i) ? support.fall(i) : S(0);
    } else {
      return safeNorm(freeAcceleration(i));
    }
  }
  /// The most [m s^-2] by which a body that leans on others would fall along n without them: what they hold
  /// it with, no more than its own fall. Nothing along a table or a wall, nor in free fall.
  S heldAlong(std::uint32_t i, const Vector3<S>& n) const {
    const S fall = fallOf(i);
    if constexpr (!std::is_same_v<Support, NoSupport>) {
      return isFree(i)              ? S(0)
             : isMovable(bodies, i) ? std::min<S>(fall, sizeOf<S>(n.dot(Vector3<S>(support.any(i)))))
                                    : fall;
    } else {
      return fall;
    }
  }
  /// Of both sides; the second may be a boundary.
  S heldAlong(std::uint32_t i, std::uint32_t j, const Vector3<S>& n) const {
    return heldAlong(i, n) + (j == staticPartner ? S(0) : heldAlong(j, n));
  }
  /// At t [s] since the start of the step; what nothing moves spins as it does in the frame.
  Vector3<S> spin(std::uint32_t i, const S& t) const {
    const Vector3<S> w = spinOf(bodies, i);
    return isMovable(bodies, i) ? Vector3<S>(course.spinAt(w, t) + spinByTorque<S>(bodies, i, t, settings.h))
                                : w;
  }
  /// What support makes of the velocity of a movable body at t [s] since the start of the step.
  Vector3<S> velocityBySupport(std::uint32_t i, const S& t) const {
    return supportOf(i) * (t - settings.h / S(2));
  }
};

/// A side of a blow at the moment t of a step.
template <Real S>
struct ImpactSide {
  Vector3<S> v = Vector3<S>::Zero();
  /// The part of v that is due to support. Solves of contacts book the energy of what they do to velocities
  /// at the ends of a step, where there is none of it: a blow takes its energy from v without this part.
  Vector3<S> supported = Vector3<S>::Zero();
  Vector3<S> s = Vector3<S>::Zero();  ///< speed of the surface, r w
  S c = S(0);                         ///< arm / radius
  S spin = S(0);                      ///< 1/k; 0 if it cannot turn
  bool movable = false;
  S mass = S(0);
  S r = S(0);

  template <class Scene>
  static ImpactSide of(const Scene& scene, std::uint32_t i, const S& arm, const S& t) {
    const auto& bodies = scene.bodies;
    ImpactSide side;
    const S r = bodies.radii()[i];
    const S k = bodies.inertiaFactors()[i];
    side.movable = isMovable(bodies, i);
    side.mass = bodies.masses()[i];
    if (side.movable) {
      side.supported = scene.velocityBySupport(i, t);
      side.v = Vector3<S>(scene.course.velocityAt(bodies, i, t, scene.settings.h)) + side.supported;
    }
    side.s = r * scene.spin(i, t);
    side.r = r;
    side.c = r > S(0) ? S(arm / r) : S(0);
    side.spin = side.movable && r > S(0) && k > S(0) ? S(S(1) / k) : S(0);
    return side;
  }
};

/// The two sides of a blow at its moment, the second of which may be a boundary.
template <Real S>
struct ImpactMeeting {
  ImpactSide<S> one, two;
  Vector3<S> n;       ///< from the first to the second
  S distance = S(0);  ///< [m] of the centres; to a boundary the radius
  S a_n = S(0);       ///< [m s^-2] of the second relative to the first, along n
  Vector3<S> drift;   ///< [m s^-1] of the second besides its own velocity: of an image, of a boundary
  S lead = S(0);      ///< [m s^-1] of the drift now, before its mean, along which a boundary goes
  Material<S> material;
};

}  // namespace detail

}  // namespace gravel
