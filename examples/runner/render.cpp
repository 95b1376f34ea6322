#include "render.hpp"
#include <gravel/core/random.hpp>

#include <tachyon.h>

#include <algorithm>
#include <cmath>

namespace gravel::runner {

namespace {

void saysNothing(int, char*) {}
void showsNothing(int) {}

apivector vectorOf(const Vector3<double>& x) { return {x[0], x[1], x[2]}; }
apicolor colourOf(const Colour& c) { return {c[0], c[1], c[2]}; }

/// tachyon itself, for as long as one picture takes.
class Tachyon {
 public:
  Tachyon() {
    rt_set_ui_message(saysNothing);
    rt_set_ui_progress(showsNothing);
    int count = 1;
    char name[] = "gravel-run";
    char* arguments[] = {name, nullptr};
    char** list = arguments;
    rt_initialize(&count, &list);
    scene = rt_newscene();
  }
  ~Tachyon() {
    rt_deletescene(scene);
    rt_finalize();
  }
  Tachyon(const Tachyon&) = delete;
  Tachyon& operator=(const Tachyon&) = delete;

  SceneHandle scene = nullptr;
};

class Renderer {
 public:
  explicit Renderer(const Picture& picture)
      : picture_(picture),
        view_(picture.view),
        // All lengths in units of the distance to the target, so that kilometres and micrometres look alike.
        unit_((view_.eye - view_.target).norm()),
        back_((view_.eye - view_.target) / unit_),
        right_(view_.up.cross(back_).normalized()),
        up_(back_.cross(right_)),
        sceneUp_(view_.up.normalized()),
        halfHeight_(std::tan(view_.fieldOfView * pi<double>() / 360.0)) {}

  std::vector<std::uint8_t> run() {
    setCamera();
    setLight();
    if (view_.stars) {
      addStars();
    }
    for (const DrawnSphere& sphere : picture_.spheres) {
      addSphere(sphere);
    }
    for (const DrawnTrail& trail : picture_.trails) {
      addTrail(trail);
    }
    for (const DrawnPlane& plane : picture_.planes) {
      addPlane(plane);
    }
    return pixels();
  }

 private:
  Vector3<double> local(const Vector3<double>& x) const { return (x - view_.target) / unit_; }

  /// Size of a pixel at this point.
  double pixelAt(const Vector3<double>& x) const {
    return 2.0 * halfHeight_ / view_.height * std::max(0.0, (back_ - x).dot(back_));
  }

  void setCamera() {
    rt_outputfile(scene(), "");  // else it writes a file of its own as well
    rt_resolution(scene(), view_.width, view_.height);
    rt_set_numthreads(scene(), 1);
    rt_aa_maxsamples(scene(), 5);
    rt_camera_projection(scene(), RT_PROJECTION_PERSPECTIVE);
    rt_camera_position(scene(), vectorOf(back_), vectorOf(-back_), vectorOf(up_));
    const double halfWidth = halfHeight_ * view_.width / view_.height;
    rt_camera_frustum(scene(), halfWidth, -halfWidth, -halfHeight_, halfHeight_);  // else left is right
    rt_camera_raydepth(scene(), 4);
  }

  Colour skyBelow() const {
    return view_.stars ? Colour(0.003F, 0.0035F, 0.006F) : Colour(0.46F, 0.50F, 0.56F);
  }

