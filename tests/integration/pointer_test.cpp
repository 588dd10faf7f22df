// Tests a hand that a pointer leads, with real processes on this machine. The test is the window: it listens at the
// socket and says where the pointer is. Covers drilling, a window that goes away and comes back, other tools, and what
// is refused.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <stdexcept>
#include <thread>

#include "common/input/pointer_link.hpp"
#include "common/mechanics/simulated_hand.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
constexpr auto kPointerLimit = 60s;
constexpr double kPush_n = 29.0, kRadius_mm = 1.6;  // of drill-3.2

class PointerInRoom : public ::testing::Test {
 protected:
  PointerInRoom() {
    open_window();
    input_.target_mm = {2.0, -3.0, 0.0};  // of the block's upper face
    input_.rotation_bone_tool = pose_along(Vec3::Zero(), -Vec3::UnitZ()).rotation;
    input_.on_bone = true;
    input_.push_n = kPush_n;
  }
  void open_window() {
    Result<std::unique_ptr<PointerServer>> made = PointerServer::listen(socket());
    if (!made) throw std::runtime_error(made.error().message);
    window_ = std::move(*made);
  }
  [[nodiscard]] std::filesystem::path socket() const { return folder_ / "pointer"; }
  Process start(const Stage& stage, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{
        "--server",         stage.address(), "--plain",      "--device",          "pointer:" + socket().string(),
        "--tool",           "drill-3.2",     "--summary",    stage / "hand.json", "--session-log",
        stage / "hand.csv", "--cache",       stage / "cache"};
    all.insert(all.end(), more.begin(), more.end());
    return stage.start("osteon-haptic", all);
  }
  // Says again and again what the pointer wants, as a window does, until the client's answer is as asked. False: it
  // never was.
  bool say_until(const std::function<bool(const PointerOutput&)>& condition,
                 std::chrono::milliseconds patience = kPointerLimit) {
    return wait_until(
        [&] {
          window_->send(input_);
          const auto& said = window_->newest();
          return said && condition(*said);
        },
        patience);
  }
  void say_for(std::chrono::milliseconds time) {
    static_cast<void>(say_until([](const PointerOutput&) { return false; }, time));
  }
  bool say_until_rests(double within_mm = 0.5) {
    return say_until([&](const PointerOutput& said) {
      return (said.pose_bone_tool.position_mm - input_.target_mm).norm() < within_mm;
    });
  }
  // Lets the button go and presses it. Only the newest message counts, so a client that is late may miss that the
  // button was up. A person then presses again.
  bool press() {
    for (int i = 0; i < 10; ++i) {
      input_.push = false;
      say_for(200ms);
      input_.push = true;
      if (say_until([](const PointerOutput& said) { return said.pushing; }, 5s)) return true;
    }
    return false;
  }
  [[nodiscard]] double tip_z_mm() const {
    return window_->newest() ? window_->newest()->pose_bone_tool.position_mm.z() : 0.0;
  }

  TempDir folder_;
  std::unique_ptr<PointerServer> window_;
  PointerInput input_;
};

// The cells of the last whole line of a log that grows.
std::vector<std::string> last_cells(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::ate);
  const std::streamoff size = in.tellg(), tail = std::min<std::streamoff>(size, 2000);
  std::string text(static_cast<std::size_t>(std::max<std::streamoff>(tail, 0)), '\0');
  in.seekg(size - tail);
  in.read(text.data(), tail);
  const std::size_t end = text.rfind('\n');
  const std::size_t begin = end == std::string::npos || end == 0 ? std::string::npos : text.rfind('\n', end - 1);
  if (begin == std::string::npos) return {};
  std::vector<std::string> cells;
  std::istringstream line(text.substr(begin + 1, end - begin - 1));
  for (std::string cell; std::getline(line, cell, ',');) cells.push_back(cell);
  return cells;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The hand's balance at a steady feed v: its rest position follows the tool by v · 0.3 s behind, and its damper takes
