// How well an imported bone agrees with the bone that was scanned: phantoms of known shape through DICOM files.
#include <cstdio>

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
  DenseVolume<float> surface(box, 0.0f), density(box, 1.5f);
  std::size_t n = 0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z, ++n)
        surface.values[n] = static_cast<float>(scan.surface_mm(position_mm({x, y, z}, pitch_mm)));
  CaseInfo info;
  info.title = "exact";
  info.source = "shape";
  info.pitch_mm = pitch_mm;
  const auto bone = Case::build(std::move(info), surface, density);
  ASSERT_TRUE(bone) << bone.error().message;
  const test::Accuracy same = test::accuracy_of(scan, *bone);
  EXPECT_GT(same.dice, 0.999);
  EXPECT_LT(same.mean_mm, 0.01);
  EXPECT_LT(same.percentile95_mm, 0.03);

  // Beside a shape that is 1 mm thicker, the surface lies 1 mm too far in everywhere.
  test::BoneScan thicker = scan;
  thicker.shafts.front().radius_mm += 1.0;
  const test::Accuracy off = test::accuracy_of(thicker, *bone);
  EXPECT_NEAR(off.offset_mm, -1.0, 0.02);
  EXPECT_NEAR(off.mean_mm, 1.0, 0.02);
  EXPECT_NEAR(off.percentile95_mm, 1.0, 0.05);
}

void print(const test::BoneScan& scan, const char* threshold, const test::Accuracy& found) {
  std::printf("[          ] %s, %s threshold: Dice %.4f, mean %.3f mm, 95 %% %.3f mm, offset %+.3f mm\n",
              scan.name.c_str(), threshold, found.dice, found.mean_mm, found.percentile95_mm, found.offset_mm);
}

// With the threshold midway between soft tissue and cortex a blurred edge stays where it is, so what remains is what
// the import itself adds: noise, thick and tilted slices, resampling. The goals are half a pixel, or 0.6 mm in slices
// of 3 mm.
TEST(ImportAccuracy, ScannedBonesComeBackWithTheirShape) {
  const test::TempDir folder;
  for (const test::BoneScan& scan : test::accuracy_scans()) {
    CtOptions options;
    options.threshold_hu = test::kMidway_hu;
    const auto found = test::measure_accuracy(scan, options, folder / scan.name);
    ASSERT_TRUE(found) << scan.name << ": " << found.error().message;
    print(scan, "midway", *found);
    EXPECT_GE(found->dice, scan.shafts.size() == 1 ? 0.97 : 0.95) << scan.name;
    EXPECT_LE(found->mean_mm, scan.thickness_mm > 2.0 ? 0.6 : 0.5 * scan.pixel_mm) << scan.name;
    EXPECT_EQ(found->islands, scan.shafts.size()) << scan.name << ": bones 2 mm apart have grown together";
  }
}

// At 226 HU the edge of cortex lies outside: a Gaussian's edge of sigma s from 40 to 1500 HU has 226 HU at 1.14 s. The
// goals are not reached with it; figures of the import print by how much.
TEST(ImportAccuracy, TheDefaultThresholdMovesTheSurfaceAsFarAsTheBlurSays) {
  const test::TempDir folder;
  for (const double blur_mm : {0.4, 0.7}) {
    test::BoneScan scan{.name = "blur", .shafts = test::long_bone(), .gaps_mm = std::vector<double>(60, 1.0)};
    // The mean over a slice of 1 mm blurs only along the slices' normal, nearly along this bone's surface.
    scan.noise_hu = 0.0;
    scan.blur_mm = blur_mm;
    const auto found = test::measure_accuracy(scan, {}, folder / std::to_string(blur_mm));
    ASSERT_TRUE(found) << found.error().message;
    print(scan, "default", *found);
    EXPECT_NEAR(found->offset_mm, 1.14 * blur_mm, 0.12);
  }
}

}  // namespace
}  // namespace osteon::import
