// Sending a case, against a server that keeps the bytes, refuses, waits or ends.
#include "common/wire/case_client.hpp"

#include <arpa/inet.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/wire/room_client.hpp"
#include "osteon/v1/cases.grpc.pb.h"
#include "osteon/v1/rooms.grpc.pb.h"
#include "tests/support/temp_dir.hpp"

namespace osteon::wire {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kArchiveBytes = 3'000'001;
constexpr int kPatience_ms = 10'000;

class FakeCases final : public v1::CaseService::Service {
 public:
  grpc::Status UploadCase(grpc::ServerContext* context, grpc::ServerReader<v1::UploadCaseRequest>* reader,
                          v1::UploadCaseResponse* response) override {
    begun = true;
    if (!refusal.ok()) return refusal;
    v1::UploadCaseRequest request;
    while (reader->Read(&request)) received += request.data();
    // The data of a cancelled call ends a moment before the call is known to be cancelled.
    for (int i = 0; received.size() < kArchiveBytes && !context->IsCancelled() && i < kPatience_ms; ++i)
      std::this_thread::sleep_for(1ms);
    has_all = !context->IsCancelled();
    while (holds && !context->IsCancelled()) std::this_thread::sleep_for(1ms);
    was_cancelled = context->IsCancelled();
    response->mutable_stored()->set_case_hash(std::string(32, 'h'));
    response->mutable_stored()->set_title("Tibia");
    response->mutable_stored()->set_bytes(77);
    response->set_known(true);
    return {};
  }

  grpc::Status refusal;
  std::string received;
  std::atomic<bool> begun{false}, holds{false}, has_all{false}, was_cancelled{false};
};

class FakeRooms final : public v1::RoomsService::Service {
 public:
  grpc::Status CreateRoom(grpc::ServerContext* context, const v1::CreateRoomRequest* request,
                          v1::CreateRoomResponse*) override {
    asked = *request;
    const auto named = context->client_metadata().find("osteon-room-bin");
    if (named != context->client_metadata().end()) in_room = {named->second.data(), named->second.size()};
    return answer;
  }

  v1::CreateRoomRequest asked;
  std::string in_room;
  grpc::Status answer;
};

class CaseClientTest : public testing::Test {
 protected:
  void SetUp() override {
    for (std::size_t i = 0; i < kArchiveBytes; ++i) bytes_ += static_cast<char>((i * i) >> 3);
    std::ofstream(archive_, std::ios::binary) << bytes_;
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&cases_);
    builder.RegisterService(&rooms_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
    channel_ = grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials());
  }
  void TearDown() override { server_->Shutdown(std::chrono::system_clock::now()); }

