#pragma once

/// \file
/// What a snapshot holds of boundaries, materials and contacts.

#include <gravel/space/contact_stage.hpp>

namespace gravel {

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::save(SnapshotWriter& out) const {
  out.value("domain", static_cast<std::uint32_t>(domain.kind()));
  out.array("domain lengths", domain.lengths().data(), 3);
  out.value("domain omega", domain.omega());
  out.value("domain vertical frequency", domain.verticalFrequency());
  std::vector<Scalar> numbers;
  std::vector<std::uint32_t> surfaces;
  std::vector<std::uint64_t> planeNumbers;
  for (const Plane<Scalar>& plane : boundaries.planes()) {
    numbers.insert(numbers.end(),
                   {plane.normal[0], plane.normal[1], plane.normal[2], plane.offset, plane.velocity[0],
                    plane.velocity[1], plane.velocity[2], plane.velocityBefore[0], plane.velocityBefore[1],
                    plane.velocityBefore[2], plane.changeBefore});
    surfaces.push_back(static_cast<std::uint32_t>(plane.material));
    planeNumbers.push_back(plane.number);
  }
  planeNumbers.push_back(boundaries.next());
  planeNumbers.push_back(boundaries.firstNew());
  out.array("planes", numbers.data(), numbers.size());
  out.array("materials of planes", surfaces.data(), surfaces.size());
  out.array("numbers of planes", planeNumbers.data(), planeNumbers.size());
  out.array("materials", materials.entries().data(), materials.entries().size());
  std::vector<std::uint32_t> ofPairs;
  std::vector<Material<Scalar>> pairMaterials;
  for (const auto& [first, second, material] : materials.pairs()) {
    ofPairs.insert(ofPairs.end(), {first, second});
    pairMaterials.push_back(material);
  }
  out.array("pairs of materials", ofPairs.data(), ofPairs.size());
  out.array("materials of pairs", pairMaterials.data(), pairMaterials.size());
  std::vector<std::uint64_t> keys;
  numbers.clear();
  const auto put = [&](const ContactImpulse<Scalar>& j) {
    numbers.insert(numbers.end(), {j.normal, j.tangential[0], j.tangential[1], j.tangential[2], j.turning[0],
                                   j.turning[1], j.turning[2]});
  };
  for (const StoredImpulse<Scalar>& stored : solver_.memory()) {
    keys.insert(keys.end(), {stored.key1, stored.key2});
    put(stored.impulse);
  }
  std::vector<std::uint64_t> names;
  std::vector<Scalar> places;
  std::vector<Material<Scalar>> pairs;
  for (const Contact<Scalar>& c : contacts_) {
    const auto& [material, drift, driftChange] = contacts_.surface(c);
    names.insert(names.end(), {c.first, c.second, c.key1, c.key2});
    places.insert(places.end(), {c.normal[0], c.normal[1], c.normal[2], c.gap, c.arm1, c.arm2, drift[0],
                                 drift[1], drift[2], driftChange});
    pairs.push_back(material);
  }
  out.array("names of contacts", names.data(), names.size());
  out.array("contacts", places.data(), places.size());
  out.array("materials of contacts", pairs.data(), pairs.size());
  out.array("keys of impulses", keys.data(), keys.size());
  out.array("impulses", numbers.data(), numbers.size());
  numbers.clear();
  std::vector<ContactImpulse<Scalar>> before(contacts_.size());
  beforeLast().addTo(before, contacts_);
  for (const ContactImpulse<Scalar>& j : before) {
    put(j);
  }
  out.array("impulses of earlier solves", numbers.data(), numbers.size());
  out.value("step of impulses", solver_.memoryStep());
  out.value("step of gaps", gapStep_);
  const detail::SolvedProblem<Scalar> solved = coloured_ ? solver_.solved() : resumed_;
  numbers = {solved.still, solved.threshold};
  out.array("solved to", numbers.data(), numbers.size());
  numbers.clear();
  for (const auto& [v0, s0, v, s, way] : solved.bodies) {
    numbers.insert(numbers.end(),
                   {v0[0], v0[1], v0[2], s0[0], s0[1], s0[2], v[0], v[1], v[2], s[0], s[1], s[2], way});
  }
  out.array("solved bodies", numbers.data(), numbers.size());
  numbers.clear();
  for (const auto& [then, approach, target, rest] : solved.rows) {
    numbers.insert(numbers.end(), {then, approach, target, rest});
  }
  out.array("solved contacts", numbers.data(), numbers.size());
}

template <Real Scalar, class Layout>
void ContactStage<Scalar, Layout>::load(SnapshotReader& in) {
  const auto kind = in.value<std::uint32_t>("domain");
  const std::vector<Scalar> lengths = in.array<Scalar>("domain lengths");
  const auto omega = in.value<Scalar>("domain omega");
  const auto vertical = in.value<Scalar>("domain vertical frequency");
  if (lengths.size() != 3 || kind > static_cast<std::uint32_t>(DomainKind::ShearPeriodic)) {
    in.fail("holds a domain of an unknown kind");
  }
  if (static_cast<DomainKind>(kind) == DomainKind::Periodic) {
    domain = Domain<Scalar>::periodic({lengths[0], lengths[1], lengths[2]});
  } else if (static_cast<DomainKind>(kind) == DomainKind::ShearPeriodic) {
    domain = Domain<Scalar>::shearPeriodic({lengths[0], lengths[1], lengths[2]}, omega, vertical);
  }
  const std::vector<Scalar> sides = in.finite<Scalar>("planes");
  const auto surfaces = in.array<std::uint32_t>("materials of planes");
  const auto planeNumbers = in.array<std::uint64_t>("numbers of planes");
  auto surfacesOf = in.array<Material<Scalar>>("materials");
  const auto ofPairs = in.array<std::uint32_t>("pairs of materials");
  const auto pairMaterials = in.array<Material<Scalar>>("materials of pairs");
  const auto names = in.array<std::uint64_t>("names of contacts");
  const std::vector<Scalar> places = in.finite<Scalar>("contacts");
  const auto pairs = in.array<Material<Scalar>>("materials of contacts");
  const auto keys = in.array<std::uint64_t>("keys of impulses");
  const std::vector<Scalar> impulses = in.finite<Scalar>("impulses");
  const std::vector<Scalar> before = in.finite<Scalar>("impulses of earlier solves");
  if (sides.size() != 11 * surfaces.size() || planeNumbers.size() != surfaces.size() + 2 ||
      2 * impulses.size() != 7 * keys.size() || surfacesOf.empty() ||
      places.size() * 4 != names.size() * 10 || before.size() * 4 != names.size() * 7 ||
      pairs.size() * 4 != names.size() || ofPairs.size() != 2 * pairMaterials.size()) {
    in.fail("holds lists of different lengths");
  }
  materials.assign(std::move(surfacesOf));
  for (std::size_t p = 0; p < pairMaterials.size(); ++p) {
    materials.setPair(MaterialId{ofPairs[2 * p]}, MaterialId{ofPairs[2 * p + 1]}, pairMaterials[p]);
  }
  std::vector<Plane<Scalar>> planes;
  for (std::size_t p = 0; p < surfaces.size(); ++p) {
    materials.check(surfaces[p], "plane " + std::to_string(p));
    if (p > 0 && planeNumbers[p] <= planeNumbers[p - 1]) {
      in.fail("holds planes that are not in the order of their numbers");
    }
    const Scalar* side = &sides[11 * p];
    const Vector3<Scalar> normal(side[0], side[1], side[2]);
    in.requireUnit(normal, "plane");
    planes.push_back({normal,
                      side[3],
                      MaterialId{surfaces[p]},
                      {side[4], side[5], side[6]},
                      {side[7], side[8], side[9]},
                      static_cast<std::size_t>(planeNumbers[p]),
                      side[10]});
  }
  boundaries.assign(std::move(planes), static_cast<std::size_t>(planeNumbers[surfaces.size()]),
                    static_cast<std::size_t>(planeNumbers.back()));
  contacts_.contacts.reserve(names.size() / 4);
  for (std::size_t k = 0; k < names.size() / 4; ++k) {
    const std::uint64_t* name = &names[4 * k];
    const Scalar* c = &places[10 * k];
    const Vector3<Scalar> normal(c[0], c[1], c[2]);
    in.requireUnit(normal, "contact");
    validate(pairs[k], "a contact");
    contacts_.push_back({static_cast<std::uint32_t>(name[0]), static_cast<std::uint32_t>(name[1]), name[2],
                         name[3], normal, c[3], c[4], c[5]},
                        {pairs[k], {c[6], c[7], c[8]}, c[9]});
  }
  std::vector<StoredImpulse<Scalar>> memory(keys.size() / 2);
  const auto impulseAt = [](const Scalar* j) {
    return ContactImpulse<Scalar>{j[0], {j[1], j[2], j[3]}, {j[4], j[5], j[6]}};
  };
  for (std::size_t k = 0; k < memory.size(); ++k) {
    memory[k] = {keys[2 * k], keys[2 * k + 1], impulseAt(&impulses[7 * k])};
  }
  record_.add([&](auto&& visit) {
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
      visit(contacts_[k], impulseAt(&before[7 * k]));
    }
  });
  const auto step = in.value<Scalar>("step of impulses");
  gapStep_ = in.value<Scalar>("step of gaps");
  const std::vector<Scalar> to = in.finite<Scalar>("solved to");
  const std::vector<Scalar> moved = in.finite<Scalar>("solved bodies");
  const std::vector<Scalar> looked = in.finite<Scalar>("solved contacts");
  if (to.size() != 2 || moved.size() % 13 != 0 || looked.size() % 4 != 0 ||
      (!looked.empty() && looked.size() / 4 != contacts_.size())) {
    in.fail("holds a part of a solved body or contact");
  }
  if (!isFinite(step) || step < Scalar(0) || !isFinite(gapStep_) || gapStep_ < Scalar(0)) {
    in.fail("holds a step of impulses or gaps that is negative or not finite");
  }
  solver_.setMemory(std::move(memory), step);
  resumed_ = {{}, {}, to[0], to[1]};
  for (std::size_t k = 0; k < moved.size(); k += 13) {
    const auto at = [&](std::size_t c) {
      return Vector3<Scalar>(moved[k + c], moved[k + c + 1], moved[k + c + 2]);
    };
    resumed_.bodies.push_back({at(0), at(3), at(6), at(9), moved[k + 12]});
  }
  for (std::size_t k = 0; k < looked.size(); k += 4) {
    resumed_.rows.push_back({looked[k], looked[k + 1], looked[k + 2], looked[k + 3]});
  }
}

}  // namespace gravel
