#include "common/tools/tool_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <sstream>

#include "common/tools/tool_rules.hpp"

namespace osteon {
namespace {

constexpr std::uintmax_t kLargestFile = 512u << 20;  // bytes, including a mesh's samples

// Thrown while reading, caught in parse_tool().
struct Fault {
  std::string what;
};

std::string shortest(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string scalar(const YAML::Node& node, const std::string& field) {
  if (!node.IsScalar()) throw Fault{"\"" + field + "\" must be a single value"};
  return node.Scalar();
}

double number(const YAML::Node& node, const std::string& field) {
  const std::string text = scalar(node, field);
  double value = 0.0;
  const char* from = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(from, text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw Fault{"\"" + field + "\" is \"" + text + "\", which is not a number; write one such as 3.5"};
  return value;
}

std::int64_t whole(const YAML::Node& node, const std::string& field, std::int64_t lowest, std::int64_t highest) {
  const double value = number(node, field);
  if (value != std::floor(value)) throw Fault{"\"" + field + "\" is " + shortest(value) + "; write a whole number"};
  if (value < static_cast<double>(lowest) || value > static_cast<double>(highest))
    throw Fault{"\"" + field + "\" is " + shortest(value) + "; choose it from " + std::to_string(lowest) + " to " +
                std::to_string(highest)};
  return static_cast<std::int64_t>(value);
}

// The angle in degrees that reads back as exactly this one. Nothing if there is none, because not every number of
// radians has one.
std::optional<double> exact_degrees(double rad) {
  const double about = rad / kRadPerDegree;
  std::array<char, 32> text{};
  for (int digits = 1; digits <= 17; ++digits) {
    const auto end =
        std::to_chars(text.data(), text.data() + text.size(), about, std::chars_format::general, digits).ptr;
    double candidate = 0.0;
    std::from_chars(text.data(), end, candidate);
    if (candidate * kRadPerDegree == rad) return candidate;
  }
  for (const double towards : {-1e300, 1e300}) {
    double candidate = about;
    for (int i = 0; i < 3; ++i) {
      candidate = std::nextafter(candidate, towards);
      if (candidate * kRadPerDegree == rad) return candidate;
    }
  }
  return std::nullopt;
}

// A field "point_angle_rad" is "point_angle_deg" in a file.
std::string in_degrees(std::string_view field) { return std::string(field.substr(0, field.size() - 3)) + "deg"; }

std::shared_ptr<const SampledDistance> read_samples(const YAML::Node& node) {
  if (!node.IsMap()) throw Fault{"\"samples\" must have low, high, pitch and values"};
  auto made = std::make_shared<SampledDistance>();
  constexpr std::int64_t kFar = 1 << 20;
  const auto corner = [&](const char* field) {
    const YAML::Node list = node[field];
    if (!list || !list.IsSequence() || list.size() != 3)
      throw Fault{std::string("\"samples: ") + field + "\" must be three whole numbers"};
    std::int32_t at[3];
    for (std::size_t k = 0; k < 3; ++k)
      at[k] = static_cast<std::int32_t>(whole(list[k], std::string("samples: ") + field, -kFar, kFar));
    return Coord{at[0], at[1], at[2]};
  };
  made->box = {corner("low"), corner("high")};
  if (!node["pitch"] || !node["values"]) throw Fault{"\"samples\" must have low, high, pitch and values"};
  made->pitch = static_cast<std::int32_t>(whole(node["pitch"], "samples: pitch", 1, 1 << 16));
  const YAML::Binary bytes = node["values"].as<YAML::Binary>();
  const Coord dims = made->box.dims();
  const double count = static_cast<double>(dims.x) * static_cast<double>(dims.y) * static_cast<double>(dims.z);
  if (dims.x < 2 || dims.y < 2 || dims.z < 2 || count * 2.0 != static_cast<double>(bytes.size()))
    throw Fault{"\"samples: values\" does not hold one value for each sample from low to high; write the file again"};
  made->values.resize(bytes.size() / 2);
  for (std::size_t i = 0; i < made->values.size(); ++i)
    made->values[i] = static_cast<std::int16_t>(bytes.data()[2 * i] | bytes.data()[2 * i + 1] << 8);
  return made;
}

std::string kinds_sentence() {
  std::string all;
  for (const auto& [kind, name] : tool_kinds()) all += (all.empty() ? "" : ", ") + std::string(name);
  return all;
}

std::string name_in_file(const FieldRule& rule) {
  return rule.name.ends_with("_rad") ? in_degrees(rule.name) : std::string(rule.name);
}

Fault unknown_field(const std::string& field, const std::string& kind, const Tool& tool,
                    std::span<const FieldRule> rules) {
  std::string names;
  for (const FieldRule& rule : rules) names += (names.empty() ? "" : ", ") + name_in_file(rule);
  return {"\"" + field + "\" is not a field of a " + kind + "; remove it or choose one of name, title, kind, " + names +
          (tool.cuts() ? ", cut_level, law" : "")};
}

Fault missing_field(const FieldRule& rule, const std::string& kind) {
  return {"\"" + name_in_file(rule) + "\" is missing; the kind " + kind + " needs it, " + limits_sentence(rule)};
}

Tool read(const YAML::Node& root, const MeshLoader& load_mesh) {
  if (!root.IsMap()) throw Fault{"it must be a list of \"field: value\" lines"};
  if (!root["kind"]) throw Fault{"\"kind\" is missing; choose one of " + kinds_sentence()};
  if (!root["name"]) throw Fault{"\"name\" is missing; write one such as burr-round-5"};
  Tool tool;
  const std::string kind = scalar(root["kind"], "kind");
  const auto known = std::ranges::find(tool_kinds(), std::string_view(kind), &KindName::name);
  if (known == tool_kinds().end()) throw Fault{"\"kind\" is \"" + kind + "\"; choose one of " + kinds_sentence()};
  tool.kind = known->kind;
  tool.name = tool.title = scalar(root["name"], "name");
  tool.cut_level = 0;

  const auto rules = field_rules(tool.kind);
  std::vector<const FieldRule*> given;
  bool has_level = false;
  std::string mesh_file;
  double mesh_pitch_mm = 0.0;
  std::vector<std::string> seen;
  for (const auto& entry : root) {
    const std::string field = scalar(entry.first, "a field's name");
    if (std::ranges::find(seen, field) != seen.end()) throw Fault{"\"" + field + "\" is there twice; remove one"};
    seen.push_back(field);
    if (field == "name" || field == "kind") continue;
    if (field == "title") {
      tool.title = scalar(entry.second, field);
      continue;
    }
    if (field == "law" && tool.cuts()) {
      tool.law = scalar(entry.second, field);
      if (tool.law.empty()) throw Fault{"\"law\" is empty; name a force law, or remove the line"};
      continue;
    }
    if (field == "cut_level" && tool.cuts()) {
      tool.cut_level = static_cast<int>(whole(entry.second, field, 0, kLevels - 1));
      has_level = true;
      continue;
    }
    if (tool.kind == ToolKind::mesh && (field == "mesh" || field == "mesh_pitch_mm" || field == "samples")) {
      if (field == "mesh")
        mesh_file = scalar(entry.second, field);
      else if (field == "mesh_pitch_mm")
        mesh_pitch_mm = number(entry.second, field);
      else
        tool.mesh = read_samples(entry.second);
      continue;
    }
    const auto rule = std::ranges::find_if(rules, [&](const FieldRule& r) {
      return r.name == field || (r.name.ends_with("_rad") && in_degrees(r.name) == field);
    });
    if (rule == rules.end()) throw unknown_field(field, kind, tool, rules);
    if (std::ranges::find(given, &*rule) != given.end()) throw Fault{"\"" + field + "\" is there twice; remove one"};
    const bool degrees = field != rule->name;
    set_field(tool, *rule, number(entry.second, field) * (degrees ? kRadPerDegree : 1.0));
    given.push_back(&*rule);
  }
  for (const FieldRule& rule : rules)
    if (rule.required && std::ranges::find(given, &rule) == given.end()) throw missing_field(rule, kind);
  if (tool.cuts() && !has_level)
    throw Fault{"\"cut_level\" is missing; choose 0 for large cutters, 2 for small ones and blades"};
  if (tool.kind == ToolKind::mesh && !tool.mesh) {
    if (mesh_file.empty()) throw Fault{"\"mesh\" is missing; name the STL file of its solid"};
    if (!(mesh_pitch_mm >= 0.05 && mesh_pitch_mm <= 5.0))
      throw Fault{"\"mesh_pitch_mm\" must be from 0.05 to 5; half the smallest thickness of the solid is good"};
    if (!load_mesh)
      throw Fault{"\"mesh\" names a file, and this program reads none; write its samples into the tool file"};
    auto mesh = load_mesh(mesh_file, mesh_pitch_mm);
    if (!mesh) throw Fault{"\"mesh\": " + mesh.error().message};
    tool.mesh = *mesh;
  }
  derive_fields(tool);
  if (const auto fault = tool_fault(tool)) throw Fault{*fault};
  return tool;
}

}  // namespace

Result<Tool> parse_tool(std::string_view text, const std::string& file_name, const MeshLoader& load_mesh) {
  try {
    return read(YAML::Load(std::string(text)), load_mesh);
  } catch (const Fault& fault) {
    return failure(ErrorCode::invalid_input, file_name + ": " + fault.what);
  } catch (const YAML::Exception& error) {
    const std::string line = error.mark.is_null() ? std::string() : ", line " + std::to_string(error.mark.line + 1);
    return failure(ErrorCode::invalid_input,
                   file_name + line + ": this is not YAML (" + error.msg + "); write lines such as diameter_mm: 3.5");
  }
}

Result<Tool> load_tool(const std::filesystem::path& file, const MeshLoader& load_mesh) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error)
    return failure(ErrorCode::not_found, "there is no tool file " + file.string() + "; give the path of a YAML file");
  if (size > kLargestFile)
    return failure(ErrorCode::invalid_input,
                   file.string() + " is too large for a tool file; use a coarser mesh_pitch_mm");
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return failure(ErrorCode::unavailable, file.string() + " cannot be read; check its permissions");
  return parse_tool(text, file.string(), load_mesh);
}

std::string to_yaml(const Tool& tool) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  out << YAML::Key << "name" << YAML::Value << tool.name;
  // Quoted, so that a title such as "3.5: long" stays one text.
  out << YAML::Key << "title" << YAML::Value << YAML::DoubleQuoted << tool.title;
  out << YAML::Key << "kind" << YAML::Value << std::string(kind_name(tool.kind));
  for (const FieldRule& rule : field_rules(tool.kind)) {
    const double value = get_field(tool, rule);
    const bool angle = rule.name.ends_with("_rad");
    const auto degrees = angle ? exact_degrees(value) : std::nullopt;
    out << YAML::Key << (degrees ? in_degrees(rule.name) : std::string(rule.name)) << YAML::Value
        << shortest(degrees ? *degrees : value);
  }
  if (tool.cuts()) out << YAML::Key << "cut_level" << YAML::Value << tool.cut_level;
  if (!tool.law.empty()) out << YAML::Key << "law" << YAML::Value << tool.law;
  if (tool.mesh) {
    const CoordBox& box = tool.mesh->box;
    std::vector<unsigned char> bytes;
    bytes.reserve(2 * tool.mesh->values.size());
    for (const std::int16_t value : tool.mesh->values) {
      const auto bits = static_cast<std::uint16_t>(value);
      bytes.push_back(static_cast<unsigned char>(bits & 0xff));
      bytes.push_back(static_cast<unsigned char>(bits >> 8));
    }
    out << YAML::Key << "samples" << YAML::Value << YAML::BeginMap;
    out << YAML::Key << "low" << YAML::Value << YAML::Flow << std::vector<int>{box.min.x, box.min.y, box.min.z};
    out << YAML::Key << "high" << YAML::Value << YAML::Flow << std::vector<int>{box.max.x, box.max.y, box.max.z};
    out << YAML::Key << "pitch" << YAML::Value << tool.mesh->pitch;
    out << YAML::Key << "values" << YAML::Value << YAML::Binary(bytes.data(), bytes.size());
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

Result<Tool> edited(const Tool& tool, std::string_view field, double value) {
  const auto rules = field_rules(tool.kind);
  const auto rule = std::ranges::find_if(rules, [&](const FieldRule& r) { return r.editable && r.name == field; });
  if (rule == rules.end()) {
    std::string names;
    for (const FieldRule& r : rules)
      if (r.editable) names += (names.empty() ? "" : ", ") + std::string(r.name);
    return failure(ErrorCode::invalid_input, tool.name + ": \"" + std::string(field) + "\" cannot be changed on a " +
                                                 std::string(kind_name(tool.kind)) + "; " +
                                                 (names.empty() ? "nothing of it can" : "choose one of " + names));
  }
  Tool changed = tool;
  // Checked before the conversion to a whole number of teeth, which not every value allows.
  if (const auto fault = value_fault(*rule, value)) return failure(ErrorCode::invalid_input, tool.name + ": " + *fault);
  set_field(changed, *rule, value);
  derive_fields(changed);
  if (const auto fault = tool_fault(changed)) return failure(ErrorCode::invalid_input, tool.name + ": " + *fault);
  return changed;
}

std::vector<EditableField> editable_fields(ToolKind kind) {
  std::vector<EditableField> fields;
  for (const FieldRule& rule : field_rules(kind))
    if (rule.editable) fields.push_back({std::string(rule.name), rule.lowest, rule.highest, rule.whole()});
  return fields;
}

std::string_view kind_name(ToolKind kind) {
  const auto found = std::ranges::find(tool_kinds(), kind, &KindName::kind);
  return found == tool_kinds().end() ? "tool of an unknown kind" : found->name;
}

}  // namespace osteon
