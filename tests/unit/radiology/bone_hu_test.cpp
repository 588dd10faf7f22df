// HU of the bone as it is: the field's own samples before any cut, air where bone was cut away, and nothing else.
#include "common/radiology/bone_hu.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/support/scenes/random_cuts.hpp"
#include "tests/unit/radiology/reference_hu.hpp"

namespace osteon::radiology {
namespace {

std::vector<const CutField*> only(const CutField& field) { return {&field}; }

CoordBox around(const BoneHu& bone) { return bone.box().grown(2); }

template <class Call>
void each_sample(const CoordBox& box, Call call) {
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) call(Coord{x, y, z});
}

std::vector<float> all_hu(const BoneHu& bone) {
  std::vector<float> values;
  each_sample(around(bone), [&](Coord c) { values.push_back(bone.hu(c)); });
  return values;
}

float value_at(const std::function<void(const CoordBox&, std::span<float>)>& gather, Coord c) {
  float value = 0.0f;
  gather({c, c}, {&value, 1});
  return value;
}
float surface_at(const Case& bone, Coord c) {
  return value_at([&](const CoordBox& box, std::span<float> out) { bone.gather_surface(box, out); }, c);
}

ChangedLeaves changes_of(const CutReport& report) { return {report.level, report.changed_leaves}; }

// A round hole into the middle of a block's top.
Cut hole(double depth_mm = 6.0) {
  return test::straight_cut(*find_tool("burr-round-5"), {0, 0, 2}, {0, 0, -depth_mm}, {0, 0, -1});
}

// A block with soft tissue of 40 HU about it, on voxels that are not those of the bone.
struct ScannedBlock {
  Case bone = test::plain_block(16.0, 12.0, 0.5);
  CaseScan scan;
  ScannedBlock() {
    scan.geometry = {{40, 40, 30}, Vec3(-12.1, -12.2, -15.3), Vec3(0.62, 0.62, 0.7).asDiagonal()};
    for (int k = 0; k < 30; ++k)
      for (int j = 0; j < 40; ++j)
        for (int i = 0; i < 40; ++i)
          scan.hu.push_back(bone.surface_mm(scan.geometry.position_mm(Vec3(i, j, k))) < 0.0 ? 1600 : 40);
  }
};

TEST(BoneHu, IsTheDensityOfEachSample) {
  const Case bone = test::make_bone(
      {Vec3(-6, -6, -6), Vec3(6, 6, 6)}, 0.5, [](const Vec3& p) { return p.norm() - 6.0; },
      [](const Vec3& p) { return 1.0 + 0.05 * p.x(); });
  const auto hu = BoneHu::make(bone);
  ASSERT_TRUE(hu.has_value());
  std::size_t deep = 0;
  each_sample(around(*hu), [&](Coord c) {
    const float s = surface_at(bone, c);
    if (s >= 0.25f) {
      EXPECT_EQ(hu->hu(c), -1000.0f);
    } else if (s <= -0.25f) {
      const double expected = (1.0 + 0.05 * 0.5 * c.x - 0.131) / 0.001067;
      EXPECT_NEAR(static_cast<double>(hu->hu(c)), expected, 0.33);  // half a step
      ++deep;
    } else {
      EXPECT_GE(hu->hu(c), -1000.0f);
    }
  });
  EXPECT_GT(deep, 5000U);
}

// A plate of metal in a block: nine samples, so 4.5 mm.
Tissue plate_of_metal(const Vec3& p) { return p.z() < -3.75 && p.z() > -8.25 ? Tissue::metal : Tissue::none; }

TEST(BoneHu, MetalOfTheCaseIsNotBone) {
  const Case bone = test::marked_block(16.0, 12.0, 0.5, plate_of_metal);
  auto hu = BoneHu::make(bone);
  ASSERT_TRUE(hu.has_value());
  EXPECT_NEAR(hu->attenuation_per_mm({0, 0, -12}), 1.958 * 0.787, 1e-3);  // iron: cm²/g times g/cm³, in 1/mm
  double length = 0.0;
  for (std::int32_t z = -30; z <= 6; ++z) length += 0.5 * hu->attenuation_per_mm({3, -4, z});
  const double of_bone = attenuation_per_mm((1.9 - 0.131) / 0.001067);
  EXPECT_NEAR(length, 4.5 * 1.958 * 0.787 + 7.5 * of_bone, 0.01);
  // Up to its skin: half a voxel of metal at the face of the block, as deep in it.
  EXPECT_NEAR(hu->attenuation_per_mm({16, 0, -12}), 0.5 * 1.958 * 0.787, 1e-3);
  // What is cut away is gone, metal or not.
  CutField field(bone, {});
  field.apply(hole(10.0));
  EXPECT_TRUE(hu->renew(only(field)).has_value());
  EXPECT_EQ(hu->attenuation_per_mm({0, 0, -12}), 0.0);
}

TEST(BoneHu, MetalOfTheCaseIsMetalInAScanToo) {
  const Case bone = test::marked_block(16.0, 12.0, 0.5, plate_of_metal);
  CaseScan scan;
  scan.geometry = {{40, 40, 30}, Vec3(-12.1, -12.2, -15.3), Vec3(0.62, 0.62, 0.7).asDiagonal()};
  scan.hu.assign(scan.geometry.count(), 3071);  // where a scanner of 12 bits ends
  const auto hu = BoneHu::make(bone, &scan);
  ASSERT_TRUE(hu.has_value());
  EXPECT_NEAR(hu->attenuation_per_mm({0, 0, -12}), kSteel_per_mm, 1e-3);
  EXPECT_NEAR(hu->attenuation_per_mm({0, 0, -4}), attenuation_per_mm(3071.0), 1e-4);
}

// Slices of 4 mm, from -12 to 8 mm with their halves beyond the outer centres.
TEST(BoneHu, AThickSliceCountsToItsFaces) {
  CaseScan scan;
  scan.geometry = {{21, 21, 5}, Vec3(-5.0, -5.0, -10.0), Vec3(0.5, 0.5, 4.0).asDiagonal()};
  scan.hu.assign(scan.geometry.count(), 500);
  const auto hu = BoneHu::make(test::plain_block(4.0, 4.0, 0.5), &scan);
  ASSERT_TRUE(hu.has_value());
  for (const std::int32_t z : {-24, -23, 0, 15, 16})
    EXPECT_NEAR(static_cast<double>(hu->hu({0, 0, z})), 500.0, 0.4) << 0.5 * z << " mm";
  EXPECT_EQ(hu->hu({0, 0, -25}), -1000.0f);
  EXPECT_EQ(hu->hu({0, 0, 17}), -1000.0f);
}

// The highest HU that a file of 16 bits can have.
TEST(BoneHu, NoHuOfAScanIsTooHigh) {
  CaseScan scan;
  scan.geometry = {{20, 20, 20}, Vec3(-5.0, -5.0, -9.0), Vec3(0.5, 0.5, 0.5).asDiagonal()};
  scan.hu.assign(scan.geometry.count(), 32767);
  const auto hu = BoneHu::make(test::plain_block(4.0, 4.0, 0.5), &scan);
  ASSERT_TRUE(hu.has_value());
  EXPECT_NEAR(static_cast<double>(hu->hu({0, 0, -4})), 32767.0, 1.0);
}

// The line of a case without its own is that of the import, and is off by no more than its comment says.
TEST(BoneHu, TheDefaultLineIsNearTheCoefficientsOfCorticalBone) {
  EXPECT_EQ(kDefaultLine, kRho1995);
  const auto bone = BoneHu::make(test::plain_block(8.0, 6.0, 0.5, 1.92));
  ASSERT_TRUE(bone.has_value());
  EXPECT_NEAR(static_cast<double>(bone->hu({0, 0, -6})), 1677.0, 1.0);
  EXPECT_NEAR(bone->attenuation_per_mm({0, 0, -6}) / kCorticalBone_per_mm, 1.038, 0.002);
}

// The attenuation of a whole ball converges to that of its volume, because its skin is partly bone.
TEST(BoneHu, HoldsTheMassOfABall) {
  const auto mass = [](double pitch) {
    const Case bone = test::make_bone(
        {Vec3(-6, -6, -6), Vec3(6, 6, 6)}, pitch, [](const Vec3& p) { return p.norm() - 6.0; },
        [](const Vec3&) { return 1.2; });
    const auto hu = BoneHu::make(bone);
    double sum = 0.0;
    each_sample(hu->box(), [&](Coord c) { sum += hu->attenuation_per_mm(c); });
    return sum * pitch * pitch * pitch;
  };
  const double exact = attenuation_per_mm((1.2 - 0.131) / 0.001067) * 4.0 / 3.0 * std::numbers::pi * 216.0;
  EXPECT_NEAR(mass(0.5), exact, 0.004 * exact);
  EXPECT_NEAR(mass(0.25), exact, 0.001 * exact);
}

TEST(BoneHu, IsTheScanWhereTheCaseHasOne) {
  // Linear in space, so that trilinear samples are exact.
  const auto linear = [](const Vec3& p) { return std::round(300.0 + 20.0 * p.x() - 10.0 * p.y() + 5.0 * p.z()); };
  const Case bone = test::plain_block(8.0, 6.0, 0.5);
  CaseScan scan;
  Eigen::Matrix3d axes = Vec3(0.5, 0.5, 1.0).asDiagonal();
  axes = Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitZ()).toRotationMatrix() * axes;
  scan.geometry = {{30, 28, 12}, Vec3(7.0, -7.5, -8.0), axes};
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 28; ++j)
      for (int i = 0; i < 30; ++i)
        scan.hu.push_back(static_cast<std::int16_t>(linear(scan.geometry.position_mm(Vec3(i, j, k)))));
  const auto hu = BoneHu::make(bone, &scan);
  ASSERT_TRUE(hu.has_value());
  for (const Coord c : {Coord{0, 0, 0}, Coord{3, -5, -7}, Coord{-10, 4, 2}})
    EXPECT_NEAR(static_cast<double>(hu->hu(c)), linear(position_mm(c, 0.5)), 1.2);  // both are rounded
  // Beyond the scan.
  EXPECT_EQ(hu->hu({0, 0, 20}), -1000.0f);
}

