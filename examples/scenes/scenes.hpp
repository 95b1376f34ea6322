#pragma once

/// \file
/// The scenes that examples, tests and benchmarks share. Plain functions that return bodies by value, a
/// function of their arguments alone: equal arguments, equal bodies, on every machine.

#include <gravel/bodies/body.hpp>
#include <gravel/core/random.hpp>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

namespace gravel::scenes {

/// One random number after the other.
class Sequence {
 public:
  explicit Sequence(std::uint64_t seed, std::uint64_t stream = 0) : random_(seed, stream) {}
  double uniform() { return random_.uniform(counter_++); }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal() { return random_.normal(counter_++); }
  Vector3<double> direction() { return random_.direction(counter_++); }
  Vector3<double> inBall(double radius) {
    const double distance =
        radius * std::cbrt(uniform());  // drawn first: in one expression there is no order
    return direction() * distance;
  }
  Vector3<double> normalVector() {
    const double x = normal(), y = normal(), z = normal();
    return {x, y, z};
  }

 private:
  CounterRandom random_;
  std::uint64_t counter_ = 0;
};

/// Radii between low and high of which a share r^-exponent is larger than r; exponent 0: uniform.
inline double powerLawRadius(Sequence& random, double low, double high, double exponent) {
  if (!(high > low)) {
    return low;
  }
  if (exponent == 0.0) {
    return random.uniform(low, high);
  }
  const double a = std::pow(low, -exponent), b = std::pow(high, -exponent), share = random.uniform();
  const double radius =
      std::isnormal(a) && std::isnormal(b)
          ? std::pow(a + (b - a) * share, -1.0 / exponent)
          : low * std::exp(-std::log1p(std::expm1(exponent * (std::log(low) - std::log(high))) * share) /
                           exponent);  // the same, where powers leave the range
  return std::clamp(radius, low, high);
}

/// Spheres placed one after the other, none overlapping another (random sequential addition). Along an axis
/// with a `period` > 0 what is one period apart is the same place.
class Placement {
 public:
  explicit Placement(double largestRadius, const Vector3<double>& period = Vector3<double>::Zero())
      : cell_(Vector3<double>::Constant(std::max(2.0 * largestRadius, 1e-300))), period_(period) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (period[axis] > 0.0) {
        side_[axis] = cellNumber(period[axis], axis);
        if (side_[axis] < 1) {
          throw std::invalid_argument("scene: the box is narrower than its largest sphere");
        }
        cell_[axis] = period[axis] / static_cast<double>(side_[axis]);
      }
    }
  }

  /// Takes the place if it is free.
  bool tryAdd(const Vector3<double>& x, double radius) {
    const Cell home = cellOf(x);
    for (std::int64_t k = 0; k < 27; ++k) {
      const auto found = cells_.find(keyOf(home + Cell(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1)));
      if (found == cells_.end()) {
        continue;
      }
      for (const Sphere& other : found->second) {
        Vector3<double> d = other.x - x;
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
          d[axis] -= period_[axis] > 0.0 ? period_[axis] * std::round(d[axis] / period_[axis]) : 0.0;
        }
        const double reach = other.radius + radius;
        if (d.squaredNorm() < reach * reach) {
          return false;
        }
      }
    }
    cells_[keyOf(home)].push_back({x, radius});
    return true;
  }

  /// Draws places until one is free. \throws std::invalid_argument when none is found
  template <class Draw>
  Vector3<double> add(double radius, Draw&& draw) {
    for (int attempt = 0; attempt < 20000; ++attempt) {
      const Vector3<double> x = draw();
      if (tryAdd(x, radius)) {
        return x;
      }
    }
    throw std::invalid_argument(
        "scene: no free place found for a sphere; make the region larger or the spheres fewer or smaller "
        "(random placement fills at most a third of a region)");
  }

 private:
  using Cell = Eigen::Matrix<std::int64_t, 3, 1>;
  struct Sphere {
    Vector3<double> x;
    double radius;
  };

  /// \throws std::invalid_argument where places have too few digits to tell spheres apart
  std::int64_t cellNumber(double x, Eigen::Index axis) const {
    const double number = std::floor(x / cell_[axis]);
    if (!(std::abs(number) <= 1e15)) {
      throw std::invalid_argument("scene: the region is more than 1e15 of its largest spheres wide");
    }
    return static_cast<std::int64_t>(number);
  }

  Cell cellOf(const Vector3<double>& x) const {
    return {cellNumber(x[0], 0), cellNumber(x[1], 1), cellNumber(x[2], 2)};
  }

  std::uint64_t keyOf(Cell c) const {
    std::uint64_t key = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      std::int64_t& k = c[axis];
      if (side_[axis] > 0) {
        k = (k % side_[axis] + side_[axis]) % side_[axis];
      }
      key = (key << 21U) ^ (static_cast<std::uint64_t>(k + (1 << 20)) & 0x1FFFFFU);
    }
    return key;
  }

  Vector3<double> cell_;
  Vector3<double> period_;
  Cell side_ = Cell::Zero();  ///< cells of a period
  std::unordered_map<std::uint64_t, std::vector<Sphere>> cells_;
};

