#pragma once

/// \file
/// The impulses of contacts that have given way to others, and their passage to those that are the same.

#include <gravel/contact/contact_coloring.hpp>
#include <gravel/contact/impulse_list.hpp>
#include <gravel/contact/solver_rows.hpp>

#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace gravel {

/// What is remembered of a contact from step to step.
template <Real Scalar>
struct StoredImpulse {
  std::uint64_t key1;
  std::uint64_t key2;
  ContactImpulse<Scalar> impulse;

  ContactKeys keys() const { return {key1, key2}; }
  friend bool operator==(const StoredImpulse&, const StoredImpulse&) = default;
};

namespace detail {

/// By contact, its row.
inline void findRows(std::span<const ContactColoring::Row> rows, std::vector<std::uint32_t>& rowOf) {
  resizeAnew(rowOf, rows.size());
  parallelFor(rows.size(), 512,
              [&](std::size_t r) { rowOf[rows[r].contact] = static_cast<std::uint32_t>(r); });
}

/// A contact that is over, where it was solved last (its gap is not known), and what it bore there.
template <Real S>
struct EndedContact {
  Contact<S> contact;
  ContactImpulse<S> impulse;
};

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

  /// They are those of the present contacts, whose names are known elsewhere.
  void forgetNames() {
    giveBack(names_);
    giveBack(rowOf_);
  }

  /// In the order of the rows that they were solved in.
  ImpulseList<S>& impulses() { return impulses_; }
  const ImpulseList<S>& impulses() const { return impulses_; }

  const ContactKeys& keys(std::size_t k) const { return names_[k].keys; }
  /// In the order of the keys.
  std::vector<ContactImpulse<S>> listed() const {
    return impulses_.listed([&](std::size_t k) { return rowOf_[k]; });
  }

  /// What bore something and is none of these contacts, which are sorted by keys. O(contacts).
  /// \param solved  the rows in which they were solved
  template <ContactBodies B>
  void findEnded(std::span<const Contact<S>> contacts, std::span<const SolverRow<S>> solved, const B& bodies,
                 std::vector<EndedContact<S>>& ended) const {
    std::vector<std::vector<EndedContact<S>>> parts(Chunks(names_.size(), fewNames).count());
    parallelForChunks<Share::Alike>(names_.size(), fewNames, [&](std::size_t begin, std::size_t end) {
      auto c = std::lower_bound(
          contacts.begin(), contacts.end(), names_[begin].keys,
          [](const Contact<S>& contact, const ContactKeys& keys) { return contact.keys() < keys; });
      for (std::size_t k = begin; k < end; ++k) {
        const auto& [keys, first, second] = names_[k];
        while (c != contacts.end() && c->keys() < keys) {
          ++c;
        }
        const bool goesOn = c != contacts.end() && c->keys() == keys;
        const bool there = first < bodies.size() && (second < bodies.size() || second == staticPartner);
        if (!goesOn && there && impulses_.normal(rowOf_[k]) > S(0)) {
          const SolverRow<S>& row = solved[rowOf_[k]];
          const S arm1 = row.c1 * S(bodies.radii()[first]);
          const S arm2 = second == staticPartner ? S(0) : S(row.c2 * S(bodies.radii()[second]));
          parts[begin / fewNames].push_back(
              {{first, second, keys.first, keys.second, row.n, S(0), arm1, arm2}, impulses_.get(rowOf_[k])});
        }
      }
    });
    for (const std::vector<EndedContact<S>>& part : parts) {
      ended.insert(ended.end(), part.begin(), part.end());
    }
  }

  /// Hands on what it has of other contacts, zero of those that it does not know. O(contacts).
  /// \param contacts sorted by keys, whose names go to `names`, impulses in the order of `rows` to `impulses`
  void handOn(std::span<const Contact<S>> contacts, std::span<const ContactColoring::Row> rows,
              std::vector<ContactName>& names, ImpulseList<S>& impulses) {
    resizeAnew(names, contacts.size());
    std::vector<std::uint32_t> origins(contacts.size());  // of each contact its row here, or staticPartner
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
        origins[k] = known ? rowOf_[static_cast<std::size_t>(old - names_.begin())] : staticPartner;
      }
    });
    impulses.resize(contacts.size(), impulses_.turns());
    parallelFor(contacts.size(), chunk, [&](std::size_t r) {
      const std::uint32_t origin = origins[rows[r].contact];
      impulses.set(r, origin != staticPartner ? impulses_.get(origin) : ContactImpulse<S>{});
    });
  }

 private:
  static constexpr std::size_t chunk = 512;
  static constexpr std::size_t fewNames = 4096;

  std::vector<ContactName> names_;
  ImpulseList<S> impulses_;           ///< in the order of their rows
  std::vector<std::uint32_t> rowOf_;  ///< by contact, in the order of names
};

}  // namespace detail

}  // namespace gravel
