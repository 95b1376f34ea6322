#pragma once

/// \file
/// A copyable, type-erased callable: what `std::function` does, without `<functional>`, which costs every
/// including file a fifth of a second.

#include <concepts>
#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>

namespace gravel {

namespace detail {

/// To be called with anything, for nothing.
struct DoNothing {
  template <class... T>
  void operator()(const T&... /*unused*/) const {}
};

}  // namespace detail

template <class Signature>
class Callback;

/// Empty by default; calling an empty one is undefined, so ask first. Copies share the callable.
template <class R, class... Args>
class Callback<R(Args...)> {
 public:
  Callback() = default;
  Callback(std::nullptr_t) {}  // NOLINT(google-explicit-constructor)

  /// Empty if `f` is a null pointer or an empty `std::function`.
  template <class F>
    requires(!std::same_as<std::remove_cvref_t<F>, Callback> &&
             std::is_invocable_r_v<R, std::decay_t<F>&, Args...>)
  Callback(F&& f) {  // NOLINT(bugprone-forwarding-reference-overload,google-explicit-constructor)
    using Target = std::decay_t<F>;
    auto target = std::make_shared<Target>(std::forward<F>(f));
    if constexpr (requires(const Target& f0) {
                    requires std::is_convertible_v<decltype(f0 == nullptr), bool>;
                  }) {
      if (*target == nullptr) {
        return;
      }
    }
    target_ = std::move(target);
    call_ = [](void* callable, Args... args) -> R {
      if constexpr (std::is_void_v<R>) {
        (*static_cast<Target*>(callable))(std::forward<Args>(args)...);
      } else {
        return (*static_cast<Target*>(callable))(std::forward<Args>(args)...);
      }
    };
  }

  explicit operator bool() const { return call_ != nullptr; }

  R operator()(Args... args) const { return call_(target_.get(), std::forward<Args>(args)...); }

 private:
  std::shared_ptr<void> target_;
  R (*call_)(void*, Args...) = nullptr;
};

}  // namespace gravel
