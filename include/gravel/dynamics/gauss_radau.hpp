#pragma once

/// \file
/// Gauss-Radau integration of order 15 with its own choice of step: gravity to machine precision.

#include <gravel/core/check.hpp>
#include <gravel/core/sizes.hpp>
#include <gravel/dynamics/gauss_radau_state.hpp>
#include <gravel/dynamics/gauss_radau_weights.hpp>
#include <gravel/dynamics/integrator.hpp>

#include <algorithm>
#include <stdexcept>

namespace gravel {

/// The method of Everhart (1985) as made precise by Rein & Spiegel (2015, MNRAS 446, 1424, "IAS15"), with the
/// step of Pham, Rein & Spiegel (2024, Open J. Astrophys. 7), for accelerations that depend on positions, and
/// on velocities if asked.
///
/// A step of length dt is collocation at seven nodes: positions there follow from the accelerations there,
/// which is solved by iteration from a prediction, the last step's polynomial carried on. The step is
///   dt = eta min over bodies of sqrt(2 |a|^2 / (|a'|^2 + |a| |a''|))
/// with jerk a' and snap a'' of the polynomial's end. Where a body passes through a point of zero
/// acceleration that is zero; there the next ratio of derivatives counts, (|a'|^2 + |a| |a''|) / (|a''|^2 +
/// |a'| |a'''|) (Aarseth 1985), the larger of the two everywhere. eta = (5040 1e-9)^(1/7), where the
/// truncation is below rounding; a step that comes out four times too long is taken again. Sums are
/// compensated; energy errors then grow as the square root of the number of steps.
///
/// Where pulls cancel, as on a star amid evenly spread planets, a is their rounding: its changes do not
/// shrink with dt, so that its derivatives seem to grow without end. A body has no say where a changes within
/// dt by no more than the larger of
///   16 eps max |a| over bodies,  of sums of pulls as large as the largest acceleration;
///   eps |x| / dt^2,              of pulls from rounded places: the change moves the body by less than that.
/// What moves faster than the rest and is overlooked has an orbit of some 100 eps of the larger of |x| and
/// the path of the body of largest a. A fixed body's place counts as |x| of all: it pulls without an a of its
/// own.
///
/// Here the polynomial is held by its values at the nodes, not by its coefficients: a prediction costs seven
/// multiplications a coordinate, and no coefficient accumulates rounding.
///
/// Cost: 7 force evaluations an iteration, two to three of them a step, and one more at the end; 36 steps a
/// circular orbit. Not symplectic and not reversible, but right to rounding: 3e-15 of the energy after 1e4
/// orbits. Memory 37 vectors a body. Bits do not depend on the number of threads if those of the forces do
/// not; the method's own work is done by one thread.
template <Real Scalar>
class GaussRadau15 {
 public:
  /// Advances by h [s], in as many steps as the accuracy needs; the last one ends at h. Accelerations must be
  /// those of the present positions, and are at the end.
  /// \param forces  called with the time that has passed [s]; sets accelerations at the present positions
  /// \param velocities  the forces depend on velocities: these are predicted as well
  /// \throws std::runtime_error if a hundred steps in a row come down to the rounding of time: forces that
  ///   jump, or grow without end. The bodies then stand where the last step left them
  template <class Layout, class Forces>
  void advance(Bodies<Scalar, Layout>& bodies, const Scalar& h, bool velocities, Forces&& forces) {
    const Scalar eps = detail::roundoff<Scalar>();
    begin(bodies);
    Scalar done(0);
    int stuck = 0;  // steps in a row that cannot be shorter
    Scalar wanted = last_.next > Scalar(0) ? last_.next : firstStep(bodies, h);
    while (done < h && !bodies.empty()) {
      const Scalar rest = h - done;
      const bool last = !(wanted < rest);
      const Scalar dt = last ? rest : rest < Scalar(2) * wanted ? Scalar(rest / Scalar(2)) : wanted;
      const Scalar ratio = attempt(bodies, dt, done, velocities, forces);
      // Shorter than that, steps do not add up; two lumps of mass may pass so close, for a moment.
      const Scalar shortest = eps * std::max<Scalar>(done, eps * h);
      wanted = dt * std::clamp<Scalar>(ratio, Scalar(1e-3), Scalar(4));
      if (ratio < Scalar(0.25) && wanted > shortest) {
        ++rejected_;
        continue;
      }
      stuck = wanted > shortest ? 0 : stuck + 1;
      wanted = std::max<Scalar>(wanted, shortest);
      done = last ? h : Scalar(done + dt);
      accept(bodies, dt);
      ++taken_;
      forces(done);
      takeAccelerations(bodies, a0_);
      if (stuck == 100) {
        throw std::runtime_error(
            "gravel: Gauss-Radau's steps have come down to the rounding of time: its forces must be finite "
            "and smooth");
      }
    }
    last_.next = wanted;
  }

