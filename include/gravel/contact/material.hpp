#pragma once

/// \file
/// What two surfaces do to each other: four numbers a pair.

#include <gravel/core/check.hpp>

#include <string>

namespace gravel {

/// Coefficients of a surface, or of a pair of surfaces once mixed. An aggregate: use designated initialisers.
template <Real Scalar = double>
struct Material {
  /// [1], 0 … 1: speed of departure over speed of approach along the normal. 1 keeps the energy.
  Scalar restitution = Scalar(0.5);
  /// [1], >= kineticFriction: a contact sticks while that takes at most this times the normal impulse.
  Scalar staticFriction = Scalar(0.4);
  /// [1], >= 0: a sliding contact feels this times the normal impulse against its slip.
  Scalar kineticFriction = Scalar(0.3);
  /// [1], 0 … 1: slip after over slip before, reversed, of an impact that sticks (beta_0 of Walton 1993).
  /// 0 stops the slip; about 0.4 fits glass (Kharaz, Gorham & Salman 2001, Powder Technol. 120, 281).
  Scalar tangentialRestitution = Scalar(0);

  friend bool operator==(const Material&, const Material&) = default;
};

/// \throws std::invalid_argument naming the coefficient of `who`, its value and what is allowed
template <Real Scalar>
void validate(const Material<Scalar>& material, const std::string& who) {
  const auto check = [&](const char* field, const Scalar& x, const detail::Range<Scalar>& range) {
    if (!range.contains(x)) {
      detail::refuse(std::string(field) + " of " + who, detail::formatReal(x), range.text);
    }
  };
  check("restitution", material.restitution, detail::unitInterval<Scalar>());
  check("kineticFriction", material.kineticFriction, detail::nonNegative<Scalar>());
  check("staticFriction", material.staticFriction, detail::nonNegative<Scalar>());
  check("tangentialRestitution", material.tangentialRestitution, detail::unitInterval<Scalar>());
  if (material.staticFriction < material.kineticFriction) {
    detail::refuse("staticFriction of " + who, detail::formatReal(material.staticFriction),
                   ">= kineticFriction, which is " + detail::formatReal(material.kineticFriction));
  }
}

namespace detail {

/// sqrt(a b) without overflow or underflow; a for a == b, exactly.
template <Real Scalar>
Scalar geometricMean(const Scalar& a, const Scalar& b) {
  using std::sqrt;
  return a == b ? a : Scalar(sqrt(a)) * Scalar(sqrt(b));
}

}  // namespace detail

/// The pair of two surfaces: the geometric mean of each coefficient. So a partner with 0 makes the pair
/// frictionless, or wholly inelastic; mix(a, b) is mix(b, a), and mix(a, a) is a, to the bit.
template <Real Scalar>
Material<Scalar> mix(const Material<Scalar>& a, const Material<Scalar>& b) {
  Material<Scalar> pair;
  pair.restitution = detail::geometricMean(a.restitution, b.restitution);
  pair.kineticFriction = detail::geometricMean(a.kineticFriction, b.kineticFriction);
  pair.staticFriction = detail::geometricMean(a.staticFriction, b.staticFriction);
  pair.tangentialRestitution = detail::geometricMean(a.tangentialRestitution, b.tangentialRestitution);
  if (pair.staticFriction < pair.kineticFriction) {
    pair.staticFriction = pair.kineticFriction;  // one rounding apart
  }
  return pair;
}

/// Restitution at a speed of approach: the one place where a law of impact speed enters.
template <Real Scalar>
Scalar restitutionAt(const Material<Scalar>& material, const Scalar& /*approachSpeed*/) {
  return material.restitution;
}

}  // namespace gravel
