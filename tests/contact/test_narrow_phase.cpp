#include "scenes.hpp"
#include "support/catch.hpp"
#include <gravel/contact/narrow_phase.hpp>
#include <gravel/spatial/broad_phase.hpp>

#include <omp.h>

using namespace gravel;
using namespace gravel::test;

namespace {

bool sameContacts(const ContactList<double>& one, const ContactList<double>& other) {
  return std::equal(one.begin(), one.end(), other.begin(), other.end(), [&](const auto& a, const auto& b) {
    return a.first == b.first && a.second == b.second && a.key1 == b.key1 && a.key2 == b.key2 &&
           a.normal == b.normal && a.gap == b.gap && a.arm1 == b.arm1 && a.arm2 == b.arm2 &&
           one.surface(a) == other.surface(b);
  });
}

}  // namespace

TEMPLATE_TEST_CASE("contacts of a crowd are those of a brute-force loop, sorted by keys", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  const Bodies<S, SoA> bodies = randomCloud<S>(150, 5.0, 2);
  const auto contacts = contactsOf<S>(bodies, Material<S>{}, {{Vector3<S>(0, 0, 1), S(-2), {}}});
  std::size_t found = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (std::size_t j = i + 1; j < bodies.size(); ++j) {
      const Vector3<S> r_ij = bodies[j].position() - bodies[i].position();
      const S reach = bodies[i].radius() + bodies[j].radius();
      if (r_ij.norm() < reach) {
        REQUIRE(found < contacts.size());
        const Contact<S>& c = contacts[found++];
        CHECK(c.key1 == i);
        CHECK(c.key2 == j);
        CHECK((c.normal - r_ij.normalized()).norm() <= S(4) * eps<S>);
        CHECK(std::abs(c.gap - (r_ij.norm() - reach)) <= S(4) * eps<S> * reach);
        CHECK(std::abs(c.arm1 * bodies[j].radius() - c.arm2 * bodies[i].radius()) <= S(4) * eps<S>);
      }
    }
    const S depth = bodies[i].position()[2] + S(2) - bodies[i].radius();
    if (depth < S(0)) {
      REQUIRE(found < contacts.size());
      const Contact<S>& c = contacts[found++];
      CHECK(c.second == staticPartner);
      CHECK(c.key2 == boundaryKey(0));
      CHECK(c.normal == Vector3<S>(0, 0, -1));
      CHECK(std::abs(c.gap - depth) <= S(4) * eps<S>);
      CHECK(c.arm1 == bodies[i].radius());
    }
  }
  CHECK(found == contacts.size());
  CHECK(found > 100);
}

TEST_CASE("the list is the same for any number of threads") {
  const Bodies<double, SoA> bodies = randomCloud<double>(400, 6.0, 6);
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const auto one = contactsOf<double>(bodies, Material<double>{}, floorAtZero<double>());
  for (const int threads : {2, 3, 8}) {
    omp_set_num_threads(threads);
    const auto many = contactsOf<double>(bodies, Material<double>{}, floorAtZero<double>());
    CHECK(sameContacts(one, many));
  }
  omp_set_num_threads(before);
}

TEST_CASE("tracers, pairs of fixed bodies, and fixed bodies in a wall make no contact") {
  Bodies<double, SoA> bodies;
  Body<double> body;
  body.radius = 1;
  body.fixed = true;
  bodies.add(body);
  bodies.add(body);
  Body<double> tracer;
  tracer.mass = 0;
  bodies.add(tracer);
  body.fixed = false;
  bodies.add(body);
  const auto contacts = contactsOf<double>(bodies, Material<double>{}, floorAtZero<double>());
  REQUIRE(contacts.size() == 3);
  CHECK((contacts[0].key1 == 0 && contacts[0].key2 == 3));
  CHECK((contacts[1].key1 == 1 && contacts[1].key2 == 3));
  CHECK((contacts[2].key1 == 3 && contacts[2].key2 == boundaryKey(0)));
}

