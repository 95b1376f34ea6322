#pragma once

/// \file
/// A first look at the field: how strong it is where the bodies of each cell are, within a few ten per cent.

#include <gravel/gravity/body_tree.hpp>
#include <gravel/gravity/image_field.hpp>
#include <gravel/gravity/rim_strength.hpp>

namespace gravel::detail {

/// Sets each cell's weight to share / sqrt(mean of 1/a^2) over its bodies, a the acceleration (G = 1) that
/// groups of at most 64 bodies, of large systems 256, feel at their centre from other cells, and images of
/// cells, as points. An error of that size at all of them has a relative rms of `share`. Accelerations below
/// a thousandth of the mean count as that much; in a periodic system, where they may cancel everywhere, the
/// mean counts as at least a tenth of the pull of one body at the mean distance. All pulls are softened: a
/// knot within the softening length would else count with what it pulled unsoftened, and lift the mean.
///
/// Then lowered for the sake of bodies at a rim in groups whose masses are uneven, so that none errs by more
/// than 1.3 share of its own acceleration, or of a tenth of the mean: see RimStrength.
///
/// Needs the geometry of TreeMoments. About 100 pairs of cells a group.
template <Real S, Real F>
class FieldStrength {
 public:
  /// \param order of the expansions
  /// \param field of the far images, which have been gathered unless `images` is open
  void compute(BodyTree<S, F>& tree, const F& share, int order, const F& softening_sq,
               const PeriodicImages<S, F>& images, const ImageField<S, F>& field) {
    softening_sq_ = softening_sq;
    const std::size_t n = tree.cells.size();
    groupSize_ = static_cast<std::uint32_t>(std::clamp<std::size_t>(tree.size() / 256, 64, 256));
    groups_.clear();
    isBelow_.assign(n, 0);
    for (std::uint32_t c = 0; c < n; ++c) {
      const TreeCell<F>& cell = tree.cells[c];
      const bool isGroup = isBelow_[c] == 0 && (cell.isLeaf() || cell.count() <= groupSize_);
      if (isGroup) {
        groups_.push_back(c);
      }
      for (std::uint32_t child = cell.child; child < cell.child + cell.children; ++child) {
        isBelow_[child] = isGroup || isBelow_[c] != 0 ? 1 : 0;
      }
    }
    strength_.resize(groups_.size());
    isUneven_.resize(groups_.size());
    parallelFor(groups_.size(), 64,
                [&](std::size_t g) { isUneven_[g] = Rims::isUneven(tree, tree.cells[groups_[g]]) ? 1 : 0; });
    const bool hasRims = std::find(isUneven_.begin(), isUneven_.end(), 1) != isUneven_.end();
    if (hasRims) {
      rims_.begin(tree, order, softening_sq);
    }
    parallelForChunks(groups_.size(), 64, [&](std::size_t begin, std::size_t end) {
      std::vector<ImageCell> todo;
      GroupField<F> around;
      for (std::size_t g = begin; g < end; ++g) {
        const TreeCell<F>& group = tree.cells[groups_[g]];
        Vector3<F> a = Vector3<F>::Zero();
        around.clear();
        for (std::uint32_t image = 0; image < images.shifts().size(); ++image) {
          const Vector3<S>& shift = images.shifts()[image];
          addField(tree, group, Vector3<F>(F(shift[0]), F(shift[1]), F(shift[2])), image, todo, a,
                   isUneven_[g] != 0 ? &around : nullptr);
        }
        if (!images.isOpen()) {
          const Vector3<F> far = field.at(images, group.centre);
          around.far += far;
          a += far;
        }
        strength_[g] = F(a.norm());
        if (isUneven_[g] != 0) {
          rims_.look(tree, groups_[g], around, images.shifts(), todo);
        }
      }
    });
    F mean(0);
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      mean += F(static_cast<double>(tree.cells[groups_[g]].count())) * strength_[g];
    }
    mean = mean / F(static_cast<double>(tree.size()));
    if (!images.isOpen()) {
      mean = std::max<F>(mean, F(0.1) * pullAtMeanDistance(tree));
    }
    shareOut(tree, share, F(mean * F(1e-3)));
    if (hasRims) {
      rims_.spare(tree, F(F(1.3) * share), F(F(0.1) * mean));
    }
  }

 private:
  /// Of a body of mean mass, bodies taken to fill the sphere around the root.
  F pullAtMeanDistance(const BodyTree<S, F>& tree) const {
    using std::sqrt;
    const TreeCell<F>& root = tree.cells[0];
    const F distance_per_r = F(std::cbrt(1 / static_cast<double>(tree.size())));
    const F r = F(root.radius);
    const F d = r * distance_per_r;
    const F softer = d > F(0) ? F(d * d / (d * d + softening_sq_)) : F(0);
    return r > F(0) ? F(root.mass / (r * r) * distance_per_r * softer * sqrt(softer)) : F(0);
  }

