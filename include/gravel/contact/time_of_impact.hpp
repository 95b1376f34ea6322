#pragma once

/// \file
/// When, inside a step, two spheres or a sphere and a plane come to touch.

#include <gravel/contact/impulses.hpp>
#include <gravel/contact/resting_gap.hpp>
#include <gravel/core/sizes.hpp>

#include <algorithm>
#include <optional>

namespace gravel {

/// Relative motion through a step of length h that kicks half, drifts and kicks half (velocity Verlet): with
/// the velocity v of the drift and the acceleration a of its start,
///   r(t) = r + v t - a t (h - t)/2,    v(t) = v + a (t - h/2),
/// which is the parabola of a constant acceleration and ends where the drift ends.
template <Real Scalar>
struct RelativeFlight {
  Vector3<Scalar> r;       ///< [m] at the start
  Vector3<Scalar> v;       ///< [m s^-1] of the drift
  Vector3<Scalar> a;       ///< [m s^-2]
  Scalar h;                ///< [s]
  Scalar far = Scalar(0);  ///< [m] largest coordinate of the two, by which r is rounded

  Vector3<Scalar> place(const Scalar& t) const { return r + v * t - a * (t * (h - t) / Scalar(2)); }
  Vector3<Scalar> velocity(const Scalar& t) const { return v + a * (t - h / Scalar(2)); }
};

namespace detail {

/// The time after which a gap that shrinks at speed u, and no faster than with the acceleration `pull`, may
/// be closed; a negative number if never.
template <Real Scalar>
Scalar timeToClose(const Scalar& gap, const Scalar& u, const Scalar& pull) {
  using std::sqrt;
  const Scalar discriminant = u * u + Scalar(2) * pull * gap;
  if (discriminant < Scalar(0)) {
    return Scalar(-1);
  }
  const Scalar root = sqrt(discriminant);
  if (u < Scalar(0)) {  // it opens first: the later root, if it is pulled back
    return pull > Scalar(0) ? Scalar((root - u) / pull) : Scalar(-1);
  }
  return u + root > Scalar(0) ? Scalar(Scalar(2) * gap / (u + root)) : Scalar(-1);
}

}  // namespace detail

/// The first time in [from, h] at which a gap is closed and not opening; nothing if there is none.
/// `at(t, gap, u, pull)` gives the gap [m] at t, the speed u [m s^-1] at which it shrinks, and an upper bound
/// of du/dt [m s^-2] for the rest of the step. Each stride ends where the gap could be closed at the
/// earliest, so that no touch is missed; strides shrink quadratically. \param rounding [m] of gaps: closed
/// means no more than that, or than twice that at `from`
template <Real Scalar, class At>
std::optional<Scalar> firstTouch(const Scalar& from, const Scalar& h, const Scalar& rounding, At&& at) {
  constexpr int mostStrides = 64;  // a graze converges linearly, one bit a stride
  Scalar t = from;
  for (int stride = 0; stride < mostStrides; ++stride) {
    Scalar gap(0);
    Scalar u(0);
    Scalar pull(0);
    at(t, gap, u, pull);
    if (gap <= (stride == 0 ? Scalar(2) * rounding : rounding)) {  // so what was just closed is not open
      if (u > Scalar(0) || (u == Scalar(0) && pull > Scalar(0))) {
        return t;
      }
      gap = Scalar(0);
    }
    const Scalar wait = detail::timeToClose(gap, u, pull);
    if (!(wait >= Scalar(0)) || !(t + wait <= h)) {
      return std::nullopt;
    }
    if (!(t + wait > t)) {
      return t;  // nearer than time can be told
    }
    t += wait;
  }
  return std::nullopt;  // grazes within rounding
}

namespace detail {

/// Of gaps [m]. Blows of one moment move bodies by t J/m each, which rounds their places: those that touch
/// now must be seen to, wherever they are. But what counts as apart (restingMargin()) never counts as closed.
/// \param reach [m] sum of the radii  \param size [m] of what the gap is computed from
template <Real Scalar>
Scalar gapRounding(const RelativeFlight<Scalar>& flight, const Scalar& reach, const Scalar& size) {
  const Scalar ulps = Scalar(8) * roundoff<Scalar>();
  return ulps * size +
         std::min<Scalar>(ulps * flight.far / Scalar(2), restingMargin<Scalar>() * reach / Scalar(8));
}

}  // namespace detail

/// The first time in [from, h] at which two spheres touch and approach, |r(t)| <= reach.
/// Since d2|r|/dt2 = a.r/|r| + v_t^2/|r| >= -|a|, a stride is never too long.
template <Real Scalar>
std::optional<Scalar> timeOfImpact(const RelativeFlight<Scalar>& flight, const Scalar& reach,
                                   const Scalar& from) {
  const Scalar pull = detail::safeNorm(flight.a);
  const Scalar rounding = detail::gapRounding<Scalar>(
      flight, reach, Scalar(reach + detail::maxAbs(Vector3<Scalar>(flight.v * flight.h))));
  return firstTouch<Scalar>(
      from, flight.h, rounding, [&](const Scalar& t, Scalar& gap, Scalar& u, Scalar& bound) {
        const Vector3<Scalar> r = flight.place(t);
        const Scalar distance = detail::safeNorm(r);
        gap = distance - reach;
        u = distance > Scalar(0) ? Scalar(-r.dot(flight.velocity(t)) / distance) : Scalar(0);
        bound = pull;
      });
}

/// The first time in [from, h] at which a sphere touches a plane and approaches: n.r(t) <= reach for the
/// separation r of the sphere's centre from a point of the plane.
template <Real Scalar>
std::optional<Scalar> timeOfImpact(const RelativeFlight<Scalar>& flight, const Vector3<Scalar>& normal,
                                   const Scalar& reach, const Scalar& from) {
  const Scalar r_n = normal.dot(flight.r);
  const Scalar v_n = normal.dot(flight.v);
  const Scalar a_n = normal.dot(flight.a);
  const Scalar& h = flight.h;
  const Scalar rounding = detail::gapRounding<Scalar>(flight, reach, Scalar(reach + detail::sizeOf(r_n)));
  return firstTouch<Scalar>(from, h, rounding, [&](const Scalar& t, Scalar& gap, Scalar& u, Scalar& bound) {
    gap = r_n - reach + v_n * t - a_n * (t * (h - t) / Scalar(2));
    u = -(v_n + a_n * (t - h / Scalar(2)));
    bound = -a_n;
  });
}

}  // namespace gravel
