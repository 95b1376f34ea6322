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

  /// Nothing has happened.
  void forget() {
    for (const std::uint32_t body : struck_) {
      place_[body] = none;
    }
    struck_.clear();
    clearSpare(all_);
    all_.resize(1);
  }

  const History& of(std::uint32_t body) const { return all_[body < place_.size() ? place_[body] : none]; }

  /// To be changed.
  History& at(std::uint32_t body) {
    if (place_[body] == none) {
      struck_.push_back(body);  // first, so that forget() finds it whatever happens
      all_.emplace_back();
      place_[body] = static_cast<std::uint32_t>(all_.size() - 1);
    }
    return all_[place_[body]];
  }

 private:
  static constexpr std::uint32_t none = 0;

  std::vector<std::uint32_t> place_;                    ///< by body: in all_
  std::vector<History> all_ = std::vector<History>(1);  ///< the first one is that of all others
  std::vector<std::uint32_t> struck_;
};

}  // namespace gravel::detail
