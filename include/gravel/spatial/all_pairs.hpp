#pragma once

/// \file
/// Every body against every other: the fastest for a few dozen bodies, and right for any scalar.

#include <gravel/spatial/pair.hpp>

namespace gravel {

template <Real S>
class AllPairs {
 public:
  /// Every pair with |r_ij| < r_i + r_j + margin. O(N^2); rows are shared between threads.
  void findPairs(const std::vector<detail::Sphere<S>>& spheres, const S& margin, const Domain<S>& domain,
                 const S& time, std::vector<Pair>& out) {
    const std::size_t n = spheres.size();
    const std::size_t rows = std::max<std::size_t>(1, 32768 / (n + 1));
    parts_.resize((n + rows - 1) / rows);
    parallelForChunks(n, rows, [&](std::size_t begin, std::size_t end) {
      std::vector<Pair>& part = parts_[begin / rows];
      part.clear();
      for (std::size_t i = begin; i < end; ++i) {
        for (std::size_t j = i + 1; j < n; ++j) {
          detail::appendIfNear(spheres, i, j, margin, domain, time, part);
        }
      }
    });
    detail::joinPairs(parts_, spheres, out);
  }

 private:
  std::vector<std::vector<Pair>> parts_;
};

}  // namespace gravel
