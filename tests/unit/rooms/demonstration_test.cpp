// A demonstration in a live room. Viewers see its tool at rest while it is stopped. It ends when the server shall stop.
// Nobody waits while its journal is read.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <fstream>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

#include "osteon/v1/cases.grpc.pb.h"
#include "osteon/v1/people.grpc.pb.h"
#include "osteon/v1/rooms.grpc.pb.h"
#include "server/auth/authorizer.hpp"
#include "server/rpc/room_server.hpp"
#include "server/upload_validation/case_archive.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/rooms/fake_session.hpp"
#include "tests/unit/rooms/kept_room.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

// Keeps every tool state that viewers are sent, of any author.
class SeenTools final : public StateSubscriber {
 public:
  void enqueue(const ShownNow& now) override {
    v1::WatchCuttingResponse told;
    EXPECT_TRUE(told.ParseFromString(*now.tools));
    const std::lock_guard lock(mutex_);
    for (const v1::CuttingState& state : told.states()) {
      std::vector<v1::CuttingState>& of_author = states_[state.author()];
      if (of_author.empty() || of_author.back().SerializeAsString() != state.SerializeAsString())
        of_author.push_back(state);
    }
  }
  void end(const std::string&) override {}
  std::size_t waiting() const override { return 0; }
  std::vector<v1::CuttingState> of(AuthorId author) const {
    const std::lock_guard lock(mutex_);
    const auto seen = states_.find(author.value);
    return seen == states_.end() ? std::vector<v1::CuttingState>{} : seen->second;
  }
  bool at_work(AuthorId author) const {
    const auto seen = of(author);
    return !seen.empty() && seen.back().phase() == v1::CUTTING_PHASE_CUTTING && seen.back().spindle_rpm() > 0;
  }
  bool at_rest(AuthorId author) const {
    const auto seen = of(author);
    return !seen.empty() && seen.back().phase() == v1::CUTTING_PHASE_IDLE && seen.back().spindle_rpm() == 0;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::uint64_t, std::vector<v1::CuttingState>> states_;
};

// A haptic client at the bone on its compliant mount.
class MountedHand final : public test::FakeSession {
 public:
  using FakeSession::FakeSession;
  void show_bone(const MountPose& seen) override {
    const std::lock_guard lock(mutex_);
    seen_ = seen;
  }
  MountPose seen() const {
    const std::lock_guard lock(mutex_);
    return seen_;
  }

 private:
  mutable std::mutex mutex_;
  MountPose seen_;
};

// A server with three rooms: "ward" is open, "shown" and "other" are closed. The closed ones each have a recording of
// 240 cuts in 2.4 s.
class DemonstrationTest : public ::testing::Test {
 protected:
  // Case and journals, made once.
  static void SetUpTestSuite() {
    made_ = std::make_unique<TempDir>();
    ASSERT_TRUE(test_block().save(*made_ / "case"));
    fs::create_directories(*made_ / "rooms");
    for (const std::string name : {"ward", "shown", "other"}) {
      KeptCuts kept(*made_ / "rooms" / (name + ".journal"), nullptr, name);
      kept.cut(300);
      ASSERT_TRUE(kept.store->close());
    }
  }
  static void TearDownTestSuite() { made_.reset(); }
  void SetUp() override {
    fs::copy(made_->path(), dir_.path(), fs::copy_options::recursive);
    // An upload validation that takes long, and that creates a file when it begins.
    std::ofstream(dir_ / "checker") << "#!/bin/sh\n: > '" << (dir_ / "checks").string() << "'\nexec sleep 60\n";
    fs::permissions(dir_ / "checker", fs::perms::owner_all);
    auto store = CaseRepository::open(dir_ / "cases", dir_ / "checker", {});
    ASSERT_TRUE(store.has_value()) << store.error().message;
    RoomsOptions options{
        .cases = {{test_block(), dir_ / "case"}}, .folder = dir_ / "rooms", .case_repository = std::move(*store)};
    options.rates.mount = true;
    auto rooms = std::make_unique<Rooms>(std::move(options));
    ASSERT_TRUE(rooms->resume("ward"));
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0");
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
    room_ = *server_->rooms().find("ward");
    instructor_ = room_->runtime().join(MemberKind::watcher, "Ada", {}, Role::instructor).value();
    room_->runtime().watch_cutting(seen_);
  }
  void TearDown() override {
    if (room_) room_->runtime().leave(seen_);
    room_.reset();
    server_.reset();
  }
  Result<Shown> show(double speed, const std::string& of = {}) {
    const WhatToShow what{.room = of, .of = {}, .from = {}, .to = {}, .speed = speed};
    return server_->rooms().demonstrate(*room_, instructor_, {}, what);
  }
  void decide(AuthorId about, const Restrictions& word) {
    std::promise<Result<RoomEvent>> answer;
    room_->runtime().queue_event([&](Room& room) { return room.supervise(instructor_, about, word); },
                                 [&](const Result<RoomEvent>& decided) { answer.set_value(decided); });
    const Result<RoomEvent> decided = answer.get_future().get();
    ASSERT_TRUE(decided) << decided.error().message;
  }
  std::uint64_t committed() { return room_->runtime().bone_status().counts.committed; }

