#include "viewer_client/desktop/library.hpp"

#include <QCoreApplication>
#include <QDateTime>
#include <QFile>
#include <QFileInfo>
#include <QJsonDocument>
#include <QJsonObject>
#include <QLocale>
#include <QSettings>
#include <QStandardPaths>
#include <algorithm>
#include <array>
#include <utility>

#include "viewer_client/desktop/file_lock.hpp"

namespace osteon {

namespace {

constexpr int kMostRecent = 12;
// Debian's package invesalius-examples installs it.
constexpr const char* kSkullScan = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3";

std::filesystem::path path_of(const QString& text) { return text.toStdString(); }

// A text of its case.json. Empty: there is none.
QString text_in_case(const std::filesystem::path& bone, const char* key) {
  QFile file(text_of(bone / "case.json"));
  if (!file.open(QIODevice::ReadOnly)) return {};
  return QJsonDocument::fromJson(file.readAll()).object().value(key).toString();
}

// If an older window has imported a scan into the first one, the case of the example is in the second one.
std::array<std::filesystem::path, 2> folders_of(const ExampleBone& bone) {
  const std::filesystem::path first = cases_folder() / bone.id.toStdString();
  return {first, first.string() + "-example"};
}

bool is_name_of_example(const std::filesystem::path& folder) {
  for (const ExampleBone& example : example_bones())
    if (std::ranges::count(folders_of(example), folder) > 0) return true;
  return false;
}

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

std::filesystem::path example_folder(const ExampleBone& bone) {
  const auto [first, second] = folders_of(bone);
  // The source begins so. A damaged case has none, and may be made anew.
  const QString source = text_in_case(first, "source").section(',', 0, 0);
  const bool is_own = source.isEmpty() || source.endsWith(bone.how.front() == "phantom" ? " phantom" : "InVesalius CT");
  return is_own ? first : second;
}

std::filesystem::path new_case_folder(const QString& source) {
  QString name = QFileInfo(source).completeBaseName();
  if (name.isEmpty() || is_name_of_unpacked(name.toStdString())) name = "case";
  std::filesystem::path out = cases_folder() / name.toStdString();
  // The edit list or the report of a case that somebody removed may be all that is left of it.
  const auto is_taken = [](const std::filesystem::path& bone) {
    return is_name_of_example(bone) || std::filesystem::exists(bone) || std::filesystem::exists(edit_list_of(bone)) ||
           std::filesystem::exists(report_folder(bone));
  };
  for (int n = 2; is_taken(out); ++n) out = cases_folder() / (name.toStdString() + "-" + std::to_string(n));
  return out;
}

std::filesystem::path report_folder(const std::filesystem::path& bone) { return bone.string() + ".report"; }

std::filesystem::path report_page(const std::filesystem::path& bone) { return report_folder(bone) / "report.html"; }

std::filesystem::path edit_list_of(const std::filesystem::path& bone) { return bone.string() + ".edits.yaml"; }

std::filesystem::path unsent_mark(const std::filesystem::path& bone) {
  return bone.string() + ".unsent-" + std::to_string(QCoreApplication::applicationPid());
}

void remove_unused_case(const std::filesystem::path& bone) {
  std::error_code ignored;
  const auto is_it = [&](const std::filesystem::path& needed) {
    return needed == bone || std::filesystem::equivalent(needed, bone, ignored);
  };
  if (std::ranges::any_of(remembered_bones(), is_it)) return;
  for (const std::filesystem::path& part : {bone, edit_list_of(bone), report_folder(bone)})
    std::filesystem::remove_all(part, ignored);
}

std::filesystem::path new_session_folder(const std::filesystem::path& bone) {
  const std::string day = QDateTime::currentDateTime().toString("yyyy-MM-dd-HHmmss").toStdString();
  const std::filesystem::path base = data_folder() / "sessions" / (day + "-" + bone.filename().string());
  std::error_code error;
  std::filesystem::create_directories(base.parent_path(), error);
  std::filesystem::path free = base;
  for (int n = 2; !std::filesystem::create_directory(free, error) && !error; ++n)
    free = base.string() + "-" + std::to_string(n);
  return free;
}

bool is_name_of_unpacked(std::string_view name) {
  constexpr std::size_t kHashLetters = 64;
  return name.size() == kHashLetters && name.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

bool can_be_made_again(const std::filesystem::path& bone) {
  for (const ExampleBone& example : example_bones())
    if (bone == example_folder(example)) return true;
  return bone.parent_path() == cases_folder() && is_name_of_unpacked(bone.filename().string());
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
  const QString title = text_in_case(bone, "title");
  return title.isEmpty() ? text_of(bone.filename()) : title;
}

// Most scans have the title "CT", but each a folder of its own.
QString case_on_screen(const std::filesystem::path& bone) {
  QString title = case_title(bone);
  const bool of_scan = bone.parent_path() == cases_folder() && !can_be_made_again(bone);
  const QString folder = text_of(bone.filename());
  return of_scan && title != folder ? QString("%1 (%2)").arg(title, folder) : title;
}

namespace {

// As they are kept. Where `name` and `opened` are missing, an older window has kept the title.
std::vector<RecentEntry> kept_entries(QSettings& settings) {
  std::vector<RecentEntry> entries;
  const int count = settings.beginReadArray("recent");
  for (int i = 0; i < count; ++i) {
    settings.setArrayIndex(i);
    entries.push_back({settings.value("title").toString(), path_of(settings.value("bone").toString()),
                       path_of(settings.value("session").toString()), settings.value("name").toString(),
                       settings.value("opened").toDateTime()});
  }
  settings.endArray();
  return entries;
}

}  // namespace

std::vector<RecentEntry> recent_entries() {
  QSettings settings;
  std::vector<RecentEntry> entries = kept_entries(settings);
  std::erase_if(entries, [](const RecentEntry& entry) { return !is_case(entry.bone); });
  for (RecentEntry& entry : entries)
    if (entry.opened.isValid())
      // In one line, the list would cut off the time.
      entry.title = (entry.name.isEmpty() ? case_on_screen(entry.bone) : entry.name) + '\n' +
                    QLocale().toString(entry.opened, QLocale::ShortFormat);
  return entries;
}

std::vector<std::filesystem::path> remembered_bones() {
  QSettings settings;
  std::vector<std::filesystem::path> bones;
  for (RecentEntry& entry : kept_entries(settings)) bones.push_back(std::move(entry.bone));
  return bones;
}

void remember(const RecentEntry& entry) {
  std::error_code ignored;
  std::filesystem::create_directories(data_folder(), ignored);
  FileLock lock(data_folder() / "recent.lock");
  lock.wait_alone();
  QSettings settings;
  settings.sync();  // what another window has written meanwhile
  std::vector<RecentEntry> entries = kept_entries(settings);
  std::erase_if(entries, [&](const RecentEntry& old) { return old.session == entry.session; });
  entries.insert(entries.begin(), entry);
  if (entries.size() > kMostRecent) entries.resize(kMostRecent);
  settings.beginWriteArray("recent", static_cast<int>(entries.size()));
  for (int i = 0; i < static_cast<int>(entries.size()); ++i) {
    settings.setArrayIndex(i);
    const bool older = !entries[i].opened.isValid();
    older ? settings.setValue("title", entries[i].title) : settings.remove("title");
    settings.setValue("bone", text_of(entries[i].bone));
    settings.setValue("session", text_of(entries[i].session));
    settings.setValue("name", entries[i].name);
    settings.setValue("opened", entries[i].opened);
  }
  settings.endArray();
  settings.sync();  // before the lock ends
}

CaseMaker::CaseMaker(QStringList how, std::filesystem::path out, Events events)
    : out_(std::move(out)), events_(std::move(events)) {
  const std::filesystem::path log = out_.empty() ? cases_folder() / "unpack" : out_;
  how += out_.empty() ? QStringList{"--into", text_of(cases_folder())} : QStringList{"--out", text_of(out_)};
  run_ = std::make_unique<ImporterRun>(
      how, text_of(log) + '-' + QString::number(QCoreApplication::applicationPid()) + ".log",
      ImporterRun::Events{events_.progress, [this](const QString& said) { ended(said); },
                          [this](const QString& sentence) {
                            // Another window may have made the same one meanwhile.
                            const bool there = !sentence.isEmpty() && !out_.empty() && is_case(out_);
                            there ? events_.made(out_) : events_.failed(sentence);
                          }});
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
