// The gRPC services with real clients in this process, on the loopback device, with ports that the system chooses.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <fstream>
#include <mutex>
#include <system_error>
#include <thread>

#include "common/field/kernel.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/cutting.grpc.pb.h"
#include "osteon/v1/room.grpc.pb.h"
#include "osteon/v1/watch.grpc.pb.h"
#include "server/rpc/room_server.hpp"
#include "tests/unit/rooms/served_room.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using RoomServerTest = test::ServedRoom;

TEST_F(RoomServerTest, EveryHolderHasTheServersHashHoweverLateItJoins) {
  const auto first = surgeon(), second = surgeon();
  ASSERT_NE(first->author(), second->author());
  send(*first, strokes(first->author(), 30, 1));
  send(*second, strokes(second->author(), 30, 2));
  const auto late = surgeon();  // It joins while cuts are under way.
  ASSERT_TRUE(wait_until([&] { return first->own() == 30 && second->own() == 30; }, kPatience));
  const auto later = surgeon();
  // Debris that has separated makes events of its own, at a later time.
  const std::vector<Surgeon*> holders{first.get(), second.get(), late.get(), later.get()};
  ASSERT_TRUE(wait_until([&] { return settled(runtime(), holders); }, kPatience));
  const auto status = status_of(later->session().room());
  EXPECT_GE(status.room_seq(), 60u);
  for (std::size_t i = 0; i < holders.size(); ++i)
    EXPECT_EQ(wire::to_wire(holders[i]->hash()), status.field_hash()) << "holder " << i;
  EXPECT_GT(status.removed_mm3(), 0.0);
  EXPECT_EQ(status.rejected(), 0u);
}

// A client that comes back must not stay pending until the next event.
TEST_F(RoomServerTest, AHapticClientAcknowledgesTheLeaves) {
  const auto hand = surgeon();
  EXPECT_TRUE(
      wait_until([&] { return runtime().people().acknowledged_by(AuthorId{1}) == runtime().room_seq(); }, kPatience));
}

// Such a client has acknowledged more than exists, since the server's journal has lost its end.
TEST_F(RoomServerTest, AClientThatHasAcknowledgedMoreThanThereIsIsNotRefused) {
  const wire::JoinedRoom room = join(address(), wire::ClientKind::haptic);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kPatience);
  const auto stream = v1::CuttingService::NewStub(room.channel)->Session(&context);
  v1::SessionRequest request;
  request.mutable_open()->set_author(room.author.value);
  request.mutable_open()->set_server_epoch(room.server_epoch);
  request.mutable_open()->set_secret(room.secret);
  ASSERT_TRUE(stream->Write(request));
  request.mutable_acknowledged()->set_room_seq(runtime().room_seq().value + 1000);
  ASSERT_TRUE(stream->Write(request));
  Cut cut = strokes(room.author, 1, 3)[0];
  cut.lease_epoch = room.lease_epoch;
  *request.mutable_cut() = wire::to_wire(cut);
  ASSERT_TRUE(stream->Write(request));
  v1::SessionResponse response;
  while (stream->Read(&response) && !response.has_committed()) {
  }
  EXPECT_TRUE(response.has_committed()) << "its session goes on";
  const RoomSeq heard = runtime().people().acknowledged_by(room.author);
  EXPECT_GT(heard, RoomSeq{});
  EXPECT_LE(heard, runtime().room_seq()) << "no further than the room";
  context.TryCancel();
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED) << status.error_message();
}

TEST_F(RoomServerTest, ACutBeyondTheLimitsIsRejectedToItsAuthorAndTheRoomGoesOn) {
  const auto one = surgeon(), other = surgeon();
  auto cuts = strokes(one->author(), 2, 3);
  cuts[0].spindle_rpm = 1'000'000;
  send(*one, {cuts[0]});
  ASSERT_TRUE(wait_until([&] { return !one->rejected().empty(); }, kPatience));
  cuts[1].lease_epoch = one->lease();
  send(*one, {cuts[1]});
  ASSERT_TRUE(wait_until([&] { return one->own() == 1 && other->seq() == one->seq(); }, kPatience));
  EXPECT_EQ(one->rejected(), sentence(Rejection::spindle));
  EXPECT_EQ(other->rejected(), "");
  EXPECT_EQ(status_of(one->session().room()).rejected(), 1u);
}

