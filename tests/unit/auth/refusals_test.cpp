// What a server with certificates refuses. Every refusal is reported to the client, counted, and logged once however
// often it is tried. A surgeon at work beside it notices nothing.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "common/wire/convert.hpp"
#include "common/wire/room_client.hpp"
#include "osteon/v1/people.grpc.pb.h"
#include "osteon/v1/room.grpc.pb.h"
#include "server/rpc/refused_calls.hpp"
#include "server/rpc/room_server.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/content.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using grpc::StatusCode;
using test::content;
using testing::HasSubstr;

constexpr int kTimes = 3;  // how often each is tried
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

int count_of(const std::string& text, const std::string& what) {
  int count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + what.size())) ++count;
  return count;
}

class Refused : public ::testing::Test {
 protected:
  void SetUp() override {
    const Case bone = test::test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{bone, dir_ / "case"}}});
    for (const char* name : {"ward", "theatre"}) ASSERT_TRUE(rooms->create(name, nullptr));
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0", {.certificates = people_.server()});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
    sue_ = std::make_unique<test::Surgeon>(address(), dir_ / "cache", "", "ward",
                                           people_.credentials("sue", Role::trainee, "ward"));
    ASSERT_TRUE(test::wait_until([&] { return sue_->complete(); }, test::kPatience));
    for (const auto& [reason, count] : server_->rooms().refusals.counts())
      ADD_FAILURE() << "a call was refused before the test began: " << reason;
    testing::internal::CaptureStdout();  // A program that has not opened its log writes it here.
  }
  // The surgeon goes on cutting, in the session that she began with.
  void TearDown() override {
    const std::uint64_t before = sue_->own();
    Cut cut = test::strokes(sue_->author(), static_cast<int>(before) + 1, 7).back();
    cut.lease_epoch = sue_->lease();
    ASSERT_TRUE(sue_->session().send(cut));
    EXPECT_TRUE(test::wait_until([&] { return sue_->own() == before + 1; }, test::kPatience));
    EXPECT_EQ(sue_->interruptions(), 0);
    EXPECT_EQ(sue_->lost(), "");
  }
  const std::string& address() { return server_->address(); }
  std::string refusal(const wire::ClientCredentials& credentials, const std::string& room = "ward") {
    const auto joined = wire::join_room(address(), wire::ClientKind::viewer, "whatever", 500ms, {}, room, credentials);
    return joined ? std::string() : joined.error().message;
  }
  std::uint64_t counted(const std::string& reason) {
    const auto counts = server_->rooms().refusals.counts();
    const auto found = counts.find(reason);
    return found == counts.end() ? 0 : found->second;
  }
  // The lines of the log since the test began.
  static std::vector<std::string> logged(const std::string& what) {
    std::istringstream lines(testing::internal::GetCapturedStdout());
    std::vector<std::string> found;
    for (std::string line; std::getline(lines, line);)
      if (line.find(what) != std::string::npos) found.push_back(line);
    return found;
  }
  // Connects, sends `says`, and receives until the connection is closed. Returns the answer. The answer to a handshake
  // may be an alert of TLS.
  std::string knock(const std::string& says) {
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    at.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address().substr(address().rfind(':') + 1))));
    EXPECT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    (void)::send(socket, says.data(), says.size(), MSG_NOSIGNAL);
    std::string answer;
    char some[256];
    for (ssize_t got = 0; (got = ::recv(socket, some, sizeof some, 0)) > 0;)
      answer.append(some, static_cast<std::size_t>(got));
    ::close(socket);
    return answer;
  }

  test::TempDir dir_;
  test::People people_;
  std::unique_ptr<RoomServer> server_;
  std::unique_ptr<test::Surgeon> sue_;
};

