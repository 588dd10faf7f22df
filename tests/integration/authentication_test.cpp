// Runs a server with certificates and tickets. A surgeon works in it, while clients without a valid right try to enter
// or lose their right. The surgeon must not feel these attempts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/integration/stage.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/wait.hpp"
#include "tests/support/xvfb.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

std::vector<std::string> plus(std::vector<std::string> arguments, const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// What a program says at its end, or everything if it says nothing.
std::string last_sentence(const std::string& err, const std::string& program_name) {
  const std::size_t last = err.rfind(program_name + ": ");
  return last == std::string::npos ? err : err.substr(last);
}

class AuthenticatedPrograms : public ::testing::Test {
 protected:
  // Makes a ticket with the operator's own command.
  std::filesystem::path ticket(const std::string& user, const std::string& role, const std::string& room = "room") {
    const RunResult made = run(program("osteon-server"), {"ticket", "--key", people_.ticket_key(), "--room", room,
                                                          "--user", user, "--role", role, "--hours", "1"});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    EXPECT_THAT(made.err, HasSubstr("ticket ")) << "its id, by which it is revoked";
    return people_.ticket_file(made.out.substr(0, made.out.find('\n')));
  }
  std::vector<std::string> credentials(const std::string& user, const std::filesystem::path& with) {
    return {"--certificates", people_.person(user), "--ticket", with};
  }
  // Starts an audio client that is refused. It must end with one sentence that gives the reason, and an exit code.
  std::string turned_away(const std::vector<std::string>& by) {
    const RunResult result = run(program("osteon-audio"),
                                 plus({"--server", stage_.address(), "--output", "none", "--timeout", "1"}, by), 30s);
    EXPECT_NE(result.exit_code, 0) << result.out << result.err;
    EXPECT_FALSE(result.timed_out);
    return last_sentence(result.err, "osteon-audio");
  }
  Process haptic(const std::string& name, const std::string& user, const std::string& role,
                 const nlohmann::json& plan) {
    const auto file = stage_ / (name + "-plan.json");
    std::ofstream(file) << plan.dump();
    return stage_.start("osteon-haptic", plus({"--server", stage_.address(), "--plan", file, "--summary",
                                               stage_ / (name + ".json"), "--cache", stage_ / "cache"},
                                              credentials(user, ticket(user, role))));
  }
  // Connects and sends bytes that are neither TLS nor HTTP.
  void say_nonsense() {
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    at.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(stage_.address().substr(stage_.address().rfind(':') + 1))));
    ASSERT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    std::string noise(64 * 1024, '\0');
    unsigned state = 1;
    for (char& byte : noise) byte = static_cast<char>((state = state * 1664525u + 1013904223u) >> 24);
    (void)::send(socket, noise.data(), noise.size(), MSG_NOSIGNAL);
    ::close(socket);
  }

  People people_;
  Stage stage_{30.0, {"--certificates", people_.server()}};
};

