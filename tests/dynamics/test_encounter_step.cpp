#include "scenes/scenes.hpp"
#include "support/archetypes.hpp"
#include "support/catch.hpp"
#include <gravel/core/random.hpp>
#include <gravel/dynamics/encounter_step.hpp>
#include <gravel/gravity/direct_sum.hpp>

#include <atomic>

using namespace gravel;
using namespace gravel::test;

namespace test_encounter_step {

namespace {

using Vec = Vector3<double>;

constexpr StepLimits<double> wide{0.02, 0.0, 1e6};

template <class S = double>
Bodies<S> made(const std::vector<Body<S>>& list) {
  Bodies<S> bodies;
  for (const Body<S>& body : list) {
    bodies.add(body);
  }
  return bodies;
}

Bodies<double> cloud(std::size_t n, double radius, const Vec& boost = Vec::Zero()) {
  Bodies<double> bodies;
  const CounterRandom random(3);
  for (std::uint64_t i = 0; i < n; ++i) {
    Body<double> body;
    body.position = 10 * random.uniform(20 * i, 0.1, 1) * random.direction(20 * i + 1);
    body.velocity = random.uniform(20 * i + 5, 0.1, 1) * random.direction(20 * i + 3) + boost;
    body.mass = random.uniform(20 * i + 9, 0.5, 2.0);
    body.radius = radius;
    bodies.add(body);
  }
  return bodies;
}

/// The formula of the header, pair by pair, for points.
double slowly(const Bodies<double>& bodies, double G, double softening, const StepLimits<double>& limits) {
  long double sum = 1;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const long double r = std::hypot((bodies[i].position() - bodies[j].position()).norm(), softening);
      const long double v = (bodies[i].velocity() - bodies[j].velocity()).norm();
      const long double a = v / r;
      const long double b = std::sqrt(G * (bodies.masses()[i] + bodies.masses()[j]) / (r * r * r));
      const long double rate = std::pow(std::pow(b, 4) * (std::pow(a, 4) + std::pow(b, 4)) / 2, 0.125L);
      sum += std::pow(rate * limits.largest / limits.factor, 8);
    }
  }
  return static_cast<double>(limits.largest / std::pow(sum, 0.125L));
}

}  // namespace

// Seen to fail: the half under the eighth root left out.
TEST_CASE("A circular orbit of any two bodies is cut into 2 pi / eta steps") {
  for (const double share : {1e-9, 0.3, 0.5}) {
    const auto pair = made(scenes::keplerPair<double>(0.0, share));
    CHECK_THAT(stepFromEncounters(pair, 1.0, 0.0, wide), WithinRel(0.02, 1e-12));
  }
  const auto single = made(scenes::keplerPair<float>(0.0F, 0.3F));
  const StepLimits<float> limits{0.02F, 0.0F, 1e6F};
  CHECK_THAT(double(stepFromEncounters(single, 1.0F, 0.0F, limits)), WithinRel(0.02, 1e-5));
}

// Seen to fail: v_x of single bodies in place of differences; flying by that counts without gravity.
TEST_CASE("The step is that of the formula, for any number of points and any softening") {
  for (const std::size_t n : {2U, 3U, 7U, 50U, 128U}) {
    for (const double softening : {0.0, 0.5}) {
      for (const double largest : {1e-2, 1.0, 1e3}) {
        const StepLimits<double> limits{0.03, 0.0, largest};
        const auto bodies = cloud(n, 0.0);
        CHECK_THAT(stepFromEncounters(bodies, 0.7, softening, limits),
                   WithinRel(slowly(bodies, 0.7, softening, limits), 1e-12));
      }
    }
  }
}

