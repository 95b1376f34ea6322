#pragma once

/// \file
/// One voice for errors: what is wrong, which value it has, what is allowed.

#include <gravel/core/types.hpp>

#include <cstdio>
#include <stdexcept>
#include <string>

namespace gravel::detail {

/// The shortest decimal form that still tells two doubles apart in a message.
template <Real Scalar>
inline std::string formatReal(const Scalar& x) {
  if constexpr (std::is_floating_point_v<Scalar>) {
    char text[64];
    std::snprintf(text, sizeof text, "%.9Lg", static_cast<long double>(x));
    return text;
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
inline std::string faultText(const std::string& subject, const std::string& value, const std::string& allowed) {
  return "gravel: " + subject + " is " + value + "; allowed: " + allowed;
}

[[noreturn]] inline void refuse(const std::string& subject, const std::string& value,
                                const std::string& allowed) {
  throw std::invalid_argument(faultText(subject, value, allowed));
}

/// A closed range of a setting; `unbounded` ends stand for "any finite number".
template <Real Scalar>
struct Range {
  Scalar low;
  Scalar high;
  const char* text;  ///< as it stands in messages, for example "finite, >= 0"

  bool contains(const Scalar& x) const { return isFinite(x) && x >= low && x <= high; }
};

template <Real Scalar>
inline Range<Scalar> anyFinite() {
  return {Scalar(std::numeric_limits<double>::lowest()), Scalar(std::numeric_limits<double>::max()), "finite"};
}
template <>
inline Range<float> anyFinite<float>() {
  return {std::numeric_limits<float>::lowest(), std::numeric_limits<float>::max(), "finite"};
}
template <>
inline Range<long double> anyFinite<long double>() {
  return {std::numeric_limits<long double>::lowest(), std::numeric_limits<long double>::max(), "finite"};
}

template <Real Scalar>
inline Range<Scalar> nonNegative() {
  return {Scalar(0), anyFinite<Scalar>().high, "finite, >= 0"};
}

template <Real Scalar>
inline Range<Scalar> unitInterval() {
  return {Scalar(0), Scalar(1), "0 to 1"};
}

/// \throws std::invalid_argument unless the range contains x
template <Real Scalar>
inline void require(const char* subject, const Scalar& x, const Range<Scalar>& range) {
  if (!range.contains(x)) {
    refuse(subject, formatReal(x), range.text);
  }
}

}  // namespace gravel::detail