TEST_F(AuthenticatedPrograms, AdmitWhoMayEnterAndKeepOthersFromDisturbingThem) {
  Process sue = haptic("sue", "sue", "trainee", {{"steps", {drill_at(0, 0, "rig")}}});
  // She drills until she is stopped. At this feed the hole takes eleven minutes.
  nlohmann::json slowly = drill_at(9, 9, "rig");
  slowly["feed_mm_per_s"] = 0.05;
  Process dora = haptic("dora", "dora", "collaborator", {{"steps", {slowly}}});
  Process ben = stage_.start("osteon-audio", plus({"--server", stage_.address(), "--output", "none"},
                                                  credentials("ben", ticket("ben", "observer"))));

  // Without credentials, with plain text, and with the certificates of another authority.
  EXPECT_THAT(turned_away({}), HasSubstr("--certificates DIR with --ticket FILE"));
  EXPECT_THAT(turned_away({"--plain"}), HasSubstr("asks for a certificate"));
  People strangers;
  EXPECT_THAT(turned_away({"--certificates", strangers.person("sue"), "--ticket", ticket("sue", "trainee")}),
              HasSubstr("is not of the authority in"));
  say_nonsense();

  // With a certificate, but with a ticket that does not fit.
  EXPECT_THAT(turned_away(credentials("eve", people_.ticket("eve", "room", Role::observer, -5s))),
              HasSubstr("the ticket expired"));
  EXPECT_THAT(turned_away(credentials("eve", ticket("sue", "trainee"))),
              HasSubstr("the ticket is for sue and the certificate for eve"));
  EXPECT_THAT(turned_away(plus(credentials("eve", ticket("eve", "observer", "theatre")), {"--room", "room"})),
              HasSubstr("the ticket is for room theatre"));
  EXPECT_THAT(turned_away(credentials("eve", people_.ticket_file("osteon1.AAAA.AAAA"))), HasSubstr("malformed"));
  EXPECT_THAT(turned_away(credentials("eve", strangers.ticket("eve", "room", Role::instructor))),
              HasSubstr("signature"));
  const RunResult closing = run(program("osteon-server"), plus({"rooms", "close", "room", "--server", stage_.address()},
                                                               credentials("eve", ticket("eve", "instructor"))));
  EXPECT_NE(closing.exit_code, 0);
  EXPECT_THAT(closing.err, HasSubstr("an instructor may not call CloseRoom"));

  // During the work one person is revoked, and another loses their role.
  EXPECT_TRUE(ben.running()) << ben.err();
  EXPECT_TRUE(dora.running()) << dora.err();
  people_.certs({"revoke", "ben"});
  const auto ben_ended = ben.wait(20s);
  ASSERT_TRUE(ben_ended.has_value());
  EXPECT_NE(*ben_ended, 0);
  EXPECT_THAT(ben.err(), HasSubstr("was revoked"));
  people_.append_access("role dora observer");
  const auto dora_ended = dora.wait(20s);
  ASSERT_TRUE(dora_ended.has_value());
  EXPECT_NE(*dora_ended, 0);
  // Her stream ends with "an observer may not call Session". If a stalled computer lost her link just before, she joins
  // again, and hears that her role has changed to observer.
  EXPECT_THAT(last_sentence(dora.err(), "osteon-haptic"),
              AnyOf(HasSubstr("an observer may not call Session"), HasSubstr("your role has changed to observer")));

  // The surgeon has noticed nothing.
  ASSERT_EQ(sue.wait(120s), 0) << sue.err();
  const nlohmann::json summary = read_json(stage_ / "sue.json");
  EXPECT_EQ(summary["steps"][0]["completed"], true);
  EXPECT_EQ(summary["interruptions"], 0);
  EXPECT_EQ(summary["rejected"], 0);
  EXPECT_EQ(summary["lost"], nullptr);
  EXPECT_EQ(summary["fast_path"]["alive"], true);
  ASSERT_EQ(stage_.server().terminate(30s), 0) << stage_.server().err();
  // The server's log names each refused client once.
  const std::string log = stage_.server().err();
  EXPECT_THAT(log, HasSubstr("who=eve from=ipv4:127.0.0.1 reason=person"));
  EXPECT_THAT(log, HasSubstr("who=ben reason=revoked"));
}

// An instructor supervises with a console and watches in a viewer. Both use one certificate.
TEST_F(AuthenticatedPrograms, AConsoleAndAWindowOfOnePersonStayBesideEachOther) {
  const auto screen = Xvfb::start();
  ASSERT_TRUE(screen) << "Xvfb, of Debian's package xvfb, did not start";
  const auto ida = credentials("ida", ticket("ida", "instructor"));
  ScriptedViewer window(stage_.address(), *screen, ida);
  ASSERT_TRUE(window.tell("wait surface")) << window.process().err();
  const auto start = [&] {
    return stage_.start("osteon-viewer", plus({"--console", "--server", stage_.address()}, ida));
  };
  const auto ask = [](Process& console, const std::string& command) {
    console.write(command + "\n");
    return console.read_line(60s).value_or("");
  };
  Process first = start();
  EXPECT_TRUE(ask(first, "people").starts_with("ok 2 people")) << first.err();
  EXPECT_EQ(ask(first, "draw 0 0 0 1 0 0"), "ok drawing 1");
  EXPECT_TRUE(window.tell("wait drawn 1"));

  // A second console replaces the first one, but not the viewer.
  Process second = start();
  EXPECT_TRUE(ask(second, "people").starts_with("ok 3 people")) << second.err();
  const auto ended = first.wait(20s);
  ASSERT_TRUE(ended.has_value());
  EXPECT_NE(*ended, 0);
  EXPECT_THAT(first.err(), HasSubstr("newer session of ida"));
  EXPECT_TRUE(window.tell("label 1 2 0 here")) << window.process().err();
  EXPECT_TRUE(wait_until([&] { return ask(second, "drawn").starts_with("ok 2 drawings"); }, 20s)) << second.err();
  EXPECT_TRUE(window.process().running());
  EXPECT_EQ(ask(second, "quit"), "ok");
  EXPECT_EQ(second.wait(10s), 0) << second.err();
}

}  // namespace
}  // namespace osteon::test
