#pragma once

/// \file
/// How bodies fly between two blows of theirs.

#include <gravel/contact/contact_bodies.hpp>
#include <gravel/contact/time_of_impact.hpp>

#include <cstdint>
#include <vector>

namespace gravel::detail {

/// The course of a body, and what decides whom it can touch.
template <Real S>
struct ImpactFlight {
  Vector3<S> x;  ///< [m] at the start of the step
  Vector3<S> v;  ///< [m s^-1] mean of the drift
  Vector3<S> a;  ///< [m s^-2] with what holds it
  S radius;      ///< [m]
  bool movable;
  bool tracer;

  template <class Scene>
  [[gnu::always_inline]] static inline ImpactFlight of(const Scene& scene, std::uint32_t i) {
    return {scene.bodies.positions()[i], scene.velocity(i),          scene.acceleration(i),
            scene.bodies.radii()[i],     isMovable(scene.bodies, i), isTracer(scene.bodies, i)};
  }

  friend bool canTouch(const ImpactFlight& one, const ImpactFlight& two) {
    return !one.tracer && !two.tracer && (one.movable || two.movable);
  }
};

/// The second as seen from the first. \param r, drift  from it, and of its image: SweptSpheres::mayMeet()
template <Real S>
[[gnu::always_inline]] inline RelativeFlight<S> relativeFlight(const ImpactFlight<S>& one,
                                                               const ImpactFlight<S>& two,
                                                               const Vector3<S>& r, const Vector3<S>& drift,
                                                               const S& h) {
  return {r, two.v - one.v + drift, two.a - one.a, h};
}

/// Flights found once and kept while nothing happens to the body: in a dense flow each is asked for dozens of
/// times between two blows.
template <Real S>
class ImpactFlights {
 public:
  /// A new step of so many bodies. O(N).
  void forget(std::size_t count) {
    known_.assign(count, 0);
    flights_.resize(count);
  }
  /// The course of body i is another one now.
  void renew(std::uint32_t i) { known_[i] = 0; }

  template <class Scene>
  [[gnu::always_inline]] const ImpactFlight<S>& of(const Scene& scene, std::uint32_t i) const {
    if (known_[i] == 0) {
      flights_[i] = ImpactFlight<S>::of(scene, i);
      known_[i] = 1;
    }
    return flights_[i];
  }

 private:
  mutable std::vector<ImpactFlight<S>> flights_;
  mutable std::vector<unsigned char> known_;
};

}  // namespace gravel::detail
