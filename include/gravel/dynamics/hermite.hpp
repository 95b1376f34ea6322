#pragma once

/// \file
/// Hermite's method of fourth order with a step for each body: wide ranges of time scales, close encounters.

#include <gravel/core/check.hpp>
#include <gravel/dynamics/hermite_state.hpp>

#include <algorithm>
#include <span>

namespace gravel {

/// Makino & Aarseth (1992, PASJ 44, 141). Each body has its own step, h 2^-k with h the time asked for (block
/// steps: McMillan 1986). Those whose step ends first are moved: all places are predicted from x, v, a and
/// the jerk a', accelerations and jerks of these bodies alone are found there, and the corrected motion is
///   v1 = v0 + (a0 + a1) dt/2 + (a0' - a1') dt^2/12,   x1 = x0 + (v0 + v1) dt/2 + (a0 - a1) dt^2/12
/// (Hut, Makino & McMillan 1995, ApJ 443, L93). The polynomial through both ends gives a'' and a''' and with
/// them the next step (Aarseth 1985),
///   dt = sqrt(eta (|a| |a''| + |a'|^2) / (|a'| |a'''| + |a''|^2)),
/// rounded down to a power of two; it is doubled at most, and only where blocks of the double length begin.
/// Where pulls cancel, as on a star amid evenly spread planets, a is their rounding, and its differences over
/// a shorter step seem to change faster, without end. But pulls change no faster than the fastest pair: a
/// step that is to become shorter is no shorter than sqrt(eta)/8 over the rate of that, half of a first step.
/// And a steady pull from afar hides the small ones beside it, as that of a star on two asteroids that go
/// round each other: a step that is doubled, or four times what snap and crackle alone ask for, is no longer
/// than 3/2 sqrt(eta) over that rate. At the end of h all bodies are at the same time.
///
/// The forces are an object, as JerkSum is, with
/// - begin(x, m, sources): columns of places [m] and masses [kg], whose first `sources` rows have mass;
/// - evaluate(rows, x, v, a, j): sets a [m s^-2] and j [m s^-3] of these rows, with these and all sources
///   at x and v;
/// - rates(rows, x, v, rate_sq): about 1/t^2 [s^-2] of these rows, t the time in which their motion changes.
/// A uniform field is given apart: it changes no step.
///
/// Cost: an evaluation of the bodies that move and O(N) a block step. Not symplectic and not reversible: the
/// energy drifts, by 2e-8 in half a time unit of a star cluster, 6e-6 an orbit of e = 0.9 at the default eta.
/// Memory 40 scalars a body. Bits do not depend on the number of threads if those of the forces do not; the
/// method's own work is done by one thread.
template <Real Scalar>
class Hermite4 {
 public:
  /// Advances by h [s].
  /// \param field [m s^-2], acts on movable bodies
  /// \param arrival  called once, when bodies stand at their end; sets their accelerations there, by which a
  ///   change from outside is noticed before the next step
  template <class Layout, class Forces, class Arrival>
  void advance(Bodies<Scalar, Layout>& bodies, const Scalar& h, const Vector3<Scalar>& field, Forces&& forces,
               Arrival&& arrival) {
    const bool known = s_.read(bodies);
    forces.begin(s_.x, s_.m, s_.sources);
    if (!known) {
      start(h, field, forces);
    }
    std::fill(std::begin(inLevel_), std::end(inLevel_), std::size_t{0});
    for (const std::uint32_t row : s_.movable) {
      s_.level[row] = levelFor(s_.wanted[row], h, 0);
      ++inLevel_[s_.level[row]];
    }
    if (shared_) {
      share(s_.movable, deepest());
    }
    Tick now = 0;
    while (now < end && !s_.movable.empty()) {
      now = block(now, h, field, forces);
    }
    s_.write(bodies);
    arrival();
    s_.remember(bodies);
  }

