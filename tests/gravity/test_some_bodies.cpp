#include "oracle/gravity.hpp"
#include "support/catch.hpp"
#include "support/threads.hpp"
#include <gravel/gravity/gravity_solver.hpp>

#include <numeric>

// Accelerations of some bodies only, and bodies that only feel.

using namespace gravel;
using namespace gravel::test;

namespace {

using Vec = Vector3<double>;

const Vec untouched(7, 8, 9);

double error(const Vec& a, const Vec& exact) { return (a - exact).norm() / exact.norm(); }

}  // namespace

TEST_CASE("Accelerations of some bodies are theirs of all, and no other is written") {
  auto points = randomMasses<double>(400, 50);
  points.masses[11] = points.masses[12] = 0.0;
  const std::vector<std::uint32_t> some{3, 11, 399, 0, 57, 58, 59, 60, 61};
  for (const Domain<double>& domain : {Domain<double>::open(), Domain<double>::periodic({1, 1.5, 1})}) {
    for (const GravityKind kind : {GravityKind::Direct, GravityKind::FastMultipole}) {
      GravitySolver<double> solver(kind);
      solver.setTolerance(1e-3);
      solver.setDomain(domain);
      std::vector<Vec> all(400), part(400, untouched);
      solver.accelerations(points.positions, points.masses, 2.0, 0.01, all);
      for (const int threads : {1, 3}) {
        const WithThreads these(threads);
        solver.accelerationsOf(some, points.positions, points.masses, 2.0, 0.01, part);
      }
      for (std::size_t i = 0; i < 400; ++i) {
        if (std::find(some.begin(), some.end(), i) != some.end()) {
          CHECK(error(part[i], all[i]) < 1e-13);
        } else {
          CHECK(part[i] == untouched);
        }
      }
    }
  }
}

TEST_CASE("None of the bodies, all of them, and numbers that no body has") {
  const auto points = randomMasses<double>(50, 51);
  for (const GravityKind kind : {GravityKind::Direct, GravityKind::FastMultipole}) {
    GravitySolver<double> solver(kind);
    std::vector<Vec> out(50, untouched);
    solver.accelerationsOf(std::vector<int>{}, points.positions, points.masses, 1.0, 0.0, out);
    CHECK(out == std::vector<Vec>(50, untouched));
    const std::vector<std::size_t> bad{1, 50};
    CHECK_THROWS_WITH(
        solver.accelerationsOf(bad, points.positions, points.masses, 1.0, 0.0, out),
        ContainsSubstring("number of a body in a gravity sum is 50") && ContainsSubstring("below"));
    CHECK(out == std::vector<Vec>(50, untouched));
    std::vector<int> every(50);
    std::iota(every.begin(), every.end(), 0);
    std::vector<Vec> all(50);
    solver.accelerations(points.positions, points.masses, 1.0, 0.0, all);
    solver.accelerationsOf(every, points.positions, points.masses, 1.0, 0.0, out);
    for (std::size_t i = 0; i < 50; ++i) {
      CHECK(error(out[i], all[i]) < 1e-13);
    }
    solver.accelerationsOf(every, points.positions, points.masses, 0.0, 0.0, out);
    CHECK(out == std::vector<Vec>(50, Vec(0, 0, 0)));
  }
}

// Seen to fail where the walk goes through cells in which nothing is wanted.
TEST_CASE("A tenth of the bodies, side by side, costs the expansions a seventh of the work at most") {
  const auto points = randomMasses<double>(12000, 52);
  FastMultipole<double> sum;
  sum.setTolerance(1e-4);
  std::vector<Vec> out(12000);
  sum.accelerations(points.positions, points.masses, 1.0, 0.0, out);
  const detail::WalkCount all = sum.count();
  std::vector<std::size_t> some;
  for (std::size_t i = 0; i < 12000; ++i) {
    if (points.positions[i][0] < -0.4) {
      some.push_back(i);
    }
  }
  CHECK(some.size() > 1000);
  sum.accelerationsOf(some, points.positions, points.masses, 1.0, 0.0, out);
  CHECK(sum.count().pairs * 7 < all.pairs);
  CHECK(sum.count().expansions * 7 < all.expansions);
  CHECK(sum.count().pairs > 0);
}

// Seen to fail where massless bodies stay among the sources.
TEST_CASE("Tracers cost expansions only what they feel, and pull at nothing") {
  auto points = randomMasses<double>(1500, 53);
  auto heavy = points;
  heavy.positions.clear();
  heavy.masses.clear();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 10 == 0) {
      heavy.positions.push_back(points.positions[i]);
      heavy.masses.push_back(points.masses[i]);
    } else {
      points.masses[i] = 0.0;
    }
  }
  for (const double softening : {0.0, 0.01}) {
    FastMultipole<double> sum;
    sum.setTolerance(1e-6);
    std::vector<Vec> out(1500);
    sum.accelerations(points.positions, points.masses, 1.0, softening, out);
    // Each of the 1500 feels 150 at most.
    CHECK(sum.count().pairs <= 1500 * 150);
    CHECK(sum.count().pairs > 0);
    const GravityOracle exact = bruteGravity(points.positions, points.masses, 1.0, softening);
    double squares = 0;
    for (std::size_t i = 0; i < 1500; ++i) {
      squares += std::pow(error(out[i], exact.accelerations[i].cast<double>()), 2);
    }
    CHECK(std::sqrt(squares / 1500) < 1e-6);
    CHECK_THAT(sum.potentialEnergy(points.positions, points.masses, 1.0, softening),
               WithinRel(sum.potentialEnergy(heavy.positions, heavy.masses, 1.0, softening), 1e-6));
  }
}
