#pragma once

/// \file
/// What blows lack until the forces of the end of their step are known.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/impact.hpp>
#include <gravel/spatial/domain.hpp>

#include <algorithm>
#include <span>
#include <vector>

namespace gravel {

/// A blow at t meets v_m + a_0 (t - h/2): v_m the velocity of the drift, a_0 the acceleration of the step's
/// start. Turned round, the step would deal it at v_m + a_1 (t - h/2), with the one of its end. What falls
/// back after a bounce is pulled the same way in every such step, so that the difference has one sign: two
/// elastic spheres that bounce under their own gravity lost or gained O(h^2) of their energy in every blow.
/// By the mean of both accelerations a blow is the same both ways, and there is no drift. So the approach
/// speed u lacks
///     du = -n.(a_1 - a_0) (t - h/2)/2
/// and the pair's parting speed (J_n/m* u) du, which is made up when a_1 is known: along the line of centres
/// of that moment, for angular momentum's sake. What somebody else gave the two counts as a share of u as
/// well, up to all of it: more is none of u. Two that stick to each other until they merge never turn back:
/// they meet at the speed that the mean of a_0 and of a_1, which is that at the place of the blow, gives by
/// then, so that u lacks
///     du = -n.(a_1 - a_0) t/2,
/// and loses all of it. A slip that friction turned back, b times as fast, lacks (a_1 - a_0)_t (t - h/2)/2 in
/// the same way, and friction -(1 + b) m_t times that, as at the arms of that moment. Blows after which a
/// pair is pressed together, other friction, and what resists turning are left as they are; and so is a pair
/// that has turned by more than 60 degrees since, or of which the lighter one was struck `mostPerBody` times
/// since. In a uniform field a_1 = a_0, and nothing changes.
/// So much is right while du is small beside u. It counts as u at most, and so with the slip: no blow pulls,
/// nor strikes more than twice as hard. (By all of du, and in each of thousands of blows of a grain between
/// two others, which each turn round what the last one made up, balls gained 1e5 times their energy.)
template <Real S>
class LateBlows {
 public:
  /// What makeUp() adds to losses, and the work that forces without a potential did thereby [J].
  struct Made {
    S restitutionLoss = S(0);
    S frictionLoss = S(0);
    S work = S(0);
  };

  void clear() { blows_.clear(); }

  /// Takes up blows of a drift that is still to come. \param bodies with the accelerations a_0
  /// \param start [s] of their times, since a_0 was found  \param place of the first in the list of the step
  template <ContactBodies B>
  void take(std::span<const Impact<S>> impacts, const B& bodies, const S& start, std::size_t place) {
    for (const Impact<S>& impact : impacts) {
      const Vector3<S> pulled = pull(bodies, impact);
      const bool stays = impact.rests && !(impact.normal.dot(pulled) > S(0));
      if (!stays && !(impact.decided && impact.rests) && impact.speed > S(0)) {
        blows_.push_back({impact.first, impact.second, place, impact.normal, pulled, S(start + impact.time),
                          impact.speed, impact.decided, impact.parting, impact.fling});
      }
      ++place;
    }
  }

