#pragma once

/// \file
/// How sweeps over contacts that hang together go on, and when they end.

#include <gravel/contact/contact_settings.hpp>

#include <cmath>

namespace gravel::detail {

/// What a sweep did: largest change of a velocity, squared; and the square, over mass, of the changes of the
/// impulses.
template <Real S>
struct SweepProgress {
  S change_sq = S(0);
  S size = S(0);
  S along = S(0);           ///< the same product of these changes and the steps of the sweep before
  std::size_t changed = 0;  ///< rows by more than they may
  std::size_t looked = 0;   ///< rows that were not passed over
  SweepProgress& operator+=(const SweepProgress& other) {
    change_sq = std::max<S>(change_sq, other.change_sq);
    size += other.size;
    along += other.along;
    changed += other.changed;
    looked += other.looked;
    return *this;
  }
};

/// Sweeps until changes are a share of what the contacts ask for, at most as many as may be.
template <Real S>
class SweepCourse {
 public:
  /// \param enough  a change that ends them \param most  sweeps, >= 1
  SweepCourse(const S& enough, int most) : enough_(enough), most_(most) {}

  /// Changes up to that are right, too.
  void allow(const S& change) { enough_ = std::max<S>(enough_, change); }
  int sweeps() const { return sweeps_; }
  /// Of the last sweep.
  const S& change() const { return change_; }
  /// The share of its last step with which the next sweep begins.
  const S& share() const { return share_; }
  /// The last sweep ended at its changes.
  bool isRight() const { return !(change_ > enough_); }

  /// A sweep more. \return whether it is to be asked who slides
  bool take(const SweepProgress<S>& now) {
    using std::sqrt;
    ++sweeps_;
    change_ = sqrt(now.change_sq);
    const bool half = sweeps_ == most_ - most_ / 2;
    return sweeps_ < most_ && (isRight() || half);
  }
  /// Who slips by more than that slides. A slip that goes back by a share of itself a sweep is many changes
  /// long, and will be none. With half of the sweeps gone there is no time to wait for that. See
  /// docs/theory-contact.md, "Who slides".
  S slides() const { return S(isRight() ? 32 : 4) * change_; }

  /// \param more  some began to slide \return whether another sweep follows
  bool goesOn(bool more) const { return sweeps_ < most_ && (!isRight() || more); }

  /// The first sweep with a share is to come, or none of them has any.
  void begin(const SweepProgress<S>& now, bool more) { before_ = more ? S(0) : now.size; }
  /// Another one with a share.
  void goOn(const SweepProgress<S>& now, bool more) {
    const S next = more ? S(0) : shareAfter(now);
    bare_ = !more && share_ == S(0);
    share_ = next;
    before_ = more ? S(0) : now.size;
  }

 private:
  S shareAfter(const SweepProgress<S>& now) const {
    if (share_ < S(0)) {
      return S(0);  // to see whether sweeps still turn back
    }
    if (share_ == S(0) && now.along < S(0)) {
      return bare_ ? S(now.along / (before_ - now.along)) : S(0);
    }
    // At high mass ratios changes fall by less than their rounding: that is no reason to begin anew.
    return now.size < S(1.001) * before_ ? std::min<S>(S(1), now.size / before_) : S(0);
  }

  S enough_;
  int most_;
  int sweeps_ = 0;
  S change_ = S(0);
  S share_ = S(0);
  S before_ = S(0);    ///< square of the changes of the last sweep
  bool bare_ = false;  ///< that one had no share
};

}  // namespace gravel::detail
