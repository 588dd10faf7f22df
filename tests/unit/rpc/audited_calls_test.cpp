// The audit log of a server that other people can reach: who did what, and who was refused, by certificate, ticket and
// address. The program's own commands read it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "common/access/role_table.hpp"
#include "common/wire/room_client.hpp"
#include "server/auth/person_certificate.hpp"
#include "server/cli/room_admin_client.hpp"
#include "server/rpc/audited_calls.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/room/cuts.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using test::content;
using test::program;
using test::run;
using testing::HasSubstr;
using testing::Not;

constexpr std::chrono::milliseconds kLong = 60s;

class Audited : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(test::test_block().save(dir_ / "case"));
    server_.emplace(
        program("osteon-server"),
        std::vector<std::string>{"--case", dir_ / "case", "--rooms", rooms(), "--certificates", people_.server(),
                                 "--listen", "127.0.0.1:0", "--address-file", dir_ / "address"});
    const auto address = test::wait_for_address(dir_ / "address", kLong);
    ASSERT_TRUE(address.has_value()) << server_->err();
    address_ = *address;
    olga_ = come("olga", Role::operator_, std::string(kAnyRoom));
  }
  std::filesystem::path rooms() const { return dir_ / "rooms"; }
  std::filesystem::path log() const { return rooms() / "audit.log"; }

  struct Someone {
    std::string name{};
    wire::ClientCredentials credentials{};
    std::string serial{}, ticket{};
  };
  Someone come(const std::string& name, Role role, const std::string& room) {
    Someone one{.name = name, .credentials = people_.credentials(name, role, room)};
    one.serial = read_person_certificate(content(one.credentials.certificates / "person.pem")).value().serial;
    std::string text = content(one.credentials.ticket);
    text.erase(text.find_last_not_of('\n') + 1);
    one.ticket = to_hex(open_ticket(text, check_key_of(people_.key())).value().id);
    return one;
  }
  RoomAdminClient as(const Someone& one) { return RoomAdminClient::reach(address_, 5s, {}, one.credentials).value(); }

  test::RunResult audit(const std::vector<std::string>& arguments) {
    std::vector<std::string> all{"audit"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return run(program("osteon-server"), all);
  }
  std::vector<json> shown(const std::vector<std::string>& filters = {}) {
    std::vector<std::string> all{"show", log(), "--json"};
    all.insert(all.end(), filters.begin(), filters.end());
    const test::RunResult result = audit(all);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<json> entries;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) entries.push_back(json::parse(line));
    return entries;
  }
  // The record of this action and result, once it is written.
  json find(const std::string& action, const std::string& result, const std::string& person) {
    json found;
    EXPECT_TRUE(test::wait_until(
        [&] {
          for (const json& one : shown())
            if (one["action"] == action && one["result"] == result && one["person"] == person) found = one;
          return !found.is_null();
        },
        kLong))
        << action << " " << result << " by " << person;
    return found.is_null() ? json::object() : found;
  }
  static void expect_is(const json& entry, const Someone& who) {
    EXPECT_EQ(entry.value("person", ""), who.name);
    EXPECT_EQ(entry.value("certificate", ""), who.serial);
    EXPECT_EQ(entry.value("ticket", ""), who.ticket);
    EXPECT_EQ(entry.value("address", ""), "ipv4:127.0.0.1");
  }
  void verify_is_sound() {
    const test::RunResult result = audit({"verify", log()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("verdict:   sound"));
  }

  test::TempDir dir_;
  test::People people_;
  std::optional<test::Process> server_;
  std::string address_;
  Someone olga_;
};

TEST_F(Audited, SaysWhoMadeDeletedJoinedAndWasRefused) {
  ASSERT_TRUE(as(olga_).create("ward", ""));
  ASSERT_TRUE(as(olga_).create("hall", ""));
  ASSERT_TRUE(as(olga_).remove("ward", false));
  expect_is(find("CreateRoom", "ok", "olga"), olga_);
  const json deleted = find("DeleteRoom", "ok", "olga");
  expect_is(deleted, olga_);
  EXPECT_EQ(deleted.value("object", ""), "ward");

  // A role that may not make the call tries it several times.
  const Someone ivy = come("ivy", Role::instructor, "hall");
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(as(ivy).close("hall"));
  const json refused = find("CloseRoom", "refused", "ivy");
  expect_is(refused, ivy);
  EXPECT_EQ(refused.value("object", ""), "hall");
  EXPECT_EQ(refused.value("detail", ""), "role");
  // A role that may make the call, but the room belongs to another person: the handler checks that.
  EXPECT_FALSE(as(ivy).remove("hall", false));
  const json denied = find("DeleteRoom", "refused", "ivy");
  expect_is(denied, ivy);
  EXPECT_EQ(denied.value("detail", ""), "permission denied");

  // A refusal by a handler: there is no such room.
  EXPECT_FALSE(as(olga_).remove("nowhere", false));
  EXPECT_EQ(find("DeleteRoom", "failed", "olga").value("detail", ""), "not found");

  const Someone anna = come("anna", Role::trainee, "hall");
  ASSERT_TRUE(wire::join_room(address_, wire::ClientKind::viewer, "anna", 5s, {}, "hall", anna.credentials));
  const json joined = find("Join", "ok", "anna");
  expect_is(joined, anna);
  EXPECT_EQ(joined.value("object", ""), "hall");
  EXPECT_EQ(joined.value("detail", ""), "CLIENT_KIND_VIEWER author 1");

  // No ticket is shown in a handshake. A person on the revocation list is recorded by the name in the certificate.
  const Someone mallory = come("mallory", Role::trainee, "hall");
  people_.certs({"revoke", "mallory"});
  json revoked;
  ASSERT_TRUE(test::wait_until(
      [&] {
        auto line = RoomAdminClient::reach(address_, 1s, {}, mallory.credentials);
        if (line) (void)line->list();
        for (const json& one : shown({"--person", "mallory"}))
          if (one["detail"] == "revoked") revoked = one;
        return !revoked.is_null();
      },
      kLong));
  EXPECT_THAT(revoked.value("person", ""), HasSubstr("mallory"));
  EXPECT_EQ(revoked.value("certificate", ""), mallory.serial);
  EXPECT_THAT(revoked.value("address", ""), HasSubstr("ipv4:127.0.0.1"));

  // Without a certificate, only the address is known.
  EXPECT_FALSE(RoomAdminClient::reach(address_, 1s, {}, {}));
  EXPECT_THAT(find("handshake", "refused", "").value("address", ""), HasSubstr("ipv4:127.0.0.1"));

  ASSERT_EQ(server_->terminate(30s), 0) << server_->err();
  verify_is_sound();
  EXPECT_EQ(shown().front()["action"], "start");
  EXPECT_EQ(shown().back()["action"], "stop");
  EXPECT_EQ(shown({"--room", "ward"}).size(), 2u);
  EXPECT_EQ(shown({"--since", "2999-01-01"}).size(), 0u);
  const std::string text = content(log());
  for (const char* name : {"olga", "ivy", "anna", "mallory"}) EXPECT_THAT(text, Not(HasSubstr(name)));
  for (const char* file : {"audit.log", "audit.people"})
    EXPECT_EQ(std::filesystem::status(rooms() / file).permissions(), std::filesystem::perms(0600)) << file;
}

