// Many rooms in one server. Whoever is in one room receives nothing of another. Each room can be closed, opened again,
// branched, replayed, verified, copied and deleted while the others go on.
#include <gtest/gtest.h>

#include <fstream>

#include "server/cli/room_admin_client.hpp"
#include "server/journal/maintenance.hpp"
#include "server/rpc/room_server.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {
namespace {

namespace fs = std::filesystem;

class RoomsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(test_block().save(dir_ / "case"));
    fs::create_directories(dir_ / "rooms");
    start();
  }
  void start(bool kept = true) {
    client_.reset();
    server_.reset();
    RoomsOptions options{.cases = {{test_block(), dir_ / "case"}}};
    if (kept) options.folder = dir_ / "rooms";
    auto rooms = std::make_unique<Rooms>(std::move(options));
    if (kept) rooms->resume_all([](double) {});
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0");
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
    auto client = RoomAdminClient::reach(server_->address(), std::chrono::seconds(5), {});
    ASSERT_TRUE(client.has_value()) << client.error().message;
    client_.emplace(std::move(*client));
  }
  void TearDown() override { server_.reset(); }

  std::unique_ptr<Surgeon> surgeon(const std::string& room) {
    return std::make_unique<Surgeon>(server_->address(), dir_ / "cache", "", room);
  }
  // Cuts, and waits until the room has come to rest.
  void cut(Surgeon& by, int count, unsigned seed, std::uint64_t from = 1) {
    ASSERT_TRUE(wait_until([&] { return by.complete(); }, kPatience));
    std::vector<Cut> cuts = strokes(by.author(), count, seed);
    for (std::size_t i = 0; i < cuts.size(); ++i) {
      cuts[i].author_seq = from + i;
      cuts[i].lease_epoch = by.lease();
      ASSERT_TRUE(wait_until([&] { return by.session().send(cuts[i]); }, kPatience));
    }
    ASSERT_TRUE(wait_until(
        [&] {
          return by.own() == from + cuts.size() - 1 &&
                 settled((*server_->rooms().find(by.session().room().name))->runtime(), {&by});
        },
        kPatience))
        << by.rejected();
  }
  std::string hash_of(const std::string& room) {
    return status_of(join(server_->address(), wire::ClientKind::viewer, room)).field_hash();
  }
  std::vector<std::string> listed(bool open) {
    std::vector<std::string> names;
    const auto all = client_->list();
    EXPECT_TRUE(all.has_value());
    for (const RoomLine& room : *all)
      if (room.open == open) names.push_back(room.name);
    return names;
  }
  std::string refusal_of(const std::string& room) {
    const auto joined =
        wire::join_room(server_->address(), wire::ClientKind::viewer, "test", std::chrono::seconds(5), {}, room);
    return joined ? "" : joined.error().message;
  }

  TempDir dir_;
  std::unique_ptr<RoomServer> server_;
  std::optional<RoomAdminClient> client_;
};

TEST_F(RoomsTest, WhoIsInOneReceivesNothingOfAnother) {
  ASSERT_TRUE(client_->create("anna", ""));
  ASSERT_TRUE(client_->create("berta", ""));
  const auto anna = surgeon("anna"), berta = surgeon("berta");
  cut(*anna, 10, 1);
  cut(*berta, 7, 2);
  EXPECT_EQ(wire::to_wire(anna->hash()), hash_of("anna"));
  EXPECT_EQ(wire::to_wire(berta->hash()), hash_of("berta"));
  EXPECT_NE(hash_of("anna"), hash_of("berta"));
  EXPECT_EQ(anna->own(), 10u);
  EXPECT_EQ(berta->own(), 7u);
  EXPECT_EQ(anna->author(), berta->author()) << "each room has its own author numbers";
  EXPECT_EQ(listed(true), (std::vector<std::string>{"anna", "berta"}));
}

