// A person's hours at the window, on a screen of their own, with the real programs as its children. In each round the
// person opens the example skull, drills holes, takes one back, takes another diameter, drills once more, marks the
// moment, saves the case as a file, and closes it. Takes the minutes, and "rooms" or "room": with "room" the first room
// stays open, and at the end of each round everything in it is undone. Writes down the memory of the window and of its
// children, as they are before the case is closed. Prints JSON.
#include <gtest/gtest.h>
#include <malloc.h>

#include <QAction>
#include <QApplication>
#include <QComboBox>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QLocale>
#include <QPushButton>
#include <QStatusBar>
#include <QTest>
#include <QTimer>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tests/perf/window_user.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kHoles = 3;
constexpr double kHoleDepth_mm = 3.0;
constexpr std::chrono::seconds kHolePatience{20};
constexpr int kApart_px = 45;
constexpr double kKbPerMb = 1024.0;
constexpr std::array kChildren{"osteon-server", "osteon-haptic", "osteon-audio"};

// Resident memory and the process's share of it, MB. Zero: there is no such process.
nlohmann::json memory_of(const std::string& process) {
  std::ifstream file("/proc/" + process + "/smaps_rollup");
  double rss_mb = 0.0, pss_mb = 0.0;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("Rss:")) rss_mb = std::stod(line.substr(4)) / kKbPerMb;
    if (line.starts_with("Pss:")) pss_mb = std::stod(line.substr(4)) / kKbPerMb;
  }
  return {{"rss_mb", rss_mb}, {"pss_mb", pss_mb}};
}

// Bytes that this process has allocated and not freed, MB.
double heap_mb() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd) / (kKbPerMb * kKbPerMb);
}

// Fills the line of the next dialog, and presses Enter.
class DialogAnswer {
 public:
  explicit DialogAnswer(const QString& text) {
    QObject::connect(&timer_, &QTimer::timeout, [this, text] {
      QWidget* dialog = QApplication::activeModalWidget();
      auto* line = dialog != nullptr ? dialog->findChild<QLineEdit*>() : nullptr;
      if (line == nullptr || !line->isVisible()) return;
      timer_.stop();
      line->setText(text);
      QTest::keyClick(line, Qt::Key_Enter);
    });
    timer_.start(50);
  }
  [[nodiscard]] bool given() const { return !timer_.isActive(); }

 private:
  QTimer timer_;
};

class Person : public WindowUser {
 public:
  bool sits_down();
  bool opens();
  bool works(bool larger);
  bool undoes_all();
  bool closes();
  void leaves() { TearDown(); }
  [[nodiscard]] nlohmann::json seen() const;

 private:
  // A busy window may have said something else by the time that anybody looks.
  template <class Act, class Wait>
  bool says(const QString& sentence, Act act, Wait wait) {
    bool heard = false;
    const auto listening = QObject::connect(window_->statusBar(), &QStatusBar::messageChanged,
                                            [&](const QString& said) { heard |= said.startsWith(sentence); });
    act();
    const bool in_time = sees(sentence.toStdString(), [&] {
      if (!heard) wait();
      return heard;
    });
    QObject::disconnect(listening);
    return in_time;
  }
  template <class Act>
  bool says(const QString& sentence, Act act) {
    return says(sentence, act, [] {});
  }
  [[nodiscard]] double depth_mm() const { return QLocale().toDouble(label("depth").section(' ', 0, 0)); }
  [[nodiscard]] bool holds_chosen();
  bool finds_places();
  bool drills(const QPoint& at);
  bool takes_other_diameter(bool larger);
  bool undoes();
  bool saves();

  std::vector<QPoint> places_;  // on the bone, seen from above
  int holes_ = 0, deep_ = 0, saved_ = 0;
};

bool Person::sits_down() {
  SetUp();
  if (HasFailure()) return false;
  auto* skip = window_->findChild<QPushButton*>("tour_skip");
  if (sees("the tour", [&] { return skip->isVisible(); })) skip->click();
  return true;
}

bool Person::opens() {
  auto* examples = window_->findChild<QListWidget*>("examples");
  if (!sees("the start page", [&] { return examples->isVisible() && examples->isEnabled(); })) return false;
  QTest::mouseClick(examples->viewport(), Qt::LeftButton, {}, examples->visualItemRect(examples->item(0)).center());
  if (!sees("the skull", [&] { return view_->surface_shown(); })) return false;
  if (!sees("the pointer", [&] { return label("device") == "Pointer"; })) return false;
  trigger("above");
  return !HasFailure();
}

// A hand takes its tool to the bone before anybody sees it.
bool Person::holds_chosen() {
  hover(places_.front());
  const SceneUpdater* updater = view_->updater();
  return updater != nullptr && !updater->states().empty() &&
         updater->states().front().tool_name == view_->pointer().tool();
}

// From the picture's middle outwards.
bool Person::finds_places() {
  for (int ring = 0; ring < 6 && places_.size() <= kHoles; ++ring)
    for (int x = -ring; x <= ring; ++x)
      for (int y = -ring; y <= ring; ++y) {
        if (std::max(std::abs(x), std::abs(y)) != ring || places_.size() > kHoles) continue;
        const QPoint at = middle() + kApart_px * QPoint(x, y);
        hover(at);
        if (view_->pointer().on_bone()) places_.push_back(at);
      }
  if (places_.size() > kHoles) return true;
  tell("the skull is not in the picture");
  return false;
}

