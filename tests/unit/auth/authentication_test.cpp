// Authentication of a server in this process, over TLS: every call by every role, and clients with wrong credentials.
#include <gmock/gmock.h>
#include <google/protobuf/dynamic_message.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <thread>

#include "common/link/udp_port.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/room_client.hpp"
#include "osteon/v1/people.grpc.pb.h"
#include "osteon/v1/room.grpc.pb.h"
#include "osteon/v1/rooms.grpc.pb.h"
#include "server/cli/room_admin_client.hpp"
#include "server/rpc/room_server.hpp"
#include "tests/architecture/proto_rules.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/authentication/proxy.hpp"
#include "tests/support/authentication/raw_http2.hpp"
#include "tests/support/content.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using grpc::ByteBuffer;
using grpc::StatusCode;
using test::content;
using testing::HasSubstr;

class Authentication : public ::testing::Test {
 protected:
  void SetUp() override { serve({}); }
  void serve(const std::filesystem::path& proxy_socket) {
    const Case bone = test::test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{bone, dir_ / "case"}}, .folder = dir_ / "rooms"});
    std::filesystem::create_directories(dir_ / "rooms");
    for (const char* name : {"ward", "theatre"}) ASSERT_TRUE(rooms->create(name, nullptr));
    auto started = RoomServer::start(
        std::move(rooms), "127.0.0.1:0",
        {.certificates = people_.server(), .most_connections = kMostConnections, .proxy_socket = proxy_socket});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
  }
  static constexpr std::size_t kMostConnections = 24;
  // The address that clients connect to.
  virtual const std::string& address() { return server_->address(); }
  void expect_every_role_to_make_the_calls_that_are_for_it();
  Result<wire::JoinedRoom> join(const wire::ClientCredentials& credentials,
                                wire::ClientKind kind = wire::ClientKind::viewer, const std::string& room = "ward") {
    return wire::join_room(address(), kind, "whatever", 5s, {}, room, credentials);
  }
  std::string refusal(const wire::ClientCredentials& credentials, const std::string& room = "ward") {
    const auto joined = wire::join_room(address(), wire::ClientKind::viewer, "whatever", 500ms, {}, room, credentials);
    return joined ? std::string() : joined.error().message;
  }
  // A channel with these credentials, as none of our clients would use it.
  std::shared_ptr<grpc::Channel> channel(const wire::ClientCredentials& credentials) {
    return grpc::CreateChannel(address(), wire::channel_credentials(credentials, address()).value());
  }

  test::TempDir dir_;
  test::People people_;
  std::unique_ptr<RoomServer> server_;
};

// A client that connects and sends nothing.
class RawConnection {
 public:
  explicit RawConnection(const std::string& address) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    at.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    (void)::connect(socket_, reinterpret_cast<const sockaddr*>(&at), sizeof at);
  }
  ~RawConnection() { ::close(socket_); }
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;

 private:
  const int socket_;
};

struct Called {
  grpc::Status status;
  bool answered = false;  // a message was received
};

// One request in one piece, because a proxy may end what comes after the answer. Then the first answer: message or end.
Called call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method, const ByteBuffer& request,
            const std::map<std::string, std::string>& metadata) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 20s);
  for (const auto& [key, value] : metadata) context.AddMetadata(key, value);
  grpc::CompletionQueue queue;
  const auto stream = stub.PrepareCall(&context, method, &queue);
  const auto done = [&] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  Called called;
  context.set_initial_metadata_corked(true);
  stream->StartCall(nullptr);
  stream->WriteLast(request, {}, nullptr);
  (void)done();
  ByteBuffer response;
  stream->Read(&response, nullptr);
  called.answered = done();
  if (called.answered) context.TryCancel();
  stream->Finish(&called.status, nullptr);
  (void)done();
  return called;
}

struct Method {
  std::string name;
  const google::protobuf::Descriptor* request;
};

const test::Protocol& protocol() {
  static const test::Protocol all = test::load_protocol(content(OSTEON_DESCRIPTOR));
  return all;
}

std::vector<Method> methods() {
  std::vector<Method> all;
  for (const auto* file : protocol().files)
    for (int s = 0; s < file->service_count(); ++s)
      for (int m = 0; m < file->service(s)->method_count(); ++m)
        all.push_back({"/" + file->service(s)->full_name() + "/" + file->service(s)->method(m)->name(),
                       file->service(s)->method(m)->input_type()});
  return all;
}

// A request of this type, empty except for its author.
ByteBuffer request_of(const Method& method, std::uint64_t author) {
  google::protobuf::DynamicMessageFactory factory;
  const std::unique_ptr<google::protobuf::Message> message(factory.GetPrototype(method.request)->New());
  if (const auto* field = method.request->FindFieldByName("author"))
    message->GetReflection()->SetUInt64(message.get(), field, author);
  const std::string bytes = message->SerializeAsString();
  const grpc::Slice slice(bytes);
  return {&slice, 1};
}

bool has_author(const Method& method) { return method.request->FindFieldByName("author") != nullptr; }

