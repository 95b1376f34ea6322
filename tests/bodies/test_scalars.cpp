// Bodies of scalars that are not built in: the archetype with the least of everything, and dual numbers.
#include "cases.hpp"
#include <gravel/core/random.hpp>

#include <unsupported/Eigen/AutoDiff>

using namespace gravel;
using namespace gravel::test;

using Dual = Eigen::AutoDiffScalar<Eigen::Vector2d>;

namespace {

struct WithoutRoot : MinimalReal {
  using MinimalReal::MinimalReal;
  friend void sqrt(const WithoutRoot&) = delete;
};

}  // namespace

static_assert(Real<float> && Real<double> && Real<long double> && Real<MinimalReal> && Real<Dual>);
static_assert(Real<Eigen::AutoDiffScalar<Eigen::VectorXd>>);
static_assert(!Real<int> && !Real<bool> && !Real<char> && !Real<double*> && !Real<const double> &&
              !Real<double&>);
static_assert(!Real<Vector3<double>> && !Real<BodyId> && !Real<WithoutRoot> && !Real<void>);

TEMPLATE_TEST_CASE("scalars: bodies of the least possible scalar work in every layout", "[scalars]", SoA, AoS,
                   AoSoA<8>, MinimalStorage<MinimalReal>, ParticleStorage<MinimalReal>) {
  using S = MinimalReal;
  Case<S, TestType> c;
  auto& bodies = c.bodies;
  Body<S> body;
  body.position = Vector3<S>(S(1), S(2), S(3));
  body.orientation = Quaternion<S>(S(0), S(2), S(0), S(0));
  body.mass = S(4);
  body.radius = S(0.5);
  bodies.add(body);
  body.position.x() = S(10);
  body.inertia = S(0.25);
  bodies.add(body);
  bodies.add(body);
  const std::size_t order[] = {1, 2, 0};
  bodies.reorder(order);
  bodies.remove(BodyId{2});
  REQUIRE(bodies.size() == 2);
  const auto& read = std::as_const(bodies);
  const std::size_t first = bodies.indexOf(BodyId{0});
  const std::size_t second = bodies.indexOf(BodyId{1});
  CHECK(read[first].position().x().inTest() == 1.0);
  CHECK(read[second].position().x().inTest() == 10.0);
  CHECK(read[second].orientation().x().inTest() == 1.0);
  CHECK(read[second].inertia().inTest() == 0.25);
  CHECK(read[second].inverseInertia().inTest() == 4.0);
  CHECK(read[first].inverseMass().inTest() == 0.25);
  CHECK(read[second].load().inertia->inTest() == 0.25);
  bodies.validateAll();

  body.mass = S(-1);
  CHECK(messageOf<std::invalid_argument>([&] { bodies.add(body); }).find("mass of body 3 is ") !=
        std::string::npos);
  body.mass = S(std::numeric_limits<double>::quiet_NaN());
  CHECK_THROWS_AS(bodies.add(body), std::invalid_argument);
  body.mass = S(1);
  body.position.y() = S(std::numeric_limits<double>::infinity());
  CHECK_THROWS_AS(bodies.add(body), std::invalid_argument);
  CHECK(bodies.size() == 2);
}

TEMPLATE_TEST_CASE("scalars: derivatives of dual numbers pass through bodies", "[scalars]", SoA, AoS,
                   AoSoA<8>, MinimalStorage<Dual>) {
  Case<Dual, TestType> c;
  auto& bodies = c.bodies;
  Body<Dual> body;
  body.position.x() = Dual(3.0, 2, 0);
  body.mass = Dual(2.0, 2, 1);
  body.radius = Dual(0.5, Eigen::Vector2d::Zero());
  bodies.add(body);
  body.inertia = Dual(Dual(0.125) * body.mass * body.radius);
  bodies.add(body);
  const auto& read = std::as_const(bodies);
  CHECK(read[0].position().x().value() == 3.0);
  CHECK(read[0].position().x().derivatives() == Eigen::Vector2d(1.0, 0.0));
  const Dual inverse = read[0].inverseMass();
  CHECK(inverse.value() == 0.5);
  CHECK(inverse.derivatives() == Eigen::Vector2d(0.0, -0.25));  // d(1/m)/dm = -1/m^2
  // I = 2/5 m r^2: dI/dm = 0.1 with two roundings.
  const Dual inertia = read[0].inertia();
  CHECK(std::abs(inertia.derivatives()[1] - 0.1) <= 2.0 * std::numeric_limits<double>::epsilon() * 0.1);
  const Dual own = read[1].inertia();
  CHECK(own.value() == 0.125);
  CHECK(own.derivatives() == Eigen::Vector2d(0.0, 0.0625));
  const std::size_t order[] = {1, 0};
  bodies.reorder(order);
  CHECK(read[1].position().x().derivatives() == Eigen::Vector2d(1.0, 0.0));
  body.mass = Dual(-2.5, 2, 1);
  CHECK(messageOf<std::invalid_argument>([&] { bodies.add(body); }) ==
        "gravel: mass of body 2 is -2.5; allowed: finite, >= 0");
}
