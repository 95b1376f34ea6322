#pragma once

/// \file
/// Members of `ContactStage` that look for contacts, and say what touched.

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
  const bool searched = searched_;
  searched_ = false;
  const char* reason = reasonToSkip(bodies);
  if (reason != nullptr) {
    contacts_.clear();
    contactsChanged();
    profiler.skip(Phase::NeighbourSearch, reason);
    profiler.skip(Phase::NarrowPhase, reason);
    return;
  }
  if (!searched || !goesOn) {
    search(bodies, config, time, AtRest{}, profiler);
  }
  prepareSurfaces(config);
  gapStep_ = goesOn ? detail::nextGapStep(gapStep_, h) : std::max<Scalar>(gapStep_, h);
  NarrowPhaseSettings<Scalar> settings{time, config.epsilon, Scalar(0), gapStep_};
  if (goesOn) {
    settings.resting = names();
    settings.settled = settled();
  }
  settings.before = solver_.names();
  contactsChanged();
  if (goesOn && searched && settings.resting->empty() && settings.settled.empty() && report_.postponed == 0) {
    contacts_.clear();
    profiler.skip(Phase::NarrowPhase, "all that met on the way parted again");
    return;
  }
  const Profiler::Scope scope(profiler, Phase::NarrowPhase);
  narrow_.find(neighbours_.pairs(), bodies, domain, materials.view(), walls_, settings, contacts_,
               nearBoundaries(bodies, Scalar(0)));
  known_ = true;
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
std::size_t ContactStage<Scalar, Layout>::touches() const {
  std::size_t count = contacts_.size();
  struck_.clear();
  for (const Impact<Scalar>& impact : impacts()) {
    struck_.push_back({impact.key1, impact.key2});
  }
  std::sort(struck_.begin(), struck_.end());
  struck_.erase(std::unique(struck_.begin(), struck_.end()), struck_.end());
  for (const ContactKeys& keys : struck_) {
    const auto before = [&](const Contact<Scalar>& c) { return ContactKeys{c.key1, c.key2} < keys; };
    const auto found = std::partition_point(contacts_.begin(), contacts_.end(), before);
    count += found == contacts_.end() || ContactKeys{found->key1, found->key2} != keys ? 1U : 0U;
  }
  return count;
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::endPart(const Scalar& start, bool last) {
  if (!last) {
    record_.endPart(impacts_.impacts(), start);
    if (firstActed_) {
      record_.add(solver_.earlierImpulses(), [&](std::size_t k) { return solver_.earlierKeys(k); });
      firstActed_ = false;
    }
    if (acted_ && !contacts_.empty()) {
      record_.add(solver_.impulses(), [&](std::size_t k) {
        return ContactKeys{contacts_[k].key1, contacts_[k].key2};
      });
    }
    impacts_.clear();
  } else if (record_.hasParts()) {
    record_.addImpacts(impacts_.impacts(), start);
  }
}

template <Real Scalar, class Layout>
std::vector<ContactImpulse<Scalar>> ContactStage<Scalar, Layout>::impulses() const {
  std::vector<ContactImpulse<Scalar>> sum = solver_.copyImpulses();
  sum.resize(contacts_.size());
  record_.addTo(sum, contacts_);
  if (firstActed_) {
    record_.addTo(sum, contacts_, solver_.earlierImpulses(),
                  [&](std::size_t k) { return solver_.earlierKeys(k); });
  }
  return sum;
}

template <Real Scalar, class Layout>
auto ContactStage<Scalar, Layout>::allTouches() const -> Touches {
  Touches all{contacts_, impulses()};
  for (const Impact<Scalar>& impact : impacts()) {
    Contact<Scalar> c{};
    c.first = impact.first;
    c.second = impact.second;
    c.key1 = impact.key1;
    c.key2 = impact.key2;
    c.normal = impact.normal;
    c.arm1 = impact.distance;
    c.gap = c.arm2 = Scalar(0);  // a user's scalar may not begin at zero
    all.contacts.push_back(c, {});
    all.impulses.push_back(impact.impulse);
  }
  return all;
}

template <Real Scalar, class Layout>
template <class Pair>
bool ContactStage<Scalar, Layout>::renumber(const Bodies& bodies, Pair& pair) {
  const auto first = bodies.find(BodyId{pair.key1});
  const bool second = pair.second != staticPartner;
  const auto other = second ? bodies.find(BodyId{pair.key2}) : first;
  if (first && other) {
    pair.first = static_cast<std::uint32_t>(*first);
    pair.second = second ? static_cast<std::uint32_t>(*other) : staticPartner;
  }
  return first && other;
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::renumber(const Bodies& bodies) {
  for (Contact<Scalar>& c : contacts_) {
    (void)renumber(bodies, c);
  }
  for (auto* all : {&impacts_.impacts(), &record_.impacts()}) {
    for (Impact<Scalar>& impact : *all) {
      (void)renumber(bodies, impact);
    }
  }
  if (coloured_) {
    resumed_ = solver_.solved();  // the solver counts bodies by ids: it goes on as if nothing had been
    coloured_ = false;
  }
  known_ = false;  // indices are others
  moved_ = false;
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::Touches::keepPresent(const Bodies& bodies) {
  Touches present;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    Contact<Scalar> c = contacts[k];
    if (renumber(bodies, c)) {
      present.contacts.push_back(c, {});
      present.impulses.push_back(impulses[k]);
    }
  }
  *this = std::move(present);
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
                                          const Travel& travel, Profiler& profiler) {
  const Profiler::Scope scope(profiler, Phase::NeighbourSearch);
  neighbours_.setKind(config.broadPhase);
  neighbours_.update(bodies.positions(), detail::RestingReaches<Bodies>{bodies}, bodies.ids(),
                     bodies.revision(), domain, time, Scalar(0), travel);
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::prepareSurfaces(const Config& config) {
  const std::vector<Material<Scalar>>& surfaces = materials.renewed(config);
  walls_.clear();
  for (const Plane<Scalar>& plane : boundaries.planes()) {
    walls_.push_back({plane.normal, plane.offset, surfaces[static_cast<std::size_t>(plane.material)],
                      plane.velocity, plane.number, static_cast<std::uint32_t>(plane.material)});
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
      settled_.push_back({impact.key1, impact.key2});
    }
  }
  std::sort(settled_.begin(), settled_.end());
  return settled_;
}

}  // namespace gravel
