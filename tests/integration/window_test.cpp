// The window as a person uses it: real widgets, mouse and keys on a screen of its own, with the real programs as its
// children.
#include <gtest/gtest.h>
#include <signal.h>

#include <QVTKOpenGLNativeWidget.h>
#include <QApplication>
#include <QComboBox>
#include <QDropEvent>
#include <QLabel>
#include <QListWidget>
#include <QMenu>
#include <QMimeData>
#include <QSpinBox>
#include <QStackedWidget>
#include <QStatusBar>
#include <QSurfaceFormat>
#include <QTest>
#include <QToolButton>
#include <QUrl>
#include <QWheelEvent>
#include <QWindow>
#include <chrono>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/xvfb.hpp"
#include "viewer_client/desktop/bone_view.hpp"
#include "viewer_client/desktop/main_window.hpp"
#include "viewer_client/desktop/start_page.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::TempDir;
using test::Xvfb;

constexpr auto kPatience = 60s;

// The children of this process whose program has this name.
std::vector<pid_t> children(const std::string& program) {
  std::vector<pid_t> found;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream list(task.path() / "children");
    for (pid_t pid = 0; list >> pid;) {
      std::ifstream command("/proc/" + std::to_string(pid) + "/comm");
      std::string name;
      std::getline(command, name);
      if (program.starts_with(name) && !name.empty()) found.push_back(pid);
    }
  }
  return found;
}

// One screen, one application and one folder of the user's data for all tests.
class Desk {
 public:
  Desk() : screen_(Xvfb::start("1280x900")) {
    if (!screen_) return;
    ::setenv("DISPLAY", screen_->display().c_str(), 1);
    ::setenv("QT_QPA_PLATFORM", "xcb", 1);
    ::setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
    for (const char* name : {"XDG_DATA_HOME", "XDG_CONFIG_HOME", "XDG_RUNTIME_DIR"}) {
      const std::filesystem::path folder = temp_.path() / name;
      std::filesystem::create_directories(folder);
      std::filesystem::permissions(folder, std::filesystem::perms::owner_all);
      ::setenv(name, folder.c_str(), 1);
    }
    QSurfaceFormat::setDefaultFormat(QVTKOpenGLNativeWidget::defaultFormat());
    application_.emplace(count_, arguments_);
    QApplication::setApplicationName("osteon");
    QApplication::setOrganizationName("osteon");
  }
  [[nodiscard]] bool stands() const { return application_.has_value(); }
  // A block of bone, 40 mm wide: cortical layers of 5 mm above and below marrow.
  [[nodiscard]] std::filesystem::path bone() {
    const std::filesystem::path folder = temp_.path() / "block";
    if (!std::filesystem::exists(folder)) {
      const auto made =
          test::run(test::program("osteon-import"), {"phantom", "block", "--layers", "5:1.9,20:0.3,5:1.9", "--width",
                                                     "40", "--pitch", "0.5", "--out", folder.string()});
      EXPECT_EQ(made.exit_code, 0) << made.err;
    }
    return folder;
  }
  [[nodiscard]] const TempDir& temp() const { return temp_; }

 private:
  TempDir temp_;
  std::optional<Xvfb> screen_;
  int count_ = 1;
  char name_[7] = "osteon";
  char* arguments_[2] = {name_, nullptr};
  std::optional<QApplication> application_;
};

class WindowTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { desk_ = std::make_unique<Desk>(); }
  static void TearDownTestSuite() { desk_.reset(); }

  void SetUp() override {
    ASSERT_TRUE(desk_->stands()) << "Xvfb, of Debian's package xvfb, did not start";
    window_ = std::make_unique<MainWindow>();
    window_->show();
    window_->activateWindow();
    ASSERT_TRUE(QTest::qWaitForWindowExposed(window_.get()));
    view_ = window_->findChild<BoneView*>("bone");
    ASSERT_NE(view_, nullptr);
  }
  void TearDown() override {
    window_.reset();
    EXPECT_TRUE(children("osteon-server").empty());
    EXPECT_TRUE(children("osteon-haptic").empty());
  }

  template <class Condition>
  [[nodiscard]] bool until(Condition condition, std::chrono::milliseconds patience = kPatience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
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
  // Opens the block and looks at its upper side, z = 0, from above.
  void open(const std::filesystem::path& session = {}) {
    window_->practise(desk_->bone(), session);
    ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
    view_->look_from(Vec3(0.05, -0.05, 1));
    ASSERT_TRUE(until([&] { return label("device") == "Pointer"; })) << problem();
    QTest::qWait(50);
  }
  [[nodiscard]] std::string problem() const {
    return label("words").toStdString() + " / " + window_->statusBar()->currentMessage().toStdString() + " / bone " +
           label("force_bone").toStdString() + ", spindle " + label("spindle").toStdString() + ", depth " +
           label("depth").toStdString() + (view_->pointer().pushing() ? ", pushing" : ", not pushing") +
           (view_->pointer().on_bone() ? ", on bone" : ", off bone") + " " + encode(view_->pointer().input()) + logs();
  }
  // What the programs of the newest session have written.
  [[nodiscard]] static std::string logs() {
    std::string text;
    std::filesystem::path newest;
    std::error_code ignored;
    for (const auto& session : std::filesystem::directory_iterator(data_folder() / "sessions", ignored))
      newest = std::max(newest, session.path());
    for (const auto& log : std::filesystem::directory_iterator(newest / "logs", ignored)) {
      std::stringstream content;
      content << std::ifstream(log.path()).rdbuf();
      text += "\n" + log.path().filename().string() + ":\n" + content.str();
    }
    return text;
  }
  void click_tool(const char* group) {
    auto* button = window_->findChild<QToolButton*>(group);
    ASSERT_NE(button, nullptr);
    QTest::mouseClick(button, Qt::LeftButton);
  }
  [[nodiscard]] QPoint middle() const { return {view_->width() / 2, view_->height() / 2}; }
  void hover(const QPoint& at) {
    QTest::mouseMove(view_, at + QPoint(1, 0));
    QTest::mouseMove(view_, at);
  }
  [[nodiscard]] bool cut() const {
    const SceneUpdater* updater = view_->updater();
    return updater != nullptr && updater->complete() && updater->surface().any_cut_face();
  }
  // Takes the drill and holds the button in the middle of the picture until bone goes.
  void drill() {
    click_tool("drill");
    hover(middle());
    ASSERT_TRUE(until([&] { return view_->pointer().on_bone(); }));
    QTest::mousePress(view_, Qt::LeftButton, {}, middle());
    EXPECT_TRUE(until([&] { return cut(); })) << problem();
  }
  void trigger(const char* action) {
    auto* found = window_->findChild<QAction*>(action);
    ASSERT_NE(found, nullptr);
    ASSERT_TRUE(found->isEnabled()) << action;
    found->trigger();
  }

  static std::unique_ptr<Desk> desk_;
  std::unique_ptr<MainWindow> window_;
  BoneView* view_ = nullptr;
};
std::unique_ptr<Desk> WindowTest::desk_;

TEST_F(WindowTest, AMouseDrillsTheBoneAndUndoBringsItBack) {
  open();
  drill();
  QTest::mouseRelease(view_, Qt::LeftButton, {}, middle());
  const auto state = [&] { return view_->updater()->states().front(); };
  ASSERT_FALSE(view_->updater()->states().empty());
  EXPECT_EQ(state().tool_name, "drill-3.2");
  // The tool comes out of the hole by itself, and rests on whole bone beside it.
  hover(middle() + QPoint(80, 0));
  EXPECT_TRUE(until([&] { return state().pose_bone_tool.position_mm.z() > 0.1; }));
  // One undo takes back the whole push.
  trigger("undo");
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
  QApplication::sendEvent(view_, &wheel);
  EXPECT_DOUBLE_EQ(view_->pointer().push_n(), before_n + 3.0);
  EXPECT_EQ(window_->findChild<QSpinBox*>("push_set")->value(), static_cast<int>(before_n) + 3);
  EXPECT_TRUE(view_->pointer().spindle());
  QTest::keyClick(view_, Qt::Key_Space);
  EXPECT_FALSE(view_->pointer().spindle());
  QTest::keyPress(view_, Qt::Key_Shift);
  EXPECT_TRUE(view_->pointer().input().fine);
  QTest::keyRelease(view_, Qt::Key_Shift);
  EXPECT_FALSE(view_->pointer().input().fine);
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
  emit size->activated(other);
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
  QTest::mouseClick(view_, Qt::LeftButton, {}, middle());
  EXPECT_TRUE(until([&] { return view_->updater()->items().size() == 1; })) << problem();
}

TEST_F(WindowTest, ADragWithoutAToolTurnsTheBone) {
  open();
  const CameraView before = view_->camera();
  QTest::mousePress(view_, Qt::LeftButton, {}, middle());
  QTest::mouseMove(view_, middle() + QPoint(60, 0));
  QTest::mouseRelease(view_, Qt::LeftButton, {}, middle() + QPoint(60, 0));
  EXPECT_GT((view_->camera().eye_mm - before.eye_mm).norm(), 5.0);
  trigger("overview");
  EXPECT_FALSE(cut());
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
  QTest::mouseRelease(view_, Qt::LeftButton, {}, middle());
}

TEST_F(WindowTest, AKilledServerComesBackWithTheHole) {
  open();
  drill();
  QTest::mouseRelease(view_, Qt::LeftButton, {}, middle());
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
  window_->show();
  view_ = window_->findChild<BoneView*>("bone");
  const auto recent = recent_entries();
  ASSERT_FALSE(recent.empty());
  auto* list = window_->findChild<QListWidget*>("recent");
  ASSERT_GE(list->count(), 1);
  QTest::mouseClick(list->viewport(), Qt::LeftButton, {}, list->visualItemRect(list->item(0)).center());
  EXPECT_TRUE(until([&] { return view_->surface_shown() && cut(); })) << problem();
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
