#pragma once

/// \file
/// What contacts need of bodies: `Bodies` in any layout has it, and so have a user's own arrays.

#include <gravel/bodies/bodies.hpp>

#include <span>

namespace gravel {

/// Columns by name, each `column[i]` for i below `size()`.
template <class T>
concept ContactBodies = requires(T& bodies, const T& constBodies, std::size_t i) {
  { constBodies.size() } -> std::convertible_to<std::size_t>;
  bodies.positions()[i];
  bodies.velocities()[i];
  bodies.angularVelocities()[i];
  constBodies.accelerations()[i];
  constBodies.masses()[i];
  constBodies.radii()[i];
  constBodies.inertiaFactors()[i];
  constBodies.flags()[i];
  constBodies.ids()[i];
  constBodies.materials()[i];
};

/// A user's own arrays, seen as bodies; all of one length. Owns nothing.
template <Real S = double>
struct ContactArrays {
  std::span<Vector3<S>> position;
  std::span<Vector3<S>> velocity;
  std::span<Vector3<S>> angularVelocity;
  std::span<const Vector3<S>> acceleration;  ///< by fields and gravity, of this step
  std::span<const S> mass;
  std::span<const S> radius;
  std::span<const S> inertiaFactor;     ///< k in I = k m r^2
  std::span<const std::uint32_t> flag;  ///< bits of BodyFlag
  std::span<const std::uint64_t> id;    ///< all different, below 2^63
  std::span<const std::uint32_t> material;

  std::size_t size() const { return position.size(); }
  auto positions() const { return position; }
  auto velocities() const { return velocity; }
  auto angularVelocities() const { return angularVelocity; }
  auto accelerations() const { return acceleration; }
  auto masses() const { return mass; }
  auto radii() const { return radius; }
  auto inertiaFactors() const { return inertiaFactor; }
  auto flags() const { return flag; }
  auto ids() const { return id; }
  auto materials() const { return material; }

  /// Called where contacts are found and taken up. O(bodies).
  /// \throws std::invalid_argument unless all are of one length, masses and radii finite and >= 0, inertia
  /// factors finite and > 0, and ids below 2^63
  void requireWhole() const {
    const auto require = [this](const char* what, std::size_t length) {
      if (length != size()) {
        detail::refuse(std::string("length of ") + what, std::to_string(length),
                       "that of positions, " + std::to_string(size()));
      }
    };
    require("velocities", velocity.size());
    require("angular velocities", angularVelocity.size());
    require("accelerations", acceleration.size());
    require("masses", mass.size());
    require("radii", radius.size());
    require("inertia factors", inertiaFactor.size());
    require("flags", flag.size());
    require("ids", id.size());
    require("materials", material.size());
    for (std::size_t i = 0; i < size(); ++i) {
      requireOf("mass", mass[i], i, detail::nonNegative<S>());
      requireOf("radius", radius[i], i, detail::nonNegative<S>());
      requireOf("inertia factor", inertiaFactor[i], i, detail::positive<S>());
      if (id[i] >= std::uint64_t{1} << 63U) {  // names of boundaries
        detail::refuse("id of body " + std::to_string(i), std::to_string(id[i]), "below 2^63");
      }
    }
  }

 private:
  static void requireOf(const char* what, const S& x, std::size_t i, const detail::Range<S>& range) {
    if (!range.contains(x)) {
      detail::refuse(what + (" of body " + std::to_string(i)), detail::formatReal(x), range.allowed(x));
    }
  }
};

namespace detail {

/// What can say whether it is whole does so.
template <class B>
void requireWhole(const B& bodies) {
  if constexpr (requires { bodies.requireWhole(); }) {
    bodies.requireWhole();
  }
}

/// True for a body that contacts can move: not fixed, not asleep, and with a mass.
template <class B>
[[gnu::always_inline]] inline bool isMovable(const B& bodies, std::size_t i) {
  using S = std::remove_cvref_t<decltype(bodies.masses()[i])>;
  return (bodies.flags()[i] & heldFlags) == 0 && bodies.masses()[i] > S(0);
}

/// [m s^-1] as it counts: what is written to a body that is fixed or asleep does not move it.
template <class B>
auto velocityOf(const B& bodies, std::size_t i) {
  using V = Vector3<std::remove_cvref_t<decltype(bodies.masses()[i])>>;
  return (bodies.flags()[i] & heldFlags) == 0 ? V(bodies.velocities()[i]) : V(V::Zero());
}

/// [rad s^-1], likewise.
template <class B>
auto spinOf(const B& bodies, std::size_t i) {
  using V = Vector3<std::remove_cvref_t<decltype(bodies.masses()[i])>>;
  return (bodies.flags()[i] & heldFlags) == 0 ? V(bodies.angularVelocities()[i]) : V(V::Zero());
}

/// True for a point without mass, which feels gravity and touches nothing.
template <class B>
[[gnu::always_inline]] inline bool isTracer(const B& bodies, std::size_t i) {
  using S = std::remove_cvref_t<decltype(bodies.masses()[i])>;
  return (bodies.flags()[i] & static_cast<std::uint32_t>(BodyFlag::Fixed)) == 0 &&
         !(bodies.masses()[i] > S(0));
}

/// False for a tracer, and for two immovable bodies.
template <class B>
[[gnu::always_inline]] inline bool canTouch(const B& bodies, std::size_t i, std::size_t j) {
  return !isTracer(bodies, i) && !isTracer(bodies, j) && (isMovable(bodies, i) || isMovable(bodies, j));
}

}  // namespace detail

}  // namespace gravel
