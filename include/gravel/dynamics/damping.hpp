#pragma once

/// \file
/// Drag in proportion to velocity, dv/dt = -c v and dw/dt = -c_w w, solved exactly: v(t+h) = v(t) exp(-c h).
/// No step is too long for it, and two half steps equal one step. In a domain that shears v is that less the
/// flow, -(3/2) Omega x along y: any other damping would tell an image from its body.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/check.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/spatial/domain.hpp>

namespace gravel {

/// Damps all bodies over a time h [s] at rates c, c_w [s^-1]. \return the energy taken out [J]
/// \throws std::invalid_argument unless all three are finite, >= 0
template <Real Scalar, class Layout>
Scalar damp(Bodies<Scalar, Layout>& bodies, const Scalar& c, const Scalar& c_w, const Scalar& h,
            const Domain<Scalar>& domain = {}) {
  using std::exp;
  for (const Scalar& value : {c, c_w, h}) {
    detail::require("rate or time of damping", value, detail::nonNegative<Scalar>());
  }
  const Scalar f = exp(-c * h);
  const Scalar f_w = exp(-c_w * h);
  const Scalar half = Scalar(1) / Scalar(2);
  return orderedSum(bodies.size(), 1024, Scalar(0), [&](std::size_t begin, std::size_t end) {
    Scalar lost(0);
    for (std::size_t i = begin; i < end; ++i) {
      const auto body = bodies[i];
      if (body.isFixed()) {
        continue;
      }
      // Values, of which Eigen adds the squares in one order wherever they stand.
      const Scalar v_sq = Vector3<Scalar>(body.velocity()).squaredNorm();
      const Scalar turning = body.rotationalEnergy();
      if (!(f == Scalar(1))) {
        const Vector3<Scalar> v = body.velocity();
        const Vector3<Scalar> u = domain.lessFlow(body.position(), v);
        body.velocity() = Vector3<Scalar>(v - u) + f * u;
      }
      body.angularVelocity() *= f_w;
      lost += half * Scalar(body.mass()) * (v_sq - Vector3<Scalar>(body.velocity()).squaredNorm()) +
              (turning - body.rotationalEnergy());
    }
    return lost;
  });
}

}  // namespace gravel
