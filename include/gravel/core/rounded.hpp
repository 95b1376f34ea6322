#pragma once

/// \file
/// Products that are rounded before they are summed, so that different loops give the same bits.

#include <cstring>
#include <type_traits>

namespace gravel::detail {

/// A vector or a tile of numbers, as rounded. Where the machine can multiply and add with one rounding, g++
/// does so in some loops and not in others, as it happens to find the product; of this one it finds none.
/// Costs a way through the first cache where a tile is no register of the machine, and nothing on other
/// machines.
template <class Tile>
inline Tile rounded(Tile x) {
#if defined(__FMA__) || defined(__FP_FAST_FMA) || defined(__ARM_FEATURE_FMA)
  if constexpr (std::is_same_v<typename Tile::Scalar, double> ||
                std::is_same_v<typename Tile::Scalar, float>) {
#ifdef __AVX__
    if constexpr (sizeof(Tile) == 32 || sizeof(Tile) == 16) {
      typename Tile::Scalar __attribute__((vector_size(sizeof(Tile)))) held;
      std::memcpy(&held, x.data(), sizeof(Tile));
      asm("" : "+x"(held));
      std::memcpy(x.data(), &held, sizeof(Tile));
      return x;
    }
#endif
    asm("" : "+m"(x));
  }
#endif
  return x;
}

}  // namespace gravel::detail
