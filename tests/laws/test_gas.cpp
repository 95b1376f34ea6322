#include "laws/laws.hpp"
#include "scenes/gas.hpp"
#include "support/catch.hpp"
#include <gravel/core/random.hpp>

// Hard spheres of diameter 1, mass 1 and temperature 1 in a periodic cube.

using namespace gravel;
using namespace gravel::test;

namespace {

double temperature(const Space<double>& space) {
  return 2.0 / 3.0 * std::get<0>(space.calculateSystemEnergy()) / static_cast<double>(space.n());
}

}  // namespace

// Runs event by event of 500 spheres; Enskog's and Carnahan & Starling's formulas are within 0.6 % of these.
// A run of H hits has the relative noise 1/sqrt(H) in their number, and about 1/sqrt(H) in the sum of the
// momenta that they carry (its distribution has the variance (4 - pi)/pi).
TEST_CASE("A gas has the collision rate and the pressure of hard spheres, at three densities") {
  struct Row {
    double fraction, compressibility, rate, time;
  };
  for (const Row& row :
       {Row{0.05, 1.22934, 0.77468, 30}, Row{0.10, 1.52214, 1.76162, 15}, Row{0.20, 2.40630, 4.76434, 6}}) {
    scenes::GasOptions options;
    options.count = 256;
    options.fraction = row.fraction;
    Space<double> space = scenes::gasBox(options);
    advance(space, 200);
    scenes::GasStatistics gas;
    const auto steps = static_cast<std::size_t>(row.time / options.timeStep);
    for (std::size_t i = 0; i < steps; ++i) {
      space.computeDynamics(i);
      gas.sample(space);
    }
    CAPTURE(row.fraction, gas.hits(), gas.rate() / row.rate, gas.compressibility(1.0) / row.compressibility);
    CHECK(gas.hits() > 2500);
    const double noise = 1.0 / std::sqrt(gas.hits());
    CHECK_THAT(gas.rate(), WithinRel(row.rate, 4 * noise));
    CHECK_THAT(gas.compressibility(1.0) - 1, WithinRel(row.compressibility - 1, 5 * noise));
    CHECK_THAT(temperature(space), WithinRel(1.0, 1e-12));  // thousands of hits, none of which costs energy
  }
}

// Every blow is at the same distance r1 + r2, so that its rounding can err one way always. A blow leaves the
// energy wrong by some 3e-16 of it, at random: the mean of 4000 by 5e-18. Seen to fail: the normal as it
// comes out at that distance (2.3e-16 gained in each blow for r = 0.5, 5e-17 lost for 0.45).
TEST_CASE("Elastic blows neither gain nor lose energy in the mean, beyond the noise of their rounding") {
  const auto [r, flat] = GENERATE(table<double, int>(
      {{0.5, -1}, {0.45, -1}, {0.51, -1}, {0.5, 0}, {0.45, 0}, {0.5, 1}, {0.45, 1}, {0.5, 2}, {0.45, 2}}));
  SimulationConfig<double> config = plain(1.0);
  config.coeffRestitution = 1.0;
  config.coeffFriction = config.coeffStaticFriction = 0.0;
  Space<double> space(config);
  const CounterRandom random(5);
  const std::size_t pairs = 4000;
  for (std::size_t k = 0; k < pairs; ++k) {
    Vec way = random.direction(8 * k);
    Vec aside = 0.1 * random.direction(8 * k + 3);
    if (flat >= 0) {  // all in one plane
      way[flat] = aside[flat] = 0;
    }
    const Vec apart = 0.75 * way.normalized();
    const Vec v = -random.uniform(8 * k + 2, 0.5, 1.5) * apart + aside;
    const Vec middle(10.0 * static_cast<double>(k), 0, 0);
    space.addBody(ball(middle + apart, v, r));
    space.addBody(ball(middle - apart, -v, r));
  }
  const auto energy = [&](std::size_t k) {
    long double sum = 0;
    for (Eigen::Index c = 0; c < 3; ++c) {
      const long double v = space.body(2 * k).velocity()[c];
      sum += v * v;
    }
    return sum;
  };
  std::vector<long double> before;
  for (std::size_t k = 0; k < pairs; ++k) {
    before.push_back(energy(k));
  }
  space.computeDynamics(0);
  long double gain = 0;
  for (std::size_t k = 0; k < pairs; ++k) {
    gain += (energy(k) / before[k] - 1) / static_cast<long double>(pairs);
  }
  CAPTURE(r, flat, 1e17 * static_cast<double>(gain), space.impacts().size());
  CHECK(space.impacts().size() > pairs * 9 / 10);
  CHECK(std::abs(gain) < 2.5e-17L);
}

