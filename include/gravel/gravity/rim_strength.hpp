#pragma once

/// \file
/// How strong the field is at bodies that expansions serve worst: those far out in their cells.

#include <gravel/gravity/body_tree.hpp>

namespace gravel::detail {

/// The field (G = 1) around a group of bodies: of what is far, and the cells that are near.
template <Real F>
struct GroupField {
  Vector3<F> far = Vector3<F>::Zero();                           ///< at the centre
  Eigen::Matrix<F, 3, 3> tide = Eigen::Matrix<F, 3, 3>::Zero();  ///< derivatives of that
  std::vector<ImageCell> near;                                   ///< the group itself among them

  void clear() {
    far.setZero();
    tide.setZero();
    near.clear();
  }

  /// \param d from the centre to a mass m. \param w m / s^(3/2), s = r^2 + eps^2. \param v m / s^(5/2)
  void addFar(const Vector3<F>& d, const F& w, const F& v) {
    far += w * d;
    tide += d * (F(F(3) * v) * d).transpose();
    tide.diagonal().array() -= w;
  }
};

/// Finds the bodies that expansions would serve worst, and lowers what is allowed to their cells.
///
/// A body's error from a pair of cells is ((d + s) / (R + s))^order of that at the rim: d its distance from
/// the centre of its cell, R the cell's radius, s the source's, for which R/2 is taken. Where few bodies have
/// most of the mass the field differs much from body to body, and a body at the rim may feel a tenth of what
/// others of its group do, and more error than they, from a source of one heavy body that no others average
/// out. So the acceleration of bodies at rims, where that factor is above 1/1.5, is found one by one, for
/// groups of n bodies with (sum m)^2 / sum m^2 < n/4 and their rims in cells of at most 256 bodies: an eighth
/// to a third of them. Each costs some 30 cells and 50 bodies. Systems of even masses pay next to nothing and
/// their numbers stay.
template <Real S, Real F>
class RimStrength {
 public:
  /// Whether few of the bodies have most of the mass.
  static bool isUneven(const BodyTree<S, F>& tree, const TreeCell<F>& group) {
    F squares(0);
    for (std::uint32_t row = group.first; row < group.last; ++row) {
      squares += F(tree.m[row]) * F(tree.m[row]);
    }
    return squares * F(static_cast<double>(group.count())) > F(4) * group.mass * group.mass;
  }

  /// \param order of the expansions
  void begin(const BodyTree<S, F>& tree, int order, const F& softening_sq) {
    order_ = order;
    softening_sq_ = softening_sq;
    rim_ = F(1.5 * std::pow(1.5, -1.0 / order) - 0.5);
    strength_.assign(tree.size(), F(-1));
  }

  /// Finds the acceleration of a group's bodies at rims, within a few ten per cent. Groups may be looked at
  /// by different threads.
  void look(const BodyTree<S, F>& tree, std::uint32_t group, const GroupField<F>& field,
            const std::vector<Vector3<S>>& shifts, std::vector<ImageCell>& todo) {
    std::vector<std::uint32_t> cells(1, group);
    while (!cells.empty()) {
      const std::uint32_t c = cells.back();
      const TreeCell<F>& cell = tree.cells[c];
      cells.pop_back();
      for (std::uint32_t child = 0; child < cell.children; ++child) {
        cells.push_back(cell.child + child);
      }
      for (std::uint32_t row = cell.first; cell.isLeaf() && row < cell.last; ++row) {
        if (isAtRim(tree, c, at(tree, row))) {
          strength_[row] = strengthAt(tree, at(tree, row), tree.cells[group].centre, field, shifts, todo);
        }
      }
    }
  }

  /// Lowers the weight of cells to what lets each of those bodies have an error of `share` of its
  /// acceleration, or of `least` where that is more.
  void spare(BodyTree<S, F>& tree, const F& share, const F& least) const {
    parallelFor(tree.cells.size(), 256, [&](std::size_t c) {
      TreeCell<F>& cell = tree.cells[c];
      const F radius = F(cell.radius);
      for (std::uint32_t row = cell.first; cell.count() <= mostBodies && row < cell.last; ++row) {
        F allowed = share * (strength_[row] < least ? least : strength_[row]);
        if (strength_[row] < F(0) || !(allowed < cell.weight)) {
          continue;
        }
        const F d = F((at(tree, row) - cell.centre).norm());
        if (d > F(0) && d >= rim_ * radius) {
          const F ratio = F(1.5) * radius / (d + F(0.5) * radius);
          for (int k = 0; k < order_; ++k) {
            allowed *= ratio;
          }
          cell.weight = allowed < cell.weight ? allowed : cell.weight;
        }
      }
    });
  }

