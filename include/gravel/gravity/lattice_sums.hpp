#pragma once

/// \file
/// Sums over the points of a lattice of the derivatives of 1/r: what all far images of a source make of the
/// potential near the source.

#include <gravel/gravity/expansion.hpp>
#include <gravel/gravity/lattice_weights.hpp>

#include <vector>

namespace gravel::detail {

/// The potential that a unit source at the origin and its images at the points s of a lattice have, without
/// the source itself and the near ones of its images, is
///     K(r) = sum over far s of 1/|r - s| = sum_k D_k Q_k(r)  [+ (2 pi / 3 V) r^2 in three dimensions],
/// Q_k as in expansion.hpp. Found are the D_k of even order up to `order`; the others vanish, as s and -s are
/// both far or both near. The sum converges for |r| below the distance of the nearest far point.
template <Real T>
class LatticeSums {
 public:
  using Point = std::array<int, 3>;  ///< coordinates in the lattice

  /// A box of edges L repeated along all axes, with the homogeneous background that makes the mean density
  /// zero (Ewald 1921, Ann. Phys. 369, 253; for any order Nijboer & de Wette 1957, Physica 23, 309). With
  /// H_k(s) = |s|^(2n+1) D_k(s), n = |k|, and P, Q = 1 - P the incomplete gamma functions of n + 1/2 at
  /// (a s)^2:
  ///     D_k = sum over far s of Q D_k(s) - sum over near s of P D_k(s)
  ///           + (-1)^(n/2) pi^(3/2) 2^(2-n) / (V Gamma(n + 1/2)) sum over waves q of H_k(q)
  ///           e^(-(q/2a)^2)/q^2
  /// and for n = 0 besides -pi/(a^2 V) - 2a/sqrt(pi). Errs by 1e-15 of the first near terms.
  /// \param bound isNear(p) is false where a coordinate is above that of `bound`
  template <class Near>
  static std::vector<T> space(const Vector3<T>& L, int order, const Point& bound, Near&& isNear) {
    using std::sqrt;
    const T volume = L[0] * L[1] * L[2];
    const T mean = (L[0] + L[1] + L[2]) / T(3);
    const T a_sq = pi<T>() / (mean * mean);
    LatticeSums sums(order);
    std::vector<T> weights(at(order + 1));
    forOctant(L, T(T(45 + 2 * order) / a_sq), bound, [&](const Point& p, const Vector3<T>& s, int copies) {
      gammaShares(T(a_sq * s.squaredNorm()), weights);
      const bool near = isNear(p);
      for (T& w : weights) {
        w = T(copies) * (near ? T(-w) : T(T(1) - w));
      }
      sums.add(s, weights, true);
    });
    const T circle = T(2) * pi<T>();
    const Vector3<T> wave(circle / L[0], circle / L[1], circle / L[2]);
    forOctant(wave, T(T(180) * a_sq), {0, 0, 0}, [&](const Point&, const Vector3<T>& q, int copies) {
      const T q_sq = q.squaredNorm();
      T weight = T(4 * copies) * pi<T>() * negativeExponential(T(q_sq / (T(4) * a_sq))) / (volume * q_sq);
      for (int n = 0; n <= order; n += 2) {
        weights[at(n)] = weight;
        weight *= -q_sq / T((2 * n + 1) * (2 * n + 3));
      }
      sums.add(Vector3<T>(q / T(sqrt(q_sq))), weights, true);
    });
    sums.total_[0] -= pi<T>() / (a_sq * volume) + T(2) * T(sqrt(T(a_sq / pi<T>())));
    return sums.total_;
  }

  /// The lattice of two vectors of the plane z = 0, open across it. Of order 0 the sum over points within R
  /// grows as 2 pi R over the area of a cell, which is left out. All points but a middle of them are the same
  /// lattice, three times as large, of clusters of nine points (Berman & Greengard 1994, J. Math. Phys. 35,
  /// 6036). So with the clusters' moments M_j
  ///     D_k = sum over the ring of points around the middle of D_k(s) + sum_j M_j 3^-(|k| + |j| + 1)
  ///     D_(k+j),
  /// which is solved from the highest order down. Errs by about 1e-12 for cells of up to four to one.
  template <class Near>
  static std::vector<T> plane(const Vector3<T>& a, const Vector3<T>& b, int order, const Point& bound,
                              Near&& isNear) {
    constexpr int more = 14;  // orders of clusters beyond what is asked
    const int full = order + more;
    const int middle[2] = {middleOf(a, b), middleOf(b, a)};
    const int ring[2] = {3 * middle[0] + 1, 3 * middle[1] + 1};
    LatticeSums sums(full);
    const std::vector<T> both(at(full + 1), T(2));  // s and -s
    forHalf({ring[0], ring[1], 0}, a, b, [&](const Point& p, const Vector3<T>& s) {
      if (std::abs(p[0]) > middle[0] || std::abs(p[1]) > middle[1]) {
        sums.add(s, both, false);
      }
    });
    std::vector<T> moments(at(M::size(full)), T(0));
    std::vector<T> regular(moments.size());
    forHalf({1, 1, 0}, a, b, [&](const Point&, const Vector3<T>& s) {
      X::regular(full, s[0], s[1], s[2], regular.data());
      for (std::size_t k = 0; k < moments.size(); ++k) {
        moments[k] += T(2) * regular[k];
      }
    });
    moments[0] = T(0);  // its part of the sum is what is solved for
    sums.solve(moments);
    sums.cut(order);
    forHalf({std::max(bound[0], middle[0]), std::max(bound[1], middle[1]), 0}, a, b,
            [&](const Point& p, const Vector3<T>& s) {
              const bool inMiddle = std::abs(p[0]) <= middle[0] && std::abs(p[1]) <= middle[1];
              if (inMiddle != isNear(p)) {
                sums.add(s, std::vector<T>(at(order + 1), T(inMiddle ? 2 : -2)), false);
              }
            });
    return sums.total_;
  }

