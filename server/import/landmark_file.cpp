#include "server/import/landmark_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "common/core/bounded_text.hpp"
#include "server/import/yaml_fields.hpp"

namespace osteon::import {
namespace {

constexpr std::size_t kLongestLandmarkName = 60;  // bytes
constexpr YamlList kLandmarkList{"landmarks", "landmark",
                                 "write landmarks: [{fixed_mm: [12.5, -3, 40], moving_mm: [10, 2, 38]}, ...]", 1000};

NamedLandmark landmark_of(const YAML::Node& node, const std::vector<NamedLandmark>& before) {
  if (!node.IsMap()) throw YamlFault{std::string("it has no fields; ") + kLandmarkList.remedy};
  check_fields(node, "a landmark", {"fixed_mm", "moving_mm"}, {"name"});
  NamedLandmark landmark;
  landmark.name = "landmark " + std::to_string(before.size() + 1);
  if (const YAML::Node name = node["name"]) {
    if (!name.IsScalar() || name.Scalar().empty() || name.Scalar().size() > kLongestLandmarkName ||
        bounded_text(name.Scalar()) != name.Scalar())
      throw YamlFault{"name is not one to " + std::to_string(kLongestLandmarkName) +
                      " bytes of plain text; write a short one, or leave it out"};
    landmark.name = name.Scalar();
  }
  if (std::ranges::find(before, landmark.name, &NamedLandmark::name) != before.end())
    throw YamlFault{"name is " + quoted_value(landmark.name) + ", as that of another landmark; write another"};
  landmark.at.fixed_mm = position_of(node["fixed_mm"], "fixed_mm");
  landmark.at.moving_mm = position_of(node["moving_mm"], "moving_mm");
  return landmark;
}

}  // namespace

Result<std::vector<NamedLandmark>> parse_landmarks(std::string_view text, const std::string& file_name) {
  std::vector<NamedLandmark> landmarks;
  const auto parsed = parse_yaml_list(text, file_name, kLandmarkList, [&](const YAML::Node& node) {
    landmarks.push_back(landmark_of(node, landmarks));
  });
  if (!parsed) return tl::unexpected(parsed.error());
  if (landmarks.size() < imaging::kLeastLandmarks)
    return bad_input(file_name + " has " + std::to_string(landmarks.size()) + " landmark" +
                     (landmarks.size() == 1 ? "" : "s") + "; write at least " +
                     std::to_string(imaging::kLeastLandmarks) + " that do not lie on a line");
  return landmarks;
}

Result<std::vector<NamedLandmark>> read_landmarks(const std::filesystem::path& file) {
  const auto text = read_yaml_list(file, kLandmarkList);
  if (!text) return tl::unexpected(text.error());
  return parse_landmarks(*text, file.string());
}

}  // namespace osteon::import
