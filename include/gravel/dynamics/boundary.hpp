#pragma once

/// \file
/// Boundaries: planes and boxes made of them, at rest or moving.

#include <gravel/bodies/fields.hpp>
#include <gravel/core/check.hpp>

#include <algorithm>
#include <string>
#include <vector>

namespace gravel {

/// A part of a step, in shares of the step: what has passed in its middle, and how long it is.
template <Real Scalar>
struct PartOfStep {
  Scalar middle = Scalar(0.5);
  Scalar length = Scalar(1);
};

/// The half-space n.x >= offset is free; bodies rest on its face. n has unit length. The material is looked
/// up when contacts are made, so that it may change.
template <Real Scalar>
struct Plane {
  Vector3<Scalar> normal;
  Scalar offset;  ///< [m]
  MaterialId material = defaultMaterial;
  /// [m s^-1] of the plane's matter. Its part along n moves the plane; the part across n drags what rubs on
  /// it along, as a conveyor belt does.
  Vector3<Scalar> velocity = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));
  Vector3<Scalar> velocityBefore = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));  ///< in the last step
  std::size_t number = 0;  ///< its own among the boundaries of a space, never given twice
  /// [m s^-1] along n, by which the velocity grew through the last step: its acceleration then, times that
  /// step.
  Scalar changeBefore = Scalar(0);
  Scalar pace = Scalar(1);  ///< length of this step over that of the last one

  /// Whether it moves in this step as it did at the last one's end.
  bool isSteady() const { return velocity == velocityBefore && changeBefore == Scalar(0); }

  /// [m s^-1] along n, by which the velocity V grows from the middle of the step to its end if the change
  /// from the middle of the last one goes on evenly: (V - V_before) h/(h + h_before), half of it in steps
  /// that are alike.
  Scalar evenSwing() const {
    return normal.dot(Vector3<Scalar>(velocity - velocityBefore)) * (pace / (Scalar(1) + pace));
  }

  /// The same, but by no more than twice the acceleration of the step before gives, and none against it. So
  /// what goes on is followed, and one sudden change is a blow at the step's start. (A limiter of slopes: van
  /// Leer 1977, J. Comput. Phys. 23, 276.)
  Scalar swing() const {
    const Scalar limit = changeBefore * pace;
    const Scalar least = std::min<Scalar>(Scalar(0), limit);
    const Scalar most = std::max<Scalar>(Scalar(0), limit);
    return std::min<Scalar>(std::max<Scalar>(evenSwing(), least), most);
  }

  /// [m s^-1] when a share (0 to 1) of the step has passed. Across n it changes evenly to `velocity`:
  /// friction has a weight of as much of the step to follow it with. Along n it changes by `swing()` about
  /// `velocity`, which is that of the step's middle and its mean: what rests on the plane then has the
  /// velocity of the path at the ends of steps, and gets half of a step's change at its start and half at its
  /// end, as of its weight.
  Vector3<Scalar> velocityAt(const Scalar& share) const {
    const Vector3<Scalar> change = velocity - velocityBefore;
    const Vector3<Scalar> across =
        velocity - (Scalar(1) - share) * Vector3<Scalar>(change - normal.dot(change) * normal);
    return across + (Scalar(2) * share - Scalar(1)) * swing() * normal;
  }
};

/// \param normal of any length but zero; `offset` is measured along the normal made unit
/// \throws std::invalid_argument if the normal is zero or a value is not finite
template <Real Scalar>
Plane<Scalar> makePlane(const Vector3<Scalar>& normal, const Scalar& offset,
                        MaterialId material = defaultMaterial) {
  const Vector3<Scalar> n = normal.stableNormalized();
  if (!isFinite(normal) || !isFinite(n) || !(n.squaredNorm() > Scalar(0))) {
    detail::refuse("normal of the plane", detail::formatVector(normal), "finite and not zero");
  }
  detail::require("offset of the plane", offset, detail::anyFinite<Scalar>());
  return {n, offset, material};
}

/// Faces of a box; join them by |.
enum class BoxFaces : std::uint8_t {
  None = 0,
  LowX = 1,
  HighX = 2,
  LowY = 4,
  HighY = 8,
  LowZ = 16,
  HighZ = 32,
};
constexpr BoxFaces operator|(BoxFaces a, BoxFaces b) {
  return static_cast<BoxFaces>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}

