#pragma once

/// \file
/// The sums that an isolated system keeps: mass, momentum, angular momentum, centre of mass.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/parallel.hpp>

namespace gravel {

template <Real Scalar>
struct ConservedQuantities {
  Scalar mass = Scalar(0);                                    ///< [kg]
  Vector3<Scalar> momentum = Vector3<Scalar>::Zero();         ///< [kg m s^-1]
  Vector3<Scalar> angularMomentum = Vector3<Scalar>::Zero();  ///< orbit and spin, about the origin
  Vector3<Scalar> centreOfMass = Vector3<Scalar>::Zero();     ///< [m]; the origin if there is no mass
};

/// O(N); the same bits for any number of threads.
template <Real Scalar, class Layout>
ConservedQuantities<Scalar> conservedQuantities(const Bodies<Scalar, Layout>& bodies) {
  using Sum = Eigen::Array<Scalar, 10, 1>;
  const Sum sum = orderedSum(bodies.size(), 1024, Sum(Sum::Zero()), [&](std::size_t begin, std::size_t end) {
    Sum part = Sum::Zero();
    for (std::size_t i = begin; i < end; ++i) {
      const auto body = bodies[i];
      const Scalar m = body.mass();
      const Vector3<Scalar> x = body.position();
      const Vector3<Scalar> p = body.countingVelocity() * m;
      part[0] += m;
      part.template segment<3>(1) += p.array();
      part.template segment<3>(4) += Vector3<Scalar>(x.cross(p) + body.spinMomentum()).array();
      part.template segment<3>(7) += (x * m).array();
    }
    return part;
  });
  ConservedQuantities<Scalar> result;
  result.mass = sum[0];
  result.momentum = sum.template segment<3>(1).matrix();
  result.angularMomentum = sum.template segment<3>(4).matrix();
  if (sum[0] > Scalar(0)) {
    result.centreOfMass = sum.template segment<3>(7).matrix() / sum[0];
  }
  return result;
}

}  // namespace gravel
