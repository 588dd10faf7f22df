#include "server/auth/authorizer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>

#include "server/auth/connections.hpp"
#include "server/auth/person_certificate.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/content.hpp"
#include "tests/support/wait.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::content;
using testing::HasSubstr;

constexpr const char* kUndo = "/osteon.v1.RoomService/Undo";
constexpr const char* kWatch = "/osteon.v1.WatchService/WatchMesh";

class AuthorizerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { people_ = new test::People; }
  static void TearDownTestSuite() { delete people_; }
  void SetUp() override {
    std::ofstream(people_->server() / "access.txt") << "";
    Result<std::unique_ptr<Authorizer>> authorizer =
        Authorizer::open(people_->server(), refusals_, [this] { return UnixTime{std::chrono::seconds(now_)}; });
    ASSERT_TRUE(authorizer.has_value()) << authorizer.error().message;
    authorizer_ = std::move(*authorizer);
  }
  std::string certificate(const std::string& user) { return content(people_->person(user) / "person.pem"); }
  std::string ticket(const std::string& user, const std::string& room, Role role, std::chrono::seconds good_for = 1h) {
    return sign_ticket(make_ticket(room, user, role, UnixTime{std::chrono::seconds(now_)} + good_for).value(),
                       people_->key());
  }
  // The sentence of the refusal, with the word that it is counted under. Empty if the call is admitted.
  std::string refused(const std::string& user, const std::string& with, const std::string& room,
                      const std::string& method, bool is_known) {
    const auto caller =
        authorizer_->admit({.peer = shown(certificate(user)), .ticket = with, .room = room, .method = method});
    if (caller) return {};
    EXPECT_EQ(caller.error().is_known, is_known) << caller.error().sentence;
    return std::string(caller.error().reason) + ": " + caller.error().sentence;
  }
  Caller let_in(const std::string& user, Role role, const std::string& room = "ward") {
    const auto caller = authorizer_->admit({.peer = shown(certificate(user)),
                                            .ticket = ticket(user, room, role),
                                            .room = room,
                                            .method = "/osteon.v1.RoomService/GetStatus"});
    EXPECT_TRUE(caller.has_value()) << caller.error().sentence;
    return caller.value_or(Caller{});
  }

  static PeerClaims shown(std::string certificate) {
    return {.certificate_pem = std::move(certificate), .peer = {}, .address = {}};
  }
  bool let_in_with(const std::string& certificate) {
    const std::string text = ticket("anna", "ward", Role::trainee);
    return authorizer_->admit({.peer = shown(certificate), .ticket = text, .room = "ward", .method = kUndo})
        .has_value();
  }

  static test::People* people_;
  RefusalCounts refusals_;
  std::atomic<std::int64_t> now_ =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  std::unique_ptr<Authorizer> authorizer_;
};
test::People* AuthorizerTest::people_ = nullptr;

TEST_F(AuthorizerTest, ReadsWhoseACertificateIs) {
  const Result<PersonCertificate> anna = read_person_certificate(certificate("anna"));
  ASSERT_TRUE(anna.has_value()) << anna.error().message;
  EXPECT_EQ(anna->user, "anna");
  EXPECT_EQ(anna->serial.size() % 2, 0u);
  const std::int64_t days = (anna->ends.time_since_epoch().count() - now_) / 86400;
  EXPECT_GE(days, 363);
  EXPECT_LE(days, 366);
  // The server's own certificate names no person.
  EXPECT_THAT(read_person_certificate(content(people_->server() / "server.pem")).error().message,
              HasSubstr("osteon://person/"));
  for (const std::string& text : {std::string(), std::string("nonsense"), certificate("anna").substr(0, 300)})
    EXPECT_FALSE(read_person_certificate(text));
}

TEST_F(AuthorizerTest, AdmitsWhoHasBoth) {
  EXPECT_EQ(refused("anna", ticket("anna", "ward", Role::trainee), "ward", kUndo, true), "");
  EXPECT_EQ(refused("anna", ticket("anna", "*", Role::collaborator), "other", kUndo, true), "");
  EXPECT_EQ(refused("anna", ticket("anna", "ward", Role::trainee), "", kUndo, true), "");
  EXPECT_EQ(authorizer_->counts().admitted, 3u);
}

