#pragma once

/// \file
/// Motion in Hill's frame, which goes round with a circular orbit: x outward, y along the orbit, z normal to
/// it. Positions, velocities and spins are those in the frame. Without other forces
///   x'' = 2 Omega y' + 3 Omega^2 x,   y'' = -2 Omega x',   z'' = -nu^2 z
/// (Hill 1878), which is solved exactly: an epicycle. The symplectic epicycle integrator kicks by all other
/// forces and drifts along the epicycle (Quinn, Perrine, Richardson & Barnes 2010, AJ 139, 803; Rein &
/// Tremaine 2011, MNRAS 415, 3168): order 2, one force evaluation a step, and no error where there is no
/// other force.

#include <gravel/core/check.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/core/sizes.hpp>
#include <gravel/dynamics/integrator.hpp>
#include <gravel/spatial/domain.hpp>

namespace gravel {

/// The frame of a shear-periodic domain; at rest for others.
template <Real Scalar>
struct HillFrame {
  Scalar omega = Scalar(0);     ///< [s^-1] of the orbit, of either sign
  Scalar vertical = Scalar(0);  ///< nu [s^-1] of the motion normal to the orbit

  HillFrame() = default;
  explicit HillFrame(const Domain<Scalar>& domain)
      : omega(domain.omega()), vertical(domain.verticalFrequency()) {}

  bool turns() const { return !(omega == Scalar(0)) || !(vertical == Scalar(0)); }

  /// [m s^-2] by which the epicycle bends away from a straight way at x with velocity v.
  Vector3<Scalar> acceleration(const Vector3<Scalar>& x, const Vector3<Scalar>& v) const {
    return {Scalar(2) * omega * v[1] + Scalar(3) * omega * omega * x[0], -Scalar(2) * omega * v[0],
            -vertical * vertical * x[2]};
  }

  /// Tidal and centrifugal potential per mass, -(3/2) Omega^2 x^2 + nu^2 z^2/2 [m^2 s^-2]. With it
  /// v^2/2 + potential is kept along an epicycle.
  Scalar potential(const Vector3<Scalar>& x) const {
    return (vertical * x[2] * (vertical * x[2]) - Scalar(3) * (omega * x[0]) * (omega * x[0])) / Scalar(2);
  }
};

/// The epicycle over a time h: made once, applied to many bodies.
///
/// In (x - x_c, x'/Omega) the motion is a turn by -Omega h about the guiding centre x_c, and so is (z, z'/nu)
/// by -nu h. Each turn is three shears, whose product has determinant 1 whatever the rounding: no drift of
/// epicyclic energy (Rein & Tremaine 2011). Written in increments, nothing is divided by Omega, so that it
/// goes over into x + v h where Omega h vanishes.
template <Real Scalar>
class Epicycle {
 public:
  /// \param h [s] of either sign; long ones are cut, so that no turn is by more than one radian
  /// \throws std::invalid_argument of check()
  Epicycle(const HillFrame<Scalar>& frame, const Scalar& h) : frame_(frame) {
    check(frame, h);
    Scalar fastest = fastestTurn(frame, h);
    while (fastest > Scalar(1)) {
      fastest /= Scalar(2);
      parts_ *= 2;
    }
    h_ = h / Scalar(static_cast<double>(parts_));
    plane_ = Shears(frame.omega, h_);
    normal_ = Shears(frame.vertical, h_);
  }

  /// A turn takes about as many parts as it has radians. \throws std::invalid_argument if that are too many
  static void check(const HillFrame<Scalar>& frame, const Scalar& h) {
    detail::require("turn of the frame in a step [rad]", fastestTurn(frame, h),
                    {Scalar(0), Scalar(1e6), "at most 1e6"});
  }
  /// Whether check() lets h [s] pass.
  static bool takes(const HillFrame<Scalar>& frame, const Scalar& h) {
    return fastestTurn(frame, h) <= Scalar(1e6);
  }

  /// \param dx,dv what is to be added to x and v
  void increments(const Vector3<Scalar>& x, const Vector3<Scalar>& v, Vector3<Scalar>& dx,
                  Vector3<Scalar>& dv) const {
    dx = dv = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));
    for (int part = 0; part < parts_; ++part) {
      add(Vector3<Scalar>(x + dx), Vector3<Scalar>(v + dv), dx, dv);
    }
  }

  /// Turns spin w and orientation q. A body that nothing turns keeps its spin in the inertial frame; in this
  /// frame the part of w across z turns by -Omega h.
  void turn(Quaternion<Scalar>& q, Vector3<Scalar>& w) const {
    const Vector3<Scalar> frame(Scalar(0), Scalar(0), frame_.omega);
    for (int part = 0; part < parts_; ++part) {
      q = rotated(rotated(q, Vector3<Scalar>(w + frame), h_), frame, Scalar(-h_));
      const Scalar first = w[0] + plane_.tangent * w[1];
      w[1] -= plane_.sine * first;
      w[0] = first + plane_.tangent * w[1];
    }
  }

 private:
  struct Shears {
    Scalar sine = Scalar(0), tangent = Scalar(0);        ///< sin(a) and tan(a/2) for the angle a = f h
    Scalar perSine = Scalar(0), perTangent = Scalar(0);  ///< these over f [s]; h and h/2 for f = 0

    Shears() = default;
    Shears(const Scalar& f, const Scalar& h) {
      using std::cos;
      using std::sin;
      const Scalar half = f * h / Scalar(2);
      sine = Scalar(2) * Scalar(sin(half)) * Scalar(cos(half));
      tangent = Scalar(sin(half)) / Scalar(cos(half));
      perSine = f == Scalar(0) ? h : Scalar(sine / f);
      perTangent = f == Scalar(0) ? Scalar(h / Scalar(2)) : Scalar(tangent / f);
    }
  };

  /// [rad]
  static Scalar fastestTurn(const HillFrame<Scalar>& frame, const Scalar& h) {
    return std::max(detail::sizeOf(Scalar(frame.omega * h)), detail::sizeOf(Scalar(frame.vertical * h)));
  }

  void add(const Vector3<Scalar>& x, const Vector3<Scalar>& v, Vector3<Scalar>& dx,
           Vector3<Scalar>& dv) const {
    const Scalar centre = Scalar(2) * v[1] + Scalar(4) * frame_.omega * x[0];  // Omega x_c
    const Scalar sheared = frame_.omega * x[0] - centre + plane_.tangent * v[0];
    const Scalar dv0 = -(plane_.sine * sheared);
    const Scalar dx0 = plane_.perTangent * (v[0] + (v[0] + dv0));
    dx[0] += dx0;
    dx[1] -= Scalar(2) * plane_.perSine * sheared + Scalar(1.5) * centre * h_;
    dv[0] += dv0;
    dv[1] -= Scalar(2) * frame_.omega * dx0;  // v_y + 2 Omega x is kept
    const Scalar first = x[2] + normal_.perTangent * v[2];
    const Scalar dv2 = -(frame_.vertical * normal_.sine * first);
    dx[2] += normal_.perTangent * (v[2] + (v[2] + dv2));
    dv[2] += dv2;
  }

  HillFrame<Scalar> frame_;
  Scalar h_ = Scalar(0);
  int parts_ = 1;
  Shears plane_, normal_;
};

