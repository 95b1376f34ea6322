#pragma once

/// \file
/// The scene that runs without an argument: scenes/rubble_pile.toml, made a part of the program by the build.

namespace gravel::runner {

extern const char* const builtinScene;
inline constexpr const char* builtinSceneName = "rubble_pile.toml";

}  // namespace gravel::runner
