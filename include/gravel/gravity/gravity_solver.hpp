#pragma once

/// \file
/// The choice of gravity method at run time, behind two functions.

#include <gravel/gravity/direct_sum.hpp>
#include <gravel/gravity/fast_multipole.hpp>

#include <array>

namespace gravel {

/// `Automatic` takes the method that is expected to be cheaper for the number of bodies, how many of them
/// have mass, and the tolerance.
enum class GravityKind { Automatic, Direct, FastMultipole };

/// To add a method: one header with the same functions, a member, a name in the enumeration, and a case in
/// `visit`.
template <Real S>
class GravitySolver {
 public:
  explicit GravitySolver(GravityKind kind = GravityKind::Automatic) {
    setKind(kind);
    setTolerance(multipoles_.tolerance());
  }

  GravityKind kind() const { return kind_; }
  void setKind(GravityKind kind) { kind_ = kind; }

  /// Promised rms of |a - a_exact| / |a_exact|. The direct sum errs by rounding only, whatever is asked, and
  /// in a domain with images by those far away.
  /// \param tolerance in (0, 1]. \throws std::invalid_argument otherwise
  void setTolerance(const S& tolerance) {
    multipoles_.setTolerance(tolerance);
    direct_.setImageTolerance(tolerance);
  }
  const S& tolerance() const { return multipoles_.tolerance(); }

  /// Whose images pull; see DirectSum::setDomain. \param time [s] for a domain that shears
  void setDomain(const Domain<S>& domain, const S& time = S(0)) {
    direct_.setDomain(domain, time);
    multipoles_.setDomain(domain, time);
    isOpen_ = domain.isOpen();
  }

  /// How many bodies, all with mass, give the direct sum as many pairs a body as these do: the sum looks at m
  /// sources for each of n bodies, at two of them together once, where expansions cost what all n do. Fewer
  /// than n where some are tracers; n where none is.
  template <class Masses>
  static std::size_t asMany(const Masses& masses) {
    const std::size_t n = masses.size();
    std::size_t m = 0;
    for (std::size_t i = 0; i < n; ++i) {
      m += S(masses[i]) > S(0) ? 1U : 0U;
    }
    return m == n ? n : m * (2 * n - m) / n;
  }

  /// The method for that many bodies with mass, never `Automatic`; see asMany(). A function of the number, of
  /// the tolerance, of the kind of domain, of the scalar and of the width of the lanes that the target has: a
  /// run that is taken up again by the same program takes it again.
  GravityKind choice(std::size_t bodies) const {
    if (kind_ != GravityKind::Automatic) {
      return kind_;
    }
    // Images cost the direct sum 10 to 60 times as much, expansions 2 to 3 times: measured, see the docs.
    const std::size_t asMany = isOpen_ ? bodies : 30 * bodies;
    return FastMultipole<S>::isWorthwhile(asMany, tolerance()) ? GravityKind::FastMultipole
                                                               : GravityKind::Direct;
  }

  /// Its name in reports.
  const char* name(std::size_t bodies) const {
    return choice(bodies) == GravityKind::Direct ? "direct sum" : "fast multipole method";
  }

  /// out[i] [m s^-2] for every i; see DirectSum. Nothing is summed when G is 0.
  template <class Positions, class Masses, class Accelerations>
  void accelerations(const Positions& positions, const Masses& masses, const S& G, const S& softening,
                     Accelerations&& out) {
    if (G == S(0)) {
      requireAll(positions, masses, softening);
      detail::requireRoom(out, positions.size());
      for (std::size_t i = 0; i < positions.size(); ++i) {
        out[i] = Vector3<S>(Vector3<S>::Zero());
      }
      return;
    }
    visit(masses, [&](auto& method) { method.accelerations(positions, masses, G, softening, out); });
  }

  /// The same for bodies of these numbers only; see DirectSum. The method is that for all bodies.
  template <class Numbers, class Positions, class Masses, class Accelerations>
  void accelerationsOf(const Numbers& numbers, const Positions& positions, const Masses& masses, const S& G,
                       const S& softening, Accelerations&& out) {
    if (G == S(0)) {
      requireAll(positions, masses, softening);
      detail::requireRoom(out, positions.size());
      detail::requireBodies(numbers, positions.size());
      for (std::size_t k = 0; k < numbers.size(); ++k) {
        out[static_cast<std::size_t>(numbers[k])] = Vector3<S>(Vector3<S>::Zero());
      }
      return;
    }
    visit(masses,
          [&](auto& method) { method.accelerationsOf(numbers, positions, masses, G, softening, out); });
  }

  /// [J]; see DirectSum.
  template <class Positions, class Masses>
  S potentialEnergy(const Positions& positions, const Masses& masses, const S& G, const S& softening) {
    S energy(0);
    if (G == S(0)) {
      requireAll(positions, masses, softening);
    } else {
      visit(masses, [&](auto& method) { energy = method.potentialEnergy(positions, masses, G, softening); });
    }
    return energy;
  }

  /// What the potential energy loses with body i [J]; see DirectSum. O(N) by pairs, whatever the method.
  template <class Positions, class Masses>
  S energyOf(std::size_t i, const Positions& positions, const Masses& masses, const S& G,
             const S& softening) {
    if (G == S(0)) {
      requireAll(positions, masses, softening);
      detail::requireBodies(std::array{i}, positions.size());
      return S(0);
    }
    return direct_.energyOf(i, positions, masses, G, softening);
  }

 private:
  /// What a sum refuses, but for the values of bodies, which it does not look at without G.
  template <class Positions, class Masses>
  static void requireAll(const Positions& positions, const Masses& masses, const S& softening) {
    detail::requireMasses(masses, positions.size());
    detail::require("softening", softening, detail::nonNegative<S>());
  }

  template <class Masses, class F>
  void visit(const Masses& masses, F&& f) {
    if (choice(asMany(masses)) == GravityKind::Direct) {
      f(direct_);
    } else {
      f(multipoles_);
    }
  }

  GravityKind kind_ = GravityKind::Automatic;
  bool isOpen_ = true;
  DirectSum<S> direct_;
  FastMultipole<S> multipoles_;
};

}  // namespace gravel
