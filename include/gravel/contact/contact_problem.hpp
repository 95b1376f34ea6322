#pragma once

/// \file
/// All contacts of a step in the form that solvers work on: compact copies of the bodies (eight Scalars each)
/// and one row a contact. Layouts and user's arrays end here.

#include <gravel/contact/contact_coloring.hpp>
#include <gravel/contact/impulse_list.hpp>
#include <gravel/contact/resting_gap.hpp>
#include <gravel/contact/solver_rows.hpp>
#include <gravel/core/parallel.hpp>

#include <vector>

namespace gravel {

/// The problem of one step. Speeds and masses far from 1 are scaled by powers of two, which is exact, so that
/// dust at 1e-310 m/s neither vanishes nor crawls through subnormal arithmetic.
template <Real S>
class ContactProblem {
 public:
  using Body = detail::SolverBody<S>;
  using Row = detail::SolverRow<S>;
  using Scales = detail::ProblemScales<S>;

  std::vector<Body> bodies;                     ///< by slot; the last one is the boundary, at rest
  std::vector<detail::SolverStart<S>> initial;  ///< the same before any impulse
  std::vector<Row> rows;                        ///< in the colouring's order
  std::vector<Vector3<S>> slipTargets;  ///< slip after a blow that sticks, by row; empty if zero for all
  std::vector<detail::TurningRow<S>> turning;  ///< by row; empty if nothing resists rolling or spinning
  bool friction = false;                       ///< any contact where spin matters
  bool drifting = false;                       ///< any contact whose second side drifts
  bool active = false;                         ///< any contact that approaches faster than it may
  S largestApproach = S(0);  ///< largest change of a normal velocity that a contact asks for

  /// Takes up bodies and contacts, and the first guess of the impulses with what it does to the bodies.
  /// \param dt [s] step that these contacts stand for, >= 0
  /// \param last impulses of the last solve by row, zero for those that are new
  /// \param ratio of forces that last: the guess is `ratio` times `last`; 0 for none
  /// \param fresh contacts are others, or elsewhere, than at the last call
  template <ContactBodies B>
  void gather(std::span<const Contact<S>> contacts, const B& source, const ContactColoring& colouring,
              const S& dt, const ContactSettings<S>& settings, const ContactKinds& kinds,
              const detail::ImpulseList<S>& last, const S& ratio, bool fresh) {
    friction = kinds.rub || kinds.turn;
    drifting = kinds.drift;
    const int massExponent = massExponent_;
    gatherBodies(source, colouring);
    fresh = fresh || massExponent != massExponent_ || rows.size() != contacts.size();
    last_ = &last;
    ratio_ = ratio;
    rows.resize(contacts.size());
    gaps_.resize(contacts.size());
    turning.resize(kinds.turn ? contacts.size() : 0);
    slipTargets.assign(friction && (kinds.drift || kinds.spring) ? rows.size() : 0, Vector3<S>::Zero());
    const auto take = [&](std::size_t k, Largest& most) {
      const ContactColoring::Row& place = colouring.rows()[k];
      const Contact<S>& contact = contacts[place.contact];
      if (k + lookAhead < contacts.size()) {
        const ContactColoring::Row& later = colouring.rows()[k + lookAhead];
        if (fresh || drifting) {
          detail::prefetch(contacts[later.contact]);
        }
        fetch(later.slot1, later.slot2);
      }
      if (fresh) {
        fill(rows[k], contact, place, source);
        gaps_[k] = detail::RestingGap<S>::of(contact);
        if (!turning.empty()) {
          const S r2 = contact.second == staticPartner ? S(0) : S(source.radii()[contact.second]);
          turning[k] = detail::turningRow<S>(contact.material, source.radii()[contact.first], r2,
                                             bodies[place.slot1].spin, bodies[place.slot2].spin);
        }
      }
      most += Largest{aim(k, contact, dt, settings, last.normal(k) > S(0))};
    };
    Largest most = detail::sumOverRows(0, colouring.loneCount(), Largest{}, take);
    most += detail::sumOverColours(colouring, Largest{}, [&](std::size_t k, Largest& part) {
      take(k, part);
      guess(k);
    });
    largestApproach = most.value;
    active = largestApproach > S(0);
  }

