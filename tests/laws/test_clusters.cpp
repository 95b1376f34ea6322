#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"

#include <algorithm>

// Many points under their own gravity: a cluster in equilibrium, and one that falls together.

using namespace gravel;
using namespace gravel::test;

namespace {

/// Distance from the origin within which half of all points are.
double halfMassRadius(const Space<double>& space) {
  std::vector<double> r(space.n());
  for (std::size_t i = 0; i < space.n(); ++i) {
    r[i] = space.body(i).position().norm();
  }
  std::nth_element(r.begin(), r.begin() + static_cast<std::ptrdiff_t>(r.size() / 2), r.end());
  return r[r.size() / 2];
}

/// Points softened by a/50, in steps of 1/64.
Space<double> cluster(std::uint64_t seed) {
  SimulationConfig<double> config = plain(1.0 / 64);
  config.G = 1.0;
  config.softening = 1.0 / 50;
  config.gravityTolerance = 5e-3;
  Space<double> space(config);
  for (const Body<double>& body : scenes::plummerSphere<double>(4096, seed)) {
    space.addBody(body);
  }
  return space;
}

}  // namespace

// With a = M = G = 1: W = -3 pi/32, 2 T/|W| = 1, half of the mass within 1.30477. From sphere to sphere
// of 4096 points W spreads by 1.7 %, T by 1.8 and the radius by 1.9: bounds are four times that, over the
// root of 16. Softening takes 1e-3 off W.
TEST_CASE("Plummer spheres have the energies and the half-mass radius of the model") {
  constexpr int samples = 16;
  double W = 0.0;
  double T = 0.0;
  double half = 0.0;
  for (int seed = 1; seed <= samples; ++seed) {
    const Space<double> space = cluster(static_cast<std::uint64_t>(seed));
    const auto [kinetic, rotational, potential] = space.calculateSystemEnergy();
    CHECK(rotational == 0.0);
    W += potential / samples;
    T += kinetic / samples;
    half += halfMassRadius(space) / samples;
  }
  CHECK_THAT(W, WithinRel(-3 * pi<double>() / 32, 0.018));
  CHECK_THAT(T, WithinRel(3 * pi<double>() / 64, 0.018));
  CHECK_THAT(half, WithinRel(1.30477, 0.019));
}

// The time in which a point at the rms speed of 0.543 crosses a is 1.84. The error is that of the
// step where stars pass each other within the softening of a/50. Seen to fail: steps of 1/16 (2.5e-3).
TEST_CASE("A Plummer sphere keeps its energy to 1e-4, and its equilibrium, for ten crossing times") {
  Space<double> space = cluster(2);
  const auto [kinetic, rotational, potential] = space.calculateSystemEnergy();
  const double energy = kinetic + potential;
  double worst = 0.0;
  double ratio = 0.0;
  for (int look = 1; look <= 10; ++look) {
    space.advanceTo(1.84 * look);
    const auto [T, R, U] = space.calculateSystemEnergy();
    worst = std::max(worst, std::abs((T + U) / energy - 1));
    ratio += -2 * T / U / 10;
  }
  CAPTURE(worst, ratio, halfMassRadius(space));
  CHECK(worst < 1e-4);
  CHECK(worst > 1e-7);  // there is an error of the step
  CHECK_THAT(ratio, WithinAbs(1.0, 0.02));
  CHECK_THAT(halfMassRadius(space), WithinRel(1.30477, 0.08));
}

// A homogeneous sphere at rest falls together in t_ff = (pi/2) sqrt(R^3 / (2 G M)), all shells
// alike: r/R = cos^2 b, b + sin(2 b)/2 = t sqrt(2 G M / R^3). Points on a lattice are pulled by none of their
// neighbours but at the surface, which is rough by a part in N^(2/3) = 258 of the mass: that in t_ff is
// (2/3)/(1 - t/t_ff) times as much of the radius; bounds at twice that. Seen to fail: a softening of 0.1.
TEST_CASE("A cold sphere falls together in its free-fall time, all shells alike") {
  SimulationConfig<double> config = plain(1.0 / 256);
  config.G = 1.0;
  config.softening = 1e-3;
  config.gravityTolerance = 1e-3;
  Space<double> space(config);
  constexpr double apart = 0.1;
  constexpr int most = 10;
  for (int i = -most; i <= most; ++i) {
    for (int j = -most; j <= most; ++j) {
      for (int k = -most; k <= most; ++k) {
        const Vec x = apart * Vec(i, j, k);
        if (x.norm() < 1.0) {
          space.addBody(ball(x, {0, 0, 0}, 0.0));
        }
      }
    }
  }
  const auto n = static_cast<double>(space.n());
  double start[3] = {0, 0, 0};
  std::vector<std::size_t> shell(space.n());
  for (std::size_t i = 0; i < space.n(); ++i) {
    space.body(i).mass() = 1.0 / n;
    const double r = space.body(i).position().norm();
    shell[i] = r < 0.4 ? 0 : r < 0.8 ? 1 : 2;
    start[shell[i]] += r;
  }
  const double cube = n * apart * apart * apart * 3 / (4 * pi<double>());  // R^3 of that mass
  const double rate = std::sqrt(2.0 / cube);
  for (const double share : {0.5, 0.8, 0.95}) {
    const double t = share * pi<double>() / 2 / rate;
    space.advanceTo(t);
    double b = 0.0;
    for (double step = 1.0; step > 1e-15; step /= 2) {
      b += b + step + std::sin(2 * (b + step)) / 2 <= t * rate ? step : 0.0;
    }
    const double expected = std::cos(b) * std::cos(b);
    double now[3] = {0, 0, 0};
    for (std::size_t i = 0; i < space.n(); ++i) {
      now[shell[i]] += space.body(i).position().norm();
    }
    for (int k = 0; k < 3; ++k) {
      CAPTURE(share, k, expected, now[k] / start[k]);
      CHECK_THAT(now[k] / start[k], WithinRel(expected, 2.0 / 258 * (2.0 / 3) / (1 - share)));
    }
  }
}
