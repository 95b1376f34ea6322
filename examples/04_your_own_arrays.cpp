/// gravel's parts on another program's particles. What one learns: every part takes anything with `c[i]` and
/// `c.size()`, so that nothing has to be copied into a Space to be attracted or to be searched.

#include "scenes/scenes.hpp"
#include <gravel/gravity/direct_sum.hpp>
#include <gravel/spatial/broad_phase.hpp>

#include <cstdio>
#include <vector>

namespace {

/// What another simulator has: a struct of its own, in an array of its own.
struct Particle {
  double x[3];
  double ax[3];
  float size;
  double kg;
};

using Vector = gravel::Vector3<double>;

/// A view of three doubles of every particle: `column[i]` reads and writes in place.
struct Column {
  std::vector<Particle>* particles;
  double (Particle::*member)[3];
  std::size_t size() const { return particles->size(); }
  Eigen::Map<Vector> operator[](std::size_t i) const { return Eigen::Map<Vector>((*particles)[i].*member); }
};

/// Any expression of a particle as a read-only column.
template <class F>
struct Computed {
  const std::vector<Particle>* particles;
  F value;
  std::size_t size() const { return particles->size(); }
  auto operator[](std::size_t i) const { return value((*particles)[i], i); }
};
template <class F>
Computed<F> computed(const std::vector<Particle>& particles, F value) {
  return {&particles, value};
}

}  // namespace

int main() {
  std::vector<Particle> particles;
  for (const auto& body : gravel::scenes::rubbleCloud<double>(1000)) {
    const Vector& x = body.position;
    particles.push_back({{x[0], x[1], x[2]}, {0, 0, 0}, static_cast<float>(body.radius), body.mass});
  }
  const Column positions{&particles, &Particle::x};
  const Column accelerations{&particles, &Particle::ax};
  const auto masses = computed(particles, [](const Particle& p, std::size_t) { return p.kg; });
  const auto radii = computed(particles, [](const Particle& p, std::size_t) { return double(p.size); });
  const auto ids = computed(particles, [](const Particle&, std::size_t i) { return std::uint64_t{i}; });

  gravel::DirectSum<double> gravity;
  gravity.accelerations(positions, masses, 6.6743e-11, 0.0, accelerations);
  Vector force = Vector::Zero();
  double scale = 0.0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    force += masses[i] * accelerations[i];
    scale += masses[i] * accelerations[i].norm();
  }
  std::printf("Sum of all forces: %.1e of the sum of their sizes: action equals reaction.\n",
              force.norm() / scale);

  gravel::BroadPhase<double> search;
  std::vector<gravel::Pair> pairs;
  search.findPairs(positions, radii, ids, 5.0, gravel::Domain<double>::open(), 0.0, pairs);
  std::printf("%zu pairs of rocks are less than 5 m apart (found by: %s).\n", pairs.size(), search.name());
}