TEST_CASE("a margin takes pairs before they touch; sphere and half-space alike") {
  auto bodies = column<double>(2, -1e-3, 0.0, 1.0);
  CHECK(contactsOf<double>(bodies, Material<double>{}, floorAtZero<double>()).empty());
  const auto contacts = contactsOf<double>(bodies, Material<double>{}, floorAtZero<double>(), 2e-3);
  REQUIRE(contacts.size() == 2);
  CHECK_THAT(contacts[0].gap, WithinAbs(1e-3, 1e-15));
  CHECK_THAT(contacts[1].gap, WithinAbs(1e-3, 1e-15));
}

TEST_CASE("materials are mixed by id; an id without an entry is refused") {
  auto bodies = column<double>(3, 1e-3, 0.0, 1.0);
  bodies[1].setMaterial(MaterialId{1});
  const std::vector<Material<double>> materials{{1.0, 0.4, 0.4, 0.0}, {0.25, 0.1, 0.1, 0.0}};
  std::vector<HalfSpace<double>> floor = floorAtZero<double>();
  floor[0].material = {0.09, 0.9, 0.9, 0.0};
  ContactList<double> contacts;
  NarrowPhase<double> narrow;
  narrow.find(allPairs(bodies), bodies, Domain<double>::open(), materials, floor, {}, contacts);
  REQUIRE(contacts.size() == 3);
  CHECK(contacts.material(contacts[0]) == mix(materials[0], materials[1]));
  CHECK(contacts.material(contacts[0]).restitution == 0.5);
  CHECK_THAT(contacts.material(contacts[1]).restitution, WithinRel(0.3, 1e-15));  // the floor's contact
  bodies[2].setMaterial(MaterialId{2});
  bodies[0].position()[0] += 10.0;
  CHECK_THROWS_WITH(
      narrow.find(allPairs(bodies), bodies, Domain<double>::open(), materials, floor, {}, contacts),
      ContainsSubstring("material of body 2 is 2") && ContainsSubstring("number of materials, 2"));
  CHECK(contacts.size() == 3);  // as it was
}

// Seen to fail: equal numbers let through.
TEST_CASE("half-spaces that do not come in the order of their numbers are refused, and the list stays") {
  const auto bodies = column<double>(2, 1e-3, 0.0, 1.0);
  const std::vector<Material<double>> materials(1);
  std::vector<HalfSpace<double>> walls = floorAtZero<double>();
  ContactList<double> contacts;
  NarrowPhase<double> narrow;
  narrow.find(allPairs(bodies), bodies, Domain<double>::open(), materials, walls, {}, contacts);
  REQUIRE(contacts.size() == 2);
  walls.push_back(walls.front());
  CHECK_THROWS_WITH(
      narrow.find(allPairs(bodies), bodies, Domain<double>::open(), materials, walls, {}, contacts),
      ContainsSubstring("number of boundary 1 is 0; allowed: above that of the one before it, 0"));
  CHECK(contacts.size() == 2);
}

// Seen to fail: what stands behind the arrays was read, and a body touched itself.
TEST_CASE("pairs and bodies near boundaries that name no bodies are refused, and the list stays") {
  const auto bodies = column<double>(2, 1e-3, 0.0, 1.0);
  const std::vector<Material<double>> materials(1);
  const std::vector<HalfSpace<double>> walls = floorAtZero<double>();
  ContactList<double> contacts;
  NarrowPhase<double> narrow;
  const auto find = [&](const std::vector<Pair>& pairs, const std::vector<std::uint32_t>& near) {
    narrow.find(pairs, bodies, Domain<double>::open(), materials, walls, {}, contacts,
                std::span<const std::uint32_t>(near));
  };
  find({{0, 1}}, {0, 1});
  REQUIRE(contacts.size() == 2);
  for (const Pair& wrong : {Pair{0, 2}, Pair{7, 1}, Pair{1, 1}}) {
    CHECK_THROWS_WITH(find({wrong}, {0, 1}), ContainsSubstring("pair of bodies is ") &&
                                                 ContainsSubstring("allowed: two bodies, below 2"));
  }
  CHECK_THROWS_WITH(find({{0, 1}}, {0, 2}),
                    ContainsSubstring("body near a boundary is 2; allowed: below the number of bodies, 2"));
  CHECK(contacts.size() == 2);
}

