#include "laws/laws.hpp"
#include "space/patch_momentum.hpp"
#include "support/catch.hpp"
#include "support/temporary_file.hpp"
#include <gravel/core/random.hpp>

// Gravity in a periodic box and in a shear-periodic patch, through a space.

using namespace gravel;
using namespace gravel::test;

namespace test_gravity_of_images {

namespace {

const Vec box(2, 3, 2.5);
const double omega = 1.0;

SimulationConfig<double> pulling(double dt) {
  SimulationConfig<double> config = plain(dt);
  config.G = 1.0;
  config.softening = 0.1;
  config.gravityTolerance = 1e-9;
  return config;
}

/// n points with random places and velocities.
void fill(Space<double>& space, std::uint64_t n, double speed) {
  const CounterRandom random(12);
  for (std::uint64_t i = 0; i < n; ++i) {
    const Vec x(random.uniform(4 * i, -1, 1), random.uniform(4 * i + 1, -1.5, 1.5),
                random.uniform(4 * i + 2, -0.3, 0.3));
    const Vec flow(0, -1.5 * space.domain().omega() * x[0], 0);
    space.addBody(ball(x, flow + speed * random.direction(i), 0.0, 0.1 + 0.1 * double(i % 3)));
  }
}

Space<double> inBox(double dt, std::uint64_t n = 20) {
  Space<double> space(pulling(dt));
  space.setDomain(Domain<double>::periodic(box));
  fill(space, n, 1.0);
  return space;
}

Space<double> inPatch(double dt, std::uint64_t n = 20) {
  SimulationConfig<double> config = pulling(dt);
  config.integrator = IntegratorKind::SymplecticEpicycle;
  Space<double> space(config);
  space.setDomain(Domain<double>::shearPeriodic(box, omega, 2.0));
  fill(space, n, 0.5);
  return space;
}

Vec momentum(const Space<double>& space) {
  Vec sum = Vec::Zero();
  for (std::size_t i = 0; i < space.n(); ++i) {
    sum += space.body(i).mass() * Vec(space.body(i).velocity());
  }
  return sum;
}

}  // namespace

TEST_CASE("In a periodic box gravity keeps momentum, and energy to second order in the step") {
  std::array<double, 2> errors{};
  for (const std::size_t k : {0U, 1U}) {
    Space<double> space = inBox(k == 0 ? 0.02 : 0.01);
    const Vec p = momentum(space);
    const double before = space.energyLedger().total();
    double worst = 0;
    for (std::size_t i = 0; i < (k == 0 ? 60U : 120U); ++i) {
      space.computeDynamics(i);
      worst = std::max(worst, std::abs(space.energyLedger().total() - before));
    }
    errors[k] = worst;
    CHECK((momentum(space) - p).norm() < 1e-13);
    CHECK(std::abs(space.body(0).position()[0]) <= 1.0);
  }
  CAPTURE(errors[0], errors[1]);
  CHECK(errors[0] < 0.1);
  CHECK(errors[0] / errors[1] > 3.4);
  CHECK(errors[0] / errors[1] < 4.6);
}

// A wave of displacements in a cold lattice: a sheet of it feels the mass that came between it and the
// sheets' old places, 4 pi G rho times its own displacement (Jeans 1902; Zel'dovich 1970), less what the
// distance of bodies, a sixth of the wave, takes away.
TEST_CASE("A plane wave in a cold lattice grows at Jeans' rate") {
  SimulationConfig<double> config = pulling(0.02);
  config.softening = 0.0;
  Space<double> space(config);
  space.setDomain(Domain<double>::periodic({1, 1, 1}));
  const int side = 6;
  const double size = 1e-4;
  const auto wave = [](double x) { return std::sin(2 * pi<double>() * x); };
  for (int i = 0; i < side * side * side; ++i) {
    const std::array<int, 3> cell{i % side, i / side % side, i / (side * side)};
    const Vec place = Vec(cell[0], cell[1], cell[2]) / side - Vec(0.5, 0.5, 0.5);
    Body<double> body = ball(place, Vec::Zero(), 0.0, 1.0 / (side * side * side));
    body.position[0] += size * wave(place[0]);
    space.addBody(body);
  }
  const auto height = [&] {  // of the wave
    double sum = 0;
    for (int i = 0; i < side * side * side; ++i) {
      const double x = double(i % side) / side - 0.5;
      sum += wave(x) * (space.body(static_cast<std::size_t>(i)).position()[0] - x);
    }
    return 2 * sum / (side * side * side);
  };
  const double start = height();
  CHECK_THAT(start, WithinRel(size, 1e-9));
  advance(space, 20);
  const double rate = std::acosh(height() / start) / space.time();
  CAPTURE(rate);
  CHECK_THAT(rate, WithinRel(std::sqrt(4 * pi<double>()), 0.06));
  advance(space, 10);
  // Exponential growth at one rate: what 20 steps told holds for the next 10.
  CHECK_THAT(height(), WithinRel(start * std::cosh(rate * space.time()), 2e-3));
}

TEST_CASE("Bodies seen as other images of themselves move alike under their gravity") {
  for (const bool sheared : {false, true}) {
    const auto run = [&](bool images) {
      Space<double> space = sheared ? inPatch(0.01) : inBox(0.01);
      advance(space, 30);  // the lattice leans
      for (std::size_t i = 0; images && i < space.n(); ++i) {
        const double k = double(i % 3) - 1.0;
        space.body(i).position() +=
            Vec(k * box[0], double(i % 2) * box[1] - k * space.domain().shearOffset(space.time()), 0);
        space.body(i).velocity()[1] -= k * space.domain().shearSpeed();
      }
      advance(space, 60);
      return space;
    };
    const Space<double> one = run(false);
    const Space<double> two = run(true);
    const double worst = largestDifference(one, two);
    CAPTURE(sheared, worst);
    CHECK(worst < 1e-8);  // far images err by 1e-9 of accelerations, as they should
  }
}

TEST_CASE("Gravity keeps the momentum of a patch") {
  Space<double> space = inPatch(0.01, 30);
  const PatchMomentum followed = followMomentum(space, 200);
  CHECK(followed.crossings > 10);
  CHECK_THAT(followed.error, WithinAbs(0.0, 1e-11));
}

TEST_CASE("A box and a patch with gravity continue bit for bit from a file") {
  const TemporaryFile file("images");
  for (const bool sheared : {false, true}) {
    for (const GravityKind kind : {GravityKind::Direct, GravityKind::FastMultipole}) {
      SimulationConfig<double> config = pulling(0.01);
      config.gravity = kind;
      config.gravityTolerance = 1e-4;
      config.integrator = sheared ? IntegratorKind::SymplecticEpicycle : IntegratorKind::VelocityVerlet;
      Space<double> whole(config);
      whole.setDomain(sheared ? Domain<double>::shearPeriodic(box, omega) : Domain<double>::periodic(box));
      fill(whole, 100, 0.5);
      advance(whole, 7);
      whole.save(file.path());
      Space<double> again;
      again.restore(file.path());
      advance(whole, 5);
      advance(again, 5);
      CHECK(sameBits(stateOf(whole), stateOf(again)));
      CHECK(again.energyLedger().total() == whole.energyLedger().total());
    }
  }
}

TEST_CASE(
    "What bodies bring into a box with gravity and take with them is booked, and so is a change of it") {
  Space<double> space = inBox(0.01);
  advance(space, 5);
  const double before = space.energyLedger().total();
  space.removeBody(BodyId{7});
  CHECK_THAT(space.energyLedger().total(), WithinRel(before, 1e-12));
  space.addBody(ball({0.5, 1.4, 1.2}, {0, 1, 0}, 0.0, 2.0));
  CHECK_THAT(space.energyLedger().total(), WithinRel(before, 1e-12));
  const double exchanged = space.energyLedger().exchange;
  space.setDomain(Domain<double>::open());
  CHECK_THAT(space.energyLedger().total(), WithinRel(before, 1e-12));
  CHECK(std::abs(space.energyLedger().exchange - exchanged) > 0.1);
}

TEST_CASE("Bodies of a box that merge keep momentum, and the ledger closes") {
  Space<double> space = inBox(1e-3);
  space.setCollisionHook([](const Collision<double>&) { return CollisionOutcome<double>::merge(); });
  space.addBody(ball({0.95, 0, 1.2}, {2, 0, 0}, 0.1, 1.0));
  space.addBody(ball({-0.84, 0, 1.2}, {0, 0, 0}, 0.1, 2.0));  // met across the edge, 0.01 apart
  const std::size_t n = space.n();
  const Vec p = momentum(space);
  const double before = space.energyLedger().total();
  advance(space, 20);
  CHECK(space.n() == n - 1);
  CHECK((momentum(space) - p).norm() < 1e-13);
  CHECK(std::abs(space.energyLedger().exchange) > 1e-3);
  CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-4));
}

}  // namespace test_gravity_of_images

