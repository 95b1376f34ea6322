/// Whole steps of an elastic gas in a periodic box, and of a ring patch, with what they should measure beside
/// the time: energy error, collision rate and pressure over those of the theory of dense gases; velocity
/// dispersion and filling of the ring.

#include "scenes/gas.hpp"
#include "scenes/ring.hpp"
#include "stopwatch.hpp"

#include <benchmark/benchmark.h>

namespace {

using namespace gravel;

void finish(benchmark::State& state, const Stopwatch& watch, std::size_t bodies) {
  state.counters["ns_per_body"] =
      watch.nanoseconds() / static_cast<double>(state.iterations()) / static_cast<double>(bodies);
}

/// Arguments: bodies; rms speed times step in thousandths of a diameter. A fifth of the volume is filled.
void Gas(benchmark::State& state) {
  scenes::GasOptions options;
  options.count = static_cast<std::size_t>(state.range(0));
  options.fraction = 0.2;
  options.timeStep = 1e-3 * static_cast<double>(state.range(1)) / std::sqrt(3.0);
  Space<double> space = scenes::gasBox(options);
  std::size_t step = 0;
  while (space.time() < 0.2) {
    space.computeDynamics(step++);
  }
  scenes::GasStatistics gas;
  const double before = space.energyLedger().kinetic;
  const Stopwatch watch;
  for (auto _ : state) {
    space.computeDynamics(step++);
    gas.sample(space);
  }
  finish(state, watch, space.n());
  state.counters["energy_error"] = space.energyLedger().kinetic / before - 1.0;
  state.counters["hits"] = gas.hits();
  state.counters["us_per_hit"] = watch.nanoseconds() / 1e3 / gas.hits();
  state.counters["parts"] = static_cast<double>(space.contactSubsteps());
  state.counters["rate_over_theory"] = gas.rate() / scenes::gasCollisionRate(options.fraction);
  state.counters["pressure_over_theory"] =
      gas.compressibility(1.0) / scenes::gasCompressibility(options.fraction);
}
BENCHMARK(Gas)
    ->Args({1000, 10})
    ->Args({10000, 10})
    ->Args({10000, 100})
    ->Args({10000, 1000})
    ->Args({10000, 10000})
    ->Unit(benchmark::kMillisecond);

/// Arguments: bodies; optical depth in hundredths. After two orbits to settle.
void Ring(benchmark::State& state) {
  scenes::RingOptions options;
  options.count = static_cast<std::size_t>(state.range(0));
  options.opticalDepth = 1e-2 * static_cast<double>(state.range(1));
  Space<double> space = scenes::ringPatch(options);
  std::size_t step = 0;
  while (step < 1000) {
    space.computeDynamics(step++);
  }
  scenes::RingStatistics ring;
  const Stopwatch watch;
  for (auto _ : state) {
    space.computeDynamics(step++);
    ring.sample(space);
  }
  finish(state, watch, space.n());
  state.counters["dispersion"] = ring.c();
  state.counters["filling"] = ring.filling();
}
BENCHMARK(Ring)->Args({500, 50})->Args({500, 100})->Unit(benchmark::kMillisecond);

}  // namespace
