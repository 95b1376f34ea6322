/// A ball is dropped on a floor. What one learns: a configuration, a space, a body, a plane, a field, a step.
///
/// Each bounce keeps 0.8 of the speed, so the heights fall by 0.64.

#include <gravel/gravel.hpp>

#include <cstdio>

int main() {
  gravel::SimulationConfig<double> config;
  config.G = 0.0;          // no gravity between bodies
  config.timeStep = 1e-4;  // [s]
  config.adaptiveTimeStep = false;
  config.coeffRestitution = 0.8;

  gravel::Space<double> space(config);
  gravel::Body<double> ball;
  ball.position = {0.0, 0.0, 1.1};  // [m]; its lowest point is 1 m above the floor
  ball.mass = 2.0;                  // [kg]
  ball.radius = 0.1;                // [m]
  space.addBody(ball);
  space.addPlane({0.0, 0.0, 1.0}, 0.0);      // the half-space z >= 0 is free
  space.setUniformField({0.0, 0.0, -9.81});  // [m s^-2]

  std::printf("bounce   time [s]   height after it [m]   expected\n");
  double expected = 1.0, hit = 0.0;
  for (int bounce = 0; bounce < 6;) {
    const double before = space.body(0).velocity().z();
    space.computeDynamics(space.steps());
    const double after = space.body(0).velocity().z();
    if (before < 0.0 && after > 0.0) {
      hit = space.time();
    } else if (before > 0.0 && after <= 0.0) {  // the top of the flight
      expected *= 0.8 * 0.8;
      std::printf("%6d   %8.4f   %19.5f   %8.5f\n", ++bounce, hit, space.body(0).position().z() - 0.1,
                  expected);
    }
  }
}
