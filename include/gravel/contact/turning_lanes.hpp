#pragma once

/// \file
/// Resistance to rolling and spinning of rows in lanes: the units and the law are those of resistTurning().

#include <gravel/contact/row_lanes.hpp>

#include <limits>
#include <vector>

namespace gravel::detail {

/// What a row resists with: a quad of scalars.
template <Real S>
struct TurningRow {
  S q1 = S(0);  ///< effective radius / radius
  S q2 = S(0);
  S rolling = S(0);
  S spinning = S(0);

  /// \param boundary in place of the second: flat, where a point would be sharp
  static TurningRow of(const Material<S>& material, bool boundary, const S& r1, const S& r2) {
    return {boundary ? S(1) : S(r2 / (r1 + r2)), boundary ? S(0) : S(r1 / (r1 + r2)),
            material.rollingFriction, material.spinningFriction};
  }
};

/// How the impulses of a group change, and what that does to spins and to the speeds of turns.
template <Real S>
struct TurningChanges {
  using V = PackedVector<S>;
  V dl = V::zero();
  V d_rho = V::zero();
  V ds1 = V::zero();
  V ds2 = V::zero();
};

template <Real S>
struct TurningLanes {
  using P = Packed<S>;
  using V = PackedVector<S>;
  P q1;
  P q2;
  P rolling;
  P spinning;

  [[gnu::always_inline]] static inline TurningLanes load(const std::vector<TurningRow<S>>& rows,
                                                         const RowGroup<S>& group) {
    const auto q = PackedQuad<S>::load([&](std::size_t lane) { return quadOf<S>(rows[group.row[lane]], 0); });
    return {q.x, q.y, q.z, q.w};
  }

  [[gnu::always_inline]] inline V rho(const BodyLanes<S>& b1, const BodyLanes<S>& b2) const {
    return q2 * b2.s - q1 * b1.s;
  }

  /// `wanted` within what the load of `row` allows; see resistTurning().
  [[gnu::always_inline]] inline V within(const RowLanes<S>& row, const V& wanted) const {
    const P zero = P::zero();
    const P load = choose(row.jn > zero, row.jn, zero);
    const P along = row.n.dot(wanted);
    const P kept = largerOf(-spinning * load, smallerOf(along, spinning * load));
    const P most = rolling * load;
    if (!(most > zero).any()) {
      return kept * row.n;
    }
    const V across = wanted - along * row.n;
    const P size_sq = across.squaredNorm();
    // Roots of lanes may take subnormal numbers for 0.
    const P size = squareRoot(largerOf(size_sq, P::all(std::numeric_limits<S>::min())));
    const P share = choose(size_sq > most * most, most / size, P::all(S(1)));
    return share * across + kept * row.n;
  }

  /// What a change dl of the impulse does: dl on the second bodies, its opposite on the first.
  [[gnu::always_inline]] inline TurningChanges<S> by(const V& dl, const BodyLanes<S>& b1,
                                                     const BodyLanes<S>& b2) const {
    const V ds1 = -(q1 * b1.spin) * dl;
    const V ds2 = (q2 * b2.spin) * dl;
    return {dl, q2 * ds2 - q1 * ds1, ds1, ds2};
  }

  /// The impulse of `row` becomes right while all others stand: it stops the turn, or is at its limit.
  [[gnu::always_inline]] inline TurningChanges<S> resist(RowLanes<S>& row, const BodyLanes<S>& b1,
                                                         const BodyLanes<S>& b2) const {
    const P mobility = q1 * q1 * b1.spin + q2 * q2 * b2.spin;
    const V before = row.l;
    const V stops = before - reciprocalOf(mobility) * rho(b1, b2);
    row.l = choose(mobility > P::zero(), within(row, stops), V::zero());
    return by(row.l - before, b1, b2);
  }
};

template <Real S>
[[gnu::always_inline]] inline void turn(BodyLanes<S>& b1, BodyLanes<S>& b2,
                                        const TurningChanges<S>& changes) {
  b1.s = b1.s + changes.ds1;
  b2.s = b2.s + changes.ds2;
}

}  // namespace gravel::detail
