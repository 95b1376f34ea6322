#include "oracle/pairs.hpp"
#include "support/archetypes.hpp"
#include "support/catch.hpp"
#include <gravel/spatial/neighbour_list.hpp>

using namespace gravel;
using namespace gravel::test;

namespace {

/// The pairs of a list that overlap, by the searches' own test.
template <class S>
IdPairs overlapping(const std::vector<Pair>& list, const Cloud<S>& cloud, const S& margin,
                    const Domain<S>& domain, const S& time) {
  std::vector<detail::Sphere<S>> spheres;
  detail::gatherSpheres(cloud.positions, cloud.radii, cloud.ids, domain, time, spheres);
  std::vector<Pair> kept;
  for (const Pair& pair : list) {
    if (detail::withinReach(spheres[pair.first], spheres[pair.second], margin, domain, time)) {
      kept.push_back(pair);
    }
  }
  return named(kept, cloud);
}

template <class S>
IdPairs fresh(const Cloud<S>& cloud, const S& margin, const Domain<S>& domain, const S& time) {
  BroadPhase<S> search(BroadPhaseKind::AllPairs);
  std::vector<Pair> pairs;
  search.findPairs(cloud.positions, cloud.radii, cloud.ids, margin, domain, time, pairs);
  return named(pairs, cloud);
}

/// The smaller index of each pair first.
std::vector<std::pair<std::uint32_t, std::uint32_t>> sortedIndices(const std::vector<Pair>& pairs) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> sorted;
  for (const Pair& pair : pairs) {
    sorted.emplace_back(std::min(pair.first, pair.second), std::max(pair.first, pair.second));
  }
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

}  // namespace

TEMPLATE_TEST_CASE("over a long random walk the list holds the pairs of a fresh search at every step", "",
                   GRAVEL_TEST_TYPES(double, float)) {
  using S = TestType;
  const Vector3<S> L(S(1), S(1.25), S(0.8));
  for (const Domain<S>& domain :
       {Domain<S>::open(), Domain<S>::periodic(L), Domain<S>::shearPeriodic(L, S(1))}) {
    for (const double margin : {0.0, 0.004}) {
      auto cloud = randomCloud<S>(200, 0.8, 0.04, 3.0, 51);
      NeighbourList<S> list;
      const CounterRandom random(52);
      std::size_t searches = 0;
      std::size_t overlaps = 0;
      S time(0);
      for (std::size_t step = 0; step < 250; ++step) {
        const auto& pairs = list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, time, S(margin));
        searches += list.rebuilt() ? 1U : 0U;
        const IdPairs expected = fresh(cloud, S(margin), domain, time);
        overlaps += expected.size();
        REQUIRE(overlapping(pairs, cloud, S(margin), domain, time) == expected);
        REQUIRE(std::is_sorted(pairs.begin(), pairs.end(), [&](const Pair& a, const Pair& b) {
          return std::pair(cloud.ids[a.first], cloud.ids[a.second]) <
                 std::pair(cloud.ids[b.first], cloud.ids[b.second]);
        }));
        const double dt = 2e-3;
        time += S(dt);
        for (std::size_t i = 0; i < cloud.size(); ++i) {
          Vector3<S>& x = cloud.positions[i];
          for (int axis = 0; axis < 3; ++axis) {
            const std::size_t counter = (step * cloud.size() + i) * 3 + static_cast<std::size_t>(axis);
            x[axis] += S(random.uniform(counter, -1e-3, 1e-3));
          }
          x[1] -= S(1.5) * domain.omega() * x[0] * S(dt);
          Vector3<S> v = Vector3<S>::Zero();
          domain.wrap(x, v, time);
        }
      }
      CAPTURE(static_cast<int>(domain.kind()), margin, searches, overlaps);
      CHECK(overlaps > 3000);
      CHECK(searches > 5);
      CHECK(searches < 125);
    }
  }
}

