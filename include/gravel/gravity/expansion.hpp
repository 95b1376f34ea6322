#pragma once

/// \file
/// Taylor expansions of the potential of points, far from them and far from where it is wanted, in Cartesian
/// coordinates: the operators of the fast multipole method. Pure functions over plain arrays of coefficients,
/// for a scalar or for lanes.
///
/// With a source at z_B - s and a sink at z_A + t, and R = z_A - z_B,
///     f(|R + t + s|) = sum_k sum_j Q_k(t) Q_j(s) D_{k+j}(R),   Q_k(t) = t^k / k!,   D_k = d^k f(|R|),
/// over multi-indices k = (a, b, c) of x, y, z. Of order p: all terms with |k| + |j| <= p. That set is the
/// same seen from both ends, so that the force of A on B is the force of B on A, whatever p (Dehnen 2002, J.
/// Comput. Phys. 179, 27).
///
/// Unsoftened, f = 1/r is harmonic: each d^2/dz^2 can be written as -d^2/dx^2 - d^2/dy^2, and only c <= 1 is
/// left: 2n+1 coefficients of order n instead of (n+1)(n+2)/2. The Q_k are then the harmonic polynomials that
/// collect what the others stood for.

#include <gravel/gravity/pair_tiles.hpp>

namespace gravel::detail {

/// Where the coefficient (a, b, c) of order n = a + b + c stands: at row(n, c) + b.
template <int MaxZ>
struct CoefficientRows {
  static constexpr int lastZ(int n) { return n < MaxZ ? n : MaxZ; }
  static constexpr int start(int n) {
    const int full = std::min(n, MaxZ);  // orders below it have every c
    return full * (full + 1) * (full + 2) / 6 + (n - full) * (MaxZ + 1) +
           (n * (n - 1) - full * (full - 1)) / 2 * (MaxZ + 1) - (n - full) * (MaxZ * (MaxZ + 1) / 2);
  }
  static constexpr int row(int n, int c) { return start(n) + c * (n + 1) - c * (c - 1) / 2; }
  static constexpr int size(int order) { return start(order + 1); }
};

/// The terms of 1/r.
struct HarmonicTerms {
  static constexpr bool harmonic = true;
  using Moments = CoefficientRows<1>;
  using Derivatives = CoefficientRows<2>;  // sums of two indices of moments
};

/// The terms of a kernel that solves no Laplace equation.
struct AllTerms {
  static constexpr bool harmonic = false;
  using Moments = CoefficientRows<64>;
  using Derivatives = Moments;
};

/// The scalar in a lane.
template <class T>
struct LaneScalar {
  using Type = T;
};
template <class T, int W>
struct LaneScalar<Eigen::Array<T, W, 1>> {
  using Type = T;
};
template <class T>
using ScalarOf = typename LaneScalar<T>::Type;

/// The operators on expansions of one kind of terms.
template <class Terms>
struct Expansion {
  using M = typename Terms::Moments;
  using D = typename Terms::Derivatives;

  /// q[k] = Q_k(x, y, z) for all orders up to `order`.
  template <class T>
  static void regular(int order, const T& x, const T& y, const T& z, T* q) {
    using S = ScalarOf<T>;
    q[0] = T(x - x + S(1));
    for (int n = 1; n <= order; ++n) {
      const S inverse = S(1) / S(n);
      for (int c = 0; c <= M::lastZ(n); ++c) {
        for (int b = 0; b <= n - c; ++b) {
          const int a = n - c - b;
          T sum = T(x - x);
          if (a > 0) {
            sum += x * q[M::row(n - 1, c) + b];
          }
          if (b > 0) {
            sum += y * q[M::row(n - 1, c) + b - 1];
          }
          if (c > 0) {
            sum += z * q[M::row(n - 1, c - 1) + b];
          } else if (Terms::harmonic) {
            if (a > 1) {
              sum -= z * q[M::row(n - 1, 1) + b];
            }
            if (b > 1) {
              sum -= z * q[M::row(n - 1, 1) + b - 2];
            }
          }
          q[M::row(n, c) + b] = T(inverse * sum);
        }
      }
    }
  }