void Authentication::expect_every_role_to_make_the_calls_that_are_for_it() {
  // The rules as the roles are described to people: what a role may do beyond watching.
  const std::set<std::string> hands{"Session",      "AddTool",         "Undo", "Redo",      "Mark",
                                    "SetSceneItem", "RemoveSceneItem", "Say",  "ShareShots"},
      instructors{"RemoveBody", "SaveFields", "Supervise", "Annotate", "Demonstrate", "EndDemonstration"},
      both{"ListRooms", "DeleteRoom", "VerifyRoom", "BranchRoom", "ReplayRoom", "ListCases"},
      operators{"CreateRoom", "CloseRoom", "ResumeRoom", "BackUpRoom", "UploadCase"};
  const auto may = [&](Role role, const std::string& name) {
    if (operators.contains(name)) return role == Role::operator_;
    if (both.contains(name)) return role == Role::operator_ || role == Role::instructor;
    if (role == Role::operator_) return false;
    if (instructors.contains(name)) return role == Role::instructor;
    return !hands.contains(name) || role != Role::observer;
  };
  int calls = 0;
  for (const Role role : {Role::observer, Role::trainee, Role::collaborator, Role::instructor, Role::operator_}) {
    const std::string user = "user-" + std::string(to_string(role));
    const wire::ClientCredentials credentials = people_.credentials(user, role, "ward");
    const auto line = channel(credentials);
    const std::map<std::string, std::string> metadata{{"osteon-room-bin", "ward"},
                                                      {"osteon-ticket", wire::ticket_text(credentials)}};
    for (const Method& method : methods()) {
      const std::string name = method.name.substr(method.name.rfind('/') + 1);
      const Called called = call(line, method.name, request_of(method, 0), metadata);
      ++calls;
      const bool refused_by_role = called.status.error_code() == StatusCode::PERMISSION_DENIED &&
                                   called.status.error_message().find("may not call " + name) != std::string::npos;
      EXPECT_EQ(!refused_by_role, may(role, name))
          << to_string(role) << " " << method.name << ": " << called.status.error_code() << " "
          << called.status.error_message();
      EXPECT_NE(called.status.error_code(), StatusCode::UNAUTHENTICATED) << method.name;
      EXPECT_NE(called.status.error_code(), StatusCode::UNAVAILABLE) << method.name << called.status.error_message();
    }
  }
  EXPECT_EQ(calls, 5 * static_cast<int>(methods().size()));
  EXPECT_GT(methods().size(), 30u);
}

TEST_F(Authentication, LetEveryRoleMakeTheCallsThatAreForIt) { expect_every_role_to_make_the_calls_that_are_for_it(); }

// With the proxy of deploy/haproxy.cfg, which ends TLS and adds the person's name to each call.
class AuthenticationBehindAProxy : public Authentication {
 protected:
  void SetUp() override {
    if (const std::string missing = test::Proxy::missing(); !missing.empty()) GTEST_SKIP() << missing;
    serve(dir_ / "proxy.sock");
    proxy_.emplace(people_.server(), dir_ / "proxy.sock");
  }
  const std::string& address() override { return proxy_->address(); }
  std::optional<test::Proxy> proxy_;
};

TEST_F(AuthenticationBehindAProxy, LetEveryRoleMakeTheCallsThatAreForIt) {
  expect_every_role_to_make_the_calls_that_are_for_it();
}

TEST_F(AuthenticationBehindAProxy, KnowPeopleByTheirCertificatesAndAddresses) {
  EXPECT_EQ(refusal(people_.credentials("anna", Role::trainee, "ward")), "");
  EXPECT_THAT(refusal({.certificates = people_.person("ben"),
                       .ticket = people_.credentials("anna", Role::trainee, "ward").ticket}),
              HasSubstr("the ticket is for anna and the certificate for ben"));
  // Two people over one connection of the proxy to the server stay two.
  EXPECT_THAT(refusal({.certificates = people_.person("anna"),
                       .ticket = people_.credentials("ben", Role::trainee, "ward").ticket}),
              HasSubstr("the ticket is for ben and the certificate for anna"));
}

TEST_F(AuthenticationBehindAProxy, BelieveNoHeaderThatAClientSends) {
  const std::string annas = content(people_.person("anna") / "person.pem");
  std::string base64;
  std::istringstream lines(annas);
  for (std::string line; std::getline(lines, line);)
    if (!line.starts_with("-----")) base64 += line;
  const std::string ticket = wire::ticket_text(people_.credentials("anna", Role::instructor, "ward"));
  const std::map<std::string, std::string> metadata{
      {"osteon-ticket", ticket}, {"osteon-client-certificate", base64}, {"osteon-client-address", "10.1.2.3"}};
  const wire::ClientCredentials ben = people_.credentials("ben", Role::trainee, "ward");
  const std::vector<std::string> places{server_->address(), proxy_->address()};
  for (const std::string& place : places) {
    const auto line = grpc::CreateChannel(place, wire::channel_credentials(ben, place).value());
    const Called called = call(line, "/osteon.v1.RoomService/GetStatus", {}, metadata);
    EXPECT_NE(called.status.error_code(), StatusCode::OK) << place;
    EXPECT_FALSE(called.answered) << place;
  }
  EXPECT_EQ(server_->connection_health().authorizer.admitted, 0u);
}

