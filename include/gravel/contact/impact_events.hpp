#pragma once

/// \file
/// Impacts inside a step, each at its own time and in their order.
///
/// A body drifts from x with velocity v through a step of length h while its acceleration a, taken as
/// constant, bends the path to x + v t - a t (h - t)/2, at v + a (t - h/2) (time_of_impact.hpp). A blow J at
/// t changes v by J/m and x by -t J/m: so afterwards the same drift, x + v h, ends where the body is after
/// both parts of its path, and the kick that ends the step is the same as without the blow. In a uniform
/// field that is exact; with forces that change along the way it is of second order in h.

#include <gravel/contact/collision_outcome.hpp>
#include <gravel/contact/contact.hpp>
#include <gravel/contact/contact_bodies.hpp>
#include <gravel/contact/contact_settings.hpp>
#include <gravel/contact/time_of_impact.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/spatial/pair.hpp>

#include <array>
#include <numeric>
#include <optional>
#include <vector>

namespace gravel {

template <Real Scalar>
struct ImpactSettings {
  Scalar time = Scalar(0);                  ///< [s] at the start, for a sheared domain
  Scalar h = Scalar(0);                     ///< [s] >= 0
  Scalar restitutionThreshold = Scalar(0);  ///< [m s^-1] a slower approach stops
  Scalar epsilon = Scalar(0);               ///< [m] centres closer than this count as one point
  /// What approaches a body after so many impacts of it in the step is left to the solver of simultaneous
  /// contacts, which ends every cascade. An impact counts 1 - e + 1/32, since only those that lose energy can
  /// go on for ever; further bounces from the same partner, of which the number is bounded otherwise, 1/32.
  Scalar mostPerBody = Scalar(8);
};

/// One blow.
template <Real Scalar>
struct Impact {
  std::uint32_t first;   ///< index of the body of the smaller id
  std::uint32_t second;  ///< index of the other, or `staticPartner`
  std::uint64_t key1;
  std::uint64_t key2;
  Scalar time;                     ///< [s] since the start of the step
  Scalar speed;                    ///< [m s^-1] of approach
  Vector3<Scalar> normal;          ///< from the first to the second
  Scalar distance;                 ///< [m] of the centres; to a boundary the radius
  ContactImpulse<Scalar> impulse;  ///< on the second
  bool rests;                      ///< it stays in contact for the rest of the step
  Scalar settle;  ///< [s] since the start of the step: when the last of its bounces is over, if it rests
  bool decided = false;  ///< by somebody else's outcome: the two take no notice of each other in this step
};

/// A body that began to turn otherwise inside the step.
template <Real Scalar>
struct TurnChange {
  std::uint32_t body;
  Scalar time;  ///< [s] since the start of the step
  Vector3<Scalar> before;
  Vector3<Scalar> after;
};

template <Real Scalar>
struct ImpactReport {
  std::size_t impacts = 0;
  std::size_t postponed = 0;  ///< bodies that reached `mostPerBody`
  Scalar restitutionLoss = Scalar(0);
  Scalar frictionLoss = Scalar(0);
  Scalar driftWork = Scalar(0);
};

/// Nobody else decides what an impact does.
struct NoDecision {};

/// Candidates that are known to suffice for every course that a body may take.
struct FixedCandidates {
  std::span<const Pair> list;

