#include "oracle/gravity.hpp"
#include "support/catch.hpp"
#include <gravel/gravity/gravity_solver.hpp>

using namespace gravel;
using namespace gravel::test;

TEMPLATE_TEST_CASE("the solver gives the bits of the method that it names", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  const auto points = randomMasses<S>(100, 80);
  for (const GravityKind kind : {GravityKind::Automatic, GravityKind::Direct, GravityKind::FastMultipole}) {
    GravitySolver<S> solver(kind);
    std::vector<Vector3<S>> a(100);
    std::vector<Vector3<S>> b(100);
    S energy(0);
    const auto sum = [&](auto method) {
      method.accelerations(points.positions, points.masses, S(1), S(0.01), b);
      energy = method.potentialEnergy(points.positions, points.masses, S(1), S(0.01));
    };
    solver.accelerations(points.positions, points.masses, S(1), S(0.01), a);
    if (kind == GravityKind::FastMultipole) {
      sum(FastMultipole<S>());
      CHECK(std::string(solver.name(100)) == "fast multipole method");
    } else {
      sum(DirectSum<S>());
      CHECK(std::string(solver.name(100)) == "direct sum");
    }
    CHECK(a == b);
    CHECK(solver.potentialEnergy(points.positions, points.masses, S(1), S(0.01)) == energy);
    CHECK(solver.kind() == kind);
  }
}

TEST_CASE("few bodies or a tight tolerance are summed directly, many by expansions") {
  GravitySolver<double> solver;
  CHECK(solver.choice(100) == GravityKind::Direct);
  CHECK(solver.choice(1000000) == GravityKind::FastMultipole);
  // The number from which on expansions are taken grows as the tolerance shrinks.
  std::size_t before = 0;
  for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10}) {
    solver.setTolerance(tolerance);
    std::size_t n = 2;
    while (solver.choice(n) == GravityKind::Direct) {
      n += n / 10 + 1;
    }
    CHECK(n >= before);
    CHECK(n < 1000000);
    before = n;
  }
  CHECK(before > 10000);
  solver.setKind(GravityKind::FastMultipole);
  CHECK(solver.choice(2) == GravityKind::FastMultipole);
}

TEST_CASE("without a gravity constant there is no force, no energy and no sum") {
  auto points = randomMasses<double>(10, 81);
  points.positions[3][0] = std::nan("");  // would be refused if it were looked at
  std::vector<Vector3<double>> a(10, Vector3<double>(1, 1, 1));
  GravitySolver<double> solver;
  solver.accelerations(points.positions, points.masses, 0.0, 0.0, a);
  CHECK(a == std::vector<Vector3<double>>(10, Vector3<double>(0, 0, 0)));
  CHECK(solver.potentialEnergy(points.positions, points.masses, 0.0, 0.0) == 0.0);
}

TEST_CASE("a tolerance is a number above 0 and at most 1") {
  GravitySolver<double> solver;
  CHECK(solver.tolerance() == 1e-5);
  solver.setTolerance(1e-10);
  CHECK(solver.tolerance() == 1e-10);
  for (const double bad : {0.0, -1e-3, 1.5, std::nan("")}) {
    CHECK_THROWS_WITH(solver.setTolerance(bad), ContainsSubstring("gravity tolerance is"));
  }
  CHECK(solver.tolerance() == 1e-10);
}
