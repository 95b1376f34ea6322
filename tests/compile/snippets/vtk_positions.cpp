// error: gravel: VtkPoints needs positions of three coefficients
#include <gravel/output/vtk.hpp>

#include <vector>

gravel::VtkPoints points(const std::vector<Eigen::Vector3d>& positions) {
  return gravel::VtkPoints(positions);
}

#if GRAVEL_WRONG == 1
gravel::VtkPoints points(const std::vector<double>& radii) { return gravel::VtkPoints(radii); }
#endif
