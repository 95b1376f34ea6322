#include "laws/laws.hpp"
#include "support/catch.hpp"

// The six test problems of Chung & Ooi 2011 (Granular Matter 13, 643) in their hard-sphere limit, through
// whole steps of a space. A blow is dealt when the surfaces touch, inside a step; in
// these problems its outcome does not depend on how deep they overlap, so the closed forms hold to rounding.

using namespace gravel;
using namespace gravel::test;

namespace {

constexpr double ulp = std::numeric_limits<double>::epsilon();

/// Steps until the first contact is over. \return whether there was one
template <class SpaceType>
bool hit(SpaceType& space, std::size_t most = 100) {
  bool touched = false;
  for (std::size_t i = 0; i < most; ++i) {
    space.computeDynamics(i);
    touched = touched || space.contactCount() > 0;
    if (touched && space.contactCount() == 0) {
      return true;
    }
  }
  return touched;
}

struct Oblique {
  double restitution = 1.0;
  double mu = 0.0;
  double tangentialRestitution = 0.0;
  double radius = 2.5e-3;
  Vec velocity = Vec::Zero();
  Vec spin = Vec::Zero();
};

/// A sphere against the plane z >= 0. \return it after the blow
Body<double> againstPlane(const Oblique& o) {
  const double h = 0.3 * o.radius / o.velocity.norm();
  SimulationConfig<double> config = plain(h);
  config.coeffRestitution = o.restitution;
  config.coeffFriction = o.mu;
  config.coeffStaticFriction = o.mu;
  config.tangentialRestitution = o.tangentialRestitution;
  Space<double> space(config);
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball(Vec(0, 0, 1.05 * o.radius), o.velocity, o.radius, 1e-3, o.spin));
  REQUIRE(hit(space));
  return space.body(0).load();
}

double degrees(double x) { return x * pi<double>() / 180; }

}  // namespace

TEST_CASE("Impact 1: equal spheres exchange their velocities exactly") {
  SimulationConfig<double> config = plain(1e-5);
  config.coeffRestitution = 1.0;
  Space<double> space(config);
  space.addBody(ball({-0.0101, 0, 0}, {10, 0, 0}, 0.010, 2.0));
  space.addBody(ball({0.0101, 0, 0}, {-10, 0, 0}, 0.010, 2.0));
  REQUIRE(hit(space));
  CHECK(space.body(0).velocity() == Vec(-10, 0, 0));
  CHECK(space.body(1).velocity() == Vec(10, 0, 0));
}

TEST_CASE("Impact 2: a sphere leaves a plane as fast as it came") {
  Oblique o;
  o.velocity = {0, 0, -0.2};
  o.radius = 0.1;
  CHECK(againstPlane(o).velocity == Vec(0, 0, 0.2));
}

TEST_CASE("Impact 3: the restitution asked for is the restitution had, to 2 ulp") {
  for (int k = 2; k <= 10; ++k) {
    Oblique o;
    o.restitution = 0.1 * k;
    o.velocity = {0, 0, -3.9};
    const double e = againstPlane(o).velocity[2] / 3.9;
    CAPTURE(o.restitution);
    CHECK(std::abs(e - o.restitution) <= 2 * ulp * o.restitution);
  }
}

// Sliding for theta > atan((7/2) mu (1 + e)) = 32.52 degrees; else the contact sticks: slip 0, that is
// e_t = 5/7, omega' = -(5/7) v sin(theta) / R.
TEST_CASE("Impact 4: oblique impacts of all angles end with the closed form's velocity, spin and angle") {
  const double e = 0.98;
  const double mu = 0.092;
  const double v = 3.9;
  const double r = 2.5e-3;
  int sliding = 0;
  for (int angle = 5; angle <= 85; angle += 5) {
    const double theta = degrees(angle);
    Oblique o;
    o.restitution = e;
    o.mu = mu;
    o.velocity = {v * std::sin(theta), 0, -v * std::cos(theta)};
    const Body<double> after = againstPlane(o);
    const bool slides = std::tan(theta) > 3.5 * mu * (1 + e);
    sliding += slides ? 1 : 0;
    const double e_t = slides ? 1 - mu * (1 + e) / std::tan(theta) : 5.0 / 7;
    // Rolling forward along x turns about +y.
    const double spin =
        slides ? 2.5 * mu * (1 + e) * v * std::cos(theta) / r : (5.0 / 7) * v * std::sin(theta) / r;
    CAPTURE(angle);
    CHECK_THAT(after.velocity[0] / o.velocity[0], WithinRel(e_t, 8 * ulp));
    CHECK_THAT(after.velocity[2], WithinRel(e * v * std::cos(theta), 4 * ulp));
    CHECK_THAT(after.angularVelocity[1], WithinRel(spin, 16 * ulp));
    CHECK(after.velocity[1] == 0.0);
    // Angle of departure of the contact point: (v_x' - omega' R) / v_z'.
    const double slip = after.velocity[0] - after.angularVelocity[1] * r;
    const double expected = slides ? (std::tan(theta) - 3.5 * mu * (1 + e)) / e : 0.0;
    CHECK_THAT(slip / after.velocity[2], WithinAbs(expected, 32 * ulp * std::tan(theta)));
    if (angle == 60) {  // the published figures
      CHECK_THAT(e_t, WithinAbs(0.894830, 5e-7));
      CHECK_THAT(after.velocity[0] / o.velocity[0], WithinAbs(0.894830, 5e-7));
      CHECK_THAT(after.angularVelocity[1], WithinAbs(355.212, 5e-4));
      CHECK_THAT(std::atan(slip / after.velocity[2]), WithinAbs(degrees(48.159), degrees(5e-4)));
    }
  }
  CHECK(sliding == 11);  // 35 to 85 degrees: both regimes are in
}

