#include "laws/laws.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

TEST_CASE("Two spheres that rest on each other by their gravity: N d is G m1 m2 / d") {
  SimulationConfig<double> config = plain(1e-3);
  config.G = 2.0;
  Space<double> space(config);
  space.addBody(ball({5, 0, 0}, {0, 0, 0}, 0.6, 3.0));
  space.addBody(ball({5, 0.8, 0.6}, {0, 0, 0}, 0.4, 1.0));
  advance(space, 200);
  const ContactVirial<double> virial = space.contactVirial();
  CHECK_THAT(virial.contacts, WithinRel(6.0, 1e-9));
  CHECK_THAT(virial.forces, WithinRel(-6.0, 1e-9));
  CHECK(virial.boundaries == 0.0);
  CHECK(virial.residual() < 1e-9);
}

TEST_CASE("Bodies that do not touch: the sum is half the second derivative of sum m x^2") {
  SimulationConfig<double> config = plain(1e-4);
  config.G = 1.0;
  Space<double> space(config);
  space.addBody(ball({0, 0, 0}, {0.3, 7, 0}, 0.0, 2.0));
  space.addBody(ball({1.5, 0, 0.2}, {0, 8, 0.4}, 0.0, 1.0));
  std::vector<double> spread;
  ContactVirial<double> middle;
  for (std::size_t i = 0; i < 3; ++i) {
    space.computeDynamics(i);
    const Vec centre = space.conserved().centreOfMass;
    spread.push_back(2.0 * (space.body(0).position() - centre).squaredNorm() +
                     (space.body(1).position() - centre).squaredNorm());
    middle = i == 1 ? space.contactVirial() : middle;
  }
  const double second = (spread[2] - 2 * spread[1] + spread[0]) / 1e-8;
  // Central difference of numbers near 1 with steps of 1e-4: 4e-16/1e-8.
  CHECK_THAT(middle.sum(), WithinAbs(second / 2, 2e-7));
  CHECK(std::abs(middle.sum()) > 0.1);
  CHECK(middle.contacts == 0.0);
}

// Two balls, one on the floor, the other leaning between it and a fixed ball; friction in every contact.
TEST_CASE("Floors, walls and fixed bodies carry what rests on them, and the virial counts them") {
  SimulationConfig<double> config = plain(1e-3);
  config.coeffFriction = config.coeffStaticFriction = 0.1;  // too little to stand without the wall
  config.coeffRestitution = 0.0;
  Space<double> space(config);
  const double g = 9.81;
  space.setUniformField({0, 0, -g});
  const std::size_t floor = space.addPlane({0, 0, 1}, 0.0);
  const std::size_t wall = space.addPlane({1, 0, 0}, -0.5);
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5, 2.0));
  space.addBody(ball({0.75, 0, 1.2}, {0, 0, 0}, 0.5, 1.0));
  Body<double> fixed = ball({1.5, 0, 0.5}, {0, 0, 0}, 0.5, 7.0);
  fixed.fixed = true;
  space.addBody(fixed);
  advance(space, 3000);
  const SupportedWeight<double> support = space.supportedWeight();
  CHECK(support.weight == Vec(0, 0, -3 * g));
  CHECK(support.residual() < 1e-9);
  CHECK((support.load - support.weight).norm() < 1e-8);  // at rest the forces across cancel as well
  CHECK(space.planeForce(floor)[2] < -2 * g);
  CHECK(space.planeForce(floor)[2] > -3 * g);
  CHECK(space.planeForce(wall)[0] < -0.1);
  CHECK_THROWS_AS(space.planeForce(5), std::out_of_range);
  const ContactVirial<double> virial = space.contactVirial();
  CHECK(virial.contacts > 1.0);
  CHECK(std::abs(virial.boundaries) > 1.0);
  CHECK(virial.residual() < 1e-9);
}