  /// Writes the velocities of movable bodies back, spins only where they changed.
  template <ContactBodies B>
  void scatter(B& target, const ContactColoring& colouring) const {
    auto&& velocities = target.velocities();
    auto&& spins = target.angularVelocities();
    auto&& radii = target.radii();
    parallelFor(colouring.bodies().size(), chunk, [&](std::size_t slot) {
      const std::uint32_t i = colouring.bodies()[slot];
      if (bodies[slot].v != initial[slot].v) {
        velocities[i] = detail::scaled<S>(bodies[slot].v, -speedExponent_);
      }
      if (friction && bodies[slot].s != initial[slot].s) {
        spins[i] = Vector3<S>(detail::scaled<S>(bodies[slot].s, -speedExponent_) / radii[i]);
      }
    });
  }

  /// Brings what a later row needs nearer: rows of a colour jump through bodies and contacts.
  static constexpr std::size_t lookAhead = 8;
  void fetch(std::uint32_t slot1, std::uint32_t slot2) const {
    for (const std::uint32_t slot : {slot1, slot2}) {
      detail::prefetch(bodies[slot]);
      detail::prefetch(initial[slot]);
    }
  }

  /// What sweeps begin with in a row: the impulse of the last step again.
  detail::RowGuess<S> firstGuess(std::size_t k) const {
    return ratio_ > S(0) && last_->normal(k) > S(0)
               ? detail::guessOf(rows[k], impulseIn(S(ratio_ * last_->normal(k))),
                                 impulseIn(Vector3<S>(ratio_ * last_->tangential(k))))
               : detail::RowGuess<S>{};
  }

  /// Impulses and energies in SI units from those of the scaled problem, and back.
  S impulseOut(const S& j) const { return detail::scaled<S>(j, -speedExponent_ - massExponent_); }
  Vector3<S> impulseOut(const Vector3<S>& j) const {
    return detail::scaled<S>(j, -speedExponent_ - massExponent_);
  }
  S impulseIn(const S& j) const { return detail::scaled<S>(j, speedExponent_ + massExponent_); }
  Vector3<S> impulseIn(const Vector3<S>& j) const {
    return detail::scaled<S>(j, speedExponent_ + massExponent_);
  }
  S energyOut(const S& e) const { return detail::scaled<S>(e, -2 * speedExponent_ - massExponent_); }
  S speedIn(const S& v) const { return detail::scaled<S>(v, speedExponent_); }
  Vector3<S> speedIn(const Vector3<S>& v) const { return detail::scaled<S>(v, speedExponent_); }

 private:
  static constexpr std::size_t chunk = 512;

  struct Largest {
    S value = S(0);
    Largest& operator+=(const Largest& other) {
      value = std::max<S>(value, other.value);
      return *this;
    }
  };

  template <class B>
  void gatherBodies(const B& source, const ContactColoring& colouring) {
    const std::size_t n = colouring.bodies().size();
    bodies.resize(n + 1);
    initial.resize(n + 1);
    accelerations_.resize(n + 1);
    const Scales scales = orderedSum(n, chunk, Scales{}, [&](std::size_t begin, std::size_t end) {
      Scales part;
      for (std::size_t slot = begin; slot < end; ++slot) {
        part += take(source, colouring, slot);
      }
      return part;
    });
    accelerations_[n] = Vector3<S>::Zero();
    initial[n].fall = S(0);
    bodies[n] = Body{Vector3<S>::Zero(), S(0), Vector3<S>::Zero(), S(0)};
    speedExponent_ = detail::scaleExponent<S>(scales.fastest, scales.fastest);
    massExponent_ = detail::scaleExponent<S>(scales.lightest, scales.heaviest);
    parallelFor(n + 1, chunk, [&](std::size_t slot) {
      Body& b = bodies[slot];
      if (speedExponent_ != 0) {
        b.v = detail::scaled<S>(b.v, speedExponent_);
        b.s = detail::scaled<S>(b.s, speedExponent_);
      }
      if (b.inverseMass > S(0)) {
        b.inverseMass = S(1) / detail::scaled<S>(b.inverseMass, massExponent_);
        b.spin *= b.inverseMass;
      }
      initial[slot].v = b.v;
      initial[slot].s = b.s;
    });
  }

