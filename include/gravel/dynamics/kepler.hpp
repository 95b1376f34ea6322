#pragma once

/// \file
/// Motion about a centre of attraction, solved for any orbit and any time: universal variables.

#include <gravel/core/sizes.hpp>

#include <algorithm>

namespace gravel {

namespace detail {

/// Stumpff's functions c_n(z) = sum_k (-z)^k / (n + 2k)!, n = 0 … 3. Series below |z| = 0.1, to which larger
/// arguments are brought by quartering. Errors: some units in the last place.
template <Real Scalar>
struct Stumpff {
  Scalar c0, c1, c2, c3;

  explicit Stumpff(Scalar z) {
    int quarters = 0;
    for (; z > Scalar(0.1) || z < Scalar(-0.1); ++quarters) {
      z /= Scalar(4);
    }
    // 1/3! - z/5! + … and 1/2! - z/4! + …; the ninth term is below 1e-24.
    c3 = c2 = Scalar(1);
    for (int k = 9; k > 0; --k) {
      c3 = Scalar(1) - z / Scalar((2 * k + 2) * (2 * k + 3)) * c3;
      c2 = Scalar(1) - z / Scalar((2 * k + 1) * (2 * k + 2)) * c2;
    }
    c3 /= Scalar(6);
    c2 /= Scalar(2);
    c1 = Scalar(1) - z * c3;
    c0 = Scalar(1) - z * c2;
    for (; quarters > 0; --quarters) {
      c3 = (c2 + c0 * c3) / Scalar(4);
      c2 = c1 * c1 / Scalar(2);
      c1 = c0 * c1;
      c0 = Scalar(2) * c0 * c0 - Scalar(1);
    }
  }
};

}  // namespace detail

/// What time h [s] adds to position x [m] and velocity v [m s^-1] on the orbit about the origin with GM
/// [m^3 s^-2] > 0: ellipse, parabola or hyperbola, forwards or backwards, over any part or number of turns.
///
/// Kepler's equation in the universal anomaly s, with ds/dt = 1/r, has a single root and a derivative r > 0;
/// Newton's method inside a bracket that shrinks finds it always (Danby 1988, ch. 6; Wisdom & Hernandez 2015,
/// MNRAS 453, 3015). Error: rounding, times the number of radians; deep passages on hyperbolas lose more (e =
/// 10 with the pericentre at a tenth of the distance: 7e-14, at a thousandth: 4e-10). x = 0, a v whose square
/// is too large, and what is not finite give NaN.
template <Real Scalar>
void keplerIncrements(const Vector3<Scalar>& x, const Vector3<Scalar>& v, const Scalar& GM, Scalar h,
                      Vector3<Scalar>& dx, Vector3<Scalar>& dv) {
  using std::sqrt;
  const Scalar r0 = detail::safeNorm(x);
  const Scalar eta = x.dot(v);
  const Scalar beta = Scalar(2) * GM / r0 - v.squaredNorm();
  const Scalar zeta = GM - beta * r0;
  if (!(r0 > Scalar(0)) || !isFinite(beta) || !isFinite(h)) {
    dx = dv = Vector3<Scalar>::Constant(Scalar(std::numeric_limits<double>::quiet_NaN()));
    return;
  }
  // The root lies between low and high; a turn more or less of an ellipse changes nothing.
  Scalar low(0);
  Scalar high(0);
  Scalar s = h / r0;
  if (beta > Scalar(0)) {
    const Scalar turn = Scalar(2) * pi<Scalar>() / sqrt(beta);  // of s
    const Scalar period = turn * GM / beta;
    const bool turned = period > Scalar(0) && isFinite(period);
    Scalar turns = period;  // whole turns are taken off, most of them first
    while (turned && (turns < h / Scalar(2) || turns < -h / Scalar(2))) {
      turns *= Scalar(2);
    }
    while (turned && turns >= period) {
      h += h > turns ? Scalar(-turns) : h < -turns ? turns : Scalar(0);
      turns /= Scalar(2);
    }
    low = h > Scalar(0) ? Scalar(0) : Scalar(-turn);
    high = low + turn;
    s = h * beta / GM;
    if (r0 * beta > GM / Scalar(2) && h / r0 * h < r0 / GM * r0) {
      s = h / r0;
    }
  } else {
    // From where the orbit has hardly bent, doubled until it is beyond the root.
    const Scalar bend = beta < Scalar(0) ? Scalar(Scalar(1) / sqrt(-beta)) : Scalar(r0 / sqrt(GM));
    const Scalar sign = h > Scalar(0) ? Scalar(1) : Scalar(-1);
    Scalar reach = sign * (sign * s > Scalar(0) ? std::min<Scalar>(sign * s, bend) : bend);
    const auto time = [&](const Scalar& at) {
      const detail::Stumpff<Scalar> c(beta * at * at);
      return Scalar(r0 * at + eta * at * at * c.c2 + zeta * at * at * at * c.c3);
    };
    while ((time(reach) - h) * sign < Scalar(0)) {
      reach *= Scalar(2);
    }
    low = std::min<Scalar>(Scalar(0), reach);
    high = std::max<Scalar>(Scalar(0), reach);
    s = sign * std::min<Scalar>(sign * s, sign * reach);
  }
  Scalar G1(0), G2(0), G3(0), r = r0;
  for (int iteration = 0; iteration < 200; ++iteration) {
    if (!(s >= low) || !(s <= high)) {
      s = (low + high) / Scalar(2);
    }
    const detail::Stumpff<Scalar> c(beta * s * s);
    G1 = s * c.c1;
    G2 = s * s * c.c2;
    G3 = s * s * s * c.c3;
    r = r0 + eta * G1 + zeta * G2;
    const Scalar off = r0 * s + eta * G2 + zeta * G3 - h;
    (off > Scalar(0) ? high : low) = s;
    const Scalar next = s - off / r;
    const Scalar change = next - s;
    const Scalar small = Scalar(2) * detail::roundoff<Scalar>() * (s < Scalar(0) ? -s : s);
    if ((change <= small && change >= -small) || !(high - low > Scalar(0))) {
      break;
    }
    s = next;
  }
  dx = x * Scalar(-GM * G2 / r0) + v * Scalar(h - GM * G3);
  dv = x * Scalar(-GM * G1 / (r0 * r)) + v * Scalar(-GM * G2 / r);
}

}  // namespace gravel