TEST_CASE("Impact 5: at constant approach the slip is what came less what friction can take") {
  const double v_n = 2.0;
  const double mu = 0.3;
  for (const double b0 : {0.0, 0.5}) {
    for (const double psi : {0.5, 2.0, 4.5, 6.9, 7.1, 10.0, 14.0}) {
      Oblique o;
      o.mu = mu;
      o.tangentialRestitution = b0;
      o.velocity = {psi * mu * v_n, 0, -v_n};
      const Body<double> after = againstPlane(o);
      const double psi_after = (after.velocity[0] - after.angularVelocity[1] * o.radius) / (mu * v_n);
      CAPTURE(b0, psi);
      CHECK_THAT(psi_after, WithinAbs(psi > 7 / (1 + b0) ? psi - 7 : -b0 * psi, 1e-14));
    }
  }
}

// beta: slip after over slip before, reversed. From rolling resistance to pure sliding with spin alone.
TEST_CASE("Impact 6: a spinning sphere keeps the slip that friction cannot take") {
  const double r = 0.1;
  const double v_n = 0.2;
  const double e = 0.5;
  const double mu = 0.4;
  for (const double b0 : {0.0, 0.3}) {
    for (const double omega : {1.0, 2.5, 4.0, 4.5, 10.0, 40.0}) {
      Oblique o;
      o.restitution = e;
      o.mu = mu;
      o.radius = r;
      o.tangentialRestitution = b0;
      o.velocity = {0, 0, -v_n};
      o.spin = {0, omega, 0};
      const Body<double> after = againstPlane(o);
      const double beta = (after.velocity[0] - after.angularVelocity[1] * r) / (r * omega);
      CAPTURE(b0, omega);
      CHECK_THAT(beta, WithinAbs(std::min(b0, -1 + 3.5 * mu * (1 + e) * v_n / (r * omega)), 1e-14));
      CHECK_THAT(after.velocity[2], WithinRel(e * v_n, 4 * ulp));
    }
  }
}

// The same blow between two free spheres of any mass and radius, to the closed form: J_n, J_t, and the energy
// that is gone, in the ledger.
TEST_CASE("A blow between two spheres takes the energy of the closed form, by restitution and by friction") {
  const double m1 = 2.0;
  const double m2 = 0.7;
  const double m_eff = m1 * m2 / (m1 + m2);
  for (const double mu : {0.05, 5.0}) {  // slides, sticks
    SimulationConfig<double> config = plain(1e-3);
    config.coeffRestitution = 0.6;
    config.coeffFriction = mu;
    config.coeffStaticFriction = mu;
    config.positionalCorrectionFactor = 0.0;
    Space<double> space(config);
    // Spins along the line of centres are no slip; those across it are.
    space.addBody(ball({0, 0, 0}, {1, 0.4, 0}, 0.5, m1, {0.3, 0, 1.0}));
    space.addBody(ball({0.8, 0, 0}, {-1, 0, 0}, 0.3, m2, {0, 2.0, 0}));
    const double before = space.energyLedger().mechanical();
    space.computeDynamics(0);
    REQUIRE(space.contactCount() == 1);
    const Impact<double> c = space.impacts().at(0);
    const double u_n = 2.0 * c.normal[0] + 0.4 * c.normal[1];
    const Vec v_rel(-2.0, -0.4, 0);
    const Vec spin = 0.5 * Vec(0.3, 0, 1.0) + 0.3 * Vec(0, 2.0, 0);
    const double u_t = Vec(v_rel - c.normal.dot(v_rel) * c.normal - spin.cross(c.normal)).norm();
    const double j_n = 1.6 * m_eff * u_n;
    const double m_t = 2.0 / 7 * m_eff;
    const double stick = m_t * u_t;
    const double j_t = std::min(stick, mu * j_n);
    const EnergyLedger<double> e = space.energyLedger();
    CAPTURE(mu, stick / j_n);
    CHECK((stick > mu * j_n) == (mu < 1));
    CHECK_THAT(e.restitution, WithinRel(m_eff * (1 - 0.36) * u_n * u_n / 2, 1e-13));
    CHECK_THAT(e.friction, WithinRel(j_t * u_t - j_t * j_t / (2 * m_t), 1e-12));
    CHECK_THAT(e.total(), WithinRel(before, 1e-15));
    CHECK_THAT(c.impulse.normal, WithinRel(j_n, 1e-13));
    CHECK_THAT(c.impulse.tangential.norm(), WithinRel(j_t, 1e-13));
  }
}

