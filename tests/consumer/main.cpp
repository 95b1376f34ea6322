// A ball falls on a plane. The second file uses the same headers, so that a definition that is not inline
// fails to link.
#include <gravel/gravel.hpp>

#include <cstdio>

double heightAfter(double seconds);

int main() {
  // 1.9 m of free fall under 9.81 m s^-2 last 0.62 s; velocity Verlet is exact under a constant acceleration.
  const double height = heightAfter(0.5);
  const double expected = 2.0 - 0.5 * 9.81 * 0.5 * 0.5;
  std::printf("gravel %d.%d.%d: height %.12g m, expected %.12g m\n", gravel::version.major,
              gravel::version.minor, gravel::version.patch, height, expected);
  const double difference = height - expected;
  // 500 steps, each with a rounding error of about 1e-16 relative to 2 m.
  return difference < 1e-12 && difference > -1e-12 ? 0 : 1;
}