// Seen to fail: what stands behind the accelerations of the frame was read.
TEST_CASE("what carries bodies, or bends their ways, is by body, and the list stays") {
  const auto bodies = column<double>(3, 1e-3, 0.0, 1.0);
  const std::vector<Material<double>> materials(1);
  const std::vector<HalfSpace<double>> floor = floorAtZero<double>();
  const std::vector<Vector3<double>> bend(bodies.size(), Vector3<double>::Zero());
  const std::vector<double> carried(bodies.size());
  ContactList<double> contacts;
  NarrowPhase<double> narrow;
  const std::vector<std::uint8_t> leaning(bodies.size());
  const auto find = [&](std::size_t carries, std::size_t bends, std::size_t leans) {
    NarrowPhaseSettings<double> settings;
    settings.step = 1e-3;
    settings.carried = std::span(carried).first(carries);
    settings.bend = std::span(bend).first(bends);
    settings.leaning = std::span(leaning).first(leans);
    narrow.find(allPairs(bodies), bodies, Domain<double>::open(), materials, floor, settings, contacts);
  };
  find(3, 3, 3);
  find(0, 0, 0);
  REQUIRE(contacts.size() == 3);
  CHECK_THROWS_WITH(find(2, 3, 3), ContainsSubstring("length of what carries bodies is 2; allowed: 0, or the "
                                                     "number of bodies, 3"));
  CHECK_THROWS_WITH(find(3, 1, 0), ContainsSubstring("length of what frames add is 1; allowed: 0, or the "
                                                     "number of bodies, 3"));
  CHECK_THROWS_WITH(find(0, 3, 2), ContainsSubstring("length of who leans is 2; allowed: 0, or the number "
                                                     "of bodies, 3"));
  CHECK(contacts.size() == 3);
}

// Seen to fail: contacts of one material with itself, or with a plane, mixed.
TEST_CASE("a pair of materials with coefficients of its own is not mixed, nor is one with a plane") {
  auto bodies = column<double>(4, 1e-3, 0.0, 1.0);
  bodies[0].setMaterial(MaterialId{1});
  bodies[3].setMaterial(MaterialId{2});
  const std::vector<Material<double>> materials{
      {.restitution = 0.1}, {.restitution = 0.2}, {.restitution = 0.3}};
  const std::vector<MaterialPair<double>> pairs{
      {0, 0, {.restitution = 0.6}}, {0, 1, {.restitution = 0.7}}, {1, 2, {.restitution = 0.8}}};
  const MaterialView<double> view(materials, pairs);
  std::vector<HalfSpace<double>> floor = floorAtZero<double>();
  floor[0].material = materials[2];
  ContactList<double> contacts;
  NarrowPhase<double> narrow;
  const auto restitutions = [&] {
    narrow.find(allPairs(bodies), bodies, Domain<double>::open(), view, floor, {}, contacts);
    std::vector<double> all;
    for (const Contact<double>& c : contacts) {
      all.push_back(contacts.material(c).restitution);
    }
    return all;
  };
  const double mixed12 = mix(materials[1], materials[2]).restitution;
  const double mixed02 = mix(materials[0], materials[2]).restitution;
  CHECK(restitutions() == std::vector<double>{0.7, mixed12, 0.6, mixed02});  // 0-1, 0-floor, 1-2, 2-3
  floor[0].surface = 2;
  CHECK(restitutions() == std::vector<double>{0.7, 0.8, 0.6, mixed02});
}

