// Torque from the bone to the hand, through all parts. A drill whose shank leans on a wall is moved by the handle of a
// device with six degrees of freedom. The torque that prevents its turn is known in closed form: the wall's push times
// its arm from the tip.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/core/check.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/device/force_dimension.hpp"
#include "haptic_client/simulation/free_hand.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/haptic_client/device/devices.hpp"

namespace osteon::haptic::test {
namespace {

constexpr double kReach_mm = 80.0, kRadius_mm = 1.6;  // of drill-3.2 and its shank
// Distance of the rings of points along the shank.
constexpr double kRing_mm = 1.2;

double dense(const Vec3&) { return 1.9; }

// Bone where x < 0.
Case wall() {
  return osteon::test::make_bone(
      {Vec3(-8, -10, -95), Vec3(4, 10, 12)}, 0.5, [](const Vec3& p) { return p.x(); }, dense);
}

// The handle's rotation in which the tool stands along the wall, with +z out of its tip. Its other end leans towards
// the wall by this angle. The user looks at the wall: device x, y, z are the bone's y, z, x.
Eigen::Quaterniond leaning(double angle_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad - 0.5 * std::numbers::pi, Vec3::UnitX()));
}

// A hand at a device in front of a bone, with the patches that its thread would build.
class Before {
 public:
  Before(Case bone, const Vec3& at_mm, const Vec3& toward, HapticDevice& device)
      : bone_(std::move(bone)), field_(bone_, BodyId{}) {
    Result<ReadyPlan> plan = make_free_hand({.tool = "drill-3.2", .toward = toward, .at_mm = at_mm}, bone_);
    OSTEON_CHECK(plan.has_value());
    session_ = std::make_unique<FreeHandSession>(std::move(*plan), device, 0.0);
  }
  const LoopReport& tick() {
    if (taken_ && ticks_++ % 12 == 0)
      builder_.build(field_, session_->loop().tool(0), last_.report.pose_bone_proxy, patch_);
    last_ = session_->tick(patch_, RoomLink::follows);
    taken_ |= last_.order.take_up;
    return last_.report;
  }
  void wait(int ticks) {
    for (int i = 0; i < ticks; ++i) tick();
  }
  [[nodiscard]] const LoopReport& report() const { return last_.report; }
  [[nodiscard]] double force_scale() const { return session_->loop().params().force_scale; }
  [[nodiscard]] double workspace_scale() const { return session_->loop().mapping().scale(); }
  [[nodiscard]] double coupling_n_per_mm() const { return session_->loop().coupling_n_per_mm(); }
  // How far the hand's target for the tip is beyond the point where the shank's end touches the wall.
  [[nodiscard]] double beyond_mm() const {
    const Pose& pose = report().pose_bone_device;
    const double lean = std::asin(pose.direction(Vec3::UnitZ()).x());
    return kReach_mm * std::sin(lean) + kRadius_mm * std::cos(lean) - pose.position_mm.x() -
           report().coupling.offset_mm.x();
  }
  // The wall's push times its arm from the tip. It acts on the rim of the shank's end, at right angles to the wall.
  [[nodiscard]] Vec3 arm_times_force() const {
    const Vec3 axis = report().pose_bone_proxy.direction(Vec3::UnitZ());
    const Vec3 to_rim = (axis.x() * axis - Vec3::UnitX()).normalized();
    return (kRadius_mm * to_rim - kReach_mm * axis).cross(report().coupling.force_n);
  }

 private:
  Case bone_;
  CutField field_;
  std::unique_ptr<FreeHandSession> session_;
  PatchBuilder builder_;
  Patch patch_;
  SessionTick last_;
  int ticks_ = 0;
  bool taken_ = false;
};

// Limits of the stand-in for an omega.7 or sigma.7.
const DeviceLimits kSixAxes{.peak_n = 12,
                            .continuous_n = 4,
                            .stiffness_n_per_mm = 4,
                            .workspace_radius_mm = 90,
                            .damping_n_s_per_mm = 0,
                            .peak_nmm = 200,
                            .continuous_nmm = 70};

