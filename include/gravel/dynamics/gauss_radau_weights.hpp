#pragma once

/// \file
/// The numbers of the Gauss-Radau method in a scalar's precision, and sums that lose nothing.

#include <gravel/dynamics/gauss_radau_tables.hpp>
#include <gravel/dynamics/integrator_tables.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace gravel::detail {

/// a b and what its rounding lost.
template <Real Scalar>
std::pair<Scalar, Scalar> twoProduct(const Scalar& a, const Scalar& b) {
  const Scalar p = a * b;
  if constexpr (std::is_floating_point_v<Scalar>) {
    return {p, std::fma(a, b, -p)};
  } else {
    return {p, Scalar(0)};
  }
}

/// (sum + low) += term + termLow. For terms that are not small against their sum: the term is added before
/// anything that would round it (Knuth's two-sum).
template <Real Scalar>
void addWide(Scalar& sum, Scalar& low, const Scalar& term, const Scalar& termLow) {
  const Scalar whole = sum + term;
  const Scalar part = whole - sum;
  const Scalar lost = (sum - (whole - part)) + (term - part);
  const Scalar rest = low + (termLow + lost);
  sum = whole + rest;
  low = rest - (sum - whole);
}

/// RadauTables as scalars. Of the weights of the whole step also what they lose to rounding: a constant error
/// of a weight would act in every step alike, and make the energy drift.
template <Real Scalar>
struct RadauWeights {
  static constexpr std::size_t nodes = RadauTables::nodes;
  using Row = std::array<Scalar, nodes>;

  std::array<Row, nodes + 1> position, velocity;
  Row positionLow, velocityLow;
  Row jerk, snap, crackle;
  std::array<Row, nodes> power;        ///< [n][j]: node n to the power j + 1
  std::array<Row, nodes> coefficient;  ///< [j][m]: of F_m in the coefficient of s^(j+1)

  RadauWeights() {
    const RadauTables& t = radauTables;
    jerk = high(t.jerk);
    snap = high(t.snap);
    crackle = high(t.crackle);
    for (std::size_t n = 0; n <= nodes; ++n) {
      position[n] = high(t.position[n]);
      velocity[n] = high(t.velocity[n]);
    }
    positionLow = low(t.position[nodes]);
    velocityLow = low(t.velocity[nodes]);
    for (std::size_t n = 0; n < nodes; ++n) {
      coefficient[n] = high(t.power[n]);
      const Scalar s = Scalar(std::remove_cvref_t<decltype(t)>::node[n]);
      Scalar p = s;
      for (std::size_t j = 0; j < nodes; ++j, p *= s) {
        power[n][j] = p;
      }
    }
  }

 private:
  static Row high(const RadauTables::Row& row) {
    Row w;
    std::transform(row.begin(), row.end(), w.begin(), fromTable<Scalar>);
    return w;
  }
  static Row low(const RadauTables::Row& row) {
    Row w;
    std::transform(row.begin(), row.end(), w.begin(), [](long double x) {
      if constexpr (std::is_floating_point_v<Scalar>) {
        return static_cast<Scalar>(x - static_cast<long double>(static_cast<Scalar>(x)));
      } else {
        return Scalar(0);
      }
    });
    return w;
  }
};

/// sum_m F_m w_m over seven columns, as an expression that Eigen evaluates in packets.
template <class Columns, class Row>
auto dot(const Columns& F, const Row& w) {
  return ((F[0] * w[0] + F[1] * w[1]) + (F[2] * w[2] + F[3] * w[3])) +
         ((F[4] * w[4] + F[5] * w[5]) + F[6] * w[6]);
}

}  // namespace gravel::detail