TEST_CASE("a list is searched anew when, and only when, something made it stale, and says why") {
  auto cloud = randomCloud<double>(100, 1.0, 0.05, 1.0, 53);
  auto domain = Domain<double>::open();
  NeighbourList<double> list;
  list.setSkin(0.01);
  std::uint64_t revision = 0;
  const auto update = [&](double time) {
    list.update(cloud.positions, cloud.radii, cloud.ids, revision, domain, time);
    return std::string(list.rebuilt() ? list.reason() : "");
  };
  CHECK(update(0.0) == "first search");
  CHECK(list.skin() == 0.01);
  CHECK(update(0.1).empty());
  CHECK(std::string(list.reason()) == "no body has moved half the skin since the last search");
  cloud.positions[7][0] += 0.0049;
  cloud.positions[8][0] += 0.0049;
  CHECK(update(0.2).empty());
  cloud.positions[7][0] += 0.0002;
  CHECK(update(0.25).empty());  // one of a hundred is compared with all others
  cloud.positions[8][0] += 0.0002;
  CHECK(update(0.3) == "bodies moved half the skin");
  cloud.positions[7] += Vector3<double>(100, 0, 0);
  CHECK(update(0.35).empty());
  CHECK(list.strays());
  cloud.positions[8] += Vector3<double>(100, 0, 0);
  CHECK(update(0.4) == "bodies moved half the skin");
  cloud.radii[3] *= 1.0000001;
  CHECK(update(0.5) == "a radius changed");
  ++revision;
  CHECK(update(0.6) == "bodies were added, removed or reordered");
  cloud.positions.pop_back();
  cloud.radii.pop_back();
  cloud.ids.pop_back();
  CHECK(update(0.7) == "bodies were added, removed or reordered");
  domain = Domain<double>::periodic({4, 4, 4});
  CHECK(update(0.8) == "the domain changed");
  list.clear();
  CHECK(update(0.9) == "first search");
  CHECK(update(1.0).empty());
}

TEST_CASE("pairs that are left out stay out until the next search") {
  const auto cloud = randomCloud<double>(200, 1.0, 0.2, 1.0, 55);
  const auto open = Domain<double>::open();
  NeighbourList<double> list;
  const auto even = [](const Pair& pair) { return pair.first % 2 == 0 && pair.second % 2 == 0; };
  const auto update = [&] { return list.update(cloud.positions, cloud.radii, cloud.ids, 0, open, 0.0); };
  std::vector<Pair> expected = update();
  const std::vector<Pair> all = expected;
  REQUIRE(std::erase_if(expected, even) > 100);
  const std::uint64_t version = list.version();
  list.leaveOut(even, cloud.ids);
  CHECK(list.pairs() == expected);
  CHECK(list.version() != version);  // seen to fail: the version of all pairs
  CHECK(update() == expected);
  list.clear();
  CHECK(update() == all);
}

TEST_CASE("a body that teleports into another is a pair at once") {
  Cloud<double> cloud = randomCloud<double>(100, 100.0, 0.05, 1.0, 54);
  NeighbourList<double> list;
  const auto open = Domain<double>::open();
  list.update(cloud.positions, cloud.radii, cloud.ids, 0, open, 0.0);
  cloud.positions[10] = cloud.positions[20] + Vector3<double>(0.05, 0, 0);
  const auto& pairs = list.update(cloud.positions, cloud.radii, cloud.ids, 0, open, 0.0);
  CHECK_FALSE(list.rebuilt());  // it alone is looked for
  CHECK(overlapping(pairs, cloud, 0.0, open, 0.0) == fresh(cloud, 0.0, open, 0.0));
  CHECK_FALSE(pairs.empty());
}

// Seen to fail when a body may move the whole skin before a new search.
TEST_CASE("two bodies that run into each other are a pair from their first overlap on") {
  for (const bool acrossFace : {false, true}) {
    Cloud<double> cloud;
    const double shift = acrossFace ? 0.5 : 0.0;
    cloud.positions = {{shift - 0.0252, 0, 0}, {shift + 0.0252, 0, 0}};
    cloud.radii = {0.02, 0.02};
    cloud.ids = {BodyId{1}, BodyId{2}};
    const auto domain = Domain<double>::periodic({1, 1, 1});
    NeighbourList<double> list;
    list.setSkin(0.01);
    std::size_t touching = 0;
    for (int step = 0; step < 60; ++step) {  // the gap of 0.0104 closes by 2e-4 a step
      const auto& pairs = list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, 0.0);
      const IdPairs expected = fresh(cloud, 0.0, domain, 0.0);
      REQUIRE(overlapping(pairs, cloud, 0.0, domain, 0.0) == expected);
      touching += expected.size();
      cloud.positions[0][0] += 1e-4;
      cloud.positions[1][0] -= 1e-4;
      for (Vector3<double>& x : cloud.positions) {
        Vector3<double> v = Vector3<double>::Zero();
        domain.wrap(x, v, 0.0);
      }
    }
    CHECK(touching == 7);
  }
}

