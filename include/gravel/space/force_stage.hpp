#pragma once

/// \file
/// All accelerations of a step: mutual gravity, the uniform field, the user's own force.

#include <gravel/contact/contact.hpp>
#include <gravel/core/callback.hpp>
#include <gravel/core/profiler.hpp>
#include <gravel/dynamics/integrator.hpp>
#include <gravel/gravity/gravity_solver.hpp>
#include <gravel/output/energy_ledger.hpp>
#include <gravel/space/hook_work.hpp>

#include <span>
#include <vector>

namespace gravel {

/// The user's own force: adds to `bodies.forces()` [N] and `bodies.torques()` [N m] at time t [s]. It is
/// called from one thread once per force evaluation, with the velocities of that moment as far as they are
/// known (in methods of several drifts those of a stage); mind that it may read them and must change nothing
/// else. Massless tracers have no force to add to. What it throws, a force that is not finite
/// (std::invalid_argument), or another number of bodies (std::logic_error) ends the step half way: bodies
/// have moved then, and the time has not.
template <Real Scalar, class Layout>
using ForceHook = Callback<void(Bodies<Scalar, Layout>&, Scalar)>;

/// By how much velocities and spins are behind positions where forces are found, half a step after the first
/// kick. The hook sees them as the last accelerations would bring them up (else a force that depends on them
/// is of first order, and a magnetic one makes energy).
template <Real Scalar>
struct Behind {
  Scalar velocities = Scalar(0);             ///< [s] of the last accelerations
  Scalar spins = Scalar(0);                  ///< [s] of the last angular ones
  std::span<const Vector3<Scalar>> kicks{};  ///< [m s^-1] besides, by body; empty for none

  bool any() const { return velocities > Scalar(0) || spins > Scalar(0) || !kicks.empty(); }
};

/// What contacts did to velocities [m s^-1] and spins [rad/s] in the first half of a step, by body. In the
/// second half they will do nearly the same, so that what rests is seen at rest.
template <Real Scalar>
struct ContactKicks {
  std::vector<Vector3<Scalar>> velocities, spins;
  void clear() {
    velocities.clear();
    spins.clear();
  }
};

template <Real Scalar, class Layout>
class ForceStage {
 public:
  Vector3<Scalar> field = Vector3<Scalar>::Zero();  ///< [m s^-2], acts on movable bodies
  ForceHook<Scalar, Layout> hook;
  GravitySolver<Scalar> gravity;
  HookWork<Scalar, Layout> hookWork;
  ContactKicks<Scalar> contactKicks;  ///< where there is a hook, until the next evaluation; empty for none

  bool hasTorques() const { return static_cast<bool>(hook); }

  /// Why no body pulls another, or nullptr.
  const char* reasonToSkip(const Bodies<Scalar, Layout>& bodies, const Scalar& G) const {
    if (G == Scalar(0)) {
      return "G is 0";
    }
    if (bodies.size() < 2) {
      return "fewer than two bodies";
    }
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (Scalar(bodies[i].mass()) > Scalar(0)) {
        return nullptr;
      }
    }
    return "no body has mass";
  }

  /// Sets force, torque, acceleration and angular acceleration of every body at the present positions.
  /// \param behind  what the hook sees is brought up by that
  void evaluate(Bodies<Scalar, Layout>& bodies, const Scalar& G, const Scalar& softening,
                const Domain<Scalar>& domain, const Scalar& time, Profiler& profiler,
                const Behind<Scalar>& behind = {}) {
    const std::size_t n = bodies.size();
    ahead_ = hook && behind.any();
    if (ahead_) {
      bringUp(bodies, behind);
    }
    if (hook) {
      hookForces_.resize(n);
    }
    const char* reason = reasonToSkip(bodies, G);
    if (reason == nullptr) {
      gravity.setDomain(domain, time);
      const Profiler::Scope scope(profiler, Phase::Gravity);
      profiler.method(Phase::Gravity, gravity.name(gravity.asMany(bodies.masses())));
      gravity.accelerations(bodies.positions(), bodies.masses(), G, softening, bodies.accelerations());
    } else {
      profiler.skip(Phase::Gravity, reason);
    }
    parallelForChunks<Share::Alike>(n, detail::bodyGrain, [&](std::size_t begin, std::size_t end) {
      detail::forTilesOrBodies(
          bodies.storage(), begin, end, [&](std::size_t i) { finishTile(bodies, i, reason == nullptr); },
          [&](std::size_t i) { finishOne(bodies, i, reason == nullptr); });
      for (std::size_t i = begin; hook && i < end; ++i) {
        readyForHook(bodies, i);
      }
    });
    if (hook) {
      addHook(bodies, time);
    }
  }

