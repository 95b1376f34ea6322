#pragma once

/// \file
/// Removes overlap by moving positions: no energy of motion is made.

#include <gravel/contact/coloured_rows.hpp>
#include <gravel/contact/contact_facts.hpp>
#include <gravel/contact/contact_settings.hpp>
#include <gravel/contact/correction_settings.hpp>
#include <gravel/contact/overlap_lanes.hpp>
#include <gravel/contact/overlap_leaps.hpp>
#include <gravel/contact/row_watch.hpp>
#include <gravel/contact/stirred_blocks.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>

#include <numeric>
#include <utility>

namespace gravel {

/// Nonlinear projected Gauss-Seidel over the colours of the contacts: in turn each contact that is still
/// closer than it should be is opened along its present normal, by inverse mass, so that the common centre of
/// mass of movable bodies stays to rounding. Distances are recomputed from the moved positions; only relative
/// displacements enter, so that a place far from the origin costs no digits. A contact is passed over while
/// its bodies have moved by less than half of what ends the sweeps since it was opened, or at all where its
/// overlap is hardly any: so one ball wedged into a heap costs what its surroundings cost. Sweeps over a
/// small island end as its own overlaps say, and the others' together; a light body between two leaps.
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
    if (!(facts.overlap > right)) {  // as in a heap at rest
      detail::release(shifts_);
      detail::release(deep_);
      watch_ = {};
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
    stirred_.begin(colouring);
    const Opened ofIslands = orderedSum<Share::AsFree>(
        colouring.bundles(), 1, Opened{}, [&](std::size_t bundle, std::size_t /*next*/) {
          return openBundle(contacts, colouring, bundle, bodies, settings);
        });
    Course course{enough, settings.maxIterations};
    bool goesOn = true;
    while (goesOn) {
      const auto open = [&](std::size_t begin, std::size_t end, Opened& sum) {
        const auto stale = [&](std::size_t k) {
          const ContactColoring::Row& place = colouring.rows()[k];
          return watch_.isStale(k, place.slot1, place.slot2);
        };
        const auto fetch = [&](std::size_t k) __attribute__((always_inline)) {
          const ContactColoring::Row& place = colouring.rows()[k];
          detail::prefetch(contacts[place.contact]);
          detail::prefetch(shifts_[place.slot1]);
          detail::prefetch(shifts_[place.slot2]);
        };
        detail::forGroupsOf<S>(colouring, begin, end, stale, fetch, [&](const Group& group) {
          const Opening opening = openAll(contacts, colouring, group, settings);
          sum += {opening.missing.largest(), opening.loss.sum()};
        });
      };
      // Lone contacts are right after one sweep.
      Opened opened = detail::sumOverParts(0, colouring.loneCount(), Opened{}, open);
      opened += detail::sumOverLargeParts(colouring, Opened{}, open,
                                          [&](std::size_t block) { return stirred_.visit(block); });
      report.residual = std::max<S>(opened.largest, ofIslands.largest);
      report.loss += opened.loss;
      goesOn = course.goesOn(opened.largest);
    }
    report.loss += ofIslands.loss;
    report.iterations = std::max(course.sweeps, ofIslands.sweeps);
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
  using Pack = detail::Packed<S>;
  using Body = detail::ShiftedBody<S>;
  using Bodies = detail::ShiftedLanes<S>;
  static constexpr std::size_t chunk = 512;
  static constexpr int patience = 20;  ///< sweeps; where moves are no less after them, there is no room

  /// What a sweep did, or sweeps over islands; of `largest` the last one.
  struct Opened {
    S largest = S(0);
    S loss = S(0);
    int sweeps = 0;
    Opened& operator+=(const Opened& other) {
      largest = std::max<S>(largest, other.largest);
      loss += other.loss;
      sweeps = std::max(sweeps, other.sweeps);
      return *this;
    }
  };

  /// Sweeps until the largest move is right, or falls no more.
  struct Course {
    S enough = S(0);
    int most = 1;
    int sweeps = 0;
    S before = detail::highest<S>();  ///< largest move of the last sweep that was looked at

    bool goesOn(const S& largest) {
      ++sweeps;
      bool falls = true;
      if (sweeps % patience == 0) {
        falls = largest < before;
        before = largest;
      }
      return largest > enough && falls && sweeps < most;
    }
  };

  struct Island {
    std::uint32_t rows = 0;
    S overlap = S(0);
    S radius = detail::highest<S>();
    S right = S(0);
    Course course;
    Opened now;
    S before = S(0);  ///< largest move of the last sweep but one
    bool ended = false;
  };

  /// Opens the contacts of small islands.
  template <class B>
  Opened openBundle(std::span<const Contact<S>> contacts, const ContactColoring& colouring,
                    std::size_t bundle, const B& bodies, const CorrectionSettings<S>& settings) {
    const std::uint32_t first = colouring.islands().firstOf(bundle);
    std::vector<Island> islands(colouring.islands().firstOf(bundle + 1) - first);
    const auto islandOf = [&](std::size_t k) -> Island& { return islands[colouring.islandOf(k) - first]; };
    const auto colours = colouring.coloursOf(bundle);
    for (std::size_t k = colours.front().begin; k < colours.back().end; ++k) {
      const ContactColoring::Row& place = colouring.rows()[k];
      Island& island = islandOf(k);
      ++island.rows;
      island.overlap = std::max<S>(island.overlap, S(-contacts[place.contact].gap));
      island.radius = std::min<S>(
          island.radius, detail::smallerRadius<S>(shifts_[place.slot1].radius, shifts_[place.slot2].radius));
    }
    std::size_t left = 0;
    for (Island& island : islands) {
      island.right = settings.precision * island.radius;
      island.ended = !(island.overlap > island.right);
      left += island.ended ? 0U : 1U;
      island.course = {std::max<S>(settings.tolerance * island.overlap, island.right),
                       settings.islandLooks > 0 ? sweepsOfLooks(island.rows, settings.islandLooks)
                                                : settings.maxIterations};
    }
    for (std::size_t k = colours.front().begin; k < colours.back().end && left > 0; ++k) {
      watch_.enterFirst(k, !(-contacts[colouring.rows()[k].contact].gap > islandOf(k).right / S(4)));
    }
    Opened all;
    detail::OverlapLeaps<S> leaps(colours.front().begin, colours.back().end, islands.size());
    for (int sweep = 1; left > 0; ++sweep) {
      for (Island& island : islands) {
        island.before = std::exchange(island.now, {}).largest;
      }
      leaps.begin(sweep);
      for (const ContactColoring::Part& colour : colours) {
        const auto stale = [&](std::size_t k) {
          const ContactColoring::Row& place = colouring.rows()[k];
          const Island& island = islandOf(k);
          return !island.ended && watch_.isStale(k, place.slot1, place.slot2, S(island.course.enough / S(2)));
        };
        detail::forGroupsOf<S>(colouring, colour.begin, colour.end, stale, [&](const Group& group) {
          const auto [missing, kept, loss] = openAll(contacts, colouring, group, settings);
          leaps.take(group, missing, kept);
          for (std::size_t lane = 0; lane < group.count; ++lane) {
            islandOf(group.row[lane]).now += {missing[lane], loss[lane]};
          }
        });
      }
      for (Island& island : islands) {
        all.loss += island.now.loss;
        if (!island.ended && !island.course.goesOn(island.now.largest)) {
          all += {island.now.largest, S(0), island.course.sweeps};
          island.ended = true;
          --left;
        }
      }
      all.loss += leaps.leap(
          contacts, colouring, shifts_, settings.keepAngularMomentum,
          [&](std::size_t k) {
            const Island& island = islandOf(k);
            const bool isSlow = !island.ended && island.now.largest > S(0.9) * island.before;
            return isSlow ? std::size_t{colouring.islandOf(k) - first} : islands.size();
          },
          [&](std::size_t slot) -> Vector3<S> { return bodies.positions()[colouring.bodies()[slot]]; },
          [&](std::uint32_t slot, const S& way) { watch_.move(slot, way); });
    }
    return all;
  }

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
          const Vector3<S> v = velocities[i];
          moved_[place++] = {i, shifts_[slot].d, Vector3<S>(shifts_[slot].v - v)};
          if (shifts_[slot].v != velocities[i]) {
            velocities[i] = shifts_[slot].v;
          }
        }
      }
    });
  }

  /// By lane, what was missing and is kept [m], and what was lost [J].
  struct Opening {
    Pack missing, kept, loss;
  };

  /// Opens these rows.
  [[gnu::flatten, gnu::noinline]] Opening openAll(std::span<const Contact<S>> contacts,
                                                  const ContactColoring& colouring, const Group& group,
                                                  const CorrectionSettings<S>& settings) {
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
      const auto move = [&](std::uint32_t slot, const S& way) {
        if (way > S(0)) {
          watch_.move(slot, way);
          stirred_.stir(slot);
        }
      };
      move(group.slot1[lane], opened.way1[lane]);
      move(group.slot2[lane], opened.way2[lane]);
      watch_.enter(group.row[lane], group.slot1[lane], group.slot2[lane]);
    }
    return {opened.missing, kept, opened.loss};
  }

  std::vector<Body> shifts_;  ///< by slot; the last one is the boundary
  detail::RowWatch<S> watch_;
  detail::StirredBlocks stirred_;
  std::vector<std::uint8_t> deep_;  ///< by contact: more than hardly any overlap
  std::vector<std::size_t> ends_;   ///< by part of the slots, in the list of those moved
  std::vector<Displacement<S>> moved_;
};

}  // namespace gravel
