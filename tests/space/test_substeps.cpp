#include "laws/rebound.hpp"
#include "scenes/gas.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/temporary_file.hpp"
#include "support/threads.hpp"

// Steps in parts: forces once a step, contacts in every part.

using namespace gravel;
using namespace gravel::test;

namespace {

SimulationConfig<double> inParts(double dt, std::size_t parts) {
  SimulationConfig<double> config = plain(dt);
  config.contactSubsteps = parts;
  return config;
}

/// A planet at apocentre, e = 1/2, of period 2 pi.
Space<double> kepler(std::size_t parts, std::size_t stepsPerOrbit) {
  SimulationConfig<double> config = inParts(2 * pi<double>() / static_cast<double>(stepsPerOrbit), parts);
  config.G = 1;
  Space<double> space(config);
  space.addBody(ball({0, 0, 0}, {0, 0, 0}, 1e-3, 1.0));
  space.addBody(ball({1.5, 0, 0}, {0, std::sqrt(1.0 / 3), 0}, 1e-3, 1e-9));
  return space;
}

/// A heap that falls in on itself.
Space<double> heap(std::size_t parts, double dt, std::size_t count = 60) {
  SimulationConfig<double> config = inParts(dt, parts);
  config.G = 1;
  config.coeffFriction = 0.4;
  config.coeffStaticFriction = 0.5;
  config.coeffRestitution = 0.3;
  Space<double> space(config);
  scenes::CloudOptions options;
  options.count = count;
  options.radius = 1.7 * std::cbrt(static_cast<double>(count));
  options.bodyRadius = {0.9, 1.1};
  options.density = {0.24, 0.24};
  options.velocityDispersion = 0.2;
  for (const Body<double>& body : scenes::rubbleCloud<double>(options)) {
    space.addBody(body);
  }
  return space;
}

/// 512 balls at rest, elastic, and ten that fly through them by `way` in the time 1.
Space<double> bullets(double h, double way) {
  SimulationConfig<double> config = inParts(h, 1);
  config.coeffRestitution = 1.0;
  config.coeffFriction = config.coeffStaticFriction = 0.0;
  Space<double> space(config);
  const CounterRandom random(12);
  for (int k = 0; k < 512; ++k) {
    const Vec aside = 0.4 * random.direction(static_cast<std::uint64_t>(k));
    space.addBody(ball(Vec(4.0 * (k / 64), 4.0 * (k / 8 % 8), 4.0 * (k % 8)) + aside, {0, 0, 0}, 1));
  }
  for (std::uint64_t k = 0; k < 10; ++k) {
    space.addBody(ball(Vec(-3.0, 3.0 * static_cast<double>(k), 14.0), way * Vec(1, 0.02, 0.05), 0.5));
  }
  return space;
}

}  // namespace

// Seen to fail: the last kick without what makes up for the held forces.
TEST_CASE("Without contacts a step in parts is velocity Verlet, reversible, with one evaluation of forces") {
  Space<double> whole = kepler(1, 400);
  advance(whole, 1000);
  for (const std::size_t parts : {2U, 3U, 8U}) {
    Space<double> space = kepler(parts, 400);
    const std::vector<double> start = stateOf(space);
    int evaluations = 0;
    space.setForceHook([&](Bodies<double, SoA>&, double) { ++evaluations; });
    advance(space, 1000);
    CHECK(evaluations == 1001);  // the first one before the first step
    CHECK(space.profiler().entry(Phase::Gravity).calls == 1001);
    CHECK(space.contactSubsteps() == parts);
    CHECK(difference(stateOf(space), stateOf(whole)) < 1e-11);
    for (std::size_t i = 0; i < 2; ++i) {
      space.body(i).velocity() *= -1.0;
    }
    advance(space, 1000);
    CHECK((space.body(1).position() - Vec(1.5, 0, 0)).norm() < 1e-12);
    CHECK((space.body(1).velocity() + Vec(0, std::sqrt(1.0 / 3), 0)).norm() < 1e-12);
  }
}

