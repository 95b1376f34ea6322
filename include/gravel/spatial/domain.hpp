#pragma once

/// \file
/// The space in which bodies live: open, periodic, or shear-periodic (a patch of a disc in Hill's frame).

#include <gravel/core/check.hpp>

#include <algorithm>

namespace gravel {

enum class DomainKind { Open, Periodic, ShearPeriodic };

namespace detail {

/// The integer nearest to x; halves go away from zero, so that the result is odd in x.
template <Real S>
inline S nearestInteger(const S& x) {
  if constexpr (std::is_floating_point_v<S>) {
    return x < S(0.5) && x > S(-0.5) ? S(x * S(0)) : std::round(x);  // most: a call saved, the same sign
  } else {
    // Written with comparisons alone: a user's scalar need not have round(). Exact for |x| < 2^53.
    const bool negative = x < S(0);
    S rest = negative ? S(-x) : x;
    if (!(rest < S(9007199254740992.0))) {
      return x;
    }
    double whole = 0.0;
    for (double bit = 4503599627370496.0; bit >= 1.0; bit /= 2.0) {
      if (rest >= S(bit)) {
        rest -= S(bit);
        whole += bit;
      }
    }
    whole += rest >= S(0.5) ? 1.0 : 0.0;
    return S(negative ? -whole : whole);
  }
}

}  // namespace detail

/// A periodic box is [-L/2, L/2) in each axis. In the shear-periodic box x points outward, y along the orbit;
/// the unperturbed flow is v_y = -(3/2) Omega x, so the image one box further out in x lags by the sheared
/// offset (3/2) Omega Lx t in y and by (3/2) Omega Lx in v_y (Wisdom & Tremaine 1988, AJ 95, 925). In z it is
/// a box as well: what leaves at the top comes in at the bottom, in the first step where it was put outside.
/// Only gravity and the vertical field know no images in z, so let the box be higher than bodies get. The
/// radii of two that touch must add up to at most half an edge, and what two go past each other in a step to
/// an edge less twice those at most: of each pair only the images are looked at that are nearest where a step
/// begins, or a blow sends one of them elsewhere, and halfway from there to its end.
template <Real S>
class Domain {
 public:
  Domain() = default;

  static Domain open() { return {}; }

  /// \param lengths box edges [m], finite and > 0. \throws std::invalid_argument otherwise
  static Domain periodic(const Vector3<S>& lengths) { return Domain(DomainKind::Periodic, lengths, S(0)); }

  /// \param omega orbital frequency [s^-1], finite, of either sign. \throws std::invalid_argument otherwise
  static Domain shearPeriodic(const Vector3<S>& lengths, S omega) {
    return shearPeriodic(lengths, omega, omega);
  }
  /// \param vertical frequency [s^-1] of the motion normal to the orbit, finite: above omega for a disc whose
  ///        own gravity pulls to its plane, 0 for none
  static Domain shearPeriodic(const Vector3<S>& lengths, S omega, S vertical) {
    Domain domain(DomainKind::ShearPeriodic, lengths, omega);
    if (!isFinite(vertical)) {
      detail::refuse("vertical frequency of the domain", detail::formatReal(vertical), "finite");
    }
    domain.vertical_ = vertical;
    return domain;
  }

  DomainKind kind() const { return kind_; }
  bool isOpen() const { return kind_ == DomainKind::Open; }
  const Vector3<S>& lengths() const { return lengths_; }
  S omega() const { return omega_; }
  /// Frequency [s^-1] of the motion normal to the orbit; 0 unless shear-periodic.
  S verticalFrequency() const { return vertical_; }

  /// Speed [m s^-1] by which the image one box further out in x lags in y; 0 unless shear-periodic.
  S shearSpeed() const { return S(1.5) * omega_ * lengths_[0]; }

  /// [s^-1] Size of the rate at which the flow shears.
  S shearRate() const { return omega_ < S(0) ? S(S(-1.5) * omega_) : S(S(1.5) * omega_); }
  /// A velocity at x less that of the unperturbed flow there; the velocity itself unless shear-periodic.
  [[gnu::always_inline]] inline Vector3<S> lessFlow(const Vector3<S>& x, const Vector3<S>& v) const {
    return {v[0], v[1] + S(1.5) * omega_ * x[0], v[2]};
  }

  /// Distance [m] by which that image lags in y at `time`, brought into [-Ly/2, Ly/2].
  S shearOffset(const S& time) const {
    if (kind_ != DomainKind::ShearPeriodic) {
      return S(0);
    }
    return nearest(S(shearSpeed() * time), 1);
  }

  /// The shortest image of a separation; r itself in an open domain. Odd in r.
  [[gnu::always_inline]] Vector3<S> minimumImage(const Vector3<S>& r, const S& time) const {
    S boxes(0);
    return isOpen() ? r : shortest(r, time, boxes);
  }

  /// The same, with the relative velocity v that belongs to that image.
  void minimumImage(Vector3<S>& r, Vector3<S>& v, const S& time) const {
    if (isOpen()) {
      return;
    }
    S boxes(0);
    r = shortest(r, time, boxes);
    if (kind_ == DomainKind::ShearPeriodic) {
      v[1] += boxes * shearSpeed();
    }
  }

