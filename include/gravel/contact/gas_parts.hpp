#pragma once

/// \file
/// In how many parts the steps of a gas take the least time.

#include <gravel/contact/contact_bodies.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/spatial/domain.hpp>
#include <gravel/spatial/strays.hpp>

#include <algorithm>

namespace gravel::detail {

/// A gas that fills its box evenly, not periodic one as wide as the bodies are spread, sqrt(12) of the
/// deviation along each axis. Ways in a step, less what all have in common, are in mean diameters d.
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
    constexpr std::size_t chunk = 1024;
    const Vector3<S> common =
        commonWay<S>(bodies.size(), [&](std::size_t i) { return velocityOf(bodies, i); });
    const auto isTaken = [&](std::size_t i) { return isMovable(bodies, i) && bodies.radii()[i] > S(0); };
    const auto speed_sq = [&](std::size_t i) {
      return isTaken(i) ? S(Vector3<S>(velocityOf(bodies, i) - common).squaredNorm()) : S(0);
    };
    struct Sizes {
      S count = S(0);
      S radius = S(0);
      S fastest_sq = S(0);
      Sizes& operator+=(const Sizes& other) {
        count += other.count;
        radius += other.radius;
        fastest_sq = std::max<S>(fastest_sq, other.fastest_sq);
        return *this;
      }
    };
    const Sizes sizes = orderedSum(bodies.size(), chunk, Sizes{}, [&](std::size_t begin, std::size_t end) {
      Sizes part;
      for (std::size_t i = begin; i < end; ++i) {
        const Vector3<S> v = Vector3<S>(bodies.velocities()[i]) - common;
        const bool taken = isTaken(i);
        const S v_sq = taken ? S(v.squaredNorm()) : S(0);
        part.count += taken ? S(1) : S(0);
        part.radius += taken ? S(bodies.radii()[i]) : S(0);
        part.fastest_sq = v_sq > part.fastest_sq ? v_sq : part.fastest_sq;
      }
      return part;
    });
    GasMotion gas;
    const S d = S(2) * sizes.radius / sizes.count;
    if (!(d > S(0)) || !(S(sqrt(sizes.fastest_sq)) * h > least * d)) {
      return gas;
    }
    struct Spread {
      Vector3<S> x = Vector3<S>::Zero();
      Vector3<S> x_sq = Vector3<S>::Zero();
      S way = S(0);
      Spread& operator+=(const Spread& other) {
        x += other.x;
        x_sq += other.x_sq;
        way += other.way;
        return *this;
      }
    };
    std::vector<S> ways_sq(bodies.size());
    const Vector3<S> origin = bodies.positions()[0];
    const Spread all = orderedSum(bodies.size(), chunk, Spread{}, [&](std::size_t begin, std::size_t end) {
      Spread part;
      for (std::size_t i = begin; i < end; ++i) {
        const S way = S(sqrt(speed_sq(i))) * h / d;
        ways_sq[i] = way * way;
        if (isTaken(i)) {
          const Vector3<S> x = Vector3<S>(bodies.positions()[i]) - origin;
          part += {x, Vector3<S>(x.cwiseProduct(x)), way};
        }
      }
      return part;
    });
    gas.bodies = gas.filled = sizes.count;
    for (int axis = 0; axis < 3; ++axis) {
      const S mean = all.x[axis] / sizes.count;
      const S variance = std::max<S>(S(0), S(all.x_sq[axis] / sizes.count - mean * mean));
      gas.filled *= d / (domain.isOpen() ? S(S(sqrt(S(12) * variance)) + d) : domain.lengths()[axis]);
    }
    gas.meanWay = all.way / sizes.count;
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
