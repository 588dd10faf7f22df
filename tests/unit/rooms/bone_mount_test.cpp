// The bone on its compliant mount in a room. Every session is sent its position, and can move it for all.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "server/rooms/room_runtime.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/fake_session.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

// Keeps the positions that a session is sent.
class ReceivedMotion final : public test::FakeSession {
 public:
  using FakeSession::FakeSession;
  void show_bone(const MountPose& seen) override { seen_.push_back(seen); }

  std::vector<MountPose> seen_;
};

// A driven runtime with two haptic clients.
struct Pair {
  explicit Pair(bool mount)
      : runtime(Room(test::test_block()), {.tick = 0ns, .mesh = 1s, .pieces = 0ns, .mount = mount}, {}) {
    for (auto& session : sessions) session = open(join());
  }
  AuthorId join() {
    AuthorId author;
    runtime.join(MemberKind::surgeon, "", {}, Role::none,
                 [&](const Result<AuthorId>& given) { author = given.value(); });
    tick();
    return author;
  }
  std::shared_ptr<ReceivedMotion> open(AuthorId author) {
    auto session = std::make_shared<ReceivedMotion>(author);
    EXPECT_TRUE(runtime.open_session(session));
    return session;
  }
  void tick(int times = 1) {
    for (int i = 0; i < times; ++i) runtime.tick(now += 8ms);
  }
  void push(const std::shared_ptr<ReceivedMotion>& session, const Load& load, double energy_mj = 0.0) {
    runtime.push_bone(session->author(),
                      {++pushes, load, energy_mj, session->seen_.empty() ? 0 : session->seen_.back().seen_seq});
  }

  std::chrono::nanoseconds now{};
  std::uint64_t pushes = 0;
  RoomRuntime runtime;
  std::shared_ptr<ReceivedMotion> sessions[2];
};

TEST(MountInARoom, APushMovesTheBoneOfAll) {
  Pair room(true);
  room.tick(20);
  for (const auto& session : room.sessions) {
    ASSERT_FALSE(session->seen_.empty()) << "the session is sent that there is a mount";
    EXPECT_LE(session->seen_.size(), 5u) << "updates are rare while the bone rests";
    EXPECT_EQ(session->seen_.back().shift.place_mm, Vec3(Vec3::Zero()));
  }
  const Load load{{10.0, 0, 0}, Vec3::Zero()};
  const std::size_t before = room.sessions[1]->seen_.size();
  for (int i = 0; i < 250; ++i) {
    room.push(room.sessions[0], load);
    room.tick();
  }
  const double expected_mm = 10.0 / MountParams{}.stiffness_n_per_mm;
  for (const auto& session : room.sessions)
    EXPECT_NEAR(session->seen_.back().shift.place_mm.x(), expected_mm, 1e-3 * expected_mm);
  EXPECT_EQ(room.sessions[0]->seen_.back().push_seq, room.pushes);
  EXPECT_EQ(room.sessions[1]->seen_.back().push_seq, 0u);
  EXPECT_GE(room.sessions[1]->seen_.size() - before, 249u) << "there is an update at every tick while it moves";
  // A push that is not renewed decays.
  room.tick(400);
  EXPECT_LT(room.sessions[1]->seen_.back().shift.place_mm.norm(), 0.01 * expected_mm);
}

// After the machine stood still, for ten seconds or for a tenth of one, the bone goes on from where it was.
TEST(MountInARoom, LosesTheTimeInWhichTheMachineStoodStill) {
  const auto after = [](std::chrono::nanoseconds pause) {
    Pair room(true);
    room.tick(20);
    for (int i = 0; i < 5; ++i) {
      room.push(room.sessions[0], {{10.0, 0, 0}, Vec3::Zero()});
      room.tick();
    }
    room.runtime.tick(room.now += pause);
    return room.sessions[1]->seen_.back().shift.place_mm;
  };
  const Vec3 place_mm = after(100ms);
  EXPECT_GT(place_mm.norm(), 0.0);
  EXPECT_EQ(after(10s), place_mm);
}

TEST(MountInARoom, GrantsWhatTheOtherGives) {
  Pair room(true);
  room.push(room.sessions[0], {}, 5.0);
  room.tick(10);
  room.push(room.sessions[0], {}, 8.0);
  room.tick(10);
  EXPECT_DOUBLE_EQ(room.sessions[1]->seen_.back().energy_mj, 3.0);
  EXPECT_DOUBLE_EQ(room.sessions[0]->seen_.back().energy_mj, 0.0);
}

TEST(MountInARoom, WhoLeavesPushesNoMore) {
  Pair room(true);
  for (int i = 0; i < 100; ++i) {
    room.push(room.sessions[0], {{0, 20.0, 0}, Vec3::Zero()});
    room.tick();
  }
  EXPECT_GT(room.sessions[1]->seen_.back().shift.place_mm.y(), 3.0);
  room.runtime.leave(*room.sessions[0]);
  // An author without a session has no effect and is sent nothing more.
  const std::size_t told = room.sessions[0]->seen_.size();
  for (int i = 0; i < 200; ++i) {
    room.push(room.sessions[0], {{0, 20.0, 0}, Vec3::Zero()});
    room.tick();
  }
  EXPECT_EQ(room.sessions[0]->seen_.size(), told);
  EXPECT_LT(room.sessions[1]->seen_.back().shift.place_mm.norm(), 0.1);
  // The numbers begin again in another session.
  room.sessions[0] = room.open(room.sessions[0]->author());
  room.tick(10);
  ASSERT_FALSE(room.sessions[0]->seen_.empty());
  EXPECT_EQ(room.sessions[0]->seen_.front().seen_seq, 1u);
}

// The motion of the bone is not stored. Entries, field and hash are the same as without it.
TEST(MountInARoom, IsNoEvent) {
  Pair room(true), other(false);
  for (int i = 0; i < 100; ++i) {
    room.push(room.sessions[0], {{0, 20.0, 0}, {100, 0, 0}});
    room.tick();
    other.push(other.sessions[0], {{0, 20.0, 0}, {100, 0, 0}});
    other.tick();
  }
  EXPECT_EQ(room.runtime.room_seq(), other.runtime.room_seq());
  EXPECT_EQ(room.runtime.bone_status().field_hash, other.runtime.bone_status().field_hash);
  EXPECT_TRUE(other.sessions[0]->seen_.empty()) << "without a mount no motion is sent";
  EXPECT_TRUE(other.sessions[1]->seen_.empty());
}

}  // namespace
}  // namespace osteon
