#pragma once

/// \file
/// Everything that one chooses for a run, and the one list that validation, scene files, snapshots and
/// documentation read.

#include <gravel/contact/contact_solver.hpp>
#include <gravel/core/check.hpp>
#include <gravel/dynamics/integrator.hpp>
#include <gravel/gravity/gravity_solver.hpp>
#include <gravel/spatial/broad_phase.hpp>

#include <array>
#include <string_view>

namespace gravel {

/// Choices for a run. An aggregate: fill it with designated initialisers or field by field.
template <Real Scalar = double>
struct SimulationConfig {
  std::size_t bodyCount = 0;               ///< random bodies made at the start
  Scalar density = Scalar(2000);           ///< [kg m^-3] of the random bodies
  unsigned int seed = 1;                   ///< of the random bodies: equal seeds, equal bodies
  Scalar G = Scalar(6.6743e-11);           ///< [m^3 kg^-1 s^-2], CODATA 2018; 0 switches gravity off
  Scalar softening = Scalar(0);            ///< [m] Plummer length of the gravity of every pair
  Scalar gravityTolerance = Scalar(1e-5);  ///< relative rms force error that gravity may have
  GravityKind gravity = GravityKind::Automatic;
  Scalar timeStep = Scalar(1e-3);        ///< [s] the step; the longest one where steps adapt
  bool adaptiveTimeStep = true;          ///< shorten steps as velocities and accelerations ask
  Scalar minTimeStep = Scalar(0);        ///< [s] adaptive steps are not shorter; at most timeStep
  Scalar timeStepFactor = Scalar(0.02);  ///< adaptive step over the time in which motion changes
  IntegratorKind integrator = IntegratorKind::VelocityVerlet;
  bool compensatedSummation = true;  ///< under mutual gravity, carry what kicks and drifts lose to rounding
  Scalar epsilon = Scalar(1e-12);    ///< lengths [m] and speeds [m s^-1] below it count as zero
  Scalar coeffRestitution = Scalar(0.5);     ///< approach speed kept in a hit; 1 keeps all
  Scalar restitutionExponent = Scalar(0);    ///< that falls with impact speed as v^-exponent; 0: it does not
  Scalar restitutionSpeed = Scalar(1);       ///< [m s^-1] from this speed on
  Scalar restitutionThreshold = Scalar(0);   ///< [m s^-1] slower hits do not bounce
  Scalar coeffFriction = Scalar(0.3);        ///< kinetic: sliding force over normal force
  Scalar coeffStaticFriction = Scalar(0.4);  ///< least force that starts a slide, over normal force
  Scalar tangentialRestitution = Scalar(0);  ///< slip speed that a sticking hit turns back
  Scalar rollingFriction = Scalar(0);        ///< rolling torque over effective radius and normal force
  Scalar spinningFriction = Scalar(0);       ///< the same of spin about the normal
  Scalar linearDamping = Scalar(0);          ///< [s^-1] dv/dt = -c v
  Scalar angularDamping = Scalar(0);         ///< [s^-1] dw/dt = -c w
  Scalar positionalCorrectionFactor = Scalar(0.4);  ///< share of each overlap removed in each part of a step
  Scalar contactTolerance = Scalar(1e-3);  ///< contact sweeps end when speeds change by less, relative
  std::size_t contactIterations = 0;       ///< most contact sweeps per solve, two a step; 0: limitSweeps()
  std::size_t contactSubsteps = 1;         ///< least contact steps per force evaluation; 0: as motion asks
  Scalar sleepSpeed = Scalar(0);           ///< [m s^-1] islands slower than this fall asleep; 0: none does
  Scalar sleepTime = Scalar(0.5);          ///< [s] for which they must have been slower
  BroadPhaseKind broadPhase = BroadPhaseKind::Automatic;
  bool diagnosticsEnabled = false;  ///< log energies and warn of instability
  std::size_t logFrequency = 100;   ///< steps between two lines of that log

