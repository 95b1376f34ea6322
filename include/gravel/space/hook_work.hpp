#pragma once

/// \file
/// What the user's own forces do to the energy of motion in a step.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/dynamics/integrator.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace gravel {

/// Kicks at both ends of a free drift do the mean of a force at both ends times the way in between, however
/// blows have bent it, but for (h^2/8m)(F_1^2 - F_0^2), which cancels from step to step. Where velocities
/// turn on the way, along an epicycle or an orbit, they do the mean power at both ends; so does what comes
/// near the integral of the power on smooth ways in several drifts, whose ends cancel. But that is off by
/// F.(v after - v before) times a part of the step where something bounces: there the way counts. Of torques
/// it is the mean power always, as how far a body turned is not known.
template <Real Scalar, class Layout>
class HookWork {
 public:
  using Bodies = gravel::Bodies<Scalar, Layout>;
  using Forces = std::span<const Vector3<Scalar>>;

  /// \param forces [N] at the start, by body; what is missing counts as 0, as where none were asked for yet
  /// \param free  bodies drift straight ahead, once
  void begin(const Bodies& bodies, Forces forces, bool free) {
    forces_.assign(forces.begin(), forces.end());
    ways_.assign(bodies.size(), Vector3<Scalar>::Zero());
    places_.resize(bodies.size());
    power_ = powerOf(bodies, forces_);
    time_ = Scalar(0);
    byWay_ = free;
  }

  /// Around what moves bodies. \param time [s] that it takes
  void depart(const Bodies& bodies) {
    parallelFor(bodies.size(), detail::bodyGrain, [&](std::size_t i) { places_[i] = bodies[i].position(); });
  }
  void arrive(const Bodies& bodies, const Scalar& time) {
    parallelFor(bodies.size(), detail::bodyGrain,
                [&](std::size_t i) { ways_[i] += Vector3<Scalar>(bodies[i].position()) - places_[i]; });
    time_ += time;
  }
  /// Something touches: velocities have jumped.
  void bend() { byWay_ = true; }

  /// [J] since the last begin(). \param forces [N] at the end
  Scalar end(const Bodies& bodies, Forces forces) const {
    using Sums = Eigen::Array<Scalar, 2, 1>;
    const Sums power = powerOf(bodies, forces) + power_;
    const Scalar pushed =
        byWay_ ? sumOver(bodies, Scalar(0),
                         [&](std::size_t i) {
                           return bodies[i].inverseMass() > Scalar(0)
                                      ? Scalar(Vector3<Scalar>(of(forces_, i) + of(forces, i)).dot(ways_[i]))
                                      : Scalar(0);
                         })
               : Scalar(power[0] * time_);
    return (pushed + power[1] * time_) / Scalar(2);
  }

 private:
  static Vector3<Scalar> of(Forces forces, std::size_t i) {
    return i < forces.size() ? forces[i] : Vector3<Scalar>(Vector3<Scalar>::Zero());
  }

  /// Of what is not fixed.
  template <class T, class F>
  static T sumOver(const Bodies& bodies, const T& zero, F&& f) {
    return orderedSum(bodies.size(), detail::bodyGrain, zero, [&](std::size_t begin, std::size_t end) {
      T sum = zero;
      for (std::size_t i = begin; i < end; ++i) {
        sum += bodies[i].isFixed() ? zero : T(f(i));
      }
      return sum;
    });
  }

  /// Of forces and of torques at the present velocities and spins [W].
  static Eigen::Array<Scalar, 2, 1> powerOf(const Bodies& bodies, Forces forces) {
    using Sums = Eigen::Array<Scalar, 2, 1>;
    return sumOver(bodies, Sums(Sums::Zero()), [&](std::size_t i) {
      const auto body = bodies[i];
      const auto product = [](bool moves, const Vector3<Scalar>& force, const Vector3<Scalar>& velocity) {
        return moves ? Scalar(force.dot(velocity)) : Scalar(0);
      };
      return Sums(product(body.inverseMass() > Scalar(0), of(forces, i), body.velocity()),
                  product(body.inverseInertia() > Scalar(0), body.torque(), body.angularVelocity()));
    });
  }

  std::vector<Vector3<Scalar>> forces_, ways_, places_;  ///< by body: [N] at the start, [m], [m]
  Eigen::Array<Scalar, 2, 1> power_ = Eigen::Array<Scalar, 2, 1>::Zero();  ///< [W] at the start
  Scalar time_ = Scalar(0);                                                ///< [s] since then
  bool byWay_ = true;
};

}  // namespace gravel