  std::span<const Pair> pairs() const { return list; }
  static std::uint64_t version() { return 0; }
  template <class B, class S>
  void follow(const B&, std::uint32_t, const S&, std::vector<Pair>&) {}
};

/// How bodies drift: straight on. A course tells the mean velocity of body i over the step, x + v h being the
/// place at its end, and the acceleration that bends its path; and deals a blow so that the same drift ends
/// where the body is afterwards.
template <Real S>
struct StraightCourse {
  template <class B>
  Vector3<S> velocity(const B& bodies, std::size_t i) const {
    return bodies.velocities()[i];
  }
  template <class B>
  Vector3<S> acceleration(const B& bodies, std::size_t i) const {
    return bodies.accelerations()[i];
  }
  /// Velocity [m s^-1] at t [s] since the start of the step of length h.
  template <class B>
  Vector3<S> velocityAt(const B& bodies, std::size_t i, const S& t, const S& h) const {
    return velocity(bodies, i) + acceleration(bodies, i) * (t - h / S(2));
  }
  /// \param strokes changes of velocity [m s^-1] one after another, each to be multiplied by `share`
  /// \param t [s] since the start of the step
  template <class B>
  void push(B& bodies, std::size_t i, const S& share, const std::array<Vector3<S>, 3>& strokes, const S& t) {
    const Vector3<S> before = bodies.velocities()[i];
    for (const Vector3<S>& dv : strokes) {
      bodies.velocities()[i] += share * dv;
    }
    bodies.positions()[i] -= t * Vector3<S>(Vector3<S>(bodies.velocities()[i]) - before);
  }
};

/// Finds and deals the impacts of a step. Contacts that are solved together with others ("held") take no part
/// unless a blow drives one of their bodies into the other.
///
/// What bounces ever lower: where all bounces that are still to come, 2 e u / ((1 - e) |a_n|) after an
/// approach at u, end before the step does, the pair comes to rest in this blow. It leaves with a hop that
/// lands at the end of the step, where the solver of simultaneous contacts takes it over.
///
/// Prediction is shared between threads, O(candidates + bodies x boundaries); blows follow one another in the
/// order of (time, keys), each O(candidates of its two bodies). The same bits for any number of threads.
template <Real S>
class ImpactEvents {
 public:
  /// Between the kick and the drift: changes positions, velocities and spins so that the drift ends where the
  /// bodies are after all impacts.
  /// \param near  `pairs()`: candidates sorted by ids, every pair that may touch in the step; `version()`: a
  /// number that changes with them, 0 if unknown; `follow(bodies, i, h, out)` appends those that a new course
  /// of body i adds \param held contacts that are solved otherwise, sorted by keys \param nearWalls indices
  /// of the bodies that may touch a boundary in the step; all without it
  /// \param decide  asked about each impact of two bodies that is faster than what rests: `decide(impact,
  /// material, v1, v2, v_rel)` with the velocities of the moment gives a `CollisionOutcome`. Two that shall
  /// merge fly on through each other for the rest of the step.
  template <ContactBodies B, class Candidates, class Course = StraightCourse<S>, class Decide = NoDecision>
  ImpactReport<S> resolve(B& bodies, Candidates& near, const Domain<S>& domain,
                          std::span<const Material<S>> materials, std::span<const HalfSpace<S>> walls,
                          std::span<const Contact<S>> held, const ImpactSettings<S>& settings,
                          std::optional<std::span<const std::uint32_t>> nearWalls = std::nullopt,
                          Course&& course = {}, const Decide& decide = {}) {
    using Path = std::remove_reference_t<Course>;
    clear();
    const Scene<B, Path> scene{bodies, domain, materials, walls, held, settings, course};
    predictAll(scene, near.pairs(), nearWalls);
    ImpactReport<S> report;
    if (!queue_.empty()) {
      for (const std::uint32_t i : touched_) {
        history_[i] = History{};
      }
      touched_.clear();
      history_.resize(bodies.size());
      leans_.assign(bodies.size(), 0);
      for (const Contact<S>& c : held) {
        leans_[c.first] = 1;
        if (c.second != staticPartner) {
          leans_[c.second] = 1;
        }
      }
      if (linked_ != near.version() || near.version() == 0 || start_.size() != bodies.size() + 1) {
        link(bodies.size(), near.pairs());
        linked_ = near.version();
      }
    }
    while (!queue_.empty()) {
      std::pop_heap(queue_.begin(), queue_.end(), after);
      const Event event = queue_.back();
      queue_.pop_back();
      const bool second = event.second != staticPartner;
      if (history_[event.first].impacts != event.stamp1 ||
          (second && history_[event.second].impacts != event.stamp2)) {
        continue;
      }
      if (!strike(scene, event, decide, report)) {
        continue;
      }
      near.follow(bodies, event.first, settings.h, late_);
      if (second) {
        near.follow(bodies, event.second, settings.h, late_);
      }
      predictAgain(scene, near.pairs(), event.first, event.t);
      if (second) {
        predictAgain(scene, near.pairs(), event.second, event.t);
      }
    }
    report.impacts = impacts_.size();
    return report;
  }