// Open rooms use bones and threads, closed rooms use journals: both count towards the largest number of rooms.
TEST_F(RoomsTest, NoMoreAreMadeThanThereMayBe) {
  client_.reset();
  server_.reset();
  Rooms rooms({.cases = {{test_block(), dir_ / "case"}}, .folder = dir_ / "rooms", .most_rooms = 3});
  ASSERT_TRUE(rooms.create("anna", nullptr));
  ASSERT_TRUE(rooms.create("berta", nullptr));
  ASSERT_TRUE(rooms.branch("anna", "carla", RoomSeq{}));
  ASSERT_TRUE(rooms.close("berta"));
  const auto made = rooms.create("dora", nullptr), branched = rooms.branch("anna", "dora", RoomSeq{}),
             shown = rooms.replay("anna", "dora", RoomSeq{}, RoomSeq{}, 1);
  for (const auto* refused : {&made, &branched, &shown}) {
    ASSERT_FALSE(*refused);
    EXPECT_EQ(refused->error().code, ErrorCode::exhausted) << refused->error().message;
  }
  EXPECT_FALSE(fs::exists(dir_ / "rooms" / "dora.journal"));
  EXPECT_TRUE(rooms.resume("berta")) << "existing rooms may be opened";
  ASSERT_TRUE(rooms.remove("carla", false));
  EXPECT_TRUE(rooms.create("dora", nullptr));
}

TEST_F(RoomsTest, ACallWithoutANameIsToTheOnlyRoom) {
  EXPECT_NE(refusal_of("").find("no room is open"), std::string::npos);
  ASSERT_TRUE(client_->create("anna", ""));
  EXPECT_EQ(refusal_of(""), "");
  EXPECT_EQ(join(server_->address(), wire::ClientKind::audio).name, "anna");
  ASSERT_TRUE(client_->create("berta", ""));
  EXPECT_NE(refusal_of("").find("anna, berta"), std::string::npos);
  EXPECT_NE(refusal_of("carla").find("no room carla"), std::string::npos);
}

// Whoever joined the only room stays in it, also if another room is opened.
TEST_F(RoomsTest, WhoJoinedWithoutANameStaysInThatRoom) {
  ASSERT_TRUE(client_->create("anna", ""));
  const auto hand = surgeon("");
  cut(*hand, 5, 1);
  ASSERT_TRUE(client_->create("berta", ""));
  v1::UndoRequest undo;
  undo.set_author(hand->author().value);
  undo.set_count(1);
  v1::UndoResponse undone;
  grpc::ClientContext context;
  const auto status = v1::RoomService::NewStub(hand->session().room().channel)->Undo(&context, undo, &undone);
  EXPECT_TRUE(status.ok()) << status.error_message();
  ASSERT_TRUE(client_->close("anna"));
  grpc::ClientContext again;
  EXPECT_FALSE(v1::RoomService::NewStub(hand->session().room().channel)->Undo(&again, undo, &undone).ok())
      << "the remaining room is another one";
}

TEST_F(RoomsTest, AClosedRoomSaysSoAndGoesOnWhereItWas) {
  ASSERT_TRUE(client_->create("anna", ""));
  ASSERT_TRUE(client_->create("berta", ""));
  const auto anna = surgeon("anna"), berta = surgeon("berta");
  cut(*anna, 10, 1);
  const std::string before = hash_of("anna");
  const auto closed = client_->close("anna");
  ASSERT_TRUE(closed.has_value()) << closed.error().message;
  EXPECT_FALSE(closed->open);
  ASSERT_TRUE(wait_until([&] { return !anna->lost().empty(); }, kPatience));
  EXPECT_NE(anna->lost().find("anna was closed"), std::string::npos) << anna->lost();
  EXPECT_NE(refusal_of("anna").find("rooms resume anna"), std::string::npos);
  EXPECT_FALSE(client_->close("anna").has_value());
  EXPECT_EQ(listed(false), std::vector<std::string>{"anna"});
  cut(*berta, 5, 2);  // It goes on.
  ASSERT_TRUE(client_->resume("anna"));
  EXPECT_EQ(hash_of("anna"), before);
  const auto late = surgeon("anna");
  ASSERT_TRUE(wait_until([&] { return late->complete(); }, kPatience));
  EXPECT_EQ(wire::to_wire(late->hash()), before);
  cut(*late, 3, 3);
}

TEST_F(RoomsTest, TheRoomsThatWereOpenAreOpenAgain) {
  for (const char* name : {"anna", "berta", "carla"}) ASSERT_TRUE(client_->create(name, ""));
  {
    const auto anna = surgeon("anna");
    cut(*anna, 10, 1);
  }
  const std::string before = hash_of("anna");
  ASSERT_TRUE(client_->close("berta"));
  server_->stop_all();
  start();
  EXPECT_EQ(listed(true), (std::vector<std::string>{"anna", "carla"}));
  EXPECT_EQ(listed(false), std::vector<std::string>{"berta"});
  EXPECT_EQ(hash_of("anna"), before);
}

