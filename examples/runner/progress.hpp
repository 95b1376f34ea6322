#pragma once

/// \file
/// The line that says how far a run has come.

#include "scene.hpp"

#include <chrono>

namespace gravel::runner {

/// On a terminal one line, rewritten a few times a second; else a line now and then.
class Progress {
 public:
  /// \param space  as the run begins with it
  Progress(const Units& units, double duration, bool quiet, const Space<double>& space);

  /// Shows the state if it is time to. Cheap enough for every step.
  void show(const Space<double>& space, double drift);
  /// Shows the last state and ends the line.
  void finish(const Space<double>& space, double drift);
  double seconds() const;  ///< of the wall clock since the start

 private:
  using Clock = std::chrono::steady_clock;
  void print(const Space<double>& space, double drift, double now);

  Units units_;
  double duration_;
  bool quiet_;
  bool terminal_;
  Clock::time_point start_ = Clock::now();
  double lastShown_ = -1e9;
  double pause_;
  // Speed over the last lines rather than the whole run: a scene slows down as it gets dense.
  double rate_ = 0.0, timeRate_ = 0.0;
  double lastSeconds_ = 0.0, lastTime_;
  std::size_t lastSteps_;
};

}  // namespace gravel::runner
