#pragma once

/// \file
/// What happened in the part of a step that is over, for reports of the whole step.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/impact.hpp>
#include <gravel/core/parallel.hpp>

#include <algorithm>
#include <span>
#include <vector>

namespace gravel {

/// Impulses and impacts of the parts of a step before the last one.
template <Real Scalar>
class StepRecord {
 public:
  /// A new step begins.
  void clear() {
    holds_ = false;  // vectors keep their size: to fill them with zeros first takes as long as to copy
    impacts_.clear();
    parts_ = 1;
  }

  /// Adds the impulses of a solve, both in the order of keys. O(contacts).
  void add(std::span<const Contact<Scalar>> contacts, std::span<const ContactImpulse<Scalar>> impulses) {
    if (!holds_) {
      holds_ = true;
      const std::size_t count = std::min(contacts.size(), impulses.size());
      keys_.resize(count);
      sums_.resize(count);
      parallelFor(count, 1024, [&](std::size_t k) {
        keys_[k] = {contacts[k].key1, contacts[k].key2};
        sums_[k] = impulses[k];
      });
      return;
    }
    keysBefore_.swap(keys_);
    sumsBefore_.swap(sums_);
    keys_.clear();
    sums_.clear();
    std::size_t m = 0;
    for (std::size_t k = 0; k < contacts.size() && k < impulses.size(); ++k) {
      const ContactKeys keys{contacts[k].key1, contacts[k].key2};
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

  /// The impulses of all parts: the last ones, given in the order of contacts, with those recorded here. A
  /// contact that ended before is not among them. O(contacts).
  std::vector<ContactImpulse<Scalar>> sum(std::span<const Contact<Scalar>> contacts,
                                          std::span<const ContactImpulse<Scalar>> last) const {
    std::vector<ContactImpulse<Scalar>> sum;
    const std::size_t count = holds_ ? keys_.size() : 0;
    std::size_t m = 0;
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      sum.push_back(k < last.size() ? last[k] : ContactImpulse<Scalar>{});
      const ContactKeys keys{contacts[k].key1, contacts[k].key2};
      while (m < count && keys_[m] < keys) {
        ++m;
      }
      if (m < count && keys_[m] == keys) {
        join(sum.back(), sums_[m]);
      }
    }
    return sum;
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
  bool holds_ = false;  ///< keys_ and sums_ are of this step
};

}  // namespace gravel
