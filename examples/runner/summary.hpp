#pragma once

/// \file
/// What happened, in words.

#include "diagnostics.hpp"

#include <string>

namespace gravel::runner {

struct RunFacts {
  bool interrupted = false;
  double seconds = 0.0;  ///< of the wall clock, for the steps
  int threads = 1;
};

/// A few sentences, each a line.
std::string summary(const Scene& scene, const Space<double>& space, const History& history,
                    const RunFacts& facts);

}  // namespace gravel::runner
