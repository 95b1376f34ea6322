#pragma once

/// \file
/// What expansions do to one cell of sinks: gathers sources into batches, and passes local expansions on.

#include <gravel/gravity/near_field.hpp>
#include <gravel/gravity/tree_moments.hpp>

namespace gravel::detail {

/// Local expansions are plain arrays of `terms()` coefficients, from the order `first` on: 0 with the
/// potential, 1 for the force alone.
template <Real S, Real F, class Terms>
class FarField {
 public:
  using Tree = BodyTree<S, F>;
  using Moments = TreeMoments<S, F, Terms>;
  using Cell = TreeCell<F>;

  /// \param shifts of the images
  FarField(const Tree& tree, const Moments& moments, const std::vector<Vector3<S>>& shifts, int order,
           int first, const S& softening_sq)
      : tree_(tree),
        moments_(moments),
        shifts_(shifts),
        order_(order),
        first_(first),
        softening_sq_(softening_sq),
        terms_(moments.terms()),
        spread_(static_cast<std::size_t>(D::size(order))),
        laneMoments_(terms_ * parts),
        laneLocals_(terms_ * parts),
        laneDerivatives_(spread_.size()),
        laneRegular_(terms_),
        laneMoved_(terms_) {}

  std::size_t terms() const { return terms_; }

  /// A cell's local expansion about the centre of each of its children, one after another.
  void shiftToChildren(const Cell& cell, const F* from, F* to) {
    X::spreadOut(order_, from, spread_.data());
    for (std::uint32_t child = 0; child < cell.children; child += Batch::width) {
      alignas(64) F r[3][Batch::width] = {};
      const std::size_t count = std::min<std::size_t>(Batch::width, cell.children - child);
      for (std::size_t w = 0; w < count; ++w) {
        const Cell& part = tree_.cells[cell.child + child + w];
        for (int axis = 0; axis < 3; ++axis) {
          r[axis][w] = part.centre[axis] - cell.centre[axis];
        }
      }
      Operators::regular(order_, Batch::load(r[0]), Batch::load(r[1]), Batch::load(r[2]),
                         laneRegular_.data());
      std::fill(laneMoved_.begin(), laneMoved_.end(), Batch::zero());
      X::contract(order_, first_, order_, laneRegular_.data(), spread_.data(), laneMoved_.data());
      const auto* lanes = reinterpret_cast<const F*>(laneMoved_.data());
      for (std::size_t w = 0; w < count; ++w) {
        F* out = to + (child + w) * terms_;
        for (std::size_t k = 0; k < terms_; ++k) {
          out[k] = lanes[k * Batch::width + w];
        }
      }
    }
  }

  /// Starts a new cell of sinks.
  void begin() {
    batched_ = 0;
    batches_ = 0;
  }

  void add(const Cell& sink, const ImageCell& source) {
    prefetch(moments_.of(source.cell));
    waiting_[batched_++] = source;
    if (batched_ == Batch::size) {
      flush(sink);
    }
  }

  /// Adds what all the sources make to the sink's local expansion.
  void finish(const Cell& sink, F* local) {
    if (batched_ > 0) {
      flush(sink);
    }
    if (batches_ == 0) {
      return;
    }
    const auto* lanes = reinterpret_cast<const F*>(laneLocals_.data());
    for (std::size_t k = static_cast<std::size_t>(M::start(first_)); k < terms_; ++k) {
      F sum(0);
      for (std::size_t part = 0; part < parts; ++part) {
        for (std::size_t w = 0; w < Batch::width; ++w) {
          sum += lanes[(part * terms_ + k) * Batch::width + w];
        }
      }
      local[k] += sum;
    }
  }

