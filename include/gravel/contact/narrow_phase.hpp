#pragma once

/// \file
/// From candidates to contacts: which pairs really touch, where, and with what surfaces.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/contact_facts.hpp>
#include <gravel/contact/resting_gap.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/spatial/pair.hpp>

#include <algorithm>
#include <optional>
#include <span>
#include <string>

namespace gravel {

/// Settings of a search for contacts.
template <Real Scalar>
struct NarrowPhaseSettings {
  Scalar time = Scalar(0);     ///< [s], for a sheared domain
  Scalar epsilon = Scalar(0);  ///< [m] centres closer than this (and than rounding) count as one point
  Scalar margin = Scalar(0);   ///< [m] pairs with a gap below this are contacts too; 0 takes overlaps only
  /// [s] step, or 0. What rests on something is carried through a step with a gap that opens and closes by
  /// rounding and by the curvature of its path; it stays a contact while the accelerations of the two can
  /// close the gap within the step, gap < (|a_1| + |a_2|) step^2, and the gap is below a thousandth of the
  /// radii. Such a contact may approach until its gap is closed.
  Scalar step = Scalar(0);
  /// Who rests on whom, sorted: only these stay contacts with a gap. Without it every pair so near does.
  std::optional<std::span<const ContactName>> resting = std::nullopt;
  std::span<const ContactName> before{};  ///< with which those found are compared: facts()
};

/// Turns candidate pairs and boundaries into the list of contacts, sorted by keys. Keeps its workspace from
/// call to call. O(candidates + bodies x boundaries), shared between threads; the list is the same for any
/// number of threads. A pair of two immovable bodies makes no contact, and neither does a tracer.
template <Real S>
class NarrowPhase {
 public:
  /// \param pairs candidates, sorted by ids (spatial/pair.hpp), of indices into `bodies`
  /// \param materials surface of each MaterialId that occurs
  /// \param boundaries half-spaces with unit normals, in increasing order of their numbers
  /// \param nearBoundaries indices of all bodies that may touch a boundary, increasing; without it every body
  ///        is looked at
  /// \throws std::invalid_argument for a material id without an entry, or boundaries out of order
  template <ContactBodies B>
  void find(std::span<const Pair> pairs, const B& bodies, const Domain<S>& domain,
            std::span<const Material<S>> materials, std::span<const HalfSpace<S>> boundaries,
            const NarrowPhaseSettings<S>& settings, std::vector<Contact<S>>& out,
            std::optional<std::span<const std::uint32_t>> nearBoundaries = std::nullopt) {
    for (std::size_t b = 1; b < boundaries.size(); ++b) {
      if (boundaries[b].number <= boundaries[b - 1].number) {
        detail::refuse("number of boundary " + std::to_string(b), std::to_string(boundaries[b].number),
                       "above that of the one before it, " + std::to_string(boundaries[b - 1].number));
      }
    }
    const bool walls = !boundaries.empty() && !(nearBoundaries && nearBoundaries->empty());
    boundaryContacts_.clear();
    if (walls) {
      const std::size_t count = nearBoundaries ? nearBoundaries->size() : bodies.size();
      const std::size_t used =
          gather(count, wallParts_, [&](std::size_t k, std::vector<Contact<S>>& part, Cursor& cursor) {
            appendBoundaries(nearBoundaries ? (*nearBoundaries)[k] : k, bodies, materials, boundaries,
                             settings, part, cursor);
          });
      for (const std::vector<Contact<S>>& part : std::span(wallParts_).first(used)) {
        boundaryContacts_.insert(boundaryContacts_.end(), part.begin(), part.end());
      }
      const auto before = [](const Contact<S>& a, const Contact<S>& b) { return keysBefore(a, b); };
      if (!std::is_sorted(boundaryContacts_.begin(), boundaryContacts_.end(), before)) {
        std::sort(boundaryContacts_.begin(), boundaryContacts_.end(), before);
      }
    }
    if (!pairs.empty()) {
      spheres_.resize(bodies.size());
      parallelFor(bodies.size(), chunk, [&](std::size_t i) {
        spheres_[i] = {bodies.positions()[i], bodies.radii()[i]};
      });
    }
    const std::size_t used =
        gather(pairs.size(), parts_, [&](std::size_t k, std::vector<Pair>& part, Cursor& cursor) {
          appendPair(pairs[k], bodies, domain, materials, settings, part, cursor);
        });
    merge(used, bodies, domain, materials, settings, out);
  }

  /// Of the contacts of the last find().
  const ContactFacts<S>& facts() const { return facts_; }

 private:
  static constexpr std::size_t chunk = 2048;

  /// Where a chunk has got to in the list of those who rest; its own pairs come in the same order.
  using Cursor = std::size_t;

