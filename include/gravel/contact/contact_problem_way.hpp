#pragma once

/// \file
/// Members of `ContactProblem` that look at the way that bodies go after the solve, and at that before it.
///
/// In a frame that turns ways are bent: over a drift of length h the distance of a pair changes by
/// h v + b h^2/2, b being the difference of what the frame adds to their accelerations (HillFrame). So the
/// contact is right at the end if the speed along the line of centres is less by n.b h/2, and the mean slip
/// of the drift vanishes if that at its start is less by h/2 of the slip's rate, b_t - w' x n, where the
/// frame turns the spin by w' = -Omega z x w. Without, what rests in a disc parted by (Omega h)^2 of its size
/// in every step and met again in the next one.
///
/// Friction of velocity Verlet in two halves, each of an impulse J(u) that depends on the slip u, is of
/// second order if J is taken at the mean of the slips before and after its half (the implicit rule of the
/// midpoint, which is its own inverse in time). After it alone is of first order where u turns, but finds the
/// end of a slide. So what lasts is taken so, and what a step could stop is not. The slip before is that of
/// the present velocities without the kick.

#include <gravel/contact/contact_problem.hpp>

namespace gravel {

template <Real S>
inline auto ContactProblem<S>::bendOf(const ContactColoring& colouring, const Group& group) const
    -> detail::PackedVector<S> {
  const auto part = [&](Eigen::Index c) {
    return Pack::of([&](std::size_t lane) {
      return S(Base::bendAt(colouring, group.slot2[lane])[c] - Base::bendAt(colouring, group.slot1[lane])[c]);
    });
  };
  const detail::PackedVector<S> bend{part(0), part(1), part(2)};
  return speedIn(Pack::all(S(step_ / S(2)))) * bend;
}

template <Real S>
inline auto ContactProblem<S>::slipByBend(const Lanes& row, const detail::PackedVector<S>& bend,
                                          const detail::BodyLanes<S>& b1,
                                          const detail::BodyLanes<S>& b2) const -> detail::PackedVector<S> {
  const detail::PackedVector<S> along = bend - row.n.dot(bend) * row.n;
  if (!friction) {
    return along;
  }
  const detail::PackedVector<S> w = row.c1 * b1.s + row.c2 * b2.s;
  const Pack angle = Pack::all(angle_);
  const detail::PackedVector<S> turned{angle * w.y, -angle * w.x, Pack::zero()};
  return along - turned.cross(row.n);
}

template <Real S>
template <class B>
inline auto ContactProblem<S>::driftsOf(const Taking<B>& taking, const Group& group) const
    -> detail::PackedVector<S> {
  if (!drifting) {
    return detail::PackedVector<S>::zero();
  }
  const auto part = [&](Eigen::Index c) {
    return Pack::of([&](std::size_t lane) { return S(driftOf(taking, group, lane)[c]); });
  };
  return {part(0), part(1), part(2)};
}

template <Real S>
template <class B>
inline auto ContactProblem<S>::turningOf(const Taking<B>& taking, const Group& group, const Lanes& row,
                                         const detail::BodyLanes<S>& b1, const detail::BodyLanes<S>& b2,
                                         const detail::PackedVector<S>& drifts) const
    -> detail::TurningPair<S> {
  using Turning = detail::TurningPair<S>;
  const Pack boundary = Pack::of(
      [&](std::size_t lane) { return S(group.slot2[lane] == taking.colouring.staticSlot() ? 1 : 0); });
  const auto with = [&](const detail::BodyLanes<S>& m1, const detail::BodyLanes<S>& m2) {
    const detail::PackedVector<S> v = m2.v - m1.v + drifts;
    const Pack v_n = row.n.dot(v);
    const detail::PackedVector<S> w =
        friction ? row.c1 * m1.s + row.c2 * m2.s : detail::PackedVector<S>::zero();
    return Turning::of(!(boundary > Pack::zero()), row.n, row.c1 * b1.spin + row.c2 * b2.spin,
                       largerOf(v.squaredNorm() - v_n * v_n, Pack::zero()), w,
                       b1.inverseMass + b2.inverseMass, taking.dt, speedExponent_);
  };
  const Turning before = with(b1, b2);
  if (!(again && taking.way.follows && before.counts.any())) {
    return before;
  }
  const Turning after =
      with(detail::BodyLanes<S>::load(bodies, group.slot1), detail::BodyLanes<S>::load(bodies, group.slot2));
  return {choose(before.counts, after.approach, before.approach),
          choose(before.counts, after.slip, before.slip), before.counts};
}

template <Real S>
template <class Before>
inline void ContactProblem<S>::lookBackAt(const Group& group, Before& before,
                                          detail::RowSlides<S>& slides) const {
  const auto lasts = [&](std::uint32_t k) { return marks[k].lasts; };
  if (looksBack && std::any_of(group.row.begin(), group.row.end(), lasts)) {
    const auto of = [&](std::size_t lane, auto part) {
      const std::uint32_t k = group.row[lane];
      return lasts(k) ? before.of(k).*part : Vector3<S>(Vector3<S>::Zero());
    };
    slides.slipBefore = vectorsOf([&](std::size_t lane) { return of(lane, &detail::RowBefore<S>::slip); });
    slides.turnBefore = vectorsOf([&](std::size_t lane) { return of(lane, &detail::RowBefore<S>::turn); });
  }
}

template <Real S>
template <class B>
void ContactProblem<S>::lookBack(const Taking<B>& taking, const Group& group, const Lanes& row,
                                 const detail::BodyLanes<S>& b1, const detail::BodyLanes<S>& b2,
                                 const Pack& v_n, const Pack& load, const detail::PackedVector<S>& aimed,
                                 Taken& sum) {
  const Pack zero = Pack::zero();
  const Pack falls = speedIn((b1.inverseMass + b2.inverseMass) * Pack::all(taking.dt));
  const auto m1 = detail::BodyLanes<S>::load(bodies, group.slot1);
  const auto m2 = detail::BodyLanes<S>::load(bodies, group.slot2);
  const Pack push = detail::scaledLanes(Pack::all(ratio_) * load, speedExponent_ + this->massExponent_);
  const auto lasts = [&](const detail::PackedVector<S>& v, const Pack& stop) {
    const Pack least = Pack::all(detail::RowBefore<S>::lasting()) * largerOf(falls, stop);
    return (load > zero) & (v.squaredNorm() > least * least);
  };
  const auto takeDown = [&](std::uint32_t k) -> detail::RowBefore<S>& {
    if (!marks[k].lasts) {
      sum.before.push_back({k});
    }
    marks[k].rest = RowRest::Not;
    marks[k].lasts = true;
    return sum.of(k);
  };
  const auto slip = slipOf(group, slipVelocity(row, b2.v - b1.v, v_n, b1, b2)) + aimed;
  const auto slides = lasts(slip, row.stick * push * tangentialMobility(row, m1, m2));
  for (std::size_t lane = 0; slides.any() && lane < group.count; ++lane) {
    const std::uint32_t k = group.row[lane];
    if (slides[lane] && !marks[k].impact) {
      const auto a = [&](std::uint32_t slot) {
        return accelerationOf(taking.source, taking.colouring, slot);
      };
      const Vector3<S> n = row.n.at(lane);
      const Vector3<S> kick =
          speedIn(Vector3<S>(taking.way.kick * (a(group.slot2[lane]) - a(group.slot1[lane]))));
      takeDown(k).slip = slip.at(lane) + aimed.at(lane) - (kick - n.dot(kick) * n);
    }
  }
  if (turning.empty()) {
    return;
  }
  const auto lanes = detail::TurningLanes<S>::load(turning, group);
  const auto rho = lanes.rho(b1, b2);
  const auto turn = rho - row.n.dot(rho) * row.n;
  const Pack mobility = lanes.q1 * lanes.q1 * m1.spin + lanes.q2 * lanes.q2 * m2.spin;
  const auto rolls = lasts(turn, lanes.rolling * push * mobility);
  for (std::size_t lane = 0; rolls.any() && lane < group.count; ++lane) {
    const std::uint32_t k = group.row[lane];
    if (rolls[lane] && !marks[k].impact) {
      takeDown(k).turn = turn.at(lane);
    }
  }
}

}  // namespace gravel