// B v. So the bone gives F − (B + K · 0.3 s) v. Medians leave out the moments after a stalled tick.
void expect_balance(const Table& log) {
  constexpr double kFrom_mm = 1.6, kTo_mm = 3.0;  // the cone is in cortex, and the hand's start is over
  std::vector<double> forces, feeds;
  const std::vector<double>&z = log["tip_z_mm"], &seq = log["state_seq"], &force = log["force_physical_n"];
  constexpr std::size_t kApart = 100;
  std::size_t first = 0;  // before that the tool has no place of its own
  while (first < log.entries() && z[first] <= 0.0) ++first;
  for (std::size_t i = first + kApart; i < log.entries() && -z[i] < kTo_mm; ++i) {
    if (-z[i] < kFrom_mm) continue;
    forces.push_back(force[i]);
    feeds.push_back((z[i - kApart] - z[i]) / (1e-3 * (seq[i] - seq[i - kApart])));
  }
  ASSERT_GT(forces.size(), 100u);
  const HandParams hand = expert_hand();
  const double gives_n = kPush_n - (hand.damping_n_s_per_mm + hand.stiffness_n_per_mm * hand.follow_s) * median(feeds);
  EXPECT_NEAR(median(forces), gives_n, 0.1 * kPush_n);
}

// The block fills 0 to −30 mm along z. Before the first cut a tip deeper than this has gone through bone.
constexpr double kInside_mm = 0.1;

TEST_F(PointerInRoom, DrillsLosesItsWindowAndDrillsOn) {
  Stage stage(24.0);
  Process haptic = start(stage);
  ASSERT_TRUE(say_until_rests()) << haptic.err();
  EXPECT_EQ(window_->newest()->force_hand_n.norm(), 0.0);
  EXPECT_EQ(window_->newest()->tool, "drill-3.2");
  input_.spindle = 1.0;
  input_.push = true;
  ASSERT_TRUE(say_until([](const PointerOutput& said) { return said.depth_mm > 3.5; })) << haptic.err();
  EXPECT_TRUE(window_->newest()->pushing);

  // The window goes away in the middle of a cut: no push, no spindle, and the tool leaves the bone.
  window_.reset();
  EXPECT_TRUE(
      wait_until([&] { return haptic.err().find("device lost device=pointer") != std::string::npos; }, kPointerLimit));
  const auto lies_still = [&] {
    const std::vector<std::string> cells = last_cells(stage / "hand.csv");
    return cells.size() == 27 && cells[3] == "idle" && std::stod(cells[7]) > 1.0 && std::stod(cells[10]) == 0.0 &&
           std::stod(cells[15]) == 0.0;
  };
  EXPECT_TRUE(wait_until(lies_still, kPointerLimit)) << testing::PrintToString(last_cells(stage / "hand.csv"));
  EXPECT_TRUE(haptic.running());

  // The window comes back. Its button was held all the time, so the hand waits until it is pressed again.
  input_.source = PointerSource::game_pad;
  open_window();
  ASSERT_TRUE(say_until_rests()) << haptic.err();
  say_for(1s);
  EXPECT_FALSE(window_->newest()->pushing);
  EXPECT_GT(tip_z_mm(), 0.0);
  EXPECT_THAT(haptic.err(), testing::HasSubstr("device back device=pointer"));
  ASSERT_TRUE(press()) << haptic.err();
  ASSERT_TRUE(say_until([](const PointerOutput& said) { return said.depth_mm > 8.0; })) << haptic.err();
  EXPECT_TRUE(window_->newest()->pushing) << "marrow is no breakthrough";
  input_.push = false;
  ASSERT_TRUE(say_until([&](const PointerOutput&) { return tip_z_mm() > 0.0; })) << haptic.err();
  input_.spindle = 0.0;
  say_for(100ms);
  ASSERT_EQ(haptic.terminate(), 0) << haptic.err();

  const auto summary = read_json(stage / "hand.json");
  EXPECT_EQ(summary["device"], "pointer");
  EXPECT_EQ(summary["pointer_sources"], nlohmann::json::array({"mouse", "game pad"}));
  EXPECT_EQ(summary["device_losses"], 1);
  EXPECT_EQ(summary["force_scale"], 1.0);
  const Table log = read_table(stage / "hand.csv");
  expect_balance(log);
  // The tool came to the bone from outside.
  for (std::size_t i = 0; i < log.entries() && log["rpm"][i] < 1.0; ++i)
    ASSERT_GT(log["tip_z_mm"][i], -kInside_mm) << "at row " << i;
  // The hole is a cylinder with the drill's cone at its end, which is no taller than the drill is wide.
  double deepest_mm = 0.0;
  bool taken_up = false;
  for (const double z_mm : log["tip_z_mm"]) {
    taken_up = taken_up || z_mm > 0.0;
    if (taken_up) deepest_mm = std::max(deepest_mm, -z_mm);
  }
  EXPECT_GT(deepest_mm, 8.0);
  const double face_mm2 = std::numbers::pi * kRadius_mm * kRadius_mm;
  EXPECT_GT(summary["removed_mm3"].get<double>(), face_mm2 * (0.95 * deepest_mm - 2.0 / 3.0 * 2.0 * kRadius_mm));
  EXPECT_LT(summary["removed_mm3"].get<double>(), face_mm2 * (1.05 * deepest_mm));

  ASSERT_EQ(stage.server().terminate(), 0);
  EXPECT_EQ(read_json(stage / "server.json")["field_hash"], summary["field_hash"]);
}

