#include "summary.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>

namespace gravel::runner {

namespace {

std::string capital(std::string text) {
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

std::string percent(double share) {
  return share > 0.9995 ? "100 %" : format(share < 0.1 ? "%.2g %%" : "%.1f %%", 100.0 * share);
}

/// Contacts that a body has on average; one between two bodies counts for both.
double contactsPerBody(const Space<double>& space) {
  std::size_t sides = 0;
  for (const Contact<double>& contact : space.contacts()) {
    sides += contact.second == staticPartner ? 1 : 2;
  }
  return static_cast<double>(sides) / static_cast<double>(space.n());
}

std::size_t bodiesAtStart(const Scene& scene) { return scene.config.bodyCount + scene.bodies.size(); }

/// Sentences on what the contacts built. At the end there are those that last: not the blows of the last
/// step, which are over.
void addContacts(std::string& text, const Scene& scene, const Space<double>& space, const History& history) {
  const std::size_t n = space.n();
  if (history.mostContacts == 0) {
    text += n < bodiesAtStart(scene) ? "" : "Nothing touched.\n";
    return;
  }
  const std::size_t atEnd = space.contacts().size();
  text += capital(counted(atEnd, "contact", "contacts")) + " at the end" +
          format(" (%.1f a body; most at once: %zu)", contactsPerBody(space), history.mostContacts);
  if (atEnd > 0) {
    text += format(", the deepest overlap is %.1e of a radius", deepestOverlap(space));
  }
  text += ".\n";
  std::size_t asleep = 0;
  for (const auto body : space.bodies()) {
    asleep += body.isAsleep() ? 1 : 0;
  }
  if (asleep > 0) {
    text += format("%zu of %zu bodies sleep; their own contacts are not counted.\n", asleep, n);
  }
  if (!(space.getG() > 0.0) || asleep > 0) {
    return;
  }
  const Cluster pile = largestCluster(space);
  if (pile.bodies >= 10) {
    text +=
        format("The largest pile holds %zu of %zu bodies and %s of the mass; it measures about %s x %s x %s",
               pile.bodies, n, percent(pile.mass / space.conserved().mass).c_str(),
               sceneLength(pile.axes[0], scene.units).c_str(), sceneLength(pile.axes[1], scene.units).c_str(),
               sceneLength(pile.axes[2], scene.units).c_str()) +
        format(", and its bodies fill %.0f %% of that.\n", 100.0 * pile.filling);
    const double left = history.peakMotion > 0.0 ? pile.internalMotion / history.peakMotion : 0.0;
    if (pile.angularSpeed > 0.0) {
      text += "It turns once in " + sceneTime(2.0 * pi<double>() / pile.angularSpeed, scene.units) +
              (left < 1e-4 ? " and has come to rest otherwise" : " and its bodies still move") +
              format(": their motion against each other holds %.1e of the most kinetic energy seen.\n", left);
    }
  }
}

void addOrbits(std::string& text, const Scene& scene, const Space<double>& space) {
  const std::size_t n = space.n();
  std::size_t heaviest = 0;
  for (std::size_t i = 1; i < n; ++i) {
    heaviest = space.body(i).mass() > space.body(heaviest).mass() ? i : heaviest;
  }
  const auto name = [&](std::size_t i) {
    const SceneBody* known = sceneBody(scene, space.body(i).id());
    return known != nullptr && !known->name.empty() ? known->name
                                                    : "body " + std::to_string(toInteger(space.body(i).id()));
  };
  std::string lines;
  for (std::size_t i = 0; i < n; ++i) {
    const std::optional<std::size_t> centre = i == heaviest ? std::nullopt : centreOf(space, i, heaviest);
    if (centre && !space.body(i).isFixed()) {
      const Orbit orbit = orbitAbout(space, i, *centre);
      lines += format("  %-10s", name(i).c_str());
      lines += *centre == heaviest ? "" : " about " + name(*centre) + ":";
      lines += std::isnan(orbit.period)
                   ? " flies past\n"
                   : format(" semi-major axis %.4g %s, eccentricity %.4f, period %s\n", orbit.semiMajorAxis,
                            scene.units.length.c_str(), orbit.eccentricity,
                            sceneTime(orbit.period, scene.units).c_str());
    }
  }
  text += lines.empty() ? "" : "Orbits about " + name(heaviest) + ":\n" + lines;
}

/// WisdomHolman takes no other step than timeStep, nor does Hermite4, which gives each body steps within it.
bool hasEqualSteps(const SimulationConfig<double>& config) {
  return !config.adaptiveTimeStep || config.integrator == IntegratorKind::WisdomHolman ||
         config.integrator == IntegratorKind::Hermite4;
}

/// What gravity alone holds: nothing is said where images pull as well, or a field and walls act.
void addGravity(std::string& text, const Scene& scene, const Space<double>& space, const History& history) {
  const bool alone =
      space.domain().isOpen() && space.planes().empty() && space.uniformField() == Vector3<double>::Zero();
  if (!(space.getG() > 0.0) || space.n() < 2 || space.n() > 30000 || !alone) {
    return;
  }
  if (space.n() > 20 || history.mostContacts > 0) {
    text += "Bound by gravity: " + percent(boundFraction(space)) +
            " of the mass, by speeds about the common centre of mass.\n";
  } else {
    addOrbits(text, scene, space);
  }
}

/// What contacts and damping took, by process. Where bodies are jammed into each other one may put in what
/// another takes: that is no share of the loss.
void addLosses(std::string& text, const History& h) {
  struct Part {
    double energy;
    const char* what;
  };
  const EnergyLedger<double> taken = h.taken();
  const std::array<Part, 3> parts{Part{taken.restitution, "inelastic hits"}, Part{taken.friction, "friction"},
                                  Part{taken.damping, "damping"}};
  double lost = 0.0;
  for (const Part& part : parts) {
    lost += std::max(part.energy, 0.0);
  }
  std::string list;
  for (const Part& part : parts) {
    if (part.energy > 5e-4 * lost) {
      list +=
          format(list.empty() ? " %s took %.1f %%" : ", %s %.1f %%", part.what, 100.0 * part.energy / lost);
    }
  }
  if (lost > 1e-12 * h.inPlay) {
    text += "Of the energy that was lost," + list + ".\n";
  }
  for (const Part& part : parts) {
    if (part.energy < -1e-6 * h.inPlay) {
      text += capital(part.what) + format(" put in %.1e of the energy in play.\n", -part.energy / h.inPlay);
    }
  }
  if (std::abs(taken.correction) > 1e-6 * h.inPlay) {
    text += format("Pushing overlaps apart %s %.1e of the energy in play.\n",
                   taken.correction < 0.0 ? "put in" : "took", std::abs(taken.correction) / h.inPlay);
  }
}

void addEnergy(std::string& text, const History& h) {
  const double motion = h.last.kinetic + h.last.rotational;
  addLosses(text, h);
  if (h.peakMotion < 1e-9 * h.inPlay) {
    text += format("Nothing moved to speak of: the most kinetic energy seen is %.1e of the energy in play.\n",
                   h.peakMotion / h.inPlay);
  } else if (h.peakMotion > 0.0) {
    const double left = motion / h.peakMotion;
    text += format(h.isAtRest() ? "All has come to rest: %.1e of the most kinetic energy seen is left.\n"
                                : "%.2g of the most kinetic energy seen is left.\n",
                   left);
  }
  text +=
      format(h.closes ? "The energy ledger is off by %.1e of the energy in play at the end, %.1e at most.\n"
                      : "The energy ledger moved by %.1e of the energy in play at the end, %.1e at most, the "
                        "work of the shear by gravity among it.\n",
             std::abs(h.drift()), h.worstDrift);
  if (!h.isToBeTrusted()) {
    text += "This run is not to be trusted: energy came from nothing or was lost. Take a shorter timeStep.\n";
  }
}

}  // namespace

std::string summary(const Scene& scene, const Space<double>& space, const History& history,
                    const RunFacts& facts) {
  std::string text;
  text += (facts.interrupted ? "Stopped early. " : "") + counted(space.n(), "body", "bodies") +
          format(" of %.4g %s together, followed for %s in %s of %s.\n", space.conserved().mass,
                 scene.units.mass.c_str(), sceneTime(space.time(), scene.units).c_str(),
                 counted(space.steps(), "step", "steps").c_str(),
                 hasEqualSteps(space.config()) ? "equal length" : "changing length");
  const std::size_t atStart = bodiesAtStart(scene);
  if (space.n() < atStart) {
    text += counted(atStart - space.n(), "body", "bodies") + format(" of %zu merged into others.\n", atStart);
  }
  if (facts.begin > 0.0) {
    text += "Taken up at " + sceneTime(facts.begin, scene.units) +
            ": contacts, losses and drift below are those since then.\n";
  }
  if (history.mostParts > 1) {
    text +=
        format("Contacts were solved in %.3g parts of a step, %zu at most.\n",
               static_cast<double>(history.parts) / static_cast<double>(history.steps), history.mostParts);
  }
  if (history.isFinite) {
    addContacts(text, scene, space, history);
    addGravity(text, scene, space, history);
    addEnergy(text, history);
  } else {
    text += std::string(notFinite) + "\n";
  }
  text += format("That took %s with %s: %.0f steps a second.\n", wallTime(facts.seconds).c_str(),
                 counted(static_cast<std::size_t>(facts.threads), "thread", "threads").c_str(),
                 static_cast<double>(history.steps) / std::max(facts.seconds, 1e-9));
  return text;
}

}  // namespace gravel::runner
