// Contacts of a dense random packing of 10 000 spheres in a box, under one step's worth of gravity.
//
//   ns_per_candidate              narrow phase: time / candidate pairs within a tenth of a radius
//   ns_per_contact                colouring, and solving of lone pairs: time / contacts
//   ns_per_contact_and_iteration  solver and correction of positions: time / (contacts x sweeps), with the
//                                 gathering of bodies and the booking of energy
//   residual                      largest change of a velocity in the last sweep / largest approach
//   floor_error                   |impulse on the floor / weight x dt - 1|: what a solve from nothing has
//                                 carried down through the packing after so many sweeps
//
// The figures are processor time of all threads; the column Time is wall time. The last argument is the
// number of threads. Compare rows of one run only, on an idle machine.

#include "contact/scenes.hpp"
#include "stopwatch.hpp"
#include <gravel/spatial/broad_phase.hpp>

#include <benchmark/benchmark.h>
#include <omp.h>

namespace {

using namespace gravel;
using namespace gravel::test;
using S = double;

constexpr std::size_t count = 10000;
constexpr S margin = 0.01;
constexpr S dt = 1e-3;
constexpr S g = 9.81;

struct Scene {
  Bodies<S, SoA> bodies;
  std::vector<HalfSpace<S>> walls;
  std::vector<Pair> candidates;
  S weight = 0;

  ContactList<S> contacts(const Material<S>& material) const {
    const std::vector<Material<S>> materials{material};
    std::vector<HalfSpace<S>> same = walls;
    for (HalfSpace<S>& wall : same) {
      wall.material = material;
      if (wall.normal[2] < 0.5) {  // smooth sides: the floor carries all
        wall.material.staticFriction = wall.material.kineticFriction = 0;
      }
    }
    ContactList<S> found;
    NarrowPhaseSettings<S> settings;
    settings.margin = margin;
    NarrowPhase<S>().find(candidates, bodies, Domain<S>::open(), materials, same, settings, found);
    for (Contact<S>& c : found) {
      c.gap = std::min(c.gap, 0.0);  // as if they touched: the packing carries its weight
    }
    return found;
  }
};

/// Spheres thrown at random into a box that they fill to 0.6, pushed apart until the overlaps are small.
const Scene& packing() {
  static const Scene scene = [] {
    Scene s;
    const S side = std::cbrt(static_cast<S>(count) * 0.5236 / 0.6);
    s.walls = {{{0, 0, 1}, 0, {}},      {{0, 0, -1}, -side, {}}, {{1, 0, 0}, 0, {}},
               {{-1, 0, 0}, -side, {}}, {{0, 1, 0}, 0, {}},      {{0, -1, 0}, -side, {}}};
    for (std::size_t b = 0; b < s.walls.size(); ++b) {
      s.walls[b].number = b;
    }
    const CounterRandom random(1);
    for (std::size_t i = 0; i < count; ++i) {
      Body<S> body;
      body.radius = 0.5;
      for (int c = 0; c < 3; ++c) {
        body.position[c] = random.uniform(3 * i + static_cast<std::size_t>(c), 0.5, side - 0.5);
      }
      s.bodies.add(body);
    }
    BroadPhase<S> broad;
    NarrowPhase<S> narrow;
    ContactSolver<S> solver;
    CorrectionSettings<S> settings;
    settings.factor = 1.0;
    settings.maxIterations = 20;
    const std::vector<Material<S>> materials(1);
    ContactList<S> touching;
    for (int round = 0; round < 400; ++round) {
      broad.findPairs(s.bodies.positions(), s.bodies.radii(), s.bodies.ids(), 0.05, Domain<S>::open(), 0.0,
                      s.candidates);
      narrow.find(s.candidates, s.bodies, Domain<S>::open(), materials, s.walls, {}, touching);
      solver.begin(touching, s.bodies);
      if (solver.correctPositions(s.bodies, settings).largestOverlap < 1e-3) {
        break;
      }
    }
    s.walls.erase(s.walls.begin() + 1);  // the lid
    for (std::size_t i = 0; i < count; ++i) {
      s.bodies[i].velocity() = Vector3<S>(0, 0, -g * dt);
      s.bodies.accelerations()[i] = Vector3<S>(0, 0, -g);
      s.weight += s.bodies[i].mass() * g;
    }
    return s;
  }();
  return scene;
}

void narrowPhase(benchmark::State& state) {
  const Scene& scene = packing();
  omp_set_num_threads(static_cast<int>(state.range(0)));
  const std::vector<Material<S>> materials(1);
  NarrowPhaseSettings<S> settings;
  settings.margin = margin;
  NarrowPhase<S> narrow;
  ContactList<S> found;
  const Stopwatch watch;
  for (auto _ : state) {
    narrow.find(scene.candidates, scene.bodies, Domain<S>::open(), materials, {}, settings, found);
  }
  state.counters["ns_per_candidate"] = watch.nanoseconds() / static_cast<double>(state.iterations()) /
                                       static_cast<double>(scene.candidates.size());
  state.counters["contacts"] = static_cast<double>(found.size());
}

void coloring(benchmark::State& state) {
  const Scene& scene = packing();
  const auto contacts = scene.contacts({});
  ContactColoring colours;
  const Stopwatch watch;
  for (auto _ : state) {
    colours.build(std::span<const Contact<S>>(contacts), scene.bodies);
  }
  state.counters["ns_per_contact"] =
      watch.nanoseconds() / static_cast<double>(state.iterations()) / static_cast<double>(contacts.size());
  state.counters["colours"] = static_cast<double>(colours.colours());
}

/// Arguments: friction in hundredths, momentum on, sweeps, threads.
void solve(benchmark::State& state) {
  const Scene& scene = packing();
  const double mu = static_cast<double>(state.range(0)) / 100.0;
  omp_set_num_threads(static_cast<int>(state.range(3)));
  const auto contacts = scene.contacts({0.5, mu, mu, 0.0});
  ContactSettings<S> settings;
  settings.accelerate = state.range(1) != 0;
  settings.maxIterations = static_cast<int>(state.range(2));
  settings.warmStart = false;
  settings.tolerance = 1e-12;
  ContactSolver<S> solver;
  solver.setSettings(settings);
  Bodies<S, SoA> bodies = scene.bodies;
  solver.begin(contacts, bodies);
  ContactReport<S> report;
  double spent = 0;
  for (auto _ : state) {
    state.PauseTiming();
    bodies = scene.bodies;
    state.ResumeTiming();
    const Stopwatch watch;
    report = solver.solve(bodies, dt);
    spent += watch.nanoseconds();
  }
  S onFloor = 0;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    onFloor += contacts[k].key2 == boundaryKey(0) ? solver.impulses()[k].normal : 0.0;
  }
  state.counters["ns_per_contact_and_iteration"] = spent / static_cast<double>(state.iterations()) /
                                                   static_cast<double>(contacts.size()) / report.iterations;
  state.counters["contacts"] = static_cast<double>(contacts.size());
  state.counters["residual"] = report.residual;
  state.counters["floor_error"] = std::abs(onFloor / (scene.weight * dt) - 1.0);
}

