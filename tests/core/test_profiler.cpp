#include "support/catch.hpp"
#include <gravel/core/lanes.hpp>
#include <gravel/core/profiler.hpp>

#include <set>
#include <string>
#include <thread>

using namespace gravel;

namespace {

using Clock = std::chrono::steady_clock;

void busy(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

std::string printed(const Profiler& profiler) {
  std::FILE* file = std::tmpfile();
  REQUIRE(file != nullptr);
  profiler.print(file);
  std::rewind(file);
  std::string text;
  for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) {
    text += static_cast<char>(c);
  }
  std::fclose(file);
  return text;
}

}  // namespace

TEST_CASE("profiler: a scope books its time and one call", "[profiler]") {
  Profiler profiler;
  const auto start = Clock::now();
  for (int k = 0; k < 3; ++k) {
    const Profiler::Scope scope(profiler, Phase::Gravity);
    busy(3);
  }
  const double passed = std::chrono::duration<double>(Clock::now() - start).count();
  const auto& entry = profiler.entry(Phase::Gravity);
  CHECK(entry.calls == 3);
  CHECK(entry.seconds >= 0.009);
  CHECK(entry.seconds <= passed);
  CHECK(profiler.entry(Phase::Damping).calls == 0);
  CHECK(profiler.entry(Phase::Damping).seconds == 0.0);
}

TEST_CASE("profiler: an inner scope's time is not the outer one's, and all phases add up to the time passed",
          "[profiler]") {
  Profiler profiler;
  const auto start = Clock::now();
  {
    const Profiler::Scope outer(profiler, Phase::ContactSolve);
    busy(2);
    {
      const Profiler::Scope inner(profiler, Phase::Colouring);
      busy(20);
      const Profiler::Scope again(profiler, Phase::ContactSolve);
      busy(2);
    }
    busy(2);
  }
  const double passed = std::chrono::duration<double>(Clock::now() - start).count();
  const double solve = profiler.entry(Phase::ContactSolve).seconds;
  const double colouring = profiler.entry(Phase::Colouring).seconds;
  CHECK(profiler.entry(Phase::ContactSolve).calls == 2);
  CHECK(profiler.entry(Phase::Colouring).calls == 1);
  CHECK(solve >= 0.006);
  CHECK(colouring >= 0.020);
  CHECK(solve + colouring <= passed);
  CHECK(solve <= passed - 0.020);
}

TEST_CASE("profiler: skips are counted with the last reason, and reset forgets everything", "[profiler]") {
  Profiler profiler;
  CHECK(profiler.entry(Phase::NarrowPhase).reason == nullptr);
  profiler.skip(Phase::NarrowPhase, "no bodies");
  profiler.skip(Phase::NarrowPhase, "nothing near");
  CHECK(profiler.entry(Phase::NarrowPhase).skips == 2);
  CHECK(std::string(profiler.entry(Phase::NarrowPhase).reason) == "nothing near");
  CHECK(profiler.entry(Phase::NarrowPhase).calls == 0);
  profiler.reset();
  CHECK(profiler.entry(Phase::NarrowPhase).skips == 0);
  CHECK(profiler.entry(Phase::NarrowPhase).reason == nullptr);
}

TEST_CASE("profiler: a phase left by an exception is booked too", "[profiler]") {
  Profiler profiler;
  try {
    const Profiler::Scope outer(profiler, Phase::TimeStep);
    const Profiler::Scope inner(profiler, Phase::Damping);
    throw 1;
  } catch (int) {
    CHECK(profiler.entry(Phase::TimeStep).calls == 1);
    CHECK(profiler.entry(Phase::Damping).calls == 1);
  }
}

TEST_CASE("profiler: the report has a line for every phase, with runs, skips and reason", "[profiler]") {
  Profiler profiler;
  std::set<std::string> names;
  for (std::size_t p = 0; p < phaseCount; ++p) {
    names.insert(phaseName(static_cast<Phase>(p)));
  }
  CHECK(names.size() == phaseCount);
  CHECK(names.count("") == 0);
  CHECK(static_cast<std::size_t>(Phase::Diagnostics) + 1 == phaseCount);
  { const Profiler::Scope scope(profiler, Phase::Gravity); }
  profiler.skip(Phase::Colouring, "no contacts");
  const std::string text = printed(profiler);
  for (const std::string& name : names) {
    INFO(name);
    CHECK(text.find("\n" + name + " ") != std::string::npos);
  }
  CHECK(text.find("no contacts\n") != std::string::npos);
  CHECK(text.find("nan") == std::string::npos);
  CHECK(printed(Profiler()).find("nan") == std::string::npos);  // no time at all: shares are 0
}

TEST_CASE("lanes: a tile is a cache line of the built-in scalars, and tiles cover all bodies", "[lanes]") {
  CHECK(sizeof(Lanes<float>) == 64);
  CHECK(sizeof(Lanes<double>) == 64);
  CHECK(laneWidth<long double> == 4);
  CHECK(Lanes<double>::SizeAtCompileTime == laneWidth<double>);
  for (const int width : {1, 4, 8, 16}) {
    const auto w = static_cast<std::size_t>(width);
    CHECK(tileCount(0, width) == 0);
    for (std::size_t n = 1; n < 70; ++n) {
      const std::size_t tiles = tileCount(n, width);
      CHECK(tiles * w >= n);
      CHECK((tiles - 1) * w < n);
    }
  }
}