/// Shifts and boosts so that the centre of mass rests at the origin.
template <Real S>
void centre(std::vector<Body<S>>& bodies) {
  S mass(0);
  Vector3<S> x = Vector3<S>::Zero(), v = Vector3<S>::Zero();
  for (const Body<S>& body : bodies) {
    mass += body.mass;
    x += body.mass * body.position;
    v += body.mass * body.velocity;
  }
  if (mass > S(0)) {
    for (Body<S>& body : bodies) {
      body.position -= x / mass;
      body.velocity -= v / mass;
    }
  }
}

struct CloudOptions {
  std::size_t count = 2000;
  std::uint64_t seed = 1;
  double radius = 600.0;                           ///< [m] of the cloud
  std::array<double, 2> bodyRadius{6.0, 18.0};     ///< [m] smallest and largest rock
  double sizeExponent = 3.0;                       ///< a share r^-exponent of the rocks is larger than r
  std::array<double, 2> density{2000.0, 3000.0};   ///< [kg m^-3]
  Vector3<double> spin = Vector3<double>::Zero();  ///< [rad s^-1] of the cloud as a whole
  double velocityDispersion = 0.0;                 ///< [m s^-1] per axis
  double bodySpin = 0.0;                           ///< [rad s^-1] rms per axis, of each rock about itself
};

/// A ball of rocks, spread evenly and without overlaps, at rest or turning as a whole; its centre of mass
/// rests at the origin.
template <Real S = double>
std::vector<Body<S>> rubbleCloud(const CloudOptions& options) {
  Sequence place(options.seed, 0), size(options.seed, 1), motion(options.seed, 2);
  std::vector<double> radii(options.count);
  for (double& radius : radii) {
    radius = powerLawRadius(size, options.bodyRadius[0], options.bodyRadius[1], options.sizeExponent);
  }
  Placement placement(options.bodyRadius[1]);
  std::vector<Body<S>> bodies;
  bodies.reserve(options.count);
  for (const double r : radii) {
    const Vector3<double> x = placement.add(r, [&] { return place.inBall(options.radius); });
    const Vector3<double> v = options.spin.cross(x) + options.velocityDispersion * motion.normalVector();
    const Vector3<double> w = options.spin + options.bodySpin * motion.normalVector();
    Body<S> body;
    body.position = x.cast<S>();
    body.velocity = v.cast<S>();
    body.angularVelocity = w.cast<S>();
    body.radius = S(r);
    body.mass =
        S(size.uniform(options.density[0], options.density[1]) * 4.0 / 3.0 * pi<double>() * r * r * r);
    bodies.push_back(body);
  }
  centre(bodies);
  return bodies;
}

/// The cloud with its own numbers, its radius scaled so that any count is as thin.
template <Real S = double>
std::vector<Body<S>> rubbleCloud(std::size_t count, std::uint64_t seed = 1) {
  CloudOptions options;
  options.count = count;
  options.seed = seed;
  options.radius = 600.0 * std::cbrt(static_cast<double>(count) / 2000.0);
  return rubbleCloud<S>(options);
}

struct PlummerOptions {
  std::size_t count = 1000;
  std::uint64_t seed = 1;
  double G = 1.0;            ///< [m^3 kg^-1 s^-2]
  double mass = 1.0;         ///< [kg] of all
  double scaleRadius = 1.0;  ///< [m] a: half of the mass is within 1.305 a
};

