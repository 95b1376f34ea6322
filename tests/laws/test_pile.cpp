#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

using namespace gravel;
using namespace gravel::test;

TEST_CASE("A column of grains is within its radius and above its base") {
  scenes::ColumnOptions options;
  options.count = 2000;
  options.base = {0.1, -0.2, 0.3};
  for (const Body<double>& grain : scenes::grainColumn<double>(options)) {
    const Vec x = grain.position - options.base;
    CHECK(x[2] >= grain.radius);
    CHECK(std::hypot(x[0], x[1]) <= options.radius - grain.radius);
  }
}

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

namespace {

/// 208 grains of one density and radii about 1, at rest on a lattice, apart.
void addGrainsAtRest(Space<double>& space, std::uint64_t seed) {
  const CounterRandom random(seed);
  for (int i = 0; i < 512; ++i) {
    const Vec x = 2.7 * Vec(i % 8 - 3.5, i / 8 % 8 - 3.5, i / 64 - 3.5);
    if (x.norm() < 2.7 * 3.7) {
      const double r = random.uniform(static_cast<std::uint64_t>(i), 0.7, 1.3);
      space.addBody(ball(x, {0, 0, 0}, r, r * r * r));
    }
  }
}

}  // namespace

// 208 grains of one density fall together; G = 1, mean radius 1. With steps of more than 0.18 sqrt(d/g), 0.12
// here, such a pile boils (docs/theory-time-step.md), and its pairs alone would ask for 0.17. Seen to fail:
// without the limit (rms speed 0.05 with adaptive steps, where the free fall has 2; 4 parts of 0.4, in which
// it rests).
TEST_CASE(
    "A pile that its own gravity holds comes to rest, however long steps may be by pairs of its grains") {
  for (const bool parts : {false, true}) {
    SimulationConfig<double> config = plain(parts ? 0.4 : 0.2);
    config.adaptiveTimeStep = !parts;
    config.contactSubsteps = parts ? 0 : 1;
    config.timeStepFactor = 0.1;
    config.G = 1.0;
    config.coeffFriction = 0.3;
    config.coeffStaticFriction = 0.4;
    Space<double> space(config);
    addGrainsAtRest(space, 1);
    space.advanceTo(100.0);
    double sum = 0;
    double mass = 0;
    Vec p(0, 0, 0);
    for (std::size_t i = 0; i < space.n(); ++i) {
      const auto b = space.body(i);
      sum += b.mass() * b.velocity().squaredNorm();
      p += b.mass() * b.velocity();
      mass += b.mass();
    }
    CAPTURE(parts, space.n(), space.steps(), space.contactSubsteps());
    CHECK(std::sqrt(sum / mass - (p / mass).squaredNorm()) < 1e-3);
    CHECK(space.contactSubsteps() == (parts ? 6 : 1));  // 0.4/0.072 = 5.6
  }
}

// Nothing but restitution takes the motion of smooth grains, which boil in steps of 0.1 sqrt(d/g), here
// 0.069, that those with friction rest in. Seen to fail: that limit for smooth grains, too (rms speed 0.060,
// residual 0.025).
TEST_CASE("A smooth pile that its own gravity holds comes to rest, however long steps may be by pairs") {
  SimulationConfig<double> config = plain(0.4);
  config.adaptiveTimeStep = true;
  config.timeStepFactor = 0.1;
  config.G = 1.0;
  Space<double> space(config);
  addGrainsAtRest(space, 2);
  space.advanceTo(70.0);
  const ContactVirial<double> virial = space.contactVirial();
  CAPTURE(space.steps(), space.getPreviousTimeStep(), virial.residual());
  const double escape = -2 * std::get<2>(space.calculateSystemEnergy());  // its square times mass
  CHECK(virial.motion < 1e-7 * escape);
  CHECK(virial.residual() < 1e-3);
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
  // Friction at the walls carries a part, or presses down where grains have sprung up: no law says which.
  CHECK(std::abs(floor - up) > 1e-3 * weight);
  CHECK(std::abs(floor - up) < 0.5 * weight);
  CHECK_THAT(space.supportedWeight().weight[2], WithinRel(-weight, 1e-13));
  CHECK(fastest < 1e-2);
}

