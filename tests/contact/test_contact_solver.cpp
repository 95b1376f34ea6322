// Many contacts together.

#include "scenes.hpp"
#include "support/archetypes.hpp"
#include "support/catch.hpp"
#include "support/threads.hpp"

#include <omp.h>

#include <cstring>

using namespace gravel;
using namespace gravel::test;

namespace {

/// Contacts that a random material was drawn for, each its own.
template <class S, class B>
ContactList<S> mixedContacts(const B& bodies, const CounterRandom& random) {
  ContactList<S> contacts = contactsOf<S>(bodies, Material<S>{});
  std::uint64_t counter = 0;
  for (Contact<S>& c : contacts) {
    contacts.setSurface(c, {randomMaterial<S>(random, counter)});
  }
  return contacts;
}

template <class S>
S normalVelocity(const Contact<S>& c, const Bodies<S, SoA>& bodies) {
  const Vector3<S> v1 = bodies[c.first].velocity();
  const Vector3<S> v2 =
      c.second == staticPartner ? Vector3<S>(Vector3<S>::Zero()) : Vector3<S>(bodies[c.second].velocity());
  return c.normal.dot(v2 - v1);
}

template <class S>
Vector3<S> slipOf(const Contact<S>& c, const Bodies<S, SoA>& bodies) {
  const Vector3<S> v1 = bodies[c.first].velocity();
  const Vector3<S> w1 = bodies[c.first].angularVelocity();
  const Vector3<S> v2 = bodies[c.second].velocity();
  const Vector3<S> w2 = bodies[c.second].angularVelocity();
  const Vector3<S> u = v2 - v1 - (c.arm1 * w1 + c.arm2 * w2).cross(c.normal);
  return u - c.normal.dot(u) * c.normal;
}

/// 12 x 12 x 4 unit balls, a little overlapped, on z = 0.
Bodies<double, SoA> fourLayers() {
  Bodies<double, SoA> bodies;
  for (int i = 0; i < 12 * 12 * 4; ++i) {
    Body<double> body;
    body.radius = 0.5;
    body.position = {0.9999 * (i % 12), 0.9999 * (i / 12 % 12), 0.4999 + 0.9999 * (i / 144)};
    bodies.add(body);
  }
  return bodies;
}

}  // namespace

TEMPLATE_TEST_CASE("a column of ten: from nothing, at default settings, each contact carries what lies on it",
                   "", GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  const S g = static_cast<S>(9.81);
  const S dt = static_cast<S>(1e-3);
  Bodies<S, SoA> bodies = column<S>(10, 1e-4, g, dt);
  const auto contacts = contactsOf(bodies, Material<S>{}, floorAtZero<S>());
  REQUIRE(contacts.size() == 10);
  ContactSolver<S> solver;
  const ContactReport<S> report = solver.solve(contacts, bodies, dt);
  CHECK(report.colours == 2);
  for (std::size_t k = 0; k < 10; ++k) {
    // key1 is the lower body: under it lie as many as its id says, the floor's contact has them all.
    const bool onFloor = contacts[k].second == staticPartner;
    const double carried = onFloor ? 10.0 : 9.0 - static_cast<double>(contacts[k].key1);
    CHECK_THAT(static_cast<double>(solver.impulses()[k].normal / (g * dt)), WithinRel(carried, 1e-3));
    CHECK(solver.impulses()[k].tangential.norm() <= S(4) * eps<S> * solver.impulses()[k].normal);
  }
  // Without momentum 100 sweeps leave an error of 11 percent.
  Bodies<S, SoA> plain = column<S>(10, 1e-4, g, dt);
  ContactSolver<S> slow;
  ContactSettings<S> settings;
  settings.accelerate = false;
  slow.setSettings(settings);
  CHECK(slow.solve(contacts, plain, dt).residual > S(100) * report.residual);
}

TEST_CASE("a column of ten under gravity comes to rest: no drift, no creep, right weight from step to step") {
  const double g = 9.81;
  const double dt = 1e-3;
  Bodies<double, SoA> bodies = column<double>(10, 1e-4, g, dt);
  ContactSolver<double> solver;
  CorrectionSettings<double> correction;
  correction.factor = 0.2;
  double energy = 0.0;
  double mean = 0.0;
  for (int step = 0; step < 3000; ++step) {
    const auto contacts = contactsOf(bodies, Material<double>{}, floorAtZero<double>(), 1e-3);
    REQUIRE(contacts.size() == 10);
    solver.solve(contacts, bodies, dt);
    energy = static_cast<double>(Totals(bodies).energy);
    mean += step >= 2000 ? solver.impulses()[0].normal / 1000.0 : 0.0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].position() += dt * bodies[i].velocity();
      bodies[i].velocity()[2] -= g * dt;
    }
    solver.correctPositions(bodies, correction);
  }
  CHECK(energy < 1e-12 * 10 * g * 0.5);
  CHECK_THAT(mean, WithinRel(9.0 * g * dt, 1e-3));
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    CHECK(std::hypot(bodies[i].position()[0], bodies[i].position()[1]) < 1e-9 * 0.5);
    // As high as a column without overlap, within 1e-3 of a radius.
    CHECK_THAT(bodies[i].position()[2], WithinAbs(0.5 + static_cast<double>(i), 0.5e-3));
  }
}

TEMPLATE_TEST_CASE("a dense crowd: momentum, angular momentum, energy, ledger and cone", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Bodies<S, SoA> bodies = randomCloud<S>(200, 5.5, seed);
    const CounterRandom random(seed, 5);
    const auto contacts = mixedContacts<S>(bodies, random);
    REQUIRE(contacts.size() > 300);
    const Totals before(bodies);
    ContactSolver<S> solver;
    const ContactReport<S> report = solver.solve(contacts, bodies, S(0.01));
    const Totals after(bodies);
    // Each of some 100 sweeps rounds once; errors of either sign.
    const Wide rounding = 64 * Wide(eps<S>);
    CHECK((after.momentum - before.momentum).norm() <= rounding * before.momentumScale);
    CHECK((after.angular - before.angular).norm() <= rounding * before.angularScale);
    CHECK(after.energy <= before.energy * (1 + rounding));
    const Wide lost = Wide(report.restitutionLoss) + Wide(report.frictionLoss);
    CHECK(lost > 0.01 * before.energy);
    CHECK(std::abs(before.energy - after.energy - lost) <= rounding * before.energy);
    CHECK(report.driftWork == S(0));
    S largest(0);
    for (const ContactImpulse<S>& j : solver.impulses()) {
      largest = std::max(largest, j.normal);
    }
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const ContactImpulse<S>& j = solver.impulses()[k];
      CHECK(j.normal >= S(0));
      CHECK(j.tangential.norm() <=
            contacts.material(contacts[k]).staticFriction * j.normal * (S(1) + S(16) * eps<S>));
      CHECK(std::abs(j.tangential.dot(contacts[k].normal)) <=
            S(4 * report.iterations) * eps<S> * largest);  // a rounding or two a sweep
    }
  }
}

