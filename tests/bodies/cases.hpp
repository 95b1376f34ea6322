#pragma once

/// Every storage in one of the built-in scalars, and values that tell each coefficient of each
/// body from any other.

#include "support/archetypes.hpp"
#include "support/catch.hpp"
#include <gravel/bodies/bodies.hpp>

#include <string>
#include <tuple>

namespace gravel::test {

/// Empty bodies in a layout of gravel's.
template <class S, class Layout>
struct Case {
  using Scalar = S;
  Bodies<S, Layout> bodies;
};

template <class S>
struct Case<S, MinimalStorage<S>> {
  using Scalar = S;
  Bodies<S, MinimalStorage<S>> bodies{MinimalStorage<S>(typename MinimalStorage<S>::None{})};
};

template <class S>
struct Case<S, ParticleStorage<S>> {
  using Scalar = S;
  std::vector<Particle<S>> particles;
  Bodies<S, ParticleStorage<S>> bodies{ParticleStorage<S>(particles)};
};

template <class S>
struct Case<S, BoundStorage<S>> {
  using Scalar = S;
  std::vector<Vector3<S>> positions;
  Bodies<S, BoundStorage<S>> bodies{BoundStorage<S>(positions)};
};

/// Each layout, and each scalar. Not each with each: no code depends on both.
using AllCases =
    std::tuple<Case<double, SoA>, Case<double, AoSoA<8>>, Case<double, AoSoA<16>>,
               Case<double, MinimalStorage<double>>, Case<double, BoundStorage<double>>,
               Case<float, AoSoA<4>>, Case<float, ParticleStorage<float>>, Case<long double, AoS>>;

/// A whole number for coefficient c of field f of the body with this tag; exact in a float for tags up to
/// 2^17.
inline int coded(int tag, int field, int c) { return 1 + 64 * tag + 4 * field + c; }

/// Writes a different number into every field of body i but its id.
template <class Storage>
void writeCoded(Storage& storage, std::size_t i, int tag) {
  using S = typename Storage::Scalar;
  int field = 0;
  forEachField([&]<class F>(F f) {
    const auto value = [&](int c) { return S(coded(tag, field, c)); };
    if constexpr (IntegerField<F>) {
      if constexpr (!std::is_same_v<F, fields::Id>) {
        storage.at(f, i) = static_cast<typename F::Integer>(coded(tag, field, 0));
      }
    } else if constexpr (F::width == 1) {
      storage.at(f, i) = value(0);
    } else if constexpr (F::width == 3) {
      storage.at(f, i) = Vector3<S>(value(0), value(1), value(2));
    } else {
      storage.at(f, i) = Quaternion<S>(value(3), value(0), value(1), value(2));
    }
    ++field;
  });
}

/// Name of the first field of body i that does not hold what writeCoded(…, tag) wrote; empty when all do.
template <class Storage>
std::string wrongField(const Storage& storage, std::size_t i, int tag) {
  using S = typename Storage::Scalar;
  std::string wrong;
  int field = 0;
  forEachField([&]<class F>(F f) {
    const auto value = [&](int c) { return S(coded(tag, field, c)); };
    bool same = true;
    if constexpr (IntegerField<F>) {
      if constexpr (!std::is_same_v<F, fields::Id>) {
        same = storage.at(f, i) == static_cast<typename F::Integer>(coded(tag, field, 0));
      }
    } else if constexpr (F::width == 1) {
      same = storage.at(f, i) == value(0);
    } else if constexpr (F::width == 3) {
      same = Vector3<S>(storage.at(f, i)) == Vector3<S>(value(0), value(1), value(2));
    } else {
      const Quaternion<S> q(storage.at(f, i));
      same = q.x() == value(0) && q.y() == value(1) && q.z() == value(2) && q.w() == value(3);
    }
    if (!same && wrong.empty()) {
      wrong = F::name;
    }
    ++field;
  });
  return wrong;
}

/// A body with a value of its own in every member.
template <class S>
Body<S> sampleBody(int tag = 1) {
  Body<S> body;
  const S t = S(tag);
  body.position = {t, t + S(0.25), t + S(0.5)};
  body.velocity = {-t, S(2), S(0.125)};
  body.angularVelocity = {S(3), -t, S(0.75)};
  body.orientation = Quaternion<S>(S(0.5), S(-0.5), S(0.5), S(0.5));  // of norm 1 without rounding
  body.mass = S(2) + t;
  body.radius = S(0.5);
  body.material = MaterialId{static_cast<std::uint32_t>(tag)};
  return body;
}

/// Message of the exception of this type that `call` throws; a text that says so if it throws none.
template <class Exception, class Call>
std::string messageOf(Call&& call) {
  try {
    call();
  } catch (const Exception& e) {
    return e.what();
  }
  return "(nothing was thrown)";
}

}  // namespace gravel::test
