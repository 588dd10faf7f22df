// The bone's inside as painters are given it: while the room cuts and undoes, when streams end, and at the end.
#include "viewer_client/inside/inside_bone.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <fstream>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/viewer_client/followed_room.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using radiology::BoneHu;
using test::wait_until;

constexpr auto kPatience = 60s;
constexpr HeldBoneOptions kQuick{.pause = 1ms, .longest_pause = 5ms};

// What connections to a room bring, as it comes. Each stream is a connection that the test has opened.
class LiveSource final : public FieldSource {
 public:
  struct Line {
    std::mutex mutex;
    std::deque<std::shared_ptr<test::FieldTap>> taps;
    std::optional<End> end;  // how the present stream ends, now
    bool cancelled = false;
  };
  LiveSource(Result<Case> bone, std::shared_ptr<Line> line) : bone_(std::move(bone)), line_(std::move(line)) {}

  Result<Case> imported() override { return bone_; }
  End read(const std::function<bool(const v1::WatchFieldResponse&)>& take) override {
    std::shared_ptr<test::FieldTap> tap;
    while (true) {
      {
        const std::lock_guard lock(line_->mutex);
        if (line_->cancelled) return {{ErrorCode::cancelled, "cancelled"}};
        if (line_->end) return *std::exchange(line_->end, std::nullopt);
        if (!tap && line_->taps.empty()) return {{ErrorCode::unavailable, "no server"}};
        if (!tap) {
          tap = line_->taps.front();
          line_->taps.pop_front();
        }
      }
      for (const v1::WatchFieldResponse& message : tap->read())
        if (!take(message)) return {{ErrorCode::cancelled, "not taken"}};
      std::this_thread::sleep_for(1ms);
    }
  }
  void cancel() override {
    const std::lock_guard lock(line_->mutex);
    line_->cancelled = true;
  }

 private:
  Result<Case> bone_;
  std::shared_ptr<Line> line_;  // shared with the test
};

std::vector<float> all_hu(const BoneHu& bone) {
  std::vector<float> values;
  const CoordBox box = bone.box();
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) values.push_back(bone.hu({x, y, z}));
  return values;
}

// Keeps a copy of the bone, renewed where it was told that something has changed.
class Copy final : public InsidePainter {
 public:
  void paint(const BoneHu& bone, const InsideChange& change, const KeepGoing& keep_going) override {
    const std::lock_guard lock(mutex_);
    ++calls_;
    if (!keep_going(0.0)) ++unwanted_;
    if (change.all) {
      ++wholes_;
      told_ = all_hu(bone);
    }
    const CoordBox& box = bone.box();
    const Coord dims = box.dims();
    for (const CoordBox& part : change.boxes)
      for (std::int32_t x = part.min.x; x <= part.max.x; ++x)
        for (std::int32_t y = part.min.y; y <= part.max.y; ++y)
          for (std::int32_t z = part.min.z; z <= part.max.z; ++z) {
            const Coord at = Coord{x, y, z} - box.min;
            told_[(to_index(at.x) * to_index(dims.y) + to_index(at.y)) * to_index(dims.z) + to_index(at.z)] =
                bone.hu({x, y, z});
          }
    is_ = all_hu(bone);
  }
  int calls() const { return get(calls_); }
  int wholes() const { return get(wholes_); }
  std::vector<float> told() const { return get(told_); }
  std::vector<float> is() const { return get(is_); }

 private:
  template <class Value>
  Value get(const Value& value) const {
    const std::lock_guard lock(mutex_);
    return value;
  }
  mutable std::mutex mutex_;
  int calls_ = 0, wholes_ = 0, unwanted_ = 0;
  std::vector<float> told_, is_;
};

// Paints until it is not wanted.
class Endless final : public InsidePainter {
 public:
  void paint(const BoneHu&, const InsideChange&, const KeepGoing& keep_going) override {
    paints = true;
    while (keep_going(0.5)) std::this_thread::sleep_for(1ms);
    paints = false;
    ++ended;
  }
  std::atomic<bool> paints{false};
  std::atomic<int> ended{0};
};

