#pragma once

/// \file
/// The collision part of a step: candidates, contacts, overlap, impulses.

#include <gravel/contact/boundary_list.hpp>
#include <gravel/contact/collision_outcome.hpp>
#include <gravel/contact/contact_solver.hpp>
#include <gravel/contact/impact_events.hpp>
#include <gravel/contact/late_blows.hpp>
#include <gravel/contact/narrow_phase.hpp>
#include <gravel/core/profiler.hpp>
#include <gravel/dynamics/boundary.hpp>
#include <gravel/dynamics/epicycle.hpp>
#include <gravel/output/snapshot.hpp>
#include <gravel/space/force_stage.hpp>
#include <gravel/space/material_table.hpp>
#include <gravel/space/simulation_config.hpp>
#include <gravel/space/step_record.hpp>
#include <gravel/spatial/neighbour_list.hpp>

namespace gravel {

template <Real Scalar, class Layout>
class ContactStage {
 public:
  using Bodies = gravel::Bodies<Scalar, Layout>;
  using Config = SimulationConfig<Scalar>;

  Domain<Scalar> domain;
  Boundaries<Scalar> boundaries;
  MaterialTable<Scalar> materials;
  CollisionHook<Scalar> collisionHook;

  const ContactReport<Scalar>& report() const { return report_; }

  // What touched in the last step, of the bodies that are there, by the indices of now:
  // contact_stage_reports.hpp.

  /// At its end. O(contacts) once after bodies came, went or merged; like impacts() it holds until then.
  const ContactList<Scalar>& contacts(const Bodies& bodies) const;
  /// Of all solves of the step [N s], in the order of contacts(). A contact that ended in a drift is not
  /// among them. O(contacts).
  std::vector<ContactImpulse<Scalar>> impulses(const Bodies& bodies) const;
  /// The blows inside it, in the order in which they were dealt.
  const std::vector<Impact<Scalar>>& impacts(const Bodies& bodies) const;
  /// Pairs: contacts at its end, and impacts of others.
  std::size_t touches(const Bodies& bodies) const;

  /// Brings bodies back into the domain. \return the energy that they have more there [J]
  /// \param field [m s^-2]  \param kick [s] for which it still acts at the end of the part
  Scalar wrap(Bodies& bodies, const Scalar& time, const Vector3<Scalar>& field, const Scalar& kick) const {
    return wrapBodies(bodies, domain, time, field, kick);
  }

  /// Finds all contacts at the present positions, for steps of length h [s]. Of pairs as near as what rests
  /// those of the last step are taken to rest, and, unless it `goesOn`, all that touch or approach slowly.
  void detect(const Bodies& bodies, const Config& config, const Scalar& time, const Scalar& h, bool goesOn,
              Profiler& profiler);
  /// Before a step: contacts get the surfaces that settings, pairs and bodies have by now. O(bodies).
  void renewSurfaces(const Bodies& bodies, const Config& config);
  /// At its start: blows of what touches, if contacts were found anew. O(contacts) then. \return any
  bool strikeTouching(Bodies& bodies, const Config& config, const Scalar& h, Profiler& profiler);

  // Of planes that move: contact_stage_planes.hpp.
  void setPlaneVelocity(std::size_t plane, const Vector3<Scalar>& velocity);
  /// The next solve sees planes as they move when a share (0 to 1) of the step of length h [s] has passed.
  void drivePlanes(const Bodies& bodies, const Scalar& share, const Scalar& h);

  /// Before the drift of a step of length h [s] from `time`: deals the impacts inside it, each at its own
  /// time, so that the drift ends where the bodies are after them. Adds to the report of the step.
  void strike(Bodies& bodies, const Config& config, const HillFrame<Scalar>& frame, const Scalar& time,
              const Scalar& h, const PartOfStep<Scalar>& part, Profiler& profiler);

  /// Whether anything touches, or will in the next h [s] while accelerations last. Moves nothing.
  bool foresees(const Bodies& bodies, const Config& config, const Scalar& time, const Scalar& h,
                Profiler& profiler);

