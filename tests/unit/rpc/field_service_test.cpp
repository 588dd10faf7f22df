// Viewers that hold the bone of a served room: who comes late, who comes twice, and who is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/field/kernel.hpp"
#include "osteon/v1/field.grpc.pb.h"
#include "tests/unit/rooms/served_room.hpp"
#include "viewer_client/net/field_source.hpp"
#include "viewer_client/net/room_subscription.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using testing::HasSubstr;
using ServedField = test::ServedRoom;

// The end of a call that is refused; empty if a message came.
grpc::Status refusal(const wire::JoinedRoom& room, std::uint64_t author, std::uint32_t kernel = kKernelVersion) {
  v1::WatchFieldRequest request;
  request.set_author(author);
  request.set_kernel_version(kernel);
  grpc::ClientContext context;
  const auto reader = v1::FieldService::NewStub(room.channel)->WatchField(&context, request);
  v1::WatchFieldResponse message;
  if (reader->Read(&message)) context.TryCancel();
  return reader->Finish();
}

// Whether the viewer holds what the room has now.
bool agrees(RoomRuntime& runtime, const HeldBone& held) {
  const BoneStatus now = runtime.bone_status();
  bool same = false;
  return held.read([&](const Replica& bone) {
    same =
        bone.room_seq() == now.room_seq && bone.hash() == now.field_hash && bone.bodies().size() == now.bodies.size();
  }) && same;
}

TEST_F(ServedField, WhoComesLateWhileTwoHandsCutEndsWithTheRoomsBone) {
  const auto one = surgeon(), other = surgeon();
  ASSERT_TRUE(wait_until([&] { return one->complete() && other->complete(); }, kPatience));
  RenderQueue queue;
  auto joined = RoomSubscription::start({.address = address(), .cache = dir_ / "viewers"}, queue, [] { return false; });
  ASSERT_TRUE(joined) << joined.error().message;
  RoomSubscription& viewer = **joined;
  EXPECT_EQ(viewer.held_bone(), nullptr) << "nobody has asked for the inside";
  constexpr int kCuts = 120;
  std::array<std::thread, 2> hands;
  hands[0] = std::thread([&] { send(*one, strokes(one->author(), kCuts, 3)); });
  hands[1] = std::thread([&] { send(*other, strokes(other->author(), kCuts, 4)); });
  EXPECT_TRUE(wait_until([&] { return one->own() > kCuts / 4; }, kPatience));
  viewer.hold_bone(true);
  for (std::thread& hand : hands) hand.join();
  ASSERT_TRUE(wait_until([&] { return one->own() == kCuts && other->own() == kCuts; }, kPatience));
  const auto held = viewer.held_bone();
  ASSERT_NE(held, nullptr);
  ASSERT_TRUE(wait_until([&] { return runtime().find_pieces(), agrees(runtime(), *held); }, kPatience));
  EXPECT_EQ(held->status().state, HeldBoneState::follows);
  EXPECT_EQ(held->status().asked_again, 0u);

  // And after an undo.
  const Digest before = runtime().bone_status().field_hash;
  ASSERT_TRUE(viewer.undo(40));
  ASSERT_TRUE(wait_until([&] { return agrees(runtime(), *held); }, kPatience));
  EXPECT_NE(runtime().bone_status().field_hash, before);
  viewer.hold_bone(false);
  EXPECT_EQ(viewer.held_bone(), nullptr);
}

