#pragma once

/// \file
/// Two other ways to solve many contacts at once, written out in short for spheres with friction and spin, on
/// compact arrays, warm-started by contact identity. See contact_methods.cpp.

#include "boxes.hpp"
#include <gravel/spatial/neighbour_list.hpp>

#include <string>

namespace boxes {

/// A way to step a scene.
class Method {
 public:
  virtual ~Method() = default;
  virtual void step() = 0;
  virtual Errors errors() const = 0;
  virtual double kinetic() const = 0;
  virtual double weightError() const = 0;  ///< of the last step
  virtual std::vector<Vec> places() const = 0;

  std::string name;
  std::string parameters;
};

/// Bodies, contacts and their search, which the other two share.
class Written : public Method {
 public:
  explicit Written(const Scene& scene) : scene_(scene), planes_(scene.planes()) {
    for (const gravel::Body<double>& b : scene.bodies) {
      const double inertia = 0.4 * b.mass * b.radius * b.radius;
      grains_.push_back({b.velocity, b.angularVelocity, b.position, b.radius, 1 / b.mass, 1 / inertia});
      positions_.push_back(b.position);
      radii_.push_back(b.radius);
      ids_.push_back(ids_.size());
    }
    grains_.push_back({Vec::Zero(), Vec::Zero(), Vec::Zero(), 0, 0, 0});  // what planes are made of
  }

