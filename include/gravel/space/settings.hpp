#pragma once

/// \file
/// The settings of a running space: getters, and setters that check.

#include <gravel/space/simulation_config.hpp>
#include <gravel/space/step_in_progress.hpp>

namespace gravel {

/// Base of `Space`: holds the configuration. Every setter throws std::invalid_argument that names the
/// setting, the value and what is allowed, and then leaves the setting as it was; std::logic_error inside a
/// step.
template <Real Scalar>
class Settings {
 public:
  const SimulationConfig<Scalar>& config() const { return config_; }

  Scalar getEpsilon() const { return config_.epsilon; }
  void setEpsilon(Scalar eps) { assign(&SimulationConfig<Scalar>::epsilon, eps); }

  Scalar getCoeffRestitution() const { return config_.coeffRestitution; }
  void setCoeffRestitution(Scalar e) { assign(&SimulationConfig<Scalar>::coeffRestitution, e); }

  Scalar getCoeffFriction() const { return config_.coeffFriction; }
  void setCoeffFriction(Scalar mu) { assign(&SimulationConfig<Scalar>::coeffFriction, mu); }

  /// A static coefficient below the kinetic one counts as equal to it.
  Scalar getCoeffStaticFriction() const { return config_.coeffStaticFriction; }
  void setCoeffStaticFriction(Scalar mu_s) { assign(&SimulationConfig<Scalar>::coeffStaticFriction, mu_s); }

  Scalar getTangentialRestitution() const { return config_.tangentialRestitution; }
  void setTangentialRestitution(Scalar b0) { assign(&SimulationConfig<Scalar>::tangentialRestitution, b0); }

  Scalar getRestitutionExponent() const { return config_.restitutionExponent; }
  void setRestitutionExponent(Scalar q) { assign(&SimulationConfig<Scalar>::restitutionExponent, q); }

  Scalar getRestitutionSpeed() const { return config_.restitutionSpeed; }
  void setRestitutionSpeed(Scalar speed) { assign(&SimulationConfig<Scalar>::restitutionSpeed, speed); }

  Scalar getRollingFriction() const { return config_.rollingFriction; }
  void setRollingFriction(Scalar mu_r) { assign(&SimulationConfig<Scalar>::rollingFriction, mu_r); }

  Scalar getSpinningFriction() const { return config_.spinningFriction; }
  void setSpinningFriction(Scalar mu_t) { assign(&SimulationConfig<Scalar>::spinningFriction, mu_t); }

  Scalar getLinearDamping() const { return config_.linearDamping; }
  void setLinearDamping(Scalar damping) { assign(&SimulationConfig<Scalar>::linearDamping, damping); }

  Scalar getAngularDamping() const { return config_.angularDamping; }
  void setAngularDamping(Scalar damping) { assign(&SimulationConfig<Scalar>::angularDamping, damping); }

  Scalar getPositionalCorrectionFactor() const { return config_.positionalCorrectionFactor; }
  void setPositionalCorrectionFactor(Scalar factor) {
    assign(&SimulationConfig<Scalar>::positionalCorrectionFactor, factor);
  }

  Scalar getContactTolerance() const { return config_.contactTolerance; }
  void setContactTolerance(Scalar tolerance) {
    assign(&SimulationConfig<Scalar>::contactTolerance, tolerance);
  }

  std::size_t getContactIterations() const { return config_.contactIterations; }
  void setContactIterations(std::size_t most) { assign(&SimulationConfig<Scalar>::contactIterations, most); }

  bool isDiagnosticsEnabled() const { return config_.diagnosticsEnabled; }
  void setDiagnosticsEnabled(bool enabled) {
    inStep_.refuse("setDiagnosticsEnabled()");
    config_.diagnosticsEnabled = enabled;
  }

 protected:
  Settings() = default;
  explicit Settings(const SimulationConfig<Scalar>& config) : config_(config) { config_.validate(); }
  ~Settings() = default;
  Settings(const Settings&) = default;
  Settings(Settings&&) = default;  // NOLINT(performance-noexcept-move-constructor)
  Settings& operator=(const Settings&) = default;
  Settings& operator=(Settings&&) = default;  // NOLINT(performance-noexcept-move-constructor)

  /// Sets one field if the whole configuration stays valid with it.
  template <class T>
  void assign(T SimulationConfig<Scalar>::*field, const T& value) {
    inStep_.refuse("the setter of a setting");
    SimulationConfig<Scalar> next = config_;
    next.*field = value;
    next.validate();
    config_ = next;
  }

  detail::StepInProgress inStep_;  // the first member: see there
  SimulationConfig<Scalar> config_;
};

}  // namespace gravel
