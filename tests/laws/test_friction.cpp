#include "laws/laws.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

namespace test_friction {

namespace {

constexpr double g = 9.81;
constexpr double radius = 0.25;

/// A ball on the plane z >= 0 under gravity turned by `slope` towards +x: an incline, seen along it.
Space<double> onPlane(double dt, double slope, double mu_k, double mu_s, const Vec& v) {
  SimulationConfig<double> config = plain(dt);
  config.coeffRestitution = 0.0;
  config.coeffFriction = mu_k;
  config.coeffStaticFriction = mu_s;
  Space<double> space(config);
  space.setUniformField({g * std::sin(slope), 0, -g * std::cos(slope)});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, radius}, v, radius, 3.0));
  return space;
}

double slipOf(const Space<double>& space) {
  return space.body(0).velocity()[0] - space.body(0).angularVelocity()[1] * radius;
}

}  // namespace

// Coulomb: v = v0 - mu g t, omega = (5/2) mu g t / R until they meet at v = 5/7 v0. Between the two regimes
// the step is exact (constant forces), so that only the step in which they change errs: by mu g dt^2 / 2 at
// most.
TEST_CASE("A sliding ball rolls with five sevenths of its speed, after the time and way of the closed form") {
  const double mu = 0.2;
  const double v0 = 3.0;
  const double t_roll = 2 * v0 / (7 * mu * g);
  const double s_roll = 12 * v0 * v0 / (49 * mu * g);
  for (const double dt : {4e-3, 1e-3}) {
    Space<double> space = onPlane(dt, 0.0, mu, mu, {v0, 0, 0});
    std::size_t i = 0;
    double rolls = -1;
    double slid = 0;
    while (space.time() < 2.0) {
      space.computeDynamics(i++);
      const double slip = slipOf(space);
      if (rolls < 0 && std::abs(slip) < 1e-9) {
        rolls = space.time();
        slid = space.body(0).position()[0];
      } else if (rolls < 0) {
        CHECK_THAT(slip, WithinAbs(v0 - 3.5 * mu * g * space.time(), 1e-10));
      }
    }
    CAPTURE(dt, rolls);
    CHECK(rolls >= t_roll);
    CHECK(rolls <= t_roll + dt);
    CHECK_THAT(slid, WithinAbs(s_roll + 5.0 / 7 * v0 * (rolls - t_roll), mu * g * dt * dt / 2));
    CHECK_THAT(space.body(0).velocity()[0], WithinAbs(5.0 / 7 * v0, 1e-10));
    CHECK(std::abs(slipOf(space)) < 1e-10);
    CHECK_THAT(space.body(0).position()[0],
               WithinAbs(s_roll + 5.0 / 7 * v0 * (space.time() - t_roll), mu * g * dt * dt / 2));
    CHECK(std::abs(space.body(0).position()[2] - radius) < 1e-12);
    // What friction took: half the slip's energy of m* = m, (2/7) m v0^2 / 2.
    CHECK_THAT(space.energyLedger().friction, WithinRel(3.0 * v0 * v0 / 7, 1e-3));
    CHECK_THAT(space.energyLedger().restitution, WithinAbs(0.0, 1e-10));
  }
}

// Constant forces and constant friction: velocity Verlet with contact forces in both halves is exact.
TEST_CASE("On an incline a ball rolls with 5/7 g sin, and slides where tan exceeds 7/2 of static friction") {
  const double mu_k = 0.2;
  const double mu_s = 0.3;
  for (const double factor : {0.3, 0.95, 1.05, 2.0}) {
    const double slope = std::atan(3.5 * mu_s * factor);
    Space<double> space = onPlane(2e-3, slope, mu_k, mu_s, {0, 0, 0});
    space.advanceTo(1.0);
    const double a =
        factor < 1 ? 5.0 / 7 * g * std::sin(slope) : g * (std::sin(slope) - mu_k * std::cos(slope));
    CAPTURE(factor);
    CHECK_THAT(space.body(0).velocity()[0], WithinRel(a, 1e-10));
    CHECK_THAT(space.body(0).position()[0], WithinRel(a / 2, 1e-10));
    CHECK((std::abs(slipOf(space)) < 1e-10) == (factor < 1));
    CHECK(std::abs(space.body(0).position()[2] - radius) < 1e-12);
  }
}

