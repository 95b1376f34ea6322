#pragma once

/// \file
/// The impulses of contacts that have given way to others, and their passage to those that are the same.

#include <gravel/contact/contact_coloring.hpp>
#include <gravel/contact/impulse_list.hpp>

#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace gravel::detail {

/// By contact, its row.
inline void findRows(std::span<const ContactColoring::Row> rows, std::vector<std::uint32_t>& rowOf) {
  resizeAnew(rowOf, rows.size());
  parallelFor(rows.size(), 512,
              [&](std::size_t r) { rowOf[rows[r].contact] = static_cast<std::uint32_t>(r); });
}

template <Real S>
class EarlierImpulses {
 public:
  /// Takes what contacts have got; leaves in its place what was here before, which is of no use.
  /// \param names  of the contacts, sorted
  /// \param impulses  in the order of `rows`; without rows, in that of the contacts
  void take(std::vector<ContactName>& names, ImpulseList<S>& impulses,
            std::span<const ContactColoring::Row> rows) {
    std::swap(impulses_, impulses);
    name(names, rows);
  }
  /// Takes the names of those that are here.
  void name(std::vector<ContactName>& names, std::span<const ContactColoring::Row> rows) {
    std::swap(names_, names);
    findRows(rows, rowOf_);
    if (rows.empty()) {
      rowOf_.resize(names_.size());
      std::iota(rowOf_.begin(), rowOf_.end(), 0U);
    }
  }

  /// In the order of the rows that they were solved in.
  ImpulseList<S>& impulses() { return impulses_; }
  const ImpulseList<S>& impulses() const { return impulses_; }

  const ContactKeys& keys(std::size_t k) const { return names_[k].keys; }
  /// In the order of the keys.
  std::vector<ContactImpulse<S>> listed() const {
    return impulses_.listed([&](std::size_t k) { return rowOf_[k]; });
  }

  /// Hands on what it has of other contacts, zero of those that it does not know. O(contacts).
  /// \param contacts sorted by keys, whose names go to `names`, impulses in the order of `rows` to `impulses`
  void handOn(std::span<const Contact<S>> contacts, std::span<const ContactColoring::Row> rows,
              std::vector<ContactName>& names, ImpulseList<S>& impulses) {
    resizeAnew(names, contacts.size());
    resizeAnew(origins_, contacts.size());
    parallelForChunks<Share::Alike>(contacts.size(), chunk, [&](std::size_t begin, std::size_t end) {
      const auto earlier = [](const ContactName& name, const ContactKeys& keys) { return name.keys < keys; };
      auto old =
          std::lower_bound(names_.begin(), names_.end(), ContactName::of(contacts[begin]).keys, earlier);
      for (std::size_t k = begin; k < end; ++k) {
        names[k] = ContactName::of(contacts[k]);
        while (old != names_.end() && old->keys < names[k].keys) {
          ++old;
        }
        const bool known = old != names_.end() && old->keys == names[k].keys;
        origins_[k] = known ? rowOf_[static_cast<std::size_t>(old - names_.begin())] : staticPartner;
      }
    });
    impulses.resize(contacts.size(), impulses_.turns());
    parallelFor(contacts.size(), chunk, [&](std::size_t r) {
      const std::uint32_t origin = origins_[rows[r].contact];
      impulses.set(r, origin != staticPartner ? impulses_.get(origin) : ContactImpulse<S>{});
    });
  }

 private:
  static constexpr std::size_t chunk = 512;

  std::vector<ContactName> names_;
  ImpulseList<S> impulses_;             ///< in the order of their rows
  std::vector<std::uint32_t> rowOf_;    ///< by contact, in the order of names
  std::vector<std::uint32_t> origins_;  ///< by a contact that is handed on to: its row here, or staticPartner
};

}  // namespace gravel::detail
