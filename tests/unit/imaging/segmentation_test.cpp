// What cortex encloses is bone, and what it does not enclose is not. Each shape is drawn with the expected answer.
#include "common/imaging/segmentation.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

constexpr std::int16_t kCortex = 1500, kFat = -90, kMuscle = 55, kAir = -1000;

// Voxels of `spacing` around the origin. `at` gives the HU for a voxel's centre in mm.
HuVolume draw(std::array<int, 3> dims, const Vec3& spacing_mm, const std::function<std::int16_t(const Vec3&)>& at) {
  HuVolume volume;
  volume.dims = dims;
  volume.spacing_mm = spacing_mm;
  volume.origin_mm = -0.5 * spacing_mm.cwiseProduct(Vec3(dims[0] - 1, dims[1] - 1, dims[2] - 1));
  volume.values.resize(volume.count());
  for (int k = 0; k < dims[2]; ++k)
    for (int j = 0; j < dims[1]; ++j)
      for (int i = 0; i < dims[0]; ++i) volume.values[volume.index(i, j, k)] = at(volume.position_mm(Vec3(i, j, k)));
  return volume;
}

BoneVoxel kind_at(const HuVolume& volume, const VoxelMask& bone, const Vec3& position_mm) {
  const Vec3 v = volume.voxel(position_mm);
  return static_cast<BoneVoxel>(bone.at(static_cast<int>(std::lround(v.x())), static_cast<int>(std::lround(v.y())),
                                        static_cast<int>(std::lround(v.z()))));
}

VoxelMask segment(const HuVolume& volume, const SegmentationParams& params = {}, const ScanEnds& ends = kAllScanEnds) {
  auto bone = segment_bone(volume, params, ends, always);
  EXPECT_TRUE(bone) << bone.error().message;
  return std::move(*bone);
}

double radial(const Vec3& p) { return std::hypot(p.x(), p.y()); }

// A shaft along z through the whole scan: cortex from 8 to 12 mm, marrow of fat inside, muscle around.
std::int16_t shaft(const Vec3& p) { return radial(p) > 12.0 ? kMuscle : radial(p) > 8.0 ? kCortex : kFat; }

TEST(Segmentation, MarrowOfAShaftThatTheScanCutsIsBone) {
  const HuVolume volume = draw({48, 48, 20}, Vec3(0.8, 0.8, 3.0), shaft);
  const VoxelMask bone = segment(volume);
  for (double z = -28.0; z <= 28.0; z += 3.0) {
    EXPECT_EQ(kind_at(volume, bone, {0, 0, z}), BoneVoxel::marrow) << z;
    EXPECT_EQ(kind_at(volume, bone, {7.0, 0, z}), BoneVoxel::marrow) << z;
    EXPECT_EQ(kind_at(volume, bone, {10.0, 0, z}), BoneVoxel::dense) << z;
    EXPECT_EQ(kind_at(volume, bone, {15.0, 0, z}), BoneVoxel::none) << z;
  }
}

TEST(Segmentation, HollowLeavesTheMarrowOut) {
  const HuVolume volume = draw({48, 48, 10}, Vec3(0.8, 0.8, 3.0), shaft);
  const VoxelMask bone = segment(volume, {.hollow = true});
  EXPECT_EQ(kind_at(volume, bone, {0, 0, 0}), BoneVoxel::none);
  EXPECT_EQ(kind_at(volume, bone, {10.0, 0, 0}), BoneVoxel::dense);
}

TEST(Segmentation, WhereTheVolumeWasCutOutOfTheScanTheShaftIsOpen) {
  const HuVolume volume = draw({48, 48, 10}, Vec3(0.8, 0.8, 3.0), shaft);
  ScanEnds ends = kAllScanEnds;
  ends[2] = {false, true};
  EXPECT_EQ(kind_at(volume, segment(volume, {}, ends), {0, 0, 0}), BoneVoxel::none);
}

TEST(Segmentation, AShaftCutByTheSideOfTheScanIsClosedThere) {
  // The field of view ends at x = 4 mm, within the marrow. The tube is open on that side except for the scan's end.
  const HuVolume volume =
      draw({48, 48, 12}, Vec3(0.8, 0.8, 3.0), [](const Vec3& p) { return shaft(p + Vec3(15.0, 0, 0)); });
  const VoxelMask bone = segment(volume);
  EXPECT_EQ(kind_at(volume, bone, {-13.0, 0, 0}), BoneVoxel::marrow);
}

TEST(Segmentation, AVesselsHoleDoesNotOpenTheMarrow) {
  // A canal of 2 mm through the cortex, 1 mm voxels.
  const HuVolume volume = draw({40, 40, 40}, Vec3::Ones(), [](const Vec3& p) {
    const bool canal = p.x() > 0 && std::hypot(p.y(), p.z()) < 1.0;
    return p.norm() > 14.0 ? kMuscle : p.norm() > 10.0 && !canal ? kCortex : kFat;
  });
  const VoxelMask bone = segment(volume);
  EXPECT_EQ(kind_at(volume, bone, {0, 0, 0}), BoneVoxel::marrow);
  EXPECT_EQ(kind_at(volume, bone, {16.0, 0.5, 0.5}), BoneVoxel::none);
}

