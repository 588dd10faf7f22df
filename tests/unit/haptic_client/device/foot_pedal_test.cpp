// Pedals: the switch's reports, and the travel of the proportional one.
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
  for (const auto& [share, value] :
       {std::pair{0.05, 0.0}, {0.1, 0.0}, {0.5, 0.5}, {0.3, 0.25}, {0.9, 1.0}, {1.0, 1.0}}) {
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
  axis.take(0.2);
  EXPECT_EQ(axis.value(), 0.0);
  axis.take(1.0);
  EXPECT_EQ(axis.value(), 0.0);
  EXPECT_FALSE(axis.armed());
  EXPECT_FALSE(axis.elsewhere());
  axis.take(0.01);
  axis.take(0.5);
  EXPECT_NEAR(axis.value(), 0.5, 1e-12);
  axis.forget();
  EXPECT_EQ(axis.value(), 0.0);
  axis.take(0.2);
  EXPECT_EQ(axis.value(), 0.0);
}

// A pedal that rests at the other end, or in the middle, passes the beginning of its travel when it is pressed. If that
// counted as released, the spindle would turn as soon as the foot leaves it.
TEST(FootPedal, TurnsNothingWhereItRestsElsewhere) {
  for (const bool inverted : {false, true}) {
    for (const double rest : {1.0, 0.9, 0.5}) {
      PedalAxis axis({.inverted = inverted});
      for (int press = 0; press < 3; ++press)
        for (const double way : {rest, 0.3, 0.0, 0.0, 0.3, rest}) {
          axis.take(inverted ? 1.0 - way : way);
          EXPECT_EQ(axis.value(), 0.0) << rest << ' ' << way;
          EXPECT_FALSE(axis.armed());
          EXPECT_TRUE(axis.elsewhere());
        }
      axis.forget();
      EXPECT_FALSE(axis.elsewhere());
    }
  }
}

TEST(FootPedal, SwitchAndAxisAreChosenByWords) {
  for (const auto& [word, switches] : {std::pair{"", 7}, {"left", 1}, {"middle", 2}, {"right", 4}}) {
    const auto options = read_pedal_switch(word);
    ASSERT_TRUE(options) << word;
    EXPECT_FALSE(options->proportional);
    EXPECT_EQ(options->switches, switches);
  }
  EXPECT_FALSE(read_pedal_switch("both"));
  struct Pedals {
    std::string_view words;
    int spindle, irrigation, suction;
  };
  for (const Pedals& pedals : {Pedals{"left:irrigation-right", 1, 4, 0},
                               {"irrigation-right", 3, 4, 0},
                               {"suction-middle", 5, 0, 2},
                               {"suction-left:irrigation-middle", 4, 2, 1},
                               {"irrigation-left:right:suction-middle", 4, 1, 2}}) {
    const auto options = read_pedal_switch(pedals.words);
    ASSERT_TRUE(options) << pedals.words;
    EXPECT_EQ(options->switches, pedals.spindle) << pedals.words;
    EXPECT_EQ(options->irrigation, pedals.irrigation) << pedals.words;
    EXPECT_EQ(options->suction, pedals.suction) << pedals.words;
  }
  for (const char* wrong : {"left:", ":left", "left:right", "left:irrigation-left", "irrigation-left:irrigation-right",
                            "irrigation-", "irrigation", "suction-left:left:right"})
    EXPECT_FALSE(read_pedal_switch(wrong)) << wrong;

  struct Report {
    std::string_view words;
    bool inverted;
    int page, usage;  // 0: none
  };
  for (const Report& said : {Report{"", false, 0, 0},
                             {"inverted", true, 0, 0},
                             {"z", false, 1, 0x32},
                             {"rz:inverted", true, 1, 0x35},
                             {"inverted:0x30", true, 1, 0x30},
                             {"54", false, 1, 0x36},
                             {"brake", false, 2, 0xc5}}) {
    const auto options = read_pedal_axis(said.words);
    ASSERT_TRUE(options) << said.words;
    EXPECT_TRUE(options->proportional);
    EXPECT_EQ(options->axis.inverted, said.inverted) << said.words;
    ASSERT_EQ(options->axis_usage.has_value(), said.usage != 0) << said.words;
    if (said.usage == 0) continue;
    EXPECT_EQ(options->axis_usage->page, said.page) << said.words;
    EXPECT_EQ(options->axis_usage->usage, said.usage) << said.words;
  }
  for (const char* wrong :
       {"upside-down", "z:x", "inverted:inverted", "z:", ":z", "0x", "0", "0x10000", "z inverted"}) {
    const auto options = read_pedal_axis(wrong);
    ASSERT_FALSE(options) << wrong;
    EXPECT_EQ(options.error().message,
              std::string("--device pedal-axis:") + wrong +
                  ": what follows must be \"inverted\", an axis (accelerator, brake, throttle, slider, "
                  "z, rz, x, y, rx, ry, or a HID usage such as 0x32), or both joined by \":\"");
  }
}

}  // namespace
}  // namespace osteon::haptic
