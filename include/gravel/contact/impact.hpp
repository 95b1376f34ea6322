#pragma once

/// \file
/// Impacts inside a step: what they are, what is asked of them and what is reported; and how bodies drift
/// meanwhile.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/contact_bodies.hpp>
#include <gravel/contact/contact_settings.hpp>
#include <gravel/contact/time_of_impact.hpp>
#include <gravel/spatial/pair.hpp>

#include <array>
#include <vector>

namespace gravel {

template <Real Scalar>
struct ImpactSettings {
  Scalar time = Scalar(0);                  ///< [s] at the start, for a sheared domain
  Scalar h = Scalar(0);                     ///< [s] >= 0
  Scalar restitutionThreshold = Scalar(0);  ///< [m s^-1] a slower approach stops
  Scalar epsilon = Scalar(0);               ///< [m] centres closer than this count as one point
  /// What strikes a body after so many impacts of it in the step stays in contact with it, so that no cascade
  /// goes on for ever. An impact counts 1 - e + 1/512, since only those that lose energy can go on for ever;
  /// further bounces from the same partner, of which the number is bounded otherwise, 1/512. Of two the
  /// lighter one is charged, or both of equal mass, and what cannot move never.
  static constexpr int mostPerBody = 8;
  /// After so many of these, too, the body flies on until the end of the step, through what is in its way
  /// but for what is fixed or much heavier, of those that it met none lighter than the heaviest, and after as
  /// many again through that, too. It is left to the solver of simultaneous contacts: a heavy one that
  /// presses a light one against a wall would else go on for as many blows as the ratio of their masses.
  static constexpr int mostAfter = 64;
  /// After so many blows of both in a step two bodies that lean on each other are no longer driven together
  /// by others, unless faster than what they fall by in the step.
  static constexpr std::uint32_t mostSlow = 8;
};

/// One blow.
template <Real Scalar>
struct Impact {
  std::uint32_t first;   ///< index of the body of the smaller id
  std::uint32_t second;  ///< index of the other, or `staticPartner`
  std::uint64_t key1;
  std::uint64_t key2;
  Scalar time;                     ///< [s] since the start of the step
  Scalar speed;                    ///< [m s^-1] of approach
  Vector3<Scalar> normal;          ///< from the first to the second
  Scalar distance;                 ///< [m] of the centres; to a boundary the radius
  ContactImpulse<Scalar> impulse;  ///< on the second
  bool rests;                      ///< it stays in contact for the rest of the step
  Scalar settle;  ///< [s] since the start of the step: when the last of its bounces is over, if it rests
  bool decided = false;        ///< by somebody else's outcome
  Scalar parting = Scalar(0);  ///< [m s^-1] along the normal, of what was decided; 0 of what shall merge
  Scalar fling = Scalar(0);    ///< tangential restitution, of a slip that it turned back; else 0

