// Whether a live C-arm takes ticks from a haptic loop on the same machine. A server, a window that looks into its room,
// and simulated operators who drill one hole each. During every second hole, in turns, the pedal of the window's C-arm
// is held. Else its pane is hidden, so that nothing of the bone's inside is fetched. Takes the number of pairs of
// holes. Prints JSON: what each operator's loop has missed, and the shots meanwhile.
#include <QAction>
#include <QDockWidget>
#include <QPushButton>
#include <QSettings>
#include <QTest>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/integration/stage.hpp"
#include "tests/perf/window_user.hpp"
#include "viewer_client/desktop/c_arm_panel.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;

constexpr double kApart_mm = 6.0;
constexpr int kHolesInRow = 5;  // the block is 40 mm wide
constexpr int kMostHoles = kHolesInRow * kHolesInRow;

class Room : public WindowUser {
 public:
  bool opens();
  // The next hole.
  bool drills(bool live, nlohmann::json& runs);
  void closes();

 private:
  [[nodiscard]] const CArmPanel& panel() const {
    return *dynamic_cast<const CArmPanel*>(window_->findChild<QWidget*>("c_arm"));
  }
  [[nodiscard]] std::uint64_t shots() const { return panel().console().totals().shots; }
  void show_panel(bool shown) {
    auto* dock = window_->findChild<QDockWidget*>("c_arm_panel");
    if (dock->isVisible() != shown) dock->toggleViewAction()->trigger();
  }
  bool begins_to_shoot();
  bool stops_to_shoot();

  std::optional<Stage> stage_;
  int holes_ = 0;
};

bool Room::opens() {
  QSettings().setValue("tour/seen", true);
  SetUp();
  stage_.emplace();
  window_->join({QString::fromStdString(stage_->address()), {}, {}, {}});
  if (!sees("the bone", [&] { return view_->surface_shown(); })) return false;
  show_panel(false);
  return true;
}

bool Room::begins_to_shoot() {
  show_panel(true);
  const auto* button = window_->findChild<QPushButton*>("c_arm_shot");
  if (!sees("the inside of the bone", [&] { return button->isEnabled(); })) return false;
  view_->setFocus();
  QTest::keyPress(view_, Qt::Key_F9);
  const std::uint64_t before = shots();
  return sees("X-rays", [&] { return shots() > before + 2; });
}

bool Room::stops_to_shoot() {
  if (!panel().console().held()) {
    tell("the pedal was not held until the hole was through");
    return false;
  }
  QTest::keyRelease(view_, Qt::Key_F9);
  const bool rests = sees("the end of the X-rays", [&] { return panel().console().idle(); });
  show_panel(false);
  return rests;
}

bool Room::drills(bool live, nlohmann::json& runs) {
  if (live && !begins_to_shoot()) return false;
  const int row = holes_ / kHolesInRow - kHolesInRow / 2, column = holes_ % kHolesInRow - kHolesInRow / 2;
  const std::string name = "hole-" + std::to_string(++holes_);
  const std::uint64_t before = shots();
  Process hand =
      stage_->start_haptic(name, {{"steps", {drill_at(column * kApart_mm, row * kApart_mm, "expert")}}}, name);
  if (!sees("the end of a hole", [&] { return !hand.running(); })) return false;
  const std::uint64_t made = shots() - before;
  if (live && !stops_to_shoot()) return false;
  const nlohmann::json summary = read_json(*stage_ / (name + ".json"));
  if (hand.wait(10s) != 0 || !summary.contains("loop")) {
    tell("osteon-haptic failed: " + hand.err());
    return false;
  }
  nlohmann::json seen = summary.at("loop");
  seen["live"] = live;
  seen["shots"] = made;
  std::fprintf(stderr, "%s\n", seen.dump().c_str());
  runs.push_back(std::move(seen));
  return true;
}

// The window first: its bench wants no program to stay behind.
void Room::closes() {
  window_.reset();
  stage_.reset();
  TearDown();
}

// Without, with, with, without, and so on, so that what rises in the meantime is in both.
int measure(int pairs) {
  bool done = Room::gets_desk("osteon-c-arm-ticks");
  nlohmann::json runs = nlohmann::json::array();
  if (done) {
    Room room;
    done = room.opens();
    for (int pair = 0; done && pair < pairs; ++pair)
      for (const bool live : {pair % 2 != 0, pair % 2 == 0}) done = done && room.drills(live, runs);
    room.closes();
    done = done && !testing::Test::HasFailure();
  }
  Room::clears_desk();
  std::printf("%s\n", nlohmann::json{{"runs", runs}}.dump().c_str());
  return done ? 0 : 1;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) try {
  const int pairs = argc > 1 ? std::atoi(argv[1]) : 0;
  if (pairs < 1 || 2 * pairs > osteon::test::kMostHoles) {
    std::fprintf(stderr, "osteon-c-arm-ticks: needs the number of pairs of holes, 1 to %d\n",
                 osteon::test::kMostHoles / 2);
    return 1;
  }
  return osteon::test::measure(pairs);
} catch (const std::exception& error) {
  std::fprintf(stderr, "osteon-c-arm-ticks: %s\n", error.what());
  return 1;
}
