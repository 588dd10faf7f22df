#include "viewer_client/inside/metal_in_beam.hpp"

#include "common/radiology/attenuation.hpp"
#include "common/tools/tool_solid.hpp"

namespace osteon {

radiology::MetalSolid in_bone_frame(const PlacedMetal& metal) {
  return {placed(*metal.solid, metal.pose_bone_solid), radiology::kSteel_per_mm};
}

MetalInBeam::MetalInBeam() {
  for (const Tool& tool : builtin_tools()) learn(tool);
}

void MetalInBeam::learn(const Tool& tool) {
  shapes_[tool.name] = {tool, nullptr};
  names_[tool.hash()] = tool.name;
}

void MetalInBeam::add(std::vector<PlacedMetal>& to, const std::string& name, const Pose& pose) {
  const auto found = shapes_.find(name);
  if (found == shapes_.end()) return;
  Shape& shape = found->second;
  if (!shape.solid) shape.solid = std::make_shared<const Implicit>(tool_solid(shape.tool));
  to.push_back({shape.solid, pose});
}

std::vector<PlacedMetal> MetalInBeam::of(std::span<const CuttingState> states, std::span<const SceneItem> items) {
  std::vector<PlacedMetal> metal;
  for (const CuttingState& state : states) add(metal, state.tool_name, state.pose_bone_tool);
  for (const SceneItem& item : items)
    if (const auto name = names_.find(item.tool); name != names_.end()) add(metal, name->second, item.pose_bone_item);
  return metal;
}

}  // namespace osteon
