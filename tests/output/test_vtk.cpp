#include "support/catch.hpp"
#include <gravel/output/vtk.hpp>

#include <unistd.h>

#include <clocale>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

using gravel::Bodies;
using gravel::Body;
using gravel::Vector3;
using gravel::VtkPoints;
using gravel::VtkSeries;

namespace {

namespace fs = std::filesystem;

/// A folder of its own for a test, removed at the end.
class Folder {
 public:
  explicit Folder(const std::string& name)
      : path_(fs::temp_directory_path() / ("gravel_vtk_" + name + "_" + std::to_string(::getpid()))) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { fs::remove_all(path_); }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string contents(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  REQUIRE(in.good());
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// The value of an attribute in one XML tag.
std::string attribute(const std::string& tag, const std::string& name) {
  const auto at = tag.find(" " + name + "=\"");
  REQUIRE(at != std::string::npos);
  const auto begin = at + name.size() + 3;
  return tag.substr(begin, tag.find('"', begin) - begin);
}

/// A reader of its own: the arrays of a .vtp by name, as the format's description says.
struct Array {
  std::string type;
  int width = 0;
  std::string bytes;

  template <class T>
  T value(std::size_t i) const {
    T x{};
    REQUIRE((i + 1) * sizeof(T) <= bytes.size());
    std::memcpy(&x, bytes.data() + i * sizeof(T), sizeof(T));
    return x;
  }
};

std::map<std::string, Array> readVtp(const fs::path& path) {
  const std::string text = contents(path);
  const auto appended = text.find("<AppendedData encoding=\"raw\">");
  REQUIRE(appended != std::string::npos);
  const std::size_t base = text.find('_', appended) + 1;
  std::map<std::string, Array> arrays;
  std::size_t end = base;
  for (std::size_t at = text.find("<DataArray"); at < appended; at = text.find("<DataArray", at + 1)) {
    const std::string tag = text.substr(at, text.find('>', at) - at);
    const std::size_t offset = base + std::stoul(attribute(tag, "offset"));
    CHECK(offset == end);  // arrays follow each other without a gap
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, text.data() + offset, sizeof bytes);
    REQUIRE(offset + sizeof bytes + bytes <= text.size());
    arrays[attribute(tag, "Name")] = {attribute(tag, "type"), std::stoi(attribute(tag, "NumberOfComponents")),
                                      text.substr(offset + sizeof bytes, bytes)};
    end = offset + sizeof bytes + bytes;
  }
  CHECK(text.substr(end) == "\n </AppendedData>\n</VTKFile>\n");
  return arrays;
}

template <class Scalar, class Layout>
Bodies<Scalar, Layout> someBodies(std::size_t n) {
  Bodies<Scalar, Layout> bodies;
  for (std::size_t i = 0; i < n; ++i) {
    const auto x = static_cast<Scalar>(i);
    Body<Scalar> body;
    body.position = {x, x + Scalar(0.25), -x};
    body.velocity = {Scalar(1) / (x + 1), 0, x};
    body.angularVelocity = {0, x, Scalar(0.5)};
    body.mass = x + 1;
    body.radius = Scalar(0.125) * (x + 1);
    body.orientation = gravel::Quaternion<Scalar>(Scalar(0.5), Scalar(0.5), Scalar(-0.5), Scalar(0.5));
    bodies.add(body);
  }
  return bodies;
}

template <class S, class L>
struct Case {
  using Scalar = S;
  using Layout = L;
};

}  // namespace

TEMPLATE_TEST_CASE("A frame holds what the bodies hold, exactly", "[vtk]", (Case<double, gravel::SoA>),
                   (Case<float, gravel::AoS>), (Case<float, gravel::SoA>), (Case<double, gravel::AoSoA<4>>),
                   (Case<long double, gravel::SoA>)) {
  using Scalar = typename TestType::Scalar;
  using Number = std::conditional_t<std::is_same_v<Scalar, float>, float, double>;
  const Folder folder("frame");
  const auto bodies = someBodies<Scalar, typename TestType::Layout>(5);
  gravel::vtkPoints(bodies).write(folder.path() / "a.vtp");
  const auto arrays = readVtp(folder.path() / "a.vtp");

  CHECK(arrays.size() == 9);
  for (const auto& name : {"Points", "velocity", "angularVelocity", "orientation", "radius", "mass"}) {
    CHECK(arrays.at(name).type == (sizeof(Number) == 4 ? "Float32" : "Float64"));
  }
  CHECK(arrays.at("id").type == "UInt64");
  CHECK(arrays.at("Points").width == 3);
  CHECK(arrays.at("mass").width == 1);
  CHECK(arrays.at("orientation").width == 4);
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      CHECK(arrays.at("Points").value<Number>(3 * i + k) == static_cast<Number>(bodies.positions()[i][axis]));
      CHECK(arrays.at("velocity").value<Number>(3 * i + k) ==
            static_cast<Number>(bodies.velocities()[i][axis]));
      CHECK(arrays.at("angularVelocity").value<Number>(3 * i + k) ==
            static_cast<Number>(bodies.angularVelocities()[i][axis]));
    }
    for (std::size_t k = 0; k < 4; ++k) {  // w, x, y, z: y alone is below zero
      CHECK(arrays.at("orientation").value<Number>(4 * i + k) == (k == 2 ? Number(-0.5) : Number(0.5)));
    }
    CHECK(arrays.at("radius").value<Number>(i) == static_cast<Number>(bodies.radii()[i]));
    CHECK(arrays.at("mass").value<Number>(i) == static_cast<Number>(bodies.masses()[i]));
    CHECK(arrays.at("id").value<std::uint64_t>(i) == i);
    CHECK(arrays.at("connectivity").value<std::int64_t>(i) == static_cast<std::int64_t>(i));
    CHECK(arrays.at("offsets").value<std::int64_t>(i) == static_cast<std::int64_t>(i) + 1);
  }
}

