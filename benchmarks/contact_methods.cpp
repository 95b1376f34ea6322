/// Error against time of three ways to solve many contacts at once, on one core, from one neighbour search:
///
///   soft    n substeps a step, each one sweep of damped springs and, after the bodies have moved, one sweep
///           without springs that takes back the speed that they gave ("soft step": E. Catto, "Solver2D",
///           2024, box2d.org/posts/2024/02/solver2d; substeps in place of sweeps: Macklin et al. 2019, "Small
///           steps in physics simulation", SCA 2019); restitution after the last substep
///   PGS     k sweeps of projected Gauss-Seidel a step, then k/2 sweeps that push overlapping bodies apart
///           (nonlinear projection, as in Box2D v2); or overlap as a target velocity of the sweeps (Baumgarte
///           1972)
///   gravel  `Space`, by most sweeps a solve or parts of a step
///
/// The two others are written out in other_contact_methods.hpp. Only their stepping is timed, as gravel's is:
/// search, contacts, solving, motion.
///
///   bench_contact_methods [bodies] [steps to settle] [rounds] [steps a round]

#include "other_contact_methods.hpp"
#include "stopwatch.hpp"

#include <omp.h>

#include <cstdio>
#include <cstdlib>

namespace {

using namespace boxes;

class Gravel : public Method {
 public:
  Gravel(const Scene& scene, const gravel::SimulationConfig<double>& config)
      : space_(spaceOf(scene, config)) {
    name = "gravel";
    parameters = std::to_string(config.contactIterations) + " sweeps at most";
    if (config.contactSubsteps > 1) {
      parameters += ", " + std::to_string(config.contactSubsteps) + " parts";
    }
  }
  void step() override { space_.computeDynamics(steps_++); }
  Errors errors() const override { return errorsOf(space_); }
  double kinetic() const override { return kineticEnergy(space_); }
  double weightError() const override { return space_.supportedWeight().residual(); }
  std::vector<Vec> places() const override { return std::get<0>(space_.getAllBodyTransforms()); }

 private:
  gravel::Space<double> space_;
  std::size_t steps_ = 0;
};

std::vector<std::unique_ptr<Method>> methods(const Scene& scene) {
  std::vector<std::unique_ptr<Method>> all;
  for (const int n : {1, 2, 4, 8}) {
    all.push_back(std::make_unique<Soft>(scene, n, 30));
  }
  for (const int n : {4, 8, 16}) {
    all.push_back(std::make_unique<Soft>(scene, n, 1e9));
  }
  for (const int k : {4, 10, 20, 40}) {
    all.push_back(std::make_unique<Pgs>(scene, k, k / 2));
  }
  for (const int k : {10, 40}) {
    all.push_back(std::make_unique<Pgs>(scene, k, 0));
  }
  gravel::SimulationConfig<double> config;
  for (const unsigned k : {2U, 4U, 8U, 16U}) {
    config.contactTolerance = 1e-2;
    config.contactIterations = k;
    all.push_back(std::make_unique<Gravel>(scene, config));
  }
  config.contactIterations = 2;
  config.contactSubsteps = 2;
  all.push_back(std::make_unique<Gravel>(scene, config));
  if (scene.bodies.size() <= 1000) {  // the defaults, for piles that need many sweeps: long runs
    all.push_back(std::make_unique<Gravel>(scene, gravel::SimulationConfig<double>{}));
  }
  return all;
}

/// Steps all of them in turns. \return processor time [ms] of a step: the median of the rounds
template <class AfterRound>
std::vector<double> timed(std::vector<std::unique_ptr<Method>>& all, std::size_t rounds, std::size_t steps,
                          const AfterRound& after) {
  std::vector<std::vector<double>> times(all.size());
  for (std::size_t r = 0; r < rounds; ++r) {
    for (std::size_t m = 0; m < all.size(); ++m) {
      const Stopwatch watch;
      for (std::size_t k = 0; k < steps; ++k) {
        all[m]->step();
      }
      times[m].push_back(watch.nanoseconds() / 1e6 / static_cast<double>(steps));
      after(m);
    }
  }
  std::vector<double> medians;
  for (const std::vector<double>& of : times) {
    medians.push_back(median(of));
  }
  return medians;
}

void comparePiles(const Scene& scene, std::size_t settle, std::size_t rounds, std::size_t steps) {
  auto all = methods(scene);
  std::vector<std::vector<Vec>> start;
  for (const auto& method : all) {
    for (std::size_t k = 0; k < settle; ++k) {
      method->step();
    }
    start.push_back(method->places());
  }
  std::vector<double> weight(all.size());
  const auto times = timed(all, rounds, steps, [&](std::size_t m) {
    weight[m] += all[m]->weightError() / static_cast<double>(rounds);
  });
  std::printf("\npile, %zu bodies, settled for %zu steps\n", scene.bodies.size(), settle);
  std::printf("%-8s%-28s%9s%11s%11s%11s%11s%11s%11s\n", "method", "", "ms/step", "overlap/R", "largest",
              "KE/NmgR", "weight", "creep/R", "largest");
  for (std::size_t m = 0; m < all.size(); ++m) {
    const Errors errors = all[m]->errors();
    const auto now = all[m]->places();
    double creep = 0;
    double most = 0;
    for (std::size_t i = 0; i < now.size(); ++i) {
      const double way = (now[i] - start[m][i]).norm() / radius;
      creep += way / static_cast<double>(now.size());
      most = std::max(most, way);
    }
    std::printf("%-8s%-28s%9.3f%11.1e%11.1e%11.1e%11.1e%11.1e%11.1e\n", all[m]->name.c_str(),
                all[m]->parameters.c_str(), times[m], errors.meanOverlap, errors.largestOverlap,
                errors.kinetic, weight[m], creep, most);
  }
  std::printf("creep: mean and largest way of a body in %zu steps\n", rounds * steps);
  std::fflush(stdout);
}

void compareGases(const Scene& scene, std::size_t rounds, std::size_t steps) {
  auto all = methods(scene);
  const double start = all[0]->kinetic();
  const auto times = timed(all, rounds, steps, [](std::size_t) {});
  std::printf("\nelastic gas, %zu bodies, energy after %zu steps\n", scene.bodies.size(), rounds * steps);
  std::printf("%-8s%-28s%9s%13s%11s%11s\n", "method", "", "ms/step", "energy - 1", "overlap/R", "largest");
  for (std::size_t m = 0; m < all.size(); ++m) {
    const Errors errors = all[m]->errors();
    std::printf("%-8s%-28s%9.3f%13.1e%11.1e%11.1e\n", all[m]->name.c_str(), all[m]->parameters.c_str(),
                times[m], all[m]->kinetic() / start - 1, errors.meanOverlap, errors.largestOverlap);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int i, std::size_t otherwise) {
    return boxes::argument(argc, argv, i, otherwise, 1);
  };
  omp_set_num_threads(1);
  const std::size_t n = argument(1, 1000);
  const std::size_t settle = argument(2, 300);
  const std::size_t rounds = argument(3, 5);
  const std::size_t steps = argument(4, 20);
  comparePiles(pile(n, 0.0), settle, rounds, steps);
  compareGases(gas(n), rounds, steps);
}
