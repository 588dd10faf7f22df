// The window as a person uses it: real widgets, mouse and keys on a screen of its own, with the real programs as its
// children.
#include <gtest/gtest.h>
#include <signal.h>

#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QCursor>
#include <QDockWidget>
#include <QDropEvent>
#include <QLabel>
#include <QListWidget>
#include <QMenu>
#include <QMimeData>
#include <QPushButton>
#include <QSettings>
#include <QSlider>
#include <QSpinBox>
#include <QStackedWidget>
#include <QStatusBar>
#include <QTabletEvent>
#include <QTest>
#include <QToolButton>
#include <QUrl>
#include <QWheelEvent>
#include <QWindow>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "tests/integration/window_bench.hpp"
#include "viewer_client/desktop/risk_gauge.hpp"
#include "viewer_client/desktop/sound_dialog.hpp"
#include "viewer_client/desktop/start_page.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::children;

class WindowTest : public test::WindowBench {};

TEST_F(WindowTest, AMouseDrillsTheBoneAndUndoBringsItBack) {
  open();
  const CameraView seen = view_->camera();
  drill();
  // A drag sweeps the tool, and leaves the bone as it is seen.
  hover(middle() + QPoint(6, 3));
  hover(middle());
  release(middle());
  EXPECT_EQ(view_->camera().eye_mm, seen.eye_mm);
  EXPECT_EQ(view_->camera().target_mm, seen.target_mm);
  EXPECT_EQ(view_->camera().up, seen.up);
  const auto state = [&] { return view_->updater()->states().front(); };
  ASSERT_FALSE(view_->updater()->states().empty());
  EXPECT_EQ(state().tool_name, "drill-3.2");
  // The tool comes out of the hole by itself, and rests on whole bone beside it.
  hover(middle() + QPoint(80, 0));
  EXPECT_TRUE(until([&] { return state().pose_bone_tool.position_mm.z() > 0.1; }));
  // One undo takes back the whole push.
  undo_pushes();
  ASSERT_TRUE(until([&] { return window_->statusBar()->currentMessage() == "Undone."; })) << problem();
  EXPECT_TRUE(until([&] { return !cut(); })) << problem();
}

TEST_F(WindowTest, WheelSpaceAndShiftSetPushSpindleAndFineMotion) {
  open();
  click_tool("drill");
  hover(middle());
  ASSERT_TRUE(until([&] { return view_->pointer().on_bone(); }));
  const double before_n = view_->pointer().push_n();
  const QPointF at = middle();
  QWheelEvent wheel(at, view_->mapToGlobal(middle()), {}, {0, 360}, Qt::NoButton, {}, Qt::NoScrollPhase, false);
  const CameraView seen = view_->camera();
  QApplication::sendEvent(view_, &wheel);
  EXPECT_EQ(view_->camera().eye_mm, seen.eye_mm) << "the wheel does one of both";
  EXPECT_DOUBLE_EQ(view_->pointer().push_n(), before_n + 3.0);
  EXPECT_EQ(window_->findChild<QSpinBox*>("push_set")->value(), static_cast<int>(before_n) + 3);
  EXPECT_TRUE(view_->pointer().spindle());
  QTest::keyClick(view_, Qt::Key_Space);
  EXPECT_FALSE(view_->pointer().spindle());
  QTest::keyPress(view_, Qt::Key_Shift);
  EXPECT_TRUE(view_->pointer().input().fine);
  QTest::keyRelease(view_, Qt::Key_Shift);
  EXPECT_FALSE(view_->pointer().input().fine);
  // The bar says what the mouse does: with an empty hand nothing is pushed. Other sentences follow when they must.
  trigger("put_down");
  EXPECT_TRUE(window_->statusBar()->currentMessage().startsWith("Choose a tool"));
  click_tool("drill");
  EXPECT_TRUE(window_->statusBar()->currentMessage().startsWith("The left button pushes"));
}

