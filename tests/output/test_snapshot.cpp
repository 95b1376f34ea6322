#include "support/catch.hpp"
#include "support/temporary_file.hpp"
#include <gravel/core/random.hpp>
#include <gravel/output/snapshot.hpp>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>

using namespace gravel;
using namespace gravel::test;

namespace {

template <class S, class Layout>
Bodies<S, Layout> some() {
  Bodies<S, Layout> bodies;
  const CounterRandom random(4);
  for (std::uint64_t i = 0; i < 23; ++i) {
    Body<S> body;
    body.position = random.direction(20 * i).template cast<S>() / S(3);
    body.velocity = random.direction(20 * i + 1).template cast<S>() / S(7);
    body.angularVelocity = random.direction(20 * i + 2).template cast<S>() / S(11);
    body.mass = S(random.uniform(20 * i + 19, 1, 2));
    body.radius = S(0.1);
    body.fixed = i % 5 == 0;
    body.material = MaterialId{static_cast<std::uint32_t>(i % 3)};
    if (i % 2 == 0) {
      body.inertia = S(0.123) / S(i + 1);
    }
    bodies.add(body, BodyId{100 + 3 * i});
    bodies[i].force() = Vector3<S>(S(1) / S(3), S(i), S(-2));
    bodies[i].angularAcceleration() = Vector3<S>(S(i) / S(9), S(0), S(1e-30L));
  }
  return bodies;
}

template <class A, class B>
bool sameBits(const A& a, const B& b) {
  bool same = a.size() == b.size();
  for (std::size_t i = 0; same && i < a.size(); ++i) {
    forEachField([&]<class F>(F field) {
      if constexpr (RealField<F>) {
        if constexpr (F::width == 1) {
          same = same && a.storage().at(field, i) == b.storage().at(field, i);
        } else if constexpr (F::width == 4) {
          same = same && a.storage().at(field, i).coeffs() == b.storage().at(field, i).coeffs();
        } else {
          same = same && a.storage().at(field, i) == b.storage().at(field, i);
        }
      } else {
        same = same && a.storage().at(field, i) == b.storage().at(field, i);
      }
    });
  }
  return same;
}

/// A file whose checksum fits, with the head of a record of so many doubles and nothing after it.
std::vector<char> headOfRecord(const std::string& name, std::uint64_t doubles) {
  std::vector<unsigned char> bytes(detail::snapshotMagic,
                                   detail::snapshotMagic + sizeof detail::snapshotMagic - 1);
  const std::uint64_t head[3] = {name.size(), sizeof(double), doubles};
  const auto* first = reinterpret_cast<const unsigned char*>(head);
  bytes.insert(bytes.end(), first, first + sizeof head);
  bytes.insert(bytes.end(), name.begin(), name.end());
  const std::uint64_t sum = detail::fnv1a(detail::fnvStart, bytes.data(), bytes.size());
  const auto* tail = reinterpret_cast<const unsigned char*>(&sum);
  bytes.insert(bytes.end(), tail, tail + sizeof sum);
  return {bytes.begin(), bytes.end()};
}

}  // namespace

TEMPLATE_TEST_CASE("Bodies come back from a file with every bit of every field", "", (std::pair<float, SoA>),
                   (std::pair<double, AoS>), (std::pair<long double, AoSoA<8>>)) {
  using S = typename TestType::first_type;
  const auto bodies = some<S, typename TestType::second_type>();
  const TemporaryFile file("bodies");
  SnapshotWriter out;
  saveBodies(bodies, out);
  out.write(file.path());
  SnapshotReader in(file.path());
  const Bodies<S, SoA> back = loadBodies<S>(in);
  CHECK(sameBits(bodies, back));
  CHECK(back[7].id() == BodyId{121});
  CHECK(back.nextId() == bodies.nextId());
  CHECK(back.indexOf(BodyId{121}) == 7);
}

// Seen to be refused, since its moment of inertia is beyond a float's range; its factor is not.
TEST_CASE("A giant planet in single precision that is no homogeneous sphere comes back from a file") {
  Bodies<float> bodies;
  Body<float> jupiter;
  jupiter.mass = 1.898e27F;
  jupiter.radius = 6.9911e7F;
  bodies.add(jupiter);
  bodies[0].inertiaFactor() = 0.276F;
  const TemporaryFile file("jupiter");
  SnapshotWriter out;
  saveBodies(bodies, out);
  out.write(file.path());
  SnapshotReader in(file.path());
  CHECK(sameBits(bodies, loadBodies<float>(in)));
}

