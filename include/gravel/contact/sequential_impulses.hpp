#pragma once

/// \file
/// Sequential impulses: projected Gauss-Seidel over the colours of the contacts (Moreau 1988; Jean 1999,
/// Comput. Methods Appl. Mech. Eng. 177, 235; Catto 2005). Each contact in turn gets the impulse that makes
/// it right while the others stand still; the accumulated normal impulse stays >= 0, the accumulated
/// friction, a vector of the tangent plane, within Coulomb's cone.

#include <gravel/contact/contact_energy.hpp>

namespace gravel {

/// Solver of a ContactProblem. Shares the contacts of a large colour between threads; the same bits for any
/// number of threads. O(contacts) a sweep.
template <Real S>
class SequentialImpulses {
 public:
  static constexpr const char* name() { return "sequential impulses"; }

  /// Sweeps until the settings are content. `problem.rows` come with their first guess in jn and jt.
  /// \return iterations and residual; the caller adds the rest
  ContactReport<S> solve(ContactProblem<S>& problem, const ContactColoring& colouring,
                         const ContactSettings<S>& settings) {
    ContactReport<S> report;
    eachOf(0, colouring.loneCount(), [&](std::size_t k) { return strike(problem, problem.rows[k]); });
    if (colouring.loneCount() == problem.rows.size()) {
      report.iterations = 1;  // exact
      return report;
    }
    everyColour(colouring, [&](std::size_t k) { return applyGuess(problem, problem.rows[k]); });
    const S enough = settings.tolerance * problem.largestApproach;
    const bool friction = problem.friction;
    Progress last;
    S beta(0);
    begin(problem);
    while (true) {
      const Progress now = everyColour(colouring, [&](std::size_t k) {
        Row& row = problem.rows[k];
        return friction ? relax<true>(problem, row, steps_[k], beta)
                        : relax<false>(problem, row, steps_[k], beta);
      });
      ++report.iterations;
      report.residual = now.change / problem.largestApproach;
      if (!(now.change > enough) || report.iterations >= settings.maxIterations) {
        return report;
      }
      // Fletcher & Reeves; a step that did not shrink the change starts anew.
      beta = settings.accelerate && now.size < last.size ? now.size / last.size : S(0);
      last = now;
      if (settings.accelerate) {
        coast(problem, beta);
      }
    }
  }

 private:
  using Row = detail::SolverRow<S>;
  using Body = detail::SolverBody<S>;
  static constexpr std::size_t chunk = 512;
  static constexpr std::uint32_t patience = 8;

  /// What a sweep did: largest change of a velocity, and the sum of the squares of the impulses over mass.
  struct Progress {
    S change = S(0);
    S size = S(0);
    Progress& operator+=(const Progress& other) {
      change = std::max<S>(change, other.change);
      size += other.size;
      return *this;
    }
  };

  /// Last change and search direction of a contact's impulse; and of a body's velocities.
  struct Step {
    S dn = S(0);
    S pn = S(0);
    Vector3<S> dt = Vector3<S>::Zero();
    Vector3<S> pt = Vector3<S>::Zero();
  };
  struct BodyStep {
    Vector3<S> v;
    Vector3<S> s;
    Vector3<S> pv = Vector3<S>::Zero();
    Vector3<S> ps = Vector3<S>::Zero();
  };

  void begin(const ContactProblem<S>& problem) {
    steps_.assign(problem.rows.size(), Step{});
    bodySteps_.resize(problem.bodies.size());
    parallelFor(problem.bodies.size(), 4 * chunk, [&](std::size_t slot) {
      bodySteps_[slot] = BodyStep{problem.bodies[slot].v, problem.bodies[slot].s};
    });
  }

  /// Velocities follow the impulses' step along the search direction: they are linear in the impulses.
  void coast(ContactProblem<S>& problem, const S& beta) {
    parallelFor(problem.bodies.size(), 4 * chunk, [&](std::size_t slot) {
      BodyStep& step = bodySteps_[slot];
      Body& b = problem.bodies[slot];
      const Vector3<S> pv = beta * step.pv;
      const Vector3<S> dv = b.v - step.v;
      b.v += pv;
      step.pv = pv + dv;
      step.v = b.v;
      if (problem.friction) {
        const Vector3<S> ps = beta * step.ps;
        const Vector3<S> ds = b.s - step.s;
        b.s += ps;
        step.ps = ps + ds;
        step.s = b.s;
      }
    });
  }

  /// Calls f(k) for rows that share no movable body; chunks depend on their number alone.
  template <class F>
  Progress eachOf(std::size_t begin, std::size_t end, F&& f) {
    const auto run = [&](std::size_t from, std::size_t to) {
      Progress mine;
      for (std::size_t k = from; k < to; ++k) {
        mine += f(k);
      }
      return mine;
    };
    if (end - begin < 4 * chunk) {  // not worth the threads
      return run(begin, end);
    }
    return orderedSum(end - begin, chunk, Progress{},
                      [&](std::size_t from, std::size_t to) { return run(begin + from, begin + to); });
  }

