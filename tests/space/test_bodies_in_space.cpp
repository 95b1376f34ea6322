#include "support/catch.hpp"
#include "support/space.hpp"
#include "support/temporary_file.hpp"
#include <gravel/space/space.hpp>

#include <limits>

using namespace gravel;
using namespace gravel::test;

namespace test_bodies_in_space {

namespace {

using Vec = Vector3<double>;

SimulationConfig<double> quiet() {
  SimulationConfig<double> config;
  config.G = 0.0;
  config.adaptiveTimeStep = false;
  return config;
}

Body<double> at(const Vec& x, double radius = 0.5) {
  Body<double> body;
  body.position = x;
  body.radius = radius;
  return body;
}

}  // namespace

TEST_CASE("An index that is no body's is refused with the index and the number of bodies") {
  Space<double> space(quiet());
  CHECK_THROWS_AS(space.body(0), std::out_of_range);
  space.addBody(at({0, 0, 0}));
  space.addBody(at({5, 0, 0}));
  const Space<double>& view = space;
  CHECK_NOTHROW(space.body(1));
  CHECK_THROWS_WITH(space.body(2), ContainsSubstring("index is 2") && ContainsSubstring("n() = 2"));
  CHECK_THROWS_AS(view.body(std::numeric_limits<std::size_t>::max()), std::out_of_range);
  CHECK_THROWS_AS(space.body(BodyId{99}), std::out_of_range);
}

TEST_CASE("Ids stay while bodies come, go and are put in order, and are never given twice") {
  Space<double> space(quiet());
  std::vector<BodyId> ids;
  for (int k = 0; k < 20; ++k) {
    ids.push_back(space.addBody(at({3.0 * ((7 * k) % 20), 0, 0})));
  }
  space.removeBody(ids[3]);
  space.removeBody(ids[19]);
  CHECK(space.n() == 18);
  CHECK_THROWS_AS(space.body(ids[3]), std::out_of_range);
  CHECK_THROWS_AS(space.removeBody(ids[3]), std::out_of_range);
  space.computeDynamics(0);
  space.reorderBodies();
  space.computeDynamics(1);
  for (std::size_t k = 0; k < 20; ++k) {
    if (k != 3 && k != 19) {
      CHECK(space.body(ids[k]).id() == ids[k]);
      CHECK(space.body(ids[k]).position()[0] == 3.0 * static_cast<double>((7 * k) % 20));
    }
  }
  // Along a line the Morton order is the order in space.
  for (std::size_t i = 0; i + 1 < space.n(); ++i) {
    CHECK(space.body(i).position()[0] < space.body(i + 1).position()[0]);
  }
  const BodyId fresh = space.addBody(at({100, 0, 0}));
  CHECK(toInteger(fresh) > toInteger(ids[19]));
}

TEST_CASE("A body with a value out of range, or of an unknown material, is refused and not added") {
  Space<double> space(quiet());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Body<double> body = at({0, 0, 0});
  body.mass = -1.0;
  CHECK_THROWS_WITH(space.addBody(body), ContainsSubstring("mass") && ContainsSubstring("-1"));
  body.mass = 1.0;
  body.radius = nan;
  CHECK_THROWS_WITH(space.addBody(body), ContainsSubstring("radius") && ContainsSubstring("nan"));
  body = at({0, nan, 0});
  CHECK_THROWS_AS(space.addBody(body), std::invalid_argument);
  body = at({0, 0, 0});
  body.material = MaterialId{1};
  CHECK_THROWS_WITH(space.addBody(body), ContainsSubstring("material") && ContainsSubstring("is 1"));
  CHECK(space.n() == 0);
  const MaterialId steel =
      space.addMaterial({.restitution = 0.9, .staticFriction = 0.3, .kineticFriction = 0.2});
  CHECK(steel == MaterialId{1});
  CHECK_NOTHROW(space.addBody(body));
  CHECK_THROWS_AS(space.addPlane({0, 0, 1}, 0.0, MaterialId{2}), std::invalid_argument);
  // Written through a proxy: refused at the next step.
  space.body(0).setMaterial(MaterialId{7});
  CHECK_THROWS_WITH(space.computeDynamics(0), ContainsSubstring("material") && ContainsSubstring("7"));
}

TEST_CASE("An empty space only lets time pass") {
  SimulationConfig<double> config = quiet();
  config.timeStep = 0.25;
  Space<double> space(config);
  space.computeDynamics(0);
  space.computeDynamics(1);
  CHECK(space.time() == 0.5);
  CHECK(space.steps() == 2);
  CHECK(space.getPreviousTimeStep() == 0.25);
  CHECK(space.profiler().entry(Phase::Gravity).calls == 0);
  CHECK(space.profiler().entry(Phase::Integration).calls == 0);
  CHECK(space.energyLedger().total() == 0.0);
  CHECK(std::get<0>(space.getAllBodyTransforms()).empty());
  space.advanceTo(10.0);
  CHECK(space.time() == 10.0);
}

TEST_CASE("One body alone goes straight on, without gravity, search or contacts") {
  SimulationConfig<double> config = quiet();
  config.G = 1.0;
  config.timeStep = 0.25;
  Space<double> space(config);
  Body<double> body = at({0, 0, 0});
  body.velocity = {1, 2, 3};
  body.angularVelocity = {0, 0, 2};
  space.addBody(body);
  for (std::size_t i = 0; i < 8; ++i) {
    space.computeDynamics(i);
  }
  CHECK(space.body(0).position() == Vec(2, 4, 6));  // 1/4 is exact in binary
  CHECK(space.body(0).velocity() == Vec(1, 2, 3));
  const Quaternion<double> turned(Eigen::AngleAxisd(4.0, Vec::UnitZ()));
  CHECK((space.body(0).orientation().coeffs() - turned.coeffs()).norm() < 1e-14);
  CHECK(space.profiler().entry(Phase::Gravity).calls == 0);
  CHECK(space.profiler().entry(Phase::NeighbourSearch).calls == 0);
  CHECK(space.profiler().entry(Phase::ContactSolve).calls == 0);
}

TEST_CASE("Fixed bodies stay, whatever pulls, hits or overlaps them") {
  SimulationConfig<double> config = quiet();
  config.G = 1.0;
  Space<double> space(config);
  for (int k = 0; k < 5; ++k) {
    Body<double> body = at({0.7 * k, 0, 0});
    body.fixed = true;
    body.velocity = {1, 1, 1};  // a fixed body has none
    space.addBody(body);
  }
  space.setUniformField({0, 0, -9.81});
  for (std::size_t i = 0; i < 10; ++i) {
    space.computeDynamics(i);
  }
  for (std::size_t k = 0; k < 5; ++k) {
    CHECK(space.body(k).position() == Vec(0.7 * static_cast<double>(k), 0, 0));
    CHECK(space.body(k).velocity() == Vec::Zero());
  }
  CHECK(std::get<0>(space.calculateSystemEnergy()) == 0.0);
  CHECK(space.contactCount() == 0);  // two immovable bodies make none
}

// Against the same scene without them: what rests on it, rolls, hits it with spin, and merges with it; steps,
// parts and the ledger. Seen to fail: read by the solver of contacts (a ball at rest was dragged to 0.6 m/s,
// the ledger went from 9.8 J to 13.0 J), by impacts as a spin, and by each of the sums.
TEST_CASE("Velocities written to a fixed body count as zero") {
  for (const int kind : {0, 1, 2, 3, 4}) {
    SimulationConfig<double> config = quiet();
    config.coeffFriction = config.coeffStaticFriction = 0.5;
    config.rollingFriction = 0.01;
    config.tangentialRestitution = 0.3;
    config.timeStep = 5e-3;
    config.contactSubsteps = kind == 1 ? 0 : 1;
    config.adaptiveTimeStep = kind == 2 || kind == 3;
    config.G = kind == 3 ? 0.1 : 0.0;
    config.linearDamping = config.angularDamping = kind == 4 ? 0.1 : 0.0;
    const auto scene = [&](const Vec& v, const Vec& w) {
      Space<double> space(config);
      space.setUniformField({0, 0, -9.8});
      Body<double> rock = at({0, 0, 0});
      rock.fixed = true;
      const BodyId top = space.addBody(rock);
      rock.position[0] = 10;
      const BodyId target = space.addBody(rock);
      space.addBody(at({0, 0, 1}));
      Body<double> thrown = at({10.3, 0, 1.2});
      thrown.velocity = {-1, 0.5, -3};
      space.addBody(thrown);
      for (int i = 0; i < 50; ++i) {
        for (const BodyId id : {top, target}) {
          space.body(id).velocity() = v;
          space.body(id).angularVelocity() = w;
        }
        space.computeDynamics(0);
      }
      return space;
    };
    const Space<double> none = scene(Vec::Zero(), Vec::Zero());
    Space<double> some = scene({2, 1, -1}, {3, 4, 5});
    CAPTURE(kind);
    REQUIRE(none.body(3).angularVelocity().norm() > 0.1);  // it has hit the other one
    for (const std::size_t i : {2U, 3U}) {
      CHECK(some.body(i).position() == none.body(i).position());
      CHECK(some.body(i).velocity() == none.body(i).velocity());
      CHECK(some.body(i).angularVelocity() == none.body(i).angularVelocity());
    }
    CHECK(some.time() == none.time());
    CHECK(some.conserved().momentum == none.conserved().momentum);
    CHECK(some.conserved().angularMomentum == none.conserved().angularMomentum);
    CHECK(some.energyLedger().damping == none.energyLedger().damping);
    CHECK(some.energyLedger().total() == none.energyLedger().total());
    const double total = some.energyLedger().total();
    some.removeBody(some.body(0).id());
    CHECK_THAT(some.energyLedger().total(), WithinAbs(total, 1e-13));
    CHECK(some.body(0).position() == none.body(3).position());
  }
}

TEST_CASE("A fixed body pulls, and is hit as a wall") {
  SimulationConfig<double> config = quiet();
  config.G = 1.0;
  config.timeStep = 1e-3;
  config.coeffRestitution = 1.0;
  config.coeffFriction = 0.0;
  config.coeffStaticFriction = 0.0;
  config.positionalCorrectionFactor = 0.0;
  Space<double> space(config);
  Body<double> planet = at({0, 0, 0}, 1.0);
  planet.mass = 4.0;
  planet.fixed = true;
  space.addBody(planet);
  Body<double> stone = at({2, 0, 0}, 0.1);
  stone.mass = 1e-3;
  space.addBody(stone);
  space.computeDynamics(0);
  CHECK_THAT(space.body(1).acceleration()[0], WithinRel(-1.0, 1e-6));  // G M / r^2, a step on
  CHECK(space.body(0).acceleration() == Vec::Zero());
  CHECK_THAT(space.body(0).force()[0], WithinRel(1e-3, 1e-6));  // what holds it is not in the step's forces
  double fastest = 0;
  bool back = false;
  for (std::size_t i = 1; i < 3000; ++i) {
    space.computeDynamics(i);
    fastest = std::max(fastest, -space.body(1).velocity()[0]);
    back = back || space.body(1).velocity()[0] > 0.9 * fastest;
  }
  CHECK_THAT(fastest, WithinRel(std::sqrt(2 * 4.0 * (1 / 1.1 - 1 / 2.0)), 5e-3));  // first order in the step
  CHECK(back);
}

TEST_CASE("Energies of two bodies equal the hand formulas, softened and in a field") {
  SimulationConfig<double> config = quiet();
  config.G = 3.0;
  Space<double> space(config);
  Body<double> body = at({0, 0, 0}, 1.0);
  body.mass = 2.0;
  body.velocity = {0, 3, 4};
  body.angularVelocity = {0, 0, 5};
  space.addBody(body);
  body = at({0, 0, 10}, 1.0);
  body.mass = 7.0;
  space.addBody(body);
  const auto [translational, rotational, potential] = space.calculateSystemEnergy();
  CHECK_THAT(translational, WithinRel(25.0, 1e-15));
  CHECK_THAT(rotational, WithinRel(0.4 * 2 * 1 * 25 / 2, 1e-15));
  CHECK_THAT(potential, WithinRel(-3.0 * 2 * 7 / 10, 1e-14));
  space.setUniformField({0, 0, -2.0});
  CHECK_THAT(std::get<2>(space.calculateSystemEnergy()), WithinRel(-4.2 + 2 * 7 * 10, 1e-14));
  config.softening = 5.0;
  Space<double> soft(config);
  soft.addBody(space.body(0).load());
  soft.addBody(space.body(1).load());
  CHECK_THAT(std::get<2>(soft.calculateSystemEnergy()), WithinRel(-42 / std::sqrt(125.0), 1e-14));
}

TEST_CASE("Bodies that come and go take their energy with them, and the ledger says so") {
  SimulationConfig<double> config = quiet();
  config.G = 1.0;
  config.timeStep = 1e-4;
  Space<double> space(config);
  Body<double> body = at({0, 0, 0}, 0.1);
  body.velocity = {0.3, 0, 0};
  space.addBody(body);
  space.addBody(at({3, 0, 0}, 0.1));
  CHECK(space.energyLedger().exchange == 0.0);
  space.computeDynamics(0);
  const double before = space.energyLedger().total();
  body = at({0, 4, 0}, 0.2);
  body.mass = 5.0;
  body.velocity = {0, 1, 2};
  body.angularVelocity = {9, 0, 0};
  const BodyId id = space.addBody(body);
  CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-13));
  CHECK(space.energyLedger().exchange < -10.0);  // it came with 12.5 J of motion
  space.setG(2.0);
  CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-13));
  space.setUniformField({0, 0, -1});
  CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-13));
  space.removeBody(id);
  CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-13));
}

