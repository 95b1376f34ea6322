#pragma once

/// \file
/// Colouring of a graph's vertices: neighbours differ. For contacts see contact_coloring.hpp: bodies of one
/// colour may still share a neighbour, so that is what the solver uses.

#include <gravel/core/check.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/core/random.hpp>

#include <atomic>
#include <string>
#include <vector>

namespace gravel {

namespace detail {

/// Neighbours of every vertex in one array, both directions of each edge, sorted, without duplicates.
struct SymmetricGraph {
  std::vector<std::size_t> start;
  std::vector<std::size_t> neighbour;

  /// \throws std::invalid_argument for a self loop and for an index out of range
  explicit SymmetricGraph(const std::vector<std::vector<std::size_t>>& adjacency) {
    const std::size_t n = adjacency.size();
    std::vector<std::size_t> first(n + 1, 0);
    for (std::size_t i = 0; i < n; ++i) {
      for (const std::size_t j : adjacency[i]) {
        if (j >= n || j == i) {
          refuse("neighbour of vertex " + std::to_string(i), std::to_string(j),
                 "another vertex, below " + std::to_string(n));
        }
        ++first[i + 1];
        ++first[j + 1];
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      first[i + 1] += first[i];
    }
    std::vector<std::size_t> all(first[n]);
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (std::size_t i = 0; i < n; ++i) {
      for (const std::size_t j : adjacency[i]) {
        all[next[i]++] = j;
        all[next[j]++] = i;
      }
    }
    start.reserve(n + 1);
    start.push_back(0);
    neighbour.reserve(all.size());
    for (std::size_t i = 0; i < n; ++i) {
      const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first[i]);
      const auto end = all.begin() + static_cast<std::ptrdiff_t>(first[i + 1]);
      std::sort(begin, end);
      neighbour.insert(neighbour.end(), begin, std::unique(begin, end));
      start.push_back(neighbour.size());
    }
  }
};

}  // namespace detail

/// A colour 0, 1, … for every vertex, different from those of its neighbours; at most the largest degree + 1
/// colours. An edge counts if either end lists it. In parallel (Jones & Plassmann 1993, SIAM J. Sci. Comput.
/// 14, 654): each vertex waits for its neighbours of higher priority, a hash of its index, and then takes the
/// smallest free colour. The result is a function of the graph alone, whatever the threads do.
/// O(vertices + edges log degree), in O(log n / log log n) rounds for graphs of bounded degree.
/// \throws std::invalid_argument for a self loop and for an index out of range
inline std::vector<int> colorGraph(const std::vector<std::vector<std::size_t>>& adjacency) {
  const detail::SymmetricGraph graph(adjacency);
  const std::size_t n = adjacency.size();
  const CounterRandom priority(n);
  const auto before = [&](std::size_t a, std::size_t b) {
    const std::uint64_t p_a = priority.bits(a);
    const std::uint64_t p_b = priority.bits(b);
    return p_a != p_b ? p_a > p_b : a < b;
  };

  constexpr std::size_t chunk = 512;
  std::vector<int> colour(n, -1);
  std::vector<std::atomic<std::size_t>> waitingFor(n);
  std::vector<std::vector<std::size_t>> ready((n + chunk - 1) / chunk);
  parallelForChunks(n, chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::size_t count = 0;
      for (std::size_t k = graph.start[i]; k < graph.start[i + 1]; ++k) {
        count += before(graph.neighbour[k], i) ? 1U : 0U;
      }
      waitingFor[i].store(count, std::memory_order_relaxed);
      if (count == 0) {
        ready[begin / chunk].push_back(i);
      }
    }
  });

  std::vector<std::size_t> front;
  while (true) {
    front.clear();
    for (std::vector<std::size_t>& part : ready) {
      front.insert(front.end(), part.begin(), part.end());
      part.clear();
    }
    if (front.empty()) {
      return colour;
    }
    parallelForChunks(front.size(), chunk, [&](std::size_t begin, std::size_t end) {
      std::vector<bool> used;
      for (std::size_t f = begin; f < end; ++f) {
        const std::size_t i = front[f];
        const std::size_t degree = graph.start[i + 1] - graph.start[i];
        used.assign(degree + 1, false);
        for (std::size_t k = graph.start[i]; k < graph.start[i + 1]; ++k) {
          const std::size_t j = graph.neighbour[k];
          if (before(j, i)) {
            const auto c = static_cast<std::size_t>(colour[j]);  // set in an earlier round
            if (c <= degree) {
              used[c] = true;
            }
          } else if (waitingFor[j].fetch_sub(1, std::memory_order_relaxed) == 1) {
            ready[begin / chunk].push_back(j);
          }
        }
        colour[i] = static_cast<int>(std::find(used.begin(), used.end(), false) - used.begin());
      }
    });
  }
}

}  // namespace gravel
