// Tests what goes wrong for a person at the command line. Every program prints one sentence that names the fault and
// the remedy, and ends with a code that is not zero.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <thread>

#include "tests/integration/stage.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;

// The lines of standard error for the person, without the log: "PROGRAM: sentence".
std::vector<std::string> sentences(const std::string& err, const std::string& name) {
  std::vector<std::string> found;
  std::istringstream lines(err);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(name + ": ")) found.push_back(line);
  return found;
}

void expect_one_sentence(const RunResult& run, const std::string& name, const std::vector<std::string>& contains) {
  EXPECT_FALSE(run.timed_out) << name;
  EXPECT_GT(run.exit_code, 0) << name;
  EXPECT_LT(run.exit_code, 128) << name << " crashed: " << run.err;
  const auto said = sentences(run.err, name);
  ASSERT_EQ(said.size(), 1u) << run.err;
  for (const std::string& part : contains) EXPECT_NE(said[0].find(part), std::string::npos) << said[0];
}

class ListeningSocket {
 public:
  ListeningSocket() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address);
    ::listen(socket_, 1);
    socklen_t length = sizeof address;
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &length);
    port_ = ntohs(address.sin_port);
  }
  ~ListeningSocket() { ::close(socket_); }
  ListeningSocket(const ListeningSocket&) = delete;
  ListeningSocket& operator=(const ListeningSocket&) = delete;
  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  int socket_;
  int port_ = 0;
};

// An address on which nothing listens. The system chose the port, and it was released.
std::string deserted_address() { return ListeningSocket().address(); }

void write_plan(const std::filesystem::path& file) {
  std::ofstream(file)
      << nlohmann::json{{"steps", nlohmann::json::array({{{"action", "wait"}, {"seconds", 0.1}}})}}.dump();
}

TEST(Trouble, WithoutAServerEveryClientSaysSo) {
  const TempDir temp;
  const std::string nobody = deserted_address();
  write_plan(temp / "plan.json");
  expect_one_sentence(
      run(program("osteon-haptic"), {"--server", nobody, "--plain", "--plan", temp / "plan.json", "--timeout", "1"}),
      "osteon-haptic", {nobody, "osteon-server"});
  expect_one_sentence(
      run(program("osteon-audio"), {"--server", nobody, "--plain", "--output", "none", "--timeout", "1"}),
      "osteon-audio", {nobody, "osteon-server"});
  const auto screen = Xvfb::start();
  ASSERT_TRUE(screen);
  expect_one_sentence(
      run(program("osteon-viewer"), {"--server", nobody, "--plain", "--timeout", "1"}, 60s, screen->options()),
      "osteon-viewer", {nobody, "osteon-server"});
  expect_one_sentence(run(program("osteon-server"), {"rooms", "list", "--server", nobody, "--plain", "--timeout", "1"}),
                      "osteon-server", {nobody, "osteon-server"});
}

// A server on a slow machine listens later than somebody asks it. Without --timeout the command waits 5 s.
TEST(Trouble, ACommandWaitsForAServerThatListensLater) {
  Stage stage(8.0);
  const std::string address = stage.address();
  ASSERT_EQ(stage.server().terminate(30s), 0) << stage.server().err();
  Process list = stage.start("osteon-server", {"rooms", "list", "--server", address, "--plain", "--timeout", "250"});
  std::this_thread::sleep_for(6s);
  EXPECT_TRUE(list.running()) << list.err();
  stage.start_server({"--plain", "--listen", address});
  EXPECT_EQ(list.wait(60s), 0) << list.err();
  EXPECT_NE(list.out().find("open, at event 0"), std::string::npos) << list.out();
}

TEST(Trouble, AViewerWithoutADisplaySaysHowToGetOne) {
  ProcessOptions blind;
  blind.without = {"DISPLAY", "WAYLAND_DISPLAY"};
  expect_one_sentence(run(program("osteon-viewer"), {"--server", deserted_address(), "--plain"}, 60s, blind),
                      "osteon-viewer", {"DISPLAY"});
}

