#include "dynamics/problems.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"
#include "support/threads.hpp"
#include <gravel/dynamics/gauss_radau.hpp>
#include <gravel/dynamics/hermite.hpp>
#include <gravel/gravity/direct_sum.hpp>
#include <gravel/gravity/jerk_sum.hpp>

using namespace gravel;
using namespace gravel::test;

namespace test_hermite {

namespace {

using Real80 = long double;

template <class S>
Real80 energyOf(const Bodies<S>& bodies, Real80 softening = 0) {
  Real80 energy = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Real80 m = bodies.masses()[i];
    energy += m * Vector3<S>(bodies.velocities()[i]).template cast<Real80>().squaredNorm() / 2;
    for (std::size_t j = 0; j < i; ++j) {
      const Vector3<Real80> d = Vector3<S>(bodies.positions()[i]).template cast<Real80>() -
                                Vector3<S>(bodies.positions()[j]).template cast<Real80>();
      energy -= m * bodies.masses()[j] / std::hypot(d.norm(), softening);
    }
  }
  return energy;
}

/// A run under mutual gravity with G = 1.
template <class S>
struct Run {
  Bodies<S> bodies;
  S softening = S(0);
  Hermite4<S> method{};
  JerkSum<S> forces{};
  Vector3<S> field = Vector3<S>::Zero();

  /// n calls of h each.
  void advance(const S& h, int n = 1) {
    forces.setLaw(S(1), softening);
    for (int i = 0; i < n; ++i) {
      method.advance(bodies, h, field, forces, [&] {
        DirectSum<S>().accelerations(bodies.positions(), bodies.masses(), S(1), softening,
                                     bodies.accelerations());
      });
    }
  }
};

/// Distance from the place after one orbit of e = 1/2 in n equal steps.
Real80 closureError(int n, int corrections) {
  Run<Real80> run{bodiesOf(scenes::keplerPair<Real80>(0.5L, 0.25L))};
  run.method.setStepFactor(1);  // longer than the steps, so that each call is one
  run.method.setCorrections(corrections);
  const Vector3<Real80> start = run.bodies[0].position() - run.bodies[1].position();
  run.advance(2 * pi<Real80>() / Real80(n), n);
  CHECK(run.method.blockSteps() == static_cast<std::uint64_t>(n));
  CHECK(run.forces.pairs() == static_cast<std::uint64_t>(4 * (corrections * n + 2)));  // two to begin with
  return (run.bodies[0].position() - run.bodies[1].position() - start).norm();
}

/// A binary of separation 1e-3 among 30 bodies in a unit sphere.
std::vector<Body<double>> binaryInCluster() {
  auto list = scenes::plummerSphere<double>(30);
  const Body<double> centre = list[0];
  Body<double> one = centre;
  Body<double> two = centre;
  const double speed = std::sqrt((one.mass + two.mass) / 1e-3);
  one.position[0] += 0.5e-3;
  two.position[0] -= 0.5e-3;
  one.velocity[1] += speed / 2;
  two.velocity[1] -= speed / 2;
  list[0] = one;
  list.push_back(two);
  return list;
}

}  // namespace

// 2.7e-7 of 800 steps an orbit and 1.6e-8 of 1600 (one evaluation a step). Seen to fail: the 12 of the
// corrector as 10 (order 2).
TEST_CASE("Hermite's method is of order 4, with one evaluation a step or more") {
  for (const int corrections : {1, 2, 3}) {
    const Real80 coarse = closureError(800, corrections);
    const Real80 fine = closureError(1600, corrections);
    CAPTURE(corrections, static_cast<double>(coarse), static_cast<double>(fine));
    CHECK_THAT(static_cast<double>(std::log2(coarse / fine)), WithinAbs(4.0, 0.2));
  }
}

