#include "server/import/carve_script.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "common/geometry/pose_across.hpp"
#include "common/volume/mesh_distance.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostSteps = 100000;
// From the origin. A scanner may place a bone some metres from its own.
constexpr double kFarthestCut_mm = 10'000.0;

// A fault of one step. It is caught where the file and the step's number are known.
struct Wrong {
  std::string what;
};

Vec3 vector_of(const YAML::Node& node, const char* field) {
  std::vector<double> v;
  try {
    v = node.as<std::vector<double>>();
  } catch (const YAML::Exception&) {
  }
  const bool good = v.size() == 3 && std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
  if (!good) throw Wrong{std::string(field) + " must be three numbers, such as [0, 0, -1]"};
  return {v[0], v[1], v[2]};
}

Vec3 place_of(const YAML::Node& node, const char* field) {
  Vec3 at = vector_of(node, field);
  if (at.cwiseAbs().maxCoeff() > kFarthestCut_mm)
    throw Wrong{std::string(field) + " is more than 10 m from the origin"};
  return at;
}

void only(const YAML::Node& node, std::initializer_list<const char*> allowed) {
  if (!node.IsMap()) throw Wrong{"it must be a map of fields"};
  for (const auto& entry : node) {
    const auto key = entry.first.as<std::string>();
    if (std::find(allowed.begin(), allowed.end(), key) == allowed.end()) throw Wrong{"there is no field " + key};
  }
}

// Tip, axis and across. Values that a pose omits are taken from the step.
Pose pose_of(const Vec3& at, const YAML::Node& own, const YAML::Node& step) {
  const YAML::Node axis_node = own["axis"] ? own["axis"] : step["axis"];
  if (!axis_node) throw Wrong{"axis is missing: the direction out of the tool's tip, such as [0, 0, -1]"};
  const Vec3 axis = vector_of(axis_node, "axis");
  if (axis.norm() < 1e-6) throw Wrong{"axis has no length"};
  const YAML::Node across_node = own["across"] ? own["across"] : step["across"];
  if (!across_node) return pose_along(at, axis);
  const Vec3 across = vector_of(across_node, "across");
  if (across.cross(axis).norm() < 1e-6 * axis.norm()) throw Wrong{"across must not be along axis"};
  return pose_across(at, axis, across);
}

CarveStep step_of(const YAML::Node& node, const fs::path& folder) {
  only(node, {"tool", "from", "to", "at", "axis", "across", "path", "level"});
  if (!node["tool"]) throw Wrong{"tool is missing"};
  CarveStep step;
  auto tool = tool_named(node["tool"].as<std::string>(), folder);
  if (!tool) throw Wrong{tool.error().message};
  step.tool = std::move(*tool);
  if (!step.tool.cuts()) throw Wrong{step.tool.name + " does not cut; osteon-import tools lists those that do"};
  if (node["level"]) {
    step.level = node["level"].as<int>();
    if (*step.level < 0 || *step.level >= kLevels) throw Wrong{"level must be 0, 1 or 2"};
    if (*step.level > step.tool.cut_level)
      throw Wrong{step.tool.name + " cuts no finer than level " + std::to_string(step.tool.cut_level)};
  }
  const int ways = (node["path"] ? 1 : 0) + (node["from"] || node["to"] ? 1 : 0) + (node["at"] ? 1 : 0);
  if (ways != 1) throw Wrong{"it needs from and to, or at, or path"};
  if (node["path"]) {
    if (!node["path"].IsSequence() || node["path"].size() == 0) throw Wrong{"path must be a list of poses"};
    for (const YAML::Node& pose : node["path"]) {
      only(pose, {"at", "axis", "across"});
      if (!pose["at"]) throw Wrong{"a pose of path lacks at"};
      step.path.push_back(pose_of(place_of(pose["at"], "at"), pose, node));
    }
  } else if (node["at"]) {
    step.path.push_back(pose_of(place_of(node["at"], "at"), node, node));
  } else {
    for (const char* end : {"from", "to"}) {
      if (!node[end]) throw Wrong{std::string(end) + " is missing"};
      step.path.push_back(pose_of(place_of(node[end], end), node, node));
    }
  }
  return step;
}

}  // namespace

Result<Tool> tool_named(const std::string& name, const fs::path& folder) {
  const fs::path given(name);
  if (given.extension() != ".yaml" && given.extension() != ".yml") {
    Result<Tool> known = find_tool(name);
    if (!known)
      return failure(known.error().code,
                     known.error().message + "; or name a tool file of yours, such as my-tool.yaml");
    return known;
  }
  return load_tool_file(given.is_absolute() ? given : folder / given);  // with the STL that it may name
}

Result<std::vector<CarveStep>> read_carve_script(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    return failure(ErrorCode::not_found, "there is no script " + file.string() +
                                             "; check its name, and give a YAML file with a list `steps`");
  std::size_t number = 0;
  try {
    const YAML::Node root = YAML::LoadFile(file.string());
    if (!root.IsMap() || !root["steps"] || !root["steps"].IsSequence() || root["steps"].size() == 0)
      return failure(ErrorCode::invalid_input, file.string() + " is not a carve script: it needs a list `steps`");
    if (root["steps"].size() > kMostSteps)
      return failure(ErrorCode::invalid_input,
                     file.string() + " has more than " + std::to_string(kMostSteps) + " steps");
    std::vector<CarveStep> steps;
    for (const YAML::Node& node : root["steps"]) {
      ++number;
      steps.push_back(step_of(node, file.parent_path()));
    }
    return steps;
  } catch (const Wrong& wrong) {
    return failure(ErrorCode::invalid_input, file.string() + ", step " + std::to_string(number) + ": " + wrong.what);
  } catch (const YAML::Exception& e) {
    const std::string where = number > 0 ? ", step " + std::to_string(number) : "";
    return failure(ErrorCode::invalid_input, file.string() + where + " cannot be read as YAML (" + e.what() + ")");
  }
}

}  // namespace osteon::import
