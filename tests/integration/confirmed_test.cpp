// Tests what a haptic client reports about its cuts: after a lost connection, without a server, and after the loss of a
// journal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <map>
#include <optional>
#include <thread>

#include "tests/integration/bad_network.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/relay/impair_process.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

class Confirmed : public ::testing::Test {
 protected:
  std::string journal() const { return (folder_ / "room.journal").string(); }
  // The journal's files. The log and its mirror lie beside the database.
  std::vector<fs::path> files() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(folder_.path())) found.push_back(entry.path());
    return found;
  }
  Process drill(const std::string& name, const std::string& address, std::vector<std::string> more = {}) {
    std::ofstream(stage_ / (name + "-plan.json")) << json{{"steps", json::array({drill_at(0, 0, "rig")})}};
    std::vector<std::string> arguments{"--server",
                                       address,
                                       "--plain",
                                       "--plan",
                                       stage_ / (name + "-plan.json"),
                                       "--cut-log",
                                       stage_ / (name + "-cuts.csv"),
                                       "--summary",
                                       stage_ / (name + ".json"),
                                       "--cache",
                                       stage_ / "cache"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return stage_.start("osteon-haptic", arguments);
  }
  // Waits until the room has `count` more events than now.
  [[nodiscard]] bool events_more(std::uint64_t count) {
    const wire::JoinedRoom watcher = join(stage_.address(), wire::ClientKind::viewer);
    const std::uint64_t now = status_of(watcher).room_seq();
    return wait_until([&] { return status_of(watcher).room_seq() >= now + count; }, 60s);
  }
  void kill_server() {
    stage_.server().signal(SIGKILL);
    ASSERT_TRUE(stage_.server().wait(10s).has_value());
  }
  void start_again() { stage_.start_server({"--plain", "--journal", journal(), "--listen", stage_.address()}); }
  // Sequence numbers of the hand's cuts, by their author sequence numbers. Only one hand has cut.
  std::map<std::uint64_t, std::uint64_t> seqs() {
    const fs::path lines = stage_ / "events.jsonl";
    const RunResult written = run(program("osteon-server"), {"export", journal(), lines}, 30s);
    EXPECT_EQ(written.exit_code, 0) << written.err;
    std::map<std::uint64_t, std::uint64_t> seqs;
    std::ifstream in(lines);
    for (std::string line; std::getline(in, line);) {
      const json entry = json::parse(line);
      if (entry.at("event").contains("cut"))
        seqs[std::stoull(entry["event"]["cut"]["author_seq"].get<std::string>())] =
            entry["room_seq"].get<std::uint64_t>();
    }
    return seqs;
  }
  // The one sentence with which the program ends.
  static std::string last_sentence(const Process& process, const std::string& name) {
    const std::string err = process.err();
    const std::size_t at = err.rfind("\n" + name + ": ");
    return at == std::string::npos ? err : err.substr(at + 1);
  }

  TempDir folder_;
  Stage stage_{16.0, {"--plain", "--journal", journal()}};
};

// The room takes cuts whose acknowledgements are lost with the connection. It sends their sequence numbers when the
// client comes back.
TEST_F(Confirmed, TheCutLogHasEachCutsSequenceNumber) {
  ImpairProcess line({"--tcp", stage_.address()});
  ASSERT_FALSE(line.tcp().empty()) << line.process().err();
  Process hand = drill("hand", line.tcp(), {"--udp", "off", "--timeout", "30"});
  ASSERT_TRUE(events_more(30));
  ASSERT_EQ(line.command("delay 100"), "ok");
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(events_more(60));
    ASSERT_EQ(line.command("reset"), "ok");
  }
  ASSERT_TRUE(events_more(60));
  ASSERT_EQ(line.command("good"), "ok");
  ASSERT_EQ(hand.terminate(60s), 0) << hand.err();
  const json summary = read_json(stage_ / "hand.json");
  EXPECT_GE(summary.at("interruptions"), 2);
  ASSERT_EQ(stage_.server().terminate(), 0);
  const auto kept = seqs();
  const Table cuts = read_table(stage_ / "hand-cuts.csv");
  ASSERT_GT(cuts.entries(), 150u);
  int elsewhere = 0, confirmed = 0;
  for (std::size_t i = 0; i < cuts.entries(); ++i) {
    if (cuts["confirmed_mono_ns"][i] == 0) continue;
    ++confirmed;
    const auto seq = kept.find(static_cast<std::uint64_t>(cuts["author_seq"][i]));
    elsewhere += cuts["room_seq"][i] != (seq == kept.end() ? 0.0 : static_cast<double>(seq->second));
  }
  EXPECT_GT(confirmed, 150);
  EXPECT_EQ(elsewhere, 0) << "cuts with another sequence number in the log than in the journal";
}

