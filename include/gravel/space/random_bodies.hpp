#pragma once

/// \file
/// The random bodies that `SimulationConfig::bodyCount` asks for.

#include <gravel/bodies/body.hpp>
#include <gravel/core/random.hpp>

#include <algorithm>
#include <vector>

namespace gravel {

/// n spheres that do not overlap, of radii 0.5 m to 1 m and the given density [kg m^-3], spread over a ball
/// about the origin; velocities up to `speed` [m s^-1] and spins up to 0.1 rad s^-1 along each axis. They sit
/// on a cubic lattice of 2.2 m, each off by up to 0.1 m along each axis, so that no two can touch. Of the
/// ball, which reaches 1.37 m cbrt(n) for many, they fill 0.18; with its ragged rim a tenth for n = 100, 0.15
/// for 1000. Equal arguments give equal bodies on every machine, up to last bits (see core/random.hpp).
template <Real Scalar>
std::vector<Body<Scalar>> randomBodies(std::size_t n, const Scalar& density, const Scalar& speed,
                                       std::uint64_t seed) {
  constexpr double largest = 1.0;
  constexpr double spacing = 2.2 * largest;  // leaves +-0.1 m to jitter
  const auto side = static_cast<std::int64_t>(std::ceil(std::cbrt(static_cast<double>(n) * 2.0))) + 2;
  struct Site {
    double distance_sq;
    Vector3<double> position;
  };
  std::vector<Site> sites;
  for (std::int64_t x = -side / 2; x <= side / 2; ++x) {
    for (std::int64_t y = -side / 2; y <= side / 2; ++y) {
      for (std::int64_t z = -side / 2; z <= side / 2; ++z) {
        const Vector3<double> p = spacing * Vector3<double>(double(x), double(y), double(z));
        sites.push_back({p.squaredNorm(), p});
      }
    }
  }
  std::stable_sort(sites.begin(), sites.end(),
                   [](const Site& a, const Site& b) { return a.distance_sq < b.distance_sq; });
  std::vector<Body<Scalar>> bodies(n);
  for (std::size_t i = 0; i < n; ++i) {
    const CounterRandom random(seed, i);
    const auto vector = [&](std::uint64_t first, double scale) {
      return Vector3<double>(random.uniform(first, -scale, scale), random.uniform(first + 1, -scale, scale),
                             random.uniform(first + 2, -scale, scale));
    };
    Body<Scalar>& body = bodies[i];
    const double radius = random.uniform(0, 0.5, largest);
    body.radius = Scalar(radius);
    body.mass = Scalar(4.0 / 3.0) * pi<Scalar>() * density * Scalar(radius * radius * radius);
    body.position = (sites[i].position + vector(1, 0.1 * largest)).template cast<Scalar>();
    body.velocity = vector(4, 1.0).template cast<Scalar>() * speed;
    body.angularVelocity = vector(7, 0.1).template cast<Scalar>();
    const Vector3<double> axis = random.direction(10);
    const double half_angle = random.uniform(12, 0.0, pi<double>());
    const Vector3<double> part = axis * std::sin(half_angle);
    body.orientation = Quaternion<Scalar>(Scalar(std::cos(half_angle)), Scalar(part.x()), Scalar(part.y()),
                                          Scalar(part.z()));
    body.orientation.normalize();
  }
  return bodies;
}

}  // namespace gravel
