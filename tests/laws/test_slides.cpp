// Slides, and rolls against resistance, whose direction turns.

#include "laws/laws.hpp"
#include "support/catch.hpp"

#include <cmath>
#include <functional>

using namespace gravel;
using namespace gravel::test;

namespace test_slides {

namespace {

constexpr double weight = 10;  // [m s^-2]
constexpr double radius = 0.5;

struct Motion {
  Vec x, v, w;
  Motion along(const Motion& rate, double h) const {
    return {x + h * rate.x, v + h * rate.v, w + h * rate.w};
  }
};

/// A ball on an incline that falls towards +x: either it slides all the time, or it rolls.
struct Incline {
  double slope;
  double friction;
  double rolling;
  double k;  ///< of its inertia k m R^2
  bool slides;

  Motion rate(const Motion& now) const {
    const Vec n(0, 0, 1);
    const double press = weight * std::cos(slope);  // [N] over mass
    const Vec pull(weight * std::sin(slope), 0, 0);
    const Vec turn = now.w - n.dot(now.w) * n;
    if (!slides) {  // v = w x R n
      const Vec a = (pull - rolling * press * now.v.normalized()) / (1 + k);
      return {now.v, a, n.cross(a) / radius};
    }
    const Vec slip = now.v + now.w.cross(-radius * n);
    const Vec rub = -friction * press * slip.normalized();
    const Vec resist = rolling > 0 ? Vec(-rolling * press * radius * turn.normalized()) : Vec(0, 0, 0);
    return {now.v, pull + rub, (Vec(-radius * n).cross(rub) + resist) / (k * radius * radius)};
  }

