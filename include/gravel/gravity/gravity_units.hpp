#pragma once

/// \file
/// What every gravity sum does first: look at its input, and choose units in which nothing overflows.

#include <gravel/core/check.hpp>
#include <gravel/core/parallel.hpp>

#include <algorithm>

namespace gravel::detail {

/// \throws std::invalid_argument for a number that no body has
template <class Numbers>
void requireBodies(const Numbers& numbers, std::size_t bodies) {
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    if (!(static_cast<std::size_t>(numbers[k]) < bodies)) {
      refuse("number of a body in a gravity sum", std::to_string(numbers[k]),
             "below the number of bodies, " + std::to_string(bodies));
    }
  }
}

/// \throws std::invalid_argument unless there is a mass for each position
template <class Masses>
void requireMasses(const Masses& masses, std::size_t bodies) {
  if (static_cast<std::size_t>(masses.size()) != bodies) {
    refuse("length of masses", std::to_string(masses.size()), "that of positions, " + std::to_string(bodies));
  }
}

/// Where a column of results knows its length, it has room for all bodies.
/// \throws std::invalid_argument otherwise
template <class Accelerations>
void requireRoom(const Accelerations& out, std::size_t bodies) {
  if constexpr (requires { out.size(); }) {
    if (static_cast<std::size_t>(out.size()) < bodies) {
      refuse("length of accelerations", std::to_string(out.size()),
             "at least the number of bodies, " + std::to_string(bodies));
    }
  }
}

/// Powers of two near the extent and the largest mass of a system, so that conversions are exact.
template <Real S>
class GravityUnits {
 public:
  GravityUnits() = default;

  /// \throws std::invalid_argument for values that are not finite, negative masses or softening, and columns
  /// of different lengths
  /// \param box edges of a periodic system [m]; 0 along axes that are open
  template <class Positions, class Masses>
  GravityUnits(const Positions& positions, const Masses& masses, const S& G, const S& softening,
               const Vector3<S>& box = Vector3<S>::Zero()) {
    const std::size_t n = positions.size();
    require("G", G, anyFinite<S>());
    require("softening", softening, nonNegative<S>());
    requireMasses(masses, n);
    constexpr std::size_t share = 16384;
    Range all = lookAt(positions, masses, 0, std::min(n, share));
    if (n > share) {
      const Chunks chunks(n, share);
      std::vector<Range> parts(chunks.count(), all);
      parallelForTasks(chunks.count() - 1, [&](std::size_t c) {
        parts[c + 1] = lookAt(positions, masses, chunks.begin(c + 1), chunks.end(c + 1));
      });
      for (std::size_t c = 1; c < parts.size(); ++c) {
        all.add(parts[c]);
      }
    }
    if (all.refused < n) {
      refuseBody(all.refused, positions[all.refused], masses[all.refused]);
    }
    const Vector3<S>& low = all.low;
    const Vector3<S>& high = all.high;
    const S& heaviest = all.heaviest;
    sources_ = all.sources;
    low_ = low[2] * S(2);
    high_ = high[2] * S(2);
    S extent = softening;
    for (int axis = 0; axis < 3; ++axis) {
      const S half = box[axis] > S(0) ? S(box[axis] / S(2)) : S(high[axis] - low[axis]);
      extent = std::max(extent, half);
      const bool positive = low[axis] > S(0);
      const S near = positive ? low[axis] : std::min<S>(high[axis], S(0));
      const S far = positive ? high[axis] : low[axis];
      offset_[axis] = (positive ? far <= S(2) * near : far >= S(2) * near) ? S(S(2) * near) : S(0);
    }
    lengthExponent_ = exponentOf(extent);
    massExponent_ = exponentOf(heaviest);
    perLength_ = power(-lengthExponent_);
    perMass_ = power(-massExponent_);
  }

