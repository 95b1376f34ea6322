#pragma once

/// \file
/// What contacts do to the energy, to rounding, and the guard that they never add any.
///
/// From the impulses J and the velocities of contact u before and after them,
///   dT = sum_bodies m (v^+ - v^-).(v^+ + v^-)/2 + the same of spin = sum_contacts J.(u^- + u^+)/2,
/// since what a body got is the sum over its contacts and J.u collects both ends. Exact for any number of
/// simultaneous contacts. Where the second side drifts (a moving wall, the image in a sheared domain), u
/// includes the drift, and -J.drift is the work done by it.

#include <gravel/contact/contact_problem.hpp>
#include <gravel/core/sizes.hpp>

#include <algorithm>
#include <array>

namespace gravel {

/// Books the energy of a solved problem. Newton's law of restitution makes energy in some multiple blows with
/// friction (Kane's paradox) and a residual may do so in any; an island of contacts that gained gets all its
/// impulses multiplied by the beta < 1 at which it gains nothing. That keeps momentum, angular momentum and
/// Coulomb's cone.
template <Real S>
class ContactEnergy {
 public:
  /// Guards the energy of `problem`, fills in the losses of the report, and completes the list of its
  /// impulses, in SI units. O(contacts). \param others the rows are not those of the last call
  void book(ContactProblem<S>& problem, const ContactColoring& colouring, const ContactView<S>& contacts,
            bool others, ContactReport<S>& report) {
    detail::resizeAnew(terms_, problem.rows.size());
    known_ = known_ && !others;
    Sums sums = takeDown(problem, colouring, contacts);
    if (sums[3] > S(0) && guard(problem, colouring, contacts)) {
      sums = takeDown(problem, colouring, contacts);
    }
    if (problem.isScaled()) {
      scaleOut(problem);
    }
    detail::giveBack(terms_);
    detail::giveBack(gains_);
    detail::giveBack(islands_);
    report.restitutionLoss = problem.energyOut(sums[0]);
    report.frictionLoss = problem.energyOut(sums[1]);
    report.driftWork = problem.energyOut(sums[2]);
  }

 private:
  using Body = detail::SolverBody<S>;
  using Pack = detail::Packed<S>;
  using Group = detail::RowGroup<S>;
  using Lanes = detail::RowLanes<S>;
  using BodyLanes = detail::BodyLanes<S>;
  /// Losses along the normal and across it, work of drift, sum of the contacts' terms that are gains.
  using Sums = Eigen::Array<S, 4, 1>;

  /// Of an island.
  struct Gain {
    S sum = S(0);   ///< of energy
    S size = S(0);  ///< of the terms that add up to it
    bool isReal() const { return sum > S(8) * detail::roundoff<S>() * size; }  // no rounding
  };
  struct Run {
    std::uint32_t island;
    Gain gain;
  };
  struct Island {
    S before = S(0);  ///< sum of J.u^-, of those that gain
    S beta = S(1);
  };

  /// J_n v_n, and J_t.v_t with what turns, at the velocities of b1 and b2.
  [[gnu::always_inline]] static inline std::array<Pack, 2> power(const ContactProblem<S>& problem,
                                                                 const Group& group, const Lanes& row,
                                                                 const BodyLanes& b1, const BodyLanes& b2,
                                                                 const detail::PackedVector<S>& drift) {
    const detail::PackedVector<S> v_rel = b2.v - b1.v + drift;
    const Pack v_n = row.n.dot(v_rel);
    Pack across = row.jt.dot(slipVelocity(row, v_rel, v_n, b1, b2));
    if (!problem.turning.empty()) {
      across = across + row.l.dot(detail::TurningLanes<S>::load(problem.turning, group).rho(b1, b2));
    }
    return {row.jn * v_n, across};
  }

  /// Bodies with the means of their velocities before and after.
  [[gnu::always_inline]] static inline BodyLanes means(const ContactProblem<S>& problem,
                                                       const typename Group::Index& slots) {
    const BodyLanes before = BodyLanes::load(problem.initial, slots);
    BodyLanes mean = BodyLanes::load(problem.bodies, slots);
    const Pack half = Pack::all(S(1) / S(2));
    mean.v = half * (before.v + mean.v);
    mean.s = half * (before.s + mean.s);
    return mean;
  }

  static detail::PackedVector<S> driftOf(const ContactProblem<S>& problem, const ContactColoring& colouring,
                                         const ContactView<S>& contacts, const Group& group) {
    if (!problem.drifting) {
      return detail::PackedVector<S>::zero();
    }
    const auto part = [&](Eigen::Index c) {
      return Pack::of([&](std::size_t lane) {
        return S(problem.speedIn(contacts.drift(contacts[colouring.rows()[group.row[lane]].contact]))[c]);
      });
    };
    return {part(0), part(1), part(2)};
  }

