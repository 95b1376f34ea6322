#include "laws/laws.hpp"
#include "scenes/gas.hpp"
#include "support/catch.hpp"
#include "support/temporary_file.hpp"
#include "support/threads.hpp"
#include <gravel/core/random.hpp>

#include <algorithm>
#include <array>

// The user's own outcome of collisions.

using namespace gravel;
using namespace gravel::test;

namespace {

using Outcome = CollisionOutcome<double>;
using Hit = Collision<double>;

Outcome mergeAll(const Hit&) { return Outcome::merge(); }

SimulationConfig<double> bouncy(double dt) {
  SimulationConfig<double> config = plain(dt);
  config.coeffRestitution = 0.5;
  config.coeffFriction = config.coeffStaticFriction = 0.3;
  return config;
}

}  // namespace

// As of a giant planet in float. Seen to fail: refused in the middle of the step, for a spin that is no
// number.
TEST_CASE("What has a moment of inertia beyond the range of its numbers merges by the factors") {
  Space<double> space(bouncy(1e-3));
  space.addBody(ball({0, 0, 0}, {0, 0, 0}, 1e60, 1e200));
  space.addBody(ball({1.99e60, 0, 0}, {-1, 0, 0}, 1e60, 3e200, {0, 0, 1e-60}));
  space.body(0).inertiaFactor() = 0.3;
  space.body(1).inertiaFactor() = 0.2;
  space.setCollisionHook(mergeAll);
  space.computeDynamics(0);
  REQUIRE(space.n() == 1);
  CHECK_THAT(space.body(0).inertiaFactor(), WithinRel(0.225, 1e-14));
  CHECK_THAT(space.body(0).velocity()[0], WithinRel(-0.75, 1e-14));
  const double ratio = space.body(0).radius() / 1e60;  // k m r^2 w, by the larger radius
  CHECK_THAT(space.body(0).angularVelocity()[2], WithinRel(0.2 * 0.75e-60 / (0.225 * ratio * ratio), 1e-14));
}

TEST_CASE("A hook is told of each impact once: who, how fast, at which angle and when") {
  for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::Yoshida4}) {
    SimulationConfig<double> config = bouncy(1e-3);
    config.integrator = kind;
    Space<double> space(config);
    // Centres pass at 0.6 = sin(angle) x (radii 1): they meet at distance 0.8 along x.
    const BodyId slow = space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.4, 2.0));
    const BodyId fast = space.addBody(ball({-3.8, 0.6, 0}, {2, 0, 0}, 0.6, 5.0, {0, 0, 7}));
    std::vector<Hit> hits;
    space.setCollisionHook([&](const Hit& hit) {
      hits.push_back(hit);
      return Outcome::bounce();
    });
    Space<double> without(config);
    without.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.4, 2.0));
    without.addBody(ball({-3.8, 0.6, 0}, {2, 0, 0}, 0.6, 5.0, {0, 0, 7}));
    advance(space, 2000);
    advance(without, 2000);
    REQUIRE(hits.size() == 1);
    const Hit& hit = hits[0];
    CHECK(hit.first.id == slow);
    CHECK(hit.second.id == fast);
    CHECK(hit.first.mass == 2.0);
    CHECK(hit.second.radius == 0.6);
    CHECK(hit.second.velocity == Vec(2, 0, 0));
    CHECK(hit.second.angularVelocity == Vec(0, 0, 7));
    CHECK_THAT(hit.time, WithinAbs(1.5, 1e-9));
    CHECK_THAT(hit.sineOfAngle(), WithinAbs(0.6, 1e-9));
    CHECK_THAT(hit.impactSpeed, WithinAbs(1.6, 1e-9));
    CHECK(hit.material.restitution == 0.5);
    // To be asked changes nothing.
    CHECK(sameBits(stateOf(space), stateOf(without)));
  }
}

TEST_CASE("Two that merge keep all that is kept, and the ledger has what they lose") {
  for (const double G : {0.0, 1.0}) {
    for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::Yoshida4}) {
      SimulationConfig<double> config = bouncy(1e-3);
      config.G = G;
      config.integrator = kind;
      Space<double> space(config);
      const BodyId light = space.addBody(ball({-1.5, 0.3, 0}, {1, 0, 0.1}, 0.5, 1.0, {1, 2, 3}));
      const BodyId heavy = space.addBody(ball({0.5, 0, 0}, {-1, 0, 0}, 0.6, 2.0));
      const BodyId bystander = space.addBody(ball({0, 20, 0}, {0, 0, 0}, 0.6, 3.0));
      space.setCollisionHook(mergeAll);
      const ConservedQuantities<double> before = space.conserved();
      const double energy = space.energyLedger().total();
      advance(space, 1000);
      REQUIRE(space.n() == 2);
      CHECK_THROWS_AS(space.body(light), std::out_of_range);
      CHECK(space.body(heavy).mass() == 3.0);
      CHECK_THAT(space.body(heavy).radius(), WithinRel(std::cbrt(0.125 + 0.216), 1e-15));
      CHECK(space.body(bystander).mass() == 3.0);
      const ConservedQuantities<double> after = space.conserved();
      CHECK(after.mass == before.mass);
      CHECK((after.momentum - before.momentum).norm() < 1e-14);
      // Without gravity exact; with it the time of the impact is right to the order of the integrator.
      CHECK((after.angularMomentum - before.angularMomentum).norm() < (G == 0.0 ? 1e-12 : 1e-6));
      CHECK((after.centreOfMass - before.centreOfMass - before.momentum / before.mass).norm() < 1e-12);
      CHECK(space.energyLedger().restitution > 0.5);
      CHECK_THAT(space.energyLedger().total(), WithinAbs(energy, G == 0.0 ? 1e-13 : 1e-5));
      CHECK(space.body(heavy).angularVelocity().norm() > 0.1);
      CHECK(space.addBody(ball({9, 9, 9}, {0, 0, 0}, 0.1)) == BodyId{3});
    }
  }
}