// Seen to fail: v_x of single bodies in place of differences.
TEST_CASE("A boost and a turn round of all velocities change no step") {
  for (const std::size_t n : {60U, 300U}) {
    const auto rest = cloud(n, 0.01);
    const auto boosted = cloud(n, 0.01, Vec(1e3, -2e3, 5e2));
    auto back = rest;
    for (std::size_t i = 0; i < n; ++i) {
      back[i].velocity() = -Vec(back[i].velocity());
    }
    const double h = stepFromEncounters(rest, 0.7, 0.0, wide);
    CHECK_THAT(stepFromEncounters(boosted, 0.7, 0.0, wide), WithinRel(h, 1e-11));
    CHECK(stepFromEncounters(back, 0.7, 0.0, wide) == h);
  }
}

// The figure-eight at its start: body 3 at the origin without acceleration. Its time scale is that of the
// pair at distance 1: sqrt(1/2).
TEST_CASE("A body without acceleration among others is no reason for a short step, nor for a long one") {
  const double h = stepFromEncounters(made(scenes::figureEight<double>()), 1.0, 0.0, wide);
  CHECK(h > 0.6 * 0.02 * std::sqrt(0.5));
  CHECK(h < 0.02 * std::sqrt(0.5));
}

// Seen to fail: flying by that counts without gravity.
TEST_CASE("A fast pass that gravity hardly bends is not resolved, a slow one is") {
  Body<double> one;
  Body<double> two;
  one.mass = two.mass = 0.5;
  two.position = {1, 0, 0};
  const auto stepAt = [&](double speed) {
    two.velocity = {0, speed, 0};
    return stepFromEncounters(made<double>({one, two}), 1.0, 0.0, wide);
  };
  CHECK_THAT(stepAt(0.0), WithinRel(0.02 * std::pow(2.0, 0.125), 1e-12));
  CHECK_THAT(stepAt(1.0), WithinRel(0.02, 1e-12));
  CHECK_THAT(stepAt(100.0), WithinRel(0.02 * std::pow(2.0, 0.125) / 10.0, 1e-6));
}

// Seen to fail: half a radius for the quarter.
TEST_CASE("No pair meets deeper than a quarter of the smaller radius, and a distant one is let come") {
  Body<double> one;
  Body<double> two;
  one.radius = 0.5;
  two.radius = 0.1;
  one.mass = two.mass = 1e-60;
  const auto stepAt = [&](double distance, double speed) {
    two.position = {distance, 0, 0};
    two.velocity = {-speed, 0, 0};
    return stepFromEncounters(made<double>({one, two}), 1.0, 0.0, wide);
  };
  CHECK_THAT(stepAt(0.6, 20.0), WithinRel(0.1 / 4 / 20, 1e-12));
  CHECK_THAT(stepAt(0.3, 20.0), WithinRel(0.1 / 4 / 20, 1e-12));
  CHECK_THAT(stepAt(2.6, 20.0), WithinRel((2.0 + 0.1 / 4) / 20, 1e-12));
  two.radius = 0.0;
  CHECK_THAT(stepAt(0.5, 20.0), WithinRel(0.5 / 4 / 20, 1e-12));
  one.radius = 0.0;
  CHECK(stepAt(0.5, 20.0) == wide.largest);
}

// Seen to fail, at the shortest step for ever, with two points in one place as a pair that is infinitely
// fast.
TEST_CASE("Steps keep to their limits; points at one place, and none at all, ask for nothing") {
  const StepLimits<double> limits{0.02, 1e-3, 0.1};
  const auto pair = made(scenes::keplerPair<double>(0.0, 0.3));
  CHECK(stepFromEncounters(pair, 1e-30, 0.0, limits) == 0.1);
  CHECK(stepFromEncounters(pair, 1e30, 0.0, limits) == 1e-3);
  CHECK(stepFromEncounters(pair, 1e30, 0.0, StepLimits<double>{0.02, 0.0, 0.1}) == 0.1 * 1e-12);
  CHECK(stepFromEncounters(Bodies<double>(), 1.0, 0.0, limits) == 0.1);
  Body<double> point;
  CHECK(stepFromEncounters(made<double>({point}), 1.0, 0.0, limits) == 0.1);
  CHECK(stepFromEncounters(made<double>({point, point}), 1.0, 0.0, limits) == 0.1);
  auto withOthers = scenes::keplerPair<double>(0.0, 0.3);
  const double alone = stepFromEncounters(made<double>(withOthers), 1.0, 0.0, wide);
  withOthers.push_back(withOthers[1]);
  withOthers[1].mass /= 2;
  withOthers[2].mass /= 2;
  const double halved = stepFromEncounters(made<double>(withOthers), 1.0, 0.0, wide);
  CHECK_THAT(halved, WithinRel(alone, 0.1));
  point.mass = 0;
  CHECK(stepFromEncounters(made<double>({point, point}), 1.0, 0.0, limits) == 0.1);
}

