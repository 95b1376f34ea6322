/// Whole steps of a settled pile of equal spheres in an open box under gravity, with the error beside the
/// time: overlap over radius, kinetic energy over m g R a body, and the weight that floor and walls carry.

#include "boxes.hpp"
#include "stopwatch.hpp"

#include <benchmark/benchmark.h>

#include <map>

namespace {

using namespace gravel;

/// Falls from a loose lattice into its box, and has come to rest.
const Space<double>& settledPile(std::size_t n) {
  static std::map<std::size_t, Space<double>> known;
  const auto [pile, isNew] = known.try_emplace(n, boxes::spaceOf<double>(boxes::pile(n, 0), {}));
  for (std::size_t i = 0; isNew && i < 1200; ++i) {
    pile->second.computeDynamics(i);
  }
  return pile->second;
}

void Pile(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  Space<double> space = settledPile(n);
  std::size_t step = 0;
  std::size_t iterations = 0;
  const Stopwatch watch;
  for (auto _ : state) {
    space.computeDynamics(step++);
    iterations += static_cast<std::size_t>(space.contactReport().iterations);
  }
  const double spent = watch.nanoseconds();
  const boxes::Errors errors = boxes::errorsOf(space);
  const double bodies = static_cast<double>(n);
  state.counters["contacts"] = static_cast<double>(space.contactCount());
  state.counters["sweeps"] = static_cast<double>(iterations) / static_cast<double>(step);
  state.counters["ns_per_body"] = spent / static_cast<double>(step) / bodies;
  state.counters["mean_overlap_R"] = errors.meanOverlap;
  state.counters["max_overlap_R"] = errors.largestOverlap;
  state.counters["KE_mgR"] = errors.moving;
  state.counters["weight_error"] = space.supportedWeight().residual();
}
BENCHMARK(Pile)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond);

}  // namespace
