#include "oracle/pairs.hpp"
#include "support/archetypes.hpp"
#include "support/catch.hpp"
#include "support/threads.hpp"
#include <gravel/bodies/bodies.hpp>
#include <gravel/spatial/broad_phase.hpp>

#include <atomic>

using namespace gravel;
using namespace gravel::test;

namespace {

const std::vector<BroadPhaseKind> everyKind{BroadPhaseKind::AllPairs, BroadPhaseKind::KDTree,
                                            BroadPhaseKind::Grid, BroadPhaseKind::Automatic};

template <class S>
std::vector<Domain<S>> everyDomain() {
  const Vector3<S> L(S(1), S(1.25), S(0.8));
  return {Domain<S>::open(), Domain<S>::periodic(L), Domain<S>::shearPeriodic(L, S(1))};
}

template <class S>
IdPairs search(BroadPhaseKind kind, const Cloud<S>& cloud, double margin, const Domain<S>& domain,
               double time) {
  BroadPhase<S> method(kind);
  std::vector<Pair> pairs;
  method.findPairs(cloud.positions, cloud.radii, cloud.ids, S(margin), domain, S(time), pairs);
  return named(pairs, cloud);
}

/// A tree that counts what its queries meet.
template <class S>
struct Counting {
  const KDTree<S>& tree;
  std::atomic<std::size_t>& met;  // by all threads
  template <class Visit>
  void forEachWithin(const Vector3<S>& q, S radius, Visit&& visit) const {
    tree.forEachWithin(q, radius, [&](std::size_t i, S distance_sq) {
      ++met;
      visit(i, distance_sq);
    });
  }
};

}  // namespace

TEMPLATE_TEST_CASE("every method finds the pairs of brute force, in the promised order", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  struct Scene {
    const char* name;
    double radius;
    double ratio;
    double margin;
  };
  // Some bodies stand outside the box, as they do between a drift and the wrap.
  for (const Scene& scene :
       {Scene{"equal radii", 0.05, 1.0, 0.0}, Scene{"equal radii, margin", 0.03, 1.0, 0.03},
        Scene{"radius ratio 1e4", 0.3, 1e4, 0.0}, Scene{"radius ratio 1e4, margin", 0.3, 1e4, 0.01}}) {
    const auto cloud = randomCloud<S>(260, 1.3, scene.radius, scene.ratio, 21);
    for (const Domain<S>& domain : everyDomain<S>()) {
      const IdPairs expected = brutePairs(cloud, S(scene.margin), domain, S(0.37));
      REQUIRE(expected.size() > 30);
      for (const BroadPhaseKind kind : everyKind) {
        CAPTURE(scene.name, static_cast<int>(domain.kind()), static_cast<int>(kind));
        CHECK(search(kind, cloud, scene.margin, domain, 0.37) == expected);
      }
    }
  }
}

// Seen to fail by the nearest images on one side in x alone, and by k-d tree and grid without those beyond.
TEST_CASE("a margin wider than a sheared box that is long in y finds the pairs of brute force") {
  Cloud<double> cloud = randomCloud<double>(60, 1.3, 0.02, 1.0, 22);
  for (Vector3<double>& x : cloud.positions) {
    x[1] *= 5;
  }
  const auto domain = Domain<double>::shearPeriodic({1, 10, 1}, 1.0);
  for (const double margin : {0.3, 1.5, 1e9}) {
    for (const double time : {0.37, 2.1, 7.7}) {
      std::size_t within = 0;
      for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
          const WideVector r = (cloud.positions[i] - cloud.positions[j]).template cast<Wide>();
          const Wide reach = cloud.radii[i] + cloud.radii[j] + margin;
          within += shortestLength(r, domain, time, 8) < reach ? 1 : 0;
        }
      }
      for (const BroadPhaseKind kind : everyKind) {
        CAPTURE(margin, time, static_cast<int>(kind));
        CHECK(search(kind, cloud, margin, domain, time).size() == within);
      }
    }
  }
}