  template <class F>
  Progress everyColour(const ContactColoring& colouring, F&& f) {
    Progress all;
    for (std::size_t c = 0; c < colouring.colours(); ++c) {
      all += eachOf(colouring.begin(c), colouring.end(c), f);
    }
    const std::size_t overflow = colouring.colours();
    for (std::size_t k = colouring.begin(overflow); k < colouring.end(overflow); ++k) {
      all += f(k);
    }
    return all;
  }

  static void push(Body& b1, Body& b2, const Vector3<S>& j) {
    if (b1.inverseMass > S(0)) {  // immovable bodies are shared between threads: never written
      b1.v -= b1.inverseMass * j;
    }
    if (b2.inverseMass > S(0)) {
      b2.v += b2.inverseMass * j;
    }
  }

  static void twist(const Row& row, Body& b1, Body& b2, const Vector3<S>& j) {
    const Vector3<S> turn = row.n.cross(j);
    if (b1.inverseMass > S(0)) {
      b1.s -= (row.c1 * b1.spin) * turn;
    }
    if (b2.inverseMass > S(0)) {
      b2.s -= (row.c2 * b2.spin) * turn;
    }
  }

  static Progress applyGuess(ContactProblem<S>& problem, const Row& row) {
    if (row.jn > S(0)) {
      Body& b1 = problem.bodies[row.slot1];
      Body& b2 = problem.bodies[row.slot2];
      push(b1, b2, Vector3<S>(row.jn * row.n + row.jt));
      if (problem.friction) {
        twist(row, b1, b2, row.jt);
      }
    }
    return {};
  }

  /// A contact alone: in two strokes, stop and rebound, so that a head-on blow ends at exactly its target.
  static Progress strike(ContactProblem<S>& problem, Row& row) {
    Body& b1 = problem.bodies[row.slot1];
    Body& b2 = problem.bodies[row.slot2];
    const S v_n = detail::normalVelocity(row, b1, b2);
    if (!(v_n < row.target)) {
      return {};
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
    if (row.staticFriction > S(0)) {
      Vector3<S> unused = Vector3<S>::Zero();
      rub(row, b1, b2, unused);
    }
    return {};
  }

  /// First along the search direction of the step before, then to where this contact is right.
  template <bool Friction>
  static Progress relax(ContactProblem<S>& problem, Row& row, Step& step, const S& beta) {
    Body& b1 = problem.bodies[row.slot1];
    Body& b2 = problem.bodies[row.slot2];
    const S jn = row.jn + beta * step.pn;
    step.pn = beta * step.pn + step.dn;
    const S next = jn + row.normalMass * (row.target - detail::normalVelocity(row, b1, b2));
    row.jn = next > S(0) ? next : S(0);
    step.dn = row.jn - jn;
    Progress progress;
    if (step.dn != S(0)) {
      push(b1, b2, Vector3<S>(step.dn * row.n));
      const S change = step.dn / row.normalMass;
      progress.change = change < S(0) ? S(-change) : change;
      progress.size = step.dn * change;
    }
    if constexpr (Friction) {
      if (row.staticFriction > S(0)) {
        const Vector3<S> pt = beta * step.pt;
        row.jt += pt;
        step.pt = pt + step.dt;
        if (row.jn > S(0) || row.jt != Vector3<S>::Zero()) {
          progress += rub(row, b1, b2, step.dt);
        } else {
          step.dt = Vector3<S>::Zero();
        }
      }
    }
    return progress;
  }

  /// Friction of a row for its normal impulse.
  static Progress rub(Row& row, Body& b1, Body& b2, Vector3<S>& dj) {
    const Vector3<S> slip = detail::slipVelocity(row, b1, b2);
    Vector3<S> jt = row.jt - row.tangentialMass * Vector3<S>(slip - row.slipTarget);
    // A contact that keeps changing its mind between sticking and sliding slides: sweeps must end.
    const S stick = (row.slides < patience ? row.staticFriction : row.kineticFriction) * row.jn;
    const S size = detail::safeNorm(jt);
    if (size > stick) {
      row.slides += row.sliding ? 0U : 1U;
      row.sliding = true;
      jt *= row.kineticFriction * row.jn / size;
    } else {
      row.sliding = false;
    }
    dj = jt - row.jt;
    row.jt = jt;
    const S change = detail::safeNorm(dj);
    if (!(change > S(0))) {
      return {};
    }
    push(b1, b2, dj);
    twist(row, b1, b2, dj);
    return {S(change / row.tangentialMass), S(change * change / row.tangentialMass)};
  }

  std::vector<Step> steps_;
  std::vector<BodyStep> bodySteps_;
};

}  // namespace gravel
