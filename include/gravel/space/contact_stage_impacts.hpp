#pragma once

/// \file
/// Members of `ContactStage` that deal the impacts inside a step, and those with which it begins.

#include <gravel/contact/contact_islands.hpp>
#include <gravel/dynamics/epicycle_course.hpp>
#include <gravel/space/contact_stage.hpp>

namespace gravel {

namespace detail {

/// How bodies go through a step of length h, for a NeighbourList.
template <class B, class Course, class Support, Real Scalar>
struct StepWays {
  const B& bodies;
  const Course& course;
  const Support& support;
  Scalar h;

  Vector3<Scalar> operator()(std::size_t i) const {
    return isMovable(bodies, i) ? Vector3<Scalar>(course.velocity(bodies, i) * h)
                                : Vector3<Scalar>(Vector3<Scalar>::Zero());
  }
  Vector3<Scalar> bend(std::size_t i) const {
    if (!isMovable(bodies, i)) {
      return Vector3<Scalar>::Zero();
    }
    Vector3<Scalar> a = course.acceleration(bodies, i);
    if constexpr (!std::is_same_v<Support, NoSupport>) {
      a += support(static_cast<std::uint32_t>(i));
    }
    return a * (h * h / Scalar(8));
  }
  Scalar mostBend(std::size_t i) const {
    if (!isMovable(bodies, i)) {
      return Scalar(0);
    }
    Scalar a = sumAbs(Vector3<Scalar>(course.acceleration(bodies, i)));
    if constexpr (!std::is_same_v<Support, NoSupport>) {
      a += support.most();
    }
    return a * (h * h / Scalar(8));
  }
};

/// The same where blows may have lifted bodies off what holds them.
template <class B, class Course, class Support, Real Scalar>
struct WaysAfterBlows {
  const StepWays<B, Course, Support, Scalar>& ways;

