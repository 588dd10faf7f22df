// A trunk of simple shapes: a vertebra with cortex and textured cancellous bone, and vessels beside it. Each voxel is
// the mean of 27 points, with noise.
#include "common/imaging/contrast.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <random>
#include <utility>

#include "common/imaging/calibration.hpp"
#include "common/imaging/island_kinds.hpp"
#include "common/imaging/segmentation.hpp"
#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

constexpr double kMuscle_hu = 40.0, kEnhanced_hu = 300.0, kCortex_hu = 700.0, kCancellous_hu = 250.0;
constexpr double kTrunkNoise_hu = 20.0, kTexture_hu = 70.0, kCortex_mm = 2.0;
constexpr double kVertebra_mm = 14.0, kAorta_mm = 12.0;

using Trunk = std::function<double(const Vec3&)>;

double from_axis(const Vec3& p, double x, double y) { return std::hypot(p.x() - x, p.y() - y); }

// The vertebra touches the aorta at x = 2 mm. Both go through the whole scan.
bool in_vertebra(const Vec3& p) { return from_axis(p, 16.0, 0.0) < kVertebra_mm; }
bool in_aorta(const Vec3& p) { return from_axis(p, -10.0, 0.0) < kAorta_mm; }
// Trabeculae and marrow between them, 4 mm from each to the next.
double texture(const Vec3& p) {
  const double wave = 2.0 * std::numbers::pi / 4.0;
  return kTexture_hu * 2.0 * std::sin(wave * p.x()) * std::sin(wave * p.y()) * std::cos(0.5 * wave * p.z());
}
double vertebra(const Vec3& p, double beside) {
  if (!in_vertebra(p)) return beside;
  return from_axis(p, 16.0, 0.0) > kVertebra_mm - kCortex_mm ? kCortex_hu : kCancellous_hu + texture(p);
}
Trunk trunk(double blood_hu) {
  return [=](const Vec3& p) { return vertebra(p, in_aorta(p) ? blood_hu : kMuscle_hu); };
}

HuVolume scan_of(const Trunk& at, const Vec3& spacing_mm = Vec3::Ones(), const Vec3& size_mm = {64.0, 40.0, 30.0}) {
  HuVolume volume;
  for (int axis = 0; axis < 3; ++axis)
    volume.dims[static_cast<std::size_t>(axis)] =
        static_cast<int>(axis < 2 ? size_mm[axis] : size_mm[axis] / spacing_mm[axis]);
  volume.spacing_mm = spacing_mm;
  volume.origin_mm = -0.5 * spacing_mm.cwiseProduct(Vec3(volume.dims[0] - 1, volume.dims[1] - 1, volume.dims[2] - 1));
  std::mt19937 random(68);
  std::normal_distribution<double> noise(0.0, kTrunkNoise_hu);
  for (int z = 0; z < volume.dims[2]; ++z)
    for (int y = 0; y < volume.dims[1]; ++y)
      for (int x = 0; x < volume.dims[0]; ++x) {
        double sum = 0.0;
        for (int i = 0; i < 27; ++i)
          sum += at(volume.position_mm(Vec3(x + (i % 3 - 1) / 3.0, y + (i / 3 % 3 - 1) / 3.0, z + (i / 9 - 1) / 3.0)));
        volume.values.push_back(static_cast<std::int16_t>(std::lround(sum / 27.0 + noise(random))));
      }
  return volume;
}

struct Marked {
  std::optional<BloodPool> pool;
  VoxelMask before, mask;
};

Marked mark(const HuVolume& volume) {
  Marked made;
  made.before = *dense_voxels(volume, kBoneThreshold_hu, always);
  made.mask = made.before;
  auto pool = mark_contrast(volume, kBoneThreshold_hu, kMetal_hu, made.mask, always);
  EXPECT_TRUE(pool);
  if (pool) made.pool = *pool;
  return made;
}
void expect_unchanged(const Trunk& at) {
  const Marked made = mark(scan_of(at));
  EXPECT_FALSE(made.pool) << made.pool->level_hu << " HU, " << made.pool->contrast_cm3 << " cm3";
  EXPECT_EQ(made.mask.values, made.before.values);
}

// How voxels agree with a shape.
struct Agreement {
  double dice = 0.0, lost = 0.0;  // lost: share of the shape
};
Agreement compare(const HuVolume& volume, const VoxelMask& mask, const std::function<bool(std::uint8_t)>& is_found,
                  const std::function<bool(const Vec3&)>& is_true) {
  double found = 0.0, truth = 0.0, both = 0.0;
  for (int z = 0; z < volume.dims[2]; ++z)
    for (int y = 0; y < volume.dims[1]; ++y)
      for (int x = 0; x < volume.dims[0]; ++x) {
        const bool a = is_found(mask.at(x, y, z)), b = is_true(volume.position_mm(Vec3(x, y, z)));
        found += a, truth += b, both += a && b;
      }
  return {2.0 * both / (found + truth), 1.0 - both / truth};
}
bool is_contrast(std::uint8_t voxel) { return voxel == mask_value(BoneVoxel::contrast); }
bool is_bone(std::uint8_t voxel) { return voxel != mask_value(BoneVoxel::none) && !is_contrast(voxel); }

