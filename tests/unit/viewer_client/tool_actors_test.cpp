// Checks in the pixels where tools are drawn.
#include <gtest/gtest.h>

#include <span>

#include "picture.hpp"

namespace osteon {
namespace {

using test::differing_pixels;
using test::focal_px;
using test::from_front;
using test::kHeight;
using test::kWidth;

class ToolPicture : public test::Picture {};

TEST_F(ToolPicture, TheToolStandsAtTheProxyAndTheGhostAtTheHand) {
  const Image empty = drawn();
  CuttingState state;
  state.author = AuthorId{7};
  state.tool_name = "burr-round-5";
  state.pose_bone_tool = pose_along(Vec3::Zero(), -Vec3::UnitZ());  // tip down: the shank rises from the centre
  state.pose_bone_device = state.pose_bone_tool;
  window_->scene().show_tools(std::span(&state, 1));
  const Image tool = drawn();
  // Between tip and shank, at the ball's middle: a radius above the tip.
  const int up_px = static_cast<int>(focal_px(from_front(100.0)) * 2.5 / 100.0);
  EXPECT_NE(tool.at(kWidth / 2, kHeight / 2 - up_px), empty.at(kWidth / 2, kHeight / 2 - up_px));
  EXPECT_EQ(tool.at(kWidth / 2, kHeight / 2 + 2 * up_px), empty.at(kWidth / 2, kHeight / 2 + 2 * up_px));

  // The hand is 10 mm to the right: something translucent appears there, and the tool is unchanged.
  state.pose_bone_device.position_mm += Vec3(10, 0, 0);
  window_->scene().show_tools(std::span(&state, 1));
  const Image ghost = drawn();
  const int right_px = static_cast<int>(focal_px(from_front(100.0)) * 10.0 / 100.0);
  EXPECT_EQ(ghost.at(kWidth / 2, kHeight / 2 - up_px), tool.at(kWidth / 2, kHeight / 2 - up_px));
  const Vec3 there = colour(ghost, kWidth / 2 + right_px, kHeight / 2 - up_px);
  const Vec3 before = colour(empty, kWidth / 2 + right_px, kHeight / 2 - up_px);
  EXPECT_GT((there - before).norm(), 10.0);
  EXPECT_LT((there - before).norm(), (colour(tool, kWidth / 2, kHeight / 2 - up_px) - before).norm());

  window_->scene().show_tools({});
  EXPECT_EQ(differing_pixels(drawn(), empty), 0);
}

}  // namespace
}  // namespace osteon
