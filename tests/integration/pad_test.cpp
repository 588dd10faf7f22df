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

#include "tests/integration/desk.hpp"
#include "tests/support/pad/virtual_pad.hpp"
#include "viewer_client/desktop/bone_view.hpp"
#include "viewer_client/desktop/main_window.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

class PadTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(desk_.stands()) << "Xvfb, of Debian's package xvfb, did not start";
    ::setenv("PULSE_SERVER", ("unix:" + (desk_.temp() / "nobody").string()).c_str(), 1);
    window_ = std::make_unique<MainWindow>();
    window_->setGeometry(0, 0, 1280, 900);
    window_->show();
    window_->activateWindow();
    ASSERT_TRUE(QTest::qWaitForWindowActive(window_.get(), 30000));
    view_ = window_->findChild<BoneView*>("bone");
    ASSERT_NE(view_, nullptr);
    window_->practise(desk_.bone());
    ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << said();
    view_->look_from(Vec3(0.05, -0.05, 1));
    ASSERT_TRUE(until([&] { return label("device") == "Pointer"; })) << said();
  }
  void TearDown() override { window_.reset(); }

  template <class Condition>
  [[nodiscard]] static bool until(Condition condition) {
    const auto deadline = std::chrono::steady_clock::now() + 60s;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      QTest::qWait(20);
    }
    return true;
  }
  [[nodiscard]] QString label(const char* name) const {
    const auto* found = window_->findChild<QLabel*>(name);
    return found != nullptr ? found->text() : QString();
  }
  [[nodiscard]] std::string said() const { return window_->statusBar()->currentMessage().toStdString(); }
  [[nodiscard]] bool says(const char* words) const { return window_->statusBar()->currentMessage().contains(words); }
  [[nodiscard]] bool cut() const { return view_->updater() != nullptr && view_->updater()->surface().any_cut_face(); }
  void take_drill() {
    auto* button = window_->findChild<QToolButton*>("drill");
    ASSERT_NE(button, nullptr);
    QTest::mouseClick(button, Qt::LeftButton);
  }

  test::Desk desk_;
  test::VirtualPad plug_;  // before the window: it hides the pads of this machine
  std::unique_ptr<MainWindow> window_;
  BoneView* view_ = nullptr;
};

TEST_F(PadTest, APadDrillsRumblesUndoesAndLetsGoWhenItIsUnplugged) {
  // Plugged in while the room is open.
  ASSERT_TRUE(plug_.plug_in());
  ASSERT_TRUE(until([&] { return says("Virtual Pad: choose a tool."); })) << said();
  take_drill();
  ToolPointer& pointer = view_->pointer();
  EXPECT_FALSE(pointer.on_bone());

  // The left stick brings the tool onto the bone, and moves it to the picture's right: seen from above, with the face
  // upward, that is the patient's right, -x.
  PadState hand;
  hand.left.x() = 1.0;
  plug_.hold(hand);
  ASSERT_TRUE(until([&] { return pointer.on_bone(); })) << said();
  const double from_x = pointer.input().target_mm.x();
  ASSERT_TRUE(until([&] { return pointer.input().target_mm.x() < from_x - 3.0; })) << said();
  plug_.hold({});
  EXPECT_TRUE(until([&] { return label("device") == "Game pad"; }));
  EXPECT_EQ(pointer.input().source, PointerSource::game_pad);
  EXPECT_TRUE(plug_.quiet()) << "nothing is touched yet";

  // The trigger pushes as hard as it is pulled, and the motors follow the force.
  const double wheel_n = pointer.push_n();
  hand = {};
  hand.right_trigger = 0.8;
  plug_.hold(hand);
  ASSERT_TRUE(until([&] { return pointer.pushing(); })) << said();
  constexpr double kRest = PadControl::kTriggerRest;
  EXPECT_NEAR(pointer.push_n(), 1.0 + 39.0 * (0.8 - kRest) / (1.0 - kRest), 0.01);
  ASSERT_TRUE(until([&] { return cut(); })) << said();
  EXPECT_TRUE(until([&] { return !plug_.quiet(); }));
  // 30 N are the device's, so 20 N or more are √(2/3) of the motor.
  EXPECT_TRUE(until(
      [&] { return std::ranges::any_of(plug_.heard(), [](const auto& motors) { return motors.low > 0.8 * 65535; }); }));

  // Let go, the tool comes out and the motors rest. The wheel's push is back.
  plug_.hold({});
  EXPECT_TRUE(until([&] { return !pointer.pushing() && plug_.quiet(); }));
  EXPECT_EQ(pointer.push_n(), wheel_n);
  hand = {};
  hand.b = true;
  plug_.hold(hand);
  EXPECT_TRUE(until([&] { return !cut(); })) << said();
  plug_.hold({});

  // A toggles the spindle.
  ASSERT_TRUE(pointer.spindle());
  hand = {};
  hand.a = true;
  plug_.hold(hand);
  EXPECT_TRUE(until([&] { return !pointer.spindle(); }));
  plug_.hold({});

  // Unplugged while it pushes.
  hand = {};
  hand.right_trigger = 1.0;
  QTest::qWait(100);
  plug_.hold(hand);
  ASSERT_TRUE(until([&] { return pointer.pushing() && pointer.push_n() > 39.9; })) << said();
  plug_.unplug();
  EXPECT_TRUE(until([&] { return !pointer.pushing(); }));
  EXPECT_TRUE(says("Virtual Pad was unplugged and has let the tool go.")) << said();
  EXPECT_TRUE(until([&] { return label("device") == "Pointer"; }));
  EXPECT_EQ(pointer.push_n(), wheel_n);
}

}  // namespace
}  // namespace osteon
