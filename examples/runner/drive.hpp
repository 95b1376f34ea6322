#pragma once

/// \file
/// What a scene moves by itself from step to step: planes that shake, a field that turns.

#include "scene.hpp"

namespace gravel::runner {

/// The scene's field at that time.
Vector3<double> fieldAt(const Scene& scene, double time);

/// Gives the space the field and the velocities of planes of the next step, which must have the length h.
void drive(Space<double>& space, const Scene& scene, double h);

}  // namespace gravel::runner
