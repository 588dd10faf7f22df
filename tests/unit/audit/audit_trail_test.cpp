// Whoever records waits for no disk, a flood of refusals does not fill the disk, and lost records are counted in the
// log.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <string>
#include <vector>

#include "server/audit/audit_check.hpp"
#include "server/audit/audit_trail.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr std::chrono::seconds kPatience{20};

// The computer's disk, full as long as the test sets it.
class FullDisk final : public Disk {
 public:
  std::atomic<bool> full{false};
  std::atomic<int> tried{0};  // The number of writes while it was full.

  Result<std::unique_ptr<DiskFile>> create(const std::filesystem::path& file) override { return real_.create(file); }
  Result<std::unique_ptr<DiskFile>> open(const std::filesystem::path& file) override {
    if (!full) return real_.open(file);
    ++tried;
    return failure(ErrorCode::internal, "No space left on device");
  }
  Result<std::string> read(const std::filesystem::path& file, std::uint64_t from, std::size_t most) override {
    return real_.read(file, from, most);
  }
  Result<std::optional<FileIdentity>> identity(const std::filesystem::path& file) override {
    return real_.identity(file);
  }
  Result<void> rename(const std::filesystem::path& from, const std::filesystem::path& to) override {
    return real_.rename(from, to);
  }
  Result<void> remove(const std::filesystem::path& file) override { return real_.remove(file); }
  Result<void> sync_folder(const std::filesystem::path& folder) override { return real_.sync_folder(folder); }
  Result<std::vector<std::string>> list(const std::filesystem::path& folder) override { return real_.list(folder); }
  Result<std::unique_ptr<DiskLock>> lock(const std::filesystem::path& file, LockKind kind) override {
    return real_.lock(file, kind);
  }
  Result<std::unique_ptr<ScratchFolder>> scratch_folder() override { return real_.scratch_folder(); }

 private:
  Disk& real_ = system_disk();
};

class Trails : public ::testing::Test {
 protected:
  std::unique_ptr<AuditTrail> open(AuditOptions more = {}) {
    more.file = file();
    more.keys = keys_;
    more.retry = 5ms;
    auto trail = AuditTrail::open(std::move(more), &disk_);
    EXPECT_TRUE(trail.has_value()) << (trail ? "" : trail.error().message);
    return std::move(*trail);
  }
  std::filesystem::path file() const { return dir_ / kAuditLogFile; }
  static AuditEvent refusal(const std::string& person, const std::string& object = "ward") {
    return {.who = {.person = person, .certificate = "0A"},
            .action = "DeleteRoom",
            .object = object,
            .result = kRefused,
            .detail = "role"};
  }
  static AuditEvent done(const std::string& object) {
    return {.who = {.person = "olga"}, .action = "CreateRoom", .object = object, .result = kOk};
  }
  std::vector<AuditEntry> entries(const std::string& action = "") {
    std::vector<AuditEntry> all;
    EXPECT_TRUE(read_audit(disk_, file(), [&](const AuditEntry& one) {
      if (action.empty() || one.record.action == action) all.push_back(one);
    }));
    const auto report = verify_audit(disk_, file(), [this](const PublicKey& key) { return keys_->trusts(key); });
    EXPECT_TRUE(report && report->sound()) << report->fault.value_or("");
    return all;
  }

  test::TempDir dir_;
  FullDisk disk_;
  std::shared_ptr<const SigningKeys> keys_ = std::make_shared<const SigningKeys>(SigningKey::make());
};

TEST_F(Trails, AreThereFromStartToStopForTheirOwnerAlone) {
  auto trail = open();
  trail->record(done("ward"));
  trail.reset();
  const auto all = entries();
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].record.action, "start");
  EXPECT_EQ(all[1].who.person, "olga");
  EXPECT_EQ(all[2].record.action, "stop");
  for (const char* name : {"audit.log", "audit.people", "audit.lock"})
    EXPECT_EQ(std::filesystem::status(dir_ / name).permissions(), std::filesystem::perms(0600)) << name;
}

TEST_F(Trails, WaitInMemoryForAFullDiskAndCountWhatIsLost) {
  auto trail = open({.most_waiting = 100});
  disk_.full = true;
  trail->record(done("first"));
  ASSERT_TRUE(test::wait_until([&] { return trail->counts().failing && disk_.tried > 2; }, kPatience));
  // The first record is in the batch that is tried again and again.
  for (int i = 0; i < 500; ++i) trail->record(done("room-" + std::to_string(i)));
  EXPECT_GE(trail->counts().lost, 100u);
  const std::uint64_t lost = trail->counts().lost;
  disk_.full = false;
  ASSERT_TRUE(test::wait_until([&] { return !trail->counts().failing && trail->counts().written > 2; }, kPatience));
  trail.reset();
  std::uint64_t said = 0;
  for (const AuditEntry& one : entries("lost")) said += std::stoull(one.record.detail);
  EXPECT_EQ(said, lost);
  EXPECT_EQ(entries("CreateRoom").size(), 501 - lost);
}

