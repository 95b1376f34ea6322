#pragma once

/// \file
/// All contacts of a step in the form that solvers work on: compact copies of the bodies (eight Scalars each)
/// and one row a contact. Layouts and user's arrays end here.

#include <gravel/contact/coloured_rows.hpp>
#include <gravel/contact/impulse_list.hpp>
#include <gravel/contact/problem_bodies.hpp>
#include <gravel/contact/resting_gap.hpp>
#include <gravel/contact/row_before.hpp>
#include <gravel/contact/row_lanes.hpp>
#include <gravel/contact/turning_lanes.hpp>

#include <vector>

namespace gravel {

/// The problem of one step.
template <Real S>
class ContactProblem : public detail::ProblemBodies<S> {
  using Base = detail::ProblemBodies<S>;
  using Base::accelerationOf;
  using Base::chunk;
  using Base::gatherBodies;
  using Base::sameScales_;
  using Base::speedExponent_;

 public:
  using typename Base::Body;
  using Row = detail::SolverRow<S>;
  using Pack = detail::Packed<S>;
  using Group = detail::RowGroup<S>;
  using Lanes = detail::RowLanes<S>;
  using Turned = detail::TurningChanges<S>;
  using Base::again;
  using Base::bodies;
  using Base::friction;
  using Base::impulseIn;
  using Base::initial;
  using Base::restart;
  using Base::speedIn;
  using Base::watch;

  std::vector<Row> rows;                ///< in the colouring's order
  std::vector<detail::RowMark> marks;   ///< by row
  std::vector<Vector3<S>> slipTargets;  ///< slip after a blow that sticks, by row; empty if zero for all
  std::vector<detail::TurningRow<S>> turning;  ///< by row; empty if nothing resists rolling or spinning
  detail::RowsBefore<S> earlier;               ///< of rows that last; of all others zero
  bool drifting = false;                       ///< any contact whose second side drifts
  bool looksBack = false;                      ///< any row may last
  bool grips = false;                          ///< any contact with more friction at rest than in a slide
  bool atOnce = false;       ///< rows slide as soon as friction is cut: there is no time to ask
  bool active = false;       ///< any contact that approaches faster than it may, or is held by friction
  S largestApproach = S(0);  ///< largest change of a normal velocity that large islands ask for; heldAcross()
  S wrong_sq = S(0);  ///< if `again`, the largest of a velocity that a sweep over them would make, squared
  /// If `again`, rows at rest between bodies that begin as they did were passed over: isPassed().
  bool passes = false;
  std::size_t looks = 0;  ///< at rows, to find `wrong_sq`
  bool kept = false;      ///< said by who solves: the impulses of the last problem are those of this one
  bool bends = false;     ///< the way that follows does: targets are relative to what it changes by half

  /// Takes up bodies and contacts, and the first guess of the impulses with what it does to the bodies.
  /// \param dt [s] step that these contacts stand for, >= 0
  /// \param impulses of this problem, to be, by row; as many as there are contacts, of any value; may be
  ///        `last` itself
  /// \param last impulses of the last solve by row, zero for those that are new
  /// \param ratio of forces that last: the guess is `ratio` times `last`; 0 for none
  /// \param fresh contacts are others, or elsewhere, than at the last call
  /// \param goesOn the contacts of the last problem, where they were, and `last` is its solution: the guess
  ///        does to velocities what that did, `ratio` times, so that no contact needs to be asked; bodies
  ///        whose masses have changed are guarded against
  template <ContactBodies B>
  void gather(const ContactView<S>& contacts, const B& source, const ContactColoring& colouring, const S& dt,
              const ContactSettings<S>& settings, const ContactKinds& kinds, detail::ImpulseList<S>& impulses,
              const detail::ImpulseList<S>& last, const S& ratio, bool fresh, bool goesOn,
              const WayAhead<S>& way);

  /// Calls f(group) for rows [begin, end), which share no movable body; brings what later ones need nearer.
  template <class F>
  void forGroups(const ContactColoring& colouring, std::size_t begin, std::size_t end, F&& f) const {
    for (std::size_t k = begin; k < end; k += Group::width) {
      fetch(colouring, k + lookAhead);
      f(Group::from(colouring.rows(), k, end, colouring.staticSlot()));
    }
  }

