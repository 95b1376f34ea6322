#pragma once

/// \file
/// Time by phase, and what was skipped and why.

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>

namespace gravel {

/// The phases of a step, in the order in which they run.
enum class Phase : std::uint8_t {
  Integration,
  NeighbourSearch,
  NarrowPhase,
  Impacts,
  Colouring,
  ContactSolve,
  PositionalCorrection,
  Gravity,
  Damping,
  TimeStep,
  Diagnostics,
};

inline constexpr std::size_t phaseCount = 11;

constexpr const char* phaseName(Phase phase) {
  constexpr std::array<const char*, phaseCount> names{
      "integration",     "neighbour search", "narrow phase", "impacts",   "colouring",  "contact solve",
      "pos. correction", "gravity",          "damping",      "time step", "diagnostics"};
  return names[static_cast<std::size_t>(phase)];
}

/// Adds up wall-clock seconds, calls and skips by phase. Not shared between threads: a phase is entered by
/// the thread that drives the step. Two readings of the clock a phase, about 50 ns; of steps shorter than 8
/// us, which that would slow down by more than a hundredth, one in 16 is timed and counts for all, of those
/// shorter than 0.5 us one in 256. So it is with the runs inside another phase in one step, beyond the first:
/// some methods take thousands of steps of their own.
class Profiler {
 public:
  struct Entry {
    double seconds = 0.0;
    std::uint64_t calls = 0;
    std::uint64_t skips = 0;
    const char* reason = nullptr;  ///< why it was skipped the last time; a string literal
    const char* method = nullptr;  ///< how it was done the last time, where there is a choice; a literal
  };

 private:
  /// Of the runs of a phase inside another one.
  struct Sample {
    std::uint64_t every = 1;    ///< of so many one is timed
    std::uint64_t untimed = 0;  ///< since the last one that was
    std::uint64_t step = 0;     ///< of that one
  };
  using Clock = std::chrono::steady_clock;
  /// Of the scopes that are open now. Those are of one object: a copy, which a hook may make, has none of
  /// them, and would point into an object that may be gone before it.
  struct Present {
    Present() = default;
    Present(const Present& /*other*/) noexcept {}
    // NOLINTNEXTLINE(bugprone-unhandled-self-assignment): nothing is taken from anybody
    Present& operator=(const Present& /*other*/) noexcept { return *this; }
    ~Present() = default;

    Entry* running = nullptr;
    Clock::time_point since{};
    bool timed = true;
    double weight = 1.0;  ///< steps that this one counts for
    double passed = 0.0;  ///< [s] in all phases of this step
  };

 public:
  /// Times the rest of the enclosing scope. Where scopes nest, the outer one's clock stands still meanwhile,
  /// so that the seconds of all phases add up to the time passed.
  class Scope {
   public:
    Scope(Profiler& profiler, Phase phase)
        : profiler_(profiler),
          entry_(profiler.entries_[static_cast<std::size_t>(phase)]),
          sample_(profiler.samples_[static_cast<std::size_t>(phase)]),
          outer_(profiler.now_.running),
          timed_(outer_ == nullptr || !profiler.now_.timed || sample_.untimed + 1 >= sample_.every ||
                 sample_.step != profiler.step_),
          before_(entry_.seconds) {
      if (timed_) {
        profiler_.change(&entry_);
      }
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
    ~Scope() {
      ++entry_.calls;
      if (!timed_) {
        ++sample_.untimed;
        return;
      }
      profiler_.change(outer_);
      if (outer_ != nullptr && outer_ != &entry_ && profiler_.now_.timed) {
        const double own = entry_.seconds - before_;
        const double others = own * static_cast<double>(sample_.untimed);  // were booked on the outer one
        entry_.seconds += others;
        outer_->seconds -= others;
        sample_ = {sampleOf(own / profiler_.now_.weight), 0, profiler_.step_};
      }
    }

   private:
    Profiler& profiler_;
    Entry& entry_;
    Sample& sample_;
    Entry* outer_;
    bool timed_;
    double before_;
  };

