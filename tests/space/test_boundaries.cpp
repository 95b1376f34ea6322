#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/temporary_file.hpp"

#include <array>

// Planes that move, leave and come; boxes.

using namespace gravel;
using namespace gravel::test;

namespace test_boundaries {

namespace {

const double g = 9.81;

Space<double> onFloor(double dt, double friction = 0.0, std::size_t parts = 1) {
  SimulationConfig<double> config = plain(dt);
  config.contactSubsteps = parts;
  config.coeffFriction = config.coeffStaticFriction = friction;
  config.coeffRestitution = 0.5;
  Space<double> space(config);
  space.addPlane({0, 0, 1}, 0.0);
  space.setUniformField({0, 0, -g});
  return space;
}

Space<double> onBelt(double dt, double kinetic, std::size_t parts) {
  SimulationConfig<double> config = plain(dt);
  config.coeffStaticFriction = 0.4;
  config.coeffFriction = kinetic;
  config.contactSubsteps = parts;
  Space<double> space(config);
  space.addPlane({0, 0, 1}, 0.0);
  space.setUniformField({0, 0, -g});
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5, 2.0));
  return space;
}

/// Steps `first` to `last` on a belt with the velocity a t.
void speedUp(Space<double>& space, double a, int first, int last) {
  for (int k = first; k <= last; ++k) {
    space.setPlaneVelocity(0, {a * k * space.getTimeStep(), 0, 0});
    advance(space, 1);
  }
}

}  // namespace

TEST_CASE("A floor that rises evenly lifts what rests on it, and does its work") {
  Space<double> space = onFloor(1e-2);
  space.addBody(ball({0, 0, 1}, {0, 0, 2}, 1.0, 3.0));
  space.setPlaneVelocity(0, {0, 0, 2});
  const double before = space.energyLedger().total();
  advance(space, 200);
  CHECK_THAT(space.planes()[0].offset, WithinRel(4.0, 1e-14));
  CHECK_THAT(space.body(0).position()[2], WithinRel(5.0, 1e-13));
  const EnergyLedger<double> ledger = space.energyLedger();
  // 200 steps book 3 x 9.81 x 2 x 0.01 each.
  CHECK_THAT(-ledger.work, WithinRel(3 * g * 4.0, 1e-12));
  CHECK_THAT(ledger.total(), WithinAbs(before, 1e-12 * 3 * g * 4.0));
  CHECK(std::abs(ledger.restitution) < 1e-12 * 3 * g * 4.0);
}

// Seen to fail: each contact given a surface of its own; the old ones kept.
TEST_CASE("However often a plane's velocity is set, what rests on it shares as few surfaces as before") {
  Space<double> space = onFloor(1e-2);
  for (int k = 0; k < 20; ++k) {
    Body<double> body = ball({3.0 * k, 0, 0.999}, {0, 0, 0}, 1.0, 3.0);
    body.material = k % 2 == 0 ? defaultMaterial : space.addMaterial({.restitution = 0.2});
    space.addBody(body);
  }
  advance(space, 1);
  REQUIRE(space.contacts().size() == 20);
  std::vector<Material<double>> materials;
  for (const Contact<double>& c : space.contacts()) {
    materials.push_back(space.contacts().material(c));
  }
  for (int k = 0; k < 5; ++k) {
    const Vector3<double> velocity(k, 0, 0);
    space.setPlaneVelocity(0, velocity);
    CHECK(space.contacts().surfaces.size() <= 11);
    for (std::size_t c = 0; c < 20; ++c) {
      CHECK(space.contacts().drift(space.contacts()[c]) == velocity);
      CHECK(space.contacts().material(space.contacts()[c]) == materials[c]);
    }
  }
}

TEST_CASE("A piston of speed V turns -v into v + 2V for an elastic ball, and books the energy as work") {
  SimulationConfig<double> config = plain(1e-3);
  config.coeffRestitution = 1.0;
  Space<double> space(config);
  const std::size_t piston = space.addPlane({0, 0, 1}, -1.0);
  space.addBody(ball({0, 0, 1}, {0, 0, -3}, 0.5, 2.0));
  space.setPlaneVelocity(piston, {0, 0, 0.75});
  advance(space, 1000);
  CHECK_THAT(space.body(0).velocity()[2], WithinRel(3 + 2 * 0.75, 1e-15));
  CHECK_THAT(-space.energyLedger().work, WithinRel(4.5 * 4.5 - 9.0, 1e-14));
  CHECK_THAT(space.energyLedger().total(), WithinRel(9.0, 1e-14));
}

// Seen to fail: a first look at walls that leaves out their own way.
TEST_CASE("A wall that comes within a step strikes a ball at rest at its own time") {
  SimulationConfig<double> config = plain(0.1);
  config.coeffRestitution = 1.0;
  Space<double> space(config);
  const std::size_t piston = space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 1}, {0, 0, 0}, 0.5, 2.0));
  space.setPlaneVelocity(piston, {0, 0, 8});
  advance(space, 1);  // met after 0.5/8 of 0.1, then at 16
  CHECK(space.contactReport().impacts == 1);
  CHECK_THAT(space.body(0).velocity()[2], WithinRel(16.0, 1e-15));
  CHECK_THAT(space.body(0).position()[2], WithinRel(1 + 16 * (0.1 - 0.0625), 1e-15));
  CHECK_THAT(-space.energyLedger().work, WithinRel(256.0, 1e-14));
}

