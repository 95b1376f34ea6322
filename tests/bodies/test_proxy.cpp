#include "cases.hpp"

using namespace gravel;
using namespace gravel::test;

TEMPLATE_LIST_TEST_CASE("proxy: views write through, by coefficient and by expression", "[proxy]", AllCases) {
  using S = typename TestType::Scalar;
  TestType c;
  c.bodies.add(sampleBody<S>(1));
  c.bodies.add(sampleBody<S>(2));
  const auto body = c.bodies[1];
  const auto& read = std::as_const(c.bodies);

  body.position() = Vector3<S>(S(1), S(2), S(3));
  body.position().y() = S(20);
  body.position() += Vector3<S>(S(1), S(1), S(1));
  body.position() *= S(2);
  CHECK(Vector3<S>(read[1].position()) == Vector3<S>(S(4), S(42), S(8)));
  CHECK(Vector3<S>(read[0].position()) == Vector3<S>(S(1), S(1.25), S(1.5)));

  body.velocity() = body.position().cross(Vector3<S>(S(0), S(0), S(1)));
  CHECK(Vector3<S>(read[1].velocity()) == Vector3<S>(S(42), S(-4), S(0)));

  body.mass() = S(8);
  body.radius() *= S(4);
  CHECK(read[1].mass() == S(8));
  CHECK(read[1].radius() == S(2));

  body.force().setConstant(S(5));
  body.torque().z() = S(6);
  body.acceleration() = body.force() / body.mass();
  body.angularAcceleration().setZero();
  CHECK(read[1].force().sum() == S(15));
  CHECK(Vector3<S>(read[1].torque()) == Vector3<S>(S(0), S(0), S(6)));
  CHECK(read[1].acceleration().x() == S(0.625));
}

TEMPLATE_LIST_TEST_CASE("proxy: an orientation view is a quaternion in place", "[proxy]", AllCases) {
  using S = typename TestType::Scalar;
  TestType c;
  for (int i = 0; i < 3; ++i) {
    c.bodies.add(sampleBody<S>(i + 1));
  }
  const auto body = c.bodies[1];
  const auto& read = std::as_const(c.bodies);
  const Quaternion<S> quarter(S(0.5), S(0.5), S(-0.5), S(0.5));
  const Quaternion<S> half(S(0), S(0), S(0), S(1));

  body.orientation() = quarter;
  CHECK(Quaternion<S>(read[1].orientation()).coeffs() == quarter.coeffs());
  // Products of 0 and 1/2 are exact: the view must give the same as the value. Eigen's packed product read
  // four adjacent coefficients here, and so those of other bodies, in every layout but AoS.
  CHECK((read[1].orientation() * half).coeffs() == (quarter * half).coeffs());
  const Vector3<S> x(S(1), S(0), S(0));
  CHECK(Vector3<S>(read[1].orientation() * x) == Vector3<S>(quarter * x));

  CHECK((half * read[1].orientation()).coeffs() == (half * quarter).coeffs());
  CHECK((c.bodies[1].orientation() * read[1].orientation()).coeffs() == (quarter * quarter).coeffs());
  CHECK(read[1].orientation().conjugate().coeffs() == quarter.conjugate().coeffs());
  CHECK(read[1].orientation().inverse().coeffs() == quarter.inverse().coeffs());
  CHECK(read[1].orientation().toRotationMatrix() == quarter.toRotationMatrix());
  CHECK(read[1].orientation().angularDistance(half) == quarter.angularDistance(half));

  body.orientation() *= half;
  CHECK(Quaternion<S>(read[1].orientation()).coeffs() == (quarter * half).coeffs());
  body.orientation() = c.bodies[0].orientation();
  CHECK(Quaternion<S>(read[1].orientation()).coeffs() == sampleBody<S>(1).orientation.coeffs());
  body.orientation().coeffs() *= S(2);
  CHECK(read[1].orientation().norm() == S(2));
  body.orientation().normalize();
  CHECK(read[1].orientation().norm() == S(1));
  body.orientation().setIdentity();
  CHECK(read[1].orientation().w() == S(1));
  body.orientation().x() = S(0.25);
  CHECK(read[1].orientation().x() == S(0.25));
  for (const std::size_t other : {0U, 2U}) {
    CHECK(Quaternion<S>(read[other].orientation()).coeffs() == sampleBody<S>().orientation.coeffs());
  }
}

