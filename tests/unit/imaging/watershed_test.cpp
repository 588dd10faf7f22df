#include "common/imaging/watershed.hpp"

#include <gtest/gtest.h>

#include <bitset>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "common/imaging/bone_markers.hpp"
#include "common/imaging/calibration.hpp"
#include "common/imaging/components.hpp"
#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

constexpr int kBackground_hu = 50, kBone_hu = 1200;

// What a scanner shows of solids: each voxel has the mean of bone and muscle over its parts, as thick slices do.
HuVolume scan_of(const std::array<int, 3>& dims, const Vec3& spacing_mm, int bone_hu,
                 const std::function<bool(const Vec3& position_mm)>& is_bone) {
  constexpr int kAll = 3 * 3 * 6;
  HuVolume volume;
  volume.dims = dims;
  volume.spacing_mm = spacing_mm;
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x) {
        int bone = 0;
        for (int part = 0; part < kAll; ++part) {
          const Vec3 at(part % 3, part / 3 % 3, part / 9);
          const Vec3 within = (at + Vec3::Constant(0.5)).cwiseQuotient(Vec3(3, 3, 6)) - Vec3::Constant(0.5);
          bone += is_bone((Vec3(x, y, z) + within).cwiseProduct(spacing_mm)) ? 1 : 0;
        }
        volume.values.push_back(
            static_cast<std::int16_t>(std::lround(kBackground_hu + (bone_hu - kBackground_hu) * bone / double{kAll})));
      }
  return volume;
}

VoxelMask at_threshold(const HuVolume& volume) {
  VoxelMask mask(volume.dims);
  for (std::size_t i = 0; i < mask.values.size(); ++i) mask.values[i] = volume.values[i] >= kBoneThreshold_hu ? 1 : 0;
  return mask;
}

// Seeds get numbers in their order.
Result<VoxelMask> separated(const HuVolume& volume, const VoxelMask& mask, const std::vector<std::array<int, 3>>& seeds,
                            const KeepGoing& keep_going = always) {
  const auto depth = bone_depth(volume, mask, kBoneThreshold_hu, keep_going);
  if (!depth) return tl::unexpected(depth.error());
  std::vector<BoneSeed> numbered;
  for (const auto& seed : seeds) numbered.push_back({seed, static_cast<int>(numbered.size()) + 1});
  auto markers = markers_from_seeds(mask, *depth, numbered, keep_going);
  if (!markers) return markers;
  return watershed(mask, *depth, std::move(*markers), keep_going);
}

Result<VoxelMask> separated_by_cores(const HuVolume& volume, const VoxelMask& mask, std::size_t& cores) {
  const auto depth = bone_depth(volume, mask, kBoneThreshold_hu, always);
  const auto found = bone_cores(mask, *depth, always);
  if (!found) return tl::unexpected(found.error());
  cores = found->size();
  VoxelMask markers(mask.dims);
  std::uint8_t number = 0;
  for (const auto& [x, y, z] : *found) markers.at(x, y, z) = ++number;
  return watershed(mask, *depth, std::move(markers), always);
}

std::int64_t count_of(const VoxelMask& labels, int number) {
  return std::ranges::count(labels.values, static_cast<std::uint8_t>(number));
}

// Of the voxels with a number and those of the mask that `truth` has.
double dice(const VoxelMask& labels, int number, const VoxelMask& mask, const std::function<bool(const Vec3&)>& truth,
            const Vec3& spacing_mm) {
  std::int64_t both = 0, sum = 0;
  for (int z = 0; z < labels.dims[2]; ++z)
    for (int y = 0; y < labels.dims[1]; ++y)
      for (int x = 0; x < labels.dims[0]; ++x) {
        const bool found = labels.at(x, y, z) == number;
        const bool is = mask.at(x, y, z) != 0 && truth(Vec3(x, y, z).cwiseProduct(spacing_mm));
        both += found && is ? 1 : 0;
        sum += (found ? 1 : 0) + (is ? 1 : 0);
      }
  return 2.0 * static_cast<double>(both) / static_cast<double>(sum);
}

bool in_ball(const Vec3& at, const Vec3& centre, double radius) { return (at - centre).norm() <= radius; }

