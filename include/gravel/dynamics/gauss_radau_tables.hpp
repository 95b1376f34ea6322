#pragma once

/// \file
/// Numbers of the 15th-order Gauss-Radau method.
///
/// On [0, 1] the change of the acceleration since the start, F(s) = a(s) - a(0), is the polynomial of degree
/// 7 that is 0 at s = 0 and F_m at the seven inner Radau nodes h_m. Written with Lagrange's basis l_m, its
/// integrals up to a node are sums over F_m with the weights tabled here.
///
/// The nodes are rounded to double first, and the weights belong to the rounded nodes: the quadrature is then
/// exact up to degree 7 to the precision of the weights, and what is beyond is 1e-16 of what is tiny already.

#include <array>
#include <cstddef>

namespace gravel::detail {

struct RadauTables {
  static constexpr std::size_t nodes = 7;
  using Row = std::array<long double, nodes>;

  /// Radau's nodes (Everhart 1985, in Dynamics of Comets, IAU Coll. 83, 185).
  static constexpr std::array<double, nodes> node{
      0.0562625605369221464656521910318, 0.180240691736892364987579942780, 0.352624717113169637373907769648,
      0.547153626330555383001448554766,  0.734210177215410531523210605558, 0.885320946839095768090359771030,
      0.977520613561287501891174488626};

  std::array<Row, nodes + 1> position{};  ///< [n][m]: integral of (h_n - s) l_m(s) over [0, h_n]; last: to 1
  std::array<Row, nodes + 1> velocity{};  ///< [n][m]: integral of l_m(s) over [0, h_n]; last: to 1
  std::array<Row, nodes> power{};         ///< [j][m]: coefficient of s^(j+1) in l_m
  Row jerk{};                             ///< l_m'(1)
  Row snap{};                             ///< l_m''(1)
  Row crackle{};                          ///< l_m'''(1)

  constexpr RadauTables() {
    for (std::size_t m = 0; m < nodes; ++m) {
      for (std::size_t n = 0; n <= nodes; ++n) {
        const long double end = n < nodes ? h(n) : 1.0L;
        for (std::size_t g = 0; g < 5; ++g) {  // Gauss-Legendre, exact to degree 9
          const long double s = end * (1 + gaussNode(g)) / 2;
          const long double w = end * gaussWeight(g) / 2 * lagrange(m, s);
          velocity[n][m] += w;
          position[n][m] += w * (end - s);
        }
      }
      // s/h_m times the product over k of (s - h_k)/(h_m - h_k), multiplied out.
      std::array<long double, nodes> c{};
      c[0] = 1 / h(m);
      std::size_t degree = 0;
      for (std::size_t k = 0; k < nodes; ++k) {
        if (k != m) {
          const long double scale = 1 / (h(m) - h(k));
          ++degree;
          for (std::size_t j = degree + 1; j-- > 0;) {
            c[j] = ((j > 0 ? c[j - 1] : 0) - (j < degree ? c[j] * h(k) : 0)) * scale;
          }
        }
      }
      for (std::size_t j = 0; j < nodes; ++j) {
        const auto p = static_cast<long double>(j + 1);
        power[j][m] = c[j];
        jerk[m] += p * c[j];
        snap[m] += p * (p - 1) * c[j];
        crackle[m] += p * (p - 1) * (p - 2) * c[j];
      }
    }
  }

 private:
  static constexpr long double h(std::size_t n) { return static_cast<long double>(node[n]); }
  static constexpr long double lagrange(std::size_t m, long double s) {
    long double l = s / h(m);
    for (std::size_t k = 0; k < nodes; ++k) {
      if (k != m) {
        l *= (s - h(k)) / (h(m) - h(k));
      }
    }
    return l;
  }
  static constexpr long double gaussNode(std::size_t g) {
    constexpr std::array<long double, 5> x{
        -0.906179845938663992797626878299L, -0.538469310105683091036314420700L, 0.0L,
        0.538469310105683091036314420700L, 0.906179845938663992797626878299L};
    return x[g];
  }
  static constexpr long double gaussWeight(std::size_t g) {
    constexpr std::array<long double, 5> w{
        0.236926885056189087514264040720L, 0.478628670499366468041291514836L,
        0.568888888888888888888888888889L, 0.478628670499366468041291514836L,
        0.236926885056189087514264040720L};
    return w[g];
  }
};

inline constexpr RadauTables radauTables{};

}  // namespace gravel::detail
