#include "scenes.hpp"
#include "support/archetypes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

TEMPLATE_TEST_CASE("mixing a material with itself gives it back to the bit", "", float, double, long double) {
  const Material<TestType> m{TestType(0.1),   TestType(0.7), TestType(0.3), TestType(1e-30),
                             TestType(0.234), TestType(0.3), TestType(0.7), TestType(1e-3)};
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

namespace {

/// Bridges, Hatzes & Lin 1984: frosty ice spheres at some 200 K, e = (v / 0.0077 cm/s)^-0.234, at most 1.
template <class S>
Material<S> ice() {
  Material<S> material;
  material.restitution = S(1);
  material.restitutionExponent = S(0.234);
  material.restitutionSpeed = S(7.7e-5);
  return material;
}

}  // namespace

TEMPLATE_TEST_CASE("restitution follows Bridges' law of ice: 1 up to 0.0077 cm/s, then falls as v^-0.234", "",
                   float, double, long double) {
  using S = TestType;
  const auto e = [](double v) { return static_cast<double>(restitutionAt<S>(ice<S>(), S(v))); };
  const double eps4 = 4 * static_cast<double>(std::numeric_limits<S>::epsilon());
  CHECK(restitutionAt<S>(ice<S>(), S(0)) == S(1));
  CHECK(restitutionAt<S>(ice<S>(), ice<S>().restitutionSpeed) == S(1));
  // Digits of (v/v_c)^-0.234 from 40-digit arithmetic; v = 0.1, 1 and 100 cm/s. In float the ratio of speeds
  // is rounded, and the exponent carries a quarter of that over, plus its own: 4 ulp.
  CHECK_THAT(e(1e-3), WithinRel(0.54883124736766071813, eps4 + 1e-15));
  CHECK_THAT(e(1e-2), WithinRel(0.32021290434911420631, eps4 + 1e-15));
  CHECK_THAT(e(1.0), WithinRel(0.10900309508838171970, eps4 + 1e-15));
}

TEST_CASE("a scalar with nothing but sqrt has the same law of restitution") {
  // Only the 53 digits of its sqrt: each of the roots and products rounds once, some hundred in all.
  for (const double v : {1e-5, 1e-3, 0.07, 30.0}) {
    CHECK_THAT(restitutionAt<MinimalReal>(ice<MinimalReal>(), MinimalReal(v)).inTest(),
               WithinRel(restitutionAt<double>(ice<double>(), v), 100 * 2.3e-16));
  }
  Material<MinimalReal> steep = ice<MinimalReal>();
  steep.restitutionExponent = MinimalReal(1);
  CHECK(restitutionAt<MinimalReal>(steep, MinimalReal(7.7e-3)).inTest() == 7.7e-5 / 7.7e-3);
}

TEST_CASE("restitution of a pair is the geometric mean of the two functions of speed") {
  const auto a = ice<double>();
  Material<double> steel;  // constant
  steel.restitution = 0.81;
  Material<double> glass;  // another law
  glass.restitution = 0.98;
  glass.restitutionExponent = 0.1;
  glass.restitutionSpeed = 1e-2;
  const auto mean = [](const Material<double>& m1, const Material<double>& m2, double v) {
    return std::sqrt(restitutionAt(m1, v) * restitutionAt(m2, v));
  };
  for (double v = 1e-6; v < 10.0; v *= 1.7) {
    CHECK_THAT(restitutionAt(mix(a, steel), v), WithinRel(mean(a, steel, v), 1e-14));
    CHECK(restitutionAt(mix(a, steel), v) == restitutionAt(mix(steel, a), v));
    const bool between = v > a.restitutionSpeed && v < glass.restitutionSpeed;
    if (!between) {
      CHECK_THAT(restitutionAt(mix(a, glass), v), WithinRel(mean(a, glass, v), 1e-14));
    }
    CHECK(restitutionAt(mix(a, glass), v) <= restitutionAt(mix(a, glass), v / 1.7));
  }
}

// The solver scales speeds that are far from 1 by powers of two; the law must see metres per second. Seen to
// fail: the scaled speed handed to restitutionAt.
TEMPLATE_TEST_CASE("a blow departs with e(v) v, whatever the speed", "", float, double) {
  using S = TestType;
  Material<S> dust = ice<S>();
  dust.kineticFriction = dust.staticFriction = S(0);
  dust.restitutionSpeed = S(1e-20);
  for (const double v : {1e-21, 1e-14, 1e-9, 1e-3, 7.0}) {
    Bodies<S, SoA> bodies;
    Body<S> ball;
    ball.radius = S(0.5);
    ball.velocity = {S(0), S(0), S(-v)};
    ball.position = {S(0), S(0), S(0.5) * (S(1) - 4 * std::numeric_limits<S>::epsilon())};
    bodies.add(ball);
    ContactSolver<S>().solve(contactsOf(bodies, dust, floorAtZero<S>()), bodies, S(1));
    const double e = static_cast<double>(restitutionAt<S>(dust, S(v)));
    CHECK_THAT(static_cast<double>(bodies[0].velocity()[2]) / v,
               WithinRel(e, 4 * static_cast<double>(std::numeric_limits<S>::epsilon())));
  }
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
    CHECK_THROWS_WITH(validate(faulty([&](auto& m) { m.restitutionExponent = bad; }), "the floor"),
                      ContainsSubstring("restitutionExponent of the floor"));
  }
  for (const double bad : {nan, inf, -0.1}) {
    CHECK_THROWS_WITH(validate(faulty([&](auto& m) { m.kineticFriction = bad; }), "the floor"),
                      ContainsSubstring("kineticFriction of the floor"));
    CHECK_THROWS_WITH(validate(faulty([&](auto& m) { m.staticFriction = bad; }), "the floor"),
                      ContainsSubstring("staticFriction of the floor"));
    CHECK_THROWS_WITH(validate(faulty([&](auto& m) { m.rollingFriction = bad; }), "the floor"),
                      ContainsSubstring("rollingFriction of the floor"));
    CHECK_THROWS_WITH(validate(faulty([&](auto& m) { m.spinningFriction = bad; }), "the floor"),
                      ContainsSubstring("spinningFriction of the floor"));
  }
  for (const double bad : {nan, inf, -0.1, 0.0}) {
    CHECK_THROWS_WITH(validate(faulty([&](auto& m) { m.restitutionSpeed = bad; }), "the floor"),
                      ContainsSubstring("restitutionSpeed of the floor") && ContainsSubstring("> 0"));
  }
  CHECK_THROWS_WITH(validate(faulty([](auto& m) { m.staticFriction = 0.2; }), "the floor"),
                    ContainsSubstring("staticFriction of the floor is 0.2") && ContainsSubstring("0.3"));
  CHECK_NOTHROW(validate(faulty([](auto& m) { m.staticFriction = m.kineticFriction = 1e3; }), "rubber"));
}
