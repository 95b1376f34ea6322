#pragma once

/// \file
/// The walk of the fast multipole method: what each cell of sinks does with each cell of sources.

#include <gravel/gravity/far_field.hpp>

namespace gravel::detail {

/// When a walk takes a pair of cells as it is.
struct WalkLimits {
  int order = 4;
  std::uint64_t pairsBelowExpansion = 64;  ///< fewer pairs of bodies are summed one by one
  std::uint64_t pairsBelowSplit = 256;     ///< and fewer than that if the cells are too near
};

/// Work done, in units of its own.
struct WalkCount {
  std::size_t expansions = 0;  ///< pairs of cells, one direction
  std::size_t pairs = 0;       ///< pairs of bodies, one direction

  WalkCount& operator+=(const WalkCount& other) {
    expansions += other.expansions;
    pairs += other.pairs;
    return *this;
  }
};

/// Descends through the cells as sinks, depth first. A cell meets the sources that were too near for its
/// parent: it takes the expansion of those far away, sums those of few bodies one by one, opens those that
/// are larger than itself, and leaves the rest to its children. Each direction of a pair of cells is decided
/// by a function that is symmetric in them and is then computed by itself, so that sinks share nothing.
template <Real S, Real F, class Terms>
class MultipoleWalk {
 public:
  using Tree = BodyTree<S, F>;
  using Moments = TreeMoments<S, F, Terms>;

  /// \param shifts of the images that are sources, first that of the cells themselves, zero
  /// \param deviation  what the potential may err by from a pair of cells, if it is found
  MultipoleWalk(const Tree& tree, const Moments& moments, const std::vector<Vector3<S>>& shifts,
                const WalkLimits& limits, const S& softening_sq, const F& deviation, SinkFields<S>& out)
      : tree_(tree),
        shifts_(shifts),
        limits_(limits),
        softening_sq_(softening_sq),
        out_(out),
        far_(tree, moments, shifts, limits.order, out.potential.empty() ? 1 : 0, softening_sq),
        withPotential_(!out.potential.empty()),
        deviation_(deviation) {}

  /// Where a walk can be taken up again: a cell, what its parent left it of the local expansion, and the
  /// sources that it has to meet.
  struct Start {
    std::uint32_t cell = 0;
    std::vector<F> local;
    std::vector<ImageCell> sources;
  };

  /// Descends to cells of at most `bodies` bodies and returns these as starts.
  std::vector<Start> prepare(std::uint32_t bodies) {
    std::vector<Start> starts;
    prepared_ = &starts;
    handOver_ = bodies;
    Start all{0, std::vector<F>(far_.terms(), F(0)), {}};
    for (std::uint32_t image = 0; image < shifts_.size(); ++image) {
      all.sources.push_back({0, image});
    }
    run(all);
    prepared_ = nullptr;
    return starts;
  }

  void run(const Start& start) {
    stack_ = start.sources;
    locals_ = start.local;
    descend(start.cell, 0, stack_.size(), 0);
  }

  const WalkCount& count() const { return count_; }

 private:
  using Cell = TreeCell<F>;

  /// The cell's local expansion stands at `local` in locals_; those of its children follow behind.
  void descend(std::uint32_t c, std::size_t begin, std::size_t end, std::size_t local) {
    const Cell& cell = tree_.cells[c];
    const std::size_t terms = far_.terms();
    if (!tree_.hasSinks(cell.first, cell.last)) {
      return;
    }
    if (prepared_ != nullptr && (cell.count() <= handOver_ || cell.isLeaf())) {
      prepared_->push_back(
          {c, {at(locals_, local), at(locals_, local + terms)}, {at(stack_, begin), at(stack_, end)}});
      return;
    }
    const std::size_t kept = stack_.size();
    far_.begin();
    near_.clear();
    for (std::size_t i = begin; i < end; ++i) {
      todo_.push_back(stack_[i]);
      while (!todo_.empty()) {
        const ImageCell source = todo_.back();
        todo_.pop_back();
        meet(c, source);
      }
    }
    far_.finish(cell, &locals_[local]);
    near_.apply(tree_, cell.first, cell.last, softening_sq_, out_);
    count_.pairs += near_.size() * cell.count();
    if (cell.isLeaf()) {
      far_.evaluate(cell, &locals_[local], out_);
    } else {
      const std::size_t keptEnd = stack_.size();
      const std::size_t childLocals = locals_.size();
      locals_.resize(childLocals + cell.children * terms);
      far_.shiftToChildren(cell, &locals_[local], &locals_[childLocals]);
      for (std::uint32_t child = 0; child < cell.children; ++child) {
        descend(cell.child + child, kept, keptEnd, childLocals + child * terms);
      }
      locals_.resize(childLocals);
    }
    stack_.resize(kept);
  }

  template <class Vector>
  static auto at(Vector& v, std::size_t i) {
    return v.begin() + static_cast<std::ptrdiff_t>(i);
  }

