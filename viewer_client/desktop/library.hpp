// The bones that the start page offers, and the folders where the window keeps its files. Everything is below the
// user's data folder, $XDG_DATA_HOME/osteon.
#pragma once
#include <QCoreApplication>
#include <QDateTime>
#include <QString>
#include <QStringList>
#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>
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

// A session that was opened before.
struct RecentEntry {
  QString title{};                  // for people, in the language of the window
  std::filesystem::path bone{};     // folder of the case
  std::filesystem::path session{};  // its folder
  QString name{};                   // of the file that was opened; empty: the title of the case
  QDateTime opened{};               // first
};
// Newest first; only those whose case is there now.
[[nodiscard]] std::vector<RecentEntry> recent_entries();
// Its `title` is not kept. Other windows may do the same at the same time.
void remember(const RecentEntry& entry);
// The cases of all sessions that the start page knows, there or not.
[[nodiscard]] std::vector<std::filesystem::path> remembered_bones();

[[nodiscard]] std::filesystem::path data_folder();
[[nodiscard]] std::filesystem::path cases_folder();                           // of the cases that the window has made
[[nodiscard]] std::filesystem::path example_folder(const ExampleBone& bone);  // of its case
// Of a case to import from a file or folder: its name, with a number if an example, a case, an edit list or a report
// has it. It is not made.
[[nodiscard]] std::filesystem::path new_case_folder(const QString& source);
// Of the report of a case that was made with one: beside the case.
[[nodiscard]] std::filesystem::path report_folder(const std::filesystem::path& bone);
[[nodiscard]] std::filesystem::path report_page(const std::filesystem::path& bone);  // to open in a browser
// Of the edit list of a case that image processing made: beside the case, too.
[[nodiscard]] std::filesystem::path edit_list_of(const std::filesystem::path& bone);
// A file beside a case that only was made to be sent by this program. After a kill, the case goes with the file.
[[nodiscard]] std::filesystem::path unsent_mark(const std::filesystem::path& bone);
// Removes a case with its edit list and its report, unless the start page knows a session of it.
void remove_unused_case(const std::filesystem::path& bone);
// Made at once, so that no other window takes the same one. If it cannot be made, it is not there.
[[nodiscard]] std::filesystem::path new_session_folder(const std::filesystem::path& bone);
// "unpack --into" names a folder so, by the SHA-256 of the file. An import never does.
[[nodiscard]] bool is_name_of_unpacked(std::string_view name);
// The window has made the case by itself, of an example or of a case file, and can do so again.
[[nodiscard]] bool can_be_made_again(const std::filesystem::path& bone);
// The title of a case, or the name of its folder. That of an example is translated.
[[nodiscard]] QString case_title(const std::filesystem::path& bone);
// To tell cases apart on this screen: the title, and the name of the folder if this window has made the case of a scan.
// A scan's folder may have a patient's name, so no file and no server gets this text.
[[nodiscard]] QString case_on_screen(const std::filesystem::path& bone);
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
