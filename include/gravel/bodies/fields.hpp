#pragma once

/// \file
/// The one list of what a body has. Storages, copies, snapshots and tests are made from it: a new field is
/// one struct and one entry here.

#include <gravel/core/types.hpp>

namespace gravel {

/// Index of a material in the space's table; `defaultMaterial` is the space's own coefficients.
enum class MaterialId : std::uint32_t {};
inline constexpr MaterialId defaultMaterial{0};

namespace fields {

// Fields of `width` Scalars.
struct Position {  // [m]
  static constexpr const char* name = "position";
  static constexpr int width = 3;
};
struct Velocity {  // [m s^-1]
  static constexpr const char* name = "velocity";
  static constexpr int width = 3;
};
struct AngularVelocity {  // [rad s^-1], in the axes of space
  static constexpr const char* name = "angularVelocity";
  static constexpr int width = 3;
};
struct Orientation {  // unit quaternion x y z w, body to space
  static constexpr const char* name = "orientation";
  static constexpr int width = 4;
};
struct Force {  // [N], of the last force evaluation: gravity, fields and the user's force
  static constexpr const char* name = "force";
  static constexpr int width = 3;
};
struct Torque {  // [N m], of the last force evaluation
  static constexpr const char* name = "torque";
  static constexpr int width = 3;
};
struct Acceleration {  // [m s^-2]; also what a massless tracer feels
  static constexpr const char* name = "acceleration";
  static constexpr int width = 3;
};
struct AngularAcceleration {  // [rad s^-2]
  static constexpr const char* name = "angularAcceleration";
  static constexpr int width = 3;
};
struct Mass {  // [kg]
  static constexpr const char* name = "mass";
  static constexpr int width = 1;
};
struct Radius {  // [m]
  static constexpr const char* name = "radius";
  static constexpr int width = 1;
};
struct InertiaFactor {  // [1], k in I = k m r^2; 2/5 for a homogeneous sphere
  static constexpr const char* name = "inertiaFactor";
  static constexpr int width = 1;
};

// Integer fields.
struct Id {
  static constexpr const char* name = "id";
  using Integer = std::uint64_t;
};
struct Material {
  static constexpr const char* name = "material";
  using Integer = std::uint32_t;
};
struct Flags {  // bits of BodyFlag
  static constexpr const char* name = "flags";
  using Integer = std::uint32_t;
};

}  // namespace fields

/// Bits of the flags field.
enum class BodyFlag : std::uint32_t {
  Fixed = 1U,
  Asleep = 2U,  ///< at rest until something wakes it; set by the space alone
};

/// Either of them: neither forces nor contacts move the body now.
inline constexpr std::uint32_t heldFlags =
    static_cast<std::uint32_t>(BodyFlag::Fixed) | static_cast<std::uint32_t>(BodyFlag::Asleep);

template <class... Fields>
struct FieldList {
  static constexpr int columns = (Fields::width + ... + 0);

  /// First column of field F: the widths of those before it.
  template <class F>
  static constexpr int firstColumn() {
    static_assert(
        (std::is_same_v<F, Fields> || ...),
        "gravel: gravel's own storages hold the fields of gravel::RealFields only, see docs/concepts.md");
    int column = 0;
    bool found = false;
    ((found = found || std::is_same_v<F, Fields>, column += found ? 0 : Fields::width), ...);
    return column;
  }

  template <class Visitor>
  static constexpr void forEach(Visitor&& visit) {
    (visit(Fields{}), ...);
  }
};

template <class... Fields>
struct IntegerFieldList {
  template <class Visitor>
  static constexpr void forEach(Visitor&& visit) {
    (visit(Fields{}), ...);
  }
};

using RealFields = FieldList<fields::Position, fields::Velocity, fields::AngularVelocity, fields::Orientation,
                             fields::Force, fields::Torque, fields::Acceleration, fields::AngularAcceleration,
                             fields::Mass, fields::Radius, fields::InertiaFactor>;

using IntegerFields = IntegerFieldList<fields::Id, fields::Material, fields::Flags>;

template <class F>
concept RealField = requires {
  F::width;
};

template <class F>
concept IntegerField = requires {
  typename F::Integer;
};

/// Every field, real ones first.
template <class Visitor>
constexpr void forEachField(Visitor&& visit) {
  RealFields::forEach(visit);
  IntegerFields::forEach(visit);
}

}  // namespace gravel
