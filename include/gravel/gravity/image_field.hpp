#pragma once

/// \file
/// What the far images of all bodies do to each body.

#include <gravel/core/parallel.hpp>
#include <gravel/gravity/expansion_lanes.hpp>
#include <gravel/gravity/periodic_images.hpp>

#include <algorithm>

namespace gravel::detail {

/// One expansion for the whole box, or for each slab of a deep patch that has bodies, moments and field alike
/// about its centre. The field of a pair is a polynomial in their distance vector, odd in it or, of bodies in
/// two slabs, turned with the sign of the vector, so the total force vanishes to rounding. O(N) with
/// (order + 1)^2 terms a body, and with order^4 terms a pair of slabs; sums are taken in the order of bodies.
template <Real S, Real F>
class ImageField {
 public:
  /// Gathers the sources. \param x,y,z,m columns in the unit of the images
  void gather(const PeriodicImages<S, F>& images, const S* x, const S* y, const S* z, const S* m,
              std::size_t n) {
    order_ = images.order();
    background_ = images.background();
    const auto terms = static_cast<std::size_t>(M::size(order_));
    const Groups groups(images, z, n);
    const std::vector<Share> shares = groups.shares();
    std::vector<std::vector<F>> parts(shares.size());
    const F perUnit = images.perUnit();
    parallelForTasks(shares.size(), [&](std::size_t c) {
      const F& slab = groups.slabs[shares[c].group];
      std::vector<V> regular(terms);
      std::vector<V> sums(terms, Batch::zero());
      V squares = Batch::zero();
      for (std::size_t i = shares[c].begin; i < shares[c].end; i += Batch::width) {
        alignas(64) F r[4][Batch::width] = {};
        for (std::size_t w = 0; w < std::min(Batch::width, shares[c].end - i); ++w) {
          const std::size_t row = groups.row(i + w);
          r[0][w] = -F(x[row]) * perUnit;
          r[1][w] = -F(y[row]) * perUnit;
          r[2][w] = -images.fromCentre(slab, F(z[row]));
          r[3][w] = F(m[row]);
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
      std::vector<F>& part = parts[c];
      const auto* lanes = reinterpret_cast<const F*>(sums.data());
      for (std::size_t k = 0; k < sums.size(); ++k) {
        part.push_back(F(0));
        for (std::size_t w = 0; w < Batch::width; ++w) {
          part.back() += lanes[k * Batch::width + w];
        }
      }
    });
    slabs_ = groups.slabs;
    moments_.assign(slabs_.size(), std::vector<F>(terms + 1, F(0)));
    for (std::size_t c = 0; c < shares.size(); ++c) {
      std::vector<F>& moments = moments_[shares[c].group];
      for (std::size_t k = 0; k <= terms; ++k) {
        moments[k] += parts[c][k];
      }
    }
    mass_ = squares_ = F(0);
    first_.setZero();
    if (background_ > F(0) && !slabs_.empty()) {
      const std::vector<F>& moments = moments_[0];
      squares_ = moments[terms];
      mass_ = moments[0];
      first_ = Vector3<F>(-moments[X::indexOf(1, 0, 0)], -moments[X::indexOf(0, 1, 0)],
                          -moments[X::indexOf(0, 0, 1)]);
    }
    local_.resize(slabs_.size());
    parallelForTasks(slabs_.size(), [&](std::size_t i) { local_[i] = localOf(images, slabs_[i], order_); });
  }

  /// Adds accelerations, and potentials unless that column is null, at n points; G = 1.
  void addTo(const PeriodicImages<S, F>& images, std::size_t n, const S* x, const S* y, const S* z, S* ax,
             S* ay, S* az, S* potential) const {
    const Groups groups(images, z, n);
    const std::vector<Share> shares = groups.shares();
    std::vector<std::vector<F>> others(groups.slabs.size());  // of slabs without sources
    for (std::size_t g = 0; g < others.size(); ++g) {
      if (find(groups.slabs[g]) == slabs_.size()) {
        others[g] = localOf(images, groups.slabs[g], order_);
      }
    }
    const F perUnit = images.perUnit();
    parallelForTasks(shares.size(), [&](std::size_t c) {
      const F& slab = groups.slabs[shares[c].group];
      const std::vector<F>& other = others[shares[c].group];
      const std::vector<F>& local = other.empty() ? local_[find(slab)] : other;
      std::vector<V> regular(static_cast<std::size_t>(M::size(order_)));
      for (std::size_t i = shares[c].begin; i < shares[c].end; i += Batch::width) {
        alignas(64) F r[4][Batch::width] = {};
        const std::size_t count = std::min(Batch::width, shares[c].end - i);
        for (std::size_t w = 0; w < count; ++w) {
          const std::size_t row = groups.row(i + w);
          r[0][w] = F(x[row]) * perUnit;
          r[1][w] = F(y[row]) * perUnit;
          r[2][w] = images.fromCentre(slab, F(z[row]));
        }
        const V dx = Batch::load(r[0]), dy = Batch::load(r[1]), dz = Batch::load(r[2]);
        X::regular(order_, dx, dy, dz, regular.data());
        V field[4] = {Batch::zero(), Batch::zero(), Batch::zero(), Batch::zero()};
        X::contract(order_, potential == nullptr ? 1 : 0, 1, regular.data(), local.data(), field);
        const F twice = F(2) * background_;
        field[0] += background_ * (mass_ * (dx * dx + dy * dy + dz * dz) + squares_) -
                    twice * (first_[0] * dx + first_[1] * dy + first_[2] * dz);
        field[1] += twice * (mass_ * dx - first_[0]);
        field[2] += twice * (mass_ * dy - first_[1]);
        field[3] += twice * (mass_ * dz - first_[2]);
        for (int k = 0; k < 4; ++k) {
          Batch::store(r[k], field[k]);
        }
        const F slope = perUnit * perUnit;
        for (std::size_t w = 0; w < count; ++w) {
          const std::size_t row = groups.row(i + w);
          ax[row] += S(slope * r[1][w]);
          ay[row] += S(slope * r[2][w]);
          az[row] += S(slope * r[3][w]);
          if (potential != nullptr) {
            potential[row] += S(perUnit * r[0][w]);
          }
        }
      }
    });
  }

  /// The acceleration at one point; to some per cent in a slab without sources.
  Vector3<F> at(const PeriodicImages<S, F>& images, const Vector3<F>& x) const {
    const F slab = images.slabOf(x[2]);
    const std::size_t known = find(slab);
    const int order = known < slabs_.size() ? order_ : std::min(order_, 8);
    const std::vector<F> other = known < slabs_.size() ? std::vector<F>() : localOf(images, slab, order);
    const std::vector<F>& local = known < slabs_.size() ? local_[known] : other;
    std::vector<F> regular(static_cast<std::size_t>(M::size(order)));
    const F perUnit = images.perUnit();
    const Vector3<F> d(x[0] * perUnit, x[1] * perUnit, images.fromCentre(slab, x[2]));
    F field[4] = {F(0), F(0), F(0), F(0)};
    X::regular(order, d[0], d[1], d[2], regular.data());
    X::contract(order, 1, 1, regular.data(), local.data(), field);
    return Vector3<F>(Vector3<F>(Vector3<F>(field[1], field[2], field[3]) +
                                 Vector3<F>((F(2) * background_) * (mass_ * d - first_))) *
                      F(perUnit * perUnit));
  }

 private:
  using X = Expansion<HarmonicTerms>;
  using M = HarmonicTerms::Moments;
  using D = HarmonicTerms::Derivatives;
  using Batch = FarBatch<F>;
  using V = typename Batch::V;
  static constexpr std::size_t chunk = 1024;

  /// Bodies begin ... end - 1 of the order of a Groups, all in one slab.
  struct Share {
    std::size_t group, begin, end;
  };

  /// Rows of bodies by slab, in each as they stand.
  struct Groups {
    Groups(const PeriodicImages<S, F>& images, const S* z, std::size_t n) {
      if (!images.isDeep()) {
        slabs.assign(n > 0 ? 1 : 0, F(0));
        ends.assign(slabs.size(), n);
        return;
      }
      std::vector<F> slab(n);
      for (std::size_t i = 0; i < n; ++i) {
        slab[i] = images.slabOf(F(z[i]));
        rows.push_back(i);
      }
      std::stable_sort(rows.begin(), rows.end(),
                       [&](std::size_t i, std::size_t j) { return slab[i] < slab[j]; });
      for (std::size_t i = 0; i < n; ++i) {
        if (i == 0 || slabs.back() < slab[rows[i]]) {
          slabs.push_back(slab[rows[i]]);
          ends.push_back(i);
        }
        ends.back() = i + 1;
      }
    }

    std::size_t row(std::size_t i) const { return rows.empty() ? i : rows[i]; }

    std::vector<Share> shares() const {
      std::vector<Share> all;
      for (std::size_t g = 0, begin = 0; g < slabs.size(); ++g) {
        for (; begin < ends[g]; begin = all.back().end) {
          all.push_back({g, begin, std::min(begin + chunk, ends[g])});
        }
      }
      return all;
    }

    std::vector<F> slabs;  ///< ascending
    std::vector<std::size_t> ends, rows;
  };

  /// The number of a slab that has sources, or how many there are.
  std::size_t find(const F& slab) const {
    const auto place = std::lower_bound(slabs_.begin(), slabs_.end(), slab);
    const bool is = place != slabs_.end() && *place == slab;
    return is ? static_cast<std::size_t>(place - slabs_.begin()) : slabs_.size();
  }

  /// What all slabs do in one, in the rows of derivatives.
  std::vector<F> localOf(const PeriodicImages<S, F>& images, const F& slab, int order) const {
    std::vector<F> local(static_cast<std::size_t>(M::size(order)), F(0));
    for (std::size_t i = 0; i < slabs_.size(); ++i) {
      images.addFar(F(slab - slabs_[i]), moments_[i], local, order);
    }
    std::vector<F> spread(static_cast<std::size_t>(D::size(order)), F(0));
    X::spreadOut(order, local.data(), spread.data());
    return spread;
  }

  int order_ = 0;
  F background_ = F(0), mass_ = F(0), squares_ = F(0);
  Vector3<F> first_ = Vector3<F>::Zero();  ///< sum of m x, about the centre
  std::vector<F> slabs_;                   ///< those with sources, ascending
  std::vector<std::vector<F>> moments_;    ///< of each slab
  std::vector<std::vector<F>> local_;      ///< of each slab, in the rows of derivatives
};

}  // namespace gravel::detail
