// Gravity on a Plummer sphere, and on other systems of a million bodies: time and error by tolerance and
// number of bodies, the direct sum beside it.
//
//   tolerance   what is asked
//   rms, worst  relative error that comes out, over 1000 bodies (accelerations below a hundredth of the mean
//               count as that much)
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
#include <string>

namespace {

using namespace gravel;
using Points = test::PointMasses<double>;

const Points& scene(const std::string& name, std::size_t n) {
  static std::string lastName;
  static Points last;  // one at a time: the largest take gigabytes
  if (name != lastName || last.size() != n) {
    last = test::gravityScene<double>(name, n);
    lastName = name;
  }
  return last;
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
    const Points points = test::gravityScene<double>("Plummer sphere", n);
    std::vector<Vector3<double>> a(n);
    DirectSum<double> sum;
    std::array<double, 3> runs{};
    for (double& run : runs) {
      const Stopwatch watch;
      sum.accelerations(points.positions, points.masses, 1.0, 0.0, a);
      run = 1e-9 * watch.nanoseconds();
    }
    std::sort(runs.begin(), runs.end());
    seconds = runs[1];
  }
  return seconds;
}

void measure(benchmark::State& state, const std::string& name, std::size_t n, std::int64_t halfDecades) {
  const double tolerance = std::pow(10.0, -0.5 * static_cast<double>(halfDecades));
  const Points& points = scene(name, n);
  std::vector<Vector3<double>> a(n);
  FastMultipole<double> sum;
  sum.setTolerance(tolerance);
  const Stopwatch watch;
  for (auto _ : state) {
    sum.accelerations(points.positions, points.masses, 1.0, 0.0, a);
    benchmark::ClobberMemory();
  }
  const double seconds = 1e-9 * watch.nanoseconds() / static_cast<double>(state.iterations());
  double mean = 0;
  for (const Vector3<double>& x : a) {
    mean += x.norm() / static_cast<double>(n);
  }
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
    errors.push_back((a[i] - exact).norm() / std::max(exact.norm(), mean / 100));
    squares += errors.back() * errors.back();
  }
  std::sort(errors.begin(), errors.end());
  state.counters["tolerance"] = tolerance;
  state.counters["rms"] = std::sqrt(squares / static_cast<double>(errors.size()));
  state.counters["worst"] = errors.back();
  state.counters["per_direct"] = seconds / directTime(n);
}

void fastMultipole(benchmark::State& state) {
  measure(state, "Plummer sphere", static_cast<std::size_t>(state.range(0)), state.range(1));
}

void otherScenes(benchmark::State& state) {
  const std::string name = test::gravityScenes[static_cast<std::size_t>(state.range(0))];
  state.SetLabel(name);
  measure(state, name, static_cast<std::size_t>(state.range(1)), state.range(2));
}

void front(benchmark::internal::Benchmark* bench) {
  for (const std::int64_t n : {1000, 10000, 100000, 1000000}) {
    for (std::int64_t halfDecades = 3; halfDecades <= (n > 100000 ? 14 : 20); ++halfDecades) {
      bench->Args({n, halfDecades});
    }
  }
  bench->Args({10000000, 6});
  bench->Unit(benchmark::kMillisecond);
}

void scenes(benchmark::internal::Benchmark* bench) {
  for (std::int64_t name = 0; name < static_cast<std::int64_t>(test::gravityScenes.size()); ++name) {
    for (const std::int64_t halfDecades : {6, 10}) {
      bench->Args({name, 1000000, halfDecades});
    }
  }
  bench->Unit(benchmark::kMillisecond);
}

BENCHMARK(fastMultipole)->Apply(front);
BENCHMARK(otherScenes)->Apply(scenes);

}  // namespace