// The part of a ball on the near side of a plane at this distance from its centre.
double ball_without_cap(double radius, double distance) {
  const double height = radius - distance;
  return 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3) -
         std::numbers::pi * height * height * (radius - height / 3.0);
}

TEST(Watershed, TwoBallsPartInTheirPlaneOfContact) {
  const Vec3 a(13.5, 15.5, 15.5), b(32.5, 15.5, 15.5);
  constexpr double kRadius = 10.0;  // they overlap by 1 mm, in a circle at x = 23
  const HuVolume scan = scan_of({46, 32, 32}, Vec3::Ones(), kBone_hu,
                                [&](const Vec3& at) { return in_ball(at, a, kRadius) || in_ball(at, b, kRadius); });
  VoxelMask mask = at_threshold(scan);
  // Partly filled voxels of the surface count only half, so that the volume is that of the balls.
  for (std::size_t i = 0; i < mask.values.size(); ++i)
    mask.values[i] = scan.values[i] >= (kBone_hu + kBackground_hu) / 2 ? 1 : 0;
  std::size_t cores = 0;
  const auto by_seeds = separated(scan, mask, {{5, 15, 15}, {40, 16, 16}});
  const auto by_cores = separated_by_cores(scan, mask, cores);
  ASSERT_TRUE(by_seeds && by_cores);
  EXPECT_EQ(cores, 2u);
  for (const VoxelMask* labels : {&*by_seeds, &*by_cores}) {
    EXPECT_EQ(count_of(*labels, 0), std::ranges::count(mask.values, 0));
    const int left = labels->at(13, 15, 15), right = labels->at(32, 15, 15);
    EXPECT_NE(left, right);
    for (const int number : {left, right})
      EXPECT_NEAR(static_cast<double>(count_of(*labels, number)), ball_without_cap(kRadius, 9.5),
                  0.02 * ball_without_cap(kRadius, 9.5));
    for (int z = 0; z < 32; ++z)
      for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 46; ++x) {
          if (mask.at(x, y, z) == 0 || std::abs(x - 23.0) <= 1.0) continue;
          EXPECT_EQ(labels->at(x, y, z), x < 23 ? left : right) << x << " " << y << " " << z;
        }
  }
}

TEST(Watershed, ASmallBallLeavesALargeOneInTheirCircle) {
  const Vec3 a(15, 20, 20), b(35, 20, 20);
  // Circle of radius 3 at x = 15 + sqrt(13² - 3²).
  const double plane = 15.0 + std::sqrt(13.0 * 13.0 - 9.0);
  const double small = std::hypot(35.0 - plane, 3.0);
  const HuVolume scan = scan_of({48, 41, 41}, Vec3::Ones(), kBone_hu,
                                [&](const Vec3& at) { return in_ball(at, a, 13.0) || in_ball(at, b, small); });
  const VoxelMask mask = at_threshold(scan);
  std::size_t cores = 0;
  const auto labels = separated_by_cores(scan, mask, cores);
  ASSERT_TRUE(labels);
  EXPECT_EQ(cores, 2u);
  EXPECT_EQ(labels->at(15, 20, 20), 1) << "the deeper core comes first";
  for (int x = 1; x < 48; ++x)
    if (mask.at(x, 20, 20) != 0 && std::abs(x - plane) > 1.0) {
      EXPECT_EQ(labels->at(x, 20, 20), x < plane ? 1 : 2) << x;
    }
}

// Two bones with flat ends that are 2 mm apart: a short and a long part of a rod along `axis`.
struct Gap {
  Vec3 middle_mm, axis;
  [[nodiscard]] double along(const Vec3& at) const { return axis.dot(at - middle_mm); }
  [[nodiscard]] bool in(int number, const Vec3& at) const {
    const double mm = number == 1 ? -along(at) : along(at);
    return mm >= 1.0 && mm <= (number == 1 ? 37.0 : 49.0) && (at - middle_mm - along(at) * axis).norm() <= 11.0;
  }
};

