#include "laws/laws.hpp"
#include "space/quiet_spaces.hpp"
#include "support/catch.hpp"
#include "support/space.hpp"
#include "support/temporary_file.hpp"
#include <gravel/space/space.hpp>

#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace gravel;
using namespace gravel::test;

namespace {

void advance(Space<double>& space, int steps) {
  for (int i = 0; i < steps; ++i) {
    space.computeDynamics(static_cast<std::size_t>(i));
  }
}

}  // namespace

TEST_CASE("Planes are counted, keep bodies on their free side, and refuse what is no plane") {
  Space<double> space(quiet(1e-3));
  CHECK(space.addPlane({0, 0, 2}, 1.0) == 0);
  CHECK(space.addPlane({0, 0, -1}, -3.0) == 1);  // a slab 1 < z < 3
  CHECK_THROWS_AS(space.addPlane({0, 0, 0}, 1.0), std::invalid_argument);
  CHECK_THROWS_AS(space.addPlane({0, 0, std::numeric_limits<double>::quiet_NaN()}, 1.0),
                  std::invalid_argument);
  space.setCoeffRestitution(1.0);
  space.addBody(at({0, 0, 2}, {0.5, 0, 3.0}));
  double low = 2;
  double high = 2;
  for (std::size_t i = 0; i < 3000; ++i) {
    space.computeDynamics(i);
    low = std::min(low, space.body(0).position()[2]);
    high = std::max(high, space.body(0).position()[2]);
  }
  CHECK(low >= 1.5 - 1e-12);  // impacts are inside steps: nothing gets into a plane
  CHECK(low < 1.5 + 3.0e-3);  // a step's travel
  CHECK(high <= 2.5 + 1e-12);
  CHECK(high > 2.5 - 3.0e-3);
  CHECK(std::abs(space.body(0).velocity()[2]) == 3.0);
}

TEST_CASE("A pair of materials has the geometric mean of its coefficients, with the space's own among them") {
  SimulationConfig<double> config = quiet(1e-3);
  config.coeffRestitution = 0.25;
  Space<double> space(config);
  const MaterialId rubber =
      space.addMaterial({.restitution = 1.0, .staticFriction = 0.0, .kineticFriction = 0.0});
  Body<double> body = at({0, 0, 0}, {1, 0, 0});
  space.addBody(body);  // the space's own material
  body = at({1.0005, 0, 0}, {-1, 0, 0});
  body.material = rubber;
  space.addBody(body);
  body = at({0, 10, 0.4995}, {0, 0, -1});
  space.addBody(body);
  space.addPlane({0, 0, 1}, -100.0, rubber);
  space.computeDynamics(0);
  CHECK(space.contactCount() == 1);
  CHECK_THAT(space.body(1).velocity()[0], WithinRel(0.5, 1e-14));  // sqrt(1/4 * 1)
  REQUIRE(space.impacts().size() == 1);
  CHECK(space.impacts()[0].impulse.tangential == Vector3<double>::Zero());
  CHECK_THROWS_AS(space.addMaterial({.restitution = 1.5}), std::invalid_argument);
  CHECK_THROWS_AS(space.addMaterial({.staticFriction = 0.1, .kineticFriction = 0.2}), std::invalid_argument);
}

// Contacts that are solved together: contact/test_narrow_phase.cpp. Seen to fail: pairs looked for in one
// order only; blows on bodies, or on planes, with the mean of both surfaces.
TEST_CASE("A pair of materials bounces as measured, off each other and off a plane; errors change nothing") {
  SimulationConfig<double> config = quiet(1e-3);
  config.coeffRestitution = 0.25;
  Space<double> space(config);
  const MaterialId rubber = space.addMaterial({.restitution = 1.0});
  space.setPairMaterial(rubber, defaultMaterial, {.restitution = 0.5});
  space.setPairMaterial(rubber, defaultMaterial, {.restitution = 0.75});  // the last word
  space.setPairMaterial(rubber, rubber, {.restitution = 0.125});
  const auto meet = [&](MaterialId first, MaterialId second) {
    const auto y = static_cast<double>(space.n());
    Body<double> body = at({0, y, 0}, {1, 0, 0});
    body.material = first;
    space.addBody(body);
    body = at({1.0005, y, 0}, {-1, 0, 0});
    body.material = second;
    space.addBody(body);
  };
  meet(rubber, defaultMaterial);
  meet(defaultMaterial, rubber);
  meet(rubber, rubber);
  meet(defaultMaterial, defaultMaterial);
  Body<double> drop = at({0, -10, -99.4995}, {0, 0, -1});
  drop.material = rubber;
  space.addBody(drop);
  space.addPlane({0, 0, 1}, -100.0);
  space.computeDynamics(0);
  const auto speed = [&](std::size_t pair) { return space.body(2 * pair + 1).velocity()[0]; };
  CHECK_THAT(speed(0), WithinRel(0.75, 1e-14));
  CHECK_THAT(speed(1), WithinRel(0.75, 1e-14));
  CHECK_THAT(speed(2), WithinRel(0.125, 1e-14));
  CHECK_THAT(speed(3), WithinRel(0.25, 1e-14));
  CHECK_THAT(space.body(8).velocity()[2], WithinRel(0.75, 1e-14));
  CHECK(space.material(rubber).restitution == 1.0);
  CHECK(space.material(defaultMaterial).restitution == 0.25);
  CHECK_THROWS_WITH(space.setPairMaterial(rubber, MaterialId{2}, {}),
                    ContainsSubstring("material of a pair is 2"));
  CHECK_THROWS_WITH(space.setPairMaterial(defaultMaterial, rubber, {.restitution = 2}),
                    ContainsSubstring("restitution of the pair is 2"));
  CHECK_THROWS_AS(space.material(MaterialId{7}), std::invalid_argument);
  CHECK_THROWS_AS(space.pairMaterial(rubber, MaterialId{7}), std::invalid_argument);
  CHECK(space.pairMaterial(defaultMaterial, rubber).restitution == 0.75);
}

