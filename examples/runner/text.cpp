#include "text.hpp"

#include <array>

namespace gravel::runner {

namespace {

struct Step {
  double size;
  const char* name;
};

/// The largest unit of which there is at least one, when rounded to three digits; the smallest for less.
template <std::size_t N>
std::string inUnit(double x, const std::array<Step, N>& steps) {
  const Step* best = &steps[0];
  for (const Step& step : steps) {
    if (std::abs(x) >= 0.9995 * step.size) {
      best = &step;
    }
  }
  return format("%.3g %s", x / best->size, best->name);
}

}  // namespace

std::string wallTime(double seconds) {
  constexpr double year = 365.25 * 86400.0;
  if (!(seconds < year)) {
    return format("%.2g years", seconds / year);
  }
  const auto whole = static_cast<long long>(seconds + 0.5);
  if (whole < 60) {
    return seconds < 10 ? format("%.1f s", seconds) : format("%lld s", whole);
  }
  if (whole < 3600) {
    return format("%lld min %lld s", whole / 60, whole % 60);
  }
  return format("%lld h %lld min", whole / 3600, whole / 60 % 60);
}

std::string sceneTime(double time, const Units& units) {
  if (units.time != "s") {
    return format("%.5g %s", time, units.time.c_str());
  }
  return inUnit<6>(time, {{{1e-6, "us"}, {1e-3, "ms"}, {1, "s"}, {60, "min"}, {3600, "h"}, {86400, "d"}}});
}

std::string sceneLength(double length, const Units& units) {
  if (units.length != "m") {
    return format("%.4g %s", length, units.length.c_str());
  }
  return inUnit<4>(length, {{{1e-6, "um"}, {1e-3, "mm"}, {1, "m"}, {1e3, "km"}}});
}

std::string counted(std::size_t n, const char* one, const char* many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

}  // namespace gravel::runner
