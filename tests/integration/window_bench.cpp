#include "tests/integration/window_bench.hpp"

#include <QAction>
#include <QCursor>
#include <QLabel>
#include <QPointer>
#include <QStatusBar>
#include <QToolButton>
#include <QWindow>
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "viewer_client/desktop/library.hpp"

namespace osteon::test {

namespace {

std::string logs_of_newest_session() {
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

}  // namespace

std::vector<pid_t> children(const std::string& program, const std::string& process) {
  std::vector<pid_t> found;
  std::error_code ignored;
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + process + "/task", ignored)) {
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

std::unique_ptr<Desk> WindowBench::desk_;

void WindowBench::SetUpTestSuite() {
  desk_ = std::make_unique<Desk>();
  // Nobody listens in this folder.
  if (!has_sound()) ::setenv("PULSE_SERVER", ("unix:" + (desk_->temp() / "nobody").string()).c_str(), 1);
}

bool WindowBench::has_sound() { return std::getenv("OSTEON_TEST_SOUND") != nullptr; }

void WindowBench::SetUp() {
  ASSERT_TRUE(desk_->stands()) << "Xvfb, of Debian's package xvfb, did not start";
  begin();
}

void WindowBench::TearDown() {
  // Otherwise, Qt gives the next window no moves: it keeps them for the widget that was pressed, which is gone.
  if (window_ && pressed_) release(middle());
  window_.reset();
  for (const char* program : {"osteon-server", "osteon-haptic", "osteon-audio", "osteon-import"})
    EXPECT_TRUE(children(program).empty()) << program;
}

void WindowBench::begin() {
  window_ = std::make_unique<MainWindow>();
  view_ = window_->findChild<BoneView*>("bone");
  ASSERT_NE(view_, nullptr);
  show();
}

void WindowBench::show() {
  window_->setGeometry(0, 0, 1280, 900);
  window_->show();
  window_->activateWindow();
  ASSERT_TRUE(QTest::qWaitForWindowActive(window_.get(), 30000));
  ASSERT_FALSE(window_->geometry().contains(QCursor::pos()));
}

QString WindowBench::label(const char* name) const {
  const auto* found = window_->findChild<QLabel*>(name);
  return found != nullptr ? found->text() : QString();
}

void WindowBench::open(const std::filesystem::path& session) {
  window_->practise(desk_->bone(), session);
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  view_->look_from(Vec3(0.05, -0.05, 1));
  ASSERT_TRUE(until([&] { return label("device") == "Pointer"; })) << problem();
  QTest::qWait(50);
}

std::string WindowBench::problem() const {
  return label("words").toStdString() + " / " + window_->statusBar()->currentMessage().toStdString() + " / bone " +
         label("force_bone").toStdString() + ", spindle " + label("spindle").toStdString() + ", depth " +
         label("depth").toStdString() + ", flutes " + label("flutes").toStdString() +
         (view_->pointer().pushing() ? ", pushing" : ", not pushing") +
         (view_->pointer().on_bone() ? ", on bone" : ", off bone") + " " + encode(view_->pointer().input()) +
         logs_of_newest_session();
}

void WindowBench::click_tool(const char* group) {
  auto* button = window_->findChild<QToolButton*>(group);
  ASSERT_NE(button, nullptr);
  QTest::mouseClick(button, Qt::LeftButton);
}

void WindowBench::hold_drill() {
  click_tool("drill");
  ASSERT_TRUE(until([&] {
    hover(middle());
    return view_->pointer().on_bone();
  })) << problem();
  press(middle());
}

void WindowBench::drill() {
  hold_drill();
  EXPECT_TRUE(push_until([&] { return cut(); })) << problem();
}

bool WindowBench::cut() const {
  const SceneUpdater* updater = view_->updater();
  return updater != nullptr && updater->complete() && updater->surface().any_cut_face();
}

void WindowBench::trigger(const char* action) {
  auto* found = window_->findChild<QAction*>(action);
  ASSERT_NE(found, nullptr);
  ASSERT_TRUE(found->isEnabled()) << action;
  found->trigger();
}

void WindowBench::undo_pushes() {
  for (; pushes_ > 0; --pushes_) trigger("undo");
}

void WindowBench::hover(const QPoint& at) {
  QTest::mouseMove(frame(), in_frame(at + QPoint(1, 0)));
  QTest::mouseMove(frame(), in_frame(at));
}

void WindowBench::double_click(QWidget& widget, const QPoint& at) {
  // What the first click opens may take the widget away.
  const QPointer<QWidget> there(&widget);
  QTest::mouseClick(&widget, Qt::LeftButton, {}, at);
  if (there) QTest::mouseDClick(there.data(), Qt::LeftButton, {}, at);
  if (there) QTest::mouseRelease(there.data(), Qt::LeftButton, {}, at);
}

}  // namespace osteon::test