// A handle that the test moves.
class TurnedHandle final : public HapticDevice {
 public:
  [[nodiscard]] std::string_view name() const override { return "handle"; }
  [[nodiscard]] DeviceLimits limits() const override { return limits_are; }
  [[nodiscard]] DeviceReading read() noexcept override { return reading; }
  void write(const DeviceOutput& output) noexcept override { written = output; }

  DeviceLimits limits_are = kSixAxes;
  DeviceReading reading;
  DeviceOutput written;
};

// A torque is scaled as the work of a force is: s over the workspace's scale. At 0.6, 4 N/mm are K_c of 50 N/mm at s =
// 4/30.
constexpr double kShown = 4.0 / 30.0 / 0.6;

// Leans towards the wall in the air. Then presses on until its tip would be `beyond_mm` beyond where its end touches.
void press(Before& wall, TurnedHandle& handle, double lean_rad, double beyond_mm) {
  handle.reading.pose_device_tool = {Vec3::Zero(), leaning(lean_rad)};
  wall.wait(400);  // by then all of the force is shown
  const double way_mm = (beyond_mm - wall.beyond_mm()) / wall.workspace_scale();
  constexpr int kTicks = 600;
  for (int i = 1; i <= kTicks; ++i) {
    handle.reading.pose_device_tool.position_mm.z() = -way_mm * i / kTicks;
    wall.tick();
  }
  wall.wait(600);
}

// Two springs in series bear the push at the end of the shank: the tip's, and the turn's on its arm.
double push_n(const Before& wall) {
  const double arm = kReach_mm / Proxy::kTurnArm_mm;
  return wall.coupling_n_per_mm() * wall.beyond_mm() / (1.0 + arm * arm);
}

TEST(TorqueOnTheHand, IsTheWallsPushTimesItsArm) {
  for (const double beyond_mm : {1.0, 3.0}) {
    TurnedHandle handle;
    Before side(wall(), {0, 0, 0}, {-1, 0, 0}, handle);
    press(side, handle, 0.06, beyond_mm);
    EXPECT_NEAR(side.beyond_mm(), beyond_mm, 1e-9);
    const LoopReport& report = side.report();
    const Vec3 &force_n = report.coupling.force_n, &torque_nmm = report.coupling.torque_nmm;
    std::printf(
        "  simulated: %.2f N (closed form %.2f) at the end of %.0f mm, torque %.1f N mm (%.1f), on the device %.1f\n",
        force_n.norm(), push_n(side), kReach_mm, torque_nmm.norm(), side.arm_times_force().norm(),
        handle.written.torque_nmm.norm());
    EXPECT_GT(force_n.x(), 0.999 * force_n.norm());  // the wall is smooth
    EXPECT_NEAR((torque_nmm - side.arm_times_force()).norm(), 0.0, kRing_mm * force_n.norm());
    // Points lie within the tool by half a patch pitch and a quantum, a hundredth of a millimetre.
    EXPECT_NEAR(force_n.norm(), push_n(side), push_n(side) * (0.02 + 0.07 / beyond_mm));
    // Scaled on the device as the force's work is, in the device's own frame.
    EXPECT_NEAR(side.force_scale(), 4.0 / 30.0, 1e-12);
    EXPECT_NEAR(side.workspace_scale(), 0.6, 1e-12);
    const Vec3 in_device_nmm(torque_nmm.y(), torque_nmm.z(), torque_nmm.x());
    EXPECT_NEAR((handle.written.torque_nmm - kShown * in_device_nmm).norm(), 0.0, 1e-9);
    EXPECT_LT(handle.written.torque_nmm.x(), 0.0);  // it leans about +x and is turned back
  }
}

