#pragma once

/// \file
/// Which pairs will touch in a step, and when, kept true while blows change the courses of bodies.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/impact_flights.hpp>
#include <gravel/contact/impact_past.hpp>
#include <gravel/contact/impact_queue.hpp>
#include <gravel/contact/impact_scene.hpp>
#include <gravel/contact/late_pairs.hpp>
#include <gravel/contact/pairs_of_bodies.hpp>
#include <gravel/contact/resting_gap.hpp>
#include <gravel/contact/swept_spheres.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>

#include <initializer_list>
#include <optional>
#include <vector>

namespace gravel::detail {

/// Finds the events to come of a step.
template <Real S>
class ImpactForecast : protected ImpactPast<S> {
  using Base = ImpactPast<S>;

 public:
  /// Whether an impact will happen, with all bodies on these courses. The arguments are those of
  /// ImpactEvents::resolve().
  template <ContactBodies B, class Course>
  bool foresees(const B& bodies, std::span<const Pair> pairs, const Domain<S>& domain,
                std::span<const HalfSpace<S>> walls, const ImpactSettings<S>& settings,
                const std::optional<std::span<const std::uint32_t>>& nearWalls, const Course& course) {
    const NoSupport free;
    predictAll(ImpactScene<S, const B, const Course>{bodies, domain, {}, walls, {}, settings, course, free},
               pairs, nearWalls);
    swept_.forget();
    return !queue_.empty();
  }

 protected:
  using Base::histories_;
  using Base::isDecided;
  using Base::isHeld;
  using Base::passes;
  using Event = ImpactEvent<S>;
  using Flight = ImpactFlight<S>;

  static constexpr std::size_t chunk = 1024;

  /// Of the image that is nearest at t. \param drift out: [m s^-1] of it, which the velocity includes
  template <class Scene>
  static RelativeFlight<S> flightOf(const Scene& scene, const Flight& one, const Flight& two, const S& t,
                                    Vector3<S>& drift) {
    drift = Vector3<S>::Zero();
    const Vector3<S> r = scene.domain.imageAt(Vector3<S>(two.x - one.x), Vector3<S>(t * (two.v - one.v)), t,
                                              drift, scene.settings.time);
    return relativeFlight(one, two, r, drift, scene.settings.h);
  }
  /// When two meet after `from`: of the image on this flight, and of the one that is nearest halfway from
  /// there to the end, the first. With a relative way w no other comes nearer than (L - w)/2 in a box of edge
  /// L.
  template <class Scene>
  static std::optional<S> meeting(const Scene& scene, const Flight& one, const Flight& two,
                                  const RelativeFlight<S>& flight, const S& from) {
    const S reach = one.radius + two.radius;
    const std::optional<S> t = timeOfImpact<S>(flight, reach, from);
    const S half = (from + scene.settings.h) / S(2);
    if (scene.domain.isNearest(Vector3<S>(flight.r + half * flight.v))) {
      return t;
    }
    Vector3<S> drift;
    const RelativeFlight<S> other = flightOf(scene, one, two, half, drift);
    if (other.r == flight.r) {
      return t;
    }
    const std::optional<S> later = timeOfImpact<S>(other, reach, from);
    return later && (!t || *later < *t) ? later : t;
  }
  template <class Scene>
  static RelativeFlight<S> flightOf(const Scene& scene, const Flight& one, const HalfSpace<S>& wall) {
    return {Vector3<S>(one.x - wall.offset * wall.normal), Vector3<S>(one.v - wall.velocity), one.a,
            scene.settings.h, detail::maxAbs(one.x)};
  }

  template <class Scene>
  void predictAll(const Scene& scene, std::span<const Pair> pairs,
                  const std::optional<std::span<const std::uint32_t>>& nearWalls) {
    const std::size_t bodiesFrom = (pairs.size() + chunk - 1) / chunk;
    const std::size_t n = scene.walls.empty() ? 0 : nearWalls ? nearWalls->size() : scene.bodies.size();
    const std::size_t count = bodiesFrom + (n + chunk - 1) / chunk;
    parts_.resize(count);
    swept_.gather(scene, scene.settings.h);
    parallelForTasks<Share::Alike>(count, [&](std::size_t c) {
      parts_[c].clear();
      if (c < bodiesFrom) {
        predictPairs(scene, pairs.subspan(c * chunk, std::min(chunk, pairs.size() - c * chunk)), parts_[c]);
      } else {
        const std::size_t begin = (c - bodiesFrom) * chunk;
        std::size_t place = 0;
        for (std::size_t k = begin; k < std::min(begin + chunk, n); ++k) {
          predictWalls(scene, nearWalls ? (*nearWalls)[k] : static_cast<std::uint32_t>(k), place, parts_[c]);
        }
      }
    });
    queue_.fill(parts_);
    parts_.resize(std::min<std::size_t>(count, 2));
  }

