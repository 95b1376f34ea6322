#pragma once

/// \file
/// What bodies have in common as they move: a pile in orbit is the same to look at as one at rest.

#include <gravel/core/sizes.hpp>
#include <gravel/core/types.hpp>

#include <algorithm>
#include <array>

namespace gravel {

/// Bodies that stay where they are for as long as the list is asked to hold.
struct AtRest {};

namespace detail {

/// Way [m] of body i; zero for `AtRest`.
template <Real S, class Travel>
Vector3<S> wayOf(const Travel& travel, std::size_t i) {
  if constexpr (std::is_same_v<Travel, AtRest>) {
    return Vector3<S>::Zero();
  } else {
    return travel(i);
  }
}

/// How far [m] the middle of the path of body i is from that of its way: a h^2/8 on a parabola; zero where
/// `travel` has no `bend(i)`.
template <Real S, class Travel>
Vector3<S> bendOf(const Travel& travel, std::size_t i) {
  if constexpr (requires { travel.bend(i); }) {
    return travel.bend(i);
  } else {
    return Vector3<S>::Zero();
  }
}

/// The square of what it is less `common`, at most: who may go one way or another has an `otherBend(i)`, too.
template <Real S, class Travel>
S bendLess_sq(const Travel& travel, std::size_t i, const Vector3<S>& common) {
  S most = Vector3<S>(bendOf<S>(travel, i) - common).squaredNorm();
  if constexpr (requires { travel.otherBend(i); }) {
    most = std::max<S>(most, Vector3<S>(travel.otherBend(i) - common).squaredNorm());
  }
  return most;
}
/// The same of ways that are seen in the frame of a CommonMotion, or not.
template <Real S, class Travel>
S bendOf_sq(const Travel& travel, std::size_t i) {
  if constexpr (requires { travel.bend_sq(i); }) {
    return travel.bend_sq(i);
  } else {
    return bendLess_sq<S>(travel, i, Vector3<S>::Zero());
  }
}

/// No less than its length along each axis in sum, found sooner.
template <Real S, class Travel>
[[gnu::always_inline]] inline S mostBendOf(const Travel& travel, std::size_t i) {
  if constexpr (requires { travel.mostBend(i); }) {
    return travel.mostBend(i);
  } else {
    return sumAbs(bendOf<S>(travel, i));
  }
}

/// (a + b)^2.
template <Real S>
[[gnu::always_inline]] inline S squareOfSum(const S& a_sq, const S& b_sq) {
  using std::sqrt;
  return b_sq == S(0) ? a_sq : S(a_sq + b_sq + S(2) * S(sqrt(a_sq)) * S(sqrt(b_sq)));
}

/// What n ways have in common, as those of a pile in orbit do: the median of each component among at most 63
/// of them, evenly spaced; zero unless it leaves of seven in eight at most half as much. The eighth, bullets
/// or a planet, has no say. Of ways or velocities. O(1).
///
/// \param way `way(i)`: that of body i
template <Real S, class Way>
Vector3<S> commonWay(std::size_t n, Way&& way) {
  constexpr std::size_t most = 63;
  std::array<Vector3<S>, most> ways;
  std::array<S, most> numbers;
  std::size_t count = 0;
  const std::size_t asked = std::min(n, most);
  for (std::size_t k = 0; k < asked; ++k) {
    ways[count] = way(k * n / asked);
    count += isFinite(S(ways[count].squaredNorm())) ? 1U : 0U;
  }
  if (count == 0) {
    return Vector3<S>::Zero();
  }
  const auto ranked = [&](std::size_t rank, auto&& numberOf) {
    for (std::size_t k = 0; k < count; ++k) {
      numbers[k] = numberOf(ways[k]);
    }
    std::nth_element(numbers.data(), numbers.data() + rank, numbers.data() + count);
    return numbers[rank];
  };
  Vector3<S> common;
  for (int axis = 0; axis < 3; ++axis) {
    common[axis] = ranked(count / 2, [axis](const Vector3<S>& w) { return w[axis]; });
  }
  const std::size_t high = count * 7 / 8;
  const S whole_sq = ranked(high, [](const Vector3<S>& w) { return S(w.squaredNorm()); });
  const S rest_sq = ranked(high, [&](const Vector3<S>& w) { return S((w - common).squaredNorm()); });
  return S(4) * rest_sq < whole_sq ? common : Vector3<S>(Vector3<S>::Zero());
}

/// The frame that moves with what all bodies have in common, from the last search to the end of their ways;
/// in a shear-periodic box with the flow, in which all images of a body have the same way.
template <Real S>
class CommonMotion {
 public:
  /// \param ahead [1] by which the flow will shear during the ways: a body at x goes -ahead x in y with it
  void shear(const S& ahead) { ahead_ = ahead; }
  const S& ahead() const { return ahead_; }
  /// [1] Its size.
  S shearing() const { return sizeOf(ahead_); }
  /// [1] What ways use of a skin, with the shear of what they cross meanwhile, over their length.
  S spread() const { return S(1) + S(2) * shearing(); }