TEST_CASE("A ball that can hardly turn holds on a slope below its static coefficient") {
  // Its inertia is so large that it stands for a block.
  for (const double factor : {0.9, 1.1}) {
    const double slope = std::atan(0.5 * factor);
    Space<double> space = onPlane(2e-3, slope, 0.4, 0.5, {0, 0, 0});
    Body<double> block = space.body(0).load();
    block.inertia = 1e9 * block.mass * radius * radius;
    space.body(0).store(block);
    space.advanceTo(1.0);
    CAPTURE(factor);
    if (factor < 1) {
      CHECK(space.body(0).position().head<2>().norm() < 1e-8);  // it turns by a / (1e9 R) all the same
    } else {
      CHECK_THAT(space.body(0).velocity()[0], WithinRel(g * (std::sin(slope) - 0.4 * std::cos(slope)), 1e-8));
    }
  }
}

TEST_CASE(
    "Two balls that spin on each other under their gravity lock at two sevenths, with that energy left") {
  for (const double dt : {2e-3, 1e-3}) {
    SimulationConfig<double> config = plain(dt);
    config.G = 1;
    config.coeffRestitution = 0.0;
    config.coeffFriction = 0.5;
    config.coeffStaticFriction = 0.5;
    Space<double> space(config);
    const double s = 0.2;
    space.addBody(ball({-0.5, 0, 0}, {0, 0, 0}, 0.5, 1.0, {0, 0, s}));
    space.addBody(ball({0.5, 0, 0}, {0, 0, 0}, 0.5, 1.0, {0, 0, s}));
    const double spin = space.conserved().angularMomentum[2];
    const double energy = space.energyLedger().rotational;
    space.advanceTo(2.0);
    const EnergyLedger<double> e = space.energyLedger();
    const Vec r = space.body(1).position() - space.body(0).position();
    const Vec v = space.body(1).velocity() - space.body(0).velocity();
    // Contacts that rest keep a gap of the size a h^2, at which the moment of inertia is larger by 2 a h^2 /
    // R.
    const double tolerance = 8 * dt * dt;
    CAPTURE(dt, r.norm() - 1);
    CHECK_THAT(r.cross(v)[2] / r.squaredNorm(), WithinRel(2 * s / 7, tolerance));
    CHECK_THAT(space.body(0).angularVelocity()[2], WithinRel(2 * s / 7, tolerance));
    CHECK_THAT(space.body(1).angularVelocity()[2], WithinRel(2 * s / 7, tolerance));
    CHECK_THAT((e.kinetic + e.rotational) / energy, WithinRel(2.0 / 7, tolerance));
    CHECK_THAT(space.conserved().angularMomentum[2], WithinRel(spin, 1e-12));
    CHECK_THAT(r.norm(), WithinAbs(1.0, tolerance));
  }
}

TEST_CASE("A pair that turns as one parts exactly above the frequency sqrt(G m / (4 R^3))") {
  for (const double factor : {0.9, 0.99, 1.01, 1.1}) {
    SimulationConfig<double> config = plain(1e-3);
    config.G = 1;
    config.coeffFriction = 0.5;
    config.coeffStaticFriction = 0.5;
    Space<double> space(config);
    const double w = std::sqrt(2.0 * factor);  // G m / (4 R^3) = 2
    space.addBody(ball({-0.5, 0, 0}, {0, -0.5 * w, 0}, 0.5, 1.0, {0, 0, w}));
    space.addBody(ball({0.5, 0, 0}, {0, 0.5 * w, 0}, 0.5, 1.0, {0, 0, w}));
    space.advanceTo(3.0);
    const double gap = (space.body(1).position() - space.body(0).position()).norm() - 1;
    CAPTURE(factor, gap);
    CHECK((gap > 1e-2) == (factor > 1));
    // Half a kick, v = a h/2 with a = 2, may throw the pair up against what is left of its pull, a (1 -
    // factor), to v^2/(2 a (1 - factor)).
    CHECK((std::abs(gap) < 2 * 1e-6 / (8 * std::abs(1 - factor)) + 4e-6) == (factor < 1));
  }
}