// Seen to fail: accelerations cleared by store(), which were then missing in the first half of the next step
// (half of the fall, a pile that sank, an orbit that opened).
TEST_CASE("A body that is written back as it was goes on with the same bits: fall, orbit and rest") {
  const auto run = [](double G, bool again) {
    SimulationConfig<double> config = quiet();
    config.G = G;
    Space<double> space(config);
    space.setUniformField({0, 0, G > 0 ? 0 : -9.81});
    space.addPlane({0, 0, 1}, -10);
    for (const double z : {1.0, 2.0, 40.0}) {
      space.addBody(at({0, 0, z - 10.5}));
    }
    space.body(2).velocity() = Vec(0.1, 0, 0);
    for (std::size_t i = 0; i < 200; ++i) {
      space.computeDynamics(i);
      for (std::size_t k = 0; again && k < 3; ++k) {
        auto body = space.body(k);
        body.store(body.load());
      }
    }
    std::vector<Vec> state;
    for (std::size_t k = 0; k < 3; ++k) {
      state.push_back(space.body(k).position());
      state.push_back(space.body(k).velocity());
    }
    state.push_back(Vec(space.energyLedger().total(), 0, 0));
    return state;
  };
  for (const double G : {0.0, 1.0}) {
    CHECK(run(G, true) == run(G, false));
  }
}

