#pragma once

/// \file
/// From a promised error to the order and the limits of a fast multipole sum.

#include <gravel/core/types.hpp>

#include <array>

namespace gravel::detail {

/// What is chosen for one band of tolerances. Measured; see docs/theory-gravity.md.
struct MultipolePlan {
  double tolerance;           ///< smallest that this row serves
  int order;                  ///< of the expansions
  double safety;              ///< tolerance over the error allowed to a pair of cells
  std::uint64_t pairsDirect;  ///< pairs of bodies that cost as much as a pair of cells
  std::size_t crossover;      ///< bodies from which on it is faster than the direct sum, two doubles at once
};

inline constexpr std::array<MultipolePlan, 10> multipolePlans{{
    {8e-3, 4, 0.38, 64, 2500},
    {2.5e-3, 5, 0.38, 64, 3100},
    {1e-3, 6, 0.38, 64, 3500},
    {3e-4, 6, 0.78, 64, 4900},
    {1e-4, 6, 0.86, 128, 6100},
    {1e-5, 8, 0.7, 256, 8000},
    {1e-6, 9, 0.54, 256, 12500},
    {3e-8, 10, 0.45, 384, 23000},
    {1e-9, 12, 0.45, 512, 50000},
    {0.0, 14, 0.45, 512, 85000},
}};

/// The row for a tolerance.
template <Real S>
const MultipolePlan& planMultipoles(const S& tolerance) {
  for (const MultipolePlan& plan : multipolePlans) {
    if (tolerance >= S(plan.tolerance)) {
      return plan;
    }
  }
  return multipolePlans.back();
}

/// Bodies from which on it is faster than the direct sum. Targets that compute four or eight doubles at once
/// (AVX, AVX-512) do so from 1.4 times as many on: wide lanes serve the direct sum better.
template <Real S>
std::size_t multipoleCrossover(const S& tolerance) {
  constexpr bool wide = Eigen::internal::packet_traits<double>::size > 2;
  const std::size_t narrow = planMultipoles(tolerance).crossover;
  return wide ? narrow + narrow * 2 / 5 : narrow;
}

}  // namespace gravel::detail
