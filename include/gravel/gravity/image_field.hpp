#pragma once

/// \file
/// What the far images of all bodies do to each body.

#include <gravel/core/parallel.hpp>
#include <gravel/gravity/expansion_lanes.hpp>
#include <gravel/gravity/periodic_images.hpp>

namespace gravel::detail {

/// One expansion for the whole box, moments and field alike about its centre. The field of a pair is a
/// polynomial in their distance vector, odd in it, so the total force vanishes to rounding. O(N) with
/// (order + 1)^2 terms a body; sums are taken in the order of bodies.
template <Real S, Real F>
class ImageField {
 public:
  /// Gathers the sources. \param x,y,z,m columns in the unit of the images
  void gather(const PeriodicImages<S, F>& images, const S* x, const S* y, const S* z, const S* m,
              std::size_t n) {
    order_ = images.order();
    background_ = images.background();
    centre_ = images.centre();
    const auto terms = static_cast<std::size_t>(M::size(order_));
    const std::size_t chunks = (n + chunk - 1) / chunk;
    std::vector<std::vector<F>> parts(chunks);
    parallelForChunks(n, chunk, [&](std::size_t begin, std::size_t end) {
      std::vector<V> regular(terms);
      std::vector<V> sums(terms, Batch::zero());
      V squares = Batch::zero();
      for (std::size_t i = begin; i < end; i += Batch::width) {
        alignas(64) F r[4][Batch::width] = {};
        for (std::size_t w = 0; w < std::min(Batch::width, end - i); ++w) {
          r[0][w] = -F(x[i + w]);
          r[1][w] = -F(y[i + w]);
          r[2][w] = centre_ - F(z[i + w]);
          r[3][w] = F(m[i + w]);
        }
        const V dx = Batch::load(r[0]), dy = Batch::load(r[1]), dz = Batch::load(r[2]);
        const V mass = Batch::load(r[3]);
        X::regular(order_, dx, dy, dz, regular.data());
        for (std::size_t k = 0; k < terms; ++k) {
          sums[k] += mass * regular[k];
        }
        squares += mass * (dx * dx + dy * dy + dz * dz);
      }
      sums.push_back(squares);
      std::vector<F>& part = parts[begin / chunk];
      const auto* lanes = reinterpret_cast<const F*>(sums.data());
      for (std::size_t k = 0; k < sums.size(); ++k) {
        part.push_back(F(0));
        for (std::size_t w = 0; w < Batch::width; ++w) {
          part.back() += lanes[k * Batch::width + w];
        }
      }
    });
    std::vector<F> moments(terms + 1, F(0));
    for (const std::vector<F>& part : parts) {
      for (std::size_t k = 0; k <= terms; ++k) {
        moments[k] += part[k];
      }
    }
    squares_ = moments[terms];
    mass_ = moments[0];
    first_ = Vector3<F>(-moments[X::indexOf(1, 0, 0)], -moments[X::indexOf(0, 1, 0)],
                        -moments[X::indexOf(0, 0, 1)]);
    std::vector<F> local(terms, F(0));
    X::contract(order_, 0, order_, moments.data(), images.derivatives().data(), local.data());
    local_.assign(static_cast<std::size_t>(D::size(order_)), F(0));
    X::spreadOut(order_, local.data(), local_.data());
  }

  /// Adds accelerations, and potentials unless that column is null, at n points; G = 1.
  void addTo(std::size_t n, const S* x, const S* y, const S* z, S* ax, S* ay, S* az, S* potential) const {
    parallelForChunks(n, chunk, [&](std::size_t begin, std::size_t end) {
      std::vector<V> regular(static_cast<std::size_t>(M::size(order_)));
      for (std::size_t i = begin; i < end; i += Batch::width) {
        alignas(64) F r[4][Batch::width] = {};
        const std::size_t count = std::min(Batch::width, end - i);
        for (std::size_t w = 0; w < count; ++w) {
          r[0][w] = F(x[i + w]);
          r[1][w] = F(y[i + w]);
          r[2][w] = F(z[i + w]) - centre_;
        }
        const V dx = Batch::load(r[0]), dy = Batch::load(r[1]), dz = Batch::load(r[2]);
        X::regular(order_, dx, dy, dz, regular.data());
        V field[4] = {Batch::zero(), Batch::zero(), Batch::zero(), Batch::zero()};
        X::contract(order_, potential == nullptr ? 1 : 0, 1, regular.data(), local_.data(), field);
        const F twice = F(2) * background_;
        field[0] += background_ * (mass_ * (dx * dx + dy * dy + dz * dz) + squares_) -
                    twice * (first_[0] * dx + first_[1] * dy + first_[2] * dz);
        field[1] += twice * (mass_ * dx - first_[0]);
        field[2] += twice * (mass_ * dy - first_[1]);
        field[3] += twice * (mass_ * dz - first_[2]);
        for (int k = 0; k < 4; ++k) {
          Batch::store(r[k], field[k]);
        }
        for (std::size_t w = 0; w < count; ++w) {
          ax[i + w] += S(r[1][w]);
          ay[i + w] += S(r[2][w]);
          az[i + w] += S(r[3][w]);
          if (potential != nullptr) {
            potential[i + w] += S(r[0][w]);
          }
        }
      }
    });
  }

  /// The acceleration at one point.
  Vector3<F> at(const Vector3<F>& x) const {
    std::vector<F> regular(static_cast<std::size_t>(M::size(order_)));
    const Vector3<F> d(x[0], x[1], x[2] - centre_);
    F field[4] = {F(0), F(0), F(0), F(0)};
    X::regular(order_, d[0], d[1], d[2], regular.data());
    X::contract(order_, 1, 1, regular.data(), local_.data(), field);
    return Vector3<F>(Vector3<F>(field[1], field[2], field[3]) +
                      Vector3<F>((F(2) * background_) * (mass_ * d - first_)));
  }

 private:
  using X = Expansion<HarmonicTerms>;
  using M = HarmonicTerms::Moments;
  using D = HarmonicTerms::Derivatives;
  using Batch = FarBatch<F>;
  using V = typename Batch::V;
  static constexpr std::size_t chunk = 1024;

  int order_ = 0;
  F background_ = F(0), centre_ = F(0), mass_ = F(0), squares_ = F(0);
  Vector3<F> first_ = Vector3<F>::Zero();  ///< sum of m x, about the centre
  std::vector<F> local_;                   ///< in the rows of derivatives
};

}  // namespace gravel::detail