TEST_CASE("A storage with bodies in it is adopted as it is") {
  StorageOf<double, AoS> storage;
  storage.resize(2);
  storage.at(fields::Position{}, 1) = Vec(4, 0, 0);
  storage.at(fields::Mass{}, 0) = 1.0;
  storage.at(fields::Mass{}, 1) = 2.0;
  SimulationConfig<double> config = quiet();
  config.bodyCount = 1;  // and random ones after them
  Space<double, AoS> space(config, std::move(storage));
  CHECK(space.n() == 3);
  CHECK(space.body(1).position() == Vec(4, 0, 0));
  CHECK(space.body(1).id() == BodyId{1});
}

// Seen to fail: the body stayed, without an id that anybody knows.
TEST_CASE("A body is not added where the energy that it brings cannot be told") {
  SimulationConfig<double> config = quiet();
  config.G = 1.0;
  Space<double> space(config);
  space.addBody(at({0, 0, 0}));
  space.addBody(at({5, 0, 0}));
  space.computeDynamics(0);
  const double exchange = space.energyLedger().exchange;
  space.body(0).position()[0] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(space.addBody(at({9, 0, 0})), std::invalid_argument);
  CHECK(space.n() == 2);
  space.body(0).position()[0] = 0.0;
  CHECK(space.energyLedger().exchange == exchange);
  CHECK(space.body(space.addBody(at({9, 0, 0}))).position()[0] == 9.0);
}

