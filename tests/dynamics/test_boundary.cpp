#include "support/catch.hpp"
#include <gravel/dynamics/boundary.hpp>

#include <limits>

using namespace gravel;
using namespace gravel::test;

TEMPLATE_TEST_CASE("A plane's normal is made unit and its offset is measured along it", "", float, double,
                   long double) {
  using S = TestType;
  const Plane<S> plane = makePlane<S>({S(0), S(3), S(4)}, S(2.5), MaterialId{3});
  const S ulp = std::numeric_limits<S>::epsilon();
  CHECK(std::abs(plane.normal.norm() - S(1)) <= 2 * ulp);
  CHECK(std::abs(plane.normal[1] - S(0.6L)) <= ulp);
  CHECK(std::abs(plane.normal[2] - S(0.8L)) <= ulp);
  CHECK(plane.offset == S(2.5));
  CHECK(plane.material == MaterialId{3});
}

TEST_CASE("A normal far from the size of 1 is as good as any") {
  for (const double size : {1e-300, 1e-160, 1.0, 1e160, 1e300}) {
    const Plane<double> plane = makePlane<double>({size, -size, 0.0}, 0.0);
    CAPTURE(size);
    CHECK_THAT(plane.normal[0], WithinRel(std::sqrt(0.5), 1e-15));
    CHECK_THAT(plane.normal[1], WithinRel(-std::sqrt(0.5), 1e-15));
  }
}

TEST_CASE("Planes without a direction or with numbers that are none are refused, with what and why") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const auto allowed = ContainsSubstring("finite and not zero");
  CHECK_THROWS_WITH(makePlane<double>({0, 0, 0}, 1.0), ContainsSubstring("normal") && allowed);
  CHECK_THROWS_WITH(makePlane<double>({nan, 0, 1}, 1.0), ContainsSubstring("nan") && allowed);
  CHECK_THROWS_WITH(makePlane<double>({0, -inf, 1}, 1.0), ContainsSubstring("-inf") && allowed);
  CHECK_THROWS_WITH(makePlane<double>({0, 0, 1}, nan),
                    ContainsSubstring("offset of the plane") && ContainsSubstring("nan"));
  CHECK_THROWS_AS(makePlane<double>({0, 0, 1}, inf), std::invalid_argument);
  CHECK_THROWS_AS(makePlane<float>({0, 0, 0}, 1.0F), std::invalid_argument);
}
