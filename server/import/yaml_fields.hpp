// Reads a YAML file in which a person writes one list, such as edits or landmarks. A fault names the file, the entry,
// the field and the remedy.
#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace YAML {  // the library's
class Node;
}

namespace osteon::import {

// What is wrong with an entry. Thrown by the functions below, and caught where file and entry are known.
struct YamlFault {
  std::string what;
};

// The list that a file consists of.
struct YamlList {
  const char* name;    // its key, such as "edits"
  const char* entry;   // one of it, such as "edit"
  const char* remedy;  // "write edits: [...]"
  std::size_t most;    // entries
};

// Calls `on_entry` with each entry, until it throws a YamlFault. Errors: invalid_input.
[[nodiscard]] Result<void> parse_yaml_list(std::string_view text, const std::string& file_name, const YamlList& list,
                                           const std::function<void(const YAML::Node&)>& on_entry);
// The text of such a file. Errors: not_found, unavailable (no permission), invalid_input (longer than 1 MiB).
[[nodiscard]] Result<std::string> read_yaml_list(const std::filesystem::path& file, const YamlList& list);

// Throws unless the entry has all fields of `needed`, and beside them only some of `optional`, each once. `what`: the
// entry, such as "paint".
void check_fields(const YAML::Node& entry, const std::string& what, const std::vector<std::string_view>& needed,
                  const std::vector<std::string_view>& optional);
// `remedy`: of a fault; without one, the fault names the range.
[[nodiscard]] double number_of(const YAML::Node& node, const std::string& field, double least, double most,
                               const std::string& remedy = {});
// [x, y, z], mm, within 100 m.
[[nodiscard]] Vec3 position_of(const YAML::Node& node, const std::string& field);
// A value of a file for an error: bounded, in quotation marks.
[[nodiscard]] std::string quoted_value(const std::string& text);

// "a, b, c"
template <class List, class Name>
[[nodiscard]] std::string names_in(const List& list, Name name) {
  std::string text;
  for (const auto& entry : list) text += (text.empty() ? "" : ", ") + std::string(name(entry));
  return text;
}

}  // namespace osteon::import
