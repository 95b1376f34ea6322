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
    applyGuess(problem, colouring);
    const std::size_t lone = colouring.loneCount();
    eachOf(0, lone, [&](std::size_t k) { return strike(problem, problem.rows[k]); });
    report.iterations = lone > 0 ? 1 : 0;
    if (lone == problem.rows.size()) {
      return report;  // exact
    }
    const S enough = settings.tolerance * problem.largestApproach;
    S change(0);
    int sweep = 0;
    do {
      change = problem.friction ? sweepOnce<true>(problem, colouring) : sweepOnce<false>(problem, colouring);
      ++sweep;
    } while (change > enough && sweep < settings.maxIterations);
    report.iterations = sweep;
    report.residual = problem.largestApproach > S(0) ? change / problem.largestApproach : S(0);
    return report;
  }

 private:
  using Row = detail::SolverRow<S>;
  using Body = detail::SolverBody<S>;
  static constexpr std::size_t chunk = 512;
  static constexpr std::size_t worthThreads = 4 * chunk;
  static constexpr std::uint32_t patience = 3;

  /// Calls f(k) -> change for rows that share no movable body; the largest change.
  template <class F>
  S eachOf(std::size_t begin, std::size_t end, F&& f) {
    S largest(0);
    if (end - begin < worthThreads || threadCount() == 1) {
      for (std::size_t k = begin; k < end; ++k) {
        largest = std::max<S>(largest, f(k));
      }
      return largest;
    }
    changes_.assign((end - begin + chunk - 1) / chunk, S(0));
    parallelForChunks(end - begin, chunk, [&](std::size_t from, std::size_t to) {
      S mine(0);
      for (std::size_t k = begin + from; k < begin + to; ++k) {
        mine = std::max<S>(mine, f(k));
      }
      changes_[from / chunk] = mine;
    });
    return *std::max_element(changes_.begin(), changes_.end());
  }

  template <bool Friction>
  S sweepOnce(ContactProblem<S>& problem, const ContactColoring& colouring) {
    S largest(0);
    const auto relaxRow = [&](std::size_t k) { return relax<Friction>(problem, problem.rows[k]); };
    for (std::size_t c = 0; c < colouring.colours(); ++c) {
      largest = std::max<S>(largest, eachOf(colouring.begin(c), colouring.end(c), relaxRow));
    }
    const std::size_t overflow = colouring.colours();
    for (std::size_t k = colouring.begin(overflow); k < colouring.end(overflow); ++k) {
      largest = std::max<S>(largest, relaxRow(k));
    }
    return largest;
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

  /// First guesses become velocities; rows without one cost a look.
  void applyGuess(ContactProblem<S>& problem, const ContactColoring& colouring) {
    for (std::size_t c = 0; c <= colouring.colours(); ++c) {
      const auto apply = [&](std::size_t k) {
        const Row& row = problem.rows[k];
        if (row.jn > S(0)) {
          Body& b1 = problem.bodies[row.slot1];
          Body& b2 = problem.bodies[row.slot2];
          push(b1, b2, Vector3<S>(row.jn * row.n + row.jt));
          if (problem.friction) {
            twist(row, b1, b2, row.jt);
          }
        }
        return S(0);
      };
      if (c < colouring.colours()) {
        eachOf(colouring.begin(c), colouring.end(c), apply);
      } else {
        for (std::size_t k = colouring.begin(c); k < colouring.end(c); ++k) {
          apply(k);
        }
      }
    }
  }

  /// A contact alone: in two strokes, stop and rebound, so that a head-on blow ends at exactly its target.
  static S strike(ContactProblem<S>& problem, Row& row) {
    Body& b1 = problem.bodies[row.slot1];
    Body& b2 = problem.bodies[row.slot2];
    const S v_n = detail::normalVelocity(row, b1, b2);
    if (!(v_n < row.target)) {
      return S(0);
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
      rub(row, b1, b2);
    }
    return S(0);
  }

  template <bool Friction>
  static S relax(ContactProblem<S>& problem, Row& row) {
    Body& b1 = problem.bodies[row.slot1];
    Body& b2 = problem.bodies[row.slot2];
    const S jn = row.jn + row.normalMass * (row.target - detail::normalVelocity(row, b1, b2));
    const S before = row.jn;
    row.jn = jn > S(0) ? jn : S(0);
    S change(0);
    if (row.jn != before) {
      const S dj = row.jn - before;
      push(b1, b2, Vector3<S>(dj * row.n));
      change = (dj < S(0) ? S(-dj) : dj) / row.normalMass;
    }
    if constexpr (Friction) {
      if (row.staticFriction > S(0) && (row.jn > S(0) || before > S(0))) {
        change = std::max<S>(change, rub(row, b1, b2));
      }
    }
    return change;
  }

  /// Friction of a row for its normal impulse. \return change of slip
  static S rub(Row& row, Body& b1, Body& b2) {
    const Vector3<S> slip = detail::slipVelocity(row, b1, b2);
    Vector3<S> jt = row.jt - row.tangentialMass * Vector3<S>(slip - row.slipTarget);
    // A contact that keeps changing its mind between sticking and sliding slides: sweeps must end.
    const S stick = (row.slides < patience ? row.staticFriction : row.kineticFriction) * row.jn;
    const S size = detail::safeNorm(jt);
    if (size > stick) {
      const S slide = row.kineticFriction * row.jn;
      row.slides += detail::safeNorm(row.jt) > slide ? 1U : 0U;
      jt *= slide / size;
    }
    const Vector3<S> dj = jt - row.jt;
    row.jt = jt;
    const S change = detail::safeNorm(dj);
    if (!(change > S(0))) {
      return S(0);
    }
    push(b1, b2, dj);
    twist(row, b1, b2, dj);
    return change / row.tangentialMass;
  }

  std::vector<S> changes_;
};

}  // namespace gravel