// A block slides for ten steps on what is smooth, and then is braked: after n steps more v = v_0 - mu g n h.
// Seen to fail: contacts kept their surfaces until they were found again in the middle of the next step, half
// of whose friction was missing, mu g h/2 for good.
TEST_CASE("Friction that somebody changes between two steps acts from the start of the next one") {
  const double h = 0.01;     // [s]
  const double even = 1e-6;  // [m s^-1] the ground's slope after 0.2 m, 2e-7 of g, makes 3e-7 in 0.15 s
  const Material<double> rough{.restitution = 0, .staticFriction = 0.5, .kineticFriction = 0.5};
  const Material<double> smooth{.restitution = 0, .staticFriction = 0, .kineticFriction = 0};
  const auto slides = [&](bool onBall) {
    Space<double> space(plain(h));
    space.setUniformField({0, 0, -10});
    const MaterialId other = space.addMaterial(smooth);
    space.addMaterial(rough);
    Body<double> block = ball({0, 0, 0.5}, {1, 0, 0}, 0.5);
    block.inertia = 1e9;  // it does not turn
    block.material = other;
    space.addBody(block);
    if (onBall) {
      Body<double> ground = ball({0, 0, -1e6}, Vec::Zero(), 1e6);
      ground.fixed = true;
      ground.material = other;
      space.addBody(ground);
    } else {
      space.addPlane({0, 0, 1}, 0.0, other);
    }
    advance(space, 10);
    return space;
  };
  for (const bool onBall : {false, true}) {
    CAPTURE(onBall);
    const auto speed = [](const Space<double>& space) { return space.body(0).velocity()[0]; };
    const MaterialId other{1};
    Space<double> measured = slides(onBall);
    measured.setPairMaterial(other, other, rough);
    const TemporaryFile file("changed_surface");
    measured.save(file.path());
    for (std::size_t n = 1; n <= 3; ++n) {
      advance(measured, 1);
      CHECK_THAT(speed(measured), WithinAbs(1 - 0.5 * 10 * h * double(n), even));
    }
    Space<double> saved;
    saved.restore(file.path());
    advance(saved, 3);
    CHECK(sameBits(stateOf(saved), stateOf(measured)));
    measured.setPairMaterial(other, other, smooth);
    advance(measured, 3);
    CHECK_THAT(speed(measured), WithinAbs(1 - 0.5 * 10 * h * 3, even));

    Space<double> another = slides(onBall);  // rough on what the space's own surface is not
    another.setPairMaterial(other, MaterialId{2}, rough);
    another.body(0).setMaterial(MaterialId{2});
    advance(another, 2);
    CHECK_THAT(speed(another), WithinAbs(1 - 0.5 * 10 * h * 2, even));

    Space<double> own = slides(onBall);
    own.setPairMaterial(other, defaultMaterial, smooth);
    own.body(0).setMaterial(defaultMaterial);
    advance(own, 5);
    CHECK_THAT(speed(own), WithinAbs(1, even));
  }
  Space<double> space(plain(h));
  space.setUniformField({6, 0, -8});  // held on an incline, and let go
  space.addPlane({0, 0, 1}, 0.0);
  Body<double> block = ball({0, 0, 0.5}, Vec::Zero(), 0.5);
  block.inertia = 1e9;
  space.addBody(block);
  space.setCoeffFriction(1.0);
  advance(space, 10);
  CHECK(space.body(0).velocity().norm() < 1e-9);
  space.setCoeffFriction(0.0);
  advance(space, 2);
  CHECK_THAT(space.body(0).velocity()[0], WithinRel(6 * 2 * h, 1e-6));
}