// In the frame of the belt: a ball that starts to slide at V rolls at 5/7 V from t = 2 V/(7 mu g) on (case B5
// of the contact theory page); on the ground that is 2/7 V.
TEST_CASE("A conveyor belt drags a ball from rest to rolling at 2/7 of its speed") {
  const double V = 1.4;
  const double mu = 0.25;
  const double dt = 1e-3;
  Space<double> space = onFloor(dt, mu);
  space.addBody(ball({0, 0, 0.1}, {0, 0, 0}, 0.1, 2.0));
  const std::size_t belt = 0;
  space.setPlaneVelocity(belt, {V, 0, 0});
  const double rollsAt = 2 * V / (7 * mu * g);
  const auto steps = static_cast<std::size_t>(rollsAt / dt);
  advance(space, steps);
  // Still sliding: the acceleration is mu g, to rounding of some hundred steps.
  CHECK_THAT(space.body(0).velocity()[0], WithinRel(mu * g * dt * static_cast<double>(steps), 1e-12));
  advance(space, 50);
  const double v = space.body(0).velocity()[0];
  CHECK_THAT(v, WithinRel(2.0 / 7.0 * V, 1e-12));
  CHECK_THAT(v - 0.1 * space.body(0).angularVelocity()[1], WithinRel(V, 1e-12));  // no slip on the belt
  const EnergyLedger<double> ledger = space.energyLedger();
  const double scale = V * V;
  CHECK_THAT(ledger.total(), WithinAbs(2.0 * g * 0.1, 1e-12 * scale));
  // Work of the belt V m v_f; half of the relative energy that B5 loses, m V^2/7, is friction.
  CHECK_THAT(-ledger.work, WithinRel(2.0 * V * 2.0 / 7.0 * V, 1e-9));
  CHECK_THAT(ledger.friction, WithinRel(2.0 * V * V / 7.0, 1e-9));
  CHECK(space.planes()[belt].offset == 0.0);
}

// Seen to fail: contacts that were found on the standing belt kept as they were, whose friction sees the belt
// in the second half of the step alone.
TEST_CASE("A belt that starts under a resting ball drags it with mu g from the first step on") {
  const double mu = 0.25;
  const double dt = 1e-3;
  Space<double> space = onFloor(dt, mu);
  space.addBody(ball({0, 0, 0.1}, {0, 0, 0}, 0.1, 2.0));
  advance(space, 10);
  space.setPlaneVelocity(0, {1.4, 0, 0});
  advance(space, 1);
  CHECK_THAT(space.body(0).velocity()[0], WithinRel(mu * g * dt, 1e-12));
}

// Carried without slip a ball has 2/7 of the belt's acceleration a, by the friction 2/7 m a; so it is carried
// while a <= 7/2 mu_s g, and slides with mu_k g beyond. Both to the rounding of 100 steps.
// Seen to fail: the belt's new velocity from the step's begin on, as it was once: then the first solve has
// half of a part's weight to follow a whole step's change, and what slips with mu_k < mu_s never sticks
// again.
TEST_CASE(
    "A belt that speeds up carries what rests on it up to the static threshold, in any number of parts") {
  for (const double dt : {1e-2, 1e-3}) {
    for (const std::size_t parts : {std::size_t{1}, std::size_t{4}}) {
      for (const double kinetic : {0.0, 0.25, 0.4}) {
        for (const double ratio : {0.99, 1.01}) {
          CAPTURE(dt, parts, kinetic, ratio);
          const double a = ratio * 3.5 * 0.4 * g;
          const int steps = 100;
          Space<double> space = onBelt(dt, kinetic, parts);
          advance(space, 1);
          const double before = space.energyLedger().total();
          speedUp(space, a, 1, steps);
          const double expected = (ratio < 1 ? 2.0 / 7.0 * a : kinetic * g) * dt * steps;
          const double v = space.body(0).velocity()[0];
          CHECK_THAT(v, WithinAbs(expected, 1e-13 * a * dt * steps));
          const double slip = a * dt * steps - (v - 0.5 * space.body(0).angularVelocity()[1]);
          CHECK_THAT(slip, WithinAbs(a * dt * steps - 3.5 * expected, 1e-12 * a * dt * steps));
          const EnergyLedger<double> ledger = space.energyLedger();
          CHECK_THAT(ledger.total(), WithinAbs(before, 1e-12 * (before + std::pow(a * dt * steps, 2))));
          CHECK(ledger.friction >= 0.0);
          CHECK(-ledger.work >= v * v);
        }
      }
    }
  }
}

// Seen to fail: a velocity that new planes come to within their first step.
TEST_CASE("A belt runs from the start, and what moves along with it feels nothing") {
  for (const std::size_t parts : {std::size_t{1}, std::size_t{4}}) {
    Space<double> space = onBelt(1e-3, 0.25, parts);
    space.body(0).velocity() = Vec(1e-3, 0, 0);
    space.setPlaneVelocity(0, {1e-3, 0, 0});
    advance(space, 100);
    CHECK(space.body(0).velocity()[0] == 1e-3);
    CHECK(space.body(0).angularVelocity() == Vec(0, 0, 0));
    CHECK(space.energyLedger().friction == 0.0);
  }
}

