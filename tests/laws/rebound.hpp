#pragma once

#include "laws/laws.hpp"

/// Two equal spheres of mass 1 and radius 1/2 that fall on each other from rest under G = 1, and bounce with
/// e = 1/2: mu = 2, so that v^2 = 4 (1/r - 1/r0), and half the period of a radial orbit of height r is
/// pi sqrt(r^3/16).

namespace gravel::test {

/// The largest distance after the first impact.
inline double reboundHeight(double start) { return 1 / (1 - 0.25 * (1 - 1 / start)); }

/// The time of the second impact.
inline double reboundTime(double start) {
  const auto fall = [](double from) {
    const double x = 1 / from;
    return std::sqrt(from * from * from / 4) * (std::acos(std::sqrt(x)) + std::sqrt(x * (1 - x)));
  };
  return fall(start) + 2 * fall(reboundHeight(start));
}

inline Space<double> rebounding(SimulationConfig<double> config, double start) {
  config.G = 1;
  config.coeffRestitution = 0.5;
  Space<double> space(config);
  space.addBody(ball({-start / 2, 0, 0}, {0, 0, 0}, 0.5));
  space.addBody(ball({start / 2, 0, 0}, {0, 0, 0}, 0.5));
  return space;
}

/// Relative error of the time of the second impact, the mean of 16 heights; 1 where it is missed.
inline double meanReboundError(const SimulationConfig<double>& config) {
  double sum = 0;
  for (int k = 0; k < 16; ++k) {
    const double start = 2.0 + 0.0074 * k;
    const double second = reboundTime(start);
    Space<double> space = rebounding(config, start);
    int hits = 0;
    double error = 1;
    for (std::size_t i = 0; hits < 2 && space.time() < 2 * second; ++i) {
      space.computeDynamics(i);
      for (const Impact<double>& impact : space.impacts()) {
        if (++hits == 2) {
          error = std::abs(space.time() - space.getPreviousTimeStep() + impact.time - second) / second;
        }
      }
    }
    sum += error / 16;
  }
  return sum;
}

}  // namespace gravel::test
