#include "support/catch.hpp"
#include "support/threads.hpp"
#include <gravel/core/parallel.hpp>
#include <gravel/core/types.hpp>

#include <omp.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

using namespace gravel;
using namespace gravel::test;

namespace {

constexpr std::size_t largest = std::numeric_limits<std::size_t>::max();

/// A sum whose last bits tell in which order it was added.
double harmonic(std::size_t begin, std::size_t end) {
  double sum = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    sum += 1.0 / static_cast<double>(3 * i + 1);
  }
  return sum;
}

template <class Call>
std::string messageOf(Call&& call) {
  try {
    call();
  } catch (const std::exception& e) {
    return e.what();
  }
  return "(nothing was thrown)";
}

void waitMilliseconds(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

}  // namespace

TEST_CASE("parallel: chunks cover every index once, in pieces of the length asked for", "[parallel]") {
  for (const int threads : {1, 2, 3, 8}) {
    const WithThreads scope(threads);
    for (const std::size_t n : {0U, 1U, 2U, 7U, 64U, 1000U}) {
      for (const std::size_t chunk : {std::size_t{0}, std::size_t{1}, std::size_t{7}, std::size_t{64}, n,
                                      n + 1, largest - 1, largest}) {
        INFO("threads " << threads << ", n " << n << ", chunk " << chunk);
        std::vector<std::atomic<int>> seen(n);
        std::atomic<bool> wellFormed{true};
        parallelForChunks(n, chunk, [&](std::size_t begin, std::size_t end) {
          const std::size_t length = chunk == 0 ? 1 : chunk;
          if (begin >= end || end > n || begin % length != 0 || (end != n && end - begin != length)) {
            wellFormed = false;
          }
          for (std::size_t i = begin; i < std::min(end, n); ++i) {
            ++seen[i];
          }
        });
        CHECK(wellFormed);
        CHECK(std::all_of(seen.begin(), seen.end(), [](const auto& times) { return times == 1; }));
      }
    }
  }
}

TEST_CASE("parallel: parallelFor calls each index once", "[parallel]") {
  for (const int threads : {1, 2, 3, 8}) {
    const WithThreads scope(threads);
    std::vector<int> seen(1003, 0);
    parallelFor(seen.size(), 10, [&](std::size_t i) { ++seen[i]; });
    CHECK(std::all_of(seen.begin(), seen.end(), [](int times) { return times == 1; }));
  }
}

// An OpenMP reduction, or partial sums by thread, differ in the last bits here between 2 and 3 threads.
TEST_CASE("parallel: ordered sums have the same bits for any number of threads", "[parallel]") {
  for (const std::size_t n : {1U, 2U, 3U, 17U, 1000U, 100001U}) {
    for (const std::size_t chunk : {1U, 3U, 64U, 1000U}) {
      double expected = 0.0;
      {
        const WithThreads scope(1);
        expected = orderedSum(n, chunk, 0.0, harmonic);
      }
      for (const int threads : {2, 3, 8}) {
        const WithThreads scope(threads);
        for (int repeat = 0; repeat < 3; ++repeat) {
          INFO("threads " << threads << ", n " << n << ", chunk " << chunk);
          CHECK(orderedSum(n, chunk, 0.0, harmonic) == expected);
        }
      }
    }
  }
}

TEST_CASE("parallel: ordered sums add the chunks pairwise in their order", "[parallel]") {
  const auto part = [](std::size_t c) { return harmonic(10 * c, 10 * c + 10); };
  const double expected = ((part(0) + part(1)) + (part(2) + part(3))) + part(4);
  CHECK(orderedSum(std::size_t{50}, 10, 0.0, harmonic) == expected);
}

// 2^23 equal terms. Pairwise, each is in 23 sums, each of which rounds by half an epsilon (Higham 1993);
// added one after the other, the sum is off by 6 percent.
TEST_CASE("parallel: the rounding error of an ordered sum grows with the logarithm of the number of chunks",
          "[parallel]") {
  const std::size_t n = 1U << 23U;
  const float sum = orderedSum(n, 1, 0.0F, [](std::size_t, std::size_t) { return 0.1F; });
  const double exact = static_cast<double>(0.1F) * static_cast<double>(n);
  CHECK(std::abs(static_cast<double>(sum) - exact) <=
        23 * 0.5 * static_cast<double>(std::numeric_limits<float>::epsilon()) * exact);
}