TEST(Contrast, AnAortaComesApartFromTheVertebraThatItTouches) {
  for (const double slice_mm : {1.0, 2.0}) {
    const HuVolume volume = scan_of(trunk(kEnhanced_hu), {1.0, 1.0, slice_mm});
    Marked made = mark(volume);
    ASSERT_TRUE(made.pool);
    EXPECT_NEAR(made.pool->level_hu, kEnhanced_hu, 5.0);
    EXPECT_NEAR(made.pool->noise_hu, kTrunkNoise_hu, 0.15 * kTrunkNoise_hu);
    EXPECT_GT(compare(volume, made.mask, is_contrast, in_aorta).dice, 0.97);

    const auto bone = segment_bone(volume, std::move(made.mask), {}, kAllScanEnds, always);
    ASSERT_TRUE(bone);
    const Agreement vertebra = compare(volume, *bone, is_bone, in_vertebra);
    EXPECT_GT(vertebra.dice, 0.97);
    EXPECT_LT(vertebra.lost, 0.01);

    const auto islands = find_islands(volume, *bone, {.slope_g_cm3_per_hu = 1e-3}, always);
    ASSERT_TRUE(islands);
    const auto natures = name_islands(volume, *bone, *islands, kMetal_hu, always);
    ASSERT_TRUE(natures);
    ASSERT_GE(natures->size(), 2u);
    // The vertebra is the larger one, and everything else is noise.
    EXPECT_EQ((*natures)[0].kind, IslandKind::bone);
    EXPECT_EQ((*natures)[1].kind, IslandKind::contrast);
    for (std::size_t i = 2; i < natures->size(); ++i) EXPECT_LT(islands->list[i].volume_cm3, 0.05) << i;
    EXPECT_TRUE(std::ranges::is_sorted(islands->components.runs, {}, [](const VoxelRun& run) {
      return std::array{run.slice, run.row, run.first};
    }));
  }
}

TEST(Contrast, AScanWithoutContrastIsUnchanged) { expect_unchanged(trunk(kMuscle_hu)); }

TEST(Contrast, ASolidBoneAsHomogeneousAsBloodIsBone) {
  // A phantom of one material. Nothing in the scan is brighter.
  expect_unchanged([](const Vec3& p) { return in_vertebra(p) || in_aorta(p) ? 600.0 : kMuscle_hu; });
}

TEST(Contrast, CancellousBoneWithoutTextureIsBone) {
  // All have cortex around them, of which the voxel of a coarse scan shows half. The thickest is deeper than 4 mm.
  for (const auto& [radius_mm, cortex_mm] : {std::pair{kAorta_mm, 1.0}, {kAorta_mm, 3.0}, {kAorta_mm + 6.0, 6.0}})
    expect_unchanged([&](const Vec3& p) {
      const double shaft_mm = from_axis(p, -12.0, 0.0);
      if (shaft_mm < radius_mm) return shaft_mm > radius_mm - cortex_mm ? 900.0 : kEnhanced_hu;
      return vertebra(p, kMuscle_hu);
    });
}

TEST(Contrast, AFemoralHeadWithThinCortexIsBone) {
  // Groups of trabeculae make the head brighter and darker over centimetres, not within them. The scan blurs its cortex
  // so much that it is not brighter than the inside. The shaft has thick cortex.
  constexpr double kHead_mm = 24.0, kThin_mm = 0.4, kBlur_mm = 0.7;
  const Vec3 centre(-20.0, 0.0, 0.0);
  const auto hu = [&](const Vec3& p) {
    const double depth = (kHead_mm - (p - centre).norm()) / kBlur_mm, shaft_mm = std::hypot(p.y(), p.z());
    if (p.x() > 2.0 && shaft_mm < 14.0) return shaft_mm > 9.0 ? 1300.0 : 20.0;
    const double inside = 400.0 + 100.0 * std::sin(p.x() / 8.0) * std::cos(p.z() / 9.0);
    const double share = 0.5 * std::erfc(-depth / std::numbers::sqrt2);
    const double cortex = kThin_mm / kBlur_mm * std::exp(-0.5 * depth * depth) / std::sqrt(2.0 * std::numbers::pi);
    return kMuscle_hu + share * (inside - kMuscle_hu) + cortex * (1300.0 - inside);
  };
  const Marked made = mark(scan_of(hu, Vec3::Ones(), {92.0, 54.0, 54.0}));
  EXPECT_FALSE(made.pool) << made.pool->contrast_cm3 << " cm3";
  EXPECT_EQ(made.mask.values, made.before.values);
}