// The hand cuts for two more seconds. The server never acknowledges those cuts.
TEST_F(Confirmed, WhoGivesUpReportsOnlyWhatIsConfirmed) {
  Process hand = drill("hand", stage_.address());
  ASSERT_TRUE(events_more(60));
  kill_server();
  ASSERT_EQ(hand.wait(60s), 1) << hand.err();
  const json summary = read_json(stage_ / "hand.json");
  const std::string room_seq = std::to_string(summary.at("room_seq").get<std::uint64_t>());
  const RunResult replayed =
      run(program("osteon-server"), {"replay", journal(), "--case", stage_ / "case", "--to", room_seq}, 60s);
  ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_THAT(replayed.out, HasSubstr(summary.at("field_hash").get<std::string>())) << "the bone at event " << room_seq;
  const auto unconfirmed = summary.value("unconfirmed", std::uint64_t{0});
  EXPECT_GT(unconfirmed, 0u);
  EXPECT_THAT(hand.out(), HasSubstr(std::to_string(unconfirmed) + " of them not confirmed"));
  const Table cuts = read_table(stage_ / "hand-cuts.csv");
  EXPECT_EQ(std::ranges::count(cuts["confirmed_mono_ns"], 0.0), static_cast<std::ptrdiff_t>(unconfirmed));
}

// As a trainee sees it at the terminal.
TEST_F(Confirmed, AJournalThatIsGoneIsSaidToItsClients) {
  Process hand = drill("hand", stage_.address());
  ASSERT_TRUE(events_more(60));
  kill_server();
  for (const fs::path& file : files()) fs::remove(file);
  start_again();
  ASSERT_EQ(hand.wait(60s), 1) << hand.err();
  const std::string said = last_sentence(hand, "osteon-haptic");
  EXPECT_THAT(said, ContainsRegex("the room room begins anew: its journal has none of the [1-9][0-9]* events"));
  EXPECT_THAT(said, HasSubstr("start again to join it as it is now"));
  EXPECT_THAT(said, Not(HasSubstr("secret")));
  EXPECT_THAT(stage_.server().err(), HasSubstr("begins anew")) << "the server's log reports it too";
}

// A hand joins and cuts after the journal was copied. Then the copy replaces the journal.
class ConfirmedBeforeAnOlderCopy : public Confirmed {
 protected:
  void SetUp() override {
    kill_server();
    fs::create_directory(copy_.path() / "copy");
    for (const fs::path& file : files()) fs::copy(file, copy_.path() / "copy");
    start_again();
    hand_.emplace(stage_.address(), stage_ / "cache");
    ASSERT_TRUE(wait_until([&] { return hand_->complete(); }, kPatience));
    // A room sends the durable sequence number about once a second. So the test waits for the second cut.
    for (std::uint64_t i = 1; i <= 2; ++i) {
      const Vec3 at{-4.0 + static_cast<double>(i), 0, 0};
      Cut cut = straight_cut(find_tool("burr-round-5").value(), at, at, {0, 0, -1}, i);
      cut.author = hand_->author();
      ASSERT_TRUE(hand_->session().send(cut));
      ASSERT_TRUE(wait_until([&] { return hand_->own() == i; }, kPatience));
      if (i == 1) std::this_thread::sleep_for(1200ms);
    }
    std::this_thread::sleep_for(300ms);
    kill_server();
    for (const fs::path& file : files()) fs::remove(file);
  }
  std::string what_the_hand_is_told() {
    start_again();
    EXPECT_TRUE(wait_until([&] { return !hand_->lost().empty(); }, kPatience));
    return hand_->lost();
  }

  TempDir copy_;
  std::optional<Surgeon> hand_;
};

TEST_F(ConfirmedBeforeAnOlderCopy, ReportsTheLossToItsClientsAndTakesNoCuts) {
  for (const auto& entry : fs::directory_iterator(copy_.path() / "copy")) fs::copy(entry.path(), folder_.path());
  EXPECT_THAT(what_the_hand_is_told(),
              HasSubstr("has lost 3 of the 3 events that were acknowledged to you, and takes no more cuts"));
  const auto operator_is_told = [&] {
    return stage_.server().err().find("salvage it into a new journal") != std::string::npos;
  };
  EXPECT_TRUE(wait_until(operator_is_told, 10s)) << stage_.server().err();
}

TEST_F(ConfirmedBeforeAnOlderCopy, ReportsTheLossToItsClientsAfterASalvage) {
  const RunResult recovered =
      run(program("osteon-server"), {"salvage", copy_.path() / "copy" / "room.journal", journal()}, 30s);
  ASSERT_EQ(recovered.exit_code, 0) << recovered.err;
  EXPECT_THAT(what_the_hand_is_told(),
              HasSubstr("has lost 3 of the 3 events that were acknowledged to you: its journal was salvaged up "
                        "to event 0; start again to join it as it is now"));
}

}  // namespace
}  // namespace osteon::test
