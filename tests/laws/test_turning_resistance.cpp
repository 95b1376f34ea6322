#include "laws/laws.hpp"
#include "support/catch.hpp"
#include <gravel/core/random.hpp>

#include <array>
#include <cmath>

// Resistance to rolling and spinning: closed forms of a sphere on a plane.

using namespace gravel;
using namespace gravel::test;

namespace test_turning_resistance {

namespace {

constexpr double g = 9.81;

Space<double> onPlane(double slope, double mu, double rolling, double spinning, double dt, const Vec& v,
                      const Vec& w, double inertiaFactor = 0.4) {
  SimulationConfig<double> config = plain(dt);
  config.coeffRestitution = 0;
  config.coeffFriction = config.coeffStaticFriction = mu;
  config.rollingFriction = rolling;
  config.spinningFriction = spinning;
  Space<double> space(config);
  space.setUniformField({g * std::sin(slope), 0, -g * std::cos(slope)});
  space.addPlane({0, 0, 1}, 0);
  Body<double> body = ball({0, 0, 0.5}, v, 0.5, 2.0, w);
  body.inertia = inertiaFactor * 2.0 * 0.25;
  space.addBody(body);
  return space;
}

}  // namespace

// R* = r1 r2/(r1 + r2) is zero beside a point: it resists no rolling. It was taken for a wall, which does.
TEST_CASE("Beside a point nothing resists rolling, and angular momentum is kept") {
  SimulationConfig<double> config = plain(0.01);
  config.rollingFriction = 0.05;
  config.positionalCorrectionFactor = 0;
  Space<double> space(config);
  space.addBody(ball({0, 0.4, 0}, {0, -0.02, 0}, 0.5, 1, {0, 0, 1}));
  space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0, 1));
  const Vec before = space.conserved().angularMomentum;
  advance(space, 3);
  CHECK((Vec(space.conserved().angularMomentum) - before).norm() < 1e-16);
  CHECK(Vec(space.body(0).angularVelocity()) == Vec(0, 0, 1));
}

TEST_CASE("On an incline a sphere stays while the tangent is below the rolling coefficient, else rolls") {
  const double mu_r = 0.1;
  for (const double part : {0.5, 0.98, 1.02, 2.0}) {
    const double slope = std::atan(part * mu_r);
    Space<double> space = onPlane(slope, 1.0, mu_r, 0, 1e-3, {0, 0, 0}, {0, 0, 0});
    const double start = space.energyLedger().total();
    advance(space, 1000);
    const double v = space.body(0).velocity()[0];
    CAPTURE(part, v);
    if (part < 1) {
      CHECK(std::abs(v) < 1e-9);
    } else {
      // m a = m g sin - F, I a / R = F R - mu_r R m g cos: a = 5/7 g (sin - mu_r cos)
      CHECK_THAT(v, WithinRel(5.0 / 7 * g * (std::sin(slope) - mu_r * std::cos(slope)), 1e-6));
    }
    CHECK_THAT(space.energyLedger().total(), WithinAbs(start, 1e-9));
  }
}

// Friction and resistance act on one spin. Taken by turns, each round leaves 1/(1 + k) of the rest. Seen to
// fail: 200 rounds at most.
TEST_CASE("On an incline a ball of any moment of inertia stays, or rolls as fast as it must") {
  for (const double k : {1e-4, 0.01, 0.1, 0.4, 2.0 / 3}) {
    for (const double part : {0.5, 0.99, 1.01, 1.5}) {
      const double mu_r = 0.3;
      const double slope = std::atan(part * mu_r);
      Space<double> space = onPlane(slope, 0.6, mu_r, 0, 0.01, {0, 0, 0}, {0, 0, 0}, k);
      advance(space, 200);
      const double v = space.body(0).velocity()[0];
      CAPTURE(k, part, v);
      if (part < 1) {
        CHECK(std::abs(v) < 1e-14);
      } else {
        CHECK_THAT(v, WithinRel(2 * g * (std::sin(slope) - mu_r * std::cos(slope)) / (1 + k), 1e-9));
      }
    }
  }
}

