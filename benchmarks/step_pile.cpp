/// Whole steps of a settled pile of equal spheres in an open box under gravity, with the error beside the
/// time: overlap over radius, kinetic energy over m g R a body, and the weight that floor and walls carry.

#include "stopwatch.hpp"
#include <gravel/gravel.hpp>

#include <benchmark/benchmark.h>

#include <map>
#include <memory>

namespace {

using namespace gravel;

constexpr double radius = 0.5;
constexpr double g = 9.81;

/// Drops n spheres from a loose lattice into a box whose floor holds a square of them, and waits until they
/// rest.
std::shared_ptr<const Space<double>> settledPile(std::size_t n) {
  static std::map<std::size_t, std::shared_ptr<const Space<double>>> known;
  auto& pile = known[n];
  if (pile) {
    return pile;
  }
  SimulationConfig<double> config;
  config.G = 0.0;
  config.timeStep = 1.0 / 60.0;
  config.adaptiveTimeStep = false;
  config.coeffRestitution = 0.0;
  config.coeffFriction = 0.5;
  config.coeffStaticFriction = 0.5;
  auto space = std::make_shared<Space<double>>(config);
  const auto side = static_cast<std::size_t>(std::cbrt(static_cast<double>(n)) + 0.5);
  const double width = 1.1 * static_cast<double>(side) * 2.0 * radius;
  space->addPlane({0, 0, 1}, 0.0);
  for (const double s : {-1.0, 1.0}) {
    space->addPlane({s, 0, 0}, -width / 2.0);
    space->addPlane({0, s, 0}, -width / 2.0);
  }
  space->setUniformField({0, 0, -g});
  const CounterRandom random(1);
  const double spacing = width / static_cast<double>(side);
  for (std::size_t i = 0; i < n; ++i) {
    Body<double> grain;
    const double jitter = 0.04;
    const auto coordinate = [&](std::size_t k, std::uint64_t axis) {
      return (static_cast<double>(k) + 0.5) * spacing - width / 2.0 +
             random.uniform(3 * i + axis, -jitter, jitter);
    };
    grain.position = {coordinate(i % side, 0), coordinate(i / side % side, 1),
                      radius + jitter + static_cast<double>(i / (side * side)) * 2.2 * radius};
    grain.radius = radius;
    grain.mass = 1.0;
    space->addBody(grain);
  }
  for (std::size_t i = 0; i < 1200; ++i) {
    space->computeDynamics(i);
  }
  pile = space;
  return pile;
}

void Pile(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  Space<double> space = *settledPile(n);
  std::size_t step = 0;
  std::size_t iterations = 0;
  const Stopwatch watch;
  for (auto _ : state) {
    space.computeDynamics(step++);
    iterations += static_cast<std::size_t>(space.contactReport().iterations);
  }
  const double spent = watch.nanoseconds();
  double overlap = 0.0;
  double largest = 0.0;
  double down = 0.0;
  const std::vector<ContactImpulse<double>> impulses = space.contactImpulses();
  for (std::size_t k = 0; k < space.contacts().size(); ++k) {
    const Contact<double>& contact = space.contacts()[k];
    overlap += std::max(0.0, -contact.gap);
    largest = std::max(largest, -contact.gap);
    if (contact.second == staticPartner) {  // floor and walls, which carry their part by friction
      down += impulses[k].normal * contact.normal.z() + impulses[k].tangential.z();
    }
  }
  const double bodies = static_cast<double>(n);
  const double contacts = static_cast<double>(space.contactCount());
  state.counters["contacts"] = contacts;
  state.counters["sweeps"] = static_cast<double>(iterations) / static_cast<double>(step);
  state.counters["ns_per_body"] = spent / static_cast<double>(step) / bodies;
  state.counters["mean_overlap_R"] = overlap / contacts / radius;
  state.counters["max_overlap_R"] = largest / radius;
  state.counters["KE_mgR"] = std::get<0>(space.calculateSystemEnergy()) / (bodies * g * radius);
  state.counters["weight_error"] = -down / (bodies * g * space.getPreviousTimeStep()) - 1.0;
}
BENCHMARK(Pile)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond);

}  // namespace
