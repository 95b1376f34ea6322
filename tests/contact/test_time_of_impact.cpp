#include "support/catch.hpp"
#include <gravel/contact/time_of_impact.hpp>
#include <gravel/core/random.hpp>

using namespace gravel;
using Vec = Vector3<double>;

namespace {

/// The first touch by looking at 20 000 moments and halving the interval in which |r| falls through reach.
std::optional<double> slowTouch(const RelativeFlight<double>& flight, double reach) {
  const int moments = 20000;
  double before = 0;
  for (int k = 1; k <= moments; ++k) {
    double low = before;
    double high = flight.h * k / moments;
    if (flight.place(low).norm() > reach && flight.place(high).norm() <= reach) {
      for (int bit = 0; bit < 60; ++bit) {
        const double middle = (low + high) / 2;
        (flight.place(middle).norm() > reach ? low : high) = middle;
      }
      return high;
    }
    before = high;
  }
  return std::nullopt;
}

}  // namespace

TEST_CASE("The time of impact of two spheres is the first one, with and without acceleration") {
  const CounterRandom random(7);
  int hits = 0;
  int misses = 0;
  for (std::uint64_t k = 0; k < 400; ++k) {
    const auto vector = [&](std::uint64_t j, double size) {
      return Vec(random.uniform(16 * k + j, -size, size), random.uniform(16 * k + j + 1, -size, size),
                 random.uniform(16 * k + j + 2, -size, size));
    };
    const RelativeFlight<double> flight{vector(0, 1.0).normalized() * random.uniform(16 * k + 9, 1.05, 3.0),
                                        vector(3, 4.0), k % 2 == 0 ? Vec(0, 0, 0) : vector(6, 20.0), 1.0};
    const auto slow = slowTouch(flight, 1.0);
    const auto fast = timeOfImpact<double>(flight, 1.0, 0.0);
    CAPTURE(k);
    if (slow) {
      ++hits;
      REQUIRE(fast);
      CHECK_THAT(*fast, Catch::Matchers::WithinAbs(*slow, 1e-7));  // grazes are the square root of rounding
      CHECK(std::abs(flight.place(*fast).norm() - 1.0) < 1e-13);
    } else {
      ++misses;
      // A touch shorter than a moment may hide between two of them.
      CHECK((!fast || std::abs(flight.place(*fast).dot(flight.velocity(*fast))) < 0.05));
    }
  }
  CHECK(hits > 30);
  CHECK(misses > 50);
}

TEST_CASE(
    "A sphere thrown up from a plane is back after 2 u / g, and touches at once only if it approaches") {
  const double h = 1.0;
  const double g = 10;
  const double u = 3;
  // velocity u at t = 0 is the drift's u - g h/2
  const RelativeFlight<double> up{{0, 0, 0.5}, {0, 0, u - g * h / 2}, {0, 0, -g}, h};
  const Vec n(0, 0, 1);
  CHECK_THAT(timeOfImpact<double>(up, n, 0.5, 0.0).value(), Catch::Matchers::WithinAbs(2 * u / g, 1e-15));
  const RelativeFlight<double> down{{0, 0, 0.5}, {0, 0, -u}, {0, 0, 0}, h};
  CHECK(timeOfImpact<double>(down, n, 0.5, 0.0).value() == 0.0);
  const RelativeFlight<double> away{{0, 0, 0.5}, {0, 0, u}, {0, 0, 0}, h};
  CHECK(!timeOfImpact<double>(away, n, 0.5, 0.0));
  const RelativeFlight<double> rest{{0, 0, 0.5}, {0, 0, 0}, {0, 0, 0}, h};
  CHECK(!timeOfImpact<double>(rest, n, 0.5, 0.0));
  const RelativeFlight<double> late{{0, 0, 5.5}, {0, 0, -4.9}, {0, 0, 0}, h};
  CHECK(!timeOfImpact<double>(late, n, 0.5, 0.0));
}

// Seen to fail without a bound to what counts as closed (from 4096 radii on in single precision), and without
// what places are rounded by.
TEMPLATE_TEST_CASE("A gap within the rounding of places is closed, and none that counts as apart", "", float,
                   double) {
  using S = TestType;
  const S apart = S(1) / S(1000);
  for (const S far : {S(64), S(4096), S(1e9), S(1) / Eigen::NumTraits<S>::epsilon()}) {
    for (const bool isWall : {false, true}) {
      CAPTURE(far, isWall);
      const auto touch = [&](const S& gap) {
        const RelativeFlight<S> flight{
            {S(0), S(0), S(1) + gap}, {S(0), S(0), S(-1)}, {S(0), S(0), S(0)}, S(1) / S(8), far};
        return isWall ? timeOfImpact<S>(flight, Vector3<S>(S(0), S(0), S(1)), S(1), S(0))
                      : timeOfImpact<S>(flight, S(1), S(0));
      };
      CHECK(touch(std::min<S>(S(4) * Eigen::NumTraits<S>::epsilon() * far, apart / S(8))) == S(0));
      CHECK(touch(apart) > apart / S(2));
    }
  }
}