  /// By the classical method of Runge and Kutta.
  Motion after(Motion now, double time) const {
    constexpr int steps = 20'000;
    const double h = time / steps;
    for (int i = 0; i < steps; ++i) {
      const Motion k1 = rate(now);
      const Motion k2 = rate(now.along(k1, h / 2));
      const Motion k3 = rate(now.along(k2, h / 2));
      const Motion k4 = rate(now.along(k3, h));
      now = now.along(k1, h / 6).along(k2, h / 3).along(k3, h / 3).along(k4, h / 6);
    }
    return now;
  }
};

SimulationConfig<double> rough(double dt, double friction, double rolling) {
  SimulationConfig<double> config = plain(dt);
  config.coeffRestitution = 0;
  config.coeffFriction = config.coeffStaticFriction = friction;
  config.rollingFriction = rolling;
  config.contactSubsteps = 1;
  config.contactTolerance = 1e-10;
  config.contactIterations = 1000;
  return config;
}

double distance(const Motion& a, const Motion& b) {
  return (a.x - b.x).norm() + (a.v - b.v).norm() + radius * (a.w - b.w).norm();
}

Motion motionOf(const Space<double>& space, std::size_t i) {
  return {space.body(i).position(), space.body(i).velocity(), space.body(i).angularVelocity()};
}

}  // namespace

// A step of velocity Verlet whose friction is against the mean of the slips before and after each half.
// Seen to fail (orders 0.99 to 1.01, errors of 2e-3 to 8e-3 at 10 ms): friction and resistance against what
// they leave; the slip before with the kick in it, which is the same; where something resists, the turn
// before not known.
TEST_CASE("Slides and rolls in a direction that turns are of second order in the step") {
  const auto [incline, start, most] = GENERATE(table<Incline, Motion, double>({
      // Across the slope: a block (what can hardly turn), a ball, one that rolls, one that does both.
      {{0.5, 0.3, 0, 1e9, true}, {{0, 0, radius}, {0, 2, 0}, {0, 0, 0}}, 2e-4},
      {{0.9, 0.1, 0, 0.4, true}, {{0, 0, radius}, {0, 3, 0}, {0, 0, 0}}, 2e-4},
      {{0.2, 0.9, 0.1, 0.4, false}, {{0, 0, radius}, {0, 2, 0}, {-4, 0, 0}}, 5e-5},
      {{0.9, 0.1, 0.05, 0.4, true}, {{0, 0, radius}, {0, 3, 0}, {-1, 0, 0}}, 2e-4},
  }));
  constexpr double time = 0.8;
  const Motion exact = incline.after(start, time);
  double before = 0;
  for (const double dt : {1e-2, 5e-3, 2.5e-3}) {
    Space<double> space(rough(dt, incline.friction, incline.rolling));
    space.setUniformField({weight * std::sin(incline.slope), 0, -weight * std::cos(incline.slope)});
    space.addPlane({0, 0, 1}, 0.0);
    Body<double> body = ball(start.x, start.v, radius, 1.0, start.w);
    body.inertia = incline.k * radius * radius;
    space.addBody(body);
    advance(space, static_cast<std::size_t>(std::lround(time / dt)));
    Motion end = motionOf(space, 0);
    if (incline.k > 1) {
      end.w = exact.w;  // 1e-9 of it
    }
    const double error = distance(end, exact);
    CAPTURE(incline.slope, incline.friction, incline.rolling, incline.k, dt, error, before);
    if (before > 0) {
      const double order = std::log2(before / error);
      CHECK(order > 1.9);
      CHECK(order < 2.1);
    } else {
      CHECK(error < most);
    }
    before = error;
  }
}

// Slips by which a normal turns, that two contacts share, or that a belt makes. By the differences of runs
// with steps of 4, 2 and 1 ms. Seen to fail: friction against what it leaves (order 1.00); the slip before
// without the belt's speed (1.00); over the sphere, what is left to the way ahead not given back to the slip
// before (1.22).
TEST_CASE("Slides over spheres, in grooves and on belts are of second order in the step") {
  struct Scene {
    const char* name;
    double friction, rolling;
    std::function<void(Space<double>&)> fill;
  };
  const auto groove = [](Space<double>& space) {
    space.setUniformField({0, 4, -weight});
    space.addPlane(Vec(1, 0, 1).normalized(), 0.0);
    space.addPlane(Vec(-1, 0, 1).normalized(), 0.0);
    return radius * std::sqrt(2.0);
  };
  const std::vector<Scene> scenes{
      {"over a fixed sphere", 0.2, 0,
       [](Space<double>& space) {
         space.setUniformField({0, 0, -weight});
         Body<double> dome = ball({0, 0, 0}, {0, 0, 0}, 5);
         dome.fixed = true;
         space.addBody(dome);
         space.addBody(ball({5.5 * std::sin(0.3), 0, 5.5 * std::cos(0.3)}, {0, 2, 0}, radius, 1, {3, 0, 1}));
       }},
      {"along a groove", 0.2, 0,
       [&](Space<double>& space) {
         space.addBody(ball({0, 0, groove(space)}, {0, 3, 0}, radius, 1, {8, 6, 5}));
       }},
      {"two that push each other along a groove", 0.15, 0.02,
       [&](Space<double>& space) {
         const double z = groove(space);
         space.addBody(ball({0, 0, z}, {0, 3, 0}, radius, 1, {8, 6, 5}));
         space.addBody(ball({0, 1, z}, {0, 3, 0}, radius, 1, {-8, 6, -5}));
       }},
      {"on a belt", 0.2, 0,
       [](Space<double>& space) {
         space.setUniformField({5, 0, -9});
         space.setPlaneVelocity(space.addPlane({0, 0, 1}, 0.0), {0, 6, 0});
         space.addBody(ball({0, 0, radius}, {0, 0, 0}, radius));
       }},
  };
  for (const Scene& scene : scenes) {
    std::vector<Motion> ends;
    for (const double dt : {4e-3, 2e-3, 1e-3}) {
      Space<double> space(rough(dt, scene.friction, scene.rolling));
      scene.fill(space);
      const double energy = space.energyLedger().total();
      advance(space, static_cast<std::size_t>(std::lround(0.4 / dt)));
      ends.push_back(motionOf(space, space.n() - 1));
      CHECK_THAT(space.energyLedger().total(), WithinAbs(energy, 1e-11));
    }
    CAPTURE(scene.name, distance(ends[0], ends[1]), distance(ends[1], ends[2]));
    const double order = std::log2(distance(ends[0], ends[1]) / distance(ends[1], ends[2]));
    CHECK(order > 1.9);
    CHECK(order < 2.1);
  }
}

// Where friction stops a slide, or resistance a roll, the ball must stay, and its last steps must not spoil
// what those before gained: 6e-6 m at 4 ms. Seen to fail: friction against what it leaves (1.3e-3 m).
TEST_CASE("What slides and rolls in a direction that turns comes to rest where shorter steps bring it") {
  std::vector<Motion> ends;
  for (const double dt : {4e-3, 2e-3, 5e-4}) {
    SimulationConfig<double> config = rough(dt, 0.3, 0.15);
    config.coeffStaticFriction = 0.4;
    Space<double> space(config);
    space.setUniformField({1, 0, -weight});
    space.addPlane({0, 0, 1}, 0.0);
    space.addBody(ball({0, 0, radius}, {0, 1.5, 0}, radius, 1, {5, 5, 0}));
    advance(space, static_cast<std::size_t>(std::lround(8 / dt)));
    ends.push_back(motionOf(space, 0));
    CHECK(ends.back().v.norm() < 1e-13);
    CHECK(ends.back().w.norm() < 1e-13);
  }
  CAPTURE((ends[0].x - ends[2].x).norm(), (ends[1].x - ends[2].x).norm());
  CHECK((ends[0].x - ends[2].x).norm() < 1e-4);
  CHECK((ends[1].x - ends[2].x).norm() < (ends[0].x - ends[2].x).norm());
}

// Seen to fail (0.037 m/s), where slips before the kick were asked for of what is slow, too: what the torque
// did in the kick passed for a slide, which used friction up.
TEST_CASE("A torque that static friction can hold makes a ball roll") {
  constexpr double slope = 0.562, friction = 0.3, torque = 1.066;
  Space<double> space(rough(0.02, friction, 0.0));
  space.setUniformField({weight * std::sin(slope), 0, -weight * std::cos(slope)});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, radius}, {0, 0, 0}, radius));
  space.setForceHook([](auto& bodies, double) { bodies[0].torque() += Vec(-torque, 0, 0); });
  advance(space, 50);
  const Motion end = motionOf(space, 0);
  CHECK((end.v + end.w.cross(Vec(0, 0, -radius))).norm() < 1e-12);
  const Vec rolls = Vec(weight * std::sin(slope), torque / radius, 0) / 1.4;
  CHECK((end.v - rolls).norm() < 1e-11);
}

}  // namespace test_slides
