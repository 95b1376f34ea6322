#pragma once

/// \file
/// Tiles of bodies in place, for layouts that keep each coefficient of all bodies in a column: passes over
/// the bodies then need no gathering.

#include <gravel/bodies/storage.hpp>
#include <gravel/core/lanes.hpp>

#include <algorithm>

namespace gravel::detail {

/// Whether a storage has such columns. Behind the last body a column goes on to a multiple of 16: a tile may
/// reach beyond, where its values mean nothing.
template <class Storage>
inline constexpr bool hasColumns = false;
template <Real S>
  requires std::is_floating_point_v<S>
inline constexpr bool hasColumns<ColumnStorage<S, SoAMapping>> = true;

inline constexpr std::size_t tileWidth = 4;
template <class S>
using BodyTile = Lanes<S, static_cast<int>(tileWidth)>;

template <class View>
auto coefficientsOf(const View& view) {
  if constexpr (requires { view.coeffs(); }) {
    return view.coeffs();
  } else {
    return view;
  }
}

/// Coefficient c of field F of the bodies i … i + tileWidth - 1, to be read and written.
template <class F, class Storage>
  requires(hasColumns<std::remove_const_t<Storage>>)
auto tileOf(Storage& storage, F field, std::size_t c, std::size_t i) {
  using S = typename Storage::Scalar;
  using Value = std::conditional_t<std::is_const_v<Storage>, const S, S>;
  using Tile = std::conditional_t<std::is_const_v<Storage>, const BodyTile<S>, BodyTile<S>>;
  Value* first = nullptr;
  if constexpr (F::width == 1) {
    first = &storage.at(field, i);
  } else {
    auto view = coefficientsOf(storage.at(field, i));
    first = view.data() + static_cast<std::ptrdiff_t>(c) * view.innerStride();
  }
  return Eigen::Map<Tile>(first);
}

/// Calls tiles(i) for the first body i of each tile of [begin, end) that holds no fixed body, or none with
/// any of the flags given, where the storage has columns; one(k) for each body k that no tile holds.
template <class Storage, class Tiles, class One>
void forTilesOrBodies(const Storage& storage, std::size_t begin, std::size_t end, Tiles&& tiles, One&& one,
                      std::uint32_t flags = static_cast<std::uint32_t>(BodyFlag::Fixed)) {
  if constexpr (hasColumns<Storage>) {
    for (std::size_t i = begin; i < end; i += tileWidth) {
      const std::size_t last = std::min(end, i + tileWidth);
      std::uint32_t any = 0;
      for (std::size_t k = i; k < last; ++k) {
        any |= storage.at(fields::Flags{}, k);
      }
      if ((any & flags) == 0) {
        tiles(i);
      } else {
        for (std::size_t k = i; k < last; ++k) {
          one(k);
        }
      }
    }
  } else {
    for (std::size_t i = begin; i < end; ++i) {
      one(i);
    }
  }
}

}  // namespace gravel::detail