TEST(Trouble, AServerNamesThePortThatIsInUse) {
  const TempDir temp;
  ASSERT_EQ(run(program("osteon-import"),
                {"phantom", "block", "--layers", "5:1.9", "--width", "8", "--pitch", "1", "--out", temp / "case"})
                .exit_code,
            0);
  const ListeningSocket taken;
  expect_one_sentence(run(program("osteon-server"), {"--case", temp / "case", "--plain", "--listen", taken.address()}),
                      "osteon-server", {taken.address()});
}

TEST(Trouble, AServerListensToThisMachineOnly) {
  const TempDir temp;
  ASSERT_EQ(run(program("osteon-import"),
                {"phantom", "block", "--layers", "5:1.9", "--width", "8", "--pitch", "1", "--out", temp / "case"})
                .exit_code,
            0);
  expect_one_sentence(run(program("osteon-server"), {"--case", temp / "case", "--plain", "--listen", "0.0.0.0:0"}),
                      "osteon-server", {"0.0.0.0"});
}

TEST(Trouble, AServerRefusesWhatIsNotACase) {
  const TempDir temp;
  const auto serve = [&](const std::string& folder) {
    return run(program("osteon-server"), {"--case", temp / folder, "--plain"});
  };
  expect_one_sentence(serve("nothing"), "osteon-server", {"nothing", "osteon-import"});
  std::filesystem::create_directory(temp / "empty");
  expect_one_sentence(serve("empty"), "osteon-server", {"empty", "case.json"});
  std::ofstream(temp / "text") << "not a case\n";
  expect_one_sentence(serve("text"), "osteon-server", {"text"});

  ASSERT_EQ(run(program("osteon-import"),
                {"phantom", "block", "--layers", "5:1.9", "--width", "8", "--pitch", "1", "--out", temp / "case"})
                .exit_code,
            0);
  auto info = read_json(temp / "case" / "case.json");
  info["schema_version"] = 99;
  std::ofstream(temp / "case" / "case.json") << info.dump();
  expect_one_sentence(serve("case"), "osteon-server", {"schema_version", "99"});
}

TEST(Trouble, AHapticClientNamesWhatIsWrongWithItsPlan) {
  const TempDir temp;
  const auto with_plan = [&](const std::string& text) {
    std::ofstream(temp / "plan.json") << text;
    return run(program("osteon-haptic"),
               {"--server", deserted_address(), "--plain", "--plan", temp / "plan.json", "--timeout", "1"});
  };
  expect_one_sentence(
      run(program("osteon-haptic"), {"--server", deserted_address(), "--plain", "--plan", temp / "missing.json"}),
      "osteon-haptic", {"missing.json"});
  expect_one_sentence(with_plan("{"), "osteon-haptic", {"plan.json"});
  expect_one_sentence(with_plan(R"({"steps":[{"action":"saw"}]})"), "osteon-haptic", {"plan.json", "action"});
  // For a misspelt word the message gives the word that could be meant.
  expect_one_sentence(with_plan(R"({"steps":[{"action":"drill","tool":"drill-3.2","entry":{"at_mm":[0,0,0]}}]})"),
                      "osteon-haptic", {"plan.json", "step 1", "at_mm", "point_mm"});
  const auto drill = [&](const std::string& more, const std::string& entry = R"({"toward":[0,0,1]})") {
    return with_plan(R"({"steps":[{"action":"drill",)" + more + R"("entry":)" + entry + "}]}");
  };
  expect_one_sentence(drill(R"("law":"hooke",)"), "osteon-haptic", {"law", "hooke", "choose one of"});
  expect_one_sentence(drill(R"("tool":"my-drill","law":"hooke",)"), "osteon-haptic",
                      {"law", "hooke", "osteon-haptic laws"});
  // A long number must not fill the line.
  const RunResult far = drill("", R"({"toward":[1e300,0,1]})");
  expect_one_sentence(far, "osteon-haptic", {"toward", "from -100000 to 100000"});
  EXPECT_LT(far.err.size(), 300u);
  expect_one_sentence(
      run(program("osteon-haptic"), {"--server", deserted_address(), "--plain", "--plan", temp / "missing.json"}),
      "osteon-haptic", {"--plan: "});
}

