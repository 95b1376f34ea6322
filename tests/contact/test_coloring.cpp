// Colours of graphs and of contacts.

#include "scenes.hpp"
#include "support/catch.hpp"
#include "support/threads.hpp"
#include <gravel/contact/coloured_rows.hpp>
#include <gravel/contact/contact_islands.hpp>
#include <gravel/contact/graph_coloring.hpp>

#include <omp.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

using namespace gravel;
using namespace gravel::test;

namespace {

using Graph = std::vector<std::vector<std::size_t>>;

bool valid(const Graph& graph, const std::vector<int>& colour) {
  if (colour.size() != graph.size()) {
    return false;
  }
  for (std::size_t i = 0; i < graph.size(); ++i) {
    for (const std::size_t j : graph[i]) {
      if (colour[i] == colour[j] || colour[i] < 0) {
        return false;
      }
    }
  }
  return true;
}

int coloursOf(const std::vector<int>& colour) {
  return colour.empty() ? 0 : 1 + *std::max_element(colour.begin(), colour.end());
}

std::size_t largestDegree(const Graph& graph) {
  std::vector<std::set<std::size_t>> both(graph.size());
  for (std::size_t i = 0; i < graph.size(); ++i) {
    for (const std::size_t j : graph[i]) {
      both[i].insert(j);
      both[j].insert(i);
    }
  }
  std::size_t largest = 0;
  for (const auto& neighbours : both) {
    largest = std::max(largest, neighbours.size());
  }
  return largest;
}

Graph randomGraph(std::size_t n, double degree, std::uint64_t seed, bool bothWays) {
  Graph graph(n);
  const CounterRandom random(seed);
  const auto edges = static_cast<std::uint64_t>(degree * static_cast<double>(n) / 2);
  for (std::uint64_t e = 0; e < edges; ++e) {
    const std::size_t i = random.bits(2 * e) % n;
    const std::size_t j = random.bits(2 * e + 1) % n;
    if (i != j) {
      graph[i].push_back(j);
      if (bothWays) {
        graph[j].push_back(i);
      }
    }
  }
  return graph;
}

/// n of radius 1, of which one in `period` is fixed.
Bodies<double, SoA> someFixed(std::uint32_t n, std::uint32_t period) {
  Bodies<double, SoA> bodies;
  for (std::uint32_t i = 0; i < n; ++i) {
    Body<double> body;
    body.radius = 1;
    body.fixed = i % period == 3;
    bodies.add(body);
  }
  return bodies;
}

/// The parts are all rows, each once; and of all groups of rows that threads share one by one, the same share
/// has gone by at any time, but for a part of each.
// Seen to fail: parts in the order of the colours.
void checkParts(const ContactColoring& coloring) {
  std::vector<std::pair<std::size_t, std::size_t>> groups{{0, coloring.loneCount()},
                                                          {coloring.loneCount(), coloring.islandsEnd()},
                                                          {coloring.islandsEnd(), coloring.begin(0)}};
  for (std::size_t colour = 0; colour <= coloring.colours(); ++colour) {
    groups.emplace_back(coloring.begin(colour), coloring.end(colour));
  }
  std::vector<std::size_t> next;
  for (const auto& [begin, end] : groups) {
    next.push_back(begin);
  }
  bool inOrder = true;
  bool alike = true;
  for (const ContactColoring::Part& part : coloring.parts()) {
    std::size_t own = 0;
    while (own < groups.size() && !(groups[own].first <= part.begin && part.begin < groups[own].second)) {
      ++own;
    }
    REQUIRE(own < groups.size());
    inOrder = inOrder && part.begin == next[own] && part.end <= groups[own].second &&
              part.end - part.begin <= ContactColoring::partSize;
    next[own] = part.end;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const auto share = [&](std::size_t k, double more) {  // that has gone by, and so many rows more
        const auto [begin, end] = groups[k];
        return (static_cast<double>(next[k] - begin) + more) / static_cast<double>(end - begin);
      };
      const auto isShared = [&](std::size_t k) {
        return k + 1 < groups.size() && groups[k].second - groups[k].first >= ContactColoring::fewRows;
      };
      if (isShared(own) && isShared(g)) {
        constexpr double size = ContactColoring::partSize;
        alike = alike && share(own, -size / 2) <= std::min(1.0, share(g, size));
      }
    }
  }
  CHECK(inOrder);
  CHECK(alike);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    CHECK(next[g] == groups[g].second);
  }
}

