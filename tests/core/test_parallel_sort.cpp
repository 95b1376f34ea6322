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

TEST_CASE("What nearly stands in order is sorted in O(n), and the rest as always") {
  const CounterRandom random(6);
  const std::size_t n = 20000;
  const auto place = [&](std::uint64_t i) { return static_cast<std::size_t>(random.uniform(i) * double(n)); };
  // Numbers that leave their place, one in so many; the last has none in order.
  for (const std::size_t share : {std::size_t{0}, std::size_t{1000}, std::size_t{100}, std::size_t{20},
                                  std::size_t{5}, std::size_t{1}}) {
    std::vector<std::uint64_t> values;
    for (std::size_t i = 0; i < n; ++i) {
      const bool leaves = share > 0 && random.uniform(i + 5 * n) * double(share) < 1.0;
      values.push_back(std::uint64_t{leaves ? place(i) : i} << 32U | i);
    }
    std::vector<std::uint64_t> expected = values;
    std::sort(expected.begin(), expected.end());
    std::size_t compared = 0;
    const auto less = [&](std::uint64_t a, std::uint64_t b) {
      ++compared;
      return a < b;
    };
    gravel::detail::sortNearlySorted(values.begin(), values.end(), less);
    CAPTURE(share, compared);
    CHECK(values == expected);
    if (share == 0 || share >= 100) {
      // One a number to look, k of 2 n/share that leave at about 2 log2 k, and one more a number to merge.
      CHECK(compared < 3 * n);
    }
  }
}

TEST_CASE("Nearly sorted values in a few places, one far away among them, are sorted too") {
  for (const std::size_t n : {0U, 1U, 2U, 3U, 300U}) {
    for (std::size_t k = 0; k < std::max<std::size_t>(n, 1); ++k) {
      std::vector<std::size_t> values(n);
      for (std::size_t i = 0; i < n; ++i) {
        values[i] = i;
      }
      if (n > 0) {
        values[k] = n;  // drives out its successor, and goes to the end
        std::swap(values[n / 2], values[n - 1 - k]);
      }
      std::vector<std::size_t> expected = values;
      std::sort(expected.begin(), expected.end());
      gravel::detail::sortNearlySorted(values.begin(), values.end(), std::less<>());
      CAPTURE(n, k);
      CHECK(values == expected);
    }
  }
}
