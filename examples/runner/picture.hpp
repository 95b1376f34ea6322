#pragma once

/// \file
/// The picture of a scene's bodies as they are now.

#include "scene.hpp"

#include <cstdint>
#include <filesystem>
#include <unordered_map>

namespace gravel::runner {

/// The places of a body at some times of the run; NaN where it was taken across the domain.
using Trail = std::vector<Vector3<double>>;
using Trails = std::unordered_map<std::uint64_t, Trail>;  ///< by id of the body

/// False, and a line on stderr that says so, if the runner was built without tachyon.
/// \throws std::runtime_error if the file cannot be written
bool writePicture(const std::filesystem::path& path, const Scene& scene, const Space<double>& space,
                  const Trails& trails);

}  // namespace gravel::runner
