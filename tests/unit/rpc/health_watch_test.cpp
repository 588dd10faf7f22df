// What an operator asks a server about: addresses, certificates, refusals, health, metrics, a drain.
#include <grpcpp/health_check_service_interface.h>
#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>

#include "common/wire/host_port.hpp"
#include "server/auth/refusals.hpp"
#include "server/auth/server_certificate.hpp"
#include "server/rpc/health_watch.hpp"
#include "server/rpc/metrics.hpp"
#include "tests/support/disk/memory_disk.hpp"
#include "tests/unit/rooms/fake_session.hpp"
#include "tests/unit/rooms/kept_room.hpp"
#include "tests/unit/rooms/served_room.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using DrainTest = test::ServedRoom;

TEST(HostPort, TakesAHostAndAPortAndKnowsThisMachine) {
  for (const std::string good : {"127.0.0.1:0", "localhost:65535", "[::1]:50000", "0.0.0.0:1", "name.of.it:7"})
    EXPECT_TRUE(parse_host_port(good, "--x").has_value()) << good;
  EXPECT_EQ(parse_host_port("[::1]:50000", "--x")->host, "[::1]");
  EXPECT_EQ(parse_host_port("[::1]:50000", "--x")->port, 50000);
  for (const std::string bad : {"", ":", ":1", "a", "a:", "a:-1", "a:65536", "a:1b", "a: 1"}) {
    const auto parsed = parse_host_port(bad, "--x");
    ASSERT_FALSE(parsed.has_value()) << bad;
    EXPECT_EQ(parsed.error().message.find("--x "), 0u);
  }
  for (const std::string own : {"localhost", "[::1]", "127.0.0.1", "127.1.2.3"}) EXPECT_TRUE(is_loopback(own)) << own;
  for (const std::string other :
       {"0.0.0.0", "127.0.0.1.example", "127", "128.0.0.1", "[::]", "localhost.", "127.0.0.256"})
    EXPECT_FALSE(is_loopback(other)) << other;
}

TEST(RefusalCounts, CountsByReasonInBoundedMemory) {
  RefusalCounts refusals;
  refusals.count("ticket");
  refusals.count("ticket");
  refusals.count("version");
  EXPECT_EQ(refusals.counts().at("ticket"), 2u);
  EXPECT_EQ(refusals.counts().at("version"), 1u);
  for (int i = 0; i < 1000; ++i) refusals.count("reason " + std::to_string(i));
  refusals.count("ticket");
  EXPECT_LE(refusals.counts().size(), RefusalCounts::kMost + 1);
  EXPECT_EQ(refusals.counts().at("ticket"), 3u);
  std::uint64_t all = 0;
  for (const auto& [reason, count] : refusals.counts()) all += count;
  EXPECT_EQ(all, 1004u) << "every refusal is counted";
}

// Writes a self-signed certificate that expires in `seconds`.
void write_certificate(const std::filesystem::path& file, long seconds) {
  EVP_PKEY* key = EVP_EC_gen("P-256");
  X509* certificate = X509_new();
  X509_gmtime_adj(X509_getm_notBefore(certificate), -7200);
  X509_gmtime_adj(X509_getm_notAfter(certificate), seconds);
  X509_set_pubkey(certificate, key);
  ASSERT_GT(X509_sign(certificate, key, EVP_sha256()), 0);
  std::FILE* out = std::fopen(file.c_str(), "w");
  ASSERT_EQ(PEM_write_X509(out, certificate), 1);
  std::fclose(out);
  X509_free(certificate);
  EVP_PKEY_free(key);
}

TEST(Certificate, SaysHowManyDaysAreLeft) {
  TempDir dir;
  for (const double days : {10.25, 365.0, -0.5}) {
    write_certificate(dir / "server.pem", static_cast<long>(days * 86400));
    const Result<double> left = certificate_days_left(dir / "server.pem");
    ASSERT_TRUE(left.has_value()) << left.error().message;
    EXPECT_NEAR(*left, days, 0.01) << "a quarter of an hour of tolerance for a slow machine";
  }
  EXPECT_EQ(certificate_days_left(dir / "nowhere.pem").error().code, ErrorCode::not_found);
  std::ofstream(dir / "text.pem") << "no certificate";
  EXPECT_EQ(certificate_days_left(dir / "text.pem").error().code, ErrorCode::invalid_input);
}

// Keeps what grpc.health.v1 would answer.
class ReportedHealth final : public grpc::HealthCheckServiceInterface {
 public:
  void SetServingStatus(const std::string& name, bool serving) override { serving_[name] = serving; }
  void SetServingStatus(bool) override {}
  [[nodiscard]] std::optional<bool> of(const std::string& name) const {
    const auto known = serving_.find(name);
    return known == serving_.end() ? std::nullopt : std::optional(known->second);
  }

 private:
  std::map<std::string, bool> serving_;
};

