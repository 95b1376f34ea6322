#pragma once

/// \file
/// One blow between two spheres in closed form: pure functions of numbers. Sign convention: the normal n
/// points from body 1 to body 2, v_n = n.(v2 - v1) < 0 is approach, the impulse on body 2 is +J, on 1 -J.
///
/// The spin of a body of radius r enters as the speed of its surface, s = r w, and its inertia k m r^2 as
/// the factor k: radii cancel, so that nothing underflows for dust. With the arms a_i from the centres to the
/// contact and c_i = a_i / r_i the slip is the tangential part of
///   u = v2 - v1 - (c1 s1 + c2 s2) x n,
/// and a tangential impulse J changes it by J (1/m1 (1 + c1^2/k1) + 1/m2 (1 + c2^2/k2)): for homogeneous
/// spheres (k = 2/5, c = 1) by 7/2 J/m*. Normal and tangential impulse do not feel each other, hence each is
/// exact on its own.

#include <gravel/core/sizes.hpp>

namespace gravel {

namespace detail {

/// [J] that a body of inertia k m r^2 gains with another spin, by speeds of its surface: m r^2 of a giant
/// planet is no float.
template <Real S>
S gainOfSpin(const S& k, const S& m, const S& r, const Vector3<S>& before, const Vector3<S>& after) {
  return k * m * Vector3<S>(r * Vector3<S>(after - before)).dot(Vector3<S>(r * Vector3<S>(after + before))) /
         S(2);
}

}  // namespace detail

/// How two bodies share a change of their relative velocity: first + second = 1, by inverse mass. Both 0 if
/// neither moves. `effective` is m* = 1/(1/m1 + 1/m2).
template <Real Scalar>
struct MassShares {
  Scalar first;
  Scalar second;
  Scalar effective;
};

/// \param m1,m2 masses [kg] > 0 of movable bodies; any value of others
template <Real Scalar>
MassShares<Scalar> massShares(const Scalar& m1, bool movable1, const Scalar& m2, bool movable2) {
  if (movable1 && movable2) {
    // From the ratio of the smaller to the larger: m1 + m2 and m1 m2 may leave the range of numbers.
    const bool firstLarger = m1 > m2;
    const Scalar ratio = firstLarger ? m2 / m1 : m1 / m2;
    const Scalar light = Scalar(1) / (Scalar(1) + ratio);
    const Scalar heavy = ratio / (Scalar(1) + ratio);
    return firstLarger ? MassShares<Scalar>{heavy, light, m2 * light}
                       : MassShares<Scalar>{light, heavy, m1 * light};
  }
  return {Scalar(movable1 ? 1 : 0), Scalar(movable2 ? 1 : 0), movable1 ? m1 : movable2 ? m2 : Scalar(0)};
}

/// [N s] J_n = (1 + e) m* u_n for the approach speed u_n = -v_n > 0; none for a pair that separates.
template <Real Scalar>
Scalar normalImpulse(const Scalar& effectiveMass, const Scalar& v_n, const Scalar& restitution) {
  return v_n < Scalar(0) ? effectiveMass * (-v_n - restitution * v_n) : Scalar(0);
}

/// Clamps a tangential impulse to Coulomb's cone: kept while it is at most mu_s J_n (it sticks), else cut to
/// mu_k J_n in its own direction (it slides).
template <Real Scalar>
Vector3<Scalar> clampToCone(const Vector3<Scalar>& sticking, const Scalar& jn, const Scalar& mu_s,
                            const Scalar& mu_k) {
  if (!(jn > Scalar(0))) {
    return Vector3<Scalar>::Zero();
  }
  return detail::safeNorm(sticking) <= mu_s * jn ? sticking
                                                 : Vector3<Scalar>((mu_k * jn) * detail::safeUnit(sticking));
}

/// [N s] tangential impulse on body 2 of one blow: -(1 + b0) m_t v_t if that sticks, else mu_k J_n against
/// the slip (Walton's model; Chung & Ooi 2011, Granular Matter 13, 643).
/// \param tangentialMass m_t = 1/(1/m1 (1 + c1^2/k1) + 1/m2 (1 + c2^2/k2)), see the top of this file
/// \param v_t slip [m s^-1] of 2 over 1 at the contact, in the tangent plane
template <Real Scalar>
Vector3<Scalar> tangentialImpulse(const Scalar& tangentialMass, const Vector3<Scalar>& v_t, const Scalar& jn,
                                  const Scalar& mu_s, const Scalar& mu_k, const Scalar& b0) {
  const Vector3<Scalar> sticking = -((Scalar(1) + b0) * tangentialMass) * v_t;
  return clampToCone<Scalar>(sticking, jn, mu_s, mu_k);
}

/// Rolling and spinning resistance of one blow, or of a step of rest. The relative turn of two bodies,
/// dw = w2 - w1, is measured as the speed rho = R* dw with the effective radius R* = r1 r2/(r1 + r2), that of
/// the sphere on a plane; an angular impulse L on body 2 (-L on 1) as L/R* [N s]. In these units, with
/// s_i = r_i w_i and q_i = R*/r_i, rho = q2 s2 - q1 s1, and an impulse l changes s_i by +-q_i l/(k_i m_i).
/// The part across the normal is bound by mu_r J_n, that along it by mu_s J_n, each against rho (as in "type
/// A" of Ai, Chen, Rotter & Ooi 2011, Powder Technol. 206, 269, without elasticity). It never adds energy.
/// \param wanted [N s] what would stop the relative turn
template <Real Scalar>
Vector3<Scalar> resistTurning(const Vector3<Scalar>& wanted, const Vector3<Scalar>& n, const Scalar& jn,
                              const Scalar& mu_r, const Scalar& mu_s) {
  const Scalar along = n.dot(wanted);
  const Scalar most = jn > Scalar(0) ? Scalar(mu_s * jn) : Scalar(0);
  const Scalar kept = along > most ? most : along < -most ? Scalar(-most) : along;
  return clampToCone<Scalar>(Vector3<Scalar>(wanted - along * n), jn, mu_r, mu_r) + kept * n;
}

}  // namespace gravel
