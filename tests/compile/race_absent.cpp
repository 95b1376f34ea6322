// Each thread writes its own elements, and they meet only at the barrier at the end of each loop. The sanitizer
// would report the reads of the second loop if it did not know of that barrier.
#include <gravel/core/parallel.hpp>

#include <cstddef>
#include <cstdio>
#include <vector>

int main() {
  constexpr std::size_t count = 100000;
  for (int round = 0; round < 20; ++round) {
    std::vector<std::size_t> first(count), second(count);
    gravel::parallelFor(count, 1000, [&](std::size_t i) { first[i] = i; });
    gravel::parallelFor(count, 1000, [&](std::size_t i) { second[i] = first[count - 1 - i]; });
    if (second[0] != count - 1) {
      std::puts("wrong result");
      return 1;
    }
  }
}
