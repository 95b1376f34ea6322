#include "oracle/gravity.hpp"
#include "support/catch.hpp"
#include "support/threads.hpp"
#include <gravel/gravity/jerk_sum.hpp>

#include <numeric>

using namespace gravel;
using namespace gravel::test;

namespace {

using Real80 = long double;

/// Points with velocities, in columns; `sources` of them have mass.
template <class S>
struct Scene {
  typename JerkSum<S>::Columns x, v;
  typename JerkSum<S>::Column m;
  std::size_t sources = 0;

  Scene(std::size_t n, std::size_t massive, double length, double speed) : sources(massive) {
    const CounterRandom random(3);
    const auto rows = static_cast<Eigen::Index>(n);
    m.setConstant(rows, S(0));
    for (std::size_t c = 0; c < 3; ++c) {
      x[c].resize(rows);
      v[c].resize(rows);
      for (std::size_t i = 0; i < n; ++i) {
        x[c][static_cast<Eigen::Index>(i)] = S(length * random.uniform(6 * i + c));
        v[c][static_cast<Eigen::Index>(i)] = S(speed * random.normal(6 * i + 3 + c));
      }
    }
    for (std::size_t i = 0; i < massive; ++i) {
      m[static_cast<Eigen::Index>(i)] = S(std::pow(10.0, -3 * random.uniform(999983 * i + 7)));
    }
  }
  std::size_t size() const { return static_cast<std::size_t>(m.size()); }
  Vector3<Real80> at(const typename JerkSum<S>::Columns& c, std::size_t i) const {
    const auto row = static_cast<Eigen::Index>(i);
    return {Real80(c[0][row]), Real80(c[1][row]), Real80(c[2][row])};
  }
};

std::vector<std::uint32_t> firstRows(std::size_t n) {
  std::vector<std::uint32_t> rows(n);
  std::iota(rows.begin(), rows.end(), 0U);
  return rows;
}

template <class S>
struct Result {
  typename JerkSum<S>::Columns a, j;
  typename JerkSum<S>::Column rate_sq;
};

template <class S>
Result<S> evaluate(const Scene<S>& scene, const std::vector<std::uint32_t>& rows, S G, S softening) {
  JerkSum<S> sum;
  sum.setLaw(G, softening);
  sum.begin(scene.x, scene.m, scene.sources);
  Result<S> result;
  for (std::size_t c = 0; c < 3; ++c) {
    result.a[c].setConstant(scene.m.size(), S(0));
    result.j[c].setConstant(scene.m.size(), S(0));
  }
  result.rate_sq.setConstant(scene.m.size(), S(0));
  sum.evaluate(rows, scene.x, scene.v, result.a, result.j);
  CHECK(sum.pairs() == rows.size() * scene.sources);
  sum.rates(rows, scene.x, scene.v, result.rate_sq);
  return result;
}

/// Pair by pair in long double, as the formula is written.
template <class S>
void checkAgainstPairs(const Scene<S>& scene, S G, S softening) {
  const Result<S> result = evaluate(scene, firstRows(scene.size()), G, softening);
  // A term errs by some 10 units of roundoff in w, as much again in (d.u)/s; the sum of n in lanes of at
  // least one walks by four standard deviations, 4 sqrt(n).
  const Real80 bound =
      Real80(std::numeric_limits<S>::epsilon()) / 2 * (24 + 4 * std::sqrt(Real80(scene.sources)));
  for (std::size_t i = 0; i < scene.size(); ++i) {
    Vector3<Real80> a = Vector3<Real80>::Zero();
    Vector3<Real80> j = a;
    Real80 sizeA = 0;
    Real80 sizeJ = 0;
    Real80 fastest = 0;
    Real80 pull = 0;
    for (std::size_t k = 0; k < scene.sources; ++k) {
      const Vector3<Real80> d = scene.at(scene.x, k) - scene.at(scene.x, i);
      const Vector3<Real80> u = scene.at(scene.v, k) - scene.at(scene.v, i);
      const Real80 r = std::hypot(d.norm(), Real80(softening));
      if (k == i) {
        continue;
      }
      const Real80 w = Real80(G) * Real80(scene.m[static_cast<Eigen::Index>(k)]) / r / r / r;
      a += w * d;
      j += w * (u - 3 * (d.dot(u) / r / r) * d);
      sizeA += w * d.norm();
      sizeJ += w * 4 * u.norm();
      pull = std::max(pull, w + Real80(G) * Real80(scene.m[static_cast<Eigen::Index>(i)]) / r / r / r);
      fastest = std::max(fastest, (u / r).squaredNorm());
    }
    const auto row = static_cast<Eigen::Index>(i);
    const Vector3<Real80> errorA(result.a[0][row] - a[0], result.a[1][row] - a[1], result.a[2][row] - a[2]);
    const Vector3<Real80> errorJ(result.j[0][row] - j[0], result.j[1][row] - j[1], result.j[2][row] - j[2]);
    REQUIRE(errorA.norm() <= bound * sizeA);
    REQUIRE(errorJ.norm() <= bound * sizeJ);
    REQUIRE(std::abs(Real80(result.rate_sq[row]) - (pull + fastest)) <= bound * (pull + fastest));
  }
}

}  // namespace