TEST_CASE("a frictional crowd solved to the end obeys Coulomb: sliding contacts are at the kinetic limit") {
  Bodies<double, SoA> bodies = randomCloud<double>(150, 5.0, 3);
  const Material<double> material{0.0, 0.5, 0.3, 0.0};
  const auto contacts = contactsOf(bodies, material);
  ContactSolver<double> solver;
  ContactSettings<double> settings;
  settings.tolerance = 1e-12;
  settings.maxIterations = 20000;
  solver.setSettings(settings);
  const ContactReport<double> report = solver.solve(contacts, bodies, 0.01);
  REQUIRE(report.residual <= 1e-12);
  int sliding = 0;
  int sticking = 0;
  int open = 0;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const ContactImpulse<double>& j = solver.impulses()[k];
    const double v_n = normalVelocity(contacts[k], bodies);
    const Vector3<double> slip = slipOf(contacts[k], bodies);
    // Velocities are right to the tolerance times the sweeps that a disturbance lives for.
    CHECK(v_n > -1e-9);
    if (j.normal == 0.0) {
      ++open;
      continue;
    }
    CHECK(v_n < 1e-9);
    if (slip.norm() > 1e-8) {
      ++sliding;
      CHECK_THAT(j.tangential.norm(), WithinRel(0.3 * j.normal, 1e-9));
      CHECK(j.tangential.normalized().dot(slip.normalized()) < -1.0 + 1e-6);
    } else {
      ++sticking;
      CHECK(j.tangential.norm() <= 0.5 * j.normal * (1 + 1e-12));
    }
  }
  CHECK(sliding > 20);
  CHECK(sticking > 20);
  CHECK(open > 20);
}

TEST_CASE("same bits for 1, 2, 3 and 8 threads, and whatever the indices of the bodies") {
  const std::size_t n = GENERATE(std::size_t{6000}, std::size_t{34000});  // these in blocks
  const Bodies<double, SoA> start = randomCloud<double>(n, n == 6000 ? 15.0 : 26.7, 9);
  std::vector<Pair> pairs;
  // A sweep along x, since all pairs are many.
  std::vector<std::pair<Vector3<double>, std::uint32_t>> order;
  for (std::uint32_t i = 0; i < n; ++i) {
    order.emplace_back(start[i].position(), i);
  }
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first[0] < b.first[0]; });
  for (std::size_t i = 0; i < n; ++i) {
    const auto& [x_i, body] = order[i];
    for (std::size_t j = i + 1; j < n && order[j].first[0] < x_i[0] + 1.2; ++j) {
      if ((order[j].first - x_i).cwiseAbs().maxCoeff() < 1.2) {
        pairs.push_back({std::min(body, order[j].second), std::max(body, order[j].second)});
      }
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return a.first != b.first ? a.first < b.first : a.second < b.second;
  });
  const std::vector<Material<double>> materials{{0.5, 0.5, 0.4, 0.2}};
  const auto run = [&](Bodies<double, SoA>& bodies, const std::vector<Pair>& candidates) {
    ContactList<double> contacts;
    NarrowPhase<double>().find(candidates, bodies, Domain<double>::open(), materials, floorAtZero<double>(),
                               {}, contacts);

    ContactSolver<double> solver;
    ContactSettings<double> settings;
    settings.maxIterations = 4;
    solver.setSettings(settings);
    solver.solve(contacts, bodies, 0.01);
    REQUIRE(solver.coloring().end(0) - solver.coloring().begin(0) > 2048);  // large enough to be shared
    REQUIRE((solver.coloring().blocks() >= detail::fewTasks) == (bodies.size() == 34000));
    solver.solve(contacts, bodies, 0.01);
    solver.correctPositions(bodies, {});
  };
  Bodies<double, SoA> one = start;
  {
    const WithThreads threads(1);
    run(one, pairs);
  }
  const auto same = [&](const Bodies<double, SoA>& other) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t k = other.indexOf(one[i].id());
      if (Vector3<double>(one[i].velocity()) != Vector3<double>(other[k].velocity()) ||
          Vector3<double>(one[i].angularVelocity()) != Vector3<double>(other[k].angularVelocity()) ||
          Vector3<double>(one[i].position()) != Vector3<double>(other[k].position())) {
        return false;
      }
    }
    return true;
  };
  for (const int count : {2, 3, 8}) {
    const WithThreads threads(count);
    Bodies<double, SoA> many = start;
    run(many, pairs);
    CHECK(same(many));
  }
  // Indices shuffled, ids kept.
  Bodies<double, SoA> shuffled = start;
  std::vector<std::size_t> permutation(n);
  for (std::size_t i = 0; i < n; ++i) {
    permutation[i] = (i * 7919 + 13) % n;  // 7919 is prime to n
  }
  shuffled.reorder(permutation);
  std::vector<std::uint32_t> place(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    place[permutation[i]] = i;
  }
  std::vector<Pair> moved = pairs;
  for (Pair& pair : moved) {
    pair = {place[pair.first], place[pair.second]};
  }
  run(shuffled, moved);
  CHECK(same(shuffled));
}

TEST_CASE("a contact apart from the rest is exact after its one blow, in the middle of a crowd's problem") {
  Bodies<double, SoA> crowd = column<double>(10, 1e-4, 9.81, 1e-3);
  Body<double> ball;
  ball.radius = 0.5;
  ball.position = {10, 0, 5};
  ball.velocity = {1, 2, 3};
  crowd.add(ball);
  ball.position = {10.9, 0, 5};
  ball.velocity = {-2, 0, 1};
  ball.mass = 3;
  crowd.add(ball);
  Bodies<double, SoA> alone;
  alone.add(crowd[10].load());
  alone.add(crowd[11].load());
  const Material<double> material{0.7, 0.3, 0.2, 0.1};
  ContactSolver<double>().solve(contactsOf(crowd, material, floorAtZero<double>()), crowd, 1e-3);
  ContactSolver<double>().solve(contactsOf(alone, material), alone, 1e-3);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(Vector3<double>(crowd[10 + i].velocity()) == Vector3<double>(alone[i].velocity()));
    CHECK(Vector3<double>(crowd[10 + i].angularVelocity()) == Vector3<double>(alone[i].angularVelocity()));
  }
}

// Seen to fail: the ball left with 9 m/s, and turned.
TEST_CASE("contacts take velocity and spin that are written to a fixed body as zero") {
  Bodies<double, SoA> bodies;
  Body<double> ball;
  ball.radius = 0.5;
  ball.fixed = true;
  bodies.add(ball);
  ball.fixed = false;
  ball.position = {0.99, 0, 0};
  ball.velocity = {-1, 0, 0};
  bodies.add(ball);
  bodies[0].velocity() = Vector3<double>(4, 2, 0);
  bodies[0].angularVelocity() = Vector3<double>(0, 0, 5);
  const auto contacts = contactsOf(bodies, Material<double>{1.0, 0.5, 0.5, 0.0});
  const ContactReport<double> report = ContactSolver<double>().solve(contacts, bodies, 1e-3);
  CHECK(Vector3<double>(bodies[1].velocity()) == Vector3<double>(1, 0, 0));
  CHECK(Vector3<double>(bodies[1].angularVelocity()) == Vector3<double>::Zero());
  CHECK(report.restitutionLoss == 0.0);
}

TEST_CASE("without friction no spin is touched, to the bit") {
  Bodies<double, SoA> bodies = randomCloud<double>(100, 4.0, 1);
  const Bodies<double, SoA> before = bodies;
  const auto contacts = contactsOf(bodies, Material<double>{0.5, 0.0, 0.0, 0.0});
  const ContactReport<double> report = ContactSolver<double>().solve(contacts, bodies, 0.01);
  CHECK(report.iterations > 1);
  CHECK(report.frictionLoss == 0.0);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    CHECK(Vector3<double>(bodies[i].angularVelocity()) == Vector3<double>(before[i].angularVelocity()));
  }
}