  /// Pairs of ids that a user lets merge after impacts inside the last part of the step.
  const BodyPairs& merges() const { return impacts_.merges(); }
  const std::vector<Impact<Scalar>>& impactsOfPart() const { return impacts_.impacts(); }

  /// All that touched: contacts() with impulses(), and after them impacts().
  struct Touches {
    ContactList<Scalar> contacts;
    std::vector<ContactImpulse<Scalar>> impulses;
  };
  Touches allTouches(const Bodies& bodies) const;
  /// Adds what ended inside the step, with what it bore until then. A pair may be there twice. O(contacts).
  void addEnded(const Bodies& bodies, Touches& all) const;

  /// Shrinks overlaps by moving bodies, and renews the geometry of the contacts, on which impulses act.
  void separate(Bodies& bodies, const Config& config, const Scalar& time, Profiler& profiler);

  /// Energy that moving bodies apart took [J]: F.d by the forces at the new places, exact to the square of
  /// the displacement d, what it took of their motion, and its share of the kick [s] that follows.
  Scalar separationWork(const ForceStage<Scalar, Layout>& force, const Bodies& bodies, Scalar kick) const;

  /// Solves all contacts together on the present velocities. Adds to the report of the step.
  /// \param h [s] length of the step \param drifts  the drift of the step follows
  void solve(Bodies& bodies, const Config& config, const Scalar& h, bool drifts, Profiler& profiler) {
    if (contacts_.empty()) {
      profiler.skip(Phase::ContactSolve, "no contacts");
      solver_.begin(contacts_, bodies);
      solver_.forget();
      return;
    }
    colour(bodies, profiler);
    const Profiler::Scope scope(profiler, Phase::ContactSolve);
    remembers_ = report_.contacts > 0 ? remembers_ : solver_.remembers();
    solver_.setSettings(settingsOf(config, contacts_.size(), remembers_));
    solver_.rebind(contacts_);  // the space may be a copy
    findBends(bodies, drifts ? h : Scalar(0));
    const ContactReport<Scalar> half =
        solver_.solve(bodies, h, {drifts, bend_, domain.omega(), h / Scalar(2), carried_});
    acted_ = half.iterations > 0;
    if (!acted_) {
      solver_.forget();  // its impulses are those of the solve before
    }
    report_.addSolve(half);
  }

  /// What the first half's solve did, for its kick [s]. O(N).
  void tellChanges(const Bodies& bodies, const Scalar& kick, ContactKicks<Scalar>& kicks) const;

  /// Bodies merged, and the step goes on: contacts of these pairs of ids are not what they were.
  void endMerged(const Bodies& bodies, const BodyPairs& merges);

  /// \throws std::invalid_argument for a sphere that would touch its own image
  void checkSizes(const Bodies& bodies) const;

  /// A new step: its report starts empty.
  void beginStep() {
    report_ = {};
    record_.clear();
    firstActed_ = false;
    impacts_.clear();
    late_.clear();
  }

  /// The impacts of a drift are dealt; \param start [s] of it, since forces were last found.
  void keepBlows(const Bodies& bodies, const Scalar& start);
  /// Forces have been found anew, h [s] after that: what blows since then lacked is made up (LateBlows).
  /// \param change  [m s^-2] of a body's acceleration by forces of the user's  \return their share in that
  /// [J]
  template <class Change>
  Scalar makeUpBlows(Bodies& bodies, const Scalar& time, const Scalar& h, Change&& change);
  /// Whether anything was struck in the step so far.
  bool struck() const { return !impacts().empty() || !impacts_.impacts().empty(); }
  /// What the blows of the drift that is to come did to spins.
  std::span<const TurnChange<Scalar>> turns() const { return impacts_.turns(); }
  /// What the last solve() gave to the work that present torques did just before [J]: see bookKick().
  Scalar torqueWork(const Bodies& bodies, const Scalar& kick) const;

  /// A part of the step is over that began `start` [s] after it. \param last  no other one follows
  void endPart(const Scalar& start, bool last);

