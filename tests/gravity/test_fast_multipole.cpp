#include "support/archetypes.hpp"
#include "support/catch.hpp"
#include "support/gravity_scenes.hpp"
#include "support/threads.hpp"
#include <gravel/bodies/bodies.hpp>
#include <gravel/gravity/fast_multipole.hpp>

using namespace gravel;
using namespace gravel::test;

namespace test_fast_multipole {

namespace {

using Wide = Vector3<long double>;

template <class S>
std::vector<Vector3<S>> accelerations(const PointMasses<S>& points, S tolerance, S softening = S(0),
                                      S G = S(1)) {
  std::vector<Vector3<S>> out(points.size());
  FastMultipole<S> sum;
  sum.setTolerance(tolerance);
  sum.accelerations(points.positions, points.masses, G, softening, out);
  return out;
}

template <class S>
S potential(const PointMasses<S>& points, S tolerance, S softening = S(0)) {
  FastMultipole<S> sum;
  sum.setTolerance(tolerance);
  return sum.potentialEnergy(points.positions, points.masses, S(1), softening);
}

struct Errors {
  double rms;
  double worst;  ///< the 99.99th percentile of a few thousand bodies is their worst
};

/// Accelerations of every stride-th body.
template <class S>
std::vector<Wide> exactly(const PointMasses<S>& points, long double softening, std::size_t stride) {
  std::vector<Wide> all;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    Wide exact = Wide::Zero();
    const Wide x = points.positions[i].template cast<long double>();
    for (std::size_t j = 0; j < points.size(); ++j) {
      const Wide d = points.positions[j].template cast<long double>() - x;
      const long double s = d.squaredNorm() + softening * softening;
      if (j != i && s > 0) {
        exact += static_cast<long double>(points.masses[j]) / (s * std::sqrt(s)) * d;
      }
    }
    all.push_back(exact);
  }
  return all;
}

/// Relative errors of every stride-th body; of small accelerations, relative to a share of the mean.
template <class S>
Errors errors(const std::vector<Wide>& exact, const std::vector<Vector3<S>>& a, std::size_t stride,
              long double least = 0.01L) {
  long double mean = 0;
  for (const Vector3<S>& x : a) {
    mean += static_cast<long double>(x.norm()) / static_cast<long double>(a.size());
  }
  long double squares = 0;
  long double worst = 0;
  for (std::size_t k = 0; k < exact.size(); ++k) {
    const long double error = (a[k * stride].template cast<long double>() - exact[k]).norm() /
                              std::max<long double>(exact[k].norm(), mean * least);
    squares += error * error;
    worst = std::max(worst, error);
  }
  return {static_cast<double>(std::sqrt(squares / static_cast<long double>(exact.size()))),
          static_cast<double>(worst)};
}

template <class S>
Errors errors(const PointMasses<S>& points, const std::vector<Vector3<S>>& a, long double softening = 0,
              std::size_t stride = 1, long double least = 0.01L) {
  return errors(exactly(points, softening, stride), a, stride, least);
}

}  // namespace

// Parts of a dense middle that lie in one direction of a large leaf, each taken by its own mass, err alike:
// seen to fail so in all three by 1.5 to 5 times the tolerance, and by up to 60 times in single bodies.
TEST_CASE("the error is within the tolerance where mass is concentrated over decades, rms and worst body") {
  const CounterRandom radial(7);
  const CounterRandom angular(8);
  constexpr std::size_t n = 10000;
  for (const char* name : {"radii over three decades", "radii over six decades", "Jaffe sphere"}) {
    PointMasses<double> points;
    for (std::size_t i = 0; i < n; ++i) {
      const double u = radial.uniform(i);
      // Jaffe (1983, MNRAS 202, 995): M(r) = r/(1 + r), here up to 0.99.
      const double r =
          name[0] == 'J' ? 0.99 * u / (1 - 0.99 * u) : std::pow(10, (name[11] == 't' ? -3 : -6) * u);
      points.positions.push_back(r * angular.direction(i));
      points.masses.push_back(1.0 / n);
    }
    const std::vector<Wide> exact = exactly(points, 0, 10);
    for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
      const auto a = accelerations(points, tolerance);
      const Errors e = errors(exact, a, 10);
      const Errors single = errors(exact, a, 10, 0.1L);
      CAPTURE(name, tolerance, e.rms, single.worst);
      CHECK(e.rms <= tolerance);
      CHECK(single.worst <= 10 * tolerance);
      CHECK(e.rms > 0);
      CHECK(imbalance(points, a) <= 1e-14);
    }
  }
}

