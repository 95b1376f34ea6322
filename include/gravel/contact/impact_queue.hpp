#pragma once

/// \file
/// The events to come of a step.

#include <gravel/contact/impact.hpp>
#include <gravel/contact/impact_histories.hpp>
#include <gravel/core/memory.hpp>

#include <algorithm>
#include <span>
#include <vector>

namespace gravel::detail {

/// In the order of (time, keys). What a blow makes void stays until half of the queue may be so, and is then
/// left out at once: where each of many blows changes the course of a body that many others come for, there
/// would else be as many events as the product of both numbers.
template <Real S>
class ImpactQueue {
 public:
  using Event = ImpactEvent<S>;

  /// Whether one of its bodies has been through another impact since.
  static bool isVoid(const Event& event, const ImpactHistories<S>& histories) {
    return histories.of(event.first).impacts != event.stamp1 ||
           (event.second != staticPartner && histories.of(event.second).impacts != event.stamp2);
  }

  /// A new step begins with these.
  void fill(std::span<const std::vector<Event>> parts) {
    clearSpare(events_);
    for (const std::vector<Event>& part : parts) {
      events_.insert(events_.end(), part.begin(), part.end());
    }
    order();
  }

  bool empty() const { return events_.empty(); }
  const Event& front() const { return events_.front(); }

  Event pop() {
    std::pop_heap(events_.begin(), events_.end(), comesAfter<S>);
    const Event event = events_.back();
    events_.pop_back();
    return event;
  }

  /// As of now.
  void push(Event event, const ImpactHistories<S>& histories) {
    if (events_.size() >= most_) {
      std::erase_if(events_, [&](const Event& old) { return isVoid(old, histories); });
      order();
    }
    event.stamp1 = histories.of(event.first).impacts;
    event.stamp2 = event.second == staticPartner ? 0 : histories.of(event.second).impacts;
    events_.push_back(event);
    std::push_heap(events_.begin(), events_.end(), comesAfter<S>);
  }

 private:
  static constexpr std::size_t few = 256;

  void order() {
    std::make_heap(events_.begin(), events_.end(), comesAfter<S>);
    most_ = 2 * std::max(events_.size(), few);
  }

  std::vector<Event> events_;  ///< a heap
  std::size_t most_ = 0;       ///< before the void ones are left out
};

}  // namespace gravel::detail
