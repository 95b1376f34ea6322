#include "support/space.hpp"

template class gravel::Space<double, gravel::SoA>;