TEST(HealthWatch, ARoomServesUntilItIsClosedOrItsJournalFails) {
  TempDir dir;
  MemoryDisk disk{1};
  const std::filesystem::path file = "/rooms/femur.journal";
  KeptCuts kept(file, &disk, "femur");
  kept.keep();
  disk.fail_sync_at(1, EIO, MemoryDisk::Lasting::from_then_on);  // The next sync of the journal fails.
  Rooms rooms(RoomsOptions{.cases = {{test_block(), dir / "case"}}});
  ASSERT_TRUE(rooms.add("femur", std::move(*kept.room), std::move(kept.store), {}, [](double) {}));
  ASSERT_TRUE(rooms.create("tibia", nullptr));
  ReportedHealth told;
  {
    HealthWatch watch(rooms, told);
    // The thread of the health watch checks too. Its last report is true at any time.
    const auto says = [&](const std::string& name, bool serving) {
      watch.look();
      return told.of(name) == serving;
    };
    EXPECT_TRUE(says("", true) && says("femur", true) && says("tibia", true));
    EXPECT_EQ(told.of("nobody"), std::nullopt);
    ASSERT_TRUE(rooms.close("tibia"));
    EXPECT_TRUE(says("tibia", false) && says("femur", true));
    ASSERT_TRUE(rooms.create("tibia", nullptr));
    EXPECT_TRUE(says("tibia", true));
    EXPECT_FALSE((*rooms.find("femur"))->runtime().join(MemberKind::watcher).has_value());
    EXPECT_TRUE(says("femur", false) && says("tibia", true) && says("", true));
    rooms.begin_drain(1s, "the server is stopping");
    EXPECT_TRUE(says("", false) && says("tibia", false));
  }
}

// The stream of a haptic client, which keeps the reason of its end.
class Hand final : public test::FakeSession {
 public:
  using FakeSession::FakeSession;
  void refuse(const Error&) override {}
  void end(const std::string& why) override {
    const std::lock_guard lock(mutex_);
    ended_ = why;
  }
  [[nodiscard]] std::string ended() const {
    const std::lock_guard lock(mutex_);
    return ended_;
  }

 private:
  mutable std::mutex mutex_;
  std::string ended_;
};

// If a journal takes no entry, no new decision is durable, whatever the cause.
TEST(HealthWatch, ARoomWhoseJournalIsDamagedIsOpenToNobody) {
  TempDir dir;
  MemoryDisk disk{1};
  const std::filesystem::path file = "/rooms/femur.journal";
  KeptCuts kept(file, &disk, "femur");
  kept.cut(3);
  ASSERT_TRUE(kept.room->mark(kept.hand, "before the reamer"));
  kept.keep();
  const JournalHead head = kept.store->head();
  ASSERT_TRUE(kept.store->close());
  const std::size_t at = disk.image().at(file).find("before the reamer");
  ASSERT_NE(at, std::string::npos);
  disk.flip_bit(file, 8 * at + 1);
  kept.open(file);
  ASSERT_EQ(kept.store->head().seq.value, head.seq.value - 1) << "the other entries can be read";
  Rooms rooms(RoomsOptions{.cases = {{test_block(), dir / "case"}}});
  ASSERT_TRUE(rooms.add("femur", std::move(*kept.room), std::move(kept.store), {}, [](double) {}));
  RoomRuntime& host = (*rooms.find("femur"))->runtime();
  EXPECT_TRUE(host.stopped());
  EXPECT_FALSE(host.health().serving);
  ReportedHealth told;
  HealthWatch watch(rooms, told);
  watch.look();
  EXPECT_EQ(told.of("femur"), false);
  EXPECT_EQ(told.of(""), true);
  ASSERT_EQ(rooms.list().size(), 1u);
  EXPECT_FALSE(rooms.list()[0].open) << "nobody can join it";
  EXPECT_EQ(rooms.list()[0].room_seq.value, head.seq.value - 1);
  const auto joined = host.join(MemberKind::watcher);
  ASSERT_FALSE(joined);
  EXPECT_EQ(joined.error().code, ErrorCode::unavailable);
  EXPECT_NE(joined.error().message.find("takes no more cuts: " + file.string()), std::string::npos)
      << joined.error().message;
  const auto again = rooms.resume("femur");
  ASSERT_FALSE(again);
  EXPECT_NE(again.error().message.find(file.string()), std::string::npos) << again.error().message;
  // An earlier session of the room is sent it too, also if it is opened before the first tick.
  const auto hand = std::make_shared<Hand>(kept.hand);
  (void)host.open_session(hand);
  EXPECT_TRUE(wait_until([&] { return hand->ended().starts_with("the room takes no more cuts"); }, kPatience))
      << hand->ended();
  host.leave(*hand);
}

