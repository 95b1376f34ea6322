#pragma once

/// \file
/// Bodies that outrun the skin of a neighbour list: which they are, the comparison of one with all others,
/// and how its pairs join the list's; and how thick a skin few outrun.

#include <gravel/core/memory.hpp>
#include <gravel/spatial/common_motion.hpp>
#include <gravel/spatial/pair.hpp>

#include <span>

namespace gravel {

namespace detail {

/// How far some bodies got from where a search saw them, and which of them too far.
template <Real S>
struct Wandering {
  S moved_sq = S(0);  ///< most of those that did not get too far
  S most_sq = S(0);   ///< most of the others, the swift
  S bend = S(0);      ///< [m] the most
  bool otherRadius = false;
  bool lost = false;  ///< one is at no finite place
  std::vector<std::uint32_t> swift;

  /// For bodies [begin, end).
  /// \param straight, farthest  straight(i): squared distance [m^2] along the chord, NaN where a coordinate
  ///   is; farthest(i): on the path \param mostBend  mostBend(i): no more than this [m] are they apart
  /// \param same  same(i): whether the radius is what it was
  template <class Straight, class MostBend, class Farthest, class Same>
  void look(std::size_t begin, std::size_t end, const S& within, Straight&& straight, MostBend&& mostBend,
            Farthest&& farthest, Same&& same) {
    moved_sq = most_sq = bend = S(0);
    lost = false;
    swift.clear();
    const auto isNear = [&](std::size_t i, const S& d_sq) {
      const S left = within - mostBend(i);
      return d_sq <= left * sizeOf(left);
    };
    // Mostly all are near: first a loop without branches.
    bool near = true;
    bool alike = true;
    S most(0);
    for (std::size_t i = begin; i < end; ++i) {
      const S d_sq = straight(i);
      near = near & isNear(i, d_sq);
      alike = alike & same(i);
      most = d_sq > most ? d_sq : most;
      bend = std::max<S>(bend, mostBend(i));
    }
    otherRadius = !alike;
    if (near) {
      moved_sq = most;
      return;
    }
    for (std::size_t i = begin; i < end; ++i) {
      S d_sq = straight(i);
      d_sq = isNear(i, d_sq) ? d_sq : farthest(i);
      if (d_sq <= within * within) {
        moved_sq = std::max<S>(moved_sq, d_sq);
      } else {
        swift.push_back(static_cast<std::uint32_t>(i));
        lost = lost || !isFinite(d_sq);
        most_sq = std::max<S>(most_sq, d_sq);
      }
    }
  }
};

/// [m] So thick that a list would hold for sixteen updates of the motion last seen, within a fraction of the
/// median radius (a mean would be that of a giant among grains); no skin at all where it would not even hold
/// for two.
/// \param radii [m] in any order \param perUpdate [m] what an update took of the skin; 0 if that is not known
template <Real S>
S skinFor(std::vector<S>& radii, const S& perUpdate) {
  constexpr double goodLife = 16.0;
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), middle, radii.end());
  const S radius = radii.empty() ? S(0) : *middle;
  const S thickest = S(0.8) * radius;
  const S thinnest = S(0.02) * radius;
  if (!(perUpdate > S(0))) {
    return S(0.1) * radius;
  }
  if (S(2) * perUpdate > thickest) {
    return S(0);
  }
  return std::min(std::max(S(S(goodLife) * perUpdate), thinnest), thickest);
}

