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

}  // namespace
}  // namespace osteon::import
