#pragma once

/// \file
/// Members of `ContactProblem` that take contacts up as rows: what their present velocities ask for, and what
/// sweeps begin with.

#include <gravel/contact/contact_problem.hpp>

namespace gravel {

template <Real S>
template <ContactBodies B>
void ContactProblem<S>::gather(const ContactView<S>& contacts, const B& source,
                               const ContactColoring& colouring, const S& dt,
                               const ContactSettings<S>& settings, const ContactKinds& kinds,
                               detail::ImpulseList<S>& impulses, const detail::ImpulseList<S>& last,
                               const S& ratio, bool fresh, bool goesOn, const WayAhead<S>& way) {
  friction = kinds.rub || kinds.turn;
  grips = kinds.grip;
  atOnce = settings.maxIterations < 2 && !(settings.islandTolerance > S(0));
  drifting = kinds.drift;
  again = goesOn;
  this->bend_ = way.bend;
  this->carried_ = way.carried;
  gatherBodies(source, colouring, ratio);
  fresh = fresh || !sameScales_ || rows.size() != contacts.size();
  impulses_ = &impulses;
  last_ = &last;
  ratio_ = ratio;
  step_ = dt;
  bends = way.follows && !way.bend.empty();
  angle_ = way.frame * dt / S(2);
  this->mostLoad_ = detail::highest<S>();
  kept = false;
  detail::resizeSparingly(rows, contacts.size());
  detail::resizeSparingly(marks, contacts.size());
  detail::resizeSparingly(gaps_, contacts.size());
  detail::resizeSparingly(turning, kinds.turn ? contacts.size() : 0);
  const bool slips = friction && (kinds.drift || kinds.spring || bends || (way.follows && this->turns_));
  detail::resizeSparingly(slipTargets, slips ? rows.size() : 0);
  parallelFor(slipTargets.size(), chunk, [&](std::size_t k) { slipTargets[k].setZero(); });
  // A slip is at most of four speeds and spins of three components.
  const S fall = speedIn(S(this->leastFall_ * dt));
  const bool lasts = drifting || S(7) * this->fastest_ > detail::RowBefore<S>::lasting() * fall;
  looksBack = friction && way.kick > S(0) && lasts;
  detail::resizeSparingly(approaches_, contacts.size());
  detail::resizeSparingly(wrongs_, again ? colouring.islandsEnd() : 0);
  passes = again && watch.holds() && sameScales_ && ratio == S(1) && !kinds.spring && !drifting &&
           way.bend.empty() && !this->isScaled() && settings.restitutionThreshold == threshold_ &&
           (turning.empty() || last.turns());
  threshold_ = settings.restitutionThreshold;
  const Taking<B> taking{contacts, source, colouring, dt, settings, fresh, way};
  Taken sum = detail::sumOverParts(
      0, colouring.loneCount(), Taken{}, [&](std::size_t begin, std::size_t end, Taken& part) {
        forGroups(colouring, begin, end, [&](const Group& group) { put(group, take(taking, group, part)); });
        if (again) {  // lone rows are solved without a guess
          release(colouring, begin, end);
        }
      });
  if (passes) {
    if (fresh) {
      fillAll(taking);
    }
    Taken all = sum;
    all += lookAtRows(taking, [&](std::size_t k, Taken& part) {
      if (colouring.isOfLarge(k) && isPassed(k, colouring)) {
        part.needs += Most{approaches_[k], S(0), 0, approaches_[k]};
        marks[k].taken = marks[k].lasts = false;
        return false;
      }
      watch.enterFirst(k, false);
      return true;
    });
    // They were right to what was enough then: twice what the watch lets pass.
    passes = !(settings.tolerance * all.needs.approach < S(1.8) * watch.still());
    if (passes) {
      sum = std::move(all);
    }
  }
  if (again && !passes) {
    sum += lookAtRows(taking, [&](std::size_t k, Taken&) {
      if (k % Group::width == 0) {
        fetch(taking, k + lookAhead);
        fetch(colouring, k + lookAhead);
      }
      return true;
    });
  } else if (!again) {
    sum +=
        detail::sumOverColourParts(colouring, Taken{}, [&](std::size_t begin, std::size_t end, Taken& part) {
          forGroups(colouring, begin, end, [&](const Group& group) {
            fetch(taking, group.row[0] + lookAhead);
            takeWithGuess(taking, group, part);
          });
        });
  }
  earlier.set(rows.size(), std::move(sum.before));
  looksBack = !earlier.empty();
  const Most& most = sum.needs;
  largestApproach = std::max<S>(most.approach, heldAcross(colouring, colouring.islandsEnd(), most.approach));
  wrong_sq = most.wrong_sq;
  looks = most.looks;
  active = most.any > S(0) || heldAcross(colouring, colouring.loneCount(), most.any) > S(0);
  const S stop = std::max<S>(most.any, largestApproach) + speedIn(S(this->mostFall_ * dt));
  this->mostLoad_ = S(100 * static_cast<double>(colouring.bodies().size())) * this->heaviest_ * stop;
}

template <Real S>
template <class B>
inline void ContactProblem<S>::fetch(const Taking<B>& taking, std::size_t k) const {
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

template <Real S>
template <class B>
inline auto ContactProblem<S>::take(const Taking<B>& taking, const Group& group, Taken& sum) -> Lanes {
  const auto b1 = detail::BodyLanes<S>::load(initial, group.slot1);
  const auto b2 = detail::BodyLanes<S>::load(initial, group.slot2);
  Lanes row = taking.fresh ? rowsOf(taking, group, b1.spin, b2.spin) : Lanes::load(rows, group);
  if (taking.fresh && !turning.empty()) {
    fillTurning(taking, group, b1.spin, b2.spin);
  }
  const S any = aim(taking, group, row, b1, b2, sum);
  sum.needs += Most{taking.colouring.isOfLarge(group.row[0]) ? any : S(0), S(0), 0, any};
  return row;
}

template <Real S>
template <class B>
inline auto ContactProblem<S>::rowsOf(const Taking<B>& taking, const Group& group, const Pack& radius1,
                                      const Pack& radius2) -> Lanes {
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

template <Real S>
template <class B>
void ContactProblem<S>::fillTurning(const Taking<B>& taking, const Group& group, const Pack& radius1,
                                    const Pack& radius2) {
  for (std::size_t lane = 0; lane < group.count; ++lane) {
    const bool boundary = group.slot2[lane] == taking.colouring.staticSlot();
    turning[group.row[lane]] = detail::TurningRow<S>::of(
        taking.contacts.material(contactOf(taking, group, lane)), boundary, radius1[lane], radius2[lane]);
  }
}

template <Real S>
template <class B>
inline S ContactProblem<S>::aim(const Taking<B>& taking, const Group& group, Lanes& row,
                                const detail::BodyLanes<S>& b1, const detail::BodyLanes<S>& b2, Taken& sum) {
  const Pack zero = Pack::zero();
  const Pack falls = b1.inverseMass + b2.inverseMass;
  const Pack gap = Pack::of([&](std::size_t lane) { return gaps_[group.row[lane]]; });
  // The radii as the arms have them.
  const Pack radii = row.c1 * b1.spin + row.c2 * b2.spin - gap;
  Pack allowed =
      speedIn(detail::RestingGap<S>::allowedApproach(gap, radii, falls, taking.dt, taking.settings.gapStep));
  const detail::PackedVector<S> v_rel = b2.v - b1.v;
  const Pack present = row.n.dot(v_rel);
  const detail::PackedVector<S> drifts = driftsOf(taking, group);
  const Pack drift = row.n.dot(drifts);
  const Pack v_n = present + drift;
  const Pack speed = sizeOf(v_n);
  const detail::TurningPair<S> turned = turningOf(taking, group, row, b1, b2, drifts);
  detail::PackedVector<S> slip = detail::PackedVector<S>::zero();
  if (taking.way.follows) {
    allowed = allowed + turned.approach;
    slip = turned.slip;
  }
  if (bends) {  // from here on it may be less than none: they part, to be drawn together on the way
    const detail::PackedVector<S> bend = bendOf(taking.colouring, group);
    allowed = allowed + row.n.dot(bend);
    slip = slip - slipByBend(row, bend, b1, b2);
  }
  // In a heap at rest relative accelerations vanish, and what a step brings is passed on by the others:
  // there no more than a fall of the step is rest.
  const Pack load = Pack::of([&](std::size_t lane) { return S(last_->normal(group.row[lane])); });
  const Pack pull = choose(load > zero, falls, zero);
  const Pack threshold = Pack::all(taking.settings.restitutionThreshold) + pull * Pack::all(taking.dt);
  const typename Pack::Truth fast = speed > speedIn(threshold);
  row.target = (bends ? -allowed : smallerOf(zero, -allowed)) - drift;
  for (std::size_t lane = 0; lane < group.count; ++lane) {
    const std::uint32_t k = group.row[lane];
    const RowRest rest = load[lane] > S(0) ? RowRest::Loaded : RowRest::Free;
    marks[k] = detail::RowMark{.taken = true, .rest = turned.counts[lane] ? RowRest::Not : rest};
  }
  if (fast.any()) {
    row.target = Pack::of([&](std::size_t lane) {
      return group.holds(lane) && fast[lane]
                 ? rebound(taking, group, lane, row.n.at(lane), v_n[lane], allowed[lane], pull[lane]) -
                       drift[lane]
                 : row.target[lane];
    });
  }
  const bool slips = !slipTargets.empty() && (drifting || bends || fast.any() || turned.counts.any());
  for (std::size_t lane = 0; lane < group.count && slips; ++lane) {  // of the others they are zero
    aimSlip(taking, group, lane, row, drift[lane], slip.at(lane));
  }
  if (looksBack) {
    lookBack(taking, group, row, b1, b2, present, load, slip, sum);
  }
  const Pack approach = row.target - present;
  S most(0);
  for (std::size_t lane = 0; lane < group.count; ++lane) {
    approaches_[group.row[lane]] = approach[lane];
    most = std::max<S>(most, approach[lane]);
  }
  return most;
}

template <Real S>
template <class B>
S ContactProblem<S>::rebound(const Taking<B>& taking, const Group& group, std::size_t lane,
                             const Vector3<S>& n, const S& v_n, const S& allowed, S pull) {
  const std::uint32_t k = group.row[lane];
  const S speed = detail::sizeOf<S>(v_n);
  const auto between = [&](auto&& at) {
    return S(n.dot(Vector3<S>(at(group.slot2[lane]) - at(group.slot1[lane]))));
  };
  const S a_n = between(
      [&](std::uint32_t slot) { return Base::accelerationOf(taking.source, taking.colouring, slot); });
  const S b_n = between([&](std::uint32_t slot) { return Base::bendAt(taking.colouring, slot); });
  pull = std::max<S>(pull, S(2) * std::max<S>(detail::sizeOf<S>(a_n), detail::sizeOf<S>(a_n + b_n)));
  const S change = detail::sizeOf<S>(taking.contacts.surface(contactOf(taking, group, lane)).driftChange);
  const bool fast =
      speed > speedIn(S(taking.settings.restitutionThreshold + S(2) * change + pull * taking.dt));
  const bool impact = v_n < S(0) && fast && speed > allowed;
  if (fast) {
    marks[k].rest = RowRest::Not;
  }
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
  return impact ? target : allowed < S(0) ? S(-allowed) : std::min<S>(target, -allowed);
}

template <Real S>
inline void ContactProblem<S>::put(const Group& group, const Lanes& row) {
  row.store(rows, group);
  impulses_->store(group, row);
}

template <Real S>
inline void ContactProblem<S>::takeGuess(const Group& group, Lanes& row, const detail::BodyLanes<S>& b1,
                                         const detail::BodyLanes<S>& b2) const {
  using Quad = detail::PackedQuad<S>;
  using Vector = detail::PackedVector<S>;
  const bool turns = !turning.empty() && last_->turns();
  detail::ImpulseList<S>::load(
      group, row, turns, [&](std::size_t) -> const auto& { return *last_; });
  const Pack by = Pack::all(ratio_);
  const Pack zero = Pack::zero();
  const Quad push = this->impulseIn(Quad{by * row.jt.x, by * row.jt.y, by * row.jt.z, by * row.jn});
  row.jt = Vector::of(push);
  row.jn = push.w;
  if (turns) {
    row.l = Vector::of(this->impulseIn(Quad{by * row.l.x, by * row.l.y, by * row.l.z, zero}));
  }
  if (again) {
    row.jt = choose(row.stick > zero, row.jt, Vector::zero());
    return;
  }
  row.jn = choose((row.jn > zero) & (row.jn < Pack::all(this->mostGuess_)), row.jn, zero);
  cutToCone(row, b1, b2);
  if (turns) {
    row.l = detail::TurningLanes<S>::load(turning, group).within(row, row.l);
  }
}

template <Real S>
template <class B>
void ContactProblem<S>::takeWithGuess(const Taking<B>& taking, const Group& group, Taken& sum) {
  Lanes row = take(taking, group, sum);
  recallSlides(group, row);
  auto b1 = detail::BodyLanes<S>::load(bodies, group.slot1);
  auto b2 = detail::BodyLanes<S>::load(bodies, group.slot2);
  takeGuess(group, row, b1, b2);
  pushAll(group, row, turning, b1, b2);
  b1.store(bodies, group.slot1, friction);
  b2.store(bodies, group.slot2, friction);
  put(group, row);
}

}  // namespace gravel
