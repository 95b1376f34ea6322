#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include <gravel/dynamics/wisdom_holman.hpp>
#include <gravel/gravity/direct_sum.hpp>

using namespace gravel;
using namespace gravel::test;

namespace {

template <class S>
struct System {
  Bodies<S> bodies;
  S G;
  WisdomHolman<S> method;
  DirectSum<S> gravity;

  System(const std::vector<Body<S>>& list, S constant) : G(constant) {
    for (const Body<S>& body : list) {
      bodies.add(body);
    }
    forces();
  }
  void forces() {
    gravity.accelerations(bodies.positions(), bodies.masses(), G, S(0), bodies.accelerations());
  }
  void advance(const S& h, int steps = 1) {
    for (int i = 0; i < steps; ++i) {
      method.advance(bodies, G, h, [&](const S&) { forces(); });
    }
  }
  S energy() {
    S e = gravity.potentialEnergy(bodies.positions(), bodies.masses(), G, S(0));
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      e += bodies.masses()[i] * bodies.velocities()[i].squaredNorm() / S(2);
    }
    return e;
  }
};

/// Sun, and planets whose masses are `share` of the true ones.
template <class S>
std::vector<Body<S>> outer(S share) {
  auto list = scenes::outerSolarSystem<S>();
  for (std::size_t i = 1; i < list.size(); ++i) {
    list[i].mass *= share;
  }
  scenes::centre(list);
  return list;
}

/// Largest |dE/E| over 100 000 days.
template <class S>
S worst(S share, S h) {
  System<S> system(outer<S>(share), S(scenes::outerSolarSystemG));
  const S start = system.energy();
  S most(0);
  for (int i = 0; S(i) * h < S(100000); ++i) {
    system.advance(h);
    most = std::max<S>(most, std::abs(system.energy() / start - S(1)));
  }
  return most;
}

}  // namespace

// Seen to fail: shares of half a planet's mass too much; the orbit about the mass inside alone, without the
// planet's.
TEST_CASE("A single planet of any mass is exact, however long the step") {
  for (const double share : {1e-3, 0.3}) {
    for (const double e : {0.2, 0.9}) {
      System<double> system(scenes::keplerPair<double>(e, share), 1.0);
      const Vector3<double> start = system.bodies[1].position() - system.bodies[0].position();
      system.advance(2 * pi<double>() / 3, 300);  // a hundred orbits of three steps
      const Vector3<double> end = system.bodies[1].position() - system.bodies[0].position();
      CAPTURE(share, e);
      // Two large numbers cancel in each kick: some 1e-15 of a long step's velocity, 600 times, and the
      // change of period that this makes adds up over 628 radians (measured: 3e-12 to 3e-11).
      CHECK((end - start).norm() < 1e-10);
    }
  }
}

// The cube of the distance in metres is beyond a float. Seen to fail, off by half of it: the kick had that
// cube.
TEST_CASE("float follows a circle as wide as Pluto's orbit in metres and seconds") {
  const float r = 7.4e12F;  // Pluto's aphelion
  const float speed = 4235.0F;
  std::vector<Body<float>> list(3);
  list[0].mass = 1.989e30F;
  list[1].mass = 6e24F;
  list[1].position = {1.5e11F, 0, 0};
  list[1].velocity = {0, 29750.0F, 0};
  list[2].mass = 1.3e22F;
  list[2].position = {r, 0, 0};
  list[2].velocity = {0, speed, 0};
  System<float> system(list, 6.6743e-11F);
  const float quarter = pi<float>() / 2 * r / speed;
  system.advance(quarter / 2000, 2000);
  const Vector3<float> x = system.bodies[2].position() - system.bodies[0].position();
  CHECK_THAT(x[0] / r, WithinAbs(0.0, 3e-3));
  CHECK_THAT(x[1] / r, WithinAbs(1.0, 3e-3));
}

// Two-sided in both: h^2, and the planets' masses.
// Seen to fail: the first kick as long as the step; the orbit about the mass inside alone.
TEST_CASE("The error is of second order in the step and of first in the planets' masses") {
  const long double coarse = worst(1.0L, 200.0L);
  const long double fine = worst(1.0L, 100.0L);
  CAPTURE(static_cast<double>(coarse), static_cast<double>(fine));
  CHECK_THAT(static_cast<double>(std::log2(coarse / fine)), WithinAbs(2.0, 0.1));
  // The energy itself is the Sun's pull on planets: its relative error goes with their mass.
  const long double light = worst(0.1L, 100.0L);
  CHECK_THAT(static_cast<double>(fine / light), WithinRel(10.0, 0.15));
}