// Seen to fail: what bore a load in the first half of a step, or in a part of it, and was gone at its end did
// not count (4.5e-4 and 1.2e-3 of the weight were missing; now 5e-6 and 2e-5).
TEST_CASE("Over time what presses on floor and walls is the momentum that bodies lose to them") {
  for (const std::size_t parts : {std::size_t(1), std::size_t(4)}) {
    CAPTURE(parts);
    SimulationConfig<double> config = plain(2e-3);
    config.contactSubsteps = parts;
    config.coeffFriction = 0.4;
    config.coeffStaticFriction = 0.5;
    config.coeffRestitution = 0.5;
    Space<double> space(config);
    space.setUniformField({1, 0, -9.81});
    const std::vector<std::size_t> walls = space.addBox({-1, -1, 0}, {1, 1, 50});
    const CounterRandom random(4);
    for (std::uint64_t i = 0; i < 60; ++i) {
      const auto within = [&](std::uint64_t k, double most) {
        return random.uniform(6 * i + k, -most, most);
      };
      const Vec x(within(0, 0.6), within(1, 0.6), 0.2 + 0.3 * static_cast<double>(i));
      space.addBody(ball(x, {within(2, 3), within(3, 3), within(4, 3)}, 0.1 + within(5, 0.03)));
    }
    const Vec before = space.conserved().momentum;
    Vec load = Vec::Zero();
    Vec onWalls = Vec::Zero();
    for (std::size_t i = 0; i < 1500; ++i) {
      space.computeDynamics(i);
      load += 2e-3 * space.supportedWeight().load;
      for (const std::size_t wall : walls) {
        onWalls += 2e-3 * space.planeForce(wall);
      }
    }
    const Vec given = 3 * space.supportedWeight().weight;
    const Vec missing = space.conserved().momentum - before - given + load;
    CHECK(missing.norm() < 1e-4 * given.norm());
    CHECK((onWalls - load).norm() < 1e-9 * given.norm());
  }
}

// Two grains of 2e-9 m at rest on each other by their own gravity, 2e-46 J. Seen to fail in float: 0 as the
// residual of grains that nothing holds apart, and as that of a load that is missing.
TEMPLATE_TEST_CASE("Residuals of dust tell in every scalar whether it is held", "", float, double) {
  using S = TestType;
  Bodies<S> bodies;
  const auto r = static_cast<S>(2e-9);
  const auto m = static_cast<S>(1e-22);
  const auto force = static_cast<S>(6.6743e-11 * 1e-44 / 16e-18);
  for (const int side : {-1, 1}) {
    Body<S> grain;
    grain.position = {S(side) * r, S(0), S(0)};
    grain.radius = r;
    grain.mass = m;
    bodies.add(grain);
    bodies[bodies.size() - 1].force() = Vector3<S>(S(-side) * force, S(0), S(0));
  }
  Contact<S> touch{};
  touch.second = 1;
  touch.normal = {S(1), S(0), S(0)};
  touch.arm1 = touch.arm2 = r;
  const std::vector<Contact<S>> contacts{touch};
  const S h(16);
  const auto residual = [&](double share) {
    const std::vector<ContactImpulse<S>> impulses{
        {static_cast<S>(share) * force * h, Vector3<S>(S(0), S(0), S(0))}};
    return contactVirial<S, SoA>(bodies, contacts, impulses, h).residual();
  };
  CHECK_THAT(residual(0.0), WithinRel(1.0, 1e-6));
  CHECK_THAT(residual(0.5), WithinRel(0.5, 1e-6));
  CHECK(residual(1.0) < 1e-6);
  const auto weight = static_cast<S>(1e-24);
  const SupportedWeight<S> half{{S(0), S(0), weight / S(2)}, {S(0), S(0), weight}};
  CHECK_THAT(half.residual(), WithinRel(0.5, 1e-6));
}

TEST_CASE("Without bodies, steps or a field there is nothing to carry") {
  Space<double> space(plain(1e-3));
  CHECK(space.contactVirial().residual() == 0.0);
  CHECK(space.supportedWeight().residual() == 0.0);
  space.addBody(ball({0, 0, 0}, {0, 0, 0}, 1.0));
  CHECK(space.contactVirial().sum() == 0.0);
}
