// The first page of the window: bones to open, sessions to go on with, a CT to import, a room to join.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <functional>

#include "viewer_client/desktop/library.hpp"

class QLabel;
class QListWidget;
class QProgressBar;
class QPushButton;
class QVBoxLayout;

namespace osteon {

class StartPage : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(StartPage)

 public:
  struct Events {
    std::function<void(const ExampleBone&)> open_example;
    std::function<void(const RecentEntry&)> open_recent;
    std::function<void()> open_case, import_scan, join_room, cancel;
  };
  explicit StartPage(Events events, QWidget* parent = nullptr);

  // Reads the lists again.
  void refresh();
  // Shows that work is under way, with a button that cancels it.
  void show_work(const QString& what);
  void show_progress(int percent);
  // Work has ended. Empty: it went well. Otherwise the reason, as a sentence.
  void end_work(const QString& sentence);

 private:
  void make_lists();
  QVBoxLayout* make_buttons();
  void open_row(const QListWidget& list, int row);

  Events events_;
  QListWidget *examples_, *recent_;
  QLabel* words_;
  QProgressBar* progress_;
  QPushButton* cancel_;
  std::vector<QWidget*> choices_;  // disabled while work is under way
};

}  // namespace osteon