  template <class B>
  Scales take(const B& source, const ContactColoring& colouring, std::size_t slot) {
    const std::uint32_t i = colouring.bodies()[slot];
    Body& b = bodies[slot];
    const bool movable = colouring.movable(static_cast<std::uint32_t>(slot));
    const S r = source.radii()[i];
    const S k = source.inertiaFactors()[i];
    b.v = source.velocities()[i];
    b.s =
        friction ? Vector3<S>(r * Vector3<S>(source.angularVelocities()[i])) : Vector3<S>(Vector3<S>::Zero());
    const Vector3<S> a = movable ? Vector3<S>(source.accelerations()[i]) : Vector3<S>(Vector3<S>::Zero());
    accelerations_[slot] = a;
    initial[slot].fall = detail::safeNorm(a);
    b.inverseMass = movable ? S(source.masses()[i]) : S(0);  // the mass, until its scale is known
    b.spin = movable && r > S(0) && k > S(0) ? S(1) / k : S(0);
    return {std::max<S>(detail::maxAbs(b.v), detail::maxAbs(b.s)), b.inverseMass, b.inverseMass};
  }

  /// What stays while bodies and surfaces stay.
  template <class B>
  void fill(Row& row, const Contact<S>& c, const ContactColoring::Row& place, const B& source) const {
    const Body& b1 = bodies[place.slot1];
    const Body& b2 = bodies[place.slot2];
    row.n = c.normal;
    row.slot1 = place.slot1;
    row.slot2 = place.slot2;
    row.contact = place.contact;
    row.c1 = ratio(c.arm1, source.radii()[c.first]);
    row.c2 = c.second == staticPartner ? S(0) : ratio(c.arm2, source.radii()[c.second]);
    row.normalMass = detail::reciprocal<S>(b1.inverseMass + b2.inverseMass);
    const S mobility =
        b1.inverseMass + b2.inverseMass + row.c1 * row.c1 * b1.spin + row.c2 * row.c2 * b2.spin;
    row.tangentialMass = detail::reciprocal<S>(mobility);
    row.stick = c.material.staticFriction * mobility;
    row.slide = c.material.kineticFriction * mobility;
  }

  /// What the present velocities ask for. \return change of the normal velocity
  [[gnu::flatten]] S aim(std::size_t k, const Contact<S>& c, const S& dt, const ContactSettings<S>& settings,
                         bool loaded) {
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
    const Vector3<S> drift = drifting ? speedIn(c.drift) : Vector3<S>(Vector3<S>::Zero());
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
    row.impact = impact;  // booked otherwise than what rests, by who integrates in time
    const bool parts = v_n > S(0) && fast;
    // Newton's law for every contact that gets an impulse (Moreau 1988): v_n^+ = -e v_n^-. One that parts and
    // is pushed back by others may so come to approach, and bounces in its turn in the next step; to stop it
    // here would make energy: J_n (v_n^- + v_n^+) > 0.
    row.target = impact || parts
                     ? S(-restitutionAt(c.material, detail::scaled<S>(speed, -speedExponent_)) * v_n)
                     : S(0);
    row.target = impact ? row.target : std::min<S>(row.target, -allowed);
    row.target -= drift_n;
    if (!slipTargets.empty()) {
      Vector3<S>& slipTarget = slipTargets[k];
      slipTarget = drift_n * row.n - drift;
      if (impact && c.material.tangentialRestitution > S(0)) {
        const Vector3<S> slip = detail::slipVelocity(row, b1, b2) - slipTarget;
        slipTarget -= c.material.tangentialRestitution * slip;
      }
    }
    return row.target - present;
  }

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

  std::vector<Vector3<S>> accelerations_;         ///< [m s^-2] by slot, zero of what nothing moves
  std::vector<detail::RestingGap<S>> gaps_;       ///< by row: sweeps do not look at them
  const detail::ImpulseList<S>* last_ = nullptr;  ///< while it is solved
  S ratio_ = S(0);
  int speedExponent_ = 0;
  int massExponent_ = 0;
};

}  // namespace gravel