  void clear() {
    impacts_.clear();
    earlier_.clear();
    turns_.clear();
    merges_.clear();
    late_.clear();
  }

  /// Pairs of ids that shall merge, in the order of the impacts of the last call.
  const std::vector<std::pair<std::uint64_t, std::uint64_t>>& merges() const { return merges_; }
  /// Pairs that follow() added in the last call.
  const std::vector<Pair>& candidatesAdded() const { return late_; }
  /// The blows of the last call, in the order in which they were dealt.
  const std::vector<Impact<S>>& impacts() const { return impacts_; }
  /// Changes of spin of the last call, in that order.
  const std::vector<TurnChange<S>>& turns() const { return turns_; }

 private:
  template <class B, class Course>
  struct Scene {
    B& bodies;
    const Domain<S>& domain;
    std::span<const Material<S>> materials;
    std::span<const HalfSpace<S>> walls;
    std::span<const Contact<S>> held;
    const ImpactSettings<S>& settings;
    Course& course;

    /// Mean velocity of the drift and acceleration; none of what nothing moves.
    Vector3<S> velocity(std::uint32_t i) const {
      return detail::isMovable(bodies, i) ? Vector3<S>(course.velocity(bodies, i))
                                          : Vector3<S>(Vector3<S>::Zero());
    }
    Vector3<S> acceleration(std::uint32_t i) const {
      return detail::isMovable(bodies, i) ? Vector3<S>(course.acceleration(bodies, i))
                                          : Vector3<S>(Vector3<S>::Zero());
    }
  };

  struct Event {
    S t;
    std::uint32_t first;
    std::uint32_t second;
    std::uint64_t key1;
    std::uint64_t key2;
    std::uint32_t stamp1 = 0;
    std::uint32_t stamp2 = 0;
    std::uint32_t wall = 0;
  };

  static bool after(const Event& a, const Event& b) {
    if (a.t != b.t) {
      return b.t < a.t;
    }
    return a.key1 != b.key1 ? b.key1 < a.key1 : b.key2 < a.key2;
  }

  static constexpr std::size_t chunk = 2048;
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  /// A body's impacts so far.
  struct History {
    std::uint32_t impacts = 0;
    std::uint32_t rests = none;  ///< the last one that rests, of which this is the first body
    std::uint64_t partner = 0;   ///< of the last one
    S spent = S(0);
  };

  /// Motion of the second as seen from the first, `drift` of its image included.
  template <class Scene>
  static RelativeFlight<S> flightOf(const Scene& scene, std::uint32_t i, std::uint32_t j, Vector3<S>& drift) {
    Vector3<S> r = Vector3<S>(scene.bodies.positions()[j]) - Vector3<S>(scene.bodies.positions()[i]);
    drift = Vector3<S>::Zero();
    scene.domain.minimumImage(r, drift, scene.settings.time);
    return {r, scene.velocity(j) - scene.velocity(i) + drift, scene.acceleration(j) - scene.acceleration(i),
            scene.settings.h};
  }

  template <class Scene>
  static RelativeFlight<S> flightOf(const Scene& scene, std::uint32_t i, const HalfSpace<S>& wall) {
    return {Vector3<S>(scene.bodies.positions()[i]) - wall.offset * wall.normal,
            scene.velocity(i) - wall.velocity, scene.acceleration(i), scene.settings.h};
  }

  // Prediction.