  /// Before blows: whose the pairs are that may meet.
  template <class Near>
  void link(std::size_t bodies, const Near& near) {
    if (linked_ != near.version() || near.version() == 0 || pairsOf_.bodies() != bodies) {
      pairsOf_.find(bodies, near.pairs());
      linked_ = near.version();
    }
  }
  void unlink() { pairsOf_.forget(); }
  void end() {
    swept_.forget();
    flights_.end();
    late_.end();
    Base::end();
  }

  template <class Scene>
  [[gnu::flatten]] void predictPairs(const Scene& scene, std::span<const Pair> pairs,
                                     std::vector<Event>& out) const {
    auto next = scene.held.begin();
    bool placed = false;
    Vector3<S> r, drift;
    for (const auto& [i, j] : pairs) {
      if (next != scene.held.end() && next->first == i && next->second == j) {
        ++next;  // most pairs of a heap: both lists are in one order
        continue;
      }
      if (!swept_.mayMeet(i, j, scene.domain, scene.settings.time, scene.settings.h, r, drift)) {
        continue;
      }
      const ContactKeys keys{scene.bodies.ids()[i], scene.bodies.ids()[j]};
      if (!placed) {
        next = placeOf(scene.held, keys);
        placed = true;
      }
      while (next != scene.held.end() && next->keys < keys) {
        ++next;
      }
      if (next != scene.held.end() && next->keys == keys) {
        ++next;
        continue;
      }
      if (!detail::canTouch(scene.bodies, i, j)) {
        continue;
      }
      const Flight one = Flight::of(scene, i);
      const Flight two = Flight::of(scene, j);
      const auto flight = relativeFlight(one, two, r, drift, scene.settings.h);
      if (const auto t = meeting(scene, one, two, flight, S(0))) {
        out.push_back({*t, i, j, keys.first, keys.second});
      }
    }
  }

  /// \param place in the list of those held, which bodies follow in the order of their ids
  template <class Scene>
  void predictWalls(const Scene& scene, std::uint32_t i, std::size_t& place, std::vector<Event>& out) const {
    const S radius = scene.bodies.radii()[i];
    if (!(radius > S(0)) || !detail::isMovable(scene.bodies, i)) {
      return;
    }
    for (std::uint32_t w = 0; w < scene.walls.size(); ++w) {
      const HalfSpace<S>& wall = scene.walls[w];
      if (!swept_.mayMeet(i, wall, w)) {
        continue;
      }
      if (const auto t =
              timeOfImpact<S>(flightOf(scene, Flight::of(scene, i), wall), wall.normal, radius, S(0))) {
        const std::uint64_t key1 = scene.bodies.ids()[i];
        const std::uint64_t key2 = boundaryKey(wall.number);
        const auto held = placeOf(scene.held, {key1, key2}, place);
        place = static_cast<std::size_t>(held - scene.held.begin());
        if (held == scene.held.end() || held->keys != ContactKeys{key1, key2}) {
          out.push_back({*t, i, staticPartner, key1, key2, 0, 0, w});
        }
      }
    }
  }

  /// Bodies are on other courses from `now` on, and what they meet there is looked for.
  template <class Scene, class Near>
  void goOn(const Scene& scene, Near& near, std::initializer_list<std::uint32_t> struck, const S& now) {
    for (const std::uint32_t i : struck) {
      if (isMovable(scene.bodies, i)) {
        late_.add(i, near.pairs(), pairsOf_, [&](auto& out) { near.follow(scene.bodies, i, now, out); });
        swept_.renew(scene, i, scene.settings.h);
        flights_.renew(scene, i);
      }
    }
    for (const std::uint32_t i : struck) {
      predictAgain(scene, near.pairs(), i, now);
    }
  }

  /// After a blow. What cannot move is on the same course as before, and meets others as was foreseen.
  template <class Scene>
  void predictAgain(const Scene& scene, std::span<const Pair> pairs, std::uint32_t body, const S& from) {
    if (!isMovable(scene.bodies, body)) {
      return;
    }
    pairsOf_.any(body, pairs, [&](std::uint32_t k) {
      predict(scene, pairs[k], from, k);
      return false;
    });
    late_.each(body, [&](const Pair& pair) { predict(scene, pair, from, Base::noPair); });
    for (std::uint32_t w = 0; w < scene.walls.size(); ++w) {
      predict(scene, body, w, from);
    }
  }