TEST_F(AuthenticationBehindAProxy, RefuseWhoWasRevokedAndOtherAuthorities) {
  EXPECT_EQ(refusal(people_.credentials("anna", Role::trainee, "ward")), "");
  test::People elsewhere;
  EXPECT_FALSE(test::RawHttp2(address(), elsewhere.person("anna")).read(5s).has_value());
  EXPECT_FALSE(test::RawHttp2(address()).read(5s).has_value());
  test::RawHttp2 before(address(), people_.person("anna"));
  ASSERT_TRUE(before.read(5s).has_value());
  people_.certs({"revoke", "anna"});
  ASSERT_TRUE(proxy_->is_told_of(1));
  EXPECT_FALSE(test::RawHttp2(address(), people_.person("anna")).read(5s).has_value())
      << "a new connection was accepted";
  (void)before.call(1, "/osteon.v1.RoomService/GetStatus");
  EXPECT_TRUE(before.closed_within(test::kPatience)) << "the open connection was not closed";
  EXPECT_EQ(refusal(people_.credentials("ben", Role::trainee, "ward")), "");
  EXPECT_THAT(proxy_->log(), HasSubstr("certificate fault 23")) << "openssl verify's number for a revoked certificate";
}

TEST_F(AuthenticationBehindAProxy, KeepInsidersFromTheServer) {
  // These headers end a gRPC 1.51 process, with an AuthMetadataProcessor or by itself (CVE-2023-1428).
  const test::RawHttp2::Headers strange[] = {
      {{"grpclb_client_stats", "x"}}, {{"lb-token", "x"}}, {{"te", "x"}}, {{":scheme", "x"}}};
  for (const test::RawHttp2::Headers& headers : strange) {
    test::RawHttp2 line(address(), people_.person("mallory"));
    (void)line.call(1, "/osteon.v1.RoomService/GetStatus", headers);
    (void)line.send_empty_message(1);
    (void)line.read(2s);
  }
  // CVE-2023-44487: far more calls than anybody makes, each reset at once.
  test::RawHttp2 line(address(), people_.person("mallory"));
  for (std::uint32_t stream = 1; stream < 40'001; stream += 2)
    if (!line.call(stream, "/osteon.v1.CuttingService/Session") || !line.reset(stream)) break;
  EXPECT_TRUE(proxy_->running());
  EXPECT_EQ(refusal(people_.credentials("anna", Role::trainee, "ward")), "");
  EXPECT_LT(server_->connection_health().authorizer.admitted + server_->connection_health().authorizer.refused, 8'000u);
}

TEST_F(Authentication, LetNobodyCallAsSomebodyElse) {
  const auto ben = join(people_.credentials("ben", Role::instructor, "ward"));
  ASSERT_TRUE(ben.has_value()) << ben.error().message;
  const wire::ClientCredentials credentials = people_.credentials("anna", Role::instructor, "ward");
  const std::map<std::string, std::string> metadata{{"osteon-room-bin", "ward"},
                                                    {"osteon-ticket", wire::ticket_text(credentials)}};
  const auto line = channel(credentials);
  int tried = 0;
  for (const Method& method : methods()) {
    if (!has_author(method)) continue;
    ++tried;
    const Called called = call(line, method.name, request_of(method, ben->author.value), metadata);
    EXPECT_FALSE(called.answered) << method.name;
    // The fault of the empty request may be reported first.
    EXPECT_THAT(called.status.error_code(), testing::AnyOf(StatusCode::PERMISSION_DENIED, StatusCode::INVALID_ARGUMENT))
        << method.name << " " << called.status.error_message();
    if (called.status.error_code() == StatusCode::PERMISSION_DENIED) {
      EXPECT_THAT(called.status.error_message(), HasSubstr("not yours")) << method.name;
    }
  }
  EXPECT_GT(tried, 15);
}

TEST_F(Authentication, NeedACertificateOfTheirOwnAuthority) {
  const wire::ClientCredentials anna = people_.credentials("anna", Role::trainee, "ward");
  EXPECT_EQ(refusal(anna), "");
  EXPECT_THAT(refusal({}), HasSubstr("asks for a certificate")) << "the client uses plain text";
  test::People strangers;
  EXPECT_NE(refusal({.certificates = strangers.person("anna"), .ticket = anna.ticket}), "")
      << "the certificate is of another authority";
  // The authority is the server's, but another authority signed the certificate.
  std::filesystem::copy_file(people_.person("anna") / "ca.pem", strangers.person("anna") / "ca.pem",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_NE(refusal({.certificates = strangers.person("anna"), .ticket = anna.ticket}), "")
      << "another authority signed it";
  // No certificate at all.
  const auto bare = grpc::CreateChannel(
      address(),
      grpc::SslCredentials(
          {.pem_root_certs = content(people_.server() / "ca.pem"), .pem_private_key = "", .pem_cert_chain = ""}));
  EXPECT_EQ(call(bare, "/osteon.v1.RoomsService/ListRooms", {}, {}).status.error_code(), StatusCode::UNAVAILABLE);
  // A client does not accept the server of another authority either.
  std::filesystem::copy_file(strangers.server() / "ca.pem", people_.person("ben") / "ca.pem",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_NE(refusal({.certificates = people_.person("ben"), .ticket = people_.ticket("ben", "ward", Role::trainee)}),
            "");
  EXPECT_EQ(refusal(anna), "");
}

TEST_F(Authentication, SayInOneSentenceWhatIsWrongWithATicket) {
  const std::filesystem::path anna = people_.person("anna");
  const auto with = [&](const std::filesystem::path& ticket) {
    return refusal({.certificates = anna, .ticket = ticket});
  };
  EXPECT_THAT(with(people_.ticket("anna", "ward", Role::trainee, -5s)), HasSubstr("the ticket expired"));
  EXPECT_THAT(with(people_.ticket("ben", "ward", Role::trainee)),
              HasSubstr("the ticket is for ben and the certificate for anna"));
  EXPECT_THAT(with(people_.ticket("anna", "theatre", Role::trainee)), HasSubstr("the ticket is for room theatre"));
  EXPECT_THAT(with(people_.ticket_file("osteon1.aaaa.bbbb")), HasSubstr("malformed"));
  EXPECT_THAT(with(people_.ticket_file(sign_ticket(
                  make_ticket("ward", "anna", Role::trainee,
                              std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now()) + 1h)
                      .value(),
                  new_ticket_key()))),
              HasSubstr("signature"));
  EXPECT_THAT(with(people_.folder() / "none"), HasSubstr("no ticket came"));
  // An observer may watch, but not cut.
  const auto hand = join(people_.credentials("eve", Role::observer, "ward"), wire::ClientKind::haptic);
  ASSERT_FALSE(hand);
  EXPECT_EQ(hand.error().code, ErrorCode::denied);
  EXPECT_THAT(hand.error().message, HasSubstr("holds no tool"));
  EXPECT_TRUE(join(people_.credentials("eve", Role::observer, "ward")));
}

TEST_F(Authentication, TakeATicketOnceOnly) {
  // The call has two tickets: two readers could use different ones.
  const wire::ClientCredentials anna = people_.credentials("anna", Role::trainee, "ward");
  grpc::ClientContext context;
  context.AddMetadata("osteon-ticket", wire::ticket_text(anna));
  context.AddMetadata("osteon-room-bin", "ward");
  context.AddMetadata("osteon-room-bin", "theatre");
  v1::GetStatusResponse response;
  const grpc::Status status = v1::RoomService::NewStub(channel(anna))->GetStatus(&context, {}, &response);
  EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT) << status.error_message();
}

TEST_F(Authentication, TakeNewCertificatesWithoutARestart) {
  // The certificate of a surgeon whose authority becomes trusted while the server runs.
  test::People others;
  const std::filesystem::path guest = others.person("guest");
  std::filesystem::copy_file(people_.server() / "ca.pem", guest / "ca.pem",
                             std::filesystem::copy_options::overwrite_existing);
  const wire::ClientCredentials credentials{.certificates = guest,
                                            .ticket = people_.ticket("guest", "ward", Role::observer)};
  EXPECT_NE(refusal(credentials), "");
  const std::string both = content(people_.server() / "ca.pem") + content(others.server() / "ca.pem");
  std::ofstream(dir_ / "both.pem") << both;
  std::filesystem::rename(dir_ / "both.pem", people_.server() / "ca.pem");
  EXPECT_TRUE(test::wait_until([&] { return refusal(credentials).empty(); }, test::kPatience));
  // The server gets a new key too.
  people_.certs({"server", "127.0.0.1"});
  const std::string fresh = content(people_.server() / "server.pem");
  EXPECT_TRUE(test::wait_until(
      [&] {
        const auto line = grpc::CreateChannel(
            address(), grpc::SslCredentials({.pem_root_certs = content(people_.server() / "ca.pem"),
                                             .pem_private_key = content(people_.person("anna") / "person.key"),
                                             .pem_cert_chain = content(people_.person("anna") / "person.pem")}));
        grpc::ClientContext context;
        context.set_deadline(std::chrono::system_clock::now() + 2s);
        v1::GetStatusResponse response;
        (void)v1::RoomService::NewStub(line)->GetStatus(&context, {}, &response);
        const auto auth = context.auth_context();
        const auto shown =
            auth ? auth->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME) : std::vector<grpc::string_ref>();
        return shown.size() == 1 && std::string(shown[0].data(), shown[0].size()) == fresh;
      },
      test::kPatience));
}

TEST_F(Authentication, KeepRoomsApart) {
  // A call without the name of a room is for the room of the ticket.
  const auto in_theatre = join(people_.credentials("anna", Role::trainee, "theatre"), wire::ClientKind::viewer, "");
  ASSERT_TRUE(in_theatre.has_value()) << in_theatre.error().message;
  EXPECT_EQ(in_theatre->name, "theatre");
  // An instructor of one room can list, verify and branch only that room.
  auto rooms = RoomAdminClient::reach(address(), 5s, {}, people_.credentials("ina", Role::instructor, "ward"));
  ASSERT_TRUE(rooms.has_value());
  const auto list = rooms->list();
  ASSERT_TRUE(list.has_value()) << list.error().message;
  ASSERT_EQ(list->size(), 1u);
  EXPECT_EQ(list->front().name, "ward");
  EXPECT_TRUE(rooms->verify("ward"));
  const auto other = rooms->verify("theatre");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::denied) << other.error().message;
  EXPECT_FALSE(rooms->branch("theatre", "copy", RoomSeq{0}));
  EXPECT_FALSE(rooms->create("third", ""));
  // Nor can she replay in it what was cut in another room.
  const auto ina = join(people_.credentials("ina", Role::instructor, "ward"), wire::ClientKind::viewer, "");
  ASSERT_TRUE(ina.has_value()) << ina.error().message;
  v1::DemonstrateRequest shown;
  shown.set_author(ina->author.value);
  shown.set_room("theatre");
  shown.set_speed(1);
  v1::DemonstrateResponse response;
  grpc::ClientContext context;
  const grpc::Status status = v1::PeopleService::NewStub(ina->channel)->Demonstrate(&context, shown, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED) << status.error_message();
  EXPECT_THAT(status.error_message(), HasSubstr("theatre"));
  auto all = RoomAdminClient::reach(address(), 5s, {}, people_.credentials("otto", Role::operator_, "*"));
  EXPECT_EQ(all->list()->size(), 2u);
  EXPECT_TRUE(all->create("third", ""));
  EXPECT_TRUE(all->remove("third", false));
}

