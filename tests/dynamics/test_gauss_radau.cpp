#include "dynamics/problems.hpp"
#include "scenes/scenes.hpp"
#include "support/archetypes.hpp"
#include "support/catch.hpp"
#include <gravel/dynamics/gauss_radau.hpp>
#include <gravel/gravity/direct_sum.hpp>

using namespace gravel;
using namespace gravel::test;

namespace {

using Real80 = long double;

/// Calls of the force, counted.
template <class S, class Force>
struct Counted {
  Bodies<S>* bodies;
  Force force;
  std::size_t calls = 0;
  void operator()(const S&) {
    force(*bodies);
    ++calls;
  }
};

/// Error of the oscillator x'' = -x after one period of n steps.
Real80 oscillatorError(int n) {
  Bodies<Real80> bodies;
  Body<Real80> body;
  body.position = {1, 0, 0};
  bodies.add(body);
  Counted<Real80, SpringForce> forces{&bodies, {}};
  forces(0);
  GaussRadau15<Real80> method;
  method.setStepFactor(4);  // longer than the steps, so that each call is one
  for (int i = 0; i < n; ++i) {
    method.advance(bodies, 2 * pi<Real80>() / Real80(n), false, forces);
  }
  CHECK(method.stepsTaken() == static_cast<std::size_t>(n));
  CHECK(method.stepsRejected() == 0);
  CHECK(forces.calls == 7 * method.iterations() + method.stepsTaken() + 1);
  return std::hypot(bodies[0].position()[0] - 1, bodies[0].velocity()[0]);
}

/// Newton's law pair by pair, as it is written.
struct Gravity {
  double G;
  void operator()(Bodies<double>& bodies) const {
    DirectSum<double>().accelerations(bodies.positions(), bodies.masses(), G, 0.0, bodies.accelerations());
  }
};

/// Mutual gravity with G = 1; a run that does not end is ended.
template <class S>
struct Limited {
  Bodies<S>* bodies;
  std::size_t calls = 0;
  void operator()(const S&) {
    DirectSum<S>().accelerations(bodies->positions(), bodies->masses(), S(1), S(0), bodies->accelerations());
    if (++calls == 200000) {
      throw std::runtime_error("no end");
    }
  }
};

/// Advances by h [s]. \return the number of steps, those taken again counted
template <class S>
std::size_t stepsOf(Bodies<S>& bodies, const S& h) {
  Limited<S> forces{&bodies};
  forces(S(0));
  GaussRadau15<S> method;
  method.advance(bodies, h, false, forces);
  return method.stepsTaken() + method.stepsRejected();
}

Real80 energyOf(const Bodies<double>& bodies, Real80 G) {
  Real80 energy = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Real80 m = bodies.masses()[i];
    energy += m * Vector3<double>(bodies.velocities()[i]).cast<Real80>().squaredNorm() / 2;
    for (std::size_t j = 0; j < i; ++j) {
      const Vector3<Real80> d = Vector3<double>(bodies.positions()[i]).cast<Real80>() -
                                Vector3<double>(bodies.positions()[j]).cast<Real80>();
      energy -= G * m * bodies.masses()[j] / d.norm();
    }
  }
  return energy;
}

}  // namespace

