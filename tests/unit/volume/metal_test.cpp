// Metal and enamel of a case: where they are, and which cuts would take metal away.
#include "common/volume/metal.hpp"

#include <gtest/gtest.h>

#include <array>
#include <numbers>

#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

constexpr double kMetalPitch_mm = 0.5;
const Vec3 kDown{0, 0, -1};

// A plate from 5 mm to 7 mm below the face, and a cap of enamel at one side of it.
Tissue plate(const Vec3& p) {
  if (p.z() <= -5.0 && p.z() >= -7.0) return Tissue::metal;
  return p.x() > 8.0 && p.z() > -2.0 ? Tissue::enamel : Tissue::none;
}
// A rod of one sample's width along y.
Tissue rod(const Vec3& p) {
  return std::abs(p.x()) < 0.1 && std::abs(p.z() + 5.0) < 0.1 ? Tissue::metal : Tissue::none;
}

Case plate_block() { return test::marked_block(24.0, 12.0, kMetalPitch_mm, plate); }

bool meets(const CutField& field, const Cut& cut) {
  const CutField* const one = &field;
  return meets_metal(cut, field.tools()->find(cut.tool)->body, std::span(&one, 1));
}

TEST(Metal, IsFoundInTheCase) {
  const Case bone = plate_block();
  EXPECT_EQ(bone.tissue({0, 0, -10}), Tissue::metal);
  EXPECT_EQ(bone.tissue({0, 0, -8}), Tissue::cortical);
  EXPECT_EQ(bone.tissue({20, 0, -2}), Tissue::enamel);
  EXPECT_EQ(bone.tissue({0, 0, 2}), Tissue::none);
  EXPECT_TRUE(bone.has_metal({{-3, 4, -12}, {-3, 4, -12}}));
  EXPECT_FALSE(bone.has_metal({{-3, 4, -8}, {-3, 4, -1}})) << "a leaf above the plate";
  EXPECT_FALSE(bone.has_metal({{20, 0, -2}, {21, 1, -1}}));
  EXPECT_TRUE(bone.has_hard({{20, 0, -2}, {21, 1, -1}}));
  EXPECT_LT(bone.metal_leaves().size(), bone.hard_leaves().size());

  const test::TempDir folder;
  ASSERT_TRUE(bone.save(folder / "case"));
  const auto loaded = Case::load(folder / "case");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->hash(), bone.hash());
  EXPECT_EQ(loaded->metal_leaves(), bone.metal_leaves());
  EXPECT_EQ(loaded->hard_leaves(), bone.hard_leaves());
  EXPECT_TRUE(test::plain_block(24.0, 12.0, kMetalPitch_mm).hard_leaves().empty());
}

// For each sample of a level, the tissue of the nearest level-0 sample that is bone.
TEST(Metal, IsKnownOnEveryLevel) {
  const Case bone = plate_block();
  for (int level = -2; level <= 2; ++level) {
    const double pitch_mm = level_pitch_mm(kMetalPitch_mm, level);
    const CoordBox box = covering_samples({{-3, -3, -9}, {11, 3, 1}}, pitch_mm);
    const Coord n = box.dims();
    std::vector<Tissue> found(static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) *
                              static_cast<std::size_t>(n.z));
    bone.gather_hard(level, box, found);
    std::size_t i = 0;
    for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
      for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
        for (std::int32_t z = box.min.z; z <= box.max.z; ++z, ++i) {
          // Half-way between two samples either may be the nearest.
          const Vec3 p = position_mm({x, y, z}, pitch_mm);
          const Tissue above = plate(p + Vec3::Constant(0.5 * kMetalPitch_mm)),
                       below = plate(p - Vec3::Constant(0.5 * kMetalPitch_mm));
          if (above == below && p.z() < 0.0 && p.head<2>().cwiseAbs().maxCoeff() < 11.5) {
            ASSERT_EQ(found[i], above) << level << ": " << p.transpose();
          }
          if (p.z() > kMetalPitch_mm) {
            ASSERT_EQ(found[i], Tissue::none) << level << ": " << p.transpose();
          }
        }
  }
}

