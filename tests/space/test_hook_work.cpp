/// What the ledger books as the work of the user's own force where contacts bend the way.

#include "space/quiet_spaces.hpp"
#include "support/catch.hpp"
#include "support/space.hpp"
#include "support/temporary_file.hpp"
#include <gravel/space/space.hpp>

#include <algorithm>
#include <array>
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

// A force F at the end of one step alone, in which a ball at 1 m/s meets the floor 0.03 s after the middle:
// the approach lacks 1.5 m/s at 200 N, of which 1 counts. The ledger is off by what is even in F, h^2 F^2/8m
// and the like. Seen to fail: work as if all counted (12.7 and 15.6 J).
TEST_CASE("Of a blow that a user's force changes by more than itself as much is booked as counts") {
  const double friction = GENERATE(0.0, 1.0);
  const double F = GENERATE(40.0, 200.0);
  std::array<double, 2> off{};
  for (std::size_t k = 0; k < off.size(); ++k) {
    const Vec force = (k == 0 ? F : -F) * Vec(0.3, 0, 1);
    SimulationConfig<double> config = quiet(0.1);
    config.coeffRestitution = config.tangentialRestitution = 0.5;
    config.coeffFriction = config.coeffStaticFriction = friction;
    Space<double> space(config);
    space.addPlane({0, 0, 1}, 0.0);
    Body<double> ball = at({0, 0, 0.38}, {0.3, 0, -1}, 0.1);
    ball.mass = 2;
    space.addBody(ball);
    space.setForceHook([force](Bodies<double, SoA>& bodies, double t) {
      bodies[0].force() += std::abs(t - 0.3) < 1e-6 ? force : Vec(0, 0, 0);
    });
    const double start = space.energyLedger().total();
    for (std::size_t step = 0; step < 3; ++step) {
      space.computeDynamics(step);
    }
    REQUIRE(space.impacts().size() == 1);
    off[k] = space.energyLedger().total() - start;
  }
  CAPTURE(friction, F);
  CHECK_THAT(off[0], WithinRel(off[1], 1e-12));
}

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

/// A ball of radius 1/2 and mass 1 above a floor, under gravity and a torque.
Space<double> ballUnderTorque(SimulationConfig<double> config, double height, const Vec& torque) {
  Space<double> space(config);
  space.setUniformField({0, 0, -9.81});
  space.addPlane({0, 0, 1}, 0);
  space.addBody(at({0, 0, 0.5 + height}, {0, 0, 0}, 0.5));
  space.setForceHook([torque](Bodies<double, SoA>& bodies, double) { bodies[0].torque() += torque; });
  return space;
}

}  // namespace

// What friction gives in the second half of a step is no share of what the torque did in the kick before.
// Seen to fail: that left out (friction tau^2 h/(4 I) a second at rest, 0.08 J in 10 s; 0.29 J in the roll).
TEST_CASE("A torque against which friction holds a ball does no work, and one that rolls it loses none") {
  const std::size_t parts = GENERATE(1U, 3U);
  SimulationConfig<double> config = quiet(0.02);
  config.contactSubsteps = parts;
  config.coeffFriction = config.coeffStaticFriction = 0.5;
  Space<double> rolls = ballUnderTorque(config, 0, {0, 2, 0});
  const double start = rolls.energyLedger().total();
  rolls.advanceTo(2.0);
  CHECK_THAT(rolls.body(0).angularVelocity()[1], WithinRel(4 / (0.1 + 0.25), 1e-12));  // tau t/(I + m R^2)
  CHECK_THAT(rolls.energyLedger().friction, WithinAbs(0.0, 1e-11));
  CHECK_THAT(rolls.energyLedger().total(), WithinAbs(start, 1e-11));

  config.rollingFriction = config.spinningFriction = 0.1;
  for (const Vec& torque : {Vec(0, 0.4, 0), Vec(0, 0, 0.4)}) {
    Space<double> rests = ballUnderTorque(config, 0, torque);
    const double before = rests.energyLedger().total();
    rests.advanceTo(10.0);
    CHECK(rests.body(0).angularVelocity().norm() < 1e-15);
    CHECK_THAT(rests.energyLedger().friction, WithinAbs(0.0, 1e-12));
    CHECK_THAT(rests.energyLedger().total(), WithinAbs(before, 1e-12));
  }
}

