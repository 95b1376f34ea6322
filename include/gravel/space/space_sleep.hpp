#pragma once

/// \file
/// Members of `Space` that let bodies fall asleep and wake.

#include <gravel/space/space.hpp>

namespace gravel {

/// Before the step: what somebody changed wakes.
template <Real Scalar, class Layout>
void Space<Scalar, Layout>::wakeTheChanged() {
  if (sleep_.empty()) {
    return;
  }
  sleep_.lookForChanges(bodies_, contact_, this->config_, dt_);
  sleep_.wake(bodies_, contact_);
}

/// Before the step, when forces and contacts are known: what is tired falls asleep, and what something comes
/// near to wakes.
template <Real Scalar, class Layout>
void Space<Scalar, Layout>::fallAsleep() {
  const auto isIdle = [&] {
    bool idle = true;
    for (std::size_t i = 0; idle && i < n(); ++i) {
      idle = !detail::isMovable(bodies_, i);
    }
    return idle;
  };
  if (sleep_.empty()) {
    contact_.setIdle(false);
    return;
  }
  left_.damping += sleep_.fallAsleep(bodies_, contact_, this->config_);
  contact_.setIdle(isIdle());
  sleep_.lookForApproach(bodies_, contact_, this->config_, time_, dt_, profiler_);
  sleep_.wake(bodies_, contact_);
  contact_.setIdle(isIdle());
}

/// What touches, with what sleeps and what ended inside the step.
template <Real Scalar, class Layout>
auto Space<Scalar, Layout>::allTouches() const -> typename ContactStage<Scalar, Layout>::Touches {
  auto touches = contact_.allTouches(bodies_);
  contact_.addEnded(bodies_, touches);
  sleep_.addTouches(bodies_, touches, previous_dt_);
  return touches;
}

}  // namespace gravel
