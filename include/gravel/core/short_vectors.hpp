#pragma once

/// \file
/// Vectors of four numbers by the extensions of g++ and clang, as the target holds them.

#include <gravel/core/types.hpp>

#include <utility>

namespace gravel::detail {

template <class S>
inline constexpr bool isPackable = std::is_same_v<S, float> || std::is_same_v<S, double>;

/// How many numbers are one Packed.
template <class S>
inline constexpr std::size_t packWidth = isPackable<S> ? 4 : 1;

/// Whether four numbers take two registers of the target: without AVX, doubles do. (g++ takes longer vectors
/// than the target has apart into single numbers where it shuffles them.)
#ifdef __AVX__
template <class S>
inline constexpr bool isPaired = false;
#else
template <class S>
inline constexpr bool isPaired = std::is_same_v<S, double>;
#endif

template <class S, std::size_t count>
struct VectorOf {
  using Whole = std::conditional_t<sizeof(S) == 8, std::int64_t, std::int32_t>;
  using Type __attribute__((vector_size(count * sizeof(S)))) = S;
  using Truth __attribute__((vector_size(count * sizeof(S)))) = Whole;
};

/// Two short vectors that count as one.
template <class V, class M>
struct VectorPair {
  V low;
  V high;

  [[gnu::always_inline]] auto operator[](std::size_t lane) const {
    return lane < 2 ? low[lane] : high[lane - 2];
  }
  [[gnu::always_inline]] friend inline VectorPair operator+(const VectorPair& a, const VectorPair& b) {
    return {a.low + b.low, a.high + b.high};
  }
  [[gnu::always_inline]] friend inline VectorPair operator-(const VectorPair& a, const VectorPair& b) {
    return {a.low - b.low, a.high - b.high};
  }
  [[gnu::always_inline]] friend inline VectorPair operator*(const VectorPair& a, const VectorPair& b) {
    return {a.low * b.low, a.high * b.high};
  }
  [[gnu::always_inline]] friend inline VectorPair operator/(const VectorPair& a, const VectorPair& b) {
    return {a.low / b.low, a.high / b.high};
  }
  [[gnu::always_inline]] friend inline VectorPair operator-(const VectorPair& a) { return {-a.low, -a.high}; }
  [[gnu::always_inline]] friend inline VectorPair<M, M> operator>(const VectorPair& a, const VectorPair& b) {
    return {a.low > b.low, a.high > b.high};
  }
  [[gnu::always_inline]] friend inline VectorPair operator&(const VectorPair& a, const VectorPair& b) {
    return {a.low & b.low, a.high & b.high};
  }
  [[gnu::always_inline]] friend inline VectorPair operator|(const VectorPair& a, const VectorPair& b) {
    return {a.low | b.low, a.high | b.high};
  }
  [[gnu::always_inline]] friend inline VectorPair operator~(const VectorPair& a) { return {~a.low, ~a.high}; }
};

template <class S>
struct PackedRaw {
  using Type = S;
  using Truth = bool;
};
template <class S>
  requires isPackable<S>
struct PackedRaw<S> {
  using Short = VectorOf<S, 2>;
  using Long = VectorOf<S, 4>;
  using Pair = VectorPair<typename Short::Type, typename Short::Truth>;
  using Type = std::conditional_t<isPaired<S>, Pair, typename Long::Type>;
  using Truth = std::conditional_t<isPaired<S>, VectorPair<typename Short::Truth, typename Short::Truth>,
                                   typename Long::Truth>;
};

/// Four vectors of which each was from another source, and back.
template <class V, class M>
[[gnu::always_inline]] inline void transpose(VectorPair<V, M>& q0, VectorPair<V, M>& q1, VectorPair<V, M>& q2,
                                             VectorPair<V, M>& q3) {
  const auto turn = [](V& a, V& b) {
    const V first = __builtin_shufflevector(a, b, 0, 2);
    b = __builtin_shufflevector(a, b, 1, 3);
    a = first;
  };
  turn(q0.low, q1.low);
  turn(q2.low, q3.low);
  turn(q0.high, q1.high);
  turn(q2.high, q3.high);
  std::swap(q0.high, q2.low);
  std::swap(q1.high, q3.low);
}
template <class Raw>
[[gnu::always_inline]] inline void transpose(Raw& q0, Raw& q1, Raw& q2, Raw& q3) {
  const Raw a = __builtin_shufflevector(q0, q1, 0, 4, 2, 6);
  const Raw b = __builtin_shufflevector(q0, q1, 1, 5, 3, 7);
  const Raw c = __builtin_shufflevector(q2, q3, 0, 4, 2, 6);
  const Raw d = __builtin_shufflevector(q2, q3, 1, 5, 3, 7);
  q0 = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  q1 = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  q2 = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  q3 = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

}  // namespace gravel::detail
