#pragma once

/// \file
/// The container of bodies: a storage, stable ids, and the checks at the door.

#include <gravel/bodies/body_iterator.hpp>
#include <gravel/bodies/columns.hpp>
#include <gravel/bodies/places_by_id.hpp>
#include <gravel/bodies/proxy.hpp>
#include <gravel/core/callback.hpp>
#include <gravel/core/parallel.hpp>

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <utility>
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
  /// inertia factor, as new storage has it, becomes the identity and 2/5; fixed bodies are stopped,
  /// orientations normalised, all else stays. \throws std::invalid_argument if a body's values are out of
  /// range; then the storage's memory was not written to
  explicit Bodies(Storage storage) : storage_(std::move(storage)) {
    for (std::size_t i = 0; i < size(); ++i) {
      const std::string who = "body " + std::to_string(i);
      validate(adopted(i), who);
      if (const Scalar k = storage_.at(fields::InertiaFactor{}, i); !(k == Scalar(0))) {
        checkFactor(k, who);
      }
    }
    for (; nextId_ < size(); ++nextId_) {
      const auto i = static_cast<std::size_t>(nextId_);
      const Body<Scalar> body = adopted(i);
      const Proxy proxy = (*this)[i];
      proxy.orientation() = body.orientation.normalized();
      if (Scalar(proxy.inertiaFactor()) == Scalar(0)) {
        proxy.inertiaFactor() = detail::homogeneousFactor<Scalar>();
      }
      proxy.setFixed(body.fixed);
      proxy.setAsleep(false);
      storage_.at(fields::Id{}, i) = nextId_;
    }
  }

  std::size_t size() const { return storage_.size(); }
  bool empty() const { return size() == 0; }
  Proxy operator[](std::size_t i) { return {&storage_, i}; }
  ConstProxy operator[](std::size_t i) const { return {&storage_, i}; }
  auto begin() { return BodyIterator<Proxy>(&storage_, 0); }
  auto end() { return BodyIterator<Proxy>(&storage_, size()); }
  auto begin() const { return BodyIterator<ConstProxy>(&storage_, 0); }
  auto end() const { return BodyIterator<ConstProxy>(&storage_, size()); }
  Storage& storage() { return storage_; }
  const Storage& storage() const { return storage_; }

  /// Counts every change of the set or order of bodies: what was computed from indices is stale when it
  /// moves.
  std::uint64_t revision() const { return revision_; }

  /// Room for n bodies in all, where the storage can make some.
  void reserve(std::size_t n) {
    if constexpr (requires { storage_.reserve(n); }) {
      storage_.reserve(n);
    }
  }

  /// Appends a body. \throws std::invalid_argument if a value is out of range; then nothing is added.
  BodyId add(const Body<Scalar>& body) { return add(body, BodyId{nextId_}); }

  /// As above under a given id: a restart gives each body its own again. Ids chosen by `add(body)` are above
  /// all ids ever given. \throws std::invalid_argument also if the id is taken, and what last(its index) does
  template <class Last = detail::DoNothing>
  BodyId add(const Body<Scalar>& body, BodyId id, const Last& last = {}) {
    const std::uint64_t key = toInteger(id);
    if (find(id) || id == noBody) {
      detail::refuse("id of the new body", std::to_string(key),
                     "an id that no other body of this space has, below 2^64 - 1");
    }
    validate(body, "body " + std::to_string(key));
    const std::size_t i = size();
    storage_.resize(i + 1);
    try {
      storage_.at(fields::Id{}, i) = key;
      (*this)[i].store(body);
      (*this)[i].clearForces();
      places_.put(key, i);
      last(i);
    } catch (...) {
      places_.forget(key);
      storage_.resize(i);
      throw;
    }
    skipIds(BodyId{key + 1});
    ++revision_;
    return id;
  }

  /// The id that the next `add(body)` gives.
  BodyId nextId() const { return BodyId{nextId_}; }

  /// Ids below `first` are not given any more: a restart says so of bodies that were removed before it.
  void skipIds(BodyId first) { nextId_ = std::max(nextId_, toInteger(first)); }

  /// Takes over all bodies of another container, whatever its layout, with their ids, the next id and every
  /// field. The own storage stays the same object: a user's arrays are written to.
  template <class Other>
  void assign(const Bodies<Scalar, Other>& other) {
    detail::PlacesById places(other.size(), [&](std::size_t i) { return toInteger(other[i].id()); });
    storage_.resize(other.size());
    for (std::size_t i = 0; i < size(); ++i) {
      detail::copyBody(storage_, i, other.storage(), i);
    }
    std::swap(places_, places);
    nextId_ = toInteger(other.nextId());
    ++revision_;
  }

  /// Removes a body; the last one takes its index. O(1). \throws std::out_of_range for an unknown id
  void remove(BodyId id) {
    const std::size_t i = indexOf(id);
    const std::size_t last = size() - 1;
    if (i != last) {
      places_.put(storage_.at(fields::Id{}, last), i);  // may throw: nothing has moved yet
      if constexpr (requires { storage_.swap(i, last); }) {
        storage_.swap(i, last);
      } else {
        detail::copyBody(storage_, i, std::as_const(storage_), last);
      }
    }
    storage_.resize(last);
    places_.forget(toInteger(id));
    ++revision_;
  }

  std::optional<std::size_t> find(BodyId id) const {
    return places_.find(toInteger(id), size(), [&](std::size_t i) { return storage_.at(fields::Id{}, i); });
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
    detail::PlacesById places(size(), [&](std::size_t i) { return storage_.at(fields::Id{}, order[i]); });
    detail::permute(storage_, order);
    std::swap(places_, places);
    ++revision_;
  }

  /// Looks at every body: the guard against values written through proxies or by a user's own code.
  /// \throws std::invalid_argument naming body, field, value and what is allowed
  void validateAll() const {
    parallelForChunks<Share::Alike>(size(), 1024, [&](std::size_t begin, std::size_t end) {
      detail::forTilesOrBodies(
          storage_, begin, end, [&](std::size_t i) { validateTile(i, end); },
          [&](std::size_t i) { validateOne(i); });
    });
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
  void validateOne(std::size_t i) const {
    const auto body = (*this)[i];
    const Scalar m = body.mass();
    const Scalar r = body.radius();
    const Scalar k = storage_.at(fields::InertiaFactor{}, i);
    const Scalar q_sq = body.orientation().squaredNorm();
    const bool good = isFinite(body.position()) && isFinite(body.velocity()) &&
                      isFinite(body.angularVelocity()) && isFinite(m) && isFinite(r) && m >= Scalar(0) &&
                      r >= Scalar(0) && (m > Scalar(0) || r == Scalar(0) || body.isFixed()) &&
                      detail::hasSquare(r) && isFinite(q_sq) && q_sq > Scalar(0) && isFinite(k) &&
                      k > Scalar(0);
    if (!good) {
      const std::string who = "body " + std::to_string(toInteger(body.id()));
      validate(loadUnblamed(i), who);
      checkFactor(k, who);
    }
  }

  /// The same for a tile of movable bodies; those from `end` on are none.
  void validateTile(std::size_t i, std::size_t end) const {
    if constexpr (detail::hasColumns<Storage>) {
      using Tile = detail::BodyTile<Scalar>;
      const auto tile = [&](auto field, std::size_t c = 0) {
        return Tile(detail::tileOf(storage_, field, c, i));
      };
      const Tile m = tile(fields::Mass{});
      const Tile r = tile(fields::Radius{});
      const Tile k = tile(fields::InertiaFactor{});
      Tile q_sq = tile(fields::Orientation{}, 3).square();
      const Tile r_sq = r.square();
      Tile size = m + Scalar(16) * r_sq + k;
      for (std::size_t c = 0; c < 3; ++c) {
        size += (tile(fields::Position{}, c).abs() + tile(fields::Velocity{}, c).abs()) +
                tile(fields::AngularVelocity{}, c).abs();
        q_sq += tile(fields::Orientation{}, c).square();
      }
      size += q_sq;  // finite if all is, or huge
      for (std::size_t lane = 0; lane < std::min(detail::tileWidth, end - i); ++lane) {
        const auto at = static_cast<Eigen::Index>(lane);
        if (!(size[at] <= std::numeric_limits<Scalar>::max() && m[at] >= Scalar(0) && r[at] >= Scalar(0) &&
              (r[at] == Scalar(0) || (m[at] > Scalar(0) && r_sq[at] >= std::numeric_limits<Scalar>::min())) &&
              k[at] > Scalar(0) && q_sq[at] > Scalar(0))) {
          validateOne(i + lane);
        }
      }
    }
  }

  static void checkFactor(const Scalar& k, const std::string& who) {
    if (!isFinite(k) || !(k > Scalar(0))) {
      detail::refuse("inertiaFactor of " + who, detail::formatReal(k), "finite, > 0");
    }
  }

  /// Body i without an inertia: the factor is looked at by itself, and may be right where the inertia of a
  /// giant planet is no float.
  Body<Scalar> loadUnblamed(std::size_t i) const {
    Body<Scalar> body = (*this)[i].load();
    body.inertia.reset();
    return body;
  }

  /// Body i of a storage that was handed in, zeros of new storage filled in.
  Body<Scalar> adopted(std::size_t i) const {
    Body<Scalar> body = loadUnblamed(i);
    if (body.orientation.coeffs() ==
        Quaternion<Scalar>(Scalar(0), Scalar(0), Scalar(0), Scalar(0)).coeffs()) {
      body.orientation = Quaternion<Scalar>::Identity();
    }
    return body;
  }

  Storage storage_;
  detail::PlacesById places_;
  std::uint64_t nextId_ = 0;
  std::uint64_t revision_ = 0;
};

/// Handles of bodies in a layout; what `Space::body` returns.
template <Real Scalar = double, class Layout = SoA>
using BodyProxy = BasicBodyProxy<StorageOf<Scalar, Layout>, false>;
template <Real Scalar = double, class Layout = SoA>
using ConstBodyProxy = BasicBodyProxy<StorageOf<Scalar, Layout>, true>;

}  // namespace gravel
