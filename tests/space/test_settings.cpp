#include "support/catch.hpp"
#include "support/space.hpp"
#include <gravel/space/space.hpp>

#include <limits>
#include <string>
#include <utility>

using namespace gravel;
using namespace gravel::test;

namespace {

const double nan_ = std::numeric_limits<double>::quiet_NaN();
const double inf = std::numeric_limits<double>::infinity();

using Config = SimulationConfig<double>;

}  // namespace

TEST_CASE("Every setter refuses NaN, infinities and what is out of range, and leaves the value as it was") {
  Space<double> space;
  struct Row {
    const char* name;
    void (*set)(Space<double>&, double);
    double (*get)(const Space<double>&);
    double good;
    std::vector<double> bad;
  };
  const Row rows[] = {
      {"G",
       [](auto& s, double x) { s.setG(x); },
       [](const auto& s) { return s.getG(); },
       2.0,
       {-1e-300, -1.0}},
      {"epsilon",
       [](auto& s, double x) { s.setEpsilon(x); },
       [](const auto& s) { return s.getEpsilon(); },
       0.0,
       {-1.0}},
      {"coeffRestitution",
       [](auto& s, double x) { s.setCoeffRestitution(x); },
       [](const auto& s) { return s.getCoeffRestitution(); },
       1.0,
       {-0.1, std::nextafter(1.0, 2.0)}},
      {"coeffFriction",
       [](auto& s, double x) { s.setCoeffFriction(x); },
       [](const auto& s) { return s.getCoeffFriction(); },
       7.0,
       {-0.1}},
      {"coeffStaticFriction",
       [](auto& s, double x) { s.setCoeffStaticFriction(x); },
       [](const auto& s) { return s.getCoeffStaticFriction(); },
       7.0,
       {-0.1}},
      {"tangentialRestitution",
       [](auto& s, double x) { s.setTangentialRestitution(x); },
       [](const auto& s) { return s.getTangentialRestitution(); },
       0.4,
       {-0.1, 1.5}},
      {"restitutionExponent",
       [](auto& s, double x) { s.setRestitutionExponent(x); },
       [](const auto& s) { return s.getRestitutionExponent(); },
       0.25,
       {-0.1, 1.5}},
      {"restitutionSpeed",
       [](auto& s, double x) { s.setRestitutionSpeed(x); },
       [](const auto& s) { return s.getRestitutionSpeed(); },
       7.7e-5,
       {0.0, -0.1}},
      {"rollingFriction",
       [](auto& s, double x) { s.setRollingFriction(x); },
       [](const auto& s) { return s.getRollingFriction(); },
       0.1,
       {-0.1}},
      {"spinningFriction",
       [](auto& s, double x) { s.setSpinningFriction(x); },
       [](const auto& s) { return s.getSpinningFriction(); },
       0.1,
       {-0.1}},
      {"linearDamping",
       [](auto& s, double x) { s.setLinearDamping(x); },
       [](const auto& s) { return s.getLinearDamping(); },
       3.0,
       {-0.1}},
      {"angularDamping",
       [](auto& s, double x) { s.setAngularDamping(x); },
       [](const auto& s) { return s.getAngularDamping(); },
       3.0,
       {-0.1}},
      {"timeStep",
       [](auto& s, double x) { s.setTimeStep(x); },
       [](const auto& s) { return s.getTimeStep(); },
       0.5,
       {0.0, -1e-3}},
      {"positionalCorrectionFactor",
       [](auto& s, double x) { s.setPositionalCorrectionFactor(x); },
       [](const auto& s) { return s.getPositionalCorrectionFactor(); },
       1.0,
       {-0.1, 1.1}},
      {"contactTolerance",
       [](auto& s, double x) { s.setContactTolerance(x); },
       [](const auto& s) { return s.getContactTolerance(); },
       1e-5,
       {0.0, -1e-3, 1.5}},
  };
  for (const Row& row : rows) {
    CAPTURE(row.name);
    row.set(space, row.good);
    CHECK(row.get(space) == row.good);
    std::vector<double> bad = row.bad;
    bad.insert(bad.end(), {nan_, inf, -inf});
    for (const double x : bad) {
      CAPTURE(x);
      // The field, its value as it was written, and what is allowed.
      CHECK_THROWS_WITH(row.set(space, x), ContainsSubstring(row.name) &&
                                               ContainsSubstring(detail::formatReal(x)) &&
                                               ContainsSubstring("allowed"));
      CHECK(row.get(space) == row.good);
    }
  }
}

