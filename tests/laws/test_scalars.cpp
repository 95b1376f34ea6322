#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/other_spaces.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

/// 30 grains that fall together, with every kind of contact; the state after `steps` in long double.
template <class S>
std::vector<long double> endOf(std::size_t steps) {
  SimulationConfig<S> config = plain<S>(S(1) / S(512));  // the same number in every scalar
  config.G = S(0.5);
  config.coeffRestitution = S(0.5);
  config.coeffFriction = S(0.25);
  config.coeffStaticFriction = S(0.5);
  config.positionalCorrectionFactor = S(0.5);
  Space<S> space(config);
  scenes::CloudOptions options;
  options.count = 30;
  options.radius = 1.0;
  options.bodyRadius = {0.1, 0.2};
  options.density = {1.0, 2.0};
  options.velocityDispersion = 1.0;
  options.bodySpin = 2.0;
  // From float's numbers, so that all scalars begin at the same place.
  for (const Body<float>& from : scenes::rubbleCloud<float>(options)) {
    Body<S> body;
    body.position = from.position.cast<S>();
    body.velocity = from.velocity.cast<S>();
    body.angularVelocity = from.angularVelocity.cast<S>();
    body.mass = S(from.mass);
    body.radius = S(from.radius);
    space.addBody(body);
  }
  std::size_t contacts = 0;
  for (std::size_t i = 0; i < steps; ++i) {
    space.computeDynamics(i);
    contacts += space.contactCount();
  }
  CHECK(contacts > 5);
  std::vector<long double> state;
  for (const S& x : stateOf(space)) {
    state.push_back(static_cast<long double>(x));
  }
  return state;
}

}  // namespace

// Before chaos: some ten blows in all, each of which multiplies a difference by about the way travelled over
// the radius, ten or less. So differences are 1e2 to 1e4 roundings of the coarser scalar.
TEST_CASE("float, double and long double agree within their precision before chaos") {
  const std::vector<long double> fine = endOf<long double>(100);
  const double toDouble = difference(fine, endOf<double>(100));
  const double toFloat = difference(fine, endOf<float>(100));
  CAPTURE(toDouble, toFloat);
  CHECK(toDouble < 1e4 * 1.1e-16);
  CHECK(toDouble > 1e-17);  // they are different computations
  CHECK(toFloat < 1e4 * 6e-8);
  CHECK(toFloat > 1e-9);
}
