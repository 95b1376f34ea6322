#include "laws/laws.hpp"
#include "support/catch.hpp"

// Impacts at their own time inside the step: order, chains, speed without bound.

using namespace gravel;
using namespace gravel::test;

TEST_CASE("Newton's cradle of touching balls passes the blow on: (0, 0, 0, 0, 1)") {
  for (const double gap : {0.7, 1e-3, 0.0}) {
    SimulationConfig<double> config = plain(1e-2);
    config.coeffRestitution = 1;
    Space<double> space(config);
    space.addBody(ball({-gap, 0, 0}, {1, 0, 0}, 0.5));
    for (int k = 1; k < 5; ++k) {
      space.addBody(ball({1.0 * k, 0, 0}, {0, 0, 0}, 0.5));
    }
    advance(space, 100);
    CAPTURE(gap);
    for (std::size_t k = 0; k < 5; ++k) {
      CHECK(space.body(k).velocity() == Vec(k == 4 ? 1 : 0, 0, 0));
    }
  }
}

TEST_CASE("Two balls of a cradle drive two out") {
  SimulationConfig<double> config = plain(1e-2);
  config.coeffRestitution = 1;
  Space<double> space(config);
  for (int k = 0; k < 5; ++k) {
    space.addBody(ball({k - (k < 2 ? 0.3 : 0.0), 0, 0}, {k < 2 ? 1.0 : 0.0, 0, 0}, 0.5));
  }
  advance(space, 100);
  for (std::size_t k = 0; k < 5; ++k) {
    CHECK(space.body(k).velocity() == Vec(k >= 3 ? 1 : 0, 0, 0));
  }
}

TEST_CASE("A light ball dropped on a heavy one leaves at three times the speed of the fall") {
  SimulationConfig<double> config = plain(1e-2);
  config.coeffRestitution = 1;
  Space<double> space(config);
  space.setUniformField({0, 0, -9.81});
  space.addPlane({0, 0, 1}, 0);
  space.addBody(ball({0, 0, 1.1}, {0, 0, 0}, 0.1, 1e12));
  space.addBody(ball({0, 0, 1.3 + 1e-9}, {0, 0, 0}, 0.1, 1));
  bool seen = false;
  for (std::size_t i = 0; i < 60 && !seen; ++i) {
    space.computeDynamics(i);
    if (!space.impacts().empty()) {
      seen = true;
      const double t = space.impacts().back().time;
      const double after = space.body(1).velocity()[2] + 9.81 * (space.getPreviousTimeStep() - t);
      CHECK_THAT(after / std::sqrt(2 * 9.81), WithinAbs(3.0, 1e-7));
      CHECK(space.impacts().size() == 2);
    }
  }
  CHECK(seen);
}

TEST_CASE("A bullet hits, however many radii it flies in a step: sphere, chain of spheres and wall") {
  for (const double radii : {1.0, 10.0, 100.0, 1e4}) {
    SimulationConfig<double> config = plain(1.0);
    config.coeffRestitution = 1;
    CAPTURE(radii);
    {
      Space<double> space(config);
      space.addBody(ball({-30, 0.1, 0}, {radii * 0.5 + 40, 0, 0}, 0.5));
      space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.5));
      const Vec momentum = space.conserved().momentum;
      space.computeDynamics(0);
      REQUIRE(space.impacts().size() == 1);
      // b = 0.1 of a distance 1: the normal is inclined by asin(0.1).
      CHECK_THAT(space.impacts()[0].time * (radii * 0.5 + 40), WithinAbs(30 - std::sqrt(0.99), 1e-9));
      CHECK((space.conserved().momentum - momentum).norm() <= 1e-13 * momentum.norm());
    }
    {
      Space<double> space(config);
      space.addBody(ball({-30, 0, 0}, {radii * 0.5 + 40, 0, 0}, 0.5));
      for (int k = 0; k < 4; ++k) {
        space.addBody(ball({2.0 * k, 0, 0}, {0, 0, 0}, 0.5));
      }
      space.computeDynamics(0);
      CHECK(space.impacts().size() == 4);
      CHECK(space.body(4).velocity()[0] == radii * 0.5 + 40);
    }
    {
      Space<double> space(config);
      space.addPlane({0, 0, 1}, 0);
      space.addBody(ball({0, 0, 20}, {0, 0, -radii * 0.5 - 40}, 0.5));
      space.computeDynamics(0);
      CHECK(space.body(0).velocity()[2] == radii * 0.5 + 40);
      CHECK_THAT(space.body(0).position()[2], WithinRel(radii * 0.5 + 40 - 19 + 0.0, 1e-12));
    }
  }
}

TEST_CASE("A swift body among many slow ones hits what is on its way, and what it drives hits on") {
  SimulationConfig<double> config = plain(1.0);
  config.coeffRestitution = 1;
  Space<double> space(config);
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 10; ++j) {
      for (int k = 0; k < 10; ++k) {
        space.addBody(ball({3.0 * i, 3.0 * j, 3.0 * k}, {0, 0, 0}, 0.5));
      }
    }
  }
  space.addBody(ball({-40, 12, 12}, {100, 0, 0}, 0.5));
  space.computeDynamics(0);
  CHECK(space.impacts().size() == 10);  // head on through the row of ten
  CHECK(space.contactReport().postponed == 0);
  CHECK_THAT(space.conserved().momentum[0], WithinRel(100.0, 1e-13));
}

