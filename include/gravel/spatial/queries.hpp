#pragma once

/// \file
/// Pair search by asking an index of points: what the k-d tree and the grid have in common.

#include <gravel/core/sizes.hpp>
#include <gravel/spatial/pair.hpp>

namespace gravel::detail {

/// The places inside the box, as a column.
template <Real S>
struct Homes {
  const std::vector<Sphere<S>>* spheres;

  std::size_t size() const { return spheres->size(); }
  const Vector3<S>& operator[](std::size_t i) const { return (*spheres)[i].home; }
};

/// Whether a point is nearer than a radius > 0, of which the square may leave the range of numbers.
template <std::floating_point S>
class Within {
 public:
  explicit Within(const S& radius) : radius_(radius), radius_sq_(radius * radius) {}
  /// Whether squares tell.
  bool bySquares() const {
    return radius_sq_ >= std::numeric_limits<S>::min() && radius_sq_ <= std::numeric_limits<S>::max();
  }
  /// \param d_sq |d|^2
  bool operator()(const Vector3<S>& d, const S& d_sq) const {
    return bySquares() ? d_sq < radius_sq_ : safeNorm(d) < radius_;
  }

 private:
  S radius_;
  S radius_sq_;
};

/// Largest and second largest radius: nothing that body i asks for is farther than r_i + the largest other.
template <Real S>
struct LargestRadii {
  S largest = S(0);
  S second = S(0);
  std::size_t owner = 0;

  explicit LargestRadii(const std::vector<Sphere<S>>& spheres) {
    for (std::size_t i = 0; i < spheres.size(); ++i) {
      if (spheres[i].radius > largest) {
        second = largest;
        largest = spheres[i].radius;
        owner = i;
      } else if (spheres[i].radius > second) {
        second = spheres[i].radius;
      }
    }
  }

  /// How far body i must look, with room for the rounding of a search's own arithmetic: of sums of squares
  /// down a tree, and on coordinates near those of the body, not of others that may be far away.
  /// \param images [m] from the body to its images
  S reach(const std::vector<Sphere<S>>& spheres, std::size_t i, const S& margin, const S& images) const {
    const S r = spheres[i].radius;
    const S other = i == owner ? second : r;
    const S eps(std::numeric_limits<S>::epsilon());
    const S rounding = S(16) * eps * (spheres[i].home.cwiseAbs().maxCoeff() + images);
    return (r + other + margin) * (S(1) + S(128) * eps) + rounding;
  }
};

/// Calls f(q) for `home` and for each of its images that a sphere of that reach inside the box can see.
template <Real S, class F>
void forEachImage(const Vector3<S>& home, const S& reach, const Domain<S>& domain, const S& time, F&& f) {
  f(home);
  if (domain.isOpen()) {
    return;
  }
  const Vector3<S>& L = domain.lengths();
  const S offset = domain.shearOffset(time);
  const auto sees = [&](const S& x, int axis) {
    return x >= -L[axis] / S(2) - reach && x <= L[axis] / S(2) + reach;
  };
  // Of an oblique lattice whose boxes are long in y, images beyond the neighbours in x may be the nearest.
  int across = 1;
  while (domain.kind() == DomainKind::ShearPeriodic && S(across) * L[0] < reach &&
         S(2 * across) * L[0] < L[0] + L[1]) {
    ++across;
  }
  for (int bx = -across; bx <= across; ++bx) {
    const S x = home[0] + S(bx) * L[0];
    if (!sees(x, 0)) {
      continue;
    }
    const int along = 1 + across;  // the sheared offset reaches half a box further
    for (int by = -along; by <= along; ++by) {
      const S y = home[1] - S(bx) * offset + S(by) * L[1];
      if (!sees(y, 1)) {
        continue;
      }
      for (int bz = -1; bz <= 1; ++bz) {
        const S z = home[2] + S(bz) * L[2];
        if (sees(z, 2) && (bx != 0 || by != 0 || bz != 0)) {
          f(Vector3<S>(x, y, z));
        }
      }
    }
  }
}

/// Pairs from any index of points that answers forEachWithin: each body asks for the smaller ones, so that
/// few large bodies among many small ones cost nothing extra. Queries are shared between threads.
template <Real S, class Index>
void findPairsByQueries(const Index& index, const std::vector<Sphere<S>>& spheres, const S& margin,
                        const Domain<S>& domain, const S& time, std::vector<std::vector<Pair>>& parts,
                        std::vector<Pair>& out) {
  const LargestRadii<S> radii(spheres);
  const S images = domain.isOpen() ? S(0) : S(S(2) * domain.lengths().maxCoeff());
  constexpr std::size_t chunk = 256;
  parts.resize((spheres.size() + chunk - 1) / chunk);
  parallelForChunks(spheres.size(), chunk, [&](std::size_t begin, std::size_t end) {
    std::vector<Pair>& part = parts[begin / chunk];
    part.clear();
    for (std::size_t i = begin; i < end; ++i) {
      if (!(spheres[i].radius > S(0))) {
        continue;
      }
      const S reach = radii.reach(spheres, i, margin, images);
      forEachImage(spheres[i].home, reach, domain, time, [&](const Vector3<S>& q) {
        index.forEachWithin(q, reach, [&](std::size_t j, S) {
          if (asksFor(spheres[i], spheres[j])) {
            appendIfNear(spheres, i, j, margin, domain, time, part);
          }
        });
      });
    }
  });
  joinPairs(parts, spheres, out);
}

}  // namespace gravel::detail
