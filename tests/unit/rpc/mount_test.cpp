// Pushes and positions between a served room and real sessions: in datagrams, over the stream, and after a reconnect.
#include <gtest/gtest.h>

#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "tests/support/relay/impair_process.hpp"
#include "tests/unit/rooms/served_room.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::wait_until;

// A session that pushes and receives the motion of the bone.
class Pusher {
 public:
  Pusher(const std::string& address, const std::filesystem::path& cache, const std::string& fast_path) {
    auto joined = RoomSession::join({.address = address, .cache = cache, .fast_path = fast_path}, {});
    EXPECT_TRUE(joined.has_value()) << joined.error().message;
    session_.emplace(std::move(*joined));
    RoomCallbacks callbacks;
    callbacks.bone = [this](const MountPose& seen) {
      const std::lock_guard lock(mutex_);
      first_ = first_.value_or(seen.seen_seq);
      newest_ = seen;
      ++told_;
    };
    callbacks.message = [this](const RoomMessage& message) {
      if (!std::holds_alternative<Interrupted>(message)) return;
      const std::lock_guard lock(mutex_);
      first_.reset();
      ++interruptions_;
    };
    session_->open(std::move(callbacks));
  }
  ~Pusher() { session_->close(); }

  // Pushes until `holds` is true.
  bool push_until(double force_n, const std::function<bool()>& holds) {
    return wait_until(
        [&] {
          session_->send(MountLoad{++pushes_, {{force_n, 0, 0}, Vec3::Zero()}, 0.0, newest().seen_seq});
          return holds();
        },
        test::kPatience);
  }
  MountPose newest() const {
    const std::lock_guard lock(mutex_);
    return newest_;
  }
  double x_mm() const { return newest().shift.place_mm.x(); }
  std::uint64_t first() const {
    const std::lock_guard lock(mutex_);
    return first_.value_or(0);
  }
  int told() const {
    const std::lock_guard lock(mutex_);
    return told_;
  }
  int interruptions() const {
    const std::lock_guard lock(mutex_);
    return interruptions_;
  }
  RoomSession& session() { return *session_; }

 private:
  mutable std::mutex mutex_;
  MountPose newest_;
  std::optional<std::uint64_t> first_;
  int told_ = 0, interruptions_ = 0;
  std::uint64_t pushes_ = 0;
  std::optional<RoomSession> session_;
};

class ServedMount : public ::testing::Test {
 protected:
  void serve(bool mount) {
    const Case bone = test::test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    const RoomServerOptions options{.listen = "127.0.0.1:0", .case_folder = dir_ / "case", .rates = {.mount = mount}};
    auto started = RoomServer::start(Room(bone), options, {});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
  }

  test::TempDir dir_;
  std::unique_ptr<RoomServer> server_;
};

// 10 N at 5 N/mm, over either transport.
TEST_F(ServedMount, OnesPushIsSeenByTheOtherByDatagramAndByStream) {
  serve(true);
  for (const char* way : {"", "off"}) {
    Pusher one(server_->address(), dir_ / "cache", way), other(server_->address(), dir_ / "cache", way);
    ASSERT_TRUE(wait_until([&] { return one.told() > 0 && other.told() > 0; }, test::kPatience));
    const bool datagrams = *way == '\0';
    ASSERT_TRUE(wait_until([&] { return one.session().fast_path().alive == datagrams; }, test::kPatience));
    EXPECT_TRUE(one.push_until(10.0, [&] { return other.x_mm() > 1.9; })) << way;
    EXPECT_NEAR(other.x_mm(), 2.0, 0.15);
    EXPECT_TRUE(one.push_until(10.0, [&] { return one.newest().push_seq > 0; })) << "its own pushes are acknowledged";
    EXPECT_EQ(other.newest().push_seq, 0u);
    EXPECT_EQ(one.session().fast_path().alive, datagrams);
  }
}

TEST_F(ServedMount, NumbersBeginAnewWithTheNextSession) {
  serve(true);
  test::ImpairProcess line({"--tcp", server_->address()});
  ASSERT_FALSE(line.tcp().empty()) << line.process().err();
  Pusher one(line.tcp(), dir_ / "cache", "off");
  EXPECT_TRUE(one.push_until(10.0, [&] { return one.newest().seen_seq > 100 && one.x_mm() > 1.9; }));
  EXPECT_EQ(line.command("reset"), "ok");
  ASSERT_TRUE(wait_until([&] { return one.interruptions() > 0 && one.first() > 0; }, test::kPatience));
  EXPECT_LT(one.first(), 100u) << "the numbers begin again after the interruption was reported";
  const std::uint64_t pushed = one.newest().push_seq;
  EXPECT_TRUE(one.push_until(10.0, [&] { return one.newest().push_seq > pushed && one.x_mm() > 1.9; }))
      << "and its pushes work again";
}

TEST_F(ServedMount, NothingIsSentWhereThereIsNone) {
  serve(false);
  Pusher one(server_->address(), dir_ / "cache", ""), streamed(server_->address(), dir_ / "cache", "off");
  int looks = 0;
  EXPECT_TRUE(one.push_until(10.0, [&] { return ++looks > 40; })) << "a push without a mount does no harm";
  EXPECT_TRUE(streamed.push_until(10.0, [&] { return ++looks > 80; }));
  EXPECT_EQ(one.told() + streamed.told(), 0);
  EXPECT_EQ(one.interruptions() + streamed.interruptions(), 0);
}

}  // namespace
}  // namespace osteon
