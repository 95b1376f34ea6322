#pragma once

/// \file
/// The costly operators of expansions for a batch of pairs of cells, or of bodies, at a time. In double and
/// of orders up to `unrolledOrder` they are unrolled with every index a constant, three to fifteen times as
/// fast as loops over the short rows of an expansion. The lanes are the compilers' own vectors of the
/// target's width: thousands of Eigen's expressions would cost every including file minutes.

#include <gravel/gravity/expansion.hpp>

namespace gravel::detail {

#if defined(__AVX512F__)
inline constexpr std::size_t nativeBytes = 64;
#elif defined(__AVX__)
inline constexpr std::size_t nativeBytes = 32;
#else
inline constexpr std::size_t nativeBytes = 16;
#endif

/// As many doubles as the target computes with at once.
using NativeDoubles [[gnu::vector_size(nativeBytes)]] = double;

template <>
struct LaneScalar<NativeDoubles> {
  using Type = double;
};

/// Lanes of far-field work: a batch is `parts` vectors of `width` lanes, eight in all for double on any
/// target, so that the order of sums does not depend on it. Coefficient k of a part stands at [k], a vector.
template <Real F>
struct FarBatch {
  using V = F;
  static constexpr std::size_t width = 1;
  static constexpr std::size_t size = 1;

  static V zero() { return F(0); }
  static V load(const F* p) { return *p; }
  static void store(F* p, const V& v) { *p = v; }
};

template <>
struct FarBatch<double> {
  using V = NativeDoubles;
  static constexpr std::size_t width = nativeBytes / sizeof(double);
  static constexpr std::size_t size = 8;

  static V zero() { return V{}; }
  static V load(const double* p) {
    V v;
    std::copy_n(p, width, reinterpret_cast<double*>(&v));
    return v;
  }
  static void store(double* p, const V& v) { std::copy_n(reinterpret_cast<const double*>(&v), width, p); }
};

/// Up to these orders; at bodies lower, where it is a smaller share of the work beside the time to compile.
inline constexpr int unrolledOrder = 10;
inline constexpr int unrolledOrderAtBodies = 6;

/// The terms that a result of order N of a harmonic contraction of order P has: each moment, with or without
/// the dipoles, and the derivative that belongs to it, counted from that of the first moment. They are the
/// same for every result of a row (N, C).
template <int P, int N, int C, bool Dipole>
struct RowTerms {
  using M = HarmonicTerms::Moments;
  using D = HarmonicTerms::Derivatives;
  static constexpr int count = M::size(P - N) - (P > N && !Dipole ? 3 : 0);

  std::array<short, std::size_t{count}> moment{};
  std::array<short, std::size_t{count}> derivative{};

  constexpr RowTerms() {
    std::size_t term = 0;
    for (int k = 0; k <= P - N; ++k) {
      for (int c = 0; (Dipole || k != 1) && c <= M::lastZ(k); ++c) {
        for (int b = 0; b <= k - c; ++b, ++term) {
          moment[term] = static_cast<short>(M::row(k, c) + b);
          derivative[term] = static_cast<short>(D::row(N + k, C + c) + b);
        }
      }
    }
  }
};

/// Expansion<HarmonicTerms>'s operators between cells, of order P, unrolled.
template <int P>
struct UnrolledExpansion {
  using M = HarmonicTerms::Moments;
  using D = HarmonicTerms::Derivatives;
  using V = NativeDoubles;

  /// locals += what moments (without dipoles) make of derivatives, from the order `first` (0 or 1) on.
  static void contract(int first, const V* moments, const V* derivatives, V* locals) {
    if (first == 0) {
      contractTo<false, 0, 0, 0>(moments, derivatives, locals);
    }
    contractAll(moments, derivatives, locals, std::make_index_sequence<std::size_t{P}>());
  }

  /// Derivatives of f = 1/r, given that and q = -1/r^2.
  static void derivatives(const V& x, const V& y, const V& z, const V& q, const V& f, V* d) {
    d[0] = f;
    derivativesAll({q * x, q * y, q * z, q}, d, std::make_index_sequence<std::size_t{P}>());
  }