TEST_CASE("a warm start needs fewer sweeps for the same answer, and a restart with it the same bits") {
  const double dt = 1e-3;
  const auto kick = [&](Bodies<double, SoA>& bodies) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].velocity()[2] -= 9.81 * dt;
    }
  };
  Bodies<double, SoA> bodies = column<double>(10, 1e-4, 9.81, dt);
  const auto contacts = contactsOf(bodies, Material<double>{}, floorAtZero<double>());
  ContactSolver<double> solver;
  const int cold = solver.solve(contacts, bodies, dt).iterations;
  kick(bodies);
  Bodies<double, SoA> again = bodies;
  Bodies<double, SoA> fresh = bodies;
  ContactSolver<double> restarted;
  restarted.setMemory(solver.memory(), solver.memoryStep());
  const int warm = solver.solve(contacts, bodies, dt).iterations;
  CHECK(warm * 2 < cold);
  restarted.solve(contacts, again, dt);
  CHECK(restarted.memory() == solver.memory());
  solver.forget();
  solver.solve(contacts, fresh, dt);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    CHECK(Vector3<double>(bodies[i].velocity()) == Vector3<double>(again[i].velocity()));
    CHECK((bodies[i].velocity() - fresh[i].velocity()).norm() < 1e-4 * 9.81 * dt);
  }
}

TEST_CASE(
    "the same contacts once more begin with what the last solve did, as from its impulses to rounding") {
  const double dt = 1e-3;
  const Bodies<double, SoA> start = randomCloud<double>(150, 5.0, 11);
  for (const double friction : {0.0, 0.4}) {
    const Material<double> material{0.0, friction, friction, 0.0};
    const auto contacts = contactsOf(start, material);
    ContactSettings<double> settings;
    settings.tolerance = 1e-13;
    settings.maxIterations = 4000;
    settings.accelerate = false;
    ContactSolver<double> goesOn;
    ContactSolver<double> beginsAgain;
    Bodies<double, SoA> bodies = start;
    goesOn.setSettings(settings);
    goesOn.begin(contacts, bodies);
    goesOn.solve(bodies, dt);
    beginsAgain.setSettings(settings);
    beginsAgain.setMemory(goesOn.memory(), dt);
    // Forces as before, and longer: they bring the bodies to where the impulses, half as large again, push
    // from.
    const double longer = 1.5;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].velocity() += longer * Vector3<double>(start[i].velocity() - bodies[i].velocity());
      bodies[i].angularVelocity() +=
          longer * Vector3<double>(start[i].angularVelocity() - bodies[i].angularVelocity());
    }
    Bodies<double, SoA> others = bodies;
    const Totals before(bodies);
    const ContactReport<double> kept = goesOn.solve(bodies, longer * dt);
    const ContactReport<double> found = beginsAgain.solve(contacts, others, longer * dt);
    CHECK(kept.iterations <= found.iterations);
    CHECK(Totals(bodies).energy <= before.energy);
    CHECK((Totals(bodies).momentum - before.momentum).norm() <= 1e-15 * before.momentumScale);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      CHECK((bodies[i].velocity() - others[i].velocity()).norm() < 1e-11);
      CHECK((bodies[i].angularVelocity() - others[i].angularVelocity()).norm() < 1e-11);
    }
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      CHECK(std::abs(goesOn.impulses()[k].normal - beginsAgain.impulses()[k].normal) < 1e-11);
      CHECK((goesOn.impulses()[k].tangential - beginsAgain.impulses()[k].tangential).norm() < 1e-11);
    }
  }
}

TEST_CASE("the same contacts once more: right at one look, let go by other forces, of another mass") {
  const double dt = 1e-3;
  const double g = 9.81;
  const Bodies<double, SoA> start = column<double>(10, 1e-4, g, dt);
  const auto contacts = contactsOf(start, Material<double>{}, floorAtZero<double>());
  Bodies<double, SoA> bodies = start;
  ContactSolver<double> solver;
  ContactSettings<double> settings;
  settings.tolerance = 1e-10;
  settings.maxIterations = 2000;
  solver.setSettings(settings);
  solver.begin(contacts, bodies);
  solver.solve(bodies, dt);
  solver.setSettings({});
  const auto kick = [&](double a) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].velocity()[2] += a * dt;
    }
  };
  SECTION("the same forces: at rest after one look") {
    kick(-g);
    const ContactReport<double> report = solver.solve(bodies, dt);
    CHECK(report.iterations == 1);
    CHECK(report.residual <= 1e-6);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      CHECK(bodies[i].velocity().norm() < 1e-4 * g * dt);
    }
  }
  SECTION("forces upwards: all fly free") {
    kick(g);
    CHECK(solver.solve(bodies, dt).iterations > 1);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      CHECK_THAT(bodies[i].velocity()[2], WithinRel(g * dt, 1e-3));
      CHECK(solver.impulses()[i].normal < 1e-3 * g * dt);
    }
  }
  SECTION("a body of four times the mass: the impulses are what momentum says") {
    const std::size_t top = bodies.size() - 1;
    bodies[top].mass() = 4;
    kick(-g);
    double before = 0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      before += bodies[i].mass() * bodies[i].velocity()[2];
    }
    solver.solve(bodies, dt);
    double after = 0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      after += bodies[i].mass() * bodies[i].velocity()[2];
    }
    double floorPush = 0;
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      floorPush -=
          contacts[k].second == staticPartner ? solver.impulses()[k].normal * contacts[k].normal[2] : 0;
    }
    CHECK_THAT(after - before, WithinRel(floorPush, 1e-12));
  }
}

