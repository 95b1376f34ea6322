#pragma once

/// \file
/// Bodies that rest for long fall asleep, and wake when anything happens to them.
///
/// An island, movable bodies joined by contacts, falls asleep when each of its bodies has been slower than
/// `sleepSpeed`, also at its surface by spin and where it is moved out of others, for `sleepTime`, nothing
/// that it leans on moves, and what it leans on carries it: the impulses on it balance its forces. So nothing
/// falls asleep in flight. What sleeps stands still, keeps its impulses and pulls as before. It wakes
///   when something awake touches it, or comes as near within the next step, or strikes or drives what could
///   do so then,
///   when what it leans on is moved, removed, or moves,
///   when a fixed body is put into one of its bodies,
///   when somebody changes one of its bodies, or the surfaces,
///   when the acceleration of one of its bodies has changed by sleepSpeed/sleepTime, or by a 64th of the
///   island's mean, whichever is less.
/// An island wakes as a whole, with the contacts and impulses with which it fell asleep.

#include <gravel/contact/contact_islands.hpp>
#include <gravel/space/contact_stage.hpp>
#include <gravel/space/sleeping_island_snapshot.hpp>

#include <map>

namespace gravel {

/// Which islands sleep. All of it is a function of the state, in the order of indices: the same bits for any
/// number of threads.
template <Real Scalar, class Layout>
class SleepStage {
 public:
  using Bodies = gravel::Bodies<Scalar, Layout>;
  using Contacts = ContactStage<Scalar, Layout>;
  using Config = SimulationConfig<Scalar>;

  bool empty() const { return islands_.empty(); }

  /// All wake before the next step.
  void wakeAll() {
    for (SleepingIsland<Scalar>& island : islands_) {
      island.state = IslandState::Waking;
    }
    std::fill(slow_.begin(), slow_.end(), Scalar(0));
  }

  /// Before a step of length h: marks what somebody changed since the last one.
  void lookForChanges(const Bodies& bodies, const Contacts& contact, const Config& config, const Scalar& h) {
    if (!(surface_ == contact.materials.get(defaultMaterial, config))) {
      wakeAll();
    }
    for (SleepingIsland<Scalar>& island : islands_) {
      if (island.state != IslandState::Waking &&
          (!detail::asItWas(bodies, island) || isMoved(contact, island, h))) {
        island.state = IslandState::Waking;
      }
    }
    lookForFixed(bodies, contact.domain);
  }

  /// Tired islands fall asleep, if nobody gave them speed. \return the energy of motion that they lose [J]
  Scalar fallAsleep(Bodies& bodies, Contacts& contact, const Config& config) {
    Scalar lost(0);
    bool any = false;
    for (SleepingIsland<Scalar>& island : islands_) {
      if (island.state != IslandState::Tired) {
        continue;
      }
      if (!any) {
        follow(bodies);
        any = true;
      }
      // Bodies that touch when forces are found anew may have merged by now.
      const bool same = detail::asItWas(bodies, island);
      island.state = same ? IslandState::Asleep : IslandState::Waking;
      for (const RestingBody<Scalar>& member : island.members) {
        if (same && !isSlow(bodies[*detail::placeOf(bodies, member)], config)) {
          island.state = IslandState::Waking;
        }
      }
      for (const RestingBody<Scalar>& member : island.members) {
        const auto i = detail::placeOf(bodies, member);
        if (!i) {
          continue;
        }
        slow_[*i] = Scalar(0);
        if (island.state == IslandState::Waking) {
          continue;
        }
        const auto body = bodies[*i];
        lost += body.kineticEnergy();
        body.setAsleep(true);
      }
    }
    if (any) {
      putAside(bodies, contact);
    }
    return lost;
  }

  /// When forces are known: marks islands that are pulled otherwise than when they came to rest.
  void lookForPull(const Bodies& bodies, const Config& config);

  /// Marks islands that something awake touches.
  void lookForTouch(const Bodies& bodies, const Contacts& contact) {
    number(bodies);
    for (const Contact<Scalar>& c : contact.contacts(bodies)) {
      rouseByTouch(c);
    }
  }

  /// Marks islands that something awake comes near to in the next step, of length h.
  void lookForApproach(const Bodies& bodies, Contacts& contact, const Config& config, const Scalar& time,
                       const Scalar& h, Profiler& profiler) {
    if (islands_.empty() || contact.isIdle()) {
      return;
    }
    number(bodies);
    contact.forEachApproach(bodies, config, time, h, profiler, [&](std::uint32_t held) { rouse(held); });
  }

  /// Marked islands wake, with their contacts.
  void wake(Bodies& bodies, Contacts& contact) {
    ContactList<Scalar> contacts;
    std::vector<StoredImpulse<Scalar>> memory;
    bool any = false;
    for (const SleepingIsland<Scalar>& island : islands_) {
      if (island.state == IslandState::Waking) {
        any = true;
        release(bodies, contact, island, contacts, memory);
      }
    }
    if (any) {
      std::erase_if(islands_, [](const auto& island) { return island.state == IslandState::Waking; });
      contact.add(contacts, memory);
      numbered_ = false;
    }
  }

  /// After a step of length h, the last part of it `part`: marks what was touched or pulled otherwise and
  /// what is tired, and counts how long each body has been slow.
  void watch(const Bodies& bodies, const Contacts& contact, const Config& config, const Scalar& h,
             const Scalar& part);

  /// What has become of these pairs of ids has been slow for no time.
  void startAnew(const Bodies& bodies, const BodyPairs& merges) {
    follow(bodies);
    for (const auto& [one, other] : merges) {
      for (const BodyId id : {one, other}) {
        if (const auto i = bodies.find(id)) {
          slow_[*i] = Scalar(0);
        }
      }
    }
  }

