#pragma once

/// \file
/// All contacts of a step in the form that solvers work on: compact copies of the bodies (eight Scalars each)
/// and one row a contact. Layouts and user's arrays end here.

#include <gravel/contact/impulse_list.hpp>
#include <gravel/contact/problem_bodies.hpp>
#include <gravel/contact/resting_gap.hpp>

#include <vector>

namespace gravel {

/// The problem of one step.
template <Real S>
class ContactProblem : public detail::ProblemBodies<S> {
  using Base = detail::ProblemBodies<S>;
  using Base::accelerations_;
  using Base::chunk;
  using Base::gatherBodies;
  using Base::restart;
  using Base::sameScales_;
  using Base::speedExponent_;

 public:
  using typename Base::Body;
  using Row = detail::SolverRow<S>;
  using Base::again;
  using Base::bodies;
  using Base::friction;
  using Base::impulseIn;
  using Base::initial;
  using Base::speedIn;
  using Base::watch;

  std::vector<Row> rows;                ///< in the colouring's order
  std::vector<Vector3<S>> slipTargets;  ///< slip after a blow that sticks, by row; empty if zero for all
  std::vector<detail::TurningRow<S>> turning;  ///< by row; empty if nothing resists rolling or spinning
  bool drifting = false;                       ///< any contact whose second side drifts
  bool active = false;                         ///< any contact that approaches faster than it may
  S largestApproach = S(0);  ///< largest change of a normal velocity that a contact asks for
  S wrong_sq = S(0);  ///< if `again`, the largest change of a velocity that a sweep would make, squared
  /// If `again`, rows at rest between bodies that begin as they did were passed over: isPassed().
  bool passes = false;
  std::size_t looks = 0;  ///< at rows, to find `wrong_sq`
  bool kept = false;      ///< said by who solves: the impulses of the last problem are those of this one

  /// Takes up bodies and contacts, and the first guess of the impulses with what it does to the bodies.
  /// \param dt [s] step that these contacts stand for, >= 0
  /// \param last impulses of the last solve by row, zero for those that are new
  /// \param ratio of forces that last: the guess is `ratio` times `last`; 0 for none
  /// \param fresh contacts are others, or elsewhere, than at the last call
  /// \param goesOn the contacts of the last problem, where they were, and `last` is its solution: the guess
  ///        does to velocities what that did, `ratio` times, so that no contact needs to be asked; bodies
  ///        whose masses have changed are guarded against
  /// \param wrongAt(k) is the change, squared, that a sweep would make in row k
  template <ContactBodies B, class WrongAt>
  void gather(const ContactView<S>& contacts, const B& source, const ContactColoring& colouring, const S& dt,
              const ContactSettings<S>& settings, const ContactKinds& kinds,
              const detail::ImpulseList<S>& last, const S& ratio, bool fresh, bool goesOn,
              WrongAt&& wrongAt) {
    friction = kinds.rub || kinds.turn;
    drifting = kinds.drift;
    again = goesOn;
    gatherBodies(source, colouring, ratio);
    fresh = fresh || !sameScales_ || rows.size() != contacts.size();
    last_ = &last;
    ratio_ = ratio;
    kept = false;
    detail::resizeSparingly(rows, contacts.size());
    detail::resizeSparingly(gaps_, contacts.size());
    detail::resizeSparingly(turning, kinds.turn ? contacts.size() : 0);
    slipTargets.assign(friction && (kinds.drift || kinds.spring) ? rows.size() : 0, Vector3<S>::Zero());
    detail::resizeSparingly(rests_, contacts.size());
    detail::resizeSparingly(approaches_, contacts.size());
    passes = again && watch.holds() && sameScales_ && ratio == S(1) && turning.empty() &&
             slipTargets.empty() && !drifting && settings.restitutionThreshold == threshold_;
    threshold_ = settings.restitutionThreshold;
    const auto fillFresh = [&](std::size_t k) {
      const ContactColoring::Row& place = colouring.rows()[k];
      const Contact<S>& contact = contacts[place.contact];
      if (fresh) {
        const Material<S>& material = contacts.material(contact);
        fill(rows[k], contact, material, place);
        gaps_[k] = detail::RestingGap<S>::of(contact);
        if (!turning.empty()) {
          turning[k] =
              detail::turningRow<S>(material, initial[place.slot1].radius, initial[place.slot2].radius,
                                    bodies[place.slot1].spin, bodies[place.slot2].spin);
        }
      }
    };
    const auto take = [&](std::size_t k, Most& most) {
      if (k + lookAhead < contacts.size()) {
        const ContactColoring::Row& later = colouring.rows()[k + lookAhead];
        if (fresh || drifting) {
          detail::prefetch(contacts[later.contact]);
        }
        fetch(later.slot1, later.slot2);
      }
      fillFresh(k);
      approaches_[k] = aim(k, contacts, colouring.rows()[k].contact, dt, settings, last.normal(k) > S(0));
      most += Most{approaches_[k]};
    };
    const auto look = [&](std::size_t k, Most& part) {
      take(k, part);
      repeat(k);
      part += Most{S(0), wrongAt(k), 1};
    };
    Most most = detail::sumOverRows(0, colouring.loneCount(), Most{}, [&](std::size_t k, Most& part) {
      take(k, part);
      if (again) {  // lone rows are solved without a guess
        restart(rows[k].slot1);
        restart(rows[k].slot2);
      }
    });
    if (passes) {
      Most all = most;
      all += detail::sumOverRows(colouring.loneCount(), rows.size(), Most{}, [&](std::size_t k, Most& part) {
        if (isPassed(k, colouring)) {
          fillFresh(k);
          part += Most{approaches_[k]};
        } else {
          look(k, part);
          watch.enterFirst(k, false);
        }
      });
      // They were right to what was enough then: twice what the watch lets pass.
      passes = !(settings.tolerance * all.approach < S(1.8) * watch.still());
      most = passes ? all : most;
    }
    if (again && !passes) {
      most += detail::sumOverRows(colouring.loneCount(), rows.size(), Most{}, look);
    } else if (!again) {
      most += detail::sumOverColours(colouring, Most{}, [&](std::size_t k, Most& part) {
        take(k, part);
        guess(k);
      });
    }
    largestApproach = most.approach;
    wrong_sq = most.wrong_sq;
    looks = most.looks;
    active = largestApproach > S(0);
  }

