#include "laws/rebound.hpp"
#include "support/catch.hpp"

// A ball dropped from height h onto a plane: heights h e^(2n), and rest after sqrt(2h/g) (1 + e)/(1 - e).

using namespace gravel;
using namespace gravel::test;

namespace test_bounce {

namespace {

constexpr double g = 9.81;
constexpr double radius = 0.1;

struct Drop {
  double time = 0;   ///< of the last bounce that the step resolves
  double moved = 0;  ///< in the second after that
  double gap = 0;    ///< to the plane at the end
  double speed = 0;  ///< largest |v| in the second after that
};

Drop drop(double e, double dt) {
  const double height = 1.0;
  SimulationConfig<double> config = plain(dt);
  config.coeffRestitution = e;
  Space<double> space(config);
  space.setUniformField({0, 0, -g});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, radius + height}, {0, 0, 0}, radius));
  Drop result;
  const double end = std::sqrt(2 * height / g) * (1 + e) / (1 - e);
  std::size_t i = 0;
  while (space.time() < 1.1 * end + 0.2) {
    space.computeDynamics(i++);
    const double v = space.body(0).velocity()[2];
    if (std::abs(v) > 1e-12 * std::sqrt(2 * g * height)) {
      result.time = space.time();
    }
  }
  const double place = space.body(0).position()[2];
  for (int k = 0; k < static_cast<int>(1.0 / dt); ++k) {
    space.computeDynamics(i++);
    result.speed = std::max(result.speed, space.body(0).velocity().norm());
    result.moved = std::max(result.moved, std::abs(space.body(0).position()[2] - place));
  }
  result.gap = space.body(0).position()[2] - radius;
  return result;
}

}  // namespace

TEST_CASE("A dropped ball rests after its bounces: no speed, no sinking, no jitter") {
  for (const double e : {0.0, 0.3, 0.5, 0.9}) {
    for (const double dt : {4e-3, 1e-3}) {
      const Drop d = drop(e, dt);
      CAPTURE(e, dt, d.time);
      CHECK(d.speed < 1e-12 * std::sqrt(2 * g));
      CHECK(d.moved < 1e-12);
      CHECK(std::abs(d.gap) < g * dt * dt);
    }
  }
}

// Seen to fail: a blow that changes the velocity alone, not the place from which the drift begins.
TEST_CASE("In a uniform field every bounce is at its exact time and height, whatever the step") {
  for (const double e : {0.3, 0.5, 0.9}) {
    for (const double dt : {2e-2, 4e-3, 5e-4}) {
      for (const double h : {1.0, 1.07}) {
        SimulationConfig<double> config = plain(dt);
        config.coeffRestitution = e;
        Space<double> space(config);
        space.setUniformField({0, 0, -g});
        space.addPlane({0, 0, 1}, 0.0);
        space.addBody(ball({0, 0, radius + h}, {0, 0, 0}, radius));
        const double first = std::sqrt(2 * h / g);
        const double end = first * (1 + e) / (1 - e);
        double settled = 0;
        double worst = 0;
        std::size_t bounces = 0;
        for (std::size_t i = 0; space.time() < end + 3 * dt; ++i) {
          space.computeDynamics(i);
          for (const Impact<double>& impact : space.impacts()) {
            const double t = space.time() - space.getPreviousTimeStep() + impact.time;
            // After k bounces the next one follows at t_1 (1 + 2 e (1 - e^k)/(1 - e)), at speed v_1 e^k.
            const double passed = std::pow(e, static_cast<double>(bounces));
            worst = std::max(worst, std::abs(t - first * (1 + 2 * e * (1 - passed) / (1 - e))));
            CHECK_THAT(impact.speed, WithinAbs(std::sqrt(2 * g * h) * passed, 1e-11));
            settled = space.time() - space.getPreviousTimeStep() + impact.settle;
            ++bounces;
          }
        }
        CAPTURE(e, dt, h, bounces, settled - end);
        CHECK(bounces > 3);
        CHECK(worst < 1e-11);
        CHECK(std::abs(settled - end) < 1e-11);
        CHECK(space.impacts().empty());
      }
    }
  }
}

