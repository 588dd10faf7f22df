// What the server reads of a case for viewers, from a case whose scan is turned and mirrored.
#include "server/storage/case_plan.hpp"

#include <gtest/gtest.h>

#include "common/volume/case_scan.hpp"
#include "tests/support/scenes/described_case.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

TEST(CasePlan, HasAxesPlanesRegionsAndTheSurfacesOfLabelsThatAreNoBone) {
  const CaseScan scan = test::turned_scan();
  const auto bone = test::described_ball(test::full_description(scan));
  ASSERT_TRUE(bone);
  const test::TempDir dir;
  ASSERT_TRUE(bone->save(dir / "case", scan));
  const auto plan = load_plan(dir / "case", *bone);
  ASSERT_TRUE(plan) << plan.error().message;
  ASSERT_EQ(plan->axes.size(), 1u);
  EXPECT_EQ(plan->axes[0].name, "neck");
  EXPECT_EQ(plan->axes[0].direction, Vec3(0.0, 0.6, 0.8));
  ASSERT_EQ(plan->planes.size(), 1u);
  EXPECT_EQ(plan->planes[0].normal, Vec3(0.0, 0.0, -1.0));
  ASSERT_EQ(plan->boxes.size(), 1u) << "the other region is a label";
  EXPECT_EQ(plan->boxes[0].name, "window");
  ASSERT_EQ(plan->structures.size(), 2u) << "bone is not at risk";
  EXPECT_EQ(plan->structures[0].name, "Nervus ischiadicus");
  EXPECT_EQ(plan->structures[0].kind, StructureKind::nerve);
  EXPECT_NEAR(plan->structures[0].voxel_mm, 2.0, 1e-9);
  EXPECT_EQ(plan->structures[1].name, "near the nerve");
  EXPECT_FALSE(plan->structures[1].at_risk());
  // Label 7 is the box of columns 9 to 18, rows 0 to 5 and slices 0 to 6. Each face is between two centres.
  for (const SurgicalPlan::Structure& structure : plan->structures) {
    EXPECT_EQ(open_edges(structure.surface), 0u);
    Box voxels;
    for (std::uint32_t i = 0; i < structure.surface.positions_mm.size(); ++i)
      voxels.include(scan.geometry.axes_mm.inverse() * (position(structure.surface, i) - scan.geometry.origin_mm));
    EXPECT_LT((voxels.min_mm - Vec3(8.5, -0.5, -0.5)).cwiseAbs().maxCoeff(), 0.31);
    EXPECT_LT((voxels.max_mm - Vec3(18.5, 5.5, 6.5)).cwiseAbs().maxCoeff(), 0.31);
    EXPECT_NEAR(enclosed_mm3(structure.surface) / (10 * 6 * 7 * 0.5 * 0.75 * 2.0), 1.0, 0.1);
  }
}

TEST(CasePlan, NeedsTheScanOnlyForLabels) {
  const CaseScan scan = test::turned_scan();
  CaseInfo info = test::full_description(scan);
  const test::TempDir dir;
  const auto labelled = test::described_ball(info);
  ASSERT_TRUE(labelled);
  EXPECT_EQ(load_plan(dir / "nowhere", *labelled).error().code, ErrorCode::not_found);
  info.labels.pop_back();
  info.regions.erase(info.regions.begin());
  const auto plain = test::described_ball(info);
  ASSERT_TRUE(plain);
  const auto plan = load_plan(dir / "nowhere", *plain);
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_EQ(plan->axes.size(), 1u);
  EXPECT_TRUE(plan->structures.empty());
}

}  // namespace
}  // namespace osteon