TEMPLATE_LIST_TEST_CASE("proxy: columns show and write the same coefficients as proxies", "[proxy]",
                        AllCases) {
  using S = typename TestType::Scalar;
  TestType c;
  for (int i = 0; i < 5; ++i) {
    c.bodies.add(sampleBody<S>(i + 1));
  }
  for (std::size_t i = 0; i < 5; ++i) {
    writeCoded(c.bodies.storage(), i, static_cast<int>(i));
  }
  const auto& read = std::as_const(c.bodies);
  CHECK(read.positions().size() == 5);
  for (std::size_t i = 0; i < 5; ++i) {
    const auto body = read[i];
    CHECK(Vector3<S>(read.positions()[i]) == Vector3<S>(body.position()));
    CHECK(Vector3<S>(read.velocities()[i]) == Vector3<S>(body.velocity()));
    CHECK(Vector3<S>(read.angularVelocities()[i]) == Vector3<S>(body.angularVelocity()));
    CHECK(Quaternion<S>(read.orientations()[i]).coeffs() == Quaternion<S>(body.orientation()).coeffs());
    CHECK(Vector3<S>(read.forces()[i]) == Vector3<S>(body.force()));
    CHECK(Vector3<S>(read.torques()[i]) == Vector3<S>(body.torque()));
    CHECK(Vector3<S>(read.accelerations()[i]) == Vector3<S>(body.acceleration()));
    CHECK(Vector3<S>(read.angularAccelerations()[i]) == Vector3<S>(body.angularAcceleration()));
    CHECK(read.masses()[i] == body.mass());
    CHECK(read.radii()[i] == body.radius());
    CHECK(BodyId{read.ids()[i]} == body.id());
    CHECK(MaterialId{read.materials()[i]} == body.material());
  }
  c.bodies.positions()[2] = Vector3<S>(S(7), S(8), S(9));
  c.bodies.velocities()[2] *= S(0);
  c.bodies.angularVelocities()[2].x() = S(-1);
  c.bodies.orientations()[2] = Quaternion<S>::Identity();
  c.bodies.forces()[2] -= Vector3<S>(c.bodies.forces()[2]);
  c.bodies.torques()[2].setOnes();
  c.bodies.accelerations()[2].setOnes();
  c.bodies.angularAccelerations()[2].setOnes();
  c.bodies.masses()[2] = S(11);
  c.bodies.radii()[2] = S(12);
  c.bodies.inertiaFactors()[2] = S(0.5);
  c.bodies.materials()[2] = 13;
  c.bodies.flags()[2] = 1;
  CHECK(Vector3<S>(read[2].position()) == Vector3<S>(S(7), S(8), S(9)));
  CHECK(read[2].velocity().squaredNorm() == S(0));
  CHECK(read[2].angularVelocity().x() == S(-1));
  CHECK(read[2].orientation().w() == S(1));
  CHECK(read[2].force().squaredNorm() == S(0));
  CHECK(read[2].torque().sum() == S(3));
  CHECK(read[2].acceleration().sum() == S(3));
  CHECK(read[2].angularAcceleration().sum() == S(3));
  CHECK(read[2].mass() == S(11));
  CHECK(read[2].radius() == S(12));
  CHECK(read[2].inertia() == S(0.5) * S(11) * S(144));
  CHECK(read[2].material() == MaterialId{13});
  CHECK(read[2].isFixed());
  CHECK(wrongField(read.storage(), 1, 1) == "");
  CHECK(wrongField(read.storage(), 3, 3) == "");
}

