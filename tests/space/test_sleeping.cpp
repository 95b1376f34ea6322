#include "laws/laws.hpp"
#include "support/catch.hpp"
#include "support/temporary_file.hpp"
#include "support/threads.hpp"

// Islands that rest fall asleep, and everything that happens to them wakes them.

using namespace gravel;
using namespace gravel::test;

namespace test_sleeping {

namespace {

constexpr double g = 9.81;

SimulationConfig<double> sleepy(double sleepSpeed = 1e-2) {
  SimulationConfig<double> config = plain(1.0 / 120);
  config.coeffFriction = config.coeffStaticFriction = 1.0;
  config.rollingFriction = 0.5;
  config.coeffRestitution = 0.3;
  config.sleepSpeed = sleepSpeed;
  config.sleepTime = 0.25;
  return config;
}

std::size_t sleepers(const Space<double>& space) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < space.n(); ++i) {
    count += space.body(i).isAsleep() ? 1 : 0;
  }
  return count;
}

/// A pyramid of 3 x 3 and 2 x 2 balls and one on top, on a floor, and a single ball far away: bodies 0 to 14.
Space<double> pyramid(const SimulationConfig<double>& config = sleepy()) {
  Space<double> space(config);
  space.setUniformField({0, 0, -g});
  space.addPlane({0, 0, 1}, 0.0);
  for (int layer = 0; layer < 3; ++layer) {
    for (int i = 0; i < 3 - layer; ++i) {
      for (int j = 0; j < 3 - layer; ++j) {
        space.addBody(
            ball({i + layer / 2.0, j + layer / 2.0, 0.5 + layer * std::sqrt(0.5)}, {0, 0, 0}, 0.5, 2.0));
      }
    }
  }
  space.addBody(ball({20, 0, 0.5}, {0, 0, 0}, 0.5, 2.0));
  return space;
}

/// The same, asleep.
Space<double> asleep(const SimulationConfig<double>& config = sleepy()) {
  Space<double> space = pyramid(config);
  advance(space, 40);
  return space;
}

}  // namespace

TEST_CASE("What rests for long falls asleep: it stands still, weighs, and the ledger is closed") {
  Space<double> space = pyramid();
  const double before = space.energyLedger().total();
  advance(space, 29);
  CHECK(sleepers(space) == 0);  // not before the time is over
  advance(space, 11);
  CHECK(sleepers(space) == 15);
  const std::vector<double> state = stateOf(space);
  advance(space, 100);
  std::vector<double> later = stateOf(space);
  later.back() = state.back();  // time
  CHECK(sameBits(state, later));
  CHECK(std::get<0>(space.calculateSystemEnergy()) == 0.0);
  CHECK(space.supportedWeight().residual() < 1e-3);
  CHECK_THAT(space.planeForce(0)[2], WithinRel(-15 * 2 * g, 1e-3));
  CHECK(space.contactVirial().residual() < 1e-2);
  CHECK(space.contacts().empty());
  CHECK(std::abs(space.energyLedger().total() - before) < 1e-9 * std::abs(before));
}

TEST_CASE("Nothing sleeps unless asked to, nor while it moves, flies, spins, or stands on what moves") {
  Space<double> off = pyramid(sleepy(0.0));
  advance(off, 60);
  CHECK(sleepers(off) == 0);

  // At the top of a throw so feeble that the ball is slow for all of the time.
  SimulationConfig<double> config = sleepy();
  Space<double> thrown(config);
  thrown.setUniformField({0, 0, -1e-3});
  thrown.addBody(ball({0, 0, 1}, {0, 0, 0}, 0.5));
  // Slower than the limit along a wall that carries nothing.
  thrown.addPlane({1, 0, 0}, 5.0);
  thrown.addBody(ball({5.5, 0, 1}, {0, 0, 0}, 0.5));
  advance(thrown, 200);
  CHECK(sleepers(thrown) == 0);

  Space<double> spinning(config);
  spinning.setUniformField({0, 0, -g});
  const std::size_t floor = spinning.addPlane({0, 0, 1}, 0.0);
  spinning.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5, 1.0, {0, 0, 0.1}));
  advance(spinning, 60);
  CHECK(sleepers(spinning) == 0);
  spinning.body(0).angularVelocity() = Vec(0, 0, 0);
  spinning.setPlaneVelocity(floor, {1e-3, 0, 0});
  advance(spinning, 60);
  CHECK(sleepers(spinning) == 0);
  spinning.setPlaneVelocity(floor, {0, 0, 0});
  advance(spinning, 60);
  CHECK(sleepers(spinning) == 1);

  Space<double> still(config);  // without forces what is slow is at rest; its motion is booked
  still.addBody(ball({0, 0, 0}, {5e-3, 0, 0}, 0.5));
  advance(still, 40);
  CHECK(sleepers(still) == 1);
  CHECK(still.energyLedger().kinetic == 0.0);
  CHECK_THAT(still.energyLedger().damping, WithinRel(1.25e-5, 1e-12));
}

