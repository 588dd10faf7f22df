// Runs two simulated hands of one room as processes. Both feel it where their tools touch, and a hand is guided along
// what an expert did before. Compares what each program recorded, on the machine's common clock, and the journal.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <regex>
#include <vector>

#include "tests/integration/stage.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

Process start_recorded_hand(const Stage& stage, const std::string& name, const json& steps) {
  std::ofstream(stage / (name + "-plan.json")) << json{{"steps", steps}};
  return stage.start("osteon-haptic", {"--server", stage.address(), "--plain", "--name", name, "--plan",
                                       stage / (name + "-plan.json"), "--summary", stage / (name + ".json"), "--record",
                                       stage / (name + ".h5"), "--cache", stage / "cache"});
}

// Every 10th millisecond of a recording.
struct Moment {
  double time_ms, x_mm, y_mm, z_mm;  // of the tool's pose as held by the hand, bone frame
  double force_x_n, force_y_n;       // displayed force without the motor's, bone frame
  bool touched, led;
  // No stall of the loop in the last half second. A device shows no force during a stall, and the force grows back
  // slowly. So a guided hand swings 4 mm away and is back after 0.3 s.
  bool steady;
};
std::vector<Moment> recorded(const std::filesystem::path& file) {
  const RunResult answer = run(
      OSTEON_PYTHON,
      {"-c",
       "import sys, json, h5py, numpy as np\n"
       "f = h5py.File(sys.argv[1], 'r')\n"
       "n = len(f['data/time'])\n"
       "bits = [b.decode() if isinstance(b, bytes) else b for b in f['metadata/event_bits'][:]]\n"
       "events = f['data/events'][:n]\n"
       "bit = lambda name: (events >> bits.index(name)) & 1\n"
       "x, y, z, w = f['burr_change/view'][-1]\n"
       "turn = np.array([[1-2*(y*y+z*z), 2*(x*y-w*z), 2*(x*z+w*y)], [2*(x*y+w*z), 1-2*(x*x+z*z), 2*(y*z-w*x)],"
       " [2*(x*z-w*y), 2*(y*z+w*x), 1-2*(x*x+y*y)]])\n"
       "force = (f['drill_force_feedback/wrench'][:n, :3] - f['drill_force_feedback/motor_force'][:n]) @ turn.T\n"
       "t = f['data/mono_ns'][:n]\n"
       "stalled = np.maximum.accumulate(np.where(np.diff(t, prepend=t[:1]) > 4e6, t, 0))\n"
       "entries = np.column_stack([f['data/mono_ns'][:n] / 1e6, f['high_frequency_poses/device_pose/pose'][:n, :3], "
       "force[:, :2],"
       " bit('partner touched'), bit('hand guided'), t - stalled > 5e8])\n"
       "print(json.dumps(entries[::10].tolist()))\n",
       file},
      60s);
  EXPECT_EQ(answer.exit_code, 0) << answer.err;
  std::vector<Moment> moments;
  for (const json& entry : json::parse(answer.out, nullptr, false))
    moments.push_back({entry[0], entry[1], entry[2], entry[3], entry[4], entry[5], entry[6] != 0.0, entry[7] != 0.0,
                       entry[8] != 0.0});
  return moments;
}

// The position of an author's tool at the end of each cut, by a journal, on the room's clock.
struct Place {
  double time_ms, x_mm, y_mm, z_mm;  // bone frame
};
std::vector<Place> cuts_of(const std::filesystem::path& journal, const std::string& author) {
  const std::filesystem::path lines = journal.string() + "-" + author + ".jsonl";
  EXPECT_EQ(run(program("osteon-server"), {"export", journal, lines}, 60s).exit_code, 0);
  std::ifstream in(lines);
  std::vector<Place> places;
  for (std::string line; std::getline(in, line);) {
    const json entry = json::parse(line);
    if (!entry.at("event").contains("cut") || entry.at("event").at("cut").at("author") != author) continue;
    const json& at = entry.at("event").at("cut").at("path").back().at("position");  // in steps of 2^-10 mm
    const auto mm = [&](std::size_t i) { return at.at(i).get<double>() / 1024.0; };
    places.push_back({1e3 * entry.at("at_s").get<double>(), mm(0), mm(1), mm(2)});
  }
  return places;
}

