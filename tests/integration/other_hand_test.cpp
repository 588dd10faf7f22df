// Irrigation and suction as a person uses them: keys, check boxes and the mouse of the window, with the real programs
// as its children.
#include <gtest/gtest.h>

#include <QAction>
#include <QCheckBox>
#include <QLabel>
#include <QStatusBar>
#include <QTest>
#include <QToolButton>
#include <QWindow>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <string>

#include "tests/integration/desk.hpp"
#include "viewer_client/desktop/bone_view.hpp"
#include "viewer_client/desktop/main_window.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::Desk;

class OtherHand : public testing::Test {
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
    // Opens the block, looks at its upper side from above, and holds the drill over it.
    window_->practise(desk_.bone());
    ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
    view_->look_from(Vec3(0.05, -0.05, 1));
    ASSERT_TRUE(until([&] { return label("device") == "Pointer"; })) << problem();
    QTest::mouseClick(window_->findChild<QToolButton*>("drill"), Qt::LeftButton);
    ASSERT_TRUE(until([&] {
      QTest::mouseMove(window_->windowHandle(), middle() + QPoint(1, 0));
      QTest::mouseMove(window_->windowHandle(), middle());
      return view_->pointer().on_bone() && !view_->updater()->states().empty();
    })) << problem();
  }
  template <class Condition>
  [[nodiscard]] static bool until(Condition condition) {
    constexpr auto kPatience = 60s;
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
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
  [[nodiscard]] QPoint middle() const {
    return view_->mapTo(window_.get(), QPoint(view_->width() / 2, view_->height() / 2));
  }
  [[nodiscard]] const CuttingState& state() const { return view_->updater()->states().front(); }
  [[nodiscard]] std::string problem() const {
    return window_->statusBar()->currentMessage().toStdString() + " / hand " + label("other_hand").toStdString() +
           ", flutes " + label("flutes").toStdString() + " " + encode(view_->pointer().input());
  }

  Desk desk_;
  std::unique_ptr<MainWindow> window_;
  BoneView* view_ = nullptr;
};

// One session for all, because each window starts a server and two clients. What the lower bar says has gone to the
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
  QTest::mousePress(window_->windowHandle(), Qt::LeftButton, {}, middle());
  ASSERT_TRUE(until([&] { return state().flutes_full > 0.1; })) << problem();
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
  QTest::mouseRelease(window_->windowHandle(), Qt::LeftButton, {}, middle());

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
