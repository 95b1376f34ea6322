#pragma once

/// \file
/// Candidate pairs that are found with a skin and kept until a body has moved half of it (Verlet 1967).

#include <gravel/spatial/broad_phase.hpp>

#include <optional>

namespace gravel {

/// Keeps the pairs of one search for as long as they are certain to hold every pair within reach. They are
/// always a superset of what a fresh search would give, so that the skin has no say in any result.
///
/// In a shear-periodic box displacements are measured against the flow -(3/2) Omega x, in whose frame the
/// images stand still, and what the flow itself can bring a touching pair nearer is taken off the skin.
template <Real S>
class NeighbourList {
 public:
  /// Pairs with |r_ij| < r_i + r_j + margin and some others, sorted by ids. O(N) while the last search holds.
  /// \param revision any number that changes whenever indices come to name other bodies
  /// \param margin [m] >= 0
  /// \throws std::invalid_argument for positions or radii that are not finite, negative radii or margin
  template <class Positions, class Radii, class Ids>
  const std::vector<Pair>& update(const Positions& positions, const Radii& radii, const Ids& ids,
                                  std::uint64_t revision, const Domain<S>& domain, const S& time,
                                  const S& margin = S(0)) {
    detail::require("margin of a neighbour list", margin, detail::nonNegative<S>());
    ++updates_;
    reason_ = whatIsStale(positions, radii, revision, domain, time, margin);
    rebuilt_ = reason_ != nullptr;
    if (rebuilt_) {
      rebuild(positions, radii, ids, revision, domain, time, margin);
    }
    return pairs_;
  }

  const std::vector<Pair>& pairs() const { return pairs_; }

  /// Whether the last update searched.
  bool rebuilt() const { return rebuilt_; }

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
  /// nullptr if the list still holds.
  template <class Positions, class Radii>
  const char* whatIsStale(const Positions& positions, const Radii& radii, std::uint64_t revision,
                          const Domain<S>& domain, const S& time, const S& margin) {
    if (!built_) {
      return "first search";
    }
    if (revision != revision_ || positions.size() != places_.size()) {
      return "bodies were added, removed or reordered";
    }
    if (!(domain == domain_)) {
      return "the domain changed";
    }
    const S drift = S(1.5) * domain.omega() * (time - time_);
    const S flow = drift < S(0) ? S(-drift) : drift;
    const S room = room_ - margin - flow * (S(2) * largest_ + margin);
    if (room < S(0)) {
      return margin > S(0) ? "the margin grew or the flow used up the skin" : "the flow used up the skin";
    }
    moved_sq_ = S(0);
    const std::size_t n = places_.size();
    parts_.assign((n + chunk - 1) / chunk, S(0));
    staleRadius_.assign(parts_.size(), 0);
    parallelForChunks(n, chunk, [&](std::size_t begin, std::size_t end) {
      S furthest(0);
      for (std::size_t i = begin; i < end; ++i) {
        staleRadius_[begin / chunk] |= static_cast<unsigned char>(!(radii[i] == radii_[i]));
        Vector3<S> x = positions[i];
        x[1] += drift * x[0];
        const Vector3<S> d = domain.minimumImage(x - places_[i], time_);
        const S d_sq = d.squaredNorm();
        if (d_sq > furthest || !isFinite(d_sq)) {  // a NaN stays, for the search to refuse
          furthest = d_sq;
        }
      }
      parts_[begin / chunk] = furthest;
    });
    for (std::size_t c = 0; c < parts_.size(); ++c) {
      if (staleRadius_[c] != 0) {
        return "a radius changed";
      }
      if (parts_[c] > moved_sq_ || !isFinite(parts_[c])) {
        moved_sq_ = parts_[c];
      }
    }
    return S(4) * moved_sq_ <= room * room ? nullptr : "a body moved half the skin";
  }

  template <class Positions, class Radii, class Ids>
  void rebuild(const Positions& positions, const Radii& radii, const Ids& ids, std::uint64_t revision,
               const Domain<S>& domain, const S& time, const S& margin) {
    const std::size_t n = positions.size();
    const bool motionSeen = built_ && revision == revision_ && n == places_.size() && isFinite(moved_sq_);
    built_ = false;  // stays so if the search throws
    places_.resize(n);
    radii_.resize(n);
    S sum(0);
    largest_ = S(0);
    std::size_t spheres = 0;
    for (std::size_t i = 0; i < n; ++i) {
      places_[i] = positions[i];
      radii_[i] = radii[i];
      largest_ = std::max(largest_, radii_[i]);
      sum += radii_[i];
      spheres += radii_[i] > S(0) ? 1U : 0U;
    }
    const S mean = spheres == 0 ? S(0) : S(sum / S(static_cast<double>(spheres)));
    skin_ = fixedSkin_ ? *fixedSkin_ : chooseSkin(mean, motionSeen);
    room_ = margin + skin_;
    // Distances at both times and the displacement are rounded: a few units of what is subtracted.
    S scale = S(2) * largest_ + room_;
    if (!domain.isOpen()) {
      scale += domain.lengths().maxCoeff();
    }
    const S slack = S(32) * roundoff() * scale;
    search_.findPairs(positions, radii, ids, S(room_ + slack), domain, time, pairs_);
    revision_ = revision;
    domain_ = domain;
    time_ = time;
    updates_ = 0;
    built_ = true;
  }

  /// So thick that the list would have held for `goodLife` updates of the motion last seen, within a fraction
  /// of the mean radius; no skin at all where it would not even hold for two.
  S chooseSkin(const S& meanRadius, bool motionSeen) {
    constexpr double goodLife = 16.0;
    const S thickest = S(0.4) * meanRadius;
    const S thinnest = S(0.02) * meanRadius;
    if (!motionSeen || !(moved_sq_ > S(0))) {
      return S(0.1) * meanRadius;
    }
    using std::sqrt;
    const S perUpdate = S(2) * S(sqrt(moved_sq_)) / S(static_cast<double>(updates_));
    if (S(2) * perUpdate > thickest) {
      return S(0);
    }
    return std::min(std::max(S(S(goodLife) * perUpdate), thinnest), thickest);
  }

  static S roundoff() {
    using Limits = std::numeric_limits<S>;
    return Limits::is_specialized ? S(Limits::epsilon()) : S(std::numeric_limits<double>::epsilon());
  }

  static constexpr std::size_t chunk = 8192;

  BroadPhase<S> search_;
  std::vector<Pair> pairs_;
  std::vector<Vector3<S>> places_;  ///< at the last search
  std::vector<S> radii_;
  std::vector<S> parts_;
  std::vector<unsigned char> staleRadius_;
  Domain<S> domain_;
  S time_ = S(0);
  S largest_ = S(0);
  S skin_ = S(0);
  S room_ = S(0);  ///< margin and skin of the last search
  S moved_sq_ = S(0);
  std::optional<S> fixedSkin_;
  std::uint64_t revision_ = 0;
  std::uint64_t updates_ = 0;  ///< since the last search
  const char* reason_ = nullptr;
  bool built_ = false;
  bool rebuilt_ = false;
};

}  // namespace gravel