// Seen to fail: whatever is near wakes those who sleep, without end.
TEST_CASE("Neighbours that do not touch fall asleep one after the other") {
  Space<double> space(sleepy());
  space.setUniformField({0, 0, -g});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({50, 0, 5}, {0, 0, 0}, 5));  // what is near is so by the largest radius
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  advance(space, 15);
  space.addBody(ball({1.005, 0, 0.5}, {0, 0, 0}, 0.5));
  CHECK(space.contactCount() == 2);
  advance(space, 80);
  CHECK(sleepers(space) == 3);
}

// Each reason alone. Seen to fail: each of the values, the flags, the bodies that are gone and the approach
// not looked at.
TEST_CASE("Sleepers wake by whatever happens to them, all that hang together and no others") {
  Space<double> space = asleep();
  REQUIRE(sleepers(space) == 15);

  SECTION("somebody gives one of them speed") { space.body(13).velocity() = Vec(0, 0, 1); }
  SECTION("or spin") { space.body(4).angularVelocity() = Vec(0, 1, 0); }
  SECTION("or another place") { space.body(13).position()[2] += 1e-9; }
  SECTION("or mass") { space.body(13).mass() = 3.0; }
  SECTION("or radius") { space.body(13).radius() = 0.49; }
  SECTION("or surface") {
    const MaterialId ice = space.addMaterial({.restitution = 0.1});
    space.body(13).setMaterial(ice);
  }
  SECTION("or makes another body of it") { space.body(13).store(space.body(13).load()); }
  SECTION("or holds it fast") { space.body(4).setFixed(true); }
  SECTION("one is taken away") { space.removeBody(BodyId{4}); }
  SECTION("one is put on top") { space.addBody(ball({1, 1, 2.9}, {0, 0, 0}, 0.5)); }
  advance(space, 1);
  CHECK_FALSE(space.body(BodyId{0}).isAsleep());
  CHECK_FALSE(space.body(BodyId{13}).isAsleep());
  CHECK(space.body(BodyId{14}).isAsleep());
}

// Seen to fail: impacts of earlier parts of a step went on naming the index of a body that had merged away,
// which is that of the last body now: a sleeper there woke.
TEST_CASE("A merger far away wakes nobody, wherever sleepers stand") {
  for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::Yoshida4}) {
    for (const bool last : {false, true}) {
      SimulationConfig<double> config = plain(1e-2);
      config.integrator = kind;
      config.sleepSpeed = 0.05;
      config.sleepTime = 0.1;
      const auto scene = [&](bool merges) {
        Space<double> space(config);
        const Body<double> sleeper = ball({50, 0, 0}, {0, 0, 0}, 0.1);
        if (!last) {
          space.addBody(sleeper);
        }
        space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.1, 1.0));
        space.addBody(ball({0.501, 0, 0}, {0.06, 0, 0}, 0.1, 2.0));
        if (last) {
          space.addBody(sleeper);
        }
        if (merges) {
          space.setCollisionHook([](const Collision<double>&) { return CollisionOutcome<double>::merge(); });
        }
        return space;
      };
      Space<double> space = scene(true);
      CAPTURE(traitsOf(kind).name, last);
      const BodyId far = space.body(last ? 2U : 0U).id();
      advance(space, 30);
      REQUIRE(space.n() == 3);
      REQUIRE(space.body(far).isAsleep());
      std::size_t awake = 0;
      for (int i = 0; i < 10; ++i) {
        advance(space, 1);
        awake += space.body(far).isAsleep() ? 0 : 1;
      }
      CHECK(space.n() == 2);
      CHECK(awake == 0);
    }
  }
}

