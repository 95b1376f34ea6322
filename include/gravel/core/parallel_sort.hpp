#pragma once

/// \file
/// Sorting with several threads.

#include <gravel/core/parallel.hpp>

#include <algorithm>
#include <vector>

namespace gravel {

namespace detail {

/// Sorts [first, last) in O(n + k log k), where k values have to leave for the others to be in order: of two
/// neighbours in the wrong order both leave (at most twice as many as have to), and come back by a merge.
/// Where that is more than one in four, std::sort.
template <class Iterator, class Less>
void sortNearlySorted(Iterator first, Iterator last, Less less) {
  std::vector<typename std::iterator_traits<Iterator>::value_type> left;
  Iterator kept = first;  // the end of those in order
  for (Iterator next = first; next != last; ++next) {
    if (kept == first || !less(*next, *(kept - 1))) {
      *kept++ = *next;
      continue;
    }
    left.push_back(*--kept);
    left.push_back(*next);
    if (static_cast<std::ptrdiff_t>(4 * left.size()) > (next - first) + 256) {
      std::copy(left.begin(), left.end(), kept);  // the gap is as long
      std::sort(first, last, less);
      return;
    }
  }
  std::sort(left.begin(), left.end(), less);
  for (Iterator place = last; !left.empty();) {
    if (kept != first && less(left.back(), *(kept - 1))) {
      *--place = *--kept;
    } else {
      *--place = left.back();
      left.pop_back();
    }
  }
}

}  // namespace detail

/// Sorts values[begin, end) as std::sort does: pieces by themselves, then merged two by two, each pair of
/// pieces in several parts. `less` must tell any two values apart; the result is then the only one there is,
/// the same for any number of threads. O(n log n), O(n) where nearly all stand in order; in one piece with
/// one thread, or fewer than `grain` values.
/// \param scratch any vector; it grows to the size of `values`
template <class T, class Less>
void parallelSort(std::vector<T>& values, std::size_t begin, std::size_t end, std::vector<T>& scratch,
                  Less less, std::size_t grain = 16384) {
  const std::size_t n = end - begin;
  const auto at = [](std::vector<T>& v, std::size_t i) { return v.begin() + static_cast<std::ptrdiff_t>(i); };
  if (n < grain || threadCount() == 1) {
    detail::sortNearlySorted(at(values, begin), at(values, end), less);
    return;
  }
  const auto pieces = static_cast<std::size_t>(threadCount());
  const auto edge = [&](std::size_t piece) { return begin + std::min(piece, pieces) * n / pieces; };
  parallelForTasks(pieces, [&](std::size_t p) {
    detail::sortNearlySorted(at(values, edge(p)), at(values, edge(p + 1)), less);
  });
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
