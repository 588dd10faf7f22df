// The window on a desk of its own, and a person's hands in front of it. What all tests of the window share.
#pragma once
#include <gtest/gtest.h>
#include <sys/types.h>

#include <QTest>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/integration/desk.hpp"
#include "tests/support/wait.hpp"
#include "viewer_client/desktop/bone_view.hpp"
#include "viewer_client/desktop/main_window.hpp"

namespace osteon::test {

// The children of a process whose program has this name. `process`: a number, or "self".
[[nodiscard]] std::vector<pid_t> children(const std::string& program, const std::string& process = "self");

class WindowBench : public testing::Test {
 protected:
  // No sound server is reached, except by deploy/with-null-sink.
  static void SetUpTestSuite();
  static void TearDownTestSuite() { desk_.reset(); }
  static bool has_sound();

  void SetUp() override;
  // No child of the window stays.
  void TearDown() override;

  // A new window. An earlier one is closed.
  void begin();
  // Without a window manager nothing moves the window, and nothing but this takes the keyboard's focus.
  void show();
  template <class Condition>
  [[nodiscard]] static bool until(Condition condition, std::chrono::milliseconds patience = std::chrono::seconds(60)) {
    const auto deadline = std::chrono::steady_clock::now() + stretched(patience);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      QTest::qWait(20);
    }
    return true;
  }
  template <class Widget>
  [[nodiscard]] Widget& part(const char* name) const {
    auto* found = window_->findChild<Widget*>(name);
    if (found == nullptr) ADD_FAILURE() << name;
    return *found;
  }
  [[nodiscard]] QString label(const char* name) const;  // empty without such a label
  // Opens the block and looks at its upper side, z = 0, from above.
  void open(const std::filesystem::path& session = {});
  // What the window says, what the hand does, and what the programs of the newest session have written.
  [[nodiscard]] std::string problem() const;
  void click_tool(const char* group);
  // Takes the drill and holds the button in the middle of the picture.
  void hold_drill();
  // The same until bone goes.
  void drill();
  [[nodiscard]] bool cut() const;
  // Holds the button. The hand lets go when the picture stands still, as on a busy machine. A person presses again
  // then.
  template <class Condition>
  [[nodiscard]] bool push_until(Condition condition) {
    return until([&] {
      if (condition()) return true;
      if (view_->isVisible() && !view_->pointer().pushing()) release(middle()), press(middle());
      return false;
    });
  }
  void trigger(const char* action);
  // Undoes every push so far, with one undo for each.
  void undo_pushes();

  // The mouse, in pixels of the view. QTest's moves of a widget go through the screen's pointer, which comes late and
  // knows no pressed buttons. Its events of a window go the way that the platform's go.
  [[nodiscard]] QPoint middle() const { return {view_->width() / 2, view_->height() / 2}; }
  [[nodiscard]] QWindow* frame() const { return window_->windowHandle(); }
  [[nodiscard]] QPoint in_frame(const QPoint& at) const { return view_->mapTo(window_.get(), at); }
  void hover(const QPoint& at);
  void press(const QPoint& at) {
    ++pushes_, pressed_ = true;
    QTest::mousePress(frame(), Qt::LeftButton, {}, in_frame(at));
  }
  void release(const QPoint& at) {
    pressed_ = false;
    QTest::mouseRelease(frame(), Qt::LeftButton, {}, in_frame(at));
  }
  void double_click(const QPoint& at) { QTest::mouseDClick(frame(), Qt::LeftButton, {}, in_frame(at)); }

  // In pixels of the widget. All four events: of a widget, QTest's own sends the third one only.
  static void double_click(QWidget& widget, const QPoint& at);

  static std::unique_ptr<Desk> desk_;
  std::unique_ptr<MainWindow> window_;
  BoneView* view_ = nullptr;
  int pushes_ = 0;
  bool pressed_ = false;  // the left button, of the application and not of a window
};

}  // namespace osteon::test
