#pragma once

/// \file
/// A few points that nothing but their forces moves, carried through many steps outside of their storage.

#include <gravel/core/rounded.hpp>
#include <gravel/dynamics/compensation.hpp>
#include <gravel/dynamics/integrator_tables.hpp>

#include <algorithm>

namespace gravel {

/// Positions, velocities and accelerations of at most `most` movable bodies, coefficient by coefficient in
/// one row each, with what sums lost to rounding. Kicks and drifts give the bits of `integrate()` on the
/// bodies themselves: the same operations, but without asking at each whether somebody else wrote to a body.
/// Bodies do not turn. 1.8 kB in double; no memory is asked for.
template <Real Scalar>
class FewPoints {
 public:
  static constexpr std::size_t most = 14;

  /// One vector of each point, `view[i]`.
  class Vectors {
   public:
    Vectors(Scalar* row, std::size_t size, std::size_t stride) : row_(row), size_(size), stride_(stride) {}
    std::size_t size() const { return size_; }
    auto operator[](std::size_t i) const {
      return Eigen::Map<Vector3<Scalar>, Eigen::Unaligned, Eigen::InnerStride<>>(
          row_ + i, Eigen::InnerStride<>(static_cast<Eigen::Index>(stride_)));
    }

   private:
    Scalar* row_;
    std::size_t size_, stride_;
  };

  /// \param lost  of these bodies, or nullptr: nothing is carried. store() wants the same two
  template <class Layout>
  void load(const Bodies<Scalar, Layout>& bodies, Compensation<Scalar>* lost) {
    n_ = bodies.size();
    stride_ = (n_ + 1) / 2 * 2;
    carries_ = lost != nullptr;
    if (carries_) {
      lost->resize(n_);
    }
    for (Row* row : {&x_, &v_, &a_, &lostX_, &lostV_}) {
      std::fill_n(row->at, 3 * stride_, Scalar(0));
    }
    for (std::size_t i = 0; i < n_; ++i) {
      const auto body = bodies[i];
      const Vector3<Scalar> x = body.position();
      const Vector3<Scalar> v = body.velocity();
      vectors(x_)[i] = x;
      vectors(v_)[i] = v;
      vectors(a_)[i] = body.acceleration();
      m_[i] = body.mass();
      if (carries_) {
        vectors(lostX_)[i] = (*lost)[i].position.low(x);
        vectors(lostV_)[i] = (*lost)[i].velocity.low(v);
      }
    }
  }

  /// Back to the bodies, with the force m a.
  template <class Layout>
  void store(Bodies<Scalar, Layout>& bodies, Compensation<Scalar>* lost) {
    for (std::size_t i = 0; i < n_; ++i) {
      const auto body = bodies[i];
      const Vector3<Scalar> x = vectors(x_)[i];
      const Vector3<Scalar> v = vectors(v_)[i];
      const Vector3<Scalar> a = vectors(a_)[i];
      body.position() = x;
      body.velocity() = v;
      body.acceleration() = a;
      body.force() = a * m_[i];
      if (carries_) {
        (*lost)[i].position.set(x, vectors(lostX_)[i]);
        (*lost)[i].velocity.set(v, vectors(lostV_)[i]);
      }
    }
  }

  /// One step h by the method's row of kicks and drifts, which has no gradients.
  /// \param forces  called with positions(), masses() and accelerations(), to set the last
  /// \param field  [m s^-2] comes to each acceleration
  template <class Forces>
  void step(const IntegratorTraits& method, const Scalar& h, const Vector3<Scalar>& field, Forces&& forces) {
    for (const IntegratorStage& stage : method.stages) {
      add(v_, lostV_, a_, detail::fromTable<Scalar>(stage.kick) * h);
      add(x_, lostX_, v_, detail::fromTable<Scalar>(stage.drift) * h);
      forces(vectors(x_), std::span<const Scalar>(m_, n_), vectors(a_));
      for (std::size_t i = 0; i < n_; ++i) {
        a_.at[i] += field[0];
        a_.at[i + stride_] += field[1];
        a_.at[i + 2 * stride_] += field[2];
      }
    }
    add(v_, lostV_, a_, detail::fromTable<Scalar>(method.lastKick) * h);
  }

  /// Whether all positions and velocities are numbers.
  bool isFinite() const {
    Pack none = Pack::Zero();
    for (std::size_t k = 0; k < 3 * stride_; k += 2) {
      none += x_.pack(k) * Scalar(0) + v_.pack(k) * Scalar(0);
    }
    return none[0] == Scalar(0) && none[1] == Scalar(0);
  }

 private:
  using Pack = Lanes<Scalar, 2>;

  /// x of all, then y, then z; of an odd number there is one more, which is and stays 0.
  struct Row {
    alignas(16) Scalar at[3 * most];
    Pack pack(std::size_t k) const { return Eigen::Map<const Pack>(at + k); }
    void put(std::size_t k, const Pack& p) { Eigen::Map<Pack>{at + k} = p; }
  };

  Vectors vectors(Row& row) { return Vectors(row.at, n_, stride_); }

  /// sums += rates time, as addCompensated() does.
  void add(Row& sums, Row& lows, const Row& rates, const Scalar& time) {
    if (time == Scalar(0)) {
      return;
    }
    const std::size_t end = 3 * stride_;
    if (!carries_) {
      for (std::size_t k = 0; k < end; k += 2) {
        sums.put(k, sums.pack(k) + detail::rounded<Pack>(rates.pack(k) * time));
      }
      return;
    }
    for (std::size_t k = 0; k < end; k += 2) {
      const Pack sum = sums.pack(k);
      const Pack more = detail::rounded<Pack>(rates.pack(k) * time) + lows.pack(k);
      const Pack next = sum + more;
      const Pack part = next - sum;
      lows.put(k, (sum - (next - part)) + (more - part));
      sums.put(k, next);
    }
  }

  Row x_, v_, a_, lostX_, lostV_;
  Scalar m_[most];
  std::size_t n_ = 0;
  std::size_t stride_ = 0;
  bool carries_ = false;
};

}  // namespace gravel
