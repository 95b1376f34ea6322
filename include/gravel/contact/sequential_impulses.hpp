#pragma once

/// \file
/// Sequential impulses: projected Gauss-Seidel over the colours of the contacts (Moreau 1988; Jean 1999,
/// Comput. Methods Appl. Mech. Eng. 177, 235; Catto 2005). Each contact in turn gets the impulse that makes
/// it right while the others stand still; the accumulated normal impulse stays >= 0, the accumulated
/// friction, a vector of the tangent plane, within Coulomb's cone.

#include <gravel/contact/contact_energy.hpp>
#include <gravel/contact/row_impulses.hpp>
#include <gravel/contact/sweep_momentum.hpp>

namespace gravel {

/// Solver of a ContactProblem. Between sweeps the impulses go on along their last step, by the share beta of
/// Fletcher & Reeves' conjugate gradients: the square of this sweep's changes over that of the one before,
/// none where they have grown (nonlinear nonsmooth conjugate gradients: Silcowitz, Niebe & Erleben 2010, Vis.
/// Comput. 26, 893). A column of 30 takes some 140 sweeps in place of 2300, and a heavy ball on light ones
/// stands, where sweeps without it pass on only a part of the weight in a step. Rejected: Nesterov's momentum
/// (k/(k + 3), started anew when a sweep turns back), by which stacks of mass ratio 1000 sink 4 times as
/// deep. Sweeps have the last word: results obey the cone. Friction that loads another contact, which then
/// takes load off this one, makes sweeps turn back: of a ball that spins between a floor and a wall each
/// leaves -mu^2 times the error of the one before. Momentum would let that grow. So after a sweep without it
/// that turns back on the step before the next one goes without it, too. If that one turns back as well, to
/// -r of the step, the impulses go back by r/(1 + r) of its own, to the sum of that series (Aitken's
/// extrapolation; between the two, so within the cone). Where the first sweep changes few contacts, as in a
/// heap at rest with some rattlers, the next ones look only at those that have moved since by more than half
/// of what ends the sweeps, and go without momentum, until they have looked at as many contacts as there are.
/// Shares the contacts of a large colour between threads; the same bits for any number of threads.
/// O(contacts) a sweep.
template <Real S>
class SequentialImpulses : private detail::RowImpulses<S> {
  using Base = detail::RowImpulses<S>;
  using Base::mark;
  using Base::resist;
  using Base::rub;
  using Base::watchMoves;
  using typename Base::Body;
  using typename Base::Group;
  using typename Base::Lanes;
  using typename Base::Progress;
  using typename Base::Row;
  using Pack = detail::Packed<S>;
  using Step = typename detail::SweepMomentum<S>::Step;

 public:
  static constexpr const char* name() { return "sequential impulses"; }

