#pragma once

/// \file
/// What blows lack until the forces of the end of their step are known.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/impact.hpp>
#include <gravel/spatial/domain.hpp>

#include <algorithm>
#include <span>
#include <utility>
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
/// and loses all of it. Blows after which a pair is pressed together, and friction, are left as they are; and
/// so is a pair that has turned by more than 60 degrees since. In a uniform field a_1 = a_0, and nothing
/// changes.
template <Real S>
class LateBlows {
 public:
  void clear() { blows_.clear(); }

  /// Takes up blows of a drift that is still to come. \param bodies with the accelerations a_0
  /// \param start [s] of their times, since a_0 was found  \param place of the first in the list of the step
  template <ContactBodies B>
  void take(std::span<const Impact<S>> impacts, const B& bodies, const S& start, std::size_t place) {
    for (const Impact<S>& impact : impacts) {
      const S apart = pull(bodies, impact);
      const bool stays = impact.rests && !(apart > S(0));
      if (!stays && !(impact.decided && impact.rests) && impact.speed > S(0)) {
        blows_.push_back({impact.first, impact.second, place, impact.normal, apart, S(start + impact.time),
                          impact.speed, impact.decided, impact.parting});
      }
      ++place;
    }
  }

  /// Makes up for all that were taken. \param bodies with the accelerations a_1, at the end of the step
  /// \param time [s] of that, for a sheared domain  \param h [s] from a_0 to a_1
  /// \param impulseOf  the impulse of the blow of a place
  /// \param change  of a body, the part of a_1 - a_0 of forces without a potential [m s^-2]
  /// \return loss to restitution, and the work that such forces did thereby [J]
  template <ContactBodies B, class ImpulseOf, class Change>
  std::pair<S, S> makeUp(B& bodies, const Domain<S>& domain, const S& time, const S& h, ImpulseOf&& impulseOf,
                         Change&& change) {
    S loss(0);
    S work(0);
    for (const Blow& blow : blows_) {
      const bool sticks = blow.decided && blow.parting == S(0);
      const S since = sticks ? blow.time : S(blow.time - h / S(2));
      const S du = (blow.pull - pull(bodies, blow)) * since / S(2);
      if (du == S(0)) {
        continue;
      }
      const bool boundary = blow.second == staticPartner;
      Vector3<S> n = blow.normal;
      if (!boundary) {
        n = domain.minimumImage(
            Vector3<S>(Vector3<S>(bodies.positions()[blow.second]) - bodies.positions()[blow.first]), time);
        n = detail::safeUnit(n);
      }
      const MassShares<S> share =
          massShares<S>(S(bodies.masses()[blow.first]), detail::isMovable(bodies, blow.first),
                        boundary ? S(0) : S(bodies.masses()[blow.second]),
                        !boundary && detail::isMovable(bodies, blow.second));
      if (!(S(2) * n.dot(blow.normal) > S(1)) || !(share.effective > S(0))) {
        continue;
      }
      S& jn = impulseOf(blow.place).normal;
      const S parting = blow.decided ? blow.parting : S(jn / share.effective - blow.speed);
      const S kept = std::min<S>(parting / blow.speed, S(1));
      const S dv = sticks ? S(0) : S((S(1) + kept) * du);
      if (share.first > S(0)) {
        bodies.velocities()[blow.first] -= Vector3<S>((share.first * dv) * n);
      }
      if (share.second > S(0)) {
        bodies.velocities()[blow.second] += Vector3<S>((share.second * dv) * n);
      }
      if (!blow.decided) {
        jn += share.effective * dv;
      }
      loss += share.effective * (blow.speed - kept * parting) * du;
      // Motion and loss have J du more, of which that much is no potential's.
      S along = share.second > S(0) ? S(-n.dot(Vector3<S>(change(blow.second)))) : S(0);
      if (share.first > S(0)) {
        along += n.dot(Vector3<S>(change(blow.first)));
      }
      work += share.effective * (blow.speed + parting) * along * since / S(2);
    }
    blows_.clear();
    return {loss, work};
  }

 private:
  struct Blow {
    std::uint32_t first;
    std::uint32_t second;
    std::size_t place;
    Vector3<S> normal;
    S pull;  ///< [m s^-2] n.(a_2 - a_1) of the two bodies
    S time;  ///< [s]
    S speed;
    bool decided;  ///< by somebody else, who gave
    S parting;     ///< [m s^-1] along the normal, 0 to two that shall merge
  };

  template <class B, class Pair>
  static S pull(const B& bodies, const Pair& pair) {
    S along(0);
    if (pair.second != staticPartner && detail::isMovable(bodies, pair.second)) {
      along += pair.normal.dot(Vector3<S>(bodies.accelerations()[pair.second]));
    }
    if (detail::isMovable(bodies, pair.first)) {
      along -= pair.normal.dot(Vector3<S>(bodies.accelerations()[pair.first]));
    }
    return along;
  }

  std::vector<Blow> blows_;
};

}  // namespace gravel