TEST(Trouble, AnAddressThatIsNoneIsSaidWithOneThatIs) {
  const TempDir temp;
  write_plan(temp / "plan.json");
  expect_one_sentence(run(program("osteon-haptic"), {"--server", "nonsense", "--plain", "--plan", temp / "plan.json"}),
                      "osteon-haptic", {"nonsense is not HOST:PORT", "osteon-server prints"});
}

// No option is ignored silently.
TEST(Trouble, WhatAPlanSaysItselfIsRefusedBesideIt) {
  const TempDir temp;
  write_plan(temp / "plan.json");
  const auto beside = [&](const std::string& option, const std::string& value) {
    return run(program("osteon-haptic"), {"--server", deserted_address(), "--plain", "--timeout", "0", "--plan",
                                          temp / "plan.json", option, value});
  };
  for (const auto& [option, value] : {std::pair<std::string, std::string>{"--wear", "1"},
                                      {"--view", "front"},
                                      {"--at", "0,0,0"},
                                      {"--rpm", "0"},
                                      {"--law", "chi"}})
    expect_one_sentence(beside(option, value), "osteon-haptic", {option + " is for a hand without a plan"});
  for (const char* scale : {"0", "nan", "-0.5", "1.01", "inf"})
    expect_one_sentence(beside("--scale", scale), "osteon-haptic", {"--scale must be a number above 0"});
  for (const std::string output : {"--summary", "--cut-log", "--session-log", "--record"})
    for (const std::string place : {"/nowhere/at/all", "/proc/y.h5"})
      expect_one_sentence(beside(output, place), "osteon-haptic", {place, "give " + output + " a file in a folder"});
  std::ofstream(temp / "mine.h5") << "hours of work";
  expect_one_sentence(beside("--record", temp / "mine.h5"), "osteon-haptic", {"mine.h5 already", "--record"});
  EXPECT_EQ(std::filesystem::file_size(temp / "mine.h5"), 13u);
}

