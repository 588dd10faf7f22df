// A user's hand at a device, on virtual time: where the tool starts, what clutch and pedal do, and what happens to
// force and tool while the device is away.
#include "haptic_client/simulation/free_hand.hpp"

#include <gtest/gtest.h>

#include "common/core/check.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/device/recorded_device.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

// A handle that the test moves.
class Handle final : public HapticDevice {
 public:
  [[nodiscard]] std::string_view name() const override { return "handle"; }
  [[nodiscard]] DeviceLimits limits() const override { return limits_are; }
  [[nodiscard]] DeviceReading read() noexcept override { return reading; }
  void write(const DeviceOutput& output) noexcept override { written = output; }

  DeviceLimits limits_are{.peak_n = 60, .continuous_n = 30, .stiffness_n_per_mm = 60, .workspace_radius_mm = 120};
  DeviceReading reading;
  DeviceOutput written;
};

class FreeHand : public ::testing::Test {
 protected:
  // Starts at the top of the block, which is entered along +z. The user looks along +z.
  void begin(const char* tool = "drill-3.2", const char* view = "bottom", const Vec3& at_mm = {1, 2, 0}) {
    FreeHandOptions options{.tool = tool, .toward = *read_view(view), .at_mm = at_mm};
    Result<ReadyPlan> plan = make_free_hand(options, bone_);
    OSTEON_CHECK(plan.has_value());
    handle_.reading.pose_device_tool = {{5, 6, 7}, pointing_away()};
    session_ = std::make_unique<FreeHandSession>(std::move(*plan), handle_, 0.0);
  }
  SessionTick tick() {
    if (session_->loop().mapping().scale() > 0.0 && taken_)
      builder_.build(field_, session_->loop().tool(0), last_.report.pose_bone_proxy, patch_);
    last_ = session_->tick(patch_, RoomLink::follows);
    taken_ |= last_.order.take_up;
    return last_;
  }
  SessionTick move_by(const Vec3& device_mm, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      handle_.reading.pose_device_tool.position_mm += device_mm / ticks;
      tick();
    }
    return last_;
  }
  [[nodiscard]] double scale() const { return session_->loop().mapping().scale(); }
  [[nodiscard]] const Vec3& tip() const { return last_.report.pose_bone_proxy.position_mm; }

  Case bone_ = block_case();
  CutField field_{bone_, BodyId{}};
  Handle handle_;
  std::unique_ptr<FreeHandSession> session_;
  PatchBuilder builder_;
  Patch patch_;
  SessionTick last_;
  bool taken_ = false;
};

TEST_F(FreeHand, TheToolIsTakenUpOverItsPlaceWhereverTheHandleIs) {
  begin();
  const SessionTick first = tick();
  EXPECT_TRUE(first.order.take_up);
  EXPECT_EQ(first.order.phase, SurgeonPhase::free_hand);
  EXPECT_NEAR((first.report.pose_bone_device.position_mm - Vec3(1, 2, -10)).norm(), 0.0, 1e-9);
  // A handle that points away from the user holds a tool that points where the user looks.
  EXPECT_NEAR((first.report.pose_bone_device.direction(Vec3::UnitZ()) - Vec3::UnitZ()).norm(), 0.0, 1e-9);
  // Pushing the handle away moves the tool there, scaled, without force in the air.
  const SessionTick later = move_by({0, 0, -4}, 100);
  EXPECT_NEAR((tip() - Vec3(1, 2, -10 + 4 * scale())).norm(), 0.0, 1e-9);
  EXPECT_EQ(handle_.written.force_n.norm(), 0.0);
  EXPECT_FALSE(later.order.take_up);
  EXPECT_FALSE(session_->done());
}

TEST_F(FreeHand, TheHeadIsUpOnTheUsersScreen) {
  begin("drill-3.2", "front", {1, 2, 15});
  tick();
  Vec3 before = tip();
  move_by({0, 3, 0}, 30);  // up
  EXPECT_NEAR((tip() - before - Vec3(0, 0, 3 * scale())).norm(), 0.0, 1e-9);
  before = tip();
  move_by({3, 0, 0}, 30);  // right of a user who looks from the front is the patient's left
  EXPECT_NEAR((tip() - before - Vec3(3 * scale(), 0, 0)).norm(), 0.0, 1e-9);
}

