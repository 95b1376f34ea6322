#include "scenes.hpp"
#include "support/catch.hpp"
#include <gravel/contact/boundary_list.hpp>

using namespace gravel;
using namespace gravel::test;

namespace {

/// Bodies that go to and fro across a box of which one wall moves in and out. The list is told that it is
/// stale whenever a body may have moved by half the skin, as a neighbour list tells it.
template <class S>
void walk(S skin, std::size_t& searches, std::size_t& contacts) {
  Bodies<S, SoA> bodies = randomCloud<S>(60, 4.0, 3);
  std::vector<HalfSpace<S>> walls{{Vector3<S>(S(1), S(0), S(0)), S(-2), {}, Vector3<S>::Zero(), 0},
                                  {Vector3<S>(S(0), S(0), S(-1)), S(-2.5), {}, Vector3<S>::Zero(), 3}};
  const std::vector<Material<S>> materials(1);
  NarrowPhaseSettings<S> settings;
  settings.margin = S(0.01);
  NarrowPhase<S> narrow;
  BoundaryList<S> list;
  ContactList<S> every;
  ContactList<S> near;
  const S stride = S(0.02);
  S moved = S(0);
  for (int step = 0; step < 300; ++step) {
    const bool stale = step == 0 || moved > skin / S(2);
    moved = stale ? S(0) : moved;
    const auto indices = list.update(bodies.positions(), bodies.radii(), std::span<const HalfSpace<S>>(walls),
                                     stale, skin, settings.margin);
    narrow.find({}, bodies, Domain<S>::open(), materials, walls, settings, every);
    narrow.find({}, bodies, Domain<S>::open(), materials, walls, settings, near, indices);
    REQUIRE(every.size() == near.size());
    for (std::size_t k = 0; k < every.size(); ++k) {
      REQUIRE(every[k].key1 == near[k].key1);
      REQUIRE(every[k].key2 == near[k].key2);
      REQUIRE(every[k].gap == near[k].gap);
    }
    contacts += every.size();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const double way = (step / 50 % 2 == 0 ? 0.999 : -0.999) * static_cast<double>(stride);
      Vector3<S> d = Vector3<S>::Zero();
      d[i % 2 == 0 ? 0 : 2] = S(i % 4 < 2 ? way : -way);  // towards one of the walls, or away from it
      bodies.positions()[i] += d;
    }
    moved += stride;
    walls[1].offset = S(-2.5 + 0.8 * std::sin(0.1 * step));
  }
  searches = list.searches();
}

}  // namespace

// Seen to fail: the skin of the bodies or that of the moving wall left out of the search.
TEMPLATE_TEST_CASE("bodies near a boundary are never missed, and rarely looked for", "",
                   GRAVEL_TEST_TYPES(double, float)) {
  using S = TestType;
  std::size_t searches = 0;
  std::size_t contacts = 0;
  walk<S>(S(0.4), searches, contacts);
  CHECK(contacts > 1000);
  CHECK(searches < 75);  // every tenth step for the bodies, and while the wall comes nearer
  walk<S>(S(0), searches, contacts);
  CHECK(searches == 300);
}

TEST_CASE("a boundary that leaves and one that comes are noticed") {
  Bodies<double, SoA> bodies = randomCloud<double>(10, 1.0, 3);
  std::vector<HalfSpace<double>> walls{{Vector3<double>(1, 0, 0), -100.0, {}}};
  BoundaryList<double> list;
  const auto near = [&](bool stale) {
    return list
        .update(bodies.positions(), bodies.radii(), std::span<const HalfSpace<double>>(walls), stale, 0.1,
                0.0)
        .size();
  };
  CHECK(near(true) == 0);
  CHECK(near(false) == 0);
  CHECK(list.searches() == 1);
  walls[0].offset = -300.0;  // recedes: nothing to look for
  CHECK(near(false) == 0);
  CHECK(list.searches() == 1);
  walls[0].offset = 0.0;
  CHECK(near(false) > 0);
  walls[0].normal = Vector3<double>(0, 0, -1);
  walls[0].offset = 1e3;
  CHECK(near(false) == 10);
  walls.clear();
  CHECK(near(false) == 0);
}