// J_t = -(1 + b0) m_t u_t, whatever e is: the slip afterwards is -b0 u_t, also where nothing bounces, and it
// stays that, since what touches without a load does not rub. It is a difference of a few numbers of the
// size of the slip before. Seen to fail: tangential restitution only where e > 0 (slip 0).
TEST_CASE("A blow that does not bounce turns back its slip as one that does, on a plane and between balls") {
  for (const double e : {0.0, 0.01}) {
    for (const double b0 : {0.4, 1.0}) {
      CAPTURE(e, b0);
      Oblique o;
      o.restitution = e;
      o.mu = 5;
      o.tangentialRestitution = b0;
      o.velocity = {1, 0, -1};
      const Body<double> after = againstPlane(o);
      CHECK_THAT(after.velocity[0] - after.angularVelocity[1] * o.radius, WithinAbs(-b0, 16 * ulp));
      CHECK_THAT(after.velocity[2], WithinAbs(e, 4 * ulp));

      SimulationConfig<double> config = plain(0.1);
      config.coeffRestitution = e;
      config.coeffFriction = config.coeffStaticFriction = o.mu;
      config.tangentialRestitution = b0;
      Space<double> space(config);
      space.addBody(ball({-0.55, 0, 0}, {1, 0, 0}, 0.5, 2.0, {0, 0, 3}));
      space.addBody(ball({0.55, 0, 0}, {-1, 0, 0}, 0.5, 2.0, {0, 0, 1}));
      space.computeDynamics(0);  // they meet head-on after half of it: the slip is that of the spins
      const Vec slip = Vec(space.body(1).velocity()) - Vec(space.body(0).velocity()) -
                       Vec(0.5 * Vec(space.body(0).angularVelocity() + space.body(1).angularVelocity()))
                           .cross(Vec(1, 0, 0));
      CHECK_THAT(slip[1], WithinAbs(2 * b0, 16 * ulp));
    }
  }
}

// A blow u that a step begins with is over before anything pulls or rubs: e u, and after the step e u - g h.
// Of two balls that roll on a floor without rubbing on each other the one of speed u stops for e = 1, and
// slides forward with mu g; the other one takes u, and slides with mu g against it. Their energies are those
// of the two moments, so that the ledger has u^2/2 (1 - e^2). Seen to fail: the blow dealt after the first
// kick, as what it brings comes back e times, too: e u + (1 + e) g h/2 - g h, an elastic ball that gains 4 %
// of its energy (h = 4 ms), and balls off by mu g h/2.
TEST_CASE("What touches as a scene begins is struck before anything pulls, on a floor, a ball and a table") {
  constexpr double g = 9.81;
  constexpr double u = 1.0;
  for (const double h : {4e-3, 1e-3}) {
    for (const double e : {0.0, 0.8, 1.0}) {
      for (const bool onBall : {false, true}) {
        CAPTURE(h, e, onBall);
        SimulationConfig<double> config = plain(h);
        config.coeffRestitution = e;
        Space<double> space(config);
        if (onBall) {
          Body<double> held = ball({0, 0, -0.1}, {0, 0, 0}, 0.1);
          held.fixed = true;
          space.addBody(held);
        } else {
          space.addPlane({0, 0, 1}, 0);
        }
        const BodyId id = space.addBody(ball({0, 0, 0.1}, {0, 0, -u}, 0.1, 2.0));
        space.setUniformField({0, 0, -g});
        const double start = space.energyLedger().total();
        space.computeDynamics(0);
        const EnergyLedger<double> ledger = space.energyLedger();
        CHECK_THAT(ledger.total(), WithinAbs(start, 8 * ulp));
        if (e > 0) {
          CHECK_THAT(space.body(id).velocity()[2], WithinAbs(e * u - g * h, 4 * ulp));
          CHECK_THAT(space.body(id).position()[2] - 0.1, WithinAbs(e * u * h - g * h * h / 2, 4 * ulp));
          CHECK_THAT(ledger.restitution, WithinAbs(u * u * (1 - e * e), 16 * ulp));
          CHECK_THAT(space.supportedWeight().load[2] * h, WithinAbs(-2 * (1 + e) * u, 16 * ulp));
        } else {
          CHECK_THAT(space.body(id).velocity()[2], WithinAbs(0, 4 * ulp));
        }
      }
      SimulationConfig<double> config = plain(h);
      Space<double> table(config);
      const double mu = 0.2;
      const MaterialId smooth =
          table.addMaterial({.restitution = e, .staticFriction = 0, .kineticFriction = 0});
      table.setPairMaterial(smooth, defaultMaterial,
                            {.restitution = 0, .staticFriction = mu, .kineticFriction = mu});
      table.setUniformField({0, 0, -g});
      table.addPlane({0, 0, 1}, 0);
      for (const double speed : {u, 0.0}) {
        Body<double> body =
            ball({speed > 0 ? -0.2 : 0.0, 0, 0.1}, {speed, 0, 0}, 0.1, 1.0, {0, speed / 0.1, 0});
        body.material = smooth;
        table.addBody(body);
      }
      table.computeDynamics(0);
      if (e > 0) {
        CHECK_THAT(table.body(0).velocity()[0], WithinAbs((1 - e) / 2 * u + mu * g * h, 4 * ulp));
        CHECK_THAT(table.body(1).velocity()[0], WithinAbs((1 + e) / 2 * u - mu * g * h, 4 * ulp));
      }
    }
  }
}

