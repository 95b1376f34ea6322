#pragma once

/// \file
/// Random numbers that are a function of (seed, stream, counter): the same in any order, with any number of
/// threads, and without the unspecified algorithms of the standard distributions. `bits` and
/// `uniform(counter)` are the same on every machine; the rest up to the last bits of its cos and log and of
/// fused multiplications.

#include <gravel/core/types.hpp>

namespace gravel {

/// SplitMix64's finaliser (Steele, Lea & Flood 2014, OOPSLA) over the three words of the counter.
class CounterRandom {
 public:
  explicit constexpr CounterRandom(std::uint64_t seed, std::uint64_t stream = 0)
      : key_(mix(mix(seed) ^ (stream * 0xD1B54A32D192ED03ULL + 0x8CB92BA72F3D8DD7ULL))) {}

  constexpr std::uint64_t bits(std::uint64_t counter) const {
    return mix(key_ + (counter + 1) * 0x9E3779B97F4A7C15ULL);
  }

  /// Uniform in [0, 1), with 53 random bits.
  constexpr double uniform(std::uint64_t counter) const {
    return static_cast<double>(bits(counter) >> 11U) * 0x1p-53;
  }

  /// Uniform from low to high; high itself only where rounding reaches it.
  constexpr double uniform(std::uint64_t counter, double low, double high) const {
    return low + (high - low) * uniform(counter);
  }

  /// Standard normal deviate (Box & Muller 1958); uses counters 2c and 2c+1 of this stream.
  double normal(std::uint64_t counter) const {
    const double u = 1.0 - uniform(2 * counter);  // in (0, 1]
    const double angle = 2.0 * pi<double>() * uniform(2 * counter + 1);
    return std::sqrt(-2.0 * std::log(u)) * std::cos(angle);
  }

  /// Uniform on the unit sphere (Archimedes: the height is uniform); uses counters 2c and 2c+1.
  Vector3<double> direction(std::uint64_t counter) const {
    const double z = uniform(2 * counter, -1.0, 1.0);
    const double angle = 2.0 * pi<double>() * uniform(2 * counter + 1);
    const double r = std::sqrt(1.0 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

 private:
  static constexpr std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
  }

  std::uint64_t key_;
};

}  // namespace gravel