  /// The first half of the step is solved; the solver keeps its impulses while it solves the second one.
  /// \param kick [s] for which the present accelerations acted on the velocities before that
  void endFirstHalf(const Bodies& bodies, const Scalar& kick) {
    firstActed_ = acted_;
    if (acted_) {
      bookKick(bodies, kick);
    }
  }

  /// The solver takes contacts up anew before it goes on, by ids, as if nothing had been.
  void suspend();
  /// Bodies are in a new order; contacts and impacts know theirs by id. \return whether all of them are there
  bool renumber(const Bodies& bodies);

  /// Why nothing can touch, or nullptr.
  const char* reasonToSkip(const Bodies& bodies) const;

  // Of bodies that sleep: contact_stage_sleep.hpp.
  /// Nothing that contacts can move is awake: there is no search.
  void setIdle(bool idle) { idle_ = idle; }
  bool isIdle() const { return idle_; }
  /// Whom the last separate() moved, and how far, by the indices of now; none once bodies came or went.
  std::span<const Displacement<Scalar>> movedApart(const Bodies& bodies) const;
  /// Calls visit(i) for every held body i that a movable one comes near to within h [s].
  template <class Visit>
  void forEachApproach(const Bodies& bodies, const Config& config, const Scalar& time, const Scalar& h,
                       Profiler& profiler, Visit&& visit);
  /// What the next solve goes on from, and the step [s] that it stands for.
  std::vector<StoredImpulse<Scalar>> memory() const { return solver_.memory(); }
  const Scalar& memoryStep() const { return solver_.memoryStep(); }
  /// Contacts that nothing can move at either end leave the list, and are forgotten.
  void dropHeld(const Bodies& bodies);
  /// Contacts join the list, with what is remembered of them. Those that are there stay as they are.
  void add(const ContactList<Scalar>& contacts, const std::vector<StoredImpulse<Scalar>>& memory);

  void save(SnapshotWriter& out) const;
  /// \throws std::runtime_error, std::invalid_argument if the file does not hold what save() writes
  void load(SnapshotReader& in);

 private:
  /// A contact or an impact, by the ids of its bodies. \return whether they are there
  template <class Pair>
  static bool renumber(const Bodies& bodies, Pair& pair);
  /// Calls visit(contact, impulse) for what bore something in the first half of the part.
  template <class Visit>
  void forEachBefore(Visit&& visit) const;
  void bookKick(const Bodies& bodies, const Scalar& kick);
  ContactSettings<Scalar> settingsOf(const Config& config, std::size_t contacts, bool remembers) const;
  void colour(const Bodies& bodies, Profiler& profiler) {
    if (!coloured_) {
      const Profiler::Scope scope(profiler, Phase::Colouring);
      if (known_) {
        solver_.begin(contacts_, bodies, narrow_.facts());
      } else {
        solver_.begin(contacts_, bodies);
      }
      solver_.resume(resumed_, bodies);
      resumed_ = {};
      coloured_ = true;
    }
  }

  /// Others, or elsewhere, than those that solver_ knows.
  void contactsChanged() {
    coloured_ = false;
    known_ = false;
    resumed_ = {};
    present_.revision.reset();
  }

  /// What the solves of the step before its last one gave.
  StepRecord<Scalar> beforeLast() const;
  /// What was found last, whoever is there by now.
  std::vector<ContactImpulse<Scalar>> impulses() const;
  std::vector<Impact<Scalar>>& impacts() {
    return record_.hasParts() ? record_.impacts() : impacts_.impacts();
  }
  const std::vector<Impact<Scalar>>& impacts() const {
    return record_.hasParts() ? record_.impacts() : impacts_.impacts();
  }

