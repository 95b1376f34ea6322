#pragma once

/// \file
/// Bodies and contacts as solvers see them: compact, in the units of the surface's speed.

#include <gravel/contact/contact.hpp>
#include <gravel/core/packed.hpp>

#include <algorithm>
#include <bit>
#include <limits>
#include <vector>

namespace gravel {

namespace detail {

/// Asks for the cache lines of x, which will be needed soon.
template <class T>
[[gnu::always_inline]] inline void prefetch(const T& x) {
  const char* const first = reinterpret_cast<const char*>(&x);
  for (std::size_t byte = 0; byte < sizeof(T); byte += 64) {
    __builtin_prefetch(first + byte);
  }
}

/// Eight scalars, at most a cache line: in double bodies are one, and rows two.
template <Real S>
inline constexpr std::size_t rowAlignment = std::max(alignof(S),
                                                     std::bit_ceil(std::min<std::size_t>(64, 8 * sizeof(S))));

template <Real S>
struct alignas(rowAlignment<S>) SolverBody {
  Vector3<S> v;
  S inverseMass;
  Vector3<S> s;  ///< r w: speed of the surface
  S spin;        ///< 1/(k m)
};

/// A body before any impulse, with how fast it falls.
template <Real S>
struct alignas(rowAlignment<S>) SolverStart {
  Vector3<S> v;
  S fall;  ///< [m s^-2] of ProblemBodies::fallOf(); 0 of what nothing moves
  Vector3<S> s;
  S radius;  ///< [m]
};

/// What the next solve of the same contacts goes on from.
template <Real S>
struct SolvedProblem {
  struct Body {
    Vector3<S> v0;  ///< [m s^-1] before any impulse
    Vector3<S> s0;  ///< of r w
    Vector3<S> v;   ///< after all of them
    Vector3<S> s;
    S way;  ///< of RowWatch
  };
  struct Row {
    S then;  ///< of RowWatch
    S approach;
    S target;
    S rest;  ///< a RowRest
  };
  std::vector<Body> bodies;  ///< by slot; empty if the next solve begins anew
  std::vector<Row> rows;     ///< empty if all are to be looked at
  S still = S(0);
  S threshold = S(0);
};

/// The largest speed, the largest change of one that is to be done again, the masses > 0, how many are not
/// what they were, and of those that move the least and the most fall [m s^-2] and the largest s^2/r
/// [m s^-2].
template <Real S>
struct ProblemScales {
  S fastest = S(0);
  S change = S(0);
  S lightest = S(0);
  S heaviest = S(0);
  S mostFall = S(0);
  std::size_t others = 0;
  S leastFall = highest<S>();
  S mostTurn = S(0);
  ProblemScales& operator+=(const ProblemScales& other) {
    leastFall = std::min<S>(leastFall, other.leastFall);
    mostTurn = std::max<S>(mostTurn, other.mostTurn);
    others += other.others;
    fastest = std::max<S>(fastest, other.fastest);
    change = std::max<S>(change, other.change);
    heaviest = std::max<S>(heaviest, other.heaviest);
    mostFall = std::max<S>(mostFall, other.mostFall);
    if (other.lightest > S(0) && !(lightest > S(0) && lightest <= other.lightest)) {
      lightest = other.lightest;
    }
    return *this;
  }
};

/// A contact, in two quads of scalars: in double a cache line. Who its bodies are says the colouring, and its
/// impulse stands in a list of its own, which is all that sweeps write.
template <Real S>
struct alignas(rowAlignment<S>) SolverRow {
  Vector3<S> n;
  S c1;  ///< arm / radius
  S c2;
  S target;  ///< v_n after the blow is at least this
  S stick;   ///< static friction
  S slide;   ///< kinetic friction
};

/// Whether what a row asks for left its restitution and its turn out of account, and whether it did so as
/// one that carried a load before.
enum class RowRest : std::uint8_t { Not, Free, Loaded };

/// What sweeps keep of a row besides, in two bytes.
struct RowMark {
  bool impact : 1 = false;
  bool taken : 1 = false;    ///< its impulse is in the list of this problem; if not, in that of the last one
  bool atLimit : 1 = false;  ///< its friction was cut when last looked at
  bool kinetic : 1 = false;  ///< it slides: what cuts it is kinetic friction
  bool lasts : 1 = false;    ///< it has a RowBefore
  RowRest rest : 2 = RowRest::Not;
  std::uint8_t slides : 4 = 0;  ///< how often it began to slide, `patience` at most: then it goes on
  static constexpr std::uint8_t patience = 8;
};

/// What rows ask for.
template <Real S>
struct RowNeeds {
  S approach = S(0);      ///< largest change of a normal velocity, of those of large islands
  S wrong_sq = S(0);      ///< largest change that a sweep would make, squared, of those looked at
  std::size_t looks = 0;  ///< how many that was found for
  S any = S(0);           ///< largest change of a normal velocity, of all
  RowNeeds& operator+=(const RowNeeds& other) {
    looks += other.looks;
    approach = std::max<S>(approach, other.approach);
    wrong_sq = std::max<S>(wrong_sq, other.wrong_sq);
    any = std::max<S>(any, other.any);
    return *this;
  }
};

/// 1/x; 0 of 0. Not `inverse`, a name by which Eigen would take its own scalars for arrays.
template <Real S>
S reciprocal(const S& x) {
  return x > S(0) ? S(1) / x : S(0);
}

/// 1/m1 + 1/m2.
template <class B>
[[gnu::always_inline]] inline auto normalMobility(const B& b1, const B& b2) {
  return b1.inverseMass + b2.inverseMass;
}

/// 1/m1 (1 + c1^2/k1) + 1/m2 (1 + c2^2/k2).
template <class R, class B>
[[gnu::always_inline]] inline auto tangentialMobility(const R& row, const B& b1, const B& b2) {
  return normalMobility(b1, b2) + row.c1 * row.c1 * b1.spin + row.c2 * row.c2 * b2.spin;
}

template <Real S, class B>
[[gnu::always_inline]] inline S normalVelocity(const SolverRow<S>& row, const B& b1, const B& b2) {
  return row.n.dot(Vector3<S>(b2.v - b1.v));
}

/// Tangential part of u, at the top of impulses.hpp. \param v_rel v2 - v1 \param v_n n.v_rel
template <class R, class V, class N, class B>
[[gnu::always_inline]] inline V slipVelocity(const R& row, const V& v_rel, const N& v_n, const B& b1,
                                             const B& b2) {
  return V(V(v_rel - V(v_n * row.n)) - V(V(row.c1 * b1.s) + V(row.c2 * b2.s)).cross(row.n));
}

/// x 2^exponent, exactly; a scalar that is not built in stays as it is.
template <Real S>
[[gnu::always_inline]] inline S scaled(const S& x, int exponent) {
  if constexpr (std::is_floating_point_v<S>) {
    return exponent == 0 ? x : std::ldexp(x, exponent);
  } else {
    return x;
  }
}

template <Real S>
[[gnu::always_inline]] inline Vector3<S> scaled(const Vector3<S>& v, int exponent) {
  return exponent == 0
             ? v
             : Vector3<S>(scaled<S>(v[0], exponent), scaled<S>(v[1], exponent), scaled<S>(v[2], exponent));
}

template <Real S>
[[gnu::always_inline]] inline Packed<S> scaledLanes(const Packed<S>& x, int exponent) {
  return exponent == 0 ? x : Packed<S>::of([&](std::size_t lane) { return scaled<S>(x[lane], exponent); });
}

template <Real S>
[[gnu::always_inline]] inline PackedQuad<S> scaledLanes(const PackedQuad<S>& q, int exponent) {
  return exponent == 0 ? q
                       : PackedQuad<S>{scaledLanes(q.x, exponent), scaledLanes(q.y, exponent),
                                       scaledLanes(q.z, exponent), scaledLanes(q.w, exponent)};
}

/// Power of two that brings numbers between low and high near 1; 0 while they are harmless anyway.
template <Real S>
int scaleExponent(const S& low, const S& high) {
  if constexpr (std::is_floating_point_v<S>) {
    constexpr int harmless = std::numeric_limits<S>::max_exponent / 5;
    int lowExponent = 0;
    int highExponent = 0;
    (void)std::frexp(low, &lowExponent);
    (void)std::frexp(high, &highExponent);
    if (high > S(0) && (highExponent > harmless || lowExponent < -harmless)) {
      return -(lowExponent + highExponent) / 2;
    }
  }
  return 0;
}

}  // namespace detail

}  // namespace gravel
