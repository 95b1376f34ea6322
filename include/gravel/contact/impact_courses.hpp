#pragma once

/// \file
/// What the blows of a step do to the courses of bodies.

#include <gravel/contact/impact_forecast.hpp>

namespace gravel::detail {

template <Real S>
class ImpactCourses : protected ImpactForecast<S> {
  using Base = ImpactForecast<S>;

 public:
  using Base::foresees;

 protected:
  using Base::history_;
  using Base::isSetFree;
  using Side = ImpactSide<S>;

  /// A body that the blows of a moment have lifted off what holds it falls freely from t on, from the same
  /// place x + v t - a t (h - t)/2 at the same velocity v + a (t - h/2), by the other a. Solves counted on
  /// the support for the whole step: what that takes of the energy is given back.
  template <class Scene>
  bool letGo(const Scene& scene, std::span<const Pair> pairs, std::uint32_t i, const S& t,
             ImpactReport<S>& report) {
    if (!isSetFree(scene, pairs, i, t)) {
      return false;
    }
    const Vector3<S> nothing = Vector3<S>::Zero();
    const S& h = scene.settings.h;
    const Vector3<S> dv = scene.velocityBySupport(i, t);
    const Vector3<S> v = scene.course.velocityAt(scene.bodies, i, t, h);
    const Vector3<S> shift = scene.supportOf(i) * (t * (t - h) / S(2));
    report.restitutionLoss -= S(scene.bodies.masses()[i]) *
                              (dv.dot(Vector3<S>(v + dv / S(2))) - scene.freeAcceleration(i).dot(shift));
    scene.bodies.positions()[i] += shift;
    scene.course.push(scene.bodies, i, S(1), {dv, nothing, nothing}, t);
    history_[i].free = true;
    ++history_[i].impacts;  // what was foreseen of it is void
    return true;
  }

  /// The body leaves with this velocity and spin.
  template <class Scene>
  void give(const Scene& scene, std::uint32_t i, const Side& side, const Vector3<S>& v, const Vector3<S>& w,
            const S& t, ImpactReport<S>& report) {
    if (!side.movable) {
      return;
    }
    const Vector3<S> nothing = Vector3<S>::Zero();
    const Vector3<S> before = scene.spin(i, t);
    const S moment = S(scene.bodies.inertiaFactors()[i]) * side.mass * side.r * side.r;
    report.restitutionLoss -=
        side.mass * Vector3<S>(v - side.v).dot(Vector3<S>(Vector3<S>(v + side.v) / S(2) - side.supported));
    report.frictionLoss -= moment * Vector3<S>(w - before).dot(Vector3<S>(w + before)) / S(2);
    scene.course.push(scene.bodies, i, S(1), {Vector3<S>(v - side.v), nothing, nothing}, t);
    turn(scene, i, Vector3<S>(scene.course.spinAtStart(w, t)), t);
  }

  template <class Scene>
  void twist(const Scene& scene, std::uint32_t i, const S& mobility, const Vector3<S>& stroke, const S& t) {
    const S r = scene.bodies.radii()[i];
    if (!(mobility == S(0)) && r > S(0) && !(stroke == Vector3<S>::Zero())) {
      const Vector3<S> before = scene.bodies.angularVelocities()[i];
      turn(scene, i, Vector3<S>(before - (mobility / r) * scene.course.spinAtStart(stroke, t)), t);
    }
  }

  /// From t on the body turns as if it had begun the step with spin w.
  template <class Scene>
  void turn(const Scene& scene, std::uint32_t i, const Vector3<S>& w, const S& t) {
    turns_.push_back({i, t, Vector3<S>(scene.bodies.angularVelocities()[i]), w});
    scene.bodies.angularVelocities()[i] = w;
  }

  std::vector<TurnChange<S>> turns_;
};

}  // namespace gravel::detail
