#pragma once

/// \file
/// The surfaces of a space by MaterialId; the first one is the space's own, made from its settings.

#include <gravel/bodies/bodies.hpp>
#include <gravel/contact/material_view.hpp>
#include <gravel/space/simulation_config.hpp>

namespace gravel {

template <Real Scalar>
class MaterialTable {
 public:
  using Config = SimulationConfig<Scalar>;

  /// \throws std::invalid_argument on coefficients out of range
  MaterialId add(const Material<Scalar>& material) {
    validate(material, "the new material");
    entries_.push_back(material);
    return MaterialId{static_cast<std::uint32_t>(entries_.size() - 1)};
  }

  /// \throws std::invalid_argument naming `who`, if there is no such material
  void check(std::uint32_t id, const std::string& who) const {
    if (id >= entries_.size()) {
      detail::refuse(
          "material of " + who, std::to_string(id),
          "0 (the space's own) or a material of addMaterial, below " + std::to_string(entries_.size()));
    }
  }

  template <class Layout>
  void check(const Bodies<Scalar, Layout>& bodies) const {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (bodies.materials()[i] >= entries_.size()) {
        check(bodies.materials()[i], "body " + std::to_string(bodies.ids()[i]));
      }
    }
  }

  /// These two have coefficients of their own as a pair, whatever they are alone. O(pairs), as it keeps them
  /// in their order: 0.4 s for all pairs of 200 materials, a millisecond for those of 50. \throws
  /// std::invalid_argument on coefficients out of range, or if there is none of them
  void setPair(MaterialId a, MaterialId b, const Material<Scalar>& material) {
    const auto first = static_cast<std::uint32_t>(std::min(a, b));
    const auto second = static_cast<std::uint32_t>(std::max(a, b));
    check(second, "a pair");
    validate(material, "the pair");
    const MaterialPair<Scalar> entry{first, second, material};
    const auto place = std::lower_bound(pairs_.begin(), pairs_.end(), entry);
    if (place != pairs_.end() && !(entry < *place)) {
      place->material = material;
    } else {
      pairs_.insert(place, entry);
    }
    noted_ = false;
  }

  /// One of them, alone. \throws std::invalid_argument, if there is no such material
  Material<Scalar> get(MaterialId id, const Config& config) const {
    check(static_cast<std::uint32_t>(id), "this number");
    return id == defaultMaterial ? ownOf(config) : entries_[static_cast<std::size_t>(id)];
  }

  /// Of two in contact. O(log pairs). \throws std::invalid_argument, if there is none of them
  Material<Scalar> pair(MaterialId a, MaterialId b, const Config& config) const {
    check(static_cast<std::uint32_t>(std::max(a, b)), "a pair");
    const auto* own = view().measured(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
    return own != nullptr ? *own : mix(get(a, config), get(b, config));
  }

  /// All of them, the space's own by its present settings.
  const std::vector<Material<Scalar>>& renewed(const Config& config) {
    entries_[0] = ownOf(config);
    return entries_;
  }

  const std::vector<Material<Scalar>>& entries() const { return entries_; }
  const std::vector<MaterialPair<Scalar>>& pairs() const { return pairs_; }
  /// As of the last renewed().
  MaterialView<Scalar> view() const { return {entries_, pairs_}; }
  /// \param entries at least one \throws std::invalid_argument on coefficients out of range
  void assign(std::vector<Material<Scalar>> entries) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      validate(entries[k], "material " + std::to_string(k));
    }
    entries_ = std::move(entries);
    noted_ = false;
  }

  /// Contacts are being found with the surfaces of the last renewed(), and with what bodies are made of now.
  /// O(bodies), where there are several materials.
  template <class Layout>
  void note(const Bodies<Scalar, Layout>& bodies) {
    ofBodies_.clear();
    for (std::size_t i = 0; entries_.size() > 1 && i < bodies.size(); ++i) {
      ofBodies_.push_back(bodies.materials()[i]);
    }
    noted_ = true;
  }

  /// Whether nobody has changed a surface, or what a body is made of, since.
  template <class Layout>
  bool isAsNoted(const Bodies<Scalar, Layout>& bodies, const Config& config) const {
    bool same = noted_ && detail::equalIsSame<Scalar> && entries_[0] == ownOf(config) &&
                ofBodies_.size() == (entries_.size() > 1 ? bodies.size() : 0);
    for (std::size_t i = 0; same && i < ofBodies_.size(); ++i) {
      same = ofBodies_[i] == bodies.materials()[i];
    }
    return same;
  }

 private:
  static Material<Scalar> ownOf(const Config& c) {
    return {.restitution = c.coeffRestitution,
            .staticFriction = std::max(c.coeffStaticFriction, c.coeffFriction),
            .kineticFriction = c.coeffFriction,
            .tangentialRestitution = c.tangentialRestitution,
            .restitutionExponent = c.restitutionExponent,
            .restitutionSpeed = c.restitutionSpeed,
            .rollingFriction = c.rollingFriction,
            .spinningFriction = c.spinningFriction};
  }

  std::vector<Material<Scalar>> entries_ = std::vector<Material<Scalar>>(1);
  std::vector<MaterialPair<Scalar>> pairs_;  ///< in their order
  std::vector<std::uint32_t> ofBodies_;      ///< at the last note()
  bool noted_ = false;
};

}  // namespace gravel