TEST_F(Refused, ATicketIsItsOwnersAlone) {
  const wire::ClientCredentials anna = people_.credentials("anna", Role::trainee, "ward");
  auto first = wire::join_room(address(), wire::ClientKind::viewer, "whatever", 5s, {}, "ward", anna);
  ASSERT_TRUE(first.has_value()) << first.error().message;
  grpc::ClientContext watching;
  v1::WatchPeopleRequest request;
  request.set_author(first->author.value);
  const auto watch = v1::PeopleService::NewStub(first->channel)->WatchPeople(&watching, request);
  v1::WatchPeopleResponse said;
  ASSERT_TRUE(watch->Read(&said));
  // Another person uses the ticket again. The certificate shows that it is not theirs.
  for (int i = 0; i < kTimes; ++i)
    EXPECT_THAT(refusal({.certificates = people_.person("ben"), .ticket = anna.ticket}),
                HasSubstr("the ticket is for anna and the certificate for ben"));
  EXPECT_EQ(counted("person"), static_cast<std::uint64_t>(kTimes));
  // The same person uses it over another connection: the older session ends.
  const auto second = wire::join_room(address(), wire::ClientKind::viewer, "whatever", 5s, {}, "ward", anna);
  ASSERT_TRUE(second.has_value()) << second.error().message;
  while (watch->Read(&said)) continue;
  EXPECT_THAT(watch->Finish().error_message(), HasSubstr("a newer session of anna took the place of this one"));
  // The call has two tickets: two readers could use different ones.
  const auto channel = grpc::CreateChannel(address(), wire::channel_credentials(anna, address()).value());
  for (int i = 0; i < kTimes; ++i) {
    grpc::ClientContext context;
    context.AddMetadata("osteon-ticket", wire::ticket_text(anna));
    context.AddMetadata("osteon-ticket", wire::ticket_text(people_.credentials("anna", Role::instructor, "ward")));
    v1::GetStatusResponse response;
    const grpc::Status status = v1::RoomService::NewStub(channel)->GetStatus(&context, {}, &response);
    EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr("says twice which ticket"));
  }
  EXPECT_EQ(counted("request"), static_cast<std::uint64_t>(kTimes));
  const std::vector<std::string> lines = logged("refused who=");
  EXPECT_EQ(lines.size(), 3u) << "one of Ben, one of the ended stream, one of the call: "
                              << testing::PrintToString(lines);
}

TEST_F(Refused, TheUnauthenticatedAreCountedAndLoggedOnce) {
  // A client in this process has redirected gRPC's log since the server started.
  RefusalCounts beside;
  Connections nobodys;
  const HandshakeWatch again(beside, nobodys);
  const auto no_certificate = grpc::SslCredentials(
      {.pem_root_certs = content(people_.server() / "ca.pem"), .pem_private_key = "", .pem_cert_chain = ""});
  for (int i = 0; i < kTimes; ++i) {
    // Plain text: the answer may be one alert of TLS, but never a frame of HTTP/2.
    const std::uint64_t before = counted("tls");
    EXPECT_LE(knock(std::string("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0", 33)).size(), 7u);
    EXPECT_TRUE(test::wait_until([&] { return counted("tls") == before + 1; }, test::kPatience));
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + 5s);
    v1::GetStatusResponse response;
    grpc::ChannelArguments own;
    own.SetInt("own", i);
    const auto channel = grpc::CreateCustomChannel(address(), no_certificate, own);
    EXPECT_EQ(v1::RoomService::NewStub(channel)->GetStatus(&context, {}, &response).error_code(),
              StatusCode::UNAVAILABLE);
    EXPECT_TRUE(test::wait_until([&] { return counted("tls") >= before + 2; }, test::kPatience));
  }
  const std::vector<std::string> lines = logged("reason=tls");
  EXPECT_EQ(lines.size(), 4u) << "plain text and no certificate, from both counters: " << testing::PrintToString(lines);
}

