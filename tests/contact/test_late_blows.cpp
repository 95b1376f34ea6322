// What blows lack until the forces of the end of their step are known.

#include "support/catch.hpp"
#include <gravel/bodies/bodies.hpp>
#include <gravel/contact/late_blows.hpp>

#include <vector>

using namespace gravel;
using namespace gravel::test;

namespace {

/// Balls of radius 1 in a row along z that touch.
Bodies<double> ballsInARow(const std::vector<double>& masses) {
  Bodies<double> bodies;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    bodies.add({.position = {0, 0, 2.0 * static_cast<double>(i)}, .mass = masses[i], .radius = 1});
  }
  return bodies;
}

/// A blow at speed 1 along z, with restitution 1/2, of an effective mass m.
Impact<double> blow(std::uint32_t first, std::uint32_t second, double time, double m) {
  const double distance = second == staticPartner ? 1.0 : 2.0;
  return {.first = first,
          .second = second,
          .key1 = first,
          .key2 = second,
          .time = time,
          .speed = 1,
          .normal = {0, 0, second == staticPartner ? -1.0 : 1.0},
          .distance = distance,
          .impulse = {1.5 * m, Vector3<double>::Zero(), Vector3<double>::Zero()},
          .rests = false,
          .settle = time};
}

void makeUp(LateBlows<double>& late, Bodies<double>& bodies, std::vector<Impact<double>>& impacts, double h) {
  late.makeUp(
      bodies, Domain<double>::open(), h, h,
      [&](std::size_t k) -> ContactImpulse<double>& { return impacts[k].impulse; },
      [](std::size_t) { return Vector3<double>(0, 0, 0); });
}

}  // namespace

// At the end of a step of 1 s the approach lacks a/4, of which 1 m/s counts. Seen to fail: by all of it
// (impulses of -747 and 753 N s in place of 0 and 6).
TEST_CASE("What is made up of a blow leaves it a push, at most twice as hard") {
  for (const double a : {-1000.0, -4.0, -1.0, 1.0, 4.0, 1000.0}) {
    Bodies<double> bodies = ballsInARow({2});
    std::vector<Impact<double>> impacts{blow(0, staticPartner, 1, 2)};
    LateBlows<double> late;
    late.take(std::span<const Impact<double>>(impacts), bodies, 0.0, 0);
    bodies.accelerations()[0] = Vector3<double>(0, 0, -a);
    makeUp(late, bodies, impacts, 1);
    const double du = std::clamp(a / 4, -1.0, 1.0);
    CAPTURE(a);
    CHECK_THAT(impacts[0].impulse.normal, WithinAbs(3 * (1 + du), 1e-15));
    CHECK_THAT(bodies.velocities()[0][2], WithinAbs(1.5 * du, 1e-15));
  }
}

// A grain between two boulders flies to and fro, and each blow turns round what the one before it made up.
// Seen to fail: every blow made up (3371 m/s in place of 6), as if nothing had come after it.
TEST_CASE("Of a body that is struck again and again in a step the last four blows are made up") {
  Bodies<double> bodies = ballsInARow({1e12, 1, 1e12});
  std::vector<Impact<double>> impacts;
  for (std::uint32_t k = 0; k < 100; ++k) {
    impacts.push_back(blow(k % 2, k % 2 + 1, 0.9 + 1e-3 * k, 1));
  }
  LateBlows<double> late;
  late.take(std::span<const Impact<double>>(impacts), bodies, 0.0, 0);
  bodies.accelerations()[1] = Vector3<double>(0, 0, 100);
  makeUp(late, bodies, impacts, 1);
  CHECK_THAT(bodies.velocities()[1][2], WithinRel(-6.0, 1e-11));
  for (std::size_t k = 0; k + 4 < impacts.size(); ++k) {
    CHECK(impacts[k].impulse.normal == 1.5);
  }
}

// Seen to fail: no blow made up but the last one of either body (of the first two grains nothing is).
TEST_CASE("Grains that strike a boulder one after another in a step are each made up") {
  Bodies<double> bodies = ballsInARow({1e12, 1, 1, 1});
  for (std::uint32_t k = 1; k < 4; ++k) {
    bodies.positions()[k] = Vector3<double>(0, 0, 2);
  }
  std::vector<Impact<double>> impacts{blow(0, 1, 0.8, 1), blow(0, 2, 0.9, 1), blow(0, 3, 1, 1)};
  LateBlows<double> late;
  late.take(std::span<const Impact<double>>(impacts), bodies, 0.0, 0);
  for (std::uint32_t k = 1; k < 4; ++k) {
    bodies.accelerations()[k] = Vector3<double>(0, 0, -1);
  }
  makeUp(late, bodies, impacts, 1);
  for (std::uint32_t k = 1; k < 4; ++k) {
    const double du = (impacts[k - 1].time - 0.5) / 2;
    CHECK_THAT(bodies.velocities()[k][2], WithinRel(1.5 * du, 1e-11));
  }
}