TEST(Segmentation, AWideOpeningDoes) {
  const HuVolume volume = draw({40, 40, 40}, Vec3::Ones(), [](const Vec3& p) {
    const bool opening = p.x() > 0 && std::hypot(p.y(), p.z()) < 5.0;
    return p.norm() > 14.0 ? kMuscle : p.norm() > 10.0 && !opening ? kCortex : kMuscle;
  });
  EXPECT_EQ(kind_at(volume, segment(volume), {0, 0, 0}), BoneVoxel::none);
}

TEST(Segmentation, AJointBetweenTwoBonesStaysOpen) {
  // A ball in a socket with 2 mm of cartilage between them, open at the rim.
  const HuVolume volume = draw({56, 56, 48}, Vec3::Constant(0.7), [](const Vec3& p) {
    const double r = p.norm();
    if (r < 10.0) return r > 8.0 ? kCortex : kFat;
    if (r < 12.0) return std::int16_t{110};
    return r < 15.0 && p.z() > 0.0 ? kCortex : kMuscle;
  });
  const VoxelMask bone = segment(volume);
  EXPECT_EQ(kind_at(volume, bone, {0, 0, 0}), BoneVoxel::marrow);
  for (double angle = -1.2; angle <= 1.2; angle += 0.2)
    EXPECT_EQ(kind_at(volume, bone, 11.0 * Vec3(std::sin(angle), 0, std::cos(angle))), BoneVoxel::none) << angle;
}

TEST(Segmentation, ASinusIsNoBone) {
  // Air within thin walls, with a lining of soft tissue on one side.
  const HuVolume volume = draw({50, 50, 50}, Vec3::Ones(), [](const Vec3& p) {
    const double r = p.norm();
    return r > 16.0 ? kMuscle : r > 14.0 ? kCortex : r > 12.5 && p.x() < 0 ? kMuscle : kAir;
  });
  const VoxelMask bone = segment(volume);
  EXPECT_EQ(kind_at(volume, bone, {0, 0, 0}), BoneVoxel::none);
  EXPECT_EQ(kind_at(volume, bone, {12.0, 0, 0}), BoneVoxel::none);
}

TEST(Segmentation, ABrainIsNoMarrowAlsoInAClosedSkull) {
  const HuVolume volume = draw({50, 50, 50}, Vec3::Constant(3.0), [](const Vec3& p) {
    return p.norm() > 64.0 ? kMuscle : p.norm() > 58.0 ? kCortex : std::int16_t{35};
  });
  EXPECT_EQ(kind_at(volume, segment(volume), {0, 0, 0}), BoneVoxel::none);
}

TEST(Segmentation, ABrainThatTheScanCutsIsNoMarrow) {
  // 57 mm of the vault alone. A sphere in it has 28 mm, but the scan does not show that it ends there.
  const HuVolume volume = draw({50, 50, 20}, Vec3::Constant(3.0), [](const Vec3& p) {
    const double r = (p + Vec3(0, 0, 30.0)).norm();
    return r > 64.0 ? kMuscle : r > 58.0 ? kCortex : std::int16_t{35};
  });
  EXPECT_EQ(kind_at(volume, segment(volume), {0, 0, -10.0}), BoneVoxel::none);
}

TEST(Segmentation, NoiseDoesNotMakeHolesInMarrow) {
  // A sharp kernel: 150 HU of noise everywhere.
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 150.0);
  const HuVolume volume = draw({48, 48, 16}, Vec3(0.8, 0.8, 2.0),
                               [&](const Vec3& p) { return static_cast<std::int16_t>(shaft(p) + noise(random)); });
  const VoxelMask bone = segment(volume);
  std::int64_t holes = 0, within = 0;
  for (int k = 0; k < 16; ++k)
    for (int j = 0; j < 48; ++j)
      for (int i = 0; i < 48; ++i)
        if (radial(volume.position_mm(Vec3(i, j, k))) < 11.0) {
          ++within;
          holes += bone.at(i, j, k) == 0 ? 1 : 0;
        }
  EXPECT_LT(static_cast<double>(holes), 0.001 * static_cast<double>(within));
}

// Two plates of cortex with cancellous bone between them that ends in air on all other sides.
std::int16_t slab(const Vec3& p, std::int16_t between) {
  if (std::abs(p.x()) > 10.0 || std::abs(p.y()) > 10.0 || std::abs(p.z()) > 15.0) return kAir;
  return std::abs(p.z()) > 10.0 ? kCortex : between;
}

TEST(Segmentation, CancellousBoneBetweenCortexIsBoneAlsoWhereItIsOpenAtTheSides) {
  const HuVolume volume = draw({52, 52, 72}, Vec3::Constant(0.5), [](const Vec3& p) { return slab(p, 158); });
  const VoxelMask bone = segment(volume);
  for (int k = 0; k < 72; ++k)
    for (int j = 0; j < 52; ++j)
      for (int i = 0; i < 52; ++i) {
        const Vec3 p = volume.position_mm(Vec3(i, j, k));
        ASSERT_EQ(bone.at(i, j, k) != 0, slab(p, 158) != kAir) << p.transpose();
      }
}

