#include "laws/laws.hpp"
#include "support/catch.hpp"
#include "support/space.hpp"

#include <cstdlib>
#include <functional>
#include <limits>
#include <new>

using namespace gravel;
using namespace gravel::test;

namespace {

thread_local long allowed = -1;  // pieces of memory until there is no more; below 0: as many as are asked for

void* pieceOrNone(std::size_t bytes) noexcept {
  void* memory = allowed == 0 ? nullptr : std::malloc(bytes > 0 ? bytes : 1);
  allowed -= memory != nullptr && allowed > 0 ? 1 : 0;
  return memory;
}

void* piece(std::size_t bytes) {
  void* memory = pieceOrNone(bytes);
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  return memory;
}

}  // namespace

// For this whole program, which has no other tests: what is asked for with an alignment of its own is not
// counted.
void* operator new(std::size_t bytes) { return piece(bytes); }
void* operator new[](std::size_t bytes) { return piece(bytes); }
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return pieceOrNone(bytes); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return pieceOrNone(bytes); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace {

Space<double> heap() {
  SimulationConfig<double> config = plain(1e-2);
  config.G = 0.3;
  config.coeffFriction = config.coeffStaticFriction = 0.4;
  Space<double> space(config);
  space.setUniformField({0, 0, -5});
  space.addBox({-2, -2, -2}, {2, 2, 2});
  for (int i = 0; i < 40; ++i) {
    space.addBody(
        ball({0.7 * (i % 4) - 1, 0.7 * (i / 4 % 4) - 1, 0.7 * (i / 16) - 1.5 + 0.01 * i}, {0.1, 0, 0}, 0.25));
  }
  space.setForceHook([](Bodies<double, SoA>& bodies, double) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies.forces()[i] += Vec(0.01 * static_cast<double>(toInteger(bodies[i].id())), 0, 0);
    }
  });
  advance(space, 60);
  return space;
}

std::vector<double> all(const Space<double>& space) {
  std::vector<double> state = stateOf(space);
  const EnergyLedger<double> e = space.energyLedger();
  state.push_back(static_cast<double>(space.planes().size()));
  state.insert(state.end(), {e.potential, e.restitution, e.friction, e.work, e.exchange});
  for (const ContactImpulse<double>& j : space.contactImpulses()) {
    state.insert(state.end(), {j.normal, j.tangential[0], j.tangential[1], j.tangential[2]});
  }
  return state;
}

/// What failed changed nothing: now, in the steps that follow, or in the id that comes next.
void checkUntouched(Space<double> space, Space<double> twin) {
  CHECK(sameBits(all(space), all(twin)));
  advance(space, 3);
  advance(twin, 3);
  CHECK(sameBits(all(space), all(twin)));
  CHECK(space.addBody(ball({9, 9, 9}, {0, 0, 0}, 0.1)) == twin.addBody(ball({9, 9, 9}, {0, 0, 0}, 0.1)));
  CHECK(space.addPlane({0, 1, 0}, -9) == twin.addPlane({0, 1, 0}, -9));
}

}  // namespace

// Seen to fail: the energy of a body booked before it was taken out, which then stayed; bodies in a new
// order, with the hook's forces and the contacts in the old one; some faces of a box, of numbers that nobody
// was told.
TEST_CASE(
    "A body, plane or box that comes, a body that goes, or a new order without memory changes nothing") {
  const Space<double> before = heap();
  CHECK(before.contactCount() > 20);
  using Change = std::function<void(Space<double>&)>;
  const std::vector<Change> changes{[](Space<double>& space) {
                                      space.addBody(ball({0, 0, 1.7}, {0, 0, 0}, 0.2));
                                    },
                                    [](Space<double>& space) { space.removeBody(BodyId{5}); },
                                    [](Space<double>& space) { space.reorderBodies(); },
                                    [](Space<double>& space) {
                                      space.addPlane({1, 0, 0}, -9.0);
                                    },
                                    [](Space<double>& space) {
                                      space.addBox({-9, -9, -9}, {9, 9, 9});
                                    }};
  for (std::size_t c = 0; c < changes.size(); ++c) {
    bool failed = true;
    long pieces = 0;
    for (; failed; ++pieces) {
      Space<double> space(before);
      failed = false;
      allowed = pieces;
      try {
        changes[c](space);
      } catch (const std::bad_alloc&) {
        failed = true;
      }
      allowed = -1;
      if (failed) {
        CAPTURE(c, pieces);
        checkUntouched(space, before);
      }
    }
    CHECK(pieces > 1);
  }
}

// Seen to fail: the id of the refused one was skipped, and the next step found forces and contacts anew.
TEST_CASE("A body that is refused for another one's sake changes nothing, the next id included") {
  const Space<double> before = heap();
  Space<double> space(before);
  const double x = space.body(7).position()[0];
  space.body(7).position()[0] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(space.addBody(ball({0, 0, 1.7}, {0, 0, 0}, 0.2)), std::invalid_argument);
  space.body(7).position()[0] = x;
  checkUntouched(space, before);
}

namespace {

/// Candidates that stay what they are.
struct Near {
  std::vector<Pair> all;
  const std::vector<Pair>& pairs() const { return all; }
  static std::uint64_t version() { return 0; }
  template <class B>
  static void follow(const B&, std::uint32_t, double, std::vector<Pair>&) {}
};

}  // namespace

// Seen to fail: room of many blows given back and some asked for anew, without which nothing was left to
// read; and a list said to be empty that was not, so that its blows and mergers came once more.
TEST_CASE("To forget the blows of a step asks for no memory, and leaves none") {
  const std::uint32_t pairs = 2000;
  Bodies<double, SoA> bodies;
  Near near;
  for (std::uint32_t k = 0; k < pairs; ++k) {
    bodies.add(ball({0, 3.0 * k, 0}, {1, 0, 0}, 1.0));
    bodies.add(ball({2.5, 3.0 * k, 0}, {-1, 0, 0}, 1.0));
    near.all.push_back({2 * k, 2 * k + 1});
  }
  const Bodies<double, SoA> start = bodies;
  const std::vector<Material<double>> materials(1);
  ImpactEvents<double> events;
  const auto resolve = [&] {
    bodies = start;
    events.resolve(bodies, near, Domain<double>::open(), materials, {}, {}, {0.0, 1.0, 1e-3, 1e-12});
  };
  resolve();
  REQUIRE(events.impacts().size() == pairs);
  near.all.resize(1);
  resolve();
  REQUIRE(events.impacts().size() == 1);
  bool failed = false;
  allowed = 0;
  try {
    events.clear();
  } catch (const std::bad_alloc&) {
    failed = true;
  }
  allowed = -1;
  CHECK(!failed);
  events.clear();
  CHECK(events.impacts().empty());
  REQUIRE(!failed);
  resolve();
  CHECK(events.impacts().size() == 1);
}
