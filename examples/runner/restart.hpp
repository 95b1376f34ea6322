#pragma once

/// \file
/// How a run is taken up again.

#include "scene.hpp"

#include <string>

namespace gravel::runner {

/// Puts the state that was saved in `file` into the space of a scene as it starts.
/// \param scene  the saved time must be before its end
/// \throws SceneError where the state is that of another scene; what Space::restore throws where it is none
void takeUp(Space<double>& space, const Scene& scene, const std::string& file);

}  // namespace gravel::runner