  /// A first guess, which rejections make shorter: a hundredth of the least v/a, by their largest
  /// coefficients, where bodies move; at most h.
  template <class Layout>
  static Scalar firstStep(const Bodies<Scalar, Layout>& bodies, const Scalar& h) {
    Scalar step = h;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Scalar v = detail::maxAbs<Scalar>(bodies[i].countingVelocity());
      const Scalar a = detail::maxAbs<Scalar>(Vector3<Scalar>(bodies.accelerations()[i]));
      if (v > Scalar(0) && a > Scalar(0)) {
        step = std::min<Scalar>(step, v / a / Scalar(100));
      }
    }
    return step;
  }

  /// The step that the last one asks for [s]; 0 before the first.
  const Scalar& nextStep() const { return last_.next; }
  std::size_t stepsTaken() const { return taken_; }
  std::size_t stepsRejected() const { return rejected_; }
  std::size_t iterations() const { return iterations_; }

  /// Another eta: the truncation error of a given time goes with its 15th power, or better.
  /// \throws std::invalid_argument unless in 1e-6 … 4
  void setStepFactor(const Scalar& eta) {
    detail::require("step factor of Gauss-Radau", eta, {Scalar(1e-6), Scalar(4), "1e-6 to 4"});
    eta_ = eta;
  }
  const Scalar& stepFactor() const { return eta_; }

  /// Forgets the step before: the next one begins without a prediction.
  void forget() {
    const Scalar eta = eta_;
    *this = GaussRadau15();
    eta_ = eta;
  }

  /// What the next step depends on beside the bodies: numbers for a restart.
  std::vector<Scalar> state() const { return last_.numbers(); }

  /// Takes up state(). \return false if it is none
  bool setState(const std::vector<Scalar>& numbers) {
    forget();
    return last_.take(numbers);
  }

 private:
  using Tables = detail::RadauTables;
  static constexpr std::size_t nodes = Tables::nodes;
  using Column = typename detail::RadauState<Scalar>::Column;
  using Columns = typename detail::RadauState<Scalar>::Columns;

  /// Reads the bodies, and what the last step knows if it left them so.
  template <class Layout>
  void begin(const Bodies<Scalar, Layout>& bodies) {
    last_.read(bodies);
    for (Column* c : {&a0_, &dx_, &dv_}) {
      c->resize(last_.x.size());
    }
    for (std::size_t m = 0; m < nodes; ++m) {
      F_[m].resize(last_.x.size());
      eNext_[m].resize(last_.x.size());
    }
    takeAccelerations(bodies, a0_);
  }

