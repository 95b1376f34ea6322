#pragma once

/// \file
/// How bodies fly between two blows of theirs.

#include <gravel/contact/time_of_impact.hpp>
#include <gravel/core/memory.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace gravel::detail {

/// The course of a body, and its size.
template <Real S>
struct ImpactFlight {
  Vector3<S> x;  ///< [m] at the start of the step
  Vector3<S> v;  ///< [m s^-1] mean of the drift
  Vector3<S> a;  ///< [m s^-2] with what holds it
  S radius;      ///< [m]

  template <class Scene>
  [[gnu::always_inline]] static inline ImpactFlight of(const Scene& scene, std::uint32_t i) {
    return {scene.bodies.positions()[i], scene.velocity(i), scene.acceleration(i), scene.bodies.radii()[i]};
  }
};

/// The second as seen from the first. \param r, drift  from it, and of its image: SweptSpheres::mayMeet()
template <Real S>
[[gnu::always_inline]] inline RelativeFlight<S> relativeFlight(const ImpactFlight<S>& one,
                                                               const ImpactFlight<S>& two,
                                                               const Vector3<S>& r, const Vector3<S>& drift,
                                                               const S& h) {
  return {r, two.v - one.v + drift, two.a - one.a, h, std::max<S>(maxAbs(one.x), maxAbs(two.x))};
}

/// Flights found once and kept while nothing happens to the body: in a dense flow each is asked for dozens of
/// times between two blows. Only of those that are asked for, which are few in a heap at rest.
template <Real S>
class ImpactFlights {
 public:
  /// A new step of so many bodies. O(N).
  void forget(std::size_t count) {
    place_.assign(count, none);
    flights_.clear();
  }

  /// They are of no use any more.
  void end() {
    giveBack(place_);
    clearSpare(flights_);
  }

  template <class Scene>
  [[gnu::always_inline]] ImpactFlight<S> of(const Scene& scene, std::uint32_t i) {
    if (place_[i] == none) {
      place_[i] = static_cast<std::uint32_t>(flights_.size());
      flights_.push_back(ImpactFlight<S>::of(scene, i));
    }
    return flights_[place_[i]];
  }

  /// The course of body i is another one now.
  template <class Scene>
  void renew(const Scene& scene, std::uint32_t i) {
    if (place_[i] != none) {
      flights_[place_[i]] = ImpactFlight<S>::of(scene, i);
    }
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  std::vector<std::uint32_t> place_;  ///< by body
  std::vector<ImpactFlight<S>> flights_;
};

}  // namespace gravel::detail
