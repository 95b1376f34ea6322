#include "scenes.hpp"
#include "support/catch.hpp"
#include <gravel/contact/positional_correction.hpp>

#include <omp.h>

using namespace gravel;
using namespace gravel::test;

namespace {

template <class S, class B>
CorrectionReport<S> correct(B& bodies, const ContactList<S>& contacts, const CorrectionSettings<S>& settings,
                            PositionalCorrection<S>& correction) {
  ContactColoring coloring;
  coloring.build(std::span<const Contact<S>>(contacts), bodies);
  return correction.apply(contacts, coloring, bodies, settings, ContactFacts<S>::of(contacts, bodies));
}

template <class S>
S gapOf(const Bodies<S, SoA>& bodies, std::size_t i, std::size_t j) {
  return (bodies[j].position() - bodies[i].position()).norm() - bodies[i].radius() - bodies[j].radius();
}

/// What one sweep does: contact after contact, in plain numbers.
struct OneByOne {
  std::vector<Vector3<double>> shift;
  std::vector<Vector3<double>> velocity;
  double largest = 0;
  double loss = 0;

  OneByOne(const Bodies<double, SoA>& bodies, const ContactList<double>& contacts,
           const ContactColoring& colouring, const CorrectionSettings<double>& settings)
      : shift(bodies.size(), Vector3<double>::Zero()) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      velocity.push_back(bodies[i].velocity());
    }
    for (const ContactColoring::Row& row : colouring.rows()) {
      open(bodies, contacts[row.contact], settings);
    }
  }

  void open(const Bodies<double, SoA>& bodies, const Contact<double>& c,
            const CorrectionSettings<double>& settings) {
    const bool wall = c.second == staticPartner;
    const auto inverseMass = [&](std::uint32_t i) {
      return i == staticPartner || bodies[i].isFixed() ? 0.0 : 1 / bodies[i].mass();
    };
    const double w1 = inverseMass(c.first);
    const double w2 = inverseMass(c.second);
    const double r1 = bodies[c.first].radius();
    const double smaller = wall ? r1 : std::min<double>(r1, bodies[c.second].radius());
    const double kept = std::max(-c.gap - settings.cap * smaller, (1 - settings.factor) * -c.gap);
    Vector3<double> n = c.normal;
    const Vector3<double> d =
        wall ? Vector3<double>(-shift[c.first]) : Vector3<double>(shift[c.second] - shift[c.first]);
    double distance = c.arm1 + c.arm2;
    double missing = -c.gap - kept - n.dot(d);
    if (!wall) {
      const Vector3<double> r = distance * n + d;
      missing = distance - c.gap - kept - r.stableNorm();
      distance = r.stableNorm();
      n = r / distance;
    }
    if (!(missing > 0)) {
      return;
    }
    largest = std::max(largest, missing);
    const double share1 = w1 / (w1 + w2);
    const double share2 = w2 / (w1 + w2);
    if (!wall && settings.keepAngularMomentum) {
      const Vector3<double> v_rel = velocity[c.second] - velocity[c.first];
      const Vector3<double> v_t = v_rel - n.dot(v_rel) * n;
      const double kinetic = v_t.squaredNorm() / (w1 + w2) / 2;
      const double left = distance / (distance + missing);
      velocity[c.first] += share1 * (1 - left) * v_t;
      velocity[c.second] -= share2 * (1 - left) * v_t;
      loss += kinetic * (1 - left * left);
    }
    shift[c.first] -= share1 * missing * n;
    if (!wall) {
      shift[c.second] += share2 * missing * n;
    }
  }
};

}  // namespace

