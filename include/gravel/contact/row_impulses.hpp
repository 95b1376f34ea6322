#pragma once

/// \file
/// Friction, and resistance to rolling and spinning, of one row of a ContactProblem while all others stand.

#include <gravel/contact/contact_problem.hpp>

namespace gravel::detail {

template <Real S>
struct RowImpulses {
  using Row = SolverRow<S>;
  using Body = SolverBody<S>;
  static constexpr std::uint8_t patience = 8;

  /// What a sweep did: largest change of a velocity, squared; and products, over mass, of the changes of the
  /// impulses with the whole step since the sweep before, and with themselves.
  struct Progress {
    S change_sq = S(0);
    S along = S(0);
    S size = S(0);
    std::size_t changed = 0;  ///< rows by more than they may
    std::size_t looked = 0;   ///< rows that were not passed over
    Progress& operator+=(const Progress& other) {
      change_sq = std::max<S>(change_sq, other.change_sq);
      along += other.along;
      size += other.size;
      changed += other.changed;
      looked += other.looked;
      return *this;
    }
  };

  /// Friction of a row for its normal impulse. \param step of u, to which its change is added
  /// \return the change of the tangential impulse
  [[gnu::always_inline]] static inline Vector3<S> rubbed(Row& row, const Vector3<S>& slip, Vector3<S>& step,
                                                         Progress& progress) {
    using std::sqrt;
    Vector3<S> u = row.u - slip;
    const S size_sq = u.squaredNorm();
    // A contact that keeps changing its mind between sticking and sliding slides: sweeps must end.
    const S stick = (row.slides < patience ? row.stick : row.slide) * row.jn;
    const bool slides = size_sq > stick * stick;
    if (slides) {
      row.slides = static_cast<std::uint8_t>(row.slides + (row.sliding ? 0U : 1U));
      u *= row.slide * row.jn / S(sqrt(size_sq));
    }
    row.sliding = slides;
    const Vector3<S> du = u - row.u;
    row.u = u;
    step += du;
    const S change_sq = du.squaredNorm();
    progress += {change_sq, row.tangentialMass * du.dot(step), row.tangentialMass * change_sq};
    return row.tangentialMass * du;
  }

  /// The change of a velocity, squared, that a sweep would make in row k now. Resistance to turning left out.
  [[gnu::flatten]] static S wrongAt(const ContactProblem<S>& problem, std::size_t k) {
    Row row = problem.rows[k];
    const Body& b1 = problem.bodies[row.slot1];
    const Body& b2 = problem.bodies[row.slot2];
    const S jn = row.jn;
    const S next = jn + row.normalMass * (row.target - normalVelocity(row, b1, b2));
    row.jn = next > S(0) ? next : S(0);
    const S change = (row.jn - jn) * (b1.inverseMass + b2.inverseMass);
    Progress progress{change * change};
    if (row.stick > S(0) && (row.jn > S(0) || row.u != Vector3<S>::Zero())) {
      Vector3<S> slip = slipVelocity(row, b1, b2);
      if (!problem.slipTargets.empty()) {
        slip -= problem.slipTargets[k];
      }
      Vector3<S> step = Vector3<S>::Zero();
      rubbed(row, slip, step, progress);
    }
    return progress.change_sq;
  }

  static Progress rub(ContactProblem<S>& problem, std::size_t k, Body& b1, Body& b2) {
    Row& row = problem.rows[k];
    Vector3<S> slip = slipVelocity(row, b1, b2);
    if (!problem.slipTargets.empty()) {
      slip -= problem.slipTargets[k];
    }
    Progress progress;
    Vector3<S> step = Vector3<S>::Zero();
    const Vector3<S> dj = rubbed(row, slip, step, progress);
    push(b1, b2, dj);
    twist(row, b1, b2, dj);
    return progress;
  }

  /// Resistance to rolling and spinning of a row for its normal impulse.
  static Progress resist(ContactProblem<S>& problem, std::size_t k, Body& b1, Body& b2) {
    TurningRow<S>& row = problem.turning[k];
    if (!(row.mass > S(0))) {
      return {};
    }
    const Vector3<S> l = resistTurning<S>(Vector3<S>(row.l - row.mass * row.rho(b1, b2)), problem.rows[k].n,
                                          problem.rows[k].jn, row.rolling, row.spinning);
    const Vector3<S> dl = l - row.l;
    row.l = l;
    row.step += dl;
    turn(row, b1, b2, dl);
    const Vector3<S> change = dl / row.mass;
    return {change.squaredNorm(), change.dot(row.step), change.dot(dl)};
  }
};

}  // namespace gravel::detail
