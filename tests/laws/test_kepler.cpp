#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/other_spaces.hpp"

using namespace gravel;
using namespace gravel::test;

namespace {

using Real80 = long double;

struct OrbitErrors {
  Real80 energy = 0;      ///< largest |dE/E| in the first orbit
  Real80 position = 0;    ///< after the first orbit, over the apocentre
  Real80 precession = 0;  ///< revolutions an orbit
};

template <class S>
SimulationConfig<S> orbitConfig(IntegratorKind kind, int n) {
  SimulationConfig<S> config = plain<S>(2 * pi<S>() / S(n));
  config.G = S(1);
  config.integrator = kind;
  return config;
}

template <class S>
void addAll(Space<S>& space, const std::vector<Body<S>>& bodies) {
  for (const Body<S>& body : bodies) {
    space.addBody(body);
  }
}

/// Position and velocity of the second body relative to the first.
template <class S>
std::pair<Vector3<S>, Vector3<S>> relative(const Space<S>& space) {
  return {space.body(1).position() - space.body(0).position(),
          space.body(1).velocity() - space.body(0).velocity()};
}

/// Direction of the apsis: angle of the Laplace-Runge-Lenz vector.
template <class S>
S apsis(const std::pair<Vector3<S>, Vector3<S>>& s) {
  const Vector3<S> a = s.second.cross(s.first.cross(s.second)) - s.first / s.first.norm();
  return std::atan2(-a[1], -a[0]);  // 0 at the start, where it points to -x
}

/// In long double, so that rounding does not hide the method's constants.
OrbitErrors orbit(IntegratorKind kind, Real80 e, int n, Real80 share) {
  Space<Real80> space(orbitConfig<Real80>(kind, n));
  addAll(space, scenes::keplerPair<Real80>(e, share));
  const auto energy = [&] {
    const auto [x, v] = relative(space);
    return v.squaredNorm() / 2 - 1 / x.norm();
  };
  const Real80 start = energy();
  const Vector3<Real80> place = relative(space).first;
  OrbitErrors errors;
  for (int i = 0; i < n; ++i) {
    space.computeDynamics(static_cast<std::size_t>(i));
    errors.energy = std::max(errors.energy, std::abs(energy() / start - 1));
  }
  errors.position = (relative(space).first - place).norm() / (1 + e);
  if (e > 0) {
    errors.precession = apsis(relative(space)) / (2 * pi<Real80>());
  }
  return errors;
}

void checkConstant(const char* what, Real80 got, Real80 expected) {
  INFO(what << ": " << static_cast<double>(got) << ", published " << static_cast<double>(expected));
  CHECK_THAT(static_cast<double>(got / expected), WithinAbs(1.0, 0.05));
}

}  // namespace

// Published asymptotic constants of kick-drift-kick leapfrog, both sides: a smaller error would mean that the
// test does not test it. Seen to fail: one kick of the whole step (symplectic Euler).
TEST_CASE("Velocity Verlet makes the published errors on Kepler orbits, to 5 %") {
  for (const Real80 share : {0.0L, 0.3L}) {  // about a centre that rests, and two bodies that both move
    for (const int n : {1000, 10000}) {
      CAPTURE(static_cast<double>(share), n);
      const Real80 n2 = Real80(n) * Real80(n);
      const OrbitErrors circle = orbit(IntegratorKind::VelocityVerlet, 0.0L, n, share);
      checkConstant("e = 0, energy", circle.energy, 3.9e2L / (n2 * n2));
      checkConstant("e = 0, position", circle.position, std::pow(2 * pi<Real80>(), 3.0L) / 3 / n2);
      const OrbitErrors half = orbit(IntegratorKind::VelocityVerlet, 0.5L, n, share);
      checkConstant("e = 0.5, energy", half.energy, 1.05e2L / n2);
      checkConstant("e = 0.5, position", half.position, 1.50e2L / n2);
      checkConstant("e = 0.5, precession", half.precession, -24.9L / n2);
    }
    const OrbitErrors long_ = orbit(IntegratorKind::VelocityVerlet, 0.9L, 10000, share);
    checkConstant("e = 0.9, energy", long_.energy, 9.2e4L / 1e8L);
    checkConstant("e = 0.9, position", long_.position, 1.09e4L / 1e8L);
    checkConstant("e = 0.9, precession", long_.precession, -1.73e3L / 1e8L);
  }
}