// Velocity Verlet is exact in a uniform field: a parabola, to the rounding of 1000 steps.
TEST_CASE("A uniform field makes exact parabolas for movable bodies, and leaves fixed ones") {
  Space<double> space(quiet(1e-3));
  space.setUniformField({1.0, 0, -9.81});
  CHECK(space.uniformField() == Vec(1.0, 0, -9.81));
  space.addBody(at({0, 0, 0}, {0, 2, 3}, 0.0));
  Body<double> fixed = at({50, 0, 0}, {0, 0, 0});
  fixed.fixed = true;
  space.addBody(fixed);
  advance(space, 1000);
  const double t = space.time();
  CHECK((space.body(0).position() - Vec(t * t / 2, 2 * t, 3 * t - 9.81 * t * t / 2)).norm() < 1e-12);
  CHECK(space.body(1).position() == Vec(50, 0, 0));
  CHECK_THROWS_AS(space.setUniformField({0, 0, std::numeric_limits<double>::infinity()}),
                  std::invalid_argument);
  CHECK(space.uniformField() == Vec(1.0, 0, -9.81));
}

namespace {

/// Spring and drag on one body through the hook: what is the ledger's largest error in 2 s?
double springError(double dt, double drag, double* worked = nullptr) {
  Space<double> space(quiet(dt));
  Body<double> body = at({1, 0, 0}, {0, 0.5, 0}, 0.1);
  body.mass = 2.0;
  body.angularVelocity = {0, 0, 1};
  space.addBody(body);
  int calls = 0;
  space.setForceHook([&calls, drag](Bodies<double, SoA>& bodies, double) {
    ++calls;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].force() -= 8.0 * Vec(bodies[i].position()) + drag * Vec(bodies[i].velocity());
      bodies[i].torque() += Vec(0, 0, 0.01);
    }
  });
  const double start = space.energyLedger().total();
  double worst = 0;
  while (space.time() < 2.0) {
    space.computeDynamics(0);
    worst = std::max(worst, std::abs(space.energyLedger().total() - start));
  }
  CHECK(calls == static_cast<int>(space.steps()) + 1);  // once a step, and once at the start
  if (worked != nullptr) {
    *worked = -space.energyLedger().work;
  }
  return worst;
}

}  // namespace

// The work entry is a trapezium sum over the steps: second order, both sides.
TEST_CASE("The work of a user's force is booked, to the second order of the step") {
  double worked = 0;
  const double coarse = springError(4e-3, 0.0);
  const double fine = springError(2e-3, 0.0, &worked);
  CAPTURE(coarse, fine);
  CHECK(coarse > 1e-6);  // an error is there to be measured, of energies of about 4 J
  CHECK(coarse < 1e-2);
  CHECK_THAT(std::log2(coarse / fine), WithinAbs(2.0, 0.05));
  // A spring of k = 8 on 2 kg: x = cos 2t, y = sin(2t)/4; spring energy 4 x^2 + 4 y^2 given back at t = 2.
  // The torque's work is 0.01 times the angle turned, t + alpha t^2/2 with alpha = 0.01 / (0.4 * 2 * 0.01).
  const double c = std::cos(4.0);
  const double s = std::sin(4.0);
  const double expected = 4.0 - (4 * c * c + s * s / 4) + 0.01 * (2.0 + 1.25 * 2.0);
  CHECK_THAT(worked, WithinAbs(expected, 1e-4));
}

// A charge in a magnetic field, v' = v x z, and a body that the air slows down, v' = -v, to t = 2.
// Seen to fail: the hook sees the velocities of the half kick (order 1).
TEST_CASE("A user's force that depends on velocity is of the second order of the step") {
  const auto error = [](double h, bool magnetic) {
    SimulationConfig<double> config = plain(h);
    Space<double> space(config);
    space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.1));
    space.setForceHook([magnetic](Bodies<double, SoA>& bodies, double) {
      const Vec v = bodies[0].velocity();
      bodies.forces()[0] += magnetic ? Vec(v[1], -v[0], 0) : Vec(-v);
    });
    space.advanceTo(2.0);
    const Vec exact = magnetic ? Vec(std::cos(2.0), -std::sin(2.0), 0) : Vec(std::exp(-2.0), 0, 0);
    return (Vec(space.body(0).velocity()) - exact).norm();
  };
  for (const bool magnetic : {true, false}) {
    const double coarse = error(0.02, magnetic);
    CAPTURE(magnetic, coarse);
    CHECK(coarse < 1e-3);
    CHECK_THAT(std::log2(coarse / error(0.01, magnetic)), WithinAbs(2.0, 0.15));
  }
}