// Galperin (2003, Regul. Chaotic Dyn. 8, 375): between a wall and a ball 100^k times as heavy that comes for
// it, there are as many blows as the first k + 1 digits of pi. Seen to fail: at most 256 blows of one body in
// a step, which then flies on through wall and ball.
TEST_CASE("A heavy ball, a light one and a wall count the digits of pi, many blows in a step") {
  for (const auto& [mass, blows] : {std::pair(1e4, 314U), std::pair(1e6, 3141U)}) {
    for (const double h : {1e-2, 1e-1}) {
      SimulationConfig<double> config = plain(h);
      config.coeffRestitution = 1;
      Space<double> space(config);
      space.addPlane({1, 0, 0}, 0);
      space.addBody(ball({5, 0, 0}, {0, 0, 0}, 0.25));
      space.addBody(ball({10, 0, 0}, {-1, 0, 0}, 0.5, mass));
      std::size_t count = 0;
      for (std::size_t i = 0; space.time() < 40; ++i) {
        space.computeDynamics(i);
        count += space.impacts().size();
      }
      CAPTURE(mass, h);
      CHECK(count == blows);
      CHECK_THAT(space.energyLedger().kinetic, WithinRel(mass / 2, 1e-11));  // a few roundings a blow
      CHECK(space.body(0).position()[0] > 0.25);
      CHECK(space.body(1).position()[0] - space.body(0).position()[0] > 0.75);
    }
  }
}

// Seen to fail: at most 256 blows in a step (at 0.1 s the ball leaves the slot at 5 m/s).
TEST_CASE("A ball in a slot between two held ones stays there, at a thousand blows a step") {
  for (const double speed : {1.0, 5.0, 10.0}) {
    SimulationConfig<double> config = plain(0.1);
    config.coeffRestitution = 1;
    Space<double> space(config);
    for (const double x : {0.0, 1.501}) {
      Body<double> held = ball({x, 0, 0}, {0, 0, 0}, 0.5);
      held.fixed = true;
      space.addBody(held);
    }
    space.addBody(ball({0.7505, 0, 0}, {speed, 0, 0}, 0.25));
    advance(space, 100);
    CAPTURE(speed);
    CHECK(space.impacts().size() == static_cast<std::size_t>(100 * speed));
    CHECK_THAT(space.body(2).position()[0], WithinAbs(0.7505, 0.5e-3 + 1e-12));
    CHECK_THAT(std::abs(space.body(2).velocity()[0]), WithinRel(speed, 1e-12));
  }
}

// Blow after blow of what is pressed between them ends in contact, not in a flight through. The heavy ball
// stops where the light one lies within v h, in the step of its fall and one more. Seen to fail: what struck
// a body that had had its share of blows flew on (overlaps of 0.07 to 0.11 r with e up to 0.5 at a ratio of
// 100).
TEST_CASE("A ball that falls on a grain on the floor does not sink into it, at ratios of mass to 100") {
  constexpr double r = 0.05;
  constexpr double h = 1e-3;
  for (const double mass : {1.0, 10.0, 100.0}) {
    for (const double e : {0.0, 0.1, 0.3, 0.5, 0.8, 0.95}) {
      SimulationConfig<double> config = plain(h);
      config.coeffRestitution = e;
      Space<double> space(config);
      space.setUniformField({0, 0, -9.81});
      space.addPlane({0, 0, 1}, 0);
      space.addBody(ball({0, 0, r}, {0, 0, 0}, r));
      space.addBody(ball({0, 0, 0.8}, {0, 0, -4}, 0.5, mass));
      double ofPair = 0;
      double ofFloor = 0;
      const double energy = space.energyLedger().total();
      for (std::size_t i = 0; i < 1000; ++i) {
        space.computeDynamics(i);
        const double low = space.body(0).position()[2];
        ofFloor = std::max(ofFloor, r - low);
        ofPair = std::max(ofPair, 0.5 + r - (space.body(1).position()[2] - low));
      }
      CAPTURE(mass, e, ofPair / r, ofFloor / r);
      CHECK(ofPair <= 4.5 * h);
      CHECK(ofFloor <= 4.5 * h / 2);
      CHECK(ofPair <= (mass < 50 ? 0.01 : 0.05) * r);
      CHECK_THAT(space.energyLedger().total(), WithinRel(energy, 1e-6));
    }
  }
}

TEST_CASE("The inelastic collapse of three balls on a line ends, and what is lost is booked") {
  for (const double e : {0.0, 0.05, 0.07}) {  // below 7 - 4 sqrt 3 = 0.0718 they meet without end
    SimulationConfig<double> config = plain(1e-2);
    config.coeffRestitution = e;
    Space<double> space(config);
    space.addBody(ball({-2, 0, 0}, {1, 0, 0}, 0.5));
    space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.5));
    space.addBody(ball({1.5, 0, 0}, {-1, 0, 0}, 0.5));
    const double energy = space.energyLedger().total();
    std::size_t most = 0;
    for (std::size_t i = 0; i < 400; ++i) {
      space.computeDynamics(i);
      most = std::max(most, space.impacts().size());
    }
    CAPTURE(e, most);
    CHECK(most < 100);
    CHECK_THAT(space.energyLedger().total(), WithinAbs(energy, 1e-14));
    CHECK(space.conserved().momentum.norm() < 1e-15);
    CHECK(space.energyLedger().kinetic < 1e-2);
  }
}

// Seen to fail: the new spin from the start of the step on.
TEST_CASE("A sliding bounce turns the body from the moment of the impact on") {
  // The orientation after a step with an impact at t is exp(w' (h - t)) exp(w t), exactly.
  SimulationConfig<double> config = plain(0.1);
  config.coeffRestitution = 1;
  config.coeffFriction = config.coeffStaticFriction = 10;
  Space<double> space(config);
  space.addPlane({0, 0, 1}, 0);
  space.addBody(ball({0, 0, 0.6}, {3, 0, -2}, 0.5, 1, {0, 1, 0}));
  space.computeDynamics(0);
  REQUIRE(space.impacts().size() == 1);
  const double t = space.impacts()[0].time;
  CHECK_THAT(t, WithinAbs(0.05, 1e-15));
  const Vec w = space.body(0).angularVelocity();
  const double angle = 1.0 * t + w[1] * (0.1 - t);
  const Eigen::Quaterniond q(space.body(0).orientation());
  CHECK_THAT(2 * std::atan2(q.y(), q.w()), WithinAbs(angle, 1e-15));
}

