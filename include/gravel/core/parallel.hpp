#pragma once

/// \file
/// The only place that speaks OpenMP. Work is cut into chunks whose bounds depend on the problem alone,
/// never on the number of threads, and sums are added in the order of chunks: results are the same bits
/// for any number of threads. An exception inside a chunk is kept and thrown after the region, the one of
/// the lowest chunk first.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace gravel {

/// Threads that the next parallel region may use (OMP_NUM_THREADS, omp_set_num_threads).
inline int threadCount() {
#ifdef _OPENMP
  return omp_in_parallel() != 0 ? 1 : omp_get_max_threads();
#else
  return 1;
#endif
}

namespace detail {

/// Less than that many chunks of some microseconds stay on one thread: they would gain little from others,
/// and wait for them where cores have other work, which takes a hundred times as long.
inline constexpr std::size_t fewTasks = 8;

/// The one copy of a task's code, whoever calls it: in two of them a compiler could fuse products with sums
/// in other places, and bits would depend on the number of threads.
template <class F>
#if defined(__GNUC__) && !defined(__clang__)
[[gnu::noinline, gnu::noclone]]
#else
[[gnu::noinline]]
#endif
void callTask(F& f, std::size_t task) {
  f(task);
}

/// Keeps the exception of the lowest chunk that threw.
class FirstError {
 public:
  void keep(std::size_t chunk, std::exception_ptr error) noexcept {
#ifdef _OPENMP
#pragma omp critical(gravel_first_error)
#endif
    {
      if (chunk < chunk_) {
        chunk_ = chunk;
        error_ = std::move(error);
      }
    }
  }

  void rethrow() const {
    if (error_) {
      std::rethrow_exception(error_);
    }
  }

 private:
  std::size_t chunk_ = std::numeric_limits<std::size_t>::max();
  std::exception_ptr error_;
};

#ifdef _OPENMP
/// Tasks 0 … count-1 in as many parts as there are threads: each takes its own from the front, and when there
/// are none left, those of others from the back. So a thread has the same tasks in every pass, but for a few
/// where it is slower or faster than others: cores differ, and may have other work.
class OwnTasks {
 public:
  OwnTasks(std::size_t count, std::size_t threads) : parts_(threads) {
    for (std::size_t t = 0; t < threads; ++t) {
      const auto bound = [&](std::size_t k) {
        return static_cast<std::uint32_t>(count / threads * k + count % threads * k / threads);
      };
      parts_[t].left.store(pack(bound(t), bound(t + 1)), std::memory_order_relaxed);
    }
  }

  /// Calls f(task) for what is left to thread `own`. Called once by each thread of a team, of any size.
  template <class F>
  void run(std::size_t own, F&& f) {
    std::uint32_t task = 0;
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      std::atomic<std::uint64_t>& left = parts_[(own + k) % parts_.size()].left;
      while (k == 0 ? takeFirst(left, task) : takeLast(left, task)) {
        f(task);
      }
    }
  }

 private:
  struct Part {
    std::atomic<std::uint64_t> left;   ///< begin and end of what is left
    std::array<char, 56> otherLine{};  ///< no two parts in one line of the cache
  };
  static constexpr std::uint64_t pack(std::uint32_t begin, std::uint32_t end) {
    return (std::uint64_t{end} << 32U) | begin;
  }
  static bool takeFirst(std::atomic<std::uint64_t>& left, std::uint32_t& task) {
    return take(left, [&](std::uint32_t begin, std::uint32_t end) {
      task = begin;
      return pack(begin + 1, end);
    });
  }
  static bool takeLast(std::atomic<std::uint64_t>& left, std::uint32_t& task) {
    return take(left, [&](std::uint32_t begin, std::uint32_t end) {
      task = end - 1;
      return pack(begin, end - 1);
    });
  }
  /// Which task is whose is all that is agreed on here; what tasks do is ordered by the end of the region.
  template <class Next>
  static bool take(std::atomic<std::uint64_t>& left, Next&& next) {
    std::uint64_t now = left.load(std::memory_order_relaxed);
    while (true) {
      const auto begin = static_cast<std::uint32_t>(now);
      const auto end = static_cast<std::uint32_t>(now >> 32U);
      if (begin >= end) {
        return false;
      }
      if (left.compare_exchange_weak(now, next(begin, end), std::memory_order_relaxed)) {
        return true;
      }
    }
  }

  std::vector<Part> parts_;
};
#endif

/// [0, n) in consecutive pieces of `size`, the last one shorter; a size of 0 counts as 1. No n or size
/// overflows.
struct Chunks {
  std::size_t n;
  std::size_t size;