// Seen to fail: snapshots that forget the velocity before, or which planes are new; the velocity before taken
// from the last call.
TEST_CASE("A belt on its way to a velocity goes on alike after a restart, a copy and second thoughts") {
  const TemporaryFile file("belt");
  const double a = 0.95 * 3.5 * 0.4 * g;
  for (const bool starts : {false, true}) {
    Space<double> whole = onBelt(1e-2, 0.0, 4);
    Space<double> doubtful = whole;
    for (Space<double>* space : {&whole, &doubtful}) {
      if (!starts) {
        advance(*space, 1);
        speedUp(*space, a, 1, 20);
        if (space == &doubtful) {
          space->setPlaneVelocity(0, {-3, 1, 0});
        }
        space->setPlaneVelocity(0, {a * 21e-2, 0, 0});
      }
    }
    whole.save(file.path());
    Space<double> again;
    again.restore(file.path());
    Space<double> copy = whole;
    for (Space<double>* space : {&whole, &doubtful, &again, &copy}) {
      if (starts) {
        space->setPlaneVelocity(0, {1e-3, 0, 0});
      }
      advance(*space, 1);
      speedUp(*space, a, 22, 30);
    }
    CHECK(sameBits(stateOf(whole), stateOf(doubtful)));
    CHECK(sameBits(stateOf(whole), stateOf(again)));
    CHECK(sameBits(stateOf(whole), stateOf(copy)));
    CHECK(whole.energyLedger().work == again.energyLedger().work);
    CHECK((starts || std::abs(whole.body(0).velocity()[0] - 2.0 / 7.0 * a * 0.3) < 1e-12));
  }
}

// A plate that shakes with less than g carries the ball along: position to the gap that a resting contact may
// have, force over a step m (g + a) with the a of its middle to second order: what three velocities of the
// prescribed path tell of it has the relative error 7/24 (omega dt)^2. (The first steps start from a plate at
// rest; where a changes its sign, steps do not follow what changes.)
TEST_CASE("A shaking plate that never falls faster than g carries the ball, with the force m (g + a)") {
  const double A = 0.01;
  const double omega = 20.0;  // A omega^2 = 4 m/s^2
  const double dt = 1e-3;
  SimulationConfig<double> config = plain(dt);
  config.coeffRestitution = 0.0;
  Space<double> space(config);
  const std::size_t plate = space.addPlane({0, 0, 1}, 0.0);
  space.setUniformField({0, 0, -g});
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5, 2.0));
  const auto height = [&](double t) { return A * (1 - std::cos(omega * t)); };
  double worstForce = 0.0;
  for (std::size_t i = 0; i < 1000; ++i) {
    const double t = space.time();
    space.setPlaneVelocity(plate, {0, 0, (height(t + dt) - height(t)) / dt});
    space.computeDynamics(i);
    REQUIRE_THAT(space.body(0).position()[2] - 0.5, WithinAbs(height(space.time()), 1e-7));
    REQUIRE(space.contactCount() == 1);
    const double force = space.contactImpulses()[0].normal / dt;
    const double mean = 2.0 * (g + A * omega * omega * std::cos(omega * (t + dt / 2)));
    if (i > 2 && std::abs(std::cos(omega * t)) > 4 * omega * dt) {
      worstForce = std::max(worstForce, std::abs(force - mean));
    }
  }
  CHECK_THAT(worstForce, WithinRel(2.0 * A * omega * omega * std::pow(omega * dt, 2) * 7.0 / 24.0, 0.01));
}

/// A plate with the path A (w t - sin w t), so that it is pressed upwards first, and balls on it.
struct ShakenPlate {
  double amplitude, omega;

  double height(double t) const { return amplitude * (omega * t - std::sin(omega * t)); }
  double speed(double t) const { return amplitude * omega * (1 - std::cos(omega * t)); }
  double acceleration(double t) const { return amplitude * omega * omega * std::sin(omega * t); }
};

/// Step `i` of the space after one in which the plate stood.
void shake(Space<double>& space, const ShakenPlate& plate, int i, double dt) {
  const double t = i * dt;
  space.setPlaneVelocity(0, {0, 0, (plate.height(t + dt) - plate.height(t)) / dt});
  advance(space, 1);
}

// A ball rests on a plate as long as that does not fall faster than g, however fast it rises. At the ends of
// steps it has the plate's place and velocity. The latter is found from two steps: (omega dt)^2/3 of A omega
// is lost so, and 2/3 where a change is limited by the one before. For that one reason the force over a step,
// two velocities over dt, may be off by omega dt of A omega^2. With parts the plate's way in a step is a
// parabola, whose middle is off by less than (omega dt)^3/6 of A. Seen to fail: the new velocity along the
// normal at once, when gaps of 7e-3 A opened and shut at 0.9 g, at 3 g with restitution of 1.3e-2 A, the
// velocity was off by omega dt/2, and forces by 1.1 to 2.8 A omega^2.
TEST_CASE("A shaking plate carries a ball while it does not fall faster than g, however it bounces") {
  const double omega = 125;
  for (const double dt : {1e-3, 2.5e-4}) {
    for (const double strength : {0.4, 0.9, 3.0, 8.0}) {  // A omega^2/g
      for (const double e : {0.0, 0.9}) {
        for (const std::size_t parts : {std::size_t{1}, std::size_t{4}}) {
          CAPTURE(dt, strength, e, parts);
          const ShakenPlate plate{strength * g / (omega * omega), omega};
          SimulationConfig<double> config = plain(dt);
          config.coeffRestitution = e;
          config.contactSubsteps = parts;
          Space<double> space(config);
          space.addPlane({0, 0, 1}, 0.0);
          space.setUniformField({0, 0, -g});
          space.addBody(ball({0, 0, 0.01}, {0, 0, 0}, 0.01, 2.0));
          advance(space, 1);
          const double before = space.energyLedger().total();
          double gap = 0.0, speed = 0.0, force = 0.0;
          const double turn = strength < 1 ? 2 * pi<double>() : pi<double>() + std::asin(0.9 / strength);
          for (int i = 0; (i + 1) * dt * omega < turn; ++i) {
            shake(space, plate, i, dt);
            const double t = (i + 1) * dt;
            gap = std::max(gap, std::abs(space.body(0).position()[2] - 0.01 - plate.height(t)));
            speed = std::max(speed, std::abs(space.body(0).velocity()[2] - plate.speed(t)));
            force =
                std::max(force, std::abs(-space.planeForce(0)[2] / 2.0 - g - plate.acceleration(t - dt / 2)));
          }
          const double x = omega * dt;
          CHECK(gap < (parts == 1 ? 1e-12 : x * x * x / 6) * plate.amplitude);
          CHECK(speed < x * x * plate.amplitude * omega);
          CHECK(force < x * plate.amplitude * omega * omega);
          CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-13));
        }
      }
    }
  }
}