// The haptic client holds a tool from its start on. As long as the user has none, nobody sees it.
TEST_F(WindowTest, AnEmptyHandIsNotDrawn) {
  open();
  const auto holds = [&](const std::string& tool) {
    const auto states = view_->updater()->states();
    return !states.empty() && states.front().tool_name == tool;
  };
  ASSERT_TRUE(until([&] { return holds(""); })) << problem();
  EXPECT_EQ(label("position"), "");
  click_tool("drill");
  hover(middle());
  EXPECT_TRUE(until([&] { return holds("drill-3.2") && label("position").startsWith("Tip"); })) << problem();
  trigger("put_down");
  EXPECT_TRUE(until([&] { return holds("") && label("position").isEmpty(); })) << problem();
  // An item that waits for its place is in no hand either.
  click_tool("drill");
  EXPECT_TRUE(until([&] { return holds("drill-3.2"); })) << problem();
  window_->findChild<QToolButton*>("pin")->defaultAction()->trigger();
  EXPECT_TRUE(until([&] { return holds(""); })) << problem();
}

// How often the window is put together anew, for the picture or for any panel.
class WindowUpdates : public QObject {
 public:
  explicit WindowUpdates(QObject& window) { window.installEventFilter(this); }
  [[nodiscard]] std::uint64_t count() const { return count_; }

 private:
  bool eventFilter(QObject* /*window*/, QEvent* event) override {
    count_ += event->type() == QEvent::UpdateRequest ? 1 : 0;
    return false;
  }
  std::uint64_t count_ = 0;
};

// A picture costs much of a processor where software draws it. So does any change of a panel, because the whole window
// is put together for it.
TEST_F(WindowTest, ARestingToolIsNotDrawnAgainAndAgain) {
  constexpr std::uint64_t kStates = 1000, kMostFrames = 3, kMostUpdates = 6;
  open();
  click_tool("drill");
  hover(middle());
  ASSERT_TRUE(until([&] { return view_->pointer().on_bone() && !view_->updater()->states().empty(); })) << problem();
  const auto newest = [&] { return view_->updater()->states().front().state_seq; };
  const WindowUpdates updates(*window_);
  std::uint64_t frames = view_->frames(), updated = 0, first = newest();
  EXPECT_TRUE(until([&] {
    if (view_->frames() > frames + kMostFrames || updates.count() > updated + kMostUpdates) {
      frames = view_->frames();
      updated = updates.count();
      first = newest();
    }
    return newest() >= first + kStates;
  })) << problem();
}

TEST_F(WindowTest, APenPushesAsHardAsItIsPressed) {
  open();
  click_tool("drill");
  hover(middle());
  ASSERT_TRUE(until([&] { return view_->pointer().on_bone(); }));
  view_->pointer().set_push(12.0);
  const auto pen = [&](QEvent::Type type, const QPoint& at, double pressure, Qt::MouseButton button,
                       Qt::MouseButtons buttons) {
    QTabletEvent event(type, at, view_->mapToGlobal(at), QTabletEvent::Stylus, QTabletEvent::Pen, pressure, 0, 0, 0.0,
                       0.0, 0, Qt::NoModifier, 1, button, buttons);
    QApplication::sendEvent(view_, &event);
    return event.isAccepted();
  };
  // In the air over the tablet it points and does not push.
  EXPECT_TRUE(pen(QEvent::TabletMove, middle() + QPoint(20, 0), 0.0, Qt::NoButton, Qt::NoButton));
  EXPECT_FALSE(view_->pointer().pushing());
  EXPECT_EQ(view_->pointer().push_n(), 12.0);
  // From 1 to 40 N, in proportion to the pressure: 1 + 39 p.
  EXPECT_TRUE(pen(QEvent::TabletPress, middle(), 0.0, Qt::LeftButton, Qt::LeftButton));
  EXPECT_TRUE(view_->pointer().pushing());
  EXPECT_DOUBLE_EQ(view_->pointer().push_n(), 1.0);
  for (const double pressure : {0.5, 1.0, 0.25}) {
    EXPECT_TRUE(pen(QEvent::TabletMove, middle(), pressure, Qt::NoButton, Qt::LeftButton));
    EXPECT_DOUBLE_EQ(view_->pointer().push_n(), 1.0 + 39.0 * pressure);
    EXPECT_DOUBLE_EQ(view_->pointer().input().push_n, view_->pointer().push_n());
  }
  EXPECT_TRUE(until([&] { return cut(); })) << problem();
  // Lifted, it leaves the push that the wheel has set.
  EXPECT_TRUE(pen(QEvent::TabletRelease, middle(), 0.0, Qt::LeftButton, Qt::NoButton));
  EXPECT_FALSE(view_->pointer().pushing());
  EXPECT_EQ(view_->pointer().push_n(), 12.0);
  // The window shows what bone and hand give, and what the device holds: the simulated hand 30 N.
  EXPECT_TRUE(until([&] { return label("budget_words").endsWith("The device can hold: 30.0 N."); }))
      << label("budget_words").toStdString();
  // Its barrel button, and a pen without a tool, are the mouse's.
  EXPECT_FALSE(pen(QEvent::TabletPress, middle(), 0.0, Qt::RightButton, Qt::RightButton));
  trigger("put_down");
  EXPECT_FALSE(pen(QEvent::TabletPress, middle(), 0.5, Qt::LeftButton, Qt::LeftButton));
}