  /// Brings what later rows need nearer: rows of a colour jump through bodies. (Inlined, or a compiler finds
  /// that it does nothing.)
  static constexpr std::size_t lookAhead = 8;
  [[gnu::always_inline]] inline void fetch(const ContactColoring& colouring, std::size_t from) const {
    const std::size_t end = std::min(from + Group::width, colouring.rows().size());
    for (std::size_t k = from; k < end; ++k) {
      for (const std::uint32_t slot : {colouring.rows()[k].slot1, colouring.rows()[k].slot2}) {
        detail::prefetch(bodies[slot]);
      }
      detail::prefetch(rows[k]);
      __builtin_prefetch(impulses_->quad(k));
    }
  }

  /// If the problem `passes`: row k is at rest as in the last problem, between bodies that have hardly moved
  /// since it was right. Its impulse is that of `last`, and the row itself is not up to date.
  bool isPassed(std::size_t k, const ContactColoring& colouring) const;
  /// Takes the impulses of rows that were passed over from the last problem.
  void recall(const ContactColoring& colouring);
  /// Where all rows of large islands were passed over: the impulses of the others change places with those in
  /// the list of the last problem, which then becomes that of this one.
  void keepLast(const ContactColoring& colouring, detail::ImpulseList<S>& last);
  const detail::ImpulseList<S>& impulses() const { return *impulses_; }
  detail::ImpulseList<S>& impulses() { return *impulses_; }
  /// It is solved: what the next one does not go on from is of no use any more.
  void end();
  /// What the next problem, of the same contacts, goes on from.
  detail::SolvedProblem<S> solved(const ContactColoring& colouring) const;
  /// Puts it back. \param kinds of the contacts
  template <ContactBodies B>
  void resume(const detail::SolvedProblem<S>& all, const B& source, const ContactColoring& colouring,
              const ContactKinds& kinds);

  /// Rows with their impulses. \param all  none of them was passed over
  [[gnu::always_inline]] inline Lanes load(const Group& group, bool all) const;
  [[gnu::always_inline]] inline void storeImpulses(const Group& group, const Lanes& row);

  /// The square of the change that a sweep would make in velocities, at most; no bound, where it is still to
  /// be asked who slides.
  [[gnu::always_inline]] inline Pack wrongAt(const Group& group, const Lanes& present,
                                             const detail::RowSlides<S>& sliding) const;

  /// Makes these rows right while all others stand. The normal impulse leaves the slip as it is, so that both
  /// are found from the same velocities.
  /// \param turned  what resists turning does; none without it
  [[gnu::always_inline]] inline detail::RowChanges<S> change(const Group& group, Lanes& row,
                                                             const detail::BodyLanes<S>& b1,
                                                             const detail::BodyLanes<S>& b2,
                                                             const detail::RowSlides<S>& sliding,
                                                             Turned& turned) const;
  /// The same for the normal impulse that they have.
  [[gnu::always_inline]] inline Turned rub(const Group& group, Lanes& row, const detail::BodyLanes<S>& b1,
                                           const detail::BodyLanes<S>& b2,
                                           const detail::PackedVector<S>& slip,
                                           const detail::RowSlides<S>& sliding,
                                           detail::RowChanges<S>& changes) const;

  /// The part of this slip that is to vanish.
  [[gnu::always_inline]] inline detail::PackedVector<S> slipOf(const Group& group,
                                                               const detail::PackedVector<S>& slip) const;
  /// Where static and kinetic friction are one, it does not matter who slides.
  /// \param before  `before.of(k)` of a row that lasts
  template <class Before>
  [[gnu::always_inline]] inline detail::RowSlides<S> slidesOf(const Group& group, Before& before) const;
  template <class Before>
  [[gnu::always_inline]] inline void lookBackAt(const Group& group, Before& before,
                                                detail::RowSlides<S>& slides) const;

