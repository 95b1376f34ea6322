#include "support/catch.hpp"
#include <gravel/gravity/pair_law.hpp>

using namespace gravel;
using namespace gravel::test;

// Two multiplications or divisions, one square root: at most 2 units in the last place.
TEMPLATE_TEST_CASE("the factors are s^(-3/2) and s^(-1/2) to two units in the last place", "", float, double,
                   long double) {
  using S = TestType;
  const S tolerance = 2 * std::numeric_limits<S>::epsilon();
  for (const double s : {1e-20, 3e-7, 0.5, 1.0, 2.0, 12.0}) {
    const auto exact = 1.0L / std::sqrt(static_cast<long double>(S(s)));
    const auto w = static_cast<long double>(PairLaw<S>::accelerationFactor(S(s)));
    const auto p = static_cast<long double>(PairLaw<S>::potentialFactor(S(s)));
    CHECK(std::abs(w / (exact * exact * exact) - 1) <= static_cast<long double>(tolerance));
    CHECK(std::abs(p / exact - 1) <= static_cast<long double>(tolerance));
  }
}

// A packed square root may be a reciprocal estimate with Newton steps (Eigen's EIGEN_FAST_MATH: float
// everywhere, double with AVX-512), which costs up to two bits.
TEMPLATE_TEST_CASE("lanes agree with the scalar law to four units in the last place", "", float, double) {
  using S = TestType;
  const S tolerance = 4 * std::numeric_limits<S>::epsilon();
  Lanes<S> s;
  for (int i = 0; i < laneWidth<S>; ++i) {
    s[i] = i == 3 ? S(0) : S(0.37) * S(i + 1);
  }
  const Lanes<S> w = PairLaw<S>::accelerationFactor(s);
  const Lanes<S> p = PairLaw<S>::potentialFactor(s);
  for (int i = 0; i < laneWidth<S>; ++i) {
    const S w_i = PairLaw<S>::accelerationFactor(S(s[i]));
    const S p_i = PairLaw<S>::potentialFactor(S(s[i]));
    CHECK(std::abs(w[i] - w_i) <= tolerance * w_i);
    CHECK(std::abs(p[i] - p_i) <= tolerance * p_i);
  }
}

TEMPLATE_TEST_CASE("below the threshold the force falls to zero with the distance and stays finite", "",
                   float, double, long double) {
  using S = TestType;
  using std::sqrt;
  const S tiny = PairLaw<S>::tiny();
  const S edge = sqrt(tiny);
  const auto force = [](S r) { return S(PairLaw<S>::accelerationFactor(S(r * r)) * r); };
  CHECK(force(S(0)) == S(0));
  CHECK(isFinite(PairLaw<S>::accelerationFactor(S(0))));
  CHECK(isFinite(force(edge)));
  const S tolerance = 8 * std::numeric_limits<S>::epsilon();
  CHECK(std::abs(force(edge / 2) / force(edge) - S(0.5)) <= tolerance);   // inside: linear
  CHECK(std::abs(force(edge * 2) / force(edge) - S(0.25)) <= tolerance);  // outside: Newton
  CHECK(PairLaw<S>::potentialFactor(S(0)) == S(0));
  CHECK(isFinite(PairLaw<S>::potentialFactor(tiny)));
}

TEST_CASE("the force is the slope of the potential") {
  const double softening_sq = 0.09;
  const auto potential = [&](double r) { return -PairLaw<double>::potentialFactor(r * r + softening_sq); };
  for (const double r : {0.1, 0.5, 2.0}) {
    const double h = 1e-5;  // the difference errs by h^2 of third derivatives, about 1e-10 of 100
    const double slope = (potential(r + h) - potential(r - h)) / (2 * h);
    const double force = PairLaw<double>::accelerationFactor(r * r + softening_sq) * r;
    CHECK(std::abs(slope - force) < 2e-8);
  }
}