  /// d[k] = D_k(x, y, z) of f = (r^2 + eps^2)^(-1/2), given that and q = -1/(r^2 + eps^2). From
  /// (r^2 + eps^2) df/dx = -x f, differentiated by Leibniz' rule.
  template <class T>
  static void derivatives(int order, const T& x, const T& y, const T& z, const T& q, const T& f, T* d) {
    using S = ScalarOf<T>;
    const T qx = q * x;
    const T qy = q * y;
    const T qz = q * z;
    d[0] = f;
    for (int n = 1; n <= order; ++n) {
      const int last = Terms::harmonic ? std::min(n, 1) : n;
      for (int c = 0; c <= last; ++c) {
        for (int b = 0; b <= n - c; ++b) {
          const int a = n - c - b;
          const int first = D::row(n - 1, c) + b;
          const int second = n > 1 ? D::row(n - 2, c) + b : 0;
          // One index plays d/dx of the equation: the last of z, y, x that is there.
          const int lead = c > 0 ? 2 : b > 0 ? 1 : 0;
          T sum = T(q - q);
          if (a > 0) {
            sum += S(lead == 0 ? 2 * a - 1 : 2 * a) * (qx * d[first]);
          }
          if (a > 1) {
            sum += S(lead == 0 ? (a - 1) * (a - 1) : a * (a - 1)) * (q * d[second]);
          }
          if (b > 0) {
            sum += S(lead == 1 ? 2 * b - 1 : 2 * b) * (qy * d[first - 1]);
          }
          if (b > 1) {
            sum += S(lead == 1 ? (b - 1) * (b - 1) : b * (b - 1)) * (q * d[second - 2]);
          }
          if (c > 0) {
            sum += S(2 * c - 1) * (qz * d[D::row(n - 1, c - 1) + b]);
          }
          if (c > 1) {
            sum += S((c - 1) * (c - 1)) * (q * d[D::row(n - 2, c - 2) + b]);
          }
          d[D::row(n, c) + b] = sum;
        }
      }
      fillTrace(n, d);
    }
  }

  /// Where the moment (a, b, c) stands.
  static constexpr std::size_t indexOf(int a, int b, int c) {
    const int index = M::row(a + b + c, c) + b;
    return static_cast<std::size_t>(index);
  }

  /// The coefficients of a local expansion in the rows of derivatives.
  template <class T>
  static void spreadOut(int order, const T* local, T* d) {
    for (int n = 0; n <= order; ++n) {
      for (int c = 0; c <= M::lastZ(n); ++c) {
        std::copy_n(local + M::row(n, c), n - c + 1, d + D::row(n, c));
      }
      fillTrace(n, d);
    }
  }

  /// The rows c = 2 of order n of harmonic derivatives, from the rows c = 0.
  template <class T>
  static void fillTrace(int n, T* d) {
    if (Terms::harmonic && n >= 2) {
      const T* flat = d + D::row(n, 0);
      T* out = d + D::row(n, 2);
      for (int b = 0; b <= n - 2; ++b) {
        out[b] = T(-(flat[b] + flat[b + 2]));
      }
    }
  }

