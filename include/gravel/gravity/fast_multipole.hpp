#pragma once

/// \file
/// Gravity by the fast multipole method, to a promised error.

#include <gravel/gravity/field_strength.hpp>
#include <gravel/gravity/gravity_units.hpp>
#include <gravel/gravity/multipole_accuracy.hpp>
#include <gravel/gravity/multipole_walk.hpp>

namespace gravel {

/// The mutual fast multipole method on an octree (Greengard & Rokhlin 1987, J. Comput. Phys. 73, 325; Dehnen
/// 2002, J. Comput. Phys. 179, 27). Takes what DirectSum takes and gives the same numbers within a tolerance.
///
/// Error: the rms of |a - a_exact| / |a_exact| over the bodies stays below the tolerance, but for rounding
/// (1e-14 in double, 1e-6 in float), and the 99.99th percentile below ten times that; of accelerations below
/// a hundredth (rms) or a tenth (percentile) of the mean, relative to those. Pairs of cells are taken as far
/// when the error expected of them is a set share of the acceleration of the sink, which a rough first pass
/// over the cells finds. The potential energy errs by less than the tolerance, relative. Both directions of a
/// pair of cells are of the same terms, so that the total force vanishes to rounding.
///
/// Cost: O(N) but for the sort; memory about 300 bytes a body at the default tolerance. The
/// result is a function of the input alone: not of earlier calls, nor of the number of threads. One object
/// serves one caller at a time; up to 2^32 - 65 bodies.
///
/// In a domain that is not open the images of all bodies pull too; see setDomain.
template <Real S>
class FastMultipole {
 public:
  /// \param tolerance in (0, 1]. \throws std::invalid_argument otherwise
  void setTolerance(const S& tolerance) {
    if (!(tolerance > S(0)) || !(tolerance <= S(1))) {
      detail::refuse("gravity tolerance", detail::formatReal(tolerance), "above 0, at most 1");
    }
    tolerance_ = tolerance;
  }
  const S& tolerance() const { return tolerance_; }

  /// As DirectSum::setDomain. Images count within the tolerance.
  void setDomain(const Domain<S>& domain, const S& time = S(0)) { images_.setDomain(domain, time); }

  /// Whether that many bodies are expected to cost less than by the direct sum, and the tolerance can be
  /// kept.
  static bool isWorthwhile(std::size_t bodies, const S& tolerance) {
    if (std::is_same_v<S, float> && tolerance < S(3e-6)) {
      return false;
    }
    return bodies >= detail::multipoleCrossover(tolerance);
  }

  /// As DirectSum::accelerations.
  template <class Positions, class Masses, class Accelerations>
  void accelerations(const Positions& positions, const Masses& masses, const S& G, const S& softening,
                     Accelerations&& out) {
    detail::requireRoom(out, positions.size());
    evaluate(positions, masses, G, softening, false);
    const auto factor = units_.acceleration(G);
    parallelFor(tree_.size(), 4096, [&](std::size_t row) {
      out[tree_.body[row]] =
          Vector3<S>(factor(fields_.ax[row]), factor(fields_.ay[row]), factor(fields_.az[row]));
    });
  }

  /// As accelerations(), with the same bits, but out[i] is found for these numbers i only, and the others
  /// are left as they are. The tree and its moments cost what they cost for all.
  /// \throws std::invalid_argument as accelerations(), and for a number that no body has
  template <class Numbers, class Positions, class Masses, class Accelerations>
  void accelerationsOf(const Numbers& numbers, const Positions& positions, const Masses& masses, const S& G,
                       const S& softening, Accelerations&& out) {
    detail::requireRoom(out, positions.size());
    detail::requireBodies(numbers, positions.size());
    wanted_.assign(positions.size(), 0);
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      wanted_[static_cast<std::size_t>(numbers[k])] = 1;
    }
    evaluate(positions, masses, G, softening, false, true);
    const auto factor = units_.acceleration(G);
    for (std::size_t row = 0; row < tree_.size(); ++row) {
      if (wanted_[tree_.body[row]] != 0) {
        out[tree_.body[row]] =
            Vector3<S>(factor(fields_.ax[row]), factor(fields_.ay[row]), factor(fields_.az[row]));
      }
    }
  }

  /// As DirectSum::potentialEnergy.
  template <class Positions, class Masses>
  S potentialEnergy(const Positions& positions, const Masses& masses, const S& G, const S& softening) {
    evaluate(positions, masses, G, softening, true);
    const S sum = orderedSum(tree_.size(), 1024, S(0), [&](std::size_t begin, std::size_t end) {
      S part(0);
      for (std::size_t i = begin; i < end; ++i) {
        part += tree_.m[i] * fields_.potential[i];
      }
      return part;
    });
    return -units_.energy(G)(S(sum / S(2)));
  }

  /// Work of the last call.
  const detail::WalkCount& count() const { return count_; }