TEST(Segmentation, WithNoiseToo) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 30.0);
  const HuVolume volume = draw({52, 52, 72}, Vec3::Constant(0.5),
                               [&](const Vec3& p) { return static_cast<std::int16_t>(slab(p, 158) + noise(random)); });
  const VoxelMask bone = segment(volume);
  std::int64_t wrong = 0, all = 0;
  for (int k = 0; k < 72; ++k)
    for (int j = 0; j < 52; ++j)
      for (int i = 0; i < 52; ++i) {
        const bool inside = slab(volume.position_mm(Vec3(i, j, k)), 158) != kAir;
        all += inside ? 1 : 0;
        wrong += inside != (bone.at(i, j, k) != 0) ? 1 : 0;
      }
  EXPECT_LT(static_cast<double>(wrong), 0.01 * static_cast<double>(all));
}

// 7 of every 27 voxels are as bright as cancellous bone, everywhere. That is fewer than half, and fewer than at a
// corner of bone.
TEST(Segmentation, AFewBrightVoxelsBetweenTwoBonesAreNoBone) {
  const HuVolume volume = draw({52, 52, 72}, Vec3::Constant(0.5), [](const Vec3& p) {
    if (std::max(std::abs(p.x()), std::abs(p.y())) > 10.0) return kAir;
    const auto third = [](double mm) { return (std::lround(2.0 * mm + 100.5) % 3 + 3) % 3; };
    const bool bright = third(p.x()) + 3 * third(p.y()) + 9 * third(p.z()) < 7;
    return slab(p, bright ? 158 : kMuscle);
  });
  EXPECT_EQ(kind_at(volume, segment(volume), {0, 0, 0}), BoneVoxel::none);
}

TEST(Segmentation, MuscleBetweenTwoBonesIsNoBone) {
  const HuVolume volume = draw({52, 52, 72}, Vec3::Constant(0.5), [](const Vec3& p) { return slab(p, kMuscle); });
  EXPECT_EQ(kind_at(volume, segment(volume), {0.25, 0.25, 0.25}), BoneVoxel::none);
}

TEST(Segmentation, AContrastFilledVesselBesideABoneIsNoBone) {
  // A vessel of 20 mm with 180 HU along a plate of cortex: bone on one side only.
  const HuVolume volume = draw({50, 50, 30}, Vec3::Ones(), [](const Vec3& p) {
    if (p.x() > 8.0 && p.x() < 14.0) return kCortex;
    return std::hypot(p.x() + 2.0, p.y()) < 10.0 ? std::int16_t{180} : kMuscle;
  });
  EXPECT_EQ(kind_at(volume, segment(volume), {-2.0, 0, 0}), BoneVoxel::none);
}

TEST(Segmentation, ChalkInAVesselsWallDoesNotMakeItBone) {
  // An aorta of 160 HU with two plaques opposite each other.
  const HuVolume volume = draw({50, 50, 40}, Vec3::Ones(), [](const Vec3& p) {
    const double r = radial(p);
    if (r > 9.0 && r < 11.0 && std::abs(p.y()) < 3.0 && std::abs(p.z()) < 4.0) return std::int16_t{600};
    return r < 10.0 ? std::int16_t{160} : kMuscle;
  });
  EXPECT_EQ(kind_at(volume, segment(volume), {0, 0, 0}), BoneVoxel::none);
}

TEST(Segmentation, NothingAboveTheThresholdNamesTheRemedy) {
  const HuVolume volume = draw({8, 8, 8}, Vec3::Ones(), [](const Vec3&) { return kMuscle; });
  const auto bone = segment_bone(volume, {}, kAllScanEnds, always);
  ASSERT_FALSE(bone);
  EXPECT_EQ(bone.error().code, ErrorCode::invalid_input);
  EXPECT_NE(bone.error().message.find("--threshold"), std::string::npos);
}

TEST(Segmentation, StopsAtEachQuestion) {
  const HuVolume volume = draw({52, 52, 72}, Vec3::Constant(0.5), [](const Vec3& p) { return slab(p, 158); });
  int questions = 0;
  ASSERT_TRUE(segment_bone(volume, {}, kAllScanEnds, [&](double) { return ++questions > 0; }));
  for (int stop_at = 1; stop_at <= questions; stop_at += 7) {
    int asked = 0;
    const auto bone = segment_bone(volume, {}, kAllScanEnds, [&](double) { return ++asked < stop_at; });
    ASSERT_FALSE(bone) << stop_at;
    EXPECT_EQ(bone.error().code, ErrorCode::cancelled);
    EXPECT_EQ(asked, stop_at) << "work went on after it was stopped";
  }
}

}  // namespace
}  // namespace osteon::imaging
