#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

// In a static pile the sum of N d over contacts equals |W|, whatever friction does (virial theorem): an error
// of the whole pile's forces, without a reference. The scene settles under damping, then rests without.
TEST_CASE("The contacts of a pile under its own gravity carry it: sum N d is |W|") {
  SimulationConfig<double> config = plain(2e-3);
  config.G = 1.0;
  config.coeffFriction = 0.5;
  config.coeffStaticFriction = 0.6;
  config.coeffRestitution = 0.3;
  config.linearDamping = 1.0;
  config.angularDamping = 1.0;
  Space<double> space(config);
  scenes::CloudOptions options;
  options.count = 60;
  options.radius = 1.0;
  options.bodyRadius = {0.12, 0.2};
  options.density = {2.0, 3.0};
  for (const Body<double>& body : scenes::rubbleCloud<double>(options)) {
    space.addBody(body);
  }
  advance(space, 6000);
  space.setLinearDamping(0.0);
  space.setAngularDamping(0.0);
  advance(space, 500);
  ContactVirial<double> mean;
  double deepest = 0;
  for (std::size_t i = 0; i < 100; ++i) {
    space.computeDynamics(i);
    const ContactVirial<double> v = space.contactVirial();
    mean.forces += v.forces / 100;
    mean.contacts += v.contacts / 100;
    mean.motion += v.motion / 100;
    for (const Contact<double>& c : space.contacts()) {
      deepest = std::max(deepest, -c.gap);
    }
  }
  CAPTURE(space.contactCount(), mean.forces, mean.contacts, mean.motion, deepest);
  CHECK(space.contactCount() > 100);
  CHECK_THAT(mean.forces, WithinRel(std::get<2>(space.calculateSystemEnergy()), 1e-6));  // W, of 1/r
  CHECK(mean.residual() < 1e-6);                                                         // reached: 2e-10
  CHECK(mean.motion < -1e-5 * mean.forces);
  CHECK(deepest < 1e-3 * 0.12);
}

TEST_CASE("A floor carries the weight of the heap upon it, whatever the heap is doing inside") {
  SimulationConfig<double> config = plain(1e-3);
  config.coeffFriction = 0.4;
  config.coeffStaticFriction = 0.5;
  config.coeffRestitution = 0.3;
  Space<double> space(config);
  const double g = 9.81;
  space.setUniformField({0, 0, -g});
  space.addPlane({0, 0, 1}, 0.0);
  for (const double side : {-1.0, 1.0}) {
    space.addPlane({side, 0, 0}, -0.13);
    space.addPlane({0, side, 0}, -0.13);
  }
  scenes::ColumnOptions options;
  options.count = 40;
  options.base = {0, 0, 0.02};
  options.radius = 0.11;
  options.bodyRadius = {0.02, 0.03};
  double weight = 0;
  for (const Body<double>& body : scenes::grainColumn<double>(options)) {
    space.addBody(body);
    weight += body.mass * g;
  }
  advance(space, 3000);
  double up = 0;
  double floor = 0;
  double fastest = 0;
  for (std::size_t i = 0; i < 100; ++i) {
    space.computeDynamics(i);
    up -= space.supportedWeight().load[2] / 100;
    floor -= space.planeForce(0)[2] / 100;
  }
  for (std::size_t i = 0; i < space.n(); ++i) {
    fastest = std::max(fastest, space.body(i).velocity().norm());
    CHECK(space.body(i).position()[2] > 0.0);
    CHECK(std::abs(space.body(i).position()[0]) < 0.13);
  }
  CAPTURE(fastest);
  CHECK_THAT(up, WithinRel(weight, 1e-3));
  CHECK(floor < up);  // friction at the walls carries a part
  CHECK(floor > 0.5 * weight);
  CHECK_THAT(space.supportedWeight().weight[2], WithinRel(-weight, 1e-13));
  CHECK(fastest < 1e-2);
}
