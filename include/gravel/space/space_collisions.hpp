#pragma once

/// \file
/// Members of `Space` that carry out what a user decides of collisions.

#include <gravel/contact/contact_outcomes.hpp>
#include <gravel/dynamics/epicycle.hpp>
#include <gravel/space/space.hpp>

#include <unordered_map>

namespace gravel {

/// Pairs that shall merge after this part of a step: those of the impacts inside it in their order, then
/// contacts at its end, `time`.
template <Real Scalar, class Layout>
BodyPairs Space<Scalar, Layout>::decideCollisions(const Scalar& time) {
  BodyPairs merges;
  if (contact_.collisionHook) {
    merges = contact_.merges();
    BodyPairs decided = merges;
    for (const Impact<Scalar>& impact : contact_.impactsOfPart()) {
      if (impact.decided && impact.rests) {
        decided.emplace_back(BodyId{impact.key1}, BodyId{impact.key2});
      }
    }
    const BodyPairs ends = decideTouching(time, contact_dt_, false, decided);
    merges.insert(merges.end(), ends.begin(), ends.end());
  }
  return merges;
}

/// Bodies that touch and approach. \param begins a step does: nothing has met them on their way
/// \param decided as in decideContacts()
template <Real Scalar, class Layout>
BodyPairs Space<Scalar, Layout>::decideTouching(const Scalar& time, const Scalar& h, bool begins,
                                                BodyPairs& decided) {
  if (!contact_.collisionHook) {
    return {};
  }
  const SimulationConfig<Scalar>& c = this->config_;
  ContactOutcomes<Scalar> outcomes = decideContacts<Scalar>(
      contacts(), bodies_, contact_.collisionHook, time, std::max<Scalar>(c.restitutionThreshold, c.epsilon),
      h, begins, contact_.memory(), decided);
  left_.restitution += outcomes.restitutionLoss;
  left_.friction += outcomes.frictionLoss;
  left_.work -= outcomes.driftWork;
  return std::move(outcomes.merges);
}

namespace detail {
/// From so many mergers on, what they did to the energy of mutual gravity is found for all together: by pairs
/// each costs O(N), which is as much for a few hundred as two sums over everybody by expansions.
inline constexpr std::size_t manyMergers = 256;
}  // namespace detail

/// One after the other. Of two, the fixed one stays, else the heavier, else the one of the smaller id; a
/// third that meets the one that went meets the one that stayed.
template <Real Scalar, class Layout>
void Space<Scalar, Layout>::mergeCollided(const BodyPairs& merges, const Scalar& time) {
  if (merges.empty()) {
    return;
  }
  std::unordered_map<std::uint64_t, BodyId> heir;
  const auto present = [&](BodyId id) {
    for (auto next = heir.find(toInteger(id)); next != heir.end(); next = heir.find(toInteger(id))) {
      id = next->second;
    }
    return id;
  };
  const bool together = merges.size() >= detail::manyMergers && getG() != Scalar(0);
  const auto pull = [&] {  // [J] of all
    force_.gravity.setDomain(contact_.domain, time);
    return force_.gravity.potentialEnergy(bodies_.positions(), bodies_.masses(), getG(),
                                          this->config_.softening);
  };
  const Scalar before = together ? pull() : Scalar(0);
  for (const auto& [id1, id2] : merges) {
    BodyId stays = present(id1);
    BodyId goes = present(id2);
    if (stays == goes) {
      continue;
    }
    const auto comesFirst = [&](BodyId a, BodyId b) {
      const BodyProxy x = body(a);
      const BodyProxy y = body(b);
      if (x.isFixed() != y.isFixed()) {
        return x.isFixed();
      }
      return x.mass() != y.mass() ? x.mass() > y.mass() : toInteger(a) < toInteger(b);
    };
    if (!comesFirst(stays, goes)) {
      std::swap(stays, goes);
    }
    heir.emplace(toInteger(goes), stays);
    merge(stays, goes, time, together ? Scalar(0) : getG());
  }
  left_.exchange += together ? Scalar(before - pull()) : Scalar(0);
  if (this->config_.sleepSpeed > Scalar(0)) {
    sleep_.startAnew(bodies_, merges);
  }
  forcesValid_ = false;
}

/// \param G  0: what mutual gravity gives or takes is booked elsewhere
template <Real Scalar, class Layout>
void Space<Scalar, Layout>::merge(BodyId stays, BodyId goes, const Scalar& time, const Scalar& G) {
  const std::size_t i = bodies_.indexOf(stays);
  const std::size_t j = bodies_.indexOf(goes);
  const Body<Scalar> a = bodies_[i].load();
  const Body<Scalar> b = bodies_[j].load();
  const auto factorOf = [](const BodyProxy& body) {
    const bool has = body.mass() > Scalar(0) && body.radius() > Scalar(0);
    return has ? Scalar(body.inertiaFactor()) : detail::homogeneousFactor<Scalar>();
  };
  const Vector apart = b.position - a.position;
  Vector r_ab = apart;
  Vector drift = Vector::Zero();
  contact_.domain.minimumImage(r_ab, drift, time);
  const Vector v_ab = Vector(b.velocity - a.velocity) + drift;
  // b goes into a as the image that a meets: that is work of the domain, as where b crosses an edge.
  const HillFrame<Scalar> frame(contact_.domain);
  const Vector shift = r_ab - apart;
  const Scalar sped = b.mass * drift.dot(Vector(b.velocity + drift / Scalar(2)));
  const Scalar seen = sped + b.mass * (frame.potential(Vector(b.position + shift)) -
                                       frame.potential(b.position) - force_.field.dot(shift));
  const Scalar motion = bodies_[i].kineticEnergy() + bodies_[j].kineticEnergy() + sped;
  const Scalar energy = bindingEnergy(i, time, G) + bindingEnergy(j, time, G) - pairEnergy(i, j, time, G);
  const Vector pull = Vector(bodies_[i].force()) + Vector(bodies_[j].force());
  const auto [one, k] =
      detail::mergedByFactors<Scalar>(a, factorOf(bodies_[i]), b, factorOf(bodies_[j]), r_ab, v_ab,
                                      Vector(Scalar(0), Scalar(0), frame.omega));
  bodies_[i].store(one);
  bodies_[i].inertiaFactor() = k;  // by itself: the inertia of a giant planet is no float
  if (!one.fixed) {
    bodies_[i].force() = pull;
    bodies_[i].acceleration() = pull / one.mass;
  }
  bodies_.remove(goes);
  const std::size_t now = bodies_.indexOf(stays);
  const Scalar lost = motion - bodies_[now].kineticEnergy();
  left_.restitution += lost;
  left_.work -= seen;
  left_.exchange += energy + seen - bindingEnergy(now, time, G) - lost;  // of the potential
}

}  // namespace gravel
