#pragma once

/// \file
/// Overlaps of light bodies between heavy ones, which sweeps alone would hardly open.

#include <gravel/contact/impulses.hpp>
#include <gravel/contact/overlap_lanes.hpp>

#include <map>
#include <vector>

namespace gravel::detail {

/// A sweep moves a light body m between heavy ones M to and fro, by P_k/m at contact k, and opens 2 m/M of
/// what is missing. In all it moves each body i by the little that is left, d_i = sum of +-P_k n_k/m_i. An
/// island of two contacts goes on by as many of these as leave nothing of the missing g_k, in the mean over
/// P_k:
///
///     sum P_k g_k / sum m_i d_i^2,
///
/// the lowest place along this way for Gauss-Seidel, which goes down a quadratic form. P_k n_k acts on both
/// bodies of a contact, so that the common centre of mass stays.
///
/// Angular momentum: each body goes away from the one that bears most of the moves, the hub, along the line
/// between them, and r x v of the two stays as where a contact is opened; energy of motion can only fall.
/// What would come closer to the hub, or go round it, is left to the sweeps. A fixed sphere is the hub
/// wherever there is one. Where an island leans on a plane, velocities stay.
template <Real S>
class OverlapLeaps {
 public:
  using Body = ShiftedBody<S>;

  /// Rows [begin, end) \param islands  that they are of
  OverlapLeaps(std::size_t begin, std::size_t end, std::size_t islands)
      : begin_(begin), end_(end), count_(islands) {}

  /// Before sweep 1, 2, …
  void begin(int sweep) {
    follow_ = sweep % every == 0;
    if (follow_) {
      rows_.assign(end_ - begin_, Opened{});
      islands_.resize(count_);
    }
  }
  /// These rows were opened in it.
  void take(const RowGroup<S>& group, const Packed<S>& missing, const Packed<S>& kept) {
    for (std::size_t lane = 0; follow_ && lane < group.count; ++lane) {
      rows_[group.row[lane] - begin_] = {missing[lane], kept[lane]};
    }
  }

  /// After a sweep.
  /// \param numberOf  a row's island among these, or `islands` if that is not to leap
  /// \param positionOf  a slot, before any move \param tell  called with who moved, and how far
  /// \return energy of motion lost [J]
  template <class NumberOf, class PositionOf, class Tell>
  [[gnu::noinline]] S leap(std::span<const Contact<S>> contacts, const ContactColoring& colouring,
                           std::vector<Body>& bodies, bool keepAngularMomentum, NumberOf&& numberOf,
                           PositionOf&& positionOf, Tell&& tell) {
    S loss = S(0);
    if (!follow_) {
      return loss;
    }
    for (Island& island : islands_) {
      island.reset();
    }
    const auto forRows = [&](auto&& f) {
      for (std::size_t k = begin_; k < end_; ++k) {
        const std::size_t number = numberOf(k);
        if (number < count_) {
          f(islands_[number], rows_[k - begin_], colouring.rows()[k]);
        }
      }
    };
    forRows([](Island& island, const Opened& row, const ContactColoring::Row&) {
      island.largest = std::max<S>(island.largest, row.missing);
      ++island.rows;
    });
    forRows([&](Island& island, const Opened& row, const ContactColoring::Row& ends) {
      if (row.missing > S(0) && island.rows <= mostRows) {
        add(island, row, contacts[ends.contact], ends, bodies);
      }
    });
    for (Island& island : islands_) {
      if (!island.moves.empty()) {
        loss += leap(island, bodies, keepAngularMomentum && !island.leans, positionOf, tell);
      }
    }
    return loss;
  }

 private:
  /// A body between two others. Islands of more have slow moves that decay alike; to go on by all of them at
  /// once opened gaps, of ten times the overlaps in a row of 50, and let stacks part.
  static constexpr std::size_t mostRows = 2;
  static constexpr int every = 8;      ///< sweeps: by then most islands have ended
  static constexpr int fewest = 16;    ///< moves of a sweep that make a leap
  static constexpr int farthest = 4;   ///< times the largest overlap a body leaps
  static constexpr int mistaken = 64;  ///< times it: moves do not hang together yet, or someone slips out

  struct Opened {
    S missing = S(0);  ///< [m] before
    S kept = S(0);     ///< [m] overlap
  };

