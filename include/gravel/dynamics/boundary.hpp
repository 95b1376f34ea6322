#pragma once

/// \file
/// Static boundaries and uniform fields: what acts on bodies from outside.

#include <gravel/bodies/fields.hpp>
#include <gravel/core/check.hpp>

#include <vector>

namespace gravel {

/// The half-space n.x >= offset is free; bodies rest on its face. n has unit length. The material is looked
/// up when contacts are made, so that it may change.
template <Real Scalar>
struct Plane {
  Vector3<Scalar> normal;
  Scalar offset;  ///< [m]
  MaterialId material = defaultMaterial;
};

/// \param normal of any length but zero; `offset` is measured along the normal made unit
/// \throws std::invalid_argument if the normal is zero or a value is not finite
template <Real Scalar>
Plane<Scalar> makePlane(const Vector3<Scalar>& normal, const Scalar& offset,
                        MaterialId material = defaultMaterial) {
  const Vector3<Scalar> n = normal.stableNormalized();
  if (!isFinite(normal) || !isFinite(n) || !(n.squaredNorm() > Scalar(0))) {
    detail::refuse("normal of the plane", detail::formatVector(normal), "finite and not zero");
  }
  detail::require("offset of the plane", offset, detail::anyFinite<Scalar>());
  return {n, offset, material};
}

}  // namespace gravel
