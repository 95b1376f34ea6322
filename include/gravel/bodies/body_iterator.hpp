#pragma once

/// \file
/// Walks over bodies: `for (const auto body : space.bodies())`.

#include <cstddef>
#include <iterator>

namespace gravel {

/// Gives a proxy by value at each place, so that `auto&` does not bind to it; made by Bodies::begin(). Adding
/// or removing bodies ends its meaning as that of an index.
template <class Proxy>
class BodyIterator {
 public:
  using iterator_concept = std::forward_iterator_tag;
  using iterator_category = std::input_iterator_tag;  // what it gives is no reference
  using value_type = Proxy;
  using reference = Proxy;
  using pointer = void;
  using difference_type = std::ptrdiff_t;

  BodyIterator() = default;
  BodyIterator(typename Proxy::StoragePointer storage, std::size_t index)
      : storage_(storage), index_(index) {}

  Proxy operator*() const { return {storage_, index_}; }
  BodyIterator& operator++() {
    ++index_;
    return *this;
  }
  BodyIterator operator++(int) {
    const BodyIterator before = *this;
    ++index_;
    return before;
  }
  friend bool operator==(const BodyIterator&, const BodyIterator&) = default;

 private:
  typename Proxy::StoragePointer storage_ = nullptr;
  std::size_t index_ = 0;
};

}  // namespace gravel
