#pragma once

/// \file
/// Rows and bodies of a ContactProblem in lanes: what makes a contact right while all others stand, for as
/// many contacts at a time as are one Packed. They share no movable body, so that all may be solved at once.

#include <gravel/contact/contact_coloring.hpp>
#include <gravel/contact/solver_rows.hpp>
#include <gravel/core/packed.hpp>

#include <array>
#include <limits>
#include <span>
#include <vector>

namespace gravel::detail {

/// Up to packWidth<S> rows; the lanes beyond `count` hold the first one again, but between two boundaries: it
/// gets no impulse there and is never written. So a row's bits do not depend on which others are beside it.
template <Real S>
struct RowGroup {
  static constexpr std::size_t width = packWidth<S>;
  using Index = std::array<std::uint32_t, width>;

  std::size_t count = 0;
  Index row;
  Index slot1;
  Index slot2;

  [[gnu::always_inline]] void add(std::span<const ContactColoring::Row> places, std::size_t k) {
    row[count] = static_cast<std::uint32_t>(k);
    slot1[count] = places[k].slot1;
    slot2[count] = places[k].slot2;
    ++count;
  }
  /// The lanes that are left over. \param boundary the slot of what never moves
  [[gnu::always_inline]] void fill(std::uint32_t boundary) {
    for (std::size_t lane = count; lane < width; ++lane) {
      row[lane] = row[0];
      slot1[lane] = slot2[lane] = boundary;
    }
  }
  /// Rows k, k + 1, … below `end`.
  [[gnu::always_inline]] static RowGroup from(std::span<const ContactColoring::Row> places, std::size_t k,
                                              std::size_t end, std::uint32_t boundary) {
    RowGroup group;
    for (; k < end && group.count < width; ++k) {
      group.add(places, k);
    }
    group.fill(boundary);
    return group;
  }
  bool holds(std::size_t lane) const { return lane < count; }
};

/// Calls f(group) for those rows k of [begin, end) of which `wanted(k)`; they share no movable body. Before
/// that, while the group before is dealt with, fetch(k) may ask for what such a row needs (inlined, or a
/// compiler finds that it does nothing).
template <Real S, class Wanted, class Fetch, class F>
void forGroupsOf(const ContactColoring& colouring, std::size_t begin, std::size_t end, Wanted&& wanted,
                 Fetch&& fetch, F&& f) {
  RowGroup<S> group;
  RowGroup<S> next;
  for (std::size_t k = begin; k < end; ++k) {
    if (wanted(k)) {
      fetch(k);
      next.add(colouring.rows(), k);
    }
    if (next.count == next.width) {
      if (group.count > 0) {
        f(group);
      }
      group = next;
      next.count = 0;
    }
  }
  if (group.count > 0) {
    f(group);
  }
  if (next.count > 0) {
    next.fill(colouring.staticSlot());
    f(next);
  }
}

template <Real S, class Wanted, class F>
void forGroupsOf(const ContactColoring& colouring, std::size_t begin, std::size_t end, Wanted&& wanted,
                 F&& f) {
  forGroupsOf<S>(
      colouring, begin, end, wanted, [](std::size_t /*row*/) {}, f);
}

/// The scalars of an object that is made of them, from the quad of that number on.
template <Real S, class T>
[[gnu::always_inline]] inline auto quadOf(T& object, std::size_t number) {
  using Plain = std::conditional_t<std::is_const_v<T>, const S, S>;
  return reinterpret_cast<Plain*>(&object) + 4 * number;
}

/// SolverBody; or SolverStart, whose falls and radii then stand in place of inverse masses and spins.
template <Real S>
struct BodyLanes {
  PackedVector<S> v;
  Packed<S> inverseMass;
  PackedVector<S> s;
  Packed<S> spin;

  template <class B>
  [[gnu::always_inline]] static BodyLanes load(const std::vector<B>& bodies,
                                               const typename RowGroup<S>::Index& slots) {
    static_assert(sizeof(B) >= 8 * sizeof(S));
    const auto linear =
        PackedQuad<S>::load([&](std::size_t lane) { return quadOf<S>(bodies[slots[lane]], 0); });
    const auto angular =
        PackedQuad<S>::load([&](std::size_t lane) { return quadOf<S>(bodies[slots[lane]], 1); });
    return {PackedVector<S>::of(linear), linear.w, PackedVector<S>::of(angular), angular.w};
  }