  /// eta of Aarseth's criterion, 0.02 by default: errors go with its square.
  /// \throws std::invalid_argument unless > 0 and <= 1
  void setStepFactor(const Scalar& eta) {
    detail::require("step factor of Hermite4", eta, {detail::positive<Scalar>().low, Scalar(1), "> 0, <= 1"});
    eta_ = eta;
  }

  /// Steps [s] are halved no further than this; 0, the default: no further than 2^-40 of the time asked for
  /// (2^-23 in float). \throws std::invalid_argument unless finite, >= 0
  void setShortestStep(const Scalar& shortest) {
    detail::require("shortest step of Hermite4", shortest, detail::nonNegative<Scalar>());
    shortest_ = shortest;
  }

  /// n evaluations a step, P(EC)^n: 1 by default. With 2 and equal steps the energy of a periodic motion
  /// drifts far less (Kokubo, Yoshinaga & Makino 1998, MNRAS 297, 1067).
  /// \throws std::invalid_argument unless in 1 … 16
  void setCorrections(int n) {
    if (n < 1 || n > 16) {
      detail::refuse("number of corrections of Hermite4", std::to_string(n), "1 to 16");
    }
    corrections_ = n;
  }

  /// One step for all bodies, the least of theirs: for comparison.
  void setSharedSteps(bool shared) { shared_ = shared; }

  std::uint64_t blockSteps() const { return blockSteps_; }  ///< times at which bodies were moved
  std::uint64_t bodySteps() const { return bodySteps_; }    ///< bodies moved there

  /// What the next step depends on beside the bodies: numbers for a restart.
  template <class Layout>
  std::vector<Scalar> state(const Bodies<Scalar, Layout>& bodies) const {
    return s_.numbers(bodies);
  }
  /// Takes up state(). \return false, and knows nothing, if it is none
  template <class Layout>
  bool setState(const Bodies<Scalar, Layout>& bodies, const std::vector<Scalar>& numbers) {
    return s_.take(bodies, numbers);
  }

 private:
  using State = detail::HermiteState<Scalar>;
  using Column = typename State::Column;
  using Columns = typename State::Columns;
  using Tick = std::uint64_t;  ///< h over 2^deepestLevel
  using Level = typename State::Level;

  static constexpr Level deepestLevel = [] {
    if constexpr (std::is_floating_point_v<Scalar>) {
      return Level(std::min(40, std::numeric_limits<Scalar>::digits - 1));
    } else {
      return Level(40);
    }
  }();
  static constexpr Tick end = Tick(1) << deepestLevel;

  static Tick ticks(Level level) { return end >> level; }

  static Scalar lengthOf(Level level, const Scalar& h) { return h * Scalar(1.0 / double(Tick(1) << level)); }

  /// The least level from `from` on whose step is no longer than wanted.
  Level levelFor(const Scalar& wanted, const Scalar& h, Level from) const {
    Level level = from;
    Scalar step = lengthOf(level, h);
    while (wanted < step && level < deepestLevel && !(step / Scalar(2) < shortest_)) {
      step = lengthOf(++level, h);
    }
    return level;
  }

  Level deepest() const {
    Level level = deepestLevel;
    while (level > 0 && inLevel_[level] == 0) {
      --level;
    }
    return level;
  }

  void share(const std::vector<std::uint32_t>& rows, Level level) {
    for (const std::uint32_t row : rows) {
      --inLevel_[s_.level[row]];
      s_.level[row] = level;
      ++inLevel_[level];
    }
  }

  /// By the rate of the fastest pair, a quarter of what a circular orbit would get; `free` without any.
  Scalar stepOfPair(const Scalar& rate_sq, const Scalar& free) const {
    using std::sqrt;
    return rate_sq > Scalar(0) ? Scalar(sqrt(Scalar(eta_ / rate_sq)) / Scalar(4)) : free;
  }

