#pragma once

/// Spaces of other scalars and layouts that several tests need. Each is made once, in space_of_*.cpp: a
/// minute of compiling, which every test that made its own would take again. Sanitizers go without them:
/// there bodies of all layouts run in bodies/, and the whole space of a user's storage in
/// laws/test_own_particles.cpp.

#include "support/catch.hpp"
#include <gravel/space/space.hpp>

#ifndef GRAVEL_TEST_SLOW
#include "support/space_of_float.hpp"

namespace gravel {
extern template class Space<long double, SoA>;
extern template class Space<double, AoS>;
extern template class Space<double, AoSoA<8>>;
}  // namespace gravel
#endif
