#include "render.hpp"
#include <gravel/core/parallel.hpp>

#include <algorithm>
#include <numeric>

namespace gravel::runner {

namespace {

using Vec = Vector3<float>;

constexpr float farAway = std::numeric_limits<float>::max();

/// A hash to 32 bits (Jarzynski & Olano 2020, JCGT 9(3), "pcg").
std::uint32_t hash(std::uint32_t x) {
  x = x * 747796405U + 2891336453U;
  x = ((x >> ((x >> 28U) + 4U)) ^ x) * 277803737U;
  return (x >> 22U) ^ x;
}

float unit(std::uint32_t bits) { return static_cast<float>(bits >> 8U) * 0x1p-24F; }

struct Noise {
  float value = 0.0F;
  Vec slope = Vec::Zero();
};

/// Smooth noise in [-1, 1] with its gradient: random values at the points of a lattice, blended.
Noise latticeNoise(const Vec& x, std::uint32_t seed) {
  std::array<float, 3> f{};
  std::array<float, 3> df{};
  std::array<std::uint32_t, 3> cell{};
  for (std::size_t k = 0; k < 3; ++k) {
    const float base = std::floor(x[static_cast<Eigen::Index>(k)]);
    const float t = x[static_cast<Eigen::Index>(k)] - base;
    f[k] = t * t * (3.0F - 2.0F * t);
    df[k] = 6.0F * t * (1.0F - t);
    cell[k] = static_cast<std::uint32_t>(static_cast<std::int32_t>(base));
  }
  Noise noise;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    std::array<float, 3> weight{};
    std::array<float, 3> change{};
    std::uint32_t h = seed;
    for (std::size_t k = 0; k < 3; ++k) {
      const bool upper = ((corner >> k) & 1U) != 0;
      weight[k] = upper ? f[k] : 1.0F - f[k];
      change[k] = upper ? df[k] : -df[k];
      h = hash(h ^ (cell[k] + (upper ? 1U : 0U)));
    }
    const float value = 2.0F * unit(h) - 1.0F;
    noise.value += value * weight[0] * weight[1] * weight[2];
    noise.slope += value * Vec(change[0] * weight[1] * weight[2], weight[0] * change[1] * weight[2],
                               weight[0] * weight[1] * change[2]);
  }
  return noise;
}

Noise rockNoise(const Vec& x, std::uint32_t seed) {
  Noise sum;
  float share = 0.55F;
  float frequency = 1.7F;
  for (std::uint32_t octave = 0; octave < 3; ++octave) {
    const Noise part = latticeNoise(frequency * x, seed + octave);
    sum.value += share * part.value;
    sum.slope += share * frequency * part.slope;
    share *= 0.52F;
    frequency *= 2.35F;
  }
  return sum;
}

struct Ray {
  Vec origin;
  Vec direction;
};

struct Hit {
  float distance = farAway;
  int sphere = -1;
  int plane = -1;
  bool any() const { return sphere >= 0 || plane >= 0; }
};

/// Spheres in a hierarchy of boxes, split at the median of the longest side.
class SphereTree {
 public:
  explicit SphereTree(std::vector<Eigen::Vector4f> spheres) : spheres_(std::move(spheres)) {
    order_.resize(spheres_.size());
    std::iota(order_.begin(), order_.end(), 0);
    if (!spheres_.empty()) {
      build(0, static_cast<int>(spheres_.size()));
    }
  }

  /// The first sphere along the ray before hit.distance.
  void nearest(const Ray& ray, Hit& hit) const {
    walk(ray, hit.distance, [&](int i, float t) {
      hit.distance = t;
      hit.sphere = i;
      return false;
    });
  }

  bool blocked(const Ray& ray, float reach) const {
    bool found = false;
    float limit = reach;
    walk(ray, limit, [&](int, float) { return found = true; });
    return found;
  }

 private:
  struct Node {
    Vec low, high;
    int begin, end;  // of a leaf's spheres
    int right;       // second child; the first follows its parent; 0 for a leaf
  };