TEST_CASE("parallel: ordered sums of vectors, of one chunk and of none", "[parallel]") {
  const Vector3<double> zero = Vector3<double>::Zero();
  const auto ramp = [](std::size_t begin, std::size_t end) {
    Vector3<double> sum = Vector3<double>::Zero();
    for (std::size_t i = begin; i < end; ++i) {
      sum += Vector3<double>(1.0, static_cast<double>(i), -2.0);
    }
    return sum;
  };
  CHECK(orderedSum(std::size_t{100}, 7, zero, ramp) == Vector3<double>(100.0, 4950.0, -200.0));
  CHECK(orderedSum(std::size_t{100}, largest, zero, ramp) == Vector3<double>(100.0, 4950.0, -200.0));
  int calls = 0;
  const double none = orderedSum(std::size_t{0}, 7, -0.0, [&](std::size_t, std::size_t) {
    ++calls;
    return 1.0;
  });
  CHECK(std::signbit(none));
  CHECK(calls == 0);
}

// Seen to fail: a chunk without its last value.
TEST_CASE("parallel: the least value is found wherever it stands, and none is below the start",
          "[parallel]") {
  for (const std::size_t least : {std::size_t{0}, std::size_t{6}, std::size_t{7}, std::size_t{99}}) {
    const auto value = [&](std::size_t i) { return i == least ? -2.0 : static_cast<double>(i); };
    for (const std::size_t chunk : {std::size_t{0}, std::size_t{7}, std::size_t{1000}}) {
      CHECK(orderedMin(std::size_t{100}, chunk, 1.0, value) == -2.0);
      CHECK(orderedMin(std::size_t{100}, chunk, -3.0, value) == -3.0);
      CHECK(orderedMin(std::size_t{0}, chunk, 1.0, value) == 1.0);
    }
  }
}

TEST_CASE("parallel: with two threads two chunks run at the same time", "[parallel]") {
  const WithThreads scope(2);
  std::atomic<int> started{0};
  std::atomic<int> met{0};
  parallelForTasks(2, [&](std::size_t) {
    ++started;
    for (int ms = 0; ms < 20000 && started < 2; ++ms) {
      waitMilliseconds(1);
    }
    met += started == 2 ? 1 : 0;
  });
  CHECK(met == 2);
}

// Seen to fail: parts without what is left over of tasks by threads.
TEST_CASE("parallel: each of the tasks that are shared alike is done once, for more threads and for fewer",
          "[parallel]") {
  for (const int threads : {1, 2, 3, 8, 70}) {
    const WithThreads scope(threads);
    for (const std::size_t count : {0U, 1U, 2U, 3U, 7U, 64U, 1001U}) {
      INFO("threads " << threads << ", tasks " << count);
      std::vector<std::atomic<int>> seen(count);
      parallelForTasks<Share::Alike>(count, [&](std::size_t task) { ++seen[task]; });
      CHECK(std::all_of(seen.begin(), seen.end(), [](const auto& times) { return times == 1; }));
    }
  }
}

// Seen to fail: OpenMP's static schedule, and threads that do not look for what others have left.
TEST_CASE("parallel: a thread that is held up leaves its tasks to the others", "[parallel]") {
  const WithThreads scope(2);
  constexpr std::size_t count = 16;
  std::atomic<std::size_t> others{0};
  std::atomic<bool> alone{false};
  parallelForTasks<Share::Alike>(count, [&](std::size_t task) {
    if (task > 0) {
      ++others;
      return;
    }
    for (int ms = 0; ms < 20000 && others < count - 1; ++ms) {
      waitMilliseconds(1);
    }
    alone = others < count - 1;
  });
  CHECK_FALSE(alone);
}

