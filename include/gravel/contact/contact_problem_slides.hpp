#pragma once

/// \file
/// Members of `ContactProblem` that make rows right, know which of them slide, and what slip is to vanish.
///
/// Where a contact has more friction at rest than in a slide, Coulomb's law leaves several solutions open:
/// one that slides loads its neighbours, which then may slide, too. Sought is the one in which a contact
/// slides only if it must. So sweeps begin with the static limit in all rows but those that slid in the last
/// solve. When they end, rows at their limit slide: for these sweeps go on with the kinetic limit, until no
/// other row comes to its limit. A row that slides sticks as soon as the static limit allows it. To let rows
/// slide as soon as their friction is cut in a sweep, on the way to forces that would hold them, lets
/// structures part at nine tenths of their load and less (tests/laws/test_structures.cpp).

#include <gravel/contact/contact_problem.hpp>

namespace gravel {

template <Real S>
inline auto ContactProblem<S>::load(const Group& group, bool all) const -> Lanes {
  Lanes row = Lanes::load(rows, group);
  detail::ImpulseList<S>::load(
      group, row, !turning.empty(), [&](std::size_t k) -> const auto& {
        return all || marks[k].taken ? *impulses_ : *last_;
      });
  return row;
}

template <Real S>
inline void ContactProblem<S>::storeImpulses(const Group& group, const Lanes& row) {
  impulses_->store(group, row);
  for (std::size_t lane = 0; lane < group.count; ++lane) {
    marks[group.row[lane]].taken = true;
  }
}

template <Real S>
inline auto ContactProblem<S>::slipOf(const Group& group, const detail::PackedVector<S>& slip) const
    -> detail::PackedVector<S> {
  return slipTargets.empty()
             ? slip
             : slip - vectorsOf([&](std::size_t lane) { return slipTargets[group.row[lane]]; });
}

template <Real S>
template <class Before>
inline detail::RowSlides<S> ContactProblem<S>::slidesOf(const Group& group, Before& before) const {
  const Pack zero = Pack::zero();
  detail::RowSlides<S> slides{zero > zero, zero > zero, Pack::all(this->mostLoad_)};
  lookBackAt(group, before, slides);
  if (grips) {
    const auto of = [&](auto&& is) {
      return Pack::of([&](std::size_t lane) { return S(is(marks[group.row[lane]]) ? 1 : 0); }) > zero;
    };
    slides.kinetic = of([&](const detail::RowMark& m) { return m.kinetic || atOnce; });
    slides.tired = of([](const detail::RowMark& m) { return m.slides >= detail::RowMark::patience; });
  }
  return slides;
}

template <Real S>
inline auto ContactProblem<S>::wrongAt(const Group& group, const Lanes& present,
                                       const detail::RowSlides<S>& sliding) const -> Pack {
  Lanes row = present;
  const auto b1 = detail::BodyLanes<S>::load(bodies, group.slot1);
  const auto b2 = detail::BodyLanes<S>::load(bodies, group.slot2);
  Turned turned;
  const auto changes = change(group, row, b1, b2, sliding, turned);
  const Pack wrong = largerOf(changes.change_sq(), turned.d_rho.squaredNorm());
  if (!grips) {
    return wrong;
  }
  const auto open = changes.slides & !sliding.kinetic & (row.stick > row.slide);
  return choose(open, Pack::all(detail::highest<S>()), wrong);
}

template <Real S>
inline auto ContactProblem<S>::change(const Group& group, Lanes& row, const detail::BodyLanes<S>& b1,
                                      const detail::BodyLanes<S>& b2, const detail::RowSlides<S>& sliding,
                                      Turned& turned) const -> detail::RowChanges<S> {
  detail::RowChanges<S> changes;
  const detail::PackedVector<S> v_rel = b2.v - b1.v;
  const Pack v_n = row.n.dot(v_rel);
  pushRight(row, b1, b2, v_n, changes);
  changes.rubs = changes.slides = Pack::zero() > Pack::zero();
  if (friction) {
    turned = rub(group, row, b1, b2, slipVelocity(row, v_rel, v_n, b1, b2), sliding, changes);
  }
  return changes;
}

template <Real S>
inline auto ContactProblem<S>::rub(const Group& group, Lanes& row, const detail::BodyLanes<S>& b1,
                                   const detail::BodyLanes<S>& b2, const detail::PackedVector<S>& slip,
                                   const detail::RowSlides<S>& sliding, detail::RowChanges<S>& changes) const
    -> Turned {
  if (!turning.empty()) {
    const auto lanes = detail::TurningLanes<S>::load(turning, group);
    return lanes.rubAndResist(row, b1, b2, slipOf(group, slip), sliding, changes);
  }
  rubRight(row, b1, b2, slipOf(group, slip), sliding, changes);
  return {};
}

template <Real S>
template <class Ends>
Vector3<S> ContactProblem<S>::slipAt(std::size_t k, const ContactColoring& colouring,
                                     const std::vector<Ends>& of) const {
  const Ends& b1 = of[colouring.rows()[k].slot1];
  const Ends& b2 = of[colouring.rows()[k].slot2];
  const Vector3<S> v_rel = b2.v - b1.v;
  const Vector3<S> slip = detail::slipVelocity(rows[k], v_rel, S(rows[k].n.dot(v_rel)), b1, b2);
  return slipTargets.empty() ? slip : Vector3<S>(slip - slipTargets[k]);
}

template <Real S>
template <class B>
void ContactProblem<S>::aimSlip(const Taking<B>& taking, const Group& group, std::size_t lane,
                                const Lanes& rowLanes, const S& drift_n, const Vector3<S>& turned) {
  const std::uint32_t k = group.row[lane];
  Row row;
  row.n = rowLanes.n.at(lane);
  row.c1 = rowLanes.c1[lane];
  row.c2 = rowLanes.c2[lane];
  Vector3<S>& slipTarget = slipTargets[k];
  slipTarget = turned + drift_n * row.n;
  slipTarget -= drifting ? driftOf(taking, group, lane) : Vector3<S>(Vector3<S>::Zero());
  const Contact<S>& c = contactOf(taking, group, lane);
  const S restored = marks[k].impact ? taking.contacts.material(c).tangentialRestitution : S(0);
  if (restored > S(0)) {
    const auto& b1 = initial[group.slot1[lane]];
    const auto& b2 = initial[group.slot2[lane]];
    const Vector3<S> v_rel = b2.v - b1.v;
    const S v_n = row.n.dot(v_rel);
    const Vector3<S> slip = Vector3<S>(detail::slipVelocity(row, v_rel, v_n, b1, b2)) - slipTarget;
    slipTarget -= restored * slip;
    if (!turning.empty()) {  // and by what the resistance of a blow by itself will make it slip
      const Body& m1 = bodies[group.slot1[lane]];
      const Body& m2 = bodies[group.slot2[lane]];
      const detail::TurningRow<S>& resists = turning[k];
      const S share = detail::reciprocal<S>(detail::normalMobility(m1, m2));
      const auto m = detail::SlipAndTurn<S>::of(S(1), row.c1, resists.q1, S(share * m1.spin), row.c2,
                                                resists.q2, S(share * m2.spin));
      const auto [j, l] = gripImpulses<S>(
          m, slip, Vector3<S>(resists.q2 * b2.s - resists.q1 * b1.s), row.n, S(rowLanes.target[lane] - v_n),
          {rowLanes.stick[lane], rowLanes.slide[lane], resists.rolling, resists.spinning}, restored);
      slipTarget += m.both * l.cross(row.n);
    }
  }
}

template <Real S>
bool ContactProblem<S>::letSlide(std::size_t k, const ContactColoring& colouring, const S& least) {
  detail::RowMark& mark = marks[k];
  const bool begins = mark.taken && mark.atLimit && !mark.kinetic && rows[k].stick > rows[k].slide &&
                      slipAt(k, colouring, bodies).squaredNorm() > least * least;
  if (begins) {
    mark.kinetic = true;
    if (mark.slides < detail::RowMark::patience) {
      ++mark.slides;
    }
  }
  return begins;
}

template <Real S>
bool ContactProblem<S>::letSlide(const ContactColoring& colouring, const S& least) {
  const auto look = [&](std::size_t begin, std::size_t end, std::size_t& count) {
    for (std::size_t k = std::max(begin, colouring.islandsEnd()); k < end; ++k) {
      if (letSlide(k, colouring, least)) {
        watch.enterFirst(k, false);
        ++count;
      }
    }
  };
  return grips && !atOnce && detail::sumOverAllParts(colouring, std::size_t{0}, look) > 0;
}

template <Real S>
bool ContactProblem<S>::slid(std::size_t k, const S& kineticFriction) const {
  const S jn = ratio_ > S(0) ? last_->normal(k) : S(0);
  if (!(jn > S(0)) || !(kineticFriction > S(0))) {
    return false;
  }
  const S limit_sq = kineticFriction * kineticFriction;
  const S off = Vector3<S>(last_->tangential(k) / jn).squaredNorm() - limit_sq;
  return detail::sizeOf<S>(off) <= S(128) * detail::roundoff<S>() * limit_sq;
}

template <Real S>
inline void ContactProblem<S>::recallSlides(const Group& group, const Lanes& row) {
  for (std::size_t lane = 0; lane < group.count && grips; ++lane) {
    const std::uint32_t k = group.row[lane];
    marks[k].kinetic = row.stick[lane] > row.slide[lane] && slid(k, row.slide[lane]);
  }
}

// What friction alone holds, as an arch between two walls, falls along the walls and in step: nothing
// approaches anything, and sweeps still have to begin with the loads, and to end. So the largest slip counts
// that a step's fall gives a contact with a load. A 64th, so that who does approach is solved to what that
// asks for.
template <Real S>
bool ContactProblem<S>::mayHold(const S& approach) const {
  return friction && ratio_ > S(0) && S(32) * approach < speedIn(S(this->mostFall_ * step_));
}

template <Real S>
S ContactProblem<S>::heldAt(std::size_t k, const ContactColoring& colouring) const {
  const S load = marks[k].taken ? impulses_->normal(k) : last_->normal(k);
  if (!(load > S(0)) || !(rows[k].stick > S(0))) {
    return S(0);
  }
  const auto& b1 = initial[colouring.rows()[k].slot1];
  const auto& b2 = initial[colouring.rows()[k].slot2];
  const S slip = detail::safeNorm(slipAt(k, colouring, initial));
  return S(1) / S(64) * std::min<S>(slip, speedIn(S((b1.fall + b2.fall) * step_)));
}

template <Real S>
S ContactProblem<S>::heldAcross(const ContactColoring& colouring, std::size_t k, const S& approach) const {
  S most(0);
  for (; k < rows.size() && mayHold(approach); ++k) {  // the maximum: the order has no say
    most = std::max<S>(most, heldAt(k, colouring));
  }
  return most;
}

template <Real S>
void ContactProblem<S>::release(const ContactColoring& colouring, std::size_t begin, std::size_t end) {
  for (std::size_t k = begin; k < end; ++k) {
    impulses_->set(k, {});
    marks[k].taken = true;
    restart(colouring.rows()[k].slot1);
    restart(colouring.rows()[k].slot2);
  }
}

}  // namespace gravel
