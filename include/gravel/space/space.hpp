#pragma once

/// \file
/// The facade: a space in which bodies attract each other, collide, rub, spin, stack and settle.

#include <gravel/contact/collision_context.hpp>
#include <gravel/contact/graph_coloring.hpp>
#include <gravel/dynamics/adaptive_step.hpp>
#include <gravel/dynamics/damping.hpp>
#include <gravel/dynamics/encounter_step.hpp>
#include <gravel/dynamics/pile_step.hpp>
#include <gravel/fwd.hpp>
#include <gravel/output/conserved.hpp>
#include <gravel/output/contact_virial.hpp>
#include <gravel/output/energy_ledger.hpp>
#include <gravel/space/contact_stage.hpp>
#include <gravel/space/force_stage.hpp>
#include <gravel/space/orbit_stage.hpp>
#include <gravel/space/place_tile.hpp>
#include <gravel/space/random_bodies.hpp>
#include <gravel/space/settings.hpp>
#include <gravel/space/sleep_stage.hpp>

#include <string>
#include <tuple>
#include <utility>

namespace gravel {

/// Bodies and all that acts on them. Scalar: any `Real`. Layout: SoA, AoS, AoSoA<W> or a user's own storage.
///
/// Bodies are reached by index, 0 … n()-1 (removal and reordering change it), or by id, which stays. What is
/// written through proxies between steps is checked at the next step. A space is driven by one thread; the
/// work inside is shared between OpenMP's threads, and the result is the same bits for any number of them.
/// Whatever changes it throws std::logic_error inside a step, where hooks and the log could call it.
template <Real Scalar = double, class Layout = SoA>
class Space : public Settings<Scalar> {
 public:
  using Vector = Vector3<Scalar>;
  using Bodies = gravel::Bodies<Scalar, Layout>;
  using BodyProxy = typename Bodies::Proxy;
  using ConstBodyProxy = typename Bodies::ConstProxy;
  using CollisionContext = gravel::CollisionContext<Scalar, Layout>;

  Space() : Space(SimulationConfig<Scalar>{}) {}

  /// Makes config.bodyCount random bodies (see `randomBodies`). \throws std::invalid_argument listing every
  /// setting that is out of range
  explicit Space(const SimulationConfig<Scalar>& config);

  /// Adopts a storage with the bodies in it: another simulator's arrays, without a copy.
  /// \throws std::invalid_argument as above, or naming the body and field at fault
  Space(const SimulationConfig<Scalar>& config, typename Bodies::Storage storage);

  // Bodies.

  std::size_t n() const { return bodies_.size(); }
  /// \throws std::out_of_range unless i < n()
  BodyProxy body(std::size_t i) { return bodies_[checkedIndex(i)]; }
  ConstBodyProxy body(std::size_t i) const { return bodies_[checkedIndex(i)]; }
  /// \throws std::out_of_range if no body has this id
  BodyProxy body(BodyId id) { return bodies_[bodies_.indexOf(id)]; }
  ConstBodyProxy body(BodyId id) const { return bodies_[bodies_.indexOf(id)]; }
  const Bodies& bodies() const { return bodies_; }
  Bodies& getBodiesForTest() { return bodies_; }

  /// Room for n bodies in all: saves time and up to half of their memory where many are added one by one.
  void reserve(std::size_t n) {
    this->inStep_.refuse("reserve()");
    bodies_.reserve(n);
  }
  /// \throws std::invalid_argument naming the field, its value and what is allowed; then nothing is added
  BodyId addBody(const Body<Scalar>& body);
  /// The last body takes its index. Its energy is booked as `exchange`; where somebody's numbers are not
  /// finite none is, and total() jumps. \throws std::out_of_range if no body has this id
  void removeBody(BodyId id);
  /// Sorts the bodies along a Morton curve, so that neighbours in space are neighbours in memory. Changes
  /// indices, not ids. O(N log N).
  void reorderBodies();

  // The world around them.

