/// What a feature costs that a scene does not use: the same step with the feature absent, present but
/// unneeded, and needed. "Present but unneeded" should cost what "absent" costs, and changes no bit
/// (tests/space).

#include "stopwatch.hpp"
#include <gravel/gravel.hpp>

#include <benchmark/benchmark.h>

namespace {

using namespace gravel;

enum class Use { Absent, Unneeded, Needed };

/// 4096 spheres on a lattice, 1 % of it filled, that move slowly to all sides; no gravity.
Space<double> dilute(const SimulationConfig<double>& chosen) {
  SimulationConfig<double> config = chosen;
  config.timeStep = 1e-3;
  config.adaptiveTimeStep = false;
  Space<double> space(config);
  const CounterRandom random(7);
  for (std::uint64_t i = 0; i < 4096; ++i) {
    Body<double> body;
    body.position = {2.2 * 3.4 * double(i % 16), 2.2 * 3.4 * double(i / 16 % 16),
                     2.2 * 3.4 * double(i / 256)};
    body.velocity = random.direction(i) * 0.1;
    body.radius = 1.0;
    space.addBody(body);
  }
  return space;
}

void run(benchmark::State& state, Space<double>& space) {
  std::size_t step = 0;
  const Stopwatch watch;
  for (auto _ : state) {
    space.computeDynamics(step++);
  }
  state.counters["ns_per_body"] =
      watch.nanoseconds() / static_cast<double>(step) / static_cast<double>(space.n());
}

SimulationConfig<double> quiet() {
  SimulationConfig<double> config;
  config.G = 0.0;
  return config;
}

/// Gravity: switched off; on with bodies that have no mass to speak of is not unneeded, so there is no
/// middle.
void Gravity(benchmark::State& state, Use use) {
  SimulationConfig<double> config = quiet();
  config.G = use == Use::Needed ? 6.6743e-11 : 0.0;
  Space<double> space = dilute(config);
  run(state, space);
}
BENCHMARK_CAPTURE(Gravity, absent, Use::Absent);
BENCHMARK_CAPTURE(Gravity, needed, Use::Needed);

/// Friction: coefficients 0; coefficients but no contact.
void Friction(benchmark::State& state, Use use) {
  SimulationConfig<double> config = quiet();
  config.coeffFriction = use == Use::Absent ? 0.0 : 0.5;
  config.coeffStaticFriction = config.coeffFriction;
  Space<double> space = dilute(config);
  run(state, space);
}
BENCHMARK_CAPTURE(Friction, absent, Use::Absent);
BENCHMARK_CAPTURE(Friction, unneeded, Use::Unneeded);

/// A plane: none; one far away from all bodies; a floor under the lowest layer.
void Plane(benchmark::State& state, Use use) {
  Space<double> space = dilute(quiet());
  if (use != Use::Absent) {
    space.addPlane({0, 0, 1}, use == Use::Unneeded ? -1e3 : -0.999);
  }
  run(state, space);
}
BENCHMARK_CAPTURE(Plane, absent, Use::Absent);
BENCHMARK_CAPTURE(Plane, unneeded, Use::Unneeded);
BENCHMARK_CAPTURE(Plane, needed, Use::Needed);

/// Spin: bodies that do not turn need no orientation.
void Spin(benchmark::State& state, Use use) {
  Space<double> space = dilute(quiet());
  for (std::size_t i = 0; i < space.n() && use == Use::Needed; ++i) {
    space.body(i).angularVelocity() = Vector3<double>(0.1, 0.2, 0.3);
  }
  run(state, space);
}
BENCHMARK_CAPTURE(Spin, absent, Use::Absent);
BENCHMARK_CAPTURE(Spin, needed, Use::Needed);

/// Damping rates of zero; and not.
void Damping(benchmark::State& state, Use use) {
  SimulationConfig<double> config = quiet();
  config.linearDamping = use == Use::Needed ? 0.1 : 0.0;
  Space<double> space = dilute(config);
  run(state, space);
}
BENCHMARK_CAPTURE(Damping, absent, Use::Absent);
BENCHMARK_CAPTURE(Damping, needed, Use::Needed);

/// Diagnostics: off; on, between two lines of the log; on, a line every step.
void Diagnostics(benchmark::State& state, Use use) {
  SimulationConfig<double> config = quiet();
  config.diagnosticsEnabled = use != Use::Absent;
  config.logFrequency = use == Use::Needed ? 1 : 1000000000;
  Space<double> space = dilute(config);
  space.setLog([](const char*) {});
  run(state, space);
}
BENCHMARK_CAPTURE(Diagnostics, absent, Use::Absent);
BENCHMARK_CAPTURE(Diagnostics, unneeded, Use::Unneeded);
BENCHMARK_CAPTURE(Diagnostics, needed, Use::Needed);

/// Contacts at all: points; spheres that stay apart.
void Contacts(benchmark::State& state, Use use) {
  Space<double> space = dilute(quiet());
  for (std::size_t i = 0; i < space.n() && use == Use::Absent; ++i) {
    space.body(i).radius() = 0.0;
  }
  run(state, space);
}
BENCHMARK_CAPTURE(Contacts, absent, Use::Absent);
BENCHMARK_CAPTURE(Contacts, unneeded, Use::Unneeded);

/// Sleep, for a cube of 4096 stacked spheres between walls: off; on, but nobody rests for so long; all sleep.
/// Beside the time, how wrong the weight on the floor is.
void Sleep(benchmark::State& state, Use use) {
  SimulationConfig<double> config = quiet();
  config.timeStep = 1.0 / 60.0;
  config.adaptiveTimeStep = false;
  config.sleepSpeed = use == Use::Absent ? 0.0 : 0.05;
  config.sleepTime = use == Use::Unneeded ? 1e9 : 0.5;
  Space<double> space(config);
  space.addBox({0, 0, 0}, {32, 32, 40}, defaultMaterial, BoxFaces::HighZ);
  space.setUniformField({0, 0, -9.81});
  for (std::size_t i = 0; i < 4096; ++i) {
    Body<double> body;
    body.position = {1.0 + 2.0 * double(i % 16), 1.0 + 2.0 * double(i / 16 % 16),
                     1.0 + 2.0 * double(i / 256)};
    body.radius = 1.0;
    space.addBody(body);
  }
  for (std::size_t i = 0; i < 60; ++i) {
    space.computeDynamics(i);
  }
  run(state, space);
  state.counters["weight_error"] = space.supportedWeight().residual();
}
BENCHMARK_CAPTURE(Sleep, absent, Use::Absent);
BENCHMARK_CAPTURE(Sleep, unneeded, Use::Unneeded);
BENCHMARK_CAPTURE(Sleep, needed, Use::Needed);

/// Light bodies on circles about a heavy one, points, 1000 steps of velocity Verlet at a time: by one
/// advanceTo, or one by one, each with the look at what a user may have changed. Beside the time of a step,
/// the change of the energy over all steps.
void FewPoints(benchmark::State& state, bool oneByOne) {
  SimulationConfig<double> config;
  config.G = 1.0;
  config.timeStep = 1.0 / 1024;
  config.adaptiveTimeStep = false;
  Space<double> space(config);
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    const double r = i == 0 ? 0.0 : 1.0 + 0.3 * static_cast<double>(i);
    const Vector3<double> out(std::cos(double(i)), std::sin(double(i)), 0.0);
    Body<double> body;
    body.position = r * out;
    body.velocity = i == 0 ? Vector3<double>(0, 0, 0) : Vector3<double>(-out[1], out[0], 0) / std::sqrt(r);
    body.mass = i == 0 ? 1.0 : 1e-6;
    space.addBody(body);
  }
  const double energy = space.energyLedger().total();
  const Stopwatch watch;
  for (auto _ : state) {
    if (oneByOne) {
      for (std::size_t i = 0; i < 1000; ++i) {
        space.computeDynamics(i);
      }
    } else {
      space.advanceTo(space.time() + 1000 * config.timeStep);
    }
  }
  state.counters["ns_per_step"] = watch.nanoseconds() / static_cast<double>(space.steps());
  state.counters["energy_error"] = std::abs(space.energyLedger().total() / energy - 1.0);
}
BENCHMARK_CAPTURE(FewPoints, advanceTo, false)->Arg(2)->Arg(3)->Arg(6)->Arg(10);
BENCHMARK_CAPTURE(FewPoints, computeDynamics, true)->Arg(2)->Arg(3)->Arg(6)->Arg(10);

}  // namespace
