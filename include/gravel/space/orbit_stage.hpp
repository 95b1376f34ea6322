#pragma once

/// \file
/// The integrators that are more than a row of kicks and drifts, and what they remember from step to step.
/// They move points under forces; where bodies may touch they are refused.

#include <gravel/dynamics/gauss_radau.hpp>
#include <gravel/dynamics/hermite.hpp>
#include <gravel/dynamics/wisdom_holman.hpp>
#include <gravel/gravity/jerk_sum.hpp>
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

  /// \throws std::invalid_argument if bodies may touch something, or the domain has images, or a force's rate
  ///   of change is needed and not known, or there is no centre that moves, or a body has no orbit
  void check(IntegratorKind kind, const Bodies& bodies, const ContactStage<Scalar, Layout>& contact,
             const ForceStage<Scalar, Layout>& force) const {
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
    if (kind == IntegratorKind::Hermite4 && force.hook) {
      detail::refuse("user's own force with the " + who, "set",
                     "none: the method needs how forces change with time, which is known of gravity alone");
    }
    if (kind == IntegratorKind::WisdomHolman && !bodies.empty()) {
      wisdomHolman_.prepare(bodies);
    }
    for (std::size_t i = 0; bodies.size() > 1 && i < bodies.size(); ++i) {
      if (Scalar(bodies.radii()[i]) > Scalar(0)) {
        detail::refuse("radius of body " + std::to_string(toInteger(bodies[i].id())) + " with the " + who,
                       detail::formatReal(Scalar(bodies.radii()[i])), "0: it moves points, without contacts");
      }
    }
  }

  /// Advances all bodies by h [s], after check(). \param forces  as in integrate()
  template <class Forces>
  void advance(const SimulationConfig<Scalar>& config, Bodies& bodies, const Scalar& h,
               const ForceStage<Scalar, Layout>& force, Forces&& forces) {
    const Scalar half = h / Scalar(2);
    spin(bodies, half, h, force.hasTorques());
    if (config.integrator == IntegratorKind::WisdomHolman) {
      wisdomHolman_.advance(bodies, config.G, h, forces);
    } else if (config.integrator == IntegratorKind::Hermite4) {
      hermite_.setStepFactor(config.timeStepFactor);
      hermite_.setShortestStep(config.minTimeStep);
      jerks_.setLaw(config.G, config.softening);
      hermite_.advance(bodies, h, force.field, jerks_, [&] { forces(h); });
    } else {
      gaussRadau_.advance(bodies, h, static_cast<bool>(force.hook), forces);
    }
    spin(bodies, half, Scalar(0), force.hasTorques());
  }

  /// The step that the method asks for [s], within the limits of the configuration: Wisdom-Holman's is the
  /// longest always, since it is symplectic for a fixed step, and Hermite's, which takes shorter ones inside.
  Scalar nextStep(const Bodies& bodies, const SimulationConfig<Scalar>& config) const {
    if (config.integrator != IntegratorKind::GaussRadau15) {
      return config.timeStep;
    }
    const Scalar wanted = gaussRadau_.nextStep() > Scalar(0)
                              ? gaussRadau_.nextStep()
                              : GaussRadau15<Scalar>::firstStep(bodies, config.timeStep);
    // Where points fall on each other the step has no least: it would come down to where time stands still.
    const Scalar least = std::max<Scalar>(config.minTimeStep, config.timeStep * Scalar(1e-12));
    return std::clamp<Scalar>(wanted, least, config.timeStep);
  }

  std::uint64_t individualSteps() const { return hermite_.bodySteps(); }

  void save(const Bodies& bodies, SnapshotWriter& out) const {
    const std::vector<Scalar> state = gaussRadau_.state();
    out.array("Gauss-Radau", state.data(), state.size());
    const std::vector<Scalar> lost = wisdomHolman_.lost().lostParts(bodies);
    out.array("Wisdom-Holman", lost.data(), lost.size());
    const std::vector<Scalar> hermite = hermite_.state(bodies);
    out.array("Hermite", hermite.data(), hermite.size());
  }

  /// Of the bodies of the same file. \throws std::runtime_error if the file does not hold what save() writes
  void load(const gravel::Bodies<Scalar, SoA>& bodies, SnapshotReader& in) {
    if (!gaussRadau_.setState(in.finite<Scalar>("Gauss-Radau"))) {
      in.fail("holds a Gauss-Radau state of a wrong length");
    }
    wisdomHolman_.lost().setLostParts(bodies, in.finite<Scalar>("Wisdom-Holman"));
    if (!hermite_.setState(bodies, in.finite<Scalar>("Hermite"))) {
      in.fail("holds a Hermite state of a wrong length");
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
      if (!(drift == Scalar(0)) && (!detail::equalIsSame<Scalar> || !(w.squaredNorm() == Scalar(0)))) {
        body.orientation() = rotated(Quaternion<Scalar>(body.orientation()), w, drift);
      }
    });
  }

  GaussRadau15<Scalar> gaussRadau_;
  mutable WisdomHolman<Scalar> wisdomHolman_;  // to check is to prepare
  Hermite4<Scalar> hermite_;
  JerkSum<Scalar> jerks_;
};

}  // namespace gravel
