#pragma once

/// \file
/// The direct sum for so few bodies that putting them into columns would cost more than the sum.

#include <gravel/gravity/pair_law.hpp>

#include <algorithm>
#include <array>

namespace gravel::detail {

/// Sums over at most `most` bodies, pair by pair, in their own units; the square roots and divisions of all
/// pairs stand together, so that packets do them.
template <class S>
struct FewBodies {
  static constexpr std::size_t most = 14;
  static constexpr bool usable = std::is_same_v<S, double> || std::is_same_v<S, long double>;

  /// out[i] as in DirectSum. \return false, with nothing written, for values that need its units or its
  /// words: not finite, negative, squared distances beyond 1e-100 … 1e100, coincident points
  template <class Positions, class Masses, class Accelerations>
  static bool accelerations(const Positions& positions, const Masses& masses, const S& G, const S& softening,
                            Accelerations& out) {
    const std::size_t n = positions.size();
    if (n > most || masses.size() != n || !(std::abs(G) <= S(1e100)) || !(softening >= S(0))) {
      return false;
    }
    constexpr std::size_t pairs = most * (most - 1) / 2;
    alignas(32) std::array<S, pairs> dx, dy, dz, s, w;
    std::array<S, most> x, y, z, m;
    for (std::size_t i = 0; i < n; ++i) {
      const Vector3<S> p = positions[i];
      x[i] = p[0];
      y[i] = p[1];
      z[i] = p[2];
      m[i] = masses[i];
      if (!(m[i] >= S(0)) || !(m[i] <= S(1e100))) {
        return false;
      }
    }
    const S softening_sq = softening * softening;
    S least(1);
    S sum(0);  // what is not finite stays in it
    std::size_t p = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j, ++p) {
        dx[p] = x[j] - x[i];
        dy[p] = y[j] - y[i];
        dz[p] = z[j] - z[i];
        s[p] = dx[p] * dx[p] + dy[p] * dy[p] + dz[p] * dz[p] + softening_sq;
        least = std::min(least, s[p]);
        sum += s[p];
      }
    }
    if (!(least >= S(1e-100)) || !(sum <= S(1e100))) {
      return false;
    }
    constexpr std::size_t width = 4;
    std::size_t q = 0;
    for (; q + width <= p; q += width) {
      using T = Lanes<S, static_cast<int>(width)>;
      const T tile = Eigen::Map<const T>(&s[q]);
      Eigen::Map<T>{&w[q]} = PairLaw<S>::accelerationFactor(tile);
    }
    for (; q < p; ++q) {
      w[q] = PairLaw<S>::accelerationFactor(s[q]);
    }
    std::array<S, most> ax{}, ay{}, az{};
    p = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j, ++p) {
        const S f_i = m[j] * w[p];
        const S f_j = m[i] * w[p];
        ax[i] += f_i * dx[p];
        ay[i] += f_i * dy[p];
        az[i] += f_i * dz[p];
        ax[j] -= f_j * dx[p];
        ay[j] -= f_j * dy[p];
        az[j] -= f_j * dz[p];
      }
      out[i] = Vector3<S>(ax[i] * G, ay[i] * G, az[i] * G);
    }
    return true;
  }
};

}  // namespace gravel::detail
