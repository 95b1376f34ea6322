#pragma once

/// \file
/// A body in its storage, seen as one object.

#include <gravel/bodies/body.hpp>
#include <gravel/bodies/storage.hpp>

namespace gravel {

/// Handle of one body: a storage and an index. Fields of several coefficients are views that write through;
/// fields of one are references. Stays valid until bodies are added, removed or reordered. A mutable proxy
/// converts to a const one; there is no assignment, since it could mean two things: use load() and store().
template <BodyStorage Storage, bool IsConst>
class BasicBodyProxy {
 public:
  using Scalar = typename Storage::Scalar;
  using StoragePointer = std::conditional_t<IsConst, const Storage*, Storage*>;

  BasicBodyProxy(StoragePointer storage, std::size_t index) : storage_(storage), index_(index) {}
  BasicBodyProxy(const BasicBodyProxy&) = default;
  BasicBodyProxy& operator=(const BasicBodyProxy&) = delete;

  operator BasicBodyProxy<Storage, true>() const  // NOLINT(google-explicit-constructor)
      requires(!IsConst) {
    return {storage_, index_};
  }

  decltype(auto) position() const { return at(fields::Position{}); }
  decltype(auto) velocity() const { return at(fields::Velocity{}); }
  decltype(auto) angularVelocity() const { return at(fields::AngularVelocity{}); }
  decltype(auto) orientation() const { return at(fields::Orientation{}); }
  decltype(auto) force() const { return at(fields::Force{}); }
  decltype(auto) torque() const { return at(fields::Torque{}); }
  decltype(auto) acceleration() const { return at(fields::Acceleration{}); }
  decltype(auto) angularAcceleration() const { return at(fields::AngularAcceleration{}); }
  decltype(auto) mass() const { return at(fields::Mass{}); }
  decltype(auto) radius() const { return at(fields::Radius{}); }
  decltype(auto) inertiaFactor() const { return at(fields::InertiaFactor{}); }

  BodyId id() const { return BodyId{static_cast<std::uint64_t>(at(fields::Id{}))}; }
  std::size_t index() const { return index_; }
  MaterialId material() const { return MaterialId{static_cast<std::uint32_t>(at(fields::Material{}))}; }
  bool isFixed() const { return (at(fields::Flags{}) & static_cast<std::uint32_t>(BodyFlag::Fixed)) != 0; }
  bool isAsleep() const { return (at(fields::Flags{}) & static_cast<std::uint32_t>(BodyFlag::Asleep)) != 0; }
  /// Fixed or asleep.
  bool isHeld() const { return (at(fields::Flags{}) & heldFlags) != 0; }

  /// [kg m^2] about any axis through the centre: k m r^2.
  Scalar inertia() const {
    const Scalar r = radius();
    return Scalar(Scalar(at(fields::InertiaFactor{})) * Scalar(mass()) * r * r);
  }

  /// [kg^-1]; zero for a fixed body and for a tracer, which no contact moves.
  Scalar inverseMass() const {
    const Scalar m = mass();
    return isFixed() || !(m > Scalar(0)) ? Scalar(0) : Scalar(Scalar(1) / m);
  }

  /// [kg^-1 m^-2]; zero for a fixed body and where the inertia is zero. Out of range where the inertia is.
  Scalar inverseInertia() const {
    const Scalar moment = inertia();
    return isFixed() || !(moment > Scalar(0)) ? Scalar(0) : Scalar(Scalar(1) / moment);
  }

  /// Whether a torque turns it, which a moment of inertia that is no float does not tell: that of a grain of
  /// nanometres, or of a giant planet.
  bool isTurnable() const {
    return !isFixed() && mass() > Scalar(0) && radius() > Scalar(0) &&
           Scalar(at(fields::InertiaFactor{})) > Scalar(0);
  }

  /// [m s^-2] by a force [N], [rad s^-2] by a torque [N m]; zero where they change nothing.
  Vector3<Scalar> accelerationBy(const Vector3<Scalar>& force) const {
    const Scalar share = inverseMass();
    return isFinite(share) ? Vector3<Scalar>(force * share) : Vector3<Scalar>(force / Scalar(mass()));
  }
  Vector3<Scalar> angularAccelerationBy(const Vector3<Scalar>& torque) const {
    const Scalar share = inverseInertia();
    if ((isFinite(share) && share > Scalar(0)) || !isTurnable()) {
      return torque * share;
    }
    const Scalar r = radius();
    return torque / Scalar(Scalar(at(fields::InertiaFactor{})) * Scalar(mass())) / r / r;
  }