TEST_F(WindowTest, ASpaceMouseTurnsTheToolAndMovesTheBone) {
  open();
  click_tool("drill");
  hover(middle());
  ASSERT_TRUE(until([&] { return view_->pointer().on_bone(); }));
  const auto axis = [&] { return Vec3(view_->pointer().input().rotation_bone_tool * Vec3::UnitZ()); };
  const CameraView before = view_->camera();
  const Vec3 straight = axis();
  // All the way to the right about the picture's vertical, for 0.2 s at 1 rad/s. The picture looks nearly along the
  // tool, which is then tilted by as much.
  SpaceMouseState cap;
  cap.twist = Vec3::UnitY();
  for (int i = 0; i < 20; ++i) view_->follow_cap(cap, 0.01);
  EXPECT_NEAR(std::acos(axis().dot(straight)), 0.2, 0.01);
  EXPECT_EQ(view_->camera().eye_mm, before.eye_mm);
  cap.twist *= -1.0;
  for (int i = 0; i < 20; ++i) view_->follow_cap(cap, 0.01);
  // Each step parts the twist by the tool's axis at its beginning, an error of the order of a step.
  EXPECT_NEAR((axis() - straight).norm(), 0.0, 1e-3);
  // Within its rest the cap does nothing.
  const Vec3 rested = axis();
  cap.twist = 0.04 * Vec3::UnitX();
  view_->follow_cap(cap, 0.1);
  EXPECT_EQ(axis(), rested);
  // A push moves the bone. Without a tool a twist does too.
  cap = {};
  cap.push = Vec3::UnitX();
  view_->follow_cap(cap, 0.1);
  const CameraView pushed = view_->camera();
  EXPECT_GT((pushed.eye_mm - before.eye_mm).norm(), 0.5);
  trigger("put_down");
  cap = {};
  cap.twist = Vec3::UnitY();
  view_->follow_cap(cap, 0.1);
  EXPECT_GT((view_->camera().eye_mm - pushed.eye_mm).norm(), 0.5);
}

TEST_F(WindowTest, AnotherSizeOfTheToolComesIntoTheHand) {
  open();
  click_tool("drill");
  hover(middle());
  auto* size = window_->findChild<QComboBox*>("size");
  ASSERT_NE(size, nullptr);
  const int other = size->findData("drill-5-16in");
  ASSERT_GE(other, 0);
  size->setCurrentIndex(other);
  Q_EMIT size->activated(other);
  hover(middle() + QPoint(5, 5));
  EXPECT_TRUE(until([&] {
    const auto states = view_->updater()->states();
    return !states.empty() && states.front().tool_name == "drill-5-16in";
  }));
}

TEST_F(WindowTest, AClickPlacesAPin) {
  open();
  click_tool("pin");
  EXPECT_TRUE(view_->placing());
  press(middle());
  release(middle());
  EXPECT_TRUE(until([&] { return view_->updater()->items().size() == 1; })) << problem();
}

TEST_F(WindowTest, ADragWithoutAToolTurnsTheBone) {
  open();
  const CameraView before = view_->camera();
  press(middle());
  QTest::mouseMove(frame(), in_frame(middle() + QPoint(60, 0)));
  release(middle() + QPoint(60, 0));
  EXPECT_GT((view_->camera().eye_mm - before.eye_mm).norm(), 5.0);
  trigger("overview");
  EXPECT_FALSE(cut());
}

// A view is kept, left, and taken again.
TEST_F(WindowTest, ASavedViewComesBack) {
  open();
  const CameraView kept = view_->camera();
  trigger("save_view");
  trigger("back");
  ASSERT_GT((view_->camera().eye_mm - kept.eye_mm).norm(), 10.0);
  trigger("view_1");
  EXPECT_LT((view_->camera().eye_mm - kept.eye_mm).norm(), 1e-6);
  EXPECT_LT((view_->camera().up - kept.up).norm(), 1e-6);
  trigger("delete_views");
  EXPECT_FALSE(window_->findChild<QAction*>("view_1")->isVisible());
}