/// One value for all bodies.
template <class T>
struct SameForAll {
  T value;
  const T& operator[](std::size_t) const { return value; }
};

/// Bodies whose ids fall with their indices, which count look-ups beyond the last one.
struct WatchedBodies {
  std::size_t n;
  std::size_t* beyond;
  struct Ids {
    std::size_t n;
    std::size_t* beyond;
    std::uint64_t operator[](std::size_t i) const {
      *beyond += i < n ? 0U : 1U;
      return 100 - i;
    }
  };
  std::size_t size() const { return n; }
  SameForAll<Vector3<double>> positions() const { return {Vector3<double>::Zero()}; }
  SameForAll<Vector3<double>> velocities() const { return positions(); }
  SameForAll<Vector3<double>> angularVelocities() const { return positions(); }
  SameForAll<Vector3<double>> accelerations() const { return positions(); }
  SameForAll<double> masses() const { return {1.0}; }
  SameForAll<double> radii() const { return {1.0}; }
  SameForAll<double> inertiaFactors() const { return {0.4}; }
  SameForAll<std::uint32_t> flags() const { return {0}; }
  SameForAll<std::uint32_t> materials() const { return {0}; }
  Ids ids() const { return {n, beyond}; }
};

}  // namespace

TEST_CASE("colorGraph: valid and within degree + 1 colours on random graphs, however edges are listed") {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const std::size_t n = 1 + static_cast<std::size_t>(seed * seed);
    for (const double degree : {0.5, 3.0, 20.0}) {
      for (const bool bothWays : {false, true}) {
        const Graph graph = randomGraph(n, degree, seed, bothWays);
        const std::vector<int> colour = colorGraph(graph);
        CHECK(valid(graph, colour));
        CHECK(static_cast<std::size_t>(coloursOf(colour)) <= largestDegree(graph) + 1);
      }
    }
  }
}

TEST_CASE("colorGraph: complete graph, star, long path, cycle, no edges, nothing") {
  Graph complete(60);
  for (std::size_t i = 0; i < 60; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      complete[i].push_back(j);
    }
  }
  CHECK(valid(complete, colorGraph(complete)));
  CHECK(coloursOf(colorGraph(complete)) == 60);
  Graph star(10001);
  for (std::size_t i = 1; i <= 10000; ++i) {
    star[0].push_back(i);
  }
  CHECK(valid(star, colorGraph(star)));
  CHECK(coloursOf(colorGraph(star)) == 2);
  Graph path(100000);
  for (std::size_t i = 1; i < path.size(); ++i) {
    path[i].push_back(i - 1);
  }
  CHECK(valid(path, colorGraph(path)));
  CHECK(coloursOf(colorGraph(path)) <= 3);
  CHECK(colorGraph(Graph(7)) == std::vector<int>(7, 0));
  CHECK(colorGraph({}).empty());
}

TEST_CASE("colorGraph: the same colours for 1, 2, 3 and 8 threads") {
  const Graph graph = randomGraph(20000, 8.0, 4, false);
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const std::vector<int> one = colorGraph(graph);
  for (const int threads : {2, 3, 8}) {
    omp_set_num_threads(threads);
    CHECK(colorGraph(graph) == one);
  }
  omp_set_num_threads(before);
}

TEST_CASE("colorGraph: self loops and strangers are refused by vertex") {
  CHECK_THROWS_AS(colorGraph({{1}, {1}}), std::invalid_argument);
  CHECK_THROWS_WITH(colorGraph({{1}, {0, 5}}),
                    ContainsSubstring("neighbour of vertex 1 is 5") && ContainsSubstring("below 2"));
}