TEST_CASE("Sleepers wake where the world changes") {
  Space<double> space = asleep();
  REQUIRE(sleepers(space) == 15);
  SECTION("the field") { space.setUniformField({0, 0, -g / 2}); }
  SECTION("gravity") { space.setG(1e-9); }
  SECTION("a user's force") {
    space.setForceHook([](Bodies<double, SoA>&, double) {});
  }
  SECTION("a new plane") { space.addPlane({1, 0, 0}, -100.0); }
  SECTION("a box") { space.addBox({-100, -100, -100}, {100, 100, 100}); }
  SECTION("the domain") { space.setDomain(Domain<double>::periodic({100, 100, 100})); }
  SECTION("a plane that is gone") { space.removePlane(0); }
  SECTION("the surface of all") { space.setCoeffFriction(0.01); }
  SECTION("the surface of a pair") { space.setPairMaterial(defaultMaterial, defaultMaterial, {}); }
  SECTION("a wish") { space.wakeAll(); }
  advance(space, 1);
  CHECK(sleepers(space) == 0);
}

// Seen to fail: they woke on a belt that moved as it did when they were found tired, and took a step with it.
TEST_CASE("Who fell asleep on a belt that stopped wakes on one at rest") {
  SimulationConfig<double> config = sleepy(0.1);
  Space<double> space(config);
  space.setUniformField({0, 0, -g});
  const std::size_t belt = space.addPlane({0, 0, 1}, 0.0);
  space.setPlaneVelocity(belt, {0.05, 0, 0});
  space.addBody(ball({0, 0, 0.5}, {0.05, 0, 0}, 0.5));
  advance(space, 60);
  space.setPlaneVelocity(belt, {0, 0, 0});
  advance(space, 40);
  REQUIRE(sleepers(space) == 1);
  const Vec place = space.body(0).position();
  const EnergyLedger<double> before = space.energyLedger();
  space.wakeAll();
  advance(space, 1);
  CHECK(sleepers(space) == 0);
  const EnergyLedger<double> after = space.energyLedger();
  CHECK((place - space.body(0).position()).norm() < 1e-15);
  CHECK(std::abs(after.work - before.work) < 1e-15);
  CHECK(std::abs(after.friction - before.friction) < 1e-15);
}

// Seen to fail: they slept on, for the pair stands in for the settings among themselves alone.
TEST_CASE(
    "Sleepers wake when the friction of the space changes, also where its pair with itself has its own") {
  Space<double> space(sleepy());
  const Material<double> rough{.staticFriction = 1.0, .kineticFriction = 1.0, .rollingFriction = 0.5};
  space.setPairMaterial(defaultMaterial, defaultMaterial, rough);
  space.addPlane({0, 0, 1}, 0.0, space.addMaterial(rough));
  space.setUniformField({g * std::sin(0.2), 0, -g * std::cos(0.2)});
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  advance(space, 60);
  REQUIRE(sleepers(space) == 1);
  space.setCoeffFriction(0.0);
  space.setCoeffStaticFriction(0.0);
  advance(space, 1);
  CHECK(sleepers(space) == 0);
}

// Seen to fail: the hook saw sleepers fall at g h/2, so that a drag woke a ball one step after it fell
// asleep, again and again (asleep 7 steps of 400); of a force that grew, a sleeper took work in a step of
// parts.
TEST_CASE("A user's force sees sleepers at rest and does no work on them, in parts of a step as well") {
  SimulationConfig<double> config = sleepy();
  config.contactSubsteps = GENERATE(1U, 3U);
  Space<double> space(config);
  space.setUniformField({0, 0, -g});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  Vec seen = Vec::Zero();
  space.setForceHook([&](Bodies<double, SoA>& bodies, double t) {
    seen = bodies[0].velocity();
    bodies[0].force() += Vec(0, 0, 1e-3 * t) - seen;
  });
  advance(space, 40);
  REQUIRE(sleepers(space) == 1);
  const double work = space.energyLedger().work;
  for (int k = 0; k < 100; ++k) {
    advance(space, 1);
    REQUIRE(sleepers(space) == 1);
    REQUIRE(seen == Vec::Zero());
  }
  CHECK(space.energyLedger().work == work);
}

TEST_CASE("Who wakes leans on the others as before") {
  Space<double> slept = asleep();
  Space<double> never = asleep(sleepy(0.0));
  slept.wakeAll();
  advance(slept, 1);
  advance(never, 1);
  CHECK(sleepers(slept) == 0);
  CHECK(slept.contactCount() == never.contactCount());
  CHECK(slept.contactReport().iterations <= never.contactReport().iterations + 2);
  CHECK_THAT(slept.planeForce(0)[2], WithinRel(-15 * 2 * g, 1e-3));
  CHECK(difference(stateOf(slept), stateOf(never)) < 1e-6);
}

