#pragma once

#include <gravel/space/space.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace gravel::test {

/// sum m (v_y + 2 Omega x) of a patch in Hill's frame, the momentum that goes with the guiding centres.
inline double momentumAlong(const Space<double>& space) {
  double sum = 0.0;
  for (std::size_t i = 0; i < space.n(); ++i) {
    const auto body = space.body(i);
    sum += body.mass() * (body.velocity()[1] + 2 * space.domain().omega() * body.position()[0]);
  }
  return sum;
}

struct PatchMomentum {
  double error;           ///< of the momentum, from what it was and what edges added
  std::size_t crossings;  ///< of an edge in x
};

/// Makes the steps. Where a body crosses an edge, x + k Lx and v_y - (3/2) Omega k Lx, it gains
/// Omega k Lx/2 a unit of mass.
inline PatchMomentum followMomentum(Space<double>& space, std::size_t steps) {
  const double width = space.domain().lengths()[0];
  PatchMomentum followed{-momentumAlong(space), 0};
  std::vector<double> x(space.n());
  for (std::size_t step = 0; step < steps; ++step) {
    for (std::size_t i = 0; i < space.n(); ++i) {
      x[i] = space.body(i).position()[0];
    }
    space.computeDynamics(step);
    for (std::size_t i = 0; i < space.n(); ++i) {
      const double jump = std::round((space.body(i).position()[0] - x[i]) / width);
      followed.error -= space.body(i).mass() * jump * space.domain().omega() * width / 2;
      followed.crossings += jump == 0 ? 0U : 1U;
    }
  }
  followed.error += momentumAlong(space);
  return followed;
}

/// Largest difference of a place or a velocity between the same bodies of two runs, through nearest images.
inline double largestDifference(const Space<double>& one, const Space<double>& two) {
  double worst = 0.0;
  for (std::size_t i = 0; i < one.n(); ++i) {
    Vector3<double> r = one.body(i).position() - two.body(i).position();
    Vector3<double> v = one.body(i).velocity() - two.body(i).velocity();
    one.domain().minimumImage(r, v, one.time());
    worst = std::max({worst, r.norm(), v.norm()});
  }
  return worst;
}

}  // namespace gravel::test