// The hand turns on by 40 mrad and does not move. The end of the shank would go 3.18 mm further into the wall, 80 (sin
// 0.10 - sin 0.06) less what its rim turns away.
// Force and torque rise as if it had been pressed there, and fall as it turns back. On a device of three axes, where
// turning costs the hand nothing, the force may not rise.
TEST(TorqueOnTheHand, ATurnAgainstAWallIsFeltAsForceAndTorque) {
  constexpr double kFrom_rad = 0.06, kTo_rad = 0.10, kBeyond_mm = 0.5;
  const double to_mm = kBeyond_mm + kReach_mm * (std::sin(kTo_rad) - std::sin(kFrom_rad)) +
                       kRadius_mm * (std::cos(kTo_rad) - std::cos(kFrom_rad));
  for (const bool six_axes : {true, false}) {
    TurnedHandle handle;
    if (!six_axes) handle.limits_are.peak_nmm = handle.limits_are.continuous_nmm = 0.0;
    Before side(wall(), {0, 0, 0}, {-1, 0, 0}, handle);
    press(side, handle, kFrom_rad, kBeyond_mm);
    const double before_n = side.report().coupling.force_n.norm(), before_nmm = handle.written.torque_nmm.norm();
    const auto turn = [&](double from_rad, double to_rad) {
      constexpr int kTicks = 600;
      for (int i = 1; i <= kTicks; ++i) {
        handle.reading.pose_device_tool.rotation = leaning(from_rad + (to_rad - from_rad) * i / kTicks);
        side.tick();
      }
      side.wait(600);
    };
    turn(kFrom_rad, kTo_rad);
    const LoopReport& report = side.report();
    const double force_n = report.coupling.force_n.norm(), torque_nmm = handle.written.torque_nmm.norm();
    if (!six_axes) {
      EXPECT_LE(force_n, before_n + 0.05);
      continue;
    }
    // As push_n(), from the handle's motion alone, whatever the loop let go.
    const double arm = kReach_mm / Proxy::kTurnArm_mm,
                 expected_n = side.coupling_n_per_mm() * to_mm / (1.0 + arm * arm);
    std::printf(
        "  simulated: turned on by 40 mrad, %.2f N (closed form %.2f, before %.2f), %.1f N mm on the device (%.1f, "
        "%.1f)\n",
        force_n, expected_n, before_n, torque_nmm, kShown * kReach_mm * expected_n, before_nmm);
    EXPECT_NEAR(force_n, expected_n, expected_n * (0.02 + 0.07 / to_mm));
    EXPECT_NEAR(torque_nmm, kShown * kReach_mm * expected_n, kShown * kReach_mm * expected_n * (0.02 + 0.07 / to_mm));
    EXPECT_NEAR((report.coupling.torque_nmm - side.arm_times_force()).norm(), 0.0, kRing_mm * force_n);
    EXPECT_GT(force_n, 5.0 * before_n);

    TurnedHandle other;
    Before pressed(wall(), {0, 0, 0}, {-1, 0, 0}, other);
    press(pressed, other, kTo_rad, to_mm);
    EXPECT_NEAR(pressed.report().coupling.force_n.norm(), force_n, 0.02 * force_n);
    EXPECT_NEAR(other.written.torque_nmm.norm(), torque_nmm, 0.02 * torque_nmm);

    turn(kTo_rad, kFrom_rad);
    EXPECT_NEAR(side.report().coupling.force_n.norm(), before_n, 0.02 * force_n);
    EXPECT_NEAR(handle.written.torque_nmm.norm(), before_nmm, 0.02 * torque_nmm);
  }
}

TEST(TorqueOnTheHand, IsWithinTheDevicesLimit) {
  TurnedHandle handle;
  Before side(wall(), {0, 0, 0}, {-1, 0, 0}, handle);
  press(side, handle, 0.1, 7.5);
  EXPECT_GT(kShown * side.report().coupling.torque_nmm.norm(), 220.0);
  EXPECT_NEAR(handle.written.torque_nmm.norm(), 200.0, 1e-9);
  EXPECT_LT(handle.written.torque_nmm.x(), -199.0);
  // Warm motors bear a third.
  handle.reading.status = DeviceStatus::warm;
  side.wait(5);
  EXPECT_NEAR(handle.written.torque_nmm.norm(), 70.0, 1e-9);
}