// Seen to fail: both at their limits only by turns, which end too early (k = 0.003: 1.346 m/s for 1.342).
TEST_CASE("On an incline a ball slides and turns as both limits let it, whatever its moment of inertia") {
  const double mu = 0.3;
  const double slope = std::atan(0.45);
  for (const double k : {1e-3, 0.003, 0.02, 0.4}) {
    for (const double part : {0.9, 0.999}) {
      Space<double> space = onPlane(slope, mu, part * mu, 0, 0.01, {0, 0, 0}, {0, 0, 0}, k);
      advance(space, 100);
      // It slides if rolling, at a = g (sin - mu_r cos)/(1 + k), asks for more friction: g sin - a > mu g
      // cos.
      const double rolling = g * (std::sin(slope) - part * mu * std::cos(slope)) / (1 + k);
      const double sliding = g * (std::sin(slope) - mu * std::cos(slope));
      const bool slides = rolling < sliding || g * std::sin(slope) - rolling > mu * g * std::cos(slope);
      const double turning = (1 - part) * mu * g * std::cos(slope) / k;
      CAPTURE(k, part, slides);
      CHECK_THAT(space.body(0).velocity()[0], WithinRel(slides ? sliding : rolling, 1e-9));
      CHECK_THAT(0.5 * space.body(0).angularVelocity()[1], WithinRel(slides ? turning : rolling, 1e-9));
    }
  }
}

// Seen to fail: friction and then resistance, once each, which leaves a slip of 1/(1 + k).
TEST_CASE("A blow that both friction and resistance could stop leaves neither slip nor turn") {
  for (const double k : {1e-4, 0.1, 0.4, 2.0 / 3}) {
    for (const bool onBall : {false, true}) {
      SimulationConfig<double> config = plain(0.01);
      config.coeffRestitution = 0.5;
      config.coeffFriction = config.coeffStaticFriction = 5;
      config.rollingFriction = 50;
      Space<double> space(config);
      Body<double> body = ball({0, 0, 0.505}, {1, 0, -1}, 0.5, 2.0);
      body.inertia = k * 2.0 * 0.25;
      space.addBody(body);
      if (onBall) {
        Body<double> fixed = ball({0, 0, -1.0}, {0, 0, 0}, 1.0);
        fixed.fixed = true;
        space.addBody(fixed);
        space.body(0).position()[0] = -0.005;  // above the other when they meet
      } else {
        space.addPlane({0, 0, 1}, 0);
      }
      space.computeDynamics(0);
      REQUIRE(space.impacts().size() == 1);
      const Vec v = space.body(0).velocity();
      CAPTURE(k, onBall, v[0], space.body(0).angularVelocity()[1]);
      CHECK(std::abs(v[0]) < 1e-14);
      CHECK(Vec(space.body(0).angularVelocity()).norm() < 1e-15 / k);
      CHECK_THAT(v[2], WithinRel(0.5, 1e-14));
    }
  }
}

// Seen to fail: a slip that is flung back while the turn is stopped, as if nothing coupled them; the turn
// reckoned with friction that knows no limit.
TEST_CASE("A blow of bodies that touch already is the one of bodies that meet in the step") {
  const CounterRandom random(12);
  std::uint64_t counter = 0;
  const auto any = [&] { return random.uniform(counter++, -1, 1); };
  for (std::size_t blow = 0; blow < 480; ++blow) {
    SimulationConfig<double> config = plain(0.01);
    config.coeffRestitution = 0.8;
    config.coeffFriction = std::array{0.1, 0.3, 100.0}[blow / 40 % 3];
    config.coeffStaticFriction = std::array{1.0, 1.5}[blow / 120 % 2] * config.coeffFriction;
    config.rollingFriction = std::array{0.0, 0.01, 0.1, 100.0}[blow % 4];
    config.tangentialRestitution = std::array{0.0, 0.5, 1.0}[blow % 3];
    const Vec v(any(), any(), -1);
    const Vec w(any(), any(), any());
    const auto end = [&](bool meets) {
      Space<double> space(config);
      space.addPlane({0, 0, 1}, 0);
      space.addBody(ball({0, 0, meets ? 0.505 : 0.5 - 1e-12}, v, 0.5, 2.0, w));
      space.computeDynamics(0);
      REQUIRE(space.impacts().size() == (meets ? 1 : 0));
      return std::pair(Vec(space.body(0).velocity()), Vec(space.body(0).angularVelocity()));
    };
    const auto [v1, w1] = end(false);
    const auto [v2, w2] = end(true);
    CAPTURE(blow, v1, v2, w1, w2);
    CHECK((v1 - v2).norm() < 1e-13);
    CHECK((w1 - w2).norm() < 1e-13);
  }
}

