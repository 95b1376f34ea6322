#pragma once

/// \file
/// One table of a TOML file: typed values with ranges, and a fault for everything that is not understood.

#include "render.hpp"
#include <gravel/core/check.hpp>

#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gravel::runner {

/// What was found wrong so far, in the order of the file.
class Faults {
 public:
  explicit Faults(std::string file) : file_(std::move(file)) {}

  void add(const toml::source_region& where, const std::string& what) { add(where.begin.line, what); }
  void add(toml::source_index line, const std::string& what) { list_.emplace_back(line, what); }

  bool any() const { return !list_.empty(); }
  std::size_t count() const { return list_.size(); }

  std::string text() {
    std::stable_sort(list_.begin(), list_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::string all;
    for (const auto& [line, what] : list_) {
      all += (all.empty() ? "" : "\n") + file_ + (line > 0 ? ":" + std::to_string(line) : "") + ": " + what;
    }
    return all;
  }

 private:
  std::string file_;
  std::vector<std::pair<toml::source_index, std::string>> list_;
};

/// Insertions, deletions and exchanges that turn `wrong` into `name` (Levenshtein), or with `within` into the
/// likest part of it; capitals count as small letters.
inline std::size_t editDistance(std::string_view wrong, std::string_view name, bool within) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  std::vector<std::size_t> row(name.size() + 1, 0);
  for (std::size_t j = 0; j <= name.size() && !within; ++j) {
    row[j] = j;
  }
  for (std::size_t i = 1; i <= wrong.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= name.size(); ++j) {
      const std::size_t above = row[j];
      const std::size_t change = lower(wrong[i - 1]) == lower(name[j - 1]) ? 0 : 1;
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + change});
      diagonal = above;
    }
  }
  return within ? *std::min_element(row.begin(), row.end()) : row.back();
}

/// The end of a message: a likely name if one is near, and all that are allowed.
inline std::string allowedNames(std::string_view wrong, const std::vector<std::string>& names) {
  std::string likely;
  std::size_t nearest = wrong.size() / 3 + 1;  // one letter in three may be wrong
  for (const std::string& name : names) {
    // A name that holds the word within it ("restitution" for coeffRestitution) comes after a misspelt whole.
    std::size_t distance = editDistance(wrong, name, false);
    if (wrong.size() >= 5) {
      distance = std::min(distance, editDistance(wrong, name, true) + 1);
    }
    if (distance <= nearest && (likely.empty() || distance < nearest)) {
      nearest = distance;
      likely = name;
    }
  }
  if (names.empty()) {
    return "; but there is none at all";
  }
  std::string text = likely.empty() ? "; allowed: " : "; did you mean \"" + likely + "\"? allowed: ";
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += (i == 0 ? "" : ", ") + names[i];
  }
  return text;
}

/// Reads a table key by key. Each reading function leaves its value alone if the key is absent, and notes a
/// fault if it has the wrong type or is out of range. `finish` notes the keys that nothing asked for.
class TableReader {
 public:
  using Range = detail::Range<double>;

  TableReader(const toml::table& table, std::string name, Faults& faults)
      : table_(table), name_(std::move(name)), faults_(faults), faultsBefore_(faults.count()) {}

  /// No fault was found in this table so far: values that depend on each other can be looked at together.
  bool isSound() const { return faults_.count() == faultsBefore_; }
  bool has(const char* key) const { return table_.contains(key); }
  const toml::source_region& where() const { return table_.source(); }
  Faults& faults() const { return faults_; }

  const toml::node* take(const char* key) {
    known_.emplace_back(key);
    return table_.get(key);
  }

  bool real(const char* key, double& value, const Range& range = detail::anyFinite<double>()) {
    const toml::node* node = take(key);
    return node != nullptr && number(*node, key, value, range);
  }

