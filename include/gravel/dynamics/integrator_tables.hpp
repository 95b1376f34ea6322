#pragma once

/// \file
/// Which integrators there are, what each of them is, and the numbers of those that are a row of kicks and
/// drifts.
///
/// A row of s stages: stage k kicks by b_k h, drifts by a_k h and evaluates forces; at the end comes the kick
/// b_s h. With the a and b from both ends equal the method is time-reversible. The first kick uses the forces
/// of the step before, so a step costs s force evaluations and ends with x, v and a at the same time.
///
/// Compositions are written as weights w_1 … w_s of velocity Verlet: a_k = w_k, and the half kicks of
/// neighbours are one: b_k = (w_k + w_{k+1})/2.

#include <gravel/core/check.hpp>

#include <array>
#include <span>

namespace gravel {

/// The time integrator. See docs/theory-integration.md for which to take.
enum class IntegratorKind : std::uint8_t {
  VelocityVerlet,  ///< order 2, 1 force evaluation a step (Verlet 1967; Swope et al. 1982)
  Yoshida4,        ///< order 4, 3 evaluations (Forest & Ruth 1990; Yoshida 1990, Phys. Lett. A 150, 262)
  Yoshida6,        ///< order 6, 7 evaluations (Yoshida 1990, solution A)
  Yoshida8,        ///< order 8, 15 evaluations (Yoshida 1990, solution D)
  BlanesMoan4,     ///< order 4, 6 evaluations (Blanes & Moan 2002, J. Comput. Appl. Math. 142, 313, RKN_6^b)
  BlanesMoan6,     ///< order 6, 11 evaluations (Blanes & Moan 2002, RKN_11^b)
  KahanLi6,        ///< order 6, 9 evaluations (Kahan & Li 1997, Math. Comput. 66, 1089, s9odr6a)
  KahanLi8,        ///< order 8, 17 evaluations (Kahan & Li 1997, s17odr8a)
  ForceGradient4,  ///< order 4, 3 evaluations (Chin 1997, Phys. Lett. A 226, 344, scheme A)
  /// order 2, 1 evaluation, in the frame of a shear-periodic domain (dynamics/epicycle.hpp); in others
  /// velocity Verlet
  SymplecticEpicycle,
  /// order 15, steps of its own choice, to rounding (dynamics/gauss_radau.hpp); bodies must be points
  GaussRadau15,
  /// order 2 in Jacobi's coordinates, 1 evaluation; planets about a heavy centre, points
  /// (dynamics/wisdom_holman.hpp)
  WisdomHolman,
  /// order 4, a step of its own choice for each body (dynamics/hermite.hpp); bodies must be points
  Hermite4,
};

/// One kick, one drift and the force evaluation after it.
struct IntegratorStage {
  long double kick;
  long double drift;
  /// Not zero: the kick uses the forces not at x but at x + gradient h^2 a(x), for one evaluation more.
  long double gradient = 0;
};

/// What a method is; tests measure each figure.
struct IntegratorTraits {
  const char* name;
  int order;
  int forceEvaluations;                     ///< per step; 0: as many as the method finds that it needs
  bool symplectic;                          ///< for a fixed step: energy errors are bounded
  bool reversible;                          ///< for a fixed step: -v and as many steps lead back, to rounding
  bool contacts;                            ///< bodies may touch
  std::span<const IntegratorStage> stages;  ///< none: no row of kicks and drifts
  long double lastKick;
};

namespace detail {

/// A number of a table in the scalar's own precision.
template <Real Scalar>
Scalar fromTable(long double x) {
  if constexpr (std::is_floating_point_v<Scalar>) {
    return static_cast<Scalar>(x);
  } else {
    const auto high = static_cast<double>(x);
    return Scalar(high) + Scalar(static_cast<double>(x - static_cast<long double>(high)));
  }
}

/// Stages of the palindrome w_1 … w_n … w_1 of velocity Verlet steps, of which the first half and the middle
/// are given.
template <std::size_t n>
constexpr std::array<IntegratorStage, 2 * n - 1> composition(const std::array<long double, n>& half) {
  std::array<IntegratorStage, 2 * n - 1> stages{};
  long double before = 0;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    const long double w = half[k < n ? k : 2 * n - 2 - k];
    stages[k] = {(before + w) / 2, w};
    before = w;
  }
  return stages;
}

/// Stages of a method whose kicks b_1 b_2 … and drifts a_1 a_2 … are given up to the middle, where for an
/// even number of stages a kick stands, for an odd one a drift.
template <std::size_t s, std::size_t drifts, std::size_t kicks>
constexpr std::array<IntegratorStage, s> palindrome(const std::array<long double, kicks>& b,
                                                    const std::array<long double, drifts>& a) {
  static_assert(drifts == (s + 1) / 2 && kicks == s / 2 + 1);
  std::array<IntegratorStage, s> stages{};
  for (std::size_t k = 0; k < s; ++k) {
    stages[k] = {b[k < kicks ? k : s - k], a[k < drifts ? k : s - 1 - k]};
  }
  return stages;
}

inline constexpr auto verletStages = composition<1>({1.0L});

// w = 1/(2 - 2^(1/3)), 1 - 2w
inline constexpr auto yoshida4Stages =
    composition<2>({1.351207191959657634047687808971460827L, -1.702414383919315268095375617942921653L});

// Hairer, Lubich & Wanner, Geometric Numerical Integration, 2nd ed., eq. V.3.11
inline constexpr auto yoshida6Stages =
    composition<4>({0.78451361047755726381949763L, 0.23557321335935813368479318L,
                    -1.17767998417887100694641568L, 1.31518632068391121888424973L});

// The three below: published to 15 or 20 digits, continued by Newton's method on the order conditions.
inline constexpr auto yoshida8Stages =
    composition<8>({0.91484424622979156674879348984751L, 0.25369333656621135414614602068994L,
                    -1.4448522368606051576947306575374L, -0.15824063536805017520406677675975L,
                    1.9381391376225259865791864874436L, -1.9606102329753108076076333763997L,
                    0.10279984939179644069811513160123L, 1.708453070787281584668379362229L});

inline constexpr auto kahanLi6Stages =
    composition<5>({0.39216144400731413927925055518118L, 0.33259913678935943859974864032027L,
                    -0.70624617255763935980996481947476L, 0.082213596293550800231490447448828L,
                    0.79854399093482996339895035304896L});

inline constexpr auto kahanLi8Stages =
    composition<9>({0.13020248308889008087881763226255L, 0.56116298177510838456196440770159L,
                    -0.38947496264484728640807859864594L, 0.15884190655515560089621074563038L,
                    -0.39590389413323757733623153902219L, 0.18453964097831570709183254138857L,
                    0.25837438768632204729397910986043L, 0.29501172360931029887096624049197L,
                    -0.60550853383003451169892107933472L});

// Table 3 of the paper, 15 digits; the middle ones make the sums 1.
inline constexpr auto blanesMoan4Stages = [] {
  constexpr long double b1 = 0.0829844064174052L, b2 = 0.396309801498368L, b3 = -0.0390563049223486L;
  constexpr long double a1 = 0.245298957184271L, a2 = 0.604872665711080L;
  return palindrome<6>(std::array{b1, b2, b3, 1 - 2 * (b1 + b2 + b3)}, std::array{a1, a2, 0.5L - (a1 + a2)});
}();

inline constexpr auto blanesMoan6Stages = [] {
  constexpr long double b1 = 0.0414649985182624L, b2 = 0.198128671918067L, b3 = -0.0400061921041533L,
                        b4 = 0.0752539843015807L, b5 = -0.0115113874206879L;
  constexpr long double a1 = 0.123229775946271L, a2 = 0.290553797799558L, a3 = -0.127049212625417L,
                        a4 = -0.246331761062075L, a5 = 0.357208872795928L;
  return palindrome<11>(std::array{b1, b2, b3, b4, b5, 0.5L - (b1 + b2 + b3 + b4 + b5)},
                        std::array{a1, a2, a3, a4, a5, 1 - 2 * (a1 + a2 + a3 + a4 + a5)});
}();

// The kick in the middle is that of the potential V + (h^2/48)[V,[T,V]], whose acceleration
// a + (h^2/24) (a.grad) a is found as a(x + h^2 a/24) up to h^4 (Wisdom, Holman & Touma 1996; Omelyan 2006,
// Phys. Rev. E 74, 036703). That rest is no gradient of anything: reversible, symplectic up to h^5 only.
inline constexpr std::array<IntegratorStage, 2> forceGradient4Stages{
    {{1.0L / 6, 0.5L}, {2.0L / 3, 0.5L, 1.0L / 24}}};

}  // namespace detail