// Seen to fail: forces and torques not compared.
TEST_CASE("Sleepers wake when a force on them changes, and only then") {
  Space<double> space = pyramid();
  double pull = 0;
  space.setForceHook([&](Bodies<double, SoA>& bodies, double) {
    bodies[14].force() += Vec(pull, 0, 0);
    bodies[13].torque() += Vec(0, 0, pull / 1000);
  });
  advance(space, 40);
  REQUIRE(sleepers(space) == 15);
  pull = 1e-3;
  advance(space, 10);
  CHECK(sleepers(space) == 15);
  pull = 2 * 1.01 * 1e-2 / 0.25;  // over the mass of 2: a hundredth above sleepSpeed/sleepTime
  advance(space, 2);
  CHECK_FALSE(space.body(14).isAsleep());
  CHECK(space.body(0).isAsleep());
  pull = 100;  // a torque
  advance(space, 2);
  CHECK_FALSE(space.body(0).isAsleep());
}

TEST_CASE("A passing mass wakes those whom it pulls by as much as counts") {
  SimulationConfig<double> config = sleepy();
  config.G = 1;
  Space<double> space(config);
  Body<double> planet = ball({0, 0, 0}, {0, 0, 0}, 10, 1000);
  planet.fixed = true;
  space.addBody(planet);
  const BodyId rock = space.addBody(ball({0, 0, 10.1}, {0, 0, 0}, 0.1, 1e-3));
  advance(space, 60);
  REQUIRE(space.body(rock).isAsleep());
  const BodyId visitor = space.addBody(ball({0, 200, 20}, {0, -50, 0}, 0.1, 100));
  std::size_t i = 0;
  while (space.body(rock).isAsleep() && i < 1000) {
    space.computeDynamics(i++);
  }
  // 10 at rest; a 64th of that is more than sleepSpeed/sleepTime = 0.04 = 100/r^2.
  const double r = (space.body(visitor).position() - space.body(rock).position()).norm();
  CHECK_THAT(r, WithinAbs(50.0, 1.0));
}

// With no force from outside. Seen to fail: whoever is pulled anew was asked for only after a step, which the
// sleepers spent asleep: their share of it was lost for good.
TEST_CASE("A mass that comes, goes, moves or changes beside sleepers leaves the momentum of all as it was") {
  SimulationConfig<double> config = plain(0.04);
  config.G = 1;
  config.coeffFriction = config.coeffStaticFriction = 0.5;
  config.sleepSpeed = 1e-3;
  config.sleepTime = 0.5;
  Space<double> space(config);
  for (const double x : {-0.5, 0.5}) {
    space.addBody(ball({x, 0, 0}, {0, 0, 0}, 0.5));
  }
  for (const double y : {-20.0, 20.0}) {  // each pulls the two by 0.05
    space.addBody(ball({0, y, 0}, {0, 0, 0}, 0.5, 20));
  }
  space.advanceTo(2);
  REQUIRE(sleepers(space) == 2);
  SECTION("it is added") { space.addBody(ball({0, 0, 20}, {0, 0, 0}, 0.5, 20)); }
  SECTION("it is removed") { space.removeBody(space.body(2).id()); }
  SECTION("its place is written") { space.body(2).position() = Vec(0, 0, 2000); }
  SECTION("its mass is written") { space.body(2).mass() = 40; }
  const Vec before = space.conserved().momentum;
  advance(space, 1);
  CHECK(sleepers(space) == 0);
  advance(space, 2);
  const double share = 2 * 0.05 * config.timeStep;
  CHECK((space.conserved().momentum - before).norm() < 1e-12 * share);  // 1e-16 of 20 at 0.04: 2e-14 of it
}

TEST_CASE("Nothing floats when its support moves, sinks or is carried away") {
  Space<double> space = asleep();
  const double top = space.body(13).position()[2];
  SECTION("a floor that sinks") {
    space.setPlaneVelocity(0, {0, 0, -5});
    advance(space, 60);
    CHECK(space.body(13).position()[2] < top - 1);
  }
  SECTION("a floor that rises") {
    space.setPlaneVelocity(0, {0, 0, 1});
    advance(space, 60);
    CHECK(space.body(13).position()[2] > top + 0.2);
  }
  SECTION("two of the four balls below") {
    space.body(9).position() = Vec(1, 1, 30);
    space.body(10).position() = Vec(1, 1, 40);
    advance(space, 60);
    CHECK(space.body(13).position()[2] < top - 0.1);
  }
}