// Its surface goes down at the wall, so that friction lifts it there and presses it to the wall at the floor:
// N1 + mu N2 = m g and N2 = mu N1, hence N1 = m g/(1 + mu^2), and the spin changes by
// -(5/2) mu (1 + mu)/(1 + mu^2) g/R. The tolerance of a solve is 1e-3 of the largest change that a contact
// asks for, (1 + mu) g dt at most for N1 and N2, and the errors of the two solves of a step add up. Seen to
// fail: momentum where sweeps turn back (mu = 0.9: off by 1.5, after 1000 sweeps a solve).
TEST_CASE("A ball that spins in the corner of a floor and a wall slows down as the closed form says") {
  for (const double mu : {0.3, 0.8, 0.9, 1.0, 1.2}) {
    CAPTURE(mu);
    const double dt = 1e-2;
    Space<double> space = onPlane(dt, 0.0, mu, mu, {0, 0, 0});
    space.addPlane({1, 0, 0}, -radius);
    const double spin = -60;
    space.body(0).angularVelocity() = Vec(0, spin, 0);
    const double load = 3.0 * g / (1 + mu * mu);
    const double slowing = 2.5 * mu * (1 + mu) / (1 + mu * mu) * g / radius;
    for (std::size_t i = 0; i < 20; ++i) {
      space.computeDynamics(i);
      CHECK(space.contactReport().iterations < 40);
      CHECK_THAT(-space.planeForce(0)[2], WithinAbs(load, 2e-3 * (1 + mu) * 3.0 * g));
      CHECK_THAT(space.body(0).angularVelocity()[1],
                 WithinAbs(spin + slowing * space.time(), 2e-3 * (1 + mu) * slowing * space.time()));
    }
  }
}

// The belt turns the ball, so that the wall's friction presses it to the belt: N1 = m g + mu N2 and N2 = mu
// N1, hence N1 = m g/(1 - mu^2), and from mu = 1 on no finite loads are right. Friction counts normal
// impulses of at most a hundred times those of the largest approach, g h/2, and of a fall, g h, in each of
// the two solves of a step: N1 <= m g (1 + 300 mu), of which the plane's force has sqrt(1 + mu^2). Seen to
// fail: without that bound the force was 5e7 m g and more.
TEST_CASE("A ball that a belt jams against a wall is loaded with a bounded force") {
  for (const double mu : {1.0, 1.2}) {
    for (const double dt : {1.0 / 60, 1e-3}) {
      CAPTURE(mu, dt);
      Space<double> space = onPlane(dt, 0.0, mu, mu, {0, 0, 0});
      space.setPlaneVelocity(0, {-2, 0, 0});
      space.addPlane({1, 0, 0}, -radius);
      for (std::size_t i = 0; i < 30; ++i) {
        space.computeDynamics(i);
        CHECK(space.planeForce(0).norm() <= 1.001 * std::sqrt(1 + mu * mu) * (1 + 300 * mu) * 3.0 * g);
        CHECK(space.body(0).velocity().norm() < 2.0);
      }
    }
  }
}

// Walls at 1 degree bear g/(2 sin 1) of its mass each, 29 times its weight: friction counts all of that, and
// belts along the groove drag the ball by mu g/sin 1 = 56 g, at a load that a solve has to 1e-3 of itself.
TEST_CASE("Belts drag a ball that is wedged between steep walls by all of its load") {
  const double slope = std::acos(-1.0) / 180;
  const double mu = 0.01;
  const double dt = 1e-3;
  Space<double> space = onPlane(dt, 0.0, mu, mu, {0, 0, 0});
  space.removePlane(0);
  for (const double side : {1.0, -1.0}) {
    const std::size_t wall = space.addPlane({side * std::cos(slope), 0, std::sin(slope)}, 0.0);
    space.setPlaneVelocity(wall, {0, 1, 0});
  }
  space.body(0).position() = Vec(0, 0, radius / std::sin(slope));
  for (std::size_t i = 0; i < 20; ++i) {
    space.computeDynamics(i);
  }
  const double v = mu * g / std::sin(slope) * space.time();
  CHECK_THAT(space.body(0).velocity()[1], WithinAbs(v, 2e-3 * v));
}

