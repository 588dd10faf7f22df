// The game pad through SDL, with a pad that exists in SDL only.
#include "viewer_client/pad/game_pad.hpp"

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "tests/support/pad/virtual_pad.hpp"

namespace osteon {
namespace {

using Eigen::Vector2d;
using Change = GamePad::Change;

constexpr double kStep = 1.0 / 32767.0;  // of an axis

class GamePadTest : public testing::Test {
 protected:
  test::VirtualPad plug_;  // first: it hides the pads of this machine
  GamePad pad_;
};

TEST_F(GamePadTest, APadThatIsPluggedInIsOpenedAndItsControlsAreRead) {
  EXPECT_EQ(pad_.poll(), Change::none);
  EXPECT_FALSE(pad_.is_open());
  ASSERT_TRUE(plug_.plug_in());
  ASSERT_EQ(pad_.poll(), Change::opened);
  EXPECT_EQ(pad_.name(), "Virtual Pad");

  GamePadState held;
  held.left = Vector2d(0.5, 0.25);  // to the right and up
  held.right = Vector2d(-1.0, -0.75);
  held.right_trigger = 0.5;
  held.left_trigger = 1.0;
  held.a = held.shoulder = true;
  plug_.hold(held);
  EXPECT_EQ(pad_.poll(), Change::none);
  const GamePadState& read = pad_.state();
  EXPECT_NEAR((read.left - held.left).norm(), 0.0, 2 * kStep);
  EXPECT_NEAR((read.right - held.right).norm(), 0.0, 2 * kStep);
  EXPECT_NEAR(read.right_trigger, 0.5, 2 * kStep);
  EXPECT_NEAR(read.left_trigger, 1.0, 2 * kStep);
  EXPECT_TRUE(read.a && read.shoulder && !read.b);

  plug_.hold({});
  (void)pad_.poll();
  EXPECT_NEAR(read.right_trigger, 0.0, kStep);
  EXPECT_FALSE(read.a || read.b || read.shoulder);
}

TEST_F(GamePadTest, AnUnpluggedPadIsAtRestAndTheNextOneIsTaken) {
  ASSERT_TRUE(plug_.plug_in());
  ASSERT_EQ(pad_.poll(), Change::opened);
  GamePadState held;
  held.right_trigger = 1.0;
  plug_.hold(held);
  (void)pad_.poll();
  ASSERT_GT(pad_.state().right_trigger, 0.99);
  plug_.unplug();
  EXPECT_EQ(pad_.poll(), Change::lost);
  EXPECT_FALSE(pad_.is_open());
  EXPECT_EQ(pad_.state().right_trigger, 0.0);
  EXPECT_EQ(pad_.poll(), Change::none);
  pad_.rumble({1.0, 1.0});  // nobody is there
  ASSERT_TRUE(plug_.plug_in());
  EXPECT_EQ(pad_.poll(), Change::opened);
}

TEST_F(GamePadTest, TheMotorsGetTheirSharesOfFullStrength) {
  ASSERT_TRUE(plug_.plug_in());
  ASSERT_EQ(pad_.poll(), Change::opened);
  pad_.rumble({0.5, 0.25});
  ASSERT_FALSE(plug_.heard().empty());
  EXPECT_NEAR(plug_.heard().back().low, 0.5 * 65535, 1.0);
  EXPECT_NEAR(plug_.heard().back().high, 0.25 * 65535, 1.0);
  pad_.rumble({});
  EXPECT_TRUE(plug_.quiet());
}

TEST_F(GamePadTest, TheMotorsStopByThemselvesWhenNobodyAsksAnyMore) {
  ASSERT_TRUE(plug_.plug_in());
  ASSERT_EQ(pad_.poll(), Change::opened);
  pad_.rumble({1.0, 0.0});
  ASSERT_FALSE(plug_.quiet());
  std::this_thread::sleep_for(std::chrono::milliseconds(GamePad::kRumble_ms + 20));
  (void)pad_.poll();
  EXPECT_TRUE(plug_.quiet());
}

TEST(GamePadOfAProgram, TakesNoSignalsAndStopsTheMotorsAtItsEnd) {
  const auto handler = [](int signal) {
    struct sigaction action {};
    ::sigaction(signal, nullptr, &action);
    return action.sa_handler;
  };
  ::signal(SIGINT, SIG_DFL);  // A shell that starts the tests in the background has it ignored.
  test::VirtualPad plug;
  {
    GamePad pad;
    EXPECT_EQ(handler(SIGINT), SIG_DFL);
    EXPECT_EQ(handler(SIGTERM), SIG_DFL);
    ASSERT_TRUE(plug.plug_in());
    ASSERT_EQ(pad.poll(), Change::opened);
    pad.rumble({1.0, 1.0});
    ASSERT_FALSE(plug.quiet());
  }
  EXPECT_TRUE(plug.quiet());
}

}  // namespace
}  // namespace osteon
