#pragma once

/// \file
/// The container of bodies: a storage, stable ids, and the checks at the door.

#include <gravel/bodies/proxy.hpp>

#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace gravel {

/// One field of all bodies, `column[i]` as in the proxies.
template <class Storage, class F>
class Column {
 public:
  explicit Column(Storage& storage) : storage_(&storage) {}
  std::size_t size() const { return storage_->size(); }
  decltype(auto) operator[](std::size_t i) const { return storage_->at(F{}, i); }

 private:
  Storage* storage_;
};

/// Bodies in the layout `Layout` (SoA, AoS, AoSoA<W>, or a user's own type that meets `BodyStorage`).
template <Real S = double, class Layout = SoA>
class Bodies {
 public:
  using Scalar = S;
  using Storage = StorageOf<Scalar, Layout>;
  static_assert(BodyStorage<Storage>,
                "gravel: the Layout of Bodies must be SoA, AoS, AoSoA<W> or a type that meets "
                "gravel::BodyStorage, see docs/concepts.md");
  static_assert(std::is_same_v<typename Storage::Scalar, Scalar>,
                "gravel: the storage's Scalar must be the Scalar of Bodies, see docs/concepts.md");
  using Proxy = BasicBodyProxy<Storage, false>;
  using ConstProxy = BasicBodyProxy<Storage, true>;

  Bodies() = default;

  /// Adopts a storage with the bodies in it, which get the ids 0, 1, … in their order. A zero orientation or
  /// inertia factor, as new storage has it, becomes the identity and 2/5.
  /// \throws std::invalid_argument if a body's values are out of range
  explicit Bodies(Storage storage) : storage_(std::move(storage)) {
    for (std::size_t i = 0; i < size(); ++i) {
      auto&& factor = storage_.at(fields::InertiaFactor{}, i);
      if (!(factor > Scalar(0))) {
        factor = Scalar(2) / Scalar(5);
      }
      if (!(Quaternion<Scalar>((*this)[i].orientation()).squaredNorm() > Scalar(0))) {
        (*this)[i].orientation() = Quaternion<Scalar>::Identity();
      }
      validate((*this)[i].load(), "body " + std::to_string(nextId_));
      storage_.at(fields::Id{}, i) = nextId_;
      index_[nextId_++] = i;
    }
  }

  std::size_t size() const { return storage_.size(); }
  bool empty() const { return size() == 0; }
  Proxy operator[](std::size_t i) { return {&storage_, i}; }
  ConstProxy operator[](std::size_t i) const { return {&storage_, i}; }
  Storage& storage() { return storage_; }
  const Storage& storage() const { return storage_; }

  /// Counts every change of the set or order of bodies: what was computed from indices is stale when it moves.
  std::uint64_t revision() const { return revision_; }

  void reserve(std::size_t n) {
    if constexpr (requires { storage_.reserve(n); }) {
      storage_.reserve(n);
    }
    index_.reserve(n);
  }

  /// Appends a body. \throws std::invalid_argument if a value is out of range; then nothing is added.
  BodyId add(const Body<Scalar>& body) { return add(body, BodyId{nextId_}); }

  /// As above under a given id. \throws std::invalid_argument also if the id is taken.
  BodyId add(const Body<Scalar>& body, BodyId id) {
    const std::uint64_t key = toInteger(id);
    if (index_.contains(key) || id == noBody) {
      detail::refuse("id of the new body", std::to_string(key),
                     "an id that no other body of this space has, below 2^64 - 1");
    }
    validate(body, "body " + std::to_string(key));
    const std::size_t i = size();
    index_[key] = i;
    storage_.resize(i + 1);
    storage_.at(fields::Id{}, i) = key;
    (*this)[i].store(body);
    nextId_ = key >= nextId_ ? key + 1 : nextId_;
    ++revision_;
    return id;
  }

  /// Removes a body; the last one takes its index. O(1). \throws std::out_of_range for an unknown id
  void remove(BodyId id) {
    const std::size_t i = indexOf(id);
    const std::size_t last = size() - 1;
    if (i != last) {
      detail::copyBody(storage_, i, std::as_const(storage_), last);
      index_[storage_.at(fields::Id{}, i)] = i;
    }
    storage_.resize(last);
    index_.erase(toInteger(id));
    ++revision_;
  }

  std::optional<std::size_t> find(BodyId id) const {
    const auto entry = index_.find(toInteger(id));
    return entry == index_.end() ? std::nullopt : std::optional<std::size_t>(entry->second);
  }

  /// \throws std::out_of_range for an unknown id
  std::size_t indexOf(BodyId id) const {
    if (const auto i = find(id)) {
      return *i;
    }
    throw std::out_of_range("gravel: no body has the id " + std::to_string(toInteger(id)));
  }

