#pragma once

/// Gravity as slow and as plain as it can be: one ordered pair after another in long double, by the textbook
/// formula. Shares no code with the sums under test.

#include <gravel/core/random.hpp>
#include <gravel/core/types.hpp>

#include <cmath>
#include <vector>

namespace gravel::test {

struct GravityOracle {
  std::vector<Vector3<long double>> accelerations;
  std::vector<long double> sumOfTerms;  ///< of |G m_j d / r^3|: what rounding errors are measured against
  long double potential = 0;
  long double sumOfEnergies = 0;  ///< of |G m_i m_j / r|
};

template <Real S>
GravityOracle bruteGravity(const std::vector<Vector3<S>>& positions, const std::vector<S>& masses, S G,
                           S softening) {
  const std::size_t n = positions.size();
  GravityOracle oracle;
  oracle.accelerations.assign(n, Vector3<long double>::Zero());
  oracle.sumOfTerms.assign(n, 0.0L);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const Vector3<long double> d =
          positions[j].template cast<long double>() - positions[i].template cast<long double>();
      const long double r = std::hypot(d.norm(), static_cast<long double>(softening));
      if (i == j || r == 0) {
        continue;
      }
      const Vector3<long double> term =
          static_cast<long double>(G) * static_cast<long double>(masses[j]) / r / r / r * d;
      oracle.accelerations[i] += term;
      oracle.sumOfTerms[i] += term.norm();
      if (j < i) {
        const long double energy = static_cast<long double>(G) * static_cast<long double>(masses[j]) *
                                   static_cast<long double>(masses[i]) / r;
        oracle.potential -= energy;
        oracle.sumOfEnergies += energy;
      }
    }
  }
  return oracle;
}

template <Real S>
struct PointMasses {
  std::vector<Vector3<S>> positions;
  std::vector<S> masses;

  std::size_t size() const { return positions.size(); }
};

/// Points in a cube of edge `edge`, masses `mass` times 10^-u with u uniform in [0, decades).
template <Real S>
PointMasses<S> randomMasses(std::size_t n, std::uint64_t seed, double edge = 1.0, double mass = 1.0,
                            double decades = 1.0) {
  const CounterRandom random(seed);
  PointMasses<S> points;
  for (std::size_t i = 0; i < n; ++i) {
    Vector3<S> x;
    for (int axis = 0; axis < 3; ++axis) {
      x[axis] = S(random.uniform(4 * i + static_cast<std::size_t>(axis), -edge / 2, edge / 2));
    }
    points.positions.push_back(x);
    points.masses.push_back(S(mass * std::pow(10.0, -random.uniform(4 * i + 3, 0.0, decades))));
  }
  return points;
}

}  // namespace gravel::test
