#include "support/other_spaces.hpp"

template class gravel::Space<long double, gravel::SoA>;