namespace {

/// A ball on a plane under the pull of a point at depth `d` below its centre rolls as
/// x'' = -(5/7) x/(x^2 + d^2)^(3/2). \return the error of x at t = 4 from x = 1 at rest, and of the energy
std::array<double, 2> rollingError(double dt, std::size_t parts) {
  constexpr double d = 1;
  SimulationConfig<double> config = inParts(dt, parts);
  config.G = 1;
  config.coeffFriction = config.coeffStaticFriction = 1;
  Space<double> space(config);
  space.addPlane({0, 0, 1}, 0.0);
  Body<double> centre = ball({0, 0, 0.25 - d}, {0, 0, 0}, 0.0);
  centre.fixed = true;
  space.addBody(centre);
  space.addBody(ball({1, 0, 0.25}, {0, 0, 0}, 0.25));
  const auto energy = [&] { return space.energyLedger().total(); };
  const double before = energy();
  advance(space, static_cast<std::size_t>(std::lround(4 / dt)));
  const auto a = [](double x) { return -5.0 / 7 * x / std::pow(x * x + d * d, 1.5); };
  double x = 1;
  double v = 0;
  const double h = 4.0 / 4000;
  for (int k = 0; k < 4000; ++k) {  // Runge & Kutta
    const double v1 = v + h / 2 * a(x);
    const double v2 = v + h / 2 * a(x + h / 2 * v);
    const double v3 = v + h * a(x + h / 2 * v1);
    const double dv = h / 6 * (a(x) + 2 * a(x + h / 2 * v) + 2 * a(x + h / 2 * v1) + a(x + h * v2));
    x += h / 6 * (v + 2 * v1 + 2 * v2 + v3);
    v += dv;
  }
  return {std::abs(space.body(1).position()[0] - x), std::abs(energy() - before)};
}

}  // namespace

// Seen to fail: the last kick without what makes up for the held forces (both: order 1); impacts that are
// reported with times since the start of their part.
TEST_CASE("Impacts and rolling under gravity are of the second order of the step, whatever its parts") {
  for (const std::size_t parts : {1U, 2U, 4U}) {
    const double coarse = meanReboundError(inParts(8e-3, parts));
    const double fine = meanReboundError(inParts(2e-3, parts));
    CAPTURE(parts, coarse, fine);
    CHECK_THAT(std::log2(coarse / fine) / 2, WithinAbs(2.0, 0.25));
    const auto rough = rollingError(0.05, parts);
    const auto smooth = rollingError(0.0125, parts);
    CAPTURE(rough, smooth);
    CHECK_THAT(std::log2(rough[0] / smooth[0]) / 2, WithinAbs(2.0, 0.1));
    CHECK_THAT(std::log2(rough[1] / smooth[1]) / 2, WithinAbs(2.0, 0.3));
  }
}

// Seen to fail: impulses of the last part alone.
TEST_CASE("In a uniform field bounces, weights and planes that move do not see the parts of a step") {
  SimulationConfig<double> config = inParts(0.02, 4);
  config.coeffRestitution = 0.5;
  Space<double> space(config);
  space.setUniformField({0, 0, -9.81});
  const std::size_t floor = space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 1.1}, {0, 0, 0}, 0.1, 3.0));
  const double first = std::sqrt(2 / 9.81);
  std::size_t bounces = 0;
  for (std::size_t i = 0; space.time() < 1.5; ++i) {
    space.computeDynamics(i);
    for (const Impact<double>& impact : space.impacts()) {
      const double t = space.time() - space.getPreviousTimeStep() + impact.time;
      CHECK_THAT(t, WithinAbs(first * (1 + 2 * (1 - std::pow(0.5, static_cast<double>(bounces)))), 1e-11));
      ++bounces;
    }
  }
  CHECK(bounces > 4);
  // At rest the whole step's impulses are reported, not those of its last part.
  CHECK_THAT(space.planeForce(floor)[2], WithinRel(-3.0 * 9.81, 1e-12));
  CHECK(space.supportedWeight().residual() < 1e-12);
  CHECK(space.body(0).velocity().norm() < 1e-12);
  space.setPlaneVelocity(floor, {0, 0, 0.5});
  const double before = space.body(0).position()[2];
  advance(space, 10);
  CHECK_THAT(space.planes()[0].offset, WithinAbs(0.1, 1e-14));
  CHECK_THAT(space.body(0).position()[2] - before, WithinAbs(0.1, 1e-3));
}

