#pragma once

/// \file
/// Morton order (Z-order): bodies that are near in space come to stand near in memory.

#include <gravel/core/parallel.hpp>
#include <gravel/core/types.hpp>

#include <algorithm>
#include <array>
#include <numeric>
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

/// Sorts the indices in order[begin, end) along the curve through the cube that encloses their positions,
/// those of one cell by index, and sets the keys of that range.
template <class Positions>
void sortAlongCurve(const Positions& positions, std::size_t begin, std::size_t end,
                    std::vector<std::size_t>& order, std::vector<std::uint64_t>& keys) {
  using Value = std::remove_cvref_t<decltype(positions[0])>;
  using S = typename Value::Scalar;
  Vector3<S> low = positions[order[begin]];
  Vector3<S> high = low;
  for (std::size_t k = begin + 1; k < end; ++k) {
    low = low.cwiseMin(positions[order[k]]);
    high = high.cwiseMax(positions[order[k]]);
  }
  const S length = (high - low).maxCoeff();
  struct Key {
    std::uint64_t key;
    std::size_t index;
  };
  std::vector<Key> sorted(end - begin);
  parallelFor(sorted.size(), 8192, [&](std::size_t k) {
    const std::size_t i = order[begin + k];
    const Vector3<S> x = positions[i];
    sorted[k] = {mortonKey(mortonCell(S(x[0]), S(low[0]), length), mortonCell(S(x[1]), S(low[1]), length),
                           mortonCell(S(x[2]), S(low[2]), length)),
                 i};
  });
  std::sort(sorted.begin(), sorted.end(), [](const Key& a, const Key& b) {
    return a.key < b.key || (a.key == b.key && a.index < b.index);
  });
  for (std::size_t k = begin; k < end; ++k) {
    order[k] = sorted[k - begin].index;
    keys[k] = sorted[k - begin].key;
  }
}

/// As mortonOrder(), but more than `most` bodies of one cell come along a curve through a cube of their own,
/// and so on, until they coincide: one body far away would else leave all others in a cell, in no order.
template <class Positions>
std::vector<std::size_t> mortonOrderToTheEnd(const Positions& positions, std::size_t most) {
  std::vector<std::size_t> order(positions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<std::uint64_t> keys(order.size());
  std::vector<std::array<std::size_t, 2>> todo;
  if (!order.empty()) {
    todo.push_back({0, order.size()});
  }
  while (!todo.empty()) {
    const auto [begin, end] = todo.back();
    todo.pop_back();
    sortAlongCurve(positions, begin, end, order, keys);
    for (std::size_t first = begin, last = begin; first < end; first = last) {
      while (last < end && keys[last] == keys[first]) {
        ++last;
      }
      if (last - first > most && last - first < end - begin) {
        todo.push_back({first, last});
      }
    }
  }
  return order;
}

}  // namespace detail

/// order[k] is the index of the body that comes k-th along the Z-order curve through the cube that encloses
/// all positions, of 2^21 cells an axis; equal cells keep the order of indices. For `Bodies::reorder`. Finite
/// positions are required. O(N log N).
template <class Positions>
std::vector<std::size_t> mortonOrder(const Positions& positions) {
  return detail::mortonOrderToTheEnd(positions, positions.size());
}

}  // namespace gravel