  template <class Layout, class Target>
  static void takeAccelerations(const Bodies<Scalar, Layout>& bodies, Target&& a) {
    const Vector3<Scalar> none = Vector3<Scalar>::Zero();  // of a fixed one, whatever the forces say
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Vector3<Scalar> given = bodies[i].isFixed() ? none : Vector3<Scalar>(bodies.accelerations()[i]);
      a.template segment<3>(static_cast<Eigen::Index>(3 * i)) = given.array();
    }
  }

  /// The last step's polynomial, carried on to a step of dt, with the correction that it needed last time
  /// (Rein & Spiegel 2015, eq. 13).
  void predict(const Scalar& dt) {
    detail::RadauState<Scalar>::clear(F_);
    detail::RadauState<Scalar>::clear(eNext_);
    if (!(last_.step > Scalar(0)) || dt > Scalar(20) * last_.step) {
      return;
    }
    const Scalar q = dt / last_.step;
    Scalar power = q;
    for (std::size_t j = 0; j < nodes; ++j) {
      Scalar binomial(1);  // of k + 1 over j + 1
      for (std::size_t k = j; k < nodes; ++k) {
        eNext_[j] += last_.b[k] * Scalar(binomial * power);
        binomial *= Scalar(static_cast<double>(k + 2)) / Scalar(static_cast<double>(k + 1 - j));
      }
      power *= q;
      dx_ = eNext_[j] + (last_.b[j] - last_.e[j]);
      for (std::size_t n = 0; n < nodes; ++n) {
        F_[n] += dx_ * weights_.power[n][j];
      }
    }
  }

  /// Solves the collocation of one step; positions, velocities and accelerations of the bodies are those of
  /// the nodes meanwhile. \return the step wanted over dt
  template <class Layout, class Forces>
  Scalar attempt(Bodies<Scalar, Layout>& bodies, const Scalar& dt, const Scalar& done, bool velocities,
                 Forces&& forces) {
    predict(dt);
    const Scalar dt_sq = dt * dt;
    const Scalar half = Scalar(1) / Scalar(2);
    Scalar before(0), size(0);
    for (int iteration = 1; iteration <= 12; ++iteration) {
      Scalar change(0);
      size = Scalar(0);
      for (std::size_t n = 0; n < nodes; ++n) {
        const Scalar s = Scalar(Tables::node[n]);
        const Scalar s_sq = s * s * half * dt_sq;
        dx_ = detail::dot(F_, weights_.position[n]) * dt_sq + a0_ * s_sq + last_.xLow +
              last_.v * Scalar(s * dt);
        if (velocities) {
          dv_ = detail::dot(F_, weights_.velocity[n]) * dt + last_.vLow + a0_ * Scalar(s * dt);
        }
        for (std::size_t i = 0; i < bodies.size(); ++i) {
          const auto at = static_cast<Eigen::Index>(3 * i);
          bodies.positions()[i] = (last_.x.template segment<3>(at) + dx_.template segment<3>(at)).matrix();
          if (velocities) {
            bodies.velocities()[i] = (last_.v.template segment<3>(at) + dv_.template segment<3>(at)).matrix();
          }
        }
        forces(Scalar(done + s * dt));
        takeAccelerations(bodies, dv_);
        size = std::max<Scalar>(size, detail::largestOf(dv_));
        dx_ = dv_ - a0_;
        change = std::max<Scalar>(change, detail::largestOf(dx_ - F_[n]));
        F_[n] = dx_;
      }
      ++iterations_;
      // What is left is the change times the rate at which changes shrink.
      const Scalar least = detail::roundoff<Scalar>() * size / Scalar(64);
      if (!(change > least) || (iteration > 1 && change / before <= least / change) ||
          (iteration > 2 && !(change < before))) {
        break;
      }
      before = change;
    }
    return stepWanted(bodies, dt_sq, size);
  }

  /// \param largest  acceleration in this step  \return the step wanted over dt
  template <class Layout>
  Scalar stepWanted(const Bodies<Scalar, Layout>& bodies, const Scalar& dt_sq, const Scalar& largest) {
    using std::sqrt;
    dx_ = detail::dot(F_, weights_.jerk);
    dv_ = detail::dot(F_, weights_.snap);
    xTermLow_ = detail::dot(F_, weights_.crackle);
    const Scalar unit = largest > Scalar(0) ? largest : Scalar(1);  // in which fourth powers are in range
    const auto squared = [&](const auto& v) { return Scalar((v / unit).square().sum()); };
    const auto root = [](const Scalar& x) { return x > Scalar(0) ? Scalar(sqrt(x)) : Scalar(0); };
    const Scalar eps = detail::roundoff<Scalar>();
    const auto isRounding = [&](Eigen::Index at) {
      Scalar change(0);
      for (const Column& f : F_) {
        change = std::max<Scalar>(change, detail::largestOf(f.template segment<3>(at)));
      }
      // Places at the start and at the last node.
      const Scalar now =
          detail::maxAbs<Scalar>(Vector3<Scalar>(bodies.positions()[static_cast<std::size_t>(at / 3)]));
      const Scalar place = std::max<Scalar>(now, detail::largestOf(last_.x.template segment<3>(at)));
      return change <= Scalar(16) * eps * largest ||
             change * dt_sq <= eps * std::max<Scalar>(place, last_.fixedPlace);
    };
    Scalar least(-1);
    for (Eigen::Index at = 0; at < last_.x.size(); at += 3) {
      const Scalar a = root(squared(a0_.template segment<3>(at) + F_[nodes - 1].template segment<3>(at)));
      const Scalar j_sq = squared(dx_.template segment<3>(at));
      const Scalar s_sq = squared(dv_.template segment<3>(at));
      const Scalar slow = j_sq + a * root(s_sq);
      const Scalar slower = s_sq + root(j_sq * squared(xTermLow_.template segment<3>(at)));
      if (slow > Scalar(0) && slower > Scalar(0)) {
        const Scalar t_sq = std::max<Scalar>(Scalar(2) * a * a / slow, slow / slower);
        if ((least < Scalar(0) || t_sq < least) && !isRounding(at)) {
          least = t_sq;
        }
      }
    }
    return least < Scalar(0) ? Scalar(4) : Scalar(eta_ * sqrt(least));
  }

  template <class Layout>
  void accept(Bodies<Scalar, Layout>& bodies, const Scalar& dt) {
    const auto [dt_sq, dt_sq_low] = detail::twoProduct<Scalar>(dt, dt);
    const Scalar half = Scalar(1) / Scalar(2);
    dx_ = detail::dot(F_, weights_.position[nodes]);
    // What is below an ulp of the terms goes to the lost parts: added to the terms it would vanish every
    // time, and a constant error of the weights makes the energy drift.
    xTermLow_ =
        (dx_ + a0_ * half) * dt_sq_low + detail::dot(F_, weights_.positionLow) * dt_sq + last_.vLow * dt;
    vTermLow_ = detail::dot(F_, weights_.velocityLow) * dt;
    dx_ *= dt_sq;
    dv_ = detail::dot(F_, weights_.velocity[nodes]) * dt;
    for (Eigen::Index k = 0; k < last_.x.size(); ++k) {
      const Scalar v = last_.v[k];
      const Scalar a = a0_[k];
      detail::addWide<Scalar>(last_.x[k], last_.xLow[k], dx_[k], xTermLow_[k]);
      const auto [fall, fallLow] = detail::twoProduct<Scalar>(a, Scalar(half * dt_sq));
      detail::addWide<Scalar>(last_.x[k], last_.xLow[k], fall, fallLow);
      const auto [way, wayLow] = detail::twoProduct<Scalar>(v, dt);
      detail::addWide<Scalar>(last_.x[k], last_.xLow[k], way, wayLow);
      const auto [gain, gainLow] = detail::twoProduct<Scalar>(a, dt);
      detail::addWide<Scalar>(last_.v[k], last_.vLow[k], dv_[k], vTermLow_[k]);
      detail::addWide<Scalar>(last_.v[k], last_.vLow[k], gain, gainLow);
    }
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(3 * i);
      bodies.positions()[i] = last_.x.template segment<3>(at).matrix();
      bodies.velocities()[i] = last_.v.template segment<3>(at).matrix();
    }
    for (std::size_t j = 0; j < nodes; ++j) {
      last_.b[j] = detail::dot(F_, weights_.coefficient[j]);
    }
    last_.e = eNext_;
    last_.step = dt;
  }

  detail::RadauWeights<Scalar> weights_;
  detail::RadauState<Scalar> last_;  // and where the bodies are
  Column a0_;                        // at the start of the step
  Column dx_, dv_, xTermLow_, vTermLow_;
  Columns F_;                   // a - a0 at the nodes
  Columns eNext_;               // coefficients as predicted now
  Scalar eta_ = Scalar(0.175);  // (5040e-9)^(1/7)
  std::size_t taken_ = 0, rejected_ = 0, iterations_ = 0;
};

}  // namespace gravel
