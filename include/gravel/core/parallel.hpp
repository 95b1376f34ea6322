#pragma once

/// \file
/// The only place that speaks OpenMP. Work is cut into chunks whose bounds depend on the problem alone,
/// never on the number of threads, and sums are added in the order of chunks: results are the same bits
/// for any number of threads. An exception inside a chunk is kept and thrown after the region, the one of
/// the lowest chunk first.

#include <algorithm>
#include <cstddef>
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
  /// Neighbours to one thread, and the same ones in every pass over as many: where passes follow each other
  /// over the same memory, which so stays in the caches of one core.
  Alike
};

/// Calls f(c) for c = 0 … count-1, shared between threads in any order; a single thread, and no parallel
/// region at all, when there is just one chunk or one thread. If some calls throw, the exception of the
/// lowest c among them comes out; which of the later calls were still made is not fixed.
template <Share share = Share::AsFree, class F>
void parallelForTasks(std::size_t count, F&& f) {
  if (count <= 1 || threadCount() == 1) {
    for (std::size_t c = 0; c < count; ++c) {
      f(c);
    }
    return;
  }
#ifdef _OPENMP
  detail::FirstError error;
  const auto last = static_cast<std::ptrdiff_t>(count);
  const auto call = [&](std::ptrdiff_t c) {
    try {
      f(static_cast<std::size_t>(c));
    } catch (...) {
      error.keep(static_cast<std::size_t>(c), std::current_exception());
    }
  };
  if constexpr (share == Share::AsFree) {
#pragma omp parallel for schedule(dynamic, 1)
    for (std::ptrdiff_t c = 0; c < last; ++c) {
      call(c);
    }
  } else {
#pragma omp parallel for schedule(static)
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

/// Calls f(i) for i = 0 … n-1, all about equally dear, each thread its part of the range. `grain` is how many
/// calls are worth a chunk of their own: about a microsecond's work or more.
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
template <class T, class F>
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
  parallelForTasks<Share::Alike>(count, [&](std::size_t c) { parts[c] = f(chunks.begin(c), chunks.end(c)); });
  for (std::size_t width = 1; width < count; width *= 2) {
    for (std::size_t c = 0; c + width < count; c += 2 * width) {
      parts[c] += parts[c + width];
    }
  }
  return parts[0];
}

}  // namespace gravel
