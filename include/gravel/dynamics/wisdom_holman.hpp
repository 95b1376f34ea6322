#pragma once

/// \file
/// The Wisdom-Holman method for planetary systems: Kepler orbits are solved, what is left is kicked.

#include <gravel/core/check.hpp>
#include <gravel/dynamics/compensation.hpp>
#include <gravel/dynamics/kepler.hpp>

#include <algorithm>
#include <numeric>
#include <span>
#include <type_traits>
#include <vector>

namespace gravel {

/// Wisdom & Holman (1991, AJ 102, 1528) in Jacobi's coordinates: the position of each planet is taken from
/// the centre of mass of all bodies before it. Each then moves on a Kepler orbit about the mass up to and
/// with its own, and is kicked by the rest: the total acceleration in these coordinates less that of the
/// orbit. Order 2 in the step with an error in proportion to the planets' masses: some 1/20 of the shortest
/// orbit is a good step. A single planet is exact. Symplectic and time-reversible for a fixed step; not for
/// close encounters between planets, which the kicks do not resolve.
///
/// The centre is the body of most mass; the others follow in the order of their ids: add them from the inside
/// out. Forces of any other kind may act; massless bodies are moved as the others.
///
/// Cost: one force evaluation and a Kepler solution a body and step, O(N) beside the forces.
template <Real Scalar>
class WisdomHolman {
 public:
  /// Advances by h [s]. Accelerations must be those of the present positions, and are at the end.
  /// \param G  as in the forces
  /// \param forces  called once, with h and, if it takes them, the changes of velocities that the first kick
  ///        made, by body: so much, nearly, will the last one add to those that it sees
  /// \throws std::invalid_argument if no body has mass, one is fixed, or one stands at the centre of mass of
  ///   those before it, about which it has no orbit; nothing has moved then
  template <class Layout, class Forces>
  void advance(Bodies<Scalar, Layout>& bodies, const Scalar& G, const Scalar& h, Forces&& forces) {
    prepare(bodies);
    lost_.resize(bodies.size());
    const Scalar half = h / Scalar(2);
    kick(bodies, G, half);
    toJacobi(bodies.velocities(), v_);
    for (std::size_t k = 0; k < order_.size(); ++k) {
      if (k == 0) {
        dx_[k] = v_[k] * h;
        dv_[k] = Vector3<Scalar>::Zero();
      } else {
        keplerIncrements<Scalar>(x_[k], v_[k], G * mass_[k], h, dx_[k], dv_[k]);
      }
    }
    fromJacobi(dx_, [&](std::size_t i, const Vector3<Scalar>& d) {
      lost_[i].position.add(bodies.positions()[i], d);
    });
    fromJacobi(dv_, [&](std::size_t i, const Vector3<Scalar>& d) {
      lost_[i].velocity.add(bodies.velocities()[i], d);
    });
    if constexpr (std::is_invocable_v<Forces&, const Scalar&, std::span<const Vector3<Scalar>>>) {
      forces(h, std::span<const Vector3<Scalar>>(kicks_));
    } else {
      forces(h);
    }
    toJacobi(bodies.positions(), x_);
    kick(bodies, G, half);
  }

  /// Lost parts of sums: what a restart needs beside the bodies.
  const Compensation<Scalar>& lost() const { return lost_; }
  Compensation<Scalar>& lost() { return lost_; }

  /// \throws std::invalid_argument if a body is fixed, or none has a mass
  template <class Layout>
  static void check(const Bodies<Scalar, Layout>& bodies) {
    bool heavy = false;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      heavy = heavy || Scalar(bodies.masses()[i]) > Scalar(0);
      if (bodies[i].isFixed()) {
        detail::refuse(
            "body " + std::to_string(toInteger(bodies[i].id())) + " with the integrator WisdomHolman",
            "fixed", "bodies that move");
      }
    }
    if (!heavy) {
      detail::refuse("largest mass with the integrator WisdomHolman", "0", "> 0: the centre has mass");
    }
  }

  /// Finds centre, order and places. Part of advance(), with its errors.
  template <class Layout>
  void prepare(const Bodies<Scalar, Layout>& bodies) {
    check(bodies);
    const std::size_t n = bodies.size();
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return toInteger(bodies[a].id()) < toInteger(bodies[b].id());
    });
    const auto heaviest = std::max_element(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return Scalar(bodies.masses()[a]) < Scalar(bodies.masses()[b]);
    });
    std::rotate(order_.begin(), heaviest, heaviest + 1);
    mass_.resize(n);
    share_.resize(n);
    for (std::vector<Vector3<Scalar>>* column : {&x_, &v_, &dx_, &dv_}) {
      column->resize(n);
    }
    Scalar sum(0);
    for (std::size_t k = 0; k < n; ++k) {
      const Scalar m = bodies.masses()[order_[k]];
      sum += m;
      mass_[k] = sum;
      share_[k] = m / sum;
    }
    toJacobi(bodies.positions(), x_);
    for (std::size_t k = 1; k < n; ++k) {
      if (x_[k].squaredNorm() == Scalar(0)) {
        detail::refuse("distance with the integrator WisdomHolman of body " +
                           std::to_string(toInteger(bodies[order_[k]].id())) +
                           " from the centre of mass of those before it",
                       "0", "> 0");
      }
    }
  }

 private:
  /// jacobi[0] is the centre of mass, jacobi[k] from the centre of mass of those before.
  template <class Columns>
  void toJacobi(const Columns& column, std::vector<Vector3<Scalar>>& jacobi) const {
    Vector3<Scalar> centre = column[order_[0]];
    for (std::size_t k = 1; k < order_.size(); ++k) {
      jacobi[k] = Vector3<Scalar>(column[order_[k]]) - centre;
      centre += jacobi[k] * share_[k];
    }
    jacobi[0] = centre;
  }

  template <class Add>
  void fromJacobi(const std::vector<Vector3<Scalar>>& jacobi, Add&& add) const {
    Vector3<Scalar> centre = jacobi[0];
    for (std::size_t k = order_.size(); k-- > 1;) {
      centre -= jacobi[k] * share_[k];
      add(order_[k], Vector3<Scalar>(centre + jacobi[k]));
    }
    add(order_[0], centre);
  }

  /// Kicks by all accelerations but those of the orbits; x_ holds the present positions.
  template <class Layout>
  void kick(Bodies<Scalar, Layout>& bodies, const Scalar& G, const Scalar& h) {
    using std::sqrt;
    toJacobi(bodies.accelerations(), dv_);
    for (std::size_t k = 1; k < order_.size(); ++k) {
      const Scalar r_sq = x_[k].squaredNorm();  // its cube may leave the range of float
      dv_[k] += x_[k] * Scalar(G * mass_[k] / r_sq / Scalar(sqrt(r_sq)));
    }
    for (Vector3<Scalar>& d : dv_) {
      d *= h;
    }
    kicks_.resize(bodies.size());
    fromJacobi(dv_, [&](std::size_t i, const Vector3<Scalar>& d) {
      kicks_[i] = d;
      lost_[i].velocity.add(bodies.velocities()[i], d);
    });
  }

  std::vector<std::size_t> order_;      // body indices: the centre, then by id
  std::vector<Scalar> mass_, share_;    // up to and with each, and its own over that
  std::vector<Vector3<Scalar>> x_, v_;  // Jacobi's coordinates
  std::vector<Vector3<Scalar>> dx_, dv_;
  std::vector<Vector3<Scalar>> kicks_;  // of the last kick, by body
  Compensation<Scalar> lost_;
};

}  // namespace gravel
