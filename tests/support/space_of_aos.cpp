#include "support/other_spaces.hpp"

template class gravel::Space<double, gravel::AoS>;
