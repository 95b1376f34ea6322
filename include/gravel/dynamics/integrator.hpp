#pragma once

/// \file
/// Symplectic integrators as tables for one kick-drift-kick loop.
///
/// A method is a palindrome of stage weights w_1 … w_s with sum 1. Stage k is velocity Verlet over w_k h:
///   v += a w_k h/2;  x += v w_k h;  a = a(x);  v += a w_k h/2
/// and the kicks of neighbouring stages, which use the same a, are taken as one. So a step costs s force
/// evaluations, and ends with x, v and a at the same time. Every such method is symplectic and
/// time-reversible for a fixed step.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/parallel.hpp>

#include <array>
#include <span>

namespace gravel {

enum class IntegratorKind : std::uint8_t {
  VelocityVerlet,  ///< order 2, 1 force evaluation a step (Verlet 1967; Swope et al. 1982)
  Yoshida4,        ///< order 4, 3 evaluations (Yoshida 1990, Phys. Lett. A 150, 262; Forest & Ruth 1990)
  Yoshida6,        ///< order 6, 7 evaluations (Yoshida 1990, solution A; digits of Hairer, Lubich & Wanner)
};

/// What a method is; tests measure each figure.
struct IntegratorTraits {
  const char* name;
  int order;
  int forceEvaluations;  ///< per step
  std::span<const long double> weights;
};

namespace detail {
inline constexpr std::array<long double, 1> verletWeights{1.0L};
// w = 1/(2 - 2^(1/3)), 1 - 2w, w
inline constexpr std::array<long double, 3> yoshida4Weights{1.351207191959657634047687808971460827L,
                                                            -1.702414383919315268095375617942921653L,
                                                            1.351207191959657634047687808971460827L};
// Hairer, Lubich & Wanner, Geometric Numerical Integration, 2nd ed., eq. V.3.11
inline constexpr std::array<long double, 7> yoshida6Weights{
    0.78451361047755726381949763L, 0.23557321335935813368479318L,  -1.17767998417887100694641568L,
    1.31518632068391121888424973L, -1.17767998417887100694641568L, 0.23557321335935813368479318L,
    0.78451361047755726381949763L};
}  // namespace detail

constexpr IntegratorTraits traitsOf(IntegratorKind kind) {
  switch (kind) {
    case IntegratorKind::Yoshida4:
      return {"Yoshida4", 4, 3, detail::yoshida4Weights};
    case IntegratorKind::Yoshida6:
      return {"Yoshida6", 6, 7, detail::yoshida6Weights};
    case IntegratorKind::VelocityVerlet:
      break;
  }
  return {"VelocityVerlet", 2, 1, detail::verletWeights};
}

/// Turns q by the rotation vector w h: the exponential map, exact for a constant w. Normalised again.
template <Real Scalar>
Quaternion<Scalar> rotated(const Quaternion<Scalar>& q, const Vector3<Scalar>& w, const Scalar& h) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Scalar half = Scalar(1) / Scalar(2);
  const Vector3<Scalar> half_turn = w * (half * h);
  const Scalar angle_sq = half_turn.squaredNorm();
  const Scalar angle = sqrt(angle_sq);
  // sin(x)/x; below 1e-4 its series to x^4 is exact to 1e-26
  const Scalar sinc = angle > Scalar(1e-4)
                          ? Scalar(sin(angle) / angle)
                          : Scalar(1) - angle_sq / Scalar(6) * (Scalar(1) - angle_sq / Scalar(20));
  Quaternion<Scalar> turn;
  turn.w() = cos(angle);
  turn.vec() = half_turn * sinc;
  Quaternion<Scalar> next = turn * q;
  next.normalize();
  return next;
}

namespace detail {

constexpr std::size_t bodyGrain = 2048;

/// v += a kick; then x += v drift, and the orientation with it. One pass; fixed bodies stay.
/// `torques` tells whether any angular acceleration can differ from zero.
template <Real Scalar, class Layout>
void kickAndDrift(Bodies<Scalar, Layout>& bodies, const Scalar& kick, const Scalar& drift, bool torques) {
  parallelFor(bodies.size(), bodyGrain, [&](std::size_t i) {
    const auto body = bodies[i];
    if (body.isFixed()) {
      return;
    }
    auto&& v = body.velocity();
    auto&& w = body.angularVelocity();
    if (!(kick == Scalar(0))) {
      v += body.acceleration() * kick;
      if (torques) {
        w += body.angularAcceleration() * kick;
      }
    }
    if (!(drift == Scalar(0))) {
      body.position() += v * drift;
      const Vector3<Scalar> spin = w;
      if (!(spin.squaredNorm() == Scalar(0))) {
        body.orientation() = rotated(Quaternion<Scalar>(body.orientation()), spin, drift);
      }
    }
  });
}

}  // namespace detail

/// Nothing to do between the first kick and the first drift.
struct NoDeparture {
  explicit operator bool() const { return false; }
  template <class Scalar>
  void operator()(const Scalar&) const {}
};

/// Advances all bodies by one step h. Accelerations must be those of the present positions, and are at the
/// end. \param forces  called s times with the part of h that has passed [s]: accelerations at the present
/// positions \param arrival called once, when positions are final and the last forces are not yet evaluated
/// Cost: s force evaluations, s + 1 passes over the bodies. Bits do not depend on the number of threads.
template <Real Scalar, class Layout, class Forces, class Arrival, class Departure = NoDeparture>
void integrate(IntegratorKind kind, Bodies<Scalar, Layout>& bodies, const Scalar& h, bool torques,
               Forces&& forces, Arrival&& arrival, Departure&& departure = {}) {
  const std::span<const long double> weights = traitsOf(kind).weights;
  const Scalar half_h = h / Scalar(2);
  Scalar pending(0);
  Scalar passed(0);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const Scalar w = Scalar(weights[k]);
    const Scalar kick = pending + w * half_h;
    if (k == 0 && departure) {
      detail::kickAndDrift(bodies, kick, Scalar(0), torques);
      departure(kick);
      detail::kickAndDrift(bodies, Scalar(0), Scalar(w * h), torques);
    } else {
      detail::kickAndDrift(bodies, kick, Scalar(w * h), torques);
    }
    if (k + 1 == weights.size()) {
      arrival();
    }
    passed += w * h;
    forces(k + 1 == weights.size() ? h : passed);
    pending = w * half_h;
  }
  detail::kickAndDrift(bodies, pending, Scalar(0), torques);
}

}  // namespace gravel
