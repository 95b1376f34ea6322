// A program written against the reference's class page, with its names and nothing else of gravel's.

#include "support/catch.hpp"
#include "support/space.hpp"
#include <gravel/model.hpp>

#include <optional>
#include <tuple>
#include <type_traits>
#include <vector>

using namespace gravel::test;

/// The fixture that the reference befriends: it may look at private members.
class SpaceTest {
 public:
  static void handleCollision(Model::Space& space, Model::BodyProxy& b1, Model::BodyProxy& b2) {
    space.handleCollision(b1, b2);
  }
  static void initializeBodies(Model::Space& space, std::size_t n, double dens, unsigned int seed) {
    space.initializeBodies(n, dens, seed);
  }
  static void resolveInterpenetration(Model::Space& space, const Model::CollisionContext& ctx) {
    space.resolveInterpenetration(ctx);
  }
  static double getEffectiveMass(Model::Space& space, const Model::CollisionContext& ctx,
                                 const Model::Vector3d& direction_vec) {
    return space.getEffectiveMass(ctx, direction_vec);
  }
  static void logSystemEnergy(Model::Space& space, std::size_t iteration) {
    space.logSystemEnergy(iteration);
  }
  static void buildCollisionGraph(Model::Space& space) { space.buildCollisionGraph(); }
  static void resolveCollisions(Model::Space& space) { space.resolveCollisions(); }
  static void applyGravity(Model::Space& space) { space.applyGravity(); }
  static void updateAdaptiveTimeStep(Model::Space& space) { space.updateAdaptiveTimeStep(); }
  static void applyDamping(Model::Space& space) { space.applyDamping(); }
  static double dt(const Model::Space& space) { return space.dt_; }
  static double previousDt(const Model::Space& space) { return space.previous_dt_; }
  static double lastTotalEnergy(const Model::Space& space) { return space.lastTotalEnergy_; }
  static const std::vector<int>& colors(const Model::Space& space) { return space.colors_; }
  static Model::Bodies& bodies(Model::Space& space) { return space.bodies_; }
};

namespace {

Configuration::SimulationConfig twoBodyConfig(std::size_t bodies = 2) {
  Configuration::SimulationConfig config;
  config.bodyCount = bodies;
  config.G = 0.0;
  config.timeStep = 1e-3;
  return config;
}

/// Two bodies of the random scene, put where a test wants them.
void place(Model::Space& space, std::size_t i, const Model::Vector3d& x, const Model::Vector3d& v, double m,
           double r) {
  Model::BodyProxy body = space.body(i);
  body.position() = x;
  body.velocity() = v;
  body.angularVelocity() = Model::Vector3d(0, 0, 0);
  body.mass() = m;
  body.radius() = r;
}

}  // namespace

