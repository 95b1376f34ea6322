#pragma once

/// \file
/// k-d tree over points, and the pair search on it. The only include of nanoflann, whose versions 1.4 to
/// 1.12 differ in their results' types; a result set of our own works on all.

#include <gravel/spatial/queries.hpp>

#include <nanoflann.hpp>

#include <memory>

namespace gravel {

/// Points in space that can be asked for those near a place. Copies share the tree, which never changes once
/// it is built. Scalars: float, double, long double. (The tree of long double points is cut by their values
/// in double, since nanoflann's pool is aligned for no more; distances are exact all the same.)
template <std::floating_point S>
class KDTree {
 public:
  KDTree() = default;

  /// Copies the points; `positions[i]` keeps the name i. O(N log N), one thread.
  /// \throws std::invalid_argument for a coordinate that is not finite
  template <class Positions>
  void build(const Positions& positions) {
    std::vector<Vector3<S>> points(positions.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      points[i] = positions[i];
      if (!isFinite(points[i].template cast<Cut>())) {
        detail::refuse("position " + std::to_string(i) + " of a k-d tree", detail::formatVector(points[i]),
                       "finite, and in the range of double");
      }
    }
    tree_ = std::make_shared<const Tree>(std::move(points));
  }

  std::size_t size() const { return tree_ ? tree_->cloud.points.size() : 0; }

  /// Calls visit(index, squared distance) for each point with distance < radius, in no promised order.
  /// Safe from several threads at once. O(log N + hits); O(N) where the square of the radius leaves the range
  /// of numbers, since the tree is searched by squares, and those handed on are 0 or infinite there.
  template <class Visitor>
  void forEachWithin(const Vector3<S>& q, S radius, Visitor&& visit) const {
    if (size() == 0 || !(radius > S(0))) {
      return;
    }
    const std::vector<Vector3<S>>& points = tree_->cloud.points;
    const detail::Within<S> isWithin(radius);
    const bool cuts = isWithin.bySquares() && detail::Within<Cut>(static_cast<Cut>(radius)).bySquares();
    if (!cuts) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Vector3<S> d = points[i] - q;
        const S distance_sq = d.squaredNorm();
        if (isWithin(d, distance_sq)) {
          visit(i, distance_sq);
        }
      }
      return;
    }
    Ball<std::remove_reference_t<Visitor>> ball{points, q, radius * radius, Cut(0), visit};
    const Vector3<Cut> centre = q.template cast<Cut>();
    Cut cutRadius = static_cast<Cut>(radius);
    if constexpr (!std::is_same_v<S, Cut>) {  // the rounding of both points to Cut
      constexpr Cut eps = std::numeric_limits<Cut>::epsilon();
      cutRadius =
          (cutRadius + eps * (cutRadius + centre.cwiseAbs().maxCoeff()) * Cut(8)) * (Cut(1) + 128 * eps);
    }
    ball.cutRadius_sq = cutRadius * cutRadius;
    tree_->index.findNeighbors(ball, centre.data(), {});
  }

 private:
  using Cut = std::conditional_t<std::is_same_v<S, float>, float, double>;

  struct Cloud {
    std::vector<Vector3<S>> points;

    std::size_t kdtree_get_point_count() const { return points.size(); }
    Cut kdtree_get_pt(std::size_t i, std::size_t axis) const {
      return static_cast<Cut>(points[i][static_cast<int>(axis)]);
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };

  using Index =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<Cut, Cloud>, Cloud, 3, std::uint32_t>;

  struct Tree {
    explicit Tree(std::vector<Vector3<S>> points)
        : cloud{std::move(points)}, index(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
      index.buildIndex();
    }
    Tree(const Tree&) = delete;
    Tree& operator=(const Tree&) = delete;

    Cloud cloud;
    Index index;
  };

  /// nanoflann's result set: hands each hit on instead of keeping it.
  template <class Visitor>
  struct Ball {
    using DistanceType = Cut;
    using IndexType = std::uint32_t;

    const std::vector<Vector3<S>>& points;
    const Vector3<S>& centre;
    S radius_sq;
    Cut cutRadius_sq;
    Visitor& visit;

    bool addPoint(Cut cutDistance_sq, std::uint32_t index) {
      S distance_sq = static_cast<S>(cutDistance_sq);
      if constexpr (!std::is_same_v<S, Cut>) {
        distance_sq = (points[index] - centre).squaredNorm();
      }
      if (distance_sq < radius_sq) {
        visit(static_cast<std::size_t>(index), distance_sq);
      }
      return true;
    }
    Cut worstDist() const { return cutRadius_sq; }
    bool full() const { return true; }
    bool empty() const { return false; }
    std::size_t size() const { return 0; }
    void sort() {}
  };

  std::shared_ptr<const Tree> tree_;
};

/// Pair search on a k-d tree: right at any ratio of radii and any spread in space. O(N log N + pairs).
template <std::floating_point S>
class KDTreePairs {
 public:
  /// Every pair with |r_ij| < r_i + r_j + margin; queries are shared between threads.
  void findPairs(const std::vector<detail::Sphere<S>>& spheres, const S& margin, const Domain<S>& domain,
                 const S& time, std::vector<Pair>& out) {
    tree_.build(detail::Homes<S>{&spheres});
    detail::findPairsByQueries(tree_, spheres, margin, domain, time, parts_, out);
  }

 private:
  KDTree<S> tree_;
  std::vector<std::vector<Pair>> parts_;
};

}  // namespace gravel