  /// Brings what a later row needs nearer: rows of a colour jump through bodies and contacts.
  static constexpr std::size_t lookAhead = 8;
  void fetch(std::uint32_t slot1, std::uint32_t slot2) const {
    for (const std::uint32_t slot : {slot1, slot2}) {
      detail::prefetch(bodies[slot]);
      detail::prefetch(initial[slot]);
    }
  }

  /// If the problem `passes`: row k is at rest as in the last problem, between bodies that have hardly moved
  /// since it was right. Its impulse is that of `last`, and the row itself is not up to date.
  bool isPassed(std::size_t k, const ContactColoring& colouring) const;
  /// Brings rows up to date that were passed over, before anything else moves.
  void recall(const ContactColoring& colouring);
  const detail::ImpulseList<S>& last() const { return *last_; }
  /// What the next problem, of the same contacts, goes on from.
  detail::SolvedProblem<S> solved() const;
  /// Puts it back. \param kinds of the contacts
  template <ContactBodies B>
  void resume(const detail::SolvedProblem<S>& all, const B& source, const ContactColoring& colouring,
              const ContactKinds& kinds);

  /// What sweeps begin with in a row: the impulse of the last step again.
  detail::RowGuess<S> firstGuess(std::size_t k) const {
    if (again) {
      const Row& row = rows[k];
      const S mobility = row.stick > S(0) ? S(S(1) / row.tangentialMass) : S(0);
      return {impulseIn(S(ratio_ * last_->normal(k))),
              mobility * impulseIn(Vector3<S>(ratio_ * last_->tangential(k)))};
    }
    const S jn = impulseIn(S(ratio_ * last_->normal(k)));
    return jn > S(0) && !(jn > this->mostGuess_)
               ? detail::guessOf(rows[k], jn, impulseIn(Vector3<S>(ratio_ * last_->tangential(k))))
               : detail::RowGuess<S>{};
  }

 private:
  /// The largest change that a contact asks for, the largest that a sweep would make, squared, and for how
  /// many rows that was found.
  struct Most {
    S approach = S(0);
    S wrong_sq = S(0);
    std::size_t looks = 0;
    Most& operator+=(const Most& other) {
      looks += other.looks;
      approach = std::max<S>(approach, other.approach);
      wrong_sq = std::max<S>(wrong_sq, other.wrong_sq);
      return *this;
    }
  };

  /// What stays while bodies and surfaces stay.
  void fill(Row& row, const Contact<S>& c, const Material<S>& material,
            const ContactColoring::Row& place) const {
    const Body& b1 = bodies[place.slot1];
    const Body& b2 = bodies[place.slot2];
    row.n = c.normal;
    row.slot1 = place.slot1;
    row.slot2 = place.slot2;
    row.contact = place.contact;
    row.impact = false;
    row.c1 = ratio(c.arm1, initial[place.slot1].radius);
    row.c2 = ratio(c.arm2, initial[place.slot2].radius);
    row.normalMass = detail::reciprocal<S>(b1.inverseMass + b2.inverseMass);
    const S mobility =
        b1.inverseMass + b2.inverseMass + row.c1 * row.c1 * b1.spin + row.c2 * row.c2 * b2.spin;
    row.tangentialMass = detail::reciprocal<S>(mobility);
    row.stick = material.staticFriction * mobility;
    row.slide = material.kineticFriction * mobility;
  }

