#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/other_spaces.hpp"
#include "support/temporary_file.hpp"

#include <memory>

using namespace gravel;
using namespace gravel::test;

namespace {

/// Everything at once: gravity, field, planes, materials, friction, damping, adaptive steps, removed bodies.
template <class S, class Layout = SoA>
Space<S, Layout> busy() {
  SimulationConfig<S> config;
  config.G = S(0.5);
  config.softening = S(0.01);
  config.timeStep = S(4e-3);
  config.coeffFriction = S(0.3);
  config.coeffStaticFriction = S(0.5);
  config.tangentialRestitution = S(0.2);
  config.restitutionExponent = S(0.2);
  config.restitutionSpeed = S(0.1);
  config.linearDamping = S(0.05);
  config.angularDamping = S(0.1);
  Space<S, Layout> space(config);
  const MaterialId soft =
      space.addMaterial({.restitution = S(0.1), .staticFriction = S(0.9), .kineticFriction = S(0.7)});
  space.setPairMaterial(soft, defaultMaterial, {.restitution = S(0.7), .rollingFriction = S(0.02)});
  space.addPlane({S(0), S(0), S(1)}, S(-1.2), soft);
  space.addPlane({S(1), S(0), S(1)}, S(-1.6));
  space.setUniformField({S(0), S(0.1), S(-2)});
  scenes::CloudOptions options;
  options.count = 60;
  options.radius = 1.0;
  options.bodyRadius = {0.08, 0.16};
  options.density = {10.0, 20.0};
  options.velocityDispersion = 0.5;
  options.bodySpin = 2.0;
  std::size_t k = 0;
  for (Body<S> body : scenes::rubbleCloud<S>(options)) {
    body.material = k % 3 == 0 ? soft : defaultMaterial;
    body.fixed = k % 20 == 7;
    if (k % 5 == 0) {
      body.inertia = body.mass * body.radius * body.radius * S(0.3);
    }
    space.addBody(body);
    ++k;
  }
  space.removeBody(BodyId{11});
  space.removeBody(BodyId{59});
  return space;
}

}  // namespace

// Run 2n, against run n, save, take up in another space, run n: the files of both ends are the same bytes,
// and they hold every field of every body, the contacts' memory, the ledger and the time. Seen to fail: the
// contact solver's memory left out of the file; the rest of the sum of time left out.
TEMPLATE_TEST_CASE("n + n steps through a file are 2n steps, byte for byte", "",
                   GRAVEL_TEST_TYPES((std::pair<double, SoA>), (std::pair<float, SoA>),
                                     (std::pair<double, AoSoA<8>>))) {
  using S = typename TestType::first_type;
  using Layout = typename TestType::second_type;
  const TemporaryFile middle("middle");
  const TemporaryFile one("one");
  const TemporaryFile two("two");
  auto whole = busy<S, Layout>();
  std::size_t touched = 0;
  for (std::size_t i = 0; i < 400; ++i) {
    whole.computeDynamics(i);
    touched += whole.contactCount();
    if (i == 199) {
      whole.save(middle.path());
    }
  }
  CHECK(touched > 1000);  // there is a contact memory to be lost; the count differs between compilers
  whole.save(one.path());

  Space<S, Layout> again;
  again.addBody(Body<S>());  // gives way
  again.restore(middle.path());
  CHECK(again.steps() == 200);
  CHECK(again.n() == 58);
  for (std::size_t i = 200; i < 400; ++i) {
    again.computeDynamics(i);
  }
  again.save(two.path());
  CHECK(sameBits(stateOf(whole), stateOf(again)));
  const bool sameFile = one.bytes() == two.bytes();
  CHECK(sameFile);
  CHECK(again.addBody(Body<S>()) == BodyId{60});  // ids of removed bodies are not given again
}