// Seen to fail: a pair passed over where a contact of its first ball comes next in the list of those held.
TEST_CASE("A ball that rests on another is struck by a bullet all the same, whoever has which id") {
  const double v = 300;
  for (const std::array<std::size_t, 3>& order :
       {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}) {
    CAPTURE(order[0], order[1], order[2]);
    SimulationConfig<double> config = plain(1e-2);  // three radii a step
    config.coeffRestitution = 1.0;
    config.positionalCorrectionFactor = 0;  // moves nobody
    Space<double> space(config);
    // Struck, its neighbour along x, and the bullet along y, frictionless: only the first two exchange.
    const std::array<Body<double>, 3> roles{ball({0, 0, 0}, {0, 0, 0}, 1.0, 1.0),
                                            ball({2 - 1e-9, 0, 0}, {0, 0, 0}, 1.0, 1.0),
                                            ball({0, -3.5, 0}, {0, v, 0}, 1.0, 1.0)};
    std::array<BodyId, 3> ids{};
    for (const std::size_t role : order) {
      ids[role] = space.addBody(roles[role]);
    }
    advance(space, 1);
    CHECK(space.contactReport().impacts >= 1);
    CHECK((Vec(space.body(ids[0]).velocity()) - Vec(0, v, 0)).norm() < 1e-12 * v);
    CHECK((Vec(space.body(ids[1]).velocity()) - Vec(0, 0, 0)).norm() < 1e-12 * v);
    CHECK(Vec(space.body(ids[2]).velocity()).norm() < 1e-12 * v);
  }
}

// A smooth table holds a ball across the wall's normal, and does not know of the wall. Seen to fail: a blow
// of what leans on others was rest below (|a_1| + |a_2|) h = 0.2 m/s, whatever way they lean (-0 for -0.05
// here).
TEST_CASE("However slow on a smooth table, an elastic ball bounces off walls, and a cradle passes blows on") {
  for (const double v : {0.5, 0.05, 0.005}) {
    CAPTURE(v);
    SimulationConfig<double> config = plain(1e-2);
    config.coeffRestitution = 1;
    Space<double> space(config);
    space.setUniformField({0, 0, -9.81});
    space.addPlane({0, 0, 1}, 0.0);
    space.addPlane({0, -1, 0}, -1.0);
    space.addBody(ball({0, 0.85, 0.1}, {0, v, 0}, 0.1));
    space.addBody(ball({5.0, 0, 0.1}, {v, 0, 0}, 0.1));
    for (int k = 0; k < 4; ++k) {
      space.addBody(ball({5.25 + 0.2 * k, 0, 0.1}, {0, 0, 0}, 0.1));
    }
    space.advanceTo(0.1 / v);
    CHECK_THAT(space.body(0).velocity()[1], WithinRel(-v, 1e-12));
    for (std::size_t k = 1; k < 6; ++k) {
      CHECK_THAT(space.body(k).velocity()[0], WithinAbs(k == 5 ? v : 0, 1e-12 * v));
    }
  }
}

// The principle of equivalence. Seen to fail: as above, where both lean on each other (46 % of the energy
// lost by three elastic balls; a cradle gave -1/2, 0, 1/2, 1/2, 1/2).
TEST_CASE("Touching balls that fall freely collide as they do in space") {
  const auto run = [](double g, double G) {
    SimulationConfig<double> config = plain(1e-2);
    config.coeffRestitution = 1;
    config.G = G;
    Space<double> space(config);
    space.setUniformField({0, 0, -g});
    const double off = G > 0 ? 0.05 : 0.0;
    space.addBody(ball({-0.25, off, 0}, {0.01, 0, 0}, 0.1));
    for (int k = 0; k < (G > 0 ? 2 : 4); ++k) {
      space.addBody(ball({0.2 * k, 0, 0}, {0, 0, 0}, 0.1));
    }
    space.advanceTo(10.0);
    std::vector<Vec> all;
    for (std::size_t i = 0; i < space.n(); ++i) {
      all.push_back(space.body(i).velocity() + Vec(0, 0, g * 10.0));
    }
    return all;
  };
  for (const double G : {0.0, 1e-6}) {
    const std::vector<Vec> inSpace = run(0.0, G);
    const std::vector<Vec> falling = run(9.81, G);
    for (std::size_t i = 0; i < inSpace.size(); ++i) {
      CAPTURE(G, i, inSpace[i].transpose(), falling[i].transpose());
      CHECK((falling[i] - inSpace[i]).norm() < 1e-4 * 0.01);  // places to 500 m have 1e-12 of a radius
    }
  }
}