// Seen to fail: where bodies begin left out of their ways (the pushed body keeps its push); rows that bounced
// passed over (the ball falls on); the threshold, or a tolerance that became stricter, not asked for (looks);
// contacts that were passed over and then moved, taken up from the solve before the last one; the
// impulse of what resists turning taken for none.
TEST_CASE("the same contacts once more: those between bodies that begin as they did are passed over") {
  const double dt = 1e-3;
  const double g = 9.81;
  for (const auto& [friction, resistance] : {std::array{0.0, 0.0}, {0.5, 0.0}, {0.5, 0.02}}) {
    Material<double> material{0.5, friction, friction, 0.0};
    material.rollingFriction = material.spinningFriction = resistance;
    Bodies<double, SoA> bodies = fourLayers();
    Body<double> ball;  // alone, and so fast that it bounces
    ball.radius = 0.5;
    ball.position = {30, 0, 0.4999};
    ball.velocity = {0, 0, -100 * g * dt};
    bodies.add(ball);
    ball.position = {30.9999, 0, 0.4999};  // rests beside it, so that neither is alone
    ball.velocity = {0, 0, 0};
    bodies.add(ball);
    const auto fall = [&, resistance = resistance](Bodies<double, SoA>& all) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        all[i].acceleration() = Vector3<double>(0, 0, -g);
        all[i].velocity()[2] -= g * dt;
      }
      all[2 * 144 + 30].angularVelocity()[2] += resistance * g * dt;  // half of what is resisted there
    };
    const auto contacts = contactsOf(bodies, material, floorAtZero<double>());
    ContactSettings<double> settings;
    settings.tolerance = 1e-4;
    settings.maxIterations = 10000;
    settings.accelerate = false;
    ContactSolver<double> solver;
    solver.setSettings(settings);
    fall(bodies);
    const int rounds = 40;
    for (int k = 0; k < rounds; ++k) {  // each from the impulses of the one before
      Bodies<double, SoA> start = bodies;
      solver.begin(contacts, start);
      solver.solve(start, dt);
      if (k == rounds - 1) {
        bodies = start;
      }
    }
    const double enough = settings.tolerance * 150 * g * dt;  // the ball's approach, and half of it again
    bodies[576].velocity()[2] = -100 * g * dt + g * dt;
    fall(bodies);
    const std::size_t pushed = 3 * 144;  // a corner on top
    std::size_t expected = 1;            // the ball's
    std::size_t most = std::numeric_limits<std::size_t>::max();
    SECTION("nothing else") { most = contacts.size() / 10; }
    SECTION("one body is pushed") {
      bodies[pushed].velocity() += Vector3<double>(0.1, 0.1, -0.1) * (100 * g * dt);
      expected = 2;
    }
    SECTION("one body spins") {  // without resistance friction alone feels it
      bodies[pushed].angularVelocity() += Vector3<double>(0, 0, 2) * (100 * g * dt);
      expected = resistance > 0 ? 2 : 1;
    }
    SECTION("another threshold of restitution: all are looked at") {
      settings.restitutionThreshold = 1e-9;
      expected = contacts.size();
    }
    SECTION("a stricter tolerance: all are looked at") {
      settings.tolerance /= 2;
      expected = contacts.size();
    }
    // What a look at every contact gives.
    Bodies<double, SoA> exact = bodies;
    ContactSolver<double> oracle;
    ContactSettings<double> strict = settings;
    strict.tolerance = 1e-12;
    oracle.setSettings(strict);
    oracle.setMemory(solver.memory(), dt);
    oracle.solve(contacts, exact, dt);

    solver.setSettings(settings);
    const Totals before(bodies);
    std::vector<Vector3<double>> missing;  // of each body's change
    std::vector<Vector3<double>> turned;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      missing.emplace_back(-Vector3<double>(bodies[i].velocity()));
      turned.emplace_back(-Vector3<double>(bodies[i].angularVelocity()));
    }
    const ContactReport<double> report = solver.solve(bodies, dt);
    double largest = 0.0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      missing[i] += bodies[i].velocity();
      turned[i] += bodies[i].angularVelocity();
      largest = std::max({largest, missing[i].norm(), turned[i].norm()});
    }
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const ContactImpulse<double>& j = solver.impulses()[k];
      const Contact<double>& c = contacts[k];
      const Vector3<double> push = j.normal * c.normal + j.tangential;
      const bool floor = c.second == staticPartner;
      const Vector3<double> twist = c.normal.cross(j.tangential);
      const Vector3<double> resisted = (floor ? 0.5 : 0.25) * j.turning;  // by the effective radius
      const double moment = 0.4 * 0.25 * bodies[c.first].mass();
      missing[c.first] += push * bodies[c.first].inverseMass();
      turned[c.first] += (c.arm1 * twist + resisted) / moment;
      if (!floor) {
        missing[c.second] -= push * bodies[c.second].inverseMass();
        turned[c.second] += (c.arm2 * twist - resisted) / moment;
      }
    }
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      CHECK(missing[i].norm() <= 1e-10 * largest);  // sweeps and solves round some hundred times
      CHECK(turned[i].norm() <= 1e-10 * largest);
    }
    CHECK(report.looks >= expected);
    CHECK(report.looks <= most);
    double furthest = 0.0;
    double spun = 0.0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      furthest = std::max(furthest, (bodies[i].velocity() - exact[i].velocity()).norm());
      spun = std::max(spun, 0.5 * (bodies[i].angularVelocity() - exact[i].angularVelocity()).norm());
    }
    // A contact may be wrong by what ended the sweeps and half of it; errors of a body's few add up.
    CHECK(furthest < 6 * enough);
    CHECK((resistance == 0.0 || spun < 6 * enough));
    CHECK(Totals(bodies).energy <= before.energy);
  }
}

// Seen to fail: lists that do not change places; the impulse of the ball left as it was, in either list;
// resistance to turning left out of what a sweep would change (the spin goes on).
TEST_CASE(
    "a solve that leaves all impulses as they are has those of a contact by itself anew, and lists both") {
  const double dt = 1e-3;
  const double g = 9.81;
  Bodies<double, SoA> bodies = fourLayers();
  Body<double> ball;  // alone on the floor
  ball.radius = 0.5;
  ball.position = {30, 0, 0.4999};
  bodies.add(ball);
  const std::size_t alone = bodies.size() - 1;
  Material<double> material{0.0, 0.5, 0.5, 0.0};
  material.rollingFriction = material.spinningFriction = GENERATE(0.0, 0.02);
  const std::size_t inside = 2 * 144 + 30;
  const auto fall = [&] {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].acceleration() = Vector3<double>(0, 0, -g);
      bodies[i].velocity()[2] -= g * dt;
    }
    bodies[inside].angularVelocity()[2] += material.spinningFriction * g * dt;  // resisted
  };
  const auto contacts = contactsOf(bodies, material, floorAtZero<double>());
  ContactSettings<double> settings;
  settings.tolerance = 1e-3;
  settings.maxIterations = 10000;
  settings.accelerate = false;
  ContactSolver<double> solver;
  solver.setSettings(settings);
  for (int k = 0; k < 40; ++k) {
    fall();
    solver.begin(contacts, bodies);
    solver.solve(bodies, dt);
  }
  const std::vector<ContactImpulse<double>> before = solver.copyImpulses();
  fall();
  bodies[alone].velocity()[2] -= 0.25 * g * dt;
  const ContactReport<double> report = solver.solve(bodies, dt);
  REQUIRE(report.iterations == 1);
  REQUIRE(report.looks < contacts.size() / 2);
  const std::vector<ContactImpulse<double>> after = solver.copyImpulses();
  CHECK(solver.earlierImpulses() == before);
  std::size_t others = 0;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (contacts[k].first == alone || contacts[k].second == alone) {
      ++others;
      CHECK_THAT(before[k].normal, WithinRel(g * dt, 1e-12));
      CHECK_THAT(after[k].normal, WithinRel(1.25 * g * dt, 1e-12));
    } else {
      CHECK(after[k] == before[k]);
    }
  }
  CHECK(others == 1);
  CHECK(bodies[inside].angularVelocity().norm() <= settings.tolerance * g * dt);
  // Now that the same changes nothing, a spin alone does.
  if (material.spinningFriction > 0.0) {
    fall();
    bodies[inside].angularVelocity()[2] += g * dt;
    CHECK(solver.solve(bodies, dt).iterations > 1);
    CHECK(bodies[inside].angularVelocity()[2] < 0.95 * g * dt);
  }
}

TEST_CASE("a blow on a heap at rest: only what it reaches is looked at again, for the same answer") {
  const double dt = 1e-3;
  const double g = 9.81;
  for (const double friction : {0.0, 0.5}) {
    Material<double> material{};
    material.staticFriction = material.kineticFriction = friction;
    Bodies<double, SoA> bodies = fourLayers();
    const auto fall = [&](Bodies<double, SoA>& all) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        all[i].velocity() = Vector3<double>(0, 0, -g * dt);
        all[i].angularVelocity().setZero();
      }
    };
    const auto contacts = contactsOf(bodies, material, floorAtZero<double>());
    ContactSolver<double> solver;
    ContactSettings<double> settings;
    settings.tolerance = 1e-12;
    settings.maxIterations = 10000;
    solver.setSettings(settings);
    for (int step = 0; step < 3; ++step) {
      fall(bodies);
      solver.solve(contacts, bodies, dt);
    }
    fall(bodies);
    // A corner on top.
    if (friction > 0.0) {
      bodies[3 * 144].angularVelocity() = Vector3<double>(-8, 8, 0) * g * dt;
    } else {
      bodies[3 * 144].velocity()[2] -= 4 * g * dt;
    }
    Bodies<double, SoA> exact = bodies;
    ContactSolver<double> oracle = solver;
    oracle.solve(contacts, exact, dt);

    settings.tolerance = 1e-3;
    solver.setSettings(settings);
    const ContactReport<double> report = solver.solve(contacts, bodies, dt);
    CHECK(report.residual <= settings.tolerance);
    CHECK(report.iterations > 3);
    if (friction == 0.0) {
      CHECK(report.looks < contacts.size() * 3 / 2);  // each once, and again those near the corner
    }
    double furthest = 0.0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      furthest = std::max(furthest, (bodies[i].velocity() - exact[i].velocity()).norm());
    }
    // A contact that is passed over is right to half of what ends the sweeps; errors of a body's few add up.
    CHECK(furthest < 4 * settings.tolerance * 5 * g * dt);
    CHECK(furthest > 0.0);
  }
}

