#pragma once

/// \file
/// Members of `ContactStage` that look for contacts, and open them where they overlap.

#include <gravel/core/disjoint_sets.hpp>
#include <gravel/space/contact_stage.hpp>

namespace gravel {

template <Real Scalar, class Layout>
const char* ContactStage<Scalar, Layout>::reasonToSkip(const Bodies& bodies) const {
  if (idle_) {
    return "every body is fixed or asleep";
  }
  if (bodies.size() < 2 && boundaries.empty()) {
    return "one body and no boundary";
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (Scalar(bodies.radii()[i]) > Scalar(0)) {
      return nullptr;
    }
  }
  return "no body has a radius";
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::detect(const Bodies& bodies, const Config& config, const Scalar& time,
                                          const Scalar& h, bool goesOn, Profiler& profiler) {
  const bool searched = std::exchange(searched_, false);
  const bool grazed = std::exchange(grazed_, false);
  if (revision_ != bodies.revision()) {
    std::erase_if(impacts(), [&](Impact<Scalar>& impact) { return !renumber(bodies, impact); });
    revision_ = bodies.revision();
  }
  const char* reason = reasonToSkip(bodies);
  if (reason != nullptr) {
    contacts_.clear();
    contactsChanged();
    profiler.skip(Phase::NeighbourSearch, reason);
    profiler.skip(Phase::NarrowPhase, reason);
    return;
  }
  if (!searched || !goesOn) {
    search(bodies, config, time, AtRest{}, Scalar(0), profiler);
  }
  prepareSurfaces(config);
  anew_ = !goesOn;
  gapStep_ = goesOn ? detail::nextGapStep(gapStep_, h) : std::max<Scalar>(gapStep_, h);
  NarrowPhaseSettings<Scalar> settings{time, config.epsilon, Scalar(0), gapStep_};
  settings.resting = names();
  if (goesOn) {
    settings.settled = settled();
  } else {
    carryAll(bodies, h);
    settings.slow = std::max(config.restitutionThreshold, config.epsilon);
  }
  settings.before = solver_.names();
  settings.carried = carried_;
  contactsChanged();
  if (goesOn && searched && settings.resting->empty() && settings.settled.empty() && report_.postponed == 0 &&
      !grazed) {
    contacts_.clear();
    profiler.skip(Phase::NarrowPhase, "all that met on the way parted again");
    return;
  }
  const Profiler::Scope scope(profiler, Phase::NarrowPhase);
  findBends(bodies, Scalar(0));
  findLeaning(bodies, goesOn);
  settings.bend = bend_;
  settings.leaning = leaning_;
  narrow_.find(neighbours_.pairs(), bodies, domain, materials.view(), walls_, settings, contacts_,
               nearBoundaries(bodies, Scalar(0)));
  materials.note(bodies);
  carried_.clear();
  known_ = true;
}

/// What somebody changed between two steps acts from the start of the next one, and not from its middle on,
/// where contacts are found again. O(contacts) then.
template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::renewSurfaces(const Bodies& bodies, const Config& config) {
  if (contacts_.empty() || materials.isAsNoted(bodies, config)) {
    return;
  }
  materials.renewed(config);
  materials.note(bodies);
  bool changed = false;
  for (Contact<Scalar>& c : contacts_) {
    const std::uint32_t mine = bodies.materials()[c.first];
    const std::uint32_t other =
        c.second == staticPartner
            ? static_cast<std::uint32_t>(boundaries.at(c.key2 - boundaryKey(0)).material)
            : bodies.materials()[c.second];
    ContactSurface<Scalar> surface = contacts_.surface(c);
    surface.material = materials.view().pair(std::min(mine, other), std::max(mine, other));
    if (!detail::equalIsSame<Scalar> || !(surface == contacts_.surface(c))) {
      contacts_.setSurface(c, surface);
      changed = true;
    }
  }
  if (changed) {
    contactsChanged();
  }
}

/// What Hill's frame adds to accelerations, b(x, v) with a part B v that is linear in v. Before a drift of
/// length h, with the kick a h/2 done, what is held at the velocity u of before it stays in place in
///   0 = h v + h^2/2 b(v) + h^3/6 B b(v) + ...,   of which   v = u - (b(u) - h/6 B b(u)) h/2:
/// that mean bend. With b at the velocity that the kick has made, which contacts take back, what rests crept
/// by |B a| h^2/4 a unit of time. Of what slides or turns either is right to first order, as it must be.
/// \param ahead  [s] of the drift that follows; 0 for none
template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::findBends(const Bodies& bodies, const Scalar& ahead) {
  const HillFrame<Scalar> frame(domain);
  const Vector3<Scalar> origin(Scalar(0), Scalar(0), Scalar(0));
  bend_.resize(frame.turns() ? bodies.size() : 0);
  parallelFor(bend_.size(), 512, [&](std::size_t i) {
    const Vector3<Scalar> u = bodies.velocities()[i] - bodies.accelerations()[i] * (ahead / Scalar(2));
    const Vector3<Scalar> b = frame.acceleration(bodies.positions()[i], u);
    bend_[i] = b - frame.acceleration(origin, b) * (ahead / Scalar(6));
  });
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::checkSizes(const Bodies& bodies) const {
  if (domain.isOpen()) {
    return;
  }
  const Scalar most = domain.lengths().minCoeff() / Scalar(2);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!(Scalar(bodies.radii()[i]) <= most)) {
      detail::refuse("radius of body " + std::to_string(bodies.ids()[i]),
                     detail::formatReal(Scalar(bodies.radii()[i])),
                     "at most half an edge of the domain, " + detail::formatReal(most));
    }
  }
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::separate(Bodies& bodies, const Config& config, const Scalar& time,
                                            Profiler& profiler) {
  moved_ = false;
  separationLoss_ = Scalar(0);
  if (contacts_.empty()) {
    profiler.skip(Phase::Colouring, "no contacts");
    profiler.skip(Phase::PositionalCorrection, "no contacts");
    return;
  }
  colour(bodies, profiler);
  if (config.positionalCorrectionFactor == Scalar(0)) {
    profiler.skip(Phase::PositionalCorrection, "positionalCorrectionFactor is 0");
    return;
  }
  const Profiler::Scope scope(profiler, Phase::PositionalCorrection);
  // Of those that the impacts of this part of the step make one, no two are taken apart.
  if (!impacts_.merges().empty()) {
    detail::DisjointSets ones;
    ones.begin(bodies.size());
    for (const auto& [one, other] : impacts_.merges()) {
      ones.join(static_cast<std::uint32_t>(bodies.indexOf(one)),
                static_cast<std::uint32_t>(bodies.indexOf(other)));
    }
    ones.end();
    for (Contact<Scalar>& c : contacts_) {
      if (c.second != staticPartner && ones.of(c.first) == ones.of(c.second)) {
        c.gap = std::max<Scalar>(c.gap, Scalar(0));
      }
    }
  }
  const CorrectionSettings<Scalar> settings{
      .factor = config.positionalCorrectionFactor,
      .maxIterations = sweepsOfLooks(contacts_.size()),
      .islandLooks = usualLooks,
      .keepAngularMomentum = domain.isOpen()};  // images have none to keep
  separationLoss_ = solver_.correctPositions(bodies, settings).loss;
  moved_ = !solver_.displacements().empty();
  if (moved_) {
    renewGeometry(bodies, config, time);
  }
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::renewGeometry(const Bodies& bodies, const Config& config,
                                                 const Scalar& time) {
  wasMoved_.assign(bodies.size(), 0);
  for (const Displacement<Scalar>& d : solver_.displacements()) {
    wasMoved_[d.body] = 1;
  }
  parallelFor(contacts_.size(), 512, [&](std::size_t k) {
    Contact<Scalar>& c = contacts_[k];
    if (wasMoved_[c.first] == 0 && (c.second == staticPartner || wasMoved_[c.second] == 0)) {
      return;
    }
    const Vector3<Scalar> x1 = bodies.positions()[c.first];
    const Scalar r1 = bodies.radii()[c.first];
    if (c.second == staticPartner) {
      const HalfSpace<Scalar>& wall = *std::lower_bound(
          walls_.begin(), walls_.end(), c.key2 - boundaryKey(0),
          [](const HalfSpace<Scalar>& w, std::uint64_t number) { return w.number < number; });
      const Scalar gap = wall.normal.dot(x1) - wall.offset - r1;
      c.gap = c.gap > Scalar(0) ? gap : std::min<Scalar>(gap, Scalar(0));
      return;
    }
    Vector3<Scalar> r_12 = Vector3<Scalar>(bodies.positions()[c.second]) - x1;
    r_12 = domain.minimumImage(r_12, time);
    const Scalar r2 = bodies.radii()[c.second];
    // However far a pair was moved apart, it is a contact of this step all the same.
    const Touch<Scalar> touch =
        touchAt<Scalar>(r_12, detail::safeNorm(r_12), r1, Scalar(r1 + r2), c.key1, c.key2, config.epsilon);
    c.normal = touch.normal;
    c.gap = c.gap > Scalar(0) ? touch.gap : std::min<Scalar>(touch.gap, Scalar(0));
    c.arm1 = touch.arm1;
    c.arm2 = touch.arm2;
  });
}

template <Real Scalar, class Layout>
template <class Travel>
void ContactStage<Scalar, Layout>::search(const Bodies& bodies, const Config& config, const Scalar& time,
                                          const Travel& travel, const Scalar& h, Profiler& profiler) {
  const Profiler::Scope scope(profiler, Phase::NeighbourSearch);
  neighbours_.setKind(config.broadPhase);
  // Walls of fixed spheres that overlap have far more pairs than what falls on them has.
  const auto isFixed = [&](std::uint32_t i) { return i < bodies.size() && bodies[i].isFixed(); };
  if (!std::all_of(fixed_.begin(), fixed_.end(), isFixed)) {
    neighbours_.clear();
  }
  neighbours_.update(bodies.positions(), detail::RestingReaches<Bodies>{bodies}, bodies.ids(),
                     bodies.revision(), domain, time, Scalar(0), travel, h);
  if (neighbours_.rebuilt()) {
    fixed_.clear();
    for (std::uint32_t i = 0; i < bodies.size(); ++i) {
      if (isFixed(i)) {
        fixed_.push_back(i);
      }
    }
    if (fixed_.size() > 1) {
      neighbours_.leaveOut([&](const Pair& pair) { return isFixed(pair.first) && isFixed(pair.second); },
                           bodies.ids());
    }
  }
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::prepareSurfaces(const Config& config, const PartOfStep<Scalar>& part) {
  const std::vector<Material<Scalar>>& surfaces = materials.renewed(config);
  walls_.clear();
  for (const Plane<Scalar>& plane : boundaries.planes()) {
    walls_.push_back({plane.normal, plane.offset, surfaces[static_cast<std::size_t>(plane.material)],
                      plane.velocityAt(part.middle), plane.number, static_cast<std::uint32_t>(plane.material),
                      plane.swing() * part.length});
  }
}

template <Real Scalar, class Layout>
std::optional<std::span<const std::uint32_t>> ContactStage<Scalar, Layout>::nearBoundaries(
    const Bodies& bodies, const Scalar& h) {
  if (!domain.isOpen() || neighbours_.strays()) {
    return std::nullopt;
  }
  // Who looks for neighbours may not look for boundaries: whether the last update searched is not enough.
  const bool stale = std::exchange(searchesForWalls_, neighbours_.searches()) != neighbours_.searches();
  return nearWalls_.update(bodies.positions(), detail::RestingReaches<Bodies>{bodies}, walls_, stale,
                           neighbours_.skin(), Scalar(0), h);
}

template <Real Scalar, class Layout>
std::span<const ContactName> ContactStage<Scalar, Layout>::names() {
  if (coloured_) {
    return solver_.names();
  }
  detail::resizeAnew(names_, contacts_.size());
  parallelFor(contacts_.size(), 4096, [&](std::size_t k) { names_[k] = ContactName::of(contacts_[k]); });
  return names_;
}

template <Real Scalar, class Layout>
std::span<const ContactKeys> ContactStage<Scalar, Layout>::settled() {
  detail::clearSpare(settled_);
  for (const Impact<Scalar>& impact : impacts_.impacts()) {
    if (impact.rests) {
      settled_.push_back(impact.keys());
    }
  }
  std::sort(settled_.begin(), settled_.end());
  return settled_;
}

}  // namespace gravel
