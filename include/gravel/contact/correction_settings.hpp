#pragma once

/// \file
/// What one asks of the correction of positions, and what it answers.

#include <gravel/core/check.hpp>
#include <gravel/core/types.hpp>

#include <cstdint>
#include <string>

namespace gravel {

/// How overlap is removed. What is said of all contacts is said of those of an island, if that is small. A
/// `Space` takes a factor of its own, 0.4 by default, and sweepsOfLooks().
template <Real Scalar>
struct CorrectionSettings {
  Scalar factor = Scalar(0.8);  ///< [1], 0 … 1: part of each overlap to remove
  Scalar slop = Scalar(0);      ///< [m] >= 0: overlap that stays
  /// [1] > 0: largest part of the smaller of the two radii by which one contact is opened in a call, so that
  /// deep overlaps come apart over several steps.
  Scalar cap = Scalar(0.5);
  Scalar tolerance =
      Scalar(1e-3);  ///< [1] > 0: sweeps end when the largest move is this times the largest overlap
  /// [1] >= 0: overlaps that are right to this times the smallest radius of a contact are right; nothing is
  /// moved while all are, and where some are not, those below a quarter of it stay unless others are pressed
  /// into them.
  Scalar precision = Scalar(1e-4);
  int maxIterations = 20;  ///< >= 1
  /// If > 0, small islands (SolverIslands) take sweepsOfLooks(contacts, islandLooks) of their own at most.
  std::size_t islandLooks = 0;
  /// A pair that is moved apart keeps its angular momentum: it turns the slower. Off: velocities stay.
  bool keepAngularMomentum = true;
};

/// \throws std::invalid_argument naming the setting, its value and what is allowed
template <Real S>
void validate(const CorrectionSettings<S>& settings) {
  detail::require("correction factor", settings.factor, detail::Range<S>{S(0), S(1), "0 to 1"});
  detail::require("correction slop", settings.slop, detail::nonNegative<S>());
  detail::require("correction cap", settings.cap, detail::positive<S>());
  detail::require("correction tolerance", settings.tolerance, detail::positive<S>());
  detail::require("correction precision", settings.precision, detail::nonNegative<S>());
  if (settings.maxIterations < 1) {
    detail::refuse("correction maxIterations", std::to_string(settings.maxIterations), ">= 1");
  }
}

/// A body that was moved.
template <Real Scalar>
struct Displacement {
  std::uint32_t body;
  Vector3<Scalar> shift;   ///< [m]
  Vector3<Scalar> change;  ///< [m s^-1] of its velocity, for angular momentum's sake
};

template <Real Scalar>
struct CorrectionReport {
  int iterations = 0;
  Scalar largestOverlap = Scalar(0);  ///< [m] before
  Scalar residual = Scalar(0);        ///< [m] largest move of the last sweep
  Scalar loss = Scalar(0);            ///< [J] >= 0, of energy of motion
};

}  // namespace gravel
