// Demonstrations and uploads end with the right of the person who started them. Sessions go on beyond the age of their
// connection.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "osteon/v1/cases.grpc.pb.h"
#include "osteon/v1/people.grpc.pb.h"
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
namespace fs = std::filesystem;

class GoingOn : public ::testing::Test {
 protected:
  void start(ConnectionOptions doors = {}, UploadQuota quota = {}, const fs::path& checker = "/bin/false") {
    const Case bone = test::test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    auto store = CaseRepository::open(dir_ / "cases", checker, quota);
    ASSERT_TRUE(store.has_value()) << store.error().message;
    store_ = std::move(*store);
    RoomsOptions options{.cases = {{bone, dir_ / "case"}}, .folder = dir_ / "rooms", .case_repository = store_};
    auto rooms = std::make_unique<Rooms>(std::move(options));
    fs::create_directories(dir_ / "rooms");
    ASSERT_TRUE(rooms->create("ward", nullptr));
    doors.certificates = people_.server();
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0", doors);
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
  }
  RoomRuntime& host() { return (*server_->rooms().find("ward"))->runtime(); }
  wire::JoinedRoom join(const wire::ClientCredentials& credentials) {
    auto joined =
        wire::join_room(server_->address(), wire::ClientKind::viewer, "whatever", 5s, {}, "ward", credentials);
    EXPECT_TRUE(joined.has_value()) << joined.error().message;
    return joined.value();
  }
  std::unique_ptr<test::Surgeon> surgeon(const std::string& name) {
    const wire::ClientCredentials credentials = people_.credentials(name, Role::trainee, "ward");
    auto one = std::make_unique<test::Surgeon>(server_->address(), dir_ / "cache", "", "ward", credentials);
    EXPECT_TRUE(test::wait_until([&] { return one->complete(); }, test::kPatience));
    return one;
  }
  // Makes its next strokes, and waits until they are decided.
  void cut(test::Surgeon& by, int count) {
    const std::uint64_t before = by.own();
    std::vector<Cut> cuts = test::strokes(by.author(), static_cast<int>(before) + count, 7);
    for (std::size_t i = before; i < cuts.size(); ++i) {
      ASSERT_TRUE(test::wait_until([&] { return by.stands(); }, test::kPatience));
      cuts[i].lease_epoch = by.lease();
      ASSERT_TRUE(test::wait_until([&] { return by.session().send(cuts[i]); }, test::kPatience));
    }
    const std::uint64_t after = before + static_cast<std::uint64_t>(count);
    ASSERT_TRUE(test::wait_until([&] { return by.own() == after; }, test::kPatience)) << by.rejected();
  }

  test::TempDir dir_;
  test::People people_;
  std::shared_ptr<CaseRepository> store_;
  std::unique_ptr<RoomServer> server_;
};

