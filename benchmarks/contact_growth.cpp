/// How the cost of contacts grows: time and memory of heaps from 1e3 bodies on, and of one large sphere on a
/// bed of small ones, with the errors beside them.
///
///   default  a dropped pile at rest between smooth walls, and its images in them: 1, 9, 100 such heaps
///   heap     the same, with the sweeps of the comparison with Bullet
///   morton   the same, bodies sorted along a Morton curve (`Space::reorderBodies`)
///   mix      radii 1 : 100, masses 1 : 1e6, dropped
///   dropped  the pile that the other comparisons use
///
/// Heaps come to rest with the sweeps of the defaults and all threads: the one in five times the steps to
/// settle, its images, whose forces are not known at first, in these; then they go on with one thread, first
/// with the sweeps of the defaults, then with those of the comparison with Bullet, ten steps before any is
/// timed.
///
/// ns/contact: processor time of a step over contacts. ns/sweep: that part of it which solves contacts (share
/// by the profiler), over contacts and sweeps. B/body: what malloc gave out for a space of as many bodies far
/// from each other, after two steps; B/contact: the rest, over contacts, candidate pairs included (glibc;
/// vectors that have grown count with what they hold in reserve).
///
///   bench_contact_growth [bodies of one heap] [most bodies] [steps to settle] [steps of mix and dropped]
///                        [bodies dropped]

#include "boxes.hpp"
#include "stopwatch.hpp"

#include <malloc.h>
#include <omp.h>

#include <cstdio>
#include <cstdlib>

namespace {

using namespace boxes;

double bytesInUse() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

/// The scene with its bodies where they are after so many steps, without motion.
Scene rested(Scene scene, std::size_t steps) {
  gravel::Space<double> space = spaceOf(scene, gravel::SimulationConfig<double>{});
  for (std::size_t k = 0; k < steps; ++k) {
    space.computeDynamics(k);
  }
  for (std::size_t i = 0; i < space.n(); ++i) {
    scene.bodies[i].position = space.body(i).position();
  }
  return scene;
}

/// A heap between smooth walls, and beside it its images in these walls, side x side in all: what leant on a
/// wall leans on its own image, so that all rest as the one did.
Scene mirrored(const Scene& one, std::size_t side) {
  Scene all = one;
  all.bodies.clear();
  all.width = one.width * static_cast<double>(side);
  const auto image = [&](std::size_t place, double x) {
    const double middle = (static_cast<double>(place) - static_cast<double>(side - 1) / 2) * one.width;
    return middle + (place % 2 == 0 ? x : -x);
  };
  for (std::size_t heap = 0; heap < side * side; ++heap) {
    for (gravel::Body<double> grain : one.bodies) {
      grain.position[0] = image(heap % side, grain.position[0]);
      grain.position[1] = image(heap / side, grain.position[1]);
      all.bodies.push_back(grain);
    }
  }
  return all;
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
    gravel::Space<double> space = spaceOf(apart, gravel::SimulationConfig<double>{});
    space.computeDynamics(0);
    space.computeDynamics(1);
    perBody = (bytesInUse() - start) / static_cast<double>(space.n());
  }
  const double start = bytesInUse();
  gravel::Space<double> space = spaceOf(scene, gravel::SimulationConfig<double>{});
  std::size_t step = 0;
  const auto go = [&](std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
      space.computeDynamics(step++);
    }
  };
  omp_set_num_threads(omp_get_num_procs());
  go(settle);
  omp_set_num_threads(1);
  const auto timed = [&](const char* what) {
    go(10);
    const double bodies = static_cast<double>(space.n());
    const double perContact = (bytesInUse() - start - perBody * bodies) /
                              static_cast<double>(std::max<std::size_t>(1, space.contacts().size()));
    measure(what, space, step, steps, perBody, perContact);
    return perContact;
  };
  if (reorder) {
    timed("default");
  }
  space.setContactTolerance(1e-2);
  space.setContactIterations(4);
  const double perContact = timed(name);
  if (reorder) {
    space.reorderBodies();
    go(3);
    measure("morton", space, step, steps, perBody, perContact);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int i, std::size_t otherwise) {
    return boxes::argument(argc, argv, i, otherwise, 0);
  };
  omp_set_num_threads(1);
  const std::size_t bodies = std::max<std::size_t>(1, argument(1, 1000));
  const std::size_t most = argument(2, 1000);
  const std::size_t rest = argument(3, 300);
  const std::size_t settle = argument(4, 0);
  const std::size_t dropped = argument(5, 0);
  std::printf("%-8s%9s%9s%8s%11s%11s%9s%11s%9s%9s%9s%8s%10s\n", "scene", "bodies", "contacts", "colours",
              "ms/step", "ns/contact", "ns/sweep", "overlap/R", "largest", "KE/NmgR", "weight", "B/body",
              "B/contact");
  Scene heap = pile(bodies, 0);
  heap.smoothSides = true;
  heap = rested(heap, 5 * rest);
  for (const std::size_t side : {1, 3, 10, 32}) {
    if (side == 1 || side * side * bodies <= most) {
      run("heap", mirrored(heap, side), rest, side * side * bodies < 1000000 ? 20 : 8, true);
    }
  }
  if (settle > 0) {
    run("mix", mix(), settle, 20, false);
  }
  if (dropped > 0) {
    run("dropped", pile(dropped, 0), settle, 20, false);
  }
}
