#pragma once

/// \file
/// What sweeps over the rows of a ContactProblem go on with from one to the next: steps of impulses, and of
/// the velocities that follow them.

#include <gravel/contact/contact_problem.hpp>

#include <vector>

namespace gravel::detail {

template <Real S>
class SweepMomentum {
 public:
  using Group = RowGroup<S>;

  /// Of the impulses of some rows.
  struct Step {
    Packed<S> n = Packed<S>::zero();
    PackedVector<S> t = PackedVector<S>::zero();
    PackedVector<S> l = PackedVector<S>::zero();  ///< against turning
    [[gnu::always_inline]] friend inline Step operator*(const S& beta, const Step& step) {
      const Packed<S> by = Packed<S>::all(beta);
      return {by * step.n, by * step.t, by * step.l};
    }
    [[gnu::always_inline]] friend inline Step operator+(const Step& a, const Step& b) {
      return {a.n + b.n, a.t + b.t, a.l + b.l};
    }
  };

  /// Steps are kept from here on, from none and from the present velocities.
  void begin(const ContactProblem<S>& problem) {
    steps_.assign(problem.rows.size(), Quad{});
    turns_.assign(problem.turning.size(), Quad{});
    resizeAnew(swept_, problem.bodies.size());
    parallelFor(problem.bodies.size(), chunk, [&](std::size_t slot) {
      swept_[slot] = BodySwept{problem.bodies[slot].v, problem.bodies[slot].s};
    });
  }

  /// They are of no use any more.
  void end() {
    giveBack(steps_);
    giveBack(turns_);
    giveBack(swept_);
  }

  /// Velocities follow the impulses beyond their last step, by this share: they are linear in the impulses.
  void coast(ContactProblem<S>& problem, const S& beta) {
    parallelFor(problem.bodies.size(), chunk, [&](std::size_t slot) {
      BodySwept& last = swept_[slot];
      SolverBody<S>& b = problem.bodies[slot];
      const Vector3<S> dv = b.v - last.v;
      last.v = b.v;
      b.v += beta * dv;
      if (problem.friction) {
        const Vector3<S> ds = b.s - last.s;
        last.s = b.s;
        b.s += beta * ds;
      }
    });
  }

  [[gnu::always_inline]] inline Step load(const Group& group) const {
    const PackedQuad<S> push = at(steps_, group);
    return {push.w, PackedVector<S>::of(push),
            turns_.empty() ? PackedVector<S>::zero() : PackedVector<S>::of(at(turns_, group))};
  }
  [[gnu::always_inline]] inline void store(const Group& group, const Step& step) {
    put(steps_, group, {step.t.x, step.t.y, step.t.z, step.n});
    if (!turns_.empty()) {
      put(turns_, group, {step.l.x, step.l.y, step.l.z, Packed<S>::zero()});
    }
  }

 private:
  static constexpr std::size_t chunk = 512;

  struct Quad {
    Vector3<S> vector = Vector3<S>::Zero();
    S number = S(0);
  };
  /// A body's velocities at the end of the last sweep.
  struct BodySwept {
    Vector3<S> v;
    Vector3<S> s;
  };

  [[gnu::always_inline]] static inline PackedQuad<S> at(const std::vector<Quad>& all, const Group& group) {
    return PackedQuad<S>::load([&](std::size_t lane) { return quadOf<S>(all[group.row[lane]], 0); });
  }
  [[gnu::always_inline]] static inline void put(std::vector<Quad>& all, const Group& group,
                                                const PackedQuad<S>& quad) {
    quad.store([&](std::size_t lane) { return quadOf<S>(all[group.row[lane]], 0); },
               [&](std::size_t lane) { return group.holds(lane); });
  }

  std::vector<BodySwept> swept_;
  std::vector<Quad> steps_;  ///< by row
  std::vector<Quad> turns_;  ///< against turning, if anything resists that
};

}  // namespace gravel::detail
