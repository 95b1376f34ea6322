#pragma once

/// \file
/// The bodies of a ContactProblem: before any impulse, and as impulses change them.

#include <gravel/contact/contact_coloring.hpp>
#include <gravel/contact/solver_rows.hpp>
#include <gravel/core/parallel.hpp>

#include <vector>

namespace gravel::detail {

/// Compact copies of the bodies that take part, by slot. Speeds and masses far from 1 are scaled by powers of
/// two, which is exact, so that dust at 1e-310 m/s neither vanishes nor crawls through subnormal arithmetic.
template <Real S>
class ProblemBodies {
 public:
  using Body = SolverBody<S>;

  std::vector<Body> bodies;             ///< by slot; the last one is the boundary, at rest
  std::vector<SolverStart<S>> initial;  ///< the same before any impulse
  bool friction = false;                ///< any contact where spin matters
  bool again = false;  ///< the last problem once more: what that did to the bodies is done again

  /// What the last solve changed in the velocities of each slot [m s^-1]: v and r w.
  std::vector<SlotChange<S>> changes() const {
    std::vector<SlotChange<S>> all;
    for (std::size_t slot = 0; slot + 1 < bodies.size(); ++slot) {
      all.push_back({scaled<S>(Vector3<S>(bodies[slot].v - initial[slot].v), -speedExponent_),
                     scaled<S>(Vector3<S>(bodies[slot].s - initial[slot].s), -speedExponent_)});
    }
    return all;
  }
  /// Puts them back, for a problem that goes on.
  template <ContactBodies B>
  void resume(const std::vector<SlotChange<S>>& changes, const B& source, const ContactColoring& colouring,
              const ContactKinds& kinds) {
    friction = kinds.rub || kinds.turn;
    again = false;
    gatherBodies(source, colouring, S(0));
    for (std::size_t slot = 0; slot < changes.size(); ++slot) {
      bodies[slot].v = speedIn(changes[slot].v);
      bodies[slot].s = speedIn(changes[slot].s);
      initial[slot].v = initial[slot].s = Vector3<S>::Zero();
    }
  }

  /// Writes the velocities of movable bodies back, spins only where they changed.
  template <ContactBodies B>
  void scatter(B& target, const ContactColoring& colouring) const {
    auto&& velocities = target.velocities();
    auto&& spins = target.angularVelocities();
    auto&& radii = target.radii();
    parallelFor(colouring.bodies().size(), chunk, [&](std::size_t slot) {
      const std::uint32_t i = colouring.bodies()[slot];
      if (bodies[slot].v != initial[slot].v) {
        velocities[i] = scaled<S>(bodies[slot].v, -speedExponent_);
      }
      if (friction && bodies[slot].s != initial[slot].s) {
        spins[i] = Vector3<S>(scaled<S>(bodies[slot].s, -speedExponent_) / radii[i]);
      }
    });
  }

  /// Impulses and energies in SI units from those of the scaled problem, and back.
  S impulseOut(const S& j) const { return scaled<S>(j, -speedExponent_ - massExponent_); }
  Vector3<S> impulseOut(const Vector3<S>& j) const { return scaled<S>(j, -speedExponent_ - massExponent_); }
  S impulseIn(const S& j) const { return scaled<S>(j, speedExponent_ + massExponent_); }
  Vector3<S> impulseIn(const Vector3<S>& j) const { return scaled<S>(j, speedExponent_ + massExponent_); }
  S energyOut(const S& e) const { return scaled<S>(e, -2 * speedExponent_ - massExponent_); }
  S speedIn(const S& v) const { return scaled<S>(v, speedExponent_); }
  Vector3<S> speedIn(const Vector3<S>& v) const { return scaled<S>(v, speedExponent_); }

 protected:
  static constexpr std::size_t chunk = 512;
  using Scales = ProblemScales<S>;