  /// Accelerations, jerks and first steps of all bodies.
  template <class Forces>
  void start(const Scalar& h, const Vector3<Scalar>& field, Forces&& forces) {
    xp_ = s_.x;
    vp_ = s_.v;
    forces.evaluate(s_.movable, xp_, vp_, s_.a, s_.j);
    forces.rates(s_.movable, xp_, vp_, s_.wanted);
    for (const std::uint32_t row : s_.movable) {
      s_.wanted[row] = stepOfPair(Scalar(s_.wanted[row]), h);
      for (std::size_t c = 0; c < 3; ++c) {
        s_.a[c][row] += field[static_cast<Eigen::Index>(c)];
      }
    }
  }

  /// From the block time `now` to the next, whose tick is returned.
  template <class Forces>
  Tick block(Tick now, const Scalar& h, const Vector3<Scalar>& field, Forces&& forces) {
    const Level last = deepest();
    const Tick next = now + ticks(last);
    Level first = last;  // of those that end at `next`
    while (first > 0 && (next & (ticks(Level(first - 1)) - 1)) == 0) {
      --first;
    }
    active_.clear();
    for (const std::uint32_t row : s_.movable) {
      if (s_.level[row] >= first) {
        active_.push_back(row);
      }
    }
    predict(now, next, h);
    for (std::size_t c = 0; c < 3; ++c) {
      a1_[c].resize(s_.m.size());
      j1_[c].resize(s_.m.size());
    }
    for (int n = 0; n < corrections_; ++n) {
      forces.evaluate(active_, xp_, vp_, a1_, j1_);
      for (const std::uint32_t row : active_) {
        correct(row, lengthOf(s_.level[row], h), field);
      }
    }
    for (const std::uint32_t row : active_) {
      settle(row, h, next, field, forces);
    }
    if (shared_) {
      share(active_, deepest());
    }
    ++blockSteps_;
    bodySteps_ += active_.size();
    return next;
  }

  /// A row of level k began its step at the last multiple of it.
  void predict(Tick now, Tick next, const Scalar& h) {
    Scalar age[deepestLevel + 1];
    for (Level level = 0; level <= deepestLevel; ++level) {
      const Tick begin = now & ~(ticks(level) - 1);
      age[level] = h * Scalar(double(next - begin) / double(end));
    }
    age_.resize(s_.m.size());
    for (Eigen::Index row = 0; row < age_.size(); ++row) {
      age_[row] = age[s_.level[static_cast<std::size_t>(row)]];
    }
    const Scalar half = Scalar(1) / Scalar(2);
    const Scalar third = Scalar(1) / Scalar(3);
    for (std::size_t c = 0; c < 3; ++c) {
      xp_[c] = s_.x[c] + age_ * (s_.v[c] + age_ * half * (s_.a[c] + age_ * third * s_.j[c]));
      vp_[c] = s_.v[c] + age_ * (s_.a[c] + age_ * half * s_.j[c]);
    }
  }

  void correct(std::uint32_t row, const Scalar& dt, const Vector3<Scalar>& field) {
    const Scalar half = dt / Scalar(2);
    const Scalar twelfth = dt * dt / Scalar(12);
    for (std::size_t c = 0; c < 3; ++c) {
      a1_[c][row] += field[static_cast<Eigen::Index>(c)];
      const Scalar a0 = s_.a[c][row];
      const Scalar a1 = a1_[c][row];
      vp_[c][row] = s_.v[c][row] + (a0 + a1) * half + (s_.j[c][row] - j1_[c][row]) * twelfth;
      xp_[c][row] = s_.x[c][row] + (s_.v[c][row] + vp_[c][row]) * half + (a0 - a1) * twelfth;
    }
  }

