#pragma once

/// \file
/// A patch of a planet's ring of equal, smooth spheres without gravity of their own, and what is measured of
/// it. Units: radius 1, orbital frequency 1.

#include "scenes/blows.hpp"
#include "scenes/scenes.hpp"

namespace gravel::scenes {

struct RingOptions {
  std::size_t count = 500;
  double opticalDepth = 0.5;  ///< cross-sections of all bodies over the area of the patch
  double restitution = 0.5;
  double timeStep = 2.0 * 3.14159265358979323846 / 500.0;
  std::uint64_t seed = 1;
};

/// Side of the square patch.
inline double ringSide(const RingOptions& options) {
  return std::sqrt(static_cast<double>(options.count) * pi<double>() / options.opticalDepth);
}

/// The patch with its bodies on a jittered lattice, moving with the flow and 1 rms besides along each axis.
/// On the mean they have no height, and no velocity but the flow's.
inline Space<double> ringPatch(const RingOptions& options) {
  SimulationConfig<double> config;
  config.G = 0.0;
  config.timeStep = options.timeStep;
  config.adaptiveTimeStep = false;
  config.integrator = IntegratorKind::SymplecticEpicycle;
  config.coeffRestitution = options.restitution;
  config.coeffFriction = config.coeffStaticFriction = 0.0;
  Space<double> space(config);
  const double side = ringSide(options);
  const double height = 6.0 * std::max(1.0, options.opticalDepth);  // at most a quarter of it filled
  space.setDomain(Domain<double>::shearPeriodic({side, side, 60.0 + height}, 1.0));
  const double spacing = std::cbrt(side * side * height / static_cast<double>(options.count));
  const auto row = static_cast<std::size_t>(std::ceil(side / spacing));
  const double gap = side / static_cast<double>(row);
  const std::size_t layers = (options.count + row * row - 1) / (row * row);
  Sequence random(options.seed);
  std::vector<Body<double>> bodies;
  Vector3<double> drift = Vector3<double>::Zero();
  double height0 = 0.0;
  for (std::size_t i = 0; i < options.count; ++i) {
    Body<double> body;
    body.radius = 1.0;
    const auto along = [&](std::size_t k, std::size_t n, double step) {
      return (static_cast<double>(k) + 0.5 - 0.5 * static_cast<double>(n)) * step +
             random.uniform(-0.45, 0.45) * std::max(0.0, step - 2.0);
    };
    body.position = {along(i % row, row, gap), along(i / row % row, row, gap),
                     along(i / (row * row), layers, std::max(spacing, 2.2))};
    body.velocity = random.normalVector();
    bodies.push_back(body);
    drift += body.velocity / static_cast<double>(options.count);
    height0 += body.position[2] / static_cast<double>(options.count);
  }
  for (Body<double>& body : bodies) {  // collisions would never damp an epicycle of the whole patch
    body.velocity -= drift;
    body.velocity[1] -= 1.5 * body.position[0];
    body.position[2] -= height0;
    space.addBody(body);
  }
  return space;
}

/// Averages over the samples taken, each after one step.
class RingStatistics {
 public:
  /// Bodies see the patch as it is now; contacts and impulses as the last step made them.
  void sample(const Space<double>& space) {
    ++samples_;
    bodies_ = static_cast<double>(space.n());
    const Vector3<double> box = space.domain().lengths();
    double plane = 0.0;
    for (std::size_t i = 0; i < space.n(); ++i) {
      const auto body = space.body(i);
      const double r = body.radius();
      const double z = body.position()[2];
      Vector3<double> v = body.velocity();
      v[1] += 1.5 * body.position()[0];
      squares_ += v.cwiseAbs2();
      product_ += v[0] * v[1];
      plane += std::max(0.0, r * r - z * z);
    }
    filling_ += pi<double>() * plane / (box[0] * box[1]);
    forEachBlow(space, [&](std::size_t first, std::size_t, const Vector3<double>& normal, double distance,
                           double impulse) {
      hits_ += 1.0;
      // Momentum along the orbit, carried outward over the distance of the centres.
      flux_ += impulse * normal[1] * distance * normal[0] / static_cast<double>(space.body(first).mass());
    });
    time_ += space.getPreviousTimeStep();
  }

  /// Velocity dispersion along each axis, in R Omega; c() is the root of a third of the sum of squares.
  Vector3<double> dispersion() const { return (squares_ / (bodies_ * samples_)).cwiseSqrt(); }
  double c() const { return std::sqrt(squares_.sum() / (3.0 * bodies_ * samples_)); }
  /// Share of the plane z = 0 that is inside of bodies.
  double filling() const { return filling_ / samples_; }
  /// Kinematic viscosities, in R^2 Omega: by motion and by collisions (Wisdom & Tremaine 1988, AJ 95, 925).
  double translationalViscosity() const { return 2.0 / 3.0 * product_ / (bodies_ * samples_); }
  double collisionalViscosity() const { return 2.0 / 3.0 * flux_ / (bodies_ * time_); }
  double viscosity() const { return translationalViscosity() + collisionalViscosity(); }
  /// Blows a body takes an orbit.
  double hits() const { return 2.0 * hits_ / bodies_ / (time_ / (2.0 * pi<double>())); }
  double time() const { return time_; }

 private:
  double samples_ = 0.0, bodies_ = 0.0, product_ = 0.0, filling_ = 0.0, hits_ = 0.0, flux_ = 0.0, time_ = 0.0;
  Vector3<double> squares_ = Vector3<double>::Zero();
};

}  // namespace gravel::scenes
