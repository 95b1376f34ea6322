// Resistance to turning: of several rows at once against that of each by itself, and beside friction in
// closed form against the two by turns.

#include "support/catch.hpp"
#include <gravel/contact/slip_and_turn.hpp>
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
    const auto no = row.jn < row.jn;
    detail::RowChanges<S> rubbed;
    const auto changes = detail::TurningLanes<S>::load(turning, group)
                             .rubAndResist(row, b1, b2, detail::PackedVector<S>::zero(), {no, no}, rubbed);
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

namespace {

// A contact with all that friction and resistance know of it.
template <class S>
struct SlippingAndTurning {
  using V = Vector3<S>;
  detail::SolverRow<S> row;
  detail::TurningRow<S> turning;
  detail::SolverBody<S> one, two;
  S jn;

  /// Coefficients of 1e-2 to 1e2, k of 1/50 to 1/2, masses and arms that differ. \param one01 in [-1, 1)
  template <class One>
  static SlippingAndTurning of(One&& one01) {
    SlippingAndTurning contact;
    const auto any = [&] { return V(one01(), one01(), one01()); };
    const auto strength = [&] { return S(std::pow(S(10), 2 * one01())); };
    const auto body = [&] {
      const S inverseMass = std::pow(S(10), one01());
      return detail::SolverBody<S>{any(), inverseMass, any(), S(inverseMass * 10 * std::pow(S(5), one01()))};
    };
    const S stick = strength();
    contact.row = {any().normalized(),
                   S(1) + one01() / 8,
                   S(1) + one01() / 8,
                   S(0),
                   stick,
                   stick * (S(0.75) + one01() / 4)};
    const S q = S(0.5) + one01() / 4;
    contact.turning = {q, S(1) - q, strength(), strength()};
    contact.one = body();
    contact.two = body();
    contact.jn = S(1) + one01() / 2;
    return contact;
  }
  V slip() const {
    const V v = two.v - one.v;
    return detail::slipVelocity(row, v, S(row.n.dot(v)), one, two);
  }
  V rho() const { return turning.q2 * two.s - turning.q1 * one.s; }
  detail::SlipAndTurn<S> mobility() const {
    return detail::SlipAndTurn<S>::of(one.inverseMass + two.inverseMass, row.c1, turning.q1, one.spin, row.c2,
                                      turning.q2, two.spin);
  }
  GripImpulses<S> stopped() const {
    return gripImpulses<S>(mobility(), slip(), rho(), row.n, jn,
                           {row.stick, row.slide, turning.rolling, turning.spinning}, S(0));
  }
  /// Bodies after these.
  SlippingAndTurning after(const V& j, const V& l) const {
    SlippingAndTurning next = *this;
    next.one.v -= one.inverseMass * j;
    next.two.v += two.inverseMass * j;
    const V turn = row.n.cross(j);
    next.one.s -= one.spin * V(row.c1 * turn + turning.q1 * l);
    next.two.s -= two.spin * V(row.c2 * turn - turning.q2 * l);
    return next;
  }
  bool atLimit(const V& impulse, const S& most) const {
    const S across = V(impulse - row.n.dot(impulse) * row.n).norm();
    return std::abs(across - most * jn) < S(1e-5) * most * jn;
  }
};

}  // namespace

// Seen to fail: the sign of X turned; the turn cut by the limit of friction; D = A C.
TEMPLATE_TEST_CASE("Friction and resistance that stop slip and turn together are those of many turns", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  using V = Vector3<S>;
  const CounterRandom random(6);
  std::uint64_t counter = 0;
  std::array<int, 4> seen{};
  for (int round = 0; round < 1000; ++round) {
    auto contact = SlippingAndTurning<S>::of([&] { return S(random.uniform(counter++, -1, 1)); });
    contact.row.slide = contact.row.stick;  // else several may be right
    const V& n = contact.row.n;
    const auto m = contact.mobility();
    V j = V::Zero(), l = V::Zero();
    V last = V::Ones();
    for (int turn = 0; turn < 2500 && last != l; ++turn) {  // 0.98^2500 = 1e-22
      const V none = V::Zero();
      last = l;
      j = clampToCone<S>(V(contact.after(none, l).slip() / -m.slip), contact.jn, contact.row.stick,
                         contact.row.slide);
      l = resistTurning<S>(V(contact.after(j, none).rho() / -m.turn), n, contact.jn, contact.turning.rolling,
                           contact.turning.spinning);
    }
    const auto [stopping, turning] = contact.stopped();
    // What the rounding of speeds, also of those on the way, does to the impulses that would stop them.
    const S speed = contact.slip().norm() + contact.rho().norm() + m.slip * j.norm() + m.turn * l.norm();
    const S rounding = 16 * Eigen::NumTraits<S>::epsilon() * speed * (m.slip + m.turn) / m.det;
    CAPTURE(round, (stopping - j).norm() / rounding, (turning - l).norm() / rounding);
    CHECK((stopping - j).norm() <= rounding);
    CHECK((turning - l).norm() <= rounding);
    const std::size_t slides = contact.atLimit(j, contact.row.stick) ? 1 : 0;
    const std::size_t rolls = contact.atLimit(l, contact.turning.rolling) ? 2 : 0;
    seen[slides + rolls] += 1;
  }
  for (const int cases : seen) {
    CHECK(cases > 20);
  }
}

