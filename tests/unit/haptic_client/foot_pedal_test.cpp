// Pedals: the switch's reports and the proportional one's way.
#include "haptic_client/device/foot_pedal.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace osteon::haptic {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(FootPedal, SwitchReportsAreTwoBytes) {
  EXPECT_EQ(take_pedal_report(Bytes{0, 0}), std::uint8_t{0});
  EXPECT_EQ(take_pedal_report(Bytes{2, 0}), std::uint8_t{2});
  EXPECT_EQ(take_pedal_report(Bytes{0xff, 0xff}), std::uint8_t{7});
  EXPECT_FALSE(take_pedal_report(Bytes{2}));
  EXPECT_FALSE(take_pedal_report(Bytes{2, 0, 0}));
}

TEST(FootPedal, TheWayHasPlayAtBothEnds) {
  PedalAxis axis({.play = 0.1});
  axis.take(0.0);
  for (const auto& [share, value] : {std::pair{0.05, 0.0}, {0.1, 0.0}, {0.5, 0.5}, {0.3, 0.25}, {0.9, 1.0}, {1.0, 1.0}}) {
    axis.take(share);
    EXPECT_NEAR(axis.value(), value, 1e-12) << share;
  }
  PedalAxis inverted({.inverted = true, .play = 0.0});
  inverted.take(1.0);
  inverted.take(0.25);
  EXPECT_NEAR(inverted.value(), 0.75, 1e-12);
}

TEST(FootPedal, TurnsNothingUntilItWasReleased) {
  PedalAxis axis;
  axis.take(1.0);
  axis.take(0.5);
  EXPECT_EQ(axis.value(), 0.0);
  EXPECT_FALSE(axis.armed());
  axis.take(0.01);
  axis.take(0.5);
  EXPECT_GT(axis.value(), 0.0);
  axis.forget();
  EXPECT_EQ(axis.value(), 0.0);
  axis.take(0.5);
  EXPECT_EQ(axis.value(), 0.0);
}

}  // namespace
}  // namespace osteon::haptic
