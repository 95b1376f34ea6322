#pragma once

/// \file
/// Files that hold exact bits: what `Space::save` writes and `Space::restore` reads.
///
/// Layout: the line "gravel snapshot 9\n"; then records of (name, size of an element, number of elements,
/// bytes) in the order in which they were written; then a 64-bit checksum (FNV-1a) of all before it. Numbers
/// are in the machine's own form, so a file is read on the same kind of machine; anything else is refused.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/sizes.hpp>
#include <gravel/output/whole_file.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>
#include <vector>

namespace gravel {

namespace detail {
inline constexpr char snapshotMagic[] = "gravel snapshot 9\n";
inline std::uint64_t fnv1a(std::uint64_t hash, const unsigned char* bytes, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    hash = (hash ^ bytes[i]) * 0x100000001B3ULL;
  }
  return hash;
}
inline constexpr std::uint64_t fnvStart = 0xCBF29CE484222325ULL;
}  // namespace detail

/// Collects records in memory and writes them as one file.
class SnapshotWriter {
 public:
  SnapshotWriter() { raw(detail::snapshotMagic, sizeof detail::snapshotMagic - 1); }

  template <class T>
    requires std::is_trivially_copyable_v<T>
  void array(const std::string& name, const T* values, std::size_t count) {
    const std::uint64_t head[3] = {name.size(), sizeof(T), count};
    raw(head, sizeof head);
    raw(name.data(), name.size());
    raw(values, count * sizeof(T));
  }

  template <class T>
  void value(const std::string& name, const T& x) {
    array(name, &x, 1);
  }

  /// The file is whole or as it was; see writeFileWhole().
  /// \throws std::runtime_error with path and reason if the file cannot be written
  void write(const std::string& path) const {
    const std::uint64_t sum = detail::fnv1a(detail::fnvStart, bytes_.data(), bytes_.size());
    detail::writeFileWhole(path, {reinterpret_cast<const char*>(bytes_.data()), bytes_.size()},
                           {reinterpret_cast<const char*>(&sum), sizeof sum});
  }

 private:
  void raw(const void* data, std::size_t n) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + n);  // g++ 12 sees an overflow in insert() where there is none
    if (n > 0) {
      std::memcpy(bytes_.data() + at, data, n);
    }
  }

  std::vector<unsigned char> bytes_;
};

/// Reads the records of a file in the order in which they were written.
class SnapshotReader {
 public:
  /// \throws std::runtime_error if the file cannot be read, is no snapshot, or is damaged
  explicit SnapshotReader(const std::string& path) : path_(path) {
    std::FILE* file = std::fopen(path.c_str(), "rb");
    if (file == nullptr) {
      fail("cannot be opened: " + std::generic_category().message(errno));
    }
    unsigned char block[65536];
    for (std::size_t n = 0; (n = std::fread(block, 1, sizeof block, file)) > 0;) {
      bytes_.insert(bytes_.end(), block, block + n);
    }
    const bool whole = std::ferror(file) == 0;
    std::fclose(file);
    if (!whole) {
      fail("cannot be read");
    }
    const std::size_t magic = sizeof detail::snapshotMagic - 1;
    if (bytes_.size() < magic + sizeof(std::uint64_t) ||
        std::memcmp(bytes_.data(), detail::snapshotMagic, magic) != 0) {
      fail("is not a snapshot of this version");
    }
    const std::size_t end = bytes_.size() - sizeof(std::uint64_t);
    std::uint64_t sum = 0;
    std::memcpy(&sum, bytes_.data() + end, sizeof sum);
    if (sum != detail::fnv1a(detail::fnvStart, bytes_.data(), end)) {
      fail("is damaged: its checksum does not match");
    }
    bytes_.resize(end);
    at_ = magic;
  }

  template <class T>
    requires std::is_trivially_copyable_v<T> std::vector<T> array(const std::string& name) {
      std::uint64_t head[3] = {};
      take(head, sizeof head, name);
      std::string found(head[0] <= bytes_.size() - at_ ? static_cast<std::size_t>(head[0]) : 0, '\0');
      take(found.data(), found.size(), name);
      if (found != name || head[1] != sizeof(T) || head[2] > (bytes_.size() - at_) / sizeof(T)) {
        fail("holds '" + printable(found) + "' of " + std::to_string(head[1]) + " bytes where '" + name +
             "' of " + std::to_string(sizeof(T)) + " is expected: another Scalar or version");
      }
      std::vector<T> values(static_cast<std::size_t>(head[2]));
      take(values.data(), values.size() * sizeof(T), name);
      return values;
    }

  /// Real numbers of a state that steps go on from.
  template <class T>
  std::vector<T> finite(const std::string& name) {
    std::vector<T> values = array<T>(name);
    if (!std::all_of(values.begin(), values.end(), [](const T& x) { return isFinite(x); })) {
      fail("holds a value of '" + name + "' that is not finite");
    }
    return values;
  }

