#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/other_spaces.hpp"
#include "support/temporary_file.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

/// Methods that move points only.
constexpr IntegratorKind orbital[] = {IntegratorKind::GaussRadau15, IntegratorKind::WisdomHolman,
                                      IntegratorKind::Hermite4};

template <class S = double, class Layout = SoA>
Space<S, Layout> planets(IntegratorKind kind, bool adaptive) {
  SimulationConfig<S> config;
  config.G = S(scenes::outerSolarSystemG);
  config.integrator = kind;
  config.timeStep = S(400);
  config.adaptiveTimeStep = adaptive;
  Space<S, Layout> space(config);
  for (const Body<S>& body : scenes::outerSolarSystem<S>()) {
    space.addBody(body);
  }
  return space;
}

double energyOf(const Space<double>& space) {
  const auto [kinetic, rotational, potential] = space.calculateSystemEnergy();
  return kinetic + rotational + potential;
}

}  // namespace

TEST_CASE("Methods that move points refuse bodies that may touch, boundaries and images, and say why") {
  for (const IntegratorKind kind : orbital) {
    CAPTURE(traitsOf(kind).name);
    CHECK_FALSE(traitsOf(kind).contacts);
    Space<double> space = planets(kind, false);
    space.computeDynamics(0);
    space.body(2).radius() = 1e-3;
    const auto before = stateOf(space);
    CHECK_THROWS_WITH(space.computeDynamics(1), ContainsSubstring("radius of body 2") &&
                                                    ContainsSubstring(traitsOf(kind).name) &&
                                                    ContainsSubstring("0.001"));
    CHECK(sameBits(stateOf(space), before));
    space.body(2).radius() = 0.0;
    space.computeDynamics(1);
    space.addPlane({0, 0, 1}, -100.0);
    CHECK_THROWS_WITH(space.computeDynamics(2), ContainsSubstring("boundaries"));

    SimulationConfig<double> config = plain(0.1);
    config.integrator = kind;
    Space<double> box(config);
    box.setDomain(Domain<double>::periodic({1, 1, 1}));
    box.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.0));
    CHECK_THROWS_WITH(box.computeDynamics(0), ContainsSubstring("domain"));
  }
}

TEST_CASE("A single sphere touches nothing and may have a radius, and turns as it should") {
  for (const IntegratorKind kind : orbital) {
    SimulationConfig<double> config = plain(0.5);
    config.integrator = kind;
    Space<double> space(config);
    space.setUniformField({0, 0, -2});
    space.addBody(ball({0, 0, 0}, {1, 0, 3}, 0.5, 1.0, {0, 0.5, 0}));
    advance(space, 4);
    CHECK((space.body(0).position() - Vec(2, 0, 2)).norm() < 1e-14);
    CHECK((space.body(0).velocity() - Vec(1, 0, -1)).norm() < 1e-14);
    CHECK_THAT(space.body(0).orientation().y(), WithinAbs(std::sin(0.5), 1e-15));
  }
}

// Seen to fail: by Gauss-Radau it went 0.4 m in twenty steps.
TEST_CASE(
    "A fixed point stays by every method, whatever velocity is written to it, and has no energy of motion") {
  for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::Yoshida4,
                                    IntegratorKind::GaussRadau15, IntegratorKind::Hermite4}) {
    CAPTURE(traitsOf(kind).name);
    for (const bool adaptive : {false, true}) {
      SimulationConfig<double> config;
      config.G = 1.0;
      config.integrator = kind;
      config.timeStep = 1e-2;
      config.adaptiveTimeStep = adaptive;
      const auto scene = [&](const Vec& v) {
        Space<double> space(config);
        Body<double> star = ball({0, 0, 0}, {0, 0, 0}, 0.0, 1.0);
        star.fixed = true;
        space.addBody(star);
        space.addBody(ball({1, 0, 0}, {0, 1, 0}, 0.0, 1e-3));
        for (int i = 0; i < 20; ++i) {
          space.body(0).velocity() = v;
          space.computeDynamics(0);
        }
        return space;
      };
      const Space<double> none = scene({0, 0, 0});
      const Space<double> some = scene({2, 0, 0});
      CHECK(some.time() == none.time());
      CHECK(some.body(0).position() == Vec::Zero());
      CHECK(some.body(1).position() == none.body(1).position());
      CHECK(some.body(1).velocity() == none.body(1).velocity());
      CHECK(some.energyLedger().total() == none.energyLedger().total());
    }
  }
}