  /// Sweeps went on with static friction where it was not known who slides: those whose friction is at its
  /// limit, and whose slip exceeds `least`, do, and are to be looked at again. \return whether there are any
  bool letSlide(const ContactColoring& colouring, const S& least);
  /// The same of row k. \return whether it begins to slide
  bool letSlide(std::size_t k, const ContactColoring& colouring, const S& least);

  /// The change of its normal velocity that row k asks for; of a small island, if `again`, wrongAt().
  const S& approachAt(std::size_t k) const { return approaches_[k]; }
  const S& wrongAt(std::size_t k) const { return wrongs_[k]; }
  /// Whether it begins from an impulse of the last solve.
  bool remembers(std::size_t k) const { return last_->normal(k) > S(0); }
  /// Whether what friction alone holds counts beside such a change, and for how much row k then does.
  bool mayHold(const S& approach) const;
  S heldAt(std::size_t k, const ContactColoring& colouring) const;
  /// Half of what the bend of their ways does to the velocities of pairs until the end of the step.
  [[gnu::always_inline]] inline detail::PackedVector<S> bendOf(const ContactColoring& colouring,
                                                               const Group& group) const;
  /// What that does to slips. \param bend of bendOf() \param b1,b2 of `initial`
  [[gnu::always_inline]] inline detail::PackedVector<S> slipByBend(const Lanes& row,
                                                                   const detail::PackedVector<S>& bend,
                                                                   const detail::BodyLanes<S>& b1,
                                                                   const detail::BodyLanes<S>& b2) const;

  /// Rows [begin, end), which are all of their bodies, get no impulse.
  void release(const ContactColoring& colouring, std::size_t begin, std::size_t end);

 private:
  /// What rows are taken up from.
  template <class B>
  struct Taking {
    const ContactView<S>& contacts;
    const B& source;
    const ContactColoring& colouring;
    const S& dt;
    const ContactSettings<S>& settings;
    bool fresh;
    const WayAhead<S>& way;
  };

  using Most = detail::RowNeeds<S>;
  using Taken = detail::RowsTaken<S>;
  using RowRest = detail::RowRest;

  /// Takes up those rows but the lone ones of which `wanted(k, sum)`, without a guess: their bodies have it.
  template <class B, class Wanted>
  Taken lookAtRows(const Taking<B>& taking, Wanted&& wanted);

  /// By lane.
  template <class Of>
  [[gnu::always_inline]] static inline detail::PackedVector<S> vectorsOf(Of&& of) {
    const auto part = [&](Eigen::Index c) { return Pack::of([&](std::size_t lane) { return of(lane)[c]; }); };
    return {part(0), part(1), part(2)};
  }

  /// What sweeps begin with in these rows: the impulse of the last step again, by `ratio`.
  [[gnu::always_inline]] inline void takeGuess(const Group& group, Lanes& row, const detail::BodyLanes<S>& b1,
                                               const detail::BodyLanes<S>& b2) const;

  /// Brings nearer what rows from k on are taken up from.
  template <class B>
  [[gnu::always_inline]] inline void fetch(const Taking<B>& taking, std::size_t k) const;

  /// Takes up rows without an impulse.
  template <class B>
  [[gnu::always_inline]] inline Lanes take(const Taking<B>& taking, const Group& group, Taken& sum);

  /// And with the last one once more, which their bodies have already, or with one that these get.
  template <class B>
  [[gnu::flatten]] void takeAgain(const Taking<B>& taking, const Group& group, Taken& sum);
  template <class B>
  [[gnu::flatten]] void takeWithGuess(const Taking<B>& taking, const Group& group, Taken& sum);

  /// All rows but the lone ones after a restart, with the targets they have.
  template <class B>
  void fillAll(const Taking<B>& taking);

  template <class B>
  static const Contact<S>& contactOf(const Taking<B>& taking, const Group& group, std::size_t lane) {
    return taking.contacts[taking.colouring.rows()[group.row[lane]].contact];
  }

  /// What stays while bodies and surfaces stay.
  template <class B>
  [[gnu::always_inline]] inline Lanes rowsOf(const Taking<B>& taking, const Group& group, const Pack& radius1,
                                             const Pack& radius2);

