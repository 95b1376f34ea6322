#include "picture.hpp"

#ifdef GRAVEL_RUN_PICTURES

#include <algorithm>
#include <array>
#include <iterator>
#include <new>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb_image_write.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

namespace gravel::runner {

namespace {

/// Value below which a share of the values lies.
double quantile(std::vector<double> values, double share) {
  const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

/// Where the body is, and its path where there are trails.
std::vector<Vector3<double>> placesOf(std::size_t i, const Space<double>& space, const Trails& trails) {
  std::vector<Vector3<double>> places{space.body(i).position()};
  const auto found = trails.find(toInteger(space.body(i).id()));
  if (found != trails.end()) {
    std::copy_if(found->second.begin(), found->second.end(), std::back_inserter(places),
                 [](const Vector3<double>& place) { return place.allFinite(); });
  }
  return places;
}

/// The middle of nearly all places: a few bodies that fly off shall not take the eye along.
Vector3<double> middleOf(const Space<double>& space, const Trails& trails) {
  std::array<std::vector<double>, 3> coordinates;
  for (std::size_t i = 0; i < space.n(); ++i) {
    for (const Vector3<double>& place : placesOf(i, space, trails)) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        coordinates[axis].push_back(place[static_cast<Eigen::Index>(axis)]);
      }
    }
  }
  Vector3<double> middle;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double>& x = coordinates[axis];
    middle[static_cast<Eigen::Index>(axis)] =
        space.n() < 20 ? 0.5 * (quantile(x, 0.0) + quantile(x, 1.0)) : quantile(x, 0.5);
  }
  return middle;
}

/// Distance from the target within which nearly all bodies and their paths are.
double reachFrom(const Vector3<double>& target, const Space<double>& space, const Trails& trails) {
  std::vector<double> reaches;
  for (std::size_t i = 0; i < space.n(); ++i) {
    double reach = 0.0;
    for (const Vector3<double>& place : placesOf(i, space, trails)) {
      reach = std::max(reach, (place - target).norm());
    }
    reaches.push_back(reach + space.body(i).radius());
  }
  return quantile(reaches, space.n() < 20 ? 1.0 : 0.97);
}

View viewOf(const Scene& scene, const Space<double>& space, const Trails& trails) {
  const PictureOptions& options = scene.picture;
  View view;
  view.up = options.up.stableNormalized();
  view.fieldOfView = options.fieldOfView;
  view.width = static_cast<int>(options.width);
  view.height = static_cast<int>(options.height);
  view.smallestRadius = options.smallestRadius;
  view.stars = options.stars;
  view.target = options.target ? *options.target : middleOf(space, trails);
  const double upright = std::tan(view.fieldOfView * pi<double>() / 360.0);
  double distance = 0.0;
  if (options.span) {
    distance = 0.5 * *options.span / upright;
  } else {
    // Of the narrower side; a ball is seen whole from outside the cone that touches it.
    const double slope = upright * std::min(1.0, static_cast<double>(view.width) / view.height);
    distance = reachFrom(view.target, space, trails) * std::max(1.15, std::hypot(1.0, slope)) / slope;
  }
  view.eye = view.target + options.direction.stableNormalized() * (distance > 0.0 ? distance : 1.0);
  return view;
}

}  // namespace

bool writePicture(const std::filesystem::path& path, const Scene& scene, const Space<double>& space,
                  const Trails& trails) {
  Picture picture;
  picture.view = viewOf(scene, space, trails);
  double top = -std::numeric_limits<double>::infinity();  // of the bodies: no wall is drawn higher
  for (std::size_t i = 0; i < space.n(); ++i) {
    const auto body = space.body(i);
    const std::uint64_t id = toInteger(body.id());
    const SceneBody* known = sceneBody(scene, body.id());
    const SceneBody look = known != nullptr ? *known : SceneBody{};
    DrawnSphere sphere{body.position(), body.radius(), Quaternion<double>(body.orientation()), look.colour,
                       look.surface};
    if (look.surface == Surface::Rock) {
      const CounterRandom random(id);
      const double shade = random.uniform(0, 0.75, 1.25);
      const double warmth = random.uniform(1, 0.96, 1.04);
      sphere.colour *= Colour(static_cast<float>(shade * warmth), static_cast<float>(shade),
                              static_cast<float>(shade / warmth));
    }
    picture.spheres.push_back(sphere);
    const auto trail = trails.find(id);
    if (trail != trails.end()) {
      picture.trails.push_back({trail->second, sphere.colour});
    }
    top = std::max(top, picture.view.up.dot(sphere.centre) + sphere.radius);
  }
  for (std::size_t i = 0; i < scene.planes.size(); ++i) {
    if (scene.planes[i].colour) {
      const Plane<double>& now = space.planes()[i];  // where it has travelled to
      picture.planes.push_back({now.normal, now.offset, *scene.planes[i].colour, top});
    }
  }

  const std::vector<std::uint8_t> pixels = render(picture);
  std::string png;
  const auto append = [](void* context, void* data, int size) {
    static_cast<std::string*>(context)->append(static_cast<const char*>(data),
                                               static_cast<std::size_t>(size));
  };
  const View& view = picture.view;
  if (stbi_write_png_to_func(append, &png, view.width, view.height, 3, pixels.data(), 3 * view.width) == 0) {
    throw std::bad_alloc();  // all that it can fail by
  }
  detail::writeFileWhole(path, png);
  return true;
}

}  // namespace gravel::runner

#else

#include <cstdio>

namespace gravel::runner {

bool writePicture(const std::filesystem::path&, const Scene&, const Space<double>&, const Trails&) {
  std::fputs("no picture: built without tachyon (Debian, Ubuntu: libtachyon-mt-0-dev)\n", stderr);
  return false;
}

}  // namespace gravel::runner

#endif
