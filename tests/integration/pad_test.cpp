// The window with a game pad that exists in SDL only, and the real programs as the window's children.
#include <gtest/gtest.h>

#include <QApplication>
#include <QCursor>
#include <QLabel>
#include <QStatusBar>
#include <QTest>
#include <QToolButton>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <string>

#include "tests/integration/window_bench.hpp"
#include "tests/support/pad/busy_sdl.hpp"
#include "tests/support/pad/virtual_pad.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

class PadTest : public test::WindowBench {
 protected:
  void SetUp() override {
    plug_ = std::make_unique<test::VirtualPad>();  // before the window: it hides the pads of this machine
    WindowBench::SetUp();
    open();
  }
  void TearDown() override {
    WindowBench::TearDown();
    plug_.reset();
  }
  [[nodiscard]] bool says(const char* words) const { return window_->statusBar()->currentMessage().contains(words); }
  // Holds sticks, triggers and buttons like this until the condition holds. A window that was busy ends a push, and an
  // undo takes back one push only. So a person lets go and does it again.
  template <class Condition>
  [[nodiscard]] bool hold_until(const GamePadState& held, Condition condition) {
    constexpr int kTimes = 10;
    for (int time = 0; time < kTimes; ++time) {
      plug_->hold(held);
      bool pushed = false;
      const auto settled = [&] {
        pushed |= view_->pointer().pushing();
        return condition() || (pushed && !view_->pointer().pushing());
      };
      if (until(settled, 10s) && condition()) return true;
      plug_->hold({});
      QTest::qWait(200);
    }
    return false;
  }
  [[nodiscard]] static GamePadState pulled(double trigger) {
    GamePadState hand;
    hand.right_trigger = trigger;
    return hand;
  }

  std::unique_ptr<test::VirtualPad> plug_;
};

TEST_F(PadTest, APadDrillsRumblesUndoesAndLetsGoWhenItIsUnplugged) {
  // Plugged in while the room is open.
  ASSERT_TRUE(plug_->plug_in());
  ASSERT_TRUE(until([&] { return says("Virtual Pad: choose a tool."); })) << problem();
  click_tool("drill");
  ToolPointer& pointer = view_->pointer();
  EXPECT_FALSE(pointer.on_bone());

  // The left stick brings the tool onto the bone, and moves it to the picture's right: seen from above, with the face
  // upward, that is the patient's right, -x.
  GamePadState hand;
  hand.left.x() = 1.0;
  plug_->hold(hand);
  ASSERT_TRUE(until([&] { return pointer.on_bone(); })) << problem();
  const double from_x = pointer.input().target_mm.x();
  ASSERT_TRUE(until([&] { return pointer.input().target_mm.x() < from_x - 3.0; })) << problem();
  plug_->hold({});
  EXPECT_TRUE(until([&] { return label("device") == "Game pad"; }));
  EXPECT_EQ(pointer.input().source, PointerSource::game_pad);
  EXPECT_TRUE(plug_->quiet()) << "nothing is touched yet";

  // The trigger pushes as hard as it is pulled, and the motors follow the force.
  const double wheel_n = pointer.push_n();
  ASSERT_TRUE(hold_until(pulled(0.8), [&] { return pointer.pushing(); })) << problem();
  constexpr double kPulled = GamePadMapping::kTriggerPulled;
  EXPECT_NEAR(pointer.push_n(), 1.0 + 39.0 * (0.8 - kPulled) / (1.0 - kPulled), 0.01);
  ASSERT_TRUE(hold_until(pulled(0.8), [&] { return cut(); })) << problem();
  EXPECT_TRUE(hold_until(pulled(0.8), [&] { return !plug_->quiet(); }));
  // 30 N are the device's, so 20 N or more are √(2/3) of the motor.
  EXPECT_TRUE(hold_until(pulled(0.8), [&] {
    const auto heard = plug_->heard();
    return std::ranges::any_of(heard, [](const auto& motors) { return motors.low > 0.8 * 65535; });
  }));

  // Let go, the tool comes out and the motors rest. The wheel's push is back.
  plug_->hold({});
  EXPECT_TRUE(until([&] { return !pointer.pushing() && plug_->quiet() && pointer.push_n() == wheel_n; }));
  hand = {};
  hand.b = true;
  EXPECT_TRUE(hold_until(hand, [&] { return !cut(); })) << problem();
  plug_->hold({});

  // A toggles the spindle.
  ASSERT_TRUE(pointer.spindle());
  hand = {};
  hand.a = true;
  plug_->hold(hand);
  EXPECT_TRUE(until([&] { return !pointer.spindle(); }));
  plug_->hold({});

  // Unplugged while it pushes.
  QTest::qWait(100);
  ASSERT_TRUE(hold_until(pulled(1.0), [&] { return pointer.pushing() && pointer.push_n() > 39.9; })) << problem();
  plug_->unplug();
  EXPECT_TRUE(until([&] { return !pointer.pushing(); }));
  EXPECT_TRUE(says("Virtual Pad was unplugged. It no longer leads the tool.")) << problem();
  EXPECT_TRUE(until([&] { return label("device") == "Pointer"; }));
  EXPECT_EQ(pointer.push_n(), wheel_n);
}

TEST_F(PadTest, APushEndsWhileThePadDoesNotAnswerAndNeedsAFreshPullThen) {
  ASSERT_TRUE(plug_->plug_in());
  ASSERT_TRUE(until([&] { return says("Virtual Pad: choose a tool."); })) << problem();
  click_tool("drill");
  ToolPointer& pointer = view_->pointer();
  GamePadState hand;
  hand.left.x() = 1.0;
  plug_->hold(hand);
  ASSERT_TRUE(until([&] { return pointer.on_bone(); })) << problem();
  plug_->hold({});
  QTest::qWait(100);
  ASSERT_TRUE(hold_until(pulled(0.8), [&] { return pointer.pushing(); })) << problem();

  test::BusySdl busy;
  EXPECT_TRUE(until([&] { return !pointer.pushing(); }, 15s));
  EXPECT_TRUE(busy.end()) << "the push ended only when SDL went on";
  QTest::qWait(300);
  EXPECT_FALSE(pointer.pushing()) << "the trigger is still pulled";
  plug_->hold({});
  QTest::qWait(300);
  EXPECT_TRUE(hold_until(pulled(0.8), [&] { return pointer.pushing(); })) << problem();
}

}  // namespace
}  // namespace osteon
