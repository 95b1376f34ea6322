#pragma once

/// \file
/// Members of `Space` that make a step.
///
/// Order of a step of length h (in parts: space_substeps.hpp), with a(x) the acceleration of the last
/// evaluation:
///   0. where contacts were found anew, the blows of those that touch;
///   1. half a kick by the integrator's table; contacts of the last step are solved together, so that what
///      rests on something does not sink in the drift; impacts on the way are dealt at their own times;
///      drift;
///   2. when positions are final, contacts are found there, and overlaps shrink by moving bodies (no velocity
///      changes);
///   3. forces at those positions, last kick;
///   4. contacts are solved together on the velocities of the step's end, with restitution;
///   5. damping; 6. time passes, next step size; 7. diagnostics.
/// So contact forces take part in both halves of the step as all forces do in velocity Verlet (both
/// constraints of RATTLE, Andersen 1983, J. Comput. Phys. 52, 24, as inequalities; contact/turning_pair.hpp
/// for the first one): resting, rolling and sliding are of second order in h, and a body at rest has velocity
/// zero. A single solve at the end of the step lets piles sink by g h^2/2 and be lifted again every step,
/// which spins a rolling pile up.

#include <gravel/space/space.hpp>
#include <gravel/space/space_points.hpp>
#include <gravel/space/space_substeps.hpp>

