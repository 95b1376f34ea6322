// Contacts of dual numbers: derivatives go through them. Compiled by itself with -O0: g++ 12 ends with an
// internal error at -O1.
#include "support/catch.hpp"
#include <gravel/contact/contact_solver.hpp>
#include <gravel/contact/late_blows.hpp>
#include <gravel/contact/narrow_phase.hpp>

#include <unsupported/Eigen/AutoDiff>

using namespace gravel;
using namespace gravel::test;

namespace {

using Dual = Eigen::AutoDiffScalar<Eigen::Vector2d>;

}  // namespace

// A ball on a floor, r = 1/2, that friction brings from slipping to rolling: v = 5/7 v_0 + 2/7 r w_0, and
// r w is the same. At v_0 = w_0 = 0, where nothing is to be changed, derivatives are as everywhere. Seen to
// fail: spins written back where their values had changed: that of w stayed (0, 1).
TEST_CASE("Contacts change derivatives of what does not move") {
  Bodies<Dual> bodies;
  Body<Dual> ball;
  ball.radius = Dual(0.5);
  ball.mass = Dual(1);
  ball.position = Vector3<Dual>(Dual(0), Dual(0), Dual(0.5));
  ball.velocity[0] = Dual(0.0, Eigen::Vector2d(1, 0));
  ball.velocity[2] = Dual(-1.0);  // falls, for an impulse that carries the friction
  ball.angularVelocity[1] = Dual(0.0, Eigen::Vector2d(0, 1));
  bodies.add(ball);
  Material<Dual> rough;
  rough.staticFriction = rough.kineticFriction = Dual(10);
  const std::vector<HalfSpace<Dual>> floor{{Vector3<Dual>(Dual(0), Dual(0), Dual(1)), Dual(0), rough}};
  const std::vector<Material<Dual>> materials{rough};
  ContactList<Dual> contacts;
  NarrowPhase<Dual> narrow;
  NarrowPhaseSettings<Dual> settings;
  settings.margin = Dual(1e-3);
  narrow.find({}, bodies, Domain<Dual>::open(), materials, floor, settings, contacts);
  REQUIRE(contacts.size() == 1);
  ContactSolver<Dual> solver;
  solver.solve(contacts, bodies, Dual(0.01));
  const Dual v = bodies[0].velocity()[0];
  const Dual w = bodies[0].angularVelocity()[1];
  CHECK(v.value() == 0);
  CHECK(w.value() == 0);
  CHECK((v.derivatives() - Eigen::Vector2d(5.0 / 7, 1.0 / 7)).cwiseAbs().maxCoeff() < 1e-14);
  CHECK((w.derivatives() - Eigen::Vector2d(10.0 / 7, 2.0 / 7)).cwiseAbs().maxCoeff() < 1e-14);
}

// The approach lacks da (t - h/2)/2 by the change da of the acceleration, here one of 0 with a derivative.
// Seen to fail: the share of it that counts as 0/0 (the work was not a number).
TEST_CASE("A blow of which nothing is to be made up keeps numbers, and changes by its derivative") {
  Bodies<Dual> bodies;
  Body<Dual> ball;
  ball.radius = Dual(1);
  ball.mass = Dual(2);
  bodies.add(ball);
  bodies.accelerations()[0] = Vector3<Dual>(Dual(0), Dual(0), Dual(-9.8));
  const Vector3<Dual> zero(Dual(0), Dual(0), Dual(0));
  std::vector<Impact<Dual>> impacts(1);
  impacts[0].second = staticPartner;
  impacts[0].key2 = boundaryKey(0);
  impacts[0].time = Dual(0.75);
  impacts[0].speed = Dual(1);
  impacts[0].normal = Vector3<Dual>(Dual(0), Dual(0), Dual(-1));
  impacts[0].distance = Dual(1);
  impacts[0].impulse = {Dual(3), zero, zero};  // e = 1/2
  LateBlows<Dual> late;
  late.take(std::span<const Impact<Dual>>(impacts), bodies, Dual(0), 0);
  bodies.accelerations()[0][2] = Dual(-9.8, Eigen::Vector2d(1, 0));
  const auto made = late.makeUp(
      bodies, Domain<Dual>::open(), Dual(1), Dual(1),
      [&](std::size_t k) -> ContactImpulse<Dual>& { return impacts[k].impulse; },
      [&](std::size_t) { return zero; });
  CHECK(made.work.value() == 0);
  CHECK(made.restitutionLoss.value() == 0);
  CHECK(bodies.velocities()[0][2].value() == 0);
  // dv = (1 + e) du, du = -da (t - h/2)/2 along the way up.
  CHECK_THAT(bodies.velocities()[0][2].derivatives()[0], WithinAbs(-1.5 * 0.125, 1e-15));
}