// Seen to fail for the k-d tree when each body asks within r_i + margin in place of 2 r_i + margin.
TEST_CASE("one large body among many small ones has all its pairs") {
  auto cloud = randomCloud<double>(3000, 1.0, 1e-4, 1.0, 22);
  cloud.radii[1234] = 0.4;
  const auto open = Domain<double>::open();
  const IdPairs expected = brutePairs(cloud, 0.0, open, 0.0);
  REQUIRE(expected.size() > 500);
  for (const BroadPhaseKind kind : everyKind) {
    CHECK(search(kind, cloud, 0.0, open, 0.0) == expected);
  }
}

TEST_CASE("bodies at one place are pairs of each other, each once") {
  auto cloud = randomCloud<double>(150, 1.0, 0.01, 1.0, 23);
  for (std::size_t i = 0; i < 100; ++i) {
    cloud.positions[i] = {0.5, 0.625, -0.4};  // also a corner of the periodic boxes
  }
  for (const Domain<double>& domain : everyDomain<double>()) {
    const IdPairs expected = brutePairs(cloud, 0.0, domain, 0.37);
    REQUIRE(expected.size() >= 4950);
    for (const BroadPhaseKind kind : everyKind) {
      CHECK(search(kind, cloud, 0.0, domain, 0.37) == expected);
    }
  }
}

TEST_CASE("points pair with spheres that they are inside of, never with points") {
  Cloud<double> cloud;
  for (std::size_t i = 0; i < 100; ++i) {
    cloud.positions.push_back({0.001 * static_cast<double>(i), 0, 0});
    cloud.radii.push_back(i == 50 ? 0.01 : 0.0);
    cloud.ids.push_back(BodyId{i});
  }
  for (const BroadPhaseKind kind : everyKind) {
    const IdPairs found = search(kind, cloud, 0.0, Domain<double>::open(), 0.0);
    CHECK(found.size() >= 18);
    CHECK(found.size() <= 20);  // the two at exactly 0.01, up to the rounding of 0.001 i
    for (const auto& pair : found) {
      CHECK((pair.first == 50 || pair.second == 50));
    }
    CHECK(search(kind, cloud, 1.0, Domain<double>::open(), 0.0).size() == 99);
  }
}

TEST_CASE("the list is the same for 1, 2, 3 and 8 threads") {
  const auto cloud = randomCloud<double>(2000, 1.0, 0.05, 5.0, 24);
  for (const Domain<double>& domain : everyDomain<double>()) {
    for (const BroadPhaseKind kind :
         {BroadPhaseKind::AllPairs, BroadPhaseKind::KDTree, BroadPhaseKind::Grid}) {
      IdPairs alone;
      {
        const WithThreads one(1);
        alone = search(kind, cloud, 0.001, domain, 0.2);
      }
      REQUIRE(alone.size() > 1000);
      for (const int threads : {2, 3, 8}) {
        const WithThreads some(threads);
        CHECK(search(kind, cloud, 0.001, domain, 0.2) == alone);
      }
    }
  }
}

TEST_CASE("the order of the list depends on ids and not on indices") {
  const auto cloud = randomCloud<double>(500, 1.0, 0.05, 2.0, 25);
  auto turned = cloud;
  std::reverse(turned.positions.begin(), turned.positions.end());
  std::reverse(turned.radii.begin(), turned.radii.end());
  std::reverse(turned.ids.begin(), turned.ids.end());
  for (const BroadPhaseKind kind : everyKind) {
    CHECK(search(kind, cloud, 0.0, Domain<double>::open(), 0.0) ==
          search(kind, turned, 0.0, Domain<double>::open(), 0.0));
  }
}

TEMPLATE_TEST_CASE("columns of every layout and a user's vectors give one list", "",
                   GRAVEL_TEST_TYPES(AoSoA<8>, SoA, AoS, AoSoA<4>)) {
  const auto cloud = randomCloud<double>(300, 1.0, 0.05, 3.0, 26);
  Bodies<double, TestType> bodies;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    Body<double> body;
    body.position = cloud.positions[i];
    body.radius = cloud.radii[i];
    bodies.add(body, cloud.ids[i]);
  }
  for (const BroadPhaseKind kind : everyKind) {
    BroadPhase<double> method(kind);
    std::vector<Pair> pairs;
    method.findPairs(bodies.positions(), bodies.radii(), bodies.ids(), 0.0, Domain<double>::open(), 0.0,
                     pairs);
    CHECK(named(pairs, cloud) == search(kind, cloud, 0.0, Domain<double>::open(), 0.0));
  }
}

