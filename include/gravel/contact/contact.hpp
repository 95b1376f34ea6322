#pragma once

/// \file
/// A contact: where two bodies touch.

#include <gravel/contact/impulses.hpp>
#include <gravel/contact/material_view.hpp>
#include <gravel/core/random.hpp>

#include <algorithm>
#include <optional>
#include <span>

namespace gravel {

/// `Contact::second` of a contact with a boundary.
inline constexpr std::uint32_t staticPartner = std::numeric_limits<std::uint32_t>::max();

/// Second key of a contact with the boundary of that number; larger than any body's id below 2^63.
constexpr std::uint64_t boundaryKey(std::uint64_t boundary) { return boundary | (std::uint64_t{1} << 63U); }

/// The names of a contact's two sides, in the order of lists.
struct ContactKeys {
  std::uint64_t first;
  std::uint64_t second;

  friend bool operator==(const ContactKeys&, const ContactKeys&) = default;
  friend bool operator<(const ContactKeys& a, const ContactKeys& b) {
    return a.first != b.first ? a.first < b.first : a.second < b.second;
  }
};

/// Two bodies, or a body and a boundary, that touch. Named by ids, so that it is recognised in the next step
/// whatever the bodies' indices are by then; lists are sorted by keys().
template <Real Scalar>
struct Contact {
  std::uint32_t first;        ///< index of the body of the smaller id
  std::uint32_t second;       ///< index of the other, or `staticPartner`
  std::uint64_t key1;         ///< id of the first
  std::uint64_t key2;         ///< id of the second, or `boundaryKey(number)`
  Vector3<Scalar> normal;     ///< unit vector from the first to the second
  Scalar gap;                 ///< [m] between the surfaces, < 0 is overlap
  Scalar arm1;                ///< [m] centre of the first to the contact along the normal
  Scalar arm2;                ///< [m] contact to the centre of the second
  std::uint32_t surface = 0;  ///< number of its surface in the list (contact/contact_list.hpp)

  ContactKeys keys() const { return {key1, key2}; }
};

/// The order of lists of what has keys().
inline constexpr auto byKeys = [](const auto& a, const auto& b) { return a.keys() < b.keys(); };

/// A contact as it is recognised: its keys, and the indices that its bodies have now.
struct ContactName {
  ContactKeys keys;
  std::uint32_t first;
  std::uint32_t second;  ///< or `staticPartner`

  template <Real S>
  static ContactName of(const Contact<S>& c) {
    return {c.keys(), c.first, c.second};
  }
  friend bool operator==(const ContactName&, const ContactName&) = default;
};

/// Where these keys are, or would be, in a list in their order.
inline auto placeOf(std::span<const ContactName> names, const ContactKeys& keys) {
  return std::lower_bound(
      names.begin(), names.end(), keys,
      [](const ContactName& name, const ContactKeys& wanted) { return name.keys < wanted; });
}

/// The same, the sooner the less far it is behind `from`.
inline auto placeOf(std::span<const ContactName> names, const ContactKeys& keys, std::size_t from) {
  if (from > names.size() || (from > 0 && !(names[from - 1].keys < keys))) {
    return placeOf(names, keys);
  }
  for (std::size_t step = 0; step < 8; ++step, ++from) {
    if (from == names.size() || !(names[from].keys < keys)) {
      return names.begin() + static_cast<std::ptrdiff_t>(from);
    }
  }
  std::size_t step = 8;
  for (; from + step < names.size() && names[from + step].keys < keys; step *= 2) {
    from += step;
  }
  const std::span<const ContactName> near = names.subspan(from, std::min(step, names.size() - from));
  return names.begin() + static_cast<std::ptrdiff_t>(from) + (placeOf(near, keys) - near.begin());
}

/// A boundary: n.x >= offset is free.
template <Real Scalar>
struct HalfSpace {
  Vector3<Scalar> normal;  ///< unit vector into the free side
  Scalar offset;           ///< [m]
  Material<Scalar> material{};
  Vector3<Scalar> velocity = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));  ///< [m s^-1] of its matter
  std::uint64_t number = 0;                                ///< by which its contacts are recognised
  std::uint32_t surface = MaterialView<Scalar>::unlisted;  ///< number of its material, if it is an entry
  Scalar swing = Scalar(0);  ///< [m s^-1] by which it grows along n from the middle of a drift to its end
};

