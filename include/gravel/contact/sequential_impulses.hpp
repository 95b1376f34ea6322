#pragma once

/// \file
/// Sequential impulses: projected Gauss-Seidel over the colours of the contacts (Moreau 1988; Jean 1999,
/// Comput. Methods Appl. Mech. Eng. 177, 235; Catto 2005). Each contact in turn gets the impulse that makes
/// it right while the others stand still; the accumulated normal impulse stays >= 0, the accumulated
/// friction, a vector of the tangent plane, within Coulomb's cone.

#include <gravel/contact/contact_energy.hpp>
#include <gravel/contact/island_sweeps.hpp>

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
  using Base::rub;
  using typename Base::Body;
  using typename Base::Group;
  using typename Base::Progress;
  using typename Base::Row;
  using typename Base::Way;
  using Pack = detail::Packed<S>;

 public:
  static constexpr const char* name() { return "sequential impulses"; }

  /// Sweeps until the settings are content. `problem.rows` come with their first guess, and `problem.bodies`
  /// with what it does to them.
  /// \return iterations and residual; the caller adds the rest
  ContactReport<S> solve(ContactProblem<S>& problem, const ContactColoring& colouring,
                         const ContactSettings<S>& settings) {
    ContactReport<S> report;
    problem.watch.setHolds(false);
    detail::sumOverParts(0, colouring.loneCount(), Progress{},
                         [&](std::size_t begin, std::size_t end, Progress& /*sum*/) {
                           for (std::size_t k = begin; k < end; ++k) {
                             strike(problem, colouring, k);
                           }
                         });
    detail::resizeSparingly(places_, colouring.bundles() > 0 ? problem.bodies.size() : 0);
    detail::IslandReport<S> sum{1, colouring.loneCount()};
    sum += orderedSum<Share::AsFree>(
        colouring.bundles(), 1, detail::IslandReport<S>{}, [&](std::size_t bundle, std::size_t /*next*/) {
          return detail::IslandSweeps<S>(problem, colouring, bundle, settings, places_).solve();
        });
    detail::giveBack(places_);
    if (colouring.islandsEnd() < problem.rows.size()) {
      sum += solveLarge(problem, colouring, settings);
    }
    momentum_.end();
    report.iterations = sum.iterations;
    report.looks = sum.looks;
    report.residual = sum.residual;
    return report;
  }

 private:
  static constexpr std::size_t few = 8;  ///< one contact in so many

  /// All but lone contacts and small islands, together.
  detail::IslandReport<S> solveLarge(ContactProblem<S>& problem, const ContactColoring& colouring,
                                     const ContactSettings<S>& settings) {
    using std::sqrt;
    const std::size_t first = colouring.islandsEnd();
    const std::size_t count = problem.rows.size() - first;
    if (!(problem.largestApproach > S(0))) {
      problem.release(colouring, first, problem.rows.size());
      return {};
    }
    const S rounding = S(8) * detail::roundoff<S>();
    const S enough = std::max<S>(std::max<S>(settings.tolerance, rounding) * problem.largestApproach,
                                 problem.roundingOfSpeeds());
    // What is only just content would never become better, and a heap at rest creep by it.
    const S right = enough / S(16);
    if (problem.again && !(problem.wrong_sq > right * right)) {
      problem.kept = problem.passes;
      problem.watch.setHolds(problem.passes);
      // One that would change nothing.
      return {1, problem.looks, S(sqrt(problem.wrong_sq) / problem.largestApproach)};
    }
    const bool accelerate = settings.accelerate && settings.maxIterations > 2;
    bool local = problem.passes;
    if (local) {  // only rows that were not passed over are stale
      problem.watch.goOn(enough / S(2));
    } else {
      problem.watch.begin(problem.bodies.size(), problem.rows.size(), S(enough / S(2)));
    }
    bool watched = true;  // all that moves bodies
    detail::SweepCourse<S> course(enough, settings.maxIterations);
    std::size_t looks = 0;
    while (true) {
      const bool alone = local || course.sweeps() == 0 || !accelerate;  // without momentum
      const Progress now = sweep(problem, colouring, local, alone, course.share());
      watched = watched && alone;
      looks += local ? now.looked : count;
      const bool more = course.take(now) && problem.letSlide(colouring, course.slides());
      if (!course.goesOn(more)) {
        problem.watch.setHolds(watched && course.isRight());
        return {course.sweeps(), looks, S(course.change() / problem.largestApproach)};
      }
      local = local || (course.sweeps() == 1 && now.changed < count / few);
      if (local) {
        local = looks < 2 * count;
        if (!local && problem.passes) {
          problem.recall(colouring);
          problem.passes = false;
        }
        if (!local && accelerate) {
          momentum_.begin(problem, first);
        }
      } else if (accelerate && course.sweeps() == 1) {
        momentum_.begin(problem, first);
        course.begin(now, more);
      } else if (accelerate) {
        course.goOn(now, more);
        momentum_.coast(problem, course.share());
      }
    }
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
    if (row.stick > S(0) || !problem.turning.empty()) {
      int turns = 0;
      while (!rub(problem, colouring, k) && ++turns < 200) {
      }
    }
  }

  /// Once over the rows of large islands, or over those whose ends do not stand nearly as they did when they
  /// were right.
  /// \param watched goes without momentum, and rows may be passed over afterwards
  Progress sweep(ContactProblem<S>& problem, const ContactColoring& colouring, bool local, bool watched,
                 const S& share) {
    return detail::sumOverLargeParts(
        colouring, Progress{}, [&](std::size_t begin, std::size_t end, Progress& sum) {
          if (local) {
            const auto stale = [&](std::size_t k) {
              const ContactColoring::Row& ends = colouring.rows()[k];
              return problem.watch.isStale(k, ends.slot1, ends.slot2);
            };
            detail::forGroupsOf<S>(colouring, begin, end, stale, [&](const Group& group) {
              relax<Way::Watched>(problem, group, S(0), sum);
              sum.looked += group.count;
            });
          } else {
            problem.forGroups(colouring, begin, end, [&](const Group& group) {
              watched ? relax<Way::Watched>(problem, group, S(0), sum)
                      : relax<Way::Coasting>(problem, group, share, sum);
            });
          }
        });
  }

  template <Way way>
  void relax(ContactProblem<S>& problem, const Group& group, const S& share, Progress& sum) {
    const auto [change_sq, size, along] =
        Base::template relax<way>(problem, group, !problem.passes, momentum_, Pack::all(share));
    Progress progress{change_sq.largest(), size.sum(), along.sum()};
    if constexpr (way == Way::Watched) {
      const S still_sq = problem.watch.still() * problem.watch.still();
      for (std::size_t lane = 0; lane < group.count; ++lane) {
        progress.changed += change_sq[lane] > still_sq ? 1U : 0U;
      }
    }
    sum += progress;
  }

  detail::SweepMomentum<S> momentum_;
  std::vector<std::uint32_t> places_;  ///< of IslandSweeps
};

}  // namespace gravel
