// Five short steps that point at the parts of the window. A step ends when the user does what it says, or by "Next".
// The card covers a corner only and takes no focus by itself, so whoever ignores it works on.
#pragma once
#include <QCoreApplication>
#include <QFrame>
#include <QTimer>

class QLabel;
class QPushButton;

namespace osteon {

enum class TourStep : int { open = 0, take, push, strength, undo };

// [GUI thread]
class Tour : public QFrame {
  Q_DECLARE_TR_FUNCTIONS(Tour)

 public:
  // It points at parts of the window by their names.
  explicit Tour(QWidget* window);

  // At the first start of all. Remembered, so it comes once.
  void begin_once();
  // From the menu, with the keyboard's focus. `from`: the first step that is still to be done.
  void begin(TourStep from);
  void end();
  // While it is paused, nothing of it is seen. begin() ends the pause.
  void pause(bool on);
  // The user did what a step asks for.
  void did(TourStep step);
  [[nodiscard]] bool running() const { return step_ >= 0; }

 protected:
  bool event(QEvent* event) override;

 private:
  void show_step(int step);
  void place();

  QFrame* ring_;  // about the target
  QLabel *title_, *words_;
  QPushButton *next_, *skip_;
  QTimer timer_;
  bool paused_ = false;
  int step_ = -1;  // -1: not running
};

}  // namespace osteon
