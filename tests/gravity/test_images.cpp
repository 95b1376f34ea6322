#include "oracle/images.hpp"
#include "support/archetypes.hpp"
#include "support/catch.hpp"
#include "support/gravity_scenes.hpp"
#include "support/threads.hpp"
#include <gravel/gravity/gravity_solver.hpp>

// Gravity in periodic and shear-periodic domains: the images of all bodies pull.

using namespace gravel;
using namespace gravel::test;

namespace {

using Vec = Vector3<double>;

const Vec cube(1, 1, 1);
const Vec brick(2, 3, 2.5);

/// n points in a box of these edges, of masses over one decade.
template <class S = double>
PointMasses<S> inBox(std::size_t n, const Vec& box, std::uint64_t seed = 40) {
  auto points = randomMasses<S>(n, seed);
  for (Vector3<S>& x : points.positions) {
    x = x.cwiseProduct(box.template cast<S>()).eval();
  }
  return points;
}

template <class Method, class S>
std::vector<Vector3<S>> accelerations(Method& method, const PointMasses<S>& points, S softening = S(0)) {
  std::vector<Vector3<S>> a(points.size());
  method.accelerations(points.positions, points.masses, S(1), softening, a);
  return a;
}

template <class Method, class S>
S potential(Method& method, const PointMasses<S>& points, S softening = S(0)) {
  return method.potentialEnergy(points.positions, points.masses, S(1), softening);
}

/// rms of errors over rms of accelerations.
template <class S, class Exact>
double error(const std::vector<Vector3<S>>& a, const std::vector<Exact>& exact) {
  long double squares = 0;
  long double scale = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Wide e = exact[i].template cast<long double>();
    squares += (a[i].template cast<long double>() - e).squaredNorm();
    scale += e.squaredNorm();
  }
  return static_cast<double>(std::sqrt(squares / scale));
}

DirectSum<double> direct(const Domain<double>& domain, double time = 0, double tolerance = 1e-10) {
  DirectSum<double> sum;
  sum.setDomain(domain, time);
  sum.setImageTolerance(tolerance);
  return sum;
}

FastMultipole<double> expansions(const Domain<double>& domain, double tolerance, double time = 0) {
  FastMultipole<double> sum;
  sum.setDomain(domain, time);
  sum.setTolerance(tolerance);
  return sum;
}

Domain<double> periodic(const Vec& box) { return Domain<double>::periodic(box); }

/// At this time its lattice leans by -0.3 of the box.
const double leaning = 0.9;
Domain<double> patch(const Vec& box) {
  return Domain<double>::shearPeriodic(box, 0.7 * box[1] / (1.5 * box[0] * leaning));
}

}  // namespace

// Energies in units of G m^2 over the radius of a sphere of a body's own volume. Foldy 1978, Phys. Rev. B 17,
// 4889, of electrons in a positive background, where the sign is the other.
TEST_CASE("Bodies on cubic lattices have the energy of Wigner's crystals, and no acceleration") {
  struct Crystal {
    std::vector<Vec> places;
    double energy;
  };
  const std::array<Crystal, 3> crystals{
      {{{{0.1, 0.2, 0.3}}, 0.880059442},
       {{{0, 0, 0}, {-0.5, -0.5, -0.5}}, 0.895929256},
       {{{0, 0, 0}, {-0.5, -0.5, 0}, {-0.5, 0, -0.5}, {0, -0.5, -0.5}}, 0.895873615}}};
  for (const Crystal& crystal : crystals) {
    const PointMasses<double> points{crystal.places, std::vector<double>(crystal.places.size(), 1.0)};
    const auto n = double(points.size());
    const double radius = std::cbrt(3 / (4 * pi<double>() * n));
    auto pairs = direct(periodic(cube));
    auto cells = expansions(periodic(cube), 1e-9);
    CHECK_THAT(potential(pairs, points), WithinRel(n * crystal.energy / radius, 1e-9));
    CHECK_THAT(potential(cells, points), WithinRel(n * crystal.energy / radius, 1e-9));
    for (const Vec& a : accelerations(pairs, points)) {
      CHECK(a.norm() < 1e-11 * n);
    }
  }
  // A single cube to all digits that are known: Madelung's constant of it.
  const PointMasses<double> one{{{0, 0, 0}}, {1.0}};
  auto sum = direct(periodic(cube));
  CHECK_THAT(potential(sum, one), WithinRel(2.837297479480619 / 2, 1e-13));
}

