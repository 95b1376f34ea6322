#pragma once

/// \file
/// The loop of kicks, drifts and force evaluations, for every method that is a row of a table.

#include <gravel/core/parallel.hpp>
#include <gravel/core/rounded.hpp>
#include <gravel/dynamics/compensation.hpp>
#include <gravel/dynamics/integrator_tables.hpp>
#include <gravel/dynamics/rotation.hpp>

namespace gravel {

namespace detail {

constexpr std::size_t bodyGrain = 512;

/// v += a kick; then x += v drift, and the orientation with it, of one body; one that is held stays.
template <Real Scalar, class Layout>
void kickAndDriftOne(Bodies<Scalar, Layout>& bodies, std::size_t i, const Scalar& kick, const Scalar& drift,
                     bool torques, Compensation<Scalar>* lost) {
  const auto body = bodies[i];
  if (body.isHeld()) {
    return;
  }
  const auto times = [](const auto& rate, const Scalar& time) {
    return rounded(Vector3<Scalar>(rate * time));
  };
  if (!(kick == Scalar(0))) {
    if (lost != nullptr) {
      (*lost)[i].velocity.add(body.velocity(), times(body.acceleration(), kick));
    } else {
      body.velocity() += times(body.acceleration(), kick);
    }
    if (torques) {
      body.angularVelocity() += times(body.angularAcceleration(), kick);
    }
  }
  if (!(drift == Scalar(0))) {
    if (lost != nullptr) {
      (*lost)[i].position.add(body.position(), times(body.velocity(), drift));
    } else {
      body.position() += times(body.velocity(), drift);
    }
    const Vector3<Scalar> spin = body.angularVelocity();
    if (!equalIsSame<Scalar> || !(spin.squaredNorm() == Scalar(0))) {
      body.orientation() = rotated(Quaternion<Scalar>(body.orientation()), spin, drift);
    }
  }
}

/// The same for a tile of movable bodies, the first of which is i; those from `end` on are none.
template <Real Scalar, class Layout>
[[gnu::flatten]] void kickAndDriftTile(Bodies<Scalar, Layout>& bodies, std::size_t i, std::size_t end,
                                       const Scalar& kick, const Scalar& drift, bool torques,
                                       Compensation<Scalar>* lost) {
  if constexpr (hasColumns<typename Bodies<Scalar, Layout>::Storage>) {
    using Lane = BodyTile<Scalar>;
    auto& storage = bodies.storage();
    const auto tiles = [&](auto field) {
      return std::array{tileOf(storage, field, 0, i), tileOf(storage, field, 1, i),
                        tileOf(storage, field, 2, i)};
    };
    const auto times = [](auto& rates, const Scalar& time) {
      return std::array<Lane, 3>{rounded<Lane>(rates[0] * time), rounded<Lane>(rates[1] * time),
                                 rounded<Lane>(rates[2] * time)};
    };
    const auto add = [&](auto& sums, const std::array<Lane, 3>& terms, std::size_t row) {
      if (lost != nullptr) {
        lost->addTile(i, row, sums, terms);
      } else {
        for (std::size_t c = 0; c < 3; ++c) {
          sums[c] += terms[c];
        }
      }
    };
    auto v = tiles(fields::Velocity{});
    auto w = tiles(fields::AngularVelocity{});
    if (!(kick == Scalar(0))) {
      auto a = tiles(fields::Acceleration{});
      add(v, times(a, kick), 3);
      for (std::size_t c = 0; torques && c < 3; ++c) {
        w[c] += rounded<Lane>(tileOf(storage, fields::AngularAcceleration{}, c, i) * kick);
      }
    }
    if (!(drift == Scalar(0))) {
      auto x = tiles(fields::Position{});
      add(x, times(v, drift), 0);
      const Lane spins = w[0].abs() + w[1].abs() + w[2].abs();
      if (!(spins.sum() == Scalar(0))) {
        for (std::size_t k = i; k < std::min(i + tileWidth, end); ++k) {
          const Vector3<Scalar> spin = bodies[k].angularVelocity();
          if (!(spin.squaredNorm() == Scalar(0))) {
            bodies[k].orientation() = rotated(Quaternion<Scalar>(bodies[k].orientation()), spin, drift);
          }
        }
      }
    }
  }
}

/// Both for all bodies, in one pass. `torques` tells whether any angular acceleration can differ from zero.
template <Real Scalar, class Layout>
void kickAndDrift(Bodies<Scalar, Layout>& bodies, const Scalar& kick, const Scalar& drift, bool torques,
                  Compensation<Scalar>* lost) {
  parallelForChunks<Share::Alike>(bodies.size(), bodyGrain, [&](std::size_t begin, std::size_t end) {
    forTilesOrBodies(
        bodies.storage(), begin, end,
        [&](std::size_t i) { kickAndDriftTile(bodies, i, end, kick, drift, torques, lost); },
        [&](std::size_t i) { kickAndDriftOne(bodies, i, kick, drift, torques, lost); }, heldFlags);
  });
}

/// The forces at x + shift a(x) in place of those at x. Positions are what they were afterwards, to the bit.
template <Real Scalar, class Layout, class Forces>
void extrapolateForces(Bodies<Scalar, Layout>& bodies, const Scalar& shift, Forces&& forces) {
  std::vector<Vector3<Scalar>> places(bodies.size());
  parallelFor(bodies.size(), bodyGrain, [&](std::size_t i) {
    const auto body = bodies[i];
    places[i] = body.position();
    if (!body.isHeld()) {
      body.position() += body.acceleration() * shift;
    }
  });
  forces();
  parallelFor(bodies.size(), bodyGrain, [&](std::size_t i) { bodies[i].position() = places[i]; });
}

}  // namespace detail

/// Nothing to do between the first kick and the first drift.
struct NoDeparture {
  explicit operator bool() const { return false; }
  template <class Scalar>
  void operator()(const Scalar&) const {}
};

/// Advances all bodies by one step h [s]. Accelerations must be those of the present positions, and are at
/// the end. \throws std::invalid_argument for a kind whose traits have no stages, or a step that is not
/// finite \param forces  called with the part of h that has passed [s]: accelerations at the present
/// positions; as
///   often as the traits' forceEvaluations say
/// \param departure  if it holds, called once with the time of the first kick [s], after it and before the
///   first drift; it may change velocities and spins
/// \param arrival  called once, when positions are final and the last forces are not yet evaluated
/// \param lost  carries what sums lose to rounding from step to step; nullptr: nothing is carried
/// Cost: the force evaluations and, for s stages, s + 1 passes over the bodies. Bits do not depend on the
/// number of threads.
template <Real Scalar, class Layout, class Forces, class Arrival, class Departure = NoDeparture>
void integrate(IntegratorKind kind, Bodies<Scalar, Layout>& bodies, const Scalar& h, bool torques,
               Forces&& forces, Arrival&& arrival, Departure&& departure = {},
               Compensation<Scalar>* lost = nullptr) {
  const IntegratorTraits method = traitsOf(kind);
  if (method.stages.empty()) {
    detail::refuse("integrator", method.name, "one that has stages of kicks and drifts");
  }
  detail::require("step", h, detail::anyFinite<Scalar>());
  if (!Compensation<Scalar>::carries) {
    lost = nullptr;
  }
  if (lost != nullptr) {
    lost->resize(bodies.size());
  }
  const std::size_t stages = method.stages.size();
  Scalar passed(0);
  for (std::size_t k = 0; k < stages; ++k) {
    const IntegratorStage& stage = method.stages[k];
    const Scalar kick = detail::fromTable<Scalar>(stage.kick) * h;
    const Scalar drift = detail::fromTable<Scalar>(stage.drift) * h;
    if (stage.gradient != 0) {
      const Scalar shift = detail::fromTable<Scalar>(stage.gradient) * h * h;
      detail::extrapolateForces(bodies, shift, [&] { forces(passed); });
    }
    if (k == 0 && departure) {
      detail::kickAndDrift(bodies, kick, Scalar(0), torques, lost);
      departure(kick);
      detail::kickAndDrift(bodies, Scalar(0), drift, torques, lost);
    } else {
      detail::kickAndDrift(bodies, kick, drift, torques, lost);
    }
    if (k + 1 == stages) {
      arrival();
    }
    passed += drift;
    forces(k + 1 == stages ? h : passed);
  }
  detail::kickAndDrift(bodies, Scalar(detail::fromTable<Scalar>(method.lastKick) * h), Scalar(0), torques,
                       lost);
}

}  // namespace gravel
