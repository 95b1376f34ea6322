#pragma once

/// \file
/// The functions that weigh the points and waves of a lattice, for any scalar.

#include <gravel/core/types.hpp>

#include <cmath>
#include <vector>

namespace gravel::detail {

/// e^-x for x >= 0; by its series and squares for a scalar that need not have exp().
template <Real T>
T negativeExponential(T x) {
  if constexpr (std::is_floating_point_v<T>) {
    return std::exp(-x);
  } else {
    int halvings = 0;
    for (; x > T(0.5); ++halvings) {
      x /= T(2);
    }
    T term(1);
    T sum(1);
    for (int n = 1; n <= 24; ++n) {
      term *= x / T(n);
      sum += term;
    }
    sum = T(1) / sum;
    for (; halvings > 0; --halvings) {
      sum *= sum;
    }
    return sum;
  }
}

/// shares[n] = P(n + 1/2, x), from the highest n down: P(a, x) = P(a + 1, x) + x^a e^-x / Gamma(a + 1).
template <Real T>
void gammaShares(const T& x, std::vector<T>& shares) {
  using std::sqrt;
  T term = T(2) * T(sqrt(T(x / pi<T>()))) * negativeExponential(x);
  shares[0] = term;
  for (std::size_t n = 1; n < shares.size(); ++n) {
    term *= x / (T(static_cast<double>(n)) + T(0.5));
    shares[n] = term;
  }
  T a = T(static_cast<double>(shares.size())) - T(0.5);
  T sum = term;
  while (term > sum * T(1e-22)) {
    a += T(1);
    term *= x / a;
    sum += term;
  }
  shares.back() = sum;
  for (std::size_t n = shares.size() - 1; n-- > 0;) {
    shares[n] += shares[n + 1];
  }
}

}  // namespace gravel::detail
