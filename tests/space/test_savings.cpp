#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/temporary_file.hpp"

// What is there but not needed costs nothing and changes no bit.

using namespace gravel;
using namespace gravel::test;

namespace {

Space<double> scene(SimulationConfig<double> config, double G = 0.0) {
  config.G = G;
  Space<double> space(config);
  scenes::CloudOptions options;
  options.count = 120;
  options.radius = 1.0;
  options.bodyRadius = {0.05, 0.15};
  options.density = {10.0, 20.0};
  options.velocityDispersion = 0.7;
  for (Body<double> body : scenes::rubbleCloud<double>(options)) {
    body.velocity -= 2 * body.position;  // they meet soon
    space.addBody(body);
  }
  return space;
}

template <class Change>
void checkSame(Change&& change, double G = 0.0, SimulationConfig<double> config = plain(2e-3)) {
  Space<double> absent = scene(config, G);
  Space<double> present = scene(config, G);
  change(present);
  std::size_t contacts = 0;
  for (std::size_t i = 0; i < 200; ++i) {
    absent.computeDynamics(i);
    present.computeDynamics(i);
    contacts += absent.contactCount();
  }
  CHECK(contacts > 100);
  CHECK(sameBits(stateOf(absent), stateOf(present)));
}

}  // namespace

TEST_CASE("A plane far away changes no bit") {
  checkSame([](Space<double>& space) { space.addPlane({0, 0, 1}, -1e3); });
  checkSame([](Space<double>& space) { space.addPlane({0, 0, 1}, -1e3); }, 1e-3);
}

TEST_CASE("A material that nobody has changes no bit") {
  checkSame([](Space<double>& space) { space.addMaterial({.restitution = 0.1}); });
}

TEST_CASE("A hook that adds nothing changes no bit") {
  checkSame([](Space<double>& space) { space.setForceHook([](Bodies<double, SoA>&, double) {}); }, 1e-3);
}

// Seen to fail: the power of the hook that is gone, by its last forces, was in one of the files.
TEST_CASE("A hook that was taken away leaves nothing in a file") {
  Space<double> space(plain(1e-3));
  space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.5));
  space.setForceHook([](Bodies<double, SoA>& bodies, double) { bodies[0].force() += Vec(3, 0, 0); });
  advance(space, 2);
  space.setForceHook({});
  const TemporaryFile file("gone");
  space.save(file.path());
  Space<double> other;
  other.restore(file.path());
  advance(space, 2);
  advance(other, 2);
  const TemporaryFile one("one");
  const TemporaryFile two("two");
  space.save(one.path());
  other.save(two.path());
  CHECK(one.bytes() == two.bytes());
}

TEST_CASE("Diagnostics, ledgers and other looks change no bit") {
  checkSame(
      [](Space<double>& space) {
        space.setDiagnosticsEnabled(true);
        space.setLog([](const char*) {});
      },
      1e-3);
  SimulationConfig<double> config = plain(2e-3);
  Space<double> watched = scene(config, 1e-3);
  Space<double> alone = scene(config, 1e-3);
  for (std::size_t i = 0; i < 100; ++i) {
    watched.computeDynamics(i);
    (void)watched.energyLedger();
    (void)watched.conserved();
    (void)watched.collisionGraph();
    (void)watched.getDataForDisplay();
    alone.computeDynamics(i);
  }
  CHECK(sameBits(stateOf(watched), stateOf(alone)));
}

TEST_CASE("The broad phase is a matter of speed alone") {
  for (const BroadPhaseKind kind : {BroadPhaseKind::AllPairs, BroadPhaseKind::KDTree, BroadPhaseKind::Grid}) {
    SimulationConfig<double> automatic = plain(2e-3);
    automatic.coeffFriction = automatic.coeffStaticFriction = 0.4;
    SimulationConfig<double> chosen = automatic;
    chosen.broadPhase = kind;
    Space<double> one = scene(automatic);
    Space<double> two = scene(chosen);
    advance(one, 200);
    advance(two, 200);
    CHECK(sameBits(stateOf(one), stateOf(two)));
  }
}