// Seen to fail: it threw, and G was 1.
TEST_CASE("G stays as it was where the energy that another one brings cannot be told") {
  Space<double> space(quiet());
  space.addBody(at({0, 0, 0}));
  space.addBody(at({5, 0, 0}));
  space.computeDynamics(0);
  space.body(0).position()[0] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(space.setG(1.0), std::invalid_argument);
  CHECK(space.getG() == 0.0);
  space.body(0).position()[0] = 0.0;
  CHECK(space.energyLedger().exchange == 0.0);
  space.setG(1.0);
  CHECK_THAT(space.energyLedger().exchange, WithinRel(0.2, 1e-14));
}

// Seen to fail: what touched was looked for at the places in the list that bodies had.
TEST_CASE("What touched in the last step is told of the bodies that are there, where they are now") {
  SimulationConfig<double> config = quiet();
  config.coeffRestitution = 0.0;
  Space<double> space(config);
  space.setUniformField({0, 0, -1});
  space.addPlane({0, 0, 1}, 0.0);
  std::vector<BodyId> ids;
  for (int k = 4; k-- > 0;) {
    ids.push_back(space.addBody(at({0, 0, 0.5 + k})));
  }
  ids.push_back(space.addBody(at({8, 0, 3})));
  ids.push_back(space.addBody(at({9.001, 0, 3})));
  space.body(ids[4]).velocity()[0] = 1.0;
  space.computeDynamics(0);
  REQUIRE(space.impacts().size() == 1);
  REQUIRE(space.contacts().size() == 5);  // with the two that met, and go on together
  const auto touching = [&](BodyId a) {
    std::vector<BodyId> partners;
    const auto graph = space.collisionGraph();
    for (const std::size_t k : graph[space.bodies().indexOf(a)]) {
      partners.push_back(space.body(k).id());
    }
    std::sort(partners.begin(), partners.end());
    return partners;
  };
  const auto isTold = [&] {
    CHECK(touching(ids[3]) == std::vector<BodyId>{ids[2]});
    CHECK(touching(ids[4]) == std::vector<BodyId>{ids[5]});
    const Impact<double>& blow = space.impacts()[0];
    CHECK(toInteger(space.body(blow.first).id()) == blow.key1);
    for (const Contact<double>& c : space.contacts()) {
      CHECK(toInteger(space.body(c.first).id()) == c.key1);
    }
  };
  isTold();
  space.setUniformField({0, 0, -1.5});  // forces are to be found again
  space.reorderBodies();
  isTold();
  space.removeBody(ids[0]);
  space.removeBody(ids[1]);
  CHECK(touching(ids[2]) == std::vector<BodyId>{ids[3]});
  CHECK(touching(ids[4]) == std::vector<BodyId>{ids[5]});
  // The lowest ball presses on the floor with what it did. Of pairs the lowest is left, which carried three,
  // and the two that met at 1 m/s: half of that for each mass of 1 kg.
  CHECK_THAT(space.supportedWeight().load[2], WithinRel(-4.0, config.contactTolerance));
  const double blow = 0.5 / space.getPreviousTimeStep();
  CHECK_THAT(space.contactVirial().contacts, WithinRel(3.0 + blow, config.contactTolerance));
}