// Masses 1 on 2, elastic: the lower one is driven into the floor with -2v/3, comes back and hits again; 7/9
// and 4/9 of v = sqrt(2 g d) leave. Seen to fail: what held the lower one counted for the whole step, so that
// it left by up to g h/2 too fast or too slow (0.067 m/s and 0.14 J too much at h = 1/64).
TEST_CASE("What a blow lifts off its floor leaves as a free body, whatever the step") {
  const double g = 9.81;
  for (const double drop : {0.2717, 0.3}) {
    for (const double steps : {16.0, 23.0, 100.0, 512.0}) {
      CAPTURE(drop, steps);
      SimulationConfig<double> config = plain(0.25 / steps);
      config.coeffRestitution = 1;
      Space<double> space(config);
      space.setUniformField({0, 0, -g});
      space.addPlane({0, 0, 1}, 0.0);
      Body<double> upper = ball({0, 0, 0.3 + drop}, {0, 0, 0}, 0.1);
      Body<double> lower = ball({0, 0, 0.1}, {0, 0, 0}, 0.1);
      upper.mass = 1;
      lower.mass = 2;
      space.addBody(lower);
      space.addBody(upper);
      const double energy = space.energyLedger().mechanical();
      while (space.time() < 0.27) {
        space.computeDynamics(space.steps());
      }
      const double v = std::sqrt(2 * g * drop);
      const double since = space.time() - v / g;
      CHECK_THAT(space.body(0).velocity()[2], WithinAbs(4 * v / 9 - g * since, 1e-12));
      CHECK_THAT(space.body(1).velocity()[2], WithinAbs(7 * v / 9 - g * since, 1e-12));
      CHECK_THAT(space.body(0).position()[2], WithinAbs(0.1 + since * (4 * v / 9 - g * since / 2), 1e-12));
      const EnergyLedger<double> ledger = space.energyLedger();
      CHECK_THAT(ledger.mechanical(), WithinAbs(energy, 1e-12));
      CHECK_THAT(ledger.restitution, WithinAbs(0, 1e-12));
    }
  }
}

// Along a smooth table, under the middle of a large ball. Seen to fail as above (0.229 and 0.182 m/s up with
// 16 and 20 steps). With another ball at its side, which it leaves along the touch, to the second order:
// normals are those of the straight way of the drift. Seen to fail where what stands at the side held it,
// too.
TEST_CASE("A small ball lifts a large one off the table by the same blow, whatever the step") {
  for (const auto& [e, side] : {std::pair{1.0, false}, {0.7, false}, {1.0, true}, {0.7, true}}) {
    std::vector<Vec> first;
    for (const double steps : {512.0, 16.0, 20.0, 50.0}) {
      CAPTURE(e, side, steps);
      SimulationConfig<double> config = plain(0.25 / steps);
      config.coeffRestitution = e;
      Space<double> space(config);
      space.setUniformField({0, 0, -9.81});
      space.addPlane({0, 0, 1}, 0.0);
      space.addBody(ball({0, 0, 0.1}, {0, 0, 0}, 0.1));
      space.addBody(ball({-0.2717, 0, 0.05}, {2, 0, 0}, 0.05));
      if (side) {
        space.addBody(ball({0, 0.2, 0.1}, {0, 0, 0}, 0.1));
      }
      const double energy = space.energyLedger().total();
      for (int k = 0; k < steps; ++k) {
        space.computeDynamics(space.steps());
      }
      const std::vector<Vec> all{space.body(0).velocity(), space.body(0).position(), space.body(1).velocity(),
                                 space.body(1).position()};
      first = first.empty() ? all : first;
      CHECK(all[1][2] > 0.1);
      for (std::size_t k = 0; k < all.size(); ++k) {
        CAPTURE(k, all[k].transpose(), first[k].transpose());
        CHECK((all[k] - first[k]).norm() < (side ? 9.81 * config.timeStep * config.timeStep : 1e-11));
      }
      CHECK_THAT(space.energyLedger().total(), WithinAbs(energy, 1e-12));
    }
  }
}

// Of equal masses the upper one takes all. Seen to fail: where the lower one fell freely from its blow with
// the floor on, it sank by g (h - t)^2/2 (4e-3 of its radius here) once the upper one had stopped it again.
TEST_CASE("What the blows of one moment bring back to rest on its floor stays there") {
  SimulationConfig<double> config = plain(0.25 / 16);
  config.coeffRestitution = 1;
  Space<double> space(config);
  space.setUniformField({0, 0, -9.81});
  space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 0.1}, {0, 0, 0}, 0.1));
  space.addBody(ball({0, 0, 0.3 + 0.2717}, {0, 0, 0}, 0.1));
  for (int k = 0; k < 20; ++k) {
    space.computeDynamics(space.steps());
    CHECK_THAT(space.body(0).position()[2], WithinAbs(0.1, 1e-14));
  }
  CHECK(space.body(1).velocity()[2] > 0);
}

// Who is held is looked up once a step, for pairs that blows make one look at. Seen to fail: where what was
// found in an earlier step counted, the struck ball sank into the other one by 0.026.
TEST_CASE("A pair that was held in an earlier step meets when a blow drives it together in this one") {
  SimulationConfig<double> config = plain(0.05);
  config.coeffRestitution = 0.5;
  Space<double> space(config);
  space.setUniformField({0, 0, -1});
  Body<double> base = ball({0, 0, 0}, {0, 0, 0}, 1);
  base.fixed = true;
  space.addBody(base);
  space.addBody(ball({0, 0, 2}, {0, 0, 0}, 1));
  space.addBody(ball({0, 0, 4.15}, {0, 0, -1}, 1));
  std::size_t blows = 0;
  for (int k = 0; k < 4; ++k) {
    space.computeDynamics(space.steps());
    blows += space.contactReport().impacts;
  }
  REQUIRE(blows > 0);
  space.body(1).position() = Vec(0, 0, 2.05);
  space.body(1).velocity() = Vec(0, 0, 0);
  space.body(2).position() = Vec(0, 0, 4.2);
  space.body(2).velocity() = Vec(0, 0, -5);
  space.computeDynamics(space.steps());
  const auto struck = space.impacts();
  REQUIRE(struck.size() >= 2);
  CHECK(struck[0].key1 == 1);
  CHECK(struck[1].key1 == 0);
  CHECK(space.body(1).position()[2] >= 2 - 1e-14);
}

