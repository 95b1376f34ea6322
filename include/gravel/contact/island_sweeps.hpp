#pragma once

/// \file
/// Sequential impulses of small islands, each to an end of its own.

#include <gravel/contact/row_impulses.hpp>

#include <vector>

namespace gravel::detail {

/// What sweeps over several islands came to.
template <Real S>
struct IslandReport {
  int iterations = 0;     ///< of the one that took most
  std::size_t looks = 0;  ///< of all
  S residual = S(0);      ///< largest
  IslandReport& operator+=(const IslandReport& other) {
    iterations = std::max(iterations, other.iterations);
    looks += other.looks;
    residual = std::max<S>(residual, other.residual);
    return *this;
  }
};

/// Sweeps over a bundle of small islands at once, whose contacts fill lanes together. But how many there are,
/// and how one goes on from the last, is found for each island from its own contacts: it comes to the same
/// bits whatever lies beside it. Were all contacts asked together, others that still move would say when a
/// structure at rest is right, and how far sweeps go on in it.
template <Real S>
class IslandSweeps : private RowImpulses<S> {
  using Base = RowImpulses<S>;
  using typename Base::Group;
  using typename Base::Pack;
  using typename Base::Progress;
  using typename Base::Way;

 public:
  /// \param places  room for a number by slot, which bundles share: no two have a movable body in common
  IslandSweeps(ContactProblem<S>& problem, const ContactColoring& colouring, std::size_t bundle,
               const ContactSettings<S>& settings, std::span<std::uint32_t> places)
      : problem_(problem),
        colouring_(colouring),
        settings_(settings),
        colours_(colouring.coloursOf(bundle)),
        places_(places) {
    takeUp(bundle);
    if (problem.again) {
      lookAgain();
    }
    begin();
  }

  IslandReport<S> solve() {
    const bool accelerate =
        settings_.accelerate && (settings_.islandTolerance > S(0) || settings_.maxIterations > 2);
    for (bool first = true; left_ > 0; first = false) {
      if (first || !accelerate) {
        sweep<Way::Bare>();
      } else {
        sweep<Way::Coasting>();
      }
      letSlide();
      for (Island& island : islands_) {
        if (!island.ended) {
          report_.looks += island.rows;
          goOn(island, first || !accelerate);
        }
      }
      if (accelerate && left_ > 0) {
        leap();
        if (first) {
          findSlots();
          momentum_.begin(problem_, begin_, end_, slots_);
        } else {
          momentum_.coast(problem_, slots_, [&](std::size_t i) { return shareOf(islandOfSlot_[i]); });
        }
      }
    }
    return report_;
  }

 private:
  struct Island {
    std::uint32_t rows = 0;
    S approach = S(0);  ///< the largest change of a velocity that is asked for
    S held = S(0);      ///< what friction alone holds counts for that
    S speed = S(0);     ///< the largest
    bool remembers = false;
    S enough = S(0);  ///< a change that is right
    SweepCourse<S> course{S(0), 1};
    Progress now;
    bool ended = false;
    bool asks = false;  ///< who slides
    bool more = false;  ///< some began to
  };

  Island& islandOf(std::size_t k) { return islands_[colouring_.islandOf(k) - first_]; }
  S shareOf(std::uint32_t island) const {
    return islands_[island].ended ? S(0) : islands_[island].course.share();
  }

  /// What islands ask for. Nothing is done to one that neither approaches nor is held.
  void takeUp(std::size_t bundle) {
    first_ = colouring_.islands().firstOf(bundle);
    islands_.resize(colouring_.islands().firstOf(bundle + 1) - first_);
    begin_ = colours_.front().begin;
    end_ = colours_.back().end;
    for (std::size_t k = begin_; k < end_; ++k) {
      Island& island = islandOf(k);
      ++island.rows;
      island.approach = std::max<S>(island.approach, problem_.approachAt(k));
      island.remembers = island.remembers || problem_.remembers(k);
    }
    for (std::size_t k = begin_; k < end_; ++k) {
      Island& island = islandOf(k);
      if (problem_.mayHold(island.approach)) {
        island.held = std::max<S>(island.held, problem_.heldAt(k, colouring_));
      }
    }
    for (Island& island : islands_) {
      island.approach = std::max<S>(island.approach, island.held);
      island.ended = !(island.approach > S(0));
      setLimits(island);
      left_ += island.ended ? 0U : 1U;
    }
    for (std::size_t k = begin_; k < end_ && left_ < islands_.size(); ++k) {
      if (islandOf(k).ended) {
        problem_.release(colouring_, k, k + 1);
      }
    }
  }

  void setLimits(Island& island) const {
    ContactSettings<S> own = settings_;
    if (own.islandTolerance > S(0)) {
      own.tolerance = own.islandTolerance;
      limitSweeps(own, 0, island.rows, own.remembers && island.remembers);
    }
    island.enough = std::max<S>(own.tolerance, S(8) * roundoff<S>()) * island.approach;
    island.course = SweepCourse<S>(island.enough, own.maxIterations, settings_.accelerate);
  }

  /// What was solved before may be right as it is. What is only just so would never become better.
  void lookAgain() {
    for (std::size_t k = begin_; k < end_; ++k) {
      S& wrong_sq = islandOf(k).now.change_sq;
      wrong_sq = std::max<S>(wrong_sq, problem_.wrongAt(k));
    }
    for (Island& island : islands_) {
      const S right = island.enough / S(16);
      if (!island.ended && !(island.now.change_sq > right * right)) {
        keep(island);
      }
    }
  }

  void keep(Island& island) {
    using std::sqrt;
    report_ += {1, island.rows, S(sqrt(island.now.change_sq) / island.approach)};
    end(island);
  }

