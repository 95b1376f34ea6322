#pragma once

/// \file
/// The first look at pairs that may touch in a step: how far each sphere gets.

#include <gravel/contact/contact.hpp>
#include <gravel/contact/contact_bodies.hpp>
#include <gravel/contact/impulses.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/spatial/domain.hpp>
#include <gravel/spatial/strays.hpp>

#include <vector>

namespace gravel::detail {

/// Place and reach of every body, side by side: few of the pairs of neighbours get near each other in a step,
/// and for the others nothing else is loaded.
template <Real S>
class SweptSpheres {
 public:
  /// No body gets further from where it starts than |v| h + |a| h^2/8, with the acceleration a of its course
  /// and at most twice that of forces more, by what holds it; h^2/2 leaves room. A plane that goes on
  /// speeding up by A into what leans on it holds it with 2 A besides. Without walls v is less what most
  /// bodies have in common: a pile in orbit has no more pairs to look at than one at rest. O(N).
  ///
  /// \param scene `bodies`, their `course` with its mean velocity and acceleration, and `walls`
  /// \param h [s]
  template <class Scene>
  void gather(const Scene& scene, const S& h) {
    spheres_.resize(scene.bodies.size());
    common_.setZero();
    if (scene.walls.empty()) {
      common_ = commonWay<S>(spheres_.size(), [&](std::size_t i) {
        return isMovable(scene.bodies, i) ? Vector3<S>(scene.course.velocity(scene.bodies, i))
                                          : Vector3<S>(Vector3<S>::Zero());
      });
    }
    lost_ = S(8) * roundoff<S>() * h * safeNorm(common_);
    standing_ = lost_ + h * safeNorm(common_);
    parallelFor(spheres_.size(), chunk,
                [&](std::size_t k) { renew(scene, static_cast<std::uint32_t>(k), h); });
    wallWays_.clear();
    for (const HalfSpace<S>& wall : scene.walls) {
      wallWays_.push_back(h * sumAbs(wall.velocity));
    }
  }

  /// They are of no use any more.
  void forget() { giveBack(spheres_); }

  /// The course of body i is another one now.
  template <class Scene>
  [[gnu::flatten]] void renew(const Scene& scene, std::uint32_t i, const S& h) {
    S way = standing_;
    if (isMovable(scene.bodies, i)) {
      way = lost_ + h * safeNorm(Vector3<S>(scene.course.velocity(scene.bodies, i) - common_)) +
            h * h / S(2) *
                (sumAbs(Vector3<S>(scene.course.acceleration(scene.bodies, i))) +
                 sumAbs(Vector3<S>(scene.bodies.accelerations()[i])));
      if constexpr (requires { scene.support.carried(i); }) {
        way += h * h / S(4) * scene.support.carried(i);
      }
    }
    spheres_[i] = {scene.bodies.positions()[i], S(scene.bodies.radii()[i]) + way};
  }

  /// \param time [s]  \param h [s]
  /// \param r, drift  out: [m] from the first to the nearest image of the second, [m s^-1] of that image
  [[gnu::always_inline]] bool mayMeet(std::uint32_t i, std::uint32_t j, const Domain<S>& domain,
                                      const S& time, const S& h, Vector3<S>& r, Vector3<S>& drift) const {
    r = spheres_[j].x - spheres_[i].x;
    S far = spheres_[i].reach + spheres_[j].reach;
    drift = Vector3<S>::Zero();
    if (!domain.isOpen()) {
      domain.minimumImage(r, drift, time);
      far += h * sumAbs(drift);
    }
    return !(r.squaredNorm() > far * far);
  }

  /// \param w number of the wall in the scene
  bool mayMeet(std::uint32_t i, const HalfSpace<S>& wall, std::uint32_t w) const {
    return !(wall.normal.dot(spheres_[i].x) - wall.offset > spheres_[i].reach + wallWays_[w]);
  }

 private:
  static constexpr std::size_t chunk = 512;

  /// In double half a cache line.
  struct alignas(alignof(S) > 32 ? alignof(S) : 32) Sphere {
    Vector3<S> x;
    S reach;
  };
  std::vector<Sphere> spheres_;
  Vector3<S> common_ = Vector3<S>::Zero();  ///< [m s^-1]
  S lost_ = S(0);                           ///< [m] by rounding where it is subtracted
  S standing_ = S(0);                       ///< [m] way of what is fixed
  std::vector<S> wallWays_;                 ///< [m]
};

}  // namespace gravel::detail
