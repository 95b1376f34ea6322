#pragma once

/// \file
/// Members of `Space` that make steps of a few free points: the same bits as those of space_substeps.hpp, in
/// less time.
///
/// Between two steps of `advanceTo` no user's code runs, so that nobody can have changed a body. Of a few
/// points the look whether somebody did, and the way from the storage and back, would cost more than gravity.

#include <gravel/dynamics/few_points.hpp>
#include <gravel/space/space.hpp>

namespace gravel {

/// Whether only gravity and the field move the bodies, as a few points that do not turn. A function of what a
/// restart takes up alone.
template <Real Scalar, class Layout>
bool Space<Scalar, Layout>::areFewPoints() const {
  if constexpr (Compensation<Scalar>::carries) {
    const SimulationConfig<Scalar>& c = this->config_;
    if (n() < 2 || n() > FewPoints<Scalar>::most || force_.hook || !contact_.domain.isOpen() ||
        !contact_.boundaries.empty() || !contacts().empty() || c.sleepSpeed > Scalar(0) || parts_ > 1 ||
        !(c.linearDamping == Scalar(0)) || !(c.angularDamping == Scalar(0)) ||
        force_.reasonToSkip(bodies_, getG()) != nullptr) {
      return false;
    }
    const IntegratorTraits method = traitsOf(c.integrator);
    bool plain = !method.stages.empty();
    for (const IntegratorStage& stage : method.stages) {
      plain = plain && stage.gradient == 0;
    }
    for (std::size_t i = 0; plain && i < n(); ++i) {
      const ConstBodyProxy one = bodies_[i];
      plain = !one.isHeld() && Scalar(one.radius()) == Scalar(0) && one.angularVelocity().isZero(Scalar(0));
    }
    return plain;
  } else {
    return false;
  }
}

/// A step of length h, and more of them while a whole one is left before `until`, if that is given.
/// \return how many more; the last one's time has yet to pass
template <Real Scalar, class Layout>
std::size_t Space<Scalar, Layout>::moveFewPoints(const Scalar& h, const Scalar* until,
                                                 Profiler::Step& timing) {
  std::size_t more = 0;
  if constexpr (Compensation<Scalar>::carries) {
    const IntegratorTraits method = traitsOf(this->config_.integrator);
    Compensation<Scalar>* const lost = this->config_.compensatedSummation ? &lost_ : nullptr;
    contact_dt_ = h;
    forcesValid_ = false;  // if gravity throws
    force_.gravity.setDomain(contact_.domain, time_);
    profiler_.method(Phase::Gravity, force_.gravity.name(force_.gravity.asMany(bodies_.masses())));
    FewPoints<Scalar> points;
    points.load(bodies_, lost);
    const auto gravity = [&](const auto& positions, const auto& masses, const auto& accelerations) {
      const Profiler::Scope scope(profiler_, Phase::Gravity);
      force_.gravity.accelerations(positions, masses, getG(), this->config_.softening, accelerations);
    };
    try {
      while (true) {
        {
          const Profiler::Scope scope(profiler_, Phase::Integration);
          points.step(method, h, force_.field, gravity);
        }
        const auto [now, low] = timeAfter(h);
        if (until == nullptr || !points.isFinite() || !(stepTowards(Scalar((*until - now) - low), h) == h)) {
          break;
        }
        time_ = now;
        timeRest_ = low;
        ++steps_;
        ++more;
        timing.next();
      }
    } catch (...) {
      points.store(bodies_, lost);
      throw;
    }
    points.store(bodies_, lost);
    profiler_.skip(Phase::Impacts, contact_.reasonToSkip(bodies_));
    contact_.detect(bodies_, this->config_, Scalar(time_ + h), h, true, profiler_);
    contact_.separate(bodies_, this->config_, Scalar(time_ + h), profiler_);
    rememberPlaces();
    resolveCollisions();
    forcesValid_ = true;
  }
  return more;
}

}  // namespace gravel