TEST_CASE("contacts of one colour share no movable body; lone ones share none with any") {
  Bodies<double, SoA> bodies = randomCloud<double>(500, 7.0, 8);
  for (std::size_t i = 0; i < 500; i += 10) {
    bodies[i].setFixed(true);
  }
  const auto contacts = contactsOf<double>(bodies, Material<double>{}, {{{0, 0, 1}, -3, {}}});
  ContactColoring coloring;
  for (int again = 0; again < 2; ++again) {  // the workspace is left clean
    coloring.build(std::span<const Contact<double>>(contacts), bodies);
    REQUIRE(coloring.rows().size() == contacts.size());
    std::vector<int> uses(bodies.size(), 0);
    std::vector<bool> seen(contacts.size(), false);
    for (const Contact<double>& c : contacts) {
      ++uses[c.first];
      uses[c.second == staticPartner ? c.first : c.second] += c.second == staticPartner ? 0 : 1;
    }
    const auto check = [&](std::size_t begin, std::size_t end) {
      std::set<std::uint32_t> taken;
      for (std::size_t k = begin; k < end; ++k) {
        const ContactColoring::Row& row = coloring.rows()[k];
        CHECK_FALSE(seen[row.contact]);
        seen[row.contact] = true;
        const Contact<double>& c = contacts[row.contact];
        CHECK(coloring.bodies()[row.slot1] == c.first);
        if (c.second == staticPartner) {
          CHECK(row.slot2 == coloring.staticSlot());
        } else {
          CHECK(coloring.bodies()[row.slot2] == c.second);
        }
        for (const std::uint32_t body : {c.first, c.second}) {
          if (body != staticPartner && !bodies[body].isFixed()) {
            CHECK(taken.insert(body).second);
          }
        }
      }
    };
    CHECK(coloring.loneCount() > 0);
    check(0, coloring.loneCount());
    for (std::size_t k = 0; k < coloring.loneCount(); ++k) {
      const Contact<double>& c = contacts[coloring.rows()[k].contact];
      CHECK((bodies[c.first].isFixed() || uses[c.first] == 1));
      CHECK((c.second == staticPartner || bodies[c.second].isFixed() || uses[c.second] == 1));
    }
    CHECK(coloring.blocks() == coloring.bundles());
    std::size_t colours = 0;  // a contact has a neighbour of each colour before its own: none is left out
    for (std::size_t bundle = 0; bundle < coloring.bundles(); ++bundle) {
      colours = std::max(colours, coloring.coloursOf(bundle).size());
      for (const ContactColoring::Part& rows : coloring.coloursOf(bundle)) {
        CHECK(rows.begin < rows.end);
        check(rows.begin, rows.end);
      }
    }
    bool ends = false;
    for (std::size_t colour = 0; colour < coloring.colours(); ++colour) {
      check(coloring.begin(colour), coloring.end(colour));
      const bool any = coloring.begin(colour) < coloring.end(colour);
      CHECK_FALSE((ends && any));
      ends = ends || !any;
      colours = std::max(colours, any ? colour + 1 : 0);
    }
    CHECK(colours == coloring.colours());
    CHECK(coloring.begin(coloring.colours()) == contacts.size());  // no overflow here
    CHECK(std::count(seen.begin(), seen.end(), true) == static_cast<std::ptrdiff_t>(contacts.size()));
  }
}

TEST_CASE("all contacts of a fixed body with single grains are one group") {
  Bodies<double, SoA> bodies;
  Body<double> body;
  body.radius = 1;
  body.fixed = true;
  bodies.add(body);
  body.fixed = false;
  body.radius = 0.01;
  for (int i = 0; i < 200; ++i) {
    bodies.add(body);
  }
  std::vector<Contact<double>> contacts;
  for (std::uint32_t i = 1; i <= 200; ++i) {
    contacts.push_back({0, i, 0, i, {1, 0, 0}, -1.0, 1.0, 0.0});
  }
  ContactColoring coloring;
  coloring.build(std::span<const Contact<double>>(contacts), bodies);
  CHECK(coloring.loneCount() == 200);
  CHECK(coloring.colours() == 0);
}

