#pragma once

/// \file
/// Two spheres in contact that turn about each other while bodies drift straight ahead.
///
/// Over a drift of length h that follows an impulse, contacts hold if they do so at its end, as constraints
/// do in RATTLE (Andersen 1983, J. Comput. Phys. 52, 24). With the line of centres d = D n from the first to
/// the second, its end d + h v keeps the length D if the pair comes nearer by
///   a = (D - sqrt(D^2 - (h v_t)^2))/h = h v_t^2 / (D + sqrt(D^2 - (h v_t)^2)):
/// the way along the tangent leads outside of the circle. And what sticks rolls: at every moment v_t = w x n
/// with w = c_1 s_1 + c_2 s_2 (solver_rows.hpp), while n turns by (w x n)/D; the mean of that over the drift,
///   w x n + h/(2 D) w x (w x n),
/// has the part h/(2 D) (w.n) w_t across n, which is the slip of the tangent at the start. Without either,
/// aggregates that turn as one grew by (h omega)^2/2 in every step, and friction held what should close
/// again. Both take the velocities of the drift, after all impulses, and those of the solve before foretell
/// them: of what a kick adds across n, other contacts may undo all (three unequal spheres that turn as one
/// drifted into each other with h a_t/2 in v_t). A half-space does not turn. Below a small share of the
/// accelerations both fade, as restitution does at low speeds: with them a ball that rocks in the hollow of a
/// heap loses nothing, and goes on for ever.

#include <gravel/contact/row_lanes.hpp>

namespace gravel::detail {

/// What the turn of a pair adds to accelerations, over what these are, from which on it counts: of a pair at
/// a 23rd of the spin at which its own gravity would let it part.
template <Real S>
S turningShare() {
  return S(1) / S(512);
}

template <Real S>
struct TurningPair {
  using P = Packed<S>;
  using V = PackedVector<S>;
  P approach;                ///< >= 0, of the speed along n
  V slip;                    ///< across n
  typename P::Truth counts;  ///< it is more than a little of what the step's fall brings

  /// In the units of the problem's speeds, 2^exponent of SI ones.
  /// \param pair  lanes of two spheres
  /// \param distance  D > 0 [m]
  /// \param v_t_sq,w  as above; w is zero without friction
  /// \param falls  |a_1| + |a_2| [m s^-2]
  /// \param h [s]
  [[gnu::always_inline]] static inline TurningPair of(const typename P::Truth& pair, const V& n,
                                                      const P& distance, const P& v_t_sq, const V& w,
                                                      const P& falls, const S& h, int exponent) {
    const P zero = P::zero();
    const P one = P::all(S(1));
    const P rate = scaledLanes(P::all(h) * reciprocalOf(distance), -exponent);
    const auto angleSquared = [&](const P& speed_sq) {
      return scaledLanes(speed_sq * rate, -exponent) * P::all(h) * reciprocalOf(distance);
    };
    // Past each other by a quarter of the distance and more nothing is held: a blow on the way would leave
    // them in each other. Nor has a spin by more than that one axis on the way.
    const P most = P::all(S(1) / S(16));
    const P angle_sq = angleSquared(v_t_sq);
    const auto turns = pair & (angle_sq < most);
    const auto rolls = turns & (angleSquared(w.squaredNorm()) < most);
    TurningPair turning;
    turning.approach =
        choose(turns, v_t_sq * rate / (one + squareRoot(choose(turns, one - angle_sq, one))), zero);
    const P w_n = w.dot(n);
    turning.slip = choose(rolls, P::all(S(1) / S(2)) * rate * w_n * (w - w_n * n), V::zero());
    const P little = P::all(S(turningShare<S>() / S(2)) * h) * scaledLanes(falls, exponent);
    turning.counts = (turning.approach > little) | (turning.slip.sumAbs() > little);
    turning.approach = choose(turning.counts, turning.approach, zero);
    turning.slip = choose(turning.counts, turning.slip, V::zero());
    return turning;
  }
};

}  // namespace gravel::detail