namespace gravel {

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::computeDynamics(std::size_t iteration) {
  this->inStep_.refuse("computeDynamics()");
  const detail::StepInProgress::Scope inside(this->inStep_);
  prepare(dt_);
  step(dt_, iteration);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::advanceTo(Scalar time) {
  this->inStep_.refuse("advanceTo()");
  if (!isFinite(time) || time < time_) {
    detail::refuse("time to advance to", detail::formatReal(time),
                   "finite, at least the present time " + detail::formatReal(time_));
  }
  const detail::StepInProgress::Scope inside(this->inStep_);
  while (time_ < time) {
    const Scalar rest = (time - time_) - timeRest_;
    prepare(stepTowards(rest, dt_));
    const Scalar next = dt_;
    const Scalar h = stepTowards(rest, next);
    const bool alike = h == next && !this->config_.adaptiveTimeStep && !this->config_.diagnosticsEnabled;
    step(h, steps_, alike ? &time : nullptr);
    if (!this->config_.adaptiveTimeStep) {
      dt_ = next;
    }
    if (h == rest) {
      time_ = time;
      timeRest_ = Scalar(0);
    }
  }
}

/// The next step where steps of length h are wanted and `rest` of a run is left. The last two are alike where
/// less than two are left: a step much shorter than others would upset what rests. A rest of a millionth of a
/// step is joined to the step: it is rounding in the sum of steps.
template <Real Scalar, class Layout>
Scalar Space<Scalar, Layout>::stepTowards(const Scalar& rest, const Scalar& h) {
  const auto rounding = Scalar(1e-6);
  if (rest <= h * (Scalar(1) + rounding)) {
    return rest;
  }
  return rest < Scalar(2) * h * (Scalar(1) - rounding) ? Scalar(rest / Scalar(2)) : h;
}

/// The time when h more has passed, and what is lost to rounding then.
template <Real Scalar, class Layout>
std::pair<Scalar, Scalar> Space<Scalar, Layout>::timeAfter(const Scalar& h) const {
  const Scalar more = h + timeRest_;
  const Scalar sum = time_ + more;
  return {sum, more - (sum - time_)};
}

/// One step of length h. \param until  [s] if given, the space may go on with steps that are all alike while
///   whole ones are left before that time
template <Real Scalar, class Layout>
void Space<Scalar, Layout>::step(const Scalar h, std::size_t iteration, const Scalar* until) {
  if (const HillFrame<Scalar> frame(contact_.domain); frame.turns()) {  // while nothing has changed yet
    Epicycle<Scalar>::check(frame, h);
  }
  Profiler::Step timing(profiler_);
  std::size_t more = 0;
  contact_.beginStep();
  contact_.boundaries.beginStep(h, previous_dt_);
  previous_dt_ = h;
  if (!bodies_.empty()) {
    ledgerOpen_ = true;
    parts_ = chooseParts(h);
    if (areFewPoints()) {
      more = moveFewPoints(h, until, timing);
    } else {
      contact_dt_ = h / Scalar(static_cast<double>(parts_));
      if (contact_.strikeTouching(bodies_, this->config_, contact_dt_, profiler_) && force_.hook) {
        applyGravity();  // the user's force may depend on velocities
      }
      Scalar found(0);
      for (std::size_t part = 0; part < parts_; ++part) {
        advance(h, part, parts_, found);
      }
    }
    left_.restitution += contact_.report().restitutionLoss;
    left_.friction += contact_.report().frictionLoss;
    left_.work -= contact_.report().driftWork;
    applyDamping();
    if (this->config_.sleepSpeed > Scalar(0)) {
      sleep_.watch(bodies_, contact_, this->config_, h, contact_dt_);
    }
  } else {
    parts_ = 1;
    contact_.boundaries.advance(h);
    profiler_.skip(Phase::Integration, "no bodies");
  }
  contact_.boundaries.endStep();
  std::tie(time_, timeRest_) = timeAfter(h);
  ++steps_;
  stepGoesOn_ = contacts().empty() && impacts().empty();
  updateAdaptiveTimeStep();
  logSystemEnergy(iteration);
  profiler_.repeatSkips(more);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::check(const Scalar& h) const {
  bodies_.validateAll();
  contact_.materials.check(bodies_);
  contact_.checkSizes(bodies_);
  orbits_.check(this->config_.integrator, bodies_, contact_, force_);
  const HillFrame<Scalar> frame(contact_.domain);
  // One that is yet to be chosen is looked at when it is.
  if (frame.turns() && !Epicycle<Scalar>::takes(frame, h) &&
      (!this->config_.adaptiveTimeStep || (forcesValid_ && !placesChanged()))) {
    Epicycle<Scalar>::check(frame, h);
  }
}

/// Checks all bodies and a step of length h; then forces, contacts and the step of the present places, if a
/// body, its place, mass, radius or inertia was changed, or it became fixed or free, since they were found.
template <Real Scalar, class Layout>
void Space<Scalar, Layout>::prepare(const Scalar& h) {
  check(h);
  contact_.setIdle(false);  // until fallAsleep() has looked at those that came or woke
  BodyPairs decided;        // at this moment
  for (wakeTheChanged(); !forcesValid_ || placesChanged(); wakeTheChanged()) {
    forcesValid_ = false;  // if a hook throws
    applyGravity();
    sleep_.lookForPull(bodies_, this->config_);
    sleep_.wake(bodies_, contact_);
    stepGoesOn_ = false;
    updateAdaptiveTimeStep();  // contacts are taken to rest by what falls in a step
    buildCollisionGraph();
    rememberPlaces();
    updateAdaptiveTimeStep();
    if (!sleep_.empty()) {  // a sleeper is no fixed body to whoever decides
      sleep_.lookForTouch(bodies_, contact_);
      sleep_.wake(bodies_, contact_);
    }
    const BodyPairs merges = decideTouching(time_, dt_, true, decided);
    forcesValid_ = true;
    mergeCollided(merges, time_);
    std::vector<BodyId> others;  // who took in another is asked about anew
    for (const auto& [one, other] : merges) {
      others.insert(others.end(), {one, other});
    }
    std::sort(others.begin(), others.end());
    const auto isOther = [&](BodyId id) { return std::binary_search(others.begin(), others.end(), id); };
    std::erase_if(decided, [&](const auto& pair) { return isOther(pair.first) || isOther(pair.second); });
  }
  contact_.renewSurfaces(bodies_, this->config_);
  fallAsleep();
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::rememberPlaces() {
  placed_ = n();
  places_.resize(tileCount(n(), static_cast<int>(detail::tileWidth)));
  parallelForChunks<Share::Alike>(n(), detail::bodyGrain, [&](std::size_t begin, std::size_t end) {
    detail::forTilesOrBodies(
        bodies_.storage(), begin, end,
        [&](std::size_t i) { places_[i / detail::tileWidth].take(bodies_, i); },
        [&](std::size_t i) { places_[i / detail::tileWidth].takeOne(bodies_, i); });
  });
}

template <Real Scalar, class Layout>
bool Space<Scalar, Layout>::placesChanged() const {
  if (placed_ != n()) {
    return true;
  }
  const auto moved = orderedSum(n(), 1024, std::size_t{0}, [&](std::size_t begin, std::size_t end) {
    std::size_t count = 0;
    detail::forTilesOrBodies(
        bodies_.storage(), begin, end,
        [&](std::size_t i) { count += places_[i / detail::tileWidth].holds(bodies_, i, end) ? 0U : 1U; },
        [&](std::size_t i) { count += places_[i / detail::tileWidth].holdsOne(bodies_, i) ? 0U : 1U; });
    return count;
  });
  return moved > 0;
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::applyGravity() {
  force_.evaluate(bodies_, getG(), this->config_.softening, contact_.domain, time_, profiler_);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::buildCollisionGraph() {
  contact_.detect(bodies_, this->config_, time_, dt_, false, profiler_);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::resolveCollisions(bool drifts) {
  contact_.solve(bodies_, this->config_, contact_dt_, drifts, profiler_);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::applyDamping() {
  const SimulationConfig<Scalar>& c = this->config_;
  if (c.linearDamping == Scalar(0) && c.angularDamping == Scalar(0)) {
    profiler_.skip(Phase::Damping, "both rates are 0");
    return;
  }
  const Profiler::Scope scope(profiler_, Phase::Damping);
  left_.damping += damp(bodies_, c.linearDamping, c.angularDamping, previous_dt_, contact_.domain);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::updateAdaptiveTimeStep() {
  const SimulationConfig<Scalar>& c = this->config_;
  if (!c.adaptiveTimeStep) {
    profiler_.skip(Phase::TimeStep, "adaptiveTimeStep is off");
    return;
  }
  const Profiler::Scope scope(profiler_, Phase::TimeStep);
  if (orbits_.moves(c.integrator)) {
    dt_ = orbits_.nextStep(bodies_, c);
    return;
  }
  const StepLimits<Scalar> limits{c.timeStepFactor, c.minTimeStep, c.timeStep,
                                  Scalar(static_cast<double>(mostContactSteps(c.contactSubsteps)))};
  Scalar wanted = limits.largest;
  const bool pulls = !(getG() == Scalar(0)) && n() > 1;
  // A plane, a fixed body on which more than their own gravity presses others, or a force whose law is not
  // known, counts by the motion of single bodies.
  const auto holdsUp = [&] {
    const bool pressed = !(force_.field == Vector::Zero()) || HillFrame<Scalar>(contact_.domain).turns();
    std::size_t i = 0;
    while (pressed && i < n() && !bodies_[i].isFixed()) {
      ++i;
    }
    return pressed && i < n();
  };
  if (!pulls || force_.hook || !contact_.boundaries.empty() || holdsUp()) {
    wanted = stepFromMotion(bodies_, c.softening, limits, !contact_.boundaries.empty(), contact_.domain);
  }
  if (pulls) {
    wanted = std::min<Scalar>(
        wanted, stepFromEncounters(bodies_, getG(), c.softening, limits, contact_.domain, time_));
    wanted = std::clamp<Scalar>(limits.contactSteps * piles_.longest(bodies_, contacts()), limits.smallest,
                                wanted);
  }
  // A blow, or a change from outside, ends one smooth motion and begins another.
  dt_ =
      stepGoesOn_ ? std::clamp<Scalar>(reversibleStep(dt_, wanted), limits.smallest, limits.largest) : wanted;
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::handleCollision(BodyProxy& b1, BodyProxy& b2) {
  if (auto ctx = createCollisionContext(b1, b2)) {
    const std::tuple<Vector, Scalar, Scalar> blow = applyRestitutionImpulse(*ctx);
    applyFrictionImpulse(*ctx, std::get<1>(blow), std::get<0>(blow));
    resolveInterpenetration(*ctx);
  }
}

template <Real Scalar, class Layout>
auto Space<Scalar, Layout>::applyRestitutionImpulse(CollisionContext& ctx)
    -> std::tuple<Vector, Scalar, Scalar> {
  const NormalImpulse<Scalar> blow = applyNormalImpulse<Scalar, Layout>(
      ctx,
      restitutionAt<Scalar>(pairMaterial(ctx.body1.material(), ctx.body2.material()), -ctx.normalVelocity()),
      std::max(this->config_.restitutionThreshold, this->config_.epsilon));
  return {blow.impulse, blow.magnitude, blow.bias};
}

template <Real Scalar, class Layout>
auto Space<Scalar, Layout>::applyFrictionImpulse(const CollisionContext& ctx, Scalar jn,
                                                 const Vector& /*impulseN*/) -> Vector {
  const Material<Scalar> m = pairMaterial(ctx.body1.material(), ctx.body2.material());
  return gravel::applyFrictionImpulse<Scalar, Layout>(ctx, jn, m.staticFriction, m.kineticFriction,
                                                      m.tangentialRestitution);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::resolveInterpenetration(const CollisionContext& ctx) {
  gravel::separate<Scalar, Layout>(ctx, this->config_.positionalCorrectionFactor);
}

template <Real Scalar, class Layout>
Scalar Space<Scalar, Layout>::getEffectiveMass(const CollisionContext& ctx, const Vector& direction) const {
  return effectiveMass<Scalar, Layout>(ctx, direction);
}

}  // namespace gravel
