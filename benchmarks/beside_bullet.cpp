/// Settled piles and an elastic gas in gravel and in Bullet (its default solver), in one run and in turns, so
/// that what else the machine does disturbs all alike. One thread, processor time, median of the rounds, with
/// the errors beside it. Built where Bullet is installed: in single precision, beside gravel in single and in
/// double, and where Bullet's libraries of doubles are there (`-float64`) in double beside double.
///
///   bench_beside_bullet [bodies] [steps to settle] [rounds] [steps a round]

#include "boxes.hpp"
#include "stopwatch.hpp"
#include "support/space_of_float.hpp"

#include <btBulletDynamicsCommon.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <memory>

namespace {

using namespace gravel;
using namespace boxes;

template <class S>
class Gravel {
 public:
  explicit Gravel(const Scene& scene) : scene_(scene), space_(spaceOf<S>(scene, config())) {}

  void step() {
    space_.computeDynamics(steps_++);
    sweeps_ += space_.contactReport().iterations;
    impacts_ += space_.contactReport().impacts;
  }
  double kinetic() const { return kineticEnergy(space_); }
  Errors errors() const { return errorsOf(space_); }
  void report() const {
    std::printf("gravel: %zu contacts, %zu colours, %.1f sweeps and %.1f impacts a step, weight error %.1e\n",
                space_.contacts().size(), space_.contactReport().colours,
                static_cast<double>(sweeps_) / static_cast<double>(steps_),
                static_cast<double>(impacts_) / static_cast<double>(steps_),
                scene_.g > 0 ? static_cast<double>(space_.supportedWeight().residual()) : 0.0);
    space_.printProfilingReport();
  }

 private:
  static SimulationConfig<S> config() {
    SimulationConfig<S> config;
    config.contactTolerance = static_cast<S>(1e-2);
    config.contactIterations = 4;
    return config;
  }

  Scene scene_;
  Space<S> space_;
  std::size_t steps_ = 0;
  long sweeps_ = 0;
  std::size_t impacts_ = 0;
};

class Bullet {
 public:
  explicit Bullet(const Scene& scene)
      : h_(scene.h),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
    world_.setGravity(btVector3(0, 0, btScalar(-scene.g)));
    for (const auto& [normal, offset] : scene.planes()) {
      add(scene, new btStaticPlaneShape(vector(normal), btScalar(offset)), nullptr);
    }
    auto* const sphere = new btSphereShape(btScalar(radius));
    for (const Body<double>& body : scene.bodies) {
      add(scene, sphere, &body);
    }
  }

  void step() { world_.stepSimulation(btScalar(h_), 0); }
  double kinetic() const {
    double sum = 0;
    for (const auto& body : bodies_) {
      sum += body->getInvMass() > 0 ? 0.5 * static_cast<double>(body->getLinearVelocity().length2()) : 0.0;
    }
    return sum;
  }
  Errors errors() {
    Errors errors;
    double contacts = 0;
    for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
      const btPersistentManifold* manifold = dispatcher_.getManifoldByIndexInternal(m);
      for (int p = 0; p < manifold->getNumContacts(); ++p) {
        const double gap = static_cast<double>(manifold->getContactPoint(p).getDistance());
        contacts += 1;
        errors.meanOverlap += std::max(0.0, -gap) / radius;
        errors.largestOverlap = std::max(errors.largestOverlap, -gap / radius);
      }
    }
    errors.meanOverlap /= std::max(1.0, contacts);
    errors.kinetic = kinetic() / (static_cast<double>(bodies_.size()) * g * radius);
    errors.moving = errors.kinetic;
    return errors;
  }

 private:
  static btVector3 vector(const Vec& v) { return btVector3(btScalar(v[0]), btScalar(v[1]), btScalar(v[2])); }

  void add(const Scene& scene, btCollisionShape* shape, const Body<double>* body) {
    if (shapes_.empty() || shapes_.back().get() != shape) {
      shapes_.emplace_back(shape);
    }
    btVector3 inertia(0, 0, 0);
    if (body != nullptr) {
      shape->calculateLocalInertia(btScalar(body->mass), inertia);
    }
    btRigidBody::btRigidBodyConstructionInfo info(body != nullptr ? btScalar(body->mass) : btScalar(0),
                                                  nullptr, shape, inertia);
    info.m_friction = btScalar(std::sqrt(scene.mu));  // Bullet multiplies those of the two
    info.m_restitution = btScalar(scene.e);
    // The torque of two spheres over their force, a length here; it mixes s1 f2 + s2 f1.
    info.m_spinningFriction =
        scene.spinning > 0 ? btScalar(scene.spinning * radius / 2 / (2 * std::sqrt(scene.mu))) : btScalar(0);
    info.m_startWorldTransform.setIdentity();
    if (body != nullptr) {
      info.m_startWorldTransform.setOrigin(vector(body->position));
    }
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    if (body != nullptr) {
      bodies_.back()->setLinearVelocity(vector(body->velocity));
    }
    bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    world_.addRigidBody(bodies_.back().get());
  }

  double h_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  std::deque<std::unique_ptr<btCollisionShape>> shapes_;
  std::deque<std::unique_ptr<btRigidBody>> bodies_;
  btDiscreteDynamicsWorld world_;
};