  /// Calls append(k, part, cursor) for k = 0 … n-1 in chunks. \return their number
  template <class Part, class Append>
  static std::size_t gather(std::size_t n, std::vector<Part>& parts, Append&& append) {
    const std::size_t used = (n + chunk - 1) / chunk;
    if (parts.size() < used) {
      parts.resize(used);
    }
    parallelForChunks<Share::Alike>(n, chunk, [&](std::size_t begin, std::size_t end) {
      Part& part = parts[begin / chunk];
      part.clear();
      Cursor cursor = 0;
      for (std::size_t k = begin; k < end; ++k) {
        append(k, part, cursor);
      }
    });
    return used;
  }

  template <class B>
  static ContactKeys keysOf(Pair pair, const B& bodies) {
    return {bodies.ids()[pair.first], bodies.ids()[pair.second]};
  }

  /// Pairs and boundaries in the order of keys, part by part. The geometry of pairs is found once more: that
  /// is less than to keep it meanwhile.
  template <class B>
  void merge(std::size_t used, const B& bodies, const Domain<S>& domain,
             std::span<const Material<S>> materials, const NarrowPhaseSettings<S>& settings,
             std::vector<Contact<S>>& out) {
    const auto before = [](const Contact<S>& wall, const ContactKeys& keys) {
      return ContactKeys{wall.key1, wall.key2} < keys;
    };
    starts_.assign(1, {0, 0});
    for (std::size_t p = 0; p < used; ++p) {
      Start next = starts_.back();
      if (!parts_[p].empty()) {
        const auto end = std::lower_bound(boundaryContacts_.begin(), boundaryContacts_.end(),
                                          keysOf(parts_[p].back(), bodies), before);
        next.wall = static_cast<std::size_t>(end - boundaryContacts_.begin());
        next.place += parts_[p].size() + next.wall - starts_.back().wall;
      }
      starts_.push_back(next);
    }
    const Start last = starts_.back();
    out.resize(last.place + boundaryContacts_.size() - last.wall);
    factsOfParts_.assign(used + 1, ContactFacts<S>{});
    const auto look = [&](std::size_t k, const S& r, ContactFacts<S>& part) {
      part.include(out[k], r, detail::isNamed(settings.before, k, out[k]));
    };
    parallelForTasks<Share::Alike>(used, [&](std::size_t p) {
      auto [wall, place] = starts_[p];
      ContactFacts<S> part;
      for (const Pair& pair : parts_[p]) {
        const auto [i, j] = pair;
        const ContactKeys keys = keysOf(pair, bodies);
        while (wall < starts_[p + 1].wall && before(boundaryContacts_[wall], keys)) {
          out[place] = boundaryContacts_[wall++];
          look(place, bodies.radii()[out[place].first], part);
          ++place;
        }
        Vector3<S> drift;
        const Vector3<S> r_ij = separation(pair, domain, settings, drift);
        const S reach = spheres_[i].r + spheres_[j].r;
        const Touch<S> touch = touchAt<S>(r_ij, detail::safeNorm(r_ij), spheres_[i].r, reach, keys.first,
                                          keys.second, settings.epsilon);
        const std::uint32_t m_i = bodies.materials()[i];
        const std::uint32_t m_j = bodies.materials()[j];
        out[place] = Contact<S>{i,
                                j,
                                keys.first,
                                keys.second,
                                touch.normal,
                                touch.gap,
                                touch.arm1,
                                touch.arm2,
                                m_i == m_j ? materials[m_i] : mix(materials[m_i], materials[m_j]),
                                drift};
        look(place, detail::smallerRadius<S>(spheres_[i].r, spheres_[j].r), part);
        ++place;
      }
      factsOfParts_[p] = part;
    });
    for (std::size_t wall = last.wall, place = last.place; place < out.size(); ++wall, ++place) {
      out[place] = boundaryContacts_[wall];
      look(place, bodies.radii()[out[place].first], factsOfParts_[used]);
    }
    facts_ = {};
    for (const ContactFacts<S>& part : factsOfParts_) {
      facts_ += part;
    }
  }

  template <class B>
  static S accelerationOf(const B& bodies, std::size_t i) {
    return detail::isMovable(bodies, i) ? detail::safeNorm(Vector3<S>(bodies.accelerations()[i])) : S(0);
  }

  /// \param acceleration() is asked for only where a step is given
  template <class Acceleration>
  static S marginOf(const NarrowPhaseSettings<S>& settings, const S& radii, Acceleration&& acceleration) {
    if (!(settings.step > S(0))) {
      return settings.margin;
    }
    const S closing = acceleration() * settings.step * settings.step;
    return std::max<S>(settings.margin, std::min<S>(closing, detail::restingMargin<S>() * radii));
  }

  /// What marginOf() is at most.
  static S widestMargin(const NarrowPhaseSettings<S>& settings, const S& radii) {
    return settings.step > S(0) ? std::max<S>(settings.margin, detail::restingMargin<S>() * radii)
                                : settings.margin;
  }

