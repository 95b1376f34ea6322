#pragma once

/// \file
/// Newton's law for one pair of points, with Plummer's softening. Pure functions, for a scalar or for lanes.

#include <gravel/core/lanes.hpp>
#include <gravel/core/sizes.hpp>

namespace gravel {

/// The law and its threshold. Distances enter squared and softened, s = r^2 + epsilon^2.
///
/// Unsoftened points closer than sqrt(tiny) attract like a homogeneous sphere of that radius: the force goes
/// to zero with the distance instead of to infinity, coincident points exert none, and action stays reaction.
template <Real S>
struct PairLaw {
  /// Squared length, in units of the system's extent, below which two points count as one: distances of
  /// 1e-100 in double, 1e-12 in float, 1e-50 in other types, 6e-7 in those of float's range. Chosen so that
  /// s^(-3/2) stays in range, and for dual numbers its square, by which the derivative of the quotient
  /// divides.
  static S tiny() {
    if constexpr (std::is_same_v<S, float>) {
      return 1e-24F;
    } else if constexpr (std::is_floating_point_v<S>) {
      return S(1e-200L);
    } else {
      return detail::leastWithCube<S>();
    }
  }

  /// w in a_i = G m_j w (x_j - x_i): s^(-3/2) [m^-3]. Errs by 2 units in the last place; lanes by up to
  /// 4 where Eigen's packed square root is an estimate with Newton steps (float, and double with AVX-512).
  template <class T>
  static T accelerationFactor(const T& s) {
    return toMinusThreeHalves(T(atLeast(s, tiny())));
  }

  /// p in U = -G m_i m_j p: s^(-1/2) [m^-1]; 0 for coincident points, whose energy has no meaning.
  template <class T>
  static T potentialFactor(const T& s) {
    using std::sqrt;
    return T(atMost(T(s * S(S(1) / tiny())), S(1)) / sqrt(atLeast(s, tiny())));
  }

 private:
  static S atLeast(const S& a, const S& low) { return a < low ? low : a; }
  static S atMost(const S& a, const S& high) { return a < high ? a : high; }

  static S toMinusThreeHalves(const S& s) {
    using std::sqrt;
    return S(1) / (s * sqrt(s));
  }
  /// Reciprocal square roots need no division where the target estimates them (AVX-512).
  template <int W>
  static Lanes<S, W> toMinusThreeHalves(const Lanes<S, W>& s) {
    const Lanes<S, W> root = s.rsqrt();
    return root * (root * root);
  }

  template <int W>
  static Lanes<S, W> atLeast(const Lanes<S, W>& a, const S& low) {
    return a.max(low);
  }
  template <int W>
  static Lanes<S, W> atMost(const Lanes<S, W>& a, const S& high) {
    return a.min(high);
  }
};

}  // namespace gravel
