#include "support/catch.hpp"
#include <gravel/contact/material.hpp>

using namespace gravel;
using namespace gravel::test;

TEMPLATE_TEST_CASE("mixing a material with itself gives it back to the bit", "", float, double, long double) {
  const Material<TestType> m{TestType(0.1), TestType(0.7), TestType(0.3), TestType(1e-30)};
  CHECK(mix(m, m) == m);
}

TEMPLATE_TEST_CASE("a mix is symmetric, the geometric mean, and keeps static above kinetic", "", float,
                   double, long double) {
  using S = TestType;
  const Material<S> a{S(0.25), S(0.9), S(0.9), S(0)};
  const Material<S> b{S(1), S(0.9), S(0.4), S(0.5)};
  const Material<S> pair = mix(a, b);
  CHECK(pair == mix(b, a));
  CHECK(pair.restitution == S(0.5));
  CHECK_THAT(static_cast<double>(pair.kineticFriction), WithinRel(0.6, 1e-6));  // float has 7 digits
  CHECK(pair.tangentialRestitution == S(0));
  CHECK(pair.staticFriction >= pair.kineticFriction);
}

TEST_CASE("a frictionless partner makes a frictionless pair") {
  Material<double> ice;
  ice.kineticFriction = ice.staticFriction = 0.0;
  const Material<double> pair = mix(Material<double>{}, ice);
  CHECK(pair.staticFriction == 0.0);
  CHECK(pair.kineticFriction == 0.0);
}

TEST_CASE("coefficients out of range are refused by name, value and range") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const auto faulty = [](auto change) {
    Material<double> m;
    change(m);
    return m;
  };
  CHECK_NOTHROW(validate(Material<double>{}, "the floor"));
  for (const double bad : {nan, inf, -0.1, 1.5}) {
    CHECK_THROWS_WITH(validate(faulty([&](auto& m) { m.restitution = bad; }), "the floor"),
                      ContainsSubstring("restitution of the floor is ") && ContainsSubstring("0 to 1"));
    CHECK_THROWS_WITH(validate(faulty([&](auto& m) { m.tangentialRestitution = bad; }), "the floor"),
                      ContainsSubstring("tangentialRestitution of the floor"));
  }
  for (const double bad : {nan, inf, -0.1}) {
    CHECK_THROWS_WITH(validate(faulty([&](auto& m) { m.kineticFriction = bad; }), "the floor"),
                      ContainsSubstring("kineticFriction of the floor"));
    CHECK_THROWS_WITH(validate(faulty([&](auto& m) { m.staticFriction = bad; }), "the floor"),
                      ContainsSubstring("staticFriction of the floor"));
  }
  CHECK_THROWS_WITH(validate(faulty([](auto& m) { m.staticFriction = 0.2; }), "the floor"),
                    ContainsSubstring("staticFriction of the floor is 0.2") && ContainsSubstring("0.3"));
  CHECK_NOTHROW(validate(faulty([](auto& m) { m.staticFriction = m.kineticFriction = 1e3; }), "rubber"));
}