  Chunks(std::size_t total, std::size_t chunk) : n(total), size(std::max<std::size_t>(chunk, 1)) {}
  std::size_t count() const { return n / size + (n % size != 0 ? 1 : 0); }
  std::size_t begin(std::size_t c) const { return c * size; }
  std::size_t end(std::size_t c) const { return begin(c) + std::min(size, n - begin(c)); }
};

}  // namespace detail

/// How chunks find their threads; no result depends on it.
enum class Share {
  AsFree,  ///< each to a thread that has nothing to do: where some take much longer than others
  /// Neighbours to one thread, and nearly the same ones in every pass over as many: where passes follow each
  /// other over the same memory, which so stays in the caches of one core.
  Alike
};

/// Calls f(c) for c = 0 … count-1, shared between threads in any order; a single thread, and no parallel
/// region at all, when there is just one chunk or one thread. If some calls throw, the exception of the
/// lowest c among them comes out; which of the later calls were still made is not fixed.
template <Share share = Share::AsFree, class F>
void parallelForTasks(std::size_t count, F&& f) {
  if (count < (share == Share::Alike ? detail::fewTasks : 2) || threadCount() == 1) {
    for (std::size_t c = 0; c < count; ++c) {
      detail::callTask(f, c);
    }
    return;
  }
#ifdef _OPENMP
  detail::FirstError error;
  const auto last = static_cast<std::ptrdiff_t>(count);
  const auto call = [&](std::ptrdiff_t c) {
    try {
      detail::callTask(f, static_cast<std::size_t>(c));
    } catch (...) {
      error.keep(static_cast<std::size_t>(c), std::current_exception());
    }
  };
  if (share == Share::Alike && count < std::numeric_limits<std::uint32_t>::max()) {
    detail::OwnTasks tasks(count, static_cast<std::size_t>(threadCount()));
#pragma omp parallel
    tasks.run(static_cast<std::size_t>(omp_get_thread_num()), call);
  } else {
#pragma omp parallel for schedule(dynamic, 1)
    for (std::ptrdiff_t c = 0; c < last; ++c) {
      call(c);
    }
  }
  error.rethrow();
#endif
}

/// Calls f(begin, end) for consecutive chunks of [0, n), `chunk` long but for the last.
template <Share share = Share::AsFree, class F>
void parallelForChunks(std::size_t n, std::size_t chunk, F&& f) {
  const detail::Chunks chunks(n, chunk);
  parallelForTasks<share>(chunks.count(), [&](std::size_t c) { f(chunks.begin(c), chunks.end(c)); });
}

/// Calls f(i) for i = 0 … n-1, all about equally dear. `grain` is how many calls are worth a chunk of their
/// own: about five microseconds' work, as much as a parallel region takes to begin and end.
template <class F>
void parallelFor(std::size_t n, std::size_t grain, F&& f) {
  parallelForChunks<Share::Alike>(n, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      f(i);
    }
  });
}

/// Sum over chunks of f(begin, end), added pairwise in the order of chunks: the same bits for any number
/// of threads, and a rounding error that grows with the logarithm of the number of chunks (Higham 1993).
template <Share share = Share::Alike, class T, class F>
T orderedSum(std::size_t n, std::size_t chunk, const T& zero, F&& f) {
  static_assert(!std::is_same_v<T, bool>,
                "gravel: orderedSum of bool: sum a number");  // vector<bool> would race
  const detail::Chunks chunks(n, chunk);
  const std::size_t count = chunks.count();
  if (count == 0) {
    return zero;
  }
  if (count == 1) {
    return f(0, n);
  }
  std::vector<T> parts(count, zero);
  parallelForTasks<share>(count, [&](std::size_t c) { parts[c] = f(chunks.begin(c), chunks.end(c)); });
  for (std::size_t width = 1; width < count; width *= 2) {
    for (std::size_t c = 0; c + width < count; c += 2 * width) {
      parts[c] += parts[c + width];
    }
  }
  return std::move(parts[0]);
}

/// The least of `start` and f(i) for i = 0 … n-1, in chunks.
template <Share share = Share::AsFree, class T, class F>
T orderedMin(std::size_t n, std::size_t chunk, const T& start, F&& f) {
  const detail::Chunks chunks(n, chunk);
  std::vector<T> parts(chunks.count(), start);
  parallelForTasks<share>(parts.size(), [&](std::size_t c) {
    for (std::size_t i = chunks.begin(c); i < chunks.end(c); ++i) {
      const T x = f(i);
      if (x < parts[c]) {
        parts[c] = x;
      }
    }
  });
  T least = start;
  for (const T& x : parts) {
    least = x < least ? x : least;
  }
  return least;
}

}  // namespace gravel
