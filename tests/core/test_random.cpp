#include "support/catch.hpp"
#include <gravel/core/random.hpp>

#include <algorithm>
#include <vector>

using namespace gravel;

namespace {

/// SplitMix64 as published (Steele, Lea & Flood 2014), written apart from the library.
class SplitMix64 {
 public:
  explicit SplitMix64(std::uint64_t state) : state_(state) {}
  std::uint64_t next() {
    state_ += 0x9E3779B97F4A7C15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
  }

 private:
  std::uint64_t state_;
};

/// The key of a stream in that generator's own words: seed, then stream, then the state of the sequence.
std::uint64_t keyOf(std::uint64_t seed, std::uint64_t stream) {
  const auto finalise = [](std::uint64_t z) { return SplitMix64(z - 0x9E3779B97F4A7C15ULL).next(); };
  return finalise(finalise(seed) ^ (stream * 0xD1B54A32D192ED03ULL + 0x8CB92BA72F3D8DD7ULL));
}

constexpr std::uint64_t draws = 1000000;
const double root = std::sqrt(static_cast<double>(draws));

struct Moments {
  double mean;
  double variance;  // about the expected mean, which is given
  double fourth;
};

template <class Draw>
Moments moments(double expectedMean, Draw&& draw) {
  double first = 0.0;
  double second = 0.0;
  double fourth = 0.0;
  for (std::uint64_t i = 0; i < draws; ++i) {
    const double d = draw(i) - expectedMean;
    first += d;
    second += d * d;
    fourth += d * d * d * d;
  }
  const auto n = static_cast<double>(draws);
  return {expectedMean + first / n, second / n, fourth / n};
}

template <class A, class B>
double correlation(A&& a, B&& b) {
  double sum = 0.0;
  for (std::uint64_t i = 0; i < draws; ++i) {
    sum += (a(i) - 0.5) * (b(i) - 0.5);
  }
  return 12.0 * sum / static_cast<double>(draws);
}

}  // namespace

TEST_CASE("random: values are fixed for ever", "[random]") {
  CHECK(CounterRandom(0).bits(0) == 0x8f7b56222f7bb394U);
  CHECK(CounterRandom(0).bits(1) == 0x0c7d4fb523151198U);
  CHECK(CounterRandom(1).bits(0) == 0x9356f791d5a2d2f7U);
  CHECK(CounterRandom(0, 1).bits(0) == 0x0969ef91517f26e4U);
  CHECK(CounterRandom(42, 7).bits(123456789) == 0x80fd7219a0582c40U);
  CHECK(CounterRandom(~0ULL, ~0ULL).bits(~0ULL) == 0xd736aeecb4853e3bU);
  CHECK(CounterRandom(0).uniform(0) == 0.5604757150135657);
  CHECK(CounterRandom(42, 7).uniform(123456789) == 0.5038672745289153);
}

TEST_CASE("random: a stream is the published SplitMix64 sequence from its key", "[random]") {
  SplitMix64 published(0);
  CHECK(published.next() == 0xE220A8397B1DCDAFULL);  // as in the authors' and Java's implementation
  CHECK(published.next() == 0x6E789E6AA1B965F4ULL);
  CHECK(published.next() == 0x06C45D188009454FULL);
  for (const std::uint64_t seed : {0ULL, 1ULL, 987654321ULL, ~0ULL}) {
    for (const std::uint64_t stream : {0ULL, 1ULL, 99ULL}) {
      const CounterRandom random(seed, stream);
      SplitMix64 sequence(keyOf(seed, stream));
      for (std::uint64_t i = 0; i < 20; ++i) {
        CHECK(random.bits(i) == sequence.next());
      }
    }
  }
}

TEST_CASE("random: usable at compile time, a pure function of seed, stream and counter", "[random]") {
  constexpr CounterRandom random(3, 4);
  static_assert(random.bits(5) == CounterRandom(3, 4).bits(5));
  static_assert(random.uniform(5, 2.0, 2.0) == 2.0);
  const double late = random.uniform(1000);
  const double early = random.uniform(0);
  CHECK(random.uniform(0) == early);
  CHECK(CounterRandom(3, 4).uniform(1000) == late);
}

// Standard deviations of n draws: mean 1/sqrt(12 n); second moment sqrt((1/80 - 1/144) / n).
TEST_CASE("random: uniform deviates lie in [0, 1) with mean 1/2 and variance 1/12 within five sigma",
          "[random]") {
  for (const std::uint64_t seed : {0ULL, 1ULL, 20240101ULL}) {
    const CounterRandom random(seed);
    double least = 1.0;
    double most = 0.0;
    const Moments m = moments(0.5, [&](std::uint64_t i) {
      const double u = random.uniform(i);
      least = std::min(least, u);
      most = std::max(most, u);
      return u;
    });
    CHECK(std::abs(m.mean - 0.5) <= 5.0 * std::sqrt(1.0 / 12.0) / root);
    CHECK(std::abs(m.variance - 1.0 / 12.0) <= 5.0 * std::sqrt(1.0 / 180.0) / root);
    CHECK(least >= 0.0);
    CHECK(most < 1.0);
    // P(no draw within 20/n of an end) = exp(-20) = 2e-9.
    CHECK(least < 20.0 / static_cast<double>(draws));
    CHECK(most > 1.0 - 20.0 / static_cast<double>(draws));
  }
}