/// Where two surfaces stand: normal from 1 to 2, gap < 0 for overlap, arms from the centres.
template <Real Scalar>
struct Touch {
  Vector3<Scalar> normal;
  Scalar distance;
  Scalar gap;
  Scalar arm1;
  Scalar arm2;
};

namespace detail {

/// A direction for two centres at one point: a function of the two ids, reversed when they are exchanged.
template <Real Scalar>
Vector3<Scalar> directionOfIds(std::uint64_t id1, std::uint64_t id2) {
  const std::uint64_t low = id1 < id2 ? id1 : id2;
  const std::uint64_t high = id1 < id2 ? id2 : id1;
  const Vector3<double> d = CounterRandom(low, high).direction(0);
  const Vector3<Scalar> n = safeUnit(Vector3<Scalar>(Scalar(d[0]), Scalar(d[1]), Scalar(d[2])));
  return id1 <= id2 ? n : Vector3<Scalar>(-n);
}

}  // namespace detail

/// Two spheres with the separation r_12 = x2 - x1 of length `distance` and the sum of radii `reach` > 0.
template <Real Scalar>
[[gnu::always_inline]] inline Touch<Scalar> touchAt(const Vector3<Scalar>& r_12, const Scalar& distance,
                                                    const Scalar& r1, const Scalar& reach, std::uint64_t id1,
                                                    std::uint64_t id2, const Scalar& epsilon) {
  const Scalar near = std::min(epsilon, Scalar(Scalar(16) * detail::roundoff<Scalar>() * reach));
  const bool coincident = !(distance > Scalar(0)) || distance <= near;
  const Scalar arm1 = distance * (r1 / reach);
  return Touch<Scalar>{
      coincident ? detail::directionOfIds<Scalar>(id1, id2) : detail::safeUnit(r_12, distance), distance,
      distance - reach, arm1, distance - arm1};
}

/// Two spheres with the separation r_12 = x2 - x1; nothing unless |r_12| < r1 + r2 + margin. The arms share
/// the distance in proportion of the radii: arm1 + arm2 = |r_12| keeps the angular momentum of a blow to
/// rounding. Where the centres fall together (at most epsilon apart, and no more than the rounding of the
/// radii) the normal is a function of the two ids.
template <Real Scalar>
std::optional<Touch<Scalar>> sphereSphere(const Vector3<Scalar>& r_12, const Scalar& r1, const Scalar& r2,
                                          std::uint64_t id1, std::uint64_t id2, const Scalar& epsilon,
                                          const Scalar& margin = Scalar(0)) {
  const Scalar reach = r1 + r2;
  const Scalar distance = detail::safeNorm(r_12);
  if (!(reach > Scalar(0)) || !(distance < reach + margin)) {
    return std::nullopt;
  }
  return touchAt(r_12, distance, r1, reach, id1, id2, epsilon);
}

/// A sphere and a half-space; nothing unless the gap is below margin. The arm is the radius. A centre deep
/// inside is pushed out all the same.
template <Real Scalar>
std::optional<Touch<Scalar>> sphereHalfSpace(const Vector3<Scalar>& x, const Scalar& radius,
                                             const Vector3<Scalar>& normal, const Scalar& offset,
                                             const Scalar& margin = Scalar(0)) {
  const Scalar distance = normal.dot(x) - offset;
  if (!(radius > Scalar(0)) || !(distance < radius + margin)) {
    return std::nullopt;
  }
  return Touch<Scalar>{Vector3<Scalar>(-normal), distance, distance - radius, radius, Scalar(0)};
}

}  // namespace gravel