  /// The distance of the nearest point beyond the middle of such a lattice.
  static T beyondMiddle(const Vector3<T>& a, const Vector3<T>& b) {
    using std::sqrt;
    const int middle[2] = {middleOf(a, b), middleOf(b, a)};
    T least_sq = Vector3<T>(T(3 * middle[0]) * a).squaredNorm();
    forHalf({2 * middle[0] + 1, 2 * middle[1] + 1, 0}, a, b, [&](const Point& p, const Vector3<T>& s) {
      if (std::abs(p[0]) > middle[0] || std::abs(p[1]) > middle[1]) {
        least_sq = std::min<T>(least_sq, s.squaredNorm());
      }
    });
    return T(sqrt(least_sq));
  }

  /// The D_k of that lattice, of odd order too, seen from (0, 0, z), z > 0. Its whole potential is, by
  /// Poisson's formula, with A the area of a cell and q = 2 pi/A (i b_y - j a_y, j a_x - i b_x, 0),
  ///     K(r) = -2 pi z/A + sum over i, j but (0, 0) of 2 pi/(A q) e^(-q z) cos(q.r),
  /// of the same zero as in `plane`, so that
  ///     D_k = d^k K(0, 0, z) - sum over near s of D_k((0, 0, z) - s).
  /// The waves left out are below 1e-18 |k|!/z^(|k|+1). Errs by rounding of the near terms, at most
  /// |k|!/z^(|k|+1) each: good for bodies that are apart in z by about as much as in the plane, or more.
  /// \param near the near points, the origin among them
  static std::vector<T> planeAbove(const Vector3<T>& a, const Vector3<T>& b, const T& z, int order,
                                   const std::vector<Vector3<T>>& near) {
    using std::sqrt;
    LatticeSums sums(order);
    const T circle = T(2) * pi<T>();
    const T area = a[0] * b[1] - a[1] * b[0];
    const T most = T(45.0 + 2.2 * order) / z;
    const auto reach = [&most, &circle](const Vector3<T>& edge) {  // q.a = 2 pi i
      int n = 0;
      while (T(n) * circle <= most * T(sqrt(T(edge.squaredNorm())))) {
        ++n;
      }
      return n;
    };
    forHalf({reach(a), reach(b), 0}, Vector3<T>(circle / area * b[1], -(circle / area * b[0]), T(0)),
            Vector3<T>(-(circle / area * a[1]), circle / area * a[0], T(0)),
            [&](const Point&, const Vector3<T>& wave) {
              const T q = T(sqrt(T(wave.squaredNorm())));
              if (q <= most) {
                sums.addWave(wave, q, T(T(2) * circle / (area * q) * negativeExponential(T(q * z))));
              }
            });
    sums.total_[0] -= circle * z / area;
    sums.total_[at(D::row(1, 1))] -= circle / area;
    for (int n = 2; n <= order; ++n) {
      X::fillTrace(n, sums.total_.data());
    }
    for (const Vector3<T>& s : near) {
      const T s_sq = s.squaredNorm() + z * z;
      X::derivatives(order, T(-s[0]), T(-s[1]), z, T(T(-1) / s_sq), T(T(1) / T(sqrt(s_sq))),
                     sums.one_.data());
      for (std::size_t k = 0; k < sums.total_.size(); ++k) {
        sums.total_[k] -= sums.one_[k];
      }
    }
    return sums.total_;
  }

 private:
  using X = Expansion<HarmonicTerms>;
  using M = HarmonicTerms::Moments;
  using D = HarmonicTerms::Derivatives;