  template <class Scene>
  void predictAll(const Scene& scene, std::span<const Pair> pairs,
                  const std::optional<std::span<const std::uint32_t>>& nearWalls) {
    const std::size_t bodiesFrom = (pairs.size() + chunk - 1) / chunk;
    const std::size_t n = scene.walls.empty() ? 0 : nearWalls ? nearWalls->size() : scene.bodies.size();
    const std::size_t count = bodiesFrom + (n + chunk - 1) / chunk;
    parts_.resize(std::max(parts_.size(), count));
    // No body gets further from where it starts than |v| h + |a| h^2/8.
    ways_.resize(scene.bodies.size());
    const S& h = scene.settings.h;
    parallelFor(ways_.size(), chunk, [&](std::size_t k) {
      const auto i = static_cast<std::uint32_t>(k);
      ways_[k] = h * detail::safeNorm(scene.velocity(i)) + h * h * detail::safeNorm(scene.acceleration(i));
    });
    parallelForTasks(count, [&](std::size_t c) {
      parts_[c].clear();
      if (c < bodiesFrom) {
        predictPairs(scene, pairs.subspan(c * chunk, std::min(chunk, pairs.size() - c * chunk)), parts_[c]);
      } else {
        const std::size_t begin = (c - bodiesFrom) * chunk;
        for (std::size_t k = begin; k < std::min(begin + chunk, n); ++k) {
          predictWalls(scene, nearWalls ? (*nearWalls)[k] : static_cast<std::uint32_t>(k), parts_[c]);
        }
      }
    });
    queue_.clear();
    for (std::size_t c = 0; c < count; ++c) {
      queue_.insert(queue_.end(), parts_[c].begin(), parts_[c].end());
    }
    std::make_heap(queue_.begin(), queue_.end(), after);
  }

  template <class Scene>
  void predictPairs(const Scene& scene, std::span<const Pair> pairs, std::vector<Event>& out) const {
    const S& h = scene.settings.h;
    auto next = scene.held.begin();
    bool placed = false;
    for (const Pair& pair : pairs) {
      const std::uint32_t i = pair.first;
      const std::uint32_t j = pair.second;
      const S reach = S(scene.bodies.radii()[i]) + S(scene.bodies.radii()[j]);
      // The common case, before anything else is loaded: not near enough.
      Vector3<S> drift = Vector3<S>::Zero();
      Vector3<S> r = Vector3<S>(scene.bodies.positions()[j]) - Vector3<S>(scene.bodies.positions()[i]);
      scene.domain.minimumImage(r, drift, scene.settings.time);
      S far = reach + ways_[i] + ways_[j];
      if (!(drift == Vector3<S>::Zero())) {
        far += h * detail::safeNorm(drift);
      }
      if (r.squaredNorm() > far * far) {
        continue;
      }
      const std::uint64_t key1 = scene.bodies.ids()[i];
      const std::uint64_t key2 = scene.bodies.ids()[j];
      if (!placed) {
        next = lowerBound(scene.held, key1, key2);
        placed = true;
      }
      while (next != scene.held.end() && keysOf(*next) < std::pair(key1, key2)) {
        ++next;
      }
      if ((next != scene.held.end() && keysOf(*next) == std::pair(key1, key2)) ||
          !detail::canTouch(scene.bodies, i, j)) {
        continue;
      }
      if (const auto t = timeOfImpact<S>(flightOf(scene, i, j, drift), reach, S(0))) {
        out.push_back({*t, i, j, key1, key2});
      }
    }
  }

  template <class Scene>
  static void predictWalls(const Scene& scene, std::uint32_t i, std::vector<Event>& out) {
    const S radius = scene.bodies.radii()[i];
    if (!(radius > S(0)) || !detail::isMovable(scene.bodies, i)) {
      return;
    }
    for (std::uint32_t w = 0; w < scene.walls.size(); ++w) {
      const RelativeFlight<S> flight = flightOf(scene, i, scene.walls[w]);
      if (const auto t = timeOfImpact<S>(flight, scene.walls[w].normal, radius, S(0))) {
        const std::uint64_t key1 = scene.bodies.ids()[i];
        const std::uint64_t key2 = boundaryKey(scene.walls[w].number);
        const auto found = lowerBound(scene.held, key1, key2);
        if (found == scene.held.end() || keysOf(*found) != std::pair(key1, key2)) {
          out.push_back({*t, i, staticPartner, key1, key2, 0, 0, w});
        }
      }
    }
  }

  static std::pair<std::uint64_t, std::uint64_t> keysOf(const Contact<S>& c) { return {c.key1, c.key2}; }

  static auto lowerBound(std::span<const Contact<S>> held, std::uint64_t key1, std::uint64_t key2) {
    return std::partition_point(held.begin(), held.end(),
                                [&](const Contact<S>& c) { return keysOf(c) < std::pair(key1, key2); });
  }

