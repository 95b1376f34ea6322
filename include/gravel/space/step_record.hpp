#pragma once

/// \file
/// What happened in the part of a step that is over, for reports of the whole step.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/impact.hpp>

#include <span>
#include <vector>

namespace gravel {

/// Impulses and impacts of the parts of a step before the last one.
template <Real Scalar>
class StepRecord {
 public:
  /// A new step begins.
  void clear() {
    keys_.clear();
    sums_.clear();
    impacts_.clear();
    parts_ = 1;
  }

  /// Adds the impulses of a solve, in the order of their keys, keysOf(k). O(contacts).
  template <class KeysOf>
  void add(std::span<const ContactImpulse<Scalar>> impulses, KeysOf&& keysOf) {
    keysBefore_.swap(keys_);
    sumsBefore_.swap(sums_);
    keys_.clear();
    sums_.clear();
    std::size_t m = 0;
    for (std::size_t k = 0; k < impulses.size(); ++k) {
      const ContactKeys keys = keysOf(k);
      for (; m < keysBefore_.size() && keysBefore_[m] < keys; ++m) {
        keys_.push_back(keysBefore_[m]);
        sums_.push_back(sumsBefore_[m]);
      }
      keys_.push_back(keys);
      sums_.push_back(impulses[k]);
      if (m < keysBefore_.size() && keysBefore_[m] == keys) {
        join(sums_.back(), sumsBefore_[m++]);
      }
    }
    keys_.insert(keys_.end(), keysBefore_.begin() + static_cast<std::ptrdiff_t>(m), keysBefore_.end());
    sums_.insert(sums_.end(), sumsBefore_.begin() + static_cast<std::ptrdiff_t>(m), sumsBefore_.end());
  }

  /// Adds what is recorded here to the impulses `sum` of contacts. A contact that ended before is not among
  /// them. O(contacts).
  void addTo(std::vector<ContactImpulse<Scalar>>& sum, std::span<const Contact<Scalar>> contacts) const {
    addTo(sum, contacts, sums_, [&](std::size_t k) { return keys_[k]; });
  }
  /// The same of one solve.
  template <class KeysOf>
  static void addTo(std::vector<ContactImpulse<Scalar>>& sum, std::span<const Contact<Scalar>> contacts,
                    std::span<const ContactImpulse<Scalar>> impulses, KeysOf&& keysOf) {
    std::size_t m = 0;
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const ContactKeys keys{contacts[k].key1, contacts[k].key2};
      while (m < impulses.size() && keysOf(m) < keys) {
        ++m;
      }
      if (m < impulses.size() && keysOf(m) == keys) {
        join(sum[k], impulses[m]);
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

  std::vector<ContactKeys> keys_;  ///< sorted
  std::vector<ContactImpulse<Scalar>> sums_;
  std::vector<ContactKeys> keysBefore_;
  std::vector<ContactImpulse<Scalar>> sumsBefore_;
  std::vector<Impact<Scalar>> impacts_;
  std::size_t parts_ = 1;
};

}  // namespace gravel