// Two balls, one on the other, whose tolerance is never met: all sweeps are made that may be.
TEST_CASE("The most contact sweeps can be set between steps, or be left to the number of contacts") {
  Config config;
  config.G = 0.0;
  config.contactTolerance = 1e-100;
  Space<double> space(config);
  space.setUniformField({0, 0, -9.81});
  space.addPlane({0, 0, 1}, 0.0);
  for (int k = 0; k < 2; ++k) {
    Body<double> body;
    body.radius = 0.5;
    body.mass = 1.0 + 1e3 * k;
    body.position = {0, 0, 0.5 + k};
    space.addBody(body);
  }
  const auto sweeps = [&] {
    space.computeDynamics(0);
    return space.contactReport().iterations;
  };
  CHECK(space.getContactIterations() == 0);
  CHECK(sweeps() > 40);
  space.setContactIterations(7);
  CHECK(space.config().contactIterations == 7);
  CHECK(sweeps() <= 14);
}

// Seen to fail: a tolerance that is the least number above zero became zero, which is refused.
TEST_CASE("A solve goes as far as somebody says, or as contacts are few and impulses are remembered") {
  const auto limits = [](std::size_t most, std::size_t contacts, bool remembers, double tolerance = 1e-3) {
    ContactSettings<double> settings;
    settings.tolerance = tolerance;
    limitSweeps(settings, most, contacts, remembers);
    return std::pair(settings.maxIterations, settings.tolerance);
  };
  CHECK(limits(7, 100, true) == std::pair(7, 1e-3));
  CHECK(limits(7, 100, false) == std::pair(7, 1e-3));
  CHECK(limits(std::numeric_limits<std::size_t>::max(), 0, false).first == std::numeric_limits<int>::max());
  CHECK(limits(0, 0, true) == std::pair(1000, 1e-3));
  CHECK(limits(0, 100, true) == std::pair(40, 1e-3));
  CHECK(limits(0, 1'000'000, true) == std::pair(20, 1e-3));
  CHECK(limits(0, 0, false) == std::pair(1000, 1e-5));
  CHECK(limits(0, 10'000, false) == std::pair(100, 1e-5));
  CHECK(limits(0, 1'000'000, false) == std::pair(20, 1e-5));
  const double least = std::numeric_limits<double>::denorm_min();
  CHECK(limits(0, 1, false, least) == std::pair(1000, least));
}

// Seen to fail: refused in the middle of the step, by the name of a setting that nobody made.
TEST_CASE("No limit of sweeps, and a tolerance that is never met, are settings like others") {
  Config config;
  config.G = 0.0;
  config.contactIterations = std::numeric_limits<std::size_t>::max();
  config.contactTolerance = 1e-100;
  Space<double> space(config);
  space.setUniformField({0, 0, -9.81});
  space.addPlane({0, 0, 1}, 0.0);
  for (int k = 0; k < 3; ++k) {
    Body<double> body;
    body.radius = 0.5;
    body.position = {0, 0, 0.5 + k};
    space.addBody(body);
  }
  CHECK_NOTHROW(space.computeDynamics(0));
  CHECK_THAT(space.supportedWeight().residual(), WithinAbs(0.0, 1e-12));
}

TEST_CASE("validate lists every field at fault at once, with value and range") {
  Config config;
  CHECK_NOTHROW(config.validate());
  config.density = 0.0;
  config.G = nan_;
  config.softening = -1.0;
  config.gravityTolerance = 0.0;
  config.timeStep = -inf;
  config.minTimeStep = nan_;
  config.timeStepFactor = 1.5;
  config.epsilon = -1e-9;
  config.coeffRestitution = 1.25;
  config.restitutionThreshold = -2.0;
  config.coeffFriction = -3.0;
  config.coeffStaticFriction = inf;
  config.tangentialRestitution = -4.0;
  config.restitutionExponent = 1.125;
  config.restitutionSpeed = 0.0;
  config.rollingFriction = -8.0;
  config.spinningFriction = -9.0;
  config.linearDamping = -5.0;
  config.angularDamping = -6.0;
  config.positionalCorrectionFactor = 7.0;
  config.contactTolerance = 0.0;
  config.logFrequency = 0;
  config.integrator = static_cast<IntegratorKind>(77);
  config.gravity = static_cast<GravityKind>(78);
  config.broadPhase = static_cast<BroadPhaseKind>(79);
  config.sleepSpeed = 1.0;  // what these may be hangs on the integrator
  config.contactSubsteps = 2;
  std::string message;
  try {
    config.validate();
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  for (const char* expected : {"density is 0;",
                               "G is nan;",
                               "softening is -1;",
                               "gravityTolerance is 0;",
                               "timeStep is -inf;",
                               "minTimeStep is nan;",
                               "timeStepFactor is 1.5;",
                               "epsilon is -1e-09;",
                               "coeffRestitution is 1.25;",
                               "restitutionThreshold is -2;",
                               "coeffFriction is -3;",
                               "coeffStaticFriction is inf;",
                               "tangentialRestitution is -4;",
                               "restitutionExponent is 1.125;",
                               "restitutionSpeed is 0;",
                               "rollingFriction is -8;",
                               "spinningFriction is -9;",
                               "linearDamping is -5;",
                               "angularDamping is -6;",
                               "positionalCorrectionFactor is 7;",
                               "contactTolerance is 0;",
                               "logFrequency is 0;",
                               "integrator is 77;",
                               "gravity is 78;",
                               "broadPhase is 79;",
                               "0 to 1",
                               "finite, >= 0",
                               "finite, > 0"}) {
    CHECK_THAT(message, ContainsSubstring(expected));
  }
  CHECK_THROWS_AS(Space<double>(config), std::invalid_argument);
}

TEST_CASE("Fields that contradict each other are told as well") {
  Config config;
  config.timeStep = 1e-3;
  config.minTimeStep = 2e-3;
  CHECK_THROWS_WITH(config.validate(),
                    ContainsSubstring("minTimeStep is 0.002") && ContainsSubstring("timeStep"));
  config.minTimeStep = 1e-3;
  CHECK_NOTHROW(config.validate());
  // The setter keeps it so.
  Space<double> space(config);
  CHECK_THROWS_AS(space.setTimeStep(1e-4), std::invalid_argument);
  CHECK(space.getTimeStep() == 1e-3);
}

TEST_CASE("A number above zero that is too small is told the least one") {
  Space<double> space{Config{}};
  const double least = std::numeric_limits<double>::min();
  CHECK_THROWS_WITH(space.setTimeStep(least / 2),
                    ContainsSubstring("allowed: finite, > 0, at least 2.2250738585072014e-308"));
  CHECK_NOTHROW(space.setTimeStep(least));
  CHECK_THROWS_WITH(space.setTimeStep(0), ContainsSubstring("finite, > 0") && !ContainsSubstring("at least"));
}

// Seen to fail: minTimeStep compared with steps below zero, too, of which 0 is "at most timeStep" for none.
TEST_CASE("A step below zero is at fault alone") {
  Space<double> space{Config{}};
  CHECK_THROWS_WITH(space.setTimeStep(-1),
                    ContainsSubstring("timeStep is -1;") && !ContainsSubstring("minTimeStep"));
}

TEST_CASE("Every setting is visited once, with a name and a unit") {
  const Config config;
  std::vector<std::string> names;
  forEachSetting(config, [&](const auto& setting, const auto&) {
    CHECK(std::string(setting.unit).size() + std::string(setting.name).size() > 1);
    names.emplace_back(setting.name);
  });
  std::sort(names.begin(), names.end());
  CHECK(std::adjacent_find(names.begin(), names.end()) == names.end());
  CHECK(names.size() >= 26);
}

TEMPLATE_TEST_CASE("A configuration of any scalar has valid defaults", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  const SimulationConfig<TestType> config;
  CHECK_NOTHROW(config.validate());
  Space<TestType> space(config);
  CHECK(space.n() == 0);
  CHECK(space.getTimeStep() == config.timeStep);
}

TEST_CASE("A configuration reads as it is written: designated initialisers") {
  const Config config{.bodyCount = 3, .G = 0.0, .timeStep = 0.25};
  Space<double> space(config);
  CHECK(space.n() == 3);
  CHECK(space.getTimeStep() == 0.25);
  CHECK(space.config().G == 0.0);
}

TEST_CASE("A static coefficient below the kinetic one counts as equal to it") {
  Config config;
  config.G = 0.0;
  config.coeffFriction = 0.5;
  config.coeffStaticFriction = 0.1;
  config.timeStep = 1e-3;
  config.adaptiveTimeStep = false;
  Space<double> space(config);
  space.addPlane({0, 0, 1}, 0.0);
  Body<double> body;
  body.position = {0, 0, 0.499};
  body.velocity = {0, 0, -1};
  body.radius = 0.5;
  space.addBody(body);
  space.computeDynamics(0);
  REQUIRE(space.contactCount() == 1);
  CHECK(space.contacts().material(space.contacts()[0]).staticFriction == 0.5);
  CHECK(space.contacts().material(space.contacts()[0]).kineticFriction == 0.5);
}