// A plate stands and then goes on speeding up, by many g. What it throws up bounces lower and lower and rests
// on it, with a gap that a contact at rest keeps at most. Seen to fail: what bounces no faster than the plate
// comes on in the step leaves with the plate's mean velocity alone, and sinks by g h^2/2 in each step, 0.2
// and 0.1 of the radius in a second.
TEST_CASE("A plate that goes on speeding up carries a ball, however much faster than it falls") {
  for (const double dt : {4e-3, 2e-3}) {
    for (const double strength : {2.0, 5.0, 30.0}) {  // of g
      for (const double e : {0.1, 0.5, 0.9}) {
        CAPTURE(dt, strength, e);
        const double a = strength * g;
        SimulationConfig<double> config = plain(dt);
        config.coeffRestitution = e;
        Space<double> space(config);
        space.addPlane({0, 0, 1}, 0.0);
        space.setUniformField({0, 0, -g});
        space.addBody(ball({0, 0, 0.1}, {0, 0, 0}, 0.1));
        advance(space, 10);
        const double start = space.time(), before = space.energyLedger().total();
        const auto height = [&](double t) { return a * (t - start) * (t - start) / 2; };
        while (space.time() < start + 1) {
          const double t = space.time();
          space.setPlaneVelocity(0, {0, 0, (height(t + dt) - height(t)) / dt});
          advance(space, 1);
        }
        const double t = space.time();
        CHECK_THAT(space.body(0).position()[2] - 0.1 - height(t), WithinAbs(0, 0.1e-3 / 64));
        CHECK_THAT(space.body(0).velocity()[2], WithinRel(a * (t - start), 1e-9));
        CHECK_THAT(-space.planeForce(0)[2], WithinRel(a + g, 1e-6));
        CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-12 * a * a));
      }
    }
  }
}

// From a plate that speeds up by A what has no weight is seen to fall by A, and rests on it like what has:
// balls of a stack have the plate's velocity, and the plate bears all of them. What lands on it comes to rest
// after the time of all bounces, v (1 + e)/((1 - e) A) at v from its start. Seen to fail, as nothing but |a|
// told a gap of rounding from one that opens: a ball was a contact in one step and struck in the next, its
// velocity off by A h/2; stacks never rested, with velocities off by up to 1.4 A h and the force by 1.0 of
// itself, and what landed did so for 5 to 50 steps more.
TEST_CASE("What has no weight rests on a plate that goes on speeding up, alone, stacked and after a fall") {
  for (const double dt : {2e-3, 1e-3}) {
    for (const double a : {g, 10 * g}) {
      for (const double e : {0.0, 0.5, 0.9}) {
        for (const std::size_t parts : {std::size_t{1}, std::size_t{4}}) {
          for (const int balls : {1, 2, 5, 10}) {
            CAPTURE(dt, a, e, parts, balls);
            SimulationConfig<double> config = plain(dt);
            config.coeffRestitution = e;
            config.coeffFriction = config.coeffStaticFriction = 0.5;
            config.contactSubsteps = parts;
            Space<double> space(config);
            space.addPlane({0, 0, 1}, 0.0);
            for (int k = 0; k < balls; ++k) {
              space.addBody(ball({0, 0, 0.1 + 0.2 * k}, {0, 0, 0}, 0.1));
            }
            double speed = 0.0, force = 0.0;
            std::size_t blows = 0;
            for (int i = 0; i * dt < 1; ++i) {
              space.setPlaneVelocity(0, {0, 0, a * (i + 0.5) * dt});
              advance(space, 1);
              if (i * dt > 0.7) {
                blows += space.impacts().size();
                force = std::max(force, std::abs(-space.planeForce(0)[2] / (balls * a) - 1));
                for (std::size_t k = 0; k < space.n(); ++k) {
                  speed = std::max(speed, std::abs(space.body(k).velocity()[2] - a * (i + 1) * dt));
                }
              }
            }
            CHECK(blows == 0);
            CHECK(speed < 1e-6 * a * dt);
            CHECK(force < 1e-6);
            CHECK_THAT(space.energyLedger().total(), WithinAbs(0, 1e-12 * balls * a * a));
          }
        }
      }
    }
  }
  for (const double e : {0.0, 0.5}) {
    for (const double dt : {2e-3, 1e-3}) {
      for (const std::size_t parts : {std::size_t{1}, std::size_t{3}}) {
        CAPTURE(e, dt, parts);
        SimulationConfig<double> config = plain(dt);
        config.coeffRestitution = e;
        config.contactSubsteps = parts;
        Space<double> space(config);
        space.addPlane({0, 0, 1}, 0.0);
        space.addBody(ball({0, 0, 0.105}, {0, 0, 0}, 0.1));
        const double a = 2 * g, end = std::sqrt(2 * 0.005 / a) * (1 + e) / (1 - e);
        double last = 0.0;
        for (int i = 0; i * dt < 0.5; ++i) {
          space.setPlaneVelocity(0, {0, 0, a * (i + 0.5) * dt});
          advance(space, 1);
          last = space.impacts().empty() ? last : space.time();
        }
        CHECK_THAT(last, WithinAbs(end, 2 * dt));
      }
    }
  }
}