TEST_CASE("Values and arrays come back in order, and only in order") {
  const TemporaryFile file("order");
  SnapshotWriter out;
  const double numbers[3] = {0.1, -0.0, std::numeric_limits<double>::denorm_min()};
  out.array("numbers", numbers, 3);
  out.value("flag", std::uint8_t{1});
  out.write(file.path());
  {
    SnapshotReader in(file.path());
    const std::vector<double> back = in.array<double>("numbers");
    REQUIRE(back.size() == 3);
    CHECK(std::memcmp(back.data(), numbers, sizeof numbers) == 0);
    CHECK(in.value<std::uint8_t>("flag") == 1);
    CHECK_THROWS_WITH(in.value<double>("more"), ContainsSubstring("ends before 'more'"));
  }
  SnapshotReader in(file.path());
  CHECK_THROWS_WITH(in.value<std::uint8_t>("flag"),
                    ContainsSubstring("'numbers'") && ContainsSubstring("'flag'"));
}

// Seen to fail: the second file held the checksum of the first, and both were taken.
TEST_CASE("What is written twice is the same file twice, and what goes on after the end is refused") {
  const TemporaryFile file("twice");
  SnapshotWriter out;
  out.value("one", 1.0);
  out.write(file.path());
  const auto size = std::filesystem::file_size(file.path());
  out.write(file.path());
  CHECK(std::filesystem::file_size(file.path()) == size);
  out.value("two", 2.0);
  out.write(file.path());
  SnapshotReader in(file.path());
  CHECK(in.value<double>("one") == 1.0);
  CHECK_THROWS_WITH(in.requireEnd(), ContainsSubstring("goes on for 35 bytes where its end is expected"));
  CHECK(in.value<double>("two") == 2.0);
  CHECK_NOTHROW(in.requireEnd());
}

TEST_CASE("A file of another scalar is refused with both sizes") {
  const TemporaryFile file("scalar");
  SnapshotWriter out;
  saveBodies(some<double, SoA>(), out);
  out.write(file.path());
  SnapshotReader in(file.path());
  CHECK_THROWS_WITH(loadBodies<float>(in),
                    ContainsSubstring("another Scalar") && ContainsSubstring("8 bytes"));
}

// Each position of the file in turn is damaged, or the file ends there: all are refused, none crashes.
// Seen to fail: the comparison of the checksum left out.
TEST_CASE("Every damaged bit and every missing end of a file is found") {
  const TemporaryFile file("damage");
  SnapshotWriter out;
  saveBodies(Bodies<double>(), out);
  out.write(file.path());
  const std::vector<char> whole = file.bytes();
  REQUIRE(whole.size() > 100);
  {
    SnapshotReader in(file.path());
    CHECK(loadBodies<double>(in).empty());
  }
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::vector<char> bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    file.put(bytes);
    CHECK_THROWS_AS(SnapshotReader(file.path()), std::runtime_error);
    bytes = whole;
    bytes.resize(at);
    file.put(bytes);
    CHECK_THROWS_AS(SnapshotReader(file.path()), std::runtime_error);
  }
}

TEST_CASE("A record that claims to be longer than the file is refused, without memory being asked for") {
  const TemporaryFile file("long");
  file.put(headOfRecord("x", std::uint64_t{1} << 61U));
  SnapshotReader in(file.path());
  CHECK_THROWS_AS(in.array<double>("x"), std::runtime_error);
}

// Seen to fail: the bytes themselves stood in the message.
TEST_CASE("A record whose name is no text is told in characters that can be shown") {
  const TemporaryFile file("name");
  file.put(headOfRecord("a\n\033[2J\xff" + std::string(100, 'b'), 0));
  SnapshotReader in(file.path());
  CHECK_THROWS_WITH(in.array<double>("x"),
                    ContainsSubstring("holds 'a??[2J?" + std::string(33, 'b') + "...' of"));
}

