#pragma once

/// \file
/// Members of `Space` that make the parts of a step.
///
/// With one drift a step: forces once a step, contacts in each part. In a step of length h in n parts the
/// acceleration a_0 of the step before is held, and every part of length h/n is a whole step of its own under
/// it: kick, contacts, impacts, drift, search, kick, contacts. Forces are evaluated once, at the places of
/// the end, and the last kick makes up for the held ones:
///   x_1 = x_0 + v_0 h + a_0 h^2/2,   v_1 = v_0 + a_0 h + (a_1 - a_0) h/2
/// Without contacts that is velocity Verlet itself, for any n: of order 2, symplectic, reversible. What rests
/// carries its weight in every part, so that nothing falls between two evaluations nor is thrown up by a kick
/// of the whole step's gravity, as it would be if forces came as impulses at the ends alone (r-RESPA:
/// Tuckerman, Berne & Martyna 1992, J. Chem. Phys. 97, 1990); without contacts both are the same map. A blow
/// meets a_0, off by h da/dt, as in a step of one part, until a_1 is known (LateBlows): order 2. Where bodies
/// merge after a part, forces are found there, twice: before, to make up for the held ones as at the end, or
/// what pulls each other would lose angular momentum; and after, to be held from then on. In a
/// shear-periodic domain the drift is no straight line: there a held force and one that kicks at the ends
/// differ by O(h^3) a step, so that with n > 1 order 2 is kept, but reversible the map is only up to that.
///
/// With several drifts a step: stages fly ahead and back (Yoshida's first one by 1.35 h, the next one by
/// -1.70 h), through whatever is in the way, and none of them ends where what rests could be held. So a step
/// in which anything touches is made of as many parts as the method evaluates forces, each a step of velocity
/// Verlet with forces of its own: it costs no more, contacts and impacts are what they are there, and the
/// error of the others is that of h/n, of order 2. All other steps have the order of the method.

#include <gravel/contact/gas_parts.hpp>
#include <gravel/dynamics/epicycle.hpp>
#include <gravel/space/space.hpp>

