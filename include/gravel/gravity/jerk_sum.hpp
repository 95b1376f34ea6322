#pragma once

/// \file
/// Accelerations and their rates of change by summing pairs, for some of the bodies: what Hermite's
/// integrators with individual steps ask for.

#include <gravel/core/parallel.hpp>
#include <gravel/gravity/gravity_units.hpp>
#include <gravel/gravity/pair_tiles.hpp>

#include <array>
#include <cstdint>
#include <span>

namespace gravel {

namespace detail {

/// Lanes over the sources; half of those of GravityTile, since twice as many sums are kept.
template <Real S>
struct JerkTile {
  static constexpr int width = 1;
  using Type = S;

  static S load(const S* p) { return *p; }
  static S constant(const S& x) { return x; }
  static S sum(const S& tile) { return tile; }
  static S largest(const S& tile) { return tile; }
};

template <Real S>
  requires(GravityTile<S>::width > 1)
struct JerkTile<S> {
  static constexpr int width = GravityTile<S>::width / 2;
  using Type = Lanes<S, width>;

  static Type load(const S* p) { return Eigen::Map<const Type>(p); }
  static Type constant(S x) { return Type::Constant(x); }
  static S sum(const Type& tile) { return tile.sum(); }
  static S largest(const Type& tile) { return tile.maxCoeff(); }
};

}  // namespace detail

/// Newton's law with Plummer's softening and its derivative with time (Makino & Aarseth 1992, PASJ 44, 141),
///   a_i = sum_j G m_j d / s^(3/2),   j_i = sum_j G m_j (u - 3 (d.u)/s d) / s^(3/2),
/// d = x_j - x_i, u = v_j - v_i, s = d^2 + softening^2. Bodies stand in rows of columns, those with mass
/// first: `sources` of them. All sums are in units of the extent, as those of DirectSum; points closer than
/// there count as a homogeneous sphere, without jerk.
///
/// Cost: one pass over the sources a target, about twice the time of a pair of DirectSum, which serves both
/// of its bodies. A target's sums do not depend on which other targets there are, nor on the number of
/// threads. One object serves one caller at a time.
template <Real S>
class JerkSum {
 public:
  using Column = Eigen::Array<S, Eigen::Dynamic, 1>;
  using Columns = std::array<Column, 3>;  ///< x, y, z

  /// \param G [m^3 kg^-1 s^-2]  \param softening [m]. Counts from the next begin() on.
  void setLaw(const S& G, const S& softening) {
    G_ = G;
    softening_ = softening;
  }

  /// Takes masses and the units of places like these. \param m  of each row, zero from `sources` on
  /// \throws std::invalid_argument for values that are not finite, negative masses or softening
  void begin(const Columns& x, const Column& m, std::size_t sources) {
    units_ = detail::GravityUnits<S>(Places{&x}, Masses{&m}, G_, softening_);
    sources_ = G_ == S(0) ? 0 : sources;
    const S perLength = units_.perLength();
    softening_sq_ = (softening_ * perLength) * (softening_ * perLength);
    m_ = m * units_.perMass();
  }

  /// Sets a [m s^-2] and j [m s^-3] of the given rows, from all sources at x [m] and v [m s^-1].
  void evaluate(std::span<const std::uint32_t> rows, const Columns& x, const Columns& v, Columns& a,
                Columns& j) {
    const auto perAcceleration = units_.acceleration(G_);
    const auto perJerk = units_.jerk(G_);
    forTargets(rows, [&](Eigen::Index i) {
      Sums sum;
      const Target one = target(i, x, v);
      forTiles(x, v, [&](const S* m, const S* const(&p)[6]) { sum.add(one, m, p); });
      for (std::size_t c = 0; c < 3; ++c) {
        a[c][i] = perAcceleration(Tile::sum(sum.a[c]));
        j[c][i] = perJerk(Tile::sum(sum.j[c]));
      }
    });
    pairs_ += rows.size() * sources_;
  }

  /// The square of the rate [s^-2] at which the motion of each row's fastest pair changes: the largest of
  /// G (m_i + m_j)/s^(3/2) + u^2/s. 0 where there is nothing near.
  void rates(std::span<const std::uint32_t> rows, const Columns& x, const Columns& v, Column& rate_sq) {
    const auto perRate = units_.jerk(G_);
    const S perLength_sq = units_.perLength() * units_.perLength();
    forTargets(rows, [&](Eigen::Index i) {
      Fastest fastest;
      const Target one = target(i, x, v);
      const S own = m_[i];
      forTiles(x, v, [&](const S* m, const S* const(&p)[6]) { fastest.add(one, own, m, p); });
      rate_sq[i] = perRate(Tile::largest(fastest.pull)) + Tile::largest(fastest.pass) * perLength_sq;
    });
    pairs_ += rows.size() * sources_;
  }

  /// Pairs of a target and a source that were evaluated since the start.
  std::uint64_t pairs() const { return pairs_; }

 private:
  using Tile = detail::JerkTile<S>;
  using T = typename Tile::Type;
  static constexpr auto width = static_cast<Eigen::Index>(Tile::width);

  struct Places {
    const Columns* x;
    std::size_t size() const { return static_cast<std::size_t>((*x)[0].size()); }
    Vector3<S> operator[](std::size_t i) const {
      const auto at = static_cast<Eigen::Index>(i);
      return {(*x)[0][at], (*x)[1][at], (*x)[2][at]};
    }
  };
  struct Masses {
    const Column* m;
    std::size_t size() const { return static_cast<std::size_t>(m->size()); }
    S operator[](std::size_t i) const { return (*m)[static_cast<Eigen::Index>(i)]; }
  };

