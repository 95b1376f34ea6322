#pragma once

/// \file
/// Orientation: unit quaternions turned by the exponential map.

#include <gravel/core/types.hpp>

namespace gravel {

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

}  // namespace gravel
