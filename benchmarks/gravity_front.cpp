// Gravity on a Plummer sphere: time and error by tolerance and number of bodies, the direct sum beside it.
//
//   tolerance   what is asked
//   rms, worst  relative error that comes out, over 1000 bodies
//   per_direct  time over that of the direct sum in this run (that of 32768 bodies scaled by N^2 above)
//
// Run with OMP_NUM_THREADS=1; times are processor time of all threads together. The largest numbers of bodies
// take minutes: --benchmark_filter chooses.

#include "stopwatch.hpp"
#include "support/gravity_scenes.hpp"
#include <gravel/gravity/gravity_solver.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace {

using namespace gravel;
using Points = test::PointMasses<double>;

const Points& plummer(std::size_t n) {
  static std::map<std::size_t, Points> cache;
  Points& points = cache[n];
  if (points.positions.empty()) {
    points = test::gravityScene<double>("Plummer sphere", n);
  }
  return points;
}

/// Seconds of one direct sum.
double directTime(std::size_t n) {
  static std::map<std::size_t, double> cache;
  constexpr std::size_t most = 32768;
  if (n > most) {
    const double ratio = static_cast<double>(n) / static_cast<double>(most);
    return ratio * ratio * directTime(most);
  }
  double& seconds = cache[n];
  if (seconds == 0) {
    std::vector<Vector3<double>> a(n);
    DirectSum<double> sum;
    std::array<double, 3> runs{};
    for (double& run : runs) {
      const Stopwatch watch;
      sum.accelerations(plummer(n).positions, plummer(n).masses, 1.0, 0.0, a);
      run = 1e-9 * watch.nanoseconds();
    }
    std::sort(runs.begin(), runs.end());
    seconds = runs[1];
  }
  return seconds;
}

void fastMultipole(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const double tolerance = std::pow(10.0, -0.5 * static_cast<double>(state.range(1)));
  const Points& points = plummer(n);
  std::vector<Vector3<double>> a(n);
  FastMultipole<double> sum;
  sum.setTolerance(tolerance);
  const Stopwatch watch;
  for (auto _ : state) {
    sum.accelerations(points.positions, points.masses, 1.0, 0.0, a);
    benchmark::ClobberMemory();
  }
  const double seconds = 1e-9 * watch.nanoseconds() / static_cast<double>(state.iterations());
  std::vector<double> errors;
  double squares = 0;
  for (std::size_t i = 0; i < n; i += std::max<std::size_t>(1, n / 1000)) {
    Vector3<double> exact = Vector3<double>::Zero();
    for (std::size_t j = 0; j < n; ++j) {
      const Vector3<double> d = points.positions[j] - points.positions[i];
      const double s = d.squaredNorm();
      if (s > 0) {
        exact += points.masses[j] / (s * std::sqrt(s)) * d;
      }
    }
    errors.push_back((a[i] - exact).norm() / exact.norm());
    squares += errors.back() * errors.back();
  }
  std::sort(errors.begin(), errors.end());
  state.counters["tolerance"] = tolerance;
  state.counters["rms"] = std::sqrt(squares / static_cast<double>(errors.size()));
  state.counters["worst"] = errors.back();
  state.counters["per_direct"] = seconds / directTime(n);
}

void front(benchmark::internal::Benchmark* bench) {
  for (const std::int64_t n : {1000, 10000, 100000, 1000000}) {
    for (std::int64_t halfDecades = 3; halfDecades <= (n > 100000 ? 14 : 20); ++halfDecades) {
      bench->Args({n, halfDecades});
    }
  }
  bench->Unit(benchmark::kMillisecond);
}

BENCHMARK(fastMultipole)->Apply(front);

}  // namespace
