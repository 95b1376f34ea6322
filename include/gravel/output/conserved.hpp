#pragma once

/// \file
/// The sums that an isolated system keeps: mass, momentum, angular momentum, centre of mass.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/parallel.hpp>

namespace gravel {

template <Real Scalar>
struct ConservedQuantities {
  Scalar mass = Scalar(0);                             ///< [kg]
  Vector3<Scalar> momentum = Vector3<Scalar>::Zero();  ///< [kg m s^-1]
  Vector3<Scalar> angularMomentum =
      Vector3<Scalar>::Zero();                             ///< [kg m^2 s^-1] orbit and spin, about the origin
  Vector3<Scalar> centreOfMass = Vector3<Scalar>::Zero();  ///< [m]; the origin if there is no mass
};

/// O(N); the same bits for any number of threads.
template <Real Scalar, class Layout>
ConservedQuantities<Scalar> conservedQuantities(const Bodies<Scalar, Layout>& bodies) {
  using Wide = detail::AtLeastDouble<Scalar>;  // the mass of a planet times its place is no float
  using Sum = Eigen::Array<Wide, 10, 1>;
  const Sum sum = orderedSum(bodies.size(), 1024, Sum(Sum::Zero()), [&](std::size_t begin, std::size_t end) {
    Sum part = Sum::Zero();
    for (std::size_t i = begin; i < end; ++i) {
      const auto body = bodies[i];
      const auto m = Wide(body.mass());
      const Vector3<Wide> x = Vector3<Scalar>(body.position()).template cast<Wide>();
      const Vector3<Wide> p = body.countingVelocity().template cast<Wide>() * m;
      part[0] += m;
      part.template segment<3>(1) += p.array();
      part.template segment<3>(4) +=
          Vector3<Wide>(x.cross(p) + body.spinMomentum().template cast<Wide>()).array();
      part.template segment<3>(7) += (x * m).array();
    }
    return part;
  });
  const Vector3<Wide> momentum = sum.template segment<3>(1).matrix();
  const Vector3<Wide> angular = sum.template segment<3>(4).matrix();
  ConservedQuantities<Scalar> result;
  result.mass = Scalar(sum[0]);
  result.momentum = momentum.template cast<Scalar>();
  result.angularMomentum = angular.template cast<Scalar>();
  if (sum[0] > Wide(0)) {
    const Vector3<Wide> centre = sum.template segment<3>(7).matrix() / sum[0];
    result.centreOfMass = centre.template cast<Scalar>();
  }
  return result;
}

}  // namespace gravel