TEST_F(PointerInRoom, AJumpToTheOtherSideGoesAroundTheBone) {
  constexpr double kThickness_mm = 30.0;
  const Stage stage(24.0);
  Process haptic = start(stage);
  input_.spindle = 1.0;
  for (int i = 0; i < 2; ++i) {
    input_.target_mm.z() = 0.0;
    input_.rotation_bone_tool = pose_along(Vec3::Zero(), -Vec3::UnitZ()).rotation;
    ASSERT_TRUE(say_until_rests()) << haptic.err();
    say_for(1s);
    input_.target_mm.z() = -kThickness_mm;
    input_.rotation_bone_tool = pose_along(Vec3::Zero(), Vec3::UnitZ()).rotation;
    ASSERT_TRUE(say_until_rests()) << haptic.err();
    say_for(1s);
  }
  ASSERT_EQ(haptic.terminate(), 0) << haptic.err();
  const Table log = read_table(stage / "hand.csv");
  ASSERT_GT(log.entries(), 1000u);
  int above = 0, below = 0;
  for (std::size_t i = 0; i < log.entries(); ++i) {
    const double z = log["tip_z_mm"][i];
    ASSERT_TRUE(z > -kInside_mm || z < kInside_mm - kThickness_mm) << z << " at row " << i;
    ASSERT_LT(log["force_physical_n"][i], 2.0) << "at row " << i;
    ++(z > -kInside_mm ? above : below);
  }
  EXPECT_GT(std::min(above, below), 500);
  EXPECT_EQ(read_json(stage / "hand.json")["removed_mm3"], 0.0);
}

TEST_F(PointerInRoom, TakesAnotherToolWithoutARestart) {
  Stage stage(24.0);
  Process haptic = start(stage);
  ASSERT_TRUE(say_until_rests()) << haptic.err();
  input_.tool = "burr-round-5";
  ASSERT_TRUE(say_until([](const PointerOutput& said) { return said.tool == "burr-round-5"; })) << haptic.err();
  EXPECT_EQ(window_->newest()->trouble, "");
  // The pole of a bur does not cut, so the hand tilts it.
  constexpr double kTilt_rad = 30.0 * std::numbers::pi / 180.0;
  const Vec3 axis(0.0, std::sin(kTilt_rad), -std::cos(kTilt_rad));
  input_.rotation_bone_tool = pose_along(Vec3::Zero(), axis).rotation;
  const auto along = [&](const PointerOutput& said) {
    return said.pose_bone_tool.direction(Vec3::UnitZ()).dot(axis) > 0.999;
  };
  ASSERT_TRUE(say_until(along)) << haptic.err();
  // A sphere of 2.5 mm that stays 0.3 mm clear: (2.5 + 0.3) / cos 30° - 2.5 = 0.73 mm along the axis.
  ASSERT_TRUE(say_until_rests(0.8)) << haptic.err();
  input_.spindle = 1.0;
  input_.push_n = 10.0;
  ASSERT_TRUE(press()) << haptic.err();
  ASSERT_TRUE(say_until([](const PointerOutput& said) { return said.depth_mm > 1.0; })) << haptic.err();
  input_.push = false;
  input_.spindle = 0.0;
  ASSERT_TRUE(say_until([](const PointerOutput& said) { return !said.pushing && said.depth_mm == 0.0; }));

  // A tool that takes no bone stays in its box, and the hand leaves the bone until another one is named.
  input_.tool = "guide-1";
  ASSERT_TRUE(say_until([](const PointerOutput& said) { return !said.trouble.empty(); }));
  EXPECT_THAT(window_->newest()->trouble, testing::HasSubstr("\"guide-1\" cannot be held; choose one that cuts"));
  EXPECT_EQ(window_->newest()->tool, "burr-round-5");
  EXPECT_TRUE(say_until([&](const PointerOutput&) { return tip_z_mm() > 1.0; }));
  input_.tool = "drill-3.2";
  EXPECT_TRUE(say_until([](const PointerOutput& said) { return said.tool == "drill-3.2" && said.trouble.empty(); }));
  ASSERT_EQ(haptic.terminate(), 0) << haptic.err();

  // The room knows the cuts of the second tool as its own bytes.
  const auto summary = read_json(stage / "hand.json");
  EXPECT_GT(summary["removed_mm3"].get<double>(), 1.0);
  EXPECT_EQ(summary["rejected"], 0);
  ASSERT_EQ(stage.server().terminate(), 0);
  EXPECT_EQ(read_json(stage / "server.json")["field_hash"], summary["field_hash"]);
}