// Collocation at Radau's nodes: the weights of the whole step integrate s^k for k = 1 … 14, seven more than
// seven nodes and the start must, and not s^15 (whose error is the constant of the method, 1.9e-8).
TEST_CASE("Radau's weights integrate powers up to 14 and not beyond, and those of the nodes up to 7") {
  const detail::RadauTables& t = detail::radauTables;
  const auto integral = [&](const detail::RadauTables::Row& w, int k) {
    Real80 sum = 0;
    for (std::size_t m = 0; m < 7; ++m) {
      sum += w[m] * std::pow(static_cast<Real80>(t.node[m]), k);
    }
    return sum;
  };
  for (int k = 1; k <= 14; ++k) {
    // The nodes are rounded to double, which powers above 7 notice at the square of that.
    CHECK(std::abs(integral(t.velocity[7], k) * (k + 1) - 1) <= (k <= 7 ? 1e-18L : 1e-15L));
    if (k <= 13) {
      CHECK(std::abs(integral(t.position[7], k) * (k + 1) * (k + 2) - 1) <= (k <= 7 ? 2e-18L : 1e-15L));
    }
  }
  const Real80 defect = integral(t.velocity[7], 15) * 16 - 1;
  CHECK_THAT(static_cast<double>(std::abs(defect)), WithinRel(1.93e-8, 0.3));
  for (std::size_t n = 0; n < 7; ++n) {
    const auto h = static_cast<Real80>(t.node[n]);
    for (int k = 1; k <= 7; ++k) {
      CHECK(std::abs(integral(t.velocity[n], k) - std::pow(h, k + 1) / (k + 1)) <= 1e-18L);
      CHECK(std::abs(integral(t.position[n], k) - std::pow(h, k + 2) / ((k + 1) * (k + 2))) <= 1e-18L);
    }
  }
  for (int k = 1; k <= 7; ++k) {
    const Real80 p = k;
    CHECK(std::abs(integral(t.jerk, k) - p) <= 1e-14L);
    CHECK(std::abs(integral(t.snap, k) - p * (p - 1)) <= 1e-13L);
    CHECK(std::abs(integral(t.crackle, k) - p * (p - 1) * (p - 2)) <= 1e-12L);
    for (std::size_t j = 0; j < 7; ++j) {
      CHECK(std::abs(integral(t.power[j], k) - (j + 1 == static_cast<std::size_t>(k) ? 1 : 0)) <= 1e-14L);
    }
  }
}

// 3.2e-13 of three steps a period and 1.0e-17 of six, in long double. Two-sided.
TEST_CASE("Gauss-Radau is of order 15 on an oscillator") {
  const Real80 three = oscillatorError(3);
  const Real80 six = oscillatorError(6);
  CAPTURE(static_cast<double>(three), static_cast<double>(six));
  CHECK_THAT(static_cast<double>(std::log2(three / six)), WithinAbs(15.0, 0.3));
}

TEST_CASE("Forces that depend on velocity are integrated to rounding") {
  Bodies<Real80> bodies;
  Body<Real80> body;
  body.position = {1, 0, 0};
  bodies.add(body);
  const Real80 c = 0.5L;
  const auto forces = [&](Real80) {
    bodies[0].acceleration() =
        -Vector3<Real80>(bodies[0].position()) - c * Vector3<Real80>(bodies[0].velocity());
  };
  forces(0);
  GaussRadau15<Real80> method;
  method.advance(bodies, 6.0L, true, forces);
  const Real80 w = std::sqrt(1 - c * c / 4);
  const Real80 exact = std::exp(-c * 3) * (std::cos(6 * w) + c / (2 * w) * std::sin(6 * w));
  CHECK(std::abs(bodies[0].position()[0] - exact) <= 4 * std::numeric_limits<Real80>::epsilon());
}

TEST_CASE("A time in a force is the time of the node: forces that depend on it are integrated to rounding") {
  Bodies<double> bodies;
  bodies.add(Body<double>{});
  double start = 0;
  const auto forces = [&](double passed) {
    bodies[0].acceleration() = Vector3<double>(std::cos(start + passed), 0, 0);
  };
  forces(0);
  GaussRadau15<double> method;
  for (int i = 0; i < 5; ++i) {
    method.advance(bodies, 0.75, false, forces);
    start += 0.75;
  }
  // x'' = cos t from rest: x = 1 - cos t.
  CHECK_THAT(bodies[0].position()[0], WithinAbs(1 - std::cos(3.75), 2e-15));
  CHECK_THAT(bodies[0].velocity()[0], WithinAbs(std::sin(3.75), 1e-15));
}

// tau of a circular orbit is 1/omega by both criteria: 2 pi / 0.175 = 35.9 steps.
TEST_CASE("A circular orbit takes 36 steps of two iterations, an eccentric one more where it is fast") {
  for (const double e : {0.0, 0.5, 0.9}) {
    auto bodies = orbiter<double>(e);
    Counted<double, KeplerForce> forces{&bodies, {}};
    forces(0);
    GaussRadau15<double> method;
    method.advance(bodies, 2 * pi<double>(), false, forces);  // finds its step
    const std::size_t first = method.stepsTaken();
    const std::size_t iterations = method.iterations();
    method.advance(bodies, 20 * pi<double>(), false, forces);
    const double steps = static_cast<double>(method.stepsTaken() - first) / 10;
    const double each = static_cast<double>(method.iterations() - iterations) / (10 * steps);
    CAPTURE(e, steps, each);
    CHECK_THAT(steps, WithinAbs(e == 0.0 ? 36.0 : e == 0.5 ? 51.0 : 97.0, 2.0));
    CHECK(each < (e == 0.0 ? 2.1 : 3.5));
    CHECK(method.stepsRejected() == 0);
  }
}