  /// \param start, end [m] since the last search, before and after the ways
  void set(const Vector3<S>& start, const Vector3<S>& end) {
    start_ = start;
    end_ = end;
    using std::sqrt;
    most_ = S(sqrt(std::max<S>(start_.squaredNorm(), end_.squaredNorm())));
  }
  /// That of n bodies. \param start, end  by body, before and after the ways \param travel  for bends
  template <class Start, class End, class Travel>
  void find(std::size_t n, const Start& start, const End& end, const Travel& travel) {
    set(commonWay<S>(n, start), commonWay<S>(n, end));
    bend_ = commonWay<S>(n, [&](std::size_t i) { return bendOf<S>(travel, i); });
  }
  /// Of ways that begin where all were last seen; a bend below `least` [m] is none.
  template <class Travel>
  void findAhead(std::size_t n, const Travel& travel, const S& least) {
    find(
        n, [](std::size_t /*body*/) { return Vector3<S>(Vector3<S>::Zero()); }, travel, travel);
    bend_ = sumAbs(bend_) > least ? bend_ : Vector3<S>(Vector3<S>::Zero());
  }
  void clear() {
    set(Vector3<S>::Zero(), Vector3<S>::Zero());
    bend_ = Vector3<S>::Zero();
  }

  const Vector3<S>& start() const { return start_; }
  const Vector3<S>& end() const { return end_; }
  const Vector3<S>& bend() const { return bend_; }
  /// [m] The longer of both.
  const S& most() const { return most_; }
  bool isNone() const { return !(most_ > S(0)) && bend_ == Vector3<S>::Zero(); }

  /// A way from x as seen in this frame.
  Vector3<S> lessThis(const Vector3<S>& x, const Vector3<S>& way) const {
    Vector3<S> rest = way - (end_ - start_);
    if (!(ahead_ == S(0))) {
      rest[1] += ahead_ * x[0];
    }
    return rest;
  }
  /// `travel` from these positions as seen in it.
  template <class Positions, class Travel>
  auto lessThis(const Positions& positions, const Travel& travel) const {
    if constexpr (std::is_same_v<Travel, AtRest>) {
      return travel;
    } else {
      struct Rest {
        const CommonMotion& common;
        const Positions& positions;
        const Travel& travel;
        Vector3<S> operator()(std::size_t i) const {
          return common.lessThis(Vector3<S>(positions[i]), Vector3<S>(travel(i)));
        }
        S bend_sq(std::size_t i) const { return bendLess_sq<S>(travel, i, common.bend_); }
      };
      return Rest{*this, positions, travel};
    }
  }

 private:
  Vector3<S> start_ = Vector3<S>::Zero();
  Vector3<S> end_ = Vector3<S>::Zero();
  Vector3<S> bend_ = Vector3<S>::Zero();
  S most_ = S(0);
  S ahead_ = S(0);
};

}  // namespace detail

}  // namespace gravel