// Seen to fail: the lower ball seen as one that falls (the impact g h/2 too fast, and bounces without end);
// energy taken from the velocity of what rests (the ledger off by a hundredth of the fall).
TEST_CASE("On a ball that rests a ball bounces as on the ground: exact times and heights, and an end") {
  for (const double e : {1.0, 0.5, 0.0}) {
    for (const double height : {1.0, 0.05}) {
      for (const double h : {0.01, 0.0037}) {
        SimulationConfig<double> config = plain(h);
        config.coeffRestitution = e;
        Space<double> space(config);
        space.setUniformField({0, 0, -9.81});
        space.addPlane({0, 0, 1}, 0);
        space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5, 1e9));  // stays where it is, to 1e-9 of the other
        space.addBody(ball({0, 0, 1.5 + height}, {0, 0, 0}, 0.5, 1.0));
        space.computeDynamics(0);
        const double energy = space.energyLedger().total();
        const double first = std::sqrt(2 * height / 9.81);
        double hit = 0;
        double speed = 0;
        for (std::size_t i = 1; hit == 0.0 && i < 400; ++i) {
          space.computeDynamics(i);
          for (const Impact<double>& impact : space.impacts()) {
            hit = space.time() - h + impact.time;
            speed = impact.speed;
          }
        }
        CAPTURE(e, height, h);
        CHECK_THAT(hit, WithinRel(first, 1e-12));
        CHECK_THAT(speed, WithinRel(9.81 * first, 1e-8));  // of rest, to what it is solved
        const double t = space.time() - first;
        CHECK_THAT(space.body(1).position()[2] - 1.5,
                   WithinAbs(std::max(0.0, 9.81 * t * (e * first - t / 2)), 1e-7));
        if (e < 1) {
          for (std::size_t i = 0; i < 400; ++i) {
            space.computeDynamics(i);
          }
          CHECK(space.impacts().empty());
          CHECK(space.contacts().size() == 2);
          CHECK(space.body(1).velocity().norm() < 1e-9);
          CHECK_THAT(space.body(1).position()[2], WithinAbs(1.5, 1e-6));
        }
        CHECK_THAT(space.energyLedger().total(), WithinAbs(energy, 1e-15 * 4.9e9));
        CHECK(space.body(0).velocity().norm() < 1e-8);
      }
    }
  }
}

namespace {

/// Two spheres that fall on each other and bounce (r0 = 2, touching at 1): errors of the first rebound's
/// largest distance and of the time of the second impact, whose exact values are those of Kepler's problem.
struct Rebound {
  double height = 0;
  double time = 0;
};

Rebound rebound(double dt, double start) {
  Space<double> space = rebounding(plain(dt), start);
  const double height = reboundHeight(start);
  const double second = reboundTime(start);
  Rebound error;
  int hits = 0;
  double top = 0;
  for (std::size_t i = 0; hits < 2; ++i) {
    space.computeDynamics(i);
    for (const Impact<double>& impact : space.impacts()) {
      ++hits;
      if (hits == 2) {
        error.height = std::abs(top / height - 1);
        error.time = std::abs(space.time() - space.getPreviousTimeStep() + impact.time - second);
      }
    }
    const double r = space.body(1).position()[0] - space.body(0).position()[0];
    const double v = space.body(1).velocity()[0] - space.body(0).velocity()[0];
    top = hits == 1 ? 1 / (1 / r - v * v / 4) : 0;
  }
  return error;
}

Rebound meanRebound(double dt) {
  Rebound sum;
  for (int k = 0; k < 32; ++k) {
    const Rebound one = rebound(dt, 2.0 + 0.0037 * k);
    sum.height += one.height / 32;
    sum.time += one.time / 32;
  }
  return sum;
}

}  // namespace

TEST_CASE("A rebound under mutual gravity is of the second order of the step, and right to 1e-6 at 1e-3") {
  CHECK(rebound(1e-3, 2.0).height < 1e-6);
  const Rebound coarse = meanRebound(8e-3);
  const Rebound fine = meanRebound(1e-3);
  CAPTURE(coarse.height, fine.height, coarse.time, fine.time);
  CHECK_THAT(std::log2(coarse.height / fine.height) / 3, WithinAbs(2.0, 0.2));
  CHECK_THAT(std::log2(coarse.time / fine.time) / 3, WithinAbs(2.0, 0.2));
}

namespace {

/// Takes steps until `count` impacts have been; what the mechanical energy is off by then, relative.
double energyErrorAfter(Space<double>& space, std::size_t count) {
  const double start = space.energyLedger().mechanical();
  std::size_t seen = 0;
  for (std::size_t i = 0; seen < count; ++i) {
    space.computeDynamics(i);
    seen += space.impacts().size();
  }
  return std::abs(space.energyLedger().mechanical() / start - 1);
}

}  // namespace