  /// Pairs of each body, as places in the list.
  void link(std::size_t n, std::span<const Pair> pairs) {
    start_.assign(n + 1, 0);
    for (const Pair& pair : pairs) {
      ++start_[pair.first];
      ++start_[pair.second];
    }
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    ofBody_.resize(2 * pairs.size());
    for (std::size_t k = pairs.size(); k-- > 0;) {
      ofBody_[--start_[pairs[k].first]] = static_cast<std::uint32_t>(k);
      ofBody_[--start_[pairs[k].second]] = static_cast<std::uint32_t>(k);
    }
  }

  template <class Scene>
  void predictAgain(const Scene& scene, std::span<const Pair> pairs, std::uint32_t body, const S& from) {
    if (isDone(scene, body)) {
      return;
    }
    for (std::uint32_t k = start_[body]; k < start_[body + 1]; ++k) {
      predict(scene, pairs[ofBody_[k]], from);
    }
    for (const Pair& pair : late_) {
      if (pair.first == body || pair.second == body) {
        predict(scene, pair, from);
      }
    }
    for (std::uint32_t w = 0; w < scene.walls.size(); ++w) {
      const HalfSpace<S>& wall = scene.walls[w];
      const S radius = scene.bodies.radii()[body];
      const RelativeFlight<S> flight = flightOf(scene, body, wall);
      const std::uint64_t key1 = scene.bodies.ids()[body];
      const std::uint64_t key2 = boundaryKey(scene.walls[w].number);
      if (isHeld(scene, body, key1, key2)) {
        const S gap = wall.normal.dot(flight.place(from)) - radius;
        if (isDriven(scene, gap, radius, S(-wall.normal.dot(flight.velocity(from))),
                     detail::safeNorm(flight.a))) {
          schedule({from, body, staticPartner, key1, key2, 0, 0, w});
        }
      } else if (const auto t = timeOfImpact<S>(flight, wall.normal, radius, from)) {
        schedule({*t, body, staticPartner, key1, key2, 0, 0, w});
      }
    }
  }

  template <class Scene>
  void predict(const Scene& scene, const Pair& pair, const S& from) {
    const std::uint32_t i = pair.first;
    const std::uint32_t j = pair.second;
    if (isDone(scene, i) || isDone(scene, j) || !detail::canTouch(scene.bodies, i, j)) {
      return;
    }
    Vector3<S> drift;
    const RelativeFlight<S> flight = flightOf(scene, i, j, drift);
    const S reach = S(scene.bodies.radii()[i]) + S(scene.bodies.radii()[j]);
    const std::uint64_t key1 = scene.bodies.ids()[i];
    const std::uint64_t key2 = scene.bodies.ids()[j];
    if (isDecided(i, key2)) {
      return;
    }
    if (isHeld(scene, i, key1, key2)) {
      const Vector3<S> r = flight.place(from);
      const S distance = detail::safeNorm(r);
      const Vector3<S> n = detail::safeUnit(r);
      const S fall = detail::safeNorm(scene.acceleration(i)) + detail::safeNorm(scene.acceleration(j));
      if (isDriven(scene, S(distance - reach), reach, S(-n.dot(flight.velocity(from))), fall)) {
        schedule({from, i, j, key1, key2});
      }
    } else if (const auto t = timeOfImpact<S>(flight, reach, from)) {
      schedule({*t, i, j, key1, key2});
    }
  }

  void schedule(Event event) {
    event.stamp1 = history_[event.first].impacts;
    event.stamp2 = event.second == staticPartner ? 0 : history_[event.second].impacts;
    queue_.push_back(event);
    std::push_heap(queue_.begin(), queue_.end(), after);
  }

  /// Whether somebody else has decided about the pair in this step.
  bool isDecided(std::uint32_t first, std::uint64_t key2) const {
    for (std::uint32_t k = history_[first].rests; k != none; k = earlier_[k]) {
      if (impacts_[k].decided && impacts_[k].key2 == key2) {
        return true;
      }
    }
    return false;
  }

