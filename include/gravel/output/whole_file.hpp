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

inline std::error_code lastError() { return {errno, std::generic_category()}; }

/// Writes the parts one after the other and closes the file. \param file  null where it could not be opened
/// \return the reason why they are not there, or none
inline std::error_code writeParts(std::FILE* file, const FileParts& parts) {
  if (file == nullptr) {
    return lastError();
  }
  std::error_code error;
  for (const std::string_view part : parts) {
    if (!error && !part.empty() && std::fwrite(part.data(), 1, part.size(), file) != part.size()) {
      error = lastError();
    }
  }
  if (std::fclose(file) != 0 && !error) {
    error = lastError();
  }
  return error;
}

/// Makes a file beside `target` that was not there before: <target>.part, or .part1, … where something has
/// that name. \return null if that fails, with the reason in errno
inline std::FILE* openPart(const std::filesystem::path& target, std::filesystem::path& part) {
  std::FILE* file = nullptr;
  for (int k = 0; k < 100 && file == nullptr && (k == 0 || errno == EEXIST); ++k) {
    part = target.string() + ".part" + (k > 0 ? std::to_string(k) : "");
    file = std::fopen(part.string().c_str(), "wbx");
  }
  return file;
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
/// was there stays if it cannot be written; its permissions stay in any case. Through links to where they
/// lead; what is no file, a device or a pipe, is written to as it is. Nothing waits for the disk: who wants
/// to be safe from a loss of power has to flush it himself.
/// \throws std::runtime_error with path and reason; then nothing is left behind
inline void writeFileWhole(const std::filesystem::path& path, std::string_view head,
                           std::string_view data = {}, std::string_view tail = {}) {
  namespace fs = std::filesystem;
  const FileParts parts{head, data, tail};
  std::error_code error, ignored;
  const fs::file_status place = fs::status(path, ignored);
  const fs::path target = targetOf(path);
  if (fs::exists(place) && !fs::is_regular_file(place) && !fs::is_directory(place)) {
    error = writeParts(std::fopen(path.string().c_str(), "wb"), parts);
  } else if (fs::is_symlink(target, ignored)) {
    error = make_error_code(std::errc::too_many_symbolic_link_levels);
  } else {
    fs::path part;
    std::FILE* const file = openPart(target, part);
    if (file != nullptr && fs::is_regular_file(place)) {
      fs::permissions(part, place.permissions(), ignored);
    }
    error = writeParts(file, parts);
    if (!error) {
      fs::rename(part, target, error);
    }
    if (error && file != nullptr) {
      fs::remove(part, ignored);
    }
  }
  if (error) {
    refuseFile(path, error.message());
  }
}

}  // namespace gravel::detail
