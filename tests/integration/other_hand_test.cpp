// Irrigation and suction as a person uses them: keys, check boxes and the mouse of the window, with the real programs
// as its children.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <QAction>
#include <QCheckBox>
#include <QStatusBar>
#include <QThread>

#include "tests/integration/window_bench.hpp"

namespace osteon {
namespace {

class OtherHand : public test::WindowBench {
 protected:
  // Opens the block and holds the drill over it.
  void SetUp() override {
    WindowBench::SetUp();
    open();
    click_tool("drill");
    ASSERT_TRUE(until([&] {
      hover(middle());
      return view_->pointer().on_bone() && !view_->updater()->states().empty();
    })) << problem();
  }
  [[nodiscard]] const CuttingState& state() const { return view_->updater()->states().front(); }
};

// One session for all, because each window starts a server and two clients. What the status bar says has gone to the
// haptic client, to the room and back.
TEST_F(OtherHand, IsLedByKeysAndBoxesAndWashesTheChipsOut) {
  auto* box = window_->findChild<QCheckBox*>("irrigation_box");
  auto* action = window_->findChild<QAction*>("irrigation");
  ASSERT_TRUE(box != nullptr && action != nullptr);
  EXPECT_EQ(label("other_hand"), "");
  EXPECT_FALSE(box->isChecked());
  view_->setFocus();
  QTest::keyClick(view_, Qt::Key_I);
  EXPECT_TRUE(until([&] { return label("other_hand") == "Irrigation"; })) << problem();
  EXPECT_TRUE(box->isChecked());
  QTest::keyClick(view_, Qt::Key_U);
  EXPECT_TRUE(until([&] { return label("other_hand") == "Irrigation, Suction"; })) << problem();
  EXPECT_TRUE(state().suction);
  // The box beside the tool's data is the same switch.
  box->setFocus();
  QTest::keyClick(box, Qt::Key_Space);
  EXPECT_TRUE(until([&] { return label("other_hand") == "Suction"; })) << problem();
  EXPECT_FALSE(action->isChecked());

  // Chips fill the flutes of a drill that cuts, and stay in one that stands in its hole.
  view_->setFocus();
  // A press during a slow frame is not lost.
  QThread::msleep(1500);
  press(middle());
  EXPECT_TRUE(view_->pointer().pushing());
  ASSERT_TRUE(push_until([&] { return state().flutes_full > 0.1; })) << problem();
  QTest::keyClick(view_, Qt::Key_Space);
  ASSERT_TRUE(until([&] { return state().spindle_rpm < 1.0; })) << problem();
  const double before = state().flutes_full;
  ASSERT_GT(before, 0.05);
  EXPECT_TRUE(until([&] { return label("flutes").endsWith(" %"); })) << problem();
  QTest::qWait(500);
  EXPECT_NEAR(state().flutes_full, before, 0.02);
  // Water takes them.
  action->trigger();
  EXPECT_TRUE(until([&] { return state().flutes_full < 0.5 * before; })) << problem();

  // A window that hangs holds no drill.
  QThread::msleep(1500);
  EXPECT_TRUE(until([&] { return !view_->pointer().pushing(); })) << problem();
  EXPECT_THAT(window_->statusBar()->currentMessage().toStdString(), testing::HasSubstr("the hand stopped pushing"));
  release(middle());

  // Whoever leaves the room lets both go.
  window_->findChild<QAction*>("start_page")->trigger();
  EXPECT_FALSE(action->isChecked());
  EXPECT_FALSE(view_->pointer().input().irrigation);
  EXPECT_FALSE(view_->pointer().input().suction);
  EXPECT_FALSE(action->isEnabled());
  EXPECT_EQ(label("other_hand"), "");
}

}  // namespace
}  // namespace osteon