// Seen to fail: the second's share of the move given to the first; a wall's distance taken for that of two
// centres; lengths by plain squares (at 1e-170 nothing moves, at 1e170 all is nan).
TEST_CASE("what is opened four at a time is opened as one by one, at any scale") {
  for (const double scale : {1.0, 1e-170, 1e170}) {
    Bodies<double, SoA> bodies = randomCloud<double>(300, 7.0, 5);
    const CounterRandom random(7);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].position() *= scale;
      bodies.radii()[i] *= scale;
      bodies.masses()[i] = random.uniform(i, 0.1, 10);
      bodies[i].setFixed(i % 11 == 0);
    }
    const std::vector<HalfSpace<double>> floor{{{0, 0, 1}, -2 * scale}};
    const auto contacts = contactsOf(bodies, Material<double>{}, floor);
    ContactColoring colouring;
    colouring.build(std::span<const Contact<double>>(contacts.contacts), bodies);
    REQUIRE(colouring.colours() > 4);
    CorrectionSettings<double> settings;
    settings.precision = 0;
    settings.maxIterations = 1;
    const OneByOne expected(bodies, contacts, colouring, settings);
    PositionalCorrection<double> correction;
    const Bodies<double, SoA> before = bodies;
    const auto report = correct(bodies, contacts, settings, correction);
    CHECK_THAT(report.residual, WithinRel(expected.largest, 1e-13));
    CHECK_THAT(report.loss, WithinRel(expected.loss, 1e-12));
    REQUIRE(correction.displacements().size() > 200);
    double wrongPlace = 0;
    double wrongVelocity = 0;
    std::vector<Vector3<double>> shift(bodies.size(), Vector3<double>::Zero());
    for (const Displacement<double>& moved : correction.displacements()) {
      shift[moved.body] = moved.shift;
    }
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      wrongPlace = std::max(wrongPlace, (shift[i] - expected.shift[i]).stableNorm() / scale);
      wrongVelocity =
          std::max(wrongVelocity, (Vector3<double>(bodies[i].velocity()) - expected.velocity[i]).norm());
    }
    CHECK(wrongPlace <= 1e-14);  // some dozen roundings of moves below 1
    CHECK(wrongVelocity <= 1e-14);
  }
}

TEMPLATE_TEST_CASE("one overlap is (1 - factor) of what it was; centre of mass and velocities stay", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  for (const double part : {0.2, 0.8, 1.0}) {
    const S factor = static_cast<S>(part);
    Bodies<S, SoA> bodies;
    Body<S> body;
    body.radius = S(1);
    body.velocity = Vector3<S>(1, -2, 3);
    bodies.add(body);
    body.position = Vector3<S>(S(1.1), S(1.1), S(1.1));
    body.mass = S(5);
    bodies.add(body);
    const auto contacts = contactsOf<S>(bodies, Material<S>{});
    REQUIRE(contacts.size() == 1);
    const S before = gapOf(bodies, 0, 1);
    CorrectionSettings<S> settings;
    settings.factor = factor;
    PositionalCorrection<S> correction;
    const auto report = correct(bodies, contacts, settings, correction);
    CHECK(std::abs(gapOf(bodies, 0, 1) - (S(1) - factor) * before) <= S(8) * eps<S>);
    CHECK((bodies[0].position() + S(5) * bodies[1].position() - S(5) * body.position).norm() <=
          S(16) * eps<S>);
    CHECK(Vector3<S>(bodies[0].velocity()) == Vector3<S>(1, -2, 3));
    CHECK(report.largestOverlap == -before);
    REQUIRE(correction.displacements().size() == 2);
    CHECK(correction.displacements()[0].body == 0);
    CHECK(Vector3<S>(bodies[0].position()) == correction.displacements()[0].shift);
  }
}

// Of two that pass each other, r x v stays. Seen to fail: v_t by r/(r + 2 d).
TEMPLATE_TEST_CASE("a pair that is moved apart turns the slower: r v_t stays, the loss is reported", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  for (const bool keep : {true, false}) {
    Bodies<S, SoA> bodies;
    Body<S> body;
    body.radius = S(1);
    bodies.add(body);
    body.position = Vector3<S>(S(1.6), 0, 0);
    body.velocity = Vector3<S>(S(-0.5), S(2), 0);
    body.mass = S(3);
    bodies.add(body);
    CorrectionSettings<S> settings;
    settings.factor = S(1);
    settings.keepAngularMomentum = keep;
    PositionalCorrection<S> correction;
    const auto report = correct(bodies, contactsOf<S>(bodies, Material<S>{}), settings, correction);
    const Vector3<S> v_rel = Vector3<S>(bodies[1].velocity()) - Vector3<S>(bodies[0].velocity());
    const S tangential = keep ? S(1.6) : S(2);
    CHECK(std::abs(v_rel[1] - tangential) <= S(8) * eps<S>);
    CHECK(std::abs(v_rel[0] + S(0.5)) <= S(8) * eps<S>);
    CHECK(std::abs(report.loss - S(0.375) * (S(4) - tangential * tangential)) <= S(16) * eps<S>);
  }
}