  static bool mayRest(const NarrowPhaseSettings<S>& settings, const ContactKeys& keys, Cursor& cursor) {
    if (!settings.resting) {
      return true;
    }
    const std::span<const ContactName> resting = *settings.resting;
    const auto found = placeOf(resting, keys, cursor);
    cursor = static_cast<std::size_t>(found - resting.begin());
    return found != resting.end() && found->keys == keys;
  }

  static const Material<S>& surface(std::span<const Material<S>> materials, std::uint32_t id) {
    if (id >= materials.size()) {
      detail::refuse("material of a body", std::to_string(id),
                     "below the number of materials, " + std::to_string(materials.size()));
    }
    return materials[id];
  }

  /// From the first centre to the nearest image of the second, which moves on by `drift` more.
  Vector3<S> separation(Pair pair, const Domain<S>& domain, const NarrowPhaseSettings<S>& settings,
                        Vector3<S>& drift) const {
    Vector3<S> r_ij = spheres_[pair.second].x - spheres_[pair.first].x;
    drift = Vector3<S>::Zero();
    if (!domain.isOpen()) {
      domain.minimumImage(r_ij, drift, settings.time);
    }
    return r_ij;
  }

  template <class B>
  void appendPair(Pair pair, const B& bodies, const Domain<S>& domain, std::span<const Material<S>> materials,
                  const NarrowPhaseSettings<S>& settings, std::vector<Pair>& part, Cursor& cursor) const {
    const std::uint32_t i = pair.first;
    const std::uint32_t j = pair.second;
    Vector3<S> drift;
    const Vector3<S> r_ij = separation(pair, domain, settings, drift);
    const S reach = spheres_[i].r + spheres_[j].r;
    const S far = reach + widestMargin(settings, reach);
    const S distance_sq = r_ij.squaredNorm();
    if (distance_sq > far * far) {
      return;  // the common case, before anything else is loaded
    }
    // A root is taken only where rounding could matter.
    const S near = (S(1) - S(16) * Eigen::NumTraits<S>::epsilon()) * (reach + settings.margin);
    const bool surely = distance_sq < near * near;
    const S distance = surely ? S(0) : detail::safeNorm(r_ij);
    const bool overlaps = surely || distance < reach + settings.margin;
    const auto falls = [&] { return S(accelerationOf(bodies, i) + accelerationOf(bodies, j)); };
    if (!(reach > S(0)) || (!overlaps && !(distance < reach + marginOf(settings, reach, falls)))) {
      return;
    }
    if (detail::isTracer(bodies, i) || detail::isTracer(bodies, j) ||
        !(detail::isMovable(bodies, i) || detail::isMovable(bodies, j))) {
      return;
    }
    if (!overlaps && !mayRest(settings, keysOf(pair, bodies), cursor)) {
      return;
    }
    (void)surface(materials, bodies.materials()[i]);  // refused while the list is what it was
    (void)surface(materials, bodies.materials()[j]);
    part.push_back(pair);
  }

  template <class B>
  static void appendBoundaries(std::size_t i, const B& bodies, std::span<const Material<S>> materials,
                               std::span<const HalfSpace<S>> boundaries,
                               const NarrowPhaseSettings<S>& settings, std::vector<Contact<S>>& part,
                               Cursor& cursor) {
    const S radius = bodies.radii()[i];
    const Vector3<S> x = bodies.positions()[i];
    for (const HalfSpace<S>& wall : boundaries) {
      if (!(wall.normal.dot(x) - wall.offset < radius + widestMargin(settings, radius))) {
        continue;
      }
      const S margin = marginOf(settings, radius, [&] { return accelerationOf(bodies, i); });
      const auto touch = sphereHalfSpace<S>(x, radius, wall.normal, wall.offset, margin);
      if (touch && detail::isMovable(bodies, i) &&
          (touch->gap < settings.margin ||
           mayRest(settings, {bodies.ids()[i], boundaryKey(wall.number)}, cursor))) {
        part.push_back(Contact<S>{static_cast<std::uint32_t>(i), staticPartner, bodies.ids()[i],
                                  boundaryKey(wall.number), touch->normal, touch->gap, touch->arm1,
                                  touch->arm2, mix(surface(materials, bodies.materials()[i]), wall.material),
                                  wall.velocity});
      }
    }
  }

  /// Place and radius of a body: in double half a cache line.
  struct alignas(alignof(S) > 32 ? alignof(S) : 32) Sphere {
    Vector3<S> x;
    S r;
  };

  /// Where a part begins among the boundaries' contacts and in the list.
  struct Start {
    std::size_t wall;
    std::size_t place;
  };

  std::vector<Sphere> spheres_;
  std::vector<std::vector<Pair>> parts_;
  std::vector<std::vector<Contact<S>>> wallParts_;
  std::vector<Start> starts_;
  std::vector<Contact<S>> boundaryContacts_;
  std::vector<ContactFacts<S>> factsOfParts_;
  ContactFacts<S> facts_;
};

}  // namespace gravel