// A room that cannot be opened this time is tried again at the next start.
TEST_F(RoomsTest, ARoomThatCannotBeOpenedStaysOnTheListOfThoseThatWere) {
  for (const char* name : {"anna", "berta", "carla"}) ASSERT_TRUE(client_->create(name, ""));
  server_->stop_all();
  client_.reset();
  server_.reset();
  fs::rename(dir_ / "rooms" / "berta.journal", dir_ / "berta.aside");
  start();
  EXPECT_EQ(listed(true), (std::vector<std::string>{"anna", "carla"}));
  server_->stop_all();
  client_.reset();
  server_.reset();
  fs::rename(dir_ / "berta.aside", dir_ / "rooms" / "berta.journal");
  start();
  EXPECT_EQ(listed(true), (std::vector<std::string>{"anna", "berta", "carla"}));
}

TEST_F(RoomsTest, ABranchBeginsWithWhatWasAndGoesItsOwnWay) {
  ASSERT_TRUE(client_->create("anna", ""));
  const auto anna = surgeon("anna");
  cut(*anna, 10, 1);
  const RoomSeq fork = anna->seq();
  const std::string at_fork = hash_of("anna");
  cut(*anna, 5, 2, 11);
  const std::string after = hash_of("anna");
  const auto branch = client_->branch("anna", "what-if", fork);  // While the room is open.
  ASSERT_TRUE(branch.has_value()) << branch.error().message;
  EXPECT_EQ(branch->parent, "anna");
  EXPECT_EQ(branch->parent_room_seq, fork);
  EXPECT_EQ(hash_of("what-if"), at_fork);
  const auto other = surgeon("what-if");
  cut(*other, 4, 3);
  EXPECT_NE(hash_of("what-if"), at_fork);
  EXPECT_EQ(hash_of("anna"), after);
  // A branch of all of a closed room. Cuts from before the branch can be undone.
  ASSERT_TRUE(client_->close("anna"));
  ASSERT_TRUE(client_->branch("anna", "copy", RoomSeq{}));
  EXPECT_EQ(hash_of("copy"), after);
  EXPECT_FALSE(client_->branch("anna", "copy", RoomSeq{}).has_value());
  EXPECT_FALSE(client_->branch("anna", "beyond", RoomSeq{100000}).has_value());
  EXPECT_FALSE(client_->branch("nobody", "new", RoomSeq{}).has_value());
}

TEST_F(RoomsTest, DeletingLeavesNothingAndAsksAboutBranches) {
  for (const char* name : {"anna", "berta"}) ASSERT_TRUE(client_->create(name, ""));
  const auto anna = surgeon("anna");
  cut(*anna, 5, 1);
  ASSERT_TRUE(client_->branch("anna", "child", RoomSeq{}));
  ASSERT_TRUE(client_->branch("child", "grandchild", RoomSeq{}));
  ASSERT_TRUE(client_->close("grandchild"));
  const auto refused = client_->remove("anna", false);
  ASSERT_FALSE(refused.has_value());
  EXPECT_NE(refused.error().message.find("child"), std::string::npos);
  EXPECT_EQ(listed(true), (std::vector<std::string>{"anna", "berta", "child"}));
  const auto gone = client_->remove("anna", true);
  ASSERT_TRUE(gone.has_value()) << gone.error().message;
  EXPECT_EQ(gone->size(), 3u);
  EXPECT_EQ(gone->back(), "anna");
  EXPECT_EQ(listed(true), std::vector<std::string>{"berta"});
  EXPECT_TRUE(listed(false).empty());
  for (const auto& entry : fs::directory_iterator(dir_ / "rooms")) {
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(name.starts_with("berta") || name == "open-rooms") << name << " is left";
  }
  EXPECT_FALSE(client_->remove("anna", true).has_value());
}

// A backup in the folder is no room, whatever its name, and prevents no other room.
TEST_F(RoomsTest, ABackupOfABranchIsNotTakenForARoomOfItsName) {
  for (const char* name : {"anna", "bob"}) ASSERT_TRUE(client_->create(name, ""));
  const auto anna = surgeon("anna");
  cut(*anna, 3, 1);
  ASSERT_TRUE(client_->branch("anna", "what-if", RoomSeq{}));
  ASSERT_TRUE(client_->back_up("what-if", "bob.backup"));
  const auto gone = client_->remove("anna", true);
  ASSERT_TRUE(gone.has_value()) << gone.error().message;
  EXPECT_EQ(*gone, (std::vector<std::string>{"what-if", "anna"}));
  EXPECT_EQ(listed(true), std::vector<std::string>{"bob"});
}