// Seen to fail: fixed spheres left out (slips of 2), and the loss by the first's mass alone (none where the
// first is the fixed one).
TEST_CASE("a fixed sphere is the limit of a heavy one: what is moved off it turns the slower, too") {
  const auto corrected = [](bool fixed, bool heavyFirst, CorrectionReport<double>& report) {
    Bodies<double, SoA> bodies;
    Body<double> body;
    for (const bool heavy : {heavyFirst, !heavyFirst}) {
      body.radius = 1;
      body.mass = heavy ? 1e18 : 3;
      body.position = heavy ? Vector3<double>(0, 0, 0) : Vector3<double>(1.6, 0, 0);
      body.velocity = heavy ? Vector3<double>(0, 0, 0) : Vector3<double>(-0.5, 2, 0);
      body.fixed = heavy && fixed;
      bodies.add(body);
    }
    PositionalCorrection<double> correction;
    CorrectionSettings<double> settings;
    settings.factor = 1;
    report = correct(bodies, contactsOf<double>(bodies, Material<double>{}), settings, correction);
    return Vector3<double>(bodies[heavyFirst ? 1 : 0].velocity());
  };
  for (const bool heavyFirst : {true, false}) {
    CorrectionReport<double> free, held;
    const Vector3<double> v = corrected(true, heavyFirst, held);
    CHECK((v - Vector3<double>(-0.5, 1.6, 0)).norm() <= 1e-15);
    CHECK((v - corrected(false, heavyFirst, free)).norm() <= 1e-15);
    CHECK_THAT(held.loss, WithinRel(1.5 * (4 - 1.6 * 1.6), 1e-15));
    CHECK_THAT(free.loss, WithinRel(held.loss, 1e-15));
  }
}

TEST_CASE("a crowd opens: largest overlap shrinks; centre of mass, momentum and angular momentum stay") {
  Bodies<double, SoA> bodies = randomCloud<double>(200, 6.0, 12);
  const auto contacts = contactsOf(bodies, Material<double>{});
  const Bodies<double, SoA> before = bodies;
  CorrectionSettings<double> settings;
  settings.factor = 0.5;
  settings.cap = 10.0;
  settings.tolerance = 1e-9;
  settings.precision = 0;
  settings.maxIterations = 10000;
  PositionalCorrection<double> correction;
  const auto report = correct(bodies, contacts, settings, correction);
  Vector3<double> moment = Vector3<double>::Zero();
  Vector3<double> momentum = Vector3<double>::Zero();
  Vector3<double> turn = Vector3<double>::Zero();
  double turnSize = 0.0;
  double motion = 0.0;
  double motionBefore = 0.0;
  double scale = 0.0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    moment += bodies[i].mass() * (bodies[i].position() - before[i].position());
    scale += bodies[i].mass() * bodies[i].position().norm();
    const double m = bodies[i].mass();
    const Vector3<double> v = bodies[i].velocity();
    const Vector3<double> v0 = before[i].velocity();
    const Vector3<double> x = bodies[i].position();
    momentum += m * (v - v0);
    turn += m * (x.cross(v) - Vector3<double>(before[i].position()).cross(v0));
    turnSize += m * x.norm() * v.norm();
    motion += m * v.squaredNorm() / 2;
    motionBefore += m * v0.squaredNorm() / 2;
  }
  // Rounding of some hundred moves of each body.
  CHECK(momentum.norm() <= 1e-13 * std::sqrt(motion));
  CHECK(turn.norm() <= 1e-13 * turnSize);
  CHECK(report.loss > 1e-3 * motionBefore);
  CHECK_THAT(motion + report.loss, WithinRel(motionBefore, 1e-12));
  CHECK(moment.norm() <= 1e-15 * scale * std::sqrt(200.0));
  for (const Contact<double>& c : contacts) {
    CHECK(gapOf(bodies, c.first, c.second) >= 0.5 * c.gap - 1e-7);
  }
}

