#include "support/catch.hpp"
#include "support/threads.hpp"
#include <gravel/core/parallel_sort.hpp>
#include <gravel/core/random.hpp>

#include <cstdint>

using namespace gravel;
using namespace gravel::test;

TEST_CASE("parallelSort sorts a part of a vector for any size and number of threads, and leaves the rest") {
  using Pair = std::pair<std::uint32_t, std::uint32_t>;
  const CounterRandom random(5);
  for (const std::size_t n : {0U, 1U, 2U, 5U, 63U, 64U, 1000U, 4097U}) {
    std::vector<Pair> values;
    for (std::size_t i = 0; i < n + 7; ++i) {  // many equal firsts, as of bodies in one cell
      values.emplace_back(static_cast<std::uint32_t>(random.uniform(i) * 40), static_cast<std::uint32_t>(i));
    }
    std::vector<Pair> expected = values;
    std::sort(expected.begin() + 3, expected.end() - 4);
    for (const int threads : {1, 2, 3, 5, 8, 64}) {
      const WithThreads some(threads);
      std::vector<Pair> sorted = values;
      std::vector<Pair> scratch;
      parallelSort(sorted, 3, n + 3, scratch, std::less<>(), 8);
      CAPTURE(n, threads);
      CHECK(sorted == expected);
    }
  }
}
