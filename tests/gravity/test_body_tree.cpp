#include "support/catch.hpp"
#include "support/gravity_scenes.hpp"
#include <gravel/gravity/field_strength.hpp>
#include <gravel/gravity/tree_moments.hpp>

using namespace gravel;
using namespace gravel::test;
using Tree = gravel::detail::BodyTree<double, double>;

namespace {

Tree treeOf(const PointMasses<double>& points, std::uint32_t leafSize) {
  Tree tree;
  tree.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    tree.x[i] = points.positions[i][0];
    tree.y[i] = points.positions[i][1];
    tree.z[i] = points.positions[i][2];
    tree.m[i] = points.masses[i];
    tree.body[i] = static_cast<std::uint32_t>(i);
  }
  tree.build(leafSize);
  return tree;
}

/// Every body once; children tile their parent; groups hold no parent and child.
void checkShape(const Tree& tree, const PointMasses<double>& points) {
  std::vector<int> seen(points.size(), 0);
  for (std::size_t row = 0; row < tree.size(); ++row) {
    const std::uint32_t i = tree.body[row];
    ++seen[i];
    REQUIRE(points.positions[i] == Vector3<double>(tree.x[row], tree.y[row], tree.z[row]));
    REQUIRE(points.masses[i] == tree.m[row]);
  }
  REQUIRE(seen == std::vector<int>(points.size(), 1));
  REQUIRE(tree.levels.back() == tree.cells.size());
  std::size_t group = 0;
  for (std::size_t c = 0; c < tree.cells.size(); ++c) {
    while (tree.levels[group + 1] <= c) {
      ++group;
    }
    const auto& cell = tree.cells[c];
    if (!cell.isLeaf()) {
      REQUIRE(cell.child >= tree.levels[group + 1]);
      std::uint32_t at = cell.first;
      for (std::uint32_t child = cell.child; child < cell.child + cell.children; ++child) {
        REQUIRE(tree.cells[child].first == at);
        REQUIRE(tree.cells[child].count() > 0);
        at = tree.cells[child].last;
      }
      REQUIRE(at == cell.last);
      REQUIRE(cell.children > 1);
    }
  }
}

}  // namespace

TEST_CASE("cells tile the bodies, in every scene, and leaves are small") {
  for (const char* name : gravityScenes) {
    const auto points = gravityScene<double>(name, 3000);
    const Tree tree = treeOf(points, 16);
    CAPTURE(name);
    checkShape(tree, points);
    for (const auto& cell : tree.cells) {
      if (cell.isLeaf()) {
        CHECK(cell.count() <= 16);
      }
    }
  }
}

TEST_CASE("a tree made in the order of an earlier one is the tree made afresh, coincident bodies and all") {
  const CounterRandom random(31);
  for (const char* name : gravityScenes) {
    auto points = gravityScene<double>(name, 3000);
    Tree used = treeOf(points, 16);
    for (std::size_t i = 0; i < 200; ++i) {  // pairs come to one place: only their numbers tell them apart
      points.positions[i] = points.positions[i + 1000];
    }
    CAPTURE(name);
    double extent = 0;
    for (const Vector3<double>& x : points.positions) {
      extent = std::max(extent, x.norm());
    }
    for (const double step : {0.0, 1e-6, 1e-3, 1.0}) {  // of the extent: at the last nothing is in order
      for (std::size_t i = 400; i < 900; ++i) {
        points.positions[i] += step * extent * random.direction(i);
      }
      const Tree fresh = treeOf(points, 16);
      used.resize(points.size());
      for (std::size_t row = 0; row < points.size(); ++row) {
        const std::uint32_t i = used.body[row];
        used.x[row] = points.positions[i][0];
        used.y[row] = points.positions[i][1];
        used.z[row] = points.positions[i][2];
        used.m[row] = points.masses[i];
      }
      used.build(16);
      checkShape(used, points);
      REQUIRE(used.body == fresh.body);
      REQUIRE(used.x == fresh.x);
      REQUIRE(used.levels == fresh.levels);
      REQUIRE(used.cells.size() == fresh.cells.size());
      for (std::size_t c = 0; c < fresh.cells.size(); ++c) {
        REQUIRE(used.cells[c].first == fresh.cells[c].first);
        REQUIRE(used.cells[c].last == fresh.cells[c].last);
        REQUIRE(used.cells[c].child == fresh.cells[c].child);
      }
    }
  }
}

TEST_CASE("two clusters a million radii apart are each divided to the end") {
  auto points = randomMasses<double>(1000, 95, 1e-6);
  for (std::size_t i = 0; i < 500; ++i) {
    points.positions[i][0] += 1.0;
  }
  const Tree tree = treeOf(points, 16);
  checkShape(tree, points);
  for (const auto& cell : tree.cells) {
    CHECK((!cell.isLeaf() || cell.count() <= 16));
  }
}

TEST_CASE("bodies at one place stay in one leaf") {
  PointMasses<double> points{std::vector<Vector3<double>>(100, Vector3<double>(1, 2, 3)),
                             std::vector<double>(100, 1.0)};
  checkShape(treeOf(points, 16), points);
  CHECK(treeOf(points, 16).cells.size() == 1);
  points.positions.push_back({4, 4, 4});
  points.masses.push_back(1.0);
  const Tree tree = treeOf(points, 16);
  checkShape(tree, points);
  CHECK(tree.cells.size() == 3);
}

