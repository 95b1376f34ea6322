#pragma once

/// Two problems with known answers, for one body under an integrator: an orbit and an oscillator.

#include <gravel/dynamics/integrator.hpp>

#include <cmath>

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