// Four in a cloud that fall onto each other within a step, of which the first two are pressed together by
// those that come later. Seen to fail: all pairs taken apart, by 1e-4 to 2e-2 of the energy.
TEST_CASE("Those that merge in a step are not taken apart before it ends") {
  for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::Yoshida4}) {
    SimulationConfig<double> config = plain(0.02);
    config.G = 1.0;
    config.integrator = kind;
    Space<double> space(config);
    space.addBody(ball({-0.105, 0, 0}, {1, 0, 0}, 0.1, 0.25));
    space.addBody(ball({0.105, 0.02, 0}, {-1, 0, 0}, 0.1, 0.25));
    space.addBody(ball({-0.32, 0.01, 0}, {4, 0, 0}, 0.1, 0.25));
    space.addBody(ball({0.32, 0.03, 0.01}, {-4, 0, 0}, 0.1, 0.25));
    space.setCollisionHook(mergeAll);
    space.computeDynamics(0);
    CHECK(space.n() == 1);
    CHECK(space.energyLedger().correction == 0.0);
  }
}

// Seen to fail: the two that do not merge with each other taken apart, by 1.4e-3 J.
TEST_CASE("Two that overlap, and merge with the same third in a step, are not taken apart before it ends") {
  SimulationConfig<double> config = plain(0.02);
  config.G = 1.0;
  Space<double> space(config);
  space.addBody(ball({-0.0995, 0, 0}, {0.09, -0.02, 0.37}, 0.1, 0.25));
  space.addBody(ball({0.0995, 0, 0}, {-0.31, 0.99, 0.36}, 0.1, 0.25));
  const BodyId third = space.addBody(ball({0.019, 0.394, 0}, {-1.9, -2.4, 0}, 0.3, 0.25));
  space.setCollisionHook(
      [&](const Hit& hit) { return hit.second.id == third ? Outcome::merge() : Outcome::bounce(); });
  space.computeDynamics(0);
  CHECK(space.n() == 1);
  CHECK(space.energyLedger().correction == 0.0);
}

// Two equal ones without spin, that meet at a distance b of their ways: L = m v b/2 goes into the spin of one
// of 2 m and radius 2^(1/3) r, so that what was m v^2/4 becomes L^2/(2 I), more if they graze. Nothing rubs.
// Seen to fail: what their spins gain while they stick to each other until the step ends booked as friction
// (-0.025 J of -0.068 at b = 0.99 d).
TEST_CASE("What two that merge lose of their motion is restitution, also where it is a gain, not friction") {
  for (const double share : {0.0, 0.5, 0.99}) {
    for (const double mu : {0.0, 0.5}) {
      CAPTURE(share, mu);
      SimulationConfig<double> config = plain(0.01);
      config.coeffFriction = config.coeffStaticFriction = mu;
      Space<double> space(config);
      const double r = 0.1, m = 0.5, v = 1.0, b = share * 2 * r;
      space.addBody(ball({-0.3, b / 2, 0}, {v / 2, 0, 0}, r, m));
      space.addBody(ball({0.3, -b / 2, 0}, {-v / 2, 0, 0}, r, m));
      space.setCollisionHook(mergeAll);
      advance(space, 100);
      REQUIRE(space.n() == 1);
      const double L = m * v * b / 2, I = 0.4 * 2 * m * std::cbrt(4.0) * r * r;
      CHECK(space.energyLedger().friction == 0.0);
      CHECK_THAT(space.energyLedger().restitution, WithinAbs(m * v * v / 4 - L * L / (2 * I), 1e-15));
    }
  }
}

namespace {

/// How far the ledger is off at most, where two merge that come near each other in steps of `reach` times
/// their distance when they touch, over their energy of motion then, about 1: head-on to grazing, at all
/// times within the step.
double offOfMergers(double reach) {
  double worst = 0;
  int merged = 0;
  for (int k = 0; k < 200; ++k) {
    SimulationConfig<double> config = plain(0.1 * reach);
    config.G = 1.0;
    Space<double> space(config);
    space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.1, 0.5));
    space.addBody(ball({0.21 + 0.2 * reach * k / 200, 0.01 * (k % 20), 0}, {-2, 0, 0}, 0.1, 0.5));
    space.setCollisionHook(mergeAll);
    const auto before = space.conserved();
    const double start = space.energyLedger().total();
    advance(space, 2);
    if (space.n() == 1) {
      ++merged;
      worst = std::max(worst, std::abs(space.energyLedger().total() - start));
      const auto after = space.conserved();
      CHECK((after.momentum - before.momentum).norm() < 1e-14);
      CHECK((after.angularMomentum - before.angularMomentum).norm() < 1e-14);
    }
  }
  CHECK(merged > 100);  // the others pass each other, or come too late
  return worst;
}

}  // namespace

// Second order in the step, as blows are. Seen to fail: two that merge fly on through each other, and may be
// nearly in one place when they pull each other last (16 and 8e7).
TEST_CASE("What two that merge lose is right to second order, however far they come in a step") {
  const double fine = offOfMergers(0.125);
  const double half = offOfMergers(0.5);
  const double whole = offOfMergers(1.0);
  CAPTURE(fine, half, whole);
  CHECK(half < 0.15);
  CHECK(whole < 0.6);
  CHECK(half > 8 * fine);  // 16 at order 2
  CHECK(half < 64 * fine);
}