// The total force was seen to fail where a pair of cells is judged from the side of the source alone.
TEST_CASE("the error is within the tolerance in every scene, rms and worst body") {
  for (const char* name : gravityScenes) {
    const auto points = gravityScene<double>(name, 2000);
    for (const double tolerance : {1e-2, 2.5e-3, 1e-3, 3e-4, 1e-5, 1e-7, 1e-10}) {
      const auto a = accelerations(points, tolerance);
      const Errors e = errors(points, a, 0, 4);
      CAPTURE(name, tolerance, e.rms, e.worst);
      CHECK(e.rms <= tolerance);
      CHECK(e.worst <= 10 * tolerance);
      CHECK(e.rms > 0);
      CHECK(imbalance(points, a) <= 1e-14);
    }
  }
}

// Seen to fail: columns of the tree counted from the origin (up to 8.4e-11).
TEST_CASE("far from the origin the total force is zero to rounding, as it is about the origin") {
  for (const char* name : gravityScenes) {
    for (const double size : {1.0, 1e-6}) {
      auto points = gravityScene<double>(name, 2000);
      for (Vector3<double>& x : points.positions) {
        x = size * x + Vector3<double>(1e6, -3e5, 2e7) * size;
      }
      for (const double tolerance : {1e-2, 1e-5, 1e-10}) {
        const auto a = accelerations(points, tolerance);
        const Errors e = errors(points, a, 0, 20);
        CAPTURE(name, size, tolerance, e.rms);
        CHECK(e.rms <= tolerance);
        CHECK(imbalance(points, a) <= 1e-14);
      }
    }
  }
}

// These were 10.7, 15.3 and 11.6 tolerances before bodies at the rims of cells were looked at one by one.
TEST_CASE("where few bodies have most of the mass the worst one errs by ten tolerances at most") {
  struct Case {
    std::size_t n;
    std::uint64_t seed;
    double tolerance;
  };
  for (const Case& c : {Case{1000, 249, 1e-3}, Case{2000, 429, 6e-3}, Case{2000, 417, 3e-4}}) {
    const auto points = gravityScene<double>("nine decades of mass", c.n, c.seed);
    const auto a = accelerations(points, c.tolerance);
    const Errors e = errors(points, a, 0, 1, 0.1L);
    CAPTURE(c.n, c.seed, c.tolerance, e.worst);
    CHECK(e.worst <= 10 * c.tolerance);
    CHECK(e.worst > c.tolerance);
    CHECK(imbalance(points, a) <= 1e-14);
  }
}

TEST_CASE("the error is not more than ten times better than asked") {
  for (const char* name : {"Plummer sphere", "uniform sphere", "ring patch"}) {
    const auto points = gravityScene<double>(name, 8000);
    for (const double tolerance : {1e-2, 1e-4, 1e-6}) {
      const Errors e = errors(points, accelerations(points, tolerance), 0, 40);
      CAPTURE(name, tolerance, e.rms);
      CHECK(e.rms > tolerance / 10);
      CHECK(e.rms <= tolerance);
    }
  }
}

TEST_CASE("softened forces keep the tolerance at any softening length") {
  const auto points = gravityScene<double>("Plummer sphere", 1500);
  for (const double softening : {1e-6, 0.05, 1.0, 30.0}) {
    for (const double tolerance : {1e-3, 1e-6}) {
      const auto a = accelerations(points, tolerance, softening);
      const Errors e = errors(points, a, softening, 3);
      CAPTURE(softening, tolerance, e.rms, e.worst);
      CHECK(e.rms <= tolerance);
      CHECK(e.worst <= 10 * tolerance);
      CHECK(imbalance(points, a) <= 1e-14);
    }
  }
}