/// Plummer's sphere of equal point masses, centre of mass at rest at the origin; velocities by rejection from
/// the isotropic distribution function (Aarseth, Henon & Wielen 1974, A&A 37, 183).
template <Real S = double>
std::vector<Body<S>> plummerSphere(const PlummerOptions& options) {
  Sequence random(options.seed);
  const double speed = std::sqrt(options.G * options.mass / options.scaleRadius);
  std::vector<Body<S>> bodies(options.count);
  for (Body<S>& body : bodies) {
    double r = 0.0;
    do {
      r = 1.0 / std::sqrt(std::pow(1.0 - random.uniform(), -2.0 / 3.0) - 1.0);
    } while (!(r < 100.0));  // the outermost 1e-4 of the mass is left out
    double q = 0.0, height = 0.0;
    do {
      q = random.uniform();
      height = random.uniform(0.0, 0.1);
    } while (height > q * q * std::pow(1.0 - q * q, 3.5));
    const double escape = std::sqrt(2.0 / std::sqrt(1.0 + r * r));
    const Vector3<double> x = r * random.direction();
    const Vector3<double> v = q * escape * random.direction();
    body.position = (options.scaleRadius * x).cast<S>();
    body.velocity = (speed * v).cast<S>();
    body.mass = S(options.mass / static_cast<double>(options.count));
  }
  centre(bodies);
  return bodies;
}

/// The same in units of its own: G = M = a = 1.
template <Real S = double>
std::vector<Body<S>> plummerSphere(std::size_t count, std::uint64_t seed = 1) {
  PlummerOptions options;
  options.count = count;
  options.seed = seed;
  return plummerSphere<S>(options);
}

/// Side of the cube in which `count` spheres of diameter 1 fill `fraction` of the volume.
inline double gasBoxLength(std::size_t count, double fraction) {
  return std::cbrt(static_cast<double>(count) * pi<double>() / (6.0 * fraction));
}

/// A gas of hard spheres of diameter 1 and mass 1 at temperature 1 (Maxwell's velocities, exactly 3/2 N of
/// kinetic energy, no momentum), placed at random in the periodic cube [-L/2, L/2)^3.
template <Real S = double>
std::vector<Body<S>> randomGas(std::size_t count, double fraction, std::uint64_t seed = 1) {
  const double side = gasBoxLength(count, fraction);
  Placement placement(0.5, Vector3<double>::Constant(side));
  Sequence place(seed, 0), motion(seed, 1);
  std::vector<Vector3<double>> velocities(count);
  Vector3<double> drift = Vector3<double>::Zero();
  for (Vector3<double>& v : velocities) {
    v = motion.normalVector();
    drift += v;
  }
  double energy = 0.0;
  for (Vector3<double>& v : velocities) {
    v -= drift / static_cast<double>(count);
    energy += 0.5 * v.squaredNorm();
  }
  const double scale = energy > 0.0 ? std::sqrt(1.5 * static_cast<double>(count) / energy) : 0.0;
  std::vector<Body<S>> bodies(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3<double> x = placement.add(0.5, [&] {
      const double a = place.uniform(-0.5, 0.5), b = place.uniform(-0.5, 0.5), c = place.uniform(-0.5, 0.5);
      return Vector3<double>(side * a, side * b, side * c);
    });
    const Vector3<double> v = scale * velocities[i];
    bodies[i].position = x.cast<S>();
    bodies[i].velocity = v.cast<S>();
    bodies[i].radius = S(0.5);
  }
  return bodies;
}

struct ColumnOptions {
  std::size_t count = 1500;
  std::uint64_t seed = 1;
  Vector3<double> base = Vector3<double>(0, 0, 0.3);   ///< [m] middle of the column's lower end
  double radius = 0.06;                                ///< [m] of the column, upright along z
  std::array<double, 2> bodyRadius{0.006, 0.009};      ///< [m]
  double density = 2500.0;                             ///< [kg m^-3]
  Vector3<double> velocity = Vector3<double>::Zero();  ///< [m s^-1]
};