TEST_CASE("no body and one body have no pairs") {
  for (const BroadPhaseKind kind : everyKind) {
    for (const std::size_t n : {std::size_t{0}, std::size_t{1}}) {
      Cloud<double> cloud;
      if (n == 1) {
        cloud.positions.push_back({1, 2, 3});
        cloud.radii.push_back(1);
        cloud.ids.push_back(BodyId{7});
      }
      for (const Domain<double>& domain : everyDomain<double>()) {
        CHECK(search(kind, cloud, 0.1, domain, 0.0).empty());
      }
    }
  }
}

TEST_CASE("bodies far from one another and from the origin are found by their distances") {
  Cloud<double> cloud = randomCloud<double>(200, 20.0, 1.0, 1.0, 27);
  for (Vector3<double>& x : cloud.positions) {
    x += Vector3<double>(1e9, -1e9, 1e9);
  }
  cloud.positions[0] = {-1e200, 0, 0};  // cells cannot be counted, squares overflow
  const IdPairs expected = brutePairs(cloud, 0.0, Domain<double>::open(), 0.0);
  REQUIRE(expected.size() > 10);
  for (const BroadPhaseKind kind : everyKind) {
    CHECK(search(kind, cloud, 0.0, Domain<double>::open(), 0.0) == expected);
  }
}

// Seen to fail: all looked 16 roundings of the farthest coordinate around, at 1e15 m 3.6 m, and the search of
// 20 000 bodies took 3.7 s instead of 0.03 s.
TEMPLATE_TEST_CASE("one body far away makes no other one look farther", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  Cloud<S> cloud = randomCloud<S>(400, 1.0, 0.02, 1.0, 27);
  const auto met = [&] {
    std::vector<detail::Sphere<S>> spheres;
    detail::gatherSpheres(cloud.positions, cloud.radii, cloud.ids, Domain<S>::open(), S(0), spheres);
    KDTree<S> tree;
    tree.build(detail::Homes<S>{&spheres});
    std::vector<std::vector<Pair>> parts;
    std::vector<Pair> pairs;
    std::atomic<std::size_t> count = 0;
    detail::findPairsByQueries(Counting<S>{tree, count}, spheres, S(0), Domain<S>::open(), S(0), parts,
                               pairs);
    CHECK(named(pairs, cloud) == brutePairs(cloud, S(0), Domain<S>::open(), S(0)));
    return count.load();
  };
  cloud.positions[0] = Vector3<S>(S(3), S(3), S(3));
  const std::size_t near = met();
  cloud.positions[0] *= S(1) / std::numeric_limits<S>::epsilon();
  CHECK(met() == near);
}

TEST_CASE("the automatic choice: all pairs for few bodies, the k-d tree for crowded clumps, else the grid") {
  const auto chosen = [](const Cloud<double>& cloud) {
    BroadPhase<double> method;
    std::vector<Pair> pairs;
    method.findPairs(cloud.positions, cloud.radii, cloud.ids, 0.0, Domain<double>::open(), 0.0, pairs);
    CHECK(named(pairs, cloud) == search(BroadPhaseKind::AllPairs, cloud, 0.0, Domain<double>::open(), 0.0));
    return std::string(method.name());
  };
  CHECK(chosen(randomCloud<double>(20, 1.0, 0.1, 1.0, 28)) == "all pairs");
  CHECK(chosen(randomCloud<double>(2000, 1.0, 0.05, 1.0, 28)) == "grid");
  CHECK(chosen(randomCloud<double>(2000, 1.0, 0.05, 100.0, 28)) == "grid");
  CHECK(chosen(randomCloud<double>(2000, 1e4, 0.05, 1.0, 28)) == "grid");
  auto clump = randomCloud<double>(2000, 1.0, 0.05, 1.0, 28);
  clump.positions[0] = {1e5, 1e5, 1e5};
  CHECK(chosen(clump) == "k-d tree");
}

