// Each thread writes elements of its own, and they meet only at the barrier at the end of each loop. Without
// the knowledge of that barrier the sanitizer would report the reads of the second loop.
#include <gravel/core/parallel.hpp>

#include <omp.h>

#include <cstddef>
#include <cstdio>
#include <vector>

int main() {
  constexpr std::size_t count = 4096;
  std::vector<std::size_t> first(count), second(count);
  std::vector<int> writer(count), reader(count);
  // Elements cross from thread to thread only if two threads took part: repeat until some did, often.
  std::size_t crossed = 0;
  for (int round = 0; round < 50000 && crossed < 100 * count; ++round) {
    gravel::parallelFor(count, 64, [&](std::size_t i) {
      first[i] = i;
      writer[i] = omp_get_thread_num();
    });
    gravel::parallelFor(count, 64, [&](std::size_t i) {
      second[i] = first[count - 1 - i];
      reader[i] = omp_get_thread_num();
    });
    for (std::size_t i = 0; i < count; ++i) {
      if (second[i] != count - 1 - i) {
        std::puts("wrong result");
        return 1;
      }
      crossed += reader[i] != writer[count - 1 - i];
    }
  }
  std::printf("%zu elements crossed threads\n", crossed);
  return crossed > 0 ? 0 : 1;
}
