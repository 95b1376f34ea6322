#pragma once

/// \file
/// The user's outcomes of collisions that the solver of simultaneous contacts would deal.

#include <gravel/contact/collision_outcome.hpp>
#include <gravel/contact/contact_bodies.hpp>
#include <gravel/contact/contact_list.hpp>
#include <gravel/contact/earlier_impulses.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gravel {

/// What a user decided of the contacts of a step, but for the velocities, which the bodies have by now.
template <Real Scalar>
struct ContactOutcomes {
  BodyPairs merges;                    ///< in the order of contacts
  Scalar restitutionLoss = Scalar(0);  ///< [J] of velocities that the user gave
  Scalar frictionLoss = Scalar(0);     ///< [J] of spins
  Scalar driftWork = Scalar(0);        ///< [J] put in by the shear of the domain, as in ContactReport
};

/// Asks `hook` about each contact of two bodies that approach faster than what rests picks up in a step, and
/// gives them the velocities of its outcome. What rests approaches by no more than `threshold`, rounding and
/// 2 |a_rel.n| h. Where both lean on others or stand, also by what a step's fall brings along n: of each no
/// more than |a| h, and than others hold it with along n, the root of the sum of the squares of (n.J). For in
/// a heap relative accelerations vanish, while nothing holds along a table. Where a step begins, nothing has
/// fallen since the last solve: two that touch and bore nothing in it do not rest on each other.
/// O(bodies + contacts log decided), one thread.
/// \param begins  a step does; else one, or a part of it, ends
/// \param borne of contacts in the last solve, sorted by keys, as contacts are
/// \param decided those about which it was asked in this step already; then those that it was asked about
/// now, too
template <Real S, ContactBodies B>
ContactOutcomes<S> decideContacts(const ContactView<S>& contacts, B& bodies, const CollisionHook<S>& hook,
                                  const S& time, const S& threshold, const S& h, bool begins,
                                  std::span<const StoredImpulse<S>> borne, BodyPairs& decided) {
  ContactOutcomes<S> outcomes;
  const auto partner = [&](std::uint32_t i, std::uint64_t id) {
    return typename Collision<S>::Partner{BodyId{id},
                                          bodies.masses()[i],
                                          bodies.radii()[i],
                                          !detail::isMovable(bodies, i),
                                          MaterialId{static_cast<std::uint32_t>(bodies.materials()[i])},
                                          detail::velocityOf(bodies, i),
                                          detail::spinOf(bodies, i)};
  };
  const auto fall = [&](std::uint32_t i) {
    return detail::isMovable(bodies, i) ? Vector3<S>(bodies.accelerations()[i])
                                        : Vector3<S>(Vector3<S>::Zero());
  };
  using Squares = Eigen::Matrix<S, 3, 3>;
  std::vector<Squares> loads(bodies.size(), Squares::Zero());  // J J^T of each body's contacts
  auto known = borne.begin();
  const auto bears = [&](const Contact<S>& c) {  // of contacts in their order
    while (known != borne.end() && known->keys() < c.keys()) {
      ++known;
    }
    return known != borne.end() && known->keys() == c.keys();
  };
  for (const Contact<S>& c : contacts) {
    if (bears(c)) {
      const Vector3<S> j = known->impulse.normal * c.normal + known->impulse.tangential;
      loads[c.first] += j * j.transpose();
      if (c.second != staticPartner) {
        loads[c.second] += j * j.transpose();
      }
    }
  }
  const auto stands = [&](std::uint32_t i) {
    return !detail::isMovable(bodies, i) || loads[i].trace() > S(0);
  };
  // A solve takes off what half a step brings.
  const auto held = [&](std::uint32_t i, const Vector3<S>& n) {
    using std::sqrt;
    const S load_sq = n.dot(Vector3<S>(loads[i] * n));
    const S most = load_sq > S(0) ? S(S(2) * sqrt(load_sq) / S(bodies.masses()[i])) : S(0);
    return detail::isMovable(bodies, i) ? std::min<S>(most, detail::safeNorm(fall(i)) * h) : S(0);
  };
  std::sort(decided.begin(), decided.end());
  const auto before = static_cast<std::ptrdiff_t>(decided.size());
  known = borne.begin();
  for (const Contact<S>& c : contacts) {
    const bool anew = begins && !bears(c) && !(c.gap > S(0));
    if (c.second == staticPartner) {
      continue;
    }
    const Vector3<S> v_rel =
        detail::velocityOf(bodies, c.second) + contacts.drift(c) - detail::velocityOf(bodies, c.first);
    const S approach = -c.normal.dot(v_rel);
    const Vector3<S> a1 = fall(c.first);
    const Vector3<S> a2 = fall(c.second);
    const S relative = anew ? S(0) : S(S(2) * h * detail::sizeOf<S>(c.normal.dot(Vector3<S>(a2 - a1))));
    const S sizes = detail::maxAbs(detail::velocityOf(bodies, c.first)) +
                    detail::maxAbs(detail::velocityOf(bodies, c.second)) +
                    h * (detail::maxAbs(a1) + detail::maxAbs(a2));
    const S noise = S(16) * detail::roundoff<S>() * sizes;
    const S rest = stands(c.first) && stands(c.second)
                       ? std::max<S>(relative, held(c.first, c.normal) + held(c.second, c.normal))
                       : relative;
    const std::pair pair(BodyId{c.key1}, BodyId{c.key2});
    if (!(approach > threshold + noise + rest) ||
        std::binary_search(decided.begin(), decided.begin() + before, pair)) {
      continue;
    }
    decided.push_back(pair);
    const Collision<S> hit{
        time,    partner(c.first, c.key1), partner(c.second, c.key2), c.normal, v_rel, contacts.material(c),
        approach};
    const CollisionOutcome<S> outcome = detail::outcomeOf(hook, hit);
    if (outcome.kind == CollisionKind::Merge) {
      outcomes.merges.push_back(pair);
    } else if (outcome.kind == CollisionKind::Velocities) {
      const auto give = [&](std::uint32_t i, const auto& side, const Vector3<S>& v, const Vector3<S>& w) {
        if (side.fixed) {
          return;
        }
        outcomes.restitutionLoss -=
            side.mass * Vector3<S>(v - side.velocity).dot(Vector3<S>(v + side.velocity)) / S(2);
        outcomes.frictionLoss -= detail::gainOfSpin<S>(bodies.inertiaFactors()[i], side.mass, side.radius,
                                                       side.angularVelocity, w);
        bodies.velocities()[i] = v;
        bodies.angularVelocities()[i] = w;
      };
      give(c.first, hit.first, outcome.velocity1, outcome.angularVelocity1);
      give(c.second, hit.second, outcome.velocity2, outcome.angularVelocity2);
      if (!hit.second.fixed) {
        const S sheared =
            hit.second.mass *
            Vector3<S>(outcome.velocity2 - hit.second.velocity).dot(Vector3<S>(contacts.drift(c)));
        outcomes.restitutionLoss -= sheared;
        outcomes.driftWork -= sheared;
      }
    }
  }
  return outcomes;
}

}  // namespace gravel