  /// J.b h/2 for what the frame adds to slips, b a second: what it presses together is to part by -b h/2, by
  /// a blow that may add energy, which the way and the next solve take out again. So whether contacts gain is
  /// asked of u + b h/2, by which each is right at 0. Without, the guard took such blows away.
  [[gnu::always_inline]] static inline Pack takenBack(const ContactProblem<S>& problem,
                                                      const ContactColoring& colouring, const Group& group,
                                                      const Lanes& row) {
    if (!problem.bends) {
      return Pack::zero();
    }
    const detail::PackedVector<S> bend = problem.bendOf(colouring, group);
    return row.jn * row.n.dot(bend) +
           row.jt.dot(problem.slipByBend(row, bend, BodyLanes::load(problem.initial, group.slot1),
                                         BodyLanes::load(problem.initial, group.slot2)));
  }

  Sums takeDown(ContactProblem<S>& problem, const ContactColoring& colouring,
                const ContactView<S>& contacts) {
    return detail::sumOverAllParts(
        colouring, Sums(Sums::Zero()), [&](std::size_t begin, std::size_t end, Sums& sums) {
          forGroups(problem, colouring, begin, end,
                    [&](const Group& group) { sums += takeDown(problem, colouring, contacts, group); });
        });
  }

  template <class F>
  static void forGroups(const ContactProblem<S>& problem, const ContactColoring& colouring, std::size_t begin,
                        std::size_t end, F&& f) {
    for (std::size_t k = begin; k < end; k += Group::width) {
      const std::size_t from = k + ContactProblem<S>::lookAhead;
      for (std::size_t later = from; later < std::min(from + Group::width, colouring.rows().size());
           ++later) {
        for (const std::uint32_t slot : {colouring.rows()[later].slot1, colouring.rows()[later].slot2}) {
          detail::prefetch(problem.bodies[slot]);
          detail::prefetch(problem.initial[slot]);
        }
      }
      f(Group::from(colouring.rows(), k, end, colouring.staticSlot()));
    }
  }

  [[gnu::flatten]] Sums takeDown(ContactProblem<S>& problem, const ContactColoring& colouring,
                                 const ContactView<S>& contacts, const Group& group) {
    const Pack zero = Pack::zero();
    Lanes row = problem.load(group, !problem.passes);
    const BodyLanes b1 = means(problem, group.slot1);
    const BodyLanes b2 = means(problem, group.slot2);
    const auto pushes = (row.jn > zero) & (normalMobility(b1, b2) > zero);
    row.jn = choose(pushes, row.jn, zero);
    row.jt = choose(pushes, row.jt, detail::PackedVector<S>::zero());
    row.l = choose(pushes, row.l, detail::PackedVector<S>::zero());
    if (problem.passes) {
      problem.storeImpulses(group, row);
    }
    for (std::size_t lane = 0; lane < group.count; ++lane) {
      const std::uint32_t k = group.row[lane];
      problem.impulses().setImpact(k, problem.marks[k].impact);
    }
    const detail::PackedVector<S> drift = driftOf(problem, colouring, contacts, group);
    const auto [normal, across] = power(problem, group, row, b1, b2, drift);
    const Pack term = normal + across + takenBack(problem, colouring, group, row);
    for (std::size_t lane = 0; lane < group.count; ++lane) {
      terms_[group.row[lane]] = term[lane];
    }
    const Pack work = problem.drifting ? row.wholeImpulse().dot(drift) : zero;
    return Sums(-normal.sum(), -across.sum(), -work.sum(), largerOf(term, zero).sum());
  }

  /// Of problems with masses or speeds far from 1.
  static void scaleOut(ContactProblem<S>& problem) {
    for (std::size_t k = 0; k < problem.rows.size(); ++k) {
      ContactImpulse<S> j = problem.impulses().get(k);
      j.normal = problem.impulseOut(j.normal);
      j.tangential = problem.impulseOut(j.tangential);
      j.turning = problem.impulseOut(j.turning);
      problem.impulses().set(k, j);
    }
  }

