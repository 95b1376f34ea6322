#include "laws/rebound.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/temporary_file.hpp"
#include "support/threads.hpp"

// Integrators whose steps are several drifts: what touches is held and struck as by velocity Verlet, and what
// does not keeps the method's order.

using namespace gravel;
using namespace gravel::test;

namespace {

constexpr std::array severalDrifts{IntegratorKind::Yoshida4,       IntegratorKind::Yoshida8,
                                   IntegratorKind::BlanesMoan4,    IntegratorKind::KahanLi6,
                                   IntegratorKind::ForceGradient4, IntegratorKind::BlanesMoan6};

SimulationConfig<double> by(IntegratorKind kind, double dt) {
  SimulationConfig<double> config = plain(dt);
  config.integrator = kind;
  return config;
}

std::size_t evaluationsOf(IntegratorKind kind) {
  return static_cast<std::size_t>(traitsOf(kind).forceEvaluations);
}

Space<double> heap(IntegratorKind kind) {
  SimulationConfig<double> config = by(kind, 0.05);
  config.G = 1;
  config.coeffFriction = config.coeffStaticFriction = 0.4;
  config.coeffRestitution = 0.3;
  Space<double> space(config);
  scenes::CloudOptions options;
  options.count = 60;
  options.radius = 6.7;
  options.bodyRadius = {0.9, 1.1};
  options.density = {0.24, 0.24};
  for (const Body<double>& body : scenes::rubbleCloud<double>(options)) {
    space.addBody(body);
  }
  return space;
}

}  // namespace

// Seen to fail, like the next two: every step made by the method's own stages.
TEST_CASE("By no method does a bullet pass through a sphere, a chain of spheres or a wall") {
  for (const IntegratorKind kind : severalDrifts) {
    CAPTURE(traitsOf(kind).name);
    SimulationConfig<double> config = by(kind, 1.0);
    config.coeffRestitution = 1;
    {
      Space<double> space(config);
      space.addBody(ball({-30, 0, 0}, {90, 0, 0}, 0.5));
      for (int k = 0; k < 4; ++k) {
        space.addBody(ball({2.0 * k, 0, 0}, {0, 0, 0}, 0.5));
      }
      space.computeDynamics(0);
      CHECK(space.impacts().size() == 4);
      CHECK(space.contactSubsteps() == evaluationsOf(kind));
      CHECK(space.body(0).velocity()[0] == 0.0);
      CHECK(space.body(4).velocity()[0] == 90.0);
      CHECK_THAT(space.body(4).position()[0], WithinRel(90.0 - 30 + 4, 1e-13));
    }
    {
      Space<double> space(config);
      space.addPlane({0, 0, 1}, 0);
      space.addBody(ball({0, 0, 20}, {0, 0, -90}, 0.5));
      space.computeDynamics(0);
      CHECK(space.body(0).velocity()[2] == 90.0);
      CHECK_THAT(space.body(0).position()[2], WithinRel(90.0 - 19, 1e-13));
    }
  }
}

TEST_CASE("By every method a ball bounces in a uniform field at its exact times, and comes to rest") {
  for (const IntegratorKind kind : severalDrifts) {
    CAPTURE(traitsOf(kind).name);
    SimulationConfig<double> config = by(kind, 0.01);
    config.coeffRestitution = 0.5;
    Space<double> space(config);
    space.setUniformField({0, 0, -9.81});
    space.addPlane({0, 0, 1}, 0);
    space.addBody(ball({0, 0, 1.1}, {0, 0, 0}, 0.1));
    // After the first bounce at t_1 with v = g t_1, up to the second one at 2 t_1.
    const double first = std::sqrt(2 / 9.81);
    advance(space, 60);
    const double t = space.time() - first;
    CHECK_THAT(space.body(0).position()[2],
               WithinAbs(0.1 + 0.5 * 9.81 * first * t - 9.81 * t * t / 2, 1e-13));
    const double energy = space.energyLedger().total();
    advance(space, 140);
    CHECK(space.body(0).velocity().norm() == 0.0);
    CHECK_THAT(space.body(0).position()[2], WithinAbs(0.1, 1e-12));
    CHECK(space.supportedWeight().residual() < 1e-14);
    CHECK_THAT(space.energyLedger().total(), WithinAbs(energy, 1e-13));
  }
}