// Overlaps come from what a body moves past its neighbours in a contact step: with four of them in each they
// are those of the short step, at a quarter of its gravity.
TEST_CASE("A heap that falls in on itself is as tight in parts of long steps as in short steps") {
  const auto fall = [](std::size_t parts, double dt) {
    Space<double> space = heap(parts, dt);
    const double before = space.energyLedger().total();
    double overlap = 0;
    while (space.time() < 10.0 - dt / 2) {
      space.computeDynamics(0);
      for (const Contact<double>& contact : space.contacts()) {
        overlap = std::max(overlap, -contact.gap);
      }
    }
    const EnergyLedger<double> ledger = space.energyLedger();
    CHECK(ledger.restitution > 0.1 * std::abs(ledger.potential));
    CHECK(std::abs(ledger.total() - before) < 2e-3 * std::abs(ledger.potential));
    return overlap;
  };
  const double coarse = fall(1, 0.1);
  const double parts = fall(4, 0.1);
  CAPTURE(coarse, parts);
  CHECK(parts < 0.5 * coarse);
}

// 1.7 collisions of a body in the long step of the gas, so that rounding of 1e-16 L grows some hundred times,
// and three in a row of a bullet, each of which turns an error of its way into 2 s/R of it, with s = 4 R from
// one ball to the next. Seen to fail: in each part only the blows of its first half (off by 0.65 L).
TEST_CASE("Where a body of a gas collides often in a step, parts of it come to what short steps come to") {
  scenes::GasOptions options;
  options.count = 400;
  options.timeStep = 0.4;
  const Space<double> gas = scenes::gasBox(options);
  for (const Space<double>& start : {gas, bullets(1.0, 30.0)}) {
    Space<double> space = start;
    Space<double> shortSteps = start;
    const bool flies = space.n() != gas.n();
    const double h = space.getTimeStep();
    shortSteps.setTimeStep(h / 64);
    const double energy = space.energyLedger().kinetic;
    std::size_t blows = 0;
    for (int k = 0; k < 64; ++k) {
      advance(shortSteps, 1);
      blows += shortSteps.contactReport().impacts;
      CHECK(shortSteps.contactSubsteps() == 1);
    }
    advance(space, 1);
    CAPTURE(flies);
    CHECK(blows > (flies ? 20 : 300));
    CHECK(space.contactReport().impacts == blows);
    CHECK(space.contactSubsteps() > 1);
    CHECK_THAT(space.energyLedger().kinetic, WithinRel(energy, 1e-13));
    double most = 0;
    for (std::size_t i = 0; i < space.n(); ++i) {
      const Vec way = space.body(i).position() - shortSteps.body(i).position();
      most = std::max(most, space.domain().minimumImage(way, 0.0).norm());
    }
    CHECK(most < 1e-11);
  }
}

// Bodies that attract each other keep angular momentum to rounding in one part alone.
TEST_CASE("A gas is one part where parts would not be the same map, or few meet") {
  scenes::GasOptions options;
  options.count = 400;
  options.timeStep = 0.4;
  Space<double> space = scenes::gasBox(options);
  const auto partsIn = [&](auto&& change) {
    Space<double> other = space;
    change(other);
    advance(other, 1);
    return other.contactSubsteps();
  };
  CHECK(partsIn([](auto&) {}) > 1);
  CHECK(partsIn([](auto& s) { s.setUniformField({0, 0, -1}); }) > 1);
  CHECK(partsIn([](auto& s) { s.setG(1e-9); }) == 1);
  CHECK(partsIn([](auto& s) { s.setForceHook([](auto& bodies, double) { bodies[0].force()[0] += 1; }); }) ==
        1);
  CHECK(partsIn([](auto& s) { s.setTimeStep(0.01); }) == 1);
  options.count = 200;
  space = scenes::gasBox(options);
  CHECK(partsIn([](auto&) {}) == 1);
}