TEST_CASE("A fixed body that is moved, freed or removed wakes what leans on it") {
  Space<double> space(sleepy());
  space.setUniformField({0, 0, -g});
  Body<double> stand = ball({0, 0, 0}, {0, 0, 0}, 1, 10);
  stand.fixed = true;
  const BodyId below = space.addBody(stand);
  const BodyId rock = space.addBody(ball({0, 0, 1.5}, {0, 0, 0}, 0.5));
  advance(space, 40);
  REQUIRE(space.body(rock).isAsleep());
  SECTION("moved") { space.body(below).position() = Vec(0, 0, -1); }
  SECTION("freed") { space.body(below).setFixed(false); }
  SECTION("removed") { space.removeBody(below); }
  advance(space, 1);
  CHECK_FALSE(space.body(rock).isAsleep());
  advance(space, 60);
  CHECK(space.body(rock).position()[2] < 1.4);
}

// However long it had been at rest before. Seen to fail: only velocities were looked at, which moving a body
// out of another leaves as they are: it slept after 2 to 12 steps, with up to 0.2 of the overlap of 0.25.
TEST_CASE("Nobody falls asleep while it is moved out of another") {
  const std::size_t before = GENERATE(20U, 28U, 29U, 30U, 40U);  // asleep after 31
  SimulationConfig<double> config = sleepy();
  config.positionalCorrectionFactor = 0.2;
  Space<double> space(config);
  space.setUniformField({0, 0, -g});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  Body<double> post = ball({5, 0, 0.5}, {0, 0, 0}, 0.5);
  advance(space, before);
  post.position = Vec(0.75, 0, 0.5);
  SECTION("fixed") { post.fixed = true; }
  SECTION("free") {}
  space.addBody(post);
  advance(space, 200);
  CHECK(space.body(0).isAsleep());
  // Overlaps of 4e-4, a fifth of which is sleepSpeed h, have 30 more steps; below 1e-4 R they are left alone.
  const double overlap = 1.0 - Vec(space.body(1).position() - space.body(0).position()).norm();
  CHECK(overlap < 1e-4 * 0.5);
}

// Seen to fail: only what an island leaned on was looked at, and fixed bodies stood in sleepers for ever.
TEST_CASE("A fixed body that is put into sleepers wakes them, and is left by them") {
  Space<double> space(sleepy());
  space.setUniformField({0, 0, -g});
  space.addPlane({0, 0, 1}, 0.0);
  const BodyId rock = space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  const BodyId other = space.addBody(ball({-3, 0, 0.5}, {0, 0, 0}, 0.5));
  Body<double> post = ball({5, 0, 0.5}, {0, 0, 0}, 0.5);
  post.fixed = true;
  const BodyId far = space.addBody(post);
  advance(space, 40);
  REQUIRE(sleepers(space) == 2);
  const auto putInto = [&](Space<double>& where) {
    SECTION("added") {
      post.position = Vec(0.75, 0, 0.5);
      where.addBody(post);
    }
    SECTION("moved") { where.body(far).position() = Vec(0.75, 0, 0.5); }
    SECTION("grown") { where.body(far).radius() = 4.75; }
    SECTION("fixed") {
      post.position = Vec(0.75, 0, 0.5);
      post.fixed = false;
      where.body(where.addBody(post)).setFixed(true);
    }
  };
  SECTION("at once") { putInto(space); }
  SECTION("before a file") {
    putInto(space);
    const TemporaryFile file("fixed_among_sleepers.snapshot");
    space.save(file.path());
    space.restore(file.path());
  }
  SECTION("after a file") {
    const TemporaryFile file("fixed_beside_sleepers.snapshot");
    space.save(file.path());
    space.restore(file.path());
    putInto(space);
  }
  advance(space, 1);
  CHECK_FALSE(space.body(rock).isAsleep());
  CHECK(space.body(other).isAsleep());
  advance(space, 100);
  CHECK_THAT(space.body(rock).position()[0], WithinAbs(-0.25, 1e-3));
  CHECK(sleepers(space) == 2);
}