  int build(int begin, int end) {
    const auto self = static_cast<int>(nodes_.size());
    Node node{Vec::Constant(farAway), Vec::Constant(-farAway), begin, end, 0};
    Vec low = node.low, high = node.high;
    for (int i = begin; i < end; ++i) {
      const Eigen::Vector4f& s = sphere(i);
      const Vec centre = s.head<3>();
      node.low = node.low.cwiseMin(centre - Vec::Constant(s[3]));
      node.high = node.high.cwiseMax(centre + Vec::Constant(s[3]));
      low = low.cwiseMin(centre);
      high = high.cwiseMax(centre);
    }
    nodes_.push_back(node);
    if (end - begin > 4) {
      Eigen::Index axis = 0;
      (high - low).maxCoeff(&axis);
      const int middle = begin + (end - begin) / 2;
      std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                       [&](int a, int b) {
                         return std::pair(spheres_[static_cast<std::size_t>(a)][axis], a) <
                                std::pair(spheres_[static_cast<std::size_t>(b)][axis], b);
                       });
      build(begin, middle);
      nodes_[static_cast<std::size_t>(self)].right = build(middle, end);
    }
    return self;
  }

  const Eigen::Vector4f& sphere(int i) const {
    return spheres_[static_cast<std::size_t>(order_[static_cast<std::size_t>(i)])];
  }

  /// Calls visit(sphere, distance) for hits before `limit`, which visit may lower; ends when it returns true.
  template <class Visit>
  void walk(const Ray& ray, const float& limit, Visit&& visit) const {
    if (nodes_.empty()) {
      return;
    }
    const Vec inverse = ray.direction.cwiseInverse();
    std::array<int, 64> stack{};
    int depth = 0;
    stack[0] = 0;
    while (depth >= 0) {
      const int index = stack[static_cast<std::size_t>(depth--)];
      const Node& node = nodes_[static_cast<std::size_t>(index)];
      const Vec a = (node.low - ray.origin).cwiseProduct(inverse);
      const Vec b = (node.high - ray.origin).cwiseProduct(inverse);
      const float enter = std::max(0.0F, a.cwiseMin(b).maxCoeff());
      if (enter > std::min(limit, a.cwiseMax(b).minCoeff())) {
        continue;
      }
      if (node.right != 0) {
        stack[static_cast<std::size_t>(++depth)] = node.right;
        stack[static_cast<std::size_t>(++depth)] = index + 1;
        continue;
      }
      for (int i = node.begin; i < node.end; ++i) {
        const Eigen::Vector4f& s = sphere(i);
        const Vec d = s.head<3>() - ray.origin;
        const float along = d.dot(ray.direction);
        const float miss_sq = (d - along * ray.direction).squaredNorm();
        const float half_sq = s[3] * s[3] - miss_sq;
        if (half_sq > 0.0F) {
          const float t = along - std::sqrt(half_sq);
          if (t > 0.0F && t < limit && visit(order_[static_cast<std::size_t>(i)], t)) {
            return;
          }
        }
      }
    }
  }

  std::vector<Eigen::Vector4f> spheres_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

class Renderer {
 public:
  explicit Renderer(const Picture& picture)
      : picture_(picture),
        view_(picture.view),
        // All lengths in units of the distance to the target, so that kilometres and micrometres look alike.
        unit_((view_.eye - view_.target).norm()),
        back_(((view_.eye - view_.target) / unit_).cast<float>()),
        right_(view_.up.cast<float>().cross(back_).normalized()),
        up_(back_.cross(right_)),
        sceneUp_(view_.up.normalized().cast<float>()),
        sun_((view_.stars ? Vec(-0.75F * right_ + 0.45F * up_ + 0.55F * back_)
                          : Vec(sceneUp_ - 0.35F * right_ + 0.35F * back_))
                 .normalized()),
        halfHeight_(static_cast<float>(std::tan(view_.fieldOfView * pi<double>() / 360.0))),
        tree_(gather()) {
    for (const DrawnPlane& plane : picture.planes) {
      offsets_.push_back(static_cast<float>((plane.offset - plane.normal.dot(view_.target)) / unit_));
      tops_.push_back(static_cast<float>((plane.top - view_.up.normalized().dot(view_.target)) / unit_));
      normals_.push_back(plane.normal.cast<float>());
    }
  }