// The recording leads the tool as the pointer's hand did, without a window.
TEST_F(PointerInRoom, ItsRecordingIsPlayedAgainInAnotherRoom) {
  Stage stage(24.0);
  const std::string file = stage / "hand.h5";
  Process haptic = start(stage, {"--record", file});
  ASSERT_TRUE(say_until_rests()) << haptic.err();
  input_.spindle = 1.0;
  ASSERT_TRUE(press()) << haptic.err();
  ASSERT_TRUE(say_until([&](const PointerOutput&) { return tip_z_mm() < -3.0; })) << haptic.err();
  input_.push = false;
  ASSERT_TRUE(say_until_rests()) << haptic.err();
  ASSERT_EQ(haptic.terminate(), 0) << haptic.err();
  const double removed_mm3 = read_json(stage / "hand.json")["removed_mm3"].get<double>();
  ASSERT_GT(removed_mm3, 10.0);
  ASSERT_EQ(stage.server().terminate(), 0);

  stage.start_server({"--plain"});
  const auto play = [&](const std::vector<std::string>& hand) {
    std::vector<std::string> all{"--server", stage.address(), "--plain",   "--device",          "recorded:" + file,
                                 "--cache",  stage / "cache", "--summary", stage / "again.json"};
    all.insert(all.end(), hand.begin(), hand.end());
    Process played = stage.start("osteon-haptic", all);
    const int code = played.wait(120s).value_or(-1);
    return std::pair(code, played.err());
  };
  const auto [code, err] = play({"--tool", "drill-3.2"});
  ASSERT_EQ(code, 0) << err;
  // Real threads deliver the patches, so cuts agree in size but not bit by bit.
  EXPECT_NEAR(read_json(stage / "again.json")["removed_mm3"].get<double>(), removed_mm3, 0.03 * removed_mm3);
  EXPECT_THAT(play({"--tool", "burr-round-5"}).second, testing::HasSubstr("give --tool drill-3.2"));
  std::ofstream(stage / "plan.json") << R"({"steps": [{"action": "wait", "seconds": 0.1}]})";
  EXPECT_THAT(play({"--plan", stage / "plan.json"}).second,
              testing::HasSubstr("leave out --plan and give the --tool that it began with, drill-3.2"));
}

