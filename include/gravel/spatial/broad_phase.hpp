#pragma once

/// \file
/// The choice of pair search at run time, behind one function. All methods give the same list.

#include <gravel/spatial/all_pairs.hpp>
#include <gravel/spatial/grid.hpp>
#include <gravel/spatial/kdtree.hpp>

#include <variant>

namespace gravel {

/// `Automatic`: all pairs for few bodies, the grid, or the k-d tree where bodies crowd in a small part of
/// their bounding box.
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

/// Finds the pairs of bodies that touch or nearly touch. To add a method: one header with its `findPairs`, a
/// line in the variant, a name in the enumeration, in `name()` and in `search`.
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
  /// and two points (radius 0) are never a pair. The same list for every method and number of threads.
  /// \param margin [m] >= 0
  /// \throws std::invalid_argument for positions or radii that are not finite, negative radii or margin
  template <class Positions, class Radii, class Ids>
  void findPairs(const Positions& positions, const Radii& radii, const Ids& ids, const S& margin,
                 const Domain<S>& domain, const S& time, std::vector<Pair>& out) {
    detail::require("margin of a pair search", margin, detail::nonNegative<S>());
    if (!isFinite(time)) {
      detail::refuse("time of a pair search", detail::formatReal(time), "finite");
    }
    // Nothing is kept: some 200 bytes a body, for a search in many steps.
    std::vector<detail::Sphere<S>> spheres;
    detail::gatherSpheres(positions, radii, ids, domain, time, spheres);
    if (std::none_of(spheres.begin(), spheres.end(), [](const auto& s) { return s.radius > S(0); })) {
      out.clear();  // points alone: nothing to search
      return;
    }
    search(spheres, margin, domain, time, out);
    std::visit([](auto& method) { method = {}; }, method_);
  }

 private:
  // As measured by benchmarks/broad_phase_methods.cpp.
  static constexpr std::size_t fewBodies = 24;
  static constexpr double crowded = 8.0;

  void search(const std::vector<detail::Sphere<S>>& spheres, const S& margin, const Domain<S>& domain,
              const S& time, std::vector<Pair>& out) {
    if constexpr (std::is_floating_point_v<S>) {
      if (kind_ == BroadPhaseKind::Automatic && spheres.size() > fewBodies) {
        const UniformGrid<S>& grid = use<GridPairs<S>>().build(spheres, margin);
        if (grid.crowding() <= crowded) {
          use<GridPairs<S>>().search(spheres, margin, domain, time, out);
        } else {
          use<KDTreePairs<S>>().findPairs(spheres, margin, domain, time, out);
        }
        return;
      }
      if (kind_ == BroadPhaseKind::KDTree) {
        use<KDTreePairs<S>>();
      } else if (kind_ == BroadPhaseKind::Grid) {
        use<GridPairs<S>>();
      } else {
        use<AllPairs<S>>();
      }
    }
    std::visit([&](auto& method) { method.findPairs(spheres, margin, domain, time, out); }, method_);
  }

  template <class Method>
  Method& use() {
    if (!std::holds_alternative<Method>(method_)) {
      method_.template emplace<Method>();
    }
    return std::get<Method>(method_);
  }

  BroadPhaseKind kind_;
  typename detail::BroadPhaseMethods<S>::Variant method_;
};

}  // namespace gravel