// Seen to fail: threads that begin anywhere but with their own part.
TEST_CASE("parallel: tasks that are shared alike begin with a part of each thread's own, in their order",
          "[parallel]") {
  const WithThreads scope(2);
  constexpr std::size_t count = 16;
  std::array<std::atomic<std::size_t>, 2> first{count, count};
  std::atomic<int> started{0};
  parallelForTasks<Share::Alike>(count, [&](std::size_t task) {
    std::atomic<std::size_t>& mine = first[static_cast<std::size_t>(omp_get_thread_num())];
    if (mine == count) {
      mine = task;
      ++started;
      for (int ms = 0; ms < 20000 && started < 2; ++ms) {
        waitMilliseconds(1);
      }
    }
  });
  CHECK(first[0] == 0);
  CHECK(first[1] == count / 2);
}

TEST_CASE("parallel: one chunk runs on the calling thread and opens no region", "[parallel]") {
  const WithThreads scope(8);
  const auto caller = std::this_thread::get_id();
  int calls = 0;
  parallelForChunks(5, 5, [&](std::size_t begin, std::size_t end) {
    ++calls;
    CHECK(begin == 0);
    CHECK(end == 5);
    CHECK(std::this_thread::get_id() == caller);
    CHECK(omp_in_parallel() == 0);
  });
  CHECK(calls == 1);
}

// Keeping the exception that comes first in time fails here: chunk 3 waits before it throws.
TEST_CASE("parallel: the exception of the lowest chunk comes out, for any number of threads", "[parallel]") {
  for (const int threads : {1, 2, 3, 8}) {
    const WithThreads scope(threads);
    for (int repeat = 0; repeat < 20; ++repeat) {
      std::atomic<int> before{0};
      const auto task = [&](std::size_t c) {
        if (c < 3) {
          ++before;
        }
        if (c == 3) {
          waitMilliseconds(2);
        }
        if (c == 3 || c == 5 || c == 11) {
          throw std::runtime_error("chunk " + std::to_string(c));
        }
      };
      INFO("threads " << threads);
      CHECK(messageOf([&] { parallelForTasks(12, task); }) == "chunk 3");
      CHECK(before == 3);
      CHECK(messageOf([&] { parallelFor(12, 1, task); }) == "chunk 3");
      CHECK(messageOf([&] {
              orderedSum(std::size_t{12}, 1, 0.0, [&](std::size_t begin, std::size_t) {
                task(begin);
                return 1.0;
              });
            }) == "chunk 3");
    }
  }
}

TEST_CASE("parallel: exceptions of any type come out of the region", "[parallel]") {
  for (const int threads : {1, 2, 8}) {
    const WithThreads scope(threads);
    int caught = 0;
    try {
      parallelForTasks(4, [](std::size_t c) {
        if (c == 2) {
          throw 42;
        }
      });
    } catch (int value) {
      caught = value;
    }
    CHECK(caught == 42);
    CHECK(omp_in_parallel() == 0);
  }
}

TEST_CASE("parallel: nested calls run on one thread and give the same results", "[parallel]") {
  for (const int threads : {1, 2, 3, 8}) {
    const WithThreads scope(threads);
    CHECK(threadCount() == threads);
    std::vector<double> sums(6, 0.0);
    std::atomic<bool> oneInside{true};
    parallelForTasks(sums.size(), [&](std::size_t c) {
      if (threadCount() != 1 && omp_in_parallel() != 0) {
        oneInside = false;
      }
      sums[c] = orderedSum(1000 + c, 10, 0.0, harmonic);
    });
    CHECK(oneInside);
    for (std::size_t c = 0; c < sums.size(); ++c) {
      CHECK(sums[c] == orderedSum(1000 + c, 10, 0.0, harmonic));
    }
    CHECK(messageOf([] {
            parallelForTasks(4, [](std::size_t outer) {
              parallelForTasks(4, [&](std::size_t inner) {
                if (outer >= 1 && inner >= 2) {
                  throw std::runtime_error(std::to_string(outer) + std::to_string(inner));
                }
              });
            });
          }) == "12");
  }
}