// The half of the block that the user opened is not in the picture, and no tool points at it.
TEST_F(WindowTest, AnOpenedBoneIsPointedAtWhereItIsSeen) {
  open();
  click_tool("drill");
  hover(middle() - QPoint(60, 0));
  EXPECT_TRUE(until([&] { return view_->pointer().on_bone(); }));
  auto* panel = window_->findChild<QDockWidget*>("clipping_panel");
  ASSERT_NE(panel, nullptr);
  panel->toggleViewAction()->trigger();
  // From above, with the front of the body up, the patient's left side is on the left.
  window_->findChild<QSlider*>("clip_left")->setValue(100);
  window_->findChild<QCheckBox*>("clip_box")->setChecked(true);
  hover(middle() - QPoint(60, 0));
  EXPECT_FALSE(view_->pointer().on_bone());
  hover(middle() + QPoint(60, 0));
  EXPECT_TRUE(view_->pointer().on_bone());
  QTest::mouseClick(window_->findChild<QPushButton*>("clip_whole"), Qt::LeftButton);
  hover(middle() - QPoint(60, 0));
  EXPECT_TRUE(view_->pointer().on_bone());
  panel->hide();  // the next window opens as this one was left
}

// Also beside each other, from the first row to the last.
TEST_F(WindowTest, APanelThatIsOpenedIsSeenAsAWhole) {
  QSettings().remove("window/state");
  begin();
  const auto seen = [&](const char* part) {
    const auto* widget = window_->findChild<QWidget*>(part);
    return widget != nullptr && widget->visibleRegion().boundingRect() == widget->rect();
  };
  for (const auto& [panel, first, last] : {std::tuple{"clipping_panel", "clip_box", "clip_whole"},
                                           std::tuple{"connection_panel", "link_room", "link_advice"}}) {
    window_->findChild<QDockWidget*>(panel)->toggleViewAction()->trigger();
    EXPECT_TRUE(until([&] { return seen(first) && seen(last); })) << panel;
  }
  for (const char* panel : {"clipping_panel", "connection_panel"}) window_->findChild<QDockWidget*>(panel)->hide();
}

// A tibia with an artery. The status bar names what is nearest to the tip, and warns below the chosen distance.
TEST_F(WindowTest, TheNearestStructureAtRiskIsNamedWithItsDistance) {
  window_->practise(desk_->tibia());
  ASSERT_TRUE(until([&] { return view_->surface_shown() && view_->updater()->plan(); })) << problem();
  ASSERT_TRUE(until([&] { return label("device") == "Pointer"; })) << problem();
  const std::shared_ptr<const SurgicalPlan> plan = view_->updater()->plan();
  EXPECT_GT(plan->structures.size(), 3u);
  EXPECT_GT(plan->axes.size(), 0u);
  click_tool("drill");
  view_->look_from(Vec3(0.05, 1, 0.05));
  ASSERT_TRUE(until([&] {
    hover(middle());
    return view_->pointer().on_bone() && !label("risk").isEmpty();
  })) << problem();
  auto* gauge = window_->findChild<RiskGauge*>("risk");
  ASSERT_NE(gauge, nullptr);
  gauge->set_limit_mm(0.0);
  EXPECT_TRUE(until([&] { return !gauge->warns(); })) << label("risk").toStdString();
  gauge->set_limit_mm(500.0);
  EXPECT_TRUE(until([&] { return gauge->warns() && label("risk").startsWith("Near "); }))
      << label("risk").toStdString();
  EXPECT_TRUE(label("risk").endsWith(" mm"));
  gauge->set_limit_mm(RiskGauge::kUsualLimit_mm);
  // The picture changes when the menu hides the structures.
  const auto picture = [&] {
    const std::uint64_t frames = view_->frames();
    view_->redraw();
    EXPECT_TRUE(until([&] { return view_->frames() > frames; }));
    return view_->scene().image().rgb;
  };
  trigger("put_down");
  hover(QPoint(1, 1));
  QTest::qWait(300);
  const auto with = picture();
  trigger("risks");
  const auto without = picture();
  EXPECT_NE(with, without);
  trigger("planned");
  EXPECT_NE(picture(), without);
  trigger("risks");
  trigger("planned");
}

