#pragma once

/// Systems of points that a gravity method has to be right for.

#include "oracle/gravity.hpp"

#include <array>
#include <string>

namespace gravel::test {

inline constexpr std::array<const char*, 6> gravityScenes{
    "Plummer sphere", "uniform sphere", "two clusters", "ring patch", "rubble pile", "nine decades of mass"};

/// n points of total mass about 1. The Plummer spheres (scale length 1; Aarseth, Henon & Wielen 1974, Astron.
/// Astrophys. 37, 183) hold 99.9 % and 99 % of the model's mass.
template <Real S>
PointMasses<S> gravityScene(const std::string& name, std::size_t n, std::uint64_t seed = 7) {
  const CounterRandom radial(seed);
  const CounterRandom angular(seed + 1);
  const CounterRandom other(seed + 2);
  PointMasses<S> points;
  for (std::size_t i = 0; i < n; ++i) {
    Vector3<double> x = angular.direction(i);
    double m = 1.0 / static_cast<double>(n);
    const double u = radial.uniform(i);
    const auto plummer = [](double share) { return 1 / std::sqrt(std::pow(share, -2.0 / 3) - 1); };
    if (name == "Plummer sphere") {
      x *= plummer(0.999 * u);
    } else if (name == "two clusters") {
      x *= plummer(0.99 * u);
      x[0] += i % 2 == 0 ? -50 : 50;
    } else if (name == "ring patch") {
      x = {10 * radial.uniform(3 * i), 10 * radial.uniform(3 * i + 1), 0.02 * angular.normal(i)};
    } else {
      x *= std::cbrt(u);
      if (name == "rubble pile") {  // flattened; masses as of a steep power law of radii
        x[2] *= 0.7;
        m *= std::pow(1 - 0.99 * other.uniform(i), -1.5);
      } else if (name == "nine decades of mass") {
        m = std::pow(10.0, -9 * other.uniform(i));
      }
    }
    points.positions.push_back(x.cast<S>());
    points.masses.push_back(S(m));
  }
  return points;
}

/// Total force over the sum of the forces' sizes.
template <class S>
double imbalance(const PointMasses<S>& points, const std::vector<Vector3<S>>& a) {
  Vector3<long double> total = Vector3<long double>::Zero();
  long double scale = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3<long double> f =
        static_cast<long double>(points.masses[i]) * a[i].template cast<long double>();
    total += f;
    scale += f.norm();
  }
  return static_cast<double>(total.norm() / scale);
}

}  // namespace gravel::test
