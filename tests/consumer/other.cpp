#include <gravel/gravel.hpp>

double heightAfter(double seconds) {
  gravel::SimulationConfig<double> config;
  config.bodyCount = 0;
  config.G = 0;
  config.timeStep = 1e-3;
  config.adaptiveTimeStep = false;
  config.linearDamping = 0;
  config.angularDamping = 0;
  gravel::Space<double, gravel::SoA> space(config);
  gravel::Body<double> ball;
  ball.position = {0, 0, 2};
  ball.mass = 2;
  ball.radius = 0.1;
  space.addBody(ball);
  space.addPlane({0, 0, 1}, 0.0);
  space.setUniformField({0, 0, -9.81});
  space.advanceTo(seconds);
  return space.body(0).position()[2];
}