// The message of a call names its room. The metadata that admitted the call may name another.
TEST_F(Authentication, JudgeCallsAboutRoomsByTheRoomsThatTheyName) {
  const auto asked = [&](const wire::ClientCredentials& credentials, const std::string& in, const std::string& about) {
    grpc::ClientContext context;
    context.AddMetadata("osteon-ticket", wire::ticket_text(credentials));
    if (!in.empty()) context.AddMetadata("osteon-room-bin", in);
    v1::DeleteRoomRequest request;
    request.set_name(about);
    v1::DeleteRoomResponse response;
    return v1::RoomsService::NewStub(channel(credentials))->DeleteRoom(&context, request, &response);
  };
  const auto is_there = [&](const std::string& name) { return server_->rooms().find(name).has_value(); };
  // A higher role in one room than elsewhere.
  ASSERT_TRUE(server_->rooms().create("annex", nullptr));
  people_.append_access("role bob operator annex");
  people_.append_access("role otto observer ward");
  server_->rooms().authorizer->look();
  const wire::ClientCredentials bob = people_.credentials("bob", Role::observer, "*");
  EXPECT_EQ(asked(bob, "annex", "ward").error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_TRUE(is_there("ward"));
  EXPECT_TRUE(asked(bob, "annex", "annex").ok());
  EXPECT_FALSE(is_there("annex"));
  // A lower role in one room than elsewhere.
  const wire::ClientCredentials otto = people_.credentials("otto", Role::operator_, "*");
  for (const char* in : {"", "ward", "theatre"})
    EXPECT_EQ(asked(otto, in, "ward").error_code(), StatusCode::PERMISSION_DENIED) << in;
  EXPECT_TRUE(is_there("ward"));
  auto rooms = RoomAdminClient::reach(address(), 5s, {}, otto);
  ASSERT_TRUE(rooms.has_value());
  EXPECT_EQ(rooms->close("ward").error().code, ErrorCode::denied);
  // Such a room is not in the list either.
  const auto all = rooms->list();
  ASSERT_TRUE(all.has_value()) << all.error().message;
  ASSERT_EQ(all->size(), 1u);
  EXPECT_EQ(all->front().name, "theatre");
  EXPECT_TRUE(rooms->close("theatre"));
  // An empty name does not stand for the only room.
  EXPECT_EQ(asked(otto, "theatre", "").error_code(), StatusCode::INVALID_ARGUMENT);
}

TEST_F(Authentication, DeleteNoBranchThatATicketIsNotFor) {
  ASSERT_TRUE(server_->rooms().branch("ward", "annex", RoomSeq{0}));
  auto own = RoomAdminClient::reach(address(), 5s, {}, people_.credentials("otto", Role::operator_, "ward"));
  ASSERT_TRUE(own.has_value());
  const auto refused = own->remove("ward", true);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::denied) << refused.error().message;
  EXPECT_THAT(refused.error().message, HasSubstr("annex"));
  for (const char* name : {"ward", "annex"}) EXPECT_TRUE(server_->rooms().find(name)) << name;
  auto any = RoomAdminClient::reach(address(), 5s, {}, people_.credentials("olga", Role::operator_, "*"));
  ASSERT_TRUE(any.has_value());
  EXPECT_EQ(any->remove("ward", true).value_or(std::vector<std::string>()).size(), 2u);
}

