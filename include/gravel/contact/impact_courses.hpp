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
  using Base::histories_;
  using Base::isAnchored;
  using Base::isSetFree;
  using Side = ImpactSide<S>;

  /// A body that the blows of a moment t have lifted off what held it, with an acceleration s, falls freely
  /// from then on. The course x + u t - (a + s) t (h - t)/2, at u + (a + s)(t - h/2), goes on from the same
  /// place at the same velocity by a alone:
  ///     u' = u + s (t - h/2),   x' = x - t (u' - u) - s t (h - t)/2.
  /// Of its energy solves and blows have booked what would be so with the support to the end of the step.
  /// What the change of the course does to it is missing, m (u' - u).(u + a (t - h/2) + (u' - u)/2) for the
  /// velocity and, for the shift of x, the work of a. What held it must lean on something that does not move:
  /// of a pile in space the others would have to be pushed back for momentum's sake, and by which of its
  /// contacts is not known before the next solve.
  template <class Scene>
  bool letGo(const Scene& scene, std::span<const Pair> pairs, std::uint32_t i, const S& t,
             ImpactReport<S>& report) {
    if (!isSetFree(scene, pairs, i, t) || !isAnchored(scene, i)) {
      return false;
    }
    const Vector3<S> nothing = Vector3<S>::Zero();
    const S& h = scene.settings.h;
    const Vector3<S> dv = scene.velocityBySupport(i, t);
    const Vector3<S> v = scene.course.velocityAt(scene.bodies, i, t, h);
    const Vector3<S> shift = scene.supportOf(i) * (t * (t - h) / S(2));
    report.restitutionLoss -= S(scene.bodies.masses()[i]) * (dv.dot(Vector3<S>(v + dv / S(2))) -
                                                             scene.course.workOf(scene.bodies, i, shift));
    scene.bodies.positions()[i] += shift;
    scene.course.push(scene.bodies, i, S(1), {dv, nothing, nothing}, t);
    ImpactHistory<S>& past = histories_.at(i);
    past.free = true;
    ++past.impacts;  // what was foreseen of it is void
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

  /// Resistance to rolling and spinning, for what a blow of dv_n [m s^-1] along the normal left of the turn.
  /// \return its angular impulse, over the effective radius, and what it does to the energy, <= 0; both over
  ///   the effective mass
  template <class Scene>
  [[gnu::always_inline]] inline std::pair<Vector3<S>, S> resistTurn(const Scene& scene, std::uint32_t first,
                                                                    std::uint32_t second,
                                                                    const ImpactMeeting<S>& at,
                                                                    const MassShares<S>& share, const S& dv_n,
                                                                    const S& t) {
    const auto& [one, two, n, distance, a_n, drift, lead, material] = at;
    const bool boundary = second == staticPartner;
    Vector3<S> l = Vector3<S>::Zero();
    if (!(material.rollingFriction > S(0)) && !(material.spinningFriction > S(0))) {
      return {l, S(0)};
    }
    const S q1 = boundary ? S(1) : S(two.r / (one.r + two.r));
    const S q2 = boundary ? S(0) : S(one.r / (one.r + two.r));
    const S mobility = share.first * one.spin * q1 * q1 + share.second * two.spin * q2 * q2;
    if (!(mobility > S(0))) {
      return {l, S(0)};
    }
    const Vector3<S> s1 = one.r * scene.spin(first, t);
    const Vector3<S> s2 = boundary ? Vector3<S>(Vector3<S>::Zero()) : two.r * scene.spin(second, t);
    const Vector3<S> rho = q2 * s2 - q1 * s1;
    l = resistTurning<S>(Vector3<S>(rho / -mobility), n, dv_n, material.rollingFriction,
                         material.spinningFriction);
    twist(scene, first, share.first * q1 * one.spin, l, t);
    if (!boundary) {
      twist(scene, second, -share.second * q2 * two.spin, l, t);
    }
    return {l, l.dot(rho) + mobility * l.squaredNorm() / S(2)};
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
