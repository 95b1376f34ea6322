#include "drive.hpp"
#include "restart.hpp"
#include "text.hpp"

#include <limits>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace gravel::runner {

namespace {

/// Name and value of every setting.
std::vector<std::pair<std::string, std::string>> settingsOf(const SimulationConfig<double>& config) {
  std::vector<std::pair<std::string, std::string>> list;
  forEachSetting(config, [&]<class T>(const Setting<double>& setting, const T& value) {
    if constexpr (std::is_same_v<T, double>) {
      list.emplace_back(setting.name, detail::formatReal(value));
    } else if constexpr (std::is_enum_v<T>) {
      list.emplace_back(setting.name, EnumNames<T>::values[static_cast<std::size_t>(value)]);
    } else {
      list.emplace_back(setting.name, std::to_string(value));
    }
  });
  return list;
}

/// By all that a run leaves as it is.
bool areAlike(const Space<double>& a, const Space<double>& b, std::size_t i) {
  return a.body(i).id() == b.body(i).id() && a.body(i).mass() == b.body(i).mass() &&
         a.body(i).radius() == b.body(i).radius() && a.body(i).inertia() == b.body(i).inertia() &&
         a.body(i).isFixed() == b.body(i).isFixed() && a.body(i).material() == b.body(i).material();
}

/// How far rounding may have brought a number of that size from what it should be. Each step adds a way, and
/// of what swings or turns by `range` a difference of two phases, which are off by their last digits: those
/// of a long time.
double offByRounding(double size, double phase, double range, const Space<double>& saved) {
  return 1e-9 * size +
         std::numeric_limits<double>::epsilon() * static_cast<double>(saved.steps()) * (size + phase * range);
}

/// A plane that shakes has another velocity in each step: across its normal that of the step's end.
bool isOfShake(const ScenePlane& plane, const Vector3<double>& velocity, const Space<double>& saved) {
  const double omega = plane.omega(), phase = omega * saved.time(), speed = omega * plane.shake.norm();
  const Vector3<double> off = plane.velocity + omega * std::cos(phase) * plane.shake - velocity;
  return (off - plane.normal.dot(off) * plane.normal).norm() <=
         offByRounding(plane.velocity.norm() + speed, phase, speed, saved);
}

/// The same surfaces, where the scene's way has brought them.
bool areAlike(const Space<double>& a, const Plane<double>& ofA, const Space<double>& b,
              const Plane<double>& ofB, const ScenePlane& plane) {
  const double time = b.time();
  Vector3<double> way = time * plane.velocity;
  if (plane.shakes()) {
    way += plane.swing(time) * plane.shake;
  }
  const double size = std::abs(ofA.offset) + time * plane.velocity.norm() + plane.shake.norm();
  const double phase = plane.shakes() ? plane.omega() * time : 0.0;
  return ofA.normal == ofB.normal &&
         (plane.shakes() ? isOfShake(plane, ofB.velocity, b) : ofA.velocity == ofB.velocity) &&
         std::abs(ofA.offset + ofA.normal.dot(way) - ofB.offset) <=
             offByRounding(size, phase, plane.shake.norm(), b) &&
         ofA.material == ofB.material && a.material(ofA.material) == b.material(ofB.material);
}

/// Where bodies merge those that are left are some of the scene's, and have the mass of all.
std::string misfitOfMerged(const Space<double>& start, const Space<double>& saved) {
  std::set<std::uint64_t> ids;
  for (const auto body : start.bodies()) {
    ids.insert(toInteger(body.id()));
  }
  for (const auto body : saved.bodies()) {
    if (ids.count(toInteger(body.id())) == 0) {
      return "it has a body " + std::to_string(toInteger(body.id())) + ", the scene none";
    }
  }
  const double mass = saved.conserved().mass, whole = start.conserved().mass;
  return std::abs(mass - whole) > 1e-9 * whole
             ? "its mass is " + detail::formatReal(mass) + ", the scene's " + detail::formatReal(whole)
             : std::string();
}

std::string misfitOfBodies(const Scene& scene, const Space<double>& start, const Space<double>& saved) {
  if (scene.meeting != Meeting::Bounce) {
    return misfitOfMerged(start, saved);
  }
  if (saved.n() != start.n()) {
    return "it has " + counted(saved.n(), "body", "bodies") + ", the scene " + std::to_string(start.n());
  }
  for (std::size_t i = 0; i < start.n(); ++i) {
    if (!areAlike(start, saved, i)) {
      return "mass, radius, inertia, material or \"fixed\" of its body " + std::to_string(i) +
             " is not the scene's";
    }
  }
  return {};
}

std::string misfitOfSettings(const Scene&, const Space<double>& start, const Space<double>& saved) {
  const auto asked = settingsOf(start.config());
  const auto found = settingsOf(saved.config());
  for (std::size_t k = 0; k < asked.size(); ++k) {
    if (asked[k] != found[k]) {
      return "its " + found[k].first + " is " + found[k].second + ", the scene's " + asked[k].second;
    }
  }
  return {};
}

/// A field that turns keeps its size and its part along the axis, and is, but for a part of a step, where it
/// has turned to.
bool isOfField(const Scene& scene, const Space<double>& saved) {
  const Vector3<double>& start = scene.field;
  const Vector3<double>& turn = scene.fieldTurn;
  const Vector3<double> field = saved.uniformField();
  const double size = start.norm(), step = turn.norm() * scene.config.timeStep;
  return turn == Vector3<double>::Zero()
             ? field == start
             : std::abs(field.norm() - size) <= 1e-9 * size &&
                   std::abs(turn.dot(field - start)) <= 1e-9 * turn.norm() * size &&
                   (field - fieldAt(scene, saved.time())).norm() <=
                       step * size + offByRounding(size, turn.norm() * saved.time(), size, saved);
}

std::string misfitOfSurroundings(const Scene& scene, const Space<double>& start, const Space<double>& saved) {
  if (!(saved.domain() == start.domain()) || !isOfField(scene, saved) ||
      saved.planes().size() != start.planes().size()) {
    return "its domain, field or planes are not the scene's";
  }
  for (std::size_t k = 0; k < start.planes().size(); ++k) {
    if (!areAlike(start, start.planes()[k], saved, saved.planes()[k], scene.planes[k])) {
      return "normal, place, velocity or material of its plane " + std::to_string(k) + " is not the scene's";
    }
  }
  return {};
}

/// Bodies and planes are alike by now, so that their materials have the same numbers.
std::string misfitOfMaterials(const Scene&, const Space<double>& start, const Space<double>& saved) {
  std::set<MaterialId> used;
  for (std::size_t i = 0; i < start.n(); ++i) {
    used.insert(start.body(i).material());
  }
  for (const Plane<double>& plane : start.planes()) {
    used.insert(plane.material);
  }
  const auto number = [](MaterialId id) { return std::to_string(static_cast<std::uint32_t>(id)); };
  for (const MaterialId a : used) {
    if (!(start.material(a) == saved.material(a))) {
      return "its material " + number(a) + " is not the scene's";
    }
  }
  for (const MaterialId a : used) {
    for (const MaterialId b : used) {
      if (!(start.pairMaterial(a, b) == saved.pairMaterial(a, b))) {
        return "its pair of materials " + number(a) + " and " + number(b) + " is not the scene's";
      }
    }
  }
  return {};
}

/// What of a saved state does not belong to the scene that starts as `start`; empty if all does.
std::string misfit(const Scene& scene, const Space<double>& start, const Space<double>& saved) {
  for (const auto look : {misfitOfBodies, misfitOfSettings, misfitOfSurroundings, misfitOfMaterials}) {
    const std::string found = look(scene, start, saved);
    if (!found.empty()) {
      return found;
    }
  }
  return {};
}

}  // namespace

void takeUp(Space<double>& space, const Scene& scene, const std::string& file) {
  const Space<double> start = space;
  space.restore(file);
  const std::string other = misfit(scene, start, space);
  if (!other.empty()) {
    throw SceneError(file + ": is the state of another scene: " + other);
  }
  if (!(space.time() < scene.duration)) {
    throw SceneError(file + ": is the state at time " + detail::formatReal(space.time()) +
                     "; allowed: one before the end, " + detail::formatReal(scene.duration));
  }
}

}  // namespace gravel::runner
