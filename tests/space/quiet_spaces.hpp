#pragma once

/// Spaces in which nothing happens but what the test is about.

#include <gravel/space/space.hpp>

namespace gravel::test {

using Vec = Vector3<double>;

/// Fixed steps, no gravity.
inline SimulationConfig<double> quiet(double dt) {
  SimulationConfig<double> config;
  config.G = 0.0;
  config.timeStep = dt;
  config.adaptiveTimeStep = false;
  return config;
}

inline Body<double> at(const Vec& x, const Vec& v, double radius = 0.5) {
  Body<double> body;
  body.position = x;
  body.velocity = v;
  body.radius = radius;
  return body;
}

}  // namespace gravel::test