// All that a blow may do: both stop, one of them is at its limit, or both; with and without a slip that is
// flung back.
TEST_CASE("Blows with friction and resistance keep momentum and never add energy") {
  const CounterRandom random(11);
  std::uint64_t counter = 0;
  const auto any = [&] { return random.uniform(counter++, -1, 1); };
  const auto strength = [&] { return std::pow(10.0, 2 * any()); };
  for (std::size_t blow = 0; blow < 300; ++blow) {
    SimulationConfig<double> config = plain(0.01);
    config.coeffRestitution = 0.5;
    config.coeffFriction = config.coeffStaticFriction = strength();
    config.rollingFriction = strength();
    config.spinningFriction = strength();
    config.tangentialRestitution = std::array{0.0, 0.5, 1.0}[blow % 3];
    Space<double> space(config);
    const double r = strength() / 100;
    Body<double> one = ball({0, 0, -0.5}, {any(), any(), 1}, 0.5, 1, {any(), any(), any()});
    Body<double> two = ball({0, 0, r + 0.001}, {any(), any(), -1}, r, strength(), {any(), any(), any()});
    one.inertia = 0.4 * 0.25 * std::pow(10.0, any() - 1);
    two.inertia = 0.4 * two.mass * r * r * std::pow(10.0, any() - 1);
    space.addBody(one);
    space.addBody(two);
    const auto mechanical = [&] { return space.energyLedger().mechanical(); };
    const auto before = space.conserved();
    const double energy = mechanical();
    space.computeDynamics(0);
    REQUIRE(space.impacts().size() == 1);
    const auto after = space.conserved();
    const double size = 1 + two.mass;
    CHECK((Vec(after.momentum) - Vec(before.momentum)).norm() < 1e-14 * size);
    CHECK((Vec(after.angularMomentum) - Vec(before.angularMomentum)).norm() < 1e-14 * size);
    CHECK(mechanical() < energy);
    CHECK(space.energyLedger().friction > 0);
    CHECK_THAT(space.energyLedger().total(), WithinRel(energy, 1e-13));
  }
}

TEST_CASE("A rolling sphere comes to rest after 7 v^2 / (10 mu_r g), and stays") {
  const double mu_r = 0.05;
  const double v = 1.0;
  const double way = 7 * v * v / (10 * mu_r * g);
  const auto miss = [&](double dt) {
    Space<double> space = onPlane(0, 1.0, mu_r, 0, dt, {v, 0, 0}, {0, v / 0.5, 0});
    space.advanceTo(2.0 * way / v + 0.5);
    CHECK(space.body(0).velocity().norm() < 1e-12);
    CHECK(space.body(0).angularVelocity().norm() < 1e-12);
    return std::abs(space.body(0).position()[0] - way);
  };
  CHECK(miss(1e-3) < 2e-5);  // mu_r g dt^2 and the step in which it stops
}