// Friction leaves many solutions open, and what one step leaves undone is the next one's disturbance. Where
// gaps may fall shut as soon as they open (RestingGap::closed = 0) heaps of a thousand to 10 000 creep for
// ever. Heaps differ, and in some a grain still finds a better place, so this asks for the body in the middle
// of the heap in the middle: of twelve heaps it sinks by -4e-6 R to 3e-5 R in 250 steps, in nine by less than
// 1e-5; without closed gaps by more in ten of twelve (median 2e-5), with closed gaps of a hundredth of their
// size in eleven (3e-5). Seen to fail: the former.
TEST_CASE("A settled heap with friction rests: it does not creep down") {
#ifdef GRAVEL_TEST_SLOW
  const std::size_t count = 200;  // the code runs; such a heap has few layers to creep
  const std::uint64_t heaps = 1;
#else
  const std::size_t count = 1000;
  const std::uint64_t heaps = 7;
#endif
  constexpr double radius = 0.5;
  constexpr double g = 9.81;
  SimulationConfig<double> config = plain(1.0 / 60);
  config.coeffFriction = config.coeffStaticFriction = 0.5;
  config.coeffRestitution = 0.0;
  config.contactTolerance = 1e-2;
  config.contactIterations = 4;
  const auto side = static_cast<std::size_t>(std::cbrt(static_cast<double>(count)) + 0.5);
  const double spacing = 2.2 * radius;
  const double wall = spacing * static_cast<double>(side) / 2;
  std::vector<double> sunk;      // over R, of the body in the middle of each heap
  std::vector<double> overlaps;  // the largest of each
  for (std::uint64_t heap = 1; heap <= heaps; ++heap) {
    Space<double> space(config);
    space.setUniformField({0, 0, -g});
    space.addPlane({0, 0, 1}, 0.0);
    for (const double s : {-1.0, 1.0}) {
      space.addPlane({s, 0, 0}, -wall);
      space.addPlane({0, s, 0}, -wall);
    }
    const CounterRandom random(heap);
    for (std::size_t i = 0; i < count; ++i) {
      const auto at = [&](std::size_t k, std::uint64_t axis) {
        return (static_cast<double>(k) + 0.5) * spacing - wall + random.uniform(3 * i + axis, -0.04, 0.04);
      };
      space.addBody(ball({at(i % side, 0), at(i / side % side, 1),
                          radius + 0.04 + static_cast<double>(i / (side * side)) * spacing},
                         {0, 0, 0}, radius, 1.0));
    }
    advance(space, 600);
    std::vector<double> ways(count);
    for (std::size_t i = 0; i < count; ++i) {
      ways[i] = space.body(i).position()[2] / radius;
    }
    double deepest = 0;
    for (std::size_t k = 0; k < 250; ++k) {
      space.computeDynamics(k);
      for (const Contact<double>& c : space.contacts()) {
        deepest = std::max(deepest, -c.gap / radius);
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      ways[i] -= space.body(i).position()[2] / radius;
    }
    std::nth_element(ways.begin(), ways.begin() + std::ptrdiff_t{count / 2}, ways.end());
    sunk.push_back(ways[count / 2]);
    overlaps.push_back(deepest);
    CAPTURE(heap);
    CHECK(std::abs(space.supportedWeight().residual()) < 1e-3);
  }
  std::sort(sunk.begin(), sunk.end());
  std::sort(overlaps.begin(), overlaps.end());
  CAPTURE(sunk, overlaps);
  CHECK(overlaps[heaps / 2] < 1e-3);
  CHECK(std::abs(sunk[heaps / 2]) < 1e-5);
}

namespace {

/// 45 grains that resist rolling and spinning, at rest in a box after steps of 2 ms and then of h.
Space<double> restingGrains(double h, double tolerance, int grains) {
  SimulationConfig<double> config = plain(2e-3);
  config.coeffFriction = config.coeffStaticFriction = 0.5;
  config.rollingFriction = config.spinningFriction = 0.02;
  config.contactTolerance = tolerance;
  Space<double> space(config);
  space.setUniformField({0, 0, -9.81});
  space.addBox({-0.4, -0.4, 0}, {0.4, 0.4, 9}, defaultMaterial, BoxFaces::HighZ);
  const CounterRandom random(3);
  for (int k = 0; k < grains; ++k) {
    const auto u = [&](std::uint64_t c) {
      return random.uniform(4 * static_cast<std::uint64_t>(k) + c, -0.02, 0.02);
    };
    space.addBody(ball({0.24 * (k % 3 - 1) + u(0), 0.24 * (k / 3 % 3 - 1) + u(1), 0.12 + 0.24 * (k / 9)},
                       {0, 0, 0}, 0.1 + u(2) / 2));
  }
  advance(space, 2000);
  space.setTimeStep(h);
  advance(space, 1500);
  return space;
}

std::vector<Vec> placesIn(const Space<double>& space) {
  std::vector<Vec> places;
  for (std::size_t i = 0; i < space.n(); ++i) {
    places.push_back(space.body(i).position());
  }
  return places;
}

/// The longest way from there [m].
double farthestFrom(const std::vector<Vec>& places, const Space<double>& space) {
  double most = 0;
  for (std::size_t i = 0; i < space.n(); ++i) {
    most = std::max(most, Vec(space.body(i).position() - places[i]).norm());
  }
  return most;
}

}  // namespace

// The gap that rests grows with the step. Seen to fail: with that of the present step alone, contacts of the
// long steps were open in the short one, lost their forces, and the heap moved by 1e-2 R.
TEST_CASE("A heap at rest does not notice one step much shorter than the others, or much longer") {
  constexpr double h = 1e-2;
  // What is left of motion is in proportion of the tolerance (the next test), and is not asked for here.
  Space<double> space = restingGrains(h, 1e-9, 45);
  REQUIRE(space.energyLedger().kinetic < 1e-20);
  const std::vector<Vec> places = placesIn(space);
  const auto farthest = [&] { return farthestFrom(places, space); };
  for (const double once : {h / 2, h / 10, h / 100, h / 10000, 2 * h}) {
    CAPTURE(once);
    space.setTimeStep(once);
    advance(space, 1);
    space.setTimeStep(h);
    advance(space, 50);
    CHECK(farthest() < 1e-8 * 0.1);
  }
  for (int frame = 1; frame <= 50; ++frame) {
    space.advanceTo(space.time() + 1.01 * h);
  }
  CHECK(farthest() < 1e-8 * 0.1);
}

// Contacts of large islands whose bodies hardly moved are passed over: a velocity is wrong by the tolerance
// of what a step brings, g h, in either sense, and places by the sum of so many random steps. Seen to fail:
// contacts left alone at a hundred times the tolerance; the impulse that resists turning begun from none.
TEST_CASE("What is left of motion in a heap that resists turning is within the tolerance") {
  constexpr double h = 1e-2;
  constexpr double g = 9.81;
  constexpr int steps = 2000;
  for (const auto& [tolerance, grains] : {std::pair{1e-3, 45}, {1e-5, 45}, {1e-3, 120}, {1e-5, 120}}) {
    CAPTURE(tolerance, grains);
    Space<double> space = restingGrains(h, tolerance, grains);
    REQUIRE((space.contacts().size() > detail::SolverIslands::fewRows) == (grains == 120));
    const std::vector<Vec> places = placesIn(space);
    advance(space, steps);
    CHECK(farthestFrom(places, space) < tolerance * g * h * h * std::sqrt(double{steps}));
    CHECK(space.energyLedger().kinetic < grains * std::pow(tolerance * g * h, 2) / 2);
    if (grains == 120) {
      CHECK(space.contactReport().looks < 2 * space.contacts().size());  // some were passed over
    }
  }
}
