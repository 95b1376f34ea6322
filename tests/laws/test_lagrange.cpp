#include "laws/laws.hpp"
#include "support/catch.hpp"

#include <unsupported/Eigen/AutoDiff>

using namespace gravel;
using namespace gravel::test;

namespace {

using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 1, 1>>;

/// Lagrange's triangle of side 1 and mass 1, so that omega = 1; the first body's x carries the derivative.
Space<Dual> triangle(IntegratorKind kind, double step) {
  SimulationConfig<Dual> config = plain<Dual>(Dual(step));
  config.G = Dual(1.0);
  config.integrator = kind;
  Space<Dual> space(config);
  for (int k = 0; k < 3; ++k) {
    const double angle = 2 * pi<double>() * k / 3;
    const double r = 1 / std::sqrt(3.0);
    Body<Dual> body;
    body.mass = Dual(1.0 / 3.0);
    body.position = {Dual(r * std::cos(angle)), Dual(r * std::sin(angle)), Dual(0.0)};
    body.velocity = {Dual(-r * std::sin(angle)), Dual(r * std::cos(angle)), Dual(0.0)};
    if (k == 0) {
      body.position[0].derivatives()[0] = 1.0;
    }
    space.addBody(body);
  }
  return space;
}

double sensitivity(const Space<Dual>& space) {
  double sum = 0;
  for (std::size_t i = 0; i < space.n(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const Dual x = space.body(i).position()[c];
      sum += x.derivatives().squaredNorm();
    }
  }
  return std::sqrt(sum);
}

}  // namespace

// Equal masses: lambda^2 + omega^2 lambda^2 … has the roots omega (+-1/sqrt 2 +- i) (Gascheau 1843; Routh
// 1875), so that a disturbance grows by exp(2 pi/sqrt 2) in every turn, once the other modes are left behind.
// The parts that grow with t alone are a hundredth after two turns and vanish against the next.
TEST_CASE("A disturbed triangle of Lagrange departs at the rate omega over the root of two") {
  const double turn = 2 * pi<double>();
  for (const IntegratorKind kind : {IntegratorKind::GaussRadau15, IntegratorKind::KahanLi8}) {
    const int steps = kind == IntegratorKind::GaussRadau15 ? 1 : 60;
    Space<Dual> space = triangle(kind, turn / steps);
    advance(space, static_cast<std::size_t>(2 * steps));
    const double before = sensitivity(space);
    advance(space, static_cast<std::size_t>(steps));
    const double rate = std::log(sensitivity(space) / before) / turn;
    CAPTURE(traitsOf(kind).name);
    CHECK_THAT(rate, WithinRel(std::sqrt(0.5), 0.01));
    // The triangle itself is still one: 85^3 times the rounding of the start.
    const Dual x = space.body(0).position()[0];
    CHECK_THAT(x.value(), WithinAbs(1 / std::sqrt(3.0), 1e-9));
  }
}
