#pragma once

/// Problems for integrators: an orbit and an oscillator of one body, with known answers; a star amid planets.

#include <gravel/dynamics/integrator.hpp>

#include <cmath>
#include <vector>

namespace gravel::test {

/// What one run costs, seen from outside.
struct CallCount {
  int forces = 0;
  int arrivals = 0;
  int forcesAtArrival = 0;  ///< force evaluations before the last arrival
};

/// One body on an orbit of semi-major axis 1 about a centre with G M = 1, at apocentre (1 + e, 0, 0).
template <Real S, class Layout = SoA>
Bodies<S, Layout> orbiter(S e) {
  Bodies<S, Layout> bodies;
  Body<S> body;
  body.position = {S(1) + e, S(0), S(0)};
  body.velocity = {S(0), std::sqrt((S(1) - e) / (S(1) + e)), S(0)};
  bodies.add(body);
  return bodies;
}

template <Real S>
S orbitalEnergy(const Body<S>& b) {
  return b.velocity.squaredNorm() / S(2) - S(1) / b.position.norm();
}

template <class S>
Bodies<S> bodiesOf(const std::vector<Body<S>>& list) {
  Bodies<S> bodies;
  for (const Body<S>& body : list) {
    bodies.add(body);
  }
  return bodies;
}

/// A star of mass 1 at `place` + (offset, 0, 0) and n planets of 1e-3 evenly on a circle of 1 about `place`,
/// all with the velocity `boost`.
template <class S>
Bodies<S> starOf(int n, double offset, const Vector3<S>& place, const Vector3<S>& boost) {
  std::vector<Body<S>> list(1);
  list[0].mass = 1;
  list[0].position = place + Vector3<S>(S(offset), 0, 0);
  list[0].velocity = boost;
  for (int i = 0; i < n; ++i) {
    const S angle = S(0.1) + S(2 * i) * pi<S>() / S(n);
    const Vector3<S> out(std::cos(angle), std::sin(angle), 0);
    list.push_back(
        {.position = place + out, .velocity = boost + Vector3<S>(-out[1], out[0], 0), .mass = S(1e-3)});
  }
  return bodiesOf(list);
}

struct KeplerForce {
  template <class BodiesType>
  void operator()(BodiesType& bodies) const {
    using S = typename BodiesType::Scalar;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Vector3<S> x = bodies[i].position();
      const S r = x.norm();
      bodies[i].acceleration() = -x / (r * r * r);
    }
  }
};

/// x'' = -x.
struct SpringForce {
  template <class BodiesType>
  void operator()(BodiesType& bodies) const {
    using S = typename BodiesType::Scalar;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].acceleration() = -Vector3<S>(bodies[i].position());
    }
  }
};

/// `steps` steps of length h with the force of the starting place evaluated first (and not counted).
template <Real S, class Layout, class Force>
CallCount run(IntegratorKind kind, Bodies<S, Layout>& bodies, const S& h, int steps, const Force& force) {
  CallCount count;
  force(bodies);
  for (int i = 0; i < steps; ++i) {
    int forcesInStep = 0;
    integrate(
        kind, bodies, h, false,
        [&](const S&) {
          force(bodies);
          ++count.forces;
          ++forcesInStep;
        },
        [&] {
          ++count.arrivals;
          count.forcesAtArrival = forcesInStep;
        });
  }
  return count;
}

}  // namespace gravel::test