TEST_CASE("Yoshida's fourth order makes the published errors on a Kepler orbit, to 5 %") {
  for (const int n : {1000, 10000}) {
    CAPTURE(n);
    const Real80 n4 = std::pow(Real80(n), 4.0L);
    const OrbitErrors half = orbit(IntegratorKind::Yoshida4, 0.5L, n, 0.3L);
    checkConstant("e = 0.5, energy", half.energy, 3.3e4L / n4);
    checkConstant("e = 0.5, position", half.position, 2.1e5L / n4);
  }
}

TEST_CASE("Errors of an orbit fall with the order of the method, both sides") {
  struct Row {
    IntegratorKind kind;
    double order;
    double tolerance;
  };
  for (const Row& row : {Row{IntegratorKind::VelocityVerlet, 2.0, 0.02},
                         Row{IntegratorKind::Yoshida4, 4.0, 0.05}, Row{IntegratorKind::Yoshida6, 6.0, 0.1}}) {
    const OrbitErrors coarse = orbit(row.kind, 0.5L, 1000, 0.0L);
    const OrbitErrors fine = orbit(row.kind, 0.5L, 2000, 0.0L);
    CAPTURE(traitsOf(row.kind).name);
    CHECK_THAT(static_cast<double>(std::log2(coarse.energy / fine.energy)),
               WithinAbs(row.order, row.tolerance));
    CHECK_THAT(static_cast<double>(std::log2(coarse.position / fine.position)),
               WithinAbs(row.order, row.tolerance));
  }
}

// The position error of a fixed step grows linearly: the orbit is run with a slightly wrong period.
TEST_CASE("The position error of leapfrog grows linearly with time") {
  const int n = 1000;
  Space<double> space(orbitConfig<double>(IntegratorKind::VelocityVerlet, n));
  addAll(space, scenes::keplerPair<double>(0.5, 0.0));
  const Vec start = relative(space).first;
  advance(space, n);
  const double one = (relative(space).first - start).norm();
  advance(space, 9 * n);
  CHECK_THAT((relative(space).first - start).norm() / one, WithinRel(10.0, 0.02));
}

TEST_CASE("Angular momentum of an orbit is kept to rounding, in double") {
  for (const int n : {1000, 10000}) {
    for (const double e : {0.0, 0.5, 0.9}) {
      for (const double share : {0.0, 0.3}) {
        Space<double> space(orbitConfig<double>(IntegratorKind::VelocityVerlet, n));
        addAll(space, scenes::keplerPair<double>(e, share));
        const double start = relative(space).first.cross(relative(space).second)[2];
        double worst = 0;
        for (int i = 0; i < n; ++i) {
          space.computeDynamics(static_cast<std::size_t>(i));
          const auto [x, v] = relative(space);
          worst = std::max(worst, std::abs(x.cross(v)[2] / start - 1));
        }
        CAPTURE(n, e, share);
        // 1e-14 for a circle of 1000 steps; kicks of two bodies round twice, and 1e4 steps ten times as
        // often.
        CHECK(worst <= (e == 0.0 && n == 1000 ? 1e-14 : e == 0.0 ? 3e-14 : 1e-13));
      }
    }
  }
}

// Forward, velocities turned round, and back. 2000 steps that round by 1e-16 each, and an orbit that carries
// errors on linearly.
TEST_CASE("A run through the space goes backwards to where it began") {
  for (const IntegratorKind kind :
       {IntegratorKind::VelocityVerlet, IntegratorKind::Yoshida4, IntegratorKind::Yoshida6}) {
    Space<double> space(orbitConfig<double>(kind, 1000));
    addAll(space, scenes::keplerPair<double>(0.5, 0.3));
    const auto [x0, v0] = relative(space);
    advance(space, 1000);
    for (std::size_t i = 0; i < 2; ++i) {
      space.body(i).velocity() = -Vec(space.body(i).velocity());
    }
    advance(space, 1000);
    const auto [x, v] = relative(space);
    CAPTURE(traitsOf(kind).name);
    CHECK((x - x0).norm() <= 1e-12);
    CHECK((v + v0).norm() <= 1e-12);
  }
}

