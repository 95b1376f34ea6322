#pragma once

/// \file
/// Friction and resistance to rolling act on one spin: what stops the slip turns the bodies, and what stops
/// their turn lets them slip. Both of one contact together, in closed form.
///
/// With the units of impulses.hpp, an impulse j across the normal n and an angular impulse l across it,
///     slip' = slip + A j + X l x n,        A = 1/m1 + 1/m2 + c1^2/(k1 m1) + c2^2/(k2 m2)
///     rho'  = rho  + C l + X n x j,        C =               q1^2/(k1 m1) + q2^2/(k2 m2)
///                                          X =              c1 q1/(k1 m1) - c2 q2/(k2 m2),
/// which is symmetric in j and n x l. It is X = 0 for equal spheres; on a plane X^2/(A C) = 1/(1 + k), and
/// each round of stopping the one and then the other leaves that share, however far away the limits are.
/// Together they vanish with
///     D j = X rho x n - C slip,            D l = X n x slip - A rho,
///     D = A C - X^2 = (1/m1 + 1/m2) C + (c1 q2 + c2 q1)^2/(k1 m1 k2 m2),
/// in which nothing cancels. Of j and l, within a circle each, the law wants the least energy (maximum
/// dissipation). If one of the two is free, the other feels the mobility D/C or D/A, the same in all
/// directions: it is the above, cut to its circle. So three closed forms serve all but contacts with both at
/// their limits. These are right where friction, cut beside the resistance of the first of them, leaves that
/// resistance as it is, as on straight ways; else the two are taken by turns, of which each lowers the
/// energy.

#include <gravel/contact/impulses.hpp>

namespace gravel {

namespace detail {

/// A, X, C and D above. \tparam N a scalar, or Packed
template <class N>
struct SlipAndTurn {
  N slip;  ///< A
  N both;  ///< X
  N turn;  ///< C
  N det;   ///< D

  /// \param normal 1/m1 + 1/m2 \param spin1,spin2 1/(k m)
  [[gnu::always_inline]] static inline SlipAndTurn of(const N& normal, const N& c1, const N& q1,
                                                      const N& spin1, const N& c2, const N& q2,
                                                      const N& spin2) {
    const N turn = q1 * q1 * spin1 + q2 * q2 * spin2;
    const N cross = c1 * q2 + c2 * q1;
    return {normal + spin1 * c1 * c1 + spin2 * c2 * c2, c1 * q1 * spin1 - c2 * q2 * spin2, turn,
            normal * turn + cross * cross * spin1 * spin2};
  }
};

}  // namespace detail

/// What limits friction and resistance to turning, each by the normal impulse.
template <Real Scalar>
struct GripLimits {
  Scalar staticFriction;
  Scalar kineticFriction;
  Scalar rolling;
  Scalar spinning;
};

/// What friction and resistance to turning of one blow do.
template <Real Scalar>
struct GripImpulses {
  Vector3<Scalar> tangential;  ///< [N s] on body 2
  Vector3<Scalar> turning;     ///< [N s] angular impulse on body 2 over the effective radius
};

/// Both within their limits: see tangentialImpulse() and resistTurning(), which they are where nothing
/// couples the two. Friction that flings the slip back acts first, and resistance on the turn that it leaves:
/// to ask for a slip and for no turn at once could give the slip more energy than both lost. (So as the
/// restitution goes to 0, the blow does not go to the one without.) Else energy never grows; where both come
/// to their limits at an angle, by the last of 200 turns at most.
/// \param mobility  in units in which 1/m1 + 1/m2 is of the order of 1
/// \param slip [m s^-1] across n
/// \param rho [m s^-1] of the relative turn
/// \param restitution  of the slip
template <Real Scalar>
GripImpulses<Scalar> gripImpulses(const detail::SlipAndTurn<Scalar>& mobility, const Vector3<Scalar>& slip,
                                  const Vector3<Scalar>& rho, const Vector3<Scalar>& n, const Scalar& jn,
                                  const GripLimits<Scalar>& limits, const Scalar& restitution) {
  using V = Vector3<Scalar>;
  const Scalar& A = mobility.slip;
  const Scalar& X = mobility.both;
  const Scalar& C = mobility.turn;
  const Scalar& D = mobility.det;
  const Scalar& mu_s = limits.staticFriction;
  const Scalar& mu_k = limits.kineticFriction;
  if (!(jn > Scalar(0))) {
    return {V::Zero(), V::Zero()};
  }
  // What is wanted of the one beside the other.
  const auto rubs = [&](const V& l) { return V((slip + X * l.cross(n)) / -A); };
  const auto turns = [&](const V& j) { return V((rho + X * n.cross(j)) / -C); };
  const auto within = [&](const V& l) {
    return resistTurning<Scalar>(l, n, jn, limits.rolling, limits.spinning);
  };
  if (restitution > Scalar(0) || !(C > Scalar(0))) {
    const V j = tangentialImpulse<Scalar>(Scalar(1) / A, slip, jn, mu_s, mu_k, restitution);
    return {j, C > Scalar(0) ? within(turns(j)) : V(V::Zero())};
  }
  const V spun = n.dot(rho) * n;
  const V turning = within(V((X * n.cross(slip) - A * (rho - spun)) / D - spun / C));
  const V sticking = rubs(turning);
  if (detail::safeNorm(sticking) <= mu_s * jn) {
    return {sticking, turning};
  }
  V j = clampToCone<Scalar>(V((X * rho.cross(n) - C * slip) / D), jn, mu_s, mu_k);
  V l = turns(j);
  if (detail::safeNorm(V(l - n.dot(l) * n)) <= limits.rolling * jn) {
    return {j, within(l)};
  }
  j = clampToCone<Scalar>(sticking, jn, mu_k, mu_k);
  for (int turn = 0; turn < 200; ++turn) {
    const V next = clampToCone<Scalar>(rubs(within(turns(j))), jn, mu_k, mu_k);
    const bool stays = detail::maxAbs(V(next - j)) <= detail::roundoff<Scalar>() * mu_s * jn;
    j = next;
    if (stays) {
      break;
    }
  }
  return {j, within(turns(j))};
}

}  // namespace gravel
