#pragma once

/// \file
/// Removes overlap by moving positions: no energy of motion is made.

#include <gravel/contact/contact_coloring.hpp>
#include <gravel/contact/contact_facts.hpp>
#include <gravel/contact/row_watch.hpp>
#include <gravel/contact/solver_rows.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>

#include <numeric>

namespace gravel {

template <Real Scalar>
struct CorrectionSettings {
  Scalar factor = Scalar(0.8);  ///< [1], 0 … 1: part of each overlap to remove
  Scalar slop = Scalar(0);      ///< [m] >= 0: overlap that stays
  /// [1] > 0: largest part of the smaller of the two radii by which one contact is opened in a call, so that
  /// deep overlaps come apart over several steps.
  Scalar cap = Scalar(0.5);
  Scalar tolerance =
      Scalar(1e-3);  ///< [1] > 0: sweeps end when the largest move is this times the largest overlap
  /// [1] >= 0: overlaps that are right to this times the smallest radius of a contact are right; nothing is
  /// moved while all are, and where some are not, those below a quarter of it stay unless others are pressed
  /// into them.
  Scalar precision = Scalar(1e-4);
  int maxIterations = 20;  ///< >= 1
  /// A pair that is moved apart keeps its angular momentum: it turns the slower. Off: velocities stay.
  bool keepAngularMomentum = true;
};

/// A body that was moved, and by how much [m].
template <Real Scalar>
struct Displacement {
  std::uint32_t body;
  Vector3<Scalar> shift;
};

template <Real Scalar>
struct CorrectionReport {
  int iterations = 0;
  Scalar largestOverlap = Scalar(0);  ///< [m] before
  Scalar residual = Scalar(0);        ///< [m] largest move of the last sweep
  Scalar loss = Scalar(0);            ///< [J] >= 0, of energy of motion
};

/// Nonlinear projected Gauss-Seidel over the colours of the contacts: in turn each contact that is still
/// closer than it should be is opened along its present normal, by inverse mass, so that the common centre of
/// mass of movable bodies stays to rounding. Distances are recomputed from the moved positions; only relative
/// displacements enter, so that a place far from the origin costs no digits. A contact is passed over while
/// its bodies have moved by less than half of what ends the sweeps since it was opened, or at all where its
/// overlap is hardly any: so one ball wedged into a heap costs what its surroundings cost.
///
/// Two free spheres that are moved apart from r to r + d would gain the angular momentum m* d x v of their
/// relative velocity v. As on an orbit, the part of v across r becomes v_t r/(r + d) instead: momentum and
/// angular momentum stay to rounding, and energy of motion can only fall. A rejected way: to give the
/// difference to the spins, which would turn smooth spheres.
template <Real S>
class PositionalCorrection {
 public:
  /// Moves the bodies so that each overlap is (1 - factor) of what it was, down to the slop, unless the cap
  /// holds it back.
  /// \param colouring of these contacts \param facts of them, overlaps as they are now
  template <ContactBodies B>
  CorrectionReport<S> apply(std::span<const Contact<S>> contacts, const ContactColoring& colouring, B& bodies,
                            const CorrectionSettings<S>& settings, const ContactFacts<S>& facts) {
    moved_.clear();
    CorrectionReport<S> report;
    report.largestOverlap = facts.overlap;
    const S right = contacts.empty() ? S(0) : S(settings.precision * facts.radius);
    if (!(facts.overlap > right)) {
      return report;
    }
    takeUp(colouring, bodies);
    const S enough = std::max<S>(settings.tolerance * facts.overlap, right);
    watch_.begin(shifts_.size(), contacts.size(), S(enough / S(2)));
    detail::resizeAnew(deep_, contacts.size());
    parallelFor(contacts.size(), chunk,
                [&](std::size_t c) { deep_[c] = -contacts[c].gap > right / S(4) ? 1 : 0; });
    parallelFor(contacts.size(), chunk,
                [&](std::size_t k) { watch_.enterFirst(k, deep_[colouring.rows()[k].contact] == 0); });
    do {
      // Lone contacts are right after one sweep.
      const auto one = [&](std::size_t k, Opened& sum) {
        const ContactColoring::Row& place = colouring.rows()[k];
        if (!watch_.isStale(k, place.slot1, place.slot2)) {
          return;
        }
        open(rowOf(contacts[place.contact], place, bodies, settings), place, settings.keepAngularMomentum,
             sum);
        watch_.enter(k, place.slot1, place.slot2);
      };
      const auto each = detail::eachRow(one);
      Opened opened = detail::sumOverParts(0, colouring.loneCount(), Opened{}, each);
      opened += detail::sumOverColourParts(colouring, Opened{}, each);
      report.residual = opened.largest;
      report.loss += opened.loss;
      ++report.iterations;
    } while (report.residual > enough && report.iterations < settings.maxIterations);
    move(colouring, bodies);
    return report;
  }

  /// Who was moved by the last call, in the order of contacts.
  const std::vector<Displacement<S>>& displacements() const { return moved_; }

 private:
  struct Shift {
    Vector3<S> d;
    S mass;  ///< 0 for immovable
    Vector3<S> v;
    Vector3<S> dv;  ///< that v was changed by
  };
  struct Row {
    Vector3<S> n;  ///< from the first centre to the second at detection
    S distance;    ///< of the centres then; < 0 to a boundary
    S reach;       ///< distance at which the overlap is what shall remain; to a boundary the way to there
    S share1;
    S share2;
  };
  static constexpr std::size_t chunk = 512;

