#pragma once

/// Runs a scope with a given number of threads.

#include <omp.h>

namespace gravel::test {

class WithThreads {
 public:
  explicit WithThreads(int n) : before_(omp_get_max_threads()) { omp_set_num_threads(n); }
  WithThreads(const WithThreads&) = delete;
  WithThreads& operator=(const WithThreads&) = delete;
  ~WithThreads() { omp_set_num_threads(before_); }

 private:
  int before_;
};

}  // namespace gravel::test
