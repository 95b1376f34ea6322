#include "support/other_spaces.hpp"

template class gravel::Space<float, gravel::SoA>;
