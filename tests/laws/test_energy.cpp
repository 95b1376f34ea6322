#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

double kineticOf(const Space<double>& space) {
  const auto [k, r, u] = space.calculateSystemEnergy();
  return k + r;
}

/// n spheres thrown at random into a ball that holds them several times over: overlaps, spins, all speeds.
void fill(Space<double>& space, std::size_t n, double fraction, std::uint64_t seed) {
  scenes::Sequence random(seed);
  const double size = std::cbrt(static_cast<double>(n) / fraction) * 0.1;
  for (std::size_t i = 0; i < n; ++i) {
    const double r = random.uniform(0.05, 0.15);
    space.addBody(
        ball(random.inBall(size), random.normalVector(), r, 1e3 * r * r * r, 10 * random.normalVector()));
  }
}

}  // namespace

// Contacts alone: whatever the coefficients, no step adds kinetic energy. Each blow may round up by some ulp.
// Seen to fail: overlap removed by a bias velocity and the guard of contact_energy.hpp off (30 times the
// energy in a step); with the guard on that passes.
TEST_CASE("Kinetic energy never grows in dense random collisions, whatever the coefficients") {
  const CounterRandom random(23);
  for (std::uint64_t k = 0; k < 12; ++k) {
    SimulationConfig<double> config = plain(2e-3);
    config.coeffRestitution = k == 0 ? 1.0 : k == 1 ? 0.0 : random.uniform(10 * k);
    config.coeffFriction = k == 2 ? 0.0 : random.uniform(10 * k + 1);
    config.coeffStaticFriction = config.coeffFriction + 0.5 * random.uniform(10 * k + 2);
    config.tangentialRestitution = k % 3 == 0 ? random.uniform(10 * k + 3) : 0.0;
    Space<double> space(config);
    fill(space, 300, 0.5, k);
    double before = kineticOf(space);
    const double start = before;
    double worst = 0;
    std::size_t contacts = 0;
    for (std::size_t i = 0; i < 100; ++i) {
      space.computeDynamics(i);
      const double now = kineticOf(space);
      worst = std::max(worst, now / before - 1);
      before = now;
      contacts += space.contactCount();
    }
    CAPTURE(k, config.coeffRestitution, config.coeffFriction, config.tangentialRestitution, contacts);
    CHECK(contacts > 3000);
    CHECK(worst <= 1e-14);
    if (config.coeffRestitution == 1.0 && config.coeffFriction == 0.0) {
      CHECK_THAT(before, WithinRel(start, 1e-12));
    }
  }
}

TEST_CASE("Overlap alone makes no motion: a heap at rest without forces stays at rest, and comes apart") {
  Space<double> space(plain(1e-2));
  fill(space, 200, 2.0, 3);
  for (std::size_t i = 0; i < space.n(); ++i) {
    space.body(i).velocity() = Vec(0, 0, 0);
    space.body(i).angularVelocity() = Vec(0, 0, 0);
  }
  const Vec centre = space.conserved().centreOfMass;
  space.computeDynamics(0);
  const auto deepest = [&] {
    double most = 0;
    for (const Contact<double>& c : space.contacts()) {
      most = std::max(most, -c.gap);
    }
    return most;
  };
  const double first = deepest();
  CHECK(first > 0.02);
  advance(space, 300);
  CHECK(deepest() < 1e-3 * first);
  CHECK(kineticOf(space) < 1e-25);
  CHECK((space.conserved().centreOfMass - centre).norm() < 1e-13);
}

TEST_CASE("A pair half inside one another comes apart no faster than it came, but for the correction") {
  SimulationConfig<double> config = plain(1e-3);
  config.coeffRestitution = 0.5;
  Space<double> space(config);
  space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.5));
  space.addBody(ball({0.5, 0, 0}, {-1, 0, 0}, 0.5));
  advance(space, 200);
  CHECK_THAT(space.body(1).velocity()[0] - space.body(0).velocity()[0], WithinAbs(1.0, 1e-14));
  CHECK(space.contactCount() == 0);
}

