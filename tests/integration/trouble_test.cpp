// What goes wrong at a person's desk: every program says one sentence that names what is wrong and what to do, and
// ends with a code that is not zero.
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

// The lines of standard error that are meant for the person, not the log: "PROGRAM: sentence".
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

// An address on which nobody listens: the system chose the port, and it was let go.
std::string deserted_address() { return ListeningSocket().address(); }

void write_plan(const std::filesystem::path& file) {
  std::ofstream(file) << nlohmann::json{{"steps", nlohmann::json::array({{{"action", "wait"}, {"seconds", 0.1}}})}}.dump();
}

TEST(Trouble, WithoutAServerEveryClientSaysSo) {
  const TempDir temp;
  const std::string nobody = deserted_address();
  write_plan(temp / "plan.json");
  expect_one_sentence(run(program("osteon-haptic"), {"--server", nobody, "--plan", temp / "plan.json", "--patience", "1"}), "osteon-haptic",
                      {nobody, "osteon-server"});
  expect_one_sentence(run(program("osteon-audio"), {"--server", nobody, "--output", "none", "--patience", "1"}), "osteon-audio",
                      {nobody, "osteon-server"});
  const auto screen = Xvfb::start();
  ASSERT_TRUE(screen);
  expect_one_sentence(run(program("osteon-viewer"), {"--server", nobody, "--patience", "1"}, 60s, screen->options()), "osteon-viewer",
                      {nobody, "osteon-server"});
}

TEST(Trouble, AViewerWithoutADisplaySaysHowToGetOne) {
  ProcessOptions blind;
  blind.without = {"DISPLAY", "WAYLAND_DISPLAY"};
  expect_one_sentence(run(program("osteon-viewer"), {"--server", deserted_address()}, 60s, blind), "osteon-viewer", {"DISPLAY"});
}

TEST(Trouble, AServerNamesThePortThatIsInUse) {
  const TempDir temp;
  ASSERT_EQ(run(program("osteon-import"), {"phantom", "block", "--layers", "5:1.9", "--width", "8", "--pitch", "1", "--out", temp / "case"}).exit_code, 0);
  const ListeningSocket taken;
  expect_one_sentence(run(program("osteon-server"), {"--case", temp / "case", "--listen", taken.address()}), "osteon-server", {taken.address()});
}

TEST(Trouble, AServerListensToThisMachineOnly) {
  const TempDir temp;
  ASSERT_EQ(run(program("osteon-import"), {"phantom", "block", "--layers", "5:1.9", "--width", "8", "--pitch", "1", "--out", temp / "case"}).exit_code, 0);
  expect_one_sentence(run(program("osteon-server"), {"--case", temp / "case", "--listen", "0.0.0.0:0"}), "osteon-server", {"0.0.0.0"});
}

TEST(Trouble, AServerRefusesWhatIsNotACase) {
  const TempDir temp;
  const auto serve = [&](const std::string& folder) { return run(program("osteon-server"), {"--case", temp / folder}); };
  expect_one_sentence(serve("nothing"), "osteon-server", {"nothing", "osteon-import"});
  std::filesystem::create_directory(temp / "empty");
  expect_one_sentence(serve("empty"), "osteon-server", {"empty", "case.json"});
  std::ofstream(temp / "text") << "not a case\n";
  expect_one_sentence(serve("text"), "osteon-server", {"text"});

  ASSERT_EQ(run(program("osteon-import"), {"phantom", "block", "--layers", "5:1.9", "--width", "8", "--pitch", "1", "--out", temp / "case"}).exit_code, 0);
  auto info = read_json(temp / "case" / "case.json");
  info["schema_version"] = 99;
  std::ofstream(temp / "case" / "case.json") << info.dump();
  expect_one_sentence(serve("case"), "osteon-server", {"schema_version", "99"});
}