  void setLight() {
    rt_shadermode(scene(), RT_SHADER_FULL);
    rt_shadow_filtering(scene(), 0);  // trails, not quite opaque, have no shadow
    rt_trans_mode(scene(), RT_TRANS_VMD);
    rt_phong_shader(scene(), RT_SHADER_PHONG);
    const Vector3<double> toSun = view_.stars ? Vector3<double>(-0.75 * right_ + 0.45 * up_ + 0.55 * back_)
                                              : Vector3<double>(sceneUp_ - 0.35 * right_ + 0.35 * back_);
    const Colour sunlight = Colour(1.0F, 0.95F, 0.87F) * (view_.stars ? 2.2F : 1.1F);
    rt_directional_light(scene(), texture(sunlight, 0.0, 1.0), vectorOf(-toSun.normalized()));
    const Colour skylight = view_.stars ? Colour(0.10F, 0.11F, 0.14F) : Colour(0.42F, 0.46F, 0.52F);
    rt_ambient_occlusion(scene(), view_.stars ? 4 : 8, colourOf(skylight));

    const Colour low = skyBelow();
    const Colour high = view_.stars ? low : Colour(0.72F, 0.79F, 0.87F);
    rt_background(scene(), colourOf(low));
    rt_background_gradient(scene(), vectorOf(sceneUp_), 1.0, -1.0, colourOf(high), colourOf(low));
    rt_background_mode(scene(), RT_BACKGROUND_TEXTURE_SKY_SPHERE);
  }

  void* texture(const Colour& colour, double ambient, double diffuse, double opacity = 1.0) {
    apitexture t{};
    t.texturefunc = RT_TEXTURE_CONSTANT;
    t.col = colourOf(colour);
    t.shadowcast = 1;
    t.ambient = ambient;
    t.diffuse = diffuse;
    t.opacity = opacity;
    return rt_texture(scene(), &t);
  }

  void* gloss(void* texture) {
    rt_tex_phong(texture, 0.5, 90.0, RT_PHONG_PLASTIC);
    return texture;
  }

  void addSphere(const DrawnSphere& s) {
    const Vector3<double> centre = local(s.centre);
    constexpr double pointSize = 1.5;  // [pixels]
    const double least = s.radius > 0.0 ? view_.smallestRadius : std::max(view_.smallestRadius, pointSize);
    const double radius = std::max(s.radius / unit_, least * pixelAt(centre));
    const auto add = [&](void* look, double r) { rt_sphere(scene(), look, vectorOf(centre), r); };
    if (s.surface == Surface::Glowing) {
      add(texture(s.colour, 1.0, 0.0), radius);
    } else if (s.surface == Surface::Rock) {
      add(texture(s.colour, 0.0, 1.0), radius);
    } else {
      add(gloss(texture(s.colour, 0.0, 1.0)), radius);
      // White caps, a hair larger than the ball: the dot on one side shows how a plain ball turns.
      void* white = gloss(texture(Colour(0.86F, 0.83F, 0.74F), 0.0, 1.0));
      const auto cap = [&](const Vector3<double>& axis, double height) {
        const Vector3<double> a = s.orientation * axis;
        clip({{-a, -a.dot(centre) - height * radius}});
        add(white, 1.0005 * radius);
        rt_clip_off(scene());
      };
      cap(Vector3<double>::UnitX(), 0.93);
      if (s.surface == Surface::Striped) {
        cap(Vector3<double>::UnitZ(), 0.55);
        cap(-Vector3<double>::UnitZ(), 0.55);
      }
    }
  }

  /// Far behind the bodies, most of them faint.
  void addStars() {
    constexpr double distance = 40.0;
    const CounterRandom random(77);
    for (std::uint64_t i = 0; i < 400; ++i) {
      const double y = random.uniform(4 * i, -1.0, 1.0) * halfHeight_;
      const double x = random.uniform(4 * i + 1, -1.0, 1.0) * halfHeight_ * view_.width / view_.height;
      const Vector3<double> place = back_ + distance * (x * right_ + y * up_ - back_);
      const double brightness = std::pow(random.uniform(4 * i + 2), 3.0);
      rt_sphere(scene(), texture(Colour(1.0F, 0.96F, 0.9F) * static_cast<float>(brightness), 1.0, 0.0),
                vectorOf(place), (0.5 + 0.5 * brightness) * pixelAt(place));
    }
  }

  struct HalfSpace {
    Vector3<double> normal;
    double most;
  };

