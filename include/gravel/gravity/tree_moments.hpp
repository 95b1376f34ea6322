#pragma once

/// \file
/// The upward pass of the fast multipole method: what each cell is as a source and as a sink.

#include <gravel/gravity/body_tree.hpp>
#include <gravel/gravity/expansion_lanes.hpp>

namespace gravel::detail {

/// Moments sum m Q(centre - x) of every cell, one after another, `terms` each; and the cells' geometry.
template <Real S, Real F, class Terms>
class TreeMoments {
 public:
  using X = Expansion<Terms>;
  using Tree = BodyTree<S, F>;

  /// Fills in `tree` the centre, mass, radius and spread of each cell, then the moments up to `order`.
  void compute(Tree& tree, int order) {
    order_ = order;
    terms_ = static_cast<std::size_t>(X::M::size(order));
    moments_.resize(tree.cells.size() * terms_);
    for (std::size_t level = tree.levels.size() - 1; level-- > 0;) {
      const std::size_t begin = tree.levels[level];
      parallelForChunks(tree.levels[level + 1] - begin, 64, [&](std::size_t from, std::size_t to) {
        Scratch scratch(terms_);
        for (std::size_t c = begin + from; c < begin + to; ++c) {
          TreeCell<F>& cell = tree.cells[c];
          if (cell.isLeaf() || cell.count() <= bodiesWorthMeasuring) {
            measure(tree, cell);
          } else {
            estimate(tree, cell);
          }
          if (tree.cells[c].isLeaf() || tree.cells[c].count() <= bodiesWorthShifting) {
            addBodies(tree, c, scratch);
          } else {
            addChildren(tree, c, scratch);
          }
        }
      });
    }
  }

  const F* of(std::size_t cell) const { return &moments_[cell * terms_]; }
  std::size_t terms() const { return terms_; }

 private:
  using Batch = FarBatch<F>;
  using V = typename Batch::V;

  /// Cells of more bodies take the moments of their children.
  static constexpr std::uint32_t bodiesWorthShifting = 64;

  /// Cells of more take bounds of their size from their children.
  static constexpr std::uint32_t bodiesWorthMeasuring = 512;

  struct Scratch {
    std::vector<V> regular, moments, sums;
    explicit Scratch(std::size_t terms) : regular(terms), moments(terms), sums(terms) {}
  };

  void measure(const Tree& tree, TreeCell<F>& cell) const {
    F mass(0);
    F low[3] = {F(0), F(0), F(0)};
    F all[3] = {F(0), F(0), F(0)};
    const std::vector<S>* columns[3] = {&tree.x, &tree.y, &tree.z};
    for (std::uint32_t i = cell.first; i < cell.last; ++i) {
      mass += F(tree.m[i]);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<S>& x = *columns[axis];
      low[axis] = F(x[cell.first]);
      for (std::uint32_t i = cell.first; i < cell.last; ++i) {
        const F d = F(x[i]) - low[axis];
        all[axis] += mass > F(0) ? F(F(tree.m[i]) * d) : d;
      }
      cell.centre[axis] = low[axis] + all[axis] / (mass > F(0) ? mass : F(static_cast<double>(cell.count())));
    }
    cell.mass = mass;
    F radius_sq(0);
    F spread(0);
    for (std::uint32_t i = cell.first; i < cell.last; ++i) {
      const F dx = F(tree.x[i]) - cell.centre[0];
      const F dy = F(tree.y[i]) - cell.centre[1];
      const F dz = F(tree.z[i]) - cell.centre[2];
      const F d = dx * dx + dy * dy + dz * dz;
      radius_sq = radius_sq < d ? d : radius_sq;
      F power = d * d;
      for (int k = 4; k < spreadPower(); k *= 2) {
        power *= power;
      }
      spread += F(tree.m[i]) * power;
    }
    using std::sqrt;
    finishSizes(cell, F(sqrt(radius_sq)), spread);
  }