TEST_F(AuthorizerTest, SaysWhyNot) {
  EXPECT_THAT(refused("anna", "", "ward", kUndo, false), HasSubstr("ticket: no ticket"));
  EXPECT_THAT(refused("anna", "osteon1.x.y", "ward", kUndo, false), HasSubstr("malformed"));
  EXPECT_THAT(
      refused("anna",
              sign_ticket(make_ticket("ward", "anna", Role::trainee, UnixTime{2h + std::chrono::seconds(now_)}).value(),
                          new_ticket_key()),
              "ward", kUndo, false),
      HasSubstr("signature"));
  EXPECT_THAT(refused("anna", ticket("anna", "ward", Role::trainee, -1s), "ward", kUndo, false), HasSubstr("expired"));
  EXPECT_THAT(refused("anna", ticket("ben", "ward", Role::trainee), "ward", kUndo, true),
              HasSubstr("person: the ticket is for ben"));
  EXPECT_THAT(refused("anna", ticket("anna", "ward", Role::trainee), "other", kUndo, true), HasSubstr("room: "));
  EXPECT_THAT(refused("anna", ticket("anna", "ward", Role::observer), "ward", kUndo, true),
              HasSubstr("role: an observer may not call Undo"));
  EXPECT_THAT(refused("anna", ticket("anna", "ward", Role::instructor), "ward", "/osteon.v1.RoomService/Nothing", true),
              HasSubstr("call: "));
  EXPECT_FALSE(let_in_with(content(people_->server() / "server.pem")));
  EXPECT_FALSE(let_in_with(""));
  const auto counts = refusals_.counts();
  EXPECT_EQ(counts.at("ticket"), 4u);
  EXPECT_EQ(counts.at("certificate"), 2u);
  EXPECT_EQ(counts.at("role"), 1u);
  EXPECT_EQ(authorizer_->counts().refused, 10u);
}

TEST_F(AuthorizerTest, GoesByTheClock) {
  const std::string good = ticket("anna", "ward", Role::trainee, 10s);
  EXPECT_EQ(refused("anna", good, "ward", kUndo, true), "");
  now_ += 10;
  EXPECT_THAT(refused("anna", good, "ward", kUndo, false), HasSubstr("expired"));
  now_ += 400 * 86400;
  EXPECT_THAT(refused("anna", ticket("anna", "ward", Role::trainee), "ward", kUndo, false),
              HasSubstr("certificate: the certificate has expired"));
}

// OpenSSL's check of the chain and the authorizer's own check of every call end at the same second.
TEST_F(AuthorizerTest, ACertificateEndsInTheSecondInWhichTheHandshakeRefusesIt) {
  const std::string pem = certificate("anna");
  const Authorities authorities{.certificates = content(people_->server() / "ca.pem"), .revocation_lists = {}};
  const auto ends = read_person_certificate(pem)->ends;
  for (const std::chrono::seconds after : {-1s, 0s, 1s}) {
    now_ = (ends + after).time_since_epoch().count();
    const bool holds = check_client_chain(pem, authorities, ends + after).has_value();
    EXPECT_EQ(holds, after < 0s);
    const std::string why = refused("anna", ticket("anna", "ward", Role::trainee), "ward", kUndo, holds);
    EXPECT_EQ(why.empty(), holds) << after.count() << " s: " << why;
    EXPECT_EQ(why.find("the certificate has expired") != std::string::npos, !holds) << why;
  }
}

TEST_F(AuthorizerTest, TakesNoTicketThatIsValidForTooLong) {
  const std::string day = ticket("anna", "ward", Role::trainee, 24h), more = ticket("anna", "ward", Role::trainee, 26h);
  EXPECT_EQ(refused("anna", more, "ward", kUndo, true), "") << "the option allows it";
  authorizer_->set_most_ticket_life(24h);
  EXPECT_EQ(refused("anna", day, "ward", kUndo, true), "");
  EXPECT_EQ(refused("anna", more, "ward", kUndo, false),
            "ticket: the ticket is valid for 26 more hours, but this server accepts at most 24; ask for a "
            "shorter one");
  // A ticket does not contain the start of its validity, so the remaining time counts.
  now_ += 2 * 3600;
  EXPECT_EQ(refused("anna", more, "ward", kUndo, true), "");
  // The clock of the signer may be a little ahead.
  EXPECT_EQ(refused("anna", ticket("anna", "ward", Role::trainee, 24h + 59s), "ward", kUndo, true), "");
  EXPECT_THAT(refused("anna", ticket("anna", "ward", Role::trainee, 24h + 61s), "ward", kUndo, false),
              HasSubstr("25 more hours"));
}

