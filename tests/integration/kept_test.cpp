// Tests a room with a journal, as processes see it: killed servers, a stop and a start, and files that are no journals.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <map>
#include <sstream>

#include "common/volume/field_file.hpp"
#include "tests/integration/killed_servers.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/trials.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;

TEST(PersistedRooms, KilledServersLoseNothingTheyAcknowledged) {
  const int kills = static_cast<int>(trials(100));
  const KilledServers report = kill_servers(kills, 1);
  EXPECT_EQ(report.fault, "");
  EXPECT_EQ(report.kills, kills);
  EXPECT_LE(report.killed_idle, kills / 4) << "most kills are during work";
  EXPECT_GT(report.acknowledged, trials(1000));
  EXPECT_EQ(report.lost, 0u);
  EXPECT_EQ(report.twice, 0u);
  EXPECT_EQ(report.missing, 0u);
  EXPECT_EQ(report.kept, report.sent);
  EXPECT_EQ(report.hashes_that_differ, 0);
  std::printf("killed %d servers: %llu cuts sent, %llu acknowledged, %llu kept, %llu lost\n", report.kills,
              static_cast<unsigned long long>(report.sent), static_cast<unsigned long long>(report.acknowledged),
              static_cast<unsigned long long>(report.kept), static_cast<unsigned long long>(report.lost));
}

// After a stop and a start the bone is the same, and cuts from before can still be undone.
TEST(PersistedRooms, ARoomGoesOnWithAllThatCanBeUndone) {
  TempDir folder;
  const std::string file = (folder / "room.journal").string();
  Stage stage(12.0, {"--plain", "--journal", file});
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
  stage.start_server({"--plain", "--journal", file});
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

// Output of `osteon-server rooms`. Empty if it fails.
std::string rooms(const Stage& stage, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "rooms");
  arguments.insert(arguments.end(), {"--server", stage.address(), "--plain"});
  const RunResult result = run(program("osteon-server"), arguments, 60s);
  return result.exit_code == 0 ? result.out : "";
}

// Rooms as a person makes them on the command line. Hands are in two of them when the server is killed.
TEST(PersistedRooms, TheRoomsOfAKilledServerAreOpenAgain) {
  TempDir folder;
  const std::string kept = (folder / "rooms").string();
  Stage stage(12.0, {"--plain", "--rooms", kept});
  EXPECT_NE(rooms(stage, {"list"}).find("no rooms"), std::string::npos);
  for (const char* name : {"anna", "berta", "closed"})
    ASSERT_NE(rooms(stage, {"create", name}).find(name), std::string::npos);
  const std::string closed = rooms(stage, {"close", "closed"});
  EXPECT_NE(closed.find(" closed "), std::string::npos) << closed;
  std::map<std::string, std::string> hashes;
  for (const char* name : {"anna", "berta"}) {
    Surgeon hand(stage.address(), folder / "cache", "", name);
    ASSERT_TRUE(wait_until([&] { return hand.complete(); }, kPatience));
    for (std::uint64_t i = 1; i <= 5; ++i) {
      const Vec3 at{-4.0 + static_cast<double>(i), name[0] == 'a' ? 0.0 : 1.0, 0};
      Cut cut = straight_cut(find_tool("burr-round-5").value(), at, at, {0, 0, -1}, i);
      cut.author = hand.author();
      ASSERT_TRUE(hand.session().send(cut));
    }
    ASSERT_TRUE(wait_until([&] { return hand.own() == 5; }, kPatience));
    hashes[name] = status_of(hand.session().room()).field_hash();
  }
  ASSERT_NE(hashes["anna"], hashes["berta"]);
  stage.server().signal(SIGKILL);
  ASSERT_TRUE(stage.server().wait(10s).has_value());
  stage.start_server({"--plain", "--rooms", kept});
  const std::string list = rooms(stage, {"list"});
  for (const std::string name : {"anna", "berta"}) {
    EXPECT_NE(list.find(name + std::string(20 - name.size(), ' ') + " open, at event"), std::string::npos) << list;
    EXPECT_EQ(status_of(join(stage.address(), wire::ClientKind::viewer, name)).field_hash(), hashes[name]);
    EXPECT_NE(rooms(stage, {"verify", name}).find("sound"), std::string::npos);
  }
  EXPECT_NE(list.find("closed               closed"), std::string::npos) << list;
  ASSERT_EQ(stage.server().terminate(), 0) << stage.server().err();
  const nlohmann::json summary = read_json(stage / "server.json");
  EXPECT_EQ(summary.at("rooms").size(), 2u);
}

