#include "server/import/edit_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "common/core/bounded_text.hpp"
#include "common/imaging/watershed.hpp"
#include "server/import/yaml_fields.hpp"

namespace osteon::import {
namespace {

constexpr std::size_t kMostPoints = 1000;
constexpr double kLeastRadius_mm = 0.05, kMostRadius_mm = 200.0;
constexpr int kMostBone = imaging::kMostMarkers;
constexpr std::size_t kLongestEditName = 60;  // bytes
constexpr double kMostMinutes = 1e5;
constexpr YamlList kEditList{"edits", "edit", "write edits: [{kind: erase, centre_mm: [12.5, -3, 40], radius_mm: 2}]",
                             1000};

struct EditFields {
  std::string_view kind;
  EditKind value;
  std::vector<std::string_view> needed, optional;
};

const std::vector<EditFields>& edit_kinds() {
  static const std::vector<EditFields> all{
      {"paint", EditKind::paint, {"bone", "centre_mm", "radius_mm"}, {"normal"}},
      {"scribble", EditKind::scribble, {"bone", "points_mm", "radius_mm"}, {"normal"}},
      {"erase", EditKind::erase, {"radius_mm"}, {"centre_mm", "points_mm", "bone", "normal"}},
      {"cut", EditKind::cut, {"bone", "point_mm", "normal"}, {"to_bone"}},
      {"seed", EditKind::seed, {"point_mm"}, {"bone"}},
      {"outside", EditKind::outside, {"point_mm"}, {}},
      {"box", EditKind::box, {"corner_mm", "opposite_mm"}, {}},
      {"label", EditKind::label, {"bone", "name"}, {"opacity", "minutes"}},
      {"landmark", EditKind::landmark, {"name", "point_mm"}, {}},
  };
  return all;
}

int bone_of(const YAML::Node& node, const std::string& field) {
  const double value = number_of(node, field, 1, kMostBone);
  if (value != std::floor(value))
    throw YamlFault{field + " is " + quoted_value(node.Scalar()) + "; write a whole number from 1 to " +
                    std::to_string(kMostBone)};
  return static_cast<int>(value);
}

std::vector<Vec3> points_of(const YAML::Node& node, const std::string& field) {
  if (!node.IsSequence() || node.size() < 2 || node.size() > kMostPoints)
    throw YamlFault{field + " is not a list of 2 to " + std::to_string(kMostPoints) +
                    " points; write [[x, y, z], [x, y, z]]"};
  std::vector<Vec3> points;
  for (const YAML::Node& point : node) points.push_back(position_of(point, field));
  return points;
}

Vec3 direction_of(const YAML::Node& node, const std::string& field) {
  const Vec3 normal = position_of(node, field);
  if (!(normal.norm() >= 1e-6)) throw YamlFault{field + " has no length; write a direction, such as [0, 0, 1]"};
  return normal.normalized();
}

std::string edit_name_of(const YAML::Node& node) {
  if (!node.IsScalar() || node.Scalar().empty() || node.Scalar().size() > kLongestEditName ||
      bounded_text(node.Scalar()) != node.Scalar())
    throw YamlFault{"name is not one to " + std::to_string(kLongestEditName) +
                    " bytes of plain text; write a short one, such as femur"};
  return node.Scalar();
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
  else if (field == "name")
    edit.name = edit_name_of(node);
  else if (field == "opacity")
    edit.opacity = number_of(node, field, 0.0, 1.0);
  else if (field == "minutes")
    edit.minutes = number_of(node, field, 0.0, kMostMinutes);
  else
    edit.points_mm.push_back(position_of(node, field));  // the two corners of a box have an order of no meaning
}

LabelEdit edit_of(const YAML::Node& node) {
  const auto kind_name = [](const EditFields& kind) { return kind.kind; };
  const std::string kinds = names_in(edit_kinds(), kind_name);
  if (!node.IsMap() || !node["kind"]) throw YamlFault{"kind is missing; write kind: and one of " + kinds};
  if (!node["kind"].IsScalar()) throw YamlFault{"kind is not a single word; write one of " + kinds};
  const std::string kind = node["kind"].Scalar();
  const auto known = std::ranges::find(edit_kinds(), std::string_view(kind), kind_name);
  if (known == edit_kinds().end()) throw YamlFault{"kind is " + quoted_value(kind) + "; write one of " + kinds};
  LabelEdit edit;
  edit.kind = known->value;
  std::vector<std::string_view> optional = known->optional;
  optional.push_back("kind");
  check_fields(node, kind, known->needed, optional);
  for (const auto& entry : node)
    if (const std::string& field = entry.first.Scalar(); field != "kind") set_field(edit, field, entry.second);
  if (edit.kind == EditKind::cut && edit.to_bone == edit.bone)
    throw YamlFault{"to_bone is " + std::to_string(edit.bone) + ", as bone is; write another number, or leave it out"};
  // A bone without a name is called so, and names differ.
  if (edit.kind == EditKind::label && edit.name.starts_with("bone ") &&
      edit.name != "bone " + std::to_string(edit.bone))
    throw YamlFault{"name is " + quoted_value(edit.name) +
                    ", which only a bone of that number may have; write another"};
  if (edit.kind == EditKind::erase && node["centre_mm"].IsDefined() == node["points_mm"].IsDefined())
    throw YamlFault{"erase needs centre_mm or points_mm, and not both; write one of them"};
  return edit;
}

// What may be there only once.
void check_against(const std::vector<LabelEdit>& before, const LabelEdit& edit) {
  for (const LabelEdit& other : before) {
    if (other.kind != edit.kind) continue;
    if (edit.kind == EditKind::box) throw YamlFault{"there is a box before it; remove one of them"};
    if (edit.kind == EditKind::label && other.bone == edit.bone)
      throw YamlFault{"bone " + std::to_string(edit.bone) + " has a label before it; remove one of them"};
    if ((edit.kind == EditKind::label || edit.kind == EditKind::landmark) && other.name == edit.name)
      throw YamlFault{"name is " + quoted_value(edit.name) + ", as that of another " + std::string(name_of(edit.kind)) +
                      "; write another"};
  }
}

}  // namespace

Result<std::vector<LabelEdit>> parse_edits(std::string_view text, const std::string& file_name) {
  std::vector<LabelEdit> edits;
  const auto parsed = parse_yaml_list(text, file_name, kEditList, [&](const YAML::Node& node) {
    LabelEdit edit = edit_of(node);
    check_against(edits, edit);
    edits.push_back(std::move(edit));
  });
  if (!parsed) return tl::unexpected(parsed.error());
  return edits;
}

Result<std::vector<LabelEdit>> read_edits(const std::filesystem::path& file) {
  const auto text = read_yaml_list(file, kEditList);
  if (!text) return tl::unexpected(text.error());
  return parse_edits(*text, file.string());
}

}  // namespace osteon::import