// Seen to fail with the background left out, with the sign of a wave turned, and with a near image counted
// twice.
TEST_CASE("The direct sum in a periodic box gives Ewald's forces and energy, to the tolerance of images") {
  for (const Vec& box : {cube, brick, Vec(1, 1, 4)}) {
    auto points = inBox(16, box);
    points.masses[5] = 0.0;
    const Wide edges = box.cast<long double>();
    const GravityOracle exact = latticeGravity(points, [&](const Wide& r) { return ewald(r, edges); });
    double before = 1;
    for (const double tolerance : {1e-2, 1e-4, 1e-6, 1e-8}) {
      auto sum = direct(periodic(box), 0, tolerance);
      const auto a = accelerations(sum, points);
      const double e = error(a, exact.accelerations);
      CAPTURE(box, tolerance, e);
      CHECK(e < tolerance);
      CHECK(e < before / 3);  // it is the images that err, and the tolerance that rules them
      before = e;
      CHECK(imbalance(points, a) < 1e-14);
      CHECK_THAT(potential(sum, points), WithinRel(double(exact.potential), tolerance));
    }
    auto sum = direct(periodic(box));
    CHECK(error(accelerations(sum, points), exact.accelerations) < 1e-10);
  }
}

TEST_CASE("The oracle of periodic boxes does not depend on where its two sums part") {
  const Wide edges = brick.cast<long double>();
  for (const Wide& r : {Wide(0, 0, 0), Wide(0.3, -0.8, 1.1), Wide(0.01, 0, 0)}) {
    const LatticeForce one = ewald(r, edges, 1.9L);
    const LatticeForce two = ewald(r, edges, 2.8L);
    CHECK(std::abs(one.potential - two.potential) < 1e-15L * (1 + std::abs(one.potential)));
    CHECK((one.acceleration - two.acceleration).norm() < 1e-15L * (1 + one.acceleration.norm()));
  }
}

// Of bodies in a shear-periodic patch every two are apart in z here, so that the oracle has few waves.
// Seen to fail where the lattice leans to the other side.
TEST_CASE("The direct sum in a shear-periodic patch gives the forces of the leaning lattice's waves") {
  for (const Vec& box : {cube, brick, Vec(1, 4, 1)}) {
    for (const double time : {0.0, leaning}) {
      auto points = inBox(7, box);
      for (std::size_t i = 0; i < points.size(); ++i) {
        points.positions[i][2] = 0.25 * double(i);
      }
      const Domain<double> domain = patch(box);
      const Wide a(box[0], -domain.shearOffset(time), 0);
      const Wide b(0, box[1], 0);
      CHECK_THAT(domain.shearOffset(time), WithinAbs(time == 0.0 ? 0.0 : -0.3 * box[1], 1e-14));
      // A mass above itself in its own lattice: from two heights, as waves begin with constants and z.
      long double own = 0;
      const auto law = [&](const Wide& r) { return r[2] == 0 ? LatticeForce{} : planeWaves(r, a, b); };
      const GravityOracle exact = latticeGravity(points, law);
      for (const double m : points.masses) {
        own += static_cast<long double>(m) * static_cast<long double>(m);
      }
      // The potential of a mass's own images is that of a pair at no distance, less the pair.
      auto close = direct(domain, time);
      const PointMasses<double> alone{{{0, 0, 0}}, {1.0}};
      const double self = potential(close, alone);
      const LatticeForce near = planeWaves(Wide(0, 0, 0.04L), a, b);
      CHECK_THAT(-2 * self, WithinAbs(double(near.potential - 25), 0.02));
      double before = 1;
      for (const double tolerance : {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}) {
        auto sum = direct(domain, time, tolerance);
        const auto found = accelerations(sum, points);
        const double e = error(found, exact.accelerations);
        CAPTURE(box, time, tolerance, e);
        CHECK(e < tolerance);
        CHECK((e < before / 3 || e < 1e-12));
        before = e;
        CHECK(imbalance(points, found) < 1e-14);
        CHECK_THAT(potential(sum, points),
                   WithinAbs(double(exact.potential) + self * double(own), tolerance * double(own)));
      }
      CHECK(before < 1e-10);
    }
  }
}