// Seen to fail: swift ones compared with the margin of the last search (2, 2 and 4 missed).
TEST_CASE("a list whose margin changes from call to call has the pairs of each margin, of swift ones, too") {
  const CounterRandom random(12);
  const Vector3<double> edges(1.1, 1.25, 1.2);
  for (const auto& domain :
       {Domain<double>::open(), Domain<double>::periodic(edges), Domain<double>::shearPeriodic(edges, 1.0)}) {
    auto cloud = randomCloud<double>(300, 1.0, 0.02, 2.0, 64);
    NeighbourList<double> list;
    list.setSkin(0.04);
    std::size_t missed = 0;
    std::size_t swift = 0;
    for (std::uint64_t step = 0; step < 200; ++step) {
      const double time = 1e-3 * static_cast<double>(step);
      const double margin = random.uniform(step, 0.0, 0.04);
      const auto& pairs = list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, time, margin);
      swift += list.strays() ? 1U : 0U;
      const IdPairs expected = fresh(cloud, margin, domain, time);
      const IdPairs known = named(pairs, cloud);
      for (const auto& pair : expected) {
        missed += std::count(known.begin(), known.end(), pair) == 0 ? 1U : 0U;
      }
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        cloud.positions[i] += (i == step % 300 ? 0.06 : 1e-4) * random.direction(step * 1000 + i + 300);
        cloud.positions[i][1] -= 1.5e-3 * domain.omega() * cloud.positions[i][0];
        Vector3<double> none = Vector3<double>::Zero();
        domain.wrap(cloud.positions[i], none, time + 1e-3);
      }
    }
    CAPTURE(static_cast<int>(domain.kind()), list.searches(), swift);
    CHECK(missed == 0);
    CHECK(list.searches() < 150);
    CHECK(swift > 50);
  }
}

// Seen to fail when what the flow brings nearer is not taken off the skin.
TEST_CASE("two bodies that the sheared flow alone brings together are a pair from their first overlap on") {
  const auto domain = Domain<double>::shearPeriodic({1, 1, 1}, 1.0);
  NeighbourList<double> list;
  list.setSkin(0.004);
  std::size_t touching = 0;
  for (int step = 0; step < 50; ++step) {
    const double time = 0.01 * step;
    Cloud<double> cloud;
    cloud.positions = {{0, 0, 0}, {0.019, 0.0149 - 1.5 * 0.019 * time, 0}};
    cloud.radii = {0.01, 0.01};
    cloud.ids = {BodyId{1}, BodyId{2}};
    const auto& pairs = list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, time);
    const IdPairs expected = fresh(cloud, 0.0, domain, time);
    REQUIRE(overlapping(pairs, cloud, 0.0, domain, time) == expected);
    touching += expected.size();
  }
  CHECK(touching > 5);
}

TEST_CASE("crossing a face of a periodic box is no displacement") {
  Cloud<double> cloud;
  cloud.positions = {{0.4999, 0, 0}, {-0.48, 0, 0}};
  cloud.radii = {0.02, 0.02};
  cloud.ids = {BodyId{1}, BodyId{2}};
  const auto domain = Domain<double>::periodic({1, 1, 1});
  NeighbourList<double> list;
  list.setSkin(0.002);
  list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, 0.0);
  cloud.positions[0][0] = -0.4998;  // 0.0003 further
  const auto& pairs = list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, 0.0);
  CHECK_FALSE(list.rebuilt());
  CHECK(pairs.size() == 1);
}

