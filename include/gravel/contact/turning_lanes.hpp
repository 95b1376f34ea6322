#pragma once

/// \file
/// Resistance to rolling and spinning of rows in lanes: the units and the law are those of resistTurning(),
/// beside friction those of gripImpulses().

#include <gravel/contact/row_lanes.hpp>
#include <gravel/contact/slip_and_turn.hpp>

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
  typename Packed<S>::Truth right = {};  ///< with friction; else both are to be taken again
};

template <Real S>
[[gnu::always_inline]] inline void turn(BodyLanes<S>& b1, BodyLanes<S>& b2,
                                        const TurningChanges<S>& changes) {
  b1.s = b1.s + changes.ds1;
  b2.s = b2.s + changes.ds2;
}

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

  /// What is longer than `most` made as long as `kept`. \param mass,before  of againstBoth()
  [[gnu::always_inline]] static inline V cut(const V& wanted, const P& most, const P& kept, const P& mass,
                                             const V& before) {
    const auto longer = wanted.squaredNorm() > most * most;
    if (!longer.any()) {
      return wanted;
    }
    const V way = againstBoth(wanted, mass, before);
    // Roots of lanes may take subnormal numbers for 0.
    const P size = squareRoot(largerOf(way.squaredNorm(), P::all(std::numeric_limits<S>::min())));
    return choose(longer, (kept / size) * way, wanted);
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
    return cut(across, most, most, zero, V::zero()) + kept * row.n;
  }

  /// What a change dl of the impulse does: dl on the second bodies, its opposite on the first.
  [[gnu::always_inline]] inline TurningChanges<S> by(const V& dl, const BodyLanes<S>& b1,
                                                     const BodyLanes<S>& b2) const {
    const V ds1 = -(q1 * b1.spin) * dl;
    const V ds2 = (q2 * b2.spin) * dl;
    return {dl, q2 * ds2 - q1 * ds1, ds1, ds2};
  }

  /// Friction and resistance of `row` become right while all others stand: together, if they do not both come
  /// to their limits at an angle. Else each does by itself, friction first, and they are to be taken again.
  /// Masses by their common mobility 1/m1 + 1/m2, as products of two of them may leave the range of float.
  /// \param slip that is to vanish
  /// \param changes  gets what friction does
  [[gnu::always_inline]] inline TurningChanges<S> rubAndResist(RowLanes<S>& row, const BodyLanes<S>& b1,
                                                               const BodyLanes<S>& b2, const V& slip,
                                                               const RowSlides<S>& sliding,
                                                               RowChanges<S>& changes) const {
    const P zero = P::zero();
    const P normal = normalMobility(b1, b2);
    const P mass = reciprocalOf(normal);
    const auto m = SlipAndTurn<P>::of(choose(normal > zero, P::all(S(1)), zero), row.c1, q1, mass * b1.spin,
                                      row.c2, q2, mass * b2.spin);
    const P per_C = reciprocalOf(m.turn);
    const P per_D = reciprocalOf(m.det);
    const V u = mass * slip;
    const V rho_all = mass * rho(b1, b2);
    const P rho_n = row.n.dot(rho_all);
    const P l_n = row.n.dot(row.l);
    const V rho_t = rho_all - rho_n * row.n;
    const V l = row.l - l_n * row.n;
    const P load = choose(row.jn > zero, row.jn, zero);
    const P rubbed = smallerOf(load, sliding.mostLoad);
    const P most = choose(sliding.tired, row.slide, row.stick) * rubbed;
    const P mostTurn = rolling * load;
    changes.rubs = (row.stick > zero) & (m.slip > zero) & ((row.jn > zero) | (row.jt.sumAbs() > zero));
    const auto both = changes.rubs & (m.turn > zero);

    // Friction is free.
    const V& u0 = sliding.slipBefore;
    const V& rho0 = sliding.turnBefore;
    const V still = l + per_D * (m.both * row.n.cross(u) - m.slip * rho_t);
    V dl = cut(still, mostTurn, mostTurn, mass * per_D * m.slip, rho0) - l;
    V dt = -reciprocalOf(m.slip) * (u + m.both * dl.cross(row.n));
    changes.slides = both & ((row.jt + dt).squaredNorm() > most * most);
    auto right = both & !changes.slides;
    if (changes.slides.any()) {
      // Resistance is; or both are at their limits, and would come to the same again.
      const P limit = choose(sliding.kinetic, row.slide, row.stick) * rubbed;
      const V stops = row.jt + per_D * (m.both * rho_t.cross(row.n) - m.turn * u);
      const V dt_slides = cut(stops, most, limit, mass * per_D * m.turn, u0) - row.jt;
      const V dl_slides = -per_C * (rho_t + m.both * row.n.cross(dt_slides));
      const auto rolls = !((l + dl_slides).squaredNorm() > mostTurn * mostTurn);
      const V sticks = row.jt + dt;
      const V dt_most = cut(sticks, limit, limit, mass * reciprocalOf(m.slip), u0) - row.jt;
      const V beside = l - per_C * (rho_t + m.both * row.n.cross(dt_most));
      const V dl_most = cut(beside, mostTurn, mostTurn, mass * per_C, rho0) - l;
      const P little = P::all(S(8) * roundoff<S>()) * mostTurn;
      const auto same = !((dl_most - dl).squaredNorm() > little * little);
      right = (changes.slides & (rolls | same)) | right;
      dt = choose(changes.slides, choose(rolls, dt_slides, dt_most), dt);
      dl = choose(changes.slides, choose(rolls, dl_slides, dl_most), dl);
    }
    dt = choose(right, dt, V::zero());
    dl = choose(right, dl, V::zero());
    const auto presses = (row.jn > zero) | ((row.jt.sumAbs() + row.l.sumAbs()) > zero);
    const auto rest = presses & (m.slip > zero) & !right;
    if (rest.any()) {
      RowLanes<S> alone = row;
      const auto slides = right & changes.slides;
      rubRight(alone, b1, b2, slip, sliding, changes);
      changes.slides = slides | (rest & changes.slides);
      const V stops = l - per_C * (rho_t + m.both * row.n.cross(changes.dt));
      dt = choose(rest, changes.dt, dt);
      const V kept = cut(stops, mostTurn, mostTurn, mass * per_C, rho0);
      dl = choose(rest, choose(m.turn > zero, kept, V::zero()) - l, dl);
    }

    const P mostSpin = spinning * load;
    const P spins = largerOf(-mostSpin, smallerOf(l_n - per_C * rho_n, mostSpin));
    const P spun = choose(m.turn > zero, spins, zero);
    TurningChanges<S> turned = by(dl + (spun - l_n) * row.n, b1, b2);
    turned.right = right;
    turned.d_rho = turned.d_rho + (normal * m.both) * row.n.cross(dt);
    changes.dt = dt;
    changes.du = normal * (m.slip * dt + m.both * dl.cross(row.n));
    row.jt = row.jt + dt;
    row.l = row.l + turned.dl;
    return turned;
  }
};

/// All impulses of these rows to bodies that have none of them. \param turning  by row; empty if nothing
/// resists turning
template <Real S>
[[gnu::always_inline]] inline void pushAll(const RowGroup<S>& group, const RowLanes<S>& row,
                                           const std::vector<TurningRow<S>>& turning, BodyLanes<S>& b1,
                                           BodyLanes<S>& b2) {
  push(b1, b2, row.wholeImpulse());
  twist(row, b1, b2, row.jt);
  if (!turning.empty()) {
    turn(b1, b2, TurningLanes<S>::load(turning, group).by(row.l, b1, b2));
  }
}

}  // namespace gravel::detail