/// Evenly from the bottom to the top of a patch, so that the oracle has few waves.
PointMasses<double> inColumn(std::size_t n, const Vec& box, double depth) {
  auto points = inBox(n, box);
  for (std::size_t i = 0; i < n; ++i) {
    points.positions[i][2] = depth * (double(i) / double(n - 1) - 0.4);
  }
  return points;
}

GravityOracle waves(const PointMasses<double>& points, const Domain<double>& domain, double time) {
  const Wide a(domain.lengths()[0], -domain.shearOffset(time), 0);
  const Wide b(0, domain.lengths()[1], 0);
  return latticeGravity(points,
                        [&](const Wide& r) { return r[2] == 0 ? LatticeForce{} : planeWaves(r, a, b); });
}

// With all bodies in one expansion, whose coefficients cancel as powers of the depth, the error was 2 of a
// depth of 8 at 1e-9 and 1e18 of a depth of 30.
TEST_CASE("However deep a patch, both methods give the forces of the leaning lattice's waves") {
  for (const Vec& box : {cube, brick, Vec(1, 4, 1)}) {
    for (const double depth : {4.5, 8.0, 30.0, 100.0}) {
      const double edge = box.head<2>().norm() / std::sqrt(2.0);
      auto points = inColumn(24, box, depth * edge);
      points.masses[7] = 0.0;
      points.masses[23] = 0.0;  // alone in its slab
      const Domain<double> domain = patch(box);
      const GravityOracle exact = waves(points, domain, leaning);
      auto finest = direct(domain, leaning);
      const double self = potential(finest, PointMasses<double>{{{0, 0, 0}}, {1.0}});
      double own = 0;
      for (const double m : points.masses) {
        own += self * m * m;
      }
      for (const double tolerance : {1e-2, 1e-4, 1e-6, 1e-9, 1e-10}) {
        auto sum = direct(domain, leaning, tolerance);
        const auto found = accelerations(sum, points);
        CAPTURE(box, depth, tolerance);
        CHECK(error(found, exact.accelerations) < tolerance / 10);
        CHECK(imbalance(points, found) < 1e-14);
        const double energy = potential(sum, points);
        CHECK_THAT(energy, WithinRel(double(exact.potential) + own, tolerance / 10));
        double each = 0;  // pairs are met twice, a body's own images once
        for (std::size_t i = 0; i < points.size(); ++i) {
          each += sum.energyOf(i, points.positions, points.masses, 1.0, 0.0);
        }
        CHECK_THAT(each, WithinRel(2 * double(exact.potential) + own, tolerance / 10));
        std::vector<Vec> some(points.size(), Vec::Zero());
        sum.accelerationsOf(std::array{3, 23}, points.positions, points.masses, 1.0, 0.0, some);
        CHECK((some[3] - found[3]).norm() < 1e-12 * found[3].norm());
        CHECK((some[23] - found[23]).norm() < 1e-12 * found[23].norm());
        auto cells = expansions(domain, tolerance, leaning);
        CHECK(error(accelerations(cells, points), exact.accelerations) < tolerance);
        CHECK_THAT(potential(cells, points), WithinRel(energy, tolerance));
      }
    }
  }
}