TEST_F(Authentication, AreAskedOnceForADeletion) {
  ASSERT_TRUE(server_->rooms().create("annex", nullptr));
  people_.append_access("role bob operator annex");
  server_->rooms().authorizer->look();
  auto bob = RoomAdminClient::reach(address(), 5s, {}, people_.credentials("bob", Role::observer, "*"));
  ASSERT_TRUE(bob.has_value()) << bob.error().message;
  const AuthorizerCounts before = server_->connection_health().authorizer;
  EXPECT_EQ(bob->remove("ward", false).error().code, ErrorCode::denied);
  EXPECT_EQ(server_->connection_health().authorizer.refused, before.refused + 1);
  EXPECT_TRUE(bob->remove("annex", false)) << "the role is another one in that room";
  EXPECT_EQ(server_->connection_health().authorizer.refused, before.refused + 1);
}

TEST_F(Authentication, ShowNothingOfARoomInWhichOneIsNoInstructor) {
  people_.append_access("role ina trainee theatre");
  server_->rooms().authorizer->look();
  const auto ina = join(people_.credentials("ina", Role::instructor, "*"));
  ASSERT_TRUE(ina.has_value()) << ina.error().message;
  v1::DemonstrateRequest shown;
  shown.set_author(ina->author.value);
  shown.set_room("theatre");
  shown.set_speed(1);
  v1::DemonstrateResponse response;
  grpc::ClientContext context;
  const grpc::Status status = v1::PeopleService::NewStub(ina->channel)->Demonstrate(&context, shown, &response);
  EXPECT_EQ(status.error_code(), StatusCode::PERMISSION_DENIED) << status.error_message();
  EXPECT_THAT(status.error_message(), HasSubstr("a trainee may not call Demonstrate"));
}