// The pile wakes in the step in which the ball arrives, before the blow: the blow is that of bodies that can
// move. Seen to fail: those who wake do so a step later (the ball bounces as from a rock). Sweeps end where
// nothing changes any more, since by the default tolerance of 1e-3 one of them more makes a difference of
// 2e-4.
TEST_CASE("A ball that hits a heap asleep does what it does to one awake") {
  const auto hit = [](double sleepSpeed) {
    SimulationConfig<double> config = sleepy(sleepSpeed);
    config.contactTolerance = 1e-9;
    config.contactIterations = 5000;
    Space<double> space = asleep(config);
    CHECK(sleepers(space) == (sleepSpeed > 0 ? 15 : 0));
    space.addBody(ball({1.1, 1.05, 6}, {0, 0, -15}, 0.5, 4.0));
    int woke = 0;
    int blow = 0;
    const double before = space.energyLedger().total();
    for (int k = 1; k <= 30; ++k) {
      space.computeDynamics(0);
      woke = woke == 0 && !space.body(0).isAsleep() ? k : woke;
      blow = blow == 0 && !space.impacts().empty() ? k : blow;
    }
    CHECK(blow > 20);
    if (sleepSpeed > 0) {
      CHECK((woke == blow || woke == blow - 1));
    }
    CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-6 * std::abs(before)));
    return stateOf(space);
  };
  const std::vector<double> awake = hit(0.0);
  const std::vector<double> slept = hit(1e-2);
  CHECK(difference(awake, slept) < 1e-6);
}

// Newton's cradle, in steps that take the ball 0.5 to 10 radii further.
// Seen to fail: only those woken whom a ball comes near to itself. Then the first of the row, thrown on
// within the step, found the second one fixed, and the ball came back at its own speed.
TEST_CASE("Sleepers in a row pass a blow on as they do awake, however many of them it meets in a step") {
  for (const double radii : {0.5, 1.0, 3.0, 10.0}) {
    for (const double gap : {0.001, 0.01}) {
      CAPTURE(radii, gap);
      SimulationConfig<double> config = plain(1e-2);
      config.coeffRestitution = 1;
      config.sleepSpeed = 1e-2;
      config.sleepTime = 0.1;
      Space<double> space(config);
      space.setUniformField({0, 0, -g});
      space.addPlane({0, 0, 1}, 0.0);
      for (int i = 0; i < 5; ++i) {
        space.addBody(ball({(0.2 + gap) * i, 0, 0.1}, {0, 0, 0}, 0.1));
      }
      advance(space, 60);
      REQUIRE(sleepers(space) == 5);
      const double v = radii * 0.1 / 1e-2;
      space.addBody(ball({-1, 0, 0.1}, {v, 0, 0}, 0.1));
      advance(space, static_cast<std::size_t>(3 / (v * 1e-2)) + 1);
      for (std::size_t i = 0; i < 6; ++i) {
        CHECK_THAT(space.body(i).velocity()[0], WithinAbs(i == 4 ? v : 0.0, 1e-13 * v));
      }
    }
  }
}

// Seen to fail: as above. Then the wall pressed balls against those that still slept: impulses of up to 6e11
// times what it takes, a ledger that moved by up to 2e6 times the energy of motion, and balls behind the
// wall.
TEST_CASE("A wall that comes through sleepers at many radii a step takes all of them along") {
  for (const std::size_t parts : {std::size_t{1}, std::size_t{4}}) {
    for (const double restitution : {0.0, 0.5}) {
      for (const double radii : {3.0, 30.0}) {
        CAPTURE(parts, restitution, radii);
        const double h = 1e-2;
        SimulationConfig<double> config = plain(h);
        config.coeffRestitution = restitution;
        config.coeffFriction = 0.4;
        config.coeffStaticFriction = 0.5;
        config.sleepSpeed = 1e-2;
        config.sleepTime = 0.1;
        config.contactSubsteps = parts;
        Space<double> space(config);
        space.setUniformField({0, 0, -g});
        const std::size_t floor = space.addPlane({0, 0, 1}, 0.0);
        const std::size_t wall = space.addPlane({1, 0, 0}, -5.0);
        for (int i = 0; i < 10; ++i) {
          space.addBody(ball({0.3 * (i / 2), 0, 0.1 + 0.2 * (i % 2)}, {0, 0, 0}, 0.1));
        }
        advance(space, 60);
        REQUIRE(sleepers(space) == 10);
        const double before = space.energyLedger().total();
        const double v = radii * 0.1 / h;
        space.setPlaneVelocity(wall, {v, 0, 0});
        double impulse = 0;
        for (int k = 0; k < static_cast<int>(6 / (v * h)) + 1; ++k) {
          advance(space, 1);
          impulse -= h * (space.planeForce(wall)[0] + space.planeForce(floor)[0]);
        }
        double momentum = 0;
        for (const auto body : space.bodies()) {
          momentum += body.velocity()[0];
          CHECK(body.position()[0] > space.planes()[1].offset + 0.09);
        }
        CHECK(momentum > 10 * v * 0.99);
        CHECK_THAT(momentum, WithinRel(impulse, 1e-12));
        CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-12 * 10 * v * v));
      }
    }
  }
}