// A ball lands on the flank of a fixed one, 45 degrees down, at u along the line of centres and about as fast
// across as it would leave at: v_t^2/d = (1 - slow) g cos(45). The blow leaves it the hop slow g cos(45) (h -
// t)/2, 0.15 h^2 at most here, and is dealt along the normal of the straight way, off from that of the curved
// one by a_t t (h - t)/(2 d). So along the latter it may still come, by v_t times that, 0.053 h^2 at most,
// and sink by 0.031 h^3 in the step. Seen to fail: struck again at the same moment without effect, up to its
// share of impacts, 3648 times in 13 of the 39 landings at each step.
TEST_CASE("What lands on a flank almost as fast as it would leave it is struck once") {
  const Vec n(std::sqrt(0.5), 0, std::sqrt(0.5));
  const Vec across(n[2], 0, -n[0]);
  const Vec g(0, 0, -1);
  const double u = 0.5;
  for (const double h : {0.01, 0.04}) {
    for (int k = -3; k <= 9; ++k) {
      for (const double phase : {0.25, 0.5, 0.75}) {
        const double slow = k * h / 16;
        CAPTURE(h, slow, phase);
        SimulationConfig<double> config = plain(h);
        config.coeffRestitution = 0;
        Space<double> space(config);
        space.setUniformField(g);
        Body<double> rock = ball({0, 0, 0}, {0, 0, 0}, 1);
        rock.fixed = true;
        space.addBody(rock);
        const Vec v = std::sqrt(2 * (1 - slow) * n[2]) * across - u * n;
        const double t = (1 + phase) * h;  // of the landing
        space.addBody(ball(2 * n - v * t + g * t * t / 2, v - g * t, 1));
        advance(space, 2);
        REQUIRE(!space.impacts().empty());
        CHECK(space.impacts().size() == 1);
        CHECK_THAT(space.impacts()[0].impulse.normal, WithinAbs(u, 0.21 * h * h));
        CHECK(Vec(space.body(1).position()).norm() > 2 - h * h * h / 30);
        advance(space, 2);
        CHECK(space.contactReport().impacts == 0);
      }
    }
  }
}

// No forces: every flight is straight, and the step makes no difference. What met without restitution, or
// touched as the step began, counts as in contact for the rest of the step; not so once it has flown apart.
// Blows grow rounding by the way over the radius, less than 100 times each. Seen to fail: such pairs flew
// through each other and through the floor (4.1 between centres in place of 2.05, an overlap of 0.013, a
// centre 7 below the floor).
TEST_CASE("A pair that was in contact and has flown apart in a step meets again in it, whatever the step") {
  const auto placesAfter = [](Space<double>& space, double end) {
    space.advanceTo(end);
    std::vector<double> x;
    for (std::size_t i = 0; i < space.n(); ++i) {
      const Vec at = space.body(i).position();
      x.insert(x.end(), at.begin(), at.end());
    }
    return x;
  };
  SECTION("balls without restitution: a bullet drives one after the other") {
    const auto run = [&](double h) {
      SimulationConfig<double> config = plain(h);
      config.coeffRestitution = 0;
      Space<double> space(config);
      const double q = std::sqrt(2.0);
      space.addBody(ball({-q - 1, q, 0}, {10, 0, 0}, 1, 1));  // meets the next one at 0.1
      space.addBody(ball({0, 0, 0}, {0, 0, 0}, 1, 1000));
      space.addBody(ball({-0.55, -10, 0}, {0, 20, 0}, 1, 10000));  // drives it after the first one at 0.4
      return placesAfter(space, 1);
    };
    CHECK(difference(run(1), run(1.0 / 16)) < 1e-12);
  }
  SECTION("balls that touched: walls send one back to the other") {
    const double overlap = 1e-9;  // what of it is left differs; it grows as rounding does
    const auto run = [&](double h) {
      SimulationConfig<double> config = plain(h);
      config.coeffRestitution = 0.5;
      Space<double> space(config);
      const double angle = 0.35;
      space.addBody(ball({0, 0, 0}, {0, 0, 0}, 1, 1));
      space.addBody(ball({0, -1.3 + overlap, 0}, {0, 0, 0}, 0.3, 1));
      space.addBody(ball({-1.1 * std::cos(angle) - 0.1, -1.1 * std::sin(angle), 0}, {20, 0, 0}, 0.1, 1));
      space.addPlane({0, -1, 0}, -1.1);
      space.addPlane({-1, 0, 0}, -1.2);
      return placesAfter(space, 0.2);
    };
    CHECK(difference(run(0.2), run(0.2 / 64)) < 1e3 * overlap);
  }
  SECTION("a ball on a floor without restitution: thrown up, and back by the ceiling") {
    SimulationConfig<double> config = plain(1.0);
    config.coeffRestitution = 0;
    Space<double> space(config);
    const MaterialId elastic = space.addMaterial({});
    space.setPairMaterial(defaultMaterial, elastic,
                          {.restitution = 1, .staticFriction = 0, .kineticFriction = 0});
    space.addPlane({0, 0, 1}, 0);
    space.addPlane({0, 0, -1}, -3, elastic);
    space.addBody(ball({0, 0, 2}, {0, 0, -10}, 1, 1));       // on the floor at 0.1
    space.addBody(ball({-7, 0, 0.3}, {30, 0, 0}, 0.1, 10));  // throws it up at 0.2
    space.computeDynamics(0);
    CHECK(space.body(0).velocity()[0] > 1);
    CHECK_THAT(space.body(0).position()[2], WithinAbs(1, 1e-12));
  }
}

