#pragma once

/// The usual space. Its code is made once for all tests, in space.cpp: that halves the time of their build.

#include <gravel/space/space.hpp>

namespace gravel {
extern template class Space<double, SoA>;
}  // namespace gravel
