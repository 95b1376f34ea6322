#pragma once

/// \file
/// The bodies of a ContactProblem: before any impulse, and as impulses change them.

#include <gravel/contact/contact_coloring.hpp>
#include <gravel/contact/row_watch.hpp>
#include <gravel/contact/solver_rows.hpp>
#include <gravel/contact/turning_pair.hpp>
#include <gravel/core/packed.hpp>
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
  RowWatch<S> watch;   ///< what a body has moved by since rows were right, where it begins included

  /// Writes the velocities of movable bodies back, spins only where they changed.
  template <ContactBodies B>
  void scatter(B& target, const ContactColoring& colouring) const {
    parallelForChunks<Share::Alike>(
        colouring.bodies().size(), chunk,
        [&](std::size_t begin, std::size_t end) { scatterPart(target, colouring, begin, end); });
  }

  /// [m s^-2] Against this contacts hold a body: its acceleration; where nothing stands still, less that of
  /// what hangs together with it, and where planes speed up, more that of these.
  const S& fallOf(std::uint32_t slot) const { return initial[slot].fall; }
  const S& mostFall() const { return mostFall_; }

  /// What impulses did to the velocity of a body [m s^-1], and to its spin [rad/s].
  Vector3<S> changeOf(std::uint32_t slot) const {
    return scaled<S>(Vector3<S>(bodies[slot].v - initial[slot].v), -speedExponent_);
  }
  Vector3<S> turnOf(std::uint32_t slot) const {
    const Vector3<S> ds = scaled<S>(Vector3<S>(bodies[slot].s - initial[slot].s), -speedExponent_);
    return ds * reciprocal<S>(initial[slot].radius);
  }

  /// Impulses and energies in SI units from those of the scaled problem, and back.
  S impulseOut(const S& j) const { return scaled<S>(j, -speedExponent_ - massExponent_); }
  Vector3<S> impulseOut(const Vector3<S>& j) const { return scaled<S>(j, -speedExponent_ - massExponent_); }
  bool isScaled() const { return speedExponent_ != 0 || massExponent_ != 0; }
  S energyOut(const S& e) const { return scaled<S>(e, -2 * speedExponent_ - massExponent_); }
  /// Changes of velocities below that are none.
  S roundingOfSpeeds() const { return roundoff<S>() * fastest_; }
  S speedIn(const S& v) const { return scaled<S>(v, speedExponent_); }
  Vector3<S> speedIn(const Vector3<S>& v) const { return scaled<S>(v, speedExponent_); }
  Packed<S> speedIn(const Packed<S>& v) const { return scaledLanes(v, speedExponent_); }
  PackedQuad<S> impulseIn(const PackedQuad<S>& j) const {
    return scaledLanes(j, speedExponent_ + massExponent_);
  }

  /// Takes back what impulses did to a body.
  void restart(std::uint32_t slot) {
    if (bodies[slot].inverseMass > S(0)) {  // immovable bodies are shared between threads: never written
      bodies[slot].v = initial[slot].v;
      bodies[slot].s = initial[slot].s;
    }
  }

 protected:
  static constexpr std::size_t chunk = 512;
  using Scales = ProblemScales<S>;

  template <class B>
  void gatherBodies(const B& source, const ContactColoring& colouring, const S& ratio) {
    findFalls(source, colouring);
    const std::size_t n = colouring.bodies().size();
    resizeSparingly(bodies, n + 1);
    resizeSparingly(initial, n + 1);
    watch.setHolds(watch.holds() && again && speedExponent_ == 0);
    // Mostly nothing was to be scaled, and so it goes on: one look at a body is enough.
    const bool plain = speedExponent_ == 0 && massExponent_ == 0;
    const Scales scales = orderedSum(n, chunk, Scales{}, [&](std::size_t begin, std::size_t end) {
      return gatherPart(source, colouring, ratio, plain, begin, end);
    });
    turns_ = scales.mostTurn > turningShare<S>() * scales.leastFall;
    const bool wasAgain = again;
    const S tooMuch = S(1) / roundoff<S>();
    again = again && scales.others == 0 &&
            !(ratio * scales.change > tooMuch * scaled<S>(scales.fastest, speedExponent_));
    const int speedExponent = speedExponent_;
    const int massExponent = massExponent_;
    speedExponent_ = scaleExponent<S>(scales.fastest, scales.fastest);
    massExponent_ = scaleExponent<S>(scales.lightest, scales.heaviest);
    sameScales_ = speedExponent == speedExponent_ && massExponent == massExponent_;
    again = again && (sameScales_ || !plain);
    heaviest_ = scaled<S>(scales.heaviest, massExponent_);
    fastest_ = scaled<S>(scales.fastest, speedExponent_);
    mostFall_ = scales.mostFall;
    leastFall_ = scales.leastFall;
    mostGuess_ = tooMuch * fastest_ * heaviest_;
    initial[n].v = initial[n].s = Vector3<S>::Zero();
    initial[n].fall = initial[n].radius = S(0);
    bodies[n] = Body{Vector3<S>::Zero(), S(0), Vector3<S>::Zero(), S(0)};
    if (plain && sameScales_ && again == wasAgain) {
      return;
    }
    parallelFor(n, chunk, [&](std::size_t slot) {
      Body& b = bodies[slot];
      auto& start = initial[slot];
      const Vector3<S> dv = start.v;
      const Vector3<S> ds = start.s;
      if (plain) {
        b = take(source, colouring, slot);
      }
      b.v = scaled<S>(b.v, speedExponent_);
      b.s = scaled<S>(b.s, speedExponent_);
      weigh(b);
      start.v = b.v;
      start.s = b.s;
      if (again) {
        b.v += ratio * scaled<S>(dv, speedExponent_ - speedExponent);
        b.s += ratio * scaled<S>(ds, speedExponent_ - speedExponent);
      }
    });
  }

  template <class B>
  [[gnu::flatten]] void scatterPart(B& target, const ContactColoring& colouring, std::size_t begin,
                                    std::size_t end) const {
    auto&& velocities = target.velocities();
    auto&& spins = target.angularVelocities();
    auto&& radii = target.radii();
    for (std::size_t slot = begin; slot < end; ++slot) {
      const std::uint32_t i = colouring.bodies()[slot];
      const bool always = !equalIsSame<S> && colouring.movable(static_cast<std::uint32_t>(slot));
      if (always || bodies[slot].v != initial[slot].v) {
        velocities[i] = scaled<S>(bodies[slot].v, -speedExponent_);
      }
      if (friction && ((always && radii[i] > S(0)) || bodies[slot].s != initial[slot].s)) {
        spins[i] = Vector3<S>(scaled<S>(bodies[slot].s, -speedExponent_) / radii[i]);
      }
    }
  }

  /// Of slots [begin, end) what gatherBodies() begins with. \param plain  it is thought that nothing is to be
  /// scaled
  template <class B>
  [[gnu::flatten]] Scales gatherPart(const B& source, const ContactColoring& colouring, const S& ratio,
                                     bool plain, std::size_t begin, std::size_t end) {
    Scales part;
    for (std::size_t slot = begin; slot < end; ++slot) {
      Body now = take(source, colouring, slot);
      part += {std::max<S>(maxAbs(now.v), maxAbs(now.s)), S(0), now.inverseMass, now.inverseMass};
      if (now.inverseMass > S(0)) {
        part.leastFall = std::min<S>(part.leastFall, initial[slot].fall);
        part.mostFall = std::max<S>(part.mostFall, initial[slot].fall);
      }
      if (initial[slot].radius > S(0)) {
        part.mostTurn = std::max<S>(part.mostTurn, S(now.s.squaredNorm() / initial[slot].radius));
      }
      Body weighed = now;
      weigh(weighed);
      auto& start = initial[slot];
      Vector3<S> dv = Vector3<S>::Zero();
      Vector3<S> ds = Vector3<S>::Zero();
      if (again) {
        const Body& before = bodies[slot];
        if (watch.holds()) {
          watch.move(slot, Vector3<S>(now.v - start.v).norm() + Vector3<S>(now.s - start.s).norm());
        }
        dv = before.v - start.v;
        ds = before.s - start.s;
        part.change = std::max<S>(part.change, std::max<S>(maxAbs(dv), maxAbs(ds)));
        part.others += weighed.inverseMass == before.inverseMass && weighed.spin == before.spin ? 0 : 1;
      }
      if (plain) {
        start.v = now.v;
        start.s = now.s;
        weighed.v += ratio * dv;
        weighed.s += ratio * ds;
      } else {
        start.v = dv;
        start.s = ds;
      }
      bodies[slot] = plain ? weighed : now;
    }
    return part;
  }

  /// From the mass of what is movable to its inverse, in the problem's units.
  void weigh(Body& b) const {
    if (b.inverseMass > S(0)) {
      b.inverseMass = S(1) / scaled<S>(b.inverseMass, massExponent_);
      b.spin *= b.inverseMass;
    }
  }

  /// [m s^-2] by forces, without what its frame adds; zero of what nothing moves.
  template <class B>
  Vector3<S> accelerationOf(const B& source, const ContactColoring& colouring, std::size_t slot) const {
    return colouring.movable(static_cast<std::uint32_t>(slot))
               ? Vector3<S>(source.accelerations()[colouring.bodies()[slot]])
               : Vector3<S>(Vector3<S>::Zero());
  }
  Vector3<S> bendAt(const ContactColoring& colouring, std::size_t slot) const {
    const bool bends = !bend_.empty() && slot < colouring.bodies().size() &&
                       colouring.movable(static_cast<std::uint32_t>(slot));
    return bends ? bend_[colouring.bodies()[slot]] : Vector3<S>(Vector3<S>::Zero());
  }

  /// By which the centre of mass of an island falls: no contact holds it against that, and who falls with it
  /// sees nothing of it.
  struct IslandFall {
    S mass = S(0);
    Vector3<S> a = Vector3<S>::Zero();     ///< [m s^-2] by forces
    Vector3<S> bend = Vector3<S>::Zero();  ///< [m s^-2] that its frame adds
  };

  /// One after the other, in the order of slots. O(bodies) where islands are free.
  template <class B>
  void findFalls(const B& source, const ContactColoring& colouring) {
    const SolverIslands& islands = colouring.islands();
    if (!islands.areFree()) {
      return;
    }
    common_.assign(islands.size(), IslandFall{});
    for (std::uint32_t slot = 0; slot < colouring.bodies().size(); ++slot) {
      if (colouring.movable(slot)) {
        // The mean so far moves by the share of each, so that no unit is too large or too small.
        IslandFall& common = common_[islands.of(slot)];
        const S mass = source.masses()[colouring.bodies()[slot]];
        common.mass += mass;
        const S share = mass / common.mass;
        common.a += share * Vector3<S>(accelerationOf(source, colouring, slot) - common.a);
        common.bend += share * Vector3<S>(bendAt(colouring, slot) - common.bend);
      }
    }
  }

  /// A body with its mass in place of its inverse, until the scale of masses is known.
  template <class B>
  Body take(const B& source, const ContactColoring& colouring, std::size_t slot) {
    const std::uint32_t i = colouring.bodies()[slot];
    Body b;
    const bool movable = colouring.movable(static_cast<std::uint32_t>(slot));
    const S r = source.radii()[i];
    const S k = source.inertiaFactors()[i];
    b.v = velocityOf(source, i);
    b.s = friction ? Vector3<S>(r * spinOf(source, i)) : Vector3<S>(Vector3<S>::Zero());
    Vector3<S> a = accelerationOf(source, colouring, slot);
    Vector3<S> bend = bendAt(colouring, slot);
    if (movable && colouring.islands().areFree()) {
      const IslandFall& common = common_[colouring.islands().of(static_cast<std::uint32_t>(slot))];
      a -= common.a;
      bend -= common.bend;
    }
    // Kicks are by forces alone, drifts bend by what the frame adds: where the two nearly cancel, as in what
    // hardly holds together in the tide, each brings together what rests, more than their sum does.
    initial[slot].fall = safeNorm(a);
    if (!bend_.empty()) {
      initial[slot].fall = std::max<S>(initial[slot].fall, safeNorm(Vector3<S>(a + bend)));
    }
    if (movable && !carried_.empty()) {
      initial[slot].fall += carried_[i];
    }
    initial[slot].radius = r;
    b.inverseMass = movable ? S(source.masses()[i]) : S(0);
    b.spin = movable && r > S(0) && k > S(0) ? S(1) / k : S(0);
    return b;
  }

  int speedExponent_ = 0;
  int massExponent_ = 0;
  bool sameScales_ = false;           ///< as in the last problem
  bool turns_ = false;                ///< spins may count in TurningPair
  std::span<const Vector3<S>> bend_;  ///< of WayAhead
  std::span<const S> carried_;        ///< of WayAhead
  std::vector<IslandFall> common_;    ///< by the slot that stands for the island
  /// Above that an impulse of the last problem would leave nothing but its rounding: speeds have fallen.
  S mostGuess_ = S(0);
  S heaviest_ = S(0);  ///< mass, scaled
  S fastest_ = S(0);   ///< speed, scaled
  S mostFall_ = S(0);  ///< [m s^-2]
  S leastFall_ = S(0);
  /// Normal impulse that friction counts at most: 100 times what stops all at the largest approach and a
  /// fall.
  S mostLoad_ = S(0);
};

}  // namespace gravel::detail