// A blow meets the spin of its moment, tau t/I, whenever in a step it comes. Seen to fail: the spin of the
// step's middle (v off by up to (2/7) R (tau/I) h/2, 0.014 m/s).
TEST_CASE("A ball that a torque spins bounces with the spin that it has by then, whatever the step") {
  for (const double mu : {1.0, 0.05}) {  // sticks, slides
    for (double height = 0.9; height < 1.1; height += 0.023) {
      SimulationConfig<double> config = quiet(0.02);
      config.coeffRestitution = 0.8;
      config.coeffFriction = config.coeffStaticFriction = mu;
      Space<double> space = ballUnderTorque(config, height, {0, 1, 0});
      const double start = space.energyLedger().total();
      space.advanceTo(0.6);
      const double inertia = 0.1;
      const double met = std::sqrt(2 * height / 9.81);
      const double spin = met / inertia;
      const double impulse = std::min(2.0 / 7 * 0.5 * spin, mu * 1.8 * 9.81 * met);
      CHECK_THAT(space.body(0).velocity()[0], WithinAbs(impulse, 1e-12));
      CHECK_THAT(space.body(0).angularVelocity()[1],
                 WithinAbs(0.6 / inertia - 0.5 * impulse / inertia, 1e-11));
      CHECK_THAT(space.energyLedger().total(), WithinAbs(start, 1e-11));
    }
  }
}

// A drag turns round with the velocity in each blow, so that the mean of it before and after is nothing. Seen
// to fail: (F_0 + F_1).x/2 (3.1 and 0.39 J); without what forces do in LateBlows (0.18 and 0.023 J).
TEST_CASE("The work of a drag is of second order where bodies bounce") {
  const auto off = [](double h) {
    Space<double> space = box(quiet(h), 40);
    space.setForceHook([](Bodies<double, SoA>& bodies, double) {
      for (std::size_t i = 0; i < bodies.size(); ++i) {
        bodies[i].force() -= bodies[i].mass() * (Vec(0, 0, 9.81) + 0.8 * Vec(bodies[i].velocity()));
      }
    });
    return offAndMoved(space, 1.5).first;
  };
  const double coarse = off(8e-3);
  const double fine = off(1e-3);
  CAPTURE(coarse, fine);
  CHECK(coarse < 0.1);
  CHECK(fine < coarse / 24);  // 64 at order 2, 8 at order 1
}

// Seen to fail: forces of the hook left by index (4e-3 J).
TEST_CASE("A new order of bodies leaves each of them the user's force that it has") {
  Space<double> space(quiet(0.01));
  for (int i = 0; i < 8; ++i) {
    space.addBody(at({1.0 * (7 - i), -3.0 * (i % 3), 2.0 * (i % 2)}, {0.1 * i, 0, 0}, 0.1));
  }
  space.setForceHook([](Bodies<double, SoA>& bodies, double) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].force()[0] += static_cast<double>(toInteger(BodyId(bodies[i].id())) % 3);
    }
  });
  const double start = space.energyLedger().total();
  for (int k = 0; k < 20; ++k) {
    space.computeDynamics(0);
    if (k % 5 == 0) {
      space.reorderBodies();
      CHECK(toInteger(BodyId(space.body(std::size_t{0}).id())) != 0);
    }
  }
  CHECK_THAT(space.energyLedger().total(), WithinAbs(start, 1e-13));
}

// The kick works on velocities that the correction has changed. Seen to fail: without the user's share in
// that (6e-4 J).
TEST_CASE("Overlaps are opened under a user's force as under a field") {
  SimulationConfig<double> config = quiet(0.01);
  config.coeffRestitution = 0;
  Space<double> space(config);
  space.addBody(at({0, 0, 0}, {0, 1, 0}, 1));
  space.addBody(at({1.5, 0, 0}, {0, -1, 0}, 1));
  space.setForceHook([](Bodies<double, SoA>& bodies, double) { bodies[0].force() += Vec(0, 1, 0); });
  const double start = space.energyLedger().total();
  space.computeDynamics(0);
  CHECK(space.energyLedger().correction > 0.01);
  CHECK_THAT(space.energyLedger().total(), WithinAbs(start, 1e-14));
}