// A room made beside the server's own room does not change how that one is saved.
TEST(PersistedRooms, TheServersOwnRoomIsSavedWhateverIsMadeBesideIt) {
  TempDir folder;
  const std::string file = (folder / "bone.vdb").string();
  Stage stage(12.0, {"--plain", "--save", file});
  {
    Surgeon hand(stage.address(), folder / "cache");
    ASSERT_TRUE(wait_until([&] { return hand.complete(); }, kPatience));
    Cut cut = straight_cut(find_tool("burr-round-5").value(), {0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 1);
    cut.author = hand.author();
    ASSERT_TRUE(hand.session().send(cut));
    ASSERT_TRUE(wait_until([&] { return hand.own() == 1; }, kPatience));
  }
  ASSERT_NE(rooms(stage, {"create", "anna"}), "");  // before "room" in alphabetical order
  ASSERT_EQ(stage.server().terminate(), 0) << stage.server().err();
  const auto saved = load_fields(file);
  ASSERT_TRUE(saved.has_value()) << saved.error().message;
  EXPECT_FALSE(saved->leaves.empty());
  EXPECT_EQ(read_json(stage / "server.json").at("rooms").size(), 2u);
}

TEST(PersistedRooms, ARoomOfAFileOfItsOwnIsNotForOthersToDelete) {
  TempDir folder;
  const std::filesystem::path file = folder / "my room.2026.journal";
  Stage stage(12.0, {"--plain", "--journal", file.string()});
  for (const char* what : {"delete", "close"}) {
    const RunResult refused =
        run(program("osteon-server"), {"rooms", what, "my room.2026", "--server", stage.address(), "--plain"}, 30s);
    EXPECT_NE(refused.exit_code, 0);
    EXPECT_NE(refused.err.find("my room.2026.journal"), std::string::npos) << refused.err;
  }
  Surgeon hand(stage.address(), folder / "cache", "", "my room.2026");
  EXPECT_TRUE(wait_until([&] { return hand.complete(); }, kPatience));
  ASSERT_EQ(stage.server().terminate(), 0);
  EXPECT_TRUE(std::filesystem::exists(file));
}

void expect_refused(const std::vector<std::string>& arguments, const std::vector<std::string>& words) {
  const RunResult server = run(program("osteon-server"), arguments, 30s);
  EXPECT_FALSE(server.timed_out);
  EXPECT_NE(server.exit_code, 0);
  for (const std::string& word : words)
    EXPECT_NE(server.err.find(word), std::string::npos) << word << " in " << server.err;
}

// Of all files but the audit log, which names each refused command.
std::map<std::string, std::string> bytes_in(const std::filesystem::path& folder) {
  std::map<std::string, std::string> all;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with("audit.")) continue;
    std::ostringstream bytes;
    bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    all[entry.path().filename().string()] = std::move(bytes).str();
  }
  return all;
}

