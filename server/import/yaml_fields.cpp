#include "server/import/yaml_fields.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>

#include "common/core/bounded_text.hpp"

namespace osteon::import {
namespace {

constexpr std::uintmax_t kMostYamlBytes = 1 << 20;
constexpr std::size_t kMostQuotedValue = 60;  // bytes of a value in an error
constexpr double kFarthestPosition_mm = 1e5;

std::string names_of(const std::vector<std::string_view>& fields) {
  return names_in(fields, [](std::string_view name) { return name; });
}

}  // namespace

std::string quoted_value(const std::string& text) { return "\"" + bounded_text(text, kMostQuotedValue) + "\""; }

Result<void> parse_yaml_list(std::string_view text, const std::string& file_name, const YamlList& list,
                             const std::function<void(const YAML::Node&)>& on_entry) {
  const std::string name = list.name, remedy = list.remedy;
  std::size_t number = 0;
  int line_of_entry = 0;
  try {
    const YAML::Node root = YAML::Load(std::string(text));
    if (!root.IsMap() || !root[name] || !root[name].IsSequence() || root[name].size() == 0)
      throw YamlFault{name + " is not a list of " + name + "; " + remedy};
    for (const auto& entry : root)
      if (!entry.first.IsScalar() || entry.first.Scalar() != name || root.size() != 1)
        throw YamlFault{"it has another field beside " + name + "; remove it, and " + remedy};
    if (root[name].size() > list.most)
      throw YamlFault{name + " has more than " + std::to_string(list.most) + " entries; remove some"};
    for (const YAML::Node& node : root[name]) {
      ++number;
      line_of_entry = node.Mark().line + 1;
      on_entry(node);
    }
    return {};
  } catch (const YamlFault& fault) {
    const std::string where =
        number > 0 ? ", line " + std::to_string(line_of_entry) + ", " + list.entry + " " + std::to_string(number) : "";
    return bad_input(file_name + where + ": " + fault.what);
  } catch (const YAML::Exception& error) {
    const std::string line = error.mark.is_null() ? "" : ", line " + std::to_string(error.mark.line + 1);
    return bad_input(file_name + line + ": this is not YAML (" + bounded_text(error.msg, 2 * kMostQuotedValue) + "); " +
                     remedy);
  }
}

Result<std::string> read_yaml_list(const std::filesystem::path& file, const YamlList& list) {
  const std::string name = list.name;
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error || !std::filesystem::is_regular_file(file, error))
    return failure(ErrorCode::not_found,
                   "there is no file of " + name + " " + file.string() + "; give the name of a YAML file");
  if (size > kMostYamlBytes)
    return bad_input(file.string() + " is longer than 1 MiB, more than any list of " + name + "; give another file");
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return failure(ErrorCode::unavailable, file.string() + " cannot be read; check its permissions");
  return text;
}

void check_fields(const YAML::Node& entry, const std::string& what, const std::vector<std::string_view>& needed,
                  const std::vector<std::string_view>& optional) {
  std::vector<std::string> seen;
  for (const auto& pair : entry) {
    const std::string field = pair.first.IsScalar() ? pair.first.Scalar() : "";
    if (std::ranges::find(seen, field) != seen.end())
      throw YamlFault{bounded_text(field, kMostQuotedValue) + " is there twice; remove one"};
    seen.push_back(field);
    if (std::ranges::find(needed, field) != needed.end() || std::ranges::find(optional, field) != optional.end())
      continue;
    std::vector<std::string_view> fields = needed;
    fields.insert(fields.end(), optional.begin(), optional.end());
    throw YamlFault{quoted_value(field) + " is no field of " + what + "; remove it, or write one of " +
                    names_of(fields)};
  }
  for (const std::string_view field : needed)
    if (std::ranges::find(seen, field) == seen.end())
      throw YamlFault{std::string(field) + " is missing; " + what + " needs " + names_of(needed)};
}

double number_of(const YAML::Node& node, const std::string& field, double least, double most,
                 const std::string& remedy) {
  std::array<char, 100> range{};
  std::snprintf(range.data(), range.size(), "write a number from %g to %g", least, most);
  const std::string what_to_do = "; " + (remedy.empty() ? range.data() : remedy);
  if (!node.IsScalar()) throw YamlFault{field + " is not a single number" + what_to_do};
  const std::string& text = node.Scalar();
  double value = 0.0;
  const char* from = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(from, text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !(value >= least && value <= most))
    throw YamlFault{field + " is " + quoted_value(text) + what_to_do};
  return value;
}

Vec3 position_of(const YAML::Node& node, const std::string& field) {
  if (!node.IsSequence() || node.size() != 3)
    throw YamlFault{field + " does not have three numbers; write [x, y, z], such as [12.5, -3, 40]"};
  Vec3 at;
  for (std::size_t axis = 0; axis < 3; ++axis)
    at[static_cast<int>(axis)] = number_of(node[axis], field, -kFarthestPosition_mm, kFarthestPosition_mm);
  return at;
}

}  // namespace osteon::import