  /// Solved together with others; or brought to rest in this step.
  template <class Scene>
  bool isHeld(const Scene& scene, std::uint32_t first, std::uint64_t key1, std::uint64_t key2) const {
    for (std::uint32_t k = history_[first].rests; k != none; k = earlier_[k]) {
      if (impacts_[k].key2 == key2) {
        return true;
      }
    }
    const auto found = lowerBound(scene.held, key1, key2);
    return found != scene.held.end() && keysOf(*found) == std::pair(key1, key2);
  }

  template <class Scene>
  bool isDone(const Scene& scene, std::uint32_t body) const {
    return history_[body].spent >= scene.settings.mostPerBody;
  }

  /// Enters the last impact.
  template <class Scene>
  void remember(const Scene& scene, const S& e, ImpactReport<S>& report) {
    const Impact<S>& impact = impacts_.back();
    const auto enter = [&](std::uint32_t body, std::uint64_t partner) {
      History& past = history_[body];
      const bool before = isDone(scene, body);
      const S least = S(1) / S(32);
      past.spent += past.impacts > 0 && past.partner == partner ? least : S(S(1) - e + least);
      past.partner = partner;
      if (past.impacts++ == 0) {
        touched_.push_back(body);
      }
      report.postponed += isDone(scene, body) && !before ? 1U : 0U;
    };
    enter(impact.first, impact.key2);
    if (impact.second != staticPartner) {
      enter(impact.second, impact.key1);
    }
    earlier_.push_back(none);
    if (impact.rests || impact.decided) {
      earlier_.back() = history_[impact.first].rests;
      history_[impact.first].rests = static_cast<std::uint32_t>(impacts_.size() - 1);
    }
  }

  /// A blow drives a held pair together, faster than what rests picks up in a step.
  /// \param fall [m s^-2] |a_1| + |a_2|
  template <class Scene>
  static bool isDriven(const Scene& scene, const S& gap, const S& reach, const S& u, const S& fall) {
    return gap <= reach / S(1000) && u > fall * scene.settings.h + scene.settings.restitutionThreshold;
  }

  // Blows.

  /// A side of a blow.
  struct Side {
    Vector3<S> v = Vector3<S>::Zero();
    Vector3<S> s = Vector3<S>::Zero();  ///< speed of the surface, r w
    S c = S(0);                         ///< arm / radius
    S spin = S(0);                      ///< 1/k; 0 if it cannot turn
    bool movable = false;
    S mass = S(0);
    S r = S(0);
  };

  template <class Scene>
  static Side sideOf(const Scene& scene, std::uint32_t i, const S& arm, const S& t) {
    const auto& bodies = scene.bodies;
    Side side;
    const S r = bodies.radii()[i];
    const S k = bodies.inertiaFactors()[i];
    side.movable = detail::isMovable(bodies, i);
    side.mass = bodies.masses()[i];
    if (side.movable) {
      side.v = scene.course.velocityAt(bodies, i, t, scene.settings.h);
    }
    side.s = r * Vector3<S>(bodies.angularVelocities()[i]);
    side.r = r;
    side.c = r > S(0) ? S(arm / r) : S(0);
    side.spin = side.movable && r > S(0) && k > S(0) ? S(S(1) / k) : S(0);
    return side;
  }