// In each of the two pictures the pointer finds the same place of the bone.
TEST_F(WindowTest, APointerIsInEitherPictureSideBySide) {
  open();
  click_tool("drill");
  trigger("stereo_side_by_side");
  const QPoint left(view_->width() / 4, view_->height() / 2), right = left + QPoint(view_->width() / 2, 0);
  hover(left);
  ASSERT_TRUE(view_->pointer().on_bone());
  const Vec3 by_left = view_->pointer().input().target_mm;
  hover(right);
  ASSERT_TRUE(view_->pointer().on_bone());
  EXPECT_LT((view_->pointer().input().target_mm - by_left).norm(), 0.5);
  trigger("stereo_quad_buffer");
  EXPECT_TRUE(window_->statusBar()->currentMessage().contains("quad buffer"));
  EXPECT_TRUE(window_->findChild<QAction*>("stereo_off")->isChecked());
}

// The drill is heard while it turns, as loud as the slider says. Without a sound server the dialog says so. Both are
// run: integration.window has none, and integration.window_sound has one.
TEST_F(WindowTest, TheSoundDialogSetsTheVolumeAndShowsWhatIsPlayed) {
  open();
  trigger("sound_settings");
  auto* dialog = window_->findChild<SoundDialog*>("sound_dialog");
  ASSERT_NE(dialog, nullptr);
  EXPECT_TRUE(dialog->isVisible());
  const auto* plot = dialog->findChild<WavePlot*>("wave");
  const auto* trouble = dialog->findChild<QLabel*>("sound_trouble");
  auto* volume = dialog->findChild<QSlider*>("volume");
  auto* on = dialog->findChild<QCheckBox*>("sound_on");
  const auto loudest = [&] {
    int most = 0;
    for (const int sample : plot->wave()) most = std::max(most, std::abs(sample));
    return most;
  };
  click_tool("drill");
  hover(middle());
  if (has_sound()) {
    ASSERT_TRUE(until([&] { return loudest() > 100; })) << trouble->text().toStdString() << problem();
    EXPECT_EQ(trouble->text(), QString());
    EXPECT_EQ(label("sound_device"), "PulseAudio");
    EXPECT_TRUE(label("sound_work").endsWith(" ms")) << label("sound_work").toStdString();
    QTest::keyClick(volume, Qt::Key_Home);
    EXPECT_TRUE(until([&] { return loudest() == 0 && !plot->wave().empty(); }));
    QTest::keyClick(volume, Qt::Key_End);
    EXPECT_TRUE(until([&] { return loudest() > 100; }));
    QTest::keyClick(on, Qt::Key_Space);
    EXPECT_TRUE(until([&] { return loudest() == 0 && !plot->wave().empty(); }));
    QTest::keyClick(on, Qt::Key_Space);
    EXPECT_TRUE(until([&] { return loudest() > 100; }));
  } else {
    ASSERT_TRUE(until([&] { return trouble->text().startsWith("No sound device: "); })) << problem();
    EXPECT_EQ(loudest(), 0);
    EXPECT_TRUE(children("osteon-audio").size() == 1) << "it waits for a device";
  }
  // Escape closes the dialog, and the tool stays in the hand.
  QTest::keyClick(dialog, Qt::Key_Escape);
  EXPECT_FALSE(dialog->isVisible());
  EXPECT_TRUE(view_->holding());
}

TEST_F(WindowTest, VolumeAndOffAreThereAtTheNextStart) {
  const auto open_dialog = [&] {
    trigger("sound_settings");
    return window_->findChild<SoundDialog*>("sound_dialog");
  };
  const auto* dialog = open_dialog();
  dialog->findChild<QSlider*>("volume")->setValue(40);
  QTest::keyClick(dialog->findChild<QCheckBox*>("sound_on"), Qt::Key_Space);
  EXPECT_FALSE(window_->findChild<QAction*>("sound")->isChecked()) << "the menu shows the same";
  window_ = std::make_unique<MainWindow>();
  show();
  EXPECT_FALSE(window_->findChild<QAction*>("sound")->isChecked());
  dialog = open_dialog();
  auto* volume = dialog->findChild<QSlider*>("volume");
  EXPECT_EQ(volume->value(), 40);
  trigger("sound");
  EXPECT_TRUE(dialog->findChild<QCheckBox*>("sound_on")->isChecked()) << "the dialog shows the same";
  volume->setValue(100);  // for the next window
}

