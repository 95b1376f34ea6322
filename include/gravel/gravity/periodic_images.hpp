#pragma once

/// \file
/// The images of a periodic system: which are near and summed one by one, and what all the others do.

#include <gravel/core/sizes.hpp>
#include <gravel/gravity/image_plan.hpp>
#include <gravel/gravity/lattice_sums.hpp>
#include <gravel/spatial/domain.hpp>

namespace gravel::detail {

/// \param G of gravity; where it is 0 any domain will do
/// \throws std::invalid_argument for a domain so long that to sum its images takes minutes: the near ones of
/// a box go as the square of the ratio of its edges
template <Real S>
void requireFewImages(const Domain<S>& domain, const S& G) {
  if (G == S(0) || domain.isOpen()) {
    return;
  }
  const bool isPatch = domain.kind() == DomainKind::ShearPeriodic;
  const Vector3<S>& edges = domain.lengths();
  const S third = isPatch ? edges[1] : edges[2];
  const S longest = std::max<S>(std::max<S>(edges[0], edges[1]), third);
  const S shortest = std::min<S>(std::min<S>(edges[0], edges[1]), third);
  const S most(isPatch ? 1e4 : 1e3);
  if (!(longest / most <= shortest)) {
    refuse("longest edge of a domain with gravity", formatReal(longest),
           "at most " + formatReal(S(most * shortest)) + ", " + formatReal(most) + " times the shortest");
  }
}

/// The lattice of images of a domain: of the whole box in a periodic one; of its x (sheared) and y in a
/// shear-periodic one, which gravity sees open in z. S is the scalar of bodies, F that of expansions.
///
/// A patch that is deep beside its width is cut into slabs, numbered from the lowest body up. What is near is
/// then a matter of the box alone, and far images of one slab act on another through an expansion about the
/// centres of both. See docs/theory-gravity.md.
template <Real S, Real F>
class PeriodicImages {
 public:
  /// \param time [s] for a domain that shears \throws std::invalid_argument unless finite, or of
  /// requireFewImages()
  void setDomain(const Domain<S>& domain, const S& time) {
    requireFewImages(domain, S(1));
    require("time of a domain", time, anyFinite<S>());
    domain_ = domain;
    time_ = time;
  }
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
      isDeep_ = false;
      return;
    }
    const ImagePlan& plan = planImages(tolerance);
    const Vector3<S> edges = box() * perLength;
    S depth = isPlane() ? S((high - low) * perLength) : edges[2];
    centre_ = isPlane() ? F((high + low) * perLength / S(2)) : F(0);
    const S offset = domain_.shearOffset(time_) * perLength;
    a_ = Vector3<S>(edges[0], -offset, S(0));
    b_ = Vector3<S>(S(0), edges[1], S(0));
    c_ = Vector3<S>(S(0), S(0), edges[2]);
    const S plane_sq = edges[0] * edges[0] + edges[1] * edges[1];
    bool isDeep = false;
    F span(0);
    S height(1);
    if (isPlane()) {
      using std::sqrt;
      if (edges[1] > S(4) * edges[0]) {
        shorten(a_, b_);
      }
      const S most = S(plan.flat) * S(Vicinity::beyondMiddle(a_, b_));
      isDeep = plane_sq + depth * depth > most * most;
      span = F(depth);
      height = isDeep ? S(S(slabHeight) * S(sqrt(plane_sq))) : height;
      depth = isDeep ? std::min<S>(depth, height) : depth;
      low_ = F(low * perLength);
      if (isDeep) {
        shorten(a_, b_);
        low_ -= F(height - depth) / F(2);  // of a single slab bodies are about the centre
      }
    }
    const Key key{edges[0], edges[1], isPlane() ? S(0) : edges[2], depth, offset};
    if (plan_ == plan && key == key_ && kind_ == domain_.kind() && isDeep_ == isDeep) {
      tabulate(span);
      return;
    }
    isDeep_ = isDeep;
    perUnit_ = F(1) / F(height);
    key_ = Key{};  // until all is found
    kind_ = domain_.kind();
    plan_ = plan;
    reach_sq_ = (edges[0] * edges[0] + edges[1] * edges[1] + depth * depth) * S(plan.reach * plan.reach);
    find();
    above_.clear();
    key_ = key;
    tabulate(span);
  }

  /// Of near images, in the unit of `prepare`: first that of the box itself, then s, -s, s', -s' ...
  const std::vector<Vector3<S>>& shifts() const { return shifts_; }

  int order() const { return plan_.order; }
  /// (2 pi / 3 V), the background's share of a pair; 0 where there is none.
  const F& background() const { return background_; }
  /// The potential of a unit mass's own far images.
  F ownPotential() const { return F(derivatives_[0] * perUnit_); }

  /// Expansions are in a unit of their own: its inverse, in that of `prepare`. 1 but for slabs, which are
  /// one high, so that powers of a distance stay in range however deep the patch.
  const F& perUnit() const { return perUnit_; }

  /// Whether a patch is cut into slabs: where it has a diagonal of more than `flat` times the distance of the
  /// nearest point that LatticeSums::plane begins with. Sums over nearer ones cancel as powers of that ratio.
  bool isDeep() const { return isDeep_; }

  /// The slab of a body at z: a whole number; 0 where all are in one.
  F slabOf(const F& z) const { return isDeep_ ? wholePart(F((z - low_) * perUnit_)) : F(0); }

  /// z above the centre of its slab, in the unit of expansions.
  F fromCentre(const F& slab, const F& z) const {
    if (!isDeep_) {
      return z - centre_;
    }
    // Of slabs too far off to be told apart in F, bodies count as at the nearer face.
    return std::clamp<F>(F((z - low_) * perUnit_ - slab - F(0.5)), F(-0.5), F(0.5));
  }

  /// Adds to the local expansion of a slab, up to `most` orders, what far images of bodies of given moments
  /// do that are `below` slabs below it.
  void addFar(const F& below, const std::vector<F>& moments, std::vector<F>& local, int most) const {
    const F distance = sizeOf(below);
    const int order = std::min(most, orderAt(distance));
    const auto contract = [&](const std::vector<F>& derivatives) {
      X::contract(order, 0, order, moments.data(), derivatives.data(), local.data());
    };
    if (below == F(0)) {
      contract(derivatives_);
      return;
    }
    std::size_t n = 0;
    while (n < above_.size() && F(static_cast<double>(n + 1)) < distance) {
      ++n;
    }
    std::vector<F> derivatives = n < above_.size() ? above_[n] : derivativesAbove(distance, order);
    for (int k = 1; below < F(0) && k <= order; k += 2) {  // as the lattice is its own mirror image
      for (int i = X::D::start(k); i < X::D::start(k + 1); ++i) {
        F& d = derivatives[static_cast<std::size_t>(i)];
        d = -d;
      }
    }
    contract(derivatives);
  }

 private:
  using Sums = LatticeSums<F>;
  using Vicinity = LatticeSums<S>;
  using X = Expansion<HarmonicTerms>;
  using Point = typename Sums::Point;
  using Key = std::array<S, 5>;

  Vector3<S> shift(const Point& p) const { return Vector3<S>(S(p[0]) * a_ + S(p[1]) * b_ + S(p[2]) * c_); }
  bool isNear(const Point& p) const { return shift(p).squaredNorm() < reach_sq_; }

  /// Distances in slabs whose derivatives are kept: those of many orders.
  static constexpr int mostTables = 64;

  void tabulate(const F& span) {
    const F last = isDeep_ ? wholePart(F(span * perUnit_)) : F(0);
    for (int n = static_cast<int>(above_.size()) + 1; n <= mostTables && F(n) <= last; ++n) {
      above_.push_back(derivativesAbove(F(n), orderAt(F(n))));
    }
  }

  /// Of the expansion of slabs so far apart. It converges as that of bodies in one slab, which are apart by a
  /// diagonal d at most and from the nearest far image by reach d: with h the height and n that distance,
  ///     (reach^2 + (n h/d)^2)^(1/2 order(n)) = reach^order,  and two orders more as there are odd ones.
  int orderAt(const F& slabs) const {
    const double part = slabHeight * slabHeight / (1 + slabHeight * slabHeight);
    const F reach_sq = F(plan_.reach * plan_.reach);
    const F ratio_sq = reach_sq + F(part) * slabs * slabs;
    F enough(1);
    for (int n = 0; n < plan_.order; ++n) {
      enough *= reach_sq;
    }
    int order = 2;
    for (F product(1); product < enough && order < plan_.order; product *= ratio_sq) {
      ++order;
    }
    return std::min(order, plan_.order);
  }

  Vector3<F> wide(const Vector3<S>& v) const { return Vector3<F>(F(v[0]), F(v[1]), F(v[2])) * perUnit_; }

  std::vector<F> derivativesAbove(const F& slabs, int order) const {
    std::vector<Vector3<F>> near;
    for (const Vector3<S>& s : shifts_) {
      near.push_back(wide(s));
    }
    return Sums::planeAbove(wide(a_), wide(b_), slabs, order, near);
  }

  /// The greatest whole number up to x >= 0, for a scalar that need not have floor(); 0 below.
  static F wholePart(const F& x) {
    if constexpr (std::is_floating_point_v<F>) {
      return x > F(0) ? std::floor(x) : F(0);
    } else {
      F step(1);
      while (step <= x) {
        step += step;
      }
      F whole(0);
      for (; step >= F(1); step /= F(2)) {
        whole += whole + step <= x ? step : F(0);
      }
      return whole;
    }
  }

  /// Takes for the edges of a cell the shortest that there are (Lagrange 1773), as a long box that leans has
  /// cells of far shorter ones. Of two edges the sense stays.
  static void shorten(Vector3<S>& a, Vector3<S>& b) {
    const auto subtract = [](Vector3<S>& v, const Vector3<S>& from) {
      bool isShorter = false;
      for (S twice = S(2) * v.dot(from); from.squaredNorm() < S(0.999999) * detail::sizeOf(twice);
           twice = S(2) * v.dot(from)) {
        v -= twice < S(0) ? Vector3<S>(-from) : from;
        isShorter = true;
      }
      return isShorter;
    };
    while (subtract(a, b) || subtract(b, a)) {
    }
  }

  void find() {
    Point bound{0, 0, 0};
    const Vector3<S> edges(a_[0], b_[1], c_[2]);
    const S area = a_[0] * b_[1] - a_[1] * b_[0];
    for (int axis = 0; axis < (isPlane() ? 2 : 3); ++axis) {
      int& n = bound[static_cast<std::size_t>(axis)];
      // The distance of its rows of points: A over the other edge in a plane, as the lattice leans.
      const S other_sq = (axis == 0 ? b_ : a_).squaredNorm();
      const S row_sq = isPlane() ? S(area * area / other_sq) : S(edges[axis] * edges[axis]);
      while (S(n) * S(n) * row_sq < reach_sq_) {
        ++n;
      }
    }
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
    if (isPlane()) {
      derivatives_ = Sums::plane(wide(a_), wide(b_), plan_.order, bound, near);
      background_ = F(0);
    } else {
      derivatives_ = Sums::space(wide(edges), plan_.order, bound, near);
      background_ = F(2) * pi<F>() / (F(3) * F(edges[0]) * F(edges[1]) * F(edges[2]));
    }
  }

  Domain<S> domain_;
  S time_ = S(0);
  Key key_{};
  DomainKind kind_ = DomainKind::Open;
  Vector3<S> a_ = Vector3<S>::Zero(), b_ = Vector3<S>::Zero(), c_ = Vector3<S>::Zero();
  S reach_sq_ = S(0);
  std::vector<Vector3<S>> shifts_{Vector3<S>(Vector3<S>::Zero())};
  std::vector<F> derivatives_;
  F background_ = F(0);
  F centre_ = F(0);  ///< z around which bodies lie that are in one slab
  bool isDeep_ = false;
  ImagePlan plan_{};
  F low_ = F(0);  ///< z where the lowest slab begins
  F perUnit_ = F(1);
  std::vector<std::vector<F>> above_;  ///< derivatives seen from 1, 2, ... slabs above
};

}  // namespace gravel::detail