  /// The same of the bodies that are there, where it is not the same: made when somebody looks, since bodies
  /// may be removed one by one.
  struct Present {
    ContactList<Scalar> contacts;
    std::vector<std::uint32_t> places;  ///< of them in contacts_
    std::vector<Impact<Scalar>> impacts;
    std::optional<std::uint64_t> revision;  ///< of the bodies that it is of
  };
  const Present& present(const Bodies& bodies) const;
  template <class DriftOf>
  void setDrifts(DriftOf&& driftOf);
  /// \param settled  blows, of which those that rest count like contacts
  void findCarried(const Bodies& bodies, const Scalar& h, std::span<const Impact<Scalar>> settled = {});
  void carryAll(const Bodies& bodies, const Scalar& h);
  void findBends(const Bodies& bodies, const Scalar& ahead);
  void findLeaning(const Bodies& bodies, bool goesOn);
  std::vector<ContactName> whoTouches(std::span<const Impact<Scalar>> settled) const;
  Scalar fastestSwing() const;
  void renewGeometry(const Bodies& bodies, const Config& config, const Scalar& time);
  template <class Course>
  void strike(Bodies& bodies, const Config& config, Course& course, const Scalar& time, const Scalar& h,
              const PartOfStep<Scalar>& part, Profiler& profiler);

  template <class Travel>
  void search(const Bodies& bodies, const Config& config, const Scalar& time, const Travel& travel,
              const Scalar& h, Profiler& profiler);

  void prepareSurfaces(const Config& config, const PartOfStep<Scalar>& part = {});
  /// For the next h [s]. Nothing where all are to be looked at.
  std::optional<std::span<const std::uint32_t>> nearBoundaries(const Bodies& bodies, const Scalar& h);

  /// contacts() by name.
  std::span<const ContactName> names();
  /// Who came to rest in the step, sorted.
  std::span<const ContactKeys> settled();
  std::vector<HalfSpace<Scalar>> walls_;
  NeighbourList<Scalar> neighbours_;
  std::vector<std::uint32_t> fixed_;  // at its last search: it has no pairs of these
  BoundaryList<Scalar> nearWalls_;
  std::uint64_t searchesForWalls_ = 0;  // of neighbours_, when nearWalls_ were last asked for
  NarrowPhase<Scalar> narrow_;
  ImpactEvents<Scalar> impacts_;
  LateBlows<Scalar> late_;
  std::vector<ContactName> names_;
  std::vector<ContactKeys> settled_;
  Scalar gapStep_ = Scalar(0);  // [s] of nextGapStep()
  mutable std::vector<ContactKeys> struck_;
  bool searched_ = false;  // neighbours_ hold for the whole drift
  bool grazed_ = false;    // something touched in it, and got no blow
  ContactList<Scalar> contacts_;
  std::uint64_t revision_ = 0;  // of the bodies by whose indices contacts and impacts are
  mutable Present present_;
  ContactSolver<Scalar> solver_;
  StepRecord<Scalar> record_;
  ContactReport<Scalar> report_;
  std::vector<Vector3<Scalar>> bend_;  // of Hill's frame, of findBends()
  std::vector<std::uint8_t> leaning_;  // by body, of findLeaning()
  std::vector<Scalar> carried_;        // of WayAhead, for the contacts of the last drivePlanes()
  Scalar separationLoss_ = Scalar(0);
  bool idle_ = false;
  bool anew_ = false;  // contacts were found since the last step
  bool moved_ = false;
  std::vector<std::uint8_t> wasMoved_;     // by body: in the last separation
  bool acted_ = false;                     // the last solve changed velocities
  bool firstActed_ = false;                // so did that of the first half of this part, or of the last one
  bool remembers_ = false;                 // the first solve of this step had impulses to begin from
  bool known_ = false;                     // narrow_.facts() are of the present contacts
  bool coloured_ = false;                  // solver_ knows the present contacts
  detail::SolvedProblem<Scalar> resumed_;  // what solver_ is to go on from once it has contacts_
};

}  // namespace gravel

#include <gravel/space/contact_stage_impacts.hpp>
#include <gravel/space/contact_stage_planes.hpp>
#include <gravel/space/contact_stage_reports.hpp>
#include <gravel/space/contact_stage_search.hpp>
#include <gravel/space/contact_stage_sleep.hpp>