// Largest distance between a hand and such a tool, for a part of the time in which both were there.
double apart_mm_for(double part, const std::vector<Moment>& hand, const std::vector<Place>& tool, double ahead_ms) {
  std::vector<double> apart;
  for (const Moment& moment : hand) {
    const auto next = std::ranges::lower_bound(tool, moment.time_ms - ahead_ms, {}, &Place::time_ms);
    if (next == tool.end() || (next == tool.begin() && next->time_ms > moment.time_ms - ahead_ms + 20.0)) continue;
    apart.push_back(std::hypot(moment.x_mm - next->x_mm, moment.y_mm - next->y_mm, moment.z_mm - next->z_mm));
  }
  if (apart.empty()) return 1e9;
  std::ranges::sort(apart);
  return apart[static_cast<std::size_t>(part * static_cast<double>(apart.size()))];
}

// Largest distance between a hand and the places where such a tool was in the last late_ms, for a part of the moments.
// A busy machine delays both programs. So a comparison at one time would measure the machine.
double behind_mm_for(double part, const std::vector<Moment>& hand, const std::vector<Place>& tool, double ahead_ms,
                     double late_ms) {
  std::vector<double> apart;
  for (const Moment& moment : hand) {
    const double now_ms = moment.time_ms - ahead_ms;
    double least_mm = 1e9;
    for (auto place = std::ranges::lower_bound(tool, now_ms - late_ms, {}, &Place::time_ms);
         place != tool.end() && place->time_ms < now_ms + 20.0; ++place)
      least_mm = std::min(least_mm,
                          std::hypot(moment.x_mm - place->x_mm, moment.y_mm - place->y_mm, moment.z_mm - place->z_mm));
    if (least_mm < 1e9) apart.push_back(least_mm);
  }
  if (apart.empty()) return 1e9;
  std::ranges::sort(apart);
  return apart[static_cast<std::size_t>(part * static_cast<double>(apart.size()))];
}

// The part of a hand's moments that are within_mm of where such a tool was before, for the best assignment in which
// neither goes back in time. A busy machine delays the hand, sometimes more and sometimes less. So the order is
// compared, and not the time.
double part_along(const std::vector<Moment>& hand, const std::vector<Place>& tool, double ahead_ms, double within_mm) {
  // Most moments that are assigned if the last of them has place j.
  std::vector<int> assigned(tool.size(), 0);
  for (const Moment& moment : hand) {
    int most = 0;  // of the places up to j, without this moment
    for (std::size_t j = 0; j < tool.size() && tool[j].time_ms < moment.time_ms - ahead_ms + 20.0; ++j) {
      const Place& place = tool[j];
      most = std::max(most, assigned[j]);
      if (std::hypot(moment.x_mm - place.x_mm, moment.y_mm - place.y_mm, moment.z_mm - place.z_mm) < within_mm)
        assigned[j] = most + 1;
    }
  }
  return tool.empty() || hand.empty() ? 0.0 : std::ranges::max(assigned) / static_cast<double>(hand.size());
}

struct Touches {
  int count = 0;
  double force_x_n = 0;  // mean
};
Touches touches_of(const std::vector<Moment>& hand) {
  Touches touches;
  for (const Moment& moment : hand)
    if (moment.touched) ++touches.count, touches.force_x_n += moment.force_x_n;
  if (touches.count > 0) touches.force_x_n /= touches.count;
  return touches;
}

TEST(Hands, WhoseToolsTouchBothFeelIt) {
  Stage stage(40.0);
  // Two drills of 3.2 mm enter the same bone side by side, 2.6 mm between their axes. A third one is far from both.
  constexpr double kDiameter_mm = 3.2;
  const auto drills = [&](const char* name, double x_mm, double y_mm) {
    json step = drill_at(x_mm, y_mm, "rig");
    step["to_mm"] = 10.0;
    return start_recorded_hand(stage, name, json::array({step}));
  };
  Process left = drills("left", -1.3, 0), right = drills("right", 1.3, 0), far = drills("far", 0, 14);
  for (Process* hand : {&left, &right, &far}) {
    const auto code = hand->wait(150s);
    ASSERT_TRUE(code.has_value());
    EXPECT_LE(*code, 1) << hand->err();  // 1: a drill that is pushed aside may not reach its depth
  }
  ASSERT_EQ(stage.server().terminate(), 0) << stage.server().err();

  const std::vector<Moment> of_left = recorded(stage / "left.h5"), of_right = recorded(stage / "right.h5");
  const Touches felt_left = touches_of(of_left), felt_right = touches_of(of_right);
  std::printf("left: %d moments, %.2f N; right: %d moments, %.2f N\n", felt_left.count, felt_left.force_x_n,
              felt_right.count, felt_right.force_x_n);
  EXPECT_GT(felt_left.count, 50) << "half a second";
  EXPECT_GT(felt_right.count, 50);
  EXPECT_EQ(touches_of(recorded(stage / "far.h5")).count, 0);
  // Wherever one hand felt it, the other's tool was there, by the other's own recording.
  std::map<long, const Moment*> others;
  for (const Moment& moment : of_right) others[std::lround(moment.time_ms / 10.0)] = &moment;
  int there = 0, compared = 0;
  for (const Moment& moment : of_left) {
    const auto other = others.find(std::lround(moment.time_ms / 10.0));
    if (!moment.touched || other == others.end()) continue;
    ++compared;
    there += std::hypot(moment.x_mm - other->second->x_mm, moment.y_mm - other->second->y_mm) < kDiameter_mm + 0.3;
  }
  EXPECT_GT(compared, 25);
  EXPECT_GE(there, compared * 9 / 10) << "of " << compared;
  // Each is pushed away from the other, though the walls of the holes take most of the force.
  EXPECT_LT(felt_left.force_x_n, 0.0);
  EXPECT_GT(felt_right.force_x_n, 0.0);
}

