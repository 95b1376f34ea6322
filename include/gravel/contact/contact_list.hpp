#pragma once

/// \file
/// Contacts with what their surfaces are: many share one, so that a contact holds its number alone.

#include <gravel/contact/contact.hpp>

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace gravel {

/// What is between the two sides of a contact.
template <Real Scalar>
struct ContactSurface {
  Material<Scalar> material{};  ///< of the pair, mixed
  /// [m s^-1] to be added to the velocity of the second: of its image in a sheared domain, of a moving
  /// boundary.
  Vector3<Scalar> drift = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));
  Scalar driftChange = Scalar(0);  ///< [m s^-1] of the drift along the normal in a step: it does not bounce

  friend bool operator==(const ContactSurface&, const ContactSurface&) = default;
};

/// How a boundary moves, for what touches it.
template <Real Scalar>
struct SurfaceDrift {
  Vector3<Scalar> velocity;   ///< `ContactSurface::drift`
  Scalar change = Scalar(0);  ///< `ContactSurface::driftChange`
};

/// Contacts and their surfaces, seen. Owns nothing.
template <Real Scalar>
struct ContactView {
  std::span<const Contact<Scalar>> contacts;
  std::span<const ContactSurface<Scalar>> surfaces;  ///< by `Contact::surface`

  std::size_t size() const { return contacts.size(); }
  bool empty() const { return contacts.empty(); }
  auto begin() const { return contacts.begin(); }
  auto end() const { return contacts.end(); }
  const Contact<Scalar>& operator[](std::size_t k) const { return contacts[k]; }

  const ContactSurface<Scalar>& surface(const Contact<Scalar>& c) const { return surfaces[c.surface]; }
  const Material<Scalar>& material(const Contact<Scalar>& c) const { return surface(c).material; }
  const Vector3<Scalar>& drift(const Contact<Scalar>& c) const { return surface(c).drift; }
};

/// A range of contacts that owns their surfaces, too. Neither a new order of the contacts nor some that leave
/// change the numbers of surfaces.
template <Real Scalar>
struct ContactList {
  std::vector<Contact<Scalar>> contacts;
  std::vector<ContactSurface<Scalar>> surfaces;  ///< by `Contact::surface`

  std::size_t size() const { return contacts.size(); }
  bool empty() const { return contacts.empty(); }
  auto begin() const { return contacts.begin(); }
  auto end() const { return contacts.end(); }
  auto begin() { return contacts.begin(); }
  auto end() { return contacts.end(); }
  const Contact<Scalar>& operator[](std::size_t k) const { return contacts[k]; }
  Contact<Scalar>& operator[](std::size_t k) { return contacts[k]; }

  operator ContactView<Scalar>() const { return {contacts, surfaces}; }

  const ContactSurface<Scalar>& surface(const Contact<Scalar>& c) const { return surfaces[c.surface]; }
  const Material<Scalar>& material(const Contact<Scalar>& c) const { return surface(c).material; }
  const Vector3<Scalar>& drift(const Contact<Scalar>& c) const { return surface(c).drift; }

  /// Of this contact alone. O(1): a surface that nobody has any more stays until setDrifts() or clear().
  void setSurface(Contact<Scalar>& c, const ContactSurface<Scalar>& surface) {
    if (surfaces.empty() || !detail::equalIsSame<Scalar> || !(surfaces.back() == surface)) {
      surfaces.push_back(surface);
    }
    c.surface = static_cast<std::uint32_t>(surfaces.size() - 1);
  }
  void push_back(Contact<Scalar> c, const ContactSurface<Scalar>& surface) {
    setSurface(c, surface);
    contacts.push_back(c);
  }
  void clear() {
    contacts.clear();
    surfaces.clear();
  }

  /// Other drifts, for the contacts c of which driftOf(c) tells one that lasts for the call, and not nullptr;
  /// those that shared a surface and are told the same one share the new one, and surfaces that no contact
  /// has are forgotten. Where all have it already nothing changes. O(contacts + surfaces). \return whether
  /// any has another
  template <class DriftOf>
  bool setDrifts(DriftOf&& driftOf) {
    const auto otherOf = [&](const Contact<Scalar>& c) -> const SurfaceDrift<Scalar>* {
      const SurfaceDrift<Scalar>* const now = driftOf(c);
      const bool same = now != nullptr && detail::equalIsSame<Scalar> && surface(c).drift == now->velocity &&
                        surface(c).driftChange == now->change;
      return same ? nullptr : now;
    };
    const bool any = std::any_of(begin(), end(), otherOf);
    if (!any && surfaces.size() <= contacts.size()) {
      return false;
    }
    std::map<std::pair<std::uint32_t, const SurfaceDrift<Scalar>*>, std::uint32_t> numbers;
    std::vector<ContactSurface<Scalar>> used;
    for (Contact<Scalar>& c : contacts) {
      const SurfaceDrift<Scalar>* const other = otherOf(c);
      const auto [place, isNew] =
          numbers.try_emplace({c.surface, other}, static_cast<std::uint32_t>(used.size()));
      if (isNew) {
        used.push_back(surface(c));
        if (other != nullptr) {
          used.back().drift = other->velocity;
          used.back().driftChange = other->change;
        }
      }
      c.surface = place->second;
    }
    surfaces.swap(used);
    return any;
  }
};

}  // namespace gravel