// Seen to fail, NaN: 1e-100 as the least square of a distance.
TEST_CASE("Tracers that are near each other ask for nothing, in a scalar of float's range either") {
  using S = MinimalRealOf<float>;
  std::vector<Body<S>> list(3);
  for (std::size_t i = 0; i < list.size(); ++i) {
    list[i].position = {S(1e-9 * static_cast<double>(i)), S(0), S(0)};
    list[i].velocity = {S(0), S(static_cast<double>(i)), S(0)};
    list[i].mass = S(0);
  }
  CHECK(stepFromEncounters(made(list), S(1), S(0), StepLimits<S>{S(0.02), S(0), S(1)}) == S(1));
}

// 1e-15 kg in a circle of 2e-7 m, alone, and among so many tracers that the closest pair is searched. Seen to
// fail: no distance below 5.6e-7 m, and a square of G m T^2 that is 0 (80 steps); among many 0.01, since no
// rate was above the highest number, which Eigen takes for 0.
TEMPLATE_TEST_CASE("Specks that circle each other have their 314 steps a turn, in a user's scalar, too", "",
                   MinimalReal, MinimalRealOf<float>) {
  using S = TestType;
  const double G = 6.6743e-11;
  const double r = 2e-7;
  const double v = std::sqrt(2e-15 * G / r);
  const double turn = 2 * 3.14159265358979324 * r / v;
  for (const std::size_t n : {std::size_t(2), std::size_t(200)}) {
    std::vector<Body<S>> list(n);
    for (std::size_t i = 0; i < n; ++i) {
      list[i].position = {S(i < 2 ? 0.0 : 1.0), S(i == 1 ? r : 0.0), S(0)};
      list[i].velocity = {S(i == 1 ? v : 0.0), S(0), S(0)};
      list[i].mass = S(i < 2 ? 1e-15 : 0.0);
    }
    if (n > 2) {
      list[0].mass = S(2e-15 - 1e-25);  // unlike
      list[1].mass = S(1e-25);
    }
    const S h = stepFromEncounters(made(list), S(G), S(0), StepLimits<S>{S(0.02), S(0), S(100 * turn)});
    CAPTURE(n);
    CHECK_THAT(turn / h.inTest(), WithinRel(314.159, 1e-4));
  }
}

// Many bodies: each with the partner that its acceleration tells of. For a Plummer sphere that is within a
// factor of the closest pairs; here against all pairs of the same bodies.
TEST_CASE("Above the limit the likeliest partners give a step near that of all pairs") {
  for (const std::uint64_t seed : {1U, 2U}) {
    auto bodies = made(scenes::plummerSphere<double>(200, seed));
    const double softening = 0.02;
    DirectSum<double>().accelerations(bodies.positions(), bodies.masses(), 1.0, softening,
                                      bodies.accelerations());
    const double likeliest = stepFromEncounters(bodies, 1.0, softening, wide);
    const double pairs = slowly(bodies, 1.0, softening, wide);
    CAPTURE(seed, likeliest, pairs);
    CHECK(likeliest / pairs < 4.0);
    CHECK(likeliest / pairs > 0.25);
  }
}