TEMPLATE_LIST_TEST_CASE("proxy: load gives back what store wrote", "[proxy]", AllCases) {
  using S = typename TestType::Scalar;
  TestType c;
  c.bodies.add(sampleBody<S>(1));
  c.bodies.add(sampleBody<S>(2));
  writeCoded(c.bodies.storage(), 1, 3);
  Body<S> in = sampleBody<S>(9);
  in.inertia = S(0.25) * in.mass * in.radius * in.radius;  // powers of two: k is exact
  const Vector3<S> force = c.bodies[1].force();
  const Vector3<S> acceleration = c.bodies[1].acceleration();
  c.bodies[1].store(in);
  const Body<S> out = std::as_const(c.bodies)[1].load();
  CHECK(out.position == in.position);
  CHECK(out.velocity == in.velocity);
  CHECK(out.angularVelocity == in.angularVelocity);
  CHECK(out.orientation.coeffs() == in.orientation.coeffs());
  CHECK(out.mass == in.mass);
  CHECK(out.radius == in.radius);
  CHECK(out.fixed == in.fixed);
  REQUIRE(out.inertia.has_value());
  CHECK(*out.inertia == *in.inertia);
  CHECK(out.material == in.material);
  CHECK(c.bodies[1].id() == BodyId{1});
  CHECK(force.squaredNorm() > S(0));
  CHECK(c.bodies[1].force() == force);
  CHECK(c.bodies[1].acceleration() == acceleration);
  c.bodies[1].clearForces();
  CHECK(c.bodies[1].force().squaredNorm() == S(0));
  CHECK(c.bodies[1].torque().squaredNorm() == S(0));
  CHECK(c.bodies[1].acceleration().squaredNorm() == S(0));
  CHECK(c.bodies[1].angularAcceleration().squaredNorm() == S(0));

  in.inertia.reset();
  c.bodies[1].store(in);
  CHECK_FALSE(c.bodies[1].load().inertia.has_value());
  // 2/5 is rounded once, then two products: 3 roundings of half an epsilon each.
  CHECK(std::abs(c.bodies[1].inertia() - S(0.4L) * in.mass * in.radius * in.radius) <=
        S(2) * std::numeric_limits<S>::epsilon() * c.bodies[1].inertia());
}

TEMPLATE_TEST_CASE("proxy: an inertia is kept where m r^2 itself leaves the scalar's range", "[proxy]", float,
                   double) {
  using S = TestType;
  // m r^2 = 2^(1.5 e) is beyond the largest and below the smallest number; I and I / m / r / r are neither.
  const int e = std::numeric_limits<S>::max_exponent * 3 / 4;
  for (const int sign : {1, -1}) {
    Body<S> body = sampleBody<S>();
    body.mass = std::ldexp(S(1), sign * e);
    body.radius = std::ldexp(S(1), sign * e / 2);
    body.inertia = std::ldexp(S(1), sign * e);
    Bodies<S> bodies;
    bodies.add(body);
    CHECK(bodies[0].inertia() == *body.inertia);  // powers of two: nothing is rounded
    CHECK(bodies[0].load().inertia == body.inertia);
  }
  Body<S> body = sampleBody<S>();
  body.mass = std::ldexp(S(1), -e);
  body.radius = std::ldexp(S(1), -e / 2);
  body.inertia = S(1);  // k itself is too large a number, which is said and not stored
  Bodies<S> bodies;
  CHECK(messageOf<std::invalid_argument>([&] { bodies.add(body); }).find("inertia of body 0") !=
        std::string::npos);
  CHECK(bodies.empty());
}