TEST_CASE("a heavy body on a light one, and a light one on a heavy one: mass ratio 1e9") {
  for (const double top : {1e9, 1e-9}) {
    Bodies<double, SoA> bodies = column<double>(2, 1e-6, 9.81, 1e-3);
    bodies[1].mass() = top;
    ContactSolver<double> solver;
    ContactSettings<double> settings;
    settings.maxIterations = 100000;
    settings.tolerance = 1e-9;
    solver.setSettings(settings);
    const auto contacts = contactsOf(bodies, Material<double>{}, floorAtZero<double>());
    for (int step = 0; step < 50; ++step) {  // the warm start carries on where a step ends
      solver.solve(contacts, bodies, 1e-3);
      for (std::size_t i = 0; i < 2; ++i) {
        bodies[i].velocity()[2] -= 9.81e-3;
      }
    }
    const double g_dt = 9.81e-3;
    CHECK_THAT(solver.impulses()[0].normal, WithinRel(top * g_dt, 1e-6));
    CHECK_THAT(solver.impulses()[1].normal, WithinRel((1 + top) * g_dt, 1e-6));
  }
}

// Two heavy balls that a force presses together, and a light one between them: both contacts carry all of it.
// The share by which sweeps shorten is 1 - 2 m/M. Seen to fail: without leaps, 0.46 of it was missing at 1e6
// and 0.999 at 1e9.
TEST_CASE("a light ball between two heavy ones carries what presses these together, up to mass ratio 1e9") {
  for (const double ratio : {1e3, 1e4, 1e6, 1e8, 1e9}) {
    Bodies<double, SoA> bodies;
    Body<double> ball;
    ball.radius = 0.1;
    bodies.add(ball);
    ball.radius = 1;
    ball.mass = ratio;
    for (const double side : {-1.0, 1.0}) {
      ball.position = {1.1 * side, 0, 0};
      ball.velocity = {-0.03 * side, 0, 0};
      bodies.add(ball);
      bodies[bodies.size() - 1].acceleration() = Vector3<double>(-3 * side, 0, 0);
    }
    Material<double> material;
    material.staticFriction = material.kineticFriction = 0.5;
    const auto contacts = contactsOf<double>(bodies, material, {}, 1e-9);
    REQUIRE(contacts.size() == 2);
    ContactSettings<double> settings;
    limitSweeps(settings, 0, contacts.size(), false);
    ContactSolver<double> solver;
    solver.setSettings(settings);
    solver.solve(contacts, bodies, 0.01);
    CAPTURE(ratio);
    for (const ContactImpulse<double>& impulse : solver.impulses()) {
      CHECK(std::abs(impulse.normal / (0.03 * ratio) - 1) < 1e-3);
    }
    const Vector3<double> momentum = Vector3<double>(bodies[0].velocity()) +
                                     ratio * Vector3<double>(bodies[1].velocity() + bodies[2].velocity());
    CHECK(momentum.norm() < 1e-15 * 0.06 * ratio);
  }
}

// Steps that are the same share q of the one before have q/(1 - q) of the last to go. Seen to fail: the
// square of 1e-25 kg m^2/s^2 was 0 in float.
TEMPLATE_TEST_CASE("sweeps that shorten by a share leap to where they lead, however small they are", "",
                   float, double) {
  using S = TestType;
  for (const double size : {1.0, 1e-25}) {
    const S q(0.96875);
    detail::SweepCourse<S> course(S(0), 1000, true);
    detail::SweepProgress<S> now;
    now.change_sq = S(1);
    now.size = S(size);
    course.take(now);
    course.begin(now, false);
    for (int sweep = 1; sweep < 128; ++sweep) {
      CHECK(course.leap() == S(0));
      now.along = q * now.size;
      now.size = sweep < 100 ? now.size : S(q * now.along);  // at first they do not shorten
      course.take(now);
      course.goOn(now, false);
    }
    CAPTURE(size);
    CHECK_THAT(course.leap(), WithinRel(31.0, 1e-4));
  }
}

TEST_CASE("a blow of mass ratio 1e9 is the closed form to 1e-14") {
  Bodies<double, SoA> bodies;
  Body<double> ball;
  ball.radius = 1;
  ball.mass = 1e9;
  ball.velocity = {1, 0, 0};
  bodies.add(ball);
  ball.mass = 1;
  ball.velocity = {-2, 0, 0};
  ball.position = {1.999, 0, 0};
  bodies.add(ball);
  ContactSolver<double>().solve(contactsOf(bodies, Material<double>{1, 0, 0, 0}), bodies, 1.0);
  CHECK_THAT(bodies[1].velocity()[0], WithinRel(-2.0 + 2.0 * 3.0 * 1e9 / (1e9 + 1.0), 1e-14));
  CHECK_THAT(bodies[0].velocity()[0] - 1.0, WithinAbs(-2.0 * 3.0 / (1e9 + 1.0), 2.3e-16));
}

TEST_CASE("tiny numbers: speeds of 1e-310 and masses of 1e-300 obey the same laws") {
  Bodies<double, SoA> bodies;
  Bodies<double, SoA> ordinary;
  const CounterRandom random(5);
  std::uint64_t counter = 0;
  const double tiny = 0x1p-1000;
  for (int i = 0; i < 30; ++i) {
    Body<double> body = randomBody<double>(random, counter);
    body.radius = 0.5;
    for (int c = 0; c < 3; ++c) {
      body.position[c] = random.uniform(counter++, -1.2, 1.2);
    }
    ordinary.add(body);
    body.mass *= 0x1p-997;  // 1e-300
    body.velocity *= tiny;
    body.angularVelocity *= tiny;
    bodies.add(body);
  }
  const Material<double> material{0.5, 0.4, 0.3, 0.2};
  ContactSolver<double>().solve(contactsOf(bodies, material), bodies, 0.01);
  ContactSolver<double>().solve(contactsOf(ordinary, material), ordinary, 0.01);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Vector3<double> v = bodies[i].velocity();
    // Powers of two: the same bits but for the order in which rounding meets the scale of masses.
    CHECK((v / tiny - ordinary[i].velocity()).norm() <= 1e-12 * (1.0 + ordinary[i].velocity().norm()));
    CHECK((bodies[i].angularVelocity() / tiny - ordinary[i].angularVelocity()).norm() <= 1e-11);
  }
  Bodies<double, SoA> pair;
  Body<double> dust;
  dust.mass = 1e-300;
  dust.radius = 1e-7;
  dust.velocity = {3e-310, 0, 0};
  pair.add(dust);
  dust.position = {1.9e-7, 0, 0};
  dust.velocity = {-3e-310, 0, 0};
  pair.add(dust);
  ContactSolver<double>().solve(contactsOf(pair, Material<double>{1, 0.5, 0.5, 0}), pair, 1.0);
  CHECK_THAT(pair[0].velocity()[0], WithinRel(-3e-310, 1e-12));
  CHECK_THAT(pair[1].velocity()[0], WithinRel(3e-310, 1e-12));
}