  /// What a sweep did.
  struct Opened {
    S largest = S(0);
    S loss = S(0);
    Opened& operator+=(const Opened& other) {
      largest = std::max<S>(largest, other.largest);
      loss += other.loss;
      return *this;
    }
  };

  template <class B>
  void takeUp(const ContactColoring& colouring, const B& bodies) {
    const std::size_t n = colouring.bodies().size();
    shifts_.resize(n + 1);
    parallelFor(n + 1, chunk, [&](std::size_t slot) {
      const bool movable = colouring.movable(static_cast<std::uint32_t>(slot));
      const std::uint32_t i = movable ? colouring.bodies()[slot] : 0;
      shifts_[slot] = {Vector3<S>::Zero(), movable ? S(bodies.masses()[i]) : S(0),
                       movable ? Vector3<S>(bodies.velocities()[i]) : Vector3<S>(Vector3<S>::Zero()),
                       Vector3<S>::Zero()};
    });
  }

  /// Of each part of the slots first how many moved, and so where they stand in the list.
  template <class B>
  void move(const ContactColoring& colouring, B& bodies) {
    auto&& positions = bodies.positions();
    auto&& velocities = bodies.velocities();
    const std::size_t n = colouring.bodies().size();
    const auto hasMoved = [&](std::size_t slot) { return shifts_[slot].d != Vector3<S>::Zero(); };
    ends_.assign(n / chunk + 1, 0);
    parallelForChunks<Share::Alike>(n, chunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t slot = begin; slot < end; ++slot) {
        ends_[begin / chunk] += hasMoved(slot) ? 1U : 0U;
      }
    });
    std::partial_sum(ends_.begin(), ends_.end(), ends_.begin());
    detail::resizeAnew(moved_, ends_.back());
    parallelForChunks<Share::Alike>(n, chunk, [&](std::size_t begin, std::size_t end) {
      std::size_t place = begin == 0 ? 0 : ends_[begin / chunk - 1];
      for (std::size_t slot = begin; slot < end; ++slot) {
        if (hasMoved(slot)) {
          const std::uint32_t i = colouring.bodies()[slot];
          positions[i] += shifts_[slot].d;
          moved_[place++] = {i, shifts_[slot].d};
          if (shifts_[slot].dv != Vector3<S>::Zero()) {
            velocities[i] += shifts_[slot].dv;
          }
        }
      }
    });
  }

  /// Made where it is needed: most contacts are never opened, or once.
  template <class B>
  Row rowOf(const Contact<S>& c, const ContactColoring::Row& place, const B& bodies,
            const CorrectionSettings<S>& settings) const {
    const S overlap = -c.gap;
    const S kept =
        std::max<S>(overlap - settings.cap * detail::smallerRadius(c, bodies),
                    std::max<S>((S(1) - settings.factor) * overlap, std::min<S>(settings.slop, overlap)));
    const S m1 = shifts_[place.slot1].mass;
    const S m2 = shifts_[place.slot2].mass;
    const MassShares<S> shares = massShares<S>(m1, m1 > S(0), m2, m2 > S(0));
    const bool boundary = c.second == staticPartner;
    const S distance = boundary ? S(0) : c.arm1 + c.arm2;
    return {c.normal, boundary ? S(-1) : distance, S(distance - c.gap - kept), shares.first, shares.second};
  }

  [[gnu::flatten]] void open(const Row& row, const ContactColoring::Row& place, bool keepAngularMomentum,
                             Opened& sum) {
    Shift& b1 = shifts_[place.slot1];
    Shift& b2 = shifts_[place.slot2];
    const Vector3<S> d = b2.d - b1.d;
    Vector3<S> n = row.n;
    S missing(0);
    S distance(0);
    if (row.distance < S(0)) {
      missing = row.reach - n.dot(d);
    } else {
      const Vector3<S> r = row.distance * n + d;
      if (r.squaredNorm() > row.reach * row.reach) {
        return;  // far enough, unless squares underflow
      }
      distance = detail::safeNorm(r);
      missing = row.reach - distance;
      if (distance > Eigen::NumTraits<S>::epsilon() * row.reach) {
        n = detail::safeUnit(r, distance);
      }
    }
    if (!(missing > S(0))) {
      return;
    }
    Opened opened{missing, S(0)};
    if (keepAngularMomentum && row.share1 > S(0) && row.share2 > S(0)) {
      const Vector3<S> v_rel = (b2.v - b1.v) + (b2.dv - b1.dv);
      const Vector3<S> v_t = v_rel - n.dot(v_rel) * n;
      const S lost = missing / (distance + missing);  // v_t becomes (1 - lost) v_t
      b1.dv += (row.share1 * lost) * v_t;
      b2.dv -= (row.share2 * lost) * v_t;
      opened.loss = row.share1 * b1.mass * v_t.squaredNorm() * lost * (S(2) - lost) / S(2);
    }
    if (row.share1 > S(0)) {  // immovable bodies are shared between threads: never written
      b1.d -= (row.share1 * missing) * n;
      watch_.move(place.slot1, row.share1 * missing);
    }
    if (row.share2 > S(0)) {
      b2.d += (row.share2 * missing) * n;
      watch_.move(place.slot2, row.share2 * missing);
    }
    sum += opened;
  }

  std::vector<Shift> shifts_;
  detail::RowWatch<S> watch_;
  std::vector<std::uint8_t> deep_;  ///< by contact: more than hardly any overlap
  std::vector<std::size_t> ends_;   ///< by part of the slots, in the list of those moved
  std::vector<Displacement<S>> moved_;
};

}  // namespace gravel
