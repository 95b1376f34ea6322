#pragma once

/// \file
/// The table of diagnostics, and the measures that the summary speaks of.

#include "scene.hpp"

#include <filesystem>
#include <fstream>

namespace gravel::runner {

/// What the ledger and the contacts said over the whole run.
struct History {
  EnergyLedger<double> first, last;
  double inPlay = 0.0;  ///< most energy in play of all rows: the scale of the drift
  double worstDrift = 0.0;
  double peakMotion = 0.0;       ///< most kinetic + rotational energy of all steps, not of the rows alone
  bool isFinite = true;          ///< the energies were, in every step, and the places in every row
  bool closes = true;            ///< the ledger: that of a patch lacks what its shear does by gravity
  std::size_t mostContacts = 0;  ///< of all steps, too
  std::size_t rows = 0;
  std::size_t steps = 0;  ///< that were counted
  std::size_t parts = 0;  ///< of these, each with its own contacts
  std::size_t mostParts = 0;
  double begin = 0.0, end = 0.0;  ///< times of the first and of the last row
  double restsSince = 0.0;        ///< when motion was last more than the share at rest, of all steps

  /// Share of the most motion seen that is left at rest, at most.
  static constexpr double restShare = 1e-4;
  /// Little motion is rest where it has been so for a tenth of the time and losses, not a potential, took
  /// what there was: a ball at the top of its way and a comet far out move little, too.
  bool isAtRest() const {
    return end - restsSince >= 0.1 * (end - begin) && taken().dissipated() >= 0.5 * peakMotion;
  }

  /// What was taken since the first row, term by term. The ledger counts from the start of the scene: that of
  /// a run that is taken up holds what the earlier part lost.
  EnergyLedger<double> taken() const {
    EnergyLedger<double> e;
    e.restitution = last.restitution - first.restitution;
    e.friction = last.friction - first.friction;
    e.damping = last.damping - first.damping;
    e.correction = last.correction - first.correction;
    return e;
  }
  /// How far the ledger's total is from its start, over the energy in play; infinite where there was none.
  double drift() const {
    const double moved = last.total() - first.total();
    return moved == 0.0 ? 0.0 : moved / inPlay;
  }
  /// Drift that no use of the results can bear: a share of the energy in play.
  static constexpr double mostDrift = 0.05;
  bool isToBeTrusted() const { return isFinite && (!closes || worstDrift <= mostDrift); }
};

/// Writes a row of diagnostics.csv a call, and keeps the history.
class Diagnostics {
 public:
  /// \throws std::runtime_error if the file cannot be written
  explicit Diagnostics(const std::filesystem::path& path);
  void record(const Space<double>& space);
  /// A step is over.
  void count(const Space<double>& space);
  const History& history() const { return history_; }

 private:
  void see(double motion);

  std::filesystem::path path_;
  std::ofstream file_;
  History history_;
};

/// Bodies that touch one another, directly or through others.
struct Cluster {
  std::size_t bodies = 0;
  double mass = 0.0;
  /// Of the homogeneous ellipsoid of equal moments, longest first.
  Vector3<double> axes = Vector3<double>::Zero();
  double filling = 0.0;         ///< volume of its bodies over that of the ellipsoid
  double angularSpeed = 0.0;    ///< of the rigid body with its angular momentum
  double internalMotion = 0.0;  ///< kinetic energy of its bodies against that rigid body
};

/// The heaviest cluster of the last step's contacts, in one piece where it lies across a face of the domain.
Cluster largestCluster(const Space<double>& space);

/// Share of the mass that cannot leave: bodies whose kinetic energy in the frame of the centre of mass is
/// less than their depth in the potential of all others. Of an open domain. O(N^2).
double boundFraction(const Space<double>& space);

/// Deepest overlap of two bodies over the smaller radius that is not 0, at the last step's contacts.
double deepestOverlap(const Space<double>& space);

/// Bodies that begin inside each other or in a wall: they are pushed out, which is seldom what was meant.
struct Overlaps {
  std::size_t bodies = 0;  ///< that move, and are deeper than a tenth of a radius in others or in walls
  double deepest = 0.0;    ///< over the smaller radius that is not 0
};
Overlaps overlapsAtStart(const Space<double>& space);

/// The two-body orbit of body i about body `centre` through its present place and velocity. What is fixed is
/// not pulled in turn, and its mass counts alone.
struct Orbit {
  double semiMajorAxis, eccentricity, period;  ///< NaN where there is none: the body flies past
};
Orbit orbitAbout(const Space<double>& space, std::size_t i, std::size_t centre);

/// The body that holds body i, `heaviest` being the heaviest of all: of the heavier ones in whose Hill sphere
/// it is the one to which it is bound most tightly, else `heaviest`. Nothing where no conic of two bodies
/// describes it: that body has no mass or is where i is, others of more than a hundredth of its mass are
/// nearer to it than i, or gravity is softened at that distance.
std::optional<std::size_t> centreOf(const Space<double>& space, std::size_t i, std::size_t heaviest);

}  // namespace gravel::runner
