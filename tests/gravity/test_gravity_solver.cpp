#include "oracle/gravity.hpp"
#include "support/catch.hpp"
#include <gravel/gravity/gravity_solver.hpp>

using namespace gravel;
using namespace gravel::test;

TEMPLATE_TEST_CASE("the solver gives the direct sum's bits", "", float, double, long double) {
  using S = TestType;
  const auto points = randomMasses<S>(100, 80);
  for (const GravityKind kind : {GravityKind::Automatic, GravityKind::Direct}) {
    GravitySolver<S> solver(kind);
    DirectSum<S> direct;
    std::vector<Vector3<S>> a(100);
    std::vector<Vector3<S>> b(100);
    solver.accelerations(points.positions, points.masses, S(1), S(0.01), a);
    direct.accelerations(points.positions, points.masses, S(1), S(0.01), b);
    CHECK(a == b);
    CHECK(solver.potentialEnergy(points.positions, points.masses, S(1), S(0.01)) ==
          direct.potentialEnergy(points.positions, points.masses, S(1), S(0.01)));
    CHECK(std::string(solver.name()) == "direct sum");
    CHECK(solver.kind() == kind);
  }
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
