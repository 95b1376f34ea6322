#pragma once

/// \file
/// The surfaces of a scene: [[material]], [[pair]], and what other tables say of theirs.

#include "scene.hpp"
#include "table_reader.hpp"

#include <string>
#include <vector>

namespace gravel::runner {

/// Materials by name, while a scene is read. They are numbered as a space will number them.
class MaterialReader {
 public:
  explicit MaterialReader(Scene& scene) : scene_(scene) {}

  /// [[material]]: a name, and coefficients of which those not given are the simulation's.
  void readMaterial(TableReader& reader);
  /// [[pair]]: two names, and measured coefficients of which those not given are the mixed ones.
  void readPair(TableReader& reader);
  /// The material that a table names; else, or if it has none of that name, the space's own.
  MaterialId named(TableReader& reader) const;
  /// That, or a material of its own made from it, where the table gives coefficients.
  MaterialId surfaceOf(TableReader& reader);

 private:
  Material<double> valueOf(MaterialId id) const;  ///< alone
  MaterialId add(const Material<double>& material);
  /// The material of a name that stands under `key`, or a fault.
  bool find(TableReader& reader, const char* key, const std::string& name, MaterialId& found) const;

  Scene& scene_;
  std::vector<std::string> names_;  ///< in their order
  std::vector<MaterialId> ids_;     ///< of the names
};

}  // namespace gravel::runner