// A plan uses a tool of the server's own, with a force law of its own.
TEST(Trouble, AToolOfTheRoomsOwnIsTakenIntoTheHandAndAnUnknownOneNamed) {
  const TempDir tools;
  std::ofstream(tools / "my-drill.yaml")
      << "name: my-drill\ntitle: My drill\nkind: drill\ndiameter_mm: 4\ncutting_length_mm: 40\n"
         "point_angle_deg: 118\nshank_diameter_mm: 4\nshank_length_mm: 40\nspindle_rpm: 1000\n"
         "teeth: 2\nfeed_mm_per_rev: 0.05\ncut_level: 2\nlaw: allotta\n";
  Stage stage(16.0, {"--plain", "--tools", tools.path()});
  nlohmann::json step = drill_at(0, 0, "rig");
  step["tool"] = "my-drill";
  step["feed_mm_per_s"] = 4.0;
  step["to_mm"] = 5.0;
  const auto plan = stage / "own.json";
  std::ofstream(plan) << nlohmann::json{{"steps", nlohmann::json::array({step})}}.dump();
  Process own =
      stage.start("osteon-haptic", {"--server", stage.address(), "--plain", "--plan", plan, "--cache", stage / "cache",
                                    "--summary", stage / "own-summary.json", "--record", stage / "own.h5"});
  ASSERT_EQ(own.wait(60s), 0) << own.err();
  auto summary = read_json(stage / "own-summary.json");
  EXPECT_EQ(summary["steps"][0]["tool"], "my-drill");
  EXPECT_EQ(summary["steps"][0]["completed"], true);
  // A cylinder of 4 mm, except for its point of 1.2 mm.
  const double cylinder_mm3 = 3.14159 * 4.0 * (summary["steps"][0]["deepest_mm"].get<double>() - 2.0 / 3.0 * 1.2);
  EXPECT_NEAR(summary["removed_mm3"].get<double>(), cylinder_mm3, 0.1 * cylinder_mm3);
  EXPECT_EQ(summary["steps"][0]["law"], "allotta");  // by the tool's file

  const auto refused = [&](const nlohmann::json& wrong) {
    std::ofstream(plan) << nlohmann::json{{"steps", nlohmann::json::array({wrong})}}.dump();
    return run(program("osteon-haptic"),
               {"--server", stage.address(), "--plain", "--plan", plan, "--cache", stage / "cache"});
  };
  step["tool"] = "drill-99";
  expect_one_sentence(refused(step), "osteon-haptic", {"own.json", "step 1", "drill-99", "my-drill"});
  step["tool"] = "my-drill";
  step["law"] = "saw";
  expect_one_sentence(refused(step), "osteon-haptic", {"own.json", "step 1", "my-drill", "not for a drill"});

  // A recording of one tool or entry site cannot be played with another.
  const std::string recorded = "recorded:" + (stage / "own.h5").string();
  step.erase("law");
  const auto played = [&](const nlohmann::json& with) {
    std::ofstream(plan) << nlohmann::json{{"steps", nlohmann::json::array({with})}}.dump();
    return run(program("osteon-haptic"), {"--server", stage.address(), "--plain", "--plan", plan, "--cache",
                                          stage / "cache", "--device", recorded});
  };
  step["tool"] = "drill-3.2";
  expect_one_sentence(played(step), "osteon-haptic", {"my-drill, not with drill-3.2"});
  step["tool"] = "my-drill";
  step["to_mm"] = 6.0;
  expect_one_sentence(played(step), "osteon-haptic", {"another plan"});
  step["to_mm"] = 5.0;
  ASSERT_EQ(run(program("osteon-import"), {"phantom", "block", "--layers", "10:1.9", "--width", "16", "--pitch", "0.5",
                                           "--title", "Other", "--out", stage / "other"})
                .exit_code,
            0);
  Process other = stage.start("osteon-server", {"--case", stage / "other", "--plain", "--tools", tools.path(),
                                                "--address-file", stage / "other-address"});
  const auto address = wait_for_address(stage / "other-address", 60s);
  ASSERT_TRUE(address) << other.err();
  std::ofstream(plan) << nlohmann::json{{"steps", nlohmann::json::array({step})}}.dump();
  expect_one_sentence(run(program("osteon-haptic"), {"--server", *address, "--plain", "--plan", plan, "--cache",
                                                     stage / "cache", "--device", recorded}),
                      "osteon-haptic", {"another bone"});
}

// A step that gives up ends the session. The session reports what was done, one sentence, and no success.
TEST(Trouble, AStepThatDoesNotFinishIsSaid) {
  Stage stage(16.0);
  // So blunt and slow a drill advances by only a millimetre or two in the time limit.
  nlohmann::json step = drill_at(0, 0, "rig");
  step["to_mm"] = 29.0;
  step["feed_mm_per_s"] = 20.0;
  step["spindle_rpm"] = 100.0;
  step["wear"] = 5.0;
  Process haptic = stage.start_haptic("soft", {{"steps", nlohmann::json::array({step})}});
  const auto code = haptic.wait(120s);
  ASSERT_TRUE(code);
  expect_one_sentence({*code, false, haptic.out(), haptic.err()}, "osteon-haptic",
                      {"step 1 (drill) did not finish", "feed_mm_per_s"});
  auto summary = read_json(stage / "soft.json");
  EXPECT_EQ(summary["steps"][0]["completed"], false);
  EXPECT_EQ(summary["steps"][0]["gave_up_in"], "feed");
  EXPECT_EQ(summary["steps"][0]["asked_mm"], 29.0);
  EXPECT_LT(summary["steps"][0]["deepest_mm"].get<double>(), 5.0);  // the near cortex
  EXPECT_NE(haptic.out().find("0 of 1 steps done"), std::string::npos) << haptic.out();
}

