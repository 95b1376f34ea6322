#include "laws/laws.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

/// Lagrange's triangle of side 1 and mass 1, so that omega = 1; the first body is off by so much.
Space<double> triangle(IntegratorKind kind, double step, double off) {
  SimulationConfig<double> config = plain(step);
  config.G = 1.0;
  config.integrator = kind;
  Space<double> space(config);
  for (int k = 0; k < 3; ++k) {
    const double angle = 2 * pi<double>() * k / 3;
    const double r = 1 / std::sqrt(3.0);
    Body<double> body;
    body.mass = 1.0 / 3.0;
    body.position = {r * std::cos(angle) + (k == 0 ? off : 0.0), r * std::sin(angle), 0.0};
    body.velocity = {-r * std::sin(angle), r * std::cos(angle), 0.0};
    space.addBody(body);
  }
  return space;
}

double distance(const Space<double>& a, const Space<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.n(); ++i) {
    sum += (a.body(i).position() - b.body(i).position()).squaredNorm();
  }
  return std::sqrt(sum);
}

}  // namespace

// Equal masses: lambda^2 + omega^2 lambda^2 … has the roots omega (+-1/sqrt 2 +- i) (Gascheau 1843; Routh
// 1875), so that a disturbance grows by exp(2 pi/sqrt 2) in every turn, once the other modes are left behind.
// The parts that grow with t alone are a hundredth after two turns and vanish against the next. Two triangles
// 2e-9 apart are 1e-3 apart after the third turn: their rounding, 1e-16 that grows alike, is 1e-7 of that,
// and what is cubic in it 1e-6. (The same with derivatives in place of differences:
// examples/08_sensitivity.cpp.)
TEST_CASE("A disturbed triangle of Lagrange departs at the rate omega over the root of two") {
  const double turn = 2 * pi<double>();
  const double off = 1e-9;
  for (const IntegratorKind kind : {IntegratorKind::GaussRadau15, IntegratorKind::KahanLi8}) {
    CAPTURE(traitsOf(kind).name);
    const std::size_t steps = kind == IntegratorKind::GaussRadau15 ? 1 : 60;
    const double step = turn / static_cast<double>(steps);
    Space<double> one = triangle(kind, step, -off);
    Space<double> other = triangle(kind, step, off);
    advance(one, 2 * steps);
    advance(other, 2 * steps);
    const double before = distance(one, other);
    advance(one, steps);
    advance(other, steps);
    CHECK_THAT(std::log(distance(one, other) / before) / turn, WithinRel(std::sqrt(0.5), 0.01));
    // The triangle itself is still one: 85^3 times the rounding of the start.
    Space<double> itself = triangle(kind, step, 0.0);
    advance(itself, 3 * steps);
    CHECK_THAT(itself.body(0).position()[0], WithinAbs(1 / std::sqrt(3.0), 1e-9));
  }
}