// A star with a disc, light or with planets in it, of points, or of spheres in each other; the star fixed or
// not. Seen to fail: pairs that are searched by the masses of the first of each node, pairs with one that is
// fixed left out, bounds that leave out the size of a node; each with its likeliest partner.
TEST_CASE(
    "Above the limit the pair of the largest rate is found where masses are unlike, whatever the order") {
  const CounterRandom random(21);
  std::uint64_t counter = 0;
  const auto between = [&](double low, double high) { return random.uniform(counter++, low, high); };
  for (int scene = 0; scene < 40; ++scene) {
    const std::size_t n = 129 + static_cast<std::size_t>(17 * scene);
    const double radius = scene % 4 < 2 ? 0 : 0.02;
    std::vector<Body<double>> list(n);
    list[0].mass = 1;
    list[0].fixed = scene % 2 == 0;
    list[0].radius = radius;
    for (std::size_t i = 1; i < n; ++i) {
      Body<double>& body = list[i];
      const double r = between(1, 4);
      const double angle = between(0, 6.28);
      body.position = {r * std::cos(angle), r * std::sin(angle), between(-0.1, 0.1)};
      body.velocity = Vec(-std::sin(angle), std::cos(angle), between(-0.1, 0.1)) / std::sqrt(r);
      body.mass = i % 3 == 0 ? 0 : std::pow(10, between(-12, scene % 3 == 0 ? -11 : -2));
      body.radius = i % 2 == 0 && body.mass > 0 ? radius : 0;
    }
    long double most = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const long double touching = list[i].radius + list[j].radius;
        const long double r = std::max<long double>((list[i].position - list[j].position).norm(), touching);
        const Vec v1 = list[i].fixed ? Vec(0, 0, 0) : list[i].velocity;
        const Vec v2 = list[j].fixed ? Vec(0, 0, 0) : list[j].velocity;
        const long double a = (v1 - v2).norm() / r;
        const long double b_sq = (list[i].mass + list[j].mass) / (r * r * r);
        most = std::max(most, b_sq * b_sq * (a * a * a * a + b_sq * b_sq) / 2);
      }
    }
    const StepLimits<double> far{0.02, 0.0, 1e4, 1e9};  // contacts ask for nothing
    auto bodies = made(list);
    DirectSum<double>().accelerations(bodies.positions(), bodies.masses(), 1.0, 0.0, bodies.accelerations());
    const double h = stepFromEncounters(bodies, 1.0, 0.0, far);
    CAPTURE(scene, n);
    CHECK_THAT(h, WithinRel(static_cast<double>(0.02L / std::pow(most, 0.125L)), 1e-12));
    std::reverse(list.begin(), list.end());
    CHECK(stepFromEncounters(made(list), 1.0, 0.0, far) == h);
  }
}

// Two of 1e-9 on a circle beside a star, among tracers, which have no orbit of their own here. Seen to fail:
// masses unlike by the mean of all, of which three bodies have at most three times.
TEST_CASE("A light pair beside a star has its 314 steps a turn, however many tracers there are") {
  auto list = scenes::keplerPair<double>(0.0, 1.0);
  list[0].mass = 1;
  list[0].position = list[0].velocity = {0, 0, 0};
  list[1].mass = 1e-9;
  list[1].position = {1, 0, 0};
  list[1].velocity = {0, 1, 0};
  list.push_back(list[1]);
  list[2].position[0] += 1e-5;
  list[2].velocity[1] += std::sqrt(2e-9 / 1e-5);
  list.resize(200, Body<double>{.position = {5, 0, 0}, .mass = 0});
  const double turn = 2 * 3.14159265358979324 * std::sqrt(1e-15 / 2e-9);
  CHECK_THAT(turn / stepFromEncounters(made(list), 1.0, 0.0, wide), WithinRel(314.159, 1e-5));
}