class Inside : public testing::Test {
 protected:
  std::shared_ptr<HeldBone> hold() { return hold(bone_); }
  std::shared_ptr<HeldBone> hold(Result<Case> imported) {
    return HeldBone::start(std::make_unique<LiveSource>(std::move(imported), line_), kQuick);
  }
  void connect() {
    const std::lock_guard lock(line_->mutex);
    line_->taps.push_back(room_.open());
  }
  void lose(const FieldSource::End& end) {
    const std::lock_guard lock(line_->mutex);
    line_->end = end;
  }
  // The bone as the room has it now, computed at once.
  std::vector<float> expected(const HeldBone& held) {
    std::vector<float> values;
    const auto hash = room_.status().field_hash;  // the room has locks, which read() does not allow
    EXPECT_TRUE(held.read([&](const Replica& replica) {
      EXPECT_EQ(replica.hash(), hash);
      auto whole = BoneHu::make(bone_);
      ASSERT_TRUE(whole && whole->renew(replica.bodies()));
      values = all_hu(*whole);
    }));
    return values;
  }
  bool has_newest(const InsideBone& inside) {
    return wait_until([&] { return inside.status().room_seq >= room_.status().room_seq; }, kPatience);
  }
  static bool reaches(const InsideBone& inside, InsideState state) {
    return wait_until([&] { return inside.status().state == state; }, kPatience);
  }

  const Case bone_ = test::test_block();
  test::FollowedRoom room_{bone_};
  std::shared_ptr<LiveSource::Line> line_ = std::make_shared<LiveSource::Line>();  // shared with the source
};

constexpr std::chrono::milliseconds kNoRest{1};

TEST_F(Inside, FollowsCutsAndUndoToTheLastBit) {
  room_.cut(3);  // before anybody looks
  connect();
  const auto held = hold();
  const auto inside = InsideBone::start(held, {.period = kNoRest});
  const auto copy = std::make_shared<Copy>();
  inside->add(copy);
  ASSERT_TRUE(has_newest(*inside));
  EXPECT_EQ(copy->is(), expected(*held));
  EXPECT_NE(copy->is(), all_hu(*BoneHu::make(bone_))) << "something was cut";
  EXPECT_EQ(copy->told(), copy->is());

  const int wholes = copy->wholes();
  for (int i = 0; i < 12; ++i) {
    room_.cut(1);
    if (i % 4 != 3) continue;
    ASSERT_TRUE(has_newest(*inside));
    EXPECT_EQ(copy->told(), copy->is()) << "what changed was told";
  }
  EXPECT_EQ(copy->is(), expected(*held));
  EXPECT_EQ(copy->wholes(), wholes) << "a cut changes little";
  EXPECT_FALSE(inside->status().from_scan);
  EXPECT_EQ(inside->status().state, InsideState::follows);

  const std::vector<float> cut = copy->is();
  const RoomSeq newest = room_.status().room_seq;
  room_.happen([&](Room& room) { return room.undo(room_.viewer(), std::array{newest}); });
  ASSERT_TRUE(has_newest(*inside));
  EXPECT_NE(copy->is(), cut);
  EXPECT_EQ(copy->is(), expected(*held));
  EXPECT_EQ(copy->told(), copy->is());
}

// Slices and X-rays at once.
TEST_F(Inside, TellsEachPainterWhatChanged) {
  connect();
  const auto inside = InsideBone::start(hold(), {.period = kNoRest});
  const std::array copies{std::make_shared<Copy>(), std::make_shared<Copy>()};
  for (const auto& copy : copies) inside->add(copy);
  ASSERT_TRUE(wait_until([&] { return copies[0]->calls() > 0 && copies[1]->calls() > 0; }, kPatience));
  room_.cut(3);
  ASSERT_TRUE(has_newest(*inside));
  EXPECT_NE(copies[0]->is(), all_hu(*BoneHu::make(bone_))) << "something was cut";
  for (const auto& copy : copies) {
    EXPECT_EQ(copy->told(), copy->is());
    EXPECT_EQ(copy->wholes(), 1);
  }
}