TEST_CASE("centres, radii and moments of cells are those of their bodies") {
  const auto points = gravityScene<double>("rubble pile", 2000);
  Tree tree = treeOf(points, 16);
  gravel::detail::TreeMoments<double, double, gravel::detail::HarmonicTerms> moments;
  const int order = 5;
  moments.compute(tree, order);
  using X = gravel::detail::Expansion<gravel::detail::HarmonicTerms>;
  std::vector<double> q(moments.terms());
  for (std::size_t c = 0; c < tree.cells.size(); ++c) {
    const auto& cell = tree.cells[c];
    std::vector<double> sum(q.size(), 0.0);
    double mass = 0;
    double radius = 0;
    for (std::uint32_t i = cell.first; i < cell.last; ++i) {
      const Vector3<double> s = cell.centre - Vector3<double>(tree.x[i], tree.y[i], tree.z[i]);
      X::regular(order, s[0], s[1], s[2], q.data());
      for (std::size_t k = 0; k < q.size(); ++k) {
        sum[k] += tree.m[i] * q[k];
      }
      mass += tree.m[i];
      radius = std::max(radius, s.norm());
    }
    CHECK_THAT(cell.mass, WithinRel(mass, 1e-13));
    CHECK(static_cast<double>(cell.radius) >= radius);
    CHECK(static_cast<double>(cell.radius) <= (cell.count() <= 512 ? 1.000003 : 1.5) * radius);
    CHECK(cell.spread <= cell.radius * 1.00001F);
    for (std::size_t k = 0; k < q.size(); ++k) {
      REQUIRE_THAT(moments.of(c)[k], WithinAbs(sum[k], 1e-14 * mass));  // all lengths are below 1
    }
    for (std::size_t k = 1; k < 4; ++k) {
      CHECK_THAT(moments.of(c)[k], WithinAbs(0.0, 1e-15 * mass * 2));  // about the centre of mass
    }
  }
}

TEST_CASE("the first look at the field is right within a factor of three for most bodies") {
  for (const char* name : gravityScenes) {
    const auto points = gravityScene<double>(name, 1500);
    Tree tree = treeOf(points, 16);
    gravel::detail::TreeMoments<double, double, gravel::detail::HarmonicTerms> moments;
    moments.compute(tree, 2);
    gravel::detail::FieldStrength<double, double> strength;
    strength.compute(tree, 1.0, 2, 0.0, gravel::detail::PeriodicImages<double, double>(),
                     gravel::detail::ImageField<double, double>());
    const GravityOracle oracle = bruteGravity(points.positions, points.masses, 1.0, 0.0);
    std::size_t close = 0;
    for (const auto& cell : tree.cells) {
      if (cell.isLeaf()) {
        for (std::uint32_t i = cell.first; i < cell.last; ++i) {
          const auto a = static_cast<double>(oracle.accelerations[tree.body[i]].norm());
          close += cell.weight > a / 3 && cell.weight < 3 * a ? 1U : 0U;
        }
      }
    }
    CAPTURE(name, close);
    CHECK(close > 750);  // in a thin patch the nearest neighbours of a body pull more than the rest
  }
}

TEST_CASE(
    "bodies at rims: their acceleration is found within a third, and their cell is allowed what they bear") {
  const int order = 6;
  const auto points = gravityScene<double>("nine decades of mass", 1500);
  const GravityOracle oracle = bruteGravity(points.positions, points.masses, 1.0, 0.0);
  Tree tree = treeOf(points, 24);
  gravel::detail::TreeMoments<double, double, gravel::detail::HarmonicTerms>().compute(tree, order);
  gravel::detail::RimStrength<double, double> rims;
  rims.begin(tree, order, 0.0);
  std::vector<gravel::detail::ImageCell> todo;
  gravel::detail::GroupField<double> all;
  all.near = {{0, 0}};
  for (std::uint32_t c = 0; c < tree.cells.size(); ++c) {
    tree.cells[c].weight = 1e9;
    if (tree.cells[c].isLeaf()) {
      rims.look(tree, c, all, {Vector3<double>::Zero()}, todo);
    }
  }
  const double least = 1.0;
  rims.spare(tree, 0.5, least);
  std::size_t found = 0;
  std::size_t close = 0;
  for (const auto& cell : tree.cells) {
    double bearable = 1e9;
    for (std::uint32_t i = cell.first; i < cell.last && cell.isLeaf() && cell.count() > 1; ++i) {
      const double strength = rims.strength(i);
      const Vector3<double> x(tree.x[i], tree.y[i], tree.z[i]);
      const double d = (x - cell.centre).norm() / static_cast<double>(cell.radius);
      const double place = std::pow((d + 0.5) / 1.5, order);
      if (place > 1 / 1.5 + 1e-9) {
        const auto a = static_cast<double>(oracle.accelerations[tree.body[i]].norm());
        ++found;
        close += std::abs(strength - a) <= a / 3 ? 1U : 0U;
        bearable = std::min(bearable, 0.5 * std::max(strength, least) / place);
      }
    }
    if (bearable < 1e9) {
      CHECK_THAT(cell.weight, WithinRel(bearable, 1e-9));
    }
  }
  CAPTURE(found, close);
  CHECK(found > 100);
  CHECK(10 * close >= 9 * found);
}

TEST_CASE("the field of far masses near the centre of a group is that of its tide, to second order") {
  const Vector3<double> d(3, -1, 2);
  gravel::detail::GroupField<double> field;
  const double r_sq = d.squaredNorm();
  field.addFar(d, 5 / (r_sq * std::sqrt(r_sq)), 5 / (r_sq * r_sq * std::sqrt(r_sq)));
  const auto error = [&](double step) {
    const Vector3<double> x = step * Vector3<double>(0.3, 0.5, -0.2);
    const Vector3<double> e = d - x;
    return (field.far + field.tide * x - 5 / std::pow(e.norm(), 3) * e).norm();
  };
  CHECK_THAT(error(0.1) / error(0.05), WithinAbs(4.0, 0.3));
}
