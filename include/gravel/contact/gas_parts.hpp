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
/// deviation along each axis. Ways are less what all have in common.
template <Real S>
struct GasMotion {
  S diameter = S(0);   ///< [m] mean
  S filled = S(0);     ///< [1] n d^3 for the number density n
  S meanWay = S(0);    ///< [1] in a step, in diameters
  S widestWay = S(0);  ///< [1] the same, but for swift ones
  S bodies = S(0);     ///< that move and have a radius
  S swift = S(0);      ///< [1] sum of the ways of the swift ones
  S swift_sq = S(0);   ///< and of their squares

  /// In h [s]; widestWay of nobody is known where it is below `least`. O(bodies).
  template <class B>
  static GasMotion of(const B& bodies, const Domain<S>& domain, const S& h, const S& least) {
    using std::sqrt;
    struct Sums {
      S count = S(0);
      S speed = S(0);
      S fastest = S(0);
      S radius = S(0);
      Vector3<S> x = Vector3<S>::Zero();
      Vector3<S> x_sq = Vector3<S>::Zero();
      Sums& operator+=(const Sums& other) {
        count += other.count;
        speed += other.speed;
        fastest = std::max<S>(fastest, other.fastest);
        radius += other.radius;
        x += other.x;
        x_sq += other.x_sq;
        return *this;
      }
    };
    const Vector3<S> common =
        commonWay<S>(bodies.size(), [&](std::size_t i) { return velocityOf(bodies, i); });
    const auto speedOf = [&](std::size_t i) {
      return isMovable(bodies, i) ? S(sqrt(Vector3<S>(velocityOf(bodies, i) - common).squaredNorm())) : S(0);
    };
    const Vector3<S> origin = bodies.positions()[0];
    const Sums sums = orderedSum(bodies.size(), 1024, Sums{}, [&](std::size_t begin, std::size_t end) {
      Sums part;
      for (std::size_t i = begin; i < end; ++i) {
        const S r = bodies.radii()[i];
        if (isMovable(bodies, i) && r > S(0)) {
          const Vector3<S> x = Vector3<S>(bodies.positions()[i]) - origin;
          const S v = speedOf(i);
          part += {S(1), v, v, r, x, Vector3<S>(x.cwiseProduct(x))};
        }
      }
      return part;
    });
    GasMotion gas;
    gas.bodies = sums.count;
    if (!(sums.count > S(0))) {
      return gas;
    }
    const S d = S(2) * sums.radius / sums.count;
    gas.diameter = d;
    gas.filled = sums.count;
    for (int axis = 0; axis < 3; ++axis) {
      const S mean = sums.x[axis] / sums.count;
      const S variance = std::max<S>(S(0), S(sums.x_sq[axis] / sums.count - mean * mean));
      gas.filled *= d / (domain.isOpen() ? S(S(sqrt(S(12) * variance)) + d) : domain.lengths()[axis]);
    }
    gas.meanWay = sums.speed / sums.count * h / d;
    gas.widestWay = sums.fastest * h / d;
    if (gas.widestWay > least) {
      std::vector<S> ways_sq(bodies.size());
      parallelFor(bodies.size(), 1024, [&](std::size_t i) {
        const S way = speedOf(i) * h / d;
        ways_sq[i] = way * way;
      });
      const SwiftOnes<S> ones = SwiftOnes<S>::of(ways_sq);
      gas.widestWay = S(sqrt(ones.next_sq));
      for (const S& way_sq : ways_sq) {
        gas.swift += way_sq > ones.next_sq ? S(sqrt(way_sq)) : S(0);
        gas.swift_sq += way_sq > ones.next_sq ? way_sq : S(0);
      }
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