  /// The half-space n.x >= offset [m] is free, n being the normal made unit. \return the plane's number,
  /// which no other plane of this space ever gets
  std::size_t addPlane(const Vector& normal, Scalar offset, MaterialId material = defaultMaterial);
  /// Planes that look into the box from `low` to `high` [m], but for the faces that are open. \return their
  /// numbers in the order low x, high x, low y, high y, low z, high z, without the open ones
  std::vector<std::size_t> addBox(const Vector& low, const Vector& high,
                                  MaterialId material = defaultMaterial, BoxFaces open = BoxFaces::None);
  /// \throws std::out_of_range if no plane has this number
  void removePlane(std::size_t plane);
  /// From now on the plane moves at this velocity [m s^-1]: along its normal it travels, across it drags what
  /// rubs on it. Set it anew before each step for any motion x(t): along the normal the mean of the step,
  /// (x(t + h) - x(t))/h; across it that at its end, x'(t + h), which the last one becomes evenly, but in the
  /// first step of a new plane, which has V from the start. Of several calls between two steps the last one
  /// counts. What a moving plane does to bodies is booked in the ledger as `work`.
  /// \throws std::out_of_range as above; std::invalid_argument for a velocity that is not finite
  void setPlaneVelocity(std::size_t plane, const Vector& velocity) {
    this->inStep_.refuse("setPlaneVelocity()");
    contact_.setPlaneVelocity(plane, velocity);
  }
  /// As they stand now, in the order of their numbers.
  const std::vector<Plane<Scalar>>& planes() const { return contact_.boundaries.planes(); }
  /// \throws std::invalid_argument on coefficients out of range
  MaterialId addMaterial(const Material<Scalar>& material);
  /// From now on these two, or two surfaces of one, have measured coefficients in place of the mixed ones.
  /// \throws std::invalid_argument on coefficients out of range, and for what is no material
  void setPairMaterial(MaterialId a, MaterialId b, const Material<Scalar>& material);
  /// One of them alone, and what two are to each other. \throws std::invalid_argument for what is no material
  Material<Scalar> material(MaterialId id) const { return contact_.materials.get(id, this->config_); }
  Material<Scalar> pairMaterial(MaterialId a, MaterialId b) const {
    return contact_.materials.pair(a, b, this->config_);
  }
  /// \param g acceleration [m s^-2] of every movable body
  void setUniformField(const Vector& g);
  const Vector& uniformField() const { return force_.field; }
  /// The user's own force; an empty one takes it away again.
  void setForceHook(ForceHook<Scalar, Layout> hook);
  /// The user's own outcome of each collision of two bodies: bounce, merge, or velocities of his own; an
  /// empty one takes it away again. Two that merge become one at the end of the step (see `merged()`): of
  /// them the fixed one keeps its id, else the heavier, else the one of the smaller id. The energy of motion
  /// that is lost is booked as `restitution`, that of the potential as `exchange`.
  void setCollisionHook(CollisionHook<Scalar> hook) {
    this->inStep_.refuse("setCollisionHook()");
    contact_.collisionHook = std::move(hook);
  }
  /// Open, periodic or shear-periodic. A shear-periodic one is a patch of a disc in Hill's frame: positions,
  /// velocities and spins are those in the frame, its potential is part of the potential energy, and the
  /// shear does its `work` where bodies or contacts cross an edge in x. With gravity the images of all bodies
  /// pull: see DirectSum::setDomain. What the shear does to gravity across an edge is not in the ledger.
  /// \throws std::invalid_argument for a patch unless config.integrator is SymplecticEpicycle; with gravity,
  /// as setG() does, for a box of more than 1000 times its shortest edge, or a patch of 1e4 times
  void setDomain(const Domain<Scalar>& domain);
  const Domain<Scalar>& domain() const { return contact_.domain; }

  /// Every body is awake again before the next step (see space/sleep_stage.hpp). Changes of forces and planes
  /// do so by themselves, changes of bodies for those that they concern.
  void wakeAll() {
    this->inStep_.refuse("wakeAll()");
    sleep_.wakeAll();
  }

  // Time.

  /// One full step: advance, collide, forces, damping, next step size. Of an empty space only planes move.
  /// \param iteration number of this step; diagnostics are logged when it is a multiple of logFrequency
  /// \throws std::invalid_argument naming body and field if a value is not finite or out of range; nothing
  /// has moved then
  void computeDynamics(std::size_t iteration);
  /// Looks at all that the next step looks at before anything moves. \throws std::invalid_argument as above
  void check() const { check(dt_); }
  /// Steps until `time` [s] exactly; the last two are shortened alike. \throws std::invalid_argument for a
  /// time before now or not finite
  void advanceTo(Scalar time);
  Scalar time() const { return time_; }
  std::size_t steps() const { return steps_; }
  /// Steps of single bodies inside those, each with one evaluation of its force, of the methods that give
  /// every body a step of its own; 0 with others.
  std::uint64_t individualSteps() const { return orbits_.individualSteps(); }
  /// [s] An adaptive one is chosen anew in the first step, and in one before which something was changed.
  Scalar getTimeStep() const { return dt_; }
  /// The next step; where steps adapt, the longest one from now on, so that the next one is not longer.
  void setTimeStep(Scalar dt);
  Scalar getPreviousTimeStep() const { return previous_dt_; }
  /// Parts of the last step, each with its own contacts: as many as asked for, or were chosen, as in a gas;
  /// by an integrator of several drifts its number of force evaluations where anything touched, else 1.
  std::size_t contactSubsteps() const { return parts_; }

