#pragma once

/// \file
/// Where bodies live. Three layouts from one list of fields: they differ only in where column c of body i
/// stands. A user's own arrays take part by meeting `BodyStorage`.

#include <gravel/bodies/fields.hpp>
#include <gravel/bodies/views.hpp>

#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace gravel {

namespace detail {

/// Column c of body i stands at c * capacity + i. The capacity is an odd multiple of 16: a power of two would
/// put all columns of a body into the same few sets of a cache.
struct SoAMapping {
  static std::size_t roundUp(std::size_t n) { return ((n + 15) / 16 | 1U) * 16; }
  static std::size_t offset(std::size_t column, std::size_t i, std::size_t capacity) {
    return column * capacity + i;
  }
  static std::size_t stride(std::size_t capacity) { return capacity; }
};

/// Column c of body i stands at i * columns + c.
struct AoSMapping {
  static std::size_t roundUp(std::size_t n) { return n; }
  static std::size_t offset(std::size_t column, std::size_t i, std::size_t) {
    return i * static_cast<std::size_t>(RealFields::columns) + column;
  }
  static std::size_t stride(std::size_t) { return 1; }
};

/// Blocks of W bodies; within a block, columns of W.
template <int W>
struct AoSoAMapping {
  static_assert(W > 0 && (W & (W - 1)) == 0, "gravel: AoSoA<W> needs a power of two, see docs/concepts.md");
  static constexpr std::size_t width = W;
  static std::size_t roundUp(std::size_t n) { return (n + width - 1) / width * width; }
  static std::size_t offset(std::size_t column, std::size_t i, std::size_t) {
    return (i / width) * static_cast<std::size_t>(RealFields::columns) * width + column * width + i % width;
  }
  static std::size_t stride(std::size_t) { return width; }
};

template <class Integers>
struct IntegerColumns;
template <class... Fields>
struct IntegerColumns<IntegerFieldList<Fields...>> {
  template <class F>
  struct Column {
    std::vector<typename F::Integer> values;
  };
  using Tuple = std::tuple<Column<Fields>...>;
};

}  // namespace detail

/// Bodies in one block of Scalars, arranged by `Mapping`; integer fields stand in columns of their own.
template <Real S, class Mapping>
class ColumnStorage {
 public:
  using Scalar = S;

  ColumnStorage() = default;
  ColumnStorage(const ColumnStorage&) = default;
  ColumnStorage& operator=(const ColumnStorage&) = default;
  ~ColumnStorage() = default;
  /// The other one is left empty.
  ColumnStorage(ColumnStorage&& other) noexcept { *this = std::move(other); }
  ColumnStorage& operator=(ColumnStorage&& other) noexcept {
    reals_ = std::move(other.reals_);
    integers_ = std::move(other.integers_);
    size_ = std::exchange(other.size_, 0);
    capacity_ = std::exchange(other.capacity_, 0);
    return *this;
  }

  std::size_t size() const { return size_; }

  /// Keeps the first min(n, size()) bodies; new ones are all zero. Moves bodies in memory.
  void resize(std::size_t n) {
    if (n > capacity_) {
      grow(n > 2 * capacity_ ? n : 2 * capacity_);
    }
    for (std::size_t i = size_; i < n; ++i) {
      for (std::size_t c = 0; c < columns; ++c) {
        reals_[Mapping::offset(c, i, capacity_)] = S(0);
      }
    }
    IntegerFields::forEach([&]<class F>(F) { integers<F>().resize(n, typename F::Integer(0)); });
    size_ = n;
  }

  void reserve(std::size_t n) {
    if (n > capacity_) {
      grow(n);
    }
    IntegerFields::forEach([&]<class F>(F) { integers<F>().reserve(n); });
  }

  /// Field F of body i: `S&` for width 1, else a view that writes through.
  template <RealField F>
  decltype(auto) at(F, std::size_t i) {
    return view<F>(reals_.data() + first<F>(i));
  }
  template <RealField F>
  decltype(auto) at(F, std::size_t i) const {
    return view<F>(reals_.data() + first<F>(i));
  }
  template <IntegerField F>
  typename F::Integer& at(F, std::size_t i) {
    return integers<F>()[i];
  }
  template <IntegerField F>
  const typename F::Integer& at(F, std::size_t i) const {
    return integers<F>()[i];
  }