// Seen to fail: the 3 of the jerk as 2; the units of the jerk as those of the acceleration.
TEMPLATE_TEST_CASE("Accelerations, jerks and rates are those of a sum pair by pair", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  for (const std::size_t n : {1U, 2U, 3U, 8U, 61U}) {
    checkAgainstPairs<S>(Scene<S>(n, n, 1.0, 1.0), S(1), S(0));
    checkAgainstPairs<S>(Scene<S>(n + 5, n, 2.0, 0.3), S(3), S(0.2));
    // Metres and seconds in a planetary system; squares of these are out of the range of float.
    checkAgainstPairs<S>(Scene<S>(n, n, 3e20, 3e4), S(1e30), S(0));
  }
}

TEST_CASE("A jerk is the change of the acceleration with time") {
  const Scene<Real80> scene(7, 5, 1.0, 1.0);
  const Real80 h = 1e-6L;
  Scene<Real80> before = scene;
  Scene<Real80> after = scene;
  for (std::size_t c = 0; c < 3; ++c) {
    before.x[c] -= h * scene.v[c];
    after.x[c] += h * scene.v[c];
  }
  const auto rows = firstRows(7);
  for (const Real80 softening : {0.0L, 0.3L}) {
    const auto now = evaluate(scene, rows, 1.0L, softening);
    const auto low = evaluate(before, rows, 1.0L, softening);
    const auto high = evaluate(after, rows, 1.0L, softening);
    for (std::size_t c = 0; c < 3; ++c) {
      // Central differences: h^2 times the crackle, which is some 1e5 where two pass at 0.2 with 1.
      CHECK(((high.a[c] - low.a[c]) / (2 * h) - now.j[c]).abs().maxCoeff() < 1e-6L);
      CHECK(now.j[c].abs().maxCoeff() > 0.1L);
    }
  }
}

TEST_CASE("What a body gets depends neither on which others are asked for nor on the number of threads") {
  const Scene<double> scene(700, 650, 1.0, 1.0);
  const auto all = evaluate(scene, firstRows(700), 1.0, 0.01);
  const auto some = evaluate(scene, {3, 649, 650, 699}, 1.0, 0.01);
  for (const Eigen::Index row : {3, 649, 650, 699}) {
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(all.a[c][row] == some.a[c][row]);
      CHECK(all.j[c][row] == some.j[c][row]);
    }
    CHECK(all.rate_sq[row] == some.rate_sq[row]);
  }
  CHECK(some.a[0][4] == 0.0);
  for (const int threads : {1, 3}) {
    const WithThreads with(threads);
    const auto again = evaluate(scene, firstRows(700), 1.0, 0.01);
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK((all.a[c] == again.a[c]).all());
      CHECK((all.j[c] == again.j[c]).all());
    }
  }
}

TEST_CASE("Points in one place exert nothing on each other and leave the others' sums as they are") {
  Scene<double> scene(3, 3, 1.0, 1.0);
  for (std::size_t c = 0; c < 3; ++c) {
    scene.x[c][1] = scene.x[c][0];
  }
  const auto both = evaluate(scene, firstRows(3), 1.0, 0.0);
  scene.m[1] = 0.0;
  const auto one = evaluate(scene, firstRows(3), 1.0, 0.0);
  for (std::size_t c = 0; c < 3; ++c) {
    CHECK(both.a[c][0] == one.a[c][0]);
    CHECK(both.j[c][0] == one.j[c][0]);
    CHECK(std::isfinite(both.j[c][1]));
  }
}

TEST_CASE("Without G there is nothing to sum, and what is no number is refused") {
  Scene<double> scene(3, 3, 1.0, 1.0);
  const auto none = evaluate(Scene<double>(3, 0, 1.0, 1.0), firstRows(3), 1.0, 0.0);
  CHECK((none.a[0] == 0.0).all());
  JerkSum<double> sum;
  sum.setLaw(0.0, 0.0);
  sum.begin(scene.x, scene.m, 3);
  auto a = scene.x;
  auto j = scene.x;
  sum.evaluate(firstRows(3), scene.x, scene.v, a, j);
  CHECK((a[1] == 0.0).all());
  CHECK((j[2] == 0.0).all());
  CHECK(sum.pairs() == 0);
  sum.setLaw(1.0, -1.0);
  CHECK_THROWS_WITH(sum.begin(scene.x, scene.m, 3), ContainsSubstring("softening"));
  sum.setLaw(1.0, 0.0);
  scene.m[2] = -1.0;
  CHECK_THROWS_WITH(sum.begin(scene.x, scene.m, 3), ContainsSubstring("mass of body 2"));
  scene.x[1][0] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(sum.begin(scene.x, scene.m, 3), ContainsSubstring("position of body 0"));
}
