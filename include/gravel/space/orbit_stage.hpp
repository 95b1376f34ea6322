#pragma once

/// \file
/// The integrators that are more than a row of kicks and drifts, and what they remember from step to step.
/// They move points under forces; where bodies may touch they are refused.

#include <gravel/dynamics/gauss_radau.hpp>
#include <gravel/output/snapshot.hpp>
#include <gravel/space/contact_stage.hpp>
#include <gravel/space/force_stage.hpp>
#include <gravel/space/simulation_config.hpp>

namespace gravel {

template <Real Scalar, class Layout>
class OrbitStage {
 public:
  using Bodies = gravel::Bodies<Scalar, Layout>;

  /// \return true if this stage moves the bodies with such an integrator
  static bool moves(IntegratorKind kind) { return traitsOf(kind).stages.empty(); }

  /// \throws std::invalid_argument if bodies may touch something, or the domain has images
  static void check(IntegratorKind kind, const Bodies& bodies, const ContactStage<Scalar, Layout>& contact) {
    if (!moves(kind)) {
      return;
    }
    const std::string who = std::string("integrator ") + traitsOf(kind).name;
    if (!contact.domain.isOpen()) {
      detail::refuse("domain with the " + who, "not open", "an open domain");
    }
    if (!contact.boundaries.empty()) {
      detail::refuse("number of boundaries with the " + who, "not 0", "0: it moves points, without contacts");
    }
    for (std::size_t i = 0; bodies.size() > 1 && i < bodies.size(); ++i) {
      if (Scalar(bodies.radii()[i]) > Scalar(0)) {
        detail::refuse("radius of body " + std::to_string(toInteger(bodies[i].id())) + " with the " + who,
                       detail::formatReal(Scalar(bodies.radii()[i])), "0: it moves points, without contacts");
      }
    }
  }

  /// Advances all bodies by h [s]. \param forces  as in integrate()
  template <class Forces>
  void advance(Bodies& bodies, const Scalar& h, const ForceStage<Scalar, Layout>& force, Forces&& forces) {
    const Scalar half = h / Scalar(2);
    spin(bodies, half, h, force.hasTorques());
    gaussRadau_.advance(bodies, h, static_cast<bool>(force.hook), forces);
    spin(bodies, half, Scalar(0), force.hasTorques());
  }

  /// The step that the method asks for [s], within the limits of the configuration.
  Scalar nextStep(const Bodies& bodies, const SimulationConfig<Scalar>& config) const {
    const Scalar wanted = gaussRadau_.nextStep() > Scalar(0)
                              ? gaussRadau_.nextStep()
                              : GaussRadau15<Scalar>::firstStep(bodies, config.timeStep);
    return std::clamp<Scalar>(wanted, config.minTimeStep, config.timeStep);
  }

  void save(SnapshotWriter& out) const {
    const std::vector<Scalar> state = gaussRadau_.state();
    out.array("Gauss-Radau", state.data(), state.size());
  }

  /// \throws std::runtime_error if the file does not hold what save() writes
  void load(SnapshotReader& in) {
    if (!gaussRadau_.setState(in.array<Scalar>("Gauss-Radau"))) {
      in.fail("holds a Gauss-Radau state of a wrong length");
    }
  }

 private:
  /// w += a kick, then turns by w drift: kick, drift, kick about the whole step.
  static void spin(Bodies& bodies, const Scalar& kick, const Scalar& drift, bool torques) {
    parallelFor(bodies.size(), detail::bodyGrain, [&](std::size_t i) {
      const auto body = bodies[i];
      if (body.isFixed()) {
        return;
      }
      if (torques) {
        body.angularVelocity() += body.angularAcceleration() * kick;
      }
      const Vector3<Scalar> w = body.angularVelocity();
      if (!(drift == Scalar(0)) && !(w.squaredNorm() == Scalar(0))) {
        body.orientation() = rotated(Quaternion<Scalar>(body.orientation()), w, drift);
      }
    });
  }

  GaussRadau15<Scalar> gaussRadau_;
};

}  // namespace gravel