TEST_CASE("By every method a rebound under mutual gravity is of the second order of the step") {
  for (const IntegratorKind kind :
       {IntegratorKind::Yoshida4, IntegratorKind::BlanesMoan4, IntegratorKind::ForceGradient4}) {
    const double coarse = meanReboundError(by(kind, 1.6e-2));
    const double fine = meanReboundError(by(kind, 2e-3));
    CAPTURE(traitsOf(kind).name, coarse, fine);
    CHECK_THAT(std::log2(coarse / fine) / 3, WithinAbs(2.0, 0.25));
    // The flight is the method's, the blow that of a step of velocity Verlet as long as a part.
    const double part = 2e-3 / static_cast<double>(evaluationsOf(kind));
    CHECK(fine < 1.5 * meanReboundError(by(IntegratorKind::VelocityVerlet, part)));
  }
}

// Seen to fail: a step in parts wherever bodies have radii.
TEST_CASE("Spheres that never touch move as points do, to the bit") {
  for (const IntegratorKind kind : severalDrifts) {
    const auto run = [&](double radius) {
      SimulationConfig<double> config = by(kind, 0.05);
      config.G = 1;
      Space<double> space(config);
      space.addBody(ball({0, 0, 0}, {0, 0, 0}, radius, 1.0));
      space.addBody(ball({1.5, 0, 0}, {0, std::sqrt(1.0 / 3), 0}, radius, 1e-3));
      advance(space, 300);
      CHECK(space.contactSubsteps() == 1);
      return stateOf(space);
    };
    CAPTURE(traitsOf(kind).name);
    CHECK(sameBits(run(0.0), run(0.2)));
  }
}

// Seen to fail: the mean of the hook's power over the whole step in every part.
TEST_CASE("A step in parts evaluates forces as often as any other, and books a hook's work") {
  for (const IntegratorKind kind : severalDrifts) {
    SimulationConfig<double> config = by(kind, 0.01);
    config.coeffRestitution = 1;
    Space<double> space(config);
    space.addPlane({0, 0, 1}, 0);
    space.addBody(ball({0, 0, 0.5 + 1}, {0.3, 0, 0}, 0.5, 2.0));
    std::size_t evaluations = 0;
    space.setForceHook([&](Bodies<double, SoA>& bodies, double) {
      ++evaluations;
      bodies[0].force() += Vec(0, 0, -2.0 * 9.81);
    });
    space.computeDynamics(0);
    const double before = space.energyLedger().total();
    const std::size_t first = evaluations;
    advance(space, 100);  // two bounces
    CAPTURE(traitsOf(kind).name);
    CHECK(evaluations - first == 100 * evaluationsOf(kind));
    CHECK(space.body(0).velocity().norm() > 0.3);
    // A blow turns the velocity round inside a part of length h/n; the mean of its ends misses F v of it.
    const double speed = std::sqrt(2 * 9.81);
    const double part = 0.01 / static_cast<double>(evaluationsOf(kind));
    CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 2 * 2.0 * 9.81 * speed * part));
  }
}

// Seen to fail: every step made by the method's own stages, by which the heap shakes for ever.
TEST_CASE(
    "A heap made by a method of several drifts rests, and is the same bits through a file and threads") {
  for (const IntegratorKind kind : {IntegratorKind::Yoshida4, IntegratorKind::ForceGradient4}) {
    CAPTURE(traitsOf(kind).name);
    const TemporaryFile file("drifts");
    Space<double> whole = heap(kind);
    const ConservedQuantities<double> before = whole.conserved();
    advance(whole, 400);
    whole.save(file.path());
    advance(whole, 200);
    Space<double> again;
    again.restore(file.path());
    {
      const WithThreads two(2);
      advance(again, 200);
    }
    CHECK(sameBits(stateOf(whole), stateOf(again)));
    CHECK(whole.contactCount() > 100);
    CHECK((whole.conserved().momentum - before.momentum).norm() < 1e-12);
    CHECK(whole.energyLedger().kinetic < -1e-12 * whole.energyLedger().potential);
    double deepest = 0;
    for (const Contact<double>& c : whole.contacts()) {
      deepest = std::max(deepest, -c.gap);
    }
    CHECK(deepest < 1e-3);
  }
}