// A program on the journal of a running server changes nothing and reports the reason, even after somebody removed what
// looks like a lock.
TEST(PersistedRooms, AnotherProgramOnTheJournalOfARunningServerIsRefused) {
  TempDir folder;
  const std::filesystem::path kept = folder / "kept", file = kept / "room.journal", to = folder / "new";
  std::filesystem::create_directory(kept);
  Stage stage(12.0, {"--plain", "--journal", file.string()});
  Surgeon hand(stage.address(), folder / "cache");
  ASSERT_TRUE(wait_until([&] { return hand.complete(); }, kPatience));
  const auto cut = [&](std::uint64_t number) {
    Cut one = straight_cut(find_tool("burr-round-5").value(), {-4.0 + static_cast<double>(number), 0, 0},
                           {-4.0 + static_cast<double>(number), 0, 0}, {0, 0, -1}, number);
    one.author = hand.author();
    return hand.session().send(one) && wait_until([&] { return hand.own() == number; }, kPatience);
  };
  ASSERT_TRUE(cut(1));
  std::filesystem::remove(file.string() + ".lock");
  const auto before = bytes_in(kept);
  const std::string bone = (stage / "case").string();
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"verify", file},
                                             {"salvage", file, to},
                                             {"backup", file, to},
                                             {"migrate", file, to},
                                             {"branch", file, to},
                                             {"replay", file, "--case", bone},
                                             {"export", file, to},
                                             {"people", file},
                                             {"erase-person", file, "--older-than", "1"},
                                             {"rename-room", file, "other"},
                                             {"delete", file, "--alone"},
                                             {"--case", bone, "--plain", "--journal", file}}) {
    const RunResult other = run(program("osteon-server"), command, 30s);
    EXPECT_NE(other.exit_code, 0) << command.front();
    EXPECT_NE(other.err.find("room.journal is in use by another process"), std::string::npos) << other.err;
    EXPECT_FALSE(std::filesystem::exists(to)) << command.front();
  }
  EXPECT_EQ(bytes_in(kept), before);
  ASSERT_TRUE(cut(2));
  const std::string bytes = status_of(hand.session().room()).field_hash();
  Digest hash;
  ASSERT_EQ(bytes.size(), hash.bytes.size());
  std::ranges::copy(bytes, hash.bytes.begin());
  stage.server().signal(SIGKILL);
  ASSERT_TRUE(stage.server().wait(10s).has_value());
  const RunResult replayed = run(program("osteon-server"), {"replay", file, "--case", bone}, 60s);
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_NE(replayed.out.find(to_hex(hash)), std::string::npos) << replayed.out;
}

// Two rooms of one case whose files somebody has exchanged.
TEST(PersistedRooms, ARoomIsServedOnlyUnderItsOwnName) {
  TempDir folder;
  const std::filesystem::path kept = folder / "rooms", a = kept / "anna.journal", b = kept / "berta.journal";
  Stage stage(12.0, {"--plain", "--rooms", kept.string()});
  for (const char* name : {"anna", "berta"}) ASSERT_NE(rooms(stage, {"create", name}).find(name), std::string::npos);
  ASSERT_EQ(stage.server().terminate(), 0) << stage.server().err();
  std::filesystem::rename(a, folder / "aside");
  std::filesystem::rename(b, a);
  std::filesystem::rename(folder / "aside", b);

  const std::string bone = (stage / "case").string();
  expect_refused({"--case", bone, "--plain", "--journal", a.string()},
                 {a.string() + " holds the room berta, not anna", "osteon-server rename-room " + a.string() + " anna"});
  stage.start_server({"--plain", "--rooms", kept.string()});
  const RunResult opened =
      run(program("osteon-server"), {"rooms", "open", "anna", "--server", stage.address(), "--plain"}, 30s);
  EXPECT_NE(opened.exit_code, 0);
  EXPECT_NE((opened.err + stage.server().err()).find("holds the room berta, not anna"), std::string::npos)
      << opened.err;
  ASSERT_EQ(stage.server().terminate(), 0);
  EXPECT_EQ(run(program("osteon-server"), {"rename-room", a.string(), "anna"}, 30s).exit_code, 0);
  stage.start_server({"--plain", "--rooms", kept.string()});
  const std::string list = rooms(stage, {"list"});
  EXPECT_NE(list.find("anna                 open"), std::string::npos) << list;
  EXPECT_NE(list.find("berta                closed"), std::string::npos) << list;
  ASSERT_EQ(stage.server().terminate(), 0);
}