namespace {

/// Keeps the processor busy, as a sleep this short cannot.
void spin(double seconds) {
  const auto start = Clock::now();
  while (std::chrono::duration<double>(Clock::now() - start).count() < seconds) {
  }
}

}  // namespace

// Seen to fail: a timed step that counts for one.
TEST_CASE("profiler: of short steps some are timed and count for all, long ones are all timed",
          "[profiler]") {
  Profiler profiler;
  const auto start = Clock::now();
  for (int k = 0; k < 3200; ++k) {
    const Profiler::Step step(profiler);
    const Profiler::Scope scope(profiler, Phase::Gravity);
    spin(2e-6);
  }
  const double passed = std::chrono::duration<double>(Clock::now() - start).count();
  CHECK(profiler.entry(Phase::Gravity).calls == 3200);
  CHECK(profiler.entry(Phase::Gravity).seconds > 3200 * 2e-6 * 0.98);
  CHECK(profiler.entry(Phase::Gravity).seconds < 16 * passed);  // one of them may have been interrupted

  profiler.reset();
  for (int k = 0; k < 20 + 16; ++k) {
    const Profiler::Step step(profiler);
    const Profiler::Scope scope(profiler, Phase::Damping);
    busy(1);
  }
  CHECK(profiler.entry(Phase::Damping).seconds >= 0.036 - 0.016);  // up to 16 steps were not timed yet
  // Outside steps everything is timed.
  {
    const Profiler::Scope scope(profiler, Phase::Colouring);
    busy(2);
  }
  CHECK(profiler.entry(Phase::Colouring).seconds >= 0.002);
}

// Seen to fail: a timed run that counts for one.
TEST_CASE("profiler: of short runs inside another phase some are timed and count for all", "[profiler]") {
  Profiler profiler;
  const auto start = Clock::now();
  {
    const Profiler::Step step(profiler);
    const Profiler::Scope outer(profiler, Phase::Integration);
    for (int k = 0; k < 3200; ++k) {
      const Profiler::Scope scope(profiler, Phase::Gravity);
      spin(2e-6);
    }
    busy(20);
  }
  const double passed = std::chrono::duration<double>(Clock::now() - start).count();
  const double inner = profiler.entry(Phase::Gravity).seconds;
  const double outer = profiler.entry(Phase::Integration).seconds;
  CHECK(profiler.entry(Phase::Gravity).calls == 3200);
  CHECK(inner > 3180 * 2e-6);
  CHECK(inner < 16 * passed);                   // one of them may have been interrupted
  CHECK(inner + outer >= 0.020 + 3200 * 2e-6);  // and what it is too much is taken from the outer one
  CHECK(inner + outer <= passed);
}

TEST_CASE("profiler: the first run inside another phase is timed in every step", "[profiler]") {
  Profiler profiler;
  for (int k = 0; k < 10; ++k) {
    const Profiler::Step step(profiler);
    const Profiler::Scope outer(profiler, Phase::Integration);
    spin(10e-6);
    const Profiler::Scope scope(profiler, Phase::Gravity);
    spin(1e-6);
  }
  CHECK(profiler.entry(Phase::Gravity).seconds > 10 * 0.98e-6);
}

// Seen to fail: 1 ms of the copy's own phase booked on the original's, by a pointer that outlives it.
TEST_CASE("profiler: a copy made inside a scope is in none", "[profiler]") {
  Profiler profiler;
  {
    const Profiler::Scope outer(profiler, Phase::Gravity);
    Profiler copy = profiler;
    Profiler assigned;
    assigned = profiler;
    for (Profiler* other : {&copy, &assigned}) {
      const Profiler::Scope own(*other, Phase::Damping);
      busy(1);
    }
    CHECK(profiler.entry(Phase::Gravity).seconds == 0.0);  // it still runs
    for (const Profiler& other : {copy, assigned}) {
      CHECK(other.entry(Phase::Gravity).seconds == 0.0);
      CHECK(other.entry(Phase::Gravity).calls == 0);
      CHECK(other.entry(Phase::Damping).seconds >= 0.001);
    }
  }
  CHECK(profiler.entry(Phase::Gravity).seconds >= 0.002);
  CHECK(profiler.entry(Phase::Gravity).calls == 1);
  CHECK(profiler.entry(Phase::Damping).calls == 0);
}

// Seen to fail: 0 s in the copy.
TEST_CASE("profiler: a copy made in a step that is not timed is timed outside of it", "[profiler]") {
  Profiler profiler;
  const auto copyInStep = [&] {
    const Profiler::Step step(profiler);
    return Profiler(profiler);
  };
  copyInStep();  // so short that those after it are not timed
  Profiler copy = copyInStep();
  {
    const Profiler::Scope scope(copy, Phase::Gravity);
    busy(1);
  }
  CHECK(copy.entry(Phase::Gravity).seconds >= 0.001);
}
