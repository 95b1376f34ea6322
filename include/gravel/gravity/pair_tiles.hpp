#pragma once

/// \file
/// The inner loops of the direct sum: tiles of bodies in lanes against one broadcast source after another.
/// Each square root and division serves both bodies of a pair.

#include <gravel/gravity/pair_law.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace gravel::detail {

/// A tile as a value: lanes for the scalars that have packets, else a single scalar. The width does not
/// depend on the target, so that object files for different targets agree on the order of every sum.
template <Real S>
struct GravityTile {
  static constexpr int width = 1;
  static constexpr std::size_t sources = 1;  ///< broadcast together, to load and store a tile less often
  using Type = S;

  static S load(const S* p) { return *p; }
  static void store(S* p, const S& tile) { *p = tile; }
  static S constant(const S& x) { return x; }
  static S sum(const S& tile) { return tile; }
};

template <Real S>
  requires(std::is_same_v<S, float> || std::is_same_v<S, double>)
struct GravityTile<S> {
  static constexpr int width = laneWidth<S>;
  static constexpr std::size_t sources = std::is_same_v<S, float> ? 2 : 4;
  using Type = Lanes<S, width>;

  static Type load(const S* p) { return Eigen::Map<const Type>(p); }
  static void store(S* p, const Type& tile) { Eigen::Map<Type>{p} = tile; }
  static Type constant(S x) { return Type::Constant(x); }
  static S sum(const Type& tile) { return tile.sum(); }
};

/// Bodies in columns, in units of their own extent and largest mass. Those with mass stand first, filled up
/// with massless copies of the last one to whole tiles; then the tracers, filled up likewise.
template <Real S>
struct PairTable {
  using Tile = GravityTile<S>;
  using T = typename Tile::Type;
  static constexpr auto width = static_cast<std::size_t>(Tile::width);

  std::vector<S> x, y, z, m;
  std::vector<S> ax, ay, az;
  std::size_t sourceEnd = 0;  ///< first row of the tracers; a multiple of the width
  S softening_sq = S(0);

  std::size_t size() const { return x.size(); }

  void resize(std::size_t rows) {
    for (std::vector<S>* column : {&x, &y, &z, &m}) {
      column->resize(rows);
    }
  }

  void clearAccelerations() {
    for (std::vector<S>* column : {&ax, &ay, &az}) {
      column->assign(size(), S(0));
    }
  }

  /// Rows that one call of addMutual or addWithin may take.
  static constexpr std::size_t maxBlock = 256;

  /// Every pair of two disjoint ranges of rows, both ways. Ranges are whole tiles, the first at most
  /// maxBlock. The first range's sums are gathered apart and added at the end: rounding then grows with the
  /// root of the number of blocks instead of bodies.
  void addMutual(std::size_t firstBegin, std::size_t firstEnd, std::size_t secondBegin,
                 std::size_t secondEnd) {
    alignas(64) std::array<S, maxBlock> sx, sy, sz;
    const std::size_t n = firstEnd - firstBegin;
    for (std::array<S, maxBlock>* sum : {&sx, &sy, &sz}) {
      std::fill(sum->begin(), sum->begin() + static_cast<std::ptrdiff_t>(n), S(0));
    }
    for (std::size_t j = secondBegin; j < secondEnd; j += Tile::sources) {
      addSources(firstBegin, n, j, sx.data(), sy.data(), sz.data());
    }
    for (std::size_t i = 0; i < n; ++i) {
      ax[firstBegin + i] += sx[i];
      ay[firstBegin + i] += sy[i];
      az[firstBegin + i] += sz[i];
    }
  }