  /// \throws std::invalid_argument that lists every field at fault with its value and what is allowed
  void validate() const;
};

/// What a setting is, apart from its value.
template <Real Scalar>
struct Setting {
  const char* name;
  const char* unit;
  detail::Range<Scalar> range;  ///< of real settings
};

/// Names of the values of an enumeration, in their order; what scene files and messages use.
template <class Enum>
struct EnumNames;
template <>
struct EnumNames<IntegratorKind> {
  static constexpr std::array<std::string_view, 13> values{
      "VelocityVerlet", "Yoshida4",     "Yoshida6", "Yoshida8",       "BlanesMoan4",
      "BlanesMoan6",    "KahanLi6",     "KahanLi8", "ForceGradient4", "SymplecticEpicycle",
      "GaussRadau15",   "WisdomHolman", "Hermite4"};
};
template <>
struct EnumNames<GravityKind> {
  static constexpr std::array<std::string_view, 3> values{"Automatic", "Direct", "FastMultipole"};
};
template <>
struct EnumNames<BroadPhaseKind> {
  static constexpr std::array<std::string_view, 4> values{"Automatic", "AllPairs", "KDTree", "Grid"};
};

/// Calls visit(setting, value) for every field of the config: values are Scalar, bool, std::size_t,
/// unsigned int, or an enumeration with `EnumNames`. A new field is declared above and named here.
template <class Config, class Visitor>
void forEachSetting(Config& c, Visitor&& visit) {
  using Scalar = std::remove_cvref_t<decltype(c.G)>;
  using S = Setting<Scalar>;
  const auto any = detail::nonNegative<Scalar>();
  const auto unit = detail::unitInterval<Scalar>();
  const auto positive = detail::positive<Scalar>();
  auto tolerance = positive;
  tolerance.high = Scalar(1);
  tolerance.text = "> 0, <= 1";
  visit(S{"bodyCount", "1", any}, c.bodyCount);
  visit(S{"density", "kg m^-3", positive}, c.density);
  visit(S{"seed", "1", any}, c.seed);
  visit(S{"G", "m^3 kg^-1 s^-2", any}, c.G);
  visit(S{"softening", "m", any}, c.softening);
  visit(S{"gravityTolerance", "1", tolerance}, c.gravityTolerance);
  visit(S{"gravity", "", any}, c.gravity);
  visit(S{"timeStep", "s", positive}, c.timeStep);
  visit(S{"adaptiveTimeStep", "", any}, c.adaptiveTimeStep);
  visit(S{"minTimeStep", "s", any}, c.minTimeStep);
  visit(S{"timeStepFactor", "1", tolerance}, c.timeStepFactor);
  visit(S{"integrator", "", any}, c.integrator);
  visit(S{"compensatedSummation", "", any}, c.compensatedSummation);
  visit(S{"epsilon", "m, m s^-1", any}, c.epsilon);
  visit(S{"coeffRestitution", "1", unit}, c.coeffRestitution);
  visit(S{"restitutionExponent", "1", unit}, c.restitutionExponent);
  visit(S{"restitutionSpeed", "m s^-1", positive}, c.restitutionSpeed);
  visit(S{"restitutionThreshold", "m s^-1", any}, c.restitutionThreshold);
  visit(S{"coeffFriction", "1", any}, c.coeffFriction);
  visit(S{"coeffStaticFriction", "1", any}, c.coeffStaticFriction);
  visit(S{"tangentialRestitution", "1", unit}, c.tangentialRestitution);
  visit(S{"rollingFriction", "1", any}, c.rollingFriction);
  visit(S{"spinningFriction", "1", any}, c.spinningFriction);
  visit(S{"linearDamping", "s^-1", any}, c.linearDamping);
  visit(S{"angularDamping", "s^-1", any}, c.angularDamping);
  visit(S{"positionalCorrectionFactor", "1", unit}, c.positionalCorrectionFactor);
  visit(S{"contactTolerance", "1", tolerance}, c.contactTolerance);
  visit(S{"contactIterations", "1", any}, c.contactIterations);
  visit(S{"contactSubsteps", "1", any}, c.contactSubsteps);
  visit(S{"sleepSpeed", "m s^-1", any}, c.sleepSpeed);
  visit(S{"sleepTime", "s", positive}, c.sleepTime);
  visit(S{"broadPhase", "", any}, c.broadPhase);
  visit(S{"diagnosticsEnabled", "", any}, c.diagnosticsEnabled);
  visit(S{"logFrequency", "1", any}, c.logFrequency);
}

template <Real Scalar>
void SimulationConfig<Scalar>::validate() const {
  std::string faults;
  const auto fault = [&](const std::string& name, const std::string& value, const std::string& allowed) {
    faults += "\n  " + name + " is " + value + "; allowed: " + allowed;
  };
  forEachSetting(*this, [&]<class T>(const Setting<Scalar>& setting, const T& value) {
    if constexpr (std::is_same_v<T, Scalar>) {
      if (!setting.range.contains(value)) {
        fault(setting.name, detail::formatReal(value), setting.range.allowed(value));
      }
    } else if constexpr (std::is_enum_v<T>) {
      if (static_cast<std::size_t>(value) >= EnumNames<T>::values.size()) {
        fault(setting.name, std::to_string(static_cast<std::size_t>(value)), "a value of its enumeration");
      }
    }
  });
  if (bodyCount >= std::numeric_limits<std::uint32_t>::max()) {
    fault("bodyCount", std::to_string(bodyCount), "below 2^32 - 1");
  }
  if (isFinite(minTimeStep) && isFinite(timeStep) && timeStep > Scalar(0) && minTimeStep > timeStep) {
    fault("minTimeStep", detail::formatReal(minTimeStep), "at most timeStep");
  }
  const bool known = static_cast<std::size_t>(integrator) < EnumNames<IntegratorKind>::values.size();
  if (known && contactSubsteps != 1 && integrator != IntegratorKind::VelocityVerlet &&
      integrator != IntegratorKind::SymplecticEpicycle) {
    fault("contactSubsteps", std::to_string(contactSubsteps),
          std::string("1 with ") + traitsOf(integrator).name +
              "; others need one drift a step, VelocityVerlet or SymplecticEpicycle");
  }
  if (known && sleepSpeed > Scalar(0) &&
      (!traitsOf(integrator).contacts || integrator == IntegratorKind::SymplecticEpicycle)) {
    fault("sleepSpeed", detail::formatReal(sleepSpeed),
          std::string("0 with ") + traitsOf(integrator).name +
              (traitsOf(integrator).contacts ? ", in whose frame nothing rests" : ", which moves points"));
  }
  if (logFrequency == 0) {
    fault("logFrequency", "0", ">= 1");
  }
  if (!faults.empty()) {
    throw std::invalid_argument("gravel: SimulationConfig has fields out of range:" + faults);
  }
}

}  // namespace gravel
