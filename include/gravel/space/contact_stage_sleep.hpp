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
/// other for ever. What is met fast, or by a boundary, is thrown on at up to twice that speed for the rest of
/// the step, what it meets then in its turn, and a boundary goes on behind them: whom they can reach so wakes
/// as well, or all where somebody may be thrown farther than two of their sizes: who is near enough would
/// have to be sought among all with all. (Each passes on at most the way that it had left; a row of bodies
/// ever lighter goes further.)
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
  const Scalar slow = config.sleepSpeed * h;             // [m]
  std::vector<Scalar> thrown(bodies.size(), Scalar(0));  // [m] whichever way, within the step
  bool far = false;                                      // farther than is sought for
  for (const Plane<Scalar>& plane : boundaries.planes()) {
    const Scalar way = h * Scalar(plane.normal.dot(plane.velocity) + detail::sizeOf<Scalar>(plane.swing()));
    for (std::size_t i = 0; way > slow && i < bodies.size(); ++i) {
      const Scalar gap =
          plane.normal.dot(Vector3<Scalar>(bodies.positions()[i])) - plane.offset - bodies.radii()[i];
      if (gap < way && bodies.radii()[i] > Scalar(0) && !bodies[i].isFixed()) {
        thrown[i] = std::max<Scalar>(thrown[i], Scalar(2) * (way - std::max<Scalar>(gap, Scalar(0))));
        far = far || thrown[i] > Scalar(4) * bodies.radii()[i];
      }
    }
  }
  struct Ways {
    const Bodies& bodies;
    const std::vector<unsigned char>& leans;
    const std::vector<Scalar>& thrown;
    Scalar h;
    Vector3<Scalar> operator()(std::size_t i) const {
      return detail::isMovable(bodies, i)
                 ? Vector3<Scalar>(h * Vector3<Scalar>(bodies.velocities()[i]) + Scalar(4) * fall(i))
                 : Vector3<Scalar>(Vector3<Scalar>::Zero());
    }
    Vector3<Scalar> bend(std::size_t i) const { return fall(i) + thrown[i] * Vector3<Scalar>::UnitX(); }
    Vector3<Scalar> otherBend(std::size_t i) const { return fall(i) - thrown[i] * Vector3<Scalar>::UnitX(); }
    Scalar mostBend(std::size_t i) const { return detail::sumAbs(fall(i)) + thrown[i]; }
    Vector3<Scalar> fall(std::size_t i) const {
      return detail::isMovable(bodies, i) && leans[i] == 0
                 ? Vector3<Scalar>(h * h / Scalar(8) * Vector3<Scalar>(bodies.accelerations()[i]))
                 : Vector3<Scalar>(Vector3<Scalar>::Zero());
    }
  } way{bodies, leans, thrown, h};
  const auto meets = [&](std::uint32_t one, std::uint32_t other) {
    const bool held = !detail::isMovable(bodies, other);
    const bool flies = thrown[one] > Scalar(0);
    if (!flies && !detail::isMovable(bodies, one)) {
      return false;
    }
    const Vector3<Scalar> w = way(one);
    const Vector3<Scalar> r = domain.minimumImage(
        Vector3<Scalar>(Vector3<Scalar>(bodies.positions()[other]) - bodies.positions()[one]), time);
    const bool strikes = r.dot(Vector3<Scalar>(w - way(other))) > slow * detail::safeNorm(r);
    if (!flies && !strikes && !held) {
      return false;
    }
    const Scalar w_sq = w.squaredNorm();
    const Scalar share =
        w_sq > Scalar(0) ? std::clamp<Scalar>(r.dot(w) / w_sq, Scalar(0), Scalar(1)) : Scalar(0);
    const bool fast = w_sq >= slow * slow;
    const Scalar radii = Scalar(bodies.radii()[one]) + Scalar(bodies.radii()[other]);
    const Scalar near = radii * (Scalar(1) + detail::restingMargin<Scalar>());
    const Scalar gap = std::max<Scalar>(detail::safeNorm(r) - radii, Scalar(0));
    const Scalar reach = detail::safeNorm(way.fall(one)) + (fast ? near : radii);
    const bool hit =
        detail::isMovable(bodies, one) && Vector3<Scalar>(r - share * w).squaredNorm() < reach * reach;
    Scalar on = thrown[one] - gap;
    if (hit && strikes) {
      on = std::max<Scalar>(on, Scalar(2) * (detail::safeNorm(w) - gap));
    }
    if (held && (hit || on > Scalar(0))) {
      visit(other);
    }
    far = far || on > Scalar(2) * radii;
    const bool further = on > thrown[other];
    thrown[other] = std::max<Scalar>(thrown[other], on);
    return further;
  };
  for (bool wider = true; wider && !far;) {
    wider = false;
    search(bodies, config, time, way, h, profiler);
    const std::span<const Pair> pairs = neighbours_.pairs();
    const auto pass = [&](const Pair& pair) {
      const bool on = !bodies[pair.second].isFixed() && meets(pair.first, pair.second);
      const bool back = !bodies[pair.first].isFixed() && meets(pair.second, pair.first);
      wider = wider || on || back;
      return on || back;
    };
    for (bool again = true; again && !far;) {
      again = false;  // by turns from both ends: rows are numbered one way or the other
      for (std::size_t k = 0; k < 2 * pairs.size(); ++k) {
        again = pass(pairs[k < pairs.size() ? k : 2 * pairs.size() - 1 - k]) || again;
      }
    }
  }
  for (std::uint32_t i = 0; far && i < bodies.size(); ++i) {
    if (!detail::isMovable(bodies, i) && !bodies[i].isFixed()) {
      visit(i);
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
  // Planes may have stopped since.
  setDrifts([](const Plane<Scalar>& plane) { return SurfaceDrift<Scalar>{plane.velocity, Scalar(0)}; });
  contactsChanged();
  moved_ = false;
}

}  // namespace gravel
