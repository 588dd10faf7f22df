// A case that is fetched from a server that refuses it, sends it slowly, or becomes silent.
#include "common/wire/case_files.hpp"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "osteon/v1/room.grpc.pb.h"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class OneCall final : public v1::RoomService::Service {
 public:
  using Writer = grpc::ServerWriter<v1::GetCaseResponse>;
  using Answer = std::function<grpc::Status(grpc::ServerContext& call, Writer& out)>;
  explicit OneCall(Answer answer) : answer_(std::move(answer)) {}
  grpc::Status GetCase(grpc::ServerContext* call, const v1::GetCaseRequest*, Writer* out) override {
    return answer_(*call, *out);
  }

 private:
  Answer answer_;
};

Result<void> fetch(OneCall::Answer answer, std::chrono::milliseconds longest_silence) {
  OneCall service(std::move(answer));
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  const test::TempDir folder;
  wire::JoinedRoom room;
  room.channel = grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials());
  return wire::fetch_case_files(room, folder / "", {.longest_silence = longest_silence});
}

void send_part(OneCall::Writer& out) {
  v1::GetCaseResponse part;
  part.set_file("case.json");
  part.set_data("{}");
  out.Write(part);
}

TEST(CaseFiles, ARefusalIsNotALostLine) {
  const auto code_of = [](grpc::StatusCode status) {
    const Result<void> got = fetch([=](auto&, auto&) { return grpc::Status(status, "not for you"); }, 20s);
    EXPECT_THAT(got.error().message, HasSubstr("not for you"));
    return got.error().code;
  };
  EXPECT_EQ(code_of(grpc::StatusCode::PERMISSION_DENIED), ErrorCode::denied);
  EXPECT_EQ(code_of(grpc::StatusCode::UNAUTHENTICATED), ErrorCode::denied);
  EXPECT_EQ(code_of(grpc::StatusCode::NOT_FOUND), ErrorCode::not_found);
  EXPECT_EQ(code_of(grpc::StatusCode::UNIMPLEMENTED), ErrorCode::unsupported);
  EXPECT_EQ(code_of(grpc::StatusCode::UNAVAILABLE), ErrorCode::unavailable);
  EXPECT_EQ(code_of(grpc::StatusCode::RESOURCE_EXHAUSTED), ErrorCode::unavailable);
}

TEST(CaseFiles, SilenceIsLimitedAndNotTheWholeTime) {
  const Result<void> slow = fetch(
      [](auto&, auto& out) {
        for (int i = 0; i < 6; ++i) std::this_thread::sleep_for(1s), send_part(out);
        return grpc::Status::OK;
      },
      4s);
  EXPECT_TRUE(slow) << slow.error().message;
  const Result<void> silent = fetch(
      [](auto& call, auto& out) {
        send_part(out);
        while (!call.IsCancelled()) std::this_thread::sleep_for(5ms);
        return grpc::Status::CANCELLED;
      },
      300ms);
  ASSERT_FALSE(silent);
  EXPECT_EQ(silent.error().code, ErrorCode::unavailable);
  EXPECT_THAT(silent.error().message, HasSubstr("nothing came for 300 ms"));
}

}  // namespace
}  // namespace osteon