  using Rims = RimStrength<S, F>;

  /// Adds to `sum` what an image of all cells does to a group, and to `around`, if any, what rims need.
  void addField(const BodyTree<S, F>& tree, const TreeCell<F>& group, const Vector3<F>& shift,
                std::uint32_t image, std::vector<ImageCell>& todo, Vector3<F>& sum,
                GroupField<F>* around) const {
    using std::sqrt;
    const F near = F(group.radius) * F(group.radius);
    todo.assign(1, {0, image});
    while (!todo.empty()) {
      const ImageCell from = todo.back();
      const TreeCell<F>& source = tree.cells[from.cell];
      todo.pop_back();
      const Vector3<F> d = (source.centre - group.centre) + shift;
      const F r_sq = d.squaredNorm();
      const F own = F(source.radius) * F(source.radius);
      const bool isFar = r_sq > F(1.5) * own;
      if (!isFar && !source.isLeaf() && source.count() > groupSize_) {
        for (std::uint32_t child = source.child; child < source.child + source.children; ++child) {
          todo.push_back({child, image});
        }
        continue;
      }
      const F s = r_sq + softening_sq_ + (isFar && r_sq > near ? F(0) : F(own + near));
      const F w = s > F(0) ? F(source.mass / (s * sqrt(s))) : F(0);
      sum += w * d;
      if (around != nullptr && isFar && r_sq > F(4) * near) {
        around->addFar(d, w, F(w / s));
      } else if (around != nullptr) {
        around->near.push_back(from);
      }
    }
  }

  void shareOut(BodyTree<S, F>& tree, const F& share, const F& least) {
    using std::sqrt;
    // First the sum of 1/a^2 over the bodies of each cell, in place of the weight.
    for (TreeCell<F>& cell : tree.cells) {
      cell.weight = F(0);
    }
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const F a = strength_[g] < least ? least : strength_[g];
      TreeCell<F>& cell = tree.cells[groups_[g]];
      cell.weight = a > F(0) ? F(F(static_cast<double>(cell.count())) / (a * a)) : F(0);
    }
    for (std::size_t c = tree.cells.size(); c-- > 0;) {
      TreeCell<F>& cell = tree.cells[c];
      if (isBelow_[c] == 0 && !(cell.isLeaf() || cell.count() <= groupSize_)) {
        for (std::uint32_t child = cell.child; child < cell.child + cell.children; ++child) {
          cell.weight += tree.cells[child].weight;
        }
      }
    }
    for (TreeCell<F>& cell : tree.cells) {
      if (cell.weight > F(0)) {
        cell.weight = F(share / sqrt(F(cell.weight / F(static_cast<double>(cell.count())))));
      }
    }
    for (std::size_t c = 0; c < tree.cells.size(); ++c) {
      const TreeCell<F>& cell = tree.cells[c];
      for (std::uint32_t child = cell.child; child < cell.child + cell.children; ++child) {
        if (isBelow_[child] != 0) {
          tree.cells[child].weight = cell.weight;
        }
      }
    }
  }

  std::uint32_t groupSize_ = 64;
  F softening_sq_ = F(0);
  std::vector<std::uint32_t> groups_;
  std::vector<std::uint8_t> isBelow_;
  std::vector<std::uint8_t> isUneven_;  ///< of each group
  std::vector<F> strength_;             ///< of each group
  Rims rims_;
};

/// A lower bound (G = 1) of the mean potential of a body by mass: what two children of a cell have of each
/// other they have at distances of at most its diameter, and so have the bodies of a leaf.
template <class S, class F>
F leastMeanPotential(const BodyTree<S, F>& tree, const F& softening_sq) {
  using std::sqrt;
  F sum(0);
  for (const TreeCell<F>& cell : tree.cells) {
    F squares(0);
    for (std::uint32_t row = cell.first; cell.isLeaf() && row < cell.last; ++row) {
      squares += F(tree.m[row]) * F(tree.m[row]);
    }
    for (std::uint32_t child = cell.child; child < cell.child + cell.children; ++child) {
      squares += tree.cells[child].mass * tree.cells[child].mass;
    }
    const F widest = F(sqrt(F(F(4) * F(cell.radius) * F(cell.radius) + softening_sq)));
    if (widest > F(0)) {
      sum += (cell.mass * cell.mass - squares) / widest;
    }
  }
  return tree.cells[0].mass > F(0) ? F(sum / tree.cells[0].mass) : F(0);
}

}  // namespace gravel::detail