// What the solver goes on from in a heap at rest comes back: how far its bodies moved since each contact was
// right, and what it was to do. Seen to fail: what it was to do left out of the file; the ways of bodies left
// out; all contacts looked at after it; contacts that were passed over not brought up to date before sweeps;
// what they resist turning with not taken up again.
TEST_CASE("A heap at rest goes on with the same bits, saved after any of its steps") {
  SimulationConfig<double> config;
  config.G = 0;
  config.timeStep = 1.0 / 60;
  config.adaptiveTimeStep = false;
  config.coeffFriction = config.coeffStaticFriction = 0.5;
  config.coeffRestitution = 0.5;
  config.rollingFriction = config.spinningFriction = GENERATE(0.0, 0.01);
  Space<double> whole(config);
  whole.setUniformField({0, 0, -9.81});
  whole.addPlane({0, 0, 1}, 0);
  for (const double side : {-1.0, 1.0}) {
    whole.addPlane({side, 0, 0}, -2.7);
    whole.addPlane({0, side, 0}, -2.7);
  }
  const CounterRandom random(3);
  std::uint64_t counter = 0;
  for (int i = 0; i < 150; ++i) {
    Body<double> grain =
        ball({1.05 * (i % 5 - 2), 1.05 * (i / 5 % 5 - 2), 0.6 + 1.1 * (i / 25)}, {0, 0, 0}, 0.5);
    grain.position[0] += random.uniform(counter++, -0.02, 0.02);
    grain.position[1] += random.uniform(counter++, -0.02, 0.02);
    whole.addBody(grain);
  }
  advance(whole, 400);
  whole.setContactTolerance(1e-2);
  advance(whole, 100);
  const TemporaryFile file("heap");
  for (int save = 0; save < 25; ++save) {
    whole.save(file.path());
    Space<double> again;
    again.restore(file.path());
    advance(whole, 4);
    advance(again, 4);
    REQUIRE(sameBits(stateOf(whole), stateOf(again)));
    CHECK(again.contactReport().looks == whole.contactReport().looks);
  }
}

// Saved in the air, and in the end all lie on the floor, alone or but for a stack of two. Seen to fail: the
// file held what had ended the sweeps of the heap before, and how far bodies had moved when contacts of it
// were right that had the numbers of single ones now. The run that was taken up knows nothing of these.
TEST_CASE("Two runs in the same state leave the same file, whatever was solved before") {
  for (const bool stacked : {false, true}) {
    SimulationConfig<double> config = plain(1e-2);
    config.coeffRestitution = 0;
    Space<double> whole(config);
    whole.setUniformField({0, 0, -9.81});
    whole.addPlane({0, 0, 1}, 0);
    for (int i = 0; i < 6; ++i) {
      whole.addBody(ball({0.1 * (i % 2), 0, 0.5 + 0.99 * i}, {0, 0, 0}, 0.5));
    }
    advance(whole, 30);
    REQUIRE(whole.contacts().size() > 2);
    for (std::size_t i = 0; i < 6; ++i) {
      whole.body(i).position() = Vec(3.0 * static_cast<double>(i), 0, 0.55);
      whole.body(i).velocity() = Vec(0, 0, 0.2);
    }
    if (stacked) {
      whole.body(5).position() = Vec(0, 0, 1.6);
    }
    advance(whole, 2);
    REQUIRE(whole.contacts().empty());
    const TemporaryFile middle("air");
    whole.save(middle.path());
    Space<double> again;
    again.restore(middle.path());
    advance(whole, 60);
    advance(again, 60);
    REQUIRE(whole.contacts().size() == 6);
    const TemporaryFile one("one");
    const TemporaryFile two("two");
    whole.save(one.path());
    again.save(two.path());
    const bool sameFile = one.bytes() == two.bytes();
    CAPTURE(stacked);
    CHECK(sameFile);
  }
}

#ifndef GRAVEL_TEST_SLOW  // see other_spaces.hpp
// Seen to fail: contacts that go on with what solver rows had of the old radius and inertia.
TEST_CASE(
    "A radius or an inertia that was changed before a file was written goes on as in the space itself") {
  for (const int what : {0, 1}) {
    SimulationConfig<double> config = plain(2e-3);
    config.coeffFriction = config.coeffStaticFriction = 0.3;
    Space<double> space(config);
    space.setUniformField({3, 0, -9.81});
    space.addPlane({0, 0, 1}, 0);
    for (int k = 0; k < 6; ++k) {
      space.addBody(ball({0.2 * k, 0, 0.1}, {0, 0, 0}, 0.1));
    }
    advance(space, 20);
    if (what == 0) {
      space.body(2).radius() = 0.11;
    } else {
      space.body(2).inertiaFactor() = 0.6;
    }
    const TemporaryFile file("changed");
    space.save(file.path());
    Space<double> other;
    other.restore(file.path());
    for (std::size_t i = 0; i < 50; ++i) {
      space.computeDynamics(i);
      other.computeDynamics(i);
    }
    CAPTURE(what);
    for (std::size_t k = 0; k < 6; ++k) {
      CHECK(Vec(space.body(k).position()) == Vec(other.body(k).position()));
      CHECK(Vec(space.body(k).angularVelocity()) == Vec(other.body(k).angularVelocity()));
    }
    CHECK(space.energyLedger().total() == other.energyLedger().total());
  }
}