void lonePairs(benchmark::State& state) {
  omp_set_num_threads(static_cast<int>(state.range(0)));
  Bodies<S, SoA> start;
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < 10000; ++i) {
    Body<S> body;
    body.radius = 0.5;
    body.position = {3.0 * i, 0, 0};
    body.velocity = {1, 0.5, 0};
    start.add(body);
    body.position[0] += 0.999;
    body.velocity = {-1, 0, 0.3};
    start.add(body);
    pairs.push_back({2 * i, 2 * i + 1});
  }
  const std::vector<Material<S>> materials(1);
  ContactList<S> contacts;
  NarrowPhase<S>().find(pairs, start, Domain<S>::open(), materials, {}, {}, contacts);
  Bodies<S, SoA> bodies = start;
  ContactSolver<S> solver;
  solver.begin(contacts, bodies);
  double spent = 0;
  for (auto _ : state) {
    state.PauseTiming();
    bodies = start;
    state.ResumeTiming();
    const Stopwatch watch;
    solver.solve(bodies, dt);
    spent += watch.nanoseconds();
  }
  state.counters["ns_per_contact"] =
      spent / static_cast<double>(state.iterations()) / static_cast<double>(contacts.size());
}

void correction(benchmark::State& state) {
  const Scene& scene = packing();
  omp_set_num_threads(static_cast<int>(state.range(0)));
  const auto contacts = scene.contacts({});
  Bodies<S, SoA> bodies = scene.bodies;
  ContactSolver<S> solver;
  solver.begin(contacts, bodies);
  CorrectionReport<S> report;
  double spent = 0;
  for (auto _ : state) {
    state.PauseTiming();
    bodies = scene.bodies;
    state.ResumeTiming();
    const Stopwatch watch;
    report = solver.correctPositions(bodies, {});
    spent += watch.nanoseconds();
  }
  state.counters["ns_per_contact_and_iteration"] = spent / static_cast<double>(state.iterations()) /
                                                   static_cast<double>(contacts.size()) / report.iterations;
  state.counters["residual"] = report.residual / report.largestOverlap;
}

}  // namespace

BENCHMARK(narrowPhase)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(coloring)->UseRealTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(solve)
    ->ArgNames({"friction", "momentum", "sweeps", "threads"})
    ->ArgsProduct({{0, 50}, {0, 1}, {20, 50, 100, 200}, {1}})
    ->ArgsProduct({{0, 50}, {1}, {50}, {2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(lonePairs)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(correction)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMicrosecond);
