#pragma once

/// \file
/// Morton order (Z-order): bodies that are near in space come to stand near in memory.

#include <gravel/core/parallel.hpp>
#include <gravel/core/types.hpp>

#include <algorithm>
#include <vector>

namespace gravel {

namespace detail {

/// Spreads 21 bits so that two zeros stand after each.
constexpr std::uint64_t spreadBits(std::uint64_t x) {
  x &= 0x1FFFFFU;
  x = (x | x << 32U) & 0x001F00000000FFFFU;
  x = (x | x << 16U) & 0x001F0000FF0000FFU;
  x = (x | x << 8U) & 0x100F00F00F00F00FU;
  x = (x | x << 4U) & 0x10C30C30C30C30C3U;
  x = (x | x << 2U) & 0x1249249249249249U;
  return x;
}

/// Interleaves three numbers below 2^21, x in the lowest bit.
constexpr std::uint64_t mortonKey(std::uint64_t x, std::uint64_t y, std::uint64_t z) {
  return spreadBits(x) | spreadBits(y) << 1U | spreadBits(z) << 2U;
}

/// Cell of a coordinate among 2^21 equal cells of [low, low + length].
template <Real S>
std::uint64_t mortonCell(const S& x, const S& low, const S& length) {
  constexpr std::uint64_t cells = 1U << 21U;
  const S place = length > S(0) ? S((x - low) / length) : S(0);
  if constexpr (std::is_floating_point_v<S>) {
    const S cell = place * static_cast<S>(cells);
    return cell > S(0) ? std::min(static_cast<std::uint64_t>(cell), cells - 1) : 0;
  } else {  // bisection: a user's scalar need not convert to integers
    std::uint64_t cell = 0;
    for (std::uint64_t bit = cells / 2; bit > 0; bit /= 2) {
      if (place * S(static_cast<double>(cells)) >= S(static_cast<double>(cell + bit))) {
        cell += bit;
      }
    }
    return cell;
  }
}

}  // namespace detail

/// order[k] is the index of the body that comes k-th along the Z-order curve through the cube that encloses
/// all positions, of 2^21 cells an axis; equal cells keep the order of indices. For `Bodies::reorder`. Finite
/// positions are required. O(N log N).
template <class Positions>
std::vector<std::size_t> mortonOrder(const Positions& positions) {
  using Value = std::remove_cvref_t<decltype(positions[0])>;
  using S = typename Value::Scalar;
  const std::size_t n = positions.size();
  if (n == 0) {
    return {};
  }
  Vector3<S> low = positions[0];
  Vector3<S> high = low;
  for (std::size_t i = 1; i < n; ++i) {
    low = low.cwiseMin(positions[i]);
    high = high.cwiseMax(positions[i]);
  }
  const S length = (high - low).maxCoeff();
  struct Key {
    std::uint64_t key;
    std::size_t index;
  };
  std::vector<Key> keys(n);
  parallelFor(n, 8192, [&](std::size_t i) {
    const Vector3<S> x = positions[i];
    keys[i] = {detail::mortonKey(detail::mortonCell(S(x[0]), S(low[0]), length),
                                 detail::mortonCell(S(x[1]), S(low[1]), length),
                                 detail::mortonCell(S(x[2]), S(low[2]), length)),
               i};
  });
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return a.key < b.key || (a.key == b.key && a.index < b.index);
  });
  std::vector<std::size_t> order(n);
  for (std::size_t k = 0; k < n; ++k) {
    order[k] = keys[k].index;
  }
  return order;
}

}  // namespace gravel