  const S& perLength() const { return perLength_; }
  const S& perMass() const { return perMass_; }
  std::size_t sources() const { return sources_; }  ///< bodies with mass
  const S& low() const { return low_; }             ///< least and greatest z [m]
  const S& high() const { return high_; }
  /// [m] What can be taken off all positions without any rounding: along an axis on which they all are on one
  /// side of the origin, at no more than twice the distance of the nearest, that distance (Sterbenz 1974,
  /// Floating-Point Computation); along others 0.
  const Vector3<S>& offset() const { return offset_; }

  /// x -> x G in the units of the caller, out of range only if the result is.
  class Factor {
   public:
    Factor(const S& G, int exponent) : mantissa_(G), first_(1), second_(1) {
      if constexpr (std::is_floating_point_v<S>) {
        int own = 0;
        mantissa_ = std::frexp(G, &own);
        exponent += own;
        first_ = std::ldexp(S(1), exponent / 2);
        second_ = std::ldexp(S(1), exponent - exponent / 2);
      }
    }
    S operator()(const S& x) const { return x * mantissa_ * first_ * second_; }

   private:
    S mantissa_, first_, second_;
  };

  Factor acceleration(const S& G) const { return Factor(G, massExponent_ - 2 * lengthExponent_); }
  /// Also of G m / r^3, in s^-2.
  Factor jerk(const S& G) const { return Factor(G, massExponent_ - 3 * lengthExponent_); }
  Factor energy(const S& G) const { return Factor(G, 2 * massExponent_ - lengthExponent_); }

 private:
  /// What was found of some bodies.
  struct Range {
    Vector3<S> low =
        Vector3<S>::Zero();  ///< of half the positions: the extent of two huge numbers is in range
    Vector3<S> high = Vector3<S>::Zero();
    S heaviest = S(0);
    std::size_t sources = 0;
    std::size_t refused = std::numeric_limits<std::size_t>::max();  ///< first that makes no force

    void add(const Range& other) {
      low = low.cwiseMin(other.low);
      high = high.cwiseMax(other.high);
      heaviest = std::max(heaviest, other.heaviest);
      sources += other.sources;
      refused = std::min(refused, other.refused);
    }
  };

  template <class Positions, class Masses>
  static Range lookAt(const Positions& positions, const Masses& masses, std::size_t begin, std::size_t end) {
    Range range;
    for (std::size_t i = begin; i < end; ++i) {
      const Vector3<S> half = positions[i] / S(2);
      const S m = masses[i];
      if (!isFinite(half) || !isFinite(m) || m < S(0)) {
        range.refused = i;
        break;
      }
      range.low = i == begin ? half : range.low.cwiseMin(half);
      range.high = i == begin ? half : range.high.cwiseMax(half);
      range.heaviest = std::max(range.heaviest, m);
      range.sources += m > S(0) ? 1U : 0U;
    }
    return range;
  }

  /// The power of two that brings x near 1; 0 for a scalar whose exponent cannot be had.
  static int exponentOf(const S& x) {
    if constexpr (std::is_floating_point_v<S>) {
      constexpr int limit = std::numeric_limits<S>::max_exponent - 3;
      return x > S(0) ? std::clamp(std::ilogb(x), -limit, limit) : 0;
    } else {
      return 0;
    }
  }

  static S power(int exponent) {
    if constexpr (std::is_floating_point_v<S>) {
      return std::ldexp(S(1), exponent);
    } else {
      return S(1);
    }
  }

  [[noreturn]] static void refuseBody(std::size_t i, const Vector3<S>& x, const S& m) {
    const std::string who = " of body " + std::to_string(i) + " in a gravity sum";
    if (!isFinite(x)) {
      refuse("position" + who, formatVector(x), "finite");
    }
    refuse("mass" + who, formatReal(m), "finite, >= 0");
  }

  int lengthExponent_ = 0;
  int massExponent_ = 0;
  S perLength_ = S(1);
  S perMass_ = S(1);
  std::size_t sources_ = 0;
  S low_ = S(0);
  S high_ = S(0);
  Vector3<S> offset_ = Vector3<S>::Zero();
};

}  // namespace gravel::detail