  Scalar getG() const { return this->config_.G; }
  void setG(Scalar g);

  // What can be seen.

  /// (translational, rotational, potential) [J]; the potential counts mutual gravity, the uniform field
  /// and, in a shear-periodic domain, that of the frame.
  std::tuple<Scalar, Scalar, Scalar> calculateSystemEnergy() const;
  /// Energies now and what left since the start, by process.
  EnergyLedger<Scalar> energyLedger() const;
  ConservedQuantities<Scalar> conserved() const { return conservedQuantities(bodies_); }
  std::tuple<std::vector<Vector>, std::vector<Quaternion<Scalar>>> getAllBodyTransforms() const;
  /// Positions, orientations, torques, angular accelerations.
  std::tuple<std::vector<Vector>, std::vector<Quaternion<Scalar>>, std::vector<Vector>, std::vector<Vector>>
  getDataForDisplay() const;
  /// Pairs that touched in the last step: contacts() and impacts(), each pair once. Contacts inside a heap
  /// that sleeps are not among them, here and in contacts(); weights and virials count them.
  std::size_t contactCount() const { return contact_.touches(bodies_); }
  /// What the contact solver reached in the last step.
  const ContactReport<Scalar>& contactReport() const { return contact_.report(); }
  /// Contacts of the last step, in the order of ids; the surfaces of a contact c: contacts().material(c).
  /// Those of bodies that were removed or went into others since are not among them, here and in impacts().
  const ContactList<Scalar>& contacts() const { return contact_.contacts(bodies_); }
  /// Impulses [N s] over the last step, in the order of contacts(). A contact's mean force is its impulse
  /// over getPreviousTimeStep().
  std::vector<ContactImpulse<Scalar>> contactImpulses() const { return contact_.impulses(bodies_); }
  /// Terms of the virial theorem over the last step: an error of the forces in a whole heap at rest that
  /// needs no reference, see `ContactVirial::residual()`.
  ContactVirial<Scalar> contactVirial() const;
  /// What presses on boundaries and fixed bodies over the last step [N], against the weight in the field.
  SupportedWeight<Scalar> supportedWeight() const;
  /// Force [N] on a plane over the last step. \throws std::out_of_range if no plane has this number
  Vector planeForce(std::size_t plane) const;
  /// Blows that were dealt at their own time inside the last step, in their order; their times are those
  /// since its start.
  const std::vector<Impact<Scalar>>& impacts() const { return contact_.impacts(bodies_); }
  /// Bodies that touch each body in the last step, by index, each once, in order; none of those of sleepers.
  std::vector<std::vector<std::size_t>> collisionGraph() const;
  /// Seconds by phase, and what was skipped and why, on standard output.
  void printProfilingReport() const { profiler_.print(stdout); }
  const Profiler& profiler() const { return profiler_; }
  /// Where diagnostics go, a line a call; standard output by default.
  void setLog(Callback<void(const char*)> log);

  /// Writes all that steps depend on, but for hooks and the log. \throws std::runtime_error where it cannot
  void save(const std::string& path) const requires std::is_trivially_copyable_v<Scalar>;
  /// Takes up a saved run: the next steps give the bits that the saved space would have given. Of the last
  /// one it knows contacts and their impulses, but not which were blows, nor what ended in it. Hooks and the
  /// log stay those of this space. \throws std::runtime_error, std::invalid_argument: it stays as it was
  void restore(const std::string& path) requires std::is_trivially_copyable_v<Scalar>;

  // Parts of the collision handling, as the step uses them.

  /// Empty exactly when the spheres do not overlap.
  std::optional<CollisionContext> createCollisionContext(BodyProxy& b1, BodyProxy& b2) {
    return makeCollisionContext<Scalar, Layout>(b1, b2, contact_.domain, time_, this->config_.epsilon);
  }
  std::optional<CollisionContext> createCollisionContext(BodyProxy&& b1, BodyProxy&& b2) {
    return createCollisionContext(b1, b2);
  }
  /// Applies the normal impulse. \return the impulse on body 2 [N s], its magnitude, and the part of it that
  /// is bias: 0, since overlap is removed by moving positions, never by velocity
  std::tuple<Vector, Scalar, Scalar> applyRestitutionImpulse(CollisionContext& ctx);
  /// Applies the tangential impulse within Coulomb's cone of the normal impulse jn [N s]. \return the impulse
  /// on body 2 [N s]
  Vector applyFrictionImpulse(const CollisionContext& ctx, Scalar jn, const Vector& impulseN);
  /// Colours the vertices of an undirected graph so that neighbours differ; the result is in `colors()`.
  /// \throws std::invalid_argument for an index out of range or an edge from a vertex to itself
  void colorGraph(const std::vector<std::vector<std::size_t>>& graph) { colors_ = gravel::colorGraph(graph); }
  const std::vector<int>& colors() const { return colors_; }