// Seen to fail: parts that write from the places of the first; parts in the other order.
TEST_CASE("colours, and the order within one, are those of one walk along a list of many parts") {
  constexpr std::uint32_t n = 12000;
  const Bodies<double, SoA> bodies = someFixed(n, 50);
  const CounterRandom random(5);
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint64_t k = 0; k < 40000; ++k) {
    // Some with many partners, for the overflow; the last ones lone.
    const auto i = static_cast<std::uint32_t>(random.uniform(2 * k, 0, k % 40 == 0 ? 5 : 0.9 * n));
    const auto j = static_cast<std::uint32_t>(random.uniform(2 * k + 1, 0, 0.9 * n));
    if (i != j) {
      pairs.insert(std::minmax(i, j));
    }
  }
  for (std::uint32_t i = static_cast<std::uint32_t>(0.9 * n) + 1; i + 1 < n; i += 2) {
    pairs.insert({i, i + 1});
  }
  std::vector<Contact<double>> contacts;
  for (const auto& [i, j] : pairs) {
    contacts.push_back({i, j, i, j, {1, 0, 0}, -1.0, 1.0, 1.0});
  }
  std::vector<std::set<std::size_t>> taken(n);
  std::vector<int> partners(n, 0);
  const auto moves = [&](std::uint32_t i) { return !bodies[i].isFixed(); };
  for (const Contact<double>& c : contacts) {
    partners[c.first] += moves(c.first) ? 1 : 0;
    partners[c.second] += moves(c.second) ? 1 : 0;
  }
  std::vector<std::vector<std::uint32_t>> groups(2 + ContactColoring::maxColours);  // lone, colours, overflow
  for (std::uint32_t k = 0; k < contacts.size(); ++k) {
    const auto [i, j] = std::pair(contacts[k].first, contacts[k].second);
    std::size_t colour = 0;
    if (partners[i] > 1 || partners[j] > 1) {
      while (colour < ContactColoring::maxColours &&
             (taken[i].contains(colour) || taken[j].contains(colour))) {
        ++colour;
      }
      for (const std::uint32_t body : {i, j}) {
        if (moves(body)) {
          taken[body].insert(colour);
        }
      }
      ++colour;
    }
    groups[colour].push_back(k);
  }
  REQUIRE(groups.front().size() > 500);
  REQUIRE(groups.back().size() > 100);
  const int before = omp_get_max_threads();
  for (const int threads : {1, 3}) {
    omp_set_num_threads(threads);
    ContactColoring coloring;
    coloring.build(std::span<const Contact<double>>(contacts), bodies);
    std::size_t place = 0;
    bool same = true;
    for (const auto& group : groups) {
      for (const std::uint32_t k : group) {
        same = same && coloring.rows()[place++].contact == k;
      }
    }
    CHECK(same);
    CHECK(coloring.loneCount() == groups.front().size());
    CHECK(coloring.begin(coloring.colours()) == contacts.size() - groups.back().size());
    for (const ContactColoring::Row& row : coloring.rows()) {
      const Contact<double>& c = contacts[row.contact];
      same = same && row.slot1 == coloring.slotOf(c.first) && row.slot2 == coloring.slotOf(c.second);
    }
    CHECK(same);
    checkParts(coloring);
    CHECK(std::is_sorted(coloring.bodies().begin(), coloring.bodies().end()));
  }
  omp_set_num_threads(before);
}