// In the order of ids, as contacts are, each partner was looked for in the list first: 0.6 s of one sphere
// that 40 000 others touch. Seen to fail: so.
TEST_CASE("The graph of collisions has the partners of a body once each, in the order of their indices") {
  Space<double> space(quiet());
  Body<double> middle = at({0, 0, 0});
  middle.fixed = true;
  space.addBody(middle);
  for (const double x : {0.999, -0.999}) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Vector3<double> place = Vector3<double>::Zero();
      place[axis] = x;
      space.addBody(at(place));
    }
  }
  space.reorderBodies();
  space.computeDynamics(0);
  const std::size_t i = space.bodies().indexOf(BodyId{0});
  std::vector<std::size_t> others;
  for (std::size_t k = 0; k < space.n(); ++k) {
    if (k != i) {
      others.push_back(k);
    }
  }
  CHECK(space.collisionGraph()[i] == others);
}

// Seen to fail: contacts() and impacts() went on naming the indices of before, that of the last body among
// them.
TEST_CASE(
    "Contacts, impacts and their impulses follow bodies that are removed, in any order and through a file") {
  const TemporaryFile file("removal");
  const auto scene = [] {
    SimulationConfig<double> config = quiet();
    config.coeffRestitution = 0.0;
    Space<double> space(config);
    space.setUniformField({0, 0, -1});
    space.addPlane({0, 0, 1}, 0.0);
    for (int k = 0; k < 6; ++k) {
      Body<double> one = at({3.0 * k, 0, 0.5});
      one.mass = 1.0 + k;
      space.addBody(one);
    }
    for (int k = 0; k < 3; ++k) {
      Body<double> one = at({3.0 * k, 10, 5});
      one.velocity[0] = 1.0;
      space.addBody(one);
      one.position[0] += 1.001;
      one.velocity[0] = 0.0;
      space.addBody(one);
    }
    space.computeDynamics(0);
    return space;
  };
  const auto isTold = [](const Space<double>& space, std::size_t onFloor, std::size_t blows) {
    REQUIRE(space.contacts().size() == onFloor + blows);  // those that met go on together
    REQUIRE(space.impacts().size() == blows);
    CHECK(space.contactCount() == onFloor + blows);
    const auto impulses = space.contactImpulses();
    REQUIRE(impulses.size() == onFloor + blows);
    for (std::size_t k = 0; k < impulses.size(); ++k) {
      const Contact<double>& c = space.contacts()[k];
      CHECK(toInteger(space.body(c.first).id()) == c.key1);
      if (c.second == staticPartner) {
        CHECK_THAT(impulses[k].normal,
                   WithinRel(space.body(c.first).mass() * space.getPreviousTimeStep(), 1e-9));
      } else {
        CHECK(toInteger(space.body(c.second).id()) == c.key2);
      }
    }
    for (const Impact<double>& blow : space.impacts()) {
      CHECK(toInteger(space.body(blow.first).id()) == blow.key1);
      CHECK(toInteger(space.body(blow.second).id()) == blow.key2);
    }
  };
  Space<double> space = scene();
  Space<double> unseen = scene();
  isTold(space, 6, 3);
  const auto remove = [&](std::uint64_t id) {
    space.removeBody(BodyId{id});
    unseen.removeBody(BodyId{id});
  };
  remove(0);  // the last one, which was struck, takes its index
  isTold(space, 5, 3);
  remove(6);
  isTold(space, 5, 2);
  remove(11);
  remove(3);
  isTold(space, 4, 1);
  space.reorderBodies();
  unseen.reorderBodies();
  isTold(space, 4, 1);
  space.save(file.path());
  Space<double> again;
  again.restore(file.path());
  CHECK(again.contacts().size() == 5);
  for (const Contact<double>& c : again.contacts()) {
    CHECK(toInteger(again.body(c.first).id()) == c.key1);
  }
  const BodyId late = space.addBody(at({20, 0, 0.5}));
  unseen.addBody(at({20, 0, 0.5}));
  again.addBody(at({20, 0, 0.5}));
  isTold(space, 4, 1);
  // Who looked changes nothing.
  for (int k = 0; k < 5; ++k) {
    for (Space<double>* one : {&space, &unseen, &again}) {
      one->computeDynamics(0);
    }
  }
  CHECK(space.contacts().size() == 6);
  for (std::size_t i = 0; i < space.n(); ++i) {
    for (const Space<double>* one : {&unseen, &again}) {
      const BodyId id = space.body(i).id();
      CHECK(one->body(id).position() == space.body(i).position());
      CHECK(one->body(id).velocity() == space.body(i).velocity());
    }
  }
  CHECK(toInteger(late) == 12);
}