 private:
  static constexpr std::size_t columns = static_cast<std::size_t>(RealFields::columns);

  template <class F>
  std::size_t first(std::size_t i) const {
    return Mapping::offset(static_cast<std::size_t>(RealFields::firstColumn<F>()), i, capacity_);
  }

  template <class F, class Value>
  decltype(auto) view(Value* first) const {
    constexpr bool isConst = std::is_const_v<Value>;
    const auto stride = static_cast<Eigen::Index>(Mapping::stride(capacity_));
    if constexpr (F::width == 1) {
      return static_cast<Value&>(*first);
    } else if constexpr (F::width == 3) {
      return std::conditional_t<isConst, ConstVectorView<S>, VectorView<S>>(first, ViewStride(stride));
    } else {
      return BasicQuaternionView<S, isConst>(first, stride);
    }
  }

  template <class F>
  auto& integers() {
    return std::get<typename IntegerTable::template Column<F>>(integers_).values;
  }
  template <class F>
  const auto& integers() const {
    return std::get<typename IntegerTable::template Column<F>>(integers_).values;
  }

  void grow(std::size_t n) {
    const std::size_t capacity = Mapping::roundUp(n);
    std::vector<S> next(capacity * columns, S(0));
    for (std::size_t c = 0; c < columns; ++c) {
      for (std::size_t i = 0; i < size_; ++i) {
        next[Mapping::offset(c, i, capacity)] = reals_[Mapping::offset(c, i, capacity_)];
      }
    }
    reals_ = std::move(next);
    capacity_ = capacity;
  }