// Seen to fail: all contacts solved together with the blow (other bits, and loads 1.8e-4 off).
TEST_CASE("A blow with which a step begins changes no bit of a stack that rests elsewhere") {
  SimulationConfig<double> config = plain(4e-3);
  config.coeffRestitution = 0.8;
  Space<double> space(config);
  space.setUniformField({0, 0, -9.81});
  space.addPlane({0, 0, 1}, 0);
  for (int k = 0; k < 5; ++k) {
    space.addBody(ball({0, 0, 0.1 + 0.2 * k}, {0, 0, 0}, 0.1));
  }
  advance(space, 100);
  const auto withPair = [&](double apart, double speed) {
    Space<double> other = space;
    for (const double side : {-1.0, 1.0}) {
      other.addBody(ball({5 + side * apart / 2, 0, 7}, {-side * speed, 0, 0}, 0.1));
    }
    advance(other, 3);
    return other;
  };
  const Space<double> struck = withPair(0.2, 3);
  const Space<double> alone = withPair(1, 0);
  CHECK_THAT(struck.body(6).velocity()[0], WithinAbs(0.8 * 3, 1e-14));
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(Vec(struck.body(i).velocity()) == Vec(alone.body(i).velocity()));
    CHECK(Vec(struck.body(i).position()) == Vec(alone.body(i).position()));
  }
  CHECK_THAT(struck.supportedWeight().load[2], WithinRel(alone.supportedWeight().load[2], 1e-14));
}

// v = e u exp(-c t) for the drag -c v by mass. Errors over h^2 are 0.66 u. Seen to fail: forces of before the
// blow kept (first order, 8e-3 at h = 4 ms).
TEST_CASE("A force that depends on velocities sees the blow with which a step begins, to second order") {
  const auto errorOf = [](double h) {
    SimulationConfig<double> config = plain(h);
    config.coeffRestitution = 0.8;
    Space<double> space(config);
    space.addPlane({0, 0, 1}, 0);
    space.setUniformField({0, 0, -1e-9});
    space.addBody(ball({0, 0, 0.1}, {0, 0, -1}, 0.1));
    space.setForceHook([](Bodies<double, SoA>& bodies, double) {
      bodies[0].force() -= 3 * bodies[0].mass() * Vec(bodies[0].velocity());
    });
    space.advanceTo(0.1);
    return std::abs(space.body(0).velocity()[2] - 0.8 * std::exp(-0.3));
  };
  const double order = std::log2(errorOf(4e-3) / errorOf(2e-3));
  CAPTURE(errorOf(4e-3), errorOf(2e-3));
  CHECK(order > 1.9);
  CHECK(order < 2.1);
}

TEST_CASE("A light sphere on one a thousand million times its mass bounces as off a wall") {
  SimulationConfig<double> config = plain(1e-4);
  config.coeffRestitution = 0.8;
  Space<double> space(config);
  space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.5, 1e9));
  space.addBody(ball({0.75001, 0, 0}, {-1, 0, 0}, 0.25, 1.0));
  REQUIRE(hit(space));
  // v2' = v2 + (1 + e) m1/(m1 + m2) u
  CHECK_THAT(space.body(1).velocity()[0], WithinRel(-1 + 1.8 / (1 + 1e-9), 1e-14));
  CHECK_THAT(space.body(0).velocity()[0], WithinRel(-1.8 * 1e-9 / (1 + 1e-9), 1e-14));
}
