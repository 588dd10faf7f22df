#include "viewer_client/desktop/library.hpp"

#include <QCoreApplication>
#include <QDateTime>
#include <QDir>
#include <QFile>
#include <QJsonDocument>
#include <QJsonObject>
#include <QSettings>
#include <QStandardPaths>
#include <QTimer>
#include <utility>

namespace osteon {

namespace {

constexpr int kMostRecent = 12;
constexpr int kProgressPeriod_ms = 150;
// Debian's package invesalius-examples installs it.
constexpr const char* kSkullScan = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3";

std::filesystem::path path_of(const QString& text) { return text.toStdString(); }

}  // namespace

std::filesystem::path data_folder() {
  return path_of(QStandardPaths::writableLocation(QStandardPaths::GenericDataLocation)) / "osteon";
}

std::vector<ExampleBone> example_bones() {
  std::vector<ExampleBone> bones;
  if (QFile::exists(kSkullScan))
    bones.push_back({"skull",
                     QCoreApplication::translate("Library", "Human skull, from CT"),
                     {"ct", kSkullScan, "--title", "Human skull"}});
  const std::pair<const char*, QString> phantoms[] = {
      {"femur", QCoreApplication::translate("Library", "Femur, a phantom")},
      {"tibia", QCoreApplication::translate("Library", "Tibia, a phantom")},
      {"patella", QCoreApplication::translate("Library", "Patella, a phantom")},
      {"knee", QCoreApplication::translate("Library", "Knee, a phantom")},
      {"hip", QCoreApplication::translate("Library", "Hip, a phantom")},
      {"pelvis", QCoreApplication::translate("Library", "Pelvis, a phantom")}};
  for (const auto& [id, title] : phantoms) bones.push_back({id, title, {"phantom", id}});
  return bones;
}

std::filesystem::path example_folder(const ExampleBone& bone) {
  return data_folder() / "cases" / bone.id.toStdString();
}

std::filesystem::path new_session_folder(const std::filesystem::path& bone) {
  const std::string day = QDateTime::currentDateTime().toString("yyyy-MM-dd-HHmmss").toStdString();
  const std::filesystem::path base = data_folder() / "sessions" / (day + "-" + bone.filename().string());
  std::filesystem::path free = base;
  for (int n = 2; std::filesystem::exists(free); ++n) free = base.string() + "-" + std::to_string(n);
  return free;
}

bool is_case(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(folder / "case.json", ignored);
}

QString case_title(const std::filesystem::path& bone) {
  for (const ExampleBone& example : example_bones())
    if (bone == example_folder(example)) return example.title;
  QFile file(text_of(bone / "case.json"));
  QString title;
  if (file.open(QIODevice::ReadOnly))
    title = QJsonDocument::fromJson(file.readAll()).object().value("title").toString();
  return title.isEmpty() ? text_of(bone.filename()) : title;
}

std::vector<RecentEntry> recent_entries() {
  QSettings settings;
  std::vector<RecentEntry> entries;
  const int count = settings.beginReadArray("recent");
  for (int i = 0; i < count; ++i) {
    settings.setArrayIndex(i);
    RecentEntry entry{settings.value("title").toString(), path_of(settings.value("bone").toString()),
                      path_of(settings.value("session").toString())};
    if (is_case(entry.bone)) entries.push_back(std::move(entry));
  }
  settings.endArray();
  return entries;
}

void remember(const RecentEntry& entry) {
  std::vector<RecentEntry> entries = recent_entries();
  std::erase_if(entries, [&](const RecentEntry& old) { return old.session == entry.session; });
  entries.insert(entries.begin(), entry);
  if (entries.size() > kMostRecent) entries.resize(kMostRecent);
  QSettings settings;
  settings.beginWriteArray("recent", static_cast<int>(entries.size()));
  for (int i = 0; i < static_cast<int>(entries.size()); ++i) {
    settings.setArrayIndex(i);
    settings.setValue("title", entries[i].title);
    settings.setValue("bone", text_of(entries[i].bone));
    settings.setValue("session", text_of(entries[i].session));
  }
  settings.endArray();
}

CaseMaker::CaseMaker(QStringList how, std::filesystem::path out, Events events)
    : how_(std::move(how)), out_(std::move(out)), events_(std::move(events)) {
  connect(&progress_timer_, &QTimer::timeout, this, [this] { read_progress(); });
}

void CaseMaker::start() {
  const QString folder = text_of(out_.parent_path());
  if (!QDir().mkpath(folder))
    return events_.failed(tr("Cannot make the folder %1. Choose a place where you may write.").arg(folder));
  log_file_ = text_of(out_) + ".log";
  importer_ = std::make_unique<ChildProcess>(log_file_);
  connect(importer_.get(), QOverload<int, QProcess::ExitStatus>::of(&QProcess::finished), this,
          [this](int code, QProcess::ExitStatus how) { ended(how == QProcess::NormalExit ? code : -1); });
  connect(importer_.get(), &QProcess::errorOccurred, this, [this](QProcess::ProcessError error) {
    if (error != QProcess::FailedToStart) return;
    progress_timer_.stop();
    events_.failed(tr("osteon-import is not installed. Install the package osteon-import."));
  });
  importer_->start(program_path("osteon-import"), how_ + QStringList{"--out", text_of(out_)});
  progress_timer_.start(kProgressPeriod_ms);
}

void CaseMaker::cancel() {
  cancelled_ = true;
  if (importer_) importer_->terminate();
}

void CaseMaker::read_progress() {
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

void CaseMaker::ended(int code) {
  progress_timer_.stop();
  const QString why = importer_->last_sentence();
  QFile::remove(log_file_);
  if (code == 0 && is_case(out_)) return events_.made(out_);
  events_.failed(cancelled_ ? QString() : why.isEmpty() ? tr("osteon-import ended without a case.") : why);
}

}  // namespace osteon