TEST_CASE("a solver that knows ordinary speeds and masses takes tiny ones as a new one does, and back") {
  const CounterRandom random(6);
  std::uint64_t counter = 0;
  std::vector<Body<double>> crowd;
  for (int i = 0; i < 30; ++i) {
    crowd.push_back(randomBody<double>(random, counter));
    crowd.back().radius = 0.5;
    for (int c = 0; c < 3; ++c) {
      crowd.back().position[c] = random.uniform(counter++, -1.2, 1.2);
    }
  }
  const Material<double> material{0.5, 0.4, 0.3, 0.2};
  ContactSettings<double> settings;
  settings.warmStart = false;
  ContactSolver<double> used;
  used.setSettings(settings);
  ContactList<double> contacts;
  for (const auto& [speed, mass] : {std::pair(1.0, 1.0), std::pair(0x1p-1000, 1.0), std::pair(1.0, 0x1p-997),
                                    std::pair(1.0, 1.0), std::pair(0x1p900, 1.0), std::pair(1.0, 1.0)}) {
    Bodies<double, SoA> bodies;
    for (Body<double> body : crowd) {
      body.mass *= mass;
      body.velocity *= speed;
      body.angularVelocity *= speed;
      bodies.add(body);
    }
    if (contacts.empty()) {
      contacts = contactsOf(bodies, material);
      used.begin(contacts, bodies);
    }
    REQUIRE(contacts.size() > 30);
    Bodies<double, SoA> other = bodies;
    ContactSolver<double> fresh;
    fresh.setSettings(settings);
    fresh.solve(contacts, other, 0.01);
    used.solve(bodies, 0.01);  // the same contacts once more
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      CHECK(bodies[i].velocity() == other[i].velocity());
      CHECK(bodies[i].angularVelocity() == other[i].angularVelocity());
      CHECK(detail::maxAbs(Vector3<double>(bodies[i].velocity())) < 100.0 * speed);
    }
  }
}

// Seen to fail: any guess taken (NaN from 2^-1000 on, and speeds of 1e-17 where all were 1e-30).
TEST_CASE("a solver that knows far higher speeds begins anew where they have fallen") {
  const Material<double> material{0.5, 0.4, 0.3, 0.2};
  for (const bool elsewhere : {false, true}) {
    for (const double speed : {0x1p-100, 0x1p-600, 0x1p-1000}) {
      CAPTURE(elsewhere, speed);
      const auto three = [&](double v) {
        Bodies<double, SoA> bodies;
        for (int i = 0; i < 3; ++i) {
          Body<double> body;
          body.radius = 0.5;
          body.mass = 1.0 + i;
          body.position = {0.99 * i, 0.1 * i, 0};
          body.velocity = v * Vector3<double>(1.0 - i, 0.2 * i, 0.1);
          bodies.add(body);
        }
        return bodies;
      };
      Bodies<double, SoA> fast = three(1.0);
      ContactList<double> contacts = contactsOf(fast, material);
      REQUIRE(contacts.size() == 2);
      ContactSolver<double> used;
      used.solve(contacts, fast, 0.01);
      Bodies<double, SoA> slow = three(speed);
      Bodies<double, SoA> other = three(speed);
      if (elsewhere) {  // contacts found anew, with what is remembered of them
        used.solve(contacts, slow, 0.01);
      } else {
        used.solve(slow, 0.01);
      }
      ContactSolver<double> fresh;
      fresh.solve(contacts, other, 0.01);
      for (std::size_t i = 0; i < 3; ++i) {
        CHECK(slow[i].velocity() == other[i].velocity());
        CHECK(slow[i].angularVelocity() == other[i].angularVelocity());
      }
    }
  }
}

TEST_CASE("a resting contact does not bounce on what gravity gives it in a step; a faster one does") {
  const double g = 9.81;
  const double dt = 1e-2;
  for (const double speed : {1.0, 3.0}) {  // in units of g dt; the threshold is 2
    Bodies<double, SoA> bodies = column<double>(1, 1e-6, g, dt);
    bodies[0].velocity()[2] = -speed * g * dt;
    ContactSolver<double>().solve(contactsOf(bodies, Material<double>{0.5, 0, 0, 0}, floorAtZero<double>()),
                                  bodies, dt);
    CHECK(bodies[0].velocity()[2] == (speed > 2 ? 0.5 * speed * g * dt : 0.0));
  }
  Bodies<double, SoA> bodies = column<double>(1, 1e-6, 0.0, dt);
  bodies[0].velocity()[2] = -0.4;
  ContactSolver<double> solver;
  ContactSettings<double> settings;
  settings.restitutionThreshold = 0.5;
  solver.setSettings(settings);
  solver.solve(contactsOf(bodies, Material<double>{0.5, 0, 0, 0}, floorAtZero<double>()), bodies, dt);
  CHECK(bodies[0].velocity()[2] == 0.0);
}

TEST_CASE("a contact seen before it closes lets a body come to the surface and no further") {
  Bodies<double, SoA> bodies = column<double>(1, -1e-3, 0.0, 1.0);
  bodies[0].velocity()[2] = -0.5;
  const auto contacts = contactsOf(bodies, Material<double>{0, 0, 0, 0}, floorAtZero<double>(), 2e-3);
  REQUIRE(contacts.size() == 1);
  ContactSolver<double> solver;
  ContactSettings<double> settings;
  settings.restitutionThreshold = 1.0;
  solver.setSettings(settings);
  solver.solve(contacts, bodies, 0.01);
  CHECK_THAT(bodies[0].velocity()[2], WithinRel(-0.1, 1e-12));  // 1e-3 m in 0.01 s
  bodies[0].velocity()[2] = -0.05;
  solver.solve(contacts, bodies, 0.01);
  CHECK(bodies[0].velocity()[2] == -0.05);  // will not reach it in this step
}

TEST_CASE("a moving partner: friction carries along, and the drift's work closes the ledger") {
  Bodies<double, SoA> bodies = column<double>(4, 1e-4, 9.81, 1e-2);
  auto contacts = contactsOf(bodies, Material<double>{0.3, 0.5, 0.4, 0.0}, floorAtZero<double>());
  for (Contact<double>& c : contacts) {
    if (c.second == staticPartner) {
      contacts.setSurface(c, {contacts.material(c), {0.02, 0, 0.01}});  // the floor moves
    }
  }
  const double before = static_cast<double>(Totals(bodies).energy);
  const ContactReport<double> report = ContactSolver<double>().solve(contacts, bodies, 1e-2);
  const double after = static_cast<double>(Totals(bodies).energy);
  CHECK(bodies[0].velocity()[0] > 1e-3);
  CHECK_THAT(bodies[0].velocity()[2], WithinRel(0.01, 1e-3));
  CHECK(report.driftWork > 0.0);
  CHECK_THAT(after - before,
             WithinRel(report.driftWork - report.restitutionLoss - report.frictionLoss, 1e-10));
}

