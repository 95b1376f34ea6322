#include "diagnostics.hpp"
#include <gravel/core/parallel.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <numeric>

namespace gravel::runner {

Diagnostics::Diagnostics(const std::filesystem::path& path) : path_(path), file_(path) {
  file_.precision(17);
  file_ << "time,step,dt,contacts,kinetic,rotational,potential,restitution,friction,damping,correction,work,"
           "exchange,total,drift\n";
  if (!file_) {
    throw std::runtime_error("cannot write " + path.string());
  }
}

namespace {

/// Energy that lifts every body by its radius in the uniform field: what is in play in a heap that rests,
/// even at height zero.
double liftEnergy(const Space<double>& space) {
  const double g = space.uniformField().norm();
  double sum = 0.0;
  for (const auto body : space.bodies()) {
    sum += body.isFixed() ? 0.0 : body.mass() * g * body.radius();
  }
  return sum;
}

bool arePlacesFinite(const Space<double>& space) {
  return std::all_of(space.bodies().begin(), space.bodies().end(),
                     [](const auto& body) { return body.position().allFinite(); });
}

/// Motion and |potential|, but no more motion than the ledger knows a source of: where energy came from
/// nothing it is measured against what there was without it.
double energyInPlay(const EnergyLedger<double>& first, const EnergyLedger<double>& now) {
  const double had = first.kinetic + first.rotational + std::abs(first.potential);
  const double exchanged =
      std::abs((now.dissipated() - now.correction) - (first.dissipated() - first.correction));
  const double potential = std::abs(now.potential);
  return potential + std::min(now.kinetic + now.rotational, had + potential + exchanged);
}

}  // namespace

void Diagnostics::record(const Space<double>& space) {
  const EnergyLedger<double> e = space.energyLedger();
  History& h = history_;
  if (h.rows == 0) {
    h.first = e;
    h.inPlay = liftEnergy(space);
    h.begin = h.restsSince = space.time();
    h.closes = space.getG() == 0.0 || space.domain().shearSpeed() == 0.0;
  }
  h.last = e;
  h.end = space.time();
  see(e.kinetic + e.rotational);
  h.isFinite = h.isFinite && std::isfinite(e.total()) && arePlacesFinite(space);
  h.inPlay = std::max(h.inPlay, energyInPlay(h.first, e));
  h.worstDrift = std::max(h.worstDrift, std::abs(h.drift()));
  ++h.rows;
  file_ << space.time() << ',' << space.steps() << ',' << space.getPreviousTimeStep() << ','
        << space.contactCount() << ',' << e.kinetic << ',' << e.rotational << ',' << e.potential << ','
        << e.restitution << ',' << e.friction << ',' << e.damping << ',' << e.correction << ',' << e.work
        << ',' << e.exchange << ',' << e.total() << ',' << h.drift() << '\n';
  file_.flush();
  if (!file_) {
    throw std::runtime_error("cannot write " + path_.string());
  }
}

void Diagnostics::count(const Space<double>& space) {
  History& h = history_;
  ++h.steps;
  h.mostContacts = std::max(h.mostContacts, space.contactCount());
  h.parts += space.contactSubsteps();
  h.mostParts = std::max(h.mostParts, space.contactSubsteps());
  EnergyLedger<double> now;
  addKineticEnergy(space.bodies(), now);
  const double motion = now.kinetic + now.rotational;
  see(motion);
  h.restsSince = motion < History::restShare * h.peakMotion ? h.restsSince : space.time();
}

void Diagnostics::see(double motion) {
  history_.isFinite = history_.isFinite && std::isfinite(motion);
  history_.peakMotion = std::max(history_.peakMotion, motion);
}

namespace {

struct Member {
  std::size_t body;
  Vector3<double> x, v;  ///< of the image that touches the others
};

/// The bodies of the heaviest cluster.
std::vector<Member> heaviestCluster(const Space<double>& space) {
  const std::size_t n = space.n();
  std::vector<std::size_t> parent(n);
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) {
      i = parent[i] = parent[parent[i]];
    }
    return i;
  };
  for (const Contact<double>& contact : space.contacts()) {
    if (contact.second != staticPartner) {
      parent[root(contact.first)] = root(contact.second);
    }
  }
  std::vector<double> mass(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    mass[root(i)] += space.body(i).mass();
  }
  const auto heaviest = static_cast<std::size_t>(std::max_element(mass.begin(), mass.end()) - mass.begin());
  std::vector<std::vector<std::size_t>> touched(n);
  for (const Contact<double>& contact : space.contacts()) {
    if (contact.second != staticPartner && root(contact.first) == heaviest) {
      touched[contact.first].push_back(contact.second);
      touched[contact.second].push_back(contact.first);
    }
  }
  std::vector<Member> members;
  std::vector<bool> found(n, false);
  const auto add = [&](std::size_t i, const Vector3<double>& x, const Vector3<double>& v) {
    found[i] = true;
    members.push_back({i, x, v});
  };
  add(heaviest, space.body(heaviest).position(), space.body(heaviest).velocity());
  for (std::size_t k = 0; k < members.size(); ++k) {
    const Member from = members[k];
    for (const std::size_t j : touched[from.body]) {
      if (!found[j]) {
        Vector3<double> r = space.body(j).position() - from.x;
        Vector3<double> v = space.body(j).velocity() - from.v;
        space.domain().minimumImage(r, v, space.time());
        add(j, from.x + r, from.v + v);
      }
    }
  }
  return members;
}

}  // namespace