  /// Immovable bodies are shared between threads: never written. \param spins whether they changed as well
  [[gnu::always_inline]] void store(std::vector<SolverBody<S>>& bodies,
                                    const typename RowGroup<S>::Index& slots, bool spins) const {
    const auto moves = [&](std::size_t lane) { return inverseMass[lane] > S(0); };
    PackedQuad<S>{v.x, v.y, v.z, inverseMass}.store(
        [&](std::size_t lane) { return quadOf<S>(bodies[slots[lane]], 0); }, moves);
    if (spins) {
      PackedQuad<S>{s.x, s.y, s.z, spin}.store(
          [&](std::size_t lane) { return quadOf<S>(bodies[slots[lane]], 1); }, moves);
    }
  }
};

/// SolverRow, and its impulse.
template <Real S>
struct RowLanes {
  using P = Packed<S>;
  PackedVector<S> n;
  P c1;
  P c2;
  P target;
  P stick;
  P slide;
  PackedVector<S> jt = PackedVector<S>::zero();
  P jn = P::zero();
  PackedVector<S> l = PackedVector<S>::zero();  ///< against turning, if anything resists that

  /// Without an impulse.
  [[gnu::always_inline]] static inline RowLanes load(const std::vector<SolverRow<S>>& rows,
                                                     const RowGroup<S>& group) {
    const auto quad = [&](std::size_t number) {
      return PackedQuad<S>::load(
          [&, number](std::size_t lane) { return quadOf<S>(rows[group.row[lane]], number); });
    };
    const PackedQuad<S> q0 = quad(0);
    const PackedQuad<S> q1 = quad(1);
    return {PackedVector<S>::of(q0), q0.w, q1.x, q1.y, q1.z, q1.w};
  }
  /// The same.
  [[gnu::always_inline]] inline void store(std::vector<SolverRow<S>>& rows, const RowGroup<S>& group) const {
    const auto put = [&](std::size_t number, const PackedQuad<S>& quad) {
      quad.store([&](std::size_t lane) { return quadOf<S>(rows[group.row[lane]], number); },
                 [&](std::size_t lane) { return group.holds(lane); });
    };
    put(0, {n.x, n.y, n.z, c1});
    put(1, {c2, target, stick, slide});
  }

  [[gnu::always_inline]] inline PackedVector<S> wholeImpulse() const { return jn * n + jt; }
};

/// How the impulses of a group change for its rows to be right, and what that does to velocities.
template <Real S>
struct RowChanges {
  using P = Packed<S>;
  P dj = P::zero();                              ///< of the normal impulse
  P approach = P::zero();                        ///< of the normal velocity
  PackedVector<S> dt = PackedVector<S>::zero();  ///< of the tangential impulse
  PackedVector<S> du = PackedVector<S>::zero();  ///< of the slip
  typename P::Truth rubs;                        ///< friction was looked at
  typename P::Truth slides;                      ///< and cut

