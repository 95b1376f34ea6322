#pragma once

/// \file
/// Frames for ParaView, VisIt and VTK: one `.vtp` file a frame (XML PolyData, appended raw binary) and a
/// `.pvd` file that gives each frame its time. Format: VTK User's Guide, "VTK File Formats", XML formats.

#include <gravel/bodies/bodies.hpp>
#include <gravel/output/whole_file.hpp>

#include <bit>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace gravel {

namespace detail {

/// What stands in a file for a scalar: float for float, double for every other real type.
template <class T>
auto vtkNumber(const T& x) {
  if constexpr (std::is_same_v<T, float> || std::is_integral_v<T>) {
    return x;
  } else if constexpr (requires { static_cast<double>(x); }) {
    return static_cast<double>(x);
  } else {
    constexpr bool hasValue = requires { static_cast<double>(x.value()); };
    static_assert(
        hasValue,
        "gravel: VtkPoints needs scalars that static_cast or a member value() makes a double of, see "
        "docs/concepts.md");
    if constexpr (hasValue) {
      return static_cast<double>(x.value());
    } else {
      return 0.0;
    }
  }
}

template <class T>
std::string vtkTypeName() {
  if constexpr (std::is_floating_point_v<T>) {
    return "Float" + std::to_string(8 * sizeof(T));
  } else {
    return (std::is_signed_v<T> ? "Int" : "UInt") + std::to_string(8 * sizeof(T));
  }
}

inline std::string xmlEscaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

}  // namespace detail

/// Points and what is known about each, from any columns (`c[i]` a number or a Vector3; `c.size()`).
/// Values are copied when they are added. Numbers are float for float, double for other real scalars, the
/// machine's own byte order.
///
///     VtkPoints points(positions);
///     points.add("radius", radii);
///     points.write("frame.vtp");
class VtkPoints {
 public:
  template <class Positions>
  explicit VtkPoints(const Positions& positions) : size_(positions.size()) {
    appendColumn("Points", positions, pointsXml_);
    static_assert(components<Positions>() == 3, "gravel: VtkPoints needs positions of three coefficients");
  }

  /// \throws std::invalid_argument if the column's length is not that of the positions
  template <class Column>
  void add(std::string_view name, const Column& column) {
    if (column.size() != size_) {
      detail::refuse("length of the column \"" + std::string(name) + "\"", std::to_string(column.size()),
                     std::to_string(size_) + ", one value a point");
    }
    appendColumn(name, column, fieldsXml_);
  }

  std::size_t size() const { return size_; }

  /// \throws std::runtime_error with path and reason
  void write(const std::filesystem::path& path) const {
    // One vertex cell a point: without cells many filters see nothing.
    std::string data = data_;
    std::string cellsXml;
    std::vector<std::int64_t> cells(size_);
    for (std::size_t shift = 0; shift < 2; ++shift) {
      for (std::size_t i = 0; i < size_; ++i) {
        cells[i] = static_cast<std::int64_t>(i + shift);
      }
      cellsXml += arrayXml<std::int64_t>(shift == 0 ? "connectivity" : "offsets", 1, data.size());
      appendBlock(data, cells.data(), cells.size() * sizeof(std::int64_t));
    }
    const std::string endian = std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian";
    const std::string head =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"" + endian +
        "\" header_type=\"UInt64\">\n <PolyData>\n  <Piece NumberOfPoints=\"" + std::to_string(size_) +
        "\" NumberOfVerts=\"" + std::to_string(size_) +
        "\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n   <Points>\n" + pointsXml_ +
        "   </Points>\n   <PointData>\n" + fieldsXml_ + "   </PointData>\n   <Verts>\n" + cellsXml +
        "   </Verts>\n  </Piece>\n </PolyData>\n <AppendedData encoding=\"raw\">\n_";
    detail::writeFileWhole(path, head, data, "\n </AppendedData>\n</VTKFile>\n");
  }

 private:
  template <class Column>
  static constexpr int components() {
    using Value = std::remove_cvref_t<decltype(std::declval<const Column&>()[0])>;
    if constexpr (requires { Value::SizeAtCompileTime; }) {
      return Value::SizeAtCompileTime;
    } else {
      return 1;
    }
  }