TEST_CASE("across the face of a sheared domain a contact carries the drift of the image") {
  const auto domain = Domain<double>::shearPeriodic({10, 10, 10}, 0.5);
  Bodies<double, SoA> bodies;
  Body<double> body;
  body.radius = 0.2;
  body.position = {4.8, 0, 0};
  bodies.add(body);
  body.position = {-4.9, 0, 0};
  bodies.add(body);
  ContactList<double> contacts;
  const std::vector<Material<double>> materials(1);
  NarrowPhase<double>().find(allPairs(bodies), bodies, domain, materials, {}, {}, contacts);
  REQUIRE(contacts.size() == 1);
  CHECK_THAT(contacts.drift(contacts[0])[1], WithinRel(-7.5, 1e-15));
  CHECK(contacts[0].normal == Vector3<double>(1, 0, 0));
  // Friction acts on the drift: the bodies are dragged along it, with momentum kept.
  bodies[0].velocity() = Vector3<double>(1, 0, 0);
  ContactSolver<double>().solve(contacts, bodies, 0.01);
  CHECK(bodies[0].velocity()[1] < 0.0);
  CHECK(bodies[1].velocity()[1] == -bodies[0].velocity()[1]);
}

// Seen to fail: numbers of the first part kept in all; one of a wall's surfaces counted from 0; a pair named
// otherwise from its other side; parts that do not share.
TEST_CASE(
    "every contact has the surface of its two sides, of how many materials ever, and equal ones share it") {
  const auto materialCount = GENERATE(as<std::size_t>(), 1, 2, 11, 150);
  const bool sheared = GENERATE(false, true);
  CAPTURE(materialCount, sheared);
  Bodies<double, SoA> bodies = randomCloud<double>(150, 5.0, 2);
  std::vector<Material<double>> materials;
  for (std::size_t m = 0; m < materialCount; ++m) {
    materials.push_back({.restitution = 0.5, .staticFriction = 0.9, .kineticFriction = 0.005 * double(m)});
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i].setMaterial(MaterialId{static_cast<std::uint32_t>(7 * i % materialCount)});
  }
  const auto domain = sheared ? Domain<double>::shearPeriodic({5, 5, 5}, 0.5) : Domain<double>::open();
  const std::vector<HalfSpace<double>> walls{
      {{0, 0, 1}, -1.5, {.staticFriction = 0.1, .kineticFriction = 0.1}, {0.1, 0, 0}, 4},
      {{0, 0, -1}, -1.5, {.staticFriction = 0.2, .kineticFriction = 0.2}, {0, 0, 0}, 7}};
  NarrowPhase<double> narrow;
  ContactList<double> contacts;
  for (int again = 0; again < 2; ++again) {  // with what is left of the first time
    narrow.find(allPairs(bodies), bodies, domain, materials, walls, {}, contacts);
    std::size_t onWalls = 0;
    std::size_t drifting = 0;
    for (const Contact<double>& c : contacts) {
      const auto surfaceOf = [&](std::uint32_t i) { return materials[bodies.materials()[i]]; };
      ContactSurface<double> expected;
      if (c.second == staticPartner) {
        const HalfSpace<double>& wall = walls[c.key2 == boundaryKey(4) ? 0 : 1];
        expected = {mix(surfaceOf(c.first), wall.material), wall.velocity};
        ++onWalls;
      } else {
        expected.material = mix(surfaceOf(c.first), surfaceOf(c.second));
        Vector3<double> r = bodies[c.second].position() - bodies[c.first].position();
        domain.minimumImage(r, expected.drift, 0.0);
        drifting += expected.drift == Vector3<double>::Zero() ? 0U : 1U;
      }
      CHECK(contacts.surface(c) == expected);
    }
    CHECK(onWalls > 50);
    CHECK((drifting > 20) == sheared);
    const std::size_t drifts = sheared ? 3 : 1;
    const std::size_t pairs = materialCount * (materialCount + 1) / 2 * drifts;
    const std::size_t onWall = materialCount * walls.size();
    CHECK(contacts.surfaces.size() <=
          materialCount + std::min(onWall, onWalls) + std::min(pairs, contacts.size() - onWalls));
  }
}

