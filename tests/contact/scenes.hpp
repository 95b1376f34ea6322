#pragma once

/// Scenes and sums that the contact tests share.

#include <gravel/contact/collision_context.hpp>
#include <gravel/contact/contact_solver.hpp>
#include <gravel/contact/narrow_phase.hpp>
#include <gravel/core/random.hpp>

#include <vector>

namespace gravel::test {

template <class S>
constexpr S eps = std::numeric_limits<S>::epsilon();

using Wide = long double;

/// Sums over movable bodies in long double, whatever the scalar.
template <class B>
struct Totals {
  Wide energy = 0;
  Vector3<Wide> momentum = Vector3<Wide>::Zero();
  Vector3<Wide> angular = Vector3<Wide>::Zero();
  Wide momentumScale = 0;  ///< sum of the sizes of the terms
  Wide angularScale = 0;

  explicit Totals(const B& bodies) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (bodies[i].isFixed() || !(bodies[i].mass() > 0)) {
        continue;
      }
      const auto wide = [](const auto& v) { return Vector3<Wide>(v.template cast<Wide>()); };
      const Vector3<Wide> x = wide(bodies[i].position());
      const Vector3<Wide> v = wide(bodies[i].velocity());
      const Vector3<Wide> w = wide(bodies[i].angularVelocity());
      const Wide m = bodies[i].mass();
      const Wide r = bodies[i].radius();
      const Wide moment = Wide(bodies[i].inertiaFactor()) * m * r * r;
      energy += m * v.squaredNorm() / 2 + moment * w.squaredNorm() / 2;
      momentum += m * v;
      momentumScale += m * v.norm();
      angular += m * x.cross(v) + moment * w;
      angularScale += m * x.norm() * v.norm() + moment * w.norm();
    }
  }
};

template <class B>
Totals(const B&) -> Totals<B>;

/// Every pair of bodies as a candidate, in the order of ids.
template <class B>
std::vector<Pair> allPairs(const B& bodies) {
  std::vector<Pair> pairs;
  std::vector<std::uint32_t> order(bodies.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    order[i] = i;
  }
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return bodies.ids()[a] < bodies.ids()[b]; });
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      pairs.push_back({order[i], order[j]});
    }
  }
  return pairs;
}

template <class S, class B>
ContactList<S> contactsOf(const B& bodies, const Material<S>& material, std::vector<HalfSpace<S>> walls = {},
                          S margin = S(0)) {
  for (std::size_t b = 0; b < walls.size(); ++b) {
    walls[b].material = material;
    walls[b].number = b;
  }
  const std::vector<Material<S>> materials{material};
  NarrowPhaseSettings<S> settings;
  settings.margin = margin;
  ContactList<S> contacts;
  NarrowPhase<S>().find(allPairs(bodies), bodies, Domain<S>::open(), materials, walls, settings, contacts);
  return contacts;
}

/// A sphere drawn at random: masses and radii over decades, any velocity and spin.
template <class S>
Body<S> randomBody(const CounterRandom& random, std::uint64_t& counter) {
  const auto vector = [&](double scale) {
    Vector3<S> v;
    for (int c = 0; c < 3; ++c) {
      v[c] = S(random.uniform(counter++, -scale, scale));
    }
    return v;
  };
  Body<S> body;
  body.mass = S(std::pow(10.0, random.uniform(counter++, -3.0, 3.0)));
  body.radius = S(std::pow(10.0, random.uniform(counter++, -1.0, 1.0)));
  body.velocity = vector(2.0);
  body.angularVelocity = vector(2.0) / body.radius;
  return body;
}

/// Coefficients drawn at random, with friction from none to plenty.
template <class S>
Material<S> randomMaterial(const CounterRandom& random, std::uint64_t& counter) {
  Material<S> material;
  material.restitution = S(random.uniform(counter++));
  material.kineticFriction = S(random.uniform(counter++));
  material.staticFriction = material.kineticFriction * S(random.uniform(counter++, 1.0, 1.5));
  material.tangentialRestitution = S(random.uniform(counter++));
  return material;
}

/// n equal spheres at random in a cube, the closer the higher the filling, with random velocities and spins.
template <class S, class Layout = SoA>
Bodies<S, Layout> randomCloud(std::size_t n, double side, std::uint64_t seed) {
  Bodies<S, Layout> bodies;
  const CounterRandom random(seed);
  std::uint64_t counter = 0;
  for (std::size_t i = 0; i < n; ++i) {
    Body<S> body = randomBody<S>(random, counter);
    body.radius = S(random.uniform(counter++, 0.4, 0.6));
    body.mass = body.radius * body.radius * body.radius;
    for (int c = 0; c < 3; ++c) {
      body.position[c] = S(random.uniform(counter++, -side / 2, side / 2));
    }
    bodies.add(body);
  }
  return bodies;
}

/// n spheres of radius 1/2 and mass 1 on a floor at z = 0, each a little into the next, falling at g dt.
template <class S>
Bodies<S, SoA> column(std::size_t n, double overlap, S g, S dt) {
  Bodies<S, SoA> bodies;
  for (std::size_t i = 0; i < n; ++i) {
    Body<S> body;
    body.radius = S(0.5);
    body.position = {S(0), S(0), S(0.5 - overlap + static_cast<double>(i) * (1.0 - overlap))};
    body.velocity = {S(0), S(0), -g * dt};
    bodies.add(body);
    bodies.accelerations()[i] = Vector3<S>(S(0), S(0), -g);
  }
  return bodies;
}

template <class S>
std::vector<HalfSpace<S>> floorAtZero() {
  return {{Vector3<S>(S(0), S(0), S(1)), S(0), {}}};
}

}  // namespace gravel::test
