// Requests of members to a served room other than cuts, with real clients.
#include <filesystem>

#include "osteon/v1/people.grpc.pb.h"
#include "tests/unit/rooms/served_room.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using namespace test;

class RoomRpc : public ServedRoom {
 protected:
  // One call of a member who joined as an observer.
  template <class Request, class Response>
  grpc::Status call(grpc::Status (v1::RoomService::Stub::*rpc)(grpc::ClientContext*, const Request&, Response*),
                    Request request, Response& response, std::optional<std::uint64_t> author = std::nullopt) {
    if (!watcher_) watcher_ = join(address(), wire::ClientKind::viewer);
    request.set_author(author.value_or(watcher_->author.value));
    grpc::ClientContext context;
    const auto stub = v1::RoomService::NewStub(watcher_->channel);
    return (stub.get()->*rpc)(&context, request, &response);
  }
  grpc::Status undo(std::uint32_t count, v1::UndoResponse& response) {
    v1::UndoRequest request;
    request.set_count(count);
    return call(&v1::RoomService::Stub::Undo, request, response);
  }

  std::optional<wire::JoinedRoom> watcher_;
};

// Twelve cuts in two rows of six, none of which separates debris.
std::vector<Cut> dimples(AuthorId author, double y_mm) {
  std::vector<Cut> cuts;
  for (int i = 0; i < 12; ++i) {
    const Vec3 tip{-9.0 + 3.6 * (i % 6), y_mm + 5.0 * (i / 6), -1.0};
    cuts.push_back(straight_cut(tool_named("burr-round-5"), tip, tip, {0, 0, -1}, static_cast<std::uint64_t>(i) + 1));
    cuts.back().author = author;
  }
  return cuts;
}

Tool own_tool() {
  Tool tool = tool_named("burr-round-5");
  tool.name = "burr-of-this-room";
  tool.diameter_mm = tool.cutting_length_mm = 4.0;
  return tool;
}

