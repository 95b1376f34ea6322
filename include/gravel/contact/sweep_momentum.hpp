#pragma once

/// \file
/// What sweeps over the rows of a ContactProblem go on with from one to the next: steps of impulses, and of
/// the velocities that follow them.

#include <gravel/contact/contact_problem.hpp>

#include <algorithm>
#include <utility>
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
    [[gnu::always_inline]] friend inline Step operator*(const Packed<S>& by, const Step& step) {
      return {by * step.n, by * step.t, by * step.l};
    }
    [[gnu::always_inline]] friend inline Step operator+(const Step& a, const Step& b) {
      return {a.n + b.n, a.t + b.t, a.l + b.l};
    }
  };

  /// Steps of rows [begin, end) are kept from here on, from none and from the present velocities of these
  /// slots.
  void begin(const ContactProblem<S>& problem, std::size_t begin, std::size_t end,
             std::span<const std::uint32_t> slots) {
    beginRows(problem, begin, end);
    swept_.clear();
    for (const std::uint32_t slot : slots) {
      swept_.push_back(BodySwept{problem.bodies[slot].v, problem.bodies[slot].s});
    }
  }
  /// Those of rows from `begin` on, and of all slots, by all threads.
  void begin(const ContactProblem<S>& problem, std::size_t begin) {
    beginRows(problem, begin, problem.rows.size());
    resizeAnew(swept_, problem.bodies.size());
    parallelFor(problem.bodies.size(), chunk, [&](std::size_t slot) {
      swept_[slot] = BodySwept{problem.bodies[slot].v, problem.bodies[slot].s};
    });
  }

  /// Sweeps are over. After many that went without, as in a heap at rest, no room is kept; after few it is,
  /// for of the two solves of a step often one alone goes with it.
  void end() {
    idle_ = std::exchange(begun_, false) ? 0 : std::min(idle_ + 1, mostIdle);
    const auto leave = [keeps = idle_ < mostIdle](auto& list) { keeps ? giveBack(list) : release(list); };
    leave(steps_);
    leave(turns_);
    leave(swept_);
  }

  /// Velocities follow the impulses beyond their last step, by this share: they are linear in the impulses.
  void coast(ContactProblem<S>& problem, const S& share) {
    parallelFor(problem.bodies.size(), chunk,
                [&](std::size_t slot) { coast(problem, slot, swept_[slot], share); });
  }
  /// Those of the slots of begin(). \param shareOf  the number of a slot among them
  template <class ShareOf>
  void coast(ContactProblem<S>& problem, std::span<const std::uint32_t> slots, ShareOf&& shareOf) {
    for (std::size_t i = 0; i < slots.size(); ++i) {
      coast(problem, slots[i], swept_[i], shareOf(i));
    }
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
  static constexpr int mostIdle = 8;

  struct Quad {
    Vector3<S> vector = Vector3<S>::Zero();
    S number = S(0);
  };
  /// A body's velocities at the end of the last sweep.
  struct BodySwept {
    Vector3<S> v;
    Vector3<S> s;
  };

  void beginRows(const ContactProblem<S>& problem, std::size_t begin, std::size_t end) {
    begun_ = true;
    first_ = begin;
    assignSparingly(steps_, end - begin, Quad{});
    assignSparingly(turns_, problem.turning.empty() ? 0 : end - begin, Quad{});
  }

  static void coast(ContactProblem<S>& problem, std::size_t slot, BodySwept& last, const S& share) {
    SolverBody<S>& b = problem.bodies[slot];
    const Vector3<S> dv = b.v - last.v;
    last.v = b.v;
    b.v += share * dv;
    if (problem.friction) {
      const Vector3<S> ds = b.s - last.s;
      last.s = b.s;
      b.s += share * ds;
    }
  }

  [[gnu::always_inline]] inline PackedQuad<S> at(const std::vector<Quad>& all, const Group& group) const {
    return PackedQuad<S>::load([&](std::size_t lane) { return quadOf<S>(all[group.row[lane] - first_], 0); });
  }
  [[gnu::always_inline]] inline void put(std::vector<Quad>& all, const Group& group,
                                         const PackedQuad<S>& quad) const {
    quad.store([&](std::size_t lane) { return quadOf<S>(all[group.row[lane] - first_], 0); },
               [&](std::size_t lane) { return group.holds(lane); });
  }

  bool begun_ = false;            ///< since the last end()
  int idle_ = 0;                  ///< calls of end() without, up to mostIdle
  std::size_t first_ = 0;         ///< row
  std::vector<BodySwept> swept_;  ///< by slot, or by place among those of begin()
  std::vector<Quad> steps_;       ///< by row
  std::vector<Quad> turns_;       ///< against turning, if anything resists that
};

}  // namespace gravel::detail