TEST_F(RoomsTest, WhatHappenedHappensAgainForThoseWhoWatch) {
  ASSERT_TRUE(client_->create("anna", ""));
  const auto anna = surgeon("anna");
  cut(*anna, 10, 1);
  const RoomSeq middle = anna->seq();
  const std::string then = hash_of("anna");
  cut(*anna, 10, 2, 11);
  const RoomSeq last = anna->seq();
  const std::string now = hash_of("anna");
  // Stopped at one moment.
  ASSERT_TRUE(client_->replay("anna", "still", middle, last, 0.0));
  EXPECT_EQ(hash_of("still"), then);
  // From the beginning and much faster than it was, while the replayed room goes on.
  ASSERT_TRUE(client_->replay("anna", "film", RoomSeq{}, last, 1000.0));
  cut(*anna, 3, 3, 21);
  ASSERT_TRUE(wait_until([&] { return hash_of("film") == now; }, kPatience));
  EXPECT_EQ(hash_of("still"), then) << "still";
  MeshReader viewer(server_->address(), "film"), as_it_is(server_->address(), "still");
  EXPECT_TRUE(viewer.read_to(last));
  EXPECT_TRUE(as_it_is.read_to(middle));
  EXPECT_NE(viewer.hashes(), as_it_is.hashes());
  // The tools of the replay are visible, and at rest once nothing more happens.
  v1::WatchCuttingRequest watching;
  const wire::JoinedRoom gallery = join(server_->address(), wire::ClientKind::viewer, "film");
  watching.set_author(gallery.author.value);
  grpc::ClientContext seeing;
  seeing.set_deadline(std::chrono::system_clock::now() + kPatience);
  const auto tools = v1::WatchService::NewStub(gallery.channel)->WatchCutting(&seeing, watching);
  v1::WatchCuttingResponse seen;
  bool at_rest = false;
  while (!at_rest && tools->Read(&seen)) {
    at_rest = seen.states_size() > 0;
    for (const v1::CuttingState& state : seen.states()) {
      EXPECT_TRUE(state.tool_name() == "drill-3.2" || state.tool_name() == "burr-round-5");
      at_rest &= state.spindle_rpm() == 0;
    }
  }
  EXPECT_TRUE(at_rest);
  seeing.TryCancel();
  (void)tools->Finish();
  // Nobody can change it.
  const auto hand =
      wire::join_room(server_->address(), wire::ClientKind::haptic, "test", std::chrono::seconds(5), {}, "film");
  ASSERT_FALSE(hand.has_value());
  EXPECT_NE(hand.error().message.find("watch"), std::string::npos);
  const wire::JoinedRoom watcher = join(server_->address(), wire::ClientKind::viewer, "film");
  v1::UndoRequest undo;
  undo.set_author(watcher.author.value);
  undo.set_count(1);
  v1::UndoResponse undone;
  grpc::ClientContext context;
  EXPECT_FALSE(v1::RoomService::NewStub(watcher.channel)->Undo(&context, undo, &undone).ok());
  // The author of the replayed room cannot either, although the replay knows him and his secret.
  wire::JoinedRoom author = anna->session().room();
  author.channel = watcher.channel;
  EXPECT_FALSE(wire::join_again(author, wire::ClientKind::haptic, {}).has_value());
  v1::SessionRequest opening;
  opening.mutable_open()->set_author(author.author.value);
  opening.mutable_open()->set_server_epoch(watcher.server_epoch);
  opening.mutable_open()->set_secret(author.secret);
  grpc::ClientContext cutting;
  const auto session = v1::CuttingService::NewStub(watcher.channel)->Session(&cutting);
  ASSERT_TRUE(session->Write(opening));
  v1::SessionResponse nothing;
  EXPECT_FALSE(session->Read(&nothing));
  EXPECT_NE(session->Finish().error_message().find("watched"), std::string::npos);
  EXPECT_FALSE(client_->replay("anna", "beyond", RoomSeq{}, RoomSeq{1000000}, 1.0).has_value());
  // The replayed room may be closed. Then the replay ends.
  ASSERT_TRUE(client_->close("film"));
  EXPECT_TRUE(listed(false).empty()) << "a replay is not stored";
}