// Where static friction is more than kinetic, several may be right. Seen to fail: the static limit wherever
// both come to theirs, which takes turns between sticking and sliding.
TEMPLATE_TEST_CASE("Friction and resistance that stop slip and turn obey the laws of both", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  using V = Vector3<S>;
  const CounterRandom random(8);
  std::uint64_t counter = 0;
  std::array<int, 4> seen{};
  const auto one = [&] { return S(random.uniform(counter++, -1, 1)); };
  for (int round = 0; round < 20'000; ++round) {
    auto contact = SlippingAndTurning<S>::of(one);
    // Coefficients of grains, where both limits often bind.
    contact.row.stick = S(0.5) + one() * S(0.4);
    contact.row.slide = contact.row.stick * S(2) / S(3);
    contact.turning.rolling = S(0.5) + one() * S(0.4);
    const auto m = contact.mobility();
    const V& n = contact.row.n;
    const auto [j, resisting] = contact.stopped();
    const V l = resisting - n.dot(resisting) * n;
    const auto after = contact.after(j, resisting);
    const V slip = after.slip();
    const V rho = after.rho() - n.dot(after.rho()) * n;
    const S speed = contact.slip().norm() + contact.rho().norm() + m.slip * j.norm() + m.turn * l.norm();
    const S little = 4096 * Eigen::NumTraits<S>::epsilon() * speed;
    CAPTURE(round, slip.norm(), rho.norm());
    const auto obeys = [&](const V& impulse, const V& left, const S& most, const S& kept) {
      const S along = kept * contact.jn * left.norm();
      return (left.norm() <= little && impulse.norm() <= most * contact.jn * (1 + S(1e-5))) ||
             (contact.atLimit(impulse, kept) &&
              std::abs(impulse.dot(left) + along) <= S(1e-6) * along + little * kept * contact.jn);
    };
    CHECK(obeys(j, slip, contact.row.stick, contact.row.slide));
    if (slip.norm() > little) {  // as more than the static limit would stop it
      auto rough = contact;
      rough.row.stick = S(1e6);
      CHECK(rough.stopped().tangential.norm() > contact.row.stick * contact.jn * (1 - S(1e-5)));
    }
    CHECK(obeys(l, rho, contact.turning.rolling, contact.turning.rolling));
    seen[(slip.norm() <= little ? 0U : 1U) + (rho.norm() <= little ? 0U : 2U)] += 1;
  }
  for (const int cases : seen) {
    CHECK(cases > 100);
  }
}