// The error was 2e-2 at 1e-2 and 5e-1 at 1e-10, however flat: such a lattice has cells of shorter edges.
TEST_CASE("A long patch that leans gives the forces of its waves") {
  const Vec box(1, 8, 1);
  const Domain<double> domain = Domain<double>::shearPeriodic(box, 4.0 / (1.5 * leaning));
  for (const double depth : {2.0, 5.0}) {
    auto points = inColumn(8, box, depth);
    points.positions[0][1] = -3.9;
    points.positions[7][1] = 3.9;
    const GravityOracle exact = waves(points, domain, leaning);
    for (const double tolerance : {1e-2, 1e-5, 1e-9, 1e-10}) {
      auto sum = direct(domain, leaning, tolerance);
      CAPTURE(depth, tolerance);
      CHECK(error(accelerations(sum, points), exact.accelerations) < tolerance);
    }
  }
}

// Of a patch as long as is allowed the middle has 20 000 points on each side, and the next is outside. Seen
// to fail, NaN, by which no such patch was deep: their square in int.
TEST_CASE("The longest patch knows how far its middle reaches") {
  for (const double length : {100.0, 8000.0, 1e4}) {
    CHECK(detail::LatticeSums<double>::beyondMiddle({1, 0, 0}, {0, length, 0}) == 2 * length + 1);
  }
}

// Seen to fail, all forces garbage, where such a body deepened the one expansion of all. The sheet of a patch
// pulls with 2 pi M over the area; its waves have gone.
TEST_CASE("A light body far above a patch leaves all others their forces, and falls to the sheet") {
  auto points = inBox(60, Vec(1, 1, 0.1));
  auto pairs = direct(patch(cube), leaning);
  auto cells = expansions(patch(cube), 1e-6, leaning);
  const auto exact = accelerations(pairs, points);
  double mass = 0;
  for (const double m : points.masses) {
    mass += m;
  }
  points.positions.push_back({0.1, 0.2, 0});
  points.masses.push_back(0);
  for (const double height : {6.0, 20.0, 1e3, 1e9, 1e18, 1e30}) {
    for (const double light : {0.0, 1e-14}) {
      points.positions.back()[2] = height;
      points.masses.back() = light;
      auto one = accelerations(pairs, points);
      auto two = accelerations(cells, points);
      CAPTURE(height, light);
      CHECK_THAT(one.back()[2], WithinRel(-2 * pi<double>() * mass, 1e-11));
      CHECK_THAT(two.back()[2], WithinRel(-2 * pi<double>() * mass, 1e-6));
      one.pop_back();
      two.pop_back();
      CHECK(error(one, exact) < 1e-11);
      CHECK(error(two, exact) < 1e-6);
    }
  }
}

// The total force was seen to fail where of a cell and its own image only one is divided.
TEST_CASE("Expansions keep the tolerance in periodic domains, and action is reaction") {
  struct Case {
    Domain<double> domain;
    Vec size;  // of the cloud
  };
  for (const Case& c : {Case{periodic(brick), brick}, Case{periodic(brick), Vec(0.4, 0.3, 0.5)},
                        Case{patch(brick), Vec(2, 3, 0.1)}}) {
    auto points = inBox(900, c.size);
    for (std::size_t i = 0; i < points.size(); ++i) {
      points.positions[i] += Vec(0.9, 1.4, 0);  // across the edges
      points.masses[i] *= i % 7 == 0 ? 0.0 : 1.0;
    }
    auto pairs = direct(c.domain, leaning, 1e-9);
    const auto exact = accelerations(pairs, points);
    double mean = 0;
    for (const Vec& a : exact) {
      mean += a.norm() / double(exact.size());
    }
    const double energy = potential(pairs, points);
    for (const double tolerance : {1e-2, 1e-4, 1e-6}) {
      auto sum = expansions(c.domain, tolerance, leaning);
      const auto a = accelerations(sum, points);
      double squares = 0;
      double worst = 0;
      for (std::size_t i = 0; i < a.size(); ++i) {
        const double e = (a[i] - exact[i]).norm();
        squares += std::pow(e / std::max(exact[i].norm(), mean / 100), 2);
        worst = std::max(worst, e / std::max(exact[i].norm(), mean / 10));
      }
      const double rms = std::sqrt(squares / double(a.size()));
      CAPTURE(c.size, tolerance, rms, worst);
      CHECK(rms < tolerance);
      CHECK(rms > tolerance / 500);
      CHECK(worst < 10 * tolerance);
      CHECK(imbalance(points, a) < 1e-14);
      CHECK_THAT(potential(sum, points), WithinRel(energy, tolerance));
    }
  }
}

