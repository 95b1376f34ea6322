#pragma once

/// \file
/// Uniform grid of cells: the fastest search unless bodies crowd in a small part of their bounding box.

#include <gravel/spatial/queries.hpp>

namespace gravel {

/// Points sorted into the cells of their bounding box, row after row.
template <std::floating_point S>
class UniformGrid {
 public:
  /// Copies the points. Cells are cubes of edge `cell` [m], or larger so that there are at most 8 cells a
  /// point (which is what bounds memory where points lie far apart).
  template <class Positions>
  void build(const Positions& positions, S cell) {
    detail::require("edge of a cell", cell, detail::positive<S>());
    const std::size_t n = positions.size();
    entries_.resize(n);
    start_.clear();
    if (n == 0) {
      return;
    }
    Vector3<S> high = positions[0];
    low_ = high;
    for (std::size_t i = 1; i < n; ++i) {
      low_ = low_.cwiseMin(positions[i]);
      high = high.cwiseMax(positions[i]);
    }
    Vector3<S> extent = high - low_;
    if (!isFinite(extent)) {  // beyond the scalar's range: one cell
      extent.setZero();
    }
    cell_ = cell;
    const auto cells = [&] {
      S product(1);
      for (int axis = 0; axis < 3; ++axis) {
        product *= std::floor(extent[axis] / cell_) + S(1);
      }
      return product;
    };
    while (cells() > S(8) * static_cast<S>(n) + S(64)) {
      cell_ *= S(1.25);
    }
    for (int axis = 0; axis < 3; ++axis) {
      count_[axis] = static_cast<std::size_t>(extent[axis] / cell_) + 1;
    }
    start_.assign(count_[0] * count_[1] * count_[2] + 1, 0);
    cellOf_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Vector3<S> x = positions[i];
      cellOf_[i] = (coordinate(x[2], 2) * count_[1] + coordinate(x[1], 1)) * count_[0] + coordinate(x[0], 0);
      ++start_[cellOf_[i]];
    }
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    for (std::size_t i = n; i-- > 0;) {  // backwards, so that each start_ ends where its cell begins
      entries_[--start_[cellOf_[i]]] = {positions[i], static_cast<std::uint32_t>(i)};
    }
  }

  std::size_t size() const { return entries_.size(); }

  /// Points in the cell of a point, on average over the points: what a query has to look through.
  double crowding() const {
    double sum = 0.0;
    for (std::size_t c = 0; c + 1 < start_.size(); ++c) {
      const auto count = static_cast<double>(start_[c + 1] - start_[c]);
      sum += count * count;
    }
    return entries_.empty() ? 0.0 : sum / static_cast<double>(entries_.size());
  }