TEST(Contrast, DryBoneInAirIsBone) {
  expect_unchanged([](const Vec3& p) { return vertebra(p, in_aorta(p) ? 500.0 : -1000.0); });
}

TEST(Contrast, AThinPlateOfBoneIsBone) {
  expect_unchanged([](const Vec3& p) { return vertebra(p, std::abs(p.x() + 10.0) < 2.5 ? 400.0 : kMuscle_hu); });
}

TEST(Contrast, ChalkInTheWallDoesNotMakeAnAortaBone) {
  const auto in_chalk = [](const Vec3& p) {
    return std::abs(from_axis(p, -10.0, 0.0) - kAorta_mm) < 1.0 && p.x() < -10.0 && p.y() > 0.0;
  };
  const HuVolume volume = scan_of([&](const Vec3& p) { return in_chalk(p) ? 900.0 : trunk(kEnhanced_hu)(p); });
  Marked made = mark(volume);
  ASSERT_TRUE(made.pool);
  EXPECT_GT(compare(volume, made.mask, is_contrast, [&](const Vec3& p) { return in_aorta(p) && !in_chalk(p); }).dice,
            0.95);
  const auto bone = segment_bone(volume, std::move(made.mask), {}, kAllScanEnds, always);
  ASSERT_TRUE(bone);
  EXPECT_LT(compare(volume, *bone, is_bone, in_vertebra).lost, 0.01);
}

TEST(Contrast, ArteriesAndVeinsMayDiffer) {
  // The vein touches nothing.
  const auto in_vein = [](const Vec3& p) { return from_axis(p, -25.0, 15.0) < 7.3; };
  const HuVolume volume = scan_of([&](const Vec3& p) { return in_vein(p) ? 300.0 : trunk(480.0)(p); });
  const Marked made = mark(volume);
  ASSERT_TRUE(made.pool);
  EXPECT_NEAR(made.pool->level_hu, 480.0, 5.0);
  EXPECT_GT(compare(volume, made.mask, is_contrast, [&](const Vec3& p) { return in_aorta(p) || in_vein(p); }).dice,
            0.97);
}

TEST(Contrast, BloodThatIsNotMixedYetBelongsToThePool) {
  // A vein with streaks of 500 to 1300 HU beside an aorta.
  const auto in_vein = [](const Vec3& p) { return from_axis(p, -22.0, 12.0) < 7.0; };
  const HuVolume volume = scan_of([&](const Vec3& p) {
    return in_vein(p) && !in_aorta(p) ? 900.0 + 400.0 * std::sin(p.x()) * std::cos(p.z()) : trunk(kEnhanced_hu)(p);
  });
  const Marked made = mark(volume);
  ASSERT_TRUE(made.pool);
  EXPECT_GT(compare(volume, made.mask, is_contrast, [&](const Vec3& p) { return in_aorta(p) || in_vein(p); }).dice,
            0.95);
}

TEST(Contrast, CortexThatLiesOnBloodIsBone) {
  // A plate of 5 mm covers a sixth of the aorta. Hardly any of it is deeper than 4 mm.
  const auto in_plate = [](const Vec3& p) {
    const double axis_mm = from_axis(p, -10.0, 0.0);
    return axis_mm > kAorta_mm && axis_mm < kAorta_mm + 5.0 && -p.x() - 10.0 > 0.87 * axis_mm;
  };
  const HuVolume volume = scan_of([&](const Vec3& p) { return in_plate(p) ? 900.0 : trunk(kEnhanced_hu)(p); });
  Marked made = mark(volume);
  ASSERT_TRUE(made.pool);
  EXPECT_GT(compare(volume, made.mask, is_contrast, in_aorta).dice, 0.95);
  EXPECT_LT(compare(volume, made.mask, is_bone, in_plate).lost, 0.1);
}

TEST(Contrast, StopsAtEachQuestionAndNeverGoesBack) {
  const HuVolume volume = scan_of(trunk(kEnhanced_hu), Vec3::Constant(2.0));
  const VoxelMask dense = *dense_voxels(volume, kBoneThreshold_hu, always);
  int questions = 0;
  double last = 0.0;
  VoxelMask mask = dense;
  const auto pool = mark_contrast(volume, kBoneThreshold_hu, kMetal_hu, mask, [&](double done) {
    EXPECT_GE(done, last);
    EXPECT_LE(done, 1.0);
    last = done;
    return ++questions > 0;
  });
  ASSERT_TRUE(pool);
  ASSERT_TRUE(*pool);
  for (int stop_at = 1; stop_at <= questions; ++stop_at) {
    int asked = 0;
    mask = dense;
    const auto stopped =
        mark_contrast(volume, kBoneThreshold_hu, kMetal_hu, mask, [&](double) { return ++asked < stop_at; });
    ASSERT_FALSE(stopped) << stop_at;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace osteon::imaging