TEST_F(RoomsTest, AJournalIsCheckedAndCopiedWhileItsRoomIsCut) {
  ASSERT_TRUE(client_->create("anna", ""));
  const auto anna = surgeon("anna");
  cut(*anna, 20, 1);
  std::atomic<bool> end{false};
  std::thread hand([&] {
    const std::vector<Cut> more = strokes(anna->author(), 400, 2);
    for (std::uint64_t i = 0; !end && i < more.size(); ++i) {
      Cut one = more[i];
      one.author_seq = 21 + i;
      one.lease_epoch = anna->lease();
      while (!end && !anna->session().send(one)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  const auto checked = client_->verify("anna");
  const auto copied = client_->back_up("anna", "anna.backup");
  end = true;
  hand.join();
  ASSERT_TRUE(checked.has_value()) << checked.error().message;
  EXPECT_TRUE(checked->faults.empty()) << checked->faults.front();
  EXPECT_GE(checked->room_seq.value, 21u);
  ASSERT_TRUE(copied.has_value()) << copied.error().message;
  const auto report = verify_journal(dir_ / "rooms" / copied->file);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_TRUE(report->sound());
  EXPECT_EQ(report->head.seq, copied->room_seq);
  EXPECT_GE(copied->room_seq, checked->room_seq);
  EXPECT_FALSE(client_->back_up("anna", "../anna.backup").has_value());
  EXPECT_FALSE(client_->back_up("anna", "anna.journal").has_value());
  EXPECT_FALSE(client_->back_up("anna", "anna.backup").has_value()) << "the file exists already";
}

TEST_F(RoomsTest, NamesAreNamesOfFiles) {
  for (const char* name : {"", "..", "../anna", "a b", "a/b", "-anna", "anna.journal",
                           "a234567890123456789012345678901234567890123456789012345678901234567890"})
    EXPECT_FALSE(client_->create(name, "").has_value()) << name;
  ASSERT_TRUE(client_->create("anna_2-b", ""));
  EXPECT_FALSE(client_->create("anna_2-b", "").has_value());
  EXPECT_FALSE(client_->create("berta", std::string(64, 'a')).has_value()) << "there is no such case";
  std::ofstream(dir_ / "rooms" / "notes.journal") << "not a journal";
  EXPECT_FALSE(client_->resume("notes").has_value());
  EXPECT_EQ(listed(true), std::vector<std::string>{"anna_2-b"});
}

TEST_F(RoomsTest, WithoutAFolderRoomsEndWithTheServer) {
  start(false);
  ASSERT_TRUE(client_->create("anna", ""));
  const auto anna = surgeon("anna");
  cut(*anna, 5, 1);
  const auto all = client_->list();
  ASSERT_TRUE(all.has_value());
  ASSERT_EQ(all->size(), 1u);
  EXPECT_FALSE(all->front().kept);
  EXPECT_FALSE(client_->branch("anna", "child", RoomSeq{}).has_value());
  EXPECT_FALSE(client_->verify("anna").has_value());
  EXPECT_FALSE(client_->replay("anna", "film", RoomSeq{}, RoomSeq{}, 1.0).has_value());
  ASSERT_TRUE(client_->remove("anna", false));
  EXPECT_TRUE(listed(true).empty());
}

// A mark is found again, and the room returns to it.
TEST_F(RoomsTest, AMarkIsReturnedTo) {
  ASSERT_TRUE(client_->create("anna", ""));
  const auto anna = surgeon("anna");
  cut(*anna, 5, 1);
  const std::string then = hash_of("anna");
  const wire::JoinedRoom viewer = join(server_->address(), wire::ClientKind::viewer, "anna");
  const auto stub = v1::RoomService::NewStub(viewer.channel);
  v1::MarkRequest mark;
  mark.set_author(viewer.author.value);
  mark.set_label("before the reamer");
  v1::MarkResponse marked;
  grpc::ClientContext first;
  ASSERT_TRUE(stub->Mark(&first, mark, &marked).ok());
  cut(*anna, 5, 2, 6);
  ASSERT_NE(hash_of("anna"), then);
  const v1::GetStatusResponse status = status_of(viewer);
  ASSERT_EQ(status.marks_size(), 1);
  EXPECT_EQ(status.marks(0).label(), "before the reamer");
  EXPECT_EQ(status.marks(0).room_seq(), marked.room_seq());
  v1::UndoRequest undo;
  undo.set_author(viewer.author.value);
  undo.set_to_mark(marked.room_seq());
  v1::UndoResponse undone;
  grpc::ClientContext second;
  ASSERT_TRUE(stub->Undo(&second, undo, &undone).ok());
  EXPECT_GE(undone.undone_size(), 5);
  EXPECT_EQ(hash_of("anna"), then);
}

}  // namespace
}  // namespace osteon::test
