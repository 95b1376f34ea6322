#pragma once

/// \file
/// What the blows of a step do to the courses of bodies.

#include <gravel/contact/collision_outcome.hpp>
#include <gravel/contact/impact_forecast.hpp>
#include <gravel/contact/slip_and_turn.hpp>

namespace gravel::detail {

template <Real S>
class ImpactCourses : protected ImpactForecast<S> {
  using Base = ImpactForecast<S>;

 public:
  using Base::foresees;

 protected:
  using Base::flightOf;
  using Base::flights_;
  using Base::histories_;
  using Base::isAnchored;
  using Base::isListed;
  using Base::leans_;
  using Base::pairsOf_;
  using typename Base::Flight;
  using Side = ImpactSide<S>;

  /// Whether blows have set a body free that leans on others: what bears it and what lies on it opens at
  /// `from`, faster than it falls by in a step; what touches its sides does not count.
  template <class Scene>
  bool isSetFree(const Scene& scene, std::span<const Pair> pairs, std::uint32_t body, const S& from) {
    const Vector3<S> support = scene.supportOf(body);
    if (leans_[body] == 0 || support == Vector3<S>::Zero()) {
      return false;
    }
    const S size = detail::safeNorm(support);
    bool borne = false;
    // A contact that pushes the body along n, and opens at speed u.
    const auto holds = [&](const Vector3<S>& n, const S& u) {
      const S share = n.dot(support);
      borne = borne || share > size / S(1000);
      return sizeOf<S>(share) > size / S(1000) && !(u > size * scene.settings.h);
    };
    const auto pairHolds = [&](std::uint32_t k) {
      const auto& [i, j] = pairs[k];
      if (!isListed(scene.held, {scene.bodies.ids()[i], scene.bodies.ids()[j]}, k)) {
        return false;
      }
      const Flight one = flights_.of(scene, i);
      const Flight two = flights_.of(scene, j);
      Vector3<S> drift;
      const RelativeFlight<S> flight = flightOf(scene, one, two, from, drift);
      const Vector3<S> r = flight.place(from);
      const S reach = one.radius + two.radius;
      if (!(detail::safeNorm(r) <= reach * (S(1) + detail::restingMargin<S>()))) {
        return false;  // moved apart by overlaps with others: it bears nothing, and is not in every list
      }
      const Vector3<S> n = detail::safeUnit(r);
      return holds(body == i ? Vector3<S>(-n) : n, n.dot(flight.velocity(from)));
    };
    if (pairsOf_.any(body, pairs, pairHolds)) {
      return false;
    }
    for (const HalfSpace<S>& wall : scene.walls) {
      if (isListed(scene.held, {scene.bodies.ids()[body], boundaryKey(wall.number)}) &&
          holds(wall.normal,
                wall.normal.dot(flightOf(scene, flights_.of(scene, body), wall).velocity(from)))) {
        return false;
      }
    }
    return borne;
  }

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

  /// The body leaves with this velocity and spin. What spins lose is friction's, unless two merge.
  template <class Scene>
  void give(const Scene& scene, std::uint32_t i, const Side& side, const Vector3<S>& v, const Vector3<S>& w,
            const S& t, bool merges, ImpactReport<S>& report) {
    if (!side.movable) {
      return;
    }
    const Vector3<S> nothing = Vector3<S>::Zero();
    const Vector3<S> before = scene.spin(i, t);
    report.restitutionLoss -=
        side.mass * Vector3<S>(v - side.v).dot(Vector3<S>(Vector3<S>(v + side.v) / S(2) - side.supported));
    (merges ? report.restitutionLoss : report.frictionLoss) -=
        gainOfSpin<S>(scene.bodies.inertiaFactors()[i], side.mass, side.r, before, w);
    scene.course.push(scene.bodies, i, S(1), {Vector3<S>(v - side.v), nothing, nothing}, t);
    const Vector3<S> byTorque = spinByTorque<S>(scene.bodies, i, t, scene.settings.h);
    turn(scene, i, Vector3<S>(scene.course.spinAtStart(Vector3<S>(w - byTorque), t)), t);
  }

  /// [m s^-2] >= 0, by which the distance d of two, 0 to a boundary, falls back: d'' = n.a + v_t^2/d.
  static S fallsBack(const S& a_n, const S& d, const Vector3<S>& v_t) {
    const S rate = d > S(0) ? S(a_n + v_t.squaredNorm() / d) : a_n;
    return rate < S(0) ? S(-rate) : S(0);
  }