// Seen to fail: domains that are asked for only when forces are.
TEST_CASE("A domain too long for gravity is refused at once, and so is gravity in it") {
  Space<double> space;  // with G
  const Domain<double> slab = Domain<double>::periodic({1e4, 1, 1});
  CHECK_THROWS_WITH(space.setDomain(slab), ContainsSubstring("longest edge of a domain with gravity"));
  CHECK(space.domain().isOpen());
  space.setG(0);
  space.setDomain(slab);
  CHECK_THROWS_WITH(space.setG(1), ContainsSubstring("longest edge of a domain with gravity"));
  CHECK(space.getG() == 0.0);
}

// Seen to fail: the energy of one body (refused as a domain with gravity).
TEST_CASE("Without gravity a domain may be of any length, whatever is done and asked there") {
  for (const bool sheared : {false, true}) {
    CAPTURE(sheared);
    SimulationConfig<double> config = plain(1e-3);
    config.integrator = sheared ? IntegratorKind::SymplecticEpicycle : IntegratorKind::VelocityVerlet;
    Space<double> space(config);
    const auto domain =
        sheared ? Domain<double>::shearPeriodic({1, 1e5, 1}, 0.1) : Domain<double>::periodic({1, 1, 1e4});
    space.setDomain(domain);
    space.setCollisionHook([](const Collision<double>&) { return CollisionOutcome<double>::merge(); });
    const BodyId first = space.addBody(ball({0, 0, 0}, {1, 0, 0}, 0.1, 2.0));
    CHECK(std::get<2>(space.calculateSystemEnergy()) == 0.0);
    advance(space, 1);
    const double before = space.energyLedger().total();
    space.setDomain(domain);
    space.addBody(ball({0.205, 0, 0}, {-1, 0, 0}, 0.1, 1.0));
    const BodyId last = space.addBody(ball({0, 0.4, 0.4}, {0, 0, 1}, 0.0, 1.0));
    advance(space, 20);
    CHECK(space.n() == 2);
    CHECK_THAT(space.energyLedger().restitution, WithinRel(4.0 / 3, 0.01));
    space.removeBody(last);
    space.removeBody(first);
    CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-4));
  }
}
