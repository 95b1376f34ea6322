#pragma once

/// \file
/// Gravity by summing every pair: exact to rounding, mutual, and the same bits for any number of threads.

#include <gravel/gravity/direct_rows.hpp>
#include <gravel/gravity/few_bodies.hpp>

#include <array>

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
class DirectSum : public detail::DirectRows<S> {
  using Rows = detail::DirectRows<S>;

 public:
  /// out[i] = -sum_j G m_j (x_i - x_j) / (|x_i - x_j|^2 + softening^2)^(3/2) [m s^-2], for every i.
  /// \param G [m^3 kg^-1 s^-2]  \param softening [m] >= 0
  /// \throws std::invalid_argument for values that are not finite, negative masses or softening
  template <class Positions, class Masses, class Accelerations>
  void accelerations(const Positions& positions, const Masses& masses, const S& G, const S& softening,
                     Accelerations&& out) {
    detail::requireRoom(out, positions.size());
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
      sumImages(true);
    }
    putOut(G, 0, out);
  }

  /// As accelerations(), but out[i] is found for these numbers i only, and the others are left as they are.
  /// Each is summed over all bodies, one way, in the order of rows: not the bits of the mutual sum.
  /// O(numbers N + N). \throws std::invalid_argument for a number that no body has, besides
  template <class Numbers, class Positions, class Masses, class Accelerations>
  void accelerationsOf(const Numbers& numbers, const Positions& positions, const Masses& masses, const S& G,
                       const S& softening, Accelerations&& out) {
    detail::requireRoom(out, positions.size());
    detail::requireBodies(numbers, positions.size());
    gather(positions, masses, G, softening);
    this->gatherSinks(numbers, positions);
    table_.clearAccelerations();
    sumTracers();
    if (!images_.isOpen()) {
      sumImages(false);
    }
    putOut(G, tracerBegin_, out);
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
    detail::requireBodies(std::array{i}, positions.size());
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
      farImages_.addTo(images_, 1, &table_.x[own], &table_.y[own], &table_.z[own], a, a + 1, a + 2, &far);
      sum += far - table_.m[own] * S(images_.ownPotential()) / S(2);
    }
    return -units_.energy(G)(S(table_.m[own] * sum));
  }

 private:
  using Rows::blockSize;
  using Rows::body_;
  using Rows::filling;
  using Rows::gather;
  using Rows::images_;
  using Rows::placeCopies;
  using Rows::shareOut;
  using Rows::table_;
  using Rows::tracerBegin_;
  using Rows::units_;

  /// \param from first row
  template <class Accelerations>
  void putOut(const S& G, std::size_t from, Accelerations&& out) const {
    const auto factor = units_.acceleration(G);
    for (std::size_t row = from; row < body_.size(); ++row) {
      if (body_[row] != filling) {
        out[body_[row]] = Vector3<S>(factor(table_.ax[row]), factor(table_.ay[row]), factor(table_.az[row]));
      }
    }
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

  /// Of opposite images one is summed, mutually: what it feels is what the other does. Rounds in which each
  /// block of sources meets another block of copies.
  /// \param mutual false: the rows behind the copies feel, no others
  void sumImages(bool mutual) {
    const std::size_t n = table_.sourceEnd;
    const std::size_t block = blockSize(n);
    const std::size_t blocks = (n + block - 1) / block;
    const auto end = [&](std::size_t b) { return std::min(n, (b + 1) * block); };
    const std::vector<Vector3<S>>& shifts = images_.shifts();
    for (std::size_t image = 1; image < shifts.size(); ++image) {
      placeCopies(shifts[image]);
      sumTracers(n);
      for (std::size_t round = 0; mutual && round < blocks && image % 2 == 1; ++round) {
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
      const auto at = [from = begin](auto& column) { return column.data() + from; };
      farImages_.addTo(images_, last - begin, at(table_.x), at(table_.y), at(table_.z), at(table_.ax),
                       at(table_.ay), at(table_.az), nullptr);
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
    farImages_.addTo(images_, n, table_.x.data(), table_.y.data(), table_.z.data(), table_.ax.data(),
                     table_.ay.data(), table_.az.data(), potential.data());
    S sum(0);
    for (const S& part : parts) {
      sum += part;
    }
    for (std::size_t row = 0; row < n; ++row) {
      sum += table_.m[row] * potential[row] / S(2);
    }
    return sum;
  }

  detail::ImageField<S, typename Rows::F> farImages_;
};

}  // namespace gravel