// Seen to fail: all contacts whose first bodies are of a block among those within it; parts that stand where
// they do in a colour of their block.
TEST_CASE(
    "of many bodies, contacts within blocks come first: of the same colours, and no two blocks share a "
    "body") {
  constexpr std::uint32_t side = 36;
  constexpr std::uint32_t n = side * side * side;
  const Bodies<double, SoA> bodies = someFixed(n, 97);
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t i = 0; i < n - 2000; ++i) {  // neighbours in a lattice
    for (const std::uint32_t ahead : {1U, side, side * side}) {
      if (i + ahead < n - 2000) {
        pairs.insert({i, i + ahead});
      }
    }
  }
  const CounterRandom random(6);
  for (std::uint64_t k = 0; k < 4000; ++k) {  // and some far from each other
    const auto i = static_cast<std::uint32_t>(random.uniform(2 * k, 0, n - 2000));
    const auto j = static_cast<std::uint32_t>(random.uniform(2 * k + 1, 0, n - 2000));
    if (i != j) {
      pairs.insert(std::minmax(i, j));
    }
  }
  for (std::uint32_t i = n - 1500; i + 1 < n; i += 2) {  // lone ones
    pairs.insert({i, i + 1});
  }
  std::vector<Contact<double>> contacts;
  for (const auto& [i, j] : pairs) {
    contacts.push_back({i, j, i, j, {1, 0, 0}, -1.0, 1.0, 1.0});
    if (i < n - 2000 && i % side == 0 && j == i + 1) {
      contacts.push_back({i, staticPartner, i, boundaryKey(0), {-1, 0, 0}, -1.0, 1.0, 0.0});
    }
  }
  std::sort(contacts.begin(), contacts.end(), byKeys);

  const auto coloured = [&](int threads) {
    const WithThreads some(threads);
    ContactColoring coloring;
    coloring.build(std::span<const Contact<double>>(contacts), bodies);
    return coloring;
  };
  const ContactColoring coloring = coloured(1);
  REQUIRE(coloring.blocks() > 8);
  std::vector<int> seen(contacts.size(), 0);
  std::vector<std::size_t> blockOf(n, coloring.blocks());
  std::size_t place = 0;
  const auto check = [&](std::size_t begin, std::size_t end, std::size_t block) {
    std::set<std::uint32_t> taken;
    bool fine = begin == place;  // groups follow each other
    place = end;
    for (std::size_t k = begin; k < end; ++k) {
      const std::uint32_t contact = coloring.rows()[k].contact;
      ++seen[contact];
      fine = fine && (k == begin || coloring.rows()[k - 1].contact < contact);
      for (const std::uint32_t body : {contacts[contact].first, contacts[contact].second}) {
        if (body != staticPartner && !bodies[body].isFixed()) {
          fine = fine && taken.insert(body).second;
          if (block < coloring.blocks()) {
            fine = fine && (blockOf[body] == coloring.blocks() || blockOf[body] == block);
            blockOf[body] = block;
          }
        }
      }
    }
    return fine;
  };
  bool fine = check(0, coloring.loneCount(), coloring.blocks());
  CHECK(coloring.loneCount() >= 750);
  for (std::size_t block = 0; block < coloring.blocks(); ++block) {
    for (const ContactColoring::Part& rows : coloring.coloursOf(block)) {
      fine = fine && rows.begin < rows.end && check(rows.begin, rows.end, block);
    }
  }
  CHECK(fine);
  CHECK(place == coloring.begin(0));
  CHECK(place > contacts.size() / 2);  // most of them
  for (std::size_t colour = 0; colour < coloring.colours(); ++colour) {
    CHECK(check(coloring.begin(colour), coloring.end(colour), coloring.blocks()));
  }
  CHECK(coloring.begin(coloring.colours()) == contacts.size());  // no overflow here
  CHECK(std::count(seen.begin(), seen.end(), 1) == static_cast<std::ptrdiff_t>(contacts.size()));
  checkParts(coloring);
  const ContactColoring other = coloured(3);
  bool same = true;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    same = same && coloring.rows()[k].contact == other.rows()[k].contact;
  }
  CHECK(same);
}

