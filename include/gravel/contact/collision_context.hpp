#pragma once

/// \file
/// One pair of overlapping bodies, with the operations of a single blow. The step itself solves all contacts
/// together (contact_solver.hpp); this is the pair alone, for tests, teaching and a user's own loop.

#include <gravel/bodies/bodies.hpp>
#include <gravel/contact/contact.hpp>
#include <gravel/spatial/domain.hpp>

namespace gravel {

/// Two bodies that overlap. Valid as long as the proxies are; the geometry is that of the moment of making.
template <Real S = double, class Layout = SoA>
struct CollisionContext {
  using Scalar = S;

  BodyProxy<S, Layout> body1;
  BodyProxy<S, Layout> body2;
  Vector3<S> normal;  ///< unit vector from body 1 to body 2
  S distance;         ///< [m] between the centres
  S overlap;          ///< [m] > 0
  S arm1;             ///< [m] centre 1 to contact; arm1 + arm2 = distance
  S arm2;             ///< [m] contact to centre 2
  Vector3<S> drift;   ///< [m s^-1] added to the velocity of body 2: of its image in a sheared domain
  S epsilon;          ///< [m] below it the centres count as one point

  /// [m s^-1] of body 2 relative to body 1 at the contact, now; along the normal and across it.
  Vector3<S> relativeVelocity() const {
    const Vector3<S> spin = arm1 * body1.countingSpin() + arm2 * body2.countingSpin();
    return centreVelocity() - spin.cross(normal);
  }
  S normalVelocity() const { return normal.dot(centreVelocity()); }
  Vector3<S> slip() const {
    const Vector3<S> u = relativeVelocity();
    return u - normal.dot(u) * normal;
  }

