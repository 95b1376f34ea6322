#pragma once

/// \file
/// What happened in the part of a step that is over, for reports of the whole step.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/impact.hpp>
#include <gravel/core/memory.hpp>

#include <span>
#include <vector>

namespace gravel {

/// Impulses and impacts of the parts of a step before the last one.
template <Real Scalar>
class StepRecord {
 public:
  /// A new step begins. Room for impulses is kept from one step in several parts to the next one alone.
  void clear() {
    if (entries_.empty()) {
      detail::release(entries_);
      detail::release(before_);
    }
    entries_.clear();
    impacts_.clear();
    parts_ = 1;
  }

  /// Adds the impulses of a solve. O(contacts).
  /// \param forEach  calls visit(contact, impulse) for all of them, in the order of their keys
  template <class ForEach>
  void add(ForEach&& forEach) {
    before_.swap(entries_);
    entries_.clear();
    auto old = before_.begin();
    forEach([&](const Contact<Scalar>& c, const ContactImpulse<Scalar>& impulse) {
      for (; old != before_.end() && byKeys(old->contact, c); ++old) {
        entries_.push_back(*old);
      }
      entries_.push_back({c, impulse});
      if (old != before_.end() && !byKeys(c, old->contact)) {
        join(entries_.back().sum, (old++)->sum);
      }
    });
    entries_.insert(entries_.end(), old, before_.end());
  }

  /// Adds what is recorded here to the impulses `sum` of contacts, which are in the order of their keys. A
  /// contact that ended before is not among them. O(contacts).
  void addTo(std::vector<ContactImpulse<Scalar>>& sum, std::span<const Contact<Scalar>> contacts) const {
    auto entry = entries_.begin();
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      while (entry != entries_.end() && byKeys(entry->contact, contacts[k])) {
        ++entry;
      }
      if (entry != entries_.end() && !byKeys(contacts[k], entry->contact)) {
        join(sum[k], entry->sum);
      }
    }
  }

  /// Calls visit(contact, impulse) for what is recorded here and is none of these contacts. O(contacts).
  template <class Visit>
  void forEachEnded(std::span<const Contact<Scalar>> contacts, Visit&& visit) const {
    auto c = contacts.begin();
    for (const Entry& entry : entries_) {
      while (c != contacts.end() && byKeys(*c, entry.contact)) {
        ++c;
      }
      if (c == contacts.end() || byKeys(entry.contact, *c)) {
        visit(entry.contact, entry.sum);
      }
    }
  }

  /// A part is over that began `start` [s] after the step; another one follows.
  void endPart(std::span<const Impact<Scalar>> impacts, const Scalar& start) {
    addImpacts(impacts, start);
    ++parts_;
  }

  /// The impacts of the last part.
  void addImpacts(std::span<const Impact<Scalar>> impacts, const Scalar& start) {
    for (Impact<Scalar> impact : impacts) {
      impact.time += start;
      impact.settle += start;
      impacts_.push_back(impact);
    }
  }

  /// The impulses that are recorded here, alone.
  StepRecord ofContacts() const {
    StepRecord impulses;
    impulses.entries_ = entries_;
    return impulses;
  }

  bool hasParts() const { return parts_ > 1; }
  /// In their order, with times since the start of the step. Of a step in one part there are none here.
  const std::vector<Impact<Scalar>>& impacts() const { return impacts_; }
  std::vector<Impact<Scalar>>& impacts() { return impacts_; }

 private:
  static void join(ContactImpulse<Scalar>& sum, const ContactImpulse<Scalar>& part) {
    sum.normal += part.normal;
    sum.tangential += part.tangential;
    sum.turning += part.turning;
  }

  struct Entry {
    Contact<Scalar> contact;  ///< as it was last
    ContactImpulse<Scalar> sum;
  };
  std::vector<Entry> entries_;  ///< in the order of their keys
  std::vector<Entry> before_;
  std::vector<Impact<Scalar>> impacts_;
  std::size_t parts_ = 1;
};

}  // namespace gravel
