#pragma once

/// \file
/// Four numbers as one, for loops whose bodies are strewn over memory: there the way into lanes is the work,
/// and four at a time turn by the compiler's own shuffles. (Lanes of core/lanes.hpp suit what lies in rows.)
/// Vector extensions of g++ and clang, which make of them whatever the target has; types that are not built
/// in, and long double, go one by one through the same code.

#include <gravel/core/short_vectors.hpp>

#include <algorithm>
#include <cstring>

namespace gravel::detail {

/// A truth for each number.
template <class S>
struct PackedTruth {
  using Raw = typename PackedRaw<S>::Truth;
  Raw m;

  [[gnu::always_inline]] friend inline PackedTruth operator&(const PackedTruth& a, const PackedTruth& b) {
    return {static_cast<Raw>(a.m & b.m)};
  }
  [[gnu::always_inline]] friend inline PackedTruth operator|(const PackedTruth& a, const PackedTruth& b) {
    return {static_cast<Raw>(a.m | b.m)};
  }
  [[gnu::always_inline]] friend inline PackedTruth operator!(const PackedTruth& a) {
    if constexpr (isPackable<S>) {
      return {~a.m};
    } else {
      return {!a.m};
    }
  }
  [[gnu::always_inline]] bool operator[](std::size_t lane) const {
    if constexpr (isPackable<S>) {
      return m[lane] != 0;
    } else {
      return m;
    }
  }
  [[gnu::always_inline]] bool any() const {
    if constexpr (isPackable<S>) {
      return (m[0] | m[1] | m[2] | m[3]) != 0;
    } else {
      return m;
    }
  }
};

template <class S>
struct Packed {
  using Raw = typename PackedRaw<S>::Type;
  using Truth = PackedTruth<S>;
  Raw v;

  /// The same number in every lane.
  [[gnu::always_inline]] static inline Packed all(const S& x) {
    return of([&](std::size_t) { return x; });
  }
  [[gnu::always_inline]] static inline Packed zero() { return all(S(0)); }
  /// f(lane) in each.
  template <class F>
  [[gnu::always_inline]] static inline Packed of(F&& f) {
    if constexpr (isPaired<S>) {
      return {Raw{{f(0), f(1)}, {f(2), f(3)}}};
    } else if constexpr (isPackable<S>) {
      return {Raw{f(0), f(1), f(2), f(3)}};
    } else {
      return {S(f(0))};
    }
  }

  [[gnu::always_inline]] S operator[](std::size_t lane) const {
    if constexpr (isPackable<S>) {
      return v[lane];
    } else {
      return v;
    }
  }
  [[gnu::always_inline]] S sum() const {
    if constexpr (isPackable<S>) {
      return (v[0] + v[1]) + (v[2] + v[3]);
    } else {
      return v;
    }
  }
  [[gnu::always_inline]] S largest() const {
    if constexpr (isPackable<S>) {
      return std::max(std::max(v[0], v[1]), std::max(v[2], v[3]));
    } else {
      return v;
    }
  }

  [[gnu::always_inline]] friend inline Packed operator+(const Packed& a, const Packed& b) {
    return {a.v + b.v};
  }
  [[gnu::always_inline]] friend inline Packed operator-(const Packed& a, const Packed& b) {
    return {a.v - b.v};
  }
  [[gnu::always_inline]] friend inline Packed operator*(const Packed& a, const Packed& b) {
    return {a.v * b.v};
  }
  [[gnu::always_inline]] friend inline Packed operator/(const Packed& a, const Packed& b) {
    return {a.v / b.v};
  }
  [[gnu::always_inline]] friend inline Packed operator-(const Packed& a) { return {-a.v}; }
  [[gnu::always_inline]] friend inline Truth operator>(const Packed& a, const Packed& b) {
    return {a.v > b.v};
  }
  [[gnu::always_inline]] friend inline Truth operator<(const Packed& a, const Packed& b) { return b > a; }
  /// a where it is true, else b; both are found.
  [[gnu::always_inline]] friend inline Packed choose(const Truth& truth, const Packed& a, const Packed& b) {
    if constexpr (isPaired<S>) {
      return {{truth.m.low ? a.v.low : b.v.low, truth.m.high ? a.v.high : b.v.high}};
    } else {
      return {truth.m ? a.v : b.v};
    }
  }
  [[gnu::always_inline]] friend inline Packed largerOf(const Packed& a, const Packed& b) {
    return choose(a < b, b, a);
  }
  [[gnu::always_inline]] friend inline Packed smallerOf(const Packed& a, const Packed& b) {
    return choose(b < a, b, a);
  }
  [[gnu::always_inline]] friend inline Packed sizeOf(const Packed& a) { return choose(a < zero(), -a, a); }
  [[gnu::always_inline]] friend inline Packed squareRoot(const Packed& a) {
    if constexpr (isPackable<S>) {
      Eigen::Array<S, 4, 1> root;  // std::sqrt stays scalar unless errno is switched off
      std::memcpy(root.data(), &a.v, sizeof(Raw));
      if constexpr (std::is_same_v<S, float>) {  // Eigen's own is an estimate, another on each processor
        root = root.template cast<double>().sqrt().template cast<float>().eval();  // rounds but once
      } else {
        root = root.sqrt().eval();
      }
      Packed out;
      std::memcpy(&out.v, root.data(), sizeof(Raw));
      return out;
    } else {
      using std::sqrt;
      return {S(sqrt(a.v))};
    }
  }
  /// 1/a; 0 where a is not above 0.
  [[gnu::always_inline]] friend inline Packed reciprocalOf(const Packed& a) {
    const Truth positive = a > zero();
    return choose(positive, all(S(1)) / choose(positive, a, all(S(1))), zero());
  }
};

/// Four numbers that stand one after the other in memory, a vector and one more, of packWidth<S> sources.
template <class S>
struct PackedQuad {
  Packed<S> x;
  Packed<S> y;
  Packed<S> z;
  Packed<S> w;