  /// What the present velocities ask for. \return change of the normal velocity
  [[gnu::flatten]] S aim(std::size_t k, const ContactView<S>& contacts, std::uint32_t c, const S& dt,
                         const ContactSettings<S>& settings, bool loaded) {
    Row& row = rows[k];
    row.slides = 0;
    row.sliding = false;
    row.jn = S(0);
    row.u = Vector3<S>::Zero();
    if (!turning.empty()) {
      turning[k].l = turning[k].step = Vector3<S>::Zero();
    }
    const auto& b1 = initial[row.slot1];
    const auto& b2 = initial[row.slot2];
    const S falls = b1.fall + b2.fall;
    const Vector3<S> drift = drifting ? speedIn(contacts.drift(contacts[c])) : Vector3<S>(Vector3<S>::Zero());
    const S drift_n = row.n.dot(drift);
    const S present = detail::normalVelocity(row, b1, b2);
    const S v_n = present + drift_n;
    const S speed = v_n < S(0) ? S(-v_n) : v_n;
    const S allowed = speedIn(gaps_[k].allowedApproach(falls, dt));
    // In a heap at rest relative accelerations vanish, and what a step brings is passed on by the others:
    // there no more than a fall of the step is rest.
    S pull = loaded ? falls : S(0);
    bool fast = speed > speedIn(S(settings.restitutionThreshold + pull * dt));
    if (fast) {
      const S a_n = row.n.dot(Vector3<S>(accelerations_[row.slot2] - accelerations_[row.slot1]));
      pull = std::max<S>(pull, S(2) * (a_n < S(0) ? S(-a_n) : a_n));
      fast = speed > speedIn(S(settings.restitutionThreshold + pull * dt));
    }
    const bool impact = v_n < S(0) && fast && speed > allowed;
    rests_[k] = fast ? RowRest::Not : loaded ? RowRest::Loaded : RowRest::Free;
    row.impact = impact;  // booked otherwise than what rests, by who integrates in time
    const bool parts = v_n > S(0) && fast;
    // Newton's law for every contact that gets an impulse (Moreau 1988): v_n^+ = -e v_n^-. One that parts and
    // is pushed back by others may so come to approach, and bounces in its turn in the next step; to stop it
    // here would make energy: J_n (v_n^- + v_n^+) > 0.
    row.target = S(0);
    if (impact || parts) {
      const Material<S>& material = contacts.material(contacts[c]);
      row.target = S(-restitutionAt(material, detail::scaled<S>(speed, -speedExponent_)) * v_n);
    }
    row.target = impact ? row.target : std::min<S>(row.target, -allowed);
    row.target -= drift_n;
    if (!slipTargets.empty()) {
      Vector3<S>& slipTarget = slipTargets[k];
      slipTarget = drift_n * row.n - drift;
      const S restored = impact ? contacts.material(contacts[c]).tangentialRestitution : S(0);
      if (restored > S(0)) {
        const Vector3<S> slip = detail::slipVelocity(row, b1, b2) - slipTarget;
        slipTarget -= restored * slip;
      }
    }
    return row.target - present;
  }

  /// Begins with the first guess of a row, whose bodies have it already.
  void repeat(std::size_t k);

  /// Begins with the first guess of a row, if there is one.
  [[gnu::flatten]] void guess(std::size_t k) {
    const detail::RowGuess<S> first = firstGuess(k);
    if (!(first.jn > S(0))) {
      return;
    }
    Row& row = rows[k];
    Body& b1 = bodies[row.slot1];
    Body& b2 = bodies[row.slot2];
    row.jn = first.jn;
    Vector3<S> j = row.jn * row.n;
    if (row.stick > S(0)) {
      row.u = first.u;
      const Vector3<S> across = row.tangentialMass * row.u;
      j += across;
      detail::twist(row, b1, b2, across);
    }
    detail::push(b1, b2, j);
    if (!turning.empty()) {
      detail::TurningRow<S>& row2 = turning[k];
      row2.l = resistTurning<S>(impulseIn(Vector3<S>(ratio_ * last_->turning(k))), row.n, row.jn,
                                row2.rolling, row2.spinning);
      detail::turn(row2, b1, b2, row2.l);
    }
  }

  static S ratio(const S& arm, const S& radius) { return radius > S(0) ? arm / radius : S(0); }

  std::vector<detail::RestingGap<S>> gaps_;  ///< by row: sweeps do not look at them
  /// Whether what a row asks for left its restitution out of account, and whether it did so as one that
  /// carried a load before.
  enum class RowRest : std::uint8_t { Not, Free, Loaded };
  std::vector<RowRest> rests_;                    ///< by row
  std::vector<S> approaches_;                     ///< by row: change of the normal velocity that it asks for
  S threshold_ = S(0);                            ///< [m s^-1] of restitution, in the last problem
  const detail::ImpulseList<S>* last_ = nullptr;  ///< while it is solved
  S ratio_ = S(0);
};

}  // namespace gravel

#include <gravel/contact/contact_problem_again.hpp>
