#include "laws/laws.hpp"
#include "space/patch_momentum.hpp"
#include "support/catch.hpp"
#include "support/temporary_file.hpp"
#include <gravel/core/random.hpp>

// A patch of a disc in Hill's frame: shear-periodic, moved by the symplectic epicycle integrator.

using namespace gravel;
using namespace gravel::test;

namespace test_shearing_patch {

namespace {

const double omega = 1.0;
const Vec box(12, 14, 16);

SimulationConfig<double> patchConfig(double dt) {
  SimulationConfig<double> config = plain(dt);
  config.integrator = IntegratorKind::SymplecticEpicycle;
  config.coeffRestitution = 0.5;
  return config;
}

Space<double> patch(double dt, double friction = 0.0) {
  SimulationConfig<double> config = patchConfig(dt);
  config.coeffFriction = config.coeffStaticFriction = friction;
  Space<double> space(config);
  space.setDomain(Domain<double>::shearPeriodic(box, omega));
  return space;
}

/// The velocity of the flow at x.
Vec flow(const Vec& x) { return {0, -1.5 * omega * x[0], 0}; }

/// n balls in the flow, with random velocities besides; none overlap at the start.
void fill(Space<double>& space, std::uint64_t n, double speed) {
  const CounterRandom random(9);
  for (std::uint64_t i = 0; i < n; ++i) {
    const Vec x(2.9 * double(i % 4) - 4.4, 2.7 * double(i / 4 % 5) - 5.5, 2.5 * double(i / 20) - 2.4);
    space.addBody(ball(x, flow(x) + speed * random.direction(i), 1.0, 1.0 + double(i % 3),
                       0.5 * random.direction(i + 1000)));
  }
}

/// A ball of radius 1 on its own epicycle.
struct Flyer {
  Vec x = Vec::Zero();
  Vec v = Vec::Zero();
  Vec w = Vec::Zero();
  Quaternion<double> q = Quaternion<double>::Identity();