TEST(Watershed, BonesTwoMillimetresApartInThickSlicesPart) {
  // Bone of 600 HU. A slice with half of the gap has 417 HU, above the threshold.
  const Vec3 spacing(0.8, 0.8, 3.0);
  int bridged = 0;
  for (const Vec3& axis : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(1, 0, 1).normalized()})
    for (const double shift_mm : {0.0, 0.75, 1.5}) {
      const Gap gap{Vec3(18.0, 18.0, 45.0 + shift_mm), axis};
      const HuVolume scan =
          scan_of({46, 46, 34}, spacing, 600, [&](const Vec3& at) { return gap.in(1, at) || gap.in(2, at); });
      const VoxelMask mask = at_threshold(scan);
      const auto voxel = [&](double along_mm) {
        const Vec3 v = (gap.middle_mm + along_mm * axis).cwiseQuotient(spacing);
        return std::array<int, 3>{static_cast<int>(std::lround(v.x())), static_cast<int>(std::lround(v.y())),
                                  static_cast<int>(std::lround(v.z()))};
      };
      const std::bitset<256> bone(2);
      const auto components = find_components(mask, bone, Connectivity::corners, always);
      bridged += components->count == 1 ? 1 : 0;
      const auto labels = separated(scan, mask, {voxel(-5.0), voxel(15.0)});
      ASSERT_TRUE(labels);
      // The threshold decides what is bone. Each voxel of it belongs to the bone on its side of the gap.
      for (const int side : {1, 2}) {
        const auto on_side = [&](const Vec3& at) { return (gap.along(at) < 0.0) == (side == 1); };
        EXPECT_GE(dice(*labels, side, mask, on_side, spacing), 0.95)
            << "axis " << axis.transpose() << ", shift " << shift_mm << ", bone " << side;
      }
    }
  EXPECT_GE(bridged, 4) << "the threshold alone parts most of them";
}

TEST(Watershed, ASymmetricScanPartsSymmetrically) {
  const HuVolume scan = scan_of({40, 24, 24}, {0.9, 0.9, 1.7}, kBone_hu, [&](const Vec3& at) {
    const Vec3 mirrored(std::abs(at.x() - 0.9 * 19.5), at.y(), at.z());
    return in_ball(mirrored, {9.2, 10, 20}, 9.5) || in_ball(mirrored, {13, 16, 14}, 4.0);
  });
  const VoxelMask mask = at_threshold(scan);
  std::size_t cores = 0;
  for (const auto& labels :
       {separated(scan, mask, {{9, 12, 12}, {30, 12, 12}}), separated_by_cores(scan, mask, cores)}) {
    ASSERT_TRUE(labels);
    for (int z = 0; z < 24; ++z)
      for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 20; ++x) EXPECT_EQ(labels->at(x, y, z) != 0, labels->at(39 - x, y, z) != 0);
    const int left = labels->at(9, 12, 12);
    for (int z = 0; z < 24; ++z)
      for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 20; ++x)
          EXPECT_EQ(labels->at(x, y, z) == left, mask.at(x, y, z) != 0 && labels->at(39 - x, y, z) != left);
  }
}

TEST(Watershed, ASeedInTheCortexStandsForItsWholeBone) {
  // Tubes with a marrow canal that touch along a line; both seeds at the surface, one at a bump.
  const HuVolume scan = scan_of({60, 40, 16}, Vec3::Ones(), kBone_hu, [&](const Vec3& at) {
    const double a = std::hypot(at.x() - 16, at.y() - 20), b = std::hypot(at.x() - 39, at.y() - 20);
    return (a <= 13 && a >= 9) || (b <= 11 && b >= 7) || in_ball(at, {50, 20, 8}, 2.5);
  });
  VoxelMask mask = at_threshold(scan);
  for (int z = 0; z < 16; ++z)  // marrow
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 60; ++x)
        if (std::hypot(x - 16, y - 20) <= 10 || std::hypot(x - 39, y - 20) <= 8) mask.at(x, y, z) = 1;
  const auto labels = separated(scan, mask, {{3, 20, 8}, {51, 20, 8}});
  ASSERT_TRUE(labels);
  for (int x = 0; x < 60; ++x)
    if (mask.at(x, 20, 8) != 0 && std::abs(x - 28.5) > 1.0) {
      EXPECT_EQ(labels->at(x, 20, 8), x < 28 ? 1 : 2) << x;
    }
}