  /// Sweeps until the settings are content. `problem.rows` come with their first guess, and `problem.bodies`
  /// with what it does to them.
  /// \return iterations and residual; the caller adds the rest
  ContactReport<S> solve(ContactProblem<S>& problem, const ContactColoring& colouring,
                         const ContactSettings<S>& settings) {
    using std::sqrt;
    ContactReport<S> report;
    problem.watch.setHolds(false);
    detail::sumOverParts(0, colouring.loneCount(), Progress{},
                         [&](std::size_t begin, std::size_t end, Progress& /*sum*/) {
                           for (std::size_t k = begin; k < end; ++k) {
                             strike(problem, colouring, k);
                           }
                         });
    report.looks = colouring.loneCount();
    if (colouring.loneCount() == problem.rows.size()) {
      report.iterations = 1;  // exact
      return report;
    }
    const S rounding = S(8) * Eigen::NumTraits<S>::epsilon();
    const S enough = std::max<S>(settings.tolerance, rounding) * problem.largestApproach;
    const std::size_t count = problem.rows.size() - colouring.loneCount();
    // What is only just content would never become better, and a heap at rest creep by it.
    const S right = enough / S(16);
    if (problem.again && !(problem.wrong_sq > right * right)) {
      report.iterations = 1;  // one that would change nothing
      report.looks += problem.looks;
      problem.kept = problem.passes;
      problem.watch.setHolds(problem.passes);
      report.residual = sqrt(problem.wrong_sq) / problem.largestApproach;
      return report;
    }
    const bool accelerate = settings.accelerate && settings.maxIterations > 2;
    bool local = problem.passes;
    if (local) {  // only rows that were not passed over are stale
      problem.watch.goOn(enough / S(2));
    } else {
      problem.watch.begin(problem.bodies.size(), problem.rows.size(), S(enough / S(2)));
    }
    bool watched = true;  // all that moves bodies
    S beta = S(0);        // what a sweep begins with: this share of the step of the one before
    S before = S(0);      // square of the changes of that
    bool bare = false;    // that one had no share
    while (true) {
      const bool alone = local || report.iterations == 0 || !accelerate;  // without momentum
      const Progress now = sweep(problem, colouring, local, alone, beta);
      watched = watched && alone;
      ++report.iterations;
      report.looks += local ? now.looked : count;
      const S change = sqrt(now.change_sq);
      report.residual = change / problem.largestApproach;
      const bool ends = !(change > enough);
      const bool last = report.iterations >= settings.maxIterations;
      const bool half = report.iterations == settings.maxIterations - settings.maxIterations / 2;
      // A slip that goes back by a share of itself a sweep is many changes long, and will be none. With half
      // of the sweeps gone there is no time to wait for that. See docs/theory-contact.md, "Who slides".
      const S lasts = S(ends ? 32 : 4) * change;
      const bool more = !last && (ends || half) && problem.letSlide(colouring, lasts);
      if (last || (ends && !more)) {
        problem.watch.setHolds(watched && ends);
        momentum_.end();
        return report;
      }
      local = local || (report.iterations == 1 && now.changed < count / few);
      if (local) {
        local = report.looks < 2 * problem.rows.size();
        if (!local && problem.passes) {
          problem.recall(colouring);
          problem.passes = false;
        }
        if (!local && accelerate) {
          momentum_.begin(problem);
        }
      } else if (accelerate && report.iterations == 1) {
        momentum_.begin(problem);
        before = more ? S(0) : now.size;
      } else if (accelerate) {
        const S next = more ? S(0) : shareAfter(now, before, beta, bare);
        bare = !more && beta == S(0);
        beta = next;
        before = more ? S(0) : now.size;
        momentum_.coast(problem, beta);
      }
    }
  }

 private:
  static constexpr std::size_t few = 8;  ///< one contact in so many

  /// The share of a sweep's step with which the next one begins.
  /// \param beta  the sweep's own \param before  square of the changes of the one before
  /// \param bare  that one had no share
  static S shareAfter(const Progress& now, const S& before, const S& beta, bool bare) {
    if (beta < S(0)) {
      return S(0);  // to see whether sweeps still turn back
    }
    if (beta == S(0) && now.along < S(0)) {
      return bare ? S(now.along / (before - now.along)) : S(0);
    }
    // At high mass ratios changes fall by less than their rounding: that is no reason to begin anew.
    return now.size < S(1.001) * before ? std::min<S>(S(1), now.size / before) : S(0);
  }

  /// A contact alone: in two strokes, stop and rebound, so that a head-on blow ends at exactly its target.
  static void strike(ContactProblem<S>& problem, const ContactColoring& colouring, std::size_t k) {
    const Row& row = problem.rows[k];
    Body& b1 = problem.bodies[colouring.rows()[k].slot1];
    Body& b2 = problem.bodies[colouring.rows()[k].slot2];
    const S v_n = detail::normalVelocity(row, b1, b2);
    if (!(v_n < row.target)) {
      return;
    }
    const S share1 = b1.inverseMass / (b1.inverseMass + b2.inverseMass);
    const S share2 = b2.inverseMass / (b1.inverseMass + b2.inverseMass);
    const S jn = detail::reciprocal<S>(detail::normalMobility(b1, b2)) * (row.target - v_n);
    problem.impulses().setPush(k, jn, Vector3<S>::Zero());
    for (const S& dv : {S(-v_n), row.target}) {
      if (share1 > S(0)) {
        b1.v -= (share1 * dv) * row.n;
      }
      if (share2 > S(0)) {
        b2.v += (share2 * dv) * row.n;
      }
    }
    if (row.stick > S(0)) {
      rub(problem, colouring, k);
    }
    if (!problem.turning.empty()) {
      // Friction and resistance act on one spin: in turns, each taking 2/7 or more off what is left.
      const S speed =
          detail::maxAbs(b1.s) + detail::maxAbs(b2.s) + detail::maxAbs(b1.v) + detail::maxAbs(b2.v);
      const S enough = Eigen::NumTraits<S>::epsilon() * speed;
      for (int turn = 0; turn < 200; ++turn) {
        Progress progress = resist(problem, colouring, k);
        if (row.stick > S(0)) {
          progress += rub(problem, colouring, k);
        }
        if (!(progress.change_sq > enough * enough)) {
          break;
        }
      }
    }
  }

