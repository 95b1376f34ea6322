#include "support/catch.hpp"
#include <gravel/core/callback.hpp>

#include <functional>
#include <string>

using gravel::Callback;

namespace {

int twice(int x) { return 2 * x; }

struct Counting {
  int* alive;
  explicit Counting(int* count) : alive(count) { ++*alive; }
  Counting(const Counting& other) : alive(other.alive) { ++*alive; }
  Counting& operator=(const Counting&) = delete;
  ~Counting() { --*alive; }
  int operator()(int x) const { return x + *alive; }
};

}  // namespace

static_assert(!std::is_constructible_v<Callback<int(int)>, int>);
static_assert(!std::is_constructible_v<Callback<int(int)>, std::string (*)(int)>);
static_assert(std::is_constructible_v<Callback<void(int)>, int (*)(int)>);

TEST_CASE("callback: empty until it is given something", "[callback]") {
  Callback<int(int)> callback;
  CHECK_FALSE(static_cast<bool>(callback));
  callback = [](int x) { return x + 1; };
  REQUIRE(static_cast<bool>(callback));
  CHECK(callback(4) == 5);
  callback = {};
  CHECK_FALSE(static_cast<bool>(callback));
}

TEST_CASE("callback: takes functions, pointers to functions and objects", "[callback]") {
  const Callback<int(int)> function = twice;
  const Callback<int(int)> pointer = &twice;
  const Callback<long(short)> converted = twice;
  CHECK(function(21) == 42);
  CHECK(pointer(21) == 42);
  CHECK(converted(short{21}) == 42L);
}

// Seen to fail: both are taken for something that can be called.
TEST_CASE("callback: a null pointer and an empty std::function are nothing", "[callback]") {
  int (*const none)(int) = nullptr;
  CHECK_FALSE(static_cast<bool>(Callback<int(int)>(none)));
  CHECK_FALSE(static_cast<bool>(Callback<int(int)>(std::function<int(int)>{})));
  Callback<int(int)> callback = std::function<int(int)>(twice);
  CHECK(callback(3) == 6);
  callback = nullptr;
  CHECK_FALSE(static_cast<bool>(callback));
}
TEST_CASE("callback: a result that nobody wants is dropped", "[callback]") {
  int calls = 0;
  const Callback<void(int)> callback = [&](int x) {
    calls += x;
    return calls;
  };
  callback(2);
  callback(3);
  CHECK(calls == 5);
}

TEST_CASE("callback: arguments pass as what they are", "[callback]") {
  const Callback<std::unique_ptr<int>(std::unique_ptr<int>, int&, const std::string&)> callback =
      [](std::unique_ptr<int> p, int& out, const std::string& text) {
        out = static_cast<int>(text.size());
        return p;
      };
  int length = 0;
  const std::string text = "four";
  auto p = callback(std::make_unique<int>(7), length, text);
  CHECK(*p == 7);
  CHECK(length == 4);
}

TEST_CASE("callback: copies share what is called, and the last one ends it", "[callback]") {
  int alive = 0;
  {
    Callback<int()> counter = [n = 0]() mutable { return ++n; };
    const Callback<int()> copy = counter;
    CHECK(counter() == 1);
    CHECK(copy() == 2);
    CHECK(counter() == 3);

    Callback<int(int)> first = Counting(&alive);
    Callback<int(int)> second = first;
    CHECK(alive == 1);
    first = {};
    CHECK(second(10) == 11);
    const Callback<int(int)> moved = std::move(second);
    CHECK(moved(20) == 21);
  }
  CHECK(alive == 0);
}

TEST_CASE("callback: exceptions pass through", "[callback]") {
  const Callback<void()> callback = [] { throw 5; };
  CHECK_THROWS_AS(callback(), int);
}
