// Two threads write one variable without order: the sanitizer must say so, or it proves nothing elsewhere.
#include <gravel/core/parallel.hpp>

#include <cstddef>
#include <cstdio>

int main() {
  std::size_t shared = 0;
  gravel::parallelFor(100000, 1000, [&](std::size_t i) { shared += i; });
  std::printf("%zu\n", shared);
}
