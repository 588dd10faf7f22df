// A console at a server from before consoles were a kind of client.
#include "viewer_client/net/people_client.hpp"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "osteon/v1/room.grpc.pb.h"

namespace osteon {
namespace {

using testing::HasSubstr;
using testing::Not;

class OlderServer final : public v1::RoomService::Service {
 public:
  OlderServer() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  grpc::Status Join(grpc::ServerContext*, const v1::JoinRequest* request, v1::JoinResponse*) override {
    asked = request->kind();
    const bool known = request->kind() <= v1::CLIENT_KIND_AUDIO;
    return {grpc::StatusCode::INVALID_ARGUMENT,
            known ? "name is longer than 256 bytes" : "kind is not a kind of client that this server knows"};
  }
  v1::ClientKind asked = v1::CLIENT_KIND_UNSPECIFIED;

 private:
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

TEST(PeopleClient, SaysWhatToDoWhereTheServerKnowsNoConsoles) {
  OlderServer server;
  const auto refused = PeopleClient::start({.address = server.address()}, {});
  EXPECT_EQ(server.asked, v1::CLIENT_KIND_CONSOLE);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
  EXPECT_THAT(refused.error().message, HasSubstr("older than this console"));
  EXPECT_THAT(refused.error().message, HasSubstr("install a newer Osteon where the server runs"));
  EXPECT_THAT(refused.error().message, Not(HasSubstr("\n"))) << "one sentence";
}

}  // namespace
}  // namespace osteon
