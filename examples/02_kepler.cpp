/// A planet on an eccentric orbit, with three integrators. What one learns: gravity, units of one's own, the
/// choice of integrator, the energy ledger.
///
/// Half the step: the error of a method of order p falls by 2^p.

#include "scenes/scenes.hpp"
#include <gravel/gravel.hpp>

#include <cstdio>

namespace {

/// Largest relative error of the energy over ten orbits with so many steps an orbit.
double energyError(gravel::IntegratorKind integrator, int stepsPerOrbit) {
  gravel::SimulationConfig<double> config;
  config.G = 1.0;  // with masses and the semi-major axis 1 an orbit takes 2 pi
  config.timeStep = 2.0 * gravel::pi<double>() / stepsPerOrbit;
  config.adaptiveTimeStep = false;
  config.integrator = integrator;
  gravel::Space<double> space(config);
  for (const auto& body : gravel::scenes::keplerPair<double>(0.5, 1e-3)) {
    space.addBody(body);
  }
  const double start = space.energyLedger().total();
  double worst = 0.0;
  for (int i = 0; i < 10 * stepsPerOrbit; ++i) {
    space.computeDynamics(space.steps());
    worst = std::max(worst, std::abs(space.energyLedger().total() / start - 1.0));
  }
  return worst;
}

}  // namespace

int main() {
  std::printf("steps an orbit   velocity Verlet     Yoshida 4     Yoshida 6\n");
  for (const int steps : {250, 500, 1000, 2000}) {
    std::printf("%14d", steps);
    for (const auto integrator : {gravel::IntegratorKind::VelocityVerlet, gravel::IntegratorKind::Yoshida4,
                                  gravel::IntegratorKind::Yoshida6}) {
      std::printf("   %13.2e", energyError(integrator, steps));
    }
    std::printf("\n");
  }
}
