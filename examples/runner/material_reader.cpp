#include "material_reader.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace gravel::runner {

namespace {

/// The coefficients that a table gives take the place of those in `material`. A friction alone is that at
/// rest, too. True if there are any.
bool readCoefficients(TableReader& reader, Material<double>& material) {
  const auto unit = detail::unitInterval<double>();
  const auto notNegative = detail::nonNegative<double>();
  bool any = false;
  const auto read = [&](const char* key, double& value, const detail::Range<double>& range) {
    any = reader.has(key) || any;
    return reader.real(key, value, range);
  };
  read("restitution", material.restitution, unit);
  if (read("friction", material.kineticFriction, notNegative)) {
    material.staticFriction = material.kineticFriction;
  }
  if (read("staticFriction", material.staticFriction, notNegative) &&
      material.staticFriction < material.kineticFriction) {
    reader.fault("staticFriction", detail::formatReal(material.staticFriction),
                 "at least \"friction\", " + detail::formatReal(material.kineticFriction));
  }
  read("tangentialRestitution", material.tangentialRestitution, unit);
  read("restitutionExponent", material.restitutionExponent, unit);
  read("restitutionSpeed", material.restitutionSpeed, detail::positive<double>());
  read("rollingFriction", material.rollingFriction, notNegative);
  read("spinningFriction", material.spinningFriction, notNegative);
  return any;
}

}  // namespace

void MaterialReader::readMaterial(TableReader& reader) {
  Material<double> material = valueOf(defaultMaterial);
  readCoefficients(reader, material);
  std::string name;
  const bool isText = reader.text("name", name);
  if (!reader.has("name")) {
    reader.missing("\"name\", by which bodies and planes ask for it");
  } else if (isText && std::find(names_.begin(), names_.end(), name) != names_.end()) {
    reader.fault("name", "\"" + name + "\"", "a name that no other material has");
  } else if (isText && name.empty()) {
    reader.fault("name", "\"\"", "a text that is not empty");
  } else if (isText) {
    names_.push_back(name);
    ids_.push_back(add(material));
  }
}

void MaterialReader::readPair(TableReader& reader) {
  std::array<std::string, 2> names;
  if (!reader.has("materials")) {
    reader.missing("\"materials\", the names of two");
  }
  std::array<MaterialId, 2> ids{defaultMaterial, defaultMaterial};
  const bool found = reader.texts("materials", names) && find(reader, "materials", names[0], ids[0]) &&
                     find(reader, "materials", names[1], ids[1]);
  Material<double> both = mix(valueOf(ids[0]), valueOf(ids[1]));
  if (!readCoefficients(reader, both)) {
    reader.missing("coefficients; without them two materials mix");
  }
  if (!found) {
    return;
  }
  const auto first = static_cast<std::uint32_t>(std::min(ids[0], ids[1]));
  const auto second = static_cast<std::uint32_t>(std::max(ids[0], ids[1]));
  for (const MaterialPair<double>& pair : scene_.pairs) {
    if (pair.first == first && pair.second == second) {
      reader.fault("materials", "\"" + names[0] + "\", \"" + names[1] + "\"", "two that no other pair has");
      return;
    }
  }
  scene_.pairs.push_back({first, second, both});
}

MaterialId MaterialReader::named(TableReader& reader) const {
  MaterialId id = defaultMaterial;
  std::string name;
  if (reader.text("material", name)) {
    find(reader, "material", name, id);
  }
  return id;
}

MaterialId MaterialReader::surfaceOf(TableReader& reader) {
  const MaterialId id = named(reader);
  Material<double> own = valueOf(id);
  return readCoefficients(reader, own) ? add(own) : id;
}

Material<double> MaterialReader::valueOf(MaterialId id) const {
  return id == defaultMaterial ? MaterialTable<double>().get(id, scene_.config)
                               : scene_.materials[static_cast<std::size_t>(id) - 1];
}

MaterialId MaterialReader::add(const Material<double>& material) {
  scene_.materials.push_back(material);
  return MaterialId{static_cast<std::uint32_t>(scene_.materials.size())};
}

bool MaterialReader::find(TableReader& reader, const char* key, const std::string& name,
                          MaterialId& found) const {
  const auto place = std::find(names_.begin(), names_.end(), name);
  if (place == names_.end()) {
    return reader.unknownName(key, name, names_);
  }
  found = ids_[static_cast<std::size_t>(place - names_.begin())];
  return true;
}

}  // namespace gravel::runner