TEST_CASE("random: uniform deviates fill 256 bins evenly within five sigma of chi squared", "[random]") {
  std::vector<double> bins(256, 0.0);
  const CounterRandom random(11, 3);
  for (std::uint64_t i = 0; i < draws; ++i) {
    bins[static_cast<std::size_t>(256.0 * random.uniform(i))] += 1.0;
  }
  const double expected = static_cast<double>(draws) / 256.0;
  double chi_sq = 0.0;
  for (const double count : bins) {
    chi_sq += (count - expected) * (count - expected) / expected;
  }
  CHECK(std::abs(chi_sq - 255.0) <= 5.0 * std::sqrt(2.0 * 255.0));  // not too uneven, and not too even
}

TEST_CASE("random: each of the 64 bits is set in half of the draws within five sigma", "[random]") {
  std::vector<double> set(64, 0.0);
  const CounterRandom random(5);
  for (std::uint64_t i = 0; i < draws; ++i) {
    const std::uint64_t bits = random.bits(i);
    for (std::size_t b = 0; b < 64; ++b) {
      set[b] += static_cast<double>((bits >> b) & 1U);
    }
  }
  for (std::size_t b = 0; b < 64; ++b) {
    INFO("bit " << b);
    CHECK(std::abs(set[b] / static_cast<double>(draws) - 0.5) <= 5.0 * 0.5 / root);
  }
}

TEST_CASE("random: uniform between bounds is stretched, not redrawn", "[random]") {
  const CounterRandom random(8);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const double x = random.uniform(i, -3.0, 5.0);
    CHECK(x >= -3.0);
    CHECK(x <= 5.0);
    // One rounding of the product, one of the sum, of numbers below 8.
    CHECK(std::abs(x - (8.0 * random.uniform(i) - 3.0)) <= 8.0 * std::numeric_limits<double>::epsilon());
  }
}

// Standard deviations of n draws: mean 1/sqrt(n), second moment sqrt(2/n), fourth sqrt((105 - 9)/n).
TEST_CASE("random: normal deviates have moments 0, 1 and 3 within five sigma", "[random]") {
  const CounterRandom random(77, 2);
  const Moments m = moments(0.0, [&](std::uint64_t i) { return random.normal(i); });
  CHECK(std::abs(m.mean) <= 5.0 / root);
  CHECK(std::abs(m.variance - 1.0) <= 5.0 * std::sqrt(2.0) / root);
  CHECK(std::abs(m.fourth - 3.0) <= 5.0 * std::sqrt(96.0) / root);
}

// Each component is uniform in [-1, 1]: mean 0, variance 1/3, and its square has variance 4/45.
TEST_CASE("random: directions are unit vectors without a preferred one", "[random]") {
  const CounterRandom random(123);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    // 1 - z^2, its root, cos and sin, and the norm itself: half a dozen roundings.
    CHECK(std::abs(random.direction(i).norm() - 1.0) <= 6.0 * std::numeric_limits<double>::epsilon());
  }
  for (int c = 0; c < 3; ++c) {
    const Moments m = moments(0.0, [&](std::uint64_t i) { return random.direction(i)[c]; });
    INFO("component " << c);
    CHECK(std::abs(m.mean) <= 5.0 * std::sqrt(1.0 / 3.0) / root);
    CHECK(std::abs(m.variance - 1.0 / 3.0) <= 5.0 * std::sqrt(4.0 / 45.0) / root);
  }
}

// A correlation coefficient of n independent pairs has the standard deviation 1/sqrt(n). A key of seed +
// stream fails: (1, 0) is then the same stream as (0, 1).
TEST_CASE("random: neighbouring streams, seeds and counters are uncorrelated within five sigma", "[random]") {
  const CounterRandom a(1, 0);
  const auto of = [](const CounterRandom& random) {
    return [&random](std::uint64_t i) { return random.uniform(i); };
  };
  CHECK(std::abs(correlation(of(a), of(CounterRandom(1, 1)))) <= 5.0 / root);
  CHECK(std::abs(correlation(of(a), of(CounterRandom(2, 0)))) <= 5.0 / root);
  CHECK(std::abs(correlation(of(a), of(CounterRandom(0, 1)))) <= 5.0 / root);
  CHECK(std::abs(correlation(of(a), of(CounterRandom(0, 0)))) <= 5.0 / root);
  for (const std::uint64_t lag : {1U, 2U, 3U, 64U}) {
    INFO("lag " << lag);
    CHECK(std::abs(correlation(of(a), [&](std::uint64_t i) { return a.uniform(i + lag); })) <= 5.0 / root);
  }
}

// By chance two of a million 64-bit numbers agree with probability 1e12 / 2 / 1.8e19 = 3e-8.
TEST_CASE("random: a thousand streams of a few seeds share no value", "[random]") {
  std::vector<std::uint64_t> all;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    for (std::uint64_t stream = 0; stream < 100; ++stream) {
      const CounterRandom random(seed, stream);
      for (std::uint64_t i = 0; i < 1000; ++i) {
        all.push_back(random.bits(i));
      }
    }
  }
  std::sort(all.begin(), all.end());
  CHECK(std::adjacent_find(all.begin(), all.end()) == all.end());
}
