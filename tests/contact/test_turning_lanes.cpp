// Resistance to turning of several rows at once against resistTurning() of each.

#include "support/catch.hpp"
#include <gravel/contact/impulses.hpp>
#include <gravel/contact/turning_lanes.hpp>
#include <gravel/core/random.hpp>

#include <array>
#include <cmath>
#include <vector>

using namespace gravel;
using namespace gravel::test;

// Seen to fail: spinning friction used for rolling; a row that does not press resists; what is within its
// limit not kept; the spins of the two sides exchanged.
TEMPLATE_TEST_CASE("rows side by side resist turning as each does by itself", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  using V = Vector3<S>;
  constexpr std::size_t width = detail::RowGroup<S>::width;
  const CounterRandom random(5);
  std::uint64_t counter = 0;
  const auto one = [&] { return S(random.uniform(counter++, -1, 1)); };
  const auto any = [&] { return V(one(), one(), one()); };
  std::size_t cut = 0;
  std::size_t kept = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<detail::SolverRow<S>> rows(width);
    std::vector<detail::SolverBody<S>> bodies(2 * width);
    std::vector<detail::TurningRow<S>> turning(width);
    std::array<V, width> before;
    std::array<S, width> load;
    detail::RowGroup<S> group;
    for (std::size_t lane = 0; lane < width; ++lane) {
      rows[lane] = {any().normalized(), S(1), S(1), S(0), S(0), S(0)};
      // Of all kinds beside each other: none of it, little, more than is ever reached; masses far apart.
      const auto strength = [&] { return round % 3 == 0 ? S(0) : S(std::pow(S(10), 2 * one())); };
      turning[lane] = {S(0.5) + one() / 4, S(0.5) + one() / 4, strength(), strength()};
      for (const std::size_t end : {lane, lane + width}) {
        bodies[end] = {any(), S(1), any(), std::pow(S(10), 3 * one())};
      }
      before[lane] = any();
      load[lane] = (round + static_cast<int>(lane)) % 5 == 0 ? S(0) : S(1) + one() / 2;
      group.row[lane] = group.slot1[lane] = static_cast<std::uint32_t>(lane);
      group.slot2[lane] = static_cast<std::uint32_t>(lane + width);
      ++group.count;
    }
    auto row = detail::RowLanes<S>::load(rows, group);
    const auto part = [&](int c) {
      return detail::Packed<S>::of([&](std::size_t lane) { return before[lane][c]; });
    };
    row.l = {part(0), part(1), part(2)};
    row.jn = detail::Packed<S>::of([&](std::size_t lane) { return load[lane]; });
    auto b1 = detail::BodyLanes<S>::load(bodies, group.slot1);
    auto b2 = detail::BodyLanes<S>::load(bodies, group.slot2);
    const auto changes = detail::TurningLanes<S>::load(turning, group).resist(row, b1, b2);
    turn(b1, b2, changes);
    for (std::size_t lane = 0; lane < width; ++lane) {
      const auto& [q1, q2, rolling, spinning] = turning[lane];
      const detail::SolverBody<S>& first = bodies[lane];
      const detail::SolverBody<S>& second = bodies[lane + width];
      const V rho = q2 * second.s - q1 * first.s;
      const S mass = 1 / (q1 * q1 * first.spin + q2 * q2 * second.spin);
      const V stops = before[lane] - mass * rho;
      const V l = resistTurning<S>(stops, rows[lane].n, load[lane], rolling, spinning);
      const V ds1 = -(q1 * first.spin) * (l - before[lane]);
      const V ds2 = (q2 * second.spin) * (l - before[lane]);
      const S rounding = 16 * Eigen::NumTraits<S>::epsilon();
      CHECK((row.l.at(lane) - l).norm() <= rounding * stops.norm());
      CHECK((b1.s.at(lane) - first.s - ds1).norm() <=
            rounding * (first.s.norm() + q1 * first.spin * stops.norm()));
      CHECK((b2.s.at(lane) - second.s - ds2).norm() <=
            rounding * (second.s.norm() + q2 * second.spin * stops.norm()));
      CHECK((changes.d_rho.at(lane) - (q2 * ds2 - q1 * ds1)).norm() <= rounding * stops.norm() / mass);
      ((l - stops).norm() <= rounding * stops.norm() ? kept : cut) += 1;
    }
  }
  CHECK(cut > 100 * width);
  CHECK(kept > 10 * width);
}