// Two of 1e-9 on a circle among as many stars of mass 1 as of their own kind, whose mean is half a star. Seen
// to fail: masses unlike by the heaviest alone (1.4 steps a turn).
TEST_CASE("A light pair among stars has its 314 steps a turn, where half of the bodies are light") {
  std::vector<Body<double>> list;
  for (int i = 0; i < 198; ++i) {
    list.push_back({.position = {3.0 * (i + 1), 0, 0}, .mass = i % 2 == 0 ? 1.0 : 1e-9});
  }
  list.push_back({.position = {0, 0, 0}, .mass = 1e-9});
  list.push_back({.position = {1e-5, 0, 0}, .velocity = {0, std::sqrt(2e-9 / 1e-5), 0}, .mass = 1e-9});
  auto bodies = made(list);
  DirectSum<double>().accelerations(bodies.positions(), bodies.masses(), 1.0, 0.0, bodies.accelerations());
  const double turn = 2 * 3.14159265358979324 * std::sqrt(1e-15 / 2e-9);
  CHECK_THAT(turn / stepFromEncounters(bodies, 1.0, 0.0, wide), WithinRel(314.159, 1e-5));
}

/// Counts the pairs that are looked at.
struct CountedRate {
  detail::EncounterRate<double> rate;
  std::atomic<std::size_t>* pairs;

  double of(const detail::PairMember<double>& a, const detail::PairMember<double>& b) const {
    ++*pairs;
    return rate.of(a, b);
  }
  double bound(const detail::PairBounds<double>& a, const detail::PairBounds<double>& b) const {
    return rate.bound(a, b);
  }
};

// Seen to fail: bodies in the order of the curve through the cube around all (8.0e6 pairs of 4000).
TEST_CASE("One body far away does not make the search for the fastest pair one through all pairs") {
  const std::size_t n = 1500;
  auto bodies = made(scenes::plummerSphere<double>(n, 1));
  bodies[0].mass() *= 100;
  for (const double far : {1.0, 1e6, 1e9, 1e30}) {
    bodies[1].position() = Vec(far, 0, 0);
    std::atomic<std::size_t> pairs{0};
    const detail::EncounterRate<double> rate{1.0, 1.0, 0.0};
    const double most = detail::LargestPairRate<double>(bodies).of(CountedRate{rate, &pairs}, 1e300);
    std::vector<detail::PairMember<double>> members;
    for (std::size_t i = 0; i < n; ++i) {
      members.push_back({bodies[i].position(), bodies[i].velocity(), 0, bodies[i].mass(), true});
    }
    double expected = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        expected = std::max(expected, rate.of(members[i], members[j]));
      }
    }
    CAPTURE(far);
    CHECK(most == expected);
    CHECK(pairs < 100 * n);
  }
}

// Seen to fail: tracers counted in the mean mass (0.73 of the step).
TEST_CASE("Tracers leave the likeliest partner what it is") {
  auto bodies = made(scenes::plummerSphere<double>(200, 1));
  DirectSum<double>().accelerations(bodies.positions(), bodies.masses(), 1.0, 0.02, bodies.accelerations());
  const double alone = stepFromEncounters(bodies, 1.0, 0.02, wide);
  for (int i = 0; i < 5000; ++i) {
    Body<double> tracer;
    tracer.position = {1e3, 0, 0};
    tracer.mass = 0;
    bodies.add(tracer);
  }
  CHECK(stepFromEncounters(bodies, 1.0, 0.02, wide) == alone);
}

// Two that are each other's nearest across an edge; in the patch the image has been sheared, and moves on.
// Seen to fail: the likeliest partner for any number (the longest step), distances without images, the
// speed of the sheared image left out.
TEST_CASE("Up to the limit pairs are nearest through the images of a domain") {
  const double omega = 0.3;
  const Vec box(20, 30, 25);
  const auto periodic = Domain<double>::periodic(box);
  const auto patch = Domain<double>::shearPeriodic(box, omega);
  for (const auto& [domain, time] :
       {std::pair{periodic, 0.0}, std::pair{patch, 0.0}, std::pair{patch, 7.3}, std::pair{patch, 1e3}}) {
    const Vec at(9.98, 2, 1);
    const Vec v(0.01, -0.05, 0);
    auto list = scenes::keplerPair<double>(0.0, 1e-3);
    list[0].mass = 1e-14;  // far from both
    list[0].position = {0, 0, 0};
    list[0].velocity = {0, 0, 0};
    list[1].mass = 1e-9;
    list[1].position = at;
    list[1].velocity = v;
    list.push_back(list[1]);
    const Vec apart(0.03, 0.004, 0.001);
    const Vec speed(1e-5, 2e-4, 0);
    Vec x = at + apart;  // outside of the box
    Vec u = v + speed;
    domain.wrap(x, u, time);
    REQUIRE((x - at).norm() > 10);
    list[2].position = x;
    list[2].velocity = u;
    auto open = list;
    open[2].position = at + apart;
    open[2].velocity = v + speed;
    CAPTURE(static_cast<int>(domain.kind()), time);
    CHECK_THAT(stepFromEncounters(made(list), 1.0, 0.0, wide, domain, time),
               WithinRel(stepFromEncounters(made(open), 1.0, 0.0, wide), 1e-8));
  }
}