// Stops all of them, or lets all go on. The answer has the sequence number.
TEST_F(RoomRpc, ADecisionAboutAllIsALogEntryOnlyForThoseWhomItChanges) {
  auto away = surgeon();
  const auto here = surgeon();
  const auto viewer = join(address(), wire::ClientKind::viewer);
  ASSERT_TRUE(wait_until([&] { return away->complete() && here->complete(); }, kPatience));
  const AuthorId absent = away->author();
  away.reset();
  const auto decide = [&](std::uint64_t subject, bool stopped) {
    v1::SuperviseRequest request;
    request.set_author(viewer.author.value);
    request.set_subject(subject);
    request.mutable_supervision()->set_stopped(stopped);
    v1::SuperviseResponse response;
    grpc::ClientContext context;
    const grpc::Status status = v1::PeopleService::NewStub(viewer.channel)->Supervise(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.room_seq();
  };
  const auto head = [&] { return runtime().room_seq().value; };
  const std::uint64_t before = head();
  EXPECT_EQ(decide(0, false), before) << "nobody was stopped before";
  EXPECT_EQ(head(), before);
  EXPECT_EQ(decide(0, true), before + 2) << "also for those who are away";
  EXPECT_EQ(decide(0, true), before + 2);
  EXPECT_EQ(head(), before + 2) << "only once for each";
  EXPECT_EQ(decide(absent.value, false), before + 3);
  EXPECT_EQ(decide(0, true), before + 4);
  EXPECT_EQ(head(), before + 4) << "only for the one who was let go on";
  EXPECT_EQ(decide(here->author().value, true), before + 5) << "a decision about one is always an entry";
}

TEST_F(RoomRpc, AnUndoByAnotherReachesEveryReplicaAndViewer) {
  const auto first = surgeon(), second = surgeon();
  send(*first, dimples(first->author(), -8.0));
  send(*second, dimples(second->author(), 3.0));
  MeshReader viewer(address());
  ASSERT_TRUE(wait_until([&] { return first->own() == 12 && second->own() == 12 && first->seq() == second->seq(); },
                         kPatience));
  // The observer may have joined after the last cut. A join is an entry as well.
  const RoomSeq last_cut = std::max(first->acknowledged().at(12), second->acknowledged().at(12));
  ASSERT_TRUE(viewer.read_to(last_cut));
  const auto surface = viewer.hashes();
  const Digest all = first->hash();

  v1::UndoResponse undone;
  ASSERT_TRUE(undo(5, undone).ok());
  EXPECT_GT(undone.room_seq(), last_cut.value);
  ASSERT_EQ(undone.undone_size(), 5);
  EXPECT_EQ(undone.undone(4), last_cut.value);
  for (Surgeon* holder : {first.get(), second.get()})
    ASSERT_TRUE(wait_until([&] { return holder->seq().value == undone.room_seq(); }, kPatience));
  const auto late = surgeon();
  ASSERT_TRUE(wait_until([&] { return late->complete(); }, kPatience));
  const auto status = status_of(late->session().room());
  for (Surgeon* holder : {first.get(), second.get(), late.get()})
    EXPECT_EQ(wire::to_wire(holder->hash()), status.field_hash());
  EXPECT_EQ(first->lease(), second->lease());
  EXPECT_NE(first->hash(), all);
  ASSERT_TRUE(viewer.read_to(RoomSeq{undone.room_seq()}));
  EXPECT_NE(viewer.hashes(), surface);

  v1::RedoRequest again;
  again.set_count(1);
  v1::RedoResponse redone;
  ASSERT_TRUE(call(&v1::RoomService::Stub::Redo, again, redone).ok());
  EXPECT_EQ(redone.redone_size(), 5);
  ASSERT_TRUE(wait_until([&] { return second->seq().value == redone.room_seq(); }, kPatience));
  EXPECT_EQ(second->hash(), all);
  ASSERT_TRUE(viewer.read_to(RoomSeq{redone.room_seq()}));
  EXPECT_EQ(viewer.hashes(), surface) << "the surface is as before the cut";
}

TEST_F(RoomRpc, AToolIsAddedAtRunTimeAndCuts) {
  const auto hand = surgeon();
  ASSERT_TRUE(wait_until([&] { return hand->complete(); }, kPatience));
  v1::AddToolRequest request;
  *request.mutable_tool() = wire::to_wire(own_tool());
  v1::AddToolResponse added;
  const grpc::Status status = call(&v1::RoomService::Stub::AddTool, request, added);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(added.room_seq(), 3u) << "two have joined before";
  EXPECT_EQ(added.tool_hash(), wire::to_wire(own_tool().hash()));
  ASSERT_TRUE(wait_until([&] { return hand->seq().value == added.room_seq(); }, kPatience));
  ASSERT_NE(hand->session().tools()->find(own_tool().hash()), nullptr);

  Cut cut = straight_cut(own_tool(), {0, 0, 0}, {2, 0, 0}, {0, 0, -1});
  cut.author = hand->author();
  send(*hand, {cut});
  ASSERT_TRUE(wait_until([&] { return hand->own() == 1; }, kPatience));
  const auto late = surgeon();
  ASSERT_TRUE(wait_until([&] { return late->complete(); }, kPatience));
  EXPECT_NE(late->session().tools()->find(own_tool().hash()), nullptr) << "whoever joins later is sent the tool";
  EXPECT_EQ(wire::to_wire(late->hash()), status_of(late->session().room()).field_hash());

  v1::ListToolsResponse list;
  ASSERT_TRUE(call(&v1::RoomService::Stub::ListTools, v1::ListToolsRequest{}, list).ok());
  EXPECT_EQ(static_cast<std::size_t>(list.tools_size()), builtin_tools().size() + 1);
  v1::GetToolRequest get;
  get.set_tool_hash(added.tool_hash());
  v1::GetToolResponse got;
  ASSERT_TRUE(call(&v1::RoomService::Stub::GetTool, get, got).ok());
  EXPECT_EQ(wire::from_wire(got.tool())->hash(), own_tool().hash());
}

TEST_F(RoomRpc, ItemsStandInTheSceneOfEveryMember) {
  const auto early = surgeon();
  ASSERT_TRUE(wait_until([&] { return early->complete(); }, kPatience));
  SceneItem guide;
  guide.tool = tool_named("guide-1").hash();
  guide.pose_bone_item = pose_along({1, 2, 0}, {0, 0, -1});
  const auto id = early->session().set_item(guide);
  ASSERT_TRUE(id) << id.error().message;
  ASSERT_TRUE(wait_until([&] { return early->items().size() == 1; }, kPatience));
  const auto late = surgeon();
  ASSERT_TRUE(wait_until([&] { return late->complete() && late->items().size() == 1; }, kPatience));
  EXPECT_EQ(late->items()[0].id, *id);
  EXPECT_EQ(late->items()[0].tool, guide.tool);
  EXPECT_LT((late->items()[0].pose_bone_item.position_mm - guide.pose_bone_item.position_mm).norm(), 1e-6);

  const wire::JoinedRoom viewer = join(address(), wire::ClientKind::viewer);
  v1::WatchCuttingRequest watch;
  watch.set_author(viewer.author.value);
  grpc::ClientContext context;
  const auto stream = v1::WatchService::NewStub(viewer.channel)->WatchCutting(&context, watch);
  v1::WatchCuttingResponse seen;
  ASSERT_TRUE(stream->Read(&seen)) << "whoever joins late is sent the scene at once";
  ASSERT_EQ(seen.items_size(), 1);
  EXPECT_EQ(seen.items(0).item(), *id);
  EXPECT_EQ(seen.bodies_size(), 1);

  v1::RemoveSceneItemRequest remove;
  remove.set_item(*id);
  v1::RemoveSceneItemResponse removed;
  ASSERT_TRUE(call(&v1::RoomService::Stub::RemoveSceneItem, remove, removed).ok());
  ASSERT_TRUE(wait_until([&] { return early->items().empty() && late->items().empty(); }, kPatience));
  ASSERT_TRUE(stream->Read(&seen));
  EXPECT_EQ(seen.items_size(), 0);
  context.TryCancel();
  stream->Finish();
}

TEST_F(RoomRpc, SavesOnRequestAndAtTheEnd) {
  const auto hand = surgeon();
  send(*hand, strokes(hand->author(), 8, 53));
  ASSERT_TRUE(wait_until([&] { return hand->own() == 8; }, kPatience));
  v1::SaveFieldsRequest request;
  request.set_file_name("half.vdb");
  v1::SaveFieldsResponse saved;
  const grpc::Status status = call(&v1::RoomService::Stub::SaveFields, request, saved);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(saved.room_seq(), 10u) << "two joins and eight cuts";
  EXPECT_EQ(saved.file(), "half.vdb") << "it is a path on the server";
  EXPECT_EQ(saved.field_hash(), wire::to_wire(hand->hash()));
  const auto fields = load_fields(dir_ / "half.vdb", test_block());
  ASSERT_TRUE(fields) << fields.error().message;
  const auto resumed = Room::resume(test_block(), *fields);
  ASSERT_TRUE(resumed) << resumed.error().message;
  EXPECT_EQ(resumed->field_hash(), hand->hash());
  EXPECT_EQ(resumed->room_seq().value, 10u);

  for (const char* name : {"../half.vdb", "/half.vdb", "half.txt", "a/b.vdb", ".vdb", ".."}) {
    request.set_file_name(name);
    EXPECT_EQ(call(&v1::RoomService::Stub::SaveFields, request, saved).error_code(), grpc::StatusCode::INVALID_ARGUMENT)
        << name;
  }
  const Digest hash = hand->hash();
  const RoomSummary summary = server_->stop();
  server_.reset();
  EXPECT_EQ(field_hash(summary.fields.leaves, test_block().pitch_mm()), hash);
}

TEST_F(RoomRpc, RefusesUnknownMembersAndNonsenseInOneSentence) {
  const auto expect = [](const grpc::Status& status, grpc::StatusCode code) {
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_FALSE(status.error_message().empty());
  };
  using grpc::StatusCode;
  using Stub = v1::RoomService::Stub;
  constexpr std::uint64_t kStranger = 999;
  v1::UndoRequest undo_one;
  undo_one.set_count(1);
  v1::UndoResponse undone;
  expect(call(&Stub::Undo, undo_one, undone, kStranger), StatusCode::INVALID_ARGUMENT);
  expect(call(&Stub::Undo, undo_one, undone), StatusCode::FAILED_PRECONDITION);
  undo_one.add_room_seqs(1);
  expect(call(&Stub::Undo, undo_one, undone), StatusCode::INVALID_ARGUMENT);
  v1::RedoRequest redo;
  v1::RedoResponse redone;
  expect(call(&Stub::Redo, redo, redone), StatusCode::INVALID_ARGUMENT);
  redo.set_count(1);
  expect(call(&Stub::Redo, redo, redone), StatusCode::FAILED_PRECONDITION);
  v1::RemoveBodyResponse removed;
  expect(call(&Stub::RemoveBody, v1::RemoveBodyRequest{}, removed), StatusCode::INVALID_ARGUMENT);
  v1::SetSceneItemResponse set;
  expect(call(&Stub::SetSceneItem, v1::SetSceneItemRequest{}, set), StatusCode::INVALID_ARGUMENT);
  v1::RemoveSceneItemResponse taken;
  expect(call(&Stub::RemoveSceneItem, v1::RemoveSceneItemRequest{}, taken), StatusCode::INVALID_ARGUMENT);
  v1::ListToolsResponse list;
  expect(call(&Stub::ListTools, v1::ListToolsRequest{}, list, kStranger), StatusCode::INVALID_ARGUMENT);
  v1::GetToolRequest get;
  v1::GetToolResponse got;
  expect(call(&Stub::GetTool, get, got), StatusCode::INVALID_ARGUMENT);
  get.set_tool_hash(std::string(32, 'x'));
  expect(call(&Stub::GetTool, get, got), StatusCode::NOT_FOUND);
  v1::AddToolRequest add;
  v1::AddToolResponse added;
  expect(call(&Stub::AddTool, add, added), StatusCode::INVALID_ARGUMENT);
  *add.mutable_tool() = wire::to_wire(own_tool());
  add.mutable_tool()->set_tool_hash(std::string(32, 'x'));
  expect(call(&Stub::AddTool, add, added), StatusCode::INVALID_ARGUMENT);
  *add.mutable_tool() = wire::to_wire(own_tool());
  expect(call(&Stub::AddTool, add, added, kStranger), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(server_->health().room_seq.value, 1u) << "only the join of the caller has a sequence number";
}

// A slot through the whole block: the room itself detects that the block is in two parts.
TEST_F(RoomRpc, ASawnOffPieceBecomesABodyForEveryone) {
  const auto hand = surgeon(), other = surgeon();
  MeshReader viewer(address());
  // The block is 24 mm wide and 12 mm deep. The slot leaves 24 x 7 mm of it on one side.
  Tool saw = tool_named("burr-round-5");
  std::vector<Cut> cuts;
  for (double z = 0.0; z > -14.0; z -= 2.0) {
    for (const double y : {-14.0, 0.0}) {
      Cut cut = straight_cut(saw, {5, y, z}, {5, y + 14.0, z}, {0, 0, -1}, cuts.size() + 1);
      cut.author = hand->author();
      cuts.push_back(cut);
    }
  }
  send(*hand, cuts);
  ASSERT_TRUE(wait_until([&] { return hand->bodies().size() == 2 && other->bodies().size() == 2; }, kPatience));
  const RoomSeq split = hand->seq();
  ASSERT_TRUE(wait_until([&] { return other->seq() == split; }, kPatience));
  auto status = status_of(hand->session().room());
  EXPECT_EQ(wire::to_wire(hand->hash()), status.field_hash());
  EXPECT_EQ(wire::to_wire(other->hash()), status.field_hash());
  EXPECT_EQ(status.bodies_size(), 2);
  ASSERT_TRUE(viewer.read_to(split));
  const auto of_piece = [&] {
    return std::ranges::count_if(viewer.hashes(), [](const auto& block) { return block.first.body == BodyId{1}; });
  };
  EXPECT_GT(of_piece(), 0);
  // The slot is 24 x 12 mm and 5 mm wide, less its rounded floor. The piece is not removed.
  EXPECT_NEAR(status.removed_mm3(), 24.0 * 12.0 * 5.0, 0.12 * 24.0 * 12.0 * 5.0);

  v1::RemoveBodyRequest remove;
  remove.set_body(1);
  v1::RemoveBodyResponse removed;
  ASSERT_TRUE(call(&v1::RoomService::Stub::RemoveBody, remove, removed).ok());
  ASSERT_TRUE(
      wait_until([&] { return hand->bodies().size() == 1 && other->seq().value == removed.room_seq(); }, kPatience));
  ASSERT_TRUE(viewer.read_to(RoomSeq{removed.room_seq()}));
  EXPECT_EQ(of_piece(), 0);
  status = status_of(hand->session().room());
  EXPECT_EQ(wire::to_wire(other->hash()), status.field_hash());

  // Everything is undone: first the split, then all cuts, so that the whole block is back.
  v1::UndoResponse undone;
  ASSERT_TRUE(undo(1000, undone).ok());
  ASSERT_TRUE(wait_until([&] { return other->seq().value == undone.room_seq(); }, kPatience));
  EXPECT_EQ(other->hash(), Room(test_block()).field_hash());
  ASSERT_TRUE(viewer.read_to(RoomSeq{undone.room_seq()}));
  EXPECT_EQ(of_piece(), 0);
}

// The room is saved and stopped right after the cut that separates a piece. In both, the piece is a body.
TEST_F(RoomRpc, ThePieceOfTheLastCutIsFoundBeforeTheBoneIsSaved) {
  const auto hand = surgeon();
  std::vector<Cut> cuts;
  for (double z = 0.0; z > -14.0; z -= 2.0)
    for (const double y : {-14.0, 0.0}) {
      Cut cut = straight_cut(tool_named("burr-round-5"), {5, y, z}, {5, y + 14.0, z}, {0, 0, -1}, cuts.size() + 1);
      cut.author = hand->author();
      cuts.push_back(cut);
    }
  send(*hand, cuts);
  ASSERT_TRUE(wait_until([&] { return hand->own() == cuts.size(); }, kPatience));
  v1::SaveFieldsRequest request;
  request.set_file_name("last.vdb");
  v1::SaveFieldsResponse saved;
  ASSERT_TRUE(call(&v1::RoomService::Stub::SaveFields, request, saved).ok());
  EXPECT_EQ(load_fields(dir_ / "last.vdb", test_block())->bodies.size(), 2u);
  v1::UndoResponse undone;
  ASSERT_TRUE(undo(1, undone).ok());
  ASSERT_TRUE(wait_until([&] { return hand->seq().value >= undone.room_seq(); }, kPatience));
  v1::RedoRequest redo;
  redo.set_count(1);
  v1::RedoResponse redone;
  ASSERT_TRUE(call(&v1::RoomService::Stub::Redo, redo, redone).ok());
  const RoomSummary summary = server_->stop();
  server_.reset();
  EXPECT_EQ(summary.bone.bodies.size(), 2u);
  EXPECT_EQ(summary.fields.bodies.size(), 2u);
  EXPECT_EQ(summary.bone.field_hash, field_hash(summary.fields.leaves, test_block().pitch_mm()));
}

}  // namespace
}  // namespace osteon