  /// q[k] = Q_k(x, y, z).
  static void regular(const V& x, const V& y, const V& z, V* q) {
    q[0] = x - x + 1.0;
    regularAll(x, y, z, q, std::make_index_sequence<std::size_t{P}>());
  }

  /// field += a local expansion and its first derivatives, or, with `first` 1, these alone.
  static void evaluate(int first, const V* regular, const double* local, V* field) {
    if (first == 0) {
      contractTo<true, 0, 0, 0>(regular, local, field);
    }
    contractTo<true, 1, 0, 0>(regular, local, field);
    contractTo<true, 1, 1, 0>(regular, local, field);
  }

 private:
  template <std::size_t... N>
  static void contractAll(const V* m, const V* d, V* out, std::index_sequence<N...>) {
    ((contractTo<false, N + 1, 0, 0>(m, d, out), contractTo<false, N + 1, 1, 0>(m, d, out)), ...);
  }

  /// The results from (N, C, B) to the end of the row, four at a time: each moment is loaded once for them,
  /// and their sums do not wait for each other.
  template <bool Dipole, int N, int C, int B, class TD>
  static void contractTo(const V* m, const TD* d, V* out) {
    constexpr int results = std::min(4, N - C - B + 1);
    if constexpr (results > 0) {
      static constexpr RowTerms<P, N, C, Dipole> terms{};
      V sums[std::size_t{results}];
      V* to = out + M::row(N, C) + B;
      std::copy_n(to, results, sums);
      addTerms(sums, terms, m, d + B, std::make_index_sequence<std::size_t{results}>(),
               std::make_index_sequence<std::size_t{terms.count}>());
      std::copy_n(sums, results, to);
      contractTo<Dipole, N, C, B + results>(m, d, out);
    }
  }

  template <class Sums, class Terms, class TD, class Results, std::size_t... I>
  [[gnu::always_inline]] static void addTerms(Sums& sums, const Terms& terms, const V* m, const TD* d,
                                              Results results, std::index_sequence<I...>) {
    (addTerm(sums, m[terms.moment[I]], d + terms.derivative[I], results), ...);
  }

  template <class Sums, class TD, std::size_t... R>
  [[gnu::always_inline]] static void addTerm(Sums& sums, const V& moment, const TD* d,
                                             std::index_sequence<R...>) {
    ((sums[R] += moment * d[R]), ...);
  }

  struct Steps {
    V x, y, z, q;
  };

  template <std::size_t... N>
  static void derivativesAll(const Steps& v, V* d, std::index_sequence<N...>) {
    ((derivativesRow<N + 1, 0>(v, d, std::make_index_sequence<N + 2>()),
      derivativesRow<N + 1, 1>(v, d, std::make_index_sequence<N + 1>()),
      traceRow<N + 1>(d, std::make_index_sequence<N>())),
     ...);
  }

  template <int N, int C, std::size_t... B>
  static void derivativesRow(const Steps& v, V* d, std::index_sequence<B...>) {
    (derivative<N, C, static_cast<int>(B)>(v, d), ...);
  }

  template <int N, std::size_t... B>
  static void traceRow(V* d, std::index_sequence<B...>) {
    ((d[D::row(N, 2) + B] = -(d[D::row(N, 0) + B] + d[D::row(N, 0) + B + 2])), ...);
  }

  /// See Expansion::derivatives.
  template <int N, int C, int B>
  static void derivative(const Steps& v, V* d) {
    constexpr int a = N - C - B;
    constexpr int lead = C > 0 ? 2 : B > 0 ? 1 : 0;
    constexpr int first = D::row(N - 1, C) + B;
    constexpr int second = N > 1 ? D::row(N - 2, C) + B : 0;
    V sum = v.q - v.q;
    if constexpr (a > 0) {
      sum += double(lead == 0 ? 2 * a - 1 : 2 * a) * (v.x * d[first]);
    }
    if constexpr (a > 1) {
      sum += double(lead == 0 ? (a - 1) * (a - 1) : a * (a - 1)) * (v.q * d[second]);
    }
    if constexpr (B > 0) {
      sum += double(lead == 1 ? 2 * B - 1 : 2 * B) * (v.y * d[first - 1]);
    }
    if constexpr (B > 1) {
      sum += double(lead == 1 ? (B - 1) * (B - 1) : B * (B - 1)) * (v.q * d[second - 2]);
    }
    if constexpr (C > 0) {
      sum += v.z * d[D::row(N - 1, 0) + B];
    }
    d[D::row(N, C) + B] = sum;
  }