// Seen to fail: two that merge take no notice of each other after the first blow, and fly through each other
// when the floor strikes one (4.4 of their 9.3 joules).
TEST_CASE("Two that merge stick to each other when something else strikes one of them in the same step") {
  for (int k = 0; k < 40; ++k) {
    SimulationConfig<double> config = plain(0.05);
    config.G = 1.0;
    config.coeffRestitution = 0.9;
    Space<double> space(config);
    space.addPlane({0, 0, 1}, 0);
    const double later = 0.025 * k / 40;
    space.addBody(ball({0, 0, 0.101 + later}, {0, 0, -1}, 0.1, 0.5));
    space.addBody(ball({0.02, 0, 0.302 + later}, {0, 0, -6}, 0.1, 0.5));
    space.setCollisionHook(mergeAll);
    const double start = space.energyLedger().total();
    advance(space, 2);
    CHECK(space.n() == 1);
    CHECK_THAT(space.energyLedger().total(), WithinAbs(start, 0.15));
  }
}

TEST_CASE("Three in a row that meet in one step become one") {
  Space<double> space(bouncy(0.1));
  space.addBody(ball({-1.05, 0, 0}, {3, 0, 0}, 0.5, 1.0));
  space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.5, 1.0));
  space.addBody(ball({1.05, 0, 0}, {-5, 0, 0}, 0.5, 1.0));
  space.setCollisionHook(mergeAll);
  space.computeDynamics(0);
  REQUIRE(space.n() == 1);
  CHECK(space.body(0).id() == BodyId{1});  // the first to have grown heavier is that of the first impact
  CHECK(space.body(0).mass() == 3.0);
  CHECK_THAT(space.body(0).velocity()[0], WithinRel(-2.0 / 3, 1e-14));
  CHECK(space.contactCount() == 0);
  CHECK(space.contactImpulses().empty());
  CHECK_NOTHROW(space.computeDynamics(1));
}

TEST_CASE("Velocities of the user's own are what the bodies leave with, at the time of the impact") {
  for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::Yoshida4}) {
    SimulationConfig<double> config = bouncy(0.01);
    config.integrator = kind;
    Space<double> space(config);
    space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.5, 1.0));
    space.addBody(ball({-2.004, 0, 0}, {1, 0, 0}, 0.5, 1.0));
    space.setCollisionHook([](const Hit& hit) {
      // They go through each other and begin to spin.
      return Outcome::velocities({1, 0, 2}, {0, 3, 0}, hit.second.velocity - Vec(2, 0, 0), {0, 0, 4});
    });
    const double before = space.energyLedger().total();
    advance(space, 200);
    CHECK(space.body(0).velocity() == Vec(1, 0, 2));
    CHECK(space.body(0).angularVelocity() == Vec(0, 3, 0));
    CHECK(space.body(1).velocity() == Vec(-1, 0, 0));
    CHECK(space.body(1).angularVelocity() == Vec(0, 0, 4));
    CHECK((space.body(0).position() - (2 - 1.004) * Vec(1, 0, 2)).norm() < 1e-9);
    CHECK_THAT(space.energyLedger().total(), WithinRel(before, 1e-13));
    CHECK(space.energyLedger().restitution < -2.0);  // put in
  }
}

// A law of the user's is one of the space's (see LateBlows). Seen to fail: what the acceleration changes
// within the step is made up for where materials decide alone (1.8e-3 of energy in 195 bounces of velocity
// Verlet with steps of 0.01, -1.4 % of it).
TEST_CASE("The elastic law, given by a hook, bounces under gravity as the material does") {
  for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::BlanesMoan6}) {
    std::array<Space<double>, 2> spaces;
    for (std::size_t k = 0; k < 2; ++k) {
      SimulationConfig<double> config = plain(0.01);
      config.G = 1.0;
      config.integrator = kind;
      config.coeffRestitution = 1.0;
      spaces[k] = Space<double>(config);
      spaces[k].addBody(ball({-1, 0, 0}, {0, 0, 0}, 0.5, 0.5));
      spaces[k].addBody(ball({1, 0, 0}, {0, 0, 0}, 0.5, 0.5));
      if (k == 1) {
        spaces[k].setCollisionHook([](const Hit& hit) {
          const Vec half = hit.impactSpeed * hit.normal;  // of equal masses
          return Outcome::velocities(hit.first.velocity - half, hit.first.angularVelocity,
                                     hit.second.velocity + half, hit.second.angularVelocity);
        });
      }
      advance(spaces[k], 10000);  // some twenty bounces
    }
    CHECK((spaces[0].body(0).position() - spaces[1].body(0).position()).norm() < 1e-10);
    CHECK((spaces[0].body(0).velocity() - spaces[1].body(0).velocity()).norm() < 1e-10);
  }
}

// Two grains that meet at a millimetre a second, beside a mass that pulls them, by 4e-5 of their speed until
// the end. Seen to fail: what their approach lacks made up for in proportion to the speed that they are given
// (2.099 and 34 m/s at a hundredth of a second).
TEST_CASE("Velocities of the user's own are what the bodies leave with, however slowly they met") {
  for (const double speed : {1.0, 10.0}) {
    for (const double h : {1e-2, 1e-3}) {
      SimulationConfig<double> config = plain(h);
      config.G = 1.0;
      Space<double> space(config);
      space.addBody(ball({-1e-6, 0, 0}, {5e-4, 0, 0}, 1e-6, 1e-12));
      space.addBody(ball({1e-6 + 9e-6, 0, 0}, {-5e-4, 0, 0}, 1e-6, 1e-12));
      Body<double> mass = ball({0, 0.4, 0}, {0, 0, 0}, 0.01, 1.0);
      mass.fixed = true;
      space.addBody(mass);
      space.setCollisionHook([speed](const Hit&) {
        return Outcome::velocities({-speed, 0, 0}, {0, 0, 0}, {speed, 0, 0}, {0, 0, 0});
      });
      advance(space, static_cast<std::size_t>(std::lround(0.01 / h)));
      const double parting = space.body(1).velocity()[0] - space.body(0).velocity()[0];
      CHECK_THAT(parting, WithinRel(2 * speed, 1e-4));
    }
  }
}

