#pragma once

/// \file
/// An octree over bodies for fast multipoles: cells around their centre of mass, children side by side, every
/// cell's bodies side by side.

#include <gravel/core/parallel_sort.hpp>
#include <gravel/core/types.hpp>
#include <gravel/spatial/morton.hpp>

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

namespace gravel::detail {

/// S is the scalar of far-field work. For double, one line of a cache.
template <Real S>
struct TreeCell {
  /// Sizes need few digits; they are rounded up.
  using Size = std::conditional_t<std::is_floating_point_v<S>, float, S>;

  Vector3<S> centre = Vector3<S>::Zero();  ///< of mass; of the bodies where none has mass
  S mass = S(0);
  S weight = S(0);        ///< what errors at these bodies may be [acceleration]
  Size radius = Size(0);  ///< around the centre, holds all bodies
  Size spread = Size(0);  ///< (sum m s^q / M)^(1/q), s the distance from the centre: radius of the mass
  std::uint32_t first = 0;
  std::uint32_t last = 0;  ///< bodies [first, last)
  std::uint32_t child = 0;
  std::uint32_t children = 0;

  bool isLeaf() const { return children == 0; }
  std::uint32_t count() const { return last - first; }

  static Size sizeOf(const S& x) {
    if constexpr (std::is_floating_point_v<S>) {
      return static_cast<float>(x) * 1.000001F;
    } else {
      return x;
    }
  }
};

/// A cell as a source: the cell itself (image 0), or its image in a periodic system.
struct ImageCell {
  std::uint32_t cell = 0;
  std::uint32_t image = 0;
};

/// Positions and masses in columns in the order of the tree; cells breadth first, the root at 0.
template <Real S, Real F>
struct BodyTree {
  std::vector<S> x, y, z, m;
  std::vector<std::uint32_t> body;  ///< the caller's index of each row
  std::vector<TreeCell<F>> cells;
  std::vector<std::uint32_t> parents;  ///< of each cell; of the root: itself
  /// First cell of each group, and the end: no cell is in its parent's group, and parents come first.
  std::vector<std::size_t> levels;

  /// Rows behind the last one that may be read, in whole tiles.
  static constexpr std::size_t margin = 16;

  std::size_t size() const { return body.size(); }

  /// The number of rows before this one that have mass: those of [first, last) stand side by side, from
  /// sourcesBefore(first) to sourcesBefore(last), in the columns of sources().
  std::uint32_t sourcesBefore(std::uint32_t row) const { return before_.empty() ? row : before_[row]; }
  std::array<const std::vector<S>*, 4> sources() const {
    if (before_.empty()) {
      return {&x, &y, &z, &m};
    }
    return {&packed_[0], &packed_[1], &packed_[2], &packed_[3]};
  }

  /// Finds them, after build(); without massless bodies they are the columns themselves.
  void packSources() {
    before_.clear();
    if (std::find(m.begin(), m.begin() + static_cast<std::ptrdiff_t>(size()), S(0)) ==
        m.begin() + static_cast<std::ptrdiff_t>(size())) {
      return;
    }
    for (std::vector<S>& column : packed_) {
      column.clear();
    }
    before_.reserve(size() + 1);
    for (std::size_t row = 0; row < size(); ++row) {
      before_.push_back(static_cast<std::uint32_t>(packed_[0].size()));
      if (m[row] > S(0)) {
        packed_[0].push_back(x[row]);
        packed_[1].push_back(y[row]);
        packed_[2].push_back(z[row]);
        packed_[3].push_back(m[row]);
      }
    }
    before_.push_back(static_cast<std::uint32_t>(packed_[0].size()));
    for (std::vector<S>& column : packed_) {
      column.resize(column.size() + margin, S(0));
    }
  }