// Only the newest message counts. The tool need not be taken anew.
TEST_F(PointerInRoom, WearAndLawOfTheToolChangeWithoutARestart) {
  const Stage stage(24.0);
  Process haptic = start(stage);
  const auto cuts_as = [&](double wear, const std::string& law) {
    return say_until([&](const PointerOutput& said) {
      return said.trouble.empty() && said.wear && std::abs(*said.wear - wear) < 0.01 && said.law == law;
    });
  };
  ASSERT_TRUE(cuts_as(1.0, "chi")) << haptic.err();
  input_.wear = 2.0;
  input_.law = "allotta";
  EXPECT_TRUE(cuts_as(2.0, "allotta")) << haptic.err();
  input_.spindle = 1.0;
  ASSERT_TRUE(say_until_rests()) << haptic.err();
  ASSERT_TRUE(press()) << haptic.err();
  ASSERT_TRUE(say_until([](const PointerOutput& said) { return said.depth_mm > 0.5; })) << haptic.err();
  input_.wear = 1.5;
  input_.law = "";
  EXPECT_TRUE(cuts_as(1.5, "chi")) << haptic.err();
  EXPECT_TRUE(window_->newest()->pushing) << "the tool stays in the bone";
  input_.push = false;

  // A law that is none, or is for others, is named. The tool leaves the bone, and keeps the law that it had.
  for (const auto& [law, says] : {std::pair("hooke", "there is no force law \"hooke\""),
                                  std::pair("saw", "the force law \"saw\" is not for a drill")}) {
    input_.law = law;
    ASSERT_TRUE(say_until([](const PointerOutput& said) { return !said.trouble.empty(); })) << haptic.err();
    EXPECT_THAT(window_->newest()->trouble, testing::HasSubstr(says));
    EXPECT_THAT(window_->newest()->trouble, testing::HasSubstr("choose one of chi, allotta"));
    EXPECT_EQ(window_->newest()->law, "chi");
    EXPECT_TRUE(say_until([&](const PointerOutput&) { return tip_z_mm() > 1.0; }));
    input_.law = "";
    EXPECT_TRUE(cuts_as(1.5, "chi")) << haptic.err();
  }
  // The wear is of the drill. Another tool is sharp.
  input_.tool = "burr-round-5";
  input_.wear.reset();
  EXPECT_TRUE(cuts_as(1.0, "milling")) << haptic.err();
  ASSERT_EQ(haptic.terminate(), 0) << haptic.err();
}

TEST_F(PointerInRoom, WhatIsWrongIsSaidBeforeAServerIsLookedFor) {
  const auto said = [&](std::vector<std::string> more) {
    std::vector<std::string> all{"--server", "127.0.0.1:1", "--plain", "--timeout", "0"};
    all.insert(all.end(), more.begin(), more.end());
    const RunResult result = run(program("osteon-haptic"), all, 20s);
    EXPECT_EQ(result.exit_code, 1);
    return result.err;
  };
  using testing::HasSubstr;
  const std::string here = "pointer:" + socket().string();
  EXPECT_THAT(said({"--device", "pointer", "--tool", "drill-3.2"}), HasSubstr("name it, pointer:SOCKET"));
  EXPECT_THAT(said({"--device", "pointer:", "--tool", "drill-3.2"}), HasSubstr("name it, pointer:SOCKET"));
  EXPECT_THAT(said({"--device", "pointer:/nowhere/p", "--tool", "drill-3.2"}),
              HasSubstr("no window listens at the pointer's socket /nowhere/p; start osteon"));
  EXPECT_THAT(said({"--device", "pointer:" + std::string(200, 'p'), "--tool", "drill-3.2"}), HasSubstr("characters"));
  EXPECT_THAT(said({"--device", here}), HasSubstr("--tool is missing"));
  EXPECT_THAT(said({"--device", here, "--plan", "plan.json"}), HasSubstr("leave out --plan and give --tool"));
  EXPECT_THAT(said({"--device", here, "--tool", "guide-1"}), HasSubstr("guide-1\" takes no bone"));
  EXPECT_THAT(said({"--device", "falcon+pointer", "--tool", "drill-3.2"}),
              HasSubstr("a pointer is named alone, as pointer:SOCKET"));
}

// A window that is too busy to take its client is alive, however many programs have asked.
TEST_F(PointerInRoom, NobodyTakesTheSocketOfAWindowThatLives) {
  for (int i = 0; i < 6; ++i) {
    const auto second = PointerServer::listen(socket());
    ASSERT_FALSE(second) << "attempt " << i;
    EXPECT_EQ(second.error().code, ErrorCode::exists) << second.error().message;
  }
  window_.reset();
  open_window();
  EXPECT_TRUE(PointerClient::connect(socket()));
}

}  // namespace
}  // namespace osteon::test
