#pragma once

/// \file
/// A scene as a value, and how it is read from TOML.

#include "render.hpp"
#include <gravel/gravel.hpp>

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace gravel::runner {

struct SceneBody {
  Body<double> body;
  std::string name;  ///< empty for the bodies of a generator
  Colour colour = Colour(0.36F, 0.32F, 0.27F);
  Surface surface = Surface::Rock;
  bool flow = false;  ///< its velocity counts from the flow of the shear-periodic domain
};

/// It goes the way velocity t + shake sin(2 pi t/shakePeriod).
struct ScenePlane {
  Vector3<double> normal = Vector3<double>::UnitZ();
  double offset = 0.0;
  Vector3<double> velocity = Vector3<double>::Zero();
  Vector3<double> shake = Vector3<double>::Zero();
  double shakePeriod = 0.0;
  MaterialId material = defaultMaterial;
  std::optional<Colour> colour;  ///< not drawn without one

  bool shakes() const { return shake != Vector3<double>::Zero(); }
  /// Of the swing, of a plane that shakes: its angular frequency, and the share of `shake` at that time.
  double omega() const { return 2.0 * pi<double>() / shakePeriod; }
  double swing(double time) const { return std::sin(omega() * time); }
};

/// What comes of two bodies that meet.
enum class Meeting { Bounce, Merge, MergeBelowEscape };

/// What units the scene's numbers have: names for the output only, nothing is converted.
struct Units {
  std::string length = "m";
  std::string time = "s";
  std::string mass = "kg";
  bool areSI() const { return length == "m" && time == "s" && mass == "kg"; }
};

/// Most frames or rows that can be asked for: more than any run has steps.
inline constexpr std::size_t mostRecords = 1'000'000'000;

struct OutputOptions {
  std::size_t frames = 60;  ///< .vtp files, the start and the end among them; 0 for none
  std::size_t rows = 300;   ///< of the table of diagnostics
};

struct PictureOptions {
  Vector3<double> direction = Vector3<double>(1.0, -0.6, 0.5);  ///< from the scene to the eye
  Vector3<double> up = Vector3<double>::UnitZ();
  std::optional<Vector3<double>> target;  ///< else the middle of the bodies and their trails
  std::optional<double> span;             ///< height of what is seen; else so that nearly all of these are
  double fieldOfView = 30.0;
  std::size_t width = 1200;
  std::size_t height = 900;
  double smallestRadius = 0.0;
  bool stars = false;
  bool trails = false;
};

struct Scene {
  std::string name = "scene";  ///< the file's name without its ending; names the output
  std::string title;
  double duration = 0.0;
  Units units;
  SimulationConfig<double> config;
  Domain<double> domain = Domain<double>::open();
  Vector3<double> field = Vector3<double>::Zero();      ///< at the start
  Vector3<double> fieldTurn = Vector3<double>::Zero();  ///< its angular velocity
  Meeting meeting = Meeting::Bounce;
  double escapeFactor = 1.0;                ///< of the escape speed, below which MergeBelowEscape merges
  std::vector<Material<double>> materials;  ///< but for the space's own, in the order of their MaterialId
  std::vector<MaterialPair<double>> pairs;
  std::vector<SceneBody> bodies;
  std::vector<ScenePlane> planes;
  OutputOptions output;
  PictureOptions picture;
};

/// What the scene says of the body with this id; null for the random bodies of [simulation] bodyCount, which
/// come first.
inline const SceneBody* sceneBody(const Scene& scene, BodyId id) {
  const std::uint64_t index = toInteger(id) - scene.config.bodyCount;
  return index < scene.bodies.size() ? &scene.bodies[static_cast<std::size_t>(index)] : nullptr;
}

/// What is wrong with a scene file, one line a fault: `file:line: what, which value, what is allowed`.
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// \param file names the text in messages
/// \throws SceneError that lists every fault found
Scene readScene(const std::string& text, const std::string& file);

/// As above from a file. \throws SceneError also if it cannot be read
Scene readSceneFile(const std::string& path);

}  // namespace gravel::runner