TEST_F(AuthorizerTest, ReadsTheListWhileItRuns) {
  const std::string good = ticket("anna", "ward", Role::trainee), instead = ticket("ben", "ward", Role::trainee);
  people_->append_access("role anna observer ward");
  authorizer_->look();
  EXPECT_THAT(refused("anna", good, "ward", kUndo, true), HasSubstr("an observer may not"));
  EXPECT_EQ(refused("anna", good, "ward", kWatch, true), "");
  people_->append_access("revoke user anna");
  authorizer_->look();
  EXPECT_THAT(refused("anna", good, "ward", kWatch, false), HasSubstr("revoked"));
  EXPECT_EQ(refused("ben", instead, "ward", kUndo, true), "");
}

TEST_F(AuthorizerTest, ReadsTheKeysOfTicketsWhileItRuns) {
  const std::string old = ticket("anna", "ward", Role::trainee);
  const Caller anna = let_in("anna", Role::trainee);
  std::optional<Refusal> ended;
  std::atomic<int> calls = 0;
  const auto stream =
      authorizer_->enter(anna, "ward", AuthorId{}, kWatch, [&](const Refusal& why) { ended = why, ++calls; });
  ASSERT_TRUE(stream.has_value());
  people_->certs({"rotate-tickets"});
  EXPECT_THROW(people_->certs({"rotate-tickets"}), std::runtime_error) << "only one rotation at a time";
  authorizer_->look();
  const std::string fresh = ticket("anna", "ward", Role::trainee);
  EXPECT_EQ(refused("anna", old, "ward", kUndo, true), "");
  EXPECT_EQ(refused("anna", fresh, "ward", kUndo, true), "");
  EXPECT_EQ(calls, 0);
  people_->certs({"rotate-tickets", "--finish"});
  authorizer_->look();
  EXPECT_THAT(refused("anna", old, "ward", kUndo, false), HasSubstr("signature"));
  EXPECT_EQ(refused("anna", fresh, "ward", kUndo, true), "");
  ASSERT_TRUE(test::wait_until([&] { return calls == 1; }, 5s)) << "open streams with a ticket of the old key end too";
  EXPECT_THAT(ended->sentence, HasSubstr("the key that signed the ticket was replaced"));
  EXPECT_THROW(people_->certs({"rotate-tickets", "--finish"}), std::runtime_error) << "there is no rotation to finish";
}

TEST_F(AuthorizerTest, GoesOnWithTheKeysOfTicketsThatItHasWhereNewOnesAreWrong) {
  const std::filesystem::path file = people_->server() / "tickets.pub";
  const std::string good = ticket("anna", "ward", Role::trainee), keys = content(file);
  testing::internal::CaptureStdout();  // A program that has not opened its log writes it here.
  for (const std::string& wrong : {std::string("nonsense\n"), keys + "nonsense\n", std::string()}) {
    std::ofstream(file) << wrong;
    authorizer_->look();
    authorizer_->look();
    EXPECT_EQ(refused("anna", good, "ward", kUndo, true), "") << wrong;
  }
  std::filesystem::remove(file);
  authorizer_->look();
  EXPECT_EQ(refused("anna", good, "ward", kUndo, true), "");
  std::ofstream(file) << keys;
  authorizer_->look();
  const std::string log = testing::internal::GetCapturedStdout();
  EXPECT_THAT(log, HasSubstr("ticket keys were not read, and those before count on"));
  EXPECT_THAT(log, HasSubstr("line 2: "));
  EXPECT_EQ(refused("anna", good, "ward", kUndo, true), "");
}

TEST_F(AuthorizerTest, DoesNotOpenWithAWrongList) {
  people_->append_access("nonsense");
  EXPECT_THAT(Authorizer::open(people_->server(), refusals_).error().message, HasSubstr("access.txt:1"));
}