// Seen to fail: impulses that rows have already left out; the static limit for the kinetic one; a change of
// the slip by friction alone; where each acts by itself, the turn before friction.
TEMPLATE_TEST_CASE("rows side by side stop slip and turn as each does by itself", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  using V = Vector3<S>;
  using P = detail::Packed<S>;
  constexpr std::size_t width = detail::RowGroup<S>::width;
  const CounterRandom random(7);
  std::uint64_t counter = 0;
  const auto one = [&] { return S(random.uniform(counter++, -1, 1)); };
  std::size_t both = 0;
  std::size_t right = 0;
  for (int round = 0; round < 500; ++round) {
    std::vector<SlippingAndTurning<S>> contacts;
    std::vector<detail::SolverRow<S>> rows;
    std::vector<detail::SolverBody<S>> bodies(2 * width);
    std::vector<detail::TurningRow<S>> turning;
    std::vector<V> j, l;
    detail::RowGroup<S> group;
    for (std::size_t lane = 0; lane < width; ++lane) {
      contacts.push_back(SlippingAndTurning<S>::of(one));
      const auto& contact = contacts.back();
      rows.push_back(contact.row);
      turning.push_back(contact.turning);
      // What they have of an earlier sweep, within its limits.
      const V any(one(), one(), one());
      const V t = any - contact.row.n.dot(any) * contact.row.n;
      j.push_back(contact.row.slide * contact.jn / 2 * t);
      l.push_back(contact.turning.rolling * contact.jn / 2 * t.cross(contact.row.n));
      const auto now = contact.after(j.back(), l.back());
      bodies[lane] = now.one;
      bodies[lane + width] = now.two;
      group.row[lane] = group.slot1[lane] = static_cast<std::uint32_t>(lane);
      group.slot2[lane] = static_cast<std::uint32_t>(lane + width);
      ++group.count;
    }
    auto row = detail::RowLanes<S>::load(rows, group);
    const auto lanes = [&](auto&& of) {
      const auto part = [&](int c) { return P::of([&](std::size_t lane) { return of(lane)[c]; }); };
      return detail::PackedVector<S>{part(0), part(1), part(2)};
    };
    row.jt = lanes([&](std::size_t lane) { return j[lane]; });
    row.l = lanes([&](std::size_t lane) { return l[lane]; });
    row.jn = P::of([&](std::size_t lane) { return contacts[lane].jn; });
    auto b1 = detail::BodyLanes<S>::load(bodies, group.slot1);
    auto b2 = detail::BodyLanes<S>::load(bodies, group.slot2);
    const auto slip = lanes([&](std::size_t lane) { return contacts[lane].after(j[lane], l[lane]).slip(); });
    const auto no = row.jn < row.jn;
    detail::RowChanges<S> changes;
    const auto turned =
        detail::TurningLanes<S>::load(turning, group).rubAndResist(row, b1, b2, slip, {!no, no}, changes);
    push(b1, b2, changes.dt);
    twist(row, b1, b2, changes.dt);
    turn(b1, b2, turned);
    for (std::size_t lane = 0; lane < width; ++lane) {
      const auto& contact = contacts[lane];
      const auto [stopping, resisting] = contact.stopped();
      const bool limits =
          contact.atLimit(stopping, contact.row.slide) && contact.atLimit(resisting, contact.turning.rolling);
      CHECK(turned.right[lane] == !limits);
      both += limits ? 1U : 0U;
      const auto after = contact.after(row.jt.at(lane), row.l.at(lane));
      const S size = stopping.norm() + resisting.norm() + j[lane].norm() + l[lane].norm();
      const S rounding = 256 * Eigen::NumTraits<S>::epsilon();
      const S speed = 1 + size * (contact.one.spin + contact.two.spin);
      CHECK((b1.v.at(lane) - after.one.v).norm() <= rounding * speed);
      CHECK((b2.v.at(lane) - after.two.v).norm() <= rounding * speed);
      CHECK((b1.s.at(lane) - after.one.s).norm() <= rounding * speed);
      CHECK((b2.s.at(lane) - after.two.s).norm() <= rounding * speed);
      CHECK((changes.dt.at(lane) - V(row.jt.at(lane) - j[lane])).norm() <= rounding * size);
      if (turned.right[lane]) {
        ++right;
        CHECK((row.jt.at(lane) - stopping).norm() <= rounding * size);
        CHECK((row.l.at(lane) - resisting).norm() <= rounding * size);
        CHECK((changes.du.at(lane) - V(after.slip() - slip.at(lane))).norm() <= rounding * speed);
        CHECK(changes.slides[lane] == contact.atLimit(stopping, contact.row.slide));
      } else {  // one after the other
        const auto m = contact.mobility();
        const V j1 = clampToCone<S>(V(j[lane] - slip.at(lane) / m.slip), contact.jn, contact.row.stick,
                                    contact.row.slide);
        const V l1 = resistTurning<S>(V(l[lane] - contact.after(j1, l[lane]).rho() / m.turn), contact.row.n,
                                      contact.jn, contact.turning.rolling, contact.turning.spinning);
        CHECK((row.jt.at(lane) - j1).norm() <= rounding * size);
        CHECK((row.l.at(lane) - l1).norm() <= rounding * size);
      }
    }
  }
  CHECK(both > 10 * width);
  CHECK(right > 100 * width);
}