TEST(Trouble, AHandWithoutRealTimePriorityIsWarned) {
  Stage stage(16.0);
  nlohmann::json step = drill_at(0, 0, "rig");
  step["to_mm"] = 1.0;
  std::ofstream(stage / "plan.json") << nlohmann::json{{"steps", nlohmann::json::array({step})}}.dump();
  // Root always may, unless the limit is taken from it.
  std::vector<std::string> line{"--rtprio=0"};
  if (::geteuid() == 0) line.insert(line.end(), {"setpriv", "--bounding-set", "-sys_nice"});
  line.insert(line.end(),
              {program("osteon-haptic"), "--server", stage.address(), "--plain", "--plan", stage / "plan.json",
               "--cache", stage / "cache", "--summary", stage / "summary.json", "--plain"});
  Process haptic("/usr/bin/prlimit", line);
  ASSERT_EQ(haptic.wait(60s), 0) << haptic.err();
  EXPECT_EQ(read_json(stage / "summary.json")["loop"]["realtime"], false);
  EXPECT_NE(haptic.err().find("no real-time priority"), std::string::npos) << haptic.err();
  EXPECT_NE(haptic.err().find("osteon-haptic check"), std::string::npos) << haptic.err();
}

// The check's own measurement is part of its answer: here the program was stopped during the check.
TEST(Trouble, ACheckThatMissedTicksDoesNotSayThatNothingIsLacking) {
  Process check(program("osteon-haptic"), {"check", "--seconds", "2"});
  std::this_thread::sleep_for(1s);
  ASSERT_TRUE(check.running());
  check.signal(SIGSTOP);
  std::this_thread::sleep_for(100ms);
  check.signal(SIGCONT);
  EXPECT_EQ(check.wait(20s), 1);
  EXPECT_EQ(check.out().find(" 0 missed"), std::string::npos) << check.out();
  EXPECT_EQ(check.out().find("lacks nothing"), std::string::npos) << check.out();
}

TEST(Trouble, ADeviceThatIsNotThereIsNamed) {
  const TempDir temp;
  write_plan(temp / "plan.json");
  expect_one_sentence(run(program("osteon-haptic"), {"--server", deserted_address(), "--plain", "--plan",
                                                     temp / "plan.json", "--device", "phantom"}),
                      "osteon-haptic", {"phantom", "simulated"});
}

// A server gets this signal during work. Its clients must report it and end, even if the server vanishes silently.
void expect_all_notice(int signal) {
  Stage stage(16.0);
  const auto screen = Xvfb::start("640x480");
  ASSERT_TRUE(screen);
  Process audio = stage.start(
      "osteon-audio", {"--server", stage.address(), "--plain", "--output", "none", "--summary", stage / "audio.json"});
  ScriptedViewer viewer(stage.address(), *screen);
  ASSERT_TRUE(viewer.tell("wait surface"));
  Process haptic = stage.start_haptic("work", {{"steps", nlohmann::json::array({drill_at(0, 0, "rig")})}});
  ASSERT_TRUE(stage.is_at_work("work")) << haptic.err();
  ASSERT_TRUE(haptic.running()) << haptic.err();
  stage.server().signal(signal);
  for (auto& [name, process] : {std::pair<std::string, Process*>{"osteon-haptic", &haptic},
                                {"osteon-audio", &audio},
                                {"osteon-viewer", &viewer.process()}}) {
    const auto code = process->wait(30s);
    ASSERT_TRUE(code) << name << " did not notice";
    expect_one_sentence({*code, false, process->out(), process->err()}, name, {});
  }
  // The summary still has what was done until then.
  auto summary = read_json(stage / "work.json");
  ASSERT_TRUE(summary.is_object());
  EXPECT_TRUE(summary["lost"].is_string()) << summary["lost"];
  EXPECT_EQ(summary["steps"][0]["completed"], false);
  EXPECT_GT(summary["loop"]["ticks"].get<int>(), 1000);
  EXPECT_TRUE(std::filesystem::exists(stage / "work-cuts.csv"));
}

TEST(Trouble, AKilledServerIsNoticedByAllItsClients) { expect_all_notice(SIGKILL); }

// Its connections stay open, like those of a machine that lost its network.
TEST(Trouble, AServerThatHangsIsNoticedByAllItsClients) { expect_all_notice(SIGSTOP); }