TEST_CASE("The reference's members have the reference's types") {
  using Model::Space;
  STATIC_REQUIRE(std::is_default_constructible_v<Space>);
  STATIC_REQUIRE(std::is_constructible_v<Space, const Configuration::SimulationConfig&>);
  STATIC_REQUIRE(!std::is_convertible_v<const Configuration::SimulationConfig&, Space>);  // explicit
  STATIC_REQUIRE(std::is_same_v<decltype(&Space::computeDynamics), void (Space::*)(std::size_t)>);
  STATIC_REQUIRE(std::is_same_v<decltype(std::declval<const Space&>().n()), std::size_t>);
  STATIC_REQUIRE(std::is_same_v<decltype(std::declval<Space&>().body(std::size_t{})), Model::BodyProxy>);
  STATIC_REQUIRE(
      std::is_same_v<decltype(std::declval<const Space&>().body(std::size_t{})), Model::ConstBodyProxy>);
  STATIC_REQUIRE(std::is_same_v<decltype(std::declval<const Space&>().calculateSystemEnergy()),
                                std::tuple<double, double, double>>);
  STATIC_REQUIRE(std::is_same_v<decltype(std::declval<const Space&>().getAllBodyTransforms()),
                                std::tuple<Model::Vector3dVec, Model::QuaterniondVec>>);
  STATIC_REQUIRE(
      std::is_same_v<
          decltype(std::declval<const Space&>().getDataForDisplay()),
          std::tuple<Model::Vector3dVec, Model::QuaterniondVec, Model::Vector3dVec, Model::Vector3dVec>>);
  STATIC_REQUIRE(std::is_same_v<decltype(std::declval<Space&>().getBodiesForTest()), Model::Bodies&>);
  STATIC_REQUIRE(std::is_same_v<decltype(std::declval<Space&>().createCollisionContext(
                                    std::declval<Model::BodyProxy&>(), std::declval<Model::BodyProxy&>())),
                                std::optional<Model::CollisionContext>>);
  STATIC_REQUIRE(std::is_same_v<decltype(std::declval<Space&>().applyRestitutionImpulse(
                                    std::declval<Model::CollisionContext&>())),
                                std::tuple<Model::Vector3d, double, double>>);
  STATIC_REQUIRE(std::is_same_v<decltype(std::declval<Space&>().applyFrictionImpulse(
                                    std::declval<const Model::CollisionContext&>(), 0.0,
                                    std::declval<const Model::Vector3d&>())),
                                Model::Vector3d>);
  STATIC_REQUIRE(std::is_same_v<Model::Vector3d, Eigen::Vector3d>);
  STATIC_REQUIRE(std::is_same_v<Model::Quaterniond, Eigen::Quaterniond>);
  STATIC_REQUIRE(std::is_class_v<Model::KDTree>);
}

TEST_CASE("Every getter returns what its setter was given") {
  Model::Space space;
  CHECK(space.n() == 0);
  space.setG(1.5);
  CHECK(space.getG() == 1.5);
  space.setEpsilon(1e-9);
  CHECK(space.getEpsilon() == 1e-9);
  space.setCoeffRestitution(0.25);
  CHECK(space.getCoeffRestitution() == 0.25);
  space.setCoeffFriction(0.35);
  CHECK(space.getCoeffFriction() == 0.35);
  space.setCoeffStaticFriction(0.45);
  CHECK(space.getCoeffStaticFriction() == 0.45);
  space.setLinearDamping(0.125);
  CHECK(space.getLinearDamping() == 0.125);
  space.setAngularDamping(0.375);
  CHECK(space.getAngularDamping() == 0.375);
  space.setTimeStep(2e-4);
  CHECK(space.getTimeStep() == 2e-4);
  space.setPositionalCorrectionFactor(0.75);
  CHECK(space.getPositionalCorrectionFactor() == 0.75);
  CHECK_FALSE(space.isDiagnosticsEnabled());
  space.setDiagnosticsEnabled(true);
  CHECK(space.isDiagnosticsEnabled());
}

TEST_CASE("A program of the reference runs: random bodies, steps, transforms, energies") {
  Configuration::SimulationConfig config;
  config.bodyCount = 20;
  config.density = 3000.0;
  config.seed = 7;
  config.G = 1e-8;
  Model::Space space(config);
  REQUIRE(space.n() == 20);
  CHECK(space.getBodiesForTest().size() == 20);
  for (std::size_t i = 0; i < 10; ++i) {
    space.computeDynamics(i);
  }
  CHECK(space.getPreviousTimeStep() > 0.0);
  const auto [positions, orientations] = space.getAllBodyTransforms();
  REQUIRE(positions.size() == 20);
  REQUIRE(orientations.size() == 20);
  const auto [x, q, torques, alphas] = space.getDataForDisplay();
  CHECK(x == positions);
  CHECK(q.size() == 20);
  CHECK(torques.size() == 20);
  CHECK(alphas.size() == 20);
  const auto [translational, rotational, potential] = space.calculateSystemEnergy();
  CHECK(translational > 0.0);
  CHECK(rotational > 0.0);
  CHECK(potential < 0.0);
  const Model::Space& view = space;
  const Model::ConstBodyProxy body = view.body(3);
  CHECK(Model::Vector3d(body.position()) == positions[3]);
  CHECK(std::abs(orientations[3].norm() - 1.0) < 1e-15);
  CHECK_THAT(body.mass() / (4.0 / 3 * 3.14159265358979323846 * std::pow(body.radius(), 3)),
             WithinRel(3000.0, 1e-12));
}