// A demonstrator repeats an expert's work from the journal, and a trainee's hand is guided along it. The trainee's own
// work is elsewhere, and an instructor has stopped them: their hand is soft, but without guidance it stays where it is.
TEST(Hands, AreLedAlongWhatAnExpertDid) {
  // The hand is up to half a second behind, and its own hold keeps it aside. A busy machine delays it more, but not
  // most of the time.
  constexpr double kBehind_ms = 700.0, kWithin_mm = 1.5;
  TempDir folder;
  Stage stage(40.0, {"--plain", "--journal", (folder / "room.journal").string()});
  const auto burr = [](double y_mm, double width_mm, double sweep_mm_per_s) {
    return json{{"action", "burr"},
                {"tool", "burr-round-5"},
                {"spindle_rpm", 20000},
                {"hand", "expert"},
                {"entry", {{"point_mm", {0.0, y_mm, 0.0}}, {"axis", {0.0, 0.0, -1.0}}}},
                {"window_mm", {width_mm, 4.0}},
                {"depth_mm", 1.0},
                {"sweep_mm_per_s", sweep_mm_per_s}};
  };
  Process expert = start_recorded_hand(stage, "expert", json::array({burr(0.0, 24.0, 10.0)}));
  ASSERT_EQ(expert.wait(120s), 0) << expert.err();

  Process console =
      stage.start("osteon-viewer", {"--console", "--server", stage.address(), "--plain", "--name", "Ada"});
  const auto ask = [&](const std::string& command) {
    console.write(command + "\n");
    return console.read_line(60s).value_or("");
  };
  // Returns the part of an answer that matches the pattern's group. Fails if the answer does not match.
  const auto told = [&](const std::string& command, const std::string& pattern) {
    const std::string answer = ask(command);
    std::smatch found;
    EXPECT_TRUE(std::regex_search(answer, found, std::regex(pattern))) << command << ": " << answer;
    return found.empty() ? std::string("0") : found[1].str();
  };
  const std::string of = told("people", "#([0-9]+) \"expert\"");
  const std::uint64_t undone_at = std::stoull(told("undo all", "^ok at ([0-9]+) events"));

  json softly = burr(12.0, 20.0, 0.5);
  softly["hand_stiffness_n_per_mm"] = softly["hand_across_n_per_mm"] = 0.3;
  Process trainee = start_recorded_hand(stage, "trainee", json::array({softly}));
  ASSERT_TRUE(
      wait_until([&] { return std::regex_search(ask("people"), std::regex("\"trainee\"[^;]* cuts [1-9]")); }, 60s))
      << trainee.err();
  (void)told("freeze trainee", "^ok at ([0-9]+)");
  (void)told("wait acknowledged trainee", "^ok at ([0-9]+)");
  const std::string cuts_before = told("people", "\"trainee\"[^;]* cuts ([0-9]+)");
  const std::string demonstrator = told("demonstrate of #" + of + " to " + std::to_string(undone_at - 1) + " speed 0.5",
                                        "^ok demonstrator #([0-9]+) cuts [0-9]{2,}");
  (void)told("guide trainee along #" + demonstrator + " share 1", "^ok at ([0-9]+)");
  ASSERT_TRUE(wait_until(
      [&] { return std::regex_search(ask("people"), std::regex("#" + demonstrator + " [^;]* away")); }, 120s));
  EXPECT_EQ(told("people", "\"trainee\"[^;]* cuts ([0-9]+)"), cuts_before) << "guided, but still stopped";
  ASSERT_TRUE(trainee.terminate(20s).has_value());
  EXPECT_EQ(ask("quit"), "ok");
  ASSERT_EQ(stage.server().terminate(), 0) << stage.server().err();

  // The expert's own recording and entries give the offset between the room's clock and that of the recordings.
  const std::vector<Moment> by_expert = recorded(stage / "expert.h5");
  const std::vector<Place> cut_by_expert = cuts_of(folder / "room.journal", of);
  const std::vector<Place> shown = cuts_of(folder / "room.journal", demonstrator);
  const auto touched = std::ranges::find_if(by_expert, [](const Moment& moment) { return moment.z_mm < 0.3; });
  ASSERT_TRUE(touched != by_expert.end() && cut_by_expert.size() > 50 && shown.size() > 50);
  double ahead_ms = 0, least_mm = 1e9;
  for (double off_ms = -500.0; off_ms <= 500.0; off_ms += 5.0) {
    const double ms = touched->time_ms - cut_by_expert.front().time_ms + off_ms;
    const double mm = apart_mm_for(0.5, by_expert, cut_by_expert, ms);
    if (mm < least_mm) least_mm = mm, ahead_ms = ms;
  }
  std::printf("the expert's cuts within %.2f mm of the expert's hand\n", least_mm);
  ASSERT_LT(least_mm, 1.0) << "the expert's cuts are where the expert's hand was";

  std::vector<Moment> led = recorded(stage / "trainee.h5");
  std::erase_if(led, [](const Moment& moment) { return !moment.led; });
  ASSERT_FALSE(led.empty());
  const double began_ms = led.front().time_ms + 1500.0;  // before that the hand is on its way there
  std::erase_if(led, [&](const Moment& m) {
    return m.time_ms < began_ms || m.time_ms > shown.back().time_ms + ahead_ms || !m.steady;
  });
  ASSERT_GT(led.size(), 100u) << "a second in which the machine did not stall";
  const auto [low, high] = std::ranges::minmax(led, {}, &Moment::y_mm);
  const double along = part_along(led, shown, ahead_ms, kWithin_mm),
               behind_mm = behind_mm_for(0.5, led, shown, ahead_ms, kBehind_ms);
  std::printf(
      "%.1f %% of %zu moments along the demonstrator's way, half within %.2f mm of the last %.0f ms, over %.1f mm\n",
      100.0 * along, led.size(), behind_mm, kBehind_ms, high.y_mm - low.y_mm);
  EXPECT_GT(along, 0.95) << trainee.err();
  EXPECT_LT(behind_mm, kWithin_mm);
  EXPECT_GT(high.y_mm - low.y_mm, 10.0) << "part of the 18 mm that the expert moved to and fro";
}