TEST_CASE("slop stays, the cap holds deep overlaps back, fixed partners and walls do not move") {
  Bodies<double, SoA> bodies = column<double>(1, 1e-3, 0.0, 1.0);
  const auto contacts = contactsOf(bodies, Material<double>{}, floorAtZero<double>());
  PositionalCorrection<double> correction;
  CorrectionSettings<double> settings;
  settings.factor = 1.0;
  settings.slop = 4e-4;
  correct(bodies, contacts, settings, correction);
  CHECK_THAT(bodies[0].position()[2], WithinAbs(0.5 - 4e-4, 1e-15));

  Bodies<double, SoA> deep;
  Body<double> body;
  body.radius = 1.0;
  body.fixed = true;
  deep.add(body);
  body.fixed = false;
  body.radius = 0.1;
  body.position = {0.5, 0, 0};
  deep.add(body);
  settings.slop = 0.0;
  settings.cap = 0.5;
  correct(deep, contactsOf(deep, Material<double>{}), settings, correction);
  CHECK(Vector3<double>(deep[0].position()) == Vector3<double>(0, 0, 0));
  CHECK_THAT(deep[1].position()[0], WithinRel(0.5 + 0.5 * 0.1, 1e-14));
}

TEST_CASE("2 to 100 spheres at one point come apart, finitely, with their centre of mass at rest") {
  for (const int n : {2, 10, 100}) {
    Bodies<double, SoA> bodies;
    Body<double> body;
    body.radius = 1.0;
    body.position = {1, 2, 3};
    for (int i = 0; i < n; ++i) {
      bodies.add(body);
    }
    PositionalCorrection<double> correction;
    double deepest = 2.0;
    for (int step = 0; step < 300 && deepest > 1e-3; ++step) {
      const auto contacts = contactsOf(bodies, Material<double>{});
      deepest = correct(bodies, contacts, CorrectionSettings<double>{}, correction).largestOverlap;
    }
    CHECK(deepest <= 1e-3);
    Vector3<double> sum = Vector3<double>::Zero();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      REQUIRE(isFinite(bodies[i].position()));
      sum += bodies[i].position() - body.position;
    }
    CHECK(sum.norm() <= 1e-12 * n);
  }
}

// A ball of diameter 1 between planes 0.9 apart: every sweep pushes it to the other plane.
// Seen to fail: sweeps as long as anything moves (1000).
TEST_CASE("sweeps end where there is no room, however many are allowed") {
  Bodies<double, SoA> bodies;
  Body<double> body;
  body.radius = 0.5;
  body.position = {0, 0, 0.45};
  bodies.add(body);
  std::vector<HalfSpace<double>> planes = floorAtZero<double>();
  planes.push_back({{0, 0, -1}, -0.9});
  CorrectionSettings<double> settings;
  settings.maxIterations = 1000;
  PositionalCorrection<double> correction;
  CHECK(correct(bodies, contactsOf(bodies, Material<double>{}, planes), settings, correction).iterations <=
        60);
}

TEST_CASE("far from the origin an overlap opens as well as the numbers there can tell") {
  Bodies<double, SoA> bodies;
  Body<double> body;
  body.radius = 1.0;
  body.position = {1e9, 0, 0};
  bodies.add(body);
  body.position = {1e9 + 1.5, 0, 0};
  bodies.add(body);
  CorrectionSettings<double> settings;
  settings.factor = 1.0;
  settings.cap = 1.0;
  PositionalCorrection<double> correction;
  correct(bodies, contactsOf(bodies, Material<double>{}), settings, correction);
  CHECK_THAT(bodies[1].position()[0] - bodies[0].position()[0], WithinAbs(2.0, 4e-7));  // two units at 1e9
}