// On the way to each other, and touching already: asked by who deals impacts, and by who solves contacts.
TEST_CASE(
    "What a collision hook says that is no outcome is refused with its body, and a later step goes on") {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const Vec still = Vec::Zero();
  const auto refusal = [&](double distance, const Outcome& outcome, bool fixed) {
    Space<double> space(bouncy(0.01));
    Body<double> one = ball({0, 0, 0}, {0, 0, 0}, 0.5, 1.0);
    one.fixed = fixed;
    space.addBody(one);
    space.addBody(ball({-distance, 0, 0}, {1, 0, 0}, 0.5, 1.0));
    space.setCollisionHook([&](const Hit&) { return outcome; });
    std::string message;
    try {
      advance(space, 1);
    } catch (const std::invalid_argument& error) {
      message = error.what();
    }
    space.setCollisionHook({});
    advance(space, 10);
    CHECK(isFinite(space.body(0).velocity()));
    CHECK(isFinite(space.body(1).velocity()));
    return message;
  };
  for (const double distance : {1.004, 1.0 - 1e-9}) {
    CHECK_THAT(
        refusal(distance, Outcome::velocities({0, none, 0}, still, still, still), false),
        ContainsSubstring("velocity from the collision hook for body 0 is (0, nan, 0); allowed: finite"));
    CHECK_THAT(
        refusal(distance,
                Outcome::velocities(still, still, still, {0, 0, std::numeric_limits<double>::infinity()}),
                false),
        ContainsSubstring("angular velocity from the collision hook for body 1 is (0, 0, inf)"));
    CHECK_THAT(refusal(distance, {.kind = static_cast<CollisionKind>(9)}, false),
               ContainsSubstring("kind of a collision's outcome is 9"));
    // Those of a fixed body count nothing.
    CHECK(
        refusal(distance, Outcome::velocities({none, 0, 0}, {0, none, 0}, {-1, 0, 0}, still), true).empty());
  }
}

// Two that bounce, beside two that merge and then touch a third, with which they merge. Seen to fail: asked
// three times about the first two.
TEST_CASE("Who touches as a step begins is asked about once, however many beside it merge") {
  Space<double> space(plain(1e-3));
  space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.5));
  space.addBody(ball({0.99, 0, 0}, {-1, 0, 0}, 0.5));
  space.addBody(ball({9, 0, 0}, {1, 0, 0}, 0.5));
  space.addBody(ball({9.99, 0, 0}, {-1, 0, 0}, 0.5));
  space.addBody(ball({10.1, 0, 0}, {-9, 0, 0}, 0.5, 1e-3));
  space.body(4).position()[0] += 0.08;  // 1.08 from what 2 and 3 become at 9.495, of radius 0.63
  std::vector<std::pair<std::uint64_t, std::uint64_t>> asked;
  space.setCollisionHook([&](const Hit& hit) {
    asked.emplace_back(toInteger(hit.first.id), toInteger(hit.second.id));
    return asked.back().first == 0 ? Outcome::bounce() : Outcome::merge();
  });
  space.computeDynamics(0);
  CAPTURE(asked.size());
  CHECK(std::count(asked.begin(), asked.end(), std::pair<std::uint64_t, std::uint64_t>(0, 1)) == 1);
  CHECK(space.n() == 3);
}

// Seen to fail: asked twice where the blow is in the second part, and left at a quarter of the speed.
TEST_CASE("Who goes on approaching by a hook's velocities is asked once, however many parts the step has") {
  for (const std::size_t parts : {1U, 2U, 3U}) {
    for (const double apart : {0.51, 0.57}) {  // met after 0.01 and 0.07 of 0.1 s
      SimulationConfig<double> config = plain(0.1);
      config.coeffRestitution = 1;
      config.contactSubsteps = parts;
      Space<double> space(config);
      space.addBody(ball({-apart, 0, 0}, {1, 0, 0}, 0.5));
      space.addBody(ball({apart, 0, 0}, {-1, 0, 0}, 0.5));
      int calls = 0;
      space.setCollisionHook([&](const Hit& hit) {
        ++calls;
        return Outcome::velocities(hit.first.velocity / 2, {0, 0, 0}, hit.second.velocity / 2, {0, 0, 0});
      });
      space.computeDynamics(0);
      CAPTURE(parts, apart);
      CHECK(calls == 1);
      CHECK(Vec(space.body(0).velocity()) == Vec(-0.5, 0, 0));  // and bounce as the material says
      CHECK(Vec(space.body(1).velocity()) == Vec(0.5, 0, 0));
      CHECK_THAT(space.energyLedger().restitution, WithinRel(0.75, 1e-14));
    }
  }
}

// Seen to fail: two about which the hook had decided took no notice of each other for the rest of the step,
// and the light ball flew through the heavy one (35 blows in all, at a hundredth of a second).
TEST_CASE("Who parts with velocities of the user's own and is driven back in the same step meets again") {
  const auto elastic = [](const Hit& hit) {
    const double m1 = hit.first.mass;
    const double m2 = hit.second.mass;
    const Vec blow = 2 * hit.impactSpeed * m1 * m2 / (m1 + m2) * hit.normal;
    Outcome outcome;
    outcome.kind = CollisionKind::Velocities;
    outcome.velocity1 = hit.first.velocity - blow / m1;
    outcome.velocity2 = hit.second.velocity + blow / m2;
    return outcome;
  };
  for (const double dt : {1e-2, 1e-3}) {
    SimulationConfig<double> config = plain(dt);
    config.coeffRestitution = 1.0;
    std::array<Space<double>, 2> spaces{Space<double>(config), Space<double>(config)};
    spaces[1].setCollisionHook(elastic);
    std::array<std::size_t, 2> blows{};
    for (std::size_t k = 0; k < 2; ++k) {
      spaces[k].addPlane({1, 0, 0}, 0.0);
      spaces[k].addBody(ball({1, 0, 0}, {0, 0, 0}, 0.1, 1.0));
      spaces[k].addBody(ball({2, 0, 0}, {-1, 0, 0}, 0.1, 1e4));
      while (spaces[k].time() < 4) {
        spaces[k].computeDynamics(0);
        blows[k] += spaces[k].impacts().size();
      }
    }
    CAPTURE(dt);
    CHECK(blows[0] == blows[1]);
    CHECK(blows[1] >= 313);  // of 314, of which the last comes late
    for (std::size_t i = 0; i < 2; ++i) {
      CHECK((spaces[0].body(i).position() - spaces[1].body(i).position()).norm() < 1e-9);
      CHECK((spaces[0].body(i).velocity() - spaces[1].body(i).velocity()).norm() < 1e-9);
    }
  }
}