// All start at one speed. After 20 hits a body the components of the velocities are normal: the largest
// distance of the distribution functions, times sqrt(n), is below 1.63 with 99 % (Kolmogorov 1933).
TEST_CASE("Hits bring velocities to Maxwell's distribution") {
  scenes::GasOptions options;
  options.count = 400;
  options.fraction = 0.25;
  Space<double> space = scenes::gasBox(options);
  const CounterRandom random(77);
  for (std::size_t i = 0; i < space.n(); i += 2) {
    const Vec v = std::sqrt(3.0) * random.direction(i);
    space.body(i).velocity() = v;
    space.body(i + 1).velocity() = -v;
  }
  const auto distance = [&] {
    std::vector<double> components;
    for (std::size_t i = 0; i < space.n(); ++i) {
      for (int c = 0; c < 3; ++c) {
        components.push_back(space.body(i).velocity()[c]);
      }
    }
    std::sort(components.begin(), components.end());
    const auto n = static_cast<double>(components.size());
    double worst = 0.0;
    for (std::size_t k = 0; k < components.size(); ++k) {
      const double normal = 0.5 * std::erfc(-components[k] / std::sqrt(2.0));
      worst = std::max({worst, std::abs(normal - double(k) / n), std::abs(normal - double(k + 1) / n)});
    }
    return worst * std::sqrt(n);
  };
  CHECK(distance() > 1.63);  // components of vectors of one length are even, not normal
  scenes::GasStatistics gas;
  for (std::size_t i = 0; 2 * gas.hits() < 20.0 * 400; ++i) {
    space.computeDynamics(i);
    gas.sample(space);
  }
  CHECK(distance() < 1.63);
}

// T = T0/(1 + t/tau)^2 with 1/tau = (1 - e^2) omega_0/6 (1 + 3 a_2/16) (Haff 1983; van Noije & Ernst 1998).
// The energy of H hits has the relative noise 1/sqrt(H), and so has sqrt(T0/T) - 1.
TEST_CASE("A gas of inelastic spheres cools by Haff's law") {
  scenes::GasOptions options;
  options.count = 500;
  options.fraction = 0.05;
  options.restitution = 0.9;
  options.timeStep = 0.01;
  Space<double> space = scenes::gasBox(options);
  const double e = options.restitution;
  const double a2 = 16 * (1 - e) * (1 - 2 * e * e) / (81 - 17 * e + 30 * e * e * (1 - e));
  const double rate = (1 - e * e) * 0.77468 / 6 * (1 + 3 * a2 / 16);
  scenes::GasStatistics gas;
  for (std::size_t i = 0; i < 4000; ++i) {
    space.computeDynamics(i);
    gas.sample(space);
  }
  CAPTURE(gas.hits());
  CHECK(gas.hits() > 4000);
  CHECK_THAT(std::sqrt(1 / temperature(space)) - 1,
             WithinRel(rate * space.time(), 4 / std::sqrt(gas.hits())));
  const EnergyLedger<double> ledger = space.energyLedger();
  CHECK_THAT(ledger.total(), WithinRel(750.0, 1e-12));
}

