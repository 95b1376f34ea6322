#pragma once

/// \file
/// The next step from velocities and accelerations.
///
/// For a body with speed v and acceleration a, both relative to the centre of mass, so that neither a boost
/// nor a common fall changes anything (absolute where fixed bodies or planes make rest absolute), the time in
/// which its motion changes by its own size is
///   tau_i = sqrt(v^2 + a l_i) / a        the turning time v/a; sqrt(l/a) where a body starts from rest
/// with l_i = its radius, or the softening, or a hundredth of the mean spacing, whichever is largest. The
/// step is h = eta min(tau_i); and no sphere moves by more than a quarter of its radius in a step, so that
/// contacts are met before they are deep. In a sheared domain where nothing stands still velocities are those
/// against the flow, so that a wide patch of a disc takes the steps of a narrow one; spheres that touch meet
/// at (3/2) |Omega| (r_i + r_j) by the flow, so that of the largest r is added to their speeds. Where
/// something stands still in such a frame, a counts what that adds, which presses on it: by the forces alone
/// a ball that the tide holds on a floor took steps of half an orbit. The rule for bodies under forces whose
/// law is not known, or that something holds up; under mutual gravity see encounter_step.hpp.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/check.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/core/sizes.hpp>
#include <gravel/dynamics/epicycle.hpp>
#include <gravel/spatial/domain.hpp>

#include <algorithm>

namespace gravel {

template <Real Scalar>
struct StepLimits {
  Scalar factor = Scalar(0.02);     ///< eta [1]; 2 pi / eta steps per circular orbit
  Scalar smallest = Scalar(0);      ///< [s] the longest counts if this is more
  Scalar largest = Scalar(1);       ///< [s]
  Scalar contactSteps = Scalar(1);  ///< contact steps in one step: only these must be short against radii
};

/// \throws std::invalid_argument naming the limit, its value and what is allowed
template <Real Scalar>
void validate(const StepLimits<Scalar>& limits) {
  detail::require("factor of steps", limits.factor, detail::positive<Scalar>());
  detail::require("smallest step", limits.smallest, detail::nonNegative<Scalar>());
  detail::require("largest step", limits.largest, detail::positive<Scalar>());
  detail::require("contact steps in a step", limits.contactSteps, detail::positive<Scalar>());
}

namespace detail {

/// What steps leave out of speeds: the flow of a sheared domain, unless a body stands still.
template <Real Scalar>
struct FlowLeftOut {
  Domain<Scalar> domain;      ///< whose flow that is; open for none
  Scalar across = Scalar(0);  ///< [m s^-1] by which it lets the largest sphere meet others at most

  /// O(N) in a sheared domain, else O(1).
  template <class Layout>
  static FlowLeftOut of(const Bodies<Scalar, Layout>& bodies, const Domain<Scalar>& domain) {
    Scalar largest(0);
    for (std::size_t i = 0; i < bodies.size() && !(domain.omega() == Scalar(0)); ++i) {
      if (bodies[i].isFixed()) {
        return {};
      }
      largest = std::max<Scalar>(largest, bodies.radii()[i]);
    }
    return {domain, domain.shearRate() * largest};
  }
};

}  // namespace detail

/// [s] The step by the rules above over the movable bodies, within the limits. O(N).
/// \param softening [m]
/// \param anchored something outside the bodies stands still, such as a plane
/// \throws std::invalid_argument of validate()
template <Real Scalar, class Layout>
Scalar stepFromMotion(const Bodies<Scalar, Layout>& bodies, const Scalar& softening,
                      const StepLimits<Scalar>& limits, bool anchored = false,
                      const Domain<Scalar>& domain = {}) {
  using std::cbrt;
  using std::sqrt;
  validate(limits);
  const std::size_t n = bodies.size();
  if (n == 0) {
    return limits.largest;
  }
  using Sum = detail::AtLeastDouble<Scalar>;  // the momentum of a thousand suns is no float
  Sum mass(0);
  Vector3<Sum> v_sum = Vector3<Sum>::Zero();
  Vector3<Sum> a_sum = Vector3<Sum>::Zero();
  const HillFrame<Scalar> frame(domain);
  Vector3<Scalar> low = bodies[0].position();
  Vector3<Scalar> high = low;
  const auto flow = detail::FlowLeftOut<Scalar>::of(bodies, anchored ? Domain<Scalar>::open() : domain);
  for (std::size_t i = 0; i < n; ++i) {
    const auto body = bodies[i];
    const auto m = Sum(body.mass());
    mass += m;
    v_sum += flow.domain.lessFlow(body.position(), body.velocity()).template cast<Sum>() * m;
    a_sum += Vector3<Scalar>(body.acceleration()).template cast<Sum>() * m;
    low = low.cwiseMin(Vector3<Scalar>(body.position()));
    high = high.cwiseMax(Vector3<Scalar>(body.position()));
    anchored = anchored || body.isFixed();
  }
  const Sum share = anchored || !(mass > Sum(0)) ? Sum(0) : Sum(Sum(1) / mass);
  const Vector3<Scalar> v_cm = Vector3<Sum>(v_sum * share).template cast<Scalar>();
  const Vector3<Scalar> a_cm = Vector3<Sum>(a_sum * share).template cast<Scalar>();
  const Scalar spacing = detail::safeNorm(Vector3<Scalar>(high - low)) / Scalar(cbrt(static_cast<double>(n)));
  const Scalar floor = std::max<Scalar>(softening, spacing / Scalar(100));
  const Scalar longest = limits.largest / limits.factor;
  const Scalar least = orderedMin(n, 2048, longest, [&](std::size_t i) {
    const auto body = bodies[i];
    Scalar tau = longest;
    if (body.isFixed()) {
      return tau;
    }
    const Scalar r = body.radius();
    const Scalar l = std::max<Scalar>(r, floor);
    Vector3<Scalar> pull = body.acceleration() - a_cm;
    if (frame.turns() && anchored) {
      pull += frame.acceleration(body.position(), body.velocity());
    }
    const Scalar a = detail::safeNorm(pull);
    const Scalar v_sq =
        Vector3<Scalar>(flow.domain.lessFlow(body.position(), body.velocity()) - v_cm).squaredNorm();
    if (a > Scalar(0) && l > Scalar(0)) {
      tau = std::min<Scalar>(tau, sqrt(v_sq + a * l) / a);
    }
    const Scalar v = (v_sq > Scalar(0) ? Scalar(sqrt(v_sq)) : Scalar(0)) + flow.across;
    if (r > Scalar(0) && v > Scalar(0)) {
      tau = std::min<Scalar>(tau, limits.contactSteps * r / (Scalar(4) * limits.factor * v));
    }
    return tau;
  });
  return std::min<Scalar>(std::max<Scalar>(limits.factor * least, limits.smallest), limits.largest);
}

}  // namespace gravel