TEST_F(ServedField, WhatIsSwitchedOffEndsAlthoughSomebodySharesIt) {
  RenderQueue queue;
  auto joined = RoomSubscription::start({.address = address(), .cache = dir_ / "viewers"}, queue, [] { return false; });
  ASSERT_TRUE(joined) << joined.error().message;
  const auto follows = [](const HeldBoneStatus& now) { return now.state == HeldBoneState::follows; };
  (*joined)->hold_bone(true);
  const auto older = (*joined)->held_bone();
  ASSERT_TRUE(older->wait(follows, kPatience));
  (*joined)->hold_bone(false);
  (*joined)->hold_bone(true);
  const auto newer = (*joined)->held_bone();
  ASSERT_NE(newer, older);
  ASSERT_TRUE(newer->wait(follows, kPatience));
  // Else the two would replace each other: the server gives an author one stream.
  EXPECT_FALSE(older->wait([](const HeldBoneStatus& now) { return now.asked_again > 0; }, 1s));
  EXPECT_EQ(newer->status().asked_again, 0u);
  joined->reset();
  for (const auto& bone : {older, newer})
    EXPECT_TRUE(bone->read([&](const Replica& held) { EXPECT_EQ(held.hash(), runtime().bone_status().field_hash); }));
}

TEST_F(ServedField, ANewerStreamOfAViewerReplacesTheOneBefore) {
  const wire::JoinedRoom room = join(address(), wire::ClientKind::viewer);
  v1::WatchFieldRequest request;
  request.set_author(room.author.value);
  request.set_kernel_version(kKernelVersion);
  grpc::ClientContext first, second;
  const auto stub = v1::FieldService::NewStub(room.channel);
  const auto older = stub->WatchField(&first, request);
  v1::WatchFieldResponse message;
  ASSERT_TRUE(older->Read(&message));
  const auto newer = stub->WatchField(&second, request);
  ASSERT_TRUE(newer->Read(&message));
  while (older->Read(&message)) continue;
  const grpc::Status end = older->Finish();
  EXPECT_EQ(end.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(end.error_message(), HasSubstr("has replaced it"));
  second.TryCancel();
  (void)newer->Finish();
}

TEST_F(ServedField, AsksAgainWhileTheRoomMayComeBackAndNeverAfterItsEnd) {
  const wire::JoinedRoom room = join(address(), wire::ClientKind::viewer);
  const auto held = HeldBone::start(field_of_server({.room = [=] { return room; }, .cache = dir_ / "viewers"}),
                                    {.pause = 5ms, .longest_pause = 20ms});
  ASSERT_TRUE(held->wait([](const HeldBoneStatus& now) { return now.state == HeldBoneState::follows; }, kPatience));
  runtime().send_away("the server stops for a moment");
  ASSERT_TRUE(held->wait(
      [](const HeldBoneStatus& now) { return now.state == HeldBoneState::interrupted && now.asked_again > 2; },
      kPatience));
  runtime().end_streams("the room takes no more cuts");
  ASSERT_TRUE(held->wait([](const HeldBoneStatus& now) { return now.state == HeldBoneState::failed; }, kPatience));
  EXPECT_EQ(held->status().why->message, "the room takes no more cuts");
}

TEST_F(ServedField, LeavesOfAnotherCaseAreNeverAsked) {
  const wire::JoinedRoom room = join(address(), wire::ClientKind::viewer);
  std::atomic<bool> other{false};
  const auto newest = [&] {
    wire::JoinedRoom now = room;
    if (other) now.case_hash = Digest{{7}};
    return now;
  };
  const auto held = HeldBone::start(field_of_server({.room = newest, .cache = dir_ / "viewers"}),
                                    {.pause = 5ms, .longest_pause = 20ms});
  ASSERT_TRUE(held->wait([](const HeldBoneStatus& now) { return now.state == HeldBoneState::follows; }, kPatience));
  other = true;
  const auto newer = HeldBone::start(field_of_server({.room = [&] { return room; }, .cache = dir_ / "viewers"}));
  ASSERT_TRUE(held->wait([](const HeldBoneStatus& now) { return now.state == HeldBoneState::failed; }, kPatience))
      << "the newer stream has ended the older one, which has asked again";
  EXPECT_THAT(held->status().why->message, HasSubstr("another case"));
}

TEST_F(ServedField, SoManyMayReadAtOnce) {
  const wire::JoinedRoom last = join(address(), wire::ClientKind::viewer);
  struct Open {
    wire::JoinedRoom room;
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReader<v1::WatchFieldResponse>> reader;
  };
  std::vector<std::unique_ptr<Open>> open;
  for (std::size_t i = 0; i < RoomRuntime::kMostFieldReaders; ++i) {
    auto one = std::make_unique<Open>();
    one->room = join(address(), wire::ClientKind::viewer);
    v1::WatchFieldRequest request;
    request.set_author(one->room.author.value);
    request.set_kernel_version(kKernelVersion);
    one->reader = v1::FieldService::NewStub(one->room.channel)->WatchField(&one->context, request);
    v1::WatchFieldResponse message;
    ASSERT_TRUE(one->reader->Read(&message));
    open.push_back(std::move(one));
  }
  const grpc::Status refused = refusal(last, last.author.value);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("close one of them"));
  open.back()->context.TryCancel();
  EXPECT_FALSE(open.back()->reader->Finish().ok());
  open.pop_back();
  EXPECT_TRUE(wait_until([&] { return refusal(last, last.author.value).error_code() == grpc::StatusCode::CANCELLED; },
                         kPatience))
      << "there is space again";
  for (const auto& one : open) {
    one->context.TryCancel();
    (void)one->reader->Finish();
  }
}

