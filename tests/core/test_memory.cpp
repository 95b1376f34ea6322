#include "support/catch.hpp"
#include <gravel/core/memory.hpp>

#include <numeric>

using gravel::detail::clearSpare;
using gravel::detail::resizeAnew;
using gravel::detail::resizeSparingly;

// Seen to fail: plain resize, which doubles; room for the size alone, where each new length moves all.
TEST_CASE("a workspace that grows by one at a time has an eighth to spare at most, and seldom moves") {
  std::vector<int> v;
  std::size_t moves = 0;
  for (std::size_t n = 1; n <= 100000; ++n) {
    const int* const before = v.data();
    resizeSparingly(v, n);
    v.back() = static_cast<int>(n);
    REQUIRE(v.size() == n);
    REQUIRE(v.capacity() <= n + n / 8 + 1);
    moves += v.data() != before ? 1 : 0;
  }
  CHECK(moves < 120);  // 8 up to 8, then log(100000 / 8) / log(9 / 8) = 80
  std::vector<int> counted(v.size());
  std::iota(counted.begin(), counted.end(), 1);
  CHECK(v == counted);
}

TEST_CASE("a workspace of which little was used is given back, and another one kept") {
  std::vector<int> v(100000);
  v.resize(50000);
  clearSpare(v);
  CHECK(v.empty());
  CHECK(v.capacity() >= 50000);
  v.resize(100);
  clearSpare(v);
  CHECK(v.capacity() == 0);
  resizeAnew(v, 10);
  CHECK(v == std::vector<int>(10));
  resizeAnew(v, 5);
  CHECK(v.size() == 5);
}