// Rough spheres, whose blows always stick, trade energy between flight and spin. With b the tangential
// restitution, q = 2/5, y = (1 + b) q/(2 + 2 q) and Maxwell's distribution of both, the mean over blows at
// the temperatures T of flight and W of spin gives (Huthmann & Zippelius 1997, Phys. Rev. E 56, R6275)
//   dT/dt = -k ((1 - e^2)/4 + y (1 - y)) T + k (y^2/q) W,   k = (4/3) omega_0 sqrt(T),
//   dW/dt = k (y^2/q) T - k (y/q) (1 - y/q) W.
// Over ten seeds T and W scatter by 2 to 3.4 %, and their means are within 2.1 % of these; the tolerance is
// 12 %. Seen to fail: blows have no tangential restitution.
TEST_CASE(
    "A gas of rough spheres shares its energy between flight and spin, and cools, as kinetic theory says") {
  struct Row {
    double restitution, tangential;
  };
  for (const Row& row : {Row{1.0, 1.0}, Row{0.9, 0.4}}) {
    const double e = row.restitution;
    const double b = row.tangential;
    scenes::GasOptions options;
    options.count = 1000;
    options.fraction = 0.05;
    options.restitution = e;
    options.timeStep = 0.01;
    Space<double> space = scenes::gasBox(options);
    space.setCoeffStaticFriction(1e9);
    space.setCoeffFriction(1e9);
    space.setTangentialRestitution(b);
    const double y = (1 + b) / 7;
    double T = 1;
    double W = 0;
    const auto rates = [&](double flight, double spin) {
      const double k = 4.0 / 3 * scenes::gasCollisionRate(options.fraction) * std::sqrt(flight);
      return std::pair{-k * ((1 - e * e) / 4 + y * (1 - y)) * flight + k * y * y / 0.4 * spin,
                       k * y * y / 0.4 * flight - k * y / 0.4 * (1 - y / 0.4) * spin};
    };
    for (const double time : {5.0, 25.0}) {
      while (space.time() < time - 1e-9) {
        space.computeDynamics(space.steps());
        const double h = options.timeStep;
        const auto first = rates(T, W);
        const auto middle = rates(T + h / 2 * first.first, W + h / 2 * first.second);
        T += h * middle.first;
        W += h * middle.second;
      }
      const EnergyLedger<double> ledger = space.energyLedger();
      CAPTURE(e, b, time, T, W);
      CHECK_THAT(ledger.kinetic / 1500, WithinRel(T, 0.12));
      CHECK_THAT(ledger.rotational / 1500, WithinRel(W, 0.12));
      CHECK_THAT(e < 1 ? ledger.total() : ledger.mechanical(), WithinRel(1500.0, 1e-12));
    }
  }
}

// Below e = 7 - 4 sqrt 3 three balls on a line hit each other infinitely often in a finite time (Bernu &
// Mazighi 1990; McNamara & Young 1992). The steps must go on, and the balls end together.
TEST_CASE("Inelastic collapse of three balls on a line ends") {
  for (const double e : {0.0, 0.02, 0.07}) {
    SimulationConfig<double> config = plain(1e-3);
    config.coeffRestitution = e;
    Space<double> space(config);
    space.addBody(ball({-1.2, 0, 0}, {1, 0, 0}, 0.5));
    space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.5));
    space.addBody(ball({1.2, 0, 0}, {-1, 0, 0}, 0.5));
    advance(space, 2000);
    CAPTURE(e);
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK(space.body(i).velocity().norm() < 1e-3);
    }
    CHECK(space.conserved().momentum.norm() < 1e-14);
    CHECK(space.body(2).position()[0] - space.body(0).position()[0] < 2.01);
    CHECK_THAT(space.energyLedger().total(), WithinRel(1.0, 1e-13));
  }
}

