#include "laws/laws.hpp"
#include "support/archetypes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

TEST_CASE("Positions bound from a vector elsewhere are simulated in place") {
  std::vector<Vec> positions{{0, 0, 0}, {3, 0, 0}};
  BoundStorage<double> storage(positions);
  for (std::size_t i = 0; i < 2; ++i) {
    storage.at(fields::Mass{}, i) = 1.0;
    storage.at(fields::Radius{}, i) = 0.5;
  }
  SimulationConfig<double> config = plain(1e-2);
  config.G = 1.0;
  Space<double, BoundStorage<double>> space(config, std::move(storage));
  advance(space, 50);
  CHECK(positions[0][0] > 0.0);
  CHECK_THAT(positions[0][0] + positions[1][0], WithinAbs(3.0, 1e-14));
}
