/// Run time against error: every integrator on a Kepler orbit of e = 0.9, the outer solar system, a Plummer
/// sphere of 1000 bodies, a tight binary among 300, a bounce under mutual gravity and a patch of a ring, over
/// a range of steps. Writes comma-separated values to standard output:
///   problem,integrator,step,seconds,force_calls,energy_error,position_error
/// (force calls for all bodies; those for some bodies count by their share)
/// `bench_integrators [problem]`; benchmarks/integrators.py draws the plots. Processor seconds of one thread:
/// set OMP_NUM_THREADS=1.

#include "scenes/scenes.hpp"
#include "stopwatch.hpp"
#include <gravel/gravel.hpp>

#include <cstdio>
#include <string>

namespace {

using namespace gravel;

struct Problem {
  const char* name;
  std::vector<Body<double>> bodies;
  double G = 1.0;
  double softening = 0.0;
  double end = 0.0;  ///< [time]
  double restitution = 1.0;
  std::vector<int> forces;                   ///< force evaluations of a run, about
  double omega = 0.0;                        ///< not 0: a shear-periodic box of side 10
  std::vector<Vector3<double>> reference{};  ///< places at the end
};

double energyOf(const Space<double>& space) { return space.energyLedger().total(); }

/// \param step 0: the method's own, or adaptive with `factor`
void run(const Problem& problem, IntegratorKind kind, double step, double factor,
         std::vector<Vector3<double>>* end = nullptr) {
  SimulationConfig<double> config;
  config.G = problem.G;
  config.softening = problem.softening;
  config.integrator = kind;
  config.gravity = GravityKind::Direct;
  config.coeffRestitution = problem.restitution;
  config.coeffFriction = config.coeffStaticFriction = 0.0;
  config.adaptiveTimeStep = !(step > 0.0);
  config.timeStep = step > 0.0 ? step : problem.end / 16;
  config.timeStepFactor = factor;
  Space<double> space(config);
  if (problem.omega != 0.0) {
    space.setDomain(Domain<double>::shearPeriodic({10, 10, 10}, problem.omega));
  }
  for (const Body<double>& body : problem.bodies) {
    space.addBody(body);
  }
  const double start = energyOf(space);
  double energy = 0.0;
  double seconds = 0.0;
  for (int look = 1; look <= 16; ++look) {
    const Stopwatch watch;
    space.advanceTo(problem.end * look / 16);
    seconds += 1e-9 * watch.nanoseconds();
    energy = std::max(energy, std::abs(energyOf(space) / start - 1.0));
  }
  double place = 0.0;
  double size = 0.0;
  for (std::size_t i = 0; i < space.n(); ++i) {
    const Vector3<double> x = space.body(i).position();
    if (end != nullptr) {
      end->push_back(x);
    } else {
      place +=
          space.domain().minimumImage(Vector3<double>(x - problem.reference[i]), space.time()).squaredNorm();
    }
    size += x.squaredNorm();
  }
  const bool ownSteps = traitsOf(kind).forceEvaluations == 0;
  const std::uint64_t calls =
      space.profiler().entry(Phase::Gravity).calls + space.individualSteps() / space.n();
  std::printf("%s,%s%s,%.6g,%.6g,%llu,%.4g,%.4g\n", problem.name, traitsOf(kind).name,
              step > 0.0 || ownSteps ? "" : " adaptive", step > 0.0 ? step : factor, seconds,
              static_cast<unsigned long long>(calls), energy, std::sqrt(place / size));
  std::fflush(stdout);
}

void sweep(Problem problem) {
  if (problem.omega != 0.0) {
    const IntegratorKind kind = IntegratorKind::SymplecticEpicycle;
    run(problem, kind, problem.end / (4 * problem.forces.back()), 0.02, &problem.reference);
    for (const int steps : problem.forces) {
      run(problem, kind, problem.end / steps, 0.02);
    }
    return;
  }
  const bool points = !(problem.restitution < 1.0);
  if (points && problem.reference.empty()) {
    run(problem, IntegratorKind::GaussRadau15, 0.0, 0.02, &problem.reference);
  } else if (points) {
    run(problem, IntegratorKind::GaussRadau15, 0.0, 0.02);
  }
  std::vector<IntegratorKind> kinds{
      IntegratorKind::VelocityVerlet, IntegratorKind::Yoshida4,    IntegratorKind::Yoshida6,
      IntegratorKind::Yoshida8,       IntegratorKind::BlanesMoan4, IntegratorKind::BlanesMoan6,
      IntegratorKind::KahanLi6,       IntegratorKind::KahanLi8,    IntegratorKind::ForceGradient4};
  if (std::string(problem.name) == "outer solar system") {
    kinds.push_back(IntegratorKind::WisdomHolman);
  }
  for (const IntegratorKind kind : kinds) {
    for (const int forces : problem.forces) {
      const int steps = forces / traitsOf(kind).forceEvaluations / 16 * 16;  // whole steps between two looks
      if (steps >= 16) {
        run(problem, kind, problem.end / steps, 0.02);
      }
    }
  }
  if (points) {
    for (const double factor : {0.08, 0.02, 0.005, 1.25e-3, 3.1e-4, 7.8e-5, 2e-5}) {
      run(problem, IntegratorKind::Hermite4, 0.0, factor);
    }
    for (const IntegratorKind kind :
         {IntegratorKind::VelocityVerlet, IntegratorKind::BlanesMoan4, IntegratorKind::BlanesMoan6}) {
      const int calls = traitsOf(kind).forceEvaluations;
      for (const double factor : {0.16, 0.08, 0.04, 0.02, 0.01}) {
        run(problem, kind, 0.0, std::min(1.0, factor * std::sqrt(calls)));
      }
    }
  }
}

std::vector<int> doublings(int first, int last) {
  std::vector<int> list;
  for (int n = first; n <= last; n *= 2) {
    list.push_back(n);
  }
  return list;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string only = argc > 1 ? argv[1] : "";
  const auto wanted = [&](const char* name) { return only.empty() || only == name; };
  std::printf("problem,integrator,step,seconds,force_calls,energy_error,position_error\n");
  if (wanted("kepler")) {
    const auto pair = scenes::keplerPair<double>(0.9, 1e-3);
    // 32 whole orbits: every look is at apocentre.
    sweep({.name = "kepler",
           .bodies = pair,
           .end = 64 * pi<double>(),
           .forces = doublings(16384, 1 << 20),
           .reference = {pair[0].position, pair[1].position}});
  }
  if (wanted("outer solar system")) {
    auto planets = scenes::outerSolarSystem<double>();
    scenes::centre(planets);
    sweep({.name = "outer solar system",
           .bodies = planets,
           .G = scenes::outerSolarSystemG,
           .end = 433200.0,
           .forces = doublings(2048, 1 << 18)});
  }
  if (wanted("plummer")) {
    sweep({.name = "plummer",
           .bodies = scenes::plummerSphere<double>(1000),
           .softening = 0.05,
           .end = 2.0,
           .forces = doublings(64, 1024)});
  }
  if (wanted("binary")) {
    // A period of 2.4e-3: 41 orbits, while the others move by a tenth of their distance.
    auto bodies = scenes::plummerSphere<double>(300);
    Body<double> other = bodies[0];
    bodies[0].position[0] += 0.5e-3;
    other.position[0] -= 0.5e-3;
    const double speed = std::sqrt(2 * other.mass / 1e-3);
    bodies[0].velocity[1] += speed / 2;
    other.velocity[1] -= speed / 2;
    bodies.push_back(other);
    sweep({.name = "binary", .bodies = bodies, .end = 0.1, .forces = doublings(1024, 1 << 14)});
  }
  if (wanted("bounce")) {
    // Two spheres fall on each other from rest at distance 2; between the first and the second impact their
    // distance is 8/7 at most, half way.
    Body<double> one;
    one.position = {-1, 0, 0};
    one.radius = 0.5;
    Body<double> two = one;
    two.position = {1, 0, 0};
    sweep({.name = "bounce",
           .bodies = {one, two},
           .end = (1.817827515726 + 2.663394482446) / 2,
           .restitution = 0.5,
           .forces = doublings(256, 1 << 16),
           .reference = {{-4.0 / 7, 0, 0}, {4.0 / 7, 0, 0}}});
  }
  if (wanted("ring patch")) {
    // Points in the flow v_y = -(3/2) Omega x, which pull each other and their images; an orbit.
    std::vector<Body<double>> bodies(32);
    const CounterRandom random(5);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].position = {random.uniform(3 * i, -5, 5), random.uniform(3 * i + 1, -5, 5),
                            random.uniform(3 * i + 2, -1, 1)};
      bodies[i].velocity[1] = -1.5 * bodies[i].position[0];
    }
    sweep({.name = "ring patch",
           .bodies = bodies,
           .G = 0.02,
           .softening = 0.2,
           .end = 2 * pi<double>(),
           .forces = doublings(32, 512),
           .omega = 1.0});
  }
}
