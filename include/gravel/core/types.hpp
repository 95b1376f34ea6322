#pragma once

/// \file
/// Scalars, vectors, quaternions and identities: the vocabulary of every other header.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace gravel {

namespace detail {

using std::sqrt;

/// A square root found as Eigen finds it: std::sqrt or one beside the type. Spelled in the signature, so that
/// a type without one fails a concept instead of the compilation.
template <class T>
auto rootOf(const T& x) -> decltype(T(sqrt(x)));

/// For what is beyond a float's range, or digits: sums of momenta, powers of rates, expansions.
template <class S>
using AtLeastDouble = std::conditional_t<std::is_same_v<S, float>, double, S>;

}  // namespace detail

/// A scalar that gravel can compute with: float, double, long double, and any type with the arithmetic,
/// comparisons and `sqrt` of a real number (dual numbers, multiprecision). A type that is not built in
/// takes the plain loops in place of the vector lanes; it also needs `Eigen::NumTraits`.
template <class T>
concept Real = !std::is_integral_v<T> && std::semiregular<T> && std::constructible_from<T, double> &&
               requires(T a, const T b, const T c) {
  { b + c } -> std::convertible_to<T>;
  { b - c } -> std::convertible_to<T>;
  { b* c } -> std::convertible_to<T>;
  { b / c } -> std::convertible_to<T>;
  { -b } -> std::convertible_to<T>;
  {a += b};
  {a -= b};
  {a *= b};
  {a /= b};
  { b < c } -> std::convertible_to<bool>;
  { b <= c } -> std::convertible_to<bool>;
  { b > c } -> std::convertible_to<bool>;
  { b >= c } -> std::convertible_to<bool>;
  { b == c } -> std::convertible_to<bool>;
  typename Eigen::NumTraits<T>::Real;
  detail::rootOf(b);
};

namespace detail {

/// A user's scalar may be more than its value, a derivative say: equal is not the same.
template <Real S>
inline constexpr bool equalIsSame = std::is_floating_point_v<S>;

}  // namespace detail

template <Real Scalar>
using Vector3 = Eigen::Matrix<Scalar, 3, 1>;

template <Real Scalar>
using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

/// Rotation from the body's axes to the axes of space.
template <Real Scalar>
using Quaternion = Eigen::Quaternion<Scalar>;

/// The name of a body for as long as its space lives: never reused, not an index.
enum class BodyId : std::uint64_t {};

inline constexpr BodyId noBody{std::numeric_limits<std::uint64_t>::max()};

constexpr std::uint64_t toInteger(BodyId id) { return static_cast<std::uint64_t>(id); }

/// Circle constant in any scalar.
template <Real Scalar>
inline Scalar pi() {
  if constexpr (std::is_floating_point_v<Scalar>) {
    return static_cast<Scalar>(3.141592653589793238462643383279502884L);
  } else if constexpr (requires(const Scalar one) { Scalar(atan(one)); }) {
    return Scalar(Scalar(4) * Scalar(atan(Scalar(1))));  // in the type's own precision
  } else {
    return Scalar(3.141592653589793);
  }
}

/// True unless x is a NaN or an infinity. For a type that is not built in: x - x is 0 exactly then.
template <Real Scalar>
inline bool isFinite(const Scalar& x) {
  if constexpr (std::is_floating_point_v<Scalar>) {
    return std::isfinite(x);
  } else {
    return (x - x) == Scalar(0);
  }
}

/// True if every coefficient of a vector, a quaternion's coeffs() or an expression is finite.
template <class Derived>
inline bool isFinite(const Eigen::DenseBase<Derived>& v) {
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    if (!isFinite(typename Derived::Scalar(v.derived().coeff(i)))) {
      return false;
    }
  }
  return true;
}

template <class Derived>
inline bool isFinite(const Eigen::QuaternionBase<Derived>& q) {
  return isFinite(q.coeffs());
}

}  // namespace gravel