// The datagrams use the address of the connections, however it was written.
TEST(AuthenticationAddress, HasTheFastPathWhereverTheServerListens) {
  test::People people;
  people.certs({"server", "127.0.0.1", "::1", "localhost"});
  const test::TempDir dir;
  const Case bone = test::test_block();
  ASSERT_TRUE(bone.save(dir / "case"));
  int heard = 0;
  for (const std::string host : {"127.0.0.1", "localhost", "127.1", "[::1]", "[0:0:0:0:0:0:0:1]"}) {
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{bone, dir / "case"}}});
    ASSERT_TRUE(rooms->create("ward", nullptr));
    const auto server = RoomServer::start(std::move(rooms), host + ":0", {.certificates = people.server()});
    if (!server) {
      EXPECT_EQ(host.front(), '[') << "the machine may have no IPv6: " << server.error().message;
      continue;
    }
    EXPECT_NE((*server)->link_port(), 0) << host;
    // By the names in the certificate.
    const std::string name = host == "localhost" ? host : host.front() == '[' ? "[::1]" : "127.0.0.1";
    const std::string at = name + (*server)->address().substr((*server)->address().rfind(':'));
    test::Surgeon surgeon(at, dir / "cache", "", "ward", people.credentials("sue", Role::trainee, "ward"));
    EXPECT_TRUE(test::wait_until([&] { return surgeon.session().fast_path().alive; }, test::kPatience)) << host;
    ++heard;
  }
  EXPECT_GE(heard, 3);
}

// A firewall lets one known port through.
TEST(AuthenticationAddress, HasTheFastPathAtTheRequestedPort) {
  test::People people;
  const test::TempDir dir;
  const Case bone = test::test_block();
  ASSERT_TRUE(bone.save(dir / "case"));
  const auto start = [&](const std::string& udp_listen, bool with_certificates = true) {
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{bone, dir / "case"}}});
    EXPECT_TRUE(rooms->create("ward", nullptr));
    return RoomServer::start(
        std::move(rooms), "127.0.0.1:0",
        {.certificates = with_certificates ? people.server() : std::filesystem::path(), .udp_listen = udp_listen});
  };
  // The system chose this port for another socket, and it is free again.
  const std::uint16_t port = UdpPort::open({}).value()->local().port;
  const std::string at = "127.0.0.1:" + std::to_string(port);
  const auto server = start(at);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  EXPECT_EQ((*server)->link_port(), port);
  test::Surgeon surgeon((*server)->address(), dir / "cache", "", "ward",
                        people.credentials("sue", Role::trainee, "ward"));
  EXPECT_TRUE(test::wait_until([&] { return surgeon.session().fast_path().alive; }, test::kPatience));
  // A second server finds the port in use, before it prepares anything.
  const auto second = start(at);
  ASSERT_FALSE(second.has_value());
  EXPECT_THAT(second.error().message, HasSubstr("--udp-listen " + at));
  EXPECT_THAT(second.error().message, HasSubstr("give an address of this machine and a free port"));
  EXPECT_FALSE(RoomServer::check_listen("127.0.0.1:0", {.certificates = people.server(), .udp_listen = at}));
  EXPECT_THAT(start("somewhere:1").error().message, HasSubstr("no numeric address"));
  EXPECT_THAT(start("0.0.0.0:0", false).error().message, HasSubstr("--certificates DIR"));
}

// A surgeon of the ward at work, and somebody else who loses their access.
class AuthenticationAtWork : public Authentication {
 protected:
  void SetUp() override {
    Authentication::SetUp();
    surgeon_ = std::make_unique<test::Surgeon>(address(), dir_ / "cache", "", "ward",
                                               people_.credentials("sue", Role::trainee, "ward"));
    ASSERT_TRUE(test::wait_until([&] { return surgeon_->complete(); }, test::kPatience));
  }
  // She cuts, and expects the cut to arrive in the session that she began with.
  void expect_undisturbed() {
    const std::uint64_t before = surgeon_->own();
    Cut cut = test::strokes(surgeon_->author(), static_cast<int>(before) + 1, 7).back();
    cut.lease_epoch = surgeon_->lease();
    ASSERT_TRUE(surgeon_->session().send(cut));
    EXPECT_TRUE(test::wait_until([&] { return surgeon_->own() == before + 1; }, test::kPatience));
    EXPECT_EQ(surgeon_->interruptions(), 0);
    EXPECT_EQ(surgeon_->lost(), "");
  }
  // Watches the ward's surface until the stream ends.
  struct Watcher {
    explicit Watcher(wire::JoinedRoom joined) : room(std::move(joined)) {
      v1::WatchMeshRequest request;
      request.set_author(room.author.value);
      stream = v1::WatchService::NewStub(room.channel)->WatchMesh(&context, request);
      EXPECT_TRUE(stream->Read(&message));
      end = std::async(std::launch::async, [this] {
        while (stream->Read(&message)) {
        }
        return stream->Finish();
      });
    }
    ~Watcher() { context.TryCancel(); }
    bool over(std::chrono::milliseconds patience) { return end.wait_for(patience) == std::future_status::ready; }
    wire::JoinedRoom room;
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReader<v1::WatchMeshResponse>> stream;
    v1::WatchMeshResponse message;
    std::future<grpc::Status> end;
  };

