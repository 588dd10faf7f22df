// Where the tool is in the bone when the handle is somewhere in its workspace.
#include "haptic_client/rendering/workspace_mapping.hpp"

#include <gtest/gtest.h>

namespace osteon::haptic::test {
namespace {

TEST(WorkspaceMapping, ReachesFarWithTheClutch) {
  WorkspaceMapping mapping;
  const Eigen::Quaterniond view(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()));
  mapping.align(view, 2.0, {5, 0, 0}, {100, 50, 20});
  const Pose handle{{10, 3, -4}, Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vec3::UnitY()))};
  const Pose tool = mapping.pose_bone_tool(handle);
  // Round trip, scale and directions.
  EXPECT_NEAR((mapping.pose_device_tool(tool).position_mm - handle.position_mm).norm(), 0.0, 1e-12);
  EXPECT_NEAR((tool.position_mm - Vec3(100, 50, 20)).norm(), 2.0 * (handle.position_mm - Vec3(5, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR((mapping.to_bone(mapping.to_device(Vec3(1, 2, 3))) - Vec3(1, 2, 3)).norm(), 0.0, 1e-12);
  // Re-anchoring keeps the tool where it is.
  mapping.anchor({0, 0, 0}, tool.position_mm);
  EXPECT_NEAR((mapping.pose_bone_tool({Vec3::Zero(), handle.rotation}).position_mm - tool.position_mm).norm(), 0.0,
              1e-12);
}

}  // namespace
}  // namespace osteon::haptic::test