  /// Deals a blow. \return whether a course changed
  template <class Scene, class Decide>
  bool strike(const Scene& scene, const Event& event, const Decide& decide, ImpactReport<S>& report) {
    const auto& bodies = scene.bodies;
    const S& h = scene.settings.h;
    const S& t = event.t;
    const bool boundary = event.second == staticPartner;
    Vector3<S> drift;
    Vector3<S> n;
    S distance(0);
    S a_n(0);
    Side one;
    Side two;
    Material<S> material;
    const Material<S>& surface1 = scene.materials[bodies.materials()[event.first]];
    if (boundary) {
      const HalfSpace<S>& wall = scene.walls[event.wall];
      n = -wall.normal;
      distance = bodies.radii()[event.first];
      a_n = -n.dot(scene.acceleration(event.first));
      drift = wall.velocity;
      one = sideOf(scene, event.first, distance, t);
      material = mix(surface1, wall.material);
    } else {
      const RelativeFlight<S> flight = flightOf(scene, event.first, event.second, drift);
      const S r1 = bodies.radii()[event.first];
      const S r2 = bodies.radii()[event.second];
      // The normal on the straight way of the drift, a h^2/8 at most from the parabola's: the blow then
      // exerts no torque on the drift's own positions, and keeps its angular momentum to rounding.
      const auto touch = sphereSphere<S>(Vector3<S>(flight.r + flight.v * t), r1, r2, event.key1, event.key2,
                                         scene.settings.epsilon, r1 + r2);
      if (!touch) {
        return false;
      }
      n = touch->normal;
      distance = touch->distance;
      a_n = n.dot(flight.a);
      one = sideOf(scene, event.first, touch->arm1, t);
      two = sideOf(scene, event.second, touch->arm2, t);
      const std::uint32_t m1 = bodies.materials()[event.first];
      const std::uint32_t m2 = bodies.materials()[event.second];
      material = m1 == m2 ? surface1 : mix(surface1, scene.materials[m2]);
    }
    const Vector3<S> v_rel = two.v - one.v + drift;
    const S v_n = n.dot(v_rel);
    const S noise = S(16) * Eigen::NumTraits<S>::epsilon() * (detail::maxAbs(one.v) + detail::maxAbs(two.v));
    const bool still = !(v_n < -noise);
    if (still && !(a_n < S(0))) {
      return false;
    }
    const S speed = v_n < S(0) ? S(-v_n) : S(0);
    // In a heap, where both already lean on others, what a step's fall brings is rest.
    S threshold = scene.settings.restitutionThreshold;
    if (leans_[event.first] != 0 && (boundary || leans_[event.second] != 0)) {
      S fall = detail::safeNorm(scene.acceleration(event.first));
      fall += boundary ? S(0) : detail::safeNorm(scene.acceleration(event.second));
      threshold = std::max<S>(threshold, fall * h);
    }
    const S e = speed > threshold ? restitutionAt(material, speed) : S(0);
    if constexpr (!std::is_same_v<Decide, NoDecision>) {
      if (!boundary && speed > threshold) {
        Impact<S> impact{event.first, event.second, event.key1, event.key2, t, speed,
                         n,           distance,     {},         false,      t, true};
        const CollisionOutcome<S> outcome = decide(impact, material, one.v, two.v, v_rel);
        if (outcome.kind != CollisionKind::Bounce) {
          impacts_.push_back(impact);
          remember(scene, S(0), report);
          if (outcome.kind == CollisionKind::Merge) {
            merges_.emplace_back(event.key1, event.key2);
          } else {
            give(scene, event.first, one, outcome.velocity1, outcome.angularVelocity1, t, report);
            give(scene, event.second, two, outcome.velocity2, outcome.angularVelocity2, t, report);
          }
          return true;
        }
      }
    }
    const S pull = a_n < S(0) ? S(-a_n) : S(0);
    const bool rests = pull > S(0) && (still || S(2) * e * speed <= (S(1) - e) * pull * (h - t));
    const S target = rests ? S(pull * (h - t) / S(2)) : e * speed;

    const MassShares<S> share = massShares<S>(one.mass, one.movable, two.mass, two.movable);
    const S dv_n = target - v_n;
    const S mobility =
        S(1) + share.first * one.spin * one.c * one.c + share.second * two.spin * two.c * two.c;
    const Vector3<S> slip = v_rel - v_n * n - Vector3<S>(one.c * one.s + two.c * two.s).cross(n);
    Vector3<S> dv_t = Vector3<S>::Zero();
    if (material.staticFriction > S(0) && dv_n > S(0)) {
      dv_t = tangentialImpulse<S>(S(1) / mobility, slip, dv_n, material.staticFriction,
                                  material.kineticFriction, e > S(0) ? material.tangentialRestitution : S(0));
    }
    // In two strokes, stop and rebound: a head-on blow then ends at exactly e times its speed.
    const std::array<Vector3<S>, 3> strokes{S(-v_n) * n, target * n, dv_t};
    if (share.first > S(0)) {
      scene.course.push(scene.bodies, event.first, S(-share.first), strokes, t);
    }
    twist(scene, event.first, share.first * one.c * one.spin, n.cross(dv_t), t);
    if (!boundary) {
      if (share.second > S(0)) {
        scene.course.push(scene.bodies, event.second, share.second, strokes, t);
      }
      twist(scene, event.second, share.second * two.c * two.spin, n.cross(dv_t), t);
    }
    // Resistance to rolling and spinning, for what the blow left of the turn.
    Vector3<S> l = Vector3<S>::Zero();
    S turned(0);
    if (material.rollingFriction > S(0) || material.spinningFriction > S(0)) {
      const S q1 = boundary ? S(1) : S(two.r / (one.r + two.r));
      const S q2 = boundary ? S(0) : S(one.r / (one.r + two.r));
      const S turnMobility = share.first * one.spin * q1 * q1 + share.second * two.spin * q2 * q2;
      if (turnMobility > S(0)) {
        const Vector3<S> s1 = one.r * Vector3<S>(bodies.angularVelocities()[event.first]);
        const Vector3<S> s2 = boundary
                                  ? Vector3<S>(Vector3<S>::Zero())
                                  : Vector3<S>(two.r * Vector3<S>(bodies.angularVelocities()[event.second]));
        const Vector3<S> rho = q2 * s2 - q1 * s1;
        l = resistTurning<S>(Vector3<S>(rho / -turnMobility), n, dv_n, material.rollingFriction,
                             material.spinningFriction);
        turned = l.dot(rho) + turnMobility * l.squaredNorm() / S(2);
        twist(scene, event.first, share.first * q1 * one.spin, l, t);
        if (!boundary) {
          twist(scene, event.second, -share.second * q2 * two.spin, l, t);
        }
      }
    }
    const S& m = share.effective;
    const Vector3<S> slipAfter = slip + mobility * dv_t;
    report.restitutionLoss -= m * dv_n * (v_n + target) / S(2);
    report.frictionLoss -= m * (dv_t.dot(Vector3<S>(slip + slipAfter)) / S(2) + turned);
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
                        rests || !(target > S(0)),
                        rests && e < S(1) ? S(t + S(2) * e * speed / ((S(1) - e) * pull)) : t});
    remember(scene, e, report);
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
    const Vector3<S> before = scene.bodies.angularVelocities()[i];
    const S moment = S(scene.bodies.inertiaFactors()[i]) * side.mass * side.r * side.r;
    report.restitutionLoss -= side.mass * Vector3<S>(v - side.v).dot(Vector3<S>(v + side.v)) / S(2);
    report.frictionLoss -= moment * Vector3<S>(w - before).dot(Vector3<S>(w + before)) / S(2);
    scene.course.push(scene.bodies, i, S(1), {Vector3<S>(v - side.v), nothing, nothing}, t);
    scene.bodies.angularVelocities()[i] = w;
    turns_.push_back({i, t, before, w});
  }

  template <class Scene>
  void twist(const Scene& scene, std::uint32_t i, const S& mobility, const Vector3<S>& turn, const S& t) {
    const S r = scene.bodies.radii()[i];
    if (mobility == S(0) || !(r > S(0)) || turn == Vector3<S>::Zero()) {
      return;
    }
    const Vector3<S> before = scene.bodies.angularVelocities()[i];
    scene.bodies.angularVelocities()[i] -= (mobility / r) * turn;
    turns_.push_back({i, t, before, Vector3<S>(scene.bodies.angularVelocities()[i])});
  }

  std::vector<Event> queue_;
  std::vector<S> ways_;  ///< [m] bound of the way of each body
  std::vector<std::vector<Event>> parts_;
  std::vector<History> history_;
  std::vector<unsigned char> leans_;    ///< bodies with a contact that is held
  std::vector<std::uint32_t> touched_;  ///< bodies with a history
  std::uint64_t linked_ = 0;
  std::vector<std::uint32_t> start_;
  std::vector<std::uint32_t> ofBody_;
  std::vector<Pair> late_;
  std::vector<Impact<S>> impacts_;
  std::vector<std::uint32_t> earlier_;  ///< of an impact that rests: the one before of the same first body
  std::vector<TurnChange<S>> turns_;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> merges_;
};

}  // namespace gravel