TEST(BoneHu, CutsReadAirOnlyWhereBoneWas) {
  ScannedBlock scene;
  auto hu = BoneHu::make(scene.bone, &scene.scan);
  ASSERT_TRUE(hu.has_value());
  const std::vector<float> before = all_hu(*hu);
  CutField field(scene.bone, {});
  field.apply(hole());
  EXPECT_TRUE(hu->renew(only(field)).has_value());
  std::size_t i = 0, removed = 0, spared = 0;
  each_sample(around(*hu), [&](Coord c) {
    const float was = before[i++], now = hu->hu(c), s = surface_at(scene.bone, c);
    const bool swept = (position_mm(c, 0.5) - Vec3(0, 0, -3.5)).norm() < 1.8;
    if (s > 0.5f) {
      EXPECT_EQ(now, was) << "beside the bone";
      spared += std::hypot(0.5 * c.x, 0.5 * c.y) < 2.0 && c.z > 1 && c.z < 4 ? 1 : 0;
    } else if (s < -0.5f && swept) {
      EXPECT_EQ(now, -1000.0f);
      ++removed;
    }
    EXPECT_LE(now, was);
  });
  EXPECT_GT(removed, 100U);
  EXPECT_GT(spared, 50U);  // soft tissue that the bur swept
}

// What the samples lost is what the field lost.
TEST(BoneHu, LosesTheVolumeThatWasRemoved) {
  const Case bone = test::plain_block(16.0, 12.0, 0.5);
  auto hu = BoneHu::make(bone);
  ASSERT_TRUE(hu.has_value());
  const auto whole = [&] {
    double sum = 0.0;
    each_sample(hu->box(), [&](Coord c) { sum += hu->attenuation_per_mm(c); });
    return sum * 0.125;
  };
  const double before = whole();
  CutField field(bone, {});
  const CutReport report = field.apply(hole());
  hu->update(only(field), std::vector{changes_of(report)});
  const double removed_mm3 = (before - whole()) / attenuation_per_mm((1.9 - 0.131) / 0.001067);
  EXPECT_GT(removed_mm3, 50.0);
  EXPECT_NEAR(removed_mm3, field.removed_mm3(), 0.01 * field.removed_mm3());
}

