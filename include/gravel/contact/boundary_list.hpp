#pragma once

/// \file
/// Bodies that are near a boundary, found with a skin and kept while nothing can have crossed it: a boundary
/// far away costs next to nothing.

#include <gravel/contact/contact.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/core/sizes.hpp>

#include <algorithm>
#include <span>

namespace gravel {

/// Keeps the indices of all bodies whose gap to some half-space may be below a margin, and some others.
template <Real S>
class BoundaryList {
 public:
  /// O(near bodies); O(bodies x boundaries) when it searches: where `stale`, or a boundary is another one or
  /// has moved by more than its part of the skin.
  /// \param stale  some body may have moved by more than skin/2 since the last call with `stale`, or indices
  ///   or radii changed
  /// \param skin [m] by which gaps of bodies may shrink until then
  /// \param margin [m] of gaps, the same until then
  /// \param h [s] for which boundaries move on at their velocities, and the list is to hold
  /// \return indices, increasing
  template <class Positions, class Radii>
  std::span<const std::uint32_t> update(const Positions& positions, const Radii& radii,
                                        std::span<const HalfSpace<S>> walls, bool stale, const S& skin,
                                        const S& margin, const S& h = S(0)) {
    ahead_.assign(walls.begin(), walls.end());
    for (HalfSpace<S>& wall : ahead_) {
      wall.offset += std::max<S>(S(0), wall.normal.dot(wall.velocity) * h);
    }
    if (stale || moved(ahead_)) {
      search(positions, radii, ahead_, skin, margin);
    }
    return near_;
  }

  /// Searches made so far.
  std::size_t searches() const { return searches_; }

 private:
  static constexpr std::size_t chunk = 8192;

  bool moved(std::span<const HalfSpace<S>> walls) const {
    if (walls.size() != walls_.size()) {
      return true;
    }
    for (std::size_t b = 0; b < walls.size(); ++b) {
      const S shift = walls[b].offset - walls_[b].offset;
      if (walls[b].normal != walls_[b].normal || !(shift <= wallSkin_)) {  // one that recedes does no harm
        return true;
      }
    }
    return false;
  }

  template <class Positions, class Radii>
  void search(const Positions& positions, const Radii& radii, std::span<const HalfSpace<S>> walls,
              const S& skin, const S& margin) {
    ++searches_;
    walls_.assign(walls.begin(), walls.end());
    wallSkin_ = skin;
    // The bodies' skin in full: half of it may be used up already when a boundary asks for this search.
    const S room = margin + skin + wallSkin_;
    const S slack = S(1) + S(16) * detail::roundoff<S>();
    const std::size_t n = walls.empty() ? 0 : positions.size();
    parts_.resize((n + chunk - 1) / chunk);
    parallelForChunks(n, chunk, [&](std::size_t begin, std::size_t end) {
      std::vector<std::uint32_t>& part = parts_[begin / chunk];
      part.clear();
      for (std::size_t i = begin; i < end; ++i) {
        const Vector3<S> x = positions[i];
        const S reach = (radii[i] + room) * slack;
        bool close = false;
        for (const HalfSpace<S>& wall : walls_) {
          const S rounding = (detail::maxAbs(x) + detail::sizeOf(wall.offset)) * (slack - S(1));
          close = close || !(wall.normal.dot(x) - wall.offset > reach + rounding);
        }
        if (close) {
          part.push_back(static_cast<std::uint32_t>(i));
        }
      }
    });
    near_.clear();
    for (const std::vector<std::uint32_t>& part : parts_) {
      near_.insert(near_.end(), part.begin(), part.end());
    }
  }

  std::vector<std::uint32_t> near_;
  std::vector<std::vector<std::uint32_t>> parts_;
  std::vector<HalfSpace<S>> ahead_;  ///< where they will have come
  std::vector<HalfSpace<S>> walls_;  ///< the same at the last search
  S wallSkin_ = S(0);
  std::size_t searches_ = 0;
};

}  // namespace gravel
