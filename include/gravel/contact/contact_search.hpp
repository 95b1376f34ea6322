#pragma once

/// \file
/// What decides whether two surfaces touch, a gap between them that rests included.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/contact_bodies.hpp>
#include <gravel/contact/resting_gap.hpp>
#include <gravel/core/parallel.hpp>

#include <algorithm>
#include <optional>
#include <span>

namespace gravel {

/// Settings of a search for contacts.
template <Real Scalar>
struct NarrowPhaseSettings {
  Scalar time = Scalar(0);     ///< [s], for a sheared domain
  Scalar epsilon = Scalar(0);  ///< [m] centres closer than this (and than rounding) count as one point
  Scalar margin = Scalar(0);   ///< [m] pairs with a gap below this are contacts too; 0 takes overlaps only
  /// [s] step, or 0. What rests on something is carried through a step with a gap that opens and closes by
  /// rounding and by the curvature of its path; it stays a contact while the accelerations of the two can
  /// close the gap within the step, gap < (|a_1| + |a_2|) step^2, and the gap is below a thousandth of the
  /// radii. Such a contact may approach until its gap is closed.
  Scalar step = Scalar(0);
  /// Who rests on whom, sorted: only these stay contacts with a gap. Without it every pair so near does.
  std::optional<std::span<const ContactName>> resting = std::nullopt;
  /// [m s^-1] If given, so do others that touch, or approach no faster than this and what (|a_1| + |a_2|)
  /// brings in a step and a half: in half a step more it is two, above which a blow bounces, and at its own
  /// time.
  std::optional<Scalar> slow = std::nullopt;
  std::span<const ContactKeys> settled{};  ///< more of these, sorted
  std::span<const ContactName> before{};   ///< with which those found are compared: facts()
  std::span<const Scalar> carried{};  ///< [m s^-2] by body, to be added to |a|: see WayAhead; empty is none
  /// The same, of the frame: of contacts with what stands still |a + bend| counts where it is larger, and of
  /// those between bodies that lean on that. Of bodies that fly it is none: they meet by what they differ in.
  std::span<const Vector3<Scalar>> bend{};
  std::span<const std::uint8_t> leaning{};  ///< by body, whether it leans on what stands still; empty is none
};

/// \throws std::invalid_argument naming the setting, its value and what is allowed
template <Real S>
void validate(const NarrowPhaseSettings<S>& settings) {
  detail::require("time of a search for contacts", settings.time, detail::anyFinite<S>());
  detail::require("epsilon of a search for contacts", settings.epsilon, detail::nonNegative<S>());
  detail::require("margin of contacts", settings.margin, detail::nonNegative<S>());
  detail::require("step of a search for contacts", settings.step, detail::nonNegative<S>());
  if (settings.slow) {
    detail::require("slow approach", *settings.slow, detail::nonNegative<S>());
  }
}

namespace detail {

/// |a| of a body that contacts can move, with that of what carries it; else 0. \param leans  on what stands
/// still in the frame
template <Real S, class B>
[[gnu::always_inline]] inline S accelerationOf(const NarrowPhaseSettings<S>& settings, const B& bodies,
                                               std::size_t i, bool leans) {
  if (!isMovable(bodies, i)) {
    return S(0);
  }
  S own = safeNorm(Vector3<S>(bodies.accelerations()[i]));
  if (leans && !settings.bend.empty()) {
    own = std::max<S>(own, safeNorm(Vector3<S>(bodies.accelerations()[i] + settings.bend[i])));
  }
  return settings.carried.empty() ? own : S(own + settings.carried[i]);
}

/// The gap below which two with this sum of radii touch. \param acceleration() is asked for only where a step
/// is given
template <Real S, class Acceleration>
[[gnu::always_inline]] inline S marginOf(const NarrowPhaseSettings<S>& settings, const S& radii,
                                         Acceleration&& acceleration) {
  if (!(settings.step > S(0))) {
    return settings.margin;
  }
  const S closing = acceleration() * settings.step * settings.step;
  return std::max<S>(settings.margin, std::min<S>(closing, restingMargin<S>() * radii));
}

/// What marginOf() is at most.
template <Real S>
S widestMargin(const NarrowPhaseSettings<S>& settings, const S& radii) {
  return settings.step > S(0) ? std::max<S>(settings.margin, restingMargin<S>() * radii) : settings.margin;
}

/// Where a chunk has got to in the list of those who rest; its own pairs come in the same order.
using RestingCursor = std::size_t;

template <Real S>
bool mayRest(const NarrowPhaseSettings<S>& settings, const ContactKeys& keys, RestingCursor& cursor) {
  if (!settings.resting) {
    return true;
  }
  const std::span<const ContactName> resting = *settings.resting;
  const auto found = placeOf(resting, keys, cursor);
  cursor = static_cast<std::size_t>(found - resting.begin());
  return (found != resting.end() && found->keys == keys) ||
         std::binary_search(settings.settled.begin(), settings.settled.end(), keys);
}

/// Who is a contact with a gap though it was none: see NarrowPhaseSettings::slow.
/// \param radii [m] their sum \param approach [m s^-1] \param acceleration |a_1| + |a_2| [m s^-2]
template <Real S>
bool mayBegin(const NarrowPhaseSettings<S>& settings, const S& gap, const S& radii, const S& approach,
              const S& acceleration) {
  return settings.slow && (!(gap > S(16) * roundoff<S>() * radii) ||
                           !(S(2) * (approach - *settings.slow) > S(3) * acceleration * settings.step));
}

inline constexpr std::size_t contactChunk = 1024;

/// Calls append(k, part, cursor) for k = 0 … n-1 in chunks. \return their number
template <class Part, class Append>
std::size_t gatherContacts(std::size_t n, std::vector<Part>& parts, Append&& append) {
  const std::size_t used = (n + contactChunk - 1) / contactChunk;
  if (parts.size() < used) {
    parts.resize(used);
  }
  parallelForChunks<Share::Alike>(n, contactChunk, [&](std::size_t begin, std::size_t end) {
    Part& part = parts[begin / contactChunk];
    part.clear();
    RestingCursor cursor = 0;
    for (std::size_t k = begin; k < end; ++k) {
      append(k, part, cursor);
    }
  });
  return used;
}

}  // namespace detail

}  // namespace gravel
