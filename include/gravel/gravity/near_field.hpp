#pragma once

/// \file
/// Pairs of bodies one by one, for sinks and sources that are ranges of a tree's rows.

#include <gravel/gravity/body_tree.hpp>
#include <gravel/gravity/pair_tiles.hpp>

namespace gravel::detail {

/// What bodies get, G = 1, in the order of the tree.
template <Real S>
struct SinkFields {
  std::vector<S> ax, ay, az;
  std::vector<S> potential;  ///< sum of m p, empty if not wanted

  void clear(std::size_t n, bool withPotential) {
    for (std::vector<S>* column : {&ax, &ay, &az}) {
      column->assign(n, S(0));
    }
    potential.assign(withPotential ? n : 0, S(0));
  }
};

/// Gathers sources side by side, then adds what they do to sinks, lanes over sources, four sinks at a time.
/// Each direction of a pair is summed by itself, with opposite numbers, so action is reaction to rounding.
template <Real S>
class NearField {
 public:
  void clear() { count_ = 0; }

  template <class Tree>
  void addSources(const Tree& tree, std::uint32_t first, std::uint32_t last) {
    append(tree, first, last, [](std::size_t, const T& tile) { return tile; });
  }

  /// An image of them.
  template <class Tree>
  void addSources(const Tree& tree, std::uint32_t first, std::uint32_t last, const Vector3<S>& shift) {
    append(tree, first, last, [&](std::size_t column, const T& tile) {
      return column < 3 ? T(tile + shift[static_cast<Eigen::Index>(column)]) : tile;
    });
  }

  template <class Tree>
  void apply(const Tree& tree, std::uint32_t first, std::uint32_t last, const S& softening_sq,
             SinkFields<S>& out) {
    if (count_ == 0) {
      return;
    }
    padSources();
    const bool withPotential = !out.potential.empty();
    for (std::uint32_t i = first; i < last; i += 4) {
      if (!tree.hasSinks(i, std::min(last, i + 4))) {
        continue;
      }
      const std::uint32_t sinks = std::min<std::uint32_t>(4, last - i);
      if (withPotential) {
        choose<true>(sinks, tree, i, softening_sq, out);
      } else {
        choose<false>(sinks, tree, i, softening_sq, out);
      }
    }
  }

  std::size_t size() const { return count_; }

  /// The pairs within a range. With potentials they are taken one by one: a softened body has a potential at
  /// its own place, which is no energy of a pair.
  template <class Tree>
  void addWithin(const Tree& tree, std::uint32_t first, std::uint32_t last, const S& softening_sq,
                 SinkFields<S>& out) {
    if (out.potential.empty()) {
      addSources(tree, first, last);
      return;
    }
    for (std::uint32_t i = first; i < last; ++i) {
      for (std::uint32_t j = first; j < last; ++j) {
        const S dx = tree.x[j] - tree.x[i];
        const S dy = tree.y[j] - tree.y[i];
        const S dz = tree.z[j] - tree.z[i];
        const S s = dx * dx + dy * dy + dz * dz + softening_sq;
        if (j != i && tree.m[j] > S(0)) {
          const S f = tree.m[j] * PairLaw<S>::accelerationFactor(s);
          out.ax[i] += f * dx;
          out.ay[i] += f * dy;
          out.az[i] += f * dz;
          out.potential[i] += tree.m[j] * PairLaw<S>::potentialFactor(s);
        }
      }
    }
  }

 private:
  using Tile = GravityTile<S>;
  using T = typename Tile::Type;
  static constexpr auto width = static_cast<std::size_t>(Tile::width);

  template <class Tree, class Move>
  void append(const Tree& tree, std::uint32_t first, std::uint32_t last, Move&& move) {
    const std::uint32_t begin = tree.sourcesBefore(first);
    const std::size_t n = tree.sourcesBefore(last) - begin;
    reserve(count_ + n + width);
    const auto from = tree.sources();
    for (std::size_t column = 0; column < 4; ++column) {
      const S* source = from[column]->data() + begin;
      S* to = columns_[column].data() + count_;
      for (std::size_t i = 0; i < n; i += width) {  // whole tiles: the tree's columns go on behind their end
        Tile::store(to + i, move(column, Tile::load(source + i)));
      }
    }
    count_ += n;
  }

  void reserve(std::size_t n) {
    const std::size_t rows = (n + width - 1) / width * width;
    if (columns_[0].size() < rows) {
      for (std::vector<S>& column : columns_) {
        column.resize(2 * rows);
      }
    }
  }

  /// Massless copies of the last source up to a whole tile.
  void padSources() {
    for (std::size_t row = count_; row % width != 0; ++row) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        columns_[axis][row] = columns_[axis][count_ - 1];
      }
      columns_[3][row] = S(0);
    }
  }

  template <bool Potential, class Tree>
  void choose(std::uint32_t sinks, const Tree& tree, std::uint32_t i, const S& softening_sq,
              SinkFields<S>& out) {
    switch (sinks) {
      case 1:
        add<1, Potential>(tree, i, softening_sq, out);
        break;
      case 2:
        add<2, Potential>(tree, i, softening_sq, out);
        break;
      case 3:
        add<3, Potential>(tree, i, softening_sq, out);
        break;
      default:
        add<4, Potential>(tree, i, softening_sq, out);
        break;
    }
  }

  template <std::size_t N, bool Potential, class Tree>
  [[gnu::flatten]] void add(const Tree& tree, std::uint32_t i, const S& softening_sq, SinkFields<S>& out) {
    T x[N], y[N], z[N], ax[N], ay[N], az[N], p[N];
    for (std::size_t k = 0; k < N; ++k) {
      x[k] = Tile::constant(tree.x[i + k]);
      y[k] = Tile::constant(tree.y[i + k]);
      z[k] = Tile::constant(tree.z[i + k]);
      ax[k] = ay[k] = az[k] = p[k] = Tile::constant(S(0));
    }
    for (std::size_t j = 0; j < count_; j += width) {
      const T xj = Tile::load(&columns_[0][j]);
      const T yj = Tile::load(&columns_[1][j]);
      const T zj = Tile::load(&columns_[2][j]);
      const T mj = Tile::load(&columns_[3][j]);
      for (std::size_t k = 0; k < N; ++k) {
        const T dx = xj - x[k];
        const T dy = yj - y[k];
        const T dz = zj - z[k];
        const T s = dx * dx + dy * dy + dz * dz + softening_sq;
        const T f = mj * PairLaw<S>::accelerationFactor(s);
        ax[k] += f * dx;
        ay[k] += f * dy;
        az[k] += f * dz;
        if constexpr (Potential) {
          p[k] += mj * PairLaw<S>::potentialFactor(s);
        }
      }
    }
    for (std::size_t k = 0; k < N; ++k) {
      out.ax[i + k] += Tile::sum(ax[k]);
      out.ay[i + k] += Tile::sum(ay[k]);
      out.az[i + k] += Tile::sum(az[k]);
      if constexpr (Potential) {
        out.potential[i + k] += Tile::sum(p[k]);
      }
    }
  }

  std::array<std::vector<S>, 4> columns_;
  std::size_t count_ = 0;
};

}  // namespace gravel::detail
