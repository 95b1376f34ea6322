// error: gravel: orderedSum of bool
#include <gravel/core/parallel.hpp>

double sum() {
  return gravel::orderedSum(100, 10, 0.0,
                            [](std::size_t begin, std::size_t end) { return double(end - begin); });
}

#if GRAVEL_WRONG == 1
bool any() {
  return gravel::orderedSum(100, 10, false, [](std::size_t begin, std::size_t end) { return end > begin; });
}
#endif
