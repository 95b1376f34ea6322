#pragma once

/// \file
/// The images of a periodic system: which are near and summed one by one, and what all the others do.

#include <gravel/gravity/lattice_sums.hpp>
#include <gravel/spatial/domain.hpp>

namespace gravel::detail {

/// How far images are near, and the order of the expansion of all others, for one band of tolerances.
/// Measured; see docs/theory-gravity.md.
struct ImagePlan {
  double tolerance;  ///< smallest that this row serves
  double reach;      ///< images are near within so many diagonals of the box
  int order;
};

inline constexpr std::array<ImagePlan, 8> imagePlans{{
    {1e-2, 1.42, 10},
    {1e-3, 1.42, 14},
    {1e-4, 1.42, 18},
    {1e-5, 1.42, 22},
    {1e-6, 1.74, 22},
    {1e-7, 1.74, 26},
    {1e-9, 1.74, 32},
    {0.0, 1.74, 36},
}};

/// The lattice of images of a domain: of the whole box in a periodic one; of its x (sheared) and y in a
/// shear-periodic one, which gravity sees open in z. S is the scalar of bodies, F that of expansions.
template <Real S, Real F>
class PeriodicImages {
 public:
  /// \param time [s] for a domain that shears
  void setDomain(const Domain<S>& domain, const S& time) {
    domain_ = domain;
    time_ = time;
  }
  const Domain<S>& domain() const { return domain_; }

  bool isOpen() const { return domain_.isOpen(); }
  bool isPlane() const { return domain_.kind() == DomainKind::ShearPeriodic; }

  /// Edges of the box [m]; 0 along axes without images.
  Vector3<S> box() const {
    Vector3<S> edges = domain_.lengths();
    if (isPlane()) {
      edges[2] = S(0);
    }
    return edges;
  }

  /// The image of x in the box.
  Vector3<S> home(const Vector3<S>& x) const {
    Vector3<S> inside = x;
    Vector3<S> v = Vector3<S>::Zero();
    domain_.wrap(inside, v, time_);
    if (isPlane()) {
      inside[2] = x[2];
    }
    return inside;
  }

  /// Finds near images and lattice sums, if those of the last call do not serve.
  /// \param perLength unit of what follows  \param low,high least and greatest z of bodies [m]
  void prepare(const S& perLength, const S& low, const S& high, const S& tolerance) {
    if (isOpen()) {
      shifts_.assign(1, Vector3<S>::Zero());
      kind_ = DomainKind::Open;
      return;
    }
    const ImagePlan& plan = planFor(tolerance);
    const Vector3<S> edges = box() * perLength;
    const S depth = isPlane() ? S((high - low) * perLength) : edges[2];
    centre_ = isPlane() ? F((high + low) * perLength / S(2)) : F(0);
    const S offset = domain_.shearOffset(time_) * perLength;
    const Key key{edges[0], edges[1], isPlane() ? S(0) : edges[2], depth, offset};
    if (order_ == plan.order && key == key_ && kind_ == domain_.kind()) {
      return;
    }
    key_ = key;
    kind_ = domain_.kind();
    order_ = plan.order;
    a_ = Vector3<S>(edges[0], -offset, S(0));
    b_ = Vector3<S>(S(0), edges[1], S(0));
    c_ = Vector3<S>(S(0), S(0), edges[2]);
    reach_sq_ = (edges[0] * edges[0] + edges[1] * edges[1] + depth * depth) * S(plan.reach * plan.reach);
    find();
  }

  /// Of near images, in the unit of `prepare`: first that of the box itself, then s, -s, s', -s' ...
  const std::vector<Vector3<S>>& shifts() const { return shifts_; }

  /// Of all others; see LatticeSums.
  const std::vector<F>& derivatives() const { return derivatives_; }
  int order() const { return order_; }
  /// (2 pi / 3 V), the background's share of a pair; 0 where there is none.
  const F& background() const { return background_; }
  /// z around which bodies lie.
  const F& centre() const { return centre_; }

 private:
  using Sums = LatticeSums<F>;
  using Point = typename Sums::Point;
  using Key = std::array<S, 5>;

  static const ImagePlan& planFor(const S& tolerance) {
    for (const ImagePlan& plan : imagePlans) {
      if (tolerance >= S(plan.tolerance)) {
        return plan;
      }
    }
    return imagePlans.back();
  }

  Vector3<S> shift(const Point& p) const { return Vector3<S>(S(p[0]) * a_ + S(p[1]) * b_ + S(p[2]) * c_); }
  bool isNear(const Point& p) const { return shift(p).squaredNorm() < reach_sq_; }

  void find() {
    Point bound{0, 0, 0};
    const Vector3<S> edges(a_[0], b_[1], c_[2]);
    for (int axis = 0; axis < (isPlane() ? 2 : 3); ++axis) {
      int& n = bound[static_cast<std::size_t>(axis)];
      while (S(n) * S(n) * edges[axis] * edges[axis] < reach_sq_) {
        ++n;
      }
    }
    bound[1] += isPlane() ? bound[0] / 2 + 1 : 0;  // as the lattice leans
    shifts_.assign(1, Vector3<S>::Zero());
    for (int i = 0; i <= bound[0]; ++i) {
      for (int j = i == 0 ? 0 : -bound[1]; j <= bound[1]; ++j) {
        for (int k = i == 0 && j == 0 ? 1 : -bound[2]; k <= bound[2]; ++k) {
          if (isNear({i, j, k})) {
            shifts_.push_back(shift({i, j, k}));
            shifts_.push_back(Vector3<S>(-shifts_.back()));
          }
        }
      }
    }
    const auto near = [this](const Point& p) { return isNear(p); };
    const auto wide = [](const Vector3<S>& v) { return Vector3<F>(F(v[0]), F(v[1]), F(v[2])); };
    if (isPlane()) {
      derivatives_ = Sums::plane(wide(a_), wide(b_), order_, bound, near);
      background_ = F(0);
    } else {
      derivatives_ = Sums::space(wide(edges), order_, bound, near);
      background_ = F(2) * pi<F>() / (F(3) * F(edges[0]) * F(edges[1]) * F(edges[2]));
    }
  }

  Domain<S> domain_;
  S time_ = S(0);
  Key key_{};
  DomainKind kind_ = DomainKind::Open;
  Vector3<S> a_ = Vector3<S>::Zero(), b_ = Vector3<S>::Zero(), c_ = Vector3<S>::Zero();
  S reach_sq_ = S(0);
  int order_ = 0;
  std::vector<Vector3<S>> shifts_{Vector3<S>(Vector3<S>::Zero())};
  std::vector<F> derivatives_;
  F background_ = F(0);
  F centre_ = F(0);
};

}  // namespace gravel::detail