// A ball that rolls, in a field that turns its way, in the air, and braked by a torque: as F or (T/R) over m
// (1 + k). Seen to fail: it sees the present velocities (order 1, 2.7e-3 to 2.6e-2 at 0.02); the spin is not
// brought up by contacts (the torque, order 1).
TEST_CASE(
    "A user's force that depends on the velocity or spin of what rolls is of the second order of the step") {
  const auto error = [](double h, int kind, std::size_t parts) {
    SimulationConfig<double> config = plain(h);
    config.coeffFriction = config.coeffStaticFriction = 0.6;
    config.contactSubsteps = parts;
    Space<double> space(config);
    space.setUniformField({0, 0, -10});
    space.addPlane({0, 0, 1}, 0.0);
    space.addBody(ball({0, 0, 0.5}, {1, 0, 0}, 0.5, 1.0, {0, 2, 0}));
    space.setForceHook([kind](Bodies<double, SoA>& bodies, double) {
      const Vec v = bodies[0].velocity();
      if (kind == 2) {
        bodies[0].torque() -= 0.35 * Vec(bodies[0].angularVelocity());
      } else {
        bodies[0].force() += 1.4 * (kind == 0 ? Vec(v[1], -v[0], 0) : Vec(-v));
      }
    });
    space.advanceTo(2.0);
    const Vec exact = kind == 0 ? Vec(std::cos(2.0), -std::sin(2.0), 0) : Vec(std::exp(-2.0), 0, 0);
    return (Vec(space.body(0).velocity()) - exact).norm();
  };
  for (const int kind : {0, 1, 2}) {
    for (const std::size_t parts : {1U, 3U}) {
      const double coarse = error(0.02, kind, parts);
      CAPTURE(kind, parts, coarse);
      CHECK(coarse < 1e-3);
      CHECK_THAT(std::log2(coarse / error(0.01, kind, parts)), WithinAbs(2.0, 0.05));
    }
  }
}

// What comes down on a floor is braked by the air once, not as if the floor went on to push. Seen to fail:
// blows are shown as contacts (3 m/s and 6.05 m/s).
TEST_CASE("A user's force sees the velocity after a blow and not that of two") {
  for (const double e : {0.0, 0.5}) {
    SimulationConfig<double> config = plain(0.01);
    config.coeffRestitution = e;
    Space<double> space(config);
    space.setUniformField({0, 0, -10});
    space.addPlane({0, 0, 1}, 0.0);
    space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5, 1.0));
    double fastest = 0;
    space.setForceHook([&fastest](Bodies<double, SoA>& bodies, double) {
      fastest = std::max(fastest, std::abs(Vec(bodies[0].velocity())[2]));
    });
    advance(space, 5);
    space.body(0).velocity() = Vec(0, 0, -3);
    advance(space, 1);
    CAPTURE(e);
    CHECK(fastest <= (3 + 10 * 0.01) * e + 1e-12);  // with the kick before it
  }
}

// Seen to fail: the storage of a space that was moved away still counted its bodies (a crash).
TEST_CASE("A space that was moved away has no bodies, and can be made anew") {
  Space<double> space(quiet(1e-2));
  space.addBody(at({0, 0, 0}, {1, 0, 0}));
  space.computeDynamics(0);
  Space<double> moved = std::move(space);
  CHECK(moved.n() == 1);
  CHECK(space.n() == 0);  // NOLINT(bugprone-use-after-move)
  CHECK_THROWS_AS(space.body(std::size_t{0}), std::out_of_range);
  space = Space<double>(quiet(1e-2));
  space.addBody(at({0, 0, 0}, {2, 0, 0}));
  space.computeDynamics(0);
  CHECK(space.body(0).position()[0] == 0.02);
  CHECK(moved.body(0).position()[0] == 0.01);
}

// Of what rests the velocities are those that it has. Seen to fail: they are brought up, too (25.7 N).
TEST_CASE("A ball at rest in the air presses on the floor with its weight") {
  Space<double> space(plain(0.01));
  space.setUniformField({0, 0, -10});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5, 3.0));
  space.setForceHook(
      [](Bodies<double, SoA>& bodies, double) { bodies.forces()[0] -= 100.0 * Vec(bodies[0].velocity()); });
  advance(space, 10);
  CHECK_THAT(space.contactImpulses()[0].normal / 0.01, WithinRel(30.0, 1e-12));
  CHECK(space.body(0).velocity() == Vec::Zero());
}