// By the principle of equivalence a blow on what rests so is that in a field. Seen to fail, by a velocity of
// the ball that rests that is off by up to A h/2: places were off by 2.2e-3, 6.3e-4 and 1.4e-4 m for e = 0.9
// as steps are halved.
TEST_CASE("A ball strikes one that rests on a plate which speeds up as it does in a field") {
  for (const double dt : {4e-3, 2e-3, 1e-3}) {
    for (const double e : {0.5, 0.9}) {
      CAPTURE(dt, e);
      const auto placesAfter = [&](bool carried) {
        SimulationConfig<double> config = plain(dt);
        config.coeffRestitution = e;
        config.coeffFriction = config.coeffStaticFriction = 0.5;
        Space<double> space(config);
        space.addPlane({0, 0, 1}, 0.0);
        space.setUniformField({0, 0, carried ? 0.0 : -g});
        space.addBody(ball({0, 0, 0.1}, {0, 0, 0}, 0.1, 2.0));
        space.addBody(ball({0.05, 0, 0.7}, {0, 0, -1}, 0.1));
        for (int i = 0; i < std::lround(0.4 / dt); ++i) {
          space.setPlaneVelocity(0, {0, 0, carried ? g * (i + 0.5) * dt : 0.0});
          advance(space, 1);
        }
        const Vec way(0, 0, carried ? g * 0.4 * 0.4 / 2 : 0.0);
        return std::array<Vec, 2>{space.body(0).position() - way, space.body(1).position() - way};
      };
      const std::array<Vec, 2> carried = placesAfter(true);
      const std::array<Vec, 2> falling = placesAfter(false);
      CHECK((carried[0] - falling[0]).norm() < 1e-5);
      CHECK((carried[1] - falling[1]).norm() < 1e-5);
    }
  }
}

// Less than a blow in five steps, where each grain struck others thirty to forty times in each. Seen to fail:
// 1400 to 2050 blows in a step, and the floor's force fluctuated by 12 to 16 %.
TEST_CASE("A heap without weight comes to rest in a box that goes on speeding up") {
  for (const double e : {0.0, 0.3}) {
    CAPTURE(e);
    const double dt = 2e-3, r = 0.05, m = 0.5;
    SimulationConfig<double> config = plain(dt);
    config.coeffRestitution = e;
    config.coeffFriction = config.coeffStaticFriction = 0.5;
    config.contactSubsteps = 1;
    Space<double> space(config);
    const std::vector<std::size_t> walls = space.addBox({0, 0, 0}, {0.5, 0.5, 3});
    const CounterRandom random(3, 0);
    int number = 0;
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i, ++number) {
          const Vec shift = 0.01 * random.direction(static_cast<std::uint64_t>(number));
          space.addBody(
              ball(Vec(0.07 + 0.12 * i, 0.07 + 0.12 * j, 0.07 + 0.12 * k) + shift, {0, 0, 0}, r, m));
        }
      }
    }
    std::size_t blows = 0;
    double least = 1e9, most = 0.0;
    const int steps = 1500;
    for (int i = 0; i < steps; ++i) {
      for (std::size_t w = 0; w < walls.size(); ++w) {  // across their normals, the velocity at the end
        space.setPlaneVelocity(walls[w], {0, 0, g * (i + (w < 4 ? 1.0 : 0.5)) * dt});
      }
      advance(space, 1);
      if (i >= steps - 300) {
        blows += space.impacts().size();
        const double force = -space.planeForce(walls[4])[2] / (48 * m * g);
        least = std::min(least, force);
        most = std::max(most, force);
      }
    }
    CHECK(blows < 60);
    CHECK(most - least < 0.03);
  }
}

// A corner that speeds up by 20 g, whose walls have friction: the ball in it is carried by the one in the
// first half of a step and by the other at its end. Seen to fail: such a contact is told of no more, as
// planes that change their velocity have contacts begun anew; a third of all impulses are missing.
TEST_CASE("Planes that speed up are told the force of all that they give to a body, in every step") {
  const double dt = 2e-3, a = 20 * g;
  SimulationConfig<double> config = plain(dt);
  config.coeffRestitution = 0.5;
  config.coeffFriction = config.coeffStaticFriction = 0.5;
  Space<double> space(config);
  space.addPlane({0, 0, 1}, 0.0);
  space.addPlane({1, 0, 0}, -0.1);
  space.setUniformField({0, 0, -g});
  space.addBody(ball({0, 0, 0.1}, {0, 0, 0}, 0.1));
  for (std::size_t i = 0; i < 1000; ++i) {
    const double t = space.time(), mean = a * (t + dt / 2), end = a * (t + dt);
    space.setPlaneVelocity(0, {end, 0, mean});
    space.setPlaneVelocity(1, {mean, 0, end});
    const Vec before = space.body(0).velocity();
    advance(space, 1);
    const Vec given = Vec(space.body(0).velocity()) - before + dt * Vec(0, 0, g);
    const Vec told = -dt * (space.planeForce(0) + space.planeForce(1));
    CAPTURE(i, given[0], given[2], told[0], told[2]);
    REQUIRE((given - told).norm() < 1e-9);
  }
}