TEST_CASE("A sphere that would touch its own image is refused before anything moves") {
  Space<double> space(quiet());
  space.setDomain(Domain<double>::periodic({4, 3, 5}));
  space.addBody(at({0, 0, 0}, 1.4));
  space.body(0).velocity()[0] = 1.0;
  CHECK_NOTHROW(space.computeDynamics(0));
  const double x = space.body(0).position()[0];
  space.addBody(at({1, 1, 1}, 1.6));
  CHECK_THROWS_WITH(space.computeDynamics(1),
                    ContainsSubstring("radius of body 1 is 1.6; allowed: at most half"));
  CHECK(space.body(0).position()[0] == x);
}

TEST_CASE("What the next step would refuse can be asked for without a step") {
  Space<double> space(quiet());
  CHECK_NOTHROW(space.check());
  space.addBody(at({0, 0, 0}, 1.6));
  CHECK_NOTHROW(std::as_const(space).check());
  space.body(0).setMaterial(MaterialId{7});
  CHECK_THROWS_WITH(space.check(), ContainsSubstring("material of body 0 is 7"));
  space.body(0).setMaterial(defaultMaterial);
  space.body(0).mass() = -1.0;
  CHECK_THROWS_WITH(space.check(), ContainsSubstring("mass of body 0 is -1"));
  space.body(0).mass() = 1.0;
  space.setDomain(Domain<double>::periodic({4, 3, 5}));
  CHECK_THROWS_WITH(space.check(), ContainsSubstring("radius of body 0 is 1.6; allowed: at most half"));
  CHECK(space.time() == 0.0);

  SimulationConfig<double> config = quiet();
  config.integrator = IntegratorKind::WisdomHolman;
  Space<double> planets(config);
  Body<double> sun = at({0, 0, 0}, 0.0);
  sun.fixed = true;
  planets.addBody(sun);
  CHECK_THROWS_WITH(planets.check(), ContainsSubstring("body 0 with the integrator WisdomHolman is fixed"));
  planets.body(0).setFixed(false);
  CHECK_NOTHROW(planets.check());
  planets.body(0).mass() = 0.0;
  CHECK_THROWS_WITH(planets.check(), ContainsSubstring("largest mass with the integrator WisdomHolman is 0"));
}

// Seen to fail: check() had nothing to say, and reports were those of a step of 0.002.
TEST_CASE("A planet without an orbit is refused before anything is changed, and can be asked for") {
  SimulationConfig<double> config = quiet();
  config.integrator = IntegratorKind::WisdomHolman;
  Space<double> planets(config);
  planets.addBody(at({0, 0, 0}, 0.0));
  planets.addBody(at({1, 0, 0}, 0.0));
  planets.computeDynamics(0);
  const double last = planets.getPreviousTimeStep();
  const std::uint64_t evaluations = planets.profiler().entry(Phase::Gravity).calls;
  planets.setTimeStep(2 * last);
  CHECK_NOTHROW(planets.check());
  planets.body(1).position() = Vector3<double>(planets.body(0).position());
  CHECK_THROWS_WITH(planets.check(), ContainsSubstring("of body 1 from the centre of mass"));
  CHECK_THROWS_WITH(planets.computeDynamics(1), ContainsSubstring("of body 1 from the centre of mass"));
  CHECK(planets.getPreviousTimeStep() == last);
  CHECK(planets.profiler().entry(Phase::Gravity).calls == evaluations);
  planets.body(1).position()[0] += 1.0;
  CHECK_NOTHROW(planets.computeDynamics(1));
}