namespace gravel {

/// Most parts of a step that are chosen by motion.
inline constexpr std::size_t mostChosenSubsteps = 32;

/// The most contact steps in a step, for a setting of which 0 leaves the choice.
constexpr std::size_t mostContactSteps(std::size_t asked) { return asked == 0 ? mostChosenSubsteps : asked; }

/// Between the first kick and the drift: the contacts that the last part left, and the impacts on the way.
template <Real Scalar, class Layout>
struct Space<Scalar, Layout>::Departure {
  Space* space;
  Scalar start;  ///< [s] since the start of the step
  Scalar since;  ///< [s] since forces were last found
  Scalar h;
  Scalar length;  ///< [s] of the step
  PartOfStep<Scalar> part;
  bool meets;  ///< anything can touch; if not, kick and drift are one pass
  explicit operator bool() const { return meets; }
  void operator()(const Scalar& kick) const {
    if (!space->contacts().empty()) {
      space->contact_.drivePlanes(space->bodies_, part.middle, length);
      space->resolveCollisions(true);
      space->contact_.endFirstHalf(space->bodies_, kick);
      if (space->force_.hook) {
        space->contact_.tellChanges(space->bodies_, kick, space->force_.contactKicks);
      }
    }
    space->contact_.strike(space->bodies_, space->config_, HillFrame<Scalar>(space->contact_.domain),
                           Scalar(space->time_ + start), h, part, space->profiler_);
    space->contact_.keepBlows(space->bodies_, since);
    if (space->force_.hook) {
      space->force_.hookWork.turn(space->contact_.turns(), h);
    }
  }
};

/// Whether a step is several drifts, between which nothing can be held or struck.
template <Real Scalar, class Layout>
bool Space<Scalar, Layout>::hasSeveralDrifts() const {
  return traitsOf(this->config_.integrator).stages.size() > 1;
}

/// As many as `wanted`, 1 at least and mostChosenSubsteps at most.
template <Real Scalar>
std::size_t chosenSubsteps(const Scalar& wanted) {
  std::size_t parts = 1;
  while (parts < mostChosenSubsteps && Scalar(static_cast<double>(parts)) < wanted) {
    ++parts;
  }
  return parts;
}

/// In a gas as many as take the least time: detail::cheapestParts(). Only where parts are the same map, since
/// hardly anything touches, and forces depend on no body's place.
template <Real Scalar, class Layout>
std::size_t Space<Scalar, Layout>::partsOfGas(const Scalar& h) {
  constexpr std::size_t few = 256;  // are seen at once
  if (n() < few || contacts().size() > n() / 8 || !(getG() == Scalar(0)) || force_.hook ||
      this->config_.integrator != IntegratorKind::VelocityVerlet) {
    return 1;
  }
  return detail::cheapestParts<Scalar>(bodies_, contact_.domain, h, mostChosenSubsteps);
}

/// Into how many parts a step of length h is divided, as motion chooses. With one drift: no two bodies
/// that touch move past each other by more than a quarter of the smaller radius r in a part, nor would at the
/// speed of a fall by r at their relative acceleration, for the flanks of heaps creep in longer steps; and
/// piles held by their own gravity rest.
template <Real Scalar, class Layout>
std::size_t Space<Scalar, Layout>::chooseParts(const Scalar& h) {
  using std::sqrt;
  if (hasSeveralDrifts()) {
    return contact_.foresees(bodies_, this->config_, time_, h, profiler_)
               ? static_cast<std::size_t>(traitsOf(this->config_.integrator).forceEvaluations)
               : 1;
  }
  const std::size_t ofGas = partsOfGas(h);
  if (this->config_.contactSubsteps != 0) {
    return std::max(this->config_.contactSubsteps, ofGas);
  }
  const HillFrame<Scalar> frame(contact_.domain);
  const auto accelerationOf = [&](std::uint32_t i) {
    return detail::isMovable(bodies_, i)
               ? Vector(bodies_.accelerations()[i] +
                        frame.acceleration(bodies_.positions()[i], bodies_.velocities()[i]))
               : Vector(Vector::Zero());
  };
  Scalar rate_sq(0);
  for (const Contact<Scalar>& c : contacts()) {
    const Scalar r = detail::smallerRadius(c, bodies_);
    Vector v = contacts().drift(c) - detail::velocityOf(bodies_, c.first);
    Vector a = -accelerationOf(c.first);
    if (c.second != staticPartner) {
      v += detail::velocityOf(bodies_, c.second);
      a += accelerationOf(c.second);
    }
    rate_sq = std::max<Scalar>(rate_sq, v.squaredNorm() / (r * r));
    rate_sq = std::max<Scalar>(rate_sq, Scalar(2) * Scalar(sqrt(a.squaredNorm())) / r);
  }
  const Scalar rests = getG() == Scalar(0) ? Scalar(0) : Scalar(h / piles_.longest(bodies_, contacts()));
  const Scalar wanted = std::max<Scalar>(Scalar(4) * h * Scalar(sqrt(rate_sq)), rests);
  return std::max(chosenSubsteps<Scalar>(wanted), ofGas);
}

/// One part of a step of length h.
/// \param found  [s] since the start of the step, when forces were last found; set where they are anew
template <Real Scalar, class Layout>
void Space<Scalar, Layout>::advance(const Scalar& h, std::size_t part, std::size_t parts, Scalar& found) {
  forcesValid_ = false;  // if a hook throws
  force_.contactKicks.clear();
  const bool last = part + 1 == parts;
  const auto share = [&](std::size_t k) {
    return k == 0 ? Scalar(0)
                  : Scalar(h * (Scalar(static_cast<double>(k)) / Scalar(static_cast<double>(parts))));
  };
  const auto halves = [&](std::size_t k) {  // of parts, as a share of the step
    return Scalar(static_cast<double>(k)) / Scalar(static_cast<double>(2 * parts));
  };
  const Scalar start = share(part);
  const Scalar end = last ? h : share(part + 1);
  contact_dt_ = parts == 1 ? h : Scalar(h / Scalar(static_cast<double>(parts)));
  const bool apart = hasSeveralDrifts() && parts > 1;           // each part is a step with its own forces
  const bool held = !last && !apart;                            // forces go on as they are
  const Scalar span = apart ? contact_dt_ : Scalar(h - found);  // [s] from the last forces to those to come
  const HillFrame<Scalar> frame(contact_.domain);
  // Without mutual gravity runs are not long orbits, and nothing is carried; nor along an epicycle.
  const bool carry = this->config_.compensatedSummation && !(getG() == Scalar(0)) && !frame.turns() &&
                     Compensation<Scalar>::carries;
  Compensation<Scalar>* const lost = carry ? &lost_ : nullptr;
  const bool torques = force_.hasTorques();
  const auto kick = [&](const Scalar& time) {
    detail::kickAndDrift(bodies_, time, Scalar(0), torques, lost);
  };
  // Where velocities are half of `lag` behind but for the kicks of `late` that held forces gave [s], for
  // which the new ones make up.
  const auto find = [&](const Scalar& passed, const Scalar& lag, const Scalar& late,
                        std::span<const Vector> kicks) {
    if (late > Scalar(0)) {
      kick(Scalar(-late));  // back to the velocity of the middle, as one part has it here
    }
    // Stages of several drifts stand at no moment of their own. What is no row of kicks and drifts brings
    // velocities to the moment of the forces, or says what they lack, and kicks spins alone.
    Behind<Scalar> behind{.kicks = kicks};
    if (!hasSeveralDrifts() || apart) {
      behind.spins = lag / Scalar(2);
      behind.velocities = orbits_.moves(this->config_.integrator) ? Scalar(0) : behind.spins;
    }
    force_.evaluate(bodies_, getG(), this->config_.softening, contact_.domain,
                    Scalar(time_ + (start + passed)), profiler_, behind);
    if (late > Scalar(0)) {
      kick(late);
    }
  };
  const auto forces = [&](const Scalar& passed, std::span<const Vector> kicks = {}) {
    if (!held) {
      find(passed, span, Scalar(Scalar(span - contact_dt_) / Scalar(2)), kicks);
    }
  };
  const bool works = static_cast<bool>(force_.hook);
  const bool driftsFreely =
      apart || !(hasSeveralDrifts() || frame.turns() || orbits_.moves(this->config_.integrator));
  if (works) {
    if (part == 0 || apart) {
      force_.hookWork.begin(bodies_, force_.hookForces(), driftsFreely);
    } else {
      force_.hookWork.depart(bodies_);
    }
  }
  const auto bendWay = [&] {
    if (works && (!contacts().empty() || contact_.struck())) {
      force_.hookWork.bend();
    }
  };
  bendWay();
  const char* const alone = contact_.reasonToSkip(bodies_);
  const bool quiet = hasSeveralDrifts() && !apart;
  const Departure departure{this,
                            start,
                            apart ? Scalar(0) : Scalar(start - found),
                            contact_dt_,
                            h,
                            {halves(2 * part + 1), halves(2)},
                            !quiet && (alone == nullptr || !contacts().empty())};
  if (!departure && alone != nullptr) {
    profiler_.skip(Phase::Impacts, alone);
  }
  const auto arrival = [&] {
    if (works) {
      force_.hookWork.arrive(bodies_, contact_dt_);
    }
    contact_.boundaries.advance(contact_dt_, halves(2 * part + 1));
    left_.work -= contact_.wrap(bodies_, Scalar(time_ + end), force_.field, Scalar(contact_dt_ / Scalar(2)));
    if (works && frame.turns()) {
      force_.hookWork.cross(bodies_, contact_dt_);
    }
    contact_.detect(bodies_, this->config_, Scalar(time_ + end), contact_dt_, true, profiler_);
    contact_.separate(bodies_, this->config_, Scalar(time_ + end), profiler_);
  };
  {
    const Profiler::Scope scope(profiler_, Phase::Integration);
    if (orbits_.moves(this->config_.integrator)) {
      orbits_.advance(this->config_, bodies_, h, force_, forces);
      if (works) {
        force_.hookWork.arrive(bodies_, h);
      }
    } else if (frame.turns()) {
      integrateEpicycle(frame, bodies_, contact_dt_, torques, forces, arrival, departure);
    } else {
      integrate(apart ? IntegratorKind::VelocityVerlet : this->config_.integrator, bodies_, contact_dt_,
                torques, forces, arrival, departure, lost);
    }
  }
  rememberPlaces();
  left_.correction += contact_.separationWork(force_, bodies_, Scalar(contact_dt_ / Scalar(2)));
  const auto makeUpBlows = [&](const Scalar& since) {
    left_.work -= contact_.makeUpBlows(bodies_, Scalar(time_ + end), since, [&](std::size_t i) {
      return works ? force_.hookWork.changeOf(bodies_, force_.hookForces(), i) : Vector(Vector::Zero());
    });
  };
  if (!held) {
    makeUpBlows(span);
  }
  const BodyPairs merges = decideCollisions(Scalar(time_ + end));
  const bool anew = !last && !merges.empty();  // forces are found once more
  if (anew && held) {
    const Scalar passed = end - found;
    find(contact_dt_, passed, Scalar(passed / Scalar(2)), {});
    makeUpBlows(passed);
  }
  contact_.drivePlanes(bodies_, halves(2 * part + 2), h);
  resolveCollisions();
  bendWay();
  if (works) {
    left_.friction += contact_.torqueWork(bodies_, Scalar(contact_dt_ / Scalar(2)));
    force_.hookWork.endPart(bodies_, contact_dt_);
    if (!held || anew) {
      left_.work -= force_.hookWork.end(bodies_, force_.hookForces());
    }
  }
  contact_.endPart(start, last);
  forcesValid_ = true;
  mergeCollided(merges, Scalar(time_ + end));
  if (anew) {
    contact_.endMerged(bodies_, merges);
    force_.evaluate(bodies_, getG(), this->config_.softening, contact_.domain, Scalar(time_ + end),
                    profiler_);
    found = end;
    if (works) {
      force_.hookWork.begin(bodies_, force_.hookForces(), driftsFreely);
    }
  }
}

}  // namespace gravel