// One pair among 200 accelerates, by a: its likeliest partner has the mean mass, 1, at r = sqrt(1/a). Seen to
// fail: half that distance, which the test above does not notice.
TEST_CASE("The likeliest partner stands where it alone would cause the acceleration") {
  for (const double a : {100.0, 4.0}) {
    std::vector<Body<double>> list(200);
    for (Body<double>& body : list) {
      body.mass = 1;
    }
    list[0].velocity = {0, 3, 0};
    list[1].velocity = {0, -3, 0};
    auto bodies = made(list);
    bodies[0].acceleration() = Vec(a, 0, 0);
    bodies[1].acceleration() = Vec(-a, 0, 0);
    const double r = std::sqrt(1 / a);
    const double fall = std::pow(r, -1.5);
    const double fly = 3 / r;
    const double rate = std::pow(std::pow(fall, 4) * (std::pow(fly, 4) + std::pow(fall, 4)) / 2, 0.125);
    CHECK_THAT(stepFromEncounters(bodies, 1.0, 0.0, wide), WithinRel(0.02 / rate, 1e-12));
  }
}

// On the flow but for +-0.3 along z, without forces: each meets others by that, and by the flow across 2 r of
// the largest. What stands still meets all of the flow. Seen to fail: velocities with the flow in them (steps
// 33 and 3317 times shorter), the flow across a touching pair left out, and a fixed body overlooked.
TEST_CASE("A wide patch of a disc takes the steps of a narrow one, as long as nothing stands still") {
  const double omega = 0.2;
  for (const double width : {1e2, 1e4}) {
    const auto patch = Domain<double>::shearPeriodic({width, width, 10}, omega);
    std::vector<Body<double>> list(400);
    for (std::size_t i = 0; i < list.size(); ++i) {
      list[i].radius = i % 2 == 0 ? 0.25 : 0.5;
      list[i].mass = 1;
      list[i].position = {width * (static_cast<double>(i / 2) / 200.0 - 0.4975), 0, 0};
      list[i].velocity = {0, -1.5 * omega * list[i].position[0], i % 4 < 2 ? 0.3 : -0.3};
    }
    const double swift = 0.3 + 1.5 * omega * 0.5;
    auto bodies = made(list);
    CHECK_THAT(stepFromMotion(bodies, 0.0, wide, false, patch), WithinRel(0.25 / 4 / swift, 1e-12));
    CHECK_THAT(stepFromEncounters(bodies, 1e-30, 0.0, wide, patch), WithinRel(0.25 / 4 / swift, 1e-12));
    CHECK(stepFromMotion(bodies, 0.0, wide, false, Domain<double>::open()) < 10 / width);
    bodies[200].setFixed(true);
    const double outermost = std::hypot(1.5 * omega * 0.4975 * width, 0.3);
    CHECK_THAT(stepFromMotion(bodies, 0.0, wide, false, patch), WithinRel(0.25 / 4 / outermost, 1e-12));
    CHECK(stepFromEncounters(bodies, 1e-30, 0.0, wide, patch) < 0.26 / 4 / outermost);
  }
}