TEST_CASE("in a sheared box bodies that ride the flow use up the skin by the flow across a pair alone") {
  auto cloud = randomCloud<double>(200, 1.0, 0.01, 1.0, 55);
  const auto domain = Domain<double>::shearPeriodic({1, 1, 1}, 1.0);
  NeighbourList<double> list;
  list.setSkin(0.004);
  const auto at = [&](double time) {
    Cloud<double> now = cloud;
    for (Vector3<double>& x : now.positions) {
      x[1] -= 1.5 * x[0] * time;
      Vector3<double> v = Vector3<double>::Zero();
      domain.wrap(x, v, time);
    }
    list.update(now.positions, now.radii, now.ids, 0, domain, time);
    return list.rebuilt();
  };
  CHECK(at(0.0));
  // A body at the edge moves 0.75 t; the flow across a touching pair is 1.5 x 0.02 t, which eats 0.004 at
  // 0.1333.
  CHECK_FALSE(at(0.13));
  CHECK(at(0.137));
  CHECK(std::string(list.reason()) == "the flow used up the skin");
}

// As in the open, further below, in a flow that takes bodies by more than the skin in a step, and their own
// ways are much less. Bullets fly at images of others. Seen to fail: images looked for where they were at the
// last search (6 pairs missed); without the shear between a bullet and what it flies at (195), or across a
// pair (2); what turns off followed with the flow in its way (414).
TEST_CASE("a list for a whole way in a sheared box counts ways against the flow, and misses no pair") {
  const CounterRandom random(4);
  for (const auto& row : {std::pair(1.0, 0.002), std::pair(-0.6, 0.002), std::pair(1.0, 0.1)}) {
    const double omega = row.first;
    const double h = row.second;
    const auto domain = Domain<double>::shearPeriodic({4, 1.25, 1.1}, omega);
    auto cloud = randomCloud<double>(300, 1.0, 0.04, 1.0, 60);
    for (Vector3<double>& x : cloud.positions) {
      x[0] *= 4;
    }
    std::vector<Vector3<double>> ways(cloud.size());
    NeighbourList<double> list;
    std::size_t met = 0;
    std::size_t missed = 0;
    for (std::uint64_t step = 0; step < 100; ++step) {
      const double time = h * static_cast<double>(step);
      const auto image = [&](std::size_t i, std::size_t j) {  // of j as i sees it, and its way
        Vector3<double> r = cloud.positions[j] - cloud.positions[i];
        Vector3<double> v = Vector3<double>::Zero();
        domain.minimumImage(r, v, time);
        return std::pair<Vector3<double>, Vector3<double>>(r, ways[j] + v * h);
      };
      for (std::size_t i = 0; i < ways.size(); ++i) {
        ways[i] = 2e-4 * random.direction(step * 1000 + i);
        ways[i][1] -= 1.5 * omega * h * cloud.positions[i][0];
      }
      for (std::size_t i = 0; i < ways.size(); i += 100) {  // three bullets
        const auto at = static_cast<std::size_t>(random.uniform(step * 1000 + i + 500, 0.0, 299.0));
        const auto [r, way] = image(i, at == i ? at + 1 : at);
        ways[i] = r + way;
      }
      list.update(
          cloud.positions, cloud.radii, cloud.ids, 0, domain, time, 0.0,
          [&](std::size_t i) { return ways[i]; }, h);
      std::vector<Pair> late;
      const std::vector<Vector3<double>> straight = ways;
      for (std::uint32_t i = 5; i < 300; i += 13) {  // slow ones and a bullet turn off
        ways[i] = Vector3<double>(random.uniform(step * 1000 + i + 900, -0.4, 0.4), 0.2, 0);
        list.follow(
            i, cloud.positions, cloud.radii, cloud.ids, ways[i], [&](std::size_t k) { return ways[k]; },
            late);
      }
      list.add(late, cloud.ids);
      const auto known = sortedIndices(list.pairs());
      for (std::uint32_t i = 0; i < cloud.size(); ++i) {
        for (std::uint32_t j = i + 1; j < cloud.size(); ++j) {
          const auto [r, way] = image(i, j);
          const Vector3<double> v = way - ways[i];
          const double s = v.squaredNorm() > 0 ? std::clamp(-r.dot(v) / v.squaredNorm(), 0.0, 1.0) : 0.0;
          if ((r + s * v).norm() < cloud.radii[i] + cloud.radii[j]) {
            ++met;
            missed += std::binary_search(known.begin(), known.end(), std::pair(i, j)) ? 0U : 1U;
          }
        }
      }
      for (std::size_t i = 0; i < ways.size(); ++i) {  // who turned off is back again: the list has to last
        cloud.positions[i] += straight[i];
        Vector3<double> v = Vector3<double>::Zero();
        domain.wrap(cloud.positions[i], v, time + h);
      }
    }
    CAPTURE(omega, h, met, list.searches());
    CHECK(met > 500);
    CHECK(missed == 0);
    CHECK((h > 0.01 || list.searches() < 60));  // with the flow in the ways one in each step
  }
}

