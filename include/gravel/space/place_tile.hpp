#pragma once

/// \file
/// Where bodies were at the last force evaluation, to notice what a user's hand changed since.

#include <gravel/bodies/bodies.hpp>

namespace gravel::detail {

/// Places and masses of four bodies; the mass of a fixed one is kept as another number.
template <Real Scalar>
struct PlaceTile {
  Scalar rows[4][tileWidth];  ///< x, y, z, mass

  template <class Bodies>
  void takeOne(const Bodies& bodies, std::size_t i) {
    for (std::size_t c = 0; c < 4; ++c) {
      rows[c][i % tileWidth] = value(bodies[i], c);
    }
  }

  template <class Bodies>
  bool holdsOne(const Bodies& bodies, std::size_t i) const {
    bool same = true;
    for (std::size_t c = 0; c < 4; ++c) {
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
    }
  }

  template <class Bodies>
  bool holds(const Bodies& bodies, std::size_t i, std::size_t end) const {
    bool same = true;
    if constexpr (hasColumns<typename Bodies::Storage>) {
      using Tile = BodyTile<Scalar>;
      Tile change = (Eigen::Map<const Tile>(rows[3]) - tileOf(bodies.storage(), fields::Mass{}, 0, i)).abs();
      for (std::size_t c = 0; c < 3; ++c) {
        change +=
            (Eigen::Map<const Tile>(rows[c]) - tileOf(bodies.storage(), fields::Position{}, c, i)).abs();
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
    const Scalar m = body.mass();
    return body.isFixed() ? Scalar(-m - Scalar(1)) : m;
  }
};

}  // namespace gravel::detail