TEST_CASE("Sleep and waking are the same bits for any number of threads and through a file") {
  const auto run = [](int threads, int saveAt) {
    const WithThreads with(threads);
    const TemporaryFile file("sleep");
    Space<double> space = pyramid();
    std::vector<Vec> loads;
    for (int k = 0; k < 130; ++k) {
      if (k == 60) {
        space.addBody(ball({1.1, 1.05, 4}, {0, 0, -5}, 0.5, 4.0));
      }
      if (k == saveAt) {
        space.save(file.path());
        Space<double> again;
        again.restore(file.path());
        space = std::move(again);
      }
      space.computeDynamics(0);
      loads.push_back(space.planeForce(0));
    }
    CHECK(sleepers(space) >= 1);  // the one aside at least
    std::vector<double> state = stateOf(space);
    for (const Vec& load : loads) {
      state.insert(state.end(), load.data(), load.data() + 3);
    }
    return state;
  };
  const std::vector<double> whole = run(1, -1);
  CHECK(sameBits(whole, run(3, -1)));
  for (const int saveAt : {20, 30, 31, 50, 60, 61, 90}) {
    CAPTURE(saveAt);
    CHECK(sameBits(whole, run(1, saveAt)));
  }
}

// Who looks for what comes near to sleepers may search for neighbours; bodies near boundaries are to be
// looked for again then, too. They were not, and the ball fell through the floor.
TEST_CASE("A ball that falls far beside sleepers lands on the floor, and bounces as without them") {
  for (const double height : {2.0, 5.0, 11.0}) {
    std::vector<double> heights[2];
    for (const bool sleeps : {false, true}) {
      Space<double> space(sleepy(sleeps ? 1e-2 : 0));
      space.setUniformField({0, 0, -g});
      space.addPlane({0, 0, 1}, 0.0);
      space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5, 2.0));
      const BodyId falling = space.addBody(ball({30, 0, height}, {0, 0, 0}, 0.5, 2.0));
      for (std::size_t k = 0; k < 200; ++k) {
        space.computeDynamics(k);
        heights[sleeps ? 1 : 0].push_back(Vec(space.body(falling).position())[2]);
        if (k == 60) {
          CHECK(sleepers(space) == (sleeps ? 1 : 0));
        }
      }
    }
    CHECK(*std::min_element(heights[1].begin(), heights[1].end()) > 0.5 - 1e-3);
    CHECK(heights[0] == heights[1]);
  }
}

TEST_CASE("What comes, or changes, while everything sleeps is looked for at once") {
  // Without a field nothing falls: only who looks finds the ball that reaches into the floor.
  SimulationConfig<double> config = sleepy();
  config.positionalCorrectionFactor = 0.5;
  Space<double> still(config);
  still.addPlane({0, 0, 1}, 0.0);
  still.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  advance(still, 60);
  REQUIRE(sleepers(still) == 1);
  const BodyId deep = still.addBody(ball({5, 0, 0.4}, {0, 0, 0}, 0.5));
  advance(still, 1);
  CHECK_THAT(Vec(still.body(deep).position())[2], WithinAbs(0.45, 1e-12));

  // A heap whose field is turned wakes with its contacts, as from a file.
  Space<double> space(sleepy());
  space.setUniformField({0, 0, -g});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  space.addBody(ball({0, 0, 1.5}, {0, 0, 0}, 0.5));
  advance(space, 60);
  REQUIRE(sleepers(space) == 2);
  space.setUniformField({1, 0, -g});
  const TemporaryFile file("turned");
  space.save(file.path());
  Space<double> again;
  again.restore(file.path());
  for (std::size_t k = 0; k < 5; ++k) {
    space.computeDynamics(k);
    again.computeDynamics(k);
    CHECK(space.contacts().size() == 2);
    CHECK(sameBits(stateOf(space), stateOf(again)));
  }
}

namespace {

/// Two that touch side by side on a floor, and a hook by which a grain of id 2 merges into the second one.
Space<double> sideBySide(double sleepSpeed, std::size_t parts = 1) {
  SimulationConfig<double> config = plain(1e-2);
  config.sleepSpeed = sleepSpeed;
  config.sleepTime = 0.25;
  config.contactSubsteps = parts;
  Space<double> space(config);
  space.setUniformField({0, 0, -g});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  space.addBody(ball({1 - 1e-12, 0, 0.5}, {0, 0, 0}, 0.5));
  advance(space, 60);
  CHECK(sleepers(space) == (sleepSpeed > 0 ? 2 : 0));
  space.setCollisionHook([](const Collision<double>& hit) {
    return hit.first.id == BodyId{1} && hit.second.id == BodyId{2} ? CollisionOutcome<double>::merge()
                                                                   : CollisionOutcome<double>::bounce();
  });
  return space;
}

}  // namespace