  /// \param most  TOML has no larger number than the one that stands here for any
  bool count(const char* key, std::size_t& value, std::size_t least = 0,
             std::uint64_t most = std::numeric_limits<std::int64_t>::max()) {
    const toml::node* node = take(key);
    if (node == nullptr) {
      return false;
    }
    const std::string allowed =
        most < std::numeric_limits<std::int64_t>::max()
            ? "a whole number, " + std::to_string(least) + " to " + std::to_string(most)
            : "a whole number >= " + std::to_string(least);
    const auto x = node->value_exact<std::int64_t>();
    if (!x && node->is_floating_point()) {
      return fault(*node, key,
                   detail::formatReal(**node->as_floating_point()) + " with a decimal point or an exponent",
                   allowed + " without either");
    }
    if (!x) {
      return wrongType(*node, key, allowed);
    }
    if (*x < 0 || static_cast<std::uint64_t>(*x) < least || static_cast<std::uint64_t>(*x) > most) {
      return fault(*node, key, std::to_string(*x), allowed);
    }
    value = static_cast<std::size_t>(*x);
    return true;
  }

  bool flag(const char* key, bool& value) {
    const toml::node* node = take(key);
    if (node == nullptr) {
      return false;
    }
    const auto x = node->value_exact<bool>();
    if (!x) {
      return wrongType(*node, key, "true or false");
    }
    value = *x;
    return true;
  }

  bool text(const char* key, std::string& value) {
    const toml::node* node = take(key);
    if (node == nullptr) {
      return false;
    }
    const auto x = node->value_exact<std::string>();
    if (!x) {
      return wrongType(*node, key, "a text in quotes");
    }
    value = *x;
    return true;
  }

  /// The index of the text among `names`.
  bool choice(const char* key, const std::vector<std::string>& names, std::size_t& value) {
    std::string word;
    if (!text(key, word)) {
      return false;
    }
    const auto found = std::find(names.begin(), names.end(), word);
    if (found == names.end()) {
      return unknownName(key, word, names);
    }
    value = static_cast<std::size_t>(found - names.begin());
    return true;
  }

  /// Notes that a word under `key` is none of `names`.
  bool unknownName(const char* key, const std::string& word, const std::vector<std::string>& names) {
    faults_.add(table_.get(key)->source(), "\"" + std::string(key) + "\" in " + name_ + " is \"" + word +
                                               "\"" + allowedNames(word, names));
    return false;
  }

  /// A list of N texts.
  template <std::size_t N>
  bool texts(const char* key, std::array<std::string, N>& value) {
    const toml::node* node = take(key);
    if (node == nullptr) {
      return false;
    }
    const toml::array* list = node->as_array();
    if (list == nullptr || list->size() != N ||
        !std::all_of(list->begin(), list->end(), [](const auto& n) { return n.is_string(); })) {
      return wrongType(*node, key, "a list of " + std::to_string(N) + " texts in quotes");
    }
    for (std::size_t k = 0; k < N; ++k) {
      value[k] = list->get(k)->as_string()->get();
    }
    return true;
  }

  template <int N>
  bool numbers(const char* key, Eigen::Matrix<double, N, 1>& value,
               const Range& range = detail::anyFinite<double>()) {
    const toml::node* node = take(key);
    if (node == nullptr) {
      return false;
    }
    const toml::array* list = node->as_array();
    if (list == nullptr || list->size() != static_cast<std::size_t>(N)) {
      return wrongType(*node, key, "a list of " + std::to_string(N) + " numbers");
    }
    Eigen::Matrix<double, N, 1> read;
    for (int k = 0; k < N; ++k) {
      if (!number(*list->get(static_cast<std::size_t>(k)), key, read[k], range)) {
        return false;
      }
    }
    value = read;
    return true;
  }

  bool vector(const char* key, Vector3<double>& value) { return numbers<3>(key, value); }

  /// [low, high] with low <= high, or one number for both.
  bool interval(const char* key, std::array<double, 2>& value, const Range& range) {
    const toml::node* node = table_.get(key);
    if (node != nullptr && node->is_number()) {
      const bool read = real(key, value[0], range);
      value[1] = value[0];
      return read;
    }
    Eigen::Matrix<double, 2, 1> both;
    if (!numbers<2>(key, both, range)) {
      return false;
    }
    if (both[0] > both[1]) {
      return fault(*node, key, detail::formatVector(both), "the smaller number first");
    }
    value = {both[0], both[1]};
    return true;
  }