  /// Calls visit(index, squared distance) for each point with distance < radius, in no promised order.
  /// Safe from several threads at once. O(cells met + hits).
  template <class Visitor>
  void forEachWithin(const Vector3<S>& q, S radius, Visitor&& visit) const {
    if (entries_.empty() || !(radius > S(0))) {
      return;
    }
    std::size_t first[3];
    std::size_t last[3];
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = coordinate(q[axis] - radius, axis);
      last[axis] = coordinate(q[axis] + radius, axis);
    }
    const detail::Within<S> isWithin(radius);
    for (std::size_t z = first[2]; z <= last[2]; ++z) {
      for (std::size_t y = first[1]; y <= last[1]; ++y) {
        const std::size_t row = (z * count_[1] + y) * count_[0];
        for (std::size_t e = start_[row + first[0]]; e < start_[row + last[0] + 1]; ++e) {
          const Vector3<S> d = entries_[e].x - q;
          const S distance_sq = d.squaredNorm();
          if (isWithin(d, distance_sq)) {
            visit(static_cast<std::size_t>(entries_[e].index), distance_sq);
          }
        }
      }
    }
  }

  std::size_t cells() const { return start_.empty() ? 0 : start_.size() - 1; }

  /// True if two points at this distance are certain to lie in one cell or in neighbouring ones. A 64th of a
  /// cell is left for the rounding of the points' coordinates in units of cells.
  bool neighboursReach(const S& distance) const {
    const S rounding = S(4) * std::numeric_limits<S>::epsilon() *
                       static_cast<S>(std::max({count_[0], count_[1], count_[2]}));
    return distance * spare <= cell_ && rounding < (spare - S(1)) / S(2);
  }
  static constexpr S spare = S(65) / S(64);

  /// Calls visit(index1, index2) for two points nearer than the edge of a cell, one of which lies in a cell
  /// of [begin, end), and the other in the same cell or in one of the 13 neighbours after it: over all cells
  /// each two such points once. Safe from several threads at once. O(cells + points met).
  template <class Visitor>
  void forEachPair(std::size_t begin, std::size_t end, Visitor&& visit) const {
    for (std::size_t c = begin; c < end; ++c) {
      if (start_[c] == start_[c + 1]) {
        continue;
      }
      const std::size_t x = c % count_[0];
      const std::size_t y = c / count_[0] % count_[1];
      const std::size_t z = c / count_[0] / count_[1];
      const std::size_t west = x > 0 ? 1 : 0;
      const std::size_t east = x + 1 < count_[0] ? 2 : 1;
      std::size_t from[5];
      std::size_t to[5];
      std::size_t rows = 0;
      const auto add = [&](std::size_t row) {
        from[rows] = start_[row + x - west];
        to[rows++] = start_[row + x + east];
      };
      for (std::size_t dy = 0; dy < 3 && z + 1 < count_[2]; ++dy) {
        if (y + dy >= 1 && y + dy <= count_[1]) {
          add(((z + 1) * count_[1] + y + dy - 1) * count_[0]);
        }
      }
      if (y + 1 < count_[1]) {
        add((z * count_[1] + y + 1) * count_[0]);
      }
      for (std::size_t e = start_[c]; e < start_[c + 1]; ++e) {
        const auto meet = [&](std::size_t first, std::size_t last) {
          for (std::size_t other = first; other < last; ++other) {
            if ((entries_[other].x - entries_[e].x).squaredNorm() < cell_ * cell_) {
              visit(static_cast<std::size_t>(entries_[e].index),
                    static_cast<std::size_t>(entries_[other].index));
            }
          }
        };
        meet(e + 1, start_[c + east]);
        for (std::size_t r = 0; r < rows; ++r) {
          meet(from[r], to[r]);
        }
      }
    }
  }

 private:
  struct Entry {
    Vector3<S> x;
    std::uint32_t index;
  };

  std::size_t coordinate(const S& x, int axis) const {
    const S c = (x - low_[axis]) / cell_;
    const auto last = count_[axis] - 1;
    if (!(c > S(0))) {
      return 0;
    }
    return c < static_cast<S>(last) ? static_cast<std::size_t>(c) : last;
  }

  std::vector<Entry> entries_;
  std::vector<std::uint32_t> start_;  ///< first entry of each cell, and the end
  std::vector<std::size_t> cellOf_;   ///< of each point, while building
  Vector3<S> low_ = Vector3<S>::Zero();
  S cell_ = S(1);
  std::size_t count_[3] = {0, 0, 0};
};

/// Pair search on a uniform grid. Cells fit two bodies of the mean radius side by side; a larger body asks
/// more cells, whose number is in proportion to the bodies it may touch. O(N + pairs) for any radii, as long
/// as no cell is crowded.
template <std::floating_point S>
class GridPairs {
 public:
  /// First of all: the grid, by which it can be chosen to go on.
  const UniformGrid<S>& build(const std::vector<detail::Sphere<S>>& spheres, const S& margin) {
    S sum(0);
    std::size_t count = 0;
    for (const detail::Sphere<S>& s : spheres) {
      sum += s.radius;
      count += s.radius > S(0) ? 1U : 0U;
    }
    const S cell = ((count == 0 ? S(0) : S(2) * sum / static_cast<S>(count)) + margin) *
                   (UniformGrid<S>::spare * UniformGrid<S>::spare);
    grid_.build(detail::Homes<S>{&spheres}, cell > S(0) ? cell : S(1));
    return grid_;
  }

  /// Of the spheres of build(), every pair with |r_ij| < r_i + r_j + margin; queries are shared between
  /// threads.
  void findPairs(const std::vector<detail::Sphere<S>>& spheres, const S& margin, const Domain<S>& domain,
                 const S& time, std::vector<Pair>& out) {
    const S widest = S(2) * detail::LargestRadii<S>(spheres).largest + margin;
    if (domain.isOpen() && grid_.cells() > 0 && grid_.neighboursReach(widest)) {
      // Spheres of nearly one size, as they mostly are: each two looked at once.
      constexpr std::size_t chunk = 512;
      parts_.resize((grid_.cells() + chunk - 1) / chunk);
      parallelForChunks(grid_.cells(), chunk, [&](std::size_t begin, std::size_t end) {
        std::vector<Pair>& part = parts_[begin / chunk];
        part.clear();
        grid_.forEachPair(begin, end, [&](std::size_t i, std::size_t j) {
          detail::appendIfNear(spheres, i, j, margin, domain, time, part);
        });
      });
      detail::joinPairs(parts_, spheres, out);
      return;
    }
    detail::findPairsByQueries(grid_, spheres, margin, domain, time, parts_, out);
  }

 private:
  UniformGrid<S> grid_;
  std::vector<std::vector<Pair>> parts_;
};

}  // namespace gravel
