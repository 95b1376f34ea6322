#pragma once

/// \file
/// Candidate pairs that are found with a skin and kept until a body has moved half of it (Verlet 1967).

#include <gravel/spatial/broad_phase.hpp>
#include <gravel/spatial/strays.hpp>

#include <optional>

namespace gravel {

/// Keeps the pairs of one search for as long as they are certain to hold every pair within reach. They are
/// always a superset of what a fresh search would give, so that the skin has no say in any result.
///
/// In a shear-periodic box displacements are measured against the flow -(3/2) Omega x, in whose frame the
/// images stand still, and what the flow itself can bring a touching pair nearer is taken off the skin.
///
/// A list can be asked to hold for a whole step, along straight ways whose ends are known. A few bodies that
/// leave their half of the skin, bullets among grains, do not spoil it: each of them is compared with all
/// others, until a new search is cheaper.
template <Real S>
class NeighbourList {
 public:
  /// Pairs with |r_ij| < r_i + r_j + margin and some others, sorted by ids. O(N) while the last search holds.
  /// \param revision any number that changes whenever indices come to name other bodies
  /// \param margin [m] >= 0
  /// \throws std::invalid_argument for positions or radii that are not finite, negative radii or margin
  /// \param travel  `travel(i)`: way [m] of body i while the list is to hold; `AtRest` for none
  template <class Positions, class Radii, class Ids, class Travel = AtRest>
  const std::vector<Pair>& update(const Positions& positions, const Radii& radii, const Ids& ids,
                                  std::uint64_t revision, const Domain<S>& domain, const S& time,
                                  const S& margin = S(0), const Travel& travel = {}) {
    detail::require("margin of a neighbour list", margin, detail::nonNegative<S>());
    ++updates_;
    version_ += extra_.empty() ? 0U : 1U;
    extra_.clear();
    strays_ = false;
    reason_ = whatIsStale(positions, radii, revision, domain, time, margin, travel);
    rebuilt_ = reason_ != nullptr;
    if (rebuilt_) {
      rebuild(positions, radii, ids, revision, domain, time, margin, travel);
    }
    comparisons_ += swift_.size();
    swiftPairs_.resize(std::max(swiftPairs_.size(), swift_.size()));
    parallelForTasks(swift_.size(), [&](std::size_t k) {
      swiftPairs_[k].clear();
      detail::compare(swift_[k], positions, radii, ids, detail::wayOf<S>(travel, swift_[k]), travel,
                      S(room_ - skin_), free_, domain_, time_, swiftPairs_[k]);
    });
    for (std::size_t k = 0; k < swift_.size(); ++k) {
      extra_.insert(extra_.end(), swiftPairs_[k].begin(), swiftPairs_[k].end());
    }
    join(ids);
    return pairs();
  }

  const std::vector<Pair>& pairs() const { return extra_.empty() ? pairs_ : joined_; }

  /// A body has taken another course since the update: appends to `out` the pairs that its new way adds to
  /// those of pairs(). O(1) while it stays in its half of the skin, else O(N).
  /// \param way [m] from positions[i]
  template <class Positions, class Radii, class Ids, class Travel>
  void follow(std::uint32_t i, const Positions& positions, const Radii& radii, const Ids& ids,
              const Vector3<S>& way, const Travel& travel, std::vector<Pair>& out) {
    Vector3<S> x = positions[i];
    x[1] += flow_ * x[0];
    const S from_sq = domain_.minimumImage(x - places_[i], time_).squaredNorm();
    x = Vector3<S>(positions[i]) + way;
    x[1] += flow_ * x[0];
    const S to_sq = domain_.minimumImage(x - places_[i], time_).squaredNorm();
    if (!(S(4) * std::max<S>(from_sq, to_sq) <= free_ * free_)) {
      ++comparisons_;
      strays_ = true;
      detail::compare(i, positions, radii, ids, way, travel, S(room_ - skin_), free_, domain_, time_, out);
    }
  }

  /// Adds pairs that follow() found to those of pairs(), until the next update.
  template <class Ids>
  void add(const std::vector<Pair>& more, const Ids& ids) {
    if (!more.empty()) {
      extra_.insert(extra_.end(), more.begin(), more.end());
      join(ids);
    }
  }

  /// A number that is another one, above 0, whenever pairs() may be others.
  std::uint64_t version() const { return version_; }

  /// Whether some body was, or is on a way to be, further than half the skin from where the last search saw
  /// it.
  bool strays() const { return strays_ || !swift_.empty(); }

  /// Whether the last update searched.
  bool rebuilt() const { return rebuilt_; }
  /// Searches made so far.
  std::uint64_t searches() const { return searches_; }

