#pragma once

/// \file
/// From candidates to contacts: which pairs really touch, where, and with what surfaces.

#include <gravel/contact/boundary_contacts.hpp>
#include <gravel/contact/contact_facts.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/spatial/pair.hpp>

#include <algorithm>
#include <optional>
#include <span>

namespace gravel {

/// Turns candidate pairs and boundaries into the list of contacts, sorted by keys. O(candidates + bodies x
/// boundaries), shared between threads; the list is the same for any number of threads. A pair of two
/// immovable bodies makes no contact, and neither does a tracer.
template <Real S>
class NarrowPhase {
 public:
  /// \param pairs candidates, sorted by ids (spatial/pair.hpp), of indices into `bodies`
  /// \param materials of each MaterialId that occurs; a vector or span of them will do
  /// \param boundaries half-spaces with unit normals, in increasing order of their numbers
  /// \param nearBoundaries indices of all bodies that may touch a boundary, increasing; without it every body
  ///        is looked at
  /// \throws std::invalid_argument for a body that is not there, a material id without an entry, boundaries
  ///         out of order, or a setting out of range
  template <ContactBodies B>
  void find(std::span<const Pair> pairs, const B& bodies, const Domain<S>& domain,
            const MaterialView<S>& materials, std::span<const HalfSpace<S>> boundaries,
            const NarrowPhaseSettings<S>& settings, ContactList<S>& out,
            std::optional<std::span<const std::uint32_t>> nearBoundaries = std::nullopt) {
    detail::requireWhole(bodies);
    validate(settings);
    const auto requireByBody = [&](const char* what, std::size_t length) {
      if (length != 0 && length != bodies.size()) {
        detail::refuse(what, std::to_string(length),
                       "0, or the number of bodies, " + std::to_string(bodies.size()));
      }
    };
    requireByBody("length of what carries bodies", settings.carried.size());
    requireByBody("length of what frames add", settings.bend.size());
    requireByBody("length of who leans", settings.leaning.size());
    walls_.find(bodies, materials, boundaries, settings, nearBoundaries);
    if (!pairs.empty()) {
      spheres_.resize(bodies.size());
      parallelFor(bodies.size(), chunk, [&](std::size_t i) {
        spheres_[i] = {bodies.positions()[i], bodies.radii()[i]};
      });
    }
    touching_.resize(pairs.size());
    parts_.resize((pairs.size() + chunk - 1) / chunk);
    parallelForChunks<Share::Alike>(pairs.size(), chunk, [&](std::size_t begin, std::size_t end) {
      Part part;
      Cursor cursor = 0;
      for (std::size_t k = begin; k < end; ++k) {
        touching_[k] = touches(pairs[k], bodies, domain, materials, settings, cursor) ? 1 : 0;
        if (touching_[k] != 0) {
          ++part.count;
          part.end = k + 1;
        }
      }
      parts_[begin / chunk] = part;
    });
    merge(pairs, bodies, domain, materials, settings, out);
    detail::giveBack(spheres_);
    detail::giveBack(touching_);
    walls_.forget();
  }

  /// Of the contacts of the last find().
  const ContactFacts<S>& facts() const { return facts_; }

 private:
  using Cursor = detail::RestingCursor;
  static constexpr std::size_t chunk = detail::contactChunk;

  template <class B>
  static ContactKeys keysOf(Pair pair, const B& bodies) {
    return {bodies.ids()[pair.first], bodies.ids()[pair.second]};
  }