TEST_F(GoingOn, ADemonstrationEndsWithTheRightOfWhoStartedIt) {
  start();
  const auto sue = surgeon("sue");
  for (int i = 0; i < 10; ++i) cut(*sue, 1);  // Each in a tick of its own.
  const auto show = [&](const wire::JoinedRoom& by) {
    v1::DemonstrateRequest request;
    request.set_author(by.author.value);
    request.set_of_author(sue->author().value);
    request.set_speed(0.001);  // It takes far longer than this test.
    v1::DemonstrateResponse response;
    grpc::ClientContext context;
    const grpc::Status status = v1::PeopleService::NewStub(by.channel)->Demonstrate(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.demonstrator();
  };
  const auto end = [&](const wire::JoinedRoom& by, std::uint64_t which) {
    v1::EndDemonstrationRequest request;
    request.set_author(by.author.value);
    request.set_demonstrator(which);
    v1::EndDemonstrationResponse response;
    grpc::ClientContext context;
    return v1::PeopleService::NewStub(by.channel)->EndDemonstration(&context, request, &response);
  };
  const auto ina = join(people_.credentials("ina", Role::instructor, "ward")),
             ira = join(people_.credentials("ira", Role::instructor, "ward")),
             ida = join(people_.credentials("ida", Role::instructor, "ward"));
  const std::uint64_t of_ina = show(ina), of_ira = show(ira), of_ida = show(ida);
  const auto sessions = [&] { return host().health().sessions; };
  ASSERT_EQ(sessions(), 4u);
  people_.append_access("role ina trainee ward");
  EXPECT_TRUE(test::wait_until([&] { return sessions() == 3; }, test::kPatience));
  people_.certs({"revoke", "ira"});
  EXPECT_TRUE(test::wait_until([&] { return sessions() == 2; }, test::kPatience));
  EXPECT_THAT(end(ida, of_ina).error_message(), HasSubstr("may not call Demonstrate"));
  const grpc::Status revoked = end(ida, of_ira);
  EXPECT_EQ(revoked.error_code(), StatusCode::NOT_FOUND);
  EXPECT_THAT(revoked.error_message(), HasSubstr("revoked"));
  // The demonstrations of others go on until they are ended.
  EXPECT_EQ(sessions(), 2u);
  EXPECT_TRUE(end(ida, of_ida).ok());
  cut(*sue, 1);
}

// A newer viewer of the same person replaces the older one. What the older one has started goes on.
TEST_F(GoingOn, ADemonstrationGoesOnWhenItsStarterReconnects) {
  start();
  const auto sue = surgeon("sue");
  for (int i = 0; i < 10; ++i) cut(*sue, 1);
  const wire::ClientCredentials credentials = people_.credentials("ina", Role::instructor, "ward");
  const auto before = join(credentials);
  v1::DemonstrateRequest request;
  request.set_author(before.author.value);
  request.set_speed(0.001);
  v1::DemonstrateResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(v1::PeopleService::NewStub(before.channel)->Demonstrate(&context, request, &response).ok());
  const auto after = join(credentials);
  EXPECT_NE(after.author, before.author);
  server_->rooms().authorizer->look();
  v1::EndDemonstrationRequest ending;
  ending.set_author(after.author.value);
  ending.set_demonstrator(response.demonstrator());
  v1::EndDemonstrationResponse ended;
  grpc::ClientContext again;
  const grpc::Status status = v1::PeopleService::NewStub(after.channel)->EndDemonstration(&again, ending, &ended);
  EXPECT_TRUE(status.ok()) << status.error_message();
}

// An upload as a client makes it, chunk by chunk.
struct Sending {
  Sending(const std::string& address, const wire::ClientCredentials& credentials) {
    context.set_deadline(std::chrono::system_clock::now() + 2 * test::kPatience);  // In case nobody ends it.
    context.AddMetadata("osteon-ticket", wire::ticket_text(credentials));
    const auto channel = grpc::CreateChannel(address, wire::channel_credentials(credentials, address).value());
    writer = v1::CaseService::NewStub(channel)->UploadCase(&context, &response);
  }
  bool send() {
    v1::UploadCaseRequest piece;
    piece.set_data(std::string(1000, 'x'));
    return writer->Write(piece);
  }
  // Goes on until the server takes no more.
  grpc::Status send_until_the_end() {
    EXPECT_TRUE(test::wait_until([&] { return !send(); }, test::kPatience));
    return writer->Finish();
  }
  grpc::ClientContext context;
  v1::UploadCaseResponse response;
  std::unique_ptr<grpc::ClientWriter<v1::UploadCaseRequest>> writer;
};

class Uploads : public GoingOn {
 protected:
  [[nodiscard]] bool nothing_is_left() const {
    return test::wait_until([&] { return fs::is_empty(dir_ / "cases"); }, test::kPatience);
  }
};

TEST_F(Uploads, EndWithTheRightOfWhoSendsThem) {
  start();
  const wire::ClientCredentials otto = people_.credentials("otto", Role::operator_, "*");
  Sending sending(server_->address(), otto);
  ASSERT_TRUE(sending.send());
  ASSERT_TRUE(test::wait_until([&] { return !fs::is_empty(dir_ / "cases"); }, test::kPatience));
  people_.certs({"revoke", "otto"});
  const grpc::Status end = sending.send_until_the_end();
  EXPECT_EQ(end.error_code(), StatusCode::UNAUTHENTICATED) << end.error_message();
  EXPECT_THAT(end.error_message(), HasSubstr("revoked"));
  EXPECT_TRUE(nothing_is_left());
}

TEST_F(Uploads, EndAlsoDuringTheirValidation) {
  // A validation that takes long.
  const fs::path checker = dir_ / "checker";
  std::ofstream(checker) << "#!/bin/sh\nexec sleep 60\n";
  fs::permissions(checker, fs::perms::owner_all);
  start({}, {}, checker);
  ASSERT_TRUE(pack_case(dir_ / "case", dir_ / "case.zip"));
  Sending sending(server_->address(), people_.credentials("otto", Role::operator_, "*"));
  v1::UploadCaseRequest whole;
  whole.set_data(content(dir_ / "case.zip"));
  ASSERT_LE(whole.data().size(), 1u << 20);
  ASSERT_TRUE(sending.writer->Write(whole));
  ASSERT_TRUE(sending.writer->WritesDone());
  const auto incoming = [&] {
    const fs::recursive_directory_iterator all(dir_ / "cases");
    return std::ranges::any_of(all, [](const auto& one) { return one.is_directory(); });
  };
  ASSERT_TRUE(test::wait_until(incoming, test::kPatience));
  people_.append_access("role otto instructor");
  const grpc::Status end = sending.writer->Finish();
  EXPECT_EQ(end.error_code(), StatusCode::PERMISSION_DENIED) << end.error_message();
  EXPECT_THAT(end.error_message(), HasSubstr("an instructor may not call UploadCase"));
  EXPECT_TRUE(nothing_is_left());
}

TEST_F(Uploads, EndIfNothingIsReceivedOrTheyTakeTooLong) {
  start({}, {.idle = 300ms, .sending = 1500ms});
  const wire::ClientCredentials otto = people_.credentials("otto", Role::operator_, "*");
  Sending silent(server_->address(), otto);
  ASSERT_TRUE(silent.send());
  const grpc::Status idle = silent.writer->Finish();
  EXPECT_EQ(idle.error_code(), StatusCode::DEADLINE_EXCEEDED) << idle.error_message();
  EXPECT_THAT(idle.error_message(), HasSubstr("nothing of the upload came"));
  Sending slow(server_->address(), otto);
  const grpc::Status late = slow.send_until_the_end();
  EXPECT_EQ(late.error_code(), StatusCode::DEADLINE_EXCEEDED) << late.error_message();
  EXPECT_THAT(late.error_message(), HasSubstr("took longer"));
  EXPECT_TRUE(nothing_is_left());
}

TEST_F(GoingOn, ASessionDoesNotNoticeTheAgeOfItsConnection) {
  start({.connection_age = 400ms});
  const auto sue = surgeon("sue");
  cut(*sue, 5);
  const std::uint64_t before = server_->connection_health().connections.accepted;
  // The calls use newer connections, each with a handshake of its own.
  EXPECT_TRUE(test::wait_until(
      [&] {
        std::this_thread::sleep_for(20ms);  // A client that asks without a pause is cut off.
        EXPECT_GT(test::status_of(sue->session().room()).room_seq(), 0u);
        return server_->connection_health().connections.accepted >= before + 3;
      },
      test::kPatience));
  cut(*sue, 5);
  EXPECT_EQ(sue->interruptions(), 0);
  EXPECT_EQ(sue->lost(), "");
}

TEST_F(GoingOn, ASessionReconnectsAfterTheLongestPossibleAge) {
  start({.connection_age = 400ms, .longest_session = 400ms});
  const auto sue = surgeon("sue");
  for (int i = 0; sue->interruptions() < 2 && i < 1000 && !HasFatalFailure(); ++i) cut(*sue, 1);
  EXPECT_GE(sue->interruptions(), 2);
  EXPECT_EQ(sue->lost(), "");
  EXPECT_TRUE(test::wait_until([&] { return sue->stands() && test::settled(host(), {sue.get()}); }, test::kPatience));
  EXPECT_EQ(wire::to_wire(sue->hash()), test::status_of(sue->session().room()).field_hash());
}

// If the authority of a person is no longer trusted, all calls are refused that begin after their connection has
// reached its age.
TEST_F(GoingOn, WhoseAuthorityIsTrustedNoMoreIsOutWithTheAgeOfTheConnection) {
  test::People others;
  const fs::path guest = others.person("guest");
  const std::string own = content(people_.server() / "ca.pem");
  fs::copy_file(people_.server() / "ca.pem", guest / "ca.pem", fs::copy_options::overwrite_existing);
  std::ofstream(people_.server() / "ca.pem") << own << content(others.server() / "ca.pem");
  start({.connection_age = 400ms});
  const auto sue = surgeon("sue");
  const wire::JoinedRoom joined =
      join({.certificates = guest, .ticket = people_.ticket("guest", "ward", Role::observer)});
  std::ofstream(dir_ / "own.pem") << own;
  fs::rename(dir_ / "own.pem", people_.server() / "ca.pem");
  const auto refused = [&] {
    v1::GetStatusResponse response;
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + 2s);
    return v1::RoomService::NewStub(joined.channel)->GetStatus(&context, {}, &response).error_code() ==
           StatusCode::UNAVAILABLE;
  };
  EXPECT_TRUE(test::wait_until(refused, test::kPatience));
  cut(*sue, 3);
  EXPECT_EQ(sue->interruptions(), 0);
}

}  // namespace
}  // namespace osteon