TEST_CASE("A file taken up in another layout continues with the same bits") {
  const TemporaryFile file("layout");
  auto soa = busy<double>();
  advance(soa, 50);
  soa.save(file.path());
  Space<double, AoS> aos;
  aos.restore(file.path());
  advance(soa, 50);
  advance(aos, 50);
  CHECK(sameBits(stateOf(soa), stateOf(aos)));
}
#endif

// Two balls touch side by side without a load. Seen to fail: impulses after the contact without one were
// those of the next contact, and all of them were of the last of the step's solves alone.
TEST_CASE("A space from a file tells what bore what in the last step") {
  SimulationConfig<double> config = plain(1e-2);
  config.contactSubsteps = GENERATE(1U, 3U);
  Space<double> space(config);
  space.setUniformField({0, 0, -9.81});
  const std::size_t floor = space.addPlane({0, 0, 1}, 0.0);
  space.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  space.addBody(ball({1 - 1e-12, 0, 0.5}, {0, 0, 0}, 0.5, 3.0));
  advance(space, 5);
  REQUIRE(space.contacts().size() == 3);
  REQUIRE(space.contactImpulses()[0].normal == 0.0);
  const TemporaryFile file("loads");
  space.save(file.path());
  Space<double> again;
  again.restore(file.path());
  CHECK(again.contactImpulses() == space.contactImpulses());
  CHECK(again.planeForce(floor) == space.planeForce(floor));
  CHECK(again.supportedWeight().residual() == space.supportedWeight().residual());
  CHECK_THAT(again.planeForce(floor)[2], WithinRel(-4 * 9.81, 1e-3));
  const TemporaryFile copy("loads-again");
  again.save(copy.path());
  const bool sameFile = file.bytes() == copy.bytes();
  CHECK(sameFile);
}

TEST_CASE("Settings, planes, materials and the domain come back") {
  const TemporaryFile file("settings");
  auto space = busy<double>();
  space.setCoeffRestitution(0.875);
  space.setDiagnosticsEnabled(true);
  space.save(file.path());
  Space<double> back;
  back.restore(file.path());
  CHECK(back.getCoeffRestitution() == 0.875);
  CHECK(back.isDiagnosticsEnabled());
  CHECK(back.getG() == 0.5);
  CHECK(back.uniformField() == Vec(0, 0.1, -2));
  CHECK(back.addPlane({0, 0, 1}, -100.0) == 2);
  CHECK(back.addMaterial({}) == MaterialId{2});
  CHECK(back.pairMaterial(defaultMaterial, MaterialId{1}).rollingFriction == 0.02);
  CHECK(back.body(BodyId{7}).isFixed());

  Space<double> box(plain(1e-3));
  box.setDomain(Domain<double>::periodic({3, 4, 5}));
  box.save(file.path());
  Space<double> other;
  other.restore(file.path());
  CHECK(other.domain() == Domain<double>::periodic({3, 4, 5}));
}