  void move(double t) {
    const Epicycle<double> epicycle(HillFrame<double>(Domain<double>::shearPeriodic({1e4, 1e4, 1e4}, omega)),
                                    t);
    Vec dx, dv;
    epicycle.increments(x, v, dx, dv);
    x += dx;
    v += dv;
    epicycle.turn(q, w);
  }
};

/// Walton's blow on two balls that touch, restitution 0.5, of masses 1 and m; m = infinity stays as it is.
void strike(Flyer& one, Flyer& two, double m, double friction) {
  const Vec n = (two.x - one.x).normalized();
  const Vec u = two.v - one.v;
  const double v_n = n.dot(u);
  const Vec slip = u - v_n * n - (one.w + two.w).cross(n);
  const double effective = 1 / (1 + 1 / m);
  const double normal = -1.5 * effective * v_n;
  Vec tangential = -2.0 / 7.0 * effective * slip;
  if (tangential.norm() > friction * normal) {
    tangential *= friction * normal / tangential.norm();
  }
  const Vec j = normal * n + tangential;
  one.v -= j;
  two.v += j / m;
  one.w -= 2.5 * n.cross(j);
  two.w -= 2.5 / m * n.cross(j);
}

}  // namespace

TEST_CASE("A shear-periodic domain needs the integrator of its frame, and is refused with any other") {
  Space<double> other(plain(1e-3));
  CHECK_THROWS_WITH(other.setDomain(Domain<double>::shearPeriodic(box, omega)),
                    ContainsSubstring("shear-periodic") && ContainsSubstring("VelocityVerlet") &&
                        ContainsSubstring("SymplecticEpicycle"));
  CHECK(other.domain().isOpen());
  Space<double> space = patch(1e-3);
  CHECK_THROWS_WITH(Domain<double>::shearPeriodic(box, omega, HUGE_VAL),
                    ContainsSubstring("vertical frequency") && ContainsSubstring("inf"));
}

TEST_CASE("In an open domain the epicycle integrator is velocity Verlet, to the bit") {
  const auto run = [](IntegratorKind kind) {
    SimulationConfig<double> config = plain(1e-2);
    config.integrator = kind;
    Space<double> space(config);
    space.setUniformField({0, 0, -1});
    space.addPlane({0, 0, 1}, -6);
    fill(space, 40, 1.0);
    advance(space, 200);
    return stateOf(space);
  };
  CHECK(sameBits(run(IntegratorKind::VelocityVerlet), run(IntegratorKind::SymplecticEpicycle)));
}

TEST_CASE("A lone body follows its epicycle across the sheared edges, and its energy is booked") {
  Space<double> space = patch(0.01);
  const Vec x0(5, 1, 2), v0(0.8, -6.9, 0.4);
  space.addBody(ball(x0, v0, 0.1, 2.0));
  const double before = space.energyLedger().total();
  advance(space, 2000);
  const double t = space.time();
  const double centre = 4 * x0[0] + 2 * v0[1];
  const double amplitude = 3 * x0[0] + 2 * v0[1];
  const Vec x(centre - amplitude * std::cos(t) + v0[0] * std::sin(t),
              x0[1] - 2 * v0[0] + 2 * amplitude * std::sin(t) + 2 * v0[0] * std::cos(t) - 1.5 * centre * t,
              x0[2] * std::cos(t) + v0[2] * std::sin(t));
  // The same place up to the boxes that it was brought back by.
  const Vec r = space.domain().minimumImage(Vec(space.body(0).position() - x), t);
  CHECK(r.norm() < 1e-10);
  CHECK(space.body(0).position().cwiseAbs().maxCoeff() <= 8.0);
  CHECK(std::abs(space.energyLedger().work) > 1.0);  // x swings by 1.6 about 6.2: it crossed the edge
  CHECK_THAT(space.energyLedger().total(), WithinAbs(before, 1e-11));
}

// Every body gains or loses an image: all of it is the same patch.
TEST_CASE("Bodies seen as other images of themselves move alike") {
  const auto run = [](bool images) {
    Space<double> space = patch(0.01, 0.4);
    fill(space, 60, 1.5);
    for (std::size_t i = 0; images && i < space.n(); ++i) {
      const double k = double(i % 3) - 1.0;
      space.body(i).position() += Vec(k * box[0], double(i % 2) * box[1], 0);
      space.body(i).velocity()[1] -= k * space.domain().shearSpeed();
    }
    advance(space, 150);
    return space;
  };
  const Space<double> one = run(false);
  const Space<double> two = run(true);
  CHECK(one.energyLedger().restitution > 1.0);
  const double worst = largestDifference(one, two);
  // 1e-15 of rounding, grown by the few collisions each body had.
  CHECK(worst < 1e-9);
}

// With u the velocity less the flow, (u_x, 2 u_y) turns with Omega and shrinks as exp(-c t). Seen to fail:
// damped towards rest in the frame (the first one went 0.8 and 9.6 m off).
TEST_CASE("What rests in the flow of a patch is not damped, and what moves in it loses that motion alone") {
  for (const double c : {0.1, 1.0}) {
    Space<double> space = patch(0.01);
    space.setLinearDamping(c);
    space.addBody(ball({4, 0, 0}, flow({4, 0, 0}), 0.1));
    space.addBody(ball({-4, 3, 0}, {0.3, 5.5, 0}, 0.1));
    const auto motion = [&](std::size_t i) {
      const Vec u = Vec(space.body(i).velocity()) - flow(space.body(i).position());
      return std::hypot(u[0], 2 * u[1]);
    };
    const double moving = motion(1);
    const double start = space.energyLedger().total();
    advance(space, 500);
    CAPTURE(c);
    CHECK(std::abs(space.body(0).position()[0] - 4) < 1e-12);
    CHECK(motion(0) < 1e-12);
    CHECK_THAT(motion(1), WithinRel(std::exp(-c * space.time()) * moving, 1e-11));
    CHECK_THAT(space.energyLedger().total(), WithinAbs(start, 1e-11));
  }
}

// Seen to fail: the step was found to be too long when reports of the last one were gone; check() without it.
TEST_CASE("A step in which a patch turns by too much is refused, and leaves the space as it was") {
  Space<double> space = patch(0.01);
  space.addBody(ball({-0.505, 0, 0}, {1, 0, 0}, 0.5));
  space.addBody(ball({0.505, 0, 0}, {-1, 0, 0}, 0.5));
  advance(space, 1);
  REQUIRE(space.impacts().size() == 1);
  space.setTimeStep(1e8);
  const Vec x = space.body(0).position();
  CHECK_THROWS_WITH(space.check(), ContainsSubstring("turn of the frame in a step"));
  CHECK_THROWS_WITH(space.computeDynamics(1), ContainsSubstring("turn of the frame in a step"));
  CHECK(space.impacts().size() == 1);
  CHECK(space.getPreviousTimeStep() == 0.01);
  CHECK(space.body(0).position() == x);
  CHECK_NOTHROW(space.advanceTo(0.02));  // in a short one
  CHECK(space.time() == 0.02);
  space.setTimeStep(0.01);
  CHECK_NOTHROW(space.check());
  space.computeDynamics(1);
  CHECK_THAT(space.time(), WithinRel(0.03, 1e-12));
}

TEST_CASE("In a patch a longest step that adaptive ones never come to is allowed") {
  SimulationConfig<double> config = plain(1e8);
  config.adaptiveTimeStep = true;
  config.integrator = IntegratorKind::SymplecticEpicycle;
  Space<double> space(config);
  space.setDomain(Domain<double>::shearPeriodic({4, 4, 4}, 1.0));
  space.addBody(ball({0.3, 0, 0}, {1, 0, 0}, 0.1));
  CHECK_NOTHROW(space.check());
  CHECK_NOTHROW(space.computeDynamics(0));
  CHECK(space.getPreviousTimeStep() < 10);
}

// Kicks and the epicycle make the energy swing by a square of the step. Seen to fail: work of the shear at
// the velocity before the last kick, off by m g.dv h/2 in each crossing (1.51, 0.76 and 0.38 at the end).
TEST_CASE("In a uniform field the ledger of a patch closes to second order where bodies cross its edges") {
  double before = 0.0;
  for (const double h : {0.04, 0.02, 0.01}) {
    Space<double> space = patch(h);
    space.setUniformField({0.2, 0.7, 0.3});
    space.addBody(ball({4, 0, 0}, flow({4, 0, 0}) + Vec(0.3, 0.5, 0.2), 0.1));
    Vec last = space.body(0).position();
    const double start = space.energyLedger().total();
    int crossings = 0;
    double error = 0.0;
    for (std::size_t i = 0; space.time() < 50 - h / 2; ++i) {
      space.computeDynamics(i);
      const Vec x = space.body(0).position();
      crossings += std::abs(x[0] - last[0]) > box[0] / 2 ? 1 : 0;
      error = std::max(error, std::abs(space.energyLedger().total() - start));
      last = x;
    }
    CAPTURE(h, error, before);
    CHECK(crossings >= 5);
    if (h < 0.04) {
      CHECK_THAT(before / error, WithinRel(4.0, 0.1));
    }
    before = error;
  }
}

// Seen to fail: what is fixed has neither motion nor height, but the work of the shear was booked of it.
TEST_CASE("A fixed body that is put outside of a patch, and comes in, moves no energy") {
  Space<double> space = patch(0.01);
  Body<double> held = ball({9, 0, 0}, {0, 0, 0}, 1.0);
  held.fixed = true;
  space.addBody(held);
  advance(space, 2);
  CHECK(space.body(0).position()[0] == 9 - box[0]);
  CHECK(space.body(0).velocity() == Vec(0, 0, 0));
  CHECK(space.energyLedger().total() == 0.0);
  CHECK(space.energyLedger().work == 0.0);
}

TEST_CASE("A blow across the sheared edge obeys restitution and keeps momentum as images see it") {
  for (const double friction : {0.0, 0.5}) {
    Space<double> space = patch(1e-3, friction);
    const double m1 = 2.0, m2 = 3.0;
    const Vec u(0.7, 0.2, -0.1);  // relative velocity, of what the second meets
    const BodyId right = space.addBody(ball({5.5, 0, 0}, {0, 0, 0}, 1.0, m1));
    // The image of the left one that lies beyond the right edge: at time 0 it is not sheared yet.
    const BodyId left = space.addBody(ball({-4.52, 0.3, 0}, {0, 0, 0}, 1.0, m2));
    space.body(right).velocity() = flow({5.5, 0, 0}) + u;
    space.body(left).velocity() = flow({-4.52, 0.3, 0});
    const Vec drift(0, -space.domain().shearSpeed(), 0);
    std::size_t hits = 0;
    for (std::size_t i = 0; i < 60; ++i) {
      space.computeDynamics(i);
      if (!space.impacts().empty()) {
        const Impact<double> hit = space.impacts()[0];
        const ContactImpulse<double> j = hit.impulse;
        ++hits;
        CHECK(hit.key1 == toInteger(right));
        // Between the blow and the end of the step the epicycles bend by O(h). Before it, the relative
        // velocity was larger by J (1/m1 + 1/m2).
        const Vec after = space.body(left).velocity() + drift - space.body(right).velocity();
        const Vec before = after - (j.normal * hit.normal + j.tangential) * (1 / m1 + 1 / m2);
        CHECK_THAT(before.dot(hit.normal), WithinRel(-hit.speed, 2e-2));
        CHECK_THAT(j.normal, WithinRel(1.5 * hit.speed * m1 * m2 / (m1 + m2), 1e-13));
        CHECK_THAT(after.dot(hit.normal), WithinRel(0.5 * hit.speed, 2e-2));
        CHECK((j.tangential.norm() > 0.0) == (friction > 0.0));
      }
    }
    CHECK(hits == 1);
  }
}

// Epicycles are exact, and the time of a blow is but for h^3: what is left is that the normal of two that
// move is taken on the straight way of the step, which is off by a h^2/8 at most, a about 2 here. So a
// quarter of the error is left with half the step, at any phase of the blow, and an eighth off a held one.
// Seen to fail: blows that take the spin of the step's start, and let the drift turn by Omega h what they
// change (half the error with half the step; at 0.05 and a phase of 0.75 those that stick were off by 0.027
// in velocity, 0.05 in spin and 0.06 in orientation, now 100 times less).
TEST_CASE("A blow between balls that spin is of second order in the step, and of third off a held one") {
  for (const double phase : {0.25, 0.75}) {
    for (const double friction : {0.3, 10.0}) {  // slides, sticks
      for (const bool held : {false, true}) {
        double before[3] = {};
        for (const double h : {0.05, 0.025, 0.0125}) {
          Flyer one, two;
          one.v = {0.5, 0.2, 0.2};
          one.w = {1, 2, 3};
          two.x = Vec(1.2, 1.4, 2 * std::sqrt(0.15));
          two.v = held ? Vec(0, 0, 0) : Vec(-0.6, -0.9, 0.1);
          two.w = {-2, 1, 0.5};
          const Flyer still = two;
          const double t = 2 + phase * h;
          one.move(-t);
          two.move(-t);
          two = held ? still : two;
          SimulationConfig<double> config = patchConfig(h);
          config.coeffFriction = config.coeffStaticFriction = friction;
          Space<double> space(config);
          space.setDomain(Domain<double>::shearPeriodic({1e4, 1e4, 1e4}, omega));
          space.addBody(ball(one.x, one.v, 1.0, 1.0, one.w));
          Body<double> other = ball(two.x, two.v, 1.0, 1.0, two.w);
          other.fixed = held;
          space.addBody(other);
          space.body(0).orientation() = one.q;
          space.body(1).angularVelocity() = two.w;
          advance(space, static_cast<std::size_t>(std::lround(4 / h)));
          one.move(t);
          two.move(t);
          if (held) {
            two = still;
            two.w = Vec(0, 0, 0);  // whatever is written to it
          }
          strike(one, two, held ? HUGE_VAL : 1.0, friction);
          one.move(4 - t);
          const auto body = space.body(0);
          const double errors[3] = {Vec(body.velocity() - one.v).norm(),
                                    Vec(body.angularVelocity() - one.w).norm(),
                                    Quaternion<double>(body.orientation()).angularDistance(one.q)};
          for (int k = 0; k < 3; ++k) {
            CAPTURE(phase, friction, held, h, k, errors[k], before[k]);
            CHECK(errors[k] < 0.5 * h * h);
            if (h < 0.05) {
              CHECK_THAT(before[k] / errors[k], WithinRel(held ? 8.0 : 4.0, 0.1));
            }
            before[k] = errors[k];
          }
          CHECK((!held || Vec(space.body(1).angularVelocity()) == still.w));
        }
      }
    }
  }
}

// Two balls that meet at u, side by side along y and z, and fly past each other about as fast as the disc's
// pull to its middle would let them part: v_t^2/d = 1.28 - pull. Along their way both gain speed, by 0.96 in
// a unit of time. Bounces are few: each leaves half the speed of the last one, and rests once all that are to
// come end in the step. Seen to fail: what rests was struck again without effect, up to its share of impacts
// (3648 or 3904 in a step), in 15 of these 36 runs.
TEST_CASE("Two that graze each other in a patch are struck a few times, whatever they leave at") {
  const double h = 2 * pi<double>() / 200;
  const Vec n(0, 0.6, -0.8);
  const Vec across(0, 0.8, 0.6);
  for (const double u : {1e-4, 3e-4, 1e-3}) {
    for (const double pull : {0.002, 0.005, 0.01, 0.02}) {
      for (const double phase : {0.25, 0.5, 0.75}) {
        CAPTURE(u, pull, phase);
        const Vec v = std::sqrt(2 * (1.28 - pull)) * across - u * n;
        Flyer one{-n, v / -2};
        Flyer two{n, v / 2};
        for (Flyer* flyer : {&one, &two}) {
          flyer->move(-(1 + phase) * h);
        }
        Space<double> space = patch(h);
        space.addBody(ball(one.x, one.v, 1.0));
        space.addBody(ball(two.x, two.v, 1.0));
        std::size_t most = 0;
        for (std::size_t k = 0; k < 4; ++k) {
          space.computeDynamics(k);
          most = std::max(most, space.impacts().size());
        }
        CHECK(most <= 4);
      }
    }
  }
}

// The centre of mass of all bodies, each followed through its images, is on an epicycle of its own whatever
// the collisions do: tested by the quantity that a body loses at an edge by a known amount.
TEST_CASE("Collisions keep the momentum of the patch; an edge takes Omega Lx/2 a unit of mass") {
  Space<double> space = patch(0.005, 0.3);
  fill(space, 80, 2.0);
  const PatchMomentum followed = followMomentum(space, 400);
  CHECK(followed.crossings > 10);
  CHECK(space.energyLedger().restitution > 10.0);
  // Moving overlapping pairs apart keeps sum m x, blows across an edge the sum of impulses.
  CHECK_THAT(followed.error, WithinAbs(0.0, 1e-11 * 80));
}

TEST_CASE(
    "The ledger of a patch closes: what collisions take the shear brings, with overlap removed or not") {
  for (const double factor : {0.0, 0.4}) {
    Space<double> space = patch(0.01, 0.3);
    space.setPositionalCorrectionFactor(factor);
    fill(space, 80, 2.0);
    space.addBody(ball({-3.1, -5.5, -2.4}, flow({-3.1, 0, 0}), 1.0));  // inside of another to begin with
    const double before = space.energyLedger().total();
    advance(space, 1200);
    const EnergyLedger<double> ledger = space.energyLedger();
    CHECK(ledger.restitution > 100.0);
    CHECK(ledger.friction > 10.0);
    CHECK(-ledger.work > 100.0);
    CHECK((ledger.correction == 0.0) == (factor == 0.0));
    // Nothing in it is of the order of the step: exact drifts, exact blows, exact wraps.
    CHECK_THAT(ledger.total(), WithinAbs(before, 1e-10 * ledger.restitution));
  }
}

TEST_CASE("A patch continues bit for bit from a file, at any phase of its shear") {
  const auto begin = [] {
    SimulationConfig<double> config = patchConfig(0.01);
    config.coeffFriction = 0.3;
    Space<double> space(config);
    space.setDomain(Domain<double>::shearPeriodic(box, omega, 3.6));
    fill(space, 60, 2.0);
    return space;
  };
  const TemporaryFile file("patch");
  Space<double> whole = begin();
  advance(whole, 237);
  whole.save(file.path());
  Space<double> again;
  again.restore(file.path());
  CHECK(again.domain() == whole.domain());
  CHECK(again.domain().verticalFrequency() == 3.6);
  advance(whole, 200);
  advance(again, 200);
  CHECK(sameBits(stateOf(whole), stateOf(again)));
  CHECK(again.energyLedger().total() == whole.energyLedger().total());
}

TEST_CASE("A change of the frame, and bodies that come and go in it, are booked") {
  Space<double> space = patch(0.01);
  fill(space, 40, 0.5);
  advance(space, 10);
  const double before = space.energyLedger().total();
  space.removeBody(BodyId{7});
  CHECK_THAT(space.energyLedger().total(), WithinRel(before, 1e-13));
  space.addBody(ball({3, 3, 3.5}, {0, -4.5, 0}, 0.3, 2.0));
  CHECK_THAT(space.energyLedger().total(), WithinRel(before, 1e-13));
  space.setDomain(Domain<double>::shearPeriodic(box, 2 * omega));
  CHECK_THAT(space.energyLedger().total(), WithinRel(before, 1e-13));
  CHECK(std::abs(space.energyLedger().exchange) > 1.0);
}

// Seen to fail: what the shear does to a pair across the edge was booked as restitution, 10 J for a merger
// that takes 36 J in the middle.
TEST_CASE("What a collision hook decides across the sheared edge is booked as it is in the middle") {
  using Outcome = CollisionOutcome<double>;
  const auto merge = [](const Collision<double>&) { return Outcome::merge(); };
  const auto turnBack = [](const Collision<double>& hit) {  // elastic, with a push along the edge
    const Vec dv = 2 * hit.impactSpeed * hit.normal + Vec(0, 0.3, 0);
    return Outcome::velocities(hit.first.velocity - 2 * dv / 3, hit.first.angularVelocity,
                               hit.second.velocity + dv / 3, hit.second.angularVelocity);
  };
  const auto ledgerOf = [&](double x, double half, const CollisionHook<double>& hook) {
    Space<double> space = patch(0.01);
    space.setCollisionHook(hook);
    for (const double side : {-1.0, 1.0}) {
      const Vec place(x + side * half, 0.2 * side, 0);
      const Vec velocity = flow(place) - 5 * side * Vec::UnitX();
      const double boxes = place[0] >= box[0] / 2 ? 1 : 0;
      space.addBody(ball(place - boxes * Vec(box[0], 0, 0),
                         velocity + boxes * Vec(0, 1.5 * omega * box[0], 0), 1.0, side < 0 ? 1.0 : 2.0));
    }
    const double before = space.energyLedger().total();
    advance(space, 10);
    const EnergyLedger<double> after = space.energyLedger();
    CHECK_THAT(after.total(), WithinRel(before, 1e-12));
    return after;
  };
  for (const CollisionHook<double>& hook : {CollisionHook<double>(merge), CollisionHook<double>(turnBack)}) {
    for (const double half :
         {1.1, 0.97}) {  // they meet within a step; they overlap where the first one begins
      const EnergyLedger<double> middle = ledgerOf(0, half, hook);
      const EnergyLedger<double> edge = ledgerOf(box[0] / 2, half, hook);
      CHECK(std::abs(middle.restitution) > 0.1);
      CHECK_THAT(edge.restitution, WithinRel(middle.restitution, 1e-10));
      CHECK_THAT(edge.exchange, WithinAbs(middle.exchange, 1e-10));
      CHECK(middle.work == 0.0);
    }
  }
}

// The merger itself takes no time, so it is the same one in the frame and where nothing turns: there
// velocities are v + Omega x r, and spins w + Omega. Seen to fail: angular momentum as it is in the frame, by
// which two that stand still in it did not turn afterwards, where it has to be at 0.8 Omega.
TEST_CASE("Two that merge in a patch turn as where the frame does not") {
  const auto merge = [](const Collision<double>&) { return CollisionOutcome<double>::merge(); };
  const double h = 0.01;
  const Vec turn(0, 0, omega);
  for (const double centre : {0.0, box[0] / 2}) {  // in the middle and across the edge
    for (const double speed : {1e-3, 0.7}) {
      Space<double> space = patch(h);
      Space<double> still(plain(h));
      space.setCollisionHook(merge);
      still.setCollisionHook(merge);
      for (const double side : {-1.0, 1.0}) {
        const Vec arm = side * Vec(0.9, 0.2, 0.3);  // they overlap, and merge before they move
        const Vec v = -side * speed * Vec(1, 0.3, 0.2);
        const Vec w = speed * Vec(side, 0.3, 0.5);
        const double mass = side < 0 ? 1.0 : 2.0;
        const double out = centre + arm[0] >= box[0] / 2 ? 1.0 : 0.0;
        const Vec image(out * box[0], 0, 0);
        space.addBody(ball(Vec(centre, 0, 0) + arm - image, v - flow(image), 1.0, mass, w));
        still.addBody(ball(arm, v + turn.cross(arm), 1.0, mass, w + turn));
      }
      space.computeDynamics(0);
      still.computeDynamics(0);
      REQUIRE(space.n() == 1);
      REQUIRE(still.n() == 1);
      Flyer one{.w = Vec(still.body(0).angularVelocity()) - turn};
      one.move(h);  // in the frame what does not change turns
      CAPTURE(centre, speed, one.w[2]);
      CHECK((Vec(space.body(0).angularVelocity()) - one.w).norm() < 1e-14 * (1 + one.w.norm()));
    }
  }
}

// Two balls held by their gravity, in line with the planet: the force between them is G m1 m2/d^2 less the
// tide m* 3 Omega^2 d. Its error in a step is that of velocity Verlet, of order (Omega h)^2. Seen to fail:
// contacts that are right at the end of a straight way only (apart by 1.5 (Omega h)^2 d in every second step,
// two thirds of the force, 1.2 of the binding energy booked as restitution in 40 orbits).
TEST_CASE(
    "A pair that its gravity holds touches in every step of its orbit, with the force of the closed form") {
  const double d = 1.7;
  const double m1 = 1.0;
  const double m2 = 0.3;
  const double limit = std::sqrt((m1 + m2) / (3 * d * d * d));
  for (const auto& [share, friction] : {std::pair(0.3, 0.0), std::pair(0.3, 0.3), std::pair(0.7, 0.0)}) {
    const double Omega = share * limit;
    for (const int steps : {50, 200}) {
      SimulationConfig<double> config = patchConfig(2 * pi<double>() / Omega / steps);
      config.G = 1.0;
      config.coeffFriction = config.coeffStaticFriction = friction;
      Space<double> space(config);
      space.setDomain(Domain<double>::shearPeriodic({80, 80, 80}, Omega));
      space.addBody(ball({-m2 / (m1 + m2) * d, 0, 0}, {0, 0, 0}, 1.0, m1));
      space.addBody(ball({m1 / (m1 + m2) * d, 0, 0}, {0, 0, 0}, 0.7, m2));
      const double start = space.energyLedger().total();
      const double angle = Omega * config.timeStep;
      const double force = m1 * m2 / (d * d) * (1 - share * share);
      double worst = 0;
      double gap = 0;
      for (int k = 0; k < 4 * steps; ++k) {
        space.computeDynamics(static_cast<std::size_t>(k));
        REQUIRE(space.contacts().size() == 1);
        worst = std::max(worst, std::abs(space.contactImpulses()[0].normal / config.timeStep / force - 1));
        gap = std::max(gap, std::abs(space.contacts()[0].gap) / d);
      }
      const double ownAngle = std::sqrt(3.0) / share * angle;
      CAPTURE(share, friction, steps, worst, gap);
      CHECK(space.impacts().empty());
      CHECK(worst < 2 * angle * angle);
      CHECK(gap < 1e-4 + 0.01 * ownAngle * ownAngle * ownAngle);
      const EnergyLedger<double> end = space.energyLedger();
      const double booked = std::abs(end.restitution) + std::abs(end.friction);
      CHECK(booked < (1e-5 + (friction > 0 ? 5 : 1e-2) * ownAngle * ownAngle * ownAngle) * std::abs(start));
      CHECK(end.total() == Approx(start).epsilon(2 * angle * angle));
    }
  }
}

// As above, where gravity is f times the tide, hardly more than that, and the sum of both much less than what
// each of them brings to the approach of a step: rest is exact for f > 1. Seen to fail: a fall that is that
// of the sum alone, for f below 4/3 (the first step threw them apart, with e = 0 as well, and booked up to
// 2e-3 of the energy; for f = 1.02 they parted for good).
TEST_CASE(
    "A pair whose gravity is little more than the tide rests, whatever the restitution; with less it parts") {
  for (const double e : {0.0, 0.5, 1.0}) {
    for (const double f : {0.98, 1.02, 1.2, 1.32}) {
      for (const double friction : {0.0, 0.5}) {
        SimulationConfig<double> config = patchConfig(2 * pi<double>() / omega / 250);
        config.G = f * 3 * omega * omega * 8 / 2;
        config.coeffRestitution = e;
        config.coeffFriction = config.coeffStaticFriction = friction;
        Space<double> space(config);
        space.setDomain(Domain<double>::shearPeriodic({1e3, 1e3, 1e3}, omega));
        space.addBody(ball({-1, 0, 0}, {0, 0, 0}, 1.0));
        space.addBody(ball({1, 0, 0}, {0, 0, 0}, 1.0));
        const double start = space.energyLedger().total();
        const double angle = omega * config.timeStep;
        double worst = 0;
        double gap = 0;
        std::size_t touching = 0;
        for (std::size_t k = 0; k < 500; ++k) {
          space.computeDynamics(k);
          touching += space.contacts().size();
          if (!space.contacts().empty()) {
            const double force = space.contactImpulses()[0].normal / config.timeStep;
            worst = std::max(worst, std::abs(force - 3 * omega * omega * (f - 1)) / (config.G / 4));
            gap = std::max(gap, std::abs(space.contacts()[0].gap) / 2);
          }
        }
        const EnergyLedger<double> end = space.energyLedger();
        const double distance = Vec(space.body(1).position() - space.body(0).position()).norm();
        const double ownAngle = std::sqrt(3.0 * f) * angle;
        const double third = ownAngle * ownAngle * ownAngle;
        CAPTURE(e, f, friction, worst, gap, touching, distance, end.restitution, end.friction);
        CHECK(space.impacts().empty());
        CHECK(std::abs(end.restitution) + std::abs(end.friction) <
              (1e-5 + (friction > 0 ? 5 : 1e-2) * third) * std::abs(start));
        if (f < 1) {
          CHECK(touching < 250);
          CHECK(distance > 3);
        } else {
          CHECK(touching == 500);
          CHECK(worst < angle * angle);
          CHECK(gap < 1e-4 + 0.01 * third);
          CHECK_THAT(distance, WithinAbs(2.0, 2e-4));
        }
      }
    }
  }
}

// Thirteen balls in the closest packing keep together at three tenths of the frequency at which the tide
// takes balls off their surface. Seen to fail: as above (off by 3.7e-3).
TEST_CASE("A clump with friction keeps its shape in the tide") {
  SimulationConfig<double> config = patchConfig(0);
  const double Omega = 0.3 * std::sqrt(13.0 / 27.0);
  config.timeStep = 2 * pi<double>() / Omega / 200;
  config.G = 1.0;
  config.coeffRestitution = 0.3;
  config.coeffFriction = config.coeffStaticFriction = 0.5;
  Space<double> space(config);
  space.setDomain(Domain<double>::shearPeriodic({60, 60, 60}, Omega));
  space.addBody(ball({0, 0, 0}, {0, 0, 0}, 1.0));
  for (int code = 0; code < 27; ++code) {
    const Vec cell(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
    if (cell.cwiseAbs().sum() == 2.0) {
      space.addBody(ball(std::sqrt(2.0) * cell, {0, 0, 0}, 1.0));
    }
  }
  REQUIRE(space.n() == 13);
  for (std::size_t k = 0; k < 600; ++k) {
    space.computeDynamics(k);
  }
  for (std::size_t i = 1; i < 13; ++i) {
    const Vec r = space.body(i).position() - space.body(0).position();
    CHECK_THAT(r.norm() / 2, WithinAbs(1.0, 2e-3));
  }
}

// Two balls one above the other have nothing but the tide across the plane to hold them, m Omega^2 z: each
// step parts them by what it then draws them together. An overlap of 1e-4 R is right, so that some correction
// stays, with the cube of the step. Seen to fail: the guard of energy takes that blow for a gain, and leaves
// them to go into each other by 1.5 (Omega h)^2 R, 2.3e-2 R in 50 steps an orbit; 7.7, 3.9 and 2.0 m Omega^2
// R^2 were corrected in ten orbits and lost again.
TEST_CASE("What the tide alone presses together rests, and needs no correction") {
  for (const double friction : {0.0, 0.5}) {
    std::vector<double> corrected;
    for (const int steps : {50, 100, 200}) {
      SimulationConfig<double> config = patchConfig(2 * pi<double>() / steps);
      config.coeffRestitution = 0;
      config.coeffFriction = config.coeffStaticFriction = friction;
      Space<double> space(config);
      space.setDomain(Domain<double>::shearPeriodic({40, 40, 40}, omega));
      space.addBody(ball({0, 0, 1}, {0, 0, 0}, 1.0));
      space.addBody(ball({0, 0, -1}, {0, 0, 0}, 1.0));
      double deepest = 0;
      for (int k = 0; k < 10 * steps; ++k) {
        space.computeDynamics(static_cast<std::size_t>(k));
        REQUIRE(space.contacts().size() == 1);
        deepest = std::max(deepest, -space.contacts()[0].gap);
      }
      CAPTURE(friction, steps);
      CHECK(deepest < 1.05e-4);
      corrected.push_back(-space.energyLedger().correction);
    }
    CAPTURE(friction, corrected);
    CHECK(corrected[0] < 0.02);
    CHECK(corrected[1] < corrected[0] / 6);
    CHECK(corrected[2] < corrected[1] / 6);
  }
}

// N = -2 Omega m v_x presses a ball that goes along a wall in -x to it, and nothing else does. Against 1600
// steps, whose own error is some 256 times less. Seen to fail: contacts searched by the forces alone, so that
// a gap of rounding was none of a contact: 3 to 45 steps with one, 73 to 897 blows, of first order.
TEST_CASE("A ball that the frame presses to a wall stays a contact, and slides at second order") {
  const auto run = [](int steps) {
    Space<double> space = patch(0.5 / steps, 0.1);
    space.setDomain(Domain<double>::shearPeriodic({1e4, 1e4, 1e4}, omega));
    space.addPlane({0, -1, 0}, -2);
    space.addBody(ball({0.5, 1.5, 0}, {-2, 0, 0}, 0.5, 1.3));
    for (int k = 0; k < steps; ++k) {
      space.computeDynamics(static_cast<std::size_t>(k));
      REQUIRE(space.contacts().size() == 1);
      REQUIRE(space.impacts().empty());
    }
    CHECK(std::abs(space.energyLedger().total() - 2.6 - 1.3 * 1.5 * -0.25) < 1e-13);
    return stateOf(space);
  };
  const std::vector<double> exact = run(1600);
  const double one = difference(run(50), exact);
  const double two = difference(run(100), exact);
  CAPTURE(one, two);
  CHECK(one < 1e-4);
  CHECK(one / two > 3.5);
  CHECK(one / two < 4.6);
}

// A pyramid of grains on a floor of fixed ones, which the tide holds them to. Seen to fail: what the frame
// adds counted only of contacts with what stands still, 9184 blows, by which grains flew at 9e-2.
TEST_CASE("A heap that the tide holds on fixed bodies rests as on a plane") {
  SimulationConfig<double> config = patchConfig(0.01);
  config.coeffRestitution = 0.3;
  config.coeffFriction = 0.5;
  config.coeffStaticFriction = 0.6;
  Space<double> space(config);
  space.setDomain(Domain<double>::shearPeriodic({100, 100, 100}, 0.3, 1.0));
  for (int i = -4; i <= 4; ++i) {
    for (int j = -4; j <= 4; ++j) {
      Body<double> stone = ball({1.0 * i, 1.0 * j, 8.5}, {0, 0, 0}, 0.5);
      stone.fixed = true;
      space.addBody(stone);
    }
  }
  const std::size_t fixed = space.n();
  for (int layer = 0; layer < 3; ++layer) {
    for (int i = 0; i < 4 - layer; ++i) {
      for (int j = 0; j < 4 - layer; ++j) {
        space.addBody(
            ball({i - 1.5 + 0.5 * layer, j - 1.5 + 0.5 * layer, 9.21 + 0.7072 * layer}, {0, 0, 0}, 0.5));
      }
    }
  }
  std::size_t step = 0;
  for (; step < 200; ++step) {
    space.computeDynamics(step);
  }
  std::size_t blows = 0;
  double fastest = 0;
  for (; step < 600; ++step) {
    space.computeDynamics(step);
    blows += space.impacts().size();
    for (std::size_t i = fixed; i < space.n(); ++i) {
      fastest = std::max(fastest, Vec(space.body(i).velocity()).norm());
    }
  }
  CHECK(blows == 0);
  CHECK(fastest < 1e-4);  // 1.1e-3 of what a step's fall makes
}

// Seen to fail: with a plane anywhere it counted of all contacts, also of bodies that fly.
TEST_CASE("A plane in a patch that nothing comes near changes no bit") {
  const auto run = [](bool plane) {
    Space<double> space = patch(0.02, 0.4);
    if (plane) {
      space.addPlane({0, 0, 1}, -7.9);
    }
    fill(space, 60, 0.5);
    advance(space, 500);
    CHECK(space.energyLedger().restitution > 0.1);
    return stateOf(space);
  };
  CHECK(sameBits(run(true), run(false)));
}

// A ball that its weight holds on a fixed one, by friction and against rolling: F/N is 0.12. Contacts take
// back what the kick did, so that the drift begins without it. Seen to fail: the Coriolis force of the
// velocity of the kick, by which it crept at |Omega x a| h^2/2 a unit of time, 0.99, 0.25 and 0.063 in two
// orbits.
TEST_CASE("What friction holds does not creep along the force that it carries, where the frame turns") {
  std::vector<double> crept;
  for (const int steps : {100, 200, 400}) {
    SimulationConfig<double> config = patchConfig(2 * pi<double>() / steps);
    config.G = 400;
    config.coeffFriction = config.coeffStaticFriction = config.rollingFriction = 2;
    config.spinningFriction = 1;
    Space<double> space(config);
    space.setDomain(Domain<double>::shearPeriodic({1e3, 1e3, 1e3}, omega));
    Body<double> rock = ball({0, 0, 0}, {0, 0, 0}, 2.0);
    rock.fixed = true;
    space.addBody(rock);
    const Vec start(2, 2, 1);
    space.addBody(ball(start, {0, 0, 0}, 1.0, 0.3));
    for (int k = 0; k < 2 * steps; ++k) {
      space.computeDynamics(static_cast<std::size_t>(k));
    }
    crept.push_back(Vec(space.body(1).position() - start).norm());
  }
  CAPTURE(crept);
  CHECK(crept[0] < 4e-3);
  CHECK(crept[1] < crept[0] / 4);
  CHECK(crept[2] < crept[1] / 4);
}

}  // namespace test_shearing_patch
