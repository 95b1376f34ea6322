#pragma once

/// \file
/// What contacts do to the energy, to rounding, and the guard that they never add any.
///
/// From the impulses J and the velocities of contact u before and after them,
///   dT = sum_bodies m (v^+ - v^-).(v^+ + v^-)/2 + the same of spin = sum_contacts J.(u^- + u^+)/2,
/// since what a body got is the sum over its contacts and J.u collects both ends. Exact for any number of
/// simultaneous contacts. Where the second side drifts (a moving wall, the image in a sheared domain), u
/// includes the drift, and -J.drift is the work done by it.

#include <gravel/contact/contact_problem.hpp>

#include <array>
#include <numeric>

namespace gravel {

/// Books the energy of a solved problem. Newton's law of restitution makes energy in some multiple blows with
/// friction (Kane's paradox) and a residual may do so in any; an island of contacts that gained gets all its
/// impulses multiplied by the beta < 1 at which it gains nothing. That keeps momentum, angular momentum and
/// Coulomb's cone.
template <Real S>
class ContactEnergy {
 public:
  /// Guards the energy of `problem` and fills in the losses of the report. O(contacts).
  void settle(ContactProblem<S>& problem, const ContactColoring& colouring,
              std::span<const Contact<S>> contacts, ContactReport<S>& report) {
    Sums sums = losses(problem, contacts);
    if (sums[3] > S(0) && guard(problem, colouring, contacts)) {
      sums = losses(problem, contacts);
    }
    report.restitutionLoss = problem.energyOut(sums[0]);
    report.frictionLoss = problem.energyOut(sums[1]);
    report.driftWork = problem.energyOut(sums[2]);
  }

 private:
  using Row = detail::SolverRow<S>;
  using Body = detail::SolverBody<S>;
  /// Losses along the normal and across it, work of drift, sum of the contacts' terms that are gains.
  using Sums = Eigen::Array<S, 4, 1>;
  static constexpr std::size_t chunk = 2048;

  struct Rates {
    S normal;      ///< J_n v_n
    S tangential;  ///< J_t.v_t
  };

  static Rates power(const ContactProblem<S>& problem, const Row& row, const std::vector<Body>& bodies,
                     const Vector3<S>& drift) {
    const Body& b1 = bodies[row.slot1];
    const Body& b2 = bodies[row.slot2];
    const S v_n = detail::normalVelocity(row, b1, b2) + row.n.dot(drift);
    S across(0);
    if (row.staticFriction > S(0)) {
      across = row.jt.dot(Vector3<S>(detail::slipVelocity(row, b1, b2) + drift));
    }
    if (!problem.turning.empty()) {
      const detail::TurningRow<S>& turning =
          problem.turning[static_cast<std::size_t>(&row - problem.rows.data())];
      across += turning.l.dot(turning.rho(b1, b2));
    }
    return {row.jn * v_n, across};
  }

  static Vector3<S> driftOf(const ContactProblem<S>& problem, std::span<const Contact<S>> contacts,
                            const Row& row) {
    return problem.drifting ? problem.speedIn(contacts[row.contact].drift) : Vector3<S>(Vector3<S>::Zero());
  }

  Sums losses(const ContactProblem<S>& problem, std::span<const Contact<S>> contacts) const {
    return orderedSum(problem.rows.size(), chunk, Sums(Sums::Zero()),
                      [&](std::size_t begin, std::size_t end) {
                        Sums sums = Sums::Zero();
                        for (std::size_t k = begin; k < end; ++k) {
                          const Row& row = problem.rows[k];
                          if (!(row.jn > S(0))) {
                            continue;
                          }
                          const Vector3<S> drift = driftOf(problem, contacts, row);
                          const Rates before = power(problem, row, problem.initial, drift);
                          const Rates after = power(problem, row, problem.bodies, drift);
                          const S normal = (before.normal + after.normal) / S(2);
                          const S tangential = (before.tangential + after.tangential) / S(2);
                          sums[0] -= normal;
                          sums[1] -= tangential;
                          sums[2] -= Vector3<S>(row.jn * row.n + row.jt).dot(drift);
                          sums[3] += std::max<S>(S(0), normal + tangential);
                        }
                        return sums;
                      });
  }

  /// Islands: bodies joined by contacts, immovable ones apart. dT of an island is beta a + beta^2 b under a
  /// common factor beta, a = sum J.u^- and b = sum J.(u^+ - u^-)/2 >= 0: zero at beta = -a/b.
  bool guard(ContactProblem<S>& problem, const ContactColoring& colouring,
             std::span<const Contact<S>> contacts) {
    const std::size_t n = problem.bodies.size();
    parent_.resize(n);
    std::iota(parent_.begin(), parent_.end(), 0U);
    for (const Row& row : problem.rows) {
      if (row.jn > S(0) && colouring.movable(row.slot1) && colouring.movable(row.slot2)) {
        join(row.slot1, row.slot2);
      }
    }
    sums_.assign(n, {S(0), S(0), S(0)});
    for (const Row& row : problem.rows) {
      if (!(row.jn > S(0))) {
        continue;
      }
      const Vector3<S> drift = driftOf(problem, contacts, row);
      const Rates before = power(problem, row, problem.initial, drift);
      const Rates after = power(problem, row, problem.bodies, drift);
      const S a = before.normal + before.tangential;
      const S b = (after.normal + after.tangential - a) / S(2);
      auto& sum = sums_[islandOf(row, colouring)];
      sum[0] += a;
      sum[1] += b;
      sum[2] += (a < S(0) ? S(-a) : a) + (b < S(0) ? S(-b) : b);
    }
    const S rounding = S(8) * Eigen::NumTraits<S>::epsilon();
    bool any = false;
    for (auto& [a, b, size] : sums_) {
      const bool gains = a + b > rounding * size;
      size = !gains ? S(1) : (a < S(0) && b > S(0) ? std::min<S>(S(1), S(-a / b)) : S(0));  // now beta
      any = any || gains;
    }
    if (any) {
      shrink(problem, colouring);
    }
    return any;
  }

  void shrink(ContactProblem<S>& problem, const ContactColoring& colouring) {
    for (Row& row : problem.rows) {
      const S beta = sums_[islandOf(row, colouring)][2];
      if (beta < S(1)) {
        row.jn *= beta;
        row.jt *= beta;
        if (!problem.turning.empty()) {
          problem.turning[static_cast<std::size_t>(&row - problem.rows.data())].l *= beta;
        }
      }
    }
    for (std::uint32_t slot = 0; slot < colouring.bodies().size(); ++slot) {
      const S beta = sums_[find(slot)][2];
      if (beta < S(1) && colouring.movable(slot)) {
        Body& b = problem.bodies[slot];
        const Body& b0 = problem.initial[slot];
        b.v = b0.v + beta * Vector3<S>(b.v - b0.v);
        b.s = b0.s + beta * Vector3<S>(b.s - b0.s);
      }
    }
  }

  std::uint32_t islandOf(const Row& row, const ContactColoring& colouring) {
    return find(colouring.movable(row.slot1) ? row.slot1 : row.slot2);
  }

  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];
      i = parent_[i];
    }
    return i;
  }

  void join(std::uint32_t i, std::uint32_t j) {
    i = find(i);
    j = find(j);
    parent_[std::max(i, j)] = std::min(i, j);  // slots are numbered by ids: the same whatever the indices
  }

  std::vector<std::uint32_t> parent_;
  std::vector<std::array<S, 3>> sums_;
};

}  // namespace gravel
