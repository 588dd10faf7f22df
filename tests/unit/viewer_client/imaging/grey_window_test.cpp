#include "viewer_client/imaging/grey_window.hpp"

#include <gtest/gtest.h>

namespace osteon {
namespace {

// DICOM PS3.3, C.11.2.1.2.1: in a window of 128 +- 128, y = ((x - 127.5) / 255 + 0.5) 255 = x.
TEST(GreyWindow, ShowsAGreyForEachHuInAWindowOf256) {
  const GreyTable greys({128.0, 256.0});
  for (int hu = 0; hu < 256; ++hu) EXPECT_EQ(greys[static_cast<std::int16_t>(hu)], hu);
  EXPECT_EQ(greys[-1], 0);
  EXPECT_EQ(greys[-32768], 0);
  EXPECT_EQ(greys[256], 255);
  EXPECT_EQ(greys[32767], 255);
}

TEST(GreyWindow, OfOneHuHasBlackAndWhiteOnly) {
  const GreyTable greys({300.0, 1.0});
  EXPECT_EQ(greys[299], 0);
  EXPECT_EQ(greys[300], 255);
}

TEST(GreyWindow, GetsWiderToTheRightAndDarkerDownwards) {
  const GreyWindow wider = dragged(kBoneWindow, 10.0, 0.0), lower = dragged(kBoneWindow, 0.0, 10.0);
  EXPECT_GT(wider.width_hu, kBoneWindow.width_hu);
  EXPECT_EQ(wider.centre_hu, kBoneWindow.centre_hu);
  EXPECT_EQ(lower.width_hu, kBoneWindow.width_hu);
  EXPECT_LT(GreyTable(lower)[400], GreyTable(kBoneWindow)[400]);
  // There and back.
  EXPECT_DOUBLE_EQ(dragged(lower, 0.0, -10.0).centre_hu, kBoneWindow.centre_hu);
}

TEST(GreyWindow, StaysWithinItsLimits) {
  EXPECT_EQ(dragged(kBoneWindow, -1e6, 0.0).width_hu, kLeastWidth_hu);
  EXPECT_EQ(dragged(kBoneWindow, 1e6, 0.0).width_hu, kMostWidth_hu);
  // From the narrowest one a drag leads out again.
  EXPECT_GT(dragged({0.0, kLeastWidth_hu}, 5.0, 0.0).width_hu, kLeastWidth_hu);
}

}  // namespace
}  // namespace osteon
