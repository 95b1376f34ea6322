// Published single blows: Chung & Ooi 2011 (Granular Matter 13, 643), the answers of hard spheres; Kharaz,
// Gorham & Salman 2001 (Powder Technol. 120, 281), an experiment; and two spheres that lock.

#include "scenes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

constexpr double degree = 3.14159265358979323846 / 180.0;

/// A ball on the floor z = 0, a billionth of its radius inside, after one blow.
Body<double> bounce(const Vector3<double>& v, const Vector3<double>& w, double radius,
                    const Material<double>& material) {
  Bodies<double, SoA> bodies;
  Body<double> ball;
  ball.radius = radius;
  ball.position = {0, 0, radius * (1 - 1e-9)};
  ball.velocity = v;
  ball.angularVelocity = w;
  bodies.add(ball);
  const ContactList<double> contacts = contactsOf(bodies, material, floorAtZero<double>());
  ContactSolver<double>().solve(contacts, bodies, 1e-6);
  return bodies[0].load();
}

Body<double> oblique(double angle, double b0) {
  return bounce({3.9 * std::sin(angle), 0, -3.9 * std::cos(angle)}, {0, 0, 0}, 2.5e-3,
                {0.98, 0.092, 0.092, b0});
}

}  // namespace

TEST_CASE("Chung & Ooi 1: equal elastic spheres head-on exchange their velocities, to the bit") {
  Bodies<double, SoA> bodies;
  Body<double> ball;
  ball.radius = 0.01;
  ball.velocity = {10, 0, 0};
  bodies.add(ball);
  ball.position = {0.02 * (1 - 1e-9), 0, 0};
  ball.velocity = {-10, 0, 0};
  bodies.add(ball);
  const auto contacts = contactsOf<double>(bodies, {1.0, 0.35, 0.35, 0.0});
  ContactSolver<double>().solve(contacts, bodies, 1e-6);
  CHECK(Vector3<double>(bodies[0].velocity()) == Vector3<double>(-10, 0, 0));
  CHECK(Vector3<double>(bodies[1].velocity()) == Vector3<double>(10, 0, 0));
}

TEST_CASE("Chung & Ooi 2 and 3: a head-on blow on a plane returns exactly e times the speed") {
  CHECK(bounce({0, 0, -0.2}, {0, 0, 0}, 0.1, {1.0, 0, 0, 0}).velocity == Vector3<double>(0, 0, 0.2));
  for (int tenths = 2; tenths <= 10; ++tenths) {
    const double e = tenths / 10.0;
    // One product: half a unit in the last place. (v + (1 + e) v n would be off by up to (1 + e)/e units.)
    CHECK_THAT(bounce({0, 0, -3.9}, {0, 0, 0}, 2.5e-3, {e, 0, 0, 0}).velocity[2],
               WithinRel(3.9 * e, 1.2e-16));
  }
}

TEST_CASE("Chung & Ooi 4: oblique blows with friction, from 5 to 85 degrees") {
  const double e = 0.98;
  const double mu = 0.092;
  const double R = 2.5e-3;
  for (int angle = 5; angle <= 85; angle += 5) {
    const double theta = angle * degree;
    const Body<double> ball = oblique(theta, 0.0);
    const bool slides = std::tan(theta) > 3.5 * mu * (1 + e);  // beyond 32.52 degrees
    CHECK(slides == (angle > 32));
    const double omega =
        slides ? 2.5 * mu * (1 + e) * 3.9 * std::cos(theta) / R : (5.0 / 7.0) * 3.9 * std::sin(theta) / R;
    // The arm is the radius, so the closed form holds to rounding.
    CHECK_THAT(std::abs(ball.angularVelocity[1]), WithinRel(omega, 1e-14));
    if (slides) {
      CHECK_THAT(ball.velocity[0] / (3.9 * std::sin(theta)),
                 WithinRel(1 - mu * (1 + e) / std::tan(theta), 1e-14));
      const double slip = ball.velocity[0] - R * ball.angularVelocity[1];
      // Near the threshold the slip is a small difference of speeds: an absolute bound.
      CHECK_THAT(slip / ball.velocity[2], WithinAbs((std::tan(theta) - 3.5 * mu * (1 + e)) / e, 1e-13));
    }
  }
  const Body<double> at60 = oblique(60 * degree, 0.0);
  CHECK_THAT(at60.velocity[0] / (3.9 * std::sin(60 * degree)), WithinAbs(0.894830, 5e-7));
  CHECK_THAT(std::abs(at60.angularVelocity[1]), WithinAbs(355.212, 5e-4));
  const double slip = at60.velocity[0] - R * at60.angularVelocity[1];
  CHECK_THAT(std::atan2(slip, at60.velocity[2]) / degree, WithinAbs(48.159, 5e-4));
}

TEST_CASE("Chung & Ooi 5: at constant normal speed the scaled slip falls by 7 once it slides") {
  const double v_n = 5.0;
  const double mu = 0.3;
  for (const double b0 : {0.0, 0.4}) {
    for (double psi = 0.25; psi < 14.0; psi += 0.5) {
      const Body<double> ball = bounce({psi * mu * v_n, 0, -v_n}, {0, 0, 0}, 1e-2, {1.0, mu, mu, b0});
      const double after = (ball.velocity[0] - 1e-2 * ball.angularVelocity[1]) / (mu * v_n);
      CHECK_THAT(after, WithinAbs(psi > 7.0 / (1.0 + b0) ? psi - 7.0 : -b0 * psi, 1e-13));
    }
  }
}