TEST_F(WindowTest, TheConnectionPanelSaysWhatRunsAndWhatWasStartedAgain) {
  trigger("connections");
  EXPECT_EQ(label("link_advice"), "Open a bone or join a room.");
  open();
  EXPECT_TRUE(until([&] { return label("link_server").startsWith("runs, answers in "); }))
      << label("link_server").toStdString();
  EXPECT_EQ(label("link_role"), "You practise alone.");
  EXPECT_EQ(label("link_room"), label("connection").section(' ', -1)) << "the address of the status bar";
  EXPECT_TRUE(until([&] { return label("link_haptic").startsWith("runs, last message "); }));
  // The device is where the tool is.
  click_tool("drill");
  hover(middle());
  EXPECT_TRUE(until([&] { return label("link_device").startsWith("mouse, at "); }));
  if (!has_sound()) {
    EXPECT_TRUE(until([&] {
      return label("link_audio") == "runs, no device" && label("link_advice").startsWith("No sound device: ");
    })) << label("link_audio").toStdString();
  }

  const auto clients = children("osteon-haptic");
  ASSERT_EQ(clients.size(), 1u);
  ASSERT_EQ(::kill(clients[0], SIGKILL), 0);
  // The next one waits while it starts, or it may connect before the panel is drawn anew.
  pid_t next = 0;
  ASSERT_TRUE(until([&] {
    for (const pid_t client : children("osteon-haptic"))
      if (client != clients[0]) next = client;
    return next != 0;
  }));
  ASSERT_EQ(::kill(next, SIGSTOP), 0);
  EXPECT_TRUE(until([&] { return label("link_device") == "mouse, not connected yet"; }));
  ASSERT_EQ(::kill(next, SIGCONT), 0);
  EXPECT_TRUE(until([&] {
    return label("link_haptic").startsWith("runs") && label("link_haptic").endsWith("started again: 1");
  })) << label("link_haptic").toStdString();
  trigger("connections");
  EXPECT_FALSE(window_->findChild<QDockWidget*>("connection_panel")->isVisible());
}

TEST_F(WindowTest, AKilledHapticClientComesBackAndCutsAgain) {
  open();
  const auto clients = children("osteon-haptic");
  ASSERT_EQ(clients.size(), 1u);
  ASSERT_EQ(::kill(clients[0], SIGKILL), 0);
  ASSERT_TRUE(until([&] {
    const auto now = children("osteon-haptic");
    return now.size() == 1 && now[0] != clients[0] && label("device") == "Pointer";
  })) << problem();
  drill();
  release(middle());
}

TEST_F(WindowTest, AKilledServerComesBackWithTheHole) {
  open();
  drill();
  release(middle());
  trigger("put_down");
  QTest::qWait(500);
  const auto servers = children("osteon-server");
  ASSERT_EQ(servers.size(), 1u);
  ASSERT_EQ(::kill(servers[0], SIGKILL), 0);
  ASSERT_TRUE(until([&] {
    const auto now = children("osteon-server");
    return now.size() == 1 && now[0] != servers[0];
  })) << problem();
  EXPECT_TRUE(until([&] { return label("connection").startsWith("Connected") && cut(); })) << problem();
}

TEST_F(WindowTest, ClosingInTheMiddleOfACutEndsAllAndKeepsTheCut) {
  open();
  drill();
  window_->close();
  EXPECT_TRUE(children("osteon-server").empty());
  EXPECT_TRUE(children("osteon-haptic").empty());
  // The start page of the next window offers the session, and it has the hole.
  window_ = std::make_unique<MainWindow>();
  show();
  // The button is up at last. Otherwise it is down in all tests that follow.
  QTest::mouseRelease(frame(), Qt::LeftButton, {}, QPoint(5, 5));
  view_ = window_->findChild<BoneView*>("bone");
  const auto recent = recent_entries();
  ASSERT_FALSE(recent.empty());
  auto* list = window_->findChild<QListWidget*>("recent");
  ASSERT_GE(list->count(), 1);
  QTest::mouseClick(list->viewport(), Qt::LeftButton, {}, list->visualItemRect(list->item(0)).center());
  EXPECT_TRUE(until([&] { return view_->surface_shown() && cut(); })) << problem();
}