// A person without a name never counts as one who comes back: restrictions of one unnamed hand do not hold for the
// next. For a named person they do.
TEST(Hands, WithoutANameArePersonsOfTheirOwn) {
  Stage stage(24.0);
  Process console =
      stage.start("osteon-viewer", {"--console", "--server", stage.address(), "--plain", "--name", "Ada"});
  const auto ask = [&](const std::string& command) {
    console.write(command + "\n");
    return console.read_line(60s).value_or("");
  };
  const auto there = [&](const std::string& person) {
    return wait_until([&] { return std::regex_search(ask("people"), std::regex(person)); }, 60s);
  };
  ASSERT_TRUE(there("#1 \"Ada\" here you")) << console.err();
  const json steps = json::array({drill_at(0, 0, "rig"), drill_at(0, 8, "rig")});
  // They join one after the other, so that their numbers are known. 1 is the console.
  Process first = stage.start_haptic("first", {{"steps", steps}});
  ASSERT_TRUE(there("#2 \"\" here haptic")) << first.err();
  ASSERT_TRUE(ask("freeze #2").starts_with("ok"));
  Process second = stage.start_haptic("second", {{"steps", steps}});
  ASSERT_TRUE(there("#3 \"\" here haptic")) << second.err();
  EXPECT_TRUE(there("#2 \"\" here haptic frozen"));
  EXPECT_EQ(ask("people").find("#3 \"\" here haptic frozen"), std::string::npos) << "this hand is not stopped";
  ASSERT_TRUE(second.terminate(20s).has_value());

  Process ben = start_recorded_hand(stage, "ben", steps);
  ASSERT_TRUE(there("#4 \"ben\" here haptic")) << ben.err();
  ASSERT_TRUE(ask("freeze ben").starts_with("ok"));
  ASSERT_TRUE(ben.terminate(20s).has_value());
  std::filesystem::remove(stage / "ben.h5");
  Process again = start_recorded_hand(stage, "ben", steps);
  EXPECT_TRUE(there("#5 \"ben\" here haptic frozen")) << "the same person, by the name";
  ASSERT_TRUE(again.terminate(20s).has_value());
  ASSERT_TRUE(first.terminate(20s).has_value());
  EXPECT_EQ(ask("quit"), "ok");
}

}  // namespace
}  // namespace osteon::test
