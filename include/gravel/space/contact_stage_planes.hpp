#pragma once

/// \file
/// Members of `ContactStage` that concern planes which move, and who leans on what.

#include <gravel/contact/contact_islands.hpp>
#include <gravel/space/contact_stage.hpp>

namespace gravel {

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::setPlaneVelocity(std::size_t plane, const Vector3<Scalar>& velocity) {
  boundaries.setVelocity(plane, velocity);
  const SurfaceDrift<Scalar> now{velocity, Scalar(0)};
  if (contacts_.setDrifts([&](const Contact<Scalar>& c) {
        return c.second == staticPartner && c.key2 == boundaryKey(plane) ? &now : nullptr;
      })) {
    contactsChanged();
  }
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::drivePlanes(const Bodies& bodies, const Scalar& share, const Scalar& h) {
  const auto steady = [](const Plane<Scalar>& plane) { return plane.isSteady(); };
  if (!std::all_of(boundaries.planes().begin(), boundaries.planes().end(), steady)) {
    setDrifts([&](const Plane<Scalar>& plane) {
      return SurfaceDrift<Scalar>{plane.velocityAt(share), Scalar(2) * plane.swing()};
    });
  }
  findCarried(bodies, h);
}

/// From a plane that goes on speeding up by A into what leans on it, this is seen to fall by A more: contacts
/// give each body of its island as much. Without that what has no weight would never rest: nothing would tell
/// a gap of rounding from one that opens, nor what A h brings together from a blow. O(bodies + contacts)
/// where there is such a plane.
template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::findCarried(const Bodies& bodies, const Scalar& h,
                                               std::span<const Impact<Scalar>> settled) {
  carried_.clear();
  if (!(fastestSwing() > Scalar(0))) {
    return;
  }
  const std::vector<ContactName> touching = whoTouches(settled);
  const auto speedUp = [&](std::uint64_t key) {
    const std::size_t place = boundaries.find(key - boundaryKey(0));
    const auto& planes = boundaries.planes();
    return place < planes.size() ? Scalar(Scalar(2) * planes[place].swing() / h) : Scalar(0);
  };
  ContactIslands islands;
  islands.find(std::span<const ContactName>(touching), bodies);
  carried_.assign(bodies.size(), Scalar(0));
  for (const ContactName& name : touching) {
    if (name.second == staticPartner) {
      Scalar& most = carried_[islands.of(name.first)];
      most = std::max<Scalar>(most, speedUp(name.keys.second));
    }
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {  // an island's name is its smallest index
    carried_[i] = carried_[islands.of(i)];
  }
}

/// The same while it is not known who leans on whom.
template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::carryAll(const Bodies& bodies, const Scalar& h) {
  const Scalar most = fastestSwing();
  carried_.assign(most > Scalar(0) ? bodies.size() : 0, Scalar(Scalar(2) * most / h));
}

/// What leans on something that stands still in a turning frame, itself or through others: nothing answers
/// there to what the frame adds. While it is not known who leans on whom, all do, if anything stands still.
/// O(bodies + contacts) in such a frame.
template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::findLeaning(const Bodies& bodies, bool goesOn) {
  leaning_.clear();
  if (bend_.empty()) {
    return;
  }
  const auto isStill = [&](std::uint32_t i) { return i == staticPartner || !detail::isMovable(bodies, i); };
  if (!goesOn) {
    bool anyStill = !walls_.empty();
    for (std::uint32_t i = 0; i < bodies.size() && !anyStill; ++i) {
      anyStill = isStill(i);
    }
    leaning_.assign(anyStill ? bodies.size() : 0, 1);
    return;
  }
  const std::vector<ContactName> touching = whoTouches(impacts_.impacts());
  const auto stands = [&](const ContactName& name) { return isStill(name.first) || isStill(name.second); };
  if (std::none_of(touching.begin(), touching.end(), stands)) {
    return;
  }
  ContactIslands islands;
  islands.find(std::span<const ContactName>(touching), bodies);
  leaning_.assign(bodies.size(), 0);
  for (const ContactName& name : touching) {
    if (stands(name)) {
      leaning_[islands.of(isStill(name.first) ? name.second : name.first)] = 1;
    }
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {  // an island's name is its smallest index
    leaning_[i] = leaning_[islands.of(i)];
  }
}

/// Names of the contacts, and of those blows at whose end a pair rested.
template <Real Scalar, class Layout>
std::vector<ContactName> ContactStage<Scalar, Layout>::whoTouches(
    std::span<const Impact<Scalar>> settled) const {
  std::vector<ContactName> all;
  all.reserve(contacts_.size());
  for (const Contact<Scalar>& c : contacts_) {
    all.push_back(ContactName::of(c));
  }
  for (const Impact<Scalar>& impact : settled) {
    if (impact.rests) {
      all.push_back({impact.keys(), impact.first, impact.second});
    }
  }
  return all;
}

/// [m s^-1] >= 0, of the planes that speed up into what leans on them.
template <Real Scalar, class Layout>
Scalar ContactStage<Scalar, Layout>::fastestSwing() const {
  Scalar most(0);
  for (const Plane<Scalar>& plane : boundaries.planes()) {
    most = std::max<Scalar>(most, plane.swing());
  }
  return most;
}

/// What touches a plane sees it move as driftOf(plane) tells. Where all do already, nothing changes. O(planes
/// + contacts).
template <Real Scalar, class Layout>
template <class DriftOf>
void ContactStage<Scalar, Layout>::setDrifts(DriftOf&& driftOf) {
  std::vector<SurfaceDrift<Scalar>> drifts;
  drifts.reserve(boundaries.planes().size());
  for (const Plane<Scalar>& plane : boundaries.planes()) {
    drifts.push_back(driftOf(plane));
  }
  if (contacts_.setDrifts([&](const Contact<Scalar>& c) -> const SurfaceDrift<Scalar>* {
        const std::size_t place =
            c.second == staticPartner ? boundaries.find(c.key2 - boundaryKey(0)) : drifts.size();
        return place < drifts.size() ? &drifts[place] : nullptr;
      })) {
    contactsChanged();
  }
}

}  // namespace gravel
