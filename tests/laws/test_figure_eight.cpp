#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/other_spaces.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

template <class S>
Space<S> eight(IntegratorKind kind, S dt) {
  SimulationConfig<S> config = plain<S>(dt);
  config.G = S(1);
  config.integrator = kind;
  Space<S> space(config);
  for (const Body<S>& body : scenes::figureEight<S>()) {
    space.addBody(body);
  }
  return space;
}

/// Largest distance of a body from where it began, after one period of n steps.
template <class S>
S closure(IntegratorKind kind, int n) {
  Space<S> space = eight<S>(kind, S(6.32591398292621L) / S(n));
  advance(space, static_cast<std::size_t>(n));
  const auto start = scenes::figureEight<S>();
  S worst(0);
  for (std::size_t i = 0; i < 3; ++i) {
    worst = std::max<S>(worst, (space.body(i).position() - start[i].position).norm());
  }
  return worst;
}

}  // namespace

TEST_CASE("The eight's energy and angular momentum are the published ones, and are kept") {
  Space<double> space = eight<double>(IntegratorKind::Yoshida6, scenes::figureEightPeriod / 1000);
  const auto energy = [&] {
    const auto [k, r, u] = space.calculateSystemEnergy();
    return k + r + u;
  };
  CHECK_THAT(energy(), WithinAbs(-1.287141995631852, 1e-14));
  CHECK(space.conserved().angularMomentum.norm() < 1e-14);
  advance(space, 1000);
  CHECK_THAT(energy(), WithinAbs(-1.287141995631852, 1e-10));
  CHECK(space.conserved().angularMomentum.norm() < 1e-13);
  CHECK(space.conserved().momentum.norm() < 1e-14);
}

// Two-sided. The starting digits close to 2.5e-14, far below these errors; Yoshida6 has between 1e-10 and
// 1e-12 only a short way to show its order.
TEST_CASE("The eight closes with the order of the method") {
  struct Row {
    IntegratorKind kind;
    int n;
    double order;
    double tolerance;
  };
  for (const Row& row :
       {Row{IntegratorKind::VelocityVerlet, 2000, 2.0, 0.02}, Row{IntegratorKind::Yoshida4, 1000, 4.0, 0.05},
        Row{IntegratorKind::Yoshida6, 600, 6.0, 0.25}}) {
    const double slope = std::log2(static_cast<double>(closure<long double>(row.kind, row.n) /
                                                       closure<long double>(row.kind, 2 * row.n)));
    CAPTURE(traitsOf(row.kind).name);
    CHECK_THAT(slope, WithinAbs(row.order, row.tolerance));
  }
}

// What a fixed step reaches with 1e4 steps a period, in double: velocity Verlet 8.1e-7, Yoshida4 1.7e-11,
// Yoshida6 8e-14 (a Gauss-Radau method of order 15 reaches the digits' 2.5e-14).
TEST_CASE("The eight closes after one period to the error of ten thousand steps") {
  const double vv = closure<double>(IntegratorKind::VelocityVerlet, 10000);
  const double y4 = closure<double>(IntegratorKind::Yoshida4, 10000);
  const double y6 = closure<double>(IntegratorKind::Yoshida6, 10000);
  CHECK_THAT(vv, WithinRel(8.14e-7, 0.05));
  CHECK_THAT(y4, WithinRel(1.68e-11, 0.05));
  CHECK(y6 <= 2e-13);  // 70000 force evaluations that round by 1e-16, and the digits' own 2.5e-14
}

// Yoshida6 with 0.007 (904 steps a period) is 2.5e-14 off; by its order 1e-14 of the closure above.
TEST_CASE("Body 1 of the eight is where it should be at t = 1, by steps that end there exactly") {
  Space<double> space = eight<double>(IntegratorKind::Yoshida6, 0.007);
  space.advanceTo(1.0);
  CHECK(space.time() == 1.0);
  CHECK((space.body(0).position() - Vec(0.993582914758773, 0.219204946881732, 0.0)).norm() < 1e-13);
}

// The starting digits close to 2.5e-14 in one period, 2.7e-13 in ten and 2.7e-12 in a hundred (measured with
// a Taylor series in quadruple precision): a method without error of its own shows these. At the start body 3
// stands at the origin without acceleration, and so does each body every third of a period.
TEST_CASE("Gauss-Radau closes the eight to the digits it starts from") {
  Space<double> space = eight<double>(IntegratorKind::GaussRadau15, scenes::figureEightPeriod);
  const auto start = scenes::figureEight<double>();
  const auto off = [&] { return (space.body(0).position() - start[0].position).norm(); };
  advance(space, 1);
  CHECK_THAT(off(), WithinRel(2.5e-14, 0.15));
  advance(space, 9);
  CHECK_THAT(off(), WithinRel(2.7e-13, 0.15));
  advance(space, 90);
  CHECK_THAT(off(), WithinRel(2.7e-12, 0.15));
  const auto [kinetic, rotational, potential] = space.calculateSystemEnergy();
  CHECK_THAT(kinetic + rotational + potential, WithinAbs(-1.287141995631852, 3e-15));
}