TEST_CASE("A frame of no bodies is a file with empty arrays", "[vtk]") {
  const Folder folder("empty");
  gravel::vtkPoints(Bodies<double>()).write(folder.path() / "a.vtp");
  const auto arrays = readVtp(folder.path() / "a.vtp");
  REQUIRE(arrays.size() == 9);
  for (const auto& [name, array] : arrays) {
    CHECK(array.bytes.empty());
  }
}

TEST_CASE("A user's own columns are written, and a name is escaped", "[vtk]") {
  const Folder folder("columns");
  const std::vector<Vector3<double>> positions{{1, 2, 3}, {4, 5, 6}};
  const std::vector<std::int32_t> colours{-7, 8};
  VtkPoints points(positions);
  points.add("a<b & \"c\"", colours);
  points.write(folder.path() / "a.vtp");
  const auto arrays = readVtp(folder.path() / "a.vtp");
  const auto& colour = arrays.at("a&lt;b &amp; &quot;c&quot;");
  CHECK(colour.type == "Int32");
  CHECK(colour.value<std::int32_t>(0) == -7);
  CHECK(colour.value<std::int32_t>(1) == 8);
  CHECK(arrays.at("Points").value<double>(5) == 6.0);
}

TEST_CASE("A column of another length than the positions is refused by name", "[vtk]") {
  const std::vector<Vector3<double>> positions(2, Vector3<double>::Zero());
  VtkPoints points(positions);
  const std::vector<double> three(3, 0.0);
  CHECK_THROWS_WITH(points.add("heat", three),
                    "gravel: length of the column \"heat\" is 3; allowed: 2, one value a point");
}

