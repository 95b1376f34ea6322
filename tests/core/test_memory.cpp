#include "support/catch.hpp"
#include <gravel/core/memory.hpp>

#include <numeric>

using gravel::detail::clearSpare;
using gravel::detail::giveBack;
using gravel::detail::resizeAnew;
using gravel::detail::resizeSparingly;

// Seen to fail: plain resize, which doubles; room for the size alone, where each new length moves all.
TEST_CASE("a workspace that grows by one at a time has a thirty-second to spare at most, and seldom moves") {
  std::vector<int> v;
  std::size_t moves = 0;
  for (std::size_t n = 1; n <= 100000; ++n) {
    const int* const before = v.data();
    resizeSparingly(v, n);
    v.back() = static_cast<int>(n);
    REQUIRE(v.size() == n);
    REQUIRE(v.capacity() <= n + n / 32 + 1);
    moves += v.data() != before ? 1 : 0;
  }
  CHECK(moves < 350);  // 32 up to 32, then log(100000 / 32) / log(33 / 32) = 262, and some by rounding
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

TEST_CASE("what one part of a step fills is left to the others, unless it is little or much") {
  std::vector<int> many(100000);
  giveBack(many);
  CHECK(many.capacity() == 0);
  std::vector<int> few(100);
  giveBack(few);
  CHECK(few.capacity() >= 100);
  std::vector<int> much(gravel::detail::muchMemory / sizeof(int));
  giveBack(much);
  CHECK(much.capacity() >= gravel::detail::muchMemory / sizeof(int));
}