  Errors errors() const override {
    Errors errors;
    for (Touch c : touches_) {
      place(c);
      const double overlap = std::max(0.0, -c.gap) / radius;
      errors.meanOverlap += overlap / static_cast<double>(touches_.size());
      errors.largestOverlap = std::max(errors.largestOverlap, overlap);
    }
    errors.kinetic = kinetic() / (static_cast<double>(ids_.size()) * g * radius);
    return errors;
  }
  double kinetic() const override {
    double sum = 0;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      const Grain& b = grains_[i];
      sum += 0.5 * (b.v.squaredNorm() / b.inverseMass + b.w.squaredNorm() / b.inverseInertia);
    }
    return sum;
  }
  double weightError() const override {
    double weight = 0;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      weight += scene_.g / grains_[i].inverseMass;
    }
    return std::abs(-load_ / (weight * scene_.h) - 1);
  }
  std::vector<Vec> places() const override {
    std::vector<Vec> all;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      all.push_back(grains_[i].x);
    }
    return all;
  }

 protected:
  struct Grain {
    Vec v;
    Vec w;
    Vec x;
    double r;
    double inverseMass;
    double inverseInertia;
  };
  struct Touch {
    std::uint64_t key;
    std::uint32_t a;
    std::uint32_t b;
    int plane = -1;
    Vec n = Vec::Zero();
    double gap = 0;
    double target = 0;  ///< least v_n, after restitution; 0 for a slow approach
    double approach = 0;
    double m_n = 0;
    double m_t = 0;
    double jn = 0;
    double most = 0;  ///< largest jn of the step
    Vec jt = Vec::Zero();
  };

  /// Normal and gap where the bodies are now.
  void place(Touch& c) const {
    const Grain& a = grains_[c.a];
    if (c.plane >= 0) {
      const auto& [normal, offset] = planes_[static_cast<std::size_t>(c.plane)];
      c.n = -normal;
      c.gap = normal.dot(a.x) - offset - a.r;
    } else {
      const Vec r = grains_[c.b].x - a.x;
      const double d = r.norm();
      c.n = r / d;
      c.gap = d - a.r - grains_[c.b].r;
    }
  }

  double normalSpeed(const Touch& c) const { return c.n.dot(grains_[c.b].v - grains_[c.a].v); }

  void push(const Touch& c, double jn) {
    grains_[c.a].v -= (jn * grains_[c.a].inverseMass) * c.n;
    grains_[c.b].v += (jn * grains_[c.b].inverseMass) * c.n;
  }
  void rub(const Touch& c, const Vec& j) {
    Grain& a = grains_[c.a];
    Grain& b = grains_[c.b];
    const Vec turn = c.n.cross(j);
    a.v -= a.inverseMass * j;
    b.v += b.inverseMass * j;
    a.w -= (a.r * a.inverseInertia) * turn;
    b.w -= (b.r * b.inverseInertia) * turn;
  }
  /// Coulomb's law with the accumulated impulses.
  void stick(Touch& c) {
    if (!(scene_.mu > 0)) {
      return;
    }
    const Grain& a = grains_[c.a];
    const Grain& b = grains_[c.b];
    Vec u = b.v - a.v - (a.r * a.w + b.r * b.w).cross(c.n);
    u -= c.n.dot(u) * c.n;
    Vec wanted = c.jt - c.m_t * u;
    const double most = scene_.mu * c.jn;
    const double size_sq = wanted.squaredNorm();
    if (size_sq > most * most) {
      wanted *= most / std::sqrt(size_sq);
    }
    rub(c, wanted - c.jt);
    c.jt = wanted;
  }
  void warmStart() {
    for (Touch& c : touches_) {
      c.jt -= c.n.dot(c.jt) * c.n;
      push(c, c.jn);
      rub(c, c.jt);
    }
  }

  /// The contacts of a step, with the impulses of the last one.
  void find() {
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      positions_[i] = grains_[i].x;
    }
    const double margin = 0.1 * radius;
    const auto& pairs =
        list_.update(positions_, radii_, ids_, 1, gravel::Domain<double>::open(), 0.0, margin);
    before_.swap(touches_);
    touches_.clear();
    std::size_t m = 0;
    const auto take = [&](std::uint64_t key, std::uint32_t a, std::uint32_t b, int plane) {
      Touch c{key, a, b, plane};
      place(c);
      const double v_n = normalSpeed(c);
      if (!(c.gap < 0.01 * radius + (std::max(0.0, -v_n) + scene_.g * scene_.h) * scene_.h)) {
        return;
      }
      while (m < before_.size() && before_[m].key < key) {
        ++m;
      }
      if (m < before_.size() && before_[m].key == key) {
        c.jn = before_[m].jn;
        c.jt = before_[m].jt;
      }
      const Grain& one = grains_[a];
      const Grain& two = grains_[b];
      const double inverse = one.inverseMass + two.inverseMass;
      c.m_n = 1 / inverse;
      c.m_t = 1 / (inverse + one.r * one.r * one.inverseInertia + two.r * two.r * two.inverseInertia);
      c.approach = -v_n;
      c.target = c.approach > 2 * scene_.g * scene_.h ? scene_.e * c.approach : 0.0;
      touches_.push_back(c);
    };
    for (std::uint32_t i = 0; i < ids_.size(); ++i) {
      for (std::size_t p = 0; p < planes_.size(); ++p) {
        if (planes_[p].first.dot(grains_[i].x) - planes_[p].second - grains_[i].r < margin) {
          take(std::uint64_t{i} << 32U | p, i, static_cast<std::uint32_t>(ids_.size()), static_cast<int>(p));
        }
      }
    }
    for (const gravel::Pair& pair : pairs) {
      take(std::uint64_t{1} << 63U | std::uint64_t{pair.first} << 32U | pair.second, pair.first, pair.second,
           -1);
    }
    load_ = 0;
  }

  void accelerate(double h) {
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      grains_[i].v[2] -= scene_.g * h;
    }
  }
  void drift(double h) {
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      grains_[i].x += h * grains_[i].v;
    }
  }
  /// Books what the floor and the walls carry.
  void weigh() {
    for (const Touch& c : touches_) {
      if (c.plane >= 0) {
        load_ += c.jn * c.n[2] + c.jt[2];
      }
    }
  }

  Scene scene_;
  std::vector<std::pair<Vec, double>> planes_;
  std::vector<Grain> grains_;
  std::vector<Touch> touches_;

 private:
  std::vector<Touch> before_;
  std::vector<Vec> positions_;
  std::vector<double> radii_;
  std::vector<std::uint64_t> ids_;
  gravel::NeighbourList<double> list_;
  double load_ = 0;  ///< impulse of the step on planes, upwards
};

