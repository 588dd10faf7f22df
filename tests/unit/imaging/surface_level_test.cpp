// The level of a bone's surface. The truth is a plane, a wall or a shell under a Gaussian blur, in closed form.
#include "common/imaging/surface_level.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>

#include "common/imaging/bone_field.hpp"
#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

constexpr double kDense_hu = 226.0;

// Part of a blurred half-space: 1 far inside. `distance`: from its edge, negative inside; `sigma` in the same unit.
double edge(double distance, double sigma) { return 0.5 * std::erfc(distance / (sigma * std::numbers::sqrt2)); }

HuVolume edges_of(const std::array<int, 3>& dims, const Vec3& spacing_mm,
                  const std::function<double(const Vec3&)>& hu) {
  HuVolume volume;
  volume.dims = dims;
  volume.spacing_mm = spacing_mm;
  volume.origin_mm = -0.5 * Vec3(dims[0] - 1, dims[1] - 1, dims[2] - 1).cwiseProduct(spacing_mm);
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x)
        volume.values.push_back(static_cast<std::int16_t>(std::lround(hu(volume.position_mm(Vec3(x, y, z))))));
  return volume;
}

VoxelMask dense_voxels(const HuVolume& volume) {
  VoxelMask bones(volume.dims);
  for (std::size_t i = 0; i < bones.values.size(); ++i) bones.values[i] = volume.values[i] >= kDense_hu ? 1 : 0;
  return bones;
}

// Where the field crosses the threshold on the way along x, as a mean over the rows of the inner slices, minus where
// `plane_mm` says that the edge is.
double mean_offset_mm(const HuVolume& volume, const VoxelMask& bones, const SurfaceLevel& level,
                      const std::function<double(double y_mm, double z_mm)>& plane_mm) {
  const SparseMask kept(bones);
  const auto field = BoneField::make(volume, kept, level, always);
  const auto [columns, rows, slices] = volume.dims;
  std::vector<std::int16_t> values(static_cast<std::size_t>(columns));
  double sum = 0.0;
  int count = 0;
  for (int slice = 4; slice < slices - 4; ++slice)
    for (int row = 4; row < rows - 4; ++row) {
      field->read({{0, row, slice}, {columns - 1, row, slice}}, values);
      for (int x = 0; x + 1 < columns; ++x) {
        const double here = values[static_cast<std::size_t>(x)] - kDense_hu,
                     next = values[static_cast<std::size_t>(x) + 1] - kDense_hu;
        if (!(here < 0.0 && next >= 0.0)) continue;
        const Vec3 at = volume.position_mm(Vec3(x + here / (here - next), row, slice));
        sum += at.x() - plane_mm(at.y(), at.z());
        ++count;
      }
    }
  EXPECT_EQ(count, (rows - 8) * (slices - 8)) << "each row has one crossing";
  return sum / count;
}

TEST(SurfaceLevel, ABlurredEdgeIsWhereItWas) {
  // The edge is oblique: its normal is (1, 0.3, 0.2).
  const Vec3 normal = Vec3(1.0, 0.3, 0.2).normalized();
  const auto plane_mm = [&](double y, double z) { return -(normal.y() * y + normal.z() * z) / normal.x(); };
  for (const auto& [outside_hu, inside_hu] :
       {std::pair{40.0, 1500.0}, {40.0, 700.0}, {-100.0, 1800.0}, {-1000.0, 1700.0}, {150.0, 1000.0}})
    for (const double blur_mm : {0.3, 0.6, 1.0}) {
      const HuVolume volume = edges_of({32, 20, 20}, Vec3(0.6, 0.6, 0.6), [&](const Vec3& p) {
        return outside_hu + (inside_hu - outside_hu) * edge(-normal.dot(p), blur_mm);
      });
      VoxelMask bones = dense_voxels(volume);
      const double before_mm = mean_offset_mm(volume, bones, {kDense_hu}, plane_mm);
      const auto level = move_to_half_maximum(volume, kDense_hu, bones, always);
      ASSERT_TRUE(level) << level.error().message;
      const double after_mm = mean_offset_mm(volume, bones, *level, plane_mm);
      EXPECT_NEAR(after_mm, 0.0, 0.05) << outside_hu << " to " << inside_hu << " HU, blur " << blur_mm
                                       << " mm; at the threshold " << before_mm;
    }
}

