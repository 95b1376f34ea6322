#pragma once

/// \file
/// Members of `ContactProblem` for the same contacts once more: which rows need no look, and what a restart
/// puts back.
///
/// A row that is right stays so while its bodies begin where they began and their impulses stay: how far both
/// may have moved since is half of what ended the sweeps, and counts the change of where they begin. What a
/// row asks for must not depend on velocities, so that those with restitution are looked at, those that turn,
/// those that slide, and those whose load has gone.

#include <gravel/contact/contact_problem.hpp>

namespace gravel {

template <Real S>
bool ContactProblem<S>::isPassed(std::size_t k, const ContactColoring& colouring) const {
  const ContactColoring::Row& place = colouring.rows()[k];
  const RowRest rest = marks[k].rest;
  return (rest == RowRest::Free || (rest == RowRest::Loaded && last_->normal(k) > S(0))) &&
         !watch.isStale(k, place.slot1, place.slot2) && !(grips && slid(k, rows[k].slide));
}

template <Real S>
void ContactProblem<S>::recall(const ContactColoring& colouring) {
  detail::forAllParts(colouring, [&](std::size_t begin, std::size_t end) {
    detail::forGroupsOf<S>(
        colouring, begin, end, [&](std::size_t k) { return !marks[k].taken; },
        [&](const Group& group) { storeImpulses(group, load(group, false)); });
  });
}

template <Real S>
template <class B, class Wanted>
auto ContactProblem<S>::lookAtRows(const Taking<B>& taking, Wanted&& wanted) -> Taken {
  const ContactColoring& colouring = taking.colouring;
  return detail::sumOverAllParts(colouring, Taken{}, [&](std::size_t begin, std::size_t end, Taken& part) {
    if (begin < colouring.loneCount()) {
      return;
    }
    detail::forGroupsOf<S>(
        colouring, begin, end, [&](std::size_t k) { return wanted(k, part); },
        [&](const Group& group) { takeAgain(taking, group, part); });
  });
}

template <Real S>
template <class B>
void ContactProblem<S>::takeAgain(const Taking<B>& taking, const Group& group, Taken& sum) {
  Lanes row = take(taking, group, sum);
  recallSlides(group, row);
  takeGuess(group, row, detail::BodyLanes<S>::load(bodies, group.slot1),
            detail::BodyLanes<S>::load(bodies, group.slot2));
  put(group, row);
  const Pack wrong = wrongAt(group, row, slidesOf(group, sum));
  if (taking.colouring.isOfLarge(group.row[0])) {
    sum.needs += Most{S(0), wrong.largest(), group.count};
    return;
  }
  for (std::size_t lane = 0; lane < group.count; ++lane) {
    wrongs_[group.row[lane]] = wrong[lane];
  }
}

template <Real S>
template <class B>
void ContactProblem<S>::fillAll(const Taking<B>& taking) {
  forGroups(taking.colouring, taking.colouring.loneCount(), rows.size(), [&](const Group& group) {
    const Pack radius1 = detail::BodyLanes<S>::load(initial, group.slot1).spin;
    const Pack radius2 = detail::BodyLanes<S>::load(initial, group.slot2).spin;
    Lanes row = rowsOf(taking, group, radius1, radius2);
    row.target = Lanes::load(rows, group).target;
    row.store(rows, group);
    if (!turning.empty()) {
      fillTurning(taking, group, radius1, radius2);
    }
  });
}

template <Real S>
void ContactProblem<S>::keepLast(const ContactColoring& colouring, detail::ImpulseList<S>& last) {
  passes = false;
  if (last_ == impulses_) {
    return;  // they are there
  }
  for (std::size_t k = 0; k < colouring.islandsEnd(); ++k) {
    const ContactImpulse<S> before = last.get(k);
    last.set(k, impulses_->get(k));
    impulses_->set(k, before);
  }
  std::swap(last, *impulses_);
}

template <Real S>
void ContactProblem<S>::end() {
  detail::giveBack(slipTargets);
  earlier.forget();
  if (!watch.holds()) {  // the next one looks at all rows
    watch.end();
    detail::giveBack(approaches_);
  }
}

template <Real S>
detail::SolvedProblem<S> ContactProblem<S>::solved(const ContactColoring& colouring) const {
  detail::SolvedProblem<S> all;
  const int back = -speedExponent_;
  for (std::size_t slot = 0; slot + 1 < bodies.size(); ++slot) {
    all.bodies.push_back({detail::scaled<S>(initial[slot].v, back), detail::scaled<S>(initial[slot].s, back),
                          detail::scaled<S>(bodies[slot].v, back), detail::scaled<S>(bodies[slot].s, back),
                          watch.holds() ? watch.ways()[slot] : S(0)});
  }
  for (std::size_t k = 0; k < rows.size() && watch.holds(); ++k) {
    const S then = k < colouring.islandsEnd() ? S(0) : watch.then()[k];  // those before are not watched
    all.rows.push_back({then, approaches_[k], rows[k].target, S(static_cast<int>(marks[k].rest))});
  }
  all.still = watch.holds() ? watch.still() : S(0);
  all.threshold = threshold_;
  return all;
}

template <Real S>
template <ContactBodies B>
void ContactProblem<S>::resume(const detail::SolvedProblem<S>& all, const B& source,
                               const ContactColoring& colouring, const ContactKinds& kinds) {
  friction = kinds.rub || kinds.turn;
  again = false;
  this->bend_ = {};
  this->carried_ = {};
  gatherBodies(source, colouring, S(0));
  std::vector<S> ways(bodies.size(), S(0));
  for (std::size_t slot = 0; slot < all.bodies.size(); ++slot) {
    initial[slot].v = speedIn(all.bodies[slot].v0);
    initial[slot].s = speedIn(all.bodies[slot].s0);
    bodies[slot].v = speedIn(all.bodies[slot].v);
    bodies[slot].s = speedIn(all.bodies[slot].s);
    ways[slot] = all.bodies[slot].way;
  }
  rows.resize(all.rows.size());
  marks.assign(all.rows.size(), detail::RowMark{});
  approaches_.resize(all.rows.size());
  std::vector<S> then(all.rows.size());
  for (std::size_t k = 0; k < all.rows.size(); ++k) {
    then[k] = all.rows[k].then;
    approaches_[k] = all.rows[k].approach;
    rows[k].target = all.rows[k].target;
    marks[k].rest = all.rows[k].rest == S(0)   ? RowRest::Not
                    : all.rows[k].rest == S(1) ? RowRest::Free
                                               : RowRest::Loaded;
  }
  watch.restore(all.still, std::move(ways), std::move(then));
  watch.setHolds(!all.rows.empty());
  threshold_ = all.threshold;
}

}  // namespace gravel
