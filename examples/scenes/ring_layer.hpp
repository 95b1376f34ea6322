#pragma once

/// \file
/// Bodies that fill a patch of a planet's ring.

#include "scenes/scenes.hpp"

namespace gravel::scenes {

struct RingLayerOptions {
  double opticalDepth = 0.5;  ///< cross-sections of all bodies over the area of the patch
  std::uint64_t seed = 1;
  std::array<double, 2> bodyRadius{1.0, 1.0};   ///< [m] smallest and largest body
  double sizeExponent = 3.0;                    ///< a share r^-exponent of the bodies is larger than r
  std::array<double, 2> density{900.0, 900.0};  ///< [kg m^-3]
  double height = 8.0;                          ///< [m] of the layer in which centres are drawn
  double velocityDispersion = 0.0;              ///< [m s^-1] per axis
};

/// A layer that is not filled by more than a sixth.
inline double looseHeight(double opticalDepth, double largestRadius) {
  return 8.0 * largestRadius * std::max(1.0, opticalDepth);
}

/// Spheres at random places of a patch, about the middle plane, none overlapping another, also across its
/// edges. Their centre of mass has no height, and velocities, which are those beside the flow, no mean.
/// \throws std::invalid_argument for more than 2^32 - 2 of them, or where there is no room
template <Real S = double>
std::vector<Body<S>> ringLayer(const RingLayerOptions& options, double lengthX, double lengthY) {
  const double area = options.opticalDepth * lengthX * lengthY;
  const double smallest = options.bodyRadius[0];
  if (!(area / (pi<double>() * smallest * smallest) < 4294967294.0)) {
    throw std::invalid_argument("scene: such a ring can have more than 2^32 - 2 bodies in its patch");
  }
  Sequence place(options.seed, 0), size(options.seed, 1), motion(options.seed, 2);
  Placement placement(options.bodyRadius[1], {lengthX, lengthY, 0.0});
  std::vector<Body<S>> bodies;
  double mass = 0.0, filled = 0.0, height = 0.0;
  Vector3<double> drift = Vector3<double>::Zero();
  while (filled < area) {
    const double r = powerLawRadius(size, options.bodyRadius[0], options.bodyRadius[1], options.sizeExponent);
    const double m =
        size.uniform(options.density[0], options.density[1]) * 4.0 / 3.0 * pi<double>() * r * r * r;
    const Vector3<double> x = placement.add(r, [&] {
      const double a = place.uniform(-0.5, 0.5), b = place.uniform(-0.5, 0.5), c = place.uniform(-0.5, 0.5);
      return Vector3<double>(lengthX * a, lengthY * b, options.height * c);
    });
    const Vector3<double> v = options.velocityDispersion * motion.normalVector();
    Body<S> body;
    body.position = x.cast<S>();
    body.velocity = v.cast<S>();
    body.radius = S(r);
    body.mass = S(m);
    bodies.push_back(body);
    filled += pi<double>() * r * r;
    mass += m;
    height += m * x[2];
    drift += m * v;
  }
  const Vector3<double> mean = drift / mass;
  for (Body<S>& body : bodies) {  // collisions would never damp an oscillation of the whole layer
    body.position[2] -= S(height / mass);
    body.velocity -= mean.cast<S>();
  }
  return bodies;
}

}  // namespace gravel::scenes