TEST_CASE("A hook's forces and torques can be seen, and an empty hook takes them away") {
  Space<double> space(quiet(1e-3));
  space.addBody(at({0, 0, 0}, {0, 0, 0}));
  space.setForceHook([](Bodies<double, SoA>& bodies, double) {
    bodies[0].force() += Vec(1, 2, 3);
    bodies[0].torque() += Vec(0, 0, 4);
  });
  space.computeDynamics(0);
  CHECK(space.body(0).force() == Vec(1, 2, 3));
  CHECK(space.body(0).acceleration() == Vec(1, 2, 3));
  CHECK(std::get<2>(space.getDataForDisplay())[0] == Vec(0, 0, 4));
  CHECK_THAT(std::get<3>(space.getDataForDisplay())[0][2], WithinRel(4 / (0.4 * 0.25), 1e-15));
  CHECK(space.body(0).angularVelocity()[2] > 0.0);
  space.setForceHook({});
  const Vec v = space.body(0).velocity();
  const Vec w = space.body(0).angularVelocity();
  space.computeDynamics(1);
  CHECK(space.body(0).velocity() == v);
  CHECK(space.body(0).angularVelocity() == w);
  CHECK(std::get<2>(space.getDataForDisplay())[0] == Vec::Zero());
  CHECK(std::get<3>(space.getDataForDisplay())[0] == Vec::Zero());
}

TEST_CASE("A force of the hook that is not finite is refused with its body") {
  for (const bool torque : {false, true}) {
    Space<double> space(quiet(1e-2));
    space.addBody(at({0, 0, 0}, {0, 0, 0}));
    space.addBody(at({5, 0, 0}, {0, 0, 0}));
    space.setForceHook([torque](auto& bodies, double time) {
      if (time > 0.015) {
        (torque ? bodies[1].torque() : bodies[1].force())[2] += std::numeric_limits<double>::quiet_NaN();
      }
    });
    space.computeDynamics(0);
    CHECK_THROWS_WITH(space.computeDynamics(1), ContainsSubstring(torque ? "torque of the hook on body 1"
                                                                         : "force of the hook on body 1"));
    CHECK(isFinite(Vec(space.body(1).position())));
  }
}

// The pass over all bodies goes to its end first, in more than one thread where there are some.
TEST_CASE(
    "Of several wrong forces of a hook the first body's is named, and all have their own motion again") {
  const double dt = 1e-2;
  Space<double> space(quiet(dt));
  space.setUniformField({0, 0, -9.8});
  for (int i = 0; i < 6000; ++i) {
    space.addBody(at({2.5 * i, 0, 0}, {0, 0, 0}));
  }
  double shown = 0;
  space.setForceHook([&](auto& bodies, double time) {
    if (time > 0) {
      shown = bodies[4321].velocity()[2];
      bodies[4900].force()[0] = std::numeric_limits<double>::infinity();
      bodies[777].torque()[1] = std::numeric_limits<double>::quiet_NaN();
      bodies[5999].force()[2] = std::numeric_limits<double>::quiet_NaN();
    }
  });
  CHECK_THROWS_WITH(space.computeDynamics(0), ContainsSubstring("torque of the hook on body 777"));
  CHECK_THAT(shown, WithinRel(-9.8 * dt, 1e-12));
  for (std::size_t i = 0; i < space.n(); ++i) {
    REQUIRE_THAT(space.body(i).velocity()[2], WithinRel(-9.8 * dt / 2, 1e-12));
  }
}

TEST_CASE("An exception of the hook comes out of the step") {
  Space<double> space(quiet(1e-3));
  space.addBody(at({0, 0, 0}, {1, 0, 0}));
  space.setForceHook([](Bodies<double, SoA>&, double) { throw std::runtime_error("no more"); });
  CHECK_THROWS_WITH(space.computeDynamics(0), ContainsSubstring("no more"));
  CHECK(space.time() == 0.0);
}

