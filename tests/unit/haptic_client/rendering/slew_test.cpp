// Tests which part of a force is growth, and how a part must change so that the whole grows slowly.
#include "haptic_client/rendering/slew.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/scenes/random.hpp"

namespace osteon::haptic {
namespace {

TEST(Slew, LesseningIsNoGrowth) {
  const Vec3 now(4, 0, 0);
  EXPECT_EQ(growth(Vec3::Zero(), now).norm(), 0.0);
  EXPECT_EQ(growth(Vec3(1, 0, 0), now).norm(), 0.0);
  EXPECT_EQ(growth(Vec3(6, 0, 0), now), Vec3(2, 0, 0));
  EXPECT_EQ(growth(Vec3(3, 1, 0), now), Vec3(0, 1, 0));
  EXPECT_EQ(growth(Vec3(-1, 0, 0), now), Vec3(-1, 0, 0));  // it falls to zero at once, and grows from there
  EXPECT_EQ(growth(Vec3(1, 2, 3), Vec3::Zero()), Vec3(1, 2, 3));
}

// A hand is guided by 2 N against bone that holds it with the same force. The bone then holds it with half of that, or
// not at all.
TEST(Slew, APullIsLessenedAsWhatHeldItBack) {
  const Vec3 pull(2, 0, 0);
  EXPECT_EQ(held_to(0.25, pull, -pull, Vec3::Zero()), pull);
  EXPECT_EQ(held_to(0.25, pull, -0.5 * pull, Vec3::Zero()), Vec3(1.25, 0, 0));
  EXPECT_EQ(held_to(0.25, pull, Vec3::Zero(), Vec3::Zero()), Vec3(0.25, 0, 0));
  EXPECT_EQ(held_to(0.0, pull, Vec3::Zero(), Vec3(3, 0, 0)), pull);  // a force below the one before is shown in full
}

TEST(Slew, TheWholeNeverGrowsFasterNorLargerThanItMay) {
  test::Random random(5);
  double most_n = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    const Vec3 before = random.in_cube(4.0), rest = random.in_cube(4.0), pull = random.in_cube(4.0);
    const double may_n = random.unit();
    const Vec3 whole = rest + held_to(may_n, pull, rest, before);
    ASSERT_LE(growth(whole, before).norm(), may_n + 1e-12);
    ASSERT_LE(whole.norm(), std::max(before.norm(), (rest + pull).norm()) + 1e-12);
    most_n = std::max(most_n, growth(rest + pull, before).norm());
  }
  EXPECT_GT(most_n, 3.0) << "if the pull does not change";
}

}  // namespace
}  // namespace osteon::haptic