  /// Pairs and boundaries in the order of keys, part by part. The geometry of pairs is found once more: that
  /// is less than to keep it meanwhile.
  template <class B>
  void merge(std::span<const Pair> pairs, const B& bodies, const Domain<S>& domain,
             const MaterialView<S>& materials, const NarrowPhaseSettings<S>& settings, ContactList<S>& out) {
    const std::size_t used = parts_.size();
    const auto before = [](const Contact<S>& wall, const ContactKeys& keys) { return wall.keys() < keys; };
    const std::vector<Contact<S>>& boundaryContacts = walls_.contacts();
    starts_.assign(1, {0, 0});
    for (std::size_t p = 0; p < used; ++p) {
      Start next = starts_.back();
      if (parts_[p].count > 0) {
        const auto end = std::lower_bound(boundaryContacts.begin(), boundaryContacts.end(),
                                          keysOf(pairs[parts_[p].end - 1], bodies), before);
        next.wall = static_cast<std::size_t>(end - boundaryContacts.begin());
        next.place += parts_[p].count + next.wall - starts_.back().wall;
      }
      starts_.push_back(next);
    }
    const Start last = starts_.back();
    detail::resizeAnew(out.contacts, last.place + boundaryContacts.size() - last.wall);
    out.surfaces.clear();
    for (std::uint32_t m = 0; m < materials.size(); ++m) {
      out.surfaces.push_back({materials.pair(m, m)});
    }
    out.surfaces.insert(out.surfaces.end(), walls_.surfaces().begin(), walls_.surfaces().end());
    const auto common = static_cast<std::uint32_t>(out.surfaces.size());
    own_.resize(std::max(own_.size(), used));
    factsOfParts_.assign(used + 1, ContactFacts<S>{});
    const auto look = [&](std::size_t k, const S& r, ContactFacts<S>& part) {
      part.include(out[k], r, detail::isNamed(settings.before, k, out[k]));
    };
    const auto takeWall = [&](std::size_t wall, std::size_t place, ContactFacts<S>& part) {
      out[place] = boundaryContacts[wall];
      look(place, bodies.radii()[out[place].first], part);
    };
    parallelForTasks<Share::Alike>(used, [&](std::size_t p) {
      auto [wall, place] = starts_[p];
      ContactFacts<S> part;
      detail::SurfaceNumbers<S>& own = own_[p];
      own.clear();
      std::uint32_t alike = common;  // material of the last two that had the same one
      for (std::size_t k = p * chunk; k < parts_[p].end; ++k) {
        if (touching_[k] == 0) {
          continue;
        }
        const Pair pair = pairs[k];
        const auto [i, j] = pair;
        const ContactKeys keys = keysOf(pair, bodies);
        while (wall < starts_[p + 1].wall && before(boundaryContacts[wall], keys)) {
          takeWall(wall++, place++, part);
        }
        Vector3<S> drift;
        const Vector3<S> r_ij = separation(pair, domain, settings, drift);
        const S reach = spheres_[i].r + spheres_[j].r;
        const Touch<S> touch = touchAt<S>(r_ij, detail::safeNorm(r_ij), spheres_[i].r, reach, keys.first,
                                          keys.second, settings.epsilon);
        const std::uint32_t m_i = bodies.materials()[i];
        const std::uint32_t m_j = bodies.materials()[j];
        out[place] = {i, j, keys.first, keys.second, touch.normal, touch.gap, touch.arm1, touch.arm2, m_i};
        const bool drifts = detail::equalIsSame<S> ? !(drift == Vector3<S>::Zero()) : !domain.isOpen();
        if (m_i != m_j || drifts) {
          const auto [m_1, m_2] = std::minmax(m_i, m_j);
          out[place].surface = common + own.of(m_1, m_2, drift, [&, m_1 = m_1, m_2 = m_2] {
            return materials.pair(m_1, m_2);
          });
        } else if (m_i != alike) {
          alike = m_i;
          part.kinds.include(out.surfaces[m_i]);
        }
        look(place, detail::smallerRadius<S>(spheres_[i].r, spheres_[j].r), part);
        ++place;
      }
      factsOfParts_[p] = part;
    });
    for (std::size_t wall = last.wall, place = last.place; place < out.size(); ++wall, ++place) {
      takeWall(wall, place, factsOfParts_[used]);
    }
    facts_ = {};
    for (const ContactSurface<S>& surface : walls_.surfaces()) {
      facts_.kinds.include(surface);
    }
    allOwn_.clear();
    numbers_.clear();
    firstNumbers_.assign(1, 0);
    for (std::size_t p = 0; p < used; ++p) {
      allOwn_.add(own_[p], numbers_);
      firstNumbers_.push_back(numbers_.size());
    }
    for (const ContactSurface<S>& surface : allOwn_.surfaces()) {
      facts_.kinds.include(surface);
      out.surfaces.push_back(surface);
    }
    parallelForTasks<Share::Alike>(used, [&](std::size_t p) {
      const std::size_t first = firstNumbers_[p];
      const bool any = first < firstNumbers_[p + 1];
      for (std::size_t k = starts_[p].place; any && k < starts_[p + 1].place; ++k) {
        std::uint32_t& number = out[k].surface;
        number = number < common ? number : common + numbers_[first + (number - common)];
      }
    });
    for (const ContactFacts<S>& part : factsOfParts_) {
      facts_ += part;
    }
  }

