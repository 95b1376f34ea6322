#pragma once

/// \file
/// Contacts with what their surfaces are: many share one, so that a contact holds its number alone.

#include <gravel/contact/contact.hpp>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
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

  /// Of this contact alone. O(1): a surface that nobody has any more stays until setDrift() or clear().
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

  /// Another drift, with its change, for the contacts c that which(c) tells; those that shared a surface
  /// share the new one, and surfaces that no contact has are forgotten. O(contacts + surfaces). \return
  /// whether there are any
  template <class Which>
  bool setDrift(const Vector3<Scalar>& drift, const Scalar& driftChange, Which&& which) {
    constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::array<std::uint32_t, 2>> numbers(surfaces.size(), {none, none});  // old and new drift
    std::vector<ContactSurface<Scalar>> used;
    bool any = false;
    for (Contact<Scalar>& c : contacts) {
      const bool other = which(c);
      std::uint32_t& number = numbers[c.surface][other ? 1 : 0];
      if (number == none) {
        number = static_cast<std::uint32_t>(used.size());
        used.push_back(surfaces[c.surface]);
        if (other) {
          used.back().drift = drift;
          used.back().driftChange = driftChange;
        }
      }
      c.surface = number;
      any = any || other;
    }
    surfaces.swap(used);
    return any;
  }
};

}  // namespace gravel