  /// What two that shall merge have until then, as one rigid body with their momentum and angular momentum.
  /// What pulls them together they have besides as speed of parting, so that they end the step no nearer to
  /// each other than they met. (In flight through each other they would pull each other at any strength.)
  /// About what cannot move: rest.
  template <class Scene>
  static CollisionOutcome<S> asOne(const Scene& scene, const ImpactEvent<S>& event,
                                   const ImpactMeeting<S>& at, const Vector3<S>& v_rel) {
    const auto& [one, two, n, distance, a_n, drift, lead, material] = at;
    const MassShares<S> share = massShares<S>(one.mass, one.movable, two.mass, two.movable);
    CollisionOutcome<S> to;
    to.angularVelocity1 = scene.spin(event.first, event.t);
    to.angularVelocity2 = scene.spin(event.second, event.t);
    Vector3<S> dv = -v_rel;
    if (share.first > S(0) && share.second > S(0)) {
      // Moments of inertia over M d^2, with the mass M of both.
      const auto momentOf = [&](std::uint32_t i, const ImpactSide<S>& side, const S& shareOfMass) {
        const S x = side.r / at.distance;
        return S(S(scene.bodies.inertiaFactors()[i]) * x * x * shareOfMass);
      };
      const S i1 = momentOf(event.first, one, share.second);
      const S i2 = momentOf(event.second, two, share.first);
      const S both = i1 + i2;
      const S orbit = share.first * share.second;
      const Vector3<S> spins = i1 * to.angularVelocity1 + i2 * to.angularVelocity2;
      const Vector3<S> about = spins.dot(n) * n;
      const Vector3<S> across = (spins - about + orbit * n.cross(v_rel) / distance) / (both + orbit);
      to.angularVelocity1 = both > S(0) ? Vector3<S>(across + about / both) : across;
      to.angularVelocity2 = to.angularVelocity1;
      dv += across.cross(n) * distance;
    }
    const S pull = fallsBack(a_n, distance, Vector3<S>(v_rel + dv));
    dv += (pull * (scene.settings.h - event.t) / S(2)) * n;
    to.velocity1 = one.v - share.first * dv;
    to.velocity2 = two.v + share.second * dv;
    return to;
  }

  template <class Scene>
  void twist(const Scene& scene, std::uint32_t i, const S& mobility, const Vector3<S>& stroke, const S& t) {
    const S r = scene.bodies.radii()[i];
    if (!(mobility == S(0)) && r > S(0) && (!detail::equalIsSame<S> || !(stroke == Vector3<S>::Zero()))) {
      const Vector3<S> before = scene.bodies.angularVelocities()[i];
      turn(scene, i, Vector3<S>(before - (mobility / r) * scene.course.spinAtStart(stroke, t)), t);
    }
  }

  /// What surfaces do to each other in a blow: friction, and resistance to rolling and spinning. Of the
  /// second side, over the effective mass.
  struct Grip {
    Vector3<S> dv_t = Vector3<S>::Zero();  ///< across the normal
    Vector3<S> l = Vector3<S>::Zero();     ///< angular impulse over the effective radius
    S q1 = S(0);                           ///< effective radius / radius
    S q2 = S(0);
    S work = S(0);   ///< of both, less that of dv_t on what supports bodies
    S fling = S(0);  ///< restitution of a slip that sticks
  };

  /// \param slip [m s^-1] across n \param dv_n [m s^-1] of the blow, along the normal
  /// \param restitution  of the slip
  static Grip gripOf(const ImpactMeeting<S>& at, bool boundary, const MassShares<S>& share,
                     const Vector3<S>& slip, const S& dv_n, const S& restitution) {
    const auto& [one, two, n, distance, a_n, drift, lead, material] = at;
    Grip grip;
    if (material.rollingFriction > S(0) || material.spinningFriction > S(0)) {
      grip.q1 = boundary ? S(1) : S(two.r / (one.r + two.r));
      grip.q2 = boundary ? S(0) : S(one.r / (one.r + two.r));
    }
    const auto m = SlipAndTurn<S>::of(S(1), one.c, grip.q1, S(share.first * one.spin), two.c, grip.q2,
                                      S(share.second * two.spin));
    const Vector3<S> rho = grip.q2 * two.s - grip.q1 * one.s;
    const auto [j, l] = gripImpulses<S>(m, slip, rho, n, dv_n,
                                        {material.staticFriction, material.kineticFriction,
                                         material.rollingFriction, material.spinningFriction},
                                        restitution);
    grip.dv_t = j;
    grip.l = l;
    const bool sticks = (S(1) + restitution) * safeNorm(slip) < material.staticFriction * dv_n * m.slip;
    grip.fling = sticks ? restitution : S(0);
    const Vector3<S> rhoRubbed = rho + m.both * n.cross(j);
    grip.work = j.dot(Vector3<S>(slip + (m.slip / S(2)) * j - (two.supported - one.supported))) +
                l.dot(Vector3<S>(rhoRubbed + (m.turn / S(2)) * l));
    return grip;
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