TEST_CASE("Steps end where they are asked to, whatever the method takes inside") {
  for (const IntegratorKind kind : orbital) {
    for (const bool adaptive : {false, true}) {
      Space<double> space = planets(kind, adaptive);
      const double start = energyOf(space);
      space.advanceTo(20001.0);
      CHECK(space.time() == 20001.0);
      // Wisdom-Holman in steps of an eleventh of Jupiter's orbit, Hermite's method in 44 steps an orbit; the
      // third is right to rounding.
      const double error = kind == IntegratorKind::GaussRadau15 ? 1e-14
                           : kind == IntegratorKind::Hermite4   ? 1e-4
                                                                : 1e-5;
      CHECK_THAT(energyOf(space), WithinRel(start, error));
      Space<double> other = planets(kind, adaptive);
      for (int i = 1; i <= 3; ++i) {
        other.advanceTo(6667.0 * i);
      }
      // Different steps: rounding, carried on by an orbit of 4.6 turns.
      CHECK(difference(stateOf(space), stateOf(other)) <
            (kind == IntegratorKind::GaussRadau15 ? 1e-13 : 1e-3));
      CHECK(space.energyLedger().dissipated() == 0.0);
    }
  }
}

TEST_CASE("Hermite's steps follow timeStepFactor, and a user's own force is refused with it") {
  double errors[2];
  std::uint64_t single[2];
  for (const double factor : {0.02, 0.02 / 16}) {
    SimulationConfig<double> config;
    config.G = 1;
    config.integrator = IntegratorKind::Hermite4;
    config.timeStep = 0.25;
    config.timeStepFactor = factor;
    Space<double> space(config);
    for (const Body<double>& body : scenes::keplerPair<double>(0.5, 0.3)) {
      space.addBody(body);
    }
    const double start = energyOf(space);
    space.advanceTo(20.0);
    CHECK(space.getTimeStep() == 0.25);
    errors[factor < 0.01 ? 1 : 0] = std::abs(energyOf(space) / start - 1);
    single[factor < 0.01 ? 1 : 0] = space.individualSteps();
    CHECK_THAT(space.energyLedger().total(), WithinAbs(energyOf(space), 1e-15));

    const auto before = stateOf(space);
    space.setForceHook([](Bodies<double>&, double) {});
    CHECK_THROWS_WITH(space.computeDynamics(0),
                      ContainsSubstring("own force") && ContainsSubstring("Hermite4"));
    CHECK(sameBits(stateOf(space), before));
    space.setForceHook({});
    space.computeDynamics(0);
  }
  // With the square of the factor: 256.
  CAPTURE(errors[0], errors[1]);
  CHECK(errors[0] < 1e-3);
  CHECK(errors[0] / errors[1] > 64);
  CHECK(errors[0] / errors[1] < 1024);
  // Both bodies of a pair have the same step, at most 0.25; steps go with the root of the factor.
  CHECK(single[0] >= 2 * 80);
  CHECK(single[0] % 2 == 0);
  CHECK(double(single[1]) / double(single[0]) > 2.5);
  CHECK(double(single[1]) / double(single[0]) < 6.4);
}

TEST_CASE("A change of G, of the field or of a body between two steps is felt by Hermite's method") {
  const auto make = [](double G) {
    SimulationConfig<double> config;
    config.G = G;
    config.integrator = IntegratorKind::Hermite4;
    config.timeStep = 0.1;
    Space<double> space(config);
    for (const Body<double>& body : scenes::keplerPair<double>(0.5, 0.3)) {
      space.addBody(body);
    }
    return space;
  };
  Space<double> changed = make(1.0);
  advance(changed, 3);
  changed.setG(2.0);
  changed.setUniformField({0, 0, -1});
  Space<double> fresh = make(2.0);
  fresh.setUniformField({0, 0, -1});
  for (std::size_t i = 0; i < 2; ++i) {
    fresh.body(i).position() = Vec(changed.body(i).position());
    fresh.body(i).velocity() = Vec(changed.body(i).velocity());
  }
  advance(changed, 2);
  advance(fresh, 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(Vec(changed.body(i).position()) == Vec(fresh.body(i).position()));
  }
}

TEST_CASE("Adaptive steps of Gauss-Radau are those it asks for, within the limits") {
  Space<double> space = planets(IntegratorKind::GaussRadau15, true);
  advance(space, 50);
  const double wanted = space.getTimeStep();
  // 0.175/omega of Jupiter, 121 days, as its eccentricity has it.
  CHECK(wanted > 100.0);
  CHECK(wanted < 145.0);
  space.computeDynamics(50);
  CHECK(space.getPreviousTimeStep() == wanted);
  space.setTimeStep(50.0);
  advance(space, 3);
  CHECK(space.getPreviousTimeStep() == 50.0);
}

// They meet at 1.11. Seen to hang there, in steps of no length; so did the others with two points in one
// place.
TEST_CASE("Adaptive steps go on where points fall on each other, or stand in one place") {
  for (const IntegratorKind kind :
       {IntegratorKind::GaussRadau15, IntegratorKind::VelocityVerlet, IntegratorKind::BlanesMoan6}) {
    for (const std::size_t more : {0U, 1U}) {
      Space<double> space({.G = 1, .timeStep = 0.01, .integrator = kind});
      for (std::size_t i = 0; i <= more; ++i) {
        space.addBody({.position = {-0.5, 0, 0}, .mass = 0.5});
      }
      space.addBody({.position = {0.5, 0, 0}, .mass = 0.5});
      while (space.time() < 1.5 && space.steps() < 5000) {
        space.computeDynamics(space.steps());
      }
      CAPTURE(static_cast<int>(kind), more);
      CHECK(space.time() >= 1.5);
    }
  }
}

