#pragma once

/// \file
/// The choice of pair search at run time, behind one function. All methods give the same list.

#include <gravel/spatial/all_pairs.hpp>
#include <gravel/spatial/grid.hpp>
#include <gravel/spatial/kdtree.hpp>

namespace gravel {

/// `Automatic`: all pairs for few bodies, the grid, or the k-d tree where bodies crowd in a small part of
/// their bounding box.
enum class BroadPhaseKind { Automatic, AllPairs, KDTree, Grid };

/// Finds the pairs of bodies that touch or nearly touch. To add a method: one header with its `findPairs`, a
/// name in the enumeration, a line in `search`.
template <Real S>
class BroadPhase {
 public:
  explicit BroadPhase(BroadPhaseKind kind = BroadPhaseKind::Automatic) : kind_(kind) {}

  void setKind(BroadPhaseKind kind) { kind_ = kind; }

  /// The method that the last search used.
  const char* name() const { return name_; }

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
  }

 private:
  // As measured by benchmarks/broad_phase_methods.cpp.
  static constexpr std::size_t fewBodies = 24;
  static constexpr double crowded = 8.0;

  void search(const std::vector<detail::Sphere<S>>& spheres, const S& margin, const Domain<S>& domain,
              const S& time, std::vector<Pair>& out) {
    if constexpr (std::is_floating_point_v<S>) {  // nanoflann and the grid need a built-in scalar
      bool crowds = kind_ == BroadPhaseKind::KDTree;
      if (kind_ == BroadPhaseKind::Grid ||
          (kind_ == BroadPhaseKind::Automatic && spheres.size() > fewBodies)) {
        GridPairs<S> grid;
        crowds = grid.build(spheres, margin).crowding() > crowded && kind_ == BroadPhaseKind::Automatic;
        if (!crowds) {
          name_ = "grid";
          return grid.findPairs(spheres, margin, domain, time, out);
        }
      }
      if (crowds) {
        name_ = "k-d tree";
        return KDTreePairs<S>().findPairs(spheres, margin, domain, time, out);
      }
    }
    name_ = "all pairs";
    AllPairs<S>().findPairs(spheres, margin, domain, time, out);
  }

  BroadPhaseKind kind_;
  const char* name_ = "all pairs";
};

}  // namespace gravel