  template <class T>
  T value(const std::string& name) {
    const std::vector<T> values = array<T>(name);
    if (values.size() != 1) {
      fail("has " + std::to_string(values.size()) + " values of '" + name + "' where one is expected");
    }
    return values[0];
  }

  /// Refuses what no plane or contact has, but for rounding.
  template <Real Scalar>
  void requireUnit(const Vector3<Scalar>& normal, const char* what) const {
    const Scalar off = normal.squaredNorm() - Scalar(1);
    const Scalar rounding = Scalar(64) * detail::roundoff<Scalar>();
    if (off > rounding || -off > rounding) {
      fail(std::string("holds a ") + what + " whose normal is no unit vector");
    }
  }

  /// Refuses a file that goes on after the last record taken from it.
  void requireEnd() const {
    if (at_ != bytes_.size()) {
      fail("goes on for " + std::to_string(bytes_.size() - at_) + " bytes where its end is expected");
    }
  }

  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error("gravel: the snapshot " + path_ + " " + why);
  }

 private:
  /// A name that may be any bytes, as it can be shown.
  static std::string printable(std::string name) {
    constexpr std::size_t most = 40;
    const bool isLong = name.size() > most;
    name.resize(std::min(name.size(), most));
    std::replace_if(
        name.begin(), name.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return isLong ? name + "..." : name;
  }

  void take(void* target, std::size_t n, const std::string& name) {
    if (n > bytes_.size() - at_) {
      fail("ends before '" + name + "'");
    }
    if (n > 0) {
      std::memcpy(target, bytes_.data() + at_, n);
    }
    at_ += n;
  }

  std::string path_;
  std::vector<unsigned char> bytes_;
  std::size_t at_ = 0;
};

/// All fields of all bodies, in their order, coefficient by coefficient.
template <Real Scalar, class Layout>
void saveBodies(const Bodies<Scalar, Layout>& bodies, SnapshotWriter& out) {
  static_assert(std::is_trivially_copyable_v<Scalar>, "gravel: snapshots need a Scalar without pointers");
  const auto& storage = bodies.storage();
  out.value("bodies", static_cast<std::uint64_t>(bodies.size()));
  RealFields::forEach([&]<class F>(F field) {
    constexpr auto width = static_cast<std::size_t>(F::width);
    std::vector<Scalar> values(bodies.size() * width);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if constexpr (width == 1) {
        values[i] = storage.at(field, i);
      } else if constexpr (width == 4) {
        const Quaternion<Scalar> q(storage.at(field, i));
        std::copy(q.coeffs().data(), q.coeffs().data() + 4, &values[i * width]);
      } else {
        const Vector3<Scalar> v(storage.at(field, i));
        std::copy(v.data(), v.data() + 3, &values[i * width]);
      }
    }
    out.array(F::name, values.data(), values.size());
  });
  IntegerFields::forEach([&]<class F>(F field) {
    std::vector<typename F::Integer> values(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      values[i] = storage.at(field, i);
    }
    out.array(F::name, values.data(), values.size());
  });
}

/// The bodies of a snapshot, with their ids. \throws std::runtime_error, std::invalid_argument
template <Real Scalar>
Bodies<Scalar, SoA> loadBodies(SnapshotReader& in) {
  Bodies<Scalar, SoA> bodies;
  const auto n = static_cast<std::size_t>(in.value<std::uint64_t>("bodies"));
  SoA::Storage<Scalar> fieldsOf;
  RealFields::forEach([&]<class F>(F field) {
    constexpr auto width = static_cast<std::size_t>(F::width);
    const std::vector<Scalar> values = in.finite<Scalar>(F::name);
    if (values.size() != n * width) {
      in.fail("has " + std::to_string(values.size()) + " values of '" + F::name + "' for " +
              std::to_string(n) + " bodies");
    }
    fieldsOf.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Scalar* first = &values[i * width];
      if constexpr (width == 1) {
        fieldsOf.at(field, i) = *first;
      } else if constexpr (width == 4) {
        fieldsOf.at(field, i) = Quaternion<Scalar>(first);
      } else {
        fieldsOf.at(field, i) = Vector3<Scalar>(first[0], first[1], first[2]);
      }
    }
  });
  IntegerFields::forEach([&]<class F>(F field) {
    const auto values = in.array<typename F::Integer>(F::name);
    if (values.size() != n) {
      in.fail("has " + std::to_string(values.size()) + " values of '" + F::name + "' for " +
              std::to_string(n) + " bodies");
    }
    for (std::size_t i = 0; i < n; ++i) {
      fieldsOf.at(field, i) = values[i];
    }
  });
  bodies.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    const BasicBodyProxy<SoA::Storage<Scalar>, true> body(&fieldsOf, i);
    Body<Scalar> value = body.load();
    value.inertia.reset();  // that of a giant planet is no float
    bodies.add(value, body.id());
    detail::copyBody(bodies.storage(), i, fieldsOf, i);  // forces, inertia, and bits that load() rounds
  }
  bodies.validateAll();  // of inertia, too
  return bodies;
}

}  // namespace gravel