// Push and stiffness of the expert's hand, stiffness of the coupling, and the largest force of the motor relative to
// the coupling's (simulated_hand.hpp, haptic_loop.hpp, motor_port.hpp).
constexpr double kExpertPush_n = 29.0, kHand_n_per_mm = 5.5, kCoupling_n_per_mm = 50.0, kMotorShare = 0.3;
constexpr double kThickness_mm = 30.0;  // of the bone
// A loop that misses more than three ticks shows no force for one tick. From then on the force F may grow by 0.5 N/ms,
// and by twice the coupling's stiffness times what the hand moves: F' = 0.5 N/ms + 100 N/mm x'. It is back at 29 N
// after 58 ms at most. Meanwhile the hand goes on: m x" = 29 N - F - B x' - K (x - x_e), with m = 2.5 kg, B = 0.235 N
// s/mm, K = 5.5 N/mm and x_e' = (x - x_e) / 0.3 s. Integrated, it comes to rest after 0.37 mm. When another stall comes
// before that, the two together take it less than twice as far, whatever the time between them.
constexpr double kStall_ms = 3.0, kRecovered_ms = 100.0, kMostByStall_mm = 0.4;

// How a hand led its tool through the bone, by the session log. The handle is ahead of the tool by the coupling's
// extension, which is its force over its stiffness (0.6 mm), and by slack: the distance that the hand went during
// stalls. Slack stays as long as the tool touches bone (decision 21): 32 stalls of 8 ms left 3.1 mm. So only between
// stalls does it tell whether the bone held the hand.
struct LeadingHand {
  int stalls = 0;        // at the bone
  double slack_mm = 0;   // the largest
  double growth_mm = 0;  // of slack: the largest without a stall
  double most_n = 0;     // of the coupling, without a stall
  // While the spindle stood in the bone, without a stall.
  int silent_ticks = 0;
  double silent_least_n = 1e9, silent_most_n = 0, silent_least_mm = 1e9, silent_most_mm = 0;
};

LeadingHand leading_hand(const Table& log) {
  const std::vector<double>&ns = log["mono_ns"], &depth_mm = log["depth_mm"], &handle_mm = log["device_depth_mm"],
        &force_n = log["force_physical_n"], &rpm = log["rpm"];
  LeadingHand hand;
  double stalled_ms = 0.0, least_slack_mm = 1e9;
  for (std::size_t i = 1; i < log.entries() && depth_mm[i] < kThickness_mm; ++i) {
    const double now_ms = 1e-6 * ns[i];
    if (now_ms - 1e-6 * ns[i - 1] > kStall_ms) {
      hand.stalls += depth_mm[i] > -0.5;
      stalled_ms = now_ms;
      least_slack_mm = 1e9;
    }
    if (depth_mm[i] <= 0.0 || force_n[i] < 0.3) continue;
    if (now_ms - stalled_ms < kRecovered_ms) continue;
    const double slack_mm = handle_mm[i] - depth_mm[i] - force_n[i] / kCoupling_n_per_mm;
    least_slack_mm = std::min(least_slack_mm, slack_mm);
    hand.slack_mm = std::max(hand.slack_mm, slack_mm);
    hand.growth_mm = std::max(hand.growth_mm, slack_mm - least_slack_mm);
    hand.most_n = std::max(hand.most_n, force_n[i]);
    if (rpm[i] > 1.0) continue;
    ++hand.silent_ticks;
    hand.silent_least_n = std::min(hand.silent_least_n, force_n[i]);
    hand.silent_most_n = std::max(hand.silent_most_n, force_n[i]);
    hand.silent_least_mm = std::min(hand.silent_least_mm, depth_mm[i]);
    hand.silent_most_mm = std::max(hand.silent_most_mm, depth_mm[i]);
  }
  return hand;
}