// Seen to fail: they were no contact at the step's end, and flew through each other.
TEST_CASE(
    "Two that go on into each other with velocities of the user's own are stopped, and asked about once") {
  Space<double> space(plain(1e-2));
  space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.5));
  space.addBody(ball({1.005, 0, 0}, {-1, 0, 0}, 0.5));
  int asked = 0;
  space.setCollisionHook([&](const Hit& hit) {
    ++asked;
    Outcome outcome;
    outcome.kind = CollisionKind::Velocities;
    outcome.velocity1 = hit.first.velocity;
    outcome.velocity2 = hit.second.velocity;
    return outcome;
  });
  space.computeDynamics(0);
  CHECK(asked == 1);
  CHECK(space.body(0).velocity()[0] <= space.body(1).velocity()[0] + 1e-9);
}

TEST_CASE("What meets a fixed body merges into it") {
  Space<double> space(bouncy(0.01));
  Body<double> wall = ball({0, 0, 0}, {0, 0, 0}, 0.5, 0.1);
  space.addBody(ball({-2, 0, 0}, {1, 0, 0}, 0.5, 1.0));
  wall.fixed = true;
  const BodyId rock = space.addBody(wall);
  space.setCollisionHook(mergeAll);
  const double before = space.energyLedger().total();
  advance(space, 150);
  REQUIRE(space.n() == 1);
  CHECK(space.body(rock).isFixed());
  CHECK(space.body(rock).position() == Vec::Zero());
  CHECK_THAT(space.body(rock).mass(), WithinRel(1.1, 1e-15));
  CHECK_THAT(space.energyLedger().total(), WithinRel(before, 1e-13));
}

// By pairs with all others each costs O(N): so many are booked together, by the ledger's own sums.
TEST_CASE("What hundreds of mergers in one step do to the potential is in the ledger as well") {
  SimulationConfig<double> config = bouncy(1e-6);
  config.G = 1e-2;
  Space<double> space(config);
  for (int i = 0; i < 300; ++i) {
    const Vec x(4.0 * (i % 7), 4.0 * (i / 7 % 7), 4.0 * (i / 49));
    space.addBody(ball(x, {1, 0.3, 0}, 1.0));
    space.addBody(ball(x + Vec(2.0 + 1e-6, 0, 0), {-1, 0, 0}, 1.0));
  }
  space.setCollisionHook(mergeAll);
  const EnergyLedger<double> before = space.energyLedger();
  space.computeDynamics(0);
  REQUIRE(space.n() == 300);
  const EnergyLedger<double> after = space.energyLedger();
  CHECK(std::abs(after.exchange) > 0.01 * std::abs(before.potential));
  CHECK_THAT(after.total(), WithinRel(before.total(), 1e-12));  // what a step of 1e-6 loses, too
}

// Seen to fail: the sums over all want a domain that gravity can have, whether or not it is there.
TEST_CASE("Hundreds merge in one step without gravity in a domain of any length") {
  Space<double> space(bouncy(1e-6));
  space.setDomain(Domain<double>::periodic({500, 0.42, 0.42}));
  for (int i = 0; i < 300; ++i) {
    const Vec x(-158 + 0.9 * i, 0, 0);
    space.addBody(ball(x, {1, 0, 0}, 0.1));
    space.addBody(ball(x + Vec(0.2 + 1e-7, 0, 0), {-1, 0, 0}, 0.1));
  }
  space.setCollisionHook(mergeAll);
  space.computeDynamics(0);
  CHECK(space.n() == 300);
}

// A dense gas in which slow hits merge: several in a step, chains among them. Momentum is kept through all of
// it, threads change no bit, and a restart goes on with the same bits.
TEST_CASE("Many merges: momentum and mass are kept, by any number of threads and through a file") {
  const auto rule = [](const Hit& hit) {
    return hit.impactSpeed < 1.0 ? Outcome::merge() : Outcome::bounce();
  };
  const auto scene = [&] {
    scenes::GasOptions options;
    options.count = 400;
    options.fraction = 0.15;
    options.timeStep = 0.02;
    options.restitution = 0.8;
    Space<double> space = scenes::gasBox(options);
    space.setCollisionHook(rule);
    return space;
  };
  const TemporaryFile file("merges");
  Space<double> one = scene();
  const double energy = one.energyLedger().total();
  std::size_t most = 0;
  for (std::size_t i = 0; i < 60; ++i) {
    const std::size_t before = one.n();
    one.computeDynamics(i);
    most = std::max(most, before - one.n());
    if (i == 29) {
      one.save(file.path());
    }
  }
  CHECK(one.n() < 300);
  CHECK(most > 4);
  CHECK_THAT(one.conserved().mass, WithinRel(400.0, 1e-14));
  CHECK(one.conserved().momentum.norm() < 1e-11);
  CHECK_THAT(one.energyLedger().total(), WithinRel(energy, 1e-12));
  Space<double> again;
  again.setCollisionHook(rule);
  again.restore(file.path());
  advance(again, 30);
  CHECK(sameBits(stateOf(one), stateOf(again)));
  for (const int threads : {2, 3}) {
    const WithThreads guard(threads);
    Space<double> two = scene();
    advance(two, 60);
    CHECK(sameBits(stateOf(one), stateOf(two)));
  }
}