  template <std::size_t... N>
  static void regularAll(const V& x, const V& y, const V& z, V* q, std::index_sequence<N...>) {
    ((regularRow<N + 1, 0>(x, y, z, q, std::make_index_sequence<N + 2>()),
      regularRow<N + 1, 1>(x, y, z, q, std::make_index_sequence<N + 1>())),
     ...);
  }

  template <int N, int C, std::size_t... B>
  static void regularRow(const V& x, const V& y, const V& z, V* q, std::index_sequence<B...>) {
    (regularTerm<N, C, static_cast<int>(B)>(x, y, z, q), ...);
  }

  /// See Expansion::regular.
  template <int N, int C, int B>
  static void regularTerm(const V& x, const V& y, const V& z, V* q) {
    constexpr int a = N - C - B;
    V sum = x - x;
    if constexpr (a > 0) {
      sum += x * q[M::row(N - 1, C) + B];
    }
    if constexpr (B > 0) {
      sum += y * q[M::row(N - 1, C) + B - 1];
    }
    if constexpr (C > 0) {
      sum += z * q[M::row(N - 1, 0) + B];
    } else {
      if constexpr (a > 1) {
        sum -= z * q[M::row(N - 1, 1) + B];
      }
      if constexpr (B > 1) {
        sum -= z * q[M::row(N - 1, 1) + B - 2];
      }
    }
    q[M::row(N, C) + B] = (1.0 / N) * sum;
  }
};

/// The costly operators, unrolled where they can be.
template <class Terms, class V>
struct FarOperators {
  using X = Expansion<Terms>;
  using F = ScalarOf<V>;

  /// A batch's locals += the effect of its moments at the distances x, y, z; f = 0 switches a lane off.
  /// \param f 1/r  \param q -1/(r^2 + eps^2)
  static void interact(int order, int first, const V& x, const V& y, const V& z, const V& q, const V& f,
                       const V* moments, V* derivatives, V* locals) {
    const bool done = unrolled<unrolledOrder>(order, [&](auto expansion) {
      expansion.derivatives(x, y, z, q, f, derivatives);
      expansion.contract(first, moments, derivatives, locals);
    });
    if (!done) {
      X::derivatives(order, x, y, z, q, f, derivatives);
      X::template contract<false>(order, first, order, moments, derivatives, locals);
    }
  }

  static void regular(int order, const V& x, const V& y, const V& z, V* q) {
    if (!unrolled<unrolledOrderAtBodies>(order, [&](auto expansion) { expansion.regular(x, y, z, q); })) {
      X::regular(order, x, y, z, q);
    }
  }

  /// field += a local expansion and its first derivatives at the places of Q = regular; without the expansion
  /// itself if `first` is 1. \param local in the rows of derivatives
  static void evaluate(int order, int first, const V* regular, const F* local, V* field) {
    if (!unrolled<unrolledOrderAtBodies>(
            order, [&](auto expansion) { expansion.evaluate(first, regular, local, field); })) {
      X::contract(order, first, 1, regular, local, field);
    }
  }

 private:
  /// Calls f with the unrolled operators of an order if there are any.
  template <int Last, class Call>
  static bool unrolled(int order, Call&& call) {
    if constexpr (Terms::harmonic && std::is_same_v<V, NativeDoubles>) {
      return choose(order, call, std::make_index_sequence<std::size_t{Last}>());
    } else {
      return false;
    }
  }

  template <class Call, std::size_t... I>
  static bool choose(int order, Call& call, std::index_sequence<I...>) {
    return ((order == I + 1 && (call(UnrolledExpansion<I + 1>()), true)) || ...);
  }
};

}  // namespace gravel::detail