// Spheres of unequal radii among points, some fixed, and a group that flies by the others at a thousand times
// their speeds, by which no pair of the group asks for anything; and, `size` 0, all in one place. Above the
// limit pairs are searched by a tree, here against all of them, unless it is enough that no sphere moves by a
// quarter of its radius relative to the common centre of mass. That was the rule for all until then: a pile
// of 200 grains about a planet got steps of that on its orbit, one of 100 those of its own motion.
TEST_CASE("No pair among many meets deeper than a quarter of the smaller radius, unless none moves as far") {
  const auto scene = [](std::size_t n, double size, double flyby) {
    std::vector<Body<double>> list(n);
    const CounterRandom random(11);
    for (std::uint64_t i = 0; i < n; ++i) {
      Body<double>& body = list[i];
      const bool group = i % 3 == 0;
      body.position = size * random.uniform(9 * i, 0.0, 1.0) * random.direction(9 * i + 1);
      body.velocity = random.uniform(9 * i + 3, 0.0, 1.0) * random.direction(9 * i + 4);
      body.position[0] += group ? 500 * size : 0;
      body.velocity[1] += group ? flyby : 0;
      body.radius = i % 5 == 0 ? 0 : random.uniform(9 * i + 6, 0.01, 0.5);
      body.fixed = !group && i % 7 == 0;
    }
    return list;
  };
  const auto moves = [](const Body<double>& body) { return body.fixed ? Vec(0, 0, 0) : body.velocity; };
  const auto byPairs = [&](const std::vector<Body<double>>& list) {
    double most = 0;
    for (std::size_t i = 0; i < list.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const double smaller = std::min(list[i].radius, list[j].radius);
        const double r = smaller > 0 ? smaller : list[i].radius + list[j].radius;
        const double gap = (list[i].position - list[j].position).norm() - list[i].radius - list[j].radius;
        if (r > 0) {
          most = std::max(most, (moves(list[i]) - moves(list[j])).norm() / (r / 4 + std::max(0.0, gap)));
        }
      }
    }
    return 1 / most;
  };
  const auto bySingles = [&](const std::vector<Body<double>>& list) {
    Vec v = Vec::Zero();
    for (const Body<double>& body : list) {  // of equal masses
      v += moves(body) / static_cast<double>(list.size());
    }
    const auto isFixed = [](const Body<double>& body) { return body.fixed; };
    v = std::any_of(list.begin(), list.end(), isFixed) ? Vec(0, 0, 0) : v;
    double least = 1e300;
    for (const Body<double>& body : list) {
      if (body.radius > 0 && !body.fixed) {
        least = std::min(least, body.radius / 4 / (body.velocity - v).norm());
      }
    }
    return least;
  };
  for (const std::size_t n : {std::size_t{129}, std::size_t{200}, std::size_t{1001}}) {
    for (const auto& [size, flyby, pairs] :
         {std::tuple{20.0, 0.0, true}, std::tuple{20.0, 1e3, true}, std::tuple{0.0, 0.0, false}}) {
      CAPTURE(n, size, flyby);
      std::vector<Body<double>> list = scene(n, size, flyby);
      const double ofPairs = byPairs(list);
      const double ofSingles = bySingles(list);
      REQUIRE((ofPairs > ofSingles) == pairs);
      const double h = stepFromEncounters(made(list), 1e-30, 0.0, wide);
      CHECK_THAT(h, WithinRel(std::max(ofPairs, ofSingles), 1e-12));
      if (pairs) {
        std::reverse(list.begin(), list.end());
        CHECK(stepFromEncounters(made(list), 1e-30, 0.0, wide) == h);
      }
    }
  }
  std::vector<Body<double>> points(200);
  points[0].velocity = {1, 0, 0};
  CHECK(stepFromEncounters(made(points), 1e-30, 0.0, StepLimits<double>{0.02, 0.0, 1.0}) == 1.0);
}