TEST_F(Inside, CallsAPainterAtAWakeAndWithTheWholeBoneFirst) {
  connect();
  const auto inside = InsideBone::start(hold(), {.period = kNoRest});
  const auto first = std::make_shared<Copy>(), late = std::make_shared<Copy>();
  inside->add(first);
  ASSERT_TRUE(wait_until([&] { return first->calls() > 0; }, kPatience));
  EXPECT_EQ(first->wholes(), 1);
  std::this_thread::sleep_for(50ms);
  const int calls = first->calls();
  std::this_thread::sleep_for(800ms);  // longer than the thread waits at a time
  EXPECT_EQ(first->calls(), calls) << "nothing happens without a reason";
  inside->wake();
  ASSERT_TRUE(wait_until([&] { return first->calls() > calls; }, kPatience));
  inside->add(late);
  ASSERT_TRUE(wait_until([&] { return late->calls() > 0; }, kPatience));
  EXPECT_EQ(late->wholes(), 1);
  EXPECT_EQ(first->wholes(), 1) << "the first one has it already";
}

TEST_F(Inside, DoesNotCallAPainterThatWasRemoved) {
  connect();
  const auto inside = InsideBone::start(hold(), {.period = kNoRest});
  const auto endless = std::make_shared<Endless>();
  inside->add(endless);
  ASSERT_TRUE(wait_until([&] { return endless->paints.load(); }, kPatience));
  inside->remove(*endless);
  EXPECT_FALSE(endless->paints) << "it has ended";
  EXPECT_EQ(endless->ended, 1);
  inside->wake();
  const auto other = std::make_shared<Copy>();
  inside->add(other);
  ASSERT_TRUE(wait_until([&] { return other->calls() > 0; }, kPatience));
  EXPECT_EQ(endless->ended, 1);
}

TEST_F(Inside, EndsWhileAPainterPaints) {
  connect();
  auto inside = InsideBone::start(hold(), {.period = kNoRest});
  const auto endless = std::make_shared<Endless>();
  inside->add(endless);
  ASSERT_TRUE(wait_until([&] { return endless->paints.load(); }, kPatience));
  inside->end();
  inside.reset();
  EXPECT_EQ(endless->ended, 1);
}

TEST_F(Inside, SaysThatItIsInterruptedAndShowsTheBoneAsItWas) {
  room_.cut(2);
  connect();
  const auto held = hold();
  const auto inside = InsideBone::start(held, {.period = kNoRest});
  const auto copy = std::make_shared<Copy>();
  inside->add(copy);
  ASSERT_TRUE(has_newest(*inside));
  lose({{ErrorCode::unavailable, "cable"}});
  ASSERT_TRUE(reaches(*inside, InsideState::interrupted));
  const int calls = copy->calls();
  inside->wake();
  ASSERT_TRUE(wait_until([&] { return copy->calls() > calls; }, kPatience)) << "its pictures can be moved";
  EXPECT_EQ(copy->is(), expected(*held));
  room_.cut(2);
  connect();
  ASSERT_TRUE(reaches(*inside, InsideState::follows));
  ASSERT_TRUE(has_newest(*inside));
  EXPECT_EQ(copy->is(), expected(*held));
  EXPECT_EQ(copy->told(), copy->is());
  EXPECT_FALSE(inside->status().why);
}

TEST_F(Inside, SaysWhyThereIsNone) {
  const auto inside = InsideBone::start(hold(failure(ErrorCode::denied, "your role may not")));
  const auto copy = std::make_shared<Copy>();
  inside->add(copy);
  ASSERT_TRUE(reaches(*inside, InsideState::failed));
  EXPECT_EQ(inside->status().why->message, "your role may not");
  inside->wake();
  inside->remove(*copy);
  EXPECT_EQ(copy->calls(), 0);
}