  template <class B>
  void gatherBodies(const B& source, const ContactColoring& colouring, const S& ratio) {
    const std::size_t n = colouring.bodies().size();
    bodies.resize(n + 1);
    initial.resize(n + 1);
    accelerations_.resize(n + 1);
    const Scales scales = orderedSum(n, chunk, Scales{}, [&](std::size_t begin, std::size_t end) {
      Scales part;
      for (std::size_t slot = begin; slot < end; ++slot) {
        const Body before = bodies[slot];
        part += take(source, colouring, slot);
        if (again) {
          initial[slot].v = before.v - initial[slot].v;
          initial[slot].s = before.s - initial[slot].s;
          Body now = bodies[slot];
          weigh(now);
          part.others += now.inverseMass == before.inverseMass && now.spin == before.spin ? 0 : 1;
        }
      }
      return part;
    });
    again = again && scales.others == 0;
    const int speedExponent = speedExponent_;
    accelerations_[n] = Vector3<S>::Zero();
    initial[n].fall = S(0);
    bodies[n] = Body{Vector3<S>::Zero(), S(0), Vector3<S>::Zero(), S(0)};
    speedExponent_ = scaleExponent<S>(scales.fastest, scales.fastest);
    massExponent_ = scaleExponent<S>(scales.lightest, scales.heaviest);
    parallelFor(n + 1, chunk, [&](std::size_t slot) {
      Body& b = bodies[slot];
      if (speedExponent_ != 0) {
        b.v = scaled<S>(b.v, speedExponent_);
        b.s = scaled<S>(b.s, speedExponent_);
      }
      weigh(b);
      auto& start = initial[slot];
      const Vector3<S> dv = start.v;
      const Vector3<S> ds = start.s;
      start.v = b.v;
      start.s = b.s;
      if (again) {
        b.v += ratio * scaled<S>(dv, speedExponent_ - speedExponent);
        b.s += ratio * scaled<S>(ds, speedExponent_ - speedExponent);
      }
    });
  }

  /// From the mass of what is movable to its inverse, in the problem's units.
  void weigh(Body& b) const {
    if (b.inverseMass > S(0)) {
      b.inverseMass = S(1) / scaled<S>(b.inverseMass, massExponent_);
      b.spin *= b.inverseMass;
    }
  }

  /// Takes back what the guess did to a body.
  void restart(std::uint32_t slot) {
    if (bodies[slot].inverseMass > S(0)) {  // immovable bodies are shared between threads: never written
      bodies[slot].v = initial[slot].v;
      bodies[slot].s = initial[slot].s;
    }
  }

  template <class B>
  Scales take(const B& source, const ContactColoring& colouring, std::size_t slot) {
    const std::uint32_t i = colouring.bodies()[slot];
    Body& b = bodies[slot];
    const bool movable = colouring.movable(static_cast<std::uint32_t>(slot));
    const S r = source.radii()[i];
    const S k = source.inertiaFactors()[i];
    b.v = source.velocities()[i];
    b.s =
        friction ? Vector3<S>(r * Vector3<S>(source.angularVelocities()[i])) : Vector3<S>(Vector3<S>::Zero());
    const Vector3<S> a = movable ? Vector3<S>(source.accelerations()[i]) : Vector3<S>(Vector3<S>::Zero());
    accelerations_[slot] = a;
    initial[slot].fall = safeNorm(a);
    b.inverseMass = movable ? S(source.masses()[i]) : S(0);  // the mass, until its scale is known
    b.spin = movable && r > S(0) && k > S(0) ? S(1) / k : S(0);
    return {std::max<S>(maxAbs(b.v), maxAbs(b.s)), b.inverseMass, b.inverseMass};
  }

  std::vector<Vector3<S>> accelerations_;  ///< [m s^-2] by slot, zero of what nothing moves
  int speedExponent_ = 0;
  int massExponent_ = 0;
};

}  // namespace gravel::detail
