#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

struct Shape {
  double half = 6.0;   ///< of the floor, in x; grains are about 1 across
  double width = 4.2;  ///< in y, periodic
  int layers = 9;
  double timeStep = 0.1;  ///< in sqrt(diameter/g)
  std::size_t parts = 1;  ///< of a step
};

struct Heap {
  double angle = 0.0;  ///< [deg] of its two flanks
  double speed = 0.0;  ///< rms, in sqrt(g diameter)
};

/// Grains between two walls on a floor of fixed ones, both walls taken away: what falls off the ends of the
/// floor is gone, the rest is a heap at its angle of repose. Lengths in grains, gravity 1.
Heap heapAfterWalls(double friction, double rolling, std::uint64_t seed, const Shape& shape = {}) {
  SimulationConfig<double> config = plain(shape.timeStep);
  config.coeffRestitution = 0.3;
  config.coeffFriction = config.coeffStaticFriction = friction;
  config.rollingFriction = rolling;
  config.contactSubsteps = shape.parts;
  Space<double> space(config);
  space.setUniformField({0, 0, -1});
  space.setDomain(Domain<double>::periodic({1e3, shape.width, 1e3}));
  const std::size_t left = space.addPlane({1, 0, 0}, -shape.half);
  const std::size_t right = space.addPlane({-1, 0, 0}, -shape.half);
  scenes::Sequence random(seed);
  const auto grain = [&](double x, double y, double z, double shift, bool fixed) {
    const double r = random.uniform(0.35, 0.65);
    const Vec place(x + random.uniform(-shift, shift), y + random.uniform(-shift, shift), z);
    Body<double> body = ball(place, {0, 0, 0}, r, 8 * r * r * r);
    body.fixed = fixed;
    if (fixed) {
      body.position[2] -= r + random.uniform(0.0, 0.4);
    }
    space.addBody(body);
  };
  const double apart = 1.4;
  const auto columns = [&](double length) { return static_cast<int>(length / apart + 1e-9); };
  const auto floors = static_cast<int>(std::ceil(2 * shape.half / 0.7));
  for (int i = 0; i < floors; ++i) {
    for (int j = 0; j < 2 * columns(shape.width); ++j) {
      grain(shape.half * ((2 * i + 1.0) / floors - 1.0), 0.7 * j, 0.0, 0.2, true);
    }
  }
  for (int k = 0; k < shape.layers; ++k) {
    for (int i = 0; i < columns(2 * shape.half); ++i) {
      for (int j = 0; j < columns(shape.width); ++j) {
        grain(-shape.half + 0.7 + apart * i, apart * j, 0.7 + apart * k, 0.04, false);
      }
    }
  }
  space.advanceTo(8.0);
  space.removePlane(left);
  space.removePlane(right);
  Heap heap;
  for (int look = 1; look < 92; ++look) {
    space.advanceTo(8.0 + look);
    double energy = 0.0;
    double mass = 0.0;
    for (std::size_t i = 0; i < space.n();) {
      const auto one = space.body(i);
      if (one.position()[2] < -2.0) {
        space.removeBody(one.id());
        continue;
      }
      if (!one.isFixed()) {
        energy += one.mass() * one.velocity().squaredNorm();
        mass += one.mass();
      }
      ++i;
    }
    heap.speed = std::sqrt(energy / mass);
    if (heap.speed < 1e-3) {
      break;
    }
  }
  // Grains in a column of height a - b |x| have their centre of mass at half of it.
  const auto slices = static_cast<std::size_t>(2 * shape.half);
  std::vector<double> mass(slices, 0.0);
  std::vector<double> height(slices, 0.0);
  for (std::size_t i = 0; i < space.n(); ++i) {
    const auto one = space.body(i);
    const double x = one.position()[0] + shape.half;
    if (!one.isFixed() && x >= 0.0 && x < 2 * shape.half) {
      mass[static_cast<std::size_t>(x)] += one.mass();
      height[static_cast<std::size_t>(x)] += 2 * one.mass() * one.position()[2];
    }
  }
  double sum[4] = {0, 0, 0, 0};
  for (std::size_t k = 0; k < slices; ++k) {
    const double x = std::abs(static_cast<double>(k) + 0.5 - shape.half);
    sum[0] += x;
    sum[1] += x * x;
    const double h = mass[k] > 0.0 ? height[k] / mass[k] : 0.0;
    sum[2] += h;
    sum[3] += x * h;
  }
  const auto n = static_cast<double>(slices);
  const double slope = (sum[0] * sum[2] - n * sum[3]) / (n * sum[1] - sum[0] * sum[0]);
  heap.angle = std::atan(slope) * 180 / pi<double>();
  return heap;
}

}  // namespace

// Ten seeds of the rough heap: 28.7 with a standard deviation of 2.2 degrees, so that a median of five has
// one of 1.3; bounds at four of them. Six of the smooth one: 9.4 with 2.6. One heap in ten or twenty does not
// rest by the end, since a last grain still rolls (nothing resists that), so the median is asked. Larger
// heaps, with friction in between: docs/accuracy-and-speed.md. Seen to fail: steps of 0.2 sqrt(d/g), at which
// flanks creep.
TEST_CASE("Grains with friction stand at an angle where smooth ones run off") {
  const Heap smooth = heapAfterWalls(0.0, 0.0, 2);
  std::vector<double> angles;
  std::vector<double> speeds;
  for (std::uint64_t seed = 2; seed < 7; ++seed) {
    const Heap rough = heapAfterWalls(0.6, 0.0, seed);
    angles.push_back(rough.angle);
    speeds.push_back(rough.speed);
  }
  std::sort(angles.begin(), angles.end());
  std::sort(speeds.begin(), speeds.end());
  CAPTURE(smooth.angle, angles, speeds);
  CHECK(speeds[2] < 1e-3);  // they rest
  CHECK(smooth.angle < 20.0);
  CHECK(angles[2] > 23.4);
  CHECK(angles[2] < 34.0);
  CHECK(angles[2] > smooth.angle + 6.0);
}

// Where a grain comes to rest at last hangs on the last bits: of ten heaps two still have one that rolls, so
// the middle one is asked. Seen to fail: one part (2.2e-2 sqrt(g d), 20 degrees).
TEST_CASE("Parts chosen by motion let a heap rest at steps at which its flanks would creep") {
  Shape coarse;
  coarse.timeStep = 0.2;
  coarse.parts = 0;
  std::vector<double> angles;
  std::vector<double> speeds;
  for (std::uint64_t seed = 2; seed < 12; ++seed) {
    const Heap heap = heapAfterWalls(0.3, 0.0, seed, coarse);
    angles.push_back(heap.angle);
    speeds.push_back(heap.speed);
  }
  std::sort(angles.begin(), angles.end());
  std::sort(speeds.begin(), speeds.end());
  CAPTURE(angles, speeds);
  CHECK(speeds[5] < 1e-3);
  CHECK(angles[5] > 23.0);
}