// Both hooks try each call that changes the space. Seen to fail: the calls let through (bodies come and go
// under the step's feet), assignment and moves among them (a crash); the mark left behind by a step that
// threw; a copy that takes itself to be in a step.
TEST_CASE("What changes the space is refused inside a step, and possible after it") {
  using Change = std::function<void(Space<double>&)>;
  const Material<double> material{0.5, 0.5, 0.5, 0.0};
  Space<double> other(quiet(1e-3));
  const Space<double> another = other;
  const std::vector<std::pair<const char*, Change>> changes{
      {"reserve()", [](auto& space) { space.reserve(100); }},
      {"addBody()",
       [](auto& space) {
         space.addBody(at({0, 9, 0}, {0, 0, 0}));
       }},
      {"removeBody()", [](auto& space) { space.removeBody(space.body(0).id()); }},
      {"reorderBodies()", [](auto& space) { space.reorderBodies(); }},
      {"addPlane()",
       [](auto& space) {
         space.addPlane({0, 0, 1}, -50);
       }},
      {"addBox()",
       [](auto& space) {
         space.addBox({-50, -50, -50}, {50, 50, 50});
       }},
      {"removePlane()", [](auto& space) { space.removePlane(0); }},
      {"setPlaneVelocity()",
       [](auto& space) {
         space.setPlaneVelocity(1, {0, 0, 0.1});
       }},
      {"addMaterial()", [&](auto& space) { space.addMaterial(material); }},
      {"setPairMaterial()",
       [&](auto& space) { space.setPairMaterial(defaultMaterial, defaultMaterial, material); }},
      {"setUniformField()",
       [](auto& space) {
         space.setUniformField({0, 0, 0.1});
       }},
      {"setForceHook()", [](auto& space) { space.setForceHook({}); }},
      {"setCollisionHook()", [](auto& space) { space.setCollisionHook({}); }},
      {"setDomain()",
       [](auto& space) {
         space.setDomain(Domain<double>::periodic({90, 90, 90}));
       }},
      {"setG()", [](auto& space) { space.setG(0.1); }},
      {"setTimeStep()", [](auto& space) { space.setTimeStep(0.1); }},
      {"a setting", [](auto& space) { space.setCoeffRestitution(0.1); }},
      {"setDiagnosticsEnabled()", [](auto& space) { space.setDiagnosticsEnabled(true); }},
      {"setLog()", [](auto& space) { space.setLog({}); }},
      {"wakeAll()", [](auto& space) { space.wakeAll(); }},
      {"computeDynamics()", [](auto& space) { space.computeDynamics(0); }},
      {"advanceTo()", [](auto& space) { space.advanceTo(space.time() + 1); }},
      {"assignment of a copy", [&](auto& space) { space = another; }},
      {"assignment", [](auto& space) { space = Space<double>(quiet(1e-2)); }},
      {"a move", [](auto& space) { const Space<double> moved = std::move(space); }},
      {"a move into another", [&](auto& space) { other = std::move(space); }},
      {"a swap", [&](auto& space) { std::swap(space, other); }},
      {"a swap with it", [&](auto& space) { std::swap(other, space); }},
      {"restore()", [](auto& space) { space.restore("no such file"); }},
  };
  const bool inForces = GENERATE(true, false);
  const auto& [name, change] = changes[GENERATE(range(std::size_t{0}, std::size_t{29}))];
  REQUIRE(changes.size() == 29);
  INFO(name);
  Space<double> space(quiet(1e-2));
  space.addPlane({1, 0, 0}, -60);
  space.addPlane({-1, 0, 0}, -60);
  space.addBody(at({-0.505, 0, 0}, {1, 0, 0}));
  space.addBody(at({0.505, 0, 0}, {-1, 0, 0}));
  std::size_t refused = 0;
  const auto attempt = [&, &change = change] {
    Space<double> copy = space;  // between steps, itself
    copy.addBody(at({0, 20, 0}, {0, 0, 0}));
    CHECK_THROWS_AS(change(space), std::logic_error);
    ++refused;
    change(space);
  };
  if (inForces) {
    space.setForceHook([&](Bodies<double, SoA>&, double) { attempt(); });
  } else {
    space.setCollisionHook([&](const Collision<double>&) {
      attempt();
      return CollisionOutcome<double>::bounce();
    });
  }
  CHECK_THROWS_WITH(space.computeDynamics(0),
                    ContainsSubstring("called by a hook, inside a step; allowed: between steps"));
  CHECK(refused == 1);
  CHECK(space.n() == 2);
  CHECK(space.planes().size() == 2);
  CHECK(space.time() == 0.0);
  CHECK(space.getTimeStep() == 1e-2);
  CHECK(space.config().timeStep == 1e-2);
  space.setForceHook({});  // after it they are possible again
  space.setCollisionHook({});
  if (std::string(name) == "restore()") {
    CHECK_THROWS_AS(change(space), std::runtime_error);
  } else {
    CHECK_NOTHROW(change(space));
  }
}

TEST_CASE("Inside a step a copy of the space may be made, and assigned to others") {
  Space<double> space(quiet(1e-2));
  space.addBody(at({0, 0, 0}, {1, 0, 0}));
  Space<double> backup;
  space.setForceHook([&](Bodies<double, SoA>&, double) {
    Space<double> copy = space;
    backup = copy;
    backup = space;
  });
  space.computeDynamics(0);
  CHECK(backup.n() == 1);
  backup.setForceHook({});
  CHECK_NOTHROW(backup.computeDynamics(0));
}