// The skin of the neighbour list follows the motion, and reordering makes it anew: candidates are kept and
// renewed at other times beside one far, fast body more.
TEST_CASE("When neighbours were last looked for changes no bit") {
  Space<double> one = scene(plain(2e-3));
  Space<double> two = scene(plain(2e-3));
  const BodyId far = two.addBody(ball({1e3, 0, 0}, {300, 0, 0}, 0.1));
  std::size_t contacts = 0;
  for (std::size_t i = 0; i < 200; ++i) {
    one.computeDynamics(i);
    two.computeDynamics(i);
    contacts += one.contactCount();
    if (i % 7 == 3) {
      two.reorderBodies();
    }
  }
  two.removeBody(far);
  CHECK(contacts > 100);
  CHECK(sameBits(stateOf(one), stateOf(two)));
}

// Contacts of the last step that overlaps with others moved apart are in some lists of neighbours and not in
// others. Seen to fail: they counted for what bears a body where they were listed (other bits from step 1
// on).
TEST_CASE("Nor does it where spheres overlap by half and are thrown apart in a box") {
  const auto crowd = [] {
    SimulationConfig<double> config = plain(1e-3);
    config.coeffRestitution = 0.9;
    config.coeffFriction = config.coeffStaticFriction = 0.3;
    config.contactIterations = 20;
    Space<double> space(config);
    space.setUniformField({0, 0, -2});
    space.addBox({-1, -1, -1}, {1, 1, 1});
    const CounterRandom random(35);
    for (std::uint64_t k = 0; k < 40; ++k) {
      const auto u = [&](std::uint64_t c) { return random.uniform(7 * k + c, -1.0, 1.0); };
      space.addBody(ball({u(0), u(1), u(2)}, {u(3) / 2, u(4) / 2, u(5) / 2}, 0.3 + 0.2 * u(6)));
    }
    return space;
  };
  Space<double> kept = crowd();
  Space<double> anew = crowd();
  for (std::size_t i = 0; i < 40; ++i) {
    kept.computeDynamics(i);
    anew.computeDynamics(i);
    anew.reorderBodies();
  }
  CHECK(kept.contactCount() > 40);
  CHECK(sameBits(stateOf(kept), stateOf(anew)));
}

TEST_CASE(
    "Friction of coefficient zero is no friction: spins stay, and others move to the bit as without them") {
  const SimulationConfig<double> config = plain(2e-3);
  Space<double> still = scene(config);
  Space<double> spinning = scene(config);
  const auto spin = [](std::size_t i) { return Vec(1, -2, 0.5 * static_cast<double>(i)); };
  for (std::size_t i = 0; i < spinning.n(); ++i) {
    spinning.body(i).angularVelocity() = spin(i);
  }
  std::size_t blows = 0;
  for (int k = 0; k < 200; ++k) {
    advance(still, 1);
    advance(spinning, 1);
    blows += still.impacts().size();
  }
  CHECK(blows > 100);
  for (std::size_t i = 0; i < still.n(); ++i) {
    CHECK(Vec(spinning.body(i).position()) == Vec(still.body(i).position()));
    CHECK(Vec(spinning.body(i).velocity()) == Vec(still.body(i).velocity()));
    CHECK(Vec(spinning.body(i).angularVelocity()) == spin(i));
  }
}

TEST_CASE("What is not needed is skipped, and the report says why") {
  Space<double> space = scene(plain(2e-3));
  advance(space, 3);
  const Profiler& p = space.profiler();
  CHECK(p.entry(Phase::Gravity).calls == 0);
  CHECK(p.entry(Phase::Gravity).skips > 0);
  CHECK(std::string(p.entry(Phase::Gravity).reason) == "G is 0");
  CHECK(p.entry(Phase::Damping).calls == 0);
  CHECK(p.entry(Phase::TimeStep).calls == 0);
  CHECK(p.entry(Phase::Diagnostics).calls == 0);
  CHECK(p.entry(Phase::Integration).calls == 3);
  SimulationConfig<double> config = plain(2e-3);
  config.G = 1.0;
  Space<double> points(config);
  points.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.0));
  points.addBody(ball({1, 0, 0}, {0, 1, 0}, 0.0));
  advance(points, 3);
  CHECK(points.profiler().entry(Phase::Gravity).calls > 0);
  CHECK(points.profiler().entry(Phase::NeighbourSearch).calls == 0);
  CHECK(points.profiler().entry(Phase::ContactSolve).calls == 0);
}
