#pragma once

/// \file
/// Members of `SleepStage` that make islands and undo them.

#include <gravel/space/sleep_stage.hpp>

namespace gravel {

template <Real Scalar, class Layout>
void SleepStage<Scalar, Layout>::watch(const Bodies& bodies, const Contacts& contact, const Config& config,
                                       const Scalar& h, const Scalar& part) {
  follow(bodies);
  if (!islands_.empty()) {
    lookForTouch(bodies, contact);
    for (const auto& impact : contact.impacts(bodies)) {
      rouseByTouch(impact);
    }
    lookForPull(bodies, config);
  }
  bool ready = false;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const bool slow = detail::isMovable(bodies, i) && isSlow(bodies[i], config);
    slow_[i] = slow ? Scalar(slow_[i] + h) : Scalar(0);
    ready = ready || slow_[i] >= config.sleepTime;
  }
  for (const Displacement<Scalar>& d : contact.movedApart(bodies)) {  // whatever its velocity is
    const bool slow = d.shift.squaredNorm() < config.sleepSpeed * config.sleepSpeed * part * part;
    slow_[d.body] = slow ? slow_[d.body] : Scalar(0);
  }
  if (ready) {
    findTired(bodies, contact, config, h);
  }
}

template <Real Scalar, class Layout>
void SleepStage<Scalar, Layout>::lookForPull(const Bodies& bodies, const Config& config) {
  for (SleepingIsland<Scalar>& island : islands_) {
    if (detail::isPulledOtherwise(bodies, island, Scalar(config.sleepSpeed / config.sleepTime))) {
      island.state = IslandState::Waking;
    }
  }
}

/// Marks islands into which a fixed body was put, moved or grown since the last look. O(bodies), and
/// O(sleepers) for each fixed body that is another one than before.
template <Real Scalar, class Layout>
void SleepStage<Scalar, Layout>::lookForFixed(const Bodies& bodies, const Domain<Scalar>& domain) {
  const auto isFixed = [&](std::size_t i) { return bodies[i].isFixed(); };
  std::size_t k = 0;
  bool same = true;
  for (std::size_t i = 0; same && i < bodies.size(); ++i) {
    if (isFixed(i)) {
      same = k < fixed_.size() && fixed_[k].id == bodies.ids()[i] && fixed_[k].holds(bodies[i]);
      ++k;
    }
  }
  if (same && k == fixed_.size()) {
    return;
  }
  std::map<std::uint64_t, const RestingBody<Scalar>*> before;
  for (const RestingBody<Scalar>& body : fixed_) {
    before.emplace(body.id, &body);
  }
  std::vector<RestingBody<Scalar>> now;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!isFixed(i)) {
      continue;
    }
    now.push_back(RestingBody<Scalar>::of(bodies[i]));
    const auto found = before.find(now.back().id);
    if (found != before.end() && found->second->holds(bodies[i])) {
      continue;
    }
    for (SleepingIsland<Scalar>& island : islands_) {
      for (const RestingBody<Scalar>& member : island.members) {
        // At no time in particular: in a sheared domain nothing sleeps.
        const Vector3<Scalar> r =
            domain.minimumImage(Vector3<Scalar>(member.position - now.back().position), Scalar(0));
        if (detail::safeNorm(r) < member.radius + now.back().radius) {
          island.state = IslandState::Waking;
        }
      }
    }
  }
  fixed_ = std::move(now);
}