  template <class Column>
  void appendColumn(std::string_view name, const Column& column, std::string& xml) {
    constexpr int width = components<Column>();
    const auto number = [&](std::size_t i, int k) {
      if constexpr (width == 1) {
        return detail::vtkNumber(column[i]);
      } else {
        return detail::vtkNumber(column[i][k]);
      }
    };
    using Number = decltype(number(0, 0));
    std::vector<Number> values;
    values.reserve(size_ * static_cast<std::size_t>(width));
    for (std::size_t i = 0; i < size_; ++i) {
      for (int k = 0; k < width; ++k) {
        values.push_back(number(i, k));
      }
    }
    xml += arrayXml<Number>(name, width, data_.size());
    appendBlock(data_, values.data(), values.size() * sizeof(Number));
  }

  template <class Number>
  static std::string arrayXml(std::string_view name, int width, std::size_t offset) {
    return "    <DataArray type=\"" + detail::vtkTypeName<Number>() + "\" Name=\"" +
           detail::xmlEscaped(name) + "\" NumberOfComponents=\"" + std::to_string(width) +
           "\" format=\"appended\" offset=\"" + std::to_string(offset) + "\"/>\n";
  }

  /// An array in the appended section: its length in bytes, then its bytes.
  static void appendBlock(std::string& data, const void* bytes, std::size_t count) {
    const std::uint64_t header = count;
    data.append(reinterpret_cast<const char*>(&header), sizeof header);
    data.append(static_cast<const char*>(bytes), count);
  }

  std::size_t size_;
  std::string data_, pointsXml_, fieldsXml_;
};

namespace detail {

/// Quaternions as VTK takes them: w, x, y, z.
template <class Quaternions>
struct VtkQuaternions {
  Quaternions column;

  std::size_t size() const { return column.size(); }
  auto operator[](std::size_t i) const {
    const auto q = column[i];
    return Eigen::Matrix<std::remove_cvref_t<decltype(q.w())>, 4, 1>(q.w(), q.x(), q.y(), q.z());
  }
};

}  // namespace detail

/// Points with radius, mass, velocity, angularVelocity, orientation (a quaternion w, x, y, z, by which
/// ParaView turns glyphs in the mode "Quaternion") and id of every body.
template <class Bodies>
VtkPoints vtkPoints(const Bodies& bodies) {
  VtkPoints points(bodies.positions());
  points.add("radius", bodies.radii());
  points.add("mass", bodies.masses());
  points.add("velocity", bodies.velocities());
  points.add("angularVelocity", bodies.angularVelocities());
  points.add("orientation", detail::VtkQuaternions<decltype(bodies.orientations())>{bodies.orientations()});
  points.add("id", bodies.ids());
  return points;
}

/// A run of frames: `<name>_000000.vtp`, … and `<name>.pvd`, which is written anew after each frame so that
/// it can be opened while the run goes on. Open the `.pvd`; glyph by `radius` (diameter = 2 radius). A series
/// begins with frame 0 and an empty list: where one of this name is in the folder already, as after a
/// restart, its frames are written over from 0 on, and the `.pvd` knows the new ones only. Take another name
/// or folder. A frame costs O(frames before it) for the list, 0.4 ms where these are 10 000.
class VtkSeries {
 public:
  /// Makes the folder if it is not there. \throws std::runtime_error if that fails
  VtkSeries(std::filesystem::path folder, std::string name)
      : folder_(std::move(folder)), name_(std::move(name)) {
    std::error_code error;
    std::filesystem::create_directories(folder_, error);
    if (error) {
      detail::refuseFile(folder_, error.message());
    }
  }

  /// \throws std::runtime_error with path and reason; then the series is as it was, and the next frame takes
  /// the place of this one
  void write(const VtkPoints& points, double time) {
    char number[32];
    std::snprintf(number, sizeof number, "_%06zu.vtp", frames_);
    const std::string file = name_ + number;
    points.write(folder_ / file);
    std::string list = list_ + "  <DataSet timestep=\"" + detail::formatReal(time) +
                       "\" group=\"\" part=\"0\" file=\"" + detail::xmlEscaped(file) + "\"/>\n";
    detail::writeFileWhole(index(),
                           "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n"
                           " <Collection>\n",
                           list, " </Collection>\n</VTKFile>\n");
    list_.swap(list);
    ++frames_;
  }

  std::size_t frames() const { return frames_; }
  std::filesystem::path index() const { return folder_ / (name_ + ".pvd"); }

 private:
  std::filesystem::path folder_;
  std::string name_, list_;
  std::size_t frames_ = 0;
};

}  // namespace gravel
