// The bones that the start page offers, and the folders where the window keeps its files. Everything is below the
// user's data folder, $XDG_DATA_HOME/osteon.
#pragma once
#include <QCoreApplication>
#include <QString>
#include <QStringList>
#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "viewer_client/desktop/importer_run.hpp"

namespace osteon {

// A bone that comes with Osteon. Its case is made when it is opened first.
struct ExampleBone {
  QString id;       // "skull", or the name of a phantom
  QString title;    // for people, translated
  QStringList how;  // arguments of osteon-import without --out
};
// The skull from CT first, if its scan is installed; then the phantoms.
[[nodiscard]] std::vector<ExampleBone> example_bones();

// A bone or a session that was opened before.
struct RecentEntry {
  QString title;
  std::filesystem::path bone;     // folder of the case
  std::filesystem::path session;  // its folder
};
// Newest first; only those whose case is still there.
[[nodiscard]] std::vector<RecentEntry> recent_entries();
void remember(const RecentEntry& entry);

[[nodiscard]] std::filesystem::path data_folder();
[[nodiscard]] std::filesystem::path cases_folder();                           // of the cases that the window has made
[[nodiscard]] std::filesystem::path example_folder(const ExampleBone& bone);  // of its case
[[nodiscard]] std::filesystem::path new_session_folder(const std::filesystem::path& bone);
// The title of a case, or the name of its folder. That of an example is translated.
[[nodiscard]] QString case_title(const std::filesystem::path& bone);
[[nodiscard]] bool is_case(const std::filesystem::path& folder);
[[nodiscard]] bool is_file(const std::filesystem::path& path);  // a plain one

// Makes a case by osteon-import. It can be cancelled at any time; then nothing is left.
class CaseMaker : public QObject {
  Q_DECLARE_TR_FUNCTIONS(CaseMaker)

 public:
  struct Events {
    std::function<void(int percent)> progress;
    std::function<void(const std::filesystem::path& bone)> made;
    std::function<void(const QString& sentence)> failed;  // empty: cancelled
  };
  // `how`: arguments of osteon-import without --out. `out`: folder of the case. Empty: `how` is "unpack FILE", whose
  // folder in cases_folder() is named by the content of FILE.
  CaseMaker(QStringList how, std::filesystem::path out, Events events);

  void start();
  void cancel();

 private:
  void ended(const QString& said);

  std::filesystem::path out_;
  Events events_;
  std::unique_ptr<ImporterRun> run_;
};

}  // namespace osteon
