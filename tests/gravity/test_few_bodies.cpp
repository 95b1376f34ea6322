#include "support/catch.hpp"
#include <gravel/core/random.hpp>
#include <gravel/gravity/direct_sum.hpp>

#include <limits>

using namespace gravel;
using namespace gravel::test;

namespace {

template <class S>
struct Points {
  std::vector<Vector3<S>> x, a;
  std::vector<S> m;
};

template <class S>
Points<S> cloud(std::size_t n, double size = 1.0) {
  Points<S> points;
  const CounterRandom random(n);
  for (std::size_t i = 0; i < n; ++i) {
    points.x.push_back((size * random.uniform(9 * i, 0.1, 1.0) * random.direction(9 * i + 1)).cast<S>());
    points.m.push_back(i % 5 == 3 ? S(0) : S(random.uniform(9 * i + 7, 0.1, 3.0)));
  }
  points.a.resize(n, Vector3<S>::Constant(S(7)));
  return points;
}

}  // namespace

// Against sums in long double, in the obvious order. Terms of one sign would round by a few ulp.
TEMPLATE_TEST_CASE("The sum over few bodies is right to rounding, for every number of them", "", double,
                   long double) {
  using S = TestType;
  for (std::size_t n = 0; n <= detail::FewBodies<S>::most; ++n) {
    for (const double softening : {0.0, 0.3}) {
      Points<S> p = cloud<S>(n);
      REQUIRE(detail::FewBodies<S>::accelerations(p.x, p.m, S(2.5), S(softening), p.a));
      Vector3<long double> total = Vector3<long double>::Zero();
      long double scale = 0;
      for (std::size_t i = 0; i < n; ++i) {
        Vector3<long double> exact = Vector3<long double>::Zero();
        long double size = 0;
        for (std::size_t j = 0; j < n; ++j) {
          const Vector3<long double> d = (p.x[j] - p.x[i]).template cast<long double>();
          const auto eps = static_cast<long double>(S(softening));
          const long double s = d.squaredNorm() + eps * eps;
          if (j != i) {
            exact += 2.5L * p.m[j] / (s * std::sqrt(s)) * d;
            size += 2.5L * p.m[j] / s;
          }
        }
        CAPTURE(n, i, softening);
        CHECK(static_cast<S>((p.a[i].template cast<long double>() - exact).norm()) <=
              S(8) * std::numeric_limits<S>::epsilon() * static_cast<S>(size));
        total += p.m[i] * p.a[i].template cast<long double>();
        scale += p.m[i] * p.a[i].template cast<long double>().norm();
      }
      CHECK(total.norm() <= 4 * std::numeric_limits<S>::epsilon() * scale);
    }
  }
}

TEST_CASE("The sum over few bodies hands over what it cannot do, and writes nothing") {
  const auto refuses = [](Points<double> p, double G = 1.0, double softening = 0.0) {
    const bool done = detail::FewBodies<double>::accelerations(p.x, p.m, G, softening, p.a);
    for (const Vector3<double>& a : p.a) {
      CHECK(a == Vector3<double>::Constant(7.0));
    }
    return !done;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  CHECK(refuses(cloud<double>(detail::FewBodies<double>::most + 1)));
  CHECK(refuses(cloud<double>(5, 1e60)));
  CHECK(refuses(cloud<double>(5, 1e-60)));
  CHECK(refuses(cloud<double>(5), nan));
  CHECK(refuses(cloud<double>(5), 1.0, -1.0));
  for (std::size_t i = 0; i < 5; ++i) {
    for (const double bad : {nan, inf, -inf}) {
      Points<double> p = cloud<double>(5);
      p.x[i][1] = bad;
      CHECK(refuses(p));
      p = cloud<double>(5);
      p.m[i] = bad;
      CHECK(refuses(p));
    }
    Points<double> p = cloud<double>(5);
    p.m[i] = -1.0;
    CHECK(refuses(p));
    p = cloud<double>(5);
    p.x[i] = p.x[(i + 1) % 5];
    CHECK(refuses(p));
  }
}

// Seen to fail: no pair spoils the sum, so that a place that is no number gave no pull in double, and was
// refused in float.
TEST_CASE("A body alone is refused where it is nowhere, as among others") {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Points<double> p = cloud<double>(1);
    p.x[0][2] = bad;
    CHECK_THROWS_AS(DirectSum<double>().accelerations(p.x, p.m, 1.0, 0.0, p.a), std::invalid_argument);
    p = cloud<double>(1);
    CHECK_THROWS_AS(DirectSum<double>().accelerations(p.x, p.m, 1.0, bad, p.a), std::invalid_argument);
  }
}

// The columns' path for 15 bodies of which one is a tracer far away is that of the other 14, in units of the
// extent.
TEST_CASE("Few bodies and many are the same law") {
  Points<double> few = cloud<double>(detail::FewBodies<double>::most);
  Points<double> more = few;
  more.x.emplace_back(50.0, 0.0, 0.0);
  more.m.push_back(0.0);
  more.a.emplace_back();
  DirectSum<double> sum;
  sum.accelerations(few.x, few.m, 1.0, 0.0, few.a);
  sum.accelerations(more.x, more.m, 1.0, 0.0, more.a);
  for (std::size_t i = 0; i < few.x.size(); ++i) {
    CHECK((few.a[i] - more.a[i]).norm() <= 1e-14 * few.a[i].norm());
  }
}
