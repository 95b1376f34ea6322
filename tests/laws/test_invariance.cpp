#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

/// 40 grains with every kind of contact and gravity, before chaos, in a frame turned by q and boosted by v.
template <class Frame>
std::vector<double> endOf(Frame&& frame, double* time = nullptr) {
  SimulationConfig<double> config = plain(2e-3);
  config.G = 0.5;
  config.adaptiveTimeStep = true;
  config.coeffFriction = 0.3;
  config.coeffStaticFriction = 0.5;
  Space<double> space(config);
  scenes::CloudOptions options;
  options.count = 40;
  options.radius = 1.0;
  options.bodyRadius = {0.1, 0.2};
  options.density = {1.0, 2.0};
  options.velocityDispersion = 1.0;
  options.bodySpin = 1.0;
  for (Body<double> body : scenes::rubbleCloud<double>(options)) {
    frame(body, 0.0);
    space.addBody(body);
  }
  std::size_t contacts = 0;
  for (std::size_t i = 0; i < 100; ++i) {
    space.computeDynamics(i);
    contacts += space.contactCount();
  }
  CHECK(contacts > 10);
  std::vector<double> state;
  for (std::size_t i = 0; i < space.n(); ++i) {
    Body<double> body = space.body(i).load();
    frame(body, space.time());
    for (int k = 0; k < 3; ++k) {
      state.insert(state.end(), {body.position[k], body.velocity[k], body.angularVelocity[k]});
    }
  }
  if (time != nullptr) {
    *time = space.time();
  }
  return state;
}

}  // namespace

TEST_CASE("A boost changes nothing but the place, to rounding, the choice of steps included") {
  double t1 = 0;
  double t2 = 0;
  const Vec boost(3, -2, 1);
  const std::vector<double> rest = endOf([](Body<double>&, double) {}, &t1);
  bool out = true;
  std::size_t seen = 0;
  const std::vector<double> boosted = endOf(
      [&](Body<double>& body, double t) {
        out = seen++ >= 40;  // the first 40 go in, the rest come out
        body.velocity += out ? Vec(-boost) : boost;
        body.position -= out ? Vec(boost * t) : Vec(Vec::Zero());
      },
      &t2);
  CHECK_THAT(t2, WithinRel(t1, 1e-12));
  CHECK(difference(rest, boosted) < 1e-11);  // 1e-15 of the boost, and ten blows' growth
}

// Two balls lean on each other, held by their gravity, then one is thrown at the other at four times what a
// step brings together. With the whole of a common fall in the threshold of rest, a hundred times as much, it
// stopped.
TEST_CASE("What leans on each other in free fall bounces from the speed on from which it does at rest") {
  const double h = 1e-3;
  const double speed = 4 * h / 2;  // each falls by G m/(2 R)^2 = 1/4
  for (const double pull : {0.0, 50.0}) {
    SimulationConfig<double> config = plain(h);
    config.G = 1;
    config.coeffRestitution = 0.5;
    Space<double> space(config);
    space.addBody(ball({-1, 0, 0}, {0, 0, 0}, 1, 1));
    space.addBody(ball({1, 0, 0}, {0, 0, 0}, 1, 1));
    space.setUniformField({0, pull, 0});
    for (std::size_t i = 0; i < 3; ++i) {
      space.computeDynamics(i);
      REQUIRE(space.contactImpulses().size() == 1);
      REQUIRE(space.contactImpulses()[0].normal > 0);
    }
    space.body(0).velocity() += Vec(speed, 0, 0);
    space.computeDynamics(3);
    const double apart = (Vec(space.body(1).velocity()) - Vec(space.body(0).velocity()))[0];
    CHECK(std::abs(apart - 0.5 * speed) < h / 2);  // by which they fall towards each other in the step
  }
}