// A blow errs by up to 1.7 h^2 of the energy (off centre 0.5 h^2), where in the step it falls decides by
// which sign: a walk of 1000 such steps is 54 h^2 (15 h^2), and the bounds are twice that. Seen to fail with
// blows by the acceleration of the step's start alone, all of one sign: 0.5 and 0.17 of the energy after 1000
// at h = 0.02 and 0.01, off centre 0.05 at 0.01.
TEST_CASE("Elastic spheres under their own gravity keep their energy from bounce to bounce, and momentum") {
  for (const double h : {0.02, 0.01, 0.0025}) {
    const std::size_t blows = h < 0.01 ? 200 : 1000;
    for (const std::size_t parts : {1U, 4U}) {
      SimulationConfig<double> config = plain(h);
      config.G = 1;
      config.coeffRestitution = 1;
      config.contactSubsteps = parts;
      Space<double> pair(config);
      pair.addBody(ball({-1, 0, 0}, {0, 0, 0}, 0.5));
      pair.addBody(ball({1, 0, 0}, {0, 0, 0}, 0.5));
      CAPTURE(h, parts);
      CHECK(energyErrorAfter(pair, blows) <= 100 * h * h);
      CHECK(pair.energyLedger().restitution == 0);

      Space<double> oblique(config);
      oblique.addBody(ball({0, 0, 0}, {0, -0.1, 0}, 0.7, 1.0));
      oblique.addBody(ball({1.6, 0, 0}, {0, 0.3, 0}, 0.3, 1.0 / 3));
      const ConservedQuantities<double> before = oblique.conserved();
      CHECK(energyErrorAfter(oblique, blows) <= 30 * h * h);
      const ConservedQuantities<double> after = oblique.conserved();
      CHECK_THAT((after.momentum - before.momentum).norm(), WithinAbs(0, 1e-11));
      if (parts == 1) {  // forces that are held through parts are not central where bodies get by then
        CHECK_THAT((after.angularMomentum - before.angularMomentum).norm(), WithinAbs(0, 1e-11));
      }
    }
  }
}

// Seen to fail in the same way, 0.12 at h = 0.02: 0.3 h^2 a blow, of either sign 10 h^2 in 1000.
TEST_CASE("An elastic ball that a spring throws at the floor keeps its energy, and the floor its momentum") {
  for (const double h : {0.02, 0.005}) {
    SimulationConfig<double> config = plain(h);
    config.coeffRestitution = 1;
    Space<double> space(config);
    space.addPlane({0, 0, 1}, 0.0);
    space.addBody(ball({0, 0, 1.1}, {0, 0, 0}, 0.1));
    // k = 1 N/m, at rest half a metre inside the floor: energy (v^2 + (z + 0.4)^2)/2.
    space.setForceHook([](auto& bodies, double) {
      bodies[0].force() += Vector3<double>(0, 0, -(bodies[0].position()[2] + 0.4));
    });
    const auto energy = [&] {
      const double v = space.body(0).velocity()[2];
      const double z = space.body(0).position()[2] + 0.4;
      return (v * v + z * z) / 2;
    };
    const double start = energy();
    std::size_t seen = 0;
    for (std::size_t i = 0; seen < 1000; ++i) {
      space.computeDynamics(i);
      seen += space.impacts().size();
    }
    CHECK_THAT(energy(), WithinRel(start, 20 * h * h));
  }
}

// Half of e u, the speed at which the pair parts with it. Seen to fail: 1e-5 at h = 0.02, where the blow
// without restitution was taken to end in rest, though the tide of a large mass pulls the pair apart.
TEST_CASE("A blow without restitution between two whom gravity parts is the limit of a small restitution") {
  constexpr double u = 0.3;
  constexpr double e = 1e-9;
  const auto after = [](double restitution, double h) {
    SimulationConfig<double> config = plain(h);
    config.G = 1;
    config.coeffRestitution = restitution;
    Space<double> space(config);
    Body<double> star = ball({0, 0, 0}, {0, 0, 0}, 0, 10);
    star.fixed = true;
    space.addBody(star);
    space.addBody(ball({1, 0, 0}, {0, 0, 0}, 0.1, 1e-6));
    space.addBody(ball({1.2 + 0.3 * u * h, 0, 0}, {-u, 0, 0}, 0.1, 1e-6));
    space.computeDynamics(0);
    REQUIRE(space.impacts().size() == 1);
    return Vector3<double>(space.body(1).velocity());
  };
  for (const double h : {0.02, 0.01, 0.005}) {
    CHECK((after(0, h) - after(e, h)).norm() <= e * u);
  }
}