// What touches from the start, or since it was put there, has met nobody on its way. Seen to fail: asked only
// about impacts inside a step and contacts at its end, by then the first half of the step had stopped them.
TEST_CASE(
    "Bodies that touch and approach from the start are decided upon, each pair once, and the ledger closes") {
  for (const double gap : {0.0, -0.01, -0.1}) {
    for (const double G : {0.0, 1.0}) {
      SimulationConfig<double> config = bouncy(1e-3);
      config.G = G;
      Space<double> space(config);
      space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.1, 2.0));
      space.addBody(ball({0.2 + gap, 0, 0}, {-1, 0, 0}, 0.1, 3.0));
      std::size_t asked = 0;
      space.setCollisionHook([&](const Hit& hit) {
        ++asked;
        CHECK(hit.time == 0.0);
        CHECK_THAT(hit.impactSpeed, WithinRel(2.0, 1e-15));
        return Outcome::merge();
      });
      const double before = space.energyLedger().total();
      advance(space, 1);
      CAPTURE(gap, G);
      CHECK(asked == 1);
      REQUIRE(space.n() == 1);
      CHECK_THAT(space.body(0).velocity()[0], WithinAbs(-0.2, 1e-15));
      CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-14 * (10 + 1000 * G)));
    }
  }
}

// Seen to fail: what a step brings counted as rest for those that never rested on each other (at 0.2 and 0.1
// the third was pushed out and stayed two for ever; of those put there the deep ones and the slow ones).
TEST_CASE("Who touches somebody for the first time is decided upon, however long the step") {
  SECTION("one that two become, and a third that it grows into") {
    for (const double h : {0.2, 0.1, 0.05, 0.01}) {
      for (const std::size_t parts : {1U, 4U}) {
        SimulationConfig<double> config = bouncy(h);
        config.G = 1.0;
        config.contactSubsteps = parts;
        Space<double> space(config);
        space.addBody(ball({-1.11, 0, 0}, {1, 0, 0}, 1.0));
        space.addBody(ball({1.11, 0, 0}, {-1, 0, 0}, 1.0));
        space.addBody(ball({0, 2.1, 0}, {0, -0.01, 0}, 1.0));
        int asked = 0;
        space.setCollisionHook([&](const Hit&) {
          ++asked;
          return Outcome::merge();
        });
        space.advanceTo(1.0);
        CAPTURE(h, parts);
        CHECK(asked == 2);
        CHECK(space.n() == 1);
        CHECK(space.energyLedger().correction == 0.0);
      }
    }
  }
  SECTION("two that are put there") {
    for (const double overlap : {1e-6, 0.1}) {
      for (const double speed : {0.005, 0.1}) {
        for (const double h : {0.1, 0.001}) {
          SimulationConfig<double> config = bouncy(h);
          config.G = 1.0;  // 0.1 m/s in the longer step
          Space<double> space(config);
          space.addBody(ball({0, 0, 0}, {0, 0, 0}, 1.0));
          space.addBody(ball({2 - overlap, 0, 0}, {-speed, 0, 0}, 1.0));
          std::vector<double> speeds;
          space.setCollisionHook([&](const Hit& hit) {
            speeds.push_back(hit.impactSpeed);
            return Outcome::merge();
          });
          advance(space, 2);
          CAPTURE(overlap, speed, h);
          CHECK(speeds == std::vector<double>{speed});
          CHECK(space.n() == 1);
        }
      }
    }
  }
}

// Held by its own gravity; one of them is put elsewhere by rounding, so that each step begins anew.
TEST_CASE("What rests in a pile in space is nobody's decision, also where a user moves it a little") {
  SimulationConfig<double> config = bouncy(0.02);
  config.G = 1.0;
  Space<double> space(config);
  const CounterRandom random(5);
  for (std::uint64_t i = 0; i < 60; ++i) {
    const Vec x(random.uniform(3 * i, -1, 1), random.uniform(3 * i + 1, -1, 1),
                random.uniform(3 * i + 2, -1, 1));
    space.addBody(ball(3 * x, {0, 0, 0}, 0.3 + 0.2 * std::abs(x[0]), 0.1));
  }
  space.advanceTo(40);
  int asked = 0;
  space.setCollisionHook([&](const Hit&) {
    ++asked;
    return Outcome::bounce();
  });
  for (std::size_t i = 0; i < 100; ++i) {
    space.body(i % 60).position()[0] += 1e-12;
    space.computeDynamics(i);
  }
  CHECK(space.contactCount() > 100);
  CHECK(asked == 0);
}

// Seen to fail: asked once, and the contact solver stopped them at the next call as bodies that rest.
TEST_CASE("A hook that throws is asked again about those that touch before a step has moved anything") {
  for (const std::size_t failures : {1U, 3U}) {
    Space<double> space(bouncy(1e-3));
    space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.1, 2.0));
    space.addBody(ball({0.19, 0, 0}, {-1, 0, 0}, 0.1, 3.0));
    std::size_t asked = 0;
    space.setCollisionHook([&](const Hit& hit) {
      CHECK_THAT(hit.impactSpeed, WithinRel(2.0, 1e-15));
      if (++asked <= failures) {
        throw std::runtime_error("not now");
      }
      return Outcome::merge();
    });
    for (std::size_t k = 0; k < failures; ++k) {
      CHECK_THROWS_WITH(space.computeDynamics(0), ContainsSubstring("not now"));
      CHECK(space.body(0).velocity() == Vec(1, 0, 0));
      CHECK(space.body(1).position() == Vec(0.19, 0, 0));
    }
    advance(space, 1);
    CHECK(asked == failures + 1);
    REQUIRE(space.n() == 1);
    CHECK_THAT(space.body(0).velocity()[0], WithinAbs(-0.2, 1e-15));
  }
}