TEST_CASE("Space has no preferred direction: a scene turned ends turned") {
  const Quaternion<double> q = Quaternion<double>(Eigen::AngleAxisd(1.1, Vec(1, 2, -0.5).normalized()));
  const std::vector<double> plainEnd = endOf([](Body<double>&, double) {});
  std::size_t seen = 0;
  const std::vector<double> turned = endOf([&](Body<double>& body, double) {
    const Quaternion<double> r = seen++ >= 40 ? q.conjugate() : q;
    body.position = r * body.position;
    body.velocity = r * body.velocity;
    body.angularVelocity = r * body.angularVelocity;
  });
  CHECK(difference(plainEnd, turned) < 1e-11);
}

// A ball falls on one that rests on a floor: both blows of the lower one, and those that follow, are of one
// moment, and what they lift off its floor is let go after the last of them. Seen to fail: by the rounding of
// places and gaps 38 of these 200 were let go between them in one of the two scenes (off by up to 0.037 m/s).
// Places are known to 4e-15 m here, so moments to 1e-13 s and speeds to 1e-12 m/s.
TEST_CASE("Where a scene stands makes no difference to the blows of one moment") {
  const auto parting = [](const Vec& corner, const Vec& from, double gap) {
    SimulationConfig<double> config = plain(0.25 / 16);
    config.coeffRestitution = 0.7;
    Space<double> space(config);
    space.setUniformField({0, 0, -9.81});
    space.addPlane({0, 0, 1}, corner[2]);
    const Vec below = corner + Vec(0, 0, 0.1);
    space.addBody(ball(below, {0, 0, 0}, 0.1));
    space.addBody(ball(below + (0.2 + gap) * from, -0.4 * from, 0.1));
    do {
      space.computeDynamics(space.steps());
      REQUIRE(space.steps() < 40);
    } while (space.impacts().empty());
    space.computeDynamics(space.steps());
    return Vec(space.body(1).velocity() - space.body(0).velocity());
  };
  for (const Vec& from : {Vec(0, 0, 1), Vec(Vec(0.1, 0.2, 1).normalized())}) {
    for (int k = 0; k < 50; ++k) {
      const double gap = 0.2 + 0.1 * std::fmod(0.61803398875 * k, 1.0);
      const Vec here = parting({0, 0, 0}, from, gap);
      CAPTURE(from.transpose(), gap, here.transpose());
      CHECK((parting({30, -21, 30}, from, gap) - here).norm() < 1e-10);
      CHECK((parting({3, -2.1, 3}, from, gap) - here).norm() < 1e-10);
    }
  }
}

// The law G m t^2 / x^3 has no scale: lengths times 2^7, times times 2^5, masses times 2^11 with G to match
// give the same numbers times powers of two, to the bit.
TEST_CASE("Units do not matter: powers of two in length, time and mass change no bit") {
  const auto run = [](double length, double time, double mass) {
    SimulationConfig<double> config = plain(time / 512);
    config.G = 0.5 * length * length * length / (time * time * mass);
    config.epsilon = 0.0;
    config.coeffFriction = 0.25;
    config.coeffStaticFriction = 0.5;
    Space<double> space(config);
    scenes::CloudOptions options;
    options.count = 40;
    options.radius = 1.0;
    options.bodyRadius = {0.1, 0.2};
    options.density = {1.0, 2.0};
    options.velocityDispersion = 1.0;
    for (Body<double> body : scenes::rubbleCloud<double>(options)) {
      body.position *= length;
      body.radius *= length;
      body.velocity *= length / time;
      body.mass *= mass;
      space.addBody(body);
    }
    advance(space, 200);
    std::vector<double> state;
    for (std::size_t i = 0; i < space.n(); ++i) {
      for (int k = 0; k < 3; ++k) {
        state.push_back(space.body(i).position()[k] / length);
        state.push_back(space.body(i).velocity()[k] * time / length);
        state.push_back(space.body(i).angularVelocity()[k] * time);
      }
    }
    return state;
  };
  CHECK(sameBits(run(1, 1, 1), run(128, 32, 2048)));
  CHECK(sameBits(run(1, 1, 1), run(0x1p-30, 0x1p+10, 0x1p-70)));
}
