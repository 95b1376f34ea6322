#pragma once

/// \file
/// What the user's own forces do to the energy of motion in a step.

#include <gravel/bodies/bodies.hpp>
#include <gravel/contact/impact.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/dynamics/integrator.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace gravel {

/// Under a force F_0 that is held for h, in one part or several, the work is F_0 times the way x, however
/// blows bend it: they meet the velocities that F_0 gives by then. The last kick makes up for what has
/// become of the force, F_1 - F_0, and does (F_1 - F_0).v h/2 with v the velocity of the step's middle that
/// the last drift leaves; so that the sum is
///     F_0.x + (F_1 - F_0).v h/2,
/// but for (h^2/8m)(F_1^2 - F_0^2), which cancels from step to step. (The mean force times x is the same
/// where nothing bounces, but where a force turns with the velocity in a blow, as drag does, it is off by
/// (F_1 - F_0).(v after - v before) h/4, of one sign.) Where velocities turn on the way, along an epicycle or
/// an orbit, kicks do the mean power at both ends of each part; so does what comes near the integral of the
/// power on smooth ways in several drifts, whose ends cancel. But that is off by F.(v after - v before) times
/// a part of the step where something bounces: there the way counts. Of torques it is the mean power, and for
/// a blow at t that gives the spin dw, torque.dw (h/2 - t) besides.
template <Real Scalar, class Layout>
class HookWork {
 public:
  using Bodies = gravel::Bodies<Scalar, Layout>;
  using Forces = std::span<const Vector3<Scalar>>;

  /// \param forces [N] at the start, by body; what is missing counts as 0, as where none were asked for yet
  /// \param free  bodies drift straight ahead, once
  void begin(const Bodies& bodies, Forces forces, bool free) {
    const std::size_t n = bodies.size();
    forces_.assign(forces.begin(), forces.end());
    torques_.resize(n);
    parallelFor(n, detail::bodyGrain, [&](std::size_t i) { torques_[i] = bodies[i].torque(); });
    ways_.assign(n, Vector3<Scalar>::Zero());
    places_.resize(n);
    middles_.resize(n);
    power_ = powerOf(bodies, forces_, torques_);
    done_ = Sums::Zero();
    crossed_ = Scalar(0);
    time_ = Scalar(0);
    byWay_ = free;
  }

  /// Before what moves bodies.
  void depart(const Bodies& bodies) {
    parallelFor(bodies.size(), detail::bodyGrain, [&](std::size_t i) { places_[i] = bodies[i].position(); });
  }
  /// After it. \param time [s] that it takes
  void arrive(const Bodies& bodies, const Scalar& time) {
    late_ = time_ / Scalar(2);
    parallelFor(bodies.size(), detail::bodyGrain, [&](std::size_t i) {
      ways_[i] += Vector3<Scalar>(bodies[i].position()) - places_[i];
      middles_[i] = middleOf(bodies, i);
    });
    time_ += time;
  }
  /// Velocities jumped where bodies crossed the edge of a sheared domain, before the last kick of a part of
  /// `time` [s], which works on what they are now.
  void cross(const Bodies& bodies, const Scalar& time) {
    crossed_ += sumOver(bodies, Scalar(0), [&](std::size_t i) {
      const Vector3<Scalar> jump = middleOf(bodies, i) - middles_[i];
      middles_[i] += jump;
      return bodies[i].inverseMass() > Scalar(0) ? Scalar(of(forces_, i).dot(jump) * (time / Scalar(2)))
                                                 : Scalar(0);
    });
  }
  /// Blows of a drift of `time` [s] that is to come changed spins.
  void turn(std::span<const TurnChange<Scalar>> turns, const Scalar& time) {
    for (const TurnChange<Scalar>& turn : turns) {
      done_[1] +=
          torques_[turn.body].dot(Vector3<Scalar>(turn.after - turn.before)) * (time / Scalar(2) - turn.time);
    }
  }
  /// A part of `time` [s] is over.
  void endPart(const Bodies& bodies, const Scalar& time) {
    const Sums power = powerOf(bodies, forces_, torques_);
    done_ += (power_ + power) * (time / Scalar(2));
    power_ = power;
  }
  /// Something touches: velocities have jumped.
  void bend() { byWay_ = true; }

  /// [m s^-2] by which a force that is now `forces` differs from what it was.
  Vector3<Scalar> changeOf(const Bodies& bodies, Forces forces, std::size_t i) const {
    return bodies[i].accelerationBy(of(forces, i) - of(forces_, i));
  }

  /// [J] since the last begin(), after the last endPart(). \param forces [N] at the end
  Scalar end(const Bodies& bodies, Forces forces) {
    parallelFor(bodies.size(), detail::bodyGrain, [&](std::size_t i) { torques_[i] = bodies[i].torque(); });
    const Scalar half = time_ / Scalar(2);
    const Sums change = (powerOf(bodies, forces, torques_) - power_) * half;
    Scalar pushed = done_[0] + change[0];
    if (byWay_) {
      pushed = crossed_ + sumOver(bodies, Scalar(0), [&](std::size_t i) {
                 const Vector3<Scalar> F_0 = of(forces_, i);
                 const Vector3<Scalar> dF = of(forces, i) - F_0;
                 return bodies[i].inverseMass() > Scalar(0)
                            ? Scalar(F_0.dot(ways_[i]) + dF.dot(middles_[i]) * half)
                            : Scalar(0);
               });
    }
    return pushed + done_[1] + change[1];
  }

 private:
  using Sums = Eigen::Array<Scalar, 2, 1>;

  static Vector3<Scalar> of(Forces forces, std::size_t i) {
    return i < forces.size() ? forces[i] : Vector3<Scalar>(Vector3<Scalar>::Zero());
  }

  /// [m s^-1] of the step's middle, after a drift. What is held is not kicked.
  Vector3<Scalar> middleOf(const Bodies& bodies, std::size_t i) const {
    const auto body = bodies[i];
    const Scalar late = body.isHeld() ? Scalar(0) : late_;
    return Vector3<Scalar>(body.velocity()) - late * Vector3<Scalar>(body.acceleration());
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
  static Sums powerOf(const Bodies& bodies, Forces forces, Forces torques) {
    return sumOver(bodies, Sums(Sums::Zero()), [&](std::size_t i) {
      const auto body = bodies[i];
      const auto product = [](bool moves, const Vector3<Scalar>& force, const Vector3<Scalar>& velocity) {
        return moves ? Scalar(force.dot(velocity)) : Scalar(0);
      };
      return Sums(product(body.inverseMass() > Scalar(0), of(forces, i), body.velocity()),
                  product(body.isTurnable(), of(torques, i), body.angularVelocity()));
    });
  }

  std::vector<Vector3<Scalar>> forces_, torques_, ways_, places_;  ///< by body; [N], [N m] at the start
  std::vector<Vector3<Scalar>> middles_;  ///< [m s^-1] of the step's middle, as the last drift leaves it
  Sums power_ = Sums::Zero();             ///< [W] at the start of the part
  Sums done_ = Sums::Zero();              ///< [J] until then
  Scalar crossed_ = Scalar(0);            ///< [J] that the way leaves out
  Scalar time_ = Scalar(0);               ///< [s] since the start
  Scalar late_ = Scalar(0);               ///< [s] by which the last drift was later than the step's middle
  bool byWay_ = true;
};

}  // namespace gravel