// A ball falls on a plate with the path A sin(w t + p), and leaves it with (1 + e) times the plate's velocity
// more. Where what changes is followed, that is off by (w h)^2/3 of A w; where the acceleration changes its
// sign it is not, and by half of what the acceleration is in a step and a half from there, 3/4 (w h)^2 of A
// w. The plate's way in a step is a chord of its path and off by (w h)^2/8 of A, and the time of the blow by
// that over the speed of 1.4 m/s: less than 1/8 (w h)^2 of A w. Together that is below (w h)^2 of A w. Seen
// to fail: blows by the mean velocity of the step, which are off by w h/2 of A w, 2.6e-2, 1.4e-2 and 6.9e-3
// m/s as steps are halved, for 3 g and e = 1.
TEST_CASE("Blows of a shaking plate are of the second order of the step, whenever they fall") {
  const double omega = 125;
  const double fall = 0.1;
  for (const double strength : {0.5, 3.0}) {
    for (const double e : {1.0, 0.5}) {
      for (const std::size_t parts : {std::size_t{1}, std::size_t{4}}) {
        std::array<double, 3> worst{};
        for (std::size_t k = 0; k < worst.size(); ++k) {
          const double dt = std::ldexp(1e-3, -static_cast<int>(k));
          for (int phase = 0; phase < 40; ++phase) {
            const double amplitude = strength * g / (omega * omega);
            const double start = 2 * pi<double>() * phase / 40;
            const auto path = [&](double t) { return amplitude * std::sin(omega * t + start); };
            const auto speed = [&](double t) { return amplitude * omega * std::cos(omega * t + start); };
            SimulationConfig<double> config = plain(dt);
            config.coeffRestitution = e;
            config.contactSubsteps = parts;
            Space<double> space(config);
            space.addPlane({0, 0, 1}, path(0));
            space.setUniformField({0, 0, -g});
            space.addBody(ball({0, 0, 0.01 + fall}, {0, 0, 0}, 0.01));
            double early = 0.0, late = 0.0;  // the first time at which they touch
            for (; fall - g * late * late / 2 > path(late); late += 1e-5) {
              early = late;
            }
            for (int halved = 0; halved < 50; ++halved) {
              const double middle = (early + late) / 2;
              (fall - g * middle * middle / 2 > path(middle) ? early : late) = middle;
            }
            const double after = speed(late) + e * (g * late + speed(late));
            while (space.time() < late) {
              const double t = space.time();
              space.setPlaneVelocity(0, {0, 0, (path(t + dt) - path(t)) / dt});
              advance(space, 1);
            }
            const double v = space.body(0).velocity()[2] + g * (space.time() - late);
            worst[k] = std::max(worst[k], std::abs(v - after));
          }
        }
        CAPTURE(strength, e, parts, worst[0], worst[1], worst[2]);
        for (std::size_t k = 0; k < worst.size(); ++k) {
          const double x = omega * std::ldexp(1e-3, -static_cast<int>(k));
          CHECK(worst[k] < (1 + e) * x * x * strength * g / omega);
        }
      }
    }
  }
}

// The velocity at the end of a step of h after one of k is found from the means of both, which are those of
// their middles but for h^2/24 and k^2/24 of the jerk: it is off by (5 h^2 + 3 h k)/24 of the jerk, which is
// 0.27 h^2 after half as long a step. Seen to fail: half of what changes from step to step, whatever their
// lengths: off by h/8 of the acceleration.
TEST_CASE("Steps that are not alike give what a plate carries its velocity to second order") {
  const double omega = 125;
  const ShakenPlate plate{3 * g / (omega * omega), omega};
  for (const std::size_t parts : {std::size_t{1}, std::size_t{4}}) {
    std::array<double, 3> worst{};
    for (std::size_t k = 0; k < worst.size(); ++k) {
      const double dt = std::ldexp(5e-4, -static_cast<int>(k));
      Space<double> space = onFloor(dt, 0.0, parts);
      space.addBody(ball({0, 0, 0.01}, {0, 0, 0}, 0.01, 2.0));
      advance(space, 1);
      double t = 0.0;
      for (int i = 0; omega * t < 2.5; ++i) {
        const double h = i % 2 == 0 ? dt : dt / 2;
        space.setTimeStep(h);
        space.setPlaneVelocity(0, {0, 0, (plate.height(t + h) - plate.height(t)) / h});
        advance(space, 1);
        t += h;
        if (omega * t > 0.5) {  // the acceleration does not jump any more
          worst[k] = std::max(worst[k], std::abs(space.body(0).velocity()[2] - plate.speed(t)));
        }
      }
      const double x = omega * dt;
      CHECK(worst[k] < 0.28 * x * x * plate.amplitude * omega);
    }
    CAPTURE(parts, worst[0], worst[1], worst[2]);
    for (std::size_t k = 0; k + 1 < worst.size(); ++k) {
      const double order = std::log2(worst[k] / worst[k + 1]);
      CHECK(order > 1.9);
      CHECK(order < 2.1);
    }
  }
}

