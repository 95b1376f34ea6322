/// Steps of a settled pile, and of a Plummer sphere, with one thread and with more, in turns: wall time,
/// median of the rounds, what a step does outside all parallel regions, and what Amdahl's law makes of it for
/// 64 threads.
///
///   bench_thread_scaling [bodies] [steps to settle] [rounds] [steps a round] [threads]
///
/// Figures mean something only on a machine that does nothing else. The share p that runs in parallel follows
/// from the ratio S of times with T threads, p = (1 - 1/S)/(1 - 1/T), so that it counts as serial what
/// starting and ending parallel regions takes (Amdahl 1967).

#include "boxes.hpp"

#include <omp.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>

namespace {

using namespace gravel;

/// Wall time of a call [ms], the median of `rounds`, with one thread and with `threads`. \param work is told
/// which of these it is, false and true: both have a space of their own, and so the same steps to take
std::pair<double, double> times(const std::function<void(bool)>& work, std::size_t rounds, int threads) {
  std::vector<double> one;
  std::vector<double> many;
  for (std::size_t k = 0; k < rounds; ++k) {
    for (const int count : {1, threads}) {
      omp_set_num_threads(count);
      const auto start = std::chrono::steady_clock::now();
      work(count > 1);
      const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - start;
      (count == 1 ? one : many).push_back(passed.count());
    }
  }
  return {boxes::median(one), boxes::median(many)};
}

void print(const char* scene, std::size_t n, const std::pair<double, double>& ms, std::size_t steps,
           int threads) {
  const double ratio = ms.first / ms.second;
  const double parallel = (1 - 1 / ratio) / (1 - 1.0 / threads);
  std::printf("%-18s%9zu%12.3f%12.3f%8.2f%10.3f%10.1f\n", scene, n, ms.first / static_cast<double>(steps),
              ms.second / static_cast<double>(steps), ratio, 1 - parallel,
              1 / (1 - parallel + parallel / 64));
}

/// Settled with the sweeps of the defaults, since with fewer a deep heap does not come to rest; then with
/// those of the comparison with Bullet.
Space<double> settled(std::size_t n, std::size_t settle) {
  Space<double> space = boxes::spaceOf(boxes::pile(n, 0), SimulationConfig<double>{});
  for (std::size_t k = 0; k < settle; ++k) {
    space.computeDynamics(k);
  }
  space.setContactTolerance(1e-2);
  space.setContactIterations(4);
  return space;
}

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int i, std::size_t otherwise) {
    return boxes::argument(argc, argv, i, otherwise, 0);
  };
  const std::size_t n = std::max<std::size_t>(1, argument(1, 1000));
  const std::size_t settle = argument(2, 20);
  const std::size_t rounds = std::max<std::size_t>(1, argument(3, 3));
  const std::size_t steps = std::max<std::size_t>(1, argument(4, 2));
  const int threads = static_cast<int>(std::max<std::size_t>(2, argument(5, 2)));
  omp_set_num_threads(threads);
  std::printf("%-18s%9s%12s%5d%7s%8s%10s%10s\n", "scene", "bodies", "ms, 1", threads, "thr.", "ratio",
              "serial", "of 64");
  const Space<double> pile = settled(n, settle);
  std::array<Space<double>, 2> piles{pile, pile};
  const auto go = [&](bool many) {
    for (std::size_t k = 0; k < steps; ++k) {
      piles[many ? 1 : 0].computeDynamics(k);
    }
  };
  print("settled pile", n, times(go, rounds, threads), steps, threads);
  const boxes::Errors errors = boxes::errorsOf(piles[1]);
  std::printf("  at the end: kinetic energy %.1e N m g R, overlaps %.1e and %.1e R, weight off by %.1e\n",
              errors.kinetic, errors.meanOverlap, errors.largestOverlap,
              piles[1].supportedWeight().residual());
  for (const double tolerance : {1e-3, 1e-5}) {
    SimulationConfig<double> config;
    config.gravityTolerance = tolerance;
    config.softening = 1e-3;
    config.timeStep = 1e-4;
    config.adaptiveTimeStep = false;
    Space<double> cluster(config);
    for (const Body<double>& body : scenes::plummerSphere<double>(n)) {
      cluster.addBody(body);
    }
    cluster.computeDynamics(0);  // the first forces
    std::array<Space<double>, 2> clusters{cluster, cluster};
    const std::string name = tolerance > 1e-4 ? "Plummer 1e-3" : "Plummer 1e-5";
    print(name.c_str(), n,
          times([&](bool many) { clusters[many ? 1 : 0].computeDynamics(1); }, rounds, threads), 1, threads);
  }
}