TEST_CASE("Bodies may stand in any of their images, and all may be moved together") {
  const Domain<double> domains[] = {periodic(brick), patch(brick), patch(Vec(0.3, 0.5, 1))};
  for (const Domain<double>& domain : domains) {
    const Vec edges = domain.lengths();
    const auto points = inBox(40, brick);
    auto moved = points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double k = double(i % 3) - 1.0;
      moved.positions[i] += Vec(k * edges[0], double(i % 2) * edges[1] - k * domain.shearOffset(leaning), 0);
      moved.positions[i] += Vec(0.3, -0.7, 0.2);
    }
    auto sum = direct(domain, leaning);
    const auto a = accelerations(sum, points);
    CHECK(error(accelerations(sum, moved), a) < 1e-10);
    auto cells = expansions(domain, 1e-8, leaning);
    CHECK(error(accelerations(cells, moved), a) < 1e-8);
    CHECK_THAT(potential(sum, moved), WithinRel(potential(sum, points), 1e-10));
  }
}

TEST_CASE("Accelerations with images are the slope of the energy with images") {
  for (const Domain<double>& domain : {periodic(brick), patch(brick), patch(Vec(0.3, 0.5, 1))}) {
    auto points = inBox(20, brick);
    auto sum = direct(domain, leaning);
    const double softening = 0.05;
    const auto a = accelerations(sum, points, softening);
    const double h = 1e-4;
    for (int axis = 0; axis < 3; ++axis) {
      double slope = 0;
      for (const double side : {1.0, -1.0}) {
        points.positions[3][axis] += side * h;
        slope += side * potential(sum, points, softening) / (2 * h);
        points.positions[3][axis] -= side * h;
      }
      // h^2/6 of third derivatives of m/r at softened distances of 0.05 at least, here far less.
      CHECK_THAT(-slope / points.masses[3], WithinRel(a[3][axis], 1e-5));
    }
  }
}

TEST_CASE("Softening acts on near images as on the bodies themselves") {
  const double softening = 0.02;
  auto points = inBox(12, cube);
  points.positions[0] = {0.495, 0, 0};
  points.positions[1] = {-0.495, 0.005, 0};  // nearest across the edge
  const auto law = [&](const Wide& r) {
    LatticeForce force = ewald(r, cube.cast<long double>());
    for (int i = 0; i < 125; ++i) {
      const std::array<int, 3> image{i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2};
      const Wide d = r + Wide(image[0], image[1], image[2]);
      const long double s = d.squaredNorm() + static_cast<long double>(softening * softening);
      if (d.norm() > 0) {
        force.acceleration += d / std::pow(d.norm(), 3) - d / (s * std::sqrt(s));
        force.potential += 1 / std::sqrt(s) - 1 / d.norm();
      }
    }
    return force;
  };
  const GravityOracle exact = latticeGravity(points, law);
  auto pairs = direct(periodic(cube));
  // What is softened and what is not differs beyond 2.4 edges: (eps/r)^2 of little.
  CHECK(error(accelerations(pairs, points, softening), exact.accelerations) < 1e-6);
  CHECK(error(accelerations(pairs, points), exact.accelerations) > 1e-2);
  auto cells = expansions(periodic(cube), 1e-5);
  CHECK(error(accelerations(cells, points, softening), exact.accelerations) < 1e-5);
}