// Seen to fail with a first pass that knows no softening: what knots of 1e-4 and 1e-6 pull of their own
// bodies without it is so much that a thousandth of the mean was more than any true acceleration. The rms was
// 5 and 8 tolerances at 1e-3, 52 and 270 at 1e-5, and with uneven masses 7 and 8, 68 and 280.
namespace {

/// A uniform sphere of which every second body is in a sphere of radius `size`. If uneven, one in five is a
/// hundred times as heavy, so that bodies at rims are looked at one by one.
template <class S>
auto denseHalf(std::size_t bodies, const S& size, bool uneven) {
  auto points = gravityScene<S>("uniform sphere", bodies);
  for (std::size_t i = 0; i < points.size(); i += 2) {
    points.positions[i] = Vector3<S>(S(0.3), S(0.2), S(0.1)) + size * points.positions[i];
  }
  for (std::size_t i = 0; uneven && i < points.size(); i += 5) {
    points.masses[i] *= S(100);
  }
  return points;
}

}  // namespace

TEST_CASE("softened forces keep the tolerance where half the mass is within the softening length") {
  for (const double size : {1e-2, 1e-4, 1e-6}) {
    for (const bool uneven : {false, true}) {
      const auto points = denseHalf<double>(4000, size, uneven);
      for (const double tolerance : {1e-3, 1e-5}) {
        const auto a = accelerations(points, tolerance, 0.05);
        const Errors e = errors(points, a, 0.05L, 3);
        CAPTURE(size, uneven, tolerance, e.rms, e.worst);
        CHECK(e.rms <= tolerance);
        CHECK(e.worst <= 10 * tolerance);
        CHECK(imbalance(points, a) <= 1e-14);
      }
    }
  }
}

// Seen to fail at a radius of 1e-4 where only errors of the force counted.
TEST_CASE("potential energy errs by less than the tolerance in dense clusters far from each other") {
  for (const double radius : {1e-3, 1e-4, 1e-6}) {
    const CounterRandom place(3);
    const CounterRandom inside(4);
    PointMasses<double> points;
    for (std::size_t i = 0; i < 4000; ++i) {
      const std::size_t cluster = i / 200;
      const Vector3<double> centre = std::cbrt(place.uniform(cluster)) * place.direction(cluster);
      points.positions.push_back(centre + radius * std::cbrt(inside.uniform(i)) * inside.direction(i));
      points.masses.push_back(1.0 / 4000);
    }
    const auto exact = static_cast<double>(bruteGravity(points.positions, points.masses, 1.0, 0.0).potential);
    for (const double tolerance : {1e-3, 1e-6, 1e-8, 1e-10}) {
      CAPTURE(radius, tolerance);
      CHECK_THAT(potential(points, tolerance), WithinRel(exact, tolerance));
    }
  }
}

TEST_CASE("potential energy errs by less than the tolerance") {
  for (const char* name : gravityScenes) {
    const auto points = gravityScene<double>(name, 1000);
    for (const double softening : {0.0, 0.1}) {
      const auto exact =
          static_cast<double>(bruteGravity(points.positions, points.masses, 1.0, softening).potential);
      for (const double tolerance : {1e-2, 1e-5, 1e-8}) {
        CAPTURE(name, softening, tolerance);
        CHECK_THAT(potential(points, tolerance, softening), WithinRel(exact, tolerance));
      }
    }
  }
}

TEST_CASE("the energy of pairs is kept apart from that of softened bodies with themselves") {
  const auto points = randomMasses<double>(300, 96);
  const double softening = 1e-9;  // each body's own m^2 / eps is 1e9 times the energy of its pairs
  const auto exact =
      static_cast<double>(bruteGravity(points.positions, points.masses, 1.0, softening).potential);
  CHECK_THAT(potential(points, 1e-10, softening), WithinRel(exact, 1e-10));
}

