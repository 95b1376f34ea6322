#include "cases.hpp"

#include <set>

using namespace gravel;
using namespace gravel::test;

TEMPLATE_LIST_TEST_CASE("storage: what is written to a field is read back and touches no other", "[storage]",
                        AllCases) {
  TestType c;
  auto& storage = c.bodies.storage();
  const std::size_t n = 37;  // no multiple of any block
  storage.resize(n);
  REQUIRE(storage.size() == n);
  for (std::size_t i = 0; i < n; ++i) {
    writeCoded(storage, i, static_cast<int>(i));
  }
  for (std::size_t i = 0; i < n; ++i) {
    INFO("body " << i);
    CHECK(wrongField(storage, i, static_cast<int>(i)) == "");
  }
}

TEMPLATE_LIST_TEST_CASE("storage: growing and shrinking keep the bodies that stay", "[storage]", AllCases) {
  TestType c;
  auto& storage = c.bodies.storage();
  std::size_t kept = 0;
  for (const std::size_t n : {1U, 2U, 15U, 16U, 17U, 9U, 40U, 300U, 33U, 1000U}) {
    kept = std::min(kept, n);
    storage.resize(n);
    for (std::size_t i = 0; i < kept; ++i) {
      INFO("body " << i << " of " << n);
      REQUIRE(wrongField(storage, i, static_cast<int>(i)) == "");
    }
    for (std::size_t i = kept; i < n; ++i) {
      writeCoded(storage, i, static_cast<int>(i));
    }
    kept = n;
  }
}

using OwnStorages = std::tuple<StorageOf<float, SoA>, StorageOf<double, SoA>, StorageOf<long double, SoA>,
                               StorageOf<double, AoS>, StorageOf<float, AoSoA<4>>,
                               StorageOf<double, AoSoA<8>>, StorageOf<long double, AoSoA<16>>>;

TEMPLATE_LIST_TEST_CASE("storage: a new body is zero, also where another one stood before", "[storage]",
                        OwnStorages) {
  using S = typename TestType::Scalar;
  TestType storage;
  storage.resize(20);
  for (std::size_t i = 0; i < 20; ++i) {
    writeCoded(storage, i, 5);
    storage.at(fields::Id{}, i) = 9;
  }
  storage.resize(3);
  storage.resize(50);
  for (std::size_t i = 3; i < 50; ++i) {
    std::string notZero;
    forEachField([&]<class F>(F f) {
      bool zero = false;
      if constexpr (IntegerField<F>) {
        zero = storage.at(f, i) == 0;
      } else if constexpr (F::width == 1) {
        zero = storage.at(f, i) == S(0);
      } else {
        zero = storage.at(f, i).squaredNorm() == S(0);
      }
      if (!zero) {
        notZero += std::string(F::name) + " ";
      }
    });
    INFO("body " << i);
    CHECK(notZero == "");
  }
}

TEMPLATE_LIST_TEST_CASE("storage: reserve keeps the bodies and saves the move on growth", "[storage]",
                        OwnStorages) {
  TestType storage;
  storage.resize(5);
  for (std::size_t i = 0; i < 5; ++i) {
    writeCoded(storage, i, static_cast<int>(i));
  }
  storage.reserve(500);
  const auto* before = &storage.at(fields::Mass{}, 0);
  storage.resize(500);
  CHECK(&storage.at(fields::Mass{}, 0) == before);
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(wrongField(storage, i, static_cast<int>(i)) == "");
  }
}

// A first-level cache has 64 sets of 64-byte lines, eight ways. With a capacity that is a power of two (seen
// with "round up to 16" and doubling) all columns of a body fall into one set, and 31 columns do not fit
// eight ways.
TEMPLATE_TEST_CASE("storage: the columns of one body in SoA spread over the sets of a cache", "[storage]",
                   GRAVEL_TEST_TYPES(double, float, long double)) {
  for (const std::size_t n : {16U, 64U, 1000U, 1024U, 4096U, 65536U}) {
    StorageOf<TestType, SoA> storage;
    for (std::size_t size = 1; size < n; size *= 2) {
      storage.resize(size);
    }
    storage.resize(n);
    const auto stride =
        static_cast<std::size_t>(&storage.at(fields::Radius{}, 0) - &storage.at(fields::Mass{}, 0));
    int perSet[64] = {};
    int most = 0;
    for (std::size_t column = 0; column < static_cast<std::size_t>(RealFields::columns); ++column) {
      most = std::max(most, ++perSet[column * stride * sizeof(TestType) / 64 % 64]);
    }
    INFO("n = " << n << ", stride = " << stride);
    CHECK(most <= 8);
  }
}