  ContactKeys keys() const { return {key1, key2}; }
};

/// A body that began to turn otherwise inside the step. Spins are those with which it would have to begin the
/// step to turn so at that time: in a frame that turns they turn on the way.
template <Real Scalar>
struct TurnChange {
  std::uint32_t body;
  Scalar time;  ///< [s] since the start of the step
  Vector3<Scalar> before;
  Vector3<Scalar> after;
};

template <Real Scalar>
struct ImpactReport {
  std::size_t impacts = 0;
  std::size_t postponed = 0;  ///< bodies that reached `mostPerBody`
  std::size_t grazes = 0;     ///< touches that approach by no more than rounding: no blow is dealt
  Scalar restitutionLoss = Scalar(0);
  Scalar frictionLoss = Scalar(0);
  Scalar driftWork = Scalar(0);
};

/// Nobody else decides what an impact does.
struct NoDecision {};

/// How bodies will fly from where a step begins, while their accelerations last: for ImpactForecast alone.
template <Real S>
struct FlightFromStart {
  S h;  ///< [s]
  template <class B>
  Vector3<S> velocity(const B& bodies, std::size_t i) const {
    return Vector3<S>(bodies.velocities()[i]) + acceleration(bodies, i) * (h / S(2));
  }
  template <class B>
  Vector3<S> acceleration(const B& bodies, std::size_t i) const {
    return bodies.accelerations()[i];
  }
};

/// How bodies drift: straight on. A course tells the mean velocity of body i over the step, x + v h being the
/// place at its end, the acceleration that bends its path, and how spins turn; and deals a blow so that the
/// same drift ends where the body is afterwards.
template <Real S>
struct StraightCourse {
  template <class B>
  Vector3<S> velocity(const B& bodies, std::size_t i) const {
    return bodies.velocities()[i];
  }
  template <class B>
  Vector3<S> acceleration(const B& bodies, std::size_t i) const {
    return bodies.accelerations()[i];
  }
  /// Velocity [m s^-1] at t [s] since the start of the step of length h.
  template <class B>
  Vector3<S> velocityAt(const B& bodies, std::size_t i, const S& t, const S& h) const {
    return velocity(bodies, i) + acceleration(bodies, i) * (t - h / S(2));
  }
  /// Spin at t [s] of what begins the step with spin w, and with which it begins to have w at t.
  static const Vector3<S>& spinAt(const Vector3<S>& w, const S&) { return w; }
  static const Vector3<S>& spinAtStart(const Vector3<S>& w, const S&) { return w; }
  /// What is added to spins for those by which orientations turn over a step, but for a turn of the frame.
  static Vector3<S> frameSpin() { return Vector3<S>::Zero(); }
  /// [J kg^-1] that forces do to a body that is put elsewhere by `shift`.
  template <class B>
  S workOf(const B& bodies, std::size_t i, const Vector3<S>& shift) const {
    return acceleration(bodies, i).dot(shift);
  }
  /// \param strokes changes of velocity [m s^-1] one after another, each to be multiplied by `share`
  /// \param t [s] since the start of the step
  template <class B>
  void push(B& bodies, std::size_t i, const S& share, const std::array<Vector3<S>, 3>& strokes, const S& t) {
    const Vector3<S> before = bodies.velocities()[i];
    for (const Vector3<S>& dv : strokes) {
      bodies.velocities()[i] += share * dv;
    }
    bodies.positions()[i] -= t * Vector3<S>(Vector3<S>(bodies.velocities()[i]) - before);
  }
};

namespace detail {

/// [rad/s] by which torques have a body spin otherwise at t than in the middle of a step of length h, as in
/// velocityAt(); none where bodies have no angular acceleration.
template <Real S, class B>
Vector3<S> spinByTorque(const B& bodies, std::size_t i, const S& t, const S& h) {
  if constexpr (requires { bodies.angularAccelerations(); }) {
    return Vector3<S>(bodies.angularAccelerations()[i]) * (t - h / S(2));
  } else {
    return Vector3<S>::Zero();
  }
}

/// [m s^-1] Rounding of speeds along n: what common motion, and what motion across n, brings into it.
template <Real S>
S noiseAlong(const Vector3<S>& n, const Vector3<S>& v1, const Vector3<S>& v2, const Vector3<S>& v_rel) {
  return S(16) * roundoff<S>() *
         (sumAbs(Vector3<S>(n.cwiseProduct(v1))) + sumAbs(Vector3<S>(n.cwiseProduct(v2))) + maxAbs(v_rel));
}

/// An impact to come; void if a body has been through another one since.
template <Real S>
struct ImpactEvent {
  S t;
  std::uint32_t first;
  std::uint32_t second;
  std::uint64_t key1;
  std::uint64_t key2;
  std::uint32_t stamp1 = 0;
  std::uint32_t stamp2 = 0;
  std::uint32_t wall = 0;
};

template <Real S>
bool comesAfter(const ImpactEvent<S>& a, const ImpactEvent<S>& b) {
  if (a.t != b.t) {
    return b.t < a.t;
  }
  return a.key1 != b.key1 ? b.key1 < a.key1 : b.key2 < a.key2;
}

template <Real S>
struct ImpactHistory {
  std::uint32_t impacts = 0;  ///< and other changes of its course
  std::uint64_t partner = 0;  ///< of the last impact that it paid for
  S spent = S(0);
  S after = S(0);     ///< charged since `mostPerBody` was spent
  S heaviest = S(0);  ///< [kg] of those that it met
  bool free = false;  ///< let go: nothing holds it any more
  bool ends = false;  ///< with a partner of a larger id, or a boundary, impacts of it came to an end
};

}  // namespace detail

}  // namespace gravel
