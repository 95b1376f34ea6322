#include "laws/laws.hpp"
#include "support/catch.hpp"

// Bodies in contact that turn as one: over a step they go straight ahead, and contacts have to bring them
// back to where a rigid body would be.

using namespace gravel;
using namespace gravel::test;

namespace {

SimulationConfig<double> sticky(double timeStep, double friction) {
  SimulationConfig<double> config = plain(timeStep);
  config.G = 1;
  config.coeffFriction = config.coeffStaticFriction = friction;
  return config;
}

/// A sphere of radius 1 and its twelve neighbours in the closest packing, held by their gravity, that turn
/// about z as one at 0.3 of the spin at which a sphere of their moment of inertia would part.
struct Packing {
  std::vector<Vec> places{{0, 0, 0}};
  double spin;

  Packing() {
    for (int i = -1; i <= 1; ++i) {
      for (int j = -1; j <= 1; ++j) {
        for (int k = -1; k <= 1; ++k) {
          if (std::abs(i) + std::abs(j) + std::abs(k) == 2) {
            places.push_back(std::sqrt(2.0) * Vec(i, j, k));
          }
        }
      }
    }
    double inertia = 0;  // about any axis: the packing is a cube's
    for (const Vec& x : places) {
      inertia += x.squaredNorm() * 2 / 3 + 0.4;
    }
    const double size = std::sqrt(2.5 * inertia / 13);
    spin = 0.3 * std::sqrt(13 / (size * size * size));
  }

  void addTo(Space<double>& space) const {
    for (const Vec& x : places) {
      space.addBody(ball(x, spin * Vec::UnitZ().cross(x), 1, 1, {0, 0, spin}));
    }
  }

  /// sum m (x^2 + y^2) about the middle one
  static double shape(Space<double>& space) {
    double across = 0;
    for (std::size_t i = 1; i < space.n(); ++i) {
      across += Vec(Vec(space.body(i).position()) - Vec(space.body(0).position())).head<2>().squaredNorm();
    }
    return across;
  }
};

}  // namespace

// Two spheres at a share of the spin at which they part, omega^2 = G m/(4 R^3). With constraints that hold at
// the end of a drift (RATTLE) the distance is exact, whatever the step; held at its start only, contacts
// opened and closed: gaps of 1.4 to 6 (h omega)^2 of the distance, and no contact in 24 of 25 steps at 0.99
// of the limit.
TEST_CASE("A pair that turns as one touches in every step, up to its limit, at any step") {
  for (const double share : {0.5, 0.95, 0.99}) {
    for (const double steps : {100.0, 1000.0}) {  // a turn
      const double w = share * std::sqrt(0.25);
      Space<double> space(sticky(2 * pi<double>() / (w * steps), 0.5));
      for (const double side : {-1.0, 1.0}) {
        space.addBody(ball({side, 0, 0}, {0, side * w, 0}, 1, 1, {0, 0, w}));
      }
      const double energy = space.energyLedger().total();
      double widest = 0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(3 * steps); ++k) {
        space.computeDynamics(k);
        REQUIRE(space.contactImpulses().size() == 1);
        REQUIRE(space.contactImpulses()[0].normal > 0);
        const Vec r = Vec(space.body(1).position()) - Vec(space.body(0).position());
        widest = std::max(widest, std::abs(r.norm() / 2 - 1));
      }
      CHECK(widest < 1e-12);  // three hundred and more steps, each with a rounding of 1e-16
      CHECK_THAT(space.energyLedger().total(), WithinRel(energy, 1e-12));
      CHECK(std::abs(space.energyLedger().restitution) < 1e-12);
      CHECK(std::abs(space.energyLedger().friction) < 1e-12);
    }
  }
}

// With h omega = phi an error of the second order is phi^2 a turn: what was not undone of a straight way,
// phi^2/2 a step, added up to pi phi, 25 times as much at these steps. It is so without the approach, and
// without the slip, of a pair that turns: contacts are oblique to the axis.
TEST_CASE("Spheres that turn as one, with friction, keep their shape and energy as a rigid body does") {
  const Packing packing;
  for (const double friction : {0.5, 1.0}) {
    for (const double h : {0.1, 0.05}) {
      Space<double> space(sticky(h, friction));
      packing.addTo(space);
      const auto motion = [&] {
        const auto ledger = space.energyLedger();
        return ledger.kinetic + ledger.rotational;
      };
      const auto mechanical = [&] { return motion() + space.energyLedger().potential; };
      const double shapeBefore = Packing::shape(space);
      const double motionBefore = motion();
      const double before = mechanical();
      space.advanceTo(2 * pi<double>() / packing.spin);
      const double phi_sq = h * packing.spin * h * packing.spin;
      CHECK(std::abs(Packing::shape(space) / shapeBefore - 1) < phi_sq / 4);
      CHECK(std::abs(mechanical() - before) < phi_sq * motionBefore);  // sweeps end at 1e-3: 1e-4 here
      CHECK_THAT(motion(), WithinRel(motionBefore, phi_sq));
    }
  }
}