class Soft : public Written {
 public:
  /// \param hertz of the springs at most; a quarter of the rate of the substeps is the stiffest that is
  /// stable
  Soft(const Scene& scene, int substeps, double hertz) : Written(scene), substeps_(substeps) {
    const double h = scene.h / substeps;
    const double damping = 10;
    const double omega = 2 * gravel::pi<double>() * std::min(hertz, 0.25 / h);
    const double a1 = 2 * damping + h * omega;
    const double a2 = h * omega * a1;
    rate_ = omega / a1;
    massShare_ = a2 / (1 + a2);
    impulseShare_ = 1 / (1 + a2);
    name = "soft";
    parameters = std::to_string(substeps) + " substeps, " +
                 std::to_string(std::lround(std::min(hertz, 0.25 / h))) + " Hz";
  }

  void step() override {
    const double h = scene_.h / substeps_;
    find();
    for (int s = 0; s < substeps_; ++s) {
      accelerate(h);
      warmStart();
      sweep(h, true);
      drift(h);
      for (Touch& c : touches_) {
        place(c);
      }
      sweep(h, false);
      weigh();
    }
    for (Touch& c : touches_) {
      if (c.target > 0 && c.most > 0) {
        const double j = std::max(c.jn + c.m_n * (c.target - normalSpeed(c)), 0.0);
        push(c, j - c.jn);
        c.jn = j;
      }
    }
  }

 private:
  void sweep(double h, bool springs) {
    const double fastest = 3;  // [m/s] that a spring pushes apart
    for (Touch& c : touches_) {
      double bias = 0;
      double share = 1;
      double give = 0;
      if (c.gap > 0) {
        bias = c.gap / h;
      } else if (springs) {
        bias = std::max(rate_ * c.gap, -fastest);
        share = massShare_;
        give = impulseShare_;
      }
      const double j = std::max(c.jn - c.m_n * share * (normalSpeed(c) + bias) - give * c.jn, 0.0);
      push(c, j - c.jn);
      c.jn = j;
      c.most = std::max(c.most, j);
      stick(c);
    }
  }

  int substeps_;
  double rate_;
  double massShare_;
  double impulseShare_;
};

class Pgs : public Written {
 public:
  /// \param projections sweeps that move bodies apart; 0: Baumgarte's way
  Pgs(const Scene& scene, int sweeps, int projections)
      : Written(scene), sweeps_(sweeps), projections_(projections) {
    name = "PGS";
    parameters = std::to_string(sweeps) + " sweeps, " +
                 (projections > 0 ? std::to_string(projections) + " projections" : "Baumgarte");
  }

  void step() override {
    find();
    accelerate(scene_.h);
    warmStart();
    for (int s = 0; s < sweeps_; ++s) {
      for (Touch& c : touches_) {
        double target = c.target;
        if (c.gap > 0) {
          target = c.gap < c.approach * scene_.h ? target : 0.0;
          target = target > 0 ? target : -c.gap / scene_.h;
        } else if (projections_ == 0) {
          target = std::max(target, std::min(-share * c.gap / scene_.h, fastest));
        }
        const double j = std::max(c.jn + c.m_n * (target - normalSpeed(c)), 0.0);
        push(c, j - c.jn);
        c.jn = j;
        stick(c);
      }
    }
    weigh();
    drift(scene_.h);
    for (int s = 0; s < projections_; ++s) {
      for (Touch& c : touches_) {
        place(c);
        if (c.gap < 0) {
          const double way = c.m_n * std::min(-share * c.gap, 0.2 * radius);
          grains_[c.a].x -= (way * grains_[c.a].inverseMass) * c.n;
          grains_[c.b].x += (way * grains_[c.b].inverseMass) * c.n;
        }
      }
    }
  }

 private:
  static constexpr double share = 0.2;  ///< of an overlap that is taken away at a time
  static constexpr double fastest = 3;  ///< [m/s] that Baumgarte's way pushes apart

  int sweeps_;
  int projections_;
};

}  // namespace boxes
