#pragma once

/// \file
/// Declarations for headers that only name gravel's types.

namespace gravel {

struct SoA;
struct AoS;
template <int W>
struct AoSoA;

}  // namespace gravel

/// Name of a class that may look into `Space`: the fixture of unit tests of an including project.
class SpaceTest;