TEMPLATE_TEST_CASE("Images pull bodies of every scalar", "",
                   GRAVEL_TEST_TYPES(double, long double, float, MinimalReal)) {
  using S = TestType;
  const auto points = inBox<double>(40, brick);
  PointMasses<S> own;
  for (std::size_t i = 0; i < points.size(); ++i) {
    own.positions.push_back(
        {S(points.positions[i][0]), S(points.positions[i][1]), S(points.positions[i][2])});
    own.masses.push_back(S(points.masses[i]));
  }
  const auto number = [](const S& x) {
    if constexpr (std::is_floating_point_v<S>) {
      return static_cast<double>(x);
    } else {
      return x.inTest();
    }
  };
  const bool isDeep = GENERATE(false, true);
  auto reference =
      direct(isDeep ? Domain<double>::shearPeriodic({0.25, 0.5, 1}, 1.0) : periodic(brick), 0.5, 1e-6);
  const auto exact = accelerations(reference, points);
  const Domain<S> domain = isDeep ? Domain<S>::shearPeriodic({S(0.25), S(0.5), S(1)}, S(1))
                                  : Domain<S>::periodic({S(2), S(3), S(2.5)});
  DirectSum<S> sum;
  sum.setDomain(domain, S(0.5));
  sum.setImageTolerance(S(1e-6));
  FastMultipole<S> cells;
  cells.setDomain(domain, S(0.5));
  cells.setTolerance(S(1e-4));
  const auto one = accelerations(sum, own);
  const auto two = accelerations(cells, own);
  std::vector<Vec> a, b;
  for (std::size_t i = 0; i < own.size(); ++i) {
    a.push_back({number(one[i][0]), number(one[i][1]), number(one[i][2])});
    b.push_back({number(two[i][0]), number(two[i][1]), number(two[i][2])});
  }
  CHECK(error(a, exact) < (std::is_same_v<S, float> ? 3e-6 : 1e-13));
  CHECK(error(b, exact) < 1e-4);
  CHECK_THAT(number(potential(sum, own)),
             WithinRel(potential(reference, points), std::is_same_v<S, float> ? 1e-4 : 1e-10));
}

TEST_CASE("Images give the same bits for 1, 2, 3 and 8 threads, and for a used object") {
  for (const Domain<double>& domain : {periodic(brick), patch(brick), patch(Vec(0.2, 0.3, 1))}) {
    const auto points = inBox(330, brick);
    std::vector<Vec> byPairs, byCells;
    {
      const WithThreads one(1);
      auto pairs = direct(domain, leaning, 1e-2);
      auto cells = expansions(domain, 1e-3, leaning);
      byPairs = accelerations(pairs, points);
      byCells = accelerations(cells, points);
    }
    auto pairs = direct(periodic(cube), 0, 1e-2);
    auto cells = expansions(periodic(cube), 1e-3);
    for (const int threads : {2, 3, 8}) {
      const WithThreads some(threads);
      pairs.setDomain(domain, 0.1);
      accelerations(pairs, points);
      pairs.setDomain(domain, leaning);
      cells.setDomain(domain, leaning);
      CHECK(accelerations(pairs, points) == byPairs);
      CHECK(accelerations(cells, points) == byCells);
      cells.setDomain(Domain<double>::open());
      accelerations(cells, points);
    }
  }
}