namespace {

/// Largest |dE/E| in orbits 1 to 10 and in the last 10 of `orbits`; steps adapt as `Space` has it, or from
/// the state at their start.
std::pair<double, double> adaptiveErrors(double e, int orbits, bool reversible) {
  SimulationConfig<double> config;
  config.G = 1.0;
  config.timeStep = 1.0;
  config.adaptiveTimeStep = reversible;
  Space<double> space(config);
  addAll(space, scenes::keplerPair<double>(e, 0.3));
  const auto energy = [&] {
    const auto [x, v] = relative(space);
    return v.squaredNorm() / 2 - 1 / x.norm();
  };
  const double start = energy();
  double first = 0;
  double last = 0;
  const double period = 2 * pi<double>();
  while (space.time() < period * orbits) {
    if (!reversible) {
      space.setTimeStep(stepFromEncounters(space.bodies(), 1.0, 0.0, StepLimits<double>{0.02, 0.0, 1.0}));
    }
    space.computeDynamics(space.steps());
    const double error = std::abs(energy() / start - 1);
    if (space.time() < 10 * period) {
      first = std::max(first, error);
    } else if (space.time() > (orbits - 10) * period) {
      last = std::max(last, error);
    }
  }
  CHECK_THAT(double(space.steps()) / orbits, WithinRel(e < 0.6 ? 334.0 : e < 0.95 ? 435.0 : 609.0, 0.02));
  return {first, last};
}

}  // namespace

// Adaptive steps without drift: the error within an orbit (5e-5 at e = 0.5, of second order) is there, and is
// the same a thousand orbits later; steps from the state at their start drift linearly, by 1e-4 an orbit at e
// = 0.9. The exponent is 0.00; 0.3 is what the problem allows. Seen to fail: the step wanted in place of the
// reversible.
TEST_CASE("Adaptive steps make no drift in a thousand orbits, where steps from the state do") {
  for (const double e : {0.5, 0.9, 0.99}) {
    const int orbits = e == 0.9 ? 1000 : 200;
    const auto [first, last] = adaptiveErrors(e, orbits, true);
    const double slope = std::log(last / first) / std::log(orbits / 10.0);
    CAPTURE(e, first, last);
    CHECK(slope < 0.05);
    CHECK(slope > -0.05);
    CHECK(first < 0.05);
    CHECK(first > 1e-5);  // the error of the method within an orbit
  }
  const auto [first, last] = adaptiveErrors(0.9, 200, false);
  CHECK(last / first > 5.0);
  CHECK(last > 0.01);
}

// A run with adaptive steps, velocities turned round at its end, ends where it began: the steps are taken
// again in the other order, to rounding.
TEST_CASE("An adaptive run goes backwards through its own steps") {
  SimulationConfig<double> config;
  config.G = 1.0;
  config.timeStep = 1.0;
  for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::BlanesMoan4}) {
    config.integrator = kind;
    Space<double> space(config);
    addAll(space, scenes::keplerPair<double>(0.9, 0.3));
    const auto [x0, v0] = relative(space);
    std::vector<double> steps;
    for (int i = 0; i < 1000; ++i) {
      space.computeDynamics(space.steps());
      steps.push_back(space.getPreviousTimeStep());
    }
    CHECK(*std::max_element(steps.begin(), steps.end()) > 10 * *std::min_element(steps.begin(), steps.end()));
    // The step to come belongs to the way on; the way back takes the last one again.
    SimulationConfig<double> back = config;
    back.adaptiveTimeStep = false;
    back.timeStep = steps.back();
    Space<double> mirror(back);
    for (std::size_t i = 0; i < 2; ++i) {
      Body<double> body = space.body(i).load();
      body.velocity = -body.velocity;
      mirror.addBody(body);
    }
    for (std::size_t i = steps.size(); i-- > 0;) {
      mirror.setTimeStep(steps[i]);
      mirror.computeDynamics(0);
      const double wanted = stepFromEncounters(mirror.bodies(), 1.0, 0.0, StepLimits<double>{0.02, 0.0, 1.0});
      if (i > 0) {
        CHECK_THAT(reversibleStep(steps[i], wanted), WithinRel(steps[i - 1], 1e-9));
      }
    }
    const auto [x, v] = relative(mirror);
    CHECK((x - x0).norm() < 1e-10);
    CHECK((v + v0).norm() < 1e-10);
  }
}