  explicit LatticeSums(int order) : order_(order), total_(at(D::size(order)), T(0)), one_(total_.size()) {}

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// Adds weights[n] D_k(s) for all even n = |k|; for points that stand for all of their signs, of the D_k
  /// even in every coordinate only: the others cancel.
  void add(const Vector3<T>& s, const std::vector<T>& weights, bool allSigns) {
    using std::sqrt;
    const T s_sq = s.squaredNorm();
    X::derivatives(order_, s[0], s[1], s[2], T(T(-1) / s_sq), T(T(1) / T(sqrt(s_sq))), one_.data());
    for (int n = 0; n <= order_; n += 2) {
      for (int c = 0; c <= std::min(n, 2); c += allSigns ? 2 : 1) {
        for (int b = 0; b <= n - c; b += allSigns ? 2 : 1) {
          const std::size_t k = at(D::row(n, c) + b);
          total_[k] += weights[at(n)] * one_[k];
        }
      }
    }
  }

  /// Adds the derivatives of weight e^(-q z) cos(wave.r) at the origin but for the rows c = 2.
  void addWave(const Vector3<T>& wave, const T& q, const T& weight) {
    std::vector<T> x(at(order_ + 1), weight);  // weight wave_x^n
    std::vector<T> y(x.size(), T(1));
    for (std::size_t n = 1; n < x.size(); ++n) {
      x[n] = x[n - 1] * wave[0];
      y[n] = y[n - 1] * wave[1];
    }
    for (int n = 0; n <= order_; ++n) {
      for (int c = 0; c <= M::lastZ(n); ++c) {
        if ((n - c) % 2 == 0) {  // of an odd order in the plane it is a sine
          const T sign = T(((n - c) / 2) % 2 == 0 ? 1 : -1) * (c == 0 ? T(1) : T(-q));
          for (int b = 0; b <= n - c; ++b) {
            total_[at(D::row(n, c) + b)] += sign * x[at(n - c - b)] * y[at(b)];
          }
        }
      }
    }
  }

  /// Turns the sum over the ring into that over all points but the middle.
  void solve(const std::vector<T>& moments) {
    std::vector<T> large(total_.size(), T(0));  // derivatives of the lattice three times as large
    std::vector<T> clusters(moments.size(), T(0));
    T scale(1);  // 3^-(n + 1)
    for (int n = 0; n <= order_; ++n) {
      scale /= T(3);
    }
    for (int n = order_; n >= 0; --n, scale *= T(3)) {
      if (n % 2 != 0) {
        continue;
      }
      X::contract(order_, n, n, moments.data(), large.data(), clusters.data());
      for (int c = 0; c <= M::lastZ(n); ++c) {
        for (int b = 0; b <= n - c; ++b) {
          T& d = total_[at(D::row(n, c) + b)];
          d = (d + clusters[at(M::row(n, c) + b)]) / (T(1) - T(9) * scale);
        }
      }
      X::fillTrace(n, total_.data());
      for (int k = D::start(n); k < D::start(n + 1); ++k) {
        large[at(k)] = scale * total_[at(k)];
      }
    }
  }

  void cut(int order) {
    order_ = order;
    total_.resize(at(D::size(order)));
    one_.resize(total_.size());
  }

  /// Points of the middle on each side along a: as far as it reaches along b.
  static int middleOf(const Vector3<T>& a, const Vector3<T>& b) {
    int n = 2;
    while (T(n * n) * a.squaredNorm() < T(4) * b.squaredNorm()) {
      ++n;
    }
    return n;
  }

  /// Calls visit(p, s) for one of s and -s of all points but the origin within `bound`.
  template <class Visit>
  static void forHalf(const Point& bound, const Vector3<T>& a, const Vector3<T>& b, Visit&& visit) {
    for (int i = 0; i <= bound[0]; ++i) {
      for (int j = i == 0 ? 1 : -bound[1]; j <= bound[1]; ++j) {
        visit(Point{i, j, 0}, Vector3<T>(T(i) * a + T(j) * b));
      }
    }
  }

  /// Calls visit(p, s, copies) for the points but the origin with no negative coordinate within the root of
  /// reach_sq or within `bound`. `copies` points differ from one by signs alone.
  template <class Visit>
  static void forOctant(const Vector3<T>& L, const T& reach_sq, const Point& bound, Visit&& visit) {
    const auto goesOn = [&](int i, int axis) {
      const T x = T(i) * L[axis];
      return i <= bound[at(axis)] || x * x <= reach_sq;
    };
    for (int i = 0; goesOn(i, 0); ++i) {
      for (int j = 0; goesOn(j, 1); ++j) {
        for (int k = 0; goesOn(k, 2); ++k) {
          const Vector3<T> s(T(i) * L[0], T(j) * L[1], T(k) * L[2]);
          const bool isBound = i <= bound[0] && j <= bound[1] && k <= bound[2];
          if (i + j + k > 0 && (isBound || s.squaredNorm() <= reach_sq)) {
            visit({i, j, k}, s, (i > 0 ? 2 : 1) * (j > 0 ? 2 : 1) * (k > 0 ? 2 : 1));
          }
        }
      }
    }
  }

  int order_;
  std::vector<T> total_;
  std::vector<T> one_;
};

}  // namespace gravel::detail