// Paths x + way s - 4 bend s (1 - s): of a few, of all alike, and of each. Seen to fail: without bends (1196
// of 2476 that meet missed where each bends).
TEST_CASE("a list for a whole way misses no pair that meets where paths bend") {
  const CounterRandom random(7);
  for (const int kind : {0, 1, 2}) {
    for (const auto& domain : {Domain<double>::open(), Domain<double>::periodic({1, 1.25, 1.1})}) {
      auto cloud = randomCloud<double>(300, 1.0, 0.03, 1.0, 61);
      struct Course {
        std::vector<Vector3<double>> ways, bends;
        Vector3<double> operator()(std::size_t i) const { return ways[i]; }
        Vector3<double> bend(std::size_t i) const { return bends[i]; }
      } course{std::vector<Vector3<double>>(300), std::vector<Vector3<double>>(300)};
      NeighbourList<double> list;
      std::size_t met = 0;
      std::size_t missed = 0;
      for (std::uint64_t step = 0; step < 40; ++step) {
        for (std::size_t i = 0; i < 300; ++i) {
          course.ways[i] = 1e-4 * random.direction(step * 1000 + i);
          const bool bends = kind > 0 || i % 100 == 0;
          course.bends[i] = (bends && kind != 1 ? 0.05 : 1e-4) * random.direction(step * 1000 + i + 400);
          course.bends[i] += kind == 1 ? Vector3<double>(0, 0, 0.3) : Vector3<double>(0, 0, 0);
        }
        list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, 0.0, 0.0, course, 1.0);
        const auto known = sortedIndices(list.pairs());
        for (std::uint32_t i = 0; i < 300; ++i) {
          for (std::uint32_t j = i + 1; j < 300; ++j) {
            const Vector3<double> r = domain.minimumImage(cloud.positions[j] - cloud.positions[i], 0.0);
            bool meets = false;
            for (const double s : {0.0, 0.25, 0.5, 0.75, 1.0}) {
              const Vector3<double> way = s * (course.ways[j] - course.ways[i]);
              const Vector3<double> bend = 4 * s * (1 - s) * (course.bends[j] - course.bends[i]);
              meets = meets || (r + way - bend).norm() < cloud.radii[i] + cloud.radii[j];
            }
            met += meets ? 1U : 0U;
            missed += meets && !std::binary_search(known.begin(), known.end(), std::pair(i, j)) ? 1U : 0U;
          }
        }
        for (std::size_t i = 0; i < 300; ++i) {
          cloud.positions[i] += course.ways[i];
        }
      }
      CAPTURE(kind, domain.kind(), met, list.searches());
      CHECK(met > 1000);
      CHECK(missed == 0);
      CHECK((kind == 2 || list.searches() < 10));  // what all have in common takes nothing of the skin
    }
  }
}