  void meet(std::uint32_t c, const ImageCell& from) {
    const std::uint32_t s = from.cell;
    const Cell& sink = tree_.cells[c];
    const Cell& source = tree_.cells[s];
    if (!(source.mass > F(0))) {
      return;
    }
    if (c == s && from.image == 0) {
      if (sink.isLeaf()) {
        near_.addWithin(tree_, sink.first, sink.last, softening_sq_, out_);
      } else {
        for (std::uint32_t child = 0; child < sink.children; ++child) {
          stack_.push_back({sink.child + child, 0});
        }
      }
      return;
    }
    const std::uint64_t pairs = std::uint64_t(sink.count()) * source.count();
    // NOLINTNEXTLINE(bugprone-branch-clone): the order counts, the cheap test before the dear one
    if (pairs <= limits_.pairsBelowExpansion) {
      addNear(source, from.image);
    } else if (isFar(c, s, from.image)) {
      far_.add(sink, from);
      ++count_.expansions;
    } else if (pairs <= limits_.pairsBelowSplit || (sink.isLeaf() && source.isLeaf())) {
      addNear(source, from.image);
    } else if (c != s && splitsFirst(c, sink, s, source)) {
      stack_.push_back(from);
    } else {
      // A cell and its own image are both divided, as each is the image of the other.
      std::vector<ImageCell>& next = c == s ? stack_ : todo_;
      for (std::uint32_t child = 0; child < source.children; ++child) {
        next.push_back({source.child + child, from.image});
      }
    }
  }

  void addNear(const Cell& source, std::uint32_t image) {
    if (image == 0) {
      near_.addSources(tree_, source.first, source.last);
    } else {
      near_.addSources(tree_, source.first, source.last, shifts_[image]);
    }
  }

  static bool splitsFirst(std::uint32_t a, const Cell& cellA, std::uint32_t b, const Cell& cellB) {
    if (cellA.isLeaf() || cellB.isLeaf()) {
      return cellB.isLeaf();
    }
    return cellA.radius == cellB.radius ? a < b : cellA.radius > cellB.radius;
  }

  /// The same bits for a pair of cells seen from either: images come in pairs of opposite shifts.
  bool isFar(std::uint32_t first, std::uint32_t second, std::uint32_t image) const {
    const Cell& a = tree_.cells[first];
    const Cell& b = tree_.cells[second];
    Vector3<F> r = a.centre - b.centre;
    if (image != 0) {
      const Vector3<S>& shift = shifts_[image];
      r -= Vector3<F>(F(shift[0]), F(shift[1]), F(shift[2]));
    }
    const F r_sq = r.squaredNorm();
    const F both = F(a.radius) + F(b.radius);
    const F gap = r_sq - both * both;
    if (!(gap > F(0))) {
      return false;
    }
    const F inverse_sq = F(1) / r_sq;
    const F pull = r_sq / (gap * gap);
    return isAccurate(first, b, inverse_sq, pull) && isAccurate(second, a, inverse_sq, pull);
  }

  /// (M / r^2) ((s + R) / r)^p / (1 - theta^2)^2 within the sink's allowance: s the radius of the source's
  /// mass, R that of the sink, M of massAround(). \param pull 1 / (r^2 (1 - theta^2)^2)
  bool isAccurate(std::uint32_t from, const Cell& sink, const F& inverse_sq, const F& pull) const {
    const Cell& source = tree_.cells[from];
    const F reach = F(source.spread) + F(sink.radius);
    const F ratio_sq = reach * reach * inverse_sq;
    F error = massAround(from, sink) * pull;
    error *= error;
    for (int k = 0; k < limits_.order; ++k) {
      error *= ratio_sq;
    }
    // An error E of the force is one of E r in the potential. In dense clusters far from each other the pull
    // is strong, and allows E too much for that.
    return error <= sink.weight * sink.weight &&
           (!withPotential_ || error <= deviation_ * deviation_ * inverse_sq);
  }

  /// The mass of a source; of one smaller than a leaf as a sink that of the largest cell around it that is
  /// not larger than the sink. A leaf is not divided: it meets all parts of that cell, which lie in one
  /// direction and err alike, so that each may have its share of the allowance only.
  const F& massAround(std::uint32_t source, const Cell& sink) const {
    if (sink.isLeaf()) {
      while (source != 0 && tree_.cells[tree_.parents[source]].radius <= sink.radius) {
        source = tree_.parents[source];
      }
    }
    return tree_.cells[source].mass;
  }

  const Tree& tree_;
  const std::vector<Vector3<S>>& shifts_;
  WalkLimits limits_;
  S softening_sq_;
  SinkFields<S>& out_;
  std::vector<ImageCell> stack_;  ///< sources that cells on the path have left to their children
  std::vector<ImageCell> todo_;
  std::vector<F> locals_;  ///< of the cells on the path and their siblings
  FarField<S, F, Terms> far_;
  NearField<S> near_;
  bool withPotential_;
  F deviation_;
  std::vector<Start>* prepared_ = nullptr;
  std::uint32_t handOver_ = 0;
  WalkCount count_;
};

}  // namespace gravel::detail
