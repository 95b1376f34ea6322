#include "support/catch.hpp"
#include <gravel/contact/contact_list.hpp>

#include <array>

using namespace gravel;

namespace {

/// Six contacts of three planes, each with one of two materials, which have one surface each.
ContactList<double> onThreePlanes() {
  ContactList<double> list;
  list.surfaces = {{Material<double>{.restitution = 0.25}, {0, 0, 1}},
                   {Material<double>{.restitution = 0.5}, {0, 0, 1}}};
  for (std::uint32_t k = 0; k < 6; ++k) {
    list.contacts.push_back({k, staticPartner, k, boundaryKey(k / 2), {0, 0, -1}, 0.0, 1.0, 0.0, k % 2});
  }
  return list;
}

}  // namespace

// Seen to fail: a surface that is not looked up with its drift (all planes have that of the first).
TEST_CASE("Planes that move otherwise give each contact its own one's drift, and nothing else") {
  ContactList<double> list = onThreePlanes();
  const std::array<SurfaceDrift<double>, 2> drifts{SurfaceDrift<double>{{0, 0, 2}, 0.5},
                                                   SurfaceDrift<double>{{3, 0, 0}, 0.0}};
  const auto driftOf = [&](const Contact<double>& c) {  // the third plane is none of theirs
    const std::uint64_t plane = c.key2 - boundaryKey(0);
    return plane < drifts.size() ? &drifts[plane] : nullptr;
  };
  CHECK(list.setDrifts(driftOf));
  CHECK(list.surfaces.size() == 6);
  for (std::uint32_t k = 0; k < 6; ++k) {
    CHECK(list.material(list[k]).restitution == (k % 2 == 0 ? 0.25 : 0.5));
    CHECK(list.drift(list[k]) == (k < 4 ? drifts[k / 2].velocity : Vector3<double>(0, 0, 1)));
    CHECK(list.surface(list[k]).driftChange == (k < 2 ? 0.5 : 0.0));
  }
  CHECK(!list.setDrifts(driftOf));  // they have it
}

// Seen to fail: only what changes looks for surfaces that are left.
TEST_CASE("Surfaces of contacts do not pile up, whether drifts change or stay") {
  ContactList<double> list = onThreePlanes();
  for (const double v : {0.0, 1.0, 2.0, 2.0, 2.0}) {
    for (Contact<double>& c : list) {
      list.setSurface(c, list.surface(c));
    }
    const SurfaceDrift<double> drift{{0, 0, v}};
    list.setDrifts([&](const Contact<double>&) { return &drift; });
    CHECK(list.surfaces.size() <= list.size());
  }
}
