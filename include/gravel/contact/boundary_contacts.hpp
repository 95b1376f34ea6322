#pragma once

/// \file
/// Where bodies touch boundaries.

#include <gravel/contact/contact_search.hpp>
#include <gravel/contact/surface_numbers.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/sizes.hpp>

namespace gravel::detail {

/// Finds the contacts of half-spaces, for the narrow phase.
template <Real S>
class BoundaryContacts {
 public:
  /// The arguments are those of NarrowPhase::find(). Surfaces are numbered from materials.size() on.
  template <class B>
  void find(const B& bodies, const MaterialView<S>& materials, std::span<const HalfSpace<S>> boundaries,
            const NarrowPhaseSettings<S>& settings,
            std::optional<std::span<const std::uint32_t>> nearBoundaries) {
    for (std::size_t b = 1; b < boundaries.size(); ++b) {
      if (boundaries[b].number <= boundaries[b - 1].number) {
        refuse("number of boundary " + std::to_string(b), std::to_string(boundaries[b].number),
               "above that of the one before it, " + std::to_string(boundaries[b - 1].number));
      }
    }
    for (const std::uint32_t i : nearBoundaries.value_or(std::span<const std::uint32_t>())) {
      if (i >= bodies.size()) {
        refuse("body near a boundary", std::to_string(i),
               "below the number of bodies, " + std::to_string(bodies.size()));
      }
    }
    contacts_.clear();
    surfaces_.clear();
    if (boundaries.empty() || (nearBoundaries && nearBoundaries->empty())) {
      return;
    }
    const std::size_t count = nearBoundaries ? nearBoundaries->size() : bodies.size();
    const std::size_t used =
        gatherContacts(count, parts_, [&](std::size_t k, Part& part, RestingCursor& cursor) {
          append(nearBoundaries ? (*nearBoundaries)[k] : k, bodies, materials, boundaries, settings, part,
                 cursor);
        });
    for (const Part& part : std::span(parts_).first(used)) {
      const auto first = static_cast<std::uint32_t>(materials.size() + surfaces_.size());
      for (Contact<S> c : part.contacts) {
        c.surface += first;
        contacts_.push_back(c);
      }
      const std::vector<ContactSurface<S>>& surfaces = part.surfaces.surfaces();
      surfaces_.insert(surfaces_.end(), surfaces.begin(), surfaces.end());
    }
    if (!std::is_sorted(contacts_.begin(), contacts_.end(), byKeys)) {
      std::sort(contacts_.begin(), contacts_.end(), byKeys);
    }
  }

  /// They have been taken over.
  void forget() {
    giveBack(contacts_);
    parts_.resize(std::min<std::size_t>(parts_.size(), 1));
    for (Part& part : parts_) {
      giveBack(part.contacts);
    }
  }

  /// Sorted by keys.
  const std::vector<Contact<S>>& contacts() const { return contacts_; }
  const std::vector<ContactSurface<S>>& surfaces() const { return surfaces_; }

 private:
  /// Contacts with boundaries, and their surfaces numbered from 0.
  struct Part {
    std::vector<Contact<S>> contacts;
    SurfaceNumbers<S> surfaces;
    void clear() {
      contacts.clear();
      surfaces.clear();
    }
  };

  template <class B>
  static void append(std::size_t i, const B& bodies, const MaterialView<S>& materials,
                     std::span<const HalfSpace<S>> boundaries, const NarrowPhaseSettings<S>& settings,
                     Part& part, RestingCursor& cursor) {
    const S radius = bodies.radii()[i];
    const Vector3<S> x = bodies.positions()[i];
    for (const HalfSpace<S>& wall : boundaries) {
      if (!(wall.normal.dot(x) - wall.offset < radius + widestMargin(settings, radius))) {
        continue;
      }
      const auto falls = [&] { return accelerationOf(settings, bodies, i, true); };
      const S margin = marginOf(settings, radius, falls);
      const auto touch = sphereHalfSpace<S>(x, radius, wall.normal, wall.offset, margin);
      const auto approach = [&] {  // beyond what a plane that goes on changing its velocity brings
        const S changes = S(4) * detail::sizeOf(wall.swing);
        return S(wall.normal.dot(Vector3<S>(wall.velocity - velocityOf(bodies, i))) - changes);
      };
      if (touch && isMovable(bodies, i) &&
          (touch->gap < settings.margin ||
           mayRest(settings, {bodies.ids()[i], boundaryKey(wall.number)}, cursor) ||
           mayBegin<S>(settings, touch->gap, radius, approach(), falls()))) {
        const std::uint32_t m = bodies.materials()[i];
        materials.require(m, i);
        const std::uint32_t number = part.surfaces.of(
            m, wall.number, wall.velocity, [&] { return materials.pair(m, wall.surface, wall.material); });
        part.contacts.push_back({static_cast<std::uint32_t>(i), staticPartner, bodies.ids()[i],
                                 boundaryKey(wall.number), touch->normal, touch->gap, touch->arm1,
                                 touch->arm2, number});
      }
    }
  }

  std::vector<Part> parts_;
  std::vector<Contact<S>> contacts_;
  std::vector<ContactSurface<S>> surfaces_;
};

}  // namespace gravel::detail
