// Tests an instructor at the console and hands in the room, as processes. A decision of the instructor holds at once.
// It is sent to those concerned, and to those who were away when they come back.
#include <gtest/gtest.h>

#include <fstream>
#include <regex>

#include "tests/integration/stage.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

class ConsoleProcess {
 public:
  ConsoleProcess(const Stage& stage, const std::string& name)
      : process_(stage.start("osteon-viewer", {"--console", "--server", stage.address(), "--plain", "--name", name})) {}
  std::string ask(const std::string& command) {
    process_.write(command + "\n");
    return process_.read_line(60s).value_or("");
  }
  // The sequence number of the event that followed.
  std::uint64_t decide(const std::string& command) {
    const std::string answer = ask(command);
    std::smatch found;
    EXPECT_TRUE(std::regex_search(answer, found, std::regex("^ok at ([0-9]+)"))) << command << ": " << answer;
    return found.empty() ? 0 : std::stoull(found[1]);
  }
  // What `people` prints for one author. Empty if there is none.
  std::string person(std::uint64_t author) {
    const std::string all = ask("people");
    std::smatch found;
    return std::regex_search(all, found, std::regex("#" + std::to_string(author) + " [^;]*")) ? found[0]
                                                                                              : std::string();
  }
  std::uint64_t cuts(std::uint64_t author) {
    const std::string said = person(author);
    std::smatch found;
    return std::regex_search(said, found, std::regex("cuts ([0-9]+)")) ? std::stoull(found[1]) : 0;
  }
  Process& process() { return process_; }

 private:
  Process process_;
};

// A hand without a replica that can leave and come back.
class BareHand {
 public:
  explicit BareHand(const std::string& address) : room_(join(address, wire::ClientKind::haptic)) { open(); }
  ~BareHand() { leave(); }
  AuthorId author() const { return room_.author; }
  std::uint64_t lease() const { return lease_; }
  // The restrictions of itself that it received before the leaves.
  const std::optional<v1::Supervised>& held() const { return held_; }
  RoomSeq contained() const { return contained_; }

  void leave() {
    if (!stream_) return;
    stream_->WritesDone();
    v1::SessionResponse rest;
    while (stream_->Read(&rest)) continue;
    (void)stream_->Finish();
    stream_.reset();
  }
  void come_again() {
    const auto again = wire::join_again(room_, wire::ClientKind::haptic, {});
    ASSERT_TRUE(again.has_value()) << again.error().message;
    // The secret of the first join stays valid for further joins.
    const std::string secret = room_.secret;
    room_ = *again;
    room_.secret = secret;
    open();
  }
  // The answer to its next cut: `none` if the room takes it, else the reason for the rejection.
  Rejection cut(std::uint64_t epoch) {
    Cut cut = straight_cut(find_tool("burr-round-5").value(), {-15, -15, 0}, {-15, -15, 0}, {0, 0, -1}, ++cuts_);
    cut.author = room_.author;
    cut.lease_epoch = epoch;
    v1::SessionRequest request;
    *request.mutable_cut() = wire::to_wire(cut);
    EXPECT_TRUE(stream_->Write(request));
    v1::SessionResponse response;
    while (stream_->Read(&response)) {
      if (response.has_rejected() && response.rejected().author_seq() == cuts_) {
        lease_ = response.rejected().lease_epoch();
        return wire::from_wire(response.rejected().code());
      }
      if (response.has_committed() && response.committed().cut().author() == room_.author.value) return Rejection::none;
    }
    ADD_FAILURE() << "the session ended";
    return Rejection::none;
  }
  void say_heard() {
    v1::SessionRequest request;
    request.mutable_acknowledged()->set_room_seq(contained_.value);
    EXPECT_TRUE(stream_->Write(request));
  }

