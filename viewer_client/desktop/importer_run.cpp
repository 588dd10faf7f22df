#include "viewer_client/desktop/importer_run.hpp"

#include <QDir>
#include <QFile>
#include <QFileInfo>
#include <utility>

namespace osteon {

namespace {
constexpr int kProgressPeriod_ms = 150;
}  // namespace

ImporterRun::ImporterRun(QStringList arguments, QString log_file, Events events)
    : arguments_(std::move(arguments)), log_file_(std::move(log_file)), events_(std::move(events)) {
  connect(&progress_timer_, &QTimer::timeout, this, [this] { read_progress(); });
}

void ImporterRun::start() {
  const QString folder = QFileInfo(log_file_).path();
  if (!QDir().mkpath(folder))
    return events_.failed(tr("Cannot make the folder %1. Choose a place where you may write.").arg(folder));
  importer_ = std::make_unique<ChildProcess>(log_file_);
  connect(importer_.get(), QOverload<int, QProcess::ExitStatus>::of(&QProcess::finished), this,
          [this](int code, QProcess::ExitStatus how) { ended(how == QProcess::NormalExit ? code : -1); });
  connect(importer_.get(), &QProcess::errorOccurred, this, [this](QProcess::ProcessError error) {
    if (error != QProcess::FailedToStart) return;
    progress_timer_.stop();
    events_.failed(tr("osteon-import is not installed. Install the package osteon-import."));
  });
  importer_->start(program_path("osteon-import"), arguments_);
  progress_timer_.start(kProgressPeriod_ms);
}

void ImporterRun::cancel() {
  cancelled_ = true;
  if (importer_) importer_->terminate();
}

void ImporterRun::read_progress() {
  QFile file(log_file_);
  if (!file.open(QIODevice::ReadOnly)) return;
  const QString all = QString::fromUtf8(file.readAll());
  // The last number before a percent sign.
  const int sign = all.lastIndexOf('%');
  if (sign < 0) return;
  int begin = sign;
  while (begin > 0 && (all[begin - 1].isDigit() || all[begin - 1] == ' ')) --begin;
  bool number = false;
  const int percent = all.mid(begin, sign - begin).trimmed().toInt(&number);
  if (number) events_.progress(percent);
}

void ImporterRun::ended(int code) {
  progress_timer_.stop();
  // One that was killed has said nothing but its progress.
  const QString why =
      code < 0 ? tr("osteon-import was ended by force or crashed. Try again.") : importer_->last_sentence();
  QFile::remove(log_file_);
  refused_ = code > 0 && !cancelled_;
  if (code == 0) return events_.done(QString::fromUtf8(importer_->readAllStandardOutput()));
  events_.failed(cancelled_ ? QString() : why.isEmpty() ? tr("osteon-import ended without a result.") : why);
}

}  // namespace osteon
