#pragma once

/// \file
/// A body as a value: what one hands in, and what `load()` takes out.

#include <gravel/bodies/fields.hpp>
#include <gravel/core/check.hpp>

#include <cmath>
#include <limits>
#include <optional>

namespace gravel {

/// A rigid sphere. A body without mass and radius is a tracer: it feels gravity and does not pull.
template <Real Scalar = double>
struct Body {
  Vector3<Scalar> position = Vector3<Scalar>::Zero();               ///< [m]
  Vector3<Scalar> velocity = Vector3<Scalar>::Zero();               ///< [m s^-1]
  Vector3<Scalar> angularVelocity = Vector3<Scalar>::Zero();        ///< [rad s^-1], axes of space
  Quaternion<Scalar> orientation = Quaternion<Scalar>::Identity();  ///< normalised when added
  Scalar mass = Scalar(1);          ///< [kg] >= 0; 0 only for a point (radius 0) or a fixed body
  Scalar radius = Scalar(0);        ///< [m] 0, or > 0 with a square that neither under- nor overflows; one of
                                    ///< radius 0 touches spheres alone: no point, no plane
  bool fixed = false;               ///< never moves, nor turns, whatever its velocities; its mass still pulls
  std::optional<Scalar> inertia{};  ///< [kg m^2] > 0; without it a homogeneous sphere's 2/5 m r^2
  MaterialId material = defaultMaterial;
};

namespace detail {

template <Real Scalar>
inline Scalar homogeneousFactor() {
  return Scalar(Scalar(2) / Scalar(5));
}

/// k in I = k m r^2; divided step by step, as m r^2 leaves a float's range where I does not.
template <Real Scalar>
inline Scalar inertiaFactor(const Body<Scalar>& body) {
  return body.inertia ? Scalar(*body.inertia / body.mass / body.radius / body.radius)
                      : homogeneousFactor<Scalar>();
}

/// Whether r^2 and (r1 + r2)^2 are numbers: beyond, a reach is infinite, or a sphere turns too fast to be
/// told.
template <Real Scalar>
inline bool hasSquare(const Scalar& r) {
  if constexpr (std::is_floating_point_v<Scalar>) {
    return r == Scalar(0) || (r * r >= std::numeric_limits<Scalar>::min() && isFinite(Scalar(16) * (r * r)));
  } else {
    return true;
  }
}

}  // namespace detail

/// Checks every field of a body but the material, whose table is not known here. `who` names it in the
/// message ("body 17"). \throws std::invalid_argument naming the body, the field, its value and what is
/// allowed
template <Real Scalar>
void validate(const Body<Scalar>& body, const std::string& who) {
  const auto finite = [&](const char* field, const auto& v) {
    if (!isFinite(v)) {
      detail::refuse(std::string(field) + " of " + who, detail::formatVector(v), "finite");
    }
  };
  const auto real = [&](const char* field, const Scalar& x, const detail::Range<Scalar>& range) {
    if (!range.contains(x)) {
      detail::refuse(std::string(field) + " of " + who, detail::formatReal(x), range.allowed(x));
    }
  };
  finite("position", body.position);
  finite("velocity", body.velocity);
  finite("angularVelocity", body.angularVelocity);
  finite("orientation", body.orientation.coeffs());
  if (!(body.orientation.squaredNorm() > Scalar(0)) || !isFinite(body.orientation.squaredNorm())) {
    detail::refuse("orientation of " + who, detail::formatVector(body.orientation.coeffs()),
                   "a quaternion of finite, non-zero norm");
  }
  real("mass", body.mass, detail::nonNegative<Scalar>());
  real("radius", body.radius, detail::nonNegative<Scalar>());
  if constexpr (std::is_floating_point_v<Scalar>) {
    if (!detail::hasSquare(body.radius)) {
      const Scalar low = std::sqrt(std::numeric_limits<Scalar>::min());
      const Scalar high = std::sqrt(std::numeric_limits<Scalar>::max()) / Scalar(4);
      detail::refuse("radius of " + who, detail::formatReal(body.radius),
                     "0, or " + detail::formatReal(low) + " to " + detail::formatReal(high));
    }
  }
  if (body.mass == Scalar(0) && body.radius > Scalar(0) && !body.fixed) {
    detail::refuse("mass of " + who, "0", "> 0 for a movable body with a radius (a tracer has radius 0)");
  }
  if (body.inertia) {
    const auto refuseInertia = [&](const char* allowed) {
      detail::refuse("inertia of " + who, detail::formatReal(*body.inertia), allowed);
    };
    if (!isFinite(*body.inertia) || !(*body.inertia > Scalar(0))) {
      refuseInertia("finite, > 0");
    }
    if (!(body.mass > Scalar(0)) || !(body.radius > Scalar(0))) {
      refuseInertia("none, on a body without mass or radius");
    }
    const Scalar factor = detail::inertiaFactor(body);
    if (!isFinite(factor) || !(factor > Scalar(0))) {
      refuseInertia("what is finite and > 0 also as a multiple of m r^2");
    }
  }
}

}  // namespace gravel