// A frictionless elastic gas of 4000 blows: the sum of m v^2 is kept to the rounding of each.
TEST_CASE("An elastic gas keeps its energy through many blows") {
  SimulationConfig<double> config = plain(5e-3);
  config.coeffRestitution = 1.0;
  config.contactTolerance = 1e-15;  // of the sweeps, where three and more touch at once; 1e-6 loses 1e-8 here
  config.contactIterations = 1000;
  Space<double> space(config);
  const double side = scenes::gasBoxLength(200, 0.2);
  space.setDomain(Domain<double>::periodic({side, side, side}));
  for (const Body<double>& body : scenes::randomGas<double>(200, 0.2)) {
    space.addBody(body);
  }
  const double start = kineticOf(space);
  std::size_t contacts = 0;
  double worst = 0;
  for (std::size_t i = 0; i < 2000; ++i) {
    space.computeDynamics(i);
    contacts += space.contactCount();
    worst = std::max(worst, std::abs(kineticOf(space) / start - 1));
  }
  CAPTURE(contacts);
  CHECK(contacts > 2000);
  CHECK(worst <= 1e-12);
  CHECK(space.conserved().momentum.norm() < 1e-11);
}

namespace {

/// Largest error of the ledger's sum in a run, and its error at the end.
template <class Scene>
std::pair<double, double> ledgerError(double dt, double time, Scene&& scene) {
  SimulationConfig<double> config = plain(dt);
  config.G = 1.0;
  config.coeffFriction = 0.3;
  config.coeffStaticFriction = 0.4;
  config.coeffRestitution = 0.5;
  config.linearDamping = 0.1;
  Space<double> space(config);
  scene(space);
  const double start = space.energyLedger().total();
  double worst = 0;
  bool met = false;
  while (space.time() < time) {
    space.computeDynamics(0);
    met = met || space.contactCount() > 0;
    worst = std::max(worst, std::abs(space.energyLedger().total() - start));
  }
  CHECK(met);
  return {worst, std::abs(space.energyLedger().total() - start)};
}

}  // namespace

// With forces the sum is as good as the integrator: second order, both sides, through a blow as well, since
// what blows and moved positions do is booked from impulses and forces. Seen to fail: the correction's work
// left out, and the losses of the first half step booked without the kick's share (both first order).
TEST_CASE("With gravity, friction and blows the ledger closes to the second order of the step") {
  // Two spheres fall towards each other, off centre, meet, rub, and part or fall back on each other.
  double shift = 0;
  const auto meeting = [&](Space<double>& space) {
    space.addBody(ball({-1.0 - shift, -0.1, 0}, {0.2, 0.1, 0}, 0.3, 1.0, {0, 0, 1}));
    space.addBody(ball({1.0, 0.1, 0}, {-0.2, 0, 0.1}, 0.3, 2.0, {1, 0, 0}));
  };
  std::vector<double> errors;
  for (const double dt : {4e-3, 2e-3, 1e-3, 5e-4}) {
    double sum = 0;  // over where in a step the blow falls
    for (int k = 0; k < 64; ++k) {
      shift = 0.00037 * k;
      sum += ledgerError(dt, 2.5, meeting).first / 64;
    }
    errors.push_back(sum);
  }
  CAPTURE(errors);
  CHECK_THAT(std::log2(errors.front() / errors.back()) / 3, WithinAbs(2.0, 0.1));
  CHECK(errors.front() > 1e-5);
  CHECK(errors.front() < 1e-3);
}

