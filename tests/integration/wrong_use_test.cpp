// The window in wrong hands: files that are no cases, a full disk, double clicks on everything, a second window, killed
// programs. It never crashes, loses nothing, and says one sentence.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <QAbstractButton>
#include <QAction>
#include <QApplication>
#include <QDialog>
#include <QDockWidget>
#include <QLabel>
#include <QListWidget>
#include <QLocale>
#include <QMenu>
#include <QPointer>
#include <QPushButton>
#include <QSettings>
#include <QStatusBar>
#include <QTest>
#include <QTimer>
#include <QToolButton>
#include <QWindow>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "common/volume/sparse_volume.hpp"
#include "server/upload_validation/case_archive.hpp"
#include "tests/integration/full_disk.hpp"
#include "tests/integration/window_bench.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/size_limit.hpp"
#include "viewer_client/desktop/child_process.hpp"
#include "viewer_client/desktop/language.hpp"
#include "viewer_client/desktop/sound_dialog.hpp"
#include "viewer_client/desktop/stale_files.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::children;
using test::content;
using test::names_in;
namespace fs = std::filesystem;

// A zombie does not: whoever has to wait for it may never do so.
bool lives(pid_t pid) {
  std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(stat, line);
  const std::size_t end = line.rfind(')');
  return end != std::string::npos && line.substr(end + 2, 1) != "Z";
}

// A number that no program has: that of one that has just ended.
pid_t dead_pid() {
  test::Process ended("true", {});
  const pid_t pid = ended.pid();
  EXPECT_EQ(ended.wait(10s), 0);
  return pid;
}

