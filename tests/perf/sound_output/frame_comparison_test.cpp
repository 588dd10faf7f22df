#include "tests/perf/sound_output/frame_comparison.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace osteon::test {
namespace {

std::vector<Frame> sound(std::size_t frames) {
  std::vector<Frame> sound;
  for (std::size_t i = 0; i < frames; ++i)
    sound.push_back({static_cast<float>(std::cos(0.1 * static_cast<double>(i))), 0.25F});
  // No two places of it look alike.
  for (std::size_t i = 0; i < frames; ++i) sound[i].right += 1e-6F * static_cast<float>(i);
  return sound;
}

TEST(FrameComparison, SilenceBeforeTheSoundDoesNotCount) {
  const std::vector<Frame> rendered = sound(1000);
  std::vector<Frame> heard(77);
  heard.insert(heard.end(), rendered.begin(), rendered.end() - 100);
  const FrameComparison found = compare(rendered, heard);
  EXPECT_EQ(found.equal, 900U);
  EXPECT_EQ(found.gaps.size() + found.silent + found.jumps + found.missing + found.differing, 0U);
}

TEST(FrameComparison, InsertedSilenceIsAGap) {
  const std::vector<Frame> rendered = sound(1000);
  std::vector<Frame> heard = rendered;
  heard.insert(heard.begin() + 700, 30, Frame{});
  heard.insert(heard.begin() + 300, 20, Frame{});
  heard.insert(heard.begin(), 40, Frame{});
  const FrameComparison found = compare(rendered, heard);
  EXPECT_EQ(found.equal, 1000U);
  EXPECT_EQ(found.gaps, (std::vector<std::size_t>{340, 760}));
  EXPECT_EQ(found.silent, 50U);
  EXPECT_EQ(found.jumps + found.differing, 0U);
}

TEST(FrameComparison, MissingFramesAreAJump) {
  const std::vector<Frame> rendered = sound(1000);
  std::vector<Frame> heard = rendered;
  heard.erase(heard.begin() + 500, heard.begin() + 540);
  const FrameComparison found = compare(rendered, heard);
  EXPECT_EQ(found.equal, 960U);
  EXPECT_EQ(found.jumps, 1U);
  EXPECT_EQ(found.missing, 40U);
  EXPECT_EQ(found.gaps.size() + found.differing, 0U);
}

TEST(FrameComparison, OneBitCounts) {
  const std::vector<Frame> rendered = sound(1000);
  std::vector<Frame> heard = rendered;
  heard[400].left = std::nextafter(heard[400].left, 2.0F);
  const FrameComparison found = compare(rendered, heard);
  EXPECT_EQ(found.equal, 999U);
  EXPECT_EQ(found.differing, 1U);
  EXPECT_EQ(found.gaps.size() + found.jumps, 0U);
}

}  // namespace
}  // namespace osteon::test