 private:
  friend class ::SpaceTest;
  struct Departure;

  std::size_t checkedIndex(std::size_t i) const;
  void handleCollision(BodyProxy& b1, BodyProxy& b2);
  void initializeBodies(std::size_t n, Scalar dens, unsigned int seed);
  void resolveInterpenetration(const CollisionContext& ctx);
  Scalar getEffectiveMass(const CollisionContext& ctx, const Vector& direction) const;
  void logSystemEnergy(std::size_t iteration);
  void buildCollisionGraph();
  void resolveCollisions(bool drifts = false);
  void applyGravity();
  void updateAdaptiveTimeStep();
  void applyDamping();

  void step(Scalar h, std::size_t iteration, const Scalar* until = nullptr);
  static Scalar stepTowards(const Scalar& rest, const Scalar& h);
  std::pair<Scalar, Scalar> timeAfter(const Scalar& h) const;
  bool areFewPoints() const;
  std::size_t moveFewPoints(const Scalar& h, const Scalar* until, Profiler::Step& timing);
  bool hasSeveralDrifts() const;
  std::size_t partsOfGas(const Scalar& h);
  std::size_t chooseParts(const Scalar& h);
  void advance(const Scalar& h, std::size_t part, std::size_t parts, Scalar& found);
  void check(const Scalar& h) const;
  void prepare(const Scalar& h);
  void wakeTheChanged();
  void fallAsleep();
  typename ContactStage<Scalar, Layout>::Touches allTouches() const;
  void rememberPlaces();
  bool placesChanged() const;
  Scalar bindingEnergy(std::size_t i, const Scalar& time, const Scalar& G) const;
  BodyPairs decideCollisions(const Scalar& time);
  BodyPairs decideTouching(const Scalar& time, const Scalar& h, bool begins, BodyPairs& decided);
  void mergeCollided(const BodyPairs& merges, const Scalar& time);
  void merge(BodyId stays, BodyId goes, const Scalar& time, const Scalar& G);
  Scalar pairEnergy(std::size_t i, std::size_t j, const Scalar& time, const Scalar& G) const;
  Scalar potentialEnergy() const;
  template <class Part>
  void changePotential(Part& part, const Part& next);
  void checkIntegratorIn(const Domain<Scalar>& domain) const;
  void logLine(const char* line) const;

  Bodies bodies_;
  mutable ForceStage<Scalar, Layout> force_;  // its workspace serves const queries too
  ContactStage<Scalar, Layout> contact_;
  SleepStage<Scalar, Layout> sleep_;
  std::vector<int> colors_;
  Profiler profiler_;
  Callback<void(const char*)> log_;

  Scalar dt_ = Scalar(0);
  bool stepGoesOn_ = false;  // the last step was smooth: the next one is chosen by it, reversibly
  Scalar previous_dt_ = Scalar(0);
  Scalar contact_dt_ = Scalar(0);  // of the last part of it
  std::size_t parts_ = 1;
  Scalar time_ = Scalar(0);
  Scalar timeRest_ = Scalar(0);  // what time_ lost to rounding (Kahan 1965)
  std::size_t steps_ = 0;
  EnergyLedger<Scalar> left_;  // the processes' part of the ledger
  bool ledgerOpen_ = false;    // bodies added before the first step belong to the start
  Scalar lastTotalEnergy_ = Scalar(std::numeric_limits<double>::infinity());
  OrbitStage<Scalar, Layout> orbits_;
  PileStep<Scalar> piles_;
  Compensation<Scalar> lost_;  // what kicks and drifts lost to rounding

  // Positions and masses at the last force evaluation: forces are renewed if somebody changed them.
  std::vector<detail::PlaceTile<Scalar>> places_;
  std::size_t placed_ = 0;
  bool forcesValid_ = false;
};

}  // namespace gravel

#include <gravel/space/space_collisions.hpp>
#include <gravel/space/space_setup.hpp>
#include <gravel/space/space_sleep.hpp>
#include <gravel/space/space_state.hpp>
#include <gravel/space/space_step.hpp>
#include <gravel/space/space_substeps.hpp>