// A body that swings through the origin has no acceleration there, with 8 steps a period exactly at the end
// of every second one. Seen to fail: the step by |a|, |a'| and |a''| alone takes 407 steps for 8.
TEST_CASE("A point of zero acceleration does not stop the clock") {
  CHECK(oscillatorError(8) < 1e-17L);
  Bodies<double> bodies;
  Body<double> body;
  body.position = {1, 0, 0};
  bodies.add(body);
  Counted<double, SpringForce> forces{&bodies, {}};
  forces(0);
  GaussRadau15<double> method;
  method.advance(bodies, 200 * pi<double>(), false, forces);
  // sqrt of (1 + tan^2 and its inverse): steps between 0.175 and 0.175 sqrt 2.
  CHECK(method.stepsTaken() < 3600);
  CHECK(method.stepsTaken() > 2500);
}

// Forces may pull at a fixed body, as sums over all do. Seen to fail: it fell.
TEST_CASE("A fixed body stays, whatever the forces say, and no bodies at all are no error") {
  Bodies<double> bodies;
  auto list = scenes::keplerPair<double>(0.5, 0.3);
  list[0].fixed = true;
  list[0].velocity.setZero();
  for (const Body<double>& body : list) {
    bodies.add(body);
  }
  Limited<double> forces{&bodies};
  forces(0);
  GaussRadau15<double> method;
  method.advance(bodies, 1.0, false, forces);
  CHECK(bodies[0].position() == list[0].position);
  CHECK(bodies[0].velocity() == list[0].velocity);
  CHECK((bodies[1].position() - list[1].position).norm() > 0.1);
  Bodies<double> none;
  GaussRadau15<double>().advance(none, 1.0, false, [](double) {});
  CHECK(none.empty());
}

TEST_CASE("A step too long for a close pass is taken again, and a far too short one grows, at no loss") {
  for (const double first : {1e-9, 50.0}) {
    Bodies<double> bodies;
    for (Body<double> body : scenes::keplerPair<double>(0.5, 0.3)) {
      bodies.add(body);
    }
    Counted<double, Gravity> forces{&bodies, {1.0}};
    forces(0);
    GaussRadau15<double> method;
    const Real80 start = energyOf(bodies, 1);
    const double h = first < 1 ? first : 200.0;
    method.advance(bodies, h, false, forces);
    method.advance(bodies, 30.0, false, forces);
    CAPTURE(first, method.stepsRejected());
    CHECK(std::abs(static_cast<double>(energyOf(bodies, 1) / start - 1)) < 3e-15);
  }
  // A close pass that the step before could not know of: rejected.
  Bodies<double> bodies;
  Body<double> body;
  body.mass = 1;
  bodies.add(body);
  body.mass = 1e-8;
  body.position = {-10, 1e-3, 0};
  body.velocity = {30, 0, 0};
  bodies.add(body);
  Counted<double, Gravity> forces{&bodies, {1.0}};
  forces(0);
  GaussRadau15<double> method;
  const Real80 start = energyOf(bodies, 1);
  method.advance(bodies, 1.0, false, forces);
  CHECK(method.stepsRejected() > 0);
  CHECK(std::abs(static_cast<double>(energyOf(bodies, 1) / start - 1)) < 1e-14);
}

// The energy walks by rounding, as the root of the number of steps: rms 3e-15 in these 5000 orbits, 1e-15 in
// these 1000 of Jupiter (3e-15 in 1e4). Seen to fail: what the weights lose to rounding added where it
// vanishes (a drift of 3e-15 in 480 orbits).
TEST_CASE("Thousands of orbits keep the energy to a few tens of units of rounding") {
  Bodies<double> pair;
  for (const Body<double>& body : scenes::keplerPair<double>(0.0, 1e-3)) {
    pair.add(body);
  }
  Counted<double, Gravity> forces{&pair, {1.0}};
  forces(0);
  GaussRadau15<double> method;
  const Real80 start = energyOf(pair, 1);
  for (int i = 0; i < 50; ++i) {
    method.advance(pair, 200 * pi<double>(), false, forces);
  }
  CHECK(std::abs(static_cast<double>(energyOf(pair, 1) / start - 1)) <= 1e-14);

  const double G = scenes::outerSolarSystemG;
  auto planets = scenes::outerSolarSystem<double>();
  scenes::centre(planets);
  Bodies<double> bodies;
  for (const Body<double>& body : planets) {
    bodies.add(body);
  }
  Counted<double, Gravity> pull{&bodies, {G}};
  pull(0);
  GaussRadau15<double> outer;
  const Real80 energy = energyOf(bodies, G);
  outer.advance(bodies, 1000 * 4332.0, false, pull);
  CHECK(std::abs(static_cast<double>(energyOf(bodies, G) / energy - 1)) <= 4e-15);
}