  std::unique_ptr<test::Surgeon> surgeon_;
};

TEST_F(AuthenticationAtWork, EndTheStreamsOfSomebodyWhoIsRevoked) {
  auto ben = join(people_.credentials("ben", Role::observer, "ward"));
  ASSERT_TRUE(ben.has_value()) << ben.error().message;
  Watcher watcher(*ben);
  EXPECT_FALSE(watcher.over(600ms));
  people_.certs({"revoke", "ben"});
  ASSERT_TRUE(watcher.over(10s));
  const grpc::Status end = watcher.end.get();
  EXPECT_EQ(end.error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(end.error_message(), HasSubstr("revoked"));
  EXPECT_NE(refusal(people_.credentials("ben", Role::observer, "ward")), "");
  expect_undisturbed();
}

// A client that does not read receives no reason, but its streams end too, with everything that waits to be sent.
TEST_F(AuthenticationAtWork, EndTheStreamsOfSomebodyWhoDoesNotRead) {
  auto ben = join(people_.credentials("ben", Role::observer, "ward"));
  ASSERT_TRUE(ben.has_value()) << ben.error().message;
  const std::size_t others = server_->connection_health().authorizer.streams;
  std::filesystem::resize_file(dir_ / "case" / "bone.vdb", 32 << 20);  // Larger than what any connection buffers.
  grpc::ClientContext context;
  v1::GetCaseRequest request;
  request.set_case_hash(wire::to_wire(test::test_block().hash()));
  const auto unread = v1::RoomService::NewStub(ben->channel)->GetCase(&context, request);
  ASSERT_TRUE(
      test::wait_until([&] { return server_->connection_health().authorizer.streams == others + 1; }, test::kPatience));
  EXPECT_FALSE(test::wait_until([&] { return server_->connection_health().authorizer.streams == others; }, 2s))
      << "the stream would go on by itself";
  people_.certs({"revoke", "ben"});
  EXPECT_TRUE(test::wait_until([&] { return server_->connection_health().authorizer.streams == others; }, 10s));
  context.TryCancel();
  expect_undisturbed();
}

// A newer program of the same person, and the older one that reconnects after it. In any order in the queue, the newer
// one stays.
TEST_F(Authentication, KeepTheNewestProgramAlsoInAQueue) {
  const wire::ClientCredentials credentials = people_.credentials("ben", Role::observer, "ward");
  const auto older = join(credentials);
  ASSERT_TRUE(older.has_value()) << older.error().message;
  std::promise<void> go_on, held;
  (*server_->rooms().find("ward"))->runtime().run_slowly([&, wait = go_on.get_future().share()] {
    held.set_value();
    wait.wait();
  });
  held.get_future().wait();
  const auto admitted = [&] { return server_->connection_health().authorizer.admitted; };
  const auto queue = [&](auto ask) {
    const std::uint64_t before = admitted();
    auto answer = std::async(std::launch::async, std::move(ask));
    EXPECT_TRUE(test::wait_until([&] { return admitted() > before; }, test::kPatience));
    std::this_thread::sleep_for(200ms);  // Long enough to move from the authorizer into the queue.
    return answer;
  };
  auto newer = queue([&] { return join(credentials); });
  auto again = queue([&] { return wire::join_again(*older, wire::ClientKind::viewer, {}); });
  go_on.set_value();
  const auto newest = newer.get();
  ASSERT_TRUE(newest.has_value()) << newest.error().message;
  const auto late = again.get();
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::denied) << late.error().message;
  EXPECT_TRUE(wire::join_again(*newest, wire::ClientKind::viewer, {}));
}

TEST_F(AuthenticationAtWork, EndTheSessionOfSomebodyWhoseRoleIsTakenAway) {
  test::Surgeon ben(address(), dir_ / "cache", "", "ward", people_.credentials("ben", Role::collaborator, "ward"));
  ASSERT_TRUE(test::wait_until([&] { return ben.complete(); }, test::kPatience));
  people_.append_access("role ben observer ward");
  ASSERT_TRUE(test::wait_until([&] { return !ben.lost().empty(); }, 10s));
  EXPECT_THAT(ben.lost(), HasSubstr("an observer may not call Session"));
  EXPECT_EQ(ben.interruptions(), 0) << "the session does not reconnect by itself";
  EXPECT_TRUE(join(people_.credentials("ben", Role::collaborator, "ward"))) << "the person may still watch";
  expect_undisturbed();
}

