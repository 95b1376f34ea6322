#pragma once

/// \file
/// In how many parts the steps of a gas take the least time.

#include <gravel/contact/contact_bodies.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/core/random.hpp>
#include <gravel/spatial/domain.hpp>
#include <gravel/spatial/strays.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace gravel::detail {

/// A gas that fills its box evenly; not periodic one as wide as three quarters of the bodies are, and a third
/// more. Ways in a step, less what all have in common, are in diameters d, the median. Widths and d are those
/// of 256 bodies that chance picks, so that a few far or large ones have no say.
template <Real S>
struct GasMotion {
  S bodies = S(0);     ///< that move and have a radius
  S filled = S(0);     ///< n d^3 for the number density n
  S meanWay = S(0);    ///< of all
  S widestWay = S(0);  ///< of all but the swift ones
  S swift = S(0);      ///< sum of the ways of these
  S swift_sq = S(0);   ///< and of their squares

  /// In h [s]; all zero where no way is above `least`. O(bodies).
  template <class B>
  static GasMotion of(const B& bodies, const Domain<S>& domain, const S& h, const S& least) {
    using std::sqrt;
    const Vector3<S> common =
        commonWay<S>(bodies.size(), [&](std::size_t i) { return velocityOf(bodies, i); });
    const auto isTaken = [&](std::size_t i) { return isMovable(bodies, i) && bodies.radii()[i] > S(0); };
    struct Limits {
      S fastest_sq = S(0);
      S smallest = highest<S>();
      Limits& operator+=(const Limits& other) {
        fastest_sq = std::max<S>(fastest_sq, other.fastest_sq);
        smallest = std::min<S>(smallest, other.smallest);
        return *this;
      }
    };
    const auto limits = orderedSum(bodies.size(), chunk, Limits{}, [&](std::size_t begin, std::size_t end) {
      Limits part;
      for (std::size_t i = begin; i < end; ++i) {
        const Vector3<S> v = Vector3<S>(bodies.velocities()[i]) - common;
        const bool taken = isTaken(i);
        const S v_sq = taken ? S(v.squaredNorm()) : S(0);
        const S r = taken ? S(bodies.radii()[i]) : highest<S>();
        part.fastest_sq = v_sq > part.fastest_sq ? v_sq : part.fastest_sq;
        part.smallest = r < part.smallest ? r : part.smallest;
      }
      return part;
    });
    GasMotion gas;
    if (!(S(sqrt(limits.fastest_sq)) * h > least * S(2) * limits.smallest)) {
      return gas;
    }
    std::array<std::vector<S>, 4> picked;  // coordinates and radii
    const CounterRandom chance(1, 0);
    for (std::uint64_t k = 0; k < 256; ++k) {
      const double at = chance.uniform(k, 0.0, static_cast<double>(bodies.size()));
      const std::size_t i = std::min(static_cast<std::size_t>(at), bodies.size() - 1);
      if (isTaken(i)) {
        const Vector3<S> x = bodies.positions()[i];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          picked[axis].push_back(x[static_cast<Eigen::Index>(axis)]);
        }
        picked[3].push_back(bodies.radii()[i]);
      }
    }
    if (picked[3].empty()) {
      return gas;
    }
    for (std::vector<S>& numbers : picked) {
      std::sort(numbers.begin(), numbers.end());
    }
    const std::size_t eighth = picked[3].size() / 8;
    const S d = S(2) * picked[3][picked[3].size() / 2];
    std::vector<S> ways_sq(bodies.size());
    parallelFor(bodies.size(), chunk, [&](std::size_t i) {
      const S v_sq = isTaken(i) ? S(Vector3<S>(velocityOf(bodies, i) - common).squaredNorm()) : S(0);
      const S way = S(sqrt(v_sq)) * h / d;
      ways_sq[i] = way * way;
    });
    S ways(0);
    std::size_t taken = 0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      ways += S(sqrt(ways_sq[i]));
      taken += isTaken(i) ? 1U : 0U;
    }
    gas.bodies = gas.filled = S(static_cast<double>(taken));
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<S>& x = picked[static_cast<std::size_t>(axis)];
      const S width = (x[x.size() - 1 - eighth] - x[eighth]) * S(4) / S(3);
      gas.filled *= d / (domain.isOpen() ? S(width + d) : domain.lengths()[axis]);
    }
    gas.meanWay = ways / gas.bodies;
    const SwiftOnes<S> ones = SwiftOnes<S>::of(ways_sq);
    gas.widestWay = S(sqrt(ones.next_sq));
    for (const S& way_sq : ways_sq) {
      gas.swift += way_sq > ones.next_sq ? S(sqrt(way_sq)) : S(0);
      gas.swift_sq += way_sq > ones.next_sq ? way_sq : S(0);
    }
    return gas;
  }

  /// Bodies that a list with a skin for the ways of a part has near each one.
  S candidates(const S& parts) const {
    const S reach = S(1) + S(2) * widestWay / parts;
    return std::min<S>(bodies, S(S(4) / S(3) * pi<S>() * filled * reach * reach * reach));
  }

  /// [microseconds] for a body and step, of three kinds: what parts take whatever there is, and what
  /// candidates take in each; those of both bodies in each of the sqrt(2) pi n d^2 l collisions of a body on
  /// the mean way l (kinetic theory: Chapman & Cowling 1970, 5.21); and where a swift one strikes, pi n d^2 l
  /// times on its way, a look at all bodies, and again for whom the struck one meets in the rest of the part.
  /// Measured in elastic gases of 4096, a fifth of the box filled, mean ways of 0.01 to 10 diameters, and in
  /// such a one at rest with ten bullets.
  S cost(const S& parts) const {
    using std::sqrt;
    const S width = pi<S>() * filled;
    const S collisions = S(sqrt(S(2))) * width * meanWay;
    return S(0.3) * parts + (S(0.01) * parts + S(0.025) * collisions) * candidates(parts) +
           S(0.012) * width * (swift + width * swift_sq / parts);
  }

 private:
  static constexpr std::size_t chunk = 1024;
};

/// The number of parts, `most` at most, in which a step of h [s] takes the least time: each collision is a
/// look at all that is near the ways of both bodies, and their number goes with the cube of the longest ones.
/// O(bodies).
template <Real S, class B>
std::size_t cheapestParts(const B& bodies, const Domain<S>& domain, const S& h, std::size_t most) {
  const S near(0.25);
  const auto gas = GasMotion<S>::of(bodies, domain, h, near);
  std::size_t best = 1;
  if (isFinite(gas.cost(S(1)))) {
    S least = gas.cost(S(1));
    for (std::size_t parts = 2; parts <= most; ++parts) {
      const S cost = gas.cost(S(static_cast<double>(parts)));
      if (cost < least) {
        least = cost;
        best = parts;
      }
    }
  }
  return best;
}

}  // namespace gravel::detail
