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
  Quaternion<Scalar> turn;
  if (angle_sq > Scalar(1e-8)) {
    const Scalar angle = sqrt(angle_sq);
    turn.w() = cos(angle);
    turn.vec() = half_turn * Scalar(sin(angle) / angle);
  } else {  // series to x^4, exact to 1e-26
    turn.w() = Scalar(1) - angle_sq / Scalar(2) * (Scalar(1) - angle_sq / Scalar(12));
    turn.vec() = half_turn * Scalar(Scalar(1) - angle_sq / Scalar(6) * (Scalar(1) - angle_sq / Scalar(20)));
  }
  Quaternion<Scalar> next = turn * q;
  next.normalize();
  return next;
}

}  // namespace gravel
