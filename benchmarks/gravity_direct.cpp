// Direct gravity: nanoseconds per ordered pair, with the error beside it.
//
//   ns_per_pair  processor time of one evaluation, of all threads, / N^2
//   rms_error    rms of |a - a_exact| / |a_exact| over 64 bodies, against a sum in long double
//
// Compare rows of one run only, and medians (--benchmark_repetitions=5
// --benchmark_enable_random_interleaving=true).

#include "stopwatch.hpp"
#include <gravel/bodies/bodies.hpp>
#include <gravel/core/random.hpp>
#include <gravel/gravity/direct_sum.hpp>

#include <benchmark/benchmark.h>

#include <cmath>

namespace {

using namespace gravel;

void reportTime(benchmark::State& state, std::size_t n, const Stopwatch& watch) {
  const double pairs = static_cast<double>(n) * static_cast<double>(n);
  state.counters["ns_per_pair"] = watch.nanoseconds() / (static_cast<double>(state.iterations()) * pairs);
}

template <class S, class Layout>
Bodies<S, Layout> cloud(std::size_t n) {
  const CounterRandom random(5);
  Bodies<S, Layout> bodies;
  bodies.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    Body<S> body;
    body.position = {S(random.uniform(4 * i)), S(random.uniform(4 * i + 1)), S(random.uniform(4 * i + 2))};
    body.mass = S(random.uniform(4 * i + 3, 0.5, 1.5));
    bodies.add(body);
  }
  return bodies;
}

template <class S, class Layout>
double rmsError(const Bodies<S, Layout>& bodies) {
  using Wide = Vector3<long double>;
  const std::size_t stride = std::max<std::size_t>(1, bodies.size() / 64);
  long double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < bodies.size(); i += stride, ++count) {
    Wide exact = Wide::Zero();
    const Wide x = bodies[i].position().template cast<long double>();
    for (std::size_t j = 0; j < bodies.size(); ++j) {
      if (j != i) {
        const Wide d = bodies[j].position().template cast<long double>() - x;
        exact += static_cast<long double>(bodies[j].mass()) / (d.norm() * d.squaredNorm()) * d;
      }
    }
    const Wide error = bodies[i].acceleration().template cast<long double>() - exact;
    sum += error.squaredNorm() / exact.squaredNorm();
  }
  return static_cast<double>(std::sqrt(sum / static_cast<long double>(count)));
}

template <class S, class Layout>
void directSum(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  auto bodies = cloud<S, Layout>(n);
  DirectSum<S> sum;
  const Stopwatch watch;
  for (auto _ : state) {
    sum.accelerations(bodies.positions(), bodies.masses(), S(1), S(0), bodies.accelerations());
    benchmark::ClobberMemory();
  }
  reportTime(state, n, watch);
  state.counters["rms_error"] = rmsError(bodies);
}

template <class S>
void potentialEnergy(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const auto bodies = cloud<S, SoA>(n);
  DirectSum<S> sum;
  const Stopwatch watch;
  for (auto _ : state) {
    benchmark::DoNotOptimize(sum.potentialEnergy(bodies.positions(), bodies.masses(), S(1), S(0)));
  }
  reportTime(state, n, watch);
}

/// One ordered pair after another on three plain arrays: what a careful user writes, for scale.
template <class S>
void plainLoop(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const auto bodies = cloud<S, SoA>(n);
  std::vector<S> x(n), y(n), z(n), m(n), ax(n), ay(n), az(n);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = bodies[i].position()[0];
    y[i] = bodies[i].position()[1];
    z[i] = bodies[i].position()[2];
    m[i] = bodies[i].mass();
  }
  const Stopwatch watch;
  for (auto _ : state) {
    for (std::size_t i = 0; i < n; ++i) {
      S sx(0), sy(0), sz(0);
      for (std::size_t j = 0; j < n; ++j) {
        if (j != i) {
          const S dx = x[j] - x[i];
          const S dy = y[j] - y[i];
          const S dz = z[j] - z[i];
          const S s = dx * dx + dy * dy + dz * dz;
          const S f = m[j] / (s * std::sqrt(s));
          sx += f * dx;
          sy += f * dy;
          sz += f * dz;
        }
      }
      ax[i] = sx;
      ay[i] = sy;
      az[i] = sz;
    }
    benchmark::ClobberMemory();
  }
  reportTime(state, n, watch);
}

void sizes(benchmark::internal::Benchmark* bench) {
  bench->Arg(256)->Arg(1024)->Arg(4096)->Arg(16384)->Unit(benchmark::kMillisecond);
}

void fewSizes(benchmark::internal::Benchmark* bench) {
  bench->Arg(256)->Arg(2048)->Unit(benchmark::kMillisecond);
}

BENCHMARK_TEMPLATE(directSum, double, SoA)->Apply(sizes);
BENCHMARK_TEMPLATE(directSum, double, AoS)->Apply(sizes);
BENCHMARK_TEMPLATE(directSum, double, AoSoA<4>)->Apply(sizes);
BENCHMARK_TEMPLATE(directSum, double, AoSoA<8>)->Apply(sizes);
BENCHMARK_TEMPLATE(directSum, float, SoA)->Apply(sizes);
BENCHMARK_TEMPLATE(directSum, float, AoS)->Apply(sizes);
BENCHMARK_TEMPLATE(directSum, float, AoSoA<4>)->Apply(sizes);
BENCHMARK_TEMPLATE(directSum, float, AoSoA<8>)->Apply(sizes);
BENCHMARK_TEMPLATE(directSum, long double, SoA)->Apply(fewSizes);
BENCHMARK_TEMPLATE(directSum, long double, AoS)->Apply(fewSizes);
BENCHMARK_TEMPLATE(directSum, long double, AoSoA<8>)->Apply(fewSizes);
BENCHMARK_TEMPLATE(potentialEnergy, double)->Apply(fewSizes);
BENCHMARK_TEMPLATE(potentialEnergy, float)->Apply(fewSizes);
BENCHMARK_TEMPLATE(plainLoop, double)->Apply(fewSizes);
BENCHMARK_TEMPLATE(plainLoop, float)->Apply(fewSizes);

}  // namespace
