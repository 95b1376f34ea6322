/// How fast does a small error grow? Lagrange's triangle with dual numbers for scalars. What one learns: a
/// Space of any scalar, derivatives of a whole simulation.
///
/// Three equal masses at the corners of a triangle go round for ever, unless one of them is off by a little:
/// the error grows as exp(omega t / sqrt 2), 85-fold a turn.

#include <gravel/gravel.hpp>

#include <unsupported/Eigen/AutoDiff>

#include <cstdio>

namespace {

/// A number and its derivative with respect to one start value.
using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 1, 1>>;

/// Length of the derivatives of all positions.
double sensitivity(const gravel::Space<Dual>& space) {
  double sum = 0.0;
  for (std::size_t i = 0; i < space.n(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const Dual x = space.body(i).position()[c];
      sum += x.derivatives().squaredNorm();
    }
  }
  return std::sqrt(sum);
}

}  // namespace

int main() {
  const double turn = 2.0 * gravel::pi<double>();
  gravel::SimulationConfig<Dual> config;
  config.G = Dual(1.0);
  config.timeStep = Dual(turn);
  config.adaptiveTimeStep = false;  // a look every turn; the method takes its own steps between
  config.integrator = gravel::IntegratorKind::GaussRadau15;
  gravel::Space<Dual> space(config);
  for (int k = 0; k < 3; ++k) {
    const double angle = turn * k / 3;
    gravel::Body<Dual> body;
    // Side 1 and mass 1/3 each: omega^2 = G M / side^3 = 1.
    const double r = 1.0 / std::sqrt(3.0);
    body.mass = Dual(1.0 / 3.0);
    body.position = {Dual(r * std::cos(angle)), Dual(r * std::sin(angle)), Dual(0.0)};
    body.velocity = {Dual(-r * std::sin(angle)), Dual(r * std::cos(angle)), Dual(0.0)};
    if (k == 0) {
      body.position[0].derivatives()[0] = 1.0;  // everything by this number
    }
    space.addBody(body);
  }
  std::printf("turn   d(places)/d(x of body 1)   rate/omega (sqrt(1/2) = %.4f)\n", std::sqrt(0.5));
  double before = sensitivity(space);
  for (int n = 1; n <= 4; ++n) {
    space.computeDynamics(space.steps());
    const double now = sensitivity(space);
    std::printf("%4d   %24.6g   %.4f\n", n, now, std::log(now / before) / turn);
    before = now;
  }
}
