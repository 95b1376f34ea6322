#pragma once

/// \file
/// Lanes: a tile of bodies held by value, one body a lane. Hot loops load a tile from whatever layout the
/// bodies have, compute on it, and store it back; the compiler turns each operation into packed
/// instructions of whatever width its target has. Eigen's packets are used because `std::sqrt` in a loop
/// stays scalar unless errno is switched off, which a header cannot ask for.

#include <gravel/core/types.hpp>

namespace gravel {

/// Bodies a tile: a cache line of the built-in scalars. One for other types, which have no packets.
template <Real Scalar>
inline constexpr int laneWidth = std::is_same_v<Scalar, float>      ? 16
                                 : std::is_same_v<Scalar, double>   ? 8
                                 : std::is_floating_point_v<Scalar> ? 4
                                                                    : 1;

template <Real Scalar, int W = laneWidth<Scalar>>
using Lanes = Eigen::Array<Scalar, W, 1>;

/// Number of tiles that hold n bodies; the last one may be part empty.
constexpr std::size_t tileCount(std::size_t n, int width) {
  return (n + static_cast<std::size_t>(width) - 1) / static_cast<std::size_t>(width);
}

}  // namespace gravel