TEST_CASE("what is known of all contacts together is found with them") {
  Bodies<double, SoA> bodies = randomCloud<double>(150, 5.0, 2);
  for (std::size_t i = 0; i < bodies.size(); i += 7) {
    bodies[i].setMaterial(MaterialId{1});
  }
  std::vector<Material<double>> materials{{0.5, 0.0, 0.0, 0.0}, {0.5, 0.4, 0.4, 0.0}};
  std::vector<HalfSpace<double>> walls{{{0, 0, 1}, -2.0, {}}, {{0, 0, -1}, -2.5, {}, {0.1, 0, 0}, 1}};
  NarrowPhaseSettings<double> settings;
  NarrowPhase<double> narrow;
  ContactList<double> contacts;
  const auto check = [&](std::size_t others) {
    narrow.find(allPairs(bodies), bodies, Domain<double>::open(), materials, walls, settings, contacts);
    const ContactFacts<double>& found = narrow.facts();
    const auto listed = ContactFacts<double>::of(contacts, bodies, settings.before);
    bool rubs = false;
    bool drifts = false;
    double overlap = 0.0;
    double radius = 1e300;
    for (const Contact<double>& c : contacts) {
      rubs = rubs || contacts.material(c).staticFriction > 0.0;
      drifts = drifts || contacts.drift(c) != Vector3<double>::Zero();
      overlap = std::max(overlap, -c.gap);
      const double r1 = bodies[c.first].radius();
      const double r2 = c.second == staticPartner ? r1 : bodies[c.second].radius();
      radius = std::min({radius, r1, r2});
    }
    for (const ContactFacts<double>& facts : {found, listed}) {
      CHECK(facts.kinds.rub == rubs);
      CHECK(facts.kinds.drift == drifts);
      CHECK_FALSE(facts.kinds.turn);
      CHECK(facts.overlap == overlap);
      CHECK(facts.radius == radius);
      CHECK(facts.others == std::min(others, contacts.size()));
    }
  };
  constexpr auto all = std::numeric_limits<std::size_t>::max();
  check(all);  // compared with none
  std::vector<ContactName> names;
  for (const Contact<double>& c : contacts) {
    names.push_back(ContactName::of(c));
  }
  settings.before = names;
  check(0);
  names[7].second += 1;
  names.back().keys.second += 1;
  settings.before = names;
  check(2);
  materials[0].staticFriction = materials[1].staticFriction = 0.0;
  materials[0].kineticFriction = materials[1].kineticFriction = 0.0;
  walls.pop_back();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i].position() *= 2.0;
  }
  settings.before = {};
  check(all);
}

TEST_CASE("names are found from any place in their list as from its begin") {
  std::vector<ContactName> list;
  for (std::uint64_t k = 0; k < 120; ++k) {
    list.push_back({{k / 6, 2 * (k % 6) + 1}, 0, 0});
  }
  const std::span<const ContactName> names(list);
  for (std::uint64_t first = 0; first < 21; ++first) {
    for (std::uint64_t second = 0; second < 14; ++second) {
      const ContactKeys keys{first, second};
      const auto found = std::partition_point(names.begin(), names.end(),
                                              [&](const ContactName& name) { return name.keys < keys; });
      REQUIRE(placeOf(names, keys) == found);
      for (std::size_t from = 0; from <= names.size() + 1; ++from) {
        REQUIRE(placeOf(names, keys, from) == found);
      }
    }
  }
}

// A giant a thousand times as large as the grains that lie apart on it.
TEST_CASE("The gap that a giant may have at rest makes no candidates of grains") {
  Bodies<double, SoA> bodies;
  Body<double> body;
  body.radius = 1e3;
  bodies.add(body);
  body.radius = 1;
  for (int k = 0; k < 50; ++k) {
    const double angle = 3.5e-3 * k;  // 3.5 radii from one to the next
    body.position = 1001.5 * Vector3<double>(std::cos(angle), std::sin(angle), 0);
    bodies.add(body);
  }
  std::vector<Pair> pairs;
  BroadPhase<double> search;
  search.findPairs(bodies.positions(), detail::RestingReaches<Bodies<double, SoA>>{bodies}, bodies.ids(), 0.0,
                   Domain<double>::open(), 0.0, pairs);
  CHECK(pairs.size() == 50);
  for (const Pair& pair : pairs) {
    CHECK(pair.first == 0);
  }
}
