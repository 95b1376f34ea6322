#include "drive.hpp"

namespace gravel::runner {

namespace {

/// Along its normal a plane wants the mean velocity of the step, across it that of the step's end.
Vector3<double> velocityOf(const ScenePlane& plane, double time, double h) {
  const double mean = (plane.swing(time + h) - plane.swing(time)) / h;
  const double end = plane.omega() * std::cos(plane.omega() * (time + h));
  const Vector3<double> along = plane.normal.dot(plane.shake) * plane.normal;
  return plane.velocity + mean * along + end * (plane.shake - along);
}

}  // namespace

Vector3<double> fieldAt(const Scene& scene, double time) {
  const double turns = scene.fieldTurn.norm();
  return turns > 0.0 ? Eigen::AngleAxisd(turns * time, scene.fieldTurn / turns) * scene.field : scene.field;
}

void drive(Space<double>& space, const Scene& scene, double h) {
  const double time = space.time();
  for (std::size_t k = 0; k < scene.planes.size(); ++k) {
    if (scene.planes[k].shakes()) {
      space.setPlaneVelocity(k, velocityOf(scene.planes[k], time, h));
    }
  }
  const Vector3<double> field = fieldAt(scene, time + 0.5 * h);  // that of the middle stands for the step
  if (field != space.uniformField()) {                           // as it is where the run has just begun
    space.setUniformField(field);
  }
}

}  // namespace gravel::runner
