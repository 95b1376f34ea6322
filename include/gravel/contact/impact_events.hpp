#pragma once

/// \file
/// Impacts inside a step, each at its own time and in their order.
/// A body drifts from x with velocity v through a step of length h while its acceleration a, taken as
/// constant, bends the path to x + v t - a t (h - t)/2, at v + a (t - h/2) (time_of_impact.hpp). A blow J at
/// t changes v by J/m and x by -t J/m: so afterwards the same drift, x + v h, ends where the body is after
/// both parts of its path, and the kick that ends the step is the same as without the blow. In a uniform
/// field that is exact; with forces that change along the way it is of second order in h.

#include <gravel/contact/collision_outcome.hpp>
#include <gravel/contact/contact_search.hpp>
#include <gravel/contact/impact_courses.hpp>
#include <gravel/core/memory.hpp>

namespace gravel {

/// Finds and deals the impacts of a step. Contacts that are solved together with others ("held") take no part
/// unless a blow drives one of their bodies into the other.
///
/// What bounces ever lower: where all bounces that are still to come, 2 e u / ((1 - e) |a_n|) after an
/// approach at u, end before the step does (with a_n the rate of that of the distance), the pair comes to
/// rest in this blow. It leaves with a hop that lands at the end of the step, where the solver of
/// simultaneous contacts takes it over.
///
/// Prediction is shared between threads, O(candidates + bodies x boundaries); blows follow one another in the
/// order of (time, keys), each O(candidates of its two bodies). The same bits for any number of threads.
template <Real S>
class ImpactEvents : private detail::ImpactCourses<S> {
  using Base = detail::ImpactCourses<S>;
  using Base::bouncesNoMore;
  using Base::flightOf;
  using Base::flights_;
  using Base::give;
  using Base::histories_;
  using Base::impacts_;
  using Base::late_;
  using Base::leans_;
  using Base::letGo;
  using Base::merges_;
  using Base::predictAll;
  using Base::queue_;
  using Base::remember;
  using Base::struck_;
  using Base::turns_;
  using Base::twist;
  using typename Base::Event;
  using typename Base::Side;

 public:
  using Base::foresees;

  /// Between the kick and the drift: changes positions, velocities and spins so that the drift ends where the
  /// bodies are after all impacts.
  /// \param near  `pairs()`: all that may touch in the step, sorted by ids; `version()`: changes with them, 0
  ///   if unknown; `follow(bodies, i, t, out)`: appends those that a new course of body i adds from t on
  /// \param held  contacts that are solved otherwise, sorted by keys
  /// \param nearWalls  indices of the bodies that may touch a boundary in the step; all without it
  /// \param decide  `decide(impact, material, v1, v2, v_rel)`, asked about each impact of two bodies that is
  ///   faster than what rests, with the velocities of the moment: a `CollisionOutcome`. Two that shall merge
  ///   stick to each other for the rest of the step.
  /// \param support  of bodies that are held: see detail::ImpactScene
  template <ContactBodies B, class Candidates, class Course = StraightCourse<S>, class Decide = NoDecision,
            class Support = NoSupport>
  ImpactReport<S> resolve(B& bodies, Candidates& near, const Domain<S>& domain,
                          const MaterialView<S>& materials, std::span<const HalfSpace<S>> walls,
                          std::span<const ContactName> held, const ImpactSettings<S>& settings,
                          std::optional<std::span<const std::uint32_t>> nearWalls = std::nullopt,
                          Course&& course = {}, const Decide& decide = {}, const Support& support = {}) {
    using Path = std::remove_reference_t<Course>;
    clear();
    this->cleared_ = false;
    const detail::ImpactScene<S, B, Path, Support> scene{bodies,   domain, materials, walls,      held,
                                                         settings, course, support,   &histories_};
    predictAll(scene, near.pairs(), nearWalls);
    ImpactReport<S> report;
    if (!queue_.empty()) {
      Base::prepare(bodies.size(), near.pairs().size(), held);
      flights_.forget(bodies.size());
      Base::link(bodies.size(), near);
    } else {
      Base::unlink();
    }
    S now(0);
    while (!queue_.empty() || !struck_.empty()) {
      if (!struck_.empty() && (queue_.empty() || queue_.front().t > now)) {
        for (const std::uint32_t i : struck_) {
          if (letGo(scene, near.pairs(), i, now, report)) {
            Base::goOn(scene, near, {i}, now);
          }
        }
        struck_.clear();
        continue;
      }
      const Event event = queue_.pop();
      if (queue_.isVoid(event, histories_)) {
        continue;
      }
      now = event.t;
      if (!strike(scene, event, decide, report)) {
        continue;
      }
      struck_.push_back(event.first);
      if (event.second != staticPartner) {
        struck_.push_back(event.second);
        Base::goOn(scene, near, {event.first, event.second}, now);
      } else {
        Base::goOn(scene, near, {event.first}, now);
      }
    }
    Base::end();
    report.impacts = impacts_.size();
    return report;
  }