  /// \param source(lane) is the address of the first of four
  template <class Source>
  [[gnu::always_inline]] static inline PackedQuad load(Source&& source) {
    PackedQuad out;
    if constexpr (isPackable<S>) {
      std::memcpy(&out.x.v, source(0), 4 * sizeof(S));
      std::memcpy(&out.y.v, source(1), 4 * sizeof(S));
      std::memcpy(&out.z.v, source(2), 4 * sizeof(S));
      std::memcpy(&out.w.v, source(3), 4 * sizeof(S));
      transpose(out.x.v, out.y.v, out.z.v, out.w.v);
    } else {
      const S* const from = source(0);
      out = {{from[0]}, {from[1]}, {from[2]}, {from[3]}};
    }
    return out;
  }

  /// To those lanes of which `wanted(lane)`.
  template <class Target, class Wanted>
  [[gnu::always_inline]] inline void store(Target&& target, Wanted&& wanted) const {
    if constexpr (isPackable<S>) {
      PackedQuad q = *this;
      transpose(q.x.v, q.y.v, q.z.v, q.w.v);
      const auto put = [&](std::size_t lane, const Packed<S>& four) {
        if (wanted(lane)) {
          std::memcpy(target(lane), &four.v, 4 * sizeof(S));
        }
      };
      put(0, q.x);
      put(1, q.y);
      put(2, q.z);
      put(3, q.w);
    } else if (wanted(0)) {
      S* const to = target(0);
      to[0] = x.v;
      to[1] = y.v;
      to[2] = z.v;
      to[3] = w.v;
    }
  }
};

/// A vector of packed numbers.
template <class S>
struct PackedVector {
  using P = Packed<S>;
  P x;
  P y;
  P z;

  [[gnu::always_inline]] static inline PackedVector zero() { return {P::zero(), P::zero(), P::zero()}; }
  [[gnu::always_inline]] static inline PackedVector of(const PackedQuad<S>& q) { return {q.x, q.y, q.z}; }
  [[gnu::always_inline]] friend inline PackedVector operator+(const PackedVector& a, const PackedVector& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  [[gnu::always_inline]] friend inline PackedVector operator-(const PackedVector& a, const PackedVector& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  [[gnu::always_inline]] friend inline PackedVector operator*(const P& a, const PackedVector& b) {
    return {a * b.x, a * b.y, a * b.z};
  }
  [[gnu::always_inline]] P dot(const PackedVector& b) const { return x * b.x + y * b.y + z * b.z; }
  [[gnu::always_inline]] P squaredNorm() const { return dot(*this); }
  [[gnu::always_inline]] PackedVector cross(const PackedVector& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }
  /// |x| + |y| + |z|, at least the length.
  [[gnu::always_inline]] P sumAbs() const { return sizeOf(x) + sizeOf(y) + sizeOf(z); }
  [[gnu::always_inline]] Vector3<S> at(std::size_t lane) const {
    return Vector3<S>(x[lane], y[lane], z[lane]);
  }
  [[gnu::always_inline]] friend inline PackedVector choose(const typename P::Truth& truth,
                                                           const PackedVector& a, const PackedVector& b) {
    return {choose(truth, a.x, b.x), choose(truth, a.y, b.y), choose(truth, a.z, b.z)};
  }
};

}  // namespace gravel::detail
