#pragma once

/// \file
/// Which two bodies ask for the shortest step, among many: that come soonest to be deep in each other, or
/// pull each other round fastest.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/core/sizes.hpp>
#include <gravel/spatial/morton.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace gravel::detail {

/// What a rate of two bodies is made of.
template <class S>
struct PairMember {
  Vector3<S> x;
  Vector3<S> v;
  S r;
  S m;
  bool free;
};

/// [m^2] No distance counts as less, so that the square of its reciprocal stays in range: 9e-78 m, and 3e-10
/// m in a user's scalar of float's range.
template <class S>
S nearestSquared() {
  using std::sqrt;
  return S(1) / sqrt(highest<S>());
}

/// 0 where there is none.
template <class S>
S lesserPositive(const S& a, const S& b) {
  return a > S(0) && (!(b > S(0)) || a < b) ? a : b;
}

/// Bounds of some members.
template <class S>
struct PairBounds {
  Vector3<S> x_low, x_high, v_low, v_high;
  S least;  ///< radius of a sphere; 0 where there is none
  S most;
  S heaviest;
  bool free;

  static PairBounds of(const PairMember<S>& m) { return {m.x, m.x, m.v, m.v, m.r, m.r, m.m, m.free}; }
  void add(const PairBounds& other) {
    x_low = x_low.cwiseMin(other.x_low);
    x_high = x_high.cwiseMax(other.x_high);
    v_low = v_low.cwiseMin(other.v_low);
    v_high = v_high.cwiseMax(other.v_high);
    least = lesserPositive(least, other.least);
    most = std::max<S>(most, other.most);
    heaviest = std::max<S>(heaviest, other.heaviest);
    free = free || other.free;
  }
  /// Their least distance, by axis, and largest relative speed.
  Vector3<S> apart(const PairBounds& b) const {
    return Vector3<S>(Vector3<S>::Zero()).cwiseMax(x_low - b.x_high).cwiseMax(b.x_low - x_high);
  }
  Vector3<S> speed(const PairBounds& b) const { return (v_high - b.v_low).cwiseMax(b.v_high - v_low); }
};

/// v/(gap + r/4), squared [s^-2], of pairs with at least one sphere, one of them free: v is their relative
/// speed, gap that between their surfaces, 0 if they overlap, r the smaller radius, or that of the only
/// sphere.
template <class S>
struct MeetingRate {
  S of(const PairMember<S>& a, const PairMember<S>& b) const {
    return rate(a.free || b.free, lesserPositive(a.r, b.r), Vector3<S>(a.x - b.x), S(a.r + b.r),
                Vector3<S>(a.v - b.v));
  }
  /// No pair of theirs has more.
  S bound(const PairBounds<S>& a, const PairBounds<S>& b) const {
    return rate(a.free || b.free, lesserPositive(a.least, b.least), a.apart(b), S(a.most + b.most),
                a.speed(b));
  }

 private:
  static S rate(bool free, const S& r, const Vector3<S>& apart, const S& radii, const Vector3<S>& v) {
    using std::sqrt;
    if (!(r > S(0)) || !free) {
      return S(0);
    }
    const S way = r / S(4) + std::max<S>(S(sqrt(S(apart.squaredNorm()))) - radii, S(0));
    return v.squaredNorm() / (way * way);
  }
};

/// The rate of encounter_step.hpp times T, to the eighth power, of pairs that are not both fixed.
template <class S>
struct EncounterRate {
  S G;          ///< [m^3 kg^-1 s^-2]
  S T;          ///< [s]
  S softening;  ///< [m]
  S nearest = nearestSquared<S>();

  S of(const PairMember<S>& a, const PairMember<S>& b) const {
    const S touching = a.r + b.r;
    const S s = std::max<S>(Vector3<S>(a.x - b.x).squaredNorm(), touching * touching) + softening * softening;
    // Two points in one place do not pull each other.
    return (a.free || b.free) && s > S(0) ? rate(S(a.m + b.m), s, Vector3<S>(a.v - b.v)) : S(0);
  }
  S bound(const PairBounds<S>& a, const PairBounds<S>& b) const {
    const S mass = a.heaviest + b.heaviest;
    const S s = a.apart(b).squaredNorm() + softening * softening;
    const S none = (a.free || b.free) && mass > S(0) ? highest<S>() : S(0);
    return none > S(0) && s > S(0) ? rate(mass, s, a.speed(b)) : none;
  }

 private:
  S rate(const S& mass, const S& s, const Vector3<S>& v) const {
    const S near = S(1) / std::max<S>(s, nearest);
    const S fly = v.squaredNorm() * near * T * T;
    const S pull = mass * G * T * T * near;
    const S fall = pull * pull * near;  // in this order neither the cube of near nor pull^2 need be in range
    return (fall * fly * fly + fall * fall) / S(2);
  }
};

