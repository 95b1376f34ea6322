#pragma once

/// \file
/// The surfaces of a space by MaterialId; the first one is the space's own, made from its settings.

#include <gravel/bodies/bodies.hpp>
#include <gravel/contact/material.hpp>
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

  /// The surfaces of two materials in contact, mixed. \throws std::invalid_argument, if there is none of them
  Material<Scalar> pair(MaterialId a, MaterialId b, const Config& config) const {
    const auto surface = [&](MaterialId id) {
      check(static_cast<std::uint32_t>(id), "a pair");
      return id == defaultMaterial ? ownOf(config) : entries_[static_cast<std::size_t>(id)];
    };
    return mix(surface(a), surface(b));
  }

  /// All of them, the space's own by its present settings.
  const std::vector<Material<Scalar>>& renewed(const Config& config) {
    entries_[0] = ownOf(config);
    return entries_;
  }

  const std::vector<Material<Scalar>>& entries() const { return entries_; }
  /// \param entries at least one
  void assign(std::vector<Material<Scalar>> entries) { entries_ = std::move(entries); }

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
};

}  // namespace gravel