  /// Once over all rows, or over those whose ends do not stand nearly as they did when they were right.
  /// \param watched goes without momentum, and rows may be passed over afterwards
  Progress sweep(ContactProblem<S>& problem, const ContactColoring& colouring, bool local, bool watched,
                 const S& beta) {
    return detail::sumOverColourParts(
        colouring, Progress{}, [&](std::size_t begin, std::size_t end, Progress& sum) {
          if (local) {
            const auto stale = [&](std::size_t k) {
              const ContactColoring::Row& ends = colouring.rows()[k];
              return problem.watch.isStale(k, ends.slot1, ends.slot2);
            };
            detail::forGroupsOf<S>(colouring, begin, end, stale, [&](const Group& group) {
              relax<true>(problem, group, S(0), sum);
              sum.looked += group.count;
            });
          } else {
            problem.forGroups(colouring, begin, end, [&](const Group& group) {
              watched ? relax<true>(problem, group, S(0), sum) : relax<false>(problem, group, beta, sum);
            });
          }
        });
  }

  /// First on along the last step (none while it is watched), then to where these contacts are right.
  template <bool Watched>
  [[gnu::flatten]] void relax(ContactProblem<S>& problem, const Group& group, const S& beta, Progress& sum) {
    Lanes row = problem.load(group, !problem.passes);
    auto b1 = detail::BodyLanes<S>::load(problem.bodies, group.slot1);
    auto b2 = detail::BodyLanes<S>::load(problem.bodies, group.slot2);
    Step step, last;
    if constexpr (!Watched) {
      last = momentum_.load(group);
      step = beta * last;
      row.jn = row.jn + step.n;
      row.jt = row.jt + step.t;
      row.l = row.l + step.l;
    }
    const detail::RowChanges<S> changes = problem.change(group, row, b1, b2);
    push(b1, b2, changes.dj * row.n + changes.dt);
    if (problem.friction) {
      if (problem.grips) {
        mark(problem, group, changes, problem.atOnce);
      }
      twist(row, b1, b2, changes.dt);
    }
    detail::TurningChanges<S> turned;
    if (!problem.turning.empty()) {
      turned = detail::TurningLanes<S>::load(problem.turning, group).resist(row, b1, b2);
      turn(b1, b2, turned);
    }
    b1.store(problem.bodies, group.slot1, problem.friction);
    b2.store(problem.bodies, group.slot2, problem.friction);
    problem.storeImpulses(group, row);
    Progress progress;
    const Pack change_sq = largerOf(changes.change_sq(), turned.d_rho.squaredNorm());
    progress.change_sq = change_sq.largest();
    progress.size =
        (changes.dj * changes.approach + changes.dt.dot(changes.du) + turned.dl.dot(turned.d_rho)).sum();
    if constexpr (!Watched) {
      progress.along = (last.n * changes.approach + last.t.dot(changes.du) + last.l.dot(turned.d_rho)).sum();
      momentum_.store(group, step + Step{changes.dj, changes.dt, turned.dl});
    } else {
      const Pack push_t = changes.dt.sumAbs();  // |its part across n|, or more
      const Pack push = sizeOf(changes.dj) + push_t;
      watchMoves(problem, group.slot1, b1,
                 b1.inverseMass * push + row.c1 * b1.spin * push_t + turned.ds1.sumAbs());
      watchMoves(problem, group.slot2, b2,
                 b2.inverseMass * push + row.c2 * b2.spin * push_t + turned.ds2.sumAbs());
      const S still_sq = problem.watch.still() * problem.watch.still();
      for (std::size_t lane = 0; lane < group.count; ++lane) {
        problem.watch.enter(group.row[lane], group.slot1[lane], group.slot2[lane]);
        progress.changed += change_sq[lane] > still_sq ? 1U : 0U;
      }
    }
    sum += progress;
  }

  detail::SweepMomentum<S> momentum_;
};

}  // namespace gravel
