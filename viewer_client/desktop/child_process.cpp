#include "viewer_client/desktop/child_process.hpp"

#include <sys/prctl.h>

#include <QCoreApplication>
#include <QFile>
#include <QFileInfo>
#include <csignal>

namespace osteon {

namespace {
constexpr int kPatience_ms = 8000;
}  // namespace

ChildProcess::ChildProcess(const QString& log_file) : log_file_(log_file) {
  setStandardInputFile(nullDevice());
  setStandardErrorFile(log_file);
}

ChildProcess::~ChildProcess() {
  // Its end is wanted now, so nobody is to hear of it.
  disconnect();
  if (state() == NotRunning) return;
  terminate();
  if (waitForFinished(kPatience_ms)) return;
  kill();
  waitForFinished(kPatience_ms);
}

QString ChildProcess::last_sentence() const {
  QFile file(log_file_);
  if (!file.open(QIODevice::ReadOnly)) return {};
  constexpr qint64 kEnd = 4096;
  if (file.size() > kEnd) file.seek(file.size() - kEnd);
  const QStringList lines = QString::fromUtf8(file.readAll()).split('\n', Qt::SkipEmptyParts);
  return lines.isEmpty() ? QString() : lines.last().trimmed();
}

void ChildProcess::setupChildProcess() { ::prctl(PR_SET_PDEATHSIG, SIGTERM); }

QString program_path(const QString& name) {
  const QString beside = QCoreApplication::applicationDirPath() + '/' + name;
  return QFileInfo(beside).isExecutable() ? beside : name;
}

QString text_of(const std::filesystem::path& path) { return QString::fromStdString(path.string()); }

}  // namespace osteon
