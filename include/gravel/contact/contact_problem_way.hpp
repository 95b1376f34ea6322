#pragma once

/// \file
/// Members of `ContactProblem` that look at the way that bodies go after the solve.
///
/// In a frame that turns ways are bent: over a drift of length h the distance of a pair changes by
/// h v + b h^2/2, b being the difference of what the frame adds to their accelerations (HillFrame). So the
/// contact is right at the end if the speed along the line of centres is less by n.b h/2, and the mean slip
/// of the drift vanishes if that at its start is less by h/2 of the slip's rate, b_t - w' x n, where the
/// frame turns the spin by w' = -Omega z x w. Without, what rests in a disc parted by (Omega h)^2 of its size
/// in every step and met again in the next one.

#include <gravel/contact/contact_problem.hpp>

namespace gravel {

template <Real S>
template <class B>
inline auto ContactProblem<S>::bendOf(const Taking<B>& taking, const Group& group) const
    -> detail::PackedVector<S> {
  const auto part = [&](Eigen::Index c) {
    return Pack::of([&](std::size_t lane) {
      return S(Base::bendAt(taking.colouring, group.slot2[lane])[c] -
               Base::bendAt(taking.colouring, group.slot1[lane])[c]);
    });
  };
  const detail::PackedVector<S> bend{part(0), part(1), part(2)};
  return speedIn(Pack::all(S(taking.dt / S(2)))) * bend;
}

template <Real S>
template <class B>
inline auto ContactProblem<S>::slipByBend(const Taking<B>& taking, const Lanes& row,
                                          const detail::PackedVector<S>& bend, const detail::BodyLanes<S>& b1,
                                          const detail::BodyLanes<S>& b2) const -> detail::PackedVector<S> {
  const detail::PackedVector<S> along = bend - row.n.dot(bend) * row.n;
  if (!friction) {
    return along;
  }
  const detail::PackedVector<S> w = row.c1 * b1.s + row.c2 * b2.s;
  const Pack angle = Pack::all(S(taking.way.frame * taking.dt / S(2)));
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
                                         const detail::PackedVector<S>& v, const Pack& v_n) const
    -> detail::TurningPair<S> {
  const Pack boundary = Pack::of(
      [&](std::size_t lane) { return S(group.slot2[lane] == taking.colouring.staticSlot() ? 1 : 0); });
  const detail::PackedVector<S> w =
      friction ? row.c1 * b1.s + row.c2 * b2.s : detail::PackedVector<S>::zero();
  return detail::TurningPair<S>::of(!(boundary > Pack::zero()), row.n, row.c1 * b1.spin + row.c2 * b2.spin,
                                    largerOf(v.squaredNorm() - v_n * v_n, Pack::zero()), w,
                                    b1.inverseMass + b2.inverseMass, taking.dt, speedExponent_);
}

}  // namespace gravel
