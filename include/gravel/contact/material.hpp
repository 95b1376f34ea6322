#pragma once

/// \file
/// What two surfaces do to each other: coefficients of a pair.

#include <gravel/core/check.hpp>
#include <gravel/core/sizes.hpp>

#include <string>

namespace gravel {

/// Coefficients of a surface, or of a pair of surfaces once mixed. An aggregate: use designated initialisers.
template <Real Scalar = double>
struct Material {
  /// [1], 0 … 1: speed of departure over speed of approach along the normal. 1 keeps the energy. With a
  /// restitutionExponent this is its largest value, see `restitutionAt`.
  Scalar restitution = Scalar(0.5);
  /// [1], >= kineticFriction: a contact sticks while that takes at most this times the normal impulse. What
  /// is smooth has 0 of both.
  Scalar staticFriction = Scalar(0.4);
  /// [1], >= 0: a sliding contact feels this times the normal impulse against its slip.
  Scalar kineticFriction = Scalar(0.3);
  /// [1], 0 … 1: slip after over slip before, reversed, of an impact that sticks (beta_0 of Walton 1993).
  /// 0 stops the slip; about 0.4 fits glass (Kharaz, Gorham & Salman 2001, Powder Technol. 120, 281).
  Scalar tangentialRestitution = Scalar(0);
  /// [1], 0 … 1: q in e ~ v^-q; 0 makes restitution a constant. Cold ice 0.234, viscoelastic spheres 1/5,
  /// plastic ones 1/4 for fast blows.
  Scalar restitutionExponent = Scalar(0);
  /// [m s^-1] > 0: up to this speed of approach restitution has its largest value. Without a meaning while
  /// the exponent is 0.
  Scalar restitutionSpeed = Scalar(1);
  /// [1], >= 0: rolling is resisted by a torque of at most this times the effective radius times the normal
  /// force; the effective radius is r1 r2/(r1 + r2), that of the sphere on a plane. A sphere on an incline
  /// stays while the tangent of its angle is below this.
  Scalar rollingFriction = Scalar(0);
  /// [1], >= 0: the same for spin about the normal. A flat spot of radius c under even pressure has
  /// (2/3) kineticFriction c over the effective radius, a Hertzian one 3 pi/16 in place of 2/3.
  Scalar spinningFriction = Scalar(0);

