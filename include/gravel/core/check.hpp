#pragma once

/// \file
/// One voice for errors: what is wrong, which value it has, what is allowed.

#include <gravel/core/types.hpp>

#include <charconv>
#include <stdexcept>
#include <string>

namespace gravel::detail {

/// The shortest decimal form that reads back as x: a value just out of range does not look like the limit.
template <Real Scalar>
inline std::string formatReal(const Scalar& x) {
  if constexpr (std::is_floating_point_v<Scalar>) {
    char text[64];
    return {text, std::to_chars(text, text + sizeof text, x).ptr};
  } else if constexpr (requires { static_cast<double>(x); }) {
    return formatReal(static_cast<double>(x));
  } else if constexpr (requires { static_cast<double>(x.value()); }) {
    return formatReal(static_cast<double>(x.value()));
  } else {
    return "(a value of a user's own scalar type)";
  }
}

template <class Derived>
inline std::string formatVector(const Eigen::DenseBase<Derived>& v) {
  std::string text = "(";
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    text += (i == 0 ? "" : ", ") + formatReal(typename Derived::Scalar(v.derived().coeff(i)));
  }
  return text + ")";
}

/// "gravel: <subject> is <value>; allowed: <range>"
inline std::string faultText(const std::string& subject, const std::string& value,
                             const std::string& allowed) {
  return "gravel: " + subject + " is " + value + "; allowed: " + allowed;
}

[[noreturn]] inline void refuse(const std::string& subject, const std::string& value,
                                const std::string& allowed) {
  throw std::invalid_argument(faultText(subject, value, allowed));
}

/// A closed range of a setting; what is not finite is never in it, so an infinite end is an open one.
template <Real Scalar>
struct Range {
  Scalar low;
  Scalar high;
  const char* text;  ///< as it stands in messages, for example "finite, >= 0"

  bool contains(const Scalar& x) const { return isFinite(x) && x >= low && x <= high; }
  /// The text of a message about x, which may be above zero and yet too small.
  std::string allowed(const Scalar& x) const {
    return x > Scalar(0) && x < low ? text + (", at least " + formatReal(low)) : std::string(text);
  }
};

template <Real Scalar>
inline Range<Scalar> anyFinite() {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  return {Scalar(-infinity), Scalar(infinity), "finite"};
}

template <Real Scalar>
inline Range<Scalar> nonNegative() {
  return {Scalar(0), anyFinite<Scalar>().high, "finite, >= 0"};
}

/// The smallest number that counts as positive: the smallest normal one, or of a user's own scalar the first
/// of 1e-300, its root, the root of that, … that it holds.
template <Real Scalar>
inline Scalar leastPositive() {
  if constexpr (std::is_floating_point_v<Scalar>) {
    return std::numeric_limits<Scalar>::min();
  } else {
    double least = 1e-300;
    while (!(Scalar(least) > Scalar(0))) {
      least = std::sqrt(least);
    }
    return Scalar(least);
  }
}

template <Real Scalar>
inline Range<Scalar> positive() {
  return {leastPositive<Scalar>(), anyFinite<Scalar>().high, "finite, > 0"};
}

template <Real Scalar>
inline Range<Scalar> unitInterval() {
  return {Scalar(0), Scalar(1), "0 to 1"};
}

/// \throws std::invalid_argument unless the range contains x
template <Real Scalar>
inline void require(const char* subject, const Scalar& x, const Range<Scalar>& range) {
  if (!range.contains(x)) {
    refuse(subject, formatReal(x), range.allowed(x));
  }
}

}  // namespace gravel::detail
