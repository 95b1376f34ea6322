#include "progress.hpp"
#include "text.hpp"

#include <cstdio>

#if defined(__unix__) || defined(__APPLE__)
#include <unistd.h>
#endif

namespace gravel::runner {

namespace {

/// Columns of a terminal. A line that wraps could not be rewritten: it loses parts from its end.
constexpr std::size_t narrowest = 80;

bool isTerminal() {
#if defined(__unix__) || defined(__APPLE__)
  return isatty(STDOUT_FILENO) != 0;
#else
  return false;
#endif
}

}  // namespace

Progress::Progress(const Units& units, double duration, bool quiet, const Space<double>& space)
    : units_(units),
      duration_(duration),
      quiet_(quiet),
      terminal_(isTerminal()),
      pause_(terminal_ ? 0.2 : 5.0),
      lastTime_(space.time()),
      lastSteps_(space.steps()) {}

double Progress::seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

void Progress::show(const Space<double>& space, double drift) {
  if (quiet_) {
    return;
  }
  const double now = seconds();
  if (now - lastShown_ >= pause_) {
    print(space, drift, now);
  }
}

void Progress::finish(const Space<double>& space, double drift) {
  if (!quiet_) {
    print(space, drift, seconds());
    if (terminal_) {
      std::fputc('\n', stdout);
    }
    std::fflush(stdout);
  }
}

void Progress::print(const Space<double>& space, double drift, double now) {
  const double passed = now - lastSeconds_;
  if (passed > 0.05) {
    const double blend = rate_ > 0.0 ? 0.3 : 1.0;
    rate_ += blend * (static_cast<double>(space.steps() - lastSteps_) / passed - rate_);
    timeRate_ += blend * ((space.time() - lastTime_) / passed - timeRate_);
    lastSeconds_ = now;
    lastTime_ = space.time();
    lastSteps_ = space.steps();
  }
  const double rest = duration_ - space.time();
  const std::string left =
      rest <= 0.0 ? "done" : (timeRate_ > 0.0 ? wallTime(rest / timeRate_) + " left" : "starting");
  std::string line =
      format("%5.1f %%  %s  t = %s  step %zu  %zu contacts  drift %+.0e  %.0f steps/s",
             100.0 * space.time() / duration_, left.c_str(), sceneTime(space.time(), units_).c_str(),
             space.steps(), space.contactCount(), drift, rate_);
  while (line.size() >= narrowest && line.rfind("  ") > 0) {
    line.resize(line.rfind("  "));
  }
  std::printf(terminal_ ? "\r\x1b[K%s" : "%s\n", line.c_str());
  std::fflush(stdout);
  lastShown_ = now;
}

}  // namespace gravel::runner
