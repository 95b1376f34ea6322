/// What the ledger books as the work of the user's own force where contacts bend the way.

#include "space/quiet_spaces.hpp"
#include "support/catch.hpp"
#include "support/space.hpp"
#include "support/temporary_file.hpp"
#include <gravel/space/space.hpp>

#include <algorithm>
#include <string>
#include <utility>

using namespace gravel;
using namespace gravel::test;

namespace {

using Force = Vec (*)(const Vec& x, double mass);

Vec weight(const Vec& /*x*/, double mass) { return Vec(0, 0, -9.81 * mass); }
Vec trap(const Vec& x, double mass) { return Vec(weight(x, mass) - 4 * mass * x); }

/// 40 balls in a box, or one that bounces in it for ever.
Space<double> box(SimulationConfig<double> config, std::size_t balls) {
  config.coeffRestitution = balls == 1 ? 1.0 : 0.7;
  config.coeffFriction = config.coeffStaticFriction = balls == 1 ? 0.0 : 0.3;
  Space<double> space(config);
  space.addBox({-2, -2, 0}, {2, 2, 3});
  for (std::size_t i = 0; i < balls; ++i) {
    const auto k = static_cast<double>(i);
    const auto of = [&](std::size_t each, std::size_t count) {
      return static_cast<double>(i / each % count);
    };
    space.addBody(at({0.6 * of(1, 5) - 1.5, 0.6 * of(5, 5) - 1.5, 0.7 + 0.6 * of(25, 5)},
                     {0.3 * of(1, 7) - 0.9, 0.2 * of(1, 4), 0.01 * k}, 0.2));
  }
  return space;
}

void push(Space<double>& space, Force force) {
  space.setForceHook([force](Bodies<double, SoA>& bodies, double) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].force() += force(bodies[i].position(), bodies[i].mass());
    }
  });
}

/// How far the ledger is off in so many seconds, at most, and what went through it, both in joules.
std::pair<double, double> offAndMoved(Space<double>& space, double seconds) {
  const double start = space.energyLedger().total();
  double off = 0;
  double moved = 0;
  while (space.time() < seconds) {
    const double before = space.energyLedger().mechanical();
    space.computeDynamics(0);
    const EnergyLedger<double> now = space.energyLedger();
    off = std::max(off, std::abs(now.total() - start));
    moved += std::abs(now.mechanical() - before);
  }
  return {off, moved};
}

}  // namespace

// Kicks of a force that stays the same do exactly that force times the drift between them, whatever contacts
// do to velocities: rounding alone is left. Seen to fail: the mean power at both ends of a step (0.08 to
// 0.17 J).
TEST_CASE("The work of a constant force of the user's closes the ledger to rounding through blows and rest") {
  const auto [integrator, parts] = GENERATE(std::pair{IntegratorKind::VelocityVerlet, std::size_t{1}},
                                            std::pair{IntegratorKind::VelocityVerlet, std::size_t{3}},
                                            std::pair{IntegratorKind::Yoshida4, std::size_t{1}});
  SimulationConfig<double> config = quiet(2e-3);
  config.integrator = integrator;
  config.contactSubsteps = parts;
  Space<double> space = box(config, 40);
  push(space, weight);
  const auto [off, moved] = offAndMoved(space, 3.0);
  CAPTURE(parts, off, moved);
  CHECK(moved > 100);
  CHECK(off < 1e-12 * moved);
}

namespace {

/// Three in a row, of which the outer ones merge into the middle one at 1/3 s, in the third part of step 17.
Space<double> mergers() {
  SimulationConfig<double> config = quiet(0.02);
  config.contactSubsteps = 4;
  Space<double> space(config);
  for (const double x : {-3.0, 0.0, 3.0}) {
    space.addBody(at({x, 0, 0}, {-2 * x, 0, 1}));
  }
  space.setCollisionHook([](const auto& /*hit*/) { return CollisionOutcome<double>::merge(); });
  return space;
}

}  // namespace

// Bodies go while the step goes on. Seen to fail: the way and force of before the merger left out (0.98 J).
TEST_CASE("Bodies that merge between the parts of a step take their share of a user's work with them") {
  Space<double> space = mergers();
  push(space, weight);
  const auto [off, moved] = offAndMoved(space, 1.0);
  CAPTURE(off, moved);
  CHECK(space.n() == 1);
  CHECK(off < 1e-12 * moved);
}