// Who turns off after seven tenths of a way has begun the new one, as it seems, up to 0.7 m away. Seen to
// fail: the image nearest to that place (487 and 115 missed); ways with the flow where it is left out (35).
TEST_CASE("a list misses no image that is beside what turns off late on its way") {
  const CounterRandom random(11);
  const double h = 0.2, share = 0.7;
  for (const auto& domain :
       {Domain<double>::periodic({1, 1.25, 1.1}), Domain<double>::shearPeriodic({2, 1.25, 1.1}, 4.0)}) {
    const double omega = domain.omega();
    const auto start = randomCloud<double>(300, 1.0, 0.03, 1.0, 63);
    NeighbourList<double> list;
    std::size_t met = 0;
    std::size_t missed = 0;
    for (std::uint64_t step = 0; step < 100; ++step) {
      auto cloud = start;
      const double time = h * static_cast<double>(step);
      std::vector<Vector3<double>> ways(cloud.size());
      for (std::size_t i = 0; i < ways.size(); ++i) {
        cloud.positions[i][0] *= domain.lengths()[0];
        ways[i] = 2e-4 * random.direction(step * 1000 + i);
        ways[i][1] -= 1.5 * omega * h * cloud.positions[i][0];
      }
      const auto travel = [&](std::size_t k) { return ways[k]; };
      list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, time, 0.0, travel, h);
      for (std::uint32_t i = 5; i < 300; i += 13) {
        const Vector3<double> place = cloud.positions[i] + share * ways[i];
        ways[i] += random.uniform(step * 1000 + i + 300, 0.2, 1.0) * random.direction(step * 1000 + i + 600);
        cloud.positions[i] = place - share * ways[i];
      }
      std::vector<Pair> late;
      for (std::uint32_t i = 5; i < 300; i += 13) {
        list.follow(i, cloud.positions, cloud.radii, cloud.ids, ways[i], travel, late, share);
      }
      list.add(late, cloud.ids);
      const auto known = sortedIndices(list.pairs());
      for (std::uint32_t i = 0; i < cloud.size(); ++i) {
        for (std::uint32_t j = i + 1; j < cloud.size(); ++j) {
          Vector3<double> r = cloud.positions[j] - cloud.positions[i] + share * (ways[j] - ways[i]);
          Vector3<double> v = (ways[j] - ways[i]) / h;
          domain.minimumImage(r, v, time + share * h);
          const Vector3<double> way = (1 - share) * h * v;
          const double s = std::clamp(-r.dot(way) / way.squaredNorm(), 0.0, 1.0);
          if ((r + s * way).norm() < cloud.radii[i] + cloud.radii[j]) {
            ++met;
            missed += std::binary_search(known.begin(), known.end(), std::pair(i, j)) ? 0U : 1U;
          }
        }
      }
    }
    CAPTURE(omega, met);
    CHECK(met > 500);
    CHECK(missed == 0);
  }
}

TEST_CASE("the skin follows the motion: thin for slow bodies, none where none would last") {
  const auto start = randomCloud<double>(300, 1.0, 0.05, 1.0, 56);
  const auto open = Domain<double>::open();
  const auto run = [&](double step) {
    NeighbourList<double> list;
    auto cloud = start;
    std::size_t searches = 0;
    for (int k = 0; k < 200; ++k) {
      list.update(cloud.positions, cloud.radii, cloud.ids, 0, open, 0.0);
      searches += list.rebuilt() ? 1U : 0U;
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        cloud.positions[i][0] += i % 2 == 0 ? step : -step;
      }
    }
    return std::pair(searches, list.skin() / 0.05);
  };
  const auto [still, stillSkin] = run(0.0);
  const auto [slow, slowSkin] = run(1e-5);
  const auto [fair, fairSkin] = run(1e-4);
  const auto [fast, fastSkin] = run(0.05);
  CHECK(still == 1);
  CHECK(slow <= 4);
  CHECK(slowSkin <= 0.1 + 1e-12);
  CHECK(fair <= 14);  // 200 updates of a list that lasts 16, and the first two
  CHECK(fairSkin > 0.02);
  CHECK(fairSkin < 0.1);
  CHECK(fast == 200);
  CHECK(fastSkin == 0.0);
}

TEST_CASE("points alone make an empty list that stays valid") {
  auto cloud = randomCloud<double>(100, 1.0, 0.0, 1.0, 57);
  NeighbourList<double> list;
  CHECK(list.update(cloud.positions, cloud.radii, cloud.ids, 0, Domain<double>::open(), 0.0).empty());
  const Cloud<double> none;
  CHECK(list.update(none.positions, none.radii, none.ids, 1, Domain<double>::open(), 0.0).empty());
}

TEST_CASE("a list refuses bad values, also in the middle of reuse, and recovers") {
  auto cloud = randomCloud<double>(100, 1.0, 0.05, 1.0, 58);
  NeighbourList<double> list;
  const auto update = [&](double margin = 0.0) {
    list.update(cloud.positions, cloud.radii, cloud.ids, 0, Domain<double>::open(), 0.0, margin);
  };
  update();
  const double good = cloud.positions[42][1];
  cloud.positions[42][1] = std::nan("");
  CHECK_THROWS_WITH(update(), ContainsSubstring("position of body") && ContainsSubstring("nan"));
  CHECK_THROWS_WITH(update(), ContainsSubstring("position of body") && ContainsSubstring("nan"));
  cloud.positions[42][1] = good;
  update();
  CHECK(list.rebuilt());
  CHECK_THROWS_WITH(update(-1.0), ContainsSubstring("margin of a neighbour list is -1"));
  const double last = cloud.radii.back();
  cloud.radii.pop_back();  // while the list would still hold
  CHECK_THROWS_WITH(update(), ContainsSubstring("length of radii and ids is 99 and 100"));
  cloud.radii.push_back(last);
  update();
  CHECK_THROWS_WITH(list.setSkin(-0.5), ContainsSubstring("skin is -0.5; allowed: finite, >= 0"));
}