TEST_F(Refused, JoinsAreLoggedOnceForEachKind) {
  const wire::ClientCredentials eve = people_.credentials("eve", Role::observer, "ward");
  for (int i = 0; i < kTimes; ++i) {
    const auto hand = wire::join_room(address(), wire::ClientKind::haptic, "whatever", 5s, {}, "ward", eve);
    ASSERT_FALSE(hand);
    EXPECT_THAT(hand.error().message, HasSubstr("holds no tool"));
  }
  EXPECT_EQ(counted("role"), static_cast<std::uint64_t>(kTimes));
  const auto channel = grpc::CreateChannel(address(), wire::channel_credentials(eve, address()).value());
  for (int i = 0; i < kTimes; ++i) {
    grpc::ClientContext context;
    context.AddMetadata("osteon-ticket", wire::ticket_text(eve));
    v1::JoinRequest request;
    request.set_protocol_version(999'000 + static_cast<std::uint32_t>(i));
    v1::JoinResponse response;
    EXPECT_EQ(v1::RoomService::NewStub(channel)->Join(&context, request, &response).error_code(),
              StatusCode::FAILED_PRECONDITION);
  }
  EXPECT_EQ(counted("version"), static_cast<std::uint64_t>(kTimes));
  const std::vector<std::string> lines = logged("refused who=");
  EXPECT_EQ(lines.size(), 2u) << testing::PrintToString(lines);
  EXPECT_EQ(count_of(testing::PrintToString(lines), "who=ipv4:127.0.0.1 "), 2) << testing::PrintToString(lines);
}

TEST_F(Refused, WhatMakesNoSenseIsRefusedWithAStatus) {
  const wire::ClientCredentials credentials = people_.credentials("ina", Role::instructor, "ward");
  const auto ina = wire::join_room(address(), wire::ClientKind::haptic, "whatever", 5s, {}, "ward", credentials);
  ASSERT_TRUE(ina.has_value()) << ina.error().message;
  const std::uint64_t author = ina->author.value;
  const auto room = v1::RoomService::NewStub(ina->channel);
  std::uint64_t refused = 0;
  const auto expect_refused = [&](const std::string& what,
                                  const std::function<grpc::Status(grpc::ClientContext&)>& call) {
    for (int i = 0; i < kTimes; ++i) {
      grpc::ClientContext context;
      context.set_deadline(std::chrono::system_clock::now() + 20s);
      const grpc::Status status = call(context);
      EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT) << what << ": " << status.error_message();
      EXPECT_NE(status.error_message(), "") << what;
      ++refused;
      EXPECT_TRUE(test::wait_until([&] { return counted("request") == refused; }, test::kPatience))
          << what << " " << counted("request");
    }
  };
  // A pose that is not a number: of an item, of a camera, of a tool in its session.
  expect_refused("item", [&](grpc::ClientContext& context) {
    v1::SetSceneItemRequest request;
    request.set_author(author);
    SceneItem item;
    item.tool = test::tool_named("guide-1").hash();
    item.pose_bone_item.position_mm = {kNan, 0, 0};
    *request.mutable_item() = wire::to_wire(item);
    v1::SetSceneItemResponse response;
    return room->SetSceneItem(&context, request, &response);
  });
  expect_refused("look", [&](grpc::ClientContext& context) {
    v1::LookFromRequest request;
    request.set_author(author);
    *request.mutable_look() = wire::to_wire(ViewFrustum{.eye_mm = {0, 0, kNan}});
    v1::LookFromResponse response;
    return v1::WatchService::NewStub(ina->channel)->LookFrom(&context, request, &response);
  });
  const auto share = [&](grpc::ClientContext& context, const ShotRun& run, const ShotTotals& session) {
    v1::ShareShotsRequest request;
    request.set_author(author);
    *request.mutable_run() = wire::to_wire(run);
    *request.mutable_session() = wire::to_wire(session);
    v1::ShareShotsResponse response;
    return v1::PeopleService::NewStub(ina->channel)->ShareShots(&context, request, &response);
  };
  ShotRun run{.first_number = 1, .exposure_s = 0.02, .last = {.number = 1, .air_kerma_at_metre_ugy = 2.0}};
  {
    grpc::ClientContext context;
    EXPECT_TRUE(share(context, run, {1, 0.02, 0.001}).ok()) << "a sound shot";
  }
  expect_refused("counts of shots", [&](grpc::ClientContext& context) {
    return share(context, run, {1, kNan, 0.001});
  });
  run.last.position.orbit_rad = kNan;
  expect_refused("shot", [&](grpc::ClientContext& context) { return share(context, run, {1, 0.02, 0.001}); });
  const auto in_session = [&](grpc::ClientContext& context, const v1::SessionRequest& request) {
    const auto session = v1::CuttingService::NewStub(ina->channel)->Session(&context);
    v1::SessionRequest open;
    open.mutable_open()->set_author(author);
    open.mutable_open()->set_server_epoch(ina->server_epoch);
    open.mutable_open()->set_secret(ina->secret);
    (void)session->Write(open);
    (void)session->Write(request);
    v1::SessionResponse said;
    while (session->Read(&said)) continue;
    return session->Finish();
  };
  for (const double bad : {kNan, std::numeric_limits<double>::infinity(), 1e300})
    expect_refused("state of " + std::to_string(bad), [&](grpc::ClientContext& context) {
      CuttingState state;
      state.author = ina->author;
      state.state_seq = 1;
      state.pose_bone_tool.position_mm = {0, bad, 0};
      v1::SessionRequest request;
      *request.mutable_state() = wire::to_wire(state);
      return in_session(context, request);
    });
  expect_refused("a push of no number", [&](grpc::ClientContext& context) {
    v1::SessionRequest request;
    request.mutable_push()->set_push_seq(1);
    return in_session(context, request);
  });
  expect_refused("a cut of another author", [&](grpc::ClientContext& context) {
    v1::SessionRequest request;
    *request.mutable_cut() = wire::to_wire(test::strokes(sue_->author(), 1, 5).back());
    return in_session(context, request);
  });
  expect_refused("a cut without a path", [&](grpc::ClientContext& context) {
    Cut cut = test::strokes(ina->author, 1, 5).back();
    v1::SessionRequest request;
    *request.mutable_cut() = wire::to_wire(cut);
    request.mutable_cut()->clear_path();
    return in_session(context, request);
  });
  // Tools that are too large, have values that are not numbers, or are no tools.
  const std::string yaml = wire::to_wire(test::tool_named("burr-round-5")).yaml();
  const auto diameter = [&](const std::string& value) {
    const std::size_t at = yaml.find("diameter_mm: ");
    EXPECT_NE(at, std::string::npos) << yaml;
    std::string changed = yaml;
    return changed.replace(at, yaml.find('\n', at) - at, "diameter_mm: " + value);
  };
  for (const std::string& tool :
       {diameter("1e9"), diameter(".nan"), diameter("-5"), std::string(1'000'000, '['), std::string("nonsense")})
    expect_refused("tool " + tool.substr(0, 60), [&](grpc::ClientContext& context) {
      v1::AddToolRequest request;
      request.set_author(author);
      request.mutable_tool()->set_yaml(tool);
      v1::AddToolResponse response;
      return room->AddTool(&context, request, &response);
    });
  // Each refusal was counted. All refusals from one address are one line.
  const std::vector<std::string> lines = logged("refused who=");
  EXPECT_EQ(lines.size(), 1u) << testing::PrintToString(lines);
}