inline constexpr IntegratorTraits traitsOf(IntegratorKind kind) {
  const auto row = [](const char* name, int order, const auto& stages, bool symplectic = true) {
    int evaluations = 0;
    for (const IntegratorStage& stage : stages) {
      evaluations += stage.gradient != 0 ? 2 : 1;
    }
    return IntegratorTraits{name, order, evaluations, symplectic, true, true, stages, stages[0].kick};
  };
  switch (kind) {
    case IntegratorKind::Yoshida4:
      return row("Yoshida4", 4, detail::yoshida4Stages);
    case IntegratorKind::Yoshida6:
      return row("Yoshida6", 6, detail::yoshida6Stages);
    case IntegratorKind::Yoshida8:
      return row("Yoshida8", 8, detail::yoshida8Stages);
    case IntegratorKind::BlanesMoan4:
      return row("BlanesMoan4", 4, detail::blanesMoan4Stages);
    case IntegratorKind::BlanesMoan6:
      return row("BlanesMoan6", 6, detail::blanesMoan6Stages);
    case IntegratorKind::KahanLi6:
      return row("KahanLi6", 6, detail::kahanLi6Stages);
    case IntegratorKind::KahanLi8:
      return row("KahanLi8", 8, detail::kahanLi8Stages);
    case IntegratorKind::ForceGradient4:
      return row("ForceGradient4", 4, detail::forceGradient4Stages, false);
    case IntegratorKind::GaussRadau15:
      return {"GaussRadau15", 15, 0, false, false, false, {}, 0};
    case IntegratorKind::WisdomHolman:
      return {"WisdomHolman", 2, 1, true, true, false, {}, 0};
    case IntegratorKind::Hermite4:
      return {"Hermite4", 4, 0, false, false, false, {}, 0};
    case IntegratorKind::SymplecticEpicycle:
      return row("SymplecticEpicycle", 2, detail::verletStages);
    case IntegratorKind::VelocityVerlet:
      return row("VelocityVerlet", 2, detail::verletStages);
  }
  detail::refuse("integrator", "number " + std::to_string(static_cast<int>(kind)), "one of IntegratorKind");
}

}  // namespace gravel