TEST_CASE("Damaged, cut, foreign and missing files are refused, and the space stays as it was") {
  const TemporaryFile file("bad");
  auto saved = busy<double>();
  advance(saved, 5);
  saved.save(file.path());
  const std::vector<char> good = file.bytes();

  auto space = busy<double>();
  advance(space, 3);
  const auto before = stateOf(space);
  const double energy = space.energyLedger().total();
  const auto refuses = [&](const char* why) {
    CHECK_THROWS_WITH(space.restore(file.path()), ContainsSubstring(why));
    CHECK(sameBits(stateOf(space), before));
    CHECK(space.energyLedger().total() == energy);
    CHECK(space.getCoeffFriction() == 0.3);
  };
  for (const std::size_t at : {std::size_t{3}, std::size_t{100}, good.size() / 2, good.size() - 1}) {
    std::vector<char> bytes = good;
    bytes[at] = static_cast<char>(bytes[at] ^ 1);
    file.put(bytes);
    refuses(at == 3 ? "not a snapshot" : "damaged");
    bytes = good;
    bytes.resize(at);
    file.put(bytes);
    refuses(at == 3 ? "not a snapshot" : "damaged");
  }
  file.put({});
  refuses("not a snapshot");
#ifndef GRAVEL_TEST_SLOW  // see other_spaces.hpp
  Space<float> narrow;
  narrow.save(file.path());
  refuses("another Scalar");
#endif
  CHECK_THROWS_AS(space.restore("/nowhere/at/all"), std::runtime_error);
  // A value out of range in a file whose checksum is right.
  SnapshotWriter out;
  out.write(file.path());
  refuses("setting bodyCount");
  // And it goes on as if nothing had been.
  auto twin = busy<double>();
  advance(twin, 3);
  advance(space, 20);
  advance(twin, 20);
  CHECK(sameBits(stateOf(space), stateOf(twin)));
}

namespace {

/// Where the values of a record of SnapshotWriter begin, and how many there are.
std::pair<std::size_t, std::size_t> findRecord(const std::vector<char>& bytes, const std::string& name) {
  std::size_t at = sizeof detail::snapshotMagic - 1;
  std::uint64_t head[3] = {};  // length of the name, size of a value, number of values
  while (at + sizeof head < bytes.size()) {
    std::memcpy(head, bytes.data() + at, sizeof head);
    at += sizeof head + head[0];
    if (name == std::string(bytes.data() + at - head[0], head[0])) {
      return {at, head[2]};
    }
    at += head[1] * head[2];
  }
  return {at, 0};
}

/// Another value in that place of a record, and the checksum that belongs to it.
template <class T>
std::vector<char> altered(std::vector<char> bytes, const std::string& name, std::size_t place,
                          const T& value) {
  const auto [first, count] = findRecord(bytes, name);
  REQUIRE(count > place);
  std::memcpy(bytes.data() + first + place * sizeof value, &value, sizeof value);
  const std::size_t end = bytes.size() - sizeof(std::uint64_t);
  const std::uint64_t sum =
      detail::fnv1a(detail::fnvStart, reinterpret_cast<const unsigned char*>(bytes.data()), end);
  std::memcpy(bytes.data() + end, &sum, sizeof sum);
  return bytes;
}

}  // namespace

// Seen to fail: numbers, reals or materials taken up as they come, which makes the next steps throw; planes
// in any order, or with any normal.
TEST_CASE("Values that cannot be are refused by name where a file's checksum is right") {
  const TemporaryFile file("values");
  Space<double> saved(plain(5e-3));
  saved.setUniformField({0, 0, -9.81});
  saved.addPlane({0, 0, 1}, 0.0);
  saved.addPlane({1, 0, 0}, -3.0);
  saved.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  saved.addBody(ball({0, 0, 1.5}, {0, 0, 0}, 0.5));
  advance(saved, 50);
  saved.save(file.path());
  const std::vector<char> good = file.bytes();
  auto space = busy<double>();
  advance(space, 3);
  const auto before = stateOf(space);
  // Writes `value` over the first one of that record.
  const auto refuses = [&](const std::string& name, const auto& value, const std::string& why) {
    CAPTURE(name, why);
    file.put(altered(good, name, 0, value));
    CHECK_THROWS_WITH(space.restore(file.path()), ContainsSubstring(why));
    CHECK(sameBits(stateOf(space), before));
  };
  constexpr double infinite = std::numeric_limits<double>::infinity();
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  refuses("dt", 0.0, "dt of a snapshot is 0; allowed: finite, > 0");
  refuses("previous_dt", -1.0, "previous_dt of a snapshot is -1; allowed: finite, >= 0");
  refuses("time", nan, "time of a snapshot is nan");
  refuses("field.y", infinite, "field of a snapshot is inf");
  refuses("step of gaps", -1.0, "step of impulses or gaps that is negative or not finite");
  for (const char* name : {"acceleration", "angularVelocity", "planes", "contacts", "impulses",
                           "impulses of earlier solves", "solved bodies"}) {
    refuses(name, nan, std::string("a value of '") + name + "' that is not finite");
  }
  refuses("planes", 0.5, "a plane whose normal is no unit vector");
  refuses("contacts", 0.5, "a contact whose normal is no unit vector");
  refuses("numbers of planes", std::uint64_t{77}, "planes that are not in the order of their numbers");
  refuses("material", std::uint32_t{77}, "material of body 0 is 77; allowed: 0");
  refuses("materials", -1.0, "restitution of material 0 is -1");
  refuses("materials of contacts", nan, "restitution of a contact is nan");
  refuses("domain", std::uint32_t{77}, "a domain of an unknown kind");
}