TEST_F(Refused, WhatIsTooLargeIsRefusedWithAStatus) {
  const auto ina = wire::join_room(address(), wire::ClientKind::viewer, "whatever", 5s, {}, "ward",
                                   people_.credentials("ina", Role::instructor, "ward"));
  ASSERT_TRUE(ina.has_value()) << ina.error().message;
  for (int i = 0; i < kTimes; ++i) {
    grpc::ClientContext context;
    v1::AddToolRequest request;
    request.set_author(ina->author.value);
    request.mutable_tool()->set_yaml(std::string(5 * 1024 * 1024, 'x'));
    v1::AddToolResponse response;
    EXPECT_EQ(v1::RoomService::NewStub(ina->channel)->AddTool(&context, request, &response).error_code(),
              StatusCode::RESOURCE_EXHAUSTED);
    grpc::ClientContext said;
    v1::SayRequest words;
    words.set_author(ina->author.value);
    words.set_words(std::string(4096, 'x'));
    v1::SayResponse answer;
    EXPECT_EQ(v1::PeopleService::NewStub(ina->channel)->Say(&said, words, &answer).error_code(),
              StatusCode::INVALID_ARGUMENT);
  }
  EXPECT_LE(logged("refused who=").size(), 2u);
}

}  // namespace
}  // namespace osteon