// Rows of the table of plans may differ in how far near images reach alone. Seen to fail: that not compared,
// so that an object went on with the images of a looser tolerance.
TEST_CASE("Another tolerance of images is that of a new object, looser or finer") {
  const auto points = inBox(330, brick);
  for (const Domain<double>& domain : {periodic(brick), patch(brick)}) {
    auto used = direct(domain, leaning, 1e-2);
    auto cells = expansions(domain, 1e-2, leaning);
    for (const double tolerance : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-7, 1e-6, 1e-5}) {
      CAPTURE(tolerance);
      used.setImageTolerance(tolerance);
      cells.setTolerance(tolerance);
      auto fresh = direct(domain, leaning, tolerance);
      auto freshCells = expansions(domain, tolerance, leaning);
      CHECK(accelerations(used, points) == accelerations(fresh, points));
      CHECK(accelerations(cells, points) == accelerations(freshCells, points));
    }
  }
}

// Seen to fail: the background of the masses before them drew the tracers out.
TEST_CASE("Tracers alone feel nothing of the masses that an object was asked about before") {
  auto points = inBox(30, brick);
  auto sum = direct(periodic(brick));
  accelerations(sum, points);
  std::fill(points.masses.begin(), points.masses.end(), 0.0);
  for (const Vec& a : accelerations(sum, points)) {
    CHECK(a == Vec::Zero());
  }
}

TEST_CASE("The energy of one body is what the system loses with it") {
  for (const Domain<double>& domain : {Domain<double>::open(), periodic(brick), patch(brick)}) {
    auto points = inBox(30, brick);
    auto sum = direct(domain, leaning);
    const double all = potential(sum, points, 0.01);
    const double own = sum.energyOf(4, points.positions, points.masses, 1.0, 0.01);
    points.masses[4] = 0.0;
    CHECK_THAT(all - potential(sum, points, 0.01), WithinAbs(own, 1e-12));
    CHECK(sum.energyOf(4, points.positions, points.masses, 1.0, 0.01) == 0.0);
  }
}

TEST_CASE("With images expansions are taken from fewer bodies on, and a bad tolerance of images is refused") {
  GravitySolver<double> solver;
  CHECK(solver.choice(1000) == GravityKind::Direct);
  solver.setDomain(periodic(cube));
  CHECK(solver.choice(1000) == GravityKind::FastMultipole);
  CHECK(solver.choice(100) == GravityKind::Direct);
  solver.setDomain(Domain<double>::open());
  CHECK(solver.choice(1000) == GravityKind::Direct);
  DirectSum<double> sum;
  CHECK_THROWS_WITH(sum.setImageTolerance(0.0), ContainsSubstring("image tolerance is 0"));
}

// Seen to fail: without the refusal the search for near images does not end.
TEST_CASE("A domain too long for its images is refused, and the one before stays") {
  DirectSum<double> sum;
  sum.setDomain(Domain<double>::periodic({2, 3, 4}));
  for (const Vector3<double>& edges :
       {Vector3<double>(1001, 1, 2), Vector3<double>(1, 1e-320, 1), Vector3<double>(1, 2, 1e308)}) {
    CHECK_THROWS_WITH(sum.setDomain(Domain<double>::periodic(edges)),
                      ContainsSubstring("longest edge of a domain with gravity"));
  }
  CHECK_THROWS_WITH(sum.setDomain(Domain<double>::shearPeriodic({1, 2e5, 1}, 1)),
                    ContainsSubstring("is 2e+05; allowed: at most 10000, 10000 times the shortest"));
  const std::vector<Vector3<double>> x{{0, 0, 0}, {1, 1, 1}};
  const std::vector<double> m{1, 1};
  DirectSum<double> before;
  before.setDomain(Domain<double>::periodic({2, 3, 4}));
  CHECK(sum.potentialEnergy(x, m, 1.0, 0.0) == before.potentialEnergy(x, m, 1.0, 0.0));
  CHECK_NOTHROW(sum.setDomain(Domain<double>::periodic({1000, 1, 1})));
  CHECK_NOTHROW(sum.setDomain(Domain<double>::shearPeriodic({1, 1, 1e300}, 1)));  // gravity is open in z
}