 private:
  void open() {
    context_ = std::make_unique<grpc::ClientContext>();
    stream_ = v1::CuttingService::NewStub(room_.channel)->Session(context_.get());
    v1::SessionRequest request;
    request.mutable_open()->set_author(room_.author.value);
    request.mutable_open()->set_server_epoch(room_.server_epoch);
    request.mutable_open()->set_secret(room_.secret);
    EXPECT_TRUE(stream_->Write(request));
    held_.reset();
    v1::SessionResponse response;
    while (stream_->Read(&response)) {
      if (response.has_supervised()) held_ = response.supervised();
      if (!response.has_complete()) continue;
      contained_ = RoomSeq{response.complete().room_seq()};
      lease_ = response.complete().lease_epoch();
      return;
    }
    ADD_FAILURE() << "the session ended: " << stream_->Finish().error_message();
  }

  wire::JoinedRoom room_;
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::SessionRequest, v1::SessionResponse>> stream_;
  std::optional<v1::Supervised> held_;
  RoomSeq contained_;
  std::uint64_t lease_ = 0, cuts_ = 0;
};

// More holes than the console needs to wait for, however slow the machine is.
json plan_at(double x_mm) {
  json steps = json::array();
  for (const double y_mm : {0.0, 8.0, -8.0, 16.0, -16.0}) steps.push_back(drill_at(x_mm, y_mm, "expert"));
  return {{"steps", steps}};
}

// A hand that was stopped at the end of a hole goes on in the next one. The time of a simulated hand is that of its
// loop, which a busy computer makes several times slower.
constexpr auto kNextHole = 180s;

