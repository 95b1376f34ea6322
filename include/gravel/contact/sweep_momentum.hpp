#pragma once

/// \file
/// How far a sweep over all contacts goes on along the step of the one before it.

#include <gravel/core/types.hpp>

#include <algorithm>

namespace gravel::detail {

/// Nesterov's momentum beta = k/(k + 3) in the k-th sweep since it was started anew, which is when a sweep
/// turns back. What bounds it where there is friction: sequential_impulses.hpp.
template <Real S>
struct SweepMomentum {
  S beta = S(0);
  S limit = S(1);
  S leastSize = Eigen::NumTraits<S>::highest();
  S sizeThen = leastSize;  ///< of the last check
  int age = 0;
  int turns = 0;  ///< since the last check

  /// What the next sweep begins with, after one whose changes of the impulses have the products `along` with
  /// the whole step and `size` with themselves. \return whether sweeps lead nowhere any more
  bool stalls(const S& along, const S& size, bool friction, int sweeps) {
    turns += along < S(0) ? 1 : 0;
    age = along < S(0) ? 0 : age + 1;
    leastSize = std::min<S>(leastSize, size);
    if (friction && sweeps % 32 == 0) {
      if (turns > 2 && !(leastSize < sizeThen / S(2))) {
        return true;
      }
      turns = 0;
      sizeThen = leastSize;
    }
    if (friction && size > S(4) * leastSize) {
      limit = S(0.8);
    }
    beta = std::min<S>(S(age) / S(age + 3), limit);
    return false;
  }
};

}  // namespace gravel::detail