// Seen to fail: impulses listed in the order of rows; a list kept from the solve before; what resists turning
// left out of the list; momentum from impulses that the sweep has changed already.
TEST_CASE(
    "impulses are listed by contact while contacts stay, go and come, and so are those of the solve before") {
  Bodies<double, SoA> bodies = randomCloud<double>(150, 5.0, 11);
  Material<double> material{0.3, 0.5, 0.4, 0.0};
  const bool turns = GENERATE(false, true);
  material.rollingFriction = material.spinningFriction = turns ? 0.05 : 0.0;
  ContactList<double> all = contactsOf(bodies, material);
  ContactList<double> fewer;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (k % 3 != 0) {
      fewer.push_back(all[k], all.surface(all[k]));
    }
  }
  REQUIRE(fewer.size() > 100);
  const auto dv = [](std::size_t i) {
    const auto d = CounterRandom(17, i).direction(0);
    return Vector3<double>(d[0], d[1], d[2]);
  };
  ContactSolver<double> solver;
  ContactSettings<double> settings;
  settings.accelerate = GENERATE(false, true);
  solver.setSettings(settings);
  std::vector<ContactImpulse<double>> before;
  for (const ContactList<double>* contacts : {&all, &all, &fewer, &all, &all}) {
    std::vector<Vector3<double>> velocities;
    std::vector<Vector3<double>> spins;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].velocity() += 0.1 * dv(i);  // something to do for every solve
      velocities.emplace_back(bodies[i].velocity());
      spins.emplace_back(bodies[i].angularVelocity());
    }
    solver.solve(*contacts, bodies, 0.01);
    const std::vector<ContactImpulse<double>> list = solver.copyImpulses();
    REQUIRE(list.size() == contacts->size());
    CHECK(std::equal(list.begin(), list.end(), solver.impulses().begin(), solver.impulses().end()));
    CHECK(solver.earlierImpulses() == before);
    before = list;
    // Each body has got what the list says of its contacts.
    std::vector<Vector3<double>> got(bodies.size(), Vector3<double>::Zero());
    std::vector<Vector3<double>> turned(bodies.size(), Vector3<double>::Zero());
    double along = 0;
    double across = 0;
    double largest = 0;
    double resisted = 0;
    for (std::size_t k = 0; k < list.size(); ++k) {
      const Contact<double>& c = (*contacts)[k];
      const Vector3<double> j = list[k].normal * c.normal + list[k].tangential;
      got[c.first] -= j;
      got[c.second] += j;
      along += list[k].normal * c.normal.dot(dv(c.second) - dv(c.first));
      across += list[k].tangential.dot(dv(c.second) - dv(c.first));
      largest = std::max(largest, j.norm());
      const double r1 = bodies[c.first].radius();
      const double r2 = bodies[c.second].radius();
      const Vector3<double> l = r1 * r2 / (r1 + r2) * list[k].turning;
      turned[c.first] -= c.arm1 * c.normal.cross(list[k].tangential) + l;
      turned[c.second] -= c.arm2 * c.normal.cross(list[k].tangential) - l;
      resisted = std::max(resisted, l.norm());
    }
    REQUIRE(largest > 1e-3);
    CHECK((resisted > 1e-4 * largest) == turns);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Vector3<double> gained = bodies[i].mass() * (bodies[i].velocity() - velocities[i]);
      CHECK((gained - got[i]).norm() < 1e-12 * largest);
      const double moment =
          bodies[i].inertiaFactor() * bodies[i].mass() * bodies[i].radius() * bodies[i].radius();
      CHECK((moment * (bodies[i].angularVelocity() - spins[i]) - turned[i]).norm() < 1e-12 * largest);
    }
    const Eigen::Array2d work = solver.workOn(dv);
    CHECK_THAT(work[0], WithinAbs(along, 1e-12 * largest * static_cast<double>(list.size())));
    CHECK_THAT(work[1], WithinAbs(across, 1e-12 * largest * static_cast<double>(list.size())));
  }
}

TEST_CASE("all fixed, none, and one: no work and no crash; a body with a hundred partners is right too") {
  Bodies<double, SoA> none;
  ContactSolver<double> solver;
  CHECK(solver.solve({}, none, 1.0).iterations == 0);
  CHECK(solver.impulses().empty());
  Bodies<double, SoA> bodies;
  Body<double> hub;
  hub.radius = 1;
  bodies.add(hub);
  const CounterRandom random(1);
  for (std::uint64_t i = 0; i < 100; ++i) {  // more partners than colours
    Body<double> ball;
    ball.radius = 0.01;
    ball.mass = 0.01;
    ball.position = 1.009 * random.direction(i);
    ball.velocity = -ball.position;
    bodies.add(ball);
  }
  auto contacts = contactsOf(bodies, Material<double>{0, 0, 0, 0});
  std::erase_if(contacts.contacts, [](const Contact<double>& c) { return c.key1 != 0; });
  REQUIRE(contacts.size() == 100);
  const Totals before(bodies);
  ContactSettings<double> settings;
  settings.tolerance = 1e-10;
  settings.maxIterations = 1000;
  solver.setSettings(settings);
  const ContactReport<double> report = solver.solve(contacts, bodies, 1.0);
  CHECK(report.residual <= 1e-10);
  CHECK(solver.coloring().end(solver.coloring().colours()) -
            solver.coloring().begin(solver.coloring().colours()) ==
        100 - ContactColoring::maxColours);
  for (const Contact<double>& c : contacts) {
    CHECK(normalVelocity(c, bodies) > -1e-8);
  }
  CHECK((Totals(bodies).momentum - before.momentum).norm() < 1e-14L * before.momentumScale);
}

TEST_CASE("contacts of bodies that do not exist and settings out of range are refused") {
  Bodies<double, SoA> bodies = column<double>(2, 1e-4, 1.0, 1.0);
  auto contacts = contactsOf(bodies, Material<double>{});
  ContactSolver<double> solver;
  contacts[0].second = 7;
  CHECK_THROWS_WITH(solver.solve(contacts, bodies, 1.0),
                    ContainsSubstring("0, 7") && ContainsSubstring("below 2"));
  contacts[0].second = contacts[0].first;
  CHECK_THROWS_AS(solver.solve(contacts, bodies, 1.0), std::invalid_argument);
  contacts[0].second = 1;
  contacts[0].surface = 12;
  CHECK_THROWS_WITH(solver.solve(contacts, bodies, 1.0), ContainsSubstring("surface of a contact is 12") &&
                                                             ContainsSubstring("number of surfaces"));
  const auto with = [](auto change) {
    ContactSettings<double> s;
    change(s);
    return s;
  };
  CHECK_THROWS_WITH(solver.setSettings(with([](auto& s) { s.tolerance = 0; })),
                    ContainsSubstring("contact tolerance is 0"));
  CHECK_THROWS_WITH(solver.setSettings(with([](auto& s) { s.maxIterations = 0; })),
                    ContainsSubstring("maxIterations is 0"));
  CHECK_THROWS_WITH(solver.setSettings(with([](auto& s) { s.restitutionThreshold = -1; })),
                    ContainsSubstring("restitutionThreshold is -1"));
  contacts[0].surface = 0;
  CHECK_THROWS_WITH(solver.solve(contacts, bodies, -1.0), ContainsSubstring("step of a contact solve is -1"));
  CHECK_THROWS_AS(solver.solve(contacts, bodies, std::nan("")), std::invalid_argument);
}

namespace {

/// A user's arrays: two balls that touch and approach.
struct TouchingArrays {
  std::vector<Vector3<double>> x{{0, 0, 0}, {1.9, 0, 0}}, v{{0, 0, 0}, {-1, 0, 0}}, w{{0, 0, 0}, {0, 0, 0}},
      a = w;
  std::vector<double> m{1, 1}, r{1, 1}, k{0.4, 0.4};
  std::vector<std::uint64_t> ids{1, 2};
  std::vector<std::uint32_t> zeros{0, 0};
  NarrowPhase<double> narrow;
  ContactSolver<double> solver;
  ContactList<double> contacts;

  ContactArrays<double> arrays() { return {x, v, w, a, m, r, k, zeros, ids, zeros}; }
  void find(const NarrowPhaseSettings<double>& settings = {}) {
    const std::vector<Material<double>> materials(1);
    const std::vector<Pair> pairs{{0, 1}};
    narrow.find(pairs, arrays(), Domain<double>::open(), MaterialView<double>(materials, {}), {}, settings,
                contacts);
  }
  void solve() {
    ContactArrays<double> all = arrays();
    solver.solve(contacts, all, 0.1);
  }
};

}  // namespace