// Somebody puts the grain onto the sleeper's surface: they merge at once. Seen to fail: the neighbour woke
// only after contacts had been found, and then leant on the others once more (3/4 of the weight).
TEST_CASE("A sleeper that takes up a grain leaves its neighbours as they would be awake") {
  const auto run = [](double sleepSpeed) {
    Space<double> space = sideBySide(sleepSpeed);
    space.addBody(ball({1, 0.549, 0.5}, {0, -1, 0}, 0.05, 1e-3));
    advance(space, 1);
    CHECK(space.n() == 2);
    CHECK(space.contacts().size() == 3);
    std::vector<double> state = stateOf(space);
    state.push_back(space.planeForce(0)[2] / (2.001 * g));
    CHECK_THAT(state.back(), WithinRel(-1.0, 1e-3));  // to the solver's tolerance
    return state;
  };
  CHECK(difference(run(0.0), run(1e-2)) < 1e-12);
}

// Another grain drives it there in the second part of a step, which nobody foresees. Seen to fail: what had
// been found with the neighbour came once more when that woke (6 % less than the weight).
TEST_CASE("Who merges into a sleeper inside a step leaves each contact once") {
  Space<double> space = sideBySide(1e-2, 4);
  space.addBody(ball({1, 0.557, 0.5}, {0, 0, 0}, 0.05, 1e-3));
  space.addBody(ball({1, 0.65811, 0.5}, {0, -1, 0}, 0.0501, 1e-2));
  REQUIRE(sleepers(space) == 2);
  advance(space, 2);
  CHECK(space.n() == 3);
  CHECK(space.contacts().size() == 3);
  CHECK_THAT(space.planeForce(0)[2], WithinRel(-2.001 * g, 1e-3));
}

TEST_CASE("A plane or a box that is refused wakes nobody") {
  Space<double> space = asleep();
  const std::size_t before = sleepers(space);
  REQUIRE(before > 0);
  CHECK_THROWS_AS(space.addPlane({0, 0, 0}, 0), std::invalid_argument);
  CHECK_THROWS_AS(space.addBox({1, 1, 1}, {0, 0, 0}), std::invalid_argument);
  advance(space, 1);
  CHECK(sleepers(space) == before);
}

TEST_CASE("Sleep is refused where nothing rests or touches") {
  for (const IntegratorKind kind :
       {IntegratorKind::SymplecticEpicycle, IntegratorKind::GaussRadau15, IntegratorKind::Hermite4}) {
    SimulationConfig<double> config;
    config.sleepSpeed = 1e-3;
    config.integrator = kind;
    CHECK_THROWS_WITH(config.validate(), ContainsSubstring("sleepSpeed is 0.001; allowed: 0 with") &&
                                             ContainsSubstring(traitsOf(kind).name));
  }
}

// Seen to fail: looked for along the way of the step, which is none, it was a fixed ball to what struck it.
TEST_CASE("A sleeper wakes for what reaches it within a step and is back at its end") {
  const double h = 0.1, up = g * h / 2;
  SimulationConfig<double> config = plain(h);
  config.coeffRestitution = 1;
  config.sleepSpeed = 0.1;
  config.sleepTime = 0.2;
  Space<double> space(config);
  space.setUniformField({0, 0, -g});
  for (const double x : {-0.8, 0.8}) {
    Body<double> bearer = ball({x, 0, 1}, {0, 0, 0}, 0.5);
    bearer.fixed = true;
    space.addBody(bearer);
  }
  const BodyId sleeper = space.addBody(ball({0, 0, 1.6}, {0, 0, 0}, 0.5));
  for (int k = 0; k < 40; ++k) {
    space.computeDynamics(0);
  }
  REQUIRE(space.body(sleeper).isAsleep());
  space.addBody(ball({0, 0, 1.1 - 0.01 - 8e-3}, {0, 0, up}, 0.01, 0.01));  // which would rise by 0.012
  space.computeDynamics(0);
  CHECK(space.impacts().size() == 1);
  CHECK_FALSE(space.body(sleeper).isAsleep());
}

}  // namespace test_sleeping