  /// Islands: movable bodies joined by contacts. dT of an island is beta a + beta^2 b under a common factor
  /// beta, a = sum J.u^- and b = sum J.(u^+ - u^-)/2 >= 0: zero at beta = -a/b.
  bool guard(ContactProblem<S>& problem, const ContactColoring& colouring, const ContactView<S>& contacts) {
    if (!known_) {
      nameIslands(colouring);
      known_ = true;
    }
    findGains(colouring);
    const bool any =
        std::any_of(gains_.begin(), gains_.end(), [](const Gain& gain) { return gain.isReal(); });
    if (any) {
      problem.watch.setHolds(false);  // of what comes now
      islands_.assign(gains_.size(), Island{});
      forGroups(problem, colouring, 0, problem.rows.size(), [&](const Group& group) {
        const Lanes row = problem.load(group, true);
        const auto [normal, across] = power(
            problem, group, row, BodyLanes::load(problem.initial, group.slot1),
            BodyLanes::load(problem.initial, group.slot2), driftOf(problem, colouring, contacts, group));
        const Pack term = normal + across + takenBack(problem, colouring, group, row);
        for (std::size_t lane = 0; lane < group.count; ++lane) {
          if (row.jn[lane] > S(0)) {
            islands_[islandOfRow_[group.row[lane]]].before += term[lane];
          }
        }
      });
      for (std::size_t slot = 0; slot < islands_.size(); ++slot) {
        Island& island = islands_[slot];
        if (gains_[slot].isReal()) {
          const S a = island.before;
          const S b = gains_[slot].sum - a;
          island.beta = a < S(0) && b > S(0) ? std::min<S>(S(1), S(-a / b)) : S(0);
        }
      }
      shrink(problem, colouring);
    }
    return any;
  }

  /// Small islands each in the order of their rows, so that others have no say. Most other rows that follow
  /// each other are of one island: each run of them is summed by itself.
  void findGains(const ContactColoring& colouring) {
    gains_.assign(colouring.islands().size(), Gain{});
    const auto take = [&](Gain& gain, std::size_t k) {
      gain.sum += terms_[k];
      gain.size += detail::sizeOf(terms_[k]);
    };
    parallelForTasks<Share::Alike>(colouring.bundles(), [&](std::size_t bundle) {
      for (const ContactColoring::Part& rows : colouring.coloursOf(bundle)) {
        for (std::size_t k = rows.begin; k < rows.end; ++k) {
          take(gains_[islandOfRow_[k]], k);
        }
      }
    });
    const std::size_t piece = std::max<std::size_t>(16, colouring.partsOfTask());
    const std::size_t pieces = (colouring.parts().size() + piece - 1) / piece;
    runs_.resize(std::max(runs_.size(), pieces));
    parallelForChunks<Share::Alike>(colouring.parts().size(), piece, [&](std::size_t begin, std::size_t end) {
      std::vector<Run>& runs = runs_[begin / piece];
      runs.clear();
      for (const ContactColoring::Part& part : colouring.parts().subspan(begin, end - begin)) {
        const bool isTaken = part.begin >= colouring.loneCount() && !colouring.isOfLarge(part.begin);
        for (std::size_t k = part.begin; k < part.end && !isTaken; ++k) {
          if (runs.empty() || runs.back().island != islandOfRow_[k]) {
            runs.push_back({islandOfRow_[k], {}});
          }
          take(runs.back().gain, k);
        }
      }
    });
    for (std::size_t p = 0; p < pieces; ++p) {
      for (const Run& run : runs_[p]) {
        gains_[run.island].sum += run.gain.sum;
        gains_[run.island].size += run.gain.size;
      }
    }
  }

  void nameIslands(const ContactColoring& colouring) {
    detail::resizeAnew(islandOfRow_, colouring.rows().size());
    detail::forAllParts(colouring, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        islandOfRow_[k] = colouring.islands().of(colouring.ofIsland(colouring.rows()[k]));
      }
    });
  }

  void shrink(ContactProblem<S>& problem, const ContactColoring& colouring) {
    for (std::size_t k = 0; k < problem.rows.size(); ++k) {
      const S beta = islands_[islandOfRow_[k]].beta;
      if (beta < S(1)) {
        problem.impulses().scale(k, beta);
      }
    }
    for (std::uint32_t slot = 0; slot < colouring.bodies().size(); ++slot) {
      const S beta = islands_[colouring.islands().of(slot)].beta;
      if (beta < S(1) && colouring.movable(slot)) {
        Body& b = problem.bodies[slot];
        const auto& b0 = problem.initial[slot];
        b.v = b0.v + beta * Vector3<S>(b.v - b0.v);
        b.s = b0.s + beta * Vector3<S>(b.s - b0.s);
      }
    }
  }

  std::vector<S> terms_;  ///< J.(u^- + u^+)/2 by row
  bool known_ = false;    ///< islandOfRow_ is of these rows
  std::vector<std::uint32_t> islandOfRow_;
  std::vector<std::vector<Run>> runs_;  ///< of rows
  std::vector<Gain> gains_;             ///< by the slot that stands for the island
  std::vector<Island> islands_;         ///< by the slot that stands for it
};

}  // namespace gravel