// The tip may enter the plate by the distance of the case's samples, whatever the level of the cut.
TEST(Metal, IsMetDeeperThanAVoxel) {
  const CutField field(plate_block(), BodyId{});
  for (const char* name : {"burr-round-5", "drill-3.2"})
    for (int level = 0; level <= 2; ++level)
      for (const double deep_mm : {-1.0, 0.0, 0.4, 0.6, 2.0}) {
        const Tool tool = *find_tool(name);
        // A drill's point is a cone: at its axis it is as deep as the distance to its flanks.
        const double cone = tool.kind == ToolKind::drill ? std::sin(0.5 * 118.0 / 180.0 * std::numbers::pi) : 1.0;
        Cut cut = test::straight_cut(tool, {0, 0, 1}, {0, 0, -5.0 - deep_mm / cone}, kDown);
        cut.level = level;
        EXPECT_EQ(meets(field, cut), deep_mm > kMetalPitch_mm)
            << name << " level " << level << ", " << deep_mm << " mm";
      }
  EXPECT_FALSE(meets(CutField(test::plain_block(24.0, 12.0, kMetalPitch_mm), BodyId{}),
                     test::straight_cut(*find_tool("burr-round-5"), {0, 0, 1}, {0, 0, -7}, kDown)));
}

// Both ends of the path are clear of the rod, but the middle is not. The tool moves across it, or turns about its far
// end.
TEST(Metal, IsMetAnywhereOnTheWay) {
  const CutField field(test::marked_block(24.0, 12.0, kMetalPitch_mm, rod), BodyId{});
  const Tool burr = *find_tool("burr-round-5");
  EXPECT_FALSE(meets(field, test::straight_cut(burr, {-8, 0, -6}, {-8, 0, -6}, kDown)));
  EXPECT_FALSE(meets(field, test::straight_cut(burr, {8, 0, -6}, {8, 0, -6}, kDown)));
  EXPECT_TRUE(meets(field, test::straight_cut(burr, {-8, 0, -6}, {8, 0, -6}, kDown)));
  EXPECT_FALSE(meets(field, test::straight_cut(burr, {-8, 0, -3}, {8, 0, -3}, kDown))) << "over it";

  // Turned about its tip, which is below the rod.
  Cut turn = test::straight_cut(*find_tool("burr-barrel"), {0, 0, 0}, {0, 0, 0}, kDown);
  turn.path = {quantise(pose_along({0, 0, -11}, Vec3(0.9, 0, -std::sqrt(0.19)))),
               quantise(pose_along({0, 0, -11}, Vec3(-0.9, 0, -std::sqrt(0.19))))};
  Cut first = turn, last = turn;
  first.path.pop_back();
  last.path.erase(last.path.begin());
  EXPECT_FALSE(meets(field, first));
  EXPECT_FALSE(meets(field, last));
  EXPECT_TRUE(meets(field, turn));
}

// Cuts that each touch it by less than a voxel do not add up.
TEST(Metal, IsNotShavedAwayVoxelByVoxel) {
  CutField field(plate_block(), BodyId{});
  int taken = 0;
  for (double z = -4.0; z > -9.0; z -= 0.2) {
    const Cut cut = test::straight_cut(*find_tool("burr-round-5"), {0, 0, 0}, {0, 0, z}, kDown);
    if (meets(field, cut)) continue;
    field.apply(cut);
    ++taken;
  }
  EXPECT_EQ(taken, 8) << "down to 5.4 mm";
  EXPECT_LT(field.solid_mm({0, 0, -6}), 0.0);
}

// Metal that is gone cannot be taken away. What is left of it in another body can.
TEST(Metal, CountsWhereItIsStillThere) {
  const Case bone = plate_block();
  CutField gone(bone, BodyId{0});
  const CutField whole(bone, BodyId{1});
  const Cut cut = test::straight_cut(*find_tool("burr-round-5"), {0, 0, -4}, {0, 0, -8}, kDown);
  // As if a piece with the plate in it had been removed.
  for (double x = -14; x <= 14; x += 2)
    for (double y = -14; y <= 14; y += 2)
      gone.apply(test::straight_cut(*find_tool("burr-round-5"), {x, y, -4}, {x, y, -9}, kDown));
  EXPECT_FALSE(meets(gone, cut));
  EXPECT_TRUE(meets(whole, cut));
  const std::array<const CutField*, 2> both{&gone, &whole};
  EXPECT_TRUE(meets_metal(cut, whole.tools()->find(cut.tool)->body, both));
}

}  // namespace
}  // namespace osteon