 private:
  /// Expansions of float bodies are in double: their coefficients are out of float's range.
  using F = detail::AtLeastDouble<S>;

  static constexpr std::uint32_t leafSize = 64;
  static constexpr std::size_t mostBodies =
      std::numeric_limits<std::uint32_t>::max() - 64;  // rows are counted in packets

  template <class Positions, class Masses>
  void evaluate(const Positions& positions, const Masses& masses, const S& G, const S& softening,
                bool withPotential, bool onlyWanted = false) {
    if (positions.size() > mostBodies) {
      detail::refuse("number of bodies of a fast multipole sum", std::to_string(positions.size()),
                     "at most 2^32 - 65");
    }
    units_ = detail::GravityUnits<S>(positions, masses, G, softening, images_.box());
    images_.prepare(units_.perLength(), units_.low(), units_.high(), tolerance_);
    gather(positions, masses);
    fields_.clear(tree_.size(), withPotential);
    count_ = {};
    if (units_.sources() == 0) {
      return;
    }
    tree_.build(leafSize);
    tree_.packSources();
    tree_.setSinks(onlyWanted ? wanted_ : std::vector<std::uint8_t>());
    const S eps = softening * units_.perLength();
    if (eps > S(0)) {
      walk(softMoments_, S(eps * eps));
    } else {
      walk(moments_, S(0));
    }
  }

  template <class Terms>
  void walk(detail::TreeMoments<S, F, Terms>& moments, const S& softening_sq) {
    const detail::MultipolePlan& plan = detail::planMultipoles(tolerance_);
    const detail::WalkLimits limits{plan.order, plan.pairsDirect, 8 * plan.pairsDirect};
    moments.compute(tree_, limits.order);
    if (!images_.isOpen()) {
      farImages_.gather(images_, tree_.x.data(), tree_.y.data(), tree_.z.data(), tree_.m.data(),
                        tree_.size());
    }
    // Accelerations in a periodic system are what is left of forces that cancel.
    const F safety = F(plan.safety) * F(images_.isOpen() ? 1.0 : 1.7);
    const F share = F(F(tolerance_) / safety);
    strength_.compute(tree_, share, plan.order, F(softening_sq), images_, farImages_);
    // Four shares, as errors of the potential have either sign: one costs up to a quarter more, for nothing.
    const F deviation = fields_.potential.empty()
                            ? F(0)
                            : F(F(4) * share * detail::leastMeanPotential(tree_, F(softening_sq)));
    using Walk = detail::MultipoleWalk<S, F, Terms>;
    Walk first(tree_, moments, images_.shifts(), limits, softening_sq, deviation, fields_);
    const std::size_t part = std::max<std::size_t>(256, tree_.size() / 64);
    const auto starts = first.prepare(static_cast<std::uint32_t>(part));
    std::vector<detail::WalkCount> counts(starts.size());
    parallelForTasks(starts.size(), [&](std::size_t i) {
      Walk walk(tree_, moments, images_.shifts(), limits, softening_sq, deviation, fields_);
      walk.run(starts[i]);
      counts[i] = walk.count();
    });
    count_ = first.count();
    for (const detail::WalkCount& done : counts) {
      count_ += done;
    }
    if (!images_.isOpen()) {
      farImages_.addTo(images_, tree_.size(), tree_.x.data(), tree_.y.data(), tree_.z.data(),
                       fields_.ax.data(), fields_.ay.data(), fields_.az.data(),
                       fields_.potential.empty() ? nullptr : fields_.potential.data());
    }
  }

  template <class Positions, class Masses>
  void gather(const Positions& positions, const Masses& masses) {
    const std::size_t n = positions.size();
    tree_.resize(n);
    // Far from the origin centres of mass, and with them what dipoles are left, would be right to the last
    // bits of its distance.
    const Vector3<S> offset = images_.isOpen() ? units_.offset() : Vector3<S>(Vector3<S>::Zero());
    parallelFor(n, 4096, [&](std::size_t row) {
      const std::uint32_t i = tree_.body[row];
      const Vector3<S> x = Vector3<S>(images_.home(positions[i]) - offset) * units_.perLength();
      tree_.x[row] = x[0];
      tree_.y[row] = x[1];
      tree_.z[row] = x[2];
      tree_.m[row] = masses[i] * units_.perMass();
    });
  }

  S tolerance_ = S(1e-5);
  detail::GravityUnits<S> units_;
  detail::PeriodicImages<S, F> images_;
  detail::ImageField<S, F> farImages_;
  detail::BodyTree<S, F> tree_;
  detail::TreeMoments<S, F, detail::HarmonicTerms> moments_;
  detail::TreeMoments<S, F, detail::AllTerms> softMoments_;
  detail::FieldStrength<S, F> strength_;
  detail::SinkFields<S> fields_;
  detail::WalkCount count_;
  std::vector<std::uint8_t> wanted_;  ///< by body
};

}  // namespace gravel
