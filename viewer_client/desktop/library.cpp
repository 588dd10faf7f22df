#include "viewer_client/desktop/library.hpp"

#include <QCoreApplication>
#include <QDateTime>
#include <QFile>
#include <QJsonDocument>
#include <QJsonObject>
#include <QSettings>
#include <QStandardPaths>
#include <utility>

namespace osteon {

namespace {

constexpr int kMostRecent = 12;
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

std::filesystem::path cases_folder() { return data_folder() / "cases"; }

std::filesystem::path example_folder(const ExampleBone& bone) { return cases_folder() / bone.id.toStdString(); }

std::filesystem::path new_session_folder(const std::filesystem::path& bone) {
  const std::string day = QDateTime::currentDateTime().toString("yyyy-MM-dd-HHmmss").toStdString();
  const std::filesystem::path base = data_folder() / "sessions" / (day + "-" + bone.filename().string());
  std::filesystem::path free = base;
  for (int n = 2; std::filesystem::exists(free); ++n) free = base.string() + "-" + std::to_string(n);
  return free;
}

bool is_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
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
    : out_(std::move(out)), events_(std::move(events)) {
  const std::filesystem::path log =
      out_.empty() ? cases_folder() / ("unpack-" + std::to_string(QCoreApplication::applicationPid())) : out_;
  how += out_.empty() ? QStringList{"--into", text_of(cases_folder())} : QStringList{"--out", text_of(out_)};
  run_ = std::make_unique<ImporterRun>(
      how, text_of(log) + ".log",
      ImporterRun::Events{events_.progress, [this](const QString& said) { ended(said); }, events_.failed});
}

void CaseMaker::start() { run_->start(); }

void CaseMaker::cancel() { run_->cancel(); }

void CaseMaker::ended(const QString& said) {
  // "folder", blanks, and the name.
  const QString line = said.section('\n', 0, 0);
  const std::filesystem::path made =
      out_.empty() && line.startsWith("folder ") ? path_of(line.section(' ', 1, -1).trimmed()) : out_;
  if (!made.empty() && is_case(made)) return events_.made(made);
  events_.failed(tr("osteon-import ended without a case."));
}

}  // namespace osteon
