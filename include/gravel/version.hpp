#pragma once

/// The only place where the version is written; the build system and the package files read it from here.
#define GRAVEL_VERSION_MAJOR 0
#define GRAVEL_VERSION_MINOR 1
#define GRAVEL_VERSION_PATCH 0

/// One number that grows with the version, for `#if GRAVEL_VERSION >= 100`: major * 10000 + minor * 100 +
/// patch.
#define GRAVEL_VERSION (GRAVEL_VERSION_MAJOR * 10000 + GRAVEL_VERSION_MINOR * 100 + GRAVEL_VERSION_PATCH)

namespace gravel {

/// Version of the headers that a program was compiled with.
struct Version {
  int major;
  int minor;
  int patch;
};

inline constexpr Version version{GRAVEL_VERSION_MAJOR, GRAVEL_VERSION_MINOR, GRAVEL_VERSION_PATCH};

}  // namespace gravel