TEST(HealthWatch, ARoomStopsWhenItsJournalIsClosedBesideACommit) {
  TempDir dir;
  MemoryDisk disk{1};
  KeptCuts kept("/rooms/femur.journal", &disk, "femur");
  kept.cut(1);
  Rooms rooms(RoomsOptions{.cases = {{test_block(), dir / "case"}}});
  ASSERT_TRUE(rooms.add("femur", std::move(*kept.room), std::move(kept.store), {}, [](double) {}));
  RoomRuntime& host = (*rooms.find("femur"))->runtime();
  const auto hand = std::make_shared<Hand>(kept.hand);
  ASSERT_TRUE(host.open_session(hand));
  EXPECT_TRUE(host.health().serving);
  disk.fail_sync_at(1, EIO, MemoryDisk::Lasting::from_then_on);
  ASSERT_FALSE(host.join(MemberKind::watcher, "Ada")) << "her name is written before her join";
  EXPECT_TRUE(host.stopped());
  EXPECT_FALSE(host.health().serving);
  EXPECT_FALSE(rooms.list()[0].open);
  EXPECT_TRUE(wait_until([&] { return hand->ended().starts_with("the room takes no more cuts"); }, kPatience))
      << hand->ended();
  host.leave(*hand);
}

// As the server's maintenance asks for it, every few seconds.
TEST(Maintenance, AnIdleRoomsLogGoesIntoTheDatabase) {
  TempDir dir;
  const std::filesystem::path file = dir / "femur.journal";
  KeptCuts kept(file, nullptr, "femur");
  const std::uintmax_t before = std::filesystem::file_size(file);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(kept.room->mark(kept.hand, "a mark"));
    kept.keep();
  }
  ASSERT_EQ(std::filesystem::file_size(file), before);
  Rooms rooms(RoomsOptions{.cases = {{test_block(), dir / "case"}}});
  ASSERT_TRUE(rooms.add("femur", std::move(*kept.room), std::move(kept.store), {}, [](double) {}));
  const std::shared_ptr<OpenRoom> room = *rooms.find("femur");
  for (int i = 0; i < 2; ++i) room->maintain([] { return false; });
  EXPECT_GT(std::filesystem::file_size(file), before);
}

TEST_F(DrainTest, EveryHandLeavesWithWhatItSentDecidedAndNobodyComesIn) {
  const auto hand = surgeon();
  ASSERT_TRUE(wait_until([&] { return hand->complete(); }, kPatience));
  std::vector<Cut> cuts = strokes(hand->author(), 400, 1);
  send(*hand, {cuts.begin(), cuts.begin() + 20});
  ASSERT_TRUE(wait_until([&] { return hand->own() == 20; }, kPatience));
  send(*hand, {cuts.begin() + 20, cuts.end()});  // These are under way.
  int waits = 0;
  server_->drain(1h, [&](std::chrono::milliseconds time) {
    std::this_thread::sleep_for(time);
    return ++waits > 1000;
  });
  EXPECT_LE(waits, 1000) << "the haptic client did not leave by itself";
  EXPECT_EQ(server_->health().sessions, 0u);
  EXPECT_TRUE(wait_until([&] { return hand->interruptions() == 1; }, kPatience));
  const auto acknowledged = hand->acknowledged();
  EXPECT_GE(acknowledged.size(), 20u);
  EXPECT_TRUE(wait_until([&] { return acknowledged.size() == server_->health().counts.committed; }, kPatience))
      << acknowledged.size() << " were told of " << server_->health().counts.committed << " that were decided";
  EXPECT_EQ(hand->lost(), "");
  const auto late = wire::join_room(address(), wire::ClientKind::viewer, "late", 5s, {});
  ASSERT_FALSE(late.has_value());
  EXPECT_NE(late.error().message.find("is stopping; connect again"), std::string::npos) << late.error().message;
  EXPECT_EQ(server_->rooms().refusals.counts().at("draining"), 1u);
}

TEST_F(DrainTest, MetricsAreForThisMachineAlone) {
  for (const auto& [listen, word] : std::map<std::string, std::string>{{"0.0.0.0:0", "127.0.0.1"},
                                                                       {"example.org:9464", "127.0.0.1"},
                                                                       {"port", "HOST:PORT"},
                                                                       {"70000", "HOST:PORT"}}) {
    const auto refused = Metrics::start(listen, *server_, {});
    ASSERT_FALSE(refused.has_value()) << listen;
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
    EXPECT_NE(refused.error().message.find("--metrics " + (listen.find(':') == std::string::npos ? "" : listen)),
              std::string::npos)
        << refused.error().message;
    EXPECT_NE(refused.error().message.find(word), std::string::npos) << refused.error().message;
  }
  const auto started = Metrics::start("0", *server_, {});
  ASSERT_TRUE(started.has_value()) << started.error().message;
  EXPECT_EQ((*started)->address().find("127.0.0.1:"), 0u);
  EXPECT_NE((*started)->address(), "127.0.0.1:0");
  const auto taken = Metrics::start((*started)->address(), *server_, {});
  ASSERT_FALSE(taken.has_value());
  EXPECT_NE(taken.error().message.find((*started)->address()), std::string::npos) << taken.error().message;
}

}  // namespace
}  // namespace osteon
