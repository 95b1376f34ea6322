#pragma once

/// Types that have what a concept asks for and nothing more: a template that needs more does not compile with
/// them. Also two storages as users write them, over arrays that are not gravel's.

#include <gravel/bodies/storage.hpp>

#include <memory>
#include <vector>

namespace gravel::test {

/// The least that is a `Real`: no implicit conversion, no stream, no numeric_limits, no other function than
/// sqrt. Its range is that of a `Stored`.
template <class Stored>
class MinimalRealOf {
 public:
  MinimalRealOf() = default;
  explicit MinimalRealOf(double value) : value_(static_cast<Stored>(value)) {}

  friend MinimalRealOf operator+(const MinimalRealOf& a, const MinimalRealOf& b) {
    return MinimalRealOf(a.value_ + b.value_);
  }
  friend MinimalRealOf operator-(const MinimalRealOf& a, const MinimalRealOf& b) {
    return MinimalRealOf(a.value_ - b.value_);
  }
  friend MinimalRealOf operator*(const MinimalRealOf& a, const MinimalRealOf& b) {
    return MinimalRealOf(a.value_ * b.value_);
  }
  friend MinimalRealOf operator/(const MinimalRealOf& a, const MinimalRealOf& b) {
    return MinimalRealOf(a.value_ / b.value_);
  }
  friend MinimalRealOf operator-(const MinimalRealOf& a) { return MinimalRealOf(-a.value_); }
  MinimalRealOf& operator+=(const MinimalRealOf& b) { return *this = *this + b; }
  MinimalRealOf& operator-=(const MinimalRealOf& b) { return *this = *this - b; }
  MinimalRealOf& operator*=(const MinimalRealOf& b) { return *this = *this * b; }
  MinimalRealOf& operator/=(const MinimalRealOf& b) { return *this = *this / b; }
  friend bool operator<(const MinimalRealOf& a, const MinimalRealOf& b) { return a.value_ < b.value_; }
  friend bool operator<=(const MinimalRealOf& a, const MinimalRealOf& b) { return a.value_ <= b.value_; }
  friend bool operator>(const MinimalRealOf& a, const MinimalRealOf& b) { return a.value_ > b.value_; }
  friend bool operator>=(const MinimalRealOf& a, const MinimalRealOf& b) { return a.value_ >= b.value_; }
  friend bool operator==(const MinimalRealOf& a, const MinimalRealOf& b) { return a.value_ == b.value_; }
  friend MinimalRealOf sqrt(const MinimalRealOf& a) { return MinimalRealOf(std::sqrt(a.value_)); }

  /// For tests alone; the name is no hook of gravel.
  double inTest() const { return static_cast<double>(value_); }

 private:
  Stored value_ = Stored(0);
};

using MinimalReal = MinimalRealOf<double>;

/// The least that is a `BodyStorage`: no reserve, no swap, default construction left out.
template <class S>
class MinimalStorage {
 public:
  using Scalar = S;

  struct None {};
  explicit MinimalStorage(None) {}

  std::size_t size() const { return all_.size(); }
  void resize(std::size_t n) { all_.resize(n); }

  template <class F>
  auto& at(F, std::size_t i) {
    return static_cast<Slot<F>&>(all_[i]).value;
  }
  template <class F>
  const auto& at(F, std::size_t i) const {
    return static_cast<const Slot<F>&>(all_[i]).value;
  }

 private:
  template <class F>
  struct ValueOf;
  template <RealField F>
    requires(F::width == 1)
  struct ValueOf<F> {
    using type = S;
  };
  template <RealField F>
    requires(F::width == 3)
  struct ValueOf<F> {
    using type = Vector3<S>;
  };
  template <RealField F>
    requires(F::width == 4)
  struct ValueOf<F> {
    using type = Quaternion<S>;
  };
  template <IntegerField F>
  struct ValueOf<F> {
    using type = typename F::Integer;
  };

  template <class F>
  struct Slot {
    typename ValueOf<F>::type value{};
  };
  template <class Reals, class Integers>
  struct All;
  template <class... R, class... I>
  struct All<FieldList<R...>, IntegerFieldList<I...>> : Slot<R>..., Slot<I>... {};

  std::vector<All<RealFields, IntegerFields>> all_;
};

/// A particle of somebody else's program: plain arrays, an order of its own, and a member gravel knows
/// nothing of.
template <class S>
struct Particle {
  std::uint64_t name = 0;
  S x[3] = {};
  S v[3] = {};
  S m = S(0);
  S size = S(0);
  int species = 0;
  S q[4] = {};
  S spin[3] = {};
  S f[3] = {};
  S tq[3] = {};
  S a[3] = {};
  S alpha[3] = {};
  S k = S(0);
  std::uint32_t matter = 0;
  std::uint32_t bits = 0;
};

/// A number that can be read and assigned, and nothing else.
template <class T>
class AssignedNumber {
 public:
  explicit AssignedNumber(T& number) : number_(&number) {}
  operator T() const { return *number_; }
  AssignedNumber& operator=(const T& number) {
    *number_ = number;
    return *this;
  }

