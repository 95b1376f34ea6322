#pragma once

/// \file
/// Removes overlap by moving positions: no energy of motion is made.

#include <gravel/contact/coloured_rows.hpp>
#include <gravel/contact/contact_facts.hpp>
#include <gravel/contact/overlap_lanes.hpp>
#include <gravel/contact/row_watch.hpp>
#include <gravel/core/check.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>

#include <numeric>

namespace gravel {

/// How overlap is removed. A `Space` takes a factor of its own, 0.4 by default, and sweepsOfLooks().
template <Real Scalar>
struct CorrectionSettings {
  Scalar factor = Scalar(0.8);  ///< [1], 0 … 1: part of each overlap to remove
  Scalar slop = Scalar(0);      ///< [m] >= 0: overlap that stays
  /// [1] > 0: largest part of the smaller of the two radii by which one contact is opened in a call, so that
  /// deep overlaps come apart over several steps.
  Scalar cap = Scalar(0.5);
  Scalar tolerance =
      Scalar(1e-3);  ///< [1] > 0: sweeps end when the largest move is this times the largest overlap
  /// [1] >= 0: overlaps that are right to this times the smallest radius of a contact are right; nothing is
  /// moved while all are, and where some are not, those below a quarter of it stay unless others are pressed
  /// into them.
  Scalar precision = Scalar(1e-4);
  int maxIterations = 20;  ///< >= 1
  /// A pair that is moved apart keeps its angular momentum: it turns the slower. Off: velocities stay.
  bool keepAngularMomentum = true;
};

/// \throws std::invalid_argument naming the setting, its value and what is allowed
template <Real S>
void validate(const CorrectionSettings<S>& settings) {
  detail::require("correction factor", settings.factor, detail::Range<S>{S(0), S(1), "0 to 1"});
  detail::require("correction slop", settings.slop, detail::nonNegative<S>());
  detail::require("correction cap", settings.cap, detail::positive<S>());
  detail::require("correction tolerance", settings.tolerance, detail::positive<S>());
  detail::require("correction precision", settings.precision, detail::nonNegative<S>());
  if (settings.maxIterations < 1) {
    detail::refuse("correction maxIterations", std::to_string(settings.maxIterations), ">= 1");
  }
}

/// A body that was moved, and by how much [m].
template <Real Scalar>
struct Displacement {
  std::uint32_t body;
  Vector3<Scalar> shift;
};

template <Real Scalar>
struct CorrectionReport {
  int iterations = 0;
  Scalar largestOverlap = Scalar(0);  ///< [m] before
  Scalar residual = Scalar(0);        ///< [m] largest move of the last sweep
  Scalar loss = Scalar(0);            ///< [J] >= 0, of energy of motion
};

/// Nonlinear projected Gauss-Seidel over the colours of the contacts: in turn each contact that is still
/// closer than it should be is opened along its present normal, by inverse mass, so that the common centre of
/// mass of movable bodies stays to rounding. Distances are recomputed from the moved positions; only relative
/// displacements enter, so that a place far from the origin costs no digits. A contact is passed over while
/// its bodies have moved by less than half of what ends the sweeps since it was opened, or at all where its
/// overlap is hardly any: so one ball wedged into a heap costs what its surroundings cost.
///
/// Two spheres that are moved apart from r to r + d would gain the angular momentum m* d x v of their
/// relative velocity v. As on an orbit, the part of v across r becomes v_t r/(r + d) instead: momentum and
/// angular momentum stay to rounding, and energy of motion can only fall. A fixed sphere is the limit of a
/// heavy one: the angular momentum about its centre stays; and a plane that of a large one, with v_t
/// unchanged. A rejected way: to give the difference to the spins, which would turn smooth spheres.
template <Real S>
class PositionalCorrection {
 public:
  /// Moves the bodies so that each overlap is (1 - factor) of what it was, down to the slop, unless the cap
  /// holds it back.
  /// \param colouring of these contacts \param facts of them, overlaps as they are now
  /// \throws std::invalid_argument on a setting out of range; then nothing is moved
  template <ContactBodies B>
  CorrectionReport<S> apply(std::span<const Contact<S>> contacts, const ContactColoring& colouring, B& bodies,
                            const CorrectionSettings<S>& settings, const ContactFacts<S>& facts) {
    validate(settings);
    detail::clearSpare(moved_);
    CorrectionReport<S> report;
    report.largestOverlap = facts.overlap;
    const S right = contacts.empty() ? S(0) : S(settings.precision * facts.radius);
    if (!(facts.overlap > right)) {
      return report;
    }
    takeUp(colouring, bodies);
    const S enough = std::max<S>(settings.tolerance * facts.overlap, right);
    watch_.begin(shifts_.size(), contacts.size(), S(enough / S(2)));
    detail::resizeAnew(deep_, contacts.size());
    parallelFor(contacts.size(), chunk,
                [&](std::size_t c) { deep_[c] = -contacts[c].gap > right / S(4) ? 1 : 0; });
    detail::forAllParts(colouring, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        watch_.enterFirst(k, deep_[colouring.rows()[k].contact] == 0);
      }
    });
    S before = Eigen::NumTraits<S>::highest();  // largest move of the last sweep that was looked at
    bool falls = true;
    do {
      const auto open = [&](std::size_t begin, std::size_t end, Opened& sum) {
        const auto stale = [&](std::size_t k) {
          const ContactColoring::Row& place = colouring.rows()[k];
          return watch_.isStale(k, place.slot1, place.slot2);
        };
        detail::forGroupsOf<S>(colouring, begin, end, stale, [&](const Group& group) {
          openAll(contacts, colouring, group, settings, sum);
        });
      };
      // Lone contacts are right after one sweep.
      Opened opened = detail::sumOverParts(0, colouring.loneCount(), Opened{}, open);
      opened += detail::sumOverColourParts(colouring, Opened{}, open);
      report.residual = opened.largest;
      report.loss += opened.loss;
      ++report.iterations;
      if (report.iterations % patience == 0) {
        falls = report.residual < before;
        before = report.residual;
      }
    } while (report.residual > enough && falls && report.iterations < settings.maxIterations);
    move(colouring, bodies);
    detail::giveBack(shifts_);
    detail::giveBack(deep_);
    watch_.end();
    return report;
  }

  /// Who was moved by the last call, in the order of ids.
  const std::vector<Displacement<S>>& displacements() const { return moved_; }

 private:
  using Group = detail::RowGroup<S>;
  using Body = detail::ShiftedBody<S>;
  using Bodies = detail::ShiftedLanes<S>;
  static constexpr std::size_t chunk = 512;
  static constexpr int patience = 20;  ///< sweeps; where moves are no less after them, there is no room

  /// What a sweep did.
  struct Opened {
    S largest = S(0);
    S loss = S(0);
    Opened& operator+=(const Opened& other) {
      largest = std::max<S>(largest, other.largest);
      loss += other.loss;
      return *this;
    }
  };

  template <class B>
  void takeUp(const ContactColoring& colouring, const B& bodies) {
    const std::size_t n = colouring.bodies().size();
    detail::resizeAnew(shifts_, n + 1);
    parallelFor(n, chunk, [&](std::size_t slot) {
      const bool movable = colouring.movable(static_cast<std::uint32_t>(slot));
      const std::uint32_t i = colouring.bodies()[slot];
      shifts_[slot] = {Vector3<S>::Zero(), movable ? S(bodies.masses()[i]) : S(0),
                       detail::velocityOf(bodies, i), bodies.radii()[i]};
    });
    shifts_[n] = {Vector3<S>::Zero(), S(0), Vector3<S>::Zero(), S(0)};
  }

  /// Of each part of the slots first how many moved, and so where they stand in the list.
  template <class B>
  void move(const ContactColoring& colouring, B& bodies) {
    auto&& positions = bodies.positions();
    auto&& velocities = bodies.velocities();
    const std::size_t n = colouring.bodies().size();
    const auto hasMoved = [&](std::size_t slot) { return shifts_[slot].d != Vector3<S>::Zero(); };
    ends_.assign(n / chunk + 1, 0);
    parallelForChunks<Share::Alike>(n, chunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t slot = begin; slot < end; ++slot) {
        ends_[begin / chunk] += hasMoved(slot) ? 1U : 0U;
      }
    });
    std::partial_sum(ends_.begin(), ends_.end(), ends_.begin());
    detail::resizeAnew(moved_, ends_.back());
    parallelForChunks<Share::Alike>(n, chunk, [&](std::size_t begin, std::size_t end) {
      std::size_t place = begin == 0 ? 0 : ends_[begin / chunk - 1];
      for (std::size_t slot = begin; slot < end; ++slot) {
        if (hasMoved(slot)) {
          const std::uint32_t i = colouring.bodies()[slot];
          positions[i] += shifts_[slot].d;
          moved_[place++] = {i, shifts_[slot].d};
          if (shifts_[slot].v != velocities[i]) {
            velocities[i] = shifts_[slot].v;
          }
        }
      }
    });
  }

  /// Opens the contacts of these rows.
  [[gnu::flatten]] void openAll(std::span<const Contact<S>> contacts, const ContactColoring& colouring,
                                const Group& group, const CorrectionSettings<S>& settings, Opened& sum) {
    using Pack = detail::Packed<S>;
    const Pack zero = Pack::zero();
    const auto contact = detail::OverlapLanes<S>::load(contacts, colouring.rows(), group);
    Bodies b1 = Bodies::load(shifts_, group.slot1);
    Bodies b2 = Bodies::load(shifts_, group.slot2);
    const Pack smaller = choose((b1.radius > zero) & (b2.radius > zero), smallerOf(b1.radius, b2.radius),
                                largerOf(b1.radius, b2.radius));
    const Pack overlap = -contact.gap;
    const Pack kept = largerOf(
        overlap - Pack::all(settings.cap) * smaller,
        largerOf(Pack::all(S(1) - settings.factor) * overlap, smallerOf(Pack::all(settings.slop), overlap)));
    const detail::OpenedLanes<S> opened = openTo(contact, kept, b1, b2, settings.keepAngularMomentum);
    b1.store(shifts_, group.slot1, settings.keepAngularMomentum);
    b2.store(shifts_, group.slot2, settings.keepAngularMomentum);
    for (std::size_t lane = 0; lane < group.count; ++lane) {
      if (opened.way1[lane] > S(0)) {
        watch_.move(group.slot1[lane], opened.way1[lane]);
      }
      if (opened.way2[lane] > S(0)) {
        watch_.move(group.slot2[lane], opened.way2[lane]);
      }
      watch_.enter(group.row[lane], group.slot1[lane], group.slot2[lane]);
    }
    sum += {opened.missing.largest(), opened.loss.sum()};
  }

  std::vector<Body> shifts_;  ///< by slot; the last one is the boundary
  detail::RowWatch<S> watch_;
  std::vector<std::uint8_t> deep_;  ///< by contact: more than hardly any overlap
  std::vector<std::size_t> ends_;   ///< by part of the slots, in the list of those moved
  std::vector<Displacement<S>> moved_;
};

}  // namespace gravel
