#pragma once

/// Pair search as slow and as plain as it can be: every pair, every image, in long double. Shares no code
/// with the searches under test.

#include <gravel/core/random.hpp>
#include <gravel/spatial/domain.hpp>
#include <gravel/spatial/pair.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace gravel::test {

using Wide = long double;
using WideVector = Vector3<Wide>;

/// Lattice vector (i, j, k) of a domain: one box out in x lags by 3/2 Omega Lx t in y.
template <Real S>
WideVector latticeVector(const Domain<S>& domain, const S& time, int i, int j, int k) {
  const WideVector L = domain.lengths().template cast<Wide>();
  const Wide lag = domain.kind() == DomainKind::ShearPeriodic
                       ? 1.5L * static_cast<Wide>(domain.omega()) * L[0] * static_cast<Wide>(time)
                       : 0.0L;
  const Wide offset = std::fmod(lag, L[1]);
  return {Wide(i) * L[0], Wide(j) * L[1] - Wide(i) * offset, Wide(k) * L[2]};
}

/// Length of the shortest image of r, looked for among the images up to `boxes` boxes away.
template <Real S>
Wide shortestLength(const WideVector& r, const Domain<S>& domain, const S& time, int boxes = 2) {
  if (domain.isOpen()) {
    return r.norm();
  }
  Wide best = r.norm();
  for (int i = -boxes; i <= boxes; ++i) {
    for (int j = -boxes - 2; j <= boxes + 2; ++j) {
      for (int k = -boxes; k <= boxes; ++k) {
        best = std::min(best, WideVector(r + latticeVector(domain, time, i, j, k)).norm());
      }
    }
  }
  return best;
}

template <Real S>
struct Cloud {
  std::vector<Vector3<S>> positions;
  std::vector<S> radii;
  std::vector<BodyId> ids;

  std::size_t size() const { return positions.size(); }
};

/// Bodies in a cube of edge `edge` about the origin; radii are `radius` times ratio^-u, u uniform in [0, 1).
/// Ids are a permutation with gaps, neither ascending nor descending with the index.
template <Real S>
Cloud<S> randomCloud(std::size_t n, double edge, double radius, double ratio, std::uint64_t seed) {
  const CounterRandom random(seed);
  Cloud<S> cloud;
  for (std::size_t i = 0; i < n; ++i) {
    Vector3<S> x;
    for (int axis = 0; axis < 3; ++axis) {
      x[axis] = S(random.uniform(4 * i + static_cast<std::size_t>(axis), -edge / 2, edge / 2));
    }
    cloud.positions.push_back(x);
    cloud.radii.push_back(S(radius * std::pow(ratio, -random.uniform(4 * i + 3))));
    cloud.ids.push_back(BodyId{(i * 7919U) % n * 3U + 5U});  // 7919 is prime and no divisor of the n in use
  }
  return cloud;
}

/// Pairs (lower id, higher id), sorted.
using IdPairs = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

template <Real S>
IdPairs brutePairs(const Cloud<S>& cloud, const S& margin, const Domain<S>& domain, const S& time) {
  IdPairs pairs;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (std::size_t j = i + 1; j < cloud.size(); ++j) {
      const Wide radii = static_cast<Wide>(cloud.radii[i]) + static_cast<Wide>(cloud.radii[j]);
      const WideVector r =
          cloud.positions[j].template cast<Wide>() - cloud.positions[i].template cast<Wide>();
      if (radii > 0 && shortestLength(r, domain, time) < radii + static_cast<Wide>(margin)) {
        pairs.push_back(std::minmax(toInteger(cloud.ids[i]), toInteger(cloud.ids[j])));
      }
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// The pairs of a list by ids, in the list's own order.
template <Real S>
IdPairs named(const std::vector<Pair>& pairs, const Cloud<S>& cloud) {
  IdPairs names;
  for (const Pair& pair : pairs) {
    names.emplace_back(toInteger(cloud.ids[pair.first]), toInteger(cloud.ids[pair.second]));
  }
  return names;
}

}  // namespace gravel::test