  std::vector<std::uint8_t> run() {
    const auto pixels = static_cast<std::size_t>(view_.width) * static_cast<std::size_t>(view_.height);
    colours_.assign(pixels, Colour::Zero());
    depths_.assign(pixels, farAway);
    parallelFor(static_cast<std::size_t>(view_.height), 4, [&](std::size_t row) {
      for (int column = 0; column < view_.width; ++column) {
        drawPixel(column, static_cast<int>(row));
      }
    });
    for (const DrawnTrail& trail : picture_.trails) {
      drawTrail(trail);
    }
    std::vector<std::uint8_t> bytes;
    bytes.reserve(3 * pixels);
    for (const Colour& colour : colours_) {
      for (int k = 0; k < 3; ++k) {
        // Filmic shoulder (Hable's spirit, one term), then the sRGB curve.
        const float x = std::max(0.0F, colour[k]);
        const float mapped = x * (1.0F + 0.12F * x) / (1.0F + x * 0.55F);
        const float srgb =
            mapped <= 0.0031308F ? 12.92F * mapped : 1.055F * std::pow(mapped, 1 / 2.4F) - 0.055F;
        bytes.push_back(static_cast<std::uint8_t>(std::clamp(srgb, 0.0F, 1.0F) * 255.0F + 0.5F));
      }
    }
    return bytes;
  }

 private:
  static constexpr int grid = 3;  // samples a pixel: grid x grid

  Vec local(const Vector3<double>& x) const { return ((x - view_.target) / unit_).cast<float>(); }

  std::vector<Eigen::Vector4f> gather() const {
    std::vector<Eigen::Vector4f> spheres;
    const float pixel = 2.0F * halfHeight_ / static_cast<float>(view_.height);
    for (const DrawnSphere& s : picture_.spheres) {
      const Vec centre = local(s.centre);
      const float least = static_cast<float>(view_.smallestRadius) * pixel * (back_ - centre).dot(back_);
      spheres.emplace_back(centre[0], centre[1], centre[2],
                           std::max(static_cast<float>(s.radius / unit_), least));
    }
    return spheres;
  }

  Ray through(float column, float row) const {
    const float y = halfHeight_ * (1.0F - 2.0F * row / static_cast<float>(view_.height));
    const float x =
        halfHeight_ * (2.0F * column - static_cast<float>(view_.width)) / static_cast<float>(view_.height);
    return {back_, Vec(x * right_ + y * up_ - back_).normalized()};
  }

  void drawPixel(int column, int row) {
    const auto index = static_cast<std::size_t>(row) * static_cast<std::size_t>(view_.width) +
                       static_cast<std::size_t>(column);
    Colour sum = Colour::Zero();
    for (int sample = 0; sample < grid * grid; ++sample) {
      const std::uint32_t seed =
          hash(static_cast<std::uint32_t>(index) * 9781U + static_cast<std::uint32_t>(sample));
      const Ray ray = through(static_cast<float>(column) + (static_cast<float>(sample % grid) + 0.5F) / grid,
                              static_cast<float>(row) + (static_cast<float>(sample / grid) + 0.5F) / grid);
      const Hit hit = trace(ray);
      sum += hit.any() ? shade(ray, hit, seed, sample) : sky(ray.direction);
      depths_[index] = std::min(depths_[index], hit.distance);
    }
    colours_[index] = sum / static_cast<float>(grid * grid);
  }

  Hit trace(const Ray& ray) const {
    Hit hit;
    for (std::size_t p = 0; p < normals_.size(); ++p) {
      const float facing = -normals_[p].dot(ray.direction);
      const float height = normals_[p].dot(ray.origin) - offsets_[p];
      if (facing > 0.0F && height > 0.0F && height < hit.distance * facing &&
          insideOthers(ray.origin + ray.direction * (height / facing), p)) {
        hit.distance = height / facing;
        hit.plane = static_cast<int>(p);
      }
    }
    tree_.nearest(ray, hit);
    return hit;
  }

  bool insideOthers(const Vec& x, std::size_t plane) const {
    if (sceneUp_.dot(x) > tops_[plane]) {
      return false;
    }
    for (std::size_t q = 0; q < normals_.size(); ++q) {
      if (q != plane && normals_[q].dot(x) < offsets_[q] - 1e-5F) {
        return false;
      }
    }
    return true;
  }

