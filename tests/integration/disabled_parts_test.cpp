// Parts of the window that can do nothing yet.
#include <gtest/gtest.h>

#include <QAction>
#include <QCheckBox>
#include <QDockWidget>
#include <QLabel>
#include <QMenu>
#include <QPushButton>
#include <QSettings>
#include <QSlider>
#include <QStatusBar>
#include <QTest>
#include <QToolButton>
#include <QToolTip>
#include <QWindow>
#include <chrono>
#include <string>

#include "tests/integration/window_bench.hpp"
#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/sound_dialog.hpp"
#include "viewer_client/desktop/start_page.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

class DisabledParts : public test::WindowBench {
 protected:
  void SetUp() override {
    QSettings().setValue("tour/seen", true);
    WindowBench::SetUp();
  }
  // The tool tip that the pointer finds there.
  static std::string tip_at(QWidget& widget, const QPoint& at) {
    QToolTip::hideText();
    EXPECT_TRUE(until([] { return !QToolTip::isVisible(); }, 5s)) << "the tip of before stays";
    QWidget* window = widget.window();
    // Any event of the window ends Qt's wait for a pointer that rests. A person moves the pointer again then.
    for (int time = 0; time < 5 && !QToolTip::isVisible(); ++time) {
      QTest::mouseMove(window->windowHandle(), widget.mapTo(window, at) + QPoint(1, 0));
      QTest::mouseMove(window->windowHandle(), widget.mapTo(window, at));
      (void)until([] { return QToolTip::isVisible(); }, 3s);
    }
    EXPECT_TRUE(QToolTip::isVisible());
    return QToolTip::text().toStdString();
  }
  static constexpr const char* kNoRoom = "Open a bone or join a room first.";
};

// Where nothing can be done yet, the pointer finds the reason.
TEST_F(DisabledParts, SayWhyInTheirToolTips) {
  auto* drill = window_->findChild<QToolButton*>("drill");
  auto* panel = window_->findChild<QDockWidget*>("tool_panel");
  auto* edit = window_->findChild<QAction*>("undo")->associatedWidgets().value(0);
  ASSERT_NE(qobject_cast<QMenu*>(edit), nullptr);
  EXPECT_FALSE(drill->isEnabled());
  EXPECT_EQ(tip_at(*drill, drill->rect().center()), kNoRoom);
  EXPECT_EQ(tip_at(*panel, QPoint(20, 8)), kNoRoom) << "its title";
  EXPECT_EQ(tip_at(*window_->findChild<QLabel*>("force_bone"), QPoint(2, 2)), kNoRoom) << "a part of another panel";
  static_cast<QMenu*>(edit)->popup(window_->mapToGlobal(QPoint(200, 200)));
  ASSERT_TRUE(QTest::qWaitForWindowExposed(edit, 30000));
  EXPECT_EQ(tip_at(*edit, static_cast<QMenu*>(edit)->actionGeometry(static_cast<QMenu*>(edit)->actions()[0]).center()),
            kNoRoom);
  edit->close();
  int disabled = 0;
  for (const QAction* action : window_->findChildren<QAction*>()) {
    // Fields for text have actions of their own, without a text.
    if (action->isEnabled() || !action->isVisible() || action->text().isEmpty()) continue;
    ++disabled;
    EXPECT_EQ(action->toolTip().toStdString(), kNoRoom) << action->text().toStdString();
  }
  EXPECT_GT(disabled, 40) << "of them 24 tools";
  // The pointer that enters and leaves a disabled button leaves the sentence in the status bar.
  window_->statusBar()->showMessage("A sentence.");
  EXPECT_EQ(tip_at(*drill, drill->rect().center()), kNoRoom);
  QTest::mouseMove(window_->windowHandle(), view_->mapTo(window_.get(), middle()));
  QTest::qWait(50);
  EXPECT_EQ(window_->statusBar()->currentMessage().toStdString(), "A sentence.");
}

TEST_F(DisabledParts, SayWhyWhileARoomOpensAndWhenItIsOpen) {
  const auto* undo = window_->findChild<QAction*>("undo");
  const auto* drill = window_->findChild<QToolButton*>("drill");
  const auto* panel = window_->findChild<QDockWidget*>("tool_panel");
  window_->practise(desk_->bone());
  EXPECT_EQ(undo->toolTip().toStdString(), "The room opens. Wait for it.");
  EXPECT_EQ(drill->toolTip().toStdString(), "The room opens. Wait for it.");
  open();
  EXPECT_EQ(undo->toolTip().toStdString(), "Undo");
  EXPECT_TRUE(drill->isEnabled());
  EXPECT_EQ(drill->toolTip().toStdString(), "Drill 3.2 mm");
  EXPECT_TRUE(panel->toolTip().isEmpty());
  EXPECT_EQ(tip_at(*window_->findChild<QLabel*>("teeth"), QPoint(2, 2)), "Choose a tool on the left first.");
  click_tool("drill");
  QWidget* of_tool = window_->findChild<QLabel*>("teeth")->parentWidget();
  EXPECT_TRUE(of_tool->toolTip().isEmpty());
  // An item has neither wear nor law. The drill's tips come back.
  auto* wear = window_->findChild<QWidget*>("wear_set");
  const std::string of_wear = wear->toolTip().toStdString();
  const std::string of_law = window_->findChild<QWidget*>("law_set")->toolTip().toStdString();
  EXPECT_NE(of_wear.find("1 is sharp"), std::string::npos);
  click_tool("pin");
  for (const char* part : {"wear_set", "law_set"}) {
    EXPECT_FALSE(window_->findChild<QWidget*>(part)->isEnabled()) << part;
    EXPECT_EQ(window_->findChild<QWidget*>(part)->toolTip().toStdString(),
              "A click places this tool. It has neither wear nor force law.")
        << part;
  }
  click_tool("drill");
  EXPECT_EQ(wear->toolTip().toStdString(), of_wear);
  EXPECT_EQ(window_->findChild<QWidget*>("law_set")->toolTip().toStdString(), of_law);
  // Irrigation and suction need no tool.
  trigger("put_down");
  EXPECT_FALSE(of_tool->isEnabled());
  EXPECT_EQ(of_tool->toolTip().toStdString(), "Choose a tool on the left first.");
  EXPECT_TRUE(window_->findChild<QWidget*>("irrigation_box")->isEnabled());
  EXPECT_TRUE(window_->findChild<QWidget*>("suction_box")->isEnabled());
  trigger("start_page");
  EXPECT_EQ(of_tool->toolTip().toStdString(), kNoRoom);
}