TEST_CASE(
    "A pair that rests on each other and turns as one body keeps energy, momentum and ledger to rounding") {
  SimulationConfig<double> config = plain(4e-3);
  config.G = 1.0;
  config.coeffFriction = 0.5;
  config.coeffStaticFriction = 0.8;
  Space<double> space(config);
  const double w = 0.5 * std::sqrt(2.0);  // half of what parts them
  space.addBody(ball({-0.5, 0, 0}, {0, -0.5 * w, 0}, 0.5, 1.0, {0, 0, w}));
  space.addBody(ball({0.5, 0, 0}, {0, 0.5 * w, 0}, 0.5, 1.0, {0, 0, w}));
  const EnergyLedger<double> before = space.energyLedger();
  const double spin = space.conserved().angularMomentum[2];
  advance(space, 5000);  // twenty time units: three turns
  const EnergyLedger<double> after = space.energyLedger();
  CHECK_THAT(after.mechanical(), WithinAbs(before.mechanical(), 1e-5));  // the gap of a G m h^2 / R^2
  CHECK_THAT(after.total(), WithinAbs(before.total(), 1e-5));
  CHECK_THAT(space.conserved().angularMomentum[2], WithinRel(spin, 1e-11));
  CHECK_THAT(space.body(0).angularVelocity()[2], WithinRel(w, 1e-4));
}

// A ball that rolls down over fixed balls is moved off them in steps so long, and slowed as it is moved. Two
// that can move share that in opposite directions; here nothing has the other part. Seen to fail by 7.0e-5 J:
// what it takes from the work of the kick that follows was not booked.
TEST_CASE(
    "What takes overlap with fixed balls away leaves the ledger of a field closed, in parts of a step too") {
  for (const std::size_t parts : {std::size_t{1}, std::size_t{3}}) {
    SimulationConfig<double> config = plain(0.01 * static_cast<double>(parts));
    config.coeffRestitution = 0;
    config.coeffFriction = config.coeffStaticFriction = 1;
    config.contactSubsteps = parts;
    Space<double> space(config);
    space.setUniformField({0.98, 0, -9.76});
    for (int k = 0; k <= 100; ++k) {
      Body<double> bump = ball({0.04 * k, 0, 0}, {0, 0, 0}, 0.05);
      bump.fixed = true;
      space.addBody(bump);
    }
    space.addBody(ball({0, 0, 0.15}, {0.8, 0, 0}, 0.1, 1.0, {0, 8, 0}));
    const double start = space.energyLedger().total();
    space.advanceTo(3.0);
    CAPTURE(parts);
    CHECK(space.energyLedger().correction < -1e-3);
    CHECK_THAT(space.energyLedger().total(), WithinAbs(start, 1e-11));
  }
}

// Seen to fail by 2.41 J and 0.03 J, of first order in the step: the work was that of speeds before the
// contacts of the step's end were solved, and the kick's share of the first half's impulses was that of
// gravity and field alone.
TEST_CASE("What a force hook presses to the floor takes no work and loses nothing, at rest or rolling") {
  SimulationConfig<double> config = plain(0.01);
  config.coeffFriction = 1;
  config.coeffStaticFriction = 1;
  config.coeffRestitution = 0;
  Space<double> space(config);
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 0.1}, {0, 0, 0}, 0.1, 2.0));
  const double weight = 2 * 9.81;
  double pull = 0;
  space.setForceHook([&](auto& bodies, double) { bodies[0].force() += Vector3<double>(pull, 0, -weight); });
  advance(space, 1000);
  EnergyLedger<double> ledger = space.energyLedger();
  CHECK_THAT(ledger.work, WithinAbs(0, 1e-12));
  CHECK_THAT(ledger.restitution, WithinAbs(0, 1e-12));
  CHECK_THAT(ledger.friction, WithinAbs(0, 1e-12));
  // A force F at its centre: v = 5/7 F t/m.
  pull = 0.5;
  advance(space, 300);
  ledger = space.energyLedger();
  const double v = 5.0 / 7 * pull / 2 * 3;
  CHECK_THAT(space.body(0).velocity()[0], WithinRel(v, 1.0 / 300));  // the force is felt up to a step late
  const double jump = pull * pull * 0.01 * 0.01 / (8 * 2);  // what a jump of the force leaves: (F h)^2/(8 m)
  CHECK_THAT(-ledger.work, WithinAbs(ledger.kinetic + ledger.rotational, jump));
  CHECK_THAT(ledger.friction, WithinAbs(0, jump));
  CHECK_THAT(ledger.total(), WithinAbs(0, jump));
}

