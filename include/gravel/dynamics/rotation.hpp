#pragma once

/// \file
/// Orientation: unit quaternions turned by the exponential map.

#include <gravel/core/sizes.hpp>

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
    Scalar angle = sqrt(angle_sq);
    if constexpr (std::is_floating_point_v<Scalar>) {
      if (!isFinite(angle)) {  // the square alone, unless w h is not finite either
        const Scalar largest = half_turn.cwiseAbs().maxCoeff();
        angle = largest * sqrt(Vector3<Scalar>(half_turn / largest).squaredNorm());
        if (!isFinite(angle)) {
          return q;
        }
      }
    }
    turn.w() = cos(angle);
    turn.vec() = half_turn * Scalar(sin(angle) / angle);
  } else {  // series to x^4, exact to 1e-26
    turn.w() = Scalar(1) - angle_sq / Scalar(2) * (Scalar(1) - angle_sq / Scalar(12));
    turn.vec() = half_turn * Scalar(Scalar(1) - angle_sq / Scalar(6) * (Scalar(1) - angle_sq / Scalar(20)));
  }
  // turn * q, coefficient by coefficient: Eigen's product goes through memory.
  const Scalar w1 = turn.w(), x1 = turn.x(), y1 = turn.y(), z1 = turn.z();
  const Scalar w2 = q.w(), x2 = q.x(), y2 = q.y(), z2 = q.z();
  const Scalar w3 = w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2;
  const Scalar x3 = w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2;
  const Scalar y3 = w1 * y2 + y1 * w2 + z1 * x2 - x1 * z2;
  const Scalar z3 = w1 * z2 + z1 * w2 + x1 * y2 - y1 * x2;
  const Scalar excess = (w3 * w3 + x3 * x3 + y3 * y3 + z3 * z3) - Scalar(1);
  // 1/sqrt(1 + x) = 1 - x/2 + 3/8 x^2 ...
  const Scalar scale = excess * excess < detail::roundoff<Scalar>()
                           ? Scalar(1) - excess / Scalar(2)
                           : Scalar(Scalar(1) / Scalar(sqrt(Scalar(1) + excess)));
  return Quaternion<Scalar>(scale * w3, scale * x3, scale * y3, scale * z3);
}

}  // namespace gravel