TEST_CASE("What is no snapshot, or not there, or cannot be written, is told by its path") {
  const TemporaryFile file("text");
  file.put({'h', 'e', 'l', 'l', 'o', ' ', 'w', 'o', 'r', 'l', 'd', '!', '!', '!',
            '!', '!', '!', '!', '!', '!', '!', '!', '!', '!', '!', '!', '!', '!'});
  CHECK_THROWS_WITH(SnapshotReader(file.path()),
                    ContainsSubstring(file.path()) && ContainsSubstring("not a snapshot"));
  CHECK_THROWS_WITH(SnapshotReader("/nowhere/at/all"), ContainsSubstring("/nowhere/at/all"));
  const std::string folder = std::filesystem::temp_directory_path().string();
  CHECK_THROWS_WITH(SnapshotReader(folder), ContainsSubstring(folder) && ContainsSubstring("cannot be read"));
  SnapshotWriter out;
  CHECK_THROWS_WITH(out.write("/nowhere/at/all"),
                    "gravel: cannot write /nowhere/at/all: No such file or directory");
}

// Seen to fail: the link itself replaced by a file.
TEST_CASE("A file is written through links to where they lead, and into what is no file, as a pipe") {
  const TemporaryFile file("target");
  file.put({'o', 'l', 'd'});
  const TemporaryFile link("link");
  std::filesystem::create_symlink(file.path(), link.path());
  SnapshotWriter out;
  out.value("x", 1.5);
  out.write(link.path());
  CHECK(std::filesystem::is_symlink(link.path()));
  CHECK(SnapshotReader(file.path()).value<double>("x") == 1.5);
  std::filesystem::remove(file.path());  // the link leads nowhere now
  detail::writeFileWhole(link.path(), "anew");
  CHECK(std::filesystem::is_symlink(link.path()));
  CHECK(file.bytes() == std::vector<char>{'a', 'n', 'e', 'w'});
  const TemporaryFile loop("loop");
  std::filesystem::create_symlink(loop.path(), loop.path());
  CHECK_THROWS_WITH(detail::writeFileWhole(loop.path(), "x"), ContainsSubstring("symbolic link"));
  CHECK(std::filesystem::is_symlink(loop.path()));

  const TemporaryFile pipe("pipe");
  REQUIRE(mkfifo(pipe.path().c_str(), 0600) == 0);
  const int reader = open(pipe.path().c_str(), O_RDONLY | O_NONBLOCK);  // first: a writer waits for one
  REQUIRE(reader >= 0);
  detail::writeFileWhole(pipe.path(), "through");
  char read[16] = {};
  CHECK(::read(reader, read, sizeof read) == 7);
  close(reader);
  CHECK(std::string(read) == "through");
  CHECK(std::filesystem::is_fifo(pipe.path()));
}

TEST_CASE("A failed write leaves the file before it as it was, and no part behind") {
  const TemporaryFile file("kept");
  file.put({'o', 'l', 'd'});
  SnapshotWriter out;
  out.value("x", 1.0);
  // A disk on which there is room for ten bytes.
  rlimit before{};
  REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit full{10, before.rlim_max};
  REQUIRE(setrlimit(RLIMIT_FSIZE, &full) == 0);
  std::string said;
  try {
    out.write(file.path());
  } catch (const std::runtime_error& error) {
    said = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  CHECK_THAT(said, ContainsSubstring("cannot write " + file.path() + ": File too large"));
  CHECK(file.bytes() == std::vector<char>{'o', 'l', 'd'});
  CHECK_FALSE(std::filesystem::exists(file.path() + ".part"));
}

// Seen to fail: the user's own file gone, and the permissions those of a new file.
TEST_CASE("Writing a file touches nothing beside it, and leaves it its permissions") {
  namespace fs = std::filesystem;
  const TemporaryFile file("mine");
  file.put({'o', 'l', 'd'});
  const fs::perms mode = fs::perms::owner_read | fs::perms::owner_write | fs::perms::others_exec;
  fs::permissions(file.path(), mode);
  const std::string own = file.path() + ".part", folder = file.path() + ".part1";
  std::ofstream(own) << "of the user";
  fs::create_directory(folder);
  detail::writeFileWhole(file.path(), "new");
  CHECK(file.bytes() == std::vector<char>{'n', 'e', 'w'});
  CHECK(fs::status(file.path()).permissions() == mode);
  CHECK(fs::exists(own));
  CHECK(fs::is_directory(folder));
  CHECK_FALSE(fs::exists(file.path() + ".part2"));
  fs::remove(own);
  fs::remove(folder);
}
