// A run of osteon-import as a child of the window, with its progress and its end.
#pragma once
#include <QCoreApplication>
#include <QObject>
#include <QString>
#include <QStringList>
#include <QTimer>
#include <functional>
#include <memory>

#include "viewer_client/desktop/child_process.hpp"

namespace osteon {

// [GUI thread] Its destructor ends the program, which then leaves nothing unfinished.
class ImporterRun : public QObject {
  Q_DECLARE_TR_FUNCTIONS(ImporterRun)

 public:
  struct Events {
    std::function<void(int percent)> progress;
    std::function<void(const QString& said)> done;        // what it wrote to standard output
    std::function<void(const QString& sentence)> failed;  // empty: cancelled
  };
  // `log_file` is there while the program runs. Its folder is made.
  ImporterRun(QStringList arguments, QString log_file, Events events);

  void start();
  void cancel();
  // The program ended by itself and reported an error. A crash or a signal tells nothing about its input.
  [[nodiscard]] bool refused() const { return refused_; }

 private:
  void read_progress();
  void ended(int code);

  QStringList arguments_;
  QString log_file_;
  Events events_;
  bool cancelled_ = false, refused_ = false;
  QTimer progress_timer_;
  std::unique_ptr<ChildProcess> importer_;
};

}  // namespace osteon
