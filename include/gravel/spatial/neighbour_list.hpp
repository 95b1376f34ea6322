#pragma once

/// \file
/// Candidate pairs that are found with a skin and kept until a body has moved half of it (Verlet 1967).

#include <gravel/core/sizes.hpp>
#include <gravel/spatial/broad_phase.hpp>
#include <gravel/spatial/strays.hpp>

#include <optional>

namespace gravel {

/// Keeps the pairs of one search for as long as they are certain to hold every pair within reach, so that the
/// skin has no say in any result.
///
/// In a shear-periodic box ways are measured against the flow -(3/2) Omega x, in whose frame the images stand
/// still, and what the flow itself can bring a touching pair nearer is taken off the skin. A list can be
/// asked to hold for a whole step, along ways of which the ends and the bends are known. A few bodies that
/// leave their half of the skin, bullets among grains, do not spoil it: each of them is compared with all
/// others, until a new search is cheaper. Nor does, without shear, what most have in common: a pile in orbit.
template <Real S>
class NeighbourList {
 public:
  /// Pairs with |r_ij| < r_i + r_j + margin and some others, sorted by ids. O(N) while the last search holds.
  /// \param revision any number that changes whenever indices come to name other bodies
  /// \param margin [m] >= 0
  /// \throws std::invalid_argument for values that are not finite, negative radii or margin, unlike lengths
  /// \param travel  `travel(i)`: way [m] of body i while the list is to hold; `AtRest` for none; and
  ///   `bend(i)`, of detail::bendOf()
  /// \param h [s] that these ways take, for a sheared domain
  template <class Positions, class Radii, class Ids, class Travel = AtRest>
  const std::vector<Pair>& update(const Positions& positions, const Radii& radii, const Ids& ids,
                                  std::uint64_t revision, const Domain<S>& domain, const S& time,
                                  const S& margin = S(0), const Travel& travel = {}, const S& h = S(0)) {
    detail::require("margin of a neighbour list", margin, detail::nonNegative<S>());
    detail::requireAsMany(positions.size(), radii.size(), ids.size());
    now_ = time;
    common_.shear(S(S(1.5) * domain.omega() * h));
    ++updates_;
    version_ += extra_.empty() ? 0U : 1U;
    extra_.clear();
    strays_ = false;
    reason_ = whatIsStale(positions, radii, revision, domain, time, margin, travel);
    rebuilt_ = reason_ != nullptr;
    if (rebuilt_) {
      rebuild(positions, radii, ids, revision, domain, time, margin, travel);
    }
    slack_ = S(alongside(margin, common_.shearing()) + free_ * (common_.spread() - S(1)));
    comparisons_ += swift_.size();
    swiftPairs_.resize(std::max(swiftPairs_.size(), swift_.size()));
    const auto rest = common_.lessThis(positions, travel);
    parallelForTasks(swift_.size(), [&](std::size_t k) {
      swiftPairs_[k].clear();
      detail::compare(swift_[k], positions, radii, ids, detail::wayOf<S>(rest, swift_[k]), rest,
                      common_.ahead(), slack_, free_, bend_, domain_, now_, S(0), swiftPairs_[k]);
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
  /// \param way [m] from positions[i], as from the update on \param share [1] of the ways since then
  template <class Positions, class Radii, class Ids, class Travel>
  void follow(std::uint32_t i, const Positions& positions, const Radii& radii, const Ids& ids,
              const Vector3<S>& way, const Travel& travel, std::vector<Pair>& out, const S& share = S(0)) {
    if (!(withBend_sq(farthest_sq(i, positions[i], way), i, travel) <= half_ * half_)) {
      ++comparisons_;
      strays_ = true;
      detail::compare(i, positions, radii, ids, common_.lessThis(Vector3<S>(positions[i]), way),
                      common_.lessThis(positions, travel), common_.ahead(), slack_, free_, bend_, domain_,
                      now_, share, out);
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

  /// Leaves out pairs of which `apart(pair)`: they cannot touch. Who lets them touch again clears the list.
  template <class Apart, class Ids>
  void leaveOut(const Apart& apart, const Ids& ids) {
    version_ += std::erase_if(pairs_, apart) > 0 ? 1U : 0U;
    join(ids);
  }

  /// A number that is another one, above 0, whenever pairs() may be others.
  std::uint64_t version() const { return version_; }
  /// Whether some body was, or is on a way to be, half the skin from where the last search saw it.
  bool strays() const { return strays_ || !swift_.empty() || !common_.isNone(); }
  bool rebuilt() const { return rebuilt_; }  ///< whether the last update searched
  std::uint64_t searches() const { return searches_; }
  const char* reason() const {  ///< why the last update searched, or did not
    return rebuilt_            ? reason_
           : !common_.isNone() ? "no body has left the others by half the skin since the last search"
                               : "no body has moved half the skin since the last search";
  }
  const S& skin() const { return skin_; }  ///< [m] of the list in use
  /// [m] >= 0 from the next search on, or chosen by the motion. A thick one: few searches, many candidates.
  void setSkin(std::optional<S> skin) {
    if (skin) {
      detail::require("skin", *skin, detail::nonNegative<S>());
    }
    fixedSkin_ = skin;
  }

  void setKind(BroadPhaseKind kind) { search_.setKind(kind); }
  void clear() { built_ = false; }  ///< the next update searches

 private:
  /// nullptr if the list still holds, but for the swift.
  template <class Positions, class Radii, class Travel>
  const char* whatIsStale(const Positions& positions, const Radii& radii, std::uint64_t revision,
                          const Domain<S>& domain, const S& time, const S& margin, const Travel& travel) {
    detail::clearSpare(swift_);
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
    const S drift = detail::sizeOf(flow_) + common_.shearing();
    free_ = (room_ - alongside(margin, drift)) / common_.spread();
    if (free_ < S(0)) {
      return margin > S(0) ? "the margin grew or the flow used up the skin" : "the flow used up the skin";
    }
    const Vector3<S> last = domain.isOpen() ? Vector3<S>(Vector3<S>::Zero()) : common_.end();
    common_.clear();
    setHalf();
    const char* reason = whoMoved(positions, radii, travel);
    if (reason != tooFar || !(domain.omega() == S(0))) {
      return reason;
    }
    const auto moved = [&](std::size_t i) {  // in a box by the image nearest to where all went last
      return Vector3<S>(last + domain.minimumImage(Vector3<S>(positions[i]) - places_[i] - last, time));
    };
    const auto moves = [&](std::size_t i) { return Vector3<S>(moved(i) + detail::wayOf<S>(travel, i)); };
    common_.find(places_.size(), moved, moves, travel);
    setHalf();
    return common_.isNone() ? reason : whoMoved(positions, radii, travel);
  }

  /// nullptr if all but the swift are within their half of the skin, less what all have in common.
  template <class Positions, class Radii, class Travel>
  const char* whoMoved(const Positions& positions, const Radii& radii, const Travel& travel) {
    const std::size_t n = places_.size();
    const S common = detail::sumAbs(common_.bend());
    parts_.resize((n + chunk - 1) / chunk);
    parallelForChunks<Share::Alike>(n, chunk, [&](std::size_t begin, std::size_t end) {
      const auto straight = [&](std::size_t i) __attribute__((always_inline)) {
        return farthest_sq(i, positions[i], detail::wayOf<S>(travel, i));
      };
      const auto bend = [&](std::size_t i) { return S(common + detail::mostBendOf<S>(travel, i)); };
      const auto farthest = [&](std::size_t i) { return withBend_sq(straight(i), i, travel); };
      const auto same = [&](std::size_t i) { return radii[i] == radii_[i]; };
      parts_[begin / chunk].look(begin, end, half_, straight, bend, farthest, same);
    });
    moved_sq_ = bend_ = S(0);
    swift_.clear();
    for (const detail::Wandering<S>& part : parts_) {
      if (part.otherRadius || part.lost) {
        return part.otherRadius ? "a radius changed" : "a place is not finite";
      }
      moved_sq_ = std::max<S>(moved_sq_, part.moved_sq);
      bend_ = std::max<S>(bend_, part.bend);
      swift_.insert(swift_.end(), part.swift.begin(), part.swift.end());
    }
    if (comparisons_ + swift_.size() <= mostComparisons && swift_.size() <= ones_.most) {
      return nullptr;
    }
    moved_sq_ = std::max<S>(moved_sq_, half_ * half_);
    for (std::size_t c = 0; c < parts_.size() && swift_.size() > ones_.most; ++c) {
      moved_sq_ = std::max<S>(moved_sq_, parts_[c].most_sq);
    }
    return tooFar;
  }

  /// From where the last search saw body i to where it is on this way from x, less what all have in common.
  [[gnu::always_inline]] S farthest_sq(std::size_t i, const Vector3<S>& x, const Vector3<S>& way) const {
    Vector3<S> start = x - places_[i] - common_.start();
    Vector3<S> end;
    if (domain_.isOpen()) {
      end = Vector3<S>(x + way) - places_[i] - common_.end();
    } else {
      start[1] += flow_ * x[0];
      start = domain_.minimumImage(start, time_);
      end = start + common_.lessThis(x, way);
      end[1] += flow_ * way[0];
    }
    const S d_sq = start.squaredNorm();
    const S end_sq = end.squaredNorm();
    return end_sq > d_sq || !(end_sq == end_sq) ? end_sq : d_sq;
  }
  template <class Travel>
  S withBend_sq(const S& farthest_sq, std::size_t i, const Travel& travel) const {
    return detail::squareOfSum<S>(farthest_sq, detail::bendLess_sq<S>(travel, i, common_.bend()));
  }

  /// [m] What a margin takes besides the skin where the flow shears by that much.
  S alongside(const S& margin, const S& shear) const { return margin + shear * (S(2) * largest_ + margin); }

  /// How far a body may get, less what subtraction loses: a few units in its last place.
  void setHalf() {
    const S half = free_ / S(2) - S(16) * detail::roundoff<S>() * common_.most();
    half_ = half > S(0) ? half : S(0);
  }

  template <class Ids>
  void join(const Ids& ids) {
    version_ += extra_.empty() ? 0U : 1U;
    detail::join(pairs_, extra_, ids, joined_);
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
    largest_ = bend_ = S(0);
    std::vector<S> spheres;
    for (std::size_t i = 0; i < n; ++i) {
      places_[i] = positions[i];
      radii_[i] = radii[i];
      largest_ = std::max(largest_, radii_[i]);
      bend_ = std::max<S>(bend_, detail::mostBendOf<S>(travel, i));
      if (radii_[i] > S(0)) {
        spheres.push_back(radii_[i]);
      }
    }
    using std::sqrt;
    const S updates = S(static_cast<double>(std::max<std::uint64_t>(1, updates_)));
    const S perUpdate = motionSeen ? S(S(2) * S(sqrt(moved_sq_)) / updates) : S(0);
    skin_ = fixedSkin_ ? *fixedSkin_ : detail::skinFor(spheres, perUpdate);
    swift_.clear();
    flow_ = S(0);
    common_.clear();
    if constexpr (!std::is_same_v<Travel, AtRest>) {
      if (domain.omega() == S(0)) {
        common_.findAhead(n, travel, S(skin_ / S(8)));
      }
      bend_ += detail::sumAbs(common_.bend());
    }
    ones_ = detail::takeSwift(n, skin_, common_.lessThis(positions, travel), swift_);
    skin_ = std::max<S>(skin_, S(2) * S(sqrt(ones_.next_sq)));
    free_ = skin_;
    setHalf();
    comparisons_ = 0;
    room_ = alongside(margin, common_.shearing()) + skin_ * common_.spread();
    // Distances at both times and the displacement are rounded: a few units of what is subtracted.
    const S scale =
        S(2) * largest_ + room_ + common_.most() + (domain.isOpen() ? S(0) : S(domain.lengths().maxCoeff()));
    const S slack = S(32) * detail::roundoff<S>() * scale;
    search_.findPairs(positions, radii, ids, S(room_ + slack), domain, time, pairs_);
    revision_ = revision;
    domain_ = domain;
    time_ = time;
    updates_ = 0;
    built_ = true;
  }

  static constexpr const char* tooFar = "bodies moved half the skin";
  static constexpr std::size_t chunk = 512;
  static constexpr std::size_t mostComparisons = 128;  ///< of one with all, that cost what a search does

  BroadPhase<S> search_;
  std::vector<Pair> pairs_;
  std::vector<Vector3<S>> places_;  ///< at the last search
  std::vector<S> radii_;
  std::vector<detail::Wandering<S>> parts_;
  std::vector<std::uint32_t> swift_;           ///< bodies that may leave their half of the skin
  std::vector<std::vector<Pair>> swiftPairs_;  ///< of each of them
  std::vector<Pair> extra_;                    ///< all of these, and more that were added
  std::vector<Pair> joined_;                   ///< pairs_ and extra_
  detail::SwiftOnes<S> ones_;                  ///< that may be swift
  std::size_t comparisons_ = 0;                ///< since the last search
  Domain<S> domain_;
  S time_ = S(0);
  S now_ = S(0);  ///< of the last update
  S largest_ = S(0);
  S skin_ = S(0);
  S room_ = S(0);   ///< margin and skin of the last search
  S free_ = S(0);   ///< what is left of the skin
  S slack_ = S(0);  ///< what else the margin of the last update wants
  S half_ = S(0);   ///< how far a body may get
  S bend_ = S(0);   ///< of any way, at most
  detail::CommonMotion<S> common_;
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