  /// Radius and spread as sums of the children's and of their distances (Minkowski's inequality).
  void estimate(const Tree& tree, TreeCell<F>& cell) const {
    using std::sqrt;
    cell.mass = F(0);
    Vector3<F> all = Vector3<F>::Zero();
    const Vector3<F> low = tree.cells[cell.child].centre;
    F bodies(0);
    for (std::uint32_t child = cell.child; child < cell.child + cell.children; ++child) {
      const TreeCell<F>& part = tree.cells[child];
      cell.mass += part.mass;
    }
    for (std::uint32_t child = cell.child; child < cell.child + cell.children; ++child) {
      const TreeCell<F>& part = tree.cells[child];
      const F share = cell.mass > F(0) ? part.mass : F(static_cast<double>(part.count()));
      all += share * (part.centre - low);
      bodies += share;
    }
    cell.centre = low + all / bodies;
    F radius(0);
    F spread(0);
    for (std::uint32_t child = cell.child; child < cell.child + cell.children; ++child) {
      const TreeCell<F>& part = tree.cells[child];
      const F distance = (part.centre - cell.centre).norm();
      const F reach = distance + F(part.radius);
      radius = radius < reach ? reach : radius;
      F power = distance + F(part.spread);
      for (int k = 1; k < spreadPower(); k *= 2) {
        power *= power;
      }
      spread += part.mass * power;
    }
    finishSizes(cell, radius, spread);
  }

  /// \param spread sum of m s^q
  void finishSizes(TreeCell<F>& cell, const F& radius, F spread) const {
    using std::sqrt;
    cell.radius = TreeCell<F>::sizeOf(radius);
    spread = cell.mass > F(0) ? F(spread / cell.mass) : F(0);
    for (int k = 1; k < spreadPower(); k *= 2) {
      spread = sqrt(spread);
    }
    cell.spread = TreeCell<F>::sizeOf(spread);
  }

  /// The power of two at or above the order (4 to 16).
  int spreadPower() const { return order_ <= 4 ? 4 : order_ <= 8 ? 8 : 16; }

  void addBodies(const Tree& tree, std::size_t c, Scratch& scratch) {
    const TreeCell<F>& cell = tree.cells[c];
    std::fill(scratch.sums.begin(), scratch.sums.end(), Batch::zero());
    for (std::uint32_t i = cell.first; i < cell.last; i += Batch::width) {
      alignas(64) F r[4][Batch::width] = {};
      const std::size_t count = std::min<std::size_t>(Batch::width, cell.last - i);
      for (std::size_t w = 0; w < count; ++w) {
        r[0][w] = cell.centre[0] - F(tree.x[i + w]);
        r[1][w] = cell.centre[1] - F(tree.y[i + w]);
        r[2][w] = cell.centre[2] - F(tree.z[i + w]);
        r[3][w] = F(tree.m[i + w]);
      }
      FarOperators<Terms, V>::regular(order_, Batch::load(r[0]), Batch::load(r[1]), Batch::load(r[2]),
                                      scratch.regular.data());
      const V m = Batch::load(r[3]);
      for (std::size_t k = 0; k < terms_; ++k) {
        scratch.sums[k] += m * scratch.regular[k];
      }
    }
    reduce(c, scratch);
  }

  void addChildren(const Tree& tree, std::size_t c, Scratch& scratch) {
    const TreeCell<F>& cell = tree.cells[c];
    std::fill(scratch.sums.begin(), scratch.sums.end(), Batch::zero());
    for (std::uint32_t child = 0; child < cell.children; child += Batch::width) {
      alignas(64) F r[3][Batch::width] = {};
      const std::size_t count = std::min<std::size_t>(Batch::width, cell.children - child);
      auto* lanes = reinterpret_cast<F*>(scratch.moments.data());
      for (std::size_t w = 0; w < Batch::width; ++w) {
        if (w < count) {
          const TreeCell<F>& part = tree.cells[cell.child + child + w];
          for (int axis = 0; axis < 3; ++axis) {
            r[axis][w] = cell.centre[axis] - part.centre[axis];
          }
        }
        for (std::size_t k = 0; k < terms_; ++k) {
          lanes[k * Batch::width + w] = w < count ? of(cell.child + child + w)[k] : F(0);
        }
      }
      FarOperators<Terms, V>::regular(order_, Batch::load(r[0]), Batch::load(r[1]), Batch::load(r[2]),
                                      scratch.regular.data());
      X::shiftMoments(order_, scratch.regular.data(), scratch.moments.data(), scratch.sums.data());
    }
    reduce(c, scratch);
  }

  void reduce(std::size_t c, const Scratch& scratch) {
    const auto* lanes = reinterpret_cast<const F*>(scratch.sums.data());
    for (std::size_t k = 0; k < terms_; ++k) {
      F sum(0);
      for (std::size_t w = 0; w < Batch::width; ++w) {
        sum += lanes[k * Batch::width + w];
      }
      moments_[c * terms_ + k] = sum;
    }
  }

  int order_ = 0;
  std::size_t terms_ = 0;
  std::vector<F> moments_;
};

}  // namespace gravel::detail
