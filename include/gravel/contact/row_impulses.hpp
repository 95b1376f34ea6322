#pragma once

/// \file
/// Friction, and resistance to rolling and spinning, of one row of a ContactProblem while all others stand.

#include <gravel/contact/contact_problem.hpp>

namespace gravel::detail {

template <Real S>
struct RowImpulses {
  using Row = SolverRow<S>;
  using Body = SolverBody<S>;
  using Group = RowGroup<S>;
  using Lanes = RowLanes<S>;

  /// What a sweep did: largest change of a velocity, squared; and the square, over mass, of the changes of
  /// the impulses.
  struct Progress {
    S change_sq = S(0);
    S size = S(0);
    S along = S(0);           ///< the same product of these changes and the steps of the sweep before
    std::size_t changed = 0;  ///< rows by more than they may
    std::size_t looked = 0;   ///< rows that were not passed over
    Progress& operator+=(const Progress& other) {
      change_sq = std::max<S>(change_sq, other.change_sq);
      size += other.size;
      along += other.along;
      changed += other.changed;
      looked += other.looked;
      return *this;
    }
  };

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

  /// Friction of row k alone, for its normal impulse.
  static Progress rub(ContactProblem<S>& problem, const ContactColoring& colouring, std::size_t k) {
    const Group group = Group::from(colouring.rows(), k, k + 1, colouring.staticSlot());
    Lanes row = problem.load(group, true);
    auto b1 = BodyLanes<S>::load(problem.bodies, group.slot1);
    auto b2 = BodyLanes<S>::load(problem.bodies, group.slot2);
    const PackedVector<S> v_rel = b2.v - b1.v;
    RowChanges<S> changes;
    const typename Packed<S>::Truth no = Packed<S>::zero() > Packed<S>::zero();
    const bool tired = problem.marks[k].slides >= RowMark::patience;
    rubRight(row, b1, b2, problem.slipOf(group, slipVelocity(row, v_rel, row.n.dot(v_rel), b1, b2)),
             RowSlides<S>{!no, tired ? !no : no}, changes);
    mark(problem, group, changes, true);
    push(b1, b2, changes.dt);
    twist(row, b1, b2, changes.dt);
    problem.storeImpulses(group, row);
    b1.store(problem.bodies, group.slot1, true);
    b2.store(problem.bodies, group.slot2, true);
    return {changes.du.squaredNorm()[0]};
  }

  /// Resistance to turning of row k alone, for its normal impulse.
  static Progress resist(ContactProblem<S>& problem, const ContactColoring& colouring, std::size_t k) {
    const Group group = Group::from(colouring.rows(), k, k + 1, colouring.staticSlot());
    Lanes row = problem.load(group, true);
    auto b1 = BodyLanes<S>::load(problem.bodies, group.slot1);
    auto b2 = BodyLanes<S>::load(problem.bodies, group.slot2);
    const auto changes = TurningLanes<S>::load(problem.turning, group).resist(row, b1, b2);
    turn(b1, b2, changes);
    problem.storeImpulses(group, row);
    b1.store(problem.bodies, group.slot1, true);
    b2.store(problem.bodies, group.slot2, true);
    return {changes.d_rho.squaredNorm()[0]};
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