TEST_CASE("Parts are chosen by how fast bodies that touch move past each other, as for a quarter radius") {
  SimulationConfig<double> config = inParts(0.01, 0);
  Space<double> space(config);
  space.setUniformField({0, 0, -1});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 1}, {0, 0, 0}, 1));
  advance(space, 3);
  CHECK(space.contactSubsteps() == 1);
  space.body(0).velocity() = Vec(100, 0, 0);  // slides by the radius in a step
  advance(space, 1);
  CHECK(space.contactSubsteps() == 4);
  space.body(0).velocity() = Vec(1e5, 0, 0);
  advance(space, 1);
  CHECK(space.contactSubsteps() == 32);

  // At rest, by the speed of a fall by the radius: 4 h sqrt(2 g / r) = 2.83.
  space.body(0).velocity() = Vec(0, 0, 0);
  space.body(0).angularVelocity() = Vec(0, 0, 0);
  space.setTimeStep(0.5);
  advance(space, 1);
  CHECK(space.contactSubsteps() == 3);
}

// 4 h sqrt(2 a / r) at the height 102 of a patch with nu = 1: 1.14, 2.86 and 11.4. Seen to fail: the fixed
// ball taken to fall with the tide, too, so that 1, 1 and 2 were enough.
TEST_CASE("Parts are those on a plane where a frame presses a ball on a fixed one") {
  for (const auto& [h, parts] : {std::pair{0.02, 2U}, std::pair{0.05, 3U}, std::pair{0.2, 12U}}) {
    SimulationConfig<double> config = inParts(h, 0);
    config.integrator = IntegratorKind::SymplecticEpicycle;
    config.coeffRestitution = 0;
    Space<double> space(config);
    space.setDomain(Domain<double>::shearPeriodic({1000, 1000, 1000}, 0.0, 1.0));
    Space<double> onPlane(space);
    Body<double> rock = ball({0, 0, 100}, {0, 0, 0}, 1);
    rock.fixed = true;
    space.addBody(rock);
    onPlane.addPlane({0, 0, 1}, 101.0);
    for (Space<double>* s : {&space, &onPlane}) {
      s->addBody(ball({0, 0, 102}, {0, 0, 0}, 1));
      advance(*s, 1);
      CAPTURE(h, s == &space);
      CHECK(s->contactSubsteps() == parts);
    }
  }
}

TEST_CASE("Adaptive steps in parts are as much longer where only contacts ask for short ones") {
  SimulationConfig<double> config;
  config.G = 0;
  config.timeStep = 1;
  const auto step = [&](std::size_t parts) {
    config.contactSubsteps = parts;
    Space<double> space(config);
    space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.1));
    space.addBody(ball({9, 0, 0}, {-1, 0, 0}, 0.1));
    advance(space, 1);
    return space.getPreviousTimeStep();
  };
  CHECK_THAT(step(1), WithinRel(0.1 / 4, 1e-12));
  CHECK_THAT(step(3), WithinRel(3 * 0.1 / 4, 1e-12));
  CHECK_THAT(step(0), WithinRel(32 * 0.1 / 4, 1e-12));
}

TEST_CASE("Steps in parts are the same bits for any number of threads and through a file") {
  for (const std::size_t parts : {0U, 3U}) {
    const TemporaryFile file("parts");
    Space<double> whole = heap(parts, 0.05);
    advance(whole, 80);
    whole.save(file.path());
    advance(whole, 30);
    CHECK(whole.contactCount() > 50);
    Space<double> again;
    again.restore(file.path());
    {
      const WithThreads two(2);
      advance(again, 30);
    }
    CHECK(sameBits(stateOf(whole), stateOf(again)));
  }
}

