#pragma once

/// \file
/// The gap that a contact at rest may have.

#include <gravel/core/packed.hpp>
#include <gravel/core/sizes.hpp>

#include <algorithm>

namespace gravel::detail {

/// The largest gap of a resting contact over the sum of the radii.
template <Real S>
S restingMargin() {
  return S(1) / S(1000);
}

/// Radii with the gap that what rests may have, for searches: in proportion of each, so that a giant's gap is
/// none of the grains' beside it.
template <class Bodies>
struct RestingReaches {
  const Bodies& bodies;

  std::size_t size() const { return bodies.size(); }
  auto operator[](std::size_t i) const {
    using S = std::remove_cvref_t<decltype(bodies.radii()[i])>;
    return S(bodies.radii()[i] * (S(1) + restingMargin<S>()));
  }
};

/// A gap that opens and closes by rounding and by the curvature of paths, and how fast it may be closed.
///
/// What rests keeps its force while its gap is below a 64th of what may rest at all
/// (NarrowPhaseSettings::step). Pairs whose overlap is taken away push their neighbours a little apart. If
/// these fell back through their gaps, every correction would change all forces, and what the sweeps leave of
/// that would be the overlaps of the next step: heaps crept for ever.
template <Real S>
struct RestingGap {
  using P = Packed<S>;

  /// [m s^-1] >= 0
  /// \param gap [m] < 0 is overlap \param radii [m] their sum
  /// \param accelerations |a_1| + |a_2| of the two [m s^-2] \param dt [s] \param gapStep  of ContactSettings
  [[gnu::always_inline]] static inline P allowedApproach(const P& gap, const P& radii, const P& accelerations,
                                                         const S& dt, const S& gapStep) {
    const P open = choose(gap > P::zero(), gap, P::zero());
    if (!(dt > S(0))) {
      return choose(open > P::zero(), P::all(highest<S>()), P::zero());
    }
    const P closed = P::all(restingMargin<S>() / S(64)) * radii;
    const S longer = std::max<S>(dt, gapStep);
    const P kept = smallerOf(closed, accelerations * P::all(S(longer * longer / S(64))));
    return choose(open > kept, (open - kept) / P::all(dt), P::zero());
  }
};

/// The step whose gaps may rest, where steps become shorter: `last` in a step of h, then less. What rests
/// falls into gaps that close, so they close slowly, by 3/32 of a fall from rest in each step.
template <Real S>
S nextGapStep(const S& last, const S& h) {
  if (!(last > h)) {
    return h;
  }
  const S ratio = h / last;
  return std::max<S>(h, S(last * (S(1) - S(3) * ratio * ratio)));
}

}  // namespace gravel::detail
