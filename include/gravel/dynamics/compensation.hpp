#pragma once

/// \file
/// What sums lose to rounding, carried along (Kahan 1965; Møller 1965).
///
/// Drifts and kicks add small numbers to large ones, once a step. Each addition rounds by half a unit in the
/// last place of the large number, which over n steps adds up to sqrt(n) units. Here the lost part of each
/// position and velocity is kept and added to the next increment, so that what a run accumulates is the
/// rounding of increments: smaller by h over the time scale of the motion.

#include <gravel/bodies/bodies.hpp>

#include <type_traits>
#include <vector>

namespace gravel {

/// sum += term, with the error of all additions so far in `low`. The error is found exactly whatever the
/// sizes (Knuth's two-sum).
template <Real Scalar>
inline void addCompensated(Vector3<Scalar>& sum, Vector3<Scalar>& low, const Vector3<Scalar>& term) {
  const Vector3<Scalar> add = term + low;
  const Vector3<Scalar> next = sum + add;
  const Vector3<Scalar> part = next - sum;
  low = (sum - (next - part)) + (add - part);
  sum = next;
}

/// The lost parts of the positions and velocities of all bodies. A body whose position or velocity is not
/// what the integrator last wrote (a contact, damping, a user's own hand, another order of the bodies) begins
/// anew, with no lost part. 96 bytes a body in double. For scalars that are not built in nothing is carried.
template <Real Scalar>
class Compensation {
 public:
  static constexpr bool carries = std::is_floating_point_v<Scalar>;

  struct Sum {
    Vector3<Scalar> seen = Vector3<Scalar>::Zero();  ///< what add() last wrote
    Vector3<Scalar> low = Vector3<Scalar>::Zero();

    template <class Value>
    void add(Value&& value, const Vector3<Scalar>& term) {
      Vector3<Scalar> sum = value;
      if (!(sum == seen)) {
        low.setZero();
      }
      addCompensated<Scalar>(sum, low, term);
      value = sum;
      seen = sum;
    }
  };

  struct Entry {
    Sum position, velocity;
  };

  void resize(std::size_t n) { entries_.resize(n); }
  std::size_t size() const { return entries_.size(); }
  Entry& operator[](std::size_t i) { return entries_[i]; }
  void clear() { entries_.clear(); }

  /// The lost parts that still count, six numbers a body: what a restart needs beside the bodies.
  template <class Layout>
  std::vector<Scalar> lostParts(const Bodies<Scalar, Layout>& bodies) const {
    std::vector<Scalar> lost;
    for (std::size_t i = 0; i < entries_.size() && i < bodies.size(); ++i) {
      const auto put = [&](const Sum& sum, const Vector3<Scalar>& value) {
        const Vector3<Scalar> low = sum.seen == value ? sum.low : Vector3<Scalar>(Vector3<Scalar>::Zero());
        lost.insert(lost.end(), {low[0], low[1], low[2]});
      };
      put(entries_[i].position, bodies[i].position());
      put(entries_[i].velocity, bodies[i].velocity());
    }
    return lost;
  }

  /// Takes up lostParts() of these bodies.
  template <class Layout>
  void setLostParts(const Bodies<Scalar, Layout>& bodies, const std::vector<Scalar>& lost) {
    entries_.assign(std::min(lost.size() / 6, bodies.size()), Entry{});
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const Scalar* part = &lost[6 * i];
      entries_[i].position = {bodies[i].position(), {part[0], part[1], part[2]}};
      entries_[i].velocity = {bodies[i].velocity(), {part[3], part[4], part[5]}};
    }
  }

 private:
  std::vector<Entry> entries_;
};

}  // namespace gravel