TEST_CASE("Equal seeds make equal random bodies, others make others, and none of them touch") {
  Configuration::SimulationConfig config = twoBodyConfig(60);
  config.seed = 5;
  Model::Space one(config);
  Model::Space two(config);
  config.seed = 6;
  Model::Space other(config);
  const auto [x1, q1] = one.getAllBodyTransforms();
  const auto [x2, q2] = two.getAllBodyTransforms();
  const auto [x3, q3] = other.getAllBodyTransforms();
  CHECK(x1 == x2);
  CHECK(x1 != x3);
  for (std::size_t i = 0; i < one.n(); ++i) {
    for (std::size_t j = i + 1; j < one.n(); ++j) {
      Model::BodyProxy b1 = one.body(i);
      Model::BodyProxy b2 = one.body(j);
      CHECK_FALSE(one.createCollisionContext(b1, b2).has_value());
    }
  }
  SpaceTest::initializeBodies(one, 4, 1000.0, 9U);  // adds
  CHECK(one.n() == 64);
}

TEST_CASE("A collision context is empty exactly when the spheres do not overlap") {
  Model::Space space(twoBodyConfig());
  place(space, 0, {0, 0, 0}, {0, 0, 0}, 1.0, 0.5);
  place(space, 1, {0, 0, 1}, {0, 0, 0}, 1.0, 0.5);
  Model::BodyProxy b1 = space.body(0);
  Model::BodyProxy b2 = space.body(1);
  CHECK_FALSE(space.createCollisionContext(b1, b2).has_value());  // they touch: no overlap
  b2.position() = Model::Vector3d(0, 0, std::nextafter(1.0, 0.0));
  CHECK(space.createCollisionContext(b1, b2).has_value());
  b2.position() = Model::Vector3d(0, 0, std::nextafter(1.0, 2.0));
  CHECK_FALSE(space.createCollisionContext(b1, b2).has_value());
  b2.position() = Model::Vector3d(0, 0, 0.75);
  const auto context = space.createCollisionContext(b1, b2);
  REQUIRE(context.has_value());
  CHECK(context->normal == Model::Vector3d(0, 0, 1));  // from body 1 to body 2
  CHECK(context->overlap == 0.25);
  const auto reversed = space.createCollisionContext(b2, b1);
  CHECK(reversed->normal == Model::Vector3d(0, 0, -1));
}

TEST_CASE("The restitution impulse is (1 + e) m* u along the normal on body 2, and is applied") {
  Model::Space space(twoBodyConfig());
  space.setCoeffRestitution(0.5);
  place(space, 0, {0, 0, 0}, {3, 1, 0}, 2.0, 0.5);
  place(space, 1, {0.9, 0, 0}, {-1, 0, 0}, 6.0, 0.5);
  Model::BodyProxy b1 = space.body(0);
  Model::BodyProxy b2 = space.body(1);
  auto context = space.createCollisionContext(b1, b2);
  REQUIRE(context.has_value());
  const auto [impulse, jn, bias] = space.applyRestitutionImpulse(*context);
  CHECK_THAT(jn, WithinRel(1.5 * 1.5 * 4.0, 1e-15));  // m* = 2 * 6 / 8
  CHECK((impulse - Model::Vector3d(9, 0, 0)).norm() < 1e-14);
  CHECK(bias == 0.0);
  CHECK((b1.velocity() - Model::Vector3d(3 - 4.5, 1, 0)).norm() < 1e-15);
  CHECK((b2.velocity() - Model::Vector3d(-1 + 1.5, 0, 0)).norm() < 1e-15);
  // They part now: no second impulse.
  const auto [again, jn2, bias2] = space.applyRestitutionImpulse(*context);
  CHECK(jn2 == 0.0);
  CHECK(again.norm() == 0.0);
  CHECK(bias2 == 0.0);
}