// One ball sleeps, the other one rolls. Seen to fail: what is told apart from a boundary by its index alone
// was written to by it, beyond all bodies (2^31 bytes: a crash); a sleeper woke where there is no number.
TEST_CASE("A contact of a file with what is not there is found anew, and no sleeper is nowhere") {
  const TemporaryFile file("nobody");
  SimulationConfig<double> config = plain(5e-3);
  config.sleepSpeed = config.sleepTime = 0.05;
  Space<double> saved(config);
  saved.setUniformField({0, 0, -9.81});
  saved.addPlane({0, 0, 1}, 0.0);
  saved.addBody(ball({0, 0, 0.5}, {0, 0, 0}, 0.5));
  saved.addBody(ball({3, 0, 0.5}, {1, 0, 0}, 0.5));
  advance(saved, 50);
  REQUIRE(saved.body(0).isAsleep());
  REQUIRE(saved.contacts().size() == 1);
  saved.save(file.path());
  const std::vector<char> good = file.bytes();
  file.put(altered(good, "names of contacts", 1, std::uint64_t{0x7fffffff}));
  Space<double> again;
  again.restore(file.path());
  CHECK(again.contacts().empty());
  advance(saved, 20);
  advance(again, 20);
  CHECK(again.contacts().size() == 1);
  CHECK((Vec(saved.body(1).position()) - Vec(again.body(1).position())).norm() < 1e-12);
  file.put(altered(good, "sleepers", 0, std::numeric_limits<double>::quiet_NaN()));
  CHECK_THROWS_WITH(again.restore(file.path()),
                    ContainsSubstring("a value of 'sleepers' that is not finite"));
  // The one value of -1 among them is in the normal of the sleeper's contact with the floor, (0, 0, -1).
  const auto [first, count] = findRecord(good, "sleepers");
  std::vector<double> numbers(count);
  std::memcpy(numbers.data(), good.data() + first, count * sizeof(double));
  REQUIRE(std::count(numbers.begin(), numbers.end(), -1.0) == 1);
  const auto place = std::find(numbers.begin(), numbers.end(), -1.0) - numbers.begin();
  file.put(altered(good, "sleepers", static_cast<std::size_t>(place), -0.5));
  CHECK_THROWS_WITH(again.restore(file.path()),
                    ContainsSubstring("a contact of a sleeper whose normal is no unit vector"));
}

// Seen to fail: restored without a word where mass or radius is 0, for then the factor is of no inertia; the
// next step refused it.
TEST_CASE("An inertia factor that no step takes is refused in a file, too, of points and of spheres") {
  const TemporaryFile file("factor");
  for (const double radius : {0.0, 0.5}) {
    Space<double> saved(plain(5e-3));
    saved.addBody(ball({0, 0, 0}, {0, 0, 0}, radius));
    saved.save(file.path());
    const std::vector<char> good = file.bytes();
    Space<double> space = busy<double>();
    const auto before = stateOf(space);
    for (const double factor : {0.0, -0.4}) {
      CAPTURE(radius, factor);
      file.put(altered(good, "inertiaFactor", 0, factor));
      CHECK_THROWS_WITH(space.restore(file.path()), ContainsSubstring("of body 0 is") &&
                                                        ContainsSubstring("inertia") &&
                                                        ContainsSubstring("allowed: finite, > 0"));
      CHECK(sameBits(stateOf(space), before));
    }
    file.put(altered(good, "inertiaFactor", 0, 1e-300));  // as good as a setter's
    space.restore(file.path());
    space.computeDynamics(0);
    CHECK(space.body(0).inertiaFactor() == 1e-300);
  }
}

TEST_CASE("The hook and the log stay those of the space that takes a file up") {
  const TemporaryFile file("hook");
  Space<double> space(plain(1e-3));
  space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0.5));
  space.save(file.path());
  int calls = 0;
  space.setForceHook([&calls](Bodies<double, SoA>&, double) { ++calls; });
  space.restore(file.path());
  space.computeDynamics(0);
  CHECK(calls > 0);
}