// A lattice whose overlaps are hardly any, and one pair pressed together in its middle. Seen to fail: with
// every overlap taken for deep all 729 move; with none but the deep ones ever opened the next pair of the
// line is left with what the opening pushed into it.
TEST_CASE("one deep overlap in a heap moves what it presses on, and leaves the rest where it is") {
  constexpr std::size_t side = 9;
  constexpr double shallow = 1e-6;
  constexpr double deep = 5e-4;
  Bodies<double, SoA> bodies;
  Body<double> body;
  body.radius = 0.5;
  const auto at = [&](std::size_t k) { return (static_cast<double>(k) - side / 2) * (1.0 - shallow); };
  for (std::size_t i = 0; i < side * side * side; ++i) {
    body.position = {at(i % side), at(i / side % side), at(i / side / side)};
    bodies.add(body);
  }
  const std::size_t middle = bodies.size() / 2;
  Vector3<double> place = bodies[middle].position();
  place[0] += deep - shallow;
  bodies[middle].position() = place;
  const Bodies<double, SoA> before = bodies;
  const auto contacts = contactsOf(bodies, Material<double>{});
  const CorrectionSettings<double> settings;
  PositionalCorrection<double> correction;
  const auto report = correct(bodies, contacts, settings, correction);
  CHECK_THAT(report.largestOverlap, WithinRel(deep, 1e-9));
  CHECK(report.residual <= settings.precision * body.radius);
  CHECK(correction.displacements().size() >= 2);
  std::size_t far = 0;
  for (const Displacement<double>& moved : correction.displacements()) {
    const Vector3<double> x = before[moved.body].position();
    // Those of the line, and their neighbours by what they overlap.
    const double off = std::hypot(x[1], x[2]);
    far += off > 0.5 && (off > 1.1 || moved.shift.norm() > shallow) ? 1 : 0;
  }
  CHECK(far == 0);
  // A contact is wrong by the last move, or by what its bodies moved unnoticed.
  const double wrong = 1.5 * settings.precision * body.radius;
  for (const Contact<double>& c : contacts) {
    const double kept = -c.gap > 2 * shallow ? (1 - settings.factor) * -c.gap : -c.gap;
    CHECK(-gapOf(bodies, c.first, c.second) <= kept + wrong);
  }
}

// A line of touching balls, and one overlap two places before the end of a block of the colouring (of 4096):
// its opening runs on into the next block. Seen to fail: contacts between blocks that do not tell of whom
// they move leave the next block with what they pressed into it; a block that does not tell of its own moves
// opens its overlap once.
TEST_CASE("what opens in one block of bodies runs on into the next, and back") {
  constexpr std::size_t n = 40000;  // more than bodies without blocks
  constexpr std::size_t block = 4096;
  constexpr double deep = 5e-4;
  Bodies<double, SoA> bodies;
  std::vector<Pair> pairs;
  Body<double> body;
  body.radius = 0.5;
  for (std::uint32_t i = 0; i < n; ++i) {
    // Overlaps in a binary place, so that all but the deep one are the same.
    body.position = {0.99999904632568359375 * i - (i >= block - 2 ? deep : 0.0), 0, 0};
    bodies.add(body);
    if (i > 0) {
      pairs.push_back({i - 1, i});
    }
  }
  ContactList<double> contacts;
  const std::vector<Material<double>> materials{{}};
  NarrowPhase<double>().find(pairs, bodies, Domain<double>::open(), materials, {}, {}, contacts);
  REQUIRE(contacts.size() == n - 1);
  ContactColoring coloring;
  coloring.build(std::span<const Contact<double>>(contacts.contacts), bodies);
  REQUIRE(coloring.blocks() - coloring.bundles() == n / block + 1);
  CorrectionSettings<double> settings;
  settings.maxIterations = 1000;
  PositionalCorrection<double> correction;
  const auto report = correct(bodies, contacts, settings, correction);
  CHECK(report.iterations > 10);
  CHECK(report.residual <= settings.precision * body.radius);
  std::size_t later = 0;
  for (const Displacement<double>& moved : correction.displacements()) {
    later += moved.body > block ? 1 : 0;
  }
  CHECK(later > 0);
  CHECK(correction.displacements().size() < 50);
  const double wrong = 1.5 * settings.precision * body.radius;  // the last move, and moves unnoticed
  for (const Contact<double>& c : contacts) {
    const double kept = c.gap < -deep ? (1 - settings.factor) * -c.gap : -c.gap;
    REQUIRE(-gapOf(bodies, c.first, c.second) <= kept + wrong);
  }
}