  struct Target {
    S x[3], v[3];
    S perLength, softening_sq;
  };

  Target target(Eigen::Index i, const Columns& x, const Columns& v) const {
    return {{x[0][i], x[1][i], x[2][i]}, {v[0][i], v[1][i], v[2][i]}, units_.perLength(), softening_sq_};
  }

  /// What a pair has, in lanes over the sources: differences, their products, and s^(-1/2).
  struct Pair {
    T dx, dy, dz, ux, uy, uz, s, root;

    [[gnu::always_inline]] Pair(const Target& i, const S* const (&p)[6])
        : dx((Tile::load(p[0]) - i.x[0]) * i.perLength),
          dy((Tile::load(p[1]) - i.x[1]) * i.perLength),
          dz((Tile::load(p[2]) - i.x[2]) * i.perLength),
          ux(Tile::load(p[3]) - i.v[0]),
          uy(Tile::load(p[4]) - i.v[1]),
          uz(Tile::load(p[5]) - i.v[2]),
          s(dx * dx + dy * dy + dz * dz + i.softening_sq),
          root(inverseRoot(s)) {}
  };

  struct Sums {
    std::array<T, 3> a, j;

    Sums() {
      for (std::size_t c = 0; c < 3; ++c) {
        a[c] = j[c] = Tile::constant(S(0));
      }
    }

    [[gnu::always_inline]] void add(const Target& i, const S* m, const S* const (&p)[6]) {
      const Pair d(i, p);
      const T perSquare = d.root * d.root;
      const T w = Tile::load(m) * d.root * perSquare;
      const T turn = S(3) * perSquare * (d.dx * d.ux + d.dy * d.uy + d.dz * d.uz);
      const T apart = w * isApart(d.s);
      a[0] += w * d.dx;
      a[1] += w * d.dy;
      a[2] += w * d.dz;
      j[0] += apart * (d.ux - turn * d.dx);
      j[1] += apart * (d.uy - turn * d.dy);
      j[2] += apart * (d.uz - turn * d.dz);
    }
  };

  struct Fastest {
    T pull = Tile::constant(S(0));
    T pass = Tile::constant(S(0));

    [[gnu::always_inline]] void add(const Target& i, const S& own, const S* m, const S* const (&p)[6]) {
      const Pair d(i, p);
      const T perSquare = d.root * d.root;
      // A body is no pair with itself, and two in one place pull at each other with no force.
      const T apart = isApart(T(d.dx * d.dx + d.dy * d.dy + d.dz * d.dz));
      pull = greater(pull, T((Tile::load(m) + own) * d.root * perSquare * apart));
      pass = greater(pass, T((d.ux * d.ux + d.uy * d.uy + d.uz * d.uz) * perSquare * apart));
    }
  };

  static S inverseRoot(const S& s) {
    using std::sqrt;
    return S(1) / S(sqrt(s < PairLaw<S>::tiny() ? PairLaw<S>::tiny() : s));
  }
  /// 0 for what counts as one point, otherwise 1.
  static S isApart(const S& s) { return s < PairLaw<S>::tiny() ? S(0) : S(1); }
  static S greater(const S& a, const S& b) { return a < b ? b : a; }

  template <int W>
  static Lanes<S, W> inverseRoot(const Lanes<S, W>& s) {
    return s.max(PairLaw<S>::tiny()).rsqrt();
  }
  template <int W>
  static Lanes<S, W> isApart(const Lanes<S, W>& s) {
    return (s * S(S(1) / PairLaw<S>::tiny())).min(S(1));
  }
  template <int W>
  static Lanes<S, W> greater(const Lanes<S, W>& a, const Lanes<S, W>& b) {
    return a.max(b);
  }

  /// Calls f(masses, columns) for each tile of sources; the last one is filled up with massless copies.
  template <class F>
  [[gnu::flatten]] void forTiles(const Columns& x, const Columns& v, F&& f) const {
    const auto end = static_cast<Eigen::Index>(sources_);
    const S* column[6] = {x[0].data(), x[1].data(), x[2].data(), v[0].data(), v[1].data(), v[2].data()};
    Eigen::Index k = 0;
    for (; k + width <= end; k += width) {
      const S* p[6] = {column[0] + k, column[1] + k, column[2] + k,
                       column[3] + k, column[4] + k, column[5] + k};
      f(m_.data() + k, p);
    }
    if (k < end) {
      S rest[7][Tile::width];
      for (Eigen::Index lane = 0; lane < width; ++lane) {
        const Eigen::Index from = std::min<Eigen::Index>(k + lane, end - 1);
        for (std::size_t c = 0; c < 6; ++c) {
          rest[c][lane] = column[c][from];
        }
        rest[6][lane] = k + lane < end ? m_[from] : S(0);
      }
      const S* p[6] = {rest[0], rest[1], rest[2], rest[3], rest[4], rest[5]};
      f(static_cast<const S*>(rest[6]), p);
    }
  }

  template <class F>
  void forTargets(std::span<const std::uint32_t> rows, F&& f) const {
    constexpr std::size_t pairsWorthThreads = 50000;
    const std::size_t chunk = 1 + 8192 / (sources_ + 1);
    const auto some = [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        f(static_cast<Eigen::Index>(rows[k]));
      }
    };
    if (rows.size() * sources_ < pairsWorthThreads) {
      some(0, rows.size());
    } else {
      parallelForChunks(rows.size(), chunk, some);
    }
  }

  S G_ = S(0), softening_ = S(0);
  detail::GravityUnits<S> units_;
  std::size_t sources_ = 0;
  S softening_sq_ = S(0);
  Column m_;
  std::uint64_t pairs_ = 0;
};

}  // namespace gravel