  test::TempDir temp_;
  std::filesystem::path archive_ = temp_ / "case.zip";
  std::string bytes_;
  FakeCases cases_;
  FakeRooms rooms_;
  std::unique_ptr<grpc::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

TEST_F(CaseClientTest, AllBytesArriveInTheirOrder) {
  std::vector<double> fractions;
  const auto stored = upload_case(channel_, archive_, [&](double fraction) {
    fractions.push_back(fraction);
    return true;
  });
  ASSERT_TRUE(stored) << stored.error().message;
  EXPECT_EQ(cases_.received, bytes_);
  for (const std::uint8_t byte : stored->hash.bytes) EXPECT_EQ(byte, 'h');
  EXPECT_EQ(stored->title, "Tibia");
  EXPECT_EQ(stored->bytes, 77u);
  EXPECT_TRUE(stored->known);
  EXPECT_TRUE(std::ranges::is_sorted(fractions));
  EXPECT_EQ(fractions.front(), 0.0);
  EXPECT_EQ(fractions.back(), 1.0);
}

TEST_F(CaseClientTest, ARefusalIsTheSentenceOfTheServer) {
  const std::pair<grpc::StatusCode, ErrorCode> meanings[] = {
      {grpc::StatusCode::RESOURCE_EXHAUSTED, ErrorCode::exhausted},
      {grpc::StatusCode::PERMISSION_DENIED, ErrorCode::denied},
      {grpc::StatusCode::INVALID_ARGUMENT, ErrorCode::invalid_input},
      {grpc::StatusCode::FAILED_PRECONDITION, ErrorCode::unavailable},
      {grpc::StatusCode::DEADLINE_EXCEEDED, ErrorCode::unavailable}};
  for (const auto& [said, meant] : meanings) {
    cases_.refusal = {said, "the folder of cases is full; ask the operator"};
    const auto stored = upload_case(channel_, archive_, {});
    ASSERT_FALSE(stored);
    EXPECT_EQ(stored.error().code, meant);
    EXPECT_TRUE(stored.error().message.ends_with("the folder of cases is full; ask the operator"))
        << stored.error().message;
  }
}

// The server has all and does not answer.
TEST_F(CaseClientTest, AStopEndsTheCallWhileTheServerChecks) {
  cases_.holds = true;
  const auto stored = upload_case(channel_, archive_, [&](double) { return !cases_.has_all; });
  ASSERT_FALSE(stored);
  EXPECT_EQ(stored.error().code, ErrorCode::cancelled);
  EXPECT_TRUE(cases_.has_all);
  server_->Shutdown();  // the handler has returned then
  EXPECT_TRUE(cases_.was_cancelled);
}

TEST_F(CaseClientTest, AStopInTheMiddleSendsNoEndOfTheData) {
  // A busy server drops a call that is cancelled before it has begun.
  const auto stored = upload_case(channel_, archive_, [&](double done) {
    for (int i = 0; done >= 0.5 && !cases_.begun && i < kPatience_ms; ++i) std::this_thread::sleep_for(1ms);
    return done < 0.5;
  });
  ASSERT_FALSE(stored);
  EXPECT_EQ(stored.error().code, ErrorCode::cancelled);
  server_->Shutdown();
  EXPECT_TRUE(cases_.was_cancelled);
  EXPECT_LT(cases_.received.size(), bytes_.size());
}

TEST_F(CaseClientTest, AServerThatEndsInTheMiddleIsOneSentence) {
  cases_.holds = true;
  bool ended = false;
  const auto stored = upload_case(channel_, archive_, [&](double fraction) {
    if (fraction > 0.5 && !std::exchange(ended, true)) server_->Shutdown(std::chrono::system_clock::now());
    return true;
  });
  ASSERT_FALSE(stored);
  EXPECT_EQ(stored.error().code, ErrorCode::unavailable);
  EXPECT_NE(stored.error().message.find("send the case again"), std::string::npos) << stored.error().message;
}

TEST_F(CaseClientTest, AProxyAndAnotherServerAreNoLostConnection) {
  const std::pair<grpc::Status, const char*> meanings[] = {
      {{grpc::StatusCode::UNKNOWN, "Received http2 header with status: 413"}, "HTTP 413"},
      {{grpc::StatusCode::UNAVAILABLE, "Received http2 header with status: 502"}, "HTTP 502"},
      {{grpc::StatusCode::UNIMPLEMENTED, ""}, "not an Osteon server of this version"}};
  for (const auto& [said, meant] : meanings) {
    cases_.refusal = said;
    const auto stored = upload_case(channel_, archive_, {});
    ASSERT_FALSE(stored);
    EXPECT_NE(stored.error().message.find(meant), std::string::npos) << stored.error().message;
  }
}

TEST_F(CaseClientTest, AFileThatIsNotThereIsNamed) {
  const auto stored = upload_case(channel_, temp_ / "no.zip", {});
  ASSERT_FALSE(stored);
  EXPECT_EQ(stored.error().code, ErrorCode::not_found);
  EXPECT_NE(stored.error().message.find("no.zip"), std::string::npos);
}

TEST_F(CaseClientTest, ARoomIsAskedForByNameAndCase) {
  Digest hash;
  hash.bytes.fill(0x5a);
  const auto opened = create_room_with(channel_, "ward", hash, {});
  EXPECT_TRUE(opened) << opened.error().message;
  EXPECT_EQ(rooms_.asked.name(), "ward");
  EXPECT_EQ(rooms_.asked.case_hash(), std::string(32, 0x5a));
  EXPECT_EQ(rooms_.in_room, "ward");
  rooms_.answer = {grpc::StatusCode::ALREADY_EXISTS, "there is a room ward"};
  const auto refused = create_room_with(channel_, "ward", hash, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::exists);
  EXPECT_EQ(refused.error().message, "there is a room ward");
  rooms_.answer = {grpc::StatusCode::UNAVAILABLE, "Socket closed"};
  const auto lost = create_room_with(channel_, "ward", hash, {});
  ASSERT_FALSE(lost);
  EXPECT_NE(lost.error().message.find("it may be open"), std::string::npos) << lost.error().message;
  EXPECT_EQ(lost.error().message.find("Socket"), std::string::npos) << lost.error().message;
}

// A port that the test holds, and on which nobody listens.
class SilentPort {
 public:
  SilentPort() : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = ::htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&at), size), 0);
    EXPECT_EQ(::getsockname(socket_, reinterpret_cast<sockaddr*>(&at), &size), 0);
    address_ = "127.0.0.1:" + std::to_string(::ntohs(at.sin_port));
  }
  ~SilentPort() { release(); }
  SilentPort(const SilentPort&) = delete;
  SilentPort& operator=(const SilentPort&) = delete;
  void release() {
    if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  }
  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  int socket_;
  std::string address_;
};

TEST(Reach, ARefusalIsSaidThoughASlowServerWouldGetMoreTime) {
  const SilentPort port;
  // It asks in each interval of its wait, so it is stopped if it waits for much longer than a refusal takes.
  int asked = 0;
  const auto reached =
      reach_server(port.address(), ClientKind::viewer, {10min, 0ms}, [&asked] { return ++asked > 400; });
  ASSERT_FALSE(reached);
  EXPECT_EQ(reached.error().code, ErrorCode::unavailable) << reached.error().message;
  EXPECT_NE(reached.error().message.find("nothing listens at " + port.address()), std::string::npos)
      << reached.error().message;
}

TEST(Reach, AServerThatBeginsAfterARefusalIsReached) {
  SilentPort port;
  FakeCases cases;
  std::unique_ptr<grpc::Server> server;
  int asked = 0;
  const auto reached = reach_server(port.address(), ClientKind::viewer, {10min, 5min}, [&] {
    constexpr int kRefused = 20;  // times that it has asked when it has been refused
    if (++asked == kRefused) {
      port.release();
      grpc::ServerBuilder builder;
      builder.AddListeningPort(port.address(), grpc::InsecureServerCredentials());
      builder.RegisterService(&cases);
      server = builder.BuildAndStart();
    }
    return asked > 400;
  });
  ASSERT_NE(server, nullptr);
  EXPECT_TRUE(reached) << reached.error().message;
}

}  // namespace
}  // namespace osteon::wire