// Steps go with the root of eta, errors with its square: 256 for each factor of 16, blurred by the powers of
// two to which steps are rounded. Seen to fail: places predicted from the last block instead of each body's
// own start; the first step as long as the time asked for; a wrong crackle (steps of another length).
TEST_CASE("The end of an encounter of five is that of Gauss-Radau, up to the square of eta") {
  const auto list = scenes::plummerSphere<double>(5);
  Bodies<double> exact = bodiesOf(list);
  const auto forces = [&](double) {
    DirectSum<double>().accelerations(exact.positions(), exact.masses(), 1.0, 0.0, exact.accelerations());
  };
  forces(0);
  GaussRadau15<double>().advance(exact, 2.0, false, forces);
  std::vector<double> errors;
  for (const double eta : {0.02, 0.02 / 16, 0.02 / 256}) {
    Run<double> run{bodiesOf(list)};
    run.method.setStepFactor(eta);
    run.advance(0.25, 8);
    double error = 0;
    for (std::size_t i = 0; i < 5; ++i) {
      error = std::max(error, (run.bodies[i].position() - exact[i].position()).norm());
    }
    errors.push_back(error);
  }
  CAPTURE(errors[0], errors[1], errors[2]);
  CHECK(errors[0] < 1e-4);
  for (const std::size_t k : {0U, 1U}) {
    CHECK(errors[k] / errors[k + 1] > 64);
    CHECK(errors[k] / errors[k + 1] < 1024);
  }
}

TEST_CASE("A tight binary in a wide cluster costs the cluster next to nothing") {
  const auto list = binaryInCluster();
  double error[2];
  std::uint64_t pairs[2];
  for (const bool shared : {false, true}) {
    Run<double> run{bodiesOf(list)};
    run.method.setSharedSteps(shared);
    const Real80 start = energyOf(run.bodies);
    run.advance(0.01);
    error[shared ? 1 : 0] = std::abs(static_cast<double>(energyOf(run.bodies) / start - 1));
    pairs[shared ? 1 : 0] = run.forces.pairs();
  }
  CAPTURE(error[0], error[1], pairs[0], pairs[1]);
  CHECK(error[0] < 2 * error[1]);
  CHECK(error[0] < 1e-5);
  CHECK(pairs[1] > 10 * pairs[0]);
}

TEST_CASE("A cluster keeps its energy") {
  Run<double> run{bodiesOf(scenes::plummerSphere<double>(100)), 0.01};
  const Real80 start = energyOf(run.bodies, 0.01L);
  run.advance(0.125, 8);
  const double error = std::abs(static_cast<double>(energyOf(run.bodies, 0.01L) / start - 1));
  CAPTURE(error);
  CHECK(error < 1e-6);
}

TEST_CASE("Two evaluations a step keep the energy of a periodic motion, one lets it drift") {
  double drift[2];
  for (const int n : {1, 2}) {
    Run<double> run{bodiesOf(scenes::keplerPair<double>(0.3, 0.5))};
    run.method.setStepFactor(1.0);
    run.method.setCorrections(n);
    run.advance(pi<double>() / 100, 200);
    const Real80 start = energyOf(run.bodies);
    run.advance(pi<double>() / 100, 2000);
    drift[n - 1] = std::abs(static_cast<double>(energyOf(run.bodies) / start - 1));
  }
  CAPTURE(drift[0], drift[1]);
  CHECK(drift[0] > 100 * drift[1]);
}

TEST_CASE("Bodies that start at rest, without jerk, are resolved from the first step on") {
  std::vector<Body<double>> list(2);
  list[0].mass = list[1].mass = 1;
  list[1].position = {1, 0, 0};
  list.push_back({.position = {0.5, 1e3, 0}, .mass = 0});
  Run<double> run{bodiesOf(list)};
  run.method.setStepFactor(1e-3);
  run.advance(0.7);
  // r = cos^2 b, b + sin(2b)/2 = t sqrt(2 G M): 0.0917 r0 is reached at t = 0.7 of pi/4 with G M = 2.
  double b = 1;
  for (int i = 0; i < 50; ++i) {
    b -= (b + std::sin(2 * b) / 2 - 0.7 * 2) / (1 + std::cos(2 * b));
  }
  const double r = std::cos(b) * std::cos(b);
  CAPTURE(r, run.method.blockSteps());
  CHECK_THAT((run.bodies[1].position() - run.bodies[0].position()).norm(), WithinRel(r, 1e-6));
  CHECK(run.method.blockSteps() > 10);
}

