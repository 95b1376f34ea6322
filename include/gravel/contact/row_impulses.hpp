#pragma once

/// \file
/// Rows of a ContactProblem made right while all others stand.

#include <gravel/contact/sweep_course.hpp>
#include <gravel/contact/sweep_momentum.hpp>

namespace gravel::detail {

template <Real S>
struct RowImpulses {
  using Row = SolverRow<S>;
  using Body = SolverBody<S>;
  using Group = RowGroup<S>;
  using Lanes = RowLanes<S>;

  using Pack = Packed<S>;
  using Progress = SweepProgress<S>;
  using Momentum = SweepMomentum<S>;

  /// How a sweep goes: nothing beside; bodies that move and rows that are right are watched; or on from the
  /// last step, by a share of it.
  enum class Way { Bare, Watched, Coasting };

  /// By lane, what SweepProgress sums up.
  struct Relaxed {
    Pack change_sq, size, along;
  };

  /// First on along the last step, then to where these contacts are right. The largest function of all: it is
  /// there once for each way.
  /// \param all  impulses of all rows are those of this problem
  /// \param share by lane, of the last step
  template <Way way>
  [[gnu::flatten, gnu::noinline]] static Relaxed relax(ContactProblem<S>& problem, const Group& group,
                                                       bool all, Momentum& momentum, const Pack& share) {
    Lanes row = problem.load(group, all);
    auto b1 = BodyLanes<S>::load(problem.bodies, group.slot1);
    auto b2 = BodyLanes<S>::load(problem.bodies, group.slot2);
    typename Momentum::Step step, last;
    if constexpr (way == Way::Coasting) {
      last = momentum.load(group);
      step = share * last;
      row.jn = row.jn + step.n;
      row.jt = row.jt + step.t;
      row.l = row.l + step.l;
    }
    TurningChanges<S> turned;
    const RowChanges<S> changes =
        problem.change(group, row, b1, b2, problem.slidesOf(group, problem.earlier), turned);
    push(b1, b2, changes.dj * row.n + changes.dt);
    if (problem.friction) {
      if (problem.grips) {
        mark(problem, group, changes, problem.atOnce);
      }
      twist(row, b1, b2, changes.dt);
    }
    if (!problem.turning.empty()) {
      turn(b1, b2, turned);
    }
    b1.store(problem.bodies, group.slot1, problem.friction);
    b2.store(problem.bodies, group.slot2, problem.friction);
    problem.storeImpulses(group, row);
    const Pack change_sq = largerOf(changes.change_sq(), turned.d_rho.squaredNorm());
    const Pack size =
        changes.dj * changes.approach + changes.dt.dot(changes.du) + turned.dl.dot(turned.d_rho);
    Pack along = Pack::zero();
    if constexpr (way == Way::Coasting) {
      along = last.n * changes.approach + last.t.dot(changes.du) + last.l.dot(turned.d_rho);
      momentum.store(group, step + typename Momentum::Step{changes.dj, changes.dt, turned.dl});
    }
    if constexpr (way == Way::Watched) {
      const Pack push_t = changes.dt.sumAbs();  // |its part across n|, or more
      const Pack push = sizeOf(changes.dj) + push_t;
      watchMoves(problem, group.slot1, b1,
                 b1.inverseMass * push + row.c1 * b1.spin * push_t + turned.ds1.sumAbs());
      watchMoves(problem, group.slot2, b2,
                 b2.inverseMass * push + row.c2 * b2.spin * push_t + turned.ds2.sumAbs());
      for (std::size_t lane = 0; lane < group.count; ++lane) {
        problem.watch.enter(group.row[lane], group.slot1[lane], group.slot2[lane]);
      }
    }
    return {change_sq, size, along};
  }

  /// Takes down which rows are at the limit of friction now. \param atOnce  that is to slide
  [[gnu::always_inline]] static inline void mark(ContactProblem<S>& problem, const Group& group,
                                                 const RowChanges<S>& changes, bool atOnce) {
    for (std::size_t lane = 0; lane < group.count; ++lane) {
      if (changes.rubs[lane]) {
        RowMark& row = problem.marks[group.row[lane]];
        const bool cut = changes.slides[lane];
        if (atOnce && cut && !row.atLimit && row.slides < RowMark::patience) {
          ++row.slides;
        }
        row.atLimit = cut;
        row.kinetic = row.kinetic && (cut || row.slides >= RowMark::patience);
      }
    }
  }

  /// Friction and resistance to turning of row k alone, for its normal impulse.
  /// \return whether that is all: if not, they are to be taken again, by turns
  static bool rub(ContactProblem<S>& problem, const ContactColoring& colouring, std::size_t k) {
    const Group group = Group::from(colouring.rows(), k, k + 1, colouring.staticSlot());
    Lanes row = problem.load(group, true);
    auto b1 = BodyLanes<S>::load(problem.bodies, group.slot1);
    auto b2 = BodyLanes<S>::load(problem.bodies, group.slot2);
    const PackedVector<S> v_rel = b2.v - b1.v;
    RowChanges<S> changes;
    const typename Packed<S>::Truth no = Packed<S>::zero() > Packed<S>::zero();
    const bool tired = problem.marks[k].slides >= RowMark::patience;
    RowSlides<S> sliding{!no, tired ? !no : no};
    problem.lookBackAt(group, problem.earlier, sliding);
    const auto turned =
        problem.rub(group, row, b1, b2, slipVelocity(row, v_rel, row.n.dot(v_rel), b1, b2), sliding, changes);
    push(b1, b2, changes.dt);
    twist(row, b1, b2, changes.dt);
    turn(b1, b2, turned);
    bool right = true;
    if (!problem.turning.empty() && !turned.right[0]) {
      const S speed = maxAbs(b1.s.at(0)) + maxAbs(b2.s.at(0)) + maxAbs(b1.v.at(0)) + maxAbs(b2.v.at(0));
      const S enough = roundoff<S>() * speed;
      const Pack change_sq = largerOf(changes.du.squaredNorm(), turned.d_rho.squaredNorm());
      right = !(change_sq[0] > enough * enough);
    }
    mark(problem, group, changes, true);
    problem.storeImpulses(group, row);
    b1.store(problem.bodies, group.slot1, true);
    b2.store(problem.bodies, group.slot2, true);
    return right;
  }

  /// Takes down how far bodies were moved at most.
  static void watchMoves(ContactProblem<S>& problem, const typename Group::Index& slots,
                         const BodyLanes<S>& bodies, const Packed<S>& ways) {
    for (std::size_t lane = 0; lane < Group::width; ++lane) {
      if (bodies.inverseMass[lane] > S(0)) {
        problem.watch.move(slots[lane], ways[lane]);
      }
    }
  }
};

}  // namespace gravel::detail
