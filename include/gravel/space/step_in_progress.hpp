#pragma once

/// \file
/// Who may not be called inside a step: what changes a space would pull its arrays from under the step.

#include <gravel/core/check.hpp>

#include <stdexcept>

namespace gravel::detail {

/// Whether a step of an object is on. As its first member it refuses to have the object moved from, or
/// assigned to, inside a step, while nothing has changed. A copy, which a hook may make, is not in the step.
class StepInProgress {
 public:
  StepInProgress() = default;
  StepInProgress(const StepInProgress& /*other*/) noexcept {}
  // NOLINTNEXTLINE(performance-noexcept-move-constructor)
  StepInProgress(StepInProgress&& other) { other.refuse("a move from the space"); }
  StepInProgress& operator=(const StepInProgress& /*other*/) {
    refuse("assignment to the space");
    return *this;
  }
  // NOLINTNEXTLINE(performance-noexcept-move-constructor)
  StepInProgress& operator=(StepInProgress&& other) {
    refuse("assignment to the space");
    other.refuse("a move from the space");
    return *this;
  }
  ~StepInProgress() = default;

  /// Until the end of a scope, however that is left.
  class Scope {
   public:
    explicit Scope(StepInProgress& step) : on_(step.on_) { on_ = true; }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
    ~Scope() { on_ = false; }

   private:
    bool& on_;
  };

  /// \throws std::logic_error inside a step
  void refuse(const char* call) const {
    if (on_) {
      throw std::logic_error(faultText(call, "called by a hook, inside a step", "between steps"));
    }
  }

 private:
  bool on_ = false;
};

}  // namespace gravel::detail