  static std::unique_ptr<TempDir> made_;
  TempDir dir_;
  std::unique_ptr<RoomServer> server_;
  std::shared_ptr<OpenRoom> room_;  // shared with the rooms
  AuthorId instructor_;
  SeenTools seen_;
};
std::unique_ptr<TempDir> DemonstrationTest::made_;

// The cuts are so close together that the tool is never seen at rest between two of them.
TEST_F(DemonstrationTest, IsSeenAtRestWhileItIsStoppedOrWithoutItsTool) {
  const Result<Shown> shown = show(0.06);
  ASSERT_TRUE(shown) << shown.error().message;
  const AuthorId who = shown->demonstrator;
  for (const Restrictions& word : {Restrictions{.stopped = true}, Restrictions{.taken_by = instructor_}}) {
    ASSERT_TRUE(wait_until([&] { return seen_.at_work(who); }, kPatience));
    decide(who, word);
    ASSERT_TRUE(wait_until([&] { return seen_.at_rest(who); }, kPatience)) << "everybody still receives its states";
    // As long as three cuts take.
    const std::uint64_t cuts = committed();
    const auto then = seen_.of(who);
    std::this_thread::sleep_for(500ms);
    EXPECT_TRUE(seen_.at_rest(who));
    EXPECT_EQ(seen_.of(who).size(), then.size());
    EXPECT_EQ(committed(), cuts);
    decide(who, {});
    ASSERT_TRUE(wait_until([&] { return seen_.at_work(who); }, kPatience)) << "the demonstration goes on";
    EXPECT_TRUE(wait_until([&] { return committed() > cuts; }, kPatience));
  }
  // Readers that take only newer states take these.
  const auto all = seen_.of(who);
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_GT(all[i].state_seq(), all[i - 1].state_seq());
}

TEST_F(DemonstrationTest, IsSeenAtRestBetweenTwoCutsThatAreFarApart) {
  const Result<Shown> shown = show(0.01);
  ASSERT_TRUE(shown) << shown.error().message;
  const AuthorId who = shown->demonstrator;
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(wait_until([&] { return seen_.at_work(who); }, kPatience));
    EXPECT_TRUE(wait_until([&] { return seen_.at_rest(who); }, kPatience));
  }
}

TEST_F(DemonstrationTest, EndsWhenTheServerIsToStop) {
  const Result<Shown> shown = show(0.06);
  ASSERT_TRUE(shown) << shown.error().message;
  ASSERT_TRUE(wait_until([&] { return seen_.at_work(shown->demonstrator); }, kPatience));
  int waits = 0;
  server_->drain(1h, [&](std::chrono::milliseconds time) {
    std::this_thread::sleep_for(time);
    return ++waits > 100;
  });
  EXPECT_EQ(waits, 0) << "nobody was in the room who had to leave";
  EXPECT_EQ(room_->runtime().health().sessions, 0u);
  const auto newest = [&] { return room_->runtime().room_seq(); };
  EXPECT_TRUE(wait_until([&] { return seen_.at_rest(shown->demonstrator); }, kPatience));
  const RoomSeq then = newest();
  std::this_thread::sleep_for(500ms);
  EXPECT_EQ(newest(), then);
  // No other demonstration begins either. Its journal would have to be read first.
  for (const std::string room : {"", "nowhere"}) {
    const Result<Shown> late = show(1.0, room);
    ASSERT_FALSE(late);
    EXPECT_EQ(late.error().code, ErrorCode::unavailable) << late.error().message;
  }
}

// The energy that one person's push puts into the bone is for the others whom the bone pushes. A demonstration takes
// none of it. Its tool is where it was relative to the bone.
TEST_F(DemonstrationTest, NeitherMovesTheBoneOnItsMountNorTakesOfItsEnergy) {
  const auto open = [&] {
    auto hand = std::make_shared<MountedHand>(room_->runtime().join(MemberKind::surgeon).value());
    EXPECT_TRUE(room_->runtime().open_session(hand));
    return hand;
  };
  const auto one = open(), other = open();
  const Result<Shown> shown = show(0.06);
  ASSERT_TRUE(shown) << shown.error().message;
  ASSERT_TRUE(wait_until([&] { return seen_.at_work(shown->demonstrator); }, kPatience));
  for (const std::uint64_t number : {1u, 2u}) {
    room_->runtime().push_bone(one->author(), {.push_seq = number, .load = {}, .energy_mj = number == 1 ? 5.0 : 8.0});
    ASSERT_TRUE(wait_until([&] { return one->seen().push_seq == number; }, kPatience));
  }
  EXPECT_TRUE(wait_until([&] { return other->seen().energy_mj > 0; }, kPatience));
  EXPECT_DOUBLE_EQ(other->seen().energy_mj, 3.0);
  EXPECT_EQ(other->seen().shift.place_mm, Vec3(Vec3::Zero()));
  EXPECT_TRUE(seen_.at_work(shown->demonstrator));
  room_->runtime().leave(*one);
  room_->runtime().leave(*other);
}