/// Appends the pairs of body i on its way, with others on theirs. O(N).
/// \param own [m] its way from positions[i]
/// \param travel `travel(j)`: way [m] of body j; `AtRest` for none
/// \param ahead [1] of CommonMotion, less whose frame these ways are
/// \param slack [m] added to the sum of the radii
/// \param free [m] what is left of the skin \param most [m] bend of any
/// \param share [1] of the ways after which they are on them: of the images that are nearest there, and
/// halfway to the end, see Domain::imageAt()
template <Real S, class Positions, class Radii, class Ids, class Travel>
void compare(std::uint32_t i, const Positions& positions, const Radii& radii, const Ids& ids,
             const Vector3<S>& own, const Travel& travel, const S& ahead, const S& slack, const S& free,
             const S& most, const Domain<S>& domain, const S& time, const S& share, std::vector<Pair>& out) {
  const Vector3<S> x = positions[i];
  Vector3<S> way = own;
  S length_sq = way.squaredNorm();
  using std::sqrt;
  const S bend = S(sqrt(bendOf_sq<S>(travel, i)));
  const bool sheared = !(ahead == S(0));
  const S h = sheared ? S(ahead / (S(1.5) * domain.omega())) : S(0);  // [s]
  const S widest = slack + free + bend + most + S(sqrt(length_sq));
  const S rounded = S(1) + S(16) * roundoff<S>();
  const S left = sizeOf(ahead) < S(1) ? S(S(1) - sizeOf(ahead)) : S(0);
  const S r_i = radii[i];
  const std::uint64_t id = idKey(ids[i]);
  for (std::uint32_t j = 0; j < positions.size(); ++j) {
    const S radii_ij = r_i + radii[j];
    if (j == i || !(radii_ij > S(0))) {
      continue;
    }
    const Vector3<S> way_j = wayOf<S>(travel, j);
    const Vector3<S> apart = Vector3<S>(positions[j]) - x;
    const S straight_sq = way_j.squaredNorm();
    // Most are so far that no image comes near, since none is nearer now, and the flow takes one at r by
    // `ahead` |r| at most: (a + b)^2 <= 2 (a^2 + b^2).
    const S near = radii_ij + widest;
    if (domain.minimumImage(apart, time).squaredNorm() * (left * left) >
        S(2) * rounded * (near * near + straight_sq)) {
      continue;
    }
    const S way_sq = squareOfSum<S>(straight_sq, bendOf_sq<S>(travel, j));
    // Another course may take it anywhere within its half of the skin, which is this far at most.
    const S reach = radii_ij + slack + bend + std::max<S>(S(sqrt(way_sq)), free);
    for (const S& part : {share, S((S(1) + share) / S(2))}) {  // see ImpactForecast::meeting()
      Vector3<S> between = way_j - own;
      between[1] -= ahead * apart[0];  // with the flow again
      Vector3<S> drift = Vector3<S>::Zero();
      const Vector3<S> r = domain.imageAt(apart, Vector3<S>(part * between), S(part * h), drift, time);
      if (sheared) {  // as seen from the flow where j is
        way[1] = own[1] + ahead * r[0];
        length_sq = way.squaredNorm();
      }
      // The nearest point of the way: x + way s, 0 <= s <= 1.
      const S s = length_sq > S(0) ? std::min<S>(S(1), std::max<S>(S(0), S(way.dot(r) / length_sq))) : S(0);
      if (Vector3<S>(r - s * way).squaredNorm() <= reach * reach * rounded) {
        out.push_back(id < idKey(ids[j]) ? Pair{i, j} : Pair{j, i});
        break;
      }
      if (domain.isOpen()) {
        break;
      }
    }
  }
}

/// Which bodies may outrun any skin: the few fastest, or so many more as are a crowd of bullets.
template <Real S>
struct SwiftOnes {
  std::size_t most = 0;  ///< how many they are at most
  S next_sq = S(0);      ///< [m^2] square of the longest way of all others

  /// Eight, or up to 64 where those leave others less than a fourth of the way; no more than one in 64. O(N).
  /// \param ways_sq [m^2] squares of all ways, which this puts in another order
  static SwiftOnes of(std::span<S> ways_sq) {
    const std::size_t n = ways_sq.size();
    const auto longestBut = [&](std::size_t swift) {
      const auto place = ways_sq.begin() + static_cast<std::ptrdiff_t>(swift);
      std::nth_element(ways_sq.begin(), place, ways_sq.end(), [](const S& a, const S& b) { return b < a; });
      return SwiftOnes{swift, *place};
    };
    if (n == 0) {
      return {};
    }
    const SwiftOnes few = longestBut(std::min<std::size_t>(8, n / 64));
    const SwiftOnes many = longestBut(std::min<std::size_t>(64, n / 64));
    return S(16) * many.next_sq < few.next_sq ? many : few;
  }
};

/// Puts the swift ones of n bodies in `swift`, in order; none that the skin [m] holds. O(N).
/// \return how many may be, and whose ways the list must hold
template <Real S, class Travel>
SwiftOnes<S> takeSwift(std::size_t n, const S& skin, const Travel& travel,
                       std::vector<std::uint32_t>& swift) {
  std::vector<S> ways(n);
  for (std::size_t i = 0; i < n; ++i) {
    ways[i] = squareOfSum<S>(wayOf<S>(travel, i).squaredNorm(), bendOf_sq<S>(travel, i));
    if (!isFinite(ways[i])) {
      return {};  // the search will say which
    }
  }
  std::vector<S> sorted = ways;
  const SwiftOnes<S> ones = SwiftOnes<S>::of(sorted);
  for (std::size_t i = 0; i < n; ++i) {
    if (ways[i] > ones.next_sq && S(4) * ways[i] > skin * skin) {
      swift.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return ones;
}

/// `pairs` and `extra`, which is left sorted and without doubles, in one list, in the order of ids; without
/// extra ones it takes no room.
template <class Ids>
void join(const std::vector<Pair>& pairs, std::vector<Pair>& extra, const Ids& ids,
          std::vector<Pair>& joined) {
  if (extra.empty()) {
    release(joined);
    return;
  }
  const auto keys = [&](const Pair& pair) {
    return std::pair(idKey(ids[pair.first]), idKey(ids[pair.second]));
  };
  const auto before = [&](const Pair& a, const Pair& b) { return keys(a) < keys(b); };
  std::sort(extra.begin(), extra.end(), before);
  extra.erase(std::unique(extra.begin(), extra.end()), extra.end());
  joined.clear();
  joined.reserve(pairs.size() + extra.size());
  auto from = pairs.cbegin();  // few among many: those between two of them are copied as they are
  for (const Pair& pair : extra) {
    const auto place = std::lower_bound(from, pairs.cend(), pair, before);
    joined.insert(joined.end(), from, place);
    if (place == pairs.cend() || *place != pair) {
      joined.push_back(pair);
    }
    from = place;
  }
  joined.insert(joined.end(), from, pairs.cend());
}

}  // namespace detail

}  // namespace gravel