// Anybody who knows how the chain is made can continue it. They do not have the server's key.
TEST(PersistedRooms, InventedEventsAreSignedByNobody) {
  TempDir folder;
  const std::filesystem::path file = folder / "room.journal", key_file = folder / "signing.key";
  Stage stage(12.0, {"--plain", "--journal", file.string()});
  {
    Surgeon hand(stage.address(), folder / "cache");
    ASSERT_TRUE(wait_until([&] { return hand.complete(); }, kPatience));
    Cut cut = straight_cut(find_tool("burr-round-5").value(), Vec3::Zero(), Vec3::Zero(), {0, 0, -1}, 1);
    cut.author = hand.author();
    ASSERT_TRUE(hand.session().send(cut));
    ASSERT_TRUE(wait_until([&] { return hand.own() == 1; }, kPatience));
  }
  stage.server().signal(SIGKILL);
  ASSERT_EQ(stage.server().wait(30s), 128 + SIGKILL);

  const auto server = [](std::vector<std::string> arguments) {
    return run(program("osteon-server"), std::move(arguments), 60s);
  };
  const auto shown = server({"key", "show", key_file.string()});
  ASSERT_EQ(shown.exit_code, 0) << shown.err;
  const std::string key = shown.out.substr(0, shown.out.find('\n'));
  RunResult verified = server({"verify", file.string(), "--key", key});
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  EXPECT_NE(verified.out.find("verdict:     sound\n"), std::string::npos) << verified.out;
  verified = server({"verify", file.string()});
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  EXPECT_NE(verified.out.find("verdict:     unsigned"), std::string::npos) << verified.out;

  std::uint64_t last = 0;
  {
    Journal journal = std::move(Journal::open(file).value());
    last = journal.head().seq.value;
    std::vector<JournalEntry> entries;
    ASSERT_TRUE(journal.read(RoomSeq{last}, [&](const JournalEntry& entry) {
      entries.assign(100'000, entry);
      return true;
    }));
    for (std::size_t i = 0; i < entries.size(); ++i) entries[i].seq.value = last + i + 1;
    ASSERT_TRUE(journal.append(entries) && journal.close());
  }
  verified = server({"verify", file.string(), "--key", key});
  EXPECT_NE(verified.exit_code, 0);
  EXPECT_NE(verified.out.find("signed:      1 to " + std::to_string(last) + " by " + key.substr(0, 16)),
            std::string::npos)
      << verified.out;
  EXPECT_NE(verified.out.find("not signed:  " + std::to_string(last + 1) + " to " + std::to_string(last + 100'000) +
                              " by anybody"),
            std::string::npos)
      << verified.out;
  EXPECT_EQ(verified.out.find("sound"), std::string::npos) << verified.out;
  verified = server({"verify", file.string()});
  EXPECT_EQ(verified.out.find("sound"), std::string::npos) << verified.out;

  // Another server's key, a new key of the same server, and a file that is not a key.
  const auto rotated = server({"key", "rotate", key_file.string()});
  ASSERT_EQ(rotated.exit_code, 0) << rotated.err;
  EXPECT_NE(rotated.out.substr(0, 64), key);
  expect_refused({"verify", file.string(), "--key", std::string(64, '7')}, {"does not vouch for all of it"});
  expect_refused({"verify", file.string(), "--key", "nowhere"},
                 {"--key nowhere is neither 64 hexadecimal digits nor a file"});
  std::filesystem::permissions(key_file, std::filesystem::perms::others_read, std::filesystem::perm_options::add);
  expect_refused({"key", "show", key_file.string()}, {"chmod 600 " + key_file.string()});
}

TEST(PersistedRooms, SaysWhatIsWrongWithAJournal) {
  TempDir folder;
  const std::string file = (folder / "room.journal").string();
  Stage stage(12.0, {"--plain", "--journal", file}), other(14.0);
  const std::string bone = (stage / "case").string();
  expect_refused({"--case", bone, "--plain", "--journal", file}, {"room.journal", "in use"});
  expect_refused({"--case", bone, "--plain", "--journal", file, "--resume", "x.vdb"}, {"--journal", "--resume"});
  expect_refused({"--case", bone, "--plain", "--journal", file, "--rooms", "y"}, {"--journal", "--rooms"});
  expect_refused({"--case", bone, "--case", bone, "--plain"}, {"--case", "--rooms"});
  expect_refused({"--case", bone, "--plain", "--rooms", (stage / "case" / "case.json").string()},
                 {"--rooms", "case.json"});
  ASSERT_EQ(stage.server().terminate(), 0);
  expect_refused({"--case", (other / "case").string(), "--plain", "--journal", file},
                 {"room.journal", "case", "start the server with that case"});
  const std::string text = (folder / "notes.txt").string();
  std::ofstream(text) << "not a journal";
  expect_refused({"--case", bone, "--plain", "--journal", text}, {"notes.txt"});
  expect_refused({"--case", bone, "--plain", "--journal", (folder / "nowhere" / "room.journal").string()}, {"nowhere"});
}

}  // namespace
}  // namespace osteon::test