// Velocities jump by (3/2) Omega Lx at the edge, in any part. Seen to fail: the power at both ends of the
// step alone (F dv h (1/2 - k/n), 0.06 J); by the way without the jump (0.12 J).
TEST_CASE("A body that crosses the edge of a patch takes the user's constant force with it") {
  const auto [parts, touching] =
      GENERATE(table<std::size_t, bool>({{1, false}, {2, false}, {4, false}, {1, true}, {4, true}}));
  SimulationConfig<double> config = quiet(0.04);
  config.integrator = IntegratorKind::SymplecticEpicycle;
  config.contactSubsteps = parts;
  Space<double> space(config);
  space.setDomain(Domain<double>::shearPeriodic({8, 8, 8}, 1.0));
  const BodyId crosses = space.addBody(at({3.5, 0, 0}, {1, -1.5 * 3.5, 0}, 0.1));
  std::array<BodyId, 2> pressed{crosses, crosses};
  if (touching) {  // by two that are pressed together: then work is booked by the way
    pressed = {space.addBody(at({0, -0.5, 0}, {0, 0, 0}, 0.5)),
               space.addBody(at({0, 0.5, 0}, {0, 0, 0}, 0.5))};
  }
  space.setForceHook([crosses, pressed](Bodies<double, SoA>& bodies, double) {
    bodies[bodies.indexOf(pressed[0])].force() += Vec(0, 1, 0);
    bodies[bodies.indexOf(pressed[1])].force() -= Vec(0, 1, 0);
    bodies[bodies.indexOf(crosses)].force() += Vec(0, 0.5, 0);
  });
  const double start = space.energyLedger().total();
  space.advanceTo(1.0);
  CHECK(space.body(crosses).position()[0] < 0);
  CHECK(space.contactCount() == (touching ? 1 : 0));
  CAPTURE(parts, touching);
  // An epicycle is no straight way: by the way to second order, 2.4e-7 here.
  CHECK_THAT(space.energyLedger().total(), WithinAbs(start, touching ? 2e-6 : 1e-12));
}

namespace {

/// The most by which the ledger moves in a step in which two bounce in a patch, in a later part of it.
double jumpOfBlow(double h, std::size_t parts) {
  double most = 0;
  for (int k = 0; k < 20; ++k) {
    SimulationConfig<double> config = quiet(h);
    config.integrator = IntegratorKind::SymplecticEpicycle;
    config.contactSubsteps = parts;
    config.coeffRestitution = 0.5;
    Space<double> space(config);
    space.setDomain(Domain<double>::shearPeriodic({8, 8, 8}, 1.0));
    const double x = 0.36 + 0.5 * h * (1 + k / 20.0);  // they meet in the second step
    space.addBody(at({-x, 0, 0}, {0.5, 1.5 * x - 0.15, 0}, 0.35));
    space.addBody(at({x, 0.05, 0}, {-0.5, -1.5 * x + 0.15, 0}, 0.35));
    space.setForceHook([](Bodies<double, SoA>& bodies, double) { bodies[1].force() += Vec(0.3, 0.2, 0.1); });
    double before = space.energyLedger().total();
    while (space.time() < 5 * h) {
      space.computeDynamics(0);
      const double now = space.energyLedger().total();
      most = std::max(most, std::abs(now - before));
      before = now;
    }
    CHECK(space.energyLedger().restitution > 0.01);
  }
  return most;
}

}  // namespace

// Seen to fail: blows of the last part not seen, and the mean power booked across them (2e-3 and 8e-4 J).
TEST_CASE("The work of a user's force is of second order through blows in any part of a patch's step") {
  for (const std::size_t parts : {1U, 2U, 5U}) {
    const double coarse = jumpOfBlow(0.04, parts);
    const double fine = jumpOfBlow(0.01, parts);
    CAPTURE(parts, coarse, fine);
    CHECK(coarse < 1e-4);
    CHECK(fine < coarse / 8);  // 16 at order 2, 4 at order 1
  }
}

// Seen to fail: a blow takes the angular acceleration of the torque that is gone (4e-3 J).
TEST_CASE("A torque of a saved state does not act on the blows of a space without the hook") {
  const TemporaryFile file("torqueless");
  SimulationConfig<double> config = quiet(0.02);
  config.coeffFriction = config.coeffStaticFriction = 1;
  {
    Space<double> space = ballUnderTorque(config, 1, {0, 1, 0});
    space.advanceTo(0.1);
    space.setUniformField({0, 0, -9});  // forces are to be found anew
    space.save(file.path());
  }
  Space<double> space(config);
  space.restore(file.path());
  const double start = space.energyLedger().total();
  space.advanceTo(0.7);
  CHECK(space.body(0).angularAcceleration() == Vec(0, 0, 0));
  CHECK_THAT(space.body(0).velocity()[0], WithinAbs(2.0 / 7 * 0.5 * 0.1 / 0.1, 1e-12));  // 2/7 R tau t/I
  CHECK_THAT(space.energyLedger().total(), WithinAbs(start, 1e-12));
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