/// Grains stacked loosely in an upright column, layer upon layer, slightly out of order; none overlap or
/// reach out of it.
template <Real S = double>
std::vector<Body<S>> grainColumn(const ColumnOptions& options) {
  const double largest = options.bodyRadius[1];
  const double room = 1.1 * largest;  // of a grain about its place
  const double pitch = 2.0 * room;
  const double inner = options.radius - room;
  if (!(inner >= 0.0)) {
    throw std::invalid_argument("scene: the column is narrower than its largest grain");
  }
  if (!(inner / pitch <= 32768.0)) {  // one layer takes 3e9
    throw std::invalid_argument("scene: the column is more than 65536 of its largest grains wide");
  }
  Sequence random(options.seed);
  const auto steps = static_cast<int>(inner / pitch);
  std::vector<Body<S>> bodies;
  bodies.reserve(options.count);
  for (int layer = 0; bodies.size() < options.count; ++layer) {
    for (int j = -steps; j <= steps && bodies.size() < options.count; ++j) {
      for (int i = -steps; i <= steps && bodies.size() < options.count; ++i) {
        const Vector3<double> x(pitch * i, pitch * j, room + pitch * layer);
        if (std::hypot(x[0], x[1]) > inner) {
          continue;
        }
        const double r = random.uniform(options.bodyRadius[0], options.bodyRadius[1]);
        const Vector3<double> place = options.base + x + random.inBall(0.09 * largest);
        Body<S> body;
        body.position = place.cast<S>();
        body.velocity = options.velocity.cast<S>();
        body.radius = S(r);
        body.mass = S(options.density * 4.0 / 3.0 * pi<double>() * r * r * r);
        bodies.push_back(body);
      }
    }
  }
  return bodies;
}

/// Two bodies, G = M = a = 1, at apocentre: `eccentricity` in [0, 1), the second one's share of the mass.
template <Real S = double>
std::vector<Body<S>> keplerPair(S eccentricity, S share = S(0)) {
  using std::sqrt;
  std::vector<Body<S>> bodies(2);
  const S distance = S(1) + eccentricity;
  const S speed = sqrt((S(1) - eccentricity) / (S(1) + eccentricity));
  bodies[0].mass = S(1) - share;
  bodies[1].mass = share;
  bodies[0].position = {-share * distance, S(0), S(0)};
  bodies[1].position = {(S(1) - share) * distance, S(0), S(0)};
  bodies[0].velocity = {S(0), -share * speed, S(0)};
  bodies[1].velocity = {S(0), (S(1) - share) * speed, S(0)};
  return bodies;
}

/// Period of the figure-eight below.
inline constexpr double figureEightPeriod = 6.32591398292621;

/// Three unit masses that chase each other on one eight, G = 1 (Chenciner & Montgomery 2000, Ann. Math. 152,
/// 881; initial values by Simo).
template <Real S = double>
std::vector<Body<S>> figureEight() {
  std::vector<Body<S>> bodies(3);
  bodies[0].position = {S(0.97000435669734), S(-0.24308753153583), S(0)};
  bodies[1].position = -bodies[0].position;
  bodies[2].velocity = {S(-0.93240737144104), S(-0.86473146092102), S(0)};
  bodies[0].velocity = bodies[1].velocity = -bodies[2].velocity / S(2);
  return bodies;
}

/// [au^3 / (day^2 solar mass)]: Gauss's constant squared, as the scene below uses it.
inline constexpr double outerSolarSystemG = 2.95912208286e-4;

/// Sun (with the inner planets' mass), Jupiter, Saturn, Uranus, Neptune and Pluto on 5 September 1994 at 0 h;
/// au, days, solar masses, relative to the Sun (Hairer, Lubich & Wanner, Geometric Numerical Integration,
/// section I.2.4, after Ahnerts Kalender fuer Sternfreunde 1994).
template <Real S = double>
std::vector<Body<S>> outerSolarSystem() {
  struct Row {
    double mass, x, y, z, vx, vy, vz;
  };
  static constexpr std::array<Row, 6> rows{
      {{1.00000597682, 0, 0, 0, 0, 0, 0},
       {0.000954786104043, -3.5023653, -3.8169847, -1.5507963, 0.00565429, -0.00412490, -0.00190589},
       {0.000285583733151, 9.0755314, -3.0458353, -1.6483708, 0.00168318, 0.00483525, 0.00192462},
       {0.0000437273164546, 8.3101420, -16.2901086, -7.2521278, 0.00354178, 0.00137102, 0.00055029},
       {0.0000517759138449, 11.4707666, -25.7294829, -10.8169456, 0.00288930, 0.00114527, 0.00039677},
       {1.0 / 1.3e8, -15.5387357, -25.2225594, -3.1902382, 0.00276725, -0.00170702, -0.00136504}}};
  std::vector<Body<S>> bodies;
  for (const Row& row : rows) {
    Body<S> body;
    body.mass = S(row.mass);
    body.position = {S(row.x), S(row.y), S(row.z)};
    body.velocity = {S(row.vx), S(row.vy), S(row.vz)};
    bodies.push_back(body);
  }
  return bodies;
}

}  // namespace gravel::scenes
