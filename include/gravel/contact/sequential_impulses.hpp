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

/// Solver of a ContactProblem. Between sweeps the impulses go on along their last step (Nesterov's momentum,
/// started anew when a sweep turns back: O'Donoghue & Candes 2015, Found. Comput. Math. 15, 715; for contacts
/// Mazhar et al. 2015, ACM Trans. Graph. 34, 32). Without friction the problem is a convex quadratic one and
/// the number of sweeps falls to about its square root: a column of 30 takes 100 in place of 2000. With
/// friction, whose cone follows the normal impulse, full momentum may begin to swing; when the changes have
/// grown to twice their least, it is held at 0.8; and where the least changes so far have not shrunk by a
/// third in thirty-two sweeps, more of them would wander between the many solutions that friction leaves
/// open, and it ends: the next step goes on from there. Sweeps have the last word: results obey the cone.
/// Where the first sweep changes few contacts, as in a heap at rest with some rattlers, the next ones look
/// only at those that have moved since by more than half of what ends the sweeps, and go without momentum,
/// until they have looked at as many contacts as there are. Shares the contacts of a large colour between
/// threads; the same bits for any number of threads. O(contacts) a sweep.
template <Real S>
class SequentialImpulses : private detail::RowImpulses<S> {
  using Base = detail::RowImpulses<S>;
  using Base::resist;
  using Base::rub;
  using Base::rubbed;
  using typename Base::Body;
  using typename Base::Progress;
  using typename Base::Row;

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
    detail::sumOverRows(0, colouring.loneCount(), Progress{},
                        [&](std::size_t k, Progress& /*sum*/) { strike(problem, k); });
    report.looks = colouring.loneCount();
    if (colouring.loneCount() == problem.rows.size()) {
      report.iterations = 1;  // exact
      return report;
    }
    const S rounding = S(8) * Eigen::NumTraits<S>::epsilon();
    const S enough = std::max<S>(settings.tolerance, rounding) * problem.largestApproach;
    const std::size_t count = problem.rows.size() - colouring.loneCount();
    if (problem.again && problem.turning.empty() && !(problem.wrong_sq > enough * enough)) {
      report.iterations = 1;  // one that would change nothing
      report.looks += problem.looks;
      problem.kept = problem.passes;
      problem.watch.setHolds(problem.passes);
      report.residual = sqrt(problem.wrong_sq) / problem.largestApproach;
      return report;
    }
    const bool accelerate = settings.accelerate && settings.maxIterations > 2;
    if (accelerate) {
      begin(problem);
    }
    bool local = problem.passes;
    if (local) {  // only rows that were not passed over are stale
      problem.recall(colouring);
      problem.watch.goOn(enough / S(2));
    } else {
      problem.watch.begin(problem.bodies.size(), problem.rows.size(), S(enough / S(2)));
    }
    bool watched = true;  // all that moves bodies
    detail::SweepMomentum<S> momentum;
    while (true) {
      const Progress now = detail::sumOverColours(colouring, Progress{}, [&](std::size_t k, Progress& sum) {
        if (local) {
          relaxStale(problem, colouring.rows()[k], k, sum);
        } else {
          relaxNext(problem, k, momentum.beta, report.iterations == 0 || !accelerate, sum);
        }
      });
      watched = watched && (local || report.iterations == 0 || !accelerate);
      ++report.iterations;
      report.looks += local ? now.looked : count;
      const S change = sqrt(now.change_sq);
      report.residual = change / problem.largestApproach;
      if (!(change > enough) || report.iterations >= settings.maxIterations) {
        problem.watch.setHolds(watched && !(change > enough));
        return report;
      }
      local = local || (report.iterations == 1 && now.changed < count / few);
      if (local) {
        local = report.looks < 2 * problem.rows.size();
        if (!local && accelerate) {
          steps_.assign(problem.rows.size(), RowStep{});
          begin(problem);
        }
      } else if (accelerate) {
        if (report.iterations == 1) {
          findSteps(problem, colouring.loneCount());
        }
        const S old = momentum.beta;
        if (momentum.stalls(now.along, now.size, problem.friction, report.iterations)) {
          return report;
        }
        coast(problem, old, momentum.beta);
      }
    }
  }

 private:
  static constexpr std::size_t chunk = 512;
  static constexpr std::size_t few = 8;  ///< one contact in so many

  /// Step of a body's velocities from sweep to sweep.
  struct BodyStep {
    Vector3<S> v;
    Vector3<S> s;
    Vector3<S> dv = Vector3<S>::Zero();
    Vector3<S> ds = Vector3<S>::Zero();
  };

  /// Of a row's jn and u, from sweep to sweep.
  struct RowStep {
    S n = S(0);
    Vector3<S> u = Vector3<S>::Zero();
  };

  /// Steps of the first sweep: kept by none that stops there, or goes on with a few rows.
  void findSteps(const ContactProblem<S>& problem, std::size_t loneCount) {
    steps_.resize(problem.rows.size());
    parallelFor(problem.rows.size() - loneCount, chunk, [&](std::size_t i) {
      const std::size_t k = loneCount + i;
      const auto first = problem.firstGuess(k);
      steps_[k] = {S(problem.rows[k].jn - first.jn), Vector3<S>(problem.rows[k].u - first.u)};
    });
  }

  void begin(const ContactProblem<S>& problem) {
    bodySteps_.resize(problem.bodies.size());
    parallelFor(problem.bodies.size(), chunk, [&](std::size_t slot) {
      bodySteps_[slot] = BodyStep{problem.bodies[slot].v, problem.bodies[slot].s};
    });
  }

  /// Velocities follow the impulses beyond their last step: they are linear in the impulses.
  void coast(ContactProblem<S>& problem, const S& old, const S& beta) {
    parallelFor(problem.bodies.size(), chunk, [&](std::size_t slot) {
      BodyStep& step = bodySteps_[slot];
      Body& b = problem.bodies[slot];
      step.dv = old * step.dv + Vector3<S>(b.v - step.v);
      b.v += beta * step.dv;
      step.v = b.v;
      if (problem.friction) {
        step.ds = old * step.ds + Vector3<S>(b.s - step.s);
        b.s += beta * step.ds;
        step.s = b.s;
      }
    });
  }

  /// A contact alone: in two strokes, stop and rebound, so that a head-on blow ends at exactly its target.
  static void strike(ContactProblem<S>& problem, std::size_t k) {
    Row& row = problem.rows[k];
    Body& b1 = problem.bodies[row.slot1];
    Body& b2 = problem.bodies[row.slot2];
    const S v_n = detail::normalVelocity(row, b1, b2);
    if (!(v_n < row.target)) {
      return;
    }
    const S share1 = b1.inverseMass / (b1.inverseMass + b2.inverseMass);
    const S share2 = b2.inverseMass / (b1.inverseMass + b2.inverseMass);
    row.jn = row.normalMass * (row.target - v_n);
    for (const S& dv : {S(-v_n), row.target}) {
      if (share1 > S(0)) {
        b1.v -= (share1 * dv) * row.n;
      }
      if (share2 > S(0)) {
        b2.v += (share2 * dv) * row.n;
      }
    }
    if (row.stick > S(0)) {
      rub(problem, k, b1, b2);
    }
    if (!problem.turning.empty() && problem.turning[k].mass > S(0)) {
      // Friction and resistance act on one spin: in turns, each taking 2/7 or more off what is left.
      const S speed =
          detail::maxAbs(b1.s) + detail::maxAbs(b2.s) + detail::maxAbs(b1.v) + detail::maxAbs(b2.v);
      const S enough = Eigen::NumTraits<S>::epsilon() * speed;
      for (int turn = 0; turn < 200; ++turn) {
        Progress progress = resist(problem, k, b1, b2);
        if (row.stick > S(0)) {
          progress += rub(problem, k, b1, b2);
        }
        if (!(progress.change_sq > enough * enough)) {
          break;
        }
      }
    }
  }

  /// A row in the order of all. \param watched goes without momentum, and others may be passed over
  /// afterwards
  void relaxNext(ContactProblem<S>& problem, std::size_t k, const S& beta, bool watched, Progress& sum) {
    if (k + ContactProblem<S>::lookAhead < problem.rows.size()) {
      const Row& later = problem.rows[k + ContactProblem<S>::lookAhead];
      detail::prefetch(problem.bodies[later.slot1]);
      detail::prefetch(problem.bodies[later.slot2]);
    }
    watched ? relax<true>(problem, k, beta, sum) : relax<false>(problem, k, beta, sum);
  }

  /// A row, unless its ends stand nearly as they did when it was right.
  void relaxStale(ContactProblem<S>& problem, const ContactColoring::Row& ends, std::size_t k,
                  Progress& sum) {
    if (problem.watch.isStale(k, ends.slot1, ends.slot2)) {
      relax<true>(problem, k, S(0), sum);
      ++sum.looked;
    }
  }

  template <bool Watched>
  void relax(ContactProblem<S>& problem, std::size_t k, const S& beta, Progress& sum) {
    problem.friction ? relaxRow<true, Watched>(problem, k, beta, sum)
                     : relaxRow<false, Watched>(problem, k, beta, sum);
  }

  /// First on along the last step (none while it is watched), then to where this contact is right. The normal
  /// impulse leaves the slip as it is, so that both are found from the same velocities.
  template <bool Friction, bool Watched>
  [[gnu::flatten]] void relaxRow(ContactProblem<S>& problem, std::size_t k, const S& beta, Progress& sum) {
    using std::sqrt;
    Row& row = problem.rows[k];
    Body& b1 = problem.bodies[row.slot1];
    Body& b2 = problem.bodies[row.slot2];
    const Vector3<S> v_rel = b2.v - b1.v;
    const S v_n = row.n.dot(v_rel);
    RowStep step;
    if constexpr (!Watched) {
      step = {S(steps_[k].n * beta), Vector3<S>(steps_[k].u * beta)};
    }
    const S jn = row.jn + step.n;
    const S next = jn + row.normalMass * (row.target - v_n);
    row.jn = next > S(0) ? next : S(0);
    const S dj = row.jn - jn;
    step.n += dj;
    Progress progress;
    const S change = dj * (b1.inverseMass + b2.inverseMass);
    progress.change_sq = change * change;
    progress.along = step.n * change;
    progress.size = dj * change;
    Vector3<S> j = dj * row.n;
    S push_t(0);  // |its part across n|, or more
    S turn1(0);
    S turn2(0);
    if constexpr (Friction) {
      if (row.stick > S(0)) {
        if constexpr (!Watched) {
          row.u += step.u;
        }
        if (row.jn > S(0) || row.u != Vector3<S>::Zero()) {
          Vector3<S> slip = v_rel - v_n * row.n - Vector3<S>(row.c1 * b1.s + row.c2 * b2.s).cross(row.n);
          if (!problem.slipTargets.empty()) {
            slip -= problem.slipTargets[k];
          }
          const Vector3<S> dt = rubbed(row, slip, step.u, progress);
          j += dt;
          detail::twist(row, b1, b2, dt);
          if constexpr (Watched) {
            push_t = detail::sumAbs(dt);
            turn1 = row.c1 * b1.spin * push_t;
            turn2 = row.c2 * b2.spin * push_t;
          }
        }
      }
    }
    if (j != Vector3<S>::Zero()) {
      detail::push(b1, b2, j);
    }
    if constexpr (Friction) {
      if (!problem.turning.empty()) {
        problem.turning[k].step *= Watched ? S(0) : beta;
        problem.turning[k].l += problem.turning[k].step;
        const Progress resisted = resist(problem, k, b1, b2);
        if constexpr (Watched) {
          const detail::TurningRow<S>& row2 = problem.turning[k];
          const S l = row2.mass * S(sqrt(resisted.change_sq));
          turn1 += row2.q1 * b1.spin * l;
          turn2 += row2.q2 * b2.spin * l;
        }
        progress += resisted;
      }
    }
    if constexpr (!Watched) {
      steps_[k] = step;
    } else {
      const S push = (dj < S(0) ? S(-dj) : dj) + push_t;
      if (b1.inverseMass > S(0)) {
        problem.watch.move(row.slot1, b1.inverseMass * push + turn1);
      }
      if (b2.inverseMass > S(0)) {
        problem.watch.move(row.slot2, b2.inverseMass * push + turn2);
      }
      problem.watch.enter(k, row.slot1, row.slot2);
      progress.changed = progress.change_sq > problem.watch.still() * problem.watch.still() ? 1 : 0;
    }
    sum += progress;
  }

  std::vector<BodyStep> bodySteps_;
  std::vector<RowStep> steps_;  ///< of sweeps with momentum
};

}  // namespace gravel
