// Table 8.1 of the dissertation: a hand-held drill at 1400 rpm.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string_view>

#include "common/sound/gearbox.hpp"

namespace osteon::sound {
namespace {

TEST(Gearbox, TableIsThatOfTheDissertation) {
  const std::map<std::string_view, double> table_hz = {
      {"output shaft", 23.33}, {"transfer shaft", 89.23}, {"motor shaft", 356.91}, {"output mesh", 1119.84},
      {"output spin", 74.66},  {"motor mesh", 4014.63},   {"motor spin", 267.64}};
  const std::vector<GearLine> lines = gear_table(Gearbox{}, 1400);
  for (const auto& [name, hz] : table_hz) {
    const auto line = std::ranges::find(lines, name, &GearLine::name);
    ASSERT_NE(line, lines.end()) << name;
    // The table rounds its ratios to four digits, and the spindle's frequency too.
    EXPECT_NEAR(line->hz, hz, 3e-4 * hz) << name;
  }
}

TEST(Gearbox, LinesFollowTheSpindle) {
  const std::vector<GearLine> slow = gear_table(Gearbox{}, 700), fast = gear_table(Gearbox{}, 1400);
  ASSERT_EQ(slow.size(), fast.size());
  for (std::size_t i = 0; i < slow.size(); ++i) EXPECT_DOUBLE_EQ(2.0 * slow[i].hz, fast[i].hz);
}

TEST(Gearbox, MotorsThirdHarmonicLiesWhereItWasHeard) {
  // 8.5.4: about 5500 Hz when running free, 5400 Hz when loaded, and a line near 1800 Hz, at a nominal 1400 rpm.
  const std::vector<GearLine> lines = gear_table(Gearbox{}, 1400);
  EXPECT_NEAR(std::ranges::find(lines, std::string_view("commutation x3"), &GearLine::name)->hz, 5450, 100);
  EXPECT_NEAR(std::ranges::find(lines, std::string_view("commutation"), &GearLine::name)->hz, 1800, 30);
}

}  // namespace
}  // namespace osteon::sound