  /// Every pair within a range: both ways between tiles, each way by itself within a tile, where the pair of
  /// a body with itself has no distance and so no force.
  void addWithin(std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; tile += width) {
      addTile(tile);
      const std::size_t rest = tile + width;
      for (std::size_t j = tile; j < rest; j += Tile::sources) {
        addSources(rest, end - rest, j, ax.data() + rest, ay.data() + rest, az.data() + rest);
      }
    }
  }

  /// The pairs within a tile, each way by itself. Apart from addOneWay, whose sums would wait for each other.
  [[gnu::flatten]] void addTile(std::size_t tile) {
    const T xi = Tile::load(&x[tile]);
    const T yi = Tile::load(&y[tile]);
    const T zi = Tile::load(&z[tile]);
    T axi = Tile::constant(S(0));
    T ayi = axi;
    T azi = axi;
    for (std::size_t j = tile; j < tile + width; ++j) {
      const T dx = x[j] - xi;
      const T dy = y[j] - yi;
      const T dz = z[j] - zi;
      const T s = dx * dx + dy * dy + dz * dz + softening_sq;
      const T f = m[j] * PairLaw<S>::accelerationFactor(s);
      axi += f * dx;
      ayi += f * dy;
      azi += f * dz;
    }
    Tile::store(&ax[tile], Tile::load(&ax[tile]) + axi);
    Tile::store(&ay[tile], Tile::load(&ay[tile]) + ayi);
    Tile::store(&az[tile], Tile::load(&az[tile]) + azi);
  }

  /// What the source j does to a range.
  [[gnu::flatten]] void addOneWay(std::size_t begin, std::size_t end, std::size_t j) {
    const T xj = Tile::constant(x[j]);
    const T yj = Tile::constant(y[j]);
    const T zj = Tile::constant(z[j]);
    for (std::size_t i = begin; i < end; i += width) {
      const T dx = xj - Tile::load(&x[i]);
      const T dy = yj - Tile::load(&y[i]);
      const T dz = zj - Tile::load(&z[i]);
      const T s = dx * dx + dy * dy + dz * dz + softening_sq;
      const T f = m[j] * PairLaw<S>::accelerationFactor(s);
      Tile::store(&ax[i], Tile::load(&ax[i]) + f * dx);
      Tile::store(&ay[i], Tile::load(&ay[i]) + f * dy);
      Tile::store(&az[i], Tile::load(&az[i]) + f * dz);
    }
  }

  /// Sum of m_i m_j p_ij over the pairs of two disjoint ranges.
  [[gnu::flatten]] S potentialBetween(std::size_t firstBegin, std::size_t firstEnd, std::size_t secondBegin,
                                      std::size_t secondEnd) const {
    S total(0);
    for (std::size_t j = secondBegin; j < secondEnd; ++j) {
      T sum = Tile::constant(S(0));
      for (std::size_t i = firstBegin; i < firstEnd; i += width) {
        sum += potentials(i, j);
      }
      total += m[j] * Tile::sum(sum);
    }
    return total;
  }

  /// The same over the pairs within a range.
  S potentialWithin(std::size_t begin, std::size_t end) const {
    S total(0);
    for (std::size_t tile = begin; tile < end; tile += width) {
      if constexpr (Tile::width > 1) {
        for (std::size_t j = tile; j < tile + width; ++j) {
          const T lanes = potentials(tile, j);
          S sum(0);
          for (std::size_t i = tile; i < j; ++i) {
            sum += lanes[static_cast<Eigen::Index>(i - tile)];
          }
          total += m[j] * sum;
        }
      }
      total += potentialBetween(tile + width, end, tile, tile + width);
    }
    return total;
  }

 private:
  /// The sources j … j + Tile::sources - 1 against `count` rows from `begin`, whose sums stand at sx, sy, sz.
  /// Flattened, as g++ -O2 would call a function for each small step.
  [[gnu::flatten]] void addSources(std::size_t begin, std::size_t count, std::size_t j, S* sx, S* sy, S* sz) {
    constexpr std::size_t n = Tile::sources;
    T xj[n], yj[n], zj[n], mj[n];
    T rx[n], ry[n], rz[n];  // reactions, to be reduced once
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t source = j + k;
      xj[k] = Tile::constant(x[source]);
      yj[k] = Tile::constant(y[source]);
      zj[k] = Tile::constant(z[source]);
      mj[k] = Tile::constant(m[source]);
      rx[k] = ry[k] = rz[k] = Tile::constant(S(0));
    }
    for (std::size_t i = 0; i < count; i += width) {
      const T xi = Tile::load(&x[begin + i]);
      const T yi = Tile::load(&y[begin + i]);
      const T zi = Tile::load(&z[begin + i]);
      const T mi = Tile::load(&m[begin + i]);
      T axi = Tile::load(sx + i);
      T ayi = Tile::load(sy + i);
      T azi = Tile::load(sz + i);
      for (std::size_t k = 0; k < n; ++k) {
        const T dx = xj[k] - xi;
        const T dy = yj[k] - yi;
        const T dz = zj[k] - zi;
        const T s = dx * dx + dy * dy + dz * dz + softening_sq;
        const T w = PairLaw<S>::accelerationFactor(s);
        const T f_i = mj[k] * w;
        const T f_j = mi * w;
        axi += f_i * dx;
        ayi += f_i * dy;
        azi += f_i * dz;
        rx[k] -= f_j * dx;
        ry[k] -= f_j * dy;
        rz[k] -= f_j * dz;
      }
      Tile::store(sx + i, axi);
      Tile::store(sy + i, ayi);
      Tile::store(sz + i, azi);
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t source = j + k;
      ax[source] += Tile::sum(rx[k]);
      ay[source] += Tile::sum(ry[k]);
      az[source] += Tile::sum(rz[k]);
    }
  }

  T potentials(std::size_t i, std::size_t j) const {
    const T dx = x[j] - Tile::load(&x[i]);
    const T dy = y[j] - Tile::load(&y[i]);
    const T dz = z[j] - Tile::load(&z[i]);
    const T s = dx * dx + dy * dy + dz * dz + softening_sq;
    return Tile::load(&m[i]) * PairLaw<S>::potentialFactor(s);
  }
};

}  // namespace gravel::detail