// Seen to fail: a merger anywhere emptied every report of its step; impacts() of earlier parts named indices
// from before it; in a step of parts all contacts were forgotten, so that what rests fell for a part of the
// step.
TEST_CASE("A merger leaves what others did in its step to the reports, and what rests at rest") {
  for (const std::size_t parts : {1U, 3U, 4U}) {
    SimulationConfig<double> config = bouncy(1e-2);
    if (parts == 3) {
      config.integrator = IntegratorKind::Yoshida4;  // three evaluations of forces
    } else {
      config.contactSubsteps = parts;
    }
    Space<double> space(config);
    space.setUniformField({0, 0, -9.8});
    const std::size_t floor = space.addPlane({0, 0, 1}, 0.0);
    // The merger's partner that goes moves the last body, which rests: indices are others afterwards.
    const BodyId stays = space.addBody(ball({5, 0, 3}, {0, 0, 2}, 0.1, 2.0));
    const BodyId goes = space.addBody(ball({5, 0, 3.213}, {0, 0, 0}, 0.1));
    const BodyId below = space.addBody(ball({8, 0, 3}, {0, 0, 2}, 0.1));
    const BodyId above = space.addBody(ball({8, 0, 3.212}, {0, 0, 0}, 0.1));
    const BodyId rests = space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5, 3.0));
    space.setCollisionHook(
        [&](const Hit& hit) { return hit.first.id == stays ? Outcome::merge() : Outcome::bounce(); });
    CAPTURE(parts);
    advance(space, 1);
    REQUIRE(space.n() == 4);
    CHECK_THROWS_AS(space.body(goes), std::out_of_range);
    const Space<double>& seen = space;
    REQUIRE(seen.contacts().size() == 1);
    CHECK(seen.body(seen.contacts()[0].first).id() == rests);
    CHECK(seen.contactCount() == 2);
    CHECK_THAT(seen.planeForce(floor)[2], WithinRel(-3 * 9.8, 1e-9));
    CHECK_THAT(seen.supportedWeight().load[2], WithinRel(-3 * 9.8, 1e-9));
    CHECK_THAT(seen.contactImpulses()[0].normal, WithinRel(3 * 9.8 * 1e-2, 1e-9));
    REQUIRE(seen.impacts().size() == 1);
    CHECK(seen.body(seen.impacts()[0].first).id() == below);
    CHECK(seen.body(seen.impacts()[0].second).id() == above);
    const auto graph = seen.collisionGraph();
    CHECK(graph[seen.bodies().indexOf(below)] == std::vector<std::size_t>{seen.bodies().indexOf(above)});
    // Nobody takes notice of what is far away.
    CHECK(seen.body(rests).position() == Vec(0, 0, 0.5));
    CHECK(seen.body(rests).velocity() == Vec::Zero());
    // A restart tells the same.
    const TemporaryFile file("merger");
    space.save(file.path());
    Space<double> again;
    again.restore(file.path());
    REQUIRE(again.contacts().size() == 1);
    CHECK(again.body(again.contacts()[0].first).id() == rests);
    advance(space, 5);
    advance(again, 5);
    CHECK(sameBits(stateOf(space), stateOf(again)));
  }
}

// A ball that lies on the floor takes up another one. Seen to fail: the floor bore nothing in that step.
TEST_CASE("What takes up another goes on pressing on what bears it, and falls asleep after its own time") {
  SimulationConfig<double> config = bouncy(1e-2);
  config.sleepSpeed = 0.05;
  config.sleepTime = 0.1;
  Space<double> space(config);
  space.setUniformField({0, 0, -9.8});
  const std::size_t floor = space.addPlane({0, 0, 1}, 0.0);
  const BodyId grain = space.addBody(ball({0, 0, 1.2}, {0, 0, 0}, 0.01, 1e-6));
  const BodyId lies = space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5, 3.0));
  space.setCollisionHook([](const Hit&) { return Outcome::merge(); });
  std::size_t merger = 0;
  for (std::size_t i = 1; i < 100; ++i) {
    const std::size_t before = space.n();
    space.body(lies).velocity()[0] += 1e-9;  // nobody sleeps until then
    advance(space, 1);
    CHECK_THAT(space.planeForce(floor)[2], WithinRel(-3 * 9.8, 1e-3));
    if (space.n() < before) {
      merger = i;
      break;
    }
  }
  REQUIRE(merger > 15);
  CHECK_THROWS_AS(space.body(grain), std::out_of_range);
  CHECK(space.contacts().size() == 1);
  CHECK(space.impacts().empty());
  std::size_t awake = 0;
  while (awake < 50 && !space.body(lies).isAsleep()) {
    advance(space, 1);
    ++awake;
  }
  CHECK(awake >= 10);
  CHECK(awake < 13);
  CHECK_THAT(space.planeForce(floor)[2], WithinRel(-3 * 9.8, 1e-3));
}

// Seen to fail: the hook was told that the sleeper is fixed, and the sleeper never got its velocity.
TEST_CASE("A sleeper that something is put into counts as the movable body that it is") {
  for (const double sleepSpeed : {0.0, 0.01}) {
    SimulationConfig<double> config = plain(1e-2);
    config.sleepSpeed = sleepSpeed;
    config.sleepTime = 0.25;
    Space<double> space(config);
    space.setUniformField({0, 0, -9.8});
    space.addPlane({0, 0, 1}, 0.0);
    const BodyId rests = space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
    advance(space, 60);
    REQUIRE(space.body(rests).isAsleep() == (sleepSpeed > 0));
    std::size_t hits = 0;
    space.setCollisionHook([&](const Hit& hit) {
      ++hits;
      CHECK_FALSE((hit.first.fixed || hit.second.fixed));
      return Outcome::velocities(hit.second.velocity, {0, 0, 0}, hit.first.velocity, {0, 0, 0});
    });
    const BodyId comes = space.addBody(ball({1 - 1e-9, 0, 0.5}, {-1, 0, 0}, 0.5));
    advance(space, 1);
    CHECK(hits == 1);
    CHECK_THAT(space.body(rests).velocity()[0], WithinRel(-1.0, 1e-12));
    CHECK_THAT(space.body(comes).velocity()[0], WithinAbs(0.0, 1e-12));
  }
}