TEST_CASE("A sphere that spins about the normal stops after 2 w R / (5 mu g), without moving") {
  const double mu = 0.02;
  const double w = 10;
  Space<double> space = onPlane(0, 0.3, 0, mu, 1e-3, {0, 0, 0}, {0, 0, w});
  const double end = 2 * w * 0.5 / (5 * mu * g);
  space.advanceTo(end / 2);
  CHECK_THAT(space.body(0).angularVelocity()[2], WithinRel(w / 2, 1e-3));
  space.advanceTo(end * 1.01);
  CHECK(std::abs(space.body(0).angularVelocity()[2]) < 1e-12);
  CHECK(space.body(0).position().template head<2>().norm() < 1e-15);
  const auto ledger = space.energyLedger();
  CHECK_THAT(ledger.friction, WithinRel(0.5 * 0.4 * 2.0 * 0.25 * w * w, 1e-9));
}

TEST_CASE("In one blow the resistance is bound by its coefficient and takes the energy that it books") {
  for (const double mu : {0.01, 10.0}) {
    SimulationConfig<double> config = plain(1e-2);
    config.coeffRestitution = 0.5;
    config.rollingFriction = mu;
    config.spinningFriction = mu / 2;
    Space<double> space(config);
    space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.5, 1.0, {3, 2, 0}));
    space.addBody(ball({1.001, 0, 0}, {-1, 0, 0}, 0.25, 2.0, {-1, 0, 4}));
    space.body(1).position()[0] = 0.751;
    const double energy = space.energyLedger().total();
    const Vec spin = space.body(1).angularVelocity() - space.body(0).angularVelocity();
    space.computeDynamics(0);
    REQUIRE(space.impacts().size() == 1);
    const Vec l = space.impacts()[0].impulse.turning;
    const double jn = space.impacts()[0].impulse.normal;
    const Vec after = space.body(1).angularVelocity() - space.body(0).angularVelocity();
    CHECK_THAT(space.energyLedger().total(), WithinRel(energy, 1e-14));
    const double across = l.tail<2>().norm();
    if (mu < 1) {
      CHECK_THAT(across, WithinRel(mu * jn, 1e-13));
      CHECK_THAT(std::abs(l[0]), WithinRel(mu / 2 * jn, 1e-13));
      CHECK(after.norm() < spin.norm());
    } else {
      CHECK(after.norm() < 1e-13);
      CHECK(across < mu * jn);
    }
  }
}

// A column of n balls stands across an incline. At a contact below k of them their weight has the moment
// k^2 m g R sin(slope), against which rolling resistance has mu_r (R/2) k m g cos(slope) between two balls
// and twice as much on the incline. So the lowest contact of two balls yields first, at tan(slope) = mu_r/(2
// (n - 1)), and together with the incline for n = 2. At 1 % less balls are off by 1e-7 R, what sweeps leave;
// at 1 % more the column has come down by then. Seen to fail: balls that resist over R, as on a plane.
TEST_CASE("A column across an incline stands up to half the rolling coefficient over the balls above") {
  const double mu_r = 0.6;
  const double R = 0.1;
  for (const int n : {2, 3, 5}) {
    for (const double part : {0.99, 1.01}) {
      const double slope = std::atan(part * mu_r / (2 * (n - 1)));
      SimulationConfig<double> config = plain(4e-3);
      config.coeffRestitution = 0.3;
      config.coeffFriction = config.coeffStaticFriction = 1;
      config.rollingFriction = mu_r;
      Space<double> space(config);
      space.setUniformField({g * std::sin(slope), 0, -g * std::cos(slope)});
      space.addPlane({0, 0, 1}, 0);
      for (int k = 0; k < n; ++k) {
        space.addBody(ball({0, 0, (2 * k + 1) * R}, {0, 0, 0}, R));
      }
      space.advanceTo(2.0);
      const double moved = space.body(static_cast<std::size_t>(n - 1)).position()[0] / R;
      CAPTURE(n, part, moved);
      if (part < 1) {
        CHECK(std::abs(moved) < 1e-5);
      } else {
        CHECK(moved > 1);
      }
    }
  }
}

}  // namespace test_turning_resistance
