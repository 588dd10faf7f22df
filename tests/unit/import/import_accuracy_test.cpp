// How well an imported bone agrees with the bone that was scanned: phantoms of known shape through DICOM files.
#include <cstdio>

#include "common/imaging/calibration.hpp"
#include "tests/support/scenes/scanned_bones.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

// A case is compared with its own shape, so the comparison itself adds no more than the sampling.
TEST(ScannedBones, AreComparedWithTheirOwnShape) {
  const test::BoneScan scan{.name = "exact", .shafts = test::long_bone(), .gaps_mm = {}};
  const double pitch_mm = 0.5;
  const CoordBox box = covering_samples({Vec3(-16.0, -16.0, -28.0), Vec3(16.0, 16.0, 28.0)}, pitch_mm);
  constexpr double kTooDense = 1.1;
  const DensityCalibration& line = imaging::kRho1995;
  DenseVolume<float> surface(box, 0.0f), density(box, 0.0f);
  std::size_t n = 0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z, ++n) {
        const double distance_mm = scan.surface_mm(position_mm({x, y, z}, pitch_mm));
        surface.values[n] = static_cast<float>(distance_mm);
        const bool cortex = distance_mm > -scan.shafts.front().cortex_mm;
        density.values[n] = static_cast<float>(cortex ? imaging::density_g_cm3(line, test::kCortex_hu)
                                                      : kTooDense * imaging::density_g_cm3(line, test::kCancellous_hu));
      }
  CaseInfo info;
  info.title = "exact";
  info.source = "shape";
  info.pitch_mm = pitch_mm;
  info.calibration = line;
  const auto bone = Case::build(std::move(info), surface, density);
  ASSERT_TRUE(bone) << bone.error().message;
  const test::Accuracy same = test::accuracy_of(scan, *bone);
  EXPECT_GT(same.dice, 0.999);
  EXPECT_LT(same.mean_mm, 0.01);
  EXPECT_LT(same.percentile95_mm, 0.03);
  // Only the cancellous bone is denser than that of the shape. Counting samples gives a volume within half a percent.
  EXPECT_NEAR(same.cortical_percent, 0.0, 0.01);
  EXPECT_NEAR(same.cancellous_percent, 10.0, 0.01);
  EXPECT_NEAR(same.cortical_mass_percent, 0.0, 0.5);
  EXPECT_NEAR(same.cancellous_mass_percent, 10.0, 0.5);
  EXPECT_GT(same.mass_percent, same.cortical_mass_percent);
  EXPECT_LT(same.mass_percent, same.cancellous_mass_percent);

  // Beside a shape that is 1 mm thicker, the surface lies 1 mm too far in everywhere.
  test::BoneScan thicker = scan;
  thicker.shafts.front().radius_mm += 1.0;
  const test::Accuracy off = test::accuracy_of(thicker, *bone);
  EXPECT_NEAR(off.offset_mm, -1.0, 0.02);
  // It lacks a shell of 1 mm, which is a fifth of the thicker shape and a tenth of its mass at least.
  EXPECT_LT(off.mass_percent, -10.0);
  EXPECT_NEAR(off.mean_mm, 1.0, 0.02);
  EXPECT_NEAR(off.percentile95_mm, 1.0, 0.05);
}

void print(const test::BoneScan& scan, const char* how, const test::Accuracy& found) {
  std::printf(
      "[          ] %s, %s: Dice %.4f, mean %.3f mm, 95 %% %.3f mm, offset %+.3f mm, density of cortex %+.1f %%, "
      "of cancellous bone %+.1f %%, mass %+.1f %%\n",
      scan.name.c_str(), how, found.dice, found.mean_mm, found.percentile95_mm, found.offset_mm, found.cortical_percent,
      found.cancellous_percent, found.mass_percent);
}

// With the options that a user has who gives none. The goals are half a pixel, or 0.6 mm in slices of 3 mm.
TEST(ImportAccuracy, ScannedBonesComeBackWithTheirShape) {
  const test::TempDir folder;
  for (const test::BoneScan& scan : test::accuracy_scans()) {
    const auto found = test::measure_accuracy(scan, {}, folder / scan.name);
    ASSERT_TRUE(found) << scan.name << ": " << found.error().message;
    print(scan, "half maximum", *found);
    EXPECT_GE(found->dice, scan.shafts.size() == 1 ? 0.97 : 0.95) << scan.name;
    EXPECT_LE(found->mean_mm, scan.thickness_mm > 2.0 ? 0.6 : 0.5 * scan.pixel_mm) << scan.name;
    // More blur and slices of 3 mm are wider than the cortex allows: their scans themselves show less of it.
    if (scan.blur_mm > 0.5 || scan.thickness_mm > 2.0) continue;
    EXPECT_NEAR(found->cortical_percent, 0.0, 3.0) << scan.name;
    EXPECT_NEAR(found->cancellous_percent, 0.0, 5.0) << scan.name;
  }
}

// At 226 HU the edge of cortex lies outside: a Gaussian's edge of sigma s from 40 to 1500 HU has 226 HU at 1.14 s.
TEST(ImportAccuracy, ASurfaceAtTheThresholdMovesTheSurfaceAsFarAsTheBlurSays) {
  const test::TempDir folder;
  for (const double blur_mm : {0.4, 0.7}) {
    test::BoneScan scan{.name = "blur", .shafts = test::long_bone(), .gaps_mm = std::vector<double>(60, 1.0)};
    // The mean over a slice of 1 mm blurs only along the slices' normal, nearly along this bone's surface.
    scan.noise_hu = 0.0;
    scan.blur_mm = blur_mm;
    CtOptions options;
    options.surface = SurfaceAt::threshold;
    const auto found = test::measure_accuracy(scan, options, folder / std::to_string(blur_mm));
    ASSERT_TRUE(found) << found.error().message;
    print(scan, "threshold", *found);
    EXPECT_NEAR(found->offset_mm, 1.14 * blur_mm, 0.12);
  }
}

}  // namespace
}  // namespace osteon::import
