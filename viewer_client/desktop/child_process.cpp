#include "viewer_client/desktop/child_process.hpp"

#include <sys/prctl.h>

#include <QCoreApplication>
#include <QFile>
#include <QFileInfo>
#include <QStorageInfo>
#include <algorithm>
#include <csignal>
#include <utility>

#include "viewer_client/desktop/field_sentences.hpp"

namespace osteon {

namespace {
constexpr std::chrono::milliseconds kPatience{2000};
constexpr int kKilled_ms = 2000;  // the kernel ends it at once, except in the middle of a call to a broken disk
constexpr qint64 kFull_bytes = 1 << 20;
}  // namespace

ChildProcess::ChildProcess(const QString& log_file) : log_file_(log_file) {
  setStandardInputFile(nullDevice());
  setStandardErrorFile(log_file);
}

ChildProcess::~ChildProcess() { end(kPatience); }

void ChildProcess::ask_to_end() {
  disconnect();
  if (state() != NotRunning && !std::exchange(asked_, true)) terminate();
}

void ChildProcess::end(std::chrono::milliseconds patience) {
  ask_to_end();
  if (state() == NotRunning) return;
  if (waitForFinished(static_cast<int>(std::max(patience, std::chrono::milliseconds(0)).count()))) return;
  kill();
  waitForFinished(kKilled_ms);
}

QString ChildProcess::last_sentence() const {
  const QString said = last_line();
  if (!said.isEmpty()) return with_fields(said);
  const QString folder = QFileInfo(log_file_).absolutePath();
  const QStorageInfo disk(folder);
  // Some file systems tell no size.
  return disk.isValid() && disk.bytesTotal() > 0 ? sentence_of_disk(folder, disk.bytesAvailable()) : QString();
}

QString ChildProcess::last_line() const {
  QFile file(log_file_);
  if (!file.open(QIODevice::ReadOnly)) return {};
  constexpr qint64 kEnd = 4096;
  if (file.size() > kEnd) file.seek(file.size() - kEnd);
  const QStringList lines = QString::fromUtf8(file.readAll()).split('\n', Qt::SkipEmptyParts);
  return lines.isEmpty() ? QString() : lines.last().trimmed();
}

void ChildProcess::setupChildProcess() { ::prctl(PR_SET_PDEATHSIG, SIGTERM); }

QString sentence_of_disk(const QString& folder, qint64 available_bytes) {
  if (available_bytes >= kFull_bytes) return {};
  return QCoreApplication::translate("ChildProcess", "The disk with %1 is full; make room on the disk.").arg(folder);
}

QString program_path(const QString& name) {
  const QString beside = QCoreApplication::applicationDirPath() + '/' + name;
  return QFileInfo(beside).isExecutable() ? beside : name;
}

QString text_of(const std::filesystem::path& path) { return QString::fromStdString(path.string()); }

}  // namespace osteon
