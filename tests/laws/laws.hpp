#pragma once

/// What the law tests share: a quiet configuration, short ways to make bodies, and all bits of a state.

#include "support/space.hpp"

#include <cstring>
#include <vector>

namespace gravel::test {

using Vec = Vector3<double>;

/// A fixed step, no gravity, no friction, nothing damped: a test adds what it is about.
template <Real S = double>
SimulationConfig<S> plain(S timeStep) {
  SimulationConfig<S> config;
  config.G = S(0);
  config.timeStep = timeStep;
  config.adaptiveTimeStep = false;
  config.coeffFriction = S(0);
  config.coeffStaticFriction = S(0);
  return config;
}

template <Real S = double>
Body<S> ball(const std::type_identity_t<Vector3<S>>& x, const std::type_identity_t<Vector3<S>>& v,
             std::type_identity_t<S> radius, std::type_identity_t<S> mass = S(1),
             const std::type_identity_t<Vector3<S>>& w = Vector3<S>::Zero()) {
  Body<S> body;
  body.position = x;
  body.velocity = v;
  body.angularVelocity = w;
  body.radius = radius;
  body.mass = mass;
  return body;
}

template <class SpaceType>
void advance(SpaceType& space, std::size_t steps) {
  for (std::size_t i = 0; i < steps; ++i) {
    space.computeDynamics(i);
  }
}

/// Everything that moves, by id, so that the order of bodies does not matter.
template <class SpaceType>
auto stateOf(const SpaceType& space) {
  using S = std::remove_cvref_t<decltype(space.time())>;
  std::vector<S> state;
  std::vector<std::pair<std::uint64_t, std::size_t>> order;
  for (std::size_t i = 0; i < space.n(); ++i) {
    order.emplace_back(toInteger(space.body(i).id()), i);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [id, i] : order) {
    const Body<S> b = space.body(i).load();
    for (int k = 0; k < 3; ++k) {
      state.insert(state.end(), {b.position[k], b.velocity[k], b.angularVelocity[k],
                                 Vector3<S>(space.body(i).acceleration())[k]});
    }
    for (int k = 0; k < 4; ++k) {
      state.push_back(b.orientation.coeffs()[k]);
    }
  }
  state.push_back(space.time());
  return state;
}

/// Equal bits; a NaN equals itself, and -0 is not 0. (Padding of a long double is not compared.)
template <class S>
bool sameBits(const std::vector<S>& a, const std::vector<S>& b) {
  constexpr std::size_t bytes = std::is_same_v<S, long double> ? 10 : sizeof(S);
  bool same = a.size() == b.size();
  for (std::size_t i = 0; same && i < a.size(); ++i) {
    same = std::memcmp(&a[i], &b[i], bytes) == 0;
  }
  return same;
}

/// Largest difference of two states over the largest number in them.
template <class S>
double difference(const std::vector<S>& a, const std::vector<S>& b) {
  double most = 0;
  double size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, static_cast<double>(std::abs(a[i] - b[i])));
    size = std::max(size, static_cast<double>(std::abs(a[i])));
  }
  return size > 0 ? most / size : most;
}

}  // namespace gravel::test
