#pragma once

/// \file
/// All contacts of a step in the form that solvers work on: compact copies of the bodies (eight Scalars each)
/// and one row a contact. Layouts and user's arrays end here.

#include <gravel/contact/impulse_list.hpp>
#include <gravel/contact/problem_bodies.hpp>
#include <gravel/contact/resting_gap.hpp>
#include <gravel/contact/row_lanes.hpp>

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
  using Pack = detail::Packed<S>;
  using Group = detail::RowGroup<S>;
  using Lanes = detail::RowLanes<S>;
  using Base::again;
  using Base::bodies;
  using Base::friction;
  using Base::impulseIn;
  using Base::initial;
  using Base::speedIn;
  using Base::watch;

  std::vector<Row> rows;                ///< in the colouring's order
  std::vector<detail::RowMark> marks;   ///< by row
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
  /// \param impulses of this problem, to be, by row; as many as there are contacts, of any value
  /// \param last impulses of the last solve by row, zero for those that are new
  /// \param ratio of forces that last: the guess is `ratio` times `last`; 0 for none
  /// \param fresh contacts are others, or elsewhere, than at the last call
  /// \param goesOn the contacts of the last problem, where they were, and `last` is its solution: the guess
  ///        does to velocities what that did, `ratio` times, so that no contact needs to be asked; bodies
  ///        whose masses have changed are guarded against
  template <ContactBodies B>
  void gather(const ContactView<S>& contacts, const B& source, const ContactColoring& colouring, const S& dt,
              const ContactSettings<S>& settings, const ContactKinds& kinds, detail::ImpulseList<S>& impulses,
              const detail::ImpulseList<S>& last, const S& ratio, bool fresh, bool goesOn) {
    friction = kinds.rub || kinds.turn;
    drifting = kinds.drift;
    again = goesOn;
    gatherBodies(source, colouring, ratio);
    fresh = fresh || !sameScales_ || rows.size() != contacts.size();
    impulses_ = &impulses;
    last_ = &last;
    ratio_ = ratio;
    kept = false;
    detail::resizeSparingly(rows, contacts.size());
    detail::resizeSparingly(marks, contacts.size());
    detail::resizeSparingly(gaps_, contacts.size());
    detail::resizeSparingly(turning, kinds.turn ? contacts.size() : 0);
    slipTargets.assign(friction && (kinds.drift || kinds.spring) ? rows.size() : 0, Vector3<S>::Zero());
    detail::resizeSparingly(rests_, contacts.size());
    detail::resizeSparingly(approaches_, contacts.size());
    passes = again && watch.holds() && sameScales_ && ratio == S(1) && turning.empty() &&
             slipTargets.empty() && !drifting && !this->isScaled() &&
             settings.restitutionThreshold == threshold_;
    threshold_ = settings.restitutionThreshold;
    const Taking taking{contacts, colouring, dt, settings, fresh};
    Most most = detail::sumOverParts(
        0, colouring.loneCount(), Most{}, [&](std::size_t begin, std::size_t end, Most& part) {
          forGroups(colouring, begin, end,
                    [&](const Group& group) { put(group, take(taking, group, part)); });
          for (std::size_t k = begin; k < end && again; ++k) {  // lone rows are solved without a guess
            restart(colouring.rows()[k].slot1);
            restart(colouring.rows()[k].slot2);
          }
        });
    if (passes) {
      if (fresh) {
        fillAll(taking);
      }
      Most all = most;
      all += lookAtRows(taking, [&](std::size_t k, Most& part) {
        if (isPassed(k, colouring)) {
          part += Most{approaches_[k]};
          marks[k].taken = false;
          return false;
        }
        watch.enterFirst(k, false);
        return true;
      });
      // They were right to what was enough then: twice what the watch lets pass.
      passes = !(settings.tolerance * all.approach < S(1.8) * watch.still());
      most = passes ? all : most;
    }
    if (again && !passes) {
      most += lookAtRows(taking, [&](std::size_t k, Most&) {
        if (k % Group::width == 0) {
          fetch(taking, k + lookAhead);
          fetch(colouring, k + lookAhead);
        }
        return true;
      });
    } else if (!again) {
      most +=
          detail::sumOverColourParts(colouring, Most{}, [&](std::size_t begin, std::size_t end, Most& part) {
            forGroups(colouring, begin, end, [&](const Group& group) {
              fetch(taking, group.row[0] + lookAhead);
              Lanes row = take(taking, group, part);
              guess(group, row);
              put(group, row);
            });
          });
    }
    largestApproach = most.approach;
    wrong_sq = most.wrong_sq;
    looks = most.looks;
    active = largestApproach > S(0);
  }

  /// Calls f(group) for rows [begin, end), which share no movable body; brings what later ones need nearer.
  template <class F>
  void forGroups(const ContactColoring& colouring, std::size_t begin, std::size_t end, F&& f) const {
    for (std::size_t k = begin; k < end; k += Group::width) {
      fetch(colouring, k + lookAhead);
      f(Group::from(colouring.rows(), k, end, colouring.staticSlot()));
    }
  }

  /// The same for those rows k of which `wanted(k)`.
  template <class Wanted, class F>
  static void forGroupsOf(const ContactColoring& colouring, std::size_t begin, std::size_t end,
                          Wanted&& wanted, F&& f) {
    Group group;
    for (std::size_t k = begin; k < end; ++k) {
      if (wanted(k)) {
        group.add(colouring.rows(), k);
      }
      if (group.count == Group::width || (k + 1 == end && group.count > 0)) {
        group.fill(colouring.staticSlot());
        f(group);
        group.count = 0;
      }
    }
  }

  /// Brings what later rows need nearer: rows of a colour jump through bodies. (Inlined, or a compiler finds
  /// that it does nothing.)
  static constexpr std::size_t lookAhead = 8;
  [[gnu::always_inline]] inline void fetch(const ContactColoring& colouring, std::size_t from) const {
    const std::size_t end = std::min(from + Group::width, colouring.rows().size());
    for (std::size_t k = from; k < end; ++k) {
      for (const std::uint32_t slot : {colouring.rows()[k].slot1, colouring.rows()[k].slot2}) {
        detail::prefetch(bodies[slot]);
      }
      detail::prefetch(rows[k]);
      __builtin_prefetch(impulses_->quad(k));
    }
  }

  /// If the problem `passes`: row k is at rest as in the last problem, between bodies that have hardly moved
  /// since it was right. Its impulse is that of `last`, and the row itself is not up to date.
  bool isPassed(std::size_t k, const ContactColoring& colouring) const;
  /// Takes the impulses of rows that were passed over from the last problem.
  void recall(const ContactColoring& colouring);
  /// Where all rows but the lone ones were passed over: the impulses of these join the others in the list of
  /// the last problem, which changes places with that of this one.
  void keepLast(const ContactColoring& colouring, detail::ImpulseList<S>& last);
  const detail::ImpulseList<S>& impulses() const { return *impulses_; }
  detail::ImpulseList<S>& impulses() { return *impulses_; }
  /// What the next problem, of the same contacts, goes on from.
  detail::SolvedProblem<S> solved() const;
  /// Puts it back. \param kinds of the contacts
  template <ContactBodies B>
  void resume(const detail::SolvedProblem<S>& all, const B& source, const ContactColoring& colouring,
              const ContactKinds& kinds);

  /// Rows with their impulses. \param all  none of them was passed over
  [[gnu::always_inline]] inline Lanes load(const Group& group, bool all) const {
    Lanes row = Lanes::load(rows, group);
    row.setImpulse(detail::PackedQuad<S>::load([&](std::size_t lane) {
      const std::uint32_t k = group.row[lane];
      return all || marks[k].taken ? impulses_->quad(k) : last_->quad(k);
    }));
    return row;
  }
  [[gnu::always_inline]] inline void storeImpulses(const Group& group, const Lanes& row) {
    impulses_->store(group, row.impulse());
    for (std::size_t lane = 0; lane < group.count; ++lane) {
      marks[group.row[lane]].taken = true;
    }
  }

  /// What sweeps begin with in these rows: the impulse of the last step again.
  [[gnu::always_inline]] inline void takeGuess(const Group& group, Lanes& row, const detail::BodyLanes<S>& b1,
                                               const detail::BodyLanes<S>& b2) const {
    row.setImpulse(lastOf(group));
    if (again) {
      row.jt = choose(row.stick > Pack::zero(), row.jt, detail::PackedVector<S>::zero());
      return;
    }
    const Pack zero = Pack::zero();
    row.jn = choose((row.jn > zero) & (row.jn < Pack::all(this->mostGuess_)), row.jn, zero);
    cutToCone(row, b1, b2);
  }

  /// The square of the change that a sweep would make in velocities, at most. Resistance to turning left out.
  [[gnu::always_inline]] inline Pack wrongAt(const Group& group, Lanes row) const {
    return change(group, row, detail::BodyLanes<S>::load(bodies, group.slot1),
                  detail::BodyLanes<S>::load(bodies, group.slot2))
        .change_sq();
  }

  /// Makes these rows right while all others stand. The normal impulse leaves the slip as it is, so that both
  /// are found from the same velocities.
  [[gnu::always_inline]] inline detail::RowChanges<S> change(const Group& group, Lanes& row,
                                                             const detail::BodyLanes<S>& b1,
                                                             const detail::BodyLanes<S>& b2) const {
    detail::RowChanges<S> changes;
    const detail::PackedVector<S> v_rel = b2.v - b1.v;
    const Pack v_n = row.n.dot(v_rel);
    pushRight(row, b1, b2, v_n, changes);
    if (friction) {
      rubRight(row, b1, b2, slipOf(group, slipVelocity(row, v_rel, v_n, b1, b2)), tired(group), changes);
    } else {
      changes.rubs = changes.slides = Pack::zero() > Pack::zero();
    }
    return changes;
  }

  /// The part of this slip that is to vanish.
  [[gnu::always_inline]] inline detail::PackedVector<S> slipOf(const Group& group,
                                                               const detail::PackedVector<S>& slip) const {
    return slipTargets.empty() ? slip : slip - vectorsOf(group, slipTargets);
  }

  [[gnu::always_inline]] inline typename Pack::Truth tired(const Group& group) const {
    const Pack limit = Pack::all(S(detail::RowMark::patience));
    return !(Pack::of([&](std::size_t lane) { return S(marks[group.row[lane]].slides); }) < limit);
  }

 private:
  /// What rows are taken up from.
  struct Taking {
    const ContactView<S>& contacts;
    const ContactColoring& colouring;
    const S& dt;
    const ContactSettings<S>& settings;
    bool fresh;
  };

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
  /// Whether what a row asks for left its restitution out of account, and whether it did so as one that
  /// carried a load before.
  enum class RowRest : std::uint8_t { Not, Free, Loaded };

  /// Takes up those rows but the lone ones of which `wanted(k, most)`, without a guess: their bodies have it.
  template <class Wanted>
  Most lookAtRows(const Taking& taking, Wanted&& wanted) {
    const ContactColoring& colouring = taking.colouring;
    return detail::sumOverParts(colouring.loneCount(), rows.size(), Most{},
                                [&](std::size_t begin, std::size_t end, Most& part) {
                                  forGroupsOf(
                                      colouring, begin, end, [&](std::size_t k) { return wanted(k, part); },
                                      [&](const Group& group) {
                                        Lanes row = take(taking, group, part);
                                        repeat(group, row);
                                        put(group, row);
                                        part += Most{S(0), wrongAt(group, row).largest(), group.count};
                                      });
                                });
  }

  /// By row, in the rows of a group.
  static detail::PackedVector<S> vectorsOf(const Group& group, const std::vector<Vector3<S>>& all) {
    const auto part = [&](Eigen::Index c) {
      return Pack::of([&](std::size_t lane) { return all[group.row[lane]][c]; });
    };
    return {part(0), part(1), part(2)};
  }

  /// The impulses of the last step by `ratio`, tangential and normal, in the problem's units.
  [[gnu::always_inline]] inline detail::PackedQuad<S> lastOf(const Group& group) const {
    detail::PackedQuad<S> past = last_->load(group);
    const Pack by = Pack::all(ratio_);
    return this->impulseIn(detail::PackedQuad<S>{by * past.x, by * past.y, by * past.z, by * past.w});
  }

  /// Takes up rows without an impulse.
  /// Brings nearer what rows from k on are taken up from.
  [[gnu::always_inline]] inline void fetch(const Taking& taking, std::size_t k) const {
    for (const std::size_t end = std::min(k + Group::width, rows.size()); k < end; ++k) {
      __builtin_prefetch(last_->quad(k));
      const ContactColoring::Row& place = taking.colouring.rows()[k];
      if (taking.fresh) {
        detail::prefetch(taking.contacts[place.contact]);
      }
      detail::prefetch(initial[place.slot1]);
      detail::prefetch(initial[place.slot2]);
    }
  }

  [[gnu::always_inline]] inline Lanes take(const Taking& taking, const Group& group, Most& most) {
    const auto b1 = detail::BodyLanes<S>::load(initial, group.slot1);
    const auto b2 = detail::BodyLanes<S>::load(initial, group.slot2);
    Lanes row = taking.fresh ? rowsOf(taking, group, b1.spin, b2.spin) : Lanes::load(rows, group);
    for (std::size_t lane = 0; lane < group.count && taking.fresh && !turning.empty(); ++lane) {
      const Material<S>& material = taking.contacts.material(contactOf(taking, group, lane));
      turning[group.row[lane]] =
          detail::turningRow<S>(material, b1.spin[lane], b2.spin[lane], bodies[group.slot1[lane]].spin,
                                bodies[group.slot2[lane]].spin);
    }
    most += Most{aim(taking, group, row, b1, b2)};
    return row;
  }

  /// All rows but the lone ones after a restart, with the targets they have.
  void fillAll(const Taking& taking) {
    forGroups(taking.colouring, taking.colouring.loneCount(), rows.size(), [&](const Group& group) {
      const Pack radius1 = detail::BodyLanes<S>::load(initial, group.slot1).spin;
      const Pack radius2 = detail::BodyLanes<S>::load(initial, group.slot2).spin;
      Lanes row = rowsOf(taking, group, radius1, radius2);
      row.target = Lanes::load(rows, group).target;
      row.store(rows, group);
    });
  }

  static const Contact<S>& contactOf(const Taking& taking, const Group& group, std::size_t lane) {
    return taking.contacts[taking.colouring.rows()[group.row[lane]].contact];
  }

  /// What stays while bodies and surfaces stay.
  [[gnu::always_inline]] inline Lanes rowsOf(const Taking& taking, const Group& group, const Pack& radius1,
                                             const Pack& radius2) {
    for (std::size_t lane = 0; lane < group.count; ++lane) {
      gaps_[group.row[lane]] = contactOf(taking, group, lane).gap;
    }
    const auto each = [&](auto&& value) {
      return Pack::of([&](std::size_t lane) { return S(value(contactOf(taking, group, lane))); });
    };
    const auto friction1 = [&](auto&& value) {
      return friction ? each([&](const Contact<S>& c) { return value(taking.contacts.material(c)); })
                      : Pack::zero();
    };
    Lanes row;
    row.n = {each([](const auto& c) { return c.normal[0]; }), each([](const auto& c) { return c.normal[1]; }),
             each([](const auto& c) { return c.normal[2]; })};
    row.c1 = reciprocalOf(radius1) * each([](const auto& c) { return c.arm1; });
    row.c2 = reciprocalOf(radius2) * each([](const auto& c) { return c.arm2; });
    row.target = Pack::zero();
    row.stick = friction1([](const auto& m) { return m.staticFriction; });
    row.slide = friction1([](const auto& m) { return m.kineticFriction; });
    return row;
  }

  /// What the present velocities ask for. \param b1,b2 of `initial`: falls and radii in place of inverse
  /// masses and spins
  /// \return the largest change of a normal velocity
  [[gnu::always_inline]] inline S aim(const Taking& taking, const Group& group, Lanes& row,
                                      const detail::BodyLanes<S>& b1, const detail::BodyLanes<S>& b2) {
    const Pack zero = Pack::zero();
    const Pack falls = b1.inverseMass + b2.inverseMass;
    const Pack gap = Pack::of([&](std::size_t lane) { return gaps_[group.row[lane]]; });
    // The radii as the arms have them.
    const Pack radii = row.c1 * b1.spin + row.c2 * b2.spin - gap;
    const Pack allowed = speedIn(detail::RestingGap<S>::allowedApproach(gap, radii, falls, taking.dt));
    const Pack present = row.n.dot(b2.v - b1.v);
    Pack drift = zero;
    if (drifting) {
      drift = Pack::of([&](std::size_t lane) { return S(driftOf(taking, group, lane).dot(row.n.at(lane))); });
    }
    const Pack v_n = present + drift;
    const Pack speed = sizeOf(v_n);
    // In a heap at rest relative accelerations vanish, and what a step brings is passed on by the others:
    // there no more than a fall of the step is rest.
    const Pack load = Pack::of([&](std::size_t lane) { return S(last_->normal(group.row[lane])); });
    const Pack pull = choose(load > zero, falls, zero);
    const Pack threshold = Pack::all(taking.settings.restitutionThreshold) + pull * Pack::all(taking.dt);
    const typename Pack::Truth fast = speed > speedIn(threshold);
    row.target = smallerOf(zero, -allowed) - drift;
    for (std::size_t lane = 0; lane < group.count; ++lane) {
      const std::uint32_t k = group.row[lane];
      marks[k] = {.taken = true};
      rests_[k] = load[lane] > S(0) ? RowRest::Loaded : RowRest::Free;
      if (!turning.empty()) {
        turning[k].l = turning[k].step = Vector3<S>::Zero();
      }
    }
    if (fast.any()) {
      row.target = Pack::of([&](std::size_t lane) {
        return group.holds(lane) && fast[lane]
                   ? rebound(taking, group, lane, row.n.at(lane), v_n[lane], allowed[lane], pull[lane]) -
                         drift[lane]
                   : row.target[lane];
      });
    }
    for (std::size_t lane = 0; lane < group.count && !slipTargets.empty(); ++lane) {
      aimSlip(taking, group, lane, row, drift[lane]);
    }
    const Pack approach = row.target - present;
    S most(0);
    for (std::size_t lane = 0; lane < group.count; ++lane) {
      approaches_[group.row[lane]] = approach[lane];
      most = std::max<S>(most, approach[lane]);
    }
    return most;
  }

  /// Target of a row that may be faster than what rests.
  S rebound(const Taking& taking, const Group& group, std::size_t lane, const Vector3<S>& n, const S& v_n,
            const S& allowed, S pull) {
    const std::uint32_t k = group.row[lane];
    const S speed = detail::sizeOf<S>(v_n);
    const S a_n = n.dot(Vector3<S>(accelerations_[group.slot2[lane]] - accelerations_[group.slot1[lane]]));
    pull = std::max<S>(pull, S(2) * detail::sizeOf<S>(a_n));
    const bool fast = speed > speedIn(S(taking.settings.restitutionThreshold + pull * taking.dt));
    const bool impact = v_n < S(0) && fast && speed > allowed;
    rests_[k] = fast ? RowRest::Not : rests_[k];
    marks[k].impact = impact;  // booked otherwise than what rests, by who integrates in time
    const bool parts = v_n > S(0) && fast;
    // Newton's law for every contact that gets an impulse (Moreau 1988): v_n^+ = -e v_n^-. One that parts and
    // is pushed back by others may so come to approach, and bounces in its turn in the next step; to stop it
    // here would make energy: J_n (v_n^- + v_n^+) > 0.
    S target(0);
    if (impact || parts) {
      const Material<S>& material = taking.contacts.material(contactOf(taking, group, lane));
      target = S(-restitutionAt(material, detail::scaled<S>(speed, -speedExponent_)) * v_n);
    }
    return impact ? target : std::min<S>(target, -allowed);
  }

  Vector3<S> driftOf(const Taking& taking, const Group& group, std::size_t lane) const {
    return speedIn(taking.contacts.drift(contactOf(taking, group, lane)));
  }

  void aimSlip(const Taking& taking, const Group& group, std::size_t lane, const Lanes& rowLanes,
               const S& drift_n) {
    const std::uint32_t k = group.row[lane];
    Row row;
    row.n = rowLanes.n.at(lane);
    row.c1 = rowLanes.c1[lane];
    row.c2 = rowLanes.c2[lane];
    Vector3<S>& slipTarget = slipTargets[k];
    slipTarget = drift_n * row.n;
    slipTarget -= drifting ? driftOf(taking, group, lane) : Vector3<S>(Vector3<S>::Zero());
    const Contact<S>& c = contactOf(taking, group, lane);
    const S restored = marks[k].impact ? taking.contacts.material(c).tangentialRestitution : S(0);
    if (restored > S(0)) {
      const auto& b1 = initial[group.slot1[lane]];
      const auto& b2 = initial[group.slot2[lane]];
      const Vector3<S> v_rel = b2.v - b1.v;
      const Vector3<S> slip = detail::slipVelocity(row, v_rel, S(row.n.dot(v_rel)), b1, b2);
      slipTarget -= restored * Vector3<S>(slip - slipTarget);
    }
  }

  /// Begins with the first guess of rows whose bodies have it already.
  [[gnu::always_inline]] inline void repeat(const Group& group, Lanes& row) {
    takeGuess(group, row, detail::BodyLanes<S>::load(bodies, group.slot1),
              detail::BodyLanes<S>::load(bodies, group.slot2));
    for (std::size_t lane = 0; lane < group.count && !turning.empty(); ++lane) {
      turning[group.row[lane]].l = impulseIn(Vector3<S>(ratio_ * last_->turning(group.row[lane])));
    }
  }

  /// Begins with the first guess of rows.
  [[gnu::always_inline]] inline void guess(const Group& group, Lanes& row) {
    auto b1 = detail::BodyLanes<S>::load(bodies, group.slot1);
    auto b2 = detail::BodyLanes<S>::load(bodies, group.slot2);
    takeGuess(group, row, b1, b2);
    push(b1, b2, row.wholeImpulse());
    twist(row, b1, b2, row.jt);
    b1.store(bodies, group.slot1, friction);
    b2.store(bodies, group.slot2, friction);
    for (std::size_t lane = 0; lane < group.count && !turning.empty(); ++lane) {
      const std::uint32_t k = group.row[lane];
      detail::TurningRow<S>& row2 = turning[k];
      if (row.jn[lane] > S(0)) {
        row2.l = resistTurning<S>(impulseIn(Vector3<S>(ratio_ * last_->turning(k))), row.n.at(lane),
                                  row.jn[lane], row2.rolling, row2.spinning);
        detail::turn(row2, bodies[group.slot1[lane]], bodies[group.slot2[lane]], row2.l);
      }
    }
  }

  /// Rows that were taken up, and their impulses.
  [[gnu::always_inline]] inline void put(const Group& group, const Lanes& row) {
    row.store(rows, group);
    impulses_->store(group, row.impulse());
  }

  std::vector<S> gaps_;                           ///< [m] by row
  std::vector<RowRest> rests_;                    ///< by row
  std::vector<S> approaches_;                     ///< by row: change of the normal velocity that it asks for
  S threshold_ = S(0);                            ///< [m s^-1] of restitution, in the last problem
  detail::ImpulseList<S>* impulses_ = nullptr;    ///< of this problem, in its own units
  const detail::ImpulseList<S>* last_ = nullptr;  ///< while it is solved
  S ratio_ = S(0);
};

}  // namespace gravel

#include <gravel/contact/contact_problem_again.hpp>
