#pragma once

/// \file
/// What the user's own forces do to the energy of motion in a step.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/parallel.hpp>

#include <span>
#include <vector>

namespace gravel {

/// The mean of a force at both ends of a step times the way in between, however blows have bent it: what the
/// kicks of a step do but for (h^2/8m)(F_1^2 - F_0^2), which cancels from step to step. (The mean of its
/// power at both ends does the same on a smooth way, but is off by F.(v after - v before) times a part of the
/// step where something bounces.) Of torques it is the mean power, as how far a body turned is not known.
template <Real Scalar, class Layout>
class HookWork {
 public:
  using Bodies = gravel::Bodies<Scalar, Layout>;
  using Forces = std::span<const Vector3<Scalar>>;

  /// \param forces [N] at the start, by body; none counts as 0
  void begin(const Bodies& bodies, Forces forces) {
    forces_.assign(forces.begin(), forces.end());
    forces_.resize(bodies.size(), Vector3<Scalar>::Zero());
    ways_.assign(bodies.size(), Vector3<Scalar>::Zero());
    places_.resize(bodies.size());
    turning_ = turningPower(bodies);
    time_ = Scalar(0);
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

  /// [J] since the last begin(). \param forces [N] at the end
  Scalar end(const Bodies& bodies, Forces forces) const {
    const Scalar twice =
        orderedSum(bodies.size(), detail::bodyGrain, Scalar(0), [&](std::size_t begin, std::size_t end) {
          Scalar sum(0);
          for (std::size_t i = begin; i < end; ++i) {
            if (!bodies[i].isFixed() && bodies[i].inverseMass() > Scalar(0)) {
              sum += Vector3<Scalar>(forces_[i] + forces[i]).dot(ways_[i]);
            }
          }
          return sum;
        });
    return (twice + (turning_ + turningPower(bodies)) * time_) / Scalar(2);
  }

 private:
  /// Of the torques at the present spins [W].
  static Scalar turningPower(const Bodies& bodies) {
    return orderedSum(bodies.size(), detail::bodyGrain, Scalar(0), [&](std::size_t begin, std::size_t end) {
      Scalar sum(0);
      for (std::size_t i = begin; i < end; ++i) {
        const auto body = bodies[i];
        if (!body.isFixed() && body.inverseInertia() > Scalar(0)) {
          sum += Vector3<Scalar>(body.torque()).dot(Vector3<Scalar>(body.angularVelocity()));
        }
      }
      return sum;
    });
  }

  std::vector<Vector3<Scalar>> forces_, ways_, places_;  ///< by body: [N] at the start, [m], [m]
  Scalar turning_ = Scalar(0);
  Scalar time_ = Scalar(0);  ///< [s] since the start
};

}  // namespace gravel
