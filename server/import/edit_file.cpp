#include "server/import/edit_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>

#include "common/core/bounded_text.hpp"
#include "common/imaging/watershed.hpp"

namespace osteon::import {
namespace {

constexpr std::uintmax_t kMostEditBytes = 1 << 20;
constexpr std::size_t kMostEdits = 1000, kMostPoints = 1000;
constexpr std::size_t kMostQuotedValue = 60;  // bytes of a value in an error
constexpr double kFarthestEdit_mm = 1e5, kLeastRadius_mm = 0.05, kMostRadius_mm = 200.0;
constexpr int kMostBone = imaging::kMostMarkers;
constexpr const char* kExample = "write edits: [{kind: erase, centre_mm: [12.5, -3, 40], radius_mm: 2}]";

// What is wrong with an edit. Caught where the file and the number of the edit are known.
struct EditFault {
  std::string what;
};

std::string quoted_value(const std::string& text) { return "\"" + bounded_text(text, kMostQuotedValue) + "\""; }

struct EditFields {
  std::string_view kind;
  EditKind value;
  std::vector<std::string_view> needed, optional;
};

const std::vector<EditFields>& edit_kinds() {
  static const std::vector<EditFields> all{
      {"paint", EditKind::paint, {"bone", "centre_mm", "radius_mm"}, {}},
      {"scribble", EditKind::scribble, {"bone", "points_mm", "radius_mm"}, {}},
      {"erase", EditKind::erase, {"centre_mm", "radius_mm"}, {"bone"}},
      {"cut", EditKind::cut, {"bone", "point_mm", "normal"}, {"to_bone"}},
      {"seed", EditKind::seed, {"point_mm"}, {"bone"}},
  };
  return all;
}

template <class List, class Name>
std::string list_of(const List& list, Name name) {
  std::string text;
  for (const auto& entry : list) text += (text.empty() ? "" : ", ") + std::string(name(entry));
  return text;
}

double number_of(const YAML::Node& node, const std::string& field, double least, double most) {
  std::array<char, 100> remedy{};
  std::snprintf(remedy.data(), remedy.size(), "; write a number from %g to %g", least, most);
  if (!node.IsScalar()) throw EditFault{field + " is not a single number" + remedy.data()};
  const std::string& text = node.Scalar();
  double value = 0.0;
  const char* from = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(from, text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !(value >= least && value <= most))
    throw EditFault{field + " is " + quoted_value(text) + remedy.data()};
  return value;
}

int bone_of(const YAML::Node& node, const std::string& field) {
  const double value = number_of(node, field, 1, kMostBone);
  if (value != std::floor(value))
    throw EditFault{field + " is " + quoted_value(node.Scalar()) + "; write a whole number from 1 to " +
                    std::to_string(kMostBone)};
  return static_cast<int>(value);
}

Vec3 position_of(const YAML::Node& node, const std::string& field) {
  if (!node.IsSequence() || node.size() != 3)
    throw EditFault{field + " does not have three numbers; write [x, y, z], such as [12.5, -3, 40]"};
  Vec3 at;
  for (std::size_t axis = 0; axis < 3; ++axis)
    at[static_cast<int>(axis)] = number_of(node[axis], field, -kFarthestEdit_mm, kFarthestEdit_mm);
  return at;
}

std::vector<Vec3> points_of(const YAML::Node& node, const std::string& field) {
  if (!node.IsSequence() || node.size() < 2 || node.size() > kMostPoints)
    throw EditFault{field + " is not a list of 2 to " + std::to_string(kMostPoints) +
                    " points; write [[x, y, z], [x, y, z]]"};
  std::vector<Vec3> points;
  for (const YAML::Node& point : node) points.push_back(position_of(point, field));
  return points;
}

Vec3 direction_of(const YAML::Node& node, const std::string& field) {
  const Vec3 normal = position_of(node, field);
  if (!(normal.norm() >= 1e-6)) throw EditFault{field + " has no length; write a direction, such as [0, 0, 1]"};
  return normal.normalized();
}

void set_field(LabelEdit& edit, const std::string& field, const YAML::Node& node) {
  if (field == "bone")
    edit.bone = bone_of(node, field);
  else if (field == "to_bone")
    edit.to_bone = bone_of(node, field);
  else if (field == "radius_mm")
    edit.radius_mm = number_of(node, field, kLeastRadius_mm, kMostRadius_mm);
  else if (field == "normal")
    edit.normal = direction_of(node, field);
  else if (field == "points_mm")
    edit.points_mm = points_of(node, field);
  else
    edit.points_mm = {position_of(node, field)};
}

LabelEdit edit_of(const YAML::Node& node) {
  const auto kind_name = [](const EditFields& kind) { return kind.kind; };
  const std::string kinds = list_of(edit_kinds(), kind_name);
  if (!node.IsMap() || !node["kind"]) throw EditFault{"kind is missing; write kind: and one of " + kinds};
  if (!node["kind"].IsScalar()) throw EditFault{"kind is not a single word; write one of " + kinds};
  const std::string kind = node["kind"].Scalar();
  const auto known = std::ranges::find(edit_kinds(), std::string_view(kind), kind_name);
  if (known == edit_kinds().end()) throw EditFault{"kind is " + quoted_value(kind) + "; write one of " + kinds};
  LabelEdit edit;
  edit.kind = known->value;
  std::vector<std::string> seen;
  for (const auto& entry : node) {
    const std::string field = entry.first.IsScalar() ? entry.first.Scalar() : "";
    if (std::ranges::find(seen, field) != seen.end())
      throw EditFault{bounded_text(field, kMostQuotedValue) + " is there twice; remove one"};
    seen.push_back(field);
    if (field == "kind") continue;
    if (std::ranges::find(known->needed, field) == known->needed.end() &&
        std::ranges::find(known->optional, field) == known->optional.end()) {
      std::vector<std::string_view> fields = known->needed;
      fields.insert(fields.end(), known->optional.begin(), known->optional.end());
      throw EditFault{quoted_value(field) + " is no field of " + kind + "; remove it, or write one of " +
                      list_of(fields, [](std::string_view name) { return name; })};
    }
    set_field(edit, field, entry.second);
  }
  for (const std::string_view field : known->needed)
    if (std::ranges::find(seen, field) == seen.end())
      throw EditFault{std::string(field) + " is missing; " + kind + " needs " +
                      list_of(known->needed, [](std::string_view name) { return name; })};
  if (edit.kind == EditKind::cut && edit.to_bone == edit.bone)
    throw EditFault{"to_bone is " + std::to_string(edit.bone) + ", as bone is; write another number, or leave it out"};
  return edit;
}

}  // namespace

Result<std::vector<LabelEdit>> parse_edits(std::string_view text, const std::string& file_name) {
  std::size_t number = 0;
  try {
    const YAML::Node root = YAML::Load(std::string(text));
    if (!root.IsMap() || !root["edits"] || !root["edits"].IsSequence() || root["edits"].size() == 0)
      throw EditFault{std::string("edits is not a list of edits; ") + kExample};
    for (const auto& entry : root)
      if (!entry.first.IsScalar() || entry.first.Scalar() != "edits" || root.size() != 1)
        throw EditFault{std::string("it has another field beside edits; remove it, and ") + kExample};
    if (root["edits"].size() > kMostEdits)
      throw EditFault{"edits has more than " + std::to_string(kMostEdits) + " entries; remove some"};
    std::vector<LabelEdit> edits;
    for (const YAML::Node& node : root["edits"]) {
      ++number;
      edits.push_back(edit_of(node));
    }
    return edits;
  } catch (const EditFault& fault) {
    const std::string where = number > 0 ? ", edit " + std::to_string(number) : "";
    return bad_input(file_name + where + ": " + fault.what);
  } catch (const YAML::Exception& error) {
    const std::string line = error.mark.is_null() ? "" : ", line " + std::to_string(error.mark.line + 1);
    return bad_input(file_name + line + ": this is not YAML (" + bounded_text(error.msg, 2 * kMostQuotedValue) + "); " +
                     kExample);
  }
}

Result<std::vector<LabelEdit>> read_edits(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error || !std::filesystem::is_regular_file(file, error))
    return failure(ErrorCode::not_found, "there is no file of edits " + file.string() + "; give that of a YAML file");
  if (size > kMostEditBytes)
    return bad_input(file.string() + " is longer than 1 MiB, more than any list of edits; give another file");
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return failure(ErrorCode::unavailable, file.string() + " cannot be read; check its permissions");
  return parse_edits(text, file.string());
}

}  // namespace osteon::import