 private:
  Vector3<S> centreVelocity() const { return body2.countingVelocity() + drift - body1.countingVelocity(); }
};

namespace detail {

template <class Proxy>
bool isMovable(const Proxy& body) {
  return !body.isFixed() && body.mass() > typename Proxy::Scalar(0);
}

/// a^2 / (k r^2): how much easier than its centre the surface of a body is to move sideways.
template <class Proxy, class S = typename Proxy::Scalar>
S spinMobility(const Proxy& body, const S& arm) {
  const S r = body.radius();
  const S k = body.inertiaFactor();
  return r > S(0) && k > S(0) ? (arm / r) * (arm / r) / k : S(0);
}

/// Applies J = m* dv to a body whose share of the relative velocity is `share`; sign -1 for body 1.
/// \param dv [m s^-1] change of relative velocity that J makes on m*
template <class Proxy, class S = typename Proxy::Scalar>
void push(const Proxy& body, const S& share, const Vector3<S>& dv, const S& sign) {
  if (share > S(0)) {
    body.velocity() += (sign * share) * dv;
  }
}

/// Torque of that impulse at `arm` along n: both bodies turn by -(a/(k r^2)) n x dv.
template <class Proxy, class S = typename Proxy::Scalar>
void twist(const Proxy& body, const S& share, const Vector3<S>& dv, const S& arm, const Vector3<S>& n) {
  const S r = body.radius();
  const S k = body.inertiaFactor();
  if (share > S(0) && r > S(0) && k > S(0)) {
    body.angularVelocity() -= (share * (arm / r) / k / r) * n.cross(dv);
  }
}

template <Real S, class Layout>
MassShares<S> sharesOf(const CollisionContext<S, Layout>& ctx) {
  return massShares<S>(ctx.body1.mass(), isMovable(ctx.body1), ctx.body2.mass(), isMovable(ctx.body2));
}

}  // namespace detail

/// The context of two bodies; empty exactly when their spheres do not overlap (distance >= r1 + r2).
/// \param time [s] matters in a sheared domain only
/// \param epsilon [m] centres no farther apart than this, and than the rounding of the radii, count as one
///        point: the normal is then a function of the two ids
template <Real S, class Layout>
std::optional<CollisionContext<S, Layout>> makeCollisionContext(BodyProxy<S, Layout> b1,
                                                                BodyProxy<S, Layout> b2,
                                                                const Domain<S>& domain, const S& time,
                                                                const S& epsilon) {
  Vector3<S> r_12 = Vector3<S>(b2.position()) - Vector3<S>(b1.position());
  Vector3<S> drift = Vector3<S>::Zero();
  domain.minimumImage(r_12, drift, time);
  const auto touch =
      sphereSphere<S>(r_12, b1.radius(), b2.radius(), toInteger(b1.id()), toInteger(b2.id()), epsilon);
  if (!touch) {
    return std::nullopt;
  }
  return CollisionContext<S, Layout>{b1,          b2,          touch->normal, touch->distance, -touch->gap,
                                     touch->arm1, touch->arm2, drift,         epsilon};
}

/// [kg] m such that an impulse J along the unit vector `direction` at the contact changes the velocity of
/// contact along it by J / m; spin takes part across the normal. 0 if neither body moves.
template <Real S, class Layout>
S effectiveMass(const CollisionContext<S, Layout>& ctx, const Vector3<S>& direction) {
  const MassShares<S> share = detail::sharesOf(ctx);
  if (!(share.effective > S(0))) {
    return S(0);
  }
  const S across = ctx.normal.cross(direction).squaredNorm();
  return share.effective / (S(1) + across * (share.first * detail::spinMobility(ctx.body1, ctx.arm1) +
                                             share.second * detail::spinMobility(ctx.body2, ctx.arm2)));
}

/// What a normal impulse was.
template <Real Scalar>
struct NormalImpulse {
  Vector3<Scalar> impulse;  ///< [N s] on body 2
  Scalar magnitude;         ///< [N s] >= 0
  Scalar
      bias;  ///< [N s] part that serves to remove overlap: always 0, overlap is removed by moving positions
};

/// Applies J_n = (1 + e) m* u_n to both bodies; nothing to a pair that separates.
/// \param threshold [m s^-1] e acts on an approach faster than this; a slower one just stops
template <Real S, class Layout>
NormalImpulse<S> applyNormalImpulse(CollisionContext<S, Layout>& ctx, const S& restitution,
                                    const S& threshold = S(0)) {
  const S v_n = ctx.normalVelocity();
  const MassShares<S> share = detail::sharesOf(ctx);
  if (!(v_n < S(0)) || !(share.effective > S(0))) {
    return {Vector3<S>::Zero(), S(0), S(0)};
  }
  const S e = -v_n > threshold ? restitution : S(0);
  // In two strokes, stop and rebound: a head-on blow then ends at exactly e times its speed.
  for (const S& dv : {S(-v_n), S(-e * v_n)}) {
    detail::push(ctx.body1, share.first, Vector3<S>(dv * ctx.normal), S(-1));
    detail::push(ctx.body2, share.second, Vector3<S>(dv * ctx.normal), S(1));
  }
  const S j_n = normalImpulse<S>(share.effective, v_n, e);
  return {Vector3<S>(j_n * ctx.normal), j_n, S(0)};
}

/// Applies Coulomb's friction for the normal impulse jn, with the spin of both bodies.
/// \return impulse [N s] on body 2, across the normal
template <Real S, class Layout>
Vector3<S> applyFrictionImpulse(const CollisionContext<S, Layout>& ctx, const S& jn, const S& mu_s,
                                const S& mu_k, const S& b0 = S(0)) {
  const MassShares<S> share = detail::sharesOf(ctx);
  if (!(share.effective > S(0)) || !(jn > S(0))) {
    return Vector3<S>::Zero();
  }
  // As changes of velocity, J / m*: masses of 1e-300 kg lose no digits.
  const S mobility = S(1) + share.first * detail::spinMobility(ctx.body1, ctx.arm1) +
                     share.second * detail::spinMobility(ctx.body2, ctx.arm2);
  const Vector3<S> dv =
      tangentialImpulse<S>(S(1) / mobility, ctx.slip(), jn / share.effective, mu_s, mu_k, b0);
  detail::push(ctx.body1, share.first, dv, S(-1));
  detail::push(ctx.body2, share.second, dv, S(1));
  detail::twist(ctx.body1, share.first, dv, ctx.arm1, ctx.normal);
  detail::twist(ctx.body2, share.second, dv, ctx.arm2, ctx.normal);
  return share.effective * dv;
}

/// Moves the bodies apart along the normal until `factor` of the overlap is gone, by inverse mass: their
/// common centre of mass stays, and no velocity changes.
template <Real S, class Layout>
void separate(const CollisionContext<S, Layout>& ctx, const S& factor) {
  const MassShares<S> share = detail::sharesOf(ctx);
  const Vector3<S> shift = (factor * ctx.overlap) * ctx.normal;
  if (share.first > S(0)) {
    ctx.body1.position() -= share.first * shift;
  }
  if (share.second > S(0)) {
    ctx.body2.position() += share.second * shift;
  }
}

}  // namespace gravel
