#include "picture.hpp"

#ifdef GRAVEL_RUN_PICTURES

#include <algorithm>
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

View viewOf(const Scene& scene, const Space<double>& space) {
  const PictureOptions& options = scene.picture;
  View view;
  view.up = options.up.normalized();
  view.fieldOfView = options.fieldOfView;
  view.width = static_cast<int>(options.width);
  view.height = static_cast<int>(options.height);
  view.smallestRadius = options.smallestRadius;
  view.stars = options.stars;

  // The middle and the reach of nearly all bodies: a few that fly off shall not make the rest small.
  view.target = Vector3<double>::Zero();
  const std::size_t n = space.n();
  std::vector<double> values(n);
  if (options.target) {
    view.target = *options.target;
  } else if (n > 0) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < n; ++i) {
        values[i] = space.body(i).position()[axis];
      }
      view.target[axis] =
          n < 20 ? 0.5 * (quantile(values, 0.0) + quantile(values, 1.0)) : quantile(values, 0.5);
    }
  }
  double span = 0.0;
  if (options.span) {
    span = *options.span;
  } else {
    for (std::size_t i = 0; i < n; ++i) {
      values[i] = (space.body(i).position() - view.target).norm() + space.body(i).radius();
    }
    span = n > 0 ? 2.3 * quantile(values, n < 20 ? 1.0 : 0.97) : 1.0;
  }
  const double distance = span / (2.0 * std::tan(view.fieldOfView * pi<double>() / 360.0));
  view.eye = view.target + options.direction.normalized() * (distance > 0.0 ? distance : 1.0);
  return view;
}

}  // namespace

bool writePicture(const std::filesystem::path& path, const Scene& scene, const Space<double>& space,
                  const Trails& trails) {
  Picture picture;
  picture.view = viewOf(scene, space);
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
    top = std::max(top, picture.view.up.dot(sphere.centre) + sphere.radius);
  }
  for (std::size_t i = 0; i < scene.planes.size(); ++i) {
    if (scene.planes[i].colour) {
      const Plane<double>& now = space.planes()[i];  // where it has travelled to
      picture.planes.push_back({now.normal, now.offset, *scene.planes[i].colour, top});
    }
  }
  for (std::size_t i = 0; i < trails.size() && i < picture.spheres.size(); ++i) {
    picture.trails.push_back({trails[i], picture.spheres[i].colour});
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