TEMPLATE_LIST_TEST_CASE("proxy: store refuses a bad body and writes nothing", "[proxy]", AllCases) {
  using S = typename TestType::Scalar;
  TestType c;
  c.bodies.add(sampleBody<S>(1));
  c.bodies.add(sampleBody<S>(2));
  writeCoded(c.bodies.storage(), 1, 4);
  Body<S> bad = sampleBody<S>(3);
  bad.angularVelocity.y() = std::numeric_limits<S>::quiet_NaN();
  CHECK(messageOf<std::invalid_argument>([&] {
          c.bodies[1].store(bad);
        }).find("angularVelocity of body 1 is (") != std::string::npos);
  CHECK(wrongField(c.bodies.storage(), 1, 4) == "");
}

TEMPLATE_LIST_TEST_CASE("proxy: fixed bodies and tracers have no inverse mass", "[proxy]", AllCases) {
  using S = typename TestType::Scalar;
  TestType c;
  Body<S> body = sampleBody<S>(2);
  c.bodies.add(body);
  body.fixed = true;
  c.bodies.add(body);
  Body<S> tracer = sampleBody<S>(3);
  tracer.mass = S(0);
  tracer.radius = S(0);
  c.bodies.add(tracer);
  const auto& read = std::as_const(c.bodies);
  CHECK_FALSE(read[0].isFixed());
  CHECK(read[0].inverseMass() == S(0.25));
  CHECK(read[0].inverseInertia() > S(0));
  CHECK(read[0].inverseInertia() == S(1) / read[0].inertia());
  CHECK(read[1].isFixed());
  CHECK(read[1].mass() == S(4));
  CHECK(read[1].inverseMass() == S(0));
  CHECK(read[1].inverseInertia() == S(0));
  CHECK(read[1].velocity().squaredNorm() == S(0));
  CHECK(read[1].angularVelocity().squaredNorm() == S(0));
  CHECK(read[2].inverseMass() == S(0));
  CHECK(read[2].inverseInertia() == S(0));
  CHECK(Vector3<S>(read[2].velocity()) == tracer.velocity);
  CHECK_FALSE(read[2].load().inertia.has_value());

  c.bodies[0].setFixed(true);
  CHECK(read[0].inverseMass() == S(0));
  CHECK(read[0].velocity().squaredNorm() == S(0));
  CHECK(read[0].angularVelocity().squaredNorm() == S(0));
  CHECK(Vector3<S>(read[0].position()) == body.position);
  c.bodies[0].setFixed(false);
  CHECK(read[0].inverseMass() == S(0.25));
  c.bodies[0].setMaterial(MaterialId{42});
  CHECK(read[0].material() == MaterialId{42});
}

TEMPLATE_TEST_CASE("a loop over bodies meets each once, in their order, and writes through", "", SoA, AoS,
                   AoSoA<4>) {
  Bodies<double, TestType> bodies;
  CHECK(bodies.begin() == bodies.end());
  for (std::size_t i = 0; i < 7; ++i) {
    Body<double> body;
    body.mass = 1.0 + static_cast<double>(i);
    bodies.add(body);
  }
  std::size_t count = 0;
  for (auto body : bodies) {
    CHECK(body.index() == count++);
    body.radius() = 2 * body.mass();
  }
  CHECK(count == 7);
  for (const auto body : std::as_const(bodies)) {
    static_assert(std::is_same_v<decltype(body), const typename Bodies<double, TestType>::ConstProxy>);
    CHECK(body.radius() == 2.0 * static_cast<double>(1 + body.index()));
  }
  static_assert(std::forward_iterator<decltype(bodies.begin())>);
  CHECK(std::count_if(bodies.begin(), bodies.end(), [](auto body) { return body.mass() > 3; }) == 4);
}

// --- static
// ---------------------------------------------------------------------------------------------------