  void clear() {
    if (!this->cleared_) {  // by the second time it would seem that nothing was filled
      Base::forget();
      detail::clearSpare(turns_);
      late_.clear();
    }
  }

  /// Pairs of ids that shall merge, in the order of the impacts of the last call.
  const BodyPairs& merges() const { return merges_; }
  /// Pairs that follow() added in the last call.
  const std::vector<Pair>& candidatesAdded() const { return late_.all(); }
  /// The blows of the last call, in the order in which they were dealt.
  const std::vector<Impact<S>>& impacts() const { return impacts_; }
  std::vector<Impact<S>>& impacts() { return impacts_; }
  /// Changes of spin of the last call, in that order.
  const std::vector<TurnChange<S>>& turns() const { return turns_; }

 private:
  using Meeting = detail::ImpactMeeting<S>;

  /// Nothing where the two are not near each other any more.
  template <class Scene>
  [[gnu::always_inline]] inline std::optional<Meeting> meetingAt(const Scene& scene, const Event& event) {
    const auto& bodies = scene.bodies;
    const std::uint32_t m1 = bodies.materials()[event.first];
    Meeting at;
    if (event.second == staticPartner) {
      const HalfSpace<S>& wall = scene.walls[event.wall];
      at.n = -wall.normal;
      at.distance = bodies.radii()[event.first];
      at.a_n = -at.n.dot(scene.acceleration(event.first));
      at.lead = wall.swing * (S(2) * event.t / scene.settings.h - S(1));
      at.drift = wall.velocity + at.lead * wall.normal;
      at.one = Side::of(scene, event.first, at.distance, event.t);
      at.material = scene.materials.pair(m1, wall.surface, wall.material);
      return at;
    }
    const detail::ImpactFlight<S> first = flights_.of(scene, event.first);
    const detail::ImpactFlight<S> second = flights_.of(scene, event.second);
    const RelativeFlight<S> flight = flightOf(scene, first, second, event.t, at.drift);
    const S& r1 = first.radius;
    const S& r2 = second.radius;
    // On the straight way of the drift, a h^2/8 at most from the parabola's: so the blow exerts no torque on
    // the drift's own positions, and keeps angular momentum to rounding. What cannot move has none to keep.
    const bool anchored = !detail::isMovable(bodies, event.first) || !detail::isMovable(bodies, event.second);
    const auto touch =
        sphereSphere<S>(anchored ? flight.place(event.t) : Vector3<S>(flight.r + flight.v * event.t), r1, r2,
                        event.key1, event.key2, scene.settings.epsilon, r1 + r2);
    if (!touch) {
      return std::nullopt;
    }
    // All meet at r1 + r2, where the rounding of the root errs the same way in each blow (about 1 the mean of
    // |n|^2 - 1 is 1.1e-16, and elastic gases gained that): so a multiple is made a unit again that differs
    // from blow to blow, also where all are in one plane.
    const S along = Vector3<S>(S(1.37), S(2.51), S(3.78)).dot(touch->normal);
    at.n = detail::safeUnit<S>(Vector3<S>((S(1) + detail::sizeOf<S>(along)) * touch->normal));
    at.distance = touch->distance;
    at.a_n = at.n.dot(flight.a);
    at.one = Side::of(scene, event.first, touch->arm1, event.t);
    at.two = Side::of(scene, event.second, touch->arm2, event.t);
    at.material = scene.materials.pair(m1, bodies.materials()[event.second]);
    return at;
  }

  /// Asks somebody else what comes of it, and does that. \param noise [m s^-1] of speeds along n
  /// \return whether it was anything but a bounce
  template <class Scene, class Decide>
  bool isDecidedBy(const Decide& decide, const Scene& scene, const Event& event, const Meeting& at,
                   const Vector3<S>& v_rel, const S& speed, const S& noise, ImpactReport<S>& report) {
    const auto& [one, two, n, distance, a_n, drift, lead, material] = at;
    const S& t = event.t;
    const Impact<S> impact{event.first, event.second, event.key1, event.key2, t, speed,
                           n,           distance,     {},         false,      t, true};
    // Two that stick, of which something else has struck one, stick again.
    const bool stick = Base::isToMerge(event.first, event.key2);
    CollisionOutcome<S> outcome =
        stick ? CollisionOutcome<S>::merge() : decide(impact, material, one.v, two.v, v_rel);
    if (outcome.kind == CollisionKind::Bounce) {
      return false;
    }
    impacts_.push_back(impact);
    const bool merges = outcome.kind == CollisionKind::Merge;
    if (merges) {
      if (!stick) {
        merges_.emplace_back(BodyId{event.key1}, BodyId{event.key2});
      }
      outcome = Base::asOne(scene, event, at, v_rel);
    }
    // Two that part may be driven together again in this step; others, for ever: the end's solve has them.
    const Vector3<S> v1 = one.movable ? outcome.velocity1 : one.v;
    const Vector3<S> v2 = two.movable ? outcome.velocity2 : two.v;
    const S parting = n.dot(Vector3<S>(v2 - v1 + drift));
    const bool ends = merges || !(parting > noise);
    impacts_.back().rests = ends && !merges;
    impacts_.back().parting = merges ? S(0) : parting;
    remember(scene, std::clamp<S>(impacts_.back().parting / speed, S(0), S(1)), report, ends);
    give(scene, event.first, one, outcome.velocity1, outcome.angularVelocity1, t, merges, report);
    give(scene, event.second, two, outcome.velocity2, outcome.angularVelocity2, t, merges, report);
    const S sheared = two.movable ? S(two.mass * Vector3<S>(v2 - two.v).dot(drift)) : S(0);
    report.restitutionLoss -= sheared;  // both as the first one sees them
    report.driftWork -= sheared;
    return true;
  }

