#pragma once

/// \file
/// Members of `ContactStage` that say what touched, and what it took.

#include <gravel/space/contact_stage.hpp>

namespace gravel {

/// What changes velocities between drift and kick changes the kick's work by F.dv kick, for which no drift
/// takes anything out of the potential, nor out of a hook's work, which is done on the way of drifts alone
/// (HookWork). Of two movable spheres these cancel in a uniform field; a fixed one takes its part away.
template <Real Scalar, class Layout>
Scalar ContactStage<Scalar, Layout>::separationWork(const ForceStage<Scalar, Layout>& force,
                                                    const Bodies& bodies, Scalar kick) const {
  Scalar work = separationLoss_;
  if (moved_) {
    const HillFrame<Scalar> frame(domain);
    const std::vector<Displacement<Scalar>>& all = solver_.displacements();
    work += orderedSum(all.size(), 512, Scalar(0), [&](std::size_t begin, std::size_t end) {
      Scalar sum(0);
      for (std::size_t k = begin; k < end; ++k) {
        const Displacement<Scalar>& d = all[k];
        const Vector3<Scalar> F = force.conservativeForce(bodies, d.body);
        sum += F.dot(d.shift) - kick * Vector3<Scalar>(bodies.forces()[d.body]).dot(d.change);
        if (frame.turns()) {
          const Vector3<Scalar> x = bodies[d.body].position();
          sum += Scalar(bodies[d.body].mass()) * (frame.potential(x - d.shift) - frame.potential(x));
        }
      }
      return sum;
    });
  }
  return work;
}

/// The share of the first half step's impulses J in the work of gravity and the field over the step. Kicks
/// do the work m a.(v before + v after) kick/2, and the drift takes it out of the potential at the velocity
/// in between. What J changes in the drift and in all later kicks, but not in the first one, leaves
/// -J.a kick: with it booked, what rests or rolls loses nothing over a step, to rounding, and the ledger
/// closes to the order of the integrator. So with a hook's force (HookWork).
template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::bookKick(const Bodies& bodies, const Scalar& kick) {
  const Eigen::Array<Scalar, 2, 1> losses = solver_.workOn([&](std::uint32_t i) {
    return Vector3<Scalar>(Vector3<Scalar>(bodies.forces()[i]) * (bodies[i].inverseMass() * kick));
  });
  report_.restitutionLoss += losses[0];
  report_.frictionLoss += losses[1];
}

/// So it is with torques, whose work HookWork takes to be the mean power at both ends of the step, the second
/// one after the impulses of the second half. These the kick before them has not seen.
template <Real Scalar, class Layout>
Scalar ContactStage<Scalar, Layout>::torqueWork(const Bodies& bodies, const Scalar& kick) const {
  if (contacts_.empty()) {
    return Scalar(0);
  }
  return kick * orderedSum(bodies.size(), 512, Scalar(0), [&](std::size_t begin, std::size_t end) {
           Scalar power(0);
           for (std::size_t i = begin; i < end; ++i) {
             const auto body = static_cast<std::uint32_t>(i);
             if (solver_.knows(body)) {
               power += Vector3<Scalar>(bodies.torques()[i]).dot(solver_.turnOf(body));
             }
           }
           return power;
         });
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::endPart(const Scalar& start, bool last) {
  carried_.clear();
  if (!last) {
    record_.endPart(impacts_.impacts(), start);
    if (firstActed_) {
      record_.add([&](auto&& visit) { forEachBefore(visit); });
      firstActed_ = false;
    }
    if (acted_ && !contacts_.empty()) {
      record_.add([&](auto&& visit) {
        const std::span<const ContactImpulse<Scalar>> now = solver_.impulses();
        for (std::size_t k = 0; k < now.size(); ++k) {
          visit(contacts_[k], now[k]);
        }
      });
    }
    impacts_.clear();
  } else if (record_.hasParts()) {
    record_.addImpacts(impacts_.impacts(), start);
  }
}

template <Real Scalar, class Layout>
template <class Visit>
void ContactStage<Scalar, Layout>::forEachBefore(Visit&& visit) const {
  const std::vector<ContactImpulse<Scalar>> impulses = solver_.earlierImpulses();
  auto now = contacts_.begin();
  auto ended = solver_.ended().begin();
  const auto reaches = [](auto& at, auto end, const ContactKeys& keys, auto&& nameOf) {
    while (at != end && nameOf(*at).keys < keys) {
      ++at;
    }
    return at != end && nameOf(*at).keys == keys;
  };
  const auto ofContact = [](const auto& c) { return ContactName::of(c); };
  const auto ofEnded = [](const auto& e) { return ContactName::of(e.contact); };
  for (std::size_t k = 0; k < impulses.size(); ++k) {
    const ContactKeys keys = solver_.earlierKeys(k);
    if (reaches(now, contacts_.end(), keys, ofContact)) {
      visit(*now, impulses[k]);
    } else if (reaches(ended, solver_.ended().end(), keys, ofEnded)) {
      visit(ended->contact, impulses[k]);
    }
  }
}

template <Real Scalar, class Layout>
StepRecord<Scalar> ContactStage<Scalar, Layout>::beforeLast() const {
  StepRecord<Scalar> sums = record_.ofContacts();
  if (firstActed_) {
    sums.add([&](auto&& visit) { forEachBefore(visit); });
  }
  return sums;
}

template <Real Scalar, class Layout>
std::vector<ContactImpulse<Scalar>> ContactStage<Scalar, Layout>::impulses() const {
  const std::vector<ContactImpulse<Scalar>> last = solver_.copyImpulses();
  const std::span<const ContactName> names = solver_.names();  // from a file those that bear something
  std::vector<ContactImpulse<Scalar>> sum(contacts_.size());
  for (std::size_t k = 0, of = 0; k < sum.size(); ++k) {
    while (of < names.size() && names[of].keys < contacts_[k].keys()) {
      ++of;
    }
    sum[k] = of < names.size() && names[of].keys == contacts_[k].keys() ? last[of] : sum[k];
  }
  beforeLast().addTo(sum, contacts_);
  return sum;
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::addEnded(const Bodies& bodies, Touches& all) const {
  const auto add = [&](Contact<Scalar> c, const ContactImpulse<Scalar>& impulse) {
    if (renumber(bodies, c)) {
      all.contacts.push_back(c, {});
      all.impulses.push_back(impulse);
    }
  };
  record_.forEachEnded(contacts_, add);
  for (const detail::EndedContact<Scalar>& first : solver_.ended()) {
    if (firstActed_) {
      add(first.contact, first.impulse);
    }
  }
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
void ContactStage<Scalar, Layout>::suspend() {
  if (coloured_) {
    resumed_ = solver_.solved();
    coloured_ = false;
  }
}

template <Real Scalar, class Layout>
bool ContactStage<Scalar, Layout>::renumber(const Bodies& bodies) {
  bool complete = true;
  for (Contact<Scalar>& c : contacts_) {
    complete = renumber(bodies, c) && complete;
  }
  for (Impact<Scalar>& impact : impacts()) {
    complete = renumber(bodies, impact) && complete;
  }
  revision_ = complete ? bodies.revision() : revision_;
  suspend();
  known_ = false;  // indices are others
  moved_ = false;
  return complete;
}

template <Real Scalar, class Layout>
auto ContactStage<Scalar, Layout>::present(const Bodies& bodies) const -> const Present& {
  if (present_.revision != bodies.revision()) {
    Present now{{{}, contacts_.surfaces}, {}, {}, bodies.revision()};
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
      Contact<Scalar> c = contacts_[k];
      if (renumber(bodies, c)) {
        now.contacts.contacts.push_back(c);
        now.places.push_back(static_cast<std::uint32_t>(k));
      }
    }
    for (Impact<Scalar> impact : impacts()) {
      if (renumber(bodies, impact)) {
        now.impacts.push_back(impact);
      }
    }
    present_ = std::move(now);
  }
  return present_;
}

template <Real Scalar, class Layout>
const ContactList<Scalar>& ContactStage<Scalar, Layout>::contacts(const Bodies& bodies) const {
  return revision_ == bodies.revision() ? contacts_ : present(bodies).contacts;
}

template <Real Scalar, class Layout>
const std::vector<Impact<Scalar>>& ContactStage<Scalar, Layout>::impacts(const Bodies& bodies) const {
  return revision_ == bodies.revision() ? impacts() : present(bodies).impacts;
}

template <Real Scalar, class Layout>
std::vector<ContactImpulse<Scalar>> ContactStage<Scalar, Layout>::impulses(const Bodies& bodies) const {
  std::vector<ContactImpulse<Scalar>> all = impulses();
  if (revision_ != bodies.revision()) {
    const std::vector<std::uint32_t>& places = present(bodies).places;
    for (std::size_t k = 0; k < places.size(); ++k) {
      all[k] = all[places[k]];
    }
    all.resize(places.size());
  }
  return all;
}

template <Real Scalar, class Layout>
std::size_t ContactStage<Scalar, Layout>::touches(const Bodies& bodies) const {
  const ContactList<Scalar>& ends = contacts(bodies);
  std::size_t count = ends.size();
  struck_.clear();
  for (const Impact<Scalar>& impact : impacts(bodies)) {
    struck_.push_back(impact.keys());
  }
  std::sort(struck_.begin(), struck_.end());
  struck_.erase(std::unique(struck_.begin(), struck_.end()), struck_.end());
  for (const ContactKeys& keys : struck_) {
    const auto before = [&](const Contact<Scalar>& c) { return c.keys() < keys; };
    const auto found = std::partition_point(ends.begin(), ends.end(), before);
    count += found == ends.end() || found->keys() != keys ? 1U : 0U;
  }
  return count;
}

template <Real Scalar, class Layout>
auto ContactStage<Scalar, Layout>::allTouches(const Bodies& bodies) const -> Touches {
  Touches all{contacts(bodies), impulses(bodies)};
  for (const Impact<Scalar>& impact : impacts(bodies)) {
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

/// Contacts of what merged are found again at the end of the next part. All others bear what they bore.
template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::endMerged(const Bodies& bodies, const BodyPairs& merges) {
  std::vector<std::uint64_t> ids;
  for (const auto& [one, other] : merges) {
    ids.insert(ids.end(), {toInteger(one), toInteger(other)});
  }
  std::sort(ids.begin(), ids.end());
  const auto isOther = [&](std::uint64_t id) { return std::binary_search(ids.begin(), ids.end(), id); };
  std::erase_if(contacts_.contacts, [&](Contact<Scalar>& c) {
    return isOther(c.key1) || (c.second != staticPartner && isOther(c.key2)) || !renumber(bodies, c);
  });
  std::erase_if(record_.impacts(), [&](Impact<Scalar>& impact) { return !renumber(bodies, impact); });
  late_.clear();
  contactsChanged();
  moved_ = false;
  revision_ = bodies.revision();
}

}  // namespace gravel