// Seen to fail: taken, and refused by the first step as the margin of a search, of no body.
TEST_CASE("A radius whose square is no number is refused with its body") {
  Space<double> space(quiet());
  for (const double radius : {1e308, 3.4e153, 1.4e-154, 1e-170}) {
    CAPTURE(radius);
    CHECK_THROWS_WITH(space.addBody(at({0, 0, 0}, radius)),
                      ContainsSubstring("radius of body 0 is ") && ContainsSubstring("allowed: 0, or 1.49") &&
                          ContainsSubstring("e-154 to 3.35") && ContainsSubstring("e+153"));
  }
  space.addBody(at({0, 0, 0}, 3.3e153));
  space.addBody(at({1e154, 0, 0}, 1.5e-154));
  CHECK_NOTHROW(space.computeDynamics(0));
}

// Seen to fail: the orientation was not a number after the blow, for the square of the spin was none.
TEST_CASE("A grain that a blow spins up beyond all measure keeps an orientation") {
  SimulationConfig<double> config = quiet();
  config.coeffFriction = config.coeffStaticFriction = 0.5;
  config.timeStep = 1e-2;
  Space<double> space(config);
  Body<double> grain = at({0.105, 0.03, 0}, 1e-153);
  grain.velocity = Vector3<double>(-1e6, 0.3e6, 0.1e6);
  space.addBody(grain);
  space.addBody(at({0, 0, 0}, 0.1));
  for (std::size_t k = 0; k < 20; ++k) {
    CHECK_NOTHROW(space.computeDynamics(k));
  }
  CHECK(space.body(0).angularVelocity().norm() > 1e155);
  CHECK(std::abs(space.body(0).orientation().norm() - 1.0) < 1e-15);
}