// A shoal of 200 spheres flies at a fixed one, 1 m before the first; another falls at 8 m s^-2, each as if to
// a partner of its mass. Seen to fail: the fixed one as mass at rest in the mean, in whose frame the shoal
// hardly moves (40 and 53 times the step).
TEST_CASE("Many that move as one have the steps of one alone where something is fixed") {
  std::vector<Body<double>> list(201);
  list[0].fixed = true;
  for (std::size_t i = 0; i < list.size(); ++i) {
    list[i].mass = list[i].radius = 1;
    list[i].velocity = {i > 0 ? 100.0 : 0.0, 0, 0};
    list[i].position = {i > 0 ? -3.0 * static_cast<double>(i) : 0.0, 0, 0};
  }
  CHECK_THAT(stepFromEncounters(made(list), 1e-30, 0.0, wide), WithinRel((1 + 0.25) / 100, 1e-12));
  for (std::size_t i = 0; i < list.size(); ++i) {
    list[i].radius = 0;
  }
  auto bodies = made(list);
  for (std::size_t i = 1; i < list.size(); ++i) {
    bodies[i].velocity() = Vec(0, 0, 0);
    bodies[i].acceleration() = Vec(8, 0, 0);
  }
  const double s = 1 / 8.0;
  CHECK_THAT(stepFromEncounters(bodies, 1.0, 0.0, wide),
             WithinRel(0.02 * std::pow(2.0, 0.125) * std::pow(s, 0.75), 1e-12));
}

// Seen to fail: 1/next = 1.9/wanted - 0.9/last.
TEST_CASE("The reversible step is its own inverse, and the step wanted where that is constant or far") {
  const CounterRandom random(2);
  for (std::uint64_t k = 0; k < 100; ++k) {
    const double last = random.uniform(2 * k, 0.7, 1.4);
    const double next = reversibleStep(last, 1.0);
    CHECK_THAT(1 / next + 1 / last, WithinRel(2.0, 1e-14));
    CHECK_THAT(reversibleStep(next, 1.0), WithinRel(last, 1e-14));
  }
  CHECK(reversibleStep(0.3, 0.3) == 0.3);
  CHECK(reversibleStep(0.3, 1.0) == 1.0);
  CHECK(reversibleStep(100.0, 1.0) == 1.0);
  CHECK(reversibleStep(0.0, 1.0) == 1.0);
  CHECK(reversibleStep(1.0, 1e-300) == 1e-300);
}

// Seen to fail: a pair of fixed stars asks for steps of its fall, 4e-10.
TEST_CASE("Fixed bodies ask for no step of each other, and all the same of what moves about them") {
  const auto scene = [](bool second, bool pulled) {
    std::vector<Body<double>> list(3);
    list[0].mass = list[1].mass = 1e6;
    list[0].position = {0, 0, 0};
    list[1].position = {1e-4, 0, 0};
    list[0].fixed = list[1].fixed = true;
    list[2].mass = 1e-3;
    list[2].position = {pulled ? 1.0 : 1e12, 0, 0};
    if (!second) {
      list.erase(list.begin() + 1);
    }
    return stepFromEncounters(made(list), 1.0, 0.0, StepLimits<double>{0.02, 0.0, 1.0});
  };
  CHECK_THAT(scene(true, false), WithinRel(1.0, 1e-12));
  CHECK(scene(true, true) < 1e-3);
  // A second star doubles the rate of each pair's square, two equal rates the eighth powers' sum.
  CHECK_THAT(scene(true, true), WithinRel(scene(false, true) / std::pow(2.0, 0.125), 1e-3));
}

// Seen to fail: all were taken.
TEST_CASE("Limits of steps out of range are refused, naming which") {
  const Bodies<double> bodies;
  const auto refuses = [&](const StepLimits<double>& limits, const char* what) {
    CHECK_THROWS_WITH(stepFromEncounters(bodies, 1.0, 0.0, limits), ContainsSubstring(what));
    CHECK_THROWS_WITH(stepFromMotion(bodies, 0.0, limits), ContainsSubstring(what));
  };
  refuses({.factor = 0.0}, "factor of steps is 0");
  refuses({.smallest = std::nan("")}, "smallest step is nan");
  refuses({.largest = 0.0}, "largest step is 0");
  refuses({.contactSteps = -1.0}, "contact steps in a step is -1");
}

}  // namespace test_encounter_step
