#include "laws/laws.hpp"
#include "scenes/scenes.hpp"
#include "support/catch.hpp"

// A few free points are carried through many steps of one advanceTo outside of their storage.

using namespace gravel;
using namespace gravel::test;

namespace test_few_points {

namespace {

constexpr double step = 1.0 / 1024;  // sums of steps are exact

/// Bodies about a heavy one, among them one without a mass.
Space<double> points(std::size_t n, SimulationConfig<double> config = plain(step)) {
  config.G = 1.0;
  Space<double> space(config);
  space.setUniformField({0.0, 1e-3, -0.25});
  scenes::Sequence random(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double r = 1.0 + 0.5 * static_cast<double>(i);
    Vec x = r * Vec(std::cos(3.0 * r), std::sin(3.0 * r), 0.01 * random.uniform(-1.0, 1.0));
    Vec v = Vec(-x[1], x[0], 0.02) / (r * std::sqrt(r));
    if (i == 0) {
      x = v = Vec::Zero();
    }
    space.addBody(ball(x, v, 0.0, i == 0 ? 1.0 : i == 1 ? 0.0 : 1e-3));
  }
  return space;
}

/// Everything that can be seen of a run but for its seconds.
std::vector<double> seen(const Space<double>& space) {
  std::vector<double> all = stateOf(space);
  for (std::size_t i = 0; i < space.n(); ++i) {
    const Vec f = space.body(i).force();
    all.insert(all.end(), {f[0], f[1], f[2]});
  }
  const auto ledger = space.energyLedger();
  all.insert(all.end(),
             {ledger.total(), ledger.damping, ledger.work, space.getTimeStep(), space.getPreviousTimeStep(),
              static_cast<double>(space.steps()), static_cast<double>(space.contactSubsteps())});
  for (std::size_t p = 0; p < phaseCount; ++p) {
    const Profiler::Entry& entry = space.profiler().entry(static_cast<Phase>(p));
    all.insert(all.end(), {static_cast<double>(entry.calls), static_cast<double>(entry.skips)});
  }
  return all;
}

}  // namespace

// Seen to fail: the lost parts of velocities not written back.
TEST_CASE("Many steps of advanceTo are those of computeDynamics, to the bit, the ledger and the profile") {
  for (const std::size_t n : {1U, 2U, 3U, 6U, 13U, 14U, 15U}) {
    for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::BlanesMoan4,
                                      IntegratorKind::ForceGradient4, IntegratorKind::WisdomHolman}) {
      if (kind == IntegratorKind::WisdomHolman && n < 3) {
        continue;
      }
      for (const bool carries : {true, false}) {
        CAPTURE(n, traitsOf(kind).name, carries);
        SimulationConfig<double> config = plain(step);
        config.integrator = kind;
        config.compensatedSummation = carries;
        Space<double> run = points(n, config);
        Space<double> single = points(n, config);
        run.advanceTo(50 * step);
        run.advanceTo(51 * step);
        run.advanceTo(100 * step);
        advance(single, 100);
        CHECK(sameBits(seen(run), seen(single)));
        CHECK(run.profiler().entry(Phase::Integration).calls == 100);
      }
    }
  }
}

TEST_CASE("A few points move as among bodies of all kinds") {
  for (const IntegratorKind kind : {IntegratorKind::VelocityVerlet, IntegratorKind::KahanLi6}) {
    for (const std::size_t n : {2U, 3U, 14U}) {
      SimulationConfig<double> config = plain(step);
      config.integrator = kind;
      Space<double> free = points(n, config);
      Space<double> other = points(n, config);
      other.setForceHook([](Bodies<double, SoA>&, double) {});  // anything may happen
      free.advanceTo(200 * step);
      other.advanceTo(200 * step);
      CAPTURE(n, traitsOf(kind).name);
#ifdef __FMA__  // products and sums may be fused in one place and not in the other
      CHECK(difference(stateOf(free), stateOf(other)) < 1e-13);
#else
      CHECK(sameBits(stateOf(free), stateOf(other)));
#endif
    }
  }
}

TEST_CASE("What a user changes between two runs, or in a line of the log, is seen") {
  const auto change = [](Space<double>& space) {
    space.body(1).velocity() = Vec(0.5, 0.25, 0.125);
    space.body(2).position()[2] += 0.5;
    space.body(0).mass() = 2.0;
  };
  Space<double> run = points(4);
  Space<double> single = points(4);
  run.advanceTo(20 * step);
  change(run);
  run.advanceTo(40 * step);
  advance(single, 20);
  change(single);
  advance(single, 20);
  CHECK(sameBits(stateOf(run), stateOf(single)));

  SimulationConfig<double> config = plain(step);
  config.diagnosticsEnabled = true;
  config.logFrequency = 20;
  Space<double> logged = points(4, config);
  logged.setLog([&](const char*) {
    if (logged.steps() == 21) {  // after the step of number 20
      change(logged);
    }
  });
  logged.advanceTo(40 * step);
  Space<double> same = points(4);
  advance(same, 21);
  change(same);
  advance(same, 19);
  CHECK(sameBits(stateOf(logged), stateOf(same)));
}

TEST_CASE("Steps that adapt do so in a run of a few points as one by one") {
  SimulationConfig<double> config = plain(1.0 / 64);
  config.adaptiveTimeStep = true;
  Space<double> run = points(5, config);
  run.advanceTo(2.0);
  Space<double> single = points(5, config);
  for (std::size_t i = 0; i + 2 < run.steps(); ++i) {
    single.computeDynamics(i);
  }
  single.advanceTo(2.0);  // the last two, which are shortened
  CHECK(run.steps() > 128);
  CHECK(sameBits(seen(run), seen(single)));
}

TEST_CASE("A run of a few points stops where a number is none, and is left at that step") {
  const auto fails = [](auto&& go) {
    Space<double> space = points(3);
    space.setTimeStep(1.0);
    space.body(2).velocity() = Vec(1e307, 0, 0);
    CHECK_THROWS_AS(go(space), std::invalid_argument);
    return std::pair(space.steps(), space.time());
  };
  const auto [steps, time] = fails([](Space<double>& space) { space.advanceTo(1000.0); });
  CHECK(steps > 10);
  CHECK(steps < 20);
  CHECK(time == static_cast<double>(steps));
  CHECK(fails([](Space<double>& space) { advance(space, 1000); }) == std::pair(steps, time));

  Space<double> space = points(3);
  space.advanceTo(10 * step);
  space.body(1).velocity()[1] = std::numeric_limits<double>::quiet_NaN();
  const auto before = stateOf(space);
  CHECK_THROWS_WITH(space.advanceTo(20 * step), ContainsSubstring("body 1"));
  CHECK(sameBits(stateOf(space), before));
}

}  // namespace test_few_points
