#pragma once

/// \file
/// Gravity by summing every pair: exact to rounding, mutual, and the same bits for any number of threads.

#include <gravel/core/parallel.hpp>
#include <gravel/gravity/few_bodies.hpp>
#include <gravel/gravity/gravity_units.hpp>
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
  /// out[i] = -sum_j G m_j (x_i - x_j) / (|x_i - x_j|^2 + softening^2)^(3/2) [m s^-2], for every i.
  /// \param G [m^3 kg^-1 s^-2]  \param softening [m] >= 0
  /// \throws std::invalid_argument for values that are not finite, negative masses or softening
  template <class Positions, class Masses, class Accelerations>
  void accelerations(const Positions& positions, const Masses& masses, const S& G, const S& softening,
                     Accelerations&& out) {
    if constexpr (detail::FewBodies<S>::usable) {
      if (detail::FewBodies<S>::accelerations(positions, masses, G, softening, out)) {
        return;
      }
    }
    gather(positions, masses, G, softening);
    table_.clearAccelerations();
    sumMutual();
    sumTracers();
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
    return -units_.energy(G)(sum);
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
    units_ = detail::GravityUnits<S>(positions, masses, G, softening);
    const S perLength = units_.perLength();
    const S perMass = units_.perMass();
    const std::size_t sources = units_.sources();
    table_.softening_sq = (softening * perLength) * (softening * perLength);
    table_.sourceEnd = wholeTiles(sources);
    table_.resize(table_.sourceEnd + wholeTiles(n - sources));
    body_.assign(table_.size(), filling);
    std::size_t nextSource = 0;
    std::size_t nextTracer = table_.sourceEnd;
    for (std::size_t i = 0; i < n; ++i) {
      const S m = masses[i];
      const std::size_t row = m > S(0) ? nextSource++ : nextTracer++;
      const Vector3<S> x = positions[i] * perLength;
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

  void sumTracers() {
    const std::size_t begin = table_.sourceEnd;
    const std::size_t n = table_.size() - begin;
    const std::size_t block = blockSize(n);
    shareOut((n + block - 1) / block, n + begin, [&](std::size_t b) {
      for (std::size_t j = 0; j < table_.sourceEnd; ++j) {
        table_.addOneWay(begin + b * block, begin + std::min(n, (b + 1) * block), j);
      }
    });
  }

  detail::PairTable<S> table_;
  std::vector<std::size_t> body_;  ///< the body of each row
  detail::GravityUnits<S> units_;
};

}  // namespace gravel