  struct Island {
    S largest = S(0);                           ///< [m] missing
    std::map<std::uint32_t, Vector3<S>> moves;  ///< by slot, of the last sweep, over `largest`
    S work = S(0);                              ///< sum P_k g_k, over its square
    std::size_t rows = 0;
    bool leans = false;   ///< on a plane
    bool isHeld = false;  ///< by a fixed sphere
    std::uint32_t hub = 0;

    void reset() {
      moves.clear();
      largest = work = S(0);
      rows = 0;
      leans = isHeld = false;
    }
  };

  static void add(Island& island, const Opened& opened, const Contact<S>& contact,
                  const ContactColoring::Row& ends, const std::vector<Body>& bodies) {
    const Body& b1 = bodies[ends.slot1];
    const Body& b2 = bodies[ends.slot2];
    const bool wall = contact.second == staticPartner;
    const Vector3<S> d = b2.d - b1.d;
    Vector3<S> n = contact.normal;
    S missing = -contact.gap - opened.kept;
    if (wall) {
      missing -= n.dot(d);
    } else {
      const S before = contact.arm1 + contact.arm2;
      const Vector3<S> r = before * n + d;
      const S distance = safeNorm(r);
      missing += before - distance;
      n = distance > S(0) ? Vector3<S>(r / distance) : n;
    }
    const MassShares<S> shares = massShares<S>(b1.mass, b1.mass > S(0), b2.mass, b2.mass > S(0));
    const S size = opened.missing / island.largest;
    island.work += shares.effective * size * (missing / island.largest);
    const auto move = [&](std::uint32_t slot, const S& mass, const S& way) {
      if (mass > S(0)) {
        island.moves.try_emplace(slot, Vector3<S>::Zero()).first->second += way * n;
      } else if (wall) {
        island.leans = true;
      } else {
        island.isHeld = true;
        island.hub = slot;
      }
    };
    move(ends.slot1, b1.mass, S(-shares.first * size));
    move(ends.slot2, b2.mass, S(shares.second * size));
  }

  template <class PositionOf, class Tell>
  static S leap(Island& island, std::vector<Body>& bodies, bool turns, PositionOf&& positionOf, Tell&& tell) {
    S size = S(0);
    S most = S(0);
    S longest = S(0);
    for (const auto& [slot, move] : island.moves) {
      const S way = safeNorm(move);
      const S borne = bodies[slot].mass * way;
      size += borne * way;
      longest = std::max<S>(longest, way);
      if (!island.isHeld && !(borne < most)) {
        most = borne;
        island.hub = slot;
      }
    }
    if (!(size > S(0))) {
      return S(0);
    }
    const S all = island.work / size;
    const S times = std::min<S>(all, S(farthest) / longest);
    if (!(times > S(fewest)) || all * longest > S(mistaken)) {
      return S(0);
    }
    Body hub = bodies[island.hub];
    S loss = S(0);
    for (const auto& [slot, move] : island.moves) {
      Body& body = bodies[slot];
      Vector3<S> way = times * island.largest * move;
      if (turns) {
        const Vector3<S> r = (positionOf(slot) - positionOf(island.hub)) + (body.d - hub.d);
        const S distance = safeNorm(r);
        const Vector3<S> n = distance > S(0) ? Vector3<S>(r / distance) : Vector3<S>::Zero();
        const S apart = n.dot(way);
        if (slot == island.hub || !(apart > S(0))) {
          continue;
        }
        way = apart * n;
        const MassShares<S> shares = massShares<S>(body.mass, true, hub.mass, hub.mass > S(0));
        const Vector3<S> v_rel = body.v - hub.v;
        const Vector3<S> v_t = v_rel - n.dot(v_rel) * n;
        const S missing = apart / shares.first;
        const S lost = missing / (distance + missing);  // v_t becomes (1 - lost) v_t
        loss += shares.effective * v_t.squaredNorm() * lost * (S(2) - lost) / S(2);
        body.v -= shares.first * lost * v_t;
        hub.v += shares.second * lost * v_t;
        hub.d -= shares.second * missing * n;
      }
      body.d += way;
      tell(slot, S(safeNorm(way)));
    }
    if (turns && hub.mass > S(0)) {
      tell(island.hub, S(safeNorm(Vector3<S>(hub.d - bodies[island.hub].d))));
      bodies[island.hub] = hub;
    }
    return loss;
  }

  std::size_t begin_;
  std::size_t end_;
  std::size_t count_;    ///< of islands
  bool follow_ = false;  ///< leaps may, on this sweep
  std::vector<Island> islands_;
  std::vector<Opened> rows_;  ///< in this sweep
};

}  // namespace gravel::detail
