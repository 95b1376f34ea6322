#pragma once

/// \file
/// Numbers as people read them.

#include "scene.hpp"

#include <string>

namespace gravel::runner {

/// printf into a string.
template <class... Args>
std::string format(const char* pattern, Args... args) {
  const int length = std::snprintf(nullptr, 0, pattern, args...);
  std::string text(static_cast<std::size_t>(length), '\0');
  std::snprintf(text.data(), text.size() + 1, pattern, args...);
  return text;
}

/// Seconds of the clock on the wall: "8 s", "3 min 20 s", "2 h 5 min", "1e+20 years".
std::string wallTime(double seconds);

/// A time of the scene: in SI units "250 ms", "2.5 h", "3.2 d"; else with the scene's own unit.
std::string sceneTime(double time, const Units& units);

/// A length of the scene: in SI units "12 mm", "3.4 km"; else with the scene's own unit.
std::string sceneLength(double length, const Units& units);

/// "1 body", "2 bodies"
std::string counted(std::size_t n, const char* one, const char* many);

}  // namespace gravel::runner