// Two balls rest on each other by their own gravity; a third strikes one off. Seen to fail: let go without a
// push back on the other one, the sum of momenta changed by m a (t - h/2), 1.2e-3 here.
TEST_CASE("A blow that parts a pile in space keeps momentum and the centre of mass") {
  SimulationConfig<double> config = plain(1e-2);
  config.G = 1;
  config.coeffRestitution = 0.5;
  Space<double> space(config);
  space.addBody(ball({-1, 0, 0}, {0, 0, 0}, 1));
  space.addBody(ball({1, 0, 0}, {0, 0, 0}, 1));
  space.addBody(ball({0.4, -4, 0}, {0, 10, 0}, 1));
  for (int k = 0; k < 60; ++k) {
    space.computeDynamics(space.steps());
  }
  CHECK(space.body(1).velocity().norm() > 1);
  Vec momentum = Vec::Zero();
  Vec place = Vec::Zero();  // times the mass
  for (std::size_t i = 0; i < 3; ++i) {
    momentum += space.body(i).mass() * space.body(i).velocity();
    place += space.body(i).mass() * space.body(i).position();
  }
  const double m = space.body(2).mass();
  CHECK((momentum - m * Vec(0, 10, 0)).norm() < 1e-11 * m);
  CHECK((place - m * Vec(0.4, -4 + 10 * space.time(), 0)).norm() < 1e-11 * m);
}

// The line of centres at the blow, on the way as it is bent. Seen to fail: that of the straight way of the
// drift (1.3e-3 m/s at a hundredth of a second), which is for two that move: it exerts no torque on their
// places.
TEST_CASE("In a uniform field a bounce off a fixed ball is exact, whatever the step") {
  const double g = 9.81, reach = 0.2, aside = 0.05, height = 2, e = 0.7;
  const double up = std::sqrt(reach * reach - aside * aside);
  const double time = std::sqrt(2 * (height - up) / g);
  const Vec n(aside / reach, 0, up / reach);
  const Vec after = Vec(0, 0, -g * time) + (1 + e) * g * time * n[2] * n;
  for (const double h : {1e-2, 1e-3}) {
    SimulationConfig<double> config = plain(h);
    config.coeffRestitution = e;
    Space<double> space(config);
    space.setUniformField({0, 0, -g});
    Body<double> fixed = ball({0, 0, 0}, {0, 0, 0}, 0.1, 1.0);
    fixed.fixed = true;
    space.addBody(fixed);
    space.addBody(ball({aside, 0, height}, {0, 0, 0}, 0.1, 1.0));
    while (space.time() < time + 0.01) {
      space.computeDynamics(0);
    }
    const Vec expected = after - Vec(0, 0, g * (space.time() - time));
    CHECK((Vec(space.body(1).velocity()) - expected).norm() < 1e-12);
  }
}

// The way of the drift is none, but the path bends by 0.19 radii. Seen to fail: lists of neighbours that knew
// ways alone did not name the ceiling, and the ball went 0.19 radii into it.
TEST_CASE("A ball that turns back within a step strikes the ceiling that it reaches in it") {
  const double g = 9.8, h = 0.02, radius = 1e-3, gap = 0.3 * radius, up = g * h / 2;
  const double u = std::sqrt(up * up - 2 * g * gap);  // of the blow
  const double rest = h - (up - u) / g;
  for (const bool plane : {true, false}) {
    for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::Yoshida4}) {
      for (const std::size_t others : {0U, 200U}) {
        SimulationConfig<double> config = plain(h);
        config.coeffRestitution = 1;
        config.integrator = kind;
        Space<double> space(config);
        space.setUniformField({0, 0, -g});
        space.addBody(ball({0, 0, 0}, {0, 0, up}, radius));
        if (plane) {
          space.addPlane({0, 0, -1}, -radius - gap);
        } else {
          Body<double> above = ball({0, 0, 2 * radius + gap}, {0, 0, 0}, radius);
          above.fixed = true;
          space.addBody(above);
        }
        for (std::size_t i = 1; i <= others; ++i) {  // that stand
          Body<double> far = ball({1.0 * static_cast<double>(i), 0, -1}, {0, 0, 0}, radius);
          far.fixed = true;
          space.addBody(far);
        }
        space.computeDynamics(0);
        CAPTURE(plane, kind, others);
        CHECK(space.impacts().size() == 1);
        CHECK_THAT(space.body(0).position()[2], WithinAbs(gap - u * rest - g * rest * rest / 2, 1e-15));
        CHECK_THAT(space.body(0).velocity()[2], WithinAbs(-u - g * rest, 1e-13));
      }
    }
  }
}

// A blow late in a step puts the place from which a body would have come that way far from where it is. Seen
// to fail: the image nearest to that place was looked at, and the two went through each other.
TEST_CASE("In a periodic box what a blow sends back meets the image that is beside it") {
  SimulationConfig<double> config = plain(1.0);
  config.coeffRestitution = 1;
  for (const double turn : {0.0, 1.0}) {  // along x and along y
    for (const auto& domain : {Domain<double>::open(), Domain<double>::periodic({10, 10, 10}),
                               Domain<double>::shearPeriodic({10, 10, 10}, 1e-9)}) {
      config.integrator =
          domain.omega() > 0 ? IntegratorKind::SymplecticEpicycle : IntegratorKind::VelocityVerlet;
      Space<double> space(config);
      space.setDomain(domain);
      const Vec n = turn > 0 ? Vec(0, 1, 0) : Vec(1, 0, 0);
      space.addBody(ball(0 * n, 4 * n, 0.4));
      space.addBody(ball(-n, 4 * n, 0.4));
      Body<double> wall = ball(4 * n, {0, 0, 0}, 0.4);
      wall.fixed = true;
      space.addBody(wall);
      space.computeDynamics(0);
      CAPTURE(turn, domain.kind());
      // The first is back at 0.8 s, meets the second at 0.825 s, and the wall at 0.85 s.
      CHECK(space.impacts().size() == 3);
      const double exact = domain.omega() > 0 ? 1e-7 : 1e-13;
      CHECK((Vec(space.body(0).position()) - 2.6 * n).norm() < exact);
      CHECK((Vec(space.body(1).position()) - 1.6 * n).norm() < exact);
      CHECK((Vec(space.body(0).velocity()) + 4 * n).norm() < exact);
      CHECK((Vec(space.body(1).velocity()) + 4 * n).norm() < exact);
    }
  }
}