  /// Deals a blow. \return whether a course changed
  template <class Scene, class Decide>
  bool strike(const Scene& scene, const Event& event, const Decide& decide, ImpactReport<S>& report) {
    const std::optional<Meeting> at = meetingAt(scene, event);
    if (!at) {
      return false;
    }
    const auto& [one, two, n, distance, a_n, drift, lead, material] = *at;
    const S& h = scene.settings.h;
    const S& t = event.t;
    const bool boundary = event.second == staticPartner;
    const Vector3<S> v_rel = two.v - one.v + drift;
    const S v_n = n.dot(v_rel);
    const S pull = Base::fallsBack(a_n, boundary ? S(0) : distance, Vector3<S>(v_rel - v_n * n));
    const S noise = detail::noiseAlong<S>(n, one.v, two.v, v_rel);
    const bool still = !(v_n + lead < -noise);
    // Lands at the end of the step, also on a wall that is to come on faster, by its mean.
    const S hop = pull * (h - t) / S(2) + std::max<S>(S(0), S(-lead));
    if (still && (!(pull > S(0)) || !(hop - v_n > noise))) {
      report.grazes += v_n + lead < S(0) ? 1U : 0U;
      return false;  // nothing presses them together, or they leave already, as fast as they would
    }
    const S speed = v_n < S(0) ? S(-v_n) : S(0);
    // In a heap, where both lean on others or stand, what a step's fall brings along what holds them is rest.
    S fall(0);
    if ((!one.movable || leans_[event.first] != 0) && (!two.movable || leans_[event.second] != 0)) {
      fall = h * scene.heldAlong(event.first, event.second, n);
    }
    const S threshold = std::max<S>(scene.settings.restitutionThreshold, fall);
    const bool bounces = speed > threshold && !bouncesNoMore(scene, event.first) &&
                         (boundary || !bouncesNoMore(scene, event.second));
    const S e = bounces ? restitutionAt(material, speed) : S(0);
    if constexpr (!std::is_same_v<Decide, NoDecision>) {
      if (!boundary && speed > threshold &&
          isDecidedBy(decide, scene, event, *at, v_rel, speed, noise, report)) {
        return true;
      }
    }
    const bool ends = pull > S(0) && (still || S(2) * e * speed <= (S(1) - e) * pull * (h - t));
    const bool rests = ends || (lead < S(0) && !(e * speed > -lead));  // or the wall is as fast as it
    const S target = rests ? hop : S(e * speed);

    const MassShares<S> share = massShares<S>(one.mass, one.movable, two.mass, two.movable);
    const S dv_n = target - v_n;
    const Vector3<S> slip = v_rel - v_n * n - Vector3<S>(one.c * one.s + two.c * two.s).cross(n);
    const auto [dv_t, l, q1, q2, gripWork, fling] =
        Base::gripOf(*at, boundary, share, slip, dv_n, bounces ? material.tangentialRestitution : S(0));
    // In two strokes, stop and rebound: a head-on blow then ends at exactly e times its speed.
    const std::array<Vector3<S>, 3> strokes{S(-v_n) * n, target * n, dv_t};
    if (share.first > S(0)) {
      scene.course.push(scene.bodies, event.first, S(-share.first), strokes, t);
    }
    const Vector3<S> torque = n.cross(dv_t);
    twist(scene, event.first, share.first * one.spin, Vector3<S>(one.c * torque + q1 * l), t);
    if (!boundary) {
      if (share.second > S(0)) {
        scene.course.push(scene.bodies, event.second, share.second, strokes, t);
      }
      twist(scene, event.second, share.second * two.spin, Vector3<S>(two.c * torque - q2 * l), t);
    }
    const S& m = share.effective;
    report.restitutionLoss -=
        m * dv_n * ((v_n + target) / S(2) - n.dot(Vector3<S>(two.supported - one.supported)));
    report.frictionLoss -= m * gripWork;
    report.driftWork -= m * Vector3<S>(dv_n * n + dv_t).dot(drift);
    impacts_.push_back({event.first,
                        event.second,
                        event.key1,
                        event.key2,
                        t,
                        speed,
                        n,
                        distance,
                        {m * dv_n, m * dv_t, m * l, true},
                        rests || !(target > fall),
                        ends && e < S(1) ? S(t + S(2) * e * speed / ((S(1) - e) * pull)) : t});
    impacts_.back().fling = fling;
    remember(scene, e, report);
    return true;
  }
};

}  // namespace gravel