  template <class Scene>
  void predict(const Scene& scene, std::uint32_t body, std::uint32_t w, const S& from) {
    const HalfSpace<S>& wall = scene.walls[w];
    if (!swept_.mayMeet(body, wall, w) || passes(scene, body, staticPartner)) {
      return;
    }
    const Flight one = flights_.of(scene, body);
    if (!(one.radius > S(0))) {
      return;
    }
    const RelativeFlight<S> flight = flightOf(scene, one, wall);
    const ContactKeys keys{scene.bodies.ids()[body], boundaryKey(wall.number)};
    const S gap = wall.normal.dot(flight.place(from)) - one.radius;
    const bool flies = isApart(gap, one.radius) || !isHeld(scene, body, staticPartner, keys);
    if (const auto t = flies ? timeOfImpact<S>(flight, wall.normal, one.radius, from)
                             : driven(scene, body, staticPartner, flight, wall.normal, from)) {
      queue_.push({*t, body, staticPartner, keys.first, keys.second, 0, 0, w}, histories_);
    }
  }

  /// \param number  of the pair in the list, or none
  template <class Scene>
  [[gnu::flatten]] void predict(const Scene& scene, const Pair& pair, const S& from, std::size_t number) {
    const auto& [i, j] = pair;
    Vector3<S> r, drift;
    // Where images go no ways of their own none is nearer than that.
    const bool near = scene.domain.omega() != S(0) ||
                      swept_.mayMeet(i, j, scene.domain, scene.settings.time, scene.settings.h, r, drift);
    if (!near || passes(scene, i, j) || passes(scene, j, i) || !canTouch(scene.bodies, i, j)) {
      return;
    }
    const ContactKeys keys{scene.bodies.ids()[i], scene.bodies.ids()[j]};
    if (isDecided(i, keys.second)) {
      return;
    }
    const Flight one = flights_.of(scene, i), two = flights_.of(scene, j);
    const RelativeFlight<S> flight = flightOf(scene, one, two, from, drift);
    const S reach = one.radius + two.radius;
    const bool held = isHeld(scene, i, j, keys, number);
    const Vector3<S> at = held ? flight.place(from) : flight.r;
    const bool flies = !held || isApart(S(detail::safeNorm(at) - reach), reach);
    if (const auto t = flies ? meeting(scene, one, two, flight, from)
                             : driven(scene, i, j, flight, detail::safeUnit(at), from)) {
      queue_.push({*t, i, j, keys.first, keys.second}, histories_);
    }
  }

  /// A held pair that has flown apart since: if it meets again, then at its own time.
  static bool isApart(const S& gap, const S& reach) { return gap > restingMargin<S>() * reach; }

  /// A blow drives a held pair together, faster than what rests picks up in a step: as it is held, so that
  /// what nothing holds along n passes on the slowest blow. Or as it falls freely, once both bodies have had
  /// so many blows in the step that they are in a heap. (Without that a heap of 10 000 that falls deals 47
  /// 000 blows a step, most of them between the same pairs, and comes to rest neither sooner nor better.)
  /// \param n  along which the flight opens the pair  \return `from`, or nothing
  template <class Scene>
  std::optional<S> driven(const Scene& scene, std::uint32_t i, std::uint32_t j,
                          const RelativeFlight<S>& flight, const Vector3<S>& n, const S& from) const {
    const S u = -n.dot(flight.velocity(from));
    const auto isOften = [&](std::uint32_t k) {
      return k != staticPartner && isMovable(scene.bodies, k) &&
             histories_.of(k).impacts >= scene.settings.mostSlow;
    };
    if (!(u > scene.settings.restitutionThreshold)) {
      return std::nullopt;
    }
    const S fall = isOften(i) && isOften(j) ? S(scene.fallOf(i) + scene.fallOf(j)) : scene.heldAlong(i, j, n);
    const bool fast = u > fall * scene.settings.h + scene.settings.restitutionThreshold;
    return fast ? std::optional<S>(from) : std::nullopt;
  }

  ImpactQueue<S> queue_;
  SweptSpheres<S> swept_;
  ImpactFlights<S> flights_;
  std::vector<std::vector<Event>> parts_;
  std::uint64_t linked_ = 0;
  PairsOfBodies pairsOf_;
  LatePairs late_;
};

}  // namespace gravel::detail