  /// The same of what resists turning.
  template <class B>
  void fillTurning(const Taking<B>& taking, const Group& group, const Pack& radius1, const Pack& radius2);

  /// What the present velocities ask for. \param b1,b2 of `initial`: falls and radii in place of inverse
  /// masses and spins
  /// \return the largest change of a normal velocity
  template <class B>
  [[gnu::always_inline]] inline S aim(const Taking<B>& taking, const Group& group, Lanes& row,
                                      const detail::BodyLanes<S>& b1, const detail::BodyLanes<S>& b2,
                                      Taken& sum);

  /// Drifts of second sides.
  template <class B>
  [[gnu::always_inline]] inline detail::PackedVector<S> driftsOf(const Taking<B>& taking,
                                                                 const Group& group) const;

  /// \param b1,b2 as in aim(); for the drift with what the last impulses did, if the problem is the same
  template <class B>
  [[gnu::always_inline]] inline detail::TurningPair<S> turningOf(const Taking<B>& taking, const Group& group,
                                                                 const Lanes& row,
                                                                 const detail::BodyLanes<S>& b1,
                                                                 const detail::BodyLanes<S>& b2,
                                                                 const detail::PackedVector<S>& drifts) const;

  /// Takes down how rows slipped and turned before, of those that last.
  /// \param b1,b2 as in aim() \param v_n without drifts \param aimed  slip that is left to the way ahead
  template <class B>
  void lookBack(const Taking<B>& taking, const Group& group, const Lanes& row, const detail::BodyLanes<S>& b1,
                const detail::BodyLanes<S>& b2, const Pack& v_n, const Pack& load,
                const detail::PackedVector<S>& aimed, Taken& sum);

  /// Target of a row that may be faster than what rests.
  template <class B>
  [[gnu::noinline]] S rebound(const Taking<B>& taking, const Group& group, std::size_t lane,
                              const Vector3<S>& n, const S& v_n, const S& allowed, S pull);

  template <class B>
  Vector3<S> driftOf(const Taking<B>& taking, const Group& group, std::size_t lane) const {
    return speedIn(taking.contacts.drift(contactOf(taking, group, lane)));
  }

  template <class B>
  [[gnu::noinline]] void aimSlip(const Taking<B>& taking, const Group& group, std::size_t lane,
                                 const Lanes& rowLanes, const S& drift_n, const Vector3<S>& turned);

  /// What slid in the last solve slides: its friction was at the kinetic limit.
  [[gnu::always_inline]] inline void recallSlides(const Group& group, const Lanes& row);
  bool slid(std::size_t k, const S& kineticFriction) const;

  /// The part of row k's slip that is to vanish, with velocities `of` the slots.
  template <class Ends>
  Vector3<S> slipAt(std::size_t k, const ContactColoring& colouring, const std::vector<Ends>& of) const;

  /// The most of rows from k on, where `approach` is less.
  S heldAcross(const ContactColoring& colouring, std::size_t k, const S& approach) const;

  /// Rows that were taken up, and their impulses.
  [[gnu::always_inline]] inline void put(const Group& group, const Lanes& row);

  std::vector<S> gaps_;                           ///< [m] by row
  std::vector<S> wrongs_;                         ///< by row of small islands
  std::vector<S> approaches_;                     ///< by row: change of the normal velocity that it asks for
  S threshold_ = S(0);                            ///< [m s^-1] of restitution, in the last problem
  detail::ImpulseList<S>* impulses_ = nullptr;    ///< of this problem, in its own units
  const detail::ImpulseList<S>* last_ = nullptr;  ///< while it is solved
  S ratio_ = S(0);
  S step_ = S(0);   ///< [s]
  S angle_ = S(0);  ///< half of that by which the frame turns spins on the way, if it `bends`
};

}  // namespace gravel

#include <gravel/contact/contact_problem_again.hpp>
#include <gravel/contact/contact_problem_slides.hpp>
#include <gravel/contact/contact_problem_take.hpp>
#include <gravel/contact/contact_problem_way.hpp>
