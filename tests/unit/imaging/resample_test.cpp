#include "common/imaging/resample.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

TEST(Resample, ReproducesALinearFieldOnAnObliqueGrid) {
  HuVolume volume;
  volume.dims = {30, 30, 20};
  volume.spacing_mm = {1.0, 1.0, 1.5};
  volume.origin_mm = {-14.3, -15.2, 90.7};
  volume.directions = Eigen::AngleAxisd(0.3, Vec3(0.3, 1.0, 0.2).normalized()).toRotationMatrix();
  const Vec3 gradient(40.0, -25.0, 60.0);  // HU per mm
  const auto truth = [&](const Vec3& p) { return gradient.dot(p - Vec3(0.0, 0.0, 104.0)); };
  volume.values.resize(volume.count());
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 30; ++j)
      for (int i = 0; i < 30; ++i)
        volume.values[volume.index(i, j, k)] =
            static_cast<std::int16_t>(std::lround(truth(volume.position_mm(Vec3(i, j, k)))));

  // Around the middle of the volume, at a pitch that does not match the grid.
  const double pitch_mm = 0.37;
  const Vec3 middle = volume.position_mm(Vec3(14.5, 14.5, 9.5));
  const CoordBox box = covering_samples(Box{middle.array() - 3.0, middle.array() + 3.0}, pitch_mm);
  const auto out = resample(volume, box, pitch_mm, always);
  ASSERT_TRUE(out);
  double worst = 0.0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z)
        worst = std::max(worst,
                         std::abs(static_cast<double>(out->at({x, y, z})) - truth(position_mm({x, y, z}, pitch_mm))));
  EXPECT_LT(worst, 0.5 + 1e-3);  // the source is rounded to whole HU; interpolation adds no error
}

TEST(Resample, GoesOnWithTheEdgeBeyondTheScan) {
  HuVolume volume;
  volume.dims = {2, 2, 2};
  volume.values = {0, 100, 0, 100, 0, 100, 0, 100};
  const auto out = resample(volume, {{-3, 0, 0}, {4, 0, 0}}, 1.0, always);
  ASSERT_TRUE(out);
  EXPECT_EQ(out->values, (std::vector<float>{0, 0, 0, 0, 100, 100, 100, 100}));
}

TEST(Resample, StopsWhenAsked) {
  HuVolume volume;
  volume.dims = {2, 2, 2};
  volume.values.assign(8, 0);
  const auto out = resample(volume, {{0, 0, 0}, {1, 1, 1}}, 1.0, [](double) { return false; });
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, ErrorCode::cancelled);
}

// With voxels of three different sizes, straight and oblique, within the scan and across its ends.
TEST(Resample, APartWithItsVoxelsHasTheBytesOfTheWhole) {
  std::mt19937 random(4);
  HuVolume volume;
  volume.dims = {17, 13, 9};
  volume.spacing_mm = {0.7, 0.9, 2.3};
  volume.origin_mm = {-5.31, 2.17, -8.03};
  volume.values.resize(volume.count());
  for (std::int16_t& hu : volume.values) hu = static_cast<std::int16_t>(random() % 4000) - 1000;
  for (const double angle : {0.0, 0.4}) {
    volume.directions = Eigen::AngleAxisd(angle, Vec3(0.3, 1.0, 0.2).normalized()).toRotationMatrix();
    const double pitch_mm = 0.61;
    const Vec3 centre = volume.position_mm(Vec3(8, 6, 4));
    for (int trial = 0; trial < 200; ++trial) {
      const Vec3 shift(static_cast<double>(random() % 30) - 15.0, static_cast<double>(random() % 30) - 15.0,
                       static_cast<double>(random() % 40) - 20.0);
      const CoordBox around = covering_samples(Box{centre + shift, centre + shift}, pitch_mm);
      const CoordBox box = around.grown(static_cast<std::int32_t>(random() % 5));
      const VoxelBox part = voxels_for(volume, box, pitch_mm);
      std::vector<std::int16_t> voxels(part.count());
      for (int k = part.first[2]; k <= part.last[2]; ++k)
        for (int j = part.first[1]; j <= part.last[1]; ++j)
          for (int i = part.first[0]; i <= part.last[0]; ++i) voxels[part.index(i, j, k)] = volume.at(i, j, k);
      const auto whole = resample(volume, box, pitch_mm, always);
      ASSERT_TRUE(whole);
      std::vector<float> found(whole->values.size());
      resample(volume, part, voxels, box, pitch_mm, found);
      ASSERT_EQ(found, whole->values) << "angle " << angle << ", trial " << trial;
    }
  }
}

}  // namespace
}  // namespace osteon::imaging
