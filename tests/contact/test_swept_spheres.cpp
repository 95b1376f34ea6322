#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include <gravel/bodies/bodies.hpp>
#include <gravel/contact/impact.hpp>
#include <gravel/contact/swept_spheres.hpp>
#include <gravel/core/random.hpp>

using namespace gravel;

namespace {

struct Flight {
  const Bodies<double>& bodies;
  FlightFromStart<double> course;
  std::vector<HalfSpace<double>> walls;
};

struct FlightOnPlate {
  const Bodies<double>& bodies;
  FlightFromStart<double> course;
  std::vector<HalfSpace<double>> walls;
  struct {
    double a;
    double carried(std::uint32_t i) const { return i == 0 ? a : 0; }
  } support;
};

}  // namespace

// Seen to fail: fixed bodies that stand still in the frame of the others (pairs are missed), and ways of
// bodies as they are (nearly all 19 900 pairs from a common way of 20 on).
TEST_CASE("Swept spheres miss no pair that meets, and what all have in common adds few to look at") {
  const double h = 0.1;
  const auto looked = [&](double common) {
    const CounterRandom random(5);
    Bodies<double> bodies;
    for (std::uint64_t i = 0; i < 200; ++i) {
      Body<double> body;
      body.position = 2 * random.uniform(9 * i, 0.0, 1.0) * random.direction(9 * i + 1);
      body.velocity = Vector3<double>(common / h, 0, 0) +
                      random.uniform(9 * i + 3, 0.0, 2.0) * random.direction(9 * i + 4);
      body.radius = random.uniform(9 * i + 7, 0.02, 0.1);
      body.fixed = i % 50 == 0;
      bodies.add(body);
    }
    const Flight flight{bodies, {h}, {}};
    detail::SweptSpheres<double> swept;
    swept.gather(flight, h);
    std::size_t count = 0;
    std::size_t met = 0;
    for (std::uint32_t i = 0; i < 200; ++i) {
      for (std::uint32_t j = i + 1; j < 200; ++j) {
        const auto velocity = [&](std::size_t k) {
          return k % 50 == 0 ? Vector3<double>(0, 0, 0) : Vector3<double>(bodies.velocities()[k]);
        };
        const Vector3<double> r = bodies.positions()[j] - bodies.positions()[i];
        const Vector3<double> way = h * (velocity(j) - velocity(i));
        const double s = way.squaredNorm() > 0 ? std::clamp(-r.dot(way) / way.squaredNorm(), 0.0, 1.0) : 0.0;
        Vector3<double> seen, drift;
        const bool kept = swept.mayMeet(i, j, Domain<double>::open(), 0.0, h, seen, drift);
        CHECK((seen == r && drift.isZero(0.0)));
        if ((r + s * way).norm() < bodies.radii()[i] + bodies.radii()[j]) {
          ++met;
          CHECK(kept);
        }
        count += kept ? 1U : 0U;
      }
    }
    CHECK(met > 50);
    return count;
  };
  const std::size_t alone = looked(0.0);
  for (const double common : {1.0, 20.0, 1e5}) {
    CAPTURE(common);
    CHECK(looked(common) <= alone + 4 * 200);  // four stand still, and may be met by all
  }
}

// A ball without weight on a plate that speeds up by A goes along x + 2 A t (t - h)/2, which is A h^2/4 off
// its chord in the middle. Seen to fail: A left out, so that what flies past there was not looked at.
TEST_CASE("Swept spheres know how far a plate that speeds up bends the way of what leans on it") {
  const double h = 0.1;
  const double A = 40;
  Bodies<double> bodies;
  Body<double> ball;
  ball.radius = 0.5;
  bodies.add(ball);
  ball.position = {0, 0, -1 - 0.99 * A * h * h / 4};
  bodies.add(ball);
  detail::SweptSpheres<double> swept;
  swept.gather(FlightOnPlate{bodies, {h}, {}, {A}}, h);
  Vector3<double> r, drift;
  CHECK(swept.mayMeet(0, 1, Domain<double>::open(), 0.0, h, r, drift));
  swept.gather(FlightOnPlate{bodies, {h}, {}, {0.9 * A}}, h);
  CHECK_FALSE(swept.mayMeet(0, 1, Domain<double>::open(), 0.0, h, r, drift));
}
