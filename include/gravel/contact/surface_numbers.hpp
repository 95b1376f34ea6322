#pragma once

/// \file
/// Numbers for the surfaces that occur.

#include <gravel/contact/contact_list.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace gravel::detail {

/// Surfaces numbered from 0 as they appear, named by two numbers and a drift; each is mixed once, but for a
/// scalar of which equal is not the same: then each question has a surface of its own. A hash table, O(1) a
/// question.
template <Real S>
class SurfaceNumbers {
 public:
  void clear() {
    names_.clear();
    surfaces_.clear();
    places_.assign(places_.size(), none);
  }

  /// \param mixed() is asked for the material of a surface that is new
  template <class Mixed>
  std::uint32_t of(std::uint64_t name1, std::uint64_t name2, const Vector3<S>& drift, Mixed&& mixed) {
    const auto enter = [&] {
      names_.push_back({name1, name2});
      surfaces_.push_back({mixed(), drift});
      return static_cast<std::uint32_t>(names_.size() - 1);
    };
    if (!equalIsSame<S>) {  // nobody would find it again
      return enter();
    }
    if (2 * names_.size() >= places_.size()) {
      grow();
    }
    std::size_t place = placeOf({name1, name2});
    while (places_[place] != none) {
      const std::uint32_t k = places_[place];
      if (names_[k] == Name{name1, name2} && surfaces_[k].drift == drift) {
        return k;
      }
      place = (place + 1) % places_.size();
    }
    places_[place] = enter();
    return places_[place];
  }

  /// The numbers here of what is numbered elsewhere, one after the other.
  void add(const SurfaceNumbers& others, std::vector<std::uint32_t>& numbers) {
    for (std::size_t k = 0; k < others.names_.size(); ++k) {
      const ContactSurface<S>& surface = others.surfaces_[k];
      numbers.push_back(of(others.names_[k].first, others.names_[k].second, surface.drift,
                           [&] { return surface.material; }));
    }
  }

  const std::vector<ContactSurface<S>>& surfaces() const { return surfaces_; }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  struct Name {
    std::uint64_t first;
    std::uint64_t second;
    friend bool operator==(const Name&, const Name&) = default;
  };

  std::size_t placeOf(const Name& name) const {  // the number of places is a power of two
    const std::uint64_t mixed = (name.first * 0x9E3779B97F4A7C15U + name.second) * 0xBF58476D1CE4E5B9U;
    return static_cast<std::size_t>(mixed >> 32U) % places_.size();
  }

  void grow() {
    places_.assign(std::max<std::size_t>(16, 2 * places_.size()), none);
    for (std::size_t k = 0; k < names_.size(); ++k) {
      std::size_t place = placeOf(names_[k]);
      while (places_[place] != none) {
        place = (place + 1) % places_.size();
      }
      places_[place] = static_cast<std::uint32_t>(k);
    }
  }

  std::vector<Name> names_;
  std::vector<ContactSurface<S>> surfaces_;
  std::vector<std::uint32_t> places_;  ///< by hash, open addressing: numbers, or `none`
};

}  // namespace gravel::detail