// A line in blocks, then islands of three beside it, whose slots are of blocks that the line did not have.
// Seen to fail with the standard library's assertions: islands opened before blocks are counted anew.
TEST_CASE("islands beside a crowd open alike, whatever was opened before") {
  constexpr std::uint32_t line = 36863;  // one body less than nine blocks
  Bodies<double, SoA> bodies;
  std::vector<Pair> pairs;
  Body<double> body;
  body.radius = 0.5;
  for (std::uint32_t i = 0; i < line; ++i) {
    body.position = {(1 - 5e-4) * i, 0, 0};
    bodies.add(body);
    if (i > 0) {
      pairs.push_back({i - 1, i});
    }
  }
  const auto contactsNow = [&] {
    ContactList<double> contacts;
    const std::vector<Material<double>> materials{{}};
    NarrowPhase<double>().find(pairs, bodies, Domain<double>::open(), materials, {}, {}, contacts);
    return contacts;
  };
  CorrectionSettings<double> settings;
  settings.maxIterations = 3;
  PositionalCorrection<double> used;
  correct(bodies, contactsNow(), settings, used);
  for (std::uint32_t i = line; i < line + 60000; i += 3) {  // islands of two contacts
    for (std::uint32_t k = 0; k < 3; ++k) {
      body.position = {0.99 * k, 3.0 * i, 0};
      bodies.add(body);
    }
    pairs.push_back({i, i + 1});
    pairs.push_back({i + 1, i + 2});
  }
  Bodies<double, SoA> twin = bodies;
  const auto contacts = contactsNow();
  PositionalCorrection<double> fresh;
  correct(bodies, contacts, settings, used);
  correct(twin, contacts, settings, fresh);
  std::size_t others = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    others += bodies[i].position() == twin[i].position() ? 0U : 1U;
  }
  CHECK(others == 0);
}

// Seen to fail: every part of the list written from its begin.
TEST_CASE("all who are moved are listed once, with what they moved by, for any number of threads") {
  std::vector<Displacement<double>> first;
  const int before = omp_get_max_threads();
  for (const int threads : {1, 2, 3}) {
    omp_set_num_threads(threads);
    Bodies<double, SoA> bodies = randomCloud<double>(4000, 14.0, 3);
    for (std::size_t i = 0; i < bodies.size(); i += 7) {
      bodies[i].setFixed(true);
    }
    std::vector<Vector3<double>> places;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      places.push_back(bodies[i].position());
    }
    PositionalCorrection<double> correction;
    correct(bodies, contactsOf<double>(bodies, Material<double>{}), CorrectionSettings<double>{}, correction);
    REQUIRE(correction.displacements().size() > 2000);
    for (const Displacement<double>& moved : correction.displacements()) {
      places[moved.body] += moved.shift;
    }
    std::size_t elsewhere = 0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      elsewhere += Vector3<double>(bodies[i].position()) == places[i] ? 0 : 1;
    }
    CHECK(elsewhere == 0);
    if (first.empty()) {
      first = correction.displacements();
    }
    bool same = first.size() == correction.displacements().size();
    for (std::size_t k = 0; same && k < first.size(); ++k) {
      same = first[k].body == correction.displacements()[k].body &&
             first[k].shift == correction.displacements()[k].shift;
    }
    CHECK(same);
  }
  omp_set_num_threads(before);
}