TEST(Trouble, AHapticClientNamesWhatIsWrongWithItsPlan) {
  const TempDir temp;
  const auto with_plan = [&](const std::string& text) {
    std::ofstream(temp / "plan.json") << text;
    return run(program("osteon-haptic"), {"--server", deserted_address(), "--plan", temp / "plan.json", "--patience", "1"});
  };
  expect_one_sentence(run(program("osteon-haptic"), {"--server", deserted_address(), "--plan", temp / "missing.json"}), "osteon-haptic", {"missing.json"});
  expect_one_sentence(with_plan("{"), "osteon-haptic", {"plan.json"});
  expect_one_sentence(with_plan(R"({"steps":[{"action":"saw"}]})"), "osteon-haptic", {"plan.json", "action"});
  expect_one_sentence(with_plan(R"({"steps":[{"action":"drill","tool":"drill-99","entry":{"toward":[0,0,1]}}]})"), "osteon-haptic", {"drill-99"});
}

TEST(Trouble, ADeviceThatIsNotThereIsNamed) {
  const TempDir temp;
  write_plan(temp / "plan.json");
  expect_one_sentence(run(program("osteon-haptic"), {"--server", deserted_address(), "--plan", temp / "plan.json", "--device", "phantom"}),
                      "osteon-haptic", {"phantom", "simulated"});
}

// A server that hears this signal in the middle of work: its clients say so and end, however silently it went.
void expect_all_notice(int signal) {
  Stage stage(16.0);
  const auto screen = Xvfb::start("640x480");
  ASSERT_TRUE(screen);
  Process audio = stage.start("osteon-audio", {"--server", stage.address(), "--output", "none", "--summary", stage / "audio.json"});
  ScriptedViewer viewer(stage.address(), *screen);
  ASSERT_TRUE(viewer.tell("wait surface"));
  Process haptic = stage.start_haptic("work", {{"steps", nlohmann::json::array({drill_at(0, 0, "rig")})}});
  std::this_thread::sleep_for(3s);
  ASSERT_TRUE(haptic.running()) << haptic.err();
  stage.server().signal(signal);
  for (auto& [name, process] : {std::pair<std::string, Process*>{"osteon-haptic", &haptic}, {"osteon-audio", &audio}, {"osteon-viewer", &viewer.process()}}) {
    const auto code = process->wait(30s);
    ASSERT_TRUE(code) << name << " did not notice";
    expect_one_sentence({*code, false, process->out(), process->err()}, name, {});
  }
}

TEST(Trouble, AKilledServerIsNoticedByAllItsClients) { expect_all_notice(SIGKILL); }

// Its connections stay open, as those of a machine that lost its network do.
TEST(Trouble, AServerThatHangsIsNoticedByAllItsClients) { expect_all_notice(SIGSTOP); }

TEST(Trouble, AServerStopsCleanlyInTheMiddleOfWork) {
  Stage stage(16.0);
  Process haptic = stage.start_haptic("work", {{"steps", nlohmann::json::array({drill_at(0, 0, "rig")})}});
  std::this_thread::sleep_for(4s);
  ASSERT_TRUE(haptic.running()) << haptic.err();
  EXPECT_EQ(stage.server().terminate(), 0);
  EXPECT_EQ(read_json(stage / "server.json").value("rejected", -1), 0);
  EXPECT_EQ(haptic.wait(30s), 1);
}

TEST(Trouble, AHapticClientStopsCleanlyInTheMiddleOfWork) {
  Stage stage(16.0);
  Process haptic = stage.start_haptic("work", {{"steps", nlohmann::json::array({drill_at(0, 0, "rig")})}});
  std::this_thread::sleep_for(4s);
  ASSERT_TRUE(haptic.running()) << haptic.err();
  EXPECT_EQ(haptic.terminate(), 0);
  // What it had cut is in the bone, and its own record agrees with the server's.
  EXPECT_EQ(stage.server().terminate(), 0);
  EXPECT_EQ(read_json(stage / "work.json")["field_hash"], read_json(stage / "server.json")["field_hash"]);
}

}  // namespace
}  // namespace osteon::test