TEST_F(ServedField, RefusesStrangersAndOtherKernels) {
  const wire::JoinedRoom room = join(address(), wire::ClientKind::viewer);
  const grpc::Status stranger = refusal(room, 999);
  EXPECT_EQ(stranger.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(stranger.error_message(), HasSubstr("call Join first"));
  const grpc::Status kernel = refusal(room, room.author.value, kKernelVersion + 1);
  EXPECT_EQ(kernel.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(kernel.error_message(), HasSubstr("install the same Osteon release on both"));
  // A viewer says it in one sentence, and gives up.
  wire::JoinedRoom nobody = room;
  nobody.author = AuthorId{999};
  const auto held =
      HeldBone::start(field_of_server({.room = [=] { return nobody; }, .cache = dir_ / "viewers", .patience = 50ms}),
                      {.pause = 5ms, .longest_pause = 20ms});
  ASSERT_TRUE(held->wait([](const HeldBoneStatus& now) { return now.state == HeldBoneState::failed; }, kPatience));
  EXPECT_THAT(held->status().why->message, HasSubstr("call Join first"));
}

// Answers each call by its number, from 1 on.
class NumberedAnswers final : public v1::FieldService::Service {
 public:
  explicit NumberedAnswers(std::function<grpc::Status(int)> answer) : answer_(std::move(answer)) {}
  grpc::Status WatchField(grpc::ServerContext*, const v1::WatchFieldRequest*,
                          grpc::ServerWriter<v1::WatchFieldResponse>*) override {
    return answer_(++calls);
  }
  std::atomic<int> calls{0};

 private:
  std::function<grpc::Status(int)> answer_;
};

TEST(FieldSource, APauseOfTheServerIsNoRefusal) {
  constexpr auto kRefused = 100ms;
  NumberedAnswers service([&](int call) {
    if (call == 2) std::this_thread::sleep_for(2 * kRefused);
    const bool refuses = call == 1 || call == 3;
    return grpc::Status(refuses ? grpc::StatusCode::NOT_FOUND : grpc::StatusCode::UNAVAILABLE, "not now");
  });
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  const TempDir cache;
  const Case bone = test_block();
  ASSERT_TRUE(bone.save(cache / to_hex(bone.hash())));
  wire::JoinedRoom room;
  room.channel = grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials());
  room.case_hash = bone.hash();
  const auto held =
      HeldBone::start(field_of_server({.room = [&] { return room; }, .cache = cache / "", .patience = kRefused}),
                      {.pause = 1ms, .longest_pause = 2ms});
  EXPECT_TRUE(wait_until([&] { return service.calls >= 5; }, kPatience)) << "it was refused twice, each for a moment";
  EXPECT_NE(held->status().state, HeldBoneState::failed);
}

}  // namespace
}  // namespace osteon
