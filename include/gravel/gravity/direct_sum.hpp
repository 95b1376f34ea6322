#pragma once

/// \file
/// Gravity by summing every pair: exact to rounding, mutual, and the same bits for any number of threads.

#include <gravel/core/parallel.hpp>
#include <gravel/gravity/few_bodies.hpp>
#include <gravel/gravity/gravity_units.hpp>
#include <gravel/gravity/image_field.hpp>
#include <gravel/gravity/pair_tiles.hpp>

#include <algorithm>

namespace gravel {

/// Sums Newton's law (with Plummer's softening) over all pairs. Positions and masses are copied into columns
/// of its own first, so every layout and a user's own arrays cost the same; the copy is in units of the
/// extent and the largest mass (powers of two, so exact), which keeps float in range in SI units.
///
/// Error: rounding only, a few epsilon times the sum of |terms| of a body. Each pair adds m_j w d to one body
/// and m_i w d, negated, to the other, so that the total force vanishes to rounding. Points closer than
/// sqrt(PairLaw::tiny()) of the extent: see PairLaw. Bodies of mass zero (tracers) feel and do not pull.
///
/// Cost: N^2 / 2 pairs; memory 7 scalars a body. Threads take blocks in the rounds of a tournament in which
/// no block plays twice, so the order of every sum is a function of N alone. One object serves one caller at
/// a time.
template <Real S>
class DirectSum {
 public:
  /// In a periodic domain every body is pulled by all images of all bodies, its own among them, over the
  /// homogeneous background that makes the mean density zero; in a shear-periodic one by the images in x and
  /// y, where they are at `time` [s], and gravity is open in z. Near images are summed pair by pair, and
  /// softened; all others, as points, through one expansion of their lattice. Bodies may stand outside of the
  /// box. A sum over n images costs n/2 + 1 times an open one.
  void setDomain(const Domain<S>& domain, const S& time = S(0)) { images_.setDomain(domain, time); }

  /// Error of the far images, relative to rms accelerations. \param tolerance > 0
  void setImageTolerance(const S& tolerance) {
    detail::require("image tolerance", tolerance, detail::positive<S>());
    imageTolerance_ = tolerance;
  }

  /// out[i] = -sum_j G m_j (x_i - x_j) / (|x_i - x_j|^2 + softening^2)^(3/2) [m s^-2], for every i.
  /// \param G [m^3 kg^-1 s^-2]  \param softening [m] >= 0
  /// \throws std::invalid_argument for values that are not finite, negative masses or softening
  template <class Positions, class Masses, class Accelerations>
  void accelerations(const Positions& positions, const Masses& masses, const S& G, const S& softening,
                     Accelerations&& out) {
    if constexpr (detail::FewBodies<S>::usable) {
      if (images_.isOpen() && detail::FewBodies<S>::accelerations(positions, masses, G, softening, out)) {
        return;
      }
    }
    gather(positions, masses, G, softening);
    table_.clearAccelerations();
    sumMutual();
    sumTracers();
    if (!images_.isOpen()) {
      sumImages();
    }
    const auto factor = units_.acceleration(G);
    for (std::size_t row = 0; row < body_.size(); ++row) {
      if (body_[row] != filling) {
        out[body_[row]] = Vector3<S>(factor(table_.ax[row]), factor(table_.ay[row]), factor(table_.az[row]));
      }
    }
  }

  /// -G sum_{i<j} m_i m_j / sqrt(|x_i - x_j|^2 + softening^2) [J]; coincident unsoftened points add nothing.
  template <class Positions, class Masses>
  S potentialEnergy(const Positions& positions, const Masses& masses, const S& G, const S& softening) {
    gather(positions, masses, G, softening);
    const std::size_t n = table_.sourceEnd;
    const std::size_t block = blockSize(n);
    std::vector<S> parts((n + block - 1) / block, S(0));
    shareOut(parts.size(), n, [&](std::size_t b) {
      const std::size_t begin = b * block;
      const std::size_t end = std::min(n, begin + block);
      parts[b] = table_.potentialWithin(begin, end) + table_.potentialBetween(end, n, begin, end);
    });
    S sum(0);
    for (const S& part : parts) {
      sum += part;
    }
    if (!images_.isOpen()) {
      sum += imageEnergies();
    }
    return -units_.energy(G)(sum);
  }

