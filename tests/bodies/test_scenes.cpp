#include "scenes/scenes.hpp"
#include "support/catch.hpp"

using namespace gravel;

// Seen to fail with clang: the direction was drawn first, with gcc the distance.
TEST_CASE("scenes: a place in a ball is the same with every compiler", "[scenes]") {
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    scenes::Sequence random(seed), alike(seed);
    const Vector3<double> place = random.inBall(2.0);
    const double distance = 2.0 * std::cbrt(alike.uniform());
    CHECK((place - distance * alike.direction()).norm() < 1e-14);
    CHECK(random.uniform() == alike.uniform());
  }
}

// Seen to fail for the exponents of 200: all of them the largest, or none a number.
TEST_CASE("scenes: radii follow their power law whatever the exponent", "[scenes]") {
  const double ratio = GENERATE(1.5, 1e3);
  const double low = GENERATE(1e-3, 1.0, 100.0), exponent = GENERATE(1e-12, 0.5, 3.0, 200.0, 1e5);
  const double high = ratio * low;
  scenes::Sequence random(5), shares(5);
  for (int k = 0; k < 200; ++k) {
    const double radius = scenes::powerLawRadius(random, low, high, exponent);
    CHECK(radius >= low);
    CHECK(radius <= high);
    const double beyond = 1.0 - shares.uniform();  // of all, so many are larger
    const double left = std::pow(ratio, -exponent);
    const double expected = exponent < 1e-6 ? std::pow(ratio, 1.0 - beyond)
                                            : std::pow(left + (1.0 - left) * beyond, -1.0 / exponent);
    CHECK(std::abs(radius / low - expected) < 1e-3 * expected);
  }
}

// Seen to fail: all were made, of cells that were counted beyond all numbers.
TEST_CASE("scenes: what is too wide for its spheres is refused", "[scenes]") {
  const auto withRadius = [](auto options, double radius) {
    options.count = 3;
    options.bodyRadius = {radius, radius};
    return options;
  };
  const scenes::CloudOptions cloud;
  const char* const region = "scene: the region is more than 1e15 of its largest spheres wide";
  CHECK_THROWS_WITH(scenes::rubbleCloud<double>(withRadius(cloud, 1e-20)), region);
  CHECK(scenes::rubbleCloud<double>(withRadius(cloud, 1e-12)).size() == 3);
  CHECK_THROWS_WITH(scenes::Placement(1e-200, 1e200), region);
  const scenes::ColumnOptions column;
  CHECK_THROWS_WITH(scenes::grainColumn<double>(withRadius(column, 1e-12)),
                    "scene: the column is more than 65536 of its largest grains wide");
  CHECK(scenes::grainColumn<double>(withRadius(column, 1e-6)).size() == 3);
}
