#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

/// A cloud of touching, spinning, rubbing grains under their own gravity. Total mass about 1, G = 1.
Space<double> cloud(std::size_t n, double dt, double friction, double restitution, double G) {
  SimulationConfig<double> config = plain(dt);
  config.G = G;
  config.coeffFriction = friction;
  config.coeffStaticFriction = 1.5 * friction;
  config.coeffRestitution = restitution;
  Space<double> space(config);
  scenes::CloudOptions options;
  options.count = n;
  options.radius = 1.0;
  const double r = 0.55 / std::cbrt(static_cast<double>(n));
  options.bodyRadius = {0.5 * r, r};
  options.density = {1.0, 2.0};
  options.velocityDispersion = 0.3;
  options.bodySpin = 1.0;
  for (const Body<double>& body : scenes::rubbleCloud<double>(options)) {
    space.addBody(body);
  }
  return space;
}

struct Sizes {
  double momentum = 0;  ///< sum m |v|
  double angular = 0;   ///< sum m |x||v| + I |w|
};

Sizes sizesOf(const Space<double>& space) {
  Sizes s;
  for (std::size_t i = 0; i < space.n(); ++i) {
    const auto b = space.body(i);
    s.momentum += b.mass() * b.velocity().norm();
    s.angular +=
        b.mass() * b.velocity().norm() * b.position().norm() + b.inertia() * b.angularVelocity().norm();
  }
  return s;
}

}  // namespace

// Action is minus reaction, pair by pair, to the rounding of each addition.
// Seen to fail: one of 700 bodies feels 1e-4 too much.
TEST_CASE("Gravity through the space leaves no net force") {
  Space<double> space = cloud(700, 1e-4, 0.0, 1.0, 1.0);
  advance(space, 1);
  Vec sum = Vec::Zero();
  double size = 0;
  for (std::size_t i = 0; i < space.n(); ++i) {
    const auto body = space.body(i);
    sum += Vec(body.acceleration()) * body.mass();
    size += body.acceleration().norm() * body.mass();
    CHECK(Vec(body.force()) == Vec(body.acceleration() * body.mass()));
  }
  CHECK(sum.norm() <= 1e-15 * size);
  CHECK(size > 0.01);
}

// Each blow keeps both to a few ulp of what it exchanges, and so does a pair that is moved apart; contacts
// and kicks of 2000 steps round at random. Seen to fail: friction's torque with the radius in place of the
// arm (by 1e-6), and pairs moved apart at the velocity that they had (by 8e-5).
TEST_CASE("Momentum and angular momentum are kept through gravity, blows, friction and spin") {
  const std::size_t steps = 2000;
  for (const bool corrected : {false, true}) {
    Space<double> space = cloud(150, 2e-3, 0.5, 0.3, 1.0);
    space.setPositionalCorrectionFactor(corrected ? 0.4 : 0.0);
    const ConservedQuantities<double> before = space.conserved();
    Sizes sizes = sizesOf(space);
    std::size_t contacts = 0;
    for (std::size_t i = 0; i < steps; ++i) {
      space.computeDynamics(i);
      contacts += space.contactCount();
    }
    const Sizes end = sizesOf(space);
    sizes.momentum = std::max(sizes.momentum, end.momentum);
    sizes.angular = std::max(sizes.angular, end.angular);
    const ConservedQuantities<double> after = space.conserved();
    const double turned = (after.angularMomentum - before.angularMomentum).norm() / sizes.angular;
    CAPTURE(corrected, contacts, turned);
    CHECK(contacts > steps);
    CHECK((after.momentum - before.momentum).norm() <= 1e-13 * sizes.momentum);
    CHECK((after.centreOfMass - before.centreOfMass).norm() <= 1e-12);
    CHECK(turned <= 1e-11);
  }
}

// Many spheres in a space too small for them are moved apart further than their radii in a step. Seen to
// fail: contacts of such pairs with the normals that they had before (by 2e-3).
TEST_CASE("Angular momentum is kept where a crowd is moved far apart in a step") {
  SimulationConfig<double> config = plain(1e-3);
  config.coeffRestitution = 1;
  config.coeffFriction = config.coeffStaticFriction = 0.3;
  config.positionalCorrectionFactor = 0.4;
  Space<double> space(config);
  const CounterRandom random(5);
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto of = [&](std::uint64_t from) {
      return Vec(random.uniform(from, -1, 1), random.uniform(from + 1, -1, 1),
                 random.uniform(from + 2, -1, 1));
    };
    space.addBody(ball(1.5 * of(6 * i), of(6 * i + 3), 0.5));
  }
  const Vec before = space.conserved().angularMomentum;
  const double size = sizesOf(space).angular;
  advance(space, 20);
  CHECK((space.conserved().angularMomentum - before).norm() <= 1e-13 * size);
}

// Without gravity nothing is left to the error of the integration: what contacts, friction and damping take
// is booked from the impulses, and the sum of 200 steps rounds by 1e-16 of the energy each.
TEST_CASE("The ledger closes to rounding without gravity") {
  Space<double> space = cloud(400, 5e-3, 0.4, 0.7, 0.0);
  space.setLinearDamping(0.1);
  space.setAngularDamping(0.2);
  const double start = space.energyLedger().total();
  double worst = 0;
  for (std::size_t i = 0; i < 400; ++i) {
    space.computeDynamics(i);
    worst = std::max(worst, std::abs(space.energyLedger().total() / start - 1));
  }
  const EnergyLedger<double> e = space.energyLedger();
  CAPTURE(e.restitution, e.friction, e.damping, e.correction);
  CHECK(e.restitution > 1e-3 * start);
  CHECK(e.friction > 1e-4 * start);
  CHECK(e.damping > 1e-3 * start);
  CHECK(e.correction >=
        0);  // nothing to lift bodies against: what pairs that are moved apart turn the slower
  CHECK(e.correction <= 1e-3 * start);
  CHECK(worst <= 1e-13);
}
