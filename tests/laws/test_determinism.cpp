#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/other_spaces.hpp"

#include <numeric>

using namespace gravel;
using namespace gravel::test;

namespace {

SimulationConfig<double> sticky(double G) {
  SimulationConfig<double> config = plain(2e-3);
  config.G = G;
  config.coeffFriction = 0.4;
  config.coeffStaticFriction = 0.6;
  config.coeffRestitution = 0.4;
  return config;
}

/// Grains so dense that they touch from the first steps on; mass about 1.
std::vector<Body<double>> grains(std::size_t n) {
  scenes::CloudOptions options;
  options.count = n;
  options.radius = 1.0;
  const double r = 0.62 / std::cbrt(static_cast<double>(n));
  options.bodyRadius = {0.6 * r, r};
  options.density = {1.0, 2.0};
  options.velocityDispersion = 0.5;
  options.bodySpin = 1.0;
  std::vector<Body<double>> bodies = scenes::rubbleCloud<double>(options);
  for (Body<double>& body : bodies) {
    body.velocity -= 3.0 * body.position;  // they meet at once
  }
  return bodies;
}

template <class Layout = SoA>
Space<double, Layout> spaceOf(const std::vector<Body<double>>& bodies,
                              const SimulationConfig<double>& config) {
  Space<double, Layout> space(config);
  for (const Body<double>& body : bodies) {
    space.addBody(body);
  }
  return space;
}

}  // namespace

#ifdef _OPENMP

// Enough bodies and contacts for many chunks of every loop that is shared.
// Seen to fail: orderedSum with as many chunks as there are threads.
TEST_CASE("Gravity, contacts and friction are the same bits for 1, 2, 3 and 8 threads") {
  const int threads = omp_get_max_threads();
  const std::vector<Body<double>> bodies = grains(2000);
  SimulationConfig<double> config = sticky(0.5);
  config.adaptiveTimeStep = true;
  std::vector<double> one;
#ifdef GRAVEL_TEST_SLOW
  const std::size_t steps = 20;  // each of them looks at four million pairs
#else
  const std::size_t steps = 200;
#endif
  std::size_t contacts = 0;
  for (const int many : {1, 2, 3, 8}) {
    omp_set_num_threads(many);
    Space<double> space = spaceOf(bodies, config);
    std::size_t touched = 0;
    for (std::size_t i = 0; i < steps; ++i) {
      space.computeDynamics(i);
      touched += space.contactCount();
    }
    std::vector<double> state = stateOf(space);
    const EnergyLedger<double> e = space.energyLedger();
    state.insert(state.end(),
                 {e.kinetic, e.rotational, e.potential, e.restitution, e.friction, e.correction});
    if (many == 1) {
      one = state;
      contacts = touched;
    }
    CAPTURE(many);
    CHECK(touched == contacts);
    CHECK(sameBits(one, state));
  }
  omp_set_num_threads(threads);
  CHECK(contacts > 20 * steps);  // 670 in the first 20, while they gather
}

// Its forces, its torques, what it sees of blows and contacts, and its work. Seen to fail: sums of the work
// over as many chunks as there are threads.
TEST_CASE("A user's force on touching grains is the same bits for 1, 2, 3 and 8 threads") {
  const int threads = omp_get_max_threads();
  const std::vector<Body<double>> bodies = grains(2000);
  std::vector<double> one;
  for (const int many : {1, 2, 3, 8}) {
    omp_set_num_threads(many);
    Space<double> space = spaceOf(bodies, sticky(0.0));
    const std::size_t floor = space.addPlane({0, 0, 1}, -1.0);
    space.setForceHook([](Bodies<double, SoA>& all, double) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        all[i].force() -= Vec(all[i].mass() * (0.5 * all[i].velocity() + Vec(0, 0, 9.81)));
        all[i].torque() -= Vec(1e-3 * all[i].inertia() * all[i].angularVelocity());
      }
    });
    std::size_t touched = 0;
    for (std::size_t i = 0; i < 20; ++i) {
      space.setPlaneVelocity(floor, {0, 0, 0.1 * static_cast<double>(i % 5)});
      space.computeDynamics(i);
      touched += space.contactCount();
    }
    CAPTURE(many);
    CHECK(touched > 400);
    std::vector<double> state = stateOf(space);
    const EnergyLedger<double> e = space.energyLedger();
    state.insert(state.end(), {e.work, e.restitution, e.friction, e.correction});
    one = many == 1 ? state : one;
    CHECK(sameBits(one, state));
  }
  omp_set_num_threads(threads);
}
#endif

// Contacts are ordered and coloured by ids: the order in memory does not matter, to the bit. Gravity sums in
// the order of memory: to rounding, which chaos has not carried far after 50 steps of a few blows.
TEST_CASE("A permutation of bodies with their ids kept changes no bit of contacts, and gravity by rounding") {
  const std::vector<Body<double>> bodies = grains(300);
  for (const double G : {0.0, 0.5}) {
    Space<double> one = spaceOf(bodies, sticky(G));
    Space<double> two = spaceOf(bodies, sticky(G));
    std::vector<std::size_t> order(bodies.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const CounterRandom random(17);
    for (std::size_t i = order.size(); i > 1; --i) {
      std::swap(order[i - 1], order[random.bits(i) % i]);
    }
    two.getBodiesForTest().reorder(order);
    std::size_t contacts = 0;
    const std::size_t steps = G == 0.0 ? 200 : 50;
    for (std::size_t i = 0; i < steps; ++i) {
      one.computeDynamics(i);
      two.computeDynamics(i);
      contacts += one.contactCount();
      if (i % 10 == 5) {
        two.reorderBodies();  // at run time as well
      }
    }
    CAPTURE(G, contacts);
    CHECK(contacts > 300);
    if (G == 0.0) {
      CHECK(sameBits(stateOf(one), stateOf(two)));
    } else {
      CHECK(difference(stateOf(one), stateOf(two)) < 1e-11);
      CHECK(difference(stateOf(one), stateOf(two)) > 0.0);
    }
  }
}

#ifndef GRAVEL_TEST_SLOW  // see other_spaces.hpp
TEST_CASE("All layouts give the same bits in double") {
  const std::vector<Body<double>> bodies = grains(200);
  const auto endOf = [&](auto layout) {
    auto space = spaceOf<decltype(layout)>(bodies, sticky(0.5));
    advance(space, 100);
    return stateOf(space);
  };
  const std::vector<double> soa = endOf(SoA{});
  CHECK(sameBits(soa, endOf(AoS{})));
  CHECK(sameBits(soa, endOf(AoSoA<8>{})));
}
#endif