  /// Fields are wanted at all rows, or at those with isWanted[body] alone. After build().
  void setSinks(const std::vector<std::uint8_t>& isWanted) {
    sinksBefore_.clear();
    if (!isWanted.empty()) {
      sinksBefore_.assign(1, 0);
      for (const std::uint32_t i : body) {
        sinksBefore_.push_back(sinksBefore_.back() + (isWanted[i] != 0 ? 1U : 0U));
      }
    }
  }
  bool allSinks() const { return sinksBefore_.empty(); }
  /// Whether a field is wanted anywhere in [first, last).
  bool hasSinks(std::uint32_t first, std::uint32_t last) const {
    return allSinks() || sinksBefore_[first] != sinksBefore_[last];
  }

  /// Makes room for n rows, of which body[row] is to be brought: the order of the last tree of as many
  /// bodies, which is nearly that of the next one, or that of the bodies.
  void resize(std::size_t n) {
    for (std::vector<S>* column : {&x, &y, &z, &m}) {
      column->assign(n + margin, S(0));
    }
    if (body.size() != n) {
      body.resize(n);
      std::iota(body.begin(), body.end(), 0U);
    }
  }

  /// Sorts the rows and builds cells of at most `leafSize` bodies, more only where bodies (nearly) coincide.
  /// The same tree from any order of the rows. Places must be finite. O(N log N), the logarithm of those
  /// alone whose order is another than in the last tree.
  void build(std::uint32_t leafSize) {
    cells.clear();
    parents.clear();
    levels.clear();
    keys_.resize(size());
    if (size() == 0) {
      return;
    }
    cells.push_back({});
    parents.push_back(0);
    cells[0].last = static_cast<std::uint32_t>(size());
    frames_.assign(1, Frame{assignKeys(0, cells[0].last), 0});
    smallest_ = frames_[0].edge * S(0x1p-40);
    levels.assign(1, 0);
    for (std::size_t begin = 0; begin < cells.size();) {
      const std::size_t end = cells.size();
      for (std::size_t c = begin; c < end; ++c) {
        split(c, leafSize);
      }
      levels.push_back(end);
      begin = end;
    }
    splitSparse();
  }

 private:
  struct Key {
    std::uint64_t key;
    std::uint32_t row;
  };

  /// The cube of a cell.
  struct Frame {
    S edge;
    std::uint8_t level;  ///< below the cube that its keys divide
  };

  /// Leaves much larger than where most bodies are, down to single bodies: their bodies feel the rest of the
  /// system through one expansion, which is good in a small part of them only.
  void splitSparse() {
    edges_.resize(size());
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (cells[c].isLeaf()) {
        std::fill(edges_.begin() + cells[c].first, edges_.begin() + cells[c].last, frames_[c].edge);
      }
    }
    const auto middle = edges_.begin() + static_cast<std::ptrdiff_t>(size() / 2);
    std::nth_element(edges_.begin(), middle, edges_.end());
    const S large = *middle * S(1.5);
    const std::size_t old = cells.size();
    for (std::size_t c = 0; c < old; ++c) {
      if (cells[c].isLeaf() && frames_[c].edge > large) {
        split(c, 1);
      }
    }
    for (std::size_t begin = old; begin < cells.size();) {
      const std::size_t end = cells.size();
      levels.push_back(end);
      for (std::size_t c = begin; c < end; ++c) {
        if (frames_[c].edge > large) {
          split(c, 1);
        }
      }
      begin = end;
    }
  }