TEST_CASE("Bodies that merge in a part of a step are one in the next part") {
  for (const std::size_t parts : {1U, 5U}) {
    SimulationConfig<double> config = inParts(0.1, parts);
    config.G = 1e-3;
    Space<double> space(config);
    space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.5, 2.0));
    space.addBody(
        ball({1.03, 0, 0}, {-1, 0, 0}, 0.5, 1.0));  // meets the first after 0.03, in the second part
    space.addBody(ball({0, 20, 0}, {0, 0, 0}, 0.5, 1.0));
    space.setCollisionHook([](const Collision<double>&) { return CollisionOutcome<double>::merge(); });
    const double before = space.energyLedger().total();
    advance(space, 1);
    CHECK(space.n() == 2);
    advance(space, 20);
    CHECK_THAT(space.conserved().momentum[0], WithinAbs(-1.0, 1e-12));
    CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-5));
  }
}

// Forces are held from part to part, and found anew where bodies merge. Seen to fail: those that were held
// until then are not made up for (1e-4 to 5e-4).
TEST_CASE("A merger in a part of a step leaves the angular momentum of what orbits elsewhere as it is") {
  for (const std::size_t parts : {2U, 5U}) {
    int merged = 0;
    for (int k = 0; k < 20; ++k) {
      SimulationConfig<double> config = inParts(0.1, parts);
      config.G = 1.0;
      Space<double> space(config);
      space.addBody(ball({-1, 0, 0}, {0, -0.4, 0.1}, 0.1, 1.0));
      space.addBody(ball({1, 0, 0}, {0, 0.4, -0.1}, 0.1, 1.0));
      // Too light to matter; they meet at all times of the second step.
      space.addBody(ball({0, 50, 0}, {0, 0, 0}, 0.1, 1e-14));
      space.addBody(ball({0.2 + 0.1 * (1 + k / 20.0), 50, 0}, {-1, 0, 0}, 0.1, 1e-14));
      space.setCollisionHook([](const Collision<double>&) { return CollisionOutcome<double>::merge(); });
      const Vector3<double> before = space.conserved().angularMomentum;
      advance(space, 2);
      merged += space.n() == 3 ? 1 : 0;
      advance(space, 20);
      CHECK((space.conserved().angularMomentum - before).norm() < 1e-11);
    }
    CHECK(merged >= 18);  // at its very ends it may be the step before or after
  }
}

TEST_CASE("A shearing patch in parts: order two under its own gravity") {
  const auto run = [](double dt, std::size_t parts) {
    SimulationConfig<double> config = inParts(dt, parts);
    config.G = 0.05;
    config.integrator = IntegratorKind::SymplecticEpicycle;
    Space<double> space(config);
    space.setDomain(Domain<double>::shearPeriodic({40, 40, 40}, 1.0));
    space.addBody(ball({-1, 0, 0}, {0, 1.5, 0}, 0.01, 1.0));
    space.addBody(ball({1, 1, 0.5}, {0, -1.5, 0}, 0.01, 2.0));
    advance(space, static_cast<std::size_t>(std::lround(2.0 / dt)));
    return stateOf(space);
  };
  const std::vector<double> exact = run(2.0 / 512, 1);
  for (const std::size_t parts : {1U, 4U}) {
    const double coarse = difference(run(2.0 / 16, parts), exact);
    const double fine = difference(run(2.0 / 64, parts), exact);
    CAPTURE(parts, coarse, fine);
    CHECK_THAT(std::log2(coarse / fine) / 2, WithinAbs(2.0, 0.15));
  }
}

TEST_CASE("Parts are refused where a step has several drifts, or no contacts") {
  for (const IntegratorKind kind : {IntegratorKind::Yoshida4, IntegratorKind::ForceGradient4,
                                    IntegratorKind::GaussRadau15, IntegratorKind::WisdomHolman}) {
    SimulationConfig<double> config = inParts(0.1, 2);
    config.integrator = kind;
    CHECK_THROWS_WITH(config.validate(), ContainsSubstring("contactSubsteps is 2; allowed: 1 with ") &&
                                             ContainsSubstring(traitsOf(kind).name));
    config.contactSubsteps = 0;
    CHECK_THROWS_AS(Space<double>(config), std::invalid_argument);
  }
}
