#pragma once

/// \file
/// The choice of gravity method at run time, behind two functions.

#include <gravel/gravity/direct_sum.hpp>

#include <variant>

namespace gravel {

/// `Automatic` takes the cheapest method that keeps the tolerance.
enum class GravityKind { Automatic, Direct };

/// To add a method: one header with the same two functions, one line in the variant, one name in the
/// enumeration and in `setKind`.
template <Real S>
class GravitySolver {
 public:
  explicit GravitySolver(GravityKind kind = GravityKind::Automatic) { setKind(kind); }

  GravityKind kind() const { return kind_; }
  void setKind(GravityKind kind) {
    kind_ = kind;
    method_.template emplace<DirectSum<S>>();
  }

  /// Promised rms of |a - a_exact| / |a_exact|. The direct sum errs by rounding only, whatever is asked.
  /// \param tolerance in (0, 1]. \throws std::invalid_argument otherwise
  void setTolerance(const S& tolerance) {
    if (!(tolerance > S(0)) || !(tolerance <= S(1))) {
      detail::refuse("gravity tolerance", detail::formatReal(tolerance), "above 0, at most 1");
    }
    tolerance_ = tolerance;
  }
  const S& tolerance() const { return tolerance_; }

  /// The method in use.
  const char* name() const { return "direct sum"; }

  /// out[i] [m s^-2] for every i; see DirectSum. Nothing is summed when G is 0.
  template <class Positions, class Masses, class Accelerations>
  void accelerations(const Positions& positions, const Masses& masses, const S& G, const S& softening,
                     Accelerations&& out) {
    if (G == S(0)) {
      for (std::size_t i = 0; i < positions.size(); ++i) {
        out[i] = Vector3<S>(Vector3<S>::Zero());
      }
      return;
    }
    std::visit([&](auto& method) { method.accelerations(positions, masses, G, softening, out); }, method_);
  }

  /// [J]; see DirectSum.
  template <class Positions, class Masses>
  S potentialEnergy(const Positions& positions, const Masses& masses, const S& G, const S& softening) {
    if (G == S(0)) {
      return S(0);
    }
    return std::visit([&](auto& method) { return method.potentialEnergy(positions, masses, G, softening); },
                      method_);
  }

 private:
  GravityKind kind_ = GravityKind::Automatic;
  S tolerance_ = S(1e-5);
  std::variant<DirectSum<S>> method_;
};

}  // namespace gravel