TEMPLATE_TEST_CASE("Orbits saved and taken up go on bit for bit", "",
                   GRAVEL_TEST_TYPES((std::pair<double, SoA>), (std::pair<float, SoA>),
                                     (std::pair<double, AoSoA<8>>))) {
  using S = typename TestType::first_type;
  using Layout = typename TestType::second_type;
  const TemporaryFile file("orbits");
  for (const IntegratorKind kind : {IntegratorKind::GaussRadau15, IntegratorKind::WisdomHolman,
                                    IntegratorKind::Hermite4, IntegratorKind::KahanLi8}) {
    for (const bool adaptive : {false, true}) {
      auto whole = planets<S, Layout>(kind, adaptive);
      advance(whole, 60);
      auto first = planets<S, Layout>(kind, adaptive);
      advance(first, 30);
      first.save(file.path());
      auto second = planets<S, Layout>(IntegratorKind::VelocityVerlet, false);
      advance(second, 3);
      second.restore(file.path());
      advance(second, 30);
      CAPTURE(traitsOf(kind).name, adaptive);
      CHECK(sameBits(stateOf(whole), stateOf(second)));
    }
  }
}

namespace {

/// A star and two planets, and a force of their velocities: of the air, or magnetic.
Space<double> draggedPlanets(IntegratorKind kind, double h, bool magnetic) {
  SimulationConfig<double> config;
  config.G = 1;
  config.integrator = kind;
  config.timeStep = h;
  config.adaptiveTimeStep = false;
  Space<double> space(config);
  space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.0, 1.0));
  space.addBody(ball({1, 0, 0}, {0, 1, 0.1}, 0.0, 1e-3));
  space.addBody(ball({0, -2, 0}, {0.7, 0, 0}, 0.0, 1e-3));
  space.setForceHook([magnetic](Bodies<double, SoA>& bodies, double) {
    for (std::size_t i = 1; i < bodies.size(); ++i) {
      const Vec v = bodies[i].velocity();
      const Vec a = magnetic ? Vec(0.3 * v[1], -0.3 * v[0], 0) : Vec(-0.05 * v);
      bodies.forces()[i] += bodies.masses()[i] * a;
    }
  });
  return space;
}

}  // namespace

// The velocities that a force sees are those of its moment. Seen to fail: brought up by half of the outer
// step (errors of 1.4e-2 and 9.5e-2, and of 0.1 and 0.5 where the planets stand).
TEST_CASE("Forces of velocities are as exact with Gauss-Radau as those of places") {
  for (const bool magnetic : {false, true}) {
    SimulationConfig<double> config = plain(0.1);
    config.integrator = IntegratorKind::GaussRadau15;
    Space<double> space(config);
    space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.0));
    space.setForceHook([magnetic](Bodies<double, SoA>& bodies, double) {
      const Vec v = bodies[0].velocity();
      bodies.forces()[0] += magnetic ? Vec(v[1], -v[0], 0) : Vec(-v);
    });
    space.advanceTo(2.0);
    const Vec exact = magnetic ? Vec(std::cos(2.0), -std::sin(2.0), 0) : Vec(std::exp(-2.0), 0, 0);
    CAPTURE(magnetic);
    CHECK((Vec(space.body(0).velocity()) - exact).norm() < 1e-14);

    // And whatever steps it is asked for.
    Space<double> coarse = draggedPlanets(IntegratorKind::GaussRadau15, 0.5, magnetic);
    Space<double> fine = draggedPlanets(IntegratorKind::GaussRadau15, 0.05, magnetic);
    coarse.advanceTo(5.0);
    fine.advanceTo(5.0);
    CHECK((Vec(coarse.body(1).position()) - Vec(fine.body(1).position())).norm() < 1e-13);
  }
}

// Seen to fail, at an order of 0.94 to 1.01: brought up by half a step of all of the acceleration, of which
// the orbit has had its part.
TEST_CASE("Forces of velocities are of second order with Wisdom-Holman") {
  for (const bool magnetic : {false, true}) {
    Space<double> exact = draggedPlanets(IntegratorKind::GaussRadau15, 0.5, magnetic);
    exact.advanceTo(5.0);
    double before = 0;
    for (const double h : {0.0125, 0.00625, 0.003125}) {
      Space<double> space = draggedPlanets(IntegratorKind::WisdomHolman, h, magnetic);
      space.advanceTo(5.0);
      const double error = (Vec(space.body(1).position()) - Vec(exact.body(1).position())).norm();
      CAPTURE(magnetic, h, before, error);
      CHECK(error < 1e-4);
      if (before > 0) {
        CHECK(std::log2(before / error) > 1.9);
        CHECK(std::log2(before / error) < 2.1);
      }
      before = error;
    }
  }
}
