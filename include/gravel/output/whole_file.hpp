#pragma once

/// \file
/// Files that are written whole or not at all.

#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

namespace gravel::detail {

[[noreturn]] inline void refuseFile(const std::filesystem::path& path, const std::string& why) {
  throw std::runtime_error("gravel: cannot write " + path.string() + ": " + why);
}

using FileParts = std::array<std::string_view, 3>;

/// The parts one after the other into a file of this name. \return the reason why it is not there, or none
inline std::error_code writeParts(const std::filesystem::path& path, const FileParts& parts) {
  const auto reason = [] { return std::error_code(errno, std::generic_category()); };
  std::FILE* file = std::fopen(path.string().c_str(), "wb");
  if (file == nullptr) {
    return reason();
  }
  std::error_code error;
  for (const std::string_view part : parts) {
    if (!error && !part.empty() && std::fwrite(part.data(), 1, part.size(), file) != part.size()) {
      error = reason();
    }
  }
  if (std::fclose(file) != 0 && !error) {
    error = reason();
  }
  return error;
}

/// Where links lead, whether it is there or not; a link where there is no end of them.
inline std::filesystem::path targetOf(std::filesystem::path path) {
  std::error_code error;
  for (int links = 0; links < 40 && std::filesystem::is_symlink(path, error); ++links) {
    path = path.parent_path() / std::filesystem::read_symlink(path, error);
  }
  return path;
}

/// Writes a whole file beside its place and moves it there, so that a reader never sees half of one, and what
/// was there stays if it cannot be written. Through links to where they lead; what is no file, a device or a
/// pipe, is written to as it is.
/// \throws std::runtime_error with path and reason; then nothing is left behind
inline void writeFileWhole(const std::filesystem::path& path, std::string_view head,
                           std::string_view data = {}, std::string_view tail = {}) {
  namespace fs = std::filesystem;
  const FileParts parts{head, data, tail};
  std::error_code error;
  const fs::file_status place = fs::status(path, error);
  if (fs::exists(place) && !fs::is_regular_file(place) && !fs::is_directory(place)) {
    error = writeParts(path, parts);
  } else {
    const fs::path target = targetOf(path);
    const fs::path partial = target.string() + ".part";
    std::error_code ignored;
    error = fs::is_symlink(target, ignored) ? make_error_code(std::errc::too_many_symbolic_link_levels)
                                            : writeParts(partial, parts);
    if (!error) {
      fs::rename(partial, target, error);
    }
    if (error && !fs::is_directory(partial, ignored)) {
      fs::remove(partial, ignored);
    }
  }
  if (error) {
    refuseFile(path, error.message());
  }
}

}  // namespace gravel::detail