// Seen to fail: the energy of what leaves asked for in any case, which a sum of gravity refuses.
TEST_CASE("Bodies whose numbers were spoiled can be removed, one after the other, and the others go on") {
  SimulationConfig<double> config = quiet();
  config.G = 1.0;
  Space<double> space(config);
  for (int k = 0; k < 4; ++k) {
    space.addBody(at({2.0 * k, 0, 0}));
  }
  space.computeDynamics(0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const BodyId first = space.body(1).id();
  const BodyId second = space.body(2).id();
  space.body(first).position()[0] = nan;
  space.body(second).velocity()[1] = nan;
  CHECK_THROWS_AS(space.computeDynamics(1), std::invalid_argument);
  space.removeBody(second);
  CHECK_THROWS_AS(space.computeDynamics(1), std::invalid_argument);
  space.removeBody(first);
  space.computeDynamics(1);
  CHECK(space.n() == 2);
  CHECK(std::isfinite(space.energyLedger().total()));
}

// Seen to fail: the ledger had no number for ever after, or lacked what the other body got (2 J).
TEST_CASE("A field that is set while a place is no number leaves the ledger one") {
  Space<double> space(quiet());
  space.addBody(at({0, 0, 0}));
  space.addBody(at({0, 0, 2}));
  space.computeDynamics(0);
  space.body(0).position()[0] = std::numeric_limits<double>::quiet_NaN();
  space.setUniformField({0, 0, -1});
  space.body(0).position()[0] = 0.0;
  CHECK(space.energyLedger().total() == 0.0);
}

// Seen to fail: neither the body of no mass nor any other could be removed.
TEST_CASE("A body whose mass was spoiled can be removed, and so can others beside it") {
  for (const double mass : {std::numeric_limits<double>::quiet_NaN(), -1.0}) {
    SimulationConfig<double> config = quiet();
    config.G = 1.0;
    Space<double> space(config);
    for (const double x : {0.0, 5.0, 10.0, 15.0}) {
      space.addBody(at({x, 0, 0}));
    }
    space.computeDynamics(0);
    space.body(BodyId{1}).mass() = mass;
    space.removeBody(BodyId{2});
    space.removeBody(BodyId{1});
    CHECK(space.n() == 2);
    CHECK(std::isfinite(space.energyLedger().total()));
    space.computeDynamics(1);
  }
}

// Only a sum over pairs needs the others. Seen to fail: each removal looked at all of them, and booked
// nothing because of the second.
TEST_CASE("Without gravity what leaves is booked whatever others' numbers are: they are not looked at") {
  Space<double> space(quiet());
  for (int k = 0; k < 3; ++k) {
    space.addBody(at({3.0 * k, 0, 0}));
  }
  space.body(0).velocity() = Vector3<double>(2, 0, 0);
  space.computeDynamics(0);
  const double before = space.energyLedger().total();
  CHECK(before > 1);
  space.body(1).position()[0] = std::numeric_limits<double>::quiet_NaN();
  space.removeBody(BodyId{0});
  space.removeBody(BodyId{1});
  CHECK(space.energyLedger().total() == before);
}

// Seen to fail: what contacts had done to its velocity in the step before was taken for support (it left
// with 1.0).
TEST_CASE("A body lifted off the floor and thrown down bounces as one that came that way") {
  for (const bool rested : {true, false}) {
    SimulationConfig<double> config = quiet();
    config.timeStep = 1e-2;
    config.coeffRestitution = 1;
    Space<double> space(config);
    space.setUniformField({0, 0, -9.8});
    space.addPlane({0, 0, 1}, 0.0);
    space.addBody(at({0, 0, 0.5}));
    if (rested) {
      space.advanceTo(0.1);
    }
    space.body(0).position()[2] = 0.505;
    space.body(0).velocity()[2] = -1;
    space.computeDynamics(0);
    // -v'(0.5) = sqrt(1 + 2 9.8 0.005) after t = (that - 1)/9.8, and up again for the rest of the step.
    const double down = std::sqrt(1 + 2 * 9.8 * 0.005);
    CHECK_THAT(space.body(0).velocity()[2], WithinRel(down - 9.8 * (1e-2 - (down - 1) / 9.8), 1e-12));
  }
}

// A few micrometres above the floor at the start of a step. Seen to fail: where contacts were found anew it
// was taken to rest, and left with 0.86 to 1.25 of its speed.
TEST_CASE("A ball about to land bounces alike, whatever is changed elsewhere") {
  const double g = 9.81;
  const double h = 1e-3;
  for (const double speed : {1.6, 2.0, 3.0, 8.0, 20.0}) {  // in g h
    for (int change = 0; change < 7; ++change) {
      for (const bool onBall : {false, true}) {
        INFO("speed " << speed << ", change " << change << ", on a ball " << onBall);
        SimulationConfig<double> config = quiet();
        config.timeStep = h;
        config.coeffRestitution = 0.8;
        Space<double> space(config);
        space.setUniformField({0, 0, -g});
        space.addPlane({0, 0, 1}, onBall ? -50.0 : 0.0);
        const std::size_t far = space.addPlane({1, 0, 0}, -100.0);
        const double low = 0.3 * g * h * h;
        const double v = -speed * g * h;
        Body<double> lands = at({0, 0, 0.5 + low - v * h - g * h * h / 2}, 0.5);
        lands.velocity[2] = v + g * h;
        const BodyId id = space.addBody(lands);
        Body<double> fixed = at({0, 0, onBall ? -0.5 : 40.0}, 0.5);
        fixed.fixed = true;
        space.addBody(fixed);
        fixed.position = Vec(50, 0, 50);
        const BodyId other = space.addBody(fixed);
        const BodyId moving = space.addBody(at({20, 0, 50}));
        space.computeDynamics(0);
        if (change == 1) {
          space.setUniformField({0, 0, -g});
        } else if (change == 2) {
          space.body(other).position()[0] += 0.1;
        } else if (change == 3) {
          space.body(moving).mass() = 2;
        } else if (change == 4) {
          space.addBody(at({30, 0, 50}));
        } else if (change == 5) {
          space.removePlane(far);
        } else if (change == 6) {
          space.setDomain(Domain<double>::open());
        }
        space.computeDynamics(1);
        const auto up = space.body(id);
        const double energy = up.velocity()[2] * up.velocity()[2] + 2 * g * (up.position()[2] - 0.5);
        CHECK_THAT(energy, WithinRel(0.64 * (v * v + 2 * g * low), 1e-9));
        CHECK(space.energyLedger().restitution > 0);
      }
    }
  }
}

// Seen to fail without G: the contact across the old box was solved once more, over nine metres.
TEST_CASE("Another domain has other contacts at once") {
  for (const double G : {0.0, 1e-30}) {
    SimulationConfig<double> config = quiet();
    config.timeStep = 1e-2;
    config.G = G;
    Space<double> space(config);
    space.setDomain(Domain<double>::periodic({10, 10, 10}));
    space.addBody(at({-4.51, 0, 0}));
    space.addBody(at({4.51, 0, 0}));
    space.computeDynamics(0);
    space.setDomain(Domain<double>::open());
    space.body(1).velocity()[0] = 1;
    space.computeDynamics(1);
    CHECK_THAT(space.body(0).velocity()[0], WithinAbs(0.0, 1e-15));
    CHECK_THAT(space.body(1).velocity()[0], WithinAbs(1.0, 1e-15));
  }
}

}  // namespace test_bodies_in_space