  /// Keys of rows [first, last) in the cube around them, and the rows sorted by them. Returns the edge.
  S assignKeys(std::uint32_t first, std::uint32_t last) {
    S low[3];
    const std::vector<S>* columns[3] = {&x, &y, &z};
    S edge(0);
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<S>& column = *columns[axis];
      const Chunks chunks(last - first, 16384);
      std::vector<std::array<S, 2>> ends(chunks.count());
      parallelForTasks(chunks.count(), [&](std::size_t c) {
        S least = column[first + chunks.begin(c)];
        S most = least;
        for (std::size_t i = first + chunks.begin(c); i < first + chunks.end(c); ++i) {
          least = column[i] < least ? column[i] : least;
          most = most < column[i] ? column[i] : most;
        }
        ends[c] = {least, most};
      });
      low[axis] = ends[0][0];
      S high = ends[0][1];
      for (const std::array<S, 2>& part : ends) {
        low[axis] = part[0] < low[axis] ? part[0] : low[axis];
        high = high < part[1] ? part[1] : high;
      }
      edge = std::max(edge, S(high - low[axis]));
    }
    parallelFor(last - first, 8192, [&](std::size_t k) {
      const std::size_t i = first + k;
      keys_[i] = {mortonKey(mortonCell(x[i], low[0], edge), mortonCell(y[i], low[1], edge),
                            mortonCell(z[i], low[2], edge)),
                  static_cast<std::uint32_t>(i)};
    });
    parallelSort(keys_, first, last, keyScratch_, [&](const Key& a, const Key& b) {
      return a.key < b.key || (a.key == b.key && body[a.row] < body[b.row]);
    });
    bool moved = false;
    for (std::uint32_t i = first; i < last && !moved; ++i) {
      moved = keys_[i].row != i;
    }
    if (moved) {
      for (std::vector<S>* column : {&x, &y, &z, &m}) {
        permute(*column, scratch_, first, last);
      }
      permute(body, bodyScratch_, first, last);
    }
    return edge;
  }

  template <class T>
  void permute(std::vector<T>& column, std::vector<T>& scratch, std::uint32_t first, std::uint32_t last) {
    scratch.resize(size());
    parallelFor(last - first, 16384,
                [&](std::size_t k) { scratch[first + k] = column[keys_[first + k].row]; });
    parallelFor(last - first, 16384, [&](std::size_t k) { column[first + k] = scratch[first + k]; });
  }

  static constexpr int bits = 21;

  void split(std::size_t c, std::uint32_t leafSize) {
    const std::uint32_t first = cells[c].first;
    const std::uint32_t last = cells[c].last;
    if (last - first <= leafSize) {
      return;
    }
    Frame frame = frames_[c];
    std::uint8_t& level = frame.level;
    // Down to the first level that tells bodies apart; a new cube where the keys are used up.
    while (level == bits || digit(first, level) == digit(last - 1, level)) {
      if (level < bits) {
        ++level;
        frame.edge *= S(0.5);
        continue;
      }
      frame = {assignKeys(first, last), 0};
      if (!(frame.edge > smallest_)) {
        return;
      }
    }
    const auto childBegin = static_cast<std::uint32_t>(cells.size());
    for (std::uint32_t begin = first; begin < last;) {
      const std::uint64_t own = digit(begin, level);
      const auto end = static_cast<std::uint32_t>(
          std::partition_point(keys_.begin() + begin, keys_.begin() + last,
                               [&](const Key& k) { return (k.key >> shift(level) & 7U) <= own; }) -
          keys_.begin());
      TreeCell<F> child;
      child.first = begin;
      child.last = end;
      cells.push_back(child);
      parents.push_back(static_cast<std::uint32_t>(c));
      frames_.push_back({frame.edge * S(0.5), static_cast<std::uint8_t>(level + 1)});
      begin = end;
    }
    cells[c].child = childBegin;
    cells[c].children = static_cast<std::uint32_t>(cells.size()) - childBegin;
  }

  static unsigned shift(int level) { return 3U * static_cast<unsigned>(bits - 1 - level); }
  std::uint64_t digit(std::uint32_t row, int level) const { return keys_[row].key >> shift(level) & 7U; }

  std::vector<std::uint32_t> before_;  ///< empty where all rows have mass
  std::array<std::vector<S>, 4> packed_;
  std::vector<std::uint32_t> sinksBefore_;  ///< empty where all are wanted
  std::vector<Key> keys_, keyScratch_;
  std::vector<Frame> frames_;  ///< of each cell
  std::vector<S> edges_;
  S smallest_ = S(0);
  std::vector<S> scratch_;
  std::vector<std::uint32_t> bodyScratch_;
};

}  // namespace gravel::detail
