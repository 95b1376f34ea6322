#pragma once

/// \file
/// The gap that a contact at rest may have.

#include <gravel/contact/contact.hpp>

#include <algorithm>

namespace gravel::detail {

/// The largest gap of a resting contact over the sum of the radii.
template <Real S>
S restingMargin() {
  return S(1) / S(1000);
}

/// A gap that opens and closes by rounding and by the curvature of paths, and how fast it may be closed.
///
/// What rests keeps its force while its gap is below a 64th of what may rest at all
/// (NarrowPhaseSettings::step). Pairs whose overlap is taken away push their neighbours a little apart. If
/// these fell back through their gaps, every correction would change all forces, and what the sweeps leave of
/// that would be the overlaps of the next step: heaps crept for ever.
template <Real S>
struct RestingGap {
  S size;    ///< [m] < 0 is overlap
  S closed;  ///< [m] that counts as closed, at most

  static RestingGap of(const Contact<S>& c) {
    return {c.gap, restingMargin<S>() / S(64) * (c.arm1 + c.arm2 - c.gap)};
  }

  /// [m s^-1] >= 0 \param accelerations |a_1| + |a_2| of the two [m s^-2]  \param dt [s]
  [[gnu::always_inline]] S allowedApproach(const S& accelerations, const S& dt) const {
    if (!(size > S(0))) {
      return S(0);
    }
    if (!(dt > S(0))) {
      return Eigen::NumTraits<S>::highest();
    }
    const S kept = std::min<S>(closed, accelerations * dt * dt / S(64));
    return size > kept ? S((size - kept) / dt) : S(0);
  }
};

}  // namespace gravel::detail