/// The faces of the box from `low` to `high`, looking inwards, without those that are open; in the order low
/// x, high x, low y, high y, low z, high z.
/// \throws std::invalid_argument unless low < high along every axis, all finite
template <Real Scalar>
std::vector<Plane<Scalar>> makeBox(const Vector3<Scalar>& low, const Vector3<Scalar>& high,
                                   MaterialId material = defaultMaterial, BoxFaces open = BoxFaces::None) {
  if (!isFinite(low) || !isFinite(high) || !(low.array() < high.array()).all()) {
    detail::refuse("box", "from " + detail::formatVector(low) + " to " + detail::formatVector(high),
                   "finite, low below high along every axis");
  }
  if (static_cast<unsigned>(open) >= 64U) {
    detail::refuse("open faces of the box", std::to_string(static_cast<unsigned>(open)), "of BoxFaces");
  }
  std::vector<Plane<Scalar>> planes;
  for (unsigned face = 0; face < 6; ++face) {
    if ((static_cast<unsigned>(open) >> face & 1U) == 0) {
      const auto axis = static_cast<Eigen::Index>(face / 2);
      const bool upper = face % 2 == 1;
      const Vector3<Scalar> n = Vector3<Scalar>::Unit(axis) * Scalar(upper ? -1 : 1);
      planes.push_back({n, upper ? Scalar(-high[axis]) : Scalar(low[axis]), material});
    }
  }
  return planes;
}

/// The planes of a space, in the order of their numbers.
template <Real Scalar>
class Boundaries {
 public:
  const std::vector<Plane<Scalar>>& planes() const { return planes_; }
  bool empty() const { return planes_.empty(); }
  /// The number that the next plane gets.
  std::size_t next() const { return next_; }
  /// Planes of this number and above have been through no step yet.
  std::size_t firstNew() const { return firstNew_; }

  /// For so many more planes.
  void makeRoom(std::size_t more) { planes_.reserve(planes_.size() + more); }

  /// \return the plane's number
  std::size_t add(Plane<Scalar> plane) {
    plane.number = next_;
    planes_.push_back(plane);
    return next_++;
  }

  /// Takes over planes with their numbers, in increasing order and below `next`.
  void assign(std::vector<Plane<Scalar>> planes, std::size_t next, std::size_t firstNew) {
    planes_ = std::move(planes);
    next_ = next;
    firstNew_ = firstNew;
  }

  /// \throws std::out_of_range if there is no plane of that number
  const Plane<Scalar>& at(std::size_t number) const { return planes_[indexOf(number)]; }

  void remove(std::size_t number) {
    planes_.erase(planes_.begin() + static_cast<std::ptrdiff_t>(indexOf(number)));
  }

  /// Its place among planes(), or how many they are if none has that number. O(log planes).
  std::size_t find(std::size_t number) const {
    const auto before = [&](const Plane<Scalar>& plane) { return plane.number < number; };
    const auto place = std::partition_point(planes_.begin(), planes_.end(), before);
    const bool found = place != planes_.end() && place->number == number;
    return found ? static_cast<std::size_t>(place - planes_.begin()) : planes_.size();
  }

  /// What a new plane is given it has from the start; others get there within the next step.
  /// \throws std::invalid_argument for a velocity that is not finite; std::out_of_range as above
  void setVelocity(std::size_t number, const Vector3<Scalar>& velocity) {
    Plane<Scalar>& plane = planes_[indexOf(number)];
    if (!isFinite(velocity)) {
      detail::refuse("velocity of plane " + std::to_string(number), detail::formatVector(velocity), "finite");
    }
    plane.velocity = velocity;
    if (number >= firstNew_) {
      plane.velocityBefore = velocity;
    }
  }

  /// A step of h [s] begins, after one of `before`, 0 if there was none.
  void beginStep(const Scalar& h, const Scalar& before) {
    for (Plane<Scalar>& plane : planes_) {
      plane.pace = before > Scalar(0) ? Scalar(h / before) : Scalar(1);
    }
  }

  /// Moves every plane by its velocity over h [s], in the middle of which a share of the step has passed.
  void advance(const Scalar& h, const Scalar& share = Scalar(0.5)) {
    for (Plane<Scalar>& plane : planes_) {
      const Scalar more = (Scalar(2) * share - Scalar(1)) * plane.swing();
      plane.offset += (plane.normal.dot(plane.velocity) + more) * h;
    }
  }

  /// A step is over, in which all have come to their velocities.
  void endStep() {
    for (Plane<Scalar>& plane : planes_) {
      plane.changeBefore = Scalar(2) * plane.evenSwing();
      plane.velocityBefore = plane.velocity;
      plane.pace = Scalar(1);
    }
    firstNew_ = next_;
  }

 private:
  std::size_t indexOf(std::size_t number) const {
    const std::size_t place = find(number);
    if (place == planes_.size()) {
      throw std::out_of_range("gravel: no plane has the number " + std::to_string(number));
    }
    return place;
  }

  std::vector<Plane<Scalar>> planes_;
  std::size_t next_ = 0;
  std::size_t firstNew_ = 0;
};

}  // namespace gravel
