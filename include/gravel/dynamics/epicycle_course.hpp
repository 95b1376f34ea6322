#pragma once

/// \file
/// Impacts on the way along epicycles.

#include <gravel/core/parallel.hpp>
#include <gravel/dynamics/epicycle.hpp>

#include <array>
#include <vector>

namespace gravel {

/// The course of bodies in Hill's frame, for `ImpactEvents`. Over a step the epicycle is taken as the
/// parabola with its ends and its change of velocity, which is right to O(h^3). The drift is linear in (x,
/// v), so that what a blow dv at t changes at the start of the step is the epicycle back over t of (0, dv),
/// exactly. Spins turn with -Omega on the way: what a blow changes is turned back over t, too.
template <Real Scalar>
class EpicycleCourse {
 public:
  EpicycleCourse(const HillFrame<Scalar>& frame, const Scalar& h) : frame_(frame), h_(h), drift_(frame, h) {}

  /// Must be called once the velocities are those of the drift's start.
  template <class B>
  void foresee(const B& bodies) {
    motion_.resize(bodies.size());
    parallelFor(bodies.size(), 2048, [&](std::size_t i) { renew(bodies, i); });
  }

  template <class B>
  Vector3<Scalar> velocity(const B&, std::size_t i) const {
    return motion_[i].v;
  }
  template <class B>
  Vector3<Scalar> acceleration(const B& bodies, std::size_t i) const {
    return motion_[i].a + Vector3<Scalar>(bodies.accelerations()[i]);
  }

  /// Along the epicycle itself, so that what a blow does to the energy is exact.
  template <class B>
  Vector3<Scalar> velocityAt(const B& bodies, std::size_t i, const Scalar& t, const Scalar& h) const {
    Vector3<Scalar> dx, dv;
    Epicycle<Scalar>(frame_, t).increments(bodies.positions()[i], bodies.velocities()[i], dx, dv);
    return bodies.velocities()[i] + dv + bodies.accelerations()[i] * (t - h / Scalar(2));
  }

  /// As Epicycle::turn.
  Vector3<Scalar> spinAt(const Vector3<Scalar>& w, const Scalar& t) const {
    using std::cos;
    using std::sin;
    const Scalar angle = frame_.omega * t;
    const Scalar c(cos(angle)), s(sin(angle));
    return {c * w[0] + s * w[1], c * w[1] - s * w[0], w[2]};
  }
  Vector3<Scalar> spinAtStart(const Vector3<Scalar>& w, const Scalar& t) const {
    return spinAt(w, Scalar(-t));
  }
  Vector3<Scalar> frameSpin() const { return {Scalar(0), Scalar(0), frame_.omega}; }

  template <class B>
  Scalar workOf(const B& bodies, std::size_t i, const Vector3<Scalar>& shift) const {
    const Vector3<Scalar> x = bodies.positions()[i];
    return Vector3<Scalar>(bodies.accelerations()[i]).dot(shift) -
           (frame_.potential(Vector3<Scalar>(x + shift)) - frame_.potential(x));
  }

  template <class B>
  void push(B& bodies, std::size_t i, const Scalar& share, const std::array<Vector3<Scalar>, 3>& strokes,
            const Scalar& t) {
    const Vector3<Scalar> blow = share * Vector3<Scalar>(strokes[0] + strokes[1] + strokes[2]);
    Vector3<Scalar> dx, dv;
    Epicycle<Scalar>(frame_, Scalar(-t)).increments(Vector3<Scalar>::Zero(), blow, dx, dv);
    bodies.positions()[i] += dx;
    bodies.velocities()[i] += blow + dv;
    renew(bodies, i);
  }

 private:
  struct Motion {
    Vector3<Scalar> v;
    Vector3<Scalar> a;
  };

  template <class B>
  void renew(const B& bodies, std::size_t i) {
    Vector3<Scalar> dx, dv;
    drift_.increments(bodies.positions()[i], bodies.velocities()[i], dx, dv);
    motion_[i] = {dx / h_, dv / h_};
  }

  HillFrame<Scalar> frame_;
  Scalar h_;
  Epicycle<Scalar> drift_;
  std::vector<Motion> motion_;
};

}  // namespace gravel
