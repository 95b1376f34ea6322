#pragma once

/// \file
/// Sizes of numbers and vectors, where squares may leave the range of numbers, and of a user's scalars.

#include <gravel/core/types.hpp>

#include <algorithm>

namespace gravel {

namespace detail {

/// |x|; from comparisons where it must be, since a user's scalar need not have abs().
template <Real Scalar>
[[gnu::always_inline]] inline Scalar sizeOf(const Scalar& x) {
  if constexpr (std::is_floating_point_v<Scalar>) {
    return std::abs(x);
  } else {
    return x < Scalar(0) ? Scalar(-x) : x;
  }
}

/// 1e-100, or as much more as it takes for its cube to be in the scalar's range: 3e-13 in that of float.
template <Real Scalar>
Scalar leastWithCube() {
  static const double least = [] {
    double x = 1e-100;
    while (!(Scalar(Scalar(x) * Scalar(x) * Scalar(x)) > Scalar(0))) {
      x = std::sqrt(x);
    }
    return x;
  }();
  return Scalar(least);
}

/// The difference between 1 and the next number; found where a user's scalar has no numeric_limits.
template <Real Scalar>
Scalar roundoff() {
  if constexpr (std::numeric_limits<Scalar>::is_specialized) {
    return Scalar(std::numeric_limits<Scalar>::epsilon());
  } else {
    static const double least = [] {
      double x = 1;
      while (Scalar(Scalar(1) + Scalar(x / 2)) > Scalar(1)) {
        x /= 2;
      }
      return x;
    }();
    return Scalar(least);
  }
}

/// The largest number, or of a user's scalar without numeric_limits a power of two times that of double that
/// is near it.
template <Real Scalar>
Scalar highest() {
  if constexpr (std::numeric_limits<Scalar>::is_specialized) {
    return Scalar(std::numeric_limits<Scalar>::max());
  } else {
    static const double most = [] {
      double x = std::numeric_limits<double>::max();
      while (!(Scalar(Scalar(x) / Scalar(2)) < Scalar(x))) {  // an infinity is its half
        x /= 2;
      }
      return x;
    }();
    return Scalar(most);
  }
}

/// Largest |coefficient|.
template <Real Scalar>
Scalar maxAbs(const Vector3<Scalar>& v) {
  Scalar largest(0);
  for (int c = 0; c < 3; ++c) {
    const Scalar size = sizeOf<Scalar>(v[c]);
    largest = size <= largest ? largest : size;  // keeps a NaN
  }
  return largest;
}

/// The same of an array of any length.
template <class Derived>
auto largestOf(const Eigen::ArrayBase<Derived>& a) {
  using Scalar = typename Derived::Scalar;
  if constexpr (std::is_floating_point_v<Scalar>) {
    return Scalar(a.abs().maxCoeff());
  } else {
    Scalar largest(0);
    for (Eigen::Index i = 0; i < a.size(); ++i) {
      largest = std::max<Scalar>(largest, sizeOf<Scalar>(a.derived().coeff(i)));
    }
    return largest;
  }
}

/// |x| + |y| + |z|, at least |v|.
template <Real Scalar>
[[gnu::always_inline]] inline Scalar sumAbs(const Vector3<Scalar>& v) {
  return sizeOf<Scalar>(v[0]) + sizeOf<Scalar>(v[1]) + sizeOf<Scalar>(v[2]);
}

/// |v| of a vector whose square leaves the range of numbers.
template <Real Scalar>
Scalar scaledNorm(const Vector3<Scalar>& v) {
  const Scalar largest = maxAbs(v);
  if (!(largest > Scalar(0)) || !std::isfinite(largest)) {
    return largest;
  }
  int exponent = 0;
  (void)std::frexp(largest, &exponent);
  const Vector3<Scalar> scaled(std::ldexp(v[0], -exponent), std::ldexp(v[1], -exponent),
                               std::ldexp(v[2], -exponent));
  return std::ldexp(std::sqrt(scaled.squaredNorm()), exponent);
}

/// |v| without overflow or underflow of the squares.
template <Real Scalar>
[[gnu::always_inline]] inline Scalar safeNorm(const Vector3<Scalar>& v) {
  using std::sqrt;
  const Scalar sq = v.squaredNorm();
  if constexpr (std::is_floating_point_v<Scalar>) {
    constexpr Scalar tiny = std::numeric_limits<Scalar>::min() / std::numeric_limits<Scalar>::epsilon();
    if (!(sq > tiny) || !(sq < std::numeric_limits<Scalar>::max())) {
      return scaledNorm(v);
    }
  } else if (sq == Scalar(0)) {  // the root of a dual number has no derivative there
    return Scalar(0);
  }
  return Scalar(sqrt(sq));
}

/// v / |v|, of length |v| in the range where squares leave that of numbers.
template <Real Scalar>
Vector3<Scalar> scaledUnit(const Vector3<Scalar>& v) {
  int exponent = 0;
  (void)std::frexp(maxAbs(v), &exponent);
  const Vector3<Scalar> scaled(std::ldexp(v[0], -exponent), std::ldexp(v[1], -exponent),
                               std::ldexp(v[2], -exponent));
  return scaled / std::sqrt(scaled.squaredNorm());
}

/// v / length for length = |v|; v itself where it is zero or NaN, NaN where it is infinite.
template <Real Scalar>
[[gnu::always_inline]] inline Vector3<Scalar> safeUnit(const Vector3<Scalar>& v, const Scalar& length) {
  if (!(length > Scalar(0))) {
    return v;
  }
  if constexpr (std::is_floating_point_v<Scalar>) {
    if (length < std::numeric_limits<Scalar>::min() / std::numeric_limits<Scalar>::epsilon() ||
        !std::isfinite(length)) {  // v / length would lose digits: bring it to order one first
      return scaledUnit(v);
    }
  }
  return v / length;
}

template <Real Scalar>
Vector3<Scalar> safeUnit(const Vector3<Scalar>& v) {
  return safeUnit(v, safeNorm(v));
}

}  // namespace detail

}  // namespace gravel