  /// The acceleration found for a row; below 0 if none was.
  const F& strength(std::size_t row) const { return strength_[row]; }

 private:
  static constexpr std::uint32_t mostBodies = 256;  ///< of a cell with a rim
  static constexpr std::uint32_t width = 8;
  using Lanes = Eigen::Array<F, static_cast<int>(width), 1>;

  static Vector3<F> at(const BodyTree<S, F>& tree, std::uint32_t row) {
    return Vector3<F>(F(tree.x[row]), F(tree.y[row]), F(tree.z[row]));
  }

  /// Whether a place in a leaf is at its rim, or at that of a cell around it.
  bool isAtRim(const BodyTree<S, F>& tree, std::uint32_t c, const Vector3<F>& x) const {
    for (; tree.cells[c].count() <= mostBodies; c = tree.parents[c]) {
      const F from = rim_ * F(tree.cells[c].radius);
      if (from > F(0) && (x - tree.cells[c].centre).squaredNorm() >= from * from) {
        return true;
      }
      if (c == 0) {
        break;
      }
    }
    return false;
  }

  F strengthAt(const BodyTree<S, F>& tree, const Vector3<F>& x, const Vector3<F>& centre,
               const GroupField<F>& field, const std::vector<Vector3<S>>& shifts,
               std::vector<ImageCell>& todo) const {
    using std::sqrt;
    Vector3<F> sum = field.far + field.tide * (x - centre);
    Lanes lanes[3] = {Lanes::Zero(), Lanes::Zero(), Lanes::Zero()};
    todo = field.near;
    while (!todo.empty()) {
      const ImageCell from = todo.back();
      const TreeCell<F>& source = tree.cells[from.cell];
      todo.pop_back();
      const Vector3<S>& shift = shifts[from.image];
      const Vector3<F> place = x - Vector3<F>(F(shift[0]), F(shift[1]), F(shift[2]));
      const Vector3<F> d = source.centre - place;
      const F r_sq = d.squaredNorm();
      if (r_sq > F(source.radius) * F(source.radius)) {
        const F s = r_sq + softening_sq_;
        sum += F(source.mass / (s * sqrt(s))) * d;
      } else if (source.isLeaf()) {
        addBodies(tree, source, place, lanes);
      } else {
        for (std::uint32_t child = source.child; child < source.child + source.children; ++child) {
          todo.push_back({child, from.image});
        }
      }
    }
    return F((sum + Vector3<F>(lanes[0].sum(), lanes[1].sum(), lanes[2].sum())).norm());
  }

  void addBodies(const BodyTree<S, F>& tree, const TreeCell<F>& leaf, const Vector3<F>& x,
                 Lanes (&sum)[3]) const {
    using Row = Eigen::Map<const Eigen::Array<S, static_cast<int>(width), 1>>;
    const F least = softening_sq_ + F(1e-60);  // the body is at no distance from itself
    for (std::uint32_t i = leaf.first; i < leaf.last; i += width) {
      const Lanes dx = Row(&tree.x[i]).template cast<F>() - x[0];
      const Lanes dy = Row(&tree.y[i]).template cast<F>() - x[1];
      const Lanes dz = Row(&tree.z[i]).template cast<F>() - x[2];
      Lanes w = Row(&tree.m[i]).template cast<F>();
      for (std::uint32_t k = leaf.last - i; k < width; ++k) {
        w[k] = F(0);
      }
      const Lanes s = dx * dx + dy * dy + dz * dz + least;
      w /= s * s.sqrt();
      sum[0] += w * dx;
      sum[1] += w * dy;
      sum[2] += w * dz;
    }
  }

  int order_ = 0;
  F rim_ = F(0);
  F softening_sq_ = F(0);
  std::vector<F> strength_;  ///< of each row; below 0 where it was not looked at
};

}  // namespace gravel::detail
