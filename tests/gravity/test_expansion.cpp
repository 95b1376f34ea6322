#include "oracle/gravity.hpp"
#include "support/catch.hpp"
#include <gravel/gravity/expansion_lanes.hpp>

using namespace gravel;
using namespace gravel::test;
using gravel::detail::AllTerms;
using gravel::detail::Expansion;
using gravel::detail::HarmonicTerms;

namespace {

using Vec = Vector3<double>;

template <class Terms>
struct Operators {
  using X = Expansion<Terms>;
  using M = typename X::M;
  using D = typename X::D;

  static std::vector<double> regular(int p, const Vec& t) {
    std::vector<double> q(static_cast<std::size_t>(M::size(p)));
    X::regular(p, t[0], t[1], t[2], q.data());
    return q;
  }

  /// Moments of points about a centre.
  static std::vector<double> moments(int p, const PointMasses<double>& points, const Vec& centre) {
    std::vector<double> m(static_cast<std::size_t>(M::size(p)), 0.0);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto q = regular(p, centre - points.positions[i]);
      for (std::size_t k = 0; k < m.size(); ++k) {
        m[k] += points.masses[i] * q[k];
      }
    }
    return m;
  }

  static std::vector<double> derivatives(int p, const Vec& r, double softening_sq) {
    std::vector<double> d(static_cast<std::size_t>(D::size(p)));
    const double s = r.squaredNorm() + softening_sq;
    X::derivatives(p, r[0], r[1], r[2], -1 / s, 1 / std::sqrt(s), d.data());
    return d;
  }

  static std::vector<double> local(int p, const std::vector<double>& m, const Vec& r, double softening_sq) {
    std::vector<double> out(m.size(), 0.0);
    X::contract(p, 0, p, m.data(), derivatives(p, r, softening_sq).data(), out.data());
    return out;
  }

  /// A local expansion about a place that lies t further on.
  static std::vector<double> shifted(int p, const std::vector<double>& local, const Vec& t) {
    std::vector<double> d(static_cast<std::size_t>(D::size(p)));
    for (int n = 0; n <= p; ++n) {
      for (int c = 0; c <= M::lastZ(n); ++c) {
        std::copy_n(local.data() + M::row(n, c), n - c + 1, d.data() + D::row(n, c));
      }
      X::fillTrace(n, d.data());
    }
    std::vector<double> out(local.size(), 0.0);
    X::contract(p, 0, p, regular(p, t).data(), d.data(), out.data());
    return out;
  }

  /// Relative error of the force of points in a ball of radius 1 on a place 1 from a sink's centre, at a
  /// distance of centres.
  static double forceError(int p, double distance, double softening) {
    const auto points = randomMasses<double>(40, 90, 1.1);
    const Vec sink(distance * 0.6, -distance * 0.64, distance * 0.48);
    const Vec t(0.4, 0.5, -0.3);
    const auto at = shifted(p, local(p, moments(p, points, Vec::Zero()), sink, softening * softening), t);
    Vec exact = Vec::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec d = points.positions[i] - sink - t;
      exact += points.masses[i] * std::pow(d.squaredNorm() + softening * softening, -1.5) * d;
    }
    return (Vec(at[1], at[2], at[3]) - exact).norm() / exact.norm();
  }
};

double largest(const std::vector<double>& a) {
  double most = 0;
  for (const double x : a) {
    most = std::max(most, std::abs(x));
  }
  return most;
}

double difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::abs(a[i] - b[i]));
  }
  return most;
}

}  // namespace

// Each coefficient is a sum of at most a few hundred products of numbers that the largest one bounds.
TEMPLATE_TEST_CASE("moments about a new centre are those taken there, to rounding", "", HarmonicTerms,
                   AllTerms) {
  using O = Operators<TestType>;
  const auto points = randomMasses<double>(20, 91);
  const Vec first(0.1, 0.2, -0.1);
  const Vec second(-0.3, 0.2, 0.5);
  for (int p = 1; p <= 14; ++p) {
    const auto m = O::moments(p, points, first);
    const auto q = O::regular(p, second - first);
    std::vector<double> moved(m.size(), 0.0);
    Expansion<TestType>::shiftMoments(p, q.data(), m.data(), moved.data());
    const auto direct = O::moments(p, points, second);
    CAPTURE(p);
    CHECK(difference(moved, direct) <= 1e-14 * largest(direct));
  }
}

TEMPLATE_TEST_CASE("a local expansion moved in two steps is that moved in one, to rounding", "",
                   HarmonicTerms, AllTerms) {
  using O = Operators<TestType>;
  const auto points = randomMasses<double>(20, 92);
  for (int p = 1; p <= 14; ++p) {
    const auto local = O::local(p, O::moments(p, points, Vec::Zero()), Vec(2, -1.5, 1), 0.0);
    const Vec a(0.1, 0.2, -0.1);
    const Vec b(0.2, -0.4, 0.3);
    const auto once = O::shifted(p, local, a + b);
    const auto twice = O::shifted(p, O::shifted(p, local, a), b);
    CAPTURE(p);
    CHECK(difference(once, twice) <= 1e-14 * largest(local));
  }
}