Cluster largestCluster(const Space<double>& space) {
  const std::vector<Member> members = heaviestCluster(space);
  Cluster cluster;
  cluster.bodies = members.size();
  Vector3<double> centre = Vector3<double>::Zero(), drift = Vector3<double>::Zero();
  double volume = 0.0;
  for (const auto& [i, place, velocity] : members) {
    const auto body = space.body(i);
    cluster.mass += body.mass();
    centre += body.mass() * place;
    drift += body.mass() * velocity;
    volume += 4.0 / 3.0 * pi<double>() * std::pow(body.radius(), 3);
  }
  if (!(cluster.mass > 0.0)) {
    return cluster;
  }
  centre /= cluster.mass;
  drift /= cluster.mass;

  // Second moments sum m x x^T, each sphere with its own m r^2 / 5 along each axis, as an ellipsoid of
  // half-axes a has M a^2 / 5.
  const Matrix3<double> one = Matrix3<double>::Identity();
  Matrix3<double> moments = Matrix3<double>::Zero();
  Vector3<double> angularMomentum = Vector3<double>::Zero();
  for (const auto& [i, place, velocity] : members) {
    const auto body = space.body(i);
    const Vector3<double> x = place - centre;
    const Vector3<double> v = velocity - drift;
    moments += body.mass() * (x * x.transpose() + one * (body.radius() * body.radius() / 5.0));
    angularMomentum += body.mass() * x.cross(v) + body.inertia() * body.angularVelocity();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3<double>> solver(moments / cluster.mass, Eigen::EigenvaluesOnly);
  const Vector3<double> halfAxes = (5.0 * solver.eigenvalues().cwiseMax(0.0)).cwiseSqrt();
  cluster.axes = 2.0 * halfAxes.reverse();
  const double enclosed = 4.0 / 3.0 * pi<double>() * halfAxes.prod();
  cluster.filling = enclosed > 0.0 ? volume / enclosed : 0.0;

  const Matrix3<double> inertia = one * moments.trace() - moments;
  const Vector3<double> spin = inertia.ldlt().solve(angularMomentum);
  cluster.angularSpeed = spin.norm();
  for (const auto& [i, place, velocity] : members) {
    const auto body = space.body(i);
    const Vector3<double> v = velocity - drift - spin.cross(place - centre);
    const Vector3<double> w = body.angularVelocity() - spin;
    cluster.internalMotion += 0.5 * (body.mass() * v.squaredNorm() + body.inertia() * w.squaredNorm());
  }
  return cluster;
}

double boundFraction(const Space<double>& space) {
  const std::size_t n = space.n();
  const ConservedQuantities<double> whole = space.conserved();
  if (!(whole.mass > 0.0)) {
    return 0.0;
  }
  const Vector3<double> drift = whole.momentum / whole.mass;
  const double softening_sq = space.config().softening * space.config().softening;
  const double bound = orderedSum(n, 64, 0.0, [&](std::size_t begin, std::size_t end) {
    double part = 0.0;
    for (std::size_t i = begin; i < end; ++i) {
      const auto body = space.body(i);
      double depth = 0.0;
      for (std::size_t j = 0; j < n; ++j) {
        if (j != i) {
          const auto other = space.body(j);
          depth += space.getG() * other.mass() /
                   std::sqrt((other.position() - body.position()).squaredNorm() + softening_sq);
        }
      }
      part += 0.5 * (body.velocity() - drift).squaredNorm() < depth ? body.mass() : 0.0;
    }
    return part;
  });
  return bound / whole.mass;
}

namespace {

/// The radius that an overlap of two is measured by: the smaller one, but a point has none to measure by.
double smallerRadius(double a, double b) { return std::min(a, b) > 0.0 ? std::min(a, b) : std::max(a, b); }

}  // namespace

double deepestOverlap(const Space<double>& space) {
  double deepest = 0.0;
  for (const Contact<double>& contact : space.contacts()) {
    const double first = space.body(contact.first).radius();
    const bool isPair = contact.second != staticPartner;
    const double radius = smallerRadius(first, isPair ? space.body(contact.second).radius() : first);
    deepest = radius > 0.0 ? std::max(deepest, -contact.gap / radius) : deepest;
  }
  return deepest;
}

Overlaps overlapsAtStart(const Space<double>& space) {
  Overlaps overlaps;
  std::vector<bool> isDeep(space.n(), false);
  const auto note = [&](std::size_t i, double depth) {
    if (depth > 0.1 && !space.body(i).isFixed()) {
      isDeep[i] = true;
      overlaps.deepest = std::max(overlaps.deepest, depth);
    }
  };
  std::vector<Pair> pairs;
  BroadPhase<double>().findPairs(space.bodies().positions(), space.bodies().radii(), space.bodies().ids(),
                                 0.0, space.domain(), space.time(), pairs);
  for (const Pair& pair : pairs) {
    if (!detail::canTouch(space.bodies(), pair.first, pair.second)) {
      continue;
    }
    const auto a = space.body(pair.first), b = space.body(pair.second);
    const Vector3<double> r = space.domain().minimumImage(b.position() - a.position(), space.time());
    const double depth = (a.radius() + b.radius() - r.norm()) / smallerRadius(a.radius(), b.radius());
    note(pair.first, depth);
    note(pair.second, depth);
  }
  for (std::size_t i = 0; i < space.n(); ++i) {
    const auto body = space.body(i);
    for (const Plane<double>& plane : space.planes()) {
      if (body.radius() > 0.0) {
        note(i, (plane.offset + body.radius() - plane.normal.dot(body.position())) / body.radius());
      }
    }
  }
  overlaps.bodies = static_cast<std::size_t>(std::count(isDeep.begin(), isDeep.end(), true));
  return overlaps;
}

namespace {

/// Body i as seen from another: place, velocity and G times the mass that holds the two together.
struct TwoBodies {
  TwoBodies(const Space<double>& space, std::size_t i, std::size_t centre)
      : x(space.body(i).position() - space.body(centre).position()),
        v(space.body(i).velocity() - space.body(centre).velocity()),
        mu(space.getG() *
           (space.body(centre).mass() +
            (space.body(centre).isFixed() ? 0.0 : static_cast<double>(space.body(i).mass())))) {}
  /// Per mass; negative where they are bound.
  double energy() const { return 0.5 * v.squaredNorm() - mu / x.norm(); }

  Vector3<double> x, v;
  double mu;
};

double distance(const Space<double>& space, std::size_t i, std::size_t j) {
  return (space.body(i).position() - space.body(j).position()).norm();
}

}  // namespace

Orbit orbitAbout(const Space<double>& space, std::size_t i, std::size_t centre) {
  const auto [x, v, mu] = TwoBodies(space, i, centre);
  const double a = 1.0 / (2.0 / x.norm() - v.squaredNorm() / mu);
  const double e = ((v.squaredNorm() - mu / x.norm()) * x - x.dot(v) * v).norm() / mu;
  return {a, e, a > 0.0 ? 2.0 * pi<double>() * std::sqrt(a * a * a / mu) : std::nan("")};
}

std::optional<std::size_t> centreOf(const Space<double>& space, std::size_t i, std::size_t heaviest) {
  std::size_t centre = heaviest;
  double lowest = 0.0;
  for (std::size_t j = 0; j < space.n(); ++j) {
    if (j == heaviest || !(space.body(j).mass() > space.body(i).mass())) {
      continue;
    }
    const double hillRadius =
        distance(space, j, heaviest) * std::cbrt(space.body(j).mass() / (3.0 * space.body(heaviest).mass()));
    const double energy = TwoBodies(space, i, j).energy();
    if (distance(space, i, j) < hillRadius && energy < lowest) {
      centre = j;
      lowest = energy;
    }
  }
  const double reach = distance(space, i, centre);
  double inside = 0.0;
  for (std::size_t j = 0; j < space.n(); ++j) {
    inside += j != i && j != centre && distance(space, j, centre) < reach ? space.body(j).mass() : 0.0;
  }
  const double mass = space.body(centre).mass();
  const bool pulls = mass > 0.0 && reach > 0.0;
  const bool isOfTwo = pulls && inside <= 0.01 * mass && space.config().softening <= 0.01 * reach;
  return isOfTwo ? std::optional(centre) : std::nullopt;
}

}  // namespace gravel::runner