  /// Of a hook that is gone.
  static void clearTorques(Bodies<Scalar, Layout>& bodies) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].torque() = Vector3<Scalar>::Zero().eval();
      bodies[i].angularAcceleration() = Vector3<Scalar>::Zero().eval();
    }
  }

  /// Mutual gravity, with that of images, and the field [J]. O(N^2) by the direct sum, O(N) by expansions,
  /// with their error.
  Scalar potentialEnergy(const Bodies<Scalar, Layout>& bodies, const Scalar& G, const Scalar& softening,
                         const Domain<Scalar>& domain, const Scalar& time) {
    Scalar energy(0);
    const bool ownImages = bodies.size() == 1 && !domain.isOpen() && !(G == Scalar(0));
    if (reasonToSkip(bodies, G) == nullptr || ownImages) {
      gravity.setDomain(domain, time);
      energy += gravity.potentialEnergy(bodies.positions(), bodies.masses(), G, softening);
    }
    if (!(field.squaredNorm() == Scalar(0))) {
      energy += fieldEnergy(bodies, field);
    }
    return energy;
  }

  /// Force of gravity and field on body i, without the user's own [N].
  Vector3<Scalar> conservativeForce(const Bodies<Scalar, Layout>& bodies, std::size_t i) const {
    Vector3<Scalar> force = bodies.forces()[i];
    if (hook && i < hookForces_.size()) {
      force -= hookForces_[i];
    }
    return force;
  }

  /// What the hook gave to the present forces [N], by body; empty without one.
  std::span<const Vector3<Scalar>> hookForces() const { return hookForces_; }

  /// The same, three numbers a body; empty without one, and if it was asked for other bodies than these n.
  /// For a restart.
  std::vector<Scalar> hookParts(std::size_t n) const {
    std::vector<Scalar> parts;
    for (std::size_t i = 0; hook && hookForces_.size() == n && i < n; ++i) {
      parts.insert(parts.end(), {hookForces_[i][0], hookForces_[i][1], hookForces_[i][2]});
    }
    return parts;
  }
  /// Bodies are in a new order: that at order[i] stands at i.
  std::vector<Vector3<Scalar>> hookForcesIn(std::span<const std::size_t> order) const {
    std::vector<Vector3<Scalar>> forces = hookForces_;
    for (std::size_t i = 0; i < order.size() && forces.size() == order.size(); ++i) {
      forces[i] = hookForces_[order[i]];
    }
    return forces;
  }
  void setHookForces(std::vector<Vector3<Scalar>>&& forces) { hookForces_ = std::move(forces); }
  void setHookParts(const std::vector<Scalar>& parts) {
    hookForces_.clear();
    for (std::size_t i = 0; i + 2 < parts.size(); i += 3) {
      hookForces_.push_back(Vector3<Scalar>(parts[i], parts[i + 1], parts[i + 2]));
    }
  }

 private:
  /// The field's part of the acceleration, and the force.
  void finishOne(Bodies<Scalar, Layout>& bodies, std::size_t i, bool pulls) const {
    const auto body = bodies[i];
    auto&& a = body.acceleration();
    if (!pulls) {
      a = Vector3<Scalar>::Zero().eval();
    }
    if (body.isFixed()) {
      body.force() = a * Scalar(body.mass());
      a = Vector3<Scalar>::Zero().eval();
    } else {
      a += field;
      body.force() = a * Scalar(body.mass());
    }
  }

  /// The same for a tile of movable bodies.
  void finishTile(Bodies<Scalar, Layout>& bodies, std::size_t i, bool pulls) const {
    if constexpr (detail::hasColumns<typename Bodies<Scalar, Layout>::Storage>) {
      auto& storage = bodies.storage();
      const detail::BodyTile<Scalar> m = detail::tileOf(storage, fields::Mass{}, 0, i);
      for (std::size_t c = 0; c < 3; ++c) {
        auto a = detail::tileOf(storage, fields::Acceleration{}, c, i);
        const Scalar g = field[static_cast<Eigen::Index>(c)];
        a = pulls ? detail::BodyTile<Scalar>(a + g) : detail::BodyTile<Scalar>::Constant(Scalar(0) + g);
        detail::tileOf(storage, fields::Force{}, c, i) = a * m;
      }
    }
  }

  struct Motion {
    Vector3<Scalar> v;
    Vector3<Scalar> w;
  };

  void bringUp(const Bodies<Scalar, Layout>& bodies, const Behind<Scalar>& behind) {
    others_.resize(bodies.size());
    const bool touches = contactKicks.velocities.size() == bodies.size();
    parallelFor(bodies.size(), detail::bodyGrain, [&](std::size_t i) {
      const auto body = bodies[i];
      Vector3<Scalar> v = body.velocity();
      Vector3<Scalar> w = body.angularVelocity();
      if (!body.isHeld()) {
        v += behind.velocities * Vector3<Scalar>(body.acceleration());
        w += behind.spins * Vector3<Scalar>(body.angularAcceleration());
        if (!behind.kicks.empty()) {
          v += behind.kicks[i];
        }
        if (touches) {
          v += contactKicks.velocities[i];
          w += contactKicks.spins[i];
        }
      }
      others_[i] = {v, w};
    });
    contactKicks.clear();
  }

  /// Body i as the hook is to see it.
  void readyForHook(Bodies<Scalar, Layout>& bodies, std::size_t i) {
    const auto body = bodies[i];
    hookForces_[i] = body.force();
    body.torque() = Vector3<Scalar>::Zero().eval();
    if (ahead_) {
      const Motion now{body.velocity(), body.angularVelocity()};
      show(bodies, i);
      others_[i] = now;
    }
  }
  void show(Bodies<Scalar, Layout>& bodies, std::size_t i) const {
    if (ahead_) {
      bodies[i].velocity() = others_[i].v;
      bodies[i].angularVelocity() = others_[i].w;
    }
  }

  void addHook(Bodies<Scalar, Layout>& bodies, const Scalar& time) {
    const std::size_t n = bodies.size();
    try {
      hook(bodies, time);
      if (bodies.size() != n) {
        throw std::logic_error(detail::faultText("number of bodies after the force hook",
                                                 std::to_string(bodies.size()),
                                                 "the " + std::to_string(n) + " before it"));
      }
    } catch (...) {
      if (bodies.size() == n) {
        parallelFor(n, detail::bodyGrain, [&](std::size_t i) { show(bodies, i); });
      }
      throw;
    }
    const std::size_t wrong = orderedMin<Share::Alike>(
        n, detail::bodyGrain, n, [&](std::size_t i) { return take(bodies, i) ? n : i; });
    if (wrong < n) {
      const Vector3<Scalar> torque = bodies[wrong].torque();
      const bool ofForce = !isFinite(hookForces_[wrong]);
      detail::refuse((ofForce ? "force of the hook on body " : "torque of the hook on body ") +
                         std::to_string(toInteger(bodies[wrong].id())),
                     detail::formatVector(ofForce ? hookForces_[wrong] : torque), "finite");
    }
  }

  /// What the hook gave to body i, which moves as before again; false if it is not finite.
  bool take(Bodies<Scalar, Layout>& bodies, std::size_t i) {
    show(bodies, i);
    const auto body = bodies[i];
    const Vector3<Scalar> torque = body.torque();
    hookForces_[i] = Vector3<Scalar>(body.force()) - hookForces_[i];
    if (!isFinite(hookForces_[i]) || !isFinite(torque)) {
      return false;
    }
    if (!body.isFixed()) {
      body.acceleration() += body.accelerationBy(hookForces_[i]);
      const bool none = detail::equalIsSame<Scalar> && torque == Vector3<Scalar>::Zero();
      body.angularAcceleration() = none ? torque : body.angularAccelerationBy(torque);
    }
    return true;
  }

  std::vector<Vector3<Scalar>> hookForces_;
  bool ahead_ = false;          // the hook sees other motions than those of this moment
  std::vector<Motion> others_;  // these; while it sees them, those of this moment
};

}  // namespace gravel