TEST_F(Trails, DoNotLetRefusalsDisplaceWhatWasDone) {
  auto trail = open({.most_waiting = 20});
  disk_.full = true;
  trail->record(done("first"));
  ASSERT_TRUE(test::wait_until([&] { return trail->counts().failing; }, kPatience));
  for (int i = 0; i < 400; ++i) trail->record(refusal("p" + std::to_string(i)));
  const std::uint64_t lost = trail->counts().lost;
  EXPECT_GT(lost, 0u);
  for (int i = 0; i < 10; ++i) trail->record(done("ward"));
  EXPECT_EQ(trail->counts().lost, lost);
  disk_.full = false;
  trail.reset();
  EXPECT_EQ(entries("CreateRoom").size(), 11u);
}

TEST_F(Trails, DoNotStartWhereTheyCannotBeWritten) {
  disk_.full = true;
  const auto trail = AuditTrail::open({.file = file(), .keys = keys_}, &disk_);
  ASSERT_FALSE(trail.has_value());
  EXPECT_THAT(trail.error().message, HasSubstr("No space left"));
}

TEST_F(Trails, CountEqualRefusals) {
  auto trail = open();
  for (int i = 0; i < 10000; ++i) trail->record(refusal("eve"));
  trail.reset();
  const auto all = entries("DeleteRoom");
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].record.detail, "role");
  EXPECT_EQ(all[1].record.detail, "role, 9999 times more");
}

TEST_F(Trails, BoundDifferentRefusalsOfAPersonAndOfTheUnauthenticated) {
  auto trail = open();
  for (int i = 0; i < 1000; ++i) {
    trail->record(refusal("eve", "room-" + std::to_string(i)));
    trail->record(refusal(std::string(kClaimed) + "x" + std::to_string(i)));
  }
  trail->record(refusal("ada"));
  trail.reset();
  EXPECT_EQ(entries("DeleteRoom").size(), AuditTrail::kMostOfOne + AuditTrail::kMostOfUnauthenticated + 1);
  EXPECT_EQ(entries("DeleteRoom").back().who.person, "ada");
  const auto omitted = entries("omitted");
  ASSERT_EQ(omitted.size(), 2u);
  EXPECT_EQ(omitted[0].record.detail, std::to_string(1000 - AuditTrail::kMostOfUnauthenticated) + " further refusals");
  EXPECT_EQ(omitted[1].who.person, "eve");
}

TEST_F(Trails, SayTheSameToTheSystemsLog) {
  const auto path = dir_ / "log";
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  std::strncpy(at.sun_path, path.c_str(), sizeof at.sun_path - 1);
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  const timeval patience{.tv_sec = 10, .tv_usec = 0};
  ::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  auto trail = open({.syslog = path});
  trail->record(refusal("eve"));
  std::vector<std::string> heard;
  for (int i = 0; i < 2; ++i) {
    std::array<char, 8192> bytes{};
    const auto size = ::recv(socket, bytes.data(), bytes.size(), 0);
    ASSERT_GT(size, 0);
    heard.emplace_back(bytes.data(), static_cast<std::size_t>(size));
  }
  ::close(socket);
  trail.reset();
  EXPECT_THAT(heard[0], testing::MatchesRegex("<85>1 [0-9T:.Z-]+ [^ ]+ osteon-server [0-9]+ start \\[osteon@32473 .*"));
  EXPECT_THAT(heard[1], testing::StartsWith("<84>1 "));
  for (const char* part :
       {"person=\"eve\"", "certificate=\"0A\"", "action=\"DeleteRoom\"", "object=\"ward\"", "result=\"refused\""})
    EXPECT_THAT(heard[1], HasSubstr(part));
  // Its hash identifies the end of the log.
  const std::size_t hash = heard[1].find("hash=\"") + 6;
  const auto report = verify_audit(
      disk_, file(), [](const PublicKey&) { return true; }, *digest_from_hex(heard[1].substr(hash, 64)));
  EXPECT_TRUE(report && report->sound());
}

}  // namespace
}  // namespace osteon
