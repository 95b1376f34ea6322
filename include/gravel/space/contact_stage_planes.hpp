#pragma once

/// \file
/// Members of `ContactStage` that concern planes which move.

#include <gravel/space/contact_stage.hpp>

namespace gravel {

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::setPlaneVelocity(std::size_t plane, const Vector3<Scalar>& velocity) {
  boundaries.setVelocity(plane, velocity);
  setDrift(plane, velocity, Scalar(0));
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::drivePlanes(const Scalar& share) {
  for (const Plane<Scalar>& plane : boundaries.planes()) {
    if (!plane.isSteady()) {
      setDrift(plane.number, plane.velocityAt(share), Scalar(2) * plane.swing());
    }
  }
}

/// What touches the plane sees it move at this velocity, which changes by so much along n in a step. Where it
/// does already, nothing changes.
template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::setDrift(std::size_t plane, const Vector3<Scalar>& drift,
                                            const Scalar& change) {
  const auto differs = [&](const Contact<Scalar>& c) {
    return c.second == staticPartner && c.key2 == boundaryKey(plane) &&
           !(detail::equalIsSame<Scalar> && contacts_.drift(c) == drift &&
             contacts_.surface(c).driftChange == change);
  };
  if (contacts_.setDrift(drift, change, differs)) {
    contactsChanged();
  }
}

}  // namespace gravel