TEST_CASE("a user's own scalar has neighbour lists as well") {
  const auto plain = randomCloud<double>(60, 1.0, 0.1, 1.0, 59);
  std::vector<Vector3<MinimalReal>> positions;
  std::vector<MinimalReal> radii;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const Vector3<double>& x = plain.positions[i];
    positions.push_back({MinimalReal(x[0]), MinimalReal(x[1]), MinimalReal(x[2])});
    radii.push_back(MinimalReal(plain.radii[i]));
  }
  const auto open = Domain<MinimalReal>::open();
  NeighbourList<MinimalReal> list;
  list.update(positions, radii, plain.ids, 0, open, MinimalReal(0));
  CHECK_FALSE(list.update(positions, radii, plain.ids, 0, open, MinimalReal(0)).empty());
  CHECK_FALSE(list.rebuilt());
  CHECK(overlapping(list.pairs(), plain, 0.0, Domain<double>::open(), 0.0) ==
        fresh(plain, 0.0, Domain<double>::open(), 0.0));
}

// Each body flies straight on; the list asked for before the flight holds for every moment of it, and where a
// body turns off on the way, with what follow() adds. The bullets fly at places of others, so that they hit.
// Seen to fail: ways of the swift, or of who turns off, with the common way in them (348 and 344 pairs
// missed); ends of ways not looked at (16), nor those of who turns off (708).
TEST_CASE(
    "a list asked to hold for a whole way has every pair that meets on it, swift bodies and turns included, "
    "whatever all have in common") {
  // In the box no two get further apart than half an edge as they fly.
  const auto box = Domain<double>::periodic({17, 18, 19});
  int run = 0;
  for (const double common : {0.0, 0.05, 3.0, 1e6, 0.0, 0.05, 3.0, 1e3}) {
    CAPTURE(run, common);
    const Domain<double> domain = run++ < 4 ? Domain<double>::open() : box;
    const CounterRandom random(3);
    std::size_t met = 0;
    NeighbourList<double> list;
    auto cloud = randomCloud<double>(300, 2.0, 0.03, 1.0, 58);
    std::vector<Vector3<double>> ways(cloud.size());
    for (std::uint64_t step = 0; step < 60; ++step) {
      const Vector3<double> all = common * random.direction(7000 + step / 20);
      for (std::size_t i = 0; i < ways.size(); ++i) {
        ways[i] = all + 2e-4 * random.direction(step * 1000 + i);
        if (i % 100 == 0) {  // three bullets
          const auto at = static_cast<std::size_t>(random.uniform(step * 1000 + i + 500, 0.0, 300.0));
          ways[i] = all + domain.minimumImage(cloud.positions[at] - cloud.positions[i], 0.0);
        }
      }
      list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, 0.0, 0.0,
                  [&](std::size_t i) { return ways[i]; });
      std::vector<Pair> late;
      const std::vector<Vector3<double>> straight = ways;
      for (std::uint32_t i = 5; i < 300; i += 13) {  // slow ones and a bullet turn off
        ways[i] = all + Vector3<double>(random.uniform(step * 1000 + i + 900, -1.0, 1.0), 0.3, 0);
        list.follow(
            i, cloud.positions, cloud.radii, cloud.ids, ways[i], [&](std::size_t k) { return ways[k]; },
            late);
      }
      list.add(late, cloud.ids);
      const auto& pairs = list.pairs();
      for (std::uint32_t i = 0; i < cloud.size(); ++i) {
        for (std::uint32_t j = i + 1; j < cloud.size(); ++j) {
          const Vector3<double> r = domain.minimumImage(cloud.positions[j] - cloud.positions[i], 0.0);
          const Vector3<double> v = ways[j] - ways[i];
          const double s = v.squaredNorm() > 0 ? std::clamp(-r.dot(v) / v.squaredNorm(), 0.0, 1.0) : 0.0;
          if ((r + s * v).norm() < cloud.radii[i] + cloud.radii[j]) {
            ++met;
            const bool known = std::any_of(pairs.begin(), pairs.end(), [&](const Pair& pair) {
              return (pair.first == i && pair.second == j) || (pair.first == j && pair.second == i);
            });
            CHECK(known);
          }
        }
      }
      for (std::size_t i = 0; i < ways.size(); ++i) {  // who turned off is back again: the list has to last
        cloud.positions[i] += straight[i];
        Vector3<double> none = Vector3<double>::Zero();
        domain.wrap(cloud.positions[i], none, 0.0);
      }
    }
    CHECK(met > 200);
    CHECK(list.searches() < 30);
  }
}