TEST_F(Audited, RecordsWhatCommandsDoToJournalsAndErases) {
  ASSERT_TRUE(as(olga_).create("hall", ""));
  const Someone anna = come("anna", Role::trainee, "hall");
  ASSERT_TRUE(wire::join_room(address_, wire::ClientKind::viewer, "anna", 5s, {}, "hall", anna.credentials));
  ASSERT_EQ(server_->terminate(30s), 0) << server_->err();
  const std::string journal = rooms() / "hall.journal";
  const auto command = [&](std::vector<std::string> arguments) {
    const test::RunResult result = run(program("osteon-server"), std::move(arguments));
    EXPECT_EQ(result.exit_code, 0) << result.err;
  };
  command({"export", journal, dir_ / "hall.jsonl"});
  command({"people", journal});
  EXPECT_EQ(shown().back()["action"], "export");
  EXPECT_EQ(shown().back()["object"], "hall.journal");
  EXPECT_THAT(shown().back().value("person", ""), testing::StartsWith("system:"));
  command({"key", "rotate", rooms() / "signing.key"});
  EXPECT_EQ(shown().back()["action"], "key-rotate");
  verify_is_sound();

  EXPECT_EQ(shown({"--person", "anna"}).size(), 1u);
  command({"erase-person", journal, "--person", "1"});
  EXPECT_EQ(shown().back()["action"], "erase-person");
  EXPECT_EQ(shown({"--person", "anna"}).size(), 0u);
  EXPECT_THAT(content(rooms() / "audit.people"), Not(HasSubstr("anna")));
  EXPECT_THAT(audit({"show", log()}).out,
              HasSubstr("Join hall: ok (CLIENT_KIND_VIEWER author 1)  by somebody who was erased"));
  command({"audit", "erase-person", log(), "--person", "olga"});
  EXPECT_THAT(content(rooms() / "audit.people"), Not(HasSubstr("olga")));
  verify_is_sound();

  // If the key is elsewhere, it has to be named. Otherwise the command reports that nothing was recorded.
  std::filesystem::rename(rooms() / "signing.key", dir_ / "signing.key");
  const std::size_t records = shown().size();
  const test::RunResult unseen = run(program("osteon-server"), {"export", journal, dir_ / "again.jsonl"});
  EXPECT_EQ(unseen.exit_code, 0);
  EXPECT_THAT(unseen.err, HasSubstr("note: this is not recorded in " + log().string()));
  EXPECT_EQ(shown().size(), records);
  command({"export", journal, dir_ / "third.jsonl", "--signing-key", dir_ / "signing.key"});
  EXPECT_EQ(shown().size(), records + 1);

  // A removed line is named.
  std::string text = content(log());
  const std::size_t end = text.find('\n') + 1;
  text.erase(end, text.find('\n', end) + 1 - end);
  std::ofstream(log(), std::ios::binary | std::ios::trunc) << text;
  const test::RunResult found = audit({"verify", log(), "--key", dir_ / "signing.key"});
  EXPECT_NE(found.exit_code, 0);
  EXPECT_THAT(found.err, HasSubstr("line 2: 1 records are missing before it"));
}

// Calls that only some roles may make are recorded, except those that are in the room's own journal or concern nobody.
TEST(AuditedCalls, AreAllThatOnlyInstructorsOrOperatorsMayMake) {
  const std::set<std::string_view> without{"Annotate", "ListRooms", "ListCases"};
  for (const CallRow& entry : call_rows()) {
    const bool is_everybodys = entry.roles.has(Role::trainee);
    if (!is_everybodys && !without.contains(call_name(entry.method)))
      EXPECT_TRUE(is_audited(entry.method)) << entry.method;
  }
}

}  // namespace
}  // namespace osteon
