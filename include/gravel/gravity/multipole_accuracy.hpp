#pragma once

/// \file
/// From a promised error to the order and the limits of a fast multipole sum.

#include <gravel/gravity/multipole_walk.hpp>

namespace gravel::detail {

/// What is chosen for one band of tolerances. Measured with `benchmarks/gravity_front`; see
/// docs/theory-gravity.md for how.
struct MultipolePlan {
  double tolerance;           ///< smallest that this row serves
  int order;                  ///< of the expansions
  double safety;              ///< tolerance over the error allowed to a pair of cells
  std::uint64_t pairsDirect;  ///< pairs of bodies that cost as much as a pair of cells
  std::size_t crossover;      ///< bodies from which on it is faster than the direct sum
};

inline constexpr std::array<MultipolePlan, 9> multipolePlans{{
    {3e-3, 3, 1.7, 64, 1500},
    {3e-4, 4, 1.4, 64, 3000},
    {3e-5, 5, 1.35, 64, 6000},
    {3e-6, 7, 1.0, 128, 10000},
    {3e-7, 8, 1.05, 128, 16000},
    {3e-8, 10, 0.8, 128, 25000},
    {3e-9, 11, 0.75, 192, 40000},
    {3e-10, 12, 0.75, 192, 60000},
    {0.0, 14, 0.7, 256, 90000},
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

}  // namespace gravel::detail