  /// Of what is added next, only the part in all of normal.x <= most is drawn.
  void clip(const std::vector<HalfSpace>& parts) {
    std::vector<double> numbers;
    for (const HalfSpace& part : parts) {
      numbers.insert(numbers.end(), {part.normal[0], part.normal[1], part.normal[2], part.most});
    }
    rt_clip_dv(scene(), static_cast<int>(parts.size()), numbers.data());
  }

  void addPlane(const DrawnPlane& plane) {
    const auto offset = [&](const DrawnPlane& p) { return (p.offset - p.normal.dot(view_.target)) / unit_; };
    if (plane.normal.dot(back_) <= offset(plane)) {
      return;  // seen from behind
    }
    std::vector<HalfSpace> parts{{sceneUp_, (plane.top - sceneUp_.dot(view_.target)) / unit_}};
    for (const DrawnPlane& other : picture_.planes) {
      if (&other != &plane) {
        parts.push_back({-other.normal, 1e-5 - offset(other)});
      }
    }
    clip(parts);
    rt_plane(scene(), texture(plane.colour, 0.0, 1.0), vectorOf(offset(plane) * plane.normal),
             vectorOf(plane.normal));
    rt_clip_off(scene());
  }

  /// In pieces of one colour and thickness each; a body that stands still draws nothing.
  void addTrail(const DrawnTrail& trail) {
    constexpr std::size_t pieces = 24;
    std::vector<apivector> corners;
    Vector3<double> last = Vector3<double>::Zero();
    bool goesOn = false;
    std::size_t begin = 0;
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      const std::size_t end = trail.points.size() * (piece + 1) / pieces;
      const float age = static_cast<float>(piece + 1) / static_cast<float>(pieces);  // 1: now
      const float strength = 0.15F + 0.85F * age * age;
      const Colour colour = trail.colour * strength + skyBelow() * (1.0F - strength);
      double pixel = 0.0;
      const auto draw = [&] {
        if (corners.size() > 1 && pixel > 0.0) {
          rt_polycylinder(scene(), texture(colour, 1.0, 0.0, 0.97), corners.data(),
                          static_cast<int>(corners.size()), 0.7 * pixel);
        }
        corners.clear();
      };
      if (goesOn) {
        corners.push_back(vectorOf(last));
      }
      for (; begin < end; ++begin) {
        const Vector3<double> x = local(trail.points[begin]);
        if (!x.allFinite()) {
          draw();
          goesOn = false;
          continue;
        }
        pixel = pixelAt(x);
        if (!goesOn || (x - last).norm() > 4.0 * pixel) {
          corners.push_back(vectorOf(x));
          last = x;
          goesOn = true;
        }
      }
      draw();
    }
  }

  std::vector<std::uint8_t> pixels() {
    const std::size_t row = 3 * static_cast<std::size_t>(view_.width);
    std::vector<float> light(row * static_cast<std::size_t>(view_.height));
    rt_rawimage_rgb96f(scene(), light.data());
    rt_renderscene(scene());
    std::vector<std::uint8_t> bytes;
    bytes.reserve(light.size());
    for (std::size_t end = light.size(); end > 0; end -= row) {  // tachyon's rows begin at the bottom
      for (std::size_t i = end - row; i < end; ++i) {
        const float x = std::clamp(light[i], 0.0F, 1.0F);
        const float srgb = x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
        bytes.push_back(static_cast<std::uint8_t>(srgb * 255.0F + 0.5F));
      }
    }
    return bytes;
  }

  SceneHandle scene() const { return tachyon_.scene; }

  const Picture& picture_;
  const View& view_;
  double unit_;
  Vector3<double> back_, right_, up_, sceneUp_;
  double halfHeight_;
  Tachyon tachyon_;
};

}  // namespace

std::vector<std::uint8_t> render(const Picture& picture) { return Renderer(picture).run(); }

}  // namespace gravel::runner