  /// Why the last update searched, or why it did not.
  const char* reason() const {
    return rebuilt_ ? reason_ : "no body has moved half the skin since the last search";
  }

  /// The skin [m] of the list in use.
  const S& skin() const { return skin_; }

  /// Fixes the skin [m] >= 0 from the next search on; without a value it is chosen again from the motion
  /// seen. Costs only: a thick skin means fewer searches and more candidates.
  void setSkin(std::optional<S> skin) {
    if (skin) {
      detail::require("skin", *skin, detail::nonNegative<S>());
    }
    fixedSkin_ = skin;
  }

  void setKind(BroadPhaseKind kind) { search_.setKind(kind); }
  const BroadPhase<S>& search() const { return search_; }

  /// Forgets the list, so that the next update searches.
  void clear() { built_ = false; }

 private:
  /// nullptr if the list still holds, but for the swift.
  template <class Positions, class Radii, class Travel>
  const char* whatIsStale(const Positions& positions, const Radii& radii, std::uint64_t revision,
                          const Domain<S>& domain, const S& time, const S& margin, const Travel& travel) {
    swift_.clear();
    if (!built_) {
      return "first search";
    }
    if (revision != revision_ || positions.size() != places_.size()) {
      return "bodies were added, removed or reordered";
    }
    if (!(domain == domain_)) {
      return "the domain changed";
    }
    flow_ = S(1.5) * domain.omega() * (time - time_);
    const S drift = flow_ < S(0) ? S(-flow_) : flow_;
    free_ = room_ - margin - drift * (S(2) * largest_ + margin);
    if (free_ < S(0)) {
      return margin > S(0) ? "the margin grew or the flow used up the skin" : "the flow used up the skin";
    }
    const std::size_t n = places_.size();
    const bool isOpen = domain.isOpen();
    parts_.resize((n + chunk - 1) / chunk);
    parallelForChunks<Share::Alike>(n, chunk, [&](std::size_t begin, std::size_t end) {
      const auto wayFrom = [&](std::size_t i, const Vector3<S>& x) {
        Vector3<S> d = x - places_[i];
        if (!isOpen) {
          d[1] += flow_ * x[0];
          d = domain.minimumImage(d, time_);
        }
        return d.squaredNorm();
      };
      const auto farthest = [&](std::size_t i) {
        const Vector3<S> x = positions[i];
        const S d_sq = wayFrom(i, x);
        if constexpr (std::is_same_v<Travel, AtRest>) {
          return d_sq;
        } else {
          const S end_sq = wayFrom(i, Vector3<S>(x + Vector3<S>(travel(i))));
          return end_sq > d_sq || !(end_sq == end_sq) ? end_sq : d_sq;
        }
      };
      const auto same = [&](std::size_t i) { return radii[i] == radii_[i]; };
      parts_[begin / chunk].look(begin, end, S(free_ * free_ / S(4)), farthest, same);
    });
    moved_sq_ = S(0);
    for (const detail::Wandering<S>& part : parts_) {
      if (part.otherRadius) {
        return "a radius changed";
      }
      if (part.lost) {
        return "a place is not finite";
      }
      moved_sq_ = std::max<S>(moved_sq_, part.moved_sq);
      swift_.insert(swift_.end(), part.swift.begin(), part.swift.end());
    }
    if (comparisons_ + swift_.size() <= mostComparisons && swift_.size() <= mostSwift(n)) {
      return nullptr;
    }
    moved_sq_ = std::max<S>(moved_sq_, free_ * free_ / S(4));
    for (std::size_t c = 0; c < parts_.size() && swift_.size() > mostSwift(n); ++c) {
      moved_sq_ = std::max<S>(moved_sq_, parts_[c].most_sq);
    }
    return "bodies moved half the skin";
  }

  /// pairs_ and extra_ in one list, in the order of ids.
  template <class Ids>
  void join(const Ids& ids) {
    if (extra_.empty()) {
      return;
    }
    ++version_;
    const auto keys = [&](const Pair& pair) {
      return std::pair(detail::idKey(ids[pair.first]), detail::idKey(ids[pair.second]));
    };
    const auto before = [&](const Pair& a, const Pair& b) { return keys(a) < keys(b); };
    std::sort(extra_.begin(), extra_.end(), before);
    extra_.erase(std::unique(extra_.begin(), extra_.end()), extra_.end());
    joined_.clear();
    joined_.reserve(pairs_.size() + extra_.size());
    auto from = pairs_.cbegin();  // few among many: those between two of them are copied as they are
    for (const Pair& pair : extra_) {
      const auto place = std::lower_bound(from, pairs_.cend(), pair, before);
      joined_.insert(joined_.end(), from, place);
      if (place == pairs_.cend() || *place != pair) {
        joined_.push_back(pair);
      }
      from = place;
    }
    joined_.insert(joined_.end(), from, pairs_.cend());
  }

