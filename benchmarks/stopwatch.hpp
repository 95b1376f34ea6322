#pragma once

/// \file
/// Processor time of all threads together, which other programs on the machine disturb less than wall time.

#include <ctime>

class Stopwatch {
 public:
  double nanoseconds() const { return 1e9 * static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC; }

 private:
  std::clock_t start_ = std::clock();
};
