#pragma once

/// \file
/// The collision part of a step: candidates, contacts, overlap, impulses.

#include <gravel/contact/boundary_list.hpp>
#include <gravel/contact/collision_outcome.hpp>
#include <gravel/contact/contact_solver.hpp>
#include <gravel/contact/impact_events.hpp>
#include <gravel/contact/narrow_phase.hpp>
#include <gravel/core/profiler.hpp>
#include <gravel/dynamics/boundary.hpp>
#include <gravel/dynamics/epicycle.hpp>
#include <gravel/dynamics/epicycle_course.hpp>
#include <gravel/output/snapshot.hpp>
#include <gravel/space/force_stage.hpp>
#include <gravel/space/material_table.hpp>
#include <gravel/space/simulation_config.hpp>
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

  const std::vector<Contact<Scalar>>& contacts() const { return contacts_; }
  const ContactReport<Scalar>& report() const { return report_; }

  /// Brings bodies back into the domain. \return the energy that they have more there [J]
  Scalar wrap(Bodies& bodies, const Scalar& time) const { return wrapBodies(bodies, domain, time); }

  /// Finds all contacts at the present positions, for steps of length h [s]. All pairs as near as what rests
  /// are taken to rest; those of the last step alone, if `goesOn`.
  void detect(const Bodies& bodies, const Config& config, const Scalar& time, const Scalar& h, bool goesOn,
              Profiler& profiler) {
    const bool searched = searched_;
    searched_ = false;
    coloured_ = false;
    const char* reason = reasonToSkip(bodies);
    if (reason != nullptr) {
      contacts_.clear();
      profiler.skip(Phase::NeighbourSearch, reason);
      profiler.skip(Phase::NarrowPhase, reason);
      return;
    }
    if (!searched || !goesOn) {
      search(bodies, config, time, AtRest{}, profiler);
    }
    prepareSurfaces(config);
    NarrowPhaseSettings<Scalar> settings{time, config.epsilon, Scalar(0), h};
    if (!goesOn) {
      const Profiler::Scope scope(profiler, Phase::NarrowPhase);
      narrow_.find(neighbours_.pairs(), bodies, domain, materials.entries(), walls_, settings, contacts_,
                   nearBoundaries(bodies));
      return;
    }
    rememberResting();
    settings.resting = resting_;
    if (searched && resting_.empty() && report_.postponed == 0) {
      contacts_.clear();
      profiler.skip(Phase::NarrowPhase, "all that met on the way parted again");
      return;
    }
    const Profiler::Scope scope(profiler, Phase::NarrowPhase);
    narrow_.find(neighbours_.pairs(), bodies, domain, materials.entries(), walls_, settings, contacts_,
                 nearBoundaries(bodies));
  }

  /// The plane moves on at another velocity; what rests on it feels that at once.
  void setPlaneVelocity(std::size_t plane, const Vector3<Scalar>& velocity) {
    boundaries.setVelocity(plane, velocity);
    for (Contact<Scalar>& c : contacts_) {
      if (c.second == staticPartner && c.key2 == boundaryKey(plane)) {
        c.drift = velocity;
      }
    }
  }

  /// Before the drift of a step of length h [s] from `time`: deals the impacts inside it, each at its own
  /// time, so that the drift ends where the bodies are after them. Adds to the report of the step.
  void strike(Bodies& bodies, const Config& config, const HillFrame<Scalar>& frame, const Scalar& time,
              const Scalar& h, Profiler& profiler) {
    const char* reason = reasonToSkip(bodies);
    if (reason != nullptr) {
      profiler.skip(Phase::Impacts, reason);
      return;
    }
    if (frame.turns()) {
      EpicycleCourse<Scalar> course(frame, h);
      course.foresee(bodies);
      strike(bodies, config, course, time, h, profiler);
    } else {
      StraightCourse<Scalar> course;
      strike(bodies, config, course, time, h, profiler);
    }
  }

  /// Pairs of ids that a user lets merge after impacts inside the last step.
  const std::vector<std::pair<std::uint64_t, std::uint64_t>>& merges() const { return impacts_.merges(); }

  /// Pairs that touched in the last step: contacts at its end, and impacts of others.
  std::size_t touches() const {
    std::size_t count = contacts_.size();
    struck_.clear();
    for (const Impact<Scalar>& impact : impacts_.impacts()) {
      struck_.push_back({impact.key1, impact.key2});
    }
    std::sort(struck_.begin(), struck_.end());
    struck_.erase(std::unique(struck_.begin(), struck_.end()), struck_.end());
    for (const ContactKeys& keys : struck_) {
      const auto before = [&](const Contact<Scalar>& c) { return ContactKeys{c.key1, c.key2} < keys; };
      const auto found = std::partition_point(contacts_.begin(), contacts_.end(), before);
      count += found == contacts_.end() || ContactKeys{found->key1, found->key2} != keys ? 1U : 0U;
    }
    return count;
  }

  /// All that touched in the last step: contacts() with impulses(), and after them the impacts inside it.
  struct Touches {
    std::vector<Contact<Scalar>> contacts;
    std::vector<ContactImpulse<Scalar>> impulses;
  };
  Touches allTouches() const {
    Touches all{contacts_, impulses()};
    for (const Impact<Scalar>& impact : impacts_.impacts()) {
      Contact<Scalar> c{};
      c.first = impact.first;
      c.second = impact.second;
      c.key1 = impact.key1;
      c.key2 = impact.key2;
      c.normal = impact.normal;
      c.arm1 = impact.distance;
      all.contacts.push_back(c);
      all.impulses.push_back(impact.impulse);
    }
    return all;
  }

  /// The blows inside the last step, in the order in which they were dealt.
  const std::vector<Impact<Scalar>>& impacts() const { return impacts_.impacts(); }

  /// Shrinks overlaps by moving bodies, and renews the geometry of the contacts, so that impulses act where
  /// the bodies are.
  void separate(Bodies& bodies, const Config& config, const Scalar& time, Profiler& profiler) {
    moved_ = false;
    if (contacts_.empty()) {
      profiler.skip(Phase::Colouring, "no contacts");
      profiler.skip(Phase::PositionalCorrection, "no contacts");
      return;
    }
    colour(bodies, profiler);
    if (config.positionalCorrectionFactor == Scalar(0)) {
      profiler.skip(Phase::PositionalCorrection, "positionalCorrectionFactor is 0");
      return;
    }
    const Profiler::Scope scope(profiler, Phase::PositionalCorrection);
    CorrectionSettings<Scalar> settings;
    settings.factor = config.positionalCorrectionFactor;
    solver_.correctPositions(bodies, settings);
    moved_ = !solver_.displacements().empty();
    if (moved_) {
      renewGeometry(bodies, config, time);
    }
  }

  /// Energy that moving bodies apart took, F.d by the forces at the new places [J]: exact to the square of
  /// the displacement d.
  Scalar separationWork(const ForceStage<Scalar, Layout>& force, const Bodies& bodies) const {
    Scalar work(0);
    if (moved_) {
      const HillFrame<Scalar> frame(domain);
      for (const Displacement<Scalar>& d : solver_.displacements()) {
        work += force.conservativeForce(bodies, d.body).dot(d.shift);
        if (frame.turns()) {
          const Vector3<Scalar> x = bodies[d.body].position();
          work += Scalar(bodies[d.body].mass()) * (frame.potential(x - d.shift) - frame.potential(x));
        }
      }
    }
    return work;
  }

  /// Solves all contacts together on the present velocities. Adds to the report of the step.
  /// \param h [s] length of the step
  void solve(Bodies& bodies, const Config& config, const Scalar& h, Profiler& profiler) {
    if (contacts_.empty()) {
      profiler.skip(Phase::ContactSolve, "no contacts");
      solver_.forget();
      return;
    }
    colour(bodies, profiler);
    const Profiler::Scope scope(profiler, Phase::ContactSolve);
    ContactSettings<Scalar> settings = solver_.settings();
    settings.restitutionThreshold = std::max(config.restitutionThreshold, config.epsilon);
    settings.tolerance = config.contactTolerance;
    settings.maxIterations = static_cast<int>(config.contactIterations);
    solver_.setSettings(settings);
    solver_.rebind(contacts_);  // the space may be a copy
    const ContactReport<Scalar> half = solver_.solve(bodies, h);
    acted_ = half.iterations > 0;
    if (!acted_) {
      solver_.forget();  // its impulses are those of the solve before
    }
    report_.contacts = half.contacts;
    report_.colours = half.colours;
    report_.iterations += half.iterations;
    report_.residual = std::max(report_.residual, half.residual);
    report_.restitutionLoss += half.restitutionLoss;
    report_.frictionLoss += half.frictionLoss;
    report_.driftWork += half.driftWork;
  }

  /// Bodies are not those of the contacts any more.
  void forgetContacts() {
    impacts_.clear();
    contacts_.clear();
    coloured_ = false;
    moved_ = false;
  }

  /// A new step: its report starts empty.
  void beginStep() {
    report_ = {};
    firstHalf_.clear();
    firstHalfKeys_.clear();
    impacts_.clear();
  }

  /// The first half of the step is solved: its impulses are kept for impulses().
  /// \param kick [s] for which the present accelerations acted on the velocities before that
  void endFirstHalf(const ForceStage<Scalar, Layout>& force, const Bodies& bodies, const Scalar& kick) {
    if (acted_) {
      bookKick(force, bodies, kick);
      firstHalf_.clear();
      firstHalfKeys_.clear();
      for (std::size_t k = 0; k < contacts_.size(); ++k) {
        firstHalfKeys_.push_back({contacts_[k].key1, contacts_[k].key2});
      }
      firstHalf_.assign(solver_.impulses().begin(), solver_.impulses().end());
    }
  }

  /// The bodies stand in a new order.
  void renumber(const Bodies& bodies) {
    for (Contact<Scalar>& c : contacts_) {
      c.first = static_cast<std::uint32_t>(bodies.indexOf(BodyId{c.key1}));
      if (c.second != staticPartner) {
        c.second = static_cast<std::uint32_t>(bodies.indexOf(BodyId{c.key2}));
      }
    }
    coloured_ = false;
    moved_ = false;
  }

  /// Impulses of both halves of the step [N s], in the order of contacts(). A contact that ended in the drift
  /// is not among them. O(contacts).
  std::vector<ContactImpulse<Scalar>> impulses() const {
    std::vector<ContactImpulse<Scalar>> sum;
    std::size_t m = 0;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
      sum.push_back(k < solver_.impulses().size() ? solver_.impulses()[k] : ContactImpulse<Scalar>{});
      const ContactKeys keys{contacts_[k].key1, contacts_[k].key2};
      while (m < firstHalf_.size() && firstHalfKeys_[m] < keys) {
        ++m;
      }
      if (m < firstHalf_.size() && firstHalfKeys_[m] == keys) {
        sum.back().normal += firstHalf_[m].normal;
        sum.back().tangential += firstHalf_[m].tangential;
        sum.back().turning += firstHalf_[m].turning;
      }
    }
    return sum;
  }

  void save(SnapshotWriter& out) const;
  /// \throws std::runtime_error, std::invalid_argument if the file does not hold what save() writes
  void load(SnapshotReader& in);

 private:
  /// The share of the first half step's impulses J in the work of gravity and the field over the step. Kicks
  /// do the work m a.(v before + v after) kick/2, and the drift takes it out of the potential at the velocity
  /// in between. What J changes in the drift and in all later kicks, but not in the first one, leaves
  /// -J.a kick: with it booked, what rests or rolls loses nothing over a step, to rounding, and the ledger
  /// closes to the order of the integrator. A hook's work is a mean over both ends and needs no share.
  void bookKick(const ForceStage<Scalar, Layout>& force, const Bodies& bodies, const Scalar& kick) {
    const auto fall = [&](std::uint32_t i) -> Vector3<Scalar> {
      return i == staticPartner
                 ? Vector3<Scalar>(Vector3<Scalar>::Zero())
                 : Vector3<Scalar>(force.conservativeForce(bodies, i) * bodies[i].inverseMass());
    };
    const std::span<const ContactImpulse<Scalar>> impulses = solver_.impulses();
    for (std::size_t k = 0; k < impulses.size(); ++k) {
      const ContactImpulse<Scalar>& j = impulses[k];
      if (j.normal > Scalar(0)) {
        const Contact<Scalar>& c = contacts_[k];
        const Vector3<Scalar> dv = (fall(c.second) - fall(c.first)) * kick;
        report_.restitutionLoss += j.normal * c.normal.dot(dv);
        report_.frictionLoss += j.tangential.dot(dv);
      }
    }
  }

  void colour(const Bodies& bodies, Profiler& profiler) {
    if (!coloured_) {
      const Profiler::Scope scope(profiler, Phase::Colouring);
      solver_.begin(contacts_, bodies);
      coloured_ = true;
    }
  }

  void renewGeometry(const Bodies& bodies, const Config& config, const Scalar& time) {
    parallelFor(contacts_.size(), 1024, [&](std::size_t k) {
      Contact<Scalar>& c = contacts_[k];
      const Vector3<Scalar> x1 = bodies.positions()[c.first];
      const Scalar r1 = bodies.radii()[c.first];
      if (c.second == staticPartner) {
        const HalfSpace<Scalar>& wall = *std::lower_bound(
            walls_.begin(), walls_.end(), c.key2 - boundaryKey(0),
            [](const HalfSpace<Scalar>& w, std::uint64_t number) { return w.number < number; });
        const Scalar gap = wall.normal.dot(x1) - wall.offset - r1;
        c.gap = c.gap > Scalar(0) ? gap : std::min<Scalar>(gap, Scalar(0));
        return;
      }
      Vector3<Scalar> r_12 = Vector3<Scalar>(bodies.positions()[c.second]) - x1;
      r_12 = domain.minimumImage(r_12, time);
      const Scalar r2 = bodies.radii()[c.second];
      // A margin, since a pair that was moved apart is a contact of this step all the same.
      const auto touch = sphereSphere<Scalar>(r_12, r1, r2, c.key1, c.key2, config.epsilon, r1 + r2);
      if (touch) {
        c.normal = touch->normal;
        c.gap = c.gap > Scalar(0) ? touch->gap : std::min<Scalar>(touch->gap, Scalar(0));
        c.arm1 = touch->arm1;
        c.arm2 = touch->arm2;
      }
    });
  }

  template <class Course>
  void strike(Bodies& bodies, const Config& config, Course& course, const Scalar& time, const Scalar& h,
              Profiler& profiler) {
    const auto way = [&](std::size_t i) -> Vector3<Scalar> {
      return detail::isMovable(bodies, i) ? Vector3<Scalar>(course.velocity(bodies, i) * h)
                                          : Vector3<Scalar>(Vector3<Scalar>::Zero());
    };
    search(bodies, config, time, way, profiler);
    searched_ = true;
    const Profiler::Scope scope(profiler, Phase::Impacts);
    prepareSurfaces(config);
    struct Near {
      NeighbourList<Scalar>& list;
      const decltype(way)& travel;
      const std::vector<Pair>& pairs() const { return list.pairs(); }
      std::uint64_t version() const { return list.version(); }
      void follow(const Bodies& all, std::uint32_t i, const Scalar&, std::vector<Pair>& out) {
        list.follow(i, all.positions(), all.radii(), all.ids(), travel(i), travel, out);
      }
    } near{neighbours_, way};
    const ImpactSettings<Scalar> settings{time, h, std::max(config.restitutionThreshold, config.epsilon),
                                          config.epsilon};
    const std::span<const Material<Scalar>> surfaces(materials.entries());
    const std::span<const HalfSpace<Scalar>> walls(walls_);
    const std::span<const Contact<Scalar>> held(contacts_);
    ImpactReport<Scalar> blows;
    if (collisionHook) {
      const auto decide = [&](const Impact<Scalar>& impact, const Material<Scalar>& material,
                              const Vector3<Scalar>& v1, const Vector3<Scalar>& v2,
                              const Vector3<Scalar>& v_rel) {
        const auto partner = [&](std::uint32_t i, std::uint64_t id, const Vector3<Scalar>& v) {
          return typename Collision<Scalar>::Partner{BodyId{id},
                                                     bodies.masses()[i],
                                                     bodies.radii()[i],
                                                     !detail::isMovable(bodies, i),
                                                     MaterialId{bodies.materials()[i]},
                                                     v,
                                                     Vector3<Scalar>(bodies.angularVelocities()[i])};
        };
        return collisionHook(Collision<Scalar>{
            Scalar(time + impact.time), partner(impact.first, impact.key1, v1),
            partner(impact.second, impact.key2, v2), impact.normal, v_rel, material, impact.speed});
      };
      blows = impacts_.resolve(bodies, near, domain, surfaces, walls, held, settings, nearBoundaries(bodies),
                               course, decide);
    } else {
      blows = impacts_.resolve(bodies, near, domain, surfaces, walls, held, settings, nearBoundaries(bodies),
                               course);
    }
    neighbours_.add(impacts_.candidatesAdded(), bodies.ids());
    for (const TurnChange<Scalar>& turn : impacts_.turns()) {
      // The drift turns the body by the new spin for all of h.
      auto&& q = bodies[turn.body].orientation();
      q = rotated(rotated(Quaternion<Scalar>(q), turn.before, turn.time), turn.after, Scalar(-turn.time));
    }
    report_.impacts += blows.impacts;
    report_.postponed += blows.postponed;
    report_.restitutionLoss += blows.restitutionLoss;
    report_.frictionLoss += blows.frictionLoss;
    report_.driftWork += blows.driftWork;
  }

  template <class Travel>
  void search(const Bodies& bodies, const Config& config, const Scalar& time, const Travel& travel,
              Profiler& profiler) {
    const Profiler::Scope scope(profiler, Phase::NeighbourSearch);
    neighbours_.setKind(config.broadPhase);
    Scalar largest(0);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      largest = std::max<Scalar>(largest, bodies.radii()[i]);
    }
    margin_ = Scalar(2) * largest * NarrowPhase<Scalar>::restingMargin();
    neighbours_.update(bodies.positions(), bodies.radii(), bodies.ids(), bodies.revision(), domain, time,
                       margin_, travel);
  }

  void prepareSurfaces(const Config& config) {
    const std::vector<Material<Scalar>>& surfaces = materials.renewed(config);
    walls_.clear();
    for (const Plane<Scalar>& plane : boundaries.planes()) {
      walls_.push_back({plane.normal, plane.offset, surfaces[static_cast<std::size_t>(plane.material)],
                        plane.velocity, plane.number});
    }
  }

  std::optional<std::span<const std::uint32_t>> nearBoundaries(const Bodies& bodies) {
    if (!domain.isOpen() || neighbours_.strays()) {
      return std::nullopt;
    }
    return nearWalls_.update(bodies.positions(), bodies.radii(), walls_, neighbours_.rebuilt(),
                             neighbours_.skin(), margin_);
  }

  /// Who was in contact at the step's start, or came to rest in it.
  void rememberResting() {
    resting_.clear();
    for (const Contact<Scalar>& c : contacts_) {
      resting_.push_back({c.key1, c.key2});
    }
    const auto old = static_cast<std::ptrdiff_t>(resting_.size());
    for (const Impact<Scalar>& impact : impacts_.impacts()) {
      if (impact.rests) {
        resting_.push_back({impact.key1, impact.key2});
      }
    }
    if (static_cast<std::ptrdiff_t>(resting_.size()) > old) {
      std::sort(resting_.begin() + old, resting_.end());
      std::inplace_merge(resting_.begin(), resting_.begin() + old, resting_.end());
      resting_.erase(std::unique(resting_.begin(), resting_.end()), resting_.end());
    }
  }

  const char* reasonToSkip(const Bodies& bodies) const {
    if (bodies.size() < 2 && boundaries.empty()) {
      return "one body and no boundary";
    }
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (Scalar(bodies.radii()[i]) > Scalar(0)) {
        return nullptr;
      }
    }
    return "no body has a radius";
  }

  std::vector<HalfSpace<Scalar>> walls_;
  NeighbourList<Scalar> neighbours_;
  BoundaryList<Scalar> nearWalls_;
  NarrowPhase<Scalar> narrow_;
  ImpactEvents<Scalar> impacts_;
  std::vector<ContactKeys> resting_;
  mutable std::vector<ContactKeys> struck_;
  Scalar margin_ = Scalar(0);  // of the neighbours: what rests may have a gap
  bool searched_ = false;      // neighbours_ hold for the whole drift
  std::vector<Contact<Scalar>> contacts_;
  ContactSolver<Scalar> solver_;
  std::vector<ContactKeys> firstHalfKeys_;
  std::vector<ContactImpulse<Scalar>> firstHalf_;
  ContactReport<Scalar> report_;
  bool moved_ = false;
  bool acted_ = false;     // the last solve changed velocities
  bool coloured_ = false;  // solver_ knows the present contacts
};

}  // namespace gravel
