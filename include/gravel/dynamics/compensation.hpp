#pragma once

/// \file
/// What sums lose to rounding, carried along (Kahan 1965; Møller 1965).
///
/// Drifts and kicks add small numbers to large ones, once a step. Each addition rounds by half a unit in the
/// last place of the large number, which over n steps adds up to sqrt(n) units. Here the lost part of each
/// position and velocity is kept and added to the next increment, so that what a run accumulates is the
/// rounding of increments: smaller by h over the time scale of the motion.

#include <gravel/bodies/bodies.hpp>
#include <gravel/bodies/columns.hpp>

#include <array>
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
/// anew, with no lost part. 96 bytes a body in double. For scalars that are not built in integrate()
/// carries nothing.
template <Real Scalar>
class Compensation {
 public:
  static constexpr bool carries = std::is_floating_point_v<Scalar>;
  using Lane = detail::BodyTile<Scalar>;  ///< one coefficient of four bodies

  /// The numbers of four bodies: rows are x, y, z of the positions, then of the velocities.
  struct Tile {
    Scalar seen[6][detail::tileWidth] = {};  ///< what add() last wrote
    Scalar low[6][detail::tileWidth] = {};
  };

  /// The sums of one body's position (row 0) or velocity (row 3).
  class Sum {
   public:
    Sum(Tile& tile, std::size_t row, std::size_t lane) : tile_(&tile), row_(row), lane_(lane) {}

    template <class Value>
    void add(Value&& value, const Vector3<Scalar>& term) const {
      Vector3<Scalar> sum = value;
      Vector3<Scalar> rest = low(sum);
      addCompensated<Scalar>(sum, rest, term);
      value = sum;
      set(sum, rest);
    }

    /// What still counts for a sum of this value.
    Vector3<Scalar> low(const Vector3<Scalar>& value) const {
      const auto& s = tile_->seen;
      const auto& l = tile_->low;
      const bool same =
          value[0] == s[row_][lane_] && value[1] == s[row_ + 1][lane_] && value[2] == s[row_ + 2][lane_];
      return same ? Vector3<Scalar>(l[row_][lane_], l[row_ + 1][lane_], l[row_ + 2][lane_])
                  : Vector3<Scalar>(Vector3<Scalar>::Zero());
    }

    void set(const Vector3<Scalar>& value, const Vector3<Scalar>& rest) const {
      for (std::size_t c = 0; c < 3; ++c) {
        tile_->seen[row_ + c][lane_] = value[static_cast<Eigen::Index>(c)];
        tile_->low[row_ + c][lane_] = rest[static_cast<Eigen::Index>(c)];
      }
    }

   private:
    Tile* tile_;
    std::size_t row_, lane_;
  };

  struct Entry {
    Sum position, velocity;
  };

  void resize(std::size_t n) {
    if (n != size_) {
      const std::size_t before = size_;
      size_ = n;
      tiles_.resize(tileCount(n, static_cast<int>(detail::tileWidth)));
      for (std::size_t i = std::min(before, n); i < tiles_.size() * detail::tileWidth; ++i) {
        const Entry entry = (*this)[i];
        entry.position.set(Vector3<Scalar>::Zero(), Vector3<Scalar>::Zero());
        entry.velocity.set(Vector3<Scalar>::Zero(), Vector3<Scalar>::Zero());
      }
    }
  }
  std::size_t size() const { return size_; }
  Entry operator[](std::size_t i) {
    Tile& tile = tiles_[i / detail::tileWidth];
    return {Sum(tile, 0, i % detail::tileWidth), Sum(tile, 3, i % detail::tileWidth)};
  }
  void clear() { resize(0); }

  /// values[c] += terms[c] for four bodies, the first of which is i: as Sum::add does, in lanes.
  /// \param row 0 for positions, 3 for velocities
  template <class Values>
  void addTile(std::size_t i, std::size_t row, Values&& values, const std::array<Lane, 3>& terms) {
    Tile& tile = tiles_[i / detail::tileWidth];
    Lane strange = Lane::Zero();
    for (std::size_t c = 0; c < 3; ++c) {
      strange += (Lane(values[c]) - Eigen::Map<Lane>(tile.seen[row + c])).abs();
    }
    if (!(strange.sum() == Scalar(0))) {  // somebody else has written, or no number
      for (Eigen::Index lane = 0; lane < Lane::SizeAtCompileTime; ++lane) {
        if (!(strange[lane] == Scalar(0))) {
          for (std::size_t c = 0; c < 3; ++c) {
            tile.low[row + c][lane] = Scalar(0);
          }
        }
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      Eigen::Map<Lane> low(tile.low[row + c]);
      const Lane sum = values[c];
      const Lane add = terms[c] + low;
      const Lane next = sum + add;
      const Lane part = next - sum;
      low = (sum - (next - part)) + (add - part);
      Eigen::Map<Lane>(tile.seen[row + c]) = next;
      values[c] = next;
    }
  }

  /// The lost parts that still count, six numbers a body: what a restart needs beside the bodies.
  template <class Layout>
  std::vector<Scalar> lostParts(const Bodies<Scalar, Layout>& bodies) const {
    std::vector<Scalar> lost;
    for (std::size_t i = 0; i < size_ && i < bodies.size(); ++i) {
      Tile tile = tiles_[i / detail::tileWidth];
      for (const std::size_t row : {0U, 3U}) {
        const Vector3<Scalar> low = Sum(tile, row, i % detail::tileWidth)
                                        .low(row == 0 ? Vector3<Scalar>(bodies[i].position())
                                                      : Vector3<Scalar>(bodies[i].velocity()));
        lost.insert(lost.end(), {low[0], low[1], low[2]});
      }
    }
    return lost;
  }

  /// Takes up lostParts() of these bodies.
  template <class Layout>
  void setLostParts(const Bodies<Scalar, Layout>& bodies, const std::vector<Scalar>& lost) {
    clear();
    resize(std::min(lost.size() / 6, bodies.size()));
    for (std::size_t i = 0; i < size_; ++i) {
      const Scalar* part = &lost[6 * i];
      (*this)[i].position.set(bodies[i].position(), {part[0], part[1], part[2]});
      (*this)[i].velocity.set(bodies[i].velocity(), {part[3], part[4], part[5]});
    }
  }

 private:
  std::vector<Tile> tiles_;
  std::size_t size_ = 0;
};

}  // namespace gravel