  /// Adds a cell's local expansion at its bodies.
  void evaluate(const Cell& cell, const F* local, SinkFields<S>& out) {
    X::spreadOut(order_, local, spread_.data());
    for (std::uint32_t i = cell.first; i < cell.last; i += Batch::width) {
      alignas(64) F r[3][Batch::width] = {};
      const std::size_t count = std::min<std::size_t>(Batch::width, cell.last - i);
      for (std::size_t w = 0; w < count; ++w) {
        r[0][w] = F(tree_.x[i + w]) - cell.centre[0];
        r[1][w] = F(tree_.y[i + w]) - cell.centre[1];
        r[2][w] = F(tree_.z[i + w]) - cell.centre[2];
      }
      Operators::regular(order_, Batch::load(r[0]), Batch::load(r[1]), Batch::load(r[2]),
                         laneRegular_.data());
      V field[4] = {Batch::zero(), Batch::zero(), Batch::zero(),
                    Batch::zero()};  // the potential and its derivatives by x, y, z
      Operators::evaluate(order_, first_, laneRegular_.data(), spread_.data(), field);
      alignas(64) F values[4][Batch::width];
      for (int k = 0; k < 4; ++k) {
        Batch::store(values[k], field[k]);
      }
      for (std::size_t w = 0; w < count; ++w) {
        out.ax[i + w] += S(values[1][w]);
        out.ay[i + w] += S(values[2][w]);
        out.az[i + w] += S(values[3][w]);
        if (first_ == 0) {
          out.potential[i + w] += S(values[0][w]);
        }
      }
    }
  }

 private:
  using X = Expansion<Terms>;
  using M = typename X::M;
  using D = typename X::D;
  using Batch = FarBatch<F>;
  using V = typename Batch::V;
  using Operators = FarOperators<Terms, V>;
  static constexpr std::size_t parts = Batch::size / Batch::width;
  static constexpr std::size_t dipolesEnd = 4;  ///< about a centre of mass they vanish, and are not read

  void flush(const Cell& sink) {
    if (batches_++ == 0) {
      std::fill(laneLocals_.begin(), laneLocals_.end(), Batch::zero());
    }
    alignas(64) F r[5][Batch::size];
    auto* lanes = reinterpret_cast<F*>(laneMoments_.data());
    for (std::size_t w = 0; w < Batch::size; ++w) {
      const ImageCell s = waiting_[w < batched_ ? w : 0];
      const Cell& source = tree_.cells[s.cell];
      const Vector3<S>& shift = shifts_[s.image];
      F r_sq = F(softening_sq_);
      for (int axis = 0; axis < 3; ++axis) {
        r[axis][w] = (sink.centre[axis] - source.centre[axis]) - F(shift[axis]);
        r_sq += r[axis][w] * r[axis][w];
      }
      r[3][w] = r_sq;
      const F* m = moments_.of(s.cell);
      F* to = lanes + w / Batch::width * terms_ * Batch::width + w % Batch::width;
      to[0] = m[0];
      for (std::size_t k = dipolesEnd; k < terms_; ++k) {
        to[k * Batch::width] = m[k];
      }
    }
    // Each scalar has vectors of Eigen's with a packed square root; the lanes of a batch are others.
    using Row = Eigen::Array<F, static_cast<int>(Batch::size), 1>;
    Eigen::Map<Row> inverse(r[4]);
    Eigen::Map<Row> squares(r[3]);
    inverse = squares.sqrt().inverse();
    squares = -squares.inverse();
    for (std::size_t w = batched_; w < Batch::size; ++w) {
      r[4][w] = F(0);
    }
    batched_ = 0;
    for (std::size_t part = 0; part < parts; ++part) {
      const std::size_t w = part * Batch::width;
      Operators::interact(order_, first_, Batch::load(r[0] + w), Batch::load(r[1] + w), Batch::load(r[2] + w),
                          Batch::load(r[3] + w), Batch::load(r[4] + w), &laneMoments_[part * terms_],
                          laneDerivatives_.data(), &laneLocals_[part * terms_]);
    }
  }

  /// Moments lie anywhere in memory; by the time their batch is full they have come.
  void prefetch(const F* moments) const {
    for (std::size_t k = 0; k < terms_; k += std::max<std::size_t>(1, 64 / sizeof(F))) {
      __builtin_prefetch(moments + k);
    }
  }

  const Tree& tree_;
  const Moments& moments_;
  const std::vector<Vector3<S>>& shifts_;
  int order_;
  int first_;
  S softening_sq_;
  std::size_t terms_;
  std::vector<F> spread_;
  std::vector<V> laneMoments_, laneLocals_, laneDerivatives_, laneRegular_, laneMoved_;
  std::array<ImageCell, Batch::size> waiting_{};
  std::size_t batched_ = 0;
  std::size_t batches_ = 0;
};

}  // namespace gravel::detail
