#include "../scenes/ring_layer.hpp"
#include "../scenes/scenes.hpp"
#include "material_reader.hpp"
#include "scene.hpp"
#include "table_reader.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <new>
#include <sstream>
#include <string>
#include <unordered_set>

namespace gravel::runner {

namespace {

using Range = detail::Range<double>;

Range positive() {
  return {std::numeric_limits<double>::min(), std::numeric_limits<double>::max(), "finite, > 0"};
}
/// No pair search takes more.
constexpr std::size_t mostBodies = std::numeric_limits<std::uint32_t>::max() - 1;

Range notNegative() { return detail::nonNegative<double>(); }

/// [simulation]: every field of SimulationConfig under its own name, by the library's own list of them.
void readSimulation(TableReader& reader, SimulationConfig<double>& config) {
  forEachSetting(config, [&]<class T>(const Setting<double>& setting, T& value) {
    if constexpr (std::is_same_v<T, double>) {
      reader.real(setting.name, value, setting.range);
    } else if constexpr (std::is_same_v<T, bool>) {
      reader.flag(setting.name, value);
    } else if constexpr (std::is_enum_v<T>) {
      std::vector<std::string> names(EnumNames<T>::values.begin(), EnumNames<T>::values.end());
      std::size_t chosen = 0;
      if (reader.choice(setting.name, names, chosen)) {
        value = static_cast<T>(chosen);
      }
    } else {
      std::uint64_t most =
          std::min<std::uint64_t>(std::numeric_limits<T>::max(), std::numeric_limits<std::int64_t>::max());
      if (std::string_view(setting.name) == "bodyCount") {
        most = mostBodies;
      }
      std::size_t read = 0;
      if (reader.count(setting.name, read, 0, most)) {
        value = static_cast<T>(read);
      }
    }
  });
  if (reader.has("coeffFriction") && !reader.has("coeffStaticFriction")) {
    config.coeffStaticFriction = config.coeffFriction;
  }
  if (reader.isSound()) {
    try {
      config.validate();
    } catch (const std::invalid_argument& error) {
      reader.faults().add(reader.where(), error.what());
    }
  }
}

/// What a body, or each body of a generator, is made of and looks like, and what it moves in.
void readLook(TableReader& reader, const MaterialReader& materials, SceneBody& look) {
  reader.flag("flow", look.flow);
  look.body.material = materials.named(reader);
  static const std::vector<std::string> surfaces{"rock", "smooth", "striped", "glowing"};
  std::size_t surface = static_cast<std::size_t>(look.surface);
  if (reader.choice("surface", surfaces, surface)) {
    look.surface = static_cast<Surface>(surface);
  }
  reader.colour("colour", look.colour);
}

/// A body must fit its periodic box. That of a domain which was not understood counts as open.
/// \param isKnown  the radius is what the file says or its default, not what stands in for one at fault
void requireRoom(TableReader& reader, const char* key, bool isKnown, double radius,
                 const Domain<double>& domain) {
  const double most = 0.5 * domain.lengths().minCoeff();
  if (isKnown && !domain.isOpen() && radius > most) {
    reader.fault(key, detail::formatReal(radius),
                 "at most half an edge of the domain, " + detail::formatReal(most));
  }
}

void requireRest(TableReader& reader, const Body<double>& body, bool flow) {
  const auto require = [&](const char* key, const Vector3<double>& value) {
    if (body.fixed && value != Vector3<double>::Zero()) {
      reader.fault(key, detail::formatVector(value),
                   "none on a \"fixed\" body, which never moves, nor turns");
    }
  };
  require("velocity", body.velocity);
  require("angularVelocity", body.angularVelocity);
  if (body.fixed && flow) {
    reader.fault("flow", "true", "none on a \"fixed\" body, which never moves");
  }
}

/// \param names  of the bodies so far
void readBody(TableReader& reader, const MaterialReader& materials, const Domain<double>& domain,
              std::unordered_set<std::string>& names, std::vector<SceneBody>& bodies) {
  SceneBody entry;
  Body<double>& body = entry.body;
  reader.text("name", entry.name);
  if (!entry.name.empty() && !names.insert(entry.name).second) {
    reader.fault("name", "\"" + entry.name + "\"", "a name that no other body has");
  }
  reader.vector("position", body.position);
  reader.vector("velocity", body.velocity);
  reader.vector("angularVelocity", body.angularVelocity);
  Eigen::Vector4d orientation(0, 0, 0, 1);
  reader.numbers<4>("orientation", orientation);
  body.orientation.coeffs() = orientation;
  const bool understood = reader.real("radius", body.radius, notNegative()) || !reader.has("radius");
  requireRoom(reader, "radius", understood, body.radius, domain);
  double density = 0.0;
  const bool hasMass = reader.has("mass");
  const bool hasDensity = reader.has("density");
  reader.real("mass", body.mass, notNegative());
  reader.real("density", density, positive());
  if (hasMass == hasDensity) {
    reader.missing(hasMass ? "room for both \"mass\" and \"density\": give one" : "\"mass\" or \"density\"");
  } else if (hasDensity) {
    if (understood && body.radius == 0.0) {
      reader.fault("density", "given", "with a radius > 0; what has none needs a \"mass\"");
    }
    body.mass = density * 4.0 / 3.0 * pi<double>() * body.radius * body.radius * body.radius;
  }
  double inertia = 0.0;
  if (reader.real("inertia", inertia, positive())) {
    body.inertia = inertia;
  }
  reader.flag("fixed", body.fixed);
  readLook(reader, materials, entry);
  requireRest(reader, body, entry.flow);
  if (reader.isSound()) {
    try {
      validate(body, entry.name.empty() ? "body " + std::to_string(bodies.size()) : "\"" + entry.name + "\"");
    } catch (const std::invalid_argument& error) {
      reader.faults().add(reader.where(), error.what());
    }
  }
  bodies.push_back(entry);
}

void append(TableReader& reader, std::vector<SceneBody>& bodies, const SceneBody& look,
            const std::vector<Body<double>>& made) {
  try {
    for (const Body<double>& body : made) {
      SceneBody entry = look;
      entry.body = body;
      entry.body.material = look.body.material;
      validate(body, "body " + std::to_string(bodies.size()));
      bodies.push_back(entry);
    }
  } catch (const std::invalid_argument& error) {
    reader.faults().add(reader.where(), error.what());
  }
}

/// Runs a generator of bodies, as many as `key` with this value says, unless its table has a fault already;
/// what it refuses is one, too.
template <class Generate>
void generate(TableReader& reader, std::vector<SceneBody>& bodies, const SceneBody& look, const char* key,
              const std::string& value, Generate&& make) {
  if (!reader.isSound()) {
    return;
  }
  try {
    append(reader, bodies, look, make());
  } catch (const std::invalid_argument& error) {
    reader.faults().add(reader.where(), error.what());
  } catch (const std::bad_alloc&) {
    reader.fault(key, value, "as many bodies as there is memory for");
  }
}

template <class Generate>
void generate(TableReader& reader, std::vector<SceneBody>& bodies, const SceneBody& look, std::size_t count,
              Generate&& make) {
  generate(reader, bodies, look, "count", std::to_string(count), make);
}

std::uint64_t readSeed(TableReader& reader) {
  std::size_t seed = 1;
  reader.count("seed", seed);
  return seed;
}

void readBodyRadius(TableReader& reader, std::array<double, 2>& radius, const Domain<double>& domain) {
  const bool understood = reader.interval("bodyRadius", radius, positive()) || !reader.has("bodyRadius");
  requireRoom(reader, "bodyRadius", understood, radius[1], domain);
}

/// What a generator made about the origin, at rest as a whole.
std::vector<Body<double>> moved(std::vector<Body<double>> bodies, const Vector3<double>& position,
                                const Vector3<double>& velocity) {
  for (Body<double>& body : bodies) {
    body.position += position;
    body.velocity += velocity;
  }
  return bodies;
}

void readCloud(TableReader& reader, const MaterialReader& materials, const Domain<double>& domain,
               std::vector<SceneBody>& bodies) {
  scenes::CloudOptions options;
  Vector3<double> position = Vector3<double>::Zero(), velocity = Vector3<double>::Zero();
  reader.count("count", options.count, 1, mostBodies);
  options.seed = readSeed(reader);
  reader.vector("position", position);
  reader.vector("velocity", velocity);
  reader.real("radius", options.radius, positive());
  readBodyRadius(reader, options.bodyRadius, domain);
  reader.real("sizeExponent", options.sizeExponent, notNegative());
  reader.interval("density", options.density, positive());
  reader.vector("spin", options.spin);
  reader.real("velocityDispersion", options.velocityDispersion, notNegative());
  reader.real("bodySpin", options.bodySpin, notNegative());
  SceneBody look;
  readLook(reader, materials, look);
  generate(reader, bodies, look, options.count,
           [&] { return moved(scenes::rubbleCloud<double>(options), position, velocity); });
}

void readColumn(TableReader& reader, const MaterialReader& materials, const Domain<double>& domain,
                std::vector<SceneBody>& bodies) {
  scenes::ColumnOptions options;
  reader.count("count", options.count, 1, mostBodies);
  options.seed = readSeed(reader);
  reader.vector("base", options.base);
  reader.vector("velocity", options.velocity);
  reader.real("radius", options.radius, positive());
  readBodyRadius(reader, options.bodyRadius, domain);
  reader.real("density", options.density, positive());
  SceneBody look;
  readLook(reader, materials, look);
  generate(reader, bodies, look, options.count, [&] { return scenes::grainColumn<double>(options); });
}

/// Balls of diameter 1 and mass 1 in a cube, which walls on all sides have to hold together.
void readGas(TableReader& reader, const MaterialReader& materials, bool enclosed,
             const Domain<double>& domain, std::vector<SceneBody>& bodies) {
  std::size_t count = 1000;
  double fraction = 0.1;
  reader.count("count", count, 1, mostBodies);
  reader.real("fraction", fraction, {1e-9, 0.3, "> 0, at most 0.3"});
  const std::uint64_t seed = readSeed(reader);
  requireRoom(reader, "radius", true, 0.5, domain);
  if (!enclosed) {
    const double length = scenes::gasBoxLength(count, fraction);
    reader.missing("walls: give a [domain] of kind \"periodic\" with three lengths of " +
                   detail::formatReal(length) + ", or a [[box]] with no open face, " +
                   detail::formatReal(0.5 * length + 0.5) + " or more to each side of the origin");
  }
  SceneBody look;
  look.surface = Surface::Smooth;
  readLook(reader, materials, look);
  generate(reader, bodies, look, count, [&] { return scenes::randomGas<double>(count, fraction, seed); });
}

/// Points that hold each other together, or spheres.
void readCluster(TableReader& reader, const MaterialReader& materials, double G, const Domain<double>& domain,
                 std::vector<SceneBody>& bodies) {
  scenes::PlummerOptions options;
  Vector3<double> position = Vector3<double>::Zero(), velocity = Vector3<double>::Zero();
  double radius = 0.0;
  reader.count("count", options.count, 1, mostBodies);
  options.seed = readSeed(reader);
  reader.real("mass", options.mass, positive());
  reader.real("scaleRadius", options.scaleRadius, positive());
  reader.vector("position", position);
  reader.vector("velocity", velocity);
  const bool understood = reader.real("bodyRadius", radius, notNegative()) || !reader.has("bodyRadius");
  requireRoom(reader, "bodyRadius", understood, radius, domain);
  if (!(G > 0.0)) {
    reader.missing("gravity, which holds it together: give a \"G\" > 0 in [simulation]");
  }
  options.G = G;
  SceneBody look;
  look.surface = Surface::Glowing;
  readLook(reader, materials, look);
  generate(reader, bodies, look, options.count, [&] {
    auto made = moved(scenes::plummerSphere<double>(options), position, velocity);
    for (Body<double>& body : made) {
      body.radius = radius;
    }
    return made;
  });
}

/// Fills the patch along x and y.
void readRing(TableReader& reader, const MaterialReader& materials, const Domain<double>& domain,
              bool domainIsKnown, std::vector<SceneBody>& bodies) {
  scenes::RingLayerOptions options;
  reader.real("opticalDepth", options.opticalDepth, positive());
  options.seed = readSeed(reader);
  readBodyRadius(reader, options.bodyRadius, domain);
  reader.real("sizeExponent", options.sizeExponent, notNegative());
  reader.interval("density", options.density, positive());
  options.height = scenes::looseHeight(options.opticalDepth, options.bodyRadius[1]);
  reader.real("height", options.height, positive());
  reader.real("velocityDispersion", options.velocityDispersion, notNegative());
  SceneBody look;
  look.flow = true;
  readLook(reader, materials, look);
  const Vector3<double> lengths = domain.lengths();
  if (domain.kind() != DomainKind::ShearPeriodic) {
    if (domainIsKnown) {
      reader.missing("patch: give a [domain] of kind \"shearPeriodic\"");
    }
    return;
  }
  if (const double most = lengths[2] - 2.0 * options.bodyRadius[1]; !(options.height <= most)) {
    reader.fault("height", detail::formatReal(options.height),
                 "at most the third length of the domain less a body, " + detail::formatReal(most));
  }
  generate(reader, bodies, look, "opticalDepth", detail::formatReal(options.opticalDepth),
           [&] { return scenes::ringLayer<double>(options, lengths[0], lengths[1]); });
}

/// Of a plane or a box: what it is made of, and its colour.
void readSurface(TableReader& reader, MaterialReader& materials, ScenePlane& plane) {
  plane.material = materials.surfaceOf(reader);
  Colour colour;
  if (reader.colour("colour", colour)) {
    plane.colour = colour;
  }
}

/// What moves from step to step wants to know how long the step will be.
void requireEqualSteps(TableReader& reader, const char* key, bool moves,
                       const SimulationConfig<double>& config) {
  if (moves && config.adaptiveTimeStep) {
    reader.fault(key, "given", "with adaptiveTimeStep = false in [simulation]");
  }
}

/// Of a plane or a box: how it moves.
void readMotion(TableReader& reader, const SimulationConfig<double>& config, ScenePlane& plane) {
  reader.vector("velocity", plane.velocity);
  reader.vector("shake", plane.shake);
  reader.real("shakePeriod", plane.shakePeriod, positive());
  if (reader.has("shake") != reader.has("shakePeriod")) {
    reader.missing(reader.has("shake") ? "\"shakePeriod\", the time of one swing to and fro"
                                       : "\"shake\", how far it swings to each side");
  }
  requireEqualSteps(reader, "shake", plane.shakes(), config);
}

void readPlane(TableReader& reader, const SimulationConfig<double>& config, MaterialReader& materials,
               std::vector<ScenePlane>& planes) {
  ScenePlane plane;
  reader.vector("normal", plane.normal);
  reader.real("offset", plane.offset);
  readMotion(reader, config, plane);
  if (!(plane.normal.stableNorm() > 0.0)) {
    reader.faults().add(reader.where(), "\"normal\" in [[plane]] is (0, 0, 0); allowed: any direction");
  } else {
    plane.normal.stableNormalize();
  }
  readSurface(reader, materials, plane);
  planes.push_back(plane);
}

/// Up to six planes that look inwards: the faces of the box from `low` to `high`, but for the one in `open`.
/// True if it is closed on all sides.
bool readBox(TableReader& reader, const SimulationConfig<double>& config, MaterialReader& materials,
             std::vector<ScenePlane>& planes) {
  static const std::vector<std::string> faces{"-x", "+x", "-y", "+y", "-z", "+z"};
  Vector3<double> low = Vector3<double>::Constant(-1), high = Vector3<double>::Constant(1);
  const bool hasLow = reader.vector("low", low), hasHigh = reader.vector("high", high);
  if (!reader.has("low") || !reader.has("high")) {
    reader.missing("\"low\" and \"high\", two opposite corners");
  } else if (hasLow && hasHigh && !((high - low).minCoeff() > 0.0)) {
    reader.faults().add(reader.where(), "\"high\" in [[box]] is " + detail::formatVector(high) +
                                            "; allowed: more than \"low\", " + detail::formatVector(low) +
                                            ", along each axis");
  }
  std::string open;
  std::size_t openFace = faces.size();
  reader.choice("open", faces, openFace);
  ScenePlane look;
  readMotion(reader, config, look);
  readSurface(reader, materials, look);
  for (std::size_t face = 0; face < faces.size(); ++face) {
    if (face != openFace) {
      const auto axis = static_cast<Eigen::Index>(face / 2);
      const bool upper = face % 2 != 0;
      ScenePlane plane = look;
      plane.normal = Vector3<double>::Unit(axis) * (upper ? -1.0 : 1.0);
      plane.offset = upper ? -high[axis] : low[axis];
      planes.push_back(plane);
    }
  }
  return !reader.has("open");
}

void readDomain(TableReader& reader, Domain<double>& domain) {
  static const std::vector<std::string> kinds{"open", "periodic", "shearPeriodic"};
  std::size_t kind = 0;
  Vector3<double> lengths = Vector3<double>::Zero();
  const bool understood = reader.choice("kind", kinds, kind) || !reader.has("kind");
  const bool hasLengths = reader.numbers<3>("lengths", lengths, positive());
  double omega = 0.0;
  const bool hasOmega = reader.real("omega", omega);
  double vertical = omega;
  reader.real("verticalFrequency", vertical);
  if (kind != 0 && !reader.has("lengths")) {
    reader.missing("\"lengths\", the box's three sides");
  }
  if (kind == 2 && !reader.has("omega")) {
    reader.missing("\"omega\", the orbital frequency");
  }
  const auto belongs = [&](const char* key, bool allowed, const char* where) {
    if (understood && !allowed && reader.has(key)) {
      reader.fault(key, "given", where);
    }
  };
  belongs("lengths", kind != 0, "with kind = \"periodic\" or \"shearPeriodic\"");
  belongs("omega", kind == 2, "with kind = \"shearPeriodic\"");
  belongs("verticalFrequency", kind == 2, "with kind = \"shearPeriodic\"");
  if (kind == 1 && hasLengths) {
    domain = Domain<double>::periodic(lengths);
  } else if (kind == 2 && hasLengths && hasOmega) {
    domain = Domain<double>::shearPeriodic(lengths, omega, vertical);
  }
}

void readField(TableReader& reader, Scene& scene) {
  reader.vector("acceleration", scene.field);
  reader.vector("turn", scene.fieldTurn);
  requireEqualSteps(reader, "turn", scene.fieldTurn != Vector3<double>::Zero(), scene.config);
}

void readCollisions(TableReader& reader, Scene& scene) {
  static const std::vector<std::string> outcomes{"bounce", "merge", "mergeBelowEscape"};
  std::size_t outcome = 0;
  if (reader.choice("outcome", outcomes, outcome)) {
    scene.meeting = static_cast<Meeting>(outcome);
  }
  reader.real("escapeFactor", scene.escapeFactor, positive());
  if (reader.has("escapeFactor") && scene.meeting != Meeting::MergeBelowEscape) {
    reader.fault("escapeFactor", "given", "with outcome = \"mergeBelowEscape\"");
  }
}

void readPicture(TableReader& reader, PictureOptions& picture) {
  static const std::vector<std::string> skies{"room", "stars"};
  Vector3<double> target = Vector3<double>::Zero();
  double span = 0.0;
  reader.vector("direction", picture.direction);
  reader.vector("up", picture.up);
  const Vector3<double> direction = picture.direction.stableNormalized(), up = picture.up.stableNormalized();
  if (!(direction.cross(up).norm() > 1e-9)) {
    reader.faults().add(reader.where(), "\"direction\" in [picture] is " +
                                            detail::formatVector(picture.direction) +
                                            "; allowed: any direction but that of \"up\"");
  }
  if (reader.vector("target", target)) {
    picture.target = target;
  }
  if (reader.real("span", span, positive())) {
    picture.span = span;
  }
  reader.real("fieldOfView", picture.fieldOfView, {1.0, 120.0, "1 to 120 degrees"});
  const auto size = [&](const char* key, std::size_t& pixels) { reader.count(key, pixels, 16, 10000); };
  size("width", picture.width);
  size("height", picture.height);
  reader.real("smallestRadius", picture.smallestRadius, {0.0, 1000.0, "0 to 1000 pixels"});
  std::size_t sky = 0;
  if (reader.choice("background", skies, sky)) {
    picture.stars = sky == 1;
  }
  reader.flag("trails", picture.trails);
}

Scene interpret(const toml::table& table, Faults& faults) {
  Scene scene;
  TableReader top(table, "the top level", faults);
  top.text("title", scene.title);
  if (!top.real("duration", scene.duration, positive()) && !top.has("duration")) {
    top.missing("\"duration\", the time to simulate");
  }
  top.table("units", [&](TableReader& reader) {
    reader.text("length", scene.units.length);
    reader.text("time", scene.units.time);
    reader.text("mass", scene.units.mass);
  });
  top.table("simulation", [&](TableReader& reader) { readSimulation(reader, scene.config); });
  bool domainIsKnown = !top.has("domain");
  top.table("domain", [&](TableReader& reader) {
    readDomain(reader, scene.domain);
    domainIsKnown = reader.isSound();
  });
  top.table("field", [&](TableReader& reader) { readField(reader, scene); });
  top.table("collisions", [&](TableReader& reader) { readCollisions(reader, scene); });
  MaterialReader materials(scene);
  top.tables("material", [&](TableReader& reader) { materials.readMaterial(reader); });
  top.tables("pair", [&](TableReader& reader) { materials.readPair(reader); });
  top.tables("plane", [&](TableReader& reader) { readPlane(reader, scene.config, materials, scene.planes); });
  bool enclosed = !scene.domain.isOpen() || !domainIsKnown;
  top.tables("box", [&](TableReader& reader) {
    enclosed = readBox(reader, scene.config, materials, scene.planes) || enclosed;
  });
  std::unordered_set<std::string> names;
  top.tables("body",
             [&](TableReader& reader) { readBody(reader, materials, scene.domain, names, scene.bodies); });
  top.tables("cloud", [&](TableReader& reader) { readCloud(reader, materials, scene.domain, scene.bodies); });
  top.tables("column",
             [&](TableReader& reader) { readColumn(reader, materials, scene.domain, scene.bodies); });
  top.tables("gas",
             [&](TableReader& reader) { readGas(reader, materials, enclosed, scene.domain, scene.bodies); });
  top.tables("cluster", [&](TableReader& reader) {
    readCluster(reader, materials, scene.config.G, scene.domain, scene.bodies);
  });
  top.tables("ring", [&](TableReader& reader) {
    readRing(reader, materials, scene.domain, domainIsKnown, scene.bodies);
  });
  bool flows = false;
  for (SceneBody& entry : scene.bodies) {
    if (entry.flow) {  // what is at rest lacks it
      entry.body.velocity -= scene.domain.lessFlow(entry.body.position, Vector3<double>::Zero());
      flows = true;
    }
  }
  if (flows && domainIsKnown && scene.domain.kind() != DomainKind::ShearPeriodic) {
    top.missing("[domain] of kind \"shearPeriodic\", whose the \"flow\" is");
  }
  top.table("output", [&](TableReader& reader) {
    reader.count("frames", scene.output.frames, 0, mostRecords);
    reader.count("rows", scene.output.rows, 0, mostRecords);
  });
  top.table("picture", [&](TableReader& reader) { readPicture(reader, scene.picture); });
  top.finish();
  if (!faults.any() && scene.bodies.empty() && scene.config.bodyCount == 0) {
    top.missing(
        "bodies: give [[body]], [[cloud]], [[column]], [[gas]], [[cluster]], [[ring]] or [simulation] "
        "bodyCount");
  }
  return scene;
}

}  // namespace

Scene readScene(const std::string& text, const std::string& file) {
  Faults faults(file);
  try {
    const toml::table table = toml::parse(text, file);
    Scene scene = interpret(table, faults);
    if (faults.any()) {
      throw SceneError(faults.text());
    }
    scene.name = std::filesystem::path(file).stem().string();
    return scene;
  } catch (const toml::parse_error& error) {
    faults.add(error.source(), std::string(error.description()));
    throw SceneError(faults.text());
  }
}

Scene readSceneFile(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    throw SceneError(path + ": there is no such file");
  }
  if (std::filesystem::is_directory(path, ignored)) {
    throw SceneError(path + ": is a folder; allowed: a scene file");
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    throw SceneError(path + ": cannot be read");
  }
  std::stringstream text;
  if (!(text << in.rdbuf())) {
    throw SceneError(path + ": is empty");
  }
  return readScene(text.str(), path);
}

}  // namespace gravel::runner
