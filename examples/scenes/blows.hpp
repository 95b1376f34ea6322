#pragma once

/// \file
/// All blows of a step, for those who count collisions or sum what they carry.

#include <gravel/gravel.hpp>

namespace gravel::scenes {

/// Calls visit(first, second, normal, distance, impulse) for every pair of bodies that got an impulse in the
/// last step: indices, the unit vector from the first to the second, the distance of the centres, and the
/// normal impulse.
template <class Visit>
void forEachBlow(const Space<double>& space, Visit&& visit) {
  const auto report = [&](std::uint32_t i, std::uint32_t j, const Vector3<double>& n, double distance,
                          double impulse) {
    if (impulse > 0.0 && j != staticPartner) {
      visit(i, j, n, distance, impulse);
    }
  };
  const auto impulses = space.contactImpulses();
  for (std::size_t k = 0; k < impulses.size(); ++k) {
    const Contact<double>& c = space.contacts()[k];
    report(c.first, c.second, c.normal, c.arm1 + c.arm2, impulses[k].normal);
  }
  for (const auto& blow : space.impacts()) {
    report(blow.first, blow.second, blow.normal, blow.distance, blow.impulse.normal);
  }
}

}  // namespace gravel::scenes
