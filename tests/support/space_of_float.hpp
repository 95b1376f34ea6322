#pragma once

/// The space in single precision. Its code is made once, in space_of_float.cpp.

#include <gravel/space/space.hpp>

namespace gravel {
extern template class Space<float, SoA>;
}  // namespace gravel
