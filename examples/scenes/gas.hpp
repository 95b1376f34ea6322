#pragma once

/// \file
/// A gas of hard spheres of diameter 1 and mass 1 in a periodic cube, and what is measured of it, beside the
/// formulas for dense gases.

#include "scenes/blows.hpp"
#include "scenes/scenes.hpp"

namespace gravel::scenes {

struct GasOptions {
  std::size_t count = 500;
  double fraction = 0.2;  ///< of the volume that is filled, below 0.3
  double restitution = 1.0;
  double timeStep = 0.01 / 1.7320508075688772;  ///< rms speed times step is 0.01 diameters
  std::uint64_t seed = 1;
};

/// Contact value of the pair distribution, compressibility factor p V/(N kT), and hits a body suffers in unit
/// time at temperature 1 (Carnahan & Starling 1969; Enskog 1922).
inline double gasContactValue(double fraction) {
  return (1.0 - fraction / 2.0) / std::pow(1.0 - fraction, 3);
}
inline double gasCompressibility(double fraction) {
  return (1.0 + fraction + fraction * fraction - std::pow(fraction, 3)) / std::pow(1.0 - fraction, 3);
}
inline double gasCollisionRate(double fraction) {
  const double density = 6.0 * fraction / pi<double>();
  return 4.0 * std::sqrt(pi<double>()) * density * gasContactValue(fraction);
}

inline Space<double> gasBox(const GasOptions& options) {
  SimulationConfig<double> config;
  config.G = 0.0;
  config.timeStep = options.timeStep;
  config.adaptiveTimeStep = false;
  config.coeffRestitution = options.restitution;
  config.coeffFriction = config.coeffStaticFriction = 0.0;
  Space<double> space(config);
  space.setDomain(
      Domain<double>::periodic(Vector3<double>::Constant(gasBoxLength(options.count, options.fraction))));
  for (const Body<double>& body : randomGas<double>(options.count, options.fraction, options.seed)) {
    space.addBody(body);
  }
  return space;
}

/// Sums over the steps that were sampled.
class GasStatistics {
 public:
  void sample(const Space<double>& space) {
    forEachBlow(space,
                [&](std::size_t, std::size_t, const Vector3<double>&, double distance, double impulse) {
                  hits_ += 1.0;
                  virial_ += impulse * distance;
                });
    bodies_ = static_cast<double>(space.n());
    time_ += space.getPreviousTimeStep();
  }
  double hits() const { return hits_; }
  /// Hits that a body suffered in unit time.
  double rate() const { return 2.0 * hits_ / bodies_ / time_; }
  /// p V/(N kT) at that temperature: 1 + sum J d / (3 N kT t).
  double compressibility(double temperature) const {
    return 1.0 + virial_ / (3.0 * bodies_ * temperature * time_);
  }

 private:
  double hits_ = 0.0, virial_ = 0.0, bodies_ = 0.0, time_ = 0.0;
};

}  // namespace gravel::scenes