  /// What the potential energy loses with body i [J]: that of its pairs, and with its own images. O(N).
  template <class Positions, class Masses>
  S energyOf(std::size_t i, const Positions& positions, const Masses& masses, const S& G,
             const S& softening) {
    gather(positions, masses, G, softening);
    std::size_t own = 0;
    while (body_[own] != i) {
      ++own;
    }
    const std::size_t n = table_.sourceEnd;
    const Vector3<S> x(table_.x[own], table_.y[own], table_.z[own]);
    S sum(0);
    for (std::size_t row = 0; row < n; ++row) {
      const Vector3<S> d = Vector3<S>(table_.x[row], table_.y[row], table_.z[row]) - x;
      S potential(0);
      for (std::size_t image = row == own ? 1 : 0; image < images_.shifts().size(); ++image) {
        const S s = Vector3<S>(d + images_.shifts()[image]).squaredNorm() + table_.softening_sq;
        potential += PairLaw<S>::potentialFactor(s);
      }
      sum += table_.m[row] * (row == own ? S(potential / S(2)) : potential);
    }
    if (!images_.isOpen()) {
      S a[3] = {S(0), S(0), S(0)};
      S far(0);
      farImages_.gather(images_, table_.x.data(), table_.y.data(), table_.z.data(), table_.m.data(), n);
      farImages_.addTo(1, &table_.x[own], &table_.y[own], &table_.z[own], a, a + 1, a + 2, &far);
      sum += far - table_.m[own] * S(images_.derivatives()[0]) / S(2);
    }
    return -units_.energy(G)(S(table_.m[own] * sum));
  }

 private:
  static constexpr std::size_t width = detail::PairTable<S>::width;
  static constexpr std::size_t filling = std::numeric_limits<std::size_t>::max();

  /// Bodies a block: small enough that two blocks stay in the nearest cache and there is work for many
  /// threads, large enough that the reductions of a source do not count.
  static constexpr std::size_t blockSize(std::size_t n) {
    return n < 1024 ? 64 : n < 8192 ? 128 : detail::PairTable<S>::maxBlock;
  }

  /// Below this many pairs a parallel region costs more than it brings.
  static constexpr std::size_t pairsWorthThreads = 50000;

  template <class F>
  static void shareOut(std::size_t tasks, std::size_t n, F&& f) {
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
    units_ = detail::GravityUnits<S>(positions, masses, G, softening, images_.box());
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
    for (const std::size_t from : {nextSource, nextTracer}) {
      for (std::size_t row = from; row % width != 0; ++row) {
        place(row, Vector3<S>(table_.x[from - 1], table_.y[from - 1], table_.z[from - 1]), S(0));
      }
    }
  }

  static std::size_t wholeTiles(std::size_t n) { return (n + width - 1) / width * width; }

  void place(std::size_t row, const Vector3<S>& x, const S& m) {
    table_.x[row] = x[0];
    table_.y[row] = x[1];
    table_.z[row] = x[2];
    table_.m[row] = m;
  }

  /// Round-robin tournament by the circle method: first every block against itself, then rounds of disjoint
  /// pairs of blocks.
  void sumMutual() {
    const std::size_t n = table_.sourceEnd;
    const std::size_t block = blockSize(n);
    const std::size_t blocks = (n + block - 1) / block;
    const auto end = [&](std::size_t b) { return std::min(n, (b + 1) * block); };
    shareOut(blocks, n, [&](std::size_t b) { table_.addWithin(b * block, end(b)); });
    const std::size_t players = blocks + blocks % 2;  // of an odd number one sits out each round
    for (std::size_t round = 0; round + 1 < players; ++round) {
      shareOut(players / 2, n, [&](std::size_t game) {
        const std::size_t circle = players - 1;
        const std::size_t one = (round + game) % circle;
        const std::size_t two = game == 0 ? circle : (round + circle - game) % circle;
        const std::size_t a = std::min(one, two);
        const std::size_t b = std::max(one, two);
        if (b < blocks) {
          table_.addMutual(a * block, end(a), b * block, end(b));
        }
      });
    }
  }