template <class Storage>
constexpr bool proxyRulesHold() {
  using Mutable = BasicBodyProxy<Storage, false>;
  using Const = BasicBodyProxy<Storage, true>;
  static_assert(std::is_trivially_copyable_v<Mutable> && std::is_trivially_copyable_v<Const>);
  static_assert(std::is_copy_constructible_v<Mutable> && std::is_copy_constructible_v<Const>);
  static_assert(!std::is_copy_assignable_v<Mutable> && !std::is_move_assignable_v<Mutable>);
  static_assert(!std::is_copy_assignable_v<Const> && !std::is_assignable_v<Const&, Mutable>);
  static_assert(std::is_convertible_v<Mutable, Const> && !std::is_constructible_v<Mutable, Const>);
  static_assert(sizeof(Mutable) == 2 * sizeof(void*));
  using S = typename Storage::Scalar;
  static_assert(std::is_assignable_v<decltype(std::declval<Mutable>().position()), Vector3<S>>);
  static_assert(std::is_assignable_v<decltype(std::declval<Mutable>().orientation()), Quaternion<S>>);
  static_assert(!std::is_assignable_v<decltype(std::declval<Const>().mass()), S>);
  static_assert(std::is_assignable_v<decltype(std::declval<Mutable>().mass()), S>);
  static_assert(!requires(Const p, Body<S> b) { p.store(b); });
  static_assert(!requires(Const p) { p.setFixed(true); });
  static_assert(!requires(Const p) { p.setMaterial(defaultMaterial); });
  return true;
}
static_assert(proxyRulesHold<StorageOf<float, SoA>>() && proxyRulesHold<StorageOf<double, AoS>>());
static_assert(proxyRulesHold<StorageOf<long double, AoSoA<8>>>() && proxyRulesHold<MinimalStorage<double>>());
static_assert(!std::is_assignable_v<QuaternionView<float>&, double> &&
              std::is_assignable_v<QuaternionView<float>&, Quaternion<float>>);
static_assert(!std::is_assignable_v<ConstQuaternionView<float>&, Quaternion<float>> &&
              !std::is_assignable_v<ConstQuaternionView<float>&, ConstQuaternionView<float>>);
static_assert(proxyRulesHold<ParticleStorage<double>>() && proxyRulesHold<BoundStorage<float>>());

// A grain of gold of a nanometre, whose moment of inertia is 3e-41 kg m^2, and a giant planet of 3.7e42. Seen
// to fail, infinite or NaN for the grain and 0 for the planet: the torque times the inverse of that.
TEMPLATE_TEST_CASE("A torque turns what is too small, or too large, for its moment of inertia to be a number",
                   "", float, double) {
  using S = TestType;
  struct Case {
    double mass, radius, torque;
  };
  for (const Case& c : {Case{8e-23, 1e-9, 1e-30}, Case{1e-5, 1e-3, 1e-9}, Case{1.9e27, 7e7, 1e30}}) {
    Bodies<S> bodies;
    Body<S> body;
    body.mass = S(c.mass);
    body.radius = S(c.radius);
    bodies.add(body);
    const auto at = [&](const Vector3<S>& torque) {
      return Vector3<double>(bodies[0].angularAccelerationBy(torque).template cast<double>());
    };
    const double exact = c.torque / (0.4 * c.mass * c.radius * c.radius);
    CHECK(bodies[0].isTurnable());
    CHECK_THAT(at({S(0), S(0), S(c.torque)})[2], WithinRel(exact, 1e-6));
    CHECK(at({S(0), S(0), S(0)}).isZero(0));
    bodies[0].setFixed(true);
    CHECK_FALSE(bodies[0].isTurnable());
    CHECK(at({S(0), S(0), S(c.torque)}).isZero(0));
  }
  Bodies<S> bodies;
  Body<S> light;
  light.mass = std::numeric_limits<S>::denorm_min();
  bodies.add(light);
  CHECK(bodies[0].accelerationBy(Vector3<S>::Zero()).isZero(0));
  light.mass = S(0);
  bodies.add(light);
  CHECK(bodies[1].accelerationBy(Vector3<S>::Ones()).isZero(0));
  CHECK(bodies[1].angularAccelerationBy(Vector3<S>::Ones()).isZero(0));
}
