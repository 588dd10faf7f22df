#include "common/imaging/window_level.hpp"

#include <gtest/gtest.h>

namespace osteon::imaging {
namespace {

// By hand from DICOM PS3.3, C.11.2.1.2.1: y = ((x - (c - 0.5)) / (w - 1) + 0.5) 255, black up to
// c - 0.5 - (w - 1) / 2, white above c - 0.5 + (w - 1) / 2.
TEST(WindowLevel, IsTheLinearFunctionOfTheStandard) {
  // The standard's note: c = 2048 and w = 4096 map 0 to black and 4095 to white, and all between onto the range.
  const Window whole{2048.0, 4096.0};
  EXPECT_EQ(grey_of(0.0, whole), 0);
  EXPECT_EQ(grey_of(4095.0, whole), 255);
  EXPECT_EQ(grey_of(4096.0, whole), 255);
  EXPECT_EQ(grey_of(2047.0, whole), 127);  // (2047 - 2047.5) / 4095 + 0.5 = 0.49988, times 255 is 127.47
  EXPECT_EQ(grey_of(2048.0, whole), 128);  // 127.53

  // c = 0 and w = 100: black up to -50, white above 49.
  const Window narrow{0.0, 100.0};
  EXPECT_EQ(grey_of(-50.0, narrow), 0);
  EXPECT_EQ(grey_of(-49.0, narrow), 3);   // 255 / 99 = 2.58
  EXPECT_EQ(grey_of(-25.0, narrow), 64);  // 25 times that: 64.39
  EXPECT_EQ(grey_of(48.0, narrow), 252);  // 252.42
  EXPECT_EQ(grey_of(49.0, narrow), 255);
}

TEST(WindowLevel, OfWidthOneIsAThreshold) {
  // The note again: c = 2048 and w = 1 are black up to 2047, and white from 2048 on.
  const Window one{2048.0, 1.0};
  EXPECT_EQ(grey_of(2047.0, one), 0);
  EXPECT_EQ(grey_of(2048.0, one), 255);
}

TEST(WindowLevel, TakesTheEndsOfTheRange) {
  for (const Window& window : {Window{}, Window{-32768.0, 1.0}, Window{32767.0, 65536.0}, Window{0.0, 2.0}}) {
    EXPECT_EQ(grey_of(-32768.0 - 65536.0, window), 0);
    EXPECT_EQ(grey_of(32768.0 + 65536.0, window), 255);
  }
}

}  // namespace
}  // namespace osteon::imaging