// A sweep alone opens 2 m/M of what the light one lacks.
// Seen to fail: without leaps (1000 sweeps, still closed); the hub's share of a move, or of a velocity, left
// out; velocities as they are; half a leap (more sweeps).
TEMPLATE_TEST_CASE("light bodies between heavy ones are opened in some sweeps, whatever the ratio of masses",
                   "", GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  const S overlap = S(0.007);  // of radii 0.1 and 1
  for (const double ratio : {1e3, 1e6, 1e9}) {
    for (const bool onFloor : {false, true}) {
      Bodies<S, SoA> bodies;
      Body<S> body;
      body.radius = S(0.1);
      body.position = {S(0), S(0), body.radius - overlap};
      body.velocity = {S(0.3), S(-0.1), S(0)};
      bodies.add(body);
      body.radius = S(1);
      body.mass = S(ratio);
      body.position[2] = S(0.2) - S(2) * overlap + body.radius;
      body.velocity = {S(1), S(0), S(0)};
      bodies.add(body);
      if (!onFloor) {
        body.mass *= S(2);
        body.position[2] = -body.radius;
        body.velocity = {S(0), S(2), S(0)};
        bodies.add(body);
      }
      const auto contacts =
          contactsOf<S>(bodies, Material<S>{}, onFloor ? floorAtZero<S>() : std::vector<HalfSpace<S>>{});
      REQUIRE(contacts.size() == 2);
      const Bodies<S, SoA> before = bodies;
      CorrectionSettings<S> settings;
      settings.islandLooks = usualLooks;
      PositionalCorrection<S> correction;
      const auto report = correct(bodies, contacts, settings, correction);
      CHECK(report.iterations <= 20);
      const S kept = (S(1) - settings.factor + S(2) * settings.tolerance) * overlap;
      CHECK(gapOf(bodies, 0, 1) >= -kept);
      CHECK((onFloor ? S(bodies[0].position()[2] - bodies[0].radius()) : gapOf(bodies, 0, 2)) >= -kept);
      const S room = bodies[1].position()[2] - (onFloor ? S(0) : S(bodies[2].position()[2] + S(1))) - S(1.2);
      CHECK(room <= S(-1.9) * kept);  // nor by more than is asked for
      const Totals now(bodies);
      const Totals then(before);
      CHECK(std::abs(now.energy + report.loss - then.energy) <= 64 * eps<S> * then.energy);
      CHECK((now.momentum - then.momentum).norm() <= 64 * eps<S> * then.momentumScale);
      if (!onFloor) {
        CHECK((now.angular - then.angular).norm() <= 64 * eps<S> * then.angularScale);
        CHECK(report.loss > 0);
        Vector3<Wide> moment = Vector3<Wide>::Zero();
        for (std::size_t i = 0; i < bodies.size(); ++i) {
          const Vector3<S> shift = bodies[i].position() - before[i].position();
          moment += Wide(bodies[i].mass()) * shift.template cast<Wide>();
        }
        CHECK(moment.norm() <= 64 * eps<S> * Wide(3 * ratio));
      }
    }
  }
}

// Of one mass, in a line: nobody is light between others. Seen to fail: leaps of islands of any size, in
// which the first sphere took the recoil of all that moved away from it, and was thrown far from the second.
TEST_CASE("A row of equal spheres is opened without gaps, however many they are") {
  for (const int count : {3, 8, 12, 25, 60, 150}) {
    for (const double bend : {0.0, 0.02}) {
      Bodies<double, SoA> bodies;
      const double overlap = 0.01;
      Body<double> body;
      body.radius = 0.5;
      body.velocity = {0, 0.1, 0};
      for (int i = 0; i < count; ++i) {
        bodies.add(body);
        body.position += (1 - overlap) * Vector3<double>(std::cos(bend * i), std::sin(bend * i), 0);
      }
      CorrectionSettings<double> settings;
      settings.islandLooks = usualLooks;
      PositionalCorrection<double> correction;
      CAPTURE(count, bend);
      for (int k = 0; k < 20; ++k) {
        const auto contacts = contactsOf(bodies, Material<double>{});
        CHECK((k > 0 || contacts.size() == static_cast<std::size_t>(count - 1)));
        correct(bodies, contacts, settings, correction);
        for (std::size_t i = 1; i < bodies.size(); ++i) {
          CHECK(gapOf(bodies, i - 1, i) < settings.factor * overlap);
        }
      }
    }
  }
}