// Seen to fail: eight swift ones at most, so that all bodies get a skin for the ninth bullet (2e6 pairs).
TEST_CASE("twenty bullets among many at rest have the pairs on their ways, and add none to all others") {
  const CounterRandom random(9);
  for (const Domain<double>& domain : {Domain<double>::open(), Domain<double>::periodic({40, 40, 40})}) {
    NeighbourList<double> list;
    const auto cloud = randomCloud<double>(2000, 20.0, 0.4, 1.0, 58);
    const auto way = [&](std::size_t i) -> Vector3<double> {
      return (i % 100 == 0 ? 19.0 : 1e-3) * random.direction(i);
    };
    NeighbourList<double> atRest;
    const std::size_t others = atRest.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, 0.0).size();
    const auto pairs =
        sortedIndices(list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, 0.0, 0.0, way));
    std::size_t met = 0;
    for (std::uint32_t i = 0; i < cloud.size(); i += 100) {
      for (std::uint32_t j = 0; j < cloud.size(); ++j) {
        const Vector3<double> r = domain.minimumImage(cloud.positions[j] - cloud.positions[i], 0.0);
        const Vector3<double> v = way(j) - way(i);
        const double s = std::clamp(-r.dot(v) / v.squaredNorm(), 0.0, 1.0);
        if (j != i && (r + s * v).norm() < cloud.radii[i] + cloud.radii[j]) {
          ++met;
          CHECK(std::binary_search(pairs.begin(), pairs.end(), std::pair(std::min(i, j), std::max(i, j))));
        }
      }
    }
    CHECK(met > 60);
    CHECK(pairs.size() < others + others / 10 + 20 * 2000);
  }
}

// Seen to fail: 60 searches where all move by more than the skin in a step, with some hundred times the
// pairs.
TEST_CASE("what all bodies move in common needs no search and adds no pair, across periodic faces, too") {
  const CounterRandom random(8);
  const auto cost = [&](const Domain<double>& domain, const Vector3<double>& common, bool bullets) {
    NeighbourList<double> list;
    auto cloud = randomCloud<double>(400, 2.0, 0.03, 1.0, 58);
    const auto way = [&](std::size_t i) -> Vector3<double> {
      return common + (bullets && i % 200 == 0 ? 5.0 : 1e-5) * random.direction(i);
    };
    std::size_t pairs = 0;
    for (int step = 0; step < 60; ++step) {
      pairs = std::max(pairs,
                       list.update(cloud.positions, cloud.radii, cloud.ids, 0, domain, 0.0, 0.0, way).size());
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        cloud.positions[i] += way(i);
        Vector3<double> none = Vector3<double>::Zero();
        domain.wrap(cloud.positions[i], none, 0.0);
      }
    }
    return std::pair(list.searches(), pairs);
  };
  for (const Domain<double>& domain : {Domain<double>::open(), Domain<double>::periodic({5, 5, 5})}) {
    for (const bool bullets : {false, true}) {
      const auto [searches, pairs] = cost(domain, {0, 0, 0}, bullets);
      CHECK(searches < 20);
      for (const double common : {0.01, 0.3, 20.0, 1e5}) {
        CAPTURE(domain.isOpen(), bullets, common);
        const auto [more, wider] = cost(domain, {common, 0, -common}, bullets);
        CHECK(more <= searches + 2);
        CHECK(wider <= pairs + pairs / 10);
      }
    }
  }
}