// Seen to fail: snapshots that forget the last change.
TEST_CASE("A shaking plate goes on alike after a restart and in a copy") {
  const TemporaryFile file("plate");
  const ShakenPlate plate{0.002, 125};
  for (const std::size_t parts : {std::size_t{1}, std::size_t{4}}) {
    Space<double> whole = onFloor(1e-3, 0.0, parts);
    for (int k = 0; k < 3; ++k) {
      whole.addBody(ball({0, 0, 0.01 + 0.02 * k}, {0, 0, 0}, 0.01, 2.0));
    }
    advance(whole, 1);
    for (int i = 0; i < 200; ++i) {
      shake(whole, plate, i, 1e-3);
      if (i % 20 == 10) {
        whole.save(file.path());
        Space<double> again;
        again.restore(file.path());
        Space<double> copy = whole;
        for (int k = i + 1; k < i + 5; ++k) {
          shake(whole, plate, k, 1e-3);
          shake(again, plate, k, 1e-3);
          shake(copy, plate, k, 1e-3);
        }
        i += 4;
        CHECK(sameBits(stateOf(whole), stateOf(again)));
        CHECK(sameBits(stateOf(whole), stateOf(copy)));
      }
    }
  }
}

// Seen to fail: 4164 blows, nearly all of the plane on a body that is fixed.
TEST_CASE("After a blow fixed bodies and points meet planes as little as before it") {
  SimulationConfig<double> config = plain(0.1);
  config.coeffRestitution = 1.0;
  Space<double> space(config);
  const std::size_t plane = space.addPlane({0, 0, 1}, 0.0);
  space.setPlaneVelocity(plane, {0, 0, 1});
  Body<double> fixed = ball({0, 0, 0.9}, {0, 0, 0}, 1.0);
  fixed.fixed = true;
  space.addBody(fixed);
  space.addBody(ball({0, 0, 2.42}, {0, 0, -1}, 0.5));
  space.addBody(ball({5, 0, 0.04}, {0, 0, 0}, 0.0, 1.0));
  space.addBody(ball({5, 0, 0.56}, {0, 0, -1}, 0.5));
  advance(space, 1);
  REQUIRE(space.impacts().size() ==
          3);  // of both balls with what they meet, and of the second with the plane
  for (const Impact<double>& blow : space.impacts()) {
    CHECK((blow.second != staticPartner || blow.key1 == 3));
  }
  CHECK(space.contactReport().postponed == 0);
  CHECK(space.body(2).velocity()[2] == -1.0);
  advance(space, 2);
  CHECK(space.body(2).position()[2] < -0.1);
}

TEST_CASE("A plane that is removed holds nothing any more, and one that comes does") {
  Space<double> space = onFloor(1e-3);
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  advance(space, 100);
  CHECK(space.contactCount() == 1);
  space.removePlane(0);
  advance(space, 100);
  CHECK(space.contactCount() == 0);
  CHECK_THAT(space.body(0).velocity()[2], WithinRel(-g * 0.1, 1e-12));
  CHECK_THROWS_AS(space.removePlane(0), std::out_of_range);
  CHECK_THROWS_AS(space.setPlaneVelocity(0, {0, 0, 0}), std::out_of_range);
  CHECK(space.addPlane({0, 0, 1}, -1.0) == 1);
  advance(space, 2000);
  CHECK(space.contactCount() == 1);
  CHECK_THAT(space.body(0).position()[2], WithinAbs(-0.5, 1e-6));
}

// Seen to fail: planes stood still, and what the last body had touched stayed in the report.
TEST_CASE("Planes go on while no body is there, and reports are of that empty step") {
  Space<double> space = onFloor(1e-2, 0.0, 2);
  const BodyId gone = space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  advance(space, 1);
  space.removeBody(gone);
  space.setPlaneVelocity(0, {0.5, 0, 1});
  space.advanceTo(1.01);
  CHECK_THAT(space.planes()[0].offset, WithinRel(1.0, 1e-14));
  CHECK(space.contactReport().contacts == 0);
  CHECK(space.contactSubsteps() == 1);
}

// Seen to fail: nobody looked where they came while nothing else had changed, and without a field the
// overlap stayed for ever.
TEST_CASE("A plane or a box that comes into a body at rest opens the overlap as if it had been there") {
  const auto run = [](bool box, std::size_t before) {
    Space<double> space(plain(1e-2));
    space.addBody(ball({0, 0, 0.3}, {0, 0, 0}, 0.5));
    advance(space, before);
    if (box) {
      space.addBox({-2, -2, 0}, {2, 2, 2});
    } else {
      space.addPlane({0, 0, 1}, 0.0);
    }
    advance(space, 50);
    return double(space.body(0).position()[2]);
  };
  for (const bool box : {false, true}) {
    CHECK_THAT(run(box, 0), WithinAbs(0.5, 1e-3));
    CHECK(run(box, 1) == run(box, 0));
  }
}

TEST_CASE("A box keeps an elastic gas and its energy; an open face lets it out") {
  SimulationConfig<double> config = plain(2e-3);
  config.coeffRestitution = 1.0;
  Space<double> space(config);
  CHECK_THROWS_AS(space.addBox({0, 0, 0}, {0, 1, 1}), std::invalid_argument);
  CHECK(space.planes().empty());
  const auto faces = space.addBox({-2, -2, -2}, {2, 2, 2});
  CHECK(faces == std::vector<std::size_t>{0, 1, 2, 3, 4, 5});
  const CounterRandom random(11);
  for (std::uint64_t i = 0; i < 64; ++i) {
    const Vec cell(double(i % 4), double(i / 4 % 4), double(i / 16));
    space.addBody(ball(cell - Vec::Constant(1.5), random.direction(i), 0.2));
  }
  advance(space, 1500);
  // 64 bodies of speed 1 for 3 s: each meets a wall about twice.
  for (std::size_t i = 0; i < space.n(); ++i) {
    CHECK(space.body(i).position().cwiseAbs().maxCoeff() < 1.81);
  }
  CHECK_THAT(space.energyLedger().kinetic, WithinRel(32.0, 1e-12));
  space.removePlane(faces[5]);
  advance(space, 5000);
  std::size_t out = 0;
  for (std::size_t i = 0; i < space.n(); ++i) {
    CHECK(space.body(i).position()[2] > -1.81);
    out += space.body(i).position()[2] > 2.2 ? 1 : 0;
  }
  CHECK(out > 16);
  CHECK_THAT(space.energyLedger().kinetic, WithinRel(32.0, 1e-12));
}

