#pragma once

/// \file
/// Boxes of equal spheres that the comparisons share: a pile under gravity, an elastic gas; and the errors of
/// a heap that should rest.

#include "scenes/scenes.hpp"
#include <gravel/gravel.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

namespace boxes {

using Vec = gravel::Vector3<double>;

constexpr double radius = 0.5;
constexpr double g = 9.81;

/// What every method and engine simulates. The box stands on z = 0, its middle at x = y = 0.
struct Scene {
  std::vector<gravel::Body<double>> bodies;
  double width = 0;    ///< of the box
  double height = -1;  ///< of its lid; none if negative
  double g = 0;
  double e = 0;
  double mu = 0;
  double spinning = 0;       ///< coefficient of spinning friction
  bool smoothSides = false;  ///< no friction at upright walls
  double h = 1.0 / 60;       ///< step

  /// Half-spaces: inward normals and offsets.
  std::vector<std::pair<Vec, double>> planes() const {
    std::vector<std::pair<Vec, double>> all{{{0, 0, 1}, 0}};
    for (const double s : {-1.0, 1.0}) {
      all.push_back({{s, 0, 0}, -width / 2});
      all.push_back({{0, s, 0}, -width / 2});
    }
    if (height > 0) {
      all.push_back({{0, 0, -1}, -height});
    }
    return all;
  }
};

/// Spheres of mass 1 that fall from a loose lattice onto the floor.
inline Scene pile(std::size_t n, double e, double spinning = 0) {
  Scene scene;
  const auto side = static_cast<std::size_t>(std::cbrt(static_cast<double>(n)) + 0.5);
  scene.width = 1.1 * static_cast<double>(side) * 2 * radius;
  scene.g = g;
  scene.e = e;
  scene.mu = 0.5;
  scene.spinning = spinning;
  const double spacing = scene.width / static_cast<double>(side);
  const gravel::CounterRandom random(1);
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = [&](std::size_t k, std::uint64_t axis) {
      return (static_cast<double>(k) + 0.5) * spacing - scene.width / 2 +
             random.uniform(3 * i + axis, -0.04, 0.04);
    };
    gravel::Body<double> grain;
    grain.radius = radius;
    grain.mass = 1;
    grain.position = {at(i % side, 0), at(i / side % side, 1),
                      radius + 0.04 + static_cast<double>(i / (side * side)) * 2.2 * radius};
    scene.bodies.push_back(grain);
  }
  return scene;
}

/// Elastic and frictionless at volume fraction 0.2; a sphere moves 0.01 of its diameter a step.
inline Scene gas(std::size_t n) {
  Scene scene;
  scene.e = 1;
  scene.width = gravel::scenes::gasBoxLength(n, 0.2) + 2 * radius;
  scene.height = scene.width;
  double speed_sq = 0;
  // Apart in a periodic box: all the more in this one.
  for (gravel::Body<double> body : gravel::scenes::randomGas<double>(n, 0.2)) {
    body.position[2] += scene.width / 2;
    speed_sq += body.velocity.squaredNorm() / static_cast<double>(n);
    scene.bodies.push_back(body);
  }
  scene.h = 0.01 * 2 * radius / std::sqrt(speed_sq);
  return scene;
}

/// The scene in a space of its own.
template <class S>
gravel::Space<S> spaceOf(const Scene& scene, gravel::SimulationConfig<S> config) {
  config.G = 0;
  config.timeStep = static_cast<S>(scene.h);
  config.adaptiveTimeStep = false;
  config.coeffRestitution = static_cast<S>(scene.e);
  config.coeffFriction = config.coeffStaticFriction = static_cast<S>(scene.mu);
  config.spinningFriction = static_cast<S>(scene.spinning);
  gravel::Space<S> space(config);
  const gravel::MaterialId smooth = space.addMaterial({.staticFriction = S(0), .kineticFriction = S(0)});
  for (const auto& [normal, offset] : scene.planes()) {
    space.addPlane(normal.template cast<S>(), static_cast<S>(offset),
                   scene.smoothSides && normal[2] == 0 ? smooth : gravel::defaultMaterial);
  }
  space.setUniformField({0, 0, static_cast<S>(-scene.g)});
  space.reserve(scene.bodies.size());
  for (const gravel::Body<double>& body : scene.bodies) {
    gravel::Body<S> same;
    same.position = body.position.template cast<S>();
    same.velocity = body.velocity.template cast<S>();
    same.mass = static_cast<S>(body.mass);
    same.radius = static_cast<S>(body.radius);
    space.addBody(same);
  }
  return space;
}

struct Errors {
  double meanOverlap = 0;     ///< over the smaller radius, of all contacts
  double largestOverlap = 0;  ///< the same
  double kinetic = 0;         ///< over sum m g R, with spins
  double moving = 0;          ///< the same of centres alone: nothing stops a ball that spins on its pole
};

template <class S>
double kineticEnergy(const gravel::Space<S>& space) {
  const auto energy = space.calculateSystemEnergy();
  return static_cast<double>(std::get<0>(energy)) + static_cast<double>(std::get<1>(energy));
}

template <class S>
Errors errorsOf(const gravel::Space<S>& space) {
  Errors errors;
  const auto radii = [&](std::uint32_t i) { return static_cast<double>(space.bodies().radii()[i]); };
  for (const gravel::Contact<S>& c : space.contacts()) {
    const double overlap = std::max(0.0, static_cast<double>(-c.gap));
    double r = radii(c.first);
    if (c.second != gravel::staticPartner) {
      r = std::min(r, radii(c.second));
    }
    errors.meanOverlap += overlap / r / static_cast<double>(space.contacts().size());
    errors.largestOverlap = std::max(errors.largestOverlap, overlap / r);
  }
  double scale = 0;
  for (std::size_t i = 0; i < space.n(); ++i) {
    scale += static_cast<double>(space.body(i).mass()) * g * radii(static_cast<std::uint32_t>(i));
  }
  errors.kinetic = kineticEnergy(space) / scale;
  errors.moving = static_cast<double>(std::get<0>(space.calculateSystemEnergy())) / scale;
  return errors;
}

inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// The number given as argument i. Options of other benchmarks, "--...", end the list.
inline std::size_t argument(int argc, char** argv, int i, std::size_t otherwise, std::size_t least = 1) {
  const bool given = argc > i && argv[i][0] != '-';
  return given ? std::max<std::size_t>(least, std::strtoul(argv[i], nullptr, 10)) : otherwise;
}

}  // namespace boxes