  /// out[k] += sum_j m[j] d[k + j] for first <= |k| <= last, |k| + |j| <= order. Moments of order 1 are taken
  /// as zero unless `dipole`. With the moments of a cell this makes the local expansion of another; with
  /// m = Q(t) and the derivatives of a local expansion it moves that expansion by t.
  template <bool Dipole = true, class TM, class TD, class T>
  static void contract(int order, int first, int last, const TM* m, const TD* d, T* out) {
    for (int n = first; n <= last; ++n) {
      for (int c = 0; c <= M::lastZ(n); ++c) {
        T* row = out + M::row(n, c);
        int b = 0;
        for (; b + 3 <= n - c; b += 4) {
          contractBlock<4, Dipole>(order, n, c, b, m, d, row + b);
        }
        switch (n - c - b) {
          case 0:
            contractBlock<1, Dipole>(order, n, c, b, m, d, row + b);
            break;
          case 1:
            contractBlock<2, Dipole>(order, n, c, b, m, d, row + b);
            break;
          case 2:
            contractBlock<3, Dipole>(order, n, c, b, m, d, row + b);
            break;
          default:
            break;
        }
      }
    }
  }

  /// out[k] += sum_j q[j] (d^j of m)_k: the moments m about a new centre, q = Q(new centre - old centre).
  template <class S>
  static void shiftMoments(int order, const S* q, const S* m, S* out) {
    for (int n = 0; n <= order; ++n) {
      for (int c = 0; c <= M::lastZ(n); ++c) {
        for (int b = 0; b <= n - c; ++b) {
          const int a = n - c - b;
          S sum = S(q[0] - q[0]);
          for (int k = 0; k <= n; ++k) {
            for (int c2 = 0; c2 <= M::lastZ(k); ++c2) {
              const int low = std::max(0, k - c2 - a);  // b2 such that a2 = k - c2 - b2 <= a
              if (c2 <= c) {
                const S* rest = m + M::row(n - k, c - c2) + b;
                for (int b2 = low; b2 <= std::min(b, k - c2); ++b2) {
                  sum += q[M::row(k, c2) + b2] * rest[-b2];
                }
              } else if (Terms::harmonic) {  // c = 0, c2 = 1: d/dz Q_ab0 = -Q_(a-2)b1 - Q_a(b-2)1
                for (int b2 = low; b2 <= std::min(b, k - c2); ++b2) {
                  const int a1 = a - (k - c2 - b2);
                  const int b1 = b - b2;
                  S both = S(q[0] - q[0]);
                  if (a1 >= 2) {
                    both += m[M::row(n - k, 1) + b1];
                  }
                  if (b1 >= 2) {
                    both += m[M::row(n - k, 1) + b1 - 2];
                  }
                  sum -= q[M::row(k, c2) + b2] * both;
                }
              }
            }
          }
          out[M::row(n, c) + b] += sum;
        }
      }
    }
  }

 private:
  /// The coefficients b … b + B - 1 of the row (n, c). The sums stand in variables of their own, which
  /// compilers keep in registers as they do not with arrays of lanes.
  template <int B, bool Dipole, class TM, class TD, class T>
  static void contractBlock(int p, int n, int c, int b, const TM* m, const TD* d, T* out) {
    T s0 = out[0];
    T s1 = out[B > 1 ? 1 : 0];
    T s2 = out[B > 2 ? 2 : 0];
    T s3 = out[B > 3 ? 3 : 0];
    for (int k = 0; k <= p - n; ++k) {
      if (!Dipole && k == 1) {
        continue;
      }
      for (int c2 = 0; c2 <= M::lastZ(k); ++c2) {
        const TM* mk = m + M::row(k, c2);
        const TM* end = mk + k - c2 + 1;
        const TD* dk = d + D::row(n + k, c + c2) + b;
        for (; mk != end; ++mk, ++dk) {
          const TM mb = *mk;
          s0 += mb * dk[0];
          if constexpr (B > 1) {
            s1 += mb * dk[1];
          }
          if constexpr (B > 2) {
            s2 += mb * dk[2];
          }
          if constexpr (B > 3) {
            s3 += mb * dk[3];
          }
        }
      }
    }
    out[0] = s0;
    if constexpr (B > 1) {
      out[1] = s1;
    }
    if constexpr (B > 2) {
      out[2] = s2;
    }
    if constexpr (B > 3) {
      out[3] = s3;
    }
  }
};

}  // namespace gravel::detail