// Of every sample: those that a cut changed against the definition, all others as before. Half a step of rounding, and
// what 32 bits lose in a fraction of a thin part.
void expect_reference(const Case& bone, const Cut& cut, std::size_t least_partly_cut) {
  auto hu = BoneHu::make(bone);
  ASSERT_TRUE(hu.has_value());
  std::vector<double> before;
  each_sample(hu->box(), [&](Coord c) { before.push_back(hu->attenuation_per_mm(c)); });
  CutField field(bone, {});
  hu->update(only(field), std::vector{changes_of(field.apply(cut))});
  std::size_t i = 0, partly = 0;
  each_sample(hu->box(), [&](Coord c) {
    const double was = before[i++], now = hu->attenuation_per_mm(c);
    if (now == was) return;
    EXPECT_NEAR(now, reference_per_mm(field, c), 5e-5) << c.x << ' ' << c.y << ' ' << c.z;
    partly += now > 0.1 * was && now < 0.9 * was ? 1 : 0;
  });
  EXPECT_GT(partly, least_partly_cut);
  // Nothing that should have changed was left as it was.
  for (std::int32_t x = -8; x <= 8; ++x)
    for (std::int32_t z = -8; z <= 2; ++z) {
      const Coord c{x, 0, z};
      ASSERT_NEAR(hu->attenuation_per_mm(c), reference_per_mm(field, c), 5e-5);
    }
}

