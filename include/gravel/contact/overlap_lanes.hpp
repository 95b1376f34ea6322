#pragma once

/// \file
/// Overlaps that are opened by moving both bodies, for as many contacts at a time as are one Packed; they
/// share no movable body.

#include <gravel/contact/row_lanes.hpp>

#include <vector>

namespace gravel::detail {

/// A body while overlaps are opened, in two quads of scalars: in double a cache line.
template <Real S>
struct alignas(rowAlignment<S>) ShiftedBody {
  Vector3<S> d;  ///< [m] by which it was moved so far
  S mass;        ///< [kg]; 0 of what nothing moves
  Vector3<S> v;  ///< [m s^-1]
  S radius;      ///< [m]; 0 of a boundary
};

template <Real S>
struct ShiftedLanes {
  using P = Packed<S>;
  using Index = typename RowGroup<S>::Index;
  PackedVector<S> d;
  P mass;
  PackedVector<S> v;
  P radius;

  [[gnu::always_inline]] static inline ShiftedLanes load(const std::vector<ShiftedBody<S>>& bodies,
                                                         const Index& slots) {
    const auto quad = [&](std::size_t number) {
      return PackedQuad<S>::load(
          [&, number](std::size_t lane) { return quadOf<S>(bodies[slots[lane]], number); });
    };
    const PackedQuad<S> q0 = quad(0);
    const PackedQuad<S> q1 = quad(1);
    return {PackedVector<S>::of(q0), q0.w, PackedVector<S>::of(q1), q1.w};
  }
  /// Immovable bodies are shared between threads: never written. \param velocities whether they changed
  [[gnu::always_inline]] inline void store(std::vector<ShiftedBody<S>>& bodies, const Index& slots,
                                           bool velocities) const {
    const auto moves = [&](std::size_t lane) { return mass[lane] > S(0); };
    PackedQuad<S>{d.x, d.y, d.z, mass}.store(
        [&](std::size_t lane) { return quadOf<S>(bodies[slots[lane]], 0); }, moves);
    if (velocities) {
      PackedQuad<S>{v.x, v.y, v.z, radius}.store(
          [&](std::size_t lane) { return quadOf<S>(bodies[slots[lane]], 1); }, moves);
    }
  }
};

/// |v|, where squares leave the range of numbers, too.
template <Real S>
[[gnu::always_inline]] inline Packed<S> safeNorm(const PackedVector<S>& v) {
  using P = Packed<S>;
  const P sq = v.squaredNorm();
  if constexpr (std::is_floating_point_v<S>) {
    constexpr S tiny = std::numeric_limits<S>::min() / std::numeric_limits<S>::epsilon();
    const auto plain = (sq > P::all(tiny)) & (sq < P::all(std::numeric_limits<S>::max()));
    if ((!plain).any()) {
      return P::of([&](std::size_t lane) { return safeNorm<S>(v.at(lane)); });
    }
  }
  return squareRoot(sq);
}

/// The parts of a move that each of two bodies takes, by inverse mass; see massShares().
template <Real S>
struct PackedShares {
  using P = Packed<S>;
  P first;
  P second;

  /// \param m1,m2 [kg] 0 of what nothing moves
  [[gnu::always_inline]] static inline PackedShares of(const P& m1, const P& m2) {
    const P zero = P::zero();
    const P one = P::all(S(1));
    const auto firstLarger = m1 > m2;
    const P larger = largerOf(m1, m2);
    const P ratio = smallerOf(m1, m2) / choose(larger > zero, larger, one);
    const P light = one / (one + ratio);
    const P heavy = ratio / (one + ratio);
    const auto moves1 = m1 > zero;
    const auto moves2 = m2 > zero;
    return {choose(moves1, choose(moves2, choose(firstLarger, heavy, light), one), zero),
            choose(moves2, choose(moves1, choose(firstLarger, light, heavy), one), zero)};
  }
};

/// Contacts as detection saw them.
template <Real S>
struct OverlapLanes {
  using P = Packed<S>;
  PackedVector<S> n;  ///< from the first centre to the second
  P gap;
  P distance;  ///< of the centres; < 0 to a boundary