TEST_F(AuthenticationAtWork, EndTheStreamsOfATicketThatExpires) {
  auto ben = join({.certificates = people_.person("ben"), .ticket = people_.ticket("ben", "ward", Role::observer, 3s)});
  ASSERT_TRUE(ben.has_value()) << ben.error().message;
  Watcher watcher(*ben);
  ASSERT_TRUE(watcher.over(15s));
  EXPECT_THAT(watcher.end.get().error_message(), HasSubstr("expired"));
  expect_undisturbed();
}

TEST_F(AuthenticationAtWork, EndTheOlderSessionOfAPerson) {
  const wire::ClientCredentials credentials = people_.credentials("ben", Role::observer, "ward");
  const auto first = join(credentials);
  Watcher older(*first);
  const auto second = join(credentials);
  ASSERT_TRUE(second.has_value());
  Watcher newer(*second);
  ASSERT_TRUE(older.over(10s));
  EXPECT_THAT(older.end.get().error_message(), HasSubstr("newer session of ben"));
  EXPECT_FALSE(newer.over(600ms));
  EXPECT_EQ(wire::join_again(*first, wire::ClientKind::viewer, {}).error().code, ErrorCode::denied);
  EXPECT_TRUE(wire::join_again(*second, wire::ClientKind::viewer, {}));
  expect_undisturbed();
}

// A person may have a console beside their viewer.
TEST_F(AuthenticationAtWork, AllowAConsoleBesideTheViewer) {
  const wire::ClientCredentials credentials = people_.credentials("ina", Role::instructor, "ward");
  const auto window = join(credentials);
  ASSERT_TRUE(window.has_value());
  Watcher seen(*window);
  const auto first = join(credentials, wire::ClientKind::console);
  ASSERT_TRUE(first.has_value()) << first.error().message;
  Watcher older(*first);
  EXPECT_FALSE(older.over(600ms));
  const auto second = join(credentials, wire::ClientKind::console);
  ASSERT_TRUE(second.has_value());
  Watcher newer(*second);
  ASSERT_TRUE(older.over(10s));
  EXPECT_THAT(older.end.get().error_message(), HasSubstr("newer session of ina"));
  EXPECT_FALSE(newer.over(600ms));
  EXPECT_FALSE(seen.over(1ms));
  EXPECT_TRUE(wire::join_again(*window, wire::ClientKind::viewer, {}));
  EXPECT_EQ(wire::join_again(*window, wire::ClientKind::console, {}).error().code, ErrorCode::denied)
      << "a number is for one kind of program";
  expect_undisturbed();
}

TEST_F(AuthenticationAtWork, StandWhatIsTooLargeOrNoMessage) {
  const wire::ClientCredentials credentials = people_.credentials("ben", Role::trainee, "ward");
  const auto line = channel(credentials);
  const std::map<std::string, std::string> metadata{{"osteon-room-bin", "ward"},
                                                    {"osteon-ticket", wire::ticket_text(credentials)}};
  const std::string large(5 * 1024 * 1024, 'x'), nonsense = "\xff\xff\xff\xff\xff\x01\x02";
  for (const char* method : {"/osteon.v1.RoomService/Join", "/osteon.v1.RoomService/AddTool",
                             "/osteon.v1.WatchService/WatchMesh", "/osteon.v1.CuttingService/Session"}) {
    const grpc::Slice too_large(large), no_message(nonsense);
    EXPECT_EQ(call(line, method, ByteBuffer(&too_large, 1), metadata).status.error_code(),
              StatusCode::RESOURCE_EXHAUSTED)
        << method;
    const Called malformed = call(line, method, ByteBuffer(&no_message, 1), metadata);
    EXPECT_FALSE(malformed.answered) << method;
    // If gRPC cannot read a single request, it reports that there was none.
    EXPECT_THAT(malformed.status.error_code(), testing::AnyOf(StatusCode::INVALID_ARGUMENT, StatusCode::UNIMPLEMENTED))
        << method << malformed.status.error_message();
  }
  // More metadata than any call needs.
  auto more = metadata;
  more["osteon-ticket"] = std::string(100'000, 'a');
  EXPECT_FALSE(call(line, "/osteon.v1.RoomService/GetStatus", {}, more).status.ok());
  expect_undisturbed();
}

TEST_F(AuthenticationAtWork, RefuseFurtherConnectionsAndAdmitThemAgain) {
  const ListenerCounts before = server_->connection_health().connections;
  std::vector<std::unique_ptr<RawConnection>> strangers;
  for (std::size_t i = 0; i < 2 * kMostConnections; ++i)
    strangers.push_back(std::make_unique<RawConnection>(address()));
  ASSERT_TRUE(test::wait_until([&] { return server_->connection_health().connections.refused > before.refused; }, 10s));
  EXPECT_LE(server_->connection_health().connections.open, kMostConnections);
  expect_undisturbed();
  strangers.clear();
  EXPECT_TRUE(
      test::wait_until([&] { return server_->connection_health().connections.open <= before.open; }, test::kPatience))
      << "closed connections are still counted";
  EXPECT_TRUE(test::wait_until([&] { return refusal(people_.credentials("ben", Role::observer, "ward")).empty(); },
                               test::kPatience));
}

}  // namespace
}  // namespace osteon
