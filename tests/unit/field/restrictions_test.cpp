#include "common/field/restrictions.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace osteon {
namespace {

Digest digest(std::uint8_t n) {
  Digest out;
  out.bytes.fill(n);
  return out;
}

Cut cut_at(std::initializer_list<std::array<std::int32_t, 3>> points, std::uint8_t tool = 1) {
  Cut cut;
  cut.tool = digest(tool);
  for (const auto& point : points) cut.path.push_back({.position = point});
  return cut;
}

TEST(ZoneLimit, IsABall) {
  const ZoneLimit zone{{1000, -2000, 3000}, 500};
  EXPECT_TRUE(zone.contains({1000, -2000, 3000}));
  EXPECT_TRUE(zone.contains({1500, -2000, 3000})) << "its surface belongs to the zone";
  EXPECT_FALSE(zone.contains({1501, -2000, 3000}));
  EXPECT_TRUE(zone.contains({1300, -2400, 3000})) << "3 4 5";
  EXPECT_FALSE(zone.contains({1301, -2400, 3000}));
  EXPECT_FALSE(zone.contains({1400, -2400, 3400})) << "in the cube, but not in the ball";
}

// At the largest possible distances, squares do not overflow.
TEST(ZoneLimit, HoldsAtTheEndsOfTheNumbers) {
  constexpr std::int32_t kLow = std::numeric_limits<std::int32_t>::min(),
                         kHigh = std::numeric_limits<std::int32_t>::max();
  const ZoneLimit far{{kLow, kLow, kLow}, 1 << 30};
  EXPECT_FALSE(far.contains({kHigh, kHigh, kHigh}));
  EXPECT_FALSE(far.contains({0, 0, 0}));
  EXPECT_TRUE(far.contains({kLow + (1 << 30), kLow, kLow}));
  EXPECT_FALSE(far.contains({kLow + (1 << 30), kLow + 1, kLow}));
}

TEST(Restrictions, WhatItForbids) {
  const Cut cut = cut_at({{0, 0, 0}, {100, 0, 0}});
  EXPECT_EQ(breach({}, cut), Rejection::none);
  EXPECT_EQ(breach({.force_limit = 1, .words = "gently"}, cut), Rejection::none) << "limits the force, not the cut";
  EXPECT_EQ(breach({.stopped = true}, cut), Rejection::frozen);
  EXPECT_EQ(breach({.taken_by = {3}}, cut), Rejection::taken);
  EXPECT_EQ(breach({.stopped = true, .taken_by = {3}}, cut), Rejection::frozen);
  EXPECT_EQ(breach({.tools = {digest(1), digest(2)}}, cut), Rejection::none);
  EXPECT_EQ(breach({.tools = {digest(0), digest(2)}}, cut), Rejection::forbidden_tool);
  EXPECT_EQ(breach({.zone = ZoneLimit{{0, 0, 0}, 100}}, cut), Rejection::none);
  EXPECT_EQ(breach({.zone = ZoneLimit{{0, 0, 0}, 99}}, cut), Rejection::zone) << "its last pose is outside";
  EXPECT_EQ(breach({.zone = ZoneLimit{{100, 0, 0}, 99}}, cut), Rejection::zone) << "its first pose is outside";
  EXPECT_TRUE(Restrictions{}.may_cut());
  EXPECT_FALSE((Restrictions{.stopped = true}.may_cut()));
  EXPECT_FALSE((Restrictions{.taken_by = {1}}.may_cut()));
  EXPECT_DOUBLE_EQ((Restrictions{.force_limit = 250}.force_limit_n()), 2.5);
}

TEST(Restrictions, NumbersBeyondItsLimitsAreNamed) {
  const auto named = [](const Restrictions& supervision, const std::string& field) {
    const Result<void> sound = check(supervision);
    ASSERT_FALSE(sound) << field;
    EXPECT_EQ(sound.error().code, ErrorCode::invalid_input);
    EXPECT_NE(sound.error().message.find("supervision." + field), std::string::npos) << sound.error().message;
  };
  std::vector<Digest> most;
  for (std::uint8_t n = 0; n < kMostLimitedTools; ++n) most.push_back(digest(n));
  EXPECT_TRUE(check({}));
  EXPECT_TRUE(check({.stopped = true,
                     .taken_by = {2},
                     .guide = {3},
                     .guide_share = 1000,
                     .force_limit = 10'000,
                     .zone = ZoneLimit{{1, 2, 3}, 1 << 30},
                     .tools = most,
                     .words = std::string(256, 'x')}));
  named({.guide_share = -1}, "guide_share");
  named({.guide_share = 1001}, "guide_share");
  named({.force_limit = -1}, "force_limit");
  named({.force_limit = 10'001}, "force_limit");
  named({.zone = ZoneLimit{{1, 2, 3}, 0}}, "zone.radius");
  named({.zone = ZoneLimit{{1, 2, 3}, (1 << 30) + 1}}, "zone.radius");
  named({.tools = {digest(2), digest(1)}}, "tools");
  named({.tools = {digest(1), digest(1)}}, "tools");
  most.push_back(digest(200));
  named({.tools = most}, "tools");
  named({.words = std::string(257, 'x')}, "words");
}

}  // namespace
}  // namespace osteon
