#pragma once

/// \file
/// What a field of one body looks like from outside: views that read and write in place, wherever the
/// layout keeps the coefficients. Consecutive coefficients stand `stride` Scalars apart.

#include <gravel/core/types.hpp>

namespace gravel {

using ViewStride = Eigen::InnerStride<Eigen::Dynamic>;

/// Three coefficients in place; behaves as a Vector3 in every Eigen expression. `ConstVectorView` reads only.
template <Real Scalar>
using VectorView = Eigen::Map<Vector3<Scalar>, Eigen::Unaligned, ViewStride>;

template <Real Scalar>
using ConstVectorView = Eigen::Map<const Vector3<Scalar>, Eigen::Unaligned, ViewStride>;

template <Real Scalar, bool IsConst>
class BasicQuaternionView;

/// A quaternion in place; behaves as an Eigen quaternion. Eigen's own Map needs adjacent coefficients.
template <Real Scalar>
using QuaternionView = BasicQuaternionView<Scalar, false>;

template <Real Scalar>
using ConstQuaternionView = BasicQuaternionView<Scalar, true>;

}  // namespace gravel

/// Eigen's own extension point for quaternion-like types, as for its Map<Quaternion>.
template <class S, bool IsConst>
struct Eigen::internal::traits<gravel::BasicQuaternionView<S, IsConst>>
    : Eigen::internal::traits<Eigen::Quaternion<S>> {
  using Scalar = S;
  using Coefficients =
      Eigen::Map<std::conditional_t<IsConst, const Eigen::Matrix<S, 4, 1>, Eigen::Matrix<S, 4, 1>>,
                 Eigen::Unaligned, gravel::ViewStride>;
  enum { Alignment = 0, Flags = IsConst ? 0 : Eigen::LvalueBit };
};

/// Eigen's packed products and conjugates of quaternions read four adjacent coefficients, whatever the map
/// says. Products with a view take its general ones instead; no architecture has the number -1.
namespace Eigen::internal {

template <class T>
inline constexpr bool isGravelView = false;
template <class S, bool IsConst>
inline constexpr bool isGravelView<gravel::BasicQuaternionView<S, IsConst>> = true;

template <class A, class B>
  requires(isGravelView<A> || isGravelView<B>)
struct quat_product<Architecture::Target, A, B, float> : quat_product<-1, A, B, float> {};
template <class A, class B>
  requires(isGravelView<A> || isGravelView<B>)
struct quat_product<Architecture::Target, A, B, double> : quat_product<-1, A, B, double> {};
template <class A>
  requires(isGravelView<A>)
struct quat_conj<Architecture::Target, A, float> : quat_conj<-1, A, float> {};
template <class A>
  requires(isGravelView<A>)
struct quat_conj<Architecture::Target, A, double> : quat_conj<-1, A, double> {};

}  // namespace Eigen::internal

namespace gravel {

template <Real S, bool IsConst>
class BasicQuaternionView : public Eigen::QuaternionBase<BasicQuaternionView<S, IsConst>> {
  using Base = Eigen::QuaternionBase<BasicQuaternionView<S, IsConst>>;

 public:
  using Scalar = S;
  using Coefficients = typename Eigen::internal::traits<BasicQuaternionView>::Coefficients;
  using Pointer = std::conditional_t<IsConst, const S*, S*>;
  using Base::operator*=;

  BasicQuaternionView(Pointer first, Eigen::Index stride) : coeffs_(first, ViewStride(stride)) {}
  BasicQuaternionView(const BasicQuaternionView&) = default;

  template <class Derived>
  BasicQuaternionView& operator=(const Eigen::QuaternionBase<Derived>& other) requires(!IsConst) {
    coeffs_ = other.coeffs();
    return *this;
  }
  BasicQuaternionView& operator=(const BasicQuaternionView& other) requires(!IsConst) {
    coeffs_ = other.coeffs();
    return *this;
  }

  Coefficients& coeffs() { return coeffs_; }
  const Coefficients& coeffs() const { return coeffs_; }

 private:
  Coefficients coeffs_;
};

}  // namespace gravel
