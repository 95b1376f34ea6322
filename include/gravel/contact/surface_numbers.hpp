#pragma once

/// \file
/// Numbers for the surfaces that one thread meets.

#include <gravel/contact/contact_list.hpp>

#include <algorithm>
#include <vector>

namespace gravel::detail {

/// Surfaces numbered from 0 as they appear, named by two numbers and a drift. One that was met among the last
/// few keeps its number and is not mixed again; another one may get a second number, which costs memory
/// alone.
template <Real S>
class SurfaceNumbers {
 public:
  void clear() {
    names_.clear();
    surfaces_.clear();
  }

  /// \param mixed() is asked for the material of a surface that is new
  template <class Mixed>
  std::uint32_t of(std::uint64_t name1, std::uint64_t name2, const Vector3<S>& drift, Mixed&& mixed) {
    constexpr std::size_t remembered = 32;
    const std::size_t oldest = names_.size() - std::min(names_.size(), remembered);
    for (std::size_t k = names_.size(); k-- > oldest;) {
      if (names_[k] == Name{name1, name2} && surfaces_[k].drift == drift) {
        return static_cast<std::uint32_t>(k);
      }
    }
    names_.push_back({name1, name2});
    surfaces_.push_back({mixed(), drift});
    return static_cast<std::uint32_t>(names_.size() - 1);
  }

  const std::vector<ContactSurface<S>>& surfaces() const { return surfaces_; }

 private:
  struct Name {
    std::uint64_t first;
    std::uint64_t second;
    friend bool operator==(const Name&, const Name&) = default;
  };
  std::vector<Name> names_;
  std::vector<ContactSurface<S>> surfaces_;
};

}  // namespace gravel::detail
