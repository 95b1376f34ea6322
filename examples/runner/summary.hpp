#pragma once

/// \file
/// What happened, in words.

#include "diagnostics.hpp"

#include <string>

namespace gravel::runner {

struct RunFacts {
  bool interrupted = false;
  double begin = 0.0;    ///< time of the scene at which the run was taken up; 0 for a whole one
  double seconds = 0.0;  ///< of the wall clock, for the steps
  int threads = 1;
};

/// Said where energies were not finite in some step, or places in some row; then the run counts as failed.
inline constexpr const char* notFinite =
    "The energies or places are not finite: this run is not to be trusted. Take a shorter timeStep, or "
    "smaller numbers.";

/// A few sentences, each a line.
std::string summary(const Scene& scene, const Space<double>& space, const History& history,
                    const RunFacts& facts);

}  // namespace gravel::runner