  friend bool operator==(const Material&, const Material&) = default;
};

/// \throws std::invalid_argument naming the coefficient of `who`, its value and what is allowed
template <Real Scalar>
void validate(const Material<Scalar>& material, const std::string& who) {
  const auto check = [&](const char* field, const Scalar& x, const detail::Range<Scalar>& range) {
    if (!range.contains(x)) {
      detail::refuse(std::string(field) + " of " + who, detail::formatReal(x), range.allowed(x));
    }
  };
  check("restitution", material.restitution, detail::unitInterval<Scalar>());
  check("kineticFriction", material.kineticFriction, detail::nonNegative<Scalar>());
  check("staticFriction", material.staticFriction, detail::nonNegative<Scalar>());
  check("tangentialRestitution", material.tangentialRestitution, detail::unitInterval<Scalar>());
  check("restitutionExponent", material.restitutionExponent, detail::unitInterval<Scalar>());
  check("restitutionSpeed", material.restitutionSpeed, detail::positive<Scalar>());
  check("rollingFriction", material.rollingFriction, detail::nonNegative<Scalar>());
  check("spinningFriction", material.spinningFriction, detail::nonNegative<Scalar>());
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

using std::pow;

/// A power found as Eigen finds it, for a type that has one.
template <class T>
auto powerOf(const T& x, const T& y) -> decltype(T(pow(x, y))) {
  return T(pow(x, y));
}

/// x^y for x >= 0, 0 <= y <= 1.
template <Real Scalar>
Scalar fractionalPower(const Scalar& x, const Scalar& y) {
  if constexpr (requires { powerOf(x, y); }) {
    return powerOf(x, y);
  } else {  // by the binary digits of y: x^(1/2), x^(1/4), … are square roots
    using std::sqrt;
    if (!(y < Scalar(1))) {
      return x;
    }
    Scalar result(1);
    Scalar root = x;
    Scalar rest = y;
    Scalar digit = Scalar(1);
    while (rest > Scalar(0) && digit > roundoff<Scalar>() * Scalar(0.25)) {
      root = Scalar(sqrt(root));
      digit = digit / Scalar(2);
      if (rest >= digit) {
        rest -= digit;
        result *= root;
      }
    }
    return result;
  }
}

}  // namespace detail

/// Restitution at a speed of approach v [m s^-1]: the one place where a law of impact speed enters.
///   e(v) = restitution min(1, (v / restitutionSpeed)^-restitutionExponent)
/// Frosty ice at some 200 K is {restitution 1, restitutionExponent 0.234, restitutionSpeed 7.7e-5 m/s}
/// (Bridges, Hatzes & Lin 1984, Nature 309, 333). A power where the exponent is not 0.
template <Real Scalar>
Scalar restitutionAt(const Material<Scalar>& material, const Scalar& approachSpeed) {
  if (material.restitutionExponent == Scalar(0) || !(approachSpeed > material.restitutionSpeed)) {
    return material.restitution;
  }
  return material.restitution * detail::fractionalPower<Scalar>(material.restitutionSpeed / approachSpeed,
                                                                material.restitutionExponent);
}

namespace detail {

/// Restitution of the pair as a function: the geometric mean of the two functions, where both are below or
/// both above the speed from which they fall. Between two different such speeds that of the pair is the
/// geometric mean weighted by the exponents, so that it joins these two parts.
template <Real Scalar>
void mixRestitution(const Material<Scalar>& a, const Material<Scalar>& b, Material<Scalar>& pair) {
  const Scalar q = a.restitutionExponent + b.restitutionExponent;
  pair.restitution = geometricMean(a.restitution, b.restitution);
  pair.restitutionExponent = q / Scalar(2);
  pair.restitutionSpeed = a.restitutionSpeed;
  if (!(a.restitutionSpeed == b.restitutionSpeed)) {
    const Scalar share = q > Scalar(0) ? Scalar(a.restitutionExponent / q) : Scalar(0.5);
    const Scalar other = q > Scalar(0) ? Scalar(b.restitutionExponent / q) : Scalar(0.5);
    pair.restitutionSpeed = fractionalPower<Scalar>(a.restitutionSpeed, share) *
                            fractionalPower<Scalar>(b.restitutionSpeed, other);
  }
}

}  // namespace detail

/// The pair of two surfaces: the geometric mean of each coefficient, and of restitution as a function of
/// speed (for two laws that fall from different speeds on: outside of these two). So a partner with 0 makes
/// the pair frictionless, or wholly inelastic; mix(a, b) is mix(b, a), and mix(a, a) is a, to the bit.
template <Real Scalar>
Material<Scalar> mix(const Material<Scalar>& a, const Material<Scalar>& b) {
  Material<Scalar> pair;
  detail::mixRestitution(a, b, pair);
  pair.kineticFriction = detail::geometricMean(a.kineticFriction, b.kineticFriction);
  pair.staticFriction = detail::geometricMean(a.staticFriction, b.staticFriction);
  pair.tangentialRestitution = detail::geometricMean(a.tangentialRestitution, b.tangentialRestitution);
  pair.rollingFriction = detail::geometricMean(a.rollingFriction, b.rollingFriction);
  pair.spinningFriction = detail::geometricMean(a.spinningFriction, b.spinningFriction);
  if (pair.staticFriction < pair.kineticFriction) {
    pair.staticFriction = pair.kineticFriction;  // one rounding apart
  }
  return pair;
}

}  // namespace gravel
