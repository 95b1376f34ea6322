// error: gravel: VtkPoints needs positions of three coefficients
// error: gravel: VtkPoints needs scalars that static_cast or a member value() makes a double of
#include <gravel/output/vtk.hpp>

#include <vector>

gravel::VtkPoints points(const std::vector<Eigen::Vector3d>& positions) {
  return gravel::VtkPoints(positions);
}

struct Dual {
  double value() const { return real; }
  double real, derivative;
};
void add(gravel::VtkPoints& points, const std::vector<Dual>& masses) { points.add("mass", masses); }

#if GRAVEL_WRONG == 1
gravel::VtkPoints points(const std::vector<double>& radii) { return gravel::VtkPoints(radii); }
#endif
#if GRAVEL_WRONG == 2
struct Closed {
  double real;
};
void add(gravel::VtkPoints& points, const std::vector<Closed>& masses) { points.add("mass", masses); }
#endif
