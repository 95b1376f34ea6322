/// A bowling ball slides, then rolls. What one learns: friction, spin, and where the energy goes.
///
/// Friction slows the ball and turns it until its lowest point stands still: v = 5/7 v0 after
/// t = 2 v0 / (7 mu g), whatever its mass and radius.

#include <gravel/gravel.hpp>

#include <cstdio>

int main() {
  const double v0 = 8.0, mu = 0.12, g = 9.81;
  gravel::SimulationConfig<double> config;
  config.G = 0.0;
  config.timeStep = 1e-4;
  config.adaptiveTimeStep = false;
  config.coeffFriction = mu;
  config.coeffStaticFriction = mu;

  gravel::Space<double> space(config);
  gravel::Body<double> ball;
  ball.radius = 0.1085;
  ball.mass = 7.0;
  ball.position = {0.0, 0.0, ball.radius};
  ball.velocity = {v0, 0.0, 0.0};
  space.addBody(ball);
  space.addPlane({0.0, 0.0, 1.0}, 0.0);
  space.setUniformField({0.0, 0.0, -g});

  const double rolls = 2.0 * v0 / (7.0 * mu * g);
  std::printf("It should roll from t = %.4f s on, at %.4f m/s.\n\n", rolls, 5.0 / 7.0 * v0);
  std::printf("time [s]   speed [m/s]   slip of the lowest point [m/s]\n");
  for (int i = 0; i <= 8; ++i) {
    space.advanceTo(0.3 * i);
    const auto body = space.body(0);
    const double slip = body.velocity().x() - body.radius() * body.angularVelocity().y();
    std::printf("%8.2f   %11.5f   %30.5f\n", space.time(), body.velocity().x(), slip);
  }
  const auto e = space.energyLedger();
  std::printf(
      "\nOf %.2f J of motion it kept %.2f J; friction took %.2f J, two sevenths of the start: %.2f J.\n",
      0.5 * ball.mass * v0 * v0, e.kinetic + e.rotational, e.friction, ball.mass * v0 * v0 / 7.0);
}