TEST_CASE("What it remembers can be taken up, and is void where somebody moved a body") {
  auto bodies = orbiter<double>(0.5);
  Counted<double, KeplerForce> forces{&bodies, {}};
  forces(0);
  GaussRadau15<double> method;
  method.advance(bodies, 5.0, false, forces);
  auto twin = bodies;
  Counted<double, KeplerForce> twins{&twin, {}};
  GaussRadau15<double> second;
  REQUIRE(second.setState(method.state()));
  CHECK(second.nextStep() == method.nextStep());
  method.advance(bodies, 5.0, false, forces);
  second.advance(twin, 5.0, false, twins);
  CHECK(bodies[0].position() == twin[0].position());
  CHECK(bodies[0].velocity() == twin[0].velocity());
  CHECK(method.state() == second.state());
  CHECK_FALSE(second.setState(std::vector<double>(21)));
  CHECK(second.setState({}));

  // Moved: the same as a method that knows nothing.
  bodies[0].velocity() *= 0.5;
  twin = bodies;
  forces(0);
  GaussRadau15<double> fresh;
  method.advance(bodies, 5.0, false, forces);
  fresh.advance(twin, 5.0, false, twins);
  CHECK((bodies[0].position() - twin[0].position()).norm() < 1e-14);
  CHECK_THAT(method.nextStep(), WithinRel(fresh.nextStep(), 1e-9));  // by the rounding of the last term
  CHECK_THROWS_AS(method.setStepFactor(0.0), std::invalid_argument);
  CHECK_THROWS_AS(method.setStepFactor(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
}

TEST_CASE("float is integrated to its own rounding") {
  auto bodies = orbiter<float>(0.5F);
  Counted<float, KeplerForce> forces{&bodies, {}};
  forces(0);
  GaussRadau15<float> method;
  const Vector3<float> start = bodies[0].position();
  method.advance(bodies, 2 * pi<float>(), false, forces);
  CHECK((bodies[0].position() - start).norm() < 3e-6F);
}

// Powers of two of mass and time change no bit. Seen to fail, where squares leave the range of float: 6 steps
// in place of 59 at 2^-80, 43 at 2^-60, 21 at 2^80.
TEST_CASE("Steps in float do not depend on the unit of accelerations") {
  const auto run = [](int exponent) {
    const float speed = std::ldexp(1.0F, exponent / 2);
    auto list = scenes::keplerPair<float>(0.0F, 0.5F);
    for (Body<float>& body : list) {
      body.mass *= speed * speed;
      body.velocity *= speed;
    }
    auto bodies = bodiesOf(list);
    const std::size_t steps = stepsOf(bodies, 10.0F / speed);
    return std::pair(steps, Vector3<float>(bodies[0].position()));
  };
  const auto [steps, place] = run(0);
  for (const int exponent : {-80, -60, 60, 80}) {
    CAPTURE(exponent);
    const auto [stepsThere, placeThere] = run(exponent);
    CHECK(stepsThere == steps);
    CHECK(placeThere == place);
  }
}

// 62 steps in ten time units, as on a circle, and up to 125 in float, where the boost rounds places to 1e-4.
// Seen to hang without floors in nearly all of these (here: "no end"), and by the floor of the largest
// acceleration alone for the star that moves or is far out.
TEMPLATE_TEST_CASE("A star amid evenly spread planets does not stop the clock", "", float, double, Real80) {
  using S = TestType;
  const Vector3<S> none = Vector3<S>::Zero();
  for (const int n : {2, 3, 4, 5}) {
    for (const double offset : {0.0, 1e-16, 1e-14, 1e-12}) {
      CAPTURE(n, offset);
      auto bodies = starOf<S>(n, offset, none, none);
      CHECK(stepsOf(bodies, S(10)) < 90);
    }
    for (const double boost : {1e-3, 1.0, 1e3}) {
      CAPTURE(n, boost);
      auto bodies = starOf<S>(n, 0, none, {S(boost), S(boost / 3), 0});
      CHECK(stepsOf(bodies, S(10)) < (boost < 1e3 ? 90 : 250));
    }
    for (const double far : {1.0, 1e3}) {
      CAPTURE(n, far);
      auto bodies = starOf<S>(n, 0, {S(far), 0, 0}, none);
      CHECK(stepsOf(bodies, S(10)) < 200);
    }
  }
}

// Of float's range. Seen to hang ("no end"): the difference between 1 and the next number taken as 0, and as
// that of a double.
TEST_CASE("A scalar that knows no limits does not stop the clock") {
  using S = MinimalRealOf<float>;
  std::vector<Body<S>> list(4);
  for (int k = 0; k < 3; ++k) {  // amid them the star has no acceleration but rounding
    const double angle = 2 * pi<double>() * k / 3;
    list[static_cast<std::size_t>(k)].position = {S(std::cos(angle)), S(std::sin(angle)), S(0)};
    list[static_cast<std::size_t>(k)].velocity = {S(-std::sin(angle)), S(std::cos(angle)), S(0)};
    list[static_cast<std::size_t>(k)].mass = S(1e-6);
  }
  list[3].mass = S(1);
  auto bodies = bodiesOf(list);
  CHECK(stepsOf(bodies, S(10)) < 90);
}

// Between two bodies that go round, and that are fixed; in the middle and beside it. A tracer at rest there
// leaves it as exp(2.6 t): steps are short while its acceleration is no more than 1e4 of its rounding. Seen
// to hang without floors beside the middle of the two that go round ("no end").
TEMPLATE_TEST_CASE("A tracer in the middle of two bodies does not stop the clock", "", float, double) {
  using S = TestType;
  for (const bool fixed : {false, true}) {
    for (const double off : {0.0, 1e-16, 1e-9}) {
      std::vector<Body<S>> list(3);
      list[0].mass = list[1].mass = S(0.5);
      list[0].position = {S(0.5), 0, 0};
      list[1].position = {S(-0.5), fixed ? S(0.1) : S(0), 0};
      list[0].velocity[1] = fixed ? S(0) : S(0.5);
      list[1].velocity = -list[0].velocity;
      list[0].fixed = list[1].fixed = fixed;
      list[2].mass = 0;
      list[2].position = {S(off / 2), fixed ? S(0.05 + off) : S(0), S(off)};
      auto bodies = bodiesOf(list);
      CAPTURE(fixed, off);
      CHECK(stepsOf(bodies, fixed ? S(3) : S(10)) < (fixed ? 1000 : 10000));
    }
  }
}

// The light pair goes round in 1.05 and is the fastest, at 5e-8 of the largest acceleration (float: 5e-3).
// Seen to fail: a floor of 1e-6 of the largest acceleration.
TEMPLATE_TEST_CASE("A light pair far out is resolved beside a heavy one", "", float, double) {
  using S = TestType;
  constexpr bool small = std::is_same_v<S, float>;
  auto list = scenes::keplerPair<S>(S(0), S(0.3));
  for (Body<S>& body : list) {
    body.position[0] += small ? S(1e3) : S(1e6);
  }
  const S r = small ? S(1e-4) : S(1e-9);
  for (const S sign : {S(1), S(-1)}) {
    list.push_back({.position = {0, 0, sign * r / 2},
                    .velocity = {0, sign * S(6) * r / 2, 0},
                    .mass = S(36) * r * r * r / 2});
  }
  auto bodies = bodiesOf(list);
  CHECK(stepsOf(bodies, S(10)) > 330);  // 36 an orbit
  const S apart = (bodies[2].position() - bodies[3].position()).norm();
  CHECK_THAT(static_cast<double>(apart / r), WithinAbs(1.0, small ? 2e-2 : 1e-6));
}

// Seen to fail: without the count it does not return.
TEST_CASE("Forces without end to their changes are refused") {
  Bodies<double> bodies;
  bodies.add(Body<double>{});
  int calls = 0;
  const auto forces = [&](double) {
    bodies[0].acceleration() = Vector3<double>(++calls % 3 == 0 ? 1 : -1, 0, 0);
  };
  forces(0);
  GaussRadau15<double> method;
  CHECK_THROWS_WITH(method.advance(bodies, 1.0, false, forces), ContainsSubstring("rounding of time"));
}