// Three on a belt, two on these and three on top, between walls that move: friction of each loads the next,
// and sweeps add to all of it. What is as fast as the fastest surface at the start may be thrown upwards, and
// falls for a tenth of a second. Seen to fail: a ball at 415 m/s after the second step.
TEST_CASE("Spinning balls that jam between moving walls get no faster than their surfaces were") {
  SimulationConfig<double> config = plain(1e-3);
  config.coeffRestitution = 0.0;
  config.coeffFriction = config.coeffStaticFriction = 1.0;
  config.contactTolerance = 1e-8;
  config.contactIterations = 20000;
  Space<double> space(config);
  space.setUniformField({0, 0, -g});
  space.setPlaneVelocity(space.addPlane({0, 0, 1}, 0.0), {-0.2079, 0, 0});
  space.setPlaneVelocity(space.addPlane({1, 0, 0}, 0.0), {0, 0, 0.0372});
  space.setPlaneVelocity(space.addPlane({-1, 0, 0}, -6 * radius), {0, 0, 0.6179});
  const double spins[] = {26.183, 14.821, -27.519, -35.311, -36.427, 21.209, 20.373, -7.433};
  std::size_t next = 0;
  for (int layer = 0; layer < 3; ++layer) {
    for (int i = 0; i < 3 - layer % 2; ++i) {
      Body<double> b = ball({(2 * i + 1 + layer % 2) * radius, 0, (1 + layer * std::sqrt(3.0)) * radius},
                            {0, 0, 0}, radius, 1.0);
      b.angularVelocity = Vec(0, spins[next++], 0);
      space.addBody(b);
    }
  }
  double fastest = 0;
  for (std::size_t step = 0; step < 100; ++step) {
    space.computeDynamics(step);
    for (std::size_t i = 0; i < space.n(); ++i) {
      fastest = std::max(fastest, space.body(i).velocity().norm());
      fastest = std::max(fastest, radius * space.body(i).angularVelocity().norm());
    }
  }
  CHECK(fastest < 36.427 * radius + g * space.time());
}

// A ball of radius R rolls down over a row of fixed balls, as a wheel without a rim does. Over each it turns
// about the ball's centre, D = R + r away, from -a to a with sin(a) = p/(2 D), p from one to the next. There
// it meets the next one at v sin(2 a) along the normal and stops turning about the last one. The blow acts
// where it touches, about which m R v (cos(2 a) + 2/5) is kept: the speed changes by f = (cos(2 a) +
// 2/5)/(7/5), and K = 7/10 m v^2 where a bump begins goes over into f^2 (K + m g p sin(slope)). It leaves no
// bump by itself while v^2 < D g cos(slope + a). The energy that it has on a bump tells K. In 60 bumps K errs
// by at most 0.22 h sqrt(g/R) (h = 1 ms) and 0.17 (1/4 ms): of first order. Seen to fail: what a blow lifts
// off is held to the end of the step.
TEST_CASE("A ball that rolls over a row of balls has at each the energy of the closed form") {
  constexpr double R = 0.1;
  constexpr double r = 0.05;
  constexpr int bumps = 60;
  for (const auto& [slope, p] : {std::pair{0.1, 0.04}, {0.1, 0.06}, {0.15, 0.06}}) {
    for (const double h : {1e-3, 2.5e-4}) {
      CAPTURE(slope, p, h);
      const double a = std::asin(p / (2 * (R + r)));
      const double f = (std::cos(2 * a) + 0.4) / 1.4;
      const double fall = g * p * std::sin(slope);
      SimulationConfig<double> config = plain(h);
      config.coeffRestitution = 0;
      config.coeffFriction = config.coeffStaticFriction = 1;
      Space<double> space(config);
      space.setUniformField({g * std::sin(slope), 0, -g * std::cos(slope)});
      for (int k = 0; k <= bumps; ++k) {
        Body<double> bump = ball({k * p, 0, 0}, {0, 0, 0}, r);
        bump.fixed = true;
        space.addBody(bump);
      }
      const double v = 0.8;
      const BodyId id = space.addBody(ball({-p / 2, 0, (R + r) * std::cos(a)},
                                           {v * std::cos(a), 0, v * std::sin(a)}, R, 1.0, {0, v / R, 0}));
      double K = 0.7 * v * v;
      const double start = space.energyLedger().mechanical() - K;  // potential energy where the first begins
      const double total = space.energyLedger().total();
      double worst = 0;
      int k = 0;
      for (; k < bumps && space.time() < 10; space.computeDynamics(space.steps())) {
        if (space.body(id).position()[0] >= k * p) {  // on top of bump k
          const double has = space.energyLedger().mechanical() - start + k * fall;
          worst = std::max(worst, std::abs(has / K - 1));
          K = f * f * (K + fall);
          ++k;
        }
      }
      CHECK(k == bumps);
      CHECK(worst < 0.3 * h * std::sqrt(g / R));
      CHECK_THAT(space.energyLedger().total(), WithinAbs(total, 1e-11));
    }
  }
}