// A device of three axes shows the same force and no torque.
TEST(TorqueOnTheHand, IsNoForceWhereItCannotBeShown) {
  TurnedHandle six, three;
  three.limits_are.peak_nmm = three.limits_are.continuous_nmm = 0.0;
  Before of_six(wall(), {0, 0, 0}, {-1, 0, 0}, six), of_three(wall(), {0, 0, 0}, {-1, 0, 0}, three);
  press(of_six, six, 0.06, 3.0);
  press(of_three, three, 0.06, 3.0);
  EXPECT_EQ(three.written.torque_nmm, Vec3::Zero().eval());
  EXPECT_EQ(three.written.force_n, six.written.force_n);
  EXPECT_GT(six.written.torque_nmm.norm(), 50.0);
}

// A drill cannot turn sideways in a hole as wide as itself. Beyond its play the torque rises with the turn's own
// spring, K times the square of its arm. It ends when the hand turns back.
TEST(TorqueOnTheHand, InAHoleIsThatOfTheTurn) {
  constexpr double kDeep_mm = 30.0;
  const Case bone = osteon::test::make_bone(
      {Vec3(-10, -10, -3), Vec3(10, 10, 44)}, 0.5,
      [](const Vec3& p) {
        const double in_hole = std::max(std::hypot(p.x(), p.y()) - 1.7, p.z() - kDeep_mm - 10.0);
        return std::max(-p.z(), -in_hole);
      },
      dense);
  TurnedHandle handle;
  handle.reading.pose_device_tool.rotation = pointing_away();
  Before hole(bone, {0, 0, kDeep_mm + 10.0}, {0, 0, 1}, handle);  // starts 10 mm over the bottom of the hole
  hole.wait(400);
  EXPECT_NEAR(hole.report().pose_bone_proxy.position_mm.z(), kDeep_mm, 0.3);
  EXPECT_EQ(handle.written.torque_nmm.norm(), 0.0);
  double nmm[3];
  const double turn[3] = {0.025, 0.035, 0.045};  // within the device's limit
  for (int i = 0; i < 3; ++i) {
    const double from = i > 0 ? turn[i - 1] : 0.0;
    for (int t = 1; t <= 100; ++t) {
      const Eigen::AngleAxisd turned(from + 0.01 * t * (turn[i] - from), Vec3::UnitX());
      handle.reading.pose_device_tool.rotation = turned * pointing_away();
      hole.tick();
    }
    hole.wait(300);
    nmm[i] = handle.written.torque_nmm.x();
    EXPECT_NEAR(handle.written.torque_nmm.norm(), -nmm[i], 0.02 * std::abs(nmm[i]) + 0.5);
  }
  const double per_rad = kShown * hole.coupling_n_per_mm() * Proxy::kTurnArm_mm * Proxy::kTurnArm_mm;
  std::printf("  simulated: %.0f N mm/rad in a hole (closed form %.0f)\n", (nmm[0] - nmm[2]) / (turn[2] - turn[0]),
              per_rad);
  EXPECT_NEAR((nmm[0] - nmm[1]) / (turn[1] - turn[0]), per_rad, 0.02 * per_rad);
  EXPECT_NEAR((nmm[1] - nmm[2]) / (turn[2] - turn[1]), per_rad, 0.02 * per_rad);
  // Its play of 0.1 mm, and as much again for inset points and a field between samples, at either end of 30 mm.
  const double free_rad = turn[0] + nmm[0] / per_rad;
  EXPECT_GT(free_rad, 0.0);
  EXPECT_LT(free_rad, 2.0 * 0.25 / kDeep_mm);
  handle.reading.pose_device_tool.rotation = pointing_away();
  hole.wait(100);
  EXPECT_NEAR(handle.written.torque_nmm.norm(), 0.0, 1e-6);
}