// The calls that every client makes when it connects.
class CallsOfOthers {
 public:
  explicit CallsOfOthers(const wire::JoinedRoom& room) : room_(room) {}
  // Empty if all calls were answered.
  std::string fail() const {
    v1::ListRoomsResponse rooms;
    v1::ListCasesResponse cases;
    const auto of_rooms = v1::RoomsService::NewStub(room_.channel);
    const auto of_cases = v1::CaseService::NewStub(room_.channel);
    const grpc::Status listed = ask([&](auto* context) { return of_rooms->ListRooms(context, {}, &rooms); });
    const grpc::Status asked = ask([&](auto* context) { return of_cases->ListCases(context, {}, &cases); });
    const grpc::Status fetched = ask([&](auto* context) {
      v1::GetCaseRequest request;
      request.set_case_hash(wire::to_wire(room_.case_hash));
      const auto reader = v1::RoomService::NewStub(room_.channel)->GetCase(context, request);
      v1::GetCaseResponse piece;
      while (reader->Read(&piece)) continue;
      return reader->Finish();
    });
    for (const grpc::Status* status : {&listed, &asked, &fetched})
      if (!status->ok()) return status->error_message();
    return "";
  }
  template <class Call>
  static grpc::Status ask(Call call) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    return call(&context);
  }

 private:
  const wire::JoinedRoom room_;
};

TEST_F(DemonstrationTest, NobodyWaitsUntilItsJournalIsRead) {
  const wire::JoinedRoom viewer = join(server_->address(), wire::ClientKind::viewer, "ward");
  // Somebody opens a large room. Until it is open, the journal of no other closed room can be read.
  std::promise<void> opening, done;
  std::thread operator_of_rooms([&] {
    const auto opened = server_->rooms().resume("other", [&, told = false](double) mutable {
      if (std::exchange(told, true)) return;
      opening.set_value();
      done.get_future().wait();
    });
    EXPECT_TRUE(opened) << opened.error().message;
  });
  opening.get_future().wait();
  v1::DemonstrateResponse response;
  grpc::Status shown;
  std::thread of_instructor([&] {
    v1::DemonstrateRequest request;
    request.set_author(viewer.author.value);
    request.set_room("shown");
    request.set_speed(1.0);
    grpc::ClientContext context;
    shown = v1::PeopleService::NewStub(viewer.channel)->Demonstrate(&context, request, &response);
  });
  const CallsOfOthers others(viewer);
  std::string failed;
  for (int i = 0; i < 30 && failed.empty(); ++i) {
    std::this_thread::sleep_for(10ms);  // The call above needs a moment to arrive.
    failed = others.fail();
  }
  EXPECT_EQ(failed, "");
  EXPECT_EQ(response.demonstrator(), 0u) << "the demonstration did not wait for it";
  done.set_value();
  operator_of_rooms.join();
  of_instructor.join();
  EXPECT_TRUE(shown.ok()) << shown.error_message();
  EXPECT_EQ(response.cuts(), 240u);
}

TEST_F(DemonstrationTest, RoomsAreMadeAndClosedWhileACaseIsLookedThrough) {
  const wire::JoinedRoom viewer = join(server_->address(), wire::ClientKind::viewer, "ward");
  ASSERT_TRUE(pack_case(dir_ / "case", dir_ / "case.zip"));
  v1::UploadCaseRequest whole;
  std::ifstream archive(dir_ / "case.zip", std::ios::binary);
  whole.set_data(std::string(std::istreambuf_iterator<char>(archive), {}));
  ASSERT_LE(whole.data().size(), 1u << 20);
  grpc::ClientContext uploading;
  v1::UploadCaseResponse stored;
  const auto sender = v1::CaseService::NewStub(viewer.channel)->UploadCase(&uploading, &stored);
  ASSERT_TRUE(sender->Write(whole) && sender->WritesDone());
  ASSERT_TRUE(wait_until([&] { return fs::exists(dir_ / "checks"); }, kPatience));
  const auto stub = v1::RoomsService::NewStub(viewer.channel);
  v1::CreateRoomRequest create;
  create.set_name("new");
  v1::CreateRoomResponse created;
  const grpc::Status made =
      CallsOfOthers::ask([&](auto* context) { return stub->CreateRoom(context, create, &created); });
  EXPECT_TRUE(made.ok()) << made.error_message();
  v1::CloseRoomRequest close;
  close.set_name("new");
  v1::CloseRoomResponse closed;
  const grpc::Status gone = CallsOfOthers::ask([&](auto* context) { return stub->CloseRoom(context, close, &closed); });
  EXPECT_TRUE(gone.ok()) << gone.error_message();
  EXPECT_EQ(CallsOfOthers(viewer).fail(), "");
  uploading.TryCancel();
  EXPECT_EQ(sender->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

}  // namespace
}  // namespace osteon::test
