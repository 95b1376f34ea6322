// One blow against the closed forms, by every route through the code: the pure functions, the collision
// context, and the solver, for two spheres, a sphere and a fixed one, and a sphere and a half-space.

#include "scenes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

/// Closed form in long double. An immovable partner has inverse mass 0.
struct ClosedForm {
  Vector3<Wide> v1, v2, w1, w2;
  Wide jn = 0;
  Vector3<Wide> jt = Vector3<Wide>::Zero();
  bool sticks = false;
};

struct Side {
  Vector3<Wide> v, w;
  Wide inverseMass, inverseInertia, arm;
};

ClosedForm closedForm(const Side& a, const Side& b, const Vector3<Wide>& n, Wide e, Wide mu_s, Wide mu_k,
                      Wide b0) {
  ClosedForm out{a.v, b.v, a.w, b.w};
  const Wide u_n = -n.dot(b.v - a.v);
  if (!(u_n > 0)) {
    return out;
  }
  out.jn = (1 + e) * u_n / (a.inverseMass + b.inverseMass);
  const Vector3<Wide> u = b.v - b.arm * b.w.cross(n) - (a.v + a.arm * a.w.cross(n));
  const Vector3<Wide> v_t = u - n.dot(u) * n;
  const Wide k =
      a.inverseMass + b.inverseMass + a.arm * a.arm * a.inverseInertia + b.arm * b.arm * b.inverseInertia;
  const Wide stick = (1 + b0) * v_t.norm() / k;
  out.sticks = stick <= mu_s * out.jn;
  if (v_t.norm() > 0) {
    out.jt = -(out.sticks ? stick : mu_k * out.jn) * v_t.normalized();
  }
  const Vector3<Wide> j = out.jn * n + out.jt;
  out.v1 -= a.inverseMass * j;
  out.v2 += b.inverseMass * j;
  out.w1 -= a.arm * a.inverseInertia * n.cross(j);
  out.w2 -= b.arm * b.inverseInertia * n.cross(j);
  return out;
}

template <class Proxy>
Side sideOf(const Proxy& body, Wide arm) {
  const Wide m = body.mass();
  const Wide moment = Wide(body.inertiaFactor()) * m * Wide(body.radius()) * Wide(body.radius());
  const bool moves = !body.isFixed();
  return {Vector3<Wide>(body.velocity().template cast<Wide>()),
          Vector3<Wide>(body.angularVelocity().template cast<Wide>()), moves ? 1 / m : 0,
          moves ? 1 / moment : 0, arm};
}

template <class S>
void touching(Body<S>& a, Body<S>& b, const CounterRandom& random, std::uint64_t& counter) {
  const Vector3<double> direction = random.direction(counter++);
  const S distance = (a.radius + b.radius) * S(random.uniform(counter++, 0.9, 0.9999));
  a.position.setZero();
  b.position = distance * Vector3<S>(direction.template cast<S>());
}

/// A velocity of size v known to `digits` roundings.
template <class S>
bool near(const Vector3<S>& got, const Vector3<Wide>& expected, Wide scale, Wide digits) {
  return (Vector3<Wide>(got.template cast<Wide>()) - expected).norm() <= digits * Wide(eps<S>) * scale;
}

}  // namespace

TEMPLATE_TEST_CASE(
    "a blow of any two spheres is the closed form to a few roundings, by context and by solver", "",
    GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  const CounterRandom random(11);
  std::uint64_t counter = 0;
  int sticking = 0;
  int sliding = 0;
  for (int trial = 0; trial < 500; ++trial) {
    Body<S> a = randomBody<S>(random, counter);
    Body<S> b = randomBody<S>(random, counter);
    const Material<S> m = randomMaterial<S>(random, counter);
    touching(a, b, random, counter);
    b.fixed = trial % 5 == 0;
    if (trial % 7 == 0) {
      a.inertia = S(0.3) * a.mass * a.radius * a.radius;
    }
    Bodies<S, SoA> byContext;
    byContext.add(a);
    byContext.add(b);
    Bodies<S, SoA> bySolver = byContext;
    auto ctx = makeCollisionContext<S, SoA>(byContext[0], byContext[1], Domain<S>::open(), S(0), S(0));
    REQUIRE(ctx);
    CHECK(std::abs(ctx->arm1 + ctx->arm2 - ctx->distance) <= eps<S> * ctx->distance);
    const Vector3<Wide> n = ctx->normal.template cast<Wide>();
    const ClosedForm expected =
        closedForm(sideOf(byContext[0], ctx->arm1), sideOf(byContext[1], ctx->arm2), n, m.restitution,
                   m.staticFriction, m.kineticFriction, m.tangentialRestitution);
    (expected.sticks ? sticking : sliding) += expected.jn > 0 ? 1 : 0;
    const Totals before(byContext);

    const NormalImpulse<S> normal = applyNormalImpulse(*ctx, m.restitution);
    const Vector3<S> friction = applyFrictionImpulse(*ctx, normal.magnitude, m.staticFriction,
                                                     m.kineticFriction, m.tangentialRestitution);
    const ContactList<S> contacts = contactsOf<S>(bySolver, m);
    REQUIRE(contacts.size() == 1);
    ContactSolver<S> solver;
    const ContactReport<S> report = solver.solve(contacts, bySolver, S(0.01));

    // Some 20 operations, each right to half a unit, on numbers no larger than the fastest surface.
    const Wide speed = 2 * (sideOf(byContext[0], 0).v.norm() + sideOf(byContext[1], 0).v.norm() + 12);
    const Wide impulse = expected.jn + expected.jt.norm();
    for (const Bodies<S, SoA>* after : {&byContext, &bySolver}) {
      const Totals now(*after);
      CHECK(near<S>((*after)[0].velocity(), expected.v1, speed, 8));
      CHECK(near<S>((*after)[1].velocity(), expected.v2, speed, 8));
      CHECK(near<S>((*after)[0].angularVelocity(), expected.w1, speed / Wide(a.radius), 16));
      CHECK(near<S>((*after)[1].angularVelocity(), expected.w2, speed / Wide(b.radius), 16));
      CHECK(now.energy <= before.energy * (1 + 4 * Wide(eps<S>)));
      if (!b.fixed) {
        const Wide scale = now.momentumScale + before.momentumScale;
        CHECK((now.momentum - before.momentum).norm() <= 4 * Wide(eps<S>) * scale);
        CHECK((now.angular - before.angular).norm() <=
              8 * Wide(eps<S>) * (now.angularScale + before.angularScale));
      }
      const Wide lost = before.energy - now.energy;
      CHECK(std::abs(Wide(report.restitutionLoss) + Wide(report.frictionLoss) - lost) <=
            32 * Wide(eps<S>) * before.energy);
    }
    CHECK(std::abs(Wide(normal.magnitude) - expected.jn) <= 16 * Wide(eps<S>) * speed * impulse + eps<S>);
    CHECK(std::abs(Wide(solver.impulses()[0].normal) - Wide(normal.magnitude)) <=
          8 * Wide(eps<S>) * Wide(normal.magnitude));
    CHECK(normal.bias == S(0));
    CHECK(friction.norm() <= m.staticFriction * normal.magnitude * (1 + 8 * eps<S>));
    if (expected.jn > 0) {
      CHECK(report.iterations == 1);
      CHECK(report.residual == S(0));
    }
  }
  CHECK(sticking > 50);
  CHECK(sliding > 50);
}