template <class Engine>
double timed(Engine& engine, std::size_t steps) {
  const Stopwatch watch;
  for (std::size_t k = 0; k < steps; ++k) {
    engine.step();
  }
  return watch.nanoseconds() / 1e6 / static_cast<double>(steps);
}

void compare(const char* name, const Scene& scene, std::size_t settle, std::size_t rounds,
             std::size_t steps) {
  Gravel<double> ours(scene);
  std::unique_ptr<Gravel<float>> single;
  if (sizeof(btScalar) == sizeof(float)) {
    single = std::make_unique<Gravel<float>>(scene);
  }
  Bullet theirs(scene);
  const double start = ours.kinetic();
  std::vector<double> a;
  std::vector<double> a1;
  std::vector<double> b;
  for (std::size_t r = 0; r <= rounds; ++r) {
    const std::size_t count = r == 0 ? settle : steps;
    a.push_back(timed(ours, count));
    a1.push_back(single ? timed(*single, count) : 0);
    b.push_back(timed(theirs, count));
  }
  std::printf("\n%s, %zu bodies, after %zu steps\n", name, scene.bodies.size(), settle);
  const auto line = [&](const char* who, const std::vector<double>& times, const Errors& errors,
                        double kinetic) {
    std::vector<double> rounded(times.begin() + 1, times.end());  // the first one settled
    std::vector<double> ratios;
    for (std::size_t r = 1; r < times.size(); ++r) {
      ratios.push_back(b[r] / times[r]);
    }
    std::printf("%-14s %8.2f ms a step, 1/%.2f of Bullet's, overlap/R mean %.1e largest %.1e, ", who,
                median(rounded), median(ratios), errors.meanOverlap, errors.largestOverlap);
    if (scene.g > 0) {
      std::printf("kinetic/(N m g R) %.1e, of centres %.1e\n", errors.kinetic, errors.moving);
    } else {
      std::printf("kinetic energy changed by %.1e of it\n", kinetic / start - 1);
    }
  };
  line("gravel, double", a, ours.errors(), ours.kinetic());
  if (single) {
    line("gravel, float", a1, single->errors(), single->kinetic());
  }
  line(single ? "Bullet, float" : "Bullet, double", b, theirs.errors(), theirs.kinetic());
  ours.report();
  std::fflush(stdout);
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
  compare("pile, e = 0", pile(n, 0.0), settle, rounds, steps);
  compare("pile, e = 0.5", pile(n, 0.5), settle, rounds, steps);
  compare("pile, e = 0.5, spinning friction 0.001", pile(n, 0.5, 0.001), settle, rounds, steps);
  compare("gas, elastic, volume fraction 0.2", gas(n), 100, rounds, steps);
}