/// Advances all bodies by one step h in a frame: half a kick, the epicycle, half a kick. Arguments as in
/// integrate(); fixed bodies stay in the frame. Order 2, symplectic, one force evaluation; bits do not depend
/// on the number of threads.
template <Real Scalar, class Layout, class Forces, class Arrival, class Departure = NoDeparture>
void integrateEpicycle(const HillFrame<Scalar>& frame, Bodies<Scalar, Layout>& bodies, const Scalar& h,
                       bool torques, Forces&& forces, Arrival&& arrival, Departure&& departure = {}) {
  Compensation<Scalar>* const none = nullptr;
  const Scalar kick = h / Scalar(2);
  const Epicycle<Scalar> epicycle(frame, h);
  detail::kickAndDrift(bodies, kick, Scalar(0), torques, none);
  if (departure) {
    departure(kick);
  }
  parallelFor(bodies.size(), detail::bodyGrain, [&](std::size_t i) {
    const auto body = bodies[i];
    if (body.isFixed()) {
      return;
    }
    Vector3<Scalar> dx, dv;
    epicycle.increments(body.position(), body.velocity(), dx, dv);
    body.position() += dx;
    body.velocity() += dv;
    Vector3<Scalar> w = body.angularVelocity();
    if (!detail::equalIsSame<Scalar> || !(w.squaredNorm() == Scalar(0))) {
      Quaternion<Scalar> q(body.orientation());
      epicycle.turn(q, w);
      body.orientation() = q;
      body.angularVelocity() = w;
    }
  });
  arrival();
  forces(h);
  detail::kickAndDrift(bodies, kick, Scalar(0), torques, none);
}

/// Brings bodies that left a periodic box back in through the other side. \return the energy that they have
/// more there [J]: what the shear of a disc puts in, at the velocity that a last kick of the field leaves,
/// and a uniform field over the length of the box. \param kick [s] of the last one
template <Real Scalar, class Layout>
Scalar wrapBodies(Bodies<Scalar, Layout>& bodies, const Domain<Scalar>& domain, const Scalar& time,
                  const Vector3<Scalar>& field, const Scalar& kick) {
  if (domain.isOpen()) {
    return Scalar(0);
  }
  const HillFrame<Scalar> frame(domain);
  return orderedSum(bodies.size(), detail::bodyGrain, Scalar(0), [&](std::size_t begin, std::size_t end) {
    Scalar gained(0);
    for (std::size_t i = begin; i < end; ++i) {
      const Vector3<Scalar> x0 = bodies[i].position();
      const Vector3<Scalar> v0 = bodies[i].velocity();
      Vector3<Scalar> x = x0;
      Vector3<Scalar> v = v0;
      domain.wrap(x, v, time);
      if (x == x0) {
        continue;
      }
      bodies[i].position() = x;
      if (bodies[i].isFixed()) {
        continue;
      }
      bodies[i].velocity() = v;
      gained -= Scalar(bodies[i].mass()) * field.dot(Vector3<Scalar>(x - x0));
      if (frame.turns()) {
        gained +=
            Scalar(bodies[i].mass()) * (Vector3<Scalar>(v - v0).dot((v + v0) / Scalar(2) + kick * field) +
                                        (frame.potential(x) - frame.potential(x0)));
      }
    }
    return gained;
  });
}

/// Energy of the movable bodies in the frame's potential [J].
template <Real Scalar, class Layout>
Scalar frameEnergy(const Bodies<Scalar, Layout>& bodies, const HillFrame<Scalar>& frame) {
  return orderedSum(bodies.size(), 1024, Scalar(0), [&](std::size_t begin, std::size_t end) {
    Scalar part(0);
    for (std::size_t i = begin; i < end; ++i) {
      const auto body = bodies[i];
      if (!body.isFixed()) {
        part += Scalar(body.mass()) * frame.potential(Vector3<Scalar>(body.position()));
      }
    }
    return part;
  });
}

}  // namespace gravel