// Two kinds, diameters 1 and 0.6 and of one density, 256 of each. With x_k = pi/6 sum n_i s_i^k and
// a = s_i s_j/(s_i + s_j) the contact value of a pair is (Boublik 1970; Mansoori et al. 1971)
//   g_ij = 1/(1 - x_3) + 3 x_2 a/(1 - x_3)^2 + 2 x_2^2 a^2/(1 - x_3)^3,
// hits of the two kinds are n_i n_j s_ij^2 g_ij sqrt(8 pi T/m_ij) a volume and time, half of it among one
// kind, and p/(n T) = 1 + (2 pi/3) sum x_i x_j n s_ij^3 g_ij. H hits have the noise 1/sqrt(H); the kinds'
// shares of the energy, equal in the mean, vary by 2 to 3 % and the formulas err by half a percent: 2 % more.
// Seen to fail: pairs looked for within twice the smaller radius (0.79 of the hits of unlike ones, 0.85 and
// 0.91).
TEST_CASE(
    "A mixture has the hits of each kind and the pressure of unlike hard spheres, and one temperature") {
  constexpr int row = 8;
  constexpr int each = row * row * row / 2;
  constexpr double fraction = 0.2;
  const std::array<double, 2> size{0.6, 1.0};
  const std::array<double, 2> mass{0.216, 1.0};
  const double volume = pi<double>() / 6 * each * (1 + 0.216) / fraction;
  const double side = std::cbrt(volume);
  SimulationConfig<double> config = plain(0.01);
  config.coeffRestitution = 1;
  Space<double> space(config);
  space.setDomain(Domain<double>::periodic(Vec::Constant(side)));
  const CounterRandom random(3);
  Vec drift = Vec::Zero();
  for (int i = 0; i < 2 * each; ++i) {
    const auto kind = static_cast<std::size_t>((i + i / row + i / row / row) % 2);
    const Vec v = std::sqrt(3 / mass[kind]) * random.direction(static_cast<std::uint64_t>(i));
    const Vec x(i % row, i / row % row, i / row / row);
    space.addBody(ball(Vec(side / row * x), v, size[kind] / 2, mass[kind]));
    drift += mass[kind] / (each * 1.216) * v;
  }
  for (std::size_t i = 0; i < space.n(); ++i) {
    space.body(i).velocity() -= drift;
  }
  const double T = 2.0 / 3 * std::get<0>(space.calculateSystemEnergy()) / (2 * each - 1);
  const auto kindOf = [&](std::size_t i) { return space.body(i).mass() == 1.0 ? 1U : 0U; };
  advance(space, 300);
  std::array<double, 3> hits{};
  std::array<double, 2> energy{};
  double virial = 0;
  const int steps = 1200;
  for (int k = 0; k < steps; ++k) {
    space.computeDynamics(0);
    scenes::forEachBlow(space,
                        [&](std::size_t i, std::size_t j, const Vec&, double distance, double impulse) {
                          hits[kindOf(i) + kindOf(j)] += 1;
                          virial += impulse * distance;
                        });
    for (std::size_t i = 0; k % 10 == 0 && i < space.n(); ++i) {
      energy[kindOf(i)] += space.body(i).mass() * Vec(space.body(i).velocity()).squaredNorm();
    }
  }
  const double time = steps * 0.01;
  const double n = each / volume;  // of either kind
  const double x2 = pi<double>() / 6 * n * (1 + 0.36);
  double excess = 0;
  for (const auto& [i, j] : {std::pair{0U, 0U}, {0U, 1U}, {1U, 1U}}) {
    const double a = size[i] * size[j] / (size[i] + size[j]) * x2 / (1 - fraction);
    const double contact = (1 + 3 * a + 2 * a * a) / (1 - fraction);
    const double distance = (size[i] + size[j]) / 2;
    const double reduced = mass[i] * mass[j] / (mass[i] + mass[j]);
    const double rate = n * n * distance * distance * contact * std::sqrt(8 * pi<double>() * T / reduced) *
                        volume * (i == j ? 0.5 : 1.0);
    CAPTURE(i, j, hits[i + j] / (rate * time));
    CHECK(rate * time > 2000);
    CHECK_THAT(hits[i + j], WithinRel(rate * time, 0.02 + 4 / std::sqrt(rate * time)));
    excess += (i == j ? 1.0 : 2.0) * pi<double>() / 3 * n * std::pow(distance, 3) * contact;
  }
  CHECK_THAT(virial / (6 * each * T * time),
             WithinRel(excess, 0.02 + 4 / std::sqrt(hits[0] + hits[1] + hits[2])));
  CHECK_THAT(energy[0], WithinRel(energy[1], 0.1));
  CHECK_THAT(std::get<0>(space.calculateSystemEnergy()), WithinRel(1.5 * (2 * each - 1) * T, 1e-12));
}
