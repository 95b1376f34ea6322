#include "support/catch.hpp"
#include "support/space.hpp"
#include "support/temporary_file.hpp"
#include <gravel/gravel.hpp>

using namespace gravel;
using namespace gravel::test;

namespace {

SimulationConfig<double> manyBodies(GravityKind kind) {
  SimulationConfig<double> config;
  config.bodyCount = 300;
  config.G = 1e-3;
  config.gravity = kind;
  config.gravityTolerance = 1e-4;
  config.diagnosticsEnabled = false;
  return config;
}

}  // namespace

TEST_CASE("a space takes the gravity method that it is told, and says so") {
  Space<double> expansions(manyBodies(GravityKind::FastMultipole));
  Space<double> direct(manyBodies(GravityKind::Direct));
  Space<double> automatic(manyBodies(GravityKind::Automatic));
  expansions.computeDynamics(0);
  direct.computeDynamics(0);
  automatic.computeDynamics(0);
  CHECK(std::string(expansions.profiler().entry(Phase::Gravity).method) == "fast multipole method");
  CHECK(std::string(direct.profiler().entry(Phase::Gravity).method) == "direct sum");
  CHECK(std::string(automatic.profiler().entry(Phase::Gravity).method) == "direct sum");
  CHECK(expansions.energyLedger().potential != direct.energyLedger().potential);
  CHECK_THAT(expansions.energyLedger().potential, WithinRel(direct.energyLedger().potential, 1e-4));
}

TEST_CASE("a run by expansions that is taken up again gives the bits of the one that went on") {
  const TemporaryFile file("expansions");
  Space<double> straight(manyBodies(GravityKind::FastMultipole));
  for (std::size_t i = 0; i < 6; ++i) {
    if (i == 3) {
      straight.save(file.path());
    }
    straight.computeDynamics(i);
  }
  Space<double> resumed(manyBodies(GravityKind::Direct));
  resumed.restore(file.path());
  for (std::size_t i = 3; i < 6; ++i) {
    resumed.computeDynamics(i);
  }
  for (std::size_t i = 0; i < straight.n(); ++i) {
    CHECK(resumed.body(i).position() == straight.body(i).position());
    CHECK(resumed.body(i).velocity() == straight.body(i).velocity());
  }
}