TEMPLATE_TEST_CASE("a sphere and a half-space: the closed form with an infinite partner", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  const CounterRandom random(12);
  std::uint64_t counter = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Body<S> a = randomBody<S>(random, counter);
    const Material<S> m = randomMaterial<S>(random, counter);
    const Vector3<S> up = detail::safeUnit(Vector3<S>(random.direction(counter++).template cast<S>()));
    a.position = (S(0.99) * a.radius) * up;
    Bodies<S, SoA> bodies;
    bodies.add(a);
    const Side wall{Vector3<Wide>::Zero(), Vector3<Wide>::Zero(), 0, 0, 0};
    const ClosedForm expected =
        closedForm(sideOf(bodies[0], a.radius), wall, -up.template cast<Wide>(), m.restitution,
                   m.staticFriction, m.kineticFriction, m.tangentialRestitution);
    const ContactList<S> contacts = contactsOf<S>(bodies, m, {{up, S(0), {}}});
    REQUIRE(contacts.size() == 1);
    CHECK(contacts[0].key2 == boundaryKey(0));
    ContactSolver<S>().solve(contacts, bodies, S(0.01));
    const Wide speed = 2 * (Wide(a.velocity.norm()) + 6);
    CHECK(near<S>(bodies[0].velocity(), expected.v1, speed, 8));
    CHECK(near<S>(bodies[0].angularVelocity(), expected.w1, speed / Wide(a.radius), 16));
  }
}

TEST_CASE("sticking takes 2/7 (1 + b0) of the reduced mass times the slip for homogeneous spheres") {
  CHECK(tangentialImpulse<double>(2.0 / 7.0, {7, 0, 0}, 1e9, 1, 1, 0.0) == Vector3<double>(-2, 0, 0));
  CHECK(tangentialImpulse<double>(2.0 / 7.0, {0, 7, 0}, 1e9, 1, 1, 0.5) == Vector3<double>(0, -3, 0));
  Bodies<double, SoA> bodies;
  Body<double> ball;
  ball.radius = 0.5;
  ball.mass = 3.0;
  bodies.add(ball);
  ball.position = {1.0 - 1e-15, 0.0, 0.0};
  ball.mass = 6.0;
  bodies.add(ball);
  const auto ctx = makeCollisionContext<double, SoA>(bodies[0], bodies[1], Domain<double>::open(), 0.0, 0.0);
  REQUIRE(ctx);
  CHECK_THAT(effectiveMass(*ctx, ctx->normal), WithinRel(2.0, 1e-15));
  CHECK_THAT(effectiveMass(*ctx, Vector3<double>(0, 1, 0)), WithinRel(4.0 / 7.0, 1e-14));
}

TEST_CASE("between the static and the kinetic limit a contact sticks; beyond the static one it slides") {
  const Vector3<double> within(0.39, 0, 0);
  const Vector3<double> beyond(0.0, 0.41, 0);
  CHECK(clampToCone<double>(within, 1.0, 0.4, 0.3) == within);
  CHECK(clampToCone<double>(beyond, 1.0, 0.4, 0.3) == Vector3<double>(0, 0.3, 0));
  CHECK(clampToCone<double>(beyond, 0.0, 0.4, 0.3) == Vector3<double>::Zero());
}

TEST_CASE("no square overflows or underflows: norms and units of 1e-310 and 1e300") {
  for (const double size : {5e-324, 1e-310, 1e-160, 1.0, 1e160, 1e300}) {
    const Vector3<double> v(3 * size, 0, -4 * size);
    CHECK_THAT(detail::safeNorm(v), WithinRel(5 * size, 1e-14));
    CHECK_THAT(detail::safeUnit(v).norm(), WithinRel(1.0, 4e-16));
    CHECK_THAT(detail::safeUnit(v)[0], WithinRel(0.6, 1e-14));
  }
  CHECK(detail::safeNorm(Vector3<double>(0, 0, 0)) == 0.0);
}
