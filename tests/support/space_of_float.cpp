#include "support/space_of_float.hpp"

template class gravel::Space<float, gravel::SoA>;
