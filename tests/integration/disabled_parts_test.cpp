// Parts of the window that can do nothing yet.
#include <gtest/gtest.h>

#include <QAction>
#include <QDockWidget>
#include <QLabel>
#include <QMenu>
#include <QSettings>
#include <QTest>
#include <QToolButton>
#include <QToolTip>
#include <QWindow>
#include <chrono>

#include "tests/integration/window_bench.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

class DisabledParts : public test::WindowBench {
 protected:
  void SetUp() override {
    QSettings().setValue("tour/seen", true);
    WindowBench::SetUp();
  }
};

// Where nothing can be done yet, the pointer finds the reason.
TEST_F(DisabledParts, SayWhyInTheirToolTips) {
  const QString reason = "Open a bone or join a room first.";
  const auto tip_at = [&](QWidget& widget, const QPoint& at) {
    QToolTip::hideText();
    QWidget* window = widget.window();
    QTest::mouseMove(window->windowHandle(), widget.mapTo(window, at) + QPoint(1, 0));
    QTest::mouseMove(window->windowHandle(), widget.mapTo(window, at));
    EXPECT_TRUE(until([] { return QToolTip::isVisible(); }, 5s));
    return QToolTip::text();
  };
  auto* drill = window_->findChild<QToolButton*>("drill");
  auto* panel = window_->findChild<QDockWidget*>("tool_panel");
  auto* edit = window_->findChild<QAction*>("undo")->associatedWidgets().value(0);
  ASSERT_NE(qobject_cast<QMenu*>(edit), nullptr);
  EXPECT_FALSE(drill->isEnabled());
  EXPECT_EQ(tip_at(*drill, drill->rect().center()), reason);
  EXPECT_EQ(tip_at(*panel, QPoint(20, 8)), reason) << "its title";
  EXPECT_EQ(tip_at(*window_->findChild<QLabel*>("force_bone"), QPoint(2, 2)), reason) << "a part of another panel";
  static_cast<QMenu*>(edit)->popup(window_->mapToGlobal(QPoint(200, 200)));
  ASSERT_TRUE(QTest::qWaitForWindowExposed(edit));
  const QAction* undo = window_->findChild<QAction*>("undo");
  EXPECT_EQ(tip_at(*edit, static_cast<QMenu*>(edit)->actionGeometry(static_cast<QMenu*>(edit)->actions()[0]).center()),
            reason);
  edit->close();
  int disabled = 0;
  for (const QAction* action : window_->findChildren<QAction*>()) {
    if (action->isEnabled() || !action->isVisible() || action->objectName().startsWith("qt_")) continue;
    ++disabled;
    EXPECT_EQ(action->toolTip(), reason) << action->objectName().toStdString();
  }
  EXPECT_GT(disabled, 40) << "of them 24 tools";
  open();
  EXPECT_EQ(undo->toolTip(), "Undo");
  EXPECT_TRUE(undo->statusTip().isEmpty());
  EXPECT_TRUE(drill->isEnabled());
  EXPECT_EQ(drill->toolTip(), "Drill 3.2 mm");
  EXPECT_TRUE(panel->toolTip().isEmpty());
  EXPECT_EQ(tip_at(*window_->findChild<QLabel*>("teeth"), QPoint(2, 2)), "Choose a tool on the left first.");
  click_tool("drill");
  EXPECT_TRUE(window_->findChild<QLabel*>("teeth")->parentWidget()->toolTip().isEmpty());
}

}  // namespace
}  // namespace osteon