void put_bytes(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

// Closes whatever waits for an answer, as Escape does.
class Impatience : public QObject {
 public:
  Impatience() {
    connect(&timer_, &QTimer::timeout, this, [this] {
      if (QWidget* popup = QApplication::activePopupWidget()) popup->close();
      if (auto* dialog = qobject_cast<QDialog*>(QApplication::activeModalWidget())) {
        ++closed;
        dialog->reject();
      }
    });
    timer_.start(10);
  }
  int closed = 0;

 private:
  QTimer timer_;
};

class WrongUse : public test::WindowBench {
 protected:
  void SetUp() override {
    QSettings().setValue("tour/seen", true);
    speak("en");
    WindowBench::SetUp();
  }
  // The whole sentence of the status bar, which shows only its begin if it is long.
  [[nodiscard]] QString bar() const { return window_->statusBar()->toolTip(); }
  [[nodiscard]] bool at_start() const {
    return window_->findChild<QListWidget*>("examples")->isVisible() &&
           window_->findChild<QPushButton*>("open")->isEnabled();
  }
  // Waits for one sentence on the start page, from which everything can be begun again.
  [[nodiscard]] std::string refused() {
    EXPECT_TRUE(until([&] { return at_start() && !label("words").isEmpty(); })) << problem();
    EXPECT_FALSE(label("words").contains('\n')) << problem();
    return label("words").toStdString();
  }
  [[nodiscard]] fs::path copy_of_bone(const std::string& name) const {
    const fs::path to = desk_->temp() / name;
    fs::copy(desk_->bone(), to, fs::copy_options::recursive);
    return to;
  }
  // The newest session.
  [[nodiscard]] static fs::path session() {
    const auto recent = recent_entries();
    return recent.empty() ? fs::path() : recent.front().session;
  }
};

void make_newer(const fs::path& folder) {
  std::string text = content(folder / "case.json");
  const std::string key = "\"schema_version\": ";
  text.replace(text.find(key), key.size() + 1, key + "99");
  put_bytes(folder / "case.json", text);
}

// Its volumes have no sample in bone.
void make_empty(const fs::path& folder) {
  const SparseVolume outside(1.5F), nothing(0.0F);
  ASSERT_TRUE(save_volumes(folder / "bone.vdb", 0.5,
                           {{"surface", &outside},
                            {"density", &nothing},
                            {"clearance", &outside},
                            {"bone", &nothing},
                            {"tissue", &nothing}}));
}

TEST_F(WrongUse, FilesThatAreNoCaseAreRefused) {
  const fs::path newer = copy_of_bone("newer"), empty = copy_of_bone("empty");
  make_newer(newer);
  make_empty(empty);
  const auto file = [&](const char* name) { return desk_->temp() / (std::string(name) + ".osteon"); };
  ASSERT_TRUE(pack_case(desk_->bone(), file("sound"), {}));
  ASSERT_TRUE(pack_case(newer, file("newer"), {}));
  ASSERT_TRUE(pack_case(empty, file("empty"), {}));
  std::string bytes = content(file("sound"));
  put_bytes(file("half"), bytes.substr(0, bytes.size() / 2));
  for (std::size_t at = 0; (at = bytes.find("case.json")) != std::string::npos;) bytes.replace(at, 9, "../e.json");
  put_bytes(file("climbs"), bytes);
  put_bytes(file("text"), "A letter.\n");
  put_bytes(file("nothing"), "");
  const std::map<std::string, std::string> why{
      {"newer", "schema_version is 99"},      {"empty", "is empty: no sample lies in bone"},
      {"half", "is not a sound zip archive"}, {"climbs", "has an entry that"},
      {"text", "is not a zip archive"},       {"nothing", "zip archive"}};
  fs::create_directories(cases_folder());
  const auto cases = names_in(cases_folder()), outside = names_in(data_folder());
  const std::size_t sessions = recent_entries().size();
  for (const auto& [name, reason] : why) {
    window_->open_case_file(file(name.c_str()));
    const std::string said = refused();
    EXPECT_NE(said.find(name + ".osteon"), std::string::npos) << said;
    EXPECT_NE(said.find(reason), std::string::npos) << said;
  }
  EXPECT_EQ(names_in(cases_folder()), cases);
  EXPECT_EQ(names_in(data_folder()), outside);
  EXPECT_FALSE(fs::exists(desk_->temp() / "e.json"));
  // Their folders are no better.
  for (const auto& [folder, reason] : {std::pair(newer, "schema_version is 99"), std::pair(empty, "is empty")}) {
    window_->practise(folder);
    const std::string said = refused();
    EXPECT_NE(said.find(reason), std::string::npos) << said;
  }
  EXPECT_EQ(recent_entries().size(), sessions);
}

TEST(WrongDisplay, IsOneSentenceAndNoAbort) {
  // No X server has this number: the largest port is 65535, and displays begin at 6000.
  for (const auto& [display, platform] : {std::pair(":60000", "xcb"), {"", "xcb"}, {":60000", "nonsense"}}) {
    const auto tried =
        test::run(test::program("osteon"), {}, 60s, {{{"DISPLAY", display}, {"QT_QPA_PLATFORM", platform}}, {}, {}});
    EXPECT_EQ(tried.exit_code, 1);
    EXPECT_EQ(tried.err, "osteon: no window can be opened here: DISPLAY is \"" + std::string(display) +
                             "\" and QT_QPA_PLATFORM is \"" + platform +
                             "\"; start it on a desktop, or with xvfb-run\n");
  }
}

TEST_F(WrongUse, AFullDiskLeavesTheOldFileAndTheWork) {
  const fs::path folder = desk_->temp() / "disk", file = folder / "My block.osteon", picture = folder / "picture.png";
  fs::create_directory(folder);
  put_bytes(file, "what was there before");
  const test::FullDisk disk(folder.string() + "/", desk_->temp() / "control");
  open();
  disk.fill();
  window_->save_case_file(QString::fromStdString(file.string()));
  ASSERT_TRUE(until([&] { return bar().contains("make room on the disk"); })) << problem();
  EXPECT_FALSE(bar().contains('\n'));
  EXPECT_EQ(content(file), "what was there before");
  EXPECT_EQ(names_in(folder), std::set<std::string>{"My block.osteon"});
  EXPECT_TRUE(view_->surface_shown());
  disk.make_room();
  window_->save_case_file(QString::fromStdString(file.string()));
  ASSERT_TRUE(until([&] { return bar().startsWith("Saved"); })) << problem();
  EXPECT_GT(fs::file_size(file), 10000u);

  put_bytes(picture, "what was there before");
  {
    const test::SizeLimit small(1000);
    EXPECT_FALSE(view_->scene().save_png(picture));
  }
  EXPECT_EQ(content(picture), "what was there before");
  EXPECT_EQ(names_in(folder), (std::set<std::string>{"My block.osteon", "picture.png"}));
}

TEST_F(WrongUse, ADiskThatFillsUpEndsTheSessionAndKeepsTheCut) {
  const fs::path folder = desk_->temp() / "session";
  const test::FullDisk disk((folder / "session.journal").string(), desk_->temp() / "control");
  open(folder);
  drill();
  QTest::qWait(300);
  disk.fill();
  // Only a tool that cuts on notices the disk.
  EXPECT_TRUE(push_until([&] { return at_start(); })) << problem();
  const std::string said = refused();
  release(middle());
  EXPECT_NE(said.find("make room on the disk"), std::string::npos) << said;
  disk.make_room();
  open(folder);
  EXPECT_TRUE(cut());
}

// Of a program that could not write its log.
TEST_F(WrongUse, AFullDiskIsTheReasonOfAProgramWithoutAny) {
  constexpr qint64 kMiB = 1024LL * 1024;
  EXPECT_EQ(sentence_of_disk("/data", 0), "The disk with /data is full; make room on the disk.");
  EXPECT_FALSE(sentence_of_disk("/data", kMiB - 1).isEmpty());
  EXPECT_TRUE(sentence_of_disk("/data", kMiB).isEmpty());
  speak("de");
  EXPECT_EQ(sentence_of_disk("/data", 0), "Der Datenträger mit /data ist voll; schaffen Sie dort Platz.");
  speak("en");
  // This one has room.
  EXPECT_EQ(ChildProcess(QString::fromStdString((desk_->temp() / "silent.log").string())).last_sentence(), QString());
}

// As after a crash of the machine: half of the bone is there, then not even case.json.
TEST_F(WrongUse, ADamagedExampleIsMadeAnewAndItsSessionGoesOn) {
  const auto bones = example_bones();
  const auto patella = std::ranges::find(bones, QString("patella"), &ExampleBone::id);
  ASSERT_NE(patella, bones.end());
  const fs::path folder = example_folder(*patella);
  const auto sound = [&] {
    return test::run(test::program("osteon-import"), {"info", folder.string()}, 60s).exit_code == 0;
  };
  fs::create_directories(folder.parent_path());
  fs::copy(desk_->bone(), folder);
  fs::resize_file(folder / "bone.vdb", fs::file_size(folder / "bone.vdb") / 2);
  ASSERT_FALSE(sound());
  window_->open_example(*patella);
  ASSERT_TRUE(until([&] { return label("words") == patella->title + " was damaged and is made anew."; })) << problem();
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  EXPECT_TRUE(sound());
  EXPECT_NE(content(folder / "case.json").find("atella"), std::string::npos);

  const fs::path last = session();
  window_->findChild<QAction*>("start_page")->trigger();
  fs::resize_file(folder / "bone.vdb", fs::file_size(folder / "bone.vdb") / 2);
  window_->practise(folder, last);
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  EXPECT_EQ(session(), last);
  EXPECT_TRUE(sound());

  window_->findChild<QAction*>("start_page")->trigger();
  fs::remove(folder / "case.json");
  window_->open_example(*patella);
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  EXPECT_TRUE(sound());
  window_.reset();
  fs::remove_all(folder);
}

// The start page shows why a session does not open, and a sound case stays as it is.
TEST_F(WrongUse, ASoundExampleIsNotMadeAnewForAnotherFault) {
  const auto bones = example_bones();
  const auto patella = std::ranges::find(bones, QString("patella"), &ExampleBone::id);
  ASSERT_NE(patella, bones.end());
  const fs::path folder = example_folder(*patella), broken = desk_->temp() / "broken-session";
  fs::create_directories(folder.parent_path());
  fs::copy(desk_->bone(), folder);
  const std::string before = content(folder / "case.json");
  fs::create_directories(broken);
  put_bytes(broken / "session.journal", "this is no journal");
  window_->practise(folder, broken);
  EXPECT_NE(refused().find("journal"), std::string::npos);
  EXPECT_EQ(content(folder / "case.json"), before);
  fs::remove_all(folder);
}

TEST_F(WrongUse, ADoubleClickOpensASessionOnce) {
  open();
  window_->close();
  begin();
  auto* list = window_->findChild<QListWidget*>("recent");
  ASSERT_GE(list->count(), 1);
  const QPoint at = list->visualItemRect(list->item(0)).center();
  double_click(*list->viewport(), at);
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  EXPECT_EQ(children("osteon-server").size(), 1u);
}

TEST_F(WrongUse, DoubleClicksOnEverythingDoNoHarm) {
  Impatience impatience;
  // What one of them opens may be gone when the next one's turn comes.
  const auto all_buttons_twice = [&](const char* but = "") {
    std::vector<QPointer<QAbstractButton>> buttons;
    for (auto* button : window_->findChildren<QAbstractButton*>()) buttons.emplace_back(button);
    for (const auto& button : buttons)
      if (button && button->objectName() != but && button->isVisible() && button->isEnabled())
        double_click(*button, button->rect().center());
  };
  // On the page of image processing, whose last button leads back, and on the start page. Both have what opens a
  // dialog.
  window_->findChild<QPushButton*>("import")->click();
  all_buttons_twice();
  EXPECT_GE(impatience.closed, 2);
  EXPECT_TRUE(at_start());
  const int before = impatience.closed;
  all_buttons_twice("import");
  EXPECT_GE(impatience.closed, before + 2);
  EXPECT_TRUE(at_start());
  const auto all_twice = [&](const std::set<QString>& but) {
    int count = 0;
    std::vector<QPointer<QAction>> actions;
    for (auto* action : window_->findChildren<QAction*>())
      if (action->menu() == nullptr && !but.contains(action->objectName())) actions.emplace_back(action);
    for (const auto& action : actions)
      for (int time = 0; time < 2; ++time)
        if (action && action->isEnabled() && action->isVisible()) {
          action->trigger();
          ++count;
        }
    return count;
  };
  const std::set<QString> ends{"quit", "start_page"};
  all_twice(ends);
  open();
  EXPECT_GT(all_twice(ends), 100);
  all_buttons_twice();
  for (auto* dialog : window_->findChildren<QDialog*>()) dialog->close();
  QTest::qWait(50);
  EXPECT_EQ(children("osteon-server").size(), 1u);
  // The window works on.
  window_->activateWindow();
  for (auto* panel : window_->findChildren<QDockWidget*>()) panel->hide();
  drill();
  release(middle());
  window_->findChild<QAction*>("start_page")->trigger();
  window_->findChild<QAction*>("start_page")->trigger();
  EXPECT_TRUE(at_start());
  window_->findChild<QAction*>("quit")->trigger();
  window_->findChild<QAction*>("quit")->trigger();
  EXPECT_FALSE(window_->isVisible());
  QSettings().remove("window");
}

TEST_F(WrongUse, ADoubleClickPlacesOnePin) {
  open();
  window_->findChild<QToolButton*>("pin")->defaultAction()->trigger();
  double_click(middle());
  ASSERT_TRUE(until([&] { return view_->updater()->items().size() == 1; })) << problem();
  QTest::qWait(300);
  EXPECT_EQ(view_->updater()->items().size(), 1u);
}

TEST_F(WrongUse, AWindowThatIsClosedWhileItSavesFinishesTheFile) {
  const fs::path file = desk_->temp() / "closing.osteon";
  open();
  window_->save_case_file(QString::fromStdString(file.string()));
  window_->close();
  EXPECT_TRUE(window_->isVisible());
  EXPECT_TRUE(bar().startsWith("The window closes when")) << problem();
  EXPECT_TRUE(until([&] { return !window_->isVisible(); })) << problem();
  const std::string saved = content(file);
  EXPECT_GT(saved.size(), 10000u);
  // Whoever closes it once more gives up the new file, and keeps the old one.
  put_bytes(file, "what was there before");
  begin();
  open();
  window_->save_case_file(QString::fromStdString(file.string()));
  window_->close();
  window_->close();
  EXPECT_FALSE(window_->isVisible());
  EXPECT_TRUE(children("osteon-import").empty());
  EXPECT_TRUE(content(file) == "what was there before" || content(file) == saved);
  for (const std::string& name : names_in(file.parent_path())) EXPECT_EQ(name.find(".partial"), std::string::npos);
}

// The other window is a program of its own.
TEST_F(WrongUse, TwoWindowsShareSettingsAndFilesAndNoSession) {
  open();
  const fs::path mine = session();
  // Mesa's thread of the shader cache has the lowest priority. Beside busy tests a killed window would wait for it.
  test::Process other(test::program("osteon"), {desk_->bone().string()},
                      {.environment = {{"MESA_SHADER_CACHE_DISABLE", "true"}}});
  ASSERT_TRUE(until([&] { return session() != mine; })) << other.err();
  const fs::path theirs = session();
  EXPECT_EQ(recent_entries().at(1).session, mine) << "it is not lost";

  window_->practise(desk_->bone(), theirs);
  EXPECT_EQ(refused(), "Another window has this session open. Close it there, or wait until it has ended.");
  EXPECT_TRUE(other.running());
  EXPECT_EQ(children("osteon-server", std::to_string(other.pid())).size(), 1u);

  // Both save to the same file at the same time: one of both is there as a whole.
  open(mine);
  const fs::path file = desk_->temp() / "both.osteon";
  test::Process also(test::program("osteon-import"), {"pack", "--replace", desk_->bone().string(), file.string()});
  window_->save_case_file(QString::fromStdString(file.string()));
  EXPECT_TRUE(until([&] { return bar().startsWith("Saved "); })) << problem();
  EXPECT_EQ(also.wait(60s), 0) << also.err();
  const auto read =
      test::run(test::program("osteon-import"), {"unpack", file.string(), "--out", (desk_->temp() / "both").string()});
  EXPECT_EQ(read.exit_code, 0) << read.err;

  // Killed, it leaves no program behind, and its session can be gone on with here.
  std::vector<pid_t> orphans;
  for (const char* program : {"osteon-server", "osteon-haptic", "osteon-audio"})
    for (const pid_t pid : children(program, std::to_string(other.pid()))) orphans.push_back(pid);
  EXPECT_GE(orphans.size(), 2u);
  const fs::path socket = fs::path(std::getenv("XDG_RUNTIME_DIR")) / ("osteon-pointer-" + std::to_string(other.pid()));
  EXPECT_TRUE(fs::exists(socket));
  other.signal(SIGKILL);
  EXPECT_TRUE(other.wait(60s).has_value());
  EXPECT_TRUE(until([&] { return std::ranges::none_of(orphans, lives); }));
  open(theirs);
  window_.reset();
  EXPECT_FALSE(fs::exists(socket)) << "the last window clears up";
}

TEST_F(WrongUse, NoWindowForgetsTheSessionsOfOthers) {
  QSettings().remove("recent");
  const fs::path bone = desk_->bone();
  const auto keep = [&](int from) {
    for (int i = from; i < from + 6; ++i)
      remember({{}, bone, "/session-" + std::to_string(i), "My block.osteon", QDateTime::currentDateTime()});
  };
  std::thread one([&] { keep(0); }), two([&] { keep(6); });
  one.join();
  two.join();
  std::set<std::string> sessions;
  for (const RecentEntry& entry : recent_entries()) sessions.insert(entry.session.string());
  EXPECT_EQ(sessions.size(), 12u);

  // A case on a disk that is not there today.
  const fs::path away = copy_of_bone("away"), elsewhere = desk_->temp() / "elsewhere";
  remember({{}, away, "/session-away", {}, QDateTime::currentDateTime()});
  fs::rename(away, elsewhere);
  EXPECT_NE(recent_entries().front().session, "/session-away");
  remember({{}, desk_->bone(), "/session-0", {}, QDateTime::currentDateTime()});
  fs::rename(elsewhere, away);
  EXPECT_EQ(recent_entries().at(1).session, "/session-away");
  QSettings().remove("recent");
}

TEST_F(WrongUse, SessionsAreNamedInTheLanguageOfTheWindow) {
  QSettings().remove("recent");
  const ExampleBone pelvis = example_bones().back();
  fs::create_directories(cases_folder());
  fs::copy(desk_->bone(), example_folder(pelvis), fs::copy_options::recursive);
  const QDateTime when(QDate(2026, 3, 5), QTime(14, 7));
  remember({pelvis.title, example_folder(pelvis), "/a", {}, when});
  EXPECT_TRUE(recent_entries().front().title.startsWith("Pelvis, a phantom\n"))
      << recent_entries().front().title.toStdString();
  speak("de");
  const QString german = recent_entries().front().title;
  EXPECT_TRUE(german.startsWith("Becken, Phantom\n")) << german.toStdString();
  EXPECT_TRUE(german.contains("05.03.")) << german.toStdString();
  // So is what the audio client says, which speaks English.
  const QString sound =
      sound_trouble("no sound server answers (it names no device); start PulseAudio, or use --output none");
  EXPECT_TRUE(sound.startsWith("Kein Tonserver antwortet")) << sound.toStdString();
  EXPECT_EQ(sound_trouble("something new"), "something new");
  speak("en");
  // An older window has kept the title.
  QSettings settings;
  settings.beginWriteArray("recent", 1);
  settings.setArrayIndex(0);
  settings.setValue("title", "Knie, gestern");
  settings.setValue("bone", QString::fromStdString(example_folder(pelvis).string()));
  settings.setValue("session", "/old");
  settings.remove("opened");
  settings.endArray();
  EXPECT_EQ(recent_entries().front().title, "Knie, gestern");
  settings.remove("recent");
  fs::remove_all(example_folder(pelvis));
}

TEST_F(WrongUse, AnImportIsNeverTakenForAnExample) {
  const auto bones = example_bones();
  const auto tibia = std::ranges::find(bones, QString("tibia"), &ExampleBone::id);
  ASSERT_NE(tibia, bones.end());
  const fs::path before = example_folder(*tibia);
  EXPECT_NE(new_case_folder("/scans/tibia"), before) << "also while nobody has opened the example";
  // An older window has imported a scan into it.
  fs::create_directories(before);
  put_bytes(before / "case.json", R"({"title": "Right leg", "source": "DICOM CT, 9 slices"})");
  EXPECT_EQ(case_title(before), "Right leg");
  EXPECT_EQ(case_on_screen(before), "Right leg (tibia)");
  EXPECT_FALSE(can_be_made_again(before)) << "its scan may be gone";
  const fs::path now = example_folder(*tibia);
  EXPECT_NE(now, before);
  EXPECT_EQ(case_title(now), "Tibia, a phantom");
  EXPECT_NE(new_case_folder("/scans/tibia-example"), now);
  put_bytes(before / "case.json", R"({"title": "A bone", "source": "parametric phantom, tibia"})");
  EXPECT_EQ(case_title(before), "Tibia, a phantom");
  EXPECT_EQ(case_on_screen(before), "Tibia, a phantom");
  fs::remove_all(before);
}

TEST_F(WrongUse, WhatWasLeftBehindGoesWhenTheOnlyWindowCloses) {
  const std::string needed(64, 'a'), unneeded(64, 'b'), dead = std::to_string(dead_pid()),
                                                        alive = std::to_string(::getpid());
  const fs::path cases = cases_folder(), sockets = std::getenv("XDG_RUNTIME_DIR");
  const std::set<std::string> stay{needed,
                                   "my-import",
                                   "femur.partial-" + alive,
                                   "unpack-" + alive + ".log",
                                   "notes.log",
                                   std::string(63, 'c'),
                                   "sent",
                                   "sent.unsent-" + alive,
                                   "scan.unsent-" + dead,
                                   ".unsent-" + dead},
      go{unneeded, "femur.partial-" + dead, "unpack-" + dead + ".log", "unsent", "unsent.unsent-" + dead};
  fs::create_directories(cases);
  const auto put = [&](const std::string& name) {
    const bool marks = name.find(".unsent-") != std::string::npos && !name.starts_with("scan");  // a case's own name
    if (name.ends_with(".log") || marks) return put_bytes(cases / name, "words");
    fs::create_directories(cases / name);
    fs::copy_file(desk_->bone() / "case.json", cases / name / "case.json");
  };
  for (const auto& names : {stay, go}) std::ranges::for_each(names, put);
  const fs::path socket = sockets / ("osteon-sound-" + dead);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  socket.string().copy(address.sun_path, sizeof address.sun_path - 1);
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
  ASSERT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::close(fd);

  QSettings().remove("recent");
  auto all = stay;
  all.insert(go.begin(), go.end());
  { MainWindow second; }
  EXPECT_EQ(names_in(cases), all) << "another window may need it";
  remember({{}, cases / needed, "/session", "a.osteon", QDateTime::currentDateTime()});
  window_.reset();
  EXPECT_EQ(names_in(cases), stay);
  EXPECT_FALSE(fs::exists(socket));
  // Where the settings are lost, the sessions are not.
  QSettings().remove("recent");
  begin();
  EXPECT_EQ(names_in(cases), stay);
  // The first window does the same.
  window_.reset();
  remember({{}, desk_->bone(), "/session", {}, QDateTime::currentDateTime()});
  begin();
  EXPECT_FALSE(fs::exists(cases / needed));
  QSettings().remove("recent");
  for (const std::string& name : stay) fs::remove_all(cases / name);
}

TEST_F(WrongUse, AKilledAudioClientComesBackAndIsGivenUpInOneSentence) {
  open();
  pid_t killed = 0;
  const auto kill_next = [&] {
    std::vector<pid_t> now;
    EXPECT_TRUE(until([&] {
      now = children("osteon-audio");
      return now.size() == 1 && now[0] != killed;
    })) << problem();
    killed = now.empty() ? 0 : now[0];
    ASSERT_GT(killed, 0);
    EXPECT_EQ(::kill(killed, SIGKILL), 0);
  };
  kill_next();
  EXPECT_TRUE(until([&] { return bar() == "The audio client ended and starts again."; })) << problem();
  kill_next();
  kill_next();
  EXPECT_TRUE(until([&] { return bar() == "There is no sound: osteon-audio was ended by force or crashed."; }))
      << problem();
  // Bone can be cut without sound, and whoever switches the sound on again gets it.
  drill();
  release(middle());
  for (int time = 0; time < 2; ++time) window_->findChild<QAction*>("sound")->trigger();
  EXPECT_TRUE(until([&] { return children("osteon-audio").size() == 1; })) << problem();
}

TEST_F(WrongUse, AServerThatIsKilledAgainAndAgainEndsTheRoomInOneSentence) {
  open();
  pid_t killed = 0;
  for (int time = 0; time < 3; ++time) {
    std::vector<pid_t> now;
    // It must have said where it listens, or its end is a start that failed.
    ASSERT_TRUE(until([&] {
      now = children("osteon-server");
      return now.size() == 1 && now[0] != killed && fs::exists(session() / "logs" / "address");
    })) << problem();
    ASSERT_EQ(::kill(killed = now[0], SIGKILL), 0);
  }
  EXPECT_EQ(refused(), "osteon-server was ended by force or crashed.");
  const fs::path last = session();
  open(last);
}

// Somebody has changed the case on the server meanwhile. The bone of before would be another one than the room's.
TEST_F(WrongUse, ARoomThatComesBackWithAnotherCaseEndsInOneSentence) {
  const fs::path other = desk_->temp() / "other-block", file = desk_->temp() / "address-of-two";
  ASSERT_EQ(test::run(test::program("osteon-import"), {"phantom", "block", "--layers", "5:1.9", "--width", "12",
                                                       "--pitch", "0.5", "--out", other.string()})
                .exit_code,
            0);
  const auto serve = [&](const fs::path& bone, const std::string& listen) {
    return test::Process(test::program("osteon-server"),
                         {"--case", bone.string(), "--plain", "--listen", listen, "--address-file", file.string()});
  };
  test::Process server = serve(desk_->bone(), "127.0.0.1:0");
  ASSERT_TRUE(until([&] { return content(file).ends_with('\n'); })) << server.err();
  const QString address = QString::fromStdString(content(file)).trimmed();
  window_->join({address, {}, {}, {}});
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  server.signal(SIGKILL);
  EXPECT_TRUE(until([&] { return label("connection") == "Connection lost, trying again"; })) << problem();
  server = serve(other, address.toStdString());
  EXPECT_EQ(refused(),
            "the server at " + address.toStdString() + " now has another case: join the room again to see it");
  window_->join({address, {}, {}, {}});
  EXPECT_TRUE(until([&] { return view_->surface_shown(); })) << "it can be seen at once: " << problem();
}

TEST_F(WrongUse, ARoomThatOthersRunGoesAndComesBack) {
  // In a room to practise in. It ends, because the window is in one room only.
  open();
  test::Process server(test::program("osteon-server"), {"--case", desk_->bone().string(), "--plain", "--listen",
                                                        "127.0.0.1:0", "--address-file", desk_->temp() / "address"});
  ASSERT_TRUE(until([&] { return content(desk_->temp() / "address").ends_with('\n'); })) << server.err();
  const QString address = QString::fromStdString(content(desk_->temp() / "address")).trimmed();
  window_->join({address, {}, {}, {}});
  EXPECT_TRUE(children("osteon-haptic").empty());
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  ASSERT_TRUE(until([&] { return label("connection") == "Connected to " + address; })) << problem();

  server.signal(SIGKILL);
  EXPECT_TRUE(until([&] { return label("connection") == "Connection lost, trying again"; })) << problem();
  window_->findChild<QAction*>("undo")->trigger();
  server = test::Process(test::program("osteon-server"),
                         {"--case", desk_->bone().string(), "--plain", "--listen", address.toStdString()});
  EXPECT_TRUE(until([&] { return label("connection") == "Connected to " + address; })) << problem();
  EXPECT_EQ(server.terminate(), 0);

  // Nobody is there. The page says so, and everything else can be begun meanwhile and afterwards.
  window_->join({address, {}, {}, {}});
  EXPECT_EQ(label("words"), "Joining the room at " + address);
  EXPECT_FALSE(at_start());
  window_->findChild<QPushButton*>("cancel")->click();
  EXPECT_TRUE(at_start());
  window_->join({address, {}, {}, {}});
  EXPECT_TRUE(until([&] { return label("words").contains("nothing listens at"); })) << problem();
  EXPECT_TRUE(at_start());
}

}  // namespace
}  // namespace osteon
