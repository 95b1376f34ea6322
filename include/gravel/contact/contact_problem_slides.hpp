#pragma once

/// \file
/// Members of `ContactProblem` that know which rows slide.
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
inline detail::RowSlides<S> ContactProblem<S>::slidesOf(const Group& group) const {
  const Pack zero = Pack::zero();
  if (!grips) {
    return {zero > zero, zero > zero, Pack::all(this->mostLoad_)};
  }
  const auto of = [&](auto&& is) {
    return Pack::of([&](std::size_t lane) { return S(is(marks[group.row[lane]]) ? 1 : 0); }) > zero;
  };
  return {of([&](const detail::RowMark& m) { return m.kinetic || atOnce; }),
          of([](const detail::RowMark& m) { return m.slides >= detail::RowMark::patience; }),
          Pack::all(this->mostLoad_)};
}

template <Real S>
inline auto ContactProblem<S>::wrongAt(const Group& group, const Lanes& present) const -> Pack {
  Lanes row = present;
  const auto b1 = detail::BodyLanes<S>::load(bodies, group.slot1);
  const auto b2 = detail::BodyLanes<S>::load(bodies, group.slot2);
  const auto changes = change(group, row, b1, b2);
  Pack wrong = changes.change_sq();
  if (!turning.empty()) {
    const auto turned = detail::TurningLanes<S>::load(turning, group).resist(row, b1, b2);
    wrong = largerOf(wrong, turned.d_rho.squaredNorm());
  }
  if (!grips) {
    return wrong;
  }
  const auto open = changes.slides & !slidesOf(group).kinetic & (row.stick > row.slide);
  return choose(open, Pack::all(Eigen::NumTraits<S>::highest()), wrong);
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
bool ContactProblem<S>::letSlide(const ContactColoring& colouring, const S& least) {
  const auto slips = [&](std::size_t k) {
    return slipAt(k, colouring, bodies).squaredNorm() > least * least;
  };
  const auto look = [&](std::size_t begin, std::size_t end, std::size_t& count) {
    for (std::size_t k = std::max(begin, colouring.loneCount()); k < end; ++k) {
      detail::RowMark& mark = marks[k];
      if (mark.taken && mark.atLimit && !mark.kinetic && rows[k].stick > rows[k].slide && slips(k)) {
        mark.kinetic = true;
        if (mark.slides < detail::RowMark::patience) {
          ++mark.slides;
        }
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
  return detail::sizeOf<S>(off) <= S(128) * Eigen::NumTraits<S>::epsilon() * limit_sq;
}

template <Real S>
inline void ContactProblem<S>::recallSlides(const Group& group, const Lanes& row) {
  for (std::size_t lane = 0; lane < group.count && grips; ++lane) {
    const std::uint32_t k = group.row[lane];
    marks[k].kinetic = row.stick[lane] > row.slide[lane] && slid(k, row.slide[lane]);
  }
}

template <Real S>
S ContactProblem<S>::heldAcross(const ContactColoring& colouring, const S& dt, const S& approach) const {
  // What friction alone holds, as an arch between two walls, falls along the walls and in step: nothing
  // approaches anything, and sweeps still have to begin with the loads, and to end. A 64th, so that who does
  // approach is solved to what that asks for.
  const S share = S(1) / S(64);
  const S fall = speedIn(S(this->mostFall_ * dt));
  S most(0);
  if (!friction || !(ratio_ > S(0)) || !(approach < S(2) * share * fall)) {
    return most;
  }
  for (std::size_t k = colouring.loneCount(); k < rows.size(); ++k) {  // the maximum: the order has no say
    const S load = marks[k].taken ? impulses_->normal(k) : last_->normal(k);
    if (load > S(0) && rows[k].stick > S(0)) {
      const auto& b1 = initial[colouring.rows()[k].slot1];
      const auto& b2 = initial[colouring.rows()[k].slot2];
      const S slip = detail::safeNorm(slipAt(k, colouring, initial));
      most = std::max<S>(most, std::min<S>(slip, speedIn(S((b1.fall + b2.fall) * dt))));
    }
  }
  return share * most;
}

}  // namespace gravel