TEST_CASE("searches refuse what is no place or no radius, naming body and value") {
  for (const BroadPhaseKind kind : everyKind) {
    BroadPhase<double> method(kind);
    std::vector<Pair> pairs;
    const auto find = [&](const Cloud<double>& cloud, double margin) {
      method.findPairs(cloud.positions, cloud.radii, cloud.ids, margin, Domain<double>::open(), 0.0, pairs);
    };
    const auto good = randomCloud<double>(200, 1.0, 0.1, 1.0, 29);
    auto bad = good;
    bad.positions[3][1] = std::nan("");
    const std::string name = std::to_string(toInteger(bad.ids[3]));
    CHECK_THROWS_WITH(find(bad, 0.0),
                      ContainsSubstring("position of body " + name) && ContainsSubstring("nan"));
    bad = good;
    bad.positions[3][2] = HUGE_VAL;
    CHECK_THROWS_WITH(find(bad, 0.0),
                      ContainsSubstring("position of body " + name) && ContainsSubstring("inf"));
    bad = good;
    bad.radii[3] = -0.25;
    CHECK_THROWS_WITH(find(bad, 0.0), ContainsSubstring("radius of body " + name + " is -0.25"));
    bad = good;
    bad.radii.pop_back();
    CHECK_THROWS_WITH(find(bad, 0.0), ContainsSubstring("length of radii and ids is 199 and 200"));
    CHECK_THROWS_WITH(find(good, -1.0), ContainsSubstring("margin of a pair search is -1"));
    const auto patch = Domain<double>::shearPeriodic({9, 9, 9}, 1.0);
    CHECK_THROWS_WITH(method.findPairs(good.positions, good.radii, good.ids, 0.0, patch, std::nan(""), pairs),
                      ContainsSubstring("time of a pair search is nan"));
    CHECK_NOTHROW(find(good, 0.0));  // a refusal leaves nothing broken
  }
}

TEST_CASE("a user's own scalar is searched by all pairs, whatever was asked for") {
  const auto plain = randomCloud<double>(100, 1.0, 0.1, 3.0, 30);
  std::vector<Vector3<MinimalReal>> positions;
  std::vector<MinimalReal> radii;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const Vector3<double>& x = plain.positions[i];
    positions.push_back({MinimalReal(x[0]), MinimalReal(x[1]), MinimalReal(x[2])});
    radii.push_back(MinimalReal(plain.radii[i]));
  }
  const auto domain = Domain<MinimalReal>::periodic({MinimalReal(1), MinimalReal(1), MinimalReal(1)});
  BroadPhase<MinimalReal> method(BroadPhaseKind::KDTree);
  std::vector<Pair> pairs;
  method.findPairs(positions, radii, plain.ids, MinimalReal(0), domain, MinimalReal(0), pairs);
  CHECK(std::string(method.name()) == "all pairs");
  CHECK(named(pairs, plain) == brutePairs(plain, 0.0, Domain<double>::periodic({1, 1, 1}), 0.0));
}

// Seen to fail: an extent that overflows gave a number of cells that is not a number.
TEST_CASE("places at the ends of the scalar's range are searched as one cell") {
  for (const BroadPhaseKind kind : everyKind) {
    BroadPhase<double> method(kind);
    auto cloud = randomCloud<double>(200, 1.0, 0.1, 1.0, 31);
    cloud.positions[0] = {1.7e308, 0, 0};
    cloud.positions[1] = {-1.7e308, 0, 0};
    std::vector<Pair> pairs;
    method.findPairs(cloud.positions, cloud.radii, cloud.ids, 0.0, Domain<double>::open(), 0.0, pairs);
    CHECK(pairs.size() > 100);
    CHECK(
        std::none_of(pairs.begin(), pairs.end(), [](const Pair& p) { return p.first < 2 || p.second < 2; }));
  }
}
