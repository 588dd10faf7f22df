// Windows of HU, against DICOM's formula.
#include "viewer_client/imaging/hu_window.hpp"

#include <gtest/gtest.h>

#include <array>

namespace osteon {
namespace {

TEST(HuWindow, IsLinearBetweenBlackAndWhite) {
  const HuWindow window{40.0, 400.0};  // from -160 to 240
  EXPECT_EQ(window.grey(-1000.0), 0);
  EXPECT_EQ(window.grey(-160.0), 0);
  EXPECT_EQ(window.grey(40.0), 128) << "127.5, rounded";
  EXPECT_EQ(window.grey(-60.0), 64) << "a quarter of 255: 63.75";
  EXPECT_EQ(window.grey(240.0), 255);
  EXPECT_EQ(window.grey(3000.0), 255);
  const std::array<float, 3> hu{-160.0f, -60.0f, 240.0f};
  std::array<std::uint8_t, 3> grey{};
  grey_of(hu, window, grey);
  EXPECT_EQ(grey, (std::array<std::uint8_t, 3>{0, 64, 255}));
}

TEST(HuWindow, ATableHasTheGreyOfEachHu) {
  const GreyTable greys({127.5, 255.0});  // from 0 to 255
  for (int hu = 0; hu < 256; ++hu) EXPECT_EQ(greys[static_cast<std::int16_t>(hu)], hu);
  EXPECT_EQ(greys[-1], 0);
  EXPECT_EQ(greys[-32768], 0);
  EXPECT_EQ(greys[256], 255);
  EXPECT_EQ(greys[32767], 255);
}

TEST(HuWindow, ADragToTheRightWidensItAndOneDownMakesTheImageDarker) {
  const HuWindow before{500.0, 2000.0};
  const HuWindow wider = dragged(before, 20.0, 0.0), darker = dragged(before, 0.0, 20.0);
  EXPECT_EQ(wider, (HuWindow{500.0, 2200.0})) << "10 HU for each pixel";
  EXPECT_EQ(darker, (HuWindow{700.0, 2000.0}));
  EXPECT_LT(darker.grey(500.0), before.grey(500.0));
  EXPECT_EQ(dragged(darker, 0.0, -20.0), before);
}

TEST(HuWindow, NoDragLeavesTheRange) {
  const HuWindow least = dragged(kBoneWindow, -1e6, -1e6), most = dragged(kBoneWindow, 1e6, 1e6);
  EXPECT_EQ(least, (HuWindow{kLeastLevel_hu, kLeastWidth_hu}));
  EXPECT_EQ(most, (HuWindow{kMostLevel_hu, kMostWidth_hu}));
}

}  // namespace
}  // namespace osteon