TEST_CASE("A force hook that adds or removes bodies through its argument is refused") {
  for (const bool more : {false, true}) {
    Space<double> space(quiet(1e-2));
    space.addBody(at({0, 0, 0}, {0, 0, 0}));
    space.addBody(at({5, 0, 0}, {0, 0, 0}));
    space.setForceHook([more](Bodies<double, SoA>& bodies, double) {
      if (more) {
        bodies.add(at({9, 0, 0}, {0, 0, 0}));
      } else {
        bodies.remove(bodies[0].id());
      }
    });
    CHECK_THROWS_AS(space.computeDynamics(0), std::logic_error);
    CHECK(space.time() == 0.0);
    space.setForceHook({});
    CHECK_NOTHROW(space.computeDynamics(0));
    CHECK(space.n() == (more ? 3 : 1));
  }
}

// Seen to fail: nothing had moved, so that forces were taken to be those of the present places, without the
// hook's: the body fell by g h/2.
TEST_CASE("Forces that a hook left unfinished are found anew by the next step") {
  Space<double> space(quiet(1e-3));
  space.setUniformField({0, 0, -9.8});
  space.addBody(at({0, 0, 0}, {0, 0, 0}));
  bool fails = false;
  space.setForceHook([&](Bodies<double, SoA>& bodies, double) {
    if (fails) {
      throw std::runtime_error("not now");
    }
    bodies[0].force() += Vec(0, 0, 9.8 * bodies[0].mass());
  });
  space.computeDynamics(0);
  REQUIRE(space.body(0).velocity()[2] == 0.0);
  fails = true;
  CHECK_THROWS_WITH(space.computeDynamics(1), ContainsSubstring("not now"));
  fails = false;
  space.computeDynamics(1);
  CHECK(space.body(0).velocity()[2] == 0.0);
  CHECK(space.body(0).position()[2] == 0.0);
}

TEST_CASE("In a periodic box bodies leave through one side and come in at the other, and meet across it") {
  SimulationConfig<double> config = quiet(1e-2);
  config.coeffRestitution = 1.0;
  Space<double> space(config);
  space.setDomain(Domain<double>::periodic({10, 10, 10}));
  space.addBody(at({4, 0, 0}, {1, 0, 0}));
  space.addBody(at({-4, 0, 0}, {-1, 0, 0}));
  bool met = false;
  for (std::size_t i = 0; i < 300; ++i) {
    space.computeDynamics(i);
    met = met || space.contactCount() > 0;
    for (std::size_t k = 0; k < 2; ++k) {
      CHECK(space.body(k).position()[0] >= -5.0);
      CHECK(space.body(k).position()[0] < 5.0);
    }
  }
  CHECK(met);
  CHECK(space.body(0).velocity() == Vec(-1, 0, 0));
  CHECK(space.body(1).velocity() == Vec(1, 0, 0));
  // Alone it goes round: 300 steps of 0.1.
  Space<double> alone(config);
  alone.setDomain(Domain<double>::periodic({10, 10, 10}));
  alone.addBody(at({0, 0, 0}, {10, 0, 0}));
  advance(alone, 300);
  CHECK_THAT(std::abs(alone.body(0).position()[0]), WithinAbs(0.0, 1e-10));
}

TEST_CASE(
    "What falls through a periodic box gets the work of the field from outside, and the ledger closes") {
  for (const bool sheared : {false, true}) {
    SimulationConfig<double> config = plain(0.01);
    config.integrator = sheared ? IntegratorKind::SymplecticEpicycle : IntegratorKind::VelocityVerlet;
    Space<double> space(config);
    space.setDomain(sheared ? Domain<double>::shearPeriodic({10, 10, 10}, 0.1, 0)
                            : Domain<double>::periodic({10, 10, 10}));
    space.setUniformField({0, 0, -1});
    space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.5, 2.0));
    const double before = space.energyLedger().total();
    advance(space, 700);  // 24.5 m: through the box twice, 2 kg x 1 m s^-2 x 10 m each time
    CHECK(std::abs(space.energyLedger().total() - before) < 1e-10);
    CHECK_THAT(space.energyLedger().work, WithinRel(-40.0, 1e-12));
  }
}

