#pragma once

/// \file
/// Where bodies were at the last force evaluation, to notice what a user's hand changed since.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/sizes.hpp>

namespace gravel::detail {

/// Of four bodies what forces and contacts depend on; the mass of a fixed one is kept as another number.
template <Real Scalar>
struct PlaceTile {
  static constexpr std::size_t count = 6;
  Scalar rows[count][tileWidth];  ///< x, y, z, mass, radius, inertia/(m r^2)

  template <class Bodies>
  void takeOne(const Bodies& bodies, std::size_t i) {
    for (std::size_t c = 0; c < count; ++c) {
      rows[c][i % tileWidth] = value(bodies[i], c);
    }
  }

  template <class Bodies>
  bool holdsOne(const Bodies& bodies, std::size_t i) const {
    bool same = true;
    for (std::size_t c = 0; c < count; ++c) {
      same = same && rows[c][i % tileWidth] == value(bodies[i], c);
    }
    return same;
  }

  /// All four from i on, none of them fixed.
  template <class Bodies>
  void take(const Bodies& bodies, std::size_t i) {
    if constexpr (hasColumns<typename Bodies::Storage>) {
      for (std::size_t c = 0; c < 3; ++c) {
        Eigen::Map<BodyTile<Scalar>>{rows[c]} = tileOf(bodies.storage(), fields::Position{}, c, i);
      }
      Eigen::Map<BodyTile<Scalar>>{rows[3]} = tileOf(bodies.storage(), fields::Mass{}, 0, i);
      Eigen::Map<BodyTile<Scalar>>{rows[4]} = tileOf(bodies.storage(), fields::Radius{}, 0, i);
      Eigen::Map<BodyTile<Scalar>>{rows[5]} = tileOf(bodies.storage(), fields::InertiaFactor{}, 0, i);
    }
  }

  template <class Bodies>
  bool holds(const Bodies& bodies, std::size_t i, std::size_t end) const {
    bool same = true;
    if constexpr (hasColumns<typename Bodies::Storage>) {
      using Tile = BodyTile<Scalar>;
      const auto differs = [&](std::size_t row, const auto& tile) -> Tile {
        return (Eigen::Map<const Tile>(rows[row]) - tile).abs();
      };
      Tile change = differs(3, tileOf(bodies.storage(), fields::Mass{}, 0, i));
      change += differs(4, tileOf(bodies.storage(), fields::Radius{}, 0, i));
      change += differs(5, tileOf(bodies.storage(), fields::InertiaFactor{}, 0, i));
      for (std::size_t c = 0; c < 3; ++c) {
        change += differs(c, tileOf(bodies.storage(), fields::Position{}, c, i));
      }
      for (std::size_t lane = 0; lane < std::min(tileWidth, end - i); ++lane) {
        same = same && change[static_cast<Eigen::Index>(lane)] == Scalar(0);
      }
    }
    return same;
  }

 private:
  template <class Proxy>
  static Scalar value(const Proxy& body, std::size_t c) {
    if (c < 3) {
      return body.position()[static_cast<Eigen::Index>(c)];
    }
    if (c > 3) {
      return c == 4 ? Scalar(body.radius()) : Scalar(body.inertiaFactor());
    }
    const Scalar m = body.mass();
    if (!body.isFixed()) {
      return m;
    }
    return m > Scalar(0) ? Scalar(-m) : Scalar(-highest<Scalar>());
  }
};

}  // namespace gravel::detail