// At the end of its sweeps a contact at its limit is held against the mean of its slips before and after,
// here at an angle a of 1/100, up to what the square of the cosine leaves out: a^3/4. Seen to fail: friction,
// and each of four resistances, against the slip that is left alone (of the order of a/2).
TEMPLATE_TEST_CASE("rows that slid and turned before are held against the mean of both slips", "",
                   GRAVEL_TEST_TYPES(double, long double)) {
  using S = TestType;
  using V = Vector3<S>;
  using P = detail::Packed<S>;
  const CounterRandom random(9);
  std::uint64_t counter = 0;
  const auto one = [&] { return S(random.uniform(counter++, -1, 1)); };
  std::array<std::size_t, 4> seen{};
  for (int round = 0; round < 2000; ++round) {
    auto contact = SlippingAndTurning<S>::of(one);
    contact.row.stick = contact.row.slide = S(0.2) + one() * S(0.15);
    contact.turning.rolling = S(0.2) + one() * S(0.15);
    const V& n = contact.row.n;
    const auto acrossOf = [&](const V& v) { return V(v - n.dot(v) * n); };
    const auto turned = [&](const V& v) { return V(v + S(0.01) * n.cross(v)); };
    const V slip0 = turned(contact.slip());
    const V rho0 = turned(acrossOf(contact.rho()));
    const std::vector<detail::SolverRow<S>> rows{contact.row};
    const std::vector<detail::TurningRow<S>> turning{contact.turning};
    std::vector<detail::SolverBody<S>> bodies{contact.one, contact.two, {V::Zero(), S(0), V::Zero(), S(0)}};
    detail::RowGroup<S> group;
    group.row[0] = group.slot1[0] = 0;
    group.slot2[0] = 1;
    group.count = 1;
    group.fill(2);
    const auto all = [](const V& v) {
      return detail::PackedVector<S>{P::all(v[0]), P::all(v[1]), P::all(v[2])};
    };
    auto row = detail::RowLanes<S>::load(rows, group);
    row.jn = P::all(contact.jn);
    const auto no = row.jn < row.jn;
    auto b1 = detail::BodyLanes<S>::load(bodies, group.slot1);
    auto b2 = detail::BodyLanes<S>::load(bodies, group.slot2);
    for (int sweep = 0; sweep < 2500; ++sweep) {
      const auto v = b2.v - b1.v;
      detail::RowChanges<S> changes;
      const auto resisted = detail::TurningLanes<S>::load(turning, group)
                                .rubAndResist(row, b1, b2, slipVelocity(row, v, row.n.dot(v), b1, b2),
                                              {!no, no, row.jn, all(slip0), all(rho0)}, changes);
      push(b1, b2, changes.dt);
      twist(row, b1, b2, changes.dt);
      turn(b1, b2, resisted);
    }
    const V j = row.jt.at(0);
    const V l = row.l.at(0);
    const auto after = contact.after(j, l);
    const V slip = after.slip();
    const V rho = acrossOf(after.rho());
    // Those that turn by less than the bound below allows for.
    const auto near = [](const V& a, const V& b) {
      return a.cross(b).norm() < S(0.04) * a.norm() * b.norm();
    };
    const auto against = [](const V& impulse, const V& mean) {
      return V(impulse.normalized() + mean.normalized()).norm();
    };
    CAPTURE(round);
    const bool slides = contact.atLimit(j, contact.row.slide) && slip.dot(slip0) > 0 && near(slip, slip0);
    const bool rolls = contact.atLimit(l, contact.turning.rolling) && rho.dot(rho0) > 0 && near(rho, rho0);
    if (slides) {
      CHECK(against(j, V(slip + slip0)) < S(2e-5));
    }
    if (rolls) {
      CHECK(against(acrossOf(l), V(rho + rho0)) < S(2e-5));
    }
    seen[(slides ? 1U : 0U) + (rolls ? 2U : 0U)] += 1;
  }
  for (const std::size_t cases : seen) {
    CHECK(cases > 10);
  }
}

// Seen to fail: the product of both squares, whose inverse leaves the range of
// numbers.
TEMPLATE_TEST_CASE("a slide is held against the mean of both slips however slow it is", "",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  using S = TestType;
  using P = detail::Packed<S>;
  const S least = std::numeric_limits<S>::min();
  for (S slow(1); slow > 0; slow /= 3) {
    for (const S& before : {slow, S(1)}) {
      const detail::PackedVector<S> wanted{P::all(-slow), P::all(slow / 8), P::zero()};
      const detail::PackedVector<S> then{P::all(before), P::zero(), P::zero()};
      const auto against = detail::againstBoth(wanted, P::all(S(1)), then);
      CAPTURE(slow, before);
      CHECK(std::isfinite(against.x[0]));
      CHECK(against.x[0] <= 0);
      if (slow * slow > 4 * least) {
        CHECK(std::abs(against.x[0] - (-slow - before * S(64) / S(65))) <=
              8 * Eigen::NumTraits<S>::epsilon() * (slow + before));
      }
    }
  }
}