TEST_F(AuthorizerTest, NamesTheFileThatIsWrong) {
  const test::TempDir dir;
  for (const char* lacking : {"ca.pem", "server.pem", "server.key", "tickets.pub"}) {
    std::filesystem::remove_all(dir / "d");
    std::filesystem::copy(people_->server(), dir / "d");
    std::filesystem::remove(dir / "d" / lacking);
    EXPECT_THAT(Authorizer::open(dir / "d", refusals_).error().message, HasSubstr(lacking));
  }
  std::filesystem::remove_all(dir / "d");
  std::filesystem::copy(people_->server(), dir / "d");
  std::filesystem::copy(people_->person("anna") / "person.key", dir / "d" / "server.key",
                        std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(Authorizer::open(dir / "d", refusals_).error().message, HasSubstr("not that of the certificate"));
}

TEST_F(AuthorizerTest, WarnsOfSecretKeysThatOthersMayRead) {
  namespace fs = std::filesystem;
  const fs::path key = people_->server() / "server.key", proxy = people_->server() / "proxy.pem";
  const auto said = [&](fs::perms of_key) {
    fs::permissions(key, of_key);
    testing::internal::CaptureStdout();  // A program that has not opened its log writes it here.
    EXPECT_TRUE(Authorizer::open(people_->server(), refusals_));
    return testing::internal::GetCapturedStdout();
  };
  EXPECT_THAT(said(fs::perms(0600)), testing::Not(HasSubstr("READABLE SECRET KEY")));
  for (const int mode : {0644, 0640, 0604, 0620}) {
    const std::string log = said(fs::perms(mode));
    EXPECT_THAT(log, HasSubstr("READABLE SECRET KEY")) << std::oct << mode;
    EXPECT_THAT(log, HasSubstr("chmod 600 " + key.string())) << std::oct << mode;
    EXPECT_THAT(log, testing::Not(HasSubstr(proxy.string()))) << "that file is private";
  }
  fs::permissions(proxy, fs::perms(0644));
  EXPECT_THAT(said(fs::perms(0600)), HasSubstr("chmod 600 " + proxy.string()));
  fs::permissions(proxy, fs::perms(0600));
}

TEST_F(AuthorizerTest, KeepsAuthorsToTheirPeople) {
  const Caller anna = let_in("anna", Role::trainee), ben = let_in("ben", Role::trainee);
  (void)authorizer_->joined(anna, "ward", 1, AuthorId{1});
  (void)authorizer_->joined(anna, "ward", 2, AuthorId{2});
  (void)authorizer_->joined(ben, "ward", 1, AuthorId{3});
  EXPECT_TRUE(authorizer_->check_author(anna, "ward", AuthorId{1}));
  EXPECT_TRUE(authorizer_->check_author(anna, "ward", AuthorId{2}));
  EXPECT_TRUE(authorizer_->check_author(ben, "ward", AuthorId{3}));
  for (const auto author : {AuthorId{0}, AuthorId{3}, AuthorId{4}}) {
    ASSERT_FALSE(authorizer_->check_author(anna, "ward", author)) << author.value;
    EXPECT_EQ(authorizer_->check_author(anna, "ward", author).error().code, ErrorCode::denied);
  }
  EXPECT_FALSE(authorizer_->check_author(anna, "other", AuthorId{1}));
  EXPECT_TRUE(authorizer_->check_resume(anna, "ward", 1, AuthorId{1}));
  EXPECT_FALSE(authorizer_->check_resume(anna, "ward", 2, AuthorId{1}));
  EXPECT_FALSE(authorizer_->check_resume(ben, "ward", 1, AuthorId{1}));
  // A room that is opened again counts its authors anew, or goes on from its journal.
  authorizer_->forget_room("ward");
  EXPECT_FALSE(authorizer_->check_author(anna, "ward", AuthorId{1}));
  EXPECT_TRUE(authorizer_->check_resume(anna, "ward", 1, AuthorId{1}));
}

TEST_F(AuthorizerTest, ANewerSessionTakesThePlaceOfAnOlderOne) {
  const Caller anna = let_in("anna", Role::trainee), ben = let_in("ben", Role::trainee);
  (void)authorizer_->joined(anna, "ward", 1, AuthorId{1});
  (void)authorizer_->joined(ben, "ward", 1, AuthorId{2});
  std::string ended, bystander;
  const auto older =
      authorizer_->enter(anna, "ward", AuthorId{1}, kWatch, [&](const Refusal& why) { ended += why.sentence; });
  const auto others =
      authorizer_->enter(ben, "ward", AuthorId{2}, kWatch, [&](const Refusal& why) { bystander += why.sentence; });
  (void)authorizer_->joined(anna, "ward", 2, AuthorId{3});
  (void)authorizer_->joined(anna, "other", 1, AuthorId{1});
  EXPECT_EQ(ended, "") << "another kind of program, another room";
  (void)authorizer_->joined(anna, "ward", 1, AuthorId{4});
  EXPECT_THAT(ended, HasSubstr("newer session of anna"));
  EXPECT_EQ(bystander, "");
  EXPECT_FALSE(authorizer_->check_author(anna, "ward", AuthorId{1}));
  EXPECT_TRUE(authorizer_->check_author(anna, "ward", AuthorId{4}));
  EXPECT_FALSE(authorizer_->check_resume(anna, "ward", 1, AuthorId{1}))
      << "otherwise the two would end each other for ever";
  EXPECT_EQ(authorizer_->counts().displaced, 1u);
  (void)authorizer_->joined(anna, "ward", 1, AuthorId{4});
  EXPECT_EQ(authorizer_->counts().displaced, 1u);
}

TEST_F(AuthorizerTest, WhoReconnectsTooLateIsRefused) {
  const Caller anna = let_in("anna", Role::trainee);
  ASSERT_TRUE(authorizer_->joined(anna, "ward", 1, AuthorId{1}));
  EXPECT_TRUE(authorizer_->joined(anna, "ward", 1, AuthorId{1}, Authorizer::Coming::again));
  ASSERT_TRUE(authorizer_->check_resume(anna, "ward", 1, AuthorId{1}));
  // A newer program joins between the check and the result.
  ASSERT_TRUE(authorizer_->joined(anna, "ward", 1, AuthorId{2}));
  std::string ended;
  const auto newer =
      authorizer_->enter(anna, "ward", AuthorId{2}, kWatch, [&](const Refusal& why) { ended += why.sentence; });
  const auto late = authorizer_->joined(anna, "ward", 1, AuthorId{1}, Authorizer::Coming::again);
  ASSERT_FALSE(late);
  EXPECT_THAT(late.error().message, HasSubstr("newer session of anna"));
  EXPECT_EQ(ended, "");
  EXPECT_TRUE(authorizer_->check_author(anna, "ward", AuthorId{2}));
  EXPECT_FALSE(authorizer_->check_author(anna, "ward", AuthorId{1}));
}

TEST_F(AuthorizerTest, StopsWhoCallsMoreOftenThanAnybodyDoesByHand) {
  constexpr const char* kSay = "/osteon.v1.PeopleService/Say";
  const std::string annas = ticket("anna", "ward", Role::trainee), bens = ticket("ben", "ward", Role::trainee);
  std::string said;
  int let_in = 0;
  for (; let_in < 100'000 && said.empty(); ++let_in) said = refused("anna", annas, "ward", kSay, true);
  EXPECT_THAT(said, HasSubstr("rate: that is called too often"));
  EXPECT_GT(let_in, 20) << "a script may send many messages at once";
  EXPECT_EQ(refused("anna", annas, "ward", kWatch, true), "") << "the call is another one";
  EXPECT_EQ(refused("ben", bens, "ward", kSay, true), "") << "the person is another one";
  EXPECT_GE(refusals_.counts().at("rate"), 1u);
  // After a while the calls are admitted again.
  EXPECT_TRUE(test::wait_until([&] { return refused("anna", annas, "ward", kSay, true).empty(); }, 10s));
}

// As behind a proxy, whose connection to the server stays open.
TEST_F(AuthorizerTest, AsksWhoBeganTooManyCallsToWaitAMinute) {
  authorizer_->note_flood(shown(certificate("anna")));
  EXPECT_EQ(refused("anna", ticket("anna", "ward", Role::trainee), "ward", kWatch, true),
            "flood: too many calls came from you; wait a minute");
  EXPECT_EQ(refused("ben", ticket("ben", "ward", Role::trainee), "ward", kWatch, true), "")
      << "the person is another one";
}

// A client may begin thousands of calls, and close the connection before the first of them is checked.
TEST_F(AuthorizerTest, NotesTheFloodOfAConnectionThatIsGoneOnce) {
  static Connections none;  // It outlives the authorizer, whose thread checks it.
  authorizer_->set_connections(none);
  for (int call = 0; call < 1000; ++call) authorizer_->note_flood(shown(certificate("anna")));
  EXPECT_EQ(refusals_.counts().at("flood"), 1u);
  EXPECT_EQ(refused("anna", ticket("anna", "ward", Role::trainee), "ward", kWatch, true),
            "flood: too many calls came from you; wait a minute");
}

// An identity that is lost between the check of its owner and the beginning of its stream must not go unnoticed.
TEST_F(AuthorizerTest, ChecksTheIdentityAgainWhenAStreamBegins) {
  const Caller anna = let_in("anna", Role::trainee), ben = let_in("ben", Role::trainee);
  ASSERT_TRUE(authorizer_->joined(anna, "ward", 1, AuthorId{1}) && authorizer_->joined(ben, "ward", 1, AuthorId{2}));
  ASSERT_TRUE(authorizer_->check_author(anna, "ward", AuthorId{1}));
  const auto enter = [&](const Caller& who, AuthorId as) {
    const auto entered = authorizer_->enter(who, "ward", as, kWatch, [](const Refusal&) {});
    return entered ? std::string() : entered.error().sentence;
  };
  EXPECT_EQ(enter(anna, AuthorId{1}), "");
  EXPECT_THAT(enter(anna, AuthorId{2}), HasSubstr("author 2 is not yours"));
  ASSERT_TRUE(authorizer_->joined(anna, "ward", 1, AuthorId{3}));
  EXPECT_THAT(enter(anna, AuthorId{1}), HasSubstr("author 1 is not yours in this room, or no more"))
      << "a newer session replaced it";
  EXPECT_EQ(enter(anna, AuthorId{3}), "");
  EXPECT_EQ(enter(anna, {}), "") << "it has no author number";
  people_->append_access("role anna observer");
  authorizer_->look();
  EXPECT_THAT(enter(anna, AuthorId{3}), HasSubstr("your role has changed to observer"));
  EXPECT_THAT(enter(anna, {}), HasSubstr("your role has changed to observer"));
  people_->append_access("revoke user ben");
  authorizer_->look();
  EXPECT_THAT(enter(ben, AuthorId{2}), HasSubstr("revoked"));
  EXPECT_EQ(authorizer_->counts().streams, 0u);
}

TEST_F(AuthorizerTest, ARoomThatIsMadeAnewLeavesItsNewPeopleAlone) {
  const Caller anna = let_in("anna", Role::trainee), ben = let_in("ben", Role::trainee);
  (void)authorizer_->joined(anna, "ward", 1, AuthorId{1});
  // The room was deleted and made again without the authorizer's knowledge. Its authors are counted anew.
  (void)authorizer_->joined(ben, "ward", 1, AuthorId{1});
  std::string ended;
  const auto bens =
      authorizer_->enter(ben, "ward", AuthorId{1}, kWatch, [&](const Refusal& why) { ended += why.sentence; });
  (void)authorizer_->joined(anna, "ward", 1, AuthorId{2});
  EXPECT_EQ(ended, "");
  EXPECT_TRUE(authorizer_->check_author(ben, "ward", AuthorId{1}));
  EXPECT_TRUE(authorizer_->check_author(anna, "ward", AuthorId{2}));
}

TEST_F(AuthorizerTest, KnowsWhichRoomIsMeantThatIsNotNamed) {
  people_->append_access("role anna observer ward");
  authorizer_->look();
  const std::string everywhere = ticket("anna", "*", Role::instructor);
  authorizer_->set_only_room([] { return std::string("ward"); });
  EXPECT_THAT(refused("anna", everywhere, "", kUndo, true), HasSubstr("an observer may not"));
  EXPECT_THAT(refused("anna", everywhere, "ward", kUndo, true), HasSubstr("an observer may not"));
  authorizer_->set_only_room([] { return std::string("theatre"); });
  EXPECT_EQ(refused("anna", everywhere, "", kUndo, true), "");
}

TEST_F(AuthorizerTest, EndsStreamsOfWhoMayHaveThemNoMore) {
  const Caller anna = let_in("anna", Role::trainee), ben = let_in("ben", Role::trainee);
  ASSERT_TRUE(authorizer_->joined(anna, "ward", 1, AuthorId{1}) && authorizer_->joined(ben, "ward", 1, AuthorId{2}));
  std::optional<Refusal> ended[3];
  std::atomic<int> calls = 0;
  const auto into = [&](int i) { return [&, i](const Refusal& why) { ended[i] = why, ++calls; }; };
  const auto first = authorizer_->enter(anna, "ward", AuthorId{1}, kWatch, into(0));
  const auto second = authorizer_->enter(ben, "ward", AuthorId{2}, kWatch, into(1));
  auto gone = authorizer_->enter(anna, "ward", AuthorId{1}, kWatch, into(2));
  EXPECT_EQ(authorizer_->counts().streams, 3u);
  gone->reset();
  EXPECT_EQ(authorizer_->counts().streams, 2u);
  EXPECT_EQ((*first)->role(), Role::trainee);
  // No call triggers this: the authorizer checks by itself.
  people_->append_access("role anna observer");
  ASSERT_TRUE(test::wait_until([&] { return calls == 1; }, 5s));
  EXPECT_THAT(ended[0]->sentence, HasSubstr("your role has changed to observer"));
  EXPECT_EQ((*first)->role(), Role::none);
  EXPECT_FALSE(ended[1]);
  now_ += 3600;
  ASSERT_TRUE(test::wait_until([&] { return calls == 2; }, 5s));
  EXPECT_THAT(ended[1]->sentence, HasSubstr("expired"));
  authorizer_->look();
  EXPECT_EQ(calls, 2) << "a stream ends once";
}

TEST_F(AuthorizerTest, KnowsAPersonWhoseRoleHasChangedOnlyAfterAnotherJoin) {
  const Caller before = let_in("anna", Role::collaborator);
  (void)authorizer_->joined(before, "ward", 1, AuthorId{1});
  people_->append_access("role anna trainee");
  authorizer_->look();
  const Caller after = let_in("anna", Role::collaborator);
  EXPECT_EQ(after.role, Role::trainee);
  EXPECT_THAT(authorizer_->check_author(after, "ward", AuthorId{1}).error().message, HasSubstr("role has changed"));
  EXPECT_THAT(authorizer_->check_resume(after, "ward", 1, AuthorId{1}).error().message, HasSubstr("role has changed"));
}

TEST(CallRates, LetThroughAsManyAsTheTimeAllows) {
  constexpr const char* kJoin = "/osteon.v1.RoomService/Join";
  CallRates rates;
  CallRates::Time now{};
  const auto through = [&](const std::string& user, std::chrono::milliseconds every, std::chrono::seconds length) {
    int count = 0;
    for (const auto end = now + length; now < end; now += every) count += rates.take(user, kJoin, now) ? 1 : 0;
    return count;
  };
  // Whoever tries a thousand times a second for an hour is admitted as often as the rate and one full reserve allow.
  const int in_an_hour = through("eve", 1ms, 3600s);
  EXPECT_GT(in_an_hour, 3600);
  EXPECT_LT(in_an_hour, 5 * 3600);
  // As somebody may with a bad connection for a minute.
  EXPECT_EQ(through("anna", 500ms, 60s), 120);
  for (int i = 0; i < 1000; ++i)
    EXPECT_TRUE(rates.take("anna", "/osteon.v1.WatchService/LookFrom", now)) << "cheap calls are not counted";
  // A clock that goes back gives nothing.
  for (int i = 0; i < 1000; ++i) (void)rates.take("eve", kJoin, now);
  EXPECT_FALSE(rates.take("eve", kJoin, now - 10s));
  EXPECT_FALSE(rates.take("eve", kJoin, now));
}

TEST(CallRates, AReserveHasItsCallsAndNotOneMore) {
  for (const char* method : {"/osteon.v1.RoomService/Join", "/osteon.v1.PeopleService/Say",
                             "/osteon.v1.PeopleService/ShareShots", "/osteon.v1.FieldService/WatchField"}) {
    const CallRate* rate = find_call_rate(method);
    ASSERT_NE(rate, nullptr);
    CallRates rates;
    CallRates::Time now{};
    const auto through = [&] {
      int count = 0;
      while (rates.take("eve", method, now)) ++count;
      return count;
    };
    EXPECT_EQ(through(), rate->at_once) << method;
    EXPECT_EQ(through(), 0) << "the reserve is spent";
    now += 1s;
    EXPECT_EQ(through(), rate->per_second) << method;
    now += 1h;
    EXPECT_EQ(through(), rate->at_once) << "a pause fills it, and no more";
  }
}

TEST(CallRates, RememberNoMorePeopleThanTheirLimit) {
  CallRates rates;
  CallRates::Time now{};
  for (std::size_t i = 0; i < 3 * CallRates::kMost; ++i) {
    EXPECT_TRUE(rates.take(std::to_string(i), "/osteon.v1.RoomService/Join", now));
    EXPECT_LE(rates.size(), CallRates::kMost);
    now += 10ms;
  }
}

TEST(CallRates, AreThoseOfCallsThatThereAre) {
  int limited = 0;
  for (const CallRow& entry : call_rows()) limited += find_call_rate(entry.method) != nullptr ? 1 : 0;
  EXPECT_EQ(limited, 25);
  // Every call that makes an entry of the journal.
  for (const char* method :
       {"Join", "Mark", "Undo", "Redo", "AddTool", "RemoveBody", "SetSceneItem", "RemoveSceneItem"})
    EXPECT_NE(find_call_rate(std::string("/osteon.v1.RoomService/") + method), nullptr) << method;
  for (const char* method : {"Say", "Annotate", "Supervise", "Demonstrate"})
    EXPECT_NE(find_call_rate(std::string("/osteon.v1.PeopleService/") + method), nullptr) << method;
  // Four a second, as a window sends them, always pass. What is sent without an end is stopped.
  const CallRate* shots = find_call_rate("/osteon.v1.PeopleService/ShareShots");
  ASSERT_NE(shots, nullptr);
  EXPECT_GE(shots->per_second, 2 * 4.0);
  EXPECT_LE(shots->per_second, 10.0);
  // What copies the whole bone for each call comes less often than what does not.
  const CallRate *copies = find_call_rate("/osteon.v1.FieldService/WatchField"),
                 *joins = find_call_rate("/osteon.v1.RoomService/Join");
  EXPECT_LT(copies->per_second, joins->per_second);
  EXPECT_LT(copies->at_once, joins->at_once);
}

TEST(RefusalLog, SaysEachOnceAndRemembersNoMoreThanItsLimit) {
  RefusalLog log;
  RefusalLog::Time now{};
  const auto is_new = [&](std::string_view peer, std::string_view reason) {
    now += std::chrono::ceil<RefusalLog::Time::duration>(1.0s / RefusalLog::kLinesPerSecond);
    return log.is_new(peer, reason, now);
  };
  EXPECT_TRUE(is_new("anna", "a"));
  EXPECT_FALSE(is_new("anna", "a"));
  EXPECT_TRUE(is_new("anna", "b"));
  EXPECT_TRUE(is_new("ben", "a"));
  for (std::size_t i = 0; i < 3 * RefusalLog::kMost; ++i) EXPECT_TRUE(is_new("eve", std::to_string(i)));
  EXPECT_EQ(log.size(), RefusalLog::kMost);
  EXPECT_FALSE(is_new("eve", std::to_string(3 * RefusalLog::kMost - 1)));
  EXPECT_TRUE(is_new("anna", "a"));
}

// As from ever new addresses of IPv6.
TEST(RefusalLog, SaysNoMoreInATimeThanItsLimit) {
  RefusalLog log;
  const RefusalLog::Time now{};
  std::size_t said = 0;
  for (std::size_t i = 0; i < 1000; ++i) said += log.is_new("address " + std::to_string(i), "tls", now) ? 1 : 0;
  EXPECT_EQ(said, RefusalLog::kLinesAtOnce);
  EXPECT_TRUE(log.is_new("anna", "tls", now + 10s));
  EXPECT_EQ(log.take_left_out(), 1000 - said);
  EXPECT_EQ(log.take_left_out(), 0u);
}

}  // namespace
}  // namespace osteon
