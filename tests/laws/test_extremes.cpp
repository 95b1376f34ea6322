#include "laws/laws.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

// A metre is 2^-23 of 1e9 m in steps of 1.2e-7: the overlap is known to that, and so is the normal.
TEST_CASE("Far from the origin a blow is right to the resolution of places there") {
  for (const Vec& centre : {Vec(0, 0, 0), Vec(1e9, 0, 0), Vec(1e9, -1e9, 1e9)}) {
    SimulationConfig<double> config = plain(1e-3);
    config.coeffRestitution = 0.8;
    Space<double> space(config);
    const Vec n = Vec(1, 2, 3).normalized();
    space.addBody(ball(centre - 1.001 * n, n, 1.0));
    space.addBody(ball(centre + 1.001 * n, -n, 1.0));
    advance(space, 10);
    CAPTURE(centre[0]);
    CHECK((space.body(1).velocity() - 0.8 * n).norm() < 1e-6);
    CHECK((space.body(0).velocity() + 0.8 * n).norm() < 1e-6);
  }
}

TEST_CASE("Dust of the smallest numbers collides as anything else") {
  SimulationConfig<double> config = plain(1e-3);
  config.coeffRestitution = 1.0;
  config.epsilon = 0.0;
  for (const double speed : {1.0, 1e-160, 1e-305}) {
    for (const double mass : {1.0, 1e-300}) {
      Space<double> space(config);
      space.addBody(ball({0, 0, 0}, {speed, 0, 0}, 0.5, mass));
      space.addBody(ball({0.9, 0, 0}, {-speed, 0, 0}, 0.5, 3 * mass));
      space.computeDynamics(0);
      CAPTURE(speed, mass);
      CHECK_THAT(space.body(0).velocity()[0] / speed, WithinRel(-2.0, 1e-14));
      CHECK(std::abs(space.body(1).velocity()[0] / speed) < 1e-14);
    }
  }
}

TEST_CASE("Huge and tiny spheres meet: radii a million apart, masses to match") {
  SimulationConfig<double> config = plain(1e-6);
  config.coeffRestitution = 0.5;
  Space<double> space(config);
  space.addBody(ball({0, 0, -1e3}, {0, 0, 0}, 1e3, 1e12));
  space.addBody(ball({0, 0, 1.0000005e-3}, {0, 0, -1}, 1e-3, 1e-6));
  advance(space, 5);
  CHECK_THAT(space.body(1).velocity()[2], WithinRel(0.5, 1e-9));
  CHECK(space.body(0).velocity().norm() < 1e-17);
}

TEST_CASE("What touches a body that is taken away goes on without it") {
  SimulationConfig<double> config = plain(1e-3);
  Space<double> space(config);
  space.setUniformField({0, 0, -9.81});
  space.addPlane({0, 0, 1}, 0.0);
  std::vector<BodyId> ids;
  for (int k = 0; k < 6; ++k) {
    ids.push_back(space.addBody(ball({0, 0, 0.5 + k}, {0, 0, 0}, 0.5)));
  }
  advance(space, 100);
  CHECK(space.contactCount() == 6);
  space.removeBody(ids[2]);
  CHECK(space.collisionGraph().size() == 5);
  space.computeDynamics(100);
  CHECK(space.contactCount() == 4);  // two on the floor, three above the gap
  advance(space, 2000);
  CHECK(space.contactCount() == 5);
  CHECK_THAT(space.body(ids[5]).position()[2], WithinAbs(4.5, 1e-3));
  space.body(ids[0]).setFixed(true);  // and a body that becomes fixed holds the rest
  advance(space, 100);
  CHECK(space.body(ids[0]).velocity() == Vec::Zero());
  CHECK_THAT(space.body(ids[5]).position()[2], WithinAbs(4.5, 1e-3));
}