// A client that reconnects sends its unacknowledged cuts again, also those that the room decided in the session before.
TEST_F(RoomServerTest, ACutOfAnEarlierSessionIsAnsweredAgainWithItsFirstOutcome) {
  const wire::JoinedRoom room = join(address(), wire::ClientKind::haptic);
  const auto stub = v1::CuttingService::NewStub(room.channel);
  std::vector<RoomSeq> seqs;
  for (int session = 0; session < 2; ++session) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    const auto stream = stub->Session(&context);
    v1::SessionRequest request;
    request.mutable_open()->set_author(room.author.value);
    request.mutable_open()->set_server_epoch(room.server_epoch);
    request.mutable_open()->set_secret(room.secret);
    ASSERT_TRUE(stream->Write(request));
    Cut cut = strokes(room.author, 1, 3)[0];
    cut.lease_epoch = room.lease_epoch;
    *request.mutable_cut() = wire::to_wire(cut);
    ASSERT_TRUE(stream->Write(request));
    v1::SessionResponse response;
    while (stream->Read(&response) && response.message_case() != v1::SessionResponse::kCommitted)
      ;
    ASSERT_EQ(response.message_case(), v1::SessionResponse::kCommitted) << "session " << session;
    seqs.push_back(RoomSeq{response.committed().room_seq()});
    context.TryCancel();
    (void)stream->Finish();
  }
  EXPECT_EQ(seqs[0], seqs[1]);
}

TEST_F(RoomServerTest, ALateViewerSeesTheBlocksOfAnEarlyOne) {
  MeshReader early(address());
  ASSERT_TRUE(early.read_to(RoomSeq{0}));
  const auto uncut = early.hashes();
  const auto hand = surgeon();
  send(*hand, strokes(hand->author(), 40, 4));
  // Joins have sequence numbers too. So has the debris that is found a moment after the last stroke.
  ASSERT_TRUE(wait_until([&] { return hand->own() == 40 && settled(runtime(), {hand.get()}); }, kPatience));
  const RoomSeq last = hand->seq();
  ASSERT_TRUE(early.read_to(last));
  MeshReader late(address());
  ASSERT_TRUE(late.read_to(last));
  EXPECT_EQ(early.hashes(), late.hashes());
  EXPECT_NE(early.hashes(), uncut);
}

TEST_F(RoomServerTest, ASlowReaderIsBoundedAndCatchesUp) {
  MeshReader slow(address()), prompt(address());
  const auto hand = surgeon();
  std::size_t furthest = 0;
  std::vector<Cut> cuts = strokes(hand->author(), 400, 5);
  for (const Cut& cut : cuts) {
    send(*hand, {cut});
    furthest = std::max(furthest, server_->health().furthest_behind);
  }
  ASSERT_TRUE(prompt.read_to(RoomSeq{400}));
  const RuntimeHealth health = server_->health();
  // The set that waits holds each block once: blocks with a surface and blocks that lost it.
  EXPECT_LE(furthest, 2 * health.blocks);
  EXPECT_EQ(health.mesh_streams, 2u);
  ASSERT_TRUE(slow.read_to(RoomSeq{400}));
  EXPECT_EQ(slow.hashes(), prompt.hashes());
  EXPECT_LT(slow.largest_message(), 2 * MeshSendQueue::kMessageBytes);
}

TEST_F(RoomServerTest, AKilledClientDisturbsNobody) {
  const auto survivor = surgeon();
  MeshReader watcher(address());
  {
    MeshReader killed(address());
    Surgeon gone(address(), dir_ / "cache");
    send(gone, strokes(gone.author(), 5, 6));
    ASSERT_TRUE(wait_until([&] { return gone.own() == 5; }, kPatience));
  }
  send(*survivor, strokes(survivor->author(), 20, 7));
  // The strokes separate debris, which is found a moment after the last of them.
  ASSERT_TRUE(wait_until([&] { return survivor->own() == 20 && settled(runtime(), {survivor.get()}); }, kPatience));
  EXPECT_TRUE(watcher.read_to(survivor->seq()));
  EXPECT_EQ(wire::to_wire(survivor->hash()), status_of(survivor->session().room()).field_hash());
  EXPECT_TRUE(
      wait_until([&] { return server_->health().mesh_streams == 1 && server_->health().sessions == 1; }, kPatience));
}