  /// Makes up for all that were taken. \param bodies with the accelerations a_1, at the end of the step
  /// \param time [s] of that, for a sheared domain  \param h [s] from a_0 to a_1
  /// \param impulseOf  the impulse of the blow of a place
  /// \param change  of a body, the part of a_1 - a_0 of forces without a potential [m s^-2]
  template <ContactBodies B, class ImpulseOf, class Change>
  Made makeUp(B& bodies, const Domain<S>& domain, const S& time, const S& h, ImpulseOf&& impulseOf,
              Change&& change) {
    Made made;
    findLast(bodies);
    for (const Blow& blow : blows_) {
      const bool sticks = blow.decided && blow.parting == S(0);
      if (!sticks && !blow.last) {
        continue;
      }
      const S since = sticks ? blow.time : S(blow.time - h / S(2));
      const Vector3<S> lack = (pull(bodies, blow) - blow.pull) * (since / S(2));
      if (detail::equalIsSame<S> && lack == Vector3<S>::Zero()) {
        continue;
      }
      const S all = -blow.normal.dot(lack);
      const S du = sticks ? all : std::clamp<S>(all, -blow.speed, blow.speed);
      const bool boundary = blow.second == staticPartner;
      Vector3<S> n = blow.normal;
      S distance = bodies.radii()[blow.first];
      S reach = distance;
      if (!boundary) {
        n = domain.minimumImage(
            Vector3<S>(Vector3<S>(bodies.positions()[blow.second]) - bodies.positions()[blow.first]), time);
        distance = detail::safeNorm(n);
        reach += bodies.radii()[blow.second];
        n = detail::safeUnit(n);
      }
      const MassShares<S> share =
          massShares<S>(S(bodies.masses()[blow.first]), detail::isMovable(bodies, blow.first),
                        boundary ? S(0) : S(bodies.masses()[blow.second]),
                        !boundary && detail::isMovable(bodies, blow.second));
      if (!(S(2) * n.dot(blow.normal) > S(1)) || !(share.effective > S(0))) {
        continue;
      }
      ContactImpulse<S>& impulse = impulseOf(blow.place);
      const S parting = blow.decided ? blow.parting : S(impulse.normal / share.effective - blow.speed);
      const S kept = std::min<S>(parting / blow.speed, S(1));
      Vector3<S> dv = (sticks ? S(0) : S((S(1) + kept) * du)) * n;
      // Motion and loss have J du more, of which a part is no potential's.
      const S counted = du == all ? S(1) : S(du / all);
      Vector3<S> blows = (counted * share.effective * (blow.speed + parting)) * blow.normal;
      made.restitutionLoss += share.effective * (blow.speed - kept * parting) * du;
      if (blow.fling > S(0)) {
        const S c = distance / reach;
        const S spin1 = spinOf(bodies, blow.first, share.first);
        const S spin2 = boundary ? S(0) : spinOf(bodies, blow.second, share.second);
        const S turned = (S(1) + blow.fling) / (S(1) + c * c * (spin1 + spin2));
        Vector3<S> slip = lack - n.dot(lack) * n;
        const S most = detail::safeNorm(impulse.tangential) / share.effective;
        const S size = turned * detail::safeNorm(slip);
        const S part = size > most ? S(most / size) : S(1);
        slip *= part;
        const Vector3<S> dv_t = slip * -turned;
        made.frictionLoss -= (S(1) - blow.fling) * impulse.tangential.dot(slip);
        blows += part * impulse.tangential;
        impulse.tangential += share.effective * dv_t;
        const Vector3<S> turn = c * n.cross(dv_t);
        twist(bodies, blow.first, spin1, turn);
        twist(bodies, blow.second, spin2, turn);
        dv += dv_t;
      }
      Vector3<S> others = Vector3<S>::Zero();
      if (share.first > S(0)) {
        bodies.velocities()[blow.first] -= Vector3<S>(share.first * dv);
        others -= Vector3<S>(change(blow.first));
      }
      if (share.second > S(0)) {
        bodies.velocities()[blow.second] += Vector3<S>(share.second * dv);
        others += Vector3<S>(change(blow.second));
      }
      if (!blow.decided) {
        impulse.normal += share.effective * n.dot(dv);
      }
      made.work -= blows.dot(others) * since / S(2);
    }
    blows_.clear();
    return made;
  }

 private:
  struct Blow {
    std::uint32_t first;
    std::uint32_t second;
    std::size_t place;
    Vector3<S> normal;
    Vector3<S> pull;  ///< [m s^-2] a_2 - a_1 of the two bodies
    S time;           ///< [s]
    S speed;
    bool decided;      ///< by somebody else, who gave
    S parting;         ///< [m s^-1] along the normal, 0 to two that shall merge
    S fling;           ///< of a slip that was turned back, the share
    bool last = true;  ///< one of those, see findLast()
  };

  /// Most blows of a body in a step that are made up, the last ones.
  static constexpr std::uint8_t mostPerBody = 4;

  /// Marks the last `mostPerBody` blows of each body in which it is the lighter one, or either of two as
  /// heavy. O(bodies), if there are more blows.
  template <ContactBodies B>
  void findLast(const B& bodies) {
    struck_.assign(blows_.size() > mostPerBody ? bodies.size() : 0, 0);
    for (auto blow = blows_.rbegin(); blow != blows_.rend() && !struck_.empty(); ++blow) {
      const bool alone = blow->second == staticPartner || !detail::isMovable(bodies, blow->second);
      const bool moves = detail::isMovable(bodies, blow->first);
      const S m1 = bodies.masses()[blow->first];
      const S m2 = alone ? m1 : S(bodies.masses()[blow->second]);
      const auto count = [&](std::uint32_t body) {
        if (struck_[body] < mostPerBody) {
          ++struck_[body];
        } else {
          blow->last = false;
        }
      };
      if (moves && (alone || !(m2 < m1))) {
        count(blow->first);
      }
      if (!alone && (!moves || !(m1 < m2))) {
        count(blow->second);
      }
    }
  }

  template <class B, class Pair>
  static Vector3<S> pull(const B& bodies, const Pair& pair) {
    Vector3<S> relative = Vector3<S>::Zero();
    if (pair.second != staticPartner && detail::isMovable(bodies, pair.second)) {
      relative += Vector3<S>(bodies.accelerations()[pair.second]);
    }
    if (detail::isMovable(bodies, pair.first)) {
      relative -= Vector3<S>(bodies.accelerations()[pair.first]);
    }
    return relative;
  }

  /// Share of a change of velocity over k in k m r^2; 0 of what cannot turn.
  template <class B>
  static S spinOf(const B& bodies, std::uint32_t i, const S& share) {
    const S k = bodies.inertiaFactors()[i];
    return k > S(0) && S(bodies.radii()[i]) > S(0) ? S(share / k) : S(0);
  }

  template <class B>
  static void twist(B& bodies, std::uint32_t i, const S& spin, const Vector3<S>& turn) {
    if (spin > S(0)) {
      bodies.angularVelocities()[i] -= Vector3<S>(turn * (spin / S(bodies.radii()[i])));
    }
  }

  std::vector<Blow> blows_;
  std::vector<std::uint8_t> struck_;  ///< by body, in findLast()
};

}  // namespace gravel