TEST(Together, AnInstructorsWordHoldsForEveryHand) {
  TempDir folder;
  const std::string journal = (folder / "room.journal").string();
  Stage stage(40.0, {"--plain", "--journal", journal});
  ConsoleProcess console(stage, "Ada Instructor");
  ASSERT_TRUE(console.ask("people").starts_with("ok 1 people")) << console.process().err();

  // They join one after the other, so that their numbers are known. 1 is the console.
  constexpr std::uint64_t kFirst = 2, kSecond = 3;
  Process first = stage.start_haptic("first", plan_at(-8.0));
  ASSERT_TRUE(wait_until([&] { return console.cuts(kFirst) >= 10; }, 60s)) << first.err();
  Process second = stage.start_haptic("second", plan_at(8.0));
  ASSERT_TRUE(wait_until([&] { return console.cuts(kSecond) >= 10; }, 60s)) << second.err();

  // One is stopped, and the other goes on.
  const std::uint64_t frozen_at = console.decide("freeze #2 look at me");
  EXPECT_TRUE(console.ask("wait acknowledged #2 10").starts_with("ok"));
  EXPECT_NE(console.person(kFirst).find("frozen words \"look at me\" acknowledged decided by #1"), std::string::npos)
      << console.person(kFirst);
  const std::uint64_t cut_by_first = console.cuts(kFirst), cut_by_second = console.cuts(kSecond);
  ASSERT_TRUE(wait_until([&] { return console.cuts(kSecond) >= cut_by_second + 20; }, 60s));
  EXPECT_EQ(console.cuts(kFirst), cut_by_first);
  EXPECT_TRUE(console.ask("say #2 the drill wanders").starts_with("ok")) << "in passing";

  const std::uint64_t free_at = console.decide("free #2");
  ASSERT_TRUE(wait_until([&] { return console.cuts(kFirst) >= cut_by_first + 5; }, kNextHole))
      << "it goes on: " << first.err();
  const std::uint64_t taken_at = console.decide("take #2 let me");
  EXPECT_TRUE(console.ask("wait acknowledged #2 10").starts_with("ok"));
  EXPECT_NE(console.person(kFirst).find("taken by #1"), std::string::npos);
  const std::uint64_t cut_before = console.cuts(kFirst);
  std::this_thread::sleep_for(500ms);
  EXPECT_EQ(console.cuts(kFirst), cut_before);
  const std::uint64_t back_at = console.decide("give-back #2");
  ASSERT_TRUE(wait_until([&] { return console.cuts(kFirst) >= cut_before + 5; }, kNextHole))
      << "it goes on again: " << first.err();

  // Undo by time takes back all recent cuts, whoever made them. Tools that are in the bone are then stuck and must be
  // drawn out.
  const std::string undone = console.ask("undo 1 s");
  EXPECT_TRUE(std::regex_search(undone, std::regex("^ok at [0-9]+ events [1-9]"))) << undone;

  // A decision about a person who is away is pending until they have come back and received it.
  BareHand away(stage.address());
  EXPECT_EQ(away.cut(away.lease()), Rejection::none);
  const std::string who = "#" + std::to_string(away.author().value);
  const std::uint64_t lease_before = away.lease();
  away.leave();
  ASSERT_TRUE(wait_until([&] { return console.person(away.author().value).find(" away") != std::string::npos; }, 20s));
  (void)console.decide("freeze " + who + " wait for me");
  EXPECT_NE(console.person(away.author().value).find("pending"), std::string::npos);
  EXPECT_TRUE(console.ask("wait acknowledged " + who + " 0.3").starts_with("error")) << "they have not received it";
  away.come_again();
  ASSERT_TRUE(away.held()) << "the first message that they receive";
  EXPECT_EQ(away.held()->room_seq(), 0u);
  EXPECT_TRUE(away.held()->supervision().stopped());
  EXPECT_EQ(away.held()->supervision().words(), "wait for me");
  EXPECT_NE(away.lease(), lease_before);
  away.say_heard();
  EXPECT_TRUE(console.ask("wait acknowledged " + who + " 10").starts_with("ok"));
  EXPECT_EQ(away.cut(lease_before), Rejection::lease) << "its cut under the old lease";
  EXPECT_EQ(away.cut(away.lease()), Rejection::frozen);
  (void)console.decide("free " + who);
  // The rejection has ended that lease too, and so has the decision.
  EXPECT_EQ(away.cut(away.lease()), Rejection::lease);
  away.leave();
  away.come_again();
  EXPECT_EQ(away.cut(away.lease()), Rejection::none);
  away.leave();

  // Everybody is stopped. The bone is reset to the import, and a demonstrator repeats on it what the second hand did at
  // first.
  (void)console.decide("freeze all");
  EXPECT_TRUE(console.ask("wait acknowledged #2 10").starts_with("ok"));
  EXPECT_TRUE(console.ask("wait acknowledged #3 10").starts_with("ok"));
  EXPECT_TRUE(console.ask("undo all").starts_with("ok"));
  const std::string uncut = console.ask("status");
  EXPECT_NE(uncut.find(" removed 0.000 mm3"), std::string::npos) << uncut;
  const std::string shown = console.ask("demonstrate of #3 to " + std::to_string(frozen_at) + " speed 2");
  std::smatch demonstration;
  ASSERT_TRUE(std::regex_search(shown, demonstration, std::regex("^ok demonstrator #([0-9]+) cuts ([0-9]+)"))) << shown;
  const std::uint64_t demonstrator = std::stoull(demonstration[1]), to_show = std::stoull(demonstration[2]);
  EXPECT_GE(to_show, 10u);
  EXPECT_TRUE(wait_until([&] { return console.cuts(demonstrator) == to_show; }, 60s))
      << console.cuts(demonstrator) << " of " << to_show;
  EXPECT_TRUE(wait_until([&] { return console.person(demonstrator).find(" away") != std::string::npos; }, 20s))
      << "it is over";
  EXPECT_TRUE(console.ask("end-demonstration " + std::to_string(demonstrator)).starts_with("error"));

  // All have the same bone.
  const std::string status = console.ask("status");
  std::smatch hash;
  ASSERT_TRUE(std::regex_search(status, hash, std::regex("hash ([0-9a-f]{64})"))) << status;
  EXPECT_EQ(status.find(" removed 0.000 mm3"), std::string::npos) << status;
  EXPECT_EQ(console.ask("quit"), "ok");
  EXPECT_EQ(console.process().wait(10s), 0) << console.process().err();
  for (Process* hand : {&first, &second}) ASSERT_TRUE(hand->terminate(20s).has_value());
  const json of_first = read_json(stage / "first.json"), of_second = read_json(stage / "second.json");
  EXPECT_EQ(of_first.at("field_hash"), hash[1].str());
  EXPECT_EQ(of_second.at("field_hash"), hash[1].str());
  EXPECT_NE(of_first.at("words").dump().find("the drill wanders"), std::string::npos);
  EXPECT_EQ(of_second.at("words").dump().find("the drill wanders"), std::string::npos) << "words for the other hand";
  // Each hand knows who made the decision.
  for (const json* of : {&of_first, &of_second}) {
    std::size_t told = 0;
    for (const json& note : of->at("restrictions")) {
      if (!note.contains("room_seq")) continue;
      ++told;
      EXPECT_EQ(note.value("by", ""), "Ada Instructor") << note;
    }
    EXPECT_GE(told, 1u);
  }
  ASSERT_EQ(stage.server().terminate(), 0) << stage.server().err();
  EXPECT_EQ(read_json(stage / "server.json").at("field_hash"), hash[1].str());

  // The journal agrees: no cut of the hand while it was stopped, or without its tool.
  const std::string lines = (folder / "room.jsonl").string();
  ASSERT_EQ(run(program("osteon-server"), {"export", journal, lines}, 60s).exit_code, 0);
  std::ifstream in(lines);
  std::size_t others = 0, decisions = 0;
  for (std::string line; std::getline(in, line);) {
    const json entry = json::parse(line);
    const auto place = entry.at("room_seq").get<std::uint64_t>();
    decisions += entry.at("event").contains("supervision");
    const bool forbidden = (place > frozen_at && place < free_at) || (place > taken_at && place < back_at);
    if (!forbidden || !entry.at("event").contains("cut")) continue;
    EXPECT_NE(entry.at("event").at("cut").at("author"), std::to_string(kFirst)) << line;
    others += entry.at("event").at("cut").at("author") == std::to_string(kSecond);
  }
  EXPECT_GE(others, 20u);
  EXPECT_GE(decisions, 6u);
}

