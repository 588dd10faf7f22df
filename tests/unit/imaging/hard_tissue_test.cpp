#include "common/imaging/hard_tissue.hpp"

#include <gtest/gtest.h>

#include "common/imaging/calibration.hpp"
#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

struct Scene {
  HuVolume volume;
  VoxelMask bones;
};

Scene block(std::int16_t hu) {
  Scene s;
  s.volume.dims = {20, 20, 20};
  s.volume.values.assign(s.volume.count(), hu);
  s.bones = VoxelMask(s.volume.dims);
  std::ranges::fill(s.bones.values, std::uint8_t{1});
  return s;
}

HardTissue hard_tissue(const Scene& s, double metal_hu = kMetal_hu) {
  auto found = find_hard_tissue(s.volume, SparseMask(s.bones), kRho1995, metal_hu, always);
  EXPECT_TRUE(found);
  return std::move(*found);
}

Tissue at(const HardTissue& found, int x, int y, int z) { return static_cast<Tissue>(found.tissue.at(x, y, z)); }

TEST(HardTissue, ThereIsNoneInCompactBone) {
  const Scene s = block(1840);  // 0.131 + 0.001067 · 1840 = 2.094 g/cm3
  const HardTissue found = hard_tissue(s);
  EXPECT_TRUE(found.tissue.values.empty());
}

TEST(HardTissue, DenserThanCompactBoneIsEnamelAndFrom3000OnMetal) {
  Scene s = block(1200);
  s.volume.values[s.volume.index(3, 3, 3)] = 2500;
  s.volume.values[s.volume.index(10, 10, 10)] = 3000;
  const HardTissue found = hard_tissue(s);
  EXPECT_EQ(at(found, 3, 3, 3), Tissue::enamel);
  EXPECT_EQ(at(found, 10, 10, 10), Tissue::metal);
  EXPECT_EQ(at(found, 5, 5, 5), Tissue::none);
  EXPECT_NEAR(found.metal_cm3, 0.001, 1e-12);
  EXPECT_NEAR(found.enamel_cm3, 0.001, 1e-12);
}

TEST(HardTissue, TheLimitOfMetalMayBeLower) {
  Scene s = block(1200);
  s.volume.values[s.volume.index(3, 3, 3)] = 1499;
  s.volume.values[s.volume.index(10, 10, 10)] = 1500;  // less dense than compact bone
  s.volume.values[s.volume.index(17, 17, 17)] = 2500;
  const HardTissue found = hard_tissue(s, 1500.0);
  EXPECT_EQ(at(found, 3, 3, 3), Tissue::none);
  EXPECT_EQ(at(found, 10, 10, 10), Tissue::metal);
  EXPECT_EQ(at(found, 17, 17, 17), Tissue::metal);
  EXPECT_NEAR(found.metal_cm3, 0.002, 1e-12);
  EXPECT_EQ(found.enamel_cm3, 0.0);
}

TEST(HardTissue, TheBlurredEdgeOfMetalIsMetal) {
  Scene s = block(1200);
  s.volume.values[s.volume.index(10, 10, 10)] = 3071;
  s.volume.values[s.volume.index(11, 10, 10)] = 2400;
  s.volume.values[s.volume.index(12, 10, 10)] = 1900;
  s.volume.values[s.volume.index(13, 10, 10)] = 1900;
  const HardTissue found = hard_tissue(s);
  EXPECT_EQ(at(found, 11, 10, 10), Tissue::metal);
  EXPECT_EQ(at(found, 12, 10, 10), Tissue::metal);
  EXPECT_EQ(at(found, 13, 10, 10), Tissue::enamel);
  EXPECT_EQ(at(found, 9, 10, 10), Tissue::none) << "bone beside metal stays bone";
}

TEST(HardTissue, OnlyWhatIsKeptCounts) {
  Scene s = block(1200);
  s.volume.values[s.volume.index(10, 10, 10)] = 3071;
  s.bones.at(10, 10, 10) = 0;
  const HardTissue found = hard_tissue(s);
  EXPECT_EQ(found.metal_cm3, 0.0);
}

}  // namespace
}  // namespace osteon::imaging
