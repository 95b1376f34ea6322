#include "laws/laws.hpp"
#include "support/catch.hpp"

#include <numbers>

// Static friction of small structures. k balls in a ring, in touch with their neighbours or with gaps between
// them, carry one on top; the line from a lower ball to it stands at theta from the vertical. A lower ball
// does not turn if the friction f at the floor and at the upper ball is the same, and does not move if
//   N sin theta = f (1 + cos theta),   N cos theta + f sin theta = W/k,
// so that f/N = tan(theta/2), N = W/k, and at the floor f/(w + W/k) = tan(theta/2) (W/k)/(w + W/k) for a
// lower ball of weight w. The ring itself touches without force.

using namespace gravel;
using namespace gravel::test;

namespace test_structures {

namespace {

constexpr double g = 9.81;
constexpr double radius = 0.5;

struct Ring {
  int k;
  double gap;   // over the radius of the lower balls
  double top;   // radius of the upper ball, over the same
  double mass;  // of the upper ball, over that of a lower one

  double distance() const { return radius * (1 + gap / 2) / std::sin(std::numbers::pi / k); }
  double amongBalls() const { return std::tan(std::asin(distance() / (radius * (1 + top))) / 2); }
  double atFloor() const { return amongBalls() * (mass / k) / (1 + mass / k); }
};

/// A floor on which balls without restitution stand. \param slide kinetic friction over static friction
/// \param asked solve to rounding, nearly; else by the default settings
Space<double> floorFor(double dt, double slide, double amongBalls, double atFloor, bool asked) {
  SimulationConfig<double> config = plain(dt);
  config.coeffRestitution = 0;
  config.coeffStaticFriction = amongBalls;
  config.coeffFriction = slide * amongBalls;
  if (asked) {
    config.contactTolerance = 1e-9;
    config.contactIterations = 3000;
  }
  Space<double> space(config);
  space.setUniformField({0, 0, -g});
  // The coefficient of a pair is the geometric mean.
  const double ofFloor = atFloor * atFloor / amongBalls;
  const MaterialId floor =
      space.addMaterial({.restitution = 0, .staticFriction = ofFloor, .kineticFriction = slide * ofFloor});
  space.addPlane({0, 0, 1}, 0, floor);
  return space;
}

/// The lower balls of a ring and the one on top, around the z axis.
std::vector<Body<double>> bodiesOf(const Ring& ring) {
  std::vector<Body<double>> bodies;
  const double d = ring.distance();
  for (int i = 0; i < ring.k; ++i) {
    const double angle = 2 * std::numbers::pi * i / ring.k + 0.3;
    bodies.push_back(ball({d * std::cos(angle), d * std::sin(angle), radius}, {0, 0, 0}, radius, 2.0));
  }
  const double reach = radius * (1 + ring.top);
  bodies.push_back(
      ball({0, 0, radius + std::sqrt(reach * reach - d * d)}, {0, 0, 0}, radius * ring.top, 2.0 * ring.mass));
  return bodies;
}

/// How far the upper ball has come down after a time [s], over the radius.
double sinking(const Ring& ring, double slide, double amongBalls, double atFloor, bool asked, double time) {
  Space<double> space = floorFor(2e-3, slide, amongBalls, atFloor, asked);
  const std::vector<Body<double>> bodies = bodiesOf(ring);
  for (const Body<double>& body : bodies) {
    space.addBody(body);
  }
  space.advanceTo(time);
  return (bodies.back().position[2] - Vec(space.body(bodies.size() - 1).position())[2]) / radius;
}

/// Balls in touch, 20 to a row, far off along x.
void addRows(Space<double>& space, int count, const Vec& velocity) {
  for (int i = 0; i < count; ++i) {
    space.addBody(
        ball({40 * radius + 2 * radius * (i % 20), 2 * radius * (i / 20), radius}, velocity, radius, 2.0));
  }
}

/// Rows of n, n - 1, ... 1 balls in touch, each row in the hollows of the one below.
std::vector<Vec> triangle(int n) {
  std::vector<Vec> centres;
  for (int row = 0; row < n; ++row) {
    for (int i = 0; i < n - row; ++i) {
      centres.emplace_back((2 * i + row) * radius, 0.0, (1 + row * std::sqrt(3.0)) * radius);
    }
  }
  return centres;
}

/// Layers of triangles of n, n - 1, ... 1 rows, likewise.
std::vector<Vec> tetrahedron(int n) {
  std::vector<Vec> centres;
  for (int layer = 0; layer < n; ++layer) {
    for (int row = 0; row < n - layer; ++row) {
      for (int i = 0; i < n - layer - row; ++i) {
        centres.emplace_back((2 * i + row + layer) * radius, (3 * row + layer) / std::sqrt(3.0) * radius,
                             (1 + layer * std::sqrt(8.0 / 3)) * radius);
      }
    }
  }
  return centres;
}

/// How far any of these balls has moved, over the radius, after so many steps and after as many again.
std::array<double, 2> moves(const std::vector<Vec>& centres, double dt, double slide, double amongBalls,
                            double atFloor, bool asked, std::size_t steps) {
  Space<double> space = floorFor(dt, slide, amongBalls, atFloor, asked);
  for (const Vec& centre : centres) {
    space.addBody(ball(centre, {0, 0, 0}, radius, 1.0));
  }
  std::array<double, 2> most{};
  std::vector<Vec> from = centres;
  for (double& move : most) {
    for (std::size_t k = 0; k < steps; ++k) {
      space.computeDynamics(k);
    }
    for (std::size_t i = 0; i < centres.size(); ++i) {
      const Vec at = space.body(i).position();
      move = std::max(move, (at - from[i]).norm() / radius);
      from[i] = at;
    }
  }
  return most;
}

}  // namespace

// Seen to fail: a static coefficient 2 % too large or too small in the rows of the solver.
TEST_CASE("Balls in a ring carry one on top above the friction of the closed form, and part below it") {
  for (const int k : {3, 4}) {
    const Ring ring{k, 0, 1, 1};
    CAPTURE(k);
    CHECK(std::abs(sinking(ring, 1, 1.01 * ring.amongBalls(), 1, true, 3)) < 1e-6);
    CHECK(sinking(ring, 1, 0.99 * ring.amongBalls(), 1, true, 3) > 0.1);
    CHECK(std::abs(sinking(ring, 1, 1, 1.01 * ring.atFloor(), true, 3)) < 1e-6);
    CHECK(sinking(ring, 1, 1, 0.99 * ring.atFloor(), true, 3) > 0.1);
  }
}

// With the default settings: what the tolerance leaves in the first steps is some g dt^2. Seen to fail: rows
// slide as soon as friction is cut in a sweep (with 20 sweeps 1.27 times as much friction needed at the floor
// of the ring of six with 3/4, 1.02 among its balls).
TEST_CASE("It is static friction that holds a structure, however little it has once it slides") {
  for (const Ring& ring : {Ring{3, 0, 1, 1}, Ring{4, 0.125, 2.25, 0.5}, Ring{6, 0.033, 2, 0.2}}) {
    for (const double slide : {0.75, 0.5}) {
      CAPTURE(ring.k, slide);
      CHECK(std::abs(sinking(ring, slide, 1.01 * ring.amongBalls(), 2, false, 1)) < 1e-4);
      CHECK(sinking(ring, slide, 0.99 * ring.amongBalls(), 2, false, 1) > 0.01);
      CHECK(std::abs(sinking(ring, slide, 2, 1.01 * ring.atFloor(), false, 1)) < 1e-4);
      CHECK(sinking(ring, slide, 2, 0.99 * ring.atFloor(), false, 1) > 0.01);
    }
  }
}

// The walls of a groove rise at alpha on either side, and it falls by theta along its length. A ball rolls
// down with a = g sin(theta)/(1 + 0.4/cos(alpha)^2) on f = 0.2 m a/cos(alpha)^2 at each wall, if that is at
// most mu N, N = m g cos(theta)/(2 cos(alpha)): if tan(theta) <= mu (2.5 cos(alpha) + 1/cos(alpha)). How much
// friction there is across the groove is open. The first sweeps make some, which leaves too little along it;
// then it goes back by a share a sweep, and the slip with it, the more slowly the nearer to the threshold:
// sweeps that end with a slip of 32 changes hold up to 0.985 of it. Speeds are to the tolerance. Seen to
// fail: a slip of four changes is taken to last (0.92 of it).
TEST_CASE("A ball rolls down a groove on the static friction of the closed form") {
  for (const double degrees : {30.0, 45.0}) {
    for (const double mu : {0.3, 0.8}) {
      const double alpha = degrees * std::numbers::pi / 180;
      const double across = std::cos(alpha);
      for (const double share : {0.97, 1.03}) {
        CAPTURE(degrees, mu, share);
        const double theta = std::atan(share * mu * (2.5 * across + 1 / across));
        SimulationConfig<double> config = plain(1.0 / 240);
        config.coeffStaticFriction = mu;
        config.coeffFriction = 0.7 * mu;
        Space<double> space(config);
        space.setUniformField({g * std::sin(theta), 0, -g * std::cos(theta)});
        space.addPlane({0, std::sin(alpha), across}, 0);
        space.addPlane({0, -std::sin(alpha), across}, 0);
        space.addBody(ball({0, 0, radius / across}, {0, 0, 0}, radius));
        space.advanceTo(0.5);
        const double rolling = g * std::sin(theta) / (1 + 0.4 / (across * across));
        const double sliding = g * (std::sin(theta) - 0.7 * mu * std::cos(theta) / across);
        CHECK_THAT(space.body(0).velocity()[0], WithinRel(0.5 * (share < 1 ? rolling : sliding), 1e-3));
      }
    }
  }
}

// Two balls between walls carry one on top when the floor under them is taken away, by friction alone. The
// line from a lower ball to the upper one stands at theta from the vertical. A lower ball of weight w does
// not turn if the friction at the wall and at the upper ball is the same, f = w + W/2; so there is N = (W/2 +
// f sin theta)/cos(theta) among balls and N sin theta + f cos theta at a wall. Nothing approaches anything in
// a step's fall. Seen to fail: contacts are solved only where something does (the arch stood for a few steps,
// while rounding let something approach).
TEST_CASE("An arch between two walls stands on the friction of the closed form when its floor is gone") {
  for (const double degrees : {40.0, 60.0}) {
    for (const double weight : {1.0, 10.0}) {
      const double theta = degrees * std::numbers::pi / 180;
      const double f = 1 + weight / 2;
      const double load = (weight / 2 + f * std::sin(theta)) / std::cos(theta);
      const double amongBalls = f / load;
      const double atWall = f / (load * std::sin(theta) + f * std::cos(theta));
      const auto sinks = [&](double shareAmongBalls, double shareAtWall) {
        Space<double> space =
            floorFor(1.0 / 240, 1, shareAmongBalls * amongBalls, shareAtWall * atWall, false);
        space.removePlane(0);
        const double x = 2 * radius * std::sin(theta);
        const double z = 2 * radius * std::cos(theta);
        const MaterialId smooth = space.addMaterial({.staticFriction = 0, .kineticFriction = 0});
        const MaterialId rough{1};  // of floorFor()
        space.addPlane({1, 0, 0}, -x - radius, rough);
        space.addPlane({-1, 0, 0}, -x - radius, rough);
        const std::size_t floor = space.addPlane({0, 0, 1}, -radius, smooth);
        space.addBody(ball({-x, 0, 0}, {0, 0, 0}, radius, 1.0));
        space.addBody(ball({x, 0, 0}, {0, 0, 0}, radius, 1.0));
        space.addBody(ball({0, 0, z}, {0, 0, 0}, radius, weight));
        space.advanceTo(0.1);
        space.removePlane(floor);
        space.advanceTo(1.1);
        return (z - Vec(space.body(std::size_t{2}).position())[2]) / radius;
      };
      CAPTURE(degrees, weight);
      CHECK(std::abs(sinks(1.02, 3)) < 1e-5);
      CHECK(sinks(0.98, 3) > 0.1);
      CHECK(std::abs(sinks(3, 1.02)) < 1e-5);
      CHECK(sinks(3, 0.98) > 0.1);
    }
  }
}

// The friction that 10 and 15 balls need at the floor, by bisection with sweeps to 1e-9: 0.0561. Seen to
// fail: 20 sweeps in the first solve, too (0.072 and 0.080: what forces had not reached yet slid, and went
// on).
TEST_CASE(
    "A triangle of balls stands by the default settings on the friction that it needs when all is asked") {
  for (const int n : {4, 5}) {
    CAPTURE(n);
    CHECK(moves(triangle(n), 1.0 / 240, 0.7, 1, 0.052, true, 120)[0] > 3e-3);
    CHECK(moves(triangle(n), 1.0 / 240, 0.7, 1, 0.052, false, 120)[0] > 3e-3);
    CHECK(moves(triangle(n), 1.0 / 240, 0.7, 1, 0.059, true, 120)[0] < 3e-3);
    CHECK(moves(triangle(n), 1.0 / 240, 0.7, 1, 0.059, false, 120)[0] < 3e-3);
  }
}

// They move by what the tolerance of the first solves leaves of a fall, 1e-5 g dt^2 in each of 72 steps at
// most, which is 2.5e-7 of the radius, times the few sweeps in which a disturbance gets through. Seen to
// fail: 20 sweeps in the first solve, too, or as many as look at 4000 contacts (0.003 to 0.07).
TEST_CASE("Larger pyramids stand by the default settings where they do so when all is asked") {
  for (const auto& centres : {triangle(8), tetrahedron(4), tetrahedron(5)}) {
    CAPTURE(centres.size());
    CHECK(moves(centres, 1.0 / 240, 1, 1, 0.1, true, 72)[0] < 1e-6);
    CHECK(moves(centres, 1.0 / 240, 1, 1, 0.1, false, 72)[0] < 1e-6);
  }
}

// Seen to fail: what is content to the tolerance is left as it is (1e-3 of a radius in ten minutes, for ever
// on).
TEST_CASE("Four balls in a tetrahedron do not creep by the default settings") {
  CHECK(moves(tetrahedron(2), 1.0 / 60, 1, 0.5, 0.5, false, 18'000)[1] < 1e-4);
}

// Seen to fail: friction and resistance taken by turns, which crept at 5e-9 to 4e-6 m/s for k = 0.02 to
// 0.001. Spins are moved 1/k times as easily as bodies.
TEST_CASE("Four balls of little inertia in a tetrahedron do not creep, whatever resists their rolling") {
  for (const double k : {0.4, 0.02, 0.001}) {
    for (const double rolling : {0.1, 0.6}) {
      SimulationConfig<double> config = plain(0.01);
      config.coeffRestitution = 0;
      config.coeffFriction = config.coeffStaticFriction = 0.6;
      config.rollingFriction = config.spinningFriction = rolling;
      Space<double> space(config);
      space.setUniformField({0, 0, -g});
      space.addPlane({0, 0, 1}, 0);
      for (Body<double> body : bodiesOf({3, 0, 1, 1})) {
        body.inertia = k * body.mass * body.radius * body.radius;
        space.addBody(body);
      }
      advance(space, 400);
      for (std::size_t i = 0; i < space.n(); ++i) {
        CAPTURE(k, rolling, i);
        CHECK(Vec(space.body(i).velocity()).norm() < 1e-11);
        CHECK(k * radius * Vec(space.body(i).angularVelocity()).norm() < 1e-11);
      }
    }
  }
}

// Seen to fail: one loop of sweeps over all contacts, until the largest change of all is a share of the
// largest approach of all (from 1e-3 of a radius on).
TEST_CASE("A small structure does the same, to the bit, whatever lies or moves beside it") {
  const Ring ring{5, 0, 2, 0.3};
  for (const double share : {0.8, 1.1}) {  // it comes down, or stands
    std::vector<std::vector<Body<double>>> ends;
    for (const auto& [before, after, speed] :
         {std::tuple{0, 0, 0.0}, {0, 30, 0.0}, {0, 400, 0.0}, {0, 400, 3.0}, {25, 0, 1.0}}) {
      Space<double> space = floorFor(2e-3, 0.7, share * ring.amongBalls(), 0.3, false);
      addRows(space, before, {speed, 0, 0});
      for (const Body<double>& body : bodiesOf(ring)) {
        space.addBody(body);
      }
      addRows(space, after, {speed, 0, 0});
      advance(space, 250);
      ends.emplace_back();
      for (int i = 0; i <= ring.k; ++i) {
        ends.back().push_back(space.body(static_cast<std::size_t>(before + i)).load());
      }
    }
    for (const auto& end : ends) {
      for (std::size_t i = 0; i < end.size(); ++i) {
        CAPTURE(share, &end - ends.data(), i);
        CHECK(end[i].position == ends[0][i].position);
        CHECK(end[i].velocity == ends[0][i].velocity);
        CHECK(end[i].angularVelocity == ends[0][i].angularVelocity);
      }
    }
    CHECK((ends[0].back().velocity.norm() > 0.01) == (share < 1));
  }
}

// Blows leave it sunk in by up to 0.07 of the small radius, and sweeps for overlaps that pass on as much as
// they can take that away in 49 steps: bound at twice each. Seen to fail: as above (0.21; 404 of the 500
// steps).
TEST_CASE("A heavy ball that fell on a light one is borne by it, beside many others as alone") {
  constexpr double r = 0.05;
  Space<double> space = floorFor(1e-3, 1, 0.5, 0.5, false);
  space.addBody(ball({0, 0, r}, {0, 0, 0}, r, 1.0));
  space.addBody(ball({0, 0, 12 * r + 1e-3}, {0, 0, -4.43}, 10 * r, 1e4));
  for (int i = 0; i < 400; ++i) {
    space.addBody(ball({3 + 2 * r * (i % 20), 2 * r * (i / 20), r}, {0, 0, 0}, r, 1.0));
  }
  double deepest = 0;
  int deep = 0;
  for (std::size_t step = 0; step < 500; ++step) {
    space.computeDynamics(step);
    const Vec grain = space.body(0).position();
    const Vec heavy = space.body(1).position();
    const double overlap = std::max({r - grain[2], 11 * r - (heavy - grain).norm(), 10 * r - heavy[2]});
    deepest = std::max(deepest, overlap);
    deep += overlap > 0.01 * r ? 1 : 0;
  }
  CHECK(deepest < 0.14 * r);
  CHECK(deep < 100);
}

}  // namespace test_structures
