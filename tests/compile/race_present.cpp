// Threads write one variable without order: the sanitizer must say so, or its silence elsewhere proves
// nothing.
#include <gravel/core/parallel.hpp>

#include <omp.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <vector>

int main() {
  constexpr std::size_t chunks = 64;
  std::size_t shared = 0;
  std::vector<int> thread(chunks);
  // One thread may take all chunks of a short loop, and then there is no race; and the sanitizer remembers
  // only the last few accesses: repeat until two threads took part a hundred times.
  int together = 0;
  for (int round = 0; round < 100000; ++round) {
    gravel::parallelFor(chunks, 1, [&](std::size_t i) {
      shared += i;
      thread[i] = omp_get_thread_num();
    });
    if (std::count(thread.begin(), thread.end(), thread[0]) < std::ptrdiff_t(chunks) && ++together == 100) {
      std::printf("two threads took part, sum %zu\n", shared);
      return 0;
    }
  }
  std::puts("threads hardly ever worked together");
  return 1;
}