#ifndef GRAVEL_TEST_SLOW  // the method of two more scalars
TEST_CASE("float keeps tolerances down to 3e-6, long double down to 1e-12") {
  const auto single = gravityScene<float>("Plummer sphere", 1500);
  for (const float tolerance : {1e-2F, 1e-4F, 3e-6F}) {
    const Errors e = errors(single, accelerations(single, tolerance), 0, 3);
    CAPTURE(tolerance, e.rms);
    CHECK(e.rms <= static_cast<double>(tolerance));
    CHECK(imbalance(single, accelerations(single, tolerance)) <= 1e-6);
  }
  const auto extended = gravityScene<long double>("Plummer sphere", 600);
  for (const long double tolerance : {1e-3L, 1e-9L, 1e-12L}) {
    const Errors e = errors(extended, accelerations(extended, tolerance), 0, 3);
    CAPTURE(tolerance, e.rms);
    CHECK(e.rms <= static_cast<double>(tolerance));
  }
}
#endif

TEMPLATE_TEST_CASE("the same bits for 1, 2, 3 and 8 threads, and for a used object", "",
                   GRAVEL_TEST_TYPES(double, float)) {
  using S = TestType;
  for (const std::string scene : {"Plummer sphere", "nine decades of mass", "dense half"}) {
    CAPTURE(scene);
    const bool dense = scene == "dense half";
    const S softening = dense ? S(0.05) : S(0);
    auto points = dense ? denseHalf<S>(4000, S(1e-4), true) : gravityScene<S>(scene, 3000);
    for (std::size_t i = 0; !dense && i < points.size(); i += 5) {
      points.masses[i] = S(0);
    }
    std::vector<Vector3<S>> alone;
    S energy{};
    {
      const WithThreads one(1);
      alone = accelerations(points, S(1e-4), softening);
      energy = potential(points, S(1e-4), softening);
    }
    FastMultipole<S> used;
    used.setTolerance(S(1e-4));
    for (const int threads : {2, 3, 8}) {
      const WithThreads some(threads);
      std::vector<Vector3<S>> a(points.size());
      used.accelerations(points.positions, points.masses, S(1), softening, a);
      CHECK(a == alone);
      CHECK(used.potentialEnergy(points.positions, points.masses, S(1), softening) == energy);
      const auto other = randomMasses<S>(threads == 3 ? points.size() : 500, 97);  // in another order
      used.accelerations(other.positions, other.masses, S(1), S(0.1), a);
    }
  }
}

TEST_CASE("tracers feel and do not pull, by expansions") {
  auto points = gravityScene<double>("uniform sphere", 1000);
  for (std::size_t i = 0; i < points.size(); i += 2) {
    points.masses[i] = 0.0;
  }
  const auto a = accelerations(points, 1e-5);
  CHECK(errors(points, a).rms <= 1e-5);
  const PointMasses<double> none{points.positions, std::vector<double>(points.size(), 0.0)};
  for (const Vector3<double>& free : accelerations(none, 1e-5)) {
    CHECK(free == Vector3<double>(0, 0, 0));
  }
  CHECK(potential(none, 1e-5) == 0.0);
}

TEST_CASE("none, one and two bodies") {
  CHECK(accelerations(PointMasses<double>{}, 1e-5).empty());
  CHECK(potential(PointMasses<double>{}, 1e-5) == 0.0);
  const PointMasses<double> one{{{1, 2, 3}}, {5.0}};
  CHECK(accelerations(one, 1e-5)[0] == Vector3<double>(0, 0, 0));
  CHECK(potential(one, 1e-5) == 0.0);
  const PointMasses<double> two{{{0, 0, 0}, {2, 0, 0}}, {4.0, 8.0}};
  const auto a = accelerations(two, 1e-5);
  CHECK((a[0] - Vector3<double>(2, 0, 0)).norm() <= 1e-14);
  CHECK((a[1] - Vector3<double>(-1, 0, 0)).norm() <= 1e-14);
  CHECK_THAT(potential(two, 1e-5), WithinRel(-16.0, 1e-14));
}