TEST(Together, TheConsoleSaysWhatItDoesNotUnderstand) {
  Stage stage(12.0);
  ConsoleProcess console(stage, "Ada");
  EXPECT_TRUE(console.ask("please stop").starts_with("error there is no command \"please\"; known are people, freeze"));
  EXPECT_EQ(console.ask("guide Ben Ada"), "error the form is: guide NAME along NAME [share 0..1]");
  EXPECT_TRUE(console.ask("freeze Ben").starts_with("error there is nobody called \"Ben\""));
  EXPECT_TRUE(console.ask("mark \"before all\"").starts_with("ok at "));
  EXPECT_TRUE(console.ask("undo to before all").starts_with("error there is nothing to undo"));
  EXPECT_TRUE(console.ask("undo to elsewhere").starts_with("error the room has no mark"));
  EXPECT_EQ(console.ask("draw 0 0 0 1 0 0"), "ok drawing 1");
  EXPECT_EQ(console.ask("wipe all"), "ok");
  EXPECT_EQ(console.ask("drawn"), "ok 0 drawings");
  EXPECT_TRUE(console.ask("demonstrate").starts_with("error ")) << "a room that is not persisted has no journal";
  console.process().close_input();
  EXPECT_EQ(console.process().wait(10s), 0);
  // A server that does not exist.
  const RunResult nobody =
      run(program("osteon-viewer"), {"--console", "--connect", "127.0.0.1:1", "--plain", "--timeout", "0.2"}, 30s);
  EXPECT_NE(nobody.exit_code, 0);
  EXPECT_NE(nobody.err.find("127.0.0.1:1"), std::string::npos) << nobody.err;
}

}  // namespace
}  // namespace osteon::test
