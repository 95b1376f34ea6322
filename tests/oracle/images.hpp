#pragma once

/// Gravity of a lattice of images as text books have it, in long double: Ewald's sums for a box repeated
/// along all axes, Fourier's series for a lattice in a plane. Shares no code with the sums under test.

#include "oracle/gravity.hpp"

#include <array>

namespace gravel::test {

using Wide = Vector3<long double>;

/// What a unit mass at the origin and its images do at r (G = 1).
struct LatticeForce {
  Wide acceleration = Wide::Zero();
  long double potential = 0;  ///< sum of 1/|r - s|: positive
};

inline constexpr long double circleConstant = 3.141592653589793238462643383279502884L;

/// Ewald 1921. For r = 0 without the mass itself: what its images do there. \param split where the two sums
/// part, in units of the mean edge: the result does not depend on it
inline LatticeForce ewald(const Wide& r, const Wide& box, long double split = 2.3L) {
  const long double a = split / ((box[0] + box[1] + box[2]) / 3);
  const long double volume = box[0] * box[1] * box[2];
  const long double rootPi = std::sqrt(circleConstant);
  LatticeForce force;
  force.potential = -circleConstant / (a * a * volume);
  const auto reach = [](long double length) { return static_cast<int>(std::ceil(length)); };
  std::array<int, 3> n{}, k{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const long double edge = box[static_cast<Eigen::Index>(axis)];
    n[axis] = reach(6.6L / (a * edge) + 1);
    k[axis] = reach(6.6L * a * edge / circleConstant);
  }
  for (int i = -n[0]; i <= n[0]; ++i) {
    for (int j = -n[1]; j <= n[1]; ++j) {
      for (int l = -n[2]; l <= n[2]; ++l) {
        const Wide d = r + Wide(i * box[0], j * box[1], l * box[2]);
        const long double x = d.norm();
        if (x == 0) {
          force.potential -= 2 * a / rootPi;
        } else if (a * x < 6.6L) {
          const long double part = std::erfc(a * x);
          force.potential += part / x;
          force.acceleration -= d / (x * x * x) * (part + 2 * a * x / rootPi * std::exp(-a * a * x * x));
        }
      }
    }
  }
  for (int i = -k[0]; i <= k[0]; ++i) {
    for (int j = -k[1]; j <= k[1]; ++j) {
      for (int l = -k[2]; l <= k[2]; ++l) {
        const Wide q = 2 * circleConstant * Wide(i / box[0], j / box[1], l / box[2]);
        const long double power = q.squaredNorm() / (4 * a * a);
        if (power > 0 && power < 44) {
          const long double part = 4 * circleConstant / volume / q.squaredNorm() * std::exp(-power);
          force.potential += part * std::cos(q.dot(r));
          force.acceleration -= part * std::sin(q.dot(r)) * q;
        }
      }
    }
  }
  return force;
}

/// A lattice of vectors a, b in the plane z = 0, seen from |z| > 0: each wave of it decays with |z|. The
/// potential is that of points within R less 2 pi R over the area of a cell.
inline LatticeForce planeWaves(const Wide& r, const Wide& a, const Wide& b) {
  const long double area = std::abs(a[0] * b[1] - a[1] * b[0]);
  const long double z = std::abs(r[2]);
  const long double side = r[2] < 0 ? -1 : 1;
  LatticeForce force;
  force.potential = -2 * circleConstant * z / area;
  force.acceleration[2] = -2 * circleConstant * side / area;
  const auto most = static_cast<int>(std::ceil(44 / (2 * circleConstant * z) * std::max(a.norm(), b.norm())));
  for (int i = -most; i <= most; ++i) {
    for (int j = -most; j <= most; ++j) {
      const Wide q = 2 * circleConstant / area * Wide(i * b[1] - j * a[1], j * a[0] - i * b[0], 0);
      const long double length = q.norm();
      if (length > 0 && length * z < 44) {
        const long double part = 2 * circleConstant / (area * length) * std::exp(-length * z);
        force.potential += part * std::cos(q.dot(r));
        force.acceleration -= part * std::sin(q.dot(r)) * q;
        force.acceleration[2] -= part * length * side * std::cos(q.dot(r));
      }
    }
  }
  return force;
}

/// Sums a law of lattices over all ordered pairs. \param law LatticeForce(distance vector)
template <class S, class Law>
GravityOracle latticeGravity(const PointMasses<S>& points, Law&& law) {
  GravityOracle oracle;
  const std::size_t n = points.size();
  oracle.accelerations.assign(n, Wide::Zero());
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const auto mass = static_cast<long double>(points.masses[j]);
      const LatticeForce force = law(Wide(points.positions[i].template cast<long double>() -
                                          points.positions[j].template cast<long double>()));
      oracle.accelerations[i] += i == j ? Wide(Wide::Zero()) : Wide(mass * force.acceleration);
      oracle.potential -= mass * static_cast<long double>(points.masses[i]) * force.potential / 2;
    }
  }
  return oracle;
}

}  // namespace gravel::test