TEST_F(FreeHand, NothingIsTakenUpBeforeTheDeviceIsCalibrated) {
  begin();
  handle_.reading.calibration = Calibration::pending;
  handle_.reading.buttons = kSpindlePedal;
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(tick().order.phase, SurgeonPhase::wait);
    EXPECT_EQ(last_.commanded_rpm, 0.0);
  }
  handle_.reading.calibration = Calibration::done;
  EXPECT_TRUE(tick().order.take_up);
}

TEST_F(FreeHand, APedalHalfDownGivesHalfTheSpeed) {
  begin();
  tick();
  const double full = session_->plan().steps[0].spindle_rpm;
  ASSERT_GT(full, 0.0);
  handle_.reading.pedal = 0.5;
  EXPECT_EQ(tick().commanded_rpm, 0.5 * full);
  handle_.reading.buttons = kSpindlePedal;
  EXPECT_EQ(tick().commanded_rpm, full);
  handle_.reading.status = DeviceStatus::fault;
  EXPECT_EQ(tick().commanded_rpm, 0.0);
}

TEST_F(FreeHand, TheClutchMovesTheHandleAlone) {
  begin();
  tick();
  move_by({0, 0, -2}, 50);
  const Vec3 held = tip();
  handle_.reading.buttons = kClutchButton;
  move_by({20, 10, 5}, 100);
  EXPECT_EQ((tip() - held).norm(), 0.0);
  EXPECT_EQ(handle_.written.force_n.norm(), 0.0);
  handle_.reading.buttons = 0;
  tick();
  EXPECT_NEAR((tip() - held).norm(), 0.0, 1e-9);
  move_by({1, 0, 0}, 20);
  EXPECT_NEAR((tip() - held).norm(), scale(), 1e-9);
}

// Pressed on the bone with the spindle off: the force ends in the tick in which the device is lost, and the tool stays.
// When the device returns elsewhere, the handle is coupled to the tool where that is, without force.
TEST_F(FreeHand, ALostDeviceHasNoForceAndTheToolWaits) {
  for (const DeviceStatus gone : {DeviceStatus::fault, DeviceStatus::absent}) {
    handle_ = {};
    taken_ = false;
    patch_ = {};
    begin();
    tick();
    move_by({0, 0, -10.4 / scale()}, 300);
    for (int i = 0; i < 400; ++i) tick();
    ASSERT_GT(handle_.written.force_n.z(), 2.0);
    const Vec3 held = tip();
    handle_.reading.status = gone;
    tick();
    EXPECT_EQ(handle_.written.force_n.norm(), 0.0);
    handle_.reading.pose_device_tool.position_mm = {-30, 20, 10};
    for (int i = 0; i < 100; ++i) tick();
    EXPECT_EQ(handle_.written.force_n.norm(), 0.0);
    EXPECT_EQ((tip() - held).norm(), 0.0);
    handle_.reading.status = DeviceStatus::ok;
    for (int i = 0; i < 100; ++i) {
      tick();
      EXPECT_NEAR(handle_.written.force_n.norm(), 0.0, 1e-6);
    }
    EXPECT_NEAR((tip() - held).norm(), 0.0, 0.02);
    // The force comes back when the handle is pressed again.
    move_by({0, 0, -0.3 / scale()}, 100);
    for (int i = 0; i < 600; ++i) tick();
    EXPECT_GT(handle_.written.force_n.z(), 1.0);
  }
}

TEST_F(FreeHand, ADeviceWithoutForceIsShownNone) {
  handle_.limits_are = {};
  handle_.limits_are.workspace_radius_mm = 60;
  begin();
  tick();
  move_by({0, 0, -10.5 / scale()}, 300);
  for (int i = 0; i < 300; ++i) tick();
  EXPECT_GT(last_.report.coupling.force_n.norm(), 5.0);  // what gauges and recordings show
  EXPECT_TRUE(last_.report.coupling.force_n.allFinite());
  EXPECT_NEAR(tip().z(), 0.0, 0.1);
}

TEST_F(FreeHand, DoesNotAllocate) {
  begin();
  tick();
  move_by({0, 0, -9.0 / scale()}, 50);
  const osteon::test::AllocationCounter heap;
  for (int i = 0; i < 200; ++i) {
    handle_.reading.pose_device_tool.position_mm.z() -= 0.01;
    handle_.reading.buttons = i / 50 == 2 ? kClutchButton : 0u;
    handle_.reading.status = i / 50 == 1 ? DeviceStatus::absent : DeviceStatus::ok;
    (void)session_->tick(patch_, RoomLink::follows);
  }
  EXPECT_EQ(heap.count(), 0);
}