// Rows of one block would be written over those of another, and impulses handed on to the wrong ones. Seen to
// fail: taken as they come; those in the order of their first bodies taken.
TEST_CASE("contacts out of the order of their keys are refused") {
  const Bodies<double, SoA> bodies = someFixed(4, 50);
  const std::vector<Contact<double>> contacts{{1, 2, 1, 2, {1, 0, 0}, -1.0, 1.0, 1.0},
                                              {2, 3, 2, 3, {1, 0, 0}, -1.0, 1.0, 1.0},
                                              {0, 1, 0, 1, {1, 0, 0}, -1.0, 1.0, 1.0},
                                              {1, 3, 1, 3, {1, 0, 0}, -1.0, 1.0, 1.0}};
  ContactColoring coloring;
  CHECK_THROWS_WITH(coloring.build(std::span<const Contact<double>>(contacts), bodies),
                    ContainsSubstring("place of a contact is 2"));
  const std::vector<Contact<double>> two{contacts[0], contacts[2]};  // firsts in the order of appearance
  CHECK_THROWS_WITH(coloring.build(std::span<const Contact<double>>(two), bodies),
                    ContainsSubstring("place of a contact is 1"));
  const std::vector<Contact<double>> seconds{contacts[2], contacts[3], contacts[0], contacts[1]};
  CHECK_THROWS_WITH(coloring.build(std::span<const Contact<double>>(seconds), bodies),
                    ContainsSubstring("place of a contact is 2"));
}

// Seen to fail: a task for each part.
TEST_CASE("passes over all rows open no parallel region where no colour is shared between threads") {
  const Bodies<double, SoA> bodies = randomCloud<double>(500, 7.0, 8);
  const auto contacts = contactsOf<double>(bodies, Material<double>{}, {{{0, 0, 1}, -3, {}}});
  ContactColoring coloring;
  coloring.build(std::span<const Contact<double>>(contacts), bodies);
  REQUIRE(coloring.parts().size() > 4);
  const int before = omp_get_max_threads();
  omp_set_num_threads(2);
  int inside = 0;
  const std::size_t rows = detail::sumOverAllParts(coloring, std::size_t{0},
                                                   [&](std::size_t begin, std::size_t end, std::size_t& sum) {
                                                     inside += omp_in_parallel();
                                                     sum += end - begin;
                                                   });
  detail::forAllParts(coloring, [&](std::size_t, std::size_t) { inside += omp_in_parallel(); });
  omp_set_num_threads(before);
  CHECK(rows == contacts.size());
  CHECK(inside == 0);
}

// Seen to fail: slots numbered as their bodies appear.
TEST_CASE("slots stand in the order of ids, whatever the indices are") {
  Bodies<double, SoA> bodies = randomCloud<double>(500, 7.0, 8);
  std::vector<std::size_t> order(bodies.size());
  std::iota(order.rbegin(), order.rend(), std::size_t{0});
  bodies.reorder(order);
  const auto contacts = contactsOf<double>(bodies, Material<double>{}, {{{0, 0, 1}, -3, {}}});
  ContactColoring coloring;
  coloring.build(std::span<const Contact<double>>(contacts), bodies);
  std::set<std::uint64_t> ids;
  for (const Contact<double>& c : contacts) {
    ids.insert(c.key1);
    if (c.second != staticPartner) {
      ids.insert(c.key2);
    }
  }
  std::vector<std::uint64_t> bySlot;
  for (const std::uint32_t body : coloring.bodies()) {
    bySlot.push_back(bodies.ids()[body]);
  }
  CHECK(bySlot == std::vector<std::uint64_t>(ids.begin(), ids.end()));
}