TEST(BoneHu, APartlyCutSampleKeepsItsPartOfF) { expect_reference(test::plain_block(16.0, 12.0, 0.5), hole(), 100); }

// A case so fine that its own samples are the finest.
TEST(BoneHu, CutsOfLevelZeroAreSeen) {
  const Case bone = test::plain_block(3.0, 2.0, 0.15);
  ASSERT_EQ(finest_level(bone.pitch_mm()), 0);
  Cut cut = test::straight_cut(*find_tool("burr-round-5"), {0, 0, 1}, {0.05, 0, -0.5}, {0, 0, -1});
  cut.level = 0;
  expect_reference(bone, cut, 50);
}

TEST(BoneHu, AnUpdateEqualsARenewalInAScan) {
  ScannedBlock scene;
  auto updated = BoneHu::make(scene.bone, &scene.scan), renewed = BoneHu::make(scene.bone, &scene.scan);
  ASSERT_TRUE(updated.has_value() && renewed.has_value());
  const std::vector<float> uncut = all_hu(*updated);
  CutField field(scene.bone, {});
  for (int step = 0; step < 6; ++step) {
    const Cut cut = test::straight_cut(*find_tool("burr-round-5"), {-3.0 + step, 0.3 * step, -1.0},
                                       {-2.0 + step, 0.3 * step, -1.5}, {0, 0, -1});
    updated->update(only(field), std::vector{changes_of(field.apply(cut))});
    EXPECT_TRUE(renewed->renew(only(field)).has_value());
    ASSERT_EQ(all_hu(*updated), all_hu(*renewed));
  }
  EXPECT_NE(all_hu(*updated), uncut);
  std::vector<ChangedLeaves> undone;
  for (const FieldLeaf& leaf : field.leaf_places()) {
    field.reset(leaf.level, leaf.origin);
    undone.push_back({leaf.level, {leaf.origin}});
  }
  updated->update(only(field), undone);
  EXPECT_EQ(all_hu(*updated), uncut);
}