// A room is silent for ten seconds. The hand still feels the bone as it was, nothing is cut, and then the work goes on.
TEST(Trouble, TenSecondsOfSilenceAreSatOut) {
  Stage stage(16.0);
  Process haptic = stage.start_haptic("silent", {{"steps", nlohmann::json::array({drill_at(0, 0, "expert")})}});
  ASSERT_TRUE(stage.is_at_work("silent")) << haptic.err();
  ASSERT_TRUE(haptic.running()) << haptic.err();
  stage.server().signal(SIGSTOP);
  std::this_thread::sleep_for(10s);
  EXPECT_TRUE(haptic.running()) << haptic.err();
  stage.server().signal(SIGCONT);
  ASSERT_EQ(haptic.wait(60s), 0) << haptic.err();
  EXPECT_NE(haptic.err().find("the server follows again"), std::string::npos) << haptic.err();
  auto summary = read_json(stage / "silent.json");
  EXPECT_EQ(summary["steps"][0]["completed"], true);
  EXPECT_GT(summary["held_for_room_ticks"].get<int>(), 5000);
  // The hand never went through bone. Without a stall only the coupling stretches. Its force is at most the hand's push
  // and what the motor pulls.
  const LeadingHand hand = leading_hand(read_table(stage / "silent.csv"));
  EXPECT_LT(hand.growth_mm, 0.02) << hand.stalls << " stalls, " << haptic.err();
  EXPECT_LT(hand.slack_mm, 0.02 + kMostByStall_mm * hand.stalls) << hand.stalls << " stalls, " << haptic.err();
  EXPECT_LT(hand.most_n, kExpertPush_n / (1.0 - kMotorShare)) << hand.stalls << " stalls, " << haptic.err();
  // In the silence the hand rests, and the coupling carries its push. After a stall the hand's own stiffness takes a
  // part of it for 0.3 s. There may be three stalls in that time.
  EXPECT_GT(hand.silent_ticks, 100);
  EXPECT_LT(hand.silent_most_mm - hand.silent_least_mm, 0.01) << hand.stalls << " stalls";
  EXPECT_GT(hand.silent_least_n, kExpertPush_n - 3.0 * kHand_n_per_mm * kMostByStall_mm) << hand.stalls << " stalls";
  EXPECT_LT(hand.silent_most_n, 1.05 * kExpertPush_n) << hand.stalls << " stalls";
  EXPECT_EQ(stage.server().terminate(), 0);
  EXPECT_EQ(summary["field_hash"], read_json(stage / "server.json")["field_hash"]);
}

TEST(Trouble, AServerStopsCleanlyInTheMiddleOfWork) {
  Stage stage(16.0);
  Process haptic = stage.start_haptic("work", {{"steps", nlohmann::json::array({drill_at(0, 0, "rig")})}});
  ASSERT_TRUE(stage.is_at_work("work")) << haptic.err();
  ASSERT_TRUE(haptic.running()) << haptic.err();
  EXPECT_EQ(stage.server().terminate(), 0);
  EXPECT_EQ(read_json(stage / "server.json").value("rejected", -1), 0);
  EXPECT_EQ(haptic.wait(30s), 1);
}

TEST(Trouble, AHapticClientStopsCleanlyInTheMiddleOfWork) {
  Stage stage(16.0);
  Process haptic = stage.start_haptic("work", {{"steps", nlohmann::json::array({drill_at(0, 0, "rig")})}});
  ASSERT_TRUE(stage.is_at_work("work")) << haptic.err();
  ASSERT_TRUE(haptic.running()) << haptic.err();
  // If the machine stops the program, that is reported, whatever other errors come.
  for (int i = 0; i < 5; ++i) {
    haptic.signal(SIGSTOP);
    std::this_thread::sleep_for(50ms);
    haptic.signal(SIGCONT);
    std::this_thread::sleep_for(50ms);
  }
  EXPECT_EQ(haptic.terminate(), 0);
  EXPECT_NE(haptic.err().find("the haptic loop has stalled"), std::string::npos) << haptic.err();
  // Its cuts are in the bone, and its own record agrees with the server's.
  EXPECT_EQ(stage.server().terminate(), 0);
  auto work = read_json(stage / "work.json");
  EXPECT_EQ(work["field_hash"], read_json(stage / "server.json")["field_hash"]);
  EXPECT_EQ(work["stopped"], true);
  EXPECT_EQ(work["lost"], nullptr);
  EXPECT_EQ(work["steps"][0]["completed"], false);  // in the middle of the hole
}

}  // namespace
}  // namespace osteon::test
