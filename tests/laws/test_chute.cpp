#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

struct ChuteFlow {
  double speed = 0.0;     ///< mean, in sqrt(g d)
  double last = 0.0;      ///< the same in the second half of the time looked at
  double filling = 0.0;   ///< in the bulk
  double inertial = 0.0;  ///< I = shear d sqrt(rho/P), mean over the bulk
  double spin = 0.0;      ///< of the grains over the shear, the same
  double moved = 0.0;     ///< what the ledger moved by, over what was dissipated
};

/// Grains 1 across, of radii 0.425 to 0.575, on a bottom of grains glued at random, periodic along and
/// across: gravity of size 1 is tilted by `degrees` from the bottom's normal. They begin with Bagnold's
/// profile, which has the speed `atTop`, and are looked at in the second half of the time.
ChuteFlow chute(double degrees, double atTop, double timeStep, double until, std::uint64_t seed) {
  constexpr double length = 6.0;
  constexpr double width = 5.0;
  constexpr int grains = 360;
  const double tilt = degrees * pi<double>() / 180;
  SimulationConfig<double> config = plain(timeStep);
  config.coeffRestitution = 0.5;
  config.coeffFriction = config.coeffStaticFriction = 0.5;
  Space<double> space(config);
  space.setDomain(Domain<double>::periodic({length, width, 1e3}));
  space.setUniformField({std::sin(tilt), 0, -std::cos(tilt)});
  space.addPlane({0, 0, 1}, -1.6);
  scenes::Sequence random(seed);
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 8; ++j) {
      Body<double> glued = ball({length * i / 9 + random.uniform(-0.2, 0.2),
                                 width * j / 8 + random.uniform(-0.2, 0.2), random.uniform(-1.0, -0.5)},
                                {0, 0, 0}, 0.5);
      glued.fixed = true;
      space.addBody(glued);
    }
  }
  const std::size_t fixed = space.n();
  for (int k = 0; k < grains; ++k) {
    const double r = random.uniform(0.425, 0.575);
    const double z = 0.6 + 1.17 * (k / 20);
    const double above = std::max(0.0, 1 - z / 18);
    const Vec place(length * (k % 5) / 5 + random.uniform(0.0, 0.05),
                    width * (k / 5 % 4) / 4 + random.uniform(0.0, 0.1), z);
    space.addBody(ball(place, {atTop * (1 - above * std::sqrt(above)), random.uniform(-0.1, 0.1), 0}, r,
                       8 * r * r * r));
  }
  const double start = space.energyLedger().total();
  constexpr std::size_t slices = 9;  // of 1, from the bottom
  std::vector<double> count(slices);
  std::vector<double> along(slices);
  std::vector<double> turn(slices);
  std::vector<double> volume(slices);
  ChuteFlow flow;
  double speeds[2] = {0, 0};
  const int looks = 60;
  for (int look = 0; look < looks; ++look) {
    space.advanceTo(until * (0.5 + 0.5 * (look + 1) / looks));
    for (std::size_t i = fixed; i < space.n(); ++i) {
      const auto one = space.body(i);
      const double z = one.position()[2];
      const double r = one.radius();
      speeds[look * 2 / looks] += one.velocity()[0] / (grains * looks / 2.0);
      for (std::size_t k = 0; k < slices; ++k) {
        const double low = static_cast<double>(k);
        const auto below = [&](double height) {
          const double u = std::clamp(height - z, -r, r);
          return pi<double>() * (r * r * u - u * u * u / 3);
        };
        volume[k] += (below(low + 1) - below(low)) / (length * width * looks);
        if (z >= low && z < low + 1) {
          count[k] += 1;
          along[k] += one.velocity()[0];
          turn[k] += one.angularVelocity()[1];
        }
      }
    }
  }
  flow.speed = (speeds[0] + speeds[1]) / 2;
  flow.last = speeds[1];
  const EnergyLedger<double> ledger = space.energyLedger();
  flow.moved = (ledger.total() - start) / (ledger.restitution + ledger.friction);
  double above = 0.0;  // what lies above, over the area and the density of a grain
  for (std::size_t i = fixed; i < space.n(); ++i) {
    above += space.body(i).mass() * pi<double>() / 6 / (length * width);
  }
  above -= volume[0] + volume[1] + volume[2];
  for (std::size_t k = 3; k < 8; ++k) {  // two grains off the bottom, two off the top
    const double shear = (along[k + 1] / count[k + 1] - along[k - 1] / count[k - 1]) / 2;
    flow.inertial += shear / std::sqrt((above - volume[k] / 2) * std::cos(tilt)) / 5;
    flow.spin += turn[k] / count[k] / shear / 5;
    flow.filling += volume[k] / 5;
    above -= volume[k];
  }
  return flow;
}

}  // namespace

// Friction by Jop, Forterre & Pouliquen (2006, Nature 441, 727): mu(I) = mu_s + (mu_2 - mu_s)/(1 + I_0/I).
// From their glass beads (0.38, 0.643, 0.279) to simulated spheres (mu_s from 0.36, mu_2 to 0.70, I_0 to
// 0.30) it differs by 0.02 here, and four standard deviations of five seeds (I = 0.160, sd 0.008) are 0.013
// of it: bound at 0.035. Filling by Silbert et al. (2001, Phys. Rev. E 64, 051302): 0.59 at 22 and 0.58 at 24
// degrees, 0.01 less for two more; five seeds 0.565, sd 0.004. Spins are half of the shear; five seeds 0.476,
// sd 0.019. Seen to fail: steps of 0.2 sqrt(d/g) (filling 0.606). Outside by measurement: no friction
// (filling 0.591, no spin, I = 0.249); friction of 0.2, by which grains still creep at 18 degrees (0.036).
// At 18 degrees some slip once more before they stop (one of eight seeds at times 20 to 40); at times 45 to
// 60 the means of twelve seeds are below 5e-5. Deeper flows and steps: docs/theory-time-step.md.
TEST_CASE("Grains flow down a rough chute by mu(I) at 26 degrees, and stop at 18") {
  const ChuteFlow steep = chute(26.0, 3.0, 0.02, 30.0, 1);
  CAPTURE(steep.speed, steep.filling, steep.inertial, steep.spin, steep.moved);
  const double friction = 0.38 + (0.643 - 0.38) / (1 + 0.279 / steep.inertial);
  CHECK_THAT(friction, WithinAbs(std::tan(26 * pi<double>() / 180), 0.035));
  CHECK_THAT(steep.filling, WithinAbs(0.57, 0.02));
  CHECK_THAT(steep.spin, WithinAbs(0.5, 0.1));
  CHECK(std::abs(steep.moved) < 1e-11);
  const ChuteFlow flat = chute(18.0, 0.5, 0.02, 60.0, 1);
  CAPTURE(flat.speed, flat.last, flat.filling);
  CHECK(flat.last < 1e-3);
  CHECK(std::abs(flat.moved) < 1e-11);
}