  /// Takes up the corrected motion and finds the next step.
  template <class Forces>
  void settle(std::uint32_t row, const Scalar& h, Tick next, const Vector3<Scalar>& field, Forces&& forces) {
    using std::sqrt;
    const Level level = s_.level[row];
    const Scalar dt = lengthOf(level, h);
    Scalar d_sq[4] = {Scalar(0), Scalar(0), Scalar(0), Scalar(0)};  // of a, a' dt, a'' dt^2, a''' dt^3
    for (std::size_t c = 0; c < 3; ++c) {
      const Scalar fall = s_.a[c][row] - a1_[c][row];
      const Scalar j0 = s_.j[c][row] * dt;
      const Scalar j1 = j1_[c][row] * dt;
      const Scalar crackle = Scalar(12) * fall + Scalar(6) * (j0 + j1);
      const Scalar snap = crackle - Scalar(6) * fall - (Scalar(4) * j0 + Scalar(2) * j1);
      const Scalar a = a1_[c][row] - field[static_cast<Eigen::Index>(c)];
      d_sq[0] += a * a;
      d_sq[1] += j1 * j1;
      d_sq[2] += snap * snap;
      d_sq[3] += crackle * crackle;
      s_.x[c][row] = xp_[c][row];
      s_.v[c][row] = vp_[c][row];
      s_.a[c][row] = a1_[c][row];
      s_.j[c][row] = j1_[c][row];
    }
    const auto product = [](const Scalar& x, const Scalar& y) {
      return x > Scalar(0) && y > Scalar(0) ? Scalar(sqrt(x) * sqrt(y)) : Scalar(0);
    };
    const Scalar slow = product(d_sq[0], d_sq[2]) + d_sq[1];
    const Scalar fast = product(d_sq[1], d_sq[3]) + d_sq[2];
    const Scalar twice = Scalar(2) * dt;
    const bool mayDouble = level > 0 && (next & (ticks(Level(level - 1)) - 1)) == 0;
    // Third differences over a step far below what was wanted are rounding: no news while that lasts.
    if (dt * Scalar(64) < s_.wanted[row]) {
      s_.wanted[row] -= dt;
    } else {
      s_.wanted[row] = fast * Scalar(4) < eta_ * slow || !(fast > Scalar(0))
                           ? twice
                           : Scalar(dt * sqrt(Scalar(eta_ * slow / fast)));
      // An encounter, an acceleration that is rounding, or a steady pull that hides what changes fast, from
      // all differences or from those of lower order: pairs tell.
      const bool hidden = Scalar(16) * eta_ * d_sq[2] * dt * dt < s_.wanted[row] * s_.wanted[row] * d_sq[3];
      if (s_.wanted[row] < dt || hidden || (mayDouble && !(s_.wanted[row] < twice))) {
        rate_sq_.resize(s_.m.size());
        forces.rates(std::span<const std::uint32_t>(&row, 1), xp_, vp_, rate_sq_);
        const Scalar pair = stepOfPair(Scalar(rate_sq_[row]), twice);
        const Scalar least = std::min<Scalar>(twice, pair / Scalar(2));
        s_.wanted[row] = std::max<Scalar>(least, std::min<Scalar>(s_.wanted[row], Scalar(6) * pair));
      }
    }
    Level after = levelFor(s_.wanted[row], h, level);
    if (mayDouble && !(s_.wanted[row] < twice)) {
      after = Level(level - 1);
    }
    --inLevel_[level];
    ++inLevel_[after];
    s_.level[row] = after;
  }

  State s_;
  Columns xp_, vp_;  // predicted, and corrected
  Columns a1_, j1_;  // there
  Column age_;       // [s] since the start of each row's step
  Column rate_sq_;   // [s^-2] of the fastest pair, where asked for
  std::vector<std::uint32_t> active_;
  std::size_t inLevel_[deepestLevel + 1] = {};
  Scalar eta_ = Scalar(0.02);
  Scalar shortest_ = Scalar(0);
  int corrections_ = 1;
  bool shared_ = false;
  std::uint64_t blockSteps_ = 0;
  std::uint64_t bodySteps_ = 0;
};

}  // namespace gravel
