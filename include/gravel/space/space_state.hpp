#pragma once

/// \file
/// Members of `Space` that look at its state, report it, save it and take it up again.

#include <gravel/output/snapshot.hpp>
#include <gravel/space/contact_stage_snapshot.hpp>
#include <gravel/space/space.hpp>

namespace gravel {

template <Real Scalar, class Layout>
Scalar Space<Scalar, Layout>::potentialEnergy() const {
  const HillFrame<Scalar> frame(contact_.domain);
  return force_.potentialEnergy(bodies_, getG(), this->config_.softening, contact_.domain, time_) +
         (frame.turns() ? frameEnergy(bodies_, frame) : Scalar(0));
}

template <Real Scalar, class Layout>
std::tuple<Scalar, Scalar, Scalar> Space<Scalar, Layout>::calculateSystemEnergy() const {
  EnergyLedger<Scalar> now;
  addKineticEnergy(bodies_, now);
  return {now.kinetic, now.rotational, potentialEnergy()};
}

template <Real Scalar, class Layout>
EnergyLedger<Scalar> Space<Scalar, Layout>::energyLedger() const {
  EnergyLedger<Scalar> ledger = left_;
  addKineticEnergy(bodies_, ledger);
  ledger.potential = potentialEnergy();
  return ledger;
}

template <Real Scalar, class Layout>
auto Space<Scalar, Layout>::getAllBodyTransforms() const
    -> std::tuple<std::vector<Vector>, std::vector<Quaternion<Scalar>>> {
  std::vector<Vector> positions(n());
  std::vector<Quaternion<Scalar>> orientations(n());
  for (std::size_t i = 0; i < n(); ++i) {
    positions[i] = bodies_[i].position();
    orientations[i] = Quaternion<Scalar>(bodies_[i].orientation());
  }
  return {std::move(positions), std::move(orientations)};
}

template <Real Scalar, class Layout>
auto Space<Scalar, Layout>::getDataForDisplay() const
    -> std::tuple<std::vector<Vector>, std::vector<Quaternion<Scalar>>, std::vector<Vector>,
                  std::vector<Vector>> {
  auto transforms = getAllBodyTransforms();
  std::vector<Vector> torques(n());
  std::vector<Vector> angularAccelerations(n());
  for (std::size_t i = 0; i < n(); ++i) {
    torques[i] = bodies_[i].torque();
    angularAccelerations[i] = bodies_[i].angularAcceleration();
  }
  return {std::move(std::get<0>(transforms)), std::move(std::get<1>(transforms)), std::move(torques),
          std::move(angularAccelerations)};
}

template <Real Scalar, class Layout>
ContactVirial<Scalar> Space<Scalar, Layout>::contactVirial() const {
  const auto touches = allTouches();
  return gravel::contactVirial<Scalar, Layout>(bodies_, touches.contacts, touches.impulses, previous_dt_);
}

template <Real Scalar, class Layout>
SupportedWeight<Scalar> Space<Scalar, Layout>::supportedWeight() const {
  const auto touches = allTouches();
  return gravel::supportedWeight<Scalar, Layout>(bodies_, touches.contacts, touches.impulses, previous_dt_,
                                                 force_.field);
}

template <Real Scalar, class Layout>
auto Space<Scalar, Layout>::planeForce(std::size_t plane) const -> Vector {
  (void)contact_.boundaries.at(plane);
  Vector impulse = Vector::Zero();
  const auto touches = allTouches();
  for (std::size_t k = 0; k < touches.contacts.size(); ++k) {
    if (touches.contacts[k].key2 == boundaryKey(plane)) {
      impulse += touches.impulses[k].normal * touches.contacts[k].normal + touches.impulses[k].tangential;
    }
  }
  return previous_dt_ > Scalar(0) ? Vector(impulse / previous_dt_) : impulse;
}

template <Real Scalar, class Layout>
std::vector<std::vector<std::size_t>> Space<Scalar, Layout>::collisionGraph() const {
  std::vector<std::vector<std::size_t>> graph(n());
  const auto touches = contact_.allTouches(bodies_);
  for (const Contact<Scalar>& c : touches.contacts) {
    if (c.second != staticPartner) {
      graph[c.first].push_back(c.second);
      graph[c.second].push_back(c.first);
    }
  }
  for (std::vector<std::size_t>& partners : graph) {  // a pair may touch more than once in a step
    std::sort(partners.begin(), partners.end());
    partners.erase(std::unique(partners.begin(), partners.end()), partners.end());
  }
  return graph;
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::logLine(const char* line) const {
  if (log_) {
    log_(line);
  } else {
    std::puts(line);
  }
}

/// Logs energies every logFrequency steps. Warns when the total of the ledger, which only the error of the
/// time integration changes, has moved by more than a tenth of the energy in play since the last line, or is
/// not finite. In a patch with gravity it moves by the work of the shear, which no shorter step makes less.
template <Real Scalar, class Layout>
void Space<Scalar, Layout>::logSystemEnergy(std::size_t iteration) {
  if (!this->config_.diagnosticsEnabled) {
    profiler_.skip(Phase::Diagnostics, "diagnosticsEnabled is off");
    return;
  }
  if (iteration % this->config_.logFrequency != 0) {
    profiler_.skip(Phase::Diagnostics, "between two lines of the log");
    return;
  }
  const Profiler::Scope scope(profiler_, Phase::Diagnostics);
  const EnergyLedger<Scalar> e = energyLedger();
  const Scalar total = e.total();
  const auto text = [](const Scalar& x) { return detail::formatReal(x); };
  logLine(("gravel: step " + std::to_string(iteration) + " t " + text(time_) + " s dt " + text(previous_dt_) +
           " s kinetic " + text(e.kinetic) + " J rotational " + text(e.rotational) + " J potential " +
           text(e.potential) + " J restitution " + text(e.restitution) + " J friction " + text(e.friction) +
           " J damping " + text(e.damping) + " J correction " + text(e.correction) + " J work " +
           text(e.work) + " J exchange " + text(e.exchange) + " J total " + text(total) + " J")
              .c_str());
  if (contactCount() > 0) {
    const ContactReport<Scalar>& report = contactReport();
    logLine(("gravel: step " + std::to_string(iteration) + " contacts " + std::to_string(contactCount()) +
             " sweeps " + std::to_string(report.iterations) + " residual " + text(report.residual) +
             (contact_.domain.isOpen() ? " virial residual " + text(contactVirial().residual()) : "") +
             " weight residual " + text(supportedWeight().residual()))
                .c_str());
  }
  const Scalar inPlay = e.kinetic + e.rotational + detail::sizeOf<Scalar>(e.potential);
  if (!isFinite(total)) {
    logLine("gravel: warning: the energy is not finite; the state cannot be trusted, take a shorter step");
  } else if (const bool closes = getG() == Scalar(0) || contact_.domain.shearSpeed() == Scalar(0);
             closes && isFinite(lastTotalEnergy_) &&
             detail::sizeOf<Scalar>(total - lastTotalEnergy_) > inPlay / Scalar(10)) {
    logLine(("gravel: warning: unstable: the energy ledger moved by " + text(total - lastTotalEnergy_) +
             " J since the last line, of " + text(inPlay) + " J in play; take a shorter step")
                .c_str());
  }
  lastTotalEnergy_ = total;
}

namespace detail {

/// The space's own numbers in a snapshot, in one order for writing and reading.
template <Real Scalar>
struct SpaceNumbers {
  Scalar dt, previous_dt, time, timeRest, lastTotalEnergy;
  EnergyLedger<Scalar> left;
  Vector3<Scalar> field;
  std::uint64_t steps, nextId;
  std::uint64_t ledgerOpen;
  std::uint64_t stale;  ///< forces and contacts are to be found anew before the next step

  template <class Visitor>
  void forEach(Visitor&& visit) {
    visit("dt", dt);
    visit("previous_dt", previous_dt);
    visit("time", time);
    visit("timeRest", timeRest);
    visit("lastTotalEnergy", lastTotalEnergy);
    visit("left", left);
    visit("field.x", field[0]);
    visit("field.y", field[1]);
    visit("field.z", field[2]);
    visit("steps", steps);
    visit("nextId", nextId);
    visit("ledgerOpen", ledgerOpen);
    visit("stale", stale);
  }

  /// \throws std::invalid_argument for what no space can have
  void validate() const {
    const auto require = [](bool good, const char* what, const Scalar& value, const char* allowed) {
      if (!good) {
        refuse(std::string(what) + " of a snapshot", formatReal(value), allowed);
      }
    };
    require(isFinite(dt) && dt > Scalar(0), "dt", dt, "finite, > 0");
    require(isFinite(previous_dt) && !(previous_dt < Scalar(0)), "previous_dt", previous_dt, "finite, >= 0");
    require(isFinite(time), "time", time, "finite");
    require(isFinite(timeRest), "timeRest", timeRest, "finite");
    for (int axis = 0; axis < 3; ++axis) {
      require(isFinite(field[axis]), "field", field[axis], "finite");
    }
  }
};

}  // namespace detail

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::save(
    const std::string& path) const requires std::is_trivially_copyable_v<Scalar> {
  SnapshotWriter out;
  forEachSetting(this->config_, [&](const Setting<Scalar>& setting, const auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, bool>) {
      out.value(std::string("setting ") + setting.name, static_cast<std::uint8_t>(value));
    } else {
      out.value(std::string("setting ") + setting.name, value);
    }
  });
  detail::SpaceNumbers<Scalar> numbers{
      dt_,
      previous_dt_,
      time_,
      timeRest_,
      lastTotalEnergy_,
      left_,
      force_.field,
      steps_,
      toInteger(bodies_.nextId()),
      ledgerOpen_ ? std::uint64_t{1} : std::uint64_t{0},
      !forcesValid_ || placesChanged() ? std::uint64_t{1} : std::uint64_t{0}};
  numbers.forEach([&](const char* name, const auto& value) { out.value(name, value); });
  contact_.save(out);
  sleep_.save(out);
  saveBodies(bodies_, out);
  const std::vector<Scalar> lost = lost_.lostParts(bodies_);
  out.array("lost parts", lost.data(), lost.size());
  const std::vector<Scalar> ofHook = force_.hookParts(n());
  out.array("forces of the hook", ofHook.data(), ofHook.size());
  orbits_.save(bodies_, out);
  out.write(path);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::restore(const std::string& path) requires std::is_trivially_copyable_v<Scalar> {
  this->inStep_.refuse("restore()");
  SnapshotReader in(path);
  SimulationConfig<Scalar> config;
  forEachSetting(config, [&]<class T>(const Setting<Scalar>& setting, T& value) {
    using Stored = std::conditional_t<std::is_same_v<T, bool>, std::uint8_t, T>;
    value = static_cast<T>(in.value<Stored>(std::string("setting ") + setting.name));
  });
  config.validate();
  detail::SpaceNumbers<Scalar> numbers{};
  numbers.forEach([&]<class T>(const char* name, T& value) { value = in.value<T>(name); });
  numbers.validate();
  ContactStage<Scalar, Layout> contact;
  contact.load(in);
  detail::requireFewImages(contact.domain, config.G);
  SleepStage<Scalar, Layout> sleep;
  sleep.load(in);
  gravel::Bodies<Scalar, SoA> bodies = loadBodies<Scalar>(in);
  contact.materials.check(bodies);
  bodies.skipIds(BodyId{numbers.nextId});
  const std::vector<Scalar> lost = in.finite<Scalar>("lost parts");
  const std::vector<Scalar> ofHook = in.finite<Scalar>("forces of the hook");
  if (!ofHook.empty() && ofHook.size() != 3 * bodies.size()) {
    in.fail("holds lists of different lengths");
  }
  OrbitStage<Scalar, Layout> orbits;
  orbits.load(bodies, in);
  in.requireEnd();

  // Nothing throws from here on but for want of memory.
  bodies_.assign(bodies);
  lost_.setLostParts(bodies_, lost);
  orbits_ = std::move(orbits);
  this->config_ = config;
  contact.collisionHook = std::move(contact_.collisionHook);
  contact_ = std::move(contact);
  sleep_ = std::move(sleep);
  force_.gravity.setKind(config.gravity);
  force_.gravity.setTolerance(config.gravityTolerance);
  force_.field = numbers.field;
  force_.setHookParts(ofHook);
  colors_.clear();
  dt_ = numbers.dt;
  previous_dt_ = numbers.previous_dt;
  parts_ = 1;
  time_ = numbers.time;
  timeRest_ = numbers.timeRest;
  lastTotalEnergy_ = numbers.lastTotalEnergy;
  left_ = numbers.left;
  steps_ = static_cast<std::size_t>(numbers.steps);
  ledgerOpen_ = numbers.ledgerOpen != 0;
  const bool complete = contact_.renumber(bodies_);
  rememberPlaces();
  forcesValid_ = numbers.stale == 0 && complete;  // else contacts are found anew
  if (!force_.hook) {
    force_.clearTorques(bodies_);
  }
  if (numbers.stale == 0 && static_cast<bool>(force_.hook) == ofHook.empty() && n() > 0) {
    setForceHook(std::move(force_.hook));  // it works in place of that of the file, or of none there
  }
}

}  // namespace gravel