TEST_F(DisabledParts, AnEnabledPartGetsItsOwnToolTipBack) {
  QWidget part;
  part.setToolTip("its own");
  set_enabled(part, true, "");
  EXPECT_EQ(part.toolTip().toStdString(), "its own");
  set_enabled(part, false, "first reason");
  set_enabled(part, false, "second reason");
  EXPECT_FALSE(part.isEnabled());
  EXPECT_EQ(part.toolTip().toStdString(), "second reason");
  set_enabled(part, true, "");
  EXPECT_TRUE(part.isEnabled());
  EXPECT_EQ(part.toolTip().toStdString(), "its own");
}

TEST_F(DisabledParts, TheStartPageSaysWhyItWaits) {
  auto* page = window_->findChild<QWidget*>("import")->parentWidget();
  auto* start = dynamic_cast<StartPage*>(page);
  ASSERT_NE(start, nullptr);
  const std::string own = window_->findChild<QWidget*>("import")->toolTip().toStdString();
  start->show_work("A case is made");
  for (const char* choice : {"examples", "recent", "import", "open", "join"})
    EXPECT_EQ(window_->findChild<QWidget*>(choice)->toolTip().toStdString(),
              "A bone or a room is being opened. Wait for it, or cancel it.")
        << choice;
  start->end_work({});
  EXPECT_EQ(window_->findChild<QWidget*>("import")->toolTip().toStdString(), own);
  EXPECT_TRUE(window_->findChild<QWidget*>("examples")->toolTip().isEmpty());
}

// Whoever switched it off: the dialog, the menu, or the user of the window before this one.
TEST_F(DisabledParts, TheSoundDialogSaysWhyTheVolumeCannotBeSet) {
  constexpr const char* kOff = "The sound is off.";
  const auto open_dialog = [&] {
    trigger("sound_settings");
    return window_->findChild<SoundDialog*>("sound_dialog");
  };
  auto* dialog = open_dialog();
  ASSERT_NE(dialog, nullptr);
  ASSERT_TRUE(QTest::qWaitForWindowExposed(dialog, 30000));
  auto* volume = dialog->findChild<QSlider*>("volume");
  EXPECT_TRUE(volume->isEnabled());
  EXPECT_TRUE(volume->toolTip().isEmpty());
  EXPECT_EQ(label("sound_trouble"), "Only a practice room has sound. Open a bone first.") << "why nothing is measured";
  QTest::keyClick(dialog->findChild<QCheckBox*>("sound_on"), Qt::Key_Space);
  EXPECT_FALSE(volume->isEnabled());
  EXPECT_EQ(tip_at(*volume, volume->rect().center()), kOff);
  trigger("sound");
  EXPECT_TRUE(volume->isEnabled());
  EXPECT_TRUE(volume->toolTip().isEmpty());
  trigger("sound");
  EXPECT_FALSE(volume->isEnabled());
  EXPECT_EQ(volume->toolTip().toStdString(), kOff);
  begin();
  volume = open_dialog()->findChild<QSlider*>("volume");
  EXPECT_FALSE(volume->isEnabled());
  EXPECT_EQ(volume->toolTip().toStdString(), kOff);
  trigger("sound");  // for the next window
}

// A room that others run has no audio client of the window's. The dialog gives the command that plays it.
TEST_F(DisabledParts, TheSoundDialogSaysWhatPlaysARoomOfOthers) {
  const std::string says = "The window plays only the rooms that it opened. To hear this one, start: osteon-audio ";
  trigger("sound_settings");
  auto* dialog = window_->findChild<SoundDialog*>("sound_dialog");
  ASSERT_TRUE(QTest::qWaitForWindowExposed(dialog, 30000));
  window_->join({"127.0.0.1:1", "Ada's knee", {}, {}});
  EXPECT_EQ(label("sound_trouble").toStdString(), says + "--server 127.0.0.1:1 --room 'Ada'\\''s knee' --plain");
  window_->join({"127.0.0.1:1", "", {}, {"/home/ben/mine", "/home/ben/a ticket"}});
  const std::string secure = says + "--server 127.0.0.1:1 --certificates /home/ben/mine --ticket '/home/ben/a ticket'";
  EXPECT_EQ(label("sound_trouble").toStdString(), secure);
  // Who switches the sound on there reads it at once. The status bar may be too narrow, and its tool tip has it all.
  trigger("sound");
  EXPECT_NE(window_->statusBar()->toolTip().toStdString(), secure);
  trigger("sound");
  EXPECT_EQ(window_->statusBar()->toolTip().toStdString(), secure);
  window_->findChild<QPushButton*>("cancel")->click();
  EXPECT_EQ(label("sound_trouble"), "Only a practice room has sound. Open a bone first.");
}

}  // namespace
}  // namespace osteon