// Three unequal spheres that touch turn about their centre of mass as one, held by N_ij = m_i m_j (G/d^2 -
// w^2 d/M) alone. The first step, without a solve before it, leaves gaps of the order (h w)^3; no other adds
// to them. Seen to fail: v_t with the share of the kick that others undo (-3e-2, -7.5e-3 after five turns,
// second order, ever growing).
TEST_CASE("Three unequal spheres that turn as one neither part nor drift into each other") {
  const std::vector<double> masses{3, 1, 0.4};
  const std::vector<double> radii{1.2, 0.9, 0.6};
  const auto distance = [&](std::size_t i, std::size_t j) { return radii[i] + radii[j]; };
  const double d_01 = distance(0, 1);
  const double d_02 = distance(0, 2);
  const double x = (d_01 * d_01 + d_02 * d_02 - distance(1, 2) * distance(1, 2)) / (2 * d_01);
  const std::vector<Vec> places{{0, 0, 0}, {d_01, 0, 0}, {x, std::sqrt(d_02 * d_02 - x * x), 0}};
  const Vec centre = (3 * places[0] + places[1] + 0.4 * places[2]) / 4.4;
  const double w = 0.5 * std::sqrt(4.4 / (d_01 * d_01 * d_01));
  for (const double friction : {0.0, 1.0}) {
    for (const double steps : {200.0, 400.0}) {  // a turn
      const double phi = 2 * pi<double>() / steps;
      SimulationConfig<double> config = sticky(phi / w, friction);
      config.positionalCorrectionFactor = 0;
      config.contactTolerance = 1e-10;
      Space<double> space(config);
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec at = places[i] - centre;
        space.addBody(ball(at, w * Vec::UnitZ().cross(at), radii[i], masses[i], {0, 0, w}));
      }
      const auto gap = [&](std::size_t i, std::size_t j) {
        return (Vec(space.body(j).position()) - Vec(space.body(i).position())).norm() / distance(i, j) - 1;
      };
      const auto widest = [&] {
        return std::max({std::abs(gap(0, 1)), std::abs(gap(0, 2)), std::abs(gap(1, 2))});
      };
      const double energy = space.energyLedger().mechanical();
      space.advanceTo(2 * pi<double>() / w);
      const double once = widest();
      space.advanceTo(10 * pi<double>() / w);
      CAPTURE(friction, steps, once, widest());
      CHECK(widest() < 2 * phi * phi * phi);
      CHECK_THAT(widest(), WithinRel(once, 1e-4));
      CHECK(std::abs(space.energyLedger().mechanical() - energy) < phi * phi * phi);  // of 1.3
    }
  }
}

// Who falls with the packing sees no field (Einstein's lift). What a turn adds was compared with
// accelerations as they are, of which the common fall held nothing together: from 100 times the packing's own
// gravity on its turn seemed to be little, and it grew as without what is said above. The last field is a
// million times that.
TEST_CASE("A pile turns in free fall as it does where nothing pulls, however fast it falls") {
  const Packing packing;
  const double h = 0.1;
  const double phi_sq = h * packing.spin * h * packing.spin;
  for (const double pull : {0.0, 1e2, 1e6}) {  // of about 1 each
    Space<double> space(sticky(h, 1.0));
    packing.addTo(space);
    space.setUniformField({0.6 * pull, 0, 0.8 * pull});
    const double before = Packing::shape(space);
    space.advanceTo(2 * pi<double>() / packing.spin);
    CHECK(std::abs(Packing::shape(space) / before - 1) < phi_sq / 4);
  }
}

// Two spheres that pass their closest point in touch, one hundredth faster than they could turn as one: they
// go on along Kepler's ellipse, whatever the restitution. After three turns errors of the integrator are of
// second order (3e-5 at 400 steps a turn, 6e-4 at 100). Seen to fail: that the pair flies past itself is left
// out of how it falls back, so that a blow without speed throws it up by a_n h/2 (1e-2 off, and 4e-6 of
// energy made).
TEST_CASE("A pair that grazes itself in an orbit goes on as if it had not") {
  for (const double restitution : {0.0, 0.5, 1.0}) {
    for (const double steps : {100.0, 400.0}) {
      for (const double friction : {0.0, 0.5}) {
        CAPTURE(restitution, steps, friction);
        const double w = 1.01 * std::sqrt(0.25);
        SimulationConfig<double> config = sticky(2 * pi<double>() / (w * steps), friction);
        config.coeffRestitution = restitution;
        Space<double> space(config);
        for (const double side : {-1.0, 1.0}) {
          space.addBody(ball({side, 0, 0}, {0, side * w, 0}, 1, 1, {0, 0, w}));
        }
        for (std::size_t k = 0; k < static_cast<std::size_t>(3 * steps); ++k) {
          space.computeDynamics(k);
        }
        // The ellipse that begins at its closest point, 2, at the speed 2 w: E - e sin E = n t.
        const double a = 1 / (1 - 2 * w * w);
        const double e = 1 - 2 / a;
        const double mean = std::sqrt(2 / (a * a * a)) * space.time();
        double anomaly = mean;
        for (int i = 0; i < 100; ++i) {
          anomaly = mean + e * std::sin(anomaly);
        }
        const Vec apart = Vec(space.body(1).position()) - Vec(space.body(0).position());
        CHECK(std::abs(apart.norm() - a * (1 - e * std::cos(anomaly))) < 16 / (steps * steps));
        // What speed the errors leave along the line of centres is lost, and none is made.
        CHECK(space.energyLedger().restitution < 4 / std::pow(steps, 4));
        CHECK(space.energyLedger().restitution > -1e-15);
      }
    }
  }
}