// Nothing was near its way before the blow. Seen to fail: looked for about the image nearest to where it
// would have begun its new way, 4.1 of 8 m from the ball that it meets.
TEST_CASE("In a periodic box what is thrown off its way meets a ball that was not near it") {
  SimulationConfig<double> config = plain(1.0);
  config.coeffRestitution = 1;
  Space<double> space(config);
  space.setDomain(Domain<double>::periodic({8, 8, 8}));
  const double v = 3.3, t = 0.9, aside = 1.1;
  const Vec turns(v * t, 0, 0);
  space.addBody(ball({0, 0, 0}, {v, 0, 0}, 0.4));
  space.addBody(ball(turns + Vec(0, aside, 0), {0, 0, 0}, 0.4));
  Body<double> fixed = ball(turns + 0.8 * Vec(1, -1, 0).normalized(), {0, 0, 0}, 0.4);
  fixed.fixed = true;
  space.addBody(fixed);
  for (int k = 0; k < 144; ++k) {  // so many that one swift body is compared with all
    fixed.position = Vec(0.6 * (k % 12) - 3.5, 0.6 * (k / 12) - 3.5, 3.5);
    space.addBody(fixed);
  }
  space.computeDynamics(0);
  CHECK(space.impacts().size() == 2);
  const double after = 1 - t - (aside - 0.8) / v;  // of the blow that drives the ball on
  CHECK((Vec(space.body(0).position()) - turns - Vec(0, aside - 0.8, 0)).norm() < 1e-14);
  CHECK((Vec(space.body(1).position()) - turns - Vec(0, aside + v * after, 0)).norm() < 1e-14);
}

// Closing speeds w in a box of edge 10 m, radii of 1 m in all: up to w = 8 of all images only the two looked
// at come near. Seen to fail: with the image that is nearest where the step begins, the swift one went
// through the ball ahead in all cases, and with a list that looks for no other than that also where it is one
// of many.
TEST_CASE("In a periodic box a swift body meets what is ahead of it by more than half an edge") {
  SimulationConfig<double> config = plain(1.0);
  config.coeffRestitution = 1;
  for (const auto& [ahead, w] : {std::pair{5.1, 4.2}, std::pair{5.5, 4.9}, std::pair{7.5, 6.9}}) {
    for (const auto& domain :
         {Domain<double>::periodic({10, 10, 10}), Domain<double>::shearPeriodic({10, 10, 10}, 1e-9)}) {
      for (const int others : {0, 144}) {
        for (const bool turned : {false, true}) {
          config.integrator =
              domain.omega() > 0 ? IntegratorKind::SymplecticEpicycle : IntegratorKind::VelocityVerlet;
          Space<double> space(config);
          space.setDomain(domain);
          space.addBody(ball({1, 0, 0}, turned ? Vec(0, 0, 0) : Vec(w, 0, 0), 0.5));
          space.addBody(ball({1 + ahead, 0, 0}, {0, 0, 0}, 0.5));
          if (turned) {  // by one that strikes it at once
            space.addBody(ball({-1e-9, 0, 0}, {w, 0, 0}, 0.5));
          }
          for (int k = 0; k < others; ++k) {
            Body<double> fixed = ball(Vec(0.6 * (k % 12) - 3.5, 0.6 * (k / 12) - 3.5, 3.5), {0, 0, 0}, 0.2);
            fixed.fixed = true;
            space.addBody(fixed);
          }
          space.computeDynamics(0);
          CAPTURE(ahead, w, domain.kind(), others, turned);
          CHECK(space.impacts().size() == (turned ? 2 : 1));
          const double exact = domain.omega() > 0 ? 1e-7 : 2e-9;  // the frame turns; the gap of 1e-9 m
          const Vec at(1 + ahead + w - (ahead - 1), 0, 0);
          CHECK(space.domain().minimumImage(Vec(space.body(1).position() - at), space.time()).norm() < exact);
          CHECK((Vec(space.body(1).velocity()) - Vec(w, 0, 0)).norm() < exact);
        }
      }
    }
  }
}

// Seen to fail: an approach below 16 roundings of the whole speed got no blow, nor was what then overlapped
// looked for.
TEST_CASE("Two that fly side by side, however fast, and drift together do not pass through each other") {
  for (const auto& [along, fast, slow, gap] :
       {std::tuple{Vec(0, 1, 0), 1e13, 1e-2, 1e-2}, std::tuple{Vec(0.6, 0.8, 0), 1e11, 1e-4, 1e-4}}) {
    SimulationConfig<double> config = plain(0.05);
    config.coeffRestitution = 1;
    Space<double> space(config);
    space.addBody(ball({-0.5 - gap / 2, 0, 0}, fast * along + Vec(slow, 0, 0), 0.5));
    space.addBody(ball({0.5 + gap / 2, 0, 0}, fast * along - Vec(slow, 0, 0), 0.5));
    double least = 2;
    for (int k = 0; k < 40; ++k) {
      space.computeDynamics(0);
      least = std::min(least, Vec(space.body(1).position() - space.body(0).position()).norm());
    }
    CAPTURE(fast);
    CHECK(least > 1 - 2 * slow * config.timeStep - 1e-15 * fast * space.time());
    CHECK(Vec(space.body(1).velocity() - space.body(0).velocity())[0] > 0);
  }
}