  /// Adds the contacts of sleepers, with impulses as of a step of length h.
  void addTouches(const Bodies& bodies, typename Contacts::Touches& all, const Scalar& h) const {
    for (const SleepingIsland<Scalar>& island : islands_) {
      if (island.state == IslandState::Tired || !(island.span > Scalar(0)) ||
          !detail::asItWas(bodies, island)) {
        continue;  // still, or again, among the others
      }
      for (std::size_t k = 0; k < island.contacts.size(); ++k) {
        const Contact<Scalar>& c = island.contacts[k];
        all.contacts.push_back(detail::present(bodies, c), island.contacts.surface(c));
        all.impulses.push_back(detail::times(island.impulses[k], Scalar(h / island.span)));
      }
    }
  }

  void save(SnapshotWriter& out) const {
    detail::IslandRecord<Scalar> record;
    record.put(fixed_);
    for (const SleepingIsland<Scalar>& island : islands_) {
      record.put(island);
    }
    record.save(out);
    out.array("time slow", slow_.data(), slow_.size());
    out.array("ids of the slow", ids_.data(), ids_.size());
    out.value("surface of sleepers", surface_);
  }

  /// \throws std::runtime_error if the file does not hold what save() writes
  void load(SnapshotReader& in) {
    detail::IslandReader<Scalar> record(in);
    fixed_ = record.bodies();
    while (!record.done()) {
      islands_.push_back(record.island());
    }
    slow_ = in.finite<Scalar>("time slow");
    ids_ = in.array<std::uint64_t>("ids of the slow");
    surface_ = in.value<Material<Scalar>>("surface of sleepers");
    if (ids_.size() != slow_.size()) {
      in.fail("holds lists of different lengths");
    }
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  template <class Proxy>
  static bool isSlow(const Proxy& body, const Config& config) {
    const Scalar limit_sq = config.sleepSpeed * config.sleepSpeed;
    const Scalar r = body.radius();
    return Scalar(body.velocity().squaredNorm()) < limit_sq &&
           r * r * Scalar(body.angularVelocity().squaredNorm()) < limit_sq;
  }

  /// Whether a boundary that moves touches it within h [s].
  static bool isMoved(const Contacts& contact, const SleepingIsland<Scalar>& island, const Scalar& h) {
    for (const Plane<Scalar>& plane : contact.boundaries.planes()) {
      const Scalar way = detail::safeNorm(plane.velocity) * h;
      if (way == Scalar(0)) {
        continue;
      }
      for (const RestingBody<Scalar>& body : island.members) {
        const Scalar gap = plane.normal.dot(body.position) - plane.offset - body.radius;
        if (gap <= way + body.radius * detail::restingMargin<Scalar>()) {
          return true;
        }
      }
    }
    return false;
  }

  /// Times belong to bodies, wherever they stand by now.
  void follow(const Bodies& bodies) {
    bool same = ids_.size() == bodies.size();
    for (std::size_t i = 0; same && i < bodies.size(); ++i) {
      same = ids_[i] == bodies.ids()[i];
    }
    if (same) {
      return;
    }
    std::map<std::uint64_t, Scalar> known;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      known.emplace(ids_[i], slow_[i]);
    }
    ids_.resize(bodies.size());
    slow_.assign(bodies.size(), Scalar(0));
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      ids_[i] = bodies.ids()[i];
      const auto found = known.find(ids_[i]);
      slow_[i] = found == known.end() ? Scalar(0) : found->second;
    }
  }

  /// Islands by index.
  void number(const Bodies& bodies) {
    if (numbered_ && revision_ == bodies.revision()) {
      return;
    }
    islandOf_.assign(bodies.size(), none);
    for (std::size_t k = 0; k < islands_.size(); ++k) {
      for (RestingBody<Scalar>& member : islands_[k].members) {
        if (const auto i = detail::placeOf(bodies, member)) {
          member.index = static_cast<std::uint32_t>(*i);
          islandOf_[*i] = static_cast<std::uint32_t>(k);
        }
      }
    }
    numbered_ = true;
    revision_ = bodies.revision();
  }

  void rouse(std::uint32_t body) {
    const std::uint32_t k = body < islandOf_.size() ? islandOf_[body] : none;
    if (k != none && islands_[k].state == IslandState::Asleep) {
      islands_[k].state = IslandState::Waking;
    }
  }

  template <class Touching>
  void rouseByTouch(const Touching& c) {
    rouse(c.first);
    if (c.second != staticPartner) {
      rouse(c.second);
    }
  }

  void lookForFixed(const Bodies& bodies, const Domain<Scalar>& domain);
  void findTired(const Bodies& bodies, const Contacts& contact, const Config& config, const Scalar& h);
  void putAside(const Bodies& bodies, Contacts& contact);
  void release(Bodies& bodies, const Contacts& contact, const SleepingIsland<Scalar>& island,
               ContactList<Scalar>& contacts, std::vector<StoredImpulse<Scalar>>& memory);

  std::vector<SleepingIsland<Scalar>> islands_;
  std::vector<RestingBody<Scalar>> fixed_;  ///< bodies that cannot move, while islands_ are there
  std::vector<Scalar> slow_;                ///< [s] by index, how long a body has been slow
  std::vector<std::uint64_t> ids_;          ///< of these bodies
  Material<Scalar> surface_{};              ///< of the space, when the last island fell asleep
  ContactIslands groups_;
  std::vector<std::uint32_t> islandOf_;
  bool numbered_ = false;
  std::uint64_t revision_ = 0;
};

}  // namespace gravel

#include <gravel/space/sleep_stage_islands.hpp>