// A ball slides on the floor into something at u, and what the blow's friction and the floor's do to it after
// that presses it on. Both runs deal the same blows. They differ by what the ball leaves with, e u, and by up
// to 21 times that where it meets a fixed one again and again. Seen to fail in 63 of the 64 runs: what left
// with less than a step's fall was not taken to rest, so that the friction of the step's end drove it in, by
// up to 0.021 off a wall and a fixed ball, and by 0.45 off a ball.
TEST_CASE("A blow that leaves next to nothing of a ball's speed is the limit of none, on a floor as well") {
  constexpr double u = 2;
  constexpr double e = 1e-9;
  enum class Partner { Wall, Fixed, Ball, Heavy };
  for (const Partner partner : {Partner::Wall, Partner::Fixed, Partner::Ball, Partner::Heavy}) {
    for (const double friction : {0.5, 1.0}) {
      for (const double h : {0.01, 0.002}) {
        for (int phase = 0; phase < 4; ++phase) {
          CAPTURE(partner, friction, h, phase);
          const auto scene = [&](double restitution) {
            SimulationConfig<double> config = plain(h);
            config.coeffRestitution = restitution;
            config.coeffFriction = config.coeffStaticFriction = friction;
            Space<double> space(config);
            space.setUniformField({0, 0, -g});
            space.addPlane({0, 0, 1}, 0.0);
            space.addBody(ball({0.15 + 0.0055 * phase, 0, radius}, {-u, 0, 0}, radius));
            if (partner == Partner::Wall) {
              space.addPlane({1, 0, 0}, 0.0);
            } else {
              Body<double> other = ball({-radius, 0, radius}, {0, 0, 0}, radius);
              other.mass = partner == Partner::Heavy ? 20 : 1;
              other.fixed = partner == Partner::Fixed;
              space.addBody(other);
            }
            return space;
          };
          Space<double> none = scene(0);
          Space<double> little = scene(e);
          double most = 0;
          while (none.time() < 0.15) {
            none.computeDynamics(none.steps());
            little.computeDynamics(little.steps());
            for (std::size_t i = 0; i < none.n(); ++i) {
              most = std::max(most, (Vec(none.body(i).velocity()) - Vec(little.body(i).velocity())).norm());
            }
          }
          CHECK(most < 50 * e * u);
        }
      }
    }
  }
}

// A ball that bounces once a turn on a plate that shakes, A sin(w t), leaves it at g T/2 (T = 2 pi/w) where
// the plate has the speed V = (1 - e)/(1 + e) g T/2. Such bounces, each at the same phase, are stable up to
//   A w^2/g = sqrt((pi (1 - e)/(1 + e))^2 + (2 (1 + e^2)/(1 + e)^2)^2)
// (Holmes 1982, J. Sound Vib. 84, 173; of the map with the plate's place in it); above, they take turns at
// two phases, which at 2 % more are 0.5172 (e = 0.5) and 0.6348 (0.8) apart by the exact map. Near the
// threshold errors of the second order in w h count as many times as it is near: 0.027, 0.008 and 0.002 at 2
// % less and 100, 200 and 400 steps a turn. Seen to fail: blows that meet the mean velocity of the step.
TEST_CASE("Bounces on a plate that shakes double their period at the strength of the closed form") {
  const double w = 20;
  const double turn = 2 * pi<double>() / w;
  for (const auto& [e, phases] : {std::pair{0.5, 0.5172}, {0.8, 0.6348}}) {
    const double gain = (1 - e) / (1 + e);
    const double most = std::hypot(pi<double>() * gain, 2 * (1 + e * e) / ((1 + e) * (1 + e)));
    for (const double part : {0.98, 1.02}) {
      const double A = part * most * g / (w * w);
      const double start = (std::acos(gain * g * turn / 2 / (A * w)) + 1e-3) / w;
      const auto plate = [&](double t) { return A * std::sin(w * (start + t)); };
      const double h = turn / 400;
      SimulationConfig<double> config = plain(h);
      config.coeffRestitution = e;
      Space<double> space(config);
      space.setUniformField({0, 0, -g});
      const std::size_t plane = space.addPlane({0, 0, 1}, plate(0));
      space.addBody(ball({0, 0, plate(0) + radius}, {0, 0, g * turn / 2}, radius));
      double last = 0;
      double apart = 0;  // of the phases of the last two bounces
      int bounces = 0;
      while (bounces < 300 && space.time() < 301 * turn) {
        const double t = space.time();
        space.setPlaneVelocity(plane, {0, 0, (plate(t + h) - plate(t)) / h});
        space.computeDynamics(0);
        for (const Impact<double>& impact : space.impacts()) {
          apart = std::abs(std::remainder(w * (t + impact.time - last), 2 * pi<double>()));
          last = t + impact.time;
          ++bounces;
        }
      }
      CAPTURE(e, part, apart);
      CHECK(bounces == 300);
      if (part < 1) {
        CHECK(apart < 0.01);
      } else {
        CHECK_THAT(apart, WithinRel(phases, 0.01));
      }
    }
  }
}

}  // namespace test_bounce