  Vector3<Scalar> operator()(std::size_t i) const { return ways(i); }
  Vector3<Scalar> bend(std::size_t i) const { return ways.bend(i); }
  Vector3<Scalar> otherBend(std::size_t i) const {
    return StepWays<B, Course, NoSupport, Scalar>{ways.bodies, ways.course, NoSupport{}, ways.h}.bend(i);
  }
};

}  // namespace detail

/// The solve after the first kick would give back e times what the kick brings as well: a ball that touches
/// the floor and falls at u left it at e u + (1 + e) g h/2. So it is made before the kick, of the islands in
/// which there is such a blow, and with a solver of its own: what rests is to be told nothing of it, and the
/// impulses that bear its weight are to stay.
template <Real Scalar, class Layout>
bool ContactStage<Scalar, Layout>::strikeTouching(Bodies& bodies, const Config& config, const Scalar& h,
                                                  Profiler& profiler) {
  if (!std::exchange(anew_, false) || contacts_.empty()) {
    return false;
  }
  drivePlanes(bodies, Scalar(0), h);
  const auto fall = [&](std::uint32_t i) {
    return detail::isMovable(bodies, i) ? detail::safeNorm(Vector3<Scalar>(bodies.accelerations()[i]))
                                        : Scalar(0);
  };
  const Scalar slow = std::max(config.restitutionThreshold, config.epsilon);
  const auto isBlow = [&](const Contact<Scalar>& c) {  // faster than what rests approaches
    const ContactSurface<Scalar>& surface = contacts_.surface(c);
    Vector3<Scalar> v_rel = surface.drift - detail::velocityOf(bodies, c.first);
    Scalar falls = fall(c.first);
    if (c.second != staticPartner) {
      v_rel += detail::velocityOf(bodies, c.second);
      falls += fall(c.second);
    }
    return falls > Scalar(0) && -c.normal.dot(v_rel) > slow + Scalar(2) * (surface.driftChange + falls * h);
  };
  if (std::none_of(contacts_.begin(), contacts_.end(), isBlow)) {
    return false;
  }
  const Profiler::Scope scope(profiler, Phase::ContactSolve);
  ContactIslands islands;
  islands.find(std::span<const Contact<Scalar>>(contacts_.contacts), bodies);
  const auto islandOf = [&](const Contact<Scalar>& c) {
    return islands.of(detail::isMovable(bodies, c.first) || c.second == staticPartner ? c.first : c.second);
  };
  std::vector<std::uint8_t> struck(bodies.size(), 0);
  for (const Contact<Scalar>& c : contacts_) {
    if (isBlow(c)) {
      struck[islandOf(c)] = 1;
    }
  }
  ContactList<Scalar> blows{{}, contacts_.surfaces};
  std::copy_if(contacts_.begin(), contacts_.end(), std::back_inserter(blows.contacts),
               [&](const Contact<Scalar>& c) { return struck[islandOf(c)] != 0; });
  ContactSolver<Scalar> solver;
  solver.setSettings(settingsOf(config, blows.size(), false));
  solver.begin(blows, bodies);
  findBends(bodies, Scalar(0));
  report_.addSolve(solver.solve(bodies, h, {false, bend_, domain.omega(), h / Scalar(2), carried_}));
  report_.contacts = 0;  // the step's first solve is still to come
  const std::span<const ContactImpulse<Scalar>> impulses = solver.impulses();
  record_.add([&](auto&& visit) {
    for (std::size_t k = 0; k < blows.size(); ++k) {
      visit(blows[k], impulses[k]);
    }
  });
  return true;
}

template <Real Scalar, class Layout>
ContactSettings<Scalar> ContactStage<Scalar, Layout>::settingsOf(const Config& config, std::size_t contacts,
                                                                 bool remembers) const {
  ContactSettings<Scalar> settings = solver_.settings();
  settings.restitutionThreshold = std::max(config.restitutionThreshold, config.epsilon);
  settings.tolerance = config.contactTolerance;
  settings.gapStep = gapStep_;
  limitSweeps(settings, config.contactIterations, contacts, remembers);
  return settings;
}

template <Real Scalar, class Layout>
bool ContactStage<Scalar, Layout>::foresees(const Bodies& bodies, const Config& config, const Scalar& time,
                                            const Scalar& h, Profiler& profiler) {
  if (!contacts_.empty()) {
    return true;
  }
  if (reasonToSkip(bodies) != nullptr) {
    return false;
  }
  const FlightFromStart<Scalar> course{h};
  search(bodies, config, time,
         detail::StepWays<Bodies, FlightFromStart<Scalar>, NoSupport, Scalar>{bodies, course, NoSupport{}, h},
         h, profiler);
  const Profiler::Scope scope(profiler, Phase::Impacts);
  prepareSurfaces(config);
  return impacts_.foresees(bodies, neighbours_.pairs(), domain, walls_, {time, h}, nearBoundaries(bodies, h),
                           course);
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::strike(Bodies& bodies, const Config& config,
                                          const HillFrame<Scalar>& frame, const Scalar& time, const Scalar& h,
                                          const PartOfStep<Scalar>& part, Profiler& profiler) {
  const char* reason = reasonToSkip(bodies);
  if (reason != nullptr) {
    profiler.skip(Phase::Impacts, reason);
    return;
  }
  if (frame.turns()) {
    EpicycleCourse<Scalar> course(frame, h);
    course.foresee(bodies);
    strike(bodies, config, course, time, h, part, profiler);
  } else {
    StraightCourse<Scalar> course;
    strike(bodies, config, course, time, h, part, profiler);
  }
}

template <Real Scalar, class Layout>
template <class Course>
void ContactStage<Scalar, Layout>::strike(Bodies& bodies, const Config& config, Course& course,
                                          const Scalar& time, const Scalar& h, const PartOfStep<Scalar>& part,
                                          Profiler& profiler) {
  struct Support {
    const ContactSolver<Scalar>& solver;
    const Bodies& bodies;
    Scalar h;
    bool none;  // the solver may know of others than these
    std::span<const Scalar> speedUps;
    Scalar carried(std::uint32_t i) const { return speedUps.empty() ? Scalar(0) : speedUps[i]; }
    Vector3<Scalar> any(std::uint32_t i) const {
      return none ? Vector3<Scalar>(Vector3<Scalar>::Zero())
                  : Vector3<Scalar>(solver.changeOf(i) * (Scalar(2) / h));
    }
    Scalar fall(std::uint32_t i) const {
      return none || !solver.knows(i) ? detail::safeNorm(Vector3<Scalar>(bodies.accelerations()[i]))
                                      : solver.fallOf(i);
    }
    // Contacts that bear a body change its velocity by what it falls in half a step; those that stop it, by
    // more.
    Vector3<Scalar> operator()(std::uint32_t i) const {
      const Vector3<Scalar> held = any(i);
      return detail::safeNorm(held) > Scalar(2) * fall(i) ? Vector3<Scalar>(Vector3<Scalar>::Zero()) : held;
    }
    // Of any, along the axes in sum.
    Scalar most() const { return none ? Scalar(0) : Scalar(Scalar(4) * solver.mostFall()); }
  } support{solver_, bodies, h, contacts_.empty(), carried_};
  const detail::StepWays<Bodies, Course, Support, Scalar> ways{bodies, course, support, h};
  search(bodies, config, time, ways, h, profiler);
  searched_ = true;
  const Profiler::Scope scope(profiler, Phase::Impacts);
  prepareSurfaces(config, part);
  struct Near {
    NeighbourList<Scalar>& list;
    const detail::WaysAfterBlows<Bodies, Course, Support, Scalar> travel;
    const std::vector<Pair>& pairs() const { return list.pairs(); }
    std::uint64_t version() const { return list.version(); }
    void follow(const Bodies& all, std::uint32_t i, const Scalar& t, std::vector<Pair>& out) {
      list.follow(i, all.positions(), detail::RestingReaches<Bodies>{all}, all.ids(), travel(i), travel, out,
                  Scalar(t / travel.ways.h));
    }
  } near{neighbours_, {ways}};
  const ImpactSettings<Scalar> settings{time, h, std::max(config.restitutionThreshold, config.epsilon),
                                        config.epsilon};
  const MaterialView<Scalar> surfaces = materials.view();
  const std::span<const HalfSpace<Scalar>> walls(walls_);
  const std::span<const ContactName> held = names();
  ImpactReport<Scalar> blows;
  if (collisionHook) {
    const auto decide = [&](const Impact<Scalar>& impact, const Material<Scalar>& material,
                            const Vector3<Scalar>& v1, const Vector3<Scalar>& v2,
                            const Vector3<Scalar>& v_rel) {
      const auto partner = [&](std::uint32_t i, std::uint64_t id, const Vector3<Scalar>& v) {
        const Vector3<Scalar> start = detail::spinOf(bodies, i);
        const bool movable = detail::isMovable(bodies, i);
        const Vector3<Scalar> w =
            movable ? Vector3<Scalar>(course.spinAt(start, impact.time) +
                                      detail::spinByTorque<Scalar>(bodies, i, impact.time, h))
                    : start;
        return typename Collision<Scalar>::Partner{
            BodyId{id}, bodies.masses()[i], bodies.radii()[i], !movable, bodies[i].material(), v, w};
      };
      return detail::outcomeOf(
          collisionHook, Collision<Scalar>{Scalar(time + impact.time), partner(impact.first, impact.key1, v1),
                                           partner(impact.second, impact.key2, v2), impact.normal, v_rel,
                                           material, impact.speed});
    };
    blows = impacts_.resolve(bodies, near, domain, surfaces, walls, held, settings, nearBoundaries(bodies, h),
                             course, decide, support);
  } else {
    blows = impacts_.resolve(bodies, near, domain, surfaces, walls, held, settings, nearBoundaries(bodies, h),
                             course, NoDecision{}, support);
  }
  neighbours_.add(impacts_.candidatesAdded(), bodies.ids());
  const Vector3<Scalar> frame = course.frameSpin();
  for (const TurnChange<Scalar>& turn : impacts_.turns()) {
    // The drift turns the body by the new spin for all of h.
    auto&& q = bodies[turn.body].orientation();
    const Vector3<Scalar> before = turn.before + frame;
    const Vector3<Scalar> after = turn.after + frame;
    q = rotated(rotated(Quaternion<Scalar>(q), before, turn.time), after, Scalar(-turn.time));
  }
  if (!impacts_.impacts().empty()) {
    findCarried(bodies, Scalar(h / part.length), impacts_.impacts());
  }
  report_.impacts += blows.impacts;
  report_.postponed += blows.postponed;
  grazed_ = blows.grazes > 0;
  report_.restitutionLoss += blows.restitutionLoss;
  report_.frictionLoss += blows.frictionLoss;
  report_.driftWork += blows.driftWork;
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::keepBlows(const Bodies& bodies, const Scalar& start) {
  late_.take(impacts_.impacts(), bodies, start, record_.impacts().size());
}

template <Real Scalar, class Layout>
template <class Change>
Scalar ContactStage<Scalar, Layout>::makeUpBlows(Bodies& bodies, const Scalar& time, const Scalar& h,
                                                 Change&& change) {
  const std::size_t before = record_.impacts().size();
  const auto impulseOf = [&](std::size_t k) -> ContactImpulse<Scalar>& {
    return k < before ? record_.impacts()[k].impulse : impacts_.impacts()[k - before].impulse;
  };
  const auto made = late_.makeUp(bodies, domain, time, h, impulseOf, change);
  report_.restitutionLoss += made.restitutionLoss;
  report_.frictionLoss += made.frictionLoss;
  return made.work;
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::tellChanges(const Bodies& bodies, const Scalar& kick,
                                               ContactKicks<Scalar>& kicks) const {
  const Vector3<Scalar> zero = Vector3<Scalar>::Zero();
  kicks.velocities.resize(bodies.size());
  kicks.spins.resize(bodies.size());
  parallelFor(bodies.size(), detail::bodyGrain, [&](std::size_t i) {
    const auto body = static_cast<std::uint32_t>(i);
    const bool touches = solver_.knows(body);
    kicks.velocities[i] = touches ? solver_.changeOf(body) : zero;
    kicks.spins[i] = touches ? solver_.turnOf(body) : zero;
  });
  // A blow is not dealt once more: of these bodies the present velocities are shown.
  const auto& rows = solver_.coloring().rows();
  for (std::size_t r = 0; acted_ && r < rows.size(); ++r) {
    if (!solver_.isBlow(r)) {
      continue;
    }
    for (const std::uint32_t i : {contacts_[rows[r].contact].first, contacts_[rows[r].contact].second}) {
      if (i != staticPartner && detail::isMovable(bodies, i)) {
        kicks.velocities[i] = -kick * Vector3<Scalar>(bodies.accelerations()[i]);
        kicks.spins[i] = -kick * Vector3<Scalar>(bodies.angularAccelerations()[i]);
      }
    }
  }
}

}  // namespace gravel
