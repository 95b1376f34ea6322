#pragma once

/// \file
/// Sorting with several threads.

#include <gravel/core/parallel.hpp>

namespace gravel {

/// Sorts values[begin, end) as std::sort does: pieces by themselves, then merged two by two, each pair of
/// pieces in several parts. `less` must tell any two values apart; the result is then the only one there is,
/// the same for any number of threads. O(n log n); one thread, or fewer than `grain` values: std::sort.
/// \param scratch any vector; it grows to the size of `values`
template <class T, class Less>
void parallelSort(std::vector<T>& values, std::size_t begin, std::size_t end, std::vector<T>& scratch,
                  Less less, std::size_t grain = 16384) {
  const std::size_t n = end - begin;
  const auto at = [](std::vector<T>& v, std::size_t i) { return v.begin() + static_cast<std::ptrdiff_t>(i); };
  if (n < grain || threadCount() == 1) {
    std::sort(at(values, begin), at(values, end), less);
    return;
  }
  const auto pieces = static_cast<std::size_t>(threadCount());
  const auto edge = [&](std::size_t piece) { return begin + std::min(piece, pieces) * n / pieces; };
  parallelForTasks(pieces,
                   [&](std::size_t p) { std::sort(at(values, edge(p)), at(values, edge(p + 1)), less); });
  scratch.resize(std::max(scratch.size(), values.size()));
  std::vector<T>* from = &values;
  std::vector<T>* to = &scratch;
  for (std::size_t width = 1; width < pieces; width *= 2) {
    // Part k of a pair: of the first piece its k-th share, of the second what stands between.
    parallelForTasks((pieces + 2 * width - 1) / (2 * width) * pieces, [&](std::size_t task) {
      const std::size_t pair = task / pieces * 2 * width;
      const std::size_t first = edge(pair);
      const std::size_t middle = edge(pair + width);
      const std::size_t last = edge(pair + 2 * width);
      const auto share = [&](std::size_t k) { return first + k * (middle - first) / pieces; };
      const auto partner = [&](std::size_t k) {
        if (k == 0 || k == pieces) {
          return k == 0 ? middle : last;
        }
        const auto place = std::lower_bound(at(*from, middle), at(*from, last), (*from)[share(k)], less);
        return static_cast<std::size_t>(place - from->begin());
      };
      const std::size_t k = task % pieces;
      const std::size_t other = partner(k);
      std::merge(at(*from, share(k)), at(*from, share(k + 1)), at(*from, other), at(*from, partner(k + 1)),
                 at(*to, share(k) + (other - middle)), less);
    });
    std::swap(from, to);
  }
  if (from != &values) {
    parallelForChunks(n, grain, [&](std::size_t b, std::size_t e) {
      std::copy(at(*from, begin + b), at(*from, begin + e), at(values, begin + b));
    });
  }
}

}  // namespace gravel
