#pragma once

/// \file
/// Which images are near, and how well all others are expanded, by tolerance.

#include <gravel/core/types.hpp>

#include <array>

namespace gravel::detail {

/// How far images are near, and the order of the expansion of all others, for one band of tolerances.
/// Measured; see docs/theory-gravity.md.
struct ImagePlan {
  double tolerance;  ///< smallest that this row serves
  double reach;      ///< images are near within so many diagonals of the box
  int order;
  double flat;  ///< see PeriodicImages::isDeep

  friend bool operator==(const ImagePlan&, const ImagePlan&) = default;
};

/// Of the slabs of a deep patch, in diagonals of its plane. Bodies of two that touch are apart by at most
/// 1.23 times the distance of their centres.
inline constexpr double slabHeight = 1.42;

inline constexpr std::array<ImagePlan, 8> imagePlans{{
    {1e-2, 1.42, 10, 1.5},
    {1e-3, 1.42, 14, 1.5},
    {1e-4, 1.42, 18, 1.5},
    {1e-5, 1.42, 22, 1.5},
    {1e-6, 1.74, 22, 1.5},
    {1e-7, 1.74, 26, 1.5},
    {1e-9, 1.74, 32, 1.42},
    {0.0, 1.74, 36, 1.0},
}};

template <Real S>
const ImagePlan& planImages(const S& tolerance) {
  for (const ImagePlan& plan : imagePlans) {
    if (tolerance >= S(plan.tolerance)) {
      return plan;
    }
  }
  return imagePlans.back();
}

}  // namespace gravel::detail