TEST(Watershed, ACoreOfHalfTheNeckIsOneBone) {
  // A dumbbell: two balls of radius 8, joined by a bar. Its depth along the bar is the bar's radius.
  for (const double bar : {2.5, 6.0}) {
    const HuVolume scan = scan_of({52, 20, 20}, Vec3::Ones(), kBone_hu, [&](const Vec3& at) {
      const bool in_bar = at.x() > 9 && at.x() < 42 && std::hypot(at.y() - 9.5, at.z() - 9.5) <= bar;
      return in_bar || in_ball(at, {9, 9.5, 9.5}, 8.0) || in_ball(at, {42, 9.5, 9.5}, 8.0);
    });
    std::size_t cores = 0;
    ASSERT_TRUE(separated_by_cores(scan, at_threshold(scan), cores));
    EXPECT_EQ(cores, bar < 4.0 ? 2u : 1u) << bar;
  }
}

TEST(Watershed, WithoutAMarkerVoxelsStay0) {
  VoxelMask mask({10, 4, 4});
  for (int x = 0; x < 10; ++x)
    if (x != 5) mask.at(x, 1, 1) = 1;
  const BoneDepth depth{std::vector<std::uint16_t>(mask.values.size(), 3), 1.0};
  VoxelMask markers(mask.dims);
  markers.at(1, 1, 1) = 7;
  markers.at(5, 1, 1) = 9;  // not in the mask
  const auto labels = watershed(mask, depth, markers, always);
  ASSERT_TRUE(labels);
  EXPECT_EQ(count_of(*labels, 7), 5);
  EXPECT_EQ(count_of(*labels, 0), 160 - 5);
}

TEST(Watershed, EveryVoxelOfRandomVolumesIsReached) {
  std::mt19937 random(7);
  const std::vector<std::array<int, 3>> shapes{{1, 1, 1}, {1, 1, 40}, {40, 1, 1}, {9, 11, 1}, {7, 8, 9}, {16, 16, 16}};
  for (int trial = 0; trial < 120; ++trial) {
    HuVolume volume;
    volume.dims = shapes[static_cast<std::size_t>(trial) % shapes.size()];
    volume.spacing_mm = trial % 3 == 0 ? Vec3(0.1, 0.1, 2.0) : trial % 3 == 1 ? Vec3(20.0, 1.0, 1.0) : Vec3::Ones();
    const int kind = trial % 5;  // 0: all one value; the others: more or less bone
    std::uniform_int_distribution<int> hu(-1000, 3000);
    for (std::size_t i = 0; i < volume.count(); ++i)
      volume.values.push_back(kind == 0 ? std::int16_t{900} : static_cast<std::int16_t>(hu(random) + 300 * kind - 900));
    const VoxelMask mask = at_threshold(volume);
    std::vector<std::array<int, 3>> seeds;
    for (int z = 0; z < volume.dims[2]; ++z)
      for (int y = 0; y < volume.dims[1]; ++y)
        for (int x = 0; x < volume.dims[0]; ++x)
          if (mask.at(x, y, z) != 0 && seeds.size() < 5 && random() % 7 == 0) seeds.push_back({x, y, z});
    const auto by_seeds = separated(volume, mask, seeds);
    ASSERT_TRUE(by_seeds) << by_seeds.error().message;
    for (std::size_t i = 0; i < seeds.size(); ++i)
      EXPECT_EQ(by_seeds->at(seeds[i][0], seeds[i][1], seeds[i][2]), static_cast<int>(i) + 1) << trial;
    std::size_t cores = 0;
    const auto by_cores = separated_by_cores(volume, mask, cores);
    if (!by_cores) {
      EXPECT_EQ(by_cores.error().code, ErrorCode::exhausted);
      continue;
    }
    EXPECT_EQ(count_of(*by_cores, 0), std::ranges::count(mask.values, 0)) << trial;
  }
}