// 100,000 voxels and more lie below their level, so the list of them moves in memory while it is read.
TEST(SurfaceLevel, ALargeFaceLosesEachOfItsLayers) {
  const HuVolume volume =
      edges_of({12, 260, 260}, Vec3(0.6, 0.6, 0.6), [](const Vec3& p) { return 40.0 + 1460.0 * edge(-p.x(), 1.0); });
  VoxelMask bones = dense_voxels(volume);
  const auto voxels = [&] { return std::ranges::count(bones.values, std::uint8_t{1}); };
  const std::ptrdiff_t before = voxels();
  ASSERT_TRUE(move_to_half_maximum(volume, kDense_hu, bones, always));
  EXPECT_EQ(voxels(), std::ptrdiff_t{6} * 260 * 260) << "the half with x > 0";
  EXPECT_GT(before - voxels(), 100'000);
}

TEST(SurfaceLevel, ThickSlicesAndNoiseMoveItLittle) {
  const Vec3 normal = Vec3(1.0, 0.2, 0.7).normalized();
  const auto plane_mm = [&](double y, double z) { return -(normal.y() * y + normal.z() * z) / normal.x(); };
  std::uint32_t random = 1;
  const HuVolume volume = edges_of({64, 20, 14}, Vec3(0.5, 0.5, 2.0), [&](const Vec3& p) {
    double noise = -6.0;  // the sum of twelve uniform numbers: variance 1
    for (int i = 0; i < 12; ++i)
      noise += static_cast<double>((random = random * 1664525U + 1013904223U) >> 8) / (1 << 24);
    return 40.0 + 1400.0 * edge(-normal.dot(p), 0.8) + 25.0 * noise;
  });
  VoxelMask bones = dense_voxels(volume);
  const auto level = move_to_half_maximum(volume, kDense_hu, bones, always);
  ASSERT_TRUE(level);
  EXPECT_NEAR(mean_offset_mm(volume, bones, *level, plane_mm), 0.0, 0.1);
}

TEST(SurfaceLevel, GreyBoneKeepsTheThreshold) {
  // Half way from 20 to 400 HU is below 226 HU.
  const HuVolume volume = edges_of({24, 12, 12}, Vec3(0.7, 0.7, 0.7),
                                   [&](const Vec3& p) { return 20.0 + 380.0 * edge(-p.x() - 0.3 * p.y(), 0.5); });
  const VoxelMask before = dense_voxels(volume);
  VoxelMask bones = before;
  const auto level = move_to_half_maximum(volume, kDense_hu, bones, always);
  ASSERT_TRUE(level);
  EXPECT_EQ(bones.values, before.values);
  EXPECT_TRUE(level->above.values().empty());
}

TEST(SurfaceLevel, AThinWallHasNoHoles) {
  // A wall of 0.5 to 1.5 mm, thicker along y, is blurred by 0.6 mm: its HU reach from a fifth to all of the cortex's.
  const HuVolume volume = edges_of({32, 30, 16}, Vec3(0.7, 0.7, 0.7), [&](const Vec3& p) {
    const double half_mm = 0.5 + 0.025 * p.y(), from = p.x() - 0.35 * p.z();
    return 40.0 + 1460.0 * (edge(from - half_mm, 0.6) - edge(from + half_mm, 0.6));
  });
  const VoxelMask before = dense_voxels(volume);
  VoxelMask bones = before;
  ASSERT_TRUE(move_to_half_maximum(volume, kDense_hu, bones, always));
  int lost = 0;
  for (int z = 0; z < 16; ++z)
    for (int y = 0; y < 30; ++y) {
      bool was = false, is = false;
      for (int x = 0; x < 32; ++x) {
        was = was || before.at(x, y, z) != 0;
        is = is || bones.at(x, y, z) != 0;
        lost += before.at(x, y, z) != bones.at(x, y, z) ? 1 : 0;
      }
      EXPECT_EQ(is, was) << "row " << y << ", slice " << z;
    }
  EXPECT_GT(lost, 100) << "the blur at both sides of the wall is still bone";
}

TEST(SurfaceLevel, AGreyWallBeforeDenseBoneStays) {
  // Half way to the wall's own 500 HU is 270; half way to those of the cortex 1 mm behind it would be 770.
  const HuVolume volume = edges_of({24, 12, 12}, Vec3(0.7, 0.7, 0.7), [](const Vec3& p) {
    const double x = p.x() + 0.1 * p.y();
    return x < -2.2 ? 40.0 : x < -0.8 ? 500.0 : x < 0.2 ? 60.0 : 1500.0;
  });
  VoxelMask bones = dense_voxels(volume);
  for (std::size_t i = 0; i < bones.values.size(); ++i)  // as a marrow space
    if (volume.values[i] == 60) bones.values[i] = 1;
  const VoxelMask before = bones;
  ASSERT_TRUE(move_to_half_maximum(volume, kDense_hu, bones, always));
  EXPECT_EQ(bones.values, before.values);
}

TEST(SurfaceLevel, CancellousBoneBehindAnOpeningStays) {
  // Cortex of 2.4 mm around cancellous bone of 300 HU. A hole of 4 mm goes through the cortex at +x.
  const auto shell = [](const Vec3& p) {
    const bool open = std::hypot(p.y(), p.z()) < 2.0 && p.x() > 0.0;
    const double r = p.norm(), blur_mm = 0.4;
    const double inside_hu = open ? 300.0 : 1500.0;
    return 40.0 + (inside_hu - 40.0) * edge(r - 9.0, blur_mm) + (300.0 - inside_hu) * edge(r - 6.6, blur_mm);
  };
  const HuVolume volume = edges_of({32, 32, 32}, Vec3(0.7, 0.7, 0.7), shell);
  const VoxelMask before = dense_voxels(volume);
  VoxelMask bones = before;
  ASSERT_TRUE(move_to_half_maximum(volume, kDense_hu, bones, always));
  for (std::size_t i = 0; i < bones.values.size(); ++i) {
    if (bones.values[i] == before.values[i]) continue;
    const std::array<int, 3> at{static_cast<int>(i % 32), static_cast<int>(i / 32 % 32), static_cast<int>(i / 1024)};
    EXPECT_GT(volume.position_mm(Vec3(at[0], at[1], at[2])).norm(), 8.6) << "a voxel far inside is gone";
  }
}

TEST(SurfaceLevel, BoneBeforeMetalStays) {
  // 2.1 mm of bone of 1200 HU before metal of 8000 HU: half way to the metal's HU would be 4000.
  const HuVolume volume = edges_of({24, 12, 12}, Vec3(0.7, 0.7, 0.7), [](const Vec3& p) {
    return p.x() < -2.4 ? 40.0 : p.x() < -0.3 ? 1200.0 : 8000.0;
  });
  const VoxelMask before = dense_voxels(volume);
  VoxelMask bones = before;
  ASSERT_TRUE(move_to_half_maximum(volume, kDense_hu, bones, always));
  EXPECT_EQ(bones.values, before.values);
}

TEST(SurfaceLevel, BonesThatTouchGetTheirGapBack) {
  // 1.6 mm apart, blurred by 0.6 mm: HU in the gap reach 400.
  const HuVolume volume = edges_of({40, 12, 12}, Vec3(0.5, 0.5, 0.5), [](const Vec3& p) {
    return 40.0 + 1460.0 * (1.0 - edge(p.x() - 0.8, 0.6) + edge(p.x() + 0.8, 0.6));
  });
  VoxelMask bones = dense_voxels(volume);
  for (std::size_t i = 0; i < bones.values.size(); ++i)
    if (i % 40 >= 20) bones.values[i] *= 2;
  ASSERT_EQ(std::ranges::count(bones.values, 0), 0) << "no voxel is below the threshold";
  const auto level = move_to_half_maximum(volume, kDense_hu, bones, always);
  ASSERT_TRUE(level);
  for (std::size_t i = 0; i < bones.values.size(); ++i) {
    const double x_mm = volume.position_mm(Vec3(static_cast<double>(i % 40), 0, 0)).x();
    const int bone = std::abs(x_mm) < 0.6 ? 0 : x_mm < 0.0 ? 1 : 2;
    if (std::abs(x_mm) < 0.6 || std::abs(x_mm) > 1.0) EXPECT_EQ(bones.values[i], bone) << x_mm;
  }
}

TEST(SurfaceLevel, BoneEndsWithTheScan) {
  for (const std::array<int, 3>& dims : {std::array{12, 12, 12}, {12, 12, 1}, {1, 1, 12}, {1, 1, 1}}) {
    HuVolume volume = edges_of(dims, Vec3(1.0, 1.0, 1.0), [](const Vec3& p) { return 1500.0 + 10.0 * p.sum(); });
    VoxelMask bones = dense_voxels(volume);
    ASSERT_TRUE(move_to_half_maximum(volume, kDense_hu, bones, always));
    EXPECT_EQ(std::ranges::count(bones.values, 1), static_cast<std::ptrdiff_t>(volume.count()));
  }
}

TEST(SurfaceLevel, StopsWhenTold) {
  const HuVolume volume = edges_of({24, 24, 24}, Vec3(0.7, 0.7, 0.7),
                                   [](const Vec3& p) { return 40.0 + 1460.0 * edge(p.norm() - 6.0, 0.8); });
  for (const double at : {0.0, 0.3, 0.6, 0.8}) {
    VoxelMask bones = dense_voxels(volume);
    const VoxelMask before = bones;
    const auto stopped = move_to_half_maximum(volume, kDense_hu, bones, [&](double done) { return done < at; });
    ASSERT_FALSE(stopped) << at;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
    EXPECT_EQ(bones.values, before.values);
  }
}

}  // namespace
}  // namespace osteon::imaging