 private:
  T* number_;
};

/// That program's particles as bodies, in place. `swap` moves the member that is not a field along.
template <class S>
class ParticleStorage {
 public:
  using Scalar = S;

  explicit ParticleStorage(std::vector<Particle<S>>& particles) : particles_(&particles) {}

  std::size_t size() const { return particles_->size(); }
  void resize(std::size_t n) { particles_->resize(n); }
  void reserve(std::size_t n) { particles_->reserve(n); }
  void swap(std::size_t i, std::size_t j) { std::swap((*particles_)[i], (*particles_)[j]); }

  template <class F>
  decltype(auto) at(F field, std::size_t i) {
    return access(field, (*particles_)[i]);
  }
  template <class F>
  decltype(auto) at(F field, std::size_t i) const {
    return access(field, static_cast<const Particle<S>&>((*particles_)[i]));
  }

 private:
  static auto vector(S* p) { return Eigen::Map<Vector3<S>>(p); }
  static auto vector(const S* p) { return Eigen::Map<const Vector3<S>>(p); }
  static auto quaternion(S* p) { return Eigen::Map<Quaternion<S>>(p); }
  static auto quaternion(const S* p) { return Eigen::Map<const Quaternion<S>>(p); }

  template <class T>
  static AssignedNumber<T> number(T& x) {
    return AssignedNumber<T>(x);
  }
  template <class T>
  static T number(const T& x) {
    return x;
  }

  template <class F, class P>
  static decltype(auto) access(F, P& p) {
    if constexpr (std::is_same_v<F, fields::Position>) {
      return vector(p.x);
    } else if constexpr (std::is_same_v<F, fields::Velocity>) {
      return vector(p.v);
    } else if constexpr (std::is_same_v<F, fields::AngularVelocity>) {
      return vector(p.spin);
    } else if constexpr (std::is_same_v<F, fields::Orientation>) {
      return quaternion(p.q);
    } else if constexpr (std::is_same_v<F, fields::Force>) {
      return vector(p.f);
    } else if constexpr (std::is_same_v<F, fields::Torque>) {
      return vector(p.tq);
    } else if constexpr (std::is_same_v<F, fields::Acceleration>) {
      return vector(p.a);
    } else if constexpr (std::is_same_v<F, fields::AngularAcceleration>) {
      return vector(p.alpha);
    } else if constexpr (std::is_same_v<F, fields::Mass>) {
      return (p.m);
    } else if constexpr (std::is_same_v<F, fields::Radius>) {
      return (p.size);
    } else if constexpr (std::is_same_v<F, fields::InertiaFactor>) {
      return (p.k);
    } else if constexpr (std::is_same_v<F, fields::Id>) {
      return number(p.name);
    } else if constexpr (std::is_same_v<F, fields::Material>) {
      return number(p.matter);
    } else {
      static_assert(std::is_same_v<F, fields::Flags>);
      return number(p.bits);
    }
  }

  std::vector<Particle<S>>* particles_;
};

/// The other way to bind arrays: a storage of gravel's, with `at` overloaded for what stands elsewhere.
template <class S>
class BoundStorage : public StorageOf<S, AoSoA<8>> {
  using Base = StorageOf<S, AoSoA<8>>;

 public:
  explicit BoundStorage(std::vector<Vector3<S>>& positions) : positions_(&positions) {
    Base::resize(positions.size());
  }

  using Base::at;
  Vector3<S>& at(fields::Position, std::size_t i) { return (*positions_)[i]; }
  const Vector3<S>& at(fields::Position, std::size_t i) const { return (*positions_)[i]; }

  void resize(std::size_t n) {
    Base::reserve(n);
    positions_->resize(n, Vector3<S>::Zero());
    Base::resize(n);
  }

 private:
  std::vector<Vector3<S>>* positions_;
};

}  // namespace gravel::test

template <class Stored>
struct Eigen::NumTraits<gravel::test::MinimalRealOf<Stored>>
    : Eigen::GenericNumTraits<gravel::test::MinimalRealOf<Stored>> {
  using Real = gravel::test::MinimalRealOf<Stored>;
  using NonInteger = gravel::test::MinimalRealOf<Stored>;
  using Literal = gravel::test::MinimalRealOf<Stored>;
  using Nested = gravel::test::MinimalRealOf<Stored>;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
};