TEST_F(RoomServerTest, ShowsTheNewestStateAndAnIdleToolOnceItsClientIsGone) {
  const wire::JoinedRoom room = join(address(), wire::ClientKind::audio);
  grpc::ClientContext context;
  v1::WatchCuttingRequest request;
  request.set_author(room.author.value);
  const auto stream = v1::WatchService::NewStub(room.channel)->WatchCutting(&context, request);
  auto hand = surgeon();
  ASSERT_TRUE(wait_until([&] { return hand->complete(); }, kPatience));
  CuttingState state;
  state.author = hand->author();
  state.tool_name = "drill-3.2";
  state.phase = CuttingPhase::cutting;
  for (state.state_seq = 1; state.state_seq <= 50; ++state.state_seq) {
    state.spindle_rpm = 1000.0 + static_cast<double>(state.state_seq);
    hand->session().send(state);
  }
  v1::WatchCuttingResponse message;
  std::uint64_t last_seq = 0;
  const auto read_until = [&](const std::function<bool(const v1::CuttingState&)>& wanted) {
    while (stream->Read(&message)) {
      if (message.states_size() == 0) continue;
      EXPECT_GT(message.states(0).state_seq(), last_seq) << "an older state after a newer one";
      last_seq = message.states(0).state_seq();
      if (wanted(message.states(0))) return true;
    }
    return false;
  };
  ASSERT_TRUE(read_until([](const v1::CuttingState& s) { return s.state_seq() == 50; }));
  EXPECT_EQ(message.states(0).spindle_rpm(), 1050.0);
  hand.reset();
  ASSERT_TRUE(read_until([](const v1::CuttingState& s) { return s.phase() == v1::CUTTING_PHASE_IDLE; }));
  EXPECT_EQ(message.states(0).spindle_rpm(), 0.0);
  context.TryCancel();
  stream->Finish();
}

