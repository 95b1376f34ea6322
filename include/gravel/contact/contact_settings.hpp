#pragma once

/// \file
/// What one asks of a contact solver, and what it answers.

#include <gravel/core/check.hpp>
#include <gravel/core/sizes.hpp>
#include <gravel/core/types.hpp>

#include <algorithm>
#include <limits>
#include <span>
#include <string>

namespace gravel {

/// How contacts are solved. A `Space` takes its own: a tolerance of 1e-3 and limitSweeps().
template <Real Scalar>
struct ContactSettings {
  /// [m s^-1] >= 0: restitution acts on an approach faster than this plus what a resting contact picks up in
  /// a step, 2 |a_rel.n| dt; a slower one stops. The same holds for tangential restitution.
  Scalar restitutionThreshold = Scalar(0);
  /// [1] > 0: sweeps end when the largest change of a velocity in a sweep is at most this times the largest
  /// speed of approach among the contacts of a small island, or of all large ones. The error of the impulses
  /// is this times the number of sweeps that a disturbance takes through the pile.
  Scalar tolerance = Scalar(1e-6);
  /// [s] >= 0: if it is longer than the step, gaps that may rest are those of a step of this length. What a
  /// long step left would else be open in a short one, and lose its force.
  Scalar gapStep = Scalar(0);
  int maxIterations = 100;  ///< >= 1: sweeps at most
  /// [1] >= 0: if it is > 0, small islands (SolverIslands) take it in place of `tolerance`, and limitSweeps()
  /// of their own, as what remembers no impulse if it does not or if nothing does.
  Scalar islandTolerance = Scalar(0);
  bool remembers = true;   ///< any contact does
  bool warmStart = true;   ///< begin from the impulses of the last step
  bool accelerate = true;  ///< momentum between sweeps; off: plain Gauss-Seidel
};

/// Looks at the contacts of an island, or of all large ones, that are cheap in any step.
inline constexpr std::size_t usualLooks = 4000;

/// As many sweeps over these contacts as make so many looks, from 20 to 1000: where contacts are few (below
/// 200 of them, unless more looks are asked for) sweeps are cheap, and pass on what 20 would not.
inline int sweepsOfLooks(std::size_t contacts, std::size_t looks = usualLooks) {
  return static_cast<int>(std::clamp<std::size_t>(looks / std::max<std::size_t>(contacts, 1), 20, 1000));
}

/// How far a solve goes, where nobody says how many sweeps it may take (`most` is 0) by sweepsOfLooks(). If
/// no impulse is remembered, as in a structure that was just put up, by a million looks, and to a hundredth
/// of the tolerance: what slips while forces are being found may never come to rest again. What it costs
/// stands in docs/theory-contact.md.
/// \param remembers  any of these contacts
template <Real S>
void limitSweeps(ContactSettings<S>& settings, std::size_t most, std::size_t contacts, bool remembers) {
  settings.islandTolerance = most == 0 ? settings.tolerance : S(0);
  settings.remembers = remembers;
  if (most == 0 && !remembers) {
    const S least = std::min<S>(settings.tolerance, detail::roundoff<S>());
    settings.tolerance = std::max<S>(S(0.01) * settings.tolerance, least);
  }
  const std::size_t looks = remembers ? usualLooks : 1'000'000;
  settings.maxIterations =
      most > 0 ? static_cast<int>(std::min<std::size_t>(most, std::numeric_limits<int>::max()))
               : sweepsOfLooks(contacts, looks);
}

/// Where bodies come from, and go after a solve. Contacts are right at the end of the way that follows, as
/// pairs turn on it and frames bend it (contact/turning_pair.hpp); where none follows, now.
template <Real Scalar>
struct WayAhead {
  bool follows = false;  ///< for the dt of the solve
  /// [m s^-2] by body, of the frame in which bodies move, besides their accelerations; empty where ways are
  /// straight.
  std::span<const Vector3<Scalar>> bend;
  /// [s^-1] The frame turns the part of each spin across z by -frame dt.
  Scalar frame = Scalar(0);
  /// [s] For which accelerations acted on the velocities since bodies slid as before; where it is 0, nothing
  /// is known of that, and friction is held against the slip that it leaves.
  Scalar kick = Scalar(0);
  /// [m s^-2] by body, of planes that go on speeding up into what leans on them; empty where none do. As seen
  /// from such a plane bodies fall by as much more.
  std::span<const Scalar> carried{};
};

/// What a solve did.
template <Real Scalar>
struct ContactReport {
  std::size_t contacts = 0;     ///< of the last solve
  std::size_t colours = 0;      ///< the same
  std::size_t impacts = 0;      ///< blows that were dealt at their own time inside the step
  std::size_t postponed = 0;    ///< bodies with so many blows in the step that the rest was solved at its end
  int iterations = 0;           ///< sweeps of the island that took most, summed over solves
  std::size_t looks = 0;        ///< contacts that were looked at, over all sweeps and solves
  Scalar residual = Scalar(0);  ///< [1] largest change of a velocity in the last sweep / largest approach
  Scalar restitutionLoss = Scalar(0);  ///< [J] energy taken by normal impulses
  Scalar frictionLoss = Scalar(0);     ///< [J] energy taken by tangential impulses
  Scalar driftWork = Scalar(0);  ///< [J] energy put in by moving boundaries and by the shear of the domain

  /// Another solve of the same step.
  void addSolve(const ContactReport& solve) {
    contacts = solve.contacts;
    colours = solve.colours;
    iterations += solve.iterations;
    looks += solve.looks;
    residual = std::max<Scalar>(residual, solve.residual);
    restitutionLoss += solve.restitutionLoss;
    frictionLoss += solve.frictionLoss;
    driftWork += solve.driftWork;
  }
};

/// Impulse of a contact on its second body [N s]; on the first its opposite.
template <Real Scalar>
struct ContactImpulse {
  Scalar normal = Scalar(0);  ///< >= 0, along Contact::normal
  Vector3<Scalar> tangential = Vector3<Scalar>::Zero();
  /// Angular impulse against rolling and spinning over the effective radius r1 r2/(r1 + r2).
  Vector3<Scalar> turning = Vector3<Scalar>::Zero();
  bool impact = false;  ///< came in faster than the threshold, so that restitution acted

  friend bool operator==(const ContactImpulse&, const ContactImpulse&) = default;
};

/// \throws std::invalid_argument naming the setting, its value and what is allowed
template <Real S>
void validate(const ContactSettings<S>& settings) {
  detail::require("restitutionThreshold", settings.restitutionThreshold, detail::nonNegative<S>());
  detail::require("gapStep", settings.gapStep, detail::nonNegative<S>());
  detail::require("contact islandTolerance", settings.islandTolerance, detail::nonNegative<S>());
  auto tolerance = detail::positive<S>();
  tolerance.high = S(1);
  tolerance.text = "> 0, <= 1";
  detail::require("contact tolerance", settings.tolerance, tolerance);
  if (settings.maxIterations < 1) {
    detail::refuse("contact maxIterations", std::to_string(settings.maxIterations), ">= 1");
  }
}

}  // namespace gravel
