#pragma once

/// \file
/// Members of `Space` that set a scene up or change it.

#include <gravel/space/space.hpp>
#include <gravel/spatial/morton.hpp>

namespace gravel {

template <Real Scalar, class Layout>
Space<Scalar, Layout>::Space(const SimulationConfig<Scalar>& config)
    : Space(config, typename Bodies::Storage()) {}

template <Real Scalar, class Layout>
Space<Scalar, Layout>::Space(const SimulationConfig<Scalar>& config, typename Bodies::Storage storage)
    : Settings<Scalar>(config), bodies_(std::move(storage)), dt_(config.timeStep) {
  force_.gravity.setKind(config.gravity);
  force_.gravity.setTolerance(config.gravityTolerance);
  initializeBodies(config.bodyCount, config.density, config.seed);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::initializeBodies(std::size_t n, Scalar dens, unsigned int seed) {
  using std::sqrt;
  bodies_.reserve(bodies_.size() + n);
  // A tenth of the escape speed from a ball of 2 m cbrt(n) of which an eighth is filled, which is about an
  // eighth of that from the surface of the bodies as they lie (0.121 for many, 0.13 to 0.14 for n = 100):
  // bound, but not at rest. 0.1 m/s without gravity.
  const Scalar radius = Scalar(2) * Scalar(std::cbrt(static_cast<double>(n)));
  const Scalar speed = getG() == Scalar(0)
                           ? Scalar(0.1)
                           : Scalar(radius * sqrt(getG() * dens * pi<Scalar>() / Scalar(3)) / Scalar(10));
  for (const Body<Scalar>& body : randomBodies<Scalar>(n, dens, speed, seed)) {
    bodies_.add(body);
  }
}

template <Real Scalar, class Layout>
std::size_t Space<Scalar, Layout>::checkedIndex(std::size_t i) const {
  if (i >= n()) {
    throw std::out_of_range("gravel: body index is " + std::to_string(i) +
                            "; allowed: below n() = " + std::to_string(n()));
  }
  return i;
}

template <Real Scalar, class Layout>
BodyId Space<Scalar, Layout>::addBody(const Body<Scalar>& body) {
  this->inStep_.refuse("addBody()");
  contact_.materials.check(static_cast<std::uint32_t>(body.material), "the new body");
  Scalar energy(0);
  const BodyId id = bodies_.add(body, bodies_.nextId(), [&](std::size_t i) {
    // Throws if another body is not what it may be.
    energy = ledgerOpen_ ? bindingEnergy(i, time_, getG()) : energy;
  });
  left_.exchange -= energy;
  forcesValid_ = false;
  return id;
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::removeBody(BodyId id) {
  this->inStep_.refuse("removeBody()");
  const std::size_t i = bodies_.indexOf(id);
  bool known = ledgerOpen_;
  for (std::size_t k = 0; known && !(getG() == Scalar(0)) && k < n(); ++k) {
    const Scalar m = bodies_.masses()[k];
    known = isFinite(Vector(bodies_.positions()[k])) && isFinite(m) && m >= Scalar(0);
  }
  const Scalar energy = known ? bindingEnergy(i, time_, getG()) : Scalar(0);
  bodies_.remove(id);
  if (isFinite(energy)) {  // who has written what is no number must be able to get rid of it
    left_.exchange += energy;
  }
  forcesValid_ = false;
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::reorderBodies() {
  this->inStep_.refuse("reorderBodies()");
  forcesValid_ = forcesValid_ && !placesChanged();
  const std::vector<std::size_t> order = mortonOrder(bodies_.positions());
  auto ofHook = force_.hookForcesIn(order);
  contact_.suspend();
  bodies_.reorder(order);  // nothing asks for memory from here on
  force_.setHookForces(std::move(ofHook));
  contact_.renumber(bodies_);
  if (forcesValid_) {  // they moved along with their bodies
    rememberPlaces();
  }
}

template <Real Scalar, class Layout>
std::size_t Space<Scalar, Layout>::addPlane(const Vector& normal, Scalar offset, MaterialId material) {
  this->inStep_.refuse("addPlane()");
  contact_.materials.check(static_cast<std::uint32_t>(material), "the new plane");
  const std::size_t number = contact_.boundaries.add(makePlane(normal, offset, material));
  wakeAll();
  forcesValid_ = false;  // contacts are looked for again before the next step
  return number;
}

template <Real Scalar, class Layout>
std::vector<std::size_t> Space<Scalar, Layout>::addBox(const Vector& low, const Vector& high,
                                                       MaterialId material, BoxFaces open) {
  this->inStep_.refuse("addBox()");
  contact_.materials.check(static_cast<std::uint32_t>(material), "the new box");
  const auto faces = makeBox(low, high, material, open);
  std::vector<std::size_t> numbers;
  numbers.reserve(faces.size());
  contact_.boundaries.makeRoom(faces.size());  // nothing asks for memory from here on
  for (const Plane<Scalar>& face : faces) {
    numbers.push_back(contact_.boundaries.add(face));
  }
  wakeAll();
  forcesValid_ = false;
  return numbers;
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::removePlane(std::size_t plane) {
  this->inStep_.refuse("removePlane()");
  contact_.boundaries.remove(plane);
  wakeAll();
  forcesValid_ = false;
}

template <Real Scalar, class Layout>
MaterialId Space<Scalar, Layout>::addMaterial(const Material<Scalar>& material) {
  this->inStep_.refuse("addMaterial()");
  return contact_.materials.add(material);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::setPairMaterial(MaterialId a, MaterialId b, const Material<Scalar>& material) {
  this->inStep_.refuse("setPairMaterial()");
  contact_.materials.setPair(a, b, material);
  wakeAll();
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::setUniformField(const Vector& g) {
  this->inStep_.refuse("setUniformField()");
  if (!isFinite(g)) {
    detail::refuse("uniform field", detail::formatVector(g), "finite");
  }
  if (ledgerOpen_) {  // what pulls each other is as it was; a place that is no number had no energy before
    left_.exchange += orderedSum(n(), 1024, Scalar(0), [&](std::size_t begin, std::size_t end) {
      Scalar part(0);
      for (std::size_t i = begin; i < end; ++i) {
        const auto body = std::as_const(bodies_)[i];
        const Scalar lost = Scalar(body.mass()) * Vector(g - force_.field).dot(Vector(body.position()));
        part += !body.isFixed() && isFinite(lost) ? lost : Scalar(0);
      }
      return part;
    });
  }
  force_.field = g;
  wakeAll();
  forcesValid_ = false;
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::setLog(Callback<void(const char*)> log) {
  this->inStep_.refuse("setLog()");
  log_ = std::move(log);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::setForceHook(ForceHook<Scalar, Layout> hook) {
  this->inStep_.refuse("setForceHook()");
  force_.hook = std::move(hook);
  wakeAll();
  if (!force_.hook) {
    force_.clearTorques(bodies_);
  }
  forcesValid_ = false;
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::checkIntegratorIn(const Domain<Scalar>& domain) const {
  if (domain.kind() == DomainKind::ShearPeriodic &&
      this->config_.integrator != IntegratorKind::SymplecticEpicycle) {
    detail::refuse("domain", "shear-periodic",
                   std::string("open or periodic with the integrator ") +
                       traitsOf(this->config_.integrator).name + "; shear-periodic with SymplecticEpicycle");
  }
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::setDomain(const Domain<Scalar>& domain) {
  this->inStep_.refuse("setDomain()");
  checkIntegratorIn(domain);
  detail::requireFewImages(domain, getG());
  const bool turns = HillFrame<Scalar>(domain).turns() || HillFrame<Scalar>(contact_.domain).turns();
  if (turns || !(getG() == Scalar(0))) {
    changePotential(contact_.domain, domain);
  } else {
    contact_.domain = domain;
    wakeAll();
    forcesValid_ = false;  // contacts are looked for again before the next step
  }
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::setG(Scalar g) {
  this->inStep_.refuse("setG()");
  SimulationConfig<Scalar> next = this->config_;
  next.G = g;
  next.validate();
  detail::requireFewImages(contact_.domain, g);
  changePotential(this->config_.G, g);
}

template <Real Scalar, class Layout>
void Space<Scalar, Layout>::setTimeStep(Scalar dt) {
  this->assign(&SimulationConfig<Scalar>::timeStep, dt);
  dt_ = this->config_.adaptiveTimeStep && steps_ > 0 ? std::min<Scalar>(dt_, dt) : dt;
}

/// A change of the potential's law moves energy in or out; the ledger counts it from the first step on.
template <Real Scalar, class Layout>
template <class Part>
void Space<Scalar, Layout>::changePotential(Part& part, const Part& next) {
  const Scalar before = ledgerOpen_ ? potentialEnergy() : Scalar(0);
  const Part last = std::exchange(part, next);
  try {
    const Scalar after = ledgerOpen_ ? potentialEnergy() : Scalar(0);
    left_.exchange += before - after;
  } catch (...) {  // a body is not what it may be, which only the new law looks at
    part = last;
    throw;
  }
  wakeAll();
  forcesValid_ = false;
}

/// Potential energy of a pair [J], with that of their images but without that of each and its own.
template <Real Scalar, class Layout>
Scalar Space<Scalar, Layout>::pairEnergy(std::size_t i, std::size_t j, const Scalar& time,
                                         const Scalar& G) const {
  if (G == Scalar(0)) {  // in a domain of any length
    return Scalar(0);
  }
  const std::array<Vector, 2> x{bodies_[i].position(), bodies_[j].position()};
  const std::array<Scalar, 2> m{bodies_[i].mass(), bodies_[j].mass()};
  const std::array<Scalar, 2> alone{m[0], Scalar(0)};
  force_.gravity.setDomain(contact_.domain, time);
  const Scalar& softening = this->config_.softening;
  return force_.gravity.energyOf(0, x, m, G, softening) - force_.gravity.energyOf(0, x, alone, G, softening);
}

/// Kinetic energy of body i and its share of the potential: what leaves with it. O(N).
template <Real Scalar, class Layout>
Scalar Space<Scalar, Layout>::bindingEnergy(std::size_t i, const Scalar& time, const Scalar& G) const {
  const auto one = bodies_[i];
  const Scalar m = one.mass();
  const Vector x = one.position();
  Scalar energy = one.kineticEnergy();
  if (!one.isFixed()) {
    energy += m * (HillFrame<Scalar>(contact_.domain).potential(x) - force_.field.dot(x));
  }
  if (G == Scalar(0)) {
    return energy;
  }
  force_.gravity.setDomain(contact_.domain, time);
  return energy +
         force_.gravity.energyOf(i, bodies_.positions(), bodies_.masses(), G, this->config_.softening);
}

}  // namespace gravel