  /// Whether a separation is so short that no other image of it can be nearer: images are an edge apart.
  [[gnu::always_inline]] bool isNearest(const Vector3<S>& r) const {
    const S edge = std::min<S>(lengths_[0], std::min<S>(lengths_[1], lengths_[2]));
    return isOpen() || S(4) * r.squaredNorm() < edge * edge;
  }

  /// The image that is nearest at t [s] after `time`, with the way [m] that r goes until then: where it is at
  /// `time`. Two that were struck on their way begin it, as it seems, anywhere.
  Vector3<S> imageAt(const Vector3<S>& r, const Vector3<S>& way, const S& t, Vector3<S>& v,
                     const S& time) const {
    if (isOpen()) {
      return r;
    }
    const Vector3<S> later = r + way;
    Vector3<S> image = later;
    Vector3<S> drift = Vector3<S>::Zero();
    minimumImage(image, drift, S(time + t));
    v += drift;
    return r + Vector3<S>(image - later) - t * drift;  // r itself, if it is that one
  }

  /// Brings a body into the box, with the velocity that its image there has. Nothing in an open domain.
  void wrap(Vector3<S>& x, Vector3<S>& v, const S& time) const {
    if (kind_ == DomainKind::Open) {
      return;
    }
    const S boxes = wrapAxis(x, 0);
    if (kind_ == DomainKind::ShearPeriodic && !(boxes == S(0))) {
      x[1] += boxes * shearOffset(time);
      v[1] += boxes * shearSpeed();
    }
    wrapAxis(x, 1);
    wrapAxis(x, 2);
  }

  friend bool operator==(const Domain& a, const Domain& b) {
    return a.kind_ == b.kind_ && a.lengths_[0] == b.lengths_[0] && a.lengths_[1] == b.lengths_[1] &&
           a.lengths_[2] == b.lengths_[2] && a.omega_ == b.omega_ && a.vertical_ == b.vertical_;
  }

 private:
  Domain(DomainKind kind, const Vector3<S>& lengths, S omega)
      : kind_(kind), lengths_(lengths), omega_(omega) {
    constexpr const char* names[3] = {"length x of the domain", "length y of the domain",
                                      "length z of the domain"};
    for (int axis = 0; axis < 3; ++axis) {
      if (!isFinite(S(lengths[axis])) || !(lengths[axis] > S(0))) {
        detail::refuse(names[axis], detail::formatReal(S(lengths[axis])), "finite, > 0");
      }
    }
    if (!isFinite(omega)) {
      detail::refuse("Omega of the domain", detail::formatReal(omega), "finite");
    }
  }

  S nearest(const S& r, int axis) const {
    return r - lengths_[axis] * detail::nearestInteger(S(r / lengths_[axis]));
  }

  /// In a domain that is not open. `boxes`: how many boxes were taken off in x.
  Vector3<S> shortest(const Vector3<S>& r, const S& time, S& boxes) const {
    const S home = detail::nearestInteger(S(r[0] / lengths_[0]));
    Vector3<S> best(r[0] - home * lengths_[0], nearest(r[1], 1), nearest(r[2], 2));
    boxes = home;
    if (kind_ == DomainKind::ShearPeriodic) {
      best[1] = nearest(S(r[1] + home * shearOffset(time)), 1);
      nearerBox(r, home, time, best, boxes);
    }
    return best;
  }

  /// The sheared lattice is oblique: where |r| is above half a box, a neighbour in x may be nearer, and one
  /// further out where boxes are long in y.
  void nearerBox(const Vector3<S>& r, const S& home, const S& time, Vector3<S>& best, S& boxes) const {
    const S at = best[0];
    const S near = at < S(0) ? S(-1) : S(1);  // the side to look at first
    // More than half a box in x and in y is rounding, of separations that are no numbers of boxes any more.
    S best_sq =
        std::min<S>(at * at + best[1] * best[1], lengths_[0] * lengths_[0] + lengths_[1] * lengths_[1]);
    S out = lengths_[0] - near * at;  // [m] in x of the nearest one k boxes out
    for (S k(1); out * out < best_sq; k += S(1), out += lengths_[0]) {
      for (const S& side : {S(near * k), S(-near * k)}) {
        const S x = at - side * lengths_[0];
        const S y = nearest(S(r[1] + (home + side) * shearOffset(time)), 1);
        if (x * x + y * y < best_sq) {
          best_sq = x * x + y * y;
          best[0] = x;
          best[1] = y;
          boxes = home + side;
        }
      }
    }
  }

  /// \return boxes taken off
  S wrapAxis(Vector3<S>& x, int axis) const {
    const S half = lengths_[axis] / S(2);
    if (x[axis] >= -half && x[axis] < half) {
      return S(0);
    }
    S boxes = detail::nearestInteger(S(x[axis] / lengths_[axis]));
    S inside = x[axis] - boxes * lengths_[axis];
    if (inside >= half) {
      boxes += S(1);
      inside -= lengths_[axis];
    } else if (inside < -half) {
      boxes -= S(1);
      inside += lengths_[axis];
    }
    x[axis] = inside >= half ? S(-half) : inside;  // a sum that rounds up to the open end; NaN stays
    return boxes;
  }

  DomainKind kind_ = DomainKind::Open;
  Vector3<S> lengths_ = Vector3<S>::Zero();
  S omega_ = S(0);
  S vertical_ = S(0);
};

}  // namespace gravel