// A hand that slips presses again. A hole that the machine was too slow for stays flat.
bool Person::drills(const QPoint& at) {
  const auto rests = [&] {
    hover(at);
    return view_->pointer().on_bone() && depth_mm() < kHoleDepth_mm / 2;
  };
  if (!sees("bone under the pointer", rests)) return false;
  press(at);
  const bool deep = until(
      [&] {
        if (!view_->pointer().pushing()) release(at), press(at);
        return depth_mm() >= kHoleDepth_mm;
      },
      kHolePatience);
  release(at);
  ++holes_;
  deep_ += deep ? 1 : 0;
  return true;
}

bool Person::takes_other_diameter(bool larger) {
  const std::string before = view_->pointer().tool();
  QTest::keyClick(window_->findChild<QComboBox*>("size"), larger ? Qt::Key_Down : Qt::Key_Up);
  return sees("another diameter", [&] { return view_->pointer().tool() != before && holds_chosen(); });
}

// A push that was let go before it cut leaves nothing to undo. Then the one before it goes.
bool Person::undoes() {
  Clock::time_point pressed;
  return says(
      "Undone.", [&] { trigger("undo"), pressed = Clock::now(); },
      [&] {
        if (Clock::now() - pressed > 15s) trigger("undo"), pressed = Clock::now();
      });
}

bool Person::saves() {
  const std::filesystem::path file = desk_->temp() / ("skull-" + std::to_string(++saved_) + ".osteon");
  const DialogAnswer name(QString::fromStdString(file.string()));
  if (!says("Saved", [&] { trigger("save_bone"); })) return false;
  return name.given() && std::filesystem::remove(file);
}

bool Person::works(bool larger) {
  click_tool("drill");
  if (places_.empty() && !finds_places()) return false;
  if (!sees("the drill", [&] { return holds_chosen(); })) return false;
  for (std::size_t hole = 0; hole < kHoles; ++hole)
    if (!drills(places_[hole])) return false;
  if (!sees("a hole", [&] { return cut(); })) return false;
  if (!undoes()) return false;
  if (!takes_other_diameter(larger) || !drills(places_[kHoles])) return false;
  const DialogAnswer name("Holes");
  return says("Marked.", [&] { trigger("mark"); }) && name.given() && saves() && !HasFailure();
}

bool Person::undoes_all() {
  trigger("put_down");
  for (int push = 0; push < 100 && cut(); ++push) {
    if (!undoes()) return false;
    QTest::qWait(500);  // until the surface has come
  }
  return sees("whole bone", [&] { return !cut(); });
}

bool Person::closes() {
  trigger("start_page");
  return sees("the start page", [&] { return !view_->surface_shown() && children("osteon-server").empty(); });
}

nlohmann::json Person::seen() const {
  nlohmann::json row{{"holes", holes_}, {"deep", deep_}, {"frames", view_->frames()}, {"osteon", memory_of("self")}};
  row["osteon"]["heap_mb"] = heap_mb();
  for (const char* program : kChildren) {
    const std::vector<pid_t> found = children(program);
    row[program] = found.size() == 1 ? memory_of(std::to_string(found.front())) : memory_of("none");
  }
  return row;
}

bool work_for(Person& person, std::chrono::duration<double, std::ratio<60>> time, bool stays, nlohmann::json& rounds) {
  const Clock::time_point begin = Clock::now();
  const auto minute = [&] { return std::chrono::duration<double, std::ratio<60>>(Clock::now() - begin).count(); };
  if (!person.sits_down()) return false;
  for (int round = 0; minute() < time.count(); ++round) {
    if ((round == 0 || !stays) && !person.opens()) return false;
    if (!person.works(round % 2 == 0)) return false;
    nlohmann::json row = person.seen();
    row["minute"] = minute();
    std::fprintf(stderr, "%s\n", row.dump().c_str());
    rounds.push_back(std::move(row));
    if (!(stays ? person.undoes_all() : person.closes())) return false;
  }
  person.leaves();
  return !testing::Test::HasFailure();
}

int measure(double minutes, bool stays) {
  bool done = Person::gets_desk("osteon-window-hours");
  nlohmann::json rounds = nlohmann::json::array();
  if (done) {
    Person person;
    done = work_for(person, std::chrono::duration<double, std::ratio<60>>(minutes), stays, rounds);
  }
  Person::clears_desk();
  std::printf("%s\n", nlohmann::json{{"stays", stays}, {"rounds", rounds}}.dump().c_str());
  return done ? 0 : 1;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  const std::string_view kind = argc > 2 ? argv[2] : "";
  const double minutes = argc > 1 ? std::atof(argv[1]) : 0.0;
  if (!(minutes > 0.0) || (kind != "rooms" && kind != "room")) {
    std::fprintf(stderr, "osteon-window-hours: needs the minutes, and \"rooms\" or \"room\"\n");
    return 1;
  }
  return osteon::test::measure(minutes, kind == "room");
}
