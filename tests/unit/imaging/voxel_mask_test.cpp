#include "common/imaging/voxel_mask.hpp"

#include <gtest/gtest.h>

#include <random>

#include "common/imaging/components.hpp"

namespace osteon::imaging {
namespace {

bool always(double) { return true; }

VoxelMask random_mask(std::array<int, 3> dims, double share, std::uint32_t seed) {
  VoxelMask mask(dims);
  std::mt19937 random(seed);
  for (auto& value : mask.values) value = std::uniform_real_distribution<double>(0.0, 1.0)(random) < share ? 1 : 0;
  return mask;
}

// The definition, evaluated voxel by voxel.
bool is_near(const VoxelMask& mask, const Vec3& spacing_mm, double radius_mm, int x, int y, int z) {
  for (int k = 0; k < mask.dims[2]; ++k)
    for (int j = 0; j < mask.dims[1]; ++j)
      for (int i = 0; i < mask.dims[0]; ++i)
        if (mask.at(i, j, k) != 0 &&
            spacing_mm.cwiseProduct(Vec3(i - x, j - y, k - z)).norm() <= radius_mm * (1.0 + 1e-7))
          return true;
  return false;
}

TEST(WithinMm, IsTheDefinitionOnAnisotropicVoxels) {
  for (std::uint32_t seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    const auto size = [&] { return std::uniform_int_distribution<int>(1, 11)(random); };
    const auto length = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    const VoxelMask mask = random_mask({size(), size(), size()}, length(0.0, 0.1), seed);
    const Vec3 spacing(length(0.3, 3.0), length(0.3, 3.0), length(0.3, 3.0));
    const double radius = length(0.1, 5.0);
    const auto near = within_mm(mask, spacing, radius, always);
    ASSERT_TRUE(near);
    for (int z = 0; z < mask.dims[2]; ++z)
      for (int y = 0; y < mask.dims[1]; ++y)
        for (int x = 0; x < mask.dims[0]; ++x)
          ASSERT_EQ(near->at(x, y, z) != 0, is_near(mask, spacing, radius, x, y, z)) << seed;
  }
}

TEST(WithinMm, ARadiusOfWholeVoxelsIncludesTheLastOne) {
  VoxelMask mask({9, 9, 9});
  mask.at(4, 4, 4) = 1;
  const auto near = within_mm(mask, Vec3::Constant(0.1), 0.3, always);
  ASSERT_TRUE(near);
  EXPECT_EQ(near->at(7, 4, 4), 1);
  EXPECT_EQ(near->at(4, 4, 1), 1);
  EXPECT_EQ(near->at(8, 4, 4), 0);
  EXPECT_EQ(near->at(6, 6, 6), 0);
}

TEST(WithinMm, StopsWhenAsked) {
  const auto near = within_mm(VoxelMask({4, 4, 4}), Vec3::Ones(), 2.0, [](double) { return false; });
  ASSERT_FALSE(near);
  EXPECT_EQ(near.error().code, ErrorCode::cancelled);
}

// Counts components by painting one voxel at a time.
std::uint32_t count_by_painting(VoxelMask mask, bool corners) {
  std::uint32_t count = 0;
  std::vector<std::array<int, 3>> waiting;
  for (int z = 0; z < mask.dims[2]; ++z)
    for (int y = 0; y < mask.dims[1]; ++y)
      for (int x = 0; x < mask.dims[0]; ++x) {
        if (mask.at(x, y, z) == 0) continue;
        ++count;
        mask.at(x, y, z) = 0;
        waiting.push_back({x, y, z});
        while (!waiting.empty()) {
          const auto c = waiting.back();
          waiting.pop_back();
          for (int d = 0; d < 27; ++d) {
            const std::array<int, 3> s{d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1};
            if (!corners && std::abs(s[0]) + std::abs(s[1]) + std::abs(s[2]) != 1) continue;
            const std::array<int, 3> n{c[0] + s[0], c[1] + s[1], c[2] + s[2]};
            bool inside = true;
            for (std::size_t axis = 0; axis < 3; ++axis) inside = inside && n[axis] >= 0 && n[axis] < mask.dims[axis];
            if (!inside || mask.at(n[0], n[1], n[2]) == 0) continue;
            mask.at(n[0], n[1], n[2]) = 0;
            waiting.push_back(n);
          }
        }
      }
  return count;
}

TEST(FindComponents, CountsAsPaintingDoes) {
  std::bitset<256> one;
  one.set(1);
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    const VoxelMask mask = random_mask({13, 7, 6}, 0.1 + 0.01 * seed, seed);
    for (const bool corners : {false, true}) {
      const auto found = find_components(mask, one, corners ? Connectivity::corners : Connectivity::faces, always);
      ASSERT_TRUE(found);
      EXPECT_EQ(found->count, count_by_painting(mask, corners)) << seed;
      std::int64_t voxels = 0;
      for (const std::int64_t n : found->voxels()) voxels += n;
      EXPECT_EQ(voxels, std::ranges::count(mask.values, std::uint8_t{1}));
    }
  }
}

TEST(VoxelMask, APartHasItsVoxelsAndCroppingCanBeStoppedBeforeEachSlice) {
  VoxelMask mask({4, 5, 6});
  for (std::size_t i = 0; i < mask.values.size(); ++i) mask.values[i] = static_cast<std::uint8_t>(i);
  const std::array<int, 3> first{1, 0, 2}, last{3, 3, 4};
  int questions = 0;
  const auto part = cropped(mask, first, last, [&](double) { return ++questions > 0; });
  ASSERT_TRUE(part);
  ASSERT_EQ(part->dims, (std::array<int, 3>{3, 4, 3}));
  for (int slice = 0; slice < 3; ++slice)
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 3; ++column)
        EXPECT_EQ(part->at(column, row, slice), mask.at(column + 1, row, slice + 2));
  EXPECT_EQ(questions, 3);
  for (int stop = 1; stop <= 3; ++stop) {
    int asked = 0;
    const auto stopped = cropped(mask, first, last, [&](double) { return ++asked < stop; });
    ASSERT_FALSE(stopped) << stop;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace osteon::imaging