/// Islands all of whose bodies have been slow for long enough, and which what they lean on carries.
template <Real Scalar, class Layout>
void SleepStage<Scalar, Layout>::findTired(const Bodies& bodies, const Contacts& contact,
                                           const Config& config, const Scalar& h) {
  const ContactList<Scalar>& touching = contact.contacts(bodies);
  groups_.find(std::span<const Contact<Scalar>>(touching.contacts), bodies);
  std::vector<unsigned char> rests(bodies.size(), 1);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!detail::isMovable(bodies, i) || slow_[i] < config.sleepTime) {
      rests[groups_.of(i)] = 0;
    }
  }
  std::vector<std::uint32_t> groupAt(bodies.size(), none);
  std::vector<SleepingIsland<Scalar>> found;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const std::uint32_t root = groups_.of(i);
    if (rests[root] == 0) {
      continue;
    }
    if (groupAt[root] == none) {
      groupAt[root] = static_cast<std::uint32_t>(found.size());
      found.emplace_back();
      found.back().span = h;
    }
    found[groupAt[root]].members.push_back(RestingBody<Scalar>::of(bodies[i]));
  }
  if (found.empty()) {
    return;
  }
  const std::vector<ContactImpulse<Scalar>> impulses = contact.impulses(bodies);
  std::vector<Vector3<Scalar>> push(found.size(), Vector3<Scalar>::Zero());
  for (std::size_t k = 0; k < touching.size(); ++k) {
    const Contact<Scalar>& c = touching[k];
    const bool firstMoves = detail::isMovable(bodies, c.first);
    const std::uint32_t place = groupAt[groups_.of(firstMoves ? c.first : c.second)];
    if (place == none) {
      continue;
    }
    found[place].contacts.push_back(c, touching.surface(c));
    found[place].impulses.push_back(impulses[k]);
    const Vector3<Scalar> j = impulses[k].normal * c.normal + impulses[k].tangential;
    if (c.second == staticPartner) {
      push[place] -= j;
    } else if (!firstMoves || !detail::isMovable(bodies, c.second)) {
      push[place] += firstMoves ? Vector3<Scalar>(-j) : j;
      found[place].supports.push_back(RestingBody<Scalar>::of(bodies[firstMoves ? c.second : c.first]));
    }
  }
  for (std::size_t k = 0; k < found.size(); ++k) {
    Scalar mass(0);
    Scalar weight(0);
    Vector3<Scalar> net = push[k];
    for (const RestingBody<Scalar>& body : found[k].members) {
      mass += body.mass;
      weight += body.mass * detail::safeNorm(body.acceleration);
      net += body.mass * h * body.acceleration;
    }
    found[k].fall = weight / mass;
    if (!(detail::safeNorm(net) * Scalar(16) > weight * h)) {
      if (islands_.empty()) {
        fixed_.clear();
        lookForFixed(bodies, contact.domain);
      }
      islands_.push_back(std::move(found[k]));
      surface_ = contact.materials.get(defaultMaterial, config);
      numbered_ = false;
    }
  }
}

/// Contacts of sleepers leave the list of those that are solved.
template <Real Scalar, class Layout>
void SleepStage<Scalar, Layout>::putAside(const Bodies& bodies, Contacts& contact) {
  const std::vector<StoredImpulse<Scalar>> memory = contact.memory();
  for (SleepingIsland<Scalar>& island : islands_) {
    if (island.state != IslandState::Asleep || island.solved > Scalar(0)) {
      continue;
    }
    island.solved = contact.memoryStep() > Scalar(0) ? contact.memoryStep() : island.span;
    auto next = memory.begin();
    for (const Contact<Scalar>& c : island.contacts) {
      next = std::lower_bound(next, memory.end(), c, byKeys);
      if (next != memory.end() && next->keys() == c.keys()) {
        island.memory.push_back(*next);
      }
    }
  }
  contact.dropHeld(bodies);
}

/// The bodies are awake; what the island kept is appended.
template <Real Scalar, class Layout>
void SleepStage<Scalar, Layout>::release(Bodies& bodies, const Contacts& contact,
                                         const SleepingIsland<Scalar>& island, ContactList<Scalar>& contacts,
                                         std::vector<StoredImpulse<Scalar>>& memory) {
  for (const RestingBody<Scalar>& member : island.members) {
    if (const auto i = detail::placeOf(bodies, member)) {
      bodies[*i].setAsleep(false);
    }
  }
  if (!(island.solved > Scalar(0))) {
    return;  // it was tired only: its contacts are among the others
  }
  const auto isThere = [&](std::uint64_t id) { return bodies.find(BodyId{id}).has_value(); };
  for (const Contact<Scalar>& c : island.contacts) {
    if (isThere(c.key1) && (c.second == staticPartner || isThere(c.key2))) {
      contacts.push_back(detail::present(bodies, c), island.contacts.surface(c));
    }
  }
  const Scalar ratio = contact.memoryStep() / island.solved;
  for (const StoredImpulse<Scalar>& stored : island.memory) {
    memory.push_back({stored.key1, stored.key2, detail::times(stored.impulse, ratio)});
  }
}

}  // namespace gravel