// Seen to fail: read beyond its end.
TEST_CASE("a user's arrays of unlike lengths are refused, naming which") {
  TouchingArrays two;
  two.find();
  REQUIRE(two.contacts.size() == 1);
  const auto refuses = [&](auto& column, const char* what) {
    const auto whole = column;
    column.pop_back();
    CHECK_THROWS_WITH(two.find(), ContainsSubstring("length of " + std::string(what) + " is 1"));
    CHECK_THROWS_WITH(two.solve(), ContainsSubstring("that of positions, 2"));
    column = whole;
  };
  refuses(two.v, "velocities");
  refuses(two.w, "angular velocities");
  refuses(two.a, "accelerations");
  refuses(two.m, "masses");
  refuses(two.r, "radii");
  refuses(two.k, "inertia factors");
  refuses(two.ids, "ids");
  refuses(two.zeros, "flags");
  const std::vector<double> carried(1, 1.0);
  CHECK_THROWS_WITH(two.find({.carried = carried}), ContainsSubstring("length of what carries bodies is 1"));
  CHECK(two.contacts.size() == 1);
}

// Seen to fail: what has a mass that is no number did not move, and told nobody.
TEST_CASE("a user's arrays with a mass, radius or inertia out of range are refused, naming which") {
  TouchingArrays two;
  two.find();
  REQUIRE(two.contacts.size() == 1);
  const auto refuses = [&](double& value, double bad, const char* what) {
    const double good = std::exchange(value, bad);
    CHECK_THROWS_WITH(two.find(), ContainsSubstring(what));
    CHECK_THROWS_WITH(two.solve(), ContainsSubstring(what));
    value = good;
  };
  refuses(two.m[1], std::nan(""), "mass of body 1 is nan");
  refuses(two.m[0], -1.0, "mass of body 0 is -1");
  refuses(two.r[1], -2.0, "radius of body 1 is -2");
  refuses(two.k[0], 0.0, "inertia factor of body 0 is 0");
  const auto id = std::exchange(two.ids[1], std::uint64_t{1} << 63U);  // the name of a boundary
  CHECK_THROWS_WITH(two.find(),
                    ContainsSubstring("id of body 1 is 9223372036854775808; allowed: below 2^63"));
  two.ids[1] = id;
  CHECK_THROWS_WITH(two.find({.time = std::nan("")}),
                    ContainsSubstring("time of a search for contacts is nan"));
  CHECK_THROWS_WITH(two.find({.epsilon = -1.0}), ContainsSubstring("epsilon of a search for contacts is -1"));
  CHECK_THROWS_WITH(two.find({.step = std::nan("")}),
                    ContainsSubstring("step of a search for contacts is nan"));
  CHECK_THROWS_WITH(two.find({.slow = -1.0}), ContainsSubstring("slow approach is -1"));
  CHECK(two.contacts.size() == 1);
  two.solve();
  CHECK(two.v[1] != Vector3<double>(-1, 0, 0));
}

// AoS: in whole spaces, in laws/test_determinism.cpp.
TEST_CASE("bodies in tiles, and a user's own arrays, give the bits of a structure of arrays") {
  const Bodies<double, SoA> start = randomCloud<double>(60, 3.0, 4);
  Bodies<double, SoA> reference = start;
  Bodies<double, AoSoA<8>> bodies;
  std::vector<Vector3<double>> x, v, w, a;
  std::vector<double> m, r, k;
  std::vector<std::uint64_t> ids;
  for (std::size_t i = 0; i < start.size(); ++i) {
    bodies.add(start[i].load());
    x.emplace_back(start[i].position());
    v.emplace_back(start[i].velocity());
    w.emplace_back(start[i].angularVelocity());
    a.emplace_back(Vector3<double>::Zero());
    m.push_back(start[i].mass());
    r.push_back(start[i].radius());
    k.push_back(start[i].inertiaFactor());
    ids.push_back(i);
  }
  const std::vector<std::uint32_t> zeros(start.size(), 0);
  ContactArrays<double> arrays{x, v, w, a, m, r, k, zeros, ids, zeros};
  const Material<double> material{0.5, 0.5, 0.5, 0.5};
  ContactSolver<double> solver;
  solver.solve(contactsOf(reference, material), reference, 0.01);
  ContactSolver<double>().solve(contactsOf(bodies, material), bodies, 0.01);
  ContactSolver<double>().solve(contactsOf(arrays, material), arrays, 0.01);
  for (std::size_t i = 0; i < start.size(); ++i) {
    CHECK(Vector3<double>(bodies[i].velocity()) == Vector3<double>(reference[i].velocity()));
    CHECK(v[i] == Vector3<double>(reference[i].velocity()));
    CHECK(w[i] == Vector3<double>(reference[i].angularVelocity()));
  }
}

#ifndef GRAVEL_TEST_SLOW  // the solver of another scalar
TEST_CASE("the least that is a Real solves contacts with the numbers of double") {
  using R = MinimalReal;
  const Bodies<double, SoA> start = column<double>(5, 1e-4, 9.81, 1e-3);
  Bodies<double, SoA> doubles = start;
  Bodies<R, SoA> minimal;
  for (std::size_t i = 0; i < start.size(); ++i) {
    Body<R> body;
    body.mass = R(start[i].mass());
    body.radius = R(start[i].radius());
    for (int c = 0; c < 3; ++c) {
      body.position[c] = R(start[i].position()[c]);
      body.velocity[c] = R(start[i].velocity()[c]);
    }
    minimal.add(body);
    minimal.accelerations()[i] = Vector3<R>(R(0), R(0), R(-9.81));
  }
  ContactSolver<R> solver;
  const auto contacts = contactsOf<R>(minimal, Material<R>{}, floorAtZero<R>());
  solver.solve(contacts, minimal, R(1e-3));
  CorrectionSettings<R> correction;
  correction.precision = R(0);
  solver.correctPositions(minimal, correction);
  ContactSolver<double>().solve(contactsOf(doubles, Material<double>{}, floorAtZero<double>()), doubles,
                                1e-3);
  for (std::size_t i = 0; i < start.size(); ++i) {
    CHECK_THAT(minimal[i].velocity()[2].inTest(), WithinAbs(doubles[i].velocity()[2], 1e-15));
    CHECK(minimal[i].position()[2].inTest() > start[i].position()[2]);
  }
}
#endif

// Roots of lanes take the square of 1e-20 for 0 in float. Seen to fail: 0/0 without a normal impulse, after
// which a heap in float ended with velocities that are not numbers.
TEMPLATE_TEST_CASE("Friction whose square is subnormal is cut to its cone", "", float, double) {
  using S = TestType;
  using P = detail::Packed<S>;
  const P none = P::zero();
  const P one = P::all(S(1));
  const auto zero = detail::PackedVector<S>::zero();
  const S tiny = std::sqrt(std::numeric_limits<S>::min()) / S(16);
  for (const S jn : {S(0), S(tiny / 2), tiny}) {
    detail::BodyLanes<S> b1{zero, one, zero, one};
    detail::BodyLanes<S> b2 = b1;
    detail::RowLanes<S> row{{none, none, one}, one, one, none, one, P::all(S(0.5))};
    row.jt = {P::all(tiny), none, none};
    row.jn = P::all(jn);
    detail::RowChanges<S> changes;
    const auto slides = one > none;
    detail::rubRight<S>(row, b1, b2, zero, {slides, slides}, changes);
    CAPTURE(jn);
    CHECK(row.jt.x[0] >= S(0));
    CHECK(row.jt.x[0] <= jn / S(2));
  }
}
