#pragma once

/// \file
/// Which two spheres come soonest to be deep in each other, among many.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/spatial/morton.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace gravel::detail {

/// The largest v/(gap + r/4) over pairs with at least one sphere, one of them free: v is their relative
/// speed, gap that between their surfaces, 0 if they overlap, r the smaller radius, or that of the only
/// sphere. Bodies stand along a Morton curve, eight to a leaf of a binary tree whose nodes know the bounds of
/// places, velocities and radii; a leaf looks only into nodes whose bounds allow for more than was found so
/// far. O(N log N) where few pairs are near each other; the same for any number of threads and any order of
/// the bodies.
template <class S>
class NearestMeeting {
 public:
  template <class BodiesType>
  explicit NearestMeeting(const BodiesType& bodies) {
    const std::vector<std::size_t> order = mortonOrder(bodies.positions());
    members_.resize(order.size());
    parallelFor(order.size(), chunk, [&](std::size_t k) {
      const auto body = bodies[order[k]];
      members_[k] = {body.position().template cast<S>(), body.countingVelocity().template cast<S>(),
                     S(body.radius()), !body.isFixed()};
    });
    plant();
  }

  /// \return its square [s^-2], 0 if there is no such pair; `enough` if it is that or more, which is found
  ///   sooner
  S mostRateSq(const S& enough) const {
    S most(0);  // of neighbours along the curve: the better the first guess, the less is looked at
    for (std::size_t k = 1; k < members_.size(); ++k) {
      most = std::max<S>(most, rateSq(members_[k - 1], members_[k]));
    }
    if (!(most < enough)) {
      return enough;
    }
    most = -orderedMin(leaves_, leavesOfTask, S(-most),
                       [&](std::size_t leaf) { return S(-look(leaf, most, enough)); });
    return std::min<S>(most, enough);
  }

 private:
  static constexpr std::size_t chunk = 2048;
  static constexpr std::size_t leafSize = 8;
  static constexpr std::size_t leavesOfTask = 64;
  static constexpr std::size_t deepest = 64;  ///< levels: halves of less than 2^64 leaves

  struct Member {
    Vector3<S> x;
    Vector3<S> v;
    S r;
    bool free;
  };

  /// Bounds of some members.
  struct Node {
    Vector3<S> x_low, x_high, v_low, v_high;
    S least;  ///< radius of a sphere; 0 where there is none
    S most;
    bool free;

    static Node of(const Member& m) { return {m.x, m.x, m.v, m.v, m.r, m.r, m.free}; }
    void add(const Node& other) {
      x_low = x_low.cwiseMin(other.x_low);
      x_high = x_high.cwiseMax(other.x_high);
      v_low = v_low.cwiseMin(other.v_low);
      v_high = v_high.cwiseMax(other.v_high);
      least = smallerRadius(least, other.least);
      most = std::max<S>(most, other.most);
      free = free || other.free;
    }
  };

  static S smallerRadius(const S& a, const S& b) { return a > S(0) && (!(b > S(0)) || a < b) ? a : b; }

  static S rateSq(const Member& a, const Member& b) {
    using std::sqrt;
    const S r = smallerRadius(a.r, b.r);
    if (!(r > S(0)) || !(a.free || b.free)) {
      return S(0);
    }
    const S gap = S(sqrt(S(Vector3<S>(a.x - b.x).squaredNorm()))) - (a.r + b.r);
    const S way = r / S(4) + std::max<S>(gap, S(0));
    return Vector3<S>(a.v - b.v).squaredNorm() / (way * way);
  }

  /// No pair of theirs has more.
  static S boundSq(const Node& a, const Node& b) {
    using std::sqrt;
    const S r = smallerRadius(a.least, b.least);
    if (!(r > S(0)) || !(a.free || b.free)) {
      return S(0);
    }
    const Vector3<S> none = Vector3<S>::Zero();
    const Vector3<S> apart = none.cwiseMax(a.x_low - b.x_high).cwiseMax(b.x_low - a.x_high);
    const Vector3<S> speed = (a.v_high - b.v_low).cwiseMax(b.v_high - a.v_low);
    const S gap = S(sqrt(S(apart.squaredNorm()))) - (a.most + b.most);
    const S way = r / S(4) + std::max<S>(gap, S(0));
    return speed.squaredNorm() / (way * way);
  }

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
  S look(std::size_t leaf, S most, const S& enough) const {
    struct Place {
      std::size_t level;
      std::size_t number;
    };
    // Rounding of the bounds: what is found shall not depend on the order in which it is looked for.
    const S safe = S(1) + S(64) * Eigen::NumTraits<S>::epsilon();
    std::array<Place, deepest> open;
    std::size_t count = 0;
    open[count++] = {starts_.size() - 1, 0};
    while (count > 0 && most < enough) {
      const auto [level, number] = open[--count];
      const std::size_t past = (number + 1) << level;  // its leaves end before
      if (past <= leaf || !(boundSq(nodes_[leaf], nodes_[starts_[level] + number]) * safe > most)) {
        continue;
      }
      if (level == 0) {
        for (std::size_t i = leaf * leafSize; i < endOf(leaf); ++i) {
          for (std::size_t j = std::max(i + 1, number * leafSize); j < endOf(number); ++j) {
            most = std::max<S>(most, rateSq(members_[i], members_[j]));
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
