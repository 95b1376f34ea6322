#pragma once

/// \file
/// Spheres, planes and paths as the tachyon ray tracer draws them: sunlight with shadows and skylight with
/// occlusion.

#include <gravel/core/types.hpp>

#include <cstdint>
#include <vector>

namespace gravel::runner {

using Colour = Eigen::Array3f;  ///< red, green, blue, linear, 0 to 1

enum class Surface { Rock, Smooth, Striped, Glowing };

struct DrawnSphere {
  Vector3<double> centre;
  double radius;
  Quaternion<double> orientation;
  Colour colour;
  Surface surface;
};

/// The face of the half-space normal.x >= offset, seen from its free side; bounded by the other planes.
struct DrawnPlane {
  Vector3<double> normal;
  double offset;
  Colour colour;
  double top;  ///< nothing of it is drawn higher than this along `View::up`
};

/// A path drawn as a thin line, faint where it is old, with a gap at each point that is NaN.
struct DrawnTrail {
  std::vector<Vector3<double>> points;
  Colour colour;
};

struct View {
  Vector3<double> eye;
  Vector3<double> target;
  Vector3<double> up;
  double fieldOfView = 35.0;  ///< [degrees], upright
  int width = 1200;
  int height = 900;
  double smallestRadius = 0.0;  ///< [pixels] that a sphere is drawn with at least
  bool stars = false;           ///< a night sky instead of a bright room
};

struct Picture {
  std::vector<DrawnSphere> spheres;
  std::vector<DrawnPlane> planes;
  std::vector<DrawnTrail> trails;
  View view;
};

/// Rows from the top, three bytes a pixel. One thread: tachyon's random numbers, and with them the picture,
/// depend on the number of threads. Not to be called from two threads at once.
std::vector<std::uint8_t> render(const Picture& picture);

}  // namespace gravel::runner