TEST_CASE("all at one point, on a line, on a plane") {
  PointMasses<double> points{std::vector<Vector3<double>>(200, Vector3<double>(1, 2, 3)),
                             std::vector<double>(200, 1.0)};
  for (const Vector3<double>& a : accelerations(points, 1e-5)) {
    CHECK(a == Vector3<double>(0, 0, 0));
  }
  CHECK(potential(points, 1e-5) == 0.0);
  CHECK_THAT(potential(points, 1e-5, 2.0), WithinRel(-19900 / 2.0, 1e-13));
  for (const int dimensions : {1, 2}) {
    auto flat = randomMasses<double>(1500, 98);
    for (Vector3<double>& x : flat.positions) {
      for (int axis = dimensions; axis < 3; ++axis) {
        x[axis] = 0.25;
      }
    }
    const auto a = accelerations(flat, 1e-4);
    const Errors e = errors(flat, a, 0, 3);
    CAPTURE(dimensions, e.rms);
    CHECK(e.rms <= 1e-4);
    for (const Vector3<double>& x : a) {
      CHECK(std::abs(x[2]) <= 1e-10 * x.norm());
    }
  }
}

TEST_CASE("two clusters a million radii apart, and one body a billion times heavier") {
  auto apart = gravityScene<double>("uniform sphere", 6000);
  for (std::size_t i = 0; i < 3000; ++i) {
    apart.positions[i][1] += 1e6;
  }
  const Errors far = errors(apart, accelerations(apart, 1e-3), 0, 40);
  CAPTURE(far.rms);
  CHECK(far.rms <= 1e-3);
  CHECK(far.rms > 1e-5);

  auto heavy = gravityScene<double>("uniform sphere", 1200);
  heavy.masses[7] = 1e9 * heavy.masses[8];
  const auto a = accelerations(heavy, 1e-6);
  const Errors e = errors(heavy, a, 0, 3);
  CAPTURE(e.rms);
  CHECK(e.rms <= 1e-6);
  CHECK(imbalance(heavy, a) <= 1e-14);
}

TEMPLATE_TEST_CASE("other units change the result by rounding at most", "",
                   GRAVEL_TEST_TYPES(double, float)) {
  using S = TestType;
  const auto points = gravityScene<S>("rubble pile", 500);
  PointMasses<S> other = points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    other.positions[i] *= std::ldexp(S(1), 30);
    other.masses[i] *= std::ldexp(S(1), 60);
  }
  CHECK(accelerations(other, S(1e-4)) == accelerations(points, S(1e-4)));
}

TEMPLATE_TEST_CASE("expansions give every layout the bits of plain vectors", "",
                   GRAVEL_TEST_TYPES(AoSoA<8>, SoA, AoS, AoSoA<4>)) {
  const auto points = gravityScene<double>("Plummer sphere", 500);
  Bodies<double, TestType> bodies;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Body<double> body;
    body.position = points.positions[i];
    body.mass = points.masses[i];
    bodies.add(body);
  }
  FastMultipole<double> sum;
  sum.accelerations(bodies.positions(), bodies.masses(), 1.0, 0.0, bodies.accelerations());
  const auto expected = accelerations(points, 1e-5);
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(bodies[i].acceleration() == expected[i]);
  }
}

TEST_CASE("expansions refuse values that make no force by name") {
  auto points = randomMasses<double>(20, 99);
  points.positions[5][1] = std::nan("");
  CHECK_THROWS_WITH(accelerations(points, 1e-5), ContainsSubstring("position of body 5 in a gravity sum"));
  points = randomMasses<double>(20, 99);
  points.masses[6] = -1.5;
  CHECK_THROWS_WITH(accelerations(points, 1e-5),
                    ContainsSubstring("mass of body 6 in a gravity sum is -1.5"));
  FastMultipole<double> sum;
  CHECK_THROWS_WITH(sum.setTolerance(0.0), ContainsSubstring("gravity tolerance is 0"));
  CHECK(sum.tolerance() == 1e-5);
}

}  // namespace test_fast_multipole