TEST_CASE("The friction impulse sticks within the static cone and slides with the kinetic one") {
  for (const double slip : {0.1, 5.0}) {
    Model::Space space(twoBodyConfig());
    space.setCoeffFriction(0.2);
    space.setCoeffStaticFriction(0.6);
    place(space, 0, {0, 0, 0}, {0, 0, 0}, 1.0, 0.5);
    place(space, 1, {0.999999999, 0, 0}, {-1, slip, 0}, 1.0, 0.5);
    Model::BodyProxy b1 = space.body(0);
    Model::BodyProxy b2 = space.body(1);
    const auto context = space.createCollisionContext(b1, b2);
    const double jn = 0.75;
    const Model::Vector3d jt = space.applyFrictionImpulse(*context, jn, jn * context->normal);
    // Sticking takes (2/7) m* slip with m* = 1/2.
    const double expected = slip < 1.0 ? slip / 7 : 0.2 * jn;
    CAPTURE(slip);
    CHECK_THAT(jt[1], WithinRel(-expected, 1e-8));  // arms are 1e-9 shorter than the radii
    CHECK(std::abs(jt[0]) < 1e-15);
    CHECK_THAT(b2.velocity()[1], WithinRel(slip - expected, 1e-8));
    CHECK_THAT(b1.velocity()[1], WithinRel(expected, 1e-8));
    // Both turn the same way: each by R jt / I = 0.5 jt / (0.4 * 0.25).
    CHECK_THAT(b1.angularVelocity()[2], WithinRel(5 * expected, 1e-8));
    CHECK_THAT(b2.angularVelocity()[2], WithinRel(5 * expected, 1e-8));
    CHECK(space.applyFrictionImpulse(*context, 0.0, Model::Vector3d::Zero()).norm() == 0.0);
  }
}

TEST_CASE("The effective mass is m* along the normal and 2/7 of it across, for spheres that touch") {
  Model::Space space(twoBodyConfig());
  place(space, 0, {0, 0, 0}, {0, 0, 0}, 2.0, 0.5);
  place(space, 1, {0.999999999, 0, 0}, {0, 0, 0}, 6.0, 0.5);
  Model::BodyProxy b1 = space.body(0);
  Model::BodyProxy b2 = space.body(1);
  const auto context = space.createCollisionContext(b1, b2);
  CHECK_THAT(SpaceTest::getEffectiveMass(space, *context, {1, 0, 0}), WithinRel(1.5, 1e-15));
  CHECK_THAT(SpaceTest::getEffectiveMass(space, *context, {0, 1, 0}), WithinRel(1.5 * 2 / 7, 1e-8));
}

TEST_CASE("Interpenetration shrinks by the factor, about the common centre of mass, without velocity") {
  Model::Space space(twoBodyConfig());
  space.setPositionalCorrectionFactor(0.5);
  place(space, 0, {0, 0, 0}, {0, 0, 0}, 1.0, 0.5);
  place(space, 1, {0.8, 0, 0}, {0, 0, 0}, 3.0, 0.5);
  Model::BodyProxy b1 = space.body(0);
  Model::BodyProxy b2 = space.body(1);
  const auto context = space.createCollisionContext(b1, b2);
  SpaceTest::resolveInterpenetration(space, *context);
  CHECK_THAT(b2.position()[0] - b1.position()[0], WithinAbs(0.9, 1e-15));
  CHECK_THAT(b1.position()[0], WithinAbs(-0.075, 1e-15));
  CHECK(b1.velocity().norm() == 0.0);
  CHECK(b2.velocity().norm() == 0.0);
}

