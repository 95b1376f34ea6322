#pragma once

/// \file
/// The choice of pair search at run time, behind one function. All methods give the same list.

#include <gravel/spatial/all_pairs.hpp>
#include <gravel/spatial/grid.hpp>
#include <gravel/spatial/kdtree.hpp>

#include <variant>

namespace gravel {

enum class BroadPhaseKind { Automatic, AllPairs, KDTree, Grid };

namespace detail {

template <Real S, bool isBuiltIn = std::is_floating_point_v<S>>
struct BroadPhaseMethods {
  using Variant = std::variant<AllPairs<S>>;  // a user's scalar: nanoflann and the grid need a built-in one
};
template <Real S>
struct BroadPhaseMethods<S, true> {
  using Variant = std::variant<AllPairs<S>, KDTreePairs<S>, GridPairs<S>>;
};

}  // namespace detail

/// Finds the pairs of bodies that touch or nearly touch. To add a method: one header with its `findPairs`,
/// one line in the variant, one name in the enumeration and in `select`.
template <Real S>
class BroadPhase {
 public:
  explicit BroadPhase(BroadPhaseKind kind = BroadPhaseKind::Automatic) : kind_(kind) {}

  BroadPhaseKind kind() const { return kind_; }
  void setKind(BroadPhaseKind kind) { kind_ = kind; }

  /// The method that the last search used.
  const char* name() const {
    constexpr const char* names[] = {"all pairs", "k-d tree", "grid"};
    return names[method_.index()];
  }

  /// Every pair with |r_ij| < r_i + r_j + margin, sorted by ids, where |r_ij| is that of the nearest image
  /// and two points (radius 0) are never a pair. The same list for every method and number of threads. \param
  /// margin [m] >= 0 \throws std::invalid_argument for positions or radii that are not finite, negative radii
  /// or margin
  template <class Positions, class Radii, class Ids>
  void findPairs(const Positions& positions, const Radii& radii, const Ids& ids, const S& margin,
                 const Domain<S>& domain, const S& time, std::vector<Pair>& out) {
    detail::require("margin of a pair search", margin, detail::nonNegative<S>());
    detail::gatherSpheres(positions, radii, ids, domain, time, spheres_);
    select(margin);
    std::visit([&](auto& method) { method.findPairs(spheres_, margin, domain, time, out); }, method_);
  }

 private:
  template <class Method>
  void use() {
    if (!std::holds_alternative<Method>(method_)) {
      method_.template emplace<Method>();
    }
  }

  void select(const S& margin) {
    if constexpr (std::is_floating_point_v<S>) {
      const BroadPhaseKind kind = kind_ == BroadPhaseKind::Automatic ? automatic(margin) : kind_;
      if (kind == BroadPhaseKind::AllPairs) {
        use<AllPairs<S>>();
      } else if (kind == BroadPhaseKind::KDTree) {
        use<KDTreePairs<S>>();
      } else {
        use<GridPairs<S>>();
      }
    }
  }

  /// Thresholds as measured by benchmarks/broad_phase_methods.cpp.
  BroadPhaseKind automatic(const S& margin) const {
    constexpr std::size_t fewBodies = 64;
    if (spheres_.size() <= fewBodies) {
      return BroadPhaseKind::AllPairs;
    }
    Vector3<S> low = spheres_[0].home;
    Vector3<S> high = low;
    S largest(0);
    S sum(0);
    for (const detail::Sphere<S>& s : spheres_) {
      low = low.cwiseMin(s.home);
      high = high.cwiseMax(s.home);
      largest = std::max(largest, s.radius);
      sum += s.radius;
    }
    const auto n = static_cast<S>(spheres_.size());
    const S cell = S(2) * largest + margin;
    const Vector3<S> count = (high - low) / cell + Vector3<S>::Ones();
    const bool alike = sum > S(0.4) * largest * n;
    const bool dense = count.prod() < S(8) * n;  // false also if nothing has a radius
    return alike && dense ? BroadPhaseKind::Grid : BroadPhaseKind::KDTree;
  }

  BroadPhaseKind kind_;
  typename detail::BroadPhaseMethods<S>::Variant method_;
  std::vector<detail::Sphere<S>> spheres_;
};

}  // namespace gravel