  [[gnu::always_inline]] static inline OverlapLanes load(std::span<const Contact<S>> contacts,
                                                         std::span<const ContactColoring::Row> places,
                                                         const RowGroup<S>& group) {
    static_assert(offsetof(Contact<S>, gap) == offsetof(Contact<S>, normal) + 3 * sizeof(S));
    const auto at = [&](std::size_t lane) -> const Contact<S>& {
      return contacts[places[group.row[lane]].contact];
    };
    const auto geometry =
        PackedQuad<S>::load([&](std::size_t lane) { return quadOf<S>(at(lane).normal, 0); });
    return {PackedVector<S>::of(geometry), geometry.w, P::of([&](std::size_t lane) {
              const Contact<S>& c = at(lane);
              return c.second == staticPartner ? S(-1) : S(c.arm1 + c.arm2);
            })};
  }
};

/// How far contacts are opened.
template <Real S>
struct OpenedLanes {
  using P = Packed<S>;
  P missing = P::zero();  ///< [m] moved apart
  P way1 = P::zero();     ///< [m] of that by the first
  P way2 = P::zero();
  P loss = P::zero();  ///< [J] of energy of motion
};

/// Opens contacts along their present normals to the distance at which the overlap is `kept` [m].
/// \param keepAngularMomentum two that are moved apart turn the slower
template <Real S>
[[gnu::always_inline]] inline OpenedLanes<S> openTo(const OverlapLanes<S>& contact, const Packed<S>& kept,
                                                    ShiftedLanes<S>& b1, ShiftedLanes<S>& b2,
                                                    bool keepAngularMomentum) {
  using P = Packed<S>;
  const P zero = P::zero();
  const P one = P::all(S(1));
  const auto wall = contact.distance < zero;
  const P reach = choose(wall, zero, contact.distance) - contact.gap - kept;
  const PackedShares<S> shares = PackedShares<S>::of(b1.mass, b2.mass);
  const PackedVector<S> d = b2.d - b1.d;
  const PackedVector<S> r = contact.distance * contact.n + d;
  const P distance = safeNorm(r);
  const auto pair = !wall;
  const auto turned = pair & (distance > P::all(roundoff<S>()) * reach) & (distance > zero);
  const PackedVector<S> n = choose(turned, one / choose(turned, distance, one) * r, contact.n);
  const P missing = reach - choose(wall, contact.n.dot(d), distance);
  const auto opens = (missing > zero) & (shares.first + shares.second > zero);
  OpenedLanes<S> opened;
  opened.missing = choose(opens, missing, zero);
  opened.way1 = shares.first * opened.missing;
  opened.way2 = shares.second * opened.missing;
  if (keepAngularMomentum) {
    const auto turns = opens & pair;
    const PackedVector<S> v_rel = b2.v - b1.v;
    const PackedVector<S> v_t = v_rel - n.dot(v_rel) * n;
    const P lost = opened.missing / choose(turns, distance + missing, one);  // v_t becomes (1 - lost) v_t
    const PackedVector<S> brake = choose(turns, lost * v_t, PackedVector<S>::zero());
    b1.v = b1.v + shares.first * brake;
    b2.v = b2.v - shares.second * brake;
    const P reducedMass = choose(shares.first > zero, shares.first * b1.mass, shares.second * b2.mass);
    opened.loss = choose(
        turns, reducedMass * v_t.squaredNorm() * lost * (P::all(S(2)) - lost) * P::all(S(1) / S(2)), zero);
  }
  b1.d = b1.d - opened.way1 * n;
  b2.d = b2.d + opened.way2 * n;
  return opened;
}

}  // namespace gravel::detail
