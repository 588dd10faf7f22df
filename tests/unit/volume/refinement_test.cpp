#include <gtest/gtest.h>

#include <random>

#include "common/volume/refinement.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

std::vector<Cut> strokes(int level) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> across(-12.0, 12.0), depth(-6.0, -0.5);
  std::vector<Cut> cuts;
  for (int i = 0; i < 8; ++i) {
    const Vec3 from{across(random), across(random), depth(random)};
    cuts.push_back(test::straight_cut(*find_tool(i % 2 ? "drill-3.2" : "burr-round-5"), from,
                                      from + Vec3{2.0, 1.0, -0.5}, {0.2, 0, -1}));
    cuts.back().level = level;
  }
  return cuts;
}

TEST(Refinement, BothMethodsGiveTheSameBone) {
  const Case bone = test::plain_block(30.0, 10.0, 0.5);
  for (const int level : {1, 2}) {
    SubVolumeField whole(bone, level);
    CutField local(bone, {});
    std::size_t resampled = 0;
    for (const Cut& cut : strokes(level)) {
      const RefineReport report = whole.apply(cut);
      EXPECT_EQ(report.cut.changed_leaves, local.apply(cut).changed_leaves);
      resampled += report.resampled;
    }
    EXPECT_EQ(whole.hash(), local.hash());
    EXPECT_EQ(whole.sub_volumes().size(), resampled);
    // The same f at every sample, whether it was resampled or not.
    const CoordBox box{{-40 << level, -37 << level, -22 << level}, {38 << level, 41 << level, 5 << level}};
    const Coord d = box.dims();
    std::vector<float> a(static_cast<std::size_t>(d.x) * static_cast<std::size_t>(d.y) * static_cast<std::size_t>(d.z)),
        b(a.size());
    whole.gather_solid(box, a);
    local.gather_solid(level, box, b);
    EXPECT_EQ(a, b);
    EXPECT_GT(whole.memory_bytes(), 2 * local.memory_bytes());
  }
}

TEST(Refinement, ASubVolumeIsResampledOnce) {
  SubVolumeField whole(test::plain_block(30.0, 10.0, 0.5), 1);
  const Cut cut = strokes(1)[0];
  EXPECT_GT(whole.apply(cut).resampled, 0u);
  const std::size_t memory = whole.memory_bytes();
  EXPECT_EQ(whole.apply(cut).resampled, 0u);
  EXPECT_EQ(whole.memory_bytes(), memory);
}

TEST(Refinement, CountsAreasThatDoNotTouch) {
  EXPECT_EQ(unconnected_areas({}, 8), 0u);
  const std::vector<Coord> cubes{{0, 0, 0}, {8, 8, 8}, {8, 8, 16}, {32, 0, 0}, {32, 0, 0}, {0, 24, 0}};
  EXPECT_EQ(unconnected_areas(cubes, 8), 3u);
}

}  // namespace
}  // namespace osteon
