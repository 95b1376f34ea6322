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
  /// \param enough  a change that ends them \param most  sweeps, >= 1 \param leaps  whoever sweeps does
  SweepCourse(const S& enough, int most, bool leaps = false)
      : enough_(enough), most_(most), mayLeap_(leaps && most >= patience + 2) {}

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
    const int phase = sweeps_ % patience;
    const bool probes = mayLeap_ && phase + 2 >= patience;  // the next one is bare
    leap_ = S(0);
    if (mayLeap_ && phase == 0 && !more && bare_ && share_ == S(0)) {
      leap_ = change_ < changeAtLeap_ / S(2) ? leapAfter(now) : S(0);  // what is left may be rounding
      mayLeap_ = leap_ > S(0);
      changeAtLeap_ = change_;
    }
    const S next = more || probes || leap_ > S(0) ? S(0) : shareAfter(now);
    bare_ = !more && share_ == S(0);
    share_ = next;
    bare_ = bare_ && !(leap_ > S(0));  // the next one is no sequel of this one
    before_ = more || leap_ > S(0) ? S(0) : now.size;
  }
  /// Before the next sweep impulses are to go on by as many of their last steps; mostly 0.
  const S& leap() const { return leap_; }

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

  /// Sweeps, of which the last two are bare, to see whether all that is left goes one way.
  static constexpr int patience = 128;

  /// A light body between heavy ones makes each step the same share q of the one before, 1 - 2 m/M say; what
  /// is left is the sum of a geometric series, q + q^2 + ... = q/(1 - q) of the last step, for which momentum
  /// takes sqrt(M/m) sweeps.
  S leapAfter(const SweepProgress<S>& now) const {
    if (!(now.along > S(0) && now.size > S(0) && before_ > S(0))) {
      return S(0);
    }
    // By ratios: m^2 dv^4 of small grains is no float.
    const bool oneWay = (now.along / now.size) * (now.along / before_) > S(1 - 1e-6);
    const S left = before_ - now.along;
    const bool isKnown = left > S(16) * roundoff<S>() * before_;
    return oneWay && isKnown ? S(now.along / left) : S(0);
  }

  S enough_;
  int most_;
  int sweeps_ = 0;
  S change_ = S(0);
  S share_ = S(0);
  S before_ = S(0);    ///< square of the changes of the last sweep
  bool bare_ = false;  ///< that one had no share
  S leap_ = S(0);
  bool mayLeap_ = false;
  S changeAtLeap_ = highest<S>();  ///< at the last one
};

}  // namespace gravel::detail
