// Which cuts come from the motion of a tool.
#include "haptic_client/prediction/cut_recorder.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace osteon::haptic::test {
namespace {

// Cuts and contact are no finer than the case allows.
TEST(ToolModel, CutsNoFinerThanTheCase) {
  const Tool tool = *find_tool("drill-3.2");
  for (const double h : {0.5, 0.25, 0.15, 0.08}) {
    const ToolModel model(tool, h);
    EXPECT_EQ(model.cut_level, std::min(tool.cut_level, finest_level(h))) << h;
    EXPECT_EQ(model.fine_pitch_mm, level_pitch_mm(h, model.cut_level)) << h;
    EXPECT_EQ(cut_of(CutPiece{}, model, AuthorId{1}, 7).level, model.cut_level) << h;
  }
  EXPECT_LT(ToolModel(tool, 0.15).cut_level, tool.cut_level);
}

TEST(ToolModel, HasTheSamePointsWhetherTheyAreMadeNowOrLater) {
  for (const char* name : {"drill-3.2", "saw-oscillating-1", "broach-1", "burr-round-5"}) {
    SCOPED_TRACE(name);
    const Tool tool = *find_tool(name);
    const ToolModel now(tool, 0.5);
    ToolModel later = *ToolModel::make(tool, 0.5, 1.0, "", ToolPoints::later);
    EXPECT_FALSE(later.has_points());
    EXPECT_TRUE(later.active.empty() && later.passive.empty());
    later.make_points();
    ASSERT_TRUE(later.has_points());
    ASSERT_EQ(later.active.size(), now.active.size());
    ASSERT_EQ(later.passive.size(), now.passive.size());
    EXPECT_EQ(later.active_area_mm2, now.active_area_mm2);
    EXPECT_EQ(later.strength, now.strength);
    for (std::size_t i = 0; i < now.active.size(); ++i) {
      EXPECT_EQ(later.active[i].surface_mm, now.active[i].surface_mm) << i;
      EXPECT_EQ(later.active[i].edge, now.active[i].edge) << i;
    }
  }
}

TEST(CutRecorder, KeepsACornerAndDropsWhatIsStraight) {
  CutRecorder recorder;
  recorder.begin({}, 5.0);
  for (int i = 1; i <= 4; ++i) recorder.add({{0.05 * i, 0, 0}, Eigen::Quaterniond::Identity()});
  for (int i = 1; i <= 4; ++i) recorder.add({{0.2, 0.05 * i, 0}, Eigen::Quaterniond::Identity()});
  EXPECT_TRUE(recorder.due());
  CutPiece piece;
  ASSERT_TRUE(recorder.close(piece));
  ASSERT_EQ(piece.knots, 3);
  EXPECT_EQ(piece.path[1], quantise({{0.2, 0, 0}, Eigen::Quaterniond::Identity()}));
  EXPECT_EQ(piece.path[2], quantise({{0.2, 0.2, 0}, Eigen::Quaterniond::Identity()}));
  // Standing still closes nothing.
  recorder.add({{0.2, 0.2, 0}, Eigen::Quaterniond::Identity()});
  EXPECT_FALSE(recorder.close(piece));
}

}  // namespace
}  // namespace osteon::haptic::test