TEST_F(RoomServerTest, VersionsMustAgree) {
  const auto channel = grpc::CreateChannel(address(), grpc::InsecureChannelCredentials());
  const auto stub = v1::RoomService::NewStub(channel);
  const auto ask = [&](std::uint32_t protocol, std::uint32_t kernel, v1::ClientKind kind) {
    v1::JoinRequest request;
    request.set_protocol_version(protocol);
    request.set_kernel_version(kernel);
    request.set_kind(kind);
    v1::JoinResponse response;
    grpc::ClientContext context;
    return stub->Join(&context, request, &response);
  };
  EXPECT_TRUE(ask(wire::kProtocolVersion, kKernelVersion, v1::CLIENT_KIND_HAPTIC).ok());
  EXPECT_TRUE(ask(wire::kProtocolVersion, 0, v1::CLIENT_KIND_VIEWER).ok()) << "a viewer has no kernel";
  for (const grpc::Status& status :
       {ask(77, kKernelVersion, v1::CLIENT_KIND_HAPTIC), ask(wire::kProtocolVersion, 77, v1::CLIENT_KIND_HAPTIC)}) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_NE(status.error_message().find("77"), std::string::npos) << status.error_message();
    EXPECT_NE(status.error_message().find("version " +
                                          std::to_string(status.error_message().find("kernel") == std::string::npos
                                                             ? wire::kProtocolVersion
                                                             : kKernelVersion)),
              std::string::npos)
        << status.error_message();
  }
  EXPECT_EQ(ask(wire::kProtocolVersion, 0, v1::CLIENT_KIND_HAPTIC).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ask(wire::kProtocolVersion, 0, v1::CLIENT_KIND_UNSPECIFIED).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

// One session whose requests the test writes itself, and what the server answers.
class RawSession {
 public:
  explicit RawSession(const std::string& address) : room(join(address, wire::ClientKind::haptic)) {
    context_.set_deadline(std::chrono::system_clock::now() + kPatience);
    stream_ = v1::CuttingService::NewStub(room.channel)->Session(&context_);
  }
  void open() {
    v1::SessionRequest request;
    request.mutable_open()->set_author(room.author.value);
    request.mutable_open()->set_server_epoch(room.server_epoch);
    write(request);
  }
  void write(const v1::SessionRequest& request) { stream_->Write(request); }
  void finish_writing() { stream_->WritesDone(); }
  grpc::Status status() {
    v1::SessionResponse ignored;
    while (stream_->Read(&ignored)) {
    }
    return stream_->Finish();
  }
  wire::JoinedRoom room;

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::SessionRequest, v1::SessionResponse>> stream_;
};

TEST_F(RoomServerTest, MalformedRequestsAreRefusedByTheNameOfTheirField) {
  const auto expect_refused = [&](const char* named, const std::function<void(RawSession&)>& talk,
                                  grpc::StatusCode code = grpc::StatusCode::INVALID_ARGUMENT) {
    RawSession session(address());
    talk(session);
    const grpc::Status status = session.status();
    EXPECT_EQ(status.error_code(), code) << named;
    EXPECT_NE(status.error_message().find(named), std::string::npos) << status.error_message();
  };
  expect_refused("open", [](RawSession& s) { s.write({}); });
  // Whoever joined a server that was killed may join again.
  expect_refused(
      "server_epoch",
      [](RawSession& s) {
        ++s.room.server_epoch;
        s.open();
      },
      grpc::StatusCode::UNAVAILABLE);
  expect_refused("author", [](RawSession& s) {
    s.room.author = AuthorId{9999};
    s.open();
  });
  const auto with_cut = [](const std::function<void(v1::Cut&)>& spoil) {
    return [spoil](RawSession& s) {
      s.open();
      v1::SessionRequest request;
      *request.mutable_cut() = wire::to_wire(strokes(s.room.author, 1, 8).front());
      spoil(*request.mutable_cut());
      s.write(request);
    };
  };
  expect_refused("tool_hash", with_cut([](v1::Cut& cut) { cut.set_tool_hash("short"); }));
  expect_refused("author", with_cut([](v1::Cut& cut) { cut.set_author(9999); }));
  expect_refused("position", with_cut([](v1::Cut& cut) { cut.mutable_path(0)->clear_position(); }));
  expect_refused("message", [](RawSession& s) {
    s.open();
    s.write({});
  });
  EXPECT_EQ(server_->health().counts.committed + server_->health().counts.rejected, 0u);
  const auto hand = surgeon();
  send(*hand, strokes(hand->author(), 1, 9));
  EXPECT_TRUE(wait_until([&] { return hand->own() == 1; }, kPatience)) << "the server goes on";
}

// The other has joined too, so the room itself would take the cut.
TEST_F(RoomServerTest, NobodyCutsInAnothersName) {
  const wire::JoinedRoom other = join(address(), wire::ClientKind::haptic);
  RawSession session(address());
  session.open();
  Cut cut = strokes(other.author, 1, 8).front();
  cut.lease_epoch = other.lease_epoch;
  v1::SessionRequest request;
  *request.mutable_cut() = wire::to_wire(cut);
  session.write(request);
  session.finish_writing();
  const grpc::Status status = session.status();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_NE(status.error_message().find("cut.author"), std::string::npos) << status.error_message();
  EXPECT_EQ(server_->health().counts.committed, 0u);
}

TEST_F(RoomServerTest, ACutSentAgainIsAnsweredWithItsFirstSequenceNumber) {
  RawSession session(address());
  session.open();
  const Cut cut = strokes(session.room.author, 1, 10).front();
  v1::SessionRequest request;
  *request.mutable_cut() = wire::to_wire(cut);
  session.write(request);
  session.write(request);
  EXPECT_TRUE(wait_until([&] { return server_->health().counts.repeated == 1; }, kPatience));
  EXPECT_EQ(server_->health().counts.committed, 1u);
  EXPECT_EQ(server_->health().room_seq.value, 2u);
  server_->stop();
  EXPECT_EQ(session.status().error_code(), grpc::StatusCode::ABORTED);
  server_.reset();
}

TEST_F(RoomServerTest, TheCaseIsFetchedOnceAndABrokenCopyAgain) {
  surgeon();
  const auto kept = dir_ / "cache" / to_hex(test::test_block().hash());
  ASSERT_TRUE(std::filesystem::exists(kept / "bone.vdb"));
  const auto written = std::filesystem::last_write_time(kept / "bone.vdb");
  surgeon();
  EXPECT_EQ(std::filesystem::last_write_time(kept / "bone.vdb"), written);
  std::filesystem::resize_file(kept / "bone.vdb", 100);
  const auto hand = surgeon();
  EXPECT_EQ(hand->session().bone().hash(), test::test_block().hash());
  EXPECT_TRUE(Case::load(kept).has_value());
  const std::filesystem::directory_iterator entries(dir_ / "cache");
  EXPECT_EQ(std::distance(begin(entries), end(entries)), 1) << "no half-written file is left";
}

TEST_F(RoomServerTest, StoppingEndsEveryStreamWithAReason) {
  const auto hand = surgeon();
  send(*hand, strokes(hand->author(), 10, 11));
  ASSERT_TRUE(wait_until([&] { return hand->own() == 10; }, kPatience));
  const Digest hash = hand->hash();
  const RoomSummary summary = server_->stop();
  server_.reset();
  EXPECT_EQ(summary.bone.field_hash, hash);
  EXPECT_EQ(summary.bone.room_seq.value, 11u);
  EXPECT_EQ(summary.health.mesh_update.count(), 10u) << "every cut's blocks were made";
  ASSERT_TRUE(wait_until([&] { return !hand->lost().empty(); }, kPatience));
  EXPECT_NE(hand->lost().find("the server stops"), std::string::npos) << hand->lost();
}

TEST_F(RoomServerTest, RefusesAPortInUseAndAddressesOfOtherMachines) {
  const auto start = [&](const std::string& listen) {
    return RoomServer::start(Room(test::test_block()), {.listen = listen, .case_folder = dir_ / "case", .rates = {}},
                             {});
  };
  const auto second = start(address());
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, ErrorCode::exists);
  EXPECT_NE(second.error().message.find(address()), std::string::npos);
  for (const char* open_to_others : {"0.0.0.0:0", "[::]:0", "192.0.2.1:0", "127.0.0.1.example:0"})
    EXPECT_FALSE(start(open_to_others).has_value()) << open_to_others;
  for (const char* broken : {"", "127.0.0.1", "127.0.0.1:", ":5", "127.0.0.1:70000", "127.0.0.1:http"})
    EXPECT_EQ(start(broken).error().code, ErrorCode::invalid_input) << broken;
}