// Seen to fail: a step chosen from the acceleration with the field.
TEST_CASE("Fixed bodies stay and pull, massless ones are pulled, a uniform field changes no step") {
  auto list = scenes::keplerPair<double>(0.5, 1e-3);
  list[0].fixed = true;
  list[0].velocity.setZero();
  list[1].mass = 1e-12;
  list.push_back(list[1]);
  const auto fixed = list[0].position;
  list[2].mass = 0;
  list[2].position = 2 * fixed - list[1].position;
  list[2].velocity *= -1;
  Run<double> run{bodiesOf(list)};
  run.advance(0.25, 8);
  CHECK(run.bodies[0].position() == fixed);
  CHECK((run.bodies[1].position() + run.bodies[2].position() - 2 * fixed).norm() < 1e-11);
  CHECK((run.bodies[1].position() - list[1].position).norm() > 0.1);

  // All that moves falls together.
  auto free = scenes::keplerPair<double>(0.5, 0.3);
  Run<double> still{bodiesOf(free)};
  Run<double> falling{bodiesOf(free)};
  falling.field = {1, 2, -300};
  still.advance(0.25, 4);
  falling.advance(0.25, 4);
  CHECK(still.method.blockSteps() == falling.method.blockSteps());
  const Vector3<double> fall = falling.field / 2;
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK((falling.bodies[i].position() - still.bodies[i].position() - fall).norm() < 1e-11);
    CHECK((falling.bodies[i].velocity() - still.bodies[i].velocity() - 2 * fall).norm() < 1e-11);
  }
  // A single body in it: exact, in one step.
  Run<double> single{bodiesOf(std::vector<Body<double>>(1))};
  single.field = {0, 0, -2};
  single.advance(3.0);
  CHECK(single.bodies[0].position() == Vector3<double>(0, 0, -9));
  CHECK(single.method.blockSteps() == 1);
}

TEST_CASE("What it remembers can be taken up, and is void where somebody changed a body") {
  Run<double> run{bodiesOf(scenes::plummerSphere<double>(20)), 0.01};
  run.advance(0.1, 3);
  Run<double> twin{run.bodies, 0.01};
  REQUIRE(twin.method.setState(twin.bodies, run.method.state(run.bodies)));
  CHECK(twin.method.state(twin.bodies) == run.method.state(run.bodies));
  const auto pairs = run.forces.pairs();
  run.advance(0.1, 2);
  twin.advance(0.1, 2);
  CHECK(run.forces.pairs() - pairs == twin.forces.pairs());
  for (std::size_t i = 0; i < 20; ++i) {
    CHECK(run.bodies[i].position() == twin.bodies[i].position());
    CHECK(run.bodies[i].velocity() == twin.bodies[i].velocity());
  }
  CHECK_FALSE(twin.method.setState(twin.bodies, std::vector<double>(141)));
  CHECK(twin.method.setState(twin.bodies, {}));

  // Each of these: as a method that knows nothing. Seen to fail: accelerations not compared.
  const std::vector<void (*)(Bodies<double>&)> changes{
      [](Bodies<double>& b) { b[3].position()[0] += 1e-3; },
      [](Bodies<double>& b) { b[3].velocity()[1] += 1e-3; }, [](Bodies<double>& b) { b[3].mass() *= 2; },
      [](Bodies<double>& b) { b[3].setFixed(true); },
      [](Bodies<double>& b) { b[3].acceleration()[2] += 1.0; }};
  for (const auto& change : changes) {
    Run<double> changed = run;
    change(changed.bodies);
    Run<double> fresh{changed.bodies, 0.01};
    changed.advance(0.1);
    fresh.advance(0.1);
    for (std::size_t i = 0; i < 20; ++i) {
      CHECK(changed.bodies[i].position() == fresh.bodies[i].position());
    }
  }
}