  using IntegerTable = detail::IntegerColumns<IntegerFields>;
  std::vector<S> reals_;
  typename IntegerTable::Tuple integers_;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

/// Structure of arrays: each coefficient of each field in an array of its own.
struct SoA {
  template <Real Scalar>
  using Storage = ColumnStorage<Scalar, detail::SoAMapping>;
};

/// Array of structures: all of a body in one run.
struct AoS {
  template <Real Scalar>
  using Storage = ColumnStorage<Scalar, detail::AoSMapping>;
};

/// Array of structures of arrays: blocks of W bodies, columns within a block. W is a power of two.
template <int W = 8>
struct AoSoA {
  template <Real Scalar>
  using Storage = ColumnStorage<Scalar, detail::AoSoAMapping<W>>;
};

namespace detail {

/// What stands for a vector in place: an expression of Eigen's with these scalars.
template <class X, class S>
concept VectorInPlace = requires(X x) {
  { x.squaredNorm() } -> std::same_as<S>;
  x += Vector3<S>();
};

}  // namespace detail

/// A storage of bodies: `size()`, `resize(n)` and `at(field, i)` for every field of `RealFields` and
/// `IntegerFields`; `reserve(n)` and `swap(i, j)` are used where they exist. Without `swap`, bodies are moved
/// field by field, and whatever else a storage keeps of a body stays behind. To bind another simulator's
/// arrays without a copy, derive from one of the storages above and overload `at` for the fields that those
/// arrays hold (docs/concepts.md, "Your own storage").
template <class T>
concept BodyStorage = Real<typename T::Scalar> && std::movable<T> && requires(T s, const T c, std::size_t i) {
  { c.size() } -> std::convertible_to<std::size_t>;
  s.resize(i);
  Vector3<typename T::Scalar>(c.at(fields::Position{}, i));
  Vector3<typename T::Scalar>(c.at(fields::Velocity{}, i));
  Vector3<typename T::Scalar>(c.at(fields::AngularVelocity{}, i));
  Quaternion<typename T::Scalar>(c.at(fields::Orientation{}, i));
  Vector3<typename T::Scalar>(c.at(fields::Force{}, i));
  Vector3<typename T::Scalar>(c.at(fields::Torque{}, i));
  Vector3<typename T::Scalar>(c.at(fields::Acceleration{}, i));
  Vector3<typename T::Scalar>(c.at(fields::AngularAcceleration{}, i));
  { c.at(fields::Mass{}, i) } -> std::convertible_to<typename T::Scalar>;
  { c.at(fields::Radius{}, i) } -> std::convertible_to<typename T::Scalar>;
  { c.at(fields::InertiaFactor{}, i) } -> std::convertible_to<typename T::Scalar>;
  { c.at(fields::Id{}, i) } -> std::convertible_to<std::uint64_t>;
  { c.at(fields::Material{}, i) } -> std::convertible_to<std::uint32_t>;
  { c.at(fields::Flags{}, i) } -> std::convertible_to<std::uint32_t>;
  requires detail::VectorInPlace<decltype(s.at(fields::Position{}, i)), typename T::Scalar>;
  requires detail::VectorInPlace<decltype(s.at(fields::Velocity{}, i)), typename T::Scalar>;
  requires detail::VectorInPlace<decltype(s.at(fields::AngularVelocity{}, i)), typename T::Scalar>;
  requires detail::VectorInPlace<decltype(s.at(fields::Force{}, i)), typename T::Scalar>;
  requires detail::VectorInPlace<decltype(s.at(fields::Torque{}, i)), typename T::Scalar>;
  requires detail::VectorInPlace<decltype(s.at(fields::Acceleration{}, i)), typename T::Scalar>;
  requires detail::VectorInPlace<decltype(s.at(fields::AngularAcceleration{}, i)), typename T::Scalar>;
  s.at(fields::Position{}, i) = Vector3<typename T::Scalar>();
  s.at(fields::Velocity{}, i) = Vector3<typename T::Scalar>();
  s.at(fields::AngularVelocity{}, i) = Vector3<typename T::Scalar>();
  s.at(fields::Orientation{}, i) = Quaternion<typename T::Scalar>();
  s.at(fields::Force{}, i) = Vector3<typename T::Scalar>();
  s.at(fields::Torque{}, i) = Vector3<typename T::Scalar>();
  s.at(fields::Acceleration{}, i) = Vector3<typename T::Scalar>();
  s.at(fields::AngularAcceleration{}, i) = Vector3<typename T::Scalar>();
  s.at(fields::Mass{}, i) = typename T::Scalar(1);
  s.at(fields::Radius{}, i) = typename T::Scalar(1);
  s.at(fields::InertiaFactor{}, i) = typename T::Scalar(1);
  s.at(fields::Id{}, i) = std::uint64_t{0};
  s.at(fields::Material{}, i) = std::uint32_t{0};
  s.at(fields::Flags{}, i) = std::uint32_t{0};
};

namespace detail {

template <class Scalar, class Layout>
struct StorageFor {
  using type = Layout;  // a user's own storage names itself
};
template <class Scalar, class Layout>
  requires requires { typename Layout::template Storage<Scalar>; }
struct StorageFor<Scalar, Layout> {
  using type = typename Layout::template Storage<Scalar>;
};

/// Body `from` of one storage, all fields, over body `to` of another or the same.
template <class To, class From>
void copyBody(To& to, std::size_t toIndex, const From& from, std::size_t fromIndex) {
  forEachField([&]<class F>(F field) {
    auto&& target = to.at(field, toIndex);
    target = from.at(field, fromIndex);
  });
}

/// Puts body order[i] at i, for all i at once. Memory is allocated before anything moves.
template <class Storage>
void permute(Storage& storage, std::span<const std::size_t> order) {
  if constexpr (requires(std::size_t i) { storage.swap(i, i); }) {
    std::vector<std::size_t> at(order.begin(), order.end());  // at[i]: where the body for i stands
    for (std::size_t start = 0; start < at.size(); ++start) {
      std::size_t i = start;
      while (at[i] != start) {
        const std::size_t next = std::exchange(at[i], i);
        storage.swap(i, next);
        i = next;
      }
      at[i] = i;
    }
  } else {
    typename SoA::template Storage<typename Storage::Scalar> copy;
    copy.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      copyBody(copy, i, std::as_const(storage), order[i]);
    }
    for (std::size_t i = 0; i < order.size(); ++i) {
      copyBody(storage, i, std::as_const(copy), i);
    }
  }
}

}  // namespace detail

/// The storage that `Layout` stands for: a built-in layout's, or the user's own type itself.
template <class Scalar, class Layout>
using StorageOf = typename detail::StorageFor<Scalar, Layout>::type;

}  // namespace gravel