  /// [m s^-1], [rad s^-1] as they count: what is written to a fixed body does not move it.
  Vector3<Scalar> countingVelocity() const {
    return isFixed() ? Vector3<Scalar>(Vector3<Scalar>::Zero()) : Vector3<Scalar>(velocity());
  }
  Vector3<Scalar> countingSpin() const {
    return isFixed() ? Vector3<Scalar>(Vector3<Scalar>::Zero()) : Vector3<Scalar>(angularVelocity());
  }
  /// [J], [kg m^2 s^-1] of its spin, as it counts: by the speed of the surface, since m r^2 of a giant planet
  /// is no float.
  Scalar rotationalEnergy() const {
    const Vector3<Scalar> s = Scalar(radius()) * countingSpin();
    return Scalar(at(fields::InertiaFactor{})) * Scalar(mass()) * s.squaredNorm() / Scalar(2);
  }
  Vector3<Scalar> spinMomentum() const {
    const Scalar r = radius();
    return (Scalar(at(fields::InertiaFactor{})) * Scalar(mass()) * r) * Vector3<Scalar>(r * countingSpin());
  }
  /// [J] of its centre and of its spin, as they count.
  Scalar kineticEnergy() const {
    return Scalar(mass()) * Scalar(countingVelocity().squaredNorm()) / Scalar(2) + rotationalEnergy();
  }

  void setMaterial(MaterialId material) const requires(!IsConst) {
    at(fields::Material{}) = static_cast<std::uint32_t>(material);
  }

  /// A body that becomes fixed stops.
  void setFixed(bool fixed) const requires(!IsConst) {
    auto&& flags = at(fields::Flags{});
    const auto bit = static_cast<std::uint32_t>(BodyFlag::Fixed);
    flags = fixed ? flags | bit : flags & ~bit;
    if (fixed) {
      velocity() = Vector3<Scalar>::Zero().eval();
      angularVelocity() = Vector3<Scalar>::Zero().eval();
    }
  }

  /// For the space, which knows what woke it. A body that falls asleep stops.
  void setAsleep(bool asleep) const requires(!IsConst) {
    auto&& flags = at(fields::Flags{});
    const auto bit = static_cast<std::uint32_t>(BodyFlag::Asleep);
    flags = asleep ? flags | bit : flags & ~bit;
    if (asleep) {
      velocity() = Vector3<Scalar>::Zero().eval();
      angularVelocity() = Vector3<Scalar>::Zero().eval();
    }
  }

  /// The body as a value. Its inertia is filled in only where it differs from a homogeneous sphere's; on a
  /// body without mass or radius there is none.
  Body<Scalar> load() const {
    Body<Scalar> body;
    body.position = position();
    body.velocity = velocity();
    body.angularVelocity = angularVelocity();
    body.orientation = Quaternion<Scalar>(orientation());
    body.mass = mass();
    body.radius = radius();
    body.fixed = isFixed();
    if (!(Scalar(at(fields::InertiaFactor{})) == detail::homogeneousFactor<Scalar>()) &&
        !(body.mass == Scalar(0)) && !(body.radius == Scalar(0))) {
      body.inertia = inertia();
    }
    body.material = material();
    return body;
  }

  /// Writes a value over the body; its id stays, and forces and accelerations are those found last. (Cleared,
  /// they would be missing in the next half step of a body that stays where it is.)
  /// \throws std::invalid_argument on a field out of range, with nothing written
  void store(const Body<Scalar>& body) const requires(!IsConst) {
    validate(body, "body " + std::to_string(toInteger(id())));
    const Vector3<Scalar> zero = Vector3<Scalar>::Zero();
    position() = body.position;
    velocity() = body.fixed ? zero : body.velocity;
    angularVelocity() = body.fixed ? zero : body.angularVelocity;
    orientation() = body.orientation.normalized();
    mass() = body.mass;
    radius() = body.radius;
    at(fields::InertiaFactor{}) = detail::inertiaFactor(body);
    at(fields::Flags{}) = body.fixed ? static_cast<std::uint32_t>(BodyFlag::Fixed) : 0U;
    setMaterial(body.material);
  }

  void clearForces() const requires(!IsConst) {
    force() = Vector3<Scalar>::Zero().eval();
    torque() = Vector3<Scalar>::Zero().eval();
    acceleration() = Vector3<Scalar>::Zero().eval();
    angularAcceleration() = Vector3<Scalar>::Zero().eval();
  }

 private:
  template <class F>
  decltype(auto) at(F field) const {
    return storage_->at(field, index_);
  }

  StoragePointer storage_;
  std::size_t index_;
};

}  // namespace gravel