TEST_CASE("Chung & Ooi 6: a spinning ball that falls straight") {
  const double R = 0.1;
  for (const double b0 : {0.0, 0.5}) {
    for (double omega = 0.5; omega < 40.0; omega *= 1.3) {
      const Body<double> ball = bounce({0, 0, -0.2}, {0, omega, 0}, R, {0.5, 0.4, 0.4, b0});
      const double before = -R * omega;
      const double after = ball.velocity[0] - R * ball.angularVelocity[1];
      const double beta = std::min(b0, -1.0 + 3.5 * 0.4 * 1.5 * 0.2 / (R * omega));
      CHECK_THAT(-after / before, WithinAbs(beta, 1e-13));
    }
  }
}

TEST_CASE("Kharaz 2001: tangential restitution 0.44 brings the spin at 21.1 degrees within 1.5 percent") {
  const double measured = 573.7;
  CHECK_THAT(std::abs(oblique(21.1 * degree, 0.44).angularVelocity[1]), WithinRel(measured, 0.015));
  // Without it the model is 30 percent off, and the test would tell.
  CHECK(std::abs(oblique(21.1 * degree, 0.0).angularVelocity[1]) < 0.75 * measured);
}

// Spins after the blow as measured, rad/s (their figure 8). Grazing blows slide, and the two coefficients of
// sliding alone tell the spin: within 8 % of the experiment. Steep ones stick; there the spin depends on the
// tangential restitution, of which one number cannot fit all angles: 0 gives too little, 0.44 too much.
TEST_CASE(
    "Kharaz 2001: the spins of ten angles, by sliding to 8 percent, by sticking between two restitutions") {
  struct Row {
    double angle, measured;
  };
  for (const Row& row : {Row{5.9, 134.9}, {10.9, 261.2}, {21.1, 573.7}}) {
    CAPTURE(row.angle);
    CHECK(std::abs(oblique(row.angle * degree, 0.0).angularVelocity[1]) < row.measured);
    CHECK(std::abs(oblique(row.angle * degree, 0.44).angularVelocity[1]) > row.measured);
  }
  CHECK_THAT(std::abs(oblique(21.1 * degree, 0.0).angularVelocity[1]), WithinRel(0.7 * 573.7, 0.01));
  double sum_sq = 0.0;
  for (const Row& row : {Row{31.1, 612.2},
                         {39.0, 595.1},
                         {50.2, 449.5},
                         {60.1, 375.7},
                         {70.0, 243.0},
                         {78.6, 142.4},
                         {84.3, 70.6}}) {
    CAPTURE(row.angle);
    const double spin = std::abs(oblique(row.angle * degree, 0.44).angularVelocity[1]);
    CHECK_THAT(spin, WithinRel(row.measured, 0.08));
    sum_sq += (spin / row.measured - 1) * (spin / row.measured - 1);
  }
  CHECK(std::sqrt(sum_sq / 7) < 0.04);
}

TEST_CASE("two touching spheres that spin alike lock at 2/7 of the spin with 2/7 of the energy") {
  const double s = 3.0;
  const double R = 0.5;
  Bodies<double, SoA> bodies;
  Body<double> ball;
  ball.radius = R;
  ball.angularVelocity = {0, 0, s};
  bodies.add(ball);
  ball.position = {2 * R * (1 - 1e-12), 0, 0};
  bodies.add(ball);
  const double energy = static_cast<double>(Totals(bodies).energy);
  const double angular = static_cast<double>(Totals(bodies).angular[2]);
  const Material<double> material{0.5, 0.2, 0.2, 0.0};
  const auto contacts = contactsOf(bodies, material);
  ContactSolver<double> solver;
  int sliding = 0;
  for (int step = 0; step < 400; ++step) {
    const double pull = 0.01;  // of self-gravity, in a step
    bodies[0].velocity()[0] += pull;
    bodies[1].velocity()[0] -= pull;
    for (std::size_t i = 0; i < 2; ++i) {
      bodies.accelerations()[i] = Vector3<double>(i == 0 ? 1.0 : -1.0, 0, 0);
    }
    solver.solve(contacts, bodies, pull);
    sliding += solver.impulses()[0].tangential.norm() >= 0.1999 * solver.impulses()[0].normal ? 1 : 0;
  }
  CHECK(sliding > 100);  // it slid for a while before it locked
  CHECK_THAT(bodies[0].angularVelocity()[2], WithinRel(2.0 * s / 7.0, 1e-11));  // overlap of 1e-12, rounding
  CHECK_THAT(bodies[1].angularVelocity()[2], WithinRel(2.0 * s / 7.0, 1e-11));
  const double orbit = (bodies[1].velocity()[1] - bodies[0].velocity()[1]) / (2 * R);
  CHECK_THAT(orbit, WithinRel(2.0 * s / 7.0, 1e-11));
  CHECK_THAT(static_cast<double>(Totals(bodies).energy) / energy, WithinRel(2.0 / 7.0, 1e-11));
  CHECK_THAT(static_cast<double>(Totals(bodies).angular[2]), WithinRel(angular, 1e-13));
}