// A ball that rolls on a table which turns at W goes in circles, at 2/7 W (Earnshaw 1844): v - R w x z =
// W z x x, as it rolls, and dw/dt = -5/(2 R) z x dv/dt by friction, make dv/dt = (2/7) W z x v, whatever its
// spin about the vertical. The table is the pole of a ball of radius S, 1e18 times as heavy, whose slope
// moves the other one by g t^2/(2 S) of its way at most. The rest is of second order: 0.2 (W h)^2 of it. Seen
// to fail: the arm of friction on the heavier ball 2 % too short (0.04 and 0.1 off).
TEST_CASE("On a table that turns a ball rolls in circles at two sevenths of its rate") {
  constexpr double S = 1e6;
  constexpr double W = 2.0;
  constexpr double R = 0.1;
  const double rate = 2.0 / 7 * W;
  const Vec v0(0, 0.5, 0);
  for (const double pivot : {0.0, 5.0}) {
    for (const double h : {8e-3, 2e-3}) {
      SimulationConfig<double> config = plain(h);
      config.coeffRestitution = 0;
      config.coeffFriction = config.coeffStaticFriction = 1;
      Space<double> space(config);
      space.setForceHook([](Bodies<double, SoA>& bodies, double) { bodies[1].force() += Vec(0, 0, -g); });
      space.addBody(ball({0, 0, -S}, {0, 0, 0}, S, 1e18, {0, 0, W}));
      const Vec slip = v0 - Vec(0, W, 0);  // without spin, at (1, 0)
      space.addBody(
          ball({1, 0, std::sqrt((S + R) * (S + R) - 1) - S}, v0, R, 1.0, {-slip[1] / R, slip[0] / R, pivot}));
      const double turn = 2 * pi<double>() / rate;
      for (const double share : {0.3, 0.6}) {
        space.advanceTo(share * turn);
        const double phase = rate * space.time();
        const Vec circle(1 + v0[1] / rate * (std::cos(phase) - 1), v0[1] / rate * std::sin(phase), 0);
        const Vec x = space.body(1).position();
        CAPTURE(pivot, h, share, x - circle);
        CHECK((x - circle).head<2>().norm() <
              0.3 * W * W * h * h + g * space.time() * space.time() / (2 * S));
        CHECK_THAT(space.body(1).angularVelocity()[2], WithinAbs(pivot, 1e-3));
      }
    }
  }
}

// Two balls in touch roll down an incline, the upper one of the moment of inertia k1 m R^2, the lower one,
// which alone would be slower, of k2. So the upper one pushes with N, and where they touch, one surface going
// down and the other up, friction mu N hinders both from turning:
//   (1 + k1) m a = m g sin - N (1 + mu),   (1 + k2) m a = m g sin + N (1 - mu),   N = (k2 - k1) m a/2.
// All forces are constant, and steps exact but for what the first one has to find. Seen to fail: the arm of
// friction on the second ball 2 % too short (2e-4 off).
TEST_CASE("A ball that pushes a slower one down an incline rolls, rubbing on it, as the closed form says") {
  constexpr double slope = 0.4;
  constexpr double R = 0.1;
  constexpr double m = 2.0;
  const double k1 = 0.4;
  const double k2 = 2.0 / 3;
  for (const double mu : {0.0, 0.2, 0.5}) {
    const double h = 2e-3;
    Space<double> space(plain(h));
    const Material<double> rough{.restitution = 0, .staticFriction = 2, .kineticFriction = 2};
    const MaterialId floor = space.addMaterial(rough);
    const MaterialId skin =
        space.addMaterial({.restitution = 0.5, .staticFriction = mu, .kineticFriction = mu});
    space.setPairMaterial(floor, skin, rough);
    space.setUniformField({g * std::sin(slope), 0, -g * std::cos(slope)});
    space.addPlane({0, 0, 1}, 0, floor);
    for (const double k : {k1, k2}) {
      Body<double> body = ball({k > k1 ? 2 * R : 0.0, 0, R}, {0, 0, 0}, R, m);
      body.inertia = k * m * R * R;
      body.material = skin;
      space.addBody(body);
    }
    space.advanceTo(1.0);
    const double a = g * std::sin(slope) / (1 + k1 + (k2 - k1) * (1 + mu) / 2);
    CAPTURE(mu, a);
    for (std::size_t i = 0; i < 2; ++i) {
      CHECK_THAT(space.body(i).velocity()[0], WithinRel(a, 1e-9));
      CHECK_THAT(space.body(i).position()[0] - 2 * R * double(i), WithinRel(a / 2, 1e-9));
    }
    double between = 0;
    for (std::size_t c = 0; c < space.contacts().size(); ++c) {
      between += space.contacts()[c].second == staticPartner ? 0 : space.contactImpulses()[c].normal / h;
    }
    CHECK_THAT(between, WithinRel(m * a * (k2 - k1) / 2, 1e-6));
  }
}

}  // namespace test_friction