  /// The body that stood at order[i] comes to stand at i. Ids keep naming the same bodies.
  /// \throws std::invalid_argument unless `order` is a permutation of 0 … size()-1; then nothing moves
  void reorder(std::span<const std::size_t> order) {
    std::vector<bool> seen(size(), false);
    if (order.size() != size()) {
      detail::refuse("length of the new order", std::to_string(order.size()), std::to_string(size()));
    }
    for (const std::size_t from : order) {
      if (from >= size() || seen[from]) {
        detail::refuse("entry of the new order", std::to_string(from), "each index below n() once");
      }
      seen[from] = true;
    }
    typename SoA::template Storage<Scalar> copy;
    copy.resize(size());
    for (std::size_t i = 0; i < size(); ++i) {
      detail::copyBody(copy, i, std::as_const(storage_), order[i]);
    }
    for (std::size_t i = 0; i < size(); ++i) {
      detail::copyBody(storage_, i, std::as_const(copy), i);
      index_[storage_.at(fields::Id{}, i)] = i;
    }
    ++revision_;
  }

  /// Looks at every body: the guard against values written through proxies or by a user's own code.
  /// \throws std::invalid_argument naming body, field, value and what is allowed
  void validateAll() const {
    for (std::size_t i = 0; i < size(); ++i) {
      const auto body = (*this)[i];
      const Scalar m = body.mass();
      const Scalar r = body.radius();
      const bool good = isFinite(body.position()) && isFinite(body.velocity()) &&
                        isFinite(body.angularVelocity()) && isFinite(m) && isFinite(r) && m >= Scalar(0) &&
                        r >= Scalar(0) && (m > Scalar(0) || r == Scalar(0) || body.isFixed());
      if (!good) {
        validate(body.load(), "body " + std::to_string(toInteger(body.id())));
      }
    }
  }

  auto positions() { return Column<Storage, fields::Position>(storage_); }
  auto positions() const { return Column<const Storage, fields::Position>(storage_); }
  auto velocities() { return Column<Storage, fields::Velocity>(storage_); }
  auto velocities() const { return Column<const Storage, fields::Velocity>(storage_); }
  auto angularVelocities() { return Column<Storage, fields::AngularVelocity>(storage_); }
  auto angularVelocities() const { return Column<const Storage, fields::AngularVelocity>(storage_); }
  auto orientations() { return Column<Storage, fields::Orientation>(storage_); }
  auto orientations() const { return Column<const Storage, fields::Orientation>(storage_); }
  auto forces() { return Column<Storage, fields::Force>(storage_); }
  auto forces() const { return Column<const Storage, fields::Force>(storage_); }
  auto torques() { return Column<Storage, fields::Torque>(storage_); }
  auto torques() const { return Column<const Storage, fields::Torque>(storage_); }
  auto accelerations() { return Column<Storage, fields::Acceleration>(storage_); }
  auto accelerations() const { return Column<const Storage, fields::Acceleration>(storage_); }
  auto angularAccelerations() { return Column<Storage, fields::AngularAcceleration>(storage_); }
  auto angularAccelerations() const { return Column<const Storage, fields::AngularAcceleration>(storage_); }
  auto masses() { return Column<Storage, fields::Mass>(storage_); }
  auto masses() const { return Column<const Storage, fields::Mass>(storage_); }
  auto radii() { return Column<Storage, fields::Radius>(storage_); }
  auto radii() const { return Column<const Storage, fields::Radius>(storage_); }
  auto inertiaFactors() { return Column<Storage, fields::InertiaFactor>(storage_); }
  auto inertiaFactors() const { return Column<const Storage, fields::InertiaFactor>(storage_); }
  auto ids() const { return Column<const Storage, fields::Id>(storage_); }
  auto materials() { return Column<Storage, fields::Material>(storage_); }
  auto materials() const { return Column<const Storage, fields::Material>(storage_); }
  auto flags() { return Column<Storage, fields::Flags>(storage_); }
  auto flags() const { return Column<const Storage, fields::Flags>(storage_); }

 private:
  Storage storage_;
  std::unordered_map<std::uint64_t, std::size_t> index_;
  std::uint64_t nextId_ = 0;
  std::uint64_t revision_ = 0;
};

/// Handles of bodies in a layout; what `Space::body` returns.
template <Real Scalar = double, class Layout = SoA>
using BodyProxy = BasicBodyProxy<StorageOf<Scalar, Layout>, false>;
template <Real Scalar = double, class Layout = SoA>
using ConstBodyProxy = BasicBodyProxy<StorageOf<Scalar, Layout>, true>;

}  // namespace gravel