TEST_CASE("storage: the layouts put bodies where their names say", "[storage]") {
  const auto steps = [](auto storage) {
    storage.resize(64);
    const auto* x = storage.at(fields::Position{}, 0).data();
    return std::pair{storage.at(fields::Position{}, 1).data() - x,
                     storage.at(fields::Position{}, 8).data() - x};
  };
  CHECK(steps(StorageOf<double, SoA>()) == std::pair<std::ptrdiff_t, std::ptrdiff_t>(1, 8));
  CHECK(steps(StorageOf<double, AoS>()) ==
        std::pair<std::ptrdiff_t, std::ptrdiff_t>(RealFields::columns, 8 * RealFields::columns));
  CHECK(steps(StorageOf<double, AoSoA<8>>()) ==
        std::pair<std::ptrdiff_t, std::ptrdiff_t>(1, 8 * RealFields::columns));
}

TEST_CASE("storage: a user's particles are bodies in place, and what gravel does not know moves along",
          "[storage]") {
  std::vector<Particle<double>> particles(5);
  for (std::size_t i = 0; i < 5; ++i) {
    particles[i].x[0] = static_cast<double>(i);
    particles[i].m = 1.0;
    particles[i].species = static_cast<int>(10 + i);
  }
  Bodies<double, ParticleStorage<double>> bodies{ParticleStorage<double>(particles)};
  REQUIRE(bodies.size() == 5);

  bodies[2].velocity() = Vector3<double>(7, 8, 9);
  CHECK(particles[2].v[1] == 8.0);
  particles[3].x[2] = -4.0;
  CHECK(bodies[3].position().z() == -4.0);

  const auto stillPairs = [&] {
    for (const Particle<double>& p : particles) {
      CHECK(p.species == 10 + static_cast<int>(p.name));
      CHECK(p.x[0] == static_cast<double>(p.name));
    }
  };
  const std::size_t order[] = {3, 0, 1, 4, 2};
  bodies.reorder(order);
  CHECK(particles[0].name == 3);
  CHECK(particles[4].name == 2);
  stillPairs();
  bodies.remove(BodyId{0});
  CHECK(particles.size() == 4);
  stillPairs();
}

TEST_CASE("storage: a storage of gravel's with one field bound to a user's array reads and writes that array",
          "[storage]") {
  std::vector<Vector3<float>> positions(3, Vector3<float>(1.0F, 2.0F, 3.0F));
  BoundStorage<float> storage(positions);
  for (std::size_t i = 0; i < 3; ++i) {
    storage.at(fields::Mass{}, i) = 1.0F;
  }
  Bodies<float, BoundStorage<float>> bodies(storage);
  bodies[1].position() += Vector3<float>(0.0F, 0.0F, 0.5F);
  CHECK(positions[1].z() == 3.5F);
  const BodyId id = bodies.add(sampleBody<float>(6));
  CHECK(positions.size() == 4);
  CHECK(positions[bodies.indexOf(id)].x() == 6.0F);
}

// --- static
// ---------------------------------------------------------------------------------------------------

static_assert(BodyStorage<StorageOf<float, SoA>> && BodyStorage<StorageOf<double, AoS>>);
static_assert(BodyStorage<StorageOf<long double, AoSoA<1>>> && BodyStorage<StorageOf<MinimalReal, SoA>>);
static_assert(BodyStorage<MinimalStorage<double>> && BodyStorage<MinimalStorage<MinimalReal>>);
static_assert(BodyStorage<ParticleStorage<float>> && BodyStorage<BoundStorage<double>>);
static_assert(!BodyStorage<int> && !BodyStorage<std::vector<double>> && !BodyStorage<SoA>);

namespace {

/// Everything but a writable field F.
template <class F>
struct ReadOnlyIn : StorageOf<double, SoA> {
  using Base = StorageOf<double, SoA>;
  using Base::at;
  decltype(auto) at(F f, std::size_t i) const { return Base::at(f, i); }
  decltype(auto) at(F f, std::size_t i) { return std::as_const(*this).at(f, i); }
};

}  // namespace

// Of the vectors nothing can be said: Eigen's read-only maps have an operator= that fails only when it is
// compiled.
TEST_CASE(
    "storage: the concept refuses a storage that cannot write one of its scalars, quaternions or integers",
    "[storage]") {
  int refused = 0;
  forEachField([&]<class F>(F) {
    INFO("field " << F::name);
    if constexpr (IntegerField<F>) {
      CHECK_FALSE(BodyStorage<ReadOnlyIn<F>>);
      ++refused;
    } else if constexpr (F::width != 3) {
      CHECK_FALSE(BodyStorage<ReadOnlyIn<F>>);
      ++refused;
    }
  });
  CHECK(refused == 7);
}