// Blocks of one body, of many, and of all, which are shared between threads. Seen to fail: rows that a second
// thread leaves to the predicted values.
TEST_CASE("A whole run is the same bits for 1, 2, 3 and 8 threads") {
  const auto run = [](int threads) {
    const WithThreads with(threads);
    Run<double> cluster{bodiesOf(scenes::plummerSphere<double>(300)), 1e-3};
    cluster.advance(1.0 / 64, 8);
    std::vector<double> all = cluster.method.state(cluster.bodies);
    for (std::size_t i = 0; i < cluster.bodies.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        all.push_back(cluster.bodies[i].position()[c]);
        all.push_back(cluster.bodies[i].velocity()[c]);
      }
    }
    CHECK(cluster.method.blockSteps() > 40);
    return all;
  };
  const std::vector<double> one = run(1);
  for (const int threads : {2, 3, 8}) {
    const bool same = run(threads) == one;
    CHECK(same);
  }
}

TEST_CASE("Steps are no shorter than asked for, and settings out of range are refused") {
  Run<double> run{bodiesOf(scenes::keplerPair<double>(0.9, 0.3))};
  run.method.setShortestStep(1.0 / 16);
  run.advance(1.0, 20);
  CHECK(run.method.blockSteps() <= 320);
  Run<double> free{bodiesOf(scenes::keplerPair<double>(0.9, 0.3))};
  free.advance(1.0, 20);
  CHECK(free.method.blockSteps() > 640);
  Hermite4<double> method;
  for (const double bad : {0.0, -1.0, 1.5, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK_THROWS_WITH(method.setStepFactor(bad), ContainsSubstring("step factor"));
  }
  CHECK_THROWS_WITH(method.setShortestStep(-1.0), ContainsSubstring("shortest step"));
  CHECK_THROWS_WITH(method.setCorrections(0), ContainsSubstring("corrections"));
}

TEST_CASE("float follows an orbit in metres and seconds") {
  // The earth about the sun, a quarter of a year.
  std::vector<Body<float>> list(2);
  list[0].mass = 1.989e30F;
  list[1].mass = 5.97e24F;
  list[1].position = {1.496e11F, 0, 0};
  list[1].velocity = {0, 29788.0F, 0};
  auto bodies = bodiesOf(list);
  JerkSum<float> forces;
  forces.setLaw(6.6743e-11F, 0.0F);
  Hermite4<float> method;
  for (int day = 0; day < 365; ++day) {
    method.advance(bodies, 21600.0F, Vector3<float>::Zero(), forces, [] {});
  }
  const double angle = 365 * 21600.0 * 29788.0 / 1.496e11;
  CHECK(std::abs(bodies[1].position()[0] / 1.496e11 - std::cos(angle)) < 1e-4);
  CHECK(std::abs(bodies[1].position()[1] / 1.496e11 - std::sin(angle)) < 1e-4);
}

// The star takes half of the first step each time, 128 steps a time unit: 1279 in all, where its planets take
// 162 each. Seen to hang without the floor; so does a floor for steps alone that shrink to less than half.
TEMPLATE_TEST_CASE("Block steps end on a star amid evenly spread planets", "", float, double, Real80) {
  using S = TestType;
  const auto blocks = [](int n, double offset, double far, double boost) {
    Run<S> run{starOf<S>(n, offset, {S(far), 0, 0}, {S(boost), S(boost / 3), 0})};
    run.advance(S(1) / S(16), 160);
    const S apart = (run.bodies[1].position() - run.bodies[0].position()).norm();
    CHECK_THAT(static_cast<double>(apart), WithinAbs(1.0, 3e-3));
    return run.method.blockSteps();
  };
  for (const int n : {2, 3, 4, 5}) {
    for (const double offset : {0.0, 1e-16, 1e-14, 1e-12}) {
      CAPTURE(n, offset);
      CHECK(blocks(n, offset, 0, 0) < 1400);
    }
    for (const double boost : {1e-3, 1.0, 1e2}) {
      CAPTURE(n, boost);
      CHECK(blocks(n, 0, 0, boost) < 1400);
    }
    CAPTURE(n);
    CHECK(blocks(n, 0, 100, 0) < 1400);
  }
}

// Seen to hang without the floor for the tracer at 1e-16 of the circular pair.
TEST_CASE(
    "A tracer in the middle of two bodies and the centre of a symmetric cluster do not stop the clock") {
  for (const bool fixed : {false, true}) {
    for (const double off : {0.0, 1e-16, 1e-14, 1e-9}) {
      std::vector<Body<double>> list(3);
      list[0].mass = list[1].mass = 0.5;
      list[0].position = {0.5, 0, 0};
      list[1].position = {-0.5, fixed ? 0.1 : 0.0, 0};
      list[0].velocity[1] = fixed ? 0.0 : 0.5;
      list[1].velocity = -list[0].velocity;
      list[0].fixed = list[1].fixed = fixed;
      list[2].mass = 0;
      list[2].position = {off / 2, fixed ? 0.05 + off : 0.0, off};
      Run<double> run{bodiesOf(list)};
      run.advance(1.0 / 16, 160);
      CAPTURE(fixed, off);
      CHECK(run.method.blockSteps() < 4000);
    }
  }
  std::vector<Body<double>> cluster;
  for (Body<double> body : scenes::plummerSphere<double>(60)) {
    body.velocity.setZero();
    cluster.push_back(body);
    body.position *= -1;
    cluster.push_back(body);
  }
  cluster.push_back({.mass = 0.01});
  Run<double> run{bodiesOf(cluster), 0.01};
  run.advance(1.0 / 16, 4);
  CHECK(run.method.blockSteps() < 100);
}

// The light pair goes round in 1.05, at 5e-8 of the largest acceleration. Seen to fail: a floor of 64 first
// steps for all.
TEST_CASE("Block steps resolve a light pair far out beside a heavy one") {
  auto list = scenes::keplerPair<double>(0.0, 0.3);
  for (Body<double>& body : list) {
    body.position[0] += 1e6;
  }
  const double r = 1e-9;
  for (const double sign : {1.0, -1.0}) {
    list.push_back(
        {.position = {0, 0, sign * r / 2}, .velocity = {0, sign * 6 * r / 2, 0}, .mass = 36 * r * r * r / 2});
  }
  Run<double> run{bodiesOf(list)};
  run.advance(0.125, 80);
  CHECK(run.method.blockSteps() > 400);
  CHECK_THAT((run.bodies[2].position() - run.bodies[3].position()).norm() / r, WithinAbs(1.0, 1e-3));
}

// The pair is a tenth or a thirtieth of its Hill radius wide. The pull of the star alone asks for steps of a
// tenth of a time unit, in which the pair turns once and more. Seen to fail by Aarseth's rule alone, off by
// 0.2 to 3600 for the lighter ones, and with pairs asked where steps become shorter alone. What is left is
// the tide, 1e-3, and the method's error.
TEST_CASE("Block steps resolve a light pair beside a star, whose pull hides it") {
  for (const double m : {1e-9, 1e-12, 1e-15, 1e-18}) {
    for (const double wide : {0.1, 1.0 / 30}) {
      for (const double e : {0.0, 0.6}) {
        const double a = wide * std::cbrt(2 * m / 3);
        const double apart = a * (1 + e);
        const double speed = std::sqrt(2 * m / a * (1 - e) / (1 + e));
        Run<double> run{bodiesOf<double>(
            {{.mass = 1, .fixed = true},
             {.position = {1 + apart / 2, 0, 0}, .velocity = {0, 1 + speed / 2, 0}, .mass = m},
             {.position = {1 - apart / 2, 0, 0}, .velocity = {0, 1 - speed / 2, 0}, .mass = m}})};
        run.advance(pi<double>() / 2 * std::sqrt(a * a * a / (2 * m)), 80);
        const Vector3<double> x = run.bodies[1].position() - run.bodies[2].position();
        const Vector3<double> v = run.bodies[1].velocity() - run.bodies[2].velocity();
        CAPTURE(m, wide, e);
        CHECK_THAT((m / x.norm() - v.squaredNorm() / 4) * 2 * a / m, WithinAbs(1.0, 5e-3));
      }
    }
  }
}

// Where steps become shorter or longer, pairs are asked for their rate: 13 % of the steps here. Seen to fail:
// asked for at every step that does not double.
TEST_CASE("The bounds of steps by pairs cost a cluster little") {
  Run<double> run{bodiesOf(scenes::plummerSphere<double>(100))};
  run.advance(0.125, 8);
  const std::uint64_t steps = run.method.bodySteps();
  const std::uint64_t rows = run.forces.pairs() / 100 - 200;  // two evaluations of all to begin with
  CAPTURE(steps, rows);
  CHECK(rows >= steps);
  CHECK(static_cast<double>(rows - steps) < 0.2 * static_cast<double>(steps));
}

// From the apocentre of e = 0.99, where a step of 0.1 is wanted, in calls of 1/25 to 1/400 of that, to just
// before it is back. Seen to fail: the wish of the start held for good, so that in calls of 1e-3 and below no
// step was ever cut, and the energy was off by 1e5 of itself.
TEST_CASE("Calls far shorter than the step that is wanted do not keep an encounter from being resolved") {
  for (const double h : {4e-3, 2e-3, 1e-3, 2.5e-4}) {
    Run<double> run{
        bodiesOf<double>({{.mass = 1, .fixed = true},
                          {.position = {1.99, 0, 0}, .velocity = {0, std::sqrt(0.01 / 1.99), 0}}})};
    run.advance(h, static_cast<int>(6 / h));
    const Vector3<double> x = run.bodies[1].position();
    const Vector3<double> v = run.bodies[1].velocity();
    CAPTURE(h);
    CHECK_THAT(v.squaredNorm() - 2 / x.norm(), WithinAbs(-1.0, 2e-4));
    CHECK(run.method.blockSteps() > static_cast<std::uint64_t>(6 / h) + 50);
  }
}

// Seen to fail: what is left of a call that threw, rows at several times, taken for a step that ended.
TEST_CASE("A call that throws leaves nothing behind: the next one begins with the bodies as they are") {
  struct Throws {
    JerkSum<double>* sum;
    int left;
    using Columns = std::array<Eigen::ArrayXd, 3>;
    void begin(const Columns& x, const Eigen::ArrayXd& m, std::size_t sources) { sum->begin(x, m, sources); }
    void evaluate(std::span<const std::uint32_t> rows, const Columns& x, const Columns& v, Columns& a,
                  Columns& j) {
      if (--left < 0) {
        throw std::runtime_error("no more");
      }
      sum->evaluate(rows, x, v, a, j);
    }
    void rates(std::span<const std::uint32_t> rows, const Columns& x, const Columns& v, Eigen::ArrayXd& r) {
      sum->rates(rows, x, v, r);
    }
  };
  Run<double> run{bodiesOf(scenes::plummerSphere<double>(20)), 0.01};
  run.advance(0.1, 3);
  Run<double> fresh{run.bodies, 0.01};
  const Bodies<double> before = run.bodies;
  Throws forces{&run.forces, 5};
  CHECK_THROWS_AS(run.method.advance(run.bodies, 0.1, run.field, forces, [] {}), std::runtime_error);
  for (std::size_t i = 0; i < 20; ++i) {
    REQUIRE(run.bodies[i].position() == before[i].position());
  }
  run.advance(0.1);
  fresh.advance(0.1);
  for (std::size_t i = 0; i < 20; ++i) {
    CHECK(run.bodies[i].position() == fresh.bodies[i].position());
  }
}

}  // namespace test_hermite