// A hand's recording moves the tool again, including the force scale. The session ends with the recording.
TEST_F(FreeHand, ARecordingOfAHandIsDoneWhenItIsOver) {
  RecordedSession recorded;
  recorded.limits = handle_.limits_are;
  for (int i = 0; i <= 100; ++i) {
    DeviceReading reading;
    reading.pose_device_tool = {{5, 6, 7 - 0.04 * i}, pointing_away()};
    recorded.readings.push_back(reading);
  }
  Result<ReadyPlan> plan = make_free_hand({.tool = "drill-3.2", .toward = {0, 0, 1}, .at_mm = Vec3(1, 2, 0)}, bone_);
  ASSERT_TRUE(plan);
  RecordedDevice device("recorded", recorded);
  session_ = std::make_unique<FreeHandSession>(std::move(*plan), device, 0.25);
  int ticks = 0;
  for (; !session_->done() && ticks < 1000; ++ticks) tick();
  EXPECT_EQ(ticks, 101);
  EXPECT_EQ(session_->loop().params().force_scale, 0.25);
  EXPECT_NEAR((tip() - Vec3(1, 2, -10 + 4 * scale())).norm(), 0.0, 1e-9);
}

TEST(FreeHandView, IsNamedOrGiven) {
  EXPECT_EQ(*read_view("front"), Vec3(0, 1, 0));
  EXPECT_EQ(*read_view("top"), Vec3(0, 0, -1));
  EXPECT_EQ(*read_view("0,0,-2"), Vec3(0, 0, -1));
  EXPECT_EQ(*read_point("1.5,-2,3e1", "--at"), Vec3(1.5, -2, 30));
  for (const char* wrong : {"", "above", "1,2", "1,2,3,4", "0,0,0", "1,,2", "1,2,x", "nan,0,1", "1e300,0,1"})
    EXPECT_FALSE(read_view(wrong)) << wrong;
  EXPECT_NE(read_point("1;2;3", "--at").error().message.find("--at"), std::string::npos);
}

// Without an entry site, the tool starts over the side from which the user looks. It starts over the bone's middle, as
// far as a case knows it: a case's bounds are of whole leaves of eight samples.
TEST_F(FreeHand, LooksAtTheBonesMiddle) {
  FreeHandOptions options;
  options.tool = "drill-3.2";
  const std::pair<const char*, Vec3> views[] = {{"top", {0, 0, 30}},  {"bottom", {0, 0, 0}}, {"front", {0, -6, 15}},
                                                {"back", {0, 6, 15}}, {"left", {6, 0, 15}},  {"right", {-6, 0, 15}}};
  for (const auto& [view, entry] : views) {
    options.toward = *read_view(view);
    const Result<ReadyPlan> plan = make_free_hand(options, bone_);
    ASSERT_TRUE(plan) << plan.error().message;
    const Vec3 off_mm = plan->steps[0].site.entry_mm - entry;
    EXPECT_NEAR(off_mm.dot(options.toward), 0.0, 0.01) << view;
    EXPECT_LE(off_mm.cwiseAbs().maxCoeff(), 0.5 * 8 * bone_.pitch_mm()) << view;
    EXPECT_EQ(plan->steps[0].site.axis, options.toward);
  }
}

TEST(FreeHandTool, IsNamedWhereItIsNotKnown) {
  FreeHandOptions options;
  options.tool = "drill-99";
  const auto plan = make_free_hand(options, block_case());
  ASSERT_FALSE(plan);
  EXPECT_NE(plan.error().message.find("drill-99"), std::string::npos);
}

// A tool that takes no bone belongs into the scene, not into the hand.
TEST(FreeHandTool, TakesBone) {
  for (const Tool& tool : builtin_tools()) {
    FreeHandOptions options;
    options.tool = tool.name;
    const auto plan = make_free_hand(options, block_case());
    const bool scene = tool.name.starts_with("guide-") || tool.name.starts_with("trial-");
    EXPECT_EQ(plan.has_value(), !scene) << tool.name;
    if (scene && !plan) {
      EXPECT_NE(plan.error().message.find(tool.name + "\" takes no bone"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace osteon::haptic::test