TEST_CASE("Moving planes and their numbers survive a restart, bit for bit") {
  const auto scene = [] {
    Space<double> space = onFloor(2e-3, 0.4);
    space.addPlane({1, 0, 0}, -3.0);
    space.addPlane({-1, 0, 0}, -3.0);
    space.removePlane(1);
    space.setPlaneVelocity(0, {0.3, 0, 0.1});
    space.setPlaneVelocity(2, {-0.4, 0.2, 0});
    for (int i = 0; i < 12; ++i) {
      space.addBody(ball({0.9 * (i % 4), 0.9 * (i / 4), 0.6 + 0.1 * i}, {0, 0, 0}, 0.4));
    }
    return space;
  };
  const TemporaryFile file("moving-planes");
  Space<double> whole = scene();
  advance(whole, 600);
  whole.save(file.path());
  Space<double> again;
  again.restore(file.path());
  CHECK(again.planes().size() == 2);
  CHECK(again.planes()[1].number == 2);
  CHECK(again.planes()[1].velocity == Vec(-0.4, 0.2, 0));
  CHECK(whole.contactCount() > 5);
  advance(whole, 300);
  advance(again, 300);
  CHECK(sameBits(stateOf(whole), stateOf(again)));
  CHECK(again.planes()[0].offset == whole.planes()[0].offset);
  CHECK(again.addPlane({0, 1, 0}, -5) == 3);
}

TEST_CASE("Walls far away change no bit, at rest or moving") {
  const auto run = [](bool walls) {
    SimulationConfig<double> config = plain(2e-3);
    Space<double> space(config);
    if (walls) {
      space.addBox(Vec::Constant(-1e3), Vec::Constant(1e3));
      space.setPlaneVelocity(0, {1, 0, 0});
    }
    scenes::CloudOptions options;
    options.count = 60;
    options.radius = 1.0;
    options.bodyRadius = {0.05, 0.15};
    options.velocityDispersion = 0.7;
    for (Body<double> body : scenes::rubbleCloud<double>(options)) {
      body.velocity -= 2 * body.position;
      space.addBody(body);
    }
    advance(space, 200);
    return stateOf(space);
  };
  CHECK(sameBits(run(false), run(true)));
}

// Pairs of fixed spheres are not looked at. Seen to fail: they stay out of the list when one is set free.
TEST_CASE("A sphere of a wall that is set free meets those it overlaps, and no more once it is fixed again") {
  SimulationConfig<double> config = plain(1e-3);
  config.coeffRestitution = 0;
  Space<double> space(config);
  for (int i = 0; i < 5; ++i) {
    Body<double> body = ball({0.8 * i, 0, 0}, {0, 0, 0}, 0.5, 1.0);
    body.fixed = true;
    space.addBody(body);
  }
  space.addBody(ball({10, 0, 0}, {1, 0, 0}, 0.5, 1.0));
  advance(space, 10);
  CHECK(space.contacts().empty());
  space.body(2).setFixed(false);
  advance(space, 1);
  REQUIRE(space.contacts().size() == 2);
  CHECK(space.contacts()[0].key2 == static_cast<std::uint64_t>(space.body(2).id()));
  CHECK(space.contacts()[1].key1 == static_cast<std::uint64_t>(space.body(2).id()));
  space.body(2).setFixed(true);
  advance(space, 1);
  CHECK(space.contacts().empty());
  space.body(4).setFixed(false);  // at the end: pushed out
  advance(space, 500);
  CHECK_THAT(space.body(4).position()[0], WithinAbs(3.4, 1e-3));
}

// 4e-4 m above an elastic floor at 1 m/s, met in the first step. Seen to fail: contacts of the start by the
// longest step, by which the ball was taken to rest where it was, and had a tenth of its energy too much.
TEST_CASE("Where adaptive steps begin, who falls to a floor near by bounces where the floor is") {
  const auto bounced = [](double longest, bool isEmptyFirst) {
    SimulationConfig<double> config = plain(longest);
    config.adaptiveTimeStep = true;
    config.coeffRestitution = 1;
    Space<double> space(config);
    space.addPlane({0, 0, 1}, 0);
    space.setUniformField({0, 0, -9.81});
    advance(space, isEmptyFirst ? 1 : 0);  // a step of the longest
    space.addBody(ball({0, 0, 0.5004}, {0, 0, -1}, 0.5, 1.0));
    advance(space, 10);
    CAPTURE(longest, isEmptyFirst);
    CHECK(space.getPreviousTimeStep() < 6e-3);
    CHECK_THAT(space.body(0).kineticEnergy() + 9.81 * (space.body(0).position()[2] - 0.5),
               WithinRel(0.5 + 9.81 * 4e-4, 1e-13));
    return Vec(space.body(0).position());
  };
  const Vec seen = bounced(0.01, false);
  for (const double longest : {0.01, 1.0, 1e6}) {
    CHECK(bounced(longest, false) == seen);
    CHECK(bounced(longest, true) == seen);
  }
}

}  // namespace test_boundaries