// Seen to fail: what the hook gave to the forces left out of the file, so that the first step booked its
// share as that of gravity.
TEST_CASE("A run with a force of its own goes on with the same bits and the same ledger") {
  const auto set = [](Space<double>& space) {
    space.setForceHook([](Bodies<double, SoA>& bodies, double) {
      for (std::size_t i = 0; i < bodies.size(); ++i) {
        bodies[i].force() -= 30 * Vec(bodies[i].position());
        bodies[i].torque() += Vec(0, 0, 0.1);
      }
    });
  };
  Space<double> space = busy<double>();
  set(space);
  advance(space, 150);
  REQUIRE(space.contactCount() > 0);
  const TemporaryFile file("force");
  space.save(file.path());
  Space<double> other;
  set(other);
  other.restore(file.path());
  advance(space, 50);
  advance(other, 50);
  CHECK(sameBits(stateOf(space), stateOf(other)));
  CHECK(space.energyLedger().total() == other.energyLedger().total());
  CHECK(space.energyLedger().friction == other.energyLedger().friction);
}

// Seen to fail: contacts kept as a view of those of the first space, under the address sanitizer.
// One wall is pressed, the other one touched: the memory in the file is of the one alone.
TEST_CASE("A smooth ball in a corner goes on with the same bits from a file") {
  Space<double> space(plain(4e-4));
  space.setUniformField({1, -1, 0});
  space.addPlane({1, 0, 0}, 0);
  space.addPlane({0, 1, 0}, 0);
  space.addBody(ball({0.4, 0.4, 0}, {0, 0, 0}, 0.5));
  advance(space, 4);
  const TemporaryFile file("corner");
  space.save(file.path());
  Space<double> again;
  again.restore(file.path());
  for (std::size_t k = 0; k < 4; ++k) {
    space.computeDynamics(k);
    again.computeDynamics(k);
    CHECK(sameBits(stateOf(space), stateOf(again)));
    CHECK(space.contactReport().looks == again.contactReport().looks);
  }
}

TEST_CASE("What a method or a hook knows of bodies that were changed since is in no file") {
  const auto push = [](Bodies<double, SoA>& bodies, double) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].force() -= 0.1 * Vec(bodies[i].position());
    }
  };
  for (const bool hermite : {true, false}) {
    for (const char* const what : {"nothing", "damping", "velocity", "removed", "added"}) {
      CAPTURE(hermite, what);
      SimulationConfig<double> config = plain(0.1);
      config.G = 1;
      config.linearDamping = what == std::string("damping") ? 0.1 : 0;
      config.integrator = hermite ? IntegratorKind::Hermite4 : IntegratorKind::VelocityVerlet;
      Space<double> space(config);
      if (!hermite) {
        space.setForceHook(push);
      }
      space.addBody(ball({0, 0, 0}, {0, 0, 0}, 0));
      const BodyId near = space.addBody(ball({1, 0, 0}, {0, 1, 0}, 0, 1e-3));
      const BodyId far = space.addBody(ball({0, 2, 0}, {-0.7, 0, 0}, 0, 1e-3));
      advance(space, 5);
      if (what == std::string("velocity")) {
        space.body(near).velocity() *= 1.01;
      } else if (what == std::string("removed")) {
        space.removeBody(far);
      } else if (what == std::string("added")) {
        space.addBody(ball({0, -3, 0}, {0.5, 0, 0}, 0, 1e-3));
      }
      const TemporaryFile file("changed");
      space.save(file.path());
      Space<double> again;
      if (!hermite) {
        again.setForceHook(push);
      }
      again.restore(file.path());
      advance(space, 5);
      advance(again, 5);
      CHECK(sameBits(stateOf(space), stateOf(again)));
    }
  }
}

TEST_CASE("A copy of a space goes on as the first one does, also when that one is gone") {
  auto first = std::make_unique<Space<double>>(busy<double>());
  advance(*first, 200);
  REQUIRE(first->contactCount() > 0);
  Space<double> copy = *first;
  advance(*first, 200);
  const auto expected = stateOf(*first);
  first.reset();
  advance(copy, 200);
  CHECK(sameBits(expected, stateOf(copy)));
}