  Colour sky(const Vec& direction) const {
    if (!view_.stars) {
      const float height = 0.5F + 0.5F * direction.dot(sceneUp_);
      return Colour(0.62F, 0.68F, 0.75F) * (0.75F + 0.55F * height);
    }
    // A star a cell of a fine grid on the sphere of directions, few of them bright.
    const Vec x = direction * 260.0F;
    const Vec cell = x.array().round().matrix();
    std::uint32_t h = 77;
    for (int k = 0; k < 3; ++k) {
      h = hash(h ^ static_cast<std::uint32_t>(static_cast<std::int32_t>(cell[k])));
    }
    const float brightness = std::pow(unit(h), 150.0F);
    const float glow = std::exp(-22.0F * (x - cell).squaredNorm());
    return Colour(0.003F, 0.0035F, 0.006F) + Colour(1.0F, 0.96F, 0.9F) * (1.2F * brightness * glow);
  }

  Colour shade(const Ray& ray, const Hit& hit, std::uint32_t seed, int sample) const {
    const Vec x = ray.origin + ray.direction * hit.distance;
    Vec normal;
    Vec face;
    Colour colour;
    float gloss = 0.0F;
    if (hit.sphere >= 0) {
      const DrawnSphere& s = picture_.spheres[static_cast<std::size_t>(hit.sphere)];
      normal = face = (x - local(s.centre)).normalized();
      if (s.surface == Surface::Glowing) {
        return s.colour * 2.2F;
      }
      const Vec own = s.orientation.conjugate().cast<float>() * face;
      if (s.surface == Surface::Rock) {
        // The slope of the noise tilts the normal, its height shades the stone.
        const Noise noise = rockNoise(own, s.seed);
        const Vec tilt = s.orientation.cast<float>() * noise.slope;
        normal = (normal - 0.16F * (tilt - tilt.dot(face) * face)).normalized();
        colour = s.colour * std::clamp(0.9F + 0.5F * noise.value, 0.4F, 1.3F);
      } else {
        colour = ballColour(s, own);
        gloss = 0.5F;
      }
    } else {
      const auto p = static_cast<std::size_t>(hit.plane);
      normal = face = normals_[p];
      colour = picture_.planes[p].colour;
    }

    const Ray toSun{x + face * 2e-4F, sunSample(seed)};
    const float facing = std::max(0.0F, normal.dot(toSun.direction));
    const bool lit = facing > 0.0F && face.dot(toSun.direction) > 0.0F && !tree_.blocked(toSun, farAway);
    const Ray toSky{x + face * 2e-4F, skySample(face, seed, sample)};
    const float open = tree_.blocked(toSky, 0.5F) ? 0.0F : 1.0F;

    const float sunlight = view_.stars ? 3.4F : 1.6F;
    const Colour skylight = view_.stars ? Colour(0.10F, 0.11F, 0.14F)
                                        : Colour(0.42F, 0.46F, 0.52F) * (1.1F + 0.3F * face.dot(sceneUp_));
    Colour light = skylight * open;
    if (lit) {
      light += Colour(1.0F, 0.95F, 0.87F) * (sunlight * facing);
    }
    Colour result = colour * light;
    if (gloss > 0.0F && lit) {
      const Vec half = (toSun.direction - ray.direction).normalized();
      result += Colour::Constant(gloss * std::pow(std::max(0.0F, half.dot(normal)), 90.0F) * sunlight);
    }
    if (hit.plane >= 0 && !view_.stars) {
      // A floor without an end fades into the room.
      const float haze = 1.0F - std::exp(-std::max(0.0F, hit.distance - 1.6F) * 0.6F);
      result = result * (1.0F - haze) + sky(ray.direction) * haze;
    }
    return result;
  }

  static Colour ballColour(const DrawnSphere& s, const Vec& own) {
    const bool stripe = s.surface == Surface::Striped && std::abs(own[2]) > 0.55F;
    const bool dot = own[0] > 0.93F;  // shows how a plain ball turns
    return stripe || dot ? Colour(0.86F, 0.83F, 0.74F) : s.colour;
  }

  /// A direction within the sun's disc, wide enough for soft edges.
  Vec sunSample(std::uint32_t seed) const {
    const float angle = 2.0F * pi<float>() * unit(hash(seed + 11U));
    const float radius = 0.035F * std::sqrt(unit(hash(seed + 12U)));
    return (sun_ + radius * std::cos(angle) * right_ + radius * std::sin(angle) * up_).normalized();
  }