TEST(BoneHu, AnUpdateEqualsARenewal) {
  const Case bone = test::ball_of_bone();
  auto updated = BoneHu::make(bone), renewed = BoneHu::make(bone);
  ASSERT_TRUE(updated.has_value() && renewed.has_value());
  CutField field(bone, {});
  test::Random random(7);
  std::size_t changed_cuts = 0;
  for (const Cut& cut : test::grazing_cuts(60, random)) {
    const std::vector<float> before = all_hu(*updated);
    const CutReport report = field.apply(cut);
    const std::vector<CoordBox> boxes = updated->update(only(field), std::vector{changes_of(report)});
    changed_cuts += boxes.empty() ? 0 : 1;
    // Every sample that changed is in one of the boxes.
    std::size_t i = 0;
    each_sample(around(*updated), [&](Coord c) {
      if (updated->hu(c) == before[i++]) return;
      EXPECT_TRUE(std::ranges::any_of(boxes, [&](const CoordBox& box) { return box.contains(c); }));
    });
  }
  EXPECT_GT(changed_cuts, 20U);
  EXPECT_TRUE(renewed->renew(only(field)).has_value());
  EXPECT_EQ(all_hu(*updated), all_hu(*renewed));
  // Everything comes back when all cuts are undone.
  std::vector<ChangedLeaves> undone;
  for (const FieldLeaf& leaf : field.leaf_places()) {
    field.reset(leaf.level, leaf.origin);
    undone.push_back({leaf.level, {leaf.origin}});
  }
  updated->update(only(field), undone);
  EXPECT_EQ(all_hu(*updated), all_hu(*BoneHu::make(bone)));
}

// A brick is marked exactly when one of its 9³ samples is not air.
TEST(BoneHu, KnowsWhichBricksAreEmpty) {
  const Case bone = test::ball_of_bone();
  auto hu = BoneHu::make(bone);
  ASSERT_TRUE(hu.has_value());
  CutField field(bone, {});
  const Cut deep = test::straight_cut(*find_tool("burr-round-5"), {0, 0, 12}, {0, 0, -12}, {0, 0, -1});
  hu->update(only(field), std::vector{changes_of(field.apply(deep))});
  const HuLattice lattice = hu->lattice();
  std::size_t i = 0, empty = 0;
  for (std::int32_t x = 0; x < lattice.bricks.x; ++x)
    for (std::int32_t y = 0; y < lattice.bricks.y; ++y)
      for (std::int32_t z = 0; z < lattice.bricks.z; ++z, ++i) {
        const Coord first = hu->box().min + 8 * Coord{x, y, z} - Coord{1, 1, 1};
        bool any = false;
        each_sample({first, first + Coord{8, 8, 8}}, [&](Coord c) { any |= hu->hu(c) > -1000.0f; });
        EXPECT_EQ(lattice.occupied[i] != 0, any);
        empty += any ? 0 : 1;
      }
  EXPECT_GT(empty, 0U);
}

// Progress rises to the whole, and a call that says no ends the work with `cancelled`.
TEST(BoneHu, TellsItsProgressAndStopsWhenAsked) {
  ScannedBlock scene;
  CutField field(scene.bone, {});
  field.apply(hole());
  for (const CaseScan* scan : {static_cast<const CaseScan*>(nullptr), static_cast<const CaseScan*>(&scene.scan)}) {
    std::vector<double> told;
    const KeepGoing note = [&](double fraction) {
      told.push_back(fraction);
      return true;
    };
    const auto expect_told = [&] {
      ASSERT_FALSE(told.empty());
      EXPECT_TRUE(std::ranges::is_sorted(told));
      EXPECT_DOUBLE_EQ(told.back(), 1.0);
      told.clear();
    };
    auto bone = BoneHu::make(scene.bone, scan, note);
    ASSERT_TRUE(bone.has_value());
    expect_told();
    const auto stop = [](double) { return false; };
    const auto stopped = BoneHu::make(scene.bone, scan, stop);
    ASSERT_FALSE(stopped.has_value());
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
    const Result<void> half = bone->renew(only(field), stop);
    ASSERT_FALSE(half.has_value());
    EXPECT_EQ(half.error().code, ErrorCode::cancelled);
    ASSERT_TRUE(bone->renew(only(field), note).has_value());
    expect_told();
    auto at_once = BoneHu::make(scene.bone, scan);
    ASSERT_TRUE(at_once.has_value() && at_once->renew(only(field)).has_value());
    EXPECT_EQ(all_hu(*bone), all_hu(*at_once));
  }
}

TEST(BoneHu, RefusesAScanWithoutHu) {
  CaseScan scan;
  scan.geometry.dims = {4, 4, 4};
  const auto made = BoneHu::make(test::plain_block(8.0, 6.0, 0.5), &scan);
  ASSERT_FALSE(made.has_value());
  EXPECT_EQ(made.error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace osteon::radiology