  template <class Positions, class Radii, class Ids, class Travel>
  void rebuild(const Positions& positions, const Radii& radii, const Ids& ids, std::uint64_t revision,
               const Domain<S>& domain, const S& time, const S& margin, const Travel& travel) {
    const std::size_t n = positions.size();
    const bool motionSeen = built_ && revision == revision_ && n == places_.size() && isFinite(moved_sq_);
    ++version_;
    ++searches_;
    built_ = false;  // stays so if the search throws
    places_.resize(n);
    radii_.resize(n);
    largest_ = S(0);
    std::vector<S> spheres;
    for (std::size_t i = 0; i < n; ++i) {
      places_[i] = positions[i];
      radii_[i] = radii[i];
      largest_ = std::max(largest_, radii_[i]);
      if (radii_[i] > S(0)) {
        spheres.push_back(radii_[i]);
      }
    }
    const auto middle = spheres.begin() + static_cast<std::ptrdiff_t>(spheres.size() / 2);
    std::nth_element(spheres.begin(), middle, spheres.end());
    const S median = spheres.empty() ? S(0) : *middle;
    skin_ = fixedSkin_ ? *fixedSkin_ : chooseSkin(median, motionSeen);
    swift_.clear();
    if constexpr (!std::is_same_v<Travel, AtRest>) {
      skin_ = std::max<S>(skin_, detail::takeSwift(n, mostSwift(n), skin_, travel, swift_));
    }
    free_ = skin_;
    flow_ = S(0);
    comparisons_ = 0;
    room_ = margin + skin_;
    // Distances at both times and the displacement are rounded: a few units of what is subtracted.
    S scale = S(2) * largest_ + room_;
    if (!domain.isOpen()) {
      scale += domain.lengths().maxCoeff();
    }
    const S slack = S(32) * detail::roundoff<S>() * scale;
    search_.findPairs(positions, radii, ids, S(room_ + slack), domain, time, pairs_);
    revision_ = revision;
    domain_ = domain;
    time_ = time;
    updates_ = 0;
    built_ = true;
  }

  /// So thick that the list would have held for `goodLife` updates of the motion last seen, within a fraction
  /// of the median radius (a mean would be that of a giant among grains); no skin at all where it would not
  /// even hold for two.
  S chooseSkin(const S& radius, bool motionSeen) {
    constexpr double goodLife = 16.0;
    const S thickest = S(0.8) * radius;
    const S thinnest = S(0.02) * radius;
    if (!motionSeen || !(moved_sq_ > S(0))) {
      return S(0.1) * radius;
    }
    using std::sqrt;
    const S perUpdate = S(2) * S(sqrt(moved_sq_)) / S(static_cast<double>(updates_));
    if (S(2) * perUpdate > thickest) {
      return S(0);
    }
    return std::min(std::max(S(S(goodLife) * perUpdate), thinnest), thickest);
  }

  static constexpr std::size_t chunk = 512;
  /// A search costs about as much as this many comparisons of one body with all others.
  static constexpr std::size_t mostComparisons = 128;
  static std::size_t mostSwift(std::size_t n) { return std::min<std::size_t>(8, n / 64); }

  BroadPhase<S> search_;
  std::vector<Pair> pairs_;
  std::vector<Vector3<S>> places_;  ///< at the last search
  std::vector<S> radii_;
  std::vector<detail::Wandering<S>> parts_;
  std::vector<std::uint32_t> swift_;           ///< bodies that may leave their half of the skin
  std::vector<std::vector<Pair>> swiftPairs_;  ///< of each of them
  std::vector<Pair> extra_;                    ///< all of these, and more that were added
  std::vector<Pair> joined_;                   ///< pairs_ and extra_
  std::size_t comparisons_ = 0;                ///< of one body with all others since the last search
  Domain<S> domain_;
  S time_ = S(0);
  S largest_ = S(0);
  S skin_ = S(0);
  S room_ = S(0);  ///< margin and skin of the last search
  S free_ = S(0);  ///< what is left of the skin
  S flow_ = S(0);  ///< [1] shear since the last search
  S moved_sq_ = S(0);
  std::optional<S> fixedSkin_;
  std::uint64_t revision_ = 0;
  std::uint64_t updates_ = 0;  ///< since the last search
  std::uint64_t version_ = 0;
  std::uint64_t searches_ = 0;
  const char* reason_ = nullptr;
  bool strays_ = false;
  bool built_ = false;
  bool rebuilt_ = false;
};

}  // namespace gravel