TEST_CASE("A series lists its frames with their times to the last bit", "[vtk]") {
  const Folder folder("series");
  VtkSeries series(folder.path() / "deeper" / "frames", "pile");
  const std::vector<Vector3<double>> positions(1, Vector3<double>::Zero());
  const std::vector<double> times{0.0, 0.1, 1.0 / 3.0};
  for (const double time : times) {
    series.write(VtkPoints(positions), time);
  }
  CHECK(series.frames() == 3);
  CHECK(series.index() == folder.path() / "deeper" / "frames" / "pile.pvd");
  const std::string text = contents(series.index());
  std::size_t at = 0;
  for (const double time : times) {
    at = text.find("<DataSet", at + 1);
    REQUIRE(at != std::string::npos);
    const std::string tag = text.substr(at, text.find('>', at) - at);
    CHECK(std::strtod(attribute(tag, "timestep").c_str(), nullptr) == time);
    CHECK(fs::exists(series.index().parent_path() / attribute(tag, "file")));
  }
  CHECK(text.find("<DataSet", at + 1) == std::string::npos);
}

// Seen to fail: 0,10000000000000001 by a program of German numbers, where there is that locale.
TEST_CASE("The times of a series have a point whatever the program's decimal sign", "[vtk]") {
  const Folder folder("comma");
  const std::string before = std::setlocale(LC_NUMERIC, nullptr);
  for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "de_DE", "fr_FR.UTF-8", "fr_FR.utf8"}) {
    if (std::setlocale(LC_NUMERIC, name) != nullptr) {
      break;
    }
  }
  VtkSeries series(folder.path(), "pile");
  series.write(VtkPoints(std::vector<Vector3<double>>(1, Vector3<double>::Zero())), 0.1);
  std::setlocale(LC_NUMERIC, before.c_str());
  CHECK_THAT(contents(series.index()), gravel::test::ContainsSubstring("timestep=\"0.1\""));
}

// Seen to fail: 1 frame after none was written, and two in the list after one.
TEST_CASE("A series that cannot write a frame is as it was", "[vtk]") {
  const Folder folder("as_it_was");
  VtkSeries series(folder.path(), "pile");
  const VtkPoints points(std::vector<Vector3<double>>(1, Vector3<double>::Zero()));
  fs::create_directory(series.index());  // where the list should be
  CHECK_THROWS_AS(series.write(points, 1.0), std::runtime_error);
  CHECK(series.frames() == 0);
  fs::remove(series.index());
  series.write(points, 2.0);
  CHECK(series.frames() == 1);
  const std::string list = contents(series.index());
  CHECK(list.find("timestep=\"1\"") == std::string::npos);
  CHECK(list.find("timestep=\"2\" group=\"\" part=\"0\" file=\"pile_000000.vtp\"") != std::string::npos);
}

TEST_CASE("What cannot be written is an error with path and reason, and leaves nothing behind", "[vtk]") {
  const Folder folder("unwritable");
  const std::vector<Vector3<double>> positions(1, Vector3<double>::Zero());
  const VtkPoints points(positions);

  SECTION("a folder that is not there") {
    const fs::path path = folder.path() / "absent" / "a.vtp";
    CHECK_THROWS_WITH(points.write(path),
                      "gravel: cannot write " + path.string() + ": No such file or directory");
  }
  SECTION("a folder in the file's place") {
    const fs::path path = folder.path() / "a.vtp";
    fs::create_directory(path);
    CHECK_THROWS_AS(points.write(path), std::runtime_error);
    CHECK_FALSE(fs::exists(path.string() + ".part"));
  }
  SECTION("a file in the series' folder's place") {
    std::ofstream(folder.path() / "taken") << "x";
    CHECK_THROWS_AS(VtkSeries(folder.path() / "taken", "pile"), std::runtime_error);
  }
  SECTION("a full disk") {
    if (fs::exists("/dev/full")) {
      CHECK_THROWS_WITH(points.write("/dev/full"), "gravel: cannot write /dev/full: No space left on device");
    }
  }
}