TEST_CASE("the terms of 1/r are those of all kernels where nothing is softened") {
  const auto points = randomMasses<double>(20, 93);
  for (int p = 1; p <= 12; ++p) {
    const Vec r(2, -1.5, 1);
    const Vec t(0.2, 0.1, -0.3);
    const auto few = Operators<HarmonicTerms>::shifted(
        p,
        Operators<HarmonicTerms>::local(p, Operators<HarmonicTerms>::moments(p, points, Vec::Zero()), r, 0.0),
        t);
    const auto all = Operators<AllTerms>::shifted(
        p, Operators<AllTerms>::local(p, Operators<AllTerms>::moments(p, points, Vec::Zero()), r, 0.0), t);
    for (std::size_t k = 0; k < 4; ++k) {
      CHECK_THAT(few[k], WithinRel(all[k], 1e-12));
    }
  }
}

// The first term that an expansion of order p leaves out of the force is (size / distance)^p of it. Two
// sided: 2^p from one distance to twice that, within 15 % of the exponent.
TEMPLATE_TEST_CASE("the error of the force falls with the distance as its power p", "", HarmonicTerms,
                   AllTerms) {
  for (const int p : {1, 2, 3, 4, 5, 6, 8, 10}) {
    const double softening = TestType::harmonic ? 0.0 : 0.5;
    const double near = Operators<TestType>::forceError(p, 16.0, softening);
    const double far = Operators<TestType>::forceError(p, 32.0, softening);
    CAPTURE(p, near, far);
    if (far > 1e-13) {
      CHECK_THAT(std::log2(near / far), WithinAbs(p, 0.15 * p + 0.1));
    } else {
      CHECK(near < 1e-11);
    }
  }
}

TEST_CASE("the softened kernel's expansion converges to the softened force") {
  double before = 1;
  for (const int p : {2, 4, 6, 8, 10, 12}) {
    const double error = Operators<AllTerms>::forceError(p, 6.0, 1.0);
    CHECK(error < 0.35 * before);
    before = error;
  }
  CHECK(before < 1e-7);
}

namespace {

/// The unrolled operators of one order against the loops, both on lanes.
template <int P>
void checkUnrolled() {
  using V = gravel::detail::NativeDoubles;
  using Batch = gravel::detail::FarBatch<double>;
  using X = Expansion<HarmonicTerms>;
  const auto points = randomMasses<double>(10, 94);
  const Vec centre = [&] {
    Vec sum = Vec::Zero();
    double mass = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      sum += points.masses[i] * points.positions[i];
      mass += points.masses[i];
    }
    return Vec(sum / mass);
  }();
  const auto scalar = Operators<HarmonicTerms>::moments(P, points, centre);
  std::vector<V> m;
  for (const double x : scalar) {
    m.push_back(V{} + x);
  }
  double r[3][Batch::width];
  for (std::size_t w = 0; w < Batch::width; ++w) {
    const double step = 0.1 * static_cast<double>(w);
    r[0][w] = 2 + step;
    r[1][w] = -1 - 2 * step;
    r[2][w] = 1.5 - step;
  }
  const V x = Batch::load(r[0]);
  const V y = Batch::load(r[1]);
  const V z = Batch::load(r[2]);
  double f[Batch::width];
  for (std::size_t w = 0; w < Batch::width; ++w) {
    f[w] = 1 / std::sqrt(r[0][w] * r[0][w] + r[1][w] * r[1][w] + r[2][w] * r[2][w]);
  }
  const V inverse = Batch::load(f);
  std::vector<V> slow(static_cast<std::size_t>(X::D::size(P)));
  std::vector<V> fast(slow.size());
  X::derivatives(P, x, y, z, V(-inverse * inverse), inverse, slow.data());
  gravel::detail::UnrolledExpansion<P>::derivatives(x, y, z, -inverse * inverse, inverse, fast.data());
  std::vector<V> slowLocal(m.size(), V{});
  std::vector<V> fastLocal(m.size(), V{});
  X::contract<false>(P, 0, P, m.data(), slow.data(), slowLocal.data());
  gravel::detail::UnrolledExpansion<P>::contract(0, m.data(), fast.data(), fastLocal.data());
  const auto agree = [](const std::vector<V>& a, const std::vector<V>& b) {
    double most = 0;
    double scale = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
      for (std::size_t w = 0; w < Batch::width; ++w) {
        most = std::max(most, std::abs(a[k][w] - b[k][w]));
        scale = std::max(scale, std::abs(a[k][w]));
      }
    }
    return most <= 1e-14 * scale && scale > 0;
  };
  CAPTURE(P);
  CHECK(agree(slow, fast));
  CHECK(agree(slowLocal, fastLocal));
}

template <std::size_t... I>
void checkAllUnrolled(std::index_sequence<I...>) {
  (checkUnrolled<static_cast<int>(I) + 1>(), ...);
}

}  // namespace

TEST_CASE("the unrolled operators do what the loops do, to rounding, at every order") {
  checkAllUnrolled(std::make_index_sequence<gravel::detail::unrolledOrder>());
}