// Seen to fail: leaps of an island by what all islands of its bundle lack.
TEST_CASE("islands leap alike, whatever lies beside them, for any number of threads") {
  constexpr std::uint32_t islands = 600;
  const auto build = [](std::uint32_t first, std::uint32_t end) {
    Bodies<double, SoA> bodies;
    for (std::uint32_t i = first; i < end; ++i) {
      Body<double> body;
      const double deep = 0.001 + 1e-5 * (i % 7);
      body.radius = 0.1;
      body.position = {4.0 * i, 0, 0};
      body.velocity = {0, 0.1 * (i % 5), 0};
      bodies.add(body);
      body.radius = 1;
      body.velocity = {1, 0, 0};
      for (const double side : {-1.0, 1.0}) {
        body.mass = std::pow(10.0, i % 10);
        body.position[2] = side * (1.1 - deep);
        body.velocity *= -1;
        bodies.add(body);
      }
    }
    return bodies;
  };
  const auto corrected = [](Bodies<double, SoA>& bodies) {
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < bodies.size(); i += 3) {
      pairs.push_back({i, i + 1});
      pairs.push_back({i, i + 2});
    }
    ContactList<double> contacts;
    const std::vector<Material<double>> materials{{}};
    NarrowPhase<double>().find(pairs, bodies, Domain<double>::open(), materials, {}, {}, contacts);
    REQUIRE(contacts.size() == pairs.size());
    CorrectionSettings<double> settings;
    settings.islandLooks = usualLooks;
    PositionalCorrection<double> correction;
    correct(bodies, contacts, settings, correction);
  };
  const int before = omp_get_max_threads();
  for (const int threads : {1, 2, 3}) {
    omp_set_num_threads(threads);
    Bodies<double, SoA> together = build(0, islands);
    corrected(together);
    std::size_t others = 0;
    for (std::uint32_t i = 0; i < islands; i += 30 + static_cast<std::uint32_t>(threads)) {
      Bodies<double, SoA> alone = build(i, i + 1);
      corrected(alone);
      for (std::size_t k = 0; k < 3; ++k) {
        others += alone[k].position() == together[3 * i + k].position() &&
                          alone[k].velocity() == together[3 * i + k].velocity()
                      ? 0U
                      : 1U;
      }
    }
    CHECK(others == 0);
  }
  omp_set_num_threads(before);
}

TEST_CASE("settings of the correction out of range are refused, and nothing is moved") {
  Bodies<double, SoA> bodies = randomCloud<double>(40, 2.0, 5);
  const auto contacts = contactsOf(bodies, Material<double>{});
  REQUIRE_FALSE(contacts.empty());
  const Vector3<double> x = bodies[0].position();
  PositionalCorrection<double> correction;
  const auto refuses = [&](auto&& change, const char* text) {
    CorrectionSettings<double> settings;
    change(settings);
    CHECK_THROWS_WITH(correct(bodies, contacts, settings, correction), ContainsSubstring(text));
  };
  refuses([](auto& s) { s.factor = 1.5; }, "correction factor is 1.5; allowed: 0 to 1");
  refuses([](auto& s) { s.slop = -1; }, "correction slop is -1");
  refuses([](auto& s) { s.cap = 0; }, "correction cap is 0");
  refuses([](auto& s) { s.tolerance = std::nan(""); }, "correction tolerance is nan");
  refuses([](auto& s) { s.precision = -1; }, "correction precision is -1");
  refuses([](auto& s) { s.maxIterations = 0; }, "correction maxIterations is 0");
  CHECK(Vector3<double>(bodies[0].position()) == x);
}