/// The largest rate of any pair. Bodies stand along a Morton curve, eight to a leaf of a binary tree whose
/// nodes know the bounds of places, velocities, radii and masses; a leaf looks only into nodes whose bounds
/// allow for more than was found so far. O(N log N) where few pairs are near each other; the same for any
/// number of threads and any order of the bodies.
template <class S>
class LargestPairRate {
 public:
  template <class BodiesType>
  explicit LargestPairRate(const BodiesType& bodies) {
    const std::vector<std::size_t> order = mortonOrderToTheEnd(bodies.positions(), leafSize);
    members_.resize(order.size());
    parallelFor(order.size(), chunk, [&](std::size_t k) {
      const auto body = bodies[order[k]];
      members_[k] = {body.position().template cast<S>(), body.countingVelocity().template cast<S>(),
                     S(body.radius()), S(body.mass()), !body.isFixed()};
    });
    plant();
  }

  /// \param law  MeetingRate or EncounterRate
  /// \return 0 if no pair has any; `enough` if it is that or more, which is found sooner
  template <class Law>
  S of(const Law& law, const S& enough) const {
    // The better the first guess, the less is looked at: neighbours along the curve, and who is near the
    // heaviest.
    S most(0);
    const auto heaviest = std::max_element(members_.begin(), members_.end(),
                                           [](const Member& a, const Member& b) { return a.m < b.m; });
    for (std::size_t k = 1; k < members_.size(); ++k) {
      most = std::max<S>(most, law.of(members_[k - 1], members_[k]));
    }
    for (auto other = members_.begin(); other != members_.end(); ++other) {
      most = std::max<S>(most, other == heaviest ? S(0) : law.of(*heaviest, *other));
    }
    if (!(most < enough)) {
      return enough;
    }
    most = -orderedMin(leaves_, leavesOfTask, S(-most),
                       [&](std::size_t leaf) { return S(-look(law, leaf, most, enough)); });
    return std::min<S>(most, enough);
  }

 private:
  static constexpr std::size_t chunk = 2048;
  static constexpr std::size_t leafSize = 8;
  static constexpr std::size_t leavesOfTask = 64;
  static constexpr std::size_t deepest = 64;  ///< levels: halves of less than 2^64 leaves

  using Member = PairMember<S>;
  using Node = PairBounds<S>;

  /// Node k of a level holds those of 2k and 2k + 1 of the level below; the last one may hold one alone.
  void plant() {
    leaves_ = (members_.size() + leafSize - 1) / leafSize;
    nodes_.resize(leaves_);
    parallelFor(leaves_, chunk / leafSize, [&](std::size_t leaf) {
      Node node = Node::of(members_[leaf * leafSize]);
      for (std::size_t k = leaf * leafSize + 1; k < endOf(leaf); ++k) {
        node.add(Node::of(members_[k]));
      }
      nodes_[leaf] = node;
    });
    starts_.assign(1, 0);
    for (std::size_t count = leaves_; count > 1; count = (count + 1) / 2) {
      const std::size_t below = starts_.back();
      starts_.push_back(below + count);
      for (std::size_t k = 0; k < count; k += 2) {
        Node node = nodes_[below + k];
        if (k + 1 < count) {
          node.add(nodes_[below + k + 1]);
        }
        nodes_.push_back(node);
      }
    }
  }

  std::size_t endOf(std::size_t leaf) const { return std::min(members_.size(), (leaf + 1) * leafSize); }

  /// The largest of a leaf's members with each other and with those of later leaves, if it is above `most`.
  template <class Law>
  S look(const Law& law, std::size_t leaf, S most, const S& enough) const {
    struct Place {
      std::size_t level;
      std::size_t number;
    };
    // Rounding of the bounds: what is found shall not depend on the order in which it is looked for.
    const S safe = S(1) + S(64) * roundoff<S>();
    std::array<Place, deepest> open;
    std::size_t count = 0;
    open[count++] = {starts_.size() - 1, 0};
    while (count > 0 && most < enough) {
      const auto [level, number] = open[--count];
      const std::size_t past = (number + 1) << level;  // its leaves end before
      if (past <= leaf || !(law.bound(nodes_[leaf], nodes_[starts_[level] + number]) * safe > most)) {
        continue;
      }
      if (level == 0) {
        for (std::size_t i = leaf * leafSize; i < endOf(leaf); ++i) {
          for (std::size_t j = std::max(i + 1, number * leafSize); j < endOf(number); ++j) {
            most = std::max<S>(most, law.of(members_[i], members_[j]));
          }
        }
        continue;
      }
      const std::size_t below = starts_[level] - starts_[level - 1];  // how many there are
      for (const std::size_t child : {2 * number + 1, 2 * number}) {
        if (child < below) {
          open[count++] = {level - 1, child};
        }
      }
    }
    return most;
  }

  std::vector<Member> members_;  ///< along the curve
  std::size_t leaves_ = 0;
  std::vector<Node> nodes_;  ///< level by level, leaves first
  std::vector<std::size_t> starts_;
};

}  // namespace gravel::detail
