#pragma once

/// \file
/// What a snapshot holds of islands that sleep.

#include <gravel/output/snapshot.hpp>
#include <gravel/space/sleeping_island.hpp>

namespace gravel {

namespace detail {

/// Numbers in one order for writing and reading.
template <Real Scalar>
struct IslandRecord {
  std::vector<std::uint64_t> names;
  std::vector<Scalar> numbers;
  std::vector<Material<Scalar>> materials;

  void put(const Vector3<Scalar>& v) { numbers.insert(numbers.end(), {v[0], v[1], v[2]}); }
  void put(const RestingBody<Scalar>& b) {
    names.insert(names.end(), {b.id, b.material});
    put(b.position);
    put(b.acceleration);
    put(b.angularAcceleration);
    numbers.insert(numbers.end(), {b.mass, b.radius});
  }
  void put(const std::vector<RestingBody<Scalar>>& bodies) {
    names.push_back(bodies.size());
    for (const RestingBody<Scalar>& b : bodies) {
      put(b);
    }
  }
  void put(const ContactImpulse<Scalar>& j) {
    numbers.push_back(j.normal);
    put(j.tangential);
    put(j.turning);
  }
  void put(const SleepingIsland<Scalar>& island) {
    names.insert(names.end(), {static_cast<std::uint64_t>(island.state), island.members.size(),
                               island.supports.size(), island.contacts.size(), island.memory.size()});
    numbers.insert(numbers.end(), {island.span, island.solved, island.fall});
    for (const RestingBody<Scalar>& b : island.members) {
      put(b);
    }
    for (const RestingBody<Scalar>& b : island.supports) {
      put(b);
    }
    for (std::size_t k = 0; k < island.contacts.size(); ++k) {
      const Contact<Scalar>& c = island.contacts[k];
      names.insert(names.end(), {c.first, c.second, c.key1, c.key2});
      put(c.normal);
      numbers.insert(numbers.end(), {c.gap, c.arm1, c.arm2});
      put(island.contacts.drift(c));
      put(island.impulses[k]);
      materials.push_back(island.contacts.material(c));
    }
    for (const StoredImpulse<Scalar>& m : island.memory) {
      names.insert(names.end(), {m.key1, m.key2});
      put(m.impulse);
    }
  }

  void save(SnapshotWriter& out) const {
    out.array("names of sleepers", names.data(), names.size());
    out.array("sleepers", numbers.data(), numbers.size());
    out.array("materials of sleepers", materials.data(), materials.size());
  }
};

/// Takes out again what an IslandRecord put in.
template <Real Scalar>
class IslandReader {
 public:
  explicit IslandReader(SnapshotReader& in)
      : in_(in),
        names_(in.array<std::uint64_t>("names of sleepers")),
        numbers_(in.finite<Scalar>("sleepers")),
        materials_(in.array<Material<Scalar>>("materials of sleepers")) {}

  bool done() const { return name_ == names_.size(); }

  std::vector<RestingBody<Scalar>> bodies() {
    std::vector<RestingBody<Scalar>> all;
    for (std::uint64_t count = name(); count > 0; --count) {
      all.push_back(body());
    }
    return all;
  }

  SleepingIsland<Scalar> island() {
    SleepingIsland<Scalar> island;
    island.state = static_cast<IslandState>(name());
    const std::uint64_t members = name();
    const std::uint64_t supports = name();
    const std::uint64_t contacts = name();
    const std::uint64_t memory = name();
    island.span = number();
    island.solved = number();
    island.fall = number();
    for (std::uint64_t k = 0; k < members; ++k) {
      island.members.push_back(body());
    }
    for (std::uint64_t k = 0; k < supports; ++k) {
      island.supports.push_back(body());
    }
    for (std::uint64_t k = 0; k < contacts; ++k) {
      Contact<Scalar> c{};
      c.first = static_cast<std::uint32_t>(name());
      c.second = static_cast<std::uint32_t>(name());
      c.key1 = name();
      c.key2 = name();
      c.normal = vector();
      in_.requireUnit(c.normal, "contact of a sleeper");
      c.gap = number();
      c.arm1 = number();
      c.arm2 = number();
      const Vector3<Scalar> drift = vector();
      island.impulses.push_back(impulse());
      if (material_ == materials_.size()) {
        in_.fail("holds too few materials of sleepers");
      }
      validate(materials_[material_], "a sleeper");
      island.contacts.push_back(c, {materials_[material_++], drift});
    }
    for (std::uint64_t k = 0; k < memory; ++k) {
      const std::uint64_t key1 = name();
      const std::uint64_t key2 = name();
      island.memory.push_back({key1, key2, impulse()});
    }
    return island;
  }

 private:
  std::uint64_t name() {
    if (name_ == names_.size()) {
      in_.fail("holds too few names of sleepers");
    }
    return names_[name_++];
  }
  Scalar number() {
    if (number_ == numbers_.size()) {
      in_.fail("holds too few numbers of sleepers");
    }
    return numbers_[number_++];
  }
  Vector3<Scalar> vector() {
    const Scalar x = number();
    const Scalar y = number();
    return {x, y, number()};
  }
  RestingBody<Scalar> body() {
    const std::uint64_t id = name();
    const std::uint64_t material = name();
    const Vector3<Scalar> x = vector();
    const Vector3<Scalar> a = vector();
    const Vector3<Scalar> alpha = vector();
    const Scalar mass = number();
    return {id, material, x, a, alpha, mass, number(), 0};
  }
  ContactImpulse<Scalar> impulse() {
    ContactImpulse<Scalar> j;
    j.normal = number();
    j.tangential = vector();
    j.turning = vector();
    return j;
  }

  SnapshotReader& in_;
  std::vector<std::uint64_t> names_;
  std::vector<Scalar> numbers_;
  std::vector<Material<Scalar>> materials_;
  std::size_t name_ = 0;
  std::size_t number_ = 0;
  std::size_t material_ = 0;
};

}  // namespace detail

}  // namespace gravel
