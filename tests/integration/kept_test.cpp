// A room in a journal, as processes see it: killed servers, a stop and a start, files that are none.
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>

#include "tests/integration/killed_servers.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/room/members.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;

TEST(Kept, AHundredKilledServersLoseNothingTheyAcknowledged) {
  const KilledServers report = kill_servers(100, 1);
  EXPECT_EQ(report.fault, "");
  EXPECT_EQ(report.kills, 100);
  EXPECT_LT(report.killed_idle, 50) << "most are killed at work";
  EXPECT_GT(report.acknowledged, 1000u);
  EXPECT_EQ(report.lost, 0u);
  EXPECT_EQ(report.twice, 0u);
  EXPECT_EQ(report.missing, 0u);
  EXPECT_EQ(report.kept, report.sent);
  EXPECT_EQ(report.hashes_that_differ, 0);
  std::printf("killed %d servers: %llu cuts sent, %llu acknowledged, %llu kept, %llu lost\n", report.kills,
              static_cast<unsigned long long>(report.sent), static_cast<unsigned long long>(report.acknowledged),
              static_cast<unsigned long long>(report.kept), static_cast<unsigned long long>(report.lost));
}

// A stop and a start in between: the same bone, and what was cut before can still be undone.
TEST(Kept, ARoomGoesOnWithAllThatCanBeUndone) {
  TempDir folder;
  const std::string file = (folder / "room.journal").string();
  Stage stage(12.0, {"--journal", file});
  std::string hash, uncut;
  {
    Surgeon hand(stage.address(), folder / "cache");
    ASSERT_TRUE(wait_until([&] { return hand.complete(); }, kPatience));
    uncut = status_of(hand.session().room()).field_hash();
    for (std::uint64_t i = 1; i <= 5; ++i) {
      const Vec3 at{-4.0 + static_cast<double>(i), 0, 0};
      Cut cut = straight_cut(find_tool("burr-round-5").value(), at, at, {0, 0, -1}, i);
      cut.author = hand.author();
      ASSERT_TRUE(hand.session().send(cut));
    }
    ASSERT_TRUE(wait_until([&] { return hand.own() == 5; }, kPatience));
    hash = status_of(hand.session().room()).field_hash();
    ASSERT_NE(hash, uncut);
  }
  ASSERT_EQ(stage.server().terminate(), 0) << stage.server().err();
  stage.start_server({"--journal", file});
  Surgeon late(stage.address(), folder / "cache");
  ASSERT_TRUE(wait_until([&] { return late.complete(); }, kPatience));
  EXPECT_EQ(wire::to_wire(late.hash()), hash);
  EXPECT_EQ(status_of(late.session().room()).field_hash(), hash);
  v1::UndoRequest request;
  request.set_author(late.author().value);
  request.set_count(5);
  v1::UndoResponse undone;
  grpc::ClientContext context;
  ASSERT_TRUE(v1::RoomService::NewStub(late.session().room().channel)->Undo(&context, request, &undone).ok());
  EXPECT_EQ(undone.undone_size(), 5);
  EXPECT_EQ(status_of(late.session().room()).field_hash(), uncut);
}

void expect_refused(const std::vector<std::string>& arguments, const std::vector<std::string>& words) {
  const RunResult server = run(program("osteon-server"), arguments, 30s);
  EXPECT_FALSE(server.timed_out);
  EXPECT_NE(server.exit_code, 0);
  for (const std::string& word : words) EXPECT_NE(server.err.find(word), std::string::npos) << word << " in " << server.err;
}

TEST(Kept, SaysWhatIsWrongWithAJournal) {
  TempDir folder;
  const std::string file = (folder / "room.journal").string();
  Stage stage(12.0, {"--journal", file}), other(14.0);
  const std::string bone = (stage / "case").string();
  expect_refused({"--case", bone, "--journal", file}, {"room.journal", "in use"});
  expect_refused({"--case", bone, "--journal", file, "--resume", "x.vdb"}, {"--journal", "--resume"});
  ASSERT_EQ(stage.server().terminate(), 0);
  expect_refused({"--case", (other / "case").string(), "--journal", file}, {"room.journal", "case", "start the server with that case"});
  const std::string text = (folder / "notes.txt").string();
  std::ofstream(text) << "not a journal";
  expect_refused({"--case", bone, "--journal", text}, {"notes.txt"});
  expect_refused({"--case", bone, "--journal", (folder / "nowhere" / "room.journal").string()}, {"nowhere"});
}

}  // namespace
}  // namespace osteon::test