TEST_CASE("A force on a tracer and a torque on a point do no work: nothing feels them") {
  for (const bool point : {false, true}) {
    Space<double> space(plain(0.01));
    space.addBody(ball({1, 0, 0}, {1, 0, 0}, 0, point ? 1.0 : 0.0, {0, 0, 1}));
    space.setForceHook([=](Bodies<double, SoA>& bodies, double) {
      if (point) {
        bodies[0].torque() += Vec(0, 0, 1);
      } else {
        bodies[0].force() -= 4 * Vec(bodies[0].position());
      }
    });
    advance(space, 20);
    CHECK(space.energyLedger().work == 0);
  }
}

TEST_CASE("Another mass of a fixed body is felt at once, in any unit") {
  for (const double unit : {1.0, 1e-20, 1e20}) {
    SimulationConfig<double> config = plain(1e-3);
    config.G = 1 / unit;
    Space<double> space(config);
    Body<double> sun = ball({0, 0, 0}, {0, 0, 0}, 0, unit);
    sun.fixed = true;
    const BodyId centre = space.addBody(sun);
    const BodyId planet = space.addBody(ball({1, 0, 0}, {0, 0, 0}, 0, 1e-3 * unit));
    advance(space, 1);
    space.body(centre).mass() *= 2;
    advance(space, 1);
    // Half a step with the old mass, half of one with the new one at either end of the next.
    CHECK_THAT(Vec(space.body(planet).velocity())[0], WithinRel(-3e-3, 1e-5));
  }
}

TEST_CASE("Gravity and a periodic box go together, in either order; a sheared one needs its integrator") {
  Space<double> space(quiet(1e-3));
  space.setDomain(Domain<double>::periodic({10, 10, 10}));
  space.setG(1.0);
  space.setDomain(Domain<double>::open());
  space.setDomain(Domain<double>::periodic({10, 10, 10}));
  CHECK(space.getG() == 1.0);
  CHECK(!space.domain().isOpen());
  CHECK_THROWS_WITH(space.setDomain(Domain<double>::shearPeriodic({10, 10, 10}, 1.0)),
                    ContainsSubstring("shear-periodic"));
}

TEST_CASE("Centres at one point come apart in a direction of their ids, with momentum kept") {
  for (const std::size_t n : {std::size_t{2}, std::size_t{20}}) {
    SimulationConfig<double> config = quiet(1e-3);
    Space<double> space(config);
    Space<double> again(config);
    for (std::size_t i = 0; i < n; ++i) {
      space.addBody(at({1, 2, 3}, {0, 0, 0}));
      again.addBody(at({1, 2, 3}, {0, 0, 0}));
    }
    advance(space, 300);
    advance(again, 300);
    double nearest = 1e9;
    for (std::size_t i = 0; i < n; ++i) {
      CHECK(isFinite(space.body(i).position()));
      CHECK(space.body(i).position() == again.body(i).position());
      for (std::size_t j = 0; j < i; ++j) {
        nearest = std::min(nearest, (space.body(i).position() - space.body(j).position()).norm());
      }
    }
    CAPTURE(n, nearest);
    CHECK(nearest > 0.99);  // 40 % of the overlap that is left in each of 300 steps
    CHECK((space.conserved().centreOfMass - Vec(1, 2, 3)).norm() < 1e-13);
    CHECK(space.conserved().momentum.norm() < 1e-13);
    CHECK(std::get<0>(space.calculateSystemEnergy()) < 1e-20);  // no velocity comes from overlap
  }
}

TEST_CASE("A not-finite value written through a proxy is refused at the next step, with nothing moved") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto poke = [&](int what, Space<double>& space) {
    auto body = space.body(1);
    switch (what) {
      case 0:
        body.position()[1] = nan;
        break;
      case 1:
        body.velocity()[2] = -std::numeric_limits<double>::infinity();
        break;
      case 2:
        body.angularVelocity()[0] = nan;
        break;
      case 3:
        body.mass() = nan;
        break;
      case 4:
        body.radius() = -1.0;
        break;
      case 5:
        body.orientation().coeffs().setZero();
        break;
      default:
        body.mass() = 0.0;
        break;
    }
  };
  const char* names[] = {"position", "velocity", "angularVelocity", "mass", "radius", "orientation", "mass"};
  for (int what = 0; what < 7; ++what) {
    CAPTURE(names[what]);
    Space<double> space(quiet(1e-3));
    space.addBody(at({0, 0, 0}, {1, 0, 0}));
    space.addBody(at({5, 0, 0}, {1, 0, 0}));
    space.computeDynamics(0);
    const Vec x = space.body(0).position();
    const double t = space.time();
    poke(what, space);
    CHECK_THROWS_WITH(space.computeDynamics(1),
                      ContainsSubstring(names[what]) && ContainsSubstring("body 1"));
    CHECK(space.body(0).position() == x);
    CHECK(space.time() == t);
    CHECK(space.steps() == 1);
  }
}