TEST_F(Inside, SaysSoWhenTheBoneIsGivenUpLater) {
  connect();
  const auto inside = InsideBone::start(hold(), {.period = kNoRest});
  const auto copy = std::make_shared<Copy>();
  inside->add(copy);
  ASSERT_TRUE(reaches(*inside, InsideState::follows));
  lose({{ErrorCode::denied, "you were taken out of the room"}, true});
  ASSERT_TRUE(reaches(*inside, InsideState::failed));
  EXPECT_EQ(inside->status().why->message, "you were taken out of the room");
}

TEST_F(Inside, EndsWhileThereIsNoBoneYet) {
  auto inside = InsideBone::start(hold(failure(ErrorCode::unavailable, "no server")));
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(inside->status().state, InsideState::begins);
  inside.reset();
}

// 1000 HU in all voxels: the block alone has other values.
struct Scanned {
  test::TempDir folder;
  Case bone = saved(folder / "case");
  static Case saved(const std::filesystem::path& folder) {
    const Case block = test::test_block();
    CaseScan scan;
    scan.geometry = {{30, 30, 20}, Vec3(-14.5, -14.5, -14.5), Vec3(1, 1, 1).asDiagonal()};
    scan.hu.assign(scan.geometry.count(), 1000);
    CaseInfo info = block.info();
    info.scan = describe_scan(scan).value();
    const CoordBox box = block.bounds_samples();
    DenseVolume<float> surface(box, 0.0f), density(box, 0.0f);
    block.gather_surface(box, surface.values);
    block.gather_density(box, density.values);
    const Case built = Case::build(info, surface, density).value();
    EXPECT_TRUE(built.save(folder, scan));
    return built;
  }
};

TEST(InsideOfAScannedCase, HasTheHuOfTheScanInItsFolder) {
  const Scanned scanned;
  test::FollowedRoom room(scanned.bone);
  const auto line = std::make_shared<LiveSource::Line>();
  line->taps = {room.open()};
  const std::shared_ptr<HeldBone> held = HeldBone::start(std::make_unique<LiveSource>(scanned.bone, line), kQuick);
  const auto inside = InsideBone::start(held, {.case_folder = scanned.folder / "case"});
  const auto copy = std::make_shared<Copy>();
  inside->add(copy);
  ASSERT_TRUE(wait_until([&] { return copy->calls() > 0; }, kPatience));
  EXPECT_TRUE(inside->status().from_scan);
  // The scan's box is larger than the bone's. Only samples beyond the faces of its outer voxels are air.
  const std::vector<float> values = copy->is();
  const auto scanned_hu = std::ranges::count_if(values, [](float hu) { return std::abs(hu - 1000.0f) < 1.0f; });
  EXPECT_GT(static_cast<double>(scanned_hu), 0.85 * static_cast<double>(values.size()));
}

TEST(InsideOfAScannedCase, HasThoseOfItsDensityWhenTheScanIsDamaged) {
  const Scanned scanned;
  std::ofstream(scanned.folder / "case" / kScanFile, std::ios::trunc) << "no scan";
  test::FollowedRoom room(scanned.bone);
  const auto line = std::make_shared<LiveSource::Line>();
  line->taps = {room.open()};
  const std::shared_ptr<HeldBone> held = HeldBone::start(std::make_unique<LiveSource>(scanned.bone, line), kQuick);
  const auto inside = InsideBone::start(held, {.case_folder = scanned.folder / "case"});
  const auto copy = std::make_shared<Copy>();
  inside->add(copy);
  ASSERT_TRUE(wait_until([&] { return copy->calls() > 0; }, kPatience));
  EXPECT_FALSE(inside->status().from_scan);
  ASSERT_TRUE(inside->status().scan_fault);
  EXPECT_NE(inside->status().scan_fault->message.find(kScanFile), std::string::npos);
}

}  // namespace
}  // namespace osteon
