#pragma once

/// \file
/// What the impacts of a step did to each body, with room for those alone that had any.

#include <gravel/contact/impact.hpp>
#include <gravel/core/memory.hpp>

#include <cstdint>
#include <vector>

namespace gravel::detail {

template <Real S>
class ImpactHistories {
 public:
  using History = ImpactHistory<S>;

  /// For so many bodies. O(N) where they are others than before.
  void resize(std::size_t count) { place_.resize(count, none); }

  /// Nothing has happened. Asks for no memory.
  void forget() {
    for (const std::uint32_t body : struck_) {
      place_[body] = none;
    }
    struck_.clear();
    clearSpare(all_);
  }

  const History& of(std::uint32_t body) const {
    const std::uint32_t place = body < place_.size() ? place_[body] : none;
    return place == none ? quiet_ : all_[place - 1];
  }

  /// To be changed.
  History& at(std::uint32_t body) {
    if (place_[body] == none) {
      struck_.push_back(body);  // first, so that forget() finds it whatever happens
      all_.emplace_back();
      place_[body] = static_cast<std::uint32_t>(all_.size());
    }
    return all_[place_[body] - 1];
  }

 private:
  static constexpr std::uint32_t none = 0;

  std::vector<std::uint32_t> place_;  ///< by body: in all_, counted from 1
  std::vector<History> all_;
  History quiet_;  ///< of all others
  std::vector<std::uint32_t> struck_;
};

}  // namespace gravel::detail