// Whether listening fails with the system's message, and not with the message that the port is in use.
bool refused_because(const std::string& listen, int reason) {
  const Result<void> usable = RoomServer::check_listen(listen);
  return !usable && usable.error().code != ErrorCode::exists &&
         usable.error().message.find(std::generic_category().message(reason)) != std::string::npos;
}

// In a process of its own, which gives up the privileges that it would need to listen.
TEST(RoomServerListen, APortThatTheSystemRefusesIsNotSaidToBeInUse) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (::geteuid() == 0 && ::setuid(65534) != 0) ::_exit(2);
    // Ports below this one are privileged. A system may have none.
    int first_open_port = 1024;
    std::ifstream("/proc/sys/net/ipv4/ip_unprivileged_port_start") >> first_open_port;
    if (first_open_port > 1 && !refused_because("127.0.0.1:1", EACCES)) ::_exit(3);
    const rlimit no_files{0, 0};
    if (::setrlimit(RLIMIT_NOFILE, &no_files) != 0) ::_exit(4);
    ::_exit(refused_because("127.0.0.1:0", EMFILE) ? 0 : 5);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(RoomClient, SaysInOneSentenceThatNobodyAnswers) {
  const auto nobody = wire::join_room("127.0.0.1:1", wire::ClientKind::viewer, "test", 200ms, {});
  ASSERT_FALSE(nobody.has_value());
  EXPECT_EQ(nobody.error().code, ErrorCode::unavailable);
  EXPECT_NE(nobody.error().message.find("127.0.0.1:1"), std::string::npos);
  EXPECT_EQ(wire::join_room("127.0.0.1:1", wire::ClientKind::viewer, "test", 10s, [] { return true; }).error().code,
            ErrorCode::cancelled);
  EXPECT_EQ(wire::join_room("nonsense", wire::ClientKind::viewer, "test", 1s, {}).error().code,
            ErrorCode::invalid_input);
}

}  // namespace
}  // namespace osteon