TEST_CASE("Handling a collision does all three to a pair that overlaps, and nothing to one that does not") {
  Model::Space space(twoBodyConfig());
  place(space, 0, {0, 0, 0}, {1, 0, 0}, 1.0, 0.5);
  place(space, 1, {0.9, 0, 0}, {-1, 1, 0}, 1.0, 0.5);
  Model::BodyProxy b1 = space.body(0);
  Model::BodyProxy b2 = space.body(1);
  SpaceTest::handleCollision(space, b1, b2);
  CHECK_THAT(b2.velocity()[0] - b1.velocity()[0], WithinAbs(1.0, 1e-15));  // e = 1/2
  CHECK(b2.velocity()[1] < 1.0);                                           // friction
  CHECK(b2.position()[0] - b1.position()[0] > 0.9);
  b2.position() = Model::Vector3d(2, 0, 0);
  b1.velocity() = Model::Vector3d(1, 0, 0);
  SpaceTest::handleCollision(space, b1, b2);
  CHECK(b1.velocity() == Model::Vector3d(1, 0, 0));
}

TEST_CASE("The phases of a step can be called one by one by the fixture") {
  Configuration::SimulationConfig config = twoBodyConfig();
  config.G = 2.0;
  config.linearDamping = 1.0;
  Model::Space space(config);
  place(space, 0, {0, 0, 0}, {1, 0, 0}, 3.0, 0.5);
  place(space, 1, {2, 0, 0}, {0, 0, 0}, 1.0, 0.5);
  SpaceTest::applyGravity(space);
  CHECK_THAT(space.body(0).acceleration()[0], WithinRel(0.5, 1e-15));   // G m2 / r^2
  CHECK_THAT(space.body(1).acceleration()[0], WithinRel(-1.5, 1e-15));  // G m1 / r^2
  space.body(1).position() = Model::Vector3d(0.75, 0, 0);
  SpaceTest::buildCollisionGraph(space);
  CHECK(space.contactCount() == 1);
  CHECK(space.collisionGraph() == std::vector<std::vector<std::size_t>>{{1}, {0}});
  SpaceTest::resolveCollisions(space);
  CHECK(space.body(0).velocity()[0] < space.body(1).velocity()[0]);
  space.computeDynamics(0);
  CHECK(SpaceTest::previousDt(space) == space.getPreviousTimeStep());
  const double before = space.body(1).velocity().norm();
  SpaceTest::applyDamping(space);
  CHECK(space.body(1).velocity().norm() < before);
  SpaceTest::updateAdaptiveTimeStep(space);
  CHECK(SpaceTest::dt(space) == space.getTimeStep());
  CHECK(SpaceTest::lastTotalEnergy(space) == std::numeric_limits<double>::infinity());
  space.setDiagnosticsEnabled(true);
  std::string log;
  space.setLog([&](const char* line) { log += line; });
  SpaceTest::logSystemEnergy(space, 0);
  CHECK(SpaceTest::lastTotalEnergy(space) == space.energyLedger().total());
  CHECK(SpaceTest::bodies(space).size() == 2);
}

TEST_CASE("Neighbours get different colours, the reference's own example included") {
  Model::Space space;
  const std::vector<std::vector<std::size_t>> graph{{1, 2}, {0, 3}, {0}, {1}};
  space.colorGraph(graph);
  REQUIRE(space.colors().size() == 4);
  CHECK(&SpaceTest::colors(space) == &space.colors());
  for (std::size_t i = 0; i < graph.size(); ++i) {
    CHECK(space.colors()[i] >= 0);
    CHECK(space.colors()[i] < 2);  // a path needs two, greedy by index takes two
    for (const std::size_t j : graph[i]) {
      CHECK(space.colors()[i] != space.colors()[j]);
    }
  }
  CHECK_THROWS_AS(space.colorGraph({{7}}), std::invalid_argument);
  space.colorGraph({});
  CHECK(space.colors().empty());
}
