/// Three bodies chase each other on one figure-eight. What one learns: `advanceTo`, what an isolated system
/// keeps, and how far a method of sixth order comes back to where it began.

#include "scenes/scenes.hpp"
#include <gravel/gravel.hpp>

#include <cstdio>

int main() {
  const auto start = gravel::scenes::figureEight<double>();
  gravel::SimulationConfig<double> config;
  config.G = 1.0;
  config.timeStep = gravel::scenes::figureEightPeriod / 1000;
  config.adaptiveTimeStep = false;
  config.integrator = gravel::IntegratorKind::Yoshida6;
  gravel::Space<double> space(config);
  for (const auto& body : start) {
    space.addBody(body);
  }

  std::printf("periods   distance from the start   |momentum|   |angular momentum|\n");
  for (int period = 1; period <= 10; ++period) {
    space.advanceTo(gravel::scenes::figureEightPeriod * period);
    double worst = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      worst = std::max(worst, (space.body(i).position() - start[i].position).norm());
    }
    const auto kept = space.conserved();
    std::printf("%7d   %23.1e   %10.1e   %18.1e\n", period, worst, kept.momentum.norm(),
                kept.angularMomentum.norm());
  }
}
