#pragma once

/// \file
/// The materials of a scene, and what each two of them are to each other.

#include <gravel/contact/material.hpp>

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <limits>
#include <span>

namespace gravel {

/// Two materials by their numbers, first <= second, that have measured coefficients as a pair, whatever they
/// are alone.
template <Real Scalar>
struct MaterialPair {
  std::uint32_t first;
  std::uint32_t second;
  Material<Scalar> material;

  /// The order of lists.
  friend bool operator<(const MaterialPair& a, const MaterialPair& b) {
    return a.first != b.first ? a.first < b.first : a.second < b.second;
  }
};

/// Materials by MaterialId, seen. Owns nothing.
template <Real Scalar>
struct MaterialView {
  /// Of a surface that is no entry: it is of no pair.
  static constexpr std::uint32_t unlisted = std::numeric_limits<std::uint32_t>::max();

  std::span<const Material<Scalar>> entries;
  std::span<const MaterialPair<Scalar>> pairs{};  ///< in their order, no two alike; all others are mixed

  MaterialView() = default;
  /// Any contiguous range of materials, without pairs: all are mixed.
  template <class Range>
    requires std::convertible_to<const Range&, std::span<const Material<Scalar>>> MaterialView(
        const Range& all)
        : entries(all) {}
    MaterialView(std::span<const Material<Scalar>> all, std::span<const MaterialPair<Scalar>> ofPairs)
        : entries(all), pairs(ofPairs) {}

    std::size_t size() const { return entries.size(); }

    /// \throws std::invalid_argument, if there is none of this number
    [[gnu::always_inline]] const Material<Scalar>& operator[](std::uint32_t id) const {
      if (id >= entries.size()) {
        refuse(id);
      }
      return entries[id];
    }

    /// Of the pair. O(log pairs). \throws std::invalid_argument as above
    Material<Scalar> pair(std::uint32_t a, std::uint32_t b) const { return pair(a, b, (*this)[b]); }
    /// The same with a surface of number b, or `unlisted`, that is told what it is.
    Material<Scalar> pair(std::uint32_t a, std::uint32_t b, const Material<Scalar>& ofB) const {
      const Material<Scalar>* own = measured(a, b);
      return own != nullptr ? *own : mix((*this)[a], ofB);
    }
    /// Coefficients that these two have as a pair; null where they are mixed.
    const Material<Scalar>* measured(std::uint32_t a, std::uint32_t b) const {
      const MaterialPair<Scalar> wanted{std::min(a, b), std::max(a, b), {}};
      const auto found = std::lower_bound(pairs.begin(), pairs.end(), wanted);
      return found != pairs.end() && !(wanted < *found) ? &found->material : nullptr;
    }

    /// \throws std::invalid_argument that names the body by its index, if there is none of its number
    [[gnu::always_inline]] void require(std::uint32_t id, std::size_t body) const {
      if (id >= entries.size()) {
        refuse(id, "body " + std::to_string(body));
      }
    }

   private:
    [[noreturn, gnu::cold, gnu::noinline]] void refuse(std::uint32_t id,
                                                       const std::string& who = "a body") const {
      detail::refuse("material of " + who, std::to_string(id),
                     "below the number of materials, " + std::to_string(entries.size()));
    }
};

}  // namespace gravel