// Seen to fail: slots kept of bodies that take part no more, and where ids stand in another order.
TEST_CASE("colours and slots are those of these contacts, whatever was coloured before") {
  Bodies<double, SoA> bodies = randomCloud<double>(500, 7.0, 8);
  ContactColoring coloring;
  const auto agree = [&](const std::vector<Contact<double>>& contacts) {
    coloring.build(std::span<const Contact<double>>(contacts), bodies);
    ContactColoring anew;
    anew.build(std::span<const Contact<double>>(contacts), bodies);
    bool same = coloring.bodies().size() == anew.bodies().size() && coloring.colours() == anew.colours() &&
                coloring.loneCount() == anew.loneCount();
    for (std::uint32_t slot = 0; same && slot < anew.bodies().size(); ++slot) {
      same = coloring.bodies()[slot] == anew.bodies()[slot] && coloring.movable(slot) == anew.movable(slot);
    }
    for (std::uint32_t i = 0; same && i < bodies.size(); ++i) {
      same = coloring.slotOf(i) == anew.slotOf(i);
    }
    for (std::size_t k = 0; same && k < contacts.size(); ++k) {
      const ContactColoring::Row& row = coloring.rows()[k];
      const ContactColoring::Row& other = anew.rows()[k];
      same = row.contact == other.contact && row.slot1 == other.slot1 && row.slot2 == other.slot2;
    }
    return same;
  };
  const auto all = [&] {
    return contactsOf<double>(bodies, Material<double>{}, {{{0, 0, 1}, -3, {}}}).contacts;
  };
  std::vector<Contact<double>> contacts = all();
  CHECK(agree(contacts));
  CHECK(agree(contacts));
  // All contacts of one body end, and come back.
  const std::uint32_t gone = contacts[contacts.size() / 2].first;
  std::vector<Contact<double>> fewer = contacts;
  std::erase_if(fewer, [&](const Contact<double>& c) { return c.first == gone || c.second == gone; });
  CHECK(agree(fewer));
  CHECK(agree(contacts));
  fewer = contacts;
  fewer.erase(fewer.begin() + 3);
  CHECK(agree(fewer));
  bodies[contacts[7].first].setFixed(true);
  CHECK(agree(all()));
  std::vector<std::size_t> order(bodies.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::swap(order[contacts[0].first], order[contacts[0].second]);
  bodies.reorder(order);  // the same indices take part, of other ids
  CHECK(agree(all()));
  bodies.remove(bodies[0].id());
  bodies.remove(bodies[200].id());
  CHECK(agree(all()));
  CHECK(agree({}));
  CHECK(agree(all()));
}

// Seen to fail: counts above fewRows taken for small; crowded rows not left out; islands told apart in the
// order of their smallest bodies.
TEST_CASE(
    "contacts of small islands come bundle by bundle, each island whole and in the order of its colours") {
  constexpr std::uint32_t n = 4000;
  const Bodies<double, SoA> bodies = someFixed(n, 50);
  std::vector<Contact<double>> contacts;
  const auto touch = [&](std::uint32_t i, std::uint32_t j) {
    contacts.push_back({i, j, i, j, {1, 0, 0}, -1.0, 1.0, 1.0});
  };
  // Chains of 1, 2, 3, ... contacts, up to more than are few; then a hub with more than there are colours.
  std::uint32_t body = 0;
  for (std::uint32_t length = 1; body + length + 100 < n; length += length < 12 ? 1 : 37) {
    body += bodies[body].isFixed() ? 1 : 0;
    std::uint32_t last = body;
    for (std::uint32_t k = 0; k < length; ++k) {
      std::uint32_t next = last + 1;
      next += bodies[next].isFixed() ? 1 : 0;
      touch(last, next);
      last = next;
    }
    body = last + 1;
  }
  const std::uint32_t hub = body;
  for (std::uint32_t i = 1; i <= 70; ++i) {
    touch(hub, hub + i);
  }
  std::sort(contacts.begin(), contacts.end(), byKeys);
  ContactIslands islands;
  islands.find(std::span<const Contact<double>>(contacts), bodies);
  const auto islandOf = [&](const Contact<double>& c) {
    return islands.of(bodies[c.first].isFixed() ? c.second : c.first);
  };
  std::map<std::uint32_t, std::size_t> sizes;
  for (const Contact<double>& c : contacts) {
    ++sizes[islandOf(c)];
  }
  const auto isSmall = [&](const Contact<double>& c) {
    const std::size_t size = sizes[islandOf(c)];
    return size > 1 && size <= detail::SolverIslands::fewRows && c.first != hub;
  };
  ContactColoring coloring;
  coloring.build(std::span<const Contact<double>>(contacts), bodies);
  const auto few = static_cast<std::size_t>(std::count_if(contacts.begin(), contacts.end(), isSmall));
  REQUIRE(few > 500);
  REQUIRE(few + 200 < contacts.size());
  CHECK(coloring.islandsEnd() - coloring.loneCount() == few);
  REQUIRE(coloring.bundles() > 2);
  std::map<std::uint32_t, std::uint32_t> numbers;  // by island
  std::map<std::uint32_t, std::size_t> found;      // by number
  for (std::size_t bundle = 0; bundle < coloring.bundles(); ++bundle) {
    std::size_t rowsOfBundle = 0;
    for (const ContactColoring::Part& rows : coloring.coloursOf(bundle)) {
      std::set<std::uint32_t> taken;
      for (std::size_t k = rows.begin; k < rows.end; ++k, ++rowsOfBundle) {
        const Contact<double>& c = contacts[coloring.rows()[k].contact];
        const std::uint32_t number = coloring.islandOf(k);
        CHECK(isSmall(c));
        CHECK(numbers.emplace(islandOf(c), number).first->second == number);
        CHECK(coloring.islands().bundleOf(number) == bundle);
        CHECK((coloring.islands().firstOf(bundle) <= number &&
               number < coloring.islands().firstOf(bundle + 1)));
        ++found[number];
        for (const std::uint32_t i : {c.first, c.second}) {
          CHECK((bodies[i].isFixed() || taken.insert(i).second));
        }
      }
    }
    CHECK(rowsOfBundle < 2 * detail::SolverIslands::fewRows);
    CHECK((bundle + 1 == coloring.bundles() || rowsOfBundle >= detail::SolverIslands::fewRows));
  }
  for (const auto& [island, number] : numbers) {
    CHECK(found[number] == sizes[island]);  // whole, in one bundle
  }
  checkParts(coloring);
}

// Seen to fail: the ids of places looked up of bodies that are gone (a look-up beyond the end).
TEST_CASE("slots of bodies that are gone are not looked up") {
  const auto row = [](std::uint32_t n) {
    std::vector<Contact<double>> contacts;
    for (std::uint32_t i = n - 1; i > 0; --i) {
      contacts.push_back({i, i - 1, 100 - i, 101 - i, Vector3<double>::UnitX(), 0.0, 1.0, 1.0});
    }
    return contacts;
  };
  std::size_t beyond = 0;
  ContactColoring coloring;
  coloring.build(std::span<const Contact<double>>(row(6)), WatchedBodies{6, &beyond});
  coloring.build(std::span<const Contact<double>>(row(3)), WatchedBodies{3, &beyond});
  CHECK(coloring.bodies().size() == 3);
  CHECK(beyond == 0);
}

// Seen to fail: one of 63 contacts with fixed bodies found no colour, and was solved away from the others.
TEST_CASE("an island whose contacts might lack a colour is none of the small ones, whole as it is") {
  for (const bool fixed : {false, true}) {
    for (std::uint32_t partners = 60; partners <= 66; ++partners) {
      CAPTURE(fixed, partners);
      Bodies<double, SoA> bodies;
      Body<double> body;
      body.radius = 1;
      bodies.add(body);
      body.fixed = fixed;
      std::vector<Contact<double>> contacts;
      for (std::uint32_t i = 1; i <= partners; ++i) {
        bodies.add(body);
        contacts.push_back({0, i, 0, i, {1, 0, 0}, -1.0, 1.0, 1.0});
      }
      ContactColoring coloring;
      coloring.build(std::span<const Contact<double>>(contacts), bodies);
      const bool isSmall = coloring.bundles() == 1;
      CHECK(isSmall == (partners + (fixed ? 0 : 1) <= ContactColoring::maxColours));
      CHECK(coloring.islandsEnd() == (isSmall ? partners : 0));
    }
  }
}