  /// Its life is one step; phases outside any step are always timed.
  class Step {
   public:
    explicit Step(Profiler& profiler) : profiler_(profiler) {
      begin();
      profiler_.skipped_ = {};
    }
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;
    ~Step() {
      end();
      profiler_.now_.timed = true;
      profiler_.now_.weight = 1.0;
    }
    /// Another step begins, outside of all phases.
    void next() {
      end();
      begin();
    }

   private:
    void begin() {
      ++profiler_.step_;
      profiler_.now_.timed = profiler_.untimed_ + 1 >= profiler_.every_;
      profiler_.now_.weight = profiler_.now_.timed ? static_cast<double>(profiler_.untimed_ + 1) : 0.0;
      profiler_.now_.passed = 0.0;
    }
    void end() {
      if (profiler_.now_.timed) {
        profiler_.every_ = sampleOf(profiler_.now_.passed);
        profiler_.untimed_ = 0;
      } else {
        ++profiler_.untimed_;
      }
    }

    Profiler& profiler_;
  };

  void skip(Phase phase, const char* reason) {
    Entry& entry = entries_[static_cast<std::size_t>(phase)];
    ++entry.skips;
    entry.reason = reason;
    ++skipped_[static_cast<std::size_t>(phase)];
  }

  /// What was skipped since the begin of the step was in so many steps besides.
  void repeatSkips(std::uint64_t steps) {
    for (std::size_t p = 0; p < phaseCount; ++p) {
      entries_[p].skips += steps * skipped_[p];
    }
  }

  void method(Phase phase, const char* name) { entries_[static_cast<std::size_t>(phase)].method = name; }

  const Entry& entry(Phase phase) const { return entries_[static_cast<std::size_t>(phase)]; }

  void reset() { entries_ = {}; }

  /// One line a phase: seconds, share, calls, skips, the last method and the last reason to skip.
  void print(std::FILE* out) const {
    double total = 0.0;
    for (const Entry& entry : entries_) {
      total += entry.seconds;
    }
    std::fprintf(out, "%-18s %12s %7s %10s %10s  %s\n", "phase", "seconds", "share", "runs", "skips",
                 "last method, last reason to skip");
    for (std::size_t p = 0; p < phaseCount; ++p) {
      const Entry& entry = entries_[p];
      std::fprintf(out, "%-18s %12.6f %6.1f%% %10llu %10llu  %s%s%s\n", phaseName(static_cast<Phase>(p)),
                   entry.seconds, total > 0.0 ? 100.0 * entry.seconds / total : 0.0,
                   static_cast<unsigned long long>(entry.calls), static_cast<unsigned long long>(entry.skips),
                   entry.method != nullptr ? entry.method : "",
                   entry.method != nullptr && entry.reason != nullptr ? ", " : "",
                   entry.reason != nullptr   ? entry.reason
                   : entry.method != nullptr ? ""
                                             : "-");
    }
    std::fprintf(out, "%-18s %12.6f\n", "total", total);
  }

 private:
  /// Of how many runs that take so long [s] one is timed.
  static constexpr std::uint64_t sampleOf(double seconds) {
    return seconds < 0.5e-6 ? 256 : seconds < 8e-6 ? 16 : 1;
  }

  /// Books the time since the last change on the running entry, and lets `next` run.
  void change(Entry* next) {
    if (now_.timed) {
      const Clock::time_point now = Clock::now();
      if (now_.running != nullptr) {
        const double passed = std::chrono::duration<double>(now - now_.since).count();
        now_.running->seconds += passed * now_.weight;
        now_.passed += passed;
      }
      now_.since = now;
    }
    now_.running = next;
  }

  std::array<Entry, phaseCount> entries_{};
  std::array<Sample, phaseCount> samples_{};
  std::array<std::uint64_t, phaseCount> skipped_{};  // times in this step
  Present now_;
  std::uint64_t every_ = 1;    // of so many steps one is timed
  std::uint64_t untimed_ = 0;  // steps since
  std::uint64_t step_ = 0;
};

}  // namespace gravel