TEST_CASE("The outer solar system in steps of 200 days errs by 4e-6, and without drift") {
  System<double> system(outer<double>(1.0), scenes::outerSolarSystemG);
  const double start = system.energy();
  double first = 0;
  double last = 0;
  const int n = 40000;  // 22 000 years
  for (int i = 0; i < n; ++i) {
    system.advance(200.0);
    const double error = std::abs(system.energy() / start - 1);
    (i < n / 2 ? first : last) = std::max(i < n / 2 ? first : last, error);
  }
  CAPTURE(first, last);
  CHECK_THAT(first, WithinRel(4.3e-6, 0.2));
  CHECK_THAT(last, WithinRel(first, 0.2));
}

// Seen to fail: the first kick as long as the step.
TEST_CASE("Velocities turned round lead back to the start") {
  System<double> system(outer<double>(1.0), scenes::outerSolarSystemG);
  const Bodies<double> start = system.bodies;
  system.advance(150.0, 300);
  for (std::size_t i = 0; i < start.size(); ++i) {
    system.bodies[i].velocity() = -Vector3<double>(system.bodies[i].velocity());
  }
  system.advance(150.0, 300);
  for (std::size_t i = 0; i < start.size(); ++i) {
    CHECK((system.bodies[i].position() - start[i].position()).norm() < 1e-11);
  }
}

// Seen to fail: shares of half a planet's mass too much.
TEST_CASE("Momentum and angular momentum are kept to rounding, and the centre of mass goes straight on") {
  auto list = outer<double>(1.0);
  for (Body<double>& body : list) {
    body.velocity += Vector3<double>(0.01, -0.02, 0.005);
  }
  System<double> system(list, scenes::outerSolarSystemG);
  const auto sums = [&] {
    Vector3<double> p = Vector3<double>::Zero(), L = p, c = p;
    for (std::size_t i = 0; i < system.bodies.size(); ++i) {
      const double m = system.bodies.masses()[i];
      const Vector3<double> x = system.bodies.positions()[i], v = system.bodies.velocities()[i];
      p += m * v;
      L += m * x.cross(v);
      c += m * x;
    }
    return std::array<Vector3<double>, 3>{p, L, c};
  };
  const auto before = sums();
  system.advance(200.0, 1000);
  const auto after = sums();
  CHECK((after[0] - before[0]).norm() < 1e-14);
  CHECK((after[1] - before[1]).norm() < 1e-10);  // places of some 1e3 round by 1e-13
  CHECK((after[2] - before[2] - 2e5 * before[0]).norm() < 1e-9);
}

// Seen to fail: the first body as the centre.
TEST_CASE("The heaviest body is the centre wherever it stands, and what has none is refused") {
  auto list = outer<double>(1.0);
  System<double> first(list, scenes::outerSolarSystemG);
  std::rotate(list.begin(), list.begin() + 1, list.end());  // the Sun last: ids of the planets in their order
  System<double> later(list, scenes::outerSolarSystemG);
  first.advance(200.0, 50);
  later.advance(200.0, 50);
  for (std::size_t i = 0; i < list.size(); ++i) {
    CHECK((first.bodies[(i + 1) % list.size()].position() - later.bodies[i].position()).norm() < 1e-11);
  }
  Bodies<double> none;
  Body<double> tracer;
  tracer.mass = 0;
  none.add(tracer);
  WisdomHolman<double> method;
  CHECK_THROWS_WITH(method.advance(none, 1.0, 0.1, [](double) {}), ContainsSubstring("largest mass"));
  tracer.mass = 1;
  tracer.fixed = true;
  none.add(tracer);
  CHECK_THROWS_WITH(method.advance(none, 1.0, 0.1, [](double) {}), ContainsSubstring("body 1"));
}

// Seen to fail: all places were none after the step.
TEST_CASE("A body at the centre of mass of those before it has no orbit, and is refused with nothing moved") {
  for (const std::size_t at : {1U, 2U}) {
    auto list = scenes::keplerPair<double>(0.0, 0.25);
    Body<double> tracer;
    tracer.mass = 0;
    tracer.position = list[0].position * list[0].mass + list[1].position * list[1].mass;
    tracer.position /= list[0].mass + list[1].mass;
    list.push_back(tracer);
    list[1].position = at == 1 ? list[0].position : list[1].position;
    System<double> system(list, 1.0);
    const Bodies<double> start = system.bodies;
    CAPTURE(at);
    CHECK_THROWS_WITH(system.advance(0.1),
                      ContainsSubstring("of body " + std::to_string(at) + " from the centre"));
    for (std::size_t i = 0; i < start.size(); ++i) {
      CHECK(Vector3<double>(system.bodies[i].position()) == Vector3<double>(start[i].position()));
      CHECK(Vector3<double>(system.bodies[i].velocity()) == Vector3<double>(start[i].velocity()));
    }
  }
}
