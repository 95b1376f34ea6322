#pragma once

/// \file
/// Where the body of an id stands.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>

namespace gravel::detail {

/// From ids to indices. A body whose id is its index needs no entry, and until some are removed or reordered
/// that is every one; a table of all took some 50 bytes a body. O(1).
class PlacesById {
 public:
  PlacesById() = default;
  /// \param idAt(i) the id of body i, i < count
  template <class IdAt>
  PlacesById(std::size_t count, IdAt&& idAt) {
    for (std::size_t i = 0; i < count; ++i) {
      put(idAt(i), i);
    }
  }

  template <class IdAt>
  std::optional<std::size_t> find(std::uint64_t id, std::size_t count, IdAt&& idAt) const {
    if (id < count && idAt(static_cast<std::size_t>(id)) == id) {
      return static_cast<std::size_t>(id);
    }
    const auto entry = elsewhere_.find(id);
    return entry == elsewhere_.end() ? std::nullopt : std::optional<std::size_t>(entry->second);
  }

  /// The body stands there now. May throw; then it is known where it was.
  void put(std::uint64_t id, std::size_t place) {
    if (id == place) {
      elsewhere_.erase(id);
    } else {
      elsewhere_[id] = place;
    }
  }
  void forget(std::uint64_t id) { elsewhere_.erase(id); }

 private:
  std::unordered_map<std::uint64_t, std::size_t> elsewhere_;
};

}  // namespace gravel::detail