// The same wall through our stand-in for Force Dimension's library: a sigma.7 whose simulated hand holds the handle.
// The test controls time: one tick, and one cycle of the device with what the tick has written.
class Sigma : public WithArm {
 protected:
  Sigma() {
    arm()->type = 104;
    arm()->output_axes = 6;
    lean(0.06);
    // However long the machine suspends a thread, no force ends between two ticks.
    device_ = make_force_dimension(
        {.library = OSTEON_STAND_IN_DHD, .period = std::chrono::microseconds(0), .force_held = std::chrono::hours(1)});
  }
  ~Sigma() override { arm()->until = ~std::uint64_t{0}; }
  // Where the vendor's handle is level, ours points away. Its y is our x.
  static void lean(double angle_rad) {
    const double half = 0.5 * angle_rad + 0.25 * std::numbers::pi;
    arm()->rotation[0] = std::cos(half);
    arm()->rotation[2] = std::sin(half);
  }
  static Vec3 shown() { return {arm()->torque_nmm[0], arm()->torque_nmm[1], arm()->torque_nmm[2]}; }
  void tick(Before& side) {
    side.tick();
    const DeviceOutput written{side.report().device.force_n, side.report().device.torque_nmm};
    ++arm()->until;
    const auto began = std::chrono::steady_clock::now();
    do {
      device_->write(written);
      std::this_thread::yield();
    } while (device_->read().sample <= sample_ && std::chrono::steady_clock::now() - began < kPatience);
    sample_ = device_->read().sample;
  }
  // The hand moves the handle back to where it began. Nobody presses and nothing pushes.
  bool release() {
    device_->write({});
    arm().hand(0.0, 0.0, 0.0);
    arm()->until = arm()->cycles + 2000;
    const bool there = wait_until([] { return arm()->cycles == arm()->until; }, kPatience);
    sample_ = device_->read().sample;
    return there;
  }
  // The hand moves its target steadily, and stays there.
  void lead(Before& side, double from_mm, double to_mm, int ticks) {
    for (int i = 1; i <= 2 * ticks; ++i) {
      arm().hand(0.0, 0.0, from_mm + (to_mm - from_mm) * std::min(1.0, static_cast<double>(i) / ticks));
      tick(side);
    }
  }
  // Pressed on the wall. True if the hand is at rest, with no stretch let go.
  bool press(Before& side) {
    lead(side, 0.0, 0.0, 160);  // by then all of the force is shown
    lead(side, 0.0, -14.0, 250);
    const Vec3 before = shown();
    tick(side);
    return (shown() - before).norm() < 1e-2 && (shown() - side.report().device.torque_nmm).norm() < 1e-2 &&
           side.report().coupling.offset_mm.norm() < 0.1;
  }
  std::unique_ptr<HapticDevice> device_;
  std::uint64_t sample_ = 0;
};

TEST_F(Sigma, AWallsTorqueReachesItsMotors) {
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(device_->limits().peak_nmm, 200.0);
  ASSERT_TRUE(release());
  Before side(wall(), Vec3(0, 0, 0), Vec3(-1, 0, 0), *device_);
  ASSERT_TRUE(press(side));
  const double shown_by = side.force_scale() / side.workspace_scale();
  const double expected_nmm = shown_by * kReach_mm * push_n(side);
  EXPECT_NEAR(shown_by, kShown, 1e-12);
  std::printf("  simulated sigma.7: %.1f N mm at its motors, closed form %.1f\n", shown().norm(), expected_nmm);
  EXPECT_GT(shown().norm(), 80.0);
  EXPECT_NEAR(shown().norm(), expected_nmm, expected_nmm * (0.02 + 0.07 / side.beyond_mm()));
  EXPECT_LT(shown().x(), -0.99 * shown().norm());
  const Vec3 arm_nmm = shown_by * side.arm_times_force();
  EXPECT_NEAR((shown() - Vec3(arm_nmm.y(), arm_nmm.z(), arm_nmm.x())).norm(), 0.0,
              shown_by * kRing_mm * side.report().coupling.force_n.norm());
  EXPECT_EQ(arm()->unsafe_forces, 0u);
  EXPECT_EQ(arm()->misuse, 0u);
}

}  // namespace
}  // namespace osteon::haptic::test
