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
    for (auto* const column : {&forces_, &ways_, &places_, &middles_}) {
      column->resize(n);
    }
    turns_ = orderedSum(n, detail::bodyGrain, std::size_t{0}, [&](std::size_t begin, std::size_t end) {
               std::size_t turning = 0;
               for (std::size_t i = begin; i < end; ++i) {
                 const auto body = bodies[i];
                 forces_[i] = of(forces, i);
                 places_[i] = body.position();
                 turning += isNone(body.torque()) ? 0U : 1U;
               }
               return turning;
             }) > 0;
    torques_.resize(turns_ ? n : 0);
    parallelFor(torques_.size(), detail::bodyGrain, [&](std::size_t i) { torques_[i] = bodies[i].torque(); });
    done_ = Sums::Zero();
    crossed_ = Scalar(0);
    time_ = Scalar(0);
    departed_ = false;
    byWay_ = free;
    power_ = needsPower() ? powerOf(bodies) : Sums(Sums::Zero());
  }

  /// Before what moves bodies, but for the first time after begin().
  void depart(const Bodies& bodies) {
    parallelFor(bodies.size(), detail::bodyGrain, [&](std::size_t i) { places_[i] = bodies[i].position(); });
  }
  /// After it. \param time [s] that it takes
  void arrive(const Bodies& bodies, const Scalar& time) {
    late_ = time_ / Scalar(2);
    parallelFor(bodies.size(), detail::bodyGrain, [&](std::size_t i) {
      const Vector3<Scalar> way = Vector3<Scalar>(bodies[i].position()) - places_[i];
      ways_[i] = departed_ ? Vector3<Scalar>(ways_[i] + way) : way;
      middles_[i] = middleOf(bodies, i);
    });
    departed_ = true;
    time_ += time;
  }
  /// Velocities jumped where bodies crossed the edge of a sheared domain, before the last kick of a part of
  /// `time` [s], which works on what they are now.
  void cross(const Bodies& bodies, const Scalar& time) {
    crossed_ += sumOver(bodies, Scalar(0), [&](std::size_t i) {
      const Vector3<Scalar> jump = middleOf(bodies, i) - middles_[i];
      middles_[i] += jump;
      return bodies[i].inverseMass() > Scalar(0) ? Scalar(forces_[i].dot(jump) * (time / Scalar(2)))
                                                 : Scalar(0);
    });
  }
  /// Blows of a drift of `time` [s] that is to come changed spins.
  void turn(std::span<const TurnChange<Scalar>> turns, const Scalar& time) {
    for (const TurnChange<Scalar>& turn : turns) {
      done_[1] += of(torques_, turn.body).dot(Vector3<Scalar>(turn.after - turn.before)) *
                  (time / Scalar(2) - turn.time);
    }
  }
  /// A part of `time` [s] is over.
  void endPart(const Bodies& bodies, const Scalar& time) {
    if (needsPower()) {
      const Sums power = powerOf(bodies);
      done_ += (power_ + power) * (time / Scalar(2));
      power_ = power;
    }
  }
  /// Something touches: velocities have jumped.
  void bend() { byWay_ = true; }

  /// [m s^-2] by which a force that is now `forces` differs from what it was.
  Vector3<Scalar> changeOf(const Bodies& bodies, Forces forces, std::size_t i) const {
    return bodies[i].accelerationBy(of(forces, i) - forces_[i]);
  }

  /// [J] since the last begin(), after the last endPart(). \param forces [N] at the end
  Scalar end(const Bodies& bodies, Forces forces) {
    const Scalar half = time_ / Scalar(2);
    const Sums sums = sumOver(bodies, Sums(Sums::Zero()), [&](std::size_t i) {
      const auto body = bodies[i];
      const Vector3<Scalar> F_1 = of(forces, i);
      const Scalar turning = turningPower(body, body.torque());
      if (!byWay_) {
        return Sums(pushingPower(body, F_1), turning);
      }
      const Scalar work = forces_[i].dot(ways_[i]) + (F_1 - forces_[i]).dot(middles_[i]) * half;
      return Sums(body.inverseMass() > Scalar(0) ? work : Scalar(0), turning);
    });
    const Sums change = (sums - power_) * half;
    const Scalar pushed = byWay_ ? Scalar(crossed_ + sums[0]) : Scalar(done_[0] + change[0]);
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

  static bool isNone(const Vector3<Scalar>& vector) {
    return detail::equalIsSame<Scalar> && vector == Vector3<Scalar>::Zero();
  }
  /// Whether anything will be made of the power at the start: not where the way counts and nothing turns.
  bool needsPower() const { return !byWay_ || turns_; }

  /// Of a force and of a torque at the present velocity and spin of a body [W].
  template <class Body>
  static Scalar pushingPower(const Body& body, const Vector3<Scalar>& force) {
    return body.inverseMass() > Scalar(0) ? Scalar(force.dot(Vector3<Scalar>(body.velocity()))) : Scalar(0);
  }
  template <class Body>
  static Scalar turningPower(const Body& body, const Vector3<Scalar>& torque) {
    return !isNone(torque) && body.isTurnable() ? Scalar(torque.dot(Vector3<Scalar>(body.angularVelocity())))
                                                : Scalar(0);
  }
  /// Of all forces and torques of the start.
  Sums powerOf(const Bodies& bodies) const {
    return sumOver(bodies, Sums(Sums::Zero()), [&](std::size_t i) {
      const auto body = bodies[i];
      return Sums(pushingPower(body, forces_[i]), turningPower(body, of(torques_, i)));
    });
  }

  std::vector<Vector3<Scalar>> forces_, ways_, places_;  ///< by body; [N] at the start
  std::vector<Vector3<Scalar>> torques_;                 ///< [N m] at the start, if any `turns_`
  std::vector<Vector3<Scalar>> middles_;  ///< [m s^-1] of the step's middle, as the last drift leaves it
  Sums power_ = Sums::Zero();             ///< [W] at the start of the part
  Sums done_ = Sums::Zero();              ///< [J] until then
  Scalar crossed_ = Scalar(0);            ///< [J] that the way leaves out
  Scalar time_ = Scalar(0);               ///< [s] since the start
  Scalar late_ = Scalar(0);               ///< [s] by which the last drift was later than the step's middle
  bool byWay_ = true;
  bool turns_ = false;     ///< some torque was not 0 at the start
  bool departed_ = false;  ///< since the start
};

}  // namespace gravel