TEST(Watershed, StopsAtEveryQuestion) {
  const HuVolume scan = scan_of({20, 12, 12}, Vec3::Ones(), kBone_hu, [](const Vec3& at) {
    return in_ball(at, {6, 6, 6}, 4) || in_ball(at, {13, 6, 6}, 4);
  });
  const VoxelMask mask = at_threshold(scan);
  const auto run = [&](const KeepGoing& keep_going) -> Result<VoxelMask> {
    const auto depth = bone_depth(scan, mask, kBoneThreshold_hu, keep_going);
    if (!depth) return tl::unexpected(depth.error());
    if (auto cores = bone_cores(mask, *depth, keep_going); !cores) return tl::unexpected(cores.error());
    const std::vector<BoneSeed> seeds{{{6, 6, 6}, 1}, {{13, 6, 6}, 2}};
    auto markers = markers_from_seeds(mask, *depth, seeds, keep_going);
    if (!markers) return markers;
    return watershed(mask, *depth, std::move(*markers), keep_going);
  };
  int questions = 0;
  ASSERT_TRUE(run([&](double done) {
    EXPECT_GE(done, 0.0);
    EXPECT_LE(done, 1.0);
    return ++questions > 0;
  }));
  EXPECT_GE(questions, 6);
  for (int stop = 1; stop <= questions; ++stop) {
    int asked = 0;
    const auto stopped = run([&](double) { return ++asked < stop; });
    ASSERT_FALSE(stopped) << stop << " of " << questions;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

TEST(BoneMarkers, SeedsThatCannotBeMarkersAreRefused) {
  VoxelMask mask({8, 8, 8});
  mask.at(3, 3, 3) = mask.at(4, 3, 3) = 1;
  const BoneDepth depth{std::vector<std::uint16_t>(512, 1), 1.0};
  const auto refused = [&](const std::vector<BoneSeed>& seeds) {
    const auto markers = markers_from_seeds(mask, depth, seeds, always);
    return markers ? "" : markers.error().message;
  };
  EXPECT_NE(refused({{{3, 3, 3}, 1}, {{5, 3, 3}, 2}}).find("seed 2 does not lie in bone"), std::string::npos);
  EXPECT_NE(refused({{{3, 3, 3}, 1}, {{3, 3, 3}, 2}}).find("seed 2 lies in the voxel"), std::string::npos);
  EXPECT_EQ(refused({{{3, 3, 3}, 1}, {{3, 3, 3}, 1}, {{4, 3, 3}, 2}}), "");
}

// Along the middle of a slab the depth is the sum of half a voxel and the voxels before, with their weights.
TEST(BoneDepth, MarrowAndDarkBoneCountLess) {
  HuVolume volume;
  volume.dims = {9, 1, 1};
  volume.spacing_mm = {0.5, 1.0, 1.0};
  volume.values = {0, 1100, 1100, -50, -50, -50, 1100, 1100, 0};
  VoxelMask mask(volume.dims);
  for (int x = 1; x < 8; ++x) mask.at(x, 0, 0) = 1;
  const auto depth = bone_depth(volume, mask, kBoneThreshold_hu, always);
  ASSERT_TRUE(depth);
  const auto mm = [&](int x) { return depth->values[static_cast<std::size_t>(x)] * depth->unit_mm; };
  const double error = 3.0 * depth->unit_mm;
  EXPECT_EQ(mm(0), 0.0);
  EXPECT_NEAR(mm(1), 0.25, error);
  EXPECT_NEAR(mm(2), 0.75, error);
  EXPECT_NEAR(mm(3), 1.25, error);
  EXPECT_NEAR(mm(4), 1.75, error) << "marrow counts as dense bone";
  EXPECT_EQ(mm(3), mm(5));
  EXPECT_EQ(mm(1), mm(7));
}

TEST(BoneDepth, BoneThatFillsTheScanHasNoSurface) {
  HuVolume volume;
  volume.dims = {5, 5, 5};
  volume.values.assign(125, 1000);
  VoxelMask mask(volume.dims);
  std::ranges::fill(mask.values, std::uint8_t{1});
  const auto depth = bone_depth(volume, mask, kBoneThreshold_hu, always);
  ASSERT_TRUE(depth);
  EXPECT_TRUE(std::ranges::all_of(depth->values, [](std::uint16_t d) { return d == kDeepest; }));
}

}  // namespace
}  // namespace osteon::imaging
