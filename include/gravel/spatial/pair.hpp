#pragma once

/// \file
/// Candidate pairs: their order, and the one test that every search method applies.

#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/spatial/domain.hpp>

#include <algorithm>
#include <numeric>
#include <vector>

namespace gravel {

/// Indices of two bodies, id(first) < id(second). Lists are sorted by (id of first, id of second), without
/// duplicates, so that their order depends on ids alone.
struct Pair {
  std::uint32_t first;
  std::uint32_t second;

  friend bool operator==(const Pair&, const Pair&) = default;
};

namespace detail {

constexpr std::uint64_t idKey(std::uint64_t id) { return id; }
constexpr std::uint64_t idKey(BodyId id) { return toInteger(id); }

/// What a search needs of a body, copied together. In a periodic box `home` is the place inside the box.
template <Real S>
struct Sphere {
  Vector3<S> x;
  Vector3<S> home;
  S radius;
  std::uint64_t id;
};

/// \throws std::invalid_argument unless all are as many as the positions
inline void requireAsMany(std::size_t positions, std::size_t radii, std::size_t ids) {
  if (radii != positions || ids != positions) {
    refuse("length of radii and ids", std::to_string(radii) + " and " + std::to_string(ids),
           "that of positions, " + std::to_string(positions));
  }
}

/// Copies columns of any kind. \throws std::invalid_argument for a value that is not finite, a negative
/// radius, columns of different lengths, and for 2^32 - 1 bodies or more
template <Real S, class Positions, class Radii, class Ids>
void gatherSpheres(const Positions& positions, const Radii& radii, const Ids& ids, const Domain<S>& domain,
                   const S& time, std::vector<Sphere<S>>& out) {
  const std::size_t n = positions.size();
  if (n >= std::numeric_limits<std::uint32_t>::max()) {
    refuse("number of bodies in a pair search", std::to_string(n), "below 2^32 - 1");
  }
  requireAsMany(n, radii.size(), ids.size());
  out.resize(n);
  parallelFor(n, 1024, [&](std::size_t i) {
    Sphere<S>& s = out[i];
    s.x = positions[i];
    s.radius = radii[i];
    s.id = idKey(ids[i]);
    if (!isFinite(s.x)) {
      refuse("position of body " + std::to_string(s.id), formatVector(s.x), "finite");
    }
    if (!isFinite(s.radius) || s.radius < S(0)) {
      refuse("radius of body " + std::to_string(s.id), formatReal(s.radius), "finite, >= 0");
    }
    s.home = s.x;
    if (!domain.isOpen()) {
      Vector3<S> unused = Vector3<S>::Zero();
      domain.wrap(s.home, unused, time);
    }
  });
}

/// |r_ij| < r_i + r_j + margin, where a pair of points (both radii zero) never counts.
template <Real S>
bool withinReach(const Sphere<S>& a, const Sphere<S>& b, const S& margin, const Domain<S>& domain,
                 const S& time) {
  const S radii = a.radius + b.radius;
  if (!(radii > S(0))) {
    return false;
  }
  Vector3<S> r = b.x - a.x;
  if (!domain.isOpen()) {
    r = domain.minimumImage(r, time);
  }
  const S reach = radii + margin;
  return r.squaredNorm() < reach * reach;
}

/// The order in which one body of each pair is asked for the other: larger first, then the lower id.
template <Real S>
bool asksFor(const Sphere<S>& a, const Sphere<S>& b) {
  return a.radius > b.radius || (a.radius == b.radius && a.id < b.id);
}

/// Appends the pair in the order of ids if it is within reach.
template <Real S>
void appendIfNear(const std::vector<Sphere<S>>& spheres, std::size_t i, std::size_t j, const S& margin,
                  const Domain<S>& domain, const S& time, std::vector<Pair>& out) {
  if (spheres[j].id < spheres[i].id) {
    std::swap(i, j);
  }
  if (withinReach(spheres[i], spheres[j], margin, domain, time)) {
    out.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
  }
}

/// Joins the parts and brings them into the promised order. O(pairs + bodies), a little more where ids do
/// not ascend with the index.
template <Real S>
void joinPairs(const std::vector<std::vector<Pair>>& parts, const std::vector<Sphere<S>>& spheres,
               std::vector<Pair>& out) {
  const std::size_t n = spheres.size();
  std::vector<std::uint32_t> rank(n);  // place of a body in the order of ids
  std::iota(rank.begin(), rank.end(), 0U);
  const auto byId = [&](std::size_t a, std::size_t b) { return spheres[a].id < spheres[b].id; };
  if (!std::is_sorted(rank.begin(), rank.end(), byId)) {
    std::vector<std::uint32_t> order(rank);
    std::sort(order.begin(), order.end(), byId);
    for (std::size_t k = 0; k < n; ++k) {
      rank[order[k]] = static_cast<std::uint32_t>(k);
    }
  }
  std::vector<std::size_t> start(n + 1, 0);
  std::size_t total = 0;
  for (const auto& part : parts) {
    total += part.size();
    for (const Pair& pair : part) {
      ++start[rank[pair.first] + 1U];
    }
  }
  std::partial_sum(start.begin(), start.end(), start.begin());
  resizeAnew(out, total);
  std::vector<std::size_t> next(start.begin(), start.end() - 1);
  for (const auto& part : parts) {
    for (const Pair& pair : part) {
      out[next[rank[pair.first]]++] = pair;
    }
  }
  parallelFor(n, 1024, [&](std::size_t k) {
    std::sort(out.begin() + static_cast<std::ptrdiff_t>(start[k]),
              out.begin() + static_cast<std::ptrdiff_t>(start[k + 1]),
              [&](const Pair& a, const Pair& b) { return rank[a.second] < rank[b.second]; });
  });
  out.erase(std::unique(out.begin(), out.end()), out.end());  // a small box shows a body more than once
}

}  // namespace detail

}  // namespace gravel
