#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/archetypes.hpp"
#include "support/catch.hpp"

using namespace gravel;
using namespace gravel::test;

TEST_CASE("A user's own particles are simulated in place, with the bits of gravel's storage") {
  std::vector<Particle<double>> particles;
  SimulationConfig<double> config = plain(2e-3);
  config.G = 0.5;
  config.coeffFriction = config.coeffStaticFriction = 0.3;
  Space<double> own(config);
  scenes::CloudOptions options;
  options.count = 40;
  options.radius = 1.0;
  options.bodyRadius = {0.1, 0.2};
  options.density = {1.0, 2.0};
  options.velocityDispersion = 1.0;
  int species = 0;
  for (const Body<double>& body : scenes::rubbleCloud<double>(options)) {
    own.addBody(body);
    Particle<double> p;
    for (int k = 0; k < 3; ++k) {
      p.x[k] = body.position[k];
      p.v[k] = body.velocity[k];
      p.spin[k] = body.angularVelocity[k];
    }
    p.m = body.mass;
    p.size = body.radius;
    p.species = species++;
    particles.push_back(p);
  }
  Space<double, ParticleStorage<double>> theirs(config, ParticleStorage<double>(particles));
  advance(own, 100);
  advance(theirs, 100);
  CHECK(sameBits(stateOf(own), stateOf(theirs)));
  for (std::size_t i = 0; i < particles.size(); ++i) {
    CHECK(particles[i].x[2] == own.body(i).position()[2]);  // no copy: it is their array that moved
  }
  theirs.reorderBodies();
  for (const Particle<double>& p : particles) {
    CHECK(static_cast<std::uint64_t>(p.species) == p.name);  // what gravel knows nothing of moved along
  }
}