  /// The square of the larger change of a velocity.
  [[gnu::always_inline]] inline P change_sq() const {
    return largerOf(approach * approach, du.squaredNorm());
  }
};

/// The normal impulse of `row` becomes right.
template <Real S>
[[gnu::always_inline]] inline void pushRight(RowLanes<S>& row, const BodyLanes<S>& b1, const BodyLanes<S>& b2,
                                             const Packed<S>& v_n, RowChanges<S>& changes) {
  using P = Packed<S>;
  const P mobility = normalMobility(b1, b2);
  const P next = row.jn + reciprocalOf(mobility) * (row.target - v_n);
  const P jn = choose(next > P::zero(), next, P::zero());
  changes.dj = jn - row.jn;
  changes.approach = changes.dj * mobility;
  row.jn = jn;
}

/// Which rows of a group slide, and how.
template <Real S>
struct RowSlides {
  typename Packed<S>::Truth kinetic;  ///< what cuts friction is the kinetic limit; in others the static one
  typename Packed<S>::Truth tired;    ///< that have begun to too often: they go on, since sweeps must end
  Packed<S> mostLoad = Packed<S>::all(highest<S>());  ///< friction is by no more than this
  /// Of fast ones, else zero: slip and turn across n before the kick. What slides is held against the mean of
  /// these and what is left, since it may turn in between: contact_problem_way.hpp.
  PackedVector<S> slipBefore = PackedVector<S>::zero();
  PackedVector<S> turnBefore = PackedVector<S>::zero();
};

/// Against what friction holds a slide: along `wanted`, which is against the slip that is left, and against
/// what there was before as well, by the square of the cosine between them. (So that they never cancel.)
/// \param mass  of the slip
template <Real S>
[[gnu::always_inline]] inline PackedVector<S> againstBoth(const PackedVector<S>& wanted,
                                                          const Packed<S>& mass,
                                                          const PackedVector<S>& before) {
  using P = Packed<S>;
  const P along = -wanted.dot(before);
  const auto over = [&along](const PackedVector<S>& v) {  // v^2, in the range of numbers
    return along * reciprocalOf(largerOf(v.squaredNorm(), P::all(std::numeric_limits<S>::min())));
  };
  const P cosine_sq = over(wanted) * over(before);
  return wanted - (mass * choose(along > P::zero(), cosine_sq, P::zero())) * before;
}

/// The tangential impulse of `row` becomes right for its normal one: a row sticks up to the static limit.
/// \param slip that is to vanish
template <Real S>
[[gnu::always_inline]] inline void rubRight(RowLanes<S>& row, const BodyLanes<S>& b1, const BodyLanes<S>& b2,
                                            const PackedVector<S>& slip, const RowSlides<S>& sliding,
                                            RowChanges<S>& changes) {
  using P = Packed<S>;
  const P zero = P::zero();
  const P mobility = tangentialMobility(row, b1, b2);
  const PackedVector<S> wanted = row.jt - reciprocalOf(mobility) * slip;
  const P size_sq = wanted.squaredNorm();
  const P load = smallerOf(row.jn, sliding.mostLoad);
  const P most = choose(sliding.tired, row.slide, row.stick) * load;
  changes.rubs = (row.stick > zero) & (mobility > zero) & ((row.jn > zero) | (row.jt.sumAbs() > zero));
  changes.slides = changes.rubs & (size_sq > most * most);
  PackedVector<S> jt = choose(changes.rubs, wanted, row.jt);
  if (changes.slides.any()) {
    const P limit = choose(sliding.kinetic, row.slide, row.stick);
    const PackedVector<S> against = againstBoth(wanted, reciprocalOf(mobility), sliding.slipBefore);
    // Roots of lanes may take subnormal numbers for 0.
    const P normal_sq = largerOf(against.squaredNorm(), P::all(std::numeric_limits<S>::min()));
    const P kept = limit * load / squareRoot(choose(changes.slides, normal_sq, P::all(S(1))));
    jt = choose(changes.slides, kept * against, jt);
  }
  changes.dt = jt - row.jt;
  changes.du = mobility * changes.dt;
  row.jt = jt;
}

/// The tangential impulse of `row` made to lie across its normal, and in Coulomb's cone.
template <Real S>
[[gnu::always_inline]] inline void cutToCone(RowLanes<S>& row, const BodyLanes<S>& b1, const BodyLanes<S>& b2,
                                             const RowSlides<S>& sliding) {
  const PackedVector<S> none = PackedVector<S>::zero();
  row.jt = choose(row.jn > Packed<S>::zero(), row.jt - row.n.dot(row.jt) * row.n, none);
  RowChanges<S> changes;
  rubRight(row, b1, b2, none, sliding, changes);
  row.jt = choose(changes.rubs, row.jt, none);
}
/// What exceeds it slides.
template <Real S>
[[gnu::always_inline]] inline void cutToCone(RowLanes<S>& row, const BodyLanes<S>& b1,
                                             const BodyLanes<S>& b2) {
  const typename Packed<S>::Truth no = Packed<S>::zero() > Packed<S>::zero();
  cutToCone(row, b1, b2, RowSlides<S>{!no, no});
}

/// The impulse j on the second bodies, its opposite on the first.
template <Real S>
[[gnu::always_inline]] inline void push(BodyLanes<S>& b1, BodyLanes<S>& b2, const PackedVector<S>& j) {
  b1.v = b1.v - b1.inverseMass * j;
  b2.v = b2.v + b2.inverseMass * j;
}
/// What its tangential part turns.
template <Real S>
[[gnu::always_inline]] inline void twist(const RowLanes<S>& row, BodyLanes<S>& b1, BodyLanes<S>& b2,
                                         const PackedVector<S>& jt) {
  const PackedVector<S> turn = row.n.cross(jt);
  b1.s = b1.s - (row.c1 * b1.spin) * turn;
  b2.s = b2.s - (row.c2 * b2.spin) * turn;
}

}  // namespace gravel::detail