// Two that fall back on each other as they turn, and what pulls them turns meanwhile. Seen to fail: the slip
// left as the acceleration of the step's start has it (they gain 2.1e-4 J in the mean; now 0.4e-4, of ten
// times as many runs half as long 0.8e-6 +- 3.4e-6), and an impulse that is told without (off by 1.7e-5 of
// it).
TEST_CASE("Rough elastic spheres bounce under their own gravity without a drift of energy") {
  const double h = 0.02;
  const int runs = 40;
  double mean = 0;
  double off = 0;
  std::size_t blows = 0;
  for (int k = 0; k < runs; ++k) {
    SimulationConfig<double> config = plain(h);
    config.G = 1.0;
    config.coeffRestitution = config.tangentialRestitution = 1.0;
    config.coeffFriction = config.coeffStaticFriction = 1e3;
    Space<double> space(config);
    const double x = 0.007 * k;
    space.addBody(ball({-1, 0, 0}, {0, 0.2 + x / 3, 0.1}, 0.5, 0.5, {0.3, 0.1 + x, 0.5}));
    space.addBody(ball({1 + x, 0, 0}, {0, -0.2, -0.1}, 0.5, 0.5, {-0.2, 0.4, 0.1 + x}));
    const ConservedQuantities<double> before = space.conserved();
    const double start = space.energyLedger().total();
    while (space.time() < 400) {
      const Vec v = space.body(1).velocity();
      const Vec a = space.body(1).acceleration();
      space.computeDynamics(0);
      for (const Impact<double>& blow : space.impacts()) {
        ++blows;
        if (space.impacts().size() == 1) {
          const Vec told = blow.impulse.normal * blow.normal + blow.impulse.tangential;
          const Vec kicks = (a + Vec(space.body(1).acceleration())) * (h / 2);
          const Vec dealt = 0.5 * (Vec(space.body(1).velocity()) - v - kicks);
          off += (told - dealt).norm() / dealt.norm();
        }
      }
    }
    mean += (space.energyLedger().total() - start) / runs;
    CHECK((space.conserved().momentum - before.momentum).norm() < 1e-13);
    CHECK((space.conserved().angularMomentum - before.angularMomentum).norm() < 1e-13);
    CHECK_THAT(space.energyLedger().friction, WithinAbs(0.0, 1e-12));
  }
  CAPTURE(blows, mean, off);
  CHECK(blows > 2000);
  CHECK(std::abs(mean) < 7e-5);
  CHECK(off / static_cast<double>(blows) < 2e-6);
}

// Head-on, in a step in which something begins to push them aside. Seen to fail: no slip counted as one that
// friction of coefficient 0 turns back.
TEST_CASE("What nothing rubs gets no spin from a blow, whatever its tangential restitution") {
  SimulationConfig<double> config = plain(0.02);
  config.coeffRestitution = config.tangentialRestitution = 1.0;
  Space<double> space(config);
  space.addBody(ball({-0.505, 0, 0}, {1, 0, 0}, 0.5));
  space.addBody(ball({0.505, 0, 0}, {-1, 0, 0}, 0.5));
  space.setForceHook([](auto& bodies, double time) {
    if (time > 0) {
      bodies[0].force() += Vec(0, 1, 0);
    }
  });
  space.computeDynamics(0);
  CHECK(space.impacts().size() == 1);
  CHECK(space.body(0).velocity()[1] > 0);
  CHECK(space.body(0).angularVelocity() == Vec::Zero());
  CHECK(space.body(1).angularVelocity() == Vec::Zero());
}
