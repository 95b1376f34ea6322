// Pair search: nanoseconds a body for each method, with the number of pairs a body that it found (which must
// not depend on the method). Scenes: equal radii at a volume fraction of 0.3; radii spread over two decades;
// one body a thousand times larger than the rest; a sparse cloud; a clump with one body far away. Also what a
// neighbour list costs while it is reused.

#include <gravel/core/random.hpp>
#include <gravel/spatial/neighbour_list.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>

namespace {

using namespace gravel;

enum Scene { Equal, Spread, OneLarge, Sparse, Clump };

struct Cloud {
  std::vector<Vector3<double>> positions;
  std::vector<double> radii;
  std::vector<BodyId> ids;
};

Cloud makeCloud(Scene scene, std::size_t n) {
  const CounterRandom random(9);
  Cloud cloud;
  const double count = static_cast<double>(n);
  const double filling = scene == Sparse ? 1e-5 : 0.3;
  const double radius = std::cbrt(filling / count * 3.0 / (4.0 * pi<double>()));
  for (std::size_t i = 0; i < n; ++i) {
    cloud.positions.push_back({random.uniform(4 * i), random.uniform(4 * i + 1), random.uniform(4 * i + 2)});
    cloud.radii.push_back(scene == Spread ? 2 * radius * std::pow(100.0, -random.uniform(4 * i + 3))
                                          : radius);
    cloud.ids.push_back(BodyId{i});
  }
  if (scene == Clump) {
    cloud.positions[0] = {100.0, 100.0, 100.0};
  }
  if (scene == OneLarge) {
    for (double& r : cloud.radii) {
      r = 0.25e-3;
    }
    cloud.radii[0] = 0.25;
    cloud.positions[0] = {0.5, 0.5, 0.5};
  }
  return cloud;
}

void report(benchmark::State& state, std::size_t n, std::size_t pairs, std::clock_t start) {
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;  // of all threads
  state.counters["ns_per_body"] =
      1e9 * seconds / (static_cast<double>(state.iterations()) * static_cast<double>(n));
  state.counters["pairs_per_body"] = static_cast<double>(pairs) / static_cast<double>(n);
}

template <BroadPhaseKind kind, Scene scene>
void search(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const Cloud cloud = makeCloud(scene, n);
  BroadPhase<double> method(kind);
  std::vector<Pair> pairs;
  const std::clock_t start = std::clock();
  for (auto _ : state) {
    method.findPairs(cloud.positions, cloud.radii, cloud.ids, 0.0, Domain<double>::open(), 0.0, pairs);
    benchmark::DoNotOptimize(pairs.data());
  }
  report(state, n, pairs.size(), start);
  state.SetLabel(method.name());
}

void reuse(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const Cloud cloud = makeCloud(Equal, n);
  NeighbourList<double> list;
  list.update(cloud.positions, cloud.radii, cloud.ids, 0, Domain<double>::open(), 0.0);
  const std::clock_t start = std::clock();
  for (auto _ : state) {
    list.update(cloud.positions, cloud.radii, cloud.ids, 0, Domain<double>::open(), 0.0);
  }
  report(state, n, list.pairs().size(), start);
  state.SetLabel(list.rebuilt() ? "searched" : "reused");
}

void few(benchmark::internal::Benchmark* bench) { bench->RangeMultiplier(2)->Range(16, 512); }
void many(benchmark::internal::Benchmark* bench) {
  bench->Arg(1000)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond);
}

BENCHMARK_TEMPLATE(search, BroadPhaseKind::AllPairs, Equal)->Apply(few);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::KDTree, Equal)->Apply(few);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::Grid, Equal)->Apply(few);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::AllPairs, Equal)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::KDTree, Equal)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::Grid, Equal)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::Automatic, Equal)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::KDTree, Spread)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::Grid, Spread)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::Automatic, Spread)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::KDTree, OneLarge)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::Grid, OneLarge)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::Automatic, OneLarge)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::KDTree, Sparse)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::Grid, Sparse)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::Automatic, Sparse)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::KDTree, Clump)->Apply(many);
BENCHMARK_TEMPLATE(search, BroadPhaseKind::Automatic, Clump)->Apply(many);
BENCHMARK(reuse)->Apply(many);

}  // namespace