// Grains that hit at different moments of one step, far from each other, as on a plane: at t they turn back,
// and leave at e v. The large one, if it is free, gets n (1 + e) v m/M at most. Seen to fail: the share of
// impacts of a step was charged to the large one as to the grain, so that after 16 none bounced, and after 80
// all flew through it.
TEST_CASE(
    "Any number of grains bounce off a large body in one step, or merge with it, as fast as they come") {
  constexpr int n = 200;
  constexpr double e = 0.5, h = 0.1, radius = 0.1, mass = 1e-6, large = 1e6, R = 10;
  const auto [fixed, merge, v] = GENERATE(table<bool, bool, double>({{true, false, 10},
                                                                     {false, false, 10},
                                                                     {true, false, 1000},
                                                                     {false, false, 1000},
                                                                     {true, true, 1000},
                                                                     {false, true, 1000}}));
  CAPTURE(fixed, merge, v);
  SimulationConfig<double> config = plain(h);
  config.G = 0;
  config.coeffRestitution = e;
  Space<double> space(config);
  Body<double> target = ball({0, 0, 0}, {0, 0, 0}, R, large);
  target.fixed = fixed;
  space.addBody(target);
  if (merge) {
    space.setCollisionHook([](const Collision<double>&) { return CollisionOutcome<double>::merge(); });
  }
  const auto outwards = [](int i) {
    const double z = 1 - (2.0 * i + 1) / n;
    const double turn = 2.399963 * i;  // the golden angle
    return Vec(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z);
  };
  const auto moment = [](int i) { return h * (0.2 + 0.5 * i / n); };
  for (int i = 0; i < n; ++i) {
    space.addBody(ball((R + radius + v * moment(i)) * outwards(i), -v * outwards(i), radius, mass));
  }
  space.computeDynamics(0);
  if (merge) {
    CHECK(space.n() == 1);
    return;
  }
  CHECK(space.contactReport().postponed == 0);
  CHECK(space.impacts().size() == n);
  const double recoil = fixed ? 0.0 : n * (1 + e) * v * mass / large;
  for (int i = 0; i < n; ++i) {
    CAPTURE(i);
    const Vec out = outwards(i);
    const Vec left = space.body(static_cast<std::size_t>(i + 1)).velocity() - e * v * out;
    const Vec off =
        space.body(static_cast<std::size_t>(i + 1)).position() - (R + radius + e * v * (h - moment(i))) * out;
    CHECK(left.norm() <= (1 + e) * recoil + 1e-14 * v * (R + v * h) / radius);
    CHECK(off.norm() <= 3 * recoil * h + 1e-14 * v * h * (R + v * h) / radius);
  }
}

// Centres of grains, of which an overlap is taken away in the steps that follow. Seen to fail: what has used
// up its share flies on through all that it meets, and the heavier one of two is charged in part (12 to 34 of
// a block's 64 grains in the planet, 62 of 300 in a ball of ten times their mass).
TEST_CASE(
    "Grains that fly into something larger in one step do not end it inside, though they collapse on it") {
  constexpr double h = 0.1;
  const auto inside = [](const Space<double>& space, double R) {
    int count = 0;
    for (std::size_t i = 1; i < space.n(); ++i) {
      count += (space.body(i).position() - space.body(std::size_t{0}).position()).norm() < R ? 1 : 0;
    }
    return count;
  };
  SimulationConfig<double> config = plain(h);
  config.coeffFriction = config.coeffStaticFriction = 0.3;
  for (const double e : {0.0, 0.5}) {
    config.coeffRestitution = e;
    for (const double mass : {1e2, 1e9}) {
      Space<double> space(config);
      space.addBody(ball({0, 0, 0}, {0, 0, 0}, 10, mass));
      for (int k = 0; k < 64; ++k) {
        space.addBody(ball({12.0 + k / 16, k / 4 % 4 - 1.5, k % 4 - 1.5}, {-10 / h, 0, 0}, 0.5));
      }
      const double energy = space.energyLedger().total();
      space.computeDynamics(0);
      CAPTURE(e, mass);
      CHECK(space.contactReport().postponed > 20);
      CHECK(space.contactReport().impacts < 64 * 100);
      CHECK(inside(space, 10) == 0);
      CHECK_THAT(space.energyLedger().total(), WithinRel(energy, 1e-13));
    }
  }
  // 300 on a free ball of ten times their mass from all sides, and on one of twenty times their mass that
  // lies on a floor from half of them. Who went through would end the step at its centre. (Seen to fail on
  // the floor: each grain between two of its blows made the floor a new partner of the ball.)
  constexpr int n = 300;
  for (const bool onFloor : {false, true}) {
    for (const double e : {0.0, 0.5}) {
      config.coeffRestitution = e;
      Space<double> space(config);
      space.addBody(ball({0, 0, 0}, {0, 0, 0}, 3, onFloor ? 20 : 10));
      if (onFloor) {
        space.addPlane({0, 0, 1}, -3);
      }
      for (int i = 0; i < n; ++i) {
        const double z = 1 - (onFloor ? i + 0.5 : 2.0 * i + 1) / n;
        const double turn = 2.399963 * i;  // the golden angle
        const Vec out(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z);
        const double far = 4 + 5.0 * (i % 7);
        space.addBody(ball(far * out, -far / h * out, 0.2));
      }
      space.computeDynamics(0);
      CAPTURE(onFloor, e);
      CHECK(inside(space, 3) == 0);
    }
  }
}
