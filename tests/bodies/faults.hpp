#pragma once

/// Every way in which one member of a body can be out of range.

#include "cases.hpp"

#include <vector>

namespace gravel::test {

template <class S>
struct Fault {
  const char* field;  ///< as the message must name it
  const char* value;  ///< as it must stand in the message
  Body<S> body;
};

template <class S>
std::vector<Fault<S>> faultyBodies() {
  constexpr S nan = std::numeric_limits<S>::quiet_NaN();
  constexpr S infinity = std::numeric_limits<S>::infinity();
  std::vector<Fault<S>> faults;
  const auto add = [&](const char* field, const char* value, auto change) {
    Body<S> body = sampleBody<S>();
    change(body);
    faults.push_back({field, value, body});
  };
  for (int c = 0; c < 3; ++c) {
    add("position", "nan", [=](Body<S>& b) { b.position[c] = nan; });
    add("position", "inf", [=](Body<S>& b) { b.position[c] = infinity; });
    add("velocity", "nan", [=](Body<S>& b) { b.velocity[c] = nan; });
    add("velocity", "-inf", [=](Body<S>& b) { b.velocity[c] = -infinity; });
    add("angularVelocity", "nan", [=](Body<S>& b) { b.angularVelocity[c] = nan; });
    add("angularVelocity", "inf", [=](Body<S>& b) { b.angularVelocity[c] = infinity; });
  }
  for (int c = 0; c < 4; ++c) {
    add("orientation", "nan", [=](Body<S>& b) { b.orientation.coeffs()[c] = nan; });
    add("orientation", "inf", [=](Body<S>& b) { b.orientation.coeffs()[c] = infinity; });
  }
  add("orientation", "(0, 0, 0, 0)", [=](Body<S>& b) { b.orientation.coeffs().setZero(); });
  add("orientation", "e+", [=](Body<S>& b) { b.orientation.w() = std::numeric_limits<S>::max(); });
  add("mass", "nan", [=](Body<S>& b) { b.mass = nan; });
  add("mass", "inf", [=](Body<S>& b) { b.mass = infinity; });
  add("mass", "-0.5", [=](Body<S>& b) { b.mass = S(-0.5); });
  add("mass", "0", [=](Body<S>& b) { b.mass = S(0); });
  add("radius", "nan", [=](Body<S>& b) { b.radius = nan; });
  add("radius", "inf", [=](Body<S>& b) { b.radius = infinity; });
  add("radius", "-0.25", [=](Body<S>& b) { b.radius = S(-0.25); });
  add("inertia", "nan", [=](Body<S>& b) { b.inertia = nan; });
  add("inertia", "inf", [=](Body<S>& b) { b.inertia = infinity; });
  add("inertia", "-2", [=](Body<S>& b) { b.inertia = S(-2); });
  add("inertia", "0", [=](Body<S>& b) { b.inertia = S(0); });
  add("inertia", "3", [=](Body<S>& b) {
    b.inertia = S(3);
    b.radius = S(0);
  });
  return faults;
}

}  // namespace gravel::test