  /// From the first centre to the nearest image of the second, which moves on by `drift` more.
  [[gnu::always_inline]] inline Vector3<S> separation(Pair pair, const Domain<S>& domain,
                                                      const NarrowPhaseSettings<S>& settings,
                                                      Vector3<S>& drift) const {
    Vector3<S> r_ij = spheres_[pair.second].x - spheres_[pair.first].x;
    drift = Vector3<S>(S(0), S(0), S(0));
    if (!domain.isOpen()) {
      domain.minimumImage(r_ij, drift, settings.time);
    }
    return r_ij;
  }

  template <class B>
  [[gnu::flatten]] bool touches(Pair pair, const B& bodies, const Domain<S>& domain,
                                const MaterialView<S>& materials, const NarrowPhaseSettings<S>& settings,
                                Cursor& cursor) const {
    const std::uint32_t i = pair.first;
    const std::uint32_t j = pair.second;
    detail::requireBodies(pair, spheres_.size());
    Vector3<S> drift;
    const Vector3<S> r_ij = separation(pair, domain, settings, drift);
    const S reach = spheres_[i].r + spheres_[j].r;
    const S far = reach + detail::widestMargin(settings, reach);
    const S distance_sq = r_ij.squaredNorm();
    if (distance_sq > far * far) {
      return false;  // the common case, before anything else is loaded
    }
    // A root is taken only where rounding could matter.
    const S near = (S(1) - S(16) * detail::roundoff<S>()) * (reach + settings.margin);
    const bool surely = distance_sq < near * near;
    const S distance = surely ? S(0) : detail::safeNorm(r_ij);
    const bool overlaps = surely || distance < reach + settings.margin;
    const auto falls = [&] {
      const bool bothLean = !settings.leaning.empty() && settings.leaning[i] != 0 && settings.leaning[j] != 0;
      const bool lean = bothLean || !detail::isMovable(bodies, i) || !detail::isMovable(bodies, j);
      return S(detail::accelerationOf(settings, bodies, i, lean) +
               detail::accelerationOf(settings, bodies, j, lean));
    };
    if (!(reach > S(0)) || (!overlaps && !(distance < reach + detail::marginOf(settings, reach, falls)))) {
      return false;
    }
    if (!detail::canTouch(bodies, i, j)) {
      return false;
    }
    const auto mayBegin = [&] {
      const Vector3<S> u = detail::velocityOf(bodies, j) - detail::velocityOf(bodies, i) + drift;
      return detail::mayBegin<S>(settings, S(distance - reach), reach, S(-r_ij.dot(u) / distance), falls());
    };
    if (!overlaps && !detail::mayRest(settings, keysOf(pair, bodies), cursor) && !mayBegin()) {
      return false;
    }
    materials.require(bodies.materials()[i], i);  // refused while the list is what it was
    materials.require(bodies.materials()[j], j);
    return true;
  }

  /// Place and radius of a body: in double half a cache line.
  struct alignas(alignof(S) > 32 ? alignof(S) : 32) Sphere {
    Vector3<S> x;
    S r;
  };

  /// Of the candidates of a chunk those that touch.
  struct Part {
    std::size_t count = 0;
    std::size_t end = 0;  ///< of the last of them; 0 if there are none
  };

  /// Where a part begins among the boundaries' contacts and in the list.
  struct Start {
    std::size_t wall;
    std::size_t place;
  };

  std::vector<Sphere> spheres_;
  std::vector<std::uint8_t> touching_;          ///< by candidate
  std::vector<Part> parts_;                     ///< by chunk of them
  std::vector<detail::SurfaceNumbers<S>> own_;  ///< by part: of pairs of two materials, and that drift
  detail::SurfaceNumbers<S> allOwn_;            ///< of all parts
  std::vector<std::uint32_t> numbers_;          ///< there, of each of each part's own
  std::vector<std::size_t> firstNumbers_;       ///< by part
  std::vector<Start> starts_;
  detail::BoundaryContacts<S> walls_;
  std::vector<ContactFacts<S>> factsOfParts_;
  ContactFacts<S> facts_;
};

}  // namespace gravel