// The saved state knows of no force of the user's, or of one that is gone: forces are found anew. Seen to
// fail: those of the file taken until they are (0.05 m/s in place of 0.20; 0.10 m/s in place of none, and 9
// mJ that nothing booked).
TEST_CASE("A force of the user's that the saved state had not works from the start of the next step on") {
  const TemporaryFile file("hookless");
  Space<double> before = mergers();
  before.advanceTo(0.32);
  before.save(file.path());
  Space<double> space = mergers();
  push(space, weight);
  space.restore(file.path());
  const double start = space.energyLedger().total();
  space.computeDynamics(0);
  CHECK(space.n() == 1);
  CHECK_THAT(space.energyLedger().total(), WithinAbs(start, 1e-12));
  CHECK_THAT(space.body(0).velocity()[2], WithinAbs(1 - 9.81 * 0.02, 1e-12));
}

TEST_CASE("A force of the user's that the saved state had and the space has not does not work any more") {
  const TemporaryFile file("hookful");
  Space<double> before = mergers();
  push(before, weight);
  before.advanceTo(0.1);
  before.save(file.path());
  Space<double> space = mergers();
  space.restore(file.path());
  const Vector3<double> v = space.body(0).velocity();
  const double start = space.energyLedger().total();
  space.computeDynamics(0);
  CHECK(space.body(0).velocity() == v);
  CHECK_THAT(space.energyLedger().total(), WithinAbs(start, 1e-12));
}

// (F_0 + F_1)/2 over the way in between is the trapezium rule for the integral of F.dx: second order, and a
// blow bends the way within a step only. Seen to fail: the mean power at both ends (0.15 J and 0.035 J).
TEST_CASE("The work of a user's force that depends on the place is of second order through blows") {
  const auto off = [](double h) {
    Space<double> space = box(quiet(h), 1);
    push(space, trap);
    return offAndMoved(space, 3.0).first;
  };
  const double coarse = off(4e-3);
  const double fine = off(5e-4);
  CAPTURE(coarse, fine);
  CHECK(coarse > 1e-5);  // of 3.7 J
  CHECK(coarse < 2e-3);
  CHECK(fine < coarse / 32);  // 64 at order 2, 8 at order 1
}

namespace {

/// How far the ledger is off at most, over the work of a drag along with a body in ten turns of its orbit
/// about another, or of its epicycle.
double offOfDrag(IntegratorKind integrator, double stepsPerTurn) {
  SimulationConfig<double> config = quiet(2 * pi<double>() / stepsPerTurn);
  config.integrator = integrator;
  Space<double> space(config);
  if (integrator == IntegratorKind::SymplecticEpicycle) {
    space.setDomain(Domain<double>::shearPeriodic({100, 100, 100}, 1.0));
    space.addBody(at({1, 0, 0}, {0.3, -1.0, 0.2}, 0));
  } else {
    space.setG(1.0);
    space.addBody(at({1, 0, 0}, {0, 1, 0}, 0));
    space.body(0).mass() = 1e-6;
    space.addBody(at({0, 0, 0}, {0, 0, 0}, 0));
  }
  space.setForceHook([](Bodies<double, SoA>& bodies, double) {
    bodies[0].force() -= 1e-3 * bodies[0].mass() * Vec(bodies[0].velocity());
  });
  const double start = space.energyLedger().total();
  double off = 0;
  while (space.time() < 20 * pi<double>()) {
    space.computeDynamics(0);
    off = std::max(off, std::abs(space.energyLedger().total() - start));
  }
  return off / std::abs(space.energyLedger().work);
}

}  // namespace

// By the mean power at both ends: what kicks do where velocities turn in the drift, and for the others the
// trapezium rule, whose error on a smooth way is at its ends alone. Seen to fail: by the way
// (8.9e-3, 2.0e-2, 8.5e-2 and 4.7e-4).
TEST_CASE("The work of a drag is booked as well as its body moves, where drifts are no straight lines") {
  CHECK(offOfDrag(IntegratorKind::Yoshida6, 30) < 2e-4);
  CHECK(offOfDrag(IntegratorKind::WisdomHolman, 20) < 1e-6);
  CHECK(offOfDrag(IntegratorKind::GaussRadau15, 10) < 1e-4);
  CHECK(offOfDrag(IntegratorKind::SymplecticEpicycle, 50) < 1e-5);
}
