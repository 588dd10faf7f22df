// Which metal stands in the beam: tools in hands, and items on the bone.
#include "viewer_client/inside/metal_in_beam.hpp"

#include <gtest/gtest.h>

#include "common/radiology/attenuation.hpp"

namespace osteon {
namespace {

CuttingState tool_at(const std::string& name, const Vec3& tip_mm) {
  CuttingState state;
  state.tool_name = name;
  state.pose_bone_tool = pose_along(tip_mm, Vec3(0, 0, -1));
  return state;
}

SceneItem item_of(const Tool& tool, const Vec3& at_mm) {
  SceneItem item;
  item.tool = tool.hash();
  item.pose_bone_item = pose_along(at_mm, Vec3(0, 0, -1));
  return item;
}

TEST(MetalInBeam, IsToolsAndItemsAtTheirPlaces) {
  MetalInBeam metal;
  const std::vector states{tool_at("drill-3.2", {1, 2, 3}), tool_at("", {0, 0, 0}), tool_at("no-such", {0, 0, 0})};
  const std::vector items{item_of(*find_tool("screw-1"), {9, 0, 0}), SceneItem{}};
  const std::vector<PlacedMetal> found = metal.of(states, items);
  ASSERT_EQ(found.size(), 2u) << "an empty hand and what nobody knows cast no shadow";
  const radiology::MetalSolid drill = in_bone_frame(found[0]);
  EXPECT_EQ(drill.attenuation_per_mm, radiology::kSteel_per_mm);
  // The drill's axis goes up from its tip: 5 mm above it is within, 5 mm below is not, and its radius is 1.6 mm.
  EXPECT_LT(drill.solid({1, 2, 8}), 0.0);
  EXPECT_GT(drill.solid({1, 2, -2}), 0.0);
  EXPECT_NEAR(drill.solid({1 + 1.6, 2, 13}), 0.0, 1e-6);
  EXPECT_LT(in_bone_frame(found[1]).solid({9, 0, 4}), 0.0);
  // Equal places of equal shapes are equal, so that nothing is cast again.
  EXPECT_EQ(metal.of(states, items), found);
  EXPECT_NE(metal.of(std::vector{tool_at("drill-3.2", {1, 2, 3.1})}, {})[0], found[0]);
}

TEST(MetalInBeam, LearnsTheToolsOfItsRoom) {
  MetalInBeam metal;
  Tool thick = *find_tool("drill-3.2");
  thick.name = "thick";
  thick.diameter_mm = 6.0;
  const std::vector states{tool_at("thick", {0, 0, 0})};
  const std::vector items{item_of(thick, {0, 0, 0})};
  EXPECT_TRUE(metal.of(states, items).empty());
  metal.learn(thick);
  const std::vector<PlacedMetal> found = metal.of(states, items);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0], found[1]) << "one shape for both";
  EXPECT_LT(in_bone_frame(found[0]).solid({2.9, 0, 10}), 0.0);
}

}  // namespace
}  // namespace osteon
