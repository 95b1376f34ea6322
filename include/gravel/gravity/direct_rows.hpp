#pragma once

/// \file
/// Bodies in the rows of a table of pairs: what the direct sums begin with.

#include <gravel/core/parallel.hpp>
#include <gravel/gravity/gravity_units.hpp>
#include <gravel/gravity/image_field.hpp>
#include <gravel/gravity/pair_tiles.hpp>

namespace gravel::detail {

/// Rows of the sources, then, where there are images, of their copies, shifted, then of bodies that only
/// feel.
template <Real S>
class DirectRows {
 public:
  /// In a periodic domain every body is pulled by all images of all bodies, its own among them, over the
  /// homogeneous background that makes the mean density zero; in a shear-periodic one by the images in x and
  /// y, where they are at `time` [s], and gravity is open in z. Near images are summed pair by pair, and
  /// softened; all others, as points, through one expansion of their lattice. Bodies may stand outside of the
  /// box. A sum over n images costs n/2 + 1 times an open one.
  void setDomain(const Domain<S>& domain, const S& time = S(0)) { images_.setDomain(domain, time); }

  /// Error of the far images, relative to rms accelerations. \param tolerance > 0
  void setImageTolerance(const S& tolerance) {
    require("image tolerance", tolerance, positive<S>());
    imageTolerance_ = tolerance;
  }

 protected:
  /// Of expansions; see FastMultipole.
  using F = AtLeastDouble<S>;

  static constexpr std::size_t width = PairTable<S>::width;
  static constexpr std::size_t filling = std::numeric_limits<std::size_t>::max();

  /// Bodies a block: small enough that two blocks stay in the nearest cache and there is work for many
  /// threads, large enough that the reductions of a source do not count.
  static constexpr std::size_t blockSize(std::size_t n) {
    return n < 1024 ? 64 : n < 8192 ? 128 : PairTable<S>::maxBlock;
  }

  /// Below this many pairs a parallel region costs more than it brings.
  static constexpr std::size_t pairsWorthThreads = 50000;

  template <class Task>
  static void shareOut(std::size_t tasks, std::size_t n, Task&& f) {
    if (n * n / 2 < pairsWorthThreads) {
      for (std::size_t task = 0; task < tasks; ++task) {
        f(task);
      }
    } else {
      parallelForTasks(tasks, f);
    }
  }

  template <class Positions, class Masses>
  void gather(const Positions& positions, const Masses& masses, const S& G, const S& softening) {
    const std::size_t n = positions.size();
    units_ = GravityUnits<S>(positions, masses, G, softening, images_.box());
    images_.prepare(units_.perLength(), units_.low(), units_.high(), imageTolerance_);
    const S perLength = units_.perLength();
    const S perMass = units_.perMass();
    const std::size_t sources = units_.sources();
    table_.softening_sq = (softening * perLength) * (softening * perLength);
    table_.sourceEnd = wholeTiles(sources);
    tracerBegin_ = images_.isOpen() ? table_.sourceEnd : 2 * table_.sourceEnd;
    table_.resize(tracerBegin_ + wholeTiles(n - sources));
    body_.assign(table_.size(), filling);
    std::size_t nextSource = 0;
    std::size_t nextTracer = tracerBegin_;
    for (std::size_t i = 0; i < n; ++i) {
      const S m = masses[i];
      const std::size_t row = m > S(0) ? nextSource++ : nextTracer++;
      const Vector3<S> x = images_.home(positions[i]) * perLength;
      body_[row] = i;
      place(row, x, m * perMass);
    }
    fillTile(nextSource);
    fillTile(nextTracer);
  }

  /// Massless copies of the last row up to a whole tile.
  void fillTile(std::size_t from) {
    for (std::size_t row = from; row % width != 0; ++row) {
      place(row, Vector3<S>(table_.x[from - 1], table_.y[from - 1], table_.z[from - 1]), S(0));
    }
  }

  static std::size_t wholeTiles(std::size_t n) { return (n + width - 1) / width * width; }

  void place(std::size_t row, const Vector3<S>& x, const S& m) {
    table_.x[row] = x[0];
    table_.y[row] = x[1];
    table_.z[row] = x[2];
    table_.m[row] = m;
  }

  /// Puts bodies of these numbers in place of the tracers: they feel, and need not be massless.
  template <class Numbers, class Positions>
  void gatherSinks(const Numbers& numbers, const Positions& positions) {
    const std::size_t count = numbers.size();
    table_.resize(tracerBegin_ + wholeTiles(count));
    body_.assign(table_.size(), filling);
    for (std::size_t k = 0; k < count; ++k) {
      const auto i = static_cast<std::size_t>(numbers[k]);
      body_[tracerBegin_ + k] = i;
      place(tracerBegin_ + k, Vector3<S>(images_.home(positions[i]) * units_.perLength()), S(0));
    }
    fillTile(tracerBegin_ + count);
  }

  /// Copies of the sources, shifted, behind the sources.
  void placeCopies(const Vector3<S>& shift) {
    const std::size_t n = table_.sourceEnd;
    for (std::size_t row = 0; row < n; ++row) {
      place(n + row, Vector3<S>(table_.x[row], table_.y[row], table_.z[row]) + shift, table_.m[row]);
    }
  }

  PairTable<S> table_;
  std::vector<std::size_t> body_;  ///< the body of each row
  std::size_t tracerBegin_ = 0;
  GravityUnits<S> units_;
  PeriodicImages<S, F> images_;
  S imageTolerance_ = S(1e-10);
};

}  // namespace gravel::detail