TEST_CASE("Bodies that touch and part, or rest on each other, are nobody's decision") {
  Space<double> space(bouncy(1e-3));
  space.addBody(ball({0, 0, 0}, {-1, 0, 0}, 0.1, 2.0));
  space.addBody(ball({0.2, 0, 0}, {1, 0, 0}, 0.1, 3.0));
  space.addBody(ball({0, 1, 0}, {0, 0, 0}, 0.1, 2.0));
  space.addBody(ball({0.2, 1, 0}, {0, 0, 0}, 0.1, 3.0));
  space.setCollisionHook(mergeAll);
  advance(space, 3);
  CHECK(space.n() == 4);
}

// In a heap relative accelerations vanish. Seen to fail: no more than what these bring in a step is rest
// (pyramid and heap were one body after a second); the whole fall, along a table as well.
TEST_CASE("What rests in a heap, or in a field that turns, is nobody's decision") {
  const double g = 9.81;
  SimulationConfig<double> config = bouncy(1.0 / 240);
  config.coeffRestitution = 0.3;
  config.coeffFriction = config.coeffStaticFriction = 0.5;
  config.rollingFriction = config.spinningFriction = 0.05;
  SECTION("a pyramid") {
    Space<double> space(config);
    space.setUniformField({0, 0, -g});
    space.addPlane({0, 0, 1}, 0);
    for (int layer = 0; layer < 3; ++layer) {
      for (int i = 0; i < 3 - layer; ++i) {
        for (int j = 0; j < 3 - layer; ++j) {
          space.addBody(
              ball({i + layer / 2.0, j + layer / 2.0, 0.5 + layer * std::sqrt(0.5)}, {0, 0, 0}, 0.5));
        }
      }
    }
    advance(space, 200);
    space.setCollisionHook(mergeAll);
    advance(space, 240);
    CHECK(space.n() == 14);
    // A ball that falls on it is not at rest.
    space.addBody(ball({1, 1, 3}, {0, 0, -1}, 0.3));
    advance(space, 120);
    CHECK(space.n() < 15);
  }
  SECTION("a heap that fell") {
    Space<double> space(config);
    space.setUniformField({0, 0, -g});
    space.addBox({-1.5, -1.5, 0}, {1.5, 1.5, 20}, defaultMaterial, BoxFaces::HighZ);
    const CounterRandom random(2);
    for (std::uint64_t i = 0; i < 40; ++i) {
      space.addBody(ball({random.uniform(3 * i, -1, 1), random.uniform(3 * i + 1, -1, 1),
                          0.5 + 0.5 * static_cast<double>(i)},
                         {0, 0, 0}, random.uniform(3 * i + 2, 0.3, 0.45)));
    }
    advance(space, 3600);
    space.setCollisionHook(mergeAll);
    advance(space, 240);
    CHECK(space.n() == 40);
  }
  SECTION("a stack whose field turns") {
    Space<double> space(config);
    space.addPlane({0, 0, 1}, 0);
    space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
    space.addBody(ball({0, 0, 1.5}, {0, 0, 0}, 0.5));
    space.setCollisionHook(mergeAll);
    for (std::size_t i = 0; i < 240; ++i) {
      const double angle = 0.01 * space.time();
      space.setUniformField({g * std::sin(angle), 0, -g * std::cos(angle)});
      space.computeDynamics(i);
    }
    CHECK(space.n() == 2);
  }
  SECTION("a row that a field presses to a wall") {
    Space<double> space(config);
    space.setUniformField({-3, 0, -g});
    space.addPlane({0, 0, 1}, 0);
    space.addPlane({1, 0, 0}, 0);
    space.addBody(ball({0.5, 0, 0.5}, {0, 0, 0}, 0.5));
    space.addBody(ball({1.5, 0, 0.5}, {0, 0, 0}, 0.5));
    space.setCollisionHook(mergeAll);
    advance(space, 240);
    CHECK(space.n() == 2);
  }
  SECTION("but one that rolls along the floor against another that it touches is") {
    config.timeStep = 1.0 / 60;  // of which g h = 0.16 m/s
    Space<double> space(config);
    space.setUniformField({0, 0, -g});
    space.addPlane({0, 0, 1}, 0);
    space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
    space.addBody(ball({1, 0, 0.5}, {0, 0, 0}, 0.5));
    advance(space, 30);
    space.setCollisionHook(mergeAll);
    advance(space, 30);
    REQUIRE(space.n() == 2);
    space.body(0).position()[0] += 1e-9;  // contacts are found anew
    space.body(0).velocity() = Vec(0.1, 0, 0);
    space.computeDynamics(0);
    CHECK(space.n() == 1);
  }
  SECTION("and so is one in a pyramid that is driven into another") {
    config.timeStep = 1.0 / 240;
    Space<double> space(config);
    space.setUniformField({0, 0, -g});
    space.addPlane({0, 0, 1}, 0);
    for (const double angle : {0.0, 2.1, 4.2}) {
      space.addBody(ball({0.58 * std::cos(angle), 0.58 * std::sin(angle), 0.5}, {0, 0, 0}, 0.5));
    }
    space.addBody(ball({0, 0, 0.5 + std::sqrt(2.0 / 3)}, {0, 0, 0}, 0.5));
    advance(space, 240);
    space.setCollisionHook(mergeAll);
    advance(space, 30);
    REQUIRE(space.n() == 4);
    space.body(3).position()[2] -= 1e-9;
    space.body(3).velocity() = Vec(0, 0, -0.5);
    space.computeDynamics(0);
    CHECK(space.n() < 4);
  }
}