// The server is stopped while it owes answers: to the marks before pushes, and to the pings of the panel.
TEST_F(WindowTest, AServerThatHangsHoldsTheClosingForTwoSecondsAndLosesNothing) {
  open();
  drill();
  release(middle());
  ASSERT_TRUE(until([&] { return !view_->pointer().pushing() && cut(); })) << problem();
  const auto servers = children("osteon-server");
  ASSERT_EQ(servers.size(), 1u);
  ASSERT_EQ(::kill(servers[0], SIGSTOP), 0);
  trigger("connections");
  QTest::qWait(500);
  const auto began = std::chrono::steady_clock::now();
  window_->close();
  // The programs may take two seconds. An answer would be waited for up to 30.
  EXPECT_LT(std::chrono::steady_clock::now() - began, 8s);
  EXPECT_TRUE(children("osteon-server").empty());
  EXPECT_TRUE(children("osteon-haptic").empty());
  const auto session = recent_entries().front().session;
  begin();
  open(session);
  EXPECT_TRUE(until([&] { return cut(); })) << problem();
  window_->findChild<QDockWidget*>("connection_panel")->hide();
}

TEST_F(WindowTest, ACaseInOneFileIsSavedOpenedAndDropped) {
  const std::filesystem::path file = desk_->temp().path() / "My block.osteon";
  open();
  window_->save_case_file(QString::fromStdString(file.string()));
  ASSERT_TRUE(until([&] { return window_->statusBar()->currentMessage().startsWith("Saved"); })) << problem();
  ASSERT_TRUE(std::filesystem::exists(file));
  const auto others = [] {
    std::vector<std::filesystem::path> found;
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(cases_folder(), ignored)) found.push_back(entry);
    return found;
  };
  EXPECT_TRUE(others().empty()) << "the saving left something behind";

  window_->open_case_file(file);
  EXPECT_FALSE(view_->surface_shown()) << "the window waits for it";
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  EXPECT_EQ(window_->windowTitle().toStdString(), "My block.osteon – Osteon");
  ASSERT_TRUE(until([&] { return label("device") == "Pointer"; })) << problem();
  EXPECT_TRUE(recent_entries().front().title.startsWith("My block.osteon"))
      << recent_entries().front().title.toStdString();
  ASSERT_EQ(others().size(), 1u);
  const auto unpacked = others().front();
  const auto made = std::filesystem::last_write_time(unpacked);

  // Once more, with the mouse of a file manager: the same folder.
  QMimeData data;
  data.setUrls({QUrl::fromLocalFile(QString::fromStdString(file.string()))});
  const QPoint at = view_->mapTo(window_.get(), middle());
  QDragEnterEvent enters(at, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(window_->windowHandle(), &enters);
  EXPECT_TRUE(enters.isAccepted());
  QDropEvent drops(at, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(window_->windowHandle(), &drops);
  ASSERT_TRUE(until([&] { return !view_->surface_shown(); }));
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  ASSERT_EQ(others().size(), 1u);
  EXPECT_EQ(std::filesystem::last_write_time(others().front()), made);
}

TEST_F(WindowTest, AFileThatIsNoCaseIsRefusedWithASentence) {
  const std::filesystem::path picture = desk_->temp().path() / "picture.osteon";
  std::ofstream(picture) << "this is no archive";
  window_->open_case_file(picture);
  ASSERT_TRUE(until([&] { return label("words").contains("picture.osteon is not"); })) << problem();
  EXPECT_FALSE(label("words").contains("\n"));
  EXPECT_TRUE(window_->findChild<QListWidget*>("examples")->isEnabled());
}

TEST_F(WindowTest, TheToolOfTheCommandLineIsInTheHandAtOnce) {
  window_->hold_first("burr-round-5");
  open();
  EXPECT_TRUE(view_->holding());
  EXPECT_TRUE(view_->pointer().spindle());
  hover(middle());
  EXPECT_TRUE(until([&] {
    const auto states = view_->updater()->states();
    return !states.empty() && states.front().tool_name == "burr-round-5";
  })) << problem();
  // It is for the first room only.
  window_->practise(desk_->bone());
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  EXPECT_FALSE(view_->holding());
}

TEST_F(WindowTest, AWindowThatWatchesFollowsTheToolAndChangesNothing) {
  open();
  MainWindow other;
  other.show();
  auto* seen = other.findChild<BoneView*>("bone");
  QString address = label("connection");
  ASSERT_TRUE(until([&] {
    address = label("connection").section(' ', -1);
    return address.contains(':');
  }));
  other.watch({address, {}, {}, {}});
  ASSERT_TRUE(until([&] { return seen->surface_shown(); })) << problem();
  // The mouse works in the window above.
  window_->raise();
  window_->activateWindow();
  ASSERT_TRUE(QTest::qWaitForWindowActive(window_.get(), 30000));

  // No tool, no item and no undo, whatever is chosen.
  for (const char* name : {"undo", "redo", "mark", "put_down", "spindle"})
    EXPECT_FALSE(other.findChild<QAction*>(name)->isEnabled()) << name;
  EXPECT_EQ(other.findChild<QAction*>("undo")->toolTip(), "You only watch this room.");
  EXPECT_EQ(other.findChild<QCheckBox*>("suction_box")->toolTip(),
            "Irrigation and suction work only with a bone that you opened in this window.");
  EXPECT_EQ(other.findChild<QAction*>("save_bone")->toolTip(),
            "Only a bone that you opened in this window can be saved here.");
  EXPECT_TRUE(other.findChild<QAction*>("look_tool")->isEnabled());
  EXPECT_FALSE(other.findChild<QToolButton*>("drill")->isEnabled());
  for (const char* name : {"drill", "pin"}) other.findChild<QToolButton*>(name)->defaultAction()->trigger();
  EXPECT_FALSE(seen->holding());
  EXPECT_FALSE(seen->placing());

  // It sees the hole, and its camera is at the tool.
  drill();
  const auto off_tool_mm = [&] {
    const auto states = seen->updater()->states();
    return states.empty() ? 1e9 : (seen->camera().target_mm - states.front().pose_bone_tool.position_mm).norm();
  };
  EXPECT_TRUE(until([&] { return seen->updater()->surface().any_cut_face() && off_tool_mm() < 25.0; })) << problem();
  // The instructor sees what the trainee's hand gets, and what that device can hold.
  const auto shown = [&](const char* name) { return other.findChild<QLabel*>(name)->text(); };
  EXPECT_TRUE(until([&] { return shown("budget_words").endsWith("The device can hold: 30.0 N."); }))
      << shown("budget_words").toStdString();
  EXPECT_TRUE(until([&] { return shown("force_hand").endsWith(" N"); })) << shown("force_hand").toStdString();
  // A drag frees the camera. It stays where the user put it, until T.
  QTest::mouseRelease(view_, Qt::LeftButton, {}, middle());
  other.findChild<QAction*>("overview")->trigger();
  const CameraView free = seen->camera();
  for (int step = 0; step < 5; ++step) {
    hover(middle() + QPoint(10 * step, 0));
    QTest::qWait(100);
  }
  EXPECT_EQ(seen->camera().eye_mm, free.eye_mm);
  other.findChild<QAction*>("look_tool")->trigger();
  EXPECT_TRUE(until([&] { return off_tool_mm() < 25.0; }));
  EXPECT_NE(seen->camera().eye_mm, free.eye_mm);
}

TEST(WindowProgram, RefusesWrongOptionsWithOneSentence) {
  struct Wrong {
    std::vector<std::string> options;
    std::string says;
  };
  const Wrong all[] = {{{"--watch"}, "--server"},
                       {{"--tool", "drill-3.2"}, "--tool needs a bone: give CASE or --example"},
                       {{"--example", "femur", "--tool", "hammer"}, "--tool hammer: there is no such tool"},
                       {{"--example", "femur", "--tool", "screw-1"}, "--tool screw-1: there is no such tool"}};
  for (const Wrong& wrong : all) {
    const auto tried = test::run(test::program("osteon"), wrong.options);
    EXPECT_NE(tried.exit_code, 0);
    EXPECT_NE(tried.err.find(wrong.says), std::string::npos) << tried.err;
    EXPECT_EQ(std::count(tried.err.begin(), tried.err.end(), '\n'), 1) << tried.err;
  }
}

TEST_F(WindowTest, ABoneThatIsNoneIsRefusedWithASentence) {
  const std::filesystem::path broken = desk_->temp().path() / "broken";
  std::filesystem::create_directories(broken);
  std::ofstream(broken / "case.json") << "{}";
  window_->practise(broken);
  EXPECT_TRUE(until([&] { return !label("words").isEmpty(); }));
  EXPECT_FALSE(label("words").contains("\n"));
  EXPECT_TRUE(window_->findChild<QListWidget*>("examples")->isVisible());
}

}  // namespace
}  // namespace osteon
