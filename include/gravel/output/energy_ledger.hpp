#pragma once

/// \file
/// Where the energy is and where it went.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/parallel.hpp>

namespace gravel {

/// Energies in joules. The first three are what the system holds now. The others count what left it since the
/// start, by process; negative where a process put energy in. So `total()` is constant but for the error of
/// the time integration; contacts, damping and exchange close to rounding.
template <Real Scalar>
struct EnergyLedger {
  Scalar kinetic = Scalar(0);      ///< sum m v^2 / 2
  Scalar rotational = Scalar(0);   ///< sum I w^2 / 2
  Scalar potential = Scalar(0);    ///< mutual gravity, the uniform field, and the frame of a patch
  Scalar restitution = Scalar(0);  ///< taken by normal impulses
  Scalar friction = Scalar(0);     ///< taken by tangential impulses
  Scalar damping = Scalar(0);      ///< taken by linear and angular damping
  Scalar correction = Scalar(0);   ///< taken by positional correction; mostly negative: it lifts bodies
  /// Minus the work of the user's own force, of planes that move, and of a domain at its edges: of the shear
  /// of a patch, and of a uniform field where bodies come in again on the other side.
  Scalar work = Scalar(0);
  Scalar exchange =
      Scalar(0);  ///< left with removed bodies (minus: came with new ones) and with changed settings

  Scalar mechanical() const { return kinetic + rotational + potential; }
  Scalar dissipated() const { return restitution + friction + damping + correction + work + exchange; }
  Scalar total() const { return mechanical() + dissipated(); }
};

/// Translational and rotational kinetic energy [J]; fixed bodies have none. O(N); the same bits for any
/// number of threads.
template <Real Scalar, class Layout>
void addKineticEnergy(const Bodies<Scalar, Layout>& bodies, EnergyLedger<Scalar>& ledger) {
  using Sum = Eigen::Array<Scalar, 2, 1>;
  const Scalar half = Scalar(1) / Scalar(2);
  const Sum sum = orderedSum(bodies.size(), 1024, Sum(Sum::Zero()), [&](std::size_t begin, std::size_t end) {
    Sum part = Sum::Zero();
    for (std::size_t i = begin; i < end; ++i) {
      const auto body = bodies[i];
      part[0] += half * Scalar(body.mass()) * Scalar(body.countingVelocity().squaredNorm());
      part[1] += body.rotationalEnergy();
    }
    return part;
  });
  ledger.kinetic += sum[0];
  ledger.rotational += sum[1];
}

/// Potential energy in a uniform field g [m s^-2]: -sum m g.x over the movable bodies [J].
template <Real Scalar, class Layout>
Scalar fieldEnergy(const Bodies<Scalar, Layout>& bodies, const Vector3<Scalar>& g) {
  return orderedSum(bodies.size(), 1024, Scalar(0), [&](std::size_t begin, std::size_t end) {
    Scalar part(0);
    for (std::size_t i = begin; i < end; ++i) {
      const auto body = bodies[i];
      if (!body.isFixed()) {
        part -= Scalar(body.mass()) * Scalar(g.dot(Vector3<Scalar>(body.position())));
      }
    }
    return part;
  });
}

}  // namespace gravel