  /// \param from first of the rows of sources, or of their copies
  void sumTracers(std::size_t from = 0) {
    const std::size_t begin = tracerBegin_;
    const std::size_t n = table_.size() - begin;
    const std::size_t block = blockSize(n);
    shareOut((n + block - 1) / block, n + begin, [&](std::size_t b) {
      for (std::size_t j = from; j < from + table_.sourceEnd; ++j) {
        table_.addOneWay(begin + b * block, begin + std::min(n, (b + 1) * block), j);
      }
    });
  }

  /// Copies of the sources, shifted, behind the sources.
  void placeCopies(const Vector3<S>& shift) {
    const std::size_t n = table_.sourceEnd;
    for (std::size_t row = 0; row < n; ++row) {
      place(n + row, Vector3<S>(table_.x[row], table_.y[row], table_.z[row]) + shift, table_.m[row]);
    }
  }

  /// Of opposite images one is summed, mutually: what it feels is what the other does. Rounds in which each
  /// block of sources meets another block of copies.
  void sumImages() {
    const std::size_t n = table_.sourceEnd;
    const std::size_t block = blockSize(n);
    const std::size_t blocks = (n + block - 1) / block;
    const auto end = [&](std::size_t b) { return std::min(n, (b + 1) * block); };
    const std::vector<Vector3<S>>& shifts = images_.shifts();
    for (std::size_t image = 1; image < shifts.size(); ++image) {
      placeCopies(shifts[image]);
      sumTracers(n);
      for (std::size_t round = 0; round < blocks && image % 2 == 1; ++round) {
        shareOut(blocks, n, [&](std::size_t a) {
          const std::size_t b = (a + round) % blocks;
          table_.addMutual(a * block, end(a), n + b * block, n + end(b));
        });
      }
    }
    for (std::vector<S>* column : {&table_.ax, &table_.ay, &table_.az}) {
      for (std::size_t row = 0; row < n; ++row) {
        (*column)[row] += (*column)[n + row];
      }
    }
    farImages_.gather(images_, table_.x.data(), table_.y.data(), table_.z.data(), table_.m.data(), n);
    for (const auto& [begin, last] : {std::pair{std::size_t{0}, n}, std::pair{tracerBegin_, table_.size()}}) {
      farImages_.addTo(last - begin, &table_.x[begin], &table_.y[begin], &table_.z[begin], &table_.ax[begin],
                       &table_.ay[begin], &table_.az[begin], nullptr);
    }
  }

  /// Sum of m_i m_j p over all pairs with images, each body with its own by half.
  S imageEnergies() {
    const std::size_t n = table_.sourceEnd;
    const std::size_t block = blockSize(n);
    std::vector<S> parts((n + block - 1) / block, S(0));
    const std::vector<Vector3<S>>& shifts = images_.shifts();
    for (std::size_t image = 1; image < shifts.size(); image += 2) {
      placeCopies(shifts[image]);
      shareOut(parts.size(), n, [&](std::size_t b) {
        parts[b] += table_.potentialBetween(n, 2 * n, b * block, std::min(n, (b + 1) * block));
      });
    }
    farImages_.gather(images_, table_.x.data(), table_.y.data(), table_.z.data(), table_.m.data(), n);
    table_.clearAccelerations();
    std::vector<S> potential(n, S(0));
    farImages_.addTo(n, table_.x.data(), table_.y.data(), table_.z.data(), table_.ax.data(), table_.ay.data(),
                     table_.az.data(), potential.data());
    S sum(0);
    for (const S& part : parts) {
      sum += part;
    }
    for (std::size_t row = 0; row < n; ++row) {
      sum += table_.m[row] * potential[row] / S(2);
    }
    return sum;
  }

  /// Of expansions; see FastMultipole.
  using F = std::conditional_t<std::is_same_v<S, float>, double, S>;

  detail::PairTable<S> table_;
  std::vector<std::size_t> body_;  ///< the body of each row
  std::size_t tracerBegin_ = 0;
  detail::GravityUnits<S> units_;
  detail::PeriodicImages<S, F> images_;
  detail::ImageField<S, F> farImages_;
  S imageTolerance_ = S(1e-10);
};

}  // namespace gravel