  /// Cosine-weighted over the hemisphere; the samples of a pixel take turns around the normal.
  Vec skySample(const Vec& normal, std::uint32_t seed, int sample) const {
    const float turn =
        (static_cast<float>(sample) + unit(hash(seed + 21U))) / static_cast<float>(grid * grid);
    const float angle = 2.0F * pi<float>() * turn;
    const float r_sq = unit(hash(seed + 22U));
    const Vec a = normal.unitOrthogonal();
    const Vec b = normal.cross(a);
    const float r = std::sqrt(r_sq);
    return r * std::cos(angle) * a + r * std::sin(angle) * b + std::sqrt(1.0F - r_sq) * normal;
  }

  /// Screen place and distance of a point; false behind the eye.
  bool project(const Vec& x, Eigen::Vector2f& place, float& distance) const {
    const Vec d = x - back_;
    const float depth = -d.dot(back_);
    if (depth <= 1e-3F) {
      return false;
    }
    const float scale = static_cast<float>(view_.height) / (2.0F * halfHeight_ * depth);
    place = {static_cast<float>(view_.width) / 2.0F + d.dot(right_) * scale,
             static_cast<float>(view_.height) / 2.0F - d.dot(up_) * scale};
    distance = d.norm();
    return true;
  }

  void drawTrail(const DrawnTrail& trail) {
    Eigen::Vector2f a = Eigen::Vector2f::Zero();
    float near = -1.0F;  // distance of the last corner drawn; negative before there is one
    for (std::size_t i = 0; i < trail.points.size(); ++i) {
      Eigen::Vector2f b;
      float far = 0.0F;
      if (!project(local(trail.points[i]), b, far)) {
        near = -1.0F;
      } else if (near < 0.0F) {
        a = b;
        near = far;
      } else if ((b - a).squaredNorm() > 1.0F) {  // a body that stands still draws nothing
        const float age = static_cast<float>(i) / static_cast<float>(trail.points.size());
        drawLine(a, b, std::min(near, far), trail.colour, 0.15F + 0.6F * age * age);
        a = b;
        near = far;
      }
    }
  }

  /// A line of about one and a half pixels, blended by how near each pixel's middle is to it.
  void drawLine(const Eigen::Vector2f& a, const Eigen::Vector2f& b, float distance, const Colour& colour,
                float strength) {
    const Eigen::Vector2f low = a.cwiseMin(b), high = a.cwiseMax(b);
    const auto bound = [](float x, int most) {
      return static_cast<int>(std::clamp(x, 0.0F, static_cast<float>(most)));
    };
    const Eigen::Vector2f along = b - a;
    const float length_sq = std::max(along.squaredNorm(), 1e-12F);
    for (int row = bound(low[1] - 2.0F, view_.height); row < bound(high[1] + 3.0F, view_.height); ++row) {
      for (int column = bound(low[0] - 2.0F, view_.width); column < bound(high[0] + 3.0F, view_.width);
           ++column) {
        const Eigen::Vector2f x(static_cast<float>(column) + 0.5F, static_cast<float>(row) + 0.5F);
        const float t = (x - a).dot(along) / length_sq;
        if (t < 0.0F || t >= 1.0F) {
          continue;  // the next piece goes on from there
        }
        const float cover = std::clamp(1.25F - (x - a - t * along).norm(), 0.0F, 1.0F) * strength;
        const auto index = static_cast<std::size_t>(row) * static_cast<std::size_t>(view_.width) +
                           static_cast<std::size_t>(column);
        if (cover > 0.0F && distance < depths_[index]) {
          colours_[index] = colours_[index] * (1.0F - cover) + colour * cover;
        }
      }
    }
  }

  const Picture& picture_;
  const View& view_;
  double unit_;
  Vec back_, right_, up_, sceneUp_, sun_;
  float halfHeight_;
  SphereTree tree_;
  std::vector<float> offsets_, tops_;
  std::vector<Vec> normals_;
  std::vector<Colour> colours_;
  std::vector<float> depths_;
};

}  // namespace

std::vector<std::uint8_t> render(const Picture& picture) { return Renderer(picture).run(); }

}  // namespace gravel::runner