  /// Changes below the rounding of velocities are none.
  void begin() {
    for (std::size_t k = begin_; k < end_ && left_ > 0; ++k) {
      const ContactColoring::Row& ends = colouring_.rows()[k];
      S& speed = islandOf(k).speed;
      speed = std::max<S>(
          speed, std::max<S>(maxAbs(problem_.initial[ends.slot1].v), maxAbs(problem_.initial[ends.slot2].v)));
    }
    for (Island& island : islands_) {
      const S rounding = roundoff<S>() * island.speed;
      island.course.allow(rounding);
      if (problem_.again && !island.ended && !(island.now.change_sq > rounding * rounding)) {
        keep(island);
      }
    }
  }

  /// Movable bodies of those that are left.
  void findSlots() {
    for (std::size_t k = begin_; k < end_; ++k) {
      const ContactColoring::Row& ends = colouring_.rows()[k];
      for (const std::uint32_t slot : {ends.slot1, ends.slot2}) {
        const bool known = places_[slot] < slots_.size() && slots_[places_[slot]] == slot;
        if (!islandOf(k).ended && colouring_.movable(slot) && !known) {
          places_[slot] = static_cast<std::uint32_t>(slots_.size());
          slots_.push_back(slot);
          islandOfSlot_.push_back(colouring_.islandOf(k) - first_);
        }
      }
    }
  }

  template <class F>
  void forGroups(F&& f) {
    for (const ContactColoring::Part& colour : colours_) {
      forGroupsOf<S>(
          colouring_, colour.begin, colour.end, [&](std::size_t k) { return !islandOf(k).ended; }, f);
    }
  }

  void end(Island& island) {
    island.ended = true;
    --left_;
  }

  template <Way way>
  void sweep() {
    for (Island& island : islands_) {
      island.now = {};
    }
    forGroups([&](const Group& group) {
      const Pack share = Pack::of([&](std::size_t lane) { return islandOf(group.row[lane]).course.share(); });
      const auto [change_sq, size, along] =
          Base::template relax<way>(problem_, group, true, momentum_, share);
      for (std::size_t lane = 0; lane < group.count; ++lane) {
        islandOf(group.row[lane]).now += {change_sq[lane], size[lane], along[lane]};
      }
    });
    for (Island& island : islands_) {
      island.more = false;
      island.asks = !island.ended && island.course.take(island.now);
    }
  }

  /// Once for all islands.
  void letSlide() {
    if (problem_.grips && !problem_.atOnce &&
        std::any_of(islands_.begin(), islands_.end(), [](const Island& island) { return island.asks; })) {
      for (std::size_t k = begin_; k < end_; ++k) {
        Island& island = islandOf(k);
        if (island.asks && problem_.letSlide(k, colouring_, island.course.slides())) {
          island.more = true;
        }
      }
    }
  }

  void goOn(Island& island, bool first) {
    if (!island.course.goesOn(island.more)) {
      report_ += {island.course.sweeps(), 0, S(island.course.change() / island.approach)};
      end(island);
    } else if (first) {
      island.course.begin(island.now, island.more);
    } else {
      island.course.goOn(island.now, island.more);
    }
  }

  /// On along the last steps, within the limits of impulses; bodies as these make them.
  void leap() {
    const auto leaps = [](const Island& island) { return !island.ended && island.course.leap() > S(0); };
    if (std::none_of(islands_.begin(), islands_.end(), leaps)) {
      return;
    }
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      if (leaps(islands_[islandOfSlot_[i]])) {
        problem_.restart(slots_[i]);
      }
    }
    for (const ContactColoring::Part& colour : colours_) {
      const auto wanted = [&](std::size_t k) { return leaps(islandOf(k)); };
      forGroupsOf<S>(colouring_, colour.begin, colour.end, wanted, [&](const Group& group) {
        auto row = problem_.load(group, true);
        auto b1 = BodyLanes<S>::load(problem_.bodies, group.slot1);
        auto b2 = BodyLanes<S>::load(problem_.bodies, group.slot2);
        const auto step =
            Pack::of([&](std::size_t lane) { return islandOf(group.row[lane]).course.leap(); }) *
            momentum_.load(group);
        row.jn = largerOf(row.jn + step.n, Pack::zero());
        row.jt = row.jt + step.t;
        row.l = row.l + step.l;
        auto sliding = problem_.slidesOf(group, problem_.earlier);
        sliding.slipBefore = PackedVector<S>::zero();
        cutToCone(row, b1, b2, sliding);
        if (!problem_.turning.empty()) {
          row.l = TurningLanes<S>::load(problem_.turning, group).within(row, row.l);
        }
        pushAll(group, row, problem_.turning, b1, b2);
        b1.store(problem_.bodies, group.slot1, problem_.friction);
        b2.store(problem_.bodies, group.slot2, problem_.friction);
        problem_.storeImpulses(group, row);
      });
    }
  }

  ContactProblem<S>& problem_;
  const ContactColoring& colouring_;
  const ContactSettings<S>& settings_;
  std::span<const ContactColoring::Part> colours_;
  std::size_t begin_ = 0;  ///< rows of the bundle
  std::size_t end_ = 0;
  std::vector<Island> islands_;
  std::size_t left_ = 0;     ///< that have not ended
  std::uint32_t first_ = 0;  ///< number of the first island
  std::span<std::uint32_t> places_;
  std::vector<std::uint32_t> slots_;         ///< of movable bodies
  std::vector<std::uint32_t> islandOfSlot_;  ///< the same order
  SweepMomentum<S> momentum_;
  IslandReport<S> report_;
};

}  // namespace gravel::detail
