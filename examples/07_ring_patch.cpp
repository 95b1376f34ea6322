/// A patch of a planet's ring: spheres that go round with the orbit and collide. What one learns: a
/// shear-periodic domain and its integrator, contacts and their impulses as data, and how to measure:
/// velocity dispersion, filling of the central plane, viscosity and the rate of collisions, beside published
/// numbers.
///
/// 07_ring_patch [bodies] [orbits]: settles for so many orbits and measures for as many. 2000 and 20 take
/// about a minute and give the numbers of docs/accuracy-and-speed.md, 500 and 20 about these.

#include "scenes/ring.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>

int main(int argc, char** argv) {
  int count = 150;
  int orbits = 5;
  CLI::App app{"A patch of a planet's ring of two optical depths, measured."};
  app.add_option("bodies", count, "in the patch; default: 150")->check(CLI::Range(100, 1'000'000));
  app.add_option("orbits", orbits, "to settle, and to measure; default: 5")->check(CLI::Range(1, 1'000'000));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  std::printf(
      "depth      c_x    c_y    c_z      c   filling   nu_trans   nu_coll      nu   nu by energy   "
      "hits/orbit\n");
  for (const double depth : {0.5, 1.0}) {
    gravel::scenes::RingOptions options;
    options.count = static_cast<std::size_t>(count);
    options.opticalDepth = depth;
    gravel::Space<double> patch = gravel::scenes::ringPatch(options);
    const auto steps = static_cast<std::size_t>(orbits) * 500;
    for (std::size_t i = 0; i < steps; ++i) {
      patch.computeDynamics(i);
    }
    const double lostBefore = patch.energyLedger().restitution;
    gravel::scenes::RingStatistics ring;
    for (std::size_t i = 0; i < steps; ++i) {
      patch.computeDynamics(i);
      ring.sample(patch);
    }
    // What collisions take is what viscosity brings: (9/4) nu Omega^2 a unit of mass and time.
    const double lost = patch.energyLedger().restitution - lostBefore;
    const double byEnergy = 4.0 / 9.0 * lost / ring.time() / patch.conserved().mass;
    const auto c = ring.dispersion();
    std::printf("  %.1f   %6.3f %6.3f %6.3f %6.3f   %7.4f   %8.3f   %7.3f   %5.3f   %12.3f   %10.2f\n", depth,
                c[0], c[1], c[2], ring.c(), ring.filling(), ring.translationalViscosity(),
                ring.collisionalViscosity(), ring.viscosity(), byEnergy, ring.hits());
  }
  std::printf("\nOther codes, from runs of 500 and more bodies over 20 orbits:\n");
  std::printf(
      "  0.5    2.14   1.20   1.44   1.64     .140       .435      .356    .790                        "
      "9.70\n");
  std::printf(
      "  1.0                         1.31     .258                        1.196                       "
      "21.5\n");
}
