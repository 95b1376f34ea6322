/// One simulated second of a settled pile in gravel, in 60, 30 and 20 steps, beside the same in LAMMPS
/// granular: settles the pile, writes it for LAMMPS, then times gravel on it. No part of LAMMPS is needed to
/// build it; beside_lammps.in is the other half.
///
///   bench_beside_lammps 10000 0 600 pile.data      [bodies] [restitution] [steps to settle] [file]
///   lmp -in beside_lammps.in -var data pile.data -var e 0.05 -log none

#include "boxes.hpp"
#include "stopwatch.hpp"

#include <omp.h>

#include <cstdio>
#include <cstdlib>

namespace {

using namespace boxes;

/// Atoms of style sphere: id, type, diameter, density, place; then velocities and spins.
void write(const char* path, const gravel::Space<double>& space, double width) {
  std::FILE* const file = std::fopen(path, "w");
  if (file == nullptr) {
    std::fprintf(stderr, "cannot write %s\n", path);
    std::exit(1);
  }
  double top = 0;
  for (std::size_t i = 0; i < space.n(); ++i) {
    top = std::max<double>(top, space.body(i).position()[2]);
  }
  std::fprintf(file, "settled pile of spheres\n\n%zu atoms\n1 atom types\n", space.n());
  std::fprintf(file, "%.17g %.17g xlo xhi\n%.17g %.17g ylo yhi\n", -width / 2, width / 2, -width / 2,
               width / 2);
  std::fprintf(file, "0 %.17g zlo zhi\n\nAtoms # sphere\n\n", top + 4 * radius);
  for (std::size_t i = 0; i < space.n(); ++i) {
    const gravel::Body<double> b = space.body(i).load();
    const double volume = 4.0 / 3.0 * gravel::pi<double>() * b.radius * b.radius * b.radius;
    std::fprintf(file, "%zu 1 %.17g %.17g %.17g %.17g %.17g\n", i + 1, 2 * b.radius, b.mass / volume,
                 b.position[0], b.position[1], b.position[2]);
  }
  std::fprintf(file, "\nVelocities\n\n");
  for (std::size_t i = 0; i < space.n(); ++i) {
    const gravel::Body<double> b = space.body(i).load();
    std::fprintf(file, "%zu %.17g %.17g %.17g %.17g %.17g %.17g\n", i + 1, b.velocity[0], b.velocity[1],
                 b.velocity[2], b.angularVelocity[0], b.angularVelocity[1], b.angularVelocity[2]);
  }
  std::fclose(file);
}

}  // namespace

int main(int argc, char** argv) {
  // Options of other benchmarks, "--...", end the list.
  const auto given = [&](int i) { return argc > i && argv[i][0] != '-'; };
  const std::size_t n = given(1) ? std::strtoul(argv[1], nullptr, 10) : 1000;
  const double e = given(2) ? std::strtod(argv[2], nullptr) : 0.0;
  const std::size_t settle = given(3) ? std::strtoul(argv[3], nullptr, 10) : 300;
  omp_set_num_threads(1);
  gravel::SimulationConfig<double> config;
  config.contactTolerance = 1e-2;
  config.contactIterations = 8;
  const Scene scene = pile(n, e);
  gravel::Space<double> space = spaceOf(scene, config);
  std::size_t step = 0;
  while (step < settle) {
    space.computeDynamics(step++);
  }
  if (given(4)) {
    write(argv[4], space, scene.width);
  }
  for (const std::size_t perSecond : {std::size_t{60}, std::size_t{30}, std::size_t{20}}) {
    gravel::Space<double> now = space;
    now.setTimeStep(1.0 / static_cast<double>(perSecond));
    std::vector<double> seconds;
    for (int round = -2; round < 5; ++round) {  // the first two for what another step changes
      const Stopwatch watch;
      for (std::size_t k = 0; k < perSecond; ++k) {
        now.computeDynamics(step++);
      }
      if (round >= 0) {
        seconds.push_back(watch.nanoseconds() / 1e9);
      }
    }
    const Errors errors = errorsOf(now);
    std::printf(
        "gravel, %zu bodies, e = %g: %.3f s for a simulated second (%zu steps; median of 5)\n"
        "overlap/R mean %.1e largest %.1e, kinetic/(N m g R) %.1e, of centres %.1e, weight error %.1e\n",
        n, e, median(seconds), perSecond, errors.meanOverlap, errors.largestOverlap, errors.kinetic,
        errors.moving, now.supportedWeight().residual());
  }
}
