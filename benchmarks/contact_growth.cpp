/// How the cost of contacts grows: time and memory of heaps from 1e3 bodies on, and of one large sphere on a
/// bed of small ones, with the errors beside them.
///
///   layers   8 layers of equal spheres, each in the hollows of the one below, between walls: the wider, the
///   more;
///            from the places of rest, 40 steps before any is timed
///   morton   the same, bodies sorted along a Morton curve (`Space::reorderBodies`)
///   mix      radii 1 : 100, masses 1 : 1e6, dropped
///   dropped  the pile that the other comparisons use
///
/// ns/contact: processor time of a step over contacts. ns/sweep: that part of it which solves contacts (share
/// by the profiler), over contacts and sweeps. B/body: what malloc gave out for a space of as many bodies far
/// from each other, after two steps; B/contact: the rest, over contacts, candidate pairs included (glibc;
/// vectors that have grown count with what they hold in reserve).
///
///   bench_contact_growth [fewest bodies] [most bodies] [steps to settle of mix and dropped] [bodies dropped]

#include "boxes.hpp"
#include "stopwatch.hpp"

#include <malloc.h>
#include <omp.h>

#include <cstdio>
#include <cstdlib>

namespace {

using namespace boxes;

gravel::SimulationConfig<double> config() {
  gravel::SimulationConfig<double> config;
  config.contactTolerance = 1e-2;
  config.contactIterations = 4;
  return config;
}

double bytesInUse() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

/// Even layers hold side x side spheres, odd ones one less a side.
Scene layers(std::size_t bodies) {
  constexpr std::size_t high = 8;
  Scene scene;
  scene.g = g;
  scene.mu = 0.5;
  const auto side = static_cast<std::size_t>(std::sqrt(static_cast<double>(bodies) / high) + 1);
  const double a = 2.04 * radius;
  const double rise = std::sqrt(4 * radius * radius - a * a / 2);
  scene.width = static_cast<double>(side - 1) * a + 2 * radius;
  gravel::Body<double> grain;
  grain.radius = radius;
  grain.mass = 1;
  for (std::size_t k = 0; k < high; ++k) {
    const std::size_t n = side - k % 2;
    const auto at = [&](std::size_t i) {
      return (static_cast<double>(i) - static_cast<double>(n - 1) / 2) * a;
    };
    for (std::size_t i = 0; i < n * n; ++i) {
      grain.position = {at(i % n), at(i / n), radius + static_cast<double>(k) * rise};
      scene.bodies.push_back(grain);
    }
  }
  return scene;
}

/// Three layers of small spheres, and the large one above.
Scene mix() {
  constexpr double ratio = 100;
  Scene scene = pile(1, 0);
  gravel::Body<double> grain = scene.bodies[0];
  scene.bodies.clear();
  constexpr std::size_t side = 93;
  const double a = 2.2 * radius;
  scene.width = side * a + 2 * radius;
  const gravel::CounterRandom random(1);
  for (std::size_t i = 0; i < 3 * side * side; ++i) {
    const auto at = [&](std::size_t k, std::uint64_t axis) {
      return (static_cast<double>(k) - (side - 1) / 2.0) * a + random.uniform(3 * i + axis, -0.04, 0.04);
    };
    grain.position = {at(i % side, 0), at(i / side % side, 1),
                      radius * (1.1 + 2.2 * static_cast<double>(i / (side * side)))};
    scene.bodies.push_back(grain);
  }
  grain.radius = ratio * radius;
  grain.mass = ratio * ratio * ratio;
  grain.position = {0, 0, (8 + ratio) * radius};
  scene.bodies.push_back(grain);
  return scene;
}

void measure(const char* name, gravel::Space<double>& space, std::size_t& step, std::size_t steps,
             double perBody, double perContact) {
  const auto seconds = [&](gravel::Phase phase) { return space.profiler().entry(phase).seconds; };
  std::vector<double> before;
  for (std::size_t p = 0; p < gravel::phaseCount; ++p) {
    before.push_back(seconds(static_cast<gravel::Phase>(p)));
  }
  double contacts = 0;
  double sweeps = 0;
  const Stopwatch watch;
  for (std::size_t k = 0; k < steps; ++k) {
    space.computeDynamics(step++);
    contacts += static_cast<double>(space.contacts().size());
    sweeps +=
        static_cast<double>(space.contactReport().iterations) * static_cast<double>(space.contacts().size());
  }
  const double spent = watch.nanoseconds();
  std::vector<double> share;
  double all = 0;
  for (std::size_t p = 0; p < gravel::phaseCount; ++p) {
    share.push_back(seconds(static_cast<gravel::Phase>(p)) - before[p]);
    all += share.back();
  }
  const double solving = share[static_cast<std::size_t>(gravel::Phase::ContactSolve)] / all;
  const Errors errors = errorsOf(space);
  std::printf("%-8s%9zu%9.0f%8zu%11.2f%11.0f%9.1f%11.1e%9.1e%9.1e%9.1e%8.0f%10.0f\n", name, space.n(),
              contacts / static_cast<double>(steps), space.contactReport().colours,
              spent / 1e6 / static_cast<double>(steps), spent / contacts, solving * spent / sweeps,
              errors.meanOverlap, errors.largestOverlap, errors.kinetic, space.supportedWeight().residual(),
              perBody, perContact);
  std::printf("        ");
  for (std::size_t p = 0; p < gravel::phaseCount; ++p) {
    if (share[p] > 0.005 * all) {
      std::printf(" %s %.0f%%", gravel::phaseName(static_cast<gravel::Phase>(p)), 100 * share[p] / all);
    }
  }
  std::printf("\n");
  std::fflush(stdout);
}

void run(const char* name, const Scene& scene, std::size_t settle, std::size_t steps, bool reorder) {
  double perBody = 0;
  {
    Scene apart = scene;
    apart.g = 0;
    for (gravel::Body<double>& b : apart.bodies) {
      b.position *= 100;
      b.position[2] += 1000;
    }
    apart.width *= 200;
    const double start = bytesInUse();
    gravel::Space<double> space = spaceOf(apart, config());
    space.computeDynamics(0);
    space.computeDynamics(1);
    perBody = (bytesInUse() - start) / static_cast<double>(space.n());
  }
  const double start = bytesInUse();
  gravel::Space<double> space = spaceOf(scene, config());
  std::size_t step = 0;
  while (step < settle) {
    space.computeDynamics(step++);
  }
  const double bodies = static_cast<double>(space.n());
  const double perContact = (bytesInUse() - start - perBody * bodies) /
                            static_cast<double>(std::max<std::size_t>(1, space.contacts().size()));
  measure(name, space, step, steps, perBody, perContact);
  if (reorder) {
    space.reorderBodies();
    for (int k = 0; k < 3; ++k) {
      space.computeDynamics(step++);
    }
    measure("morton", space, step, steps, perBody, perContact);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int i, std::size_t otherwise) {
    return boxes::argument(argc, argv, i, otherwise, 0);
  };
  omp_set_num_threads(1);
  const std::size_t fewest = std::max<std::size_t>(1, argument(1, 1000));
  const std::size_t most = argument(2, 1000);
  const std::size_t settle = argument(3, 0);
  const std::size_t dropped = argument(4, 0);
  std::printf("%-8s%9s%9s%8s%11s%11s%9s%11s%9s%9s%9s%8s%10s\n", "scene", "bodies", "contacts", "colours",
              "ms/step", "ns/contact", "ns/sweep", "overlap/R", "largest", "KE/NmgR", "weight", "B/body",
              "B/contact");
  for (std::size_t n = fewest; n <= most; n *= 10) {
    run("layers", layers(n), 40, n < 1000000 ? 20 : 8, true);
  }
  if (settle > 0) {
    run("mix", mix(), settle, 20, false);
  }
  if (dropped > 0) {
    run("dropped", pile(dropped, 0), settle, 20, false);
  }
}