  /// "#rrggbb", taken to linear light.
  bool colour(const char* key, Colour& value) {
    std::string code;
    if (!text(key, code)) {
      return false;
    }
    const auto digits = std::string_view(code).substr(std::min<std::size_t>(1, code.size()));
    if (code.size() != 7 || code[0] != '#' ||
        digits.find_first_not_of("0123456789abcdefABCDEF") != std::string_view::npos) {
      return fault(*table_.get(key), key, "\"" + code + "\"", "\"#rrggbb\", two hexadecimal digits a colour");
    }
    for (int k = 0; k < 3; ++k) {
      const double part = std::stoi(code.substr(static_cast<std::size_t>(1 + 2 * k), 2), nullptr, 16) / 255.0;
      value[k] = static_cast<float>(std::pow(part, 2.2));
    }
    return true;
  }

  /// Calls read(reader) for the table under `key`, if there is one.
  template <class Read>
  void table(const char* key, Read&& read) {
    const toml::node* node = take(key);
    if (node == nullptr) {
      return;
    }
    if (const toml::table* inner = node->as_table()) {
      TableReader reader(*inner, "[" + std::string(key) + "]", faults_);
      read(reader);
      reader.finish();
    } else {
      wrongType(*node, key, "a table, [" + std::string(key) + "]");
    }
  }

  /// Calls read(reader) for each table of the list under `key`.
  template <class Read>
  void tables(const char* key, Read&& read) {
    const toml::node* node = take(key);
    if (node == nullptr) {
      return;
    }
    const std::string name = "[[" + std::string(key) + "]]";
    const toml::array* list = node->as_array();
    if (list == nullptr ||
        !std::all_of(list->begin(), list->end(), [](const auto& n) { return n.is_table(); })) {
      wrongType(*node, key, "a list of tables, " + name);
      return;
    }
    for (const toml::node& entry : *list) {
      TableReader reader(*entry.as_table(), name, faults_);
      read(reader);
      reader.finish();
    }
  }

  /// Notes that a key must be there.
  void missing(const std::string& keys) { faults_.add(where(), name_ + " has no " + keys); }

  bool fault(const toml::node& node, const char* key, const std::string& value, const std::string& allowed) {
    faults_.add(node.source(),
                "\"" + std::string(key) + "\" in " + name_ + " is " + value + "; allowed: " + allowed);
    return false;
  }

  /// Of a key that stands here, or of the table where it has its default.
  bool fault(const char* key, const std::string& value, const std::string& allowed) {
    const toml::node* node = table_.get(key);
    return fault(node != nullptr ? *node : table_, key, value, allowed);
  }

  void finish() {
    for (const auto& [key, node] : table_) {
      if (std::find(known_.begin(), known_.end(), key.str()) == known_.end()) {
        faults_.add(key.source(), "unknown key \"" + std::string(key.str()) + "\" in " + name_ +
                                      allowedNames(key.str(), known_));
      }
    }
  }

 private:
  bool number(const toml::node& node, const char* key, double& value, const Range& range) {
    if (!node.is_number()) {
      return wrongType(node, key, std::string("a number, ") + range.text);
    }
    // value<double>() is empty for whole numbers beyond 2^53.
    const double x =
        node.is_integer() ? static_cast<double>(node.as_integer()->get()) : node.as_floating_point()->get();
    if (!range.contains(x)) {
      return fault(node, key, detail::formatReal(x), range.allowed(x));
    }
    value = x;
    return true;
  }

  bool wrongType(const toml::node& node, const char* key, const std::string& allowed) {
    std::string kind = "of another type";
    switch (node.type()) {
      case toml::node_type::string:
        kind = "the text \"" + node.as_string()->get() + "\"";
        break;
      case toml::node_type::integer:
        kind = "the number " + std::to_string(node.as_integer()->get());
        break;
      case toml::node_type::floating_point:
        kind = "the number " + detail::formatReal(node.as_floating_point()->get());
        break;
      case toml::node_type::boolean:
        kind = node.as_boolean()->get() ? "true" : "false";
        break;
      case toml::node_type::array:
        kind = "a list of " + std::to_string(node.as_array()->size());
        break;
      case toml::node_type::table:
        kind = "a table";
        break;
      default:
        break;
    }
    return fault(node, key, kind, allowed);
  }

  const toml::table& table_;
  std::string name_;
  Faults& faults_;
  std::size_t faultsBefore_;
  std::vector<std::string> known_;
};

}  // namespace gravel::runner
