#pragma once

/// \file
/// Members of `ContactStage` that concern bodies which fall asleep and wake.

#include <gravel/space/contact_stage.hpp>

namespace gravel {

template <Real Scalar, class Layout>
std::span<const Displacement<Scalar>> ContactStage<Scalar, Layout>::movedApart(const Bodies& bodies) const {
  if (!moved_ || revision_ != bodies.revision()) {
    return {};
  }
  return solver_.displacements();
}

/// On the straight way to the place at h, and as far beside it as the path bends. What leans on something
/// does not fall, and what is slow comes near only when it touches: neighbours at rest would else wake each
/// other for ever.
template <Real Scalar, class Layout>
template <class Visit>
void ContactStage<Scalar, Layout>::forEachApproach(const Bodies& bodies, const Config& config,
                                                   const Scalar& time, const Scalar& h, Profiler& profiler,
                                                   Visit&& visit) {
  if (reasonToSkip(bodies) != nullptr) {
    return;
  }
  std::vector<unsigned char> leans(bodies.size(), 0);
  for (const Contact<Scalar>& c : contacts_) {
    leans[c.first] = 1;
    if (c.second != staticPartner) {
      leans[c.second] = 1;
    }
  }
  struct Ways {
    const Bodies& bodies;
    const std::vector<unsigned char>& leans;
    Scalar h;
    Vector3<Scalar> operator()(std::size_t i) const {
      return detail::isMovable(bodies, i)
                 ? Vector3<Scalar>(h * Vector3<Scalar>(bodies.velocities()[i]) + Scalar(4) * bend(i))
                 : Vector3<Scalar>(Vector3<Scalar>::Zero());
    }
    Vector3<Scalar> bend(std::size_t i) const {
      return detail::isMovable(bodies, i) && leans[i] == 0
                 ? Vector3<Scalar>(h * h / Scalar(8) * Vector3<Scalar>(bodies.accelerations()[i]))
                 : Vector3<Scalar>(Vector3<Scalar>::Zero());
    }
  } way{bodies, leans, h};
  search(bodies, config, time, way, h, profiler);
  for (const Pair& pair : neighbours_.pairs()) {
    const bool firstMoves = detail::isMovable(bodies, pair.first);
    if (firstMoves == detail::isMovable(bodies, pair.second)) {
      continue;
    }
    const std::uint32_t one = firstMoves ? pair.first : pair.second;
    const std::uint32_t held = firstMoves ? pair.second : pair.first;
    const Vector3<Scalar> w = way(one);
    const Vector3<Scalar> r = domain.minimumImage(
        Vector3<Scalar>(Vector3<Scalar>(bodies.positions()[held]) - bodies.positions()[one]), time);
    const Scalar w_sq = w.squaredNorm();
    const Scalar share =
        w_sq > Scalar(0) ? std::clamp<Scalar>(r.dot(w) / w_sq, Scalar(0), Scalar(1)) : Scalar(0);
    const bool fast = w_sq >= config.sleepSpeed * config.sleepSpeed * h * h;
    const Scalar radii = Scalar(bodies.radii()[one]) + Scalar(bodies.radii()[held]);
    const Scalar reach = detail::safeNorm(way.bend(one)) +
                         (fast ? Scalar(radii * (Scalar(1) + detail::restingMargin<Scalar>())) : radii);
    if (Vector3<Scalar>(r - share * w).squaredNorm() < reach * reach) {
      visit(held);
    }
  }
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::dropHeld(const Bodies& bodies) {
  const std::vector<StoredImpulse<Scalar>> before = solver_.memory();
  std::erase_if(contacts_.contacts, [&](const Contact<Scalar>& c) {
    return !detail::isMovable(bodies, c.first) &&
           (c.second == staticPartner || !detail::isMovable(bodies, c.second));
  });
  std::vector<StoredImpulse<Scalar>> memory;
  auto next = contacts_.begin();
  for (const StoredImpulse<Scalar>& stored : before) {
    while (next != contacts_.end() && byKeys(*next, stored)) {
      ++next;
    }
    if (next != contacts_.end() && next->keys() == stored.keys()) {
      memory.push_back(stored);
    }
  }
  solver_.setMemory(memory, solver_.memoryStep());
  contactsChanged();
  moved_ = false;
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::add(const ContactList<Scalar>& contacts,
                                       const std::vector<StoredImpulse<Scalar>>& memory) {
  const auto known = static_cast<std::ptrdiff_t>(contacts_.size());  // what merged is touched by its old id
  const auto isNew = [&](const auto& one) {
    return !std::binary_search(contacts_.begin(), contacts_.begin() + known, one, byKeys);
  };
  std::vector<StoredImpulse<Scalar>> all = solver_.memory();
  std::copy_if(memory.begin(), memory.end(), std::back_inserter(all), isNew);
  std::sort(all.begin(), all.end(), byKeys);
  solver_.setMemory(all, solver_.memoryStep());
  for (const Contact<Scalar>& c : contacts) {
    if (isNew(c)) {
      contacts_.push_back(c, contacts.surface(c));
    }
  }
  std::sort(contacts_.begin(), contacts_.end(), byKeys);
  for (const Plane<Scalar>& plane : boundaries.planes()) {  // which may have stopped since
    setDrift(plane.number, plane.velocity, Scalar(0));
  }
  contactsChanged();
  moved_ = false;
}

}  // namespace gravel
